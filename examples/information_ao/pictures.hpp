#pragma once

#include <cstdint>
#include <vector>

#include <nook/depth/projection.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/camera.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/picture.hpp"

namespace information {

/// Draws values of polygons and vertices as the scene's camera sees them: twice as large as the picture,
/// then halved.
class Painter {
public:
    Painter(const scenes::Scene& scene, int width, int height, nook::ThreadExecutor& threads);

    /// The edges of all polygons in sight.
    [[nodiscard]] support::Picture wireframe() const;
    /// A grey per polygon: 1 is white.
    [[nodiscard]] support::Picture flat(const std::vector<float>& per_polygon) const;
    /// A grey per vertex, interpolated.
    [[nodiscard]] support::Picture smooth(const std::vector<float>& per_vertex) const;
    /// The colour of the surface, linear light, times a grey per vertex; empty: times 1.
    [[nodiscard]] support::Picture coloured(const std::vector<float>& per_vertex) const;
    /// Three greys per vertex.
    [[nodiscard]] support::Picture lit(const std::vector<float>& red,
                                       const std::vector<float>& green,
                                       const std::vector<float>& blue) const;

private:
    template <class PixelColour>
    [[nodiscard]] support::Picture picture_of(const PixelColour& colour) const;
    [[nodiscard]] nook::Image<float> interpolated(const std::vector<float>& per_vertex) const;

    const scenes::Scene& scene_;
    nook::ThreadExecutor& threads_;
    nook::Projection projection_;
    nook::ViewFrame frame_;
    nook::Image<std::uint32_t> faces_;
};

}  // namespace information
