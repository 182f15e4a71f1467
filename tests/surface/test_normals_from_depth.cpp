#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include <nook/depth/hardware_depth.hpp>
#include <nook/image.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/normals_from_depth.hpp>
#include <nook/thread_executor.hpp>

namespace {

using nook::Image;
using nook::ImageView;
using nook::ImageView3;
using nook::Outcome;
using nook::Projection;

struct Vector {
    double x, y, z;
};

/// The view ray of a pixel, for a depth of 1.
Vector ray(const Projection& p, int x, int y)
{
    if (p.orthographic) return {0, 0, -1};
    return {(x + 0.5 - p.cx) / p.fx, (p.cy - y - 0.5) / p.fy, -1};
}

template <class Value>
struct Normals {
    Image<Value> pixels;
    ImageView3<Value> view;

    Normals(int width, int height)
        : pixels{3 * width, height},
          view{ImageView3<Value>::interleaved(pixels.data(), width, height, 3 * width)}
    {}
    [[nodiscard]] double off(int x, int y, const Vector& n) const
    {
        const double dx = view.x(x, y) - n.x, dy = view.y(x, y) - n.y, dz = view.z(x, y) - n.z;
        return std::sqrt(dx * dx + dy * dy + dz * dz);
    }
};

/// The distance at a pixel of the plane n·v = −1; 0 where the ray does not meet it.
double plane_distance(const Projection& p, const Vector& n, int x, int y)
{
    const Vector r = ray(p, x, y);
    if (p.orthographic) {
        const double vx = (x + 0.5 - p.cx) / p.fx, vy = (p.cy - y - 0.5) / p.fy;
        return 100 + (n.x * vx + n.y * vy) / n.z;
    }
    const double across = -(n.x * r.x + n.y * r.y + n.z * r.z);
    return across > 1e-3 ? 1 / across : 0;
}

}  // namespace

TEST_CASE("normals_from_depth: planes of every tilt come out exact, up to the rounding of depths")
{
    std::mt19937 random{3};
    std::normal_distribution<double> gauss;
    for (const auto& extent : {std::array{37, 19}, {300, 7}, {5, 70}, {2, 2}, {3, 2}, {2, 5}}) {
        const int width = extent[0], height = extent[1];
        for (int trial = 0; trial < 24; ++trial) {
            Projection p{.fx = 40, .fy = 55, .cx = width * 0.6, .cy = height * 0.4};
            p.orthographic = trial % 2 == 1;
            const double tilt = trial / 24.0 * 1.56, turn = gauss(random);
            const Vector n{std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn),
                           std::cos(tilt)};
            Image<double> depth{width, height};
            Image<float> floats{width, height};
            int surfaces = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    depth(x, y) = plane_distance(p, n, x, y);
                    floats(x, y) = static_cast<float>(depth(x, y));
                    surfaces += depth(x, y) > 0;
                }
            // An isolated pixel has no slope.
            if (surfaces < width * height && width * height < 30) continue;
            Normals<double> exact{width, height};
            Normals<float> rounded{width, height};
            const Outcome done = nook::normals_from_depth(depth.view(), exact.view, p);
            REQUIRE(done);
            REQUIRE(nook::normals_from_depth(floats.view(), rounded.view, p));
            CHECK(done.work.background == static_cast<std::uint64_t>(width * height - surfaces));
            CAPTURE(trial);
            CAPTURE(width);
            const auto at = [&](int x, int y) {
                return x >= 0 && y >= 0 && x < width && y < height && depth(x, y) > 0;
            };
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    if (!at(x, y)) {
                        CHECK(exact.off(x, y, {0, 0, 0}) == 0);
                        CHECK(rounded.off(x, y, {0, 0, 0}) == 0);
                        continue;
                    }
                    // Both axes need a neighbour.
                    if (!(at(x - 1, y) || at(x + 1, y)) || !(at(x, y - 1) || at(x, y + 1)))
                        continue;
                    const double size = p.orthographic ? 100 : 1;
                    CHECK(exact.off(x, y, n) < 1e-12 * size);
                    CHECK(rounded.off(x, y, n) < 1e-4 * size);
                }
        }
    }
}

