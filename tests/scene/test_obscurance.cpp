#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>

#include "closed_forms.hpp"
#include "meshes.hpp"

namespace {

using namespace closed_forms;
using nook::absent;
using nook::Bvh;
using nook::DirectionSet;
using nook::ExponentialFalloff;
using nook::Image;
using nook::NoColour;
using nook::NoSecondaryRays;
using nook::SecondaryRays;
using nook::StepFalloff;
using nook::TracedImages;
using nook::TracedOptions;

using Exponential = TracedOptions<ExponentialFalloff>;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;
constexpr int directions = 16384;
/// Five times the spread of stratified estimates of what has an edge, 0.40 N^(-3/4); an exponential
/// falloff only makes the edge lower.
constexpr double edged = 5 * 2.8e-4;
/// Five times the spread over scrambled nets of what has none: 5.4e-8 for a ceiling with sigma h = 1. The
/// smaller sigma, the steeper the end at the horizon, and that of a wall is steeper still.
constexpr double smooth = 5 * 5.4e-8, steep = 5e-6;

double visibility(const Mesh& mesh, double sigma, const glm::dvec3& point = {0, 0, 0},
                  const glm::dvec3& normal = {0, 0, 1}, double error = 0)
{
    return nook::traced_visibility(
        built(mesh), point, normal,
        Exponential{.directions = directions, .seed = 5, .falloff = {sigma}}, 17, error);
}

/// Half red, half blue, with holes: what is not a number has no colour.
struct Checked {
    glm::vec3 operator()(std::uint32_t face) const
    {
        constexpr float nan = std::numeric_limits<float>::quiet_NaN();
        return face % 3 == 0 ? glm::vec3{1, 0, nan} : glm::vec3{0.25f, 0.5f, 0.75f};
    }
};

/// A room with things in it; the last two triangles are the floor.
Mesh clutter()
{
    std::mt19937 random{51};
    Mesh mesh = meshes::soup(random, 60);
    mesh.quad({-3, -3, -1}, {3, -3, -1}, {3, 3, -1}, {-3, 3, -1});
    return mesh;
}
Points points_of(const Mesh& mesh, int count)
{
    Points points;
    for (int i = 0; i < count; ++i) {
        const auto t = static_cast<std::size_t>(i) % mesh.view().triangle_count;
        const auto [a, b, c] = nook::detail::mesh_triangle(mesh.view(), t);
        const double u = 0.2 + 0.1 * (i % 4), v = 0.3;
        const auto p = a * (1 - u - v) + b * u + c * v;
        const auto n = normalised(cross(b - a, c - a));
        points.add(glm_vector(p), glm_vector(i % 2 == 0 ? n : -n));
    }
    return points;
}

}  // namespace

TEST_CASE("exponential falloff: a wall")
{
    struct Case {
        double distance, sigma, occlusion;
    };
    for (const Case& c : {Case{1, 1, 0.05757678092029},
                          {1, 0.1, 0.3412845737082},
                          {0.5, 3, 0.02646647334558},
                          {2, 2, 0.0009218047424883}}) {
        CAPTURE(c.distance);
        CAPTURE(c.sigma);
        Mesh mesh;
        wall(mesh, c.distance);
        CHECK(std::fabs(visibility(mesh, c.sigma) - (1 - c.occlusion)) < steep);
    }
}

TEST_CASE("exponential falloff: a ceiling and discs")
{
    struct Case {
        double height, sigma, occlusion;
    };
    for (const Case& c :
         {Case{1, 1, 0.2193839343955}, {1, 0.1, 0.8325829158166}, {2, 3, 0.0005692073945239}}) {
        CAPTURE(c.height);
        CAPTURE(c.sigma);
        Mesh mesh;
        ceiling(mesh, c.height);
        CHECK(std::fabs(visibility(mesh, c.sigma) - (1 - c.occlusion)) <
              (c.sigma < 1 ? steep : smooth));
    }
    struct Disc {
        double radius, height, sigma, occlusion;
    };
    for (const Disc& c : {Disc{1, 1, 1, 0.1559891197279},
                          {1, 2, 0.5, 0.06962797521167},
                          {3, 0.5, 2, 0.2193699095841}}) {
        CAPTURE(c.radius);
        Mesh mesh;
        disc(mesh, c.radius, c.height);
        CHECK(std::fabs(visibility(mesh, c.sigma) - (1 - c.occlusion)) < edged);
    }
}

