#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#if defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <nook/target.hpp>

/// Several numbers handled at once, from one source for every instruction set.
///
/// `Lanes<T, N>` is N values of T: a vector type of the compiler (GCC's vector extensions, which
/// Clang has too), or T itself for N = 1. Arithmetic, comparisons and `? :` work on both as they
/// stand; the functions below are what the operators lack. A kernel written over N runs as scalar code
/// with N = 1, which is all there is for compilers without the extensions.
namespace nook::inline NOOK_TARGET::detail {

/// How many doubles a register of the target holds; as many floats are taken along with them.
#if !defined(__GNUC__) || defined(NOOK_NO_VECTORS)
inline constexpr int native_lanes = 1;
#elif defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
inline constexpr int native_lanes = 8;
#elif defined(__AVX__)
inline constexpr int native_lanes = 4;
#elif defined(__SSE2__) || defined(__aarch64__)
inline constexpr int native_lanes = 2;
#else
inline constexpr int native_lanes = 1;
#endif

/// How many floats a register holds.
inline constexpr int float_lanes = native_lanes == 1 ? 1 : 2 * native_lanes;

template <class T, int N>
struct LanesOf {
#if defined(__GNUC__)
    typedef T type __attribute__((vector_size(sizeof(T) * N)));
#endif
};
template <class T>
struct LanesOf<T, 1> {
    using type = T;
};
template <class T, int N>
using Lanes = typename LanesOf<T, N>::type;

template <class L>
struct LanesTraits {
    using Value = std::remove_cvref_t<decltype(std::declval<L>()[0])>;
    static constexpr int count = static_cast<int>(sizeof(L) / sizeof(Value));
};
template <class L>
requires std::is_arithmetic_v<L>
struct LanesTraits<L> {
    using Value = L;
    static constexpr int count = 1;
};

template <int N, class T>
[[nodiscard]] NOOK_INLINE Lanes<T, N> load(const T* values)
{
    Lanes<T, N> lanes;
    std::memcpy(&lanes, values, sizeof lanes);
    return lanes;
}
template <class T, class L>
NOOK_INLINE void store(T* values, const L& lanes)
{
    static_assert(sizeof lanes == sizeof(T) * static_cast<unsigned>(LanesTraits<L>::count));
    std::memcpy(values, &lanes, sizeof lanes);
}

/// The value as it was computed: -ffast-math may not take the sum apart and put it together in another
/// way. Differences from a pivot are exact only as differences.
template <class L>
[[nodiscard]] NOOK_INLINE L fenced(const L& value)
{
#if defined(__FAST_MATH__) && defined(__clang__)
    return __arithmetic_fence(value);
#elif defined(__FAST_MATH__) && defined(__GNUC__) && __GNUC__ >= 12
    return __builtin_assoc_barrier(value);
#else
    return value;
#endif
}

/// The value as it was rounded: the compiler may not contract a product with the sum it feeds, so that
/// targets with and without FMA get the same bits. Scalars and native vectors.
template <class L>
[[nodiscard]] NOOK_INLINE constexpr L rounded(const L& value)
{
    if (std::is_constant_evaluated()) return value;
#if defined(__GNUC__) && (defined(__SSE2__) || defined(__aarch64__))
    L kept = value;
#if defined(__AVX512F__)
    asm("" : "+v"(kept));
#elif defined(__SSE2__)
    asm("" : "+x"(kept));
#else
    asm("" : "+w"(kept));
#endif
    return kept;
#elif defined(__GNUC__)
    L kept = value;
    asm("" : "+m"(kept));
    return kept;
#else
    return value;  // MSVC contracts nothing unless it is told to.
#endif
}

/// values[index] for every lane.
template <class T, class Index>
[[nodiscard]] NOOK_INLINE Lanes<T, LanesTraits<Index>::count> gather(const T* values,
                                                                     const Index& index)
{
    constexpr int N = LanesTraits<Index>::count;
    if constexpr (N == 1) return values[index];
#if defined(__AVX512F__)
    else if constexpr (std::is_same_v<Lanes<T, N>, Lanes<float, 16>>)
        return _mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xffff, std::bit_cast<__m512i>(index),
                                        values, 4);
#endif
#if defined(__AVX2__)
    else if constexpr (std::is_same_v<Lanes<T, N>, Lanes<float, 8>>)
        return _mm256_i32gather_ps(values, std::bit_cast<__m256i>(index), 4);
#endif
#if defined(__GNUC__)
    else {
        Lanes<T, N> result{};
        for (int lane = 0; lane < N; ++lane) result[lane] = values[index[lane]];
        return result;
    }
#endif
}

