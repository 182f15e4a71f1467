#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/outline_ao.hpp>
#include <nook/scene/outline_mask.hpp>
#include <nook/scene/outline_view.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/upsample.hpp>
#include <nook/work_map.hpp>

#include "compare/targets.hpp"
#include "compare/threads.hpp"
#include "compare/workspace.hpp"

namespace compare {

using Depth = nook::ImageView<const float>;
using Normals = nook::ImageView3<const float>;
using Visibility = nook::ImageView<float>;

/// What every kernel takes besides its options.
struct Job {
    Depth depth{};
    Normals normals{};
    Visibility visibility{};
    nook::Projection projection{};
    nook::WorkMap work_map{};
    Workspace* workspace = nullptr;
    Threads threads{};
};

/// Shells, and from where they are looked at.
struct OutlineJob {
    nook::OutlineView shells{};
    double extent = 0;
    nook::ViewFrame frame{};
};

/// What is compiled once per instruction set: nook and the baselines, all with the same flags.
struct Kernels {
    const char* name;

    nook::Outcome (*alchemy_ao)(const Job& job, const nook::AlchemyOptions& options);
    nook::Outcome (*horizon_ao)(const Job& job, const nook::HorizonOptions& options);
    nook::Outcome (*bitmask_ao)(const Job& job, const nook::BitmaskOptions& options);
    /// With the normals of the job when it has any.
    nook::Outcome (*bilateral_blur)(const Job& job, const Depth& visibility,
                                    const nook::BlurOptions& options);
    nook::Outcome (*upsample)(const Job& job, const Depth& half,
                              const nook::UpsampleOptions& options);
    nook::Outcome (*normals_from_depth)(const Job& job, const nook::ImageView3<float>& normals);
    nook::Outcome (*outline_mask)(const Job& job, const OutlineJob& outlines,
                                  const nook::ImageView<std::uint8_t>& groups,
                                  const nook::OutlineMaskOptions& options);
    nook::Outcome (*outline_ao)(const Job& job, const OutlineJob& outlines,
                                const nook::OutlineAoOptions& options);

    /// A plain loop over pixels and samples; its options are those of outlines::textbook_ao.
    void (*textbook_ao)(const Job& job, const nook::AlchemyOptions& options);
    /// The same on as many pixels as a register holds, which read their samples by one gather; the
    /// images must be tight. Null where the instruction set has no gathers.
    void (*gather_ao)(const Job& job, const nook::AlchemyOptions& options);
};

using Targets = TargetsOf<Kernels>;
[[nodiscard]] Targets targets();

}  // namespace compare
