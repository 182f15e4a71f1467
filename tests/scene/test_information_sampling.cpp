#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <nook/scene/information_ao.hpp>
#include <nook/scene/information_sampling.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Camera;
using nook::ErrorCode;
using nook::SamplingOptions;
using nook::SamplingPlan;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;

std::vector<Camera> icosphere_views(const Mesh& mesh, int level, double distance = infinity)
{
    std::vector<glm::dvec3> directions(nook::icosphere_size(level));
    nook::icosphere(level, directions.data());
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh.view());
    std::vector<Camera> views;
    for (const glm::dvec3& d : directions)
        views.push_back(nook::viewpoint_camera(sphere, d, {.distance = distance}));
    return views;
}

struct Planned {
    SamplingPlan plan{};
    std::vector<std::uint8_t> levels;
};
Planned planned(const Mesh& mesh, const std::vector<Camera>& views,
                const SamplingOptions& options = {})
{
    Planned result{{}, std::vector<std::uint8_t>(mesh.indices.size() / 3, 99)};
    REQUIRE(!nook::plan_sampling(mesh.view(), views.data(), views.size(), options, result.plan,
                                 result.levels.data()));
    SamplingPlan again{};
    REQUIRE(!nook::plan_sampling(mesh.view(), views.data(), views.size(), options, again, nullptr));
    CHECK(again.resolution == result.plan.resolution);
    for (const std::uint8_t level : result.levels) CHECK(level <= nook::finest_level);
    return result;
}
double area(const Mesh& mesh, std::size_t t)
{
    const glm::dvec3 a = meshes::vertex_position(mesh, mesh.indices[3 * t]),
                     ab = meshes::vertex_position(mesh, mesh.indices[3 * t + 1]) - a,
                     ac = meshes::vertex_position(mesh, mesh.indices[3 * t + 2]) - a;
    const glm::dvec3 n{ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z,
                       ab.x * ac.y - ab.y * ac.x};
    return std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z) / 2;
}

