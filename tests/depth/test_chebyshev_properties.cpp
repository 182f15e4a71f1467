#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/moments.hpp>

#include "pictures.hpp"

/// What holds for every image: bounds, symmetries, closed forms, and exact arithmetic on random ones.
namespace {

using namespace pictures;

constexpr std::array sizes{Size{37, 23}, Size{1300, 90}, Size{700, 300}};

/// How the samples of a random image lie.
enum class Spread { uniform, normal, logarithmic, few_values, quantised, slope };
constexpr std::array spreads{Spread::uniform,    Spread::normal,    Spread::logarithmic,
                             Spread::few_values, Spread::quantised, Spread::slope};

/// `holes`: the share of background pixels.
template <class Distance>
Image<Distance> random_image(Random& random, Size size, Spread spread, double holes)
{
    return make<Distance>(size, [&](int x, int y) {
        if (random.chance(holes)) return random.chance(0.5) ? infinity<double> : 0.0;
        switch (spread) {
        case Spread::uniform: return 1e-3 + random.uniform();
        case Spread::normal: return 1000 + 1e-2 * random.normal();
        case Spread::logarithmic: return std::exp2(20 * random.uniform() - 10);
        case Spread::few_values: return 1.0 + random.below(3) * random.below(2);
        case Spread::quantised: return 200 + 0x1p-15 * random.below(5);
        case Spread::slope: return 10 + 0.7 * x + 0.3 * y + 1e-3 * random.normal();
        }
        return 1.0;
    });
}

/// Sums of whole numbers over windows, exactly: entry (x, y) holds those above and left of it.
class Sums {
public:
    template <class Function>
    Sums(Size size, const Function& value)
        : width_{size.width + 1},
          table_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(size.height + 1))
    {
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x)
                at(x + 1, y + 1) =
                    static_cast<std::int64_t>(value(x, y)) + at(x, y + 1) + at(x + 1, y) - at(x, y);
    }
    std::int64_t operator()(const Window& window) const
    {
        const int left = window.columns.first, right = window.columns.last + 1;
        const int top = window.rows.first, bottom = window.rows.last + 1;
        return at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
    }

private:
    std::int64_t& at(int x, int y) { return table_[static_cast<std::size_t>(y * width_ + x)]; }
    const std::int64_t& at(int x, int y) const
    {
        return table_[static_cast<std::size_t>(y * width_ + x)];
    }

    int width_;
    std::vector<std::int64_t> table_;
};

}  // namespace

