#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>

/// Meshes made by code for programs that measure, the same on every run.
namespace meshes {

struct Mesh {
    std::string name;
    std::vector<float> positions, normals;  ///< x, y, z of each vertex; normals of unit length
    std::vector<std::uint32_t> indices;
    nook::Camera camera;

    [[nodiscard]] std::size_t triangles() const { return indices.size() / 3; }
    [[nodiscard]] nook::MeshView view() const
    {
        nook::MeshView result{positions.data(), positions.size() / 3, indices.data(), triangles()};
        result.normals = normals.empty() ? nullptr : normals.data();
        return result;
    }
};

using Point = nook::detail::Vector3;

inline void add_vertex(Mesh& mesh, const Point& p)
{
    mesh.positions.insert(mesh.positions.end(), {static_cast<float>(p.x), static_cast<float>(p.y),
                                                 static_cast<float>(p.z)});
}

/// Gives every vertex the mean of the normals around it, weighted by area.
inline void add_normals(Mesh& mesh)
{
    std::vector<Point> sums(mesh.positions.size() / 3, Point{0, 0, 0});
    const nook::MeshView view = mesh.view();
    for (std::size_t t = 0; t < mesh.triangles(); ++t) {
        const auto [a, b, c] = nook::detail::mesh_triangle(view, t);
        for (int k = 0; k < 3; ++k) {
            Point& sum = sums[mesh.indices[3 * t + static_cast<std::size_t>(k)]];
            sum = sum + cross(b - a, c - a);
        }
    }
    mesh.normals.clear();
    for (const Point& sum : sums) {
        const Point n = normalised(sum);
        mesh.normals.insert(mesh.normals.end(), {static_cast<float>(n.x), static_cast<float>(n.y),
                                                 static_cast<float>(n.z)});
    }
}

/// Adds columns × rows quads of a surface over [0, 1)² that closes in both directions, anticlockwise
/// as seen from the side where u turns right and v up.
template <class Surface>
void add_wrapped(Mesh& mesh, int columns, int rows, const Surface& surface)
{
    const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i)
            add_vertex(mesh, surface(double(i) / columns, double(j) / rows));
    const auto at = [&](int i, int j) {
        return first + static_cast<std::uint32_t>((j % rows) * columns + i % columns);
    };
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1),
                                d = at(i, j + 1);
            mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
        }
}

/// A sphere whose radius `radius(direction)` tells, made of 12 n² triangles of much the same size: the
/// grids on the six sides of a cube, moved outwards. Closed; neighbours share their vertices.
template <class Radius>
void add_sphere(Mesh& mesh, int n, const Point& centre, const Radius& radius)
{
    std::unordered_map<std::uint64_t, std::uint32_t> known;
    known.reserve(6 * static_cast<std::size_t>(n) * static_cast<std::size_t>(n) + 2);
    const auto side = [&](int k) { return std::tan((2.0 * k / n - 1) * std::numbers::pi / 4); };
    const auto vertex = [&](const int(&k)[3]) {
        const auto stride = static_cast<std::uint64_t>(n) + 1;
        std::uint64_t key = 0;
        for (const int part : k) key = key * stride + static_cast<std::uint64_t>(part);
        const auto [entry, fresh] =
            known.try_emplace(key, static_cast<std::uint32_t>(mesh.positions.size() / 3));
        if (fresh) {
            const Point direction = normalised(Point{side(k[0]), side(k[1]), side(k[2])});
            add_vertex(mesh, centre + direction * radius(direction));
        }
        return entry->second;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (const int level : {0, n})
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) {
                    const auto corner = [&](int u, int v) {
                        int k[3] = {};
                        k[axis] = level;
                        k[(axis + 1) % 3] = level == 0 ? j + v : i + u;
                        k[(axis + 2) % 3] = level == 0 ? i + u : j + v;
                        return vertex(k);
                    };
                    const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1),
                                        d = corner(0, 1);
                    mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
                }
}

/// How many steps n make `per_square` n² triangles come closest to a number of them.
[[nodiscard]] inline int steps_for(double triangles, double per_square)
{
    return (std::max)(static_cast<int>(std::lround(std::sqrt(triangles / per_square))), 2);
}

/// "300 k", "1 M".
[[nodiscard]] inline std::string short_count(std::size_t count)
{
    const auto whole = [&](std::size_t unit) { return std::to_string((count + unit / 2) / unit); };
    return count >= 999'500 && count % 1'000'000 < 50'000 ? whole(1'000'000) + " M"
           : count >= 1'000                               ? whole(1'000) + " k"
                                                          : std::to_string(count);
}

/// Twenty tori and twenty spheres in a heap, of about that many triangles in all. They cover about two
/// fifths of a picture of 1920 × 1080.
[[nodiscard]] inline Mesh solids(std::size_t triangles)
{
    Mesh mesh;
    mesh.name = short_count(triangles);
    std::uint32_t state = 1;
    const auto random = [&](double low, double high) {
        state = state * 1664525u + 1013904223u;
        return low + (high - low) * (state >> 8) * 0x1p-24;
    };
    const double each = double(triangles) / 40;
    for (int i = 0; i < 40; ++i) {
        const Point centre{random(-3.2, 3.2), random(-1.9, 1.9), random(-2.5, 2.5)};
        const double size = random(0.35, 0.75);
        if (i % 2 == 1) {
            add_sphere(mesh, steps_for(each, 12), centre, [&](const Point&) { return size; });
            continue;
        }
        const Point axis =
            normalised(Point{random(-1, 1), random(-1, 1), random(-1, 1)} + Point{0, 0, 0.01});
        const Point x =
            normalised(cross(axis, std::fabs(axis.x) < 0.5 ? Point{1, 0, 0} : Point{0, 1, 0}));
        const Point y = cross(axis, x);
        const int rows = steps_for(each, 4);
        add_wrapped(mesh, 2 * rows, rows, [&](double u, double v) {
            const double turn = 2 * std::numbers::pi * u, around = 2 * std::numbers::pi * v;
            const Point out = x * std::cos(turn) + y * std::sin(turn);
            return centre +
                   (out * (1 + 0.35 * std::cos(around)) + axis * (0.35 * std::sin(around))) * size;
        });
    }
    add_normals(mesh);
    mesh.camera.eye = {0, 0, 8};
    mesh.camera.vertical_fov = 0.7;
    return mesh;
}

/// A closed body with dents and bumps, some deep enough to hide one another, of about that many
/// triangles.
[[nodiscard]] inline Mesh bumpy_sphere(std::size_t triangles)
{
    Mesh mesh;
    mesh.name = "bumpy sphere, " + short_count(triangles);
    add_sphere(mesh, steps_for(double(triangles), 12), {0, 0, 0}, [](const Point& d) {
        const double broad =
            std::sin(6 * d.x + 1) * std::sin(5 * d.y + 2) + std::sin(7 * d.z) * std::sin(6 * d.x);
        const double fine = std::sin(23 * d.x) * std::sin(21 * d.y + 1) * std::sin(22 * d.z + 2);
        return 1 + 0.2 * broad + 0.05 * fine;
    });
    add_normals(mesh);
    mesh.camera.eye = {1, 1.5, 4};
    return mesh;
}

}  // namespace meshes
