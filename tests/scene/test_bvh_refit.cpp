#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Bvh;
using nook::Hit;
using nook::Ray;
using nook::detail::BvhNode;

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

Bvh built(const Mesh& mesh)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    return bvh;
}

/// Answers that are not those of the mesh, among rays from around the origin.
int different(const Bvh& bvh, const Mesh& mesh, int rays, double extent, std::mt19937& random)
{
    int count = 0;
    for (int i = 0; i < rays; ++i) {
        const Ray ray{meshes::random_direction(random) * extent, meshes::random_direction(random)};
        const Hit hit = bvh.closest(ray), slow = nook::closest_brute_force(mesh.view(), ray);
        count += hit.face != slow.face || hit.t != slow.t || bvh.occluded(ray) != bool(slow);
    }
    return count;
}

Mesh shaken(Mesh mesh, double by, std::mt19937& random)
{
    std::uniform_real_distribution<double> unit{-by, by};
    for (float& c : mesh.positions) c = static_cast<float>(double{c} + unit(random));
    return mesh;
}

/// The same tree with the same boxes and triangles.
bool same(const Bvh& a, const Bvh& b)
{
    if (a.view().empty() || b.view().empty()) return a.view().empty() && b.view().empty();
    std::vector<std::uint32_t> stack{a.view().root};
    while (!stack.empty()) {
        const std::uint32_t next = stack.back();
        stack.pop_back();
        if ((next & BvhNode::block_bit) != 0) {
            const std::uint32_t block = next & ~BvhNode::block_bit;
            if (std::memcmp(a.view().blocks + block, b.view().blocks + block,
                            sizeof(nook::detail::TriangleBlock)) != 0)
                return false;
            continue;
        }
        const BvhNode &one = a.view().nodes[next], &other = b.view().nodes[next];
        for (int lane = 0; lane < BvhNode::lanes; ++lane) {
            if (one.child[lane] != other.child[lane]) return false;
            // As numbers: the sign of a zero does not matter.
            for (int k = 0; k < 3; ++k)
                if (one.box(lane).low[k] != other.box(lane).low[k] ||
                    one.box(lane).high[k] != other.box(lane).high[k])
                    return false;
            if (one.child[lane] != nook::no_face) stack.push_back(one.child[lane]);
        }
    }
    return a.memory_size() == b.memory_size();
}

}  // namespace

TEST_CASE("after a refit the answers are those of brute force on the moved mesh")
{
    std::mt19937 random{41};
    for (int scene = 0; scene < 150; ++scene) {
        CAPTURE(scene);
        Mesh mesh = meshes::soup(random, 1 + scene);
        Bvh bvh = built(mesh);
        for (const double by : {0.01, 0.3, 5.0}) {
            mesh = shaken(mesh, by, random);
            REQUIRE(bvh.refit(mesh.view()));
            CHECK(different(bvh, mesh, 20, 1 + by, random) == 0);
        }
        mesh = mesh.transformed(1000, {1e6, 0, 0});
        REQUIRE(bvh.refit(mesh.view()));
        const Bvh fresh = built(mesh);
        for (int i = 0; i < 10; ++i) {
            const glm::dvec3 d = meshes::random_direction(random);
            const Ray ray{{1e6 - 9000 * d.x, -9000 * d.y, -9000 * d.z}, d};
            CHECK(bvh.closest(ray).face == fresh.closest(ray).face);
            CHECK(bvh.closest(ray).t == fresh.closest(ray).t);
        }
    }
}

TEST_CASE("a refit to the same vertices changes no bit")
{
    std::mt19937 random{42};
    for (const int count : {1, 8, 9, 100, 10000}) {
        const Mesh mesh = meshes::soup(random, count);
        const Bvh expected = built(mesh);
        Bvh bvh = built(mesh);
        REQUIRE(bvh.refit(mesh.view()));
        CHECK(same(bvh, expected));
    }
}

