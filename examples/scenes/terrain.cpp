#include <algorithm>
#include <cmath>

#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

namespace {

/// Gradient noise over the plane, about −0.7 … 0.7 (Perlin 2002, with hashed gradients).
double noise(double x, double y, std::uint64_t seed)
{
    const double floor_x = std::floor(x), floor_y = std::floor(y);
    const double fx = x - floor_x, fy = y - floor_y;
    const auto gradient = [&](int i, int j) {
        const auto hx = static_cast<std::uint64_t>(static_cast<std::int64_t>(floor_x) + i);
        const auto hy = static_cast<std::uint64_t>(static_cast<std::int64_t>(floor_y) + j);
        Random random{hx * 0x9e3779b97f4a7c15u ^ hy * 0xc2b2ae3d27d4eb4fu ^ seed};
        const double angle = random(0, 6.283185307179586);
        return std::cos(angle) * (fx - i) + std::sin(angle) * (fy - j);
    };
    const auto fade = [](double t) { return t * t * t * (t * (t * 6 - 15) + 10); };
    const double u = fade(fx), v = fade(fy);
    const double top = std::lerp(gradient(0, 0), gradient(1, 0), u);
    const double bottom = std::lerp(gradient(0, 1), gradient(1, 1), u);
    return std::lerp(top, bottom, v);
}

}  // namespace

Scene terrain(const TerrainOptions& options)
{
    // Distances grow as a power, so every decade gets as many rows of the grid as the next.
    constexpr double nearest = 0.08, farthest = 1.15e5;
    const double decades = std::log10(farthest / nearest);
    Scene scene;
    scene.name = "terrain";
    Builder builder;

    const auto height = [&](double x, double z) {
        const double distance = std::hypot(x, z);
        const double share = std::log10(distance / nearest) / decades;
        // The angle at which the ground is seen rises evenly with the logarithm of the distance.
        double y = distance * std::lerp(-0.60, 0.05, share);
        // Hills on every scale that the grid can show, each from where a viewer is clear of it; the
        // wider ones are the steeper.
        double wave = 0.01;
        for (std::uint64_t octave = 0; wave < 0.9 * distance; ++octave, wave *= 2) {
            const double size = wave / distance;
            if (size < 0.10) continue;
            const double fine = std::min(size / 0.10 - 1, 1.0);
            const double clear = std::clamp(3 * (0.9 - size), 0.0, 1.0);
            // The offset keeps the lattices of the octaves apart.
            const double offset = 0.37 + 3.1 * static_cast<double>(octave);
            const double at = noise(x / wave + offset, z / wave - offset, options.seed + octave);
            const double ridge = 0.5 - 1.8 * std::fabs(at);
            y += wave * fine * clear * std::sqrt(size) * (0.30 * ridge + 0.28 * at);
        }
        return y;
    };
    const auto place = [&](double u, double v) {
        const double distance = nearest * std::pow(10, v * decades);
        const double azimuth = (u - 0.5) * 1.5;
        const double x = distance * std::sin(azimuth), z = -distance * std::cos(azimuth);
        return glm::dvec3{x, height(x, z), z};
    };
    const auto colour = [&](double u, double v) {
        const glm::dvec3 point = place(u, v);
        const double distance = std::hypot(point.x, point.z);
        const double step = 0.01 * distance;
        const double slope = std::hypot(height(point.x + step, point.z) - point.y,
                                        height(point.x, point.z + step) - point.y) /
                             step;
        const auto rock = static_cast<float>(std::clamp(2.5 * slope - 0.9, 0.0, 1.0));
        const auto remote = static_cast<float>(std::clamp(5 * v - 3.9, 0.0, 1.0));
        const support::Rgb grass{0.20f, 0.29f, 0.10f}, stone{0.36f, 0.31f, 0.26f},
            snow{0.82f, 0.84f, 0.88f};
        const support::Rgb ground = grass * (1 - rock) + stone * rock;
        return ground * (1 - remote) + (snow * (1 - rock) + stone * rock) * remote;
    };
    builder.surface({options.columns, options.rows, false, false}, place, colour);
    builder.finish(scene);
    scene.camera.eye = {0, 0, 0};
    scene.camera.target = {0, -0.165, -1};
    scene.camera.vertical_fov = 0.66;
    // Five per cent of the diagonal would be a mountain range. This is a house in the valley.
    scene.radius = 60;
    return scene;
}

}  // namespace scenes
