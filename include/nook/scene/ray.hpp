#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <glm/vec3.hpp>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>

namespace nook {

/// A ray in world space: the points origin + t · direction for 0 < t <= t_max. Triangles stop it from
/// either side.
struct Ray {
    /// Farther from the scene than 2⁶⁰ times its size, or not finite: the ray hits nothing.
    glm::dvec3 origin{0, 0, 0};
    /// Of any length; with length 1, t is a distance. Zero, NaN or infinite: the ray hits nothing.
    glm::dvec3 direction{0, 0, 1};
    /// The end, included. Infinity is allowed; NaN, zero and negative: the ray hits nothing.
    double t_max = std::numeric_limits<double>::infinity();
    /// A face that the ray passes through.
    std::uint32_t exclude = no_face;
};

/// The nearest hit of a ray, or none; among hits at one t the lowest face. True for a hit.
struct Hit {
    std::uint32_t face = no_face;
    double t = std::numeric_limits<double>::infinity();

    NOOK_INLINE constexpr explicit operator bool() const { return face != no_face; }
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// What `Bvh::occluded` and `Bvh::closest` answer, by testing every triangle: the oracle, equal to
/// them bit for bit. Reads the whole mesh for each ray. The mesh must pass `check_mesh`.
[[nodiscard]] bool occluded_brute_force(const MeshView& mesh, const Ray& ray);
[[nodiscard]] Hit closest_brute_force(const MeshView& mesh, const Ray& ray);

namespace detail {

/// The coordinates that rays are traced in: an origin near the scene, and a power of two that brings
/// the scene to a size of about 1. Both steps are exact for the vertices, so a scene far from zero
/// keeps its shape, and one of any size behaves the same.
struct SceneSpace {
    Vector3 origin{0, 0, 0};
    double scale = 1;
    /// The largest distance of a vertex from the origin along an axis, in world units.
    double size = 0;

    [[nodiscard]] Vector3 to_scene(const Vector3& world) const { return (world - origin) * scale; }
};

/// Whether the product a b is less than (−1), equal to (0) or greater than (1) c d, without error.
[[nodiscard]] inline int product_order(double a, double b, double c, double d)
{
    // Rounding keeps the order, so only where both round alike is anything left to ask: what it took
    // from each.
    const double first = rounded(a * b), second = rounded(c * d);
    if (first < second) return -1;
    if (first > second) return 1;
    const double first_error = std::fma(a, b, -first), second_error = std::fma(c, d, -second);
    return first_error < second_error ? -1 : first_error > second_error ? 1 : 0;
}

/// A box in float.
struct Bounds {
    float low[3], high[3];

    [[nodiscard]] static constexpr Bounds nothing()
    {
        constexpr float most = (std::numeric_limits<float>::max)();
        return {{most, most, most}, {-most, -most, -most}};
    }
    void include(const Bounds& other)
    {
        for (int k = 0; k < 3; ++k) {
            low[k] = (std::min)(low[k], other.low[k]);
            high[k] = (std::max)(high[k], other.high[k]);
        }
    }
};

/// A triangle in scene space, and its index in the mesh.
struct SceneTriangle {
    float vertices[3][3];
    std::uint32_t face;

