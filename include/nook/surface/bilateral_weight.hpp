#pragma once

#include <algorithm>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/lanes.hpp>

/// Which neighbours of a pixel lie on the same surface: what the blur and the upsampling share.
///
/// A neighbour counts by its distance from the tangent plane of the pixel, in units of the deviation
/// allowed there: 1 − e² up to |e| = 1, nothing beyond. Planes of every tilt thus look like frontal
/// ones. Without normals the plane follows from the depths around (`screen_slope`), and the distance
/// from it is measured along the view axis.
namespace nook::inline NOOK_TARGET::detail {

/// Distances are taken as if they lay between `nearest` and `farthest`, so that no product of the
/// weights leaves the range of `Real`.
template <class Real>
struct GuideRange {
    static constexpr Real farthest = std::is_same_v<Real, float> ? Real(0x1p40) : Real(0x1p200);
    static constexpr Real nearest = 1 / farthest;
};

/// The tangent plane of pixels, divided by the deviation allowed at them. A neighbour `right` and
/// `down` pixels away at distance q deviates by (q − d) (a + ax right + ay down) + bx right + by down:
/// differences alone, so nothing cancels.
template <class L>
struct TangentPlane {
    L distance;
    L a, ax, ay, bx, by;
};

/// What the weights of a call have in common.
template <class Real>
struct EdgeRule {
    /// The allowed deviation at distance d: constant + d (linear + d quadratic).
    Real constant, linear, quadratic;
    /// Slopes per pixel to the right and down; under orthography lengths.
    Real across, down;
    /// The slope of the rays of pixel (0, 0).
    Real first_x, first_y;
    /// Cosine between normals at which the weight is 0, and what the weight gains per unit from there.
    Real normal_limit, normal_scale;
    bool orthographic;

    /// `pixels`: how far neighbours may lie. The slope of quantised depths is off by up to half a step
    /// per pixel, so the steps of the buffer are allowed for besides.
    EdgeRule(double tolerance, double length, double least_cosine, const DepthStep& step,
             int pixels, const Projection& projection)
        : constant{limited(length + (pixels + 8) * step.constant)},
          linear{limited(tolerance + (pixels + 8) * step.linear)},
          quadratic{limited((pixels + 8) * step.quadratic)},
          across{slope(1 / projection.fx)},
          down{slope(-1 / projection.fy)},
          first_x{slope((0.5 - projection.cx) / projection.fx)},
          first_y{slope((projection.cy - 0.5) / projection.fy)},
          normal_limit{static_cast<Real>(least_cosine)},
          normal_scale{static_cast<Real>(1 / (1 - least_cosine))},
          orthographic{projection.orthographic}
    {}

    template <class L>
    [[nodiscard]] NOOK_INLINE L allowed(const L& distance) const
    {
        const L deviation = constant + distance * (linear + distance * quadratic);
        return larger(smaller(deviation, distance * Real{0x1p20}), distance * Real{0x1p-20});
    }
    /// What is linear on screen along a plane: 1/d, under orthography d; 0 for background.
    template <class L>
    [[nodiscard]] NOOK_INLINE L on_screen(const L& distance) const
    {
        if (orthographic) return distance;
        const auto surface = distance > Real{0};
        return surface ? 1 / (surface ? distance : L{} + Real{1}) : L{};
    }
    /// How much `screen_slope` multiplies second differences by: a quarter of the allowed deviation
    /// becomes 1. `scale` is 1 / allowed(distance).
    template <class L>
    [[nodiscard]] NOOK_INLINE L bend(const L& distance, const L& scale) const
    {
        const L four = scale * Real{4};
        return orthographic ? four : four * distance * distance;
    }
    /// The plane with these slopes of `on_screen`.
    template <class L>
    [[nodiscard]] NOOK_INLINE TangentPlane<L> from_slopes(const L& distance, const L& a,
                                                          const L& right, const L& below) const
    {
        if (orthographic) return {distance, a, L{}, L{}, -right * a, -below * a};
        const L scale = distance * a, ax = right * scale, ay = below * scale;
        return {distance, a, ax, ay, ax * distance, ay * distance};
    }
    /// The plane with this normal through the point of a pixel.
    template <class L>
    [[nodiscard]] NOOK_INLINE TangentPlane<L> from_normal(const L& distance, const L& scale,
                                                          const L& x, const L& y, const L& nx,
                                                          const L& ny, const L& nz) const
    {
        const L ax = nx * across * scale, ay = ny * down * scale;
        if (orthographic) return {distance, -nz * scale, L{}, L{}, ax, ay};
        const L slope_x = first_x + x * across, slope_y = first_y + y * down;
        const L ray = nx * slope_x + ny * slope_y - nz;
        return {distance, ray * scale, ax, ay, ax * distance, ay * distance};
    }
    template <class L>
    [[nodiscard]] NOOK_INLINE L normal_weight(const L& cosine) const
    {
        return larger(smaller((cosine - normal_limit) * normal_scale, L{} + Real{1}), L{});
    }

private:
    static Real limited(double value) { return static_cast<Real>((std::min)(value, 0x1p60)); }
    static Real slope(double value)
    {
        return static_cast<Real>((std::min)((std::max)(value, -0x1p20), 0x1p20));
    }
};

/// The slope per pixel of what is linear on screen along planes, from the pixel c, two before and two
/// after it (0 = missing): the mean over the stretches of three pixels with c that are straight, which a
/// silhouette or a feature of one pixel is not. `bend` scales their second differences; from 1 on a
/// stretch does not count. With none the slope is 0.
template <class L>
[[nodiscard]] NOOK_INLINE L screen_slope(const L& before2, const L& before, const L& c,
                                         const L& after, const L& after2, const L& bend)
{
    using Real = typename LanesTraits<L>::Value;
    const L zero{}, one = zero + Real{1};
    // Selects one after the other: GCC 12 takes vectors of combined conditions apart.
    const auto straight = [&](const L& a, const L& b, const L& d) NOOK_INLINE_LAMBDA -> L {
        const L bent = ((a - b) + (d - b)) * bend, weight = larger(one - bent * bent, zero);
        return smaller(a, smaller(b, d)) > zero ? weight : zero;
    };
    const L weight_left = straight(before2, before, c);
    const L weight_right = straight(after2, after, c);
    const L weight = straight(before, c, after);
    const L sum = (weight_left + weight_right) + weight;
    const L slopes =
        (weight_left * (c - before2) + weight_right * (after2 - c)) + weight * (after - before);
    return slopes * Real{0.5} / larger(sum, zero + Real{0.25});
}

/// Rows with their margins are counted by int.
template <class T>
[[nodiscard]] Error check_guide(const ImageView<T>& depth)
{
    if (depth.width > 1 << 30)
        return {ErrorCode::bad_size, "depth", double(depth.width), "a width of at most 2^30"};
    return {};
}

/// The options of depth and normals that the blur and the upsampling share.
[[nodiscard]] inline Error check_edges(double tolerance, double length, double least_cosine)
{
    if (const Error error =
            check_at_least(tolerance, 0, "options.tolerance", "a finite number >= 0"))
        return error;
    if (const Error error = check_at_least(length, 0, "options.length", "a finite length >= 0"))
        return error;
    if (!is_finite(least_cosine) || least_cosine < -1 || least_cosine >= 1)
        return {ErrorCode::bad_value, "options.least_cosine", least_cosine,
                "a cosine from -1 to below 1"};
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
