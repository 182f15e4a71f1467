#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/surface/alchemy_options.hpp>
#include <nook/surface/alchemy_reference.hpp>
#include <nook/surface/alchemy_shade.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/surface/tap_pattern.hpp>
#include <nook/work_map.hpp>

/// Alchemy ambient obscurance from depth and normals (McGuire et al. 2011), with the sampling and the
/// falloff of its scalable successor (McGuire et al. 2012); see alchemy.hpp for both formulas.
namespace nook::inline NOOK_TARGET {

/// Writes the visibility of every pixel, in [0, 1]; background and pixels without a normal get 1.
///
/// Neighbours outside the image, on the background and at the pixel itself count as open. So does
/// everything where the disc of samples is smaller than a pixel. With `SamplePattern::row`, 16 pixels
/// take their samples at the same offsets: the disc of a pixel is up to a ninth larger or smaller than
/// its distance asks for (`detail::shared_reach`). Offsets are whole pixels.
///
/// `alchemy_ao_reference` computes the same pixel by pixel in double.
///
/// The same bits for any number of threads; instruction sets differ by rounding, about 2⁻¹⁸ of the
/// weight of a sample. Lengths, radius and intensity times a power of two (ε times its square) give
/// the same bits. Float depth is computed in float, double in double. Scratch: one value per pixel.
template <DepthInput Depth, class Value, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome alchemy_ao(const Depth& depth, const NormalSource& normals,
                   const ImageView<Value>& visibility, const AlchemyOptions& options,
                   const Projection& projection, const WorkMap& work_map = {}, S&& scratch = S{},
                   E&& executor = E{});

/// Bytes of scratch that `alchemy_ao` needs for a depth of that size and type.
template <DepthInput Depth>
[[nodiscard]] std::size_t alchemy_ao_scratch_size(const Depth& depth, int workers = 1);

namespace detail {

/// Some pixels of a group, side by side, and the terms of their sums.
template <class Real, bool orthographic, bool scalable>
struct AlchemyLanes {
    static constexpr int lanes = lanes_of<Real>;
    using Vector = Lanes<Real, lanes>;

    Vector distance, nx, ny, sx, along;
    Real sy;
    RiseRule::Rise<Vector> rise;
    Real epsilon, falloff;

