#include <cmath>
#include <numbers>
#include <vector>

#include "builder.hpp"
#include "even_rings.hpp"
#include "scenes.hpp"

namespace scenes {

namespace {

/// A queen of a chess set: base, three flounces, belt, bodice, collar, head, crown with its ball.
Section queen()
{
    constexpr double pi = std::numbers::pi;
    Section section{{0, 0}};
    section.line({0.84, 0})
        .arc({0.84, 0.1}, pi)
        .line({0.74, 0.24})
        .arc({0.74, 0.31}, pi)
        // The flounces: each begins outside the one below, which ends under it.
        .curve({0.72, 0.52}, {0.6, 0.62}, {0.52, 0.84})
        .line({0.6, 0.78})
        .curve({0.6, 0.96}, {0.5, 1.04}, {0.42, 1.2})
        .line({0.5, 1.14})
        .curve({0.48, 1.32}, {0.3, 1.36}, {0.26, 1.6})
        .arc({0.26, 1.65}, pi)
        .curve({0.27, 1.86}, {0.46, 1.92}, {0.45, 2.12})
        .curve({0.44, 2.3}, {0.24, 2.3}, {0.19, 2.42})
        // The collar, up outside and down inside.
        .curve({0.24, 2.5}, {0.38, 2.52}, {0.46, 2.68})
        .arc({0.43, 2.7}, pi)
        .curve({0.34, 2.62}, {0.24, 2.58}, {0.14, 2.58})
        .line({0.14, 2.7})
        .curve({0.36, 2.72}, {0.44, 3.08}, {0.2, 3.24})
        .curve({0.24, 3.34}, {0.3, 3.4}, {0.34, 3.5})
        .arc({0.315, 3.515}, pi)
        .curve({0.24, 3.44}, {0.16, 3.42}, {0.09, 3.44})
        .arc({0, 3.55}, pi / 2 + std::atan2(0.11, 0.09));
    return section;
}

}  // namespace

Scene lathe(const LatheOptions& options)
{
    Scene scene;
    scene.name = "lathe";
    Builder builder;
    const support::Rgb wood{0.62f, 0.44f, 0.26f};
    const Section section = queen();
    std::vector<Ring> rings = even_rings(section, options.edge);
    add_rings(
        builder, rings,
        [&](const Ring& ring, int i) {
            const glm::dvec2 at = section.at(ring.along);
            const double angle = 2 * std::numbers::pi * i / ring.count;
            return glm::dvec3{at.x * std::cos(angle), at.y, -at.x * std::sin(angle)};
        },
        [](std::size_t, int) { return true; }, [&](double) { return wood; });
    builder.finish(scene);
    scene.camera = three_quarter_view(scene, 1);
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
