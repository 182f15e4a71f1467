#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/measure/error.hpp>
#include <nook/measure/rank_correlation.hpp>

namespace nook {

/// What is left of an image's error once its values may be replaced by the best monotone function of
/// themselves. All 0 when no pixel counts.
struct MonotoneFit {
    /// Root of the mean squared difference between the reference and that function: at most the RMSE
    /// of the image, and at most the standard deviation of the reference.
    double rmse = 0;
    std::uint64_t levels = 0;  ///< values that the function takes; 1: the order says nothing
    std::uint64_t pixels = 0;  ///< pixels that count
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Bytes of scratch that `monotone_fit` wants: 16 per pixel.
[[nodiscard]] inline std::size_t monotone_fit_scratch_size(int width, int height);

/// How well an image tells a reference of the same size when its scale does not matter: fits the
/// non-decreasing function of the image's value that comes closest to the reference in the mean
/// square, by pooling adjacent violators (Ayer, Brunk, Ewing, Reid & Silverman 1955). For kernels that
/// bound or rank what the reference holds, and do not estimate it.
///
/// Pixels of equal value get one value of the function (Kruskal 1964, the secondary approach to ties);
/// ±0 are equal. Only the order of the image's values enters: a growing function of them that keeps
/// them apart changes no bit, nor does the order of the pixels. An image that orders all pixels as the
/// reference does gives exactly 0. Arguments and errors as `error_metrics`. O(n log n).
/// The outcome counts the pixels that count as `pixels` and the others as `background`.
template <Measurable T, Measurable U, ScratchSource S = HeapScratch>
Outcome monotone_fit(const ImageView<T>& image, const ImageView<U>& reference, MonotoneFit& result,
                     const ImageView<const std::uint8_t>& mask = {}, S&& scratch = S{});

namespace detail {

/// A pixel: the key of its value and its reference. Later a block of pixels: how many they are, and
/// the mean of their references.
struct FitBlock {
    std::int64_t key;
    double mean;
};

/// Joins the next block of pixels to one. Returns by how much the squared deviations from the means
/// grow (Chan, Golub & LeVeque 1979): no two large sums are subtracted, and equal means add exactly 0.
[[nodiscard]] inline double join(FitBlock& block, const FitBlock& next)
{
    const auto one = static_cast<double>(block.key), other = static_cast<double>(next.key);
    const double step = next.mean - block.mean;
    block.key += next.key;
    block.mean += step * other / (one + other);
    return step * step * (one * other / (one + other));
}

}  // namespace detail

[[nodiscard]] inline std::size_t monotone_fit_scratch_size(int width, int height)
{
    if (width <= 0 || height <= 0) return 0;
    detail::ScratchLayout layout;
    layout.take<detail::FitBlock>(static_cast<std::size_t>(width) *
                                  static_cast<std::size_t>(height));
    return layout.size();
}

template <Measurable T, Measurable U, ScratchSource S>
Outcome monotone_fit(const ImageView<T>& image, const ImageView<U>& reference, MonotoneFit& result,
                     const ImageView<const std::uint8_t>& mask, S&& scratch)
{
    using detail::FitBlock;
    if (const Error error = detail::check_measured(image, reference, mask)) return {error};
    if (image.empty()) {
        result = {};
        return {};
    }
    const std::size_t bytes = monotone_fit_scratch_size(image.width, image.height);
    void* block = scratch.reserve(bytes);
    if (block == nullptr) return {detail::check_scratch<S>(bytes)};
    const auto all = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    FitBlock* const blocks = detail::ScratchLayout{block}.take<FitBlock>(all);

    std::size_t pixels = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            if (!mask.empty() && mask(x, y) == 0) continue;
            const double value = static_cast<double>(image(x, y));
            const double expected = static_cast<double>(reference(x, y));
            if (!detail::is_measurable(value)) return {detail::unmeasurable("image", value)};
            if (!detail::is_measurable(expected))
                return {detail::unmeasurable("reference", expected)};
            blocks[pixels++] = {detail::rank_key(value), expected};
        }
    // Equal values by their references, so that sums run in one order whatever that of the pixels.
    std::sort(blocks, blocks + pixels, [](const FitBlock& a, const FitBlock& b) {
        return a.key != b.key ? a.key < b.key : a.mean < b.mean;
    });

    // The blocks so far take the places of pixels that are done with; their means grow.
    double squares = 0;
    std::size_t levels = 0;
    detail::for_each_tie(
        pixels, [&](std::size_t i) { return blocks[i].key; },
        [&](std::size_t begin, std::size_t end) {
            FitBlock next{1, blocks[begin].mean};
            for (const FitBlock* equal = blocks + begin + 1; equal != blocks + end; ++equal)
                squares += detail::join(next, {1, equal->mean});
            for (; levels > 0 && !(blocks[levels - 1].mean < next.mean); --levels)
                squares += detail::join(next, blocks[levels - 1]);
            blocks[levels++] = next;
        });

    result = {std::sqrt(detail::mean(squares, pixels)), levels, pixels};
    Outcome outcome{};
    outcome.work.pixels = pixels;
    outcome.work.background = all - pixels;
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
