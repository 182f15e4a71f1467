#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <ostream>
#include <random>

#include <doctest/doctest.h>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/moments.hpp>
#include <nook/owned_image.hpp>

#include "exact.hpp"

/// Images, calls and exact answers that the tests of whole depth kernels share.
namespace pictures {

using nook::Border;
using nook::Image;

template <class Distance>
inline constexpr Distance infinity = std::numeric_limits<Distance>::infinity();
template <class Distance>
inline constexpr Distance not_a_number = std::numeric_limits<Distance>::quiet_NaN();

struct Size {
    int width, height;
};

template <class Pixel, class Value>
Image<Pixel> make(Size size, const Value& value)
{
    Image<Pixel> image{size.width, size.height};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) image(x, y) = static_cast<Pixel>(value(x, y));
    return image;
}

/// Random numbers that are the same with every standard library.
class Random {
public:
    explicit Random(std::uint64_t seed) : engine_{seed} {}

    std::uint64_t bits() { return engine_(); }
    /// A whole number in [0, bound).
    int below(int bound) { return static_cast<int>(engine_() % static_cast<unsigned>(bound)); }
    /// In [0, 1).
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    /// Nearly normal, with a deviation of 1.
    double normal()
    {
        double sum = -6;
        for (int i = 0; i < 12; ++i) sum += uniform();
        return sum;
    }
    bool chance(double share) { return uniform() < share; }

private:
    std::mt19937_64 engine_;
};

/// A call of `chebyshev_ao` without its images.
struct Call {
    nook::ChebyshevOptions options{};
    nook::Projection projection{};
};
/// The plain formula in a window of so many pixels.
inline Call fixed(int window, Border border = Border::symmetric)
{
    return {{.window = window, .bias = 0, .border = border}, {}};
}
/// The same through the filter for windows that differ: under this length every window is as large
/// as it may be.
inline Call variable(int window, Border border = Border::symmetric)
{
    return {{.radius = 1e200, .max_window = window, .bias = 0, .border = border},
            {.fx = 1, .fy = 1}};
}
/// Visibility may err by that much where windows differ from pixel to pixel.
inline constexpr double variable_tolerance = 1e-5;

template <class Distance>
nook::ImageView<const Distance> input(const Image<Distance>& image)
{
    return image.view();
}
template <class Source>
const Source& input(const Source& source)
{
    return source;
}

template <class Value, class Depth, class Executor = nook::Serial>
Image<Value> visibility(const Depth& depth, const Call& call, Executor&& executor = {})
{
    const auto& image = nook::depth_source(input(depth)).image;
    Image<Value> result{image.width, image.height, Value{-1}};
    REQUIRE(nook::chebyshev_ao(input(depth), result.view(), call.options, call.projection, {},
                               nook::HeapScratch{}, executor));
    return result;
}
template <class Value, class Depth>
Image<Value> reference(const Depth& depth, const Call& call)
{
    const auto& image = nook::depth_source(input(depth)).image;
    Image<Value> result{image.width, image.height, Value{-1}};
    REQUIRE(nook::chebyshev_ao_reference(input(depth), result.view(), call.options, {},
                                         call.projection));
    return result;
}

template <class Value>
struct Moments {
    Image<std::int32_t> count;
    Image<Value> variance, deviation, mean;
};
template <class Value, class Depth, class Executor = nook::Serial>
Moments<Value> moments(const Depth& depth, int window, Border border = Border::symmetric,
                       Executor&& executor = {})
{
    const auto& image = nook::depth_source(input(depth)).image;
    const int width = image.width, height = image.height;
    Moments<Value> result{{width, height}, {width, height}, {width, height}, {width, height}};
    REQUIRE(nook::box_moments(input(depth),
                              nook::BoxMoments<Value>{.count = result.count,
                                                      .variance = result.variance,
                                                      .deviation = result.deviation,
                                                      .mean = result.mean},
                              {window, border}, nook::HeapScratch{}, executor));
    return result;
}

/// Tells 0 from −0, and no NaN from itself.
template <class T>
bool same_bits(T a, T b)
{
    return std::memcmp(&a, &b, sizeof(T)) == 0;
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
    for (const T& pixel : image)
        if (!same_bits(pixel, value)) return false;
    return true;
}

/// The largest value of a function of pixels, and where. A NaN is larger than everything.
struct Worst {
    double value = 0;
    int x = -1, y = -1;

