#pragma once

#include <memory>
#include <string>

#include <nook/owned_image.hpp>

#include "pictures.hpp"

/// Mesa's rasteriser for the CPU, which compiles shaders to vector code.
namespace compare {

/// Who draws, and the version of Mesa; empty when the program was built without EGL, or when this
/// machine has no such renderer.
[[nodiscard]] const std::string& llvmpipe_version();

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

/// Keeps this thread on the CPU that it runs on, where the system lets it.
class Pinned {
public:
    Pinned();
    ~Pinned();
    Pinned(const Pinned&) = delete;
    Pinned& operator=(const Pinned&) = delete;

private:
    struct Before;
    std::unique_ptr<Before> before_;
};

}  // namespace compare
