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

/// Asks for the pixels of a row that will be read soon.
template <class Stored, class Decode>
void prefetch_row(const DepthSource<Stored, Decode>& source, int x, int count, int y)
{
    constexpr int line = 64 / static_cast<int>(sizeof(Stored));
    if (source.image.pixel_stride != 1) return;
    for (int i = 0; i < count; i += line) prefetch(&source.image(x + i, y));
}

/// How many of `count` pixels of row y from column x on are surfaces.
template <int lanes, class Stored, class Decode>
[[nodiscard]] std::uint64_t count_surfaces(const DepthSource<Stored, Decode>& source, int x,
                                           int count, int y)
{
    using Distance = typename DepthSource<Stored, Decode>::Distance;
    int i = 0;
    std::uint64_t surfaces_found = 0;
    if constexpr (std::is_same_v<Decode, IdentityDecode>) {
        if (source.image.pixel_stride == 1) {
            using Bits = std::conditional_t<sizeof(Distance) == 4, std::int32_t, std::int64_t>;
            const Stored* const in = source.image.data + (y * source.image.row_stride + x);
            const Stored* const next =
                y + 1 < source.image.height ? in + source.image.row_stride : in;
            Lanes<Bits, lanes> found{};
            for (; i + lanes <= count; i += lanes) {
                prefetch(next + i);
                const auto distances = surfaces(load<lanes>(in + i), source.far_limit);
                found +=
                    distances > Distance{0} ? Lanes<Bits, lanes>{} + Bits{1} : Lanes<Bits, lanes>{};
            }
            surfaces_found = static_cast<std::uint64_t>(
                fold(found, [](const auto& a, const auto& b) { return a + b; }));
        }
    }
    for (; i < count; ++i) surfaces_found += surface_distance(source, x + i, y) > 0;
    return surfaces_found;
}

}  // namespace nook::inline NOOK_TARGET::detail
