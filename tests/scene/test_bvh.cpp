#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nook/scene/bvh.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Bvh;
using nook::Hit;
using nook::Ray;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Bvh built(const Mesh& mesh, int leaf_size = 4)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view(), {.leaf_size = leaf_size}));
    return bvh;
}

/// Any-hit, closest hit and brute force agree, bit for bit.
bool agree(const Bvh& bvh, const Mesh& mesh, const Ray& ray)
{
    const Hit hit = bvh.closest(ray), slow = nook::closest_brute_force(mesh.view(), ray);
    return hit.face == slow.face && hit.t == slow.t && bvh.occluded(ray) == bool(slow) &&
           nook::occluded_brute_force(mesh.view(), ray) == bool(slow);
}

glm::dvec3 direction_to(const glm::dvec3& from, const glm::dvec3& to)
{
    return {to.x - from.x, to.y - from.y, to.z - from.z};
}

/// Misses among rays from a point inside a closed mesh through every vertex, edge and face.
int leaks(const Mesh& mesh, const glm::dvec3& from)
{
    const Bvh bvh = built(mesh);
    int count = 0;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
        const glm::dvec3 a = meshes::vertex_position(mesh, mesh.indices[t]),
                         b = meshes::vertex_position(mesh, mesh.indices[t + 1]),
                         c = meshes::vertex_position(mesh, mesh.indices[t + 2]);
        const auto trace = [&](double wa, double wb, double wc) {
            const glm::dvec3 to{wa * a.x + wb * b.x + wc * c.x, wa * a.y + wb * b.y + wc * c.y,
                                wa * a.z + wb * b.z + wc * c.z};
            count += !bvh.occluded({from, direction_to(from, to)});
        };
        trace(1, 0, 0);
        for (int i = 0; i <= 8; ++i) {
            trace(i / 8.0, 1 - i / 8.0, 0);
            trace(0, i / 8.0, 1 - i / 8.0);
            trace(1 - i / 8.0, 0, i / 8.0);
        }
        trace(0.3, 0.3, 0.4);
    }
    return count;
}

}  // namespace

TEST_CASE("closest and any hit equal brute force on random scenes")
{
    std::mt19937 random{11};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (int scene = 0; scene < 400; ++scene) {
        CAPTURE(scene);
        const Mesh mesh = meshes::soup(random, 1 + scene % 60);
        const Bvh bvh = built(mesh, 1 + scene % 7);
        CHECK(bvh.triangle_count() + bvh.dropped() == mesh.view().triangle_count);
        int different = 0;
        for (int i = 0; i < 40; ++i) {
            const double reach = i % 4 == 0 ? 5 : 1;
            Ray ray{{reach * unit(random), reach * unit(random), reach * unit(random)},
                    meshes::random_direction(random)};
            if (i % 3 == 0) ray.direction *= std::exp(20 * unit(random));
            if (i % 5 == 1) ray.t_max = 0.5 + 0.5 * unit(random);
            if (i % 7 == 2)
                ray.direction = direction_to(ray.origin, meshes::vertex_position(mesh, 0));
            if (i % 11 == 3) {
                ray.exclude = nook::closest_brute_force(mesh.view(), ray).face;
            }
            different += !agree(bvh, mesh, ray);
        }
        CHECK(different == 0);
    }
}

TEST_CASE("no ray leaks through a vertex or an edge of a closed mesh")
{
    std::mt19937 random{12};
    std::uniform_real_distribution<double> unit{-0.4, 0.4};
    const Mesh ball = meshes::icosphere(3);
    for (int i = 0; i < 12; ++i)
        CHECK(leaks(ball, {unit(random), unit(random), unit(random)}) == 0);
    CHECK(leaks(ball, {0, 0, 0}) == 0);
    CHECK(leaks(ball.transformed(1000, {1e5, -1e5, 1e5}), {1e5 + 120.3, -1e5, 1e5 + 77}) == 0);
    CHECK(leaks(ball.transformed(1, {1e3, 1e3, 1e3}), {1e3 + 0.123, 1e3, 1e3 - 0.3}) == 0);
    CHECK(leaks(ball.transformed(1e-20, {0, 0, 0}), {1e-21, 2e-21, 0}) == 0);
    CHECK(leaks(ball.transformed(1e30, {0, 0, 0}), {1e29, 2e29, 0}) == 0);
    Mesh box;
    box.box({-1, -2, -3}, {1, 2, 3});
    CHECK(leaks(box, {0.1, 0.2, 0.3}) == 0);
    CHECK(leaks(box, {0, 0, 0}) == 0);
}

