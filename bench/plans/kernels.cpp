// Compiled once per instruction set, each time with other flags, another NOOK_TARGET and another name
// of the table. Nothing here may leave behind code that two of these objects would share: no
// containers, no threads.

#include "kernels.hpp"

#include <new>

#include <nook/scene/bvh.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/surface/surface_plan.hpp>

#if __has_include(<nook/depth/depth_plan.hpp>)
#include <nook/depth/depth_plan.hpp>
#define NOOK_COMPARE_DEPTH_PLAN
#endif
#if __has_include(<nook/scene/traced_plan.hpp>)
#include <nook/scene/traced_plan.hpp>
#define NOOK_COMPARE_TRACED_PLAN
#endif

#if !defined(NOOK_COMPARE_TABLE)
#error "NOOK_COMPARE_TABLE names the table, NOOK_COMPARE_NAME the instruction set"
#endif

namespace compare {

namespace {

/// No distance and no normal is as large.
constexpr float never = 3e38f;

void ones_of_depth(const Job& job)
{
    for (int y = 0; y < job.depth.height; ++y) {
        const float* const depth = &job.depth(0, y);
        float* const out = &job.visibility(0, y);
        const int width = job.depth.width;
        for (int x = 0; x < width; ++x) out[x] = depth[x] == never ? 0.0f : 1.0f;
    }
}
void ones_of_both(const Job& job)
{
    for (int y = 0; y < job.depth.height; ++y) {
        const float* const depth = &job.depth(0, y);
        const float* const nx = &job.normals.x(0, y);
        const float* const ny = &job.normals.y(0, y);
        const float* const nz = &job.normals.z(0, y);
        float* const out = &job.visibility(0, y);
        const int width = job.depth.width;
        for (int x = 0; x < width; ++x)
            out[x] = depth[x] + nx[x] + (ny[x] + nz[x]) == never ? 0.0f : 1.0f;
    }
}

nook::Outcome chebyshev_ao(const Job& job, const nook::ChebyshevOptions& options)
{
    return nook::chebyshev_ao(job.depth, job.visibility, options, job.projection, job.work_map,
                              *job.workspace);
}
nook::Outcome alchemy_ao(const Job& job, const nook::AlchemyOptions& options)
{
    return nook::alchemy_ao(job.depth, job.normals, job.visibility, options, job.projection,
                            job.work_map, *job.workspace);
}
nook::Outcome horizon_ao(const Job& job, const nook::HorizonOptions& options)
{
    return nook::horizon_ao(job.depth, job.normals, job.visibility, options, job.projection,
                            job.work_map, *job.workspace);
}
nook::Outcome bitmask_ao(const Job& job, const nook::BitmaskOptions& options)
{
    return nook::bitmask_ao(job.depth, job.normals, job.visibility, options, job.projection,
                            job.work_map, *job.workspace);
}
nook::Outcome bilateral_blur(const Job& job, const Depth& visibility,
                             const nook::BlurOptions& options)
{
    return nook::bilateral_blur(visibility, job.depth, job.normals, job.visibility, options,
                                job.projection, job.work_map, *job.workspace);
}
nook::Outcome upsample(const Job& job, const Depth& half, const nook::UpsampleOptions& options)
{
    return nook::upsample(half, job.depth, job.normals, job.visibility, options, job.projection,
                          job.work_map, *job.workspace);
}

template <class Options>
nook::Outcome plan_surface(const Job& job, const Groups& groups, const Options& options,
                           double tolerance)
{
    return nook::plan_surface(job.depth, job.normals, groups, options, job.projection, tolerance,
                              *job.workspace);
}
nook::WorkMap surface_map(const Groups& groups, double tolerance)
{
    return nook::surface_work_map(groups, tolerance);
}
nook::Outcome outline_mask(const Job& job, const OutlineJob& outlines, const Groups& groups)
{
    return nook::outline_mask(outlines.shells, outlines.extent, job.depth, groups,
                              {.threshold = outlines.threshold}, job.frame, job.projection,
                              *job.workspace);
}
#if defined(NOOK_COMPARE_DEPTH_PLAN)
nook::Outcome plan_depth(const Job& job, const Groups& groups,
                         const nook::ChebyshevOptions& options)
{
    return nook::plan_depth(job.depth, groups, options, job.projection, *job.workspace);
}
#endif

const nook::Bvh& bvh_of(const void* bvh) { return *static_cast<const nook::Bvh*>(bvh); }
nook::TracedOptions<> options_of(const Rays& rays)
{
    return {.radius = rays.radius, .directions = rays.directions};
}
void* make_bvh() { return new (std::nothrow) nook::Bvh; }
void free_bvh(void* bvh) { delete static_cast<nook::Bvh*>(bvh); }
nook::Outcome build(void* bvh, const nook::MeshView& mesh)
{
    return static_cast<nook::Bvh*>(bvh)->build(mesh);
}
nook::Outcome traced_ao(const void* bvh, const Job& job, const Rays& rays)
{
    return nook::traced_ao(bvh_of(bvh), job.depth, job.normals, job.visibility, options_of(rays),
                           job.projection, job.frame, job.work_map, *job.workspace);
}
#if defined(NOOK_COMPARE_TRACED_PLAN)
nook::Outcome plan_traced(const void* bvh, const Job& job, const Groups& groups, const Rays& rays)
{
    return nook::plan_traced(bvh_of(bvh), job.depth, job.normals, groups, options_of(rays),
                             job.projection, job.frame);
}
#endif

}  // namespace

extern const Kernels NOOK_COMPARE_TABLE;
const Kernels NOOK_COMPARE_TABLE = {
    .name = NOOK_COMPARE_NAME,
    .ones_of_depth = ones_of_depth,
    .ones_of_both = ones_of_both,
    .chebyshev_ao = chebyshev_ao,
    .alchemy_ao = alchemy_ao,
    .horizon_ao = horizon_ao,
    .bitmask_ao = bitmask_ao,
    .bilateral_blur = bilateral_blur,
    .upsample = upsample,
    .plan_alchemy = plan_surface<nook::AlchemyOptions>,
    .plan_horizon = plan_surface<nook::HorizonOptions>,
    .plan_bitmask = plan_surface<nook::BitmaskOptions>,
    .surface_map = surface_map,
    .outline_mask = outline_mask,
#if defined(NOOK_COMPARE_DEPTH_PLAN)
    .plan_depth = plan_depth,
#else
    .plan_depth = nullptr,
#endif
#if defined(NOOK_COMPARE_TRACED_PLAN)
    .plan_traced = plan_traced,
#else
    .plan_traced = nullptr,
#endif
    .make_bvh = make_bvh,
    .free_bvh = free_bvh,
    .build = build,
    .traced_ao = traced_ao,
};

}  // namespace compare
