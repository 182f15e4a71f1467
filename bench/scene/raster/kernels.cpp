// Compiled once per instruction set, each time with other flags, another NOOK_TARGET and another name
// of the table. Nothing here may leave behind code that two of these objects would share: no
// containers, no threads.

#include "kernels.hpp"

#if !defined(NOOK_COMPARE_TABLE)
#error "NOOK_COMPARE_TABLE names the table, NOOK_COMPARE_NAME the instruction set"
#endif

namespace compare {

namespace {

nook::Outcome rasterise(const Job& job, const nook::RasteriseOptions& options)
{
    return nook::rasterise(job.mesh, job.frame, job.projection, job.buffers, options,
                           *job.workspace, Borrowed{job.threads});
}

nook::Outcome visible_counts(const Job& job, const nook::VisibleCountOptions& options)
{
    return nook::visible_counts(job.mesh, job.frame, job.projection, job.width, job.height,
                                job.counts, options, *job.workspace, Borrowed{job.threads});
}

}  // namespace

extern const Kernels NOOK_COMPARE_TABLE;
const Kernels NOOK_COMPARE_TABLE = {
    .name = NOOK_COMPARE_NAME,
    .rasterise = rasterise,
    .visible_counts = visible_counts,
};

}  // namespace compare
