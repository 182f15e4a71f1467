#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <nook/depth/hardware_depth.hpp>
#include <nook/image.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/surface/height_field_ao.hpp>
#include <nook/surface/slice.hpp>
#include <nook/thread_executor.hpp>

namespace {

using nook::HeightFieldOptions;
using nook::Image;
using nook::ImageView;
using nook::ImageView3;
using nook::Outcome;
using nook::Projection;
using nook::WorkMap;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A picture from which the kernel starts.
struct Scene {
    int width, height;
    Projection projection;
    Image<double> depth;
    Image<float> normals;

    Scene(int w, int h, const Projection& p)
        : width{w},
          height{h},
          projection{p},
          depth{w, h},
          normals{3 * w, h}
    {
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) normal(x, y, 0, 0, 1);
    }
    void normal(int x, int y, double nx, double ny, double nz)
    {
        normals(3 * x, y) = static_cast<float>(nx);
        normals(3 * x + 1, y) = static_cast<float>(ny);
        normals(3 * x + 2, y) = static_cast<float>(nz);
    }
    [[nodiscard]] ImageView3<const float> normal_view() const
    {
        return ImageView3<const float>::interleaved(normals.data(), width, height, 3 * width);
    }
};

/// Seen along −z from the distance 100, `pixels` per world unit; height(x, y) of the world with its
/// origin in the middle of the picture, `background` where it is below −50.
template <class Height>
Scene from_above(int width, int height, double pixels, const Height& of)
{
    Scene scene{
        width,
        height,
        {.fx = pixels, .fy = pixels, .cx = width / 2.0, .cy = height / 2.0, .orthographic = true}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double z =
                of((x + 0.5 - width / 2.0) / pixels, (height / 2.0 - y - 0.5) / pixels);
            scene.depth(x, y) = z < -50 ? 0 : 100 - z;
        }
    return scene;
}

/// Computes one pixel, by way of the work map.
double pixel(const Scene& scene, int x, int y, const HeightFieldOptions& options)
{
    Image<std::uint8_t> active{WorkMap::groups(scene.width), scene.height, 0};
    active(x / 16, y) = 1;
    // Normals elsewhere in the group cost time only.
    Image<float> normals{3 * scene.width, scene.height};
    for (int k = 0; k < 3; ++k) normals(3 * x + k, y) = scene.normals(3 * x + k, y);
    Image<double> visibility{scene.width, scene.height};
    const Outcome done =
        nook::height_field_ao(scene.depth.view(),
                              ImageView3<const float>::interleaved(normals.data(), scene.width,
                                                                   scene.height, 3 * scene.width),
                              visibility.view(), options, scene.projection, {active});
    REQUIRE(done);
    return visibility(x, y);
}

[[maybe_unused]] Outcome run(const Scene& scene, Image<double>& visibility,
                             const HeightFieldOptions& options, const WorkMap& map = {})
{
    visibility = Image<double>{scene.width, scene.height, -1};
    return nook::height_field_ao(scene.depth.view(), scene.normal_view(), visibility.view(),
                                 options, scene.projection, map);
}

double segment(double c) { return c < 1 ? std::acos(c) - c * std::sqrt(1 - c * c) : 0; }

/// What a wall of height h at distance a hides within the radius.
double wall(double a, double h, double radius)
{
    const double e = a / std::sqrt(a * a + h * h);
    if (!(radius < infinity)) return (1 - e) / 2;
    const double c = a / radius;
    return (segment(c) - e * segment(c / e)) / std::numbers::pi;
}

}  // namespace

