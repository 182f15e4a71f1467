#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/thread_executor.hpp>

#include "slice_scenes.hpp"

namespace {

using nook::HorizonOptions;
using nook::Image;
using nook::Projection;
using slice_scenes::Scene;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

template <class Depth>
Image<float> visibility(const Depth& depth, const Scene& scene, const HorizonOptions& options,
                        const nook::WorkMap& work_map = {})
{
    Image<float> result{scene.width(), scene.height(), -1.f};
    REQUIRE(nook::horizon_ao(depth, scene.source(), result.view(), options, scene.projection,
                             work_map));
    return result;
}
Image<float> visibility(const Scene& scene, const HorizonOptions& options,
                        const nook::WorkMap& work_map = {})
{
    return visibility(scene.depth.view(), scene, options, work_map);
}
Image<float> reference(const Scene& scene, const HorizonOptions& options,
                       const nook::WorkMap& work_map = {})
{
    Image<float> result{scene.width(), scene.height(), -1.f};
    REQUIRE(nook::horizon_ao_reference(scene.depth.view(), scene.source(), result.view(), options,
                                       scene.projection, work_map));
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
/// Pixels that differ by more than `bound`.
int differing(const Image<float>& a, const Image<float>& b, double bound)
{
    int count = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x)
            count += !(std::fabs(double{a(x, y)} - double{b(x, y)}) <= bound);
    return count;
}
/// The rows in the middle of a scene, whose slices differ.
struct Middle {
    const Scene& scene;
    int first, last;
    Image<std::uint8_t> active;

    Middle(const Scene& whole, int rows)
        : scene{whole},
          first{(whole.height() - rows) / 2},
          last{first + rows},
          active{nook::WorkMap::groups(whole.width()), whole.height()}
    {
        for (int y = first; y < last; ++y)
            for (int x = 0; x < active.width(); ++x) active(x, y) = 1;
    }
    /// Over a column of them.
    [[nodiscard]] double mean(const HorizonOptions& options, int x) const
    {
        const Image<float> open = visibility(scene, options, {active.view()});
        double sum = 0;
        for (int y = first; y < last; ++y) sum += double{open(x, y)};
        return sum / (last - first);
    }
};

}  // namespace

TEST_CASE("open ground of every tilt is exactly 1, with any number of slices")
{
    for (const Projection& projection : {slice_scenes::perspective(), slice_scenes::orthographic()})
        for (const double degrees : {0.0, 1.0, 30.0, 60.0, 80.0, 89.0, 89.9})
            for (const double azimuth : {0.3, 1.9, 4.4}) {
                const Scene scene =
                    slice_scenes::plane(projection, 60, 42, degrees * pi / 180, azimuth, 3);
                CAPTURE(degrees);
                CAPTURE(azimuth);
                for (const int slices : {1, 2, 3, 5})
                    CHECK(all_open(visibility(scene, {.radius = 2, .slices = slices, .steps = 4})));
                CHECK(all_open(visibility(scene, {.radius = 2, .thickness = 0.3})));
                CHECK(all_open(reference(scene, {.radius = 2})));
            }
}

TEST_CASE("open ground far from the viewer is exactly 1")
{
    for (const double away : {1e3, 1e5, 1e9})
        for (const double degrees : {20.0, 75.0, 88.0}) {
            const Scene scene = slice_scenes::plane(slice_scenes::perspective(4000), 60, 42,
                                                    degrees * pi / 180, 0.8, away);
            for (const double radius : {away / 100, away / 1000})
                CHECK(all_open(visibility(scene, {.radius = radius})));
        }
}

