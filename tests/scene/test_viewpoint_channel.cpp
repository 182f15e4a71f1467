#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nook/scene/rasteriser.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/thread_executor.hpp>

#include "channels.hpp"
#include "meshes.hpp"

namespace {

using channels::Areas;
using channels::Directions;
using channels::Values;
using meshes::Mesh;
using nook::BackFaces;
using nook::Camera;
using nook::ChannelOptions;
using nook::ErrorCode;
using nook::ViewpointChannel;
using nook::ViewProbability;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// All probabilities are in range, consistent, and sum to 1.
void check_probabilities(const ViewpointChannel& channel)
{
    const std::size_t views = channel.view_count(), polygons = channel.polygon_count();
    double all_views = 0, all_polygons = 0;
    std::size_t lit = 0, seen = 0, joint_wrong = 0, rows_wrong = 0;
    for (std::size_t v = 0; v < views; ++v) {
        all_views += channel.p_view(v);
        lit += channel.p_view(v) > 0 ? 1 : 0;
    }
    for (std::size_t o = 0; o < polygons; ++o) {
        all_polygons += channel.p_polygon(o);
        seen += channel.seen(o) ? 1 : 0;
        double row = 0, area = 0;
        std::size_t last = 0, visits = 0;
        channel.for_each_view(o, [&](std::size_t v, double a, double q) {
            row += channel.p_view_given_polygon(v, o);
            area += a;
            const double expected = channel.p_view(v) * channel.p_polygon_given_view(o, v);
            joint_wrong += a != channel.area(v, o) || !(q > 0) || (visits > 0 && v <= last) ||
                                   !(std::fabs(q - expected) <= 1e-14 * expected)
                               ? 1
                               : 0;
            last = v;
            ++visits;
        });
        rows_wrong += channel.seen(o) ? !(std::fabs(row - 1) < 1e-12) : row != 0;
        rows_wrong += area > channel.polygon_area(o) * (1 + 1e-12) ? 1 : 0;
    }
    CHECK(joint_wrong == 0);
    CHECK(rows_wrong == 0);
    for (std::size_t v = 0; v < views && polygons < 1000; ++v) {
        double column = 0;
        for (std::size_t o = 0; o < polygons; ++o) column += channel.p_polygon_given_view(o, v);
        CHECK(std::fabs(column - (channel.view_area(v) > 0 ? 1 : 0)) < 1e-12);
    }
    CHECK(std::fabs(all_views - (lit > 0 ? 1 : 0)) < 1e-12);
    CHECK(std::fabs(all_polygons - (lit > 0 ? 1 : 0)) < 1e-12);
    CHECK((seen > 0) == (lit > 0));
}

/// The same channel, bit for bit.
bool same(const ViewpointChannel& a, const ViewpointChannel& b)
{
    if (a.view_count() != b.view_count() || a.polygon_count() != b.polygon_count() ||
        a.entry_count() != b.entry_count() || a.total_area() != b.total_area())
        return false;
    for (std::size_t v = 0; v < a.view_count(); ++v)
        if (a.view_area(v) != b.view_area(v) || a.p_view(v) != b.p_view(v)) return false;
    for (std::size_t o = 0; o < a.polygon_count(); ++o) {
        if (a.p_polygon(o) != b.p_polygon(o)) return false;
        for (std::size_t v = 0; v < a.view_count(); ++v)
            if (a.area(v, o) != b.area(v, o)) return false;
    }
    return true;
}

/// A memory that counts, and gives nothing after a number of blocks.
struct Bank {
    int blocks_left = 1000;
    std::size_t held = 0, most = 0;

