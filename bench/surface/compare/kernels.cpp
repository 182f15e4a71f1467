// Compiled once per instruction set, each time with other flags, another NOOK_TARGET and another name
// of the table. Nothing here may leave behind code that two of these objects would share: no
// containers, no threads.

#include "kernels.hpp"

#include <nook/surface/normals_from_depth.hpp>

#include "baselines.hpp"
#include "outlines/textbook_ao.hpp"

#if !defined(NOOK_COMPARE_TABLE)
#error "NOOK_COMPARE_TABLE names the table, NOOK_COMPARE_NAME the instruction set"
#endif

namespace compare {

namespace {

nook::Outcome alchemy_ao(const Job& job, const nook::AlchemyOptions& options)
{
    return nook::alchemy_ao(job.depth, job.normals, job.visibility, options, job.projection,
                            job.work_map, *job.workspace, Borrowed{job.threads});
}
nook::Outcome horizon_ao(const Job& job, const nook::HorizonOptions& options)
{
    return nook::horizon_ao(job.depth, job.normals, job.visibility, options, job.projection,
                            job.work_map, *job.workspace, Borrowed{job.threads});
}
nook::Outcome bitmask_ao(const Job& job, const nook::BitmaskOptions& options)
{
    return nook::bitmask_ao(job.depth, job.normals, job.visibility, options, job.projection,
                            job.work_map, *job.workspace, Borrowed{job.threads});
}

nook::Outcome bilateral_blur(const Job& job, const Depth& visibility,
                             const nook::BlurOptions& options)
{
    if (job.normals.empty())
        return nook::bilateral_blur(visibility, job.depth, job.visibility, options, job.projection,
                                    job.work_map, *job.workspace, Borrowed{job.threads});
    return nook::bilateral_blur(visibility, job.depth, job.normals, job.visibility, options,
                                job.projection, job.work_map, *job.workspace,
                                Borrowed{job.threads});
}
nook::Outcome upsample(const Job& job, const Depth& half, const nook::UpsampleOptions& options)
{
    if (job.normals.empty())
        return nook::upsample(half, job.depth, job.visibility, options, job.projection,
                              job.work_map, *job.workspace, Borrowed{job.threads});
    return nook::upsample(half, job.depth, job.normals, job.visibility, options, job.projection,
                          job.work_map, *job.workspace, Borrowed{job.threads});
}

nook::Outcome normals_from_depth(const Job& job, const nook::ImageView3<float>& normals)
{
    return nook::normals_from_depth(job.depth, normals, job.projection, Borrowed{job.threads});
}

nook::Outcome outline_mask(const Job& job, const OutlineJob& outlines,
                           const nook::ImageView<std::uint8_t>& groups,
                           const nook::OutlineMaskOptions& options)
{
    return nook::outline_mask(outlines.shells, outlines.extent, job.depth, groups, options,
                              outlines.frame, job.projection, *job.workspace,
                              Borrowed{job.threads});
}
nook::Outcome outline_ao(const Job& job, const OutlineJob& outlines,
                         const nook::OutlineAoOptions& options)
{
    return nook::outline_ao(outlines.shells, outlines.extent, job.depth, job.visibility, options,
                            outlines.frame, job.projection, *job.workspace, Borrowed{job.threads});
}

void textbook_ao(const Job& job, const nook::AlchemyOptions& options)
{
    outlines::textbook_ao(job.depth, job.normals, job.visibility, options, job.projection,
                          job.work_map);
}

}  // namespace

extern const Kernels NOOK_COMPARE_TABLE;
const Kernels NOOK_COMPARE_TABLE = {
    .name = NOOK_COMPARE_NAME,
    .alchemy_ao = alchemy_ao,
    .horizon_ao = horizon_ao,
    .bitmask_ao = bitmask_ao,
    .bilateral_blur = bilateral_blur,
    .upsample = upsample,
    .normals_from_depth = normals_from_depth,
    .outline_mask = outline_mask,
    .outline_ao = outline_ao,
    .textbook_ao = textbook_ao,
#if defined(NOOK_COMPARE_GATHERS)
    .gather_ao = gather_ao,
#else
    .gather_ao = nullptr,
#endif
};

}  // namespace compare
