#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/scene/bvh.hpp>
#include <nook/scene/information_ao.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::BackFaces;
using nook::Camera;
using nook::ErrorCode;
using nook::InformationOptions;
using nook::InformationReport;
using nook::PolygonState;
using nook::ViewProbability;

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Maps {
    std::vector<float> pmi, information_visibility, visibility;
    std::vector<PolygonState> state;
    InformationReport report{};

    explicit Maps(std::size_t count)
        : pmi(count, -1.0f),
          information_visibility(count, -1.0f),
          visibility(count, -1.0f),
          state(count)
    {}
    [[nodiscard]] nook::InformationMaps view()
    {
        return {pmi.data(), information_visibility.data(), visibility.data(), state.data()};
    }
    [[nodiscard]] bool operator==(const Maps& other) const
    {
        return pmi == other.pmi && information_visibility == other.information_visibility &&
               visibility == other.visibility && state == other.state;
    }
    [[nodiscard]] float least() const { return *std::min_element(pmi.begin(), pmi.end()); }
    [[nodiscard]] float most() const { return *std::max_element(pmi.begin(), pmi.end()); }
    [[nodiscard]] bool all(PolygonState s) const
    {
        return std::count(state.begin(), state.end(), s) == std::ptrdiff_t(state.size());
    }
};

Maps information(const Mesh& mesh, const std::vector<Camera>& views,
                 const InformationOptions& options = {})
{
    Maps maps{mesh.indices.size() / 3};
    const nook::Outcome outcome = nook::information_ao(mesh.view(), views.data(), views.size(),
                                                       maps.view(), options, &maps.report);
    REQUIRE(outcome);
    CHECK(outcome.work.passes == maps.report.views);
    const auto within = [](const std::vector<float>& values, float most) {
        return std::all_of(values.begin(), values.end(),
                           [&](float value) { return value >= 0 && value <= most; });
    };
    // At most −log2 of the least p(v).
    CHECK(within(maps.pmi, 400));
    CHECK(within(maps.information_visibility, 1));
    CHECK(within(maps.visibility, 1));
    for (std::size_t o = 0; o < maps.state.size(); ++o)
        if (maps.state[o] != PolygonState::seen &&
            (maps.pmi[o] != 0 || maps.information_visibility[o] != 0 || maps.visibility[o] != 0))
            FAIL_CHECK("polygon ", o, " is not seen");
    return maps;
}

std::vector<Camera> views_from(const Mesh& mesh, const std::vector<glm::dvec3>& directions,
                               double distance = infinity)
{
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh.view());
    std::vector<Camera> views;
    for (const glm::dvec3& d : directions)
        views.push_back(nook::viewpoint_camera(sphere, d, {.distance = distance}));
    return views;
}
std::vector<Camera> icosphere_views(const Mesh& mesh, int level, double distance = infinity)
{
    std::vector<glm::dvec3> directions(nook::icosphere_size(level));
    nook::icosphere(level, directions.data());
    return views_from(mesh, directions, distance);
}
/// Points of {-1, 0, 1}³ with so many zeros: 2 for face axes of the cube, 1 for edges, 0 for corners.
std::vector<glm::dvec3> grid_directions(int zeros)
{
    std::vector<glm::dvec3> result;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if ((x == 0) + (y == 0) + (z == 0) == zeros) result.emplace_back(x, y, z);
    return result;
}
template <class T>
std::vector<T> joined(std::vector<T> a, const std::vector<T>& b)
{
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

Mesh cube()
{
    Mesh mesh;
    mesh.box({-1, -1, -1}, {1, 1, 1});
    return mesh;
}
Mesh tetrahedron()
{
    Mesh mesh;
    const auto a = mesh.vertex({1, 1, 1}), b = mesh.vertex({1, -1, -1}),
               c = mesh.vertex({-1, 1, -1}), d = mesh.vertex({-1, -1, 1});
    mesh.face(a, b, c);
    mesh.face(a, d, b);
    mesh.face(a, c, d);
    mesh.face(b, d, c);
    return mesh;
}
/// Twelve triangles that nobody sees follow twelve that everybody does.
Mesh box_in_box()
{
    Mesh mesh = cube();
    mesh.box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
    return mesh;
}
/// A ball on a plate beside a wall: parts that touch, cross and hide each other.
Mesh crossing_bodies()
{
    Mesh mesh = meshes::icosphere(2, 0.5, {0, 0, 0.3});
    mesh.box({-1, -1, -0.2}, {1, 1, 0});
    mesh.box({0.3, -1, -0.1}, {0.6, 1, 1});
    return mesh;
}

/// PMI, worked out from the channel with the same samples.
std::vector<double> channel_information(const nook::ViewpointChannel& channel)
{
    std::vector<double> result(channel.polygon_count(), 0.0);
    for (std::size_t o = 0; o < result.size(); ++o)
        channel.for_each_view(o, [&](std::size_t v, double, double q) {
            const double share = q / channel.p_polygon(o);
            result[o] += share * std::log2(share / channel.p_view(v));
        });
    return result;
}

}  // namespace