TEST_CASE("exponential falloff: a sphere, above the floor and half below it")
{
    struct Case {
        double degrees, sigma, occlusion;
    };
    for (const Case& c :
         {Case{0, 1, 0.07603319471166}, {75, 1, 0.02116496114671}, {90, 0.5, 0.01541113651328}}) {
        CAPTURE(c.degrees);
        const double angle = c.degrees * pi / 180;
        const Mesh ball = meshes::icosphere(5, 1, {2 * std::sin(angle), 0, 2 * std::cos(angle)});
        CHECK(std::fabs(visibility(ball, c.sigma) - (1 - c.occlusion)) < edged);
    }
}

TEST_CASE("exponential falloff: a groove and a corner")
{
    struct Groove {
        double degrees, occlusion;
    };
    for (const Groove& c :
         {Groove{60, 0.1512270703437}, {90, 0.05757678092029}, {120, 0.01951356355692}}) {
        CAPTURE(c.degrees);
        Mesh mesh;
        groove(mesh, c.degrees, 1);
        CHECK(std::fabs(visibility(mesh, 1) - (1 - c.occlusion)) < 3e-5);
    }
    struct Corner {
        double a, b, sigma, occlusion;
    };
    for (const Corner& c : {Corner{1, 1, 1, 0.1047116861538}, {0.5, 1, 2, 0.06726047843}}) {
        CAPTURE(c.a);
        Mesh mesh;
        corner(mesh, c.a, c.b);
        CHECK(std::fabs(visibility(mesh, c.sigma) - (1 - c.occlusion)) < 3e-5);
    }
}

TEST_CASE("exponential falloff: a dome, a sphere from within, a bowl, a paraboloid")
{
    // Facets lie up to 1.5e-4 of the radius within the dome.
    for (const auto& [radius, sigma] : {std::pair{1.0, 1.0}, {2.0, 0.25}}) {
        Mesh dome;
        revolve(dome, 64, 256, [&, r = radius](double s) {
            return std::pair{r * std::sin(s * pi / 2), r * std::cos(s * pi / 2)};
        });
        CHECK(std::fabs(visibility(dome, sigma) + std::expm1(-sigma * radius)) < 2e-4);
    }
    const auto bowl = [](double gamma, double radius) {
        Mesh mesh;
        revolve(mesh, 128, 256, [&](double s) {
            return std::pair{radius * std::sin(s * gamma), -radius * std::cos(s * gamma)};
        });
        return mesh;
    };
    struct Ball {
        double radius, sigma, occlusion;
    };
    for (const Ball& c :
         {Ball{1, 1, 0.2969970751451}, {1, 0.1, 0.8761548153211}, {2, 2, 0.0311556511359}}) {
        CAPTURE(c.sigma);
        // From its lowest point, a vertex.
        CHECK(std::fabs(visibility(bowl(pi, c.radius), c.sigma, {0, 0, -c.radius}) -
                        (1 - c.occlusion)) < edged);
    }
    CHECK(std::fabs(visibility(bowl(pi / 2, 1), 1, {0, 0, -1}) - (1 - 0.2065321412445)) < edged);
    CHECK(std::fabs(visibility(bowl(pi / 3, 1), 2, {0, 0, -1}) - (1 - 0.07424926878627)) < edged);
    for (const auto& [sigma, occlusion] :
         {std::pair{1.0, 0.2979081940277}, {5.0, 0.05159074374018}}) {
        Mesh mesh;
        revolve(mesh, 400, 256, [](double s) {
            const double rho = 0.01 * std::expm1(s * std::log(1e5));
            return std::pair{rho, rho * rho};
        });
        CHECK(std::fabs(visibility(mesh, sigma) - (1 - occlusion)) < edged);
    }
}

