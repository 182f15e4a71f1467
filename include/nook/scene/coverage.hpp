#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include <nook/scene/clip.hpp>

/// Which pixel centres a triangle on the grid covers, in integers.
namespace nook::inline NOOK_TARGET::detail {

[[nodiscard]] constexpr std::int64_t floor_divide(std::int64_t a, std::int64_t positive)
{
    return a >= 0 ? a / positive : -((-a - 1) / positive) - 1;
}

/// The pixels of one triangle on the grid, row by row, with the top-left rule.
class TriangleCoverage {
public:
    TriangleCoverage(int bits, GridPoint a, GridPoint b, GridPoint c) : bits_{bits}
    {
        std::int64_t area = edge(a, b, c);
        empty_ = area == 0;
        if (area < 0) std::swap(b, c);
        corners_[0] = a;
        corners_[1] = b;
        corners_[2] = c;
    }
    /// Calls f(y, first, last) for the covered pixels of each row of the image in [top, bottom].
    template <class F>
    void for_each_row(int width, int top, int bottom, const F& f) const
    {
        if (empty_) return;
        const auto [a, b, c] = corners_;
        const std::int64_t half = std::int64_t{1} << (bits_ - 1);
        const std::int64_t low = (std::min)({a.y, b.y, c.y}), high = (std::max)({a.y, b.y, c.y});
        const std::int64_t first_row = (std::max)(ceil_pixel(low - half), std::int64_t{top});
        const std::int64_t last_row = (std::min)((high - half) >> bits_, std::int64_t{bottom});
        for (std::int64_t y = first_row; y <= last_row; ++y) {
            std::int64_t first = 0, last = width - 1;
            for (int i = 0; i < 3 && first <= last; ++i)
                narrow(corners_[i], corners_[i == 2 ? 0 : i + 1], (y << bits_) + half, first, last);
            if (first <= last)
                f(static_cast<int>(y), static_cast<int>(first), static_cast<int>(last));
        }
    }

private:
    [[nodiscard]] static std::int64_t edge(GridPoint a, GridPoint b, GridPoint p)
    {
        return (std::int64_t{b.x} - a.x) * (std::int64_t{p.y} - a.y) -
               (std::int64_t{b.y} - a.y) * (std::int64_t{p.x} - a.x);
    }
    [[nodiscard]] std::int64_t ceil_pixel(std::int64_t value) const { return -((-value) >> bits_); }

    /// Cuts [first, last] to the pixels on the inner side of an edge at the row of centres y. The
    /// edge function is linear in x: one division finds where it changes sign, exactly.
    void narrow(GridPoint a, GridPoint b, std::int64_t y, std::int64_t& first,
                std::int64_t& last) const
    {
        const std::int64_t dx = std::int64_t{b.x} - a.x, dy = std::int64_t{b.y} - a.y;
        const std::int64_t half = std::int64_t{1} << (bits_ - 1);
        // Rows run down: the inside of a left edge (upwards) and of a top edge (to the right)
        // includes the edge itself.
        const bool included = dy < 0 || (dy == 0 && dx > 0);
        const std::int64_t value = dx * (y - a.y) - dy * (half - a.x) - (included ? 0 : 1);
        if (dy == 0) {
            if (value < 0) last = first - 1;
        } else if (dy < 0) {
            first = (std::max)(first, -floor_divide(value, -dy * (std::int64_t{1} << bits_)));
        } else {
            last = (std::min)(last, floor_divide(value, dy * (std::int64_t{1} << bits_)));
        }
    }

    GridPoint corners_[3];
    int bits_;
    bool empty_ = false;
};

}  // namespace nook::inline NOOK_TARGET::detail
