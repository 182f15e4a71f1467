#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>

/// What the two filters that deliver moments row by row share.
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

/// The union of two disjoint sets (Chan, Golub & LeVeque 1983): sums of non-negative terms only.
template <class Distance, class Accumulator>
[[nodiscard]] Part<Distance, Accumulator> merge(const Part<Distance, Accumulator>& a,
                                                const Part<Distance, Accumulator>& b)
{
    if (a.count == 0) return b;
    if (b.count == 0) return a;
    const Accumulator delta =
        (static_cast<Accumulator>(b.pivot) - static_cast<Accumulator>(a.pivot)) +
        (b.offset - a.offset);
    const auto count = static_cast<Accumulator>(a.count + b.count);
    const Accumulator share = static_cast<Accumulator>(b.count) / count;
    return {a.count + b.count, a.pivot, a.offset + delta * share,
            a.m2 + b.m2 + delta * delta * (static_cast<Accumulator>(a.count) * share)};
}

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
    /// The pixel's own distance minus the mean.
    [[nodiscard]] Accumulator deviation(int i) const
    {
        return (static_cast<Accumulator>(distance[i]) - static_cast<Accumulator>(pivot[i])) -
               offset[i];
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

}  // namespace nook::inline NOOK_TARGET::detail
