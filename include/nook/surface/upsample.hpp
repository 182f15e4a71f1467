#pragma once

#include <algorithm>
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
#include <nook/surface/bilateral_rows.hpp>
#include <nook/surface/bilateral_weight.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/shade_runs.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// From the visibility of every second pixel of every second row to that of all, along the surfaces of
/// the full depth (joint bilateral upsampling, Kopf et al. 2007, with the weights of the blur).
namespace nook {

struct UpsampleOptions {
    /// How far a half pixel may lie from the tangent plane of a pixel, as a part of its distance; ≥ 0.
    /// Its weight falls to 0 there, as 1 − e². Some steps of the depth buffer are allowed for besides.
    double tolerance = 0.01;
    /// The same as a world length, added to it; ≥ 0.
    double length = 0;
    /// Cosine of the angle between the normals of a pixel and of a half pixel at which the weight falls
    /// to 0, linearly from 1 at 1; −1 … 1, not 1. Used when there are normals.
    double least_cosine = 0.7;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the visibility of every pixel from `half`, which holds those of the pixels (2 x, 2 y) of
/// `depth` (see half_resolution.hpp); `projection` is that of the full size.
///
/// A pixel that has a half pixel of its own takes its value exactly. Others take the mean of the two or
/// four half pixels beside them, weighted by how well those agree with the pixel's tangent plane (and
/// normal). If none agrees, the one that disagrees least lends its value. So a feature one pixel wide
/// that falls between the half pixels gets the visibility of the surface beside it, be that 0 or 1:
/// nothing is known about its own. `Work::samples` counts the pixels for which no half pixel agreed, but
/// for those in groups that are left out.
///
/// Background and pixels without a usable normal become exactly 1 and lend nothing; neither do half
/// pixels whose value is NaN, infinite or beyond 2¹⁰⁰ (2⁵⁰⁰ in double). A pixel with nobody to lend
/// from becomes 1.
/// Inactive groups of the work map, which is of full size, become exactly 1. The others expect the half
/// pixels around them to have been computed: those that `half_work_map` names.
///
/// Where the half pixels beside a group are exactly 1 the group is left out, for so is the result: of such
/// groups only the depths are read, to tell their background. Their surfaces count as skipped, and so
/// does the pass if nothing else is left. So there is no need for a map to make the most of what
/// kernels left out at half size; a map of theirs would not do, for shade reaches over a group's edge.
///
/// The result lies between the least and the largest of the values it is a mean of, and where these are
/// equal it equals them. `visibility` shares no memory with the inputs.
template <class In, DepthInput Depth, class Out, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome upsample(const ImageView<In>& half, const Depth& depth, const ImageView<Out>& visibility,
                 const UpsampleOptions& options, const Projection& projection,
                 const WorkMap& work_map = {}, S&& scratch = S{}, E&& executor = E{});

template <class In, DepthInput Depth, class Out, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome upsample(const ImageView<In>& half, const Depth& depth, const NormalSource& normals,
                 const ImageView<Out>& visibility, const UpsampleOptions& options,
                 const Projection& projection, const WorkMap& work_map = {}, S&& scratch = S{},
                 E&& executor = E{});

/// Bytes of scratch for either form, for these images and a number of workers.
template <class In, DepthInput Depth, class Out>
[[nodiscard]] std::size_t upsample_scratch_size(const ImageView<In>& half, const Depth& depth,
                                                const ImageView<Out>& visibility, bool with_normals,
                                                int workers = 1);

namespace detail {

template <class In, class Source, class Out>
[[nodiscard]] Error check_upsample(const ImageView<In>& half, const Source& source,
                                   const NormalSource* normals, const ImageView<Out>& visibility,
                                   const UpsampleOptions& options, const Projection& projection,
                                   const WorkMap& work_map)
{
    if (const Error error = check_input(half, "half")) return error;
    if (const Error error = check_guide(source.image)) return error;
    if (const Error error = check_source(source)) return error;
    const auto expected = half_view(source.image);
    if (half.width != expected.width)
        return {ErrorCode::bad_size, "half", double(half.width), "half the width, rounded up"};
    if (half.height != expected.height)
        return {ErrorCode::bad_size, "half", double(half.height), "half the height, rounded up"};
    if (normals != nullptr)
        if (const Error error = check_normals(*normals, source.image)) return error;
    if (const Error error = check_output(visibility, "visibility")) return error;
    if (const Error error = check_same_size(source.image, visibility, "visibility")) return error;
    if (const Error error = check_apart(half, visibility, "visibility")) return error;
    if (const Error error = check_apart(source.image, visibility, "visibility")) return error;
    if (normals != nullptr)
        if (const Error error = check_apart(*normals, visibility, "visibility")) return error;
    if (const Error error = check_edges(options.tolerance, options.length, options.least_cosine))
        return error;
    if (const Error error = check_projection(projection)) return error;
    return check_work_map(work_map, visibility);
}

/// One upsampling. Tasks are bands of an even number of rows.
template <bool with_normals, class Real, class Source, class In, class Out>
class Upsampling {
public:
    using Distance = typename Source::Distance;
    using Rows = GuideRows<Real, Distance>;
    using Vector = typename Rows::Vector;
    using Row = GuideRow<Real>;
    static constexpr int lanes = Rows::lanes, group = WorkMap::group;
    static constexpr int band = 64;

