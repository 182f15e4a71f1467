#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/outline.hpp>
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

/// What connects triangles to one surface: corners at equal positions, or common vertices. In the latter
/// case, too, vertices at one position are one, but only within a surface: solids may touch.
enum class Joined { by_positions, by_vertices };

/// The surfaces of a scene.
struct Surfaces {
    std::size_t count = 0;
    std::size_t outward = 0;     ///< of positive volume
    std::size_t open_edges = 0;  ///< directed edges without exactly one opposite
    std::size_t torn = 0;        ///< vertices whose triangles are more than one fan
    double volume = 0;
};

/// Sets of vertices.
class Sets {
public:
    explicit Sets(std::size_t count) : parent_(count)
    {
        std::iota(parent_.begin(), parent_.end(), 0u);
    }
    std::uint32_t root(std::uint32_t i)
    {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void unite(std::uint32_t a, std::uint32_t b) { parent_[root(a)] = root(b); }

private:
    std::vector<std::uint32_t> parent_;
};

Surfaces surfaces(const scenes::Scene& scene, Joined joined)
{
    const std::size_t count = scene.positions.size() / 3;
    std::vector<std::uint32_t> group(count, 0);
    if (joined == Joined::by_vertices) {
        Sets sets{count};
        for (std::size_t i = 0; i < scene.indices.size(); ++i)
            sets.unite(scene.indices[i], scene.indices[i - i % 3]);
        for (std::uint32_t i = 0; i < count; ++i) group[i] = sets.root(i);
    }
    // Vertices by position: those of one position get the number of the first in order.
    const auto position = [&](std::uint32_t i) {
        const float* at = scene.positions.data() + 3 * std::size_t{i};
        return std::tuple{group[i], at[0], at[1], at[2]};
    };
    std::vector<std::uint32_t> order(count), number(count);
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return position(a) < position(b); });
    for (std::size_t i = 0; i < count; ++i)
        number[order[i]] =
            i > 0 && position(order[i]) == position(order[i - 1]) ? number[order[i - 1]] : order[i];

    // A corner of a triangle: the edges to the next and to the last vertex leave from here.
    struct Corner {
        std::uint32_t vertex, next, last;
        auto operator<=>(const Corner&) const = default;
    };
    std::vector<Corner> corners;
    for (std::size_t i = 0; i < scene.triangles(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto at = [&](std::size_t c) { return number[scene.indices[3 * i + c % 3]]; };
            corners.push_back({at(k), at(k + 1), at(k + 2)});
        }
    std::sort(corners.begin(), corners.end());
    Surfaces result;
    for (std::size_t first = 0, end = 0; first < corners.size(); first = end) {
        while (end < corners.size() && corners[end].vertex == corners[first].vertex) ++end;
        // Each edge that leaves must come back, once; then the fan is followed around.
        std::vector<std::uint32_t> back;
        for (std::size_t i = first; i < end; ++i) back.push_back(corners[i].last);
        std::sort(back.begin(), back.end());
        bool sound = true;
        for (std::size_t i = first; i < end; ++i)
            if (back[i - first] != corners[i].next ||
                (i > first && corners[i].next == corners[i - 1].next)) {
                ++result.open_edges;
                sound = false;
            }
        std::size_t at = first, steps = 0;
        while (sound && steps <= end - first) {
            ++steps;
            const Corner towards{corners[at].vertex, corners[at].last, 0};
            at = static_cast<std::size_t>(
                std::lower_bound(corners.begin(), corners.end(), towards) - corners.begin());
            if (at == first) break;
        }
        result.torn += sound && steps != end - first ? 1 : 0;
    }

    Sets sets{count};
    for (const Corner& corner : corners) sets.unite(corner.vertex, corner.next);
    std::map<std::uint32_t, double> volumes;
    for (std::size_t i = 0; i < scene.triangles(); ++i) {
        const std::uint32_t key = sets.root(number[scene.indices[3 * i]]);
        const glm::dvec3 origin = vertex(scene, key);
        volumes[key] += glm::dot(vertex(scene, scene.indices[3 * i]) - origin,
                                 glm::cross(vertex(scene, scene.indices[3 * i + 1]) - origin,
                                            vertex(scene, scene.indices[3 * i + 2]) - origin)) /
                        6;
    }
    result.count = volumes.size();
    for (const auto& [key, volume] : volumes) {
        result.outward += volume > 0 ? 1 : 0;
        result.volume += volume;
    }
    return result;
}

}  // namespace

