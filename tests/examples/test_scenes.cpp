#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/rasteriser.hpp>

#include "../../examples/scenes/scenes.hpp"
#include "../../examples/support/failure.hpp"

namespace {

struct Drawn {
    nook::Image<float> depth;
    nook::Projection projection;
    std::size_t background = 0;
    float nearest = 1e30f, farthest = 0;
};

Drawn draw(const scenes::Scene& scene, int width, int height)
{
    Drawn drawn{nook::Image<float>{width, height}, nook::projection(scene.camera, width, height)};
    REQUIRE(nook::rasterise(scene.mesh(), nook::view_frame(scene.camera), drawn.projection,
                            {drawn.depth.view()}));
    for (const float depth : drawn.depth) {
        if (!nook::is_surface(depth, 1e30f)) {
            ++drawn.background;
            continue;
        }
        drawn.nearest = std::min(drawn.nearest, depth);
        drawn.farthest = std::max(drawn.farthest, depth);
    }
    return drawn;
}

glm::dvec3 vertex(const scenes::Scene& scene, std::uint32_t index)
{
    const float* at = scene.positions.data() + 3 * std::size_t{index};
    return {at[0], at[1], at[2]};
}

}  // namespace

TEST_CASE("every built-in scene is a sound mesh with a sound camera")
{
    CHECK(scenes::all().size() == 9);
    for (const scenes::Entry& entry : scenes::all()) {
        CAPTURE(entry.name);
        const scenes::Scene scene = entry.make();
        CHECK(scene.name == entry.name);
        CHECK(entry.figures == (scene.name == "bowl"));
        CHECK_FALSE(nook::check_mesh(scene.mesh()));
        CHECK_FALSE(nook::check_camera(scene.camera));
        CHECK(scene.radius > 0);
        CHECK(scene.albedo.size() == scene.triangles());
        std::size_t bad = 0;
        for (std::size_t i = 0; i < scene.triangles(); ++i)
            bad += nook::is_usable_triangle(scene.mesh(), i) ? 0 : 1;
        CHECK(bad == 0);
    }
}

TEST_CASE("a built-in scene is the same each time it is made")
{
    for (const scenes::Entry& entry : scenes::all()) {
        CAPTURE(entry.name);
        const scenes::Scene one = entry.make(), other = entry.make();
        CHECK(one.positions == other.positions);
        CHECK(one.indices == other.indices);
        CHECK(one.albedo == other.albedo);
    }
}

TEST_CASE("another seed gives other boxes and another terrain")
{
    CHECK(scenes::boxes({.seed = 1}).positions != scenes::boxes({.seed = 2}).positions);
    CHECK(scenes::terrain({.columns = 20, .rows = 20, .seed = 1}).positions !=
          scenes::terrain({.columns = 20, .rows = 20, .seed = 2}).positions);
}

TEST_CASE("bowl, boxes and curtain are closed solids with their outside out")
{
    for (const scenes::Scene& scene : {scenes::bowl(), scenes::boxes(), scenes::curtain()}) {
        CAPTURE(scene.name);
        // Each directed edge has its opposite: vertices are told apart by position.
        using Point = std::array<float, 3>;
        std::map<std::pair<Point, Point>, int> edges;
        double volume = 0;
        for (std::size_t i = 0; i < scene.triangles(); ++i) {
            Point corner[3];
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    corner[k][axis] = scene.positions[3 * scene.indices[3 * i + k] + axis];
            for (std::size_t k = 0; k < 3; ++k) {
                ++edges[{corner[k], corner[(k + 1) % 3]}];
                --edges[{corner[(k + 1) % 3], corner[k]}];
            }
            volume += glm::dot(vertex(scene, scene.indices[3 * i]),
                               glm::cross(vertex(scene, scene.indices[3 * i + 1]),
                                          vertex(scene, scene.indices[3 * i + 2]))) /
                      6;
        }
        const auto open = std::count_if(edges.begin(), edges.end(),
                                        [](const auto& edge) { return edge.second != 0; });
        CHECK(open == 0);
        CHECK(volume > 0);
    }
}

TEST_CASE("the floor fills pictures of every shape and nothing occludes on it")
{
    const scenes::Scene scene = scenes::floor();
    for (const auto& [width, height] :
         {std::pair{320, 180}, std::pair{200, 200}, std::pair{420, 180}}) {
        const Drawn drawn = draw(scene, width, height);
        CHECK(drawn.background == 0);
        nook::Image<float> visibility{width, height};
        REQUIRE(nook::chebyshev_ao(drawn.depth.view(), visibility.view(), {.window = 31}));
        CHECK(std::all_of(visibility.begin(), visibility.end(),
                          [](float value) { return value == 1; }));
    }
}

TEST_CASE("the terrain reaches from a distance of 0.1 to 1e5")
{
    const Drawn drawn = draw(scenes::terrain(), 480, 270);
    CHECK(drawn.nearest < 0.13f);
    CHECK(drawn.farthest > 0.9e5f);
    // Some sky, and every decade between.
    CHECK(drawn.background > 480 * 270 / 50);
    for (double decade = 1; decade < 1e5; decade *= 10) {
        CAPTURE(decade);
        const auto count = std::count_if(drawn.depth.begin(), drawn.depth.end(), [&](float depth) {
            return double{depth} >= decade && double{depth} < 10 * decade;
        });
        CHECK(count > 480 * 270 / 20);
    }
}

