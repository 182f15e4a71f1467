// Compiled once per instruction set, each time with other flags, another NOOK_TARGET and another name
// of the table. Nothing here may leave behind code that two of these objects would share: no
// containers, no threads.

#include "kernels.hpp"

#include <new>

#include <nook/scene/traced_ao.hpp>

#include "brute_force.hpp"
#include "directions.hpp"
#include "embree_rays.hpp"

#if !defined(NOOK_COMPARE_TABLE)
#error "NOOK_COMPARE_TABLE names the table, NOOK_COMPARE_NAME the instruction set"
#endif

namespace compare {

namespace {

const nook::Bvh& bvh_of(const void* bvh) { return *static_cast<const nook::Bvh*>(bvh); }

void* make_bvh() { return new (std::nothrow) nook::Bvh; }
void free_bvh(void* bvh) { delete static_cast<nook::Bvh*>(bvh); }
nook::Outcome build(void* bvh, const nook::MeshView& mesh, const Threads& threads)
{
    return static_cast<nook::Bvh*>(bvh)->build(mesh, {}, Borrowed{threads});
}
std::size_t memory_size(const void* bvh) { return bvh_of(bvh).memory_size(); }
bool occluded(const void* bvh, const nook::Ray& ray) { return bvh_of(bvh).occluded(ray); }

nook::Outcome traced_ao(const void* bvh, const Points& points, const Sampling& sampling,
                        float* visibility, const Threads& threads)
{
    const auto count = static_cast<int>(points.count);
    return nook::traced_ao(bvh_of(bvh),
                           nook::ShadingPoints{.positions = points.positions,
                                               .normals = points.normals,
                                               .count = points.count,
                                               .error = 0},
                           nook::ImageView<float>{visibility, count, 1, count},
                           options_of(sampling), nook::HeapScratch{}, Borrowed{threads});
}

nook::Outcome traced_picture(const void* bvh, const PictureJob& job, const Sampling& sampling,
                             const Threads& threads)
{
    const auto trace = [&](const auto& options) {
        return nook::traced_ao(bvh_of(bvh), job.depth, job.normals, job.visibility, options,
                               job.projection, job.frame, {}, nook::HeapScratch{},
                               Borrowed{threads});
    };
    if (!job.secondary_rays) return trace(options_of(sampling));
    return trace(nook::TracedOptions<nook::StepFalloff, nook::SecondaryRays>{
        .radius = sampling.radius, .directions = sampling.directions, .seed = sampling.seed});
}

void directions(const Points& points, std::size_t point, const Sampling& sampling, float* xyz)
{
    Directions rays{sampling};
    rays.fill(points, point);
    for (int i = 0; i < sampling.directions; ++i) {
        xyz[3 * i] = rays.x()[i];
        xyz[3 * i + 1] = rays.y()[i];
        xyz[3 * i + 2] = rays.z()[i];
    }
}

void single_rays(const void* bvh, const Points& points, const Sampling& sampling, float* visibility)
{
    Directions rays{sampling};
    for (std::size_t point = 0; point < points.count; ++point) {
        rays.fill(points, point);
        const float* const from = points.positions + 3 * point;
        nook::Ray ray{.origin = {from[0], from[1], from[2]}, .t_max = sampling.radius};
        int open = 0;
        for (int i = 0; i < sampling.directions; ++i) {
            ray.direction = {rays.x()[i], rays.y()[i], rays.z()[i]};
            open += !bvh_of(bvh).occluded(ray);
        }
        visibility[point] = static_cast<float>(open) / static_cast<float>(sampling.directions);
    }
}

}  // namespace

extern const Kernels NOOK_COMPARE_TABLE;
const Kernels NOOK_COMPARE_TABLE = {
    .name = NOOK_COMPARE_NAME,
    .make_bvh = make_bvh,
    .free_bvh = free_bvh,
    .build = build,
    .memory_size = memory_size,
    .occluded = occluded,
    .traced_ao = traced_ao,
    .traced_picture = traced_picture,
    .single_rays = single_rays,
    .directions = directions,
#if defined(NOOK_COMPARE_EMBREE)
    .embree_single = embree_single,
    .embree_packets = embree_packets,
#if NOOK_COMPARE_EMBREE < 4
    .embree_stream = embree_stream,
#else
    .embree_stream = nullptr,
#endif
    .embree_random = embree_random,
    .embree_occluded = embree_occluded,
#else
    .embree_single = nullptr,
    .embree_packets = nullptr,
    .embree_stream = nullptr,
    .embree_random = nullptr,
    .embree_occluded = nullptr,
#endif
    .brute_force = brute_force,
};

}  // namespace compare
