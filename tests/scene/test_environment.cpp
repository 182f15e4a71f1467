#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/scene/environment.hpp>
#include <nook/scene/viewpoints.hpp>
#include <nook/thread_executor.hpp>

namespace {

constexpr double pi = std::numbers::pi;

/// An interleaved picture of the surroundings.
struct Picture {
    int width, height;
    std::vector<float> data = std::vector<float>(3 * std::size_t(width) * std::size_t(height));

    float* pixel(int x, int y)
    {
        return data.data() + 3 * (std::size_t(y) * std::size_t(width) + std::size_t(x));
    }
    template <class Colour>
    Picture& fill(const Colour& colour)
    {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const glm::dvec3 c = colour(x, y);
                for (int k = 0; k < 3; ++k) pixel(x, y)[k] = static_cast<float>(c[k]);
            }
        return *this;
    }
    [[nodiscard]] nook::Environment view() const
    {
        return nook::Environment::interleaved(data.data(), width, height, 3 * width);
    }
    /// Where the centre of a pixel lies, as documented.
    [[nodiscard]] glm::dvec3 direction(double x, double y) const
    {
        const double lon = 2 * pi * (x + 0.5) / width - pi, lat = pi / 2 - pi * (y + 0.5) / height;
        return {std::cos(lat) * std::sin(lon), std::sin(lat), -std::cos(lat) * std::cos(lon)};
    }
};

glm::dvec3 look(const Picture& picture, const glm::dvec3& direction, double cap = 0,
                double exposure = 1)
{
    float colour[3] = {-1, -1, -1};
    REQUIRE(nook::environment_colours(picture.view(), &direction, 1, colour,
                                      {.cap = cap, .exposure = exposure}));
    return {colour[0], colour[1], colour[2]};
}

std::vector<glm::dvec3> directions(int level = 2)
{
    std::vector<glm::dvec3> result(nook::icosphere_size(level));
    nook::icosphere(level, result.data());
    for (const glm::dvec3& axis : {glm::dvec3{1, 0, 0}, glm::dvec3{0, 1, 0}, glm::dvec3{0, 0, 1}}) {
        result.push_back(axis);
        result.push_back(-3.0 * axis);
    }
    return result;
}

Picture noise(int width, int height)
{
    return Picture{width, height}.fill([](int x, int y) {
        return glm::dvec3{(x * 37 + y * 101) % 83 / 82.0, (x * 53 + y * 29) % 71 / 70.0, 0.25};
    });
}

}  // namespace

TEST_CASE("a constant picture gives its colour, exactly, with any cap")
{
    for (const auto& [width, height] :
         {std::pair{1, 1}, std::pair{1, 7}, std::pair{5, 2}, std::pair{64, 33}}) {
        const glm::dvec3 colour{0.1f, 0.7f, 1.0};
        const Picture picture = Picture{width, height}.fill([&](int, int) { return colour; });
        for (const double cap : {0.0, 1e-9, 0.1, 0.5, pi / 2, 3.0, pi})
            for (const glm::dvec3& d : directions(1)) CHECK(look(picture, d, cap) == colour);
    }
}

TEST_CASE("a cap of radius 0 finds each pixel at its place, on the side that is documented")
{
    const Picture picture = noise(24, 13);
    for (int y = 0; y < 13; ++y)
        for (int x = 0; x < 24; ++x) {
            const glm::dvec3 found = look(picture, picture.direction(x, y) * 3.0);
            Picture copy = picture;
            for (int k = 0; k < 3; ++k)
                CHECK(std::fabs(found[k] - double{copy.pixel(x, y)[k]}) < 1e-6);
        }
    // Left to right: +z, -x, -z, +x, +z; top: +y.
    const Picture sides = Picture{4, 3}.fill([](int x, int y) {
        return glm::dvec3{x / 3.0, y / 2.0, 0};
    });
    CHECK(look(sides, {-1, 0, 0}).x == doctest::Approx(0.5 / 3));
    CHECK(look(sides, {0, 0, -1}).x == doctest::Approx(1.5 / 3));
    CHECK(look(sides, {1, 0, 0}).x == doctest::Approx(2.5 / 3));
    // Across the seam, between the last and the first column.
    CHECK(look(sides, {0, 0, 1}).x == doctest::Approx(0.5));
    CHECK(look(sides, {1e-9, 0, 1}).x == doctest::Approx(0.5));
    CHECK(look(sides, {-1e-9, 0, 1}).x == doctest::Approx(0.5));
    CHECK(look(sides, {0, 1, 0}).y == 0);
    CHECK(look(sides, {0, -1, 0}).y == 1);
    CHECK(look(sides, {0.3, 0, -1}).y == doctest::Approx(0.5));
}

