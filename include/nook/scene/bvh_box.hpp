#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <nook/lanes.hpp>
#include <nook/scene/ray.hpp>

/// Boxes as a builder handles them: whole boxes in registers.
namespace nook::inline NOOK_TARGET::detail {

/// N floats in native registers.
template <int N>
struct Pack {
    static constexpr int width = native_lanes == 1      ? 1
                                 : 2 * native_lanes < N ? 2 * native_lanes
                                                        : N;
    static constexpr int parts = N / width;
    using Part = Lanes<float, width>;

    Part part[parts];

    [[nodiscard]] NOOK_INLINE static Pack load(const float* values)
    {
        Pack result;
        for (int i = 0; i < parts; ++i) result.part[i] = detail::load<width>(values + i * width);
        return result;
    }
    /// With every fourth value zeroed, whatever its bits.
    [[nodiscard]] NOOK_INLINE static Pack load_masked(const void* values)
    {
        using Bits = Lanes<std::int32_t, width>;
        constexpr std::int32_t mask[8] = {-1, -1, -1, 0, -1, -1, -1, 0};
        Pack result;
        for (int i = 0; i < parts; ++i) {
            const auto* const bits =
                static_cast<const std::byte*>(values) + sizeof(Bits) * static_cast<std::size_t>(i);
            Bits read;
            std::memcpy(&read, bits, sizeof read);
            const Bits kept = read & detail::load<width>(mask + i * width % 8);
            result.part[i] = std::bit_cast<Part>(kept);
        }
        return result;
    }
    [[nodiscard]] NOOK_INLINE static Pack of(float value)
    {
        Pack result;
        for (int i = 0; i < parts; ++i) result.part[i] = broadcast<width>(value);
        return result;
    }
    NOOK_INLINE void store(float* values) const
    {
        for (int i = 0; i < parts; ++i) detail::store(values + i * width, part[i]);
    }
    [[nodiscard]] NOOK_INLINE auto halves() const
    {
        struct Halves {
            Pack<N / 2> low, high;
        };
        return std::bit_cast<Halves>(*this);
    }
    [[nodiscard]] NOOK_INLINE Pack halves_swapped() const
    {
        if constexpr (parts > 1) {
            Pack result;
            for (int i = 0; i < parts; ++i) result.part[i] = part[(i + parts / 2) % parts];
            return result;
        } else {
#if defined(__AVX__)
            return {{_mm256_permute2f128_ps(part[0], part[0], 1)}};
#else
            return *this;
#endif
        }
    }
    template <class Combine>
    [[nodiscard]] NOOK_INLINE static Pack map(const Pack& a, const Pack& b, const Combine& combine)
    {
        Pack result;
        for (int i = 0; i < parts; ++i) result.part[i] = combine(a.part[i], b.part[i]);
        return result;
    }
    [[nodiscard]] NOOK_INLINE friend Pack smaller(const Pack& a, const Pack& b)
    {
        return map(a, b, [](const Part& x, const Part& y) { return least(x, y); });
    }
    [[nodiscard]] NOOK_INLINE friend Pack operator+(const Pack& a, const Pack& b)
    {
        return map(a, b, [](const Part& x, const Part& y) -> Part { return x + y; });
    }
    [[nodiscard]] NOOK_INLINE friend Pack operator-(const Pack& a, const Pack& b)
    {
        return map(a, b, [](const Part& x, const Part& y) -> Part { return x - y; });
    }
    /// Rounded, also where a sum follows.
    [[nodiscard]] NOOK_INLINE friend Pack operator*(const Pack& a, const Pack& b)
    {
        return map(a, b, [](const Part& x, const Part& y) -> Part { return rounded<Part>(x * y); });
    }

