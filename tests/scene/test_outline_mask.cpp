#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/outline_count.hpp>
#include <nook/scene/outline_mask.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"
#include "shells.hpp"

namespace {

using nook::Image;
using nook::WorkMap;
using shells::Shells;

constexpr float infinity = std::numeric_limits<float>::infinity();

struct Picture {
    Shells shells;
    nook::ViewFrame frame;
    nook::Projection projection;
    Image<float> depth;
};
/// Random bodies as they are seen; the width is no multiple of a group.
Picture picture(unsigned seed, bool orthographic = false)
{
    std::mt19937 random{seed};
    Picture result;
    result.shells = shells::random_shells(random, 40, 2);
    const nook::Camera camera{.eye = {0.5, 1, 6}, .orthographic = orthographic, .view_height = 5};
    const int width = 173, height = 101;
    result.frame = nook::view_frame(camera);
    result.projection = nook::projection(camera, width, height);
    result.depth = {width, height};
    const nook::OutlineView view = result.shells.view();
    REQUIRE(nook::rasterise({.positions = view.base,
                             .vertex_count = view.vertex_count,
                             .indices = view.indices,
                             .triangle_count = view.triangle_count},
                            result.frame, result.projection, {.depth = result.depth.view()}));
    return result;
}

Image<std::uint8_t> mask(const Picture& p, double extent, int threshold = 2)
{
    Image<std::uint8_t> groups{WorkMap::groups(p.depth.width()), p.depth.height(), 9};
    REQUIRE(nook::outline_mask(p.shells.view(), extent, p.depth.view(), groups.view(),
                               {.threshold = threshold}, p.frame, p.projection));
    return groups;
}

}  // namespace

TEST_CASE("a group is active when a surface in it reaches the threshold")
{
    for (const bool orthographic : {false, true}) {
        const Picture p = picture(1, orthographic);
        const int width = p.depth.width(), height = p.depth.height();
        Image<std::int32_t> counts{width, height};
        REQUIRE(nook::outline_count(p.shells.view(), 0.1, p.depth.view(), counts.view(), p.frame,
                                    p.projection));
        for (const int threshold : {-2147483647 - 1, -1, 0, 1, 2, 3, 2147483647}) {
            CAPTURE(threshold);
            Image<std::uint8_t> groups{WorkMap::groups(width), height, 9};
            const nook::Outcome outcome =
                nook::outline_mask(p.shells.view(), 0.1, p.depth.view(), groups.view(),
                                   {.threshold = threshold}, p.frame, p.projection);
            REQUIRE(outcome);
            std::uint64_t wanted = 0, skipped = 0, background = 0;
            bool right = true;
            for (int y = 0; y < height; ++y) {
                for (int group = 0; group < groups.width(); ++group) {
                    std::uint64_t active = 0, surfaces = 0;
                    for (int x = 16 * group; x < (std::min)(16 * group + 16, width); ++x) {
                        const bool surface = p.depth(x, y) < infinity;
                        surfaces += surface;
                        background += !surface;
                        active += surface && counts(x, y) >= threshold;
                    }
                    right = right && groups(group, y) == (active > 0 ? 1 : 0);
                    wanted += active;
                    skipped += active > 0 ? 0 : surfaces;
                }
            }
            CHECK(right);
            CHECK(outcome.work.pixels == static_cast<std::uint64_t>(width * height));
            CHECK(outcome.work.background == background);
            CHECK(outcome.work.samples == wanted);
            CHECK(outcome.work.skipped == skipped);
            if (threshold == 2) {
                CHECK(wanted > 500);
                CHECK(skipped > 100);
            }
        }
    }
}

TEST_CASE("the mask of a single convex object is empty")
{
    const meshes::Mesh ball = meshes::icosphere(3);
    Picture p = picture(2);
    p.shells = {};
    p.shells.add(ball, {0, 0, 0}, false);
    REQUIRE(nook::rasterise(ball.view(), p.frame, p.projection, {.depth = p.depth.view()}));
    for (const double extent : {1e-3, 0.1, 100.0}) {
        const Image<std::uint8_t> groups = mask(p, extent);
        CHECK(std::all_of(groups.begin(), groups.end(), [](int g) { return g == 0; }));
    }
    const Image<std::uint8_t> own = mask(p, 0.1, 1);
    CHECK(std::any_of(own.begin(), own.end(), [](int g) { return g == 1; }));
}

