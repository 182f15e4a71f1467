#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/scene/traced_plan.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using meshes::Point;
using nook::Bvh;
using nook::Camera;
using nook::Image;
using nook::SecondaryRays;
using nook::TracedOptions;
using nook::WorkMap;
using Strange = TracedOptions<nook::ExponentialFalloff, SecondaryRays>;

/// A mesh as a G-buffer, and what is asked of it.
struct View {
    Mesh mesh;
    Bvh bvh{};
    Image<float> depth, normal;
    Image<std::uint32_t> face;
    nook::Projection projection;
    nook::ViewFrame frame;

    View(Mesh shown, const Camera& camera, int width, int height)
        : mesh{std::move(shown)},
          depth{width, height},
          normal{3 * width, height},
          face{width, height},
          projection{nook::projection(camera, width, height)},
          frame{nook::view_frame(camera)}
    {
        REQUIRE(bvh.build(mesh.view()));
        REQUIRE(nook::rasterise(mesh.view(), frame, projection,
                                {depth.view(), normals(), face.view()}));
    }
    [[nodiscard]] nook::ImageView3<float> normals()
    {
        return nook::ImageView3<float>::interleaved(normal.data(), depth.width(), depth.height(),
                                                    3 * depth.width());
    }
    [[nodiscard]] nook::SourceFaces faces() { return {face.view(), mesh.view()}; }

    template <class Options, class E = nook::Serial>
    nook::Outcome plan(Image<std::uint8_t>& active, const Options& options, bool ids,
                       E&& executor = E{})
    {
        return ids ? nook::plan_traced(bvh, depth.view(), normals(), faces(), active.view(),
                                       options, projection, frame, executor)
                   : nook::plan_traced(bvh, depth.view(), normals(), active.view(), options,
                                       projection, frame, executor);
    }
    template <class Output, class Options>
    nook::Outcome trace(const Output& output, const Options& options, bool ids,
                        const WorkMap& map = {})
    {
        return ids ? nook::traced_ao(bvh, depth.view(), normals(), faces(), output, options,
                                     projection, frame, map)
                   : nook::traced_ao(bvh, depth.view(), normals(), output, options, projection,
                                     frame, map);
    }
    /// The shading point of a pixel, and what it gets by itself, from the root of the hierarchy down.
    [[nodiscard]] nook::detail::ShadingPoint point(int x, int y, bool ids, double position_error)
    {
        const nook::ImageView<const float> distances = depth.view();
        const auto source = nook::depth_source(distances);
        const nook::ImageView3<const float> directions = normals();
        const nook::SourceFaces shown = faces();
        const nook::detail::TracedInput input{
            bvh, source, directions, ids ? &shown : nullptr, projection, frame, position_error};
        return input.point(x, y, double{depth(x, y)}, input.normal(x, y));
    }
    template <class Options>
    [[nodiscard]] float alone(int x, int y, const Options& options, bool ids)
    {
        const nook::detail::Neighbourhood all{bvh.view()};
        const nook::detail::PointTracer<Options, false> tracer{bvh, options};
        return static_cast<float>(
            tracer.trace(all, point(x, y, ids, options.position_error)).visibility());
    }
    [[nodiscard]] bool shows(int x, int y) { return depth(x, y) < 1e30f; }
};

