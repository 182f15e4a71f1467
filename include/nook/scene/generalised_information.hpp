#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/channel_measures.hpp>
#include <nook/scene/channel_sums.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scratch.hpp>

/// The Tsallis-Havrda-Charvát mutual information of a viewpoint channel, which González, Sbert & Feixas
/// 2008 name as their next step: after Havrda & Charvát 1967 and Taneja 1988, of order α in (0, ∞),
///     I_α(V; O) = (Σ p(v, o)^α (p(v) p(o))^(1 − α) − 1) / ((α − 1) ln 2),
/// scaled so that α → 1 gives Shannon's in bits; α = 1 is exactly Shannon's. Larger orders weigh what
/// is seen more often than by chance; orders below 1 weigh what is seen less often.
///
/// With the ratio r = p(v, o) / (p(v) p(o)) it is the mean of (r^(α − 1) − 1) / ((α − 1) ln 2), by
/// expm1, so that orders close to 1 lose nothing. Large orders magnify the rounding of log2 r: the
/// relative error grows as α · 1e-15. Infinity where one of the means, of a polygon or a view, exceeds
/// the range of double.
namespace nook::inline NOOK_TARGET {

/// PMI_α(o), one per polygon, ≥ 0; 0 for what is not seen. I_α = Σ p(o) PMI_α(o).
template <Executor E = Serial>
Outcome generalised_polygon_information(const ViewpointChannel& channel, double alpha,
                                        double* information, E&& executor = E{});

/// VMI_α(v), one per view, ≥ 0; 0 where p(v) = 0. I_α = Σ p(v) VMI_α(v). Scratch:
/// `channel_measures_scratch_size`.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome generalised_viewpoint_information(const ViewpointChannel& channel, double alpha,
                                          double* information, S&& scratch = S{},
                                          E&& executor = E{});

/// I_α(V; O).
template <Executor E = Serial>
Outcome generalised_mutual_information(const ViewpointChannel& channel, double alpha,
                                       double& information, E&& executor = E{});

namespace detail {

/// Of a logarithm log2 r: (r^(α − 1) − 1) / ((α − 1) ln 2), which becomes log2 r.
class GeneralisedLogarithm {
public:
    explicit GeneralisedLogarithm(double alpha)
        : scale_{(alpha - 1) * std::numbers::ln2},
          shannon_{alpha == 1}
    {}
    [[nodiscard]] NOOK_INLINE double operator()(double log2_ratio) const
    {
        return shannon_ ? log2_ratio : std::expm1(scale_ * log2_ratio) / scale_;
    }
    [[nodiscard]] bool shannon() const { return shannon_; }

private:
    double scale_;
    bool shannon_;
};

/// PMI_α(o) for p(o) > 0.
[[nodiscard]] inline double row_information(const ChannelRows& rows, std::size_t o,
                                            const GeneralisedLogarithm& logarithm)
{
    if (logarithm.shannon()) return row_information(rows, o);
    const double p = rows.p_polygon[o], log_p = std::log2(p);
    LongSum sum;
    rows.visit(o, [&](std::size_t v, auto amount) {
        const double q = double(amount) * rows.scale[v];
        if (q > 0)
            sum.add(rounded(q / p) * logarithm(rows.log2_of(amount) - rows.log_area[v] - log_p));
    });
    return information_of(sum.total());
}

[[nodiscard]] inline Error check_alpha(double alpha)
{
    if (is_finite(alpha) && alpha > 0) return {};
    return {ErrorCode::bad_value, "alpha", alpha, "a finite number > 0"};
}

}  // namespace detail

template <Executor E>
Outcome generalised_polygon_information(const ViewpointChannel& channel, double alpha,
                                        double* information, E&& executor)
{
    if (const Error error = detail::check_alpha(alpha)) return {error};
    if (const Error error = detail::check_per_polygon(channel, information, "information"))
        return {error};
    const detail::GeneralisedLogarithm logarithm{alpha};
    detail::for_each_polygon(
        channel.rows(),
        [&](std::size_t o) {
            information[o] =
                channel.seen(o) ? detail::row_information(channel.rows(), o, logarithm) : 0;
        },
        executor);
    return {};
}

template <ScratchSource S, Executor E>
Outcome generalised_viewpoint_information(const ViewpointChannel& channel, double alpha,
                                          double* information, S&& scratch, E&& executor)
{
    if (const Error error = detail::check_alpha(alpha)) return {error};
    if (alpha == 1) return viewpoint_mutual_information(channel, information, scratch, executor);
    if (const Error error = detail::check_per_view(channel, information, "information"))
        return {error};
    const detail::ChannelRows& rows = channel.rows();
    const detail::GeneralisedLogarithm logarithm{alpha};
    return detail::with_view_sums(rows, scratch, executor, [&](const detail::ViewSums& sums) {
        sums.run(
            rows, information,
            [&](std::size_t o, double* part) {
                if (!(rows.p_polygon[o] > 0)) return;
                const double log_p = std::log2(rows.p_polygon[o]);
                rows.visit(o, [&](std::size_t v, auto amount) {
                    if (!(rows.scale[v] > 0)) return;
                    part[v] += double(amount) / rows.view_area[v] *
                               logarithm(rows.log2_of(amount) - rows.log_area[v] - log_p);
                });
            },
            executor);
        for (std::size_t v = 0; v < rows.view_count; ++v)
            information[v] = detail::information_of(information[v]);
    });
}

template <Executor E>
Outcome generalised_mutual_information(const ViewpointChannel& channel, double alpha,
                                       double& information, E&& executor)
{
    if (const Error error = detail::check_alpha(alpha)) return {error};
    const detail::GeneralisedLogarithm logarithm{alpha};
    const detail::ChannelRows& rows = channel.rows();
    information = detail::sum_of_polygons(
        rows,
        [&](std::size_t o) {
            return channel.seen(o) ? rows.p_polygon[o] * detail::row_information(rows, o, logarithm)
                                   : 0;
        },
        executor);
    return {};
}

}  // namespace nook::inline NOOK_TARGET