TEST_CASE("a refit has the same bits for any number of threads")
{
    std::mt19937 random{43};
    const Mesh mesh = meshes::soup(random, 20000), moved = shaken(mesh, 0.2, random);
    Bvh expected = built(mesh);
    REQUIRE(expected.refit(moved.view()));
    for (const int threads : {1, 2, 3, 5, 8, 16}) {
        nook::ThreadExecutor executor{threads};
        Bvh bvh = built(mesh);
        REQUIRE(bvh.refit(moved.view(), executor));
        CHECK(same(bvh, expected));
    }
}

TEST_CASE("triangles that break are not hit, disturb no other, and come back whole")
{
    std::mt19937 random{44};
    for (int scene = 0; scene < 60; ++scene) {
        CAPTURE(scene);
        const Mesh mesh = meshes::soup(random, 5 + 2 * scene);
        Bvh bvh = built(mesh);
        Mesh broken = mesh;
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
            const std::size_t v = 3 * std::size_t{mesh.indices[3 * t]};
            if (t % 3 == 0) broken.positions[v + t % 2] = not_a_number;
            if (t % 5 == 1) broken.indices[3 * t] = broken.indices[3 * t + 1];
        }
        REQUIRE(bvh.refit(broken.view()));
        CHECK(different(bvh, broken, 30, 1.5, random) == 0);
        int visited = 0;
        bvh.in_sphere({0, 0, 0}, 1e9, [&](std::uint32_t face) {
            ++visited;
            CHECK(nook::is_usable_triangle(broken.view(), face));
        });
        nook::in_sphere_brute_force(broken.view(), {0, 0, 0}, 1e9,
                                    [&](std::uint32_t) { --visited; });
        CHECK(visited == 0);
        REQUIRE(bvh.refit(mesh.view()));
        CHECK(different(bvh, mesh, 30, 1.5, random) == 0);
    }
    SUBCASE("even all of them")
    {
        const Mesh mesh = meshes::icosphere(2);
        Mesh broken = mesh;
        for (float& c : broken.positions) c = not_a_number;
        Bvh bvh = built(mesh);
        REQUIRE(bvh.refit(broken.view()));
        CHECK(different(bvh, broken, 100, 0.5, random) == 0);
        REQUIRE(bvh.refit(mesh.view()));
        CHECK(same(bvh, built(mesh)));
    }
}

TEST_CASE("a triangle that a build left out stays out")
{
    Mesh mesh = meshes::icosphere(1);
    mesh.triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0});
    Bvh bvh = built(mesh);
    CHECK(bvh.dropped() == 1);
    mesh.positions[mesh.positions.size() - 2] = 2;
    REQUIRE(bvh.refit(mesh.view()));
    CHECK(bvh.dropped() == 1);
    CHECK(bvh.triangle_count() == 80);
    CHECK(bvh.closest({{0.7, 0.1, 0.1}, {0, 0, -1}}).face != 80);
}

TEST_CASE("a refit to another number of triangles, or to bad indices, changes nothing")
{
    std::mt19937 random{45};
    const Mesh mesh = meshes::icosphere(2);
    Bvh bvh = built(mesh);
    Mesh other = mesh;
    other.face(0, 1, 2);
    nook::Outcome outcome = bvh.refit(other.view());
    CHECK(outcome.error.code == nook::ErrorCode::bad_size);
    CHECK(std::string{outcome.error.argument} == "mesh.triangle_count");
    CHECK(outcome.error.value == 321);
    other = mesh;
    other.indices[7] = 100000;
    outcome = bvh.refit(other.view());
    CHECK(outcome.error.code == nook::ErrorCode::index_out_of_range);
    CHECK(same(bvh, built(mesh)));
    CHECK(Bvh{}.refit({}));
    CHECK_FALSE(Bvh{}.refit(mesh.view()));
    Mesh degenerate;
    degenerate.triangle({1, 1, 1}, {1, 1, 1}, {2, 2, 2});
    Bvh none = built(degenerate);
    CHECK(none.refit(degenerate.view()));
    CHECK_FALSE(none.occluded({{0, 0, 0}, {1, 1, 1}}));
}
