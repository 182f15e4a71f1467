#include <doctest/doctest.h>

#include <limits>
#include <string>

#include <nook/scene/mesh.hpp>

#include "meshes.hpp"

TEST_CASE("a mesh without triangles is fine, whatever its pointers")
{
    CHECK_FALSE(nook::check_mesh({}));
    CHECK_FALSE(nook::check_mesh({.vertex_count = 3}));
}

TEST_CASE("a mesh that cannot be read is an error that names the thing")
{
    const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::uint32_t indices[6] = {0, 1, 2, 2, 1, 7};
    nook::MeshView mesh{
        .positions = positions, .vertex_count = 3, .indices = indices, .triangle_count = 1};
    CHECK_FALSE(nook::check_mesh(mesh));

    mesh.triangle_count = 2;
    const nook::Error index = nook::check_mesh(mesh);
    CHECK(index.code == nook::ErrorCode::index_out_of_range);
    CHECK(index.argument == std::string{"mesh.indices"});
    CHECK(index.value == 7);

    mesh.positions = nullptr;
    CHECK(nook::check_mesh(mesh).argument == std::string{"mesh.positions"});
    mesh.positions = positions;
    mesh.indices = nullptr;
    CHECK(nook::check_mesh(mesh).argument == std::string{"mesh.indices"});
    mesh.triangle_count = 0xffffffff;
    CHECK(nook::check_mesh(mesh).code == nook::ErrorCode::bad_size);
}

TEST_CASE("only triangles with finite vertices and an area are usable")
{
    const float not_a_number = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    const auto usable = [](const std::array<float, 9>& positions) {
        const std::uint32_t indices[3] = {0, 1, 2};
        return nook::is_usable_triangle({.positions = positions.data(),
                                         .vertex_count = 3,
                                         .indices = indices,
                                         .triangle_count = 1},
                                        0);
    };
    CHECK(usable({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    CHECK(usable({0, 0, 0, 1e-37f, 0, 0, 0, 1e-37f, 0}));
    CHECK(usable({0, 0, 0, 3e38f, 0, 0, 0, -3e38f, 0}));
    CHECK(usable({1e6f, 0, 0, 1e6f, 0.0625f, 0, 1e6f, 0, 0.0625f}));
    CHECK(usable({0, 0, 0, 1, 0, 0, 2, 1e-7f, 0}));
    CHECK_FALSE(usable({0, 0, 0, 0, 0, 0, 0, 0, 0}));
    CHECK_FALSE(usable({1, 2, 3, 1, 2, 3, 4, 5, 6}));
    CHECK_FALSE(usable({1, 2, 3, 4, 5, 6, 4, 5, 6}));
    CHECK_FALSE(usable({4, 5, 6, 1, 2, 3, 4, 5, 6}));
    CHECK_FALSE(usable({0, 0, 0, 0.1f, 0.1f, 0.1f, 0.3f, 0.3f, 0.3f}));
    CHECK_FALSE(usable({1, 1, 1, 2, 3, 4, 3, 5, 7}));
    CHECK_FALSE(usable({0, 0, 0, 1, 0, 0, 0, not_a_number, 0}));
    CHECK_FALSE(usable({0, 0, 0, infinity, 0, 0, 0, 1, 0}));
    CHECK_FALSE(usable({0, 0, 0, 1, 0, 0, 0, 1, -infinity}));
}

TEST_CASE("positions are read through their stride")
{
    // Padded to four floats, and from the last vertex to the first.
    const float padded[12] = {0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9};
    const std::uint32_t indices[3] = {0, 1, 2};
    const nook::MeshView forward{.positions = padded,
                                 .vertex_count = 3,
                                 .indices = indices,
                                 .triangle_count = 1,
                                 .position_stride = 4};
    const auto a = nook::detail::mesh_triangle(forward, 0);
    CHECK(a.b.x == 1);
    CHECK(a.c.y == 1);
    nook::MeshView backward = forward;
    backward.positions = padded + 8;
    backward.position_stride = -4;
    const auto b = nook::detail::mesh_triangle(backward, 0);
    CHECK(b.a.y == 1);
    CHECK(b.c.y == 0);
}
