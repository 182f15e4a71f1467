#pragma once

#include <algorithm>
#include <cstddef>

#include <nook/lanes.hpp>
#include <nook/scratch.hpp>

/// Sums over samples about a pivot that is one of them, in lanes.
namespace nook::inline NOOK_TARGET::detail {

/// In place of the share of background, where there is none.
struct NoBackground {};

/// One set of samples a lane: how many, the pivot, the sum of the differences from it and the sum of
/// their squares.
template <int lanes>
struct Sums {
    using Real = Lanes<double, lanes>;
    Real count, pivot, sum, squares;

    /// Adds a sample to each lane, 0 = background. The first one becomes the pivot.
    void add(const Real& distance)
    {
        const auto surface = distance > 0.0;
        pivot = (surface & (count == 0.0)) ? distance : pivot;
        add_difference(surface ? distance - pivot : Real{});
        count += surface ? Real{} + 1.0 : Real{};
    }
    /// Adds samples by their differences from the pivot, and does not count them.
    NOOK_INLINE void add_difference(const Real& from_pivot)
    {
        const Real difference = fenced(from_pivot);
        sum = fenced(sum + difference);
        squares = fenced(squares + difference * difference);
    }
    /// Adds `samples` samples whose sums are about another pivot, but neither counts them nor takes
    /// over their pivot: Σ(y + d) = Σy + n d and Σ(y + d)² = Σy² + d (Σy + Σ(y + d)). Both pivots are
    /// samples of the window, so no term is large beside the window's own spread.
    NOOK_INLINE void add_about_pivot(const Sums& other, const Real& samples)
    {
        const Real shift = fenced(other.pivot - pivot);
        const Real moved = fenced(other.sum + samples * shift);
        squares = fenced(squares + fenced(other.squares + shift * (other.sum + moved)));
        sum = fenced(sum + moved);
    }
    /// The union with other samples; the pivot is that of the first set that has any.
    NOOK_INLINE void add(const Sums& other)
    {
        pivot = ((other.count > 0.0) & (count == 0.0)) ? other.pivot : pivot;
        add_about_pivot(other, other.count);
        count += other.count;
    }
};

/// A place in a row whose columns are dealt to the lanes, with `stride` values a step. It moves on by
/// steps: past a lane's last column it goes on with the first of the next lane, one value further on.
/// The last lanes then get values that belong to no column of theirs; their windows begin too late to
/// be delivered.
class Place {
public:
    Place(int column, int steps, int stride)
        : stride_{stride},
          row_{std::ptrdiff_t{steps} * stride},
          end_{row_ + column / steps},
          at_{std::ptrdiff_t{column % steps} * stride + column / steps}
    {}
    [[nodiscard]] NOOK_INLINE std::ptrdiff_t operator*() const { return at_; }
    NOOK_INLINE void next(int steps = 1)
    {
        at_ += std::ptrdiff_t{steps} * stride_;
        if (at_ >= end_) {
            at_ -= row_ - 1;
            ++end_;
        }
    }
    NOOK_INLINE void previous()
    {
        at_ -= stride_;
        if (at_ < 0) {
            at_ += row_ - 1;
            --end_;
        }
    }

private:
    std::ptrdiff_t stride_, row_, end_, at_;
};

/// A row of sums. The fields of a step lie side by side: in arrays of their own, all of one length,
/// they would compete for the same lines of the cache.
template <int lanes>
struct SumsRow {
    using Real = Lanes<double, lanes>;
    double* data;

    enum Field { pivot, sum, squares, count, fields };
    static constexpr int stride = fields * lanes;

    static SumsRow take(ScratchLayout& block, std::size_t steps)
    {
        return {block.take<double>(steps * stride)};
    }
    [[nodiscard]] SumsRow from(std::ptrdiff_t step) const { return {data + step * stride}; }
    [[nodiscard]] static Place place(int column, int steps) { return {column, steps, stride}; }

    [[nodiscard]] NOOK_INLINE Real get(int step, Field field) const
    {
        return load<lanes>(data + std::ptrdiff_t{step} * stride + field * lanes);
    }
    [[nodiscard]] NOOK_INLINE Real get(const Place& place, Field field) const
    {
        return load<lanes>(data + *place + field * lanes);
    }
    NOOK_INLINE void set(int step, Field field, const Real& value) const
    {
        store(data + std::ptrdiff_t{step} * stride + field * lanes, value);
    }
    template <class Where>
    [[nodiscard]] NOOK_INLINE Sums<lanes> get(const Where& where) const
    {
        return {get(where, count), get(where, pivot), get(where, sum), get(where, squares)};
    }
    NOOK_INLINE void set(int step, const Sums<lanes>& sums) const
    {
        set(step, count, sums.count);
        set(step, pivot, sums.pivot);
        set(step, sum, sums.sum);
        set(step, squares, sums.squares);
    }
    void clear(int steps) const { std::fill_n(data, steps * stride, 0.0); }
    void fill(int steps, Field field, double value) const
    {
        for (int step = 0; step < steps; ++step) set(step, field, broadcast<lanes>(value));
    }
    void copy(int steps, Field field, const SumsRow& other) const
    {
        for (int step = 0; step < steps; ++step) set(step, field, other.get(step, field));
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
