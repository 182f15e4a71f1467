#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include <glm/vec3.hpp>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/vector.hpp>

namespace nook {

/// A viewer: where it stands, where it looks and what it sees. Lengths in world units.
struct Camera {
    glm::dvec3 eye{0, 0, 1};
    /// A point on the view axis, other than the eye.
    glm::dvec3 target{0, 0, 0};
    /// Points up in the picture as far as it can. Along the view axis, or zero, it says nothing:
    /// then world −z points up when looking down, +z when looking up, and world y when looking along z.
    glm::dvec3 up{0, 1, 0};
    bool orthographic = false;
    /// Perspective: the angle from the top to the bottom of the picture in radians, in (0, π).
    double vertical_fov = std::numbers::pi / 4;
    /// Orthography: world units from the top to the bottom of the picture, > 0.
    double view_height = 2;
    /// Distances of the near and far plane along the view axis, as `Projection` takes them. The
    /// rasteriser leaves out what lies nearer or farther.
    double near_plane = 0;
    double far_plane = std::numeric_limits<double>::infinity();
    DepthEncoding encoding = DepthEncoding::linear;
    /// c of the logarithmic encoding, per world unit, > 0.
    double logarithmic_scale = 1;
};

/// View space in the world: an origin and three unit axes, x right, y up, z towards the viewer.
struct ViewFrame {
    glm::dvec3 origin{0, 0, 0};
    glm::dvec3 right{1, 0, 0};
    glm::dvec3 up{0, 1, 0};
    glm::dvec3 back{0, 0, 1};
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Checks what `projection` and `view_frame` use, the depth encoding included.
[[nodiscard]] Error check_camera(const Camera& camera);

/// Pixel ↔ view of a camera over a picture of width × height ≥ 1 square pixels, its axis in the
/// middle. Shift cx and cy for jitter and tiles; scale fx for other pixels.
[[nodiscard]] Projection projection(const Camera& camera, int width, int height);

/// The axes of a camera, computed in double.
[[nodiscard]] ViewFrame view_frame(const Camera& camera);

/// A world-space point or direction in view space, and back. The origin is subtracted first, so
/// that points near the viewer keep their accuracy far from the world's origin.
[[nodiscard]] glm::dvec3 point_to_view(const ViewFrame& frame, const glm::dvec3& point);
[[nodiscard]] glm::dvec3 point_to_world(const ViewFrame& frame, const glm::dvec3& point);
[[nodiscard]] glm::dvec3 direction_to_view(const ViewFrame& frame, const glm::dvec3& direction);
[[nodiscard]] glm::dvec3 direction_to_world(const ViewFrame& frame, const glm::dvec3& direction);

namespace detail {

/// A ViewFrame in the vectors of the inner loops.
struct Frame {
    Vector3 origin, right, up, back;