bool same_bits(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Every pixel gets the bits that it gets alone, with the plan and without it. Returns the share of
/// surface pixels that the plan spares.
template <class Options>
double check_plan(View& view, const Options& options, bool ids)
{
    const int width = view.depth.width(), height = view.depth.height();
    Image<std::uint8_t> active{WorkMap::groups(width), height, 77};
    const nook::Outcome planned = view.plan(active, options, ids);
    REQUIRE(planned);
    Image<float> plain{width, height, -7}, mapped{width, height, -7};
    REQUIRE(view.trace(plain.view(), options, ids));
    const nook::Outcome traced = view.trace(mapped.view(), options, ids, WorkMap{active.view()});
    REQUIRE(traced);
    int wrong = 0, not_open = 0, odd = 0;
    std::uint64_t surfaces = 0, skipped = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const std::uint8_t byte = active(x / WorkMap::group, y);
            odd += byte > 1;
            const float value = view.shows(x, y) ? view.alone(x, y, options, ids) : 1;
            surfaces += view.shows(x, y);
            skipped += view.shows(x, y) && byte == 0;
            wrong += !same_bits(plain(x, y), value) || !same_bits(mapped(x, y), value);
            not_open += byte == 0 && value != 1;
        }
    CHECK(wrong == 0);
    CHECK(not_open == 0);
    CHECK(odd == 0);
    CHECK(planned.work.skipped == skipped);
    CHECK(planned.work.background == std::uint64_t(width) * std::uint64_t(height) - surfaces);
    CHECK(planned.work.pixels == std::uint64_t(width) * std::uint64_t(height));
    CHECK(planned.work.passes == 1);
    CHECK(traced.work.skipped == skipped);
    return surfaces == 0 ? 1 : static_cast<double>(skipped) / static_cast<double>(surfaces);
}

/// A floor of squares, tilted so that no coordinate is round.
Mesh floor(int squares, double tilt = 0)
{
    Mesh mesh;
    const auto at = [&](int i, int j) -> Point {
        const double x = 20.0 * i / squares - 10, z = 20.0 * j / squares - 10;
        return {x, tilt * x + 0.7 * tilt * z, z};
    };
    for (int i = 0; i < squares; ++i)
        for (int j = 0; j < squares; ++j)
            mesh.quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    return mesh;
}
const Camera slanted{.eye = {0.3, 6, 9}, .target = {0, 0, 0}, .vertical_fov = 0.7};

Mesh soup(std::uint32_t seed, int triangles, double size)
{
    std::mt19937 random{seed};
    std::uniform_real_distribution<double> place{-3, 3}, off{-size, size};
    Mesh mesh;
    for (int i = 0; i < triangles; ++i) {
        const Point a{place(random), place(random), place(random)};
        const auto next = [&]() -> Point {
            return {a[0] + off(random), a[1] + off(random), a[2] + off(random)};
        };
        mesh.triangle(a, next(), next());
    }
    return mesh;
}

}  // namespace

TEST_CASE("a floor is left out as a whole, whatever its slope and its triangles")
{
    for (const int squares : {1, 7, 40})
        for (const double tilt : {0.0, 0.31}) {
            CAPTURE(squares);
            CAPTURE(tilt);
            View view{floor(squares, tilt), slanted, 83, 45};
            CHECK(check_plan(view, TracedOptions<>{.radius = 0.5, .directions = 8}, false) > 0.9);
            CHECK(check_plan(view, TracedOptions<>{.radius = 0.5, .directions = 8}, true) > 0.9);
        }
    View whole{floor(1), slanted, 64, 40};
    CHECK(check_plan(whole, TracedOptions<>{.directions = 4}, false) == 1);
    CHECK(check_plan(whole, TracedOptions<>{.directions = 4}, true) == 1);
}

TEST_CASE("around a box the floor is active as far as the box reaches")
{
    Mesh mesh = floor(4);
    mesh.box({-1, -0.5, -1}, {1, 2, 1});
    View view{mesh, slanted, 160, 90};
    for (const bool ids : {false, true}) {
        const double narrow =
            check_plan(view, TracedOptions<>{.radius = 0.3, .directions = 8}, ids);
        const double wide = check_plan(view, TracedOptions<>{.radius = 2, .directions = 8}, ids);
        CHECK(narrow > 0.7);
        CHECK(wide > 0.3);
        CHECK(wide < narrow);
        CHECK(check_plan(view, TracedOptions<>{.radius = 100, .directions = 8}, ids) < 0.4);
        // Secondary rays reach farther than the radius.
        const double secondary = check_plan(
            view, Strange{.radius = 0.3, .directions = 8, .secondary = {.radius = 1.2}}, ids);
        CHECK(secondary < narrow);
        CHECK(secondary > 0.3);
    }
}

