#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>

#include "kernels.hpp"

/// What a careful user would write without nook: the same formula from sums in double, in loops that
/// compilers vectorise.
namespace compare::inline NOOK_TARGET {

/// The automatic bias of float distances, per distance²: 100 squared steps.
inline constexpr double bias = 100 * 0x1p-46;

/// Equation 3 without a branch: the bias keeps the denominator above 0.
template <class Value>
[[nodiscard]] inline Value shade(Value distance, Value mean, Value mean_square)
{
    const Value variance = mean_square - mean * mean, difference = distance - mean;
    const Value spread =
        (variance > 0 ? variance : Value{0}) + static_cast<Value>(bias) * distance * distance;
    const Value deviation = difference > 0 ? difference : Value{0};
    return spread / (spread + deviation * deviation);
}

inline void shade_moments(const float* depth, const float* mean, const float* mean_square,
                          float* visibility, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        visibility[i] = shade(depth[i], mean[i], mean_square[i]);
}

template <bool counted>
void fill_rows(const Depth& depth, const SumTables& tables)
{
    const std::ptrdiff_t stride = depth.width + 1;
    std::fill_n(tables.sum, stride, 0.0);
    std::fill_n(tables.squares, stride, 0.0);
    if constexpr (counted) std::fill_n(tables.count, stride, 0);
    for (int y = 0; y < depth.height; ++y) {
        const float* const row = depth.data + y * depth.row_stride;
        double* const sums = tables.sum + (y + 1) * stride;
        double* const squares = tables.squares + (y + 1) * stride;
        std::int32_t* const counts = counted ? tables.count + (y + 1) * stride : nullptr;
        sums[0] = squares[0] = 0;
        if constexpr (counted) counts[0] = 0;
        double sum = 0, square = 0;
        std::int32_t count = 0;
        for (int x = 0; x < depth.width; ++x) {
            double value = double{row[x]};
            if constexpr (counted) {
                const bool surface = nook::is_surface(row[x], (std::numeric_limits<float>::max)());
                value = surface ? value : 0.0;
                count += surface;
                counts[x + 1] = counts[x + 1 - stride] + count;
            }
            sum += value;
            square += value * value;
            sums[x + 1] = sums[x + 1 - stride] + sum;
            squares[x + 1] = squares[x + 1 - stride] + square;
        }
    }
}
inline void fill_tables(const Depth& depth, const SumTables& tables)
{
    if (tables.count != nullptr) fill_rows<true>(depth, tables);
    else fill_rows<false>(depth, tables);
}

/// The columns whose windows do not reach beyond the image: [first, last).
struct Interior {
    int first, last;

    Interior(int width, int radius)
        : first{(std::min)(radius, width)},
          last{(std::max)(width - radius, first)}
    {}
};

inline void shade_tables(const Depth& depth, const SumTables& tables, int window,
                         const Visibility& visibility)
{
    const int radius = window / 2, width = depth.width;
    const std::ptrdiff_t stride = width + 1;
    const Interior interior{width, radius};
    for (int y = 0; y < depth.height; ++y) {
        const auto down =
            nook::detail::window_span(y, radius, depth.height, nook::Border::symmetric);
        const double* const sum_top = tables.sum + down.first * stride;
        const double* const sum_end = tables.sum + (down.last + 1) * stride;
        const double* const squares_top = tables.squares + down.first * stride;
        const double* const squares_end = tables.squares + (down.last + 1) * stride;
        const float* const row = depth.data + y * depth.row_stride;
        float* const out = visibility.data + y * visibility.row_stride;
        const auto pixel = [&](int x, int before, double inverse) {
            const int left = x - before, right = x + before + 1;
            const double sum = sum_end[right] - sum_end[left] - sum_top[right] + sum_top[left];
            const double square =
                squares_end[right] - squares_end[left] - squares_top[right] + squares_top[left];
            return static_cast<float>(shade(double{row[x]}, sum * inverse, square * inverse));
        };
        const double rows = down.last - down.first + 1;
        const auto border = [&](int first, int last) {
            for (int x = first; x < last; ++x) {
                const int reach = (std::min)({radius, x, width - 1 - x});
                out[x] = pixel(x, reach, 1 / (rows * (2 * reach + 1)));
            }
        };
        border(0, interior.first);
        const double inverse = 1 / (rows * window);
        for (int x = interior.first; x < interior.last; ++x) out[x] = pixel(x, radius, inverse);
        border(interior.last, width);
    }
}

template <bool counted>
void shade_rows_radius(const Depth& depth, const SumTables& tables, double radius, int max_window,
                       const nook::Projection& projection, const Visibility& visibility)
{
    const int width = depth.width, height = depth.height, largest = max_window / 2;
    const std::ptrdiff_t stride = width + 1;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const float distance = depth(x, y);
            if (counted && !nook::is_surface(distance, (std::numeric_limits<float>::max)())) {
                visibility(x, y) = 1;
                continue;
            }
            const auto pixels = nook::pixels_per_length(projection, radius, double{distance});
            const int reach_x = pixels.x < largest ? static_cast<int>(pixels.x) : largest;
            const int reach_y = pixels.y < largest ? static_cast<int>(pixels.y) : largest;
            const auto across =
                nook::detail::window_span(x, reach_x, width, nook::Border::symmetric);
            const auto down =
                nook::detail::window_span(y, reach_y, height, nook::Border::symmetric);
            const std::ptrdiff_t top = down.first * stride, end = (down.last + 1) * stride;
            const std::ptrdiff_t left = across.first, right = across.last + 1;
            const auto total = [&](const auto* table) {
                return table[end + right] - table[end + left] - table[top + right] +
                       table[top + left];
            };
            const std::int32_t area = nook::detail::samples_in(across, down);
            const std::int32_t samples = counted ? total(tables.count) : area;
            const double inverse = 1.0 / samples;
            double open = shade(double{distance}, total(tables.sum) * inverse,
                                total(tables.squares) * inverse);
            if constexpr (counted) open += (1 - open) * (double(area - samples) / area);
            visibility(x, y) = static_cast<float>(open);
        }
}
inline void shade_tables_radius(const Depth& depth, const SumTables& tables, double radius,
                                int max_window, const nook::Projection& projection,
                                const Visibility& visibility)
{
    if (tables.count != nullptr)
        shade_rows_radius<true>(depth, tables, radius, max_window, projection, visibility);
    else shade_rows_radius<false>(depth, tables, radius, max_window, projection, visibility);
}