    explicit Frame(const ViewFrame& frame)
        : origin{vector(frame.origin)},
          right{vector(frame.right)},
          up{vector(frame.up)},
          back{vector(frame.back)}
    {}
    [[nodiscard]] Vector3 direction_to_view(const Vector3& v) const
    {
        return {dot(v, right), dot(v, up), dot(v, back)};
    }
    [[nodiscard]] Vector3 direction_to_world(const Vector3& v) const
    {
        return right * v.x + up * v.y + back * v.z;
    }
};

[[nodiscard]] inline bool is_finite(const glm::dvec3& v)
{
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

/// The axes of a frame are of a length that a kernel can work with.
[[nodiscard]] inline Error check_frame(const ViewFrame& frame)
{
    const auto check = [](const glm::dvec3& v, const char* name) -> Error {
        if (is_finite(v)) return {};
        const double value = !is_finite(v.x) ? v.x : !is_finite(v.y) ? v.y : v.z;
        return {ErrorCode::bad_value, name, value, "finite coordinates"};
    };
    if (const Error error = check(frame.origin, "frame.origin")) return error;
    const auto check_axis = [](const glm::dvec3& v, const char* name) -> Error {
        const double longest = largest(vector(v));
        if (is_finite(v) && longest <= 2) return {};
        return {ErrorCode::bad_value, name, longest, "an axis of unit length"};
    };
    if (const Error error = check_axis(frame.right, "frame.right")) return error;
    if (const Error error = check_axis(frame.up, "frame.up")) return error;
    return check_axis(frame.back, "frame.back");
}

}  // namespace detail

inline Error check_camera(const Camera& camera)
{
    const auto check_finite = [](const glm::dvec3& v, const char* name) -> Error {
        if (detail::is_finite(v)) return {};
        const double value = !detail::is_finite(v.x) ? v.x : !detail::is_finite(v.y) ? v.y : v.z;
        return {ErrorCode::bad_value, name, value, "finite coordinates"};
    };
    const auto positive = [](double value) { return detail::is_finite(value) && value > 0; };
    if (const Error error = check_finite(camera.eye, "camera.eye")) return error;
    if (const Error error = check_finite(camera.target, "camera.target")) return error;
    if (const Error error = check_finite(camera.up, "camera.up")) return error;
    if (camera.eye.x == camera.target.x && camera.eye.y == camera.target.y &&
        camera.eye.z == camera.target.z)
        return {ErrorCode::bad_value, "camera.target", camera.target.x,
                "a point other than the eye"};
    // A view so narrow that its pixels per unit overflow is refused with it.
    const bool pixels = !check_projection(projection(camera, 1, 1));
    if (camera.orthographic) {
        if (!positive(camera.view_height) || !pixels)
            return {ErrorCode::bad_value, "camera.view_height", camera.view_height,
                    "world units, > 0"};
    } else if (!positive(camera.vertical_fov) || camera.vertical_fov >= std::numbers::pi ||
               !pixels) {
        return {ErrorCode::bad_value, "camera.vertical_fov", camera.vertical_fov,
                "radians between 0 and pi"};
    }
    if (!detail::is_finite(camera.near_plane) || camera.near_plane < 0)
        return {ErrorCode::bad_value, "camera.near_plane", camera.near_plane, "a distance >= 0"};
    if (detail::is_nan(camera.far_plane) || camera.far_plane <= camera.near_plane)
        return {ErrorCode::bad_value, "camera.far_plane", camera.far_plane,
                "a distance beyond the near plane"};
    if (const Error error = check_projection(projection(camera, 1, 1), true)) {
        const bool far_plane = camera.near_plane > 0 || camera.orthographic ||
                               camera.encoding == DepthEncoding::logarithmic;
        if (camera.encoding == DepthEncoding::logarithmic && !positive(camera.logarithmic_scale))
            return {error.code, "camera.logarithmic_scale", error.value, error.allowed};
        return {error.code, far_plane ? "camera.far_plane" : "camera.near_plane", error.value,
                error.allowed};
    }
    return {};
}

inline Projection projection(const Camera& camera, int width, int height)
{
    Projection result{};
    result.fy = camera.orthographic ? height / camera.view_height
                                    : height / (2 * std::tan(camera.vertical_fov / 2));
    result.fx = result.fy;
    result.cx = width / 2.0;
    result.cy = height / 2.0;
    result.orthographic = camera.orthographic;
    result.encoding = camera.encoding;
    result.near_plane = camera.near_plane;
    result.far_plane = camera.far_plane;
    result.logarithmic_scale = camera.logarithmic_scale;
    return result;
}

inline ViewFrame view_frame(const Camera& camera)
{
    using detail::Vector3;
    Vector3 back = normalised(detail::vector(camera.eye) - detail::vector(camera.target));
    if (dot(back, back) == 0) back = {0, 0, 1};
    Vector3 right = cross(normalised(detail::vector(camera.up)), back);
    if (detail::largest(right) < 0x1p-30) {
        const Vector3 up =
            std::fabs(back.y) > 0.5 ? Vector3{0, 0, back.y > 0 ? -1.0 : 1.0} : Vector3{0, 1, 0};
        right = cross(up, back);
    }
    right = normalised(right);
    return {camera.eye, detail::glm_vector(right), detail::glm_vector(cross(back, right)),
            detail::glm_vector(back)};
}

inline glm::dvec3 direction_to_view(const ViewFrame& frame, const glm::dvec3& direction)
{
    return detail::glm_vector(detail::Frame{frame}.direction_to_view(detail::vector(direction)));
}
inline glm::dvec3 direction_to_world(const ViewFrame& frame, const glm::dvec3& direction)
{
    return detail::glm_vector(detail::Frame{frame}.direction_to_world(detail::vector(direction)));
}
inline glm::dvec3 point_to_view(const ViewFrame& frame, const glm::dvec3& point)
{
    const detail::Frame axes{frame};
    return detail::glm_vector(axes.direction_to_view(detail::vector(point) - axes.origin));
}
inline glm::dvec3 point_to_world(const ViewFrame& frame, const glm::dvec3& point)
{
    const detail::Frame axes{frame};
    return detail::glm_vector(axes.origin + axes.direction_to_world(detail::vector(point)));
}

}  // namespace nook::inline NOOK_TARGET
