#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/vector.hpp>

namespace nook {

/// A view of somebody else's triangles: nothing is owned, copied or changed.
///
/// Triangle t has the vertices indices[3 t], indices[3 t + 1], indices[3 t + 2], in either winding.
/// Vertex i lies at positions[i * position_stride + 0, 1, 2], in world space; the floats need no
/// alignment beyond their own. Triangles with a coordinate that is not finite, or without area, are
/// left out by everything that takes a mesh.
struct MeshView {
    const float* positions = nullptr;
    std::size_t vertex_count = 0;
    const std::uint32_t* indices = nullptr;
    /// At most 2³² − 2.
    std::size_t triangle_count = 0;
    /// Floats from one vertex to the next: 3 is tight.
    std::ptrdiff_t position_stride = 3;
    /// One normal per vertex in world space, of any length, or null.
    const float* normals = nullptr;
    /// Floats from one normal to the next.
    std::ptrdiff_t normal_stride = 3;
};

/// The face id that stands for "no triangle".
inline constexpr std::uint32_t no_face = 0xffffffff;

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Checks pointers, counts and every index: O(triangles). An index that names no vertex is
/// `index_out_of_range` on "mesh.indices" with the index as its value.
[[nodiscard]] Error check_mesh(const MeshView& mesh);

/// True for a triangle with finite vertices and an area: one whose two edges from the first vertex
/// span an angle that double precision tells from zero. The mesh must pass `check_mesh`.
[[nodiscard]] bool is_usable_triangle(const MeshView& mesh, std::size_t triangle);

namespace detail {

struct Triangle {
    Vector3 a, b, c;
};

[[nodiscard]] inline Vector3 mesh_vector(const float* data, std::ptrdiff_t stride,
                                         std::uint32_t index)
{
    const float* at = data + static_cast<std::ptrdiff_t>(index) * stride;
    return {double{at[0]}, double{at[1]}, double{at[2]}};
}
[[nodiscard]] inline Vector3 mesh_position(const MeshView& mesh, std::uint32_t index)
{
    return mesh_vector(mesh.positions, mesh.position_stride, index);
}
[[nodiscard]] inline Triangle mesh_triangle(const MeshView& mesh, std::size_t triangle)
{
    const std::uint32_t* index = mesh.indices + 3 * triangle;
    return {mesh_position(mesh, index[0]), mesh_position(mesh, index[1]),
            mesh_position(mesh, index[2])};
}
[[nodiscard]] inline bool is_finite(const Vector3& v)
{
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

}  // namespace detail

inline Error check_mesh(const MeshView& mesh)
{
    if (mesh.triangle_count == 0) return {};
    if (mesh.triangle_count >= no_face)
        return {ErrorCode::bad_size, "mesh.triangle_count", double(mesh.triangle_count),
                "at most 2^32 - 2 triangles"};
    if (mesh.indices == nullptr)
        return {ErrorCode::null_data, "mesh.indices", 0, "three indices per triangle"};
    if (mesh.positions == nullptr && mesh.vertex_count > 0)
        return {ErrorCode::null_data, "mesh.positions", 0, "three floats per vertex"};
    for (std::size_t i = 0; i < 3 * mesh.triangle_count; ++i)
        if (mesh.indices[i] >= mesh.vertex_count)
            return {ErrorCode::index_out_of_range, "mesh.indices", double(mesh.indices[i]),
                    "indices below mesh.vertex_count"};
    return {};
}

inline bool is_usable_triangle(const MeshView& mesh, std::size_t triangle)
{
    const auto [a, b, c] = detail::mesh_triangle(mesh, triangle);
    if (!detail::is_finite(a) || !detail::is_finite(b) || !detail::is_finite(c)) return false;
    const detail::Vector3 ab = b - a, ac = c - a, area = cross(ab, ac);
    // Rounding leaves something where the two products of a component should cancel.
    return dot(area, area) > 0x1p-100 * dot(ab, ab) * dot(ac, ac);
}

}  // namespace nook::inline NOOK_TARGET