TEST_CASE("rays from outside through each vertex hit")
{
    const Mesh ball = meshes::icosphere(2);
    const Bvh bvh = built(ball);
    for (std::size_t i = 0; i < ball.positions.size() / 3; ++i) {
        const glm::dvec3 v = meshes::vertex_position(ball, i);
        CHECK(std::fabs(bvh.closest({v * 5.0, -v}).t - 4) < 1e-14);
    }
}

TEST_CASE("rays along the axes, along node planes and with tiny components equal brute force")
{
    std::mt19937 random{13};
    Mesh mesh;
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x)
                mesh.box({x * 2.0, y * 2.0, z * 2.0}, {x * 2.0 + 1, y * 2.0 + 1, z * 2.0 + 1});
    const Bvh bvh = built(mesh);
    int different = 0, rays = 0;
    for (const double zero : {0.0, -0.0, 1e-38, -1e-38, 1e-300})
        for (int axis = 0; axis < 3; ++axis)
            for (const double sign : {-1.0, 1.0})
                for (double a = -0.5; a <= 5.5; a += 0.5)
                    for (double b = -0.5; b <= 5.5; b += 0.5)
                        for (const double start : {-1.0, 0.5, 1.0, 2.0, 7.0}) {
                            glm::dvec3 origin{a, b, start}, direction{zero, zero, sign};
                            if (axis == 0) origin = {start, a, b}, direction = {sign, zero, zero};
                            if (axis == 1) origin = {a, start, b}, direction = {zero, sign, zero};
                            ++rays;
                            different += !agree(bvh, mesh, {origin, direction});
                        }
    CHECK(rays > 10000);
    CHECK(different == 0);
}

TEST_CASE("a ray in the plane of a triangle misses it, and grazing rays hit a flat box")
{
    Mesh mesh;
    mesh.triangle({-1, 0, -1}, {1, 0, -1}, {0, 0, 1});
    const Bvh bvh = built(mesh);
    CHECK_FALSE(bvh.occluded({{-5, 0, 0}, {1, 0, 0}}));
    CHECK_FALSE(bvh.occluded({{0, 0, 0}, {0, 0, 1}}));
    for (const double slope : {1e-3, 1e-7, 1e-9})
        for (const double side : {-1.0, 1.0}) {
            const Hit hit = bvh.closest({{-5, side * 5 * slope, 0}, {1, -side * slope, 0}});
            REQUIRE(hit);
            CHECK(std::fabs(hit.t - 5) < 1e-14);
        }
}

TEST_CASE("the end of a ray is included, its start is not")
{
    Mesh mesh;
    mesh.triangle({-1, -1, 3}, {1, -1, 3}, {0, 1, 3});
    const Bvh bvh = built(mesh);
    CHECK(bvh.occluded({{0, 0, 0}, {0, 0, 1}, 3}));
    CHECK(bvh.occluded({{0, 0, 0}, {0, 0, 2}, 1.5}));
    CHECK_FALSE(bvh.occluded({{0, 0, 0}, {0, 0, 1}, std::nextafter(3, 0)}));
    CHECK_FALSE(bvh.occluded({{0, 0, 3}, {0, 0, 1}}));
    CHECK(bvh.occluded({{0, 0, std::nextafter(3, 0)}, {0, 0, 1}}));
    CHECK(bvh.closest({{0, 0, 0}, {0, 0, 1}}).t == 3);
    CHECK(bvh.closest({{0, 0, 7}, {0, 0, -1}}).t == 4);
    CHECK_FALSE(bvh.occluded({{0, 0, 0}, {0, 0, 1}, infinity, 0}));
}

TEST_CASE("rays that are not rays hit nothing")
{
    const Mesh ball = meshes::icosphere(1);
    const Bvh bvh = built(ball);
    for (const Ray& ray : {Ray{{0, 0, 0}, {0, 0, 0}}, Ray{{0, 0, 0}, {not_a_number, 0, 1}},
                           Ray{{0, 0, 0}, {infinity, 0, 1}}, Ray{{not_a_number, 0, 0}, {0, 0, 1}},
                           Ray{{0, infinity, 0}, {0, 0, 1}}, Ray{{0, 0, 0}, {0, 0, 1}, 0},
                           Ray{{0, 0, 0}, {0, 0, 1}, -1}, Ray{{0, 0, 0}, {0, 0, 1}, not_a_number},
                           Ray{{1e30, 0, 0}, {-1, 0, 0}}}) {
        CHECK_FALSE(bvh.occluded(ray));
        CHECK_FALSE(bvh.closest(ray));
        CHECK_FALSE(nook::occluded_brute_force(ball.view(), ray));
    }
    CHECK(bvh.occluded({{0, 0, 0}, {0, 0, 1e-300}}));
    CHECK(bvh.occluded({{0, 0, 0}, {1e300, 0, 1e300}}));
    CHECK(bvh.occluded({{1e12, 0, 0}, {-1, 0, 0}}));
}