/// Asks for memory that will be read soon; any address will do.
inline void prefetch([[maybe_unused]] const void* address)
{
#if defined(__GNUC__)
    __builtin_prefetch(address);
#endif
}

/// The same value in all lanes. Subtracting +0 leaves every value as it is.
template <int N, class T>
[[nodiscard]] NOOK_INLINE Lanes<T, N> broadcast(T value)
{
    return value - Lanes<T, N>{};
}

template <class To, class L>
[[nodiscard]] NOOK_INLINE Lanes<To, LanesTraits<L>::count> convert(const L& lanes)
{
    if constexpr (std::is_same_v<To, typename LanesTraits<L>::Value>) return lanes;
    else if constexpr (LanesTraits<L>::count == 1) return static_cast<To>(lanes);
// GCC 12 converts these by halves (and warns about the unmasked forms).
#if defined(__AVX512F__)
    else if constexpr (std::is_same_v<L, Lanes<float, 8>> && std::is_same_v<To, double>)
        return _mm512_maskz_cvtps_pd(0xff, lanes);
    else if constexpr (std::is_same_v<L, Lanes<double, 8>> && std::is_same_v<To, float>)
        return _mm512_maskz_cvtpd_ps(0xff, lanes);
#endif
#if defined(__AVX__)
    else if constexpr (std::is_same_v<L, Lanes<float, 4>> && std::is_same_v<To, double>)
        return _mm256_cvtps_pd(lanes);
    else if constexpr (std::is_same_v<L, Lanes<double, 4>> && std::is_same_v<To, float>)
        return _mm256_cvtpd_ps(lanes);
#endif
#if defined(__GNUC__)
    else return __builtin_convertvector(lanes, Lanes<To, LanesTraits<L>::count>);
#endif
}

template <class L>
[[nodiscard]] NOOK_INLINE L larger(const L& a, const L& b)
{
    return a > b ? a : b;
}
template <class L>
[[nodiscard]] NOOK_INLINE L smaller(const L& a, const L& b)
{
    return a < b ? a : b;
}

/// The correctly rounded root; -ffast-math may make it an estimate refined to 22 bits or more.
template <class L>
[[nodiscard]] NOOK_INLINE L square_root(const L& value)
{
    if constexpr (LanesTraits<L>::count == 1) return std::sqrt(value);
#if defined(__AVX512F__)
    else if constexpr (std::is_same_v<L, Lanes<float, 16>>)
        return _mm512_maskz_sqrt_ps(0xffff, value);
    else if constexpr (std::is_same_v<L, Lanes<double, 8>>)
        return _mm512_maskz_sqrt_pd(0xff, value);
#endif
#if defined(__AVX__)
    else if constexpr (std::is_same_v<L, Lanes<float, 8>>) return _mm256_sqrt_ps(value);
    else if constexpr (std::is_same_v<L, Lanes<double, 4>>) return _mm256_sqrt_pd(value);
#endif
#if defined(__SSE2__)
    else if constexpr (std::is_same_v<L, Lanes<float, 4>>) return _mm_sqrt_ps(value);
    else if constexpr (std::is_same_v<L, Lanes<double, 2>>) return _mm_sqrt_pd(value);
#endif
#if defined(__GNUC__)
    else {
        L root{};
        for (int lane = 0; lane < LanesTraits<L>::count; ++lane)
            root[lane] = std::sqrt(value[lane]);
        return root;
    }
#endif
}

template <class L, int... I>
[[nodiscard]] NOOK_INLINE auto halves(const L& lanes, std::integer_sequence<int, I...>)
{
    using Half = Lanes<typename LanesTraits<L>::Value, static_cast<int>(sizeof...(I))>;
    struct Halves {
        Half low, high;
    };
#if defined(__clang__) || (defined(__GNUC__) && __GNUC__ >= 12)
    if constexpr (sizeof...(I) > 1)
        return Halves{
            __builtin_shufflevector(lanes, lanes, I...),
            __builtin_shufflevector(lanes, lanes, (I + static_cast<int>(sizeof...(I)))...)};
    else return Halves{lanes[0], lanes[1]};
#else
    return std::bit_cast<Halves>(lanes);
#endif
}
/// Combines all lanes into one value.
template <class L, class Combine>
[[nodiscard]] NOOK_INLINE auto fold(const L& lanes, const Combine& combine)
{
    constexpr int count = LanesTraits<L>::count;
    if constexpr (count == 1) {
        // One lane of a vector and a scalar are both scalars.
        return lanes;
    } else {
        const auto both = halves(lanes, std::make_integer_sequence<int, count / 2>{});
        return fold(combine(both.low, both.high), combine);
    }
}

