#pragma once

#include <algorithm>
#include <cstdint>

#include <nook/depth/flat_cells.hpp>
#include <nook/depth/left_out.hpp>
#include <nook/depth/moments_rows.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/depth/window.hpp>
#include <nook/outcome.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// What a task of BlockMoments leaves out. Cells of pixels, some blocks high and wide, are wanted or not;
/// the strip then reads the columns of wanted ones alone, side by side. Windows keep their bits, since all
/// their roundings depend on their place among the blocks of the strip.
template <class Filter, class Source, class Consume>
class MomentsPlan : protected MomentsRows<Filter, Source, Consume> {
protected:
    using Rows = MomentsRows<Filter, Source, Consume>;
    using Rows::consume_, Rows::filter_, Rows::lanes, Rows::memory_, Rows::piece_count_,
        Rows::pieces_, Rows::pixels, Rows::starts_, Rows::steps_, Rows::work_;
    using typename Rows::Distance, typename Rows::Memory;

    MomentsPlan(const Filter& filter, const Source& source, const Consume& consume, Work& work,
                const Memory& memory, int strip)
        : Rows{filter, consume, work, memory, strip},
          source_{source}
    {}

    static constexpr int read_lanes =
        lanes == 1 ? 1 : lanes * 8 / static_cast<int>(sizeof(Distance));

    /// Decides what to do about the pixels of rows y … last, and which columns to read for it. When
    /// that is nothing, deals with them and returns false.
    bool plan(int y, int last)
    {
        if constexpr (can_leave_out<Consume>) {
            if (y > last) return false;
            std::fill_n(memory_.cells, filter_.cells_, LeftOut::wanted);
            spare(y, last);
            find_empty(y, last);
            find_open(y, last);
            if (choose_columns()) return true;
            for (int at = y; at <= last; ++at) leave_out(at);
            ready_ = false;
            return false;
        }
        return y <= last;
    }
    void leave_out(int y) const
    {
        if constexpr (can_leave_out<Consume>)
            for_runs([&](int i, int end) {
                if (memory_.cells[i] == LeftOut::wanted) return;
                const Span at = cell_pixels(i, end);
                consume_.template leave_out<read_lanes>(work_, source_, y, at.first,
                                                        at.last - at.first + 1, memory_.cells[i]);
            });
    }