TEST_CASE("no picture changes: smooth bodies, orthography, scenes far away and of any size")
{
    Mesh ball = floor(3);
    const Mesh sphere = meshes::icosphere(2, 1.5, {0.2, 1.2, 0});
    const auto first = static_cast<std::uint32_t>(ball.positions.size() / 3);
    ball.positions.insert(ball.positions.end(), sphere.positions.begin(), sphere.positions.end());
    for (const std::uint32_t i : sphere.indices) ball.indices.push_back(first + i);
    for (const bool ids : {false, true}) {
        View view{ball, slanted, 70, 41};
        CHECK(check_plan(view, TracedOptions<>{.radius = 0.4, .directions = 16}, ids) > 0.3);
        Camera flat = slanted;
        flat.orthographic = true;
        flat.view_height = 9;
        View parallel{ball, flat, 70, 41};
        CHECK(check_plan(parallel, TracedOptions<>{.radius = 0.4, .directions = 16}, ids) > 0.3);
        Camera distant = slanted;
        distant.eye = {1000.3, 6, 9};
        distant.target = {1000, 0, 0};
        View moved{ball.transformed(1, {1000, 0, 0}), distant, 70, 41};
        CHECK(check_plan(moved, TracedOptions<>{.radius = 0.4, .directions = 8}, ids) > 0.2);
        Camera tiny = slanted;
        tiny.eye = {0.3e-6, 6e-6, 9e-6};
        View small_scene{ball.transformed(1e-6, {0, 0, 0}), tiny, 70, 41};
        CHECK(check_plan(small_scene, TracedOptions<>{.radius = 0.4e-6, .directions = 8}, ids) >
              0.3);
    }
}

TEST_CASE("the sides of a shallow valley see each other")
{
    for (const double slope : {0.04, 0.2}) {
        Mesh valley;
        valley.quad({-10, 10 * slope, -10}, {-10, 10 * slope, 10}, {0, 0, 10}, {0, 0, -10});
        valley.quad({0, 0, -10}, {0, 0, 10}, {10, 10 * slope, 10}, {10, 10 * slope, -10});
        View view{valley, slanted, 64, 32};
        for (const bool ids : {false, true}) {
            const double spared =
                check_plan(view, TracedOptions<>{.radius = 1, .directions = 128}, ids);
            CHECK(spared > 0.3);
            CHECK(spared < 0.9);
        }
    }
}

TEST_CASE("random triangles: what is left out is open")
{
    double spared = 0;
    for (std::uint32_t seed = 0; seed < 12; ++seed) {
        CAPTURE(seed);
        const bool ids = seed % 2 != 0;
        const double size = seed % 3 == 0 ? 0.3 : 3;
        Camera camera{.eye = {0.4, 1, 11}, .vertical_fov = 0.7};
        camera.orthographic = seed % 4 == 3;
        camera.view_height = 8;
        View view{soup(seed, seed % 3 == 0 ? 60 : 12, size), camera, 53, 37};
        const double radius = seed % 5 == 0 ? 5 : 0.2;
        spared += check_plan(view, TracedOptions<>{.radius = radius, .directions = 32}, ids);
        check_plan(view, Strange{.radius = radius, .directions = 8}, ids);
    }
    CHECK(spared > 0.5);
}

TEST_CASE("dust in the buffers is left out like the rest")
{
    View view{floor(2), slanted, 67, 33};
    std::mt19937 random{3};
    const float dust[] = {0,
                          -1,
                          std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN(),
                          1e30f,
                          1e-30f};
    for (int i = 0; i < 150; ++i) {
        const int x = static_cast<int>(random() % 67), y = static_cast<int>(random() % 33);
        if (i % 2 == 0) view.depth(x, y) = dust[random() % 6];
        else view.normal(3 * x + static_cast<int>(random() % 3), y) = dust[random() % 6];
    }
    for (const bool ids : {false, true}) {
        const TracedOptions<> options{.radius = 1, .directions = 8};
        Image<std::uint8_t> active{5, 33, 77};
        REQUIRE(view.plan(active, options, ids));
        Image<float> plain{67, 33, -7}, mapped{67, 33, -7};
        REQUIRE(view.trace(plain.view(), options, ids));
        REQUIRE(view.trace(mapped.view(), options, ids, WorkMap{active.view()}));
        CHECK(std::memcmp(plain.data(), mapped.data(), 67 * 33 * sizeof(float)) == 0);
    }
}