    [[nodiscard]] Vector3 corner(int i) const
    {
        const float* const v = vertices[i];
        return {double{v[0]}, double{v[1]}, double{v[2]}};
    }
    /// Perpendicular, of any length.
    [[nodiscard]] Vector3 normal() const
    {
        const Vector3 a = corner(0);
        return cross(corner(1) - a, corner(2) - a);
    }
    /// Padded by what the rounding of a ray test may add to the triangle.
    [[nodiscard]] Bounds bounds() const
    {
        Bounds result;
        float size = 0;
        for (int k = 0; k < 3; ++k) {
            result.low[k] = (std::min)({vertices[0][k], vertices[1][k], vertices[2][k]});
            result.high[k] = (std::max)({vertices[0][k], vertices[1][k], vertices[2][k]});
            size = (std::max)(size, result.high[k] - result.low[k]);
        }
        for (int k = 0; k < 3; ++k) {
            result.low[k] -= 0x1p-22f * size;
            result.high[k] += 0x1p-22f * size;
        }
        return result;
    }
};

/// The space of a mesh, from its usable triangles.
[[nodiscard]] inline SceneSpace scene_space(const MeshView& mesh)
{
    constexpr double most = (std::numeric_limits<double>::max)();
    double low[3] = {most, most, most}, high[3] = {-most, -most, -most};
    bool any = false;
    for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
        if (!is_usable_triangle(mesh, t)) continue;
        any = true;
        const Triangle triangle = mesh_triangle(mesh, t);
        for (const Vector3& v : {triangle.a, triangle.b, triangle.c}) {
            const double c[3] = {v.x, v.y, v.z};
            for (int k = 0; k < 3; ++k) {
                low[k] = (std::min)(low[k], c[k]);
                high[k] = (std::max)(high[k], c[k]);
            }
        }
    }
    SceneSpace space;
    if (!any) return space;
    double origin[3];
    for (int k = 0; k < 3; ++k) {
        // An axis on which the scene is far from 0 is shifted by a float of the scene's own
        // magnitude: the difference of two floats within a factor of two is exact (Sterbenz 1974).
        const double middle = (low[k] + high[k]) / 2;
        const bool distant = std::fabs(middle) > 2 * (high[k] - low[k]);
        origin[k] = distant ? double{static_cast<float>(middle)} : 0;
        space.size =
            (std::max)({space.size, std::fabs(low[k] - origin[k]), std::fabs(high[k] - origin[k])});
    }
    space.origin = {origin[0], origin[1], origin[2]};
    int exponent = 0;
    std::frexp(space.size, &exponent);
    space.scale = std::ldexp(1.0, -exponent);
    return space;
}

[[nodiscard]] inline SceneTriangle scene_triangle(const MeshView& mesh, const SceneSpace& space,
                                                  std::size_t t)
{
    const Triangle triangle = mesh_triangle(mesh, t);
    SceneTriangle result{};
    const Vector3 vertices[3] = {triangle.a, triangle.b, triangle.c};
    for (int i = 0; i < 3; ++i) {
        const Vector3 v = space.to_scene(vertices[i]);
        result.vertices[i][0] = static_cast<float>(v.x);
        result.vertices[i][1] = static_cast<float>(v.y);
        result.vertices[i][2] = static_cast<float>(v.z);
    }
    result.face = static_cast<std::uint32_t>(t);
    return result;
}

/// A length of the world in scene space. Beyond the far side of the scene there is nothing, so an
/// infinite one becomes a finite one: -ffast-math may do anything with the product of an infinity.
[[nodiscard]] inline double scene_length(double length, double scale)
{
    constexpr double farthest = 0x1p64;
    return is_finite(length) ? (std::min)(length * scale, farthest) : farthest;
}

/// A ray in scene space with what the triangle test needs: the axis along which it is longest, and
/// the shear that lays it along that axis (Woop, Benthin & Wald 2013, section 3; they round to float,
/// we keep double).
class SceneRay {
public:
    static constexpr double farthest_origin = 0x1p60;

    SceneRay(const SceneSpace& space, const Ray& ray)
    {
        const Vector3 from = vector(ray.origin);
        Vector3 along = vector(ray.direction);
        if (!is_finite(from) || !is_finite(along) || is_nan(ray.t_max) || !(ray.t_max > 0)) return;
        const double length = largest(along);
        if (!(length > 0)) return;
        // Powers of two only, so that a scaled scene gives the same bits.
        double units_per_t = space.scale;
        if (length < 0.25 || length > 4) {
            int exponent = 0;
            std::frexp(length, &exponent);
            along = {std::ldexp(along.x, -exponent), std::ldexp(along.y, -exponent),
                     std::ldexp(along.z, -exponent)};
            units_per_t = std::ldexp(units_per_t, exponent);
        }
        *this = SceneRay{space.to_scene(from), along, scene_length(ray.t_max, units_per_t)};
        units_per_t_ = units_per_t;
        exclude_ = ray.exclude;
    }
    /// From a finite point and a finite direction of length about 1 in scene space, to a finite end.
    SceneRay(const Vector3& start, const Vector3& along, double end)
        : origin{start.x, start.y, start.z},
          direction{along.x, along.y, along.z},
          t_max{end}
    {
        axis_z_ = std::fabs(along.x) > std::fabs(along.y) ? 0 : 1;
        if (std::fabs(along.z) > std::fabs(direction[axis_z_])) axis_z_ = 2;
        axis_x_ = axis_z_ == 2 ? 0 : axis_z_ + 1;
        axis_y_ = axis_x_ == 2 ? 0 : axis_x_ + 1;
        inverse_z_ = 1 / direction[axis_z_];
        shear_x_ = direction[axis_x_] * inverse_z_;
        shear_y_ = direction[axis_y_] * inverse_z_;
        valid_ = largest(start) < farthest_origin;
    }

    /// Whether the ray can hit anything at all.
    [[nodiscard]] bool valid() const { return valid_; }
    [[nodiscard]] bool excludes() const { return exclude_ != no_face; }
    /// A t of this ray as a t of the world's.
    [[nodiscard]] double world_t(double t) const { return t / units_per_t_; }

