#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <nook/scene/mesh.hpp>

/// Rays as textbooks trace them, in the coordinates of the world.
namespace stability::textbook {

template <class T>
using Vector = glm::vec<3, T>;

/// Triangles that own their vertices.
struct Mesh {
    std::vector<glm::vec3> vertices;
    std::vector<std::uint32_t> indices;

    [[nodiscard]] nook::MeshView view() const
    {
        return {vertices.empty() ? nullptr : &vertices.front().x, vertices.size(), indices.data(),
                faces()};
    }
    [[nodiscard]] std::size_t faces() const { return indices.size() / 3; }
    [[nodiscard]] const glm::vec3& corner(std::size_t face, std::size_t i) const
    {
        return vertices[indices[3 * face + i]];
    }
    void add_triangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c)
    {
        for (const glm::vec3& vertex : {a, b, c}) {
            indices.push_back(static_cast<std::uint32_t>(vertices.size()));
            vertices.push_back(vertex);
        }
    }
};

template <class T>
struct Ray {
    Vector<T> origin, direction;
};

/// The parameter of a hit; infinite for a miss.
template <class T>
constexpr T miss = std::numeric_limits<T>::infinity();

/// Möller & Trumbore 1997. A determinant of at most `epsilon` is a miss; they take 10⁻⁶.
template <class T>
T moeller_trumbore(const Ray<T>& ray, const Vector<T>& a, const Vector<T>& b, const Vector<T>& c,
                   T epsilon)
{
    const Vector<T> ab = b - a, ac = c - a, p = glm::cross(ray.direction, ac);
    const T determinant = glm::dot(ab, p);
    if (!(std::fabs(determinant) > epsilon)) return miss<T>;
    const Vector<T> s = ray.origin - a, q = glm::cross(s, ab);
    const T u = glm::dot(s, p) / determinant, v = glm::dot(ray.direction, q) / determinant;
    if (!(u >= 0 && v >= 0 && u + v <= 1)) return miss<T>;
    const T t = glm::dot(ac, q) / determinant;
    return t > 0 ? t : miss<T>;
}

/// Woop, Benthin & Wald 2013, as published: float, and double where an edge function is zero. Leaks when
/// a compiler contracts the products to FMA: two triangles then round a shared edge differently.
inline float sheared(const Ray<float>& ray, const glm::vec3& a, const glm::vec3& b,
                     const glm::vec3& c)
{
    int z = std::fabs(ray.direction.x) > std::fabs(ray.direction.y) ? 0 : 1;
    if (std::fabs(ray.direction.z) > std::fabs(ray.direction[z])) z = 2;
    const int x = (z + 1) % 3, y = (z + 2) % 3;
    const float shear_x = ray.direction[x] / ray.direction[z];
    const float shear_y = ray.direction[y] / ray.direction[z], shear_z = 1 / ray.direction[z];
    const auto laid_along = [&](const glm::vec3& vertex) {
        const glm::vec3 v = vertex - ray.origin;
        return glm::vec3{v[x] - shear_x * v[z], v[y] - shear_y * v[z], shear_z * v[z]};
    };
    const glm::vec3 p = laid_along(a), q = laid_along(b), r = laid_along(c);
    float u = r.x * q.y - r.y * q.x, v = p.x * r.y - p.y * r.x, w = q.x * p.y - q.y * p.x;
    if (u == 0 || v == 0 || w == 0) {
        const auto edge = [](const glm::vec3& from, const glm::vec3& to) {
            return static_cast<float>(double{from.x} * double{to.y} -
                                      double{from.y} * double{to.x});
        };
        u = edge(r, q);
        v = edge(p, r);
        w = edge(q, p);
    }
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return miss<float>;
    const float determinant = u + v + w;
    if (determinant == 0) return miss<float>;
    const float t = (u * p.z + v * q.z + w * r.z) / determinant;
    return t > 0 ? t : miss<float>;
}

/// The nearest hit of a ray with the triangles of a mesh.
inline float nearest(const Ray<float>& ray, const Mesh& mesh)
{
    float t = miss<float>;
    for (std::size_t face = 0; face < mesh.faces(); ++face) {
        const float hit =
            sheared(ray, mesh.corner(face, 0), mesh.corner(face, 1), mesh.corner(face, 2));
        t = hit < t ? hit : t;
    }
    return t;
}

/// Where a ray from a point on a surface with this normal starts, so that it does not hit the surface.
using Offset = glm::vec3 (*)(const glm::vec3& point, const glm::vec3& normal);

inline glm::vec3 no_offset(const glm::vec3& point, const glm::vec3&) { return point; }

inline glm::vec3 epsilon_offset(const glm::vec3& point, const glm::vec3& normal)
{
    return point + 1e-4f * normal;
}

/// Wächter & Binder 2019: up to 256 ulps along each axis, and as much as near 1 close to zero.
inline glm::vec3 ulps_offset(const glm::vec3& point, const glm::vec3& normal)
{
    glm::vec3 result{};
    for (int k = 0; k < 3; ++k) {
        const auto ulps = static_cast<std::int32_t>(256 * normal[k]);
        const auto bits = std::bit_cast<std::int32_t>(point[k]) + (point[k] < 0 ? -ulps : ulps);
        result[k] = std::fabs(point[k]) < 1.0f / 32 ? point[k] + normal[k] / 65536
                                                    : std::bit_cast<float>(bits);
    }
    return result;
}

}  // namespace stability::textbook
