#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

Scene boxes(const BoxesOptions& options)
{
    constexpr double ground = 7;
    Scene scene;
    scene.name = "boxes";
    Builder builder;
    Random random{options.seed};
    builder.box({0, -0.1, 0}, {ground, 0.1, ground}, {0.62f, 0.62f, 0.60f});

    constexpr support::Rgb palette[] = {{0.75f, 0.32f, 0.22f},
                                        {0.80f, 0.62f, 0.25f},
                                        {0.30f, 0.47f, 0.62f},
                                        {0.72f, 0.72f, 0.68f},
                                        {0.38f, 0.55f, 0.35f}};
    const auto colour = [&] { return palette[static_cast<int>(random(0, 5))]; };
    struct Footprint {
        glm::dvec3 at;
        double radius;
    };
    std::vector<Footprint> taken;
    for (int tries = 0, placed = 0; placed < options.count && tries < 100 * options.count;
         ++tries) {
        const glm::dvec3 half{random(0.25, 0.95), random(0.15, 1.1), random(0.25, 0.8)};
        const glm::dvec3 at{random(-ground + 1, ground - 1), half.y,
                            random(-ground + 1, ground - 1)};
        // Boxes may touch at their corners' circles, never meet.
        const double radius = std::hypot(half.x, half.z);
        bool free = true;
        for (const Footprint& other : taken)
            free = free && std::hypot(at.x - other.at.x, at.z - other.at.z) > radius + other.radius;
        if (!free) continue;
        taken.push_back({at, radius});
        const double angle = random(0, 3.2);
        builder.box(at, half, colour(), angle);
        ++placed;
        if (random() < 0.35) {
            const double share = random(0.45, 0.8), height = random(0.12, 0.5);
            builder.box({at.x, 2 * half.y + height, at.z}, {half.x * share, height, half.z * share},
                        colour(), angle + random(-0.5, 0.5));
        }
    }
    builder.finish(scene);
    scene.camera.eye = {5.5, 6.2, 9.5};
    scene.camera.target = {0.2, 0.1, 0.6};
    scene.camera.vertical_fov = 0.62;
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
