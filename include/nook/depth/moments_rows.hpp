#pragma once

#include <algorithm>
#include <cstddef>

#include <nook/depth/moments_sums.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Columns of a strip that are read side by side.
struct ColumnPiece {
    int column;   ///< the first, a multiple of the block
    int columns;  ///< how many
    int place;    ///< where they begin among all that are read
    int starts;   ///< windows to deliver, from the first column on
};

/// The second half of BlockMoments: from the sums of the columns of a row of windows to the windows,
/// and to results in the order of their pixels.
template <class Filter, class Source, class Consume>
class MomentsRows {
protected:
    static constexpr int lanes = Filter::lane_count;
    using Distance = typename Source::Distance;
    using Memory = typename Filter::Memory;
    using Real = Lanes<double, lanes>;
    using Set = Sums<lanes>;
    using Row = SumsRow<lanes>;
    using Value = typename Consume::Value;

    MomentsRows(const Filter& filter, const Consume& consume, Work& work, const Memory& memory,
                int strip)
        : filter_{filter},
          consume_{consume},
          work_{work},
          memory_{memory},
          first_{strip * filter.starts_},
          starts_{(std::min)(filter.starts_, filter.across_.interior - first_)},
          size_{filter.dealt_.size},
          left_{strip == 0},
          right_{strip == filter.strips_ - 1},
          pieces_{memory.pieces}
    {
        use_all_columns();
    }

    /// Columns of the strip that are read: those of all its windows, or of the windows that somebody
    /// wants, piece by piece. Pieces begin with a block, so that a window keeps its bits.
    void use_all_columns()
    {
        const int columns = strip_columns();
        pieces_[0] = {0, columns, 0, starts_};
        use_columns(1, filter_.dealt_.size * filter_.dealt_.blocks);
    }
    void use_columns(int count, int steps)
    {
        piece_count_ = count;
        const auto& last = pieces_[count - 1];
        columns_ = last.place + last.columns;
        steps_ = steps;
        edge_left_ = left_ && pieces_[0].column == 0;
        edge_right_ = right_ && last.column + last.starts == starts_;
        // Lanes run on past the last column, and places past the last step.
        clear_unused_samples();
        memory_.columns.from(steps_).clear(1);
        memory_.across.from(steps_).clear(1);
    }
    [[nodiscard]] int strip_columns() const
    {
        return starts_ > 0 ? starts_ + filter_.window_ - 1 : filter_.width_;
    }
    /// The pixels of the windows that begin in [start, end), with those at the frame.
    [[nodiscard]] Span pixels(int start, int end) const
    {
        const int first = first_ + filter_.radius_;
        return {start == 0 && left_ ? 0 : first + start,
                (end == starts_ && right_ ? filter_.width_ : first + end) - 1};
    }

    /// A row of the ring.
    [[nodiscard]] Distance* row(int y) const
    {
        return memory_.ring + (y % filter_.slots_) * filter_.row_size();
    }
    [[nodiscard]] NOOK_INLINE static Real distances(const Distance* row, int step)
    {
        return convert<double>(load<lanes>(row + step * lanes));
    }
    void clear_unused_samples()
    {
        std::fill(memory_.samples + columns_, memory_.samples + filter_.row_size(), Distance{0});
    }

    /// Filters the windows of row y, given the sums of the `rows` samples of each of their columns.
    /// Without background the pivots of the columns stand in memory_.columns already.
    template <bool holes, class Column>
    void deliver(int y, int rows, const Column& column)
    {
        const int size = size_;
        const Real full = broadcast<lanes>(static_cast<double>(rows));
        const Row columns = memory_.columns, across = memory_.across;
        for (int first = steps_ - size; first >= 0; first -= size) {
            Set suffix{};
            if constexpr (!holes) suffix.pivot = columns.get(first + size - 1, Row::pivot);
            for (int step = first + size - 1; step >= first; --step) {
                const Set sums = column(step);
                columns.set(step, Row::sum, sums.sum);
                columns.set(step, Row::squares, sums.squares);
                if constexpr (holes) {
                    columns.set(step, Row::pivot, sums.pivot);
                    columns.set(step, Row::count, sums.count);
                    suffix.add(sums);
                    across.set(step, Row::count, suffix.count);
                } else {
                    suffix.add_about_pivot(sums, full);
                }
                across.set(step, Row::sum, suffix.sum);
                across.set(step, Row::squares, suffix.squares);
            }
            across.set(first, Row::pivot, suffix.pivot);
        }
        if (edge_left_) deliver_edge<holes, false>(y, rows);
        if (edge_right_) deliver_edge<holes, true>(y, rows);
        if (starts_ > 0) deliver_full<holes>(y, rows);
    }

