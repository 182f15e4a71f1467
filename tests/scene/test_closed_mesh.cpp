#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <nook/scene/closed_mesh.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::ErrorCode;

nook::MeshClosure closure(const Mesh& mesh)
{
    nook::MeshClosure result{};
    REQUIRE(nook::closed_mesh(mesh.view(), result));
    return result;
}
bool closed(const Mesh& mesh) { return closure(mesh).closed; }

Mesh cube(double size = 1, const meshes::Point& at = {0, 0, 0})
{
    Mesh mesh;
    mesh.box({at[0], at[1], at[2]}, {at[0] + size, at[1] + size, at[2] + size});
    return mesh;
}
Mesh joined(const Mesh& a, const Mesh& b)
{
    Mesh mesh = a;
    const auto first = static_cast<std::uint32_t>(a.positions.size() / 3);
    mesh.positions.insert(mesh.positions.end(), b.positions.begin(), b.positions.end());
    for (const std::uint32_t index : b.indices) mesh.indices.push_back(first + index);
    return mesh;
}
/// Every triangle with vertices of its own.
Mesh torn(const Mesh& mesh)
{
    Mesh result;
    for (const std::uint32_t index : mesh.indices) {
        result.indices.push_back(static_cast<std::uint32_t>(result.positions.size() / 3));
        for (std::size_t k = 0; k < 3; ++k)
            result.positions.push_back(mesh.positions[3 * std::size_t{index} + k]);
    }
    return result;
}
Mesh turned(Mesh mesh)
{
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        std::swap(mesh.indices[i], mesh.indices[i + 1]);
    return mesh;
}

}  // namespace

TEST_CASE("Bodies are closed, whatever indices their vertices have")
{
    for (const Mesh& mesh : {cube(), meshes::icosphere(3), torn(cube()), torn(meshes::icosphere(2)),
                             cube(1, {1e6, -1e6, 1e6}), cube(1e-30), cube(1e30)}) {
        CHECK(closed(mesh));
        CHECK(closure(mesh).parts == 1);
    }
}

TEST_CASE("A mesh with any triangle missing, doubled or turned is open")
{
    const Mesh whole = meshes::icosphere(1);
    for (std::size_t t = 0; t < whole.indices.size() / 3; ++t) {
        Mesh mesh = whole;
        const auto at = mesh.indices.begin() + static_cast<std::ptrdiff_t>(3 * t);
        std::swap(at[0], at[1]);
        CHECK(!closed(mesh));
        std::swap(at[0], at[1]);
        mesh.indices.insert(mesh.indices.end(), {at[0], at[1], at[2]});
        CHECK(!closed(mesh));
        mesh = whole;
        mesh.indices.erase(mesh.indices.begin() + static_cast<std::ptrdiff_t>(3 * t),
                           mesh.indices.begin() + static_cast<std::ptrdiff_t>(3 * t + 3));
        CHECK(!closed(mesh));
    }
}

TEST_CASE("A part that is turned inside out makes the mesh open")
{
    CHECK(!closed(turned(cube())));
    CHECK(!closed(joined(cube(3), turned(cube(1, {1, 1, 1})))));
    CHECK(!closed(joined(cube(3, {-9, 0, 0}), turned(cube(1e-2, {5, 5, 5})))));
    CHECK(closed(joined(cube(3), cube(1, {1, 1, 1}))));
}

TEST_CASE("Parts that lie apart, cross or contain each other are counted one by one")
{
    CHECK(closure(joined(cube(), cube(1, {3, 0, 0}))).parts == 2);
    CHECK(closure(joined(cube(), cube(1, {0.5, 0.5, 0.5}))).parts == 2);
    CHECK(closure(joined(cube(3), cube(1, {1, 1, 1}))).parts == 2);
    // They share an edge, a corner and a side.
    CHECK(closure(joined(cube(), cube(1, {1, 1, 0}))).parts == 1);
    CHECK(closure(joined(cube(), cube(1, {1, 1, 1}))).parts == 1);
    CHECK(closure(joined(cube(), cube(1, {1, 0, 0}))).parts == 1);
    for (const meshes::Point& at : {meshes::Point{1, 1, 0}, {1, 1, 1}, {1, 0, 0}})
        CHECK(closed(joined(cube(), cube(1, at))));
}

TEST_CASE("Sheets are open, also with two sides")
{
    Mesh sheet;
    sheet.quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0.1}, {0, 1, 0.1});
    CHECK(!closed(sheet));
    CHECK(!closed(joined(sheet, turned(sheet))));
    CHECK(!closed(joined(sheet, turned(sheet)).transformed(1e3, {1e4, -3e4, 0.123})));
    // A plate of a thickness that no picture shows, and one that is thick enough.
    Mesh thin, thick;
    thin.box({0, 0, 0}, {1, 1, 1e-7});
    thick.box({0, 0, 0}, {1, 1, 1e-4});
    CHECK(!closed(thin));
    CHECK(closed(thick));
}

TEST_CASE("Triangles without area or with NaN do not count")
{
    Mesh mesh = cube();
    mesh.face(0, 0, 1);
    mesh.face(2, 2, 2);
    const auto bad = mesh.vertex({std::numeric_limits<double>::quiet_NaN(), 0, 0});
    mesh.face(0, 1, bad);
    CHECK(closed(mesh));
    CHECK(closure(mesh).parts == 1);
    Mesh only_bad;
    only_bad.triangle({0, 0, 0}, {1, 1, 1}, {2, 2, 2});
    CHECK(closed(only_bad));
    CHECK(closure(only_bad).parts == 0);
    CHECK(closed(Mesh{}));
    // Zeros of both signs are one place.
    mesh = torn(cube());
    for (std::size_t i = 0; i < mesh.positions.size(); i += 7)
        if (mesh.positions[i] == 0) mesh.positions[i] = -0.0f;
    CHECK(closed(mesh));
}

TEST_CASE("Random triangles are open, and closed when each is one side of a tetrahedron")
{
    std::mt19937 random{3};
    const Mesh soup = meshes::soup(random, 500);
    CHECK(!closed(soup));
    Mesh mesh;
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 d = meshes::random_direction(random);
        mesh = joined(mesh, cube(0.1, {d.x * 3, d.y * 3, d.z * 3}));
    }
    CHECK(closed(mesh));
    CHECK(closed(torn(mesh)));
    CHECK(closure(torn(mesh)).parts == closure(mesh).parts);
    mesh.indices.resize(mesh.indices.size() - 3);
    CHECK(!closed(mesh));
}

TEST_CASE("The search for open edges refuses bad meshes and too little scratch")
{
    Mesh mesh = cube();
    nook::MeshClosure result{true, 99};
    std::vector<std::byte> memory(nook::closed_mesh_scratch_size(mesh.view()));
    CHECK(memory.size() <= 12 * 8 + 4 * 64);
    CHECK(nook::closed_mesh(mesh.view(), result, nook::Scratch{memory.data(), memory.size() - 1})
              .error.code == ErrorCode::scratch_too_small);
    CHECK(result.parts == 99);
    CHECK(nook::closed_mesh(mesh.view(), result, nook::Scratch{memory.data(), memory.size()}));
    CHECK(result.parts == 1);
    mesh.indices[0] = 8;
    CHECK(nook::closed_mesh(mesh.view(), result).error.code == ErrorCode::index_out_of_range);
    CHECK(nook::closed_mesh({}, result));
}
