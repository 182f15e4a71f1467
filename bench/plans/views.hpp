#pragma once

#include <cstddef>
#include <string>

#include <nook/owned_image.hpp>

#include "kernels.hpp"
#include "options.hpp"
#include "scenes/scene.hpp"

namespace compare {

/// What the camera of a scene sees: perspective distances and planar normals.
struct View {
    scenes::Scene scene;
    nook::Image<float> depth;
    nook::Image<float> normals;  ///< width × 3 height: the planes of x, y and z
    nook::Projection projection{};
    nook::ViewFrame frame{};
    double diagonal = 1;  ///< of the box around the scene

    View(const std::string& name, const Options& options);
    View(const std::string& name, int width, int height);

    [[nodiscard]] const std::string& name() const { return scene.name; }
    [[nodiscard]] int width() const { return depth.width(); }
    [[nodiscard]] int height() const { return depth.height(); }
    [[nodiscard]] std::size_t pixels() const
    {
        return static_cast<std::size_t>(width()) * static_cast<std::size_t>(height());
    }
    [[nodiscard]] Normals normal() const;
    [[nodiscard]] bool is_surface(int x, int y) const;
    [[nodiscard]] std::size_t surfaces() const;
    /// Leaves nothing out: rough all over, a wall where there was nothing.
    void roughen();
    /// All but the output and the scratch.
    [[nodiscard]] Job job() const;
};

}  // namespace compare