    /// A row without any surface.
    void deliver_empty_row(int y)
    {
        for (int i = 0; i < piece_count_; ++i) {
            const Span at = pixels(pieces_[i].column, pieces_[i].column + pieces_[i].starts);
            const int count = at.last - at.first + 1;
            std::fill_n(memory_.centre, count, Distance{0});
            consume_.row(work_, y, at.first, count, reinterpret_cast<Value*>(memory_.natural),
                         filter_.row_size(), memory_.centre);
        }
    }

    /// Turns the sums of windows into results. Without background `area` is their count.
    template <bool holes>
    NOOK_INLINE static void shade(const Consume& consume, const Set& window, const Real& distance,
                                  const Real& area, Value* results, std::ptrdiff_t pitch)
    {
        const Real samples = holes ? larger(window.count, Real{} + 1.0) : area;
        const Real inverse = fenced(1.0 / samples);
        const Real mean = fenced(window.sum * inverse);
        const Real spread = fenced(window.squares - window.sum * mean);
        const Real variance = larger(spread * inverse, Real{});
        const Real deviation = fenced(distance - window.pivot) - mean;
        Real shaded[Consume::results];
        if constexpr (holes)
            consume.shade(distance, window.count, (area - window.count) / area, variance, deviation,
                          shaded);
        else consume.shade(distance, area, NoBackground{}, variance, deviation, shaded);
        for (int i = 0; i < Consume::results; ++i)
            store(results + i * pitch, convert<Value>(shaded[i]));
    }

    const Filter& filter_;
    const Consume& consume_;
    Work& work_;
    Memory memory_;
    int first_;                    ///< column
    int starts_;                   ///< full windows along a row
    int columns_;                  ///< that are read, gaps between pieces and all
    int size_;                     ///< columns in a block
    int steps_;                    ///< columns of a lane
    bool left_, right_;            ///< at the frame
    bool edge_left_, edge_right_;  ///< so, and read
    ColumnPiece* pieces_;
    int piece_count_;

private:
    /// Windows of k columns.
    template <bool holes>
    void deliver_full(int y, int rows)
    {
        const int k = filter_.window_, size = size_, steps = steps_;
        const Row columns = memory_.columns, across = memory_.across;
        const Distance* const centre_row = row(y);
        Distance* const centre_distances = memory_.centre;
        Value* const results = reinterpret_cast<Value*>(memory_.results);
        const std::ptrdiff_t pitch = filter_.row_size();
        const Real full = broadcast<lanes>(static_cast<double>(rows));
        const Real full_block = broadcast<lanes>(static_cast<double>(rows) * size);
        const Real area = broadcast<lanes>(static_cast<double>(rows) * k);
        const Consume consume = consume_;

        Place centre{filter_.radius_, steps, lanes};
        for (int first = 0; first < steps; first += size) {
            Set prefix{}, own{};
            prefix.pivot = across.get(first, Row::pivot);
            // With samples in the last column no suffix is empty.
            const bool use_own = holes && any(columns.get(first + size - 1, Row::count) == 0.0);
            const auto add = [&](const Row& from, const Place& place,
                                 const Real& count) NOOK_INLINE_LAMBDA {
                Set sums{count, from.get(place, Row::pivot), from.get(place, Row::sum),
                         from.get(place, Row::squares)};
                if constexpr (holes) {
                    sums.count = from.get(place, Row::count);
                    if (use_own) own.add(sums);
                    else own.count += sums.count;
                }
                prefix.add_about_pivot(sums, sums.count);
            };
            // What all windows of the block share: whole blocks, then columns.
            Place next = Row::place(first + size, steps);
            int shared = k - 1 - size;
            for (; shared >= size; shared -= size, next.next(size)) add(across, next, full_block);
            for (; shared > 0; --shared, next.next()) add(columns, next, full);
            for (int step = first; step < first + size; ++step, next.next(), centre.next()) {
                add(columns, next, full);
                Set window{{},
                           prefix.pivot,
                           across.get(step, Row::sum) + prefix.sum,
                           across.get(step, Row::squares) + prefix.squares};
                const auto distance = load<lanes>(centre_row + *centre);
                if constexpr (holes) {
                    const Real before = across.get(step, Row::count);
                    window.count = before + own.count;
                    if (use_own) {
                        const auto none = before == 0.0;
                        window.pivot = none ? own.pivot : window.pivot;
                        window.sum = none ? own.sum : window.sum;
                        window.squares = none ? own.squares : window.squares;
                    }
                    store(centre_distances + step * lanes, distance);
                }
                shade<holes>(consume, window, convert<double>(distance), area,
                             results + step * lanes, pitch);
            }
        }

        Value* const natural = reinterpret_cast<Value*>(memory_.natural);
        for (int i = 0; i < Consume::results; ++i) undeal(results + i * pitch, natural + i * pitch);
        if constexpr (holes) undeal(centre_distances, memory_.samples);
        for (int i = 0; i < piece_count_; ++i) {
            const ColumnPiece& piece = pieces_[i];
            consume_.row(work_, y, first_ + filter_.radius_ + piece.column, piece.starts,
                         natural + piece.place, pitch,
                         holes ? memory_.samples + piece.place : nullptr);
        }
        if constexpr (holes) clear_unused_samples();
    }

