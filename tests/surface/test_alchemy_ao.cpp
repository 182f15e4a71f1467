#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/thread_executor.hpp>

#include "slice_scenes.hpp"

namespace {

using nook::AlchemyFalloff;
using nook::AlchemyOptions;
using nook::DepthEncoding;
using nook::Image;
using nook::NormalSource;
using nook::Projection;
using nook::SamplePattern;
using slice_scenes::Scene;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double degree = std::numbers::pi / 180;
constexpr AlchemyFalloff falloffs[] = {AlchemyFalloff::alchemy, AlchemyFalloff::scalable};
constexpr SamplePattern patterns[] = {SamplePattern::row, SamplePattern::pixel};

template <class Value = float, class Depth>
Image<Value> visibility(const Depth& depth, const NormalSource& normals,
                        const AlchemyOptions& options, const Projection& projection,
                        const nook::WorkMap& map = {}, nook::Work* work = nullptr)
{
    const auto& image = nook::depth_source(depth).image;
    Image<Value> result{image.width, image.height, Value{-1}};
    const nook::Outcome done =
        nook::alchemy_ao(depth, normals, result.view(), options, projection, map);
    REQUIRE(done);
    if (work != nullptr) *work = done.work;
    return result;
}
Image<float> visibility(const Scene& scene, const AlchemyOptions& options,
                        const nook::WorkMap& map = {}, nook::Work* work = nullptr)
{
    return visibility(scene.depth.view(), scene.source(), options, scene.projection, map, work);
}
template <class Depth>
Image<double> reference(const Depth& depth, const NormalSource& normals,
                        const AlchemyOptions& options, const Projection& projection,
                        const nook::WorkMap& map = {}, nook::Work* work = nullptr)
{
    const auto& image = nook::depth_source(depth).image;
    Image<double> result{image.width, image.height, -1};
    const nook::Outcome done =
        nook::alchemy_ao_reference(depth, normals, result.view(), options, projection, map);
    REQUIRE(done);
    if (work != nullptr) *work = done.work;
    return result;
}

/// Bits of numbers, told apart from −0 and NaN.
template <class T>
bool same_bits(const Image<T>& a, const Image<T>& b)
{
    const auto bytes = sizeof(T) * static_cast<std::size_t>(a.width() * a.height());
    return a.width() == b.width() && a.height() == b.height() &&
           std::memcmp(a.data(), b.data(), bytes) == 0;
}
template <class T>
int count_other_than(const Image<T>& image, T value)
{
    return static_cast<int>(
        std::count_if(image.begin(), image.end(), [&](T pixel) { return !(pixel == value); }));
}
/// By bits, for -ffast-math.
bool within_unit(float value)
{
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return bits <= std::bit_cast<std::uint32_t>(1.f);
}
int count_outside_unit(const Image<float>& image)
{
    return static_cast<int>(
        std::count_if(image.begin(), image.end(), [](float pixel) { return !within_unit(pixel); }));
}
template <class A, class B>
double largest_difference(const Image<A>& a, const Image<B>& b)
{
    double worst = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x)
            worst = std::max(worst, std::fabs(double{a(x, y)} - double{b(x, y)}));
    return worst;
}
double mean(const Image<float>& image)
{
    double sum = 0;
    for (const float pixel : image) sum += double{pixel};
    return sum / (image.width() * image.height());
}

std::vector<AlchemyOptions> all_kinds(AlchemyOptions options)
{
    std::vector<AlchemyOptions> all;
    for (const AlchemyFalloff falloff : falloffs)
        for (const SamplePattern pattern : patterns) {
            options.falloff = falloff;
            options.pattern = pattern;
            all.push_back(options);
        }
    return all;
}
std::string describe(const AlchemyOptions& options)
{
    return std::string{options.falloff == AlchemyFalloff::alchemy ? "alchemy" : "scalable"} +
           (options.pattern == SamplePattern::row ? " by row" : " by pixel") + ", " +
           std::to_string(options.samples) + " samples";
}

/// A world of distances and lengths times 2^exponent.
Scene scaled(const Scene& scene, int exponent)
{
    Scene result = scene;
    for (float& distance : result.depth) distance = std::ldexp(distance, exponent);
    if (scene.projection.orthographic) {
        result.projection.fx = std::ldexp(scene.projection.fx, -exponent);
        result.projection.fy = std::ldexp(scene.projection.fy, -exponent);
    }
    return result;
}

}  // namespace