TEST_CASE("height_field_ao: a slice weighs its directions as GTAO does")
{
    // Components of the normal in the slice instead of its angle.
    for (const double gamma : {-1.3, -0.4, 0.0, 0.7, 1.5})
        for (const double t : {0.1, 0.8, 1.4}) {
            const nook::detail::SliceArc arc{std::cos(gamma), std::sin(gamma)};
            const double edge = gamma + std::numbers::pi / 2;
            if (t > edge) continue;
            const double hidden = arc.of({arc.low(), 1 / std::tan(t)});
            const double expected =
                nook::detail::slice_integral(edge, gamma) - nook::detail::slice_integral(t, gamma);
            CHECK(hidden == doctest::Approx(expected).epsilon(1e-9));
            const nook::detail::SliceArc other{std::cos(gamma), -std::sin(gamma)};
            CHECK(arc.full() + other.full() ==
                  doctest::Approx(nook::slice_open(gamma)).epsilon(1e-12));
        }
}

TEST_CASE("height_field_ao: a union of intervals is what a sorted sweep gives")
{
    std::mt19937 random{7};
    std::uniform_real_distribution<double> unit{0, 1};
    for (int trial = 0; trial < 300; ++trial) {
        nook::detail::SlopeInterval memory[40];
        nook::detail::SlopeUnion found{memory};
        std::vector<std::array<double, 2>> all;
        const int count = trial % 30;
        for (int i = 0; i < count; ++i) {
            const double low = unit(random), high = low + 0.1 * unit(random) * unit(random);
            found.add(low, high);
            all.push_back({low, high});
        }
        std::sort(all.begin(), all.end());
        std::vector<std::array<double, 2>> merged;
        for (const auto& [low, high] : all) {
            if (!merged.empty() && low <= merged.back()[1])
                merged.back()[1] = std::max(merged.back()[1], high);
            else merged.push_back({low, high});
        }
        REQUIRE(found.end() - found.begin() == static_cast<std::ptrdiff_t>(merged.size()));
        for (const auto& interval : found) {
            CHECK(interval.low == merged.back()[0]);
            CHECK(interval.high == merged.back()[1]);
            merged.pop_back();
        }
    }
}

TEST_CASE("height_field_ao: planes of every tilt are exactly open, in every encoding")
{
    std::mt19937 random{1};
    std::normal_distribution<double> gauss;
    const int width = 28, height = 18;
    for (int trial = 0; trial < 44; ++trial) {
        const bool orthographic = trial % 2 != 0;
        Projection projection{.fx = 35,
                              .fy = 28,
                              .cx = 15,
                              .cy = 7,
                              .orthographic = orthographic,
                              .near_plane = 0.5,
                              .far_plane = 4000};
        // From square to the view to 89.9 degrees.
        const double tilt = trial < 36 ? trial / 36.0 * 1.56 : 1.569;
        const double turn = gauss(random);
        const double nx = std::sin(tilt) * std::cos(turn), ny = std::sin(tilt) * std::sin(turn);
        const double nz = std::cos(tilt);
        Scene scene{width, height, projection};
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                scene.normal(x, y, nx, ny, nz);
                const double sx = (x + 0.5 - projection.cx) / projection.fx;
                const double sy = (projection.cy - y - 0.5) / projection.fy;
                // Two units from the viewer at the nearest.
                const double across = nx * sx + ny * sy;
                scene.depth(x, y) = orthographic          ? 2000 + across / nz
                                    : across < nz - 0.002 ? 2 / (nz - across)
                                                          : 0;
                if (scene.depth(x, y) < projection.near_plane) scene.depth(x, y) = 0;
            }
        for (const double radius : {2.0, infinity})
            for (const double thickness : {infinity, 0.5}) {
                const HeightFieldOptions options{
                    .radius = radius, .slices = 5, .thickness = thickness};
                Image<double> visibility{width, height};
                const auto all_open = [&](const auto& source, const std::string& what) {
                    CAPTURE(trial);
                    CAPTURE(what);
                    CAPTURE(radius);
                    REQUIRE(nook::height_field_ao(source, scene.normal_view(), visibility.view(),
                                                  options, projection));
                    CHECK(std::all_of(visibility.begin(), visibility.end(),
                                      [](double v) { return v == 1; }));
                };
                all_open(scene.depth.view(), "double");
                Image<float> floats{width, height};
                std::copy(scene.depth.begin(), scene.depth.end(), floats.begin());
                all_open(floats.view(), "float");
                using nook::DepthEncoding;
                for (const DepthEncoding encoding :
                     {DepthEncoding::standard, DepthEncoding::reversed,
                      DepthEncoding::logarithmic}) {
                    projection.encoding = encoding;
                    Image<std::uint16_t> coarse{width, height};
                    Image<float> fine{width, height};
                    for (int y = 0; y < height; ++y)
                        for (int x = 0; x < width; ++x) {
                            coarse(x, y) =
                                nook::encode_depth<nook::D16Storage>(scene.depth(x, y), projection);
                            fine(x, y) = nook::encode_depth<nook::FloatStorage<float>>(
                                scene.depth(x, y), projection);
                        }
                    all_open(nook::hardware_depth(coarse.view(), projection), "D16");
                    all_open(nook::hardware_depth(fine.view(), projection), "hardware float");
                }
            }
    }
}

