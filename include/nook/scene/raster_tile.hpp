#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/coverage.hpp>
#include <nook/scene/raster_batch.hpp>
#include <nook/scene/raster_bins.hpp>
#include <nook/scene/raster_blocks.hpp>
#include <nook/scene/raster_surface.hpp>
#include <nook/scene/raster_vertex.hpp>

/// A tile of the picture on its way: distances and triangles of its samples.
namespace nook::inline NOOK_TARGET::detail {

/// Memory of a tile of at most `size` samples. Distances are the bits of positive floats, which
/// compare as integers do; those of infinity stand for no surface.
struct RasterTileMemory {
    /// Room after each row for a whole vector from any sample on.
    static constexpr int padding = 8;
    static constexpr std::int32_t nothing = 0x7f800000;

    RasterSize size;
    std::int32_t* distances;
    /// Null when only distances are wanted.
    std::uint32_t* ids;
    /// Slopes of the columns and rows.
    double* across;
    double* down;

    [[nodiscard]] static constexpr std::size_t samples(RasterSize size)
    {
        return static_cast<std::size_t>(size.across + padding) *
               static_cast<std::size_t>(size.down);
    }
};

/// Draws triangles into a tile.
template <bool orthographic, bool with_ids>
class RasterTile {
public:
    /// The samples of `box`, 2^level to a pixel, both counted from those of the picture.
    RasterTile(const RasterView& view, const RasterVertex* vertices, const RasterTileMemory& memory,
               const RasterBox& box, RasterSides sides, int level)
        : view_{view},
          vertices_{vertices},
          memory_{memory},
          box_{box},
          sides_{sides},
          bits_{view.grid().bits() - level},
          stride_{memory.size.across + RasterTileMemory::padding},
          far_limit_{raster_far_limit(view.projection())},
          blocks_{memory.distances, stride_, box.right - box.left + 1, box.bottom - box.top + 1,
                  RasterTileMemory::nothing}
    {
        const RasterSlopes slopes{view.projection()};
        const double sample = 1.0 / (1 << level);
        const int width = box.right - box.left + 1, height = box.bottom - box.top + 1;
        for (int x = 0; x < width + RasterTileMemory::padding; ++x)
            memory.across[x] = slopes.across(box.left + x, sample);
        for (int y = 0; y < height; ++y) memory.down[y] = slopes.down(box.top + y, sample);
        const auto nothing = broadcast<lanes>(RasterTileMemory::nothing);
        const auto nobody = broadcast<lanes>(~std::uint32_t{0});
        const int room = width + RasterTileMemory::padding;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < room; x += lanes) {
                const std::ptrdiff_t at = y * stride_ + smaller(x, room - lanes);
                store(memory.distances + at, nothing);
                if constexpr (with_ids) store(memory.ids + at, nobody);
            }
    }
    /// How many samples of a row hold a surface.
    [[nodiscard]] int covered(int y) const
    {
        const int width = box_.right - box_.left + 1;
        const std::int32_t* const row = distances(y);
        Integers found{};
        int x = 0;
        for (; x + lanes <= width; x += lanes)
            found += load<lanes>(row + x) != RasterTileMemory::nothing
                         ? broadcast<lanes>(std::int32_t{1})
                         : Integers{};
        int count = fold(found, [](const auto& a, const auto& b) { return a + b; });
        for (; x < width; ++x) count += row[x] != RasterTileMemory::nothing ? 1 : 0;
        return count;
    }
    [[nodiscard]] const RasterBox& box() const { return box_; }
    [[nodiscard]] const std::int32_t* distances(int y) const
    {
        return memory_.distances + y * stride_;
    }
    [[nodiscard]] const std::uint32_t* ids(int y) const { return memory_.ids + y * stride_; }
    /// Slopes of the columns, and of a row.
    [[nodiscard]] const double* across() const { return memory_.across; }
    [[nodiscard]] double down(int y) const { return memory_.down[y]; }

