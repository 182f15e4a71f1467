#include <doctest/doctest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/depth/moments.hpp>
#include <nook/owned_image.hpp>
#include <nook/thread_executor.hpp>

#include "exact.hpp"

namespace {

using nook::Border;
using nook::ChebyshevOptions;
using nook::Image;
using nook::Projection;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float largest = std::numeric_limits<float>::max();

Image<float> make(int width, int height, const std::function<double(int, int)>& value)
{
    Image<float> image{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(value(x, y));
    return image;
}

template <class Depth>
Image<float> visibility(const Depth& depth, const ChebyshevOptions& options,
                        const Projection& projection = {}, const nook::WorkMap& work_map = {})
{
    const auto& image = nook::depth_source(depth).image;
    Image<float> result{image.width, image.height, -1.f};
    REQUIRE(nook::chebyshev_ao(depth, result.view(), options, projection, work_map));
    return result;
}
Image<float> visibility(const Image<float>& image, const ChebyshevOptions& options,
                        const Projection& projection = {})
{
    return visibility(image.view(), options, projection);
}
Image<float> reference(const Image<float>& image, const ChebyshevOptions& options,
                       const nook::ExactRefinements& refinements = {},
                       const Projection& projection = {})
{
    Image<float> result{image.width(), image.height(), -1.f};
    REQUIRE(nook::chebyshev_ao_reference(image.view(), result.view(), options, refinements,
                                         projection));
    return result;
}
double largest_difference(const Image<float>& a, const Image<float>& b)
{
    double worst = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x)
            worst = std::max(worst, std::fabs(double{a(x, y)} - double{b(x, y)}));
    return worst;
}
ChebyshevOptions plain(int window) { return {.window = window, .bias = 0}; }

/// Distances of a floor under a camera at height 1 that looks down by `pitch`; the frame holds the
/// floor alone.
Image<float> floor_at(double pitch, int width, int height, double focal)
{
    return make(width, height, [=](int, int y) {
        const double slope = (height / 2.0 - (y + 0.5)) / focal;
        return 1 / (std::sin(pitch) - slope * std::cos(pitch));
    });
}

/// Relief of all sizes: a bowl, a step, a slope, noise, a hole of background.
Image<float> varied(int width, int height)
{
    std::mt19937 random{29};
    return make(width, height, [&](int x, int y) {
        const double u = double(x) / width - 0.5, v = double(y) / height - 0.5;
        double z = 4 + 0.3 * u + 0.2 * v;
        if (u * u + v * v < 0.04) z += 0.5 - 12 * (u * u + v * v);
        if (u > 0.3) z -= 1;
        if (v < -0.3 && u < -0.2) return double{infinity};
        return z + 1e-4 * double(random() % 100);
    });
}

}  // namespace

TEST_CASE("straight step: the deep side ramps as (r + 1 + j) / (2r + 1), at any height")
{
    for (const double height : {1e-6, 1.0, 1e6})
        for (const int r : {1, 2, 5}) {
            const Image<float> image =
                make(41, 41, [&](int x, int) { return x < 20 ? 1 : 1 + height; });
            for (const Image<float>& ao :
                 {visibility(image, plain(2 * r + 1)), reference(image, plain(2 * r + 1))})
                for (int y = r; y < 41 - r; ++y) {
                    for (int x = r; x < 20; ++x) REQUIRE(ao(x, y) == 1);
                    for (int x = 20; x < 41 - r; ++x) {
                        const int j = std::min(x - 20, r);
                        REQUIRE(ao(x, y) == float(r + 1 + j) / float(2 * r + 1));
                    }
                }
        }
}

TEST_CASE("corners, points, lines, creases and bowls have their exact fractions")
{
    const auto centre = [](int r, const std::function<double(int, int)>& depth) {
        const Image<float> image =
            make(81, 81, [&](int x, int y) { return 1000 + depth(x - 40, y - 40); });
        const float exact_form = reference(image, plain(2 * r + 1))(40, 40);
        CHECK(visibility(image, plain(2 * r + 1))(40, 40) == exact_form);
        return exact_form;
    };
    for (const int r : {1, 2, 4, 8, 16, 32}) {
        CAPTURE(r);
        const double k = 2 * r + 1;
        CHECK(centre(r, [](int x, int y) { return x >= 0 && y >= 0 ? 1 : 0; }) ==
              float((r + 1) * (r + 1) / (k * k)));
        CHECK(centre(r, [](int x, int y) { return x == 0 && y == 0 ? 1 : 0; }) ==
              float(1 / (k * k)));
        CHECK(centre(r, [](int x, int) { return x == 0 ? 1 : 0; }) == float(1 / k));
        for (const double slope : {0.25, 1.0, 8.0})
            CHECK(centre(r, [&](int x, int) { return -slope * std::abs(x); }) ==
                  float(1 - 3.0 * r * (r + 1) / (k * k)));
    }
    const int radii[] = {1, 2, 3, 8, 16};
    const float bowls[] = {1 / 5.f, 7 / 27.f, 3 / 11.f, 19 / 67.f, 217 / 761.f};
    for (int i = 0; i < 5; ++i)
        CHECK(centre(radii[i], [](int x, int y) { return -(x * x + y * y) / 16.0; }) == bowls[i]);
    CHECK(centre(4, [](int x, int y) { return -(x * x + y * y) / 16.0; }) == float(77 / 277.0));
}