TEST_CASE("random images agree with exact arithmetic: counts, moments and visibility")
{
    const auto check = []<class Distance>(Distance, Size size, Spread spread, double holes,
                                          int window, Random& random) {
        const Image<Distance> image = random_image<Distance>(random, size, spread, holes);
        CAPTURE(int(spread));
        CAPTURE(holes);
        CAPTURE(size.width);
        CAPTURE(size.height);
        CAPTURE(window);
        const Border border = random.chance(0.5) ? Border::clip : Border::symmetric;
        CAPTURE(int(border));
        const Moments<float> narrow = moments<float>(image, window, border);
        const Moments<double> wide = moments<double>(image, window, border);
        Call biased = fixed(window, border), unclamped = biased, ranged = biased;
        biased.options.bias = 1e-5;
        unclamped.options.clamp = false;
        ranged.options.range = 1e-2;
        const Image<float> plain = visibility<float>(image, fixed(window, border)),
                           with_bias = visibility<float>(image, biased),
                           both_sides = visibility<float>(image, unclamped);
        const Image<double> plain_wide = visibility<double>(image, fixed(window, border)),
                            in_range = visibility<double>(image, ranged),
                            differing = visibility<double>(image, variable(window, border));
        for (int i = 0; i < 12; ++i) {
            const int x = i == 0 ? 0 : i == 1 ? size.width - 1 : random.below(size.width);
            const int y = i == 0 ? 0 : i == 1 ? size.height - 1 : random.below(size.height);
            CAPTURE(x);
            CAPTURE(y);
            if (!is_surface(image(x, y))) {
                CHECK(wide.count(x, y) == 0);
                CHECK(plain_wide(x, y) == 1);
                continue;
            }
            const Exact expected{image, x, y, window, border};
            const auto variance = static_cast<double>(expected.variance);
            const auto deviation = static_cast<double>(expected.deviation);
            CHECK(narrow.count(x, y) == expected.count);
            CHECK(wide.count(x, y) == expected.count);
            CHECK(ulps<float>(double{narrow.variance(x, y)}, variance) <= 8);
            CHECK(std::fabs(wide.variance(x, y) - variance) <= 1e-13 * variance);
            CHECK(std::fabs(wide.deviation(x, y) - deviation) <= 1e-13 * std::sqrt(variance));
            CHECK(ulps<float>(double{plain(x, y)}, expected.visibility(0)) <= 8);
            CHECK(std::fabs(plain_wide(x, y) - expected.visibility(0)) <= 1e-13);
            CHECK(ulps<float>(double{with_bias(x, y)}, expected.visibility(1e-5)) <= 8);
            CHECK(ulps<float>(double{both_sides(x, y)}, expected.visibility(0, false)) <= 8);
            CHECK(std::fabs(in_range(x, y) - expected.visibility(0, true, 1e-2)) <=
                  1e-13 * (1 + std::fabs(deviation) / 1e-2));
            CHECK(std::fabs(differing(x, y) - expected.visibility(0)) <= variable_tolerance);
        }
    };
    Random random{101};
    for (const Spread spread : spreads)
        for (const double holes : {0.0, 0.1, 0.8})
            for (int i = 0; i < 8; ++i) {
                const Size size{1 + random.below(130), 1 + random.below(70)};
                const int window = 1 + 2 * random.below(i < 6 ? 12 : 40);
                if (i % 2) check(float{}, size, spread, holes, window, random);
                else check(double{}, size, spread, holes, window, random);
            }
    for (const Spread spread : spreads) {
        check(float{}, {1300, 90}, spread, 0.05, 31, random);
        check(double{}, {700, 300}, spread, 0, 63, random);
    }
}

TEST_CASE("whole numbers: P is the quotient of whole numbers, at every pixel")
{
    // P = (N S2 − S1² + N² ε) / (N S2 − S1² + N² ε + max(N d − S1, 0)²), over the surface samples.
    for (const Size size : sizes)
        for (const int window : {3, 21, 101})
            for (const Border border : {Border::symmetric, Border::clip})
                for (const std::int64_t bias : {0, 1}) {
                    Random random{102};
                    const Image<std::int32_t> whole = make<std::int32_t>(size, [&](int x, int y) {
                        if (random.chance(0.03)) return 0;
                        return 1 + (x * x + y * 5) % 300 + random.below(100);
                    });
                    const auto image = make<float>(size, [&](int x, int y) { return whole(x, y); });
                    const Sums counts{size, [&](int x, int y) { return whole(x, y) > 0; }},
                        sums{size, [&](int x, int y) { return whole(x, y); }},
                        squares{size, [&](int x, int y) { return whole(x, y) * whole(x, y); }};
                    Call call = fixed(window, border);
                    call.options.bias = static_cast<double>(bias);
                    const auto ao = visibility<double>(image, call);
                    const auto narrow = visibility<float>(image, call);
                    const auto expected = [&](int x, int y) {
                        if (whole(x, y) == 0) return 1.0;
                        const Window span{size, x, y, window, border};
                        const std::int64_t n = counts(span), sum = sums(span);
                        const std::int64_t spread = n * squares(span) - sum * sum + n * n * bias;
                        const auto behind =
                            static_cast<double>(std::max(n * whole(x, y) - sum, std::int64_t{0}));
                        if (behind == 0) return 1.0;
                        const auto s = static_cast<double>(spread);
                        const double open = s / (s + behind * behind);
                        const int all = span.samples();
                        return open + (1 - open) * double(all - n) / all;
                    };
                    CAPTURE(size.width);
                    CAPTURE(window);
                    CAPTURE(bias);
                    CHECK(worst(size, [&](int x, int y) {
                              return std::fabs(ao(x, y) - expected(x, y));
                          }) <= 1e-13);
                    CHECK(worst(size, [&](int x, int y) {
                              return ulps<float>(double{narrow(x, y)}, expected(x, y));
                          }) <= 4);
                }
}