    [[nodiscard]] nook::Memory memory()
    {
        const auto allocate = [](std::size_t size, void* user) -> void* {
            Bank& bank = *static_cast<Bank*>(user);
            if (bank.blocks_left-- <= 0) return nullptr;
            bank.held += size;
            bank.most = (std::max)(bank.most, bank.held);
            return std::malloc(size);
        };
        const auto free_block = [](void* block, std::size_t size, void* user) {
            static_cast<Bank*>(user)->held -= size;
            std::free(block);
        };
        return {allocate, free_block, this};
    }
};

/// Looks down the z axis at a square of `height` units, the upper side towards +y.
Camera from_above(double height, double z = 5)
{
    return {.eye = {0, 0, z}, .target = {0, 0, z - 1}, .orthographic = true, .view_height = height};
}

TEST_CASE("probabilities are consistent and sum to 1, whatever p(v) is by")
{
    std::mt19937 random{81};
    for (const auto& [views, polygons] :
         {std::pair<std::size_t, std::size_t>{1, 1}, {2, 900}, {300, 2}, {70, 70}}) {
        Areas areas = channels::random_areas(random, views, polygons, 0.3);
        for (std::size_t o = 0; o < polygons; ++o) areas.at(views / 2, o) *= 1e9;
        areas.at(0, 0) = 0.25;
        ViewpointChannel channel = areas.channel();
        check_probabilities(channel);
        REQUIRE(!channel.set_probability(ViewProbability::uniform));
        check_probabilities(channel);
        Values importance(views, 0.0);
        for (std::size_t v = 0; v < views; v += 3) importance[v] = 1e-3 + areas.at(v, 0);
        REQUIRE(!channel.set_probability(ViewProbability::importance, importance.data()));
        check_probabilities(channel);
        for (std::size_t v = 0; v < views; ++v)
            CHECK((channel.p_view(v) > 0) == (importance[v] > 0 && channel.view_area(v) > 0));
        // And back.
        REQUIRE(!channel.set_probability(ViewProbability::projected_area));
        CHECK(same(channel, areas.channel()));
    }
}

TEST_CASE("the caller's areas come back, and views that see nothing have probability 0")
{
    ViewpointChannel channel = Areas{3, 2, {1.5, 0, 0, 0, 0.25, 4.25}}.channel();
    CHECK(channel.entry_count() == 3);
    CHECK(channel.area(0, 0) == 1.5);
    CHECK(channel.area(0, 1) == 0);
    CHECK(channel.area(2, 1) == 4.25);
    CHECK(channel.view_area(1) == 0);
    CHECK(channel.polygon_area(0) == 1.75);
    CHECK(channel.total_area() == 6);
    CHECK(channel.p_view(0) == 0.25);
    CHECK(channel.p_view(1) == 0);
    CHECK(channel.p_polygon_given_view(0, 1) == 0);
    REQUIRE(!channel.set_probability(ViewProbability::uniform));
    CHECK(channel.p_view(0) == 0.5);
    CHECK(channel.p_view(1) == 0);
    const double importance[] = {1, 1e300, 3};
    REQUIRE(!channel.set_probability(ViewProbability::importance, importance));
    CHECK(channel.p_view(0) == 0.25);
    CHECK(channel.p_view(2) == 0.75);
    check_probabilities(channel);
    // All weight where nothing is seen.
    const double blind[] = {0, 1, 0};
    REQUIRE(!channel.set_probability(ViewProbability::importance, blind));
    check_probabilities(channel);
    CHECK(!channel.seen(0));
}

TEST_CASE("areas and importance from one end of the range to the other give no NaN")
{
    const double largest = (std::numeric_limits<double>::max)();
    ViewpointChannel channel =
        Areas{3, 2, {largest, 1e-300, largest / 2, largest / 2, 1e-320, 0}}.channel();
    check_probabilities(channel);
    CHECK(channel.entry_count() == 3);
    CHECK(channel.p_view(0) == 0.5);
    CHECK(!std::isnan(channel.total_area()));
    const double importance[] = {largest, largest, 1e-300};
    REQUIRE(!channel.set_probability(ViewProbability::importance, importance));
    check_probabilities(channel);
    CHECK(channel.p_view(0) == 0.5);
    const ViewpointChannel least = Areas{2, 1, {4e-300, 12e-300}}.channel();
    check_probabilities(least);
    CHECK(std::fabs(least.p_view(0) - 0.25) < 1e-15);
    CHECK(least.area(1, 0) == 12e-300);
}

TEST_CASE("areas are the pixels of the item buffers")
{
    std::mt19937 random{82};
    const Mesh mesh = meshes::soup(random, 400);
    constexpr int size = 61;
    for (const double distance : {infinity, 2.5}) {
        const auto views = channels::cameras(mesh, channels::icosphere(0), {.distance = distance});
        const ViewpointChannel channel =
            channels::channel(mesh, views, {.resolution = size, .back_faces = BackFaces::counted});
        Areas areas{views.size(), mesh.indices.size() / 3};
        for (std::size_t v = 0; v < views.size(); ++v) {
            std::vector<float> depth(size * size);
            std::vector<std::uint32_t> faces(size * size);
            REQUIRE(nook::rasterise(mesh.view(), nook::view_frame(views[v]),
                                    nook::projection(views[v], size, size),
                                    {.depth = {depth.data(), size, size, size},
                                     .face = {faces.data(), size, size, size}}));
            for (const std::uint32_t face : faces)
                if (face != nook::no_face) areas.at(v, face) += 1;
        }
        const ViewpointChannel expected = areas.channel();
        CHECK(same(channel, expected));
        check_probabilities(channel);
        // Logarithms from a table, and of areas that are scaled.
        CHECK(channels::largest_difference(channels::pmi(channel), channels::pmi(expected)) <
              1e-13);
        CHECK(channels::largest_difference(channels::vmi(channel), channels::vmi(expected)) <
              1e-13);
    }
}

TEST_CASE("six views along the axes of a cube show it in whole pixels: exactly log2 6")
{
    std::vector<Camera> views;
    for (const glm::dvec3& axis : channels::signs(1))
        views.push_back({.eye = axis * 4.0, .orthographic = true, .view_height = 4});
    const ViewpointChannel channel = channels::channel(channels::cube(), views);
    CHECK(channel.total_area() == 6 * 256.0 * 256);
    for (std::size_t v = 0; v < 6; ++v) CHECK(channel.p_view(v) == 1.0 / 6);
    for (const double value : channels::pmi(channel))
        CHECK(std::fabs(value - std::log2(6)) < 1e-15);
    CHECK(std::fabs(channels::entropies(channel).information_by_views - std::log2(6)) < 1e-14);
}

/// Visible areas of a convex body in pixels, and by how much counts may differ from them.
struct PixelBounds {
    Areas areas, errors;

