#pragma once

namespace support {

/// A colour; linear light or stored values, as the place says.
struct Rgb {
    float r = 0, g = 0, b = 0;

    friend constexpr Rgb operator*(const Rgb& colour, float scale)
    {
        return {colour.r * scale, colour.g * scale, colour.b * scale};
    }
    friend constexpr Rgb operator*(const Rgb& one, const Rgb& other)
    {
        return {one.r * other.r, one.g * other.g, one.b * other.b};
    }
    friend constexpr Rgb operator+(const Rgb& one, const Rgb& other)
    {
        return {one.r + other.r, one.g + other.g, one.b + other.b};
    }
    friend constexpr bool operator==(const Rgb&, const Rgb&) = default;
};

}  // namespace support
