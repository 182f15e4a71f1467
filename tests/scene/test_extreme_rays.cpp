#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <nook/scene/flat_land.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "closed_forms.hpp"
#include "meshes.hpp"

/// Stiff and extreme scenes for rays, numbered on from those of the depth kernels. Each has one right
/// answer, and never a NaN.
namespace {

using namespace closed_forms;
using nook::Bvh;
using nook::ExponentialFalloff;
using nook::Image;
using nook::SecondaryRays;
using nook::StepFalloff;
using nook::TracedImages;
using nook::TracedOptions;

using Secondary = TracedOptions<StepFalloff, SecondaryRays>;
using Exponential = TracedOptions<ExponentialFalloff>;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr glm::dvec3 up{0, 0, 1};

bool is_share(double v) { return v >= 0 && v <= 1; }

/// A mesh of triangles around (0, 0, 1), in front of a point at zero.
Mesh cloud(int triangles, unsigned seed)
{
    std::mt19937 random{seed};
    return meshes::soup(random, triangles, 0.7).transformed(1, {0, 0, 1});
}

}  // namespace

TEST_CASE("36: an empty scene is 1, to any call")
{
    const Bvh nothing, none = built({});
    Points points;
    for (int i = 0; i < 5; ++i) points.add({0.1 * i, 0, 0}, up);
    for (const Bvh* bvh : {&nothing, &none}) {
        Results<float> results{5, 1};
        const nook::Outcome done = nook::traced_ao(
            *bvh, points.view(),
            TracedImages{results.visibility.view(), results.bents(), results.radiances(),
                         results.weight.view()},
            TracedOptions<ExponentialFalloff, SecondaryRays, White>{.radius = 3, .directions = 16});
        REQUIRE(done);
        CHECK(done.work.rays == 0);
        CHECK(done.work.skipped_rays > 0);
        for (int i = 0; i < 5; ++i) {
            CHECK(results.visibility(i, 0) == 1);
            CHECK(results.weight(i, 0) == 16);
            for (int k = 0; k < 3; ++k) CHECK(results.radiance(3 * i + k, 0) == 0);
            CHECK(results.bent(3 * i + 2, 0) > 0.9f);
        }
        CHECK(nook::traced_visibility(*bvh, {0, 0, 0}, up, {}) == 1);
    }
}

TEST_CASE("37: points exactly on vertices and edges do not hide themselves")
{
    // On a convex body with an outward normal, all of it below: exactly 1.
    for (const Mesh& body :
         {meshes::icosphere(0), meshes::icosphere(2, 1e5), meshes::icosphere(1, 1e-6)}) {
        const Bvh bvh = built(body);
        Points points;
        for (std::size_t i = 0; i < body.positions.size() / 3; ++i) {
            const glm::dvec3 p = meshes::vertex_position(body, i);
            points.add(p, p);
        }
        for (std::size_t t = 0; t < body.indices.size(); t += 3)
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec3 a = meshes::vertex_position(body, body.indices[t + k]),
                                 b = meshes::vertex_position(body, body.indices[t + (k + 1) % 3]);
                points.add((a + b) / 2.0, a + b);
            }
        Image<double> result{points.count(), 1};
        REQUIRE(
            nook::traced_ao(bvh, points.view(), result.view(), TracedOptions<>{.directions = 64}));
        // The normals of a vertex look over the facets around it: steep ones stand above no tangent plane.
        for (const double v : result) CHECK(v == 1);
    }
    // In a soup anything may hide a vertex; it stays a share.
    const Mesh mesh = cloud(200, 71);
    const Bvh bvh = built(mesh);
    for (std::size_t i = 0; i < mesh.positions.size() / 3; i += 3) {
        const glm::dvec3 p = meshes::vertex_position(mesh, i);
        CHECK(is_share(nook::traced_visibility(bvh, p, up, {.directions = 16})));
        CHECK(is_share(
            nook::traced_visibility(bvh, p, -up, Secondary{.radius = 1, .directions = 16})));
    }
}