TEST_CASE("open ground is exactly 1 in every hardware encoding and storage")
{
    using nook::DepthEncoding;
    for (const DepthEncoding encoding :
         {DepthEncoding::standard, DepthEncoding::reversed, DepthEncoding::opengl,
          DepthEncoding::logarithmic, DepthEncoding::negative_z, DepthEncoding::linear})
        for (const bool orthographic : {false, true})
            for (const double degrees : {10.0, 55.0, 78.0}) {
                Projection projection =
                    orthographic ? slice_scenes::orthographic() : slice_scenes::perspective();
                projection.encoding = encoding;
                projection.near_plane = 0.1;
                projection.far_plane = 100;
                const Scene scene =
                    slice_scenes::plane(projection, 60, 42, degrees * pi / 180, 2.4, 20);
                CAPTURE(static_cast<int>(encoding));
                CAPTURE(degrees);
                const auto check = [&]<class Stored, class Storage>(Stored, Storage) {
                    if (Storage::fixed_point && encoding == DepthEncoding::negative_z) return;
                    Image<Stored> stored{60, 42};
                    REQUIRE(nook::encode_depths<Storage>(scene.depth.view(), stored.view(),
                                                         projection));
                    const Image<Stored>& encoded = stored;
                    CHECK(all_open(
                        visibility(nook::hardware_depth<Storage>(encoded.view(), projection), scene,
                                   {.radius = 6})));
                };
                check(float{}, nook::FloatStorage<float>{});
                check(std::uint32_t{}, nook::D24Storage{});
                check(std::uint16_t{}, nook::D16Storage{});
                check(std::uint16_t{}, nook::HalfStorage{});
            }
}

TEST_CASE("without bias quantised ground is not exactly open: the automatic bias does something")
{
    Projection projection = slice_scenes::perspective();
    projection.encoding = nook::DepthEncoding::standard;
    projection.near_plane = 0.1;
    projection.far_plane = 100;
    const Scene scene = slice_scenes::plane(projection, 60, 42, 0.9, 2.4, 5);
    Image<std::uint16_t> stored{60, 42};
    REQUIRE(nook::encode_depths(scene.depth.view(), stored.view(), projection));
    const Image<std::uint16_t>& encoded = stored;
    const auto depth = nook::hardware_depth(encoded.view(), projection);
    CHECK(all_open(visibility(depth, scene, {.radius = 1.5})));
    CHECK(!all_open(visibility(depth, scene, {.radius = 1.5, .bias = 0})));
    CHECK(all_open(visibility(depth, scene, {.radius = 1.5, .bias = 0.1})));
}

TEST_CASE("a floor beside a wall as high as it is far: 0.8536 as samples grow")
{
    // One pixel is 1/32; the top of the wall begins 32 pixels from the pixel that is looked at.
    const Projection projection{.fx = 32, .fy = 32, .cx = 0, .cy = 0, .orthographic = true};
    Scene scene{projection, 256, 420};
    for (int y = 0; y < 420; ++y)
        for (int x = 0; x < 256; ++x) scene.set(x, y, x < 48 ? 10 : 9, 0, 0, 1);
    const Middle middle{scene, 10};
    // The highest sample lies behind the edge by their spacing; along the wall it is cut at 6.
    double error = 1;
    for (const int steps : {8, 32, 128}) {
        double open = 0;
        for (const std::uint32_t seed : {1u, 2u, 3u, 4u})
            open += middle.mean({.radius = 6, .slices = 4, .steps = steps, .seed = seed}, 16) / 4;
        const double now = open - 0.853553390593274;
        CAPTURE(now);
        CHECK(std::fabs(now) < 0.6 * error);
        error = std::fabs(now);
    }
    CHECK(error < 0.005);
}

TEST_CASE("two planes at a right angle, seen from between them: the wall with a step radius")
{
    // z = −d: both planes rise by 45° from the crease at x = 0.
    const Projection projection{.fx = 64, .fy = 64, .cx = 144, .cy = 140, .orthographic = true};
    Scene scene{projection, 288, 280};
    const double root = std::sqrt(0.5);
    for (int y = 0; y < 280; ++y)
        for (int x = 0; x < 288; ++x) {
            const double at = (x + 0.5 - 144) / 64;
            scene.set(x, y, 10 - std::fabs(at), at < 0 ? root : -root, 0, root);
        }
    const Middle middle{scene, 16};
    for (const int x : {64, 100, 120, 135}) {
        const double a = (143.5 - x) / 64 / root, c = a / 2;
        const double exact = 1 - (std::acos(c) - c * std::sqrt(1 - c * c)) / pi;
        CAPTURE(x);
        CHECK(std::fabs(middle.mean({.radius = 2, .slices = 4, .steps = 128}, x) - exact) < 0.012);
    }
    // a ≥ R.
    CHECK(middle.mean({.radius = 2, .slices = 4, .steps = 128}, 40) == 1);
}

