#include <doctest/doctest.h>

#include "watertight.hpp"

TEST_CASE("of ten million rays at vertices and edges from inside, none leaves a closed mesh")
{
    CHECK(watertight::leaks(10'000'000) == 0);
}

TEST_CASE("a mesh with a hole leaks")
{
    watertight::ClosedMesh mesh = watertight::rock(24, 0.3, 1, {0, 0, 0}, 1);
    mesh.indices.resize(mesh.indices.size() - 30);
    nook::Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    CHECK(watertight::leaks(mesh, bvh, {0, 0, 0}, 0.2, 10000, 1) > 0);
}
