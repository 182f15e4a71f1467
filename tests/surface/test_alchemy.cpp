#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

#include <nook/surface/alchemy.hpp>
#include <nook/surface/tap_pattern.hpp>

#include "../depth/exact.hpp"

namespace {

using exact::Rational;

/// A vector from the shaded point, whose normal is (0, 0, 1).
struct Offset {
    Rational across, up;

    [[nodiscard]] Rational square() const { return across * across + up * up; }
};

Rational alchemy(const Offset& v, const Rational& bias = 0, const Rational& epsilon = 0)
{
    return nook::alchemy_term<Rational>(v.up, v.square(), bias, epsilon);
}
Rational scalable(const Offset& v, const Rational& radius, const Rational& bias = 0,
                  const Rational& epsilon = 0)
{
    return nook::scalable_term<Rational>(v.up, v.square(), bias, epsilon, radius * radius);
}

/// Visibility at the bottom of the bowl z = ρ², samples at (i + 1/2) / s, σ = 1/10, r = 1.
Rational bowl(int samples, bool with_falloff)
{
    Rational sum = 0;
    for (int i = 0; i < samples; ++i) {
        const Rational across{2 * i + 1, 2 * samples};
        const Offset v{across, across * across};
        sum += with_falloff ? scalable(v, 1) : alchemy(v);
    }
    return nook::alchemy_visibility<Rational>(sum, Rational{with_falloff ? 5 : 2, 10}, samples);
}

/// Visibility on the crease z = g |x|, the mean over all rotations of the samples.
double crease(double slope, int samples, double radius, double intensity, bool with_falloff)
{
    constexpr int steps = 20000;
    double sum = 0;
    for (int i = 0; i < samples; ++i)
        for (int step = 0; step < steps; ++step) {
            const double angle = std::numbers::pi * ((step + 0.5) / steps - 0.5);
            const double across = radius * (i + 0.5) / samples;
            const double up = slope * across * std::cos(angle);
            const double square = across * across + up * up;
            sum += with_falloff ? nook::scalable_term(up, square, 0.0, 0.0, radius * radius)
                                : nook::alchemy_term(up, square, 0.0, 0.0);
        }
    return nook::alchemy_visibility(sum / steps, (with_falloff ? 5 : 2) * intensity, samples);
}

}  // namespace

TEST_CASE("one occluder at (3, 0, 4): 0.68 with the sum of 2011, 0.6625 with that of 2012")
{
    const Offset v{3, 4};
    CHECK(alchemy(v) == Rational{4, 25});
    CHECK(nook::alchemy_visibility<Rational>(alchemy(v), 2, 1) == Rational{68, 100});
    CHECK(scalable(v, 10) == Rational{27, 64} * Rational{4, 25});
    CHECK(nook::alchemy_visibility<Rational>(scalable(v, 10), 5, 1) == Rational{6625, 10000});
}

TEST_CASE("the bottom of a bowl has its exact fractions")
{
    CHECK(bowl(4, false) == Rational{201060629, 238602325});
    CHECK(static_cast<double>(bowl(9, false)) == doctest::Approx(0.84286892717212).epsilon(1e-13));
    CHECK(bowl(4, true) == Rational{"2935655290680323/3627572327874560"});
    CHECK(static_cast<double>(bowl(9, true)) == doctest::Approx(0.80919533117918).epsilon(1e-13));
}

TEST_CASE("a crease has its closed form, averaged over rotations")
{
    const auto closed = [](double g, int samples, double radius, double intensity) {
        double sum = 0;
        for (int i = 0; i < samples; ++i) sum += 1 / (i + 0.5);
        return 1 - 4 * intensity / (std::numbers::pi * radius) * std::asinh(g) /
                       std::sqrt(1 + g * g) * sum;
    };
    CHECK(std::fabs(closed(1, 4, 1, 0.1) - 0.73398353580923) < 1e-13);
    CHECK(std::fabs(crease(1, 4, 1, 0.1, false) - closed(1, 4, 1, 0.1)) < 1e-8);
    CHECK(std::fabs(crease(0.5, 9, 2, 0.2, false) - 0.77195792067764) < 1e-8);
    CHECK(std::fabs(crease(1, 4, 1, 0.1, true) - 0.56472293621046) < 1e-8);
    CHECK(std::fabs(crease(0.5, 9, 2, 0.2, true) - 0.56591364708478) < 1e-8);
}

TEST_CASE("lengths times L: terms times 1 / L, and with the intensity the same visibility")
{
    const Offset v{Rational{5, 7}, Rational{3, 11}};
    const Rational bias{1, 13}, epsilon{1, 100}, radius{2}, intensity{3, 5};
    for (const Rational& scale : {Rational{3}, Rational{1, 1000}, Rational{"1000000000"}}) {
        const Offset w{v.across * scale, v.up * scale};
        const Rational wide = epsilon * scale * scale;
        CHECK(alchemy(w, bias * scale, wide) * scale == alchemy(v, bias, epsilon));
        CHECK(scalable(w, radius * scale, bias * scale, wide) * scale ==
              scalable(v, radius, bias, epsilon));
        CHECK(nook::alchemy_visibility<Rational>(alchemy(w, bias * scale, wide), intensity * scale,
                                                 1) ==
              nook::alchemy_visibility<Rational>(alchemy(v, bias, epsilon), intensity, 1));
    }
}

