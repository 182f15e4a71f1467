#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/outline_ao.hpp>
#include <nook/scene/outline_count.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"
#include "shells.hpp"

namespace {

using nook::Image;
using nook::OutlineAoOptions;
using shells::Shells;

constexpr float infinity = std::numeric_limits<float>::infinity();

struct Picture {
    Shells shells;
    nook::ViewFrame frame;
    nook::Projection projection;
    Image<float> depth;
};
Picture picture(unsigned seed, int width = 133, int height = 97)
{
    std::mt19937 random{seed};
    Picture result;
    result.shells = shells::random_shells(random, 30, 1.5);
    const nook::Camera camera{.eye = {0.5, 1, 6}};
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

template <class Value = float>
Image<Value> shade(const Picture& p, const OutlineAoOptions& options, double extent = 0.1)
{
    Image<Value> visibility{p.depth.width(), p.depth.height(), -7};
    REQUIRE(nook::outline_ao(p.shells.view(), extent, p.depth.view(), visibility.view(), options,
                             p.frame, p.projection));
    return visibility;
}

}  // namespace

TEST_CASE("visibility is the mean of the overlaps around a pixel")
{
    const Picture p = picture(1);
    const int width = p.depth.width(), height = p.depth.height();
    Image<std::int32_t> counts{width, height};
    REQUIRE(nook::outline_count(p.shells.view(), 0.1, p.depth.view(), counts.view(), p.frame,
                                p.projection));
    for (const OutlineAoOptions& options :
         {OutlineAoOptions{}, OutlineAoOptions{.radius = 0, .strength = 1},
          OutlineAoOptions{.radius = 1, .strength = 0.3, .limit = 3},
          OutlineAoOptions{.radius = 5, .limit = 254, .threshold = 1},
          OutlineAoOptions{.radius = 65, .limit = 2, .threshold = -1000000},
          OutlineAoOptions{
              .radius = 1000, .strength = 1, .limit = 254, .threshold = -2147483647 - 1}}) {
        CAPTURE(options.radius);
        const Image<float> visibility = shade(p, options);
        double worst = 0;
        bool background = true;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                if (!(p.depth(x, y) < infinity)) {
                    background = background && visibility(x, y) == 1;
                    continue;
                }
                // A few pixels of a large window are enough.
                if (options.radius > 10 && (x * 7 + y * 13) % 97 != 0) continue;
                double sum = 0, surfaces = 0;
                const int r = options.radius;
                for (int v = (std::max)(y - r, 0); v <= (std::min)(y + r, height - 1); ++v) {
                    for (int u = (std::max)(x - r, 0); u <= (std::min)(x + r, width - 1); ++u) {
                        if (!(p.depth(u, v) < infinity)) continue;
                        const double level = double(counts(u, v)) - options.threshold + 1.0;
                        sum += (std::min)((std::max)(level, 0.0), double(options.limit));
                        surfaces += 1;
                    }
                }
                const double expected = 1 - options.strength * sum / surfaces / options.limit;
                worst = (std::max)(worst, std::fabs(double{visibility(x, y)} - expected));
            }
        }
        CHECK(background);
        CHECK(worst < 1e-6);
    }
}

TEST_CASE("where no shells overlap visibility is exactly 1, where all do exactly 1 - strength")
{
    Picture p = picture(2, 40, 30);
    p.depth = {40, 30, 3};
    for (int x = 0; x < 40; ++x) p.depth(x, 12) = infinity;
    p.shells = {};
    p.shells.add_box({-90, -90, -90}, {90, 90, 90});
    for (const float v : shade(p, {.radius = 4, .strength = 0.75})) CHECK(v == 1);
    p.shells.add_box({-80, -90, -90}, {90, 90, 90});
    // The background in the middle neither brightens its neighbours nor is shaded by them.
    const Image<float> visibility = shade(p, {.radius = 4, .strength = 0.75});
    for (int x = 0; x < 40; ++x) CHECK(visibility(x, 12) == 1);
        // -ffast-math may divide by way of a reciprocal.
#if defined(__FAST_MATH__)
    constexpr float tolerance = 1e-6f;
#else
    constexpr float tolerance = 0;
#endif
    const auto equals = [&](float a, float b) { return std::fabs(a - b) <= tolerance; };
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) CHECK((y == 12 || equals(visibility(x, y), 0.25f)));
    for (const float v : shade(p, {.strength = 0})) CHECK(v == 1);
    for (int i = 0; i < 3; ++i) p.shells.add_box({-80, -90, -90}, {90, 90, 90});
    CHECK(equals(shade(p, {.strength = 1, .limit = 8})(3, 3), 0.5f));
    CHECK(equals(shade(p, {.strength = 1, .limit = 4})(3, 3), 0));
}