    PixelBounds(const Mesh& mesh, const Directions& views, const std::vector<Camera>& cameras,
                int size)
        : areas{views.size(), mesh.indices.size() / 3},
          errors{views.size(), mesh.indices.size() / 3}
    {
        for (std::size_t v = 0; v < views.size(); ++v) {
            const nook::ViewFrame frame = nook::view_frame(cameras[v]);
            const double scale = nook::projection(cameras[v], size, size).fx;
            for (std::size_t o = 0; o < areas.polygons; ++o) {
                glm::dvec3 corner[3];
                for (std::size_t k = 0; k < 3; ++k)
                    corner[k] = nook::point_to_view(
                                    frame, meshes::vertex_position(mesh, mesh.indices[3 * o + k])) *
                                scale;
                const auto [a, b, c] = corner;
                const double area = ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
                if (area < -1e-6) continue;
                // The centres in a row differ from its length by less than 1; the lengths of the rows
                // rise and then fall, and sum to the area up to the greatest. 1 for the grid.
                const double width = (std::max)({a.x, b.x, c.x}) - (std::min)({a.x, b.x, c.x});
                const double height = (std::max)({a.y, b.y, c.y}) - (std::min)({a.y, b.y, c.y});
                areas.at(v, o) = area < 1e-6 ? 0 : area;
                errors.at(v, o) = width + height + 2;
            }
        }
    }