    /// Windows that begin at column 0, or end at the last.
    template <bool holes, bool right>
    void deliver_edge(int y, int rows)
    {
        const int prefixes = filter_.across_.prefixes;
        const int count = right ? filter_.width_ - filter_.across_.interior - prefixes : prefixes;
        if (count == 0) return;
        const Row columns = memory_.columns, edge = memory_.edge;
        const Distance* const centre_row = row(y);
        const int padded = pieces(count, lanes) * lanes;
        edge.clear(padded / lanes);
        std::fill_n(memory_.edge_area, padded, 1.0);
        std::fill_n(memory_.centre, padded, Distance{0});

        // One set in scalars: each of these windows adds to the one before.
        Sums<1> sums{};
        int added = 0;
        Place next = Row::place(right ? columns_ - 1 : 0, steps_);
        Place centre{right ? columns_ - 1 : 0, steps_, lanes};
        const auto inwards = [](Place& place) {
            if constexpr (right) place.previous();
            else place.next();
        };
        for (int i = 0; i < count; ++i, inwards(centre)) {
            const int x = right ? filter_.width_ - 1 - i : i;
            const Span reach = window_span(x, filter_.radius_, filter_.width_, filter_.border_);
            const int width = right ? filter_.width_ - reach.first : reach.last + 1;
            for (; added < width; ++added, inwards(next)) {
                const double* const column = columns.data + *next;
                const Sums<1> set{holes ? column[Row::count * lanes] : rows,
                                  column[Row::pivot * lanes], column[Row::sum * lanes],
                                  column[Row::squares * lanes]};
                if (holes) {
                    sums.add(set);
                } else {
                    if (added == 0) sums.pivot = set.pivot;
                    sums.add_about_pivot(set, set.count);
                }
            }
            const int to = right ? count - 1 - i : i;
            double* const window = edge.data + to / lanes * Row::stride + to % lanes;
            window[Row::count * lanes] = sums.count;
            window[Row::pivot * lanes] = sums.pivot;
            window[Row::sum * lanes] = sums.sum;
            window[Row::squares * lanes] = sums.squares;
            memory_.centre[to] = centre_row[*centre];
            memory_.edge_area[to] = static_cast<double>(rows) * width;
        }
        Value* const natural = reinterpret_cast<Value*>(memory_.natural);
        for (int step = 0; step * lanes < count; ++step)
            shade<holes>(consume_, edge.get(step), distances(memory_.centre, step),
                         load<lanes>(memory_.edge_area + step * lanes), natural + step * lanes,
                         padded);
        consume_.row(work_, y, right ? filter_.width_ - count : 0, count, natural, padded,
                     holes ? memory_.centre : nullptr);
    }

    /// From the order of the lanes to that of the columns. The last square of a lane may run on into
    /// the next lane's columns, which are written after it.
    template <class T>
    void undeal(const T* dealt, T* columns) const
    {
        const int steps = steps_;
        for (int step = (steps - 1) / lanes * lanes; step >= 0; step -= lanes) {
            Lanes<T, lanes> square[lanes];
            for (int i = 0; i < lanes; ++i) square[i] = load<lanes>(dealt + (step + i) * lanes);
            transpose(square);
            for (int lane = 0; lane < lanes; ++lane)
                store(columns + lane * steps + step, square[lane]);
        }
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
