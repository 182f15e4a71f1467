#pragma once

#include <memory>

#include <nook/owned_image.hpp>

#include "compare/llvmpipe_context.hpp"
#include "pictures.hpp"

namespace compare {

/// Which of sixteen rotations of the samples a pixel takes.
enum class ShaderPattern {
    shared,  ///< all of them the first: the places are constants of the shader
    row,     ///< its row's
    pixel    ///< that of its place in a tile of 4 × 4
};

/// outlines::textbook_ao as a fragment shader over a G-buffer in float textures.
class ShaderAo {
public:
    /// Copies the G-buffer. There must be a version.
    explicit ShaderAo(const Picture& picture);
    ~ShaderAo();
    ShaderAo(const ShaderAo&) = delete;
    ShaderAo& operator=(const ShaderAo&) = delete;

    /// Returns the number of a program. Throws Failure.
    [[nodiscard]] unsigned compile(const nook::AlchemyOptions& options, ShaderPattern pattern);
    /// Draws all pixels, and returns when they are drawn.
    void draw(unsigned program) const;
    /// What was drawn last.
    [[nodiscard]] nook::Image<float> read() const;

private:
    struct Objects;
    std::unique_ptr<Objects> objects_;
};

}  // namespace compare
