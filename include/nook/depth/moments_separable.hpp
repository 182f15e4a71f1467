#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/depth/moments_sums.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// The moments of a set of samples: how many, a pivot that is one of them, the mean minus the pivot,
/// and the sum of squared distances from the mean. The mean is never written as one number, so that
/// means of far surfaces can be subtracted without loss.
template <class Distance, class Accumulator>
struct Part {
    std::int32_t count;
    Distance pivot;
    Accumulator offset;
    Accumulator m2;
};

/// Sums over samples taken about the first of them.
template <class Distance, class Accumulator>
struct PivotSums {
    std::int32_t count = 0;
    Distance pivot = 0;
    Accumulator sum = 0;
    Accumulator squares = 0;

    void add(Distance distance)
    {
        if (!(distance > 0)) return;  // background
        if (count == 0) pivot = distance;
        const Accumulator difference =
            static_cast<Accumulator>(distance) - static_cast<Accumulator>(pivot);
        ++count;
        sum += difference;
        squares += difference * difference;
    }
    /// The pivot lies among the samples, so (mean − pivot)² ≤ (n − 1) σ² (Samuelson) and the
    /// subtraction loses at most a factor n.
    [[nodiscard]] Part<Distance, Accumulator> part() const
    {
        const Accumulator offset = sum / static_cast<Accumulator>(count > 0 ? count : 1);
        const Accumulator m2 = squares - sum * offset;
        return {count, pivot, offset, m2 > 0 ? m2 : Accumulator{0}};
    }
};

/// A row of parts as separate arrays, and the distances of its pixels (0 = background).
template <class Distance, class Accumulator>
struct PartRow {
    Distance* distance;
    std::int32_t* count;
    Distance* pivot;
    Accumulator* offset;
    Accumulator* m2;

    [[nodiscard]] Part<Distance, Accumulator> part(int i) const
    {
        return {count[i], pivot[i], offset[i], m2[i]};
    }
    void set(int i, const Part<Distance, Accumulator>& value) const
    {
        count[i] = value.count;
        pivot[i] = value.pivot;
        offset[i] = value.offset;
        m2[i] = value.m2;
    }
    [[nodiscard]] PartRow row(std::ptrdiff_t index, int width) const
    {
        const std::ptrdiff_t at = index * width;
        return {distance + at, count + at, pivot + at, offset + at, m2 + at};
    }
    static PartRow take(ScratchLayout& layout, std::size_t size)
    {
        return {layout.take<Distance>(size), layout.take<std::int32_t>(size),
                layout.take<Distance>(size), layout.take<Accumulator>(size),
                layout.take<Accumulator>(size)};
    }
};

/// Sums over the parts of a column, rows added one by one, taken about the mean of the first row
/// that has samples.
template <class Distance, class Accumulator>
struct ColumnSums {
    PartRow<Distance, Accumulator> pivot;  ///< count: of all rows; m2: sum within rows
    Accumulator* sum;
    Accumulator* squares;

    static ColumnSums take(ScratchLayout& layout, std::size_t size)
    {
        return {PartRow<Distance, Accumulator>::take(layout, size), layout.take<Accumulator>(size),
                layout.take<Accumulator>(size)};
    }
    void clear(int width) const
    {
        for (int i = 0; i < width; ++i) {
            pivot.set(i, {0, 0, 0, 0});
            sum[i] = squares[i] = 0;
        }
    }
    void add(const PartRow<Distance, Accumulator>& row, int width) const
    {
        for (int i = 0; i < width; ++i) {
            const bool first = pivot.count[i] == 0;
            pivot.pivot[i] = first ? row.pivot[i] : pivot.pivot[i];
            pivot.offset[i] = first ? row.offset[i] : pivot.offset[i];
            const Accumulator difference = (static_cast<Accumulator>(row.pivot[i]) -
                                            static_cast<Accumulator>(pivot.pivot[i])) +
                                           (row.offset[i] - pivot.offset[i]);
            const auto count = static_cast<Accumulator>(row.count[i]);
            pivot.count[i] += row.count[i];
            pivot.m2[i] += row.m2[i];
            sum[i] += count * difference;
            squares[i] += count * difference * difference;
        }
    }
    [[nodiscard]] Part<Distance, Accumulator> part(int i) const
    {
        const std::int32_t count = pivot.count[i];
        const Accumulator shift = sum[i] / static_cast<Accumulator>(count > 0 ? count : 1);
        const Accumulator between = squares[i] - sum[i] * shift;
        return {count, pivot.pivot[i], pivot.offset[i] + shift,
                pivot.m2[i] + (between > 0 ? between : Accumulator{0})};
    }
};