inline void running_sums(const Depth& depth, int window, double* work, const Visibility& visibility)
{
    const int radius = window / 2, width = depth.width;
    const Interior interior{width, radius};
    double* const column_sums = work;
    double* const column_squares = column_sums + width;
    double* const sums = column_squares + width;
    double* const squares = sums + width;
    double* const inverse_widths = squares + width;
    std::fill_n(column_sums, width, 0.0);
    std::fill_n(column_squares, width, 0.0);
    for (int x = 0; x < width; ++x)
        inverse_widths[x] = 1.0 / (2 * (std::min)({radius, x, width - 1 - x}) + 1);

    int top = 0, bottom = -1;
    for (int y = 0; y < depth.height; ++y) {
        const auto down =
            nook::detail::window_span(y, radius, depth.height, nook::Border::symmetric);
        for (; bottom < down.last; ++bottom) {
            const float* const row = depth.data + (bottom + 1) * depth.row_stride;
            for (int x = 0; x < width; ++x) {
                const double value = double{row[x]};
                column_sums[x] += value;
                column_squares[x] += value * value;
            }
        }
        for (; top < down.first; ++top) {
            const float* const row = depth.data + top * depth.row_stride;
            for (int x = 0; x < width; ++x) {
                const double value = double{row[x]};
                column_sums[x] -= value;
                column_squares[x] -= value * value;
            }
        }

        double sum = 0, square = 0;
        int left = 0, right = -1;
        const auto border = [&](int first, int last) {
            for (int x = first; x < last; ++x) {
                const auto across =
                    nook::detail::window_span(x, radius, width, nook::Border::symmetric);
                for (; right < across.last; ++right) {
                    sum += column_sums[right + 1];
                    square += column_squares[right + 1];
                }
                for (; left < across.first; ++left) {
                    sum -= column_sums[left];
                    square -= column_squares[left];
                }
                sums[x] = sum;
                squares[x] = square;
            }
        };
        // The first of the interior adds two columns, as all before it.
        const int first = (std::min)(interior.first + 1, interior.last);
        border(0, first);
        for (int x = first; x < interior.last; ++x) {
            sum += column_sums[x + radius] - column_sums[x - radius - 1];
            square += column_squares[x + radius] - column_squares[x - radius - 1];
            sums[x] = sum;
            squares[x] = square;
        }
        right += interior.last - first;
        left += interior.last - first;
        border(interior.last, width);

        const double inverse_rows = 1.0 / (down.last - down.first + 1);
        const float* const row = depth.data + y * depth.row_stride;
        float* const out = visibility.data + y * visibility.row_stride;
        for (int x = 0; x < width; ++x) {
            const double inverse = inverse_rows * inverse_widths[x];
            out[x] =
                static_cast<float>(shade(double{row[x]}, sums[x] * inverse, squares[x] * inverse));
        }
    }
}

}  // namespace compare::inline NOOK_TARGET
