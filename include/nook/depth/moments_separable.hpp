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

/// Box moments as the paper filters them (Chan & Im 2021, section III): each row sums k samples per
/// pixel, then each column sums k rows. A task is a band of rows, which keeps the filtered rows of
/// one window.
template <class Distance, class Accumulator>
class SeparableMoments {
    using Row = PartRow<Distance, Accumulator>;
    using Columns = ColumnSums<Distance, Accumulator>;

public:
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
            const Row result = all.result.row(worker, width_);
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
                for (int x = 0; x < width_; ++x) result.set(x, columns.part(x));
                Row delivered = result;
                delivered.distance = ring.row(y % slots_, width_).distance;
                consume(work, y, 0, width_, delivered);
            }
        };
        return run_tasks(pieces(height_, band_), layout(), filter_band, scratch, executor);
    }

private:
    struct Memory {
        Row ring;  ///< rows of parts; row y lies in slot y % slots_
        Columns columns;
        Row result;
    };
    [[nodiscard]] auto layout() const
    {
        return [this](ScratchLayout& block, std::size_t workers) -> Memory {
            const std::size_t row = workers * static_cast<std::size_t>(width_);
            return {Row::take(block, row * static_cast<std::size_t>(slots_)),
                    Columns::take(block, row), Row::take(block, row)};
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
