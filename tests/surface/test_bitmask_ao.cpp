#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/thread_executor.hpp>

#include "slice_scenes.hpp"

namespace {

using nook::BitmaskOptions;
using nook::Image;
using nook::Projection;
using slice_scenes::Scene;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

Image<float> visibility(const Scene& scene, const BitmaskOptions& options,
                        const nook::WorkMap& work_map = {})
{
    Image<float> result{scene.width(), scene.height(), -1.f};
    REQUIRE(nook::bitmask_ao(scene.depth.view(), scene.source(), result.view(), options,
                             scene.projection, work_map));
    return result;
}
Image<float> reference(const Scene& scene, const BitmaskOptions& options)
{
    Image<float> result{scene.width(), scene.height(), -1.f};
    REQUIRE(nook::bitmask_ao_reference(scene.depth.view(), scene.source(), result.view(), options,
                                       scene.projection));
    return result;
}
Image<float> horizons(const Scene& scene, const nook::HorizonOptions& options)
{
    Image<float> result{scene.width(), scene.height(), -1.f};
    REQUIRE(nook::horizon_ao(scene.depth.view(), scene.source(), result.view(), options,
                             scene.projection));
    return result;
}
bool all_open(const Image<float>& image)
{
    return std::all_of(image.begin(), image.end(), [](float value) { return value == 1; });
}
bool all_in_range(const Image<float>& image)
{
    return std::all_of(image.begin(), image.end(),
                       [](float value) { return value >= 0 && value <= 1; });
}
int differing(const Image<float>& a, const Image<float>& b, double bound)
{
    int count = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x)
            count += !(std::fabs(double{a(x, y)} - double{b(x, y)}) <= bound);
    return count;
}

}  // namespace

TEST_CASE("bits are set and counted as the standard library does")
{
    std::mt19937 random{1};
    for (std::uint32_t count = 0; count <= 32; ++count) {
        const std::uint32_t expected = count == 32 ? ~0u : (1u << count) - 1;
        CHECK(nook::detail::lowest_bits(count) == expected);
        CHECK(nook::detail::lowest_bits(std::uint64_t{count}) == expected);
        CHECK(nook::detail::count_bits(expected) == count);
    }
    for (int i = 0; i < 1000; ++i) {
        const auto bits = static_cast<std::uint32_t>(random());
        REQUIRE(nook::detail::count_bits(bits) == static_cast<std::uint32_t>(std::popcount(bits)));
        REQUIRE(nook::detail::count_bits(std::uint64_t{bits}) ==
                static_cast<std::uint64_t>(std::popcount(bits)));
    }
}

TEST_CASE("open ground of every tilt is exactly 1, under any thickness")
{
    for (const Projection& projection : {slice_scenes::perspective(), slice_scenes::orthographic()})
        for (const double degrees : {0.0, 30.0, 75.0, 89.5})
            for (const double azimuth : {0.3, 4.4}) {
                const Scene scene =
                    slice_scenes::plane(projection, 60, 42, degrees * pi / 180, azimuth, 3);
                for (const int slices : {1, 3})
                    CHECK(all_open(visibility(scene, {.radius = 2, .slices = slices})));
                CHECK(all_open(visibility(scene, {.radius = 2, .thickness = infinity})));
                CHECK(all_open(reference(scene, {.radius = 2})));
            }
}

TEST_CASE("an infinite thickness is that of a height field, within half a sector per side")
{
    for (const Projection& projection :
         {slice_scenes::perspective(), slice_scenes::orthographic()}) {
        const Scene scene = slice_scenes::varied(projection, 70, 44);
        const Image<float> exact = horizons(scene, {.radius = 2, .slices = 4, .steps = 5});
        const Image<float> sectors =
            visibility(scene, {.radius = 2, .slices = 4, .steps = 5, .thickness = infinity});
        CHECK(differing(exact, sectors, 1.0 / 32 + 1e-5) == 0);
        // And without bias.
        double sum = 0;
        for (int y = 0; y < 44; ++y)
            for (int x = 0; x < 70; ++x) sum += double{sectors(x, y)} - double{exact(x, y)};
        CHECK(std::fabs(sum) < 0.003 * 70 * 44);
        // Far too large to matter is the same as infinite.
        CHECK(differing(visibility(scene, {.radius = 2, .slices = 4, .steps = 5, .thickness = 1e4}),
                        sectors, 1e-6) <= 8);
    }
}