TEST_CASE("Cube and tetrahedron have the information of the closed forms")
{
    // A face is at least 1/3 of the picture across, so its area is off by 4 * 3/R at most where all
    // its border runs along the grid; information changes by less than twice that.
    const InformationOptions options{.resolution = 512};
    const double tolerance = 2 * 12.0 / 512;
    const auto check = [&](const Mesh& mesh, const std::vector<glm::dvec3>& directions,
                           double by_area, double uniform) {
        InformationOptions chosen = options;
        for (const double expected : {by_area, uniform}) {
            const Maps maps = information(mesh, views_from(mesh, directions), chosen);
            CHECK(maps.all(PolygonState::seen));
            CHECK(maps.least() == doctest::Approx(expected).epsilon(0).scale(1).epsilon(tolerance));
            CHECK(maps.most() == doctest::Approx(expected).epsilon(0).scale(1).epsilon(tolerance));
            CHECK(maps.most() - maps.least() < 0.01);
            CHECK(maps.information_visibility == std::vector<float>(maps.pmi.size(), 1.0f));
            chosen.probability = ViewProbability::uniform;
        }
    };
    const auto axes = grid_directions(2), edges = grid_directions(1), corners = grid_directions(0);
    const double log2_3 = std::log2(3.0);
    check(cube(), axes, 1 + log2_3, 1 + log2_3);
    check(cube(), corners, 1, 1);
    check(cube(), edges, log2_3, log2_3);
    check(cube(), joined(axes, corners), 1.4789272934768, 1.6792696431662);
    check(cube(), joined(joined(axes, corners), edges), 1.5277903190458, 1.6357432697300);
    const std::vector<glm::dvec3> up{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    const std::vector<glm::dvec3> down{{-1, -1, -1}, {-1, 1, 1}, {1, -1, 1}, {1, 1, -1}};
    check(tetrahedron(), down, 2, 2);
    check(tetrahedron(), up, std::log2(4 / 3.0), std::log2(4 / 3.0));
    check(tetrahedron(), joined(up, down), 1.2075187496394, 1.2075187496394);
    check(tetrahedron(), axes, 1, 1);
}

TEST_CASE("From 642 viewpoints the cube and the tetrahedron have the tabulated information")
{
    const auto check = [](const Mesh& mesh, double by_area, double uniform) {
        const auto views = icosphere_views(mesh, 3);
        const Maps own = information(mesh, views, {.resolution = 160});
        const Maps even =
            information(mesh, views, {.resolution = 160, .probability = ViewProbability::uniform});
        // Counting errors of 642 pictures mostly cancel.
        CHECK(own.least() == doctest::Approx(by_area).epsilon(1e-3));
        CHECK(own.most() == doctest::Approx(by_area).epsilon(1e-3));
        CHECK(even.least() == doctest::Approx(uniform).epsilon(1e-3));
        CHECK(even.most() == doctest::Approx(uniform).epsilon(1e-3));
        for (const float value : own.visibility) CHECK(value > 1 - 2e-3);
    };
    check(cube(), 1.283058048141, 1.310123840882);
    check(tetrahedron(), 1.282259541499, 1.296111573420);
}

TEST_CASE("Facets of a ball have the information of a single open facet")
{
    const Mesh ball = meshes::icosphere(2);
    const Maps maps = information(ball, icosphere_views(ball, 2), {.resolution = 256});
    // Facing a vertex and a face of the icosphere of viewpoints: 1.3324 and 1.3193 at level 2,
    // other ways less; 1.2787 from everywhere.
    double mean = 0;
    for (const float value : maps.pmi) mean += double{value} / double(maps.pmi.size());
    CHECK(mean == doctest::Approx(1.278652479555518).epsilon(0.005));
    CHECK(maps.least() > 1.25f);
    CHECK(maps.most() < 1.34f);
}

TEST_CASE("The streamed sums give the information of the viewpoint channel")
{
    std::mt19937 random{11};
    const Mesh mesh = meshes::soup(random, 400);
    auto views = icosphere_views(mesh, 1);
    const auto close = icosphere_views(mesh, 0, 1.5);
    views.insert(views.end(), close.begin(), close.end());
    views[7].eye = views[7].target + 3.0 * (views[7].eye - views[7].target);
    std::vector<double> importance;
    for (std::size_t v = 0; v < views.size(); ++v)
        importance.push_back(v % 5 == 0 ? 0 : 1e3 + double(v % 7));
    const std::size_t count = mesh.indices.size() / 3;
    for (const double samples : {0.0, 4.0})
        for (const auto back_faces :
             {BackFaces::counted, BackFaces::occluding, BackFaces::left_out})
            for (const auto probability : {ViewProbability::projected_area,
                                           ViewProbability::uniform, ViewProbability::importance}) {
                const InformationOptions options{.resolution = 48,
                                                 .samples_per_polygon = samples,
                                                 .probability = probability,
                                                 .importance = importance.data(),
                                                 .back_faces = back_faces,
                                                 .leave_out_hidden_backs = false};
                const Maps maps = information(mesh, views, options);
                std::vector<std::uint8_t> levels(count);
                nook::SamplingPlan plan{};
                const bool important = probability == ViewProbability::importance;
                REQUIRE(!nook::plan_sampling(
                    mesh.view(), views.data(), views.size(),
                    {48, 2048, samples, important ? importance.data() : nullptr}, plan,
                    levels.data()));
                CHECK((plan.polygons[0] < plan.usable()) == (samples > 0));
                nook::ViewpointChannel channel;
                REQUIRE(channel.build(mesh.view(), views.data(), views.size(),
                                      {.resolution = 48,
                                       .back_faces = back_faces,
                                       .probability = probability,
                                       .importance = importance.data(),
                                       .levels = samples > 0 ? levels.data() : nullptr}));
                const auto expected = channel_information(channel);
                for (std::size_t o = 0; o < count; ++o) {
                    CHECK((maps.state[o] == PolygonState::seen) == channel.seen(o));
                    CHECK(std::fabs(double{maps.pmi[o]} - expected[o]) <=
                          0x1p-23 * expected[o] + 1e-12);
                }
            }
}

TEST_CASE("The sums keep 1e-13 bits of PMI over thousands of views")
{
    std::mt19937 random{5};
    constexpr std::size_t polygons = 40, view_count = 2562;
    std::vector<std::uint32_t> counts(polygons * view_count);
    for (std::size_t i = 0; i < counts.size(); ++i)
        counts[i] = random() % 3 == 0 ? 0 : static_cast<std::uint32_t>(random() >> (i % 31));
    // Sums of 2³², of one more, of 1 and of 0.
    for (std::size_t v = 0; v < view_count; ++v) {
        counts[v * polygons] = v < 4 ? 0x40000000 : 0;
        counts[v * polygons + 1] = v < 4 ? 0x40000000 : v == 9 ? 1 : 0;
        counts[v * polygons + 2] = v == 17 ? 1 : 0;
        counts[v * polygons + 3] = 0;
    }
    for (const bool weighted : {false, true}) {
        const auto weight = [&](std::size_t v) { return weighted ? 1.0 + double(v % 13) : 0; };
        nook::detail::ScratchLayout size;
        constexpr std::uint64_t most = std::uint64_t{view_count * polygons} << 32;
        static_cast<void>(nook::detail::InformationSums::take(size, polygons, weighted, most));
        std::vector<std::byte> memory(size.size());
        nook::detail::ScratchLayout layout{memory.data()};
        nook::detail::InformationSums sums{
            polygons, nook::detail::InformationSums::take(layout, polygons, weighted, most)};
        nook::Serial serial;
        long double total = 0;
        std::vector<long double> p(polygons, 0), areas(view_count, 0);
        for (std::size_t v = 0; v < view_count; ++v) {
            for (std::size_t o = 0; o < polygons; ++o) {
                sums.counts()[o] = counts[v * polygons + o];
                areas[v] += counts[v * polygons + o];
            }
            REQUIRE(sums.add(weight(v), serial));
            total += weighted ? weight(v) : areas[v];
        }
        sums.finish();
        const auto p_view = [&](std::size_t v) {
            return (weighted ? weight(v) : areas[v]) / total;
        };
        for (std::size_t o = 0; o < polygons; ++o) {
            for (std::size_t v = 0; v < view_count; ++v)
                p[o] += p_view(v) * counts[v * polygons + o] / areas[v];
            long double expected = 0, samples = 0;
            for (std::size_t v = 0; v < view_count; ++v) {
                const long double share = p_view(v) * counts[v * polygons + o] / areas[v] / p[o];
                samples += counts[v * polygons + o];
                if (share > 0) expected += share * std::log2(share / p_view(v));
            }
            CHECK(sums.samples(o) == double(samples));
            CHECK(sums.seen(o) == (o != 3));
            if (o != 3) CHECK(std::fabs(sums.information(o) - double(expected)) < 1e-13);
        }
    }
}

TEST_CASE("An inner box is hidden and gets 0")
{
    const Mesh mesh = box_in_box();
    const Maps maps = information(mesh, icosphere_views(mesh, 1));
    CHECK(maps.report.back_faces == BackFaces::left_out);
    CHECK(maps.report.polygons.seen == 12);
    CHECK(maps.report.polygons.hidden == 12);
    for (std::size_t o = 0; o < 24; ++o) {
        CHECK(maps.state[o] == (o < 12 ? PolygonState::seen : PolygonState::hidden));
        if (o < 12) CHECK(maps.information_visibility[o] == 1);
    }
    const Maps alone = information(cube(), icosphere_views(mesh, 1));
    CHECK(std::equal(alone.pmi.begin(), alone.pmi.end(), maps.pmi.begin()));
}

TEST_CASE("Back faces of closed meshes are left out, and nothing changes")
{
    for (const Mesh& mesh : {cube(), meshes::icosphere(3), crossing_bodies(), box_in_box()}) {
        for (const double distance : {infinity, 3.0}) {
            const auto views = icosphere_views(mesh, 1, distance);
            // With one sample per pixel: a tile's level depends on all that is drawn in it.
            InformationOptions options{.resolution = 128, .samples_per_polygon = 0};
            const Maps chosen = information(mesh, views, options);
            CHECK(chosen.report.back_faces == BackFaces::left_out);
            for (const auto back_faces : {BackFaces::left_out, BackFaces::occluding}) {
                options.back_faces = back_faces;
                options.leave_out_hidden_backs = false;
                CHECK(chosen == information(mesh, views, options));
            }
        }
    }
    Mesh open = cube();
    open.indices.resize(open.indices.size() - 3);
    CHECK(information(open, icosphere_views(open, 0)).report.back_faces == BackFaces::occluding);
    // One viewpoint inside is enough to see backs, unless it is not drawn.
    const Mesh mesh = box_in_box();
    auto views = icosphere_views(mesh, 0);
    views.push_back({.eye = {0.7, 0.7, 0.7}, .target = {0, 0, 0}});
    const Maps inside = information(mesh, views);
    CHECK(inside.report.back_faces == BackFaces::occluding);
    CHECK(inside.report.blind_views == 0);
    CHECK(inside.state[14] == PolygonState::seen);
    std::vector<double> importance(views.size(), 1);
    importance.back() = 0;
    const Maps outside = information(
        mesh, views, {.probability = ViewProbability::importance, .importance = importance.data()});
    CHECK(outside.report.back_faces == BackFaces::left_out);
    CHECK(outside.report.views == 12);
}

TEST_CASE("Convex bodies are open: their visibility is 1")
{
    constexpr int resolution = 256;
    for (const Mesh& mesh : {meshes::icosphere(2), cube()}) {
        const auto views = icosphere_views(mesh, 2);
        const Maps maps = information(mesh, views, {.resolution = resolution});
        const double scale = resolution / (2 * nook::bounding_sphere(mesh.view()).radius);
        for (std::size_t o = 0; o < maps.visibility.size(); ++o) {
            // A convex polygon holds as many points of a grid as its area says, up to half its
            // perimeter and 1 (Nosarzewska 1948).
            double area = 0, error = 0;
            for (const Camera& view : views) {
                const nook::ViewFrame frame = nook::view_frame(view);
                glm::dvec3 corner[3];
                for (std::size_t k = 0; k < 3; ++k) {
                    corner[k] =
                        scale * nook::point_to_view(
                                    frame, meshes::vertex_position(mesh, mesh.indices[3 * o + k]));
                    corner[k].z = 0;
                }
                const double seen = glm::cross(corner[1] - corner[0], corner[2] - corner[0]).z / 2;
                if (seen <= 0) continue;
                area += seen;
                error +=
                    1 + (glm::distance(corner[0], corner[1]) + glm::distance(corner[1], corner[2]) +
                         glm::distance(corner[2], corner[0])) /
                            2;
            }
            CHECK(double{maps.visibility[o]} > 1 - error / area);
            // Errors of many pictures mostly cancel: 1 % is ten times what they leave.
            CHECK(maps.visibility[o] > 0.99f);
        }
    }
    for (const double distance : {2.0, 1.05}) {
        const Mesh ball = meshes::icosphere(2);
        for (const float value :
             information(ball, icosphere_views(ball, 2, distance), {.resolution = 256}).visibility)
            CHECK(value > 0.98f);
    }
    // Half of what could be seen from both sides.
    for (const float value : information(cube(), icosphere_views(cube(), 2),
                                         {.resolution = 256, .back_faces = BackFaces::counted})
                                 .visibility)
        CHECK(value == doctest::Approx(0.5).epsilon(0.01));
}

TEST_CASE("Visibility is the share of directions that are open, weighted by the cosine")
{
    // The floor of a box without a lid, as wide as it is high: rays tell the same.
    Mesh mesh;
    mesh.quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
    const auto wall = [&](const meshes::Point& a, const meshes::Point& b) {
        mesh.quad(a, b, {b[0], b[1], 2}, {a[0], a[1], 2});
    };
    wall({-1, -1, 0}, {-1, 1, 0});
    wall({-1, 1, 0}, {1, 1, 0});
    wall({1, 1, 0}, {1, -1, 0});
    wall({1, -1, 0}, {-1, -1, 0});
    const auto views = icosphere_views(mesh, 3);
    const Maps maps = information(mesh, views, {.resolution = 192});
    nook::Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    double open = 0, all = 0;
    for (const Camera& view : views) {
        const glm::dvec3 d = glm::normalize(view.eye - view.target);
        if (d.z <= 0) continue;
        for (int i = 0; i < 20; ++i)
            for (int j = 0; j < 20; ++j) {
                const glm::dvec3 from{-0.95 + 0.1 * i, -0.95 + 0.1 * j, 1e-6};
                // Those in the first triangle.
                if (i <= j) continue;
                all += d.z;
                if (!bvh.occluded({from, d})) open += d.z;
            }
    }
    CHECK(double{maps.visibility[0]} == doctest::Approx(open / all).epsilon(0.02));
    // The form factor of two opposite faces of a cube.
    CHECK((double{maps.visibility[0]} + double{maps.visibility[1]}) / 2 ==
          doctest::Approx(0.19982).epsilon(0.05));
    CHECK(maps.state[0] == PolygonState::seen);
}

TEST_CASE("Open area is the projected area within the frame and the planes of a camera")
{
    std::mt19937 random{21};
    std::uniform_real_distribution<double> unit{-1, 1};
    const nook::BoundingSphere sphere{{0.1, -0.2, 0.3}, 1.5};
    for (int i = 0; i < 300; ++i) {
        Mesh mesh;
        const auto point = [&]() -> meshes::Point {
            return {0.1 + 0.8 * unit(random), -0.2 + 0.8 * unit(random), 0.3 + 0.8 * unit(random)};
        };
        mesh.triangle(point(), point(), point());
        const bool flat = i % 2 == 0;
        Camera view = nook::viewpoint_camera(sphere, meshes::random_direction(random),
                                             {.distance = flat ? infinity : 1.3});
        nook::detail::ScratchLayout size;
        static_cast<void>(nook::detail::OpenAreas::take(size, 1));
        std::vector<std::byte> memory(size.size());
        const auto areas = [&](const nook::BoundingSphere& s, bool both) {
            nook::detail::ScratchLayout layout{memory.data()};
            const nook::MeshView seen = mesh.view();
            nook::detail::OpenAreas result{seen, s, &view, 256,
                                           nook::detail::OpenAreas::take(layout, 1)};
            result.add(0);
            result.finish();
            return result.pixels(0, both);
        };
        // A sphere that does not fit sends every triangle through the clipper.
        nook::BoundingSphere wide = sphere;
        wide.radius = 100;
        for (const bool both : {false, true})
            CHECK(areas(sphere, both) == doctest::Approx(areas(wide, both)).epsilon(1e-9));
        // Moved, turned, cut: the samples that show it tell its area, up to its border.
        view.target.x += unit(random);
        view.near_plane = i % 3 == 0 ? 1.5 : 0;
        if (i % 5 == 0) view.far_plane = 2.5;
        std::uint32_t count = 0;
        REQUIRE(nook::visible_counts(mesh.view(), nook::view_frame(view),
                                     nook::projection(view, 256, 256), 256, 256, &count));
        CHECK(std::fabs(areas(wide, false) - double(count)) < 60);
    }
}

TEST_CASE("States agree with rays towards the viewpoints")
{
    std::mt19937 random{31};
    Mesh mesh = meshes::soup(random, 250);
    mesh.triangle({0, 0, 0}, {1, 1, 1}, {2, 2, 2});
    mesh.triangle({no_number, 0, 0}, {1, 0, 0}, {0, 1, 0});
    // Specks, open and in a box.
    mesh.box({-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3});
    const double s = 1e-3;
    mesh.triangle({0, 0, 0}, {s, 0, 0}, {0, s, 0});
    mesh.triangle({0, 0, 9}, {s, 0, 9}, {0, s, 9});
    mesh.triangle({0, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0});
    constexpr int resolution = 160;
    const auto views = icosphere_views(mesh, 2);
    const Maps maps =
        information(mesh, views, {.resolution = resolution, .samples_per_polygon = 0});
    nook::Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    const double radius = nook::bounding_sphere(mesh.view()).radius;
    std::uniform_real_distribution<double> unit{0, 1};
    std::size_t checked = 0;
    for (std::size_t o = 0; o < maps.state.size(); ++o) {
        const glm::dvec3 a = meshes::vertex_position(mesh, mesh.indices[3 * o]),
                         ab = meshes::vertex_position(mesh, mesh.indices[3 * o + 1]) - a,
                         ac = meshes::vertex_position(mesh, mesh.indices[3 * o + 2]) - a;
        const glm::dvec3 normal = glm::cross(ab, ac);
        if (!nook::is_usable_triangle(mesh.view(), o)) {
            CHECK(maps.state[o] == PolygonState::unusable);
            continue;
        }
        // Samples that it would show alone, and how many of them rays find open.
        double alone = 0, open = 0;
        for (const Camera& view : views) {
            const glm::dvec3 d = glm::normalize(view.eye - view.target);
            const double pixels =
                glm::dot(normal, d) / 2 * std::pow(resolution / (2 * radius), 2.0);
            if (pixels <= 0) continue;
            alone += pixels;
            if (maps.state[o] == PolygonState::seen) continue;
            for (int i = 0; i < 8; ++i) {
                double x = unit(random), y = unit(random);
                if (x + y > 1) x = 1 - x, y = 1 - y;
                const glm::dvec3 from = a + x * ab + y * ac;
                if (!bvh.occluded({from, d, infinity, static_cast<std::uint32_t>(o)}))
                    open += pixels / 8;
            }
        }
        INFO(o);
        switch (maps.state[o]) {
        case PolygonState::seen: break;
        case PolygonState::hidden:
            CHECK(alone > 15.9);
            // What the samples all missed is not much.
            CHECK(open < 8);
            ++checked;
            break;
        case PolygonState::too_small: CHECK(alone < 16.1); break;
        default: CHECK(false);
        }
    }
    CHECK(checked > 3);
    const std::size_t last = maps.state.size();
    CHECK(maps.state[last - 1] == PolygonState::hidden);
    CHECK(maps.state[last - 3] == PolygonState::too_small);
}

TEST_CASE("Polygons that no remaining viewpoint faces are told apart")
{
    const Mesh mesh = cube();
    const auto views = icosphere_views(mesh, 1);
    std::vector<double> importance;
    for (const Camera& view : views) importance.push_back(view.eye.z > 0.1 ? 1 : 0);
    const Maps maps = information(
        mesh, views, {.probability = ViewProbability::importance, .importance = importance.data()});
    // The sides of the box in order: −z, +z, −y, +y, −x, +x.
    CHECK(maps.state[0] == PolygonState::turned_away);
    CHECK(maps.state[1] == PolygonState::turned_away);
    CHECK(maps.report.polygons.turned_away == 2);
    CHECK(maps.report.polygons.seen == 10);
    CHECK(maps.report.views < views.size());
}

TEST_CASE("All importance on one view leaves no information, and no NaN")
{
    const Mesh mesh = crossing_bodies();
    const auto views = icosphere_views(mesh, 1);
    std::vector<double> importance(views.size(), 0.0);
    const Maps alone = information(mesh, {views[5]}, {.resolution = 128});
    for (const double amount : {1.0, 1e-300, 1e308}) {
        importance[5] = amount;
        const Maps maps = information(mesh, views,
                                      {.resolution = 128,
                                       .probability = ViewProbability::importance,
                                       .importance = importance.data()});
        CHECK(maps.report.views == 1);
        CHECK(maps.most() < 1e-6f);
        CHECK(maps.visibility == alone.visibility);
        CHECK(maps.state == alone.state);
        for (std::size_t o = 0; o < maps.state.size(); ++o)
            CHECK(maps.information_visibility[o] ==
                  (maps.state[o] == PolygonState::seen ? 1.0f : 0.0f));
    }
    // Next to nothing beside it hardly changes anything.
    for (double& amount : importance) amount = 1e-100;
    importance[5] = 1;
    const Maps maps = information(mesh, views,
                                  {.resolution = 128,
                                   .probability = ViewProbability::importance,
                                   .importance = importance.data()});
    CHECK(maps.report.views == views.size());
    for (std::size_t o = 0; o < maps.state.size(); ++o)
        if (alone.state[o] == PolygonState::seen) CHECK(maps.pmi[o] < 1e-6f);
}

TEST_CASE("Only the ratios of importance matter, and equal importance is uniform")
{
    const Mesh mesh = crossing_bodies();
    const auto views = icosphere_views(mesh, 1);
    std::vector<double> importance(views.size(), 1.0);
    InformationOptions options{.resolution = 128,
                               .probability = ViewProbability::importance,
                               .importance = importance.data()};
    const Maps even = information(mesh, views, options);
    CHECK(even ==
          information(mesh, views, {.resolution = 128, .probability = ViewProbability::uniform}));
    for (std::size_t v = 0; v < views.size(); ++v) importance[v] = 1 + double(v % 3);
    const Maps maps = information(mesh, views, options);
    CHECK(!(maps == even));
    CHECK(maps.visibility == even.visibility);
    for (double& amount : importance) amount *= 0x1p-600;
    CHECK(maps == information(mesh, views, options));
}

TEST_CASE("Doubled viewpoints and blind ones change nothing")
{
    const Mesh mesh = crossing_bodies();
    const auto views = icosphere_views(mesh, 1);
    auto blind = views;
    // In the middle of a body, and with everything behind it.
    blind.push_back({.eye = {0.45, 0, 0.9}, .target = {0.45, 0.5, 0.9}});
    blind.push_back({.eye = {9, 0, 0}, .target = {10, 0, 0}});
    for (const auto probability : {ViewProbability::projected_area, ViewProbability::uniform}) {
        const InformationOptions options{.resolution = 128,
                                         .samples_per_polygon = 0,
                                         .probability = probability,
                                         .leave_out_hidden_backs = false};
        const Maps maps = information(mesh, views, options);
        const Maps doubled = information(mesh, joined(views, views), options);
        CHECK(doubled.state == maps.state);
        for (std::size_t o = 0; o < maps.state.size(); ++o) {
            CHECK(std::fabs(doubled.pmi[o] - maps.pmi[o]) < 1e-6f);
            CHECK(std::fabs(doubled.visibility[o] - maps.visibility[o]) < 1e-6f);
        }
        const Maps blinded = information(mesh, blind, options);
        CHECK(blinded.report.blind_views == 2);
        CHECK(blinded == maps);
    }
}

TEST_CASE("Meshes without surface, views without sight and single polygons have stated results")
{
    const Mesh mesh = cube();
    CHECK(nook::information_ao({}, nullptr, 0, {}));
    const auto views = icosphere_views(mesh, 0);
    CHECK(nook::information_ao({}, views.data(), views.size(), {}));
    const Maps nobody = information(mesh, {});
    CHECK(nobody.all(PolygonState::turned_away));

    const Maps once = information(mesh, {views[3]});
    CHECK(once.most() < 1e-6f);
    CHECK(once.report.polygons.seen > 0);
    CHECK(once.report.polygons.turned_away > 0);
    CHECK(once.report.polygons.seen + once.report.polygons.turned_away == 12);

    // Every view that sees a lone polygon sees nothing else: it says nothing about the view.
    Mesh lone;
    lone.triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, 0});
    for (const auto probability : {ViewProbability::projected_area, ViewProbability::uniform}) {
        const Maps front =
            information(lone, icosphere_views(lone, 1), {.probability = probability});
        CHECK(front.pmi[0] < 1e-6f);
        CHECK(front.visibility[0] > 0.995f);
        CHECK(front.information_visibility[0] == 1);
        CHECK(front.report.back_faces == BackFaces::occluding);
        // Those behind it, and those in its plane.
        const auto all = icosphere_views(lone, 1);
        CHECK(front.report.blind_views ==
              std::size_t(std::count_if(all.begin(), all.end(),
                                        [](const Camera& view) { return view.eye.z < 1e-9; })));
    }
    const std::vector<Camera> behind = views_from(lone, {{0, 0, -1}});
    CHECK(information(lone, behind).state[0] == PolygonState::turned_away);
    const Maps counted = information(lone, behind, {.back_faces = BackFaces::counted});
    CHECK(counted.state[0] == PolygonState::seen);
    CHECK(counted.visibility[0] > 0.97f);

    // Of two at one place the first is seen.
    Mesh twice = lone;
    twice.face(0, 1, 2);
    const Maps both = information(twice, icosphere_views(twice, 1));
    CHECK(both.state[0] == PolygonState::seen);
    CHECK(both.state[1] == PolygonState::hidden);

    Mesh broken;
    broken.triangle({no_number, 0, 0}, {1, 0, 0}, {0, 1, 0});
    broken.triangle({0, 0, 0}, {0, 0, 0}, {0, 1, 0});
    CHECK(information(broken, views).all(PolygonState::unusable));
}