TEST_CASE("the curtain hangs over ground that reaches farther than the radius")
{
    const scenes::CurtainOptions options{.width = 2, .gap = 4, .height = 40, .radius = 20};
    const scenes::Scene scene = scenes::curtain(options);
    CHECK(scene.radius == 20);
    nook::Bvh bvh;
    REQUIRE(bvh.build(scene.mesh()));
    const auto distance = [&](const glm::dvec3& from, const glm::dvec3& towards) {
        return bvh.closest({from, towards}).t;
    };
    // Ground at y = 0, the lower edge over it, the faces of the curtain beside it.
    CHECK(distance({0.1, 2, 0.2}, {0, -1, 0}) == doctest::Approx(2));
    CHECK(distance({0.1, 0, 0.2}, {0, 1, 0}) == doctest::Approx(4));
    CHECK(distance({0.1, 60, 0.2}, {0, -1, 0}) == doctest::Approx(60 - 44));
    for (const double side : {-1.0, 1.0})
        CHECK(distance({side * 10, 4.5, 0.2}, {-side, 0, 0}) == doctest::Approx(9));
    // A sphere around a point that is in reach of the curtain holds no end of it or of the ground.
    const double last = 1 + std::sqrt(20 * 20 - 4 * 4);
    for (const double x : {-last, last}) CHECK(distance({x, 1, 20}, {0, -1, 0}) == 1);
    CHECK(scenes::bounds(scene).high.x >= last + 20);
    CHECK(distance({0.1, 0, 20}, {0, 1, 0}) == doctest::Approx(4));
}

TEST_CASE("the arcade is roofed, open to the courtyard, and its curtains end above the floor")
{
    const scenes::Scene scene = scenes::arcade();
    CHECK(scene.triangles() > 20000);
    CHECK(scene.triangles() < 60000);
    nook::Bvh bvh;
    REQUIRE(bvh.build(scene.mesh()));
    const auto closed = [&](const glm::dvec3& from, const glm::dvec3& towards) {
        return bvh.occluded({from, towards});
    };
    for (const double x : {-6.1, -3.1, 0.1, 2.9, 6.1}) {
        CAPTURE(x);
        CHECK(closed({x, 1, -1.7}, {0, 1, 0}));
        CHECK(closed({x, 1, -1.7}, {0, 0.1, -1}));
        CHECK_FALSE(closed({x, 0.05, -1.7}, {0, 0, 1}));
        CHECK_FALSE(closed({x, 1, 2.1}, {0, 1, 0}));
        CHECK_FALSE(closed({x, 1, 2.1}, {0, 0.1, 1}));
        // The floor of the gallery lies at y = 0.
        CHECK(bvh.closest({{x, 0.5, -1.7}, {0, -1, 0}}).t == doctest::Approx(0.5));
    }
    // Between the columns, at half their height: cloth in four bays of five, none close to the floor.
    int cloth = 0;
    for (const double x : {-6.1, -3.1, -1.0, 2.9, 6.1}) {
        CAPTURE(x);
        cloth += closed({x, 1.5, -1}, {0, 0, 1}) ? 1 : 0;
        CHECK_FALSE(closed({x, 0.05, -1}, {0, 0, 1}));
    }
    CHECK(cloth == 4);
    CHECK(scenes::arcade({.bays = 1}).triangles() < scene.triangles());
}

TEST_CASE("a scene is loaded by its name or from a file")
{
    const scenes::Scene stairs = scenes::load("stairs", 1);
    CHECK(stairs.name == "stairs");
    CHECK(stairs.positions == scenes::stairs().positions);
    const auto refusal = [](const char* name) {
        try {
            (void)scenes::load(name, 1);
        } catch (const support::Failure& failure) {
            return std::string{failure.what()};
        }
        return std::string{};
    };
    CHECK(refusal("nowhere").find("'nowhere' is none of bowl, ") != std::string::npos);
    CHECK(refusal("nowhere.obj").starts_with("nowhere.obj: cannot be opened"));
}

TEST_CASE("the empty view is background alone")
{
    const Drawn drawn = draw(scenes::empty(), 40, 30);
    CHECK(drawn.background == 40 * 30);
}

TEST_CASE("the usual radius is a twentieth of the diagonal")
{
    scenes::Scene scene;
    scene.positions = {0, 0, 0, 3, 0, 0, 3, 4, 12, 100, 100, 100};
    scene.indices = {0, 1, 2};
    // The fourth vertex belongs to no triangle.
    CHECK(scenes::bounds(scene).diagonal() == 13);
    CHECK(scenes::default_radius(scene) == 0.05 * 13);
    CHECK(scenes::default_radius(scenes::empty()) == 1);
    CHECK(scenes::bowl().radius == scenes::default_radius(scenes::bowl()));
}

TEST_CASE("the view of a mesh holds all of it")
{
    for (const bool orthographic : {false, true})
        for (const double aspect : {16.0 / 9, 1.0, 0.4}) {
            for (const scenes::Entry& entry : scenes::all()) {
                const scenes::Scene scene = entry.make();
                CAPTURE(scene.name);
                CAPTURE(aspect);
                CAPTURE(orthographic);
                const nook::Camera camera = scenes::three_quarter_view(scene, aspect, orthographic);
                REQUIRE_FALSE(nook::check_camera(camera));
                const int height = 1000, width = int(aspect * height);
                const nook::Projection projection = nook::projection(camera, width, height);
                const nook::ViewFrame frame = nook::view_frame(camera);
                std::size_t outside = 0;
                for (const std::uint32_t index : scene.indices) {
                    const glm::dvec3 view = nook::point_to_view(frame, vertex(scene, index));
                    const auto at = nook::pixel_point(projection, {view.x, view.y, view.z});
                    const bool inside =
                        at.distance > 0 && at.x > 0 && at.x < width && at.y > 0 && at.y < height;
                    outside += inside ? 0 : 1;
                }
                CHECK(outside == 0);
            }
        }
}