TEST_CASE(
    "the tip of a needle is found as soon as it rises above a tangent plane within the radius")
{
    // Seen from straight above; the floor's points lie at their lift. The needle stands to the right of
    // the last pixel of a group.
    const Camera above{.eye = {0, 8, 0}, .up = {0, 0, -1}, .orthographic = true, .view_height = 4};
    constexpr double radius = 0.25;
    int hidden = 0, found = 0;
    for (int step = -30; step <= 30; ++step)
        for (const double beside : {0.0, 0.2499, 0.2501, 0.26}) {
            CAPTURE(step);
            CAPTURE(beside);
            Mesh flat;
            flat.quad({-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4});
            View view{flat, above, 48, 48};
            const TracedOptions<> options{.radius = radius, .directions = 4};
            const nook::detail::ShadingPoint at = view.point(15, 21, false, options.position_error);
            const auto& space = view.bvh.space();
            const double lift = at.start.y / space.scale + space.origin.y;
            // Around the height of the point, in steps of a float.
            float tip = static_cast<float>(lift);
            for (int i = 0; i < std::abs(step); ++i)
                tip = std::nextafter(tip, step < 0 ? -1.0f : 1.0f);
            const double x = at.start.x / space.scale + space.origin.x;
            const double z = at.start.z / space.scale + space.origin.z;
            Mesh mesh = flat;
            mesh.triangle({x + beside, tip, z}, {x + beside - 0.001, -1, z + 0.001},
                          {x + beside + 0.001, -1, z});
            REQUIRE(view.bvh.build(mesh.view()));
            const nook::detail::ShadingPoint now =
                view.point(15, 21, false, options.position_error);
            const auto corner =
                view.bvh.space().to_scene({double{static_cast<float>(x + beside)}, double{tip},
                                           double{static_cast<float>(z)}});
            const nook::detail::Vector3 off = corner - now.start;
            const bool matters = off.y > 0 && nook::detail::dot(off, off) <
                                                  std::pow(radius * view.bvh.space().scale, 2);
            Image<std::uint8_t> active{3, 48, 77};
            REQUIRE(view.plan(active, options, false));
            const bool is_active = active(15 / 16, 21) != 0;
            CHECK((is_active || !matters));
            hidden += !is_active;
            found += matters;
        }
    // Both sides of the edge were tried, and the planner does not take everything for a needle.
    CHECK(found > 40);
    CHECK(hidden > 100);
}

TEST_CASE("an exact map keeps bent normals and weights")
{
    Mesh mesh = floor(2);
    mesh.box({-1, 0, -1}, {1, 2, 1});
    View view{mesh, slanted, 61, 34};
    for (const bool ids : {false, true}) {
        const TracedOptions<> options{.radius = 0.4, .directions = 12};
        Image<std::uint8_t> active{4, 34, 77};
        REQUIRE(view.plan(active, options, ids));
        Image<float> images[2][3];
        for (auto& set : images) {
            set[0] = Image<float>{61, 34, -7};
            set[1] = Image<float>{183, 34, -7};
            set[2] = Image<float>{61, 34, -7};
            const auto bent = nook::ImageView3<float>::interleaved(set[1].data(), 61, 34, 183);
            const nook::TracedImages outputs{set[0].view(), bent, nook::absent, set[2].view()};
            REQUIRE(view.trace(outputs, options, ids,
                               &set == &images[0] ? WorkMap{} : WorkMap{active.view()}));
        }
        for (int i = 0; i < 3; ++i)
            CHECK(std::memcmp(images[0][i].data(), images[1][i].data(),
                              (i == 1 ? 3 : 1) * 61 * 34 * sizeof(float)) == 0);
    }
}