TEST_CASE("normals_from_depth: every side of a silhouette and of a crease keeps its own normal")
{
    const Projection p{.fx = 60, .fy = 60, .cx = 40, .cy = 30};
    // A card in front of a floor and a wall that meet in a crease.
    const Vector floor{0, 1, 0}, wall{0, 0, 1}, card{0.6, 0, 0.8};
    const int width = 80, height = 60;
    Image<double> depth{width, height};
    Image<int> which{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vector r = ray(p, x, y);
            double nearest = 6;
            which(x, y) = 1;
            if (r.y < 0 && 1 / -r.y < nearest) {
                nearest = 1 / -r.y;
                which(x, y) = 0;
            }
            const double d = 1.5 / -(card.x * r.x + card.z * r.z);
            if (x >= 30 && x < 50 && y >= 10 && y < 45 && d > 0 && d < nearest) {
                nearest = d;
                which(x, y) = 2;
            }
            depth(x, y) = nearest;
        }
    Normals<double> normals{width, height};
    REQUIRE(nook::normals_from_depth(depth.view(), normals.view, p));
    const Vector expected[] = {floor, wall, card};
    int wrong = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) wrong += normals.off(x, y, expected[which(x, y)]) > 1e-9;
    CHECK(wrong == 0);
}

TEST_CASE("normals_from_depth: smooth surfaces converge with the square of the pixel")
{
    double last = 0;
    for (const int size : {40, 80}) {
        const double pixels = size / 2.0;
        const Projection p{
            .fx = pixels, .fy = pixels, .cx = pixels, .cy = pixels, .orthographic = true};
        Image<double> depth{size, size};
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const double vx = (x + 0.5 - pixels) / pixels, vy = (pixels - y - 0.5) / pixels;
                depth(x, y) = 10 - std::sqrt(4 - vx * vx - vy * vy);
            }
        Normals<double> normals{size, size};
        REQUIRE(nook::normals_from_depth(depth.view(), normals.view, p));
        double worst = 0;
        for (int y = 2; y < size - 2; ++y)
            for (int x = 2; x < size - 2; ++x) {
                const double vx = (x + 0.5 - pixels) / pixels, vy = (pixels - y - 0.5) / pixels;
                const double z = std::sqrt(4 - vx * vx - vy * vy);
                worst = std::max(worst, normals.off(x, y, {vx / 2, vy / 2, z / 2}));
            }
        CHECK(worst < 0.4 / (size * size) * 4);
        if (last > 0) CHECK(worst < last / 3.2);
        last = worst;
    }
}

TEST_CASE("normals_from_depth: lines one pixel wide and lone pixels face the viewer")
{
    const Projection p{.fx = 20, .fy = 30, .cx = 3, .cy = 5};
    const int width = 15, height = 11;
    const auto facing = [&](int x, int y) {
        const Vector r = ray(p, x, y);
        const double length = std::sqrt(r.x * r.x + r.y * r.y + 1);
        return Vector{-r.x / length, -r.y / length, 1 / length};
    };
    SUBCASE("a pixel without neighbours")
    {
        Image<double> depth{width, height};
        depth(4, 7) = 3;
        depth(0, 0) = 2;
        Normals<float> normals{width, height};
        const Outcome done = nook::normals_from_depth(depth.view(), normals.view, p);
        CHECK(done.work.background == width * height - 2);
        CHECK(normals.off(4, 7, facing(4, 7)) < 1e-6);
        CHECK(normals.off(0, 0, facing(0, 0)) < 1e-6);
        CHECK(normals.off(5, 7, {0, 0, 0}) == 0);
    }
    SUBCASE("a picture of one pixel")
    {
        Image<double> depth{1, 1, 5};
        Normals<double> normals{1, 1};
        REQUIRE(nook::normals_from_depth(depth.view(), normals.view, p));
        CHECK(normals.off(0, 0, facing(0, 0)) < 1e-15);
    }
    SUBCASE("a pole before a wall")
    {
        Image<double> depth{width, height, 20};
        for (int y = 0; y < height; ++y) depth(7, y) = 2;
        Normals<double> normals{width, height};
        REQUIRE(nook::normals_from_depth(depth.view(), normals.view, p));
        for (int y = 0; y < height; ++y) {
            // Upright along its length, square to the view ray across.
            const Vector r = ray(p, 7, y);
            const double nx = normals.view.x(7, y), nz = normals.view.z(7, y);
            CHECK(std::fabs(nx) < 0.3);
            CHECK(nz > 0.9);
            CHECK(nx * r.x + normals.view.y(7, y) * r.y - nz < 0);
            CHECK(normals.off(6, y, {0, 0, 1}) < 1e-12);
            CHECK(normals.off(8, y, {0, 0, 1}) < 1e-12);
        }
    }
}

