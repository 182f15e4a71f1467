#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/camera.hpp>

#include "kernels.hpp"
#include "options.hpp"
#include "scenes/scene.hpp"

namespace compare {

/// A G-buffer of perspective distances and planar normals, and how far to look.
struct Picture {
    std::string name;
    nook::Image<float> depth;
    nook::Image<float> normals;  ///< width × 3 height: the planes of x, y and z
    nook::Projection projection{};
    nook::ViewFrame frame{};
    double radius = 1;

    Picture(std::string picture_name, int width, int height);

    [[nodiscard]] int width() const { return depth.width(); }
    [[nodiscard]] int height() const { return depth.height(); }
    [[nodiscard]] std::size_t pixels() const
    {
        return static_cast<std::size_t>(width()) * static_cast<std::size_t>(height());
    }
    [[nodiscard]] nook::ImageView3<float> normal();
    [[nodiscard]] Normals normal() const;
    /// All but the output and what only some jobs need.
    [[nodiscard]] Job job() const;
    /// The share of pixels with a surface, and how many pixels the radius covers there on average.
    [[nodiscard]] double surface_share() const;
    [[nodiscard]] double mean_reach() const;
};

/// Ground that recedes in waves, with blocks that stand out from it, below a sky with a ragged horizon;
/// with exact normals. The radius covers 61 of 1080 pixels on average.
[[nodiscard]] Picture rolling_picture(int width, int height);

/// What the camera of a scene sees.
[[nodiscard]] Picture drawn_picture(const scenes::Scene& scene, int width, int height);

/// The subjects of the command line, at 1080p; with --quick smaller. With the reach it asks for.
[[nodiscard]] std::vector<Picture> pictures(const Options& options);

}  // namespace compare
