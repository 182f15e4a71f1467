#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/scene/sphere.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Bvh;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Bvh built(const Mesh& mesh)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    return bvh;
}

std::vector<std::uint32_t> found(const Bvh& bvh, const glm::dvec3& centre, double radius)
{
    std::vector<std::uint32_t> faces;
    CHECK(bvh.in_sphere(centre, radius, [&](std::uint32_t face) { faces.push_back(face); }));
    std::sort(faces.begin(), faces.end());
    return faces;
}
std::vector<std::uint32_t> slowly(const Mesh& mesh, const glm::dvec3& centre, double radius)
{
    std::vector<std::uint32_t> faces;
    CHECK(nook::in_sphere_brute_force(mesh.view(), centre, radius,
                                      [&](std::uint32_t face) { faces.push_back(face); }));
    return faces;
}

/// The least distance over a fine grid of points of the triangle: an upper bound of the distance.
double sampled_distance(const nook::detail::Triangle& t, const nook::detail::Vector3& p, int steps)
{
    double least = infinity;
    for (int i = 0; i <= steps; ++i)
        for (int j = 0; i + j <= steps; ++j) {
            const auto d =
                t.a + (t.b - t.a) * (double(i) / steps) + (t.c - t.a) * (double(j) / steps) - p;
            least = std::min(least, std::sqrt(dot(d, d)));
        }
    return least;
}

}  // namespace

TEST_CASE("all triangles in a sphere are those that brute force finds")
{
    std::mt19937 random{51};
    std::uniform_real_distribution<double> unit{-1, 1};
    std::size_t visited = 0, different = 0, all = 0;
    for (int scene = 0; scene < 300; ++scene) {
        const double scale = std::ldexp(1.0, scene % 7 == 0 ? scene % 80 - 40 : 0);
        const Mesh mesh = meshes::soup(random, 1 + scene, scale);
        const Bvh bvh = built(mesh);
        for (int i = 0; i < 40; ++i) {
            const double radius = i == 0 ? infinity : std::exp(4 * unit(random) - 2) * scale;
            glm::dvec3 centre{unit(random) * scale, unit(random) * scale, unit(random) * scale};
            if (i % 5 == 1) centre = meshes::vertex_position(mesh, 0);
            const auto faces = found(bvh, centre, i % 5 == 1 && i % 2 == 0 ? 0 : radius);
            different += faces != slowly(mesh, centre, i % 5 == 1 && i % 2 == 0 ? 0 : radius);
            visited += faces.size();
            all += mesh.view().triangle_count;
        }
    }
    CHECK(different == 0);
    CHECK(visited > all / 20);
    CHECK(visited < all / 2);
}

TEST_CASE("a sphere reaches a triangle at its distance and not below")
{
    std::mt19937 random{52};
    std::uniform_real_distribution<double> unit{-2, 2};
    for (int i = 0; i < 2000; ++i) {
        Mesh mesh = meshes::soup(random, 1);
        if (i % 4 == 0) {
            // A sliver.
            for (std::size_t k = 0; k < 3; ++k)
                mesh.positions[6 + k] = mesh.positions[k] * 0.4f + mesh.positions[3 + k] * 0.6f;
            if (!nook::is_usable_triangle(mesh.view(), 0)) continue;
        }
        const glm::dvec3 p{unit(random), unit(random), unit(random)};
        const nook::detail::Triangle t = nook::detail::mesh_triangle(mesh.view(), 0);
        const double sampled = sampled_distance(t, nook::detail::vector(p), 60);
        const auto ab = t.b - t.a, ac = t.c - t.a, bc = t.c - t.b;
        const double edge = std::sqrt(std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)}));
        const auto reached = [&](double radius) { return !slowly(mesh, p, radius).empty(); };
        CHECK(reached(sampled * (1 + 1e-12)));
        // The nearest point lies within half a step of the grid of one of its points.
        CHECK_FALSE(
            reached(std::sqrt(std::max(0.0, sampled * sampled - edge * edge / 3600)) - 1e-9));
    }
}

TEST_CASE("distances to the face, an edge and a corner are exact")
{
    Mesh mesh;
    mesh.triangle({0, 0, 0}, {4, 0, 0}, {0, 4, 0});
    const Bvh bvh = built(mesh);
    struct Case {
        glm::dvec3 centre;
        double distance;
    };
    for (const auto& [centre, distance] :
         {Case{{1, 1, 3}, 3}, Case{{1, 1, -0.5}, 0.5}, Case{{2, -3, 4}, 5}, Case{{-2, -3, 6}, 7},
          Case{{7, -4, 0}, 5}, Case{{1, 0, 2}, 2}, Case{{0, 0, 2}, 2}}) {
        CHECK(found(bvh, centre, distance).size() == 1);
        CHECK(found(bvh, centre, std::nextafter(distance, 0)).empty());
    }
    CHECK(found(bvh, {1, 1, 0}, 0).size() == 1);
    CHECK(found(bvh, {0, 0, 0}, 0).size() == 1);
    CHECK(found(bvh, {1, 1, 0x1p-40}, 0).empty());
}

TEST_CASE("a visit ends the query")
{
    const Mesh ball = meshes::icosphere(3);
    const Bvh bvh = built(ball);
    for (const int wanted : {1, 2, 100}) {
        int seen = 0;
        CHECK_FALSE(bvh.in_sphere({0, 0, 0}, 2, [&](std::uint32_t) { return ++seen < wanted; }));
        CHECK(seen == wanted);
        seen = 0;
        CHECK_FALSE(nook::in_sphere_brute_force(ball.view(), {0, 0, 0}, 2,
                                                [&](std::uint32_t) { return ++seen < wanted; }));
        CHECK(seen == wanted);
    }
    int seen = 0;
    CHECK(bvh.in_sphere({0, 0, 0}, 2, [&](std::uint32_t) { return ++seen > 0; }));
    CHECK(seen == 1280);
}

TEST_CASE("spheres that are none reach nothing, and infinite ones everything")
{
    const Mesh ball = meshes::icosphere(1);
    const Bvh bvh = built(ball);
    CHECK(found(bvh, {0, 0, 0}, -1).empty());
    CHECK(found(bvh, {0, 0, 0}, not_a_number).empty());
    CHECK(found(bvh, {not_a_number, 0, 0}, 9).empty());
    CHECK(found(bvh, {0, infinity, 0}, infinity).empty());
    CHECK(found(bvh, {1e30, 0, 0}, infinity).empty());
    CHECK(found(bvh, {0, 0, 0}, infinity).size() == 80);
    CHECK(found(bvh, {1e9, 0, 0}, infinity).size() == 80);
    CHECK(found(bvh, {1e9, 0, 0}, 1e300).size() == 80);
    CHECK(found(bvh, {0, 0, 0}, 0.5).empty());
    CHECK(found(bvh, {0, 0, 0}, 1).size() == 80);
    CHECK(found(Bvh{}, {0, 0, 0}, infinity).empty());
}