TEST_CASE("the poles are the means of their rows, from every side")
{
    const Picture picture = noise(17, 6);
    Picture copy = picture;
    for (const bool top : {true, false}) {
        double mean = 0;
        for (int x = 0; x < 17; ++x) mean += double{copy.pixel(x, top ? 0 : 5)[0]} / 17;
        const double y = top ? 1 : -1;
        CHECK(look(picture, {0, y, 0}).x == doctest::Approx(mean));
        for (int i = 0; i < 8; ++i)
            CHECK(look(picture, {1e-7 * std::cos(i), y, 1e-7 * std::sin(i)}).x ==
                  doctest::Approx(mean));
        // Half way from the middle of the row to the pole.
        const glm::dvec3 place = picture.direction(3, top ? -0.25 : 5.25);
        CHECK(look(picture, place).x ==
              doctest::Approx((mean + double{copy.pixel(3, top ? 0 : 5)[0]}) / 2));
    }
}

TEST_CASE("a cap takes the pixels within its angle, by solid angle")
{
    const Picture picture = noise(48, 31);
    Picture copy = picture;
    for (const double cap : {0.12, 0.4, 1.1, 2.2, 3.1})
        for (const glm::dvec3& d : directions(1)) {
            double sum[3] = {}, weights = 0, close = 1;
            for (int y = 0; y < 31; ++y)
                for (int x = 0; x < 48; ++x) {
                    const double cosine = glm::dot(picture.direction(x, y), glm::normalize(d));
                    close = std::min(close, std::fabs(cosine - std::cos(cap)));
                    if (cosine < std::cos(cap)) continue;
                    const double weight = std::cos(pi / 2 - pi * (y + 0.5) / 31);
                    for (int k = 0; k < 3; ++k) sum[k] += weight * double{copy.pixel(x, y)[k]};
                    weights += weight;
                }
            // A pixel on the edge of the cap may count or not.
            if (close < 1e-9) continue;
            REQUIRE(weights > 0);
            const glm::dvec3 found = look(picture, d, cap);
            for (int k = 0; k < 3; ++k) CHECK(found[k] == doctest::Approx(sum[k] / weights));
        }
}

TEST_CASE("a picture half red and half blue lights the halves")
{
    const Picture picture = Picture{64, 32}.fill([](int x, int) {
        return x < 32 ? glm::dvec3{1, 0, 0} : glm::dvec3{0, 0, 1};
    });
    CHECK(look(picture, {-1, 0.2, 0.3}, 0.2) == glm::dvec3{1, 0, 0});
    CHECK(look(picture, {1, -0.2, 0.1}, 0.2) == glm::dvec3{0, 0, 1});
    for (const glm::dvec3& d :
         {glm::dvec3{0, 1, 0}, glm::dvec3{0, 0, 1}, glm::dvec3{0, -1, 0}, glm::dvec3{0, 0.3, -1}})
        for (const double cap : {0.3, 1.0, pi}) {
            const glm::dvec3 found = look(picture, d, cap);
            CHECK(found.x == doctest::Approx(0.5));
            CHECK(found.y == 0);
            CHECK(found.z == doctest::Approx(0.5));
        }
    // Half of the sky in reach, by solid angle: the whole sphere seen from anywhere.
    CHECK(look(picture, {1, 0, 0}, pi).x == doctest::Approx(0.5));
    // Upper half white: a hemisphere about the pole, and a sphere.
    const Picture sky = Picture{40, 20}.fill([](int, int y) { return glm::dvec3(y < 10 ? 1 : 0); });
    CHECK(look(sky, {0, 1, 0}, pi / 2).x == 1);
    CHECK(look(sky, {0, -1, 0}, pi / 2 - 1e-6).x == 0);
    CHECK(look(sky, {0.6, 0.8, 0}, pi).x == doctest::Approx(0.5));
}

