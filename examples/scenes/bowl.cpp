#include <cmath>
#include <numbers>
#include <vector>

#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

namespace {

/// The section of a bowl of radius 1 from the middle of its underside, round the foot and the rim, to
/// the middle of the inside: radius and height.
std::vector<glm::dvec2> section(double thickness)
{
    constexpr double quarter = std::numbers::pi / 2;
    constexpr double rim_height = 0.92, outer_depth = 0.85, foot_radius = 0.42;
    std::vector<glm::dvec2> points{{0, 0.075},
                                   {foot_radius - 0.075, 0.075},
                                   {foot_radius - 0.065, 0.01},
                                   {foot_radius - 0.055, 0},
                                   {foot_radius - 0.01, 0},
                                   {foot_radius, 0.01}};
    // The outer wall: a quarter of an ellipse, from where the foot meets it up to the rim.
    const double foot_angle = std::acos(foot_radius);
    constexpr int outer = 26, rim = 8, inner = 34;
    for (int i = 0; i <= outer; ++i) {
        const double angle = foot_angle * (1 - double(i) / outer);
        points.push_back({std::cos(angle), rim_height - outer_depth * std::sin(angle)});
    }
    for (int i = 1; i < rim; ++i) {
        const double angle = 2 * quarter * i / rim;
        points.push_back({1 - thickness / 2 + thickness / 2 * std::cos(angle),
                          rim_height + thickness / 2 * std::sin(angle)});
    }
    const double inner_depth = outer_depth - thickness;
    for (int i = 0; i <= inner; ++i) {
        const double angle = quarter * i / inner;
        points.push_back({i == inner ? 0 : (1 - thickness) * std::cos(angle),
                          rim_height - inner_depth * std::sin(angle)});
    }
    return points;
}

}  // namespace

Scene bowl(const BowlOptions& options)
{
    Scene scene;
    scene.name = "bowl";
    Builder builder;

    const support::Rgb wood{0.50f, 0.32f, 0.18f}, dark_wood{0.36f, 0.22f, 0.12f};
    builder.box({0, -0.06, 0}, {4.2, 0.06, 3.6}, wood);
    builder.box({0, -0.22, 0}, {3.9, 0.10, 3.3}, dark_wood);
    for (const double x : {-3.8, 3.8})
        for (const double z : {-3.2, 3.2}) builder.box({x, -1.02, z}, {0.14, 0.9, 0.14}, dark_wood);

    std::vector<glm::dvec2> points = section(options.thickness);
    for (glm::dvec2& at : points) at *= options.radius;
    builder.turned({0, 0, 0}, points, options.segments, {0.72f, 0.74f, 0.76f});
    builder.finish(scene);
    scene.camera.eye = {0.45, 4.5, 2.5};
    scene.camera.target = {0, 0.30, 0.02};
    scene.camera.vertical_fov = 0.56;
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
