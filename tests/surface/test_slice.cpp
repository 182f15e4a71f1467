#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>

#include <nook/lanes.hpp>
#include <nook/surface/slice.hpp>

namespace {

constexpr double pi = std::numbers::pi;

/// ∫ of f over [a, b] by Simpson's rule.
template <class Function>
double integral(const Function& f, double a, double b, int pieces = 2000)
{
    double sum = f(a) + f(b);
    for (int i = 1; i < pieces; ++i) sum += f(a + (b - a) * i / pieces) * (i % 2 != 0 ? 4 : 2);
    return sum * (b - a) / pieces / 3;
}
/// ∫ cos(t − γ) |sin t| dt, cut at the kink.
double measure(double a, double b, double gamma)
{
    const auto f = [&](double t) { return std::cos(t - gamma) * std::fabs(std::sin(t)); };
    if (a < 0 && b > 0) return integral(f, a, 0) + integral(f, 0, b);
    return integral(f, a, b);
}

using Frame = nook::detail::SliceFrame<double>;
using View = nook::detail::ViewDirection<double>;

}  // namespace

TEST_CASE("the inner integral has its published values and agrees with quadrature")
{
    CHECK(std::fabs(nook::slice_visibility(-pi / 3, pi / 4, 0.3) - 0.54850375102) < 5e-12);
    CHECK(std::fabs(nook::slice_visibility(-0.2, 1.1, -0.4) - 0.249514431305) < 5e-13);
    CHECK(nook::slice_visibility(-0.5f, 0.5f, 0.2f) ==
          doctest::Approx(measure(-0.5, 0.5, 0.2)).epsilon(1e-6));
    std::mt19937 random{3};
    std::uniform_real_distribution<double> unit{0, 1};
    for (int i = 0; i < 50; ++i) {
        const double gamma = (unit(random) - 0.5) * pi;
        const double h1 = (gamma - pi / 2) * unit(random), h2 = (gamma + pi / 2) * unit(random);
        CAPTURE(gamma);
        CHECK(std::fabs(nook::slice_visibility(h1, h2, gamma) - measure(h1, h2, gamma)) < 1e-11);
    }
}

TEST_CASE("what is open, what is hidden and the distribution belong together")
{
    std::mt19937 random{5};
    std::uniform_real_distribution<double> unit{0, 1};
    using nook::detail::slice_integral;
    for (int i = 0; i < 200; ++i) {
        const double gamma = (unit(random) - 0.5) * pi, low = gamma - pi / 2, high = gamma + pi / 2;
        CAPTURE(gamma);
        CHECK(std::fabs(nook::slice_open(gamma) - nook::slice_visibility(low, high, gamma)) <
              1e-15);
        CHECK(std::fabs(slice_integral(low, gamma)) < 1e-30);
        CHECK(std::fabs(slice_integral(high, gamma) - nook::slice_open(gamma)) < 1e-15);
        const double t = low + pi * unit(random);
        CHECK(std::fabs(slice_integral(t, gamma) - measure(low, t, gamma)) < 1e-11);
        const double h1 = low * unit(random), h2 = high * unit(random);
        CHECK(std::fabs(slice_integral(h2, gamma) - slice_integral(h1, gamma) -
                        nook::slice_visibility(h1, h2, gamma)) < 1e-14);
        CHECK(std::fabs(nook::slice_hidden(high - h2, gamma) +
                        nook::slice_hidden(h1 - low, -gamma) +
                        nook::slice_visibility(h1, h2, gamma) - nook::slice_open(gamma)) < 1e-14);
        CHECK(double{slice_integral(float(t), float(gamma))} ==
              doctest::Approx(slice_integral(t, gamma)).epsilon(1e-5));
    }
    // ε³/3 sin γ + ε²/2 cos γ: nothing cancels.
    CHECK(nook::slice_hidden(1e-6, 0.7) ==
          doctest::Approx(0.5e-12 * std::cos(0.7) + 1e-18 / 3 * std::sin(0.7)).epsilon(1e-9));
}

TEST_CASE("a floor beside a wall as high as it is far: the integral over slices is the closed form")
{
    // Seen along the floor's normal: γ = 0, and the wall rises by atan(cos φ) in the slice at φ.
    const double open = integral(
        [](double phi) {
            return nook::slice_visibility(-pi / 2, pi / 2 - std::atan(std::cos(phi)), 0.0);
        },
        -pi / 2, pi / 2);
    CHECK(std::fabs(open / pi - 0.853553390593274) < 1e-12);
}

TEST_CASE("the polynomials keep their bounds, on lanes too")
{
    CHECK(nook::detail::disc_segment(1.0, 0.0) == 0);
    CHECK(nook::detail::disc_segment(1.0f, 0.0f) == 0);
    double segment = 0, open = 0, lanes = 0;
    constexpr int count = nook::detail::float_lanes;
    for (int i = 0; i <= 4000; ++i) {
        const double angle = pi * i / 4000, c = std::cos(angle), s = std::sin(angle);
        segment = std::max(segment, std::fabs(nook::detail::disc_segment(c, s) - (angle - s * c)));
        open = std::max(open, std::fabs(nook::detail::open_from_cosine(std::fabs(c)) -
                                        nook::slice_open(std::acos(std::fabs(c)))));
        using Vector = nook::detail::Lanes<float, count>;
        float values[count];
        nook::detail::store(values,
                            nook::detail::disc_segment(nook::detail::broadcast<count>(float(c)),
                                                       nook::detail::broadcast<count>(float(s))));
        static_assert(sizeof(Vector) == sizeof values);
        for (const float value : values)
            lanes = std::max(lanes, std::fabs(double{value} - (angle - s * c)));
    }
    CHECK(segment < 6e-6);
    CHECK(segment > 1e-7);
    CHECK(open < 1.1e-6);
    CHECK(lanes < 6e-6);
}

TEST_CASE(
    "slices of screen lines: their weights make the mean over them exact anywhere in the frame")
{
    std::mt19937 random{11};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (int i = 0; i < 20; ++i) {
        const double sx = 2 * unit(random), sy = 2 * unit(random);
        const View view{sx, sy};
        double n[] = {unit(random), unit(random), unit(random)};
        const double length = std::hypot(n[0], n[1], n[2]);
        for (double& part : n) part /= length;
        // A normal that faces the viewer.
        if (n[0] * view.x + n[1] * view.y + n[2] * view.z < 0)
            for (double& part : n) part = -part;
        constexpr int slices = 2000;
        double weights = 0, open = 0, cosine = 0;
        for (int k = 0; k < slices; ++k) {
            const double phi = pi * (k + 0.5) / slices;
            const Frame slice{std::cos(phi), std::sin(phi), view, n[0], n[1], n[2]};
            weights += slice.weight;
            open += slice.weight * slice.open;
            // sin² of the normal's angle averages to a half of it over even angles.
            cosine += slice.weight * slice.along_tangent * slice.along_tangent;
            const double square =
                slice.along_view * slice.along_view + slice.along_tangent * slice.along_tangent;
            const double gamma = std::atan2(slice.along_tangent, slice.along_view);
            CHECK(std::fabs(slice.open - std::sqrt(square) * nook::slice_open(gamma)) < 2e-6);
        }
        const double facing = n[0] * view.x + n[1] * view.y + n[2] * view.z;
        CHECK(std::fabs(cosine / weights - (1 - facing * facing) / 2) < 1e-9);
        // ∫ |n_p| (cos γ + γ sin γ) dφ = π for every tilt.
        CHECK(std::fabs(open / weights - 1) < 5e-6);
    }
}
