#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>

#include <nook/depth/window.hpp>
#include <nook/image.hpp>

/// The moments of a window in exact arithmetic: every float is an integer times 2⁻¹⁴⁹.
namespace exact {

using Integer = boost::multiprecision::cpp_int;
using Rational = boost::multiprecision::cpp_rational;

inline Integer scaled(float value)
{
    int exponent = 0;
    const float mantissa = std::frexp(value, &exponent);  // value = mantissa · 2^exponent
    const auto integer = static_cast<long>(std::ldexp(mantissa, 24));
    const int shift = exponent - 24 + 149;
    return shift >= 0 ? Integer{integer} << shift : Integer{integer >> -shift};
}

struct Moments {
    int count = 0;
    Rational variance, deviation, mean;  ///< in units of 2⁻²⁹⁸, 2⁻¹⁴⁹, 2⁻¹⁴⁹
};
inline double to_double(const Rational& value, int halvings)
{
    return std::ldexp(static_cast<double>(value), -halvings);
}
/// Relative error of a double against an exact value; absolute where that is 0.
inline double relative_error(double value, const Rational& exact, int halvings)
{
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    const auto integer = static_cast<long>(std::ldexp(mantissa, 53));
    const int shift = exponent - 53 + halvings;
    Rational scaled_value{integer};
    if (shift >= 0) scaled_value *= Integer{1} << shift;
    else scaled_value /= Integer{1} << -shift;
    if (exact == 0) return std::fabs(value);
    return std::fabs(static_cast<double>(Rational{(scaled_value - exact) / exact}));
}

/// Samples that are not positive and finite do not count.
inline Moments moments(nook::ImageView<const float> image, int x, int y, int radius,
                       nook::Border border)
{
    const auto columns = nook::detail::window_span(x, radius, image.width, border);
    const auto rows = nook::detail::window_span(y, radius, image.height, border);
    Moments result;
    Integer sum = 0, squares = 0;
    for (int j = rows.first; j <= rows.last; ++j)
        for (int i = columns.first; i <= columns.last; ++i) {
            const float value = image(i, j);
            if (!(value > 0) || !std::isfinite(value)) continue;
            const Integer integer = scaled(value);
            ++result.count;
            sum += integer;
            squares += integer * integer;
        }
    if (result.count == 0) return result;
    const Integer n = result.count;
    result.mean = Rational{sum, n};
    result.variance = Rational{n * squares - sum * sum, n * n};
    result.deviation = Rational{scaled(image(x, y))} - result.mean;
    return result;
}

}  // namespace exact
