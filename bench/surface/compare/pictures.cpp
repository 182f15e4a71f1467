#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include <nook/depth/source.hpp>
#include <nook/scene/rasteriser.hpp>

#include "compare/failure.hpp"
#include "scenes/scenes.hpp"

namespace compare {

namespace {

/// A number in [0, 1) for a place (a multiplicative hash, finalised as in MurmurHash3).
double noise(int x, int y, std::uint32_t seed)
{
    std::uint32_t bits = static_cast<std::uint32_t>(x) * 0x9e3779b1u +
                         static_cast<std::uint32_t>(y) * 0x85ebca77u + seed * 0xc2b2ae3du;
    bits ^= bits >> 16;
    bits *= 0x85ebca6bu;
    bits ^= bits >> 13;
    bits *= 0xc2b2ae35u;
    bits ^= bits >> 16;
    return bits * 0x1p-32;
}

bool is_surface(float distance)
{
    return nook::is_surface(distance, (std::numeric_limits<float>::max)());
}

/// The distance of the waves at a place of the picture, in parts of its height.
double wave_distance(double u, double v)
{
    const double plane = 4 / (0.2 + v);
    return plane *
           (1 + 0.05 * std::sin(14 * u + 3 * std::sin(5 * v)) + 0.03 * std::sin(23 * u - 37 * v));
}

}  // namespace

Picture::Picture(std::string picture_name, int width, int height)
    : name{std::move(picture_name)},
      depth{width, height},
      normals{width, 3 * height}
{}

nook::ImageView3<float> Picture::normal()
{
    const auto plane = [&](int i) {
        return nook::ImageView<float>{&normals(0, i * height()), width(), height(), width(), 1};
    };
    return {plane(0), plane(1), plane(2)};
}
Normals Picture::normal() const
{
    const auto plane = [&](int i) {
        return Depth{&normals(0, i * height()), width(), height(), width(), 1};
    };
    return {plane(0), plane(1), plane(2)};
}

Job Picture::job() const
{
    return {.depth = depth.view(), .normals = normal(), .projection = projection};
}

double Picture::surface_share() const
{
    std::size_t count = 0;
    for (const float distance : depth) count += is_surface(distance);
    return double(count) / double(pixels());
}

double Picture::mean_reach() const
{
    double sum = 0, count = 0;
    for (const float distance : depth)
        if (is_surface(distance)) {
            sum += radius * projection.fx / double{distance};
            ++count;
        }
    return count > 0 ? sum / count : 0;
}

Picture rolling_picture(int width, int height)
{
    Picture picture{"rolling", width, height};
    nook::Projection& p = picture.projection;
    p.fx = p.fy = height / (2 * std::tan(std::numbers::pi / 6));
    p.cx = width / 2.0;
    p.cy = height / 2.0;
    picture.radius = 0.33;
    const nook::ImageView3<float> normals = picture.normal();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double u = (x + 0.5) / height, v = (y + 0.5) / height;
            const double hill = 0.1 + 0.04 * std::sin(7 * u) + 0.015 * std::sin(61 * u);
            if (v < hill + 0.01 * noise(x, 0, 3)) {
                picture.depth(x, y) = std::numeric_limits<float>::infinity();
                continue;
            }
            // Blocks stand nearer; across their faces the waves go on.
            const int column = static_cast<int>(u * 12), row = static_cast<int>(v * 12);
            const double nearer = noise(column, row, 1) < 0.3 ? 0.85 : 1;
            const auto point = [&](double along, double down) -> glm::dvec3 {
                const nook::ViewPoint at = nook::view_point(p, along * height, down * height,
                                                            nearer * wave_distance(along, down));
                return {at.x, at.y, at.z};
            };
            constexpr double step = 1e-5;
            const glm::dvec3 across = point(u + step, v) - point(u - step, v);
            const glm::dvec3 up = point(u, v - step) - point(u, v + step);
            const glm::dvec3 normal{across.y * up.z - across.z * up.y,
                                    across.z * up.x - across.x * up.z,
                                    across.x * up.y - across.y * up.x};
            const double length =
                std::sqrt(normal.x * normal.x + normal.y * normal.y + normal.z * normal.z);
            picture.depth(x, y) = static_cast<float>(nearer * wave_distance(u, v));
            normals.x(x, y) = static_cast<float>(normal.x / length);
            normals.y(x, y) = static_cast<float>(normal.y / length);
            normals.z(x, y) = static_cast<float>(normal.z / length);
        }
    return picture;
}

Picture drawn_picture(const scenes::Scene& scene, int width, int height)
{
    Picture picture{scene.name, width, height};
    picture.projection = nook::projection(scene.camera, width, height);
    picture.frame = nook::view_frame(scene.camera);
    picture.radius = scene.radius;
    checked(nook::rasterise(scene.mesh(), picture.frame, picture.projection,
                            {picture.depth.view(), picture.normal(), {}}),
            "rasterise");
    if (picture.projection.orthographic || !(picture.surface_share() > 0))
        throw Failure{scene.name + ": the camera sees nothing of it, or has no perspective"};
    return picture;
}

std::vector<Picture> pictures(const Options& options)
{
    std::vector<std::string> subjects = options.subjects;
    if (subjects.empty()) subjects = {"rolling", "arcade", "temple"};
    const int width = options.quick ? 320 : 1920, height = options.quick ? 180 : 1080;
    std::vector<Picture> result;
    for (const std::string& subject : subjects) {
        Picture picture =
            subject == "rolling"
                ? rolling_picture(width, height)
                : drawn_picture(scenes::load(subject, double(width) / height), width, height);
        if (options.reach > 0)
            picture.radius *= options.reach * height / 1080.0 / picture.mean_reach();
        result.push_back(std::move(picture));
    }
    return result;
}

}  // namespace compare
