#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/depth/flat_cells.hpp>
#include <nook/depth/left_out.hpp>
#include <nook/depth/moments_table.hpp>
#include <nook/depth/moments_table_ring.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// The tiles of an image whose windows differ, and what is left out of them.
namespace nook::inline NOOK_TARGET::detail {

/// The radius of a window in pixels, per axis.
struct WindowRadius {
    int x, y;
    friend bool operator==(const WindowRadius&, const WindowRadius&) = default;
};

/// How an image is cut into tiles, each with a table of its own over the region that its windows
/// reach.
struct TileGrid {
    int width, height;
    Border border;
    WindowRadius largest;  ///< that any window has
    int tile_width, tile_height;

    TileGrid(int image_width, int image_height, WindowRadius radius, Border at_border)
        : width{image_width},
          height{image_height},
          border{at_border},
          largest{(std::min)(radius.x, image_width), (std::min)(radius.y, image_height)},
          tile_width{tile_size(image_width, largest.x)},
          tile_height{tile_size(image_height, largest.y)}
    {}
    /// Large beside the radius, since the table takes in that much around the tile; all nearly
    /// alike.
    [[nodiscard]] static int tile_size(int size, int radius)
    {
        const int most = (std::max)(256, 4 * radius);
        const int share = pieces(size, (std::max)(1, pieces(size, most)));
        return (std::max)(1, pieces(share, row_padding)) * row_padding;
    }
    [[nodiscard]] int count() const { return across() * pieces(height, tile_height); }
    /// Cells of a tile, which are left out as wholes: as wide as a padded row's steps.
    static constexpr int least_cell = 8;
    [[nodiscard]] std::ptrdiff_t cells() const
    {
        return std::ptrdiff_t{tile_width / row_padding} * pieces(tile_height, least_cell);
    }
    [[nodiscard]] Span columns(int tile) const { return span(tile % across(), tile_width, width); }
    [[nodiscard]] Span rows(int tile) const { return span(tile / across(), tile_height, height); }

    [[nodiscard]] int region_width() const { return (std::min)(width, tile_width + 2 * largest.x); }
    [[nodiscard]] int region_height() const
    {
        return (std::min)(height, tile_height + 2 * largest.y);
    }
    /// Rows that a ring keeps, and entries from one to the next.
    [[nodiscard]] int table_rows() const
    {
        return (std::min)(region_height(), 2 * largest.y + 1) + 1;
    }
    [[nodiscard]] std::ptrdiff_t table_stride() const
    {
        return TableRing::margin + padded(region_width() + 1);
    }

private:
    [[nodiscard]] int across() const { return pieces(width, tile_width); }
    [[nodiscard]] static Span span(int index, int tile, int size)
    {
        const int first = index * tile;
        return {first, first + (std::min)(size - first, tile) - 1};
    }
};

/// One worker's memory.
template <class Distance, class Value>
struct TileMemory {
    /// Results per pixel that there is room for.
    static constexpr int most_results = 4;

    TableRow table, fine;
    Distance* samples;  ///< a row of the region
    Value* results;     ///< of a row of the tile
    double* doubt;      ///< likewise: above 0 where the table does not vouch for the pixel
    LeftOut* cells;
    std::uint8_t* marks;  ///< of a row of cells, or of the groups of a work map that touch the tile