TEST_CASE("a checkerboard: deep pixels get (N + 1) / (2N), shallow ones 1")
{
    const Image<float> image = make(30, 30, [](int x, int y) { return (x + y) % 2 ? 2 : 1; });
    const Image<float> ao = visibility(image, plain(5));
    for (int y = 2; y < 28; ++y)
        for (int x = 2; x < 28; ++x) REQUIRE(ao(x, y) == ((x + y) % 2 ? float(26 / 50.0) : 1.f));
}

TEST_CASE("one pixel an ulp farther: 1/N without bias, above 0.99 with the automatic one")
{
    Image<float> image{31, 31, 1000.f};
    image(15, 15) = std::nextafter(1000.f, 2000.f);
    Image<float> ao = visibility(image, plain(5));
    CHECK(ao(15, 15) == float(1 / 25.0));
    ao(15, 15) = 1;
    for (const float value : ao) REQUIRE(value == 1);
    CHECK(visibility(image, {.window = 5})(15, 15) >= 0.99f);
}

TEST_CASE("planes that are linear on screen are exactly 1 at any slope, up to the frame")
{
    for (const double a : {0.0, 0.125, -2.0, 64.0})
        for (const double b : {0.0, 0.5, -16.0}) {
            const Image<float> image =
                make(60, 50, [&](int x, int y) { return 8192 + a * x + b * y; });
            for (const int window : {3, 15, 63})
                for (const float value : visibility(image, plain(window))) REQUIRE(value == 1);
        }
}

TEST_CASE("a plane in perspective: 1 with the clamp on distances, the paper's false shade without")
{
    // z = 1 / (a i + b) is convex: its mean lies behind it.
    const auto at = [](double a, double b, int r, bool clamp) {
        const Image<double> image = [&] {
            Image<double> z{129, 2 * r + 1};
            for (int y = 0; y < z.height(); ++y)
                for (int x = 0; x < 129; ++x) z(x, y) = 1 / (a * (x - 64) + b);
            return z;
        }();
        Image<double> ao{129, 2 * r + 1};
        REQUIRE(nook::chebyshev_ao(image.view(), ao.view(),
                                   {.window = 2 * r + 1, .bias = 0, .clamp = clamp}));
        return ao(64, r);
    };
    CHECK(at(1e-3, 0.1, 8, true) == 1);
    CHECK(at(1e-3, 0.1, 8, false) == doctest::Approx(0.997610300).epsilon(1e-9));
    CHECK(at(1e-4, 0.02 * 0.1 * 10, 8, true) == 1);
    const auto shallow = [](int r, bool clamp) {
        Image<double> z{2 * r + 1, 2 * r + 1}, ao{2 * r + 1, 2 * r + 1};
        for (int y = 0; y <= 2 * r; ++y)
            for (int x = 0; x <= 2 * r; ++x) z(x, y) = 1 / (1e-3 * (x - r) + 0.02);
        REQUIRE(nook::chebyshev_ao(z.view(), ao.view(),
                                   {.window = 2 * r + 1, .bias = 0, .clamp = clamp}));
        return ao(r, r);
    };
    CHECK(shallow(8, true) == 1);
    CHECK(shallow(8, false) == doctest::Approx(0.946189627).epsilon(1e-9));
    CHECK(shallow(4, false) == doctest::Approx(0.983818179).epsilon(1e-9));
}