TEST_CASE(
    "the corner of a room, off the axis of a perspective view, is the wall with a step radius")
{
    const Projection projection{.fx = 1000, .fy = 800, .cx = 710, .cy = -360};
    // Two walls at a right angle, turned about the vertical and leaning.
    const double root = std::sqrt(0.5), lean = 0.4, c = std::cos(lean), s = std::sin(lean);
    const double walls[2][3] = {{root, s * root, c * root}, {-root, s * root, c * root}};
    const double away[] = {2, 0.82};
    Scene scene{projection, 420, 400};
    for (int y = 0; y < 400; ++y)
        for (int x = 0; x < 420; ++x) {
            const double sx = (x + 0.5 - projection.cx) / projection.fx;
            const double sy = (projection.cy - y - 0.5) / projection.fy;
            double distances[2];
            for (int i = 0; i < 2; ++i) {
                const double along = walls[i][0] * sx + walls[i][1] * sy - walls[i][2];
                distances[i] = along < 0 ? -away[i] / along : 1e9;
            }
            const int hit = distances[0] < distances[1] ? 0 : 1;
            scene.set(x, y, distances[hit], walls[hit][0], walls[hit][1], walls[hit][2]);
        }
    // Small beside the distance: the disc of samples on the screen is that of the pixel's distance.
    const double radius = 0.15;
    const Middle middle{scene, 20};
    const Image<float> open =
        visibility(scene, {.radius = radius, .slices = 4, .steps = 128}, {middle.active.view()});
    double errors = 0, largest = 0, darkest = 1;
    int count = 0;
    for (int y = middle.first; y < middle.last; ++y)
        for (int x = 150; x < 270; ++x) {
            const double d{scene.depth(x, y)};
            const nook::ViewPoint at = nook::view_point(projection, x + 0.5, y + 0.5, d);
            double to_wall = 0;
            for (int i = 0; i < 2; ++i)
                to_wall = std::max(to_wall, walls[i][0] * at.x + walls[i][1] * at.y +
                                                walls[i][2] * at.z + away[i]);
            const double u = std::min(to_wall / radius, 1.0);
            const double exact = 1 - (std::acos(u) - u * std::sqrt(1 - u * u)) / pi;
            const double error = double{open(x, y)} - exact;
            darkest = std::min(darkest, exact);
            // Within two pixels of the edge a neighbour cannot tell how steep it is.
            if (to_wall < 0.006) continue;
            errors += error;
            largest = std::max(largest, std::fabs(error));
            ++count;
        }
    CHECK(darkest < 0.6);
    CAPTURE(largest);
    CHECK(largest < 0.06);
    CAPTURE(errors / count);
    // Off the axis the disc on the screen spans less than the radius: too open, but not by much.
    CHECK(std::fabs(errors / count) < 0.015);
}

TEST_CASE("a pixel at the bottom of a narrow shaft is closed")
{
    const Projection projection{.fx = 64, .fy = 64, .cx = 0, .cy = 0, .orthographic = true};
    Scene scene{projection, 48, 16};
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 48; ++x) scene.set(x, y, x == 20 && y == 8 ? 1000 : 1, 0, 0, 1);
    const Image<float> open =
        visibility(scene, {.radius = 1e4, .slices = 8, .steps = 4, .max_pixels = 6});
    CHECK(open(20, 8) < 1e-5);
    CHECK(open(19, 8) == 1);
}

