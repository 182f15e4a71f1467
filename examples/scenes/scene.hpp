#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>

#include "../support/rgb.hpp"

namespace scenes {

/// Triangles, how to look at them, and how far their occlusion reaches. y points up.
struct Scene {
    std::string name;
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    /// Linear light, one per triangle; empty: all light grey.
    std::vector<support::Rgb> albedo;
    nook::Camera camera;
    /// The radius of the occlusion, world units, > 0.
    double radius = 1;

    [[nodiscard]] nook::MeshView mesh() const
    {
        return {positions.data(), positions.size() / 3, indices.data(), indices.size() / 3};
    }
    [[nodiscard]] std::size_t triangles() const { return indices.size() / 3; }
};

/// The box around the finite vertices that triangles use; from 0 to 0 when there is none.
struct Bounds {
    glm::dvec3 low{0, 0, 0}, high{0, 0, 0};

    [[nodiscard]] glm::dvec3 centre() const { return (low + high) * 0.5; }
    [[nodiscard]] double diagonal() const;
};
[[nodiscard]] Bounds bounds(const Scene& scene);

/// The usual radius: 5 % of the diagonal; 1 for a scene without triangles.
[[nodiscard]] double default_radius(const Scene& scene);

/// A camera that shows all of the scene from the front, the right and above, as large as it fits.
[[nodiscard]] nook::Camera three_quarter_view(const Scene& scene, double aspect,
                                              bool orthographic = false);

}  // namespace scenes