    /// Rows of the full size, and half rows spread over the even columns of full ones.
    struct Layout {
        static constexpr int full_slots = 5, half_slots = 3;
        Rows full, half;
        ShadePlan plan;

        explicit Layout(int width)
            : full{width, full_slots, 2, with_normals},
              half{width, half_slots, 2, with_normals},
              plan{width, 2}
        {}
        struct Memory {
            typename Rows::Memory full, half;
            ShadePlan::Memory plan;
        };
        [[nodiscard]] Memory take(ScratchLayout& block, std::size_t workers) const
        {
            const auto first = full.take(block, workers), second = half.take(block, workers);
            return {first, second, plan.take(block, workers)};
        }
        [[nodiscard]] Memory of(const Memory& memory, int worker) const
        {
            return {full.of(memory.full, worker), half.of(memory.half, worker),
                    plan.of(memory.plan, worker)};
        }
    };

    const ImageView<In>& half;
    const Source& source;
    const NormalSource* normals;
    const ImageView<Out>& visibility;
    const WorkMap& map;
    EdgeRule<Real> rule;
    Layout layout{visibility.width};

    void run(Work& work, const typename Layout::Memory& memory, int task) const
    {
        const int height = visibility.height;
        const int first = task * band, last = (std::min)(first + band, height) - 1;
        bool is_clear = false;
        layout.plan.clear(memory.plan);
        const auto full_row = [&](int y) {
            return layout.full.row(
                memory.full, y >= 0 && y < height ? y % Layout::full_slots : Layout::full_slots);
        };
        const auto half_row = [&](int y) {
            return layout.half.row(memory.half,
                                   y < half.height ? y % Layout::half_slots : Layout::half_slots);
        };
        for (int next = first - 4; next <= last + 2; ++next) {
            look(memory.plan, next + 2, first, last);
            if (next < first - 2) continue;
            const bool needed = layout.plan.find_needed(memory.plan);
            if (next >= 0 && next < height) {
                const Row row = full_row(next);
                if (needed && !is_clear) {
                    layout.full.clear(memory.full);
                    layout.half.clear(memory.half);
                    is_clear = true;
                }
                const Row spread_row = next % 2 == 0 ? half_row(next / 2) : Row{};
                read(work, memory, next, next >= first && next <= last, needed, row, spread_row);
            }
            const int y = next - 2;
            if (y < first) continue;
            const std::uint8_t* const worked_on = layout.plan.work(memory.plan, y);
            if (!layout.plan.any(worked_on)) {
                write_ones(visibility, {0, visibility.width}, y);
                continue;
            }
            const Row around[5] = {full_row(y - 2), full_row(y - 1), full_row(y), full_row(y + 1),
                                   full_row(y + 2)};
            if (y % 2 == 0) fill_row<false>(work, y, worked_on, around + 2, half_row(y / 2), {});
            else
                fill_row<true>(work, y, worked_on, around + 2, half_row(y / 2),
                               half_row(y / 2 + 1));
        }
    }

private:
    /// Finds out what to do in row y: where one of the half pixels beside a group is not 1.
    void look(const ShadePlan::Memory& memory, int y, int first, int last) const
    {
        if (y >= first && y <= last) {
            if (y == first) look_at_half(memory, y / 2);
            if (y % 2 != 0) look_at_half(memory, y / 2 + 1);
            layout.plan.find_work(memory, y, layout.plan.shade(memory, y / 2),
                                  layout.plan.shade(memory, (y + 1) / 2));
        } else {
            layout.plan.clear(layout.plan.work(memory, y));
        }
        layout.plan.set_work(memory, y, map);
    }
    void look_at_half(const ShadePlan::Memory& memory, int y) const
    {
        std::uint8_t* const shade = layout.plan.shade(memory, y);
        if (y >= half.height) {
            layout.plan.clear(shade);
            return;
        }
        // The last column of a group is odd and lies beside the first half pixel of the next one.
        find_shade(&half(0, y), half.pixel_stride, {half.width, group / 2, 0, 1},
                   layout.plan.groups(), shade);
    }

