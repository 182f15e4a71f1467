#pragma once

#include <cstddef>

#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/channel_measures.hpp>
#include <nook/scene/information_ao.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/viewpoint_channel.hpp>

#include "compare/targets.hpp"
#include "compare/threads.hpp"
#include "compare/workspace.hpp"

namespace compare {

/// A mesh, and from where it is looked at.
struct Job {
    nook::MeshView mesh{};
    const nook::Camera* views = nullptr;
    std::size_t view_count = 0;
    Workspace* workspace = nullptr;
    Threads threads{};
};

/// What is compiled once per instruction set. A ViewpointChannel belongs to the instruction set that made
/// it and so is a `void*` here.
struct Kernels {
    const char* name;

    nook::Outcome (*information_ao)(const Job& job, const nook::InformationMaps& maps,
                                    const nook::InformationOptions& options,
                                    nook::InformationReport& report);
    /// What drawing takes whatever the mesh, in place of an item buffer.
    std::size_t (*picture_size)(int resolution, int workers);

    void* (*make_channel)();
    void (*free_channel)(void* channel);
    nook::Outcome (*build)(void* channel, const Job& job, const nook::ChannelOptions& options,
                           const nook::Memory& memory);
    std::size_t (*entry_count)(const void* channel);
    std::size_t (*memory_size)(const void* channel);
    nook::Error (*set_probability)(void* channel, nook::ViewProbability probability);

    /// The measures take the workspace and the threads of a job.
    nook::Outcome (*polygon_information)(const void* channel, const Job& job, double* information);
    nook::Outcome (*viewpoint_information)(const void* channel, const Job& job,
                                           double* information);
    nook::Outcome (*entropies)(const void* channel, const Job& job,
                               nook::ChannelEntropies& entropies);
};

using Targets = TargetsOf<Kernels>;
[[nodiscard]] Targets targets();

}  // namespace compare
