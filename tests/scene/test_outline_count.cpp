#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/outline_count.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"
#include "shells.hpp"

namespace {

using nook::Camera;
using nook::Image;
using nook::Projection;
using nook::ViewFrame;
using shells::Shells;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

struct View {
    ViewFrame frame;
    Projection projection;
};
View view_of(const Camera& camera, int width, int height)
{
    return {nook::view_frame(camera), nook::projection(camera, width, height)};
}

template <class Depth>
Image<std::int32_t> count(const Shells& shells, double extent, const Depth& depth, const View& view,
                          int width, int height)
{
    Image<std::int32_t> counts{width, height, -99};
    const nook::Outcome outcome = nook::outline_count(shells.view(), extent, depth, counts.view(),
                                                      view.frame, view.projection);
    REQUIRE(outcome);
    return counts;
}
Image<std::int32_t> count(const Shells& shells, double extent, const Image<float>& depth,
                          const View& view)
{
    return count(shells, extent, depth.view(), view, depth.width(), depth.height());
}

Image<float> random_depths(std::mt19937& random, int width, int height, double nearest,
                           double farthest)
{
    std::uniform_real_distribution<double> unit{0, 1};
    Image<float> depth{width, height};
    for (float& d : depth)
        d = static_cast<float>(nearest * std::pow(farthest / nearest, unit(random)));
    return depth;
}

struct Comparison {
    int compared = 0, left_out = 0, wrong = 0, contained = 0;
};
/// Counts against solid angles, away from the faces by what a displacement by a unit of the grid
/// may change.
Comparison compare(const Shells& shells, double extent, const Image<float>& depth, const View& view)
{
    const Image<std::int32_t> counts = count(shells, extent, depth, view);
    double farthest = 1;
    for (std::size_t t = 0; t < shells.indices.size() / 3; ++t)
        farthest =
            std::fmax(farthest, shells::length(shells.corner(t, 0, extent) - view.frame.origin));
    const Projection& projection = view.projection;
    const double pixel =
        (projection.orthographic ? 1 : farthest) / std::fmin(projection.fx, projection.fy);
    Comparison result;
    for (int y = 0; y < depth.height(); ++y) {
        for (int x = 0; x < depth.width(); ++x) {
            const nook::ViewPoint p =
                nook::view_point(projection, x + 0.5, y + 0.5, double{depth(x, y)});
            const shells::Winding expected = shells::winding(
                shells, extent, nook::point_to_world(view.frame, {p.x, p.y, p.z}), pixel * 0x1p-8);
            if (expected.close) {
                ++result.left_out;
                continue;
            }
            ++result.compared;
            result.contained += expected.count != 0 ? 1 : 0;
            result.wrong += counts(x, y) != expected.count ? 1 : 0;
        }
    }
    return result;
}

}  // namespace

TEST_CASE("the count is the number of shells that contain the visible point")
{
    std::mt19937 random{1};
    std::uniform_real_distribution<double> unit{-1, 1};
    int compared = 0, left_out = 0, contained = 0;
    for (int trial = 0; trial < 24; ++trial) {
        CAPTURE(trial);
        // The viewer stands among the bodies, often inside some of them.
        const Shells shells = shells::random_shells(random, 12, 1.5);
        Camera camera{.eye = {unit(random), unit(random), unit(random)},
                      .target = {2 * unit(random), 2 * unit(random), 4},
                      .orthographic = trial % 3 == 2};
        camera.vertical_fov = 0.6 + 0.5 * (trial % 4);
        camera.view_height = 3;
        View view = view_of(camera, 37, 29);
        if (trial % 4 == 1) {
            view.projection.cx += 9.3;
            view.projection.cy -= 40;
            view.projection.fx *= 1.7;
        }
        if (trial % 5 == 4) view.frame.right = view.frame.right * -1.0;
        const Image<float> depth = random_depths(random, 37, 29, 0.02, 6);
        const Comparison result = compare(shells, 0.05 * (trial % 3), depth, view);
        CHECK(result.wrong == 0);
        compared += result.compared;
        left_out += result.left_out;
        contained += result.contained;
    }
    CHECK(left_out < compared / 4);
    CHECK(contained > compared / 4);
}