TEST_CASE(
    "sigma of 0 is the step, an infinite one lets everything through, a tiny one keeps its digits")
{
    const Mesh mesh = clutter();
    const Bvh bvh = built(mesh);
    const Points points = points_of(mesh, 100);
    const auto run = [&](const auto& options) {
        Image<double> result{100, 1, -7};
        REQUIRE(nook::traced_ao(bvh, points.view(), result.view(), options));
        return result;
    };
    const auto step = run(TracedOptions<>{.radius = 0.8, .directions = 64});
    CHECK(run(Exponential{.radius = 0.8, .directions = 64, .falloff = {0}}) == step);
    CHECK(run(Exponential{.radius = 0.8, .directions = 64, .falloff = {infinity}}) ==
          Image<double>{100, 1, 1});
    CHECK(*std::min_element(step.begin(), step.end()) < 0.5);

    for (const double x : {1e-9, 1e-6, 1e-15, 1e-300}) {
        const double mu = x - x * x / 2 + x * x * x / 6;
        CHECK(std::fabs(ExponentialFalloff{x}(1) - mu) <= 1e-15 * mu);
        CHECK(std::fabs(ExponentialFalloff{1}(x)-mu) <= 1e-15 * mu);
    }
    // Under a ceiling the mean distance is the integral of 2 h dc, 2 h: what is let through is 2 h sigma.
    Mesh flat;
    ceiling(flat, 1);
    for (const double sigma : {1e-9, 1e-12})
        CHECK(std::fabs(visibility(flat, sigma) / (2 * sigma) - 1) < 2e-3);
}

TEST_CASE("any function is a falloff, and none leaves [0, 1]")
{
    Mesh flat;
    ceiling(flat, 1);
    const Bvh bvh = built(flat);
    const auto open = [&](auto falloff, double radius = infinity) {
        return nook::traced_visibility(
            bvh, {0, 0, 0}, {0, 0, 1},
            TracedOptions<decltype(falloff)>{
                .radius = radius, .directions = directions, .falloff = falloff});
    };
    // min(1, (d / R)²), R = 2: c² (1 + 2 ln 1/c) with c = h / R.
    const auto square = [](double d) { return std::fmin(1.0, d * d / 4); };
    CHECK(std::fabs(open(square) - 0.25 * (1 + 2 * std::log(2))) < 2e-5);
    // Floats and captures.
    const float share = 0.25f;
    CHECK(open([share](double) { return share; }) == 0.25);
    CHECK(open([](double) { return 0.5; }, 2) == doctest::Approx(0.25 + 0.75 / 2).epsilon(1e-5));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(open([nan](double) { return nan; }) == 0);
    CHECK(open([](double) { return -3.0; }) == 0);
    CHECK(open([](double) { return 1.5; }) == 1);
    CHECK(open([](double) { return infinity; }) == 1);
    CHECK(open([](double) { return -infinity; }) == 0);
}

TEST_CASE("distances are in world units, whatever the scale of the scene")
{
    for (const double scale : {0x1p-20, 0x1p20}) {
        Mesh here, there;
        wall(here, 1);
        ceiling(here, 2);
        there = here.transformed(scale, {0, 0, 0});
        CHECK(visibility(here, 0.7) == visibility(there, 0.7 / scale));
    }
}