    /// How far the PMI of counts within the bounds may be from the PMI of the areas, which is `pmi`.
    [[nodiscard]] double tolerance(std::size_t o, double pmi) const
    {
        double whole = 0, whole_error = 0, row = 0, row_error = 0, result = 0;
        for (std::size_t v = 0; v < areas.views; ++v) {
            row += areas.at(v, o);
            row_error += errors.at(v, o);
            for (std::size_t i = 0; i < areas.polygons; ++i) {
                whole += areas.at(v, i);
                whole_error += errors.at(v, i);
            }
        }
        REQUIRE(row_error < row / 2);
        for (std::size_t v = 0; v < areas.views; ++v) {
            if (errors.at(v, o) == 0) continue;
            double sum = 0, error = 0;
            for (std::size_t i = 0; i < areas.polygons; ++i) {
                sum += areas.at(v, i);
                error += errors.at(v, i);
            }
            const double a = areas.at(v, o), e = errors.at(v, o);
            const double p[] = {(std::max)(a - e, 0.0) / (row + row_error),
                                (a + e) / (row - row_error)};
            const double q[] = {(sum - error) / (whole + whole_error),
                                (sum + error) / (whole - whole_error)};
            REQUIRE(q[0] > 0);
            // p log2(p / q) less a multiple of p, whose sum is 1: convex in p and falling in q.
            const auto term = [&](double x, double y) {
                return (x > 0 ? x * std::log2(x / y) : 0) - pmi * x;
            };
            const double now = term(a / row, sum / whole);
            const double lowest = std::clamp(q[1] * std::exp2(pmi) / std::exp(1.0), p[0], p[1]);
            result += (std::max)((std::max)(term(p[0], q[0]), term(p[1], q[0])) - now,
                                 now - term(lowest, q[1]));
        }
        return result;
    }
};

TEST_CASE(
    "item buffers of cube and tetrahedron give the exact cases, up to the pixels of the edges")
{
    using channels::both;
    using channels::signs;
    const Mesh cube = channels::cube(), tetrahedron = channels::tetrahedron();
    const auto check = [](const Mesh& mesh, const Directions& views, double expected,
                          double most_tolerance) {
        constexpr int size = 512;
        const auto cameras = channels::cameras(mesh, views);
        const ViewpointChannel channel = channels::channel(
            mesh, cameras, {.resolution = size, .back_faces = BackFaces::left_out});
        const PixelBounds bounds{mesh, views, cameras, size};
        const Values exact = channels::pmi(bounds.areas.channel()), pmi = channels::pmi(channel);
        for (std::size_t o = 0; o < pmi.size(); ++o) {
            CAPTURE(views.size());
            const double tolerance = bounds.tolerance(o, exact[o]);
            CHECK(tolerance < most_tolerance);
            CHECK(std::fabs(exact[o] - expected) < 1e-6);
            CHECK(std::fabs(pmi[o] - expected) < tolerance);
        }
        check_probabilities(channel);
    };
    const Directions normals = channels::tetrahedron_axes(-1),
                     corners = channels::tetrahedron_axes(1);
    check(cube, signs(3), 1, 0.25);
    check(cube, signs(2), std::log2(3), 0.25);
    check(cube, both(signs(1), signs(3)), 1.4789272934768, 0.25);
    check(cube, both(both(signs(1), signs(2)), signs(3)), 1.5277903190458, 0.25);
    check(tetrahedron, normals, 2, 0.25);
    check(tetrahedron, corners, std::log2(4.0 / 3), 0.25);
    check(tetrahedron, both(normals, corners), 1.2075187496394, 0.25);
    check(tetrahedron, signs(1), 1, 0.25);
    check(cube, channels::icosphere(3), 1.283058048141, 0.25);
}

TEST_CASE("an empty mesh, no views, and a triangle alone")
{
    const Camera above = from_above(2), below{.eye = {0, 0, -5}, .orthographic = true};
    ViewpointChannel channel;
    REQUIRE(channel.build(nook::MeshView{}, &above, 1));
    CHECK(channel.polygon_count() == 0);
    CHECK(channel.view_count() == 1);
    CHECK(channel.p_view(0) == 0);
    Mesh mesh;
    // No pixel centre lies on an edge, so that both sides show as many.
    mesh.triangle({-0.5, -0.5, 0}, {0.52, -0.5, 0}, {-0.5, 0.49, 0});
    REQUIRE(channel.build(mesh.view(), nullptr, 0));
    CHECK(channel.polygon_count() == 1);
    CHECK(!channel.seen(0));

    // From above its front shows; from below the back.
    for (const BackFaces back_faces :
         {BackFaces::counted, BackFaces::occluding, BackFaces::left_out}) {
        channel =
            channels::channel(mesh, {above, below}, {.resolution = 64, .back_faces = back_faces});
        const bool counted = back_faces == BackFaces::counted;
        CHECK(channel.p_view(0) == (counted ? 0.5 : 1));
        CHECK(channel.p_view(1) == (counted ? 0.5 : 0));
        CHECK(channel.p_polygon(0) == 1);
        // p(o|v) = 1 wherever it is seen.
        CHECK(channels::pmi(channel)[0] == 0);
        check_probabilities(channel);
    }
}

TEST_CASE("a triangle alone is seen from half of the viewpoints")
{
    Mesh mesh;
    mesh.triangle({-0.5, -0.5, 0}, {0.5, -0.5, 0}, {-0.5, 0.5, 0});
    const Directions directions = channels::icosphere(2);
    ViewpointChannel channel =
        channels::channel(mesh, channels::cameras(mesh, directions), {.resolution = 64});
    for (std::size_t v = 0; v < directions.size(); ++v) {
        CAPTURE(directions[v].z);
        if (directions[v].z <= 0) CHECK(channel.view_area(v) == 0);
        if (directions[v].z > 0.1) CHECK(channel.view_area(v) > 0);
    }
    REQUIRE(!channel.set_probability(ViewProbability::uniform));
    CHECK(channels::pmi(channel)[0] < 1e-14);
}

TEST_CASE("nobody sees a cube inside a closed cube")
{
    Mesh mesh = channels::cube();
    mesh.box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
    const auto views = channels::cameras(mesh, channels::icosphere(1));
    const ViewpointChannel channel = channels::channel(mesh, views, {.resolution = 100});
    const Values pmi = channels::pmi(channel);
    for (std::size_t o = 0; o < 24; ++o) {
        CHECK(channel.seen(o) == (o < 12));
        CHECK((pmi[o] > 0) == (o < 12));
        if (o >= 12) CHECK(channel.p_view_given_polygon(0, o) == 0);
    }
    check_probabilities(channel);
    // The outer cube alone is the same to its own polygons.
    const ViewpointChannel alone = channels::channel(channels::cube(), views, {.resolution = 100});
    const Values outer = channels::pmi(alone);
    for (std::size_t o = 0; o < 12; ++o) CHECK(outer[o] == pmi[o]);
}

TEST_CASE("of two coincident polygons one is seen; polygons without area, or with NaN, are not")
{
    Mesh mesh = channels::cube();
    for (std::size_t i = 0; i < 36; ++i) mesh.indices.push_back(mesh.indices[i]);
    mesh.face(0, 0, 1);
    mesh.triangle({0, 0, 0}, {not_a_number, 1, 2}, {3, 3, 3});
    const ViewpointChannel channel = channels::channel(
        mesh, channels::cameras(mesh, channels::icosphere(1)), {.resolution = 64});
    for (std::size_t o = 0; o < 26; ++o) CHECK(channel.seen(o) == (o < 12));
    check_probabilities(channel);
    const double information = channels::entropies(channel).information_by_polygons;
    CHECK(information > 1);
    CHECK(information < std::log2(42));
}

TEST_CASE("a viewpoint inside a body, or one that looks away, sees nothing and does not count")
{
    const Mesh mesh = channels::cube();
    auto views = channels::cameras(mesh, channels::signs(3));
    const ViewpointChannel without = channels::channel(mesh, views, {.resolution = 64});
    views.push_back({.eye = {0, 0, 0}, .target = {1, 0, 0}});
    views.push_back({.eye = {5, 0, 0}, .target = {6, 0, 0}});
    const ViewpointChannel with = channels::channel(mesh, views, {.resolution = 64});
    for (std::size_t v = 8; v < 10; ++v) {
        CHECK(with.view_area(v) == 0);
        CHECK(with.p_view(v) == 0);
    }
    check_probabilities(with);
    CHECK(channels::pmi(with) == channels::pmi(without));
    const Values vmi = channels::vmi(with);
    CHECK(vmi[8] == 0);
    CHECK(vmi[9] == 0);
}

TEST_CASE("views of importance 0 are not drawn")
{
    const Mesh mesh = channels::cube();
    const auto views = channels::cameras(mesh, channels::icosphere(0));
    Values importance(12, 0.0);
    importance[3] = 1;
    importance[8] = 3;
    ViewpointChannel channel;
    const nook::Outcome outcome = channel.build(mesh.view(), views.data(), 12,
                                                {.resolution = 64,
                                                 .probability = ViewProbability::importance,
                                                 .importance = importance.data()});
    REQUIRE(outcome);
    CHECK(outcome.work.pixels == 2 * 64 * 64);
    CHECK(channel.p_view(3) == 0.25);
    CHECK(channel.p_view(8) == 0.75);
    for (std::size_t v = 0; v < 12; ++v) CHECK((channel.view_area(v) > 0) == (importance[v] > 0));
    check_probabilities(channel);
    // As if the channel had only these two.
    ViewpointChannel pair = channels::channel(mesh, {views[3], views[8]}, {.resolution = 64});
    const double both[] = {1, 3};
    REQUIRE(!pair.set_probability(ViewProbability::importance, both));
    CHECK(channels::pmi(pair) == channels::pmi(channel));
}

TEST_CASE("counts beyond 16 bits are kept whole")
{
    // Three rectangles over the whole picture, a part of it and a pixel: 2^18 pixels and less.
    Mesh mesh;
    mesh.triangle({-10, -10, 0}, {10, -10, 0}, {0, 20, 0});
    mesh.triangle({-1, -1, 1}, {1, -1, 1}, {-1, 1, 1});
    mesh.triangle({0, 0, 2}, {0.004, 0, 2}, {0, 0.004, 2});
    const std::vector<Camera> views{from_above(2), from_above(2, -5), from_above(0.5),
                                    from_above(1000), from_above(2)};
    const ViewpointChannel channel = channels::channel(mesh, views);
    for (const std::size_t v : {0u, 4u}) {
        CHECK(channel.view_area(v) == 262144);
        CHECK(channel.area(v, 1) > 65535);
        CHECK(channel.area(v, 0) + channel.area(v, 1) + channel.area(v, 2) == 262144);
        CHECK(channel.area(v, 2) == 1);
    }
    CHECK(channel.area(2, 0) + channel.area(2, 1) + channel.area(2, 2) == 262144);
    CHECK(channel.area(1, 0) == 0);
    CHECK(channel.area(3, 0) < 100);
    check_probabilities(channel);
    // One triangle alone: 2^18 has nothing in its lower half.
    mesh.indices.resize(3);
    const ViewpointChannel alone = channels::channel(mesh, views);
    CHECK(alone.area(0, 0) == 262144);
    CHECK(alone.area(3, 0) < 100);
    CHECK(alone.area(4, 0) == 262144);
    check_probabilities(alone);
}

TEST_CASE("a million polygons of which one pixel is visible")
{
    constexpr std::size_t polygons = 1000000;
    Mesh mesh;
    mesh.triangle({-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0, 0.2, 0});
    mesh.triangle({5, 5, -1}, {6, 5, -1}, {5, 6, -1});
    while (mesh.indices.size() < 3 * polygons) mesh.face(3, 4, 5);
    const std::vector<Camera> views{from_above(1), from_above(1, -5)};
    const ViewpointChannel channel = channels::channel(mesh, views, {.resolution = 1});
    CHECK(channel.polygon_count() == polygons);
    CHECK(channel.entry_count() == 1);
    CHECK(channel.total_area() == 1);
    CHECK(channel.p_polygon(0) == 1);
    CHECK(channel.p_view(0) == 1);
    check_probabilities(channel);
    const Values pmi = channels::pmi(channel);
    CHECK(*std::max_element(pmi.begin(), pmi.end()) == 0);
    CHECK(channels::entropies(channel).joint == 0);
}

TEST_CASE("any number of threads gives the same channel")
{
    std::mt19937 random{83};
    const Mesh mesh = meshes::icosphere(5);
    const auto views = channels::cameras(mesh, channels::icosphere(0));
    const auto built = [&](int threads) {
        nook::ThreadExecutor executor{threads};
        ViewpointChannel channel;
        REQUIRE(channel.build(mesh.view(), views.data(), views.size(), {.resolution = 200}, {},
                              executor));
        return channel;
    };
    const ViewpointChannel one = built(1);
    check_probabilities(one);
    // Through the pages of all blocks.
    std::vector<std::uint32_t> counts(mesh.indices.size() / 3);
    std::size_t wrong = 0, entries = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
        REQUIRE(nook::visible_counts(mesh.view(), nook::view_frame(views[v]),
                                     nook::projection(views[v], 200, 200), 200, 200,
                                     counts.data()));
        for (std::size_t o = 0; o < counts.size(); ++o) {
            wrong += one.area(v, o) != counts[o] ? 1 : 0;
            entries += counts[o] > 0 ? 1 : 0;
        }
    }
    CHECK(wrong == 0);
    CHECK(one.entry_count() == entries);
    CHECK(same(one, built(2)));
    CHECK(same(one, built(5)));
}

