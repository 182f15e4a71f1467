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
/// nothing is known about its own. `Work::samples` counts the pixels for which no half pixel agreed.
///
/// Background and pixels without a usable normal become exactly 1 and lend nothing; neither do half
/// pixels whose value is NaN, infinite or beyond 2¹⁰⁰ (2⁵⁰⁰ in double). A pixel with nobody to lend from becomes 1.
/// Inactive groups of the work map, which is of full size, become exactly 1. The others expect the half
/// pixels around them to have been computed: those that `half_work_map` names.
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

        explicit Layout(int width)
            : full{width, full_slots, 2, with_normals},
              half{width, half_slots, 2, with_normals}
        {}
        struct Memory {
            typename Rows::Memory full, half;
        };
        [[nodiscard]] Memory take(ScratchLayout& block, std::size_t workers) const
        {
            const auto first = full.take(block, workers);
            return {first, half.take(block, workers)};
        }
        [[nodiscard]] Memory of(const Memory& memory, int worker) const
        {
            return {full.of(memory.full, worker), half.of(memory.half, worker)};
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
        layout.full.clear(memory.full);
        layout.half.clear(memory.half);
        const auto full_row = [&](int y) {
            return layout.full.row(
                memory.full, y >= 0 && y < height ? y % Layout::full_slots : Layout::full_slots);
        };
        const auto half_row = [&](int y) {
            return layout.half.row(memory.half,
                                   y < half.height ? y % Layout::half_slots : Layout::half_slots);
        };
        for (int next = first - 2; next <= last + 2; ++next) {
            if (next >= 0 && next < height) {
                const Row row = full_row(next);
                read(work, memory.full, next, next >= first && next <= last, row);
                if (next % 2 == 0) spread(next, row, half_row(next / 2));
            }
            const int y = next - 2;
            if (y < first) continue;
            const Row around[5] = {full_row(y - 2), full_row(y - 1), full_row(y), full_row(y + 1),
                                   full_row(y + 2)};
            if (y % 2 == 0) fill_row<false>(work, y, around + 2, half_row(y / 2), {});
            else fill_row<true>(work, y, around + 2, half_row(y / 2), half_row(y / 2 + 1));
        }
    }

private:
    /// Is a group, or one beside it, computed?
    [[nodiscard]] bool is_needed(int x, int y) const
    {
        if (map.everything()) return true;
        for (int row = (std::max)(y - 1, 0); row <= (std::min)(y + 1, visibility.height - 1); ++row)
            for (int at = x - group; at <= x + group; at += group)
                if (at >= 0 && at < visibility.width && map.is_active(at, row)) return true;
        return false;
    }

    void read(Work& work, const typename Rows::Memory& memory, int y, bool counted,
              const Row& row) const
    {
        const Background background = layout.full.read(source, rule, y, memory, row);
        if (!counted && !with_normals) return;
        for (int x = 0; x < visibility.width; x += group) {
            const bool active = map.is_active(x, y);
            if (counted) count_pixels(work, background, row, x, visibility.width, active);
            if constexpr (with_normals) {
                if (!is_needed(x, y)) continue;
                const int lost = layout.full.read_normals(*normals, x, y, row);
                if (counted && active) work.background += static_cast<std::uint64_t>(lost);
            }
        }
    }

    /// Lays the half pixels of row y over its even columns; those that lend nothing get distance 0.
    void spread(int y, const Row& row, const Row& out) const
    {
        const In* const in = &half(0, y / 2);
        for (int i = 0; i < half.width; ++i) {
            const Real value = static_cast<Real>(in[i * half.pixel_stride]);
            const bool usable = is_usable(value);
            out.value[2 * i] = usable ? value : Real{0};
            out.distance[2 * i] = usable ? row.distance[2 * i] : Real{0};
        }
    }

    /// `around[i]` is the row i below row y; `above` and `below` hold the half pixels beside an odd row,
    /// `above` those of an even one.
    template <bool odd_row>
    void fill_row(Work& work, int y, const Row* around, const Row& above, const Row& below) const
    {
        const int width = visibility.width;
        for (int x = 0; x < width; x += group) {
            alignas(64) Real values[group];
            alignas(64) Real agreement[group];
            if (!map.is_active(x, y)) {
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
    [[nodiscard]] NOOK_INLINE static Vector odd_columns(int x)
    {
        alignas(64) Real column[lanes];
        for (int i = 0; i < lanes; ++i) column[i] = static_cast<Real>((x + i) % 2);
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
    if (outcome) {
        outcome.work.pixels = static_cast<std::uint64_t>(visibility.width) *
                              static_cast<std::uint64_t>(visibility.height);
        outcome.work.passes = 1;
    }
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