    [[nodiscard]] static TileMemory take(const TileGrid& grid, ScratchLayout& block,
                                         std::size_t workers)
    {
        const auto for_all = [&](std::ptrdiff_t count) {
            return workers * static_cast<std::size_t>(count);
        };
        const std::size_t entries = for_all(grid.table_rows() * grid.table_stride());
        const auto table = [&]() -> TableRow {
            return {block.take<std::uint64_t>(entries), block.take<std::uint64_t>(entries),
                    block.take<std::uint64_t>(entries), block.take<std::uint64_t>(entries)};
        };
        const TableRow first = table(), second = table();
        return {first, second, block.take<Distance>(for_all(padded(grid.region_width()))),
                // As much for float as for double, so that the size does not depend on it.
                reinterpret_cast<Value*>(
                    block.take<double>(for_all(most_results * padded(grid.tile_width)))),
                block.take<double>(for_all(padded(grid.tile_width))),
                block.take<LeftOut>(for_all(grid.cells())),
                block.take<std::uint8_t>(for_all(grid.tile_width))};
    }
    [[nodiscard]] TileMemory of(int worker, const TileGrid& grid) const
    {
        const std::ptrdiff_t entries = worker * grid.table_rows() * grid.table_stride();
        return {table + entries,
                fine + entries,
                samples + worker * padded(grid.region_width()),
                results + worker * most_results * padded(grid.tile_width),
                doubt + worker * padded(grid.tile_width),
                cells + worker * grid.cells(),
                marks + worker * std::ptrdiff_t{grid.tile_width}};
    }
};

/// The cells of a tile: which of them are wanted.
template <class Distance, int lanes, class Source, class Window, class Consume>
class TableCells {
protected:
    using Range = DistanceRange<Distance>;
    using Value = typename Consume::Value;
    using Memory = TileMemory<Distance, Value>;
    static constexpr int chunk = row_padding;
    static constexpr int read_lanes = distance_lanes<lanes, Distance>;

    TableCells(const TileGrid& tiles, const Source& depth, const Window& windows,
               const Consume& consumer, const Memory& scratch, Span tile_columns, Span tile_rows)
        : grid{tiles},
          source{depth},
          window{windows},
          consume{consumer},
          memory{scratch},
          columns{tile_columns},
          rows{tile_rows}
    {}

    const TileGrid& grid;
    const Source& source;
    const Window& window;
    const Consume& consume;
    Memory memory;
    Span columns, rows;
    WindowRadius reach{};
    double samples_at_most = 0;  ///< in a window

    [[nodiscard]] static int width(Span span) { return span.last - span.first + 1; }
    [[nodiscard]] WindowRadius radius(Distance distance) const
    {
        const auto radii = window.radii(static_cast<double>(distance));
        return {static_cast<int>(radii.x), static_cast<int>(radii.y)};
    }

