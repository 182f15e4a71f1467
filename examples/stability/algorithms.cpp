#include <algorithm>

#include <nook/depth/cantelli.hpp>
#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/moments.hpp>

#include "../support/failure.hpp"
#include "stability.hpp"

namespace stability {

namespace {

template <class T>
using Image = nook::Image<T>;

template <class T>
Image<T> converted(const Image<float>& depth)
{
    Image<T> result{depth.width(), depth.height()};
    std::transform(depth.begin(), depth.end(), result.begin(),
                   [](float value) { return static_cast<T>(value); });
    return result;
}

// --- as textbooks have it -------------------------------------------------------------------------

/// M2 − M1², and the visibility that follows, of the pixel whose window has these sums.
template <class T>
void write_textbook(DepthOutput& output, int x, int y, T distance, T m1, T m2)
{
    output.variance(x, y) = static_cast<double>(m2 - m1 * m1);
    output.visibility(x, y) =
        static_cast<double>(nook::cantelli_upper_bound_of_moments<T>(distance, m1, m2, T{0}));
}

DepthOutput output_like(const Image<float>& depth)
{
    return {{depth.width(), depth.height()}, {depth.width(), depth.height()}};
}

/// Sums of z and z² over windows centred at the pixels of a row or column, for pixels whose window
/// fits: `at(i)` is sample i of `size`, `write(i, sum)` takes the sum around pixel i.
template <class T, class At, class Write>
void sums_anew(int size, int window, const At& at, const Write& write)
{
    for (int i = window / 2; i + window / 2 < size; ++i) {
        T sum = 0;
        for (int j = i - window / 2; j <= i + window / 2; ++j) sum += at(j);
        write(i, sum);
    }
}

/// The same with one addition and one subtraction per pixel.
template <class T, class At, class Write>
void running_sums(int size, int window, const At& at, const Write& write)
{
    T sum = 0;
    for (int i = 0; i < size; ++i) {
        sum += at(i);
        if (i >= window) sum -= at(i - window);
        if (i + 1 >= window) write(i - window / 2, sum);
    }
}

/// Rows, then columns, of z and of z².
template <class T, bool running>
DepthOutput separable(const Image<float>& input, int window)
{
    const auto filter = [window](int size, const auto& at, const auto& write) {
        if constexpr (running) running_sums<T>(size, window, at, write);
        else sums_anew<T>(size, window, at, write);
    };
    const int columns = input.width(), rows = input.height();
    const Image<T> depth = converted<T>(input);
    Image<T> across{columns, rows}, across_squares{columns, rows};
    for (int y = 0; y < rows; ++y) {
        filter(
            columns, [&](int x) { return depth(x, y); }, [&](int x, T sum) { across(x, y) = sum; });
        filter(
            columns, [&](int x) { return depth(x, y) * depth(x, y); },
            [&](int x, T sum) { across_squares(x, y) = sum; });
    }
    Image<T> sums{columns, rows}, squares{columns, rows};
    for (int x = 0; x < columns; ++x) {
        filter(
            rows, [&](int y) { return across(x, y); }, [&](int y, T sum) { sums(x, y) = sum; });
        filter(
            rows, [&](int y) { return across_squares(x, y); },
            [&](int y, T sum) { squares(x, y) = sum; });
    }
    const T count = static_cast<T>(window * window);
    DepthOutput output = output_like(input);
    for (int y = window / 2; y < rows - window / 2; ++y)
        for (int x = window / 2; x < columns - window / 2; ++x)
            write_textbook(output, x, y, depth(x, y), sums(x, y) / count, squares(x, y) / count);
    return output;
}

/// A summed-area table of z and z² (Crow 1984), about the mean of the image if so asked (Hensley et
/// al. 2005).
template <bool about_mean>
DepthOutput summed_area_table(const Image<float>& depth, int window)
{
    double pivot = 0;
    if constexpr (about_mean) {
        for (const float value : depth) pivot += double{value};
        pivot /= double(width) * height;
    }
    Image<double> sums{width + 1, height + 1}, squares{width + 1, height + 1};
    for (int y = 0; y < height; ++y) {
        double sum = 0, square = 0;
        for (int x = 0; x < width; ++x) {
            const double value = double{depth(x, y)} - pivot;
            sum += value;
            square += value * value;
            sums(x + 1, y + 1) = sums(x + 1, y) + sum;
            squares(x + 1, y + 1) = squares(x + 1, y) + square;
        }
    }
    const int radius = window / 2;
    const double count = double(window) * window;
    DepthOutput output = output_like(depth);
    for (int y = radius; y < height - radius; ++y)
        for (int x = radius; x < width - radius; ++x) {
            const auto mean = [&](const Image<double>& table) {
                return (table(x + radius + 1, y + radius + 1) - table(x - radius, y + radius + 1) -
                        table(x + radius + 1, y - radius) + table(x - radius, y - radius)) /
                       count;
            };
            write_textbook(output, x, y, double{depth(x, y)} - pivot, mean(sums), mean(squares));
        }
    return output;
}

// --- nook -----------------------------------------------------------------------------------------

void check(const nook::Outcome& outcome)
{
    if (outcome) return;
    char text[256];
    nook::describe(outcome.error, text, sizeof text);
    throw support::Failure{text};
}

/// The default kernel and its moments, on depths and with outputs of one type.
template <class T>
DepthOutput chebyshev(const Image<float>& input, int window)
{
    const Image<T> depth = converted<T>(input);
    Image<T> variance{input.width(), input.height()}, visibility{input.width(), input.height()};
    check(nook::box_moments(depth.view(), nook::BoxMoments<T>{.variance = variance.view()},
                            {.window = window}));
    check(nook::chebyshev_ao(depth.view(), visibility.view(), {.window = window, .bias = 0}));
    DepthOutput output = output_like(input);
    std::copy(variance.begin(), variance.end(), output.variance.begin());
    std::copy(visibility.begin(), visibility.end(), output.visibility.begin());
    return output;
}

/// The paper's 2 k samples per pixel, from float depths.
DepthOutput chebyshev_separable(const Image<float>& depth, int window)
{
    DepthOutput output = output_like(depth);
    Image<double> deviation{width, height};
    check(nook::box_moments_separable(
        depth.view(),
        nook::BoxMoments<double>{.variance = output.variance.view(), .deviation = deviation.view()},
        {.window = window}));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            output.visibility(x, y) =
                nook::cantelli_upper_bound(output.variance(x, y), deviation(x, y), 0.0);
    return output;
}

/// Windows that follow 1/depth, of a radius so large that all are cut to the same maximum.
DepthOutput chebyshev_variable(const Image<float>& depth, int window)
{
    const nook::Projection projection{.fx = 1, .fy = 1};
    Image<float> visibility{width, height};
    check(nook::chebyshev_ao(depth.view(), visibility.view(),
                             {.radius = 1e60, .max_window = window, .bias = 0}, projection));
    return {{}, converted<double>(visibility)};
}

/// Means that are right to the last bit, rounded to T, and the textbook formula: what the formula
/// loses by itself.
template <class T>
DepthOutput stored_moments(const Image<float>& input, int window)
{
    const Image<T> depth = converted<T>(input);
    Image<T> m1{width, height}, m2{width, height};
    check(nook::box_moments(depth.view(),
                            nook::BoxMoments<T>{.mean = m1.view(), .mean_square = m2.view()},
                            {.window = window}));
    DepthOutput output = output_like(input);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            write_textbook(output, x, y, depth(x, y), m1(x, y), m2(x, y));
    return output;
}

}  // namespace

std::vector<DepthAlgorithm> depth_algorithms()
{
    using enum Precision;
    return {
        {{"naive-float", "sums of z and z^2 in float, rows then columns; M2 - M1^2"},
         binary32,
         separable<float, false>},
        {{"naive-double", "the same in double"}, binary64, separable<double, false>},
        {{"running-float", "running sums of z and z^2 in float; M2 - M1^2"},
         binary32,
         separable<float, true>},
        {{"running-double", "the same in double"}, binary64, separable<double, true>},
        {{"sat-double", "summed-area table of z and z^2 in double; M2 - M1^2"},
         binary64,
         summed_area_table<false>},
        {{"sat-pivot", "the same about the mean of the image"}, binary64, summed_area_table<true>},
        {{"textbook-float", "M1 and M2 accurate, then rounded to float; M2 - M1^2"},
         binary32,
         stored_moments<float>},
        {{"textbook-double", "the same in double"}, binary64, stored_moments<double>},
        {{"nook-float", "box_moments and chebyshev_ao on float depths, outputs in float"},
         binary32,
         chebyshev<float>},
        {{"nook-double", "the same on the same depths held as doubles, outputs in double"},
         binary64,
         chebyshev<double>},
        {{"nook-separable", "box_moments_separable on float depths, moments in double"},
         binary64,
         chebyshev_separable},
        {{"nook-variable", "chebyshev_ao with a radius, in float; gives no variance"},
         binary32,
         chebyshev_variable},
    };
}

}  // namespace stability