TEST_CASE("floors at five pitches are exactly 1 up to the frame")
{
    const double degree = std::numbers::pi / 180;
    for (const double pitch : {15.0, 30.0, 45.0, 60.0, 75.0}) {
        const Image<float> image = floor_at(pitch * degree, 160, 90, 250);
        for (const float z : image) REQUIRE(z > 0);
        for (const int window : {3, 7, 31, 127})
            for (const bool automatic : {false, true}) {
                CAPTURE(pitch);
                CAPTURE(window);
                ChebyshevOptions options{.window = window};
                if (!automatic) options.bias = 0;
                for (const float value : visibility(image, options)) REQUIRE(value == 1);
            }
        // World-space radius: windows that change with distance.
        const Projection projection{.fx = 250, .fy = 250, .cx = 80, .cy = 45};
        for (const float value : visibility(image, {.radius = 0.1, .bias = 0}, projection))
            REQUIRE(value == 1);
    }
}

TEST_CASE("quantised flat ground stays above 0.99 under the automatic bias, in every encoding")
{
    const Image<float> image = floor_at(1.5, 120, 80, 400);
    const auto check = [&]<class Storage>(Storage, const Projection& projection) {
        Image<typename Storage::Stored> stored{120, 80};
        for (int y = 0; y < 80; ++y)
            for (int x = 0; x < 120; ++x)
                stored(x, y) = nook::encode_depth<Storage>(double{image(x, y)}, projection);
        const auto source = nook::hardware_depth<Storage>(stored.view(), projection);
        for (const float value : visibility(source, {.window = 15})) REQUIRE(value >= 0.99f);
    };
    using enum nook::DepthEncoding;
    for (const auto encoding : {standard, reversed, opengl, logarithmic}) {
        Projection projection{.fx = 400,
                              .fy = 400,
                              .cx = 60,
                              .cy = 40,
                              .encoding = encoding,
                              .near_plane = 0.1,
                              .far_plane = 100};
        check(nook::FloatStorage<float>{}, projection);
        check(nook::D24Storage{}, projection);
        check(nook::D16Storage{}, projection);
        check(nook::HalfStorage{}, projection);
    }
}

TEST_CASE("the fast form equals the reference, fixed and variable windows, borders, range check")
{
    const Image<float> image = varied(150, 110);
    const Projection perspective{.fx = 130, .fy = 100, .cx = 75, .cy = 55};
    Projection orthographic = perspective;
    orthographic.orthographic = true;
    for (const Border border : {Border::symmetric, Border::clip})
        for (const bool clamp : {true, false})
            for (const double range : {0.0, 0.2})
                for (const double bias : {-1.0, 0.0, 1e-4})
                    for (const double radius : {0.0, 0.02, 0.5, 3.0})
                        for (const Projection& projection : {perspective, orthographic}) {
                            ChebyshevOptions options{.window = 21,
                                                     .radius = radius,
                                                     .max_window = 41,
                                                     .clamp = clamp,
                                                     .border = border};
                            if (bias >= 0) options.bias = bias;
                            if (range > 0) options.range = range;
                            // Tolerance of the variable form's certificate: 1e-5 of the variance.
                            REQUIRE(largest_difference(visibility(image, options, projection),
                                                       reference(image, options, {}, projection)) <=
                                    1e-5);
                        }
}

TEST_CASE("the variable window is the box of the pixel's own size")
{
    const Image<float> image = varied(120, 90);
    const Projection projection{.fx = 120, .fy = 120, .cx = 60, .cy = 45};
    const ChebyshevOptions options{.radius = 0.2, .max_window = 31, .bias = 0};
    const Image<float> ao = visibility(image, options, projection);
    std::array<Image<float>, 16> fixed;
    for (int r = 0; r < 16; ++r) fixed[std::size_t(r)] = visibility(image, plain(2 * r + 1));
    int sizes_seen = 0;
    for (int y = 0; y < 90; ++y)
        for (int x = 0; x < 120; ++x) {
            if (!nook::is_surface(image(x, y), largest)) continue;
            const int r = std::min(15, int(0.2 * 120 / double{image(x, y)}));
            REQUIRE(std::fabs(ao(x, y) - fixed[std::size_t(r)](x, y)) <= 1e-5f);
            sizes_seen |= 1 << r;
        }
    CHECK(std::popcount(unsigned(sizes_seen)) >= 3);
}

TEST_CASE("window sizes from distances: tiny, huge, jumping")
{
    const Projection projection{.fx = 100, .fy = 100, .cx = 5, .cy = 5};
    std::mt19937 random{31};
    const float depths[] = {1e-45f, 1e-38f, 1e-3f, 1.f,      1e5f,
                            3e38f,  0.f,    -1.f,  infinity, not_a_number};
    const Image<float> image = make(90, 70, [&](int, int) { return depths[random() % 10]; });
    for (const double radius : {1e-300, 1e-3, 1.0, 1e300})
        for (const float value :
             visibility(image, {.radius = radius, .max_window = 63}, projection)) {
            REQUIRE(value >= 0);
            REQUIRE(value <= 1);
        }
    // Far away every window is its pixel alone.
    for (const float value : visibility(Image<float>{30, 30, 1e6f}, {.radius = 1}, projection))
        REQUIRE(value == 1);
}