TEST_CASE("two depths: a deep pixel gets the share of deep samples, whatever they are")
{
    const auto check = [](auto shallow, auto deep, double share, double holes) {
        using Distance = decltype(shallow);
        for (const Size size : sizes)
            for (const int window : {3, 31}) {
                Random random{103};
                // 0: background, 1: shallow, 2: deep.
                const auto kind = make<std::uint8_t>(size, [&](int, int) {
                    return random.chance(holes) ? 0 : random.chance(share) ? 2 : 1;
                });
                const auto image = make<Distance>(size, [&](int x, int y) {
                    return kind(x, y) == 2 ? deep : kind(x, y) == 1 ? shallow : Distance{0};
                });
                const Sums deep_ones{size, [&](int x, int y) { return kind(x, y) == 2; }},
                    background{size, [&](int x, int y) { return kind(x, y) == 0; }};
                const auto ao = visibility<float>(image, fixed(window));
                const auto differing = visibility<double>(image, variable(window));
                // P = p and the background is open: together the share that is not in front.
                const auto expected = [&](int x, int y) {
                    if (kind(x, y) != 2) return 1.0;
                    const Window span{size, x, y, window};
                    const std::int64_t open = deep_ones(span) + background(span);
                    // All of it where no shallow sample is there to cast shade.
                    return static_cast<double>(open) / span.samples();
                };
                CAPTURE(size.width);
                CAPTURE(window);
                CAPTURE(shallow);
                CAPTURE(deep);
                CAPTURE(holes);
                CHECK(worst(size, [&](int x, int y) {
                          return ulps<float>(double{ao(x, y)}, expected(x, y));
                      }) <= 1);
                CHECK(worst(size, [&](int x, int y) {
                          return std::fabs(differing(x, y) - expected(x, y));
                      }) <= variable_tolerance);
                // With a bias: (p + e) / (1 + e), e = ε / ((1 − p) Δ²), here without background.
                if (holes > 0) continue;
                const double gap = static_cast<double>(deep) - static_cast<double>(shallow);
                Call biased = fixed(window);
                biased.options.bias = gap * gap / 100;
                const auto brighter = visibility<double>(image, biased);
                CHECK(worst(size, [&](int x, int y) {
                          const double p = expected(x, y);
                          if (p == 1) return std::fabs(brighter(x, y) - 1);
                          const double e = 0.01 / (1 - p);
                          return std::fabs(brighter(x, y) - (p + e) / (1 + e));
                      }) <= 1e-13);
            }
    };
    for (const double holes : {0.0, 0.2}) {
        check(1.f, 2.f, 0.5, holes);
        check(0.1f, 0.3f, 0.05, holes);
        check(1000.f, std::nextafter(1000.f, 2000.f), 0.3, holes);
        check(1e-3f, 1e25f, 0.9, holes);
        check(1.0, 1 + 0x1p-52, 0.4, holes);
        check(1e-100, 1e100, 0.4, holes);
    }
}

TEST_CASE("bounds: 1/N ≤ P ≤ 1, with a bias (σ² + ε) / (N σ² + ε), and Samuelson's inequality")
{
    Random random{104};
    for (const Spread spread : spreads)
        for (const Size size : sizes)
            for (const int window : {3, 17}) {
                const Image<float> image = random_image<float>(random, size, spread, 0.05);
                const Moments<double> all = moments<double>(image, window);
                Call biased = fixed(window);
                biased.options.bias = 1e-4;
                const auto ao = visibility<double>(image, fixed(window));
                const auto brighter = visibility<double>(image, biased);
                CAPTURE(int(spread));
                CAPTURE(size.width);
                CAPTURE(window);
                CHECK(worst(size, [&](int x, int y) {
                          const double n = all.count(x, y), variance = all.variance(x, y);
                          const double deviation = all.deviation(x, y);
                          if (n == 0) return !(ao(x, y) == 1 && brighter(x, y) == 1);
                          const double slack = 1 + 1e-13;
                          const double least = (variance + 1e-4) / (n * variance + 1e-4);
                          return !(variance >= 0 && ao(x, y) <= 1 && ao(x, y) * n * slack >= 1 &&
                                   brighter(x, y) <= 1 && brighter(x, y) * slack >= least &&
                                   brighter(x, y) * slack >= ao(x, y) &&
                                   deviation * deviation <= (n - 1) * variance * slack);
                      }) == 0);
            }
}

