#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "../../examples/bake/vertex_mesh.hpp"
#include "../../examples/support/files.hpp"

namespace {

bake::VertexMesh read(const std::string& text)
{
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / "nook-test-bake.obj";
    support::write_file(path, text);
    bake::VertexMesh mesh = bake::read_vertex_mesh(path);
    std::filesystem::remove(path);
    return mesh;
}

void check_normal(const bake::VertexMesh& mesh, std::size_t vertex, double x, double y, double z)
{
    CAPTURE(vertex);
    CHECK(double{mesh.normals[3 * vertex]} == doctest::Approx(x));
    CHECK(double{mesh.normals[3 * vertex + 1]} == doctest::Approx(y));
    CHECK(double{mesh.normals[3 * vertex + 2]} == doctest::Approx(z));
}

}  // namespace

TEST_CASE("vertex normals are those of the file, and of the triangles where it has none")
{
    // Two triangles at a right angle along the edge 1-2: one of area 1/2 facing +z, one of area 1
    // facing +y. Vertex 4 is named with a normal of length 2, vertex 5 with two opposite ones.
    const bake::VertexMesh mesh = read(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 -2\nv 5 0 0\nv 5 1 0\nv 6 0 0\nv 9 9 9\n"
        "vn 0 -2 0\nvn 0 1 0\nvn 0 -1 0\n"
        "f 1 2 3\nf 1 2 4//1\nf 5//2 7 6\nf 5//3 7 6\n");
    REQUIRE(mesh.vertices() == 8);
    CHECK(mesh.indices.size() == 12);
    const double z = 1 / std::sqrt(5.0);
    check_normal(mesh, 0, 0, 2 * z, z);
    check_normal(mesh, 1, 0, 2 * z, z);
    check_normal(mesh, 2, 0, 0, 1);
    check_normal(mesh, 3, 0, -1, 0);
    check_normal(mesh, 4, 0, 0, 1);
    // No triangle uses the last: no normal.
    check_normal(mesh, 7, 0, 0, 0);
    CHECK(mesh.derived == 6);
}

TEST_CASE("baked values are written per vertex, and none is NaN")
{
    const bake::VertexMesh mesh =
        read("v 0 0 0\nv 1 0 0\nv 0 0.5 0\nv nan 1 1\nf 1 2 3\nf 1 2 4\n");
    CHECK(mesh.dropped == 1);
    const std::vector<float> visibility{1, 0.25f, 0, 1};
    CHECK(bake::csv_of(mesh, visibility) ==
          "x,y,z,visibility\n0,0,0,1\n1,0,0,0.25\n0,0.5,0,0\n0,1,1,1\n");
    const std::string ply = bake::ply_of(mesh, visibility);
    CHECK(ply.starts_with("ply\nformat ascii 1.0\n"));
    CHECK(
        ply.ends_with("end_header\n0 0 0 255 255 255 1\n1 0 0 64 64 64 0.25\n0 0.5 0 0 0 0 0\n"
                      "0 1 1 255 255 255 1\n3 0 1 2\n"));
    CHECK(ply.find("element vertex 4\n") != std::string::npos);
    CHECK(ply.find("element face 1\n") != std::string::npos);
}