TEST_CASE("where the variable form cannot vouch for its tables it reads the window, and says so")
{
    const Projection projection{.fx = 100, .fy = 100, .cx = 50, .cy = 50};
    Image<float> image = make(100, 100, [](int x, int y) { return 10 + 0.001 * ((x * y) % 7); });
    Image<float> ao{100, 100};
    const ChebyshevOptions options{.radius = 0.8, .bias = 0};
    auto outcome = nook::chebyshev_ao(image.view(), ao.view(), options, projection);
    REQUIRE(outcome);
    // Only the smallest windows, at the border.
    const auto without_spike = outcome.work.samples;
    CHECK(without_spike < 10'000);
    image(50, 50) = 1e30f;
    outcome = nook::chebyshev_ao(image.view(), ao.view(), options, projection);
    CHECK(outcome.work.samples > 100 * without_spike);
    CHECK(largest_difference(ao, reference(image, options, {}, projection)) <= 1e-5);
    // Relief of a few ulps beside a wall 10 000 times as far.
    std::mt19937 random{53};
    const Image<float> cliff = make(
        100, 100, [&](int x, int) { return x < 50 ? 1e4 : 1 + double(random() % 8) * 0x1p-23; });
    const ChebyshevOptions tiny{.radius = 0.08, .bias = 0};
    CHECK(largest_difference(visibility(cliff, tiny, projection),
                             reference(cliff, tiny, {}, projection)) <= 1e-5);
}

TEST_CASE("hardware depth gives the bits of its decoded values, and every encoding nearly the same")
{
    const Image<float> image = varied(128, 96);
    const Projection base{
        .fx = 130, .fy = 130, .cx = 64, .cy = 48, .near_plane = 0.5, .far_plane = 20};
    // Rounding by half a step h moves the deviation by 2h and σ by h; with |d/dt 1/(1 + t²)| ≤ 0.65
    // that moves the bound by at most (1.3 + 0.5) h / √ε: 1/255 needs ε ≥ 52 700 steps².
    const auto check = [&]<class Storage>(Storage, Projection projection,
                                          nook::DepthEncoding encoding) {
        projection.encoding = encoding;
        CAPTURE(int(encoding));
        CAPTURE(projection.orthographic);
        CAPTURE(projection.far_plane);
        Image<typename Storage::Stored> stored{128, 96};
        Image<float> decoded{128, 96};
        const nook::HardwareDecode<Storage> decode{projection};
        double step = 0;
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 128; ++x) {
                stored(x, y) = nook::encode_depth<Storage>(double{image(x, y)}, projection);
                decoded(x, y) = static_cast<float>(decode(stored(x, y)));
                if (nook::is_surface(image(x, y), largest))
                    step =
                        std::max(step, nook::depth_step<Storage>(projection)(double{image(x, y)}));
                else REQUIRE(decoded(x, y) == 0);
            }
        const auto source = nook::hardware_depth<Storage>(stored.view(), projection);
        for (const double steps : {10.0, 230.0}) {
            const ChebyshevOptions options{.window = 15, .bias = steps * steps * step * step};
            const Image<float> ao = visibility(source, options);
            CHECK(ao == visibility(decoded, options));
            CHECK(largest_difference(ao, visibility(image, options)) <= 0.9 / steps);
        }
    };
    using enum nook::DepthEncoding;
    for (const bool orthographic : {false, true}) {
        Projection projection = base;
        projection.orthographic = orthographic;
        for (const auto encoding : {linear, negative_z, standard, reversed, opengl, logarithmic}) {
            check(nook::FloatStorage<float>{}, projection, encoding);
            check(nook::FloatStorage<double>{}, projection, encoding);
            check(nook::HalfStorage{}, projection, encoding);
            if (encoding == negative_z) continue;
            check(nook::D24Storage{}, projection, encoding);
            check(nook::D16Storage{}, projection, encoding);
        }
    }
    Projection endless = base;
    endless.far_plane = infinity;
    for (const auto encoding : {standard, reversed, opengl}) {
        check(nook::FloatStorage<float>{}, endless, encoding);
        check(nook::D24Storage{}, endless, encoding);
    }
}

