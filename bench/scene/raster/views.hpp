#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/camera.hpp>

#include "kernels.hpp"
#include "options.hpp"
#include "scene/meshes.hpp"

namespace compare {

/// A mesh as its camera sees it in a picture of some size.
struct View {
    std::shared_ptr<const meshes::Mesh> mesh;
    int width = 0, height = 0;
    nook::Projection projection{};
    nook::ViewFrame frame{};

    [[nodiscard]] std::string name() const;
    /// All but buffers and workspace.
    [[nodiscard]] Job job() const;
};

/// The subjects of the command line, each in two sizes; with --quick small, in one.
[[nodiscard]] std::vector<View> views(const Options& options);

/// Buffers for whatever there is to draw.
struct Buffers {
    nook::Image<float> depth, planes, interleaved;
    nook::Image<std::uint32_t> face;
    std::vector<std::uint32_t> counts;

    explicit Buffers(const View& view);

    [[nodiscard]] nook::ImageView3<float> planar();
    [[nodiscard]] nook::ImageView3<float> pixels();
};

/// What a call draws.
enum class Target {
    facets,              ///< depth and each triangle's own normal, in three planes
    facets_interleaved,  ///< the same, x, y and z side by side
    smooth,              ///< depth and interpolated normals
    depth,
    faces,  ///< depth and the index of the triangle
    counts  ///< how many pixels show each triangle, and no picture
};
[[nodiscard]] const char* text_of(Target target);

/// Draws with kernels of nook; the workspace keeps its memory. Throws Failure.
void draw(const Kernels& kernels, Target target, const View& view, Buffers& buffers,
          Workspace& workspace, const Threads& threads = {});

}  // namespace compare
