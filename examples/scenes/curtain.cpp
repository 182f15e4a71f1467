#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

Scene curtain(const CurtainOptions& options)
{
    Scene scene;
    scene.name = "curtain";
    Builder builder;
    // The ground is wide enough for its ends to be out of reach of what hangs over its middle.
    const double reach = options.gap + 2 * options.radius, length = 1.6 * options.radius;
    builder.box({0, -0.5, 0}, {reach, 0.5, length + options.radius}, {0.66f, 0.65f, 0.62f});
    builder.box({0, options.gap + options.height / 2, 0},
                {options.width / 2, options.height / 2, length}, {0.62f, 0.20f, 0.16f});
    builder.finish(scene);
    // From one side and a little above the gap, so that the ground shows on both sides and below.
    scene.camera.eye = {-1.75 * options.radius, 0.85 * options.radius, 2.1 * options.radius};
    scene.camera.target = {0.1 * options.radius, 0.22 * options.radius, 0};
    scene.camera.vertical_fov = 0.62;
    scene.radius = options.radius;
    return scene;
}

}  // namespace scenes