TEST_CASE("P bounds the share of the window at or behind a pixel that lies behind its mean")
{
    Random random{105};
    for (const Spread spread : spreads) {
        const Size size{90, 60};
        const Image<float> image = random_image<float>(random, size, spread, 0.02);
        for (const int window : {3, 11}) {
            const auto ao = visibility<double>(image, fixed(window));
            const Moments<double> all = moments<double>(image, window);
            CHECK(worst(size, [&](int x, int y) {
                      const float distance = image(x, y);
                      if (!is_surface(distance) || !(all.deviation(x, y) > 0)) return ao(x, y) != 1;
                      const Window span{size, x, y, window};
                      int behind = 0;
                      for (int j = span.rows.first; j <= span.rows.last; ++j)
                          for (int i = span.columns.first; i <= span.columns.last; ++i)
                              behind += !is_surface(image(i, j)) || image(i, j) >= distance;
                      return ao(x, y) * (1 + 1e-12) < double(behind) / span.samples();
                  }) == 0);
        }
    }
}

TEST_CASE("a pixel that sinks darkens steadily from 1 towards 1/N, as (v + t²/N) / (v + t²)")
{
    // t: its distance from the mean of the other samples, whose variance about that is v, by N − 1.
    for (const int radius : {1, 4, 20}) {
        const Size size{2 * radius + 1, 2 * radius + 1};
        const int samples = size.width * size.width;
        Random random{106};
        Image<double> image = make<double>(size, [&](int, int) { return 100 + random.uniform(); });
        double mean = 0, squares = 0;
        const auto for_others = [&](const auto& f) {
            for (int y = 0; y < size.height; ++y)
                for (int x = 0; x < size.width; ++x)
                    if (x != radius || y != radius) f(image(x, y));
        };
        for_others([&](double value) { mean += (value - 100) / (samples - 1); });
        mean += 100;
        for_others([&](double value) { squares += (value - mean) * (value - mean); });
        const double v = squares / (samples - 1);
        double before = 1;
        for (const double t : {-1.0, 0.0, 1e-3, 0.01, 0.1, 0.3, 1.0, 3.0, 1e2, 1e6, 1e12}) {
            image(radius, radius) = mean + t;
            const double ao = visibility<double>(image, fixed(size.width))(radius, radius);
            CAPTURE(radius);
            CAPTURE(t);
            CHECK(ao <= before);
            if (t <= 0) CHECK(ao == doctest::Approx(1).epsilon(1e-12));
            else CHECK(std::fabs(ao - (v + t * t / samples) / (v + t * t)) <= 1e-10);
            before = ao;
        }
        CHECK(before == doctest::Approx(1.0 / samples).epsilon(1e-12));
    }
}

TEST_CASE("the order of the other samples in a window does not matter, to 4 ulps")
{
    Random random{107};
    for (const Spread spread : spreads)
        for (const int radius : {1, 3, 15, 40}) {
            const Size size{2 * radius + 1, 2 * radius + 1};
            Image<float> image = random_image<float>(random, size, spread, 0.1);
            float& centre = image(radius, radius);
            centre = *std::max_element(image.begin(), image.end(), [](float a, float b) {
                return (is_surface(a) ? a : 0.f) < (is_surface(b) ? b : 0.f);
            });
            if (!is_surface(centre)) centre = 5;
            const auto at_centre = [&] {
                return double{visibility<float>(image, fixed(size.width))(radius, radius)};
            };
            const double expected = at_centre();
            for (int round = 0; round < 5; ++round) {
                // Fisher and Yates, but for the centre.
                for (int i = size.width * size.height - 1; i > 0; --i) {
                    const int j = random.below(i + 1), middle = radius * size.width + radius;
                    if (i != middle && j != middle) std::swap(image.data()[i], image.data()[j]);
                }
                CHECK(ulps<float>(at_centre(), expected) <= 4);
            }
        }
}

