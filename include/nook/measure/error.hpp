#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// How far an image lies from a reference, over the pixels that count. All 0 when none does.
struct ErrorMetrics {
    double rmse = 0;           ///< root of the mean squared difference
    double mae = 0;            ///< mean absolute difference
    double bias = 0;           ///< mean of image − reference: > 0 where the image is too bright
    double p99 = 0;            ///< at least 99 % of the pixels are no farther off (nearest rank)
    double maximum = 0;        ///< largest absolute difference
    std::uint64_t pixels = 0;  ///< pixels that count
};

/// One number, or why there is none. Converts to true on success.
struct [[nodiscard]] Measured {
    Error error{};
    double value = 0;

    NOOK_INLINE constexpr explicit operator bool() const { return !error; }
};

/// What the measures compare: views of numbers, one of which is the reference.
template <class T>
concept Measurable = std::is_arithmetic_v<std::remove_const_t<T>>;

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Bytes of scratch that `error_metrics` wants: one double per pixel.
[[nodiscard]] inline std::size_t error_metrics_scratch_size(int width, int height);

/// Compares an image with a reference of the same size.
///
/// `mask` has their size too, or is empty: then every pixel counts. A mask of 0 takes a pixel out,
/// whatever it holds. A pixel that counts and holds NaN or infinity, or a number beyond ±2⁴⁰⁰ in
/// double, is an error that names the image it was found in. On an error `result` is unchanged.
/// Sums run in double, row by row and then over the rows: the order of the pixels shows only in
/// the last of its digits. The percentile is exact, by selection in scratch.
/// The outcome counts the pixels that count as `pixels` and the others as `background`.
template <Measurable T, Measurable U, ScratchSource S = HeapScratch>
Outcome error_metrics(const ImageView<T>& image, const ImageView<U>& reference,
                      ErrorMetrics& result, const ImageView<const std::uint8_t>& mask = {},
                      S&& scratch = S{});

/// The root mean squared error alone, without scratch. Arguments and errors as `error_metrics`;
/// 0 when no pixel counts.
template <Measurable T, Measurable U>
Measured rmse(const ImageView<T>& image, const ImageView<U>& reference,
              const ImageView<const std::uint8_t>& mask = {});

namespace detail {

/// The sums behind the means, and the largest absolute difference.
struct DifferenceSums {
    double sum = 0, absolute = 0, square = 0, largest = 0;
    std::uint64_t pixels = 0;

    DifferenceSums& operator+=(const DifferenceSums& other)
    {
        sum += other.sum;
        absolute += other.absolute;
        square += other.square;
        largest = (std::max)(largest, other.largest);
        pixels += other.pixels;
        return *this;
    }
};

/// Sizes and data of two images and a mask.
template <class T, class U>
[[nodiscard]] Error check_measured(const ImageView<T>& image, const ImageView<U>& reference,
                                   const ImageView<const std::uint8_t>& mask)
{
    if (const Error error = check_input(image, "image")) return error;
    if (const Error error = check_input(reference, "reference")) return error;
    if (const Error error = check_same_size(image, reference, "reference")) return error;
    if (const Error error = check_input(mask, "mask")) return error;
    return mask.empty() ? Error{} : check_same_size(image, mask, "mask");
}

/// A value that the sums can take: 2⁴⁰⁰ squared, times any number of pixels, stays in range.
[[nodiscard]] constexpr bool is_measurable(double value)
{
    return is_finite(value) && value <= 0x1p400 && value >= -0x1p400;
}
[[nodiscard]] constexpr Error unmeasurable(const char* image, double value)
{
    return {ErrorCode::bad_value, image, value, "finite numbers where the mask counts"};
}

/// Sums over the counted pixels; `each(difference)` sees every one of them in order.
template <class T, class U, class F>
[[nodiscard]] Error difference_sums(const ImageView<T>& image, const ImageView<U>& reference,
                                    const ImageView<const std::uint8_t>& mask,
                                    DifferenceSums& total, F&& each)
{
    for (int y = 0; y < image.height; ++y) {
        DifferenceSums row;
        for (int x = 0; x < image.width; ++x) {
            if (!mask.empty() && mask(x, y) == 0) continue;
            const double value = static_cast<double>(image(x, y));
            const double expected = static_cast<double>(reference(x, y));
            if (!is_measurable(value)) return unmeasurable("image", value);
            if (!is_measurable(expected)) return unmeasurable("reference", expected);
            const double difference = value - expected;
            row += {difference, std::fabs(difference), difference * difference,
                    std::fabs(difference), 1};
            each(difference);
        }
        total += row;
    }
    return {};
}

[[nodiscard]] inline double mean(double sum, std::uint64_t count)
{
    return count == 0 ? 0 : sum / static_cast<double>(count);
}

}  // namespace detail

[[nodiscard]] inline std::size_t error_metrics_scratch_size(int width, int height)
{
    if (width <= 0 || height <= 0) return 0;
    detail::ScratchLayout layout;
    layout.take<double>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    return layout.size();
}

template <Measurable T, Measurable U, ScratchSource S>
Outcome error_metrics(const ImageView<T>& image, const ImageView<U>& reference,
                      ErrorMetrics& result, const ImageView<const std::uint8_t>& mask, S&& scratch)
{
    if (const Error error = detail::check_measured(image, reference, mask)) return {error};
    if (image.empty()) {
        result = {};
        return {};
    }
    const std::size_t bytes = error_metrics_scratch_size(image.width, image.height);
    void* block = scratch.reserve(bytes);
    if (block == nullptr) return {detail::check_scratch<S>(bytes)};
    const auto all = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    double* const magnitudes = detail::ScratchLayout{block}.take<double>(all);

    detail::DifferenceSums sums;
    double* last = magnitudes;
    if (const Error error =
            detail::difference_sums(image, reference, mask, sums,
                                    [&](double difference) { *last++ = std::fabs(difference); }))
        return {error};

    result.pixels = sums.pixels;
    result.rmse = std::sqrt(detail::mean(sums.square, sums.pixels));
    result.mae = detail::mean(sums.absolute, sums.pixels);
    result.bias = detail::mean(sums.sum, sums.pixels);
    result.maximum = sums.largest;
    result.p99 = 0;
    if (sums.pixels > 0) {
        // The rank ⌈0.99 n⌉, in integers.
        const std::uint64_t rank = sums.pixels - sums.pixels / 100;
        double* const at = magnitudes + (rank - 1);
        // A comparison of our own: std::less would be shared between targets.
        std::nth_element(magnitudes, at, last, [](double a, double b) { return a < b; });
        result.p99 = *at;
    }
    Outcome outcome{};
    outcome.work.pixels = sums.pixels;
    outcome.work.background = all - sums.pixels;
    outcome.work.passes = 1;
    return outcome;
}

template <Measurable T, Measurable U>
Measured rmse(const ImageView<T>& image, const ImageView<U>& reference,
              const ImageView<const std::uint8_t>& mask)
{
    if (const Error error = detail::check_measured(image, reference, mask)) return {error};
    detail::DifferenceSums sums;
    if (const Error error = detail::difference_sums(image, reference, mask, sums, [](double) {}))
        return {error};
    return {{}, std::sqrt(detail::mean(sums.square, sums.pixels))};
}

}  // namespace nook::inline NOOK_TARGET
