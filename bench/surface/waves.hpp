#pragma once

#include <cmath>
#include <cstdint>

#include <benchmark/benchmark.h>

#include <nook/owned_image.hpp>
#include <nook/surface/normals_from_depth.hpp>

/// A G-buffer of waves that recede, the same on every run, and room for results.
struct Waves {
    nook::Image<float> depth, normals, noisy, visibility;
    nook::Projection projection{};
    /// Covers about 50 of 1080 pixels.
    double radius = 0.3;

    /// Of the size that the first two arguments of the benchmark tell.
    explicit Waves(const benchmark::State& state)
        : depth{static_cast<int>(state.range(0)), static_cast<int>(state.range(1))},
          normals{depth.width(), 3 * depth.height()},
          noisy{depth.width(), depth.height()},
          visibility{depth.width(), depth.height()}
    {
        const int width = depth.width(), height = depth.height();
        projection.fx = projection.fy = height;
        projection.cx = width / 2.0;
        projection.cy = height / 2.0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const double u = double(x) / height, v = double(y) / height;
                const double wave = 0.05 * std::sin(14 * u + 3 * std::sin(5 * v));
                depth(x, y) = static_cast<float>(4 / (0.2 + v) * (1 + wave));
                noisy(x, y) = static_cast<float>((x * 7 + y * 13) % 16) / 16;
            }
        // It writes all or nothing; zero normals would make the kernels too fast to be true.
        const nook::ImageView3<float> planes{plane(0), plane(1), plane(2)};
        if (!nook::normals_from_depth(depth.view(), planes, projection)) depth = {};
    }
    [[nodiscard]] nook::ImageView<float> plane(int i)
    {
        return {&normals(0, i * depth.height()), depth.width(), depth.height(), depth.width(), 1};
    }
    [[nodiscard]] nook::ImageView3<const float> normal()
    {
        return nook::ImageView3<float>{plane(0), plane(1), plane(2)};
    }
    [[nodiscard]] std::int64_t pixels() const
    {
        return std::int64_t{depth.width()} * depth.height();
    }
};

/// Times call() and counts pixels.
template <class Call>
void run(benchmark::State& state, const Waves& waves, const Call& call)
{
    for (auto _ : state) {
        if (!call()) {
            state.SkipWithError("the kernel returned an error");
            break;
        }
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * waves.pixels());
}
