#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/scene/hemisphere.hpp>
#include <nook/scene/sampling.hpp>

#include "hard_rays.hpp"
#include "meshes.hpp"

namespace {

using hard_rays::Random;
using meshes::Mesh;
using nook::Bvh;
using nook::Hit;
using nook::detail::Bounds;
using nook::detail::Hemisphere;
using nook::detail::HemisphereBasis;
using nook::detail::Neighbourhood;
using nook::detail::RayFan;
using nook::detail::RayMask;
using nook::detail::SceneRay;
using nook::detail::SceneTriangle;
using nook::detail::Vector3;

/// Scene space knows no infinity.
constexpr double infinite = 0x1p64;

Bvh built(const Mesh& mesh)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    return bvh;
}

/// `count` directions about a normal: cosine-weighted, in a narrow beam, close to the horizon, or at
/// corners and edges of triangles.
RayFan fan_of(Random& random, const Vector3& normal, int count, const Vector3& start = {},
              const std::vector<SceneTriangle>& triangles = {})
{
    RayFan fan;
    fan.count = count;
    const HemisphereBasis basis{normal};
    const int shape = random.number(4);
    for (int i = 0; i < count; ++i) {
        Vector3 d = basis.cosine_direction({random.uniform(0, 1), random.uniform(0, 1)});
        if (shape == 1) d = normalised(basis.cosine_direction({0.3, 0.7}) + d * 0.01);
        if (shape > 1 && !triangles.empty() && i % 8 != 0) {
            const int number = random.number(static_cast<int>(triangles.size()));
            const Vector3 at =
                hard_rays::target(random, triangles[static_cast<std::size_t>(number)]);
            const Vector3 aimed = normalised(at - start);
            if (dot(aimed, normal) > 0x1p-16) d = aimed;
        } else if (shape == 2) d = normalised(d + normal * (0x1p-16 - dot(d, normal)));
        fan.direction[0][i] = static_cast<float>(d.x);
        fan.direction[1][i] = static_cast<float>(d.y);
        fan.direction[2][i] = static_cast<float>(d.z);
    }
    fan.complete(normal);
    return fan;
}
SceneRay ray_of(const RayFan& fan, int i, const Vector3& start, double radius)
{
    return {start,
            {double{fan.direction[0][i]}, double{fan.direction[1][i]}, double{fan.direction[2][i]}},
            radius};
}

struct Tally {
    int rays = 0, hits = 0, different = 0, untested_hits = 0, fans = 0, quiet = 0;
};

/// Every ray of a fan against every triangle.
void compare(const std::vector<SceneTriangle>& triangles, const Neighbourhood& around,
             const Vector3& start, const Vector3& normal, double radius, const RayFan& fan,
             Tally& tally)
{
    const Hemisphere hemisphere{around, start, normal, radius};
    Hit slow[RayFan::most];
    RayMask expected = 0;
    for (int i = 0; i < fan.count; ++i) {
        const SceneRay ray = ray_of(fan, i, start, radius);
        for (const SceneTriangle& triangle : triangles) ray.keep_nearest(triangle, slow[i]);
        if (!slow[i]) expected |= RayMask{1} << i;
    }
    Hemisphere::Open open;
    open.rays = fan.all();
    hemisphere.find_open(fan, open);
    Hemisphere::Nearest nearest;
    nearest.rays = fan.all();
    hemisphere.find_nearest(fan, nearest);
    tally.different += open.rays != expected;
    for (int i = 0; i < fan.count; ++i)
        tally.different += nearest.hits[i].face != slow[i].face || nearest.hits[i].t != slow[i].t;
    // Rays that are not asked for stay as they are.
    const RayMask some = fan.all() & 0x5a5a5a5a5a5a5a5au;
    Hemisphere::Open part;
    part.rays = some;
    hemisphere.find_open(fan, part);
    tally.different += part.rays != (expected & some);
    const bool any = expected != fan.all();
    tally.untested_hits += any && (!open.tested || !nearest.tested || hemisphere.nothing_above());
    tally.rays += fan.count;
    tally.hits += std::popcount(fan.all() & ~expected);
    ++tally.fans;
    tally.quiet += !open.tested;
}