TEST_CASE("Any number of threads gives the same bits")
{
    std::mt19937 random{41};
    Mesh mesh = meshes::icosphere(5, 0.5);
    const Mesh more = meshes::soup(random, 300);
    for (const std::uint32_t index : more.indices)
        mesh.indices.push_back(index + static_cast<std::uint32_t>(mesh.positions.size() / 3));
    mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
    auto views = icosphere_views(mesh, 0);
    views.resize(4);
    const std::size_t count = mesh.indices.size() / 3;
    for (const auto probability : {ViewProbability::projected_area, ViewProbability::uniform}) {
        const InformationOptions options{.probability = probability};
        const auto run = [&](int workers) {
            nook::ThreadExecutor threads{workers};
            Maps maps{count};
            REQUIRE(nook::information_ao(mesh.view(), views.data(), views.size(), maps.view(),
                                         options, nullptr, nook::HeapScratch{}, threads));
            return maps;
        };
        const Maps one = run(1);
        CHECK(one == run(2));
        CHECK(one == run(5));
    }
}

TEST_CASE("The memory is what is stated, and it suffices")
{
    const Mesh mesh = meshes::icosphere(5);
    const std::size_t count = mesh.indices.size() / 3;
    const auto views = icosphere_views(mesh, 0);
    Maps maps{count};
    const auto maps_view = maps.view();
    const InformationOptions options{};
    const std::size_t size =
        nook::information_ao_scratch_size(mesh.view(), views.size(), maps_view, options, 1);
    const std::size_t pictures = nook::visible_counts_scratch_size(mesh.view(), 2048, 2048, 1);
    CHECK(size < 16 * count + pictures + 84 * views.size() + 40000);
    // Beside one item buffer of faces and depths, 32 bytes per polygon.
    CHECK(size < 32 * count + 8 * 256 * 256);
    const auto with = [&](nook::InformationMaps asked, const InformationOptions& o) {
        return nook::information_ao_scratch_size(mesh.view(), views.size(), asked, o, 1);
    };
    auto no_state = maps_view;
    no_state.state = nullptr;
    CHECK(with(no_state, options) == size + count);
    CHECK(with(maps_view, {.probability = ViewProbability::uniform}) == size + 8 * count);
    std::vector<std::byte> memory(size);
    const auto run = [&](std::size_t bytes) {
        return nook::information_ao(mesh.view(), views.data(), views.size(), maps_view, options,
                                    nullptr, nook::Scratch{memory.data(), bytes})
            .error.code;
    };
    CHECK(run(size - 1) == ErrorCode::scratch_too_small);
    CHECK(maps.pmi[0] == -1);
    CHECK(run(size) == ErrorCode::none);
    CHECK(maps == information(mesh, views));
}