TEST_CASE("38: a closed box is exactly 0 for every number of directions")
{
    Mesh box;
    box.box({-1, -2, -3}, {3, 2, 1});
    const Bvh bvh = built(box);
    for (int count = 1; count <= 130; ++count)
        for (const auto set : {nook::DirectionSet::scrambled_sobol, nook::DirectionSet::spun,
                               nook::DirectionSet::r2}) {
            CHECK(nook::traced_visibility(bvh, {0, 0, 0}, up, {.directions = count, .set = set}) ==
                  0);
            // On its walls and in its corners, from within.
            CHECK(nook::traced_visibility(bvh, {0, 0, -3}, up, {.directions = count, .set = set}, 1,
                                          1e-6) == 0);
            CHECK(nook::traced_visibility(bvh, {-1, -2, -3}, {1, 1, 1},
                                          {.directions = count, .set = set}, 2, 1e-6) == 0);
        }
}

TEST_CASE("39: a radius of 0 is 1, one that is denormal is 1, an infinite one sees all")
{
    const Mesh mesh = cloud(300, 72);
    const Bvh bvh = built(mesh);
    for (const double radius : {0.0, 5e-324, 1e-310, 1e-200}) {
        CAPTURE(radius);
        CHECK(nook::traced_visibility(bvh, {0, 0, 0}, up, {.radius = radius}) == 1);
        CHECK(nook::traced_visibility(bvh, {0, 0, 0}, up, Secondary{.radius = radius}) == 1);
        CHECK(nook::traced_visibility(bvh, {0, 0, 0}, up, Exponential{.radius = radius}) == 1);
    }
    const double all = nook::traced_visibility(bvh, {0, 0, 0}, up, {});
    CHECK(all < 0.9);
    for (const double radius : {10.0, 1e10, 1e300})
        CHECK(nook::traced_visibility(bvh, {0, 0, 0}, up, {.radius = radius}) == all);
    // A scene so small that its sizes are denormal.
    const Bvh tiny = built(mesh.transformed(0x1p-130, {0, 0, 0}));
    CHECK(is_share(nook::traced_visibility(tiny, {0, 0, 0}, up, {})));
#if !defined(__FAST_MATH__)
    CHECK(nook::traced_visibility(tiny, {0, 0, 0}, up, {}) < 0.9);
#endif
}

TEST_CASE(
    "40: sigma of 0 lets nothing through a hit, an infinite one everything, 1e-9 keeps its digits")
{
    // Images and series: test_obscurance.cpp. Here: next to the point and far away.
    for (const double height : {1e-30, 1e-3, 1.0, 1e30}) {
        CAPTURE(height);
        Mesh box;
        box.box({-height, -height, -height}, {height, height, height});
        const Bvh bvh = built(box);
        const auto open = [&](double sigma) {
            return nook::traced_visibility(bvh, {0, 0, 0}, up,
                                           Exponential{.directions = 64, .falloff = {sigma}});
        };
        CHECK(open(0) == 0);
        CHECK(open(infinity) == 1);
        // Walls stand between 1 and √3 away.
        CHECK(open(1e-9 / height) >= 1e-9 * (1 - 1e-8));
        CHECK(open(1e-9 / height) <= 1.8e-9);
        CHECK(open(1e300) > 0.999);
        CHECK(is_share(open(5e-324)));
    }
    CHECK(ExponentialFalloff{1e-9}(1) == -std::expm1(-1e-9));
    CHECK(std::fabs(ExponentialFalloff{1e-9}(1) / (1e-9 - 5e-19) - 1) < 1e-15);
}

TEST_CASE("41, 42: a wall at the radius, one step nearer, one farther, and seven digits beyond")
{
    for (const double distance : {1.0, 0.5, 0.1}) {
        CAPTURE(distance);
        Mesh mesh;
        wall(mesh, distance);
        const Bvh bvh = built(mesh);
        const double at = double{static_cast<float>(distance)};
        for (const double radius : {std::nextafter(at, 0.0), at, std::nextafter(at, 9.0),
                                    at * 1.0000002, at * (1 + 1e-12)})
            // The share hidden is below 2e-10: of 1e4 directions none.
            CHECK(nook::traced_visibility(bvh, {0, 0, 0}, up,
                                          {.radius = radius, .directions = 10000}) == 1);
    }
    // Straight above, a hit at the radius counts.
    Mesh mesh;
    ceiling(mesh, 1);
    const Bvh bvh = built(mesh);
    CHECK(bvh.occluded({{0, 0, 0}, up, 1}));
    CHECK_FALSE(bvh.occluded({{0, 0, 0}, up, std::nextafter(1.0, 0.0)}));
}

