#pragma once

#include <cstdint>

#include <nook/depth/projection.hpp>
#include <nook/image.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/camera.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "options.hpp"

namespace report {

/// A scene as its camera sees it.
struct View {
    nook::Camera camera;
    nook::Projection projection;
    nook::ViewFrame frame;
    nook::Image<float> depth;
    nook::Image<float> normals;  ///< 3 × width: x, y, z side by side
    nook::Image<std::uint32_t> face;
    nook::Image<std::uint8_t> surface;  ///< 1 where there is one, 0 for background
    std::uint64_t background = 0;
    /// Distances over the surface pixels; 1 where there is none.
    double nearest = 1, median = 1, farthest = 1;

    [[nodiscard]] int width() const { return depth.width(); }
    [[nodiscard]] int height() const { return depth.height(); }
    [[nodiscard]] nook::ImageView3<const float> normal() const
    {
        return nook::ImageView3<const float>::interleaved(normals.data(), width(), height(),
                                                          std::ptrdiff_t{3} * width());
    }
};

/// The camera that the options ask for. Throws Failure when the scene cannot be drawn with it.
[[nodiscard]] nook::Camera checked_camera(const scenes::Scene& scene, const Options& options);

/// Draws the scene with its own camera, in the size that the options ask for.
[[nodiscard]] View draw(const scenes::Scene& scene, const Options& options,
                        nook::ThreadExecutor& threads);

/// Bounds the windows of default runs, in pixels.
inline constexpr int largest_window = 255;

/// The width in pixels of a window that a radius projects to at the median depth: odd, from 3 to
/// `largest_window`.
[[nodiscard]] int default_window(const View& view, double radius);

}  // namespace report