TEST_CASE("an image that does not change downwards shades like one of its rows")
{
    // Every sample of a window is there as often as any other.
    Random random{108};
    const Size line{1300, 1};
    const Image<float> row = random_image<float>(random, line, Spread::uniform, 0.02);
    const Size size{1300, 90};
    const Image<float> image = make<float>(size, [&](int x, int) { return row(x, 0); });
    for (const int window : {3, 31, 127})
        for (const Border border : {Border::symmetric, Border::clip}) {
            const auto expected = visibility<double>(row, fixed(window, border));
            const auto ao = visibility<double>(image, fixed(window, border));
            CHECK(worst(size, [&](int x, int y) { return std::fabs(ao(x, y) - expected(x, 0)); }) <=
                  1e-13);
        }
}

TEST_CASE("an offset that every sample can take changes nothing, nor does a factor")
{
    Random random{109};
    const Size size{333, 90};
    const Image<float> image =
        make<float>(size, [&](int, int) { return 1 + 0x1p-10 * random.below(1024); });
    for (const int window : {3, 31})
        for (const double bias : {0.0, 1e-3}) {
            Call call = fixed(window);
            call.options.bias = bias;
            const auto expected = visibility<double>(image, call);
            for (const float offset : {-0.75f, 1.f, 77.f, 8000.f}) {
                const auto moved =
                    make<float>(size, [&](int x, int y) { return image(x, y) + offset; });
                CAPTURE(offset);
                CHECK(difference(visibility<double>(moved, call), expected) <= 1e-13);
            }
            for (const double factor : {3.0, 0.7, 1e-20, 1e20}) {
                const auto scaled =
                    make<double>(size, [&](int x, int y) { return factor * double{image(x, y)}; });
                call.options.bias = bias * factor * factor;
                CAPTURE(factor);
                CHECK(difference(visibility<double>(scaled, call), expected) <= 1e-10);
            }
        }
}

TEST_CASE("relief turned inside out is shaded on the other side: only one of the two ever darkens")
{
    Random random{110};
    for (const Size size : sizes) {
        const auto image =
            make<float>(size, [&](int, int) { return 1 + 0x1p-10 * random.below(1024); });
        const auto inside_out = make<float>(size, [&](int x, int y) { return 3 - image(x, y); });
        for (const int window : {3, 31}) {
            Call unclamped = fixed(window);
            unclamped.options.clamp = false;
            const auto front = visibility<double>(image, fixed(window)),
                       back = visibility<double>(inside_out, fixed(window)),
                       both = visibility<double>(image, unclamped),
                       both_back = visibility<double>(inside_out, unclamped);
            CHECK(difference(both, both_back) <= 1e-13);
            CHECK(worst(size, [&](int x, int y) {
                      return (front(x, y) != 1 && back(x, y) != 1) +
                             std::fabs(front(x, y) * back(x, y) - both(x, y));
                  }) <= 1e-13);
        }
    }
}

namespace {

/// Compares with the form that holds at all pixels where the window is not cut.
template <class Height, class Expected>
void check_shape(Size size, int radius, const Height& height, const Expected& expected)
{
    const auto image = make<float>(size, height);
    const auto ao = visibility<double>(image, fixed(2 * radius + 1));
    const auto differing = visibility<double>(image, variable(2 * radius + 1));
    CAPTURE(size.width);
    CAPTURE(radius);
    const auto inside = [&](int x, int y) {
        return x >= radius && y >= radius && x + radius < size.width && y + radius < size.height;
    };
    CHECK(worst(size, [&](int x, int y) {
              return inside(x, y) ? std::fabs(ao(x, y) - expected(x, y)) : 0.0;
          }) <= 1e-13);
    CHECK(worst(size, [&](int x, int y) {
              return inside(x, y) ? std::fabs(differing(x, y) - expected(x, y)) : 0.0;
          }) <= variable_tolerance);
}

}  // namespace