    [[nodiscard]] NOOK_INLINE friend Pack fenced(const Pack& a)
    {
        return map(a, a, [](const Part& x, const Part&) -> Part { return detail::fenced(x); });
    }

private:
    [[nodiscard]] NOOK_INLINE static Part least(const Part& x, const Part& y)
    {
// One instruction, which GCC does not make of the comparison.
#if defined(__AVX__)
        if constexpr (width == 8) return _mm256_min_ps(x, y);
#endif
#if defined(__SSE2__)
        if constexpr (width == 4) return _mm_min_ps(x, y);
#endif
        return detail::smaller(x, y);
    }
};
using Quad = Pack<4>;
/// A box as {low x, y, z, any, −high x, y, z, any}: one minimum includes another.
using BoxRow = Pack<8>;

/// Beyond every coordinate of scene space: what a box of nothing has for low and −high.
inline constexpr float beyond_scene = 8;

[[nodiscard]] NOOK_INLINE BoxRow empty_box() { return BoxRow::of(beyond_scene); }
/// The edges of a box, each negative.
[[nodiscard]] NOOK_INLINE Quad negative_edges(const BoxRow& box)
{
    const auto [low, negative_high] = box.halves();
    return low + negative_high;
}
/// The box of the point that is twice the centre.
[[nodiscard]] NOOK_INLINE BoxRow centre_box(const BoxRow& box)
{
    return fenced(box - box.halves_swapped());
}
/// Half the surface of each of four boxes, from their edges.
template <class Q>
[[nodiscard]] NOOK_INLINE Q half_areas(Q (&edges)[4])
{
    if constexpr (Q::parts == 1) {
        typename Q::Part rows[4] = {edges[0].part[0], edges[1].part[0], edges[2].part[0],
                                    edges[3].part[0]};
        transpose(rows);
        const Q x{{rows[0]}}, y{{rows[1]}}, z{{rows[2]}};
        return x * y + y * z + z * x;
    } else {
        Q x, y, z;
        for (int i = 0; i < 4; ++i) {
            x.part[i] = edges[i].part[0];
            y.part[i] = edges[i].part[1];
            z.part[i] = edges[i].part[2];
        }
        return x * y + y * z + z * x;
    }
}

/// A triangle while it is sorted: its box as a BoxRow, with two more things in the free places.
struct BvhItem {
    float low[3];
    std::uint32_t face;
    float negative_high[3];
    /// Of the triangle.
    float area;

    /// A face read as a float may be a denormal or a NaN, so the free places become zero.
    [[nodiscard]] NOOK_INLINE BoxRow box() const { return BoxRow::load_masked(this); }
};
static_assert(sizeof(BvhItem) == 32);

/// The item of a triangle; its box is that of `SceneTriangle::bounds`.
[[nodiscard]] inline BvhItem bvh_item(const SceneTriangle& triangle)
{
    // The fourth value of a corner is whatever follows.
    static_assert(sizeof(SceneTriangle) >= 10 * sizeof(float));
    Quad corners[3];
    for (int i = 0; i < 3; ++i) {
        float values[4];
        std::memcpy(values, reinterpret_cast<const std::byte*>(&triangle) + 12 * i, sizeof values);
        corners[i] = Quad::load(values);
    }
    const Quad zero = Quad::of(0);
    const Quad low = smaller(smaller(corners[0], corners[1]), corners[2]);
    const Quad negative_high =
        smaller(smaller(zero - corners[0], zero - corners[1]), zero - corners[2]);
    float edges[4];
    (zero - low - negative_high).store(edges);
    const float xy = edges[0] > edges[1] ? edges[0] : edges[1];
    const Quad padding = Quad::of(0x1p-22f * (xy > edges[2] ? xy : edges[2]));
    BvhItem item;
    float box[8];
    (low - padding).store(box);
    (negative_high - padding).store(box + 4);
    std::memcpy(&item, box, sizeof item);
    item.face = triangle.face;
    const Vector3 normal = triangle.normal();
    item.area = static_cast<float>(std::sqrt(dot(normal, normal)));
    return item;
}

}  // namespace nook::inline NOOK_TARGET::detail
