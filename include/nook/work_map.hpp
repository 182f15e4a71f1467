#pragma once

#include <cstdint>

#include <nook/image.hpp>

namespace nook {

/// Which pixels are worth work, in groups of 16 × 1: group g of row y holds the pixels
/// 16 g … 16 g + 15 of that row. An inactive group costs a kernel as little as it can manage, its
/// pixels become exactly 1, and they are counted as skipped. An empty map means that all are active.
struct WorkMap {
    static constexpr int group = 16;

    /// One byte per group, (width + 15) / 16 × height of them; 0 = inactive.
    ImageView<const std::uint8_t> active{};
    /// True when the planner has proved that the kernel would have given the same bits without a map.
    bool exact = true;

    [[nodiscard]] NOOK_INLINE constexpr bool everything() const { return active.empty(); }
    [[nodiscard]] NOOK_INLINE constexpr bool is_active(int x, int y) const
    {
        return everything() || active(x / group, y) != 0;
    }
    [[nodiscard]] NOOK_INLINE constexpr bool any_active() const
    {
        if (everything()) return true;
        for (int y = 0; y < active.height; ++y)
            for (int g = 0; g < active.width; ++g)
                if (active(g, y) != 0) return true;
        return false;
    }
    [[nodiscard]] NOOK_INLINE static constexpr int groups(int width)
    {
        return width / group + (width % group != 0 ? 1 : 0);
    }
};

}  // namespace nook