TEST_SUITE("surface/alchemy_ao")
{
    TEST_CASE("the kernel agrees with the reference: every projection, pattern and falloff")
    {
        std::mt19937 random{3};
        for (const Projection& projection :
             {slice_scenes::perspective(), slice_scenes::perspective(400),
              slice_scenes::orthographic()}) {
            const Scene scene = slice_scenes::varied(projection, 83, 41);
            for (AlchemyOptions options : all_kinds({.radius = 0.7})) {
                for (const int samples : {0, 1, 2, 15, 16, 17, 64}) {
                    options.samples = samples;
                    options.seed = static_cast<std::uint32_t>(random());
                    INFO(describe(options));
                    nook::Work fast, slow;
                    const auto kernel = visibility(scene, options, {}, &fast);
                    const auto exact = reference(scene.depth.view(), scene.source(), options,
                                                 projection, {}, &slow);
                    CHECK(largest_difference(kernel, exact) < 4e-5);
                    CHECK(fast.pixels == slow.pixels);
                    CHECK(fast.background == slow.background);
                    CHECK(fast.skipped == 0);
                    CHECK(fast.passes == 1);
                }
            }
        }
    }

    TEST_CASE("the kernel agrees with the reference: contrast, bias, epsilon, intensity, radius")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 83, 41);
        AlchemyOptions all[] = {{.contrast = 0},
                                {.contrast = 0.5},
                                {.contrast = 4},
                                {.contrast = 20},
                                {.bias = 0.01},
                                {.bias = 0},
                                {.epsilon = 0},
                                {.epsilon = 0.5},
                                {.intensity = 0},
                                {.intensity = 3},
                                {.radius = 0.05},
                                {.radius = 50},
                                {.radius = 3, .turns = 0},
                                {.radius = 3, .max_pixels = 7}};
        for (AlchemyOptions& given : all)
            for (const AlchemyOptions& options : all_kinds(given)) {
                INFO(describe(options), ", ", &given - all);
                CHECK(largest_difference(visibility(scene, options),
                                         reference(scene.depth.view(), scene.source(), options,
                                                   scene.projection)) < 1e-4);
            }
    }

    TEST_CASE("double depth agrees to double precision")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 83, 41);
        Image<double> depth{83, 41};
        for (int y = 0; y < 41; ++y)
            for (int x = 0; x < 83; ++x) depth(x, y) = double{scene.depth(x, y)};
        for (const AlchemyOptions& options : all_kinds({.radius = 0.7}))
            CHECK(largest_difference(
                      visibility<double>(depth.view(), scene.source(), options, scene.projection),
                      reference(depth.view(), scene.source(), options, scene.projection)) < 1e-10);
    }

    TEST_CASE("the middle of a bowl has its closed form")
    {
        // Samples are rounded to whole pixels, of which the radius has 100.
        constexpr int size = 205, centre = size / 2;
        Scene scene{
            {.fx = 100, .fy = 100, .cx = size / 2.0, .cy = size / 2.0, .orthographic = true},
            size,
            size};
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const double u = (x - centre) / 100.0, v = (y - centre) / 100.0;
                scene.set(x, y, 10 - u * u - v * v, 0, 0, 1);
            }
        for (const SamplePattern pattern : patterns)
            for (const int samples : {4, 9}) {
                AlchemyOptions options{.samples = samples,
                                       .intensity = 0.1,
                                       .bias = 0,
                                       .epsilon = 0,
                                       .pattern = pattern};
                CHECK(std::fabs(double{visibility(scene, options)(centre, centre)} -
                                (samples == 4 ? 0.84265997408 : 0.84286892717212)) < 1e-3);
                options.falloff = AlchemyFalloff::scalable;
                CHECK(std::fabs(double{visibility(scene, options)(centre, centre)} -
                                (samples == 4 ? 0.80926168394287 : 0.80919533117918)) < 4e-3);
            }
    }

    TEST_CASE("a crease has its closed form on average")
    {
        constexpr int size = 205, centre = size / 2, seeds = 300;
        Scene scene{
            {.fx = 100, .fy = 100, .cx = size / 2.0, .cy = size / 2.0, .orthographic = true},
            size,
            size};
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                scene.set(x, y, 10 - std::abs(x - centre) / 100.0, 0, 0, 1);
        // One group is enough.
        Image<std::uint8_t> active{nook::WorkMap::groups(size), size, 0};
        active(centre / 16, centre) = 1;
        for (const bool scalable : {false, true}) {
            double sum = 0;
            for (int seed = 0; seed < seeds; ++seed) {
                const AlchemyOptions options{
                    .samples = 4,
                    .intensity = 0.1,
                    .bias = 0,
                    .epsilon = 0,
                    .falloff = scalable ? AlchemyFalloff::scalable : AlchemyFalloff::alchemy,
                    .seed = static_cast<std::uint32_t>(seed)};
                sum += double{visibility(scene, options, {active.view()})(centre, centre)};
            }
            CHECK(std::fabs(sum / seeds - (scalable ? 0.56472293621046 : 0.73398353580923)) < 0.02);
        }
    }

    TEST_CASE("a flat plane stays exactly 1 at every tilt, in every encoding")
    {
        const auto check = [](const auto& depth, const Scene& scene, const Projection& projection,
                              const std::string& what) {
            for (const AlchemyOptions& options : all_kinds({.radius = 1})) {
                INFO(what, ", ", describe(options));
                CHECK(count_other_than(visibility(depth, scene.source(), options, projection),
                                       1.f) == 0);
            }
        };
        for (const bool orthographic : {false, true})
            for (const double tilt : {0.0, 20.0, 60.0, 85.0, 89.0, 89.9})
                for (const double azimuth : {0.0, 90.0, 217.0}) {
                    Projection projection =
                        orthographic ? slice_scenes::orthographic() : slice_scenes::perspective();
                    projection.near_plane = 0.5;
                    projection.far_plane = 200;
                    Scene scene = slice_scenes::plane(projection, 61, 43, tilt * degree,
                                                      azimuth * degree, 20);
                    // Fixed point flattens what lies before the near plane.
                    for (float& distance : scene.depth)
                        if (distance < 0.5f) distance = 0;
                    const std::string name = (orthographic ? "orthographic, " : "perspective, ") +
                                             std::to_string(tilt) + " towards " +
                                             std::to_string(azimuth);
                    check(scene.depth.view(), scene, projection, name);
                    for (const DepthEncoding encoding :
                         {DepthEncoding::linear, DepthEncoding::negative_z, DepthEncoding::standard,
                          DepthEncoding::reversed, DepthEncoding::opengl,
                          DepthEncoding::logarithmic}) {
                        projection.encoding = encoding;
                        const std::string stored = name + ", " + std::to_string(int(encoding));
                        Image<float> encoded{61, 43};
                        REQUIRE(
                            nook::encode_depths(scene.depth.view(), encoded.view(), projection));
                        check(nook::hardware_depth(encoded.view(), projection), scene, projection,
                              "float, " + stored);
                        if (encoding == DepthEncoding::negative_z) continue;
                        Image<std::uint16_t> d16{61, 43};
                        REQUIRE(nook::encode_depths(scene.depth.view(), d16.view(), projection));
                        check(nook::hardware_depth(d16.view(), projection), scene, projection,
                              "D16, " + stored);
                        Image<std::uint32_t> d24{61, 43};
                        REQUIRE(nook::encode_depths(scene.depth.view(), d24.view(), projection));
                        check(nook::hardware_depth(d24.view(), projection), scene, projection,
                              "D24, " + stored);
                    }
                }
    }

    TEST_CASE("a flat plane stays exactly 1 far away, close by, at half size and in double")
    {
        for (const double tilt : {0.0, 45.0, 80.0, 89.0, 89.9})
            for (const double away : {1e-3, 1.0, 1e3, 1e5, 1e6})
                for (const double focal : {60.0, 1000.0, 1e5}) {
                    const Projection projection = slice_scenes::perspective(focal);
                    const Scene scene =
                        slice_scenes::plane(projection, 61, 43, tilt * degree, 0.6, away);
                    Image<double> wide{61, 43};
                    for (int y = 0; y < 43; ++y)
                        for (int x = 0; x < 61; ++x) wide(x, y) = double{scene.depth(x, y)};
                    // Every second pixel of every second row.
                    const nook::ImageView<const float> half{scene.depth.data(), 31, 22, 122, 2};
                    const NormalSource half_normals = nook::ImageView3<const float>::interleaved(
                        scene.normals.data(), 31, 22, 366, 6);
                    const Projection half_projection{.fx = projection.fx / 2,
                                                     .fy = projection.fy / 2,
                                                     .cx = projection.cx / 2 + 0.25,
                                                     .cy = projection.cy / 2 + 0.25};
                    for (const double radius : {0.03 * away, away, 1e-7, 1e7})
                        for (const AlchemyOptions& options : all_kinds({.radius = radius})) {
                            INFO(tilt, " degrees, ", away, " away, radius ", radius, ", ",
                                 describe(options));
                            CHECK(count_other_than(visibility(scene, options), 1.f) == 0);
                            CHECK(count_other_than(
                                      visibility(half, half_normals, options, half_projection),
                                      1.f) == 0);
                            // What float left of the distances is its step.
                            const nook::DepthSource source{
                                wide.view(), nook::IdentityDecode{}, {.linear = 0x1p-23}};
                            CHECK(count_other_than(visibility<double>(source, scene.source(),
                                                                      options, projection),
                                                   1.0) == 0);
                        }
                }
    }

    TEST_CASE("a flat plane of double distances stays exactly 1 with normals of float")
    {
        for (const double tilt : {0.0, 45.0, 80.0, 89.9})
            for (const double radius : {0.1, 1.0, 100.0}) {
                const Projection projection = slice_scenes::perspective();
                const Scene scene = slice_scenes::plane(projection, 61, 43, tilt * degree, 0.6, 20);
                const double nx = std::sin(tilt * degree) * std::cos(0.6),
                             ny = std::sin(tilt * degree) * std::sin(0.6),
                             nz = std::cos(tilt * degree);
                Image<double> depth{61, 43};
                for (int y = 0; y < 43; ++y)
                    for (int x = 0; x < 61; ++x) {
                        const double sx = (x + 0.5 - projection.cx) / projection.fx;
                        const double sy = (projection.cy - y - 0.5) / projection.fy;
                        if (scene.depth(x, y) > 0) depth(x, y) = 20 * nz / (nz - nx * sx - ny * sy);
                    }
                for (const AlchemyOptions& options : all_kinds({.radius = radius})) {
                    INFO(tilt, " degrees, radius ", radius, ", ", describe(options));
                    CHECK(count_other_than(
                              visibility<double>(depth.view(), scene.source(), options, projection),
                              1.0) == 0);
                }
            }
    }

    TEST_CASE("without bias flat ground shows rounding")
    {
        const Scene scene =
            slice_scenes::plane(slice_scenes::perspective(), 61, 43, 60 * degree, 0.6, 20);
        CHECK(count_other_than(visibility(scene, {.bias = 0}), 1.f) > 200);
    }

    TEST_CASE("lengths times a power of two give the same bits")
    {
        for (const Projection& projection :
             {slice_scenes::perspective(), slice_scenes::orthographic()}) {
            const Scene scene = slice_scenes::varied(projection, 51, 41);
            for (AlchemyOptions options : all_kinds({.radius = 0.7})) {
                const auto unset = visibility(scene, options);
                options.epsilon = 0.001;
                options.intensity = 0.4;
                options.bias = 0.0001;
                const auto set = visibility(scene, options);
                CHECK(!same_bits(unset, set));
                for (const int exponent : {-100, -60, -23, 1, 23, 60, 120}) {
                    INFO(describe(options), ", 2^", exponent);
                    const Scene moved = scaled(scene, exponent);
                    AlchemyOptions wide = options;
                    wide.radius = std::ldexp(options.radius, exponent);
                    wide.epsilon = std::ldexp(*options.epsilon, 2 * exponent);
                    wide.intensity = std::ldexp(*options.intensity, exponent);
                    CHECK(same_bits(visibility(moved, wide), set));
                    wide.epsilon.reset();
                    wide.intensity.reset();
                    wide.bias.reset();
                    CHECK(same_bits(visibility(moved, wide), unset));
                }
            }
        }
    }

    TEST_CASE("radii of 1e-7 and 1e7 see the same relief as a radius of 1")
    {
        for (const AlchemyOptions& options : all_kinds({})) {
            Image<float> first;
            for (const double radius : {1.0, 1e-7, 1e7}) {
                Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
                for (float& distance : scene.depth)
                    distance = static_cast<float>(double{distance} * radius);
                AlchemyOptions used = options;
                used.radius = radius;
                const auto result = visibility(scene, used);
                if (radius == 1) first = result;
                // A scaled reach may round to another pixel now and then.
                CHECK(std::fabs(mean(result) - mean(first)) < 1e-3);
                CHECK(mean(result) < 0.99);
            }
        }
    }

    TEST_CASE("extreme options: nothing leaves [0, 1]")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        for (const double radius :
             {5e-324, 1e-310, 1e-300, 1e-40, 1e-30, 1e-7, 1e7, 1e30, 1e300, 1.7e308})
            for (const AlchemyOptions& options : all_kinds({.radius = radius})) {
                INFO("radius ", radius, ", ", describe(options));
                CHECK(count_outside_unit(visibility(scene, options)) == 0);
            }
        for (const double focal : {1e-10, 1e-3, 1e10, 1e30})
            for (const double centre : {-1e30, 0.0, 1e9})
                for (const AlchemyOptions& options : all_kinds({})) {
                    Scene odd = scene;
                    odd.projection = {.fx = focal, .fy = 1 / focal, .cx = centre, .cy = centre / 7};
                    INFO("focal ", focal, ", centre ", centre, ", ", describe(options));
                    CHECK(count_outside_unit(visibility(odd, options)) == 0);
                    odd.projection.orthographic = true;
                    CHECK(count_outside_unit(visibility(odd, options)) == 0);
                }
        for (const double large : {1e30, 1.7e308})
            for (const AlchemyOptions& options :
                 {AlchemyOptions{.intensity = large}, AlchemyOptions{.epsilon = large},
                  AlchemyOptions{.bias = large}, AlchemyOptions{.contrast = large},
                  AlchemyOptions{.turns = std::numeric_limits<int>::max()}})
                for (const AlchemyOptions& kind : all_kinds(options)) {
                    CHECK(count_outside_unit(visibility(scene, kind)) == 0);
                    if (options.bias || options.epsilon)
                        CHECK(count_other_than(visibility(scene, kind), 1.f) == 0);
                }
    }

    TEST_CASE("extreme depths: nothing leaves [0, 1], and background is exactly 1")
    {
        for (const AlchemyOptions& options : all_kinds({}))
            for (const double odd : {0.0, -0.0, -1.0, -infinity, infinity, not_a_number, 1e-45,
                                     1e-38, 1e-20, 1e-3, 1e6, 1e20, 1e30, 3.4e38}) {
                Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
                for (int y = 0; y < 41; ++y)
                    for (int x = 0; x < 51; ++x)
                        if ((x + y) % 3 == 0 || y == 20)
                            scene.depth(x, y) = static_cast<float>(odd);
                INFO("depth ", odd, ", ", describe(options));
                const auto result = visibility(scene, options);
                CHECK(count_outside_unit(result) == 0);
                if (!nook::is_surface(static_cast<float>(odd), 3.4e38f))
                    for (int x = 0; x < 51; ++x) CHECK(result(x, 20) == 1);
                Scene alone{scene.projection, 20, 3};
                for (int y = 0; y < 3; ++y)
                    for (int x = 0; x < 20; ++x) alone.set(x, y, odd, 0, 0, 1);
                CHECK(count_other_than(visibility(alone, options), 1.f) == 0);
            }
    }

    TEST_CASE("background, the outside of the image and the pixel itself count as open")
    {
        for (const AlchemyOptions& options : all_kinds({.radius = 100})) {
            // All that is in reach is one step towards the viewer, which darkens by its own share.
            Scene scene{slice_scenes::perspective(), 40, 30};
            for (int y = 0; y < 30; ++y)
                for (int x = 0; x < 40; ++x) scene.set(x, y, 5, 0, 0, 1);
            CHECK(count_other_than(visibility(scene, options), 1.f) == 0);
            for (int y = 0; y < 30; ++y)
                for (int x = 20; x < 40; ++x) scene.set(x, y, 4, 0, 0, 1);
            const auto beside = visibility(scene, options);
            CHECK(count_other_than(beside, 1.f) > 100);
            for (int y = 0; y < 30; ++y)
                for (int x = 20; x < 40; ++x) scene.set(x, y, infinity, 0, 0, 1);
            CHECK(count_other_than(visibility(scene, options), 1.f) == 0);
            Scene cut{scene.projection, 20, 30};
            for (int y = 0; y < 30; ++y)
                for (int x = 0; x < 20; ++x) cut.set(x, y, 5, 0, 0, 1);
            CHECK(count_other_than(visibility(cut, options), 1.f) == 0);
        }
        // A pixel that is no neighbour of anything else sees nothing but itself.
        Scene lone{slice_scenes::perspective(), 9, 9};
        lone.set(4, 4, 5, 0, 0, 1);
        for (const AlchemyOptions& options : all_kinds({.radius = 1, .bias = 0, .epsilon = 0}))
            CHECK(count_other_than(visibility(lone, options), 1.f) == 0);
    }

    TEST_CASE("a disc smaller than a pixel leaves everything open, and one of a pixel does not")
    {
        Scene scene = slice_scenes::varied(slice_scenes::perspective(100), 51, 41);
        const double nearest = 4.5, farthest = 8;
        for (const AlchemyOptions& options : all_kinds({.radius = 0.99 * nearest / 100})) {
            CHECK(count_other_than(visibility(scene, options), 1.f) == 0);
            AlchemyOptions more = options;
            more.radius = 1.5 * farthest / 100;
            CHECK(count_other_than(visibility(scene, more), 1.f) > 0);
        }
    }

    TEST_CASE("at a silhouette of 1 against 1e6 the near side is exactly 1 and throws no halo")
    {
        for (const double far_away : {30.0, 1e3, 1e6, 1e12})
            for (const AlchemyOptions& options : all_kinds({.radius = 0.5})) {
                Scene scene{slice_scenes::perspective(200), 64, 48};
                for (int y = 0; y < 48; ++y)
                    for (int x = 0; x < 64; ++x)
                        scene.set(x, y, x < 30 + y % 3 ? 1 : far_away, 0, 0, 1);
                const auto result = visibility(scene, options);
                INFO(far_away, ", ", describe(options));
                for (int y = 0; y < 48; ++y)
                    for (int x = 0; x < 64; ++x) {
                        if (x < 30 + y % 3) REQUIRE(result(x, y) == 1);
                        // No halo on the far side either; the sum of 2011 has no end at the radius.
                        else if (far_away > 1e2 || options.falloff == AlchemyFalloff::scalable)
                            REQUIRE(result(x, y) == 1);
                    }
            }
    }

    TEST_CASE("normals: any length, no normal is open, facing away is used as it is")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        for (const AlchemyOptions& options : all_kinds({})) {
            const auto unit = visibility(scene, options);
            for (const float length : {1e-30f, 1e-20f, 0.5f, 3.f, 1e18f, 1e30f}) {
                Scene longer = scene;
                for (float& n : longer.normals) n *= length;
                INFO(length);
                CHECK(largest_difference(visibility(longer, options), unit) < 2e-5);
            }
            for (const float bad : {0.f, float(not_a_number), float(infinity), -float(infinity)}) {
                Scene none = scene;
                for (int y = 0; y < 41; ++y)
                    for (int x = y % 2; x < 51; x += 3)
                        for (int i = 0; i < 3; ++i)
                            if (bad == 0 || i == x % 3) none.normal(x, y)[i] = bad;
                nook::Work work;
                const auto result = visibility(none, options, {}, &work);
                std::uint64_t background = 0;
                for (int y = 0; y < 41; ++y)
                    for (int x = 0; x < 51; ++x) {
                        const bool without = x % 3 == y % 2 && x >= y % 2;
                        const float* const n = none.normal(x, y);
                        const bool zero = n[0] == 0 && n[1] == 0 && n[2] == 0;
                        const bool surface = nook::is_surface(none.depth(x, y), 3.4e38f);
                        background += without || zero || !surface;
                        if (without || zero || !surface) REQUIRE(result(x, y) == 1);
                        // Others still see it as an occluder; with the row pattern it has no say in
                        // how far they look.
                        else if (options.pattern == SamplePattern::pixel)
                            REQUIRE(result(x, y) == doctest::Approx(unit(x, y)).epsilon(1e-4));
                    }
                CHECK(work.background == background);
            }
            Scene away = scene;
            for (float& n : away.normals) n = -n;
            const auto result = visibility(away, options);
            CHECK(count_outside_unit(result) == 0);
            CHECK(largest_difference(result, unit) > 0.5);
            CHECK(largest_difference(result, reference(away.depth.view(), away.source(), options,
                                                       away.projection)) < 4e-5);
        }
    }

    TEST_CASE("normals in world axes with their rotation, planar and with gaps")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        const auto unit = visibility(scene, {});
        // A rotation about an axis that is none of the three, and the normals turned back by it.
        const double c = std::cos(0.7), s = std::sin(0.7), a = std::cos(1.9), b = std::sin(1.9);
        const double m[9] = {c, -s * a, s * b, s, c * a, -c * b, 0, b, a};
        float rotation[9];
        std::vector<float> gaps(51 * 41 * 4);
        Image<float> planes[3] = {{51, 41}, {51, 41}, {51, 41}};
        for (int i = 0; i < 9; ++i) rotation[i] = static_cast<float>(m[i]);
        Scene turned = scene;
        for (int y = 0; y < 41; ++y)
            for (int x = 0; x < 51; ++x) {
                const float* const n = turned.normal(x, y);
                const double old[3] = {double{n[0]}, double{n[1]}, double{n[2]}};
                for (int i = 0; i < 3; ++i) {
                    planes[i](x, y) = n[i];
                    gaps[static_cast<std::size_t>((y * 51 + x) * 4 + i)] = n[i];
                }
                for (int i = 0; i < 3; ++i)
                    turned.normal(x, y)[i] =
                        static_cast<float>(m[i] * old[0] + m[3 + i] * old[1] + m[6 + i] * old[2]);
            }
        const auto image = turned.source().image;
        CHECK(largest_difference(visibility(scene.depth.view(), NormalSource{image, rotation}, {},
                                            scene.projection),
                                 unit) < 2e-5);
        CHECK(largest_difference(visibility(turned, {}), unit) > 0.1);
        CHECK(same_bits(visibility(scene.depth.view(),
                                   nook::ImageView3<const float>{planes[0], planes[1], planes[2]},
                                   {}, scene.projection),
                        unit));
        CHECK(same_bits(
            visibility(scene.depth.view(),
                       nook::ImageView3<const float>::interleaved(gaps.data(), 51, 41, 51 * 4, 4),
                       {}, scene.projection),
            unit));
    }

    TEST_CASE("bottom-up and strided images give the same bits")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        const auto unit = visibility(scene, {});
        std::vector<float> depth(51 * 41 * 2), out(51 * 41 * 3, -1.f), normals(51 * 41 * 3);
        for (int y = 0; y < 41; ++y)
            for (int x = 0; x < 51; ++x) {
                depth[static_cast<std::size_t>(((40 - y) * 51 + x) * 2)] = scene.depth(x, y);
                for (int i = 0; i < 3; ++i)
                    normals[static_cast<std::size_t>(((40 - y) * 51 + x) * 3 + i)] =
                        scene.normals[static_cast<std::size_t>((y * 51 + x) * 3 + i)];
            }
        const nook::ImageView<float> result{out.data() + 40 * 153, 51, 41, -153, 3};
        REQUIRE(nook::alchemy_ao(
            nook::ImageView<const float>{depth.data() + 40 * 102, 51, 41, -102, 2},
            nook::ImageView3<const float>::interleaved(normals.data() + 40 * 153, 51, 41, -153),
            result, {}, scene.projection));
        for (int y = 0; y < 41; ++y)
            for (int x = 0; x < 51; ++x) REQUIRE(result(x, y) == unit(x, y));
        CHECK(out[1] == -1);
        CHECK(out[2] == -1);
    }

    TEST_CASE("work maps: computed groups have the bits of the unmasked run, others are exactly 1")
    {
        std::mt19937 random{17};
        for (const Projection& projection :
             {slice_scenes::perspective(), slice_scenes::orthographic()})
            for (const int width : {16, 45, 80}) {
                const Scene scene = slice_scenes::varied(projection, width, 33);
                const int groups = nook::WorkMap::groups(width);
                for (const AlchemyOptions& options : all_kinds({})) {
                    nook::Work all;
                    const auto whole = visibility(scene, options, {}, &all);
                    const auto slow =
                        reference(scene.depth.view(), scene.source(), options, projection);
                    for (const unsigned share : {0u, 1u, 4u, 10u}) {
                        Image<std::uint8_t> active{groups, 33};
                        for (auto& group : active)
                            group = random() % 10 < share
                                        ? static_cast<std::uint8_t>(1 + random() % 255)
                                        : std::uint8_t{0};
                        const nook::WorkMap map{active.view()};
                        nook::Work work, reference_work;
                        const auto masked = visibility(scene, options, map, &work);
                        const auto masked_slow =
                            reference(scene.depth.view(), scene.source(), options, projection, map,
                                      &reference_work);
                        std::uint64_t skipped = 0, background = 0;
                        int wrong = 0;
                        for (int y = 0; y < 33; ++y)
                            for (int x = 0; x < width; ++x) {
                                const bool on = map.is_active(x, y);
                                const bool surface = nook::is_surface(scene.depth(x, y), 3.4e38f);
                                const bool shaded = surface && !(x == width / 4 && y == 33 / 2);
                                skipped += !on && surface;
                                background += on ? !shaded : !surface;
                                wrong += !(masked(x, y) == (on ? whole(x, y) : 1.f));
                                wrong += !(masked_slow(x, y) == (on ? slow(x, y) : 1.0));
                            }
                        CHECK(wrong == 0);
                        CHECK(work.skipped == skipped);
                        CHECK(work.background == background);
                        CHECK(reference_work.skipped == skipped);
                        CHECK(reference_work.background == background);
                        if (share == 10) CHECK(same_bits(masked, whole));
                        if (share == 0) CHECK(count_other_than(masked, 1.f) == 0);
                    }
                }
            }
    }

    TEST_CASE("any number of threads gives the same bits and counts")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 131, 97);
        for (const AlchemyOptions& options : all_kinds({})) {
            nook::Work serial;
            const auto expected = visibility(scene, options, {}, &serial);
            const auto slow =
                reference(scene.depth.view(), scene.source(), options, scene.projection);
            for (const int workers : {1, 2, 3}) {
                nook::ThreadExecutor threads{workers};
                Image<float> result{131, 97, -1.f};
                const nook::Outcome done =
                    nook::alchemy_ao(scene.depth.view(), scene.source(), result.view(), options,
                                     scene.projection, {}, nook::HeapScratch{}, threads);
                REQUIRE(done);
                CHECK(same_bits(result, expected));
                CHECK(done.work.background == serial.background);
                Image<double> other{131, 97, -1};
                REQUIRE(nook::alchemy_ao_reference(scene.depth.view(), scene.source(), other.view(),
                                                   options, scene.projection, {}, threads));
                CHECK(same_bits(other, slow));
            }
        }
    }

    TEST_CASE("scratch: as much as asked for is enough, a byte less is an error")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        const auto expected = visibility(scene, {});
        for (const int workers : {1, 3}) {
            nook::ThreadExecutor threads{workers};
            const std::size_t size = nook::alchemy_ao_scratch_size(scene.depth.view(), workers);
            std::vector<std::byte> memory(size);
            Image<float> result{51, 41, -1.f};
            REQUIRE(nook::alchemy_ao(scene.depth.view(), scene.source(), result.view(), {},
                                     scene.projection, {}, nook::Scratch{memory.data(), size},
                                     threads));
            CHECK(same_bits(result, expected));
            result = {51, 41, -1.f};
            const nook::Outcome less = nook::alchemy_ao(
                scene.depth.view(), scene.source(), result.view(), {}, scene.projection, {},
                nook::Scratch{memory.data(), size - 1}, threads);
            CHECK(less.error.code == nook::ErrorCode::scratch_too_small);
            CHECK(std::string{less.error.argument} == "scratch");
            CHECK(count_other_than(result, -1.f) == 0);
        }
    }

    TEST_CASE(
        "what leaves everything open by definition: no samples, radius, contrast or intensity")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        for (const AlchemyOptions& given :
             {AlchemyOptions{.samples = 0}, AlchemyOptions{.radius = 0},
              AlchemyOptions{.contrast = 0}, AlchemyOptions{.intensity = 0}})
            for (const AlchemyOptions& options : all_kinds(given)) {
                nook::Work work;
                CHECK(count_other_than(visibility(scene, options, {}, &work), 1.f) == 0);
                CHECK(count_other_than(
                          reference(scene.depth.view(), scene.source(), options, scene.projection),
                          1.0) == 0);
                CHECK(work.pixels == 51 * 41);
                CHECK(work.background > 0);
            }
        // A large contrast or intensity leaves 1 where nothing occludes and 0 elsewhere.
        const Scene flat = slice_scenes::plane(scene.projection, 51, 41, 1, 0.6, 20);
        for (const AlchemyOptions& given : all_kinds({})) {
            const auto plain = visibility(scene, given);
            for (const double large : {1e9, 1e300}) {
                AlchemyOptions steep = given, strong = given;
                steep.contrast = large;
                strong.intensity = large;
                const auto power = visibility(scene, steep), dark = visibility(scene, strong);
                for (int y = 0; y < 41; ++y)
                    for (int x = 0; x < 51; ++x) {
                        if (plain(x, y) == 1) REQUIRE(power(x, y) == 1);
                        if (plain(x, y) > 0.999f) continue;
                        REQUIRE(power(x, y) == 0);
                        REQUIRE(dark(x, y) == 0);
                    }
                CHECK(count_other_than(visibility(flat, strong), 1.f) == 0);
            }
        }
    }

    TEST_CASE("more intensity is darker, and so is a wider reach of contrast")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        for (const AlchemyOptions& given : all_kinds({})) {
            double before = 2;
            for (const double intensity : {0.0, 0.1, 0.5, 2.0}) {
                AlchemyOptions options = given;
                options.intensity = intensity;
                const double now = mean(visibility(scene, options));
                CHECK(now < before);
                before = now;
            }
            AlchemyOptions steep = given, shallow = given;
            steep.contrast = 2;
            shallow.contrast = 0.5;
            CHECK(mean(visibility(scene, steep)) < mean(visibility(scene, given)));
            CHECK(mean(visibility(scene, given)) < mean(visibility(scene, shallow)));
        }
    }

    TEST_CASE("the row pattern differs from row to row, the pixel pattern from pixel to pixel")
    {
        // A crease along x looks the same at every x, but for the angle of the samples.
        Scene scene{{.fx = 20, .fy = 20, .cx = 0, .cy = 20.5, .orthographic = true}, 8192, 41};
        for (int y = 0; y < 41; ++y)
            for (int x = 0; x < 8192; ++x) scene.set(x, y, 10 - std::abs(y - 20) / 20.0, 0, 0, 1);
        const auto rows = visibility(scene, {}),
                   pixels = visibility(scene, {.pattern = SamplePattern::pixel});
        for (const int first : {64, 4096, 8000}) {
            double sum = 0, squares = 0;
            for (int x = first; x < first + 128; ++x) {
                CHECK(rows(x, 20) == rows(first, 20));
                sum += double{pixels(x, 20)};
                squares += double{pixels(x, 20)} * double{pixels(x, 20)};
            }
            CHECK(squares / 128 - sum * sum / (128.0 * 128) > 1e-5);
        }
        // The same along y: rows by turns.
        Scene tall{{.fx = 20, .fy = 20, .cx = 8.5, .cy = 0, .orthographic = true}, 17, 8192};
        for (int y = 0; y < 8192; ++y)
            for (int x = 0; x < 17; ++x) tall.set(x, y, 10 - std::abs(x - 8) / 20.0, 0, 0, 1);
        const auto turned = visibility(tall, {});
        for (const int first : {64, 4096, 8000}) {
            std::set<float> values;
            for (int y = first; y < first + 128; ++y) values.insert(turned(8, y));
            CHECK(values.size() > 32);
        }
        CHECK(!same_bits(visibility(tall, {.seed = 1}), turned));
    }

    TEST_CASE("images of any size, and of none")
    {
        struct Size {
            int width, height;
        };
        for (const Size size : {Size{1, 1}, Size{1, 9}, Size{9, 1}, Size{15, 3}, Size{16, 3},
                                Size{17, 3}, Size{33, 2}, Size{992, 2}}) {
            const int width = size.width, height = size.height;
            Scene whole = slice_scenes::varied(slice_scenes::perspective(), 992, 40);
            Scene scene{whole.projection, width, height};
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const float* const n = whole.normal(x, y + 8);
                    scene.set(x, y, double{whole.depth(x, y + 8)}, double{n[0]}, double{n[1]},
                              double{n[2]});
                }
            for (const AlchemyOptions& options : all_kinds({.radius = 3})) {
                INFO(width, " x ", height, ", ", describe(options));
                CHECK(largest_difference(visibility(scene, options),
                                         reference(scene.depth.view(), scene.source(), options,
                                                   scene.projection)) < 4e-5);
            }
        }
        const Projection projection = slice_scenes::perspective();
        const nook::ImageView<const float> nothing{};
        for (const nook::Outcome& done :
             {nook::alchemy_ao(nothing, {}, nook::ImageView<float>{}, {}, projection),
              nook::alchemy_ao_reference(nothing, {}, nook::ImageView<float>{}, {}, projection)}) {
            CHECK(done);
            CHECK(done.work.pixels == 0);
        }
        CHECK(nook::alchemy_ao(nothing, {}, nook::ImageView<float>{}, {}, projection, {},
                               nook::Scratch{}));
    }

    TEST_CASE("bad arguments are named, and nothing is written")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 51, 41);
        Image<float> result{51, 41, -1.f};
        const auto check = [&](const char* argument, nook::ErrorCode code, const auto& depth,
                               const NormalSource& normals, const auto& output,
                               const AlchemyOptions& options, const Projection& projection,
                               const nook::WorkMap& map = {}) {
            INFO(argument);
            for (const nook::Outcome& done :
                 {nook::alchemy_ao(depth, normals, output, options, projection, map),
                  nook::alchemy_ao_reference(depth, normals, output, options, projection, map)}) {
                CHECK(done.error.code == code);
                CHECK(std::string{done.error.argument} == argument);
                CHECK(done.work.pixels == 0);
            }
            CHECK(count_other_than(result, -1.f) == 0);
        };
        const auto depth = scene.depth.view();
        const auto normals = scene.source();
        const auto bad_option = [&](const char* argument, const AlchemyOptions& options) {
            check(argument, nook::ErrorCode::bad_value, depth, normals, result.view(), options,
                  scene.projection);
        };
        for (const double bad : {-1.0, infinity, not_a_number}) {
            bad_option("options.radius", {.radius = bad});
            bad_option("options.intensity", {.intensity = bad});
            bad_option("options.contrast", {.contrast = bad});
            bad_option("options.bias", {.bias = bad});
            bad_option("options.epsilon", {.epsilon = bad});
        }
        bad_option("options.samples", {.samples = -1});
        bad_option("options.samples", {.samples = 65});
        bad_option("options.turns", {.turns = -1});
        bad_option("options.max_pixels", {.max_pixels = 0});
        bad_option("options.max_pixels", {.max_pixels = 4097});
        bad_option("options.falloff", {.falloff = static_cast<AlchemyFalloff>(2)});
        bad_option("options.pattern", {.pattern = static_cast<SamplePattern>(2)});

        using nook::ErrorCode;
        const auto bad_depth = [&](ErrorCode code, const nook::ImageView<const float>& view) {
            check("depth", code, view, normals, result.view(), {}, scene.projection);
        };
        bad_depth(ErrorCode::null_data, {nullptr, 51, 41});
        bad_depth(ErrorCode::bad_size, {depth.data, -1, 41});
        for (const char* const name : {"normals.x", "normals.y", "normals.z"}) {
            NormalSource none = normals, narrow = normals;
            const int channel = name[8] - 'x';
            auto& gone = channel == 0 ? none.image.x : channel == 1 ? none.image.y : none.image.z;
            auto& cut = channel == 0   ? narrow.image.x
                        : channel == 1 ? narrow.image.y
                                       : narrow.image.z;
            gone.data = nullptr;
            cut.width = 50;
            check(name, ErrorCode::null_data, depth, none, result.view(), {}, scene.projection);
            check(name, ErrorCode::bad_size, depth, narrow, result.view(), {}, scene.projection);
        }
        for (const double bad : {infinity, not_a_number, 5.0}) {
            NormalSource turned = normals;
            turned.to_view[5] = static_cast<float>(bad);
            check("normals.to_view", ErrorCode::bad_value, depth, turned, result.view(), {},
                  scene.projection);
        }
        check("visibility", ErrorCode::null_data, depth, normals,
              nook::ImageView<float>{nullptr, 51, 41}, {}, scene.projection);
        check("visibility", ErrorCode::bad_size, depth, normals,
              nook::ImageView<float>{result.data(), 51, 40}, {}, scene.projection);
        check("visibility", ErrorCode::bad_stride, depth, normals,
              nook::ImageView<float>{result.data(), 51, 41, 0}, {}, scene.projection);
        check("visibility", ErrorCode::overlap,
              nook::ImageView<const float>{result.data() + 51, 51, 40},
              nook::ImageView3<const float>::interleaved(scene.normals.data(), 51, 40, 153),
              nook::ImageView<float>{result.data(), 51, 40}, {}, scene.projection);
        check("visibility", ErrorCode::overlap, depth,
              nook::ImageView3<const float>{normals.image.x, normals.image.y, result.view()},
              result.view(), {}, scene.projection);
        for (const double bad : {0.0, -1.0, infinity, not_a_number}) {
            Projection wrong = scene.projection;
            wrong.fx = bad;
            check("projection.fx", ErrorCode::bad_value, depth, normals, result.view(), {}, wrong);
        }
        const std::vector<std::uint8_t> active(4 * 41, 1);
        check("work_map.active", ErrorCode::bad_size, depth, normals, result.view(), {},
              scene.projection, {{active.data(), 3, 41}});
        check("work_map.active", ErrorCode::bad_size, depth, normals, result.view(), {},
              scene.projection, {{active.data(), 4, 40}});
        // Margins included, this is more than 32 bits can index.
        std::array<float, 1> one{};
        check("depth", ErrorCode::bad_size,
              nook::ImageView<const float>{one.data(), 1 << 20, 4096, 0, 0},
              nook::ImageView3<const float>{{one.data(), 1 << 20, 4096, 0, 0},
                                            {one.data(), 1 << 20, 4096, 0, 0},
                                            {one.data(), 1 << 20, 4096, 0, 0}},
              nook::ImageView<float>{reinterpret_cast<float*>(std::uintptr_t{1} << 40), 1 << 20,
                                     4096},
              {}, scene.projection);
    }
}
