#include <benchmark/benchmark.h>

#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/visible_counts.hpp>
#include <nook/scratch.hpp>

#include "meshes.hpp"

// Forty tori and spheres: what each target costs.

namespace {

/// Of the size and with about as many thousand triangles as the arguments of the benchmark tell.
struct Scene {
    int width, height;
    meshes::Mesh mesh;
    nook::ViewFrame frame;
    nook::Projection projection;
    nook::HeapScratch scratch;

    explicit Scene(const benchmark::State& state)
        : width{static_cast<int>(state.range(0))},
          height{static_cast<int>(state.range(1))},
          mesh{meshes::solids(1000 * static_cast<std::size_t>(state.range(2)))},
          frame{nook::view_frame(mesh.camera)},
          projection{nook::projection(mesh.camera, width, height)}
    {}
};

/// Times call() and counts triangles.
template <class Call>
void run(benchmark::State& state, const Scene& scene, const Call& call)
{
    for (auto _ : state) {
        if (!call()) {
            state.SkipWithError("the rasteriser returned an error");
            break;
        }
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(scene.mesh.triangles()));
}

void depth_alone(benchmark::State& state)
{
    Scene scene{state};
    nook::Image<float> depth{scene.width, scene.height};
    run(state, scene, [&] {
        return nook::rasterise(scene.mesh.view(), scene.frame, scene.projection, {depth.view()}, {},
                               scene.scratch);
    });
}
void depth_and_normals(benchmark::State& state, bool smooth)
{
    Scene scene{state};
    nook::Image<float> depth{scene.width, scene.height}, x = depth, y = depth, z = depth;
    const nook::ImageView3<float> normals{x.view(), y.view(), z.view()};
    run(state, scene, [&] {
        return nook::rasterise(scene.mesh.view(), scene.frame, scene.projection,
                               {depth.view(), normals}, {.interpolate_normals = smooth},
                               scene.scratch);
    });
}
void depth_and_faces(benchmark::State& state)
{
    Scene scene{state};
    nook::Image<float> depth{scene.width, scene.height};
    nook::Image<std::uint32_t> face{scene.width, scene.height};
    run(state, scene, [&] {
        return nook::rasterise(scene.mesh.view(), scene.frame, scene.projection,
                               {depth.view(), {}, face.view()}, {}, scene.scratch);
    });
}
void counts(benchmark::State& state)
{
    Scene scene{state};
    std::vector<std::uint32_t> counts(scene.mesh.triangles());
    run(state, scene, [&] {
        return nook::visible_counts(scene.mesh.view(), scene.frame, scene.projection, scene.width,
                                    scene.height, counts.data(), {}, scene.scratch);
    });
}

void sizes(benchmark::internal::Benchmark* bench)
{
    bench->Args({1920, 1080, 20})->Args({1920, 1080, 300})->Args({512, 512, 1000});
    bench->ArgNames({"width", "height", "thousands"})->Unit(benchmark::kMillisecond);
}

BENCHMARK(depth_alone)->Apply(sizes);
BENCHMARK_CAPTURE(depth_and_normals, facets, false)->Apply(sizes);
BENCHMARK_CAPTURE(depth_and_normals, smooth, true)->Apply(sizes);
BENCHMARK(depth_and_faces)->Apply(sizes);
BENCHMARK(counts)->Apply(sizes);

}  // namespace
