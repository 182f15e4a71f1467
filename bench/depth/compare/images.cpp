#include "images.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

namespace compare {

namespace {

/// A number in [0, 1) for a place (a multiplicative hash, finalised as in MurmurHash3).
double noise(int x, int y, std::uint32_t seed)
{
    std::uint32_t bits = static_cast<std::uint32_t>(x) * 0x9e3779b1u +
                         static_cast<std::uint32_t>(y) * 0x85ebca77u + seed * 0xc2b2ae3du;
    bits ^= bits >> 16;
    bits *= 0x85ebca6bu;
    bits ^= bits >> 13;
    bits *= 0xc2b2ae35u;
    bits ^= bits >> 16;
    return bits * 0x1p-32;
}

constexpr float infinity = std::numeric_limits<float>::infinity();

}  // namespace

nook::Image<float> finite_image(int width, int height)
{
    nook::Image<float> image{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double ground = 4 / (0.2 + double(y) / height);
            const bool block = noise(x / 96, y / 64, 1) < 0.3;
            image(x, y) =
                static_cast<float>(ground * (block ? 0.8 : 1) * (1 + 0.06 * noise(x, y, 2)));
        }
    return image;
}

nook::Image<float> sky_image(int width, int height)
{
    nook::Image<float> image = finite_image(width, height);
    for (int x = 0; x < width; ++x) {
        const double hill = 0.4 + 0.15 * std::sin(0.01 * x) + 0.05 * std::sin(0.083 * x);
        const double horizon = height * (hill + 0.04 * noise(x, 0, 3));
        for (int y = 0; y < height && y < horizon; ++y) image(x, y) = infinity;
    }
    return image;
}

nook::Image<float> holed_image(int width, int height)
{
    nook::Image<float> image = finite_image(width, height);
    constexpr float values[] = {0, std::numeric_limits<float>::quiet_NaN(), infinity};
    constexpr int cell = 48;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            // A disc in every cell, and single pixels everywhere.
            const int i = x / cell, j = y / cell;
            const double dx = x - (i + 0.5) * cell, dy = y - (j + 0.5) * cell;
            const double radius = 0.4 * cell * noise(i, j, 4);
            if (dx * dx + dy * dy < radius * radius || noise(x, y, 5) < 0.01)
                image(x, y) = values[(i + j + x % 2) % 3];
        }
    return image;
}

}  // namespace compare
