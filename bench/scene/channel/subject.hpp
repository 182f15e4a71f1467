#pragma once

#include <string>
#include <vector>

#include <nook/scene/camera.hpp>
#include <nook/thread_executor.hpp>

#include "kernels.hpp"
#include "options.hpp"
#include "scene/meshes.hpp"

namespace compare {

/// A mesh and the viewpoints around it.
struct Subject {
    meshes::Mesh mesh;
    std::vector<nook::Camera> views;
    nook::ThreadExecutor executor;

    explicit Subject(const Options& options);

    /// All but the workspace.
    [[nodiscard]] Job job();
    [[nodiscard]] std::string name() const;
    /// Looks from another level of the icosphere.
    void look_from(int level);
};

}  // namespace compare