    /// Fills what is needed of row y, and of its half pixels if it has some.
    void read(Work& work, const typename Layout::Memory& memory, int y, bool counted, bool needed,
              const Row& row, const Row& spread_row) const
    {
        if (!needed) {
            if (counted) count_spared<lanes>(work, source, {0, visibility.width}, y);
            return;
        }
        const std::uint8_t* const worked_on = layout.plan.work(memory.plan, y);
        for_each_run(layout.plan.needed(memory.plan), visibility.width,
                     [&](const GroupRun& run, bool is_needed) {
                         if (is_needed) {
                             read(work, memory, y, counted ? worked_on : nullptr, run, row);
                             if (y % 2 == 0) spread(y, run, row, spread_row);
                         } else if (counted) {
                             count_spared<lanes>(work, source, run, y);
                         }
                     });
    }
    /// `counted`: the groups of a row whose pixels are counted that are not spared.
    void read(Work& work, const typename Layout::Memory& memory, int y, const std::uint8_t* counted,
              const GroupRun& run, const Row& row) const
    {
        const Background background = layout.full.read(source, rule, run, y, memory.full, row);
        if (counted == nullptr && !with_normals) return;
        for (int x = run.begin; x < run.end; x += group) {
            const bool spared = counted != nullptr && counted[x / group] == 0;
            if (counted != nullptr)
                count_pixels(work, background, row, x, visibility.width, !spared);
            if constexpr (with_normals) {
                const int lost = layout.full.read_normals(*normals, x, y, row);
                if (counted != nullptr && !spared)
                    work.background += static_cast<std::uint64_t>(lost);
            }
        }
    }

    /// Lays the half pixels of row y over its even columns; those that lend nothing get distance 0.
    void spread(int y, const GroupRun& run, const Row& row, const Row& out) const
    {
        const In* const in = &half(0, y / 2);
        for (int i = run.begin / 2; i < (run.end + 1) / 2; ++i) {
            const Real value = static_cast<Real>(in[i * half.pixel_stride]);
            const bool usable = is_usable(value);
            out.value[2 * i] = usable ? value : Real{0};
            out.distance[2 * i] = usable ? row.distance[2 * i] : Real{0};
        }
    }