TEST_CASE("height_field_ao: a wall hides what the closed form says, to the width of a pixel")
{
    // The wall stands between two columns of pixels: the slices that walk across it see it where it
    // is, the others within a pixel.
    for (const double pixels : {20.0, 40.0}) {
        // The wall, half-way between two pixels, less than one from a.
        const auto error = [&](double wanted, double h, double radius) {
            const double a = (std::floor(wanted * pixels) + 0.5) / pixels;
            const int width = static_cast<int>(pixels * (a + radius) + 4) * 2;
            Scene scene = from_above(width, width, pixels, [&](double x, double) {
                return x > a + 0.5 / pixels ? h : 0.0;
            });
            const double open =
                pixel(scene, width / 2, width / 2, {.radius = radius, .slices = 256});
            return std::fabs(1 - open - wall(a, h, radius));
        };
        struct Wall {
            double a, h, radius;
        };
        for (const Wall& w :
             {Wall{1, 1, 2}, {1, 0.5, 1.2}, {0.5, 1, 1.5}, {1, 1, 1.3}, {1, 3, 2}}) {
            CAPTURE(w.a);
            CAPTURE(w.h);
            CAPTURE(w.radius);
            CHECK(error(w.a, w.h, w.radius) < 0.03 / pixels);
        }
        // Unbounded, the wall goes on for 40 heights to both sides.
        if (pixels == 20) {
            const double a = 0.525, h = 0.5;
            Scene scene = from_above(
                100, 800, pixels, [&](double x, double) { return x > a + 0.5 / pixels ? h : 0; });
            const double open = pixel(scene, 50, 400, {.radius = infinity, .slices = 256});
            CHECK(std::fabs(1 - open - wall(a, h, infinity)) < 0.001);
        }
    }
}