    /// Draws triangles, in order of their indices. Back faces may hide what is behind them and have no
    /// name.
    void draw(std::uint32_t t)
    {
        coming_[coming_count_++] = t;
        if (coming_count_ == lanes) draw_coming();
    }
    /// Draws what is left.
    void finish()
    {
        draw_coming();
        draw_batch();
        draw_queue();
    }

private:
    static constexpr int lanes = native_lanes;
    /// Boxes up to this size are looked at whole.
    static constexpr int little = 16;
    /// The blocks are asked first whether boxes of so many samples are hidden: it pays from here on.
    static constexpr int asked_first = 64;
    using Reals = Lanes<double, lanes>;
    using Floats = Lanes<float, lanes>;
    using Integers = Lanes<std::int32_t, lanes>;
    using Names = Lanes<std::uint32_t, lanes>;

    /// Triangles that wait for their surfaces, in order.
    struct Queue {
        int count = 0;
        std::uint32_t triangles[lanes], names[lanes];
        RasterBox boxes[lanes];
        double nearest[lanes], farthest[lanes];
        double value[lanes][3], across[lanes][3], down[lanes][3];
        /// Positive where a little triangle covers a sample of its box, rows of `little`.
        float sides[lanes][little * little];
    };

    /// Asks for the vertices of the triangles to come, and draws those before them meanwhile.
    void draw_coming()
    {
        const std::uint32_t* const indices = view_.mesh().indices;
        for (int i = 0; i < coming_count_; ++i)
            for (std::size_t k = 0; k < 3; ++k)
                prefetch(vertices_ + indices[3 * std::size_t{coming_[i]} + k]);
        draw_batch();
        for (int i = 0; i < coming_count_; ++i) batch_.triangles[i] = coming_[i];
        batch_.count = coming_count_;
        coming_count_ = 0;
    }
    void draw_batch()
    {
        if (batch_.count == 0) return;
        batch_.find(view_.mesh(), vertices_, box_, bits_);
        for (int lane = 0; lane < batch_.count; ++lane) {
            const std::int32_t state = batch_.state[lane];
            if ((state & RasterBatch::special) != 0) draw_special(batch_.triangles[lane]);
            if ((state & RasterBatch::live) == 0) continue;
            const bool clockwise = (state & RasterBatch::clockwise) != 0;
            if (!(clockwise ? sides_.clockwise : sides_.counter_clockwise)) continue;
            add(lane, name(batch_.triangles[lane], clockwise));
        }
        batch_.count = 0;
    }
    [[nodiscard]] std::uint32_t name(std::uint32_t t, bool clockwise) const
    {
        return clockwise != view_.mirrored() && sides_.nameless ? 0xffffffff : t;
    }

    /// Puts a triangle of the batch into the queue, unless it covers nothing or is hidden.
    NOOK_INLINE void add(int lane, std::uint32_t name)
    {
        const RasterBox box{batch_.left[lane], batch_.right[lane], batch_.top[lane],
                            batch_.bottom[lane]};
        const int at = queue_.count;
        const bool whole = box.right - box.left < little && box.bottom - box.top < little;
        if ((box.right - box.left + 1) * (box.bottom - box.top + 1) >= asked_first &&
            blocks_.hidden({box.left - box_.left, box.right - box_.left, box.top - box_.top,
                            box.bottom - box_.top},
                           std::bit_cast<std::int32_t>(batch_.nearest[lane])))
            return;
        if (whole && !find_sides(lane, box, queue_.sides[at])) return;
        queue_.triangles[at] = batch_.triangles[lane];
        queue_.names[at] = name;
        queue_.boxes[at] = box;
        queue_.nearest[at] = double{batch_.nearest[lane]};
        queue_.farthest[at] = double{batch_.farthest[lane]};
        if (!whole)
            for (int i = 0; i < 3; ++i) {
                queue_.value[at][i] = batch_.value[i][lane];
                queue_.across[at][i] = batch_.across[i][lane];
                queue_.down[at][i] = batch_.down[i][lane];
            }
        if (++queue_.count == lanes) draw_queue();
    }
    [[nodiscard]] NOOK_INLINE bool find_sides(int lane, const RasterBox& box, float* sides) const
    {
        const int rows = box.bottom - box.top + 1;
        const auto nearest = std::bit_cast<std::int32_t>(batch_.nearest[lane]);
        bool found = false;
        // Edge by edge, not in loops: they stay in registers.
        const auto start = [&](int i, const Reals& column) NOOK_INLINE_LAMBDA {
            return Reals{column * batch_.across[i][lane] + batch_.value[i][lane]};
        };
        const double down_0 = batch_.down[0][lane], down_1 = batch_.down[1][lane],
                     down_2 = batch_.down[2][lane];
        for (int part = box.left; part <= box.right; part += lanes) {
            const Reals column = numbers_ + double(part - box.left);
            Reals value_0 = start(0, column), value_1 = start(1, column),
                  value_2 = start(2, column);
            Integers hidden = broadcast<lanes>(std::int32_t{-1});
            std::ptrdiff_t at = (box.top - box_.top) * stride_ + part - box_.left;
            float* to = sides + (part - box.left);
            for (int y = 0; y < rows; ++y, at += stride_, to += little) {
                const Floats side =
                    convert<float>(Reals{smaller(value_0, Reals{smaller(value_1, value_2)})});
                store(to, side);
                // The sign of the difference: covered, and in front of what is there.
                const Integers there = load<lanes>(memory_.distances + at);
                hidden &= std::bit_cast<Integers>(side) | (there - nearest - 1);
                value_0 += down_0;
                value_1 += down_1;
                value_2 += down_2;
            }
            found = any(~hidden < 0) || found;
        }
        return found;
    }