TEST_CASE("the mask grows with the extent")
{
    // Spheres and boxes only, whose shells contain their smaller ones.
    std::mt19937 random{3};
    std::uniform_real_distribution<double> unit{-2, 2};
    meshes::Mesh mesh;
    Picture p = picture(3);
    p.shells = {};
    for (int i = 0; i < 30; ++i) {
        const meshes::Point at{unit(random), unit(random), unit(random)};
        const meshes::Point high{at[0] + 0.5, at[1] + 0.3, at[2] + 0.4};
        mesh.box(at, high);
        p.shells.add_box(at, high);
    }
    REQUIRE(nook::rasterise(mesh.view(), p.frame, p.projection, {.depth = p.depth.view()}));
    Image<std::uint8_t> before = mask(p, 0);
    int last = -1;
    for (double extent = 0.01; extent < 2; extent *= 1.5) {
        const Image<std::uint8_t> groups = mask(p, extent);
        int active = 0;
        bool superset = true;
        for (int y = 0; y < groups.height(); ++y) {
            for (int x = 0; x < groups.width(); ++x) {
                superset = superset && groups(x, y) >= before(x, y);
                active += groups(x, y);
            }
        }
        CHECK(superset);
        CHECK(active >= last);
        last = active;
        before = groups;
    }
    CHECK(last > 200);
}

TEST_CASE("the mask does not depend on threads or on how the groups are stored")
{
    const Picture p = picture(4);
    const Image<std::uint8_t> expected = mask(p, 0.1);
    nook::ThreadExecutor executor{3};
    std::vector<std::uint8_t> stored(3 * 11 * 101, 7);
    const nook::ImageView<std::uint8_t> strided{stored.data() + 3 * 11 * 100, 11, 101, -3 * 11, 3};
    REQUIRE(nook::outline_mask(p.shells.view(), 0.1, p.depth.view(), strided, {}, p.frame,
                               p.projection, nook::HeapScratch{}, executor));
    bool same = true;
    for (int y = 0; y < 101; ++y)
        for (int x = 0; x < 11; ++x) same = same && strided(x, y) == expected(x, y);
    CHECK(same);
    CHECK(std::count(stored.begin(), stored.end(), 7) == 2 * 11 * 101);
    const WorkMap map = nook::outline_work_map(expected.view());
    CHECK(!map.exact);
    CHECK(map.active.data == expected.data());
}

TEST_CASE("images of one pixel, of none and of background alone have masks")
{
    Picture p = picture(5);
    p.shells.add_box({-9, -9, -9}, {9, 9, 9});
    p.shells.add_box({-8, -8, -8}, {8, 8, 8});
    p.depth = {1, 1, 3};
    p.projection = nook::projection(nook::Camera{}, 1, 1);
    CHECK(mask(p, 0)(0, 0) == 1);
    p.depth = {1, 1, infinity};
    CHECK(mask(p, 0, -5)(0, 0) == 0);
    p.depth = {};
    CHECK(nook::outline_mask(p.shells.view(), 0, p.depth.view(), nook::ImageView<std::uint8_t>{},
                             {}, p.frame, p.projection));
}

TEST_CASE("bad arguments of the mask are named, and nothing is written")
{
    const Picture p = picture(6);
    Image<std::uint8_t> groups{11, 101, 9};
    const auto run = [&](const nook::ImageView<std::uint8_t>& out, double extent, auto&& scratch) {
        const nook::Outcome outcome = nook::outline_mask(p.shells.view(), extent, p.depth.view(),
                                                         out, {}, p.frame, p.projection, scratch);
        CHECK(std::all_of(groups.begin(), groups.end(), [](int g) { return g == 9; }));
        return outcome.error;
    };
    nook::ImageView<std::uint8_t> wrong = groups.view();
    wrong.width = 10;
    CHECK(std::string{run(wrong, 0, nook::HeapScratch{}).argument} == "groups");
    wrong = groups.view();
    wrong.height = 100;
    CHECK(run(wrong, 0, nook::HeapScratch{}).code == nook::ErrorCode::bad_size);
    wrong = groups.view();
    wrong.data = nullptr;
    CHECK(run(wrong, 0, nook::HeapScratch{}).code == nook::ErrorCode::null_data);
    CHECK(std::string{run(groups.view(), -1, nook::HeapScratch{}).argument} == "extent");
    CHECK(run(groups.view(), 0, nook::Scratch{}).code == nook::ErrorCode::scratch_too_small);
}