TEST_CASE("height_field_ao: canyons, grooves and bowls are as dark as the closed forms say")
{
    const double pixels = 32;
    SUBCASE("canyon")
    {
        // Walls between pixels, and the middle of the floor on one.
        const double half = 32.5 / pixels, radius = 1.5 * half;
        Scene scene = from_above(121, 121, pixels,
                                 [&](double x, double) { return std::fabs(x) > half ? 1.0 : 0.0; });
        const double open = pixel(scene, 60, 60, {.radius = radius, .slices = 256});
        CHECK(std::fabs(1 - open - 2 * wall(half, 1, radius)) < 0.001);
    }
    SUBCASE("V-groove, seen along its middle")
    {
        // The angle, the distance from the edge and the radius in units of each other, and the part that
        // the other face hides: a cap of the sphere of the radius, cut by the horizon.
        struct Groove {
            double degrees, reach, hidden;
        };
        for (const Groove& groove : {Groove{60, 1.5, 0.3603801276986},
                                     {90, 2, 0.1955011094779},
                                     {120, 1.5, 0.02704679436524},
                                     {150, 0.9, 0}}) {
            const double half = groove.degrees / 360 * std::numbers::pi;
            const int out = 24;
            const double s = out / pixels / std::sin(half);
            const int width = 2 * static_cast<int>(pixels * s * (1 + groove.reach)) + 9;
            Scene scene = from_above(width, width, pixels, [&](double x, double) {
                return std::fabs(x) / std::tan(half);
            });
            const int x = width / 2 + out, y = width / 2;
            scene.normal(x, y, -std::cos(half), 0, std::sin(half));
            const double open = pixel(scene, x, y, {.radius = s * groove.reach, .slices = 256});
            CAPTURE(groove.degrees);
            CHECK(std::fabs(1 - open - groove.hidden) < 0.0005);
            if (groove.hidden == 0) CHECK(open == 1);
        }
    }
    SUBCASE("paraboloid, from its apex")
    {
        for (const double k : {0.5, 1.0}) {
            Scene scene = from_above(81, 81, pixels, [&](double x, double y) {
                const double square = x * x + y * y;
                return square < 1 ? k * square : -100;
            });
            const double open = pixel(scene, 40, 40, {.radius = infinity, .slices = 128});
            CHECK(std::fabs(open - 1 / (1 + k * k)) < 0.004);
            const double radius = 0.8;
            const double c = (std::sqrt(1 + 4 * k * k * radius * radius) - 1) / (2 * k * radius);
            const double step = pixel(scene, 40, 40, {.radius = radius, .slices = 128});
            CHECK(std::fabs(step - (1 - c * c)) < 0.001);
        }
    }
    SUBCASE("a cap of a sphere hides the same from each of its points")
    {
        const double rim = std::sin(std::numbers::pi / 3);
        Scene scene = from_above(81, 81, pixels, [&](double x, double y) {
            const double square = x * x + y * y;
            return square < rim * rim ? 1 - std::sqrt(1 - square) : -100;
        });
        for (const int out : {0, 8, 20}) {
            const double sine = out / pixels;
            scene.normal(40 + out, 40, -sine, 0, std::sqrt(1 - sine * sine));
            const double open = pixel(scene, 40 + out, 40, {.radius = infinity, .slices = 128});
            CHECK(std::fabs(1 - open - 0.25) < 0.006);
        }
    }
}

TEST_CASE("height_field_ao: light passes under a bar when solids are thin")
{
    // A bar along y over the floor, from x = 0.525 to 1.025, its top 1 above the floor.
    const double pixels = 20, left = 0.525, right = 1.025;
    Scene scene = from_above(101, 801, pixels,
                             [&](double x, double) { return x > left && x < right ? 1.0 : 0.0; });
    // In the plane across an endless bar, directions weigh cos(angle) / 2.
    const auto sine = [](double x, double z) { return x / std::sqrt(x * x + z * z); };
    for (const double thickness : {0.1, 0.4, 2.0}) {
        const double open =
            pixel(scene, 50, 400, {.radius = infinity, .slices = 256, .thickness = thickness});
        const double bottom = std::max(0.0, 1 - thickness);
        const double hidden = (sine(right, bottom) - sine(left, 1)) / 2;
        CAPTURE(thickness);
        CHECK(std::fabs(1 - open - (thickness < 1 ? hidden : (1 - sine(left, 1)) / 2)) < 0.002);
    }
    // Nothing is hidden by a sheet without thickness, and a solid to the end hides most.
    const auto open_at = [&](double thickness) {
        return pixel(scene, 50, 400, {.radius = 2, .slices = 32, .thickness = thickness});
    };
    CHECK(open_at(0) == 1);
    double last = 1;
    for (const double thickness : {0.01, 0.1, 0.5, 1.0, 3.0, infinity}) {
        CHECK(open_at(thickness) <= last);
        last = open_at(thickness);
    }
    CHECK(last == doctest::Approx(1 - wall(left, 1, 2)).epsilon(0.002));
}

