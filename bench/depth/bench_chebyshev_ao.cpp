#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <cstring>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/owned_image.hpp>
#include <nook/scratch.hpp>

#include "relief.hpp"

// Chebyshev ambient occlusion beside a copy of the same buffers, which no filter can beat.
// nook-compare measures it against other libraries.

namespace {

struct Buffers {
    nook::Image<float> depth, visibility;

    explicit Buffers(const benchmark::State& state)
        : depth{relief(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)))},
          visibility{depth.width(), depth.height()}
    {}
    [[nodiscard]] std::int64_t pixels() const
    {
        return std::int64_t{depth.width()} * depth.height();
    }
};

void copy(benchmark::State& state)
{
    Buffers buffers{state};
    const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(buffers.pixels());
    for (auto _ : state) {
        std::memcpy(buffers.visibility.data(), buffers.depth.data(), bytes);
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * buffers.pixels());
}

void run(benchmark::State& state, const nook::ChebyshevOptions& options,
         const nook::Projection& projection)
{
    Buffers buffers{state};
    nook::HeapScratch scratch;
    for (auto _ : state) {
        const nook::Outcome outcome = nook::chebyshev_ao(
            buffers.depth.view(), buffers.visibility.view(), options, projection, {}, scratch);
        if (!outcome) {
            state.SkipWithError("the kernel returned an error");
            break;
        }
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * buffers.pixels());
}

void chebyshev_window(benchmark::State& state)
{
    run(state, {.window = static_cast<int>(state.range(2))}, {});
}
void chebyshev_radius(benchmark::State& state)
{
    // The slope begins at a distance of 4: no window is larger than the one asked for.
    const double reach = static_cast<double>(state.range(2) / 2);
    run(state, {.radius = 4}, {.fx = reach, .fy = reach});
}

void sizes(benchmark::internal::Benchmark* bench)
{
    bench->Args({1920, 1080})->Args({3840, 2160});
    bench->ArgNames({"width", "height"})->Unit(benchmark::kMillisecond);
}
void windows(benchmark::internal::Benchmark* bench)
{
    for (int window = 3; window <= 127; window = 2 * window + 1)
        bench->Args({1920, 1080, window})->Args({3840, 2160, window});
    bench->ArgNames({"width", "height", "k"})->Unit(benchmark::kMillisecond);
}

BENCHMARK(copy)->Apply(sizes);
BENCHMARK(chebyshev_window)->Apply(windows);
BENCHMARK(chebyshev_radius)->Apply(windows);

}  // namespace