    friend bool operator<=(const Worst& a, double limit) { return a.value <= limit; }
    friend bool operator==(const Worst& a, double expected) { return a.value == expected; }
    friend std::ostream& operator<<(std::ostream& stream, const Worst& worst)
    {
        return stream << worst.value << " at (" << worst.x << ", " << worst.y << ")";
    }
};
template <class Function>
Worst worst(Size size, const Function& function)
{
    Worst result;
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const auto value = static_cast<double>(function(x, y));
            if (value <= result.value || std::isnan(result.value)) continue;
            result = {value, x, y};
        }
    return result;
}
template <class A, class B>
Worst difference(const Image<A>& a, const Image<B>& b)
{
    REQUIRE(a.width() == b.width());
    REQUIRE(a.height() == b.height());
    return worst({a.width(), a.height()}, [&](int x, int y) {
        return std::fabs(static_cast<double>(a(x, y)) - static_cast<double>(b(x, y)));
    });
}

/// The distance between two positive numbers in units of the last place of a `Value`.
template <class Value>
double ulps(double value, double expected)
{
    const double scale = std::fabs(expected);
    int exponent = 0;
    std::frexp(scale, &exponent);
    const int lowest =
        std::numeric_limits<Value>::min_exponent - std::numeric_limits<Value>::digits;
    const int place = exponent - std::numeric_limits<Value>::digits;
    return std::fabs(value - expected) / std::ldexp(1.0, place > lowest ? place : lowest);
}

template <class Distance>
bool is_surface(Distance distance)
{
    return nook::is_surface(distance, std::numeric_limits<Distance>::max());
}

/// The samples of the fixed window of a pixel, and whether it holds another.
struct Window {
    nook::detail::Span columns, rows;

    Window(Size size, int x, int y, int window, Border border = Border::symmetric)
        : columns{nook::detail::window_span(x, window / 2, size.width, border)},
          rows{nook::detail::window_span(y, window / 2, size.height, border)}
    {}
    [[nodiscard]] int samples() const { return nook::detail::samples_in(columns, rows); }
    [[nodiscard]] bool holds(int x, int y) const
    {
        return x >= columns.first && x <= columns.last && y >= rows.first && y <= rows.last;
    }
};

/// A number as a fraction, exactly.
inline exact::Rational fraction(double value)
{
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    const exact::Rational integer{static_cast<std::int64_t>(std::ldexp(mantissa, 53))};
    const int shift = exponent - 53;
    const exact::Rational power{exact::Integer{1} << (shift < 0 ? -shift : shift)};
    return shift < 0 ? exact::Rational{integer / power} : exact::Rational{integer * power};
}

/// The moments and the visibility of one pixel without any rounding.
struct Exact {
    int count = 0, background = 0;
    exact::Rational variance = 0, deviation = 0;

    template <class Distance>
    Exact(const Image<Distance>& image, int x, int y, int window, Border border)
    {
        const Window span{{image.width(), image.height()}, x, y, window, border};
        const auto for_each = [&](const auto& f) {
            for (int j = span.rows.first; j <= span.rows.last; ++j)
                for (int i = span.columns.first; i <= span.columns.last; ++i)
                    if (is_surface(image(i, j))) f(static_cast<double>(image(i, j)));
        };
        // All samples as integers of one unit, 2^lowest.
        int lowest = std::numeric_limits<int>::max();
        for_each([&](double distance) {
            int exponent = 0;
            std::frexp(distance, &exponent);
            lowest = std::min(lowest, exponent - 53);
            ++count;
        });
        background = span.samples() - count;
        const auto integer = [&](double distance) {
            int exponent = 0;
            const double mantissa = std::frexp(distance, &exponent);
            return exact::Integer{static_cast<std::int64_t>(std::ldexp(mantissa, 53))}
                   << (exponent - 53 - lowest);
        };
        exact::Integer sum = 0, squares = 0;
        for_each([&](double distance) {
            const exact::Integer value = integer(distance);
            sum += value;
            squares += value * value;
        });
        const exact::Integer n = count;
        const auto centre = integer(static_cast<double>(image(x, y)));
        const exact::Rational unit = fraction(std::ldexp(1.0, lowest));
        variance = exact::Rational{n * squares - sum * sum, n * n} * unit * unit;
        deviation = exact::Rational{n * centre - sum, n} * unit;
    }

    [[nodiscard]] double visibility(double bias, bool clamp = true,
                                    std::optional<double> range = {}) const
    {
        using exact::Rational;
        Rational open = clamp ? nook::cantelli_upper_bound(variance, deviation, fraction(bias))
                              : nook::cantelli_unclamped(variance, deviation, fraction(bias));
        if (range) open = nook::range_checked(open, deviation, Rational{fraction(*range)});
        return static_cast<double>(
            Rational{open + (1 - open) * Rational{background, background + count}});
    }
};

}  // namespace pictures