TEST_CASE("the kernel agrees with its reference, but for ends that fall on the middle of a sector")
{
    for (const Projection& projection : {slice_scenes::perspective(), slice_scenes::orthographic()})
        for (const double thickness : {infinity, 0.2}) {
            const Scene scene = slice_scenes::varied(projection, 70, 44);
            const BitmaskOptions options{
                .radius = 2, .slices = 4, .steps = 5, .thickness = thickness, .bias = 0.001};
            const Image<float> fast = visibility(scene, options), slow = reference(scene, options);
            CHECK(*std::min_element(fast.begin(), fast.end()) < 0.8f);
            CHECK(differing(fast, slow, 1e-5) <= 12);
            CHECK(differing(fast, slow, 0.02) == 0);

            Image<double> distances{70, 44}, precise{70, 44};
            for (int y = 0; y < 44; ++y)
                for (int x = 0; x < 70; ++x) distances(x, y) = double{scene.depth(x, y)};
            const Image<double>& depth = distances;
            REQUIRE(nook::bitmask_ao(depth.view(), scene.source(), precise.view(), options,
                                     projection));
            int different = 0;
            for (int y = 0; y < 44; ++y)
                for (int x = 0; x < 70; ++x)
                    different += std::fabs(precise(x, y) - double{slow(x, y)}) > 1e-5;
            CHECK(different <= 12);
        }
}

TEST_CASE("one thin sample closes the sectors between its ends and no more")
{
    // A post in a floor seen from above; the slices that hit it do so one pixel away.
    const Projection projection{.fx = 1, .fy = 1, .cx = 8, .cy = 0.5, .orthographic = true};
    Scene scene{projection, 16, 1};
    for (int x = 0; x < 16; ++x) scene.set(x, 0, x == 10 ? 8 : 10, 0, 0, 1);
    const auto closed = [&](double thickness, int x) {
        return 1 -
               double{visibility(
                   scene, {.radius = 6, .slices = 64, .steps = 8, .thickness = thickness})(x, 0)};
    };
    // The share of the slices that hit it, from its whole height: 32 sectors hold 1, in even parts.
    const auto sectors = [](double height) {
        return std::round(32 * nook::slice_hidden(std::atan(height), 0.0));
    };
    const double hit = closed(infinity, 9) / sectors(2);
    CHECK(hit > 0);
    for (const double thickness : {0.25, 0.5, 1.0, 1.5, 1.9})
        for (const int x : {9, 11})
            CHECK(closed(thickness, x) ==
                  doctest::Approx(hit * (sectors(2) - sectors(2 - thickness))).epsilon(1e-5));
    CHECK(closed(5, 9) == doctest::Approx(hit * sectors(2)));
}

TEST_CASE("light passes behind a thin rail: sectors open where horizons stay closed")
{
    Scene scene{slice_scenes::orthographic(), 64, 44};
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 64; ++x) scene.set(x, y, x >= 30 && x < 33 ? 4 : 5, 0, 0, 1);
    const Image<float> solid = visibility(scene, {.radius = 2, .slices = 8, .thickness = infinity});
    const Image<float> thin = visibility(scene, {.radius = 2, .slices = 8, .thickness = 0.1});
    double before = 0, after = 0;
    for (int y = 12; y < 32; ++y) {
        before += 1 - double{solid(36, y)};
        after += 1 - double{thin(36, y)};
    }
    CHECK(before > 1);
    CHECK(after < 0.5 * before);
    CHECK(after > 0);
    // Unset: half the radius.
    CHECK(visibility(scene, {.radius = 2}) == visibility(scene, {.radius = 2, .thickness = 1}));
}

TEST_CASE("more thickness never opens")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    Image<float> before{70, 44, 1.f};
    for (const double thickness : {0.01, 0.1, 0.5, 2.0, 100.0, infinity}) {
        const Image<float> open = visibility(scene, {.radius = 1, .thickness = thickness});
        for (int y = 0; y < 44; ++y)
            for (int x = 0; x < 70; ++x) REQUIRE(open(x, y) <= before(x, y) + 1e-6f);
        before = open;
    }
}

TEST_CASE("lengths times a power of two give the same bits")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    const Image<float> open = visibility(scene, {.radius = 1.3});
    for (const double factor : {0x1p-30, 0x1p+30}) {
        Scene scaled = scene;
        for (float& distance : scaled.depth) distance *= static_cast<float>(factor);
        CHECK(visibility(scaled, {.radius = 1.3 * factor}) == open);
    }
}

TEST_CASE("the same bits for any number of threads")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    const Image<float> open = visibility(scene, {.radius = 1});
    for (const int workers : {2, 5}) {
        nook::ThreadExecutor threads{workers};
        Image<float> result{70, 44, -1.f};
        std::vector<unsigned char> memory(
            nook::bitmask_ao_scratch_size(scene.depth.view(), workers));
        REQUIRE(nook::bitmask_ao(scene.depth.view(), scene.source(), result.view(), {.radius = 1},
                                 scene.projection, {}, nook::Scratch{memory.data(), memory.size()},
                                 threads));
        CHECK(result == open);
    }
}