TEST_CASE("the kernel is what its directions find one by one: visibility, radiance and bent normal")
{
    const Mesh mesh = clutter();
    const Bvh bvh = built(mesh);
    constexpr int count = 60, rays = 96;
    const Points points = points_of(mesh, count);
    for (const auto set : {DirectionSet::scrambled_sobol, DirectionSet::spun, DirectionSet::r2}) {
        const TracedOptions<ExponentialFalloff, NoSecondaryRays, Checked> options{
            .radius = 1.5,
            .directions = rays,
            .seed = 3,
            .first_direction = 32,
            .set = set,
            .falloff = {0.9}};
        Results<double> results{count, 1};
        REQUIRE(nook::traced_ao(bvh, points.view(),
                                TracedImages{results.visibility.view(), results.bents(),
                                             results.radiances(), results.weight.view()},
                                options));
        double worst = 0, darkest = 1;
        for (int i = 0; i < count; ++i) {
            const auto at = static_cast<std::size_t>(3 * i);
            const glm::dvec3 normal{points.normals[at], points.normals[at + 1],
                                    points.normals[at + 2]};
            const glm::dvec3 unit = glm::normalize(normal);
            glm::dvec3 start{points.positions[at], points.positions[at + 1],
                             points.positions[at + 2]};
            const double most =
                std::fmax(std::fabs(start.x), std::fmax(std::fabs(start.y), std::fabs(start.z)));
            start += unit * (0x1p-23 * most + 0x1p-44 * (most + 2 * bvh.size()));
            std::vector<float> xyz(3 * rays);
            nook::traced_directions(options, normal, static_cast<std::uint32_t>(i), xyz.data());
            double open = 0;
            glm::dvec3 bent{0, 0, 0}, radiance{0, 0, 0};
            for (std::size_t j = 0; j < xyz.size(); j += 3) {
                const glm::dvec3 d{xyz[j], xyz[j + 1], xyz[j + 2]};
                worst = std::fmax(worst, std::fabs(glm::length(d) - 1) / 1e5);
                const nook::Hit hit = bvh.closest({start, d, 1.5});
                const double mu = hit ? -std::expm1(-0.9 * hit.t) : 1;
                open += mu;
                bent += d * mu;
                if (!hit) continue;
                glm::dvec3 colour{Checked{}(hit.face)};
                if (hit.face % 3 == 0) colour.z = 0;
                radiance += colour * (1 - mu);
            }
            const auto differ = [&](double a, double b) {
                worst = std::fmax(worst, std::fabs(a - b));
            };
            differ(results.visibility(i, 0), open / rays);
            bent = glm::normalize(bent);
            for (int k = 0; k < 3; ++k) {
                differ(results.bent(3 * i + k, 0), bent[k]);
                differ(results.radiance(3 * i + k, 0), radiance[k] / rays);
            }
            differ(results.weight(i, 0), rays);
            darkest = std::fmin(darkest, open / rays);
        }
        CHECK(worst < 1e-11);
        CHECK(darkest < 0.5);
    }
}

TEST_CASE("a white furnace: what is hidden is lit by exactly as much")
{
    Mesh mesh;
    mesh.box({-1, -1.5, -2}, {1, 1.5, 2});
    const Bvh bvh = built(mesh);
    std::mt19937 random{53};
    std::uniform_real_distribution<double> unit{-0.9, 0.9};
    Points points;
    for (int i = 0; i < 50; ++i)
        points.add({unit(random), unit(random), unit(random)}, meshes::random_direction(random));
    Results<double> results{50, 1};
    const TracedImages images{results.visibility.view(), absent, results.radiances()};
    REQUIRE(nook::traced_ao(bvh, points.view(0), images,
                            TracedOptions<StepFalloff, NoSecondaryRays, White>{.directions = 256}));
    for (const double v : results.visibility) CHECK(v == 0);
    for (const double v : results.radiance) CHECK(v == 1);
    REQUIRE(nook::traced_ao(bvh, points.view(0), images,
                            TracedOptions<ExponentialFalloff, NoSecondaryRays, White>{
                                .directions = 100, .falloff = {0.3}}));
    for (int i = 0; i < 50; ++i) {
        CHECK(results.visibility(i, 0) > 0.01);
        for (int k = 0; k < 3; ++k)
            CHECK(std::fabs(results.visibility(i, 0) + results.radiance(3 * i + k, 0) - 1) < 1e-14);
    }
    // The same by albedo per face, with a stride.
    const std::vector<float> albedo(12 * 4, 1.0f);
    Results<double> again{50, 1};
    REQUIRE(nook::traced_ao(
        bvh, points.view(0), TracedImages{again.visibility.view(), absent, again.radiances()},
        TracedOptions<ExponentialFalloff, NoSecondaryRays, nook::FaceAlbedo>{
            .directions = 100, .falloff = {0.3}, .colour = {albedo.data(), 4}}));
    CHECK(again == results);
}

