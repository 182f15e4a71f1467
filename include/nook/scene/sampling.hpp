#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <nook/scene/vector.hpp>

/// Points of the unit square for one pixel, from integer hashes alone: the same on any number of
/// threads. `directions.hpp` turns whole batches of them into directions.
namespace nook {

/// How the directions of a shading point are spread over the hemisphere. Every set is unbiased over
/// the seeds; over a surface seen half (a step) the error of each falls as N^-3/4, where independent
/// directions reach N^-1/2. They differ on smooth integrands, such as an exponential falloff.
enum class DirectionSet : std::uint8_t {
    /// Sobol's first two dimensions, Owen-scrambled: about N^-3/2 on smooth integrands. Whole powers
    /// of two are best.
    scrambled_sobol,
    /// One net for all points, spun about the normal by a hashed angle, its heights Owen-scrambled: as
    /// good on average at less cost, since the azimuths stay in order. They are evenly spaced within a
    /// power of two, which can show where an edge runs along a few of them.
    spun,
    /// The R2 sequence (Roberts 2018) with a hashed shift: about N^-1 on smooth integrands, and equally
    /// good for any number of directions.
    r2,
};

}  // namespace nook

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
[[nodiscard]] constexpr std::uint32_t reverse_bits(std::uint32_t x);

/// Two coordinates in (0, 1), multiples of 2⁻³² plus 2⁻³³.
struct SamplePoint {
    double u, v;
};
/// The same as integers: the coordinate of `u` is (u + 1/2) 2⁻³².
struct SampleBits {
    std::uint32_t u, v;
};

namespace detail {

/// These work on 32-bit numbers and on lanes of them.
template <class L>
[[nodiscard]] constexpr L mirrored(L x)
{
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}
/// The mirror image of Sobol's second dimension; that of the first is the index. Bit j takes the
/// index bits k whose binary digits contain those of j (Pascal's triangle modulo 2).
template <class L>
[[nodiscard]] constexpr L sobol_second(L index)
{
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    return index ^ (index >> 16);
}
/// Owen's nested permutation in mirror image: a hash in which each bit depends on the bits below it
/// alone (Laine & Karras 2011; constants from Vegdahl 2021).
template <class L>
[[nodiscard]] constexpr L owen_permuted(L x, std::uint32_t seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

}  // namespace detail

constexpr std::uint32_t reverse_bits(std::uint32_t x) { return detail::mirrored(x); }

/// The first two dimensions of the Sobol sequence, a (0, 2)-net in every block of 2^k points,
/// scrambled after Owen so that each point is uniform and the net is kept.
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
        const SampleBits point = bits(index);
        return {(point.u + 0.5) * 0x1p-32, (point.v + 0.5) * 0x1p-32};
    }
    [[nodiscard]] constexpr SampleBits bits(std::uint32_t index) const
    {
        return {reverse_bits(detail::owen_permuted(index, seed_u_)),
                reverse_bits(detail::owen_permuted(detail::sobol_second(index), seed_v_))};
    }
    /// What scrambles the two dimensions.
    [[nodiscard]] constexpr SampleBits seeds() const { return {seed_u_, seed_v_}; }

private:
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
        tangent_ = {1 + rounded(sign * n.x * n.x * a), sign * b, -sign * n.x};
        bitangent_ = {b, sign + rounded(n.y * n.y * a), -n.y};
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
    [[nodiscard]] const Vector3& tangent() const { return tangent_; }
    [[nodiscard]] const Vector3& bitangent() const { return bitangent_; }

private:
    Vector3 normal_, tangent_{}, bitangent_{};
};

}  // namespace detail
}  // namespace nook::inline NOOK_TARGET
