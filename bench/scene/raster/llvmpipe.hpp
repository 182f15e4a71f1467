#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "compare/llvmpipe_context.hpp"
#include "views.hpp"

namespace compare {

/// A mesh in vertex buffers, and targets for its picture. The targets are what nook writes: float depth,
/// RGBA32F normals, R32UI faces.
class LlvmpipeView {
public:
    /// There must be a version. Throws Failure.
    explicit LlvmpipeView(const View& view);
    ~LlvmpipeView();
    LlvmpipeView(const LlvmpipeView&) = delete;
    LlvmpipeView& operator=(const LlvmpipeView&) = delete;

    /// It draws faces with OpenGL ES 3.2 alone, and never counts.
    [[nodiscard]] bool draws(Target target) const;
    /// Clears the targets, draws, and returns when all is drawn.
    void draw(Target target) const;
    /// Reads the faces that were drawn last and counts the pixels of each.
    void count_faces(std::vector<std::uint32_t>& counts);

    /// What was drawn last: x, y, z and 1 for each pixel, 0 without a surface; from the top row down.
    [[nodiscard]] std::vector<float> read_normals() const;
    /// Likewise; nook::no_face without a surface.
    [[nodiscard]] std::vector<std::uint32_t> read_faces() const;

private:
    struct Objects;
    std::unique_ptr<Objects> objects_;
};

}  // namespace compare