/// The whole hierarchy, then the neighbourhood of a box with the start in it.
void compare_both(const std::vector<SceneTriangle>& triangles, const Bvh& bvh, Random& random,
                  const Vector3& start, const Vector3& normal, double radius, Tally& tally)
{
    const RayFan fan = fan_of(random, normal, 1 + random.number(RayFan::most), start, triangles);
    Neighbourhood around{bvh.view()};
    compare(triangles, around, start, normal, radius, fan, tally);
    if (radius > 4) return;
    Bounds box;
    const double c[3] = {start.x, start.y, start.z};
    for (int k = 0; k < 3; ++k) {
        box.low[k] = static_cast<float>(c[k] - radius * random.uniform(0, 1));
        box.high[k] = static_cast<float>(c[k] + radius * random.uniform(0, 1));
        box.low[k] = std::fmin(box.low[k], static_cast<float>(c[k]));
        box.high[k] = std::fmax(box.high[k], static_cast<float>(c[k]));
    }
    around.collect(box, nook::detail::rounded_up(radius));
    compare(triangles, around, start, normal, radius, fan, tally);
}

double radius_of(Random& random, double size, double distance)
{
    switch (random.number(6)) {
    case 0: return infinite;
    case 1: return std::exp2(random.uniform(-40, -10));
    case 2: return distance;
    case 3: return size * std::exp2(random.uniform(-4, 4));
    default: return std::exp2(random.uniform(-5, 1));
    }
}

}  // namespace

TEST_CASE("a fan of rays has the hits that its rays have one by one, in soups of hard triangles")
{
    Random random{21};
    Tally tally;
    for (int number = 0; number < 2500; ++number) {
        const auto [mesh, extent] = hard_rays::scene(random, number);
        CAPTURE(number);

        const Bvh bvh = built(mesh);
        const auto triangles = hard_rays::scene_triangles(mesh, bvh.space());
        if (triangles.empty()) continue;
        for (int i = 0; i < 8; ++i) {
            const int chosen = random.number(static_cast<int>(triangles.size()));
            const SceneTriangle& aim = triangles[static_cast<std::size_t>(chosen)];
            const Vector3 ab = aim.corner(1) - aim.corner(0);
            const double size = largest(ab);
            const Vector3 at = hard_rays::target(random, aim);
            const Vector3 own = normalised(aim.normal());
            Vector3 normal = random.direction(), start = random.vector(1.2);
            switch (random.number(5)) {
            case 0:  // over the triangle, as a shading point is
                normal = own;
                start = at + own * std::exp2(random.uniform(-44, -20));
                break;
            case 1:  // close to a corner, an edge
                start = at + random.vector(size * std::exp2(random.uniform(-20, 2)));
                break;
            case 2:  // in the plane, with any normal
                start = at + ab * random.uniform(-3, 3) + own * random.power(-40, -10);
                break;
            case 3:  // far away
                start = random.direction() * std::exp2(random.uniform(2, 30));
                normal = normalised(-start + random.vector(largest(start)));
                break;
            default: break;
            }
            compare_both(triangles, bvh, random, start, normal,
                         radius_of(random, size, std::sqrt(dot(at - start, at - start)) + 0x1p-50),
                         tally);
        }
    }
    CHECK(tally.different == 0);
    CHECK(tally.untested_hits == 0);
    CHECK(tally.rays > 100000);
    CHECK(tally.hits > tally.rays / 30);
    CHECK(tally.hits < tally.rays / 2);
}

