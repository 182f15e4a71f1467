#include <cmath>

#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

Scene floor(const FloorOptions& options)
{
    constexpr double half = 24;
    Scene scene;
    scene.name = "floor";
    Builder builder;
    const int tiles = options.tiles;
    builder.surface(
        {tiles, tiles, false, false},
        [&](double u, double v) {
            return glm::dvec3{half * (2 * u - 1), 0, half * (1 - 2 * v)};
        },
        [&](double u, double v) {
            const bool dark = (int(u * tiles) + int(v * tiles)) % 2 != 0;
            return dark ? support::Rgb{0.30f, 0.34f, 0.40f} : support::Rgb{0.72f, 0.70f, 0.64f};
        });
    builder.finish(scene);
    // Looking at the origin, so that even the corners of a wide picture stay on the floor.
    constexpr double distance = 8;
    scene.camera.target = {0, 0, 0};
    scene.camera.eye = {0, distance * std::sin(options.pitch), distance * std::cos(options.pitch)};
    scene.camera.vertical_fov = 0.80;
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
