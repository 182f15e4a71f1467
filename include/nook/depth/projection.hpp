#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>

namespace nook {

/// What a depth buffer stores. n and f are the near and far plane, z the distance along the view
/// axis; f may be infinite wherever the formula has a limit.
enum class DepthEncoding : std::uint8_t {
    linear,      ///< z itself (fixed-point storage: z / f)
    negative_z,  ///< −z, the view-space z of a right-handed camera
    standard,    ///< 0 at n, 1 at f: Direct3D, Vulkan, and OpenGL after its depth range
    reversed,    ///< 1 at n, 0 at f
    opengl,      ///< −1 at n, 1 at f: OpenGL's clip space (fixed-point storage: as `standard`)
    logarithmic  ///< log(1 + c z) / log(1 + c f), needs a finite f; c = Projection::logarithmic_scale
};

/// How pixels and view space belong together, and how the depth buffer encodes distance.
///
/// View axes: x right, y up, z towards the viewer, so visible points have z < 0; both hands of the
/// host's own coordinates lead here, since hardware depth does not show them. Pixel centres lie at
/// +0.5, row 0 is the top. Under perspective a point at distance d and view (x, y) falls on
/// (cx + fx x / d, cy − fy y / d); under orthography on (cx + fx x, cy − fy y).
struct Projection {
    /// Pixels per unit of slope (perspective) or per world unit (orthographic), > 0. Differ for
    /// non-square pixels.
    double fx = 0, fy = 0;
    /// The pixel on the view axis; off centre for jitter, tiles and stereo.
    double cx = 0, cy = 0;
    bool orthographic = false;
    DepthEncoding encoding = DepthEncoding::linear;
    /// Distance of the near plane; only `standard`, `reversed` and `opengl` use it: > 0 under
    /// perspective.
    double near_plane = 0;
    /// Distance of the far plane, > near_plane; infinity is allowed under perspective. Decoded
    /// distances beyond it, and a stored value at the far end of a hardware encoding, are background.
    double far_plane = std::numeric_limits<double>::infinity();
    /// c of the logarithmic encoding, per world unit, > 0.
    double logarithmic_scale = 1;
};

/// A point in view space.
struct ViewPoint {
    double x, y, z;
};

/// A position in the image, in pixels, and the distance along the view axis.
struct PixelPoint {
    double x, y, distance;
};

/// A length in pixels, across and down.
struct PixelLength {
    double x, y;
};

/// The conventions of a host's clip space.
struct ClipSpace {
    bool depth_from_minus_one = false;  ///< depth over [−1, 1] (OpenGL) instead of [0, 1]
    bool y_down = false;                ///< y points down (Vulkan)
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

namespace detail {

/// True for encodings whose stored value runs linearly, or as 1/z, between the two planes.
[[nodiscard]] constexpr bool is_planar(DepthEncoding encoding)
{
    return encoding == DepthEncoding::standard || encoding == DepthEncoding::reversed ||
           encoding == DepthEncoding::opengl;
}

}  // namespace detail

/// Checks the fields that pixel ↔ view conversions use, and with `hardware` those of the encoding.
[[nodiscard]] inline Error check_projection(const Projection& projection, bool hardware = false)
{
    const auto positive = [](double value) { return detail::is_finite(value) && value > 0; };
    if (!positive(projection.fx))
        return {ErrorCode::bad_value, "projection.fx", projection.fx, "pixels per unit, > 0"};
    if (!positive(projection.fy))
        return {ErrorCode::bad_value, "projection.fy", projection.fy, "pixels per unit, > 0"};
    if (!detail::is_finite(projection.cx))
        return {ErrorCode::bad_value, "projection.cx", projection.cx, "a finite number"};
    if (!detail::is_finite(projection.cy))
        return {ErrorCode::bad_value, "projection.cy", projection.cy, "a finite number"};
    if (!hardware) return {};
    const double near_plane = projection.near_plane, far_plane = projection.far_plane;
    // By bits: -ffast-math assumes that infinity does not occur.
    const bool endless = !detail::is_finite(far_plane) && far_plane > 0;
    if (detail::is_planar(projection.encoding)) {
        if (!detail::is_finite(near_plane) || (!projection.orthographic && near_plane <= 0))
            return {ErrorCode::bad_value, "projection.near_plane", near_plane,
                    "a finite distance, > 0 under perspective"};
        if (detail::is_nan(far_plane) || (!endless && far_plane <= near_plane) ||
            (projection.orthographic && endless))
            return {ErrorCode::bad_value, "projection.far_plane", far_plane,
                    "beyond the near plane; infinite only under perspective"};
    } else if (projection.encoding == DepthEncoding::logarithmic) {
        if (!positive(far_plane))
            return {ErrorCode::bad_value, "projection.far_plane", far_plane,
                    "a finite distance > 0 for the logarithmic encoding"};
        if (!positive(projection.logarithmic_scale))
            return {ErrorCode::bad_value, "projection.logarithmic_scale",
                    projection.logarithmic_scale, "a number > 0"};
    }
    return {};
}

/// The view-space point at a pixel position (centres at +0.5) and distance.
[[nodiscard]] constexpr ViewPoint view_point(const Projection& projection, double x, double y,
                                             double distance)
{
    const double scale = projection.orthographic ? 1 : distance;
    return {(x - projection.cx) / projection.fx * scale,
            (projection.cy - y) / projection.fy * scale, -distance};
}

/// Where a view-space point falls; it must lie in front of the viewer under perspective.
[[nodiscard]] constexpr PixelPoint pixel_point(const Projection& projection, const ViewPoint& point)
{
    const double scale = projection.orthographic ? 1 : -point.z;
    return {projection.cx + projection.fx * point.x / scale,
            projection.cy - projection.fy * point.y / scale, -point.z};
}

/// How many pixels a world length covers across and down at a distance, seen face on.
[[nodiscard]] constexpr PixelLength pixels_per_length(const Projection& projection, double length,
                                                      double distance)
{
    const double scale = projection.orthographic ? length : length / distance;
    return {projection.fx * scale, projection.fy * scale};
}

/// The projection behind a 4 × 4 matrix in column-major order (OpenGL, GLM, Vulkan; transpose a
/// row-major one of Direct3D). Either hand and reversed or infinite depth are recognised. The encoding
/// becomes `standard` or `reversed`, as the buffer holds it after OpenGL's depth range; set
/// `DepthEncoding::opengl` afterwards if yours holds clip-space depth. On an error `projection` is
/// unchanged.
[[nodiscard]] inline Error projection_from_matrix(const float* matrix, int width, int height,
                                                  const ClipSpace& clip, Projection& projection)
{
    if (matrix == nullptr) return {ErrorCode::null_data, "matrix", 0, "16 floats"};
    if (width < 1) return {ErrorCode::bad_size, "width", double(width), "a size >= 1"};
    if (height < 1) return {ErrorCode::bad_size, "height", double(height), "a size >= 1"};
    for (int i = 0; i < 16; ++i)
        if (!detail::is_finite(matrix[i]))
            return {ErrorCode::bad_value, "matrix", double(matrix[i]), "finite elements"};
    const auto m = [&](int row, int column) { return double{matrix[column * 4 + row]}; };

    Projection result{};
    const double hand = m(3, 2);  // −1: looks along −z, +1: along +z, 0: orthographic
    if (hand != 0 && hand != 1 && hand != -1)
        return {ErrorCode::bad_value, "matrix[row 3][column 2]", hand, "-1, 0 or 1"};
    result.orthographic = hand == 0;
    const double up = clip.y_down ? -1 : 1;
    result.fx = m(0, 0) * width / 2;
    result.fy = up * m(1, 1) * height / 2;
    const double shift_x = result.orthographic ? m(0, 3) : m(0, 2) * hand;
    const double shift_y = result.orthographic ? m(1, 3) : m(1, 2) * hand;
    result.cx = (1 + shift_x) * width / 2;
    result.cy = (1 - up * shift_y) * height / 2;

    // Depth in [0, 1] as a function of distance: a + b / z, under orthography a + b z.
    double a = result.orthographic ? m(2, 3) : m(2, 2) * hand;
    double b = result.orthographic ? std::fabs(m(2, 2)) : m(2, 3);
    if (clip.depth_from_minus_one) {
        a = (a + 1) / 2;
        b = b / 2;
    }
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (result.orthographic) {
        // At the viewer depth is ≤ 0 when it grows, ≥ 1 when it is reversed; the hand shows nowhere.
        const bool reversed = a > 0.5;
        result.encoding = reversed ? DepthEncoding::reversed : DepthEncoding::standard;
        result.near_plane = reversed ? (a - 1) / b : -a / b;
        result.far_plane = reversed ? a / b : (1 - a) / b;
    } else {
        const bool reversed = b > 0;
        result.encoding = reversed ? DepthEncoding::reversed : DepthEncoding::standard;
        // What is left of `a` beside 1 or 0 tells the far plane; its rounding tells nothing.
        const double rest = reversed ? -a : 1 - a;
        result.near_plane = reversed ? b / (1 - a) : -b / a;
        result.far_plane = std::fabs(rest) <= 0x1p-24 ? infinity : b / rest;
    }
    if (const Error error = check_projection(result, true)) return error;
    projection = result;
    return {};
}

}  // namespace nook::inline NOOK_TARGET
