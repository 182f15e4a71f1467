#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/depth/left_out.hpp>
#include <nook/depth/moments_direct.hpp>
#include <nook/depth/moments_table.hpp>
#include <nook/depth/moments_table_cells.hpp>
#include <nook/depth/moments_table_ring.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Works on one tile: goes down its rows with a ring of table rows, and with a second one where the
/// first cannot vouch for many pixels.
template <class Distance, int lanes, class Source, class Window, class Consume>
class TableTile : TableCells<Distance, lanes, Source, Window, Consume> {
    using Cells = TableCells<Distance, lanes, Source, Window, Consume>;
    using Cells::any_busy, Cells::cells_at, Cells::chunk, Cells::columns, Cells::consume,
        Cells::find_open, Cells::for_runs, Cells::grid, Cells::is_busy, Cells::is_wanted,
        Cells::memory, Cells::radius, Cells::reach, Cells::read_lanes, Cells::rows,
        Cells::samples_at_most, Cells::set_all, Cells::source, Cells::spare, Cells::width,
        Cells::window;
    using Real = Lanes<double, lanes>;
    using Range = DistanceRange<Distance>;
    using Value = typename Consume::Value;
    static constexpr int ahead = 4;  ///< rows that are asked for before they are read

public:
    TableTile(const TileGrid& tiles, const Source& depth, const Window& windows,
              const Consume& consumer, Work& counts, const TileMemory<Distance, Value>& scratch,
              Span tile_columns, Span tile_rows)
        : Cells{tiles, depth, windows, consumer, scratch, tile_columns, tile_rows},
          work{counts}
    {}

    void run();

private:
    Work& work;
    Span across{}, down{};  ///< the region that the windows reach
    TableRing table{{}, 0, 0, 0, 0, {}}, fine{{}, 0, 0, 0, 0, {}};
    bool refined = false;        ///< `fine` is kept
    std::uint64_t patience = 0;  ///< samples to read directly before `fine` is made anew

    [[nodiscard]] std::ptrdiff_t stride() const { return padded(grid.tile_width); }
    [[nodiscard]] std::uint64_t rebuild_cost() const
    {
        return static_cast<std::uint64_t>(fine.rows) * static_cast<std::uint64_t>(width(across));
    }

    /// The rows of the table that the windows of row y need. Where no sample was rounded the sums are
    /// exact whatever rows they begin with; a second table follows the first row by row.
    [[nodiscard]] Span rows_needed(int y) const
    {
        if (table.fixed.exact_from > 0) return {down.first, (std::min)(y + reach.y, down.last)};
        return window_span(y, reach.y, grid.height, grid.border);
    }
    void leave_out_all()
    {
        for (int y = rows.first; y <= rows.last; ++y) {
            if (cells_at(y)[0] == LeftOut::spared)
                prefetch_row(source, columns.first, width(columns),
                             (std::min)(y + ahead, rows.last));
            deliver(y, true);
        }
    }

    /// True when there is background.
    bool read(Span at, int y) { return read_padded<lanes>(source, at, y, memory.samples); }
    [[nodiscard]] Range read_range(Span at, int y)
    {
        const bool background = read(at, y);
        Range range = range_of<lanes>(memory.samples, width(at));
        range.background = background;
        return range;
    }
    void deliver(int y, bool background)
    {
        for_runs(y, [&](int x, int count, LeftOut cell) {
            if constexpr (can_leave_out<Consume>) {
                if (cell != LeftOut::wanted) {
                    consume.template leave_out<read_lanes>(work, source, y, x, count, cell);
                    return;
                }
            }
            const int at = x - columns.first;
            consume.row(work, y, x, count, static_cast<const Value*>(memory.results + at), stride(),
                        background ? static_cast<const Distance*>(memory.samples + at) : nullptr);
        });
    }

