#pragma once

#include <nook/target.hpp>

/// Light that comes back from surroundings as bright as the surface itself: brightens visibility by
/// the albedo, and tints it where the albedo has a colour. J. Jimenez, X. Wu, A. Pesce & A. Jarabo,
/// "Practical Real-Time Strategies for Accurate Indirect Occlusion", 2016, equation 10.
namespace nook::inline NOOK_TARGET {

/// Visibility with the bounces: a cubic polynomial of the visibility whose coefficients are linear
/// in the albedo, fitted to path-traced scenes, and never below the visibility itself. Both in [0,
/// 1], as is the result; what lies outside, or is not a number, is clamped. 0 stays 0 and 1 stays
/// 1, and it grows with both arguments. For colours call it per channel. Any ordered field.
template <class Field>
[[nodiscard]] constexpr Field multi_bounce(const Field& visibility, const Field& albedo)
{
    const Field zero(0), one(1);
    const auto clamped = [&](const Field& value) {
        return value > zero ? (value < one ? value : one) : zero;
    };
    const Field unit = one / Field(10000);
    const Field v = clamped(visibility), k = clamped(albedo);
    const Field a = (Field(20404) * k - Field(3324)) * unit;
    const Field b = (Field(6417) - Field(47951) * k) * unit;
    const Field c = (Field(27552) * k + Field(6903)) * unit;
    const Field fit = ((a * v + b) * v + c) * v;
    // The polynomial ends at 0.9996 … 1.0001.
    return clamped(fit > v ? fit : v);
}

}  // namespace nook::inline NOOK_TARGET
