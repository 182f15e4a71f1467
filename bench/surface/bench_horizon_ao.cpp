#include <benchmark/benchmark.h>

#include <nook/scratch.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/horizon_ao.hpp>

#include "waves.hpp"

// Horizons and the visibility bitmask by slices and steps.

namespace {

void horizons(benchmark::State& state)
{
    Waves waves{state};
    nook::HeapScratch scratch;
    const nook::HorizonOptions options{.radius = waves.radius,
                                       .slices = static_cast<int>(state.range(2)),
                                       .steps = static_cast<int>(state.range(3))};
    run(state, waves, [&] {
        return nook::horizon_ao(waves.depth.view(), waves.normal(), waves.visibility.view(),
                                options, waves.projection, {}, scratch);
    });
}
void bitmask(benchmark::State& state)
{
    Waves waves{state};
    nook::HeapScratch scratch;
    const nook::BitmaskOptions options{.radius = waves.radius,
                                       .slices = static_cast<int>(state.range(2)),
                                       .steps = static_cast<int>(state.range(3))};
    run(state, waves, [&] {
        return nook::bitmask_ao(waves.depth.view(), waves.normal(), waves.visibility.view(),
                                options, waves.projection, {}, scratch);
    });
}

void slices(benchmark::internal::Benchmark* bench)
{
    bench->Args({1920, 1080, 1, 3})->Args({1920, 1080, 3, 3})->Args({1920, 1080, 3, 8});
    bench->ArgNames({"width", "height", "slices", "steps"})->Unit(benchmark::kMillisecond);
}

BENCHMARK(horizons)->Apply(slices);
BENCHMARK(bitmask)->Apply(slices);

}  // namespace
