#pragma once

#include <cmath>
#include <cstddef>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/channel_sums.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// What `channel_entropies` computes, in bits.
struct ChannelEntropies {
    double view = 0;     ///< H(V)
    double polygon = 0;  ///< H(O)
    double joint = 0;    ///< H(V, O)
    /// I(V; O) = Σ p(v) VMI(v), and as Σ p(o) PMI(o). The two differ by rounding alone, and so does
    /// H(V) + H(O) − H(V, O).
    double information_by_views = 0;
    double information_by_polygons = 0;
};

}  // namespace nook

/// Shannon's measures of a viewpoint channel, in bits, in double precision. 0 log 0 = 0. Tasks are
/// blocks of polygons that depend on the channel alone: the same bits with any executor. `work` stays 0.
namespace nook::inline NOOK_TARGET {

/// The polygonal mutual information, one per polygon (González, Sbert & Feixas 2008, equation 10):
/// PMI(o) = Σ_v p(v|o) log2(p(v|o) / p(v)), ≥ 0 and ≤ −log2 of the least p(v); exactly −log2 p(v) where
/// one view alone sees the polygon. What is not seen gets 0: see `ViewpointChannel::seen`.
///
/// It tells how unevenly a polygon is seen, not how much of it: its areas may all shrink by one factor
/// (while others grow, so that the a_v stay), and PMI stays. A facet that is mostly covered, but seen
/// from everywhere, gets less than an open one. `information_ao` gives the visibility beside it.
template <Executor E = Serial>
Outcome polygon_mutual_information(const ViewpointChannel& channel, double* information,
                                   E&& executor = E{});

/// The viewpoint mutual information, one per view:
/// VMI(v) = Σ_o p(o|v) log2(p(o|v) / p(o)) ≥ 0; 0 where p(v) = 0. The least is the best view.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome viewpoint_mutual_information(const ViewpointChannel& channel, double* information,
                                     S&& scratch = S{}, E&& executor = E{});

/// The viewpoint entropy H(O|v) = −Σ_o p(o|v) log2 p(o|v), one per view, whatever p(v); 0 for views
/// that see nothing. Without the background, unlike that of Vázquez et al. 2001.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome viewpoint_entropy(const ViewpointChannel& channel, double* entropy, S&& scratch = S{},
                          E&& executor = E{});

/// The entropies of views, polygons and pairs, and the information between views and polygons from
/// both sides.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome channel_entropies(const ViewpointChannel& channel, ChannelEntropies& entropies,
                          S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that each function of this header asks for: at most 8 MiB, and 8 per view for each
/// worker and once more.
[[nodiscard]] std::size_t channel_measures_scratch_size(const ViewpointChannel& channel,
                                                        int workers);

namespace detail {

/// Never negative; and never −0.
[[nodiscard]] NOOK_INLINE double information_of(double value) { return value > 0 ? value : 0; }

/// Σ_v p(v|o) log2(p(v|o) / p(v)), for p(o) > 0. Logarithms of areas, of a_v and of p(o) apart: the
/// first come from a table, the others once per view and per polygon.
[[nodiscard]] inline double row_information(const ChannelRows& rows, std::size_t o)
{
    LongSum sum;
    std::size_t views = 0, last = 0;
    rows.visit(o, [&](std::size_t v, auto amount) {
        const double scale = rows.scale[v];
        if (!(scale > 0)) return;
        sum.add(double(amount) * scale * (rows.log2_of(amount) - rows.log_area[v]));
        ++views;
        last = v;
    });
    if (views == 1) return information_of(-std::log2(rows.p_view[last]));
    return information_of(sum.total() / rows.p_polygon[o] - std::log2(rows.p_polygon[o]));
}

/// VMI of every view.
template <class E>
void view_information(const ChannelRows& rows, double* information, const ViewSums& sums,
                      E& executor)
{
    sums.run(
        rows, information,
        [&](std::size_t o, double* part) {
            if (!(rows.p_polygon[o] > 0)) return;
            const double log_p = std::log2(rows.p_polygon[o]);
            rows.visit(o, [&](std::size_t v, auto amount) {
                part[v] += double(amount) * (rows.log2_of(amount) - log_p);
            });
        },
        executor);
    for (std::size_t v = 0; v < rows.view_count; ++v)
        information[v] = rows.p_view[v] > 0
                             ? information_of(information[v] / rows.view_area[v] - rows.log_area[v])
                             : 0;
}

/// What one block of polygons adds to the entropies.
struct EntropySums {
    double polygon = 0, joint = 0, information = 0;
};
[[nodiscard]] inline EntropySums entropies_of(const ChannelRows& rows, std::size_t begin,
                                              std::size_t end)
{
    LongSum polygon, joint, information;
    for (std::size_t o = begin; o < end; ++o) {
        const double p = rows.p_polygon[o];
        if (!(p > 0)) continue;
        LongSum row;
        rows.visit(o, [&](std::size_t v, auto amount) {
            const double q = double(amount) * rows.scale[v];
            if (q > 0) row.add(q * (rows.log2_of(amount) + rows.log_scale[v]));
        });
        polygon.add(-p * std::log2(p));
        joint.add(-row.total());
        information.add(p * row_information(rows, o));
    }
    return {polygon.total(), joint.total(), information.total()};
}

[[nodiscard]] inline Error check_per_polygon(const ViewpointChannel& channel, const double* values,
                                             const char* name)
{
    if (values != nullptr || channel.polygon_count() == 0) return {};
    return {ErrorCode::null_data, name, 0, "one number per polygon"};
}
[[nodiscard]] inline Error check_per_view(const ViewpointChannel& channel, const double* values,
                                          const char* name)
{
    if (values != nullptr || channel.view_count() == 0) return {};
    return {ErrorCode::null_data, name, 0, "one number per view"};
}

}  // namespace detail

