#include <doctest/doctest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <nook/depth/cantelli.hpp>

namespace {

using Rational = boost::multiprecision::cpp_rational;

struct Moments {
    Rational mean, variance;
};
Moments moments(const std::vector<Rational>& window)
{
    Rational sum = 0, squares = 0;
    for (const Rational& sample : window) sum += sample;
    const Rational mean = sum / window.size();
    for (const Rational& sample : window) squares += (sample - mean) * (sample - mean);
    return {mean, squares / window.size()};
}
Rational bound(const std::vector<Rational>& window, const Rational& distance,
               const Rational& bias = 0)
{
    const Moments m = moments(window);
    return nook::cantelli_upper_bound<Rational>(m.variance, distance - m.mean, bias);
}
/// `deep` samples at 2, the rest of nine at 1.
std::vector<Rational> two_depths(int deep, Rational shallow = 1, Rational far_side = 2)
{
    std::vector<Rational> window(9, shallow);
    for (int i = 0; i < deep; ++i) window[static_cast<std::size_t>(i)] = far_side;
    return window;
}
std::vector<Rational> random_window(std::mt19937& random, std::size_t size)
{
    std::vector<Rational> window;
    for (std::size_t i = 0; i < size; ++i)
        window.push_back(Rational{int(random() % 2000) - 1000} / Rational{1 + int(random() % 50)});
    return window;
}

}  // namespace

