#include <benchmark/benchmark.h>

#include <nook/scratch.hpp>
#include <nook/surface/alchemy_ao.hpp>

#include "waves.hpp"

// Alchemy ambient obscurance by samples, with both patterns. nook-surface-compare measures it against
// others.

namespace {

template <nook::SamplePattern pattern>
void alchemy(benchmark::State& state)
{
    Waves waves{state};
    nook::HeapScratch scratch;
    const nook::AlchemyOptions options{
        .radius = waves.radius, .samples = static_cast<int>(state.range(2)), .pattern = pattern};
    run(state, waves, [&] {
        return nook::alchemy_ao(waves.depth.view(), waves.normal(), waves.visibility.view(),
                                options, waves.projection, {}, scratch);
    });
}

void samples(benchmark::internal::Benchmark* bench)
{
    for (const int count : {4, 8, 16, 32}) bench->Args({1920, 1080, count});
    bench->ArgNames({"width", "height", "samples"})->Unit(benchmark::kMillisecond);
}

BENCHMARK(alchemy<nook::SamplePattern::row>)->Apply(samples);
BENCHMARK(alchemy<nook::SamplePattern::pixel>)->Apply(samples);

}  // namespace
