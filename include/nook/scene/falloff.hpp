#pragma once

#include <cmath>
#include <concepts>

#include <nook/target.hpp>

namespace nook {

/// A hit within the radius lets nothing through: ambient occlusion. With an infinite radius there is no
/// falloff at all.
struct StepFalloff {};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// A hit at a distance d lets through μ(d) = 1 − exp(−σ d): obscurance (Fridvalszky & Tóth 2022, after
/// Zhukov et al. 1998). A miss lets through exactly 1.
struct ExponentialFalloff {
    /// 1 / world units, ≥ 0 or infinite. 0: every hit lets nothing through; infinite: everything.
    double sigma = 1;

    /// Without the loss of digits of 1 − exp at small distances.
    [[nodiscard]] double operator()(double distance) const
    {
        return -std::expm1(-(sigma * distance));
    }
};

/// StepFalloff, or any function from the distance of a hit, > 0, in world units, to what it lets
/// through: kept within [0, 1], NaN as 0.
template <class F>
concept Falloff = std::same_as<F, StepFalloff> || requires(const F& falloff, double distance)
{
    {
        falloff(distance)
        } -> std::convertible_to<double>;
};

}  // namespace nook::inline NOOK_TARGET
