#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/outline_raster_tiles.hpp>
#include <nook/scene/outline_raster_vertex.hpp>

/// Which pixel centres a triangle of an outline covers, its key there, and what it adds to the counts.
namespace nook::inline NOOK_TARGET::detail {

/// The first and the last pixel whose centre lies between two positions on the grid.
[[nodiscard]] constexpr std::int32_t first_centre(std::int32_t position)
{
    return (position + (1 << (outline_bits - 1)) - 1) >> outline_bits;
}
[[nodiscard]] constexpr std::int32_t last_centre(std::int32_t position)
{
    return (position - (1 << (outline_bits - 1))) >> outline_bits;
}

/// The pixels whose centres lie in the box of a triangle, without its right and lower side, which the
/// top-left rule leaves out.
struct OutlineBox {
    int left, right, top, bottom;

    OutlineBox(const OutlineVertex& a, const OutlineVertex& b, const OutlineVertex& c)
        : left{first_centre(smaller(smaller(a.x, b.x), c.x))},
          right{last_centre(larger(larger(a.x, b.x), c.x) - 1)},
          top{first_centre(smaller(smaller(a.y, b.y), c.y))},
          bottom{last_centre(larger(larger(a.y, b.y), c.y) - 1)}
    {}
    /// Cuts it to the columns [0, width) and the rows [first, last].
    void cut(int width, int first, int last)
    {
        left = larger(left, 0);
        right = smaller(right, width - 1);
        top = larger(top, first);
        bottom = smaller(bottom, last);
    }
    [[nodiscard]] bool empty() const { return left > right || top > bottom; }
};

/// A band of rows, top first, and what has been counted there.
struct OutlineBand {
    /// Room after each row for a whole vector from any pixel on.
    static constexpr int padding = float_lanes;

    int width, top, bottom;
    std::ptrdiff_t stride;
    std::int32_t* counts;
    /// What the counts of a row change by from each pixel on, on top of `counts`.
    std::int32_t* changes;
    const float* keys;
    OutlineTiles tiles;

    /// Counts that are complete: `changes` added up, and `start` that all pixels share.
    void settle(std::int32_t start) const
    {
        for (int y = top; y <= bottom; ++y) {
            const std::ptrdiff_t row = (y - top) * stride;
            std::int32_t sum = start;
            for (int x = 0; x < width; ++x) {
                sum += changes[row + x];
                counts[row + x] += sum;
            }
        }
    }
};

/// A triangle with its corners on the grid.
class OutlineTriangle {
public:
    OutlineTriangle(const OutlineVertex& a, const OutlineVertex& b, const OutlineVertex& c)
        : area_{twice_area(a, b, c)},
          corners_{a, area_ < 0 ? c : b, area_ < 0 ? b : c}
    {}
    [[nodiscard]] bool empty() const { return area_ == 0; }
    /// 1 when the corners run counter-clockwise in the picture, -1 when clockwise. Rows run down.
    [[nodiscard]] int facing() const { return area_ < 0 ? 1 : -1; }

    /// Whether it covers the centre of a pixel.
    [[nodiscard]] bool covers(int x, int y) const
    {
        const std::int32_t half = 1 << (outline_bits - 1);
        const OutlineVertex at{(x << outline_bits) + half, (y << outline_bits) + half, 0, 0};
        for (int i = 0; i < 3; ++i) {
            const OutlineVertex &from = corners_[i], &to = corners_[i == 2 ? 0 : i + 1];
            const bool included = to.y < from.y || (to.y == from.y && to.x > from.x);
            if (twice_area(from, to, at) < (included ? 0 : 1)) return false;
        }
        return area_ != 0;
    }

