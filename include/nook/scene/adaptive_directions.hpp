#pragma once

#include <algorithm>

#include <nook/lanes.hpp>
#include <nook/target.hpp>

namespace nook {

/// Every point takes all of its directions.
struct FixedDirections {};

/// A point takes as many directions as its own uncertainty asks for: `least`, twice as many, and so on,
/// up to `directions`.
///
/// Where geometry proves that nothing can be hit no ray is traced. Elsewhere a pilot comes first:
/// `least` directions of another sequence, from which the variance v of what a direction lets through is
/// judged. The point then takes the first n directions of its own sequence, n the smallest of these
/// numbers with a standard error ≤ tolerance. That error is taken as √(v / n), as of independent
/// directions, or v^1/4 n^-3/4 where that is less: what the sets reach on silhouettes. Among leaves and
/// twigs, finer than the distance between directions, it was up to a sixth more.
///
/// Stopping does not bias. The pilot chooses n and is not averaged in; the mean of n directions
/// that know nothing of it is right on average for every n that it may choose (two-stage sampling, Stein
/// 1945). To stop once the directions so far agree would favour 0 and 1.
///
/// Pilot and directions together are never more than `directions`. There is no pilot where it could
/// not save its own cost, nor where `directions` has no room beside it for a point that is half hidden.
/// At equal RMSE over a picture a fixed number is as good or better, since the error of the sets hardly
/// depends on how much is hidden. What this gives is one promise for every point, without a number of
/// directions to choose.
struct AdaptiveDirections {
    /// The standard error asked for, finite, ≥ 0. 0: all directions, the bits of `FixedDirections`.
    double tolerance = 0.025;
    /// Directions of the pilot, and the fewest that give a value, ≥ 1. Where they are more than
    /// `directions`, all of those are taken.
    int least = 16;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET::detail {

/// The variance of what `count` directions let through that sum up to `sum`, and squared to `squares`.
/// Half a direction that lets nothing through and half a one that lets all through are added (Jeffreys'
/// prior), since no pilot is certain.
[[nodiscard]] inline double pilot_variance(double sum, double squares, int count)
{
    const double all = count + 1.0, mean = (sum + 0.5) / all;
    return (squares + 0.5) / all - rounded(mean * mean);
}
inline constexpr double largest_variance = 0.25;

/// How many directions a variance asks for: least · 2^k, or `most` ≥ 1 if that is less.
[[nodiscard]] inline int enough_directions(const AdaptiveDirections& stopping, double variance,
                                           int most)
{
    const double tolerance = (std::min)(stopping.tolerance, 1.0);
    int count = (std::min)(stopping.least, most);
    const auto enough = [&] {
        // v / n ≤ t², or √v n^-3/2 ≤ t².
        const double share = tolerance * count, allowed = rounded(share * tolerance);
        return variance <= rounded(allowed * (std::max)(rounded(share * share), 1.0));
    };
    while (count < most && !enough()) count = count > most / 2 ? most : 2 * count;
    return count;
}

}  // namespace nook::inline NOOK_TARGET::detail