TEST_CASE("triangles across a wide picture of smooth depths are counted in every part of it")
{
    // Depths that change slowly: whole tiles lie before a face, or behind it, and others are cut by it.
    std::mt19937 random{9};
    int compared = 0, contained = 0;
    for (int trial = 0; trial < 6; ++trial) {
        CAPTURE(trial);
        const int width = 2300, height = 9 + 3 * trial;
        const Shells shells = shells::random_shells(random, 3, 0.4);
        View view = view_of({.eye = {0.1, 0.2, 1.5},
                             .orthographic = trial % 2 == 1,
                             .vertical_fov = 0.02,
                             .view_height = 0.02},
                            width, height);
        view.projection.fx = view.projection.orthographic ? width / 2.0 : width / 1.5;
        Image<float> depth{width, height};
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                depth(x, y) = static_cast<float>(1.4 + 0.9 * std::sin(0.004 * x + 0.1 * y + trial));
        const Comparison result = compare(shells, 0, depth, view);
        CHECK(result.wrong == 0);
        compared += result.compared;
        contained += result.contained;
    }
    CHECK(compared > 150000);
    CHECK(contained > compared / 20);
}

TEST_CASE("in front of and behind all shells nothing is contained, whatever their shape")
{
    std::mt19937 random{2};
    for (int trial = 0; trial < 12; ++trial) {
        CAPTURE(trial);
        const Shells shells = shells::random_shells(random, 40, 2);
        const View view =
            view_of({.eye = {0, 0, 9}, .orthographic = trial % 2 == 1, .view_height = 5}, 150, 90);
        for (const float distance : {2.0f, 30.0f}) {
            const Image<std::int32_t> counts =
                count(shells, 0.1, Image<float>{150, 90, distance}, view);
            CHECK(std::all_of(counts.begin(), counts.end(), [](int c) { return c == 0; }));
        }
    }
}

TEST_CASE("points close to a viewer among closed surfaces have one count in every direction")
{
    // Vertices far and near, before and behind: most triangles are clipped. A gap or a pixel hit twice
    // would show as a pixel that differs.
    std::mt19937 random{3};
    std::normal_distribution<double> normal;
    int levels = 0;
    for (int trial = 0; trial < 60; ++trial) {
        CAPTURE(trial);
        Shells shells;
        for (int body = 0; body < 6; ++body) {
            meshes::Mesh mesh = meshes::icosphere(trial % 3);
            const double size = std::pow(10.0, normal(random));
            for (float& c : mesh.positions)
                c = static_cast<float>((double{c} + 0.8 * normal(random)) * size);
            shells.add(mesh, {0.1, 0.2, 0.3}, false);
        }
        View view =
            view_of({.eye = {0, 0, 0}, .target = {normal(random), normal(random), 1}}, 61, 47);
        view.projection.fx *= trial % 2 ? 1 : 20;
        view.projection.cx += trial % 3 == 0 ? 5000 : 0;
        const Image<std::int32_t> counts = count(shells, 0, Image<float>{61, 47, 1e-9f}, view);
        const int first = counts(0, 0);
        CHECK(std::all_of(counts.begin(), counts.end(), [&](int c) { return c == first; }));
        CHECK(first == shells::winding(shells, 0, {0, 0, 0}, 0).count);
        levels += first != 0 ? 1 : 0;
    }
    CHECK(levels > 20);
}

TEST_CASE("five thousand nested shells are all counted")
{
    Shells shells;
    for (int i = 0; i < 5000; ++i) {
        const double size = 1 + 1e-4 * i;
        shells.add_box({-size, -size, -size}, {size, size, size});
    }
    // In front of them, within all of them, and behind.
    for (const auto& [distance, expected] : {std::pair{3.0f, 0}, {5.0f, 5000}, {7.9f, 0}}) {
        const View view = view_of({.eye = {0, 0, 5}}, 20, 12);
        const Image<std::int32_t> counts = count(shells, 0, Image<float>{20, 12, distance}, view);
        CHECK(counts(10, 6) == expected);
    }
    // The viewer within all of them.
    const Image<std::int32_t> counts =
        count(shells, 0, Image<float>{20, 12, 0.25f}, view_of({.eye = {0, 0, 0.5}}, 20, 12));
    CHECK(std::all_of(counts.begin(), counts.end(), [](int c) { return c == 5000; }));
}