TEST_CASE("two depths: the deep side gets its own share, exactly, at any distance apart")
{
    for (int deep = 1; deep <= 8; ++deep) {
        CHECK(bound(two_depths(deep), 2) == Rational(deep, 9));
        CHECK(bound(two_depths(deep), 1) == 1);
        CHECK(bound(two_depths(deep, 1, 1'000'000'000), 1'000'000'000) == Rational(deep, 9));
        CHECK(bound(two_depths(deep, 1, Rational(1'000'001, 1'000'000)),
                    Rational(1'000'001, 1'000'000)) == Rational(deep, 9));
    }
}

TEST_CASE("two depths with a bias of 1/100 give the nine-sample fractions")
{
    const Rational expected[] = {{881, 7281},  {1481, 6381}, {209, 609},   {2081, 4581},
                                 {2081, 3681}, {209, 309},   {1481, 1881}, {881, 981}};
    for (int deep = 1; deep <= 8; ++deep) {
        CHECK(bound(two_depths(deep), 2, Rational(1, 100)) == expected[deep - 1]);
        // P = (p + e) / (1 + e) with e = ε / ((1 − p) Δ²)
        const Rational p(deep, 9), e = Rational(1, 100) / (1 - p);
        CHECK(bound(two_depths(deep), 2, Rational(1, 100)) == (p + e) / (1 + e));
    }
}

TEST_CASE("the range check leaves half of the shade at its range, a fifth at twice that")
{
    const Rational open(1, 9), range(7, 3);
    CHECK(nook::range_checked<Rational>(open, 0, range) == open);
    CHECK(nook::range_checked<Rational>(open, range, range) == 1 - Rational(8, 9) / 2);
    CHECK(nook::range_checked<Rational>(open, -range, range) == 1 - Rational(8, 9) / 2);
    CHECK(nook::range_checked<Rational>(open, 2 * range, range) == 1 - Rational(8, 9) / 5);
    CHECK(nook::range_checked<Rational>(1, 2 * range, range) == 1);
}

TEST_CASE("a distance between two depths gives the nine-sample fractions")
{
    const Rational expected[] = {{32, 81}, {56, 81}, {8, 9}, {80, 81}, 1, 1, 1, 1};
    for (int deep = 1; deep <= 8; ++deep)
        CHECK(bound(two_depths(deep), Rational(3, 2)) == expected[deep - 1]);
}

TEST_CASE("the paper's two-depth algebra, with its weights and signs put right")
{
    // Chan & Im print a denominator that gives 3/28 and 1/28 for these.
    CHECK(nook::cantelli_unclamped<Rational>(Rational(3, 16), 1 - Rational(7, 4), 0) ==
          Rational(1, 4));
    CHECK(nook::cantelli_unclamped<Rational>(Rational(3, 16), 2 - Rational(7, 4), 0) ==
          Rational(3, 4));
}

TEST_CASE("without relief: nothing to darken, or all of it in front")
{
    CHECK(nook::cantelli_upper_bound(0.0, 0.0, 0.0) == 1);
    CHECK(nook::cantelli_upper_bound(0.0, -1.0, 0.0) == 1);
    CHECK(nook::cantelli_upper_bound(0.0, 1.0, 0.0) == 0);
    CHECK(nook::cantelli_upper_bound(0.0, 1.0, 1.0) == 0.5);
    CHECK(nook::cantelli_unclamped(0.0, 0.0, 0.0) == 1);
    CHECK(nook::cantelli_unclamped(0.0, -1.0, 0.0) == 0);
    SUBCASE("a deviation whose square underflows counts as none")
    {
        CHECK(nook::cantelli_upper_bound(0.0, 1e-200, 0.0) == 1);
        CHECK(nook::cantelli_upper_bound(0.f, 1e-30f, 0.f) == 1);
    }
}

TEST_CASE("continuous moments: crease 1/4, bowl 2/7, cone 1/9")
{
    // Depths −|s| over a square, −ρ² over a square, −ρ over a disc, seen from the deepest point.
    CHECK(nook::cantelli_upper_bound<Rational>({1, 12}, {1, 2}, 0) == Rational(1, 4));
    CHECK(nook::cantelli_upper_bound<Rational>({8, 45}, {2, 3}, 0) == Rational(2, 7));
    CHECK(nook::cantelli_upper_bound<Rational>({1, 18}, {2, 3}, 0) == Rational(1, 9));
}

TEST_CASE("on the shaded side the bound is σ² over the mean square difference, in every form")
{
    std::mt19937 random{1};
    for (int i = 0; i < 300; ++i) {
        const auto window = random_window(random, 1 + random() % 25);
        const Rational d = window[random() % window.size()];
        const Moments m = moments(window);
        Rational difference_squares = 0, m2 = 0;
        for (const Rational& x : window) {
            difference_squares += (x - d) * (x - d);
            m2 += x * x;
        }
        const Rational p = bound(window, d);
        if (d > m.mean) CHECK(p == m.variance * window.size() / difference_squares);
        else CHECK(p == 1);
        CHECK(p ==
              nook::cantelli_upper_bound_of_moments<Rational>(d, m.mean, m2 / window.size(), 0));
    }
}

TEST_CASE("the bound lies above the share at or behind the pixel, and above 1/N")
{
    std::mt19937 random{2};
    for (int i = 0; i < 300; ++i) {
        const auto window = random_window(random, 1 + random() % 25);
        const Rational d = window[random() % window.size()];
        int behind = 0;
        for (const Rational& x : window) behind += x >= d;
        const Rational p = bound(window, d), size = window.size();
        CHECK(p <= 1);
        CHECK(p >= Rational(behind) / size);
        CHECK(p >= 1 / size);
        // With a bias: P ≥ (σ² + ε) / (N σ² + ε).
        const Moments m = moments(window);
        CHECK(bound(window, d, 3) >= (m.variance + 3) / (m.variance * size + 3));
        // Not monotone in anything but these: nearer, more relief and more bias brighten.
        CHECK(bound(window, d - 1) >= p);
        CHECK(bound(window, d, 1) >= p);
        CHECK(nook::cantelli_upper_bound<Rational>(m.variance + 1, d - m.mean, 0) >= p);
    }
}

TEST_CASE("affine maps with a positive factor, replication and order leave the bound alone")
{
    std::mt19937 random{3};
    for (int i = 0; i < 100; ++i) {
        auto window = random_window(random, 1 + random() % 25);
        const Rational d = window.front(), bias(1, 7), a(5, 3), b(-11);
        const Rational p = bound(window, d, bias);
        auto mapped = window;
        for (Rational& x : mapped) x = a * x + b;
        CHECK(bound(mapped, a * d + b, a * a * bias) == p);
        auto twice = window;
        twice.insert(twice.end(), window.begin(), window.end());
        CHECK(bound(twice, d, bias) == p);
        std::shuffle(window.begin(), window.end(), random);
        CHECK(bound(window, d, bias) == p);
        // A negative factor swaps the sides: the clamp falls on the other one.
        const Moments m = moments(window);
        CHECK(
            (d < m.mean ? nook::cantelli_upper_bound<Rational>(m.variance, m.mean - d, bias) : 1) ==
            nook::cantelli_upper_bound<Rational>(m.variance, -(d - m.mean), bias));
    }
}

TEST_CASE("in floating point the bound stays in [0, 1], and scales by powers of two bit for bit")
{
    std::mt19937 random{4};
    std::uniform_real_distribution<double> exponent{-60, 60};
    for (int i = 0; i < 10'000; ++i) {
        const double variance = std::exp2(exponent(random)),
                     deviation = std::exp2(exponent(random)),
                     bias = random() % 2 ? 0 : std::exp2(exponent(random));
        const double p = nook::cantelli_upper_bound(variance, deviation, bias);
        REQUIRE(p >= 0);
        REQUIRE(p <= 1);
        REQUIRE(nook::cantelli_upper_bound(variance * 0x1p40, deviation * 0x1p20, bias * 0x1p40) ==
                p);
        REQUIRE(nook::cantelli_upper_bound(variance, deviation, 1e30 * deviation * deviation) >
                1 - 1e-15);
    }
}

TEST_CASE("it is a constant expression")
{
    static_assert(nook::cantelli_upper_bound(3.f, 1.f, 0.f) == 0.75f);
    static_assert(nook::cantelli_unclamped(3.0, -1.0, 0.0) == 0.75);
}