TEST_CASE("the stand-alone form does not depend on threads, strides, type or what scratch held")
{
    const Picture p = picture(3);
    const int width = p.depth.width(), height = p.depth.height();
    const OutlineAoOptions options{.radius = 6, .limit = 3};
    const Image<float> expected = shade(p, options);
    for (const int threads : {2, 5}) {
        nook::ThreadExecutor executor{threads};
        Image<float> visibility{width, height};
        std::vector<unsigned char> memory(
            nook::outline_ao_scratch_size(p.shells.view(), options, width, height, threads) + 1,
            0xff);
        const nook::Scratch scratch{memory.data() + 1, memory.size() - 1};
        REQUIRE(nook::outline_ao(p.shells.view(), 0.1, p.depth.view(), visibility.view(), options,
                                 p.frame, p.projection, scratch, executor));
        CHECK(visibility == expected);
    }
    const Image<double> doubles = shade<double>(p, options);
    CHECK(std::equal(doubles.begin(), doubles.end(), expected.begin(),
                     [](double a, float b) { return a == double{b}; }));
    const auto elements = static_cast<std::size_t>(2 * width * height);
    std::vector<float> wide(elements, 7);
    const nook::ImageView<float> flipped{wide.data() + 2 * width * (height - 1), width, height,
                                         -2 * width, 2};
    REQUIRE(nook::outline_ao(p.shells.view(), 0.1, p.depth.view(), flipped, options, p.frame,
                             p.projection));
    bool same = true;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) same = same && flipped(x, y) == expected(x, y);
    CHECK(same);
    CHECK(std::count(wide.begin(), wide.end(), 7.0f) == width * height);
}

TEST_CASE("the stand-alone form tells how many surfaces lie in overlaps")
{
    const Picture p = picture(4);
    Image<std::int32_t> counts{133, 97};
    REQUIRE(nook::outline_count(p.shells.view(), 0.1, p.depth.view(), counts.view(), p.frame,
                                p.projection));
    Image<float> visibility{133, 97};
    const nook::Outcome outcome = nook::outline_ao(p.shells.view(), 0.1, p.depth.view(),
                                                   visibility.view(), {}, p.frame, p.projection);
    REQUIRE(outcome);
    const auto twice = std::count_if(counts.begin(), counts.end(), [](int c) { return c >= 2; });
    CHECK(outcome.work.samples == static_cast<std::uint64_t>(twice));
    CHECK(outcome.work.background ==
          static_cast<std::uint64_t>(std::count(p.depth.begin(), p.depth.end(), infinity)));
    CHECK(outcome.work.pixels == 133 * 97);
}

TEST_CASE("small images and large windows")
{
    Picture p = picture(5);
    p.shells = {};
    p.shells.add_box({-90, -90, -90}, {90, 90, 90});
    p.shells.add_box({-90, -90, -90}, {90, 90, 90});
    for (const int width : {1, 2, 17})
        for (const int height : {1, 3, 66})
            for (const int radius : {0, 1, 1000}) {
                p.depth = {width, height, 2};
                p.projection = nook::projection(nook::Camera{}, width, height);
                for (const float v : shade(p, {.radius = radius})) CHECK(v == 0.5f);
            }
    p.depth = {};
    shade(p, {});
}

TEST_CASE("bad arguments of the stand-alone form are named, and nothing is written")
{
    const Picture p = picture(6);
    Image<float> visibility{133, 97, -5};
    const auto run = [&](const OutlineAoOptions& options, const nook::ImageView<float>& out,
                         auto&& scratch) {
        const nook::Outcome outcome = nook::outline_ao(p.shells.view(), 0.1, p.depth.view(), out,
                                                       options, p.frame, p.projection, scratch);
        CHECK(std::all_of(visibility.begin(), visibility.end(), [](float v) { return v == -5; }));
        return outcome.error;
    };
    const auto argument = [&](const OutlineAoOptions& options) {
        return std::string{run(options, visibility.view(), nook::HeapScratch{}).argument};
    };
    CHECK(argument({.radius = -1}) == "options.radius");
    CHECK(argument({.radius = 1001}) == "options.radius");
    CHECK(argument({.limit = 0}) == "options.limit");
    CHECK(argument({.limit = 255}) == "options.limit");
    for (const double strength :
         {-0.1, 1.1, double{infinity}, std::numeric_limits<double>::quiet_NaN()})
        CHECK(argument({.strength = strength}) == "options.strength");
    nook::ImageView<float> wrong = visibility.view();
    wrong.height = 96;
    CHECK(run({}, wrong, nook::HeapScratch{}).code == nook::ErrorCode::bad_size);
    CHECK(run({}, visibility.view(), nook::Scratch{}).code == nook::ErrorCode::scratch_too_small);
    nook::ImageView<float> same{const_cast<float*>(p.depth.data()), 133, 97};
    CHECK(run({}, same, nook::HeapScratch{}).code == nook::ErrorCode::overlap);
}
