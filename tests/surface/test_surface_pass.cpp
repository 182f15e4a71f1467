#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include <nook/owned_image.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/thread_executor.hpp>

#include "slice_scenes.hpp"

namespace {

using nook::Image;
using nook::Projection;
using nook::detail::DepthPlane;
using nook::detail::Reach;
using nook::detail::ReachRule;
using nook::detail::SurfaceGroup;

/// Whole numbers that are the same with every standard library.
class Dice {
public:
    explicit Dice(std::uint32_t seed) : engine_{seed} {}
    /// In [0, bound).
    int operator()(int bound) { return static_cast<int>(engine_() % static_cast<unsigned>(bound)); }

private:
    std::mt19937 engine_;
};

/// A plane of the distances of an image and the memory behind it.
template <class Real>
struct Plane {
    DepthPlane<Real> plane;
    std::vector<Real> memory;

    Plane(const Image<Real>& depth, double radius)
        : plane{depth.width(), depth.height(), radius},
          memory(plane.size(), Real{-7})
    {
        plane.use(memory.data());
        for (int y = -1; y < depth.height(); ++y) plane.fill(nook::depth_source(depth.view()), y);
    }
};

}  // namespace

TEST_SUITE_BEGIN("surface/surface_pass");

TEST_CASE_TEMPLATE("a plane holds scaled distances, background around them and where there is none",
                   Real, float, double)
{
    for (const int width : {1, 15, 16, 17, 50, 992, 1000, 2016})
        for (const double radius : {1.0, 0.3, 1e-7, 1e7}) {
            Dice roll{5};
            Image<Real> depth{width, 3};
            for (Real& distance : depth) {
                distance = static_cast<Real>(radius * (1 + roll(1000)));
                const int kind = roll(20);
                if (kind == 0) distance = std::numeric_limits<Real>::quiet_NaN();
                if (kind == 1) distance = std::numeric_limits<Real>::infinity();
                if (kind == 2) distance = -distance;
                if (kind == 3) distance = 0;
                if (kind == 4) distance = static_cast<Real>(radius * 0x1p52);
            }
            const Plane<Real> used{depth, radius};
            const DepthPlane<Real>& plane = used.plane;
            REQUIRE(DepthPlane<Real>::fits(width, 3));
            const double scaled_radius = radius * plane.scale();
            CHECK((scaled_radius >= 1 && scaled_radius < 2));
            int exponent = 0;
            CHECK(std::frexp(plane.scale(), &exponent) == 0.5);
            for (int y = 0; y < 3; ++y)
                for (int x = -DepthPlane<Real>::margin; x < width + DepthPlane<Real>::margin; ++x) {
                    const Real held = plane.data()[plane.index(x, y)];
                    if (x < 0 || x >= width || !nook::is_surface(depth(x, y), Real(3e38)) ||
                        double{depth(x, y)} > radius * 0x1p51)
                        REQUIRE(held == 0);
                    else REQUIRE(double{held} == double{depth(x, y)} * plane.scale());
                }
            for (int i = 0; i < 16; ++i)
                REQUIRE(plane.data()[DepthPlane<Real>::nowhere() + i] == 0);
            // All that 16 lanes may read at the last pixel lies in the memory.
            CHECK(static_cast<std::size_t>(plane.index(width + 15, 2)) < plane.size());
            CHECK(plane.index(-DepthPlane<Real>::margin, -1) == 0);
        }
}

TEST_CASE("rows of a plane do not fall on the same sets of the cache")
{
    for (int width = 1; width < 9000; ++width)
        REQUIRE(DepthPlane<float>{width, 1, 1}.stride() % 1024 != 0);
}

TEST_CASE_TEMPLATE("the extent of a group is its nearest and its farthest distance", Real, float,
                   double)
{
    Dice roll{6};
    Image<Real> depth{64, 2};
    for (Real& distance : depth) distance = static_cast<Real>(1 + roll(1000));
    depth(20, 1) = 0;
    const Plane<Real> used{depth, 1};
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 64; x += 16) {
            const auto [least, largest] = std::minmax_element(&depth(x, y), &depth(x, y) + 16);
            const auto extent = used.plane.extent(x, y);
            CHECK(extent.nearest == *least);
            CHECK(extent.farthest == *largest);
        }
}