inline std::size_t channel_measures_scratch_size(const ViewpointChannel& channel, int workers)
{
    return detail::ViewSums::scratch_size(channel.rows(), workers);
}

template <Executor E>
Outcome polygon_mutual_information(const ViewpointChannel& channel, double* information,
                                   E&& executor)
{
    if (const Error error = detail::check_per_polygon(channel, information, "information"))
        return {error};
    detail::for_each_polygon(
        channel.rows(),
        [&](std::size_t o) {
            information[o] = channel.seen(o) ? detail::row_information(channel.rows(), o) : 0;
        },
        executor);
    return {};
}

template <ScratchSource S, Executor E>
Outcome viewpoint_mutual_information(const ViewpointChannel& channel, double* information,
                                     S&& scratch, E&& executor)
{
    if (const Error error = detail::check_per_view(channel, information, "information"))
        return {error};
    return detail::with_view_sums(
        channel.rows(), scratch, executor, [&](const detail::ViewSums& sums) {
            detail::view_information(channel.rows(), information, sums, executor);
        });
}

template <ScratchSource S, Executor E>
Outcome viewpoint_entropy(const ViewpointChannel& channel, double* entropy, S&& scratch,
                          E&& executor)
{
    if (const Error error = detail::check_per_view(channel, entropy, "entropy")) return {error};
    const detail::ChannelRows& rows = channel.rows();
    return detail::with_view_sums(rows, scratch, executor, [&](const detail::ViewSums& sums) {
        sums.run(
            rows, entropy,
            [&](std::size_t o, double* part) {
                rows.visit(o, [&](std::size_t v, auto amount) {
                    part[v] += double(amount) * rows.log2_of(amount);
                });
            },
            executor);
        for (std::size_t v = 0; v < rows.view_count; ++v)
            entropy[v] =
                rows.view_area[v] > 0
                    ? detail::information_of(rows.log_area[v] - entropy[v] / rows.view_area[v])
                    : 0;
    });
}

template <ScratchSource S, Executor E>
Outcome channel_entropies(const ViewpointChannel& channel, ChannelEntropies& entropies, S&& scratch,
                          E&& executor)
{
    const detail::ChannelRows& rows = channel.rows();
    return detail::with_view_sums(rows, scratch, executor, [&](const detail::ViewSums& sums) {
        detail::EntropySums blocks[detail::ChannelBlocks::most] = {};
        const detail::ChannelBlocks cut{rows.polygon_count};
        executor.for_each(cut.count, [&](int block, int) {
            blocks[block] = detail::entropies_of(rows, cut.begin(block), cut.end(block));
        });
        ChannelEntropies result{};
        for (int block = 0; block < cut.count; ++block) {
            result.polygon += blocks[block].polygon;
            result.joint += blocks[block].joint;
            result.information_by_polygons += blocks[block].information;
        }
        detail::view_information(rows, sums.result, sums, executor);
        detail::LongSum view, information;
        for (std::size_t v = 0; v < rows.view_count; ++v) {
            const double p = rows.p_view[v];
            if (!(p > 0)) continue;
            view.add(-p * std::log2(p));
            information.add(p * sums.result[v]);
        }
        result.view = detail::information_of(view.total());
        result.polygon = detail::information_of(result.polygon);
        result.joint = detail::information_of(result.joint);
        result.information_by_views = information.total();
        entropies = result;
    });
}

}  // namespace nook::inline NOOK_TARGET
