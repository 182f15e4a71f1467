#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/surface/depth_plane.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/rise_rule.hpp>
#include <nook/surface/slice.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/surface/tap_pattern.hpp>
#include <nook/work_map.hpp>

/// How kernels walk along slices: where the samples of a row lie, and how high above the tangent
/// plane of a pixel they stand in their slice.
namespace nook::inline NOOK_TARGET::detail {

inline constexpr int largest_slices = 64, largest_slice_taps = 512;

/// What the kernels over slices have in common; lengths are the caller's.
struct SliceSettings {
    double radius;
    int slices, steps;
    double thickness;
    std::optional<double> bias;
    int max_pixels;
    std::uint32_t seed;

    /// False where every pixel is open by definition.
    [[nodiscard]] bool ask_for_work() const
    {
        return radius > 0 && slices > 0 && steps > 0 && thickness > 0;
    }
    /// Keeps scaled lengths in the range of float; no depth holds detail of such a size.
    [[nodiscard]] double bounded_radius() const
    {
        return radius > 0 ? (std::min)((std::max)(radius, 0x1p-100), 0x1p+100) : 1;
    }
};

[[nodiscard]] inline Error check_slices(const SliceSettings& settings)
{
    if (const Error error = check_at_least(settings.radius, 0, "options.radius", "a length >= 0"))
        return error;
    if (settings.slices < 0 || settings.slices > largest_slices)
        return {ErrorCode::bad_value, "options.slices", double(settings.slices), "0 to 64"};
    if (settings.steps < 0 || settings.steps > largest_slice_taps)
        return {ErrorCode::bad_value, "options.steps", double(settings.steps), "0 to 512"};
    if (settings.slices * settings.steps > largest_slice_taps)
        return {ErrorCode::bad_value, "options.steps", double(settings.steps),
                "at most 512 / slices"};
    if (is_nan(settings.thickness) || settings.thickness < 0)
        return {ErrorCode::bad_value, "options.thickness", settings.thickness, "a length >= 0"};
    if (settings.bias)
        if (const Error error = check_at_least(*settings.bias, 0, "options.bias", "a number >= 0"))
            return error;
    if (settings.max_pixels < 1 || settings.max_pixels > 4096)
        return {ErrorCode::bad_value, "options.max_pixels", double(settings.max_pixels),
                "1 to 4096 pixels"};
    return {};
}

/// Slices and samples of a row of pixels, in parts of the disc that they reach.
///
/// Slice k of n has the angle π (k + u) / n, sample j of m the distance ((j + w) / m)² on either
/// side; u and w differ from row to row by irrational steps, w from slice to slice too.
struct SlicePattern {
    int slices, steps, taps;
    float cosine[largest_slices], sine[largest_slices];
    /// By slices, then outwards: those to the right, or up, and then those opposite. Readable by
    /// sixteens.
    float distance[2 * largest_slice_taps + 16];
    float right[2 * largest_slice_taps + 16], down[2 * largest_slice_taps + 16];

    SlicePattern(int slice_count, int step_count, int y, std::uint32_t seed)
        : slices{slice_count},
          steps{step_count},
          taps{slice_count * step_count}
    {
        const double turn = row_turn(y, seed);
        // The plastic ratio's multiples share no rhythm with those of the golden one.
        const double shift =
            (static_cast<std::uint32_t>(y) * 0x91e10da5u + scattered(~seed)) * 0x1p-32;
        int tap = 0;
        for (int k = 0; k < slices; ++k) {
            const double angle = std::numbers::pi * (k + turn) / slices;
            cosine[k] = static_cast<float>(std::cos(angle));
            sine[k] = static_cast<float>(std::sin(angle));
            double w = shift + k * 0.6180339887498949;
            w -= std::floor(w);
            for (int j = 0; j < steps; ++j, ++tap) {
                const double part = (j + w) / steps;
                distance[tap] = distance[tap + taps] = static_cast<float>(part * part);
                right[tap] = cosine[k];
                down[tap] = -sine[k];
                right[tap + taps] = -cosine[k];
                down[tap + taps] = sine[k];
            }
        }
        for (tap = 2 * taps; tap % 16 != 0; ++tap) distance[tap] = right[tap] = down[tap] = 0;
    }
};

/// Places of samples along the axis that has more pixels, and what a pixel of that is along both.
struct SlicePlaces {
    float reach;  ///< in pixels
    Reach pixel;