TEST_CASE("a negating source reads view-space z")
{
    const Image<float> image = varied(60, 40);
    Image<float> view_z{60, 40};
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 60; ++x) view_z(x, y) = -image(x, y);
    const nook::DepthSource source{view_z.view(), [](float z) { return -z; }};
    CHECK(visibility(source, {.window = 9}) == visibility(image, {.window = 9}));
    // Without it everything is background, and the outcome says so.
    Image<float> ao{60, 40};
    const auto outcome = nook::chebyshev_ao(view_z.view(), ao.view());
    CHECK(outcome.work.background == 2400);
    CHECK(outcome.work.pixels == 2400);
    for (const float value : ao) REQUIRE(value == 1);
}

TEST_CASE("constant images are exactly 1, borders included, also without bias")
{
    for (const float depth : {0.f, 1e-45f, 1e-38f, 0.1f, 1.f, 1e5f, 1e30f, 3e38f})
        for (const int window : {1, 3, 9, 31, 101})
            for (const Border border : {Border::symmetric, Border::clip}) {
                ChebyshevOptions options{.window = window, .bias = 0, .border = border};
                for (const float value : visibility(Image<float>{35, 20, depth}, options))
                    REQUIRE(value == 1);
            }
}

TEST_CASE("any bit pattern in, visibility in [0, 1] out")
{
    std::mt19937 random{37};
    const Projection projection{.fx = 50, .fy = 50, .cx = 30, .cy = 20};
    for (int round = 0; round < 40; ++round) {
        Image<float> image{61, 43};
        for (float& value : image) value = std::bit_cast<float>(std::uint32_t(random()));
        ChebyshevOptions options{.window = 1 + 2 * int(random() % 12)};
        if (round % 2) options.bias = 0;
        if (round % 3 == 0) options.radius = std::exp2(double(random() % 200) - 100);
        if (round % 5 == 0) options.range = std::exp2(double(random() % 200) - 100);
        options.clamp = round % 7 != 0;
        for (const float value : visibility(image, options, projection)) {
            REQUIRE(value >= 0);
            REQUIRE(value <= 1);
        }
        Image<double> wide{30, 20}, ao{30, 20};
        for (double& value : wide)
            value = std::bit_cast<double>(std::uint64_t(random()) << 32 | std::uint64_t(random()));
        REQUIRE(nook::chebyshev_ao(wide.view(), ao.view(), options, projection));
        for (const double value : ao) {
            REQUIRE(value >= 0);
            REQUIRE(value <= 1);
        }
    }
}

TEST_CASE("surface pixels stay above 1/N; the plain form is scale free by powers of two")
{
    std::mt19937 random{41};
    const Image<float> image =
        make(60, 40, [&](int, int) { return 1 + double(random() % 4096) / 4096; });
    const Image<float> ao = visibility(image, plain(5));
    for (const float value : ao) REQUIRE(value >= float(1 / 25.0) * (1 - 1e-6f));
    for (const float scale : {0x1p-60f, 0x1p60f}) {
        Image<float> scaled = image;
        for (float& value : scaled) value *= scale;
        CHECK(visibility(scaled, plain(5)) == ao);
        CHECK(visibility(scaled, {.window = 5, .bias = 0.25 * double{scale} * double{scale}}) ==
              visibility(image, {.window = 5, .bias = 0.25}));
    }
}

TEST_CASE("mirrored and transposed images give mirrored and transposed results")
{
    const Image<float> image = varied(70, 50);
    const Image<float> ao = visibility(image, plain(11));
    const Image<float> mirrored =
        visibility(make(70, 50, [&](int x, int y) { return image(69 - x, y); }), plain(11));
    const Image<float> transposed =
        visibility(make(50, 70, [&](int x, int y) { return image(y, x); }), plain(11));
    for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 70; ++x) {
            REQUIRE(mirrored(69 - x, y) == doctest::Approx(ao(x, y)).epsilon(1e-6));
            REQUIRE(transposed(y, x) == doctest::Approx(ao(x, y)).epsilon(1e-6));
        }
}

TEST_CASE("the bias brightens relief below its root and removes nothing above it")
{
    const Image<float> image = varied(80, 60);
    Image<float> before = visibility(image, plain(9));
    for (const double bias : {1e-10, 1e-6, 1e-2, 1e2, 1e30}) {
        const Image<float> after = visibility(image, {.window = 9, .bias = bias});
        for (int y = 0; y < 60; ++y)
            for (int x = 0; x < 80; ++x) REQUIRE(after(x, y) >= before(x, y));
        before = after;
    }
    for (const float value : before) REQUIRE(value == 1);
}

