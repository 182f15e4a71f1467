#pragma once

#include <cstdint>
#include <string>

#include <nook/depth/projection.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/outline.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"

namespace outlines {

/// A scene and how its camera turns: about what it looks at, or about itself where the scene is a room.
struct Subject {
    scenes::Scene scene;
    double radius = 1;
    bool room = false;

    /// The camera of a frame, turned by the angle in radians.
    [[nodiscard]] nook::Camera camera(double angle) const;
};

/// What the camera sees.
struct Frame {
    nook::Projection projection;
    nook::ViewFrame axes;
    nook::Image<float> depth;
    nook::Image<float> normals;  ///< 3 × height: planes of x, y and z
    nook::Image<std::uint32_t> faces;
    std::uint64_t surfaces = 0;  ///< pixels that hold one

    Frame(const scenes::Scene& scene, const nook::Camera& camera, int width, int height,
          nook::ThreadExecutor& threads);

    [[nodiscard]] int width() const { return depth.width(); }
    [[nodiscard]] int height() const { return depth.height(); }
    [[nodiscard]] nook::ImageView3<const float> normal() const;
};

/// Of one frame.
struct Times {
    double average = 0, worst = 0;  ///< milliseconds
};

}  // namespace outlines
