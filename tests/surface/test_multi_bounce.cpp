#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

#include <nook/surface/multi_bounce.hpp>

TEST_CASE("closed stays closed and open stays open, under any albedo")
{
    static_assert(nook::multi_bounce(0.0, 0.5) == 0);
    static_assert(nook::multi_bounce(1.0, 0.5) == 1);
    for (int i = 0; i <= 100; ++i) {
        CHECK(nook::multi_bounce(0.f, float(i) / 100) == 0);
        CHECK(nook::multi_bounce(1.f, float(i) / 100) == 1);
    }
}

TEST_CASE("the coefficients of the paper")
{
    for (const double albedo : {0.3, 0.5, 0.8})
        for (const double v : {0.2, 0.5, 0.7}) {
            const double a = 2.0404 * albedo - 0.3324, b = -4.7951 * albedo + 0.6417,
                         c = 2.7552 * albedo + 0.6903;
            CHECK(nook::multi_bounce(v, albedo) ==
                  doctest::Approx(((v * a + b) * v + c) * v).epsilon(1e-14));
        }
    CHECK(nook::multi_bounce(0.5, 0.5) == doctest::Approx(0.6810).epsilon(1e-4));
}

TEST_CASE("bounces never darken, and grow with visibility and albedo")
{
    for (int k = 0; k <= 50; ++k) {
        double before = -1;
        for (int i = 0; i <= 200; ++i) {
            const double v = i / 200.0, albedo = k / 50.0, lit = nook::multi_bounce(v, albedo);
            CHECK(lit >= v);
            CHECK(lit <= 1);
            CHECK(lit >= before);
            before = lit;
            if (k > 0) CHECK(lit >= nook::multi_bounce(v, (k - 1) / 50.0));
        }
    }
    // Black surroundings send nothing back, but for what the fit leaves.
    for (int i = 0; i <= 100; ++i)
        CHECK(std::fabs(nook::multi_bounce(i / 100.0, 0.0) - i / 100.0) < 0.06);
}

TEST_CASE("colours per channel: the brighter channel comes back brighter")
{
    const float albedo[] = {0.9f, 0.5f, 0.1f};
    float lit[3];
    for (int i = 0; i < 3; ++i) lit[i] = nook::multi_bounce(0.4f, albedo[i]);
    CHECK(lit[0] > lit[1]);
    CHECK(lit[1] > lit[2]);
    CHECK(lit[2] >= 0.4f);
}

TEST_CASE("values out of range are clamped")
{
    CHECK(nook::multi_bounce(-1.0, 0.5) == 0);
    CHECK(nook::multi_bounce(7.0, 0.5) == 1);
    CHECK(nook::multi_bounce(0.5, -3.0) == nook::multi_bounce(0.5, 0.0));
    CHECK(nook::multi_bounce(0.5, 1e30) == nook::multi_bounce(0.5, 1.0));
}