TEST_CASE("the range check fades shade by the distance of the mean, or drops samples")
{
    // A pillar 5 in front of a wall: a halo on the wall. At x = 34 the mean lies 5 · 5 / 15 in front.
    const Image<float> image = make(60, 40, [](int x, int) { return x >= 25 && x < 32 ? 5 : 10; });
    const float halo = visibility(image, plain(15))(34, 20);
    CHECK(halo == doctest::Approx(10.0 / 15).epsilon(1e-6));
    ChebyshevOptions options = plain(15);
    // Half of the shade is left at one range, a fifth at two.
    for (const double ranges : {1.0, 2.0, 50.0}) {
        options.range = 5.0 * 5 / 15 / ranges;
        const double expected = 1 - (1 - 10.0 / 15) / (1 + ranges * ranges);
        CHECK(visibility(image, options)(34, 20) == doctest::Approx(expected).epsilon(1e-6));
        CHECK(reference(image, options)(34, 20) == doctest::Approx(expected).epsilon(1e-6));
    }
    CHECK(reference(image, options, {.sample_range = true})(34, 20) == 1);
    // A range far beyond everything changes nothing.
    options.range = 1e12;
    CHECK(visibility(image, options) == visibility(image, plain(15)));
    CHECK(reference(image, options, {.sample_range = true}) == reference(image, plain(15)));
}

TEST_CASE("samples out of range leave with their mirror images, so that slopes stay 1 beside steps")
{
    // A slope behind a wall: without pairs the samples that are left are one-sided.
    const Image<float> image =
        make(60, 40, [](int x, int) { return x < 30 ? 5 : 20 + 0.25 * (60 - x); });
    ChebyshevOptions options = plain(15);
    options.range = 3;
    CHECK(reference(image, options, {.sample_range = true})(31, 20) < 0.9f);
    const auto paired = reference(image, options, {.sample_range = true, .paired = true});
    for (int x = 30; x < 45; ++x) CHECK(paired(x, 20) == 1);
}

TEST_CASE("background is the open share of a window")
{
    // A step with j columns of the deep side, then sky: of k columns, s show sky.
    const int r = 5, k = 2 * r + 1;
    const Image<float> image = make(60, 40, [](int x, int) {
        return x < 25 ? 1.0 : x < 30 ? 3.0 : double{infinity};
    });
    for (const Image<float>& ao : {visibility(image, plain(k)), reference(image, plain(k))})
        for (int x = 25; x < 30; ++x) {
            const double sky = std::max(0, x + r - 29), nearer = std::max(0, 25 - (x - r));
            const double share = (k - sky - nearer) / (k - sky);  // of the surface, at or behind
            REQUIRE(ao(x, 20) == doctest::Approx((share * (k - sky) + sky) / k).epsilon(1e-6));
        }
}

TEST_CASE("beside background planes darken; paired samples keep them at 1")
{
    // A floor that ends against the sky halfway up.
    const Image<float> image =
        make(40, 40, [](int, int y) { return y < 20 ? double{infinity} : 64 - y; });
    for (const int r : {1, 4, 7}) {
        // The moments of rows 0 … r give P = (r + 2) / (2 (2r + 1)) → 1/4, the sky is open: → 5/8.
        const double one_sided = (r + 2) / (2.0 * (2 * r + 1)), sky = r / (2.0 * r + 1);
        CHECK(visibility(image, plain(2 * r + 1))(20, 20) ==
              doctest::Approx(one_sided + (1 - one_sided) * sky).epsilon(1e-6));
        const Image<float> ao = reference(image, plain(2 * r + 1), {.paired = true});
        for (const float value : ao) REQUIRE(value == 1);
    }
    // A floor that runs to the horizon: half the window is sky, the other half lies far in front.
    const Image<float> horizon =
        make(40, 80, [](int, int y) { return y < 40 ? double{infinity} : 1 / (y - 39.99); });
    const float edge = visibility(horizon, plain(31))(20, 40);
    CHECK(edge < 0.55f);
    CHECK(edge > 0.48f);
}

TEST_CASE("background is exactly 1, and one kind is like another")
{
    Image<float> image = varied(80, 60);
    const Image<float> ao = visibility(image, plain(13));
    for (float& value : image)
        if (!nook::is_surface(value, largest)) value = not_a_number;
    CHECK(visibility(image, plain(13)) == ao);
    for (float& value : image)
        if (!nook::is_surface(value, largest)) value = 1e30f;
    const nook::DepthSource limited{image.view(), nook::IdentityDecode{}, {0, 0x1p-23, 0}, 1e6f};
    CHECK(visibility(limited, plain(13)) == ao);
    for (int y = 0; y < 60; ++y)
        for (int x = 0; x < 80; ++x)
            if (image(x, y) == 1e30f) REQUIRE(ao(x, y) == 1);
}