    const Source& source_;
    bool ready_ = false;  ///< the rows before the next ones are read, in the columns of now

private:
    [[nodiscard]] Span cell_pixels(int first, int end) const
    {
        return pixels(first * filter_.cell_, (std::min)(end * filter_.cell_, starts_));
    }
    /// Calls f(first, end) for each run of cells of one kind.
    template <class F>
    void for_runs(const F& f) const
    {
        const LeftOut* const cells = memory_.cells;
        const int count = cell_count();
        for (int i = 0, end = 0; i < count; i = end) {
            for (end = i + 1; end < count && cells[end] == cells[i];) ++end;
            f(i, end);
        }
    }
    [[nodiscard]] int cell_count() const { return (std::max)(1, pieces(starts_, filter_.cell_)); }
    void spare(int y, int last) const
    {
        const Span all = cell_pixels(0, cell_count());
        if (!consume_.mark_wanted(y, last, all.first, all.last, memory_.marks)) return;
        const int first_group = all.first / WorkMap::group;
        for (int i = 0; i < cell_count(); ++i) {
            const Span at = cell_pixels(i, i + 1);
            bool any_wanted = false;
            for (int g = at.first / WorkMap::group; g <= at.last / WorkMap::group; ++g)
                any_wanted = any_wanted || memory_.marks[g - first_group] != 0;
            if (!any_wanted) memory_.cells[i] = LeftOut::spared;
        }
    }
    void find_empty(int y, int last) const
    {
        const auto surface = [&](int at_x, int at_y) {
            return surface_distance(source_, at_x, at_y) > 0;
        };
        const int count = cell_count();
        for (int i = 0; i < count; ++i) {
            const Span at = cell_pixels(i, i + 1);
            memory_.marks[i] = memory_.cells[i] == LeftOut::wanted && !surface(at.first, y) &&
                               !surface(at.last, last) && !surface(at.first, last) &&
                               !surface(at.last, y);
        }
        for (int i = 0, end = 0; i < count; i = end) {
            for (end = i + 1; end < count && memory_.marks[end] == memory_.marks[i];) ++end;
            if (memory_.marks[i] == 0) continue;
            const Span all = cell_pixels(i, end);
            int left = end - i;
            for (int at_y = y; at_y <= last && left > 0; ++at_y) {
                if (count_surfaces<read_lanes>(source_, all.first, all.last - all.first + 1,
                                               at_y) == 0)
                    continue;
                for (int cell = i; cell < end; ++cell) {
                    const Span at = cell_pixels(cell, cell + 1);
                    if (memory_.marks[cell] == 0 ||
                        count_surfaces<read_lanes>(source_, at.first, at.last - at.first + 1,
                                                   at_y) == 0)
                        continue;
                    memory_.marks[cell] = 0;
                    --left;
                }
            }
            for (int cell = i; cell < end; ++cell)
                if (memory_.marks[cell] != 0) memory_.cells[cell] = LeftOut::empty;
        }
    }
    void find_open(int y, int last)
    {
        using Flat = FlatCells<Source, read_lanes>;
        if constexpr (Flat::possible) {
            if (source_.image.pixel_stride != 1) return;
            if (rest_ > 0) {
                --rest_;
                return;
            }
            const int count = cell_count(), r = filter_.radius_;
            for (int i = 0; i < count; ++i) memory_.marks[i] = memory_.cells[i] == LeftOut::wanted;
            const Flat flat{
                source_,      {y, last}, {r, r, r, r}, filter_.border_, !consume_.open_in_front(),
                memory_.worst};
            // A cell costs its halo besides: short runs save nothing.
            const int tried = flat.find([&](int i) { return cell_pixels(i, i + 1); }, count,
                                        (std::min)(count, 2), memory_.marks);
            int found = 0;
            for (int i = 0; i < count; ++i) {
                if (memory_.marks[i] == 0) continue;
                memory_.cells[i] = LeftOut::open;
                ++found;
            }
            // Where looking does not pay, look less often.
            if (tried > 2 * found) rest_ = fruitless_ = (std::min)(2 * fruitless_ + 1, 7);
            else fruitless_ = 0;
        }
    }
    /// Chooses the columns to read, unless those of the last rows will do. False when there are none.
    bool choose_columns()
    {
        const int size = filter_.dealt_.size, cell = filter_.cell_, k = filter_.window_;
        const int all = Rows::strip_columns();
        const int all_steps = size * filter_.dealt_.blocks;
        ColumnPiece* const out = memory_.pieces + filter_.cells_;
        int used = 0, place = 0;
        for_runs([&](int i, int end) {
            if (memory_.cells[i] != LeftOut::wanted) return;
            const int first = i * cell, starts_end = (std::min)(end * cell, starts_);
            // What the run before reads for its last windows may reach into this one.
            if (used > 0 && out[used - 1].column + out[used - 1].columns >= first) --used;
            else out[used].column = first;
            ColumnPiece& piece = out[used++];
            piece.starts = starts_end - piece.column;
            const int reach = pieces(piece.starts + k - 1, size) * size;
            piece.columns = (std::min)(reach, all - piece.column);
        });
        if (used == 0) return false;
        for (int i = 0; i < used; ++i) {
            out[i].place = place;
            place += pieces(out[i].columns, size) * size;
        }
        const int steps = pieces(place / size, lanes) * size;
        const bool whole = starts_ <= 0 || steps * 8 > all_steps * 7;
        // Other columns must be read anew.
        if (!ready_ || !covered(out, used) || (whole ? all_steps : steps) * 6 < steps_ * 5) {
            ready_ = false;
            if (whole) {
                Rows::use_all_columns();
            } else {
                std::copy_n(out, used, pieces_);
                Rows::use_columns(used, steps);
            }
        }
        for (int i = 0; i < piece_count_; ++i) {
            const int first = pieces_[i].column / cell;
            const int end = (std::max)(first + 1, pieces(first * cell + pieces_[i].starts, cell));
            std::fill(memory_.cells + first, memory_.cells + end, LeftOut::wanted);
        }
        return true;
    }
    /// Whether these windows are among those that are delivered now.
    [[nodiscard]] bool covered(const ColumnPiece* wanted, int count) const
    {
        int at = 0;
        for (int i = 0; i < count; ++i) {
            const int first = wanted[i].column, end = first + wanted[i].starts;
            while (at < piece_count_ && pieces_[at].column + pieces_[at].starts < end) ++at;
            if (at == piece_count_ || pieces_[at].column > first) return false;
        }
        return true;
    }

    int rest_ = 0;  ///< slabs in which nothing is looked for
    int fruitless_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