    void draw_queue()
    {
        const int count = queue_.count;
        queue_.count = 0;
        if (count == 0) return;
        surfaces_.find(view_, vertices_, queue_.triangles, count, queue_.nearest, queue_.farthest);
        for (int entry = 0; entry < count; ++entry) {
            if (!surfaces_.usable[entry]) continue;
            const RasterSurface surface =
                surfaces_.at(entry, queue_.nearest[entry], queue_.farthest[entry]);
            const RasterBox& box = queue_.boxes[entry];
            const std::uint32_t id = queue_.names[entry];
            if (box.right - box.left < little && box.bottom - box.top < little)
                draw_little(surface, box, queue_.sides[entry], id);
            else draw_large(surface, box, entry, id);
        }
    }

    /// Keeps what is nearer, where `side` is positive.
    NOOK_INLINE void keep(const RasterSurface& surface, std::ptrdiff_t at, int x, double row,
                          Floats side, std::uint32_t id)
    {
        const Reals distance =
            surface.template distance<orthographic>(load<lanes>(memory_.across + x), row);
        if (surface.cut)
            side =
                smaller(side, convert<float>(Reals{distance > far_limit_ ? broadcast<lanes>(-1.0)
                                                                         : broadcast<lanes>(1.0)}));
        const auto sign = std::bit_cast<Integers>(side) >> 31;
        const Integers bits =
            std::bit_cast<Integers>(convert<float>(distance)) | (sign & 0x7fffffff);
        const Integers there = load<lanes>(memory_.distances + at);
        store(memory_.distances + at, Integers{bits < there ? bits : there});
        if constexpr (with_ids) {
            const Names old = load<lanes>(memory_.ids + at);
            store(memory_.ids + at, Names{bits < there ? broadcast<lanes>(id) : old});
        }
    }

    NOOK_INLINE void draw_little(const RasterSurface& surface, const RasterBox& box,
                                 const float* sides, std::uint32_t id)
    {
        const int left = box.left - box_.left, width = box.right - box.left + 1;
        std::ptrdiff_t at = (box.top - box_.top) * stride_ + left;
        for (int y = box.top - box_.top; y <= box.bottom - box_.top;
             ++y, at += stride_, sides += little) {
            const double row = surface.row(memory_.down[y]);
            for (int part = 0; part < width; part += lanes)
                keep(surface, at + part, left + part, row, load<lanes>(sides + part), id);
        }
    }