TEST_CASE("unusable triangles are dropped and counted, and change nothing else")
{
    std::mt19937 random{14};
    const Mesh good = meshes::soup(random, 50);
    Mesh bad = good;
    bad.triangle({0, 0, not_a_number}, {1, 0, 0}, {0, 1, 0});
    bad.triangle({0, 0, 0}, {1, infinity, 0}, {0, 1, 0});
    bad.triangle({1, 1, 1}, {1, 1, 1}, {1, 1, 1});
    bad.triangle({0, 0, 0}, {1, 1, 1}, {2, 2, 2});
    const Bvh a = built(good), b = built(bad);
    CHECK(a.dropped() == 0);
    CHECK(b.dropped() == 4);
    CHECK(b.triangle_count() == 50);
    for (int i = 0; i < 500; ++i) {
        const Ray ray{meshes::random_direction(random) * 2.0, meshes::random_direction(random)};
        CHECK(a.closest(ray).t == b.closest(ray).t);
        CHECK(agree(b, bad, ray));
    }
}

TEST_CASE("no triangle, one, two, three")
{
    CHECK_FALSE(Bvh{}.occluded({}));
    CHECK_FALSE(built({}).occluded({}));
    Mesh mesh;
    for (int count = 1; count <= 3; ++count) {
        mesh.triangle({-1, -1, -1.0 * count}, {1, -1, -1.0 * count}, {0, 1, -1.0 * count});
        const Bvh bvh = built(mesh);
        CHECK(bvh.closest({{0, 0, -9}, {0, 0, 1}}).face == static_cast<std::uint32_t>(count - 1));
        CHECK(bvh.closest({{0, 0, 0}, {0, 0, -1}}).face == 0);
    }
    Mesh degenerate;
    for (int i = 0; i < 1000; ++i) degenerate.triangle({1, 1, 1}, {1, 1, 1}, {2, 2, 2});
    const Bvh none = built(degenerate);
    CHECK(none.dropped() == 1000);
    CHECK(none.triangle_count() == 0);
    CHECK_FALSE(none.occluded({{0, 0, 0}, {1, 1, 1}}));
}

TEST_CASE("coincident and nested triangles end in a shallow tree")
{
    SUBCASE("a million of one centre")
    {
        Mesh mesh;
        mesh.triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, 0});
        mesh.indices.reserve(3000000);
        for (int i = 1; i < 1000000; ++i) mesh.face(0, 1, 2);
        const Bvh bvh = built(mesh);
        CHECK(bvh.triangle_count() == 1000000);
        CHECK(bvh.depth() <= 64);
        CHECK(bvh.occluded({{0, 0, 1}, {0, 0, -1}}));
        CHECK_FALSE(bvh.occluded({{3, 0, 1}, {0, 0, -1}}));
        CHECK(bvh.closest({{0, 0, 1}, {0, 0, -1}}).face == 0);
    }
    SUBCASE("sizes that halve, so that every split by area takes one away")
    {
        Mesh mesh;
        for (int i = 0; i < 120; ++i) {
            const double s = std::ldexp(1.0, -i);
            mesh.triangle({s, 0, 0}, {s * 1.5, 0, 0}, {s, s, s});
        }
        const Bvh bvh = built(mesh, 1);
        CHECK(bvh.depth() <= 64);
        std::mt19937 random{15};
        for (int i = 0; i < 200; ++i)
            CHECK(
                agree(bvh, mesh,
                      {meshes::random_direction(random) * 2.0, meshes::random_direction(random)}));
    }
}

TEST_CASE("a scene far from zero keeps its hits, and one scaled by a power of two its bits")
{
    std::mt19937 random{16};
    // Coordinates on a grid that floats near 10⁶ can hold.
    Mesh mesh = meshes::soup(random, 80, 8);
    for (float& c : mesh.positions) c = std::round(c * 4) / 4;
    const Bvh bvh = built(mesh);
    const Bvh moved = built(mesh.transformed(1, {1e6, -1e6, 1e6}));
    const Bvh large = built(mesh.transformed(0x1p20, {0, 0, 0}));
    const Bvh tiny = built(mesh.transformed(0x1p-20, {0, 0, 0}));
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 origin = meshes::random_direction(random) * 9.0;
        const glm::dvec3 direction = meshes::random_direction(random);
        const Hit hit = bvh.closest({origin, direction});
        hits += bool(hit);
        const Hit far_hit =
            moved.closest({{origin.x + 1e6, origin.y - 1e6, origin.z + 1e6}, direction});
        CHECK(far_hit.face == hit.face);
        // The origin moves by half a step of a double near 10⁶, 6e-11, and more at a slant.
        if (hit) CHECK(std::fabs(far_hit.t - hit.t) < 1e-8);
        const Hit large_hit = large.closest({origin * 0x1p20, direction});
        CHECK(large_hit.face == hit.face);
        CHECK(large_hit.t == hit.t * 0x1p20);
        const Hit tiny_hit = tiny.closest({origin * 0x1p-20, direction});
        CHECK(tiny_hit.face == hit.face);
        CHECK(tiny_hit.t == hit.t * 0x1p-20);
    }
    CHECK(hits > 200);
}

