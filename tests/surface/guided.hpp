#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include <doctest/doctest.h>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/image.hpp>
#include <nook/owned_image.hpp>

/// Images that the tests of the blur and of the upsampling share.
namespace guided {

using nook::Image;

inline constexpr float infinity = std::numeric_limits<float>::infinity();
inline constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

/// How far results in float may lie from those in double: a weight hangs on differences of distances,
/// in units of a hundredth of them. -ffast-math adds estimates in place of quotients.
#if defined(__FAST_MATH__)
inline constexpr double accuracy = 5e-4;
#else
inline constexpr double accuracy = 1e-4;
#endif

/// Random numbers that are the same with every standard library.
class Random {
public:
    explicit Random(std::uint64_t seed) : engine_{seed} {}

    int below(int bound) { return static_cast<int>(engine_() % static_cast<unsigned>(bound)); }
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    bool chance(double share) { return uniform() < share; }

private:
    std::mt19937_64 engine_;
};

template <class Pixel = float, class Value>
Image<Pixel> make(int width, int height, const Value& value)
{
    Image<Pixel> image{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image(x, y) = static_cast<Pixel>(value(x, y));
    return image;
}
template <class Pixel = float>
Image<Pixel> noise(int width, int height, std::uint64_t seed)
{
    Random random{seed};
    return make<Pixel>(width, height, [&](int, int) { return random.uniform(); });
}

/// A camera for small images, off centre, with pixels that are not square.
inline nook::Projection camera(int width, int height, bool orthographic = false)
{
    const double scale = orthographic ? 20 : 300;
    return {.fx = scale,
            .fy = 0.9 * scale,
            .cx = 0.52 * width,
            .cy = 0.45 * height,
            .orthographic = orthographic};
}

struct Vec {
    double x, y, z;
};
/// A unit normal that leans from the viewer by an angle, towards a heading.
inline Vec leaning(double degrees, double heading)
{
    const double tilt = degrees * 3.14159265358979 / 180;
    return {std::sin(tilt) * std::cos(heading), std::sin(tilt) * std::sin(heading), std::cos(tilt)};
}
/// Where the ray of a pixel meets the plane n · p = −distance · n.z (through the axis at that
/// distance); infinite where it does not.
inline double plane_distance(const nook::Projection& projection, const Vec& n, double distance,
                             int x, int y)
{
    const nook::ViewPoint ray = nook::view_point(projection, x + 0.5, y + 0.5, 1);
    if (projection.orthographic) return distance + (n.x * ray.x + n.y * ray.y) / n.z;
    const double along = n.x * ray.x + n.y * ray.y - n.z;
    const double result = -distance * n.z / along;
    return result > 0 ? result : std::numeric_limits<double>::infinity();
}

template <class T>
bool same_bits(const Image<T>& a, const Image<T>& b)
{
    return a.width() == b.width() && a.height() == b.height() &&
           std::memcmp(a.data(), b.data(),
                       sizeof(T) * static_cast<std::size_t>(a.width()) *
                           static_cast<std::size_t>(a.height())) == 0;
}
template <class T>
bool all_equal(const Image<T>& image, T value)
{
    return std::all_of(image.begin(), image.end(), [&](T pixel) { return pixel == value; });
}
/// The largest difference; a NaN counts as infinite.
template <class A, class B>
double difference(const Image<A>& a, const Image<B>& b)
{
    REQUIRE(a.width() == b.width());
    REQUIRE(a.height() == b.height());
    double worst = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x) {
            const double gap = std::fabs(double{a(x, y)} - double{b(x, y)});
            if (nook::detail::is_nan(gap)) return std::numeric_limits<double>::max();
            worst = std::max(worst, gap);
        }
    return worst;
}

/// Planes, steps and sky at random, with noise on some of them.
inline Image<float> random_scene(Random& random, const nook::Projection& projection, int width,
                                 int height, double sky)
{
    Vec normals[4];
    double distances[4];
    for (int i = 0; i < 4; ++i) {
        normals[i] = leaning(80 * random.uniform(), 6 * random.uniform());
        distances[i] = 5 + 0.3 * i * random.uniform() + (i == 3 ? 20 : 0);
    }
    const int block = 3 + random.below(9);
    return make(width, height, [&](int x, int y) {
        if (random.chance(sky)) return random.chance(0.5) ? double{infinity} : -1.0;
        const int which = (x / block * 7 + y / block * 5 + x * y / 97) % 4;
        const double d = plane_distance(projection, normals[which], distances[which], x, y);
        return d * (1 + (which == 2 ? 0.002 * random.uniform() : 0));
    });
}

}  // namespace guided