    template <bool masked, bool wide>
    void run_rows()
    {
        table.start(rows_needed(rows.first).first);
        for (int y = rows.first; y <= rows.last; ++y) {
            if (!is_busy(y)) {
                deliver(y, true);
                continue;
            }
            const Span needed = rows_needed(y);
            if (needed.first > table.newest + 1) table.start(needed.first);
            while (table.newest < needed.last) {
                read(across, table.newest + 1);
                table.template add<lanes, masked, wide>(memory.samples, width(across));
                if (wide && refined) add_fine();
            }
            const bool background = read(columns, y);
            Real doubt{};
            for (int x = columns.first; x <= columns.last; x += chunk)
                if (is_wanted(x, y)) look_up<masked, wide>(x, y, doubt);
                else std::fill_n(memory.doubt + (x - columns.first), chunk, 0.0);
            if constexpr (wide)
                if (fold(doubt, [](const auto& a, const auto& b) { return a + b; }) > 0.0)
                    resolve(y);
            deliver(y, background);
        }
    }

    /// The results of a chunk of row y from column x on.
    template <bool masked, bool wide>
    void look_up(int x, int y, Real& doubt)
    {
        const int at = x - columns.first;
        const int count = (std::min)(chunk, columns.last - x + 1);
        const Range range = range_of<lanes>(memory.samples + at, count);
        if (!(range.greatest > 0)) {
            std::fill_n(memory.doubt + at, chunk, 0.0);
            return;
        }
        const WindowRadius nearest = radius(range.least);
        const bool alike = nearest == radius(range.greatest);
        for (int i = 0; i < count; i += lanes) {
            if (!consume.wanted(x + i, y)) {
                store(memory.doubt + (at + i), Real{});
            } else if (alike) {
                look_up_alike<masked, wide>(x + i, y, nearest, doubt);
            } else {
                look_up_mixed<masked, wide>(x + i, y, doubt);
            }
        }
    }

    /// How the windows of neighbours with one radius lie across.
    struct Row {
        Corners left, right;
        bool regular;
    };
    [[nodiscard]] NOOK_INLINE Row corners(int x, int r) const
    {
        const int end = grid.width, last = x + lanes - 1;
        const std::ptrdiff_t at = x - across.first;
        if (x - r >= 0 && last + r < end) return {{at - r - 1, 1}, {at + r, 1}, true};
        // At the frame the region begins, or ends, with the image.
        const int begin = end - 1 - across.first;
        if (last >= end || lanes == 1) return {{}, {}, false};
        if (grid.border == Border::symmetric) {
            if (last <= r && 2 * last < end) return {{-1, 0}, {2 * x, 2}, true};
            if (end - 1 - x <= r && 2 * x >= end - 1)
                return {{2 * x - end - across.first, 2}, {begin, 0}, true};
        } else {
            if (last - r <= 0 && last + r < end) return {{-1, 0}, {at + r, 1}, true};
            if (x + r >= end - 1 && x - r >= 0) return {{at - r - 1, 1}, {begin, 0}, true};
        }
        return {{}, {}, false};
    }

    [[nodiscard]] static Real areas_of(const Row& broad, int height)
    {
        double area[lanes];
        for (int i = 0; i < lanes; ++i)
            area[i] = static_cast<double>(height) *
                      static_cast<double>(broad.right.first + broad.right.stride * i -
                                          broad.left.first - broad.left.stride * i);
        return load<lanes>(area);
    }

