#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/depth/moments_table.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>

/// What the filter for windows of many sizes keeps while it goes down the rows of a tile.
namespace nook::inline NOOK_TARGET::detail {

/// Rows of a table: as many as the windows of one row of pixels reach, the newest in place of the
/// oldest.
struct TableRing {
    /// Room before the first entry of a row; the entry before it is 0.
    static constexpr int margin = 16;

    TableRow memory;
    std::ptrdiff_t stride;  ///< entries from one row to the next, `margin` included
    int rows = 0;           ///< kept, with the one above the first
    int newest = 0;         ///< the last row added
    int slot = 0;           ///< where it lies
    FixedPoint fixed{};

    [[nodiscard]] NOOK_INLINE TableRow row(int y) const
    {
        const int at = slot - (newest - y);
        return memory + ((at < 0 ? at + rows : at) * stride + margin);
    }
    /// Forgets all rows; the first to add is `first`.
    void start(int first);
    /// Adds the next row, of `count` distances, padded with background to a multiple of the lanes.
    template <int lanes, bool masked, bool wide, class Distance>
    void add(const Distance* samples, int count);
};

/// The least and greatest surface distances; `greatest` is 0 where there is none.
template <class Distance>
struct DistanceRange {
    Distance least = (std::numeric_limits<Distance>::max)(), greatest = 0;
    bool background = false;  ///< not all are surfaces

    NOOK_INLINE void add(const DistanceRange& other)
    {
        least = smaller(least, other.least);
        greatest = larger(greatest, other.greatest);
        background = background || other.background;
    }
};

/// How many samples rows are padded to multiples of, with background.
inline constexpr int row_padding = 64;
[[nodiscard]] constexpr std::ptrdiff_t padded(int count)
{
    return (std::ptrdiff_t{count} + row_padding - 1) / row_padding * row_padding;
}

/// The range of a padded run of samples; does not look for background.
template <int lanes, class Distance>
[[nodiscard]] DistanceRange<Distance> range_of(const Distance* samples, int count);

/// Reads the columns `at` of row y, 0 for background, and pads them. True when not all are surfaces.
template <int lanes, class Stored, class Decode, class Distance>
bool read_padded(const DepthSource<Stored, Decode>& source, Span at, int y, Distance* samples);

// --- bodies ---

inline void TableRing::start(int first)
{
    newest = first - 1;
    slot = 0;
    for (int i = 0; i < rows; ++i) {
        const TableRow before = memory + (i * stride + margin - 1);
        *before.sum = *before.squares = *before.marks = *before.background = 0;
    }
    const TableRow zero = row(newest);
    const std::ptrdiff_t entries = stride - margin;
    std::fill_n(zero.sum, entries, std::uint64_t{0});
    std::fill_n(zero.squares, entries, std::uint64_t{0});
    std::fill_n(zero.marks, entries, std::uint64_t{0});
    std::fill_n(zero.background, entries, std::uint64_t{0});
}

template <int lanes, bool masked, bool wide, class Distance>
void TableRing::add(const Distance* samples, int count)
{
    const TableRow above = row(newest);
    ++newest;
    slot = slot + 1 == rows ? 0 : slot + 1;
    add_table_row<lanes, masked, wide>(fixed, samples, count, above, row(newest));
}

/// Adds distances to a range in registers, lane by lane.
template <class Distance, class L>
NOOK_INLINE void add_to_range(L& least, L& greatest, const L& distance)
{
    constexpr Distance huge = (std::numeric_limits<Distance>::max)();
    greatest = larger(greatest, distance);
    least = smaller(least, distance > Distance{0} ? distance : L{} + huge);
}
template <class L>
[[nodiscard]] NOOK_INLINE auto least_lane(const L& values)
{
    return fold(values, [](const auto& a, const auto& b) { return smaller(a, b); });
}
template <class L>
[[nodiscard]] NOOK_INLINE auto greatest_lane(const L& values)
{
    return fold(values, [](const auto& a, const auto& b) { return larger(a, b); });
}

/// Distances side by side in a register that holds so many doubles.
template <int lanes, class Distance>
inline constexpr int distance_lanes = lanes == 1 ? 1
                                                 : lanes * 8 / static_cast<int>(sizeof(Distance));

template <int lanes, class Distance>
NOOK_INLINE DistanceRange<Distance> range_of(const Distance* samples, int count)
{
    constexpr int side = distance_lanes<lanes, Distance>;
    auto least = broadcast<side>((std::numeric_limits<Distance>::max)());
    auto greatest = Lanes<Distance, side>{};
    for (int i = 0; i < count; i += side)
        add_to_range<Distance>(least, greatest, load<side>(samples + i));
    return {least_lane(least), greatest_lane(greatest)};
}

template <int lanes, class Stored, class Decode, class Distance>
bool read_padded(const DepthSource<Stored, Decode>& source, Span at, int y, Distance* samples)
{
    const int count = at.last - at.first + 1;
    const Background background =
        read_row<distance_lanes<lanes, Distance>>(source, at.first, count, y, samples);
    std::fill(samples + count, samples + padded(count), Distance{0});
    return background != Background::none;
}

}  // namespace nook::inline NOOK_TARGET::detail