TEST_CASE("the kernel agrees with its reference, in float and in double")
{
    for (const Projection& projection : {slice_scenes::perspective(), slice_scenes::orthographic()})
        for (const double thickness : {infinity, 0.2})
            for (const double radius : {0.4, 2.0}) {
                const Scene scene = slice_scenes::varied(projection, 70, 44);
                const HorizonOptions options{.radius = radius,
                                             .slices = 4,
                                             .steps = 5,
                                             .thickness = thickness,
                                             .bias = 0.001};
                const Image<float> fast = visibility(scene, options);
                const Image<float> slow = reference(scene, options);
                CHECK(*std::min_element(fast.begin(), fast.end()) < 0.8f);
                // A sample on the radius or on the bias may fall to either side.
                CHECK(differing(fast, slow, 1e-5) <= 2);

                Image<double> distances{70, 44}, precise{70, 44}, slow_precise{70, 44};
                for (int y = 0; y < 44; ++y)
                    for (int x = 0; x < 70; ++x) distances(x, y) = double{scene.depth(x, y)};
                const Image<double>& depth = distances;
                REQUIRE(nook::horizon_ao(depth.view(), scene.source(), precise.view(), options,
                                         projection));
                REQUIRE(nook::horizon_ao_reference(depth.view(), scene.source(),
                                                   slow_precise.view(), options, projection));
                double worst = 0;
                for (int y = 0; y < 44; ++y)
                    for (int x = 0; x < 70; ++x)
                        worst = std::max(worst, std::fabs(precise(x, y) - slow_precise(x, y)));
                CHECK(worst < 1e-5);
            }
}

TEST_CASE("the kernel agrees with its reference at normals that graze or leave the view")
{
    for (const Projection& projection :
         {slice_scenes::perspective(), slice_scenes::orthographic()}) {
        Scene scene = slice_scenes::varied(projection, 70, 44);
        for (int y = 0; y < 44; ++y)
            for (int x = 0; x < 70; ++x) {
                // From towards the viewer to straight away, through all of the azimuths.
                const double azimuth = 0.37 * x + 1.3 * y, away = pi * ((x * 7 + y * 3) % 41) / 40;
                float* const n = scene.normal(x, y);
                n[0] = static_cast<float>(std::sin(away) * std::cos(azimuth));
                n[1] = static_cast<float>(std::sin(away) * std::sin(azimuth));
                n[2] = static_cast<float>(std::cos(away));
            }
        for (const double thickness : {infinity, 0.2}) {
            const HorizonOptions options{
                .radius = 1.5, .slices = 4, .steps = 5, .thickness = thickness, .bias = 0.001};
            const Image<float> fast = visibility(scene, options);
            CHECK(all_in_range(fast));
            CHECK(differing(fast, reference(scene, options), 1e-5) <= 2);
        }
    }
}

TEST_CASE("lengths times a power of two give the same bits")
{
    for (const Projection& base : {slice_scenes::perspective(), slice_scenes::orthographic()})
        for (const double thickness : {infinity, 0.3}) {
            const Scene scene = slice_scenes::varied(base, 70, 44);
            const Image<float> open = visibility(scene, {.radius = 1.3, .thickness = thickness});
            for (const double factor : {0x1p-30, 0x1p+30}) {
                Scene scaled = scene;
                for (float& distance : scaled.depth) distance *= static_cast<float>(factor);
                if (base.orthographic) {
                    scaled.projection.fx /= factor;
                    scaled.projection.fy /= factor;
                }
                CHECK(visibility(scaled, {.radius = 1.3 * factor,
                                          .thickness = thickness * factor}) == open);
            }
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
            nook::horizon_ao_scratch_size(scene.depth.view(), workers));
        REQUIRE(nook::horizon_ao(scene.depth.view(), scene.source(), result.view(), {.radius = 1},
                                 scene.projection, {}, nook::Scratch{memory.data(), memory.size()},
                                 threads));
        CHECK(result == open);
        REQUIRE(nook::horizon_ao_reference(scene.depth.view(), scene.source(), result.view(),
                                           {.radius = 1}, scene.projection, {}, threads));
        CHECK(result == reference(scene, {.radius = 1}));
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
    const nook::Outcome fast_work = nook::horizon_ao(
        scene.depth.view(), scene.source(), masked.view(), {.radius = 1}, scene.projection, map);
    const nook::Outcome slow_work = nook::horizon_ao_reference(
        scene.depth.view(), scene.source(), slow.view(), {.radius = 1}, scene.projection, map);
    REQUIRE(fast_work);
    REQUIRE(slow_work);
    int skipped = 0;
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x) {
            REQUIRE(masked(x, y) == (map.is_active(x, y) ? all(x, y) : 1.f));
            skipped += !map.is_active(x, y) && nook::is_surface(scene.depth(x, y), 1e30f);
        }
    CHECK(fast_work.work.skipped == static_cast<std::uint64_t>(skipped));
    CHECK(slow_work.work.skipped == fast_work.work.skipped);
    CHECK(slow_work.work.background == fast_work.work.background);
    CHECK(fast_work.work.pixels == 70 * 44);
    for (std::uint8_t& group : active) group = 0;
    CHECK(all_open(visibility(scene, {.radius = 1}, map)));
    for (std::uint8_t& group : active) group = 1;
    CHECK(visibility(scene, {.radius = 1}, map) == all);
}