TEST_CASE("pixels that are no brightness count as black, and brightness ends at 1")
{
    Picture picture = Picture{8, 4}.fill([](int, int) { return glm::dvec3(0.5); });
    picture.pixel(0, 1)[0] = std::numeric_limits<float>::quiet_NaN();
    picture.pixel(1, 1)[0] = std::numeric_limits<float>::infinity();
    picture.pixel(2, 1)[0] = -40;
    Picture black = picture;
    for (int x = 0; x < 3; ++x) black.pixel(x, 1)[0] = 0;
    for (const double cap : {0.0, 0.4, pi})
        for (const glm::dvec3& d : directions(1)) {
            const glm::dvec3 found = look(picture, d, cap);
            CHECK(found == look(black, d, cap));
            CHECK(found.y == 0.5);
        }
    CHECK(look(picture, picture.direction(1, 1)).x < 1e-6);
    picture.pixel(5, 1)[1] = 3e38f;
    CHECK(look(picture, picture.direction(5, 1), pi, 1e300).y == 1);
    CHECK(look(picture, {0, 0, 1}, 0, 0.5).z == 0.25);
    CHECK(look(picture, {0, 0, 1}, 0, 0).y == 0);
}

TEST_CASE("strides and planes of a picture do not matter")
{
    const Picture picture = noise(12, 7);
    Picture copy = picture;
    std::vector<float> planes(3 * 12 * 7);
    for (int y = 0; y < 7; ++y)
        for (int x = 0; x < 12; ++x)
            for (int k = 0; k < 3; ++k)
                planes[std::size_t(k * 84 + (6 - y) * 12 + x)] = copy.pixel(x, y)[k];
    const auto plane = [&](int k) {
        return nook::ImageView<const float>{planes.data() + k * 84 + 72, 12, 7, -12};
    };
    const auto towards = directions();
    std::vector<float> one(3 * towards.size()), other = one;
    REQUIRE(nook::environment_colours(picture.view(), towards.data(), towards.size(), one.data()));
    REQUIRE(nook::environment_colours({plane(0), plane(1), plane(2)}, towards.data(),
                                      towards.size(), other.data()));
    CHECK(one == other);
}

TEST_CASE("colours of the surroundings have the same bits on any number of threads")
{
    const Picture picture = noise(100, 50);
    const auto towards = directions(3);
    std::vector<float> one(3 * towards.size()), other = one;
    REQUIRE(nook::environment_colours(picture.view(), towards.data(), towards.size(), one.data(),
                                      {}, nook::ThreadExecutor{1}));
    REQUIRE(nook::environment_colours(picture.view(), towards.data(), towards.size(), other.data(),
                                      {}, nook::ThreadExecutor{3}));
    CHECK(one == other);
}