TEST_CASE("images of every small size, windows larger than the image")
{
    std::mt19937 random{43};
    const Projection projection{.fx = 9, .fy = 7, .cx = 3, .cy = 3};
    for (int width = 1; width <= 9; ++width)
        for (int height = 1; height <= 9; ++height) {
            const Image<float> image =
                make(width, height, [&](int, int) { return 1 + double(random() % 5); });
            for (const int window : {1, 3, 7, 9, 1001})
                for (const Border border : {Border::symmetric, Border::clip}) {
                    const ChebyshevOptions options{.window = window, .bias = 0, .border = border};
                    REQUIRE(largest_difference(visibility(image, options),
                                               reference(image, options)) <= 1e-7);
                }
            const ChebyshevOptions world{.radius = 1, .max_window = 4095, .bias = 0};
            REQUIRE(largest_difference(visibility(image, world, projection),
                                       reference(image, world, {}, projection)) <= 1e-5);
        }
    Image<float> one{1, 1, 5.f};
    CHECK(visibility(one, {})(0, 0) == 1);
}

TEST_CASE("any number of threads gives the same bits")
{
    const Image<float> image = varied(400, 300);
    const Projection projection{.fx = 300, .fy = 300, .cx = 200, .cy = 150};
    for (const double radius : {0.0, 0.3}) {
        const ChebyshevOptions options{.window = 25, .radius = radius};
        const Image<float> expected = visibility(image, options, projection);
        for (const int workers : {2, 5, 16}) {
            nook::ThreadExecutor threads{workers};
            Image<float> ao{400, 300};
            const auto outcome =
                nook::chebyshev_ao(image.view(), ao.view(), options, projection, {}, {}, threads);
            REQUIRE(outcome);
            CHECK(ao == expected);
            CHECK(outcome.work.pixels == 120'000);
        }
    }
}

TEST_CASE("a work map leaves the rest bit-identical, writes 1 elsewhere, and counts")
{
    const Image<float> image = varied(150, 60);
    const Projection projection{.fx = 100, .fy = 100, .cx = 75, .cy = 30};
    Image<std::uint8_t> active{nook::WorkMap::groups(150), 60};
    std::mt19937 random{47};
    for (std::uint8_t& group : active) group = random() % 2;
    const nook::WorkMap map{active.view()};
    for (const double radius : {0.0, 0.3}) {
        const ChebyshevOptions options{.window = 11, .radius = radius};
        const Image<float> whole = visibility(image, options, projection);
        Image<float> masked{150, 60}, slow{150, 60};
        const auto outcome =
            nook::chebyshev_ao(image.view(), masked.view(), options, projection, map);
        const auto slow_outcome =
            nook::chebyshev_ao_reference(image.view(), slow.view(), options, {}, projection, map);
        std::uint64_t background = 0, skipped = 0;
        for (int y = 0; y < 60; ++y)
            for (int x = 0; x < 150; ++x) {
                const bool on = active(x / 16, y) != 0,
                           surface = nook::is_surface(image(x, y), largest);
                REQUIRE(masked(x, y) == (on ? whole(x, y) : 1.f));
                REQUIRE(std::fabs(masked(x, y) - slow(x, y)) <= 1e-5f);
                background += !surface;
                skipped += surface && !on;
            }
        for (const nook::Work& work : {outcome.work, slow_outcome.work}) {
            CHECK(work.background == background);
            CHECK(work.skipped == skipped);
            CHECK(work.pixels == 9000);
        }
    }
    const nook::WorkMap missing{{nullptr, 10, 60}};
    CHECK(nook::chebyshev_ao(image.view(), Image<float>{150, 60}.view(), {}, {}, missing)
              .error.code == nook::ErrorCode::null_data);
    const Image<std::uint8_t> wrong{9, 60};
    Image<float> ao{150, 60};
    CHECK(nook::chebyshev_ao(image.view(), ao.view(), {}, {}, {wrong.view()}).error.code ==
          nook::ErrorCode::bad_size);
}

TEST_CASE("views of every shape read and write their own pixels only")
{
    const int width = 45, height = 31;
    const Image<float> image = varied(width, height);
    const Image<float> expected = visibility(image, {.window = 9});
    // Depth, visibility and two strangers share one interleaved, bottom-up buffer.
    std::vector<float> store(std::size_t(width * height * 4), 0.25f);
    float* const top = store.data() + (height - 1) * width * 4;
    const nook::ImageView<float> depth{top + 1, width, height, -width * 4, 4};
    const nook::ImageView<float> ao{top + 3, width, height, -width * 4, 4};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) depth(x, y) = image(x, y);
    for (const double radius : {0.0, 1.0}) {
        const Projection projection{.fx = 20, .fy = 20, .cx = 20, .cy = 15};
        const ChebyshevOptions options{.window = 9, .radius = radius};
        REQUIRE(nook::chebyshev_ao(depth, ao, options, projection));
        const Image<float> same = visibility(image, options, projection);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) REQUIRE(ao(x, y) == same(x, y));
        REQUIRE(nook::chebyshev_ao_reference(depth, ao, options, {}, projection));
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) REQUIRE(std::fabs(ao(x, y) - same(x, y)) <= 1e-5f);
    }
    for (std::size_t i = 0; i < store.size(); i += 2) REQUIRE(store[i] == 0.25f);
}

