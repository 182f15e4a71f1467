#pragma once

#include <array>
#include <string_view>

#include "picture.hpp"

namespace support {

/// Blue for −1, white for 0, red for 1; clamped. Stored values, equally light at equal distances
/// from 0.
[[nodiscard]] Rgb diverging(double value);

/// Dark violet for 0 over teal to yellow for 1; clamped. Lightness grows all the way.
[[nodiscard]] Rgb sequential(double value);

/// What stands below a picture to read its colours by.
struct Scale {
    Rgb (*map)(double);
    double first, last;              ///< values of the map at the left and right end
    std::array<double, 3> labels{};  ///< left, middle, right
    std::string_view caption;
};

/// The picture with the scale drawn below it.
[[nodiscard]] Picture with_scale(const Picture& picture, const Scale& scale);

}  // namespace support
