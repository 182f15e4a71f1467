#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/visible_counts.hpp>

#include "compare/targets.hpp"
#include "compare/threads.hpp"
#include "compare/workspace.hpp"

namespace compare {

/// What to draw, and with what.
struct Job {
    nook::MeshView mesh{};
    nook::ViewFrame frame{};
    nook::Projection projection{};
    int width = 0, height = 0;
    nook::GBuffer buffers{};
    /// Instead of buffers: one per triangle.
    std::uint32_t* counts = nullptr;
    Workspace* workspace = nullptr;
    Threads threads{};
};

/// What is compiled once per instruction set.
struct Kernels {
    const char* name;

    nook::Outcome (*rasterise)(const Job& job, const nook::RasteriseOptions& options);
    nook::Outcome (*visible_counts)(const Job& job, const nook::VisibleCountOptions& options);
};

using Targets = TargetsOf<Kernels>;
[[nodiscard]] Targets targets();

}  // namespace compare