TEST_CASE("a silhouette of 1 against a million: the near side is exactly 1, the far side too")
{
    for (const double radius : {0.5, 10.0}) {
        Scene scene{slice_scenes::perspective(), 60, 42};
        for (int y = 0; y < 42; ++y)
            for (int x = 0; x < 60; ++x) scene.set(x, y, x < 30 ? 1 : 1e6, 0, 0, 1);
        CHECK(all_open(visibility(scene, {.radius = radius})));
    }
    // Within a radius of the size of the scene the far side is occluded, and finite.
    Scene scene{slice_scenes::perspective(), 60, 42};
    for (int y = 0; y < 42; ++y)
        for (int x = 0; x < 60; ++x) scene.set(x, y, x < 30 ? 1 : 1e6, 0, 0, 1);
    const Image<float> open = visibility(scene, {.radius = 1e7});
    CHECK(all_in_range(open));
    CHECK(open(10, 20) == 1);
    CHECK(open(33, 20) < 1);
}

TEST_CASE("background is 1 and occludes nobody")
{
    for (const float none : {0.f, -3.f, std::numeric_limits<float>::quiet_NaN(),
                             std::numeric_limits<float>::infinity(), -0.f}) {
        Scene scene = slice_scenes::plane(slice_scenes::perspective(), 60, 42, 0.5, 1, 3);
        for (int y = 0; y < 42; ++y)
            for (int x = 0; x < 60; x += 1 + (y + x) % 3) scene.depth(x, y) = none;
        CHECK(all_open(visibility(scene, {.radius = 2})));
        for (float& depth : scene.depth) depth = none;
        CHECK(all_open(visibility(scene, {.radius = 2})));
    }
}

TEST_CASE("a poisoned pixel changes nothing beyond its reach")
{
    const Scene scene = slice_scenes::varied(slice_scenes::orthographic(), 70, 44);
    Scene poisoned = scene;
    poisoned.depth(60, 30) = std::numeric_limits<float>::quiet_NaN();
    const Image<float> before = visibility(scene, {.radius = 0.4});
    const Image<float> after = visibility(poisoned, {.radius = 0.4});
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x)
            if (std::abs(x - 60) > 9 || std::abs(y - 30) > 9) REQUIRE(before(x, y) == after(x, y));
}

