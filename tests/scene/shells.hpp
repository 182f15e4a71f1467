#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/scene/camera.hpp>
#include <nook/scene/outline_view.hpp>

#include "meshes.hpp"

/// Closed shells for the tests of outlines, and which of them contain a point, worked out from the
/// solid angles of their triangles.
namespace shells {

struct Shells {
    std::vector<float> base, direction;
    std::vector<std::uint32_t> indices;

    [[nodiscard]] nook::OutlineView view() const
    {
        return {base.data(), direction.data(), base.size() / 3, indices.data(), indices.size() / 3};
    }
    /// Adds a mesh whose vertices move away from `centre`, by 1 per unit of extent along each axis
    /// (`boxy`, which gives boxes a constant thickness) or along the line from it.
    void add(const meshes::Mesh& mesh, const meshes::Point& centre, bool boxy)
    {
        const auto first = static_cast<std::uint32_t>(base.size() / 3);
        for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
            double away[3], length = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                away[k] = double{mesh.positions[i + k]} - centre[k];
                length += away[k] * away[k];
            }
            for (std::size_t k = 0; k < 3; ++k) {
                base.push_back(mesh.positions[i + k]);
                const double step = boxy ? (away[k] > 0 ? 1 : -1) : away[k] / std::sqrt(length);
                direction.push_back(static_cast<float>(step));
            }
        }
        for (const std::uint32_t index : mesh.indices) indices.push_back(first + index);
    }
    void add_box(const meshes::Point& low, const meshes::Point& high)
    {
        meshes::Mesh mesh;
        mesh.box(low, high);
        add(mesh, {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2}, true);
    }
    [[nodiscard]] glm::dvec3 corner(std::size_t triangle, std::size_t i, double extent) const
    {
        const std::size_t at = 3 * std::size_t{indices[3 * triangle + i]};
        const auto along = [&](std::size_t k) {
            return double{base[at + k]} + extent * double{direction[at + k]};
        };
        return {along(0), along(1), along(2)};
    }
};

inline glm::dvec3 cross(const glm::dvec3& a, const glm::dvec3& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double dot(const glm::dvec3& a, const glm::dvec3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline double length(const glm::dvec3& a) { return std::sqrt(dot(a, a)); }

/// How many shells contain a point (van Oosterom & Strackee 1983), and whether it lies so close to the
/// plane of a triangle, beside it, that `margin` might decide.
struct Winding {
    int count = 0;
    bool close = false;
};
inline Winding winding(const Shells& shells, double extent, const glm::dvec3& point, double margin)
{
    double angle = 0;
    Winding result;
    for (std::size_t t = 0; t < shells.indices.size() / 3; ++t) {
        const glm::dvec3 a = shells.corner(t, 0, extent) - point;
        const glm::dvec3 b = shells.corner(t, 1, extent) - point;
        const glm::dvec3 c = shells.corner(t, 2, extent) - point;
        const double la = length(a), lb = length(b), lc = length(c);
        angle += std::atan2(dot(a, cross(b, c)),
                            la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
        const glm::dvec3 normal = cross(b - a, c - a);
        const glm::dvec3 middle = (a + b + c) * (1.0 / 3);
        const double reach =
            std::fmax(length(a - middle), std::fmax(length(b - middle), length(c - middle)));
        const bool beside = std::fabs(dot(normal, a)) <= margin * length(normal);
        if (beside && length(middle) <= reach + margin) result.close = true;
    }
    // Half the solid angles add up to 2 pi inside.
    result.count = static_cast<int>(std::lround(angle / (2 * std::numbers::pi)));
    return result;
}

/// Bodies around the origin: boxes and spheres, turned, overlapping, and spheres whose vertices are
/// pushed about, which cut through themselves.
inline Shells random_shells(std::mt19937& random, int bodies, double spread)
{
    std::uniform_real_distribution<double> unit{-1, 1};
    Shells shells;
    for (int body = 0; body < bodies; ++body) {
        const double size = 0.15 + 0.5 * (unit(random) + 1) * (unit(random) + 1);
        meshes::Mesh mesh;
        if (body % 3 == 0) mesh.box({-size, -size / 2, -size}, {size, size / 2, size});
        else mesh = meshes::icosphere(body % 2, size);
        const glm::dvec3 axis = meshes::random_direction(random);
        const glm::dvec3 side = cross(axis, meshes::random_direction(random));
        const glm::dvec3 x = side * (1 / length(side)), y = cross(axis, x);
        const meshes::Point centre{spread * unit(random), spread * unit(random),
                                   spread * unit(random)};
        const double push = body % 3 == 2 ? 0.8 * size : 0;
        for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
            const double p[3] = {double{mesh.positions[i]} + push * unit(random),
                                 double{mesh.positions[i + 1]} + push * unit(random),
                                 double{mesh.positions[i + 2]} + push * unit(random)};
            const glm::dvec3 turned = x * p[0] + y * p[1] + axis * p[2];
            mesh.positions[i] = static_cast<float>(turned.x + centre[0]);
            mesh.positions[i + 1] = static_cast<float>(turned.y + centre[1]);
            mesh.positions[i + 2] = static_cast<float>(turned.z + centre[2]);
        }
        shells.add(mesh, centre, false);
    }
    return shells;
}

}  // namespace shells