TEST_CASE("under a work map active groups keep their bits, others are 1 and counted")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    const Image<float> all = visibility(scene, {.radius = 1});
    Image<std::uint8_t> active{5, 44};
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 5; ++x)
            active(x, y) = static_cast<std::uint8_t>((x * 7 + y * 3) % 4 < 2);
    const nook::WorkMap map{active.view()};
    Image<float> masked{70, 44, -1.f}, slow{70, 44, -1.f};
    const nook::Outcome fast_work = nook::bitmask_ao(
        scene.depth.view(), scene.source(), masked.view(), {.radius = 1}, scene.projection, map);
    const nook::Outcome slow_work = nook::bitmask_ao_reference(
        scene.depth.view(), scene.source(), slow.view(), {.radius = 1}, scene.projection, map);
    REQUIRE(fast_work);
    REQUIRE(slow_work);
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x)
            REQUIRE(masked(x, y) == (map.is_active(x, y) ? all(x, y) : 1.f));
    CHECK(fast_work.work.skipped > 1000);
    CHECK(slow_work.work.skipped == fast_work.work.skipped);
    CHECK(slow_work.work.background == fast_work.work.background);
}

TEST_CASE("silhouettes, background and pixels without a normal are 1")
{
    Scene edge{slice_scenes::perspective(), 60, 42};
    for (int y = 0; y < 42; ++y)
        for (int x = 0; x < 60; ++x) edge.set(x, y, x < 30 ? 1 : 1e6, 0, 0, 1);
    CHECK(all_open(visibility(edge, {.radius = 10})));
    const Image<float> huge = visibility(edge, {.radius = 1e7});
    CHECK(all_in_range(huge));
    CHECK(huge(10, 20) == 1);
    for (const float none : {0.f, -3.f, std::numeric_limits<float>::quiet_NaN(),
                             std::numeric_limits<float>::infinity()}) {
        Scene scene = slice_scenes::plane(slice_scenes::perspective(), 60, 42, 0.5, 1, 3);
        for (int y = 0; y < 42; ++y)
            for (int x = 0; x < 60; x += 1 + (y + x) % 3) scene.depth(x, y) = none;
        CHECK(all_open(visibility(scene, {.radius = 2})));
    }
    Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    scene.normal(40, 30)[1] = std::numeric_limits<float>::quiet_NaN();
    const Image<float> open = visibility(scene, {.radius = 2});
    CHECK(open(40, 30) == 1);
    CHECK(open(17, 22) == 1);
    CHECK(all_in_range(open));
}

TEST_CASE("radii of any size, and normals that face away, give a visibility")
{
    Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    for (const double radius : {0.0, 1e-300, 1e-7, 0.07})
        CHECK(all_open(visibility(scene, {.radius = radius})));
    for (const double radius : {1e7, 1e38, 1e300})
        CHECK(all_in_range(visibility(scene, {.radius = radius})));
    CHECK(all_open(visibility(scene, {.radius = 2, .slices = 0})));
    CHECK(all_open(visibility(scene, {.radius = 2, .steps = 0})));
    CHECK(all_open(visibility(scene, {.radius = 2, .thickness = 0})));
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x)
            for (int i = 0; i < 3; ++i)
                scene.normal(x, y)[i] = static_cast<float>((x * 5 + y * 3 + i * 7) % 11 - 5);
    for (const double thickness : {infinity, 0.5})
        CHECK(all_in_range(visibility(scene, {.radius = 2, .thickness = thickness})));
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
    Image<float> out{70, 44, -1.f};
    const auto refused = [&](const BitmaskOptions& options, const char* name) {
        const nook::Outcome fast = nook::bitmask_ao(scene.depth.view(), scene.source(), out.view(),
                                                    options, scene.projection);
        const nook::Outcome slow = nook::bitmask_ao_reference(
            scene.depth.view(), scene.source(), out.view(), options, scene.projection);
        CHECK(std::string{fast.error.argument} == name);
        CHECK(std::string{slow.error.argument} == name);
        CHECK(out == Image<float>{70, 44, -1.f});
    };
    refused({.radius = -1}, "options.radius");
    refused({.radius = not_a_number}, "options.radius");
    refused({.radius = infinity}, "options.radius");
    refused({.slices = 65}, "options.slices");
    refused({.steps = 513}, "options.steps");
    refused({.thickness = -1.0}, "options.thickness");
    refused({.thickness = not_a_number}, "options.thickness");
    refused({.bias = -1.0}, "options.bias");
    refused({.max_pixels = 0}, "options.max_pixels");
    CHECK(nook::bitmask_ao(nook::ImageView<const float>{}, nook::NormalSource{},
                           nook::ImageView<float>{}, {}, scene.projection));
}