TEST_CASE("starts exactly on corners, edges and planes: the same hits, whole numbers throughout")
{
    // Coordinates of few bits: no test is off, and none may decide a tie in another way.
    Random random{23};
    Tally tally;
    for (int number = 0; number < 150; ++number) {
        Mesh mesh;
        const auto grid = [&] { return random.number(9) / 4.0 - 1; };
        mesh.triangle({-1, -1, -1}, {1, -1, -1}, {0, 1, 1});
        for (int i = 0; i < 1 + number % 40; ++i)
            mesh.triangle({grid(), grid(), grid()}, {grid(), grid(), grid()},
                          {grid(), grid(), grid()});
        const Bvh bvh = built(mesh);
        const auto triangles = hard_rays::scene_triangles(mesh, bvh.space());
        const double scale = bvh.space().scale;
        for (int i = 0; i < 12; ++i) {
            const Vector3 start = bvh.space().to_scene({grid(), grid(), grid()});
            constexpr double none = 0;
            Vector3 normal{none, none, none};
            const double sign = random.number(2) == 0 ? 1 : -1;
            (i % 3 == 0 ? normal.x : i % 3 == 1 ? normal.y : normal.z) = sign;
            compare_both(triangles, bvh, random, start, normal,
                         i % 4 == 0 ? infinite : random.number(8) / 8.0 * scale + 0x1p-30, tally);
        }
    }
    CHECK(tally.different == 0);
    CHECK(tally.untested_hits == 0);
    CHECK(tally.hits > tally.rays / 10);
}

TEST_CASE("where nothing is above the plane, every ray and every segment there is open")
{
    Random random{24};
    int quiet = 0, loud = 0, blocked = 0;
    for (int number = 0; number < 3000; ++number) {
        // Most triangles lie below z = 0 or far off.
        Mesh mesh;
        mesh.quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
        for (int i = 0; i < number % 12; ++i) {
            const double lowered = number % 5 == 0 ? 0.05 : -0.3;
            const auto corner = [&]() -> meshes::Point {
                return {random.uniform(), random.uniform(), lowered - 0.25 * random.uniform(0, 1)};
            };
            mesh.triangle(corner(), corner(), corner());
        }
        const Bvh bvh = built(mesh);
        const auto triangles = hard_rays::scene_triangles(mesh, bvh.space());
        const Neighbourhood around{bvh.view()};
        const Vector3 start{random.uniform(), random.uniform(), 0x1p-40}, up{0, 0, 1};
        const double radius = number % 3 == 0 ? infinite : std::exp2(random.uniform(-6, 0));
        if (!Hemisphere{around, start, up, radius}.nothing_above()) {
            ++loud;
            continue;
        }
        ++quiet;
        const double reach = std::fmin(radius, 2);
        for (int i = 0; i < 24; ++i) {
            // Two points of the half ball; rays and segments from one to the other.
            const auto inside = [&] {
                Vector3 v = random.direction() * (reach * random.uniform(0, 1));
                v.z = std::fabs(v.z);
                return start + v;
            };
            const Vector3 from = i % 2 == 0 ? start : inside(), to = inside();
            const Vector3 way = to - from;
            const double length = std::sqrt(dot(way, way));
            if (!(length > 0)) continue;
            const SceneRay segment{from, normalised(way), length};
            for (const SceneTriangle& triangle : triangles)
                blocked += segment.is_occluded_by(triangle);
            blocked += around.occluded(segment);
        }
    }
    CHECK(blocked == 0);
    CHECK(quiet > 500);
    CHECK(loud > 200);
}