TEST_CASE("normals_from_depth: unit length and facing the viewer, whatever the depths")
{
    std::mt19937 random{5};
    std::uniform_real_distribution<double> unit{0, 1};
#if defined(__FAST_MATH__)
    const float smallest = 2e-38f;  // denormals are 0 to such programs
#else
    const float smallest = 1e-45f;
#endif
    const float odd[] = {0.0f,
                         -1.0f,
                         std::numeric_limits<float>::quiet_NaN(),
                         std::numeric_limits<float>::infinity(),
                         smallest,
                         2e-38f,
                         3e38f,
                         1.0f};
    for (int trial = 0; trial < 40; ++trial) {
        const int width = 1 + trial, height = 1 + trial % 7;
        Projection p{.fx = std::pow(10.0, 6 * unit(random) - 2),
                     .fy = std::pow(10.0, 6 * unit(random) - 2),
                     .cx = 5,
                     .cy = 3,
                     .orthographic = trial % 3 == 0};
        Image<float> depth{width, height};
        for (float& d : depth) {
            const double pick = unit(random);
            d = pick < 0.4 ? odd[static_cast<int>(pick * 20)]
                           : static_cast<float>(std::pow(10.0, 10 * unit(random) - 5));
        }
        Normals<float> normals{width, height};
        REQUIRE(nook::normals_from_depth(depth.view(), normals.view, p));
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const double nx = normals.view.x(x, y), ny = normals.view.y(x, y),
                             nz = normals.view.z(x, y);
                const double square = nx * nx + ny * ny + nz * nz;
                if (!nook::is_surface(depth(x, y), 3.4e38f)) {
                    CHECK(square == 0);
                    continue;
                }
                CHECK(square == doctest::Approx(1).epsilon(1e-5));
                const Vector r = ray(p, x, y);
                const double length = std::sqrt(r.x * r.x + r.y * r.y + 1);
                CHECK((nx * r.x + ny * r.y - nz) / length < 1e-6);
            }
    }
}

TEST_CASE("normals_from_depth: hardware depths, strides and threads give what plain distances give")
{
    Projection p{.fx = 90,
                 .fy = 80,
                 .cx = 200,
                 .cy = 40,
                 .encoding = nook::DepthEncoding::reversed,
                 .near_plane = 0.1};
    const int width = 401, height = 77;
    Image<float> depth{width, height}, encoded{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double d = 5 + std::sin(x * 0.05) + (y > 30 ? 0.01 * y : 4);
            encoded(x, y) = nook::encode_depth<nook::FloatStorage<float>>(d, p);
        }
    const auto source = nook::hardware_depth(encoded.view(), p);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) depth(x, y) = nook::surface_distance(source, x, y);
    Normals<float> expected{width, height}, decoded{width, height}, threaded{width, height};
    // The same spacing of depths, which tells what counts as a tear.
    const nook::DepthSource plain{depth.view(), nook::IdentityDecode{}, source.step};
    REQUIRE(nook::normals_from_depth(plain, expected.view, p));
    REQUIRE(nook::normals_from_depth(source, decoded.view, p));
    CHECK(decoded.pixels == expected.pixels);
    nook::ThreadExecutor threads{3};
    REQUIRE(nook::normals_from_depth(plain, threaded.view, p, threads));
    CHECK(threaded.pixels == expected.pixels);

    // Planes, and depth upside down.
    Image<float> nx{width, height}, ny{width, height}, nz{width, height};
    REQUIRE(nook::normals_from_depth(plain, ImageView3<float>{nx, ny, nz}, p));
    int different = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            different += nx(x, y) != expected.view.x(x, y) || ny(x, y) != expected.view.y(x, y) ||
                         nz(x, y) != expected.view.z(x, y);
    CHECK(different == 0);
}