/// A closed ball of meridians and parallels: its triangles grow smaller towards the poles.
Mesh globe(int rings, int sides)
{
    Mesh mesh;
    const auto at = [&](int ring, int side) {
        return static_cast<std::uint32_t>(1 + (ring - 1) * sides + (side + sides) % sides);
    };
    mesh.vertex({0, 0, 1});
    for (int i = 1; i < rings; ++i)
        for (int j = 0; j < sides; ++j)
            mesh.vertex({std::sin(pi * i / rings) * std::cos(2 * pi * j / sides),
                         std::sin(pi * i / rings) * std::sin(2 * pi * j / sides),
                         std::cos(pi * i / rings)});
    const std::uint32_t last = mesh.vertex({0, 0, -1});
    for (int j = 0; j < sides; ++j) {
        mesh.face(0, at(1, j), at(1, j + 1));
        for (int i = 1; i + 1 < rings; ++i) {
            mesh.face(at(i, j), at(i + 1, j), at(i + 1, j + 1));
            mesh.face(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
        mesh.face(last, at(rings - 1, j + 1), at(rings - 1, j));
    }
    return mesh;
}

std::vector<float> information(const Mesh& mesh, const std::vector<Camera>& views,
                               const nook::InformationOptions& options,
                               nook::InformationReport* report = nullptr)
{
    std::vector<float> pmi(mesh.indices.size() / 3);
    REQUIRE(nook::information_ao(mesh.view(), views.data(), views.size(), {.pmi = pmi.data()},
                                 options, report));
    return pmi;
}
double mean(const std::vector<float>& values)
{
    double sum = 0;
    for (const float value : values) sum += double{value};
    return sum / double(values.size());
}

}  // namespace

TEST_CASE("The resolution is the least that gives almost every polygon its samples")
{
    const Mesh ball = meshes::icosphere(5);
    const auto views = icosphere_views(ball, 0);
    const double radius = nook::bounding_sphere(ball.view()).radius;
    const std::size_t count = ball.indices.size() / 3;
    // A thousandth of the polygons may fall short.
    std::vector<double> areas;
    for (std::size_t t = 0; t < count; ++t) areas.push_back(area(ball, t));
    std::sort(areas.begin(), areas.end());
    const double least = areas[count / 1000];
    for (const double samples : {16.0, 64.0, 400.0, 3000.0}) {
        const auto [plan, levels] = planned(ball, views, {.samples_per_polygon = samples});
        // 16 samples per pixel of width 2 r / resolution.
        const double exact = std::sqrt(samples / (16 * least)) * 2 * radius;
        const int expected = std::max(256, 64 * int(std::ceil(exact / 64)));
        CHECK(plan.resolution == expected);
        CHECK(plan.usable() == count);
        CHECK(plan.below_target <= count / 1000);
    }
    const auto [plan, levels] = planned(ball, views, {.samples_per_polygon = 0});
    CHECK(plan.resolution == 2048);
    CHECK(plan.polygons[0] == count);
}

TEST_CASE("A polygon has the least level that gives it its samples")
{
    std::mt19937 random{2};
    const Mesh mesh = meshes::soup(random, 500);
    const double radius = nook::bounding_sphere(mesh.view()).radius;
    for (const double distance : {infinity, 3.0}) {
        const auto views = icosphere_views(mesh, 0, distance);
        for (const int resolution : {32, 100, 600}) {
            const auto [plan, levels] = planned(mesh, views, {.resolution = resolution});
            CHECK(plan.resolution == resolution);
            // Pixels per unit at the centre: the silhouette of the sphere spans the picture.
            const double pixels =
                resolution / (2 * radius) *
                (distance < infinity ? std::sqrt(distance * distance - 1) / distance : 1);
            std::size_t polygons[3] = {}, below = 0;
            for (std::size_t t = 0; t < levels.size(); ++t) {
                const double samples = area(mesh, t) * pixels * pixels;
                const int expected = samples >= 16 ? 0 : samples >= 4 ? 1 : 2;
                CHECK(levels[t] == expected);
                ++polygons[expected];
                below += samples < 1 ? 1 : 0;
            }
            CHECK(std::equal(polygons, polygons + 3, plan.polygons));
            CHECK(plan.below_target == below);
        }
    }
}

TEST_CASE("What cannot be reached is reported")
{
    const Mesh ball = meshes::icosphere(5);
    const auto views = icosphere_views(ball, 0);
    const auto [plan, levels] = planned(ball, views, {.max_resolution = 30});
    CHECK(plan.resolution == 30);
    CHECK(plan.polygons[2] == plan.usable());
    CHECK(plan.below_target == plan.usable());
    CHECK(planned(ball, views, {.max_resolution = 100, .samples_per_polygon = 1e300})
              .plan.resolution == 100);
    // Two specks among thousands neither raise the resolution nor go unreported.
    Mesh specks = ball;
    for (int i = 0; i < 2; ++i) specks.triangle({0, 0, 0}, {1e-6, 0, 0}, {0, 1e-6, 0});
    const auto with = planned(specks, views);
    CHECK(with.plan.resolution == planned(ball, views).plan.resolution);
    CHECK(with.plan.below_target == 2);
    CHECK(with.levels.back() == 2);
}

TEST_CASE("Unusable triangles, no triangles and no views have a plan")
{
    Mesh mesh;
    mesh.triangle({0, 0, 0}, {1, 1, 1}, {2, 2, 2});
    mesh.triangle({std::numeric_limits<double>::quiet_NaN(), 0, 0}, {1, 0, 0}, {0, 1, 0});
    const auto [plan, levels] = planned(mesh, {});
    CHECK(levels == std::vector<std::uint8_t>{0, 0});
    CHECK(plan.usable() == 0);
    CHECK(plan.resolution == 256);
    CHECK(planned({}, icosphere_views(mesh, 0)).plan.resolution == 256);
    const Mesh ball = meshes::icosphere(1);
    CHECK(planned(ball, {}).plan.below_target == 80);
    // Views that are not drawn do not matter.
    auto views = icosphere_views(ball, 0);
    const auto own = planned(ball, views);
    std::vector<double> importance(12, 1.0);
    views.push_back(views[0]);
    views.back().view_height = 1e6;
    importance.push_back(0);
    CHECK(planned(ball, views, {.resolution = 8, .importance = importance.data()}).levels ==
          planned(ball, icosphere_views(ball, 0), {.resolution = 8}).levels);
    CHECK(own.plan.resolution == 256);
}

TEST_CASE("Too few samples raise the information as predicted, and the plan keeps it down")
{
    // Each polygon of a ball is open: what it has above the least is the pictures' fault.
    const Mesh ball = meshes::icosphere(4);
    const auto views = icosphere_views(ball, 2);
    const double open = 1.278652479555518, polygons = double(ball.indices.size() / 3);
    double before = infinity;
    for (const int resolution : {64, 128, 256}) {
        const double bias =
            mean(information(ball, views, {.resolution = resolution, .samples_per_polygon = 0})) -
            open;
        // The picture of the ball has π/4 R² samples, a polygon that share of them all.
        const double samples = double(views.size()) * pi / 4 * resolution * resolution / polygons;
        const double predicted = double(views.size()) / 2 / (2 * std::log(2.0) * samples);
        CHECK(bias < predicted);
        // Random hits would make it a quarter each time; points of a grid do better.
        CHECK(bias < before / 4);
        if (resolution == 64) CHECK(bias > predicted / 4);
        before = bias;
    }
    CHECK(before < 0.01);
    nook::InformationReport report{};
    CHECK(mean(information(ball, views, {}, &report)) - open < 0.01);
    // Finer levels are worth what more pixels are.
    const double coarse = mean(information(ball, views, {.resolution = 64}, &report));
    CHECK(report.sampling.polygons[2] == ball.indices.size() / 3);
    CHECK(coarse ==
          doctest::Approx(
              mean(information(ball, views, {.resolution = 256, .samples_per_polygon = 0})))
              .epsilon(1e-3));
}

TEST_CASE("Small polygons among large ones keep no dark rims")
{
    const Mesh mesh = globe(24, 300);
    const auto views = icosphere_views(mesh, 2);
    const auto poles = [&](const std::vector<float>& pmi) {
        double sum = 0;
        int count = 0;
        for (std::size_t t = 0; t < pmi.size(); ++t) {
            if (std::fabs(double{mesh.positions[3 * mesh.indices[3 * t] + 2]}) < 0.999) continue;
            sum += double{pmi[t]};
            ++count;
        }
        REQUIRE(count >= 600);
        return sum / count;
    };
    const double open = 1.278652479555518;
    const auto plain = information(mesh, views, {.resolution = 64, .samples_per_polygon = 0});
    CHECK(poles(plain) - open > 0.5);
    nook::InformationReport report{};
    const auto chosen = information(mesh, views, {}, &report);
    CHECK(poles(chosen) - open < 0.05);
    CHECK(report.sampling.polygons[0] > 0);
    CHECK(report.sampling.polygons[2] > 0);
}

TEST_CASE("Arguments that no sampling can be planned for are refused")
{
    const Mesh ball = meshes::icosphere(0);
    auto views = icosphere_views(ball, 0);
    SamplingPlan plan{};
    const auto code = [&](const SamplingOptions& options) {
        return nook::plan_sampling(ball.view(), views.data(), views.size(), options, plan, nullptr)
            .code;
    };
    CHECK(code({.resolution = -1}) == ErrorCode::bad_value);
    CHECK(code({.resolution = 8193}) == ErrorCode::bad_value);
    CHECK(code({.max_resolution = 0}) == ErrorCode::bad_value);
    CHECK(code({.samples_per_polygon = -1}) == ErrorCode::bad_value);
    CHECK(code({.samples_per_polygon = infinity}) == ErrorCode::bad_value);
    CHECK(nook::plan_sampling(ball.view(), nullptr, 1, {}, plan, nullptr).code ==
          ErrorCode::null_data);
    views[3].target = views[3].eye;
    CHECK(code({}) == ErrorCode::bad_value);
    CHECK(plan.resolution == 0);
    CHECK(code({.resolution = 8192}) == ErrorCode::bad_value);
}
