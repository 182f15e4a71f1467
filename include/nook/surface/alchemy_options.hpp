#pragma once

#include <cstdint>
#include <optional>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/target.hpp>

namespace nook {

/// How the weight of an occluder falls with its distance.
enum class AlchemyFalloff : std::uint8_t {
    alchemy,  ///< 1 / |v|, never 0 within the disc of samples (2011)
    scalable  ///< to 0 at the radius, as (1 − v·v / r²)³ (2012)
};

/// What shares the places of the samples.
enum class SamplePattern : std::uint8_t {
    row,  ///< 16 pixels side by side, and their angle is the row's: a sample is one contiguous load
    pixel  ///< none: an angle hashed from each pixel, and reads one by one
};

struct AlchemyOptions {
    /// World length that the disc of samples spans on the screen at the pixel's distance, ≥ 0.
    double radius = 1;
    /// Samples per pixel, 0 … 64; 0 leaves everything open.
    int samples = 16;
    /// σ, a world length ≥ 0: how dark obscurance gets. Unset: 0.6 radii for `alchemy`, 0.9 for
    /// `scalable`. With the ε below these come closest to ray-traced ambient occlusion: a mean RMSE of
    /// 0.100 and 0.129 over ten scenes; with ε = 1e-4 radii² and the best σ it is 0.142 and 0.178.
    std::optional<double> intensity{};
    /// k, ≥ 0: the power of the result. 0 leaves everything open.
    double contrast = 1;
    /// β ≥ 0: samples less than β times the pixel's distance above its tangent plane do not count.
    /// Unset: what the spacing of the depth buffer and float rounding may raise a sample above it, so
    /// that flat ground stays exactly 1 at any tilt. 0: none; flat ground then shows rounding.
    std::optional<double> bias{};
    /// ε ≥ 0 of the formula, a squared world length: mutes the nearest samples. Unset: 0.05 radii² for
    /// `alchemy`, 0.15 for `scalable`.
    std::optional<double> epsilon{};
    AlchemyFalloff falloff = AlchemyFalloff::alchemy;
    SamplePattern pattern = SamplePattern::row;
    /// Turns of the spiral of samples, ≥ 0; coprime to `samples` is best.
    int turns = 7;
    /// The largest radius of the disc of samples on the screen, in pixels, 1 … 4096. Bounds the cost
    /// near the viewer, where the disc then spans less than `radius`.
    int max_pixels = 256;
    /// Turns all spirals, for instance by the number of the frame.
    std::uint32_t seed = 0;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET::detail {

inline constexpr int largest_sample_count = 64;

/// False where every pixel is open by definition.
[[nodiscard]] inline bool asks_for_work(const AlchemyOptions& options)
{
    return options.radius > 0 && options.samples > 0 && options.contrast > 0;
}
/// Options that leave everything open.
[[nodiscard]] inline AlchemyOptions no_alchemy()
{
    AlchemyOptions options;
    options.samples = 0;
    return options;
}

[[nodiscard]] inline Error check_alchemy(const AlchemyOptions& options)
{
    if (const Error error = check_at_least(options.radius, 0, "options.radius", "a length >= 0"))
        return error;
    if (options.samples < 0 || options.samples > largest_sample_count)
        return {ErrorCode::bad_value, "options.samples", double(options.samples), "0 to 64"};
    if (options.intensity)
        if (const Error error =
                check_at_least(*options.intensity, 0, "options.intensity", "a length >= 0"))
            return error;
    if (const Error error = check_at_least(options.contrast, 0, "options.contrast", "a power >= 0"))
        return error;
    if (options.bias)
        if (const Error error = check_at_least(*options.bias, 0, "options.bias", "a number >= 0"))
            return error;
    if (options.epsilon)
        if (const Error error =
                check_at_least(*options.epsilon, 0, "options.epsilon", "a squared length >= 0"))
            return error;
    if (options.falloff > AlchemyFalloff::scalable)
        return {ErrorCode::bad_value, "options.falloff", double(options.falloff),
                "an AlchemyFalloff"};
    if (options.pattern > SamplePattern::pixel)
        return {ErrorCode::bad_value, "options.pattern", double(options.pattern),
                "a SamplePattern"};
    if (options.turns < 0)
        return {ErrorCode::bad_value, "options.turns", double(options.turns), "a number >= 0"};
    if (options.max_pixels < 1 || options.max_pixels > 4096)
        return {ErrorCode::bad_value, "options.max_pixels", double(options.max_pixels),
                "1 to 4096 pixels"};
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
