#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <nook/target.hpp>

/// Spirals of samples over a disc, turned from row to row or from pixel to pixel.
namespace nook::inline NOOK_TARGET::detail {

/// A number whose bits look random: the finaliser of MurmurHash3. Integers, so that it is as good at
/// row 8000 as at row 8.
[[nodiscard]] constexpr std::uint32_t scattered(std::uint32_t value)
{
    value = (value ^ value >> 16) * 0x85ebca6bu;
    value = (value ^ value >> 13) * 0xc2b2ae35u;
    return value ^ value >> 16;
}

/// What part of a turn row y starts at: steps of the golden ratio, so that rows side by side differ as
/// much as they can.
[[nodiscard]] constexpr double row_turn(int y, std::uint32_t seed)
{
    return (static_cast<std::uint32_t>(y) * 0x9e3779b9u + scattered(seed)) * 0x1p-32;
}
/// The same for a pixel of its own.
[[nodiscard]] constexpr double pixel_turn(int x, int y, std::uint32_t seed)
{
    return scattered(static_cast<std::uint32_t>(x) * 0x9e3779b9u +
                     scattered(static_cast<std::uint32_t>(y) + scattered(seed))) *
           0x1p-32;
}

/// `count` samples of a spiral over the unit disc: sample i at radius (i + 1/2) / count, after `turns`
/// turns in all, from the part `start` of a turn on. McGuire et al. 2012, equation 2. x to the right, y
/// down.
template <int capacity>
struct Spiral {
    int count;
    /// Readable by sixteens.
    float x[capacity + 16], y[capacity + 16];

    Spiral(int samples, int turns, double start) : count{samples}
    {
        for (int i = 0; i < capacity + 16; ++i) x[i] = y[i] = 0;
        for (int i = 0; i < samples; ++i) {
            const double radius = (i + 0.5) / samples;
            const double angle = 2 * std::numbers::pi * (radius * turns + start);
            x[i] = static_cast<float>(radius * std::cos(angle));
            y[i] = static_cast<float>(radius * std::sin(angle));
        }
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