TEST_CASE("memory comes from the caller, is as small as stated, and its lack is reported")
{
    const Mesh mesh = meshes::icosphere(4);
    const auto views = channels::cameras(mesh, channels::icosphere(1));
    const ChannelOptions options{.resolution = 150};
    const std::size_t polygons = mesh.indices.size() / 3;
    Bank bank;
    {
        ViewpointChannel channel;
        REQUIRE(channel.build(mesh.view(), views.data(), views.size(), options, bank.memory()));
        CHECK(bank.held == channel.memory_size());
        // Besides: the table of logarithms, and pages that are not full.
        const std::size_t fixed = 24 << 10;
        CHECK(bank.held <= 4 * channel.entry_count() + 16 * polygons + 40 * views.size() + fixed);
        CHECK(bank.most <= bank.held + channel.entry_count() + 4 * polygons + fixed +
                               nook::visible_counts_scratch_size(mesh.view(), 150, 150, 1));
        const ViewpointChannel moved = std::move(channel);
        CHECK(moved.memory_size() == bank.held);
        CHECK(channel.view_count() == 0);
        check_probabilities(moved);
    }
    CHECK(bank.held == 0);
    const int used = 1000 - bank.blocks_left;
    const Areas areas{2, 2, {1, 2, 3, 4}};
    for (int blocks = 0; blocks < used; ++blocks) {
        Bank poor{.blocks_left = blocks};
        ViewpointChannel channel = areas.channel();
        const nook::Outcome outcome =
            channel.build(mesh.view(), views.data(), views.size(), options, poor.memory());
        CHECK(outcome.error.code == ErrorCode::out_of_memory);
        CHECK(outcome.error.value > 0);
        CHECK(poor.held == 0);
        CHECK(same(channel, areas.channel()));
    }
    for (int blocks = 0; blocks < 2; ++blocks) {
        Bank poor{.blocks_left = blocks};
        ViewpointChannel channel = areas.channel();
        CHECK(channel.build(areas.values.data(), 1, 4, poor.memory()).code ==
              ErrorCode::out_of_memory);
        CHECK(poor.held == 0);
        CHECK(same(channel, areas.channel()));
    }
}

