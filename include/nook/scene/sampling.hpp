#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <nook/scene/vector.hpp>

/// Stratified directions for one pixel, from integer hashes alone: the same on any number of threads.
namespace nook::inline NOOK_TARGET {

/// A well mixed 32-bit hash ("lowbias32", Wellons 2018).
[[nodiscard]] constexpr std::uint32_t hash(std::uint32_t x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}
[[nodiscard]] constexpr std::uint32_t hash(std::uint32_t x, std::uint32_t y)
{
    return hash(hash(x) + 0x9e3779b9u + y);
}

/// Bit 31 for bit 0, and so on.
[[nodiscard]] constexpr std::uint32_t reverse_bits(std::uint32_t x)
{
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

/// Two coordinates in (0, 1), multiples of 2⁻³² plus 2⁻³³.
struct SamplePoint {
    double u, v;
};

/// The first two dimensions of the Sobol sequence, a (0, 2)-net in every block of 2^k points,
/// scrambled after Owen so that each point is uniform and the net is kept. Owen's nested permutation
/// is a hash in which each bit depends on the bits above it alone (Laine & Karras 2011; constants
/// from Vegdahl 2021).
class ScrambledSobol {
public:
    explicit constexpr ScrambledSobol(std::uint32_t seed)
        : seed_u_{hash(seed)},
          seed_v_{hash(seed_u_)}
    {
        // A chain: hashes of neighbouring numbers are not independent enough for the joint strata.
    }
    [[nodiscard]] constexpr SamplePoint operator()(std::uint32_t index) const
    {
        // Mirrored, so that the bits above are the bits below. The first dimension is the index in
        // mirror image; the second takes bit j from the index bits k whose binary digits contain
        // those of j (Pascal's triangle modulo 2).
        std::uint32_t second = index;
        second ^= (second >> 1) & 0x55555555u;
        second ^= (second >> 2) & 0x33333333u;
        second ^= (second >> 4) & 0x0f0f0f0fu;
        second ^= (second >> 8) & 0x00ff00ffu;
        second ^= second >> 16;
        return {unit(reverse_bits(permute(index, seed_u_))),
                unit(reverse_bits(permute(second, seed_v_)))};
    }

private:
    [[nodiscard]] static constexpr std::uint32_t permute(std::uint32_t x, std::uint32_t seed)
    {
        x ^= x * 0x3d20adeau;
        x += seed;
        x *= (seed >> 16) | 1;
        x ^= x * 0x05526c56u;
        x ^= x * 0x53a22864u;
        return x;
    }
    [[nodiscard]] static constexpr double unit(std::uint32_t x) { return (x + 0.5) * 0x1p-32; }

    std::uint32_t seed_u_, seed_v_;
};

namespace detail {

/// Two unit vectors perpendicular to a unit vector and to each other (Duff et al. 2017).
class HemisphereBasis {
public:
    explicit HemisphereBasis(const Vector3& n) : normal_{n}
    {
        const double sign = n.z < 0 ? -1 : 1;
        const double a = -1 / (sign + n.z), b = n.x * n.y * a;
        tangent_ = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
        bitangent_ = {b, sign + n.y * n.y * a, -n.y};
    }
    /// A direction with density cos θ / π. The polar map keeps smooth integrands smooth, which the
    /// concentric one does not; the sine and cosine of its height are at least 2⁻¹⁷.
    [[nodiscard]] Vector3 cosine_direction(const SamplePoint& point) const
    {
        const double angle = 2 * std::numbers::pi * point.u;
        const double sine = std::sqrt(point.v), cosine = std::sqrt(1 - point.v);
        return tangent_ * (sine * std::cos(angle)) + bitangent_ * (sine * std::sin(angle)) +
               normal_ * cosine;
    }
    [[nodiscard]] const Vector3& normal() const { return normal_; }

private:
    Vector3 normal_, tangent_{}, bitangent_{};
};

}  // namespace detail
}  // namespace nook::inline NOOK_TARGET
