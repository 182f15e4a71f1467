#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>

/// Meshes for the tests of this folder.
namespace meshes {

using Point = std::array<double, 3>;

struct Mesh {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;

    [[nodiscard]] nook::MeshView view() const
    {
        return {.positions = positions.data(),
                .vertex_count = positions.size() / 3,
                .indices = indices.data(),
                .triangle_count = indices.size() / 3};
    }
    std::uint32_t vertex(const Point& p)
    {
        for (const double c : p) positions.push_back(static_cast<float>(c));
        return static_cast<std::uint32_t>(positions.size() / 3 - 1);
    }
    void face(std::uint32_t a, std::uint32_t b, std::uint32_t c)
    {
        indices.insert(indices.end(), {a, b, c});
    }
    void triangle(const Point& a, const Point& b, const Point& c)
    {
        const auto first = vertex(a);
        vertex(b);
        vertex(c);
        face(first, first + 1, first + 2);
    }
    /// Corners in order around.
    void quad(const Point& a, const Point& b, const Point& c, const Point& d)
    {
        const auto first = vertex(a);
        vertex(b);
        vertex(c);
        vertex(d);
        face(first, first + 1, first + 2);
        face(first, first + 2, first + 3);
    }
    void box(const Point& low, const Point& high)
    {
        std::uint32_t corner[8];
        for (unsigned i = 0; i < 8; ++i)
            corner[i] =
                vertex({(i & 1 ? high : low)[0], (i & 2 ? high : low)[1], (i & 4 ? high : low)[2]});
        const unsigned sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                      {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
        for (const auto& side : sides) {
            face(corner[side[0]], corner[side[1]], corner[side[2]]);
            face(corner[side[0]], corner[side[2]], corner[side[3]]);
        }
    }
    [[nodiscard]] Mesh transformed(double scale, const Point& shift) const
    {
        Mesh result = *this;
        for (std::size_t i = 0; i < positions.size(); ++i)
            result.positions[i] = static_cast<float>(double{positions[i]} * scale + shift[i % 3]);
        return result;
    }
};

/// A closed sphere of 20 · 4^levels triangles.
inline Mesh icosphere(int levels, double radius = 1, const Point& centre = {0, 0, 0})
{
    const double g = (1 + std::sqrt(5.0)) / 2;
    std::vector<Point> points{{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                              {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                              {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    std::vector<std::array<std::uint32_t, 3>> faces{
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto key = a < b ? std::pair{a, b} : std::pair{b, a};
            if (const auto found = middles.find(key); found != middles.end()) return found->second;
            Point p;
            for (std::size_t k = 0; k < 3; ++k) p[k] = points[a][k] + points[b][k];
            points.push_back(p);
            // Back onto the sphere below, where all points are normalised.
            const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
            for (double& c : points.back()) c *= std::sqrt(1 + g * g) / length;
            return middles[key] = static_cast<std::uint32_t>(points.size() - 1);
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : faces) {
            const auto ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        faces = finer;
    }
    Mesh mesh;
    for (const Point& p : points) {
        const double scale = radius / std::sqrt(1 + g * g);
        mesh.vertex({centre[0] + p[0] * scale, centre[1] + p[1] * scale, centre[2] + p[2] * scale});
    }
    for (const auto& [a, b, c] : faces) mesh.face(a, b, c);
    return mesh;
}

/// Triangles of many sizes around the origin; some share vertices.
inline Mesh soup(std::mt19937& random, int triangles, double extent = 1)
{
    std::uniform_real_distribution<double> unit{-1, 1};
    std::uniform_int_distribution<int> coin{0, 3};
    Mesh mesh;
    for (int i = 0; i < triangles; ++i) {
        const double size = std::pow(10.0, unit(random) - 1) * extent;
        const Point centre{unit(random) * extent, unit(random) * extent, unit(random) * extent};
        const auto near_centre = [&]() -> Point {
            return {centre[0] + size * unit(random), centre[1] + size * unit(random),
                    centre[2] + size * unit(random)};
        };
        const auto vertices = static_cast<std::uint32_t>(mesh.positions.size() / 3);
        if (vertices > 3 && coin(random) == 0) {
            mesh.face(vertices - 1, vertices - 2, mesh.vertex(near_centre()));
        } else {
            const Point a = near_centre(), b = near_centre(), c = near_centre();
            mesh.triangle(a, b, c);
        }
    }
    return mesh;
}

inline glm::dvec3 random_direction(std::mt19937& random)
{
    std::normal_distribution<double> normal;
    for (;;) {
        const glm::dvec3 d{normal(random), normal(random), normal(random)};
        const double length = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
        if (length > 1e-3) return {d.x / length, d.y / length, d.z / length};
    }
}

inline glm::dvec3 vertex_position(const Mesh& mesh, std::size_t i)
{
    return {double{mesh.positions[3 * i]}, double{mesh.positions[3 * i + 1]},
            double{mesh.positions[3 * i + 2]}};
}

}  // namespace meshes