TEST_CASE("coordinates of 1e30, and triangles across 1e18, overflow nowhere")
{
    Mesh mesh;
    mesh.triangle({-1e30, -1e30, 1e30}, {1e30, -1e30, 1e30}, {0, 1e30, 1e30});
    mesh.triangle({-1e18, -1e18, 5}, {1e18, -1e18, 5}, {0, 1e18, 5});
    mesh.triangle({-1, -1, 3}, {1, -1, 3}, {0, 1, 3});
    const Bvh bvh = built(mesh);
    CHECK(std::fabs(bvh.closest({{0, 0, 9}, {0, 0, 1}}).t / double{1e30f} - 1) < 1e-14);
    CHECK(agree(bvh, mesh, {{0, 0, 9}, {0, 0, 1}}));
    CHECK(agree(bvh, mesh, {{0, 0, 0}, {0, 0, 1}}));
    CHECK(bvh.occluded({{0, 0, 0}, {0, 0, 1}, 10}));
}

TEST_CASE("memory comes from the caller, goes back to the caller, and its end is an error")
{
    struct Account {
        int allowed = 1 << 30, taken = 0, blocks = 0;
        std::size_t bytes = 0;
    } account;
    nook::Memory memory;
    memory.user = &account;
    memory.allocate = [](std::size_t size, void* user) -> void* {
        auto& a = *static_cast<Account*>(user);
        if (a.taken == a.allowed) return nullptr;
        ++a.taken;
        ++a.blocks;
        a.bytes += size;
        return std::malloc(size);
    };
    memory.free = [](void* block, std::size_t size, void* user) {
        auto& a = *static_cast<Account*>(user);
        --a.blocks;
        a.bytes -= size;
        std::free(block);
    };
    const Mesh ball = meshes::icosphere(3), other = meshes::icosphere(0);
    {
        Bvh bvh;
        REQUIRE(bvh.build(ball.view(), {.memory = memory}));
        CHECK(account.blocks == 1);
        CHECK(account.bytes == bvh.memory_size());
        Bvh moved = std::move(bvh);
        CHECK(account.blocks == 1);
        CHECK(moved.occluded({{0, 0, 0}, {0, 0, 1}}));
    }
    CHECK(account.blocks == 0);
    CHECK(account.bytes == 0);

    const int needed = account.taken;
    CHECK(needed >= 3);
    Bvh bvh = built(other);
    for (int allowed = 0; allowed < needed; ++allowed) {
        account = {.allowed = allowed};
        const nook::Outcome outcome = bvh.build(ball.view(), {.memory = memory});
        CHECK(outcome.error.code == nook::ErrorCode::out_of_memory);
        CHECK(account.blocks == 0);
        CHECK(bvh.triangle_count() == 20);
    }
}

TEST_CASE("a hierarchy that was moved from is empty")
{
    Bvh a = built(meshes::icosphere(1));
    const Bvh b = std::move(a);
    CHECK(b.occluded({{0, 0, 0}, {0, 0, 1}}));
    CHECK_FALSE(a.occluded({{0, 0, 0}, {0, 0, 1}}));
    CHECK(a.triangle_count() == 0);
}

TEST_CASE("bad arguments are named, and the hierarchy stays as it was")
{
    Mesh mesh = meshes::icosphere(0);
    Bvh bvh = built(mesh);
    const auto rejected = [&](const nook::Outcome& outcome) {
        CHECK(bvh.triangle_count() == 20);
        return std::string{outcome.error.argument};
    };
    CHECK(rejected(bvh.build(mesh.view(), {.leaf_size = 0})) == "options.leaf_size");
    CHECK(rejected(bvh.build(mesh.view(), {.leaf_size = 256})) == "options.leaf_size");
    mesh.indices[4] = 12;
    CHECK(rejected(bvh.build(mesh.view())) == "mesh.indices");
}
