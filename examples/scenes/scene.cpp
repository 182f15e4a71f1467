#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

namespace scenes {

double Bounds::diagonal() const { return glm::length(high - low); }

Bounds bounds(const Scene& scene)
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Bounds box{glm::dvec3{infinity}, glm::dvec3{-infinity}};
    for (const std::uint32_t index : scene.indices) {
        const float* at = scene.positions.data() + 3 * std::size_t{index};
        const glm::dvec3 point{at[0], at[1], at[2]};
        if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || !std::isfinite(at[2])) continue;
        box.low = glm::min(box.low, point);
        box.high = glm::max(box.high, point);
    }
    return box.low.x <= box.high.x ? box : Bounds{};
}

double default_radius(const Scene& scene)
{
    const double diagonal = bounds(scene).diagonal();
    return diagonal > 0 ? 0.05 * diagonal : 1;
}

nook::Camera three_quarter_view(const Scene& scene, double aspect, bool orthographic)
{
    nook::Camera camera;
    camera.orthographic = orthographic;
    camera.vertical_fov = 0.7;
    const Bounds box = bounds(scene);
    const glm::dvec3 centre = box.centre();
    const glm::dvec3 towards = glm::normalize(glm::dvec3{0.55, 0.45, 1});
    camera.target = centre;
    camera.eye = centre + towards;
    const double diagonal = box.diagonal();
    if (!(diagonal > 0)) return camera;

    // The nearest distance, and the smallest height, at which every vertex is in the picture.
    const nook::ViewFrame frame = nook::view_frame(camera);
    const double slope = std::tan(camera.vertical_fov / 2);
    double distance = 0, height = 0;
    for (const std::uint32_t index : scene.indices) {
        const float* at = scene.positions.data() + 3 * std::size_t{index};
        if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || !std::isfinite(at[2])) continue;
        const glm::dvec3 offset =
            nook::direction_to_view(frame, glm::dvec3{at[0], at[1], at[2]} - centre);
        const double extent = (std::max)(std::fabs(offset.x) / aspect, std::fabs(offset.y));
        distance = (std::max)(distance, extent / slope + offset.z);
        height = (std::max)(height, 2 * extent);
    }
    constexpr double margin = 1.06;
    camera.eye = centre + towards * (orthographic ? diagonal : distance * margin);
    camera.view_height = height * margin;
    return camera;
}

}  // namespace scenes