TEST_CASE("pixels without a normal are 1; normals of any length and direction give a visibility")
{
    Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    const Image<float> before = visibility(scene, {.radius = 2});
    CHECK(before(17, 22) == 1);
    for (int i = 0; i < 3; ++i) scene.normal(40, 30)[i] = std::numeric_limits<float>::quiet_NaN();
    Image<float> open = visibility(scene, {.radius = 2});
    CHECK(open(40, 30) == 1);
    CHECK(reference(scene, {.radius = 2})(40, 30) == 1);
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x)
            for (int i = 0; i < 3; ++i) scene.normal(x, y)[i] *= x % 2 != 0 ? 1e-20f : 1e15f;
    CHECK(differing(visibility(scene, {.radius = 2}), open, 1e-4) <= 6);
    // All directions, those that face away included.
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x) {
            const double a = x * 0.7, b = y * 0.3;
            scene.normal(x, y)[0] = static_cast<float>(std::cos(a) * std::sin(b));
            scene.normal(x, y)[1] = static_cast<float>(std::sin(a) * std::sin(b));
            scene.normal(x, y)[2] = static_cast<float>(std::cos(b));
        }
    for (const double thickness : {infinity, 0.5})
        CHECK(all_in_range(visibility(scene, {.radius = 2, .thickness = thickness})));
}

TEST_CASE("radii of any size: tiny ones open everything, huge ones stay finite")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    for (const double radius : {0.0, 1e-300, 1e-40, 1e-7, 1e-3})
        CHECK(all_open(visibility(scene, {.radius = radius})));
    const Image<float> far_off = visibility(scene, {.radius = 1e7});
    for (const double radius : {1e7, 1e20, 1e38, 1e300}) {
        const Image<float> open = visibility(scene, {.radius = radius});
        CHECK(all_in_range(open));
        CHECK(all_in_range(reference(scene, {.radius = radius})));
    }
    CHECK(*std::min_element(far_off.begin(), far_off.end()) < 0.9f);
}

TEST_CASE("a radius below a pixel leaves everything open, and so do no samples and no thickness")
{
    // A pixel at distance 6 is 0.1 wide.
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    CHECK(all_open(visibility(scene, {.radius = 0.07})));
    CHECK(!all_open(visibility(scene, {.radius = 0.2})));
    CHECK(all_open(visibility(scene, {.radius = 2, .slices = 0})));
    CHECK(all_open(visibility(scene, {.radius = 2, .steps = 0})));
    CHECK(all_open(visibility(scene, {.radius = 2, .thickness = 0})));
    CHECK(all_open(reference(scene, {.radius = 2, .thickness = 0})));
}

TEST_CASE("more thickness never opens, and a large one is that of a height field")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    Image<float> before{70, 44, 1.f};
    for (const double thickness : {0.01, 0.1, 0.5, 2.0, 100.0, infinity}) {
        const Image<float> open = visibility(scene, {.radius = 1, .thickness = thickness});
        for (int y = 0; y < 44; ++y)
            for (int x = 0; x < 70; ++x) REQUIRE(open(x, y) <= before(x, y) + 1e-5f);
        before = open;
    }
    CHECK(differing(visibility(scene, {.radius = 1, .thickness = 1e4}), before, 1e-5) <= 2);
}

