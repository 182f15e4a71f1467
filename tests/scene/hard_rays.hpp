#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nook/scene/mesh.hpp>
#include <nook/scene/ray.hpp>

#include "meshes.hpp"

/// Triangles and rays on which a test in float is hard put to it, in scene space.
namespace hard_rays {

using nook::detail::SceneRay;
using nook::detail::SceneTriangle;
using nook::detail::Vector3;

class Random {
public:
    explicit Random(unsigned seed) : engine_{seed} {}
    double uniform(double low = -1, double high = 1)
    {
        return std::uniform_real_distribution<double>{low, high}(engine_);
    }
    int number(int count) { return std::uniform_int_distribution<int>{0, count - 1}(engine_); }
    /// 2^low … 2^high, either sign.
    double power(double low, double high)
    {
        const double value = std::exp2(uniform(low, high));
        return number(2) == 0 ? value : -value;
    }
    Vector3 vector(double size = 1)
    {
        return {size * uniform(), size * uniform(), size * uniform()};
    }
    Vector3 direction() { return nook::detail::vector(meshes::random_direction(engine_)); }
    std::mt19937& engine() { return engine_; }

private:
    std::mt19937 engine_;
};

enum class Kind { plain, small, sliver, needle, tiny, on_axes, huge, skewed };
inline constexpr int kinds = 8;
inline std::string name(Kind kind)
{
    constexpr const char* names[kinds] = {"plain", "small",   "sliver", "needle",
                                          "tiny",  "on axes", "huge",   "skewed"};
    return names[static_cast<int>(kind)];
}

inline void set_corner(SceneTriangle& triangle, int i, const Vector3& v)
{
    triangle.vertices[i][0] = static_cast<float>(v.x);
    triangle.vertices[i][1] = static_cast<float>(v.y);
    triangle.vertices[i][2] = static_cast<float>(v.z);
}
inline Vector3 mix(const Vector3& a, const Vector3& b, double t) { return a * (1 - t) + b * t; }

inline bool is_usable(const SceneTriangle& triangle)
{
    const Vector3 ab = triangle.corner(1) - triangle.corner(0),
                  ac = triangle.corner(2) - triangle.corner(0), area = cross(ab, ac);
    return dot(area, area) > 0x1p-100 * dot(ab, ab) * dot(ac, ac);
}

/// A triangle that a mesh may hold, within [-1, 1].
inline SceneTriangle triangle(Random& random, Kind kind, std::uint32_t face)
{
    for (;;) {
        Vector3 a{}, b{}, c{};
        const auto around = [&](const Vector3& centre, double size) {
            a = centre + random.vector(size);
            b = centre + random.vector(size);
            c = centre + random.vector(size);
        };
        switch (kind) {
        case Kind::plain: around(random.vector(0.6), 0.4); break;
        case Kind::small: {
            const double size = std::exp2(random.uniform(-24, -2));
            around(random.vector(0.7), size);
            break;
        }
        case Kind::sliver:
            a = random.vector(0.9);
            b = random.vector(0.9);
            c = mix(a, b, random.uniform(0, 1)) + random.vector(std::exp2(random.uniform(-26, -4)));
            break;
        case Kind::needle:
            a = random.vector(0.9);
            b = a + random.vector(std::exp2(random.uniform(-24, -4)));
            c = random.vector(0.9);
            break;
        case Kind::tiny: {
            // Where floats are fine: near the origin of the scene.
            const double size = std::exp2(random.uniform(-100, -20));
            around(random.vector(size), size);
            break;
        }
        case Kind::on_axes: {
            const auto grid = [&] { return random.number(17) / 8.0 - 1; };
            const double level = grid();
            const int axis = random.number(3);
            const auto corner = [&]() -> Vector3 {
                const double u = grid(), v = grid();
                if (axis == 0) return {level, u, v};
                if (axis == 1) return {u, level, v};
                return {u, v, level};
            };
            a = corner();
            b = corner();
            c = corner();
            break;
        }
        case Kind::huge:
            a = {-1, random.uniform(), -1};
            b = {1, random.uniform(), -1};
            c = {random.uniform(), random.uniform(), 1};
            break;
        case Kind::skewed:
            // Edges of very different lengths on different axes.
            a = random.vector(0.5);
            b = a + Vector3{random.power(-20, -1), random.power(-20, -1), random.power(-20, -1)};
            c = a + Vector3{random.power(-20, -1), random.power(-20, -1), random.power(-20, -1)};
            break;
        }
        SceneTriangle result{};
        set_corner(result, 0, a);
        set_corner(result, 1, b);
        set_corner(result, 2, c);
        result.face = face;
        if (is_usable(result)) return result;
    }
}

/// A point on the triangle or just off it: corners, edges, inside, near an edge.
inline Vector3 target(Random& random, const SceneTriangle& triangle)
{
    const int first = random.number(3);
    const Vector3 a = triangle.corner(first), b = triangle.corner((first + 1) % 3),
                  c = triangle.corner((first + 2) % 3);
    switch (random.number(5)) {
    case 0: return a;
    case 1: return mix(a, b, random.uniform(0, 1));
    case 2: return mix(mix(a, b, random.uniform(0, 1)), c, random.power(-50, -8));
    case 3: return mix(a, b, random.uniform(-0.2, 1.2));
    default: return mix(mix(a, b, random.uniform(0, 1)), c, random.uniform(-0.1, 1.1));
    }
}

/// A ray at a point: from anywhere, along axes, grazing the triangle; ending about there, or nowhere.
inline SceneRay ray_at(Random& random, const SceneTriangle& triangle)
{
    const Vector3 at = target(random, triangle);
    const Vector3 ab = triangle.corner(1) - triangle.corner(0),
                  ac = triangle.corner(2) - triangle.corner(0);
    const double size = (std::max)(largest(ab), largest(ac));
    Vector3 along = random.direction();
    switch (random.number(6)) {
    case 0: {  // grazing
        const Vector3 flat = normalised(mix(normalised(ab), normalised(ac), random.uniform()));
        along = normalised(flat + normalised(cross(ab, ac)) * random.power(-30, -2));
        break;
    }
    case 1: {  // along an axis
        const double sign = random.number(2) == 0 ? 1 : -1, tilt = random.number(2) * 1e-9;
        const int axis = random.number(3);
        along = {axis == 0 ? sign : tilt, axis == 1 ? sign : 0, axis == 2 ? sign : -tilt};
        break;
    }
    case 2:  // along an edge, almost
        along = normalised(normalised(ab) + random.vector(std::exp2(random.uniform(-30, -3))));
        break;
    default: break;
    }
    if (!(dot(along, along) > 0)) along = {0, 0, 1};
    along = along * random.uniform(0.5, 2);
    double distance = std::exp2(random.uniform(-12, 2));
    switch (random.number(8)) {
    case 0: distance = std::exp2(random.uniform(-60, 0)); break;
    case 1: distance = std::exp2(random.uniform(0, 50)); break;
    case 2:
    case 3: distance = size * std::exp2(random.uniform(-8, 8)); break;
    case 4: distance = size * std::exp2(random.uniform(-30, -8)); break;
    default: break;
    }
    double end = 0x1p64;
    switch (random.number(5)) {
    case 0: end = distance * (1 + random.power(-52, -16)); break;
    case 1: end = distance; break;
    case 2: end = distance * random.uniform(0.5, 2); break;
    case 3: end = distance * 3; break;
    default: break;
    }
    return {at - along * distance, along, end};
}

/// A scene of hard triangles in the world, of the size `extent`.
struct HardScene {
    meshes::Mesh mesh;
    double extent;
};
inline HardScene scene(Random& random, int number)
{
    const double extent = number % 5 == 0 ? std::exp2(random.uniform(-20, 20)) : 1;
    const int count = 1 + number % 97;
    meshes::Mesh mesh;
    for (int i = 0; i < count; ++i) {
        const auto kind = number % 9 < kinds ? static_cast<Kind>(number % 9)
                                             : static_cast<Kind>(random.number(kinds));
        const SceneTriangle t = triangle(random, kind, 0);
        const auto corner = [&](int k) -> meshes::Point {
            const Vector3 v = t.corner(k) * extent;
            return {v.x, v.y, v.z};
        };
        mesh.triangle(corner(0), corner(1), corner(2));
    }
    return {mesh, extent};
}
inline std::vector<SceneTriangle> scene_triangles(const meshes::Mesh& mesh,
                                                  const nook::detail::SceneSpace& space)
{
    std::vector<SceneTriangle> triangles;
    for (std::size_t t = 0; t < mesh.view().triangle_count; ++t)
        if (nook::is_usable_triangle(mesh.view(), t))
            triangles.push_back(nook::detail::scene_triangle(mesh.view(), space, t));
    return triangles;
}

}  // namespace hard_rays
