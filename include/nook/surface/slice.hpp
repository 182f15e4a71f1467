#pragma once

#include <cmath>
#include <numbers>

#include <nook/lanes.hpp>

/// Slices of a hemisphere: half-planes around the direction to the viewer, in which a height field
/// hides all that lies below one horizon per side. J. Jimenez, X. Wu, A. Pesce & A. Jarabo,
/// "Practical Real-Time Strategies for Accurate Indirect Occlusion", 2016 (GTAO).
///
/// Angles t are measured from the direction to the viewer, positive to one side; γ is the angle of
/// the normal's projection into the slice, |γ| ≤ π/2. A slice of the cosine-weighted hemisphere has
/// the measure cos(t − γ) |sin t| dt over γ − π/2 ≤ t ≤ γ + π/2, times the length of that
/// projection.
namespace nook::inline NOOK_TARGET {

/// The part of a slice that lies less than `elevation` above the tangent, on the side to which the
/// normal leans by γ (away from which, for γ < 0): (cos γ sin²ε + sin γ (ε − sin ε cos ε)) / 2 for
/// 0 ≤ ε ≤ π/2 + γ. Exact to the last bits for small ε.
template <class Real>
[[nodiscard]] Real slice_hidden(Real elevation, Real gamma)
{
    const Real s = std::sin(elevation), c = std::cos(elevation);
    return (std::cos(gamma) * s * s + std::sin(gamma) * (elevation - s * c)) / 2;
}

/// The measure of a whole slice, cos γ + γ sin γ: how much is open where nothing rises above the
/// tangent. Its integral over all slices, times the lengths of projection, is π for every normal.
template <class Real>
[[nodiscard]] Real slice_open(Real gamma)
{
    return std::cos(gamma) + gamma * std::sin(gamma);
}

/// The inner integral of GTAO, ∫ cos(t − γ) |sin t| dt between the horizons h1 ≤ 0 ≤ h2, which lie
/// in [γ − π/2, γ + π/2]. Jimenez et al. 2016, equation 7.
template <class Real>
[[nodiscard]] Real slice_visibility(Real h1, Real h2, Real gamma)
{
    const Real c = std::cos(gamma), s = std::sin(gamma);
    return (2 * c - std::cos(2 * h1 - gamma) - std::cos(2 * h2 - gamma) + 2 * (h1 + h2) * s) / 4;
}

namespace detail {

/// ∫ cos(u − γ) |sin u| du from γ − π/2 to t, γ − π/2 ≤ t ≤ γ + π/2: the distribution of light over
/// a slice. From the nearer end, so that nothing cancels.
template <class Real>
[[nodiscard]] Real slice_integral(Real t, Real gamma)
{
    constexpr Real right = std::numbers::pi_v<Real> / 2;
    if (t <= 0) return slice_hidden(t - gamma + right, -gamma);
    return slice_open(gamma) - slice_hidden(gamma + right - t, gamma);
}

/// acos(c) − c s for s = √(1 − c²): twice the area of a segment of the unit disc. Within 6e-6;
/// exactly 0 for c = 1, s = 0. Real or lanes.
template <class Real>
[[nodiscard]] NOOK_INLINE Real disc_segment(const Real& c, const Real& s)
{
    using Value = typename LanesTraits<Real>::Value;
    const auto number = [](double value) { return static_cast<Value>(value); };
    const Real zero{};
    const Real x = larger(c, Real(zero - c));
    // (acos c − c s) / s³ by Chebyshev interpolation on [0, 1].
    Real p = zero + number(-0.15395263572);
    p = p * x + number(0.757039886126);
    p = p * x + number(-1.69292498944);
    p = p * x + number(2.38581883044);
    p = p * x + number(-2.54266349889);
    p = p * x + number(2.34190255229);
    p = p * x + number(-1.99934718922);
    p = p * x + number(1.57079126885);
    const Real part = s * s * s * p;
    return c < zero ? number(std::numbers::pi) - part : part;
}

/// cos γ + γ sin γ from cos γ in [0, 1]. Within 1.1e-6. Real or lanes.
template <class Real>
[[nodiscard]] NOOK_INLINE Real open_from_cosine(const Real& c)
{
    using Value = typename LanesTraits<Real>::Value;
    const auto number = [](double value) { return static_cast<Value>(value); };
    Real p = Real{} + number(-0.0123572277414);
    p = p * c + number(0.0621367824832);
    p = p * c + number(-0.158711176996);
    p = p * c + number(0.321870388587);
    p = p * c + number(-0.783630520309);
    p = p * c + number(-0.000106266865076);
    return p * c + number(1.57079740285);
}

/// The unit vector from a point on the ray (slope_x, slope_y, −1) to the viewer. Slopes are 0 under
/// orthography.
template <class Real>
struct ViewDirection {
    Real x, y, z;
    Real length;  ///< of the ray

    ViewDirection(const Real& slope_x, const Real& slope_y)
        : length{square_root(Real(slope_x * slope_x + slope_y * slope_y + Real{} + 1))}
    {
        z = (Real{} + 1) / length;
        x = -slope_x * z;
        y = -slope_y * z;
    }
};

/// A slice through the screen line along the displacement D = (cosine, sine, 0) in view axes, and
/// what it sees of the normal. Real or lanes.
///
/// The slice of a line on the screen is a plane through the viewer: whatever falls on the line lies
/// in it. Lines at even angles give uneven slices away from the axis: their angle φ about the
/// direction to the viewer goes as dφ ∝ 1 / |D⊥|², where D⊥ is what the displacement leaves of
/// itself across that direction. That is their weight, for displacements that go round a circle
/// evenly.
template <class Real>
struct SliceFrame {
    Real across, square_across;  ///< |D⊥| and its square
    Real normal_across;          ///< n·D⊥
    Real along_view;             ///< the normal's projection into the slice: its length × cos γ
    Real along_tangent;          ///< … × sin γ, positive towards D
    Real weight;                 ///< dφ over the angle on the screen, up to a factor
    Real open;                   ///< `slice_open` × the length of the projection
    Real edge;                   ///< tan γ × |D⊥|: where the direction to the viewer lies

    SliceFrame() = default;
    template <class Scalar>
    SliceFrame(const Scalar& cosine, const Scalar& sine, const ViewDirection<Real>& view,
               const Real& nx, const Real& ny, const Real& nz)
    {
        const Real zero{}, one = zero + 1;
        const Real lean = cosine * view.x + sine * view.y;
        along_view = nx * view.x + ny * view.y + nz * view.z;
        // At least 1 / length² of the ray.
        square_across = one - lean * lean;
        across = square_root(square_across);
        normal_across = cosine * nx + sine * ny - lean * along_view;
        // The length of the projection × |D⊥|.
        const Real size = square_root(
            Real(along_view * along_view * square_across + normal_across * normal_across));
        const auto usable = size > zero;
        // One division for both.
        const Real inverse = one / (across * (usable ? size : one));
        const Real per_across = inverse * (usable ? size : one), per_size = inverse * across;
        weight = per_across * per_across;
        along_tangent = normal_across * per_across;
        const Real facing = larger(along_view, Real(zero - along_view)) * across * per_size;
        open = size * per_across * open_from_cosine(facing);
        edge = normal_across / (along_view > zero ? along_view : one);
    }
};

}  // namespace detail
}  // namespace nook::inline NOOK_TARGET
