#pragma once

#include <cmath>

#include <glm/vec3.hpp>

#include <nook/lanes.hpp>
#include <nook/target.hpp>

/// The vectors of the inner loops: double, products rounded before they are summed up (the same bits
/// with FMA and without), an aggregate, and in the namespace of the target, so that
/// no function of another library is shared between builds of different flags. Signatures take
/// glm::dvec3.
namespace nook::inline NOOK_TARGET::detail {

struct Vector3 {
    double x, y, z;
};

[[nodiscard]] constexpr Vector3 operator+(const Vector3& a, const Vector3& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
[[nodiscard]] constexpr Vector3 operator-(const Vector3& a, const Vector3& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
[[nodiscard]] constexpr Vector3 operator*(const Vector3& a, double s)
{
    return {rounded(a.x * s), rounded(a.y * s), rounded(a.z * s)};
}
[[nodiscard]] constexpr Vector3 operator-(const Vector3& a) { return {-a.x, -a.y, -a.z}; }
[[nodiscard]] constexpr double dot(const Vector3& a, const Vector3& b)
{
    return rounded(a.x * b.x) + rounded(a.y * b.y) + rounded(a.z * b.z);
}
[[nodiscard]] constexpr Vector3 cross(const Vector3& a, const Vector3& b)
{
    return {rounded(a.y * b.z) - rounded(a.z * b.y), rounded(a.z * b.x) - rounded(a.x * b.z),
            rounded(a.x * b.y) - rounded(a.y * b.x)};
}
/// The largest magnitude of a coordinate.
[[nodiscard]] inline double largest(const Vector3& a)
{
    const double x = std::fabs(a.x), y = std::fabs(a.y), z = std::fabs(a.z);
    const double xy = x > y ? x : y;
    return xy > z ? xy : z;
}
/// Scaled to length 1 without overflow or underflow; (0, 0, 0) where there is no direction.
[[nodiscard]] inline Vector3 normalised(const Vector3& a)
{
    const double size = largest(a);
    if (size > 0x1p-500 && size < 0x1p500) return a * (1 / std::sqrt(dot(a, a)));
    if (!(size > 0)) return {0, 0, 0};
    // In two steps: the reciprocal of a denormal overflows.
    int exponent = 0;
    std::frexp(size, &exponent);
    const Vector3 scaled{std::ldexp(a.x, -exponent), std::ldexp(a.y, -exponent),
                         std::ldexp(a.z, -exponent)};
    return scaled * (1 / std::sqrt(dot(scaled, scaled)));
}
[[nodiscard]] inline Vector3 vector(const glm::dvec3& a) { return {a.x, a.y, a.z}; }
[[nodiscard]] inline glm::dvec3 glm_vector(const Vector3& a) { return {a.x, a.y, a.z}; }

}  // namespace nook::inline NOOK_TARGET::detail