    /// Adds `step` to the count of every covered pixel of `box`, its box in the band, where it is not
    /// behind the visible surface (`in_front`), or where it is. Pixels without surface get anything.
    template <bool in_front>
    void count(const OutlineBand& band, const OutlineBox& box, std::int32_t step) const
    {
        const auto [a, b, c] = corners_;
        const float least = smaller(smaller(a.key, b.key), c.key);
        const float largest = larger(larger(a.key, b.key), c.key);
        const OutlineRange visible = band.tiles.range(box.left, box.right);
        if (visible.nearest < visible.farthest) return;
        const auto skipped = [&](double low, double high) {
            return in_front ? high < visible.farthest : low >= visible.nearest;
        };
        const auto whole = [&](double low, double high) {
            return in_front ? low >= visible.nearest : high < visible.farthest;
        };
        if (skipped(least, largest)) return;

        const Edges edges{*this};
        // For a few pixels it does not pay to look closer.
        const bool little =
            box.right - box.left < OutlineTiles::size && box.bottom - box.top < row_lanes;
        if (!little && whole(least, largest)) {
            count_whole(edges, band, box, step);
            return;
        }
        // The plane of the keys, per pixel, from the first corner.
        constexpr double units = 1 << outline_bits, half = units / 2;
        const double key_b = double{b.key} - double{a.key}, key_c = double{c.key} - double{a.key};
        OutlinePlane plane{};
        plane.least = least;
        plane.largest = largest;
        plane.across = (key_b * (c.y - a.y) - key_c * (b.y - a.y)) * edges.per_area;
        plane.down = (key_c * (b.x - a.x) - key_b * (c.x - a.x)) * edges.per_area;
        plane.start = double{a.key} + plane.across * ((half - a.x) / units) +
                      plane.down * ((half - a.y) / units);

        if (!little) {
            const double corner = plane.start + plane.across * box.left + plane.down * box.top;
            const double right = plane.across * (box.right - box.left);
            const double bottom = plane.down * (box.bottom - box.top);
            const double low =
                larger(corner + smaller(right, 0.0) + smaller(bottom, 0.0), double{least});
            const double high =
                smaller(corner + larger(right, 0.0) + larger(bottom, 0.0), double{largest});
            if (skipped(low, high)) return;
            if (whole(low, high)) {
                count_whole(edges, band, box, step);
                return;
            }
        }
        if (little) count_few<in_front>(edges, plane, band, box, step);
        else count_strips<in_front>(edges, plane, band, box, step);
    }

private:
    static constexpr int row_lanes = native_lanes;

    /// The edges as functions of the row: x lies inside while x + 1 is above the bounds of left edges
    /// and x is below the bounds of right edges.
    struct Edges {
        double slope[4], offset[4], scale[4];
        /// Caps that make the bound of an edge that is not a left or right one say nothing.
        double left[3], right[3];
        double per_area;

        explicit Edges(const OutlineTriangle& triangle)
        {
            constexpr double units = 1 << outline_bits, half = units / 2, endless = 0x1p100;
            double divisor[3];
            for (int i = 0; i < 3; ++i) {
                const OutlineVertex& from = triangle.corners_[i];
                const OutlineVertex& to = triangle.corners_[i == 2 ? 0 : i + 1];
                const std::int32_t down = to.y - from.y;
                const double dx = to.x - from.x, dy = down;
                // The inside of a left edge (upwards) includes the edge. The edge function is an integer:
                // half a unit keeps its sign from 0, and its quotient at least half a unit of the divisor
                // from an integer, more than the rounding of the bound. Horizontal edges are in the box.
                slope[i] = dx;
                offset[i] = dy * (from.x - half) + dx * (half - from.y) + (down < 0 ? 0.5 : -0.5);
                divisor[i] = down == 0 ? endless : dy * units;
                left[i] = down < 0 ? endless : -endless;
                right[i] = down > 0 ? -endless : endless;
            }
            const std::int64_t area = triangle.area_ < 0 ? -triangle.area_ : triangle.area_;
            invert<(native_lanes < 4 ? native_lanes : 4)>(divisor, static_cast<double>(area));
            per_area = scale[3] * units;
        }

    private:
        /// Several at once, and not by way of memory: its stores would have to be waited for.
        template <int lanes>
        NOOK_INLINE void invert(const double (&divisor)[3], double area)
        {
            using Reals = Lanes<double, lanes>;
            if constexpr (lanes == 4) {
                store(scale, Reals{1.0 / Reals{divisor[0], divisor[1], divisor[2], area}});
            } else if constexpr (lanes == 2) {
                store(scale, Reals{1.0 / Reals{divisor[0], divisor[1]}});
                store(scale + 2, Reals{1.0 / Reals{divisor[2], area}});
            } else {
                for (int i = 0; i < 3; ++i) scale[i] = 1.0 / divisor[i];
                scale[3] = 1.0 / area;
            }
        }
    };
    using Rows = Lanes<double, row_lanes>;

