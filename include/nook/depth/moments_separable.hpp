#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/depth/moments_rows.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>

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
        : width_{width}, height_{height}, window_{window}, radius_{window / 2}, border_{border},
          // A band filters 2 r rows more than it delivers.
          band_{(std::max)(64, 2 * window)}
    {}

    [[nodiscard]] std::size_t scratch_size(int workers) const
    {
        ScratchLayout layout;
        static_cast<void>(memory(layout, workers));
        return layout.size();
    }

    /// As BlockMoments::run.
    template <class Source, class Consume, class S, class E>
    Outcome run(const Source& source, const Consume& consume, S&& scratch, E&& executor) const
    {
        const int workers = static_cast<int>(executor.concurrency());
        const std::size_t size = scratch_size(workers);
        void* const block = scratch.reserve(size);
        if (block == nullptr) return {check_scratch<S>(size)};
        ScratchLayout layout{block};
        const Memory all = memory(layout, workers);
        for (int worker = 0; worker < workers; ++worker) all.work[worker] = {};
        executor.for_each((height_ - 1) / band_ + 1, [&](int task, int worker) {
            const Row ring = all.ring.row(worker * std::ptrdiff_t{window_}, width_);
            const Row result = all.result.row(worker, width_);
            const Columns columns{all.columns.pivot.row(worker, width_),
                                  all.columns.sum + worker * std::ptrdiff_t{width_},
                                  all.columns.squares + worker * std::ptrdiff_t{width_}};
            const int first = task * band_, end = (std::min)(height_, first + band_);
            int filtered = window_span(first, radius_, height_, border_).first;
            for (int y = first; y < end; ++y) {
                const Span rows = window_span(y, radius_, height_, border_);
                for (; filtered <= rows.last; ++filtered)
                    filter_row(source, filtered, ring.row(filtered % window_, width_));
                columns.clear(width_);
                for (int row = rows.first; row <= rows.last; ++row)
                    columns.add(ring.row(row % window_, width_), width_);
                for (int x = 0; x < width_; ++x) result.set(x, columns.part(x));
                Row delivered = result;
                delivered.distance = ring.row(y % window_, width_).distance;
                consume(all.work[worker], y, 0, width_, delivered);
            }
        });
        Outcome outcome{};
        for (int worker = 0; worker < workers; ++worker) outcome.work += all.work[worker];
        return outcome;
    }

private:
    struct Memory {
        Work* work;
        Row ring;  ///< k rows of parts; row y lies in slot y % k
        Columns columns;
        Row result;
    };
    [[nodiscard]] Memory memory(ScratchLayout& layout, int workers) const
    {
        const auto all = static_cast<std::size_t>(workers);
        const std::size_t row = all * static_cast<std::size_t>(width_);
        return {layout.take<Work>(all), Row::take(layout, row * static_cast<std::size_t>(window_)),
                Columns::take(layout, row), Row::take(layout, row)};
    }

    template <class Source>
    void filter_row(const Source& source, int y, const Row& out) const
    {
        for (int x = 0; x < width_; ++x) out.distance[x] = surface_distance(source, x, y);
        for (int x = 0; x < width_; ++x) {
            const Span columns = window_span(x, radius_, width_, border_);
            PivotSums<Distance, Accumulator> sums;
            for (int i = columns.first; i <= columns.last; ++i) sums.add(out.distance[i]);
            out.set(
                x, sums.part(Accumulator{1} / static_cast<Accumulator>((std::max)(1, sums.count))));
        }
    }

    int width_, height_, window_, radius_;
    Border border_;
    int band_;
};

}  // namespace nook::inline NOOK_TARGET::detail
