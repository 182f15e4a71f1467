#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include <nook/depth/left_out.hpp>
#include <nook/depth/moments_plan.hpp>
#include <nook/depth/moments_sums.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// A task of BlockMoments: one strip of columns, and one part of the rows (the top border, the bottom
/// border, or some blocks). Its own half of the work ends with the sums of columns.
template <class Filter, class Source, class Consume>
class MomentsStrip : MomentsPlan<Filter, Source, Consume> {
    using Rows = MomentsPlan<Filter, Source, Consume>;
    using Rows::columns_, Rows::consume_, Rows::distances, Rows::filter_, Rows::first_, Rows::lanes,
        Rows::leave_out, Rows::memory_, Rows::piece_count_, Rows::pieces_, Rows::plan,
        Rows::read_lanes, Rows::ready_, Rows::row, Rows::source_, Rows::steps_, Rows::work_;
    using typename Rows::Distance, typename Rows::Memory, typename Rows::Real, typename Rows::Row,
        typename Rows::Set, typename Rows::Value;

public:
    MomentsStrip(const Filter& filter, const Source& source, const Consume& consume, Work& work,
                 const Memory& memory, int strip)
        : Rows{filter, source, consume, work, memory, strip}
    {}

    /// Windows that begin at row 0.
    void top()
    {
        const int prefixes = filter_.down_.prefixes, flat = flat_rows(prefixes);
        int added = 0;
        for (const Span part : {Span{0, flat - 1}, Span{flat, prefixes - 1}}) {
            const bool before = ready_;
            if (!plan(part.first, part.last)) continue;
            if (!before || !ready_) added = 0;
            ready_ = true;
            for (int y = part.first; y <= part.last; ++y) {
                const Span rows = span(y);
                for (; added <= rows.last; ++added) add_border_row(added, added);
                deliver_border_row(y, rows);
                leave_out(y);
            }
        }
    }
    /// Windows that end at the last row.
    void bottom()
    {
        const int last = filter_.height_ - 1;
        const int first = filter_.down_.prefixes + filter_.down_.interior;
        const int flat = flat_rows(last - first + 1);
        int added = last;
        for (const Span part : {Span{last - flat + 1, last}, Span{first, last - flat}}) {
            const bool before = ready_;
            if (!plan(part.first, part.last)) continue;
            if (!before || !ready_) added = last;
            ready_ = true;
            for (int y = part.last; y >= part.first; --y) {
                const Span rows = span(y);
                for (; added >= rows.first; --added) add_border_row(added, last - added);
                deliver_border_row(y, rows);
                leave_out(y);
            }
        }
    }
    /// Full windows that begin in one of `count` blocks from `block` on.
    void blocks(int block, int count)
    {
        const int size = filter_.block_, k = filter_.window_, radius = filter_.radius_;
        const int end = (std::min)((block + count) * size, filter_.down_.interior);
        for (int i = block; i * size < end; i += filter_.slab_) {
            const int slab_end = (std::min)((i + filter_.slab_) * size, end);
            if (!plan(i * size + radius, slab_end - 1 + radius)) continue;
            if (!ready_) {
                for (int y = i * size; y < i * size + k - 1; ++y) read(y);
                for (int j = 1; j < filter_.shared_blocks_; ++j) add_up(i + j);
                ready_ = true;
            }
            for (int j = i; j * size < slab_end; ++j)
                run_block(j, (std::min)((j + 1) * size, slab_end));
        }
    }
    /// Windows of one pixel.
    void single_row(int y)
    {
        if constexpr (can_leave_out<Consume>) {
            consume_.template leave_out<read_lanes>(work_, source_, y, 0, columns_,
                                                    LeftOut::spared);
            return;
        }
        read_row<lanes>(source_, 0, columns_, y, memory_.samples);
        Value* const natural = reinterpret_cast<Value*>(memory_.natural);
        for (int at = 0; at < columns_; at += lanes) {
            const Real distance = convert<double>(load<lanes>(memory_.samples + at));
            Set window{};
            window.add(distance);
            Rows::template shade<true>(consume_, window, distance, Real{} + 1.0, natural + at,
                                       filter_.row_size());
        }
        consume_.row(work_, y, 0, columns_, natural, filter_.row_size(), memory_.samples);
    }

private:
    /// Rows at the frame whose windows are too flat to tell much.
    [[nodiscard]] static int flat_rows(int rows) { return (std::min)(8, (rows + 1) / 2); }
    [[nodiscard]] Span span(int y) const
    {
        return window_span(y, filter_.radius_, filter_.height_, filter_.border_);
    }
    [[nodiscard]] Background background(int y) const
    {
        return memory_.background[y % filter_.slots_];
    }
    [[nodiscard]] bool holes_in(int y) const { return background(y) != Background::none; }
    /// Decodes a row into its slot of the ring, dealt to the lanes.
    void read(int y)
    {
        bool none = true, all = true;
        for (int i = 0; i < piece_count_; ++i) {
            const ColumnPiece& piece = pieces_[i];
            const Background found = read_row<lanes>(source_, first_ + piece.column, piece.columns,
                                                     y, memory_.samples + piece.place);
            none = none && found == Background::none;
            all = all && found == Background::all;
        }
        memory_.background[y % filter_.slots_] = none  ? Background::none
                                                 : all ? Background::all
                                                       : Background::some;
        Distance* const out = row(y);
        const Distance* const samples = memory_.samples;
        const int steps = steps_;
        for (int step = 0; step < steps; step += lanes) {
            Lanes<Distance, lanes> square[lanes];
            for (int lane = 0; lane < lanes; ++lane)
                square[lane] = load<lanes>(samples + lane * steps + step);
            transpose(square);
            for (int i = 0; i < lanes; ++i) store(out + (step + i) * lanes, square[i]);
        }
    }
    void add_border_row(int y, int rows_before)
    {
        read(y);
        const Distance* const distance = row(y);
        const Row own = memory_.own;
        const int steps = steps_;
        if (rows_before == 0) {
            own.clear(steps);
            border_holes_ = false;
        }
        if (!border_holes_ && !holes_in(y)) {
            for (int step = 0; step < steps; ++step) {
                const Real z = distances(distance, step);
                if (rows_before == 0) {
                    own.set(step, Row::pivot, z);
                    memory_.columns.set(step, Row::pivot, z);
                }
                Set sums = own.get(step);
                sums.add_difference(z - sums.pivot);
                own.set(step, sums);
            }
            return;
        }
        if (!border_holes_) own.fill(steps, Row::count, rows_before);
        border_holes_ = true;
        for (int step = 0; step < steps; ++step) {
            Set sums = own.get(step);
            sums.add(distances(distance, step));
            own.set(step, sums);
        }
    }
    void deliver_border_row(int y, Span rows)
    {
        const Row own = memory_.own;
        const auto column = [=](int step) { return own.get(step); };
        const int count = rows.last - rows.first + 1;
        if (border_holes_) Rows::template deliver<true>(y, count, column);
        else Rows::template deliver<false>(y, count, column);
    }

