#include "vertex_mesh.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <tiny_obj_loader.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/obj_file.hpp"
#include "../support/picture.hpp"

namespace bake {

namespace {

glm::dvec3 point(const std::vector<float>& values, std::size_t index)
{
    const float* const at = values.data() + 3 * index;
    return {at[0], at[1], at[2]};
}

/// The sums of the unit normals that the corners of faces name, one per vertex.
std::vector<glm::dvec3> normals_of_file(const std::string& text, std::size_t vertices)
{
    std::vector<glm::dvec3> sums(vertices, glm::dvec3{0});
    tinyobj::ObjReaderConfig config;
    config.vertex_color = false;
    tinyobj::ObjReader reader;
    if (!reader.ParseFromString(text, {}, config)) return sums;
    const std::vector<float>& normals = reader.GetAttrib().normals;
    for (const tinyobj::shape_t& shape : reader.GetShapes())
        for (const tinyobj::index_t& index : shape.mesh.indices) {
            const auto vertex = static_cast<std::size_t>(index.vertex_index);
            const auto normal = static_cast<std::size_t>(index.normal_index);
            if (index.normal_index < 0 || 3 * normal + 2 >= normals.size() || vertex >= vertices)
                continue;
            const glm::dvec3 at = point(normals, normal);
            const double length = glm::length(at);
            if (length > 0 && std::isfinite(length)) sums[vertex] += at / length;
        }
    return sums;
}

/// The sums of the normals of the triangles around each vertex, weighted by their areas.
std::vector<glm::dvec3> normals_of_triangles(const VertexMesh& mesh)
{
    std::vector<glm::dvec3> sums(mesh.vertices(), glm::dvec3{0});
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const std::uint32_t* const corner = mesh.indices.data() + i;
        const glm::dvec3 a = point(mesh.positions, corner[0]);
        const glm::dvec3 area =
            glm::cross(point(mesh.positions, corner[1]) - a, point(mesh.positions, corner[2]) - a);
        for (int k = 0; k < 3; ++k) sums[corner[k]] += area;
    }
    return sums;
}

void append(std::string& text, float value)
{
    std::array<char, 32> digits{};
    text.append(digits.data(),
                std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

void append_position(std::string& text, const VertexMesh& mesh, std::size_t vertex, char between)
{
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float at = mesh.positions[3 * vertex + axis];
        // Readers stumble over the NaN of a vertex that no triangle uses.
        append(text, std::isfinite(at) ? at : 0);
        text += between;
    }
}

}  // namespace

VertexMesh read_vertex_mesh(const std::filesystem::path& path)
{
    const std::string text = support::read_file(path);
    support::ObjMesh read = support::parse_obj(text, path.string());
    VertexMesh mesh;
    mesh.positions = std::move(read.positions);
    mesh.indices = std::move(read.indices);
    mesh.dropped = read.dropped;

    const std::vector<glm::dvec3> named = normals_of_file(text, mesh.vertices());
    const std::vector<glm::dvec3> derived = normals_of_triangles(mesh);
    mesh.normals.resize(mesh.positions.size());
    for (std::size_t i = 0; i < mesh.vertices(); ++i) {
        // Opposite normals cancel but for rounding.
        const bool in_file = glm::length(named[i]) > 1e-3;
        const glm::dvec3 sum = in_file ? named[i] : derived[i];
        const double length = glm::length(sum);
        if (!(length > 0) || !std::isfinite(length)) continue;
        if (!in_file) ++mesh.derived;
        for (int axis = 0; axis < 3; ++axis)
            mesh.normals[3 * i + static_cast<std::size_t>(axis)] =
                static_cast<float>(sum[axis] / length);
    }
    return mesh;
}

std::string csv_of(const VertexMesh& mesh, const std::vector<float>& visibility)
{
    std::string text = "x,y,z,visibility\n";
    for (std::size_t i = 0; i < mesh.vertices(); ++i) {
        append_position(text, mesh, i, ',');
        append(text, visibility[i]);
        text += '\n';
    }
    return text;
}

std::string ply_of(const VertexMesh& mesh, const std::vector<float>& visibility)
{
    std::string text = "ply\nformat ascii 1.0\ncomment ambient occlusion by nook\nelement vertex " +
                       std::to_string(mesh.vertices()) + '\n';
    for (const char* name : {"x", "y", "z"}) text += std::string{"property float "} + name + '\n';
    for (const char* name : {"red", "green", "blue"})
        text += std::string{"property uchar "} + name + '\n';
    text += "property float quality\nelement face " + std::to_string(mesh.indices.size() / 3) +
            "\nproperty list uchar int vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < mesh.vertices(); ++i) {
        append_position(text, mesh, i, ' ');
        const std::string grey = std::to_string(std::lround(visibility[i] * 255)) + ' ';
        text += grey + grey + grey;
        append(text, visibility[i]);
        text += '\n';
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        text += '3';
        for (std::size_t k = i; k < i + 3; ++k) text += ' ' + std::to_string(mesh.indices[k]);
        text += '\n';
    }
    return text;
}

}  // namespace bake
