#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <nook/lanes.hpp>
#include <nook/scene/sampling.hpp>

/// Directions of a shading point in batches, for the inner loop of the ray-traced kernel.
///
/// Single precision throughout, without the library's sine and cosine: an angle is reduced as an
/// integer, and no product is contracted with a sum, so that every instruction set and every number of
/// lanes gives the same bits (under -ffast-math: nearly the same).
namespace nook::inline NOOK_TARGET {

/// Arrays for `cosine_directions` have room for this many floats.
[[nodiscard]] constexpr int direction_room(int count) { return (count + 15) / 16 * 16; }

/// Writes the directions with indices first … first + count − 1 of a set, in tangent space: z along the
/// normal, density z / π, unit length to float rounding, z > 2⁻¹⁷. Each coordinate is within 3 · 2⁻²⁴ of
/// the polar map of its point, and within 4 units of its own last place.
///
/// `seed_hash` names the sequence: hash(seed, sample) for a sample of an image. Successive blocks of one
/// sequence, `first = frame * count`, refine each other; indices wrap at 2³². x, y, z have room for
/// `direction_room(count)` floats; those beyond `count` are filled with a direction next to the normal.
/// count ≥ 0; nothing is written for 0.
///
/// Order: `scrambled_sobol` and `spun` sort an aligned block, `count` a power of two ≥ 32 and `first` a
/// multiple of it, by azimuth: one direction in each of `count` equal wedges, wedge by wedge (for `spun`
/// from the hashed angle on). Neighbours in the arrays are then neighbours on the hemisphere. Other
/// blocks, and `r2`, come in the order of their indices.
inline void cosine_directions(DirectionSet set, std::uint32_t seed_hash, std::uint32_t first,
                              int count, float* x, float* y, float* z);

/// The point of the square behind the direction of an index: azimuth 2π u, squared sine v.
[[nodiscard]] constexpr SampleBits direction_bits(DirectionSet set, std::uint32_t seed_hash,
                                                  std::uint32_t index);

namespace detail {

/// The bits of lanes as lanes of another type.
template <class To, class L>
[[nodiscard]] NOOK_INLINE Lanes<To, LanesTraits<L>::count> same_bits(const L& lanes)
{
    return std::bit_cast<Lanes<To, LanesTraits<L>::count>>(lanes);
}

/// Lanes of `SampleBits`.
template <int N>
struct SampleLanes {
    Lanes<std::uint32_t, N> u, v;
};

/// (bits + 1/2) 2⁻³², rounded once. The halves are exact, and so is every product.
template <int N>
[[nodiscard]] NOOK_INLINE Lanes<float, N> unit_interval(const Lanes<std::uint32_t, N>& bits)
{
    const auto high = convert<float>(same_bits<std::int32_t>(bits >> 16));
    const auto low = convert<float>(same_bits<std::int32_t>(bits & 0xffffu));
    return high * 0x1p-16f + fenced(low * 0x1p-32f + 0x1p-33f);
}

/// Polar map: a direction per point. Azimuths are turned to the nearest axis, at most 1/8 of a turn;
/// what is left is a whole number of 2⁻³³ turns, exact until it becomes a float.
template <int N>
NOOK_INLINE void write_directions(const SampleLanes<N>& points, float* x, float* y, float* z)
{
    using Bits = Lanes<std::uint32_t, N>;
    using Floats = Lanes<float, N>;
    const Bits turned = points.u + (1u << 29);
    const Bits offset = ((turned & 0x3fffffffu) << 1) - ((1u << 30) - 1);
    const Floats turn = convert<float>(same_bits<std::int32_t>(offset)) * 0x1p-33f;

    // sin 2πt and cos 2πt for |t| <= 1/8: polynomials through the Chebyshev nodes of t².
    const Floats square = rounded(turn * turn);
    Floats sine = rounded(square * -0x1.2d9b4p+6f) + 0x1.465ec4p+6f;
    sine = rounded(square * sine) - 0x1.4abbbap+5f;
    sine = rounded(square * sine) + 0x1.921fb6p+2f;
    sine = turn * sine;
    Floats cosine = rounded(square * 0x1.db6492p+5f) - 0x1.55cb98p+6f;
    cosine = rounded(square * cosine) + 0x1.03c1eap+6f;
    cosine = rounded(square * cosine) - 0x1.3bd3ccp+4f;
    cosine = rounded(square * cosine) + 1.0f;

    // Quarter turns k: cos is c, -s, -c, s and sin is s, c, -s, -c.
    const auto swapped = (turned & 0x40000000u) != 0u;
    const Floats across = swapped ? sine : cosine, along = swapped ? cosine : sine;
    const Bits across_sign = (turned + 0x40000000u) & 0x80000000u,
               along_sign = turned & 0x80000000u;
    const Floats radius = square_root(unit_interval<N>(points.v));
    // 1 − v of the mirrored bits: exact before it is rounded.
    const Floats height = square_root(unit_interval<N>(~points.v));
    store(x, same_bits<float>(same_bits<std::uint32_t>(Floats(radius * across)) ^ across_sign));
    store(y, same_bits<float>(same_bits<std::uint32_t>(Floats(radius * along)) ^ along_sign));
    store(z, height);
}

/// 0, 1, 2, … from `start`.
template <int N>
[[nodiscard]] NOOK_INLINE Lanes<std::uint32_t, N> counting(std::uint32_t start)
{
    constexpr std::uint32_t steps[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    return load<N>(steps) + start;
}

/// `mirrored`, where bytes can be looked up: the bytes of a number change places, and their halves are
/// replaced by mirror images.
template <int N>
[[nodiscard]] NOOK_INLINE Lanes<std::uint32_t, N> mirrored_lanes(const Lanes<std::uint32_t, N>& x)
{
#if defined(__AVX2__)
    if constexpr (N == 8 || N == 16) {
        const __m128i places = _mm_set_epi64x(0x0c0d0e0f08090a0b, 0x0405060700010203),
                      raised = _mm_set_epi64x(static_cast<long long>(0xf070b030d0509010),
                                              static_cast<long long>(0xe060a020c0408000)),
                      lowered = _mm_set_epi64x(0x0f070b030d050901, 0x0e060a020c040800);
#if defined(__AVX512BW__)
        if constexpr (N == 16) {
            const auto look_up = [](const __m128i& table, const __m512i& at) NOOK_INLINE_LAMBDA {
                return _mm512_shuffle_epi8(_mm512_maskz_broadcast_i32x4(0xffff, table), at);
            };
            const __m512i mask = _mm512_set1_epi8(0x0f),
                          bytes = _mm512_shuffle_epi8(reinterpret_cast<__m512i>(x),
                                                      _mm512_maskz_broadcast_i32x4(0xffff, places)),
                          low = _mm512_maskz_and_epi32(0xffff, bytes, mask),
                          high = _mm512_maskz_and_epi32(
                              0xffff, _mm512_maskz_srli_epi32(0xffff, bytes, 4), mask);
            return reinterpret_cast<Lanes<std::uint32_t, N>>(
                _mm512_maskz_or_epi32(0xffff, look_up(raised, low), look_up(lowered, high)));
        }
#endif
        if constexpr (N == 8) {
            const auto look_up = [](const __m128i& table, const __m256i& at) NOOK_INLINE_LAMBDA {
                return _mm256_shuffle_epi8(_mm256_broadcastsi128_si256(table), at);
            };
            const __m256i mask = _mm256_set1_epi8(0x0f),
                          bytes = _mm256_shuffle_epi8(reinterpret_cast<__m256i>(x),
                                                      _mm256_broadcastsi128_si256(places)),
                          low = _mm256_and_si256(bytes, mask),
                          high = _mm256_and_si256(_mm256_srli_epi32(bytes, 4), mask);
            return reinterpret_cast<Lanes<std::uint32_t, N>>(
                _mm256_or_si256(look_up(raised, low), look_up(lowered, high)));
        }
    }
#endif
    return mirrored(x);
}

/// log2 of the block when its directions are sorted by azimuth, otherwise −1. Sorting 16 costs more
/// than neighbours gain.
[[nodiscard]] constexpr int sorted_bits(std::uint32_t first, int count)
{
    const auto size = static_cast<std::uint32_t>(count);
    return size >= 32 && std::has_single_bit(size) && (first & (size - 1)) == 0
               ? std::countr_zero(size)
               : -1;
}

/// Each point goes to the slot of its azimuth, the top bits of u: a permutation, since the block is a
/// net. x and y hold the bits of the points on the way.
template <int N>
NOOK_INLINE void sorted_sobol_directions(const SampleBits& seeds, std::uint32_t first, int bits,
                                         float* x, float* y, float* z)
{
    const int count = 1 << bits;
    if (count < N) {
        std::memset(x, 0, sizeof(float) * N);
        std::memset(y, 0, sizeof(float) * N);
    }
    const auto lanes = counting<N>(0), second_lanes = sobol_second(lanes);
    for (int i = 0; i < count; i += N) {
        // The block is aligned, and the second dimension is linear over bits.
        const std::uint32_t base = first + static_cast<std::uint32_t>(i);
        std::uint32_t u[N], v[N];
        store(u, mirrored_lanes<N>(owen_permuted(lanes ^ base, seeds.u)));
        store(v, mirrored_lanes<N>(owen_permuted(second_lanes ^ sobol_second(base), seeds.v)));
        const int filled = count < N ? count : N;
        for (int lane = 0; lane < filled; ++lane) {
            const std::uint32_t slot = u[lane] >> 1 >> (31 - bits);
            std::memcpy(x + slot, u + lane, sizeof(float));
            std::memcpy(y + slot, v + lane, sizeof(float));
        }
    }
    for (int i = 0; i < count; i += N) {
        SampleLanes<N> points;
        std::memcpy(&points.u, x + i, sizeof points.u);
        std::memcpy(&points.v, y + i, sizeof points.v);
        write_directions<N>(points, x + i, y + i, z + i);
    }
}
template <int N>
inline void sobol_directions(const SampleBits& seeds, std::uint32_t first, int count, float* x,
                             float* y, float* z)
{
    if (const int bits = sorted_bits(first, count); bits >= 0)
        return sorted_sobol_directions<N>(seeds, first, bits, x, y, z);
    for (int i = 0; i < count; i += N) {
        const auto index = counting<N>(first + static_cast<std::uint32_t>(i));
        write_directions<N>({mirrored_lanes<N>(owen_permuted(index, seeds.u)),
                             mirrored_lanes<N>(owen_permuted(sobol_second(index), seeds.v))},
                            x + i, y + i, z + i);
    }
}

/// The net of all, its heights scrambled like Sobol's. In a sorted block the slot is the index in mirror
/// image, which is what the azimuth is made of: no point changes its place. All of it is linear over
/// bits, so that lanes differ by constants.
template <int N>
inline void spun_directions(const SampleBits& seeds, std::uint32_t first, int count, float* x,
                            float* y, float* z)
{
    using Bits = Lanes<std::uint32_t, N>;
    const int bits = sorted_bits(first, count);
    if (bits < 0) {
        for (int i = 0; i < count; i += N) {
            const Bits index = counting<N>(first + static_cast<std::uint32_t>(i));
            const Bits v = mirrored_lanes<N>(owen_permuted(sobol_second(index), seeds.v));
            write_directions<N>({mirrored_lanes<N>(index) + seeds.u, v}, x + i, y + i, z + i);
        }
        return;
    }
    const Bits slots = counting<N>(0) << (31 - bits) << 1;
    const Bits seconds = sobol_second(mirrored_lanes<N>(slots));
    const std::uint32_t mirrored_first = reverse_bits(first);
    for (int i = 0; i < count; i += N) {
        const std::uint32_t base =
            (static_cast<std::uint32_t>(i) << (31 - bits) << 1) + mirrored_first;
        const Bits second = seconds ^ sobol_second(reverse_bits(base));
        const Bits v = mirrored_lanes<N>(owen_permuted(second, seeds.v));
        write_directions<N>({slots + (base + seeds.u), v}, x + i, y + i, z + i);
    }
}

/// 1/g and 1/g² in units of 2⁻⁶⁴, g³ = g + 1: the top half of a multiple is right for any 32-bit index.
inline constexpr std::uint64_t r2_steps[2] = {0xc13fa9a902a6328f, 0x91e10da5c79e7b1d};

/// Multiples of a step, by lanes of high and low halves.
template <int N>
class MultipleLanes {
public:
    explicit MultipleLanes(std::uint64_t step) : step_{step}
    {
        std::uint32_t high[N], low[N];
        for (std::uint32_t lane = 0; lane < N; ++lane) {
            high[lane] = static_cast<std::uint32_t>(lane * step >> 32);
            low[lane] = static_cast<std::uint32_t>(lane * step);
        }
        high_ = load<N>(high);
        low_ = load<N>(low);
    }
    /// The high halves of index, index + 1, … steps.
    [[nodiscard]] NOOK_INLINE Lanes<std::uint32_t, N> operator()(std::uint32_t index) const
    {
        const std::uint64_t base = index * step_;
        const auto base_low = static_cast<std::uint32_t>(base);
        const Lanes<std::uint32_t, N> low = low_ + base_low,
                                      high = high_ + static_cast<std::uint32_t>(base >> 32);
        return low < broadcast<N>(base_low) ? high + 1u : high;
    }

private:
    std::uint64_t step_;
    Lanes<std::uint32_t, N> high_, low_;
};

template <int N>
inline void r2_directions(const SampleBits& seeds, std::uint32_t first, int count, float* x,
                          float* y, float* z)
{
    const MultipleLanes<N> across{r2_steps[0]}, along{r2_steps[1]};
    for (int i = 0; i < count; i += N) {
        const std::uint32_t index = first + static_cast<std::uint32_t>(i);
        write_directions<N>({across(index) + seeds.u, along(index) + seeds.v}, x + i, y + i, z + i);
    }
}

template <int N>
inline void cosine_directions(DirectionSet set, std::uint32_t seed_hash, std::uint32_t first,
                              int count, float* x, float* y, float* z)
{
    const SampleBits seeds = ScrambledSobol{seed_hash}.seeds();
    switch (set) {
    case DirectionSet::scrambled_sobol: sobol_directions<N>(seeds, first, count, x, y, z); break;
    case DirectionSet::spun: spun_directions<N>(seeds, first, count, x, y, z); break;
    case DirectionSet::r2: r2_directions<N>(seeds, first, count, x, y, z); break;
    }
    // Lanes overshoot by what is left of their block.
    constexpr SampleLanes<1> upright{0, 0};
    for (int i = count; i < direction_room(count); ++i)
        write_directions<1>(upright, x + i, y + i, z + i);
}

}  // namespace detail

inline void cosine_directions(DirectionSet set, std::uint32_t seed_hash, std::uint32_t first,
                              int count, float* x, float* y, float* z)
{
    detail::cosine_directions<detail::float_lanes>(set, seed_hash, first, count, x, y, z);
}

constexpr SampleBits direction_bits(DirectionSet set, std::uint32_t seed_hash, std::uint32_t index)
{
    const ScrambledSobol points{seed_hash};
    const SampleBits seeds = points.seeds();
    switch (set) {
    case DirectionSet::spun: return {reverse_bits(index) + seeds.u, points.bits(index).v};
    case DirectionSet::r2:
        return {static_cast<std::uint32_t>(index * detail::r2_steps[0] >> 32) + seeds.u,
                static_cast<std::uint32_t>(index * detail::r2_steps[1] >> 32) + seeds.v};
    default: return points.bits(index);
    }
}

}  // namespace nook::inline NOOK_TARGET
