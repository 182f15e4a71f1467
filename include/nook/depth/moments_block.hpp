#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/depth/moments_rows.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Box moments in constant time per pixel. An axis is cut into blocks of k samples at multiples of
/// k; a window of k samples is then a suffix of one block and a prefix of the next (van Herk 1992,
/// Gil & Werman 1993, with sums for maxima). Suffixes and prefixes grow by one sample at a time and
/// never shrink: no subtraction, no drift, and every rounding depends on the position alone, so any
/// cut of the image into tasks gives the same bits. Windows that shrink at the border are prefixes or
/// suffixes of the whole axis.
///
/// Rows first, then columns over rows of parts. A task covers a strip of columns and a run of
/// blocks, the top or the bottom border.
template <class Distance, class Accumulator>
class BlockMoments {
    using Row = PartRow<Distance, Accumulator>;
    using Columns = ColumnSums<Distance, Accumulator>;

public:
    BlockMoments(int width, int height, int window, Border border)
        : width_{width},
          height_{height},
          window_{window},
          radius_{window / 2},
          border_{border},
          across_{axis(width)},
          down_{axis(height)},
          slots_{(std::min)(window, height)},
          // Wide enough that the 2 r columns beside a strip weigh little, narrow enough for the cache.
          strip_{(std::min)(width, (std::max)({512, 2 * window, 32768 / window}))},
          strips_{pieces(width, (std::max)(strip_, 1))},
          // A run of blocks filters the rows of one block more than it delivers.
          run_{(std::max)(1, 256 / window)},
          runs_{pieces(pieces(down_.interior, window), run_)}
    {}

    [[nodiscard]] std::size_t scratch_size(int workers) const
    {
        return task_scratch_size(layout(), workers);
    }

    /// Delivers each row of moments once: consume(work, y, x, width, row) for pixels x … x + width − 1
    /// of row y. `work` is the calling worker's own, and their sum is returned.
    template <class Source, class Consume, class S, class E>
    Outcome run(const Source& source, const Consume& consume, S&& scratch, E&& executor) const
    {
        const auto run_task = [&](Work& work, const Memory& all, int task, int worker) {
            const int first = task % strips_ * strip_, part = task / strips_;
            Task<Source, Consume> strip{*this,
                                        source,
                                        consume,
                                        work,
                                        all.of(worker, *this),
                                        first,
                                        (std::min)(strip_, width_ - first)};
            if (part == 0) strip.top();
            else if (part == 1) strip.bottom();
            else strip.blocks((part - 2) * run_);
        };
        return run_tasks(strips_ * (runs_ + 2), layout(), run_task, scratch, executor);
    }

private:
    /// How the windows along an axis of `size` samples fall: `prefixes` that begin at 0, `interior`
    /// ones of k samples, and the rest, which end at the last sample.
    struct Axis {
        int prefixes, interior;
    };
    [[nodiscard]] Axis axis(int size) const
    {
        if (size >= window_) return {radius_, size - window_ + 1};
        return {border_ == Border::symmetric ? (size + 1) / 2 : (std::min)(radius_ + 1, size), 0};
    }

    /// One worker's memory.
    struct Memory {
        Distance* samples;  ///< a decoded row and what its windows reach, 0 = background
        Row suffix;         ///< of the block of a row in hand
        Row ring;           ///< rows of parts; row y lies in slot y % slots_
        Columns columns;
        Row result;

        [[nodiscard]] Memory of(int worker, const BlockMoments& filter) const
        {
            const auto strip = static_cast<std::ptrdiff_t>(filter.strip_);
            const auto slots = static_cast<std::ptrdiff_t>(filter.slots_);
            Memory mine = *this;
            mine.samples += worker * filter.sample_count();
            mine.suffix = suffix.row(worker, filter.suffix_count());
            mine.ring = ring.row(worker * slots, filter.strip_);
            mine.columns = {columns.pivot.row(worker, filter.strip_), columns.sum + worker * strip,
                            columns.squares + worker * strip};
            mine.result = result.row(worker, filter.strip_);
            return mine;
        }
    };

    [[nodiscard]] std::ptrdiff_t sample_count() const
    {
        return (std::min)(width_, strip_ + 2 * window_);
    }
    [[nodiscard]] int suffix_count() const { return (std::min)(window_, width_); }
    [[nodiscard]] auto layout() const
    {
        return [this](ScratchLayout& block, std::size_t workers) -> Memory {
            const auto slots = static_cast<std::size_t>(slots_);
            const auto strip = static_cast<std::size_t>(strip_);
            return {block.take<Distance>(workers * static_cast<std::size_t>(sample_count())),
                    Row::take(block, workers * static_cast<std::size_t>(suffix_count())),
                    Row::take(block, workers * slots * strip),
                    Columns::take(block, workers * strip), Row::take(block, workers * strip)};
        };
    }

    template <class Source, class Consume>
    struct Task {
        const BlockMoments& filter;
        const Source& source;
        const Consume& consume;
        Work& work;
        Memory memory;
        int first;  ///< column
        int width;  ///< columns

        [[nodiscard]] Row slot(int y) const
        {
            return memory.ring.row(y % filter.slots_, filter.strip_);
        }

