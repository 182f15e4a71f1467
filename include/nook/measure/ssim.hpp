#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/measure/error.hpp>

namespace nook::inline NOOK_TARGET {

/// Bytes of scratch that `ssim` wants: eleven rows of six doubles per pixel.
[[nodiscard]] inline std::size_t ssim_scratch_size(int width);

/// The structural similarity of an image and a reference of the same size: 1 when they are equal,
/// symmetric in the two, ≤ 1 (Wang, Bovik, Sheikh & Simoncelli 2004, eq. 13, with their window:
/// Gaussian, 11 × 11, σ = 1.5, K₁ = 0.01, K₂ = 0.03). Values range over 1, as visibility does.
///
/// The mean over the pixels that count; each window is renormalised over the pixels in it that
/// count, so neither the frame nor masked pixels enter. 1 when no pixel counts. Variances are
/// weighted means without Bessel's correction, as in the paper's eq. 15.
/// Arguments and errors as `error_metrics`.
template <Measurable T, Measurable U, ScratchSource S = HeapScratch>
Measured ssim(const ImageView<T>& image, const ImageView<U>& reference,
              const ImageView<const std::uint8_t>& mask = {}, S&& scratch = S{});

namespace detail {

inline constexpr int ssim_radius = 5;
inline constexpr int ssim_rows = 2 * ssim_radius + 1;

/// Sums over a window of the weight and, times the weight, of a, a², b, b² and (a − b)².
struct SsimSums {
    double weight = 0, a = 0, aa = 0, b = 0, bb = 0, dd = 0;

    void add(double factor, const SsimSums& other)
    {
        weight += factor * other.weight;
        a += factor * other.a;
        aa += factor * other.aa;
        b += factor * other.b;
        bb += factor * other.bb;
        dd += factor * other.dd;
    }
};

/// The similarity of two windows. The usual (2 μa μb + C₁)(2 σab + C₂) over the product of
/// (μa² + μb² + C₁) and (σa² + σb² + C₂), written with the moments of a − b: equal windows then
/// give exactly 1 in any arithmetic, and nearly equal ones lose no digits.
[[nodiscard]] inline double ssim_of(const SsimSums& sums)
{
    constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    const double a = sums.a / sums.weight, b = sums.b / sums.weight, d = a - b;
    const auto variance = [&](double squares, double mean) {
        return (std::max)(squares / sums.weight - mean * mean, 0.0);
    };
    const double mean_term = 1 - d * d / (a * a + b * b + c1);
    const double structure_term =
        1 - variance(sums.dd, d) / (variance(sums.aa, a) + variance(sums.bb, b) + c2);
    return mean_term * structure_term;
}

}  // namespace detail

[[nodiscard]] inline std::size_t ssim_scratch_size(int width)
{
    if (width <= 0) return 0;
    detail::ScratchLayout layout;
    layout.take<detail::SsimSums>(static_cast<std::size_t>(width) * detail::ssim_rows);
    return layout.size();
}

template <Measurable T, Measurable U, ScratchSource S>
Measured ssim(const ImageView<T>& image, const ImageView<U>& reference,
              const ImageView<const std::uint8_t>& mask, S&& scratch)
{
    using detail::ssim_radius, detail::ssim_rows, detail::SsimSums;
    if (const Error error = detail::check_measured(image, reference, mask)) return {error};
    if (image.empty()) return {{}, 1};
    const int width = image.width, height = image.height;
    const std::size_t bytes = ssim_scratch_size(width);
    void* block = scratch.reserve(bytes);
    if (block == nullptr) return {detail::check_scratch<S>(bytes)};
    const auto stride = static_cast<std::size_t>(width);
    SsimSums* const ring = detail::ScratchLayout{block}.take<SsimSums>(stride * ssim_rows);

    std::array<double, ssim_radius + 1> weights{};
    for (int i = 0; i <= ssim_radius; ++i)
        weights[static_cast<std::size_t>(i)] = std::exp(-(i * i) / (2 * 1.5 * 1.5));
    const auto weight = [&](int offset) {
        return weights[static_cast<std::size_t>(offset < 0 ? -offset : offset)];
    };
    const auto counts = [&](int x, int y) { return mask.empty() || mask(x, y) != 0; };

    // Each row is filtered across once, on its way into the ring; the ring is filtered down.
    Error error{};
    const auto filter_row = [&](int y) {
        SsimSums* const row = ring + stride * static_cast<std::size_t>(y % ssim_rows);
        for (int x = 0; x < width; ++x) row[x] = {};
        for (int x = 0; x < width; ++x) {
            if (!counts(x, y)) continue;
            const double a = static_cast<double>(image(x, y));
            const double b = static_cast<double>(reference(x, y));
            if (!detail::is_measurable(a)) error = detail::unmeasurable("image", a);
            if (!detail::is_measurable(b)) error = detail::unmeasurable("reference", b);
            if (error) return;
            const SsimSums sample{1, a, a * a, b, b * b, (a - b) * (a - b)};
            const int first = (std::max)(x - ssim_radius, 0);
            const int last = (std::min)(x + ssim_radius, width - 1);
            for (int at = first; at <= last; ++at) row[at].add(weight(at - x), sample);
        }
    };

    double total = 0;
    std::uint64_t pixels = 0;
    int filtered = 0;
    for (int y = 0; y < height; ++y) {
        const int first = (std::max)(y - ssim_radius, 0);
        const int last = (std::min)(y + ssim_radius, height - 1);
        for (; filtered <= last; ++filtered) {
            filter_row(filtered);
            if (error) return {error};
        }
        double row_total = 0;
        for (int x = 0; x < width; ++x) {
            if (!counts(x, y)) continue;
            SsimSums sums;
            for (int at = first; at <= last; ++at)
                sums.add(weight(at - y), ring[stride * static_cast<std::size_t>(at % ssim_rows) +
                                              static_cast<std::size_t>(x)]);
            row_total += detail::ssim_of(sums);
            ++pixels;
        }
        total += row_total;
    }
    return {{}, pixels == 0 ? 1 : total / static_cast<double>(pixels)};
}

}  // namespace nook::inline NOOK_TARGET