TEST_CASE_TEMPLATE("every pixel gets a reach within a ninth of its own, or none under a pixel",
                   Real, float, double)
{
    Dice roll{7};
    int sets = 0, groups = 0;
    for (int round = 0; round < 3000; ++round) {
        Projection projection =
            round % 3 == 0 ? slice_scenes::orthographic() : slice_scenes::perspective(50);
        const double radius = std::pow(2, roll(100) / 10.0 - 6);
        const DepthPlane<Real> plane{100, 100, radius};
        const int max_pixels = round % 5 == 0 ? 9 : 256;
        const ReachRule rule{plane, radius, projection, max_pixels};
        SurfaceGroup<Real> group{};
        group.count = round % 7 == 0 ? 5 : 16;
        const double spread = std::pow(10, roll(5) - 3);
        double nearest = 1e300, farthest = 0;
        for (int i = 0; i < group.count; ++i) {
            const bool surface = round % 4 == 0 || roll(5) != 0;
            if (!surface) continue;
            const double distance = (3 + spread * roll(1000)) * plane.scale();
            group.distance[i] = static_cast<Real>(distance);
            nearest = std::min(nearest, double{group.distance[i]});
            farthest = std::max(farthest, double{group.distance[i]});
        }
        group.whole = group.count == 16 && std::all_of(group.distance, group.distance + 16,
                                                       [](Real d) { return d > 0; });
        group.nearest = static_cast<Real>(nearest);
        group.farthest = static_cast<Real>(farthest);
        Real served[16] = {};
        const auto serve = [&](const SurfaceGroup<Real>& pixels, Real* values) {
            std::vector<Reach> reaches;
            std::vector<unsigned> parts;
            nook::detail::for_each_reach(pixels, rule, values,
                                         [&](const Reach& reach, unsigned wanted, Real* results) {
                                             reaches.push_back(reach);
                                             parts.push_back(wanted);
                                             for (int i = 0; i < 16; ++i)
                                                 results[i] = static_cast<Real>(reaches.size());
                                         });
            for (int i = 0; i < 16; ++i) {
                constexpr int lanes = nook::detail::lanes_of<Real>;
                const double distance = double{pixels.distance[i]};
                const double own = std::min(
                    projection.orthographic ? rule.radius : rule.radius / distance, rule.largest);
                const double pixel = own * std::max(rule.fx, rule.fy);
                if (!(distance > 0) || pixel < 0.9999) REQUIRE(values[i] == 0);
                else if (pixel > 1.0001) REQUIRE(values[i] > 0);
                if (values[i] == 0) continue;
                const auto set = static_cast<std::size_t>(values[i]) - 1;
                const Reach& reach = reaches[set];
                REQUIRE((parts[set] >> (i / lanes) & 1u) == 1);
                REQUIRE(reach.slope / own < 1.1251);
                REQUIRE(reach.slope / own > 0.8999);
                REQUIRE(reach.x == reach.slope * rule.fx);
                REQUIRE(reach.y == reach.slope * rule.fy);
                REQUIRE(std::max(reach.x, reach.y) <= max_pixels * 1.0001);
            }
            return reaches.size();
        };
        sets += static_cast<int>(serve(group, served));
        ++groups;
        // The short cut of whole groups changes nothing.
        SurfaceGroup<Real> slow = group;
        slow.whole = false;
        Real other[16] = {};
        serve(slow, other);
        for (int i = 0; i < 16; ++i) REQUIRE(served[i] == other[i]);
    }
    CHECK(sets > groups);
}

TEST_CASE("positions round to the nearest whole pixel, away from zero at halves")
{
    using nook::detail::whole_pixels;
    CHECK(whole_pixels(0.f, 10.f) == 0);
    CHECK(whole_pixels(0.049f, 10.f) == 0);
    CHECK(whole_pixels(0.05f, 10.f) == 1);
    CHECK(whole_pixels(-0.05f, 10.f) == -1);
    CHECK(whole_pixels(-0.149f, 10.f) == -1);
    CHECK(whole_pixels(1.f, 4096.f) == 4096);
}