TEST_CASE("a red wall bleeds by its form factor, a colour that is not a number by nothing")
{
    Mesh mesh;
    wall(mesh, 1, 2);
    const Bvh bvh = built(mesh);
    Points points;
    points.add({0, 0, 0}, {0, 0, 1});
    Results<double> results{1, 1};
    const TracedImages images{results.visibility.view(), absent, results.radiances()};
    const auto run = [&](double radius, auto colour) {
        REQUIRE(nook::traced_ao(bvh, points.view(0), images,
                                TracedOptions<StepFalloff, NoSecondaryRays, decltype(colour)>{
                                    .radius = radius, .directions = directions, .colour = colour}));
    };
    const auto red = [](std::uint32_t) { return glm::vec3{0.75f, 0, 0}; };
    run(infinity, red);
    CHECK(std::fabs(results.radiance(0, 0) - 0.75 * 0.27639320225) < edged);
    CHECK(results.radiance(0, 0) == 0.75 * (1 - results.visibility(0, 0)));
    CHECK(results.radiance(1, 0) == 0);
    CHECK(results.radiance(2, 0) == 0);
    run(1.25, red);
    CHECK(std::fabs(results.radiance(0, 0) - 0.75 * 0.05204401933091) < edged);
    run(0.99, red);
    CHECK(results.radiance(0, 0) == 0);
    CHECK(results.visibility(0, 0) == 1);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    constexpr float endless = std::numeric_limits<float>::infinity();
    run(infinity, [](std::uint32_t) { return glm::vec3{nan, 0.5f, endless}; });
    CHECK(results.radiance(0, 0) == 0);
    CHECK(results.radiance(1, 0) == 0.5 * (1 - results.visibility(0, 0)));
    CHECK(results.radiance(2, 0) == 0);
}

TEST_CASE("a bent normal leans away from a wall by the mean of the open directions")
{
    Mesh mesh;
    wall(mesh, 1);
    const Bvh bvh = built(mesh);
    Points points;
    points.add({0, 0, 0}, {0, 0, 5});
    Results<double> results{1, 1};
    const TracedImages images{results.visibility.view(), results.bents()};
    const auto leans = [&](const auto& options, double x, double z) {
        REQUIRE(nook::traced_ao(bvh, points.view(0), images, options));
        const double length = std::sqrt(x * x + z * z);
        CHECK(std::fabs(results.bent(0, 0) - x / length) < 2 * edged);
        CHECK(std::fabs(results.bent(1, 0)) < 2 * edged);
        CHECK(std::fabs(results.bent(2, 0) - z / length) < 2 * edged);
    };
    // Open directions cover the disc x < c, c = a / R: the means of x and of sqrt(1 - x² - y²).
    leans(TracedOptions<>{.directions = directions}, -2 / pi, 1);
    for (const double radius : {1.1, 2.0, 10.0}) {
        const double c = 1 / radius;
        leans(TracedOptions<>{.radius = radius, .directions = directions},
              -2 / (3 * pi) * std::pow(1 - c * c, 1.5),
              2.0 / 3 - 0.5 * (2.0 / 3 - c + c * c * c / 3));
    }
    for (const double sigma : {0.3, 2.0}) {
        const auto weight = [&](double x) { return x > 0 ? std::exp(-sigma / x) : 0; };
        const double x = integral([&](double t) { return t * std::sqrt(1 - t * t) * weight(t); });
        const double z = integral([&](double t) { return (1 - t * t) * weight(t); });
        leans(Exponential{.directions = directions, .falloff = {sigma}}, -2 / pi * x,
              2.0 / 3 - 0.5 * z);
    }
    // Nothing in reach: about the normal. 2 edged bounds the asymmetry of a set.
    leans(TracedOptions<>{.radius = 0.5, .directions = directions}, 0, 1);
}

