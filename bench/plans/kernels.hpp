#pragma once

#include <cstdint>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/outline_mask.hpp>
#include <nook/scene/outline_view.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/upsample.hpp>
#include <nook/work_map.hpp>

#include "compare/targets.hpp"
#include "compare/workspace.hpp"

namespace compare {

using Depth = nook::ImageView<const float>;
using Normals = nook::ImageView3<const float>;
using Visibility = nook::ImageView<float>;
using Groups = nook::ImageView<std::uint8_t>;

/// What every kernel takes besides its options. One thread.
struct Job {
    Depth depth{};
    Normals normals{};
    Visibility visibility{};
    nook::Projection projection{};
    nook::ViewFrame frame{};
    nook::WorkMap work_map{};
    Workspace* workspace = nullptr;
};

/// Shells, and how wide they are.
struct OutlineJob {
    nook::OutlineView shells{};
    double extent = 0;
    int threshold = 2;
};

struct Rays {
    double radius = 1;
    int directions = 16;
};

/// What is compiled once per instruction set. A Bvh belongs to the instruction set that made it and so
/// is a `void*` here.
struct Kernels {
    const char* name;

    /// Reads the depth, or the depth and the normals, and writes ones: what leaving everything out
    /// costs at least.
    void (*ones_of_depth)(const Job& job);
    void (*ones_of_both)(const Job& job);

    nook::Outcome (*chebyshev_ao)(const Job& job, const nook::ChebyshevOptions& options);
    nook::Outcome (*alchemy_ao)(const Job& job, const nook::AlchemyOptions& options);
    nook::Outcome (*horizon_ao)(const Job& job, const nook::HorizonOptions& options);
    nook::Outcome (*bitmask_ao)(const Job& job, const nook::BitmaskOptions& options);
    nook::Outcome (*bilateral_blur)(const Job& job, const Depth& visibility,
                                    const nook::BlurOptions& options);
    nook::Outcome (*upsample)(const Job& job, const Depth& half,
                              const nook::UpsampleOptions& options);

    nook::Outcome (*plan_alchemy)(const Job& job, const Groups& groups,
                                  const nook::AlchemyOptions& options, double tolerance);
    nook::Outcome (*plan_horizon)(const Job& job, const Groups& groups,
                                  const nook::HorizonOptions& options, double tolerance);
    nook::Outcome (*plan_bitmask)(const Job& job, const Groups& groups,
                                  const nook::BitmaskOptions& options, double tolerance);
    nook::WorkMap (*surface_map)(const Groups& groups, double tolerance);
    nook::Outcome (*outline_mask)(const Job& job, const OutlineJob& outlines, const Groups& groups);

    /// Null where there is no such planner.
    nook::Outcome (*plan_depth)(const Job& job, const Groups& groups,
                                const nook::ChebyshevOptions& options);
    nook::Outcome (*plan_traced)(const void* bvh, const Job& job, const Groups& groups,
                                 const Rays& rays);

    void* (*make_bvh)();
    void (*free_bvh)(void* bvh);
    nook::Outcome (*build)(void* bvh, const nook::MeshView& mesh);
    nook::Outcome (*traced_ao)(const void* bvh, const Job& job, const Rays& rays);
};

using Targets = TargetsOf<Kernels>;
[[nodiscard]] Targets targets();

}  // namespace compare