TEST_CASE("height_field_ao: over a height field it agrees with ray tracing")
{
    // A mesh with a vertex under every pixel, seen from above; what lies outside is open for both.
    const int size = 49;
    const double pixels = 16;
    const auto ground = [](double x, double y) {
        return 0.3 * std::sin(3 * x) * std::cos(2.5 * y) + 0.1 * std::sin(7 * x + 5 * y);
    };
    Scene scene = from_above(size, size, pixels, ground);
    std::vector<float> positions, normals, points;
    std::vector<std::uint32_t> indices;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const double wx = (x + 0.5 - size / 2.0) / pixels, wy = (size / 2.0 - y - 0.5) / pixels;
            const double dx =
                0.9 * std::cos(3 * wx) * std::cos(2.5 * wy) + 0.7 * std::cos(7 * wx + 5 * wy);
            const double dy =
                -0.75 * std::sin(3 * wx) * std::sin(2.5 * wy) + 0.5 * std::cos(7 * wx + 5 * wy);
            const double length = std::sqrt(dx * dx + dy * dy + 1);
            scene.normal(x, y, -dx / length, -dy / length, 1 / length);
            for (const double c : {wx, wy, ground(wx, wy)})
                positions.push_back(static_cast<float>(c));
            for (const double c : {-dx / length, -dy / length, 1 / length})
                normals.push_back(static_cast<float>(c));
            if (x > 0 && y > 0) {
                const auto at = static_cast<std::uint32_t>(y * size + x);
                const auto row = static_cast<std::uint32_t>(size);
                indices.insert(indices.end(),
                               {at, at - 1, at - row, at - 1, at - row - 1, at - row});
            }
        }
    nook::Bvh bvh;
    REQUIRE(bvh.build({.positions = positions.data(),
                       .vertex_count = positions.size() / 3,
                       .indices = indices.data(),
                       .triangle_count = indices.size() / 3}));
    for (const double radius : {0.5, 1.2}) {
        double square = 0, worst = 0, bias = 0;
        int count = 0;
        for (int y = 4; y < size; y += 8)
            for (int x = 4; x < size; x += 8, ++count) {
                const std::size_t at = 3 * static_cast<std::size_t>(y * size + x);
                Image<double> traced{1, 1};
                REQUIRE(nook::traced_ao(
                    bvh,
                    nook::ShadingPoints{
                        .positions = &positions[at], .normals = &normals[at], .count = 1},
                    traced.view(), nook::TracedOptions<>{.radius = radius, .directions = 4096}));
                const double open = pixel(scene, x, y, {.radius = radius});
                const double difference = open - traced(0, 0);
                square += difference * difference;
                bias += difference;
                worst = std::max(worst, std::fabs(difference));
            }
        CAPTURE(radius);
        CAPTURE(worst);
        // Ray tracing is off by 1e-3; between pixels the triangles and the height field differ.
        CHECK(std::sqrt(square / count) < 0.002);
        CHECK(std::fabs(bias / count) < 0.001);
        CHECK(worst < 0.006);
    }
}

TEST_CASE("height_field_ao: background, missing normals and odd values stay 1 and harm nobody")
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Scene scene = from_above(21, 17, 8, [](double x, double) { return x > 0.5 ? 0.5 : 0.0; });
    Image<double> before, after;
    REQUIRE(run(scene, before, {.radius = 1}));
    int poisoned = 0;
    for (const double value : {nan, infinity, -infinity, 0.0, -3.0, 1e-300, 1e200}) {
        scene.depth(1 + poisoned, 2) = value;
        ++poisoned;
    }
    scene.normal(3, 12, 0, 0, 0);
    scene.normal(4, 12, nan, 0, 1);
    const Outcome done = run(scene, after, {.radius = 1});
    REQUIRE(done);
    CHECK(done.work.pixels == 21 * 17);
    CHECK(done.work.background == 5 + 1 + 2);  // 1e200 is farther than any surface
    for (int x = 1; x < 6; ++x) CHECK(after(x, 2) == 1);
    CHECK(after(3, 12) == 1);
    CHECK(after(4, 12) == 1);
    for (const double v : after) {
        CHECK(v >= 0);
        CHECK(v <= 1);
    }
    // Beyond the reach of the poisoned pixels nothing has changed; nor beside those without a normal.
    for (int y = 11; y < 17; ++y)
        for (int x = 0; x < 21; ++x)
            if (y != 12 || (x != 3 && x != 4)) CHECK(after(x, y) == before(x, y));
}