        /// Windows that begin at row 0.
        void top()
        {
            memory.columns.clear(width);
            int added = 0;
            for (int y = 0; y < filter.down_.prefixes; ++y) {
                const Span rows = window_span(y, filter.radius_, filter.height_, filter.border_);
                for (; added <= rows.last; ++added) add(added);
                deliver(y);
            }
        }
        /// Windows that end at the last row.
        void bottom()
        {
            memory.columns.clear(width);
            int added = filter.height_ - 1;
            for (int y = added; y >= filter.down_.prefixes + filter.down_.interior; --y) {
                const Span rows = window_span(y, filter.radius_, filter.height_, filter.border_);
                for (; added >= rows.first; --added) add(added);
                deliver(y);
            }
        }
        void add(int y)
        {
            filter_row(y, slot(y));
            memory.columns.add(slot(y), width);
        }
        void deliver(int y)
        {
            for (int i = 0; i < width; ++i) memory.result.set(i, memory.columns.part(i));
            hand_over(y);
        }
        void hand_over(int y)
        {
            Row row = memory.result;
            row.distance = slot(y).distance;
            consume(work, y, first, width, row);
        }

        /// Full windows that begin in one of the blocks from `block` on.
        void blocks(int block)
        {
            const int k = filter.window_;
            const int end = (std::min)((block + filter.run_) * k, filter.down_.interior);
            for (int i = 0; i < k; ++i) filter_row(block * k + i, slot(i));
            for (int start = block * k; start < end; start += k) {
                suffixes();
                memory.columns.clear(width);
                for (int i = 0; i < k && start + i < end; ++i) {
                    const Row suffix = slot(i);
                    for (int x = 0; x < width; ++x)
                        memory.result.set(x, merge(suffix.part(x), memory.columns.part(x)));
                    hand_over(start + i + filter.radius_);
                    // The next window, or the next block, takes in this row of the next block.
                    if (start + i + 1 < end) add(start + k + i);
                }
            }
        }
        /// Turns the rows of a block into suffixes: slot i then holds rows i … k − 1.
        void suffixes()
        {
            memory.columns.clear(width);
            for (int i = filter.window_ - 1; i >= 0; --i) {
                const Row row = slot(i);
                memory.columns.add(row, width);
                for (int x = 0; x < width; ++x) row.set(x, memory.columns.part(x));
            }
        }

        /// The parts of the windows along row y.
        void filter_row(int y, const Row& out)
        {
            const int k = filter.window_, end = first + width, size = filter.width_;
            const int prefixes = filter.across_.prefixes;
            const int interior_end = prefixes + filter.across_.interior;
            // Windows at the border reach to the end of the axis; all others k around.
            const int from = first < prefixes ? 0 : (std::max)(0, first - filter.radius_);
            const int to = (std::min)(size, end + filter.radius_);
            decode(y, from, to, out);

            if (first < prefixes) prefix_windows((std::min)(end, prefixes), out);
            if (end > interior_end) suffix_windows(y, (std::max)(first, interior_end), out);
            const int begin = (std::max)(first, prefixes), stop = (std::min)(end, interior_end);
            // Windows by the sample that they begin with.
            for (int start = begin - filter.radius_; start < stop - filter.radius_;) {
                const int block = start / k * k;
                const int last = (std::min)(block + k, stop - filter.radius_);
                block_windows(block, start, last, from, out);
                start = last;
            }
        }
        void decode(int y, int from, int to, const Row& out)
        {
            for (int x = from; x < to; ++x)
                memory.samples[x - from] = surface_distance(source, x, y);
            for (int i = 0; i < width; ++i) out.distance[i] = memory.samples[first + i - from];
        }
        void prefix_windows(int end, const Row& out)
        {
            PivotSums<Distance, Accumulator> sums;
            int added = 0;
            for (int x = 0; x < end; ++x) {
                const Span columns = window_span(x, filter.radius_, filter.width_, filter.border_);
                for (; added <= columns.last; ++added) sums.add(memory.samples[added]);
                if (x >= first) out.set(x - first, sums.part());
            }
        }
        /// These begin left of what the strip has decoded when the strip is narrow: read the source.
        void suffix_windows(int y, int begin, const Row& out)
        {
            PivotSums<Distance, Accumulator> sums;
            int added = filter.width_ - 1;
            for (int x = filter.width_ - 1; x >= begin; --x) {
                const Span columns = window_span(x, filter.radius_, filter.width_, filter.border_);
                for (; added >= columns.first; --added)
                    sums.add(surface_distance(source, added, y));
                if (x < first + width) out.set(x - first, sums.part());
            }
        }
        /// Windows that begin at start … last − 1, all in the block of k samples from `block` on.
        void block_windows(int block, int start, int last, int from, const Row& out)
        {
            PivotSums<Distance, Accumulator> suffix, prefix;
            for (int s = block + filter.window_ - 1; s >= start; --s) {
                suffix.add(memory.samples[s - from]);
                if (s < last) memory.suffix.set(s - block, suffix.part());
            }
            const int next = block + filter.window_;
            for (int s = next; s < start + filter.window_; ++s)
                prefix.add(memory.samples[s - from]);
            for (int s = start; s < last; ++s) {
                out.set(s + filter.radius_ - first,
                        merge(memory.suffix.part(s - block), prefix.part()));
                if (s + 1 < last) prefix.add(memory.samples[s + filter.window_ - from]);
            }
        }
    };

    int width_, height_, window_, radius_;
    Border border_;
    Axis across_, down_;
    int slots_;  ///< rows that a task keeps: those of a window, or all there are
    int strip_, strips_, run_, runs_;
};

}  // namespace nook::inline NOOK_TARGET::detail