TEST_CASE("a convex object lies in its own shell alone")
{
    meshes::Mesh ball = meshes::icosphere(3);
    Shells shells;
    shells.add(ball, {0, 0, 0}, false);
    const View view = view_of({.eye = {1, 2, 3}}, 120, 90);
    Image<float> depth{120, 90};
    REQUIRE(nook::rasterise(ball.view(), view.frame, view.projection, {.depth = depth.view()}));
    const Image<std::int32_t> counts = count(shells, 0.1, depth, view);
    for (int y = 0; y < 90; ++y)
        for (int x = 0; x < 120; ++x) CHECK(counts(x, y) == (depth(x, y) < infinity ? 1 : 0));
}

TEST_CASE("two boxes that touch: the offset of the one is counted on the other")
{
    const meshes::Point low[2] = {{-1, -1, -1}, {0, -1, -1}}, high[2] = {{0, 1, 1}, {1, 0.25, 1}};
    meshes::Mesh mesh;
    Shells shells;
    for (std::size_t i = 0; i < 2; ++i) {
        mesh.box(low[i], high[i]);
        shells.add_box(low[i], high[i]);
    }
    const double extent = 0.2;
    for (const bool orthographic : {false, true}) {
        const View view = view_of(
            {.eye = {2.2, 3.1, 4}, .orthographic = orthographic, .view_height = 4}, 160, 120);
        Image<float> depth{160, 120};
        REQUIRE(nook::rasterise(mesh.view(), view.frame, view.projection, {.depth = depth.view()}));
        const Image<std::int32_t> counts = count(shells, extent, depth, view);
        int twice = 0;
        for (int y = 0; y < 120; ++y) {
            for (int x = 0; x < 160; ++x) {
                if (!(depth(x, y) < infinity)) {
                    CHECK(counts(x, y) == 0);
                    continue;
                }
                const nook::ViewPoint p =
                    nook::view_point(view.projection, x + 0.5, y + 0.5, double{depth(x, y)});
                const glm::dvec3 world = nook::point_to_world(view.frame, {p.x, p.y, p.z});
                int expected = 0;
                double margin = 1;
                for (std::size_t i = 0; i < 2; ++i) {
                    double inside = 1;
                    for (std::size_t k = 0; k < 3; ++k) {
                        const double c = k == 0 ? world.x : k == 1 ? world.y : world.z;
                        inside = std::fmin(inside, c - (low[i][k] - extent));
                        inside = std::fmin(inside, high[i][k] + extent - c);
                    }
                    expected += inside > 0 ? 1 : 0;
                    margin = std::fmin(margin, std::fabs(inside));
                }
                if (margin < 1e-3) continue;
                CHECK(counts(x, y) == expected);
                twice += expected == 2 ? 1 : 0;
            }
        }
        CHECK(twice > 200);
    }
}

TEST_CASE("a viewer inside a shell counts it where the surface is inside, and nowhere else")
{
    // The hull reaches from behind the viewer to distance 2: a wall at 1 is inside, at 3 outside.
    Shells shells;
    shells.add_box({-5, -5, -1}, {5, 5, 2});
    const View view = view_of({.eye = {0, 0, 1}, .target = {0, 0, 0}}, 33, 21);
    const auto all = [](const Image<std::int32_t>& counts, int value) {
        return std::all_of(counts.begin(), counts.end(), [&](int c) { return c == value; });
    };
    CHECK(all(count(shells, 0, Image<float>{33, 21, 1}, view), 1));
    CHECK(all(count(shells, 0, Image<float>{33, 21, 3}, view), 0));
    CHECK(all(count(shells, 1.5, Image<float>{33, 21, 3}, view), 1));
    // On a face: it counts as in front, so a point on the far side of the hull is outside.
    CHECK(all(count(shells, 0, Image<float>{33, 21, 2}, view), 0));
    const View outside = view_of({.eye = {0, 0, 4}, .target = {0, 0, 0}}, 33, 21);
    CHECK(all(count(shells, 0, Image<float>{33, 21, 2}, outside), 1));
    // The same among other distances, where pixels are compared one by one.
    Image<float> mixed{33, 21};
    for (int y = 0; y < 21; ++y)
        for (int x = 0; x < 33; ++x) mixed(x, y) = static_cast<float>(1 + x % 3);
    const Image<std::int32_t> within = count(shells, 0, mixed, view);
    const Image<std::int32_t> before = count(shells, 0, mixed, outside);
    for (int x = 0; x < 33; ++x) {
        CHECK(within(x, 10) == (x % 3 == 0 ? 1 : 0));
        CHECK(before(x, 10) == (x % 3 == 0 ? 0 : 1));
    }
}

