#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <glm/vec3.hpp>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/ray.hpp>
#include <nook/scene/vector.hpp>

/// All triangles that reach into a ball.
namespace nook::inline NOOK_TARGET {

/// What `Bvh::in_sphere` visits, by measuring every triangle: the oracle, with faces in increasing
/// order. The mesh must pass `check_mesh`. Returns false when visit ended it.
template <class Visit>
bool in_sphere_brute_force(const MeshView& mesh, const glm::dvec3& centre, double radius,
                           Visit&& visit);

namespace detail {

/// A ball in scene space.
class SceneSphere {
public:
    /// From world space. Holds nothing where the centre is not finite or farther from the scene than
    /// 2⁶⁰ times its size, or the radius is negative or NaN.
    SceneSphere(const SceneSpace& space, const glm::dvec3& centre, double radius)
    {
        if (!is_finite(vector(centre)) || is_nan(radius) || !(radius >= 0)) return;
        centre_ = space.to_scene(vector(centre));
        if (!(largest(centre_) < SceneRay::farthest_origin)) return;
        const double length = scene_length(radius, space.scale);
        square_ = length * length;
    }

    /// Whether the triangle is at most the radius away, the boundary included.
    [[nodiscard]] bool reaches(const SceneTriangle& triangle) const
    {
        return square_ >= 0 && squared_distance(triangle) <= square_;
    }
    /// False only where nothing in the padded box is at most the radius away.
    [[nodiscard]] bool may_reach(const Bounds& box) const
    {
        const double point[3] = {centre_.x, centre_.y, centre_.z};
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            const double below = double{box.low[k]} - point[k],
                         above = point[k] - double{box.high[k]};
            const double outside = below > above ? below : above;
            if (outside > 0) sum += outside * outside;
        }
        return sum <= square_ * (1 + 0x1p-40);
    }

    /// The least of the distances to the edges and, over the inside, to the plane's nearest point. That
    /// point is taken as a mean of the corners, so that a poor normal, as slivers have, cannot
    /// bring it nearer than the triangle is. The same bits with FMA.
    [[nodiscard]] double squared_distance(const SceneTriangle& triangle) const
    {
        const Vector3 a = triangle.corner(0) - centre_, b = triangle.corner(1) - centre_,
                      c = triangle.corner(2) - centre_;
        double least = smaller(to_edge(a, b), smaller(to_edge(b, c), to_edge(c, a)));
        const Vector3 normal = triangle.normal();
        const double u = dot(normal, cross(b, c)), v = dot(normal, cross(c, a)),
                     w = dot(normal, cross(a, b));
        if (u >= 0 && v >= 0 && w >= 0 && u + v + w > 0) {
            const Vector3 mean = rounded_scale(a, u) + rounded_scale(b, v) + rounded_scale(c, w);
            const Vector3 nearest = mean * (1 / (u + v + w));
            least = smaller(least, dot(nearest, nearest));
        }
        return least;
    }

private:
    [[nodiscard]] static Vector3 rounded_scale(const Vector3& a, double s)
    {
        return {rounded(a.x * s), rounded(a.y * s), rounded(a.z * s)};
    }
    /// From the origin.
    [[nodiscard]] static double to_edge(const Vector3& a, const Vector3& b)
    {
        const Vector3 along = b - a;
        const double length = dot(along, along), at = -dot(a, along);
        const double t = at > 0 ? at < length ? at / length : 1 : 0;
        const Vector3 nearest = a + rounded_scale(along, t);
        return dot(nearest, nearest);
    }

    Vector3 centre_{0, 0, 0};
    double square_ = -1;
};

/// A triangle that a refit has shrunk, since it is not usable any more.
[[nodiscard]] inline bool is_point(const SceneTriangle& triangle)
{
    const auto& v = triangle.vertices;
    for (int k = 0; k < 3; ++k)
        if (v[0][k] != v[1][k] || v[0][k] != v[2][k]) return false;
    return true;
}

/// Calls visit(face), which may return false to end everything, or nothing.
template <class Visit>
[[nodiscard]] bool goes_on(Visit& visit, std::uint32_t face)
{
    if constexpr (std::is_void_v<decltype(visit(face))>) {
        visit(face);
        return true;
    } else {
        return static_cast<bool>(visit(face));
    }
}

template <class Visit>
bool visit_in_sphere(const BvhView& bvh, const SceneSphere& sphere, Visit& visit)
{
    if (bvh.empty()) return true;
    std::uint32_t stack[BvhView::most_waiting];
    int waiting = 0;
    stack[waiting++] = bvh.root;
    while (waiting > 0) {
        const std::uint32_t next = stack[--waiting];
        if ((next & BvhNode::block_bit) == 0) {
            const BvhNode& node = bvh.nodes[next];
            for (int lane = BvhNode::lanes - 1; lane >= 0; --lane)
                if (node.child[lane] != no_face && sphere.may_reach(node.box(lane)))
                    stack[waiting++] = node.child[lane];
            continue;
        }
        const TriangleBlock& block = bvh.blocks[next & ~BvhNode::block_bit];
        for (int lane = 0; lane < TriangleBlock::lanes; ++lane) {
            // From here on the last triangle is repeated.
            if (lane > 0 && block.faces[lane] == block.faces[lane - 1]) break;
            const SceneTriangle triangle = block.triangle(lane);
            if (!is_point(triangle) && sphere.reaches(triangle) && !goes_on(visit, triangle.face))
                return false;
        }
    }
    return true;
}

}  // namespace detail

template <class Visit>
bool in_sphere_brute_force(const MeshView& mesh, const glm::dvec3& centre, double radius,
                           Visit&& visit)
{
    const detail::SceneSpace space = detail::scene_space(mesh);
    const detail::SceneSphere sphere{space, centre, radius};
    for (std::size_t t = 0; t < mesh.triangle_count; ++t)
        if (is_usable_triangle(mesh, t) && sphere.reaches(detail::scene_triangle(mesh, space, t)) &&
            !detail::goes_on(visit, static_cast<std::uint32_t>(t)))
            return false;
    return true;
}

}  // namespace nook::inline NOOK_TARGET
