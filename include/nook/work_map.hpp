#pragma once

#include <cstdint>

#include <nook/image.hpp>

namespace nook {

/// Which pixels are worth work, in groups of 16 × 1: group g of row y holds the pixels
/// 16 g … 16 g + 15 of that row. An inactive group costs a kernel as little as it can manage, its
/// pixels become exactly 1, and they are counted as skipped. An empty map means that all are active.
struct WorkMap {
    static constexpr int group = 16;
    /// What a group is that is active as a whole.
    static constexpr std::uint8_t all_sectors = 0xff;

    /// One byte per group, (width + 15) / 16 × height of them; 0 = inactive. Bit k of the others tells
    /// that something may be found towards sector k of the screen: from k eighths of a turn on to the
    /// next, 0 to the right, counted towards up. Kernels whose samples have no direction take any
    /// byte but 0 as active.
    ImageView<const std::uint8_t> active{};
    /// True when the planner has proved that the kernel would have given the same bits without a map.
    bool exact = true;

    [[nodiscard]] NOOK_INLINE constexpr bool everything() const { return active.empty(); }
    [[nodiscard]] NOOK_INLINE constexpr bool is_active(int x, int y) const
    {
        return everything() || active(x / group, y) != 0;
    }
    /// The sectors of a pixel's group.
    [[nodiscard]] NOOK_INLINE constexpr std::uint8_t sectors(int x, int y) const
    {
        return everything() ? all_sectors : active(x / group, y);
    }
    [[nodiscard]] NOOK_INLINE static constexpr int groups(int width)
    {
        return width / group + (width % group != 0 ? 1 : 0);
    }
};

}  // namespace nook
