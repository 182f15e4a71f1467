#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "../../examples/path_tracer/path_tracer.hpp"
#include "../../examples/scenes/scenes.hpp"

namespace {

path_tracer::Light trace(const scenes::Scene& scene, const path_tracer::Options& options,
                         int threads = 1)
{
    nook::Bvh bvh;
    REQUIRE(bvh.build(scene.mesh()));
    nook::ThreadExecutor executor{threads};
    return path_tracer::trace(bvh, scene, options, executor);
}

bool all_equal(const path_tracer::Light& light, const support::Rgb& colour)
{
    return std::all_of(light.pixels.begin(), light.pixels.end(),
                       [&](const support::Rgb& pixel) { return pixel == colour; });
}

}  // namespace

TEST_CASE("a picture by light paths does not depend on threads")
{
    const scenes::Scene scene = scenes::boxes();
    const path_tracer::Options options{.width = 24, .height = 17, .samples = 4, .bounces = 3};
    const path_tracer::Light one = trace(scene, options, 1), three = trace(scene, options, 3);
    CHECK(one.pixels == three.pixels);
    CHECK(one.rays == three.rays);
}

TEST_CASE("without bounces surfaces are black, and a black surface sends no light")
{
    path_tracer::Options options{.width = 16, .height = 9, .samples = 4, .bounces = 0};
    CHECK(all_equal(trace(scenes::floor(), options), {0, 0, 0}));
    options.bounces = 2;
    options.albedo = 0;
    CHECK(all_equal(trace(scenes::floor(), options), {0, 0, 0}));
}

TEST_CASE("an open floor reflects its albedo times the light of the sky above")
{
    // The sky is linear in the height of the direction: its mean by cosine is its value at 2/3.
    const path_tracer::Options options{
        .width = 16, .height = 9, .samples = 256, .bounces = 3, .albedo = 0.5f};
    const path_tracer::Light light = trace(scenes::floor(), options);
    CHECK(light.rays == 16 * 9 * 256 * 2);
    const double expected[3] = {0.5 * (1.0 / 3 + 0.80 * 2 / 3), 0.5 * (0.98 / 3 + 0.92 * 2 / 3),
                                0.5 * (0.95 / 3 + 1.10 * 2 / 3)};
    for (const support::Rgb& pixel : light.pixels) {
        CHECK(std::fabs(double{pixel.r} - expected[0]) < 2e-3);
        CHECK(std::fabs(double{pixel.g} - expected[1]) < 2e-3);
        CHECK(std::fabs(double{pixel.b} - expected[2]) < 2e-3);
    }
}

TEST_CASE("more bounces bring more light, and never less")
{
    const scenes::Scene scene = scenes::boxes();
    path_tracer::Options options{.width = 24, .height = 17, .samples = 16, .bounces = 1};
    const path_tracer::Light first = trace(scene, options);
    options.bounces = 4;
    const path_tracer::Light more = trace(scene, options);
    // The same paths go on where they were cut.
    std::size_t brighter = 0;
    for (std::size_t i = 0; i < first.pixels.size(); ++i) {
        CHECK(more.pixels[i].g >= first.pixels[i].g);
        brighter += more.pixels[i].g > first.pixels[i].g ? 1 : 0;
    }
    CHECK(brighter > first.pixels.size() / 8);
}