TEST_CASE("a shell turned inside out lowers the counts in it by one")
{
    meshes::Mesh room;
    room.box({-2, -2, -2}, {2, 2, 2});
    for (std::size_t i = 0; i < room.indices.size(); i += 3)
        std::swap(room.indices[i], room.indices[i + 1]);
    Shells shells;
    shells.add(room, {0, 0, 0}, true);
    for (float& d : shells.direction) d = -d;
    const View view = view_of({.eye = {0, 0, 0}, .target = {0, 0, -1}}, 15, 11);
    // A point in the middle, and one on the wall, which the shell has left behind.
    CHECK(count(shells, 0.5, Image<float>{15, 11, 1}, view)(7, 5) == -1);
    CHECK(count(shells, 0.5, Image<float>{15, 11, 2}, view)(7, 5) == 0);
}

TEST_CASE("an open shell adds back faces less front faces behind the surface")
{
    Shells shells;
    meshes::Mesh sheet;
    sheet.quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0});
    shells.add(sheet, {0, 0, 1}, false);
    const Image<float> before{9, 7, 1}, beyond{9, 7, 3};
    const View front = view_of({.eye = {0, 0, 2}}, 9, 7);
    const View back = view_of({.eye = {0, 0, -2}}, 9, 7);
    CHECK(count(shells, 0, before, front)(4, 3) == -1);
    CHECK(count(shells, 0, before, back)(4, 3) == 1);
    CHECK(count(shells, 0, beyond, front)(4, 3) == 0);
    CHECK(count(shells, 0, beyond, back)(4, 3) == 0);
}

TEST_CASE("triangles with corners that are no numbers are left out")
{
    std::mt19937 random{4};
    const Shells shells = shells::random_shells(random, 8, 1);
    const View view = view_of({.eye = {0, 0, 4}}, 50, 40);
    const Image<float> depth = random_depths(random, 50, 40, 2, 6);
    const Image<std::int32_t> expected = count(shells, 0.1, depth, view);
    for (const float bad : {not_a_number, infinity, -infinity}) {
        for (const bool in_direction : {false, true}) {
            Shells broken = shells;
            const auto first = static_cast<std::uint32_t>(broken.base.size() / 3);
            broken.base.insert(broken.base.end(), {0, 0, 0, 1, 0, 0, 0, 1, 0});
            broken.direction.insert(broken.direction.end(), {0, 0, 0, 0, 0, 0, 0, 0, 0});
            (in_direction ? broken.direction : broken.base).back() = bad;
            broken.indices.insert(broken.indices.end(), {first, first + 1, first + 2});
            CHECK(count(broken, 0.1, depth, view) == expected);
        }
    }
    // Far, but numbers: closed, and no pixel is hit twice.
    Shells vast;
    vast.add_box({-3e38, -3e38, -3e38}, {3e38, 3e38, 3e38});
    const Image<std::int32_t> inside = count(vast, 3e38, depth, view);
    CHECK(std::all_of(inside.begin(), inside.end(), [](int c) { return c == 1; }));
}

TEST_CASE("triangles with corners beyond the range of double are left out")
{
    // Finite in the world, not along the axes of the view.
    std::mt19937 random{8};
    Shells shells = shells::random_shells(random, 8, 1);
    std::fill(shells.direction.begin(), shells.direction.end(), 0.0f);
    std::fill_n(shells.direction.begin(), 3, 1.0f);
    Shells rest = shells;
    rest.indices.clear();
    for (std::size_t i = 0; i < shells.indices.size(); i += 3) {
        const std::uint32_t* const t = shells.indices.data() + i;
        if (t[0] != 0 && t[1] != 0 && t[2] != 0) rest.indices.insert(rest.indices.end(), t, t + 3);
    }
    REQUIRE(rest.indices.size() < shells.indices.size());
    for (const bool orthographic : {false, true}) {
        const View view =
            view_of({.eye = {-4, -2, -3}, .orthographic = orthographic, .view_height = 4}, 50, 40);
        const Image<float> depth = random_depths(random, 50, 40, 2, 8);
        const Image<std::int32_t> expected = count(rest, 0, depth, view);
        CHECK(count(shells, 1.7e308, depth, view) == expected);
        CHECK(count(shells, 1e10, depth, view) != expected);
    }
}