    /// Walks from a row of the ring to the rows above it.
    class Upwards {
    public:
        Upwards(const MomentsStrip& strip, int y)
            : ring_{strip.memory_.ring},
              at_{strip.row(y)},
              size_{strip.filter_.row_size()},
              end_{ring_ + strip.filter_.slots_ * size_}
        {}
        [[nodiscard]] const Distance* operator*() const { return at_; }
        void next() { at_ = (at_ == ring_ ? end_ : at_) - size_; }

    private:
        const Distance *ring_, *at_;
        std::ptrdiff_t size_;
        const Distance* end_;
    };

    [[nodiscard]] int total_slot(int block) const { return block % filter_.shared_blocks_; }
    [[nodiscard]] Row total(int block) const
    {
        return memory_.totals.from(std::ptrdiff_t{total_slot(block)} * (filter_.steps_ + 1));
    }
    /// The sums of all rows of a block, about the last surface sample of each column.
    void add_up(int block)
    {
        const int first = block * filter_.block_, last = first + filter_.block_ - 1;
        bool holes = false;
        for (int y = first; y <= last; ++y) holes = holes || holes_in(y);
        memory_.total_holes[total_slot(block)] = holes;
        const Row total = this->total(block);
        for (int step = 0, steps = steps_; step < steps; ++step) {
            Set sums{};
            Upwards rows{*this, last};
            if (!holes) {
                sums.count = broadcast<lanes>(static_cast<double>(filter_.block_));
                sums.pivot = distances(*rows, step);
            }
            for (int y = last; y >= first; --y, rows.next()) {
                const Real distance = distances(*rows, step);
                if (holes) sums.add(distance);
                else sums.add_difference(distance - sums.pivot);
            }
            total.set(step, sums);
        }
    }
    /// The sums of rows y … last, for each row y of a block; their pivots go to `columns`, or to
    /// `prefix` where there is background. True then.
    bool make_suffixes(int start, int last)
    {
        bool holes = false;
        for (int y = start; y <= last; ++y) holes = holes || holes_in(y);
        const std::ptrdiff_t size = filter_.row_size();
        for (int step = 0, steps = steps_; step < steps; ++step) {
            Set sums{};
            Upwards rows{*this, last};
            if (!holes) sums.pivot = distances(*rows, step);
            memory_.own_wanted[step] = holes && any(distances(*rows, step) == 0.0);
            for (int y = last; y >= start; --y, rows.next()) {
                const Real distance = distances(*rows, step);
                const std::ptrdiff_t at = (y - start) * size + step * lanes;
                if (holes) {
                    sums.add(distance);
                    store(memory_.suffix_count + at, convert<float>(sums.count));
                } else {
                    sums.add_difference(distance - sums.pivot);
                }
                store(memory_.suffixes + 2 * at, sums.sum);
                store(memory_.suffixes + 2 * at + lanes, sums.squares);
            }
            (holes ? memory_.prefix : memory_.columns).set(step, Row::pivot, sums.pivot);
        }
        return holes;
    }

