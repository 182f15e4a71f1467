#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include <nook/depth/projection.hpp>
#include <nook/image.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/normal_source.hpp>

/// Depth and normals as the tests of kernels over slices take them.
namespace slice_scenes {

struct Scene {
    nook::Projection projection;
    nook::Image<float> depth;
    std::vector<float> normals;

    Scene(const nook::Projection& given, int width, int height)
        : projection{given},
          depth{width, height, 0.f},
          normals(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3)
    {}
    [[nodiscard]] int width() const { return depth.width(); }
    [[nodiscard]] int height() const { return depth.height(); }
    [[nodiscard]] float* normal(int x, int y)
    {
        return &normals[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width()) +
                         static_cast<std::size_t>(x)) *
                        3];
    }
    [[nodiscard]] nook::NormalSource source() const
    {
        return nook::ImageView3<const float>::interleaved(normals.data(), width(), height(),
                                                          std::ptrdiff_t{3} * width());
    }
    void set(int x, int y, double distance, double nx, double ny, double nz)
    {
        depth(x, y) = static_cast<float>(distance);
        float* const n = normal(x, y);
        n[0] = static_cast<float>(nx);
        n[1] = static_cast<float>(ny);
        n[2] = static_cast<float>(nz);
    }
};

/// Off centre, with pixels that are not square.
inline nook::Projection perspective(double focal = 60)
{
    return {.fx = focal, .fy = focal * 0.8, .cx = 30, .cy = 21};
}
inline nook::Projection orthographic(double pixels = 20)
{
    return {.fx = pixels, .fy = pixels * 0.8, .cx = 30, .cy = 21, .orthographic = true};
}

/// A plane whose normal leans by `tilt` from the view axis towards `azimuth`, `away` from the
/// viewer; nothing where it would lie behind them.
inline Scene plane(const nook::Projection& projection, int width, int height, double tilt,
                   double azimuth, double away)
{
    Scene scene{projection, width, height};
    const double nx = std::sin(tilt) * std::cos(azimuth), ny = std::sin(tilt) * std::sin(azimuth),
                 nz = std::cos(tilt);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double sx = (x + 0.5 - projection.cx) / projection.fx;
            const double sy = (projection.cy - y - 0.5) / projection.fy;
            const double distance = projection.orthographic ? away + (nx * sx + ny * sy) / nz
                                                            : nz * away / (nz - nx * sx - ny * sy);
            if (distance > 0 && distance < 1e30) scene.set(x, y, distance, nx, ny, nz);
        }
    return scene;
}

/// The surface of a function of the position on the screen, with its true normals.
inline Scene relief(const nook::Projection& projection, int width, int height,
                    const std::function<double(double, double)>& distance)
{
    Scene scene{projection, width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto at = [&](double dx, double dy) {
                return nook::view_point(projection, x + 0.5 + dx, y + 0.5 + dy,
                                        distance(x + 0.5 + dx, y + 0.5 + dy));
            };
            const auto r = at(0.01, 0), l = at(-0.01, 0), u = at(0, -0.01), d = at(0, 0.01);
            const double ax = r.x - l.x, ay = r.y - l.y, az = r.z - l.z;
            const double bx = u.x - d.x, by = u.y - d.y, bz = u.z - d.z;
            const double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
            const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
            scene.set(x, y, distance(x + 0.5, y + 0.5), nx / length, ny / length, nz / length);
        }
    return scene;
}

/// Hills, a block in front of them, background, and a pixel without a normal.
inline Scene varied(const nook::Projection& projection, int width, int height)
{
    Scene scene = relief(projection, width, height, [](double x, double y) {
        return 6 + 0.02 * x + 0.5 * std::sin(x * 0.31) * std::cos(y * 0.23) +
               0.1 * std::sin(x * 0.9 + y * 0.7);
    });
    std::mt19937 random{7};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (x > width / 2 && x < width / 2 + 9 && y > 8 && y < 20)
                scene.set(x, y, 4.5, 0, 0, 1);
            if (random() % 97 == 0) scene.depth(x, y) = std::numeric_limits<float>::quiet_NaN();
        }
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < width / 3; ++x)
            scene.depth(x, y) = std::numeric_limits<float>::infinity();
    for (int i = 0; i < 3; ++i) scene.normal(width / 4, height / 2)[i] = 0;
    return scene;
}

}  // namespace slice_scenes
