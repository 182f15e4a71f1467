#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/surface/shade_runs.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook::inline NOOK_TARGET {

/// Writes a unit normal in view axes (x right, y up, z towards the viewer) for every pixel, from depth
/// alone; it faces the viewer. Background gets (0, 0, 0).
///
/// Along each axis of the image the slope at a pixel comes from the side that continues best: 1/distance
/// (under orthography the distance) is linear on the screen over a plane, and of the two
/// pixels on each side the second tells how well the first fits (as in A. Takahashi's "accurate normal
/// reconstruction from depth buffer", 2021). So nothing is smeared across creases and silhouettes. Where
/// both sides fit equally the slope is the mean of both. Where neither fits, on lines one pixel wide, and
/// where there is no neighbour, the surface faces the viewer along that axis.
///
/// Planes come out as exact as their depths at every tilt, at borders and in images of any size. Float
/// depth is computed in float from differences: the normal of a plane is off by about 2⁻²³ f for f
/// pixels per unit of slope, as its depths are. With coarser depths it is off by a step times f / d, for
/// which the automatic bias of the kernels, which takes normals as exact, does not allow: give a bias
/// with 16 bits. Reads each depth once, or little more. The same bits for any number of threads;
/// instruction sets differ by rounding. Tasks are bands of 32 rows.
template <DepthInput Depth, class Value, Executor E = Serial>
Outcome normals_from_depth(const Depth& depth, const ImageView3<Value>& normals,
                           const Projection& projection, E&& executor = E{});

/// The same where a work map is active; the other groups get (0, 0, 0), and their surfaces count as
/// skipped. For kernels that are given the same map or a part of it, and read the normals of their own
/// pixels alone, as `alchemy_ao`, `horizon_ao` and `bitmask_ao` do. Not for the blur and the
/// upsampling: to these a pixel without a normal is no surface.
template <DepthInput Depth, class Value, Executor E = Serial>
Outcome normals_from_depth(const Depth& depth, const ImageView3<Value>& normals,
                           const Projection& projection, const WorkMap& work_map,
                           E&& executor = E{});

namespace detail {

/// Slopes and normals of pixels side by side, on lanes. Heights are relative to the pixel's own: its
/// distance over that of a neighbour, less 1; under orthography its distance less that of the neighbour.
template <class Real>
struct NormalRule {
    static constexpr int lanes = std::is_same_v<Real, float> ? float_lanes : native_lanes;
    using Vector = Lanes<Real, lanes>;

    /// Beyond it a slope is vertical in every digit; products of two stay in range.
    static constexpr Real steepest = Real(0x1p30);
    static constexpr Real largest = (std::numeric_limits<Real>::max)();

    Real fx, fy, pixel_x, pixel_y;
    /// Clamps heights that may overflow, so that differences are numbers.
    Real highest;
    Real constant, linear, quadratic;  ///< of four depth steps
    bool orthographic;

