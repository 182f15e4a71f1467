#pragma once

#include <random>

#include <nook/owned_image.hpp>

/// A slope with relief: the same depths on every run.
[[nodiscard]] inline nook::Image<float> relief(int width, int height)
{
    std::mt19937 random{1};
    std::uniform_real_distribution<float> noise{0, 1e-2f};
    nook::Image<float> image{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image(x, y) = 4 + 1e-3f * static_cast<float>(x + y) + noise(random);
    return image;
}