TEST_CASE("normals_from_depth: bad arguments are named and nothing is written")
{
    const Projection p{.fx = 1, .fy = 1};
    Image<float> depth{4, 3, 1};
    Normals<float> normals{4, 3};
    const auto argument = [](const Outcome& done) { return std::string{done.error.argument}; };
    CHECK(argument(nook::normals_from_depth(depth.view(), normals.view, Projection{})) ==
          "projection.fx");
    CHECK(argument(nook::normals_from_depth(ImageView<const float>{nullptr, 4, 3}, normals.view,
                                            p)) == "depth");
    Normals<float> narrow{3, 3};
    CHECK(argument(nook::normals_from_depth(depth.view(), narrow.view, p)) == "normals.x");
    ImageView3<float> twice{normals.view.x, normals.view.y, normals.view.x};
    CHECK(argument(nook::normals_from_depth(depth.view(), twice, p)) == "normals.z");
    ImageView3<float> over{normals.view.x, depth.view(), normals.view.z};
    CHECK(argument(nook::normals_from_depth(depth.view(), over, p)) == "normals.y");
    for (const float v : normals.pixels) CHECK(v == 0);
    CHECK(nook::normals_from_depth(ImageView<const float>{}, ImageView3<float>{}, p));
}

TEST_CASE("a work map leaves normals out, and the others keep their bits")
{
    const int width = 300, height = 75;
    const Projection projection{.fx = 200, .fy = 180, .cx = 150, .cy = 40};
    std::mt19937 engine{5};
    Image<float> depth{width, height};
    for (float& d : depth) d = engine() % 9 == 0 ? -1 : 1 + static_cast<float>(engine() % 64) / 64;
    Normals<float> all{width, height}, some{width, height};
    const Outcome whole = nook::normals_from_depth(depth.view(), all.view, projection);
    REQUIRE(whole);
    const int across = nook::WorkMap::groups(width);
    nook::ThreadExecutor threads{3};
    // Single groups, rows that are wholly inactive, and none at all.
    for (const unsigned one_in : {2u, 40u, 4000u, 1u << 31}) {
        Image<std::uint8_t> active{across, height};
        for (std::uint8_t& group : active) group = engine() % one_in == 0 ? 1 : 0;
        const nook::WorkMap map{active};
        std::fill(some.pixels.begin(), some.pixels.end(), -7.0f);
        const Outcome done =
            nook::normals_from_depth(depth.view(), some.view, projection, map, threads);
        REQUIRE(done);
        std::uint64_t skipped = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const bool is_active = map.is_active(x, y);
                skipped += !is_active && depth(x, y) > 0 ? 1 : 0;
                REQUIRE(some.view.x(x, y) == (is_active ? all.view.x(x, y) : 0));
                REQUIRE(some.view.y(x, y) == (is_active ? all.view.y(x, y) : 0));
                REQUIRE(some.view.z(x, y) == (is_active ? all.view.z(x, y) : 0));
            }
        CHECK(done.work.skipped == skipped);
        CHECK(done.work.background == whole.work.background);
    }
    const Image<std::uint8_t> narrow{across - 1, height};
    const Outcome refused =
        nook::normals_from_depth(depth.view(), some.view, projection, nook::WorkMap{narrow});
    CHECK(std::string{refused.error.argument} == "work_map.active");
}