    NormalRule(const Projection& projection, const DepthStep& step)
        : fx{limited(projection.fx)},
          fy{limited(projection.fy)},
          pixel_x{limited(2 / projection.fx)},
          pixel_y{limited(2 / projection.fy)},
          highest{projection.orthographic ? largest : Real(0x1p40)},
          constant{limited(4 * step.constant)},
          linear{limited(4 * step.linear)},
          quadratic{limited(4 * step.quadratic)},
          orthographic{projection.orthographic}
    {}
    [[nodiscard]] static Real limited(double value)
    {
        return static_cast<Real>((std::max)((std::min)(value, 0x1p60), 0x1p-100));
    }
    [[nodiscard]] NOOK_INLINE static Vector clamped(const Vector& value, Real limit)
    {
        const Vector zero{};
        return smaller(larger(value, Vector(zero - limit)), Vector(zero + limit));
    }
    [[nodiscard]] NOOK_INLINE static Vector size_of(const Vector& value)
    {
        using Bits = std::conditional_t<sizeof(Real) == 4, std::int32_t, std::int64_t>;
        constexpr Bits all = (std::numeric_limits<Bits>::max)();
        return std::bit_cast<Vector>(std::bit_cast<Lanes<Bits, lanes>>(value) & all);
    }
    /// What turns differences of distances into heights.
    [[nodiscard]] NOOK_INLINE Vector inverse(const Vector& distance) const
    {
        // The inverse of a denormal is infinite.
        constexpr Real least = std::is_same_v<Real, float> ? Real(0x1p-126) : Real(0x1p-1000);
        const Vector one = Vector{} + Real{1};
        return orthographic ? one : one / larger(distance, Vector(Vector{} + least));
    }
    /// Pixels taken for one surface without a further one to prove it: two pixels' widths or four
    /// depth steps apart.
    [[nodiscard]] NOOK_INLINE Vector slack(const Vector& own, const Vector& own_inverse,
                                           Real pixel) const
    {
        return pixel + (constant + own * (linear + own * quadratic)) * own_inverse;
    }
    /// The slope per pixel towards growing positions in memory, and `fallback` where none is found.
    /// The neighbours lie `stride` elements apart.
    [[nodiscard]] NOOK_INLINE Vector slope(const Real* distance, const Real* inverses,
                                           std::ptrdiff_t before, std::ptrdiff_t before2,
                                           std::ptrdiff_t after, std::ptrdiff_t after2,
                                           const Vector& least, const Vector& fallback) const
    {
        const Vector zero{}, own = load<lanes>(distance);
        const Vector d_back = load<lanes>(distance + before);
        const Vector d_back2 = load<lanes>(distance + before2);
        const Vector d_ahead = load<lanes>(distance + after);
        const Vector d_ahead2 = load<lanes>(distance + after2);
        const auto height = [&](const Vector& other, std::ptrdiff_t offset) {
            const Vector above = (own - other) * load<lanes>(inverses + offset);
            return smaller(above, Vector(zero + highest));
        };
        const Vector back = -height(d_back, before), ahead = height(d_ahead, after);
        const Vector bend = size_of(ahead - back);
        const auto has_back = d_back > zero, has_ahead = d_ahead > zero;
        const auto both = has_back & has_ahead;
        // How far the next pixel lies off the line through the two beyond it; without a second of
        // these, off the line from the other side.
        const Vector unknown = both ? bend : zero;
        const Vector bend_back = size_of(2 * back + height(d_back2, before2));
        const Vector bend_ahead = size_of(2 * ahead - height(d_ahead2, after2));
        const Vector none = zero + largest;
        const Vector off_back = has_back ? (d_back2 > zero ? bend_back : unknown) : none;
        const Vector off_ahead = has_ahead ? (d_ahead2 > zero ? bend_ahead : unknown) : none;
        // A side is better if it fits twice as well, or else if it is less steep.
        const Vector size_back = size_of(back), size_ahead = size_of(ahead);
        const auto use_ahead =
            (2 * off_ahead < off_back) | ((off_ahead <= 2 * off_back) & (size_ahead < size_back));
        const Vector off = use_ahead ? off_ahead : off_back;
        const Vector size = use_ahead ? size_ahead : size_back;
        const auto smooth = both & (2 * bend <= 3 * smaller(off_back, off_ahead));
        const auto fits = (off < none) & ((2 * off <= size) | (size <= least));
        const Vector one_sided = use_ahead ? ahead : back;
        const Vector found = smooth ? (back + ahead) / 2 : one_sided;
        return (smooth | fits) ? found : fallback;
    }
};

/// Five rows of a strip of columns, two pixels wider to each side.
template <class Real>
struct NormalStrip {
    static constexpr int width = 256, margin = 16, rows = 5;
    static constexpr int stride = width + 2 * margin;

    alignas(64) Real distance[rows * stride];
    alignas(64) Real inverse[rows * stride];

    /// Where row y ≥ −rows begins.
    [[nodiscard]] static int slot(int y)
    {
        return static_cast<int>(static_cast<unsigned>(y + rows) % rows) * stride + margin;
    }