TEST_CASE("43: triangles of size 1 a million units from zero do not hide the surface they are")
{
    // Steps of 1/16. Flat floors of whole coordinates are flat; points on them are off by a step or less.
    Mesh mesh;
    for (int y = 0; y <= 24; ++y)
        for (int x = 0; x <= 24; ++x) mesh.vertex({1e6 + x, -1e6 + y, 1e6});
    for (unsigned y = 0; y < 24; ++y)
        for (unsigned x = 0; x < 24; ++x) {
            const unsigned a = y * 25 + x;
            mesh.face(a, a + 1, a + 26);
            mesh.face(a, a + 26, a + 25);
        }
    const Bvh bvh = built(mesh);
    Points points;
    for (int i = 0; i < 200; ++i) points.add({1e6 + 0.11 * i, -1e6 + 0.1 * i, 1e6}, up);
    Image<double> result{200, 1};
    REQUIRE(nook::traced_ao(bvh, points.view(), result.view(), TracedOptions<>{.directions = 64}));
    CHECK(std::all_of(result.begin(), result.end(), [](double v) { return v == 1; }));
    // A hilly one: rounding makes dents, and hides a little, not all.
    for (std::size_t i = 2; i < mesh.positions.size(); i += 3)
        mesh.positions[i] += static_cast<float>(0.1 * std::sin(0.7 * double(i)));
    const Bvh hilly = built(mesh);
    REQUIRE(nook::traced_ao(hilly, points.view(0.1), result.view(),
                            TracedOptions<>{.radius = 5, .directions = 64}));
    double sum = 0;
    for (const double v : result) {
        CHECK(is_share(v));
        sum += v / 200;
    }
    CHECK(sum > 0.8);
}

TEST_CASE(
    "44: a hundred thousand duplicates, coincident centroids, and nothing but degenerate triangles")
{
    // A million coincident centroids: test_bvh_build.cpp.
    Mesh one;
    ceiling(one, 1);
    Mesh many = one;
    for (int i = 0; i < 50000; ++i)
        for (const std::uint32_t t : {0u, 1u}) many.face(0, t + 1, t + 2);
    const Bvh single = built(one), copies = built(many);
    Mesh crossed;
    for (int i = 0; i < 20000; ++i) {
        const double a = 0.001 * i, x = std::cos(a), y = std::sin(a);
        crossed.triangle({x, y, 1}, {-x / 2 - y, x - y / 2, 1.1}, {y - x / 2, -x - y / 2, 0.9});
    }
    Mesh degenerate;
    for (int i = 0; i < 1000; ++i)
        degenerate.triangle({0, 0, 1.0 * i}, {0, 0, 1.0 * i}, {1, 1, 1.0 * i});
    for (const double radius : {2.0, infinity}) {
        const TracedOptions<> options{.radius = radius, .directions = 256};
        CHECK(nook::traced_visibility(copies, {0, 0, 0}, up, options) ==
              nook::traced_visibility(single, {0, 0, 0}, up, options));
        const double open = nook::traced_visibility(built(crossed), {0, 0, 0}, up, options);
        CHECK(is_share(open));
        CHECK(open < 0.9);
        CHECK(nook::traced_visibility(built(degenerate), {0, 0, 0}, up, options) == 1);
    }
}

TEST_CASE("45: a vertex that is not a number takes its triangles along, and no others")
{
    const Mesh good = cloud(150, 73);
    const Bvh bvh = built(good);
    for (const double bad : {not_a_number, infinity, -infinity}) {
        Mesh mesh = good;
        mesh.triangle({0, 0, 1}, {1, bad, 1}, {0, 1, 1});
        mesh.triangle({bad, bad, bad}, {bad, bad, bad}, {bad, bad, bad});
        const Bvh spoilt = built(mesh);
        CHECK(spoilt.dropped() == 2);
        for (std::uint32_t i = 0; i < 20; ++i) {
            const glm::dvec3 p{0.05 * i, -0.02 * i, 0};
            CHECK(nook::traced_visibility(spoilt, p, up, {.directions = 64}, i) ==
                  nook::traced_visibility(bvh, p, up, {.directions = 64}, i));
        }
    }
}

