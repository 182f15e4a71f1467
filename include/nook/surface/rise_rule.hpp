#pragma once

#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/lanes.hpp>

/// The automatic bias of kernels over depth and normals: what keeps flat ground open.
namespace nook::inline NOOK_TARGET::detail {

/// What float and double leave of v·n, in parts of |v|.
template <class Real>
inline constexpr double surface_rounding = std::is_same_v<Real, float> ? 0x1p-19 : 0x1p-22;

/// How far a sample on the tangent plane may seem to rise above it.
///
/// A stored depth is off by a step at most, which moves a point along its ray r and across the plane by
/// |n·r| steps. Under perspective P = d |n·r| is the same for all points of the plane; that is P / q
/// steps at distance q: P (c / q + l + k q) for steps c + l q + k q². Under orthography |n·r| itself is
/// the same, and over what a pixel looks at |n·r| q ≤ P + slope. The rest is rounding, 2⁻¹⁹ |v| for
/// float, for which |v| ≤ (L + v·v / L) / 2 with any L; the radius here, or the distance if that is
/// less.
struct RiseRule {
    DepthStep step;  ///< scaled
    double rounding;
    double fixed;  ///< β of the caller; negative: automatic
    double radius;
    bool orthographic;

    /// constant + per_distance q + per_square v·v
    template <class Real>
    struct Rise {
        Real constant, per_distance, per_square;
    };
    /// `across` = |n·r| of the pixel, `slope` how far it looks.
    template <class Real>
    [[nodiscard]] Rise<Real> at(const Real& distance, const Real& across, double slope) const
    {
        using Value = typename LanesTraits<Real>::Value;
        const Real zero{};
        if (fixed >= 0) return {distance * static_cast<Value>(fixed), zero, zero};
        const auto number = [](double value) { return static_cast<Value>(value); };
        const Value c = number(step.constant), l = number(step.linear), k = number(step.quadratic);
        const Real reach = zero + number(radius), tiny = zero + number(0x1p-60);
        const Real length = orthographic ? reach : smaller(reach, Real(larger(distance, tiny)));
        const Real own =
            across * (c + distance * (l + distance * k)) + length * number(rounding / 2);
        const Real plane = distance * across, per_square = number(rounding / 2) / length;
        if (orthographic)
            return {own + across * c, across * l + (plane + number(slope)) * k, per_square};
        // c |n·r'| ≤ c (|n·r| + slope) for the ray r' of the neighbour.
        return {own + plane * l + c * (across + number(slope)), plane * k, per_square};
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