TEST_CASE("bad surroundings and directions are refused, and none is black")
{
    const Picture picture = noise(4, 2);
    glm::dvec3 d[2] = {{0, 0, 1}, {1, 0, 0}};
    float out[6] = {7, 7, 7, 7, 7, 7};
    const auto code = [&](const nook::Environment& image, const nook::EnvironmentOptions& options) {
        const nook::Error error = nook::environment_colours(image, d, 2, out, options).error;
        CHECK(std::all_of(out, out + 6, [](float c) { return c == 7; }));
        return error.code;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double cap : {-0.1, 3.2, nan})
        CHECK(code(picture.view(), {.cap = cap}) == nook::ErrorCode::bad_value);
    for (const double exposure : {-1.0, nan, std::numeric_limits<double>::infinity()})
        CHECK(code(picture.view(), {.exposure = exposure}) == nook::ErrorCode::bad_value);
    nook::Environment odd = picture.view();
    odd.z.width = 3;
    CHECK(code(odd, {}) == nook::ErrorCode::bad_size);
    odd.z = {nullptr, 4, 2};
    CHECK(code(odd, {}) == nook::ErrorCode::null_data);
    for (const glm::dvec3& bad : {glm::dvec3{0, 0, 0}, glm::dvec3{0, nan, 1}}) {
        d[1] = bad;
        CHECK(code(picture.view(), {}) == nook::ErrorCode::bad_value);
    }
    d[1] = {1e-300, 1e-308, 0};
    CHECK(nook::environment_colours(picture.view(), nullptr, 2, out).error.code ==
          nook::ErrorCode::null_data);
    CHECK(nook::environment_colours(picture.view(), d, 2, nullptr).error.code ==
          nook::ErrorCode::null_data);
    CHECK(nook::environment_colours(picture.view(), nullptr, 0, nullptr));
    REQUIRE(nook::environment_colours({}, d, 2, out));
    CHECK(std::all_of(out, out + 6, [](float c) { return c == 0; }));
}

TEST_CASE("palettes stay in range and begin with their hue")
{
    using nook::Palette;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    auto towards = directions(3);
    for (const glm::dvec3& odd : {glm::dvec3{0, 0, 0}, glm::dvec3{nan, 0, 1},
                                  glm::dvec3{1e-300, 0, 0}, glm::dvec3{1e300, -1e300, 0}})
        towards.push_back(odd);
    for (const Palette palette :
         {Palette::single_hue, Palette::complementary, Palette::analogous, Palette::triad})
        for (const double hue : {0.0, 0.1, 0.999, 1.0, -2.3, 1e9, nan})
            for (const glm::dvec3& d : towards) {
                const glm::vec3 colour = nook::palette_colour(palette, hue, d);
                bool fine = true;
                for (int k = 0; k < 3; ++k) fine = fine && colour[k] >= 0 && colour[k] <= 1;
                CHECK(fine);
            }
    const auto near_to = [](const glm::vec3& one, const glm::vec3& other) {
        return glm::length(one - other) < 1e-6f;
    };
    const glm::dvec3 up{0, 2, 0}, down{0, -1, 0}, side{0, 0, -1};
    CHECK(near_to(nook::palette_colour(Palette::complementary, 0, up), {1, 0.1f, 0.1f}));
    CHECK(near_to(nook::palette_colour(Palette::complementary, 0, down), {0.1f, 1, 1}));
    CHECK(near_to(nook::palette_colour(Palette::complementary, 0, side), {0.55f, 0.55f, 0.55f}));
    CHECK(near_to(nook::palette_colour(Palette::complementary, 1.0 / 3, up), {0.1f, 1, 0.1f}));
    // A twelfth of the circle from red: orange above, and magenta-red below.
    CHECK(near_to(nook::palette_colour(Palette::analogous, 0, up), {1, 0.6f, 0.2f}));
    CHECK(near_to(nook::palette_colour(Palette::analogous, 0, down), {1, 0.2f, 0.6f}));
    CHECK(
        near_to(nook::palette_colour(Palette::single_hue, 2.0 / 3, down), {0.015f, 0.015f, 0.15f}));
    CHECK(near_to(nook::palette_colour(Palette::single_hue, 2.0 / 3, up), {0.7f, 0.7f, 1}));
    CHECK(near_to(nook::palette_colour(Palette::triad, 0, up), {0.4f, 0.4f, 0.4f}));
    // The three sides of the triad: the same picture, turned, with its channels swapped.
    const glm::vec3 first = nook::palette_colour(Palette::triad, 0, side);
    const glm::vec3 second =
        nook::palette_colour(Palette::triad, 0, {std::sin(2 * pi / 3), 0, -std::cos(2 * pi / 3)});
    CHECK(first.x > 0.9f);
    CHECK(first.y < 0.2f);
    CHECK(near_to(second, {first.z, first.x, first.y}));
}
