#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/surface/bilateral_rows.hpp>
#include <nook/surface/bilateral_weight.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/shade_runs.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// A blur that stays on surfaces: removes the noise of kernels with few samples and keeps the edges of
/// the depth buffer (Tomasi & Manduchi 1998, with the weights of a guide instead of the image's own;
/// separable as in Pham & van Vliet 2005).
namespace nook {

struct BlurOptions {
    /// Pixels from the middle of the window to its edge, 0 … 64; 0 changes nothing.
    int radius = 4;
    /// Deviation of the Gaussian in pixels, > 0; large ones make a box. Unset: (radius + 1) / 2.
    std::optional<double> sigma{};
    /// How far a neighbour may lie from the tangent plane of a pixel, as a part of its distance; ≥ 0.
    /// Its weight falls to 0 there, as 1 − e². Some steps of the depth buffer are allowed for besides.
    double tolerance = 0.01;
    /// The same as a world length, added to it; ≥ 0. Under orthography, where distances may start
    /// anywhere, use this one and set `tolerance` to 0.
    double length = 0;
    /// Cosine of the angle between the normals of a pixel and its neighbour at which the weight falls
    /// to 0, linearly from 1 at 1; −1 … 1, not 1. Used when there are normals.
    double least_cosine = 0.7;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the mean of `visibility` over the part of each window that lies on the pixel's surface: rows
/// first, then columns.
///
/// Without normals the tangent plane follows from the depths around a pixel, and neighbours deviate
/// along the view axis; with normals they deviate by their distance from the tangent plane itself.
/// Background, pixels without a usable normal, and values that are NaN, infinite or beyond 2¹⁰⁰ (2⁵⁰⁰ in
/// double) become exactly 1 and enter nobody's window. So do inactive groups of the work map, unless it is `exact`:
/// then their values are true ones, enter windows as they stand, and the other pixels have the bits of
/// the call without a map.
///
/// Where a window holds one value the result is that value, exactly; else it lies between the least and
/// the largest of its values (to 2⁻¹⁴⁰), which may lie outside [0, 1]. Distances below 2⁻⁴⁰ or above 2⁴⁰
/// count as these; below 2⁻²⁰⁰ or above 2²⁰⁰ when an image or the distances are double, for then all is
/// computed so. Instruction sets agree to 1e-4 of the range of the values (5e-4 with -ffast-math): more
/// than rounding, because weights hang on differences of distances. The same bits for any number of
/// threads.
///
/// Where there is nothing to blur it is left out: a window of ones gives exactly 1, and of groups whose
/// windows hold nothing else only the depths are read, to tell their background. Their surfaces count as
/// skipped, and so does the pass if nothing else is left. This finds by itself what kernels before
/// left out. Do not pass on their work maps: the shade of a group reaches `radius` pixels into groups
/// that held none, and a map that does not know this would cut it off there, in outlines around all
/// that was left out. A map given here tells which pixels of the result are wanted.
///
/// `blurred` shares no memory with the inputs. The scratch holds 6 radius rows per worker or so.
template <class In, DepthInput Depth, class Out, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome bilateral_blur(const ImageView<In>& visibility, const Depth& depth,
                       const ImageView<Out>& blurred, const BlurOptions& options,
                       const Projection& projection, const WorkMap& work_map = {},
                       S&& scratch = S{}, E&& executor = E{});

template <class In, DepthInput Depth, class Out, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome bilateral_blur(const ImageView<In>& visibility, const Depth& depth,
                       const NormalSource& normals, const ImageView<Out>& blurred,
                       const BlurOptions& options, const Projection& projection,
                       const WorkMap& work_map = {}, S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch for either form, for these images and a number of workers; 0 for options that the
/// blur refuses.
template <class In, DepthInput Depth, class Out>
[[nodiscard]] std::size_t bilateral_blur_scratch_size(const ImageView<In>& visibility,
                                                      const Depth& depth,
                                                      const ImageView<Out>& blurred,
                                                      const BlurOptions& options, bool with_normals,
                                                      int workers = 1);

namespace detail {

inline constexpr int largest_blur_radius = 64;

[[nodiscard]] inline Error check_options(const BlurOptions& options)
{
    if (options.radius < 0 || options.radius > largest_blur_radius)
        return {ErrorCode::bad_value, "options.radius", double(options.radius),
                "a whole number from 0 to 64"};
    if (options.sigma && (!is_finite(*options.sigma) || *options.sigma <= 0))
        return {ErrorCode::bad_value, "options.sigma", *options.sigma, "a finite number > 0"};
    return check_edges(options.tolerance, options.length, options.least_cosine);
}

template <class In, class Source, class Out>
[[nodiscard]] Error check_blur(const ImageView<In>& visibility, const Source& source,
                               const NormalSource* normals, const ImageView<Out>& blurred,
                               const BlurOptions& options, const Projection& projection,
                               const WorkMap& work_map)
{
    if (const Error error = check_input(visibility, "visibility")) return error;
    if (const Error error = check_source(source)) return error;
    if (const Error error = check_same_size(visibility, source.image, "depth")) return error;
    if (normals != nullptr)
        if (const Error error = check_normals(*normals, source.image)) return error;
    if (const Error error = check_output(blurred, "blurred")) return error;
    if (const Error error = check_same_size(visibility, blurred, "blurred")) return error;
    if (const Error error = check_apart(visibility, blurred, "blurred")) return error;
    if (const Error error = check_apart(source.image, blurred, "blurred")) return error;
    if (normals != nullptr)
        if (const Error error = check_apart(*normals, blurred, "blurred")) return error;
    if (const Error error = check_guide(source.image)) return error;
    if (const Error error = check_options(options)) return error;
    if (const Error error = check_projection(projection)) return error;
    return check_work_map(work_map, blurred);
}

/// Weights of the Gaussian at 0 … radius pixels.
template <class Real>
struct BlurKernel {
    Real weight[largest_blur_radius + 1];

    explicit BlurKernel(const BlurOptions& options)
    {
        const double sigma = options.sigma.value_or((options.radius + 1) / 2.0);
        for (int i = 0; i <= options.radius; ++i)
            weight[i] = static_cast<Real>(std::exp(-0.5 * (i / sigma) * (i / sigma)));
    }
};

/// What a worker needs: the rows within reach of one, and the plan of what to do.
template <class Rows>
struct BlurLayout {
    /// Rows and columns around a pixel that are looked at: two for its slope.
    int reach;
    Rows rows;
    ShadePlan plan;

    BlurLayout(int width, int radius, bool with_normals)
        : reach{radius > 2 ? radius : 2},
          rows{width, 2 * reach + 1, reach, with_normals},
          plan{width, reach}
    {}
    struct Memory {
        typename Rows::Memory rows;
        ShadePlan::Memory plan;
    };
    [[nodiscard]] Memory take(ScratchLayout& block, std::size_t workers) const
    {
        const auto first = rows.take(block, workers);
        return {first, plan.take(block, workers)};
    }
    [[nodiscard]] Memory of(const Memory& memory, int worker) const
    {
        return {rows.of(memory.rows, worker), plan.of(memory.plan, worker)};
    }
};

/// A blur of one image. Each task blurs the rows of a band, which takes `reach` more rows on each side.
template <bool with_normals, class Real, class Source, class In, class Out>
class BilateralBlur {
public:
    using Distance = typename Source::Distance;
    using Rows = GuideRows<Real, Distance>;
    using Vector = typename Rows::Vector;
    using Row = GuideRow<Real>;
    using Layout = BlurLayout<Rows>;
    static constexpr int lanes = Rows::lanes, group = WorkMap::group;

    /// Rows of a band: more of them the more rows a band takes beside it.
    static constexpr int band(int radius) { return 64 + 8 * radius; }

    const Source& source;
    const NormalSource* normals;
    const ImageView<In>& visibility;
    const ImageView<Out>& blurred;
    const WorkMap& map;
    int radius;
    EdgeRule<Real> rule;
    BlurKernel<Real> kernel;
    Layout layout{visibility.width, radius, with_normals};

    void run(Work& work, const typename Layout::Memory& memory, int task) const
    {
        const Rows& rows = layout.rows;
        const int height = blurred.height, beside = layout.reach, slots = 2 * beside + 1;
        const int first = task * band(radius);
        const int last = (std::min)(first + band(radius), height) - 1;
        bool is_clear = false;
        layout.plan.clear(memory.plan);
        Row ring[2 * largest_blur_radius + 2];
        for (int slot = 0; slot <= slots; ++slot) ring[slot] = rows.row(memory.rows, slot);
        const auto row_of = [&](int y) -> const Row& {
            return ring[y >= 0 && y < height ? y % slots : slots];
        };
        for (int seen = first - beside; seen <= last + 3 * beside; ++seen) {
            look(memory, seen, first, last);
            const int next = seen - 2 * beside;
            if (next < first - beside) continue;
            if (next >= 0 && next < height) {
                const bool needed =
                    layout.plan.find_needed(memory.plan, layout.plan.shade(memory.plan, next));
                const Row& row = row_of(next);
                if (needed && !is_clear) rows.clear(memory.rows);
                is_clear = is_clear || needed;
                read(work, memory, next, next >= first && next <= last, needed, row);
                if (needed && next >= first - radius && next <= last + radius)
                    blur_row(next, row, memory);
            }
            const int y = next - beside;
            if (y < first) continue;
            Row around[2 * largest_blur_radius + 1];
            for (int i = -beside; i <= beside; ++i) around[i + beside] = row_of(y + i);
            const int ahead = (std::min)(seen + 1, height - 1);
            blur_columns(y, around + beside, layout.plan.work(memory.plan, y),
                         &visibility(0, ahead));
        }
    }

private:
    /// Looks for shade in a row, and finds out what to do `reach` rows above it.
    void look(const typename Layout::Memory& memory, int seen, int first, int last) const
    {
        const int beside = layout.reach, y = seen - beside;
        std::uint8_t* const shade = layout.plan.shade(memory.plan, seen);
        if (seen < 0 || seen >= blurred.height || seen > last + beside) {
            layout.plan.clear(shade);
        } else {
            find_shade(&visibility(0, seen), visibility.pixel_stride,
                       {blurred.width, group, radius, radius}, layout.plan.groups(), shade);
        }
        layout.plan.find_work(memory.plan, seen);
        if (y < first || y > last) layout.plan.clear(layout.plan.work(memory.plan, y));
        layout.plan.set_work(memory.plan, y, map);
    }

    /// Fills what is needed of a row, and the values of the same pixels.
    void read(Work& work, const typename Layout::Memory& memory, int y, bool counted, bool needed,
              const Row& row) const
    {
        const int width = blurred.width;
        if (!needed) {
            if (counted) count_spared<lanes>(work, source, {0, width}, y);
            return;
        }
        const std::uint8_t* const worked_on = layout.plan.work(memory.plan, y);
        for_each_run(layout.plan.needed(memory.plan), width,
                     [&](const GroupRun& run, bool is_needed) {
                         if (is_needed)
                             read(work, memory, y, counted ? worked_on : nullptr, run, row);
                         else if (counted) count_spared<lanes>(work, source, run, y);
                     });
    }
    /// `counted`: the groups of a row whose pixels are counted that are not spared.
    void read(Work& work, const typename Layout::Memory& memory, int y, const std::uint8_t* counted,
              const GroupRun& run, const Row& row) const
    {
        const Rows& rows = layout.rows;
        const Background background = rows.read(source, rule, run, y, memory.rows, row);
        Real* const values = rows.values(memory.rows);
        const In* const in = &visibility(0, y);
        int x = run.begin;
        if constexpr (std::is_same_v<std::remove_const_t<In>, Real>) {
            if (visibility.pixel_stride == 1) {
                for (; x + lanes <= run.end; x += lanes) store(values + x, load<lanes>(in + x));
            }
        }
        for (; x < run.end; ++x) values[x] = static_cast<Real>(in[x * visibility.pixel_stride]);

        const Vector zero{};
        for (x = run.begin; x < run.end; x += group) {
            const bool spared = counted != nullptr && counted[x / group] == 0;
            if (counted != nullptr) count_pixels(work, background, row, x, blurred.width, !spared);
            if (!map.exact && !map.is_active(x, y)) {
                for (int i = 0; i < group; ++i) row.distance[x + i] = row.value[x + i] = 0;
                continue;
            }
            if constexpr (with_normals) {
                const int lost = rows.read_normals(*normals, x, y, row);
                if (counted != nullptr && !spared)
                    work.background += static_cast<std::uint64_t>(lost);
            }
            for (int i = x; i < x + group; i += lanes) {
                const Vector value = load<lanes>(values + i);
                const auto usable = is_usable(value);
                store(values + i, usable ? value : zero);
                store(row.distance + i, usable ? load<lanes>(row.distance + i) : zero);
            }
        }
    }

    void blur_row(int y, const Row& row, const typename Layout::Memory& memory) const
    {
        Real* const values = layout.rows.values(memory.rows);
        const std::uint8_t* const needed = layout.plan.needed(memory.plan);
        const std::uint8_t* const mixed = layout.plan.mixed(memory.plan);
        for (int x = 0; x < blurred.width; x += group) {
            if (mixed[x / group] == 0) {
                if (needed[x / group] != 0) std::fill_n(row.value + x, group, Real{1});
                continue;
            }
            for (int i = x; i < x + group; i += lanes) {
                Row here = row.template from<with_normals>(i);
                here.value = values + i;
                const auto at = [here](int step) NOOK_INLINE_LAMBDA {
                    return here.template from<with_normals>(step);
                };
                store(row.value + i, blur<true>(i, y, at));
            }
        }
    }

    /// `around[i]` is the row i below row y, and `ahead` the row of values that is looked at next.
    void blur_columns(int y, const Row* around, const std::uint8_t* worked_on,
                      const In* ahead) const
    {
        const int width = blurred.width;
        const Row& row = around[0];
        if (!layout.plan.any(worked_on)) return write_ones(blurred, {0, width}, y);
        for (int x = 0; x < width; x += group) {
            alignas(64) Real values[group];
            prefetch(ahead + x * visibility.pixel_stride);
            if (worked_on[x / group] == 0) {
                for (Real& value : values) value = 1;
            } else {
                for (int i = 0; i < group; i += lanes) {
                    const auto at = [&](int step) NOOK_INLINE_LAMBDA {
                        return around[step].template from<with_normals>(x + i);
                    };
                    const Vector value = blur<false>(x + i, y, at);
                    const auto surface = load<lanes>(row.distance + x + i) > Real{0};
                    store(values + i, surface ? value : Vector{} + Real{1});
                }
            }
            write_group(values, blurred, x, y);
        }
    }

    /// The weighted mean along one axis, from pixel (x, y) on; 0 where nothing enters windows. `at(i)`
    /// tells where the i-th neighbours stand.
    template <bool along_row, class At>
    [[nodiscard]] NOOK_INLINE Vector blur(int x, int y, const At& at) const
    {
        const Vector zero{}, one = zero + Real{1};
        const Row centre = at(0);
        const Vector distance = load<lanes>(centre.distance);
        const auto surface = distance > zero;
        if (!any(surface)) return zero;
        const Vector d = surface ? distance : one;
        const Vector scale = 1 / rule.allowed(d);
        TangentPlane<Vector> plane;
        Vector nx, ny, nz;
        if constexpr (with_normals) {
            nx = load<lanes>(centre.nx);
            ny = load<lanes>(centre.ny);
            nz = load<lanes>(centre.nz);
            plane = rule.from_normal(d, scale, columns_from<Vector>(x), zero + static_cast<Real>(y),
                                     nx, ny, nz);
        } else {
            const Vector slope = screen_slope(
                load<lanes>(at(-2).screen), load<lanes>(at(-1).screen), load<lanes>(centre.screen),
                load<lanes>(at(1).screen), load<lanes>(at(2).screen), rule.bend(d, scale));
            plane = along_row ? rule.from_slopes(d, scale, slope, zero)
                              : rule.from_slopes(d, scale, zero, slope);
        }
        const Vector a = along_row ? plane.ax : plane.ay, b = along_row ? plane.bx : plane.by;
        // Differences from the pixel's own value, so that constants stay what they are.
        const Vector own = load<lanes>(centre.value);
        Vector sums[2] = {zero, zero}, weights[2] = {zero, zero};
        for (int i = 1; i <= radius; ++i) {
            const Real pixels = static_cast<Real>(i);
            const Vector ai = a * pixels, bi = b * pixels;
            const Vector gauss = broadcast<lanes>(kernel.weight[i]);
            const auto add = [&](int side, const Row& tap, const Vector& slope,
                                 const Vector& shift) NOOK_INLINE_LAMBDA {
                const Vector q = load<lanes>(tap.distance);
                const Vector deviation = (q - d) * slope + shift, square = deviation * deviation;
                Vector weight = gauss - gauss * square;
                if constexpr (with_normals)
                    weight = weight * rule.normal_weight(nx * load<lanes>(tap.nx) +
                                                         ny * load<lanes>(tap.ny) +
                                                         nz * load<lanes>(tap.nz));
                weight = ((square < one) & (q > zero)) ? weight : zero;
                weights[side] = weights[side] + weight;
                sums[side] = sums[side] + weight * (load<lanes>(tap.value) - own);
            };
            add(0, at(-i), plane.a - ai, -bi);
            add(1, at(i), plane.a + ai, bi);
        }
        const Vector sum = sums[0] + sums[1];
        const Vector all = broadcast<lanes>(kernel.weight[0]) + (weights[0] + weights[1]);
        return surface ? own + sum / all : zero;
    }
};

template <bool with_normals, class In, class Depth, class Out, class S, class E>
Outcome blur(const ImageView<In>& visibility, const Depth& depth, const NormalSource* normals,
             const ImageView<Out>& blurred, const BlurOptions& options,
             const Projection& projection, const WorkMap& work_map, S&& scratch, E&& executor)
{
    const auto& source = depth_source(depth);
    if (const Error error =
            check_blur(visibility, source, normals, blurred, options, projection, work_map))
        return {error};
    if (blurred.empty()) return {};
    using Real = guide_real<In, Depth, Out>;
    using Blur = BilateralBlur<with_normals, Real, std::remove_cvref_t<decltype(source)>, In, Out>;
    const EdgeRule<Real> rule{options.tolerance, options.length, options.least_cosine,
                              source.step,       options.radius, projection};
    const Blur pass{source,   normals,        visibility, blurred,
                    work_map, options.radius, rule,       BlurKernel<Real>{options}};
    Outcome outcome = run_tasks(
        pieces(blurred.height, Blur::band(options.radius)),
        [&](ScratchLayout& block, std::size_t workers) { return pass.layout.take(block, workers); },
        [&](Work& work, const auto& memory, int task, int worker) {
            pass.run(work, pass.layout.of(memory, worker), task);
        },
        scratch, executor);
    if (outcome) count_pass(outcome.work, blurred.width, blurred.height);
    return outcome;
}

}  // namespace detail

template <class In, DepthInput Depth, class Out, ScratchSource S, Executor E>
Outcome bilateral_blur(const ImageView<In>& visibility, const Depth& depth,
                       const ImageView<Out>& blurred, const BlurOptions& options,
                       const Projection& projection, const WorkMap& work_map, S&& scratch,
                       E&& executor)
{
    return detail::blur<false>(visibility, depth, nullptr, blurred, options, projection, work_map,
                               scratch, executor);
}

template <class In, DepthInput Depth, class Out, ScratchSource S, Executor E>
Outcome bilateral_blur(const ImageView<In>& visibility, const Depth& depth,
                       const NormalSource& normals, const ImageView<Out>& blurred,
                       const BlurOptions& options, const Projection& projection,
                       const WorkMap& work_map, S&& scratch, E&& executor)
{
    return detail::blur<true>(visibility, depth, &normals, blurred, options, projection, work_map,
                              scratch, executor);
}

template <class In, DepthInput Depth, class Out>
std::size_t bilateral_blur_scratch_size(const ImageView<In>& visibility, const Depth&,
                                        const ImageView<Out>&, const BlurOptions& options,
                                        bool with_normals, int workers)
{
    if (workers < 1 || visibility.empty() || detail::check_options(options)) return 0;
    using Rows = detail::GuideRows<detail::guide_real<In, Depth, Out>, distance_t<Depth>>;
    const detail::BlurLayout<Rows> layout{visibility.width, options.radius, with_normals};
    return detail::task_scratch_size(
        [&](detail::ScratchLayout& block, std::size_t count) { return layout.take(block, count); },
        workers);
}

}  // namespace nook::inline NOOK_TARGET