    AlchemyLanes(const SurfaceGroup<Real>& group, int first, double slope,
                 const AlchemyShade& shade)
        : distance{load<lanes>(group.distance + first)},
          nx{load<lanes>(group.normal.x + first)},
          ny{load<lanes>(group.normal.y + first)},
          sx{load<lanes>(group.slope_x + first)},
          along{nx * sx + ny * group.slope_y - load<lanes>(group.normal.z + first)},
          sy{group.slope_y},
          rise{shade.rise.at(distance, Vector(larger(along, Vector(-along))), slope)},
          // So that no sample is near enough to overflow.
          epsilon{static_cast<Real>(shade.epsilon) + Real{0x1p-60}},
          falloff{static_cast<Real>(1 / shade.square_radius)}
    {}
    /// How far neighbours at distances `there`, by the slopes gx, gy away, stand above the tangent plane
    /// and what the bias forgives of that, but for its part in v·v. Numbers or lanes.
    template <class Slope>
    [[nodiscard]] NOOK_INLINE Vector height(const Vector& there, const Slope& gx,
                                            const Slope& gy) const
    {
        const Vector above = along * (there - distance) - rise.constant;
        if constexpr (orthographic) return above + (nx * gx + ny * gy) - rise.per_distance * there;
        else return above + there * (nx * gx + ny * gy - rise.per_distance);
    }
    /// One term, of the same.
    template <class Slope>
    [[nodiscard]] NOOK_INLINE Vector term(const Vector& there, const Slope& gx,
                                          const Slope& gy) const
    {
        const Vector zero{}, step = there - distance;
        const Vector across = orthographic ? Vector(zero + gx) : Vector(gx * there);
        const Vector up = orthographic ? Vector(zero + gy) : Vector(gy * there);
        const Vector vx = sx * step + across, vy = sy * step + up;
        const Vector square = vx * vx + vy * vy + step * step;
        const Vector left = larger(Vector(height(there, gx, gy) - rise.per_square * square), zero);
        Vector term = left / (square + epsilon);
        if constexpr (scalable) {
            const Vector share = larger(Vector(Real{1} - square * falloff), zero);
            term = term * (share * share * share);
        }
        return there > Real{0} ? term : zero;
    }
    /// From the sum over `samples` to visibility.
    void finish(const Vector& sum, int samples, const AlchemyShade& shade, Real* results) const
    {
        const Vector open = (Vector{} + Real{1}) - sum * static_cast<Real>(shade.scale / samples);
        store(results, settled(open));
        if (shade.contrast == 1) return;
        for (int i = 0; i < lanes; ++i)
            results[i] = std::pow(results[i], static_cast<Real>(shade.contrast));
    }
};

/// The sum of the terms of all taps. Most samples rise above no tangent plane, which is soon seen: with
/// few pixels side by side each tap is tried before its term is computed; with many, all taps at once,
/// where nothing counted for the pixels before.
template <class Pixels, class Taps, class Real>
[[nodiscard]] NOOK_INLINE auto sum_terms(const Pixels& pixels, const Taps& taps, const Real* data,
                                         RowMemory& row)
{
    using Vector = typename Pixels::Vector;
    constexpr int lanes = Pixels::lanes;
    const Vector zero{};
    Vector sum = zero;
    const auto term = [&](int i) NOOK_INLINE_LAMBDA {
        return pixels.term(load<lanes>(data + taps.index[i]), taps.slope_x[i], taps.slope_y[i]);
    };
    const auto height = [&](int i) NOOK_INLINE_LAMBDA {
        const Vector there = load<lanes>(data + taps.index[i]);
        const Vector above = pixels.height(there, taps.slope_x[i], taps.slope_y[i]);
        return Vector(there > Real{0} ? above : zero);
    };
    if constexpr (lanes > 8) {
        if (row.quiet) {
            Vector highest = zero;
            for (int i = 0; i < taps.count; ++i) highest = larger(highest, height(i));
            if (!any(highest > zero)) {
                row.count(taps.count, 0, lanes);
                return sum;
            }
        }
        for (int i = 0; i < taps.count; ++i) sum = sum + term(i);
        row.quiet = !any(sum > zero);
        row.count(taps.count, taps.count, lanes);
    } else {
        std::uint64_t hits = 0;
        for (int i = 0; i < taps.count; ++i) hits |= std::uint64_t{any(height(i) > zero)} << i;
        row.count(taps.count, std::popcount(hits), lanes);
        for (; hits != 0; hits &= hits - 1) sum = sum + term(std::countr_zero(hits));
    }
    return sum;
}

/// Offsets in common.
template <class Real, bool orthographic, bool scalable>
void alchemy_group(Real* values, const SurfaceGroup<Real>& group, const AlchemySpiral& spiral,
                   const DepthPlane<Real>& plane, const ReachRule& rule, const AlchemyShade& shade,
                   RowMemory& row)
{
    using Pixels = AlchemyLanes<Real, orthographic, scalable>;
    constexpr int lanes = Pixels::lanes, parts = SurfaceGroup<Real>::size / lanes;
    for_each_reach(group, rule, values, [&](const Reach& reach, unsigned wanted, Real* results) {
        TapList<Real, largest_sample_count> taps;
        taps.add(plane, rule, reach, group.x, group.y, spiral.x, spiral.y, spiral.count);
        for (int part = 0; part < parts; ++part) {
            if ((wanted >> part & 1u) == 0) continue;
            const Pixels pixels{group, part * lanes, reach.slope, shade};
            const Real* const first = plane.data() + part * lanes;
            // Three groups on, where the neighbours will be about the same.
            for (int i = 0; i < taps.count; ++i) prefetch(first + taps.index[i] + 48);
            const auto sum = sum_terms(pixels, taps, first, row);
            pixels.finish(sum, spiral.count, shade, results + part * lanes);
        }
    });
}

struct AlchemyRow {
    AlchemySpiral spiral;
    RowMemory memory{};
};

/// How the pixels of one register look at their neighbours, each at offsets of its own.
template <class Real>
struct PixelTaps {
    static constexpr int lanes = lanes_of<Real>;
    using Vector = Lanes<Real, lanes>;