TEST_CASE("bad arguments are told, and leave the channel as it was")
{
    const Areas areas{2, 2, {1, 2, 3, 4}};
    ViewpointChannel channel = areas.channel();
    const auto check = [&](const nook::Error& error, ErrorCode code, const char* argument,
                           double value) {
        CHECK(error.code == code);
        CHECK(std::string{error.argument} == argument);
        CHECK((error.value == value || (std::isnan(value) && std::isnan(error.value))));
        CHECK(same(channel, areas.channel()));
    };
    for (const double bad : {-1.0, infinity, not_a_number}) {
        const double values[] = {1, 2, bad, 4};
        check(channel.build(values, 2, 2), ErrorCode::bad_value, "areas", bad);
        const double importance[] = {1, bad};
        check(channel.set_probability(ViewProbability::importance, importance),
              ErrorCode::bad_value, "importance", bad);
    }
    const double zeros[] = {0, 0};
    check(channel.set_probability(ViewProbability::importance, zeros), ErrorCode::bad_value,
          "importance", 0);
    check(channel.set_probability(ViewProbability::importance), ErrorCode::null_data, "importance",
          0);
    check(channel.build(nullptr, 1, 1), ErrorCode::null_data, "areas", 0);
    check(channel.build(zeros, 65536, 0), ErrorCode::bad_size, "view_count", 65536);
    check(channel.build(zeros, 0, 0xffffffff), ErrorCode::bad_size, "polygon_count", 0xffffffff);

    const Mesh mesh = channels::cube();
    std::vector<Camera> views = channels::cameras(mesh, channels::signs(1));
    const auto build = [&](const ChannelOptions& options) {
        return channel.build(mesh.view(), views.data(), views.size(), options).error;
    };
    check(channel.build(mesh.view(), nullptr, 6).error, ErrorCode::null_data, "views", 0);
    check(channel.build(mesh.view(), views.data(), 65536).error, ErrorCode::bad_size, "view_count",
          65536);
    check(build({.resolution = 0}), ErrorCode::bad_value, "options.resolution", 0);
    check(build({.resolution = 32769}), ErrorCode::bad_value, "options.resolution", 32769);
    // Counts of 16 samples to a pixel have to fit into 32 bits.
    const std::vector<std::uint8_t> levels(mesh.indices.size() / 3, 0);
    check(build({.resolution = 16384, .levels = levels.data()}), ErrorCode::bad_value,
          "options.resolution", 16384);
    check(build({.probability = ViewProbability{3}}), ErrorCode::bad_value, "options.probability",
          3);
    check(channel.set_probability(ViewProbability{255}), ErrorCode::bad_value, "probability", 255);
    check(build({.probability = ViewProbability::importance}), ErrorCode::null_data,
          "options.importance", 0);
    const double importance[] = {1, 0, 1, 1, 0, -2};
    check(build({.probability = ViewProbability::importance, .importance = importance}),
          ErrorCode::bad_value, "options.importance", -2);
    views[4].view_height = -1;
    check(build({}), ErrorCode::bad_value, "index of a view", 4);
    Mesh broken = mesh;
    broken.indices[5] = 1000;
    check(channel.build(broken.view(), views.data(), 1).error, ErrorCode::index_out_of_range,
          "mesh.indices", 1000);
}

}  // namespace
