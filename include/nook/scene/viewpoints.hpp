#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include <glm/vec3.hpp>

#include <nook/checks.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>

/// Viewpoints around an object, looking at its centre (González, Sbert & Feixas 2008, section 4).
namespace nook {

struct BoundingSphere {
    glm::dvec3 centre{0, 0, 0};
    double radius = 0;
};

struct ViewpointOptions {
    /// Of the eye from the centre, in radii of the sphere, > 1. Infinity: orthographic, so that visible
    /// areas are projected areas, as the channel defines them; finite: perspective.
    double distance = std::numeric_limits<double>::infinity();
};

/// 40 962 directions.
inline constexpr int finest_icosphere = 6;

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// A sphere about the middle of the box around the usable triangles, rounded up; radius 0 when there
/// are none. The mesh must pass `check_mesh`.
[[nodiscard]] BoundingSphere bounding_sphere(const MeshView& mesh);

/// 12, 42, 162, 642, 2562, …: vertices of an icosahedron whose edges have been halved `level` times.
[[nodiscard]] constexpr std::size_t icosphere_size(int level)
{
    return 10 * (std::size_t{1} << 2 * level) + 2;
}

/// Writes icosphere_size(level) unit vectors, 0 ≤ level ≤ finest_icosphere: those of coarser levels
/// first, then the middles of their edges, moved to the sphere. The icosahedron has the vertices
/// (±1, ±φ, 0), (0, ±1, ±φ), (±φ, 0, ±1). The set is its own mirror image in each coordinate plane.
void icosphere(int level, glm::dvec3* directions);

/// A camera in a direction (not zero) from the centre, whose square picture just holds the sphere. A
/// sphere of radius 0 counts as one of radius 1.
[[nodiscard]] Camera viewpoint_camera(const BoundingSphere& sphere, const glm::dvec3& direction,
                                      const ViewpointOptions& options = {});

namespace detail {

/// A face of the icosahedron as a triangular grid: the corners lie at (0, 0), (2^level, 0), (0, 2^level).
struct IcosphereFace {
    Vector3 corner[3];

    /// The vertex at (i, j): on a coarser level, or the middle of the two that it lies between.
    [[nodiscard]] Vector3 vertex(int level, int i, int j) const
    {
        while (level > 0 && ((i | j) & 1) == 0) {
            --level;
            i /= 2;
            j /= 2;
        }
        if (level == 0) return i == 1 ? corner[1] : j == 1 ? corner[2] : corner[0];
        // Along the side that the vertex halves.
        const int di = i & 1, dj = di != 0 && (j & 1) != 0 ? -1 : j & 1;
        return normalised(vertex(level, i + di, j + dj) + vertex(level, i - di, j - dj));
    }
};

/// The index of corners and the corners of the faces of the icosahedron, anticlockwise from outside.
struct Icosahedron {
    static constexpr int corners = 12, faces = 20;

    [[nodiscard]] static Vector3 corner(int i)
    {
        // Three golden rectangles.
        const double one = (i & 1) != 0 ? 1 : -1;
        const double phi = (i & 2) != 0 ? std::numbers::phi : -std::numbers::phi;
        const Vector3 v = i < 4   ? Vector3{one, phi, 0}
                          : i < 8 ? Vector3{0, one, phi}
                                  : Vector3{phi, 0, one};
        return normalised(v);
    }
    static constexpr std::uint8_t face[faces][3] = {
        {0, 4, 1},   {0, 1, 6},   {0, 8, 4}, {0, 6, 9},  {0, 9, 8}, {1, 4, 10}, {1, 11, 6},
        {1, 10, 11}, {2, 3, 5},   {2, 7, 3}, {2, 5, 8},  {2, 9, 7}, {2, 8, 9},  {3, 10, 5},
        {3, 7, 11},  {3, 11, 10}, {4, 8, 5}, {4, 5, 10}, {6, 7, 9}, {6, 11, 7}};
};

}  // namespace detail

inline BoundingSphere bounding_sphere(const MeshView& mesh)
{
    using detail::Vector3;
    constexpr double endless = (std::numeric_limits<double>::max)();
    Vector3 low{endless, endless, endless}, high = -low;
    const auto for_each_corner = [&](const auto& f) {
        for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
            if (!is_usable_triangle(mesh, t)) continue;
            const auto [a, b, c] = detail::mesh_triangle(mesh, t);
            f(a);
            f(b);
            f(c);
        }
    };
    for_each_corner([&](const Vector3& p) {
        low = {detail::smaller(low.x, p.x), detail::smaller(low.y, p.y),
               detail::smaller(low.z, p.z)};
        high = {detail::larger(high.x, p.x), detail::larger(high.y, p.y),
                detail::larger(high.z, p.z)};
    });
    if (!(low.x <= high.x)) return {};
    const Vector3 centre = (low + high) * 0.5;
    double square = 0;
    for_each_corner([&](const Vector3& p) {
        const Vector3 from = p - centre;
        square = detail::larger(square, dot(from, from));
    });
    return {detail::glm_vector(centre), std::sqrt(square) * (1 + 0x1p-40)};
}

inline void icosphere(int level, glm::dvec3* directions)
{
    using Base = detail::Icosahedron;
    for (int i = 0; i < Base::corners; ++i) *directions++ = detail::glm_vector(Base::corner(i));
    for (int l = 1; l <= level; ++l) {
        const int size = 1 << l;
        for (const auto& [a, b, c] : Base::face) {
            const detail::IcosphereFace face{{Base::corner(a), Base::corner(b), Base::corner(c)}};
            for (int j = 0; j <= size; ++j)
                for (int i = 0; i <= size - j; ++i) {
                    // New ones; on a side, from one of its two faces.
                    if (((i | j) & 1) == 0 || (j == 0 && a > b) || (i == 0 && c > a) ||
                        (i + j == size && b > c))
                        continue;
                    *directions++ = detail::glm_vector(face.vertex(l, i, j));
                }
        }
    }
}

inline Camera viewpoint_camera(const BoundingSphere& sphere, const glm::dvec3& direction,
                               const ViewpointOptions& options)
{
    const double radius = sphere.radius > 0 ? sphere.radius : 1;
    const bool orthographic = !detail::is_finite(options.distance);
    const double distance = orthographic ? 2 : options.distance;
    const detail::Vector3 towards = normalised(detail::vector(direction)) * (radius * distance);
    Camera camera{};
    camera.eye = detail::glm_vector(detail::vector(sphere.centre) + towards);
    camera.target = sphere.centre;
    camera.orthographic = orthographic;
    camera.view_height = 2 * radius;
    if (!orthographic) camera.vertical_fov = 2 * std::asin(1 / distance);
    return camera;
}

}  // namespace nook::inline NOOK_TARGET
