#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/checks.hpp>
#include <nook/depth/moments_block.hpp>
#include <nook/depth/moments_direct.hpp>
#include <nook/depth/moments_separable.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>

/// Moments of the depths in a square window around each pixel (Chan & Im 2021, section III), three
/// ways that agree: `box_moments`, constant time per pixel; `box_moments_separable`, the paper's two
/// passes of k samples; `box_moments_reference`, all k² samples.
///
/// Background enters no moment and is not counted. No form subtracts large sums: each sum is taken
/// about a sample of its own window, so a spike, an infinity or a NaN changes nothing outside the
/// windows that contain it, and relief far smaller than the distance keeps its variance.
namespace nook {

struct MomentsOptions {
    /// Pixels across the window: odd, 1 … 32767. 1 is the pixel alone.
    int window = 31;
    /// What windows do at the border of the image.
    Border border = Border::symmetric;
};

/// Where the moments go: each view has the size of the depth, or is empty and costs nothing. At
/// background pixels all of them are 0. What leaves the range of Value becomes its largest.
template <class Value>
struct BoxMoments {
    /// Surface samples in the window.
    ImageView<std::int32_t> count{};
    /// Mean squared distance from the mean, depth².
    ImageView<Value> variance{};
    /// The pixel's distance minus the mean, computed from differences.
    ImageView<Value> deviation{};
    /// M1, the mean.
    ImageView<Value> mean{};
    /// M2, the mean square.
    ImageView<Value> mean_square{};
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Moments in constant time per pixel, whatever the window (van Herk 1992 block sums about a sample of
/// each window). Sums are in double, where squares of float differences can neither overflow nor
/// underflow.
template <DepthInput Depth, class Value, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome box_moments(const Depth& depth, const BoxMoments<Value>& moments,
                    const MomentsOptions& options = {}, S&& scratch = S{}, E&& executor = E{});

/// Moments by the paper's separable filter, 2 k samples per pixel.
template <DepthInput Depth, class Value, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome box_moments_separable(const Depth& depth, const BoxMoments<Value>& moments,
                              const MomentsOptions& options = {}, S&& scratch = S{},
                              E&& executor = E{});

/// Moments from all k² samples of each window, in two passes: the oracle.
template <DepthInput Depth, class Value, Executor E = Serial>
Outcome box_moments_reference(const Depth& depth, const BoxMoments<Value>& moments,
                              const MomentsOptions& options = {}, E&& executor = E{});

namespace detail {

[[nodiscard]] constexpr Error check_moments_window(const MomentsOptions& options)
{
    return check_window(options.window, 32767, "options.window", "an odd number from 1 to 32767");
}

}  // namespace detail

/// Bytes of scratch that `box_moments` needs for an image and a number of workers; 0 for options
/// that it refuses.
template <DepthInput Depth>
[[nodiscard]] std::size_t box_moments_scratch_size(const Depth& depth,
                                                   const MomentsOptions& options, int workers)
{
    using Filter = detail::BlockMoments<distance_t<Depth>>;
    const auto& image = depth_source(depth).image;
    if (workers < 1 || detail::check_moments_window(options)) return 0;
    return Filter{image.width, image.height, options.window, options.border}.scratch_size(workers);
}

/// Bytes of scratch that `box_moments_separable` needs, likewise.
template <DepthInput Depth>
[[nodiscard]] std::size_t box_moments_separable_scratch_size(const Depth& depth,
                                                             const MomentsOptions& options,
                                                             int workers)
{
    using Filter = detail::SeparableMoments<distance_t<Depth>, double>;
    const auto& image = depth_source(depth).image;
    if (workers < 1 || detail::check_moments_window(options)) return 0;
    return Filter{image.width, image.height, options.window, options.border}.scratch_size(workers);
}

namespace detail {

template <class Source, class Value>
[[nodiscard]] Error check_moments(const Source& source, const BoxMoments<Value>& moments,
                                  const MomentsOptions& options)
{
    if (const Error error = check_source(source)) return error;
    if (const Error error = check_moments_window(options)) return error;
    Error first{};
    const auto check = [&](const auto& image, const char* name, const auto&... others) {
        if (first || (image.data == nullptr && image.empty())) return;
        first = check_output(image, name);
        if (!first) first = check_same_size(source.image, image, name);
        if (!first) first = check_apart(source.image, image, name);
        ((first ? void() : void(first = check_apart(others, image, name))), ...);
    };
    const auto& [count, variance, deviation, mean, mean_square] = moments;
    check(count, "moments.count");
    check(variance, "moments.variance", count);
    check(deviation, "moments.deviation", count, variance);
    check(mean, "moments.mean", count, variance, deviation);
    check(mean_square, "moments.mean_square", count, variance, deviation, mean);
    return first;
}

/// Writes what was asked for at one pixel. What leaves the range of Value becomes the largest.
template <class Value>
void write_moments(const BoxMoments<Value>& moments, int x, int y, std::int32_t count,
                   double variance, double deviation, double distance)
{
    const auto write = [&](const ImageView<Value>& image, double value) {
        constexpr Value largest = (std::numeric_limits<Value>::max)();
        const auto clamped = (std::min)((std::max)(value, -double{largest}), double{largest});
        if (image.data) image(x, y) = static_cast<Value>(clamped);
    };
    if (moments.count.data) moments.count(x, y) = count;
    const double mean = distance - deviation;
    write(moments.variance, variance);
    write(moments.deviation, deviation);
    write(moments.mean, mean);
    write(moments.mean_square, mean * mean + variance);
}

/// Writes what a filter delivers.
template <class T>
struct MomentsOutput {
    using Value = double;
    static constexpr int results = 4;

    const BoxMoments<T>& moments;

    template <class Real, class Open>
    void shade(const Real& distance, const Real& count, const Open&, const Real& variance,
               const Real& deviation, Real* result) const
    {
        result[0] = distance;
        result[1] = count;
        result[2] = variance;
        result[3] = deviation;
    }
    template <class Distance>
    void row(Work& work, int y, int x, int width, const double* values, std::ptrdiff_t pitch,
             const Distance* distances) const
    {
        for (int i = 0; i < width; ++i) {
            const auto result = [&](int which) { return values[which * pitch + i]; };
            if (distances == nullptr || distances[i] > 0) {
                write_moments(moments, x + i, y, static_cast<std::int32_t>(result(1)), result(2),
                              result(3), result(0));
            } else {
                write_moments(moments, x + i, y, 0, 0, 0, 0);
                ++work.background;
            }
        }
    }
};

template <class Filter, class Source, class Value, class S, class E>
Outcome run_moments(const Source& source, const BoxMoments<Value>& moments,
                    const MomentsOptions& options, S&& scratch, E&& executor)
{
    Outcome outcome{};
    outcome.error = check_moments(source, moments, options);
    const int width = source.image.width, height = source.image.height;
    if (!outcome || source.image.empty()) return outcome;
    const Filter filter{width, height, options.window, options.border};
    outcome = filter.run(source, MomentsOutput<Value>{moments}, scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace detail

template <DepthInput Depth, class Value, ScratchSource S, Executor E>
Outcome box_moments(const Depth& depth, const BoxMoments<Value>& moments,
                    const MomentsOptions& options, S&& scratch, E&& executor)
{
    return detail::run_moments<detail::BlockMoments<distance_t<Depth>>>(
        depth_source(depth), moments, options, scratch, executor);
}

template <DepthInput Depth, class Value, ScratchSource S, Executor E>
Outcome box_moments_separable(const Depth& depth, const BoxMoments<Value>& moments,
                              const MomentsOptions& options, S&& scratch, E&& executor)
{
    return detail::run_moments<detail::SeparableMoments<distance_t<Depth>, double>>(
        depth_source(depth), moments, options, scratch, executor);
}

template <DepthInput Depth, class Value, Executor E>
Outcome box_moments_reference(const Depth& depth, const BoxMoments<Value>& moments,
                              const MomentsOptions& options, E&& executor)
{
    const auto& source = depth_source(depth);
    Outcome outcome{};
    outcome.error = detail::check_moments(source, moments, options);
    if (!outcome || source.image.empty()) return outcome;
    const int width = source.image.width, height = source.image.height;
    // Counted apart, so that the tasks share nothing.
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            outcome.work.background += !(surface_distance(source, x, y) > 0);
    executor.for_each(height, [&](int y, int) {
        const detail::Span rows =
            detail::window_span(y, options.window / 2, height, options.border);
        for (int x = 0; x < width; ++x) {
            const auto centre = surface_distance(source, x, y);
            if (!(centre > 0)) {
                detail::write_moments(moments, x, y, 0, 0, 0, 0);
                continue;
            }
            const auto columns = detail::window_span(x, options.window / 2, width, options.border);
            const auto window = detail::direct_moments<double>(source, centre, columns, rows);
            detail::write_moments(moments, x, y, window.count, window.variance, window.deviation,
                                  double{centre});
        }
    });
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
