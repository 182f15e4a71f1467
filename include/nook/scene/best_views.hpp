#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/channel_sums.hpp>
#include <nook/scene/polygon_saliency.hpp>
#include <nook/scene/view_merger.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scene/viewpoint_channel_rows.hpp>
#include <nook/scratch.hpp>

/// Which viewpoints show most: those whose picture, or whose pictures together, have the polygons in
/// the proportions of the whole channel (Feixas, Sbert & González 2009, "A unified
/// information-theoretic framework for viewpoint selection and mesh saliency").
namespace nook {

/// A chosen viewpoint.
struct BestView {
    std::uint32_t view = 0;
    /// In bits, ≥ 0; less is better. Ranked: KL(p(O|v) ‖ p(O)), the viewpoint mutual information of this
    /// view. Chosen one after another: that of all views chosen so far, merged.
    double information = 0;
    /// p(v) of this view, or of all views chosen so far.
    double probability = 0;
};

struct BestViewsOptions {
    /// At most this many views.
    std::size_t count = 6;
    /// Stop as soon as the merged views are left with this share of I(V;O), 0 to 1. 0: never.
    double share = 0;
    /// One number per polygon, finite, ≥ 0, that says how much it matters beside its area, or null: all
    /// the same. p(O) becomes p(o) S(o) / Σ p(o) S(o). Polygons with 0 are left out of the channel:
    /// the divergence of every view that shows one would be infinite. When all polygons seen have 0 it
    /// says nothing and is not used.
    const double* saliency = nullptr;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the views from best to worst to ranking[0 … *found). Views that see nothing, have p(v) = 0, or
/// see nothing of any saliency, are left out. Views whose information is equal within 1e-12 bit stand in
/// the order of their numbers.
///
/// `ranking` has room for all views of the channel; `saliency` is as in BestViewsOptions: the measure is
/// then the extended viewpoint mutual information, EVMI. Scratch: `best_views_scratch_size`. Tasks are
/// blocks of polygons.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome rank_views(const ViewpointChannel& channel, BestView* ranking, std::size_t* found,
                   const double* saliency = nullptr, S&& scratch = S{}, E&& executor = E{});

/// Chooses views that complement each other: first the one with the least information, then always the
/// one that, merged with those chosen, leaves the least. Writes them to best[0 … *found) in this order;
/// `best` has room for options.count views, or all of the channel if they are fewer. Which views are left
/// out, and how equal ones are told apart: as in `rank_views`. The first is the best view.
///
/// All views together leave 0 (without saliency); on the way there it may rise. Each step reads the
/// channel once for all views at a time. Scratch and tasks as in `rank_views`.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome best_views(const ViewpointChannel& channel, BestView* best, std::size_t* found,
                   const BestViewsOptions& options = {}, S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that `rank_views` and `best_views` need for a number of workers.
[[nodiscard]] std::size_t best_views_scratch_size(const ViewpointChannel& channel, int workers);

/// The information that a set of views leaves when they are merged, from its definition, in bits: the
/// reference for `best_views`. 0 for views that see nothing. Each view counts once; `saliency` is as in
/// BestViewsOptions, and `views` and it must be valid. Serial, slow.
[[nodiscard]] double merged_information(const ViewpointChannel& channel, const std::uint32_t* views,
                                        std::size_t count, const double* saliency = nullptr);

namespace detail {

/// Views whose information differs by less are told apart by their numbers: the sums of a channel carry
/// the rounding of as many terms as it has entries.
inline constexpr double equal_information = 1e-12;

template <class E>
[[nodiscard]] BestView best_view(const ViewMerger<E>& merger, std::size_t v)
{
    return {static_cast<std::uint32_t>(v), merger.information(v), merger.probability(v)};
}

/// Checks what both choices take and gives use(merger) its memory; it returns how often it has read the
/// channel.
template <class S, class E, class Use>
Outcome with_view_merger(const ViewpointChannel& channel, const BestView* output, std::size_t room,
                         const char* name, std::size_t* found, const double* saliency, S&& scratch,
                         E& executor, const Use& use)
{
    if (output == nullptr && room > 0)
        return {{ErrorCode::null_data, name, 0, "room for the chosen views"}};
    if (found == nullptr) return {{ErrorCode::null_data, "found", 0, "where the number goes"}};
    if (saliency != nullptr)
        if (const Error error = check_saliency(channel, saliency, "saliency")) return {error};
    const std::size_t size =
        best_views_scratch_size(channel, static_cast<int>(executor.concurrency()));
    void* const block = size == 0 ? nullptr : scratch.reserve(size);
    if (block == nullptr && size > 0) return {check_scratch<S>(size)};
    *found = 0;
    if (room == 0) return {};
    ScratchLayout layout{block};
    ViewMerger<E> merger{layout, channel, saliency, executor};
    merger.start();
    Outcome outcome{};
    outcome.work.passes = 1 + use(merger);
    outcome.work.samples = outcome.work.passes * channel.entry_count();
    return outcome;
}

}  // namespace detail

inline std::size_t best_views_scratch_size(const ViewpointChannel& channel, int workers)
{
    detail::ScratchLayout layout;
    const detail::ViewSums sums{channel.rows(), workers, layout};
    static_cast<void>(layout.take<double>(channel.view_count()));
    static_cast<void>(layout.take<std::uint8_t>(channel.view_count()));
    return layout.size();
}

template <ScratchSource S, Executor E>
Outcome rank_views(const ViewpointChannel& channel, BestView* ranking, std::size_t* found,
                   const double* saliency, S&& scratch, E&& executor)
{
    const std::size_t views = channel.view_count();
    const auto rank = [&](auto& merger) -> std::uint64_t {
        merger.run();
        std::size_t count = 0;
        for (std::size_t v = 0; v < views; ++v)
            if (merger.candidate(v)) ranking[count++] = detail::best_view(merger, v);
        std::sort(ranking, ranking + count, [](const BestView& a, const BestView& b) {
            return a.information < b.information ||
                   (!(b.information < a.information) && a.view < b.view);
        });
        for (std::size_t first = 0, last = 0; first < count; first = last) {
            const double most = ranking[first].information + detail::equal_information;
            while (last < count && !(ranking[last].information > most)) ++last;
            std::sort(ranking + first, ranking + last,
                      [](const BestView& a, const BestView& b) { return a.view < b.view; });
        }
        *found = count;
        return 1;
    };
    return detail::with_view_merger(channel, ranking, views, "ranking", found, saliency, scratch,
                                    executor, rank);
}

template <ScratchSource S, Executor E>
Outcome best_views(const ViewpointChannel& channel, BestView* best, std::size_t* found,
                   const BestViewsOptions& options, S&& scratch, E&& executor)
{
    if (!detail::is_finite(options.share) || options.share < 0 || options.share > 1)
        return {{ErrorCode::bad_value, "options.share", options.share, "a share from 0 to 1"}};
    const std::size_t views = channel.view_count();
    const auto choose = [&](auto& merger) -> std::uint64_t {
        double whole = 0;
        for (std::size_t step = 0; step < options.count; ++step) {
            merger.run();
            double least = (std::numeric_limits<double>::max)();
            std::size_t candidates = 0;
            for (std::size_t v = 0; v < views; ++v) {
                if (!merger.candidate(v)) continue;
                const BestView view = detail::best_view(merger, v);
                if (step == 0) whole += view.probability * view.information;
                least = detail::smaller(least, view.information);
                ++candidates;
            }
            if (candidates == 0) return step + 1;
            std::size_t v = 0;
            while (!merger.candidate(v) ||
                   merger.information(v) > least + detail::equal_information)
                ++v;
            const BestView chosen = detail::best_view(merger, v);
            best[step] = chosen;
            *found = step + 1;
            merger.choose(chosen.view);
            const double enough = options.share * whole + detail::equal_information;
            if (candidates == 1 || (options.share > 0 && chosen.information <= enough))
                return step + 1;
        }
        return options.count;
    };
    return detail::with_view_merger(channel, best, (std::min)(options.count, views), "best", found,
                                    options.saliency, scratch, executor, choose);
}

inline double merged_information(const ViewpointChannel& channel, const std::uint32_t* views,
                                 std::size_t count, const double* saliency)
{
    const detail::TargetDistribution target{channel, saliency};
    const auto merged = [&](std::size_t o) {
        double sum = 0;
        channel.for_each_view(o, [&](std::size_t v, double, double q) {
            bool in_set = false;
            for (std::size_t i = 0; i < count && !in_set; ++i) in_set = views[i] == v;
            if (in_set) sum += q;
        });
        return target[o] > 0 ? sum : 0;
    };
    detail::LongSum mass, divergence;
    for (std::size_t o = 0; o < channel.polygon_count(); ++o) mass.add(merged(o));
    if (!(mass.total() > 0)) return 0;
    for (std::size_t o = 0; o < channel.polygon_count(); ++o)
        if (const double p = detail::rounded(merged(o) / mass.total()); p > 0)
            divergence.add(p * std::log2(p / target[o]));
    return (std::max)(divergence.total(), 0.0);
}

}  // namespace nook::inline NOOK_TARGET