    SlicePlaces(const Reach& whole, const ReachRule& rule)
        : reach{static_cast<float>((std::max)(whole.x, whole.y))},
          pixel{rule.fx / (std::max)(rule.fx, rule.fy), rule.fy / (std::max)(rule.fx, rule.fy),
                whole.slope}
    {}
    /// How far a sample lies: a pixel away at least. A number or lanes.
    template <class Floats>
    [[nodiscard]] NOOK_INLINE Floats pixels(const Floats& distance) const
    {
        return larger(Floats(distance * reach), Floats(Floats{} + 1.0f));
    }
};

/// The neighbours of a group, in the order of the pattern.
template <class Real>
struct SliceTaps : TapList<Real, 2 * largest_slice_taps> {
    /// How far those of the first half are, as slopes.
    Real length[largest_slice_taps + 16];

    void fill(const SlicePattern& pattern, const DepthPlane<Real>& plane, const ReachRule& rule,
              const Reach& reach, int x, int y)
    {
        constexpr int floats = float_lanes, wide = lanes_of<Real>;
        alignas(64) float right[2 * largest_slice_taps + 16], down[2 * largest_slice_taps + 16];
        const SlicePlaces places{reach, rule};
        for (int i = 0; i < 2 * pattern.taps; i += floats) {
            using Floats = Lanes<float, floats>;
            const Floats pixels = places.pixels(load<floats>(pattern.distance + i));
            store(right + i, rounded(Floats(pixels * load<floats>(pattern.right + i))));
            store(down + i, rounded(Floats(pixels * load<floats>(pattern.down + i))));
        }
        this->add(plane, rule, places.pixel, x, y, right, down, 2 * pattern.taps);
        for (int i = 0; i < pattern.taps; i += wide) {
            using Vector = Lanes<Real, wide>;
            const Vector gx = load<wide>(this->slope_x + i), gy = load<wide>(this->slope_y + i);
            store(length + i, square_root(Vector(gx * gx + gy * gy)));
        }
    }
};

/// Everything that does not change from pixel to pixel; lengths are scaled.
struct SliceShade {
    RiseRule rise;
    double square_radius, thickness;
    /// A height field: whatever is seen hides all that lies behind it.
    bool solid;

    SliceShade(const SliceSettings& settings, double scale, const DepthStep& step, double rounding,
               bool orthographic)
    {
        const double radius = settings.bounded_radius() * scale;
        rise = {{step.constant * scale, step.linear, step.quadratic / scale},
                rounding,
                settings.bias.value_or(-1),
                radius,
                orthographic};
        square_radius = radius * radius;
        solid = !is_finite(settings.thickness) ||
                settings.thickness >= settings.bounded_radius() * 0x1p20;
        thickness = solid ? 0 : settings.thickness / settings.bounded_radius() * radius;
    }
};

/// How high a sample stands above the tangent of a slice, and how far along it: tan ε = above /
/// beside.
template <class Real>
struct Elevation {
    Real above, beside;
};

/// A bit per tap.
struct TapBits {
    std::uint64_t words[2 * largest_slice_taps / 64];

    NOOK_INLINE void set_all(int taps)
    {
        for (int first = 0; first < taps; first += 64) words[first / 64] = ~std::uint64_t{0};
    }
    [[nodiscard]] NOOK_INLINE bool operator[](int tap) const
    {
        return (words[tap / 64] >> (tap % 64) & 1u) != 0;
    }
    [[nodiscard]] NOOK_INLINE int count(int taps) const
    {
        int sum = 0;
        for (int first = 0; first < taps; first += 64) sum += std::popcount(words[first / 64]);
        return sum;
    }
    /// Whether any of [first, last) is set.
    [[nodiscard]] NOOK_INLINE bool any(int first, int last) const
    {
        for (int tap = first; tap < last; ++tap)
            if ((*this)[tap]) return true;
        return false;
    }
};

/// Some pixels of a group, side by side, and what they see of their neighbours.
template <class Real, bool orthographic>
struct SlicePixels {
    static constexpr int lanes = lanes_of<Real>;
    /// So many pixels side by side that most samples of a slice count for one of them, if any does.
    static constexpr bool wide = lanes > 8;
    using Vector = Lanes<Real, lanes>;

    Vector distance, nx, ny, nz;
    ViewDirection<Vector> view;
    Vector along;
    RiseRule::Rise<Vector> rise;
    Real square_radius;

    SlicePixels(const SurfaceGroup<Real>& group, int first, double slope, const SliceShade& shade)
        : distance{load<lanes>(group.distance + first)},
          nx{load<lanes>(group.normal.x + first)},
          ny{load<lanes>(group.normal.y + first)},
          nz{load<lanes>(group.normal.z + first)},
          view{load<lanes>(group.slope_x + first), Vector(Vector{} + group.slope_y)},
          along{nx * load<lanes>(group.slope_x + first) + ny * group.slope_y - nz},
          rise{shade.rise.at(distance, Vector(larger(along, Vector(-along))), slope)},
          square_radius{static_cast<Real>(shade.square_radius)}
    {}

