#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

Scene stairs(const StairsOptions& options)
{
    constexpr double rise = 0.17, run = 0.29, width = 1.5;
    const int steps = options.steps;
    const double length = steps * run, landing_height = (steps + 1) * rise;
    Scene scene;
    scene.name = "stairs";
    Builder builder;
    const support::Rgb stone{0.66f, 0.63f, 0.57f}, wall{0.80f, 0.78f, 0.74f},
        wood{0.42f, 0.26f, 0.15f}, tiles{0.52f, 0.53f, 0.56f};

    // The first flight goes back along the left wall, the second to the right along the back wall.
    const auto solid = [&](double x0, double x1, double y1, double z0, double z1) {
        builder.box({(x0 + x1) / 2, y1 / 2, (z0 + z1) / 2}, {(x1 - x0) / 2, y1 / 2, (z1 - z0) / 2},
                    stone);
    };
    for (int i = 0; i < steps; ++i) solid(0, width, (i + 1) * rise, -(i + 1) * run, -i * run);
    solid(0, width, landing_height, -length - width, -length);
    for (int i = 0; i < steps; ++i)
        solid(width + i * run, width + (i + 1) * run, landing_height + (i + 1) * rise,
              -length - width, -length);

    const double top = landing_height + steps * rise;
    const double end = width + length, back = -length - width;
    solid(end, end + width, top + rise, back, -length);
    const double wall_height = top + 1.9, thickness = 0.2, front = 1.9;
    builder.box({(end + width) / 2, -0.1, (front + back) / 2},
                {(end + width) / 2 + thickness, 0.1, (front - back) / 2 + thickness}, tiles);
    builder.box({-thickness / 2, wall_height / 2, (front + back) / 2},
                {thickness / 2, wall_height / 2, (front - back) / 2}, wall);
    builder.box({(end + width) / 2, wall_height / 2, back - thickness / 2},
                {(end + width) / 2 + thickness, wall_height / 2, thickness / 2}, wall);

    // Posts on the open sides, a rail over each row.
    constexpr double post = 0.022, post_height = 0.85, inset = 0.07;
    const auto first_post = [&](int i) {
        return glm::dvec3{width - inset, (i + 1) * rise, -(i + 0.5) * run};
    };
    const auto second_post = [&](int i) {
        return glm::dvec3{width + (i + 0.5) * run, landing_height + (i + 1) * rise,
                          -length - inset};
    };
    const glm::dvec3 up{0, post_height, 0};
    for (int i = 0; i < steps; ++i) {
        builder.pillar(first_post(i), post, post_height, 12, wood);
        builder.pillar(second_post(i), post, post_height, 12, wood);
    }
    if (steps > 1) {
        builder.bar(first_post(0) + up, first_post(steps - 1) + up, 0.04, wood);
        builder.bar(second_post(0) + up, second_post(steps - 1) + up, 0.04, wood);
    }
    builder.finish(scene);
    scene.camera.eye = {5.6, 5.6, 4.2};
    scene.camera.target = {1.9, 1.5, -2.1};
    scene.camera.vertical_fov = 0.75;
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
