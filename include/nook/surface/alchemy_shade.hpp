#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/lanes.hpp>
#include <nook/surface/alchemy.hpp>
#include <nook/surface/alchemy_options.hpp>
#include <nook/surface/rise_rule.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/surface/tap_pattern.hpp>

/// What Alchemy ambient obscurance and its reference share: constants and places of samples.
namespace nook::inline NOOK_TARGET::detail {

/// Everything that does not change from pixel to pixel; lengths are scaled.
struct AlchemyShade {
    RiseRule rise;
    double scale;  ///< of the sum
    double epsilon, square_radius, contrast;
    bool scalable;

    AlchemyShade(const AlchemyOptions& options, double plane_scale, const DepthStep& step,
                 double rounding, bool orthographic)
    {
        // Beyond these nothing changes any more, and float stays within its range.
        constexpr double largest_length = 0x1p40, largest_square = 0x1p100;
        const auto length = [&](double value) {
            return (std::min)(value * plane_scale, largest_length);
        };
        const double radius = length(options.radius);
        scalable = options.falloff == AlchemyFalloff::scalable;
        rise = {{step.constant * plane_scale, step.linear, step.quadratic / plane_scale},
                rounding,
                (std::min)(options.bias.value_or(-1), largest_length),
                radius,
                orthographic};
        const double intensity =
            options.intensity ? length(*options.intensity) : radius * (scalable ? 0.9 : 0.6);
        scale = intensity * (scalable ? 5 : 2);
        square_radius = radius * radius;
        epsilon = options.epsilon
                      ? (std::min)(*options.epsilon * plane_scale * plane_scale, largest_square)
                      : square_radius * (scalable ? 0.15 : 0.05);
        contrast = options.contrast;
    }
    /// From the sum of terms to visibility.
    [[nodiscard]] double visibility(double sum, int samples) const
    {
        const double open = alchemy_visibility(sum, scale, samples);
        return contrast == 1 ? open : std::pow(open, contrast);
    }
};

using AlchemySpiral = Spiral<largest_sample_count>;

/// The angles that single pixels choose from.
struct Rotations {
    static constexpr int count = 64;
    float cosine[count], sine[count];

    Rotations()
    {
        for (int i = 0; i < count; ++i) {
            const double angle = 2 * std::numbers::pi * i / count;
            cosine[i] = static_cast<float>(std::cos(angle));
            sine[i] = static_cast<float>(std::sin(angle));
        }
    }
    [[nodiscard]] static int of(int x, int y, std::uint32_t seed)
    {
        return static_cast<int>(pixel_turn(x, y, seed) * count);
    }
};
/// Where a sample of a pixel lies, in whole pixels: numbers or lanes.
template <class Whole>
struct PixelOffset {
    Whole right, down;
};
template <class Pixels>
[[nodiscard]] NOOK_INLINE auto pixel_offset(float x, float y, const Pixels& cosine,
                                            const Pixels& sine, const Pixels& reach_x,
                                            const Pixels& reach_y)
{
    const Pixels across = rounded(Pixels(x * cosine)) - rounded(Pixels(y * sine));
    const Pixels along = rounded(Pixels(x * sine)) + rounded(Pixels(y * cosine));
    const auto right = whole_pixels(across, reach_x), down = whole_pixels(along, reach_y);
    return PixelOffset<std::remove_cv_t<decltype(right)>>{right, down};
}
/// How far a pixel looks; 0 where that is less than a pixel.
[[nodiscard]] inline double pixel_slope(double distance, const ReachRule& rule)
{
    const double slope =
        (std::min)(rule.orthographic ? rule.radius : rule.radius / distance, rule.largest);
    return slope * (std::max)(rule.fx, rule.fy) >= 1 ? slope : 0;
}

}  // namespace nook::inline NOOK_TARGET::detail