TEST_CASE("Maps are written as far as they are asked for")
{
    const Mesh mesh = crossing_bodies();
    const auto views = icosphere_views(mesh, 0);
    const Maps all = information(mesh, views);
    Maps some{all.pmi.size()};
    const auto run = [&](const nook::InformationMaps& maps) {
        REQUIRE(nook::information_ao(mesh.view(), views.data(), views.size(), maps));
    };
    run({});
    run({.pmi = some.pmi.data()});
    run({.information_visibility = some.information_visibility.data()});
    run({.visibility = some.visibility.data()});
    run({.state = some.state.data()});
    CHECK(all == some);
}

TEST_CASE("Progress is told after each view")
{
    const Mesh mesh = cube();
    const auto views = icosphere_views(mesh, 0);
    std::vector<std::size_t> done;
    InformationOptions options{};
    options.user = &done;
    options.progress = [](std::size_t i, std::size_t count, void* user) {
        CHECK(count == 12);
        static_cast<std::vector<std::size_t>*>(user)->push_back(i);
    };
    static_cast<void>(information(mesh, views, options));
    CHECK(done == std::vector<std::size_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
}

TEST_CASE("Arguments that maps cannot be made of are refused, and nothing is written")
{
    Mesh mesh = cube();
    auto views = icosphere_views(mesh, 0);
    Maps maps{12};
    const auto error = [&](const InformationOptions& options) {
        const nook::Error found =
            nook::information_ao(mesh.view(), views.data(), views.size(), maps.view(), options)
                .error;
        CHECK(maps.pmi[0] == -1);
        return found;
    };
    CHECK(error({.resolution = -1}).code == ErrorCode::bad_value);
    CHECK(error({.resolution = 8193}).code == ErrorCode::bad_value);
    CHECK(error({.max_resolution = 0}).code == ErrorCode::bad_value);
    for (const double bad : {-1.0, no_number, infinity}) {
        CHECK(error({.samples_per_polygon = bad}).code == ErrorCode::bad_value);
        CHECK(error({.equal_within = bad}).code == ErrorCode::bad_value);
    }
    CHECK(error({.probability = ViewProbability{3}}).code == ErrorCode::bad_value);
    CHECK(error({.probability = ViewProbability::importance}).code == ErrorCode::null_data);
    std::vector<double> importance(12, 0.0);
    const InformationOptions important{.probability = ViewProbability::importance,
                                       .importance = importance.data()};
    CHECK(error(important).code == ErrorCode::bad_value);
    for (const double bad : {-1.0, no_number, infinity}) {
        importance[4] = bad;
        CHECK(error(important).code == ErrorCode::bad_value);
    }
    CHECK(nook::information_ao(mesh.view(), nullptr, 1, {}).error.code == ErrorCode::null_data);
    views[7].vertical_fov = -1;
    views[7].orthographic = false;
    const nook::Error view = error({});
    CHECK(view.code == ErrorCode::bad_value);
    CHECK(view.value == 7);
    views = icosphere_views(mesh, 0);
    mesh.indices[0] = 99;
    CHECK(error({}).code == ErrorCode::index_out_of_range);
}