TEST_CASE("height_field_ao: a thin card leaves the wall far behind it open; a solid one does not")
{
    // A wall far behind a near card.
    Scene scene{40, 20, {.fx = 30, .fy = 30, .cx = 20, .cy = 10}};
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 40; ++x) scene.depth(x, y) = x < 20 ? 2 : 50;
    Image<double> visibility;
    REQUIRE(run(scene, visibility, {.radius = 1, .thickness = 1}));
    for (const double v : visibility) CHECK(v == 1);
    REQUIRE(run(scene, visibility, {.radius = 1}));
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 40; ++x) CHECK((visibility(x, y) == 1) == (x != 20));
    for (int y = 0; y < 20; ++y)
        for (int x = 20; x < 40; ++x) scene.depth(x, y) = 2.5;
    REQUIRE(run(scene, visibility, {.radius = 1}));
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 40; ++x) {
            if (x < 20) CHECK(visibility(x, y) == 1);
            if (x == 20) CHECK(visibility(x, y) < 0.9);
        }
}

TEST_CASE("height_field_ao: tiny images and extreme sizes of things")
{
    for (const auto& [w, h] : {std::array{1, 1}, {1, 9}, {9, 1}, {2, 2}, {17, 3}}) {
        Scene scene = from_above(w, h, 3, [](double x, double y) { return x * y; });
        Image<double> visibility;
        REQUIRE(run(scene, visibility, {.radius = 2, .slices = 5}));
        for (const double v : visibility) {
            CHECK(v >= 0);
            CHECK(v <= 1);
            if (w * h == 1) CHECK(v == 1);
        }
    }
    // Lengths times a power of two give the same picture.
    Image<double> expected;
    for (const double scale : {1.0, 0x1p-60, 0x1p60}) {
        Scene scene{24, 16, {.fx = 20, .fy = 25, .cx = 11, .cy = 9}};
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 24; ++x)
                scene.depth(x, y) = (2 + 0.3 * std::sin(x * 1.7) * std::cos(y * 1.1)) * scale;
        Image<double> visibility;
        REQUIRE(run(scene, visibility, {.radius = 0.7 * scale, .slices = 9}));
        if (scale == 1) expected = visibility;
        CHECK(visibility == expected);
        double least = 1;
        for (const double v : visibility) least = std::min(least, v);
        CHECK(least < 0.9);
    }
    Scene scene{24, 16, {.fx = 20, .fy = 25, .cx = 11, .cy = 9}};
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 24; ++x) scene.depth(x, y) = x % 3 == 0 ? 1e-30 : y % 2 == 0 ? 1e30 : 1;
    for (const double radius : {0.0, 1e-7, 1e7, 1e300, infinity})
        for (const double thickness : {0.0, 1e-7, 1e300, infinity}) {
            Image<double> visibility;
            REQUIRE(
                run(scene, visibility, {.radius = radius, .slices = 4, .thickness = thickness}));
            for (const double v : visibility) {
                CHECK(v >= 0);
                CHECK(v <= 1);
                if (radius == 0 || thickness == 0) CHECK(v == 1);
            }
        }
}

