#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <nook/surface/surface_plan.hpp>

#include "plan_checks.hpp"
#include "slice_scenes.hpp"

namespace {

using nook::Image;
using plan_checks::compared;
using plan_checks::Comparison;
using slice_scenes::Scene;

constexpr float nan_distance = std::numeric_limits<float>::quiet_NaN();
constexpr float endless = std::numeric_limits<float>::infinity();

/// The kernels, one after the other, with what their options have in common.
struct Common {
    double radius = 1;
    std::optional<double> bias{};
    int max_pixels = 256;
    std::uint32_t seed = 0;
};
/// The last two show the faintest sample that counts.
constexpr int kernel_count = 10;
/// use(options) of kernel 0 … kernel_count − 1.
template <class Use>
auto with_kernel(int kernel, const Common& common, const Use& use)
{
    nook::AlchemyOptions alchemy{.radius = common.radius, .bias = common.bias};
    nook::HorizonOptions horizon{.radius = common.radius, .bias = common.bias};
    nook::BitmaskOptions bitmask{.radius = common.radius, .bias = common.bias};
    alchemy.max_pixels = horizon.max_pixels = bitmask.max_pixels = common.max_pixels;
    alchemy.seed = horizon.seed = bitmask.seed = common.seed;
    switch (kernel) {
    case 0: return use(alchemy);
    case 1: alchemy.falloff = nook::AlchemyFalloff::scalable; return use(alchemy);
    case 2: alchemy.pattern = nook::SamplePattern::pixel; return use(alchemy);
    case 3:
        alchemy.falloff = nook::AlchemyFalloff::scalable;
        alchemy.pattern = nook::SamplePattern::pixel;
        alchemy.samples = 11;
        return use(alchemy);
    case 4: return use(horizon);
    case 5: horizon.thickness = common.radius / 4; return use(horizon);
    case 6: return use(bitmask);
    case 8:
        alchemy.samples = 64;
        alchemy.intensity = 1e12 * common.radius;
        return use(alchemy);
    case 9:
        alchemy.samples = 64;
        alchemy.intensity = 1e12 * common.radius;
        alchemy.falloff = nook::AlchemyFalloff::scalable;
        alchemy.pattern = nook::SamplePattern::pixel;
        return use(alchemy);
    default:
        bitmask.thickness = std::numeric_limits<double>::infinity();
        bitmask.slices = 2;
        bitmask.steps = 5;
        return use(bitmask);
    }
}

[[nodiscard]] Comparison compare(const Scene& scene, int kernel, const Common& common,
                                 double tolerance = 0, int turn = 0)
{
    return with_kernel(kernel, common, [&](const auto& options) {
        return compared(scene.depth.view(), scene.source(), options, scene.projection, tolerance,
                        turn);
    });
}

/// What every exact plan must keep.
void check_exact(const Comparison& result)
{
    CAPTURE(result.where);
    CHECK(result.ran);
    CHECK(result.changed == 0);
    CHECK(result.counts_agree);
}

/// Distances that lie `steps` floats nearer.
float nearer_by(float distance, int steps)
{
    for (int i = 0; i < steps; ++i) distance = std::nextafter(distance, 0.0f);
    return distance;
}

Scene facing(const nook::Projection& projection, int width, int height, double away)
{
    return slice_scenes::plane(projection, width, height, 0, 0, away);
}

}  // namespace