TEST_CASE("a face that runs through all distances within a pixel is compared there")
{
    // A slab whose left side leans over the centre of a column by less than a pixel, from 2^126 before
    // the viewer, which is as far as distances are told apart, to 2^126 behind. It passes the centre at
    // a distance of 2^124.
    meshes::Mesh mesh;
    mesh.box({-0.05, -9, -0x1p126}, {5, 9, 0x1p126});
    for (std::size_t i = 0; i < mesh.positions.size(); i += 3)
        mesh.positions[i] += mesh.positions[i + 2] < 0 ? 0.2f : -0.2f;
    Shells shells;
    shells.add(mesh, {1, 1, 1}, false);
    View view = view_of({.eye = {0, 0, 0}, .target = {0, 0, -1}, .orthographic = true}, 17, 30);
    view.projection.fx = view.projection.fy = 1;
    Image<float> depth{17, 30};
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 17; ++x) depth(x, y) = y % 2 == 0 ? 1e37f : 3e37f;
    const Image<std::int32_t> counts = count(shells, 0, depth, view);
    for (int y = 7; y < 23; ++y) {
        CAPTURE(y);
        CHECK(counts(7, y) == 0);
        CHECK(counts(8, y) == (y % 2 == 0 ? 1 : 0));
        CHECK(counts(9, y) == 1);
    }
}

TEST_CASE("shells whose triangles share no vertices have the same counts")
{
    // Behind the surface and in front of it: two ways to one number.
    std::mt19937 random{7};
    for (int trial = 0; trial < 10; ++trial) {
        CAPTURE(trial);
        const Shells shells = shells::random_shells(random, 20, 1.5);
        Shells apart;
        for (const std::uint32_t index : shells.indices) {
            for (std::size_t k = 0; k < 3; ++k) {
                apart.base.push_back(shells.base[3 * index + k]);
                apart.direction.push_back(shells.direction[3 * index + k]);
            }
            apart.indices.push_back(static_cast<std::uint32_t>(apart.indices.size()));
        }
        const View view = view_of(
            {.eye = {0, 0, trial % 3 * 1.5}, .orthographic = trial % 2 == 1, .view_height = 4}, 150,
            70);
        const Image<float> depth = random_depths(random, 150, 70, 0.1, 8);
        CHECK(count(shells, 0.1, depth, view) == count(apart, 0.1, depth, view));
    }
}

TEST_CASE("a viewer on the face of a shell sees what is inside and what is not")
{
    Shells shells;
    shells.add_box({-1, -1, -1}, {1, 1, 0});
    const Image<float> depth{15, 11, 0.5f};
    const auto all = [&](const glm::dvec3& target, int value) {
        const Image<std::int32_t> counts =
            count(shells, 0, depth, view_of({.eye = {0, 0, 0}, .target = target}, 15, 11));
        return std::all_of(counts.begin(), counts.end(), [&](int c) { return c == value; });
    };
    CHECK(all({0, 0, -1}, 1));
    CHECK(all({0, 0, 1}, 0));
    // Along the face: the inside lies on the left.
    const Image<std::int32_t> along =
        count(shells, 0, depth, view_of({.eye = {0, 0, 0}, .target = {1, 0, 0}}, 15, 11));
    CHECK(along(2, 5) == 1);
    CHECK(along(12, 5) == 0);
}