TEST_CASE("every built-in scene is a sound mesh with a sound camera")
{
    CHECK(scenes::all().size() == 15);
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

TEST_CASE("every scene is made of closed solids with their outside out, but for land and rooms")
{
    for (const scenes::Entry& entry : scenes::all()) {
        const std::string name = entry.name;
        CAPTURE(name);
        // Those of the first three keep stricter rules, below.
        if (name == "temple" || name == "city" || name == "corridor" || name == "empty") continue;
        // And these.
        if (name == "cup" || name == "tree" || name == "lathe") continue;
        const scenes::Scene scene = entry.make();
        const Surfaces found = surfaces(scene, Joined::by_vertices);
        CHECK(found.torn == 0);
        if (name == "floor" || name == "terrain") {
            // One open sheet that faces up.
            CHECK(found.count == 1);
            CHECK(found.open_edges > 0);
            std::size_t down = 0;
            for (std::size_t i = 0; i < scene.triangles(); ++i) {
                const auto corner = [&](std::size_t k) {
                    return vertex(scene, scene.indices[3 * i + k]);
                };
                down += glm::cross(corner(1) - corner(0), corner(2) - corner(0)).y > 0 ? 0 : 1;
            }
            CHECK(down == 0);
            continue;
        }
        CHECK(found.open_edges == 0);
        CHECK(found.outward == found.count);
        CHECK(found.count >= 2);
    }
    // Other numbers of parts.
    for (const scenes::Scene& scene :
         {scenes::bowl({.radius = 0.4, .thickness = 0.3, .segments = 3}),
          scenes::boxes({.count = 3}), scenes::stairs({.steps = 1}),
          scenes::chains({.pillars = 2, .links = 2}), scenes::arcade({.bays = 1}),
          scenes::arcade({.bays = 2})}) {
        CAPTURE(scene.name);
        const Surfaces found = surfaces(scene, Joined::by_vertices);
        CHECK(found.outward == found.count);
        CHECK(found.open_edges == 0);
        CHECK(found.torn == 0);
    }
}

TEST_CASE("the outlines of a scene of solids need no back and no rim")
{
    for (const scenes::Scene& scene : {scenes::bowl(), scenes::boxes(), scenes::stairs(),
                                       scenes::chains({.pillars = 2, .links = 4}),
                                       scenes::curtain(), scenes::arcade(), scenes::temple()}) {
        CAPTURE(scene.name);
        nook::OutlineShell shell;
        REQUIRE(shell.build(scene.mesh()));
        CHECK(shell.dropped() == 0);
        CHECK(shell.inward_count() == 0);
        std::size_t open = 0;
        for (std::size_t i = 0; i < shell.object_count(); ++i) open += shell.object(i).open ? 1 : 0;
        CHECK(open == 0);
    }
}

TEST_CASE("temple and city are made of solids that share no vertex")
{
    const scenes::Scene temple = scenes::temple(), city = scenes::city();
    CHECK(temple.triangles() > 16000);
    CHECK(temple.triangles() < 20000);
    CHECK(city.triangles() > 450000);
    CHECK(city.triangles() < 550000);
    for (const scenes::Scene& scene : {temple, city, scenes::temple({5, 9, 8}),
                                       scenes::city({.columns = 1, .rows = 2, .seed = 4})}) {
        CAPTURE(scene.triangles());
        const Surfaces found = surfaces(scene, Joined::by_positions);
        CHECK(found.count > 300);
        CHECK(found.outward == found.count);
        CHECK(found.open_edges == 0);
        CHECK(found.torn == 0);
    }
}

TEST_CASE("the corridor is one closed surface with its inside out")
{
    const scenes::Scene scene = scenes::corridor();
    CHECK(scene.triangles() > 275000);
    CHECK(scene.triangles() < 305000);
    const Surfaces found = surfaces(scene, Joined::by_positions);
    CHECK(found.count == 1);
    CHECK(found.outward == 0);
    CHECK(found.open_edges == 0);
    CHECK(found.torn == 0);
    // About the section of a room 3.2 m wide and 3.5 m high, for 30 m.
    CHECK(found.volume < -270);
    CHECK(found.volume > -330);
    const Surfaces shorter =
        surfaces(scenes::corridor({.bays = 1, .spacing = 0.3}), Joined::by_positions);
    CHECK(shorter.count == 1);
    CHECK(shorter.open_edges == 0);
    CHECK(shorter.torn == 0);
    CHECK(shorter.volume < -25);
    // No ray leaves, and all that the camera sees faces it.
    CHECK(draw(scene, 160, 100).background == 0);
    nook::Bvh bvh;
    REQUIRE(bvh.build(scene.mesh()));
    const glm::dvec3 eye = scene.camera.eye;
    std::size_t facing = 0;
    for (int i = 0; i < 500; ++i) {
        const double z = 1 - 2 * (i + 0.5) / 500, turn = 2.4 * i, out = std::sqrt(1 - z * z);
        const glm::dvec3 towards{out * std::cos(turn), z, out * std::sin(turn)};
        const nook::Hit hit = bvh.closest({eye, towards});
        REQUIRE(bool(hit));
        const auto corner = [&](std::size_t k) {
            return vertex(scene, scene.indices[3 * std::size_t{hit.face} + k]);
        };
        const glm::dvec3 normal = glm::cross(corner(1) - corner(0), corner(2) - corner(0));
        facing += glm::dot(normal, towards) < 0 ? 1 : 0;
    }
    CHECK(facing == 500);
}

TEST_CASE("cup and queen are each one closed surface of even triangles with its outside out")
{
    struct Case {
        scenes::Scene scene;
        std::size_t fewest, most;
        int holes;
    };
    for (const Case& one :
         {Case{scenes::cup(), 15000, 25000, 1}, Case{scenes::lathe(), 20000, 40000, 0},
          Case{scenes::cup({.edge = 0.1}), 2000, 8000, 1},
          Case{scenes::cup({.edge = 0.03}), 30000, 60000, 1},
          Case{scenes::lathe({.edge = 0.06}), 5000, 15000, 0},
          Case{scenes::lathe({.edge = 0.025}), 50000, 90000, 0}}) {
        const scenes::Scene& scene = one.scene;
        CAPTURE(scene.name);
        CAPTURE(scene.triangles());
        CHECK(scene.triangles() > one.fewest);
        CHECK(scene.triangles() < one.most);
        for (const Joined joined : {Joined::by_vertices, Joined::by_positions}) {
            const Surfaces found = surfaces(scene, joined);
            CHECK(found.count == 1);
            CHECK(found.open_edges == 0);
            CHECK(found.torn == 0);
            CHECK(found.volume > 0);
        }
        // Euler: vertices - edges + triangles = 2 - 2 holes, three edges for two triangles.
        const auto vertices = static_cast<std::ptrdiff_t>(
            std::set<std::uint32_t>(scene.indices.begin(), scene.indices.end()).size());
        CHECK(vertices - static_cast<std::ptrdiff_t>(scene.triangles() / 2) == 2 - 2 * one.holes);
        std::vector<double> areas;
        double narrowest = 1;
        for (std::size_t i = 0; i < scene.triangles(); ++i) {
            const glm::dvec3 a = vertex(scene, scene.indices[3 * i]),
                             b = vertex(scene, scene.indices[3 * i + 1]),
                             c = vertex(scene, scene.indices[3 * i + 2]);
            const double area = glm::length(glm::cross(b - a, c - a)) / 2;
            const double longest =
                std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
            areas.push_back(area);
            // The height over the longest side, relative to it: 0.866 for equal sides.
            narrowest = std::min(narrowest, 2 * area / (longest * longest));
        }
        std::sort(areas.begin(), areas.end());
        const double median = areas[areas.size() / 2];
        // Finer meshes than the usual ones show where the handle crowds the wall.
        CHECK(areas.front() > 0.09 * median);
        CHECK(areas.back() < 2 * median);
        CHECK(narrowest > 0.08);
        if (scene.triangles() < 32000) CHECK(areas.front() > 0.24 * median);
        if (scene.triangles() < 32000) CHECK(narrowest > 0.17);
    }
}

TEST_CASE("a tree is closed wood and open leaves of two triangles, none of them degenerate")
{
    const scenes::Scene scene = scenes::tree(), bare = scenes::tree({.leaves = 0}),
                        other = scenes::tree({.seed = 9});
    CHECK(scene.triangles() > 30000);
    CHECK(scene.triangles() < 60000);
    CHECK(other.triangles() == scene.triangles());
    CHECK(other.positions != scene.positions);
    const Surfaces wood = surfaces(bare, Joined::by_vertices);
    CHECK(wood.count > 300);
    CHECK(wood.outward == wood.count);
    CHECK(wood.open_edges == 0);
    CHECK(wood.torn == 0);
    const Surfaces all = surfaces(scene, Joined::by_vertices);
    const std::size_t leaves = all.count - wood.count;
    CHECK(leaves > 4000);
    CHECK(scene.triangles() == bare.triangles() + 2 * leaves);
    // Four edges without an opposite: eight corners of triangles see one.
    CHECK(all.open_edges > 0);
    CHECK(all.open_edges % leaves == 0);
    CHECK(scene.positions.size() == bare.positions.size() + 12 * leaves);
}

TEST_CASE("the handle of the cup stands off its wall and opens into it")
{
    const scenes::Scene scene = scenes::cup();
    nook::Bvh bvh;
    REQUIRE(bvh.build(scene.mesh()));
    // Through the middle of the handle from beside it, and past both its sides.
    const auto crossings = [&](glm::dvec3 from, const glm::dvec3& towards) {
        int count = 0;
        for (nook::Hit hit = bvh.closest({from, towards}); hit && count < 100;
             hit = bvh.closest({from, towards})) {
            from += towards * (hit.t + 1e-5);
            ++count;
        }
        return count;
    };
    // Wall, gap, handle.
    CHECK(crossings({3, 0.85, 0.003}, {-1, 0, 0}) == 6);
    CHECK(crossings({3, 0.85, 0.2}, {-1, 0, 0}) == 4);
    // Along the handle where it enters the wall: the wall is not closed behind it.
    CHECK(crossings({1.02, 1.14, 0.003}, {-1, 0, 0}) == 3);
    // Into the cup from above, through its floor.
    CHECK(crossings({0.1, 3, 0.2}, {0, -1, 0}) == 2);
}

TEST_CASE("the pictures of temple and city hold buildings, ground and sky")
{
    for (const scenes::Scene& scene : {scenes::temple(), scenes::city()}) {
        CAPTURE(scene.name);
        const Drawn drawn = draw(scene, 240, 150);
        CHECK(drawn.background > 240 * 150 / 20);
        CHECK(drawn.background < 240 * 150 / 2);
        CHECK(drawn.nearest > 1);
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
    CHECK(scene.triangles() < 65000);
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
    for (const scenes::Entry& entry : scenes::all()) {
        const scenes::Scene scene = entry.make();
        for (const bool orthographic : {false, true})
            for (const double aspect : {16.0 / 9, 1.0, 0.4}) {
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
