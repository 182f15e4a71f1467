// Compiled once per instruction set, each time with other flags, another NOOK_TARGET and another name
// of the table. Nothing here may leave behind code that two of these objects would share: no
// containers, no threads.

#include "kernels.hpp"

#include "baselines.hpp"

#if !defined(NOOK_COMPARE_TABLE)
#error "NOOK_COMPARE_TABLE names the table, NOOK_COMPARE_NAME the instruction set"
#endif

namespace compare {

namespace {

nook::Outcome chebyshev_ao(const Depth& depth, const Visibility& visibility,
                           const nook::ChebyshevOptions& options,
                           const nook::Projection& projection, nook::Scratch scratch,
                           const Threads& threads)
{
    return nook::chebyshev_ao(depth, visibility, options, projection, {}, scratch,
                              Borrowed{threads});
}
std::size_t scratch_size(const Depth& depth, const nook::ChebyshevOptions& options,
                         const nook::Projection& projection, int workers)
{
    return nook::chebyshev_ao_scratch_size(depth, options, projection, workers);
}

}  // namespace

extern const Kernels NOOK_COMPARE_TABLE;
const Kernels NOOK_COMPARE_TABLE = {
    .name = NOOK_COMPARE_NAME,
    .chebyshev_ao = chebyshev_ao,
    .chebyshev_ao_scratch_size = scratch_size,
    .shade_moments = shade_moments,
    .fill_tables = fill_tables,
    .shade_tables = shade_tables,
    .shade_tables_radius = shade_tables_radius,
    .running_sums = running_sums,
};

}  // namespace compare