    [[nodiscard]] int cells_across() const { return pieces(width(columns), chunk); }
    [[nodiscard]] int cells_down() const { return pieces(width(rows), cell_rows); }
    [[nodiscard]] LeftOut* cells_of(int row_of_cells) const
    {
        return memory.cells + row_of_cells * std::ptrdiff_t{cells_across()};
    }
    [[nodiscard]] LeftOut* cells_at(int y) const { return cells_of((y - rows.first) / cell_rows); }
    [[nodiscard]] bool is_wanted(int x, int y) const
    {
        return cells_at(y)[(x - columns.first) / chunk] == LeftOut::wanted;
    }
    [[nodiscard]] Span cell_columns(int i) const
    {
        const int first = columns.first + i * chunk;
        return {first, (std::min)(first + chunk - 1, columns.last)};
    }
    [[nodiscard]] Span cell_span(int row_of_cells) const
    {
        const int first = rows.first + row_of_cells * cell_rows;
        return {first, (std::min)(first + cell_rows - 1, rows.last)};
    }
    /// Calls f(x, count, kind) for runs of cells of one kind in row y.
    template <class F>
    void for_runs(int y, const F& f) const
    {
        const LeftOut* const cells = cells_at(y);
        const int count = cells_across();
        for (int i = 0, end = 0; i < count; i = end) {
            for (end = i + 1; end < count && cells[end] == cells[i];) ++end;
            const int x = cell_columns(i).first;
            f(x, cell_columns(end - 1).last - x + 1, cells[i]);
        }
    }
    void set_all(LeftOut kind)
    {
        cell_rows = width(rows);
        std::fill_n(memory.cells, cells_across(), kind);
    }
    /// Leaves out cells that nobody asked for. False when that is all of them.
    bool spare()
    {
        cell_rows = TileGrid::least_cell;
        bool any_wanted = false;
        for (int j = 0; j < cells_down(); ++j) {
            LeftOut* const cells = cells_of(j);
            std::fill_n(cells, cells_across(), LeftOut::wanted);
            if constexpr (can_leave_out<Consume>) {
                const Span at = cell_span(j);
                if (consume.mark_wanted(at.first, at.last, columns.first, columns.last,
                                        memory.marks))
                    for (int i = 0; i < cells_across(); ++i) {
                        const int first = columns.first / group;
                        bool wanted = false;
                        for (int g = cell_columns(i).first / group;
                             g <= cell_columns(i).last / group; ++g)
                            wanted = wanted || memory.marks[g - first] != 0;
                        if (!wanted) cells[i] = LeftOut::spared;
                    }
            }
            for (int i = 0; i < cells_across(); ++i)
                any_wanted = any_wanted || cells[i] == LeftOut::wanted;
        }
        return any_wanted;
    }
    /// Leaves out cells that are proved to be open. `range`: of the tile.
    void find_open(const Range& range)
    {
        if constexpr (can_leave_out<Consume>) {
            using Flat = FlatCells<Source, read_lanes>;
            if (range.greatest > range.least * 16) return;
            // All samples that a flat cell sees lie within a factor 2 of those in the tile.
            constexpr Distance most = (std::numeric_limits<Distance>::max)() / 4;
            const FixedPoint widest_range = fixed_point(
                range.least / 4, smaller(range.greatest, most) * 4, samples_at_most, false);
            if (widest_range.exact_from > 0) return;
            if (reach == WindowRadius{0, 0}) {
                // Open whatever they hold, which is still to be counted.
                for (int j = 0; j < cells_down(); ++j)
                    std::fill_n(cells_of(j), cells_across(), LeftOut::spared);
                return;
            }
            if constexpr (Flat::possible) {
                if (source.image.pixel_stride != 1) return;
                // All rows at once, then some, which see less around them. The first rows at the frame
                // have windows too flat to tell.
                const int first = rows.first == 0 ? 1 : 0;
                const int end = cells_down() - (rows.last == grid.height - 1 ? 1 : 0);
                const WindowRadius least = radius(range.greatest);
                if (first >= end || find_open_in(first, end, least)) return;
                for (int j = first; j < end; j += rows_of_proof)
                    static_cast<void>(find_open_in(j, (std::min)(j + rows_of_proof, end), least));
            }
        }
    }
    /// Looks at rows [first, end) of cells, column by column. True when all are settled.
    bool find_open_in(int first, int end, WindowRadius least)
    {
        if constexpr (FlatCells<Source, read_lanes>::possible) {
            const int count = cells_across();
            const auto is_wanted_column = [&](int i) {
                for (int j = first; j < end; ++j)
                    if (cells_of(j)[i] == LeftOut::wanted) return true;
                return false;
            };
            for (int i = 0; i < count; ++i) memory.marks[i] = is_wanted_column(i);
            const FlatCells<Source, read_lanes> flat{
                source,
                {cell_span(first).first, cell_span(end - 1).last},
                {least.x, least.y, reach.x, reach.y},
                grid.border,
                !consume.open_in_front(),
                memory.samples};
            static_cast<void>(
                flat.find([&](int i) { return cell_columns(i); }, count, 1, memory.marks));
            bool settled = true;
            for (int i = 0; i < count; ++i) {
                if (memory.marks[i] != 0)
                    for (int j = first; j < end; ++j)
                        if (cells_of(j)[i] == LeftOut::wanted) cells_of(j)[i] = LeftOut::open;
                settled = settled && !is_wanted_column(i);
            }
            return settled;
        }
        return true;
    }
    [[nodiscard]] bool is_busy(int y) const
    {
        const LeftOut* const cells = cells_at(y);
        for (int i = 0; i < cells_across(); ++i)
            if (cells[i] == LeftOut::wanted) return true;
        return false;
    }
    [[nodiscard]] bool any_busy() const
    {
        for (int j = 0; j < cells_down(); ++j)
            if (is_busy(cell_span(j).first)) return true;
        return false;
    }

private:
    static constexpr int group = WorkMap::group;
    static constexpr int rows_of_proof = 4;  ///< rows of cells that are looked at together

    int cell_rows = 1;  ///< in a cell
};

}  // namespace nook::inline NOOK_TARGET::detail