TEST_CASE("above a floor of any size and cut there is nothing to hit")
{
    Random random{22};
    for (const double size : {1.0, 1e6, 1e-12}) {
        CAPTURE(size);
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
        const Neighbourhood around{bvh.view()};
        int tested = 0, seen_from_below = 0;
        for (int i = 0; i < 200; ++i) {
            // A normal rounded to float, and a little off.
            const Vector3 normal =
                nook::detail::normalised({1e-7 * random.uniform(), 1, 1e-7 * random.uniform()});
            const Vector3 start =
                bvh.space().to_scene(Vector3{9 * random.uniform(), 0, 9 * random.uniform()} * size +
                                     Vector3{0, 1e-7 * size, 0});
            RayFan fan = fan_of(random, normal, 64);
            // Rays of the kernel rise by 2^-17 at least.
            for (int k = 0; k < 3; ++k)
                for (int j = 0; j < 64; ++j)
                    if (fan.direction[1][j] < 0x1p-12f) fan.direction[1][j] = 0x1p-12f;
            fan.complete(normal);
            for (const double radius : {infinite, 0.1}) {
                const Hemisphere hemisphere{around, start, normal, radius};
                Hemisphere::Open open;
                open.rays = fan.all();
                hemisphere.find_open(fan, open);
                tested += open.tested || open.rays != fan.all();
            }
            const RayFan down = fan_of(random, -normal, 64);
            Hemisphere::Open open;
            open.rays = down.all();
            Hemisphere{around, start, -normal, infinite}.find_open(down, open);
            seen_from_below += open.tested && open.rays != down.all();
        }
        CHECK(tested == 0);
        CHECK(seen_from_below == 200);
    }
}

TEST_CASE("a wall counts when it is within the radius and above the plane")
{
    Mesh mesh;
    mesh.quad({1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1});
    const Bvh bvh = built(mesh);
    const double scale = bvh.space().scale;
    const Neighbourhood around{bvh.view()};
    const Vector3 up{0, 0, 1};
    const auto nothing = [&](const Vector3& start, const Vector3& normal, double radius) {
        return Hemisphere{around, bvh.space().to_scene(start), normal, radius * scale}
            .nothing_above();
    };
    CHECK_FALSE(nothing({0, 0, 0}, up, 1));
    CHECK(nothing({0, 0, 0}, up, 0.9999));
    CHECK(nothing({0, 0, 1.5}, up, 9));
    CHECK_FALSE(nothing({0, 0, 1.5}, -up, 9));
    const Bvh empty;
    CHECK(Hemisphere{Neighbourhood{empty.view()}, {0, 0, 0}, up, infinite}.nothing_above());
    // A slope that rises by 1 in 10000 is not the floor.
    Mesh slope;
    slope.quad({1, -1, 0}, {2, -1, 1e-4}, {2, 1, 1e-4}, {1, 1, 0});
    const Bvh rising = built(slope);
    CHECK_FALSE(Hemisphere{Neighbourhood{rising.view()}, rising.space().to_scene({0, 0, 1e-7}), up,
                           infinite}
                    .nothing_above());
    CHECK(rising.occluded({{0, 0, 1e-7}, {1, 0, 3e-5}}));
}

TEST_CASE("what rises less than the slack is the surface itself")
{
    // A tilted neighbour whose outer edge lies 2^-22 above the plane, and one 2^-10 above.
    for (const double rise : {0x1p-22, 0x1p-10}) {
        CAPTURE(rise);
        Mesh mesh;
        mesh.quad({-1, -1, 0}, {0, -1, 0}, {0, 1, 0}, {-1, 1, 0});
        mesh.quad({0, -1, 0}, {0.5, -1, rise}, {0.5, 1, rise}, {0, 1, 0});
        const Bvh bvh = built(mesh);
        const Neighbourhood around{bvh.view()};
        const Vector3 start = bvh.space().to_scene({-0x1p-30, 0, 0x1p-44}), up{0, 0, 1};
        // All but along the floor, towards the neighbour.
        RayFan fan;
        fan.count = 8;
        for (int i = 0; i < 8; ++i) {
            const double height = rise / 4, side = 0.1 * i;
            const Vector3 d = normalised(Vector3{1, side, height});
            fan.direction[0][i] = static_cast<float>(d.x);
            fan.direction[1][i] = static_cast<float>(d.y);
            fan.direction[2][i] = static_cast<float>(d.z);
        }
        fan.complete(up);
        const auto open_with = [&](double slack) {
            Hemisphere::Open open;
            open.rays = fan.all();
            Hemisphere{around, start, up, infinite, slack}.find_open(fan, open);
            return open.rays;
        };
        CHECK(open_with(0) == 0);
        CHECK(open_with(0x1p-20) == (rise < 0x1p-20 ? fan.all() : 0));
    }
}
