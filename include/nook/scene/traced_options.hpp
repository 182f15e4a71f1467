#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/scene/adaptive_directions.hpp>
#include <nook/scene/falloff.hpp>
#include <nook/scene/occluder_colour.hpp>
#include <nook/scene/sampling.hpp>
#include <nook/scene/secondary_rays.hpp>

namespace nook::inline NOOK_TARGET {

/// What the ray-traced kernels estimate. What a type leaves out costs nothing. In a call, plain braces
/// mean `TracedOptions<>`; anything else is spelled:
/// `TracedOptions<ExponentialFalloff, SecondaryRays>{.radius = 2, .falloff = {1.5}}`.
template <Falloff F = StepFalloff, class Secondary = NoSecondaryRays,
          OccluderColour Colour = NoColour, class Stopping = FixedDirections>
struct TracedOptions {
    static_assert(std::same_as<Secondary, NoSecondaryRays> ||
                  std::same_as<Secondary, SecondaryRays>);
    static_assert(std::same_as<Stopping, FixedDirections> ||
                  std::same_as<Stopping, AdaptiveDirections>);
    static constexpr bool has_falloff = !std::same_as<F, StepFalloff>;
    static constexpr bool has_secondary = std::same_as<Secondary, SecondaryRays>;
    static constexpr bool has_colour = !std::same_as<Colour, NoColour>;
    static constexpr bool is_adaptive = std::same_as<Stopping, AdaptiveDirections>;

    /// How far occluders reach, in world units, ≥ 0, included; infinite: all of the scene. Secondary
    /// rays need a finite one.
    double radius = std::numeric_limits<double>::infinity();
    /// Directions per point, at most for `AdaptiveDirections`, ≥ 1. Powers of two converge fastest.
    int directions = 256;
    /// Chooses the directions.
    std::uint32_t seed = 0;
    /// Index of the first direction in each point's sequence. For an image that is refined over
    /// frames: frame × directions; see `accumulate`.
    std::uint32_t first_direction = 0;
    DirectionSet set = DirectionSet::scrambled_sobol;
    /// How far the rasteriser may have moved a surface on the image, in pixels, ≥ 0: 2⁻¹² covers
    /// `nook::rasterise`; a GPU with 8 sub-pixel bits needs 2⁻⁸.
    double position_error = 0x1p-12;
    [[no_unique_address]] F falloff{};
    [[no_unique_address]] Secondary secondary{};
    [[no_unique_address]] Colour colour{};
    [[no_unique_address]] Stopping stopping{};
};

/// Checks the ranges of the options.
template <class F, class Secondary, class Colour, class Stopping>
[[nodiscard]] Error check_traced_options(
    const TracedOptions<F, Secondary, Colour, Stopping>& options)
{
    if (detail::is_nan(options.radius) || options.radius < 0)
        return {ErrorCode::bad_value, "options.radius", options.radius,
                "a distance >= 0, or infinity"};
    if (options.directions < 1)
        return {ErrorCode::bad_value, "options.directions", double(options.directions),
                "a number >= 1"};
    if (options.set > DirectionSet::r2)
        return {ErrorCode::bad_value, "options.set", double(options.set), "a DirectionSet"};
    if (const Error error = detail::check_at_least(options.position_error, 0,
                                                   "options.position_error", "pixels, >= 0"))
        return error;
    if constexpr (std::same_as<F, ExponentialFalloff>)
        if (detail::is_nan(options.falloff.sigma) || options.falloff.sigma < 0)
            return {ErrorCode::bad_value, "options.falloff.sigma", options.falloff.sigma,
                    "a number >= 0, or infinity"};
    if constexpr (std::same_as<Secondary, SecondaryRays>) {
        const SecondaryRays& secondary = options.secondary;
        if (!detail::is_finite(options.radius))
            return {ErrorCode::bad_value, "options.radius", options.radius,
                    "a finite distance, for secondary rays"};
        if (!detail::is_finite(secondary.radius))
            return {ErrorCode::bad_value, "options.secondary.radius", secondary.radius,
                    "a distance >= 0, or negative for half the radius"};
        if (!(secondary.jitter >= 0 && secondary.jitter <= 1) || detail::is_nan(secondary.jitter))
            return {ErrorCode::bad_value, "options.secondary.jitter", secondary.jitter, "0 to 1"};
    }
    if constexpr (std::same_as<Colour, FaceAlbedo>)
        if (options.colour.rgb == nullptr)
            return {ErrorCode::null_data, "options.colour.rgb", 0, "three floats per face"};
    if constexpr (std::same_as<Stopping, AdaptiveDirections>) {
        if (const Error error =
                detail::check_at_least(options.stopping.tolerance, 0, "options.stopping.tolerance",
                                       "a finite number >= 0"))
            return error;
        if (options.stopping.least < 1)
            return {ErrorCode::bad_value, "options.stopping.least", double(options.stopping.least),
                    "a number >= 1"};
    }
    return {};
}

}  // namespace nook::inline NOOK_TARGET
