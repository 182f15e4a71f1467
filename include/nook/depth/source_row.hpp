#pragma once

#include <bit>
#include <cstdint>
#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/lanes.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Distances that are surfaces, 0 for the others: `is_surface` on lanes. Positive floats are ordered
/// like the integers of their bits.
template <class L, class Distance>
[[nodiscard]] NOOK_INLINE L surfaces(const L& distances, Distance far_limit)
{
    using Bits = std::conditional_t<sizeof(Distance) == 4, std::int32_t, std::int64_t>;
    constexpr Bits largest = sizeof(Distance) == 4 ? Bits{0x7f7fffff} : Bits(0x5df0000000000000);
    const Bits limit = std::bit_cast<Bits>(far_limit);
    const auto bits = std::bit_cast<Lanes<Bits, LanesTraits<L>::count>>(distances);
    const auto surface = (bits > Bits{0}) & (bits <= (limit < largest ? limit : largest));
    return surface ? distances : L{};
}

enum class Background : unsigned char { none, some, all };

/// Writes the distances of `count` pixels of row y from column x on, 0 for background, and tells
/// whether there is any.
template <int lanes, class Stored, class Decode, class Distance>
Background read_row(const DepthSource<Stored, Decode>& source, int x, int count, int y,
                    Distance* row)
{
    Distance least = 1, largest = 0;
    int i = 0;
    if constexpr (std::is_same_v<Decode, IdentityDecode>) {
        if (source.image.pixel_stride == 1) {
            const Stored* const in = source.image.data + (y * source.image.row_stride + x);
            const Stored* const next =
                y + 1 < source.image.height ? in + source.image.row_stride : in;
            const Distance far_limit = source.far_limit;
            auto least_lanes = broadcast<lanes>(Distance{1}),
                 largest_lanes = Lanes<Distance, lanes>{};
            for (; i + lanes <= count; i += lanes) {
                prefetch(next + i);
                const auto distances = surfaces(load<lanes>(in + i), far_limit);
                least_lanes = smaller(least_lanes, distances);
                largest_lanes = larger(largest_lanes, distances);
                store(row + i, distances);
            }
            if (any(least_lanes == Distance{0})) least = 0;
            if (any(largest_lanes > Distance{0})) largest = 1;
        }
    }
    for (; i < count; ++i) {
        row[i] = surface_distance(source, x + i, y);
        least = smaller(least, row[i]);
        largest = larger(largest, row[i]);
    }
    if (least > 0) return Background::none;
    return largest > 0 ? Background::some : Background::all;
}

}  // namespace nook::inline NOOK_TARGET::detail