TEST_CASE_TEMPLATE("taps stand where the plane holds their pixel, and on background outside", Real,
                   float, double)
{
    Image<Real> depth{50, 20};
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 50; ++x) depth(x, y) = static_cast<Real>(1 + y * 50 + x);
    const Plane<Real> used{depth, 1};
    const ReachRule rule{used.plane, 1, slice_scenes::perspective(), 256};
    Dice roll{8};
    float right[64] = {}, down[64] = {};
    for (const Reach reach : {Reach{1, 1, 0.1}, Reach{9, 7, 0.5}, Reach{80, 60, 2}})
        for (int round = 0; round < 50; ++round) {
            for (int i = 0; i < 40; ++i) {
                right[i] = static_cast<float>(roll(2001)) / 1000 - 1;
                down[i] = static_cast<float>(roll(2001)) / 1000 - 1;
            }
            nook::detail::TapList<Real, 64> taps;
            const int x = 16 * roll(4), y = roll(20);
            taps.add(used.plane, rule, reach, x, y, right, down, 17);
            taps.add(used.plane, rule, reach, x, y, right + 17, down + 17, 23);
            REQUIRE(taps.count == 40);
            for (int i = 0; i < 40; ++i) {
                const int dx = nook::detail::whole_pixels(right[i], static_cast<float>(reach.x));
                const int dy = nook::detail::whole_pixels(down[i], static_cast<float>(reach.y));
                CHECK(double{taps.slope_x[i]} == doctest::Approx(dx / rule.fx));
                CHECK(double{taps.slope_y[i]} == doctest::Approx(-dy / rule.fy));
                for (int lane = 0; lane < 16; ++lane) {
                    const int to_x = x + lane + dx, to_y = y + dy;
                    const bool inside = to_x >= 0 && to_x < 50 && to_y >= 0 && to_y < 20;
                    REQUIRE(used.plane.data()[taps.index[i] + lane] ==
                            (inside ? depth(to_x, to_y) : Real{0}));
                }
            }
        }
}

TEST_CASE("a pass writes every pixel once, counts, and shades active groups with surfaces alone")
{
    slice_scenes::Scene scene = slice_scenes::varied(slice_scenes::perspective(), 77, 30);
    for (int x = 0; x < 77; ++x) scene.depth(x, 11) = 0;
    Dice roll{9};
    Image<std::uint8_t> active{nook::WorkMap::groups(77), 30};
    for (auto& group : active) group = static_cast<std::uint8_t>(roll(2));
    const auto source = nook::depth_source(scene.depth.view());
    using Source = std::remove_cvref_t<decltype(source)>;
    const nook::NormalSource normals = scene.source();
    for (const bool masked : {false, true})
        for (const int workers : {1, 3}) {
            nook::ThreadExecutor threads{workers};
            const nook::WorkMap map = masked ? nook::WorkMap{active.view()} : nook::WorkMap{};
            const nook::detail::SurfaceInput<Source> input{source, normals, scene.projection, map,
                                                           DepthPlane<float>{77, 30, 1}};
            Image<std::uint16_t> out{77, 30, 9};
            const nook::Outcome done = nook::detail::run_surface_pass(
                input, out.view(), [](int y) { return y * 100; },
                [&](float* values, const SurfaceGroup<float>& group, int row,
                    const DepthPlane<float>&) {
                    for (int i = 0; i < 16; ++i) {
                        CHECK(values[i] == 1);
                        values[i] = static_cast<float>(row + group.x + group.y + 2);
                        if (i >= group.count) continue;
                        const bool usable =
                            nook::is_surface(scene.depth(group.x + i, group.y), 1e30f) &&
                            !(group.x + i == 77 / 4 && group.y == 15);
                        CHECK((group.distance[i] > 0) == usable);
                        if (!usable) continue;
                        CHECK(group.distance[i] == scene.depth(group.x + i, group.y));
                        CHECK(double{group.slope_x[i]} ==
                              doctest::Approx((group.x + i + 0.5 - scene.projection.cx) /
                                              scene.projection.fx));
                        CHECK(double{group.slope_y} ==
                              doctest::Approx((scene.projection.cy - group.y - 0.5) /
                                              scene.projection.fy));
                    }
                },
                nook::HeapScratch{}, threads);
            REQUIRE(done);
            std::uint64_t background = 0, skipped = 0;
            for (int y = 0; y < 30; ++y)
                for (int x = 0; x < 77; ++x) {
                    const bool on = map.is_active(x, y);
                    const bool surface = nook::is_surface(scene.depth(x, y), 1e30f);
                    const bool usable = surface && !(x == 77 / 4 && y == 15);
                    background += on ? !usable : !surface;
                    skipped += !on && surface;
                    bool any = false;
                    for (int i = x / 16 * 16; i < x / 16 * 16 + 16 && i < 77; ++i)
                        any = any || nook::is_surface(scene.depth(i, y), 1e30f);
                    REQUIRE(out(x, y) == (on && any ? y * 101 + x / 16 * 16 + 2 : 1));
                }
            CHECK(done.work.pixels == 77 * 30);
            CHECK(done.work.background == background);
            CHECK(done.work.skipped == skipped);
            CHECK(done.work.passes == 1);
        }
}

TEST_SUITE_END();