    template <bool masked, bool wide>
    NOOK_INLINE void look_up_alike(int x, int y, WindowRadius r, Real& doubt)
    {
        const Row broad = corners(x, r.x);
        if (!broad.regular) {
            double wide_as[lanes], tall_as[lanes];
            std::fill_n(wide_as, lanes, double(r.x));
            std::fill_n(tall_as, lanes, double(r.y));
            look_up_each<masked, wide>(x, y, wide_as, tall_as, doubt);
            return;
        }
        const Span tall = window_span(y, r.y, grid.height, grid.border);
        const TableRow top = table.row(tall.first - 1), bottom = table.row(tall.last);
        if (broad.left.stride == 1 && broad.right.stride == 1) {
            const double area = double(2 * r.x + 1) * double(width(tall));
            finish<masked, wide>(x,
                                 window_sums<lanes, masked, wide>(
                                     top, bottom, {broad.left.first, 1}, {broad.right.first, 1}),
                                 Real{} + area, Real{} + 1 / area, doubt);
        } else {
            look_up_at_frame<masked, wide>(x, top, bottom, broad, width(tall), doubt);
        }
    }
    template <bool masked, bool wide>
    NOOK_NOINLINE void look_up_at_frame(int x, const TableRow& top, const TableRow& bottom,
                                        const Row& broad, int height, Real& doubt)
    {
        const Real areas = areas_of(broad, height);
        finish<masked, wide>(x,
                             window_sums<lanes, masked, wide>(top, bottom, broad.left, broad.right),
                             areas, 1.0 / areas, doubt);
    }

    /// Neighbours whose radii may differ: the windows of all for each radius among them, up to
    /// three, of which each takes its range.
    template <bool masked, bool wide>
    NOOK_NOINLINE void look_up_mixed(int x, int y, Real& doubt)
    {
        const int at = x - columns.first;
        int first = 0;
        while (first < lanes && !(memory.samples[at + first] > 0)) ++first;
        if (first == lanes) {
            store(memory.doubt + at, Real{});
            return;
        }
        const auto distance = convert<double>(load<lanes>(memory.samples + at));
        // Background takes any radius.
        const auto radii = window.radii(distance > 0.0 ? distance : distance + 1.0);
        // Both radii in one number; 0 is left to background and to those that have theirs.
        constexpr double column = 65536;
        Real pending = distance > 0.0 ? radii.x * column + (radii.y + 1.0) : Real{};
        TableSums<lanes> sums{};
        Real areas = Real{} + 1.0;
        for (int turn = 0;; ++turn) {
            const double key = greatest_lane(pending);
            if (!(key > 0)) break;
            const int r_x = static_cast<int>(key / column);
            const WindowRadius r{r_x, static_cast<int>(key - r_x * column) - 1};
            const auto own = pending == key;
            pending = own ? Real{} : pending;
            if (turn == 0 && !(greatest_lane(pending) > 0)) {
                look_up_alike<masked, wide>(x, y, r, doubt);
                return;
            }
            const Row broad = corners(x, r.x);
            if (turn == 3 || !broad.regular) {
                double wide_as[lanes], tall_as[lanes];
                store(wide_as, radii.x);
                store(tall_as, radii.y);
                look_up_each<masked, wide>(x, y, wide_as, tall_as, doubt);
                return;
            }
            const Span tall = window_span(y, r.y, grid.height, grid.border);
            const auto other = window_sums<lanes, masked, wide>(
                table.row(tall.first - 1), table.row(tall.last), broad.left, broad.right);
            sums.sum = own ? other.sum : sums.sum;
            sums.squares = own ? other.squares : sums.squares;
            if constexpr (wide) sums.marks = own ? other.marks : sums.marks;
            if constexpr (masked) sums.background = own ? other.background : sums.background;
            areas = own ? areas_of(broad, width(tall)) : areas;
        }
        finish<masked, wide>(x, sums, areas, 1.0 / areas, doubt);
    }
    template <bool masked, bool wide>
    NOOK_NOINLINE void look_up_each(int x, int y, const double* wide_as, const double* tall_as,
                                    Real& doubt)
    {
        std::uint64_t sum[lanes], squares[lanes], marks[lanes], background[lanes];
        double area[lanes];
        for (int i = 0; i < lanes; ++i) {
            const int lane = (std::min)(i, columns.last - x), column = x + lane;
            const bool surface = memory.samples[column - columns.first] > 0;
            const Span broad =
                window_span(column, surface ? int(wide_as[lane]) : 0, grid.width, grid.border);
            const Span tall =
                window_span(y, surface ? int(tall_as[lane]) : 0, grid.height, grid.border);
            const auto sums = sums_of<masked, wide>(table, broad, tall);
            sum[i] = sums.sum;
            squares[i] = sums.squares;
            marks[i] = sums.marks;
            background[i] = sums.background;
            area[i] = double(samples_in(broad, tall));
        }
        const Real areas = load<lanes>(area);
        finish<masked, wide>(
            x,
            {load<lanes>(sum), load<lanes>(squares), load<lanes>(marks), load<lanes>(background)},
            areas, 1.0 / areas, doubt);
    }
    template <bool masked, bool wide>
    [[nodiscard]] TableSums<1> sums_of(const TableRing& ring, Span broad, Span tall) const
    {
        return window_sums<1, masked, wide>(ring.row(tall.first - 1), ring.row(tall.last),
                                            {broad.first - 1 - across.first, 1},
                                            {broad.last - across.first, 1});
    }