    template <class Source>
    void read(const NormalRule<Real>& rule, const Source& source, int x, int y)
    {
        constexpr int lanes = NormalRule<Real>::lanes;
        Real* const row = distance + slot(y);
        std::fill(row - margin, row - margin + stride, Real{0});
        if (y >= 0 && y < source.image.height) {
            const int first = (std::max)(x - 2, 0);
            const int last = (std::min)(x + width + 2, source.image.width);
            static_cast<void>(read_row<lanes>(source, first, last - first, y, row + (first - x)));
        }
        for (int i = -margin; i < width + margin; i += lanes)
            store(inverse + slot(y) + i, rule.inverse(load<lanes>(row + i)));
    }
    /// Normals of a run of pixels of row y, counted from the beginning of the strip at x; returns how
    /// many are background.
    template <class Value>
    int write(const NormalRule<Real>& rule, const Projection& projection, int x, int y,
              const GroupRun& run, const ImageView3<Value>& normals) const
    {
        constexpr int lanes = NormalRule<Real>::lanes;
        using Vector = typename NormalRule<Real>::Vector;
        constexpr Real steepest = NormalRule<Real>::steepest;
        const Real* const row = distance + slot(y);
        const Real* const row_inverse = inverse + slot(y);
        const auto beside = [&](int other) { return slot(other) - slot(y); };
        const std::ptrdiff_t up = beside(y - 1), up2 = beside(y - 2);
        const std::ptrdiff_t down = beside(y + 1), down2 = beside(y + 2);
        const double limit = double{steepest};
        const auto slope_at = [&](double pixels, double f) {
            return rule.orthographic
                       ? Real{0}
                       : static_cast<Real>((std::max)((std::min)(pixels / f, limit), -limit));
        };
        const Vector zero{}, one = zero + Real{1};
        const Vector sy = zero + slope_at(projection.cy - (y + 0.5), projection.fy);
        alignas(64) Real nx[width], ny[width], nz[width], slopes[width];
        for (int i = run.begin; i < run.end; ++i)
            slopes[i] = slope_at(x + i + 0.5 - projection.cx, projection.fx);
        for (int i = run.end; i < width && i % lanes != 0; ++i) slopes[i] = 0;
        for (int i = run.begin; i < run.end; i += lanes) {
            const Vector own = load<lanes>(row + i), own_inverse = load<lanes>(row_inverse + i);
            if (!any(own > zero)) {
                store(nx + i, zero);
                store(ny + i, zero);
                store(nz + i, zero);
                continue;
            }
            const Vector sx = load<lanes>(slopes + i);
            // Slopes per unit of (sx, sy, −1). Those of a plane square to the view ray:
            const Vector facing = one / (one + sx * sx + sy * sy);
            const Vector per_x =
                rule.slope(row + i, row_inverse + i, -1, -2, 1, 2,
                           rule.slack(own, own_inverse, rule.pixel_x), sx * facing / rule.fx);
            const Vector per_y =
                rule.slope(row + i, row_inverse + i, up, up2, down, down2,
                           rule.slack(own, own_inverse, rule.pixel_y), -sy * facing / rule.fy);
            const Vector gx = NormalRule<Real>::clamped(per_x * rule.fx, steepest);
            const Vector gy = NormalRule<Real>::clamped(-per_y * rule.fy, steepest);
            // distance / d = (1 − sx gx − sy gy) + sx' gx + sy' gy all over a plane, and n·v is constant.
            const Vector z = one - sx * gx - sy * gy;
            const Vector scale = one / square_root(Vector(gx * gx + gy * gy + z * z));
            const auto surface = own > zero;
            store(nx + i, Vector(surface ? -gx * scale : zero));
            store(ny + i, Vector(surface ? -gy * scale : zero));
            store(nz + i, Vector(surface ? z * scale : zero));
        }
        int background = 0;
        for (int i = run.begin; i < run.end; ++i) background += !(row[i] > 0);
        const auto copy = [&](const Real* values, const ImageView<Value>& image) {
            Value* const out = &image(x, y);
            for (int i = run.begin; i < run.end; ++i)
                out[i * image.pixel_stride] = static_cast<Value>(values[i]);
        };
        copy(nx, normals.x);
        copy(ny, normals.y);
        copy(nz, normals.z);
        return background;
    }
};

}  // namespace detail

