#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <boost/multiprecision/cpp_int.hpp>

#include <nook/image.hpp>

#include "stability.hpp"

/// The moments of a window in exact integers: a float is a whole number times a power of two.
namespace stability::exact {

using Integer = boost::multiprecision::cpp_int;

/// high + low, good to about 100 bits: what a double is measured against.
struct Wide {
    double high = 0, low = 0;
};

/// numerator / denominator · 2^exponent; numerator ≥ 0, denominator > 0.
[[nodiscard]] inline Wide quotient(const Integer& numerator, const Integer& denominator,
                                   int exponent = 0)
{
    if (numerator == 0) return {};
    const int shift = 160 + int(msb(denominator)) - int(msb(numerator));
    Integer whole = numerator;
    if (shift > 0) whole = (whole << shift) / denominator;
    else whole /= denominator << -shift;
    const double high = static_cast<double>(whole);
    const double low = static_cast<double>(Integer{whole - Integer{high}});
    return {std::ldexp(high, exponent - shift), std::ldexp(low, exponent - shift)};
}

/// What a filter should say about one pixel.
struct Window {
    Wide variance;    ///< mean squared distance from the mean
    Wide visibility;  ///< Cantelli's bound without bias: 1 − D² / (N Q) behind the mean, else 1
};

/// The window of that radius around a pixel. It lies inside the image and holds finite distances > 0.
[[nodiscard]] inline Window window(nook::ImageView<const float> depth, int x, int y, int radius)
{
    struct Sample {
        int mantissa, exponent;
    };
    std::vector<Sample> samples;
    int unit = std::numeric_limits<int>::max();
    const auto split = [](float value) {
        int exponent = 0;
        const float fraction = std::frexp(value, &exponent);
        return Sample{static_cast<int>(std::ldexp(fraction, 24)), exponent - 24};
    };
    for (int j = y - radius; j <= y + radius; ++j)
        for (int i = x - radius; i <= x + radius; ++i) {
            samples.push_back(split(depth(i, j)));
            unit = std::min(unit, samples.back().exponent);
        }
    const auto whole = [unit](const Sample& sample) {
        return Integer{sample.mantissa} << (sample.exponent - unit);
    };
    // D = Σ (z − centre), Q = Σ (z − centre)².
    const Integer centre = whole(split(depth(x, y)));
    Integer sum = 0, squares = 0, difference;
    for (const Sample& sample : samples) {
        difference = whole(sample) - centre;
        sum += difference;
        squares += difference * difference;
    }
    const Integer count = samples.size();
    const Integer spread = count * squares - sum * sum;
    Window result;
    result.variance = quotient(spread, count * count, 2 * unit);
    result.visibility = sum < 0 ? quotient(spread, count * squares) : Wide{1, 0};
    return result;
}

/// |value − exact|.
[[nodiscard]] inline double distance(double value, const Wide& exact)
{
    return std::fabs((value - exact.high) - exact.low);
}

/// The spacing of the type's numbers from `value` ≥ 0 up.
[[nodiscard]] inline double ulp(double value, Precision precision)
{
    const bool single = precision == Precision::binary32;
    const int digits = single ? 24 : 53, lowest = single ? -126 : -1022;
    const int exponent = value > 0 ? std::max(std::ilogb(value), lowest) : lowest;
    return std::ldexp(1.0, exponent - digits + 1);
}

/// True for 0 and for what lies between the type's smallest normal number and its largest.
[[nodiscard]] inline bool can_hold(double value, Precision precision)
{
    if (precision == Precision::binary64) return true;
    using Limits = std::numeric_limits<float>;
    return value == 0 || (value >= double{Limits::min()} && value <= double{Limits::max()});
}

}  // namespace stability::exact