TEST_CASE("height_field_ao: threads, work maps and lent scratch leave the bits as they are")
{
    Scene scene = from_above(53, 29, 10, [](double x, double y) {
        return std::sin(5 * x) + 0.5 * std::cos(7 * y) > 0.4 ? 0.3 : 0.05 * x;
    });
    const HeightFieldOptions options{.radius = 0.8, .slices = 6, .thickness = 0.5};
    Image<double> expected, visibility{53, 29};
    REQUIRE(run(scene, expected, options));
    nook::ThreadExecutor threads{3};
    const std::size_t size = nook::height_field_ao_scratch_size(scene.depth.view(), options, 3);
    std::vector<std::byte> memory(size + 1);
    REQUIRE(nook::height_field_ao(scene.depth.view(), scene.normal_view(), visibility.view(),
                                  options, scene.projection, {},
                                  nook::Scratch{memory.data() + 1, size}, threads));
    CHECK(visibility == expected);

    Image<std::uint8_t> active{WorkMap::groups(53), 29};
    for (int y = 0; y < 29; ++y)
        for (int g = 0; g < active.width(); ++g) active(g, y) = (g + y) % 3 == 0;
    Image<double> masked;
    const Outcome done = run(scene, masked, options, {active});
    REQUIRE(done);
    std::uint64_t skipped = 0;
    for (int y = 0; y < 29; ++y)
        for (int x = 0; x < 53; ++x) {
            const bool on = active(x / 16, y) != 0;
            CHECK(masked(x, y) == (on ? expected(x, y) : 1.0));
            skipped += !on;
        }
    CHECK(done.work.skipped == skipped);
    CHECK(done.work.samples > 0);
    CHECK(done.work.passes == 1);

    // With nothing to do not even the height field is made.
    const Image<std::uint8_t> nothing{WorkMap::groups(53), 29, 0};
    Scene with_sky = scene;
    with_sky.depth(20, 11) = 0;
    const Outcome idle = run(with_sky, masked, options, {nothing});
    REQUIRE(idle);
    for (const double v : masked) CHECK(v == 1);
    CHECK(idle.work.background == 1);
    CHECK(idle.work.skipped == 53 * 29 - 1);
    CHECK(idle.work.samples == 0);
    CHECK(idle.work.passes == 0);
    CHECK(idle.work.skipped_passes == 1);
}

TEST_CASE("height_field_ao: bad arguments are named and nothing is written")
{
    Scene scene = from_above(8, 6, 4, [](double, double) { return 0.0; });
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Image<double> visibility{8, 6, -7};
    const auto refuses = [&](const HeightFieldOptions& options, const char* argument) {
        const Outcome done = nook::height_field_ao(scene.depth.view(), scene.normal_view(),
                                                   visibility.view(), options, scene.projection);
        CHECK(std::string{done.error.argument} == argument);
        for (const double v : visibility) CHECK(v == -7);
        CHECK(nook::height_field_ao_scratch_size(scene.depth.view(), options) == 0);
    };
    refuses({.radius = -1}, "options.radius");
    refuses({.radius = nan}, "options.radius");
    refuses({.slices = 0}, "options.slices");
    refuses({.slices = 5000}, "options.slices");
    refuses({.thickness = -1}, "options.thickness");
    refuses({.thickness = nan}, "options.thickness");
    refuses({.bias = -1}, "options.bias");
    refuses({.bias = infinity}, "options.bias");
    const auto argument = [](const Outcome& done) { return std::string{done.error.argument}; };
    CHECK(argument(nook::height_field_ao(scene.depth.view(), scene.normal_view(), visibility.view(),
                                         {}, Projection{})) == "projection.fx");
    Image<double> other{8, 5};
    CHECK(argument(nook::height_field_ao(scene.depth.view(), scene.normal_view(), other.view(), {},
                                         scene.projection)) == "visibility");
    CHECK(argument(nook::height_field_ao(scene.depth.view(), scene.normal_view(),
                                         scene.depth.view(), {}, scene.projection)) ==
          "visibility");
    Image<float> few{3 * 8, 5};
    CHECK(argument(nook::height_field_ao(scene.depth.view(),
                                         ImageView3<const float>::interleaved(few.data(), 8, 5, 24),
                                         visibility.view(), {}, scene.projection)) == "normals.x");
    CHECK(argument(nook::height_field_ao(scene.depth.view(), scene.normal_view(), visibility.view(),
                                         {}, scene.projection, {}, nook::Scratch{})) == "scratch");
    for (const double v : visibility) CHECK(v == -7);
    CHECK(nook::height_field_ao(ImageView<const float>{}, ImageView3<const float>{},
                                ImageView<float>{}, {}, scene.projection));
}