TEST_CASE("background counts nothing, and may be all there is")
{
    Shells shells;
    shells.add_box({-50, -50, -50}, {50, 50, 50});
    for (const bool orthographic : {false, true}) {
        const View view =
            view_of({.eye = {0, 0, 4}, .orthographic = orthographic, .view_height = 5}, 9, 7);
        Image<float> depth{9, 7, 2};
        const float values[] = {infinity, not_a_number, 0, -1, -infinity};
        for (int x = 0; x < 5; ++x) depth(x, 3) = values[x];
        Image<std::int32_t> counts{9, 7};
        const nook::Outcome outcome = nook::outline_count(
            shells.view(), 0, depth.view(), counts.view(), view.frame, view.projection);
        REQUIRE(outcome);
        CHECK(outcome.work.pixels == 63);
        CHECK(outcome.work.background == 5);
        for (int y = 0; y < 7; ++y)
            for (int x = 0; x < 9; ++x) CHECK(counts(x, y) == (y == 3 && x < 5 ? 0 : 1));
        const Image<std::int32_t> sky = count(shells, 0, Image<float>{9, 7, infinity}, view);
        CHECK(std::all_of(sky.begin(), sky.end(), [](int c) { return c == 0; }));
    }
}

TEST_CASE("counts do not depend on threads, strides, alignment or what scratch held")
{
    std::mt19937 random{5};
    const Shells shells = shells::random_shells(random, 60, 2);
    const View view = view_of({.eye = {0, 0, 4}}, 131, 77);
    const Image<float> depth = random_depths(random, 131, 77, 1, 8);
    const Image<std::int32_t> expected = count(shells, 0.1, depth, view);
    for (const int threads : {2, 5}) {
        nook::ThreadExecutor executor{threads};
        Image<std::int32_t> counts{131, 77};
        std::vector<unsigned char> memory(
            nook::outline_scratch_size(shells.view(), 131, 77, threads) + 1, 0xff);
        const nook::Scratch scratch{memory.data() + 1, memory.size() - 1};
        REQUIRE(nook::outline_count(shells.view(), 0.1, depth.view(), counts.view(), view.frame,
                                    view.projection, scratch, executor));
        CHECK(counts == expected);
    }
    std::vector<std::int32_t> wide(2 * 131 * 77, 7);
    const nook::ImageView<std::int32_t> flipped{wide.data() + 2 * 131 * 76, 131, 77, -2 * 131, 2};
    REQUIRE(nook::outline_count(shells.view(), 0.1, depth.view(), flipped, view.frame,
                                view.projection));
    for (int y = 0; y < 77; ++y)
        for (int x = 0; x < 131; ++x) CHECK(flipped(x, y) == expected(x, y));
    CHECK(std::count(wide.begin(), wide.end(), 7) >= 131 * 77);
}

TEST_CASE("every kind of depth gives the counts of its distances")
{
    std::mt19937 random{6};
    const Shells shells = shells::random_shells(random, 30, 1.5);
    for (const bool orthographic : {false, true}) {
        Camera camera{.eye = {0, 0, 4},
                      .orthographic = orthographic,
                      .view_height = 4,
                      .near_plane = 0.5,
                      .far_plane = 20};
        const Image<float> depth = random_depths(random, 40, 30, 1, 8);
        const View view = view_of(camera, 40, 30);
        const Image<std::int32_t> expected = count(shells, 0.1, depth, view);
        Image<double> doubles{40, 30};
        std::copy(depth.begin(), depth.end(), doubles.begin());
        CHECK(count(shells, 0.1, doubles.view(), view, 40, 30) == expected);
        for (const nook::DepthEncoding encoding :
             {nook::DepthEncoding::standard, nook::DepthEncoding::reversed,
              nook::DepthEncoding::negative_z}) {
            View encoded = view;
            encoded.projection.encoding = encoding;
            Image<float> stored{40, 30};
            REQUIRE(nook::encode_depths(depth.view(), stored.view(), encoded.projection));
            const auto source = nook::hardware_depth(stored.view(), encoded.projection);
            const Image<std::int32_t> counts = count(shells, 0.1, source, encoded, 40, 30);
            int different = 0;
            for (int y = 0; y < 30; ++y)
                for (int x = 0; x < 40; ++x) different += counts(x, y) != expected(x, y);
            // Rounding may move a point through a face.
            CHECK(different <= 2);
        }
    }
}