TEST_CASE("a bent normal is the normal where nothing is open, and 0 where there is no surface")
{
    Mesh mesh;
    mesh.box({-1, -1, -1}, {1, 1, 1});
    const Bvh bvh = built(mesh);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    Points points;
    points.add({0, 0, 0}, {0, 3, 4});
    points.add({0, 0, 0}, {0, 0, 0});
    points.add({0, 0, 0}, {0, double{nan}, 1});
    points.add({double{nan}, 0, 0}, {0, 0, 1});
    Results<float> results{4, 1};
    REQUIRE(nook::traced_ao(
        bvh, points.view(),
        TracedImages{results.visibility.view(), results.bents(), absent, results.weight.view()},
        TracedOptions<>{.directions = 16}));
    CHECK(results.visibility(0, 0) == 0);
    CHECK(results.weight(0, 0) == 16);
    CHECK(results.bent(0, 0) == 0);
    CHECK(results.bent(1, 0) == doctest::Approx(0.6f));
    CHECK(results.bent(2, 0) == doctest::Approx(0.8f));
    for (int i = 1; i < 4; ++i) {
        CHECK(results.visibility(i, 0) == 1);
        CHECK(results.weight(i, 0) == 0);
        for (int k = 0; k < 3; ++k) CHECK(results.bent(3 * i + k, 0) == 0);
    }
}

namespace {

/// A floor with a wall, seen from above and aside.
struct Picture {
    Mesh mesh;
    Bvh bvh;
    nook::Camera camera{.eye = {-3, -4, 5}, .target = {0.2, 0, 0.2}, .up = {0, 0, 1}};
    int width = 45, height = 31;
    nook::Projection projection = nook::projection(camera, width, height);
    nook::ViewFrame frame = nook::view_frame(camera);
    Image<float> depth{width, height}, normal{3 * width, height};

    Picture()
    {
        mesh.quad({-2, -2, 0}, {1, -2, 0}, {1, 2, 0}, {-2, 2, 0});
        mesh.quad({1, -2, 0}, {1, 2, 0}, {1, 2, 3}, {1, -2, 3});
        REQUIRE(bvh.build(mesh.view()));
        REQUIRE(nook::rasterise(mesh.view(), frame, projection, {depth.view(), normals(), {}}));
    }
    nook::ImageView3<float> normals()
    {
        return nook::ImageView3<float>::interleaved(normal.data(), width, height, 3 * width);
    }
    template <class Output, class Options>
    nook::Outcome trace(const Output& output, const Options& options)
    {
        return nook::traced_ao(bvh, depth.view(), normals(), output, options, projection, frame);
    }
};

/// Visibility, with all that may be asked for beside it.
template <class Falloff, class Secondary>
void check_images_agree(Picture& picture, const Falloff& falloff, const Secondary& secondary)
{
    const int width = picture.width, height = picture.height;
    const TracedOptions<Falloff, Secondary> plain{
        .radius = 1.5, .directions = 33, .falloff = falloff, .secondary = secondary};
    const TracedOptions<Falloff, Secondary, Checked> coloured{
        .radius = 1.5, .directions = 33, .falloff = falloff, .secondary = secondary};
    Results<float> alone{width, height}, bent = alone, weighed = alone, lit = alone, all = alone;
    const auto outcome = picture.trace(alone.visibility.view(), plain);
    REQUIRE(outcome);
    REQUIRE(picture.trace(TracedImages{bent.visibility.view(), bent.bents()}, plain));
    REQUIRE(picture.trace(
        TracedImages{weighed.visibility.view(), absent, absent, weighed.weight.view()}, plain));
    REQUIRE(picture.trace(TracedImages{lit.visibility.view(), absent, lit.radiances()}, coloured));
    const auto most = picture.trace(
        TracedImages{all.visibility.view(), all.bents(), all.radiances(), all.weight.view()},
        coloured);
    REQUIRE(most);
    CHECK(bent.visibility == alone.visibility);
    CHECK(weighed.visibility == alone.visibility);
    CHECK(lit.visibility == alone.visibility);
    CHECK(all.visibility == alone.visibility);
    CHECK(bent.bent == all.bent);
    CHECK(weighed.weight == all.weight);
    CHECK(lit.radiance == all.radiance);
    CHECK(most.work.background == outcome.work.background);
    CHECK(most.work.rays + most.work.skipped_rays == outcome.work.rays + outcome.work.skipped_rays);
    // What was not asked for has not been touched.
    for (const auto* image : {&alone.bent, &alone.radiance, &alone.weight, &bent.radiance,
                              &bent.weight, &weighed.bent, &lit.weight})
        CHECK(std::all_of(image->begin(), image->end(), [](float v) { return v == -7; }));
    CHECK(std::any_of(alone.visibility.begin(), alone.visibility.end(),
                      [](float v) { return v < 0.8f; }));
}

}  // namespace