    /// Windows that begin in rows start … end − 1 of a block.
    void run_block(int block, int end)
    {
        const int k = filter_.window_, size = filter_.block_, steps = steps_;
        const int start = block * size, last = start + size - 1, shared = filter_.shared_blocks_;
        const bool suffix_holes = make_suffixes(start, last);
        if (shared > 0) add_up(block + shared);
        const Row prefix = memory_.prefix, own = memory_.own, pivots = memory_.columns;
        bool holes = suffix_holes, fresh = true;
        int added = 0;
        if (holes) own.clear(steps);
        // Takes note of more rows. Sums go on in the general form from the first background on; the
        // block then has none, and nothing but the counts of `own` matters. True if they are the first.
        const auto enter = [&](int rows, bool their_holes) {
            if (!holes && their_holes) {
                prefix.copy(steps, Row::pivot, pivots);
                own.clear(steps);
                own.fill(steps, Row::count, added);
                holes = true;
            }
            if (holes && fresh) {
                prefix.fill(steps, Row::sum, 0);
                prefix.fill(steps, Row::squares, 0);
            }
            added += rows;
            return std::exchange(fresh, false);
        };
        const auto add_full = [=](const Distance* distance, int step,
                                  bool first) NOOK_INLINE_LAMBDA {
            Set sums{};
            if (!first) {
                sums.sum = prefix.get(step, Row::sum);
                sums.squares = prefix.get(step, Row::squares);
            }
            sums.add_difference(distances(distance, step) - pivots.get(step, Row::pivot));
            prefix.set(step, Row::sum, sums.sum);
            prefix.set(step, Row::squares, sums.squares);
            return sums;
        };
        // Where the last row has no background no suffix is empty, and nothing but a count is asked of
        // `own`.
        const bool* const own_wanted = memory_.own_wanted;
        const auto add_any = [=](const Distance* distance, int step) NOOK_INLINE_LAMBDA {
            const Real z = distances(distance, step);
            Set after{};
            if (own_wanted[step]) {
                after = own.get(step);
                after.add(z);
                own.set(step, after);
            } else {
                after.count = own.get(step, Row::count) + (z > 0.0 ? Real{} + 1.0 : Real{});
                own.set(step, Row::count, after.count);
            }
            Set about_block = prefix.get(step);
            about_block.add_difference(z > 0.0 ? z - about_block.pivot : Real{});
            prefix.set(step, Row::sum, about_block.sum);
            prefix.set(step, Row::squares, about_block.squares);
            return std::pair{about_block, after};
        };

        for (int i = 1; i <= shared; ++i) {
            const Row total = this->total(block + i);
            const bool first = enter(size, memory_.total_holes[total_slot(block + i)]);
            for (int step = 0; step < steps; ++step) {
                const Set sums = total.get(step);
                Set all{};
                if (!first || holes) all = prefix.get(step);
                if (!holes) all.pivot = pivots.get(step, Row::pivot);
                all.add_about_pivot(sums, sums.count);
                prefix.set(step, Row::sum, all.sum);
                prefix.set(step, Row::squares, all.squares);
                if (!holes) continue;
                Set after = own.get(step);
                after.add(sums);
                own.set(step, after);
            }
        }
        for (int y = start + (shared + 1) * size; y < start + k - 1; ++y) {
            const bool first = enter(1, holes_in(y));
            const Distance* const distance = row(y);
            for (int step = 0; step < steps; ++step)
                if (holes) static_cast<void>(add_any(distance, step));
                else static_cast<void>(add_full(distance, step, first));
        }
        for (int y = start; y < end; ++y) {
            read(y + k - 1);
            const bool first = enter(1, holes_in(y + k - 1));
            const int centre = y + filter_.radius_;
            const Distance* const distance = row(y + k - 1);
            const std::ptrdiff_t at = (y - start) * filter_.row_size();
            const double* const suffixes = memory_.suffixes + 2 * at;
            if (!holes) {
                Rows::template deliver<false>(centre, k, [=](int step) NOOK_INLINE_LAMBDA {
                    const double* const suffix = suffixes + step * 2 * lanes;
                    const Set after = add_full(distance, step, first);
                    return Set{{},
                               pivots.get(step, Row::pivot),
                               load<lanes>(suffix) + after.sum,
                               load<lanes>(suffix + lanes) + after.squares};
                });
                leave_out(centre);
                continue;
            }
            // Nothing to add, and nothing to deliver.
            if (background(y + k - 1) == Background::all && background(centre) == Background::all) {
                Rows::deliver_empty_row(centre);
                leave_out(centre);
                continue;
            }
            const float* const counts = memory_.suffix_count + at;
            const Real uniform = broadcast<lanes>(static_cast<double>(last - y + 1));
            Rows::template deliver<true>(centre, k, [=](int step) NOOK_INLINE_LAMBDA {
                const double* const suffix = suffixes + step * 2 * lanes;
                const auto [about_block, after] = add_any(distance, step);
                const Real before =
                    suffix_holes ? convert<double>(load<lanes>(counts + step * lanes)) : uniform;
                Set window{before + after.count, about_block.pivot,
                           load<lanes>(suffix) + about_block.sum,
                           load<lanes>(suffix + lanes) + about_block.squares};
                if (own_wanted[step]) {
                    const auto none = before == 0.0;
                    window.pivot = none ? after.pivot : window.pivot;
                    window.sum = none ? after.sum : window.sum;
                    window.squares = none ? after.squares : window.squares;
                }
                return window;
            });
            leave_out(centre);
        }
    }

    bool border_holes_ = false;  ///< among the rows added so far
};

}  // namespace nook::inline NOOK_TARGET::detail
