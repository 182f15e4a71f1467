#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
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

Bvh built(const Mesh& mesh)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
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

/// The mesh in scene space, for many rays: what the brute force of the library reads anew for each.
struct Soup {
    nook::detail::SceneSpace space;
    std::vector<nook::detail::SceneTriangle> triangles;

    explicit Soup(const Mesh& mesh) : space{nook::detail::scene_space(mesh.view())}
    {
        for (std::size_t t = 0; t < mesh.view().triangle_count; ++t)
            if (nook::is_usable_triangle(mesh.view(), t))
                triangles.push_back(nook::detail::scene_triangle(mesh.view(), space, t));
    }
    [[nodiscard]] Hit closest(const Ray& ray) const
    {
        const nook::detail::SceneRay local{space, ray};
        Hit hit{};
        if (!local.valid()) return hit;
        for (const auto& triangle : triangles) local.keep_nearest(triangle, hit);
        if (hit) hit.t = local.world_t(hit.t);
        return hit;
    }
};

}  // namespace

TEST_CASE("closest and any hit equal brute force on ten thousand random scenes")
{
    std::mt19937 random{11};
    std::uniform_real_distribution<double> unit{-1, 1};
    int different = 0, hits = 0, rays = 0;
    for (int scene = 0; scene < 10000; ++scene) {
        // Mostly small, so that all are done in seconds.
        const int size = scene % 50 == 0 ? 200 : 2 + scene % 49;
        const double extent = std::ldexp(1.0, scene % 9 == 0 ? scene % 120 - 60 : 0);
        const Mesh mesh = meshes::soup(random, size, extent);
        const Bvh bvh = built(mesh);
        const Soup soup{mesh};
        different += bvh.triangle_count() != soup.triangles.size();
        for (int i = 0; i < 24; ++i) {
            const double reach = (i % 4 == 0 ? 5 : 1) * extent;
            Ray ray{{reach * unit(random), reach * unit(random), reach * unit(random)},
                    meshes::random_direction(random)};
            if (i % 3 == 0) ray.direction *= std::exp(20 * unit(random));
            if (i % 5 == 1) ray.t_max = (0.5 + 0.5 * unit(random)) * extent;
            if (i % 7 == 2)
                ray.direction = direction_to(ray.origin, meshes::vertex_position(mesh, 0));
            if (i % 11 == 3) ray.exclude = soup.closest(ray).face;
            const Hit hit = bvh.closest(ray), slow = soup.closest(ray);
            ++rays;
            hits += bool(slow);
            different +=
                hit.face != slow.face || hit.t != slow.t || bvh.occluded(ray) != bool(slow);
            if (scene % 100 == 0) different += !agree(bvh, mesh, ray);
        }
    }
    CHECK(different == 0);
    CHECK(hits > rays / 20);
    CHECK(hits < rays * 9 / 10);
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

TEST_CASE("triangles stop rays from either side")
{
    Mesh mesh;
    mesh.triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, 0});
    mesh.triangle({-1, -1, 5}, {0, 1, 5}, {1, -1, 5});
    const Bvh bvh = built(mesh);
    for (const double side : {-1.0, 1.0}) {
        CHECK(bvh.occluded({{0, 0, side}, {0, 0, -side}, 1}));
        CHECK(bvh.occluded({{0, 0, 5 + side}, {0, 0, -side}, 1}));
    }
}

TEST_CASE("a triangle given a hundred thousand times is hit at one t")
{
    Mesh mesh;
    mesh.triangle({-1, -1, 2}, {1, -1, 2}, {0, 1, 2});
    mesh.triangle({-1, -1, 3}, {1, -1, 3}, {0, 1, 3});
    for (int i = 0; i < 100000; ++i) mesh.face(0, 1, 2);
    const Bvh bvh = built(mesh);
    const Hit hit = bvh.closest({{0, 0, 0}, {0, 0, 1}});
    CHECK(hit.t == 2);
    CHECK(hit.face == 0);
    CHECK(bvh.closest({{0, 0, 9}, {0, 0, -1}}).face == 1);
    CHECK(bvh.occluded({{0, 0, 0}, {0, 0, 1}, 2}));
    CHECK_FALSE(bvh.occluded({{0, 0, 0}, {0, 0, 1}, 1.9}));
    CHECK_FALSE(bvh.occluded({{0, 3, 0}, {0, 0, 1}}));
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