template <DepthInput Depth, class Value, Executor E>
Outcome normals_from_depth(const Depth& depth, const ImageView3<Value>& normals,
                           const Projection& projection, E&& executor)
{
    return normals_from_depth(depth, normals, projection, WorkMap{}, executor);
}

template <DepthInput Depth, class Value, Executor E>
Outcome normals_from_depth(const Depth& depth, const ImageView3<Value>& normals,
                           const Projection& projection, const WorkMap& work_map, E&& executor)
{
    using Real = distance_t<Depth>;
    const auto& source = depth_source(depth);
    if (const Error error = detail::check_source(source)) return {error};
    const auto check = [&](const ImageView<Value>& image, const char* name) -> Error {
        if (const Error error = detail::check_output(image, name)) return error;
        if (const Error error = detail::check_same_size(source.image, image, name)) return error;
        return detail::check_apart(source.image, image, name);
    };
    if (const Error error = check(normals.x, "normals.x")) return {error};
    if (const Error error = check(normals.y, "normals.y")) return {error};
    if (const Error error = check(normals.z, "normals.z")) return {error};
    if (const Error error = detail::check_apart(normals.x, normals.y, "normals.y")) return {error};
    if (const Error error = detail::check_apart(normals.x, normals.z, "normals.z")) return {error};
    if (const Error error = detail::check_apart(normals.y, normals.z, "normals.z")) return {error};
    if (const Error error = check_projection(projection)) return {error};
    if (const Error error = detail::check_work_map(work_map, normals.x)) return {error};
    if (const Error error = detail::check_apart(work_map.active, normals.y, "normals.y"))
        return {error};
    if (const Error error = detail::check_apart(work_map.active, normals.z, "normals.z"))
        return {error};
    if (normals.empty()) return {};

    constexpr int band = 32, strip_width = detail::NormalStrip<Real>::width;
    const int width = normals.x.width, height = normals.x.height;
    const detail::NormalRule<Real> rule{projection, source.step};
    std::atomic<std::uint64_t> background{0}, skipped{0};
    executor.for_each(detail::pieces(height, band), [&](int task, int) {
        detail::NormalStrip<Real> strip;
        const int first = task * band, last = (std::min)(first + band, height);
        Work work{};
        for (int x = 0; x < width; x += strip_width) {
            const int count = (std::min)(strip_width, width - x);
            std::uint8_t active[band][strip_width / WorkMap::group];
            bool any[band] = {};
            for (int y = first; y < last; ++y)
                for (int i = 0; i < count; i += WorkMap::group) {
                    const bool is_active = work_map.is_active(x + i, y);
                    active[y - first][i / WorkMap::group] = is_active ? 1 : 0;
                    any[y - first] = any[y - first] || is_active;
                }
            for (int next = first - 2; next < last + 2; ++next) {
                bool needed = false;
                for (int y = (std::max)(next - 2, first); y < (std::min)(next + 3, last); ++y)
                    needed = needed || any[y - first];
                if (needed) strip.read(rule, source, x, next);
                const int y = next - 2;
                if (y < first) continue;
                detail::for_each_run(
                    active[y - first], count, [&](const detail::GroupRun& run, bool is_active) {
                        const detail::GroupRun whole{x + run.begin, x + run.end};
                        if (is_active) {
                            work.background += static_cast<std::uint64_t>(
                                strip.write(rule, projection, x, y, run, normals));
                        } else {
                            detail::count_spared<detail::NormalRule<Real>::lanes>(work, source,
                                                                                  whole, y);
                            for (const ImageView<Value>& image : {normals.x, normals.y, normals.z})
                                for (int i = whole.begin; i < whole.end; ++i)
                                    image(i, y) = Value{0};
                        }
                    });
            }
        }
        background.fetch_add(work.background, std::memory_order_relaxed);
        skipped.fetch_add(work.skipped, std::memory_order_relaxed);
    });
    Outcome outcome{};
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.background = background.load(std::memory_order_relaxed);
    outcome.work.skipped = skipped.load(std::memory_order_relaxed);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