TEST_CASE("scratch from the caller: the stated size suffices, less is an error")
{
    const Image<float> image = varied(100, 80);
    const auto view = image.view();
    const Projection projection{.fx = 100, .fy = 100, .cx = 50, .cy = 40};
    for (const double radius : {0.0, 0.3}) {
        const ChebyshevOptions options{.window = 21, .radius = radius, .max_window = 31};
        const std::size_t size = nook::chebyshev_ao_scratch_size(view, options, projection);
        std::vector<std::byte> block(size);
        Image<float> ao{100, 80, -1.f};
        const auto outcome = nook::chebyshev_ao(view, ao.view(), options, projection, {},
                                                nook::Scratch{block.data(), size - 1});
        CHECK(outcome.error.code == nook::ErrorCode::scratch_too_small);
        for (const float value : ao) REQUIRE(value == -1);
        REQUIRE(nook::chebyshev_ao(view, ao.view(), options, projection, {},
                                   nook::Scratch{block.data(), size}));
        CHECK(ao == visibility(image, options, projection));
    }
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    const Image<float> image{20, 10, 1.f};
    Image<float> ao{20, 10, -1.f};
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    const auto check = [&](const ChebyshevOptions& options, const std::string& argument,
                           const Projection& with = Projection{.fx = 10, .fy = 10}) {
        const auto outcome = nook::chebyshev_ao(image.view(), ao.view(), options, with);
        CHECK(std::string{outcome.error.argument} == argument);
        CHECK(!outcome);
        CHECK(!nook::chebyshev_ao_reference(image.view(), ao.view(), options, {}, with));
        for (const float value : ao) REQUIRE(value == -1);
    };
    for (const int window : {0, -1, 2, 32768, std::numeric_limits<int>::min()}) {
        check({.window = window}, "options.window");
        check({.max_window = window}, "options.max_window");
    }
    for (const double bad : {nan, inf, -inf, -1.0}) {
        check({.radius = bad}, "options.radius");
        check({.bias = bad}, "options.bias");
        check({.range = bad}, "options.range");
    }
    check({.range = 0}, "options.range");
    check({.radius = 1}, "projection.fx", {});
    check({.radius = 1}, "projection.fy", {.fx = 1, .fy = nan});
    Image<float> small_image{19, 10};
    CHECK(nook::chebyshev_ao(image.view(), small_image.view()).error.code ==
          nook::ErrorCode::bad_size);
    CHECK(nook::chebyshev_ao(ao.view(), ao.view()).error.code == nook::ErrorCode::overlap);
    CHECK(nook::chebyshev_ao(nook::ImageView<const float>{nullptr, 20, 10}, ao.view()).error.code ==
          nook::ErrorCode::null_data);
    CHECK(nook::chebyshev_ao_scratch_size(image.view(), {.window = 2}) == 0);
    CHECK(nook::chebyshev_ao_scratch_size(image.view(), {.radius = 1}) == 0);
    CHECK(nook::chebyshev_ao_scratch_size(image.view(), {}, {}, 0) == 0);
    const nook::DepthSource bad_step{image.view(), nook::IdentityDecode{}, {nan, 0, 0}};
    CHECK(std::string{nook::chebyshev_ao(bad_step, ao.view()).error.argument} == "depth.step");
    CHECK(std::string{
              nook::chebyshev_ao_reference(image.view(), ao.view(), {}, {.sample_range = true})
                  .error.argument} == "refinements.sample_range");
    CHECK(nook::chebyshev_ao(nook::ImageView<const float>{}, nook::ImageView<float>{}));
}