    template <bool masked, bool wide>
    NOOK_INLINE void finish(int x, const TableSums<lanes>& sums, const Real& area,
                            const Real& per_area, Real& doubt)
    {
        const int at = x - columns.first;
        const auto distance = convert<double>(load<lanes>(memory.samples + at));
        const auto moments =
            table_moments<lanes, masked, wide>(table.fixed, sums, distance, area, per_area,
                                               [&](const Real& d) { return window.slack(d); });
        Real open{};
        if constexpr (masked) open = moments.background * per_area;
        Real shaded[Consume::results];
        consume.shade(distance, moments.count, open, moments.variance, moments.deviation, shaded);
        for (int k = 0; k < Consume::results; ++k)
            store(memory.results + (k * stride() + at), convert<Value>(shaded[k]));
        if constexpr (wide) {
            Real doubtful = moments.doubt;
            if constexpr (masked) doubtful = distance > 0.0 ? doubtful : Real{};
            store(memory.doubt + at, doubtful);
            doubt += doubtful;
        }
    }

    /// The pixels of row y that the table cannot vouch for: from a finer table of the distances
    /// near theirs, if it pays to make one; else directly.
    void resolve(int y)
    {
        if (doubtful_samples(y) > patience) refine(y);
        for (int x = columns.first; x <= columns.last; ++x) {
            const int at = x - columns.first;
            if (!(memory.doubt[at] > 0.0) || !consume.wanted(x, y)) continue;
            const Window1 w = window_of(x, y);
            WindowMoments<double> moments;
            if (!look_up_fine(w, moments)) {
                moments = direct_moments<double>(source, w.distance, w.broad, w.tall);
                const auto count = static_cast<std::uint64_t>(samples_in(w.broad, w.tall));
                work.samples += count;
                patience -= (std::min)(patience, count);
            }
            const double count = moments.count, background = moments.background;
            double shaded[Consume::results];
            consume.shade(static_cast<double>(w.distance), count, background / (count + background),
                          moments.variance, moments.deviation, shaded);
            for (int k = 0; k < Consume::results; ++k)
                memory.results[k * stride() + at] = static_cast<Value>(shaded[k]);
        }
    }
    struct Window1 {
        Distance distance;
        Span broad, tall;
    };
    [[nodiscard]] Window1 window_of(int x, int y) const
    {
        const Distance distance = memory.samples[x - columns.first];
        const WindowRadius r = radius(distance);
        return {distance, window_span(x, r.x, grid.width, grid.border),
                window_span(y, r.y, grid.height, grid.border)};
    }
    /// What reading the doubtful windows of row y directly would cost.
    [[nodiscard]] std::uint64_t doubtful_samples(int y) const
    {
        std::uint64_t result = 0;
        for (int x = columns.first; x <= columns.last; ++x) {
            if (!(memory.doubt[x - columns.first] > 0.0) || !consume.wanted(x, y)) continue;
            const Window1 w = window_of(x, y);
            WindowMoments<double> moments;
            if (!look_up_fine(w, moments))
                result += static_cast<std::uint64_t>(samples_in(w.broad, w.tall));
        }
        return result;
    }
    [[nodiscard]] bool look_up_fine(const Window1& w, WindowMoments<double>& result) const
    {
        if (!refined) return false;
        const auto sums = sums_of<true, true>(fine, w.broad, w.tall);
        const double area = samples_in(w.broad, w.tall);
        const auto moments =
            table_moments<1, true, true>(fine.fixed, sums, static_cast<double>(w.distance), area,
                                         1 / area, [](double) { return 0.0; });
        result = {static_cast<std::int32_t>(moments.count),
                  static_cast<std::int32_t>(moments.background), moments.variance,
                  moments.deviation};
        return !(moments.doubt > 0);
    }
    void add_fine() { fine.template add<lanes, true, true>(memory.samples, width(across)); }
    /// Makes the finer table for the doubtful pixels of row y.
    void refine(int y)
    {
        Range range{};
        for (int x = columns.first; x <= columns.last; ++x)
            if (memory.doubt[x - columns.first] > 0.0 && consume.wanted(x, y)) {
                const Distance distance = memory.samples[x - columns.first];
                range.add({distance, distance});
            }
        // Floats from one eighth of a distance to 15 times that distance are exact in 31 bits.
        constexpr Distance largest = (std::numeric_limits<Distance>::max)() / 16;
        const Distance least = range.least / 8;
        const Distance greatest = larger(range.greatest * 2, range.least * 15);
        fine.fixed =
            fixed_point(least > 0 ? least : range.least,
                        range.greatest < largest ? greatest : largest * 16, samples_at_most, true);
        refined = true;
        patience = rebuild_cost();
        fine.start((std::max)(down.first, y - reach.y));
        while (fine.newest < table.newest) {
            read(across, fine.newest + 1);
            add_fine();
        }
        read(columns, y);
    }
};

