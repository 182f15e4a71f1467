#include <benchmark/benchmark.h>

#include <nook/scratch.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/upsample.hpp>

#include "waves.hpp"

// The blur by radius, and upsampling, with and without normals.

namespace {

template <bool with_normals>
void blur(benchmark::State& state)
{
    Waves waves{state};
    nook::HeapScratch scratch;
    const int radius = static_cast<int>(state.range(2));
    const nook::BlurOptions options{.radius = radius, .sigma = 0.5 * (radius + 1)};
    run(state, waves, [&] {
        if constexpr (with_normals)
            return nook::bilateral_blur(waves.noisy.view(), waves.depth.view(), waves.normal(),
                                        waves.visibility.view(), options, waves.projection, {},
                                        scratch);
        else
            return nook::bilateral_blur(waves.noisy.view(), waves.depth.view(),
                                        waves.visibility.view(), options, waves.projection, {},
                                        scratch);
    });
}

template <bool with_normals>
void upsampling(benchmark::State& state)
{
    Waves waves{state};
    nook::HeapScratch scratch;
    const auto half = nook::half_view(waves.noisy.view());
    run(state, waves, [&] {
        if constexpr (with_normals)
            return nook::upsample(half, waves.depth.view(), waves.normal(), waves.visibility.view(),
                                  {}, waves.projection, {}, scratch);
        else
            return nook::upsample(half, waves.depth.view(), waves.visibility.view(), {},
                                  waves.projection, {}, scratch);
    });
}

void radii(benchmark::internal::Benchmark* bench)
{
    for (const int radius : {2, 4, 8}) bench->Args({1920, 1080, radius});
    bench->ArgNames({"width", "height", "radius"})->Unit(benchmark::kMillisecond);
}
void size(benchmark::internal::Benchmark* bench)
{
    bench->Args({1920, 1080})->ArgNames({"width", "height"})->Unit(benchmark::kMillisecond);
}

BENCHMARK(blur<false>)->Apply(radii);
BENCHMARK(blur<true>)->Apply(radii);
BENCHMARK(upsampling<false>)->Apply(size);
BENCHMARK(upsampling<true>)->Apply(size);

}  // namespace