    /// Several rows at once: the covered samples of each are those between two bounds.
    void draw_large(const RasterSurface& surface, const RasterBox& box, int entry, std::uint32_t id)
    {
        double scale[3], left[3], right[3];
        for (int i = 0; i < 3; ++i) {
            // Along a horizontal edge the bound is far on one side or the other.
            const double across = queue_.across[entry][i];
            scale[i] = across != 0 ? -1 / across : 0x1p60;
            left[i] = across > 0 ? 0x1p100 : -0x1p100;
            right[i] = across > 0 ? 0x1p100 : -0x1p100;
        }
        const int width = box.right - box.left + 1;
        const auto nearest = std::bit_cast<std::int32_t>(static_cast<float>(queue_.nearest[entry]));
        for (int y = box.top; y <= box.bottom; y += lanes) {
            Reals from{}, to = broadcast<lanes>(double(width));
            for (int i = 0; i < 3; ++i) {
                // Exact: below 2⁵², in halves. Its quotient is at least half a unit of the divisor
                // from an integer, more than rounding takes.
                const Reals value =
                    rounded(Reals{(numbers_ + double(y - box.top)) * queue_.down[entry][i] +
                                  queue_.value[entry][i]});
                const Reals bound = value * scale[i] + 1.0;
                from = larger(from, Reals{smaller(bound, broadcast<lanes>(left[i]))});
                to = smaller(to, Reals{larger(bound, broadcast<lanes>(right[i]))});
            }
            std::int32_t begin[lanes], end[lanes];
            store(begin,
                  convert<std::int32_t>(Reals{smaller(from, broadcast<lanes>(double(width)))}));
            store(end, convert<std::int32_t>(Reals{larger(to, Reals{})}));
            const int rows = smaller(lanes, box.bottom - y + 1);
            for (int i = 0; i < rows; ++i) {
                if (begin[i] >= end[i]) continue;
                draw_row(surface, y + i, box.left + begin[i], box.left + end[i] - 1, nearest, id);
            }
        }
    }
    NOOK_INLINE void draw_row(const RasterSurface& surface, int y, int first, int last,
                              std::int32_t nearest, std::uint32_t id)
    {
        const int top = y - box_.top, right = last - box_.left;
        const double row = surface.row(memory_.down[top]);
        for (int x = first - box_.left; x <= right; x += lanes) {
            const std::ptrdiff_t at = top * stride_ + x;
            if (!any(load<lanes>(memory_.distances + at) > nearest)) continue;
            keep(surface, at, x, row, convert<float>(Reals{(right - x + 0.5) - numbers_}), id);
        }
    }

    /// A triangle that is clipped, or too large for the edge functions.
    NOOK_NOINLINE void draw_special(std::uint32_t t)
    {
        draw_queue();
        const std::uint32_t* const index = view_.mesh().indices + 3 * std::size_t{t};
        const RasterVertex &a = vertices_[index[0]], &b = vertices_[index[1]],
                           &c = vertices_[index[2]];
        if ((a.outside & b.outside & c.outside) != 0) return;
        ClippedPolygon polygon{{{a.x, a.y}, {b.x, b.y}, {c.x, c.y}}, 3};
        if ((a.outside | b.outside | c.outside) != 0) polygon = view_.clipped(t, vertices_);
        RasterSurface surface{};
        if (polygon.count == 0 || !find_surface(view_, t, a, b, c, surface)) return;
        for (int i = 2; i < polygon.count; ++i) {
            const GridPoint corners[3] = {polygon.corners[0], polygon.corners[i - 1],
                                          polygon.corners[i]};
            const std::int64_t area = twice_area(corners[0], corners[1], corners[2]);
            const bool clockwise = area > 0;
            if (area == 0 || !(clockwise ? sides_.clockwise : sides_.counter_clockwise)) continue;
            const std::uint32_t id = name(t, clockwise);
            TriangleCoverage{bits_, corners[0], corners[1], corners[2]}.for_each_row(
                box_.right + 1, box_.top, box_.bottom, [&](int y, int first, int last) {
                    if (last < box_.left) return;
                    draw_row(surface, y, larger(first, box_.left), last, 0, id);
                });
        }
    }

    [[nodiscard]] static Reals numbers()
    {
        double values[lanes];
        for (int i = 0; i < lanes; ++i) values[i] = i;
        return load<lanes>(values);
    }

    const RasterView& view_;
    const RasterVertex* vertices_;
    RasterTileMemory memory_;
    RasterBox box_;
    RasterSides sides_;
    int bits_;
    std::ptrdiff_t stride_;
    double far_limit_;
    RasterBlocks<lanes> blocks_;
    Reals numbers_ = numbers();
    std::uint32_t coming_[lanes];
    int coming_count_ = 0;
    RasterBatch batch_;
    Queue queue_;
    RasterSurfaces surfaces_;
};

}  // namespace nook::inline NOOK_TARGET::detail
