#include "colour_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace support {

namespace {

template <std::size_t count>
Rgb blend(const std::array<Rgb, count>& colours, double at)
{
    if (!(at > 0)) return colours.front();
    const double scaled = (std::min)(at, 1.0) * static_cast<double>(count - 1);
    const auto index = (std::min)(static_cast<std::size_t>(scaled), count - 2);
    const auto rest = static_cast<float>(scaled - static_cast<double>(index));
    return colours[index] * (1 - rest) + colours[index + 1] * rest;
}

std::string label(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
}

}  // namespace

Rgb diverging(double value)
{
    static constexpr std::array<Rgb, 7> colours{{{0.02f, 0.19f, 0.38f},
                                                 {0.20f, 0.52f, 0.76f},
                                                 {0.66f, 0.82f, 0.91f},
                                                 {1.00f, 1.00f, 1.00f},
                                                 {0.98f, 0.75f, 0.65f},
                                                 {0.84f, 0.30f, 0.26f},
                                                 {0.40f, 0.00f, 0.12f}}};
    return blend(colours, (value + 1) / 2);
}

Rgb sequential(double value)
{
    static constexpr std::array<Rgb, 6> colours{{{0.27f, 0.00f, 0.33f},
                                                 {0.25f, 0.27f, 0.53f},
                                                 {0.16f, 0.47f, 0.56f},
                                                 {0.13f, 0.66f, 0.52f},
                                                 {0.48f, 0.82f, 0.32f},
                                                 {0.99f, 0.91f, 0.14f}}};
    return blend(colours, value);
}

Picture with_scale(const Picture& picture, const Scale& scale)
{
    constexpr int gap = 8, bar = 16;
    const int width = picture.width(), size = width >= 480 ? 2 : 1;
    Picture result{width, picture.height() + gap + bar + gap + 2 * (text_height(size) + gap)};
    result.paste(picture, 0, 0);
    const int left = gap, right = (std::max)(width - gap, left + 2);
    for (int x = left; x < right; ++x) {
        const double at = (x - left) / double(right - left - 1);
        result.fill(x, picture.height() + gap, 1, bar,
                    scale.map(std::lerp(scale.first, scale.last, at)));
    }
    const int row = picture.height() + gap + bar + gap;
    const std::string low = label(scale.labels[0]), middle = label(scale.labels[1]),
                      high = label(scale.labels[2]);
    draw_text(result, left, row, low, size);
    draw_text(result, (left + right - text_width(middle, size)) / 2, row, middle, size);
    draw_text(result, right - text_width(high, size), row, high, size);
    draw_text(result, left, row + text_height(size) + gap, scale.caption, size);
    return result;
}

}  // namespace support
