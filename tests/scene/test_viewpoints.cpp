#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <vector>

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <nook/scene/camera.hpp>
#include <nook/scene/viewpoints.hpp>

#include "meshes.hpp"

namespace {

std::vector<glm::dvec3> sphere(int level)
{
    std::vector<glm::dvec3> directions(nook::icosphere_size(level), {9, 9, 9});
    nook::icosphere(level, directions.data());
    return directions;
}
using Key = std::array<double, 3>;

}  // namespace

TEST_CASE("An icosphere has 12, 42, 162, 642, 2562 vertices of length 1, no two alike")
{
    std::size_t expected = 12;
    for (int level = 0; level <= 5; ++level) {
        const auto directions = sphere(level);
        REQUIRE(directions.size() == expected);
        expected = 4 * expected - 6;
        std::set<Key> distinct;
        double worst = 0;
        for (const glm::dvec3& d : directions) {
            worst = std::max(worst, std::fabs(glm::length(d) - 1));
            distinct.insert({d.x, d.y, d.z});
        }
        CHECK(worst < 3e-16);
        CHECK(distinct.size() == directions.size());
    }
}

TEST_CASE("A finer icosphere begins with the coarser one")
{
    const auto fine = sphere(4);
    for (int level = 0; level < 4; ++level) {
        const auto coarse = sphere(level);
        CHECK(std::equal(coarse.begin(), coarse.end(), fine.begin()));
    }
}

TEST_CASE("An icosphere is its own mirror image, bit for bit, and turns into itself")
{
    const auto directions = sphere(3);
    std::set<Key> all;
    for (const glm::dvec3& d : directions) all.insert({d.x, d.y, d.z});
    for (const glm::dvec3& d : directions) {
        REQUIRE(all.count({-d.x, d.y, d.z}) == 1);
        REQUIRE(all.count({d.x, -d.y, d.z}) == 1);
        REQUIRE(all.count({d.x, d.y, -d.z}) == 1);
        // A third of a turn about (1, 1, 1) maps the golden rectangles onto each other.
        REQUIRE(std::any_of(directions.begin(), directions.end(), [&](const glm::dvec3& other) {
            return glm::length(other - glm::dvec3{d.y, d.z, d.x}) < 1e-15;
        }));
    }
}

TEST_CASE("Neighbours on an icosphere are nearly equally far apart")
{
    const auto directions = sphere(3);
    double nearest = 9, farthest = 0;
    for (const glm::dvec3& a : directions) {
        double least = 9;
        for (const glm::dvec3& b : directions)
            if (a != b) least = std::min(least, glm::length(a - b));
        nearest = std::min(nearest, least);
        farthest = std::max(farthest, least);
    }
    // An edge of the icosahedron spans 1.107 radians, in eight parts.
    CHECK(nearest > 0.12);
    CHECK(farthest < 0.17);
}

TEST_CASE("An open facet has the mutual information with an icosphere that quadrature gives")
{
    const double expected[] = {1.625543772498, 1.406901894448, 1.319268059511,
                               1.290996232305, 1.282517083317, 1.280057962658};
    for (int level = 0; level <= 5; ++level) {
        const auto directions = sphere(level);
        double sum = 0, information = 0;
        for (const glm::dvec3& d : directions) sum += std::max(d.z, 0.0);
        for (const glm::dvec3& d : directions) {
            const double p = std::max(d.z, 0.0) / sum;
            if (p > 0) information += p * std::log2(p * double(directions.size()));
        }
        CHECK(information == doctest::Approx(expected[level]).epsilon(1e-12));
    }
}

TEST_CASE("A bounding sphere holds every usable triangle and nothing else counts")
{
    meshes::Mesh mesh;
    mesh.box({-1, -2, -3}, {3, 2, 1});
    auto sphere = nook::bounding_sphere(mesh.view());
    CHECK(sphere.centre == glm::dvec3{1, 0, -1});
    CHECK(sphere.radius == doctest::Approx(std::sqrt(12.0)).epsilon(1e-11));
    CHECK(sphere.radius >= std::sqrt(12.0));

    const float nan = std::numeric_limits<float>::quiet_NaN();
    mesh.triangle({nan, 0, 0}, {50, 0, 0}, {0, 50, 0});
    mesh.triangle({70, 0, 0}, {70, 0, 0}, {70, 9, 0});  // without area
    mesh.vertex({1000, 0, 0});                          // of no triangle
    sphere = nook::bounding_sphere(mesh.view());
    CHECK(sphere.centre == glm::dvec3{1, 0, -1});

    CHECK(nook::bounding_sphere({}).radius == 0);
    meshes::Mesh poisoned;
    poisoned.triangle({nan, 0, 0}, {1, 0, 0}, {0, 1, 0});
    CHECK(nook::bounding_sphere(poisoned.view()).radius == 0);
}

TEST_CASE("A viewpoint's picture just holds the sphere")
{
    const nook::BoundingSphere ball{{5, -3, 2}, 4};
    for (const double distance : {std::numeric_limits<double>::infinity(), 1.25, 3.0, 50.0})
        for (const glm::dvec3& direction : sphere(1)) {
            const nook::Camera camera = nook::viewpoint_camera(ball, direction, {distance});
            REQUIRE(!nook::check_camera(camera));
            const nook::Projection projection = nook::projection(camera, 100, 100);
            const nook::ViewFrame frame = nook::view_frame(camera);
            double left = 100, right = 0, bottom = 0, nearest = 1e30;
            for (const glm::dvec3& point : sphere(4)) {
                const glm::dvec3 view =
                    nook::point_to_view(frame, ball.centre + point * ball.radius);
                const double w = projection.orthographic ? 1 : -view.z;
                const double x = projection.cx + projection.fx * view.x / w;
                left = std::min(left, x);
                right = std::max(right, x);
                bottom = std::max(bottom, projection.cy - projection.fy * view.y / w);
                nearest = std::min(nearest, -view.z);
            }
            CHECK(nearest > 0);
            CHECK(left > -1e-9);
            CHECK(right < 100 + 1e-9);
            CHECK(bottom < 100 + 1e-9);
            CHECK(left < 0.5);
            CHECK(right > 99.5);
            CHECK(bottom > 99.5);
        }
}

TEST_CASE("A viewpoint around nothing is a camera all the same")
{
    CHECK(!nook::check_camera(nook::viewpoint_camera({}, {0, 0, 1})));
    CHECK(!nook::check_camera(nook::viewpoint_camera({{0, 0, 0}, 1e-20}, {0, 1e-200, 0}, {2})));
}
