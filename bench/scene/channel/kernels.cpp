// Compiled once per instruction set, each time with other flags, another NOOK_TARGET and another name
// of the table. Nothing here may leave behind code that two of these objects would share: no
// containers, no threads.

#include "kernels.hpp"

#if !defined(NOOK_COMPARE_TABLE)
#error "NOOK_COMPARE_TABLE names the table, NOOK_COMPARE_NAME the instruction set"
#endif

namespace compare {

namespace {

using Channel = nook::ViewpointChannel;

const Channel& of(const void* channel) { return *static_cast<const Channel*>(channel); }

nook::Outcome information_ao(const Job& job, const nook::InformationMaps& maps,
                             const nook::InformationOptions& options,
                             nook::InformationReport& report)
{
    return nook::information_ao(job.mesh, job.views, job.view_count, maps, options, &report,
                                *job.workspace, Borrowed{job.threads});
}

std::size_t picture_size(int resolution, int workers)
{
    return nook::visible_counts_scratch_size({}, resolution, resolution, workers);
}

void* make_channel() { return new Channel; }
void free_channel(void* channel) { delete static_cast<Channel*>(channel); }
nook::Outcome build(void* channel, const Job& job, const nook::ChannelOptions& options,
                    const nook::Memory& memory)
{
    return static_cast<Channel*>(channel)->build(job.mesh, job.views, job.view_count, options,
                                                 memory, Borrowed{job.threads});
}
std::size_t entry_count(const void* channel) { return of(channel).entry_count(); }
std::size_t memory_size(const void* channel) { return of(channel).memory_size(); }
nook::Error set_probability(void* channel, nook::ViewProbability probability)
{
    return static_cast<Channel*>(channel)->set_probability(probability);
}

nook::Outcome polygon_information(const void* channel, const Job& job, double* information)
{
    return nook::polygon_mutual_information(of(channel), information, Borrowed{job.threads});
}
nook::Outcome viewpoint_information(const void* channel, const Job& job, double* information)
{
    return nook::viewpoint_mutual_information(of(channel), information, *job.workspace,
                                              Borrowed{job.threads});
}
nook::Outcome entropies(const void* channel, const Job& job, nook::ChannelEntropies& result)
{
    return nook::channel_entropies(of(channel), result, *job.workspace, Borrowed{job.threads});
}

}  // namespace

extern const Kernels NOOK_COMPARE_TABLE;
const Kernels NOOK_COMPARE_TABLE = {
    .name = NOOK_COMPARE_NAME,
    .information_ao = information_ao,
    .picture_size = picture_size,
    .make_channel = make_channel,
    .free_channel = free_channel,
    .build = build,
    .entry_count = entry_count,
    .memory_size = memory_size,
    .set_probability = set_probability,
    .polygon_information = polygon_information,
    .viewpoint_information = viewpoint_information,
    .entropies = entropies,
};

}  // namespace compare
