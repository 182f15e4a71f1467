#pragma once

#include <cstdint>
#include <utility>
#include <vector>

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

    /// A vertical cylinder with a top, standing on `foot`.
    void pillar(const glm::dvec3& foot, double radius, double height, int segments,
                const support::Rgb& colour);

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

}  // namespace scenes