/// True when any lane of a comparison's result is.
template <class Mask>
[[nodiscard]] NOOK_INLINE bool any(const Mask& mask)
{
    if constexpr (LanesTraits<Mask>::count == 1) return mask != 0;
#if defined(__AVX512F__)
    else if constexpr (sizeof mask == 64)
        return _mm512_test_epi32_mask(std::bit_cast<__m512i>(mask), std::bit_cast<__m512i>(mask)) !=
               0;
#endif
#if defined(__AVX__)
    else if constexpr (sizeof mask == 32)
        return _mm256_testz_si256(std::bit_cast<__m256i>(mask), std::bit_cast<__m256i>(mask)) == 0;
#endif
#if defined(__SSE2__)
    else if constexpr (sizeof mask == 16)
        return _mm_movemask_epi8(std::bit_cast<__m128i>(mask)) != 0;
#endif
    else return fold(mask, [](const auto& a, const auto& b) { return a | b; }) != 0;
}

/// One bit per lane of floats, lane 0 the lowest: a <= b.
template <class L>
[[nodiscard]] NOOK_INLINE unsigned bits_at_most(const L& a, const L& b)
{
    if constexpr (LanesTraits<L>::count == 1) return a <= b ? 1u : 0u;
#if defined(__AVX512F__)
    else if constexpr (std::is_same_v<L, Lanes<float, 16>>)
        return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ);
#endif
#if defined(__AVX__)
    else if constexpr (std::is_same_v<L, Lanes<float, 8>>)
        return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LE_OQ)));
#endif
#if defined(__SSE2__)
    else if constexpr (std::is_same_v<L, Lanes<float, 4>>)
        return static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(a, b)));
#endif
    else {
        unsigned bits = 0;
        for (int lane = 0; lane < LanesTraits<L>::count; ++lane)
            bits |= (a[lane] <= b[lane] ? 1u : 0u) << lane;
        return bits;
    }
}

#if defined(__clang__)
#define NOOK_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#elif defined(__GNUC__)
/// Integers as wide as T.
template <class T>
using ShuffleIndex = std::conditional_t<sizeof(T) == 8, std::int64_t, std::int32_t>;
#define NOOK_SHUFFLE(a, b, ...)                                                     \
    __builtin_shuffle(a, b,                                                         \
                      Lanes<ShuffleIndex<typename LanesTraits<decltype(a)>::Value>, \
                            LanesTraits<decltype(a)>::count>{__VA_ARGS__})
#else
#define NOOK_SHUFFLE(a, b, ...) a
#endif

template <int half, class L, int... I>
NOOK_INLINE void transpose_halves(L* rows, std::integer_sequence<int, I...>)
{
    constexpr int N = sizeof...(I);
    for (int i = 0; i < N; ++i) {
        if ((i & half) != 0) continue;
        L a = rows[i], b = rows[i + half];
        rows[i] = NOOK_SHUFFLE(a, b, ((I & half) != 0 ? N + I - half : I)...);
        rows[i + half] = NOOK_SHUFFLE(a, b, ((I & half) != 0 ? N + I : I + half)...);
    }
}
/// Turns N rows of N values into columns, N a power of two: halves of pairs of rows change places,
/// for halves of each power of two.
template <class L, int N>
NOOK_INLINE void transpose(L (&rows)[N])
{
    static_assert(N == LanesTraits<L>::count && (N == 1 || N == 2 || N == 4 || N == 8));
    constexpr auto lanes = std::make_integer_sequence<int, N>{};
    if constexpr (N > 4) transpose_halves<4>(rows, lanes);
    if constexpr (N > 2) transpose_halves<2>(rows, lanes);
    if constexpr (N > 1) transpose_halves<1>(rows, lanes);
}

template <int channel, class L, int... I>
[[nodiscard]] NOOK_INLINE L every_third(const L& first, const L& second, const L& third,
                                        std::integer_sequence<int, I...>)
{
    constexpr int N = sizeof...(I);
    const L a = first, b = second, c = third;
    const L most = NOOK_SHUFFLE(a, b, (3 * I + channel < 2 * N ? 3 * I + channel : 0)...);
    return NOOK_SHUFFLE(most, c, (3 * I + channel < 2 * N ? I : 3 * I + channel - N)...);
}
/// Elements channel, channel + 3, … of three vectors in a row.
template <int channel, class L>
[[nodiscard]] NOOK_INLINE L every_third(const L& first, const L& second, const L& third)
{
    constexpr int N = LanesTraits<L>::count;
    if constexpr (N == 1) return channel == 0 ? first : channel == 1 ? second : third;
    else return every_third<channel>(first, second, third, std::make_integer_sequence<int, N>{});
}

#undef NOOK_SHUFFLE

}  // namespace nook::inline NOOK_TARGET::detail
