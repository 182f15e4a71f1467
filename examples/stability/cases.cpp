#include <cmath>
#include <limits>

#include "random.hpp"
#include "stability.hpp"

namespace stability {

namespace {

using Image = nook::Image<float>;

template <class F>
Image draw(F depth)
{
    Image image{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(depth(x, y));
    return image;
}

template <class F>
DepthCase plain(const char* name, const char* what, const F& depth)
{
    return {{name, what}, [depth](int) {
                return DepthInput{draw(
                    [&, random = Random{}](int x, int y) mutable { return depth(random, x, y); })};
            }};
}

DepthCase noisy(const char* name, const char* what, double distance, double sigma)
{
    return plain(name, what,
                 [=](Random& random, int, int) { return distance + random.noise(sigma); });
}

/// Replaces the pixels where `is_poison(x, y)` by `poison`.
template <class P>
DepthInput poisoned(Image healthy, float poison, const P& is_poison)
{
    DepthInput input{healthy, nook::Image<std::uint8_t>{width, height}, healthy};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            if (is_poison(x, y)) {
                input.depth(x, y) = poison;
                input.poisoned(x, y) = 1;
            }
    return input;
}

Image ground(double distance, double sigma)
{
    return draw(
        [=, random = Random{}](int, int) mutable { return distance + random.noise(sigma); });
}

/// One bad pixel, far enough from two sides for large windows beside it.
DepthCase one_pixel(const char* name, const char* what, float poison, double distance, double sigma)
{
    return {{name, what}, [=](int) {
                return poisoned(ground(distance, sigma), poison,
                                [](int x, int y) { return x == 40 && y == 36; });
            }};
}

/// The upper part of the picture, down to a ragged horizon.
DepthCase sky(const char* name, const char* what, float distance)
{
    return {{name, what}, [=](int) {
                return poisoned(ground(100, 1), distance,
                                [](int x, int y) { return y < 40 - x * 7 % 5; });
            }};
}

enum class Phase { first, middle, last };

/// A spike in every window, at the same place of every block of k × k pixels. What sums about a pivot
/// at that place loses the most.
DepthCase lattice(const char* name, const char* what, Phase place)
{
    return {{name, what}, [place](int window) {
                const int phase = place == Phase::first    ? 0
                                  : place == Phase::middle ? window / 2
                                                           : window - 1;
                DepthInput input{ground(1000, 1e-2)};
                for (int y = phase; y < height; y += window)
                    for (int x = phase; x < width; x += window) {
                        input.depth(x, y) = 2000;
                        input.focus.push_back({x, y});
                    }
                return input;
            }};
}

DepthCase one_ulp()
{
    return {{"one-ulp", "depth 1000, one pixel off by one ulp"}, [](int) {
                DepthInput input{Image{width, height, 1000.f}};
                const Point odd{90, 70};
                input.depth(odd.x, odd.y) = std::nextafter(1000.f, 2000.f);
                input.focus = {odd, {odd.x - 1, odd.y}, {odd.x + 1, odd.y + 1}};
                return input;
            }};
}

}  // namespace

std::vector<DepthCase> depth_cases()
{
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    return {
        noisy("depth-1", "relief 1e-3 at depth 1", 1, 1e-3),
        noisy("depth-10", "relief 1e-3 at depth 10", 10, 1e-3),
        noisy("depth-1e3", "relief 1e-3 at depth 1e3, where an ulp is 6e-5", 1e3, 1e-3),
        plain("depth-1e5", "relief of one ulp, 0.008, up and down at depth 1e5",
              [](Random& random, int, int) { return 1e5 + random.below(3) / 128.0; }),
        plain("slope", "relief 1e-3 on a slope from 1 to 1e3",
              [](Random& random, int x, int) {
                  return 1 + 999.0 * x / (width - 1) + random.noise(1e-3);
              }),
        plain("reversed-z", "reversed-Z values from 1e-5 to 1",
              [](Random& random, int x, int) {
                  return std::pow(10, -5 + 5.0 * x / width) * (1 + random.noise(1e-2));
              }),
        plain("uniform", "uniform in (0, 1]",
              [](Random& random, int, int) { return random.unit(); }),
        plain("log-uniform", "noise log-uniform over five decades",
              [](Random& random, int, int) { return std::pow(10, 5 * random.unit()); }),
        plain("checkerboard", "depths 1 and 2 by turns",
              [](Random&, int x, int y) { return 1 + (x + y) % 2; }),
        plain("constant-0.1", "depth 0.1f everywhere", [](Random&, int, int) { return 0.1; }),
        plain("constant-1.1", "depth 1.1f everywhere", [](Random&, int, int) { return 1.1; }),
        plain("constant-1e30", "depth 1e30 everywhere", [](Random&, int, int) { return 1e30; }),
        one_ulp(),
        lattice("spikes-first", "relief 0.01 at 1000, depth 2000 first in each k x k block",
                Phase::first),
        lattice("spikes-middle", "relief 0.01 at 1000, depth 2000 amid each k x k block",
                Phase::middle),
        lattice("spikes-last", "relief 0.01 at 1000, depth 2000 last in each k x k block",
                Phase::last),
        plain("tiny", "depths around 1e-25",
              [](Random& random, int, int) { return 1e-25 * (1 + random.noise(1e-2)); }),
        plain("denormal", "denormal depths around 1e-42",
              [](Random& random, int, int) { return std::ldexp(700 + random.below(30), -149); }),
        noisy("depth-3e38", "relief of 1 % just below the largest float", 3e38, 3e36),
        sky("sky-1e30", "sky of 1e30, not masked, above depth 100", 1e30f),
        sky("sky-infinity", "sky of infinity above depth 100", infinity),
        one_pixel("spike", "one pixel of 1e30 in relief 1e-6 at depth 1", 1e30f, 1, 1e-6),
        one_pixel("nan", "one NaN at depth 10", nan, 10, 1),
        one_pixel("infinity", "one infinity at depth 10", infinity, 10, 1),
        one_pixel("minus-infinity", "one negative infinity at depth 10", -infinity, 10, 1),
    };
}

}  // namespace stability
