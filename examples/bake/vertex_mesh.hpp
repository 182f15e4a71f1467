#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace bake {

/// An OBJ file as triangles over vertices that each have a normal.
struct VertexMesh {
    std::vector<float> positions, normals;  ///< x, y, z; a vertex without a normal has (0, 0, 0)
    std::vector<std::uint32_t> indices;
    std::size_t dropped = 0;  ///< triangles without area or with vertices that are not finite
    std::size_t derived = 0;  ///< vertices whose normal was not in the file

    [[nodiscard]] std::size_t vertices() const { return positions.size() / 3; }
};

/// Reads the file. The normal of a vertex is the mean of those that its corners name; where they name
/// none, that of the triangles around it, weighted by their areas. Throws support::Failure.
[[nodiscard]] VertexMesh read_vertex_mesh(const std::filesystem::path& path);

/// One line per vertex: x, y, z, visibility, after a line of names.
[[nodiscard]] std::string csv_of(const VertexMesh& mesh, const std::vector<float>& visibility);

/// A mesh in PLY (text) with the visibility as a vertex colour and as the property "quality".
[[nodiscard]] std::string ply_of(const VertexMesh& mesh, const std::vector<float>& visibility);

}  // namespace bake
