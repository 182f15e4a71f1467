#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/polygon_values.hpp>
#include <nook/scene/viewpoint_channel.hpp>

/// Relighting by a colour per viewpoint (González, Sbert & Feixas 2008, section 5.4). Colours come
/// from <nook/scene/environment.hpp> or from anywhere else.
namespace nook {

/// What becomes of the terms of equation 11 that are negative: those of views that see a polygon less
/// than they see of the whole, p(v|o) < p(v). Light from there would darken it.
enum class NegativeTerms : std::uint8_t {
    /// Each term gets (p(v) − p(v|o)) / ln 2 on top: none is negative then, and their sum is the same,
    /// because both distributions add up to 1. A view that does not see o counts for p(v) / ln 2.
    balanced,
    /// As printed. The result may be negative, and may rise with the light.
    plain,
};

struct RelightingOptions {
    NegativeTerms negative_terms = NegativeTerms::balanced;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes I_α(o) = Σ_v (1 − c_α(v)) p(v|o) log2(p(v|o) / p(v)), equation 11, in bits, for each polygon o
/// and each channel α of colour: what is dark about the surroundings that o looks at. With balanced
/// terms it is the polygon's mutual information for black light (c = 0), falls or stays as any c
/// grows, and is exactly 0 for white light (c = 1); it is never negative. 0 for unseen polygons.
///
/// `colours`: three floats per viewpoint, each in [0, 1]. `information`: three doubles per polygon.
/// Tasks are blocks of polygons; the same bits with any executor.
template <Executor E = Serial>
Outcome relit_information(const ViewpointChannel& channel, const float* colours,
                          double* information, const RelightingOptions& options = {},
                          E&& executor = E{});

/// The map to show: the least number of all channels of the seen polygons becomes 1, the largest 0,
/// linearly between. One range for the three, so that tints survive. When all are within 1e-12 of each
/// other, all become 1. Unseen polygons, and numbers that are not finite, get 0 and do not count.
///
/// `information`: as `relit_information` writes it. `visibility`: three floats per polygon.
[[nodiscard]] Error relit_visibility(const ViewpointChannel& channel, const double* information,
                                     float* visibility);

namespace detail {

/// The three sums of one polygon. One function, so that all callers round alike.
NOOK_NOINLINE inline void relit_polygon(const ViewpointChannel& channel, const float* colours,
                                        std::size_t o, bool balanced, double* information)
{
    LongSum sums[3];
    const auto add = [&](std::size_t v, double term) {
        // Every product falls as c grows, and so do sums that are always added in one order.
        for (std::size_t k = 0; k < 3; ++k)
            sums[k].add(rounded((1 - double{colours[3 * v + k]}) * term));
    };
    // Views that do not see the polygon, up to this one.
    std::size_t next = 0;
    const auto skip_to = [&](std::size_t v) {
        for (; balanced && next < v; ++next)
            if (const double p = channel.p_view(next); p > 0) add(next, p);
        next = v + 1;
    };
    const double p_polygon = channel.p_polygon(o);
    channel.for_each_view(o, [&](std::size_t v, double, double joint) {
        skip_to(v);
        const double given = rounded(joint / p_polygon), p = channel.p_view(v);
        const double term = rounded(given * std::log(given / p));
        add(v, balanced ? larger(term + (p - given), 0.0) : term);
    });
    skip_to(channel.view_count());
    for (std::size_t k = 0; k < 3; ++k) information[k] = sums[k].total() / std::numbers::ln2;
}

/// Three numbers in [0, 1] per viewpoint.
[[nodiscard]] inline Error check_view_colours(const float* colours, std::size_t view_count)
{
    if (view_count == 0) return {};
    if (colours == nullptr) return {ErrorCode::null_data, "colours", 0, "three floats per view"};
    for (std::size_t i = 0; i < 3 * view_count; ++i)
        if (!is_finite(colours[i]) || colours[i] < 0 || colours[i] > 1)
            return {ErrorCode::bad_value, "colours", double{colours[i]}, "0 to 1"};
    return {};
}

}  // namespace detail

template <Executor E>
Outcome relit_information(const ViewpointChannel& channel, const float* colours,
                          double* information, const RelightingOptions& options, E&& executor)
{
    const std::size_t polygons = channel.polygon_count();
    if (const Error error = detail::check_view_colours(colours, channel.view_count()))
        return {error};
    if (information == nullptr && polygons > 0)
        return {{ErrorCode::null_data, "information", 0, "three doubles per polygon"}};
    if (options.negative_terms > NegativeTerms::plain)
        return {{ErrorCode::bad_value, "options.negative_terms", double(options.negative_terms),
                 "a value of NegativeTerms"}};
    const bool balanced = options.negative_terms == NegativeTerms::balanced;
    const detail::ChannelBlocks blocks{polygons};
    executor.for_each(blocks.count, [&](int block, int) {
        for (std::size_t o = blocks.begin(block); o < blocks.end(block); ++o) {
            double* const result = information + 3 * o;
            if (channel.seen(o)) detail::relit_polygon(channel, colours, o, balanced, result);
            else result[0] = result[1] = result[2] = 0;
        }
    });
    Outcome outcome{};
    outcome.work.samples = channel.entry_count();
    outcome.work.passes = 1;
    return outcome;
}

inline Error relit_visibility(const ViewpointChannel& channel, const double* information,
                              float* visibility)
{
    const std::size_t polygons = channel.polygon_count();
    if (polygons == 0) return {};
    if (information == nullptr)
        return {ErrorCode::null_data, "information", 0, "three doubles per polygon"};
    if (visibility == nullptr)
        return {ErrorCode::null_data, "visibility", 0, "three floats per polygon"};
    double least = (std::numeric_limits<double>::max)(), most = -least;
    const auto counts = [&](std::size_t i) {
        return channel.seen(i / 3) && detail::is_finite(information[i]);
    };
    for (std::size_t i = 0; i < 3 * polygons; ++i) {
        if (!counts(i)) continue;
        least = detail::smaller(least, information[i]);
        most = detail::larger(most, information[i]);
    }
    constexpr double equal_within = 1e-12;
    const detail::TurnedRange turned{least, most};
    for (std::size_t i = 0; i < 3 * polygons; ++i) {
        if (!counts(i)) visibility[i] = 0;
        else if (most - least <= equal_within) visibility[i] = 1;
        else visibility[i] = static_cast<float>(turned(information[i]));
    }
    return {};
}

}  // namespace nook::inline NOOK_TARGET