    /// `around[i]` is the row i below row y; `above` and `below` hold the half pixels beside an odd row,
    /// `above` those of an even one.
    template <bool odd_row>
    void fill_row(Work& work, int y, const std::uint8_t* worked_on, const Row* around,
                  const Row& above, const Row& below) const
    {
        const int width = visibility.width;
        // Half pixels that are looked at next.
        const In* const ahead = &half(0, (std::min)(y / 2 + 4, half.height - 1));
        for (int x = 0; x < width; x += group) {
            alignas(64) Real values[group];
            alignas(64) Real agreement[group];
            if (odd_row) prefetch(ahead + x / 2 * half.pixel_stride);
            if (worked_on[x / group] == 0) {
                for (Real& value : values) value = 1;
            } else {
                bool lonely = false;
                for (int i = 0; i < group; i += lanes)
                    lonely |=
                        fill<odd_row>(x + i, y, around, above, below, values + i, agreement + i);
                if (lonely) {
                    const int count = (std::min)(group, width - x);
                    for (int i = 0; i < count; ++i) work.samples += agreement[i] > 0 ? 0u : 1u;
                }
            }
            write_group(values, visibility, x, y);
        }
    }

    /// Some pixels from (x, y) on: their values and the sums of their weights, 1 for background. Tells
    /// whether one of these is 0.
    template <bool odd_row>
    [[nodiscard]] NOOK_INLINE bool fill(int x, int y, const Row* around, const Row& above,
                                        const Row& below, Real* values, Real* agreement) const
    {
        const Vector zero{}, one = zero + Real{1};
        const Vector distance = load<lanes>(around[0].distance + x);
        const auto surface = distance > zero;
        if (!any(surface)) {
            store(values, one);
            store(agreement, one);
            return false;
        }
        const Vector d = surface ? distance : one, scale = 1 / rule.allowed(d);
        const Vector odd = odd_columns(x);
        TangentPlane<Vector> plane;
        Vector nx, ny, nz;
        if constexpr (with_normals) {
            nx = load<lanes>(around[0].nx + x);
            ny = load<lanes>(around[0].ny + x);
            nz = load<lanes>(around[0].nz + x);
            plane = rule.from_normal(d, scale, columns_from<Vector>(x), zero + static_cast<Real>(y),
                                     nx, ny, nz);
        } else {
            const Vector bend = rule.bend(d, scale);
            const Real* const row = around[0].screen + x;
            const Vector own = load<lanes>(row);
            const Vector right = screen_slope(load<lanes>(row - 2), load<lanes>(row - 1), own,
                                              load<lanes>(row + 1), load<lanes>(row + 2), bend);
            Vector down = zero;
            if constexpr (odd_row)
                down = screen_slope(
                    load<lanes>(around[-2].screen + x), load<lanes>(around[-1].screen + x), own,
                    load<lanes>(around[1].screen + x), load<lanes>(around[2].screen + x), bend);
            plane = rule.from_slopes(d, scale, right, down);
        }

        constexpr int rows = odd_row ? 2 : 1, count = 2 * rows;
        Vector lent[count], weight[count];
        // The best is the one of most weight, or else the one that deviates least.
        const Real never = Real{-0x1p100}, least = Real{0x1p99};
        Vector best = one, score = zero + never;
        for (int i = 0; i < count; ++i) {
            const bool right = i % 2 != 0;
            const int down = !odd_row ? 0 : i < 2 ? -1 : 1;
            const Row& from = i < 2 ? above : below;
            const auto pick = [&](const Real* row) NOOK_INLINE_LAMBDA -> Vector {
                const Vector beside = load<lanes>(row + x + (right ? 1 : -1));
                return odd > zero ? beside : load<lanes>(row + x);
            };
            const Vector step = right ? odd : -odd, step_down = zero + static_cast<Real>(down);
            const Vector q = pick(from.distance);
            const Vector deviation = (q - d) * (plane.a + plane.ax * step + plane.ay * step_down) +
                                     (plane.bx * step + plane.by * step_down);
            Vector share = larger(one - deviation * deviation, zero);
            if constexpr (with_normals) {
                const Row& guide = around[down];
                share = share * rule.normal_weight(nx * pick(guide.nx) + ny * pick(guide.ny) +
                                                   nz * pick(guide.nz));
            }
            share = q > zero ? share : zero;
            const Vector away = smaller(larger(deviation, -deviation), zero + least);
            const Vector rank = q > zero ? (share > zero ? share : -away) : zero + never;
            lent[i] = pick(from.value);
            weight[i] = share;
            best = rank > score ? lent[i] : best;
            score = larger(score, rank);
        }
        // Differences from one of the values, so that equal values stay what they are.
        Vector sum = zero, weights = zero;
        for (int i = 0; i < count; ++i) {
            weights = weights + weight[i];
            sum = sum + weight[i] * (lent[i] - best);
        }
        const Vector mean = best + sum / (weights > zero ? weights : one);
        store(values, surface ? mean : one);
        const Vector sums = surface ? weights : one;
        store(agreement, sums);
        return any(sums == zero);
    }
    /// 1 in odd columns, 0 in even ones.
    [[nodiscard]] NOOK_INLINE static Vector odd_columns([[maybe_unused]] int x)
    {
        alignas(64) Real column[lanes];
        // Vectors of more than one begin in even columns.
        for (int i = 0; i < lanes; ++i) column[i] = static_cast<Real>((lanes == 1 ? x : i) % 2);
        return load<lanes>(column);
    }
};

template <bool with_normals, class In, class Depth, class Out, class S, class E>
Outcome upsample_with(const ImageView<In>& half, const Depth& depth, const NormalSource* normals,
                      const ImageView<Out>& visibility, const UpsampleOptions& options,
                      const Projection& projection, const WorkMap& work_map, S&& scratch,
                      E&& executor)
{
    const auto& source = depth_source(depth);
    if (const Error error =
            check_upsample(half, source, normals, visibility, options, projection, work_map))
        return {error};
    if (visibility.empty()) return {};
    using Real = guide_real<In, Depth, Out>;
    using Pass = Upsampling<with_normals, Real, std::remove_cvref_t<decltype(source)>, In, Out>;
    const EdgeRule<Real> rule{
        options.tolerance, options.length, options.least_cosine, source.step, 1, projection};
    const Pass pass{half, source, normals, visibility, work_map, rule};
    Outcome outcome = run_tasks(
        pieces(visibility.height, Pass::band),
        [&](ScratchLayout& block, std::size_t workers) { return pass.layout.take(block, workers); },
        [&](Work& work, const auto& memory, int task, int worker) {
            pass.run(work, pass.layout.of(memory, worker), task);
        },
        scratch, executor);
    if (outcome) count_pass(outcome.work, visibility.width, visibility.height);
    return outcome;
}

}  // namespace detail

template <class In, DepthInput Depth, class Out, ScratchSource S, Executor E>
Outcome upsample(const ImageView<In>& half, const Depth& depth, const ImageView<Out>& visibility,
                 const UpsampleOptions& options, const Projection& projection,
                 const WorkMap& work_map, S&& scratch, E&& executor)
{
    return detail::upsample_with<false>(half, depth, nullptr, visibility, options, projection,
                                        work_map, scratch, executor);
}

template <class In, DepthInput Depth, class Out, ScratchSource S, Executor E>
Outcome upsample(const ImageView<In>& half, const Depth& depth, const NormalSource& normals,
                 const ImageView<Out>& visibility, const UpsampleOptions& options,
                 const Projection& projection, const WorkMap& work_map, S&& scratch, E&& executor)
{
    return detail::upsample_with<true>(half, depth, &normals, visibility, options, projection,
                                       work_map, scratch, executor);
}

template <class In, DepthInput Depth, class Out>
std::size_t upsample_scratch_size(const ImageView<In>&, const Depth&,
                                  const ImageView<Out>& visibility, bool with_normals, int workers)
{
    if (workers < 1 || visibility.empty()) return 0;
    using Real = detail::guide_real<In, Depth, Out>;
    using Source = std::remove_cvref_t<decltype(depth_source(std::declval<const Depth&>()))>;
    const auto size = [&](const auto& layout) {
        return detail::task_scratch_size(
            [&](detail::ScratchLayout& block, std::size_t count) {
                return layout.take(block, count);
            },
            workers);
    };
    using Plain = detail::Upsampling<false, Real, Source, In, Out>;
    using Guided = detail::Upsampling<true, Real, Source, In, Out>;
    return with_normals ? size(typename Guided::Layout{visibility.width})
                        : size(typename Plain::Layout{visibility.width});
}

}  // namespace nook::inline NOOK_TARGET