/// Box moments as the paper filters them (Chan & Im 2021, section III): each row sums k samples per
/// pixel, then each column sums k rows. A task is a band of rows, which keeps the filtered rows of
/// one window.
template <class Distance, class Accumulator>
class SeparableMoments {
    using Row = PartRow<Distance, Accumulator>;
    using Columns = ColumnSums<Distance, Accumulator>;

public:
    static constexpr int most_results = 4;

    SeparableMoments(int width, int height, int window, Border border)
        : width_{width},
          height_{height},
          radius_{window / 2},
          border_{border},
          slots_{(std::min)(window, height)},
          // A band filters 2 r rows more than it delivers.
          band_{(std::max)(64, 2 * window)}
    {}

    [[nodiscard]] std::size_t scratch_size(int workers) const
    {
        return task_scratch_size(layout(), workers);
    }

    /// As BlockMoments::run.
    template <class Source, class Consume, class S, class E>
    Outcome run(const Source& source, const Consume& consume, S&& scratch, E&& executor) const
    {
        const auto filter_band = [&](Work& work, const Memory& all, int task, int worker) {
            const Row ring = all.ring.row(worker * std::ptrdiff_t{slots_}, width_);
            Accumulator* const results =
                all.results + worker * std::ptrdiff_t{most_results} * width_;
            const Columns columns{all.columns.pivot.row(worker, width_),
                                  all.columns.sum + worker * std::ptrdiff_t{width_},
                                  all.columns.squares + worker * std::ptrdiff_t{width_}};
            const int first = task * band_, end = (std::min)(height_, first + band_);
            int filtered = window_span(first, radius_, height_, border_).first;
            for (int y = first; y < end; ++y) {
                const Span rows = window_span(y, radius_, height_, border_);
                for (; filtered <= rows.last; ++filtered)
                    filter_row(source, filtered, ring.row(filtered % slots_, width_));
                columns.clear(width_);
                for (int row = rows.first; row <= rows.last; ++row)
                    columns.add(ring.row(row % slots_, width_), width_);
                const Row pixels = ring.row(y % slots_, width_);
                for (int x = 0; x < width_; ++x) {
                    const Part<Distance, Accumulator> part = columns.part(x);
                    const Accumulator distance{pixels.distance[x]}, count(part.count);
                    const Accumulator deviation =
                        (distance - static_cast<Accumulator>(part.pivot)) - part.offset;
                    Accumulator shaded[Consume::results];
                    consume.shade(distance, count, NoBackground{},
                                  part.m2 / (std::max)(count, Accumulator{1}), deviation, shaded);
                    for (int i = 0; i < Consume::results; ++i)
                        results[i * std::ptrdiff_t{width_} + x] = shaded[i];
                }
                consume.row(work, y, 0, width_, results, width_, pixels.distance);
            }
        };
        return run_tasks(pieces(height_, band_), layout(), filter_band, scratch, executor);
    }

private:
    struct Memory {
        Row ring;  ///< rows of parts; row y lies in slot y % slots_
        Columns columns;
        Accumulator* results;
    };
    [[nodiscard]] auto layout() const
    {
        return [this](ScratchLayout& block, std::size_t workers) -> Memory {
            const std::size_t row = workers * static_cast<std::size_t>(width_);
            return {Row::take(block, row * static_cast<std::size_t>(slots_)),
                    Columns::take(block, row), block.take<Accumulator>(row * most_results)};
        };
    }

    template <class Source>
    void filter_row(const Source& source, int y, const Row& out) const
    {
        for (int x = 0; x < width_; ++x) out.distance[x] = surface_distance(source, x, y);
        for (int x = 0; x < width_; ++x) {
            const Span columns = window_span(x, radius_, width_, border_);
            PivotSums<Distance, Accumulator> sums;
            for (int i = columns.first; i <= columns.last; ++i) sums.add(out.distance[i]);
            out.set(x, sums.part());
        }
    }

    int width_, height_, radius_;
    Border border_;
    int slots_;  ///< rows that a task keeps: those of a window, or all there are
    int band_;
};

}  // namespace nook::inline NOOK_TARGET::detail