    const DepthPlane<Real>& plane;
    int x, y;
    Real per_x, per_y;
    double widest = 0;
    alignas(64) float reach_x[lanes];
    alignas(64) float reach_y[lanes];
    alignas(64) float cosine[lanes];
    alignas(64) float sine[lanes];

    PixelTaps(const SurfaceGroup<Real>& group, int first, const Rotations& rotations,
              std::uint32_t seed, const DepthPlane<Real>& depths, const ReachRule& rule)
        : plane{depths},
          x{group.x + first},
          y{group.y},
          per_x{static_cast<Real>(1 / rule.fx)},
          per_y{static_cast<Real>(-1 / rule.fy)}
    {
        for (int i = 0; i < lanes; ++i) {
            const Real distance = group.distance[first + i];
            const double slope = distance > 0 ? pixel_slope(double{distance}, rule) : 0;
            widest = (std::max)(widest, slope);
            reach_x[i] = static_cast<float>(slope * rule.fx);
            reach_y[i] = static_cast<float>(slope * rule.fy);
            const int turned = Rotations::of(x + i, y, seed);
            cosine[i] = rotations.cosine[turned];
            sine[i] = rotations.sine[turned];
        }
    }
    /// take(distances, slopes right, slopes up) of the neighbours at a place of the disc.
    template <class Take>
    NOOK_INLINE void look(float right, float down, const Take& take) const
    {
        if constexpr (std::is_same_v<Real, float>) {
            using Integers = Lanes<std::int32_t, lanes>;
            const auto to = pixel_offset(right, down, load<lanes>(cosine), load<lanes>(sine),
                                         load<lanes>(reach_x), load<lanes>(reach_y));
            alignas(64) static constexpr std::int32_t counting[] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                                    8, 9, 10, 11, 12, 13, 14, 15};
            const Integers to_x = load<lanes>(counting) + to.right + x, to_y = to.down + y;
            const auto inside =
                (to_x >= 0) & (to_x < plane.width()) & (to_y >= 0) & (to_y < plane.height());
            const Integers zero{}, at = (to_y + 1) * plane.stride() + (to_x + plane.margin);
            take(gather(plane.data(), inside ? at : Integers(zero + plane.nowhere())),
                 Vector(convert<float>(to.right) * per_x), Vector(convert<float>(to.down) * per_y));
        } else {
            alignas(64) Real there[lanes], gx[lanes], gy[lanes];
            for (int i = 0; i < lanes; ++i) {
                const auto to =
                    pixel_offset(right, down, cosine[i], sine[i], reach_x[i], reach_y[i]);
                const int to_x = x + i + to.right, to_y = y + to.down;
                const bool inside =
                    to_x >= 0 && to_x < plane.width() && to_y >= 0 && to_y < plane.height();
                there[i] = plane.data()[inside ? plane.index(to_x, to_y) : plane.nowhere()];
                gx[i] = static_cast<Real>(to.right) * per_x;
                gy[i] = static_cast<Real>(to.down) * per_y;
            }
            take(load<lanes>(there), load<lanes>(gx), load<lanes>(gy));
        }
    }
};

/// Offsets of each pixel's own.
template <class Real, bool orthographic, bool scalable>
void alchemy_pixels(Real* values, const SurfaceGroup<Real>& group, const AlchemySpiral& spiral,
                    const Rotations& rotations, std::uint32_t seed, const DepthPlane<Real>& plane,
                    const ReachRule& rule, const AlchemyShade& shade)
{
    using Pixels = AlchemyLanes<Real, orthographic, scalable>;
    using Vector = typename Pixels::Vector;
    constexpr int lanes = Pixels::lanes;
    for (int first = 0; first < group.count; first += lanes) {
        const PixelTaps<Real> taps{group, first, rotations, seed, plane, rule};
        if (!(taps.widest > 0)) continue;
        const Pixels pixels{group, first, taps.widest, shade};
        Vector sum{};
        for (int sample = 0; sample < spiral.count; ++sample)
            taps.look(spiral.x[sample], spiral.y[sample],
                      [&](const Vector& there, const Vector& gx, const Vector& gy)
                          NOOK_INLINE_LAMBDA { sum = sum + pixels.term(there, gx, gy); });
        // Pixels that look nowhere have seen themselves, which is open.
        pixels.finish(sum, spiral.count, shade, values + first);
    }
}

template <bool orthographic, bool scalable, class Source, class Value, class S, class E>
Outcome run_alchemy(const SurfaceInput<Source>& input, const ImageView<Value>& visibility,
                    const AlchemyOptions& options, S&& scratch, E&& executor)
{
    using Real = typename Source::Distance;
    const ReachRule rule{input.plane, options.radius, input.projection, options.max_pixels};
    const AlchemyShade shade{options, input.plane.scale(), input.source.step,
                             surface_rounding<Real>, input.projection.orthographic};
    if (options.pattern == SamplePattern::row)
        return run_surface_pass(
            input, visibility,
            [&](int y) {
                return AlchemyRow{{options.samples, options.turns, row_turn(y, options.seed)}};
            },
            [&](Real* values, const SurfaceGroup<Real>& group, AlchemyRow& row,
                const DepthPlane<Real>& plane) {
                if (row.spiral.count > 0)
                    alchemy_group<Real, orthographic, scalable>(values, group, row.spiral, plane,
                                                                rule, shade, row.memory);
            },
            scratch, executor);
    const AlchemySpiral spiral{options.samples, options.turns, 0};
    const Rotations rotations;
    return run_surface_pass(
        input, visibility, [](int) { return 0; },
        [&](Real* values, const SurfaceGroup<Real>& group, int, const DepthPlane<Real>& plane) {
            if (spiral.count > 0)
                alchemy_pixels<Real, orthographic, scalable>(values, group, spiral, rotations,
                                                             options.seed, plane, rule, shade);
        },
        scratch, executor);
}

}  // namespace detail