TEST_CASE("46: triangles across 1e18 and 1e30 hide as a plane does")
{
    for (const double span : {1e6, 1e18, 1e30}) {
        CAPTURE(span);
        const double height = span * 1e-6;
        Mesh mesh;
        mesh.triangle({-span, -span, height}, {span, -span, height}, {0, span, height});
        const Bvh bvh = built(mesh);
        CHECK(nook::traced_visibility(bvh, {0, 0, 0}, up, {.directions = 1024}) < 2e-3);
        // Under a ceiling: (h / R)².
        CHECK(std::fabs(nook::traced_visibility(bvh, {0, 0, 0}, up,
                                                {.radius = 2 * height, .directions = 1024}) -
                        0.25) < 5 * 2.2e-3);
        // What is 2^44 times smaller than the scene drowns in its rounding.
        mesh.triangle({-2, -2, 1}, {2, -2, 1}, {0, 2, 1});
        CHECK(is_share(nook::traced_visibility(built(mesh), {0, 0, 0}, up, {.radius = 2})));
    }
}

TEST_CASE("47: directions along the axes and in the planes of nodes")
{
    // Single rays: test_bvh.cpp, test_traversal.cpp. Here: normals along the axes over boxes on a grid,
    // points in the planes of their faces and on their edges.
    Mesh mesh;
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x)
                mesh.box({x * 2.0, y * 2.0, z * 2.0}, {x * 2.0 + 1, y * 2.0 + 1, z * 2.0 + 1});
    const Bvh bvh = built(mesh);
    std::uint32_t sample = 0;
    int off = 0, between = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0})
            for (double a = -1; a <= 6; a += 0.5)
                for (double b = -1; b <= 6; b += 0.5) {
                    glm::dvec3 normal{0, 0, 0}, p{a, b, 1.5};
                    normal[axis] = sign;
                    if (axis == 0) p = {1.5, a, b};
                    if (axis == 1) p = {a, 1.5, b};
                    const TracedOptions<> options{.directions = 32};
                    const double open = nook::traced_visibility(bvh, p, normal, options, ++sample);
                    // The oracle, ray by ray.
                    std::vector<float> xyz(3 * 32);
                    nook::traced_directions(options, normal, sample, xyz.data());
                    double most = 0;
                    for (int k = 0; k < 3; ++k) most = std::fmax(most, std::fabs(p[k]));
                    const glm::dvec3 start = p + normal * (0x1p-44 * (most + 2 * bvh.size()));
                    int hits = 0;
                    for (std::size_t i = 0; i < xyz.size(); i += 3)
                        hits += nook::occluded_brute_force(
                            mesh.view(), {start, {xyz[i], xyz[i + 1], xyz[i + 2]}});
                    off += open != (32 - hits) / 32.0;
                    between += hits > 0 && hits < 32;
                }
    CHECK(off == 0);
    CHECK(between > 300);
}

TEST_CASE("48: the false highlight under a curtain exists without secondary rays, and only without")
{
    // The whole profile: test_curtain.cpp. Width 1, 5 above the ground, radius 25.
    Mesh mesh;
    mesh.box({-0.5, -60, 5}, {0.5, 60, 60});
    const Bvh bvh = built(mesh);
    constexpr int count = 16384;
    const auto plain = [&](double t) {
        return nook::traced_visibility(bvh, {t, 0, 0}, up, {.radius = 25, .directions = count});
    };
    CHECK(std::fabs(plain(0.5) - 0.90228568) < 5 * 2.8e-4);
    CHECK(std::fabs(plain(6) - 0.74200264) < 5 * 2.8e-4);
    double last = 0;
    struct Row {
        double t, open;
    };
    for (const Row& row : {Row{0, 0.4220}, {0.5, 0.4280}, {2, 0.4534}, {6, 0.5053}, {9, 0.5690}}) {
        CAPTURE(row.t);
        const double open = nook::traced_visibility(
            bvh, {row.t, 0, 0}, up,
            Secondary{.radius = 25, .directions = count, .secondary = {.radius = 12.5}});
        CHECK(std::fabs(open - row.open) < 5 * 2.8e-4 + 1e-4);
        CHECK(open > last);
        last = open;
    }
}

