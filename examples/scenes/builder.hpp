#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene.hpp"

namespace scenes {

/// Random numbers that are the same on every machine: splitmix64.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_{seed} {}

    /// Uniform in [low, high).
    double operator()(double low = 0, double high = 1);

private:
    std::uint64_t state_;
};

/// A position on a surface of two parameters.
struct Grid {
    int columns = 1, rows = 1;  ///< quads along u and v
    bool wrap_u = false, wrap_v = false;
};

/// Collects triangles, wound anticlockwise as seen from outside.
class Builder {
public:
    [[nodiscard]] std::uint32_t vertex(const glm::dvec3& point);
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, const support::Rgb& colour);
    void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
              const support::Rgb& colour);
    /// A parallelepiped: its centre and half of each of its edges, which form a right-handed frame.
    void block(const glm::dvec3& centre, const glm::dvec3& x, const glm::dvec3& y,
               const glm::dvec3& z, const support::Rgb& colour);

    /// A box with its centre at `centre`, turned about the vertical axis by `angle` radians.
    void box(const glm::dvec3& centre, const glm::dvec3& half_size, const support::Rgb& colour,
             double angle = 0);

    /// A straight bar of square section from one point to another, not vertical.
    void bar(const glm::dvec3& from, const glm::dvec3& to, double half_width,
             const support::Rgb& colour);

    /// A surface: point(u, v) over [0, 1]², colour(u, v) at the middle of each quad. A side that
    /// wraps shares its vertices with the opposite one; quads that collapse to a pole lose a triangle.
    template <class Point, class Colour>
    void surface(const Grid& grid, Point&& point, Colour&& colour);

    /// A closed vertical cylinder, standing on `foot`.
    void pillar(const glm::dvec3& foot, double radius, double height, int segments,
                const support::Rgb& colour);

    /// A closed solid: rings of `around` points point(i, j), joined one after the other, the first
    /// and the last closed by a fan about its middle. Each ring turns anticlockwise about the
    /// direction in which they follow each other. A ring may be a single point.
    template <class Point>
    void loft(int around, int rings, Point&& point, const support::Rgb& colour);

    /// A closed solid of revolution about the vertical axis through `foot`: pairs of radius and
    /// height from the lowest up.
    void turned(const glm::dvec3& foot, std::span<const glm::dvec2> profile, int segments,
                const support::Rgb& colour);

    /// A closed prism: an outline in the plane of `x` and `y`, anticlockwise and without crossings,
    /// moved by `z`. x, y and z form a right-handed frame.
    void prism(std::span<const glm::dvec2> outline, const glm::dvec3& origin, const glm::dvec3& x,
               const glm::dvec3& y, const glm::dvec3& z, const support::Rgb& colour);

    /// A closed tube of round section along a path of two points or more, with one radius for each.
    void tube(std::span<const glm::dvec3> path, std::span<const double> radii, int sides,
              const support::Rgb& colour);

    /// A box as above with all its edges cut off by `bevel`.
    void chamfered_box(const glm::dvec3& centre, const glm::dvec3& half_size, double bevel,
                       const support::Rgb& colour, double angle = 0);

    /// Moves the triangles into the scene.
    void finish(Scene& scene);

private:
    std::vector<float> positions_;
    std::vector<std::uint32_t> indices_;
    std::vector<support::Rgb> albedo_;
};

template <class Point, class Colour>
void Builder::surface(const Grid& grid, Point&& point, Colour&& colour)
{
    const int across = grid.wrap_u ? grid.columns : grid.columns + 1;
    const int down = grid.wrap_v ? grid.rows : grid.rows + 1;
    const auto first = static_cast<std::uint32_t>(positions_.size() / 3);
    for (int j = 0; j < down; ++j)
        for (int i = 0; i < across; ++i)
            (void)vertex(point(double(i) / grid.columns, double(j) / grid.rows));
    const auto at = [&](int i, int j) {
        return first + static_cast<std::uint32_t>((j % down) * across + i % across);
    };
    for (int j = 0; j < grid.rows; ++j)
        for (int i = 0; i < grid.columns; ++i)
            quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1),
                 colour((i + 0.5) / grid.columns, (j + 0.5) / grid.rows));
}

template <class Point>
void Builder::loft(int around, int rings, Point&& point, const support::Rgb& colour)
{
    const auto first = static_cast<std::uint32_t>(positions_.size() / 3);
    for (int j = 0; j < rings; ++j)
        for (int i = 0; i < around; ++i) (void)vertex(point(i, j));
    const auto at = [&](int i, int j) {
        return first + static_cast<std::uint32_t>(j * around + i % around);
    };
    for (int j = 0; j + 1 < rings; ++j)
        for (int i = 0; i < around; ++i)
            quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), colour);
    for (const int end : {0, rings - 1}) {
        const glm::dvec3 start = point(0, end);
        glm::dvec3 middle{0, 0, 0};
        bool single = true;
        for (int i = 0; i < around; ++i) {
            middle += point(i, end) / double(around);
            single = single && point(i, end) == start;
        }
        if (single) continue;
        const std::uint32_t hub = vertex(middle);
        for (int i = 0; i < around; ++i)
            triangle(hub, at(end == 0 ? i + 1 : i, end), at(end == 0 ? i : i + 1, end), colour);
    }
}

}  // namespace scenes