TEST_CASE("the corner of a deep quadrant has its share at every pixel around it")
{
    for (const Size size : sizes)
        for (const int radius : {1, 5, 10}) {
            const int left = size.width / 2 + 1, top = size.height / 2 - 1, k = 2 * radius + 1;
            check_shape(
                size, radius, [&](int x, int y) { return x >= left && y >= top ? 8 : 5; },
                [&](int x, int y) {
                    if (x < left || y < top) return 1.0;
                    const int across = radius + 1 + std::min(x - left, radius);
                    const int down = radius + 1 + std::min(y - top, radius);
                    return double(across * down) / (k * k);
                });
        }
}

TEST_CASE("a crease is 1 − 3 r (r + 1) / k² along its bottom, at any opening and anywhere")
{
    for (const Size size : sizes)
        for (const int radius : {1, 4, 11})
            for (const double slope : {0.125, 1.0, 16.0}) {
                // The bottom runs down the image; beside it the two sides give a closed form too.
                const int bottom = size.width - 2 - 2 * radius;
                const auto profile = [&](int x) { return std::abs(x - bottom); };
                check_shape(
                    size, radius, [&](int x, int) { return 30'000 - slope * profile(x); },
                    [&](int x, int) {
                        const double k = 2 * radius + 1;
                        if (x == bottom) return 1 - 3.0 * radius * (radius + 1) / (k * k);
                        double sum = 0, squares = 0;
                        for (int i = -radius; i <= radius; ++i) {
                            const double rise = profile(x + i) - profile(x);
                            sum += rise;
                            squares += rise * rise;
                        }
                        return sum > 0 ? 1 - sum * sum / (k * squares) : 1.0;
                    });
            }
}

TEST_CASE("a bowl of squares has its fractions at the bottom, and a cone nears 1/9 over a disc")
{
    const auto bottom = [](int radius, const auto& rise) {
        // The bottom at a place of no importance in a large image.
        const int x0 = 1100, y0 = 44;
        const auto image =
            make<double>({1300, 90}, [&](int x, int y) { return 1e4 - rise(x - x0, y - y0); });
        return visibility<double>(image, fixed(2 * radius + 1))(x0, y0);
    };
    const std::array radii{1, 2, 3, 4, 8, 16};
    const std::array bowls{1 / 5.0, 7 / 27.0, 3 / 11.0, 77 / 277.0, 19 / 67.0, 217 / 761.0};
    for (std::size_t i = 0; i < radii.size(); ++i) {
        CAPTURE(radii[i]);
        const double ao = bottom(radii[i], [](int x, int y) { return 0x1p-9 * (x * x + y * y); });
        CHECK(std::fabs(ao - bowls[i]) <= 1e-14);
    }
    // Background beyond the disc: what is left of the window has the moments of a disc.
    const int radius = 40;
    const Size size{2 * radius + 1, 2 * radius + 1};
    int inside = 0;
    const auto image = make<double>(size, [&](int x, int y) {
        const double reach = std::hypot(x - radius, y - radius);
        inside += reach <= radius;
        return reach <= radius ? 1e3 - reach : 0;
    });
    const double open = visibility<double>(image, fixed(size.width))(radius, radius);
    const double share = 1 - double(inside) / (size.width * size.height);
    CHECK(std::fabs((open - share) / (1 - share) - 1 / 9.0) <= 2e-3);
}

TEST_CASE("planes are open at every slope on images of many strips, also in double")
{
    for (const Size size : sizes)
        for (const int window : {3, 31, 127}) {
            const auto steep = make<float>(size, [](int x, int y) { return 9000 + 3 * x - 8 * y; });
            CHECK(all_equal(visibility<float>(steep, fixed(window)), 1.f));
            // In double the sums of these whole numbers are still exact.
            const auto far_away =
                make<double>(size, [](int x, int y) { return 0x1p30 + 0.25 * x + 512 * y; });
            CHECK(all_equal(visibility<double>(far_away, fixed(window)), 1.0));
        }
}