TEST_CASE("what does not rise above the bias contributes nothing, nor does the point itself")
{
    CHECK(alchemy({0, 0}) == 0);
    CHECK(alchemy({1, 0}) == 0);
    CHECK(alchemy({1, -3}) == 0);
    CHECK(alchemy({1, 1}, 1) == 0);
    CHECK(alchemy({1, 1}, Rational{1, 2}) == Rational{1, 4});
    CHECK(nook::alchemy_term(0.0, 0.0, 0.0, 0.0) == 0.0);
    CHECK(nook::scalable_term(0.0, 0.0, 0.0, 0.0, 0.0) == 0.0);
    CHECK(scalable({0, 0}, 1) == 0);
    CHECK(scalable({3, 4}, 5) == 0);
    CHECK(scalable({3, 4}, 4) == 0);
    CHECK(scalable({3, 4}, Rational{51, 10}) > 0);
}

TEST_CASE("visibility ends at 0, and no samples leave everything open")
{
    CHECK(nook::alchemy_visibility(10.0, 1.0, 1) == 0.0);
    CHECK(nook::alchemy_visibility(0.0, 1.0, 1) == 1.0);
    CHECK(nook::alchemy_visibility(10.0, 1.0, 0) == 1.0);
    static_assert(nook::alchemy_visibility(nook::alchemy_term(4.0, 25.0, 0.0, 0.0), 2.0, 1) ==
                  1 - 2 * (4.0 / 25.0));
}

TEST_CASE("float does not leave its range at any radius")
{
    for (const float radius : {1e-17f, 1e-7f, 1.f, 1e7f, 1e17f}) {
        const float term =
            nook::scalable_term(0.4f * radius, 0.25f * radius * radius, 0.f, 0.f, radius * radius);
        CHECK(term * radius == doctest::Approx(0.75 * 0.75 * 0.75 * 0.4 / 0.25));
    }
}

TEST_CASE("a spiral of samples lies at (i + 1/2) / s of its radius, turn by turn")
{
    for (const int samples : {0, 1, 16, 64}) {
        const nook::detail::Spiral<64> spiral{samples, 7, 0.25};
        REQUIRE(spiral.count == samples);
        for (int i = 0; i < samples; ++i) {
            const double radius = (i + 0.5) / samples;
            const double angle = 2 * std::numbers::pi * (7 * radius + 0.25);
            CHECK(std::hypot(double{spiral.x[i]}, double{spiral.y[i]}) ==
                  doctest::Approx(radius).epsilon(1e-6));
            CHECK(std::fabs(double{spiral.x[i]} - radius * std::cos(angle)) < 1e-6);
            CHECK(std::fabs(double{spiral.y[i]} - radius * std::sin(angle)) < 1e-6);
        }
        for (int i = samples; i < 80; ++i) CHECK((spiral.x[i] == 0 && spiral.y[i] == 0));
    }
}

TEST_CASE("turns of rows and of pixels are as even at column and row 8000 as at 0")
{
    using nook::detail::pixel_turn;
    using nook::detail::row_turn;
    constexpr int bins = 16;
    for (const int first : {0, 8192 - 512, 32768}) {
        int rows[bins] = {}, across[bins] = {}, down[bins] = {}, alike = 0;
        for (int i = first; i < first + 512; ++i) {
            ++rows[static_cast<int>(row_turn(i, 0) * bins)];
            ++across[static_cast<int>(pixel_turn(i, 8191, 0) * bins)];
            ++down[static_cast<int>(pixel_turn(8191, i, 0) * bins)];
            alike += pixel_turn(i, i, 0) == pixel_turn(i + 1, i, 0);
            alike += row_turn(i, 0) == row_turn(i + 1, 0);
        }
        CHECK(alike == 0);
        // 32 in each on average; the golden ratio keeps closer to that than chance does.
        for (const int count : rows) CHECK(std::abs(count - 32) <= 2);
        for (const int count : across) CHECK(std::abs(count - 32) <= 24);
        for (const int count : down) CHECK(std::abs(count - 32) <= 24);
    }
    for (int i = 0; i < 1000; ++i) {
        CHECK((row_turn(i, 5) >= 0 && row_turn(i, 5) < 1));
        CHECK((pixel_turn(i, 3, 5) >= 0 && pixel_turn(i, 3, 5) < 1));
    }
    CHECK(row_turn(0, 1) != row_turn(0, 2));
    CHECK(pixel_turn(0, 0, 1) != pixel_turn(0, 0, 2));
}