    [[nodiscard]] NOOK_INLINE SliceFrame<Vector> frame(const SlicePattern& pattern, int slice) const
    {
        return {static_cast<Real>(pattern.cosine[slice]),
                static_cast<Real>(pattern.sine[slice]),
                view,
                nx,
                ny,
                nz};
    }
    /// What neighbours on both sides of a pixel share.
    struct Offset {
        Vector view, normal, beside, square_across;
    };
    [[nodiscard]] NOOK_INLINE Offset offset(const Vector& facing, Real gx, Real gy,
                                            Real length) const
    {
        const Vector along_view = gx * view.x + gy * view.y;
        return {along_view, gx * nx + gy * ny, length * facing,
                length * length - along_view * along_view};
    }
    /// Marks the taps that may count: those that stand above the tangent plane by more than the bias
    /// forgives whatever their distance. Most do not, and their slices need no frame.
    [[nodiscard]] NOOK_INLINE bool find_hits(const SliceTaps<Real>& taps, int count,
                                             const Real* data, TapBits& hits) const
    {
        std::uint64_t found = 0;
        for (int first = 0; first < count; first += 64) {
            std::uint64_t bits = 0;
            const int last = (std::min)(count - first, 64);
            for (int k = 0; k < last; ++k) {
                const int i = first + k;
                const Vector there = load<lanes>(data + taps.index[i]);
                const Vector normal = taps.slope_x[i] * nx + taps.slope_y[i] * ny;
                const Vector scale = orthographic ? Vector(Vector{} + Real{1}) : there;
                const Vector above = along * (there - distance) + scale * normal;
                const auto may = (there > Real{0}) & (above > Real{0}) &
                                 (above > rise.constant + rise.per_distance * there);
                bits |= std::uint64_t{any(may)} << k;
            }
            hits.words[first / 64] = bits;
            found |= bits;
        }
        return found != 0;
    }
    /// What the offsets in a slice need.
    [[nodiscard]] NOOK_INLINE static Vector facing(const SliceFrame<Vector>& slice)
    {
        return slice.along_view * slice.square_across;
    }
    /// Calls found(counts, elevation) for the neighbour at `there` on a side, where `counts` are
    /// the lanes that see an occluder. Lengths along the tangent come out × |D⊥| × |n_p|, heights ×
    /// |n_p|.
    ///
    /// Whole pixels lie beside the slice. A neighbour keeps its height above the tangent plane, so
    /// that flat ground stays flat, and for its place on the tangent it counts as if it had been
    /// met in the slice, as far away on the screen.
    template <int side, class Found>
    NOOK_INLINE void look(const Vector& there, const SliceFrame<Vector>& slice, const Offset& to,
                          const Found& found) const
    {
        const Vector step = there - distance;
        const Vector scale = orthographic ? Vector(Vector{} + Real{1}) : there;
        const Vector sided = side > 0 ? scale : Vector(-scale);
        const Vector above = along * step + sided * to.normal;
        const Vector toward = sided * to.view - view.length * step;
        const Vector square = toward * toward + scale * scale * to.square_across;
        const Vector least = rise.constant + rise.per_distance * there + rise.per_square * square;
        const auto counts =
            (there > Real{0}) & (square <= square_radius) & (above > least) & (above > Real{0});
        const Vector lean = slice.normal_across * toward;
        const Vector beside = scale * to.beside;
        const Vector met = side > 0 ? beside - lean : beside + lean;
        // Not beyond the direction to the viewer, where this side of the slice ends.
        const Vector end = above * (side > 0 ? Vector(-slice.edge) : slice.edge);
        found(counts,
              Elevation<Vector>{above, slice.along_view > Real{0} ? larger(met, end) : met});
    }
};

/// The measure of a slice below an elevation from the sine and cosine of that, times the length of
/// the normal's projection: `slice_hidden` on lanes.
template <int side, class Vector>
[[nodiscard]] NOOK_INLINE Vector hidden_below(const Vector& s, const Vector& c,
                                              const SliceFrame<Vector>& slice)
{
    using Value = typename LanesTraits<Vector>::Value;
    const Vector lean = slice.along_tangent * disc_segment(c, s);
    const Vector sum = slice.along_view * s * s + (side > 0 ? lean : Vector(-lean));
    return larger(Vector(sum * Value{0.5}), Vector{});
}
/// The length of the vector behind an elevation that `look` has found. Never 0: where the squares
/// underflow nothing is hidden.
template <class Vector>
[[nodiscard]] NOOK_INLINE Vector span(const Elevation<Vector>& at)
{
    using Value = typename LanesTraits<Vector>::Value;
    return square_root(
        Vector(at.above * at.above + at.beside * at.beside + static_cast<Value>(1e-36)));
}
/// What lies below elevations of both sides, by one division.
template <class Vector>
[[nodiscard]] NOOK_INLINE Vector hidden_below(Elevation<Vector> right, Elevation<Vector> left,
                                              const SliceFrame<Vector>& slice)
{
    right.above = right.above * slice.across;
    left.above = left.above * slice.across;
    const Vector a = span(right), b = span(left);
    const Vector inverse = (Vector{} + 1) / (a * b);
    const Vector per_a = inverse * b, per_b = inverse * a;
    return hidden_below<1, Vector>(right.above * per_a, right.beside * per_a, slice) +
           hidden_below<-1, Vector>(left.above * per_b, left.beside * per_b, slice);
}
/// What lies below the near and the far end of a sample, which reaches `thickness` away from the
/// viewer; nothing below the far end where that lies below the tangent.
template <class Vector>
struct HiddenByEnds {
    Vector front, back;
};
template <int side, class Vector, class Real>
[[nodiscard]] NOOK_INLINE HiddenByEnds<Vector> hidden_below_ends(Elevation<Vector> front,
                                                                 const SliceFrame<Vector>& slice,
                                                                 Real thickness)
{
    const Vector zero{};
    const Vector moved = thickness * slice.normal_across;
    Elevation<Vector> back{(front.above - thickness * slice.along_view) * slice.across,
                           side > 0 ? front.beside + moved : front.beside - moved};
    front.above = front.above * slice.across;
    const Vector a = span(front), b = span(back);
    const Vector inverse = (zero + 1) / (a * b);
    const Vector per_a = inverse * b, per_b = inverse * a;
    const Vector hidden =
        hidden_below<side, Vector>(back.above * per_b, back.beside * per_b, slice);
    return {hidden_below<side, Vector>(front.above * per_a, front.beside * per_a, slice),
            back.above > zero ? hidden : zero};
}

/// Runs a kernel over slices: part(pixels, taps, pattern, data, hits) gives the visibility of some
/// pixels of a group, whose neighbours stand in `data` at the indices of the taps; those that are no
/// hits need no look.
template <bool orthographic, class Source, class Value, class Part, class S, class E>
Outcome run_slices(const SurfaceInput<Source>& input, const ImageView<Value>& visibility,
                   const SliceSettings& settings, const SliceShade& shade, const Part& part,
                   S&& scratch, E&& executor)
{
    using Real = typename Source::Distance;
    using Pixels = SlicePixels<Real, orthographic>;
    const bool work = settings.ask_for_work();
    const int slices = work ? settings.slices : 0, steps = work ? settings.steps : 0;
    const ReachRule rule{input.plane, settings.bounded_radius(), input.projection,
                         settings.max_pixels};
    struct Row {
        SlicePattern pattern;
        RowMemory memory{};
    };
    const auto make_row = [&](int y) { return Row{{slices, steps, y, settings.seed}}; };
    const auto run = [&](Real* values, const SurfaceGroup<Real>& group, Row& row,
                         const DepthPlane<Real>& plane) {
        const SlicePattern& pattern = row.pattern;
        if (pattern.taps == 0) return;
        for_each_reach(
            group, rule, values, [&](const Reach& reach, unsigned wanted, Real* results) {
                SliceTaps<Real> taps;
                taps.fill(pattern, plane, rule, reach, group.x, group.y);
                for (int first = 0; first < SurfaceGroup<Real>::size; first += Pixels::lanes) {
                    if ((wanted >> first / Pixels::lanes & 1u) == 0) continue;
                    const Pixels pixels{group, first, reach.slope, shade};
                    const Real* const data = plane.data() + first;
                    TapBits hits;
                    const int count = 2 * pattern.taps;
                    // Where something counted for the pixels before, it will again.
                    const bool look = !Pixels::wide || row.memory.quiet;
                    if (!look) hits.set_all(count);
                    else if (!pixels.find_hits(taps, count, data, hits)) {
                        row.memory.count(count, 0, Pixels::lanes);
                        store(results + first, broadcast<Pixels::lanes>(Real{1}));
                        continue;
                    }
                    row.memory.count(count, look ? hits.count(count) : count, Pixels::lanes);
                    const auto open = settled(part(pixels, taps, pattern, data, hits));
                    row.memory.quiet = !any(open < Real{1});
                    store(results + first, open);
                }
            });
    };
    return run_surface_pass(input, visibility, make_row, run, scratch, executor);
}

}  // namespace nook::inline NOOK_TARGET::detail
