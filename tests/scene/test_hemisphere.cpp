#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <nook/scene/hemisphere.hpp>
#include <nook/scene/sampling.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Bvh;
using nook::detail::Hemisphere;
using nook::detail::Vector3;

constexpr double infinity = std::numeric_limits<double>::infinity();

Bvh built(const Mesh& mesh)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    return bvh;
}

struct Agreement {
    int rays = 0, hits = 0, different = 0;
};
void compare(const Bvh& bvh, const Vector3& start, const Vector3& normal, double radius,
             std::uint32_t seed, Agreement& agreement)
{
    const Hemisphere hemisphere{bvh, start, normal, radius};
    const nook::detail::HemisphereBasis basis{normal};
    const nook::ScrambledSobol points{seed};
    for (std::uint32_t i = 0; i < 32; ++i) {
        const Vector3 d = basis.cosine_direction(points(i));
        const bool hit =
            bvh.occluded({nook::detail::glm_vector(start), nook::detail::glm_vector(d), radius});
        ++agreement.rays;
        agreement.hits += hit;
        agreement.different += hemisphere.occluded(d) != hit;
        if (hemisphere.empty()) agreement.different += hit;
    }
}

}  // namespace

TEST_CASE("a hemisphere of rays hits what its rays hit one by one")
{
    std::mt19937 random{21};
    std::uniform_real_distribution<double> unit{-1, 1};
    Agreement agreement;
    for (int scene = 0; scene < 200; ++scene) {
        const Mesh mesh = meshes::soup(random, 1 + scene % 80, scene % 3 == 0 ? 1e-5 : 1);
        const double extent = scene % 3 == 0 ? 1e-5 : 1;
        const Bvh bvh = built(mesh);
        for (int i = 0; i < 20; ++i) {
            const Vector3 normal = nook::detail::vector(meshes::random_direction(random));
            Vector3 start{unit(random), unit(random), unit(random)};
            start = start * extent;
            const double radius = i % 4 == 0 ? infinity : std::exp(2 * unit(random)) * 0.3 * extent;
            compare(bvh, start, normal, radius, static_cast<std::uint32_t>(i), agreement);
            // On a triangle, lifted along its normal.
            const auto t = static_cast<std::size_t>(i) % mesh.view().triangle_count;
            const auto [a, b, c] = nook::detail::mesh_triangle(mesh.view(), t);
            const Vector3 up = normalised(cross(b - a, c - a));
            const Vector3 middle = (a + b + c) * (1.0 / 3) + up * (1e-9 * extent);
            compare(bvh, middle, up, radius, static_cast<std::uint32_t>(i), agreement);
        }
    }
    CHECK(agreement.different == 0);
    CHECK(agreement.hits > agreement.rays / 20);
    CHECK(agreement.hits < agreement.rays / 2);
}

TEST_CASE("above a floor of any size and cut there is nothing to hit")
{
    std::mt19937 random{22};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (const double size : {1.0, 1e6}) {
        Mesh floor;
        for (int y = 0; y <= 20; ++y)
            for (int x = 0; x <= 20; ++x) floor.vertex({size * (x - 10), 0, size * (y - 10)});
        for (unsigned y = 0; y < 20; ++y)
            for (unsigned x = 0; x < 20; ++x) {
                const unsigned a = y * 21 + x;
                floor.face(a, a + 1, a + 22);
                floor.face(a, a + 22, a + 21);
            }
        const Bvh bvh = built(floor);
        for (int i = 0; i < 200; ++i) {
            // A normal rounded to float, and a little off.
            const Vector3 normal =
                nook::detail::normalised({1e-7 * unit(random), 1, 1e-7 * unit(random)});
            const Vector3 start{9 * unit(random), 1e-7, 9 * unit(random)};
            CHECK(Hemisphere(bvh, start, normal, infinity).empty());
            CHECK(Hemisphere(bvh, start, normal, 1).empty());
            CHECK_FALSE(Hemisphere(bvh, start, -normal, infinity).empty());
        }
    }
}

TEST_CASE("a wall counts when it is within the radius and above the plane")
{
    Mesh mesh;
    mesh.quad({1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1});
    const Bvh bvh = built(mesh);
    const Vector3 up{0, 0, 1};
    CHECK_FALSE(Hemisphere(bvh, {0, 0, 0}, up, 1).empty());
    CHECK(Hemisphere(bvh, {0, 0, 0}, up, 0.9999).empty());
    CHECK(Hemisphere(bvh, {0, 0, 1.5}, up, 9).empty());
    CHECK_FALSE(Hemisphere(bvh, {0, 0, 1.5}, -up, 9).empty());
    CHECK(Hemisphere(Bvh{}, {0, 0, 0}, up, infinity).empty());
    // A slope that rises by 1 in 10000 is not the floor.
    Mesh slope;
    slope.quad({1, -1, 0}, {2, -1, 1e-4}, {2, 1, 1e-4}, {1, 1, 0});
    const Bvh rising = built(slope);
    CHECK_FALSE(Hemisphere(rising, {0, 0, 1e-7}, up, infinity).empty());
    CHECK(rising.occluded({{0, 0, 1e-7}, {1, 0, 3e-5}}));
}
