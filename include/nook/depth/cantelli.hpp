#pragma once

#include <nook/target.hpp>

/// The one-sided Chebyshev inequality (Cantelli) as an estimate of visibility.
///
/// Let a window of depths have mean μ and variance σ². The share of the window that lies at or
/// behind a depth d > μ is at most σ² / (σ² + (d − μ)²), with equality when the window holds only two
/// depths. Nothing in front of a pixel hides it less than that share is open: it is an upper bound on
/// the pixel's visibility.
///
/// Chan & Im 2021, equations 1–3. Their equation 3 clamps max(μ − d, 0), which shades creases only
/// where depth grows towards the viewer. nook's distances grow away from the viewer, so the clamp is
/// max(d − μ, 0): a pixel behind the mean of its window is shaded, one in front never is. The bias
/// (their ε) adds to the variance and so is a depth².
///
/// Templates over any ordered field, so exact rationals test what floats run.
namespace nook::inline NOOK_TARGET {

/// Equation 3: 1 where deviation = d − μ ≤ 0, else (σ² + ε) / (σ² + ε + deviation²). Takes the
/// deviation, never d and μ, whose difference cancels. variance ≥ 0, bias ≥ 0. In [0, 1]; a pixel
/// inside its own window of N samples gets at least 1/N. A positive deviation without variance and
/// bias gives 0: the whole window lies in front.
template <class Field>
[[nodiscard]] constexpr Field cantelli_upper_bound(const Field& variance, const Field& deviation,
                                                   const Field& bias)
{
    if (!(deviation > Field(0))) return Field(1);
    const Field spread = variance + bias;
    // deviation > 0, but its square may have underflowed: then 0/0 means "no relief at all".
    const Field total = spread + deviation * deviation;
    return total > Field(0) ? Field(spread / total) : Field(1);
}

/// Equation 2, without the clamp: it also darkens pixels in front of their window. 1 where variance,
/// deviation and bias are all 0.
template <class Field>
[[nodiscard]] constexpr Field cantelli_unclamped(const Field& variance, const Field& deviation,
                                                 const Field& bias)
{
    const Field magnitude = deviation < Field(0) ? Field(-deviation) : deviation;
    return cantelli_upper_bound(variance, magnitude, bias);
}

/// Equation 3 from the textbook moments: the distance, the mean M1 and the mean square M2 of its
/// window. Exact in exact arithmetic; in floating point M2 − M1² cancels when the relief is small
/// beside the distance, which is why no kernel uses it.
template <class Field>
[[nodiscard]] constexpr Field cantelli_upper_bound_of_moments(const Field& distance,
                                                              const Field& m1, const Field& m2,
                                                              const Field& bias)
{
    const Field variance = m2 - m1 * m1;
    const Field deviation = distance - m1;
    return cantelli_upper_bound(variance > Field(0) ? variance : Field(0), deviation, bias);
}

/// Range check. The paper asks for one (section III.C) and gives no formula; this one needs nothing
/// but the moments: shade, 1 − open, falls to 1 / (1 + (deviation / range)²) of itself. range > 0, in
/// the unit of the deviation; at deviation = range half of the shade is left.
template <class Field>
[[nodiscard]] constexpr Field range_checked(const Field& open, const Field& deviation,
                                            const Field& range)
{
    const Field ranges = deviation / range;
    // Not 1 - shade: compilers see ghosts in the rationals of Boost.
    Field open_in_range = open - Field(1);
    open_in_range /= Field(1) + ranges * ranges;
    open_in_range += Field(1);
    return open_in_range;
}

}  // namespace nook::inline NOOK_TARGET
