#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook {

struct AccumulateOptions {
    /// The most that a pixel's history may weigh, in directions: finite and ≥ 1, or infinity. Beyond it
    /// older frames fade: each new frame of weight w enters as the share w / most_weight. With
    /// infinity every frame counts alike, and a still camera converges.
    double most_weight = std::numeric_limits<double>::infinity();
    /// Where not 0, the history is dropped and the pixel starts anew: disoccluded or moving surfaces.
    /// As large as the images, or empty: nothing is dropped.
    ImageView<const std::uint8_t> reset{};
};

/// What a frame of `accumulate` weighs: one number for all pixels, or an image.
template <class W>
concept FrameWeight = std::is_arithmetic_v<W> || requires(const W& weight)
{
    requires std::is_floating_point_v<std::remove_reference_t<decltype(weight(0, 0))>>;
    weight.row_stride;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Adds a frame to the history of every pixel, in place:
/// mean = (weight · mean + w · value) / (weight + w), weight = weight + w.
///
/// `value` is the frame, visibility or one channel of anything else that is averaged. `weight` says how
/// many directions stand behind it: a number > 0, or an image (the `weight` of TracedImages), in which 0
/// adds nothing. Secondary rays change the value alone. For frames that refine each other, frame f
/// draws the directions from `first_direction = f * directions` on.
///
/// A history that is marked for reset, weighs nothing, or holds NaN, infinity or a negative weight
/// starts anew with the frame. A frame that holds NaN or infinity, a negative weight, or takes the
/// history out of range, leaves a good history as it is and counts as skipped. Where there is neither a
/// history nor a usable frame, the mean becomes 1 and its weight 0. Never NaN.
///
/// Means of whole numbers stay exact: while value · w is whole up to rounding, as for the 0 and 1 of
/// rays, F frames of N directions give the bits of one division by F N, up to 2⁴⁸ directions. That takes
/// doubles, or a float value with N a power of two and a double history; a float history rounds once
/// per frame. The mean always lies between the old mean and the value.
///
/// All images have the size of `value`. The history may not overlap `value`, `weight` or the mask, nor
/// mean and weight each other. The same bits for any number of threads. Tasks are bands of 16 rows.
template <class V, FrameWeight W, class H, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome accumulate(const ImageView<V>& value, const W& weight, const ImageView<H>& history_mean,
                   const ImageView<H>& history_weight, const AccumulateOptions& options = {},
                   S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that `accumulate` needs for a number of workers.
[[nodiscard]] std::size_t accumulate_scratch_size(int workers);

namespace detail {

/// A mean and its weight.
struct History {
    double mean, weight;
};

[[nodiscard]] constexpr bool is_usable(const History& history)
{
    return is_finite(history.mean) && is_finite(history.weight) && history.weight >= 0;
}

/// The nearest number with four bits less: a product of a rounded quotient and its divisor becomes the
/// whole number that it was.
[[nodiscard]] constexpr double trimmed(double value)
{
    return std::bit_cast<double>((std::bit_cast<std::uint64_t>(value) + 8) & ~std::uint64_t{15});
}

/// Both usable, weights > 0.
[[nodiscard]] NOOK_INLINE History blended(const History& old, const History& frame,
                                          double most_weight)
{
    const double room = most_weight - frame.weight;
    const double kept = old.weight < room ? old.weight : room > 0 ? room : 0;
    if (!(kept > 0)) return {frame.mean, most_weight};
    const double sum = trimmed(old.mean * kept) + trimmed(frame.mean * frame.weight);
    const double weight = kept + frame.weight;
    const double mean = sum / weight;
    // Rounding may not leave the interval; an overflow shows and stays.
    const double low = old.mean < frame.mean ? old.mean : frame.mean;
    const double high = old.mean < frame.mean ? frame.mean : old.mean;
    return {!is_finite(mean) ? mean
            : mean < low     ? low
            : mean > high    ? high
                             : mean,
            weight < most_weight ? weight : most_weight};
}

}  // namespace detail

inline std::size_t accumulate_scratch_size(int workers)
{
    return detail::task_scratch_size(detail::NoMemory{}, workers);
}

template <class V, FrameWeight W, class H, ScratchSource S, Executor E>
Outcome accumulate(const ImageView<V>& value, const W& weight, const ImageView<H>& history_mean,
                   const ImageView<H>& history_weight, const AccumulateOptions& options,
                   S&& scratch, E&& executor)
{
    static_assert(std::is_floating_point_v<V>, "values are float or double");
    static_assert(std::is_floating_point_v<H>, "the history is float or double");
    constexpr bool one_weight = std::is_arithmetic_v<W>;
    Outcome outcome{};
    Error& error = outcome.error;
    if ((error = detail::check_input(value, "value"))) return outcome;
    if ((error = detail::check_input(options.reset, "options.reset"))) return outcome;
    if (!options.reset.empty() &&
        (error = detail::check_same_size(value, options.reset, "options.reset")))
        return outcome;
    if constexpr (one_weight) {
        const double all = static_cast<double>(weight);
        if (!detail::is_finite(all) || !(all > 0)) {
            error = {ErrorCode::bad_value, "weight", all, "a finite number > 0"};
            return outcome;
        }
    } else {
        if ((error = detail::check_input(weight, "weight"))) return outcome;
        if ((error = detail::check_same_size(value, weight, "weight"))) return outcome;
    }
    const ImageView<H>* const outputs[2] = {&history_mean, &history_weight};
    const char* const names[2] = {"history_mean", "history_weight"};
    for (int k = 0; k < 2; ++k) {
        if ((error = detail::check_output(*outputs[k], names[k]))) return outcome;
        if ((error = detail::check_same_size(value, *outputs[k], names[k]))) return outcome;
        if ((error = detail::check_apart(value, *outputs[k], names[k]))) return outcome;
        if ((error = detail::check_apart(options.reset, *outputs[k], names[k]))) return outcome;
        if constexpr (!one_weight)
            if ((error = detail::check_apart(weight, *outputs[k], names[k]))) return outcome;
    }
    if ((error = detail::check_apart(history_mean, history_weight, names[1]))) return outcome;
    if (detail::is_nan(options.most_weight) || options.most_weight < 1) {
        error = {ErrorCode::bad_value, "options.most_weight", options.most_weight,
                 "a number >= 1, or infinity"};
        return outcome;
    }
    if (value.empty()) return outcome;

    // Infinity stays out of the arithmetic, which -ffast-math would take to be finite.
    constexpr double largest = (std::numeric_limits<double>::max)();
    const double most = detail::is_finite(options.most_weight) ? options.most_weight : largest;
    const auto add_pixel = [&](Work& work, int x, int y) {
        detail::History frame{static_cast<double>(value(x, y)), 0};
        if constexpr (one_weight) frame.weight = static_cast<double>(weight);
        else frame.weight = static_cast<double>(weight(x, y));
        const detail::History old{static_cast<double>(history_mean(x, y)),
                                  static_cast<double>(history_weight(x, y))};
        const bool has_history = (options.reset.empty() || options.reset(x, y) == 0) &&
                                 detail::is_usable(old) && old.weight > 0;
        bool skipped = !detail::is_usable(frame);
        detail::History next = has_history ? old : detail::History{1, 0};
        if (!skipped) {
            if (!has_history) next = {frame.mean, frame.weight < most ? frame.weight : most};
            else if (frame.weight > 0) next = detail::blended(old, frame, most);
        }
        H mean = static_cast<H>(next.mean), total = static_cast<H>(next.weight);
        if (!detail::is_finite(mean) || !detail::is_finite(total)) {
            skipped = true;
            mean = has_history ? history_mean(x, y) : H{1};
            total = has_history ? history_weight(x, y) : H{0};
        }
        history_mean(x, y) = mean;
        history_weight(x, y) = total;
        if (skipped) ++work.skipped;
    };
    constexpr int band = 16;
    const auto add_band = [&](Work& work, int, int task, int) {
        const int end = value.height - task * band < band ? value.height : task * band + band;
        for (int y = task * band; y < end; ++y)
            for (int x = 0; x < value.width; ++x) add_pixel(work, x, y);
    };
    outcome = detail::run_tasks(detail::pieces(value.height, band), detail::NoMemory{}, add_band,
                                scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels =
        static_cast<std::uint64_t>(value.width) * static_cast<std::uint64_t>(value.height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
