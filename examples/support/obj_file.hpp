#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace support {

/// The triangles of an OBJ file; polygons are cut into triangles.
struct ObjMesh {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    /// Triangles left out: a vertex that is NaN or infinite, or no area.
    std::size_t dropped = 0;
};

/// Reads an OBJ file. Throws Failure, with the name and the line, for a file that is missing, empty,
/// cut short within a statement, not an OBJ file, has indices out of range, or leaves no triangle.
/// Materials, normals and texture coordinates are ignored.
[[nodiscard]] ObjMesh read_obj(const std::filesystem::path& path);

/// The same from text; `name` stands in messages.
[[nodiscard]] ObjMesh parse_obj(std::string text, std::string_view name);

}  // namespace support
