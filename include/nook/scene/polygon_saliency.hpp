#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/channel_sums.hpp>
#include <nook/scene/polygon_neighbours.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

/// Mesh saliency from the channel (Feixas, Sbert & González 2009, "A unified information-theoretic
/// framework for viewpoint selection and mesh saliency"): polygons stand out that are seen from other
/// viewpoints than their neighbours.
namespace nook::inline NOOK_TARGET {

/// How differently two polygons of the channel are seen, in bits from 0 to 1: the Jensen–Shannon
/// divergence of p(V|a) and p(V|b), weighted by p(a) and p(b). Also what is lost when they are made one
/// polygon: I(V;O) falls by (p(a) + p(b)) times this. 0 where one of them is not seen. Differences below
/// 2⁻⁴⁰ bit are taken for rounding and are 0. Serial; O(views log views).
[[nodiscard]] double dissimilarity(const ViewpointChannel& channel, std::size_t a, std::size_t b);

/// Writes the saliency of every polygon, in bits from 0 to 1: the mean dissimilarity to those of its
/// neighbours that are seen. 0 for polygons that are not seen, or have no seen neighbour.
///
/// `neighbours` are those of the channel's mesh; `saliency` holds one double per polygon. Scratch:
/// `polygon_saliency_scratch_size`. Tasks are blocks of polygons.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome polygon_saliency(const ViewpointChannel& channel, const PolygonNeighbours& neighbours,
                         double* saliency, S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that `polygon_saliency` needs for a number of workers.
[[nodiscard]] std::size_t polygon_saliency_scratch_size(const ViewpointChannel& channel,
                                                        int workers);

/// Writes the saliency of every viewpoint, S(v) = Σ S(o) p(v|o): how much of what stands out it shows.
/// All of them add up to Σ S(o) over the polygons seen. 0 where p(v) is 0.
///
/// `saliency` holds one finite number ≥ 0 per polygon, `result` one double per viewpoint. Scratch:
/// `viewpoint_saliency_scratch_size`. Tasks are blocks of polygons.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome viewpoint_saliency(const ViewpointChannel& channel, const double* saliency, double* result,
                           S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that `viewpoint_saliency` needs for a number of workers.
[[nodiscard]] std::size_t viewpoint_saliency_scratch_size(const ViewpointChannel& channel,
                                                          int workers);

namespace detail {

/// The divergence as H(Z) − H(Z|V), where Z says which of the two polygons a view shows: views that see
/// only one of them add nothing to H(Z|V).
class DissimilaritySum {
public:
    /// For a view that sees both, with these joint probabilities.
    void add(double a, double b)
    {
        const double sum = a + b;
        undecided_ += rounded(a * std::log2(sum / a)) + rounded(b * std::log2(sum / b));
    }
    [[nodiscard]] double result(double p_a, double p_b) const
    {
        const double sum = p_a + p_b;
        const double all =
            rounded(p_a * std::log2(sum / p_a)) + rounded(p_b * std::log2(sum / p_b));
        const double divergence = (all - undecided_) / sum;
        return divergence < 0x1p-40 ? 0 : (std::min)(divergence, 1.0);
    }

private:
    double undecided_ = 0;
};

/// One finite number ≥ 0 per polygon.
[[nodiscard]] inline Error check_saliency(const ViewpointChannel& channel, const double* saliency,
                                          const char* name)
{
    const std::size_t count = channel.polygon_count();
    if (saliency == nullptr && count > 0)
        return {ErrorCode::null_data, name, 0, "one number per polygon"};
    for (std::size_t o = 0; o < count; ++o)
        if (!is_finite(saliency[o]) || saliency[o] < 0)
            return {ErrorCode::bad_value, name, saliency[o], "finite numbers >= 0"};
    return {};
}

}  // namespace detail

inline double dissimilarity(const ViewpointChannel& channel, std::size_t a, std::size_t b)
{
    if (a == b || !channel.seen(a) || !channel.seen(b)) return 0;
    const double p_a = channel.p_polygon(a), p_b = channel.p_polygon(b);
    detail::DissimilaritySum sum;
    channel.for_each_view(a, [&](std::size_t v, double, double q) {
        const double other = channel.p_view_given_polygon(v, b) * p_b;
        if (other > 0) sum.add(q, other);
    });
    return sum.result(p_a, p_b);
}

inline std::size_t polygon_saliency_scratch_size(const ViewpointChannel& channel, int workers)
{
    return detail::task_scratch_size(
        [&](detail::ScratchLayout& block, std::size_t count) {
            return block.take<double>(count * channel.view_count());
        },
        workers);
}

template <ScratchSource S, Executor E>
Outcome polygon_saliency(const ViewpointChannel& channel, const PolygonNeighbours& neighbours,
                         double* saliency, S&& scratch, E&& executor)
{
    const std::size_t polygons = channel.polygon_count(), views = channel.view_count();
    if (neighbours.polygon_count() != polygons)
        return {{ErrorCode::bad_size, "neighbours", double(neighbours.polygon_count()),
                 "the neighbours of the channel's polygons"}};
    if (saliency == nullptr && polygons > 0)
        return {{ErrorCode::null_data, "saliency", 0, "one double per polygon"}};

    constexpr std::size_t step = 512;
    const auto layout = [&](detail::ScratchLayout& block, std::size_t workers) {
        return block.take<double>(workers * views);
    };
    const auto body = [&](Work& work, double* memory, int task, int worker) {
        // The row of a polygon, spread out; its neighbours' rows are read against it.
        double* const joint = memory + static_cast<std::size_t>(worker) * views;
        for (std::size_t v = 0; v < views; ++v) joint[v] = 0;
        const std::size_t first = static_cast<std::size_t>(task) * step;
        const std::size_t last = (std::min)(first + step, polygons);
        for (std::size_t o = first; o < last; ++o) {
            saliency[o] = 0;
            if (!channel.seen(o)) continue;
            channel.for_each_view(o, [&](std::size_t v, double, double q) { joint[v] = q; });
            std::size_t count = 0;
            double total = 0;
            for (const std::uint32_t other : neighbours[o]) {
                if (!channel.seen(other)) continue;
                detail::DissimilaritySum sum;
                channel.for_each_view(other, [&](std::size_t v, double, double q) {
                    ++work.samples;
                    if (joint[v] > 0) sum.add(joint[v], q);
                });
                total += sum.result(channel.p_polygon(o), channel.p_polygon(other));
                ++count;
            }
            if (count > 0) saliency[o] = total / static_cast<double>(count);
            channel.for_each_view(o, [&](std::size_t v, double, double) { joint[v] = 0; });
        }
    };
    Outcome outcome = detail::run_tasks(static_cast<int>((polygons + step - 1) / step), layout,
                                        body, scratch, executor);
    if (outcome) outcome.work.passes = 1;
    return outcome;
}

inline std::size_t viewpoint_saliency_scratch_size(const ViewpointChannel& channel, int workers)
{
    return detail::ViewSums::scratch_size(channel.rows(), workers);
}

template <ScratchSource S, Executor E>
Outcome viewpoint_saliency(const ViewpointChannel& channel, const double* saliency, double* result,
                           S&& scratch, E&& executor)
{
    if (const Error error = detail::check_saliency(channel, saliency, "saliency")) return {error};
    if (result == nullptr && channel.view_count() > 0)
        return {{ErrorCode::null_data, "result", 0, "one double per viewpoint"}};
    const auto add = [&](std::size_t o, double* sums) {
        if (!channel.seen(o)) return;
        const double p = channel.p_polygon(o);
        channel.for_each_view(o, [&](std::size_t v, double, double q) {
            sums[v] += detail::rounded(q / p) * saliency[o];
        });
    };
    Outcome outcome = detail::with_view_sums(
        channel.rows(), scratch, executor,
        [&](const detail::ViewSums& sums) { sums.run(channel.rows(), result, add, executor); });
    if (!outcome) return outcome;
    outcome.work.passes = 1;
    outcome.work.samples = channel.entry_count();
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