TEST_CASE("49: secondary rays of a primary along the normal take a fixed axis, and stay finite")
{
    // One direction, over all samples and normals: some lie within 1e-3 of the normal.
    const Bvh bvh = built(cloud(100, 74));
    std::mt19937 random{75};
    double closest = 0, sum = 0;
    for (std::uint32_t i = 0; i < 20000; ++i) {
        const Secondary options{.radius = 1.2, .directions = 1};
        const glm::dvec3 normal = i % 2 == 0 ? up : meshes::random_direction(random);
        const double open = nook::traced_visibility(bvh, {0, 0, 0}, normal, options, i);
        CHECK(is_share(open));
        sum += open;
        float d[3];
        nook::traced_directions(options, normal, i, d);
        closest = std::fmax(
            closest, double{d[0]} * normal.x + double{d[1]} * normal.y + double{d[2]} * normal.z);
    }
    CHECK(closest > 1 - 1e-4);
    CHECK(sum < 19000);
    // Exactly along it, by hand: a ceiling of two strips leaves the primary open and stops one segment.
    Mesh strips;
    strips.quad({0.25, -9, 0.5}, {0.25, 9, 0.5}, {0.25, 9, 1.5}, {0.25, -9, 1.5});
    strips.quad({-9, 0.25, 0.5}, {9, 0.25, 0.5}, {9, 0.25, 1.5}, {-9, 0.25, 1.5});
    const Bvh walls = built(strips);
    double least = 1, most = 0;
    for (std::uint32_t i = 0; i < 4000; ++i) {
        const Secondary options{.radius = 2, .directions = 1};
        float d[3];
        nook::traced_directions(options, up, i, d);
        if (d[2] < 1 - 1e-3f) continue;
        const double open = nook::traced_visibility(walls, {0, 0, 0}, up, options, i);
        least = std::fmin(least, open);
        most = std::fmax(most, open);
    }
    // Both segments, ±1 at a height of 1, meet a wall a quarter away, however they are turned.
    CHECK(least == 0);
    CHECK(most <= 0.5);
}

TEST_CASE("50: secondary rays of radius 0 give the plain result bit for bit")
{
    // Images: test_shading_points.cpp.
    const Bvh bvh = built(cloud(100, 76));
    for (std::uint32_t i = 0; i < 200; ++i)
        for (const bool half_rays : {false, true}) {
            const double plain =
                nook::traced_visibility(bvh, {0, 0, 0}, up, {.radius = 1, .directions = 33}, i);
            CHECK(nook::traced_visibility(
                      bvh, {0, 0, 0}, up,
                      Secondary{.radius = 1,
                                .directions = 33,
                                .secondary = {.radius = 0, .half_rays = half_rays, .jitter = 1}},
                      i) == plain);
        }
}

TEST_CASE("51: any number of directions but none: 0 and less are refused")
{
    const Bvh bvh = built(cloud(100, 77));
    Points points;
    points.add({0, 0, 0}, up);
    for (const int count : {1, 3, 5, 6, 7, 100, 1000}) {
        double sum = 0;
        for (std::uint32_t i = 0; i < 64; ++i) {
            const double open =
                nook::traced_visibility(bvh, {0, 0, 0}, up, {.directions = count}, i);
            CHECK(open * count == doctest::Approx(std::round(open * count)));
            sum += open / 64;
        }
        const double many = nook::traced_visibility(bvh, {0, 0, 0}, up, {.directions = 1 << 16});
        // Five times 1/2 over the root of the number of directions.
        CHECK(std::fabs(sum - many) < 2.5 / std::sqrt(64.0 * count));
    }
    for (const int count : {0, -1, std::numeric_limits<int>::min()}) {
        Image<float> result{1, 1, -7};
        const nook::Outcome outcome = nook::traced_ao(bvh, points.view(), result.view(),
                                                      TracedOptions<>{.directions = count});
        CHECK(outcome.error.code == nook::ErrorCode::bad_value);
        CHECK(outcome.error.value == count);
        CHECK(result(0, 0) == -7);
    }
}

TEST_CASE("52: the same seed gives the same bits on one thread and on many, another seed others")
{
    // All images and all numbers of threads: test_shading_points.cpp.
    const Bvh bvh = built(cloud(200, 78));
    Points points;
    for (int i = 0; i < 2000; ++i) points.add({0.0005 * i - 0.5, 0.0003 * i - 0.3, 0}, up);
    const auto trace = [&](std::uint32_t seed, auto&& executor) {
        Image<float> result{2000, 1};
        REQUIRE(nook::traced_ao(
            bvh, points.view(), result.view(),
            Secondary{.radius = 1.5, .directions = 16, .seed = seed, .secondary = {.jitter = 1}},
            nook::HeapScratch{}, executor));
        return result;
    };
    const Image<float> one = trace(9, nook::Serial{});
    for (const int workers : {2, 3, 5, 16}) {
        nook::ThreadExecutor threads{workers};
        CHECK(trace(9, threads) == one);
    }
    CHECK(trace(10, nook::Serial{}) != one);
}