TEST_CASE("visibility has the same bits whatever else is asked for")
{
    Picture picture;
    check_images_agree(picture, StepFalloff{}, NoSecondaryRays{});
    check_images_agree(picture, ExponentialFalloff{1.5}, NoSecondaryRays{});
    check_images_agree(picture, StepFalloff{}, SecondaryRays{});
    check_images_agree(picture, ExponentialFalloff{1.5},
                       SecondaryRays{.half_rays = true, .jitter = 0.5});
}

TEST_CASE("bent normals of an image are in view axes, unit, and 0 on the background")
{
    Picture picture;
    Results<float> results{picture.width, picture.height};
    // What a renderer leaves in the normals of its sky is nobody's business.
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x)
            if (!(picture.depth(x, y) < 1e9f)) picture.normal(3 * x + 2, y) = 1;
    REQUIRE(picture.trace(
        TracedImages{results.visibility.view(), results.bents(), absent, results.weight.view()},
        TracedOptions<>{.radius = 1, .directions = 1024}));
    int floor = 0, background = 0, wrong_background = 0;
    double worst = 0;
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const glm::dvec3 bent{results.bent(3 * x, y), results.bent(3 * x + 1, y),
                                  results.bent(3 * x + 2, y)};
            if (!(picture.depth(x, y) < 1e9f)) {
                ++background;
                wrong_background += glm::length(bent) != 0 || results.weight(x, y) != 0;
                continue;
            }
            CHECK(std::fabs(glm::length(bent) - 1) < 1e-6);
            const auto at =
                nook::view_point(picture.projection, x + 0.5, y + 0.5, double{picture.depth(x, y)});
            const glm::dvec3 point = nook::point_to_world(picture.frame, {at.x, at.y, at.z});
            if (point.z > 1e-3 || std::fabs(point.y) > 0.9) continue;
            ++floor;
            const double c = std::fmin(1 - point.x, 1);
            const double lean_x = -2 / (3 * pi) * std::pow(1 - c * c, 1.5);
            const double lean_z = 2.0 / 3 - 0.5 * (2.0 / 3 - c + c * c * c / 3);
            const glm::dvec3 expected = glm::normalize(glm::dvec3{lean_x, 0, lean_z});
            const glm::dvec3 world = nook::direction_to_world(picture.frame, bent);
            worst = std::fmax(worst, glm::length(world - expected));
        }
    CHECK(floor > 100);
    CHECK(background > 100);
    CHECK(wrong_background == 0);
    // Ten times 0.40 N^(-3/4): three components, hundreds of pixels.
    CHECK(worst < 10 * 2.2e-3);
}
