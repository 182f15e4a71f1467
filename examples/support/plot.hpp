#pragma once

#include <string>
#include <vector>

#include "picture.hpp"
#include "rgb.hpp"

namespace support {

/// Told apart with any colour vision (Okabe & Ito 2008).
namespace plot_colours {
inline constexpr Rgb black{0.13f, 0.13f, 0.13f}, orange{0.90f, 0.62f, 0.00f},
    sky{0.34f, 0.71f, 0.91f}, green{0.00f, 0.62f, 0.45f}, blue{0.00f, 0.45f, 0.70f},
    vermilion{0.84f, 0.37f, 0.00f}, purple{0.80f, 0.47f, 0.65f};
}  // namespace plot_colours

enum class Stroke { line, dots };

/// Points (x, y) in order; a NaN leaves a gap.
struct Series {
    std::vector<double> x, y;
    Rgb colour;
    std::string label;
    Stroke stroke = Stroke::line;
};

/// Round numbers from a step of 1, 2 or 5 times a power of ten; about five steps in the range.
struct Ticks {
    double first, last, step;

    Ticks(double low, double high);
    [[nodiscard]] int count() const;
    [[nodiscard]] double at(int i) const { return first + i * step; }
};

/// The number as a label of an axis, and the number that it is the decimal logarithm of: 2k, 1M.
[[nodiscard]] std::string plain_label(double value);
[[nodiscard]] std::string power_label(double value);

/// Where a plot has room for the names of its curves.
enum class Corner { lower_right, upper_right, lower_left };

/// Curves over common axes.
struct Plot {
    std::string title, x_name;
    std::vector<Series> series;
    Ticks x, y;
    double shaded_until = 0;  ///< the ground is darker from the left end to this x
    std::string (*x_label)(double) = plain_label;
    Corner legend = Corner::lower_right;
};

/// Plots side by side.
[[nodiscard]] Picture draw_plots(const std::vector<Plot>& plots);

}  // namespace support