    /// Whether the ray meets the triangle, and where: t > 0, not compared with t_max.
    ///
    /// Containment is watertight: a vertex has one pair of sheared coordinates whatever triangle it is
    /// met in, and the edge functions of these pairs have their exact signs, so that they decide as
    /// geometry does. A zero counts as inside. The parameter comes from the plane, kept within the
    /// triangle's range. Every product is rounded before it is used: the same bits with FMA.
    [[nodiscard]] bool meets(const SceneTriangle& triangle, double& t) const
    {
        if (triangle.face == exclude_) return false;
        double x[3], y[3], z[3];
        for (int i = 0; i < 3; ++i) {
            const float* const v = triangle.vertices[i];
            z[i] = double{v[axis_z_]} - origin[axis_z_];
            x[i] = double{v[axis_x_]} - origin[axis_x_] - rounded(shear_x_ * z[i]);
            y[i] = double{v[axis_y_]} - origin[axis_y_] - rounded(shear_y_ * z[i]);
        }
        const int u = product_order(x[2], y[1], y[2], x[1]);
        const int v = product_order(x[0], y[2], y[0], x[2]);
        const int w = product_order(x[1], y[0], y[1], x[0]);
        const bool left = u < 0 || v < 0 || w<0, right = u> 0 || v > 0 || w > 0;
        if (left == right) return false;  // outside, or edge on
        const Vector3 a = triangle.corner(0), normal = triangle.normal();
        const double slope = dot(normal, {direction[0], direction[1], direction[2]});
        if (slope == 0) return false;
        t = dot(normal, a - Vector3{origin[0], origin[1], origin[2]}) / slope;
        const double t0 = z[0] * inverse_z_, t1 = z[1] * inverse_z_, t2 = z[2] * inverse_z_;
        t = (std::min)((std::max)(t, (std::min)({t0, t1, t2})), (std::max)({t0, t1, t2}));
        const Vector3 along{direction[0], direction[1], direction[2]};
        if (slope * slope < 0x1p-40 * dot(normal, normal) * dot(along, along))
            keep_within_box(triangle, t);
        return t > 0;
    }
    [[nodiscard]] bool is_occluded_by(const SceneTriangle& triangle) const
    {
        double t = 0;
        return meets(triangle, t) && t <= t_max;
    }
    /// Takes the triangle as the nearest hit if it is; `hit.t` is in scene space.
    void keep_nearest(const SceneTriangle& triangle, Hit& hit) const
    {
        double t = 0;
        if (!meets(triangle, t) || !(t <= t_max)) return;
        if (hit.face == no_face || t < hit.t || (t == hit.t && triangle.face < hit.face))
            hit = {triangle.face, t};
    }

    double origin[3] = {}, direction[3] = {};
    double t_max = 0;

private:
    /// A ray nearly in the triangle's plane: its t has lost its digits, and must not lie before the box
    /// of the triangle, where nobody would look for it.
    void keep_within_box(const SceneTriangle& triangle, double& t) const
    {
        for (int k = 0; k < 3; ++k) {
            if (k == axis_z_ || !(std::fabs(direction[k]) > 0x1p-60)) continue;
            double sides[3];
            for (int i = 0; i < 3; ++i)
                sides[i] = (double{triangle.vertices[i][k]} - origin[k]) / direction[k];
            t = (std::max)(t, (std::min)({sides[0], sides[1], sides[2]}));
        }
    }

    double shear_x_ = 0, shear_y_ = 0, inverse_z_ = 0, units_per_t_ = 1;
    std::uint32_t exclude_ = no_face;
    int axis_x_ = 0, axis_y_ = 1, axis_z_ = 2;
    bool valid_ = false;
};

}  // namespace detail

inline bool occluded_brute_force(const MeshView& mesh, const Ray& ray)
{
    const detail::SceneSpace space = detail::scene_space(mesh);
    const detail::SceneRay local{space, ray};
    if (!local.valid()) return false;
    for (std::size_t t = 0; t < mesh.triangle_count; ++t)
        if (is_usable_triangle(mesh, t) &&
            local.is_occluded_by(detail::scene_triangle(mesh, space, t)))
            return true;
    return false;
}

inline Hit closest_brute_force(const MeshView& mesh, const Ray& ray)
{
    const detail::SceneSpace space = detail::scene_space(mesh);
    const detail::SceneRay local{space, ray};
    Hit hit{};
    if (!local.valid()) return hit;
    for (std::size_t t = 0; t < mesh.triangle_count; ++t)
        if (is_usable_triangle(mesh, t))
            local.keep_nearest(detail::scene_triangle(mesh, space, t), hit);
    if (hit) hit.t = local.world_t(hit.t);
    return hit;
}

}  // namespace nook::inline NOOK_TARGET
