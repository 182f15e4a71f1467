#pragma once

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/owned_image.hpp>
#include <nook/scene/traced_ao.hpp>

#include "meshes.hpp"

/// What the tests of ray-traced obscurance share: scenes with a closed form about the origin, and calls
/// of the kernel for a list of points.
namespace closed_forms {

using meshes::Mesh;
using meshes::Point;

/// Stands for infinity where it changes the answer by less than 1e-4.
constexpr double big = 1e5;

/// The wall x = distance, endless to the sides.
inline void wall(Mesh& mesh, double x, double height = big)
{
    mesh.quad({x, -big, 0}, {x, big, 0}, {x, big, height}, {x, -big, height});
}
inline void ceiling(Mesh& mesh, double height)
{
    mesh.quad({-big, -big, height}, {big, -big, height}, {big, big, height}, {-big, big, height});
}
/// A regular polygon of the area of a disc: the middle of its sides lies a little within, its corners
/// without.
inline void disc(Mesh& mesh, double radius, double height, int sides = 4096)
{
    const double step = 2 * std::numbers::pi / sides;
    const double outer = radius * std::sqrt(step / std::sin(step));
    const auto centre = mesh.vertex({0, 0, height});
    for (int i = 0; i < sides; ++i)
        mesh.vertex({outer * std::cos(i * step), outer * std::sin(i * step), height});
    for (int i = 0; i < sides; ++i)
        mesh.face(centre, centre + 1 + static_cast<std::uint32_t>(i),
                  centre + 1 + static_cast<std::uint32_t>((i + 1) % sides));
}
/// The floor z = 0 cut off at x = -distance, where the other face of a groove rises.
inline void groove(Mesh& mesh, double degrees, double distance)
{
    const double angle = degrees * std::numbers::pi / 180;
    mesh.quad({-distance, -big, 0}, {big, -big, 0}, {big, big, 0}, {-distance, big, 0});
    const double x = -distance + big * std::cos(angle), z = big * std::sin(angle);
    mesh.quad({-distance, -big, 0}, {x, -big, z}, {x, big, z}, {-distance, big, 0});
}
/// Walls x = a and y = b.
inline void corner(Mesh& mesh, double a, double b)
{
    mesh.quad({a, b, 0}, {a, -big, 0}, {a, -big, big}, {a, b, big});
    mesh.quad({a, b, 0}, {-big, b, 0}, {-big, b, big}, {a, b, big});
}
/// A surface of revolution about z: at(s) gives radius and height for s in [0, 1].
template <class Profile>
void revolve(Mesh& mesh, int rows, int columns, const Profile& at)
{
    const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
    for (int row = 0; row <= rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const auto [radius, height] = at(static_cast<double>(row) / rows);
            const double azimuth = 2 * std::numbers::pi * column / columns;
            mesh.vertex({radius * std::cos(azimuth), radius * std::sin(azimuth), height});
        }
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const auto name = [&](int r, int c) {
                return first + static_cast<std::uint32_t>(r * columns + c % columns);
            };
            mesh.face(name(row, column), name(row + 1, column), name(row + 1, column + 1));
            if (row > 0)
                mesh.face(name(row, column), name(row + 1, column + 1), name(row, column + 1));
        }
}

inline nook::Bvh built(const Mesh& mesh)
{
    nook::Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    return bvh;
}

/// A list of points and all that the kernel may write for it, in double.
struct Points {
    std::vector<float> positions, normals;

    void add(const glm::dvec3& position, const glm::dvec3& normal)
    {
        for (const double c : {position.x, position.y, position.z})
            positions.push_back(static_cast<float>(c));
        for (const double c : {normal.x, normal.y, normal.z})
            normals.push_back(static_cast<float>(c));
    }
    [[nodiscard]] int count() const { return static_cast<int>(positions.size() / 3); }
    [[nodiscard]] nook::ShadingPoints view(double error = -1) const
    {
        return {.positions = positions.data(),
                .normals = normals.data(),
                .count = positions.size() / 3,
                .error = error};
    }
};
template <class V>
struct Results {
    nook::Image<V> visibility, bent, radiance, weight;

    Results(int width, int height, V fill = V{-7})
        : visibility{width, height, fill},
          bent{3 * width, height, fill},
          radiance{3 * width, height, fill},
          weight{width, height, fill}
    {}
    [[nodiscard]] nook::ImageView3<V> bents() { return triple(bent); }
    [[nodiscard]] nook::ImageView3<V> radiances() { return triple(radiance); }
    [[nodiscard]] bool untouched(V fill = V{-7}) const
    {
        for (const auto* image : {&visibility, &bent, &radiance, &weight})
            for (const V v : *image)
                if (v != fill) return false;
        return true;
    }
    friend bool operator==(const Results&, const Results&) = default;

private:
    [[nodiscard]] static nook::ImageView3<V> triple(nook::Image<V>& image)
    {
        return nook::ImageView3<V>::interleaved(image.data(), image.width() / 3, image.height(),
                                                image.width());
    }
};

/// The colour of a mesh by a function of the face.
struct White {
    glm::vec3 operator()(std::uint32_t) const { return {1, 1, 1}; }
};

/// -------- quadrature

/// The integral of f over [0, 1] by Gauss's rule of 5 points on `pieces` pieces.
template <class F>
double integral(const F& f, int pieces = 2000)
{
    constexpr double at[5] = {-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831,
                              0.9061798459386640};
    constexpr double weight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                  0.4786286704993665, 0.2369268850561891};
    double sum = 0;
    for (int i = 0; i < pieces; ++i)
        for (int k = 0; k < 5; ++k) sum += weight[k] * f((i + 0.5 + 0.5 * at[k]) / pieces);
    return sum / (2 * pieces);
}

}  // namespace closed_forms
