#include <benchmark/benchmark.h>

#include <nook/depth/moments.hpp>
#include <nook/owned_image.hpp>
#include <nook/scratch.hpp>

#include "relief.hpp"

// The moments of a window three ways: k² samples, 2k samples, and a constant number. Time per image
// is fitted against k: the separable and the constant form fall where the names say.

namespace {

struct Run {
    benchmark::State& state;
    int window = static_cast<int>(state.range(0));
    nook::Image<float> depth =
        relief(static_cast<int>(state.range(1)), static_cast<int>(state.range(2)));
    nook::Image<float> variance{depth.width(), depth.height()};
    nook::Image<float> deviation{depth.width(), depth.height()};
    nook::BoxMoments<float> moments{.variance = variance, .deviation = deviation};
    nook::HeapScratch scratch{};

    template <class Form>
    void operator()(const Form& form)
    {
        for (auto _ : state) {
            const nook::Outcome outcome = form(*this);
            if (!outcome) {
                state.SkipWithError("the filter returned an error");
                break;
            }
            benchmark::ClobberMemory();
        }
        state.SetItemsProcessed(state.iterations() * depth.width() * depth.height());
        state.SetComplexityN(window);
    }
};

void moments_k_squared(benchmark::State& state)
{
    Run{state}([](Run& run) {
        return nook::box_moments_reference(run.depth.view(), run.moments, {run.window});
    });
}
void moments_2k(benchmark::State& state)
{
    Run{state}([](Run& run) {
        return nook::box_moments_separable(run.depth.view(), run.moments, {run.window},
                                           run.scratch);
    });
}
void moments_1(benchmark::State& state)
{
    Run{state}([](Run& run) {
        return nook::box_moments(run.depth.view(), run.moments, {run.window}, run.scratch);
    });
}

void windows(benchmark::internal::Benchmark* bench, int width, int height, int largest)
{
    for (int window = 3; window <= largest; window = 2 * window + 1)
        bench->Args({window, width, height});
    bench->ArgNames({"k", "width", "height"})->Unit(benchmark::kMillisecond);
}
// The quadratic form takes half a minute at 1080p with k = 127.
void small_all(benchmark::internal::Benchmark* bench) { windows(bench, 640, 360, 127); }
void large_all(benchmark::internal::Benchmark* bench) { windows(bench, 1920, 1080, 127); }

BENCHMARK(moments_k_squared)->Apply(small_all)->Complexity(benchmark::oNSquared);
BENCHMARK(moments_2k)->Apply(small_all)->Complexity(benchmark::oN);
BENCHMARK(moments_1)->Apply(small_all)->Complexity(benchmark::o1);
BENCHMARK(moments_k_squared)->Apply(large_all)->Complexity(benchmark::oNSquared);
BENCHMARK(moments_2k)->Apply(large_all)->Complexity(benchmark::oN);
BENCHMARK(moments_1)->Apply(large_all)->Complexity(benchmark::o1);

}  // namespace