TEST_SUITE("surface plans")
{
    TEST_CASE("flat ground needs no work at any tilt, under either projection")
    {
        for (const bool orthographic : {false, true})
            for (const double tilt : {0.0, 0.4, 0.9, 1.3})
                for (int kernel = 0; kernel < kernel_count; ++kernel) {
                    CAPTURE(orthographic);
                    CAPTURE(tilt);
                    CAPTURE(kernel);
                    const Scene scene = slice_scenes::plane(
                        orthographic ? slice_scenes::orthographic() : slice_scenes::perspective(),
                        75, 41, tilt, tilt * 7 + 1, 9);
                    const Comparison result = compare(scene, kernel, {.radius = 0.7});
                    check_exact(result);
                    CHECK(result.background_agrees);
                    // Near the horizon a tile holds distances of all sizes.
                    if (tilt < 0.5) CHECK(result.active == 0);
                    else if (tilt < 1) CHECK(result.active_share() < 0.15);
                    CHECK(result.skipped > 500);
                    // A tolerance does not take back what is exact.
                    CHECK(compare(scene, kernel, {.radius = 0.7}, 0.01).active <= result.active);
                }
    }

    TEST_CASE("an empty view needs no work")
    {
        for (const float nothing : {0.f, -1.f, nan_distance, endless})
            for (const int kernel : {0, 4, 6}) {
                Scene scene = facing(slice_scenes::perspective(), 50, 20, 5);
                std::fill(scene.depth.begin(), scene.depth.end(), nothing);
                const Comparison result = compare(scene, kernel, {});
                check_exact(result);
                CHECK(result.active == 0);
                CHECK(result.skipped == 0);
            }
    }

    TEST_CASE("a box on the ground needs work around it, and far away none")
    {
        // 20 pixels per radius.
        const nook::Projection projection{.fx = 100, .fy = 100, .cx = 160, .cy = 80};
        Scene scene = facing(projection, 320, 160, 5);
        for (int y = 70; y < 90; ++y)
            for (int x = 150; x < 170; ++x) scene.set(x, y, 4.2, 0, 0, 1);
        for (int kernel = 0; kernel < kernel_count; ++kernel) {
            CAPTURE(kernel);
            const Comparison result = compare(scene, kernel, {.radius = 1});
            check_exact(result);
            CHECK(result.active > 0);
            int astray = 0;
            for (int y = 0; y < 160; ++y)
                for (int x = 0; x < 320; x += 16) {
                    // As far as the disc of a pixel reaches, and twice that for the planner's tiles.
                    const bool beside = x + 15 >= 150 - 60 && x < 170 + 60 && y >= 10 && y < 150;
                    astray += !beside && result.map(x / 16, y) != 0;
                }
            CHECK(astray == 0);
            // All that the box darkens is active.
            CHECK(result.map(140 / 16, 80) != 0);
        }
    }

    TEST_CASE("beside a wall there is work, away from it there is none")
    {
        const nook::Projection projection{.fx = 100, .fy = 100, .cx = 80, .cy = 60};
        // Where the wall stands.
        struct Side {
            bool across;
            int first, last;
        };
        for (const Side& side :
             {Side{true, 96, 160}, Side{true, 0, 64}, Side{false, 0, 40}, Side{false, 80, 120}}) {
            CAPTURE(side.across);
            CAPTURE(side.first);
            Scene scene = facing(projection, 160, 120, 5);
            for (int y = 0; y < 120; ++y)
                for (int x = 0; x < 160; ++x) {
                    const int at = side.across ? x : y;
                    if (at >= side.first && at < side.last) scene.set(x, y, 4.2, 0, 0, 1);
                }
            for (const int kernel : {0, 4, 6}) {
                CAPTURE(kernel);
                const Comparison result = compare(scene, kernel, {.radius = 1});
                check_exact(result);
                CHECK(result.active > 0);
                int found = 0, astray = 0;
                for (int y = 0; y < 120; ++y)
                    for (int x = 0; x < 160; x += 16) {
                        const int from = side.across ? x : y, to = side.across ? x + 15 : y;
                        if (to >= side.first && from < side.last) continue;
                        found += result.map(x / 16, y) != 0;
                        // As far as the disc of a pixel reaches, and twice that for tiles.
                        const bool beside = to >= side.first - 48 && from < side.last + 48;
                        astray += !beside && result.map(x / 16, y) != 0;
                    }
                CHECK(found > 0);
                CHECK(astray == 0);
            }
        }
    }

    TEST_CASE("a map is exact without a tolerance")
    {
        const Image<std::uint8_t> groups{3, 2};
        CHECK(nook::surface_work_map(groups.view()).exact);
        CHECK(nook::surface_work_map(groups.view()).active.data == groups.data());
        CHECK(!nook::surface_work_map(groups.view(), 0.01).exact);
    }

    TEST_CASE("a pixel that is lifted by any number of steps leaves no trace beside the plan")
    {
        // 16.5 pixels per radius, so that the ends of the disc fall on, before and behind a pixel.
        const nook::Projection projection{.fx = 82.5, .fy = 82.5, .cx = 40, .cy = 24};
        constexpr int width = 96, height = 48;
        std::mt19937 random{11};
        int found = 0;
        for (const double tilt : {0.0, 0.8})
            for (const int steps :
                 {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 32, 40, 48, 64}) {
                Scene scene = slice_scenes::plane(projection, width, height, tilt, 0.6, 5);
                for (int trial = 0; trial < 12; ++trial) {
                    // At the corners of tiles, whatever their size, and anywhere.
                    const int x =
                        trial < 6 ? 32 + (trial % 3 - 1) : static_cast<int>(random() % 96u);
                    const int y =
                        trial < 6 ? 16 + (trial / 3) * 7 : static_cast<int>(random() % 48u);
                    const int kernel =
                        trial % 2 == 0 ? 8 + trial / 2 % 2 : static_cast<int>(random() % 8u);
                    const float before = scene.depth(x, y);
                    scene.depth(x, y) = nearer_by(before, steps);
                    CAPTURE(tilt);
                    CAPTURE(steps);
                    CAPTURE(x);
                    CAPTURE(y);
                    CAPTURE(kernel);
                    const Comparison result = compare(scene, kernel, {.radius = 1}, 0, trial);
                    check_exact(result);
                    found += result.active > 0;
                    scene.depth(x, y) = before;
                }
            }
        // Some of them rise above the bias, and some do not.
        CHECK(found > 20);
        CHECK(found < 2 * 18 * 12);
    }

    TEST_CASE("with a bias of one's own a pixel counts from the step on that rises above it")
    {
        const nook::Projection projection{.fx = 80, .fy = 80, .cx = 40, .cy = 24};
        Scene scene = facing(projection, 96, 48, 5);
        // That high above the ground.
        for (const double bias : {0x1p-18, 0x1p-12})
            for (const int kernel : {0, 4, 6, 8, 9}) {
                const auto on_it = static_cast<float>(5 * (1 - bias));
                for (const double share : {0.9, 0.99, 1.01, 1.04, 1.1}) {
                    scene.depth(47, 24) = static_cast<float>(5 * (1 - share * bias));
                    CAPTURE(kernel);
                    CAPTURE(bias);
                    CAPTURE(share);
                    check_exact(compare(scene, kernel, {.radius = 1, .bias = bias}));
                }
                for (int steps = 0; steps < 4; ++steps) {
                    scene.depth(47, 24) = nearer_by(on_it, steps);
                    CAPTURE(kernel);
                    CAPTURE(bias);
                    CAPTURE(steps);
                    check_exact(compare(scene, kernel, {.radius = 1, .bias = bias}));
                    // Without any bias flat ground shows its rounding, which must stay too.
                    check_exact(compare(scene, kernel, {.radius = 1, .bias = 0.0}));
                }
            }
    }

    TEST_CASE("a pixel at the very end of the disc is found")
    {
        constexpr int width = 144, height = 96;
        for (const double reach : {20.0, 20.49, 20.5, 20.51, 31.5}) {
            const nook::Projection projection{.fx = reach * 5, .fy = reach * 5, .cx = 80, .cy = 48};
            for (const int off : {-2, -1, 0, 1, 2})
                for (const bool down : {false, true}) {
                    Scene scene = facing(projection, width, height, 5);
                    // From the corner of a group of 16 × 1, and of a tile of 16 × 8 or × 16.
                    const int ends = static_cast<int>(reach) + off;
                    scene.depth(down ? 64 : 63 + ends, down ? 47 + ends : 48) = 4.0f;
                    for (const int kernel : {down ? 0 : 2, down ? 5 : 7, 8, 9}) {
                        CAPTURE(reach);
                        CAPTURE(off);
                        CAPTURE(down);
                        CAPTURE(kernel);
                        check_exact(compare(scene, kernel, {.radius = 1}));
                    }
                }
        }
    }

    TEST_CASE("the tip of a triangle in front of the ground is found")
    {
        const nook::Projection projection{.fx = 90, .fy = 90, .cx = 64, .cy = 40};
        std::mt19937 random{5};
        for (int trial = 0; trial < 60; ++trial) {
            Scene scene = slice_scenes::plane(projection, 128, 80, 0.6, 1.5, 6);
            // A needle of one to nine pixels, which comes out of the ground along a row or a column.
            const int x = static_cast<int>(random() % 120u), y = static_cast<int>(random() % 72u);
            const int length = 1 + static_cast<int>(random() % 9u);
            for (int i = 0; i < length; ++i) {
                const int to_x = trial % 2 == 0 ? (std::min)(x + i, 127) : x;
                const int to_y = trial % 2 == 0 ? y : (std::min)(y + i, 79);
                scene.depth(to_x, to_y) =
                    nearer_by(scene.depth(to_x, to_y), 1 + i * i * (trial % 7));
            }
            for (const int kernel : {trial % 8, 8 + trial % 2}) {
                CAPTURE(trial);
                CAPTURE(kernel);
                check_exact(compare(scene, kernel, {.radius = 0.3 + trial * 0.02}, 0, trial));
            }
        }
    }

    TEST_CASE("bowls need work, and neither bowls nor domes change a bit")
    {
        const nook::Projection projection{.fx = 150, .fy = 150, .cx = 96, .cy = 64};
        for (const double bend : {-0.4, -0.02, -1e-4, -1e-6, 1e-6, 1e-4, 0.02, 0.4}) {
            // Farther in the middle: a bowl.
            const Scene scene = slice_scenes::relief(projection, 192, 128, [&](double x, double y) {
                const double dx = (x - 96) / 96, dy = (y - 64) / 96;
                return 5 * (1 - bend * (dx * dx + dy * dy));
            });
            for (int kernel = 0; kernel < kernel_count; ++kernel) {
                CAPTURE(bend);
                CAPTURE(kernel);
                const Comparison result = compare(scene, kernel, {.radius = 0.6});
                check_exact(result);
                if (bend >= 0.02) CHECK(result.active_share() > 0.99);
            }
        }
    }

    TEST_CASE("normals that lean on flat ground are taken as they are")
    {
        const nook::Projection projection{.fx = 90, .fy = 90, .cx = 64, .cy = 40};
        for (const double lean : {1e-7, 1e-6, 1e-5, 1e-3, 0.1, 1.0})
            for (int kernel = 0; kernel < kernel_count; ++kernel) {
                Scene scene = slice_scenes::plane(projection, 128, 80, 0.5, 2, 6);
                for (int y = 0; y < 80; ++y)
                    for (int x = 0; x < 128; ++x) {
                        // The left third stays; the right one turns all ways.
                        if (x < 43) continue;
                        float* const n = scene.normal(x, y);
                        n[0] += static_cast<float>(lean * std::sin(x * 0.3));
                        n[1] += static_cast<float>(lean * std::cos(y * 0.7 + (x > 86 ? x : 0)));
                    }
                CAPTURE(lean);
                CAPTURE(kernel);
                check_exact(compare(scene, kernel, {.radius = 0.7}));
            }
    }

    TEST_CASE("stairs of single steps of the depth buffer keep their bits")
    {
        for (const bool orthographic : {false, true})
            for (const int tread : {1, 3, 16, 40})
                for (const int rise : {1, 2, 5, 17}) {
                    const nook::Projection projection =
                        orthographic ? slice_scenes::orthographic() : slice_scenes::perspective();
                    Scene scene = facing(projection, 100, 40, 7);
                    for (int y = 0; y < 40; ++y)
                        for (int x = 0; x < 100; ++x)
                            scene.depth(x, y) = nearer_by(7, (x / tread) % 9 * rise);
                    for (const int kernel : {(tread + rise) % 8, 8, 9}) {
                        CAPTURE(orthographic);
                        CAPTURE(tread);
                        CAPTURE(rise);
                        CAPTURE(kernel);
                        check_exact(compare(scene, kernel, {.radius = 1.2}, 0, tread));
                    }
                }
    }

    TEST_CASE("whatever the buffers hold, an exact plan changes no bit")
    {
        std::mt19937 random{3};
        const auto chance = [&](unsigned one_in) { return random() % one_in == 0; };
        const auto unit = [&] { return double(random()) / 4294967296.0; };
        constexpr int sizes[][2] = {{64, 32}, {83, 41}, {17, 9},  {1, 1},
                                    {1, 50},  {50, 1},  {129, 20}};
        constexpr int reaches[] = {1, 2, 5, 37, 256, 4096};
        std::uint64_t skipped = 0;
        for (int trial = 0; trial < 700; ++trial) {
            const auto& size = sizes[static_cast<std::size_t>(trial) % std::size(sizes)];
            const int width = size[0], height = size[1];
            nook::Projection projection{.fx = 10 + 100 * unit(), .fy = 10 + 100 * unit()};
            projection.cx = width * (2 * unit() - 0.5);
            projection.cy = height * (2 * unit() - 0.5);
            projection.orthographic = chance(3);
            Scene scene = slice_scenes::plane(projection, width, height, 1.3 * unit(), 7 * unit(),
                                              projection.orthographic ? 30 : 6);
            // Spikes, dust of background, poles one pixel wide, blocks, noise, broken normals.
            const unsigned spikes = 20u << (random() % 8u), dust = 20u << (random() % 8u);
            const bool noise = chance(4), wild = chance(4), blocks = chance(2), poles = chance(3);
            const double grain = std::pow(10, -7 * unit());
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    float& depth = scene.depth(x, y);
                    if (blocks && (x / 11 * 7 + y / 9 * 3) % 13 == 0)
                        depth *= static_cast<float>(1 - grain);
                    if (noise) depth *= static_cast<float>(1 + grain * (unit() - 0.5));
                    if (poles && x % 31 == 17) depth *= 0.9f;
                    if (chance(spikes)) depth *= static_cast<float>(std::pow(2, 6 * unit() - 3));
                    if (chance(dust)) {
                        constexpr float nothing[] = {0,        -3,     nan_distance, endless,
                                                     -endless, 1e-40f, 3e38f};
                        depth = nothing[random() % std::size(nothing)];
                    }
                    float* const n = scene.normal(x, y);
                    if (wild)
                        for (int i = 0; i < 3; ++i) n[i] = static_cast<float>(2 * unit() - 1);
                    if (chance(dust))
                        for (int i = 0; i < 3; ++i) n[i] = chance(2) ? 0 : nan_distance;
                }
            Common common{.radius = std::pow(10, 3 * unit() - 2),
                          .max_pixels = reaches[random() % std::size(reaches)],
                          .seed = static_cast<std::uint32_t>(random())};
            if (chance(8)) common.radius *= chance(2) ? 1e-6 : 1e9;
            if (chance(3)) common.bias = chance(2) ? 0 : 1e-2 * unit();
            const int kernel = static_cast<int>(random() % kernel_count);
            CAPTURE(trial);
            CAPTURE(width);
            CAPTURE(height);
            CAPTURE(kernel);
            CAPTURE(common.radius);
            CAPTURE(common.max_pixels);
            CAPTURE(projection.orthographic);
            const Comparison exact = compare(scene, kernel, common, 0, trial);
            check_exact(exact);
            skipped += exact.skipped;
            if (trial % 4 != 0) continue;
            // Tolerances hold here, too.
            const double tolerance = std::pow(10, -4 * unit());
            const Comparison tolerant = compare(scene, kernel, common, tolerance, trial);
            CAPTURE(tolerance);
            CAPTURE(tolerant.where);
            CHECK(tolerant.ran);
            CHECK(tolerant.counts_agree);
            CHECK(tolerant.rise <= tolerance + 1e-6);
            CHECK(tolerant.fall <= 1e-6);
        }
        // A planner that leaves out nothing would pass all of the above.
        CHECK(skipped > 1000);
    }

    TEST_CASE("planes at any tilt, behind pixels of any shape, keep bits and tolerances")
    {
        std::mt19937 random{11};
        const auto unit = [&] { return std::uniform_real_distribution<double>{0, 1}(random); };
        const auto between = [&](double low, double high) { return low + (high - low) * unit(); };
        std::uint64_t skipped = 0;
        for (int trial = 0; trial < 160; ++trial) {
            const int width = 20 + static_cast<int>(random() % 100);
            const int height = 20 + static_cast<int>(random() % 100);
            nook::Projection projection{};
            projection.orthographic = trial % 4 == 0;
            projection.fx = std::exp(between(3, 6));
            projection.fy = projection.fx * std::exp(between(-0.7, 0.7));
            // Samples of the longer axis then lie within a pixel of the other.
            if (trial % 5 == 0) projection.fx /= between(20, 250);
            projection.cx = width * between(-0.3, 1.3);
            projection.cy = height * between(-0.3, 1.3);
            const double tilt = between(0, 1.56), turn = between(0, 6.28);
            const double nx = std::sin(tilt) * std::cos(turn), ny = std::sin(tilt) * std::sin(turn),
                         nz = std::cos(tilt);
            const double noise = trial % 3 == 0 ? 0 : std::exp(between(-18, -6));
            nook::Image<float> depth{width, height};
            std::vector<float> normals(static_cast<std::size_t>(3 * width * height));
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const nook::ViewPoint ray = nook::view_point(projection, x + 0.5, y + 0.5, 1);
                    const double along = nx * ray.x + ny * ray.y;
                    const double distance = projection.orthographic
                                                ? 10 + along / (std::max)(nz, 1e-3)
                                                : 1 / (nz - along);
                    const double off = random() % 40 == 0 ? 1 + noise * between(-1, 1) : 1;
                    const bool seen = distance > 0 && distance < 1e6;
                    depth(x, y) = seen ? static_cast<float>(distance * off) : 0.0f;
                    float* const n = &normals[static_cast<std::size_t>(3 * (y * width + x))];
                    n[0] = static_cast<float>(nx);
                    n[1] = static_cast<float>(ny);
                    n[2] = static_cast<float>(nz);
                    // The same normal but for rounding.
                    if (trial % 2 == 0)
                        n[random() % 3] += static_cast<float>(int(random() % 3) - 1) * 0x1p-24f;
                }
            const auto view = nook::ImageView3<const float>::interleaved(
                normals.data(), width, height, std::ptrdiff_t{3} * width);
            const Common common{.radius = std::exp(between(-4, 1)),
                                .max_pixels = trial % 3 == 0 ? 16 : 256,
                                .seed = static_cast<std::uint32_t>(random())};
            const int kernel = static_cast<int>(random() % 8);
            for (const double tolerance : {0.0, std::exp(between(-8, -1))}) {
                const Comparison result = with_kernel(kernel, common, [&](const auto& options) {
                    return compared(depth.view(), nook::NormalSource{view}, options, projection,
                                    tolerance, trial);
                });
                CAPTURE(trial);
                CAPTURE(kernel);
                CAPTURE(tolerance);
                CAPTURE(result.where);
                CHECK(result.ran);
                CHECK(result.rise <= tolerance * (1 + 1e-5) + (tolerance > 0 ? 2e-6 : 0));
                CHECK(result.fall == 0);
                if (tolerance == 0) CHECK(result.changed == 0);
                skipped += result.skipped;
            }
        }
        CHECK(skipped > 100000);
    }

    TEST_CASE("distances of double keep their bits")
    {
        const nook::Projection projection{.fx = 82.5, .fy = 82.5, .cx = 40, .cy = 24};
        const Scene scene = slice_scenes::varied(projection, 96, 48);
        const Scene ground = slice_scenes::plane(projection, 96, 48, 0.7, 2, 6);
        for (const Scene* const one : {&scene, &ground}) {
            Image<double> depth{96, 48};
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 96; ++x) depth(x, y) = double{one->depth(x, y)};
            depth(40, 20) = std::nextafter(depth(40, 20), 0.0);
            for (const int kernel : {0, 1, 4, 6})
                with_kernel(kernel, {.radius = 0.5}, [&](const auto& options) {
                    CAPTURE(kernel);
                    check_exact(
                        compared(depth.view(), one->source(), options, projection, 0, kernel));
                });
        }
    }

    TEST_CASE("a tolerance lets visibility rise by no more, and leaves out more")
    {
        const Scene scene =
            slice_scenes::varied({.fx = 120, .fy = 120, .cx = 96, .cy = 64}, 192, 128);
        for (int kernel = 0; kernel < kernel_count; ++kernel) {
            CAPTURE(kernel);
            int before = std::numeric_limits<int>::max();
            for (const double tolerance : {0.0, 1e-4, 1e-3, 1e-2, 0.05, 0.3, 1.0}) {
                CAPTURE(tolerance);
                const Comparison result =
                    compare(scene, kernel, {.radius = 0.7}, tolerance, kernel);
                CAPTURE(result.where);
                CHECK(result.ran);
                CHECK(result.rise <= tolerance);
                CHECK(result.fall == 0);
                CHECK(result.active <= before);
                before = result.active;
            }
            CHECK(before < static_cast<int>(12 * 128));
        }
    }

    TEST_CASE("options that leave everything open need no work")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 75, 41);
        const auto nothing = [&](const auto& options) {
            const Comparison result =
                compared(scene.depth.view(), scene.source(), options, scene.projection);
            CHECK(result.ran);
            CHECK(result.changed == 0);
            CHECK(result.active == 0);
        };
        nothing(nook::AlchemyOptions{.radius = 0});
        nothing(nook::AlchemyOptions{.samples = 0});
        nothing(nook::AlchemyOptions{.contrast = 0});
        nothing(nook::HorizonOptions{.radius = 0});
        nothing(nook::HorizonOptions{.slices = 0});
        nothing(nook::HorizonOptions{.steps = 0});
        nothing(nook::BitmaskOptions{.slices = 0});
    }

    TEST_CASE("other options of obscurance keep their bits")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 96, 48);
        for (const nook::AlchemyOptions& options :
             {nook::AlchemyOptions{.radius = 1e-3}, nook::AlchemyOptions{.radius = 300},
              nook::AlchemyOptions{.samples = 64}, nook::AlchemyOptions{.samples = 1},
              nook::AlchemyOptions{.intensity = 0}, nook::AlchemyOptions{.intensity = 1e30},
              nook::AlchemyOptions{.contrast = 0.5}, nook::AlchemyOptions{.contrast = 1e-3},
              nook::AlchemyOptions{.contrast = 7}, nook::AlchemyOptions{.epsilon = 0},
              nook::AlchemyOptions{.epsilon = 1e9}, nook::AlchemyOptions{.turns = 0}}) {
            CAPTURE(options.radius);
            CAPTURE(options.samples);
            CAPTURE(options.contrast);
            for (const double tolerance : {0.0, 0.02}) {
                const Comparison result = compared(scene.depth.view(), scene.source(), options,
                                                   scene.projection, tolerance);
                if (tolerance == 0) check_exact(result);
                CHECK(result.ran);
                CHECK(result.rise <= tolerance);
                CHECK(result.fall == 0);
            }
        }
    }

    TEST_CASE("any number of threads plans the same")
    {
        const Scene scene =
            slice_scenes::varied({.fx = 120, .fy = 120, .cx = 96, .cy = 64}, 191, 127);
        const nook::AlchemyOptions options{.radius = 0.7};
        plan_checks::Executors& executors = plan_checks::Executors::all();
        Image<std::uint8_t> one{12, 127}, more{12, 127, 9};
        const auto plan = [&](Image<std::uint8_t>& out, nook::ThreadExecutor& threads) {
            return nook::plan_surface(scene.depth.view(), scene.source(), out.view(), options,
                                      scene.projection, 0, nook::HeapScratch{}, threads);
        };
        const nook::Outcome serial = plan(one, executors.one);
        REQUIRE(serial);
        for (nook::ThreadExecutor* const threads : {&executors.two, &executors.five}) {
            const nook::Outcome outcome = plan(more, *threads);
            REQUIRE(outcome);
            CHECK(more == one);
            CHECK(outcome.work.skipped == serial.work.skipped);
            CHECK(outcome.work.background == serial.work.background);
        }
    }

    TEST_CASE("maps may stand upside down and apart")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 75, 41);
        const nook::HorizonOptions options{.radius = 0.7};
        Image<std::uint8_t> tight{5, 41};
        std::vector<std::uint8_t> wide(41 * 13, 77);
        const nook::ImageView<std::uint8_t> view{wide.data() + 40 * 13, 5, 41, -13, 2};
        REQUIRE(nook::plan_surface(scene.depth.view(), scene.source(), tight.view(), options,
                                   scene.projection));
        REQUIRE(nook::plan_surface(scene.depth.view(), scene.source(), view, options,
                                   scene.projection));
        for (int y = 0; y < 41; ++y) {
            for (int x = 0; x < 5; ++x) CHECK(view(x, y) == tight(x, y));
            for (const int between : {1, 3, 5, 7, 9, 10, 11, 12})
                CHECK(wide[static_cast<std::size_t>(y * 13 + between)] == 77);
        }
    }

    TEST_CASE("as much scratch as asked for is enough, a byte less is an error")
    {
        const Scene scene = slice_scenes::varied(slice_scenes::perspective(), 75, 41);
        Image<std::uint8_t> map{5, 41, 77};
        for (const int workers : {1, 2}) {
            const std::size_t size = nook::plan_surface_scratch_size(scene.depth.view(), workers);
            std::vector<std::byte> memory(size + 1);
            nook::ThreadExecutor& threads = workers == 1 ? plan_checks::Executors::all().one
                                                         : plan_checks::Executors::all().two;
            const auto plan = [&](std::size_t bytes) {
                return nook::plan_surface(scene.depth.view(), scene.source(), map.view(),
                                          nook::AlchemyOptions{}, scene.projection, 0,
                                          nook::Scratch{memory.data() + 1, bytes}, threads);
            };
            if (size > 0) {
                map = Image<std::uint8_t>{5, 41, 77};
                const nook::Outcome outcome = plan(size - 1);
                CHECK(outcome.error.code == nook::ErrorCode::scratch_too_small);
                CHECK(std::string{outcome.error.argument} == "scratch");
                CHECK(map == Image<std::uint8_t>{5, 41, 77});
            }
            CHECK(plan(size));
        }
    }

    TEST_CASE("images of any size, and of none")
    {
        constexpr int sizes[][2] = {{1, 1}, {1, 50}, {50, 1}, {17, 9}, {16, 8}, {15, 7}, {33, 3}};
        for (const auto& size : sizes)
            for (const int kernel : {0, 4, 6}) {
                CAPTURE(size[0]);
                CAPTURE(size[1]);
                Scene scene = facing(slice_scenes::perspective(), size[0], size[1], 5);
                for (int y = 0; y < size[1]; ++y)
                    for (int x = 0; x < size[0]; ++x)
                        if ((x + 3 * y) % 7 == 4) scene.depth(x, y) = x % 2 == 0 ? 4.5f : 0;
                check_exact(compare(scene, kernel, {.radius = 2}));
            }
        const nook::ImageView<const float> none{};
        const nook::Outcome outcome =
            nook::plan_surface(none, nook::NormalSource{}, nook::ImageView<std::uint8_t>{},
                               nook::AlchemyOptions{}, slice_scenes::perspective());
        CHECK(outcome);
        CHECK(outcome.work.pixels == 0);
        CHECK(nook::plan_surface_scratch_size(none) == 0);
    }

    TEST_CASE("bad arguments are named, and nothing is written")
    {
        Scene scene = slice_scenes::varied(slice_scenes::perspective(), 75, 41);
        const Image<std::uint8_t> untouched{6, 42, 77};
        Image<std::uint8_t> map = untouched;
        const nook::ImageView<std::uint8_t> fits{map.data(), 5, 41, 6};
        const nook::NormalSource normals = scene.source();
        const auto refused = [&](const nook::Outcome& outcome, nook::ErrorCode code,
                                 const char* argument) {
            CAPTURE(argument);
            CHECK(outcome.error.code == code);
            CHECK(std::string{outcome.error.argument} == argument);
            CHECK(map == untouched);
        };
        const auto plan = [&](const nook::ImageView<std::uint8_t>& active, const auto& options,
                              double tolerance = 0) {
            return nook::plan_surface(scene.depth.view(), normals, active, options,
                                      scene.projection, tolerance);
        };
        using nook::ErrorCode;
        const nook::AlchemyOptions alchemy{};
        refused(plan({map.data(), 4, 41, 6}, alchemy), ErrorCode::bad_size, "active");
        refused(plan({map.data(), 6, 41, 6}, alchemy), ErrorCode::bad_size, "active");
        refused(plan({map.data(), 5, 40, 6}, alchemy), ErrorCode::bad_size, "active");
        refused(plan({map.data(), 5, 42, 6}, alchemy), ErrorCode::bad_size, "active");
        refused(plan({nullptr, 5, 41, 6}, alchemy), ErrorCode::null_data, "active");
        refused(plan({map.data(), 5, 41, 3}, alchemy), ErrorCode::bad_stride, "active");
        refused(plan({}, alchemy), ErrorCode::bad_size, "active");
        refused(plan({reinterpret_cast<std::uint8_t*>(scene.depth.data()), 5, 41, 5}, alchemy),
                ErrorCode::overlap, "active");
        refused(plan({reinterpret_cast<std::uint8_t*>(scene.normals.data()), 5, 41, 5}, alchemy),
                ErrorCode::overlap, "active");
        const double nan = std::numeric_limits<double>::quiet_NaN();
        for (const double tolerance : {-1e-9, nan, std::numeric_limits<double>::infinity()}) {
            refused(plan(fits, alchemy, tolerance), ErrorCode::bad_value, "tolerance");
            refused(plan(fits, nook::HorizonOptions{}, tolerance), ErrorCode::bad_value,
                    "tolerance");
        }
        refused(plan(fits, nook::AlchemyOptions{.radius = -1}), ErrorCode::bad_value,
                "options.radius");
        refused(plan(fits, nook::AlchemyOptions{.radius = nan}), ErrorCode::bad_value,
                "options.radius");
        refused(plan(fits, nook::AlchemyOptions{.samples = 65}), ErrorCode::bad_value,
                "options.samples");
        refused(plan(fits, nook::AlchemyOptions{.max_pixels = 0}), ErrorCode::bad_value,
                "options.max_pixels");
        refused(plan(fits, nook::HorizonOptions{.slices = 65}), ErrorCode::bad_value,
                "options.slices");
        refused(plan(fits, nook::HorizonOptions{.bias = nan}), ErrorCode::bad_value,
                "options.bias");
        refused(plan(fits, nook::BitmaskOptions{.thickness = -1}), ErrorCode::bad_value,
                "options.thickness");
        scene.projection.fx = 0;
        refused(plan(fits, alchemy), ErrorCode::bad_value, "projection.fx");
        scene.projection = slice_scenes::perspective();
        const nook::ImageView<const float> missing{nullptr, 75, 41};
        refused(nook::plan_surface(missing, normals, fits, alchemy, scene.projection),
                ErrorCode::null_data, "depth");
        const nook::ImageView<const float> short_one{scene.depth.data(), 75, 40};
        refused(nook::plan_surface(short_one, normals, fits, alchemy, scene.projection),
                ErrorCode::bad_size, "normals.x");
    }
}