TEST_CASE("the same plan for any number of threads, and for any size of picture")
{
    Mesh mesh = floor(5, 0.1);
    mesh.box({-1, -1, -1}, {1, 2, 1});
    const TracedOptions<> options{.radius = 0.5, .directions = 4};
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 50}, {50, 1}, {17, 9}, {97, 41}}) {
        View view{mesh, slanted, width, height};
        std::vector<Image<std::uint8_t>> plans;
        for (const int threads : {1, 2, 5}) {
            nook::ThreadExecutor executor{threads};
            plans.emplace_back(WorkMap::groups(width), height, 77);
            REQUIRE(view.plan(plans.back(), options, true, executor));
        }
        const auto size = static_cast<std::size_t>(WorkMap::groups(width) * height);
        CHECK(std::memcmp(plans[0].data(), plans[1].data(), size) == 0);
        CHECK(std::memcmp(plans[0].data(), plans[2].data(), size) == 0);
        check_plan(view, options, false);
    }
}

TEST_CASE("a plan of nothing is empty, and bad arguments are named")
{
    View view{floor(1), slanted, 20, 6};
    Image<std::uint8_t> active{2, 6, 77};
    const auto rejected = [&](const TracedOptions<>& options, auto change) {
        auto depth = nook::ImageView<const float>(view.depth.view());
        auto normals = nook::ImageView3<const float>(view.normals());
        auto groups = active.view();
        auto projection = view.projection;
        auto frame = view.frame;
        change(depth, normals, groups, projection, frame);
        const nook::Outcome outcome =
            nook::plan_traced(view.bvh, depth, normals, groups, options, projection, frame);
        for (const std::uint8_t byte : active) CHECK(byte == 77);
        return std::string{outcome.error.argument};
    };
    const auto nothing = [](auto&...) {};
    CHECK(rejected({.radius = -1}, nothing) == "options.radius");
    CHECK(rejected({.directions = 0}, nothing) == "options.directions");
    CHECK(rejected({}, [](auto&, auto&, auto& g, auto&...) { g.width = 1; }) == "active");
    CHECK(rejected({}, [](auto&, auto&, auto& g, auto&...) { g.height = 5; }) == "active");
    CHECK(rejected({}, [](auto&, auto&, auto& g, auto&...) { g.data = nullptr; }) == "active");
    CHECK(rejected({}, [](auto& d, auto&...) { d.data = nullptr; }) == "depth");
    CHECK(rejected({}, [](auto&, auto& n, auto&...) { n.z.data = nullptr; }) == "normals.z");
    CHECK(rejected({}, [&](auto&, auto&, auto& g, auto&...) {
              g.data = reinterpret_cast<std::uint8_t*>(view.depth.data());
          }) == "active");
    CHECK(rejected({}, [](auto&, auto&, auto&, auto& p, auto&) { p.fx = 0; }) == "projection.fx");
    CHECK(rejected({}, [](auto&, auto&, auto&, auto&, auto& f) { f.up.x = 9; }) == "frame.up");

    const nook::ImageView<const float> no_depth{};
    CHECK(nook::plan_traced(view.bvh, no_depth, nook::ImageView3<const float>{},
                            nook::ImageView<std::uint8_t>{}, TracedOptions<>{}, view.projection,
                            view.frame));
    // No triangles at all, though the buffers show some.
    Bvh empty;
    REQUIRE(empty.build(nook::MeshView{}));
    REQUIRE(nook::plan_traced(empty, nook::ImageView<const float>(view.depth.view()),
                              nook::ImageView3<const float>(view.normals()), active.view(),
                              TracedOptions<>{}, view.projection, view.frame));
    for (const std::uint8_t byte : active) CHECK(byte == 0);
}