TEST_CASE("images of one pixel, no pixel and no shell")
{
    Shells shells;
    shells.add_box({-1, -1, -1}, {1, 1, 1});
    CHECK(count(shells, 0, Image<float>{1, 1, 3}, view_of({.eye = {0, 0, 3}}, 1, 1))(0, 0) == 1);
    const Camera camera{.eye = {0, 0, 3}};
    CHECK(nook::outline_count(shells.view(), 0, nook::ImageView<const float>{}, {},
                              nook::view_frame(camera), nook::projection(camera, 1, 1)));
    CHECK(count({}, 1, Image<float>{3, 2, 3}, view_of(camera, 3, 2))(1, 1) == 0);
    // Off the screen on every side, and behind the viewer.
    for (const auto& at : std::vector<meshes::Point>{
             {50, 0, 0}, {-50, 0, 0}, {0, 50, 0}, {0, -50, 0}, {0, 0, 50}, {1e6, 1e6, -1}}) {
        Shells away;
        away.add_box({at[0] - 1, at[1] - 1, at[2] - 1}, {at[0] + 1, at[1] + 1, at[2] + 1});
        const Image<std::int32_t> counts =
            count(away, 0.5, Image<float>{31, 17, 2}, view_of(camera, 31, 17));
        CHECK(std::all_of(counts.begin(), counts.end(), [](int c) { return c == 0; }));
    }
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    Shells shells;
    shells.add_box({-1, -1, -1}, {1, 1, 1});
    const Image<float> depth{4, 3, 2};
    Image<std::int32_t> counts{4, 3, -5};
    const View good = view_of({.eye = {0, 0, 3}}, 4, 3);
    const auto run = [&](const nook::OutlineView& outlines, double extent, const View& view,
                         const nook::ImageView<std::int32_t>& out, auto&& scratch) {
        const nook::Outcome outcome = nook::outline_count(outlines, extent, depth.view(), out,
                                                          view.frame, view.projection, scratch);
        CHECK(std::all_of(counts.begin(), counts.end(), [](int c) { return c == -5; }));
        return outcome.error;
    };
    const nook::OutlineView view = shells.view();
    const auto outlines = [&](const nook::OutlineView& bad) {
        return std::string{run(bad, 0, good, counts.view(), nook::HeapScratch{}).argument};
    };
    nook::OutlineView bad = view;
    bad.base = nullptr;
    CHECK(outlines(bad) == "shells.base");
    bad = view;
    bad.direction = nullptr;
    CHECK(outlines(bad) == "shells.direction");
    bad = view;
    bad.indices = nullptr;
    CHECK(outlines(bad) == "shells.indices");
    bad = view;
    bad.vertex_count = 5;
    CHECK(run(bad, 0, good, counts.view(), nook::HeapScratch{}).code ==
          nook::ErrorCode::index_out_of_range);
    bad = view;
    bad.triangle_count = std::size_t{1} << 32;
    CHECK(outlines(bad) == "shells.triangle_count");
    for (const double extent : {-1.0, double{infinity}, double{not_a_number}})
        CHECK(std::string{run(view, extent, good, counts.view(), nook::HeapScratch{}).argument} ==
              "extent");
    View wrong = good;
    wrong.projection.fx = 0;
    CHECK(std::string{run(view, 0, wrong, counts.view(), nook::HeapScratch{}).argument} ==
          "projection.fx");
    wrong = good;
    wrong.frame.up.x = double{not_a_number};
    CHECK(std::string{run(view, 0, wrong, counts.view(), nook::HeapScratch{}).argument} ==
          "frame.up");
    nook::ImageView<std::int32_t> narrow = counts.view();
    narrow.width = 3;
    CHECK(run(view, 0, good, narrow, nook::HeapScratch{}).code == nook::ErrorCode::bad_size);
    nook::ImageView<std::int32_t> none = counts.view();
    none.data = nullptr;
    CHECK(run(view, 0, good, none, nook::HeapScratch{}).code == nook::ErrorCode::null_data);
    CHECK(run(view, 0, good, counts.view(), nook::Scratch{}).code ==
          nook::ErrorCode::scratch_too_small);
    CHECK(
        run(view, 0, good,
            {const_cast<std::int32_t*>(reinterpret_cast<const std::int32_t*>(depth.data())), 4, 3},
            nook::HeapScratch{})
            .code == nook::ErrorCode::overlap);
}