    [[nodiscard]] static std::int64_t twice_area(const OutlineVertex& a, const OutlineVertex& b,
                                                 const OutlineVertex& c)
    {
        return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
               (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
    }

    /// Calls f(y, rows, from, to) for the rows of the box, several at once: the covered pixels of row
    /// y + i, i < rows, are those from the whole part of from[i] on, below that of to[i].
    template <class F>
    NOOK_INLINE static void for_rows(const Edges& edges, int width, const OutlineBox& box,
                                     const F& f)
    {
        constexpr double units = 1 << outline_bits;
        double numbers[row_lanes];
        for (int i = 0; i < row_lanes; ++i) numbers[i] = i * units;
        const Rows lane = load<row_lanes>(numbers);
        for (int y = box.top; y <= box.bottom; y += row_lanes) {
            const Rows centres = lane + y * units;
            Rows from{}, to = broadcast<row_lanes>(double(width));
            for (int i = 0; i < 3; ++i) {
                // Exact: below 2⁵⁰, in halves.
                const Rows value = rounded(Rows{centres * edges.slope[i] + edges.offset[i]});
                const Rows bound = value * edges.scale[i] + 1.0;
                from = larger(from, Rows{smaller(bound, broadcast<row_lanes>(edges.left[i]))});
                to = smaller(to, Rows{larger(bound, broadcast<row_lanes>(edges.right[i]))});
            }
            f(y, smaller(row_lanes, box.bottom - y + 1),
              Rows{smaller(from, broadcast<row_lanes>(double(width)))}, Rows{larger(to, Rows{})});
        }
    }

    static void count_whole(const Edges& edges, const OutlineBand& band, const OutlineBox& box,
                            std::int32_t step)
    {
        for_rows(edges, band.width, box, [&](int y, int rows, const Rows& from, const Rows& to) {
            std::int32_t begin[row_lanes], end[row_lanes];
            store(begin, convert<std::int32_t>(from));
            store(end, convert<std::int32_t>(to));
            for (int i = 0; i < rows; ++i) {
                if (begin[i] >= end[i]) continue;
                std::int32_t* const row = band.changes + (y + i - band.top) * band.stride;
                row[begin[i]] += step;
                row[end[i]] -= step;
            }
        });
    }

    /// Looks at the tiles of each strip of rows first.
    template <bool in_front>
    static void count_strips(const Edges& edges, const OutlinePlane& plane, const OutlineBand& band,
                             const OutlineBox& box, std::int32_t step)
    {
        constexpr int size = OutlineTiles::size, strip_rows = OutlineTiles::strip, window = 64;
        const OutlineTileTest<in_front> test{plane, box.left, box.right, box.bottom - box.top};
        const int first = box.left / size, last = box.right / size;
        OutlineBox part = box;
        for (; part.top <= box.bottom; part.top = part.bottom + 1) {
            const int strip = (part.top - band.top) / strip_rows;
            const int top = band.top + strip * strip_rows;
            part.bottom = smaller(top + strip_rows - 1, box.bottom);
            for (int tile = first; tile <= last; tile += window) {
                const int count = smaller(last - tile + 1, window);
                const auto [some, whole] = test.compare(band.tiles, strip, top, tile, count);
                if (some == 0) continue;
                if (last - first < window && whole == ~std::uint64_t{0} >> (64 - count))
                    count_whole(edges, band, part, step);
                else count_parts<in_front>(edges, plane, band, part, step, tile, some);
            }
        }
    }

    /// The box of a little triangle. Stands alone: with both uses of count_parts in one function, their
    /// constants do not stay in registers.
    template <bool in_front>
    NOOK_NOINLINE static void count_few(const Edges& edges, const OutlinePlane& plane,
                                        const OutlineBand& band, const OutlineBox& box,
                                        std::int32_t step)
    {
        const int first = box.left / OutlineTiles::size, last = box.right / OutlineTiles::size;
        count_parts<in_front>(edges, plane, band, box, step, first, first == last ? 1 : 3);
    }

    /// Compares the keys in the tiles `first` + i for each bit i of `tiles` that is set.
    template <bool in_front>
    NOOK_INLINE static void count_parts(const Edges& edges, const OutlinePlane& plane,
                                        const OutlineBand& band, const OutlineBox& box,
                                        std::int32_t step, int first_tile, std::uint64_t tiles)
    {
        using Reals = Lanes<float, float_lanes>;
        using Integers = Lanes<std::int32_t, float_lanes>;
        constexpr int size = OutlineTiles::size;
        std::int32_t numbers[float_lanes];
        double row_numbers[row_lanes];
        for (int i = 0; i < float_lanes; ++i) numbers[i] = i;
        for (int i = 0; i < row_lanes; ++i) row_numbers[i] = i;
        const Integers lane = load<float_lanes>(numbers);
        const Rows row_lane = load<row_lanes>(row_numbers);
        const Integers steps = broadcast<float_lanes>(step);
        // A steeper plane covers one pixel of a row: nothing depends on the slope.
        const double steepest = double{plane.largest} - double{plane.least};
        const auto slope = static_cast<float>(smaller(larger(plane.across, -steepest), steepest));
        // Keys of a row start from the end where they are smallest, so that float adds up.
        const bool rising = (plane.across > 0) == (plane.largest > 0);

        for_rows(edges, band.width, box, [&](int y, int rows, const Rows& from, const Rows& to) {
            std::int32_t begin[row_lanes], end[row_lanes];
            float start[row_lanes], key[row_lanes];
            const auto first = convert<std::int32_t>(from), last = convert<std::int32_t>(to);
            const Rows origin = convert<double>(rising ? first : last - 1);
            const Rows keys =
                (row_lane + double(y)) * plane.down + plane.start + origin * plane.across;
            store(begin, first);
            store(end, last);
            store(start, convert<float>(origin));
            store(key, convert<float>(
                           Rows{smaller(larger(keys, broadcast<row_lanes>(double{plane.least})),
                                        broadcast<row_lanes>(double{plane.largest}))}));
            std::uint64_t wanted = tiles;
            if ((tiles & (tiles - 1)) != 0) {
                int left = box.right, right = box.left;
                for (int i = 0; i < rows; ++i) {
                    left = smaller(left, begin[i]);
                    right = larger(right, end[i] - 1);
                }
                const int from_tile = larger(left / size - first_tile, 0);
                const int to_tile = smaller(right / size - first_tile, 63);
                if (from_tile > to_tile) return;
                wanted &= ~std::uint64_t{0} << from_tile & ~std::uint64_t{0} >> (63 - to_tile);
            }
            // The rows of one group of columns after those of another: few branches to foretell.
            const std::ptrdiff_t top = (y - band.top) * band.stride;
            for (; wanted != 0; wanted &= wanted - 1) {
                const int group = (first_tile + std::countr_zero(wanted)) * size;
                for (int part = 0; part < size; part += float_lanes) {
                    const std::ptrdiff_t at = top + group + part;
                    const Integers column = lane + (group + part);
                    const Reals place = convert<float>(column);
                    for (int i = 0; i < rows; ++i) {
                        const std::ptrdiff_t row = at + i * band.stride;
                        const Reals value = (place - start[i]) * slope + key[i];
                        const Reals visible = load<float_lanes>(band.keys + row);
                        const Integers old = load<float_lanes>(band.counts + row);
                        const auto inside = (column >= begin[i]) & (column < end[i]);
                        if constexpr (in_front)
                            store(band.counts + row,
                                  Integers{old +
                                           ((inside & (value >= visible)) ? steps : Integers{})});
                        else
                            store(band.counts + row,
                                  Integers{old +
                                           ((inside & (value < visible)) ? steps : Integers{})});
                    }
                }
            }
        });
    }

    std::int64_t area_;
    OutlineVertex corners_[3];
};

}  // namespace nook::inline NOOK_TARGET::detail