template <class Distance, int lanes, class Source, class Window, class Consume>
void TableTile<Distance, lanes, Source, Window, Consume>::run()
{
    if (!spare()) {
        leave_out_all();
        return;
    }
    Range range{};
    for (int y = rows.first; y <= rows.last; ++y) {
        prefetch_row(source, columns.first, width(columns), (std::min)(y + ahead, rows.last));
        range.add(read_range(columns, y));
    }
    if (!(range.greatest > 0)) {
        if constexpr (can_leave_out<Consume>) set_all(LeftOut::empty);
        else std::fill_n(memory.samples, width(columns), Distance{0});
        leave_out_all();
        return;
    }
    const WindowRadius widest = radius(range.least);
    reach = {(std::min)(widest.x, grid.largest.x), (std::min)(widest.y, grid.largest.y)};
    across = {(std::max)(0, columns.first - reach.x),
              (std::min)(grid.width - 1, columns.last + reach.x)};
    down = {(std::max)(0, rows.first - reach.y), (std::min)(grid.height - 1, rows.last + reach.y)};
    samples_at_most = (std::min)(2.0 * reach.x + 1, double(grid.width)) *
                      (std::min)(2.0 * reach.y + 1, double(grid.height));
    find_open(range);
    if (!any_busy()) {
        leave_out_all();
        return;
    }
    const auto add_range = [&](Span at, int y) { range.add(read_range(at, y)); };
    for (int y = down.first; y <= down.last; ++y)
        if (y < rows.first || y > rows.last) {
            add_range(across, y);
        } else {
            add_range({across.first, columns.first - 1}, y);
            add_range({columns.last + 1, across.last}, y);
        }
    const int kept = (std::min)(width(down), 2 * reach.y + 1) + 1;
    table = {memory.table, grid.table_stride(), kept, 0, 0, {}};
    fine = {memory.fine, grid.table_stride(), kept, 0, 0, {}};
    table.fixed = fixed_point(range.least, range.greatest, samples_at_most, false);
    patience = rebuild_cost();
    if (range.background && table.fixed.wide) run_rows<true, true>();
    else if (range.background) run_rows<true, false>();
    else if (table.fixed.wide) run_rows<false, true>();
    else run_rows<false, false>();
}

}  // namespace nook::inline NOOK_TARGET::detail