TEST_CASE("one thin sample hides its own extent and no more")
{
    // A post in a floor seen from above: in the slice along the row, from its far end to its top.
    const Projection projection{.fx = 1, .fy = 1, .cx = 8, .cy = 0.5, .orthographic = true};
    Scene scene{projection, 16, 1};
    for (int x = 0; x < 16; ++x) scene.set(x, 0, x == 10 ? 8 : 10, 0, 0, 1);
    const auto hidden = [](double elevation) { return nook::slice_hidden(elevation, 0.0); };
    for (const double thickness : {0.5, 1.0, 1.5, 3.0}) {
        const HorizonOptions options{.radius = 6, .slices = 64, .steps = 8, .thickness = thickness};
        const Image<float> thin = visibility(scene, options);
        const Image<float> full = visibility(scene, {.radius = 6, .slices = 64, .steps = 8});
        const double top = hidden(std::atan2(2, 1));
        const double end = thickness < 2 ? hidden(std::atan2(2 - thickness, 1)) : 0;
        // Slices hit the post or miss it: the share that is left of those that do.
        CHECK((1 - double{thin(9, 0)}) / (1 - double{full(9, 0)}) ==
              doctest::Approx((top - end) / top).epsilon(1e-4));
    }
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
    Image<float> out{70, 44, -1.f};
    const auto refused = [&](const HorizonOptions& options, const char* name) {
        const nook::Outcome fast = nook::horizon_ao(scene.depth.view(), scene.source(), out.view(),
                                                    options, scene.projection);
        const nook::Outcome slow = nook::horizon_ao_reference(
            scene.depth.view(), scene.source(), out.view(), options, scene.projection);
        CHECK(std::string{fast.error.argument} == name);
        CHECK(std::string{slow.error.argument} == name);
        CHECK(out == Image<float>{70, 44, -1.f});
    };
    refused({.radius = -1}, "options.radius");
    refused({.radius = not_a_number}, "options.radius");
    refused({.radius = infinity}, "options.radius");
    refused({.slices = -1}, "options.slices");
    refused({.slices = 65}, "options.slices");
    refused({.steps = -1}, "options.steps");
    refused({.slices = 64, .steps = 9}, "options.steps");
    refused({.slices = 1, .steps = 0x7fffffff}, "options.steps");
    refused({.thickness = -1}, "options.thickness");
    refused({.thickness = not_a_number}, "options.thickness");
    refused({.bias = -1.0}, "options.bias");
    refused({.bias = not_a_number}, "options.bias");
    refused({.max_pixels = 0}, "options.max_pixels");
    refused({.max_pixels = 5000}, "options.max_pixels");

    const auto name = [](const nook::Outcome& outcome) {
        return std::string{outcome.error.argument};
    };
    CHECK(name(nook::horizon_ao(scene.depth.view(), scene.source(), out.view(), {}, {})) ==
          "projection.fx");
    CHECK(name(nook::horizon_ao(scene.depth.view(), nook::NormalSource{}, out.view(), {},
                                scene.projection)) == "normals.x");
    Image<float> narrow{69, 44};
    CHECK(name(nook::horizon_ao(scene.depth.view(), scene.source(), narrow.view(), {},
                                scene.projection)) == "visibility");
    CHECK(name(nook::horizon_ao(scene.depth.view(), scene.source(), out.view(), {},
                                scene.projection, {}, nook::Scratch{})) == "scratch");
    CHECK(nook::horizon_ao(nook::ImageView<const float>{}, nook::NormalSource{},
                           nook::ImageView<float>{}, {}, scene.projection));
}

TEST_CASE("single pixels, rows and columns, strides and other axes of normals")
{
    for (const auto& [width, height] : {std::array{1, 1}, std::array{1, 40}, std::array{40, 1},
                                        std::array{17, 3}, std::array{16, 2}}) {
        const Scene scene = slice_scenes::relief(
            slice_scenes::perspective(), width, height,
            [](double x, double y) { return 5 + std::sin(x * 0.9) + std::cos(y); });
        CHECK(differing(visibility(scene, {.radius = 3}), reference(scene, {.radius = 3}), 1e-5) ==
              0);
    }
    const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 70, 44);
    const Image<float> open = visibility(scene, {.radius = 1});
    // Depth from the bottom up, visibility into one channel of two, and x and z of normals swapped.
    Image<float> flipped{70, 44}, pair{140, 44, -1.f};
    Scene turned = scene;
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x) {
            flipped(x, 43 - y) = scene.depth(x, y);
            std::swap(turned.normal(x, y)[0], turned.normal(x, y)[2]);
        }
    const float rotation[] = {0, 0, 1, 0, 1, 0, 1, 0, 0};
    const nook::NormalSource normals{turned.source().image, rotation};
    REQUIRE(nook::horizon_ao(nook::ImageView<const float>{&flipped(0, 43), 70, 44, -70}, normals,
                             nook::ImageView<float>{pair.data(), 70, 44, 140, 2}, {.radius = 1},
                             scene.projection));
    for (int y = 0; y < 44; ++y)
        for (int x = 0; x < 70; ++x) {
            REQUIRE(pair(2 * x, y) == doctest::Approx(open(x, y)).epsilon(1e-5));
            REQUIRE(pair(2 * x + 1, y) == -1);
        }
}