template <DepthInput Depth>
std::size_t alchemy_ao_scratch_size(const Depth& depth, int workers)
{
    const auto& source = depth_source(depth);
    return detail::surface_scratch_size<distance_t<Depth>>(source.image.width, source.image.height,
                                                           workers);
}

template <DepthInput Depth, class Value, ScratchSource S, Executor E>
Outcome alchemy_ao(const Depth& depth, const NormalSource& normals,
                   const ImageView<Value>& visibility, const AlchemyOptions& options,
                   const Projection& projection, const WorkMap& work_map, S&& scratch, E&& executor)
{
    const auto& source = depth_source(depth);
    using Source = std::remove_cvref_t<decltype(source)>;
    using Real = typename Source::Distance;
    if (const Error error =
            detail::check_surface(source, normals, visibility, projection, work_map))
        return {error};
    if (const Error error = detail::check_alchemy(options)) return {error};
    if (visibility.empty()) return {};
    AlchemyOptions used = options;
    if (!detail::asks_for_work(options)) used = detail::no_alchemy();
    const detail::SurfaceInput<Source> input{
        source, normals, projection, work_map,
        detail::DepthPlane<Real>{visibility.width, visibility.height, used.radius}};
    const bool scalable = used.falloff == AlchemyFalloff::scalable;
    if (projection.orthographic)
        return scalable
                   ? detail::run_alchemy<true, true>(input, visibility, used, scratch, executor)
                   : detail::run_alchemy<true, false>(input, visibility, used, scratch, executor);
    return scalable ? detail::run_alchemy<false, true>(input, visibility, used, scratch, executor)
                    : detail::run_alchemy<false, false>(input, visibility, used, scratch, executor);
}

}  // namespace nook::inline NOOK_TARGET
