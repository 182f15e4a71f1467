#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <nook/checks.hpp>
#include <nook/measure/error.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// How far two lists order their elements alike, or why nobody knows. Converts to true on success.
struct [[nodiscard]] RankCorrelation {
    Error error{};
    /// 1: the same order; −1: the opposite; 0 also where there is no order to compare, with fewer than
    /// two pairs or a list whose values are all equal.
    double value = 0;
    std::uint64_t pairs = 0;     ///< pairs that count
    std::uint64_t left_out = 0;  ///< pairs that hold a NaN

    NOOK_INLINE constexpr explicit operator bool() const { return !error; }
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Spearman's rank correlation of two lists (Spearman 1904): the correlation of the ranks, where
/// equal values share the mean of their ranks.
///
/// `first` and `second` hold `count` < 2³¹ numbers each, compared as doubles; infinities are numbers.
/// A pair with a NaN is left out. Ranks and their products are summed in integers: neither the order
/// of the pairs nor -ffast-math changes a bit. O(n log n).
template <Measurable T, Measurable U, ScratchSource S = HeapScratch>
RankCorrelation spearman(const T* first, const U* second, std::size_t count, S&& scratch = S{});

/// Bytes of scratch that `spearman` wants: 16 per pair.
[[nodiscard]] std::size_t spearman_scratch_size(std::size_t count);

/// Kendall's τ_b of two lists (Kendall 1945): pairs of elements in the same order less those in the
/// opposite, over the geometric mean of those that the first and the second list order at all.
/// Arguments and errors as `spearman`. O(n log n), by the exchanges of a merge sort (Knight 1966).
template <Measurable T, Measurable U, ScratchSource S = HeapScratch>
RankCorrelation kendall(const T* first, const U* second, std::size_t count, S&& scratch = S{});

/// Bytes of scratch that `kendall` wants: 32 per pair.
[[nodiscard]] std::size_t kendall_scratch_size(std::size_t count);

namespace detail {

/// An integer that sorts as the number does; ±0 are one number. Not for NaN.
[[nodiscard]] constexpr std::int64_t rank_key(double value)
{
    const auto bits = std::bit_cast<std::uint64_t>(value);
    const auto magnitude = static_cast<std::int64_t>(bits & ~(std::uint64_t{1} << 63));
    return bits >> 63 != 0 ? -magnitude : magnitude;
}

struct RankPair {
    std::int64_t x, y;
};

/// A sum of products below 2⁶², at most 2³¹ of them, without rounding.
class ExactSum {
public:
    void add(std::int64_t product)
    {
        high_ += product >> 32;
        low_ += product & 0xffffffff;
    }
    /// Rounded: equal sums of one total are equal numbers.
    [[nodiscard]] double value() const
    {
        const std::int64_t carried = high_ + (low_ >> 32);
        return static_cast<double>(carried) * 0x1p32 + static_cast<double>(low_ & 0xffffffff);
    }

private:
    std::int64_t high_ = 0, low_ = 0;
};

/// Sizes and data of two lists.
template <class T, class U>
[[nodiscard]] Error check_ranked(const T* first, const U* second, std::size_t count)
{
    if (count > 0x7fffffff)
        return {ErrorCode::bad_size, "count", static_cast<double>(count), "at most 2^31 - 1"};
    if (count > 0 && first == nullptr)
        return {ErrorCode::null_data, "first", 0, "data, or a count of 0"};
    if (count > 0 && second == nullptr)
        return {ErrorCode::null_data, "second", 0, "data, or a count of 0"};
    return {};
}

/// The keys of the pairs that count. Returns how many there are.
template <class T, class U>
[[nodiscard]] std::size_t ranked_pairs(const T* first, const U* second, std::size_t count,
                                       RankPair* pairs)
{
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double x = static_cast<double>(first[i]), y = static_cast<double>(second[i]);
        if (!is_nan(x) && !is_nan(y)) pairs[kept++] = {rank_key(x), rank_key(y)};
    }
    return kept;
}

/// Calls f(begin, end) for each run of equal keys in a sorted list.
template <class Key, class F>
void for_each_tie(std::size_t count, const Key& key, const F& f)
{
    for (std::size_t begin = 0, end = 0; begin < count; begin = end) {
        while (end < count && key(end) == key(begin)) ++end;
        f(begin, end);
    }
}

/// Sorts by a key of the pairs and puts ranks in its place: twice the mean rank, less count + 1, which
/// are whole numbers about 0.
inline void replace_by_ranks(RankPair* pairs, std::size_t count, std::int64_t RankPair::*key)
{
    std::sort(pairs, pairs + count,
              [key](const RankPair& a, const RankPair& b) { return a.*key < b.*key; });
    for_each_tie(
        count, [&](std::size_t i) { return pairs[i].*key; },
        [&](std::size_t begin, std::size_t end) {
            const auto rank =
                static_cast<std::int64_t>(begin + end) - static_cast<std::int64_t>(count);
            for (std::size_t i = begin; i < end; ++i) pairs[i].*key = rank;
        });
}

[[nodiscard]] constexpr std::int64_t pairs_of(std::size_t count)
{
    const auto n = static_cast<std::int64_t>(count);
    return n * (n - 1) / 2;
}

/// How many pairs of a list are out of order. Leaves it sorted in `values`, which may have changed
/// places with `spare`, of the same size.
[[nodiscard]] inline std::int64_t exchanges(std::int64_t*& values, std::int64_t*& spare,
                                            std::size_t count)
{
    std::int64_t result = 0;
    for (std::size_t width = 1; width < count; width *= 2) {
        for (std::size_t begin = 0; begin < count; begin += 2 * width) {
            const std::size_t middle = (std::min)(begin + width, count);
            const std::size_t end = (std::min)(begin + 2 * width, count);
            std::size_t left = begin, right = middle;
            for (std::size_t to = begin; to < end; ++to) {
                const bool take_left =
                    right == end || (left < middle && values[left] <= values[right]);
                if (!take_left) result += static_cast<std::int64_t>(middle - left);
                spare[to] = values[take_left ? left++ : right++];
            }
        }
        std::swap(values, spare);
    }
    return result;
}

/// covariance / √(one · other), in [−1, 1].
[[nodiscard]] inline double correlation(double covariance, double one, double other)
{
    if (!(one > 0 && other > 0)) return 0;
    return (std::min)((std::max)(covariance / std::sqrt(one * other), -1.0), 1.0);
}

}  // namespace detail

inline std::size_t spearman_scratch_size(std::size_t count)
{
    detail::ScratchLayout layout;
    layout.take<detail::RankPair>(count);
    return layout.size();
}

template <Measurable T, Measurable U, ScratchSource S>
RankCorrelation spearman(const T* first, const U* second, std::size_t count, S&& scratch)
{
    if (const Error error = detail::check_ranked(first, second, count)) return {error};
    if (count == 0) return {};
    const std::size_t bytes = spearman_scratch_size(count);
    void* block = scratch.reserve(bytes);
    if (block == nullptr) return {detail::check_scratch<S>(bytes)};
    auto* const pairs = detail::ScratchLayout{block}.take<detail::RankPair>(count);

    const std::size_t kept = detail::ranked_pairs(first, second, count, pairs);
    detail::replace_by_ranks(pairs, kept, &detail::RankPair::x);
    detail::replace_by_ranks(pairs, kept, &detail::RankPair::y);
    detail::ExactSum xx, yy, xy;
    for (std::size_t i = 0; i < kept; ++i) {
        const auto [x, y] = pairs[i];
        xx.add(x * x);
        yy.add(y * y);
        xy.add(x * y);
    }
    return {{}, detail::correlation(xy.value(), xx.value(), yy.value()), kept, count - kept};
}

inline std::size_t kendall_scratch_size(std::size_t count)
{
    detail::ScratchLayout layout;
    layout.take<detail::RankPair>(count);
    layout.take<std::int64_t>(count);
    layout.take<std::int64_t>(count);
    return layout.size();
}

template <Measurable T, Measurable U, ScratchSource S>
RankCorrelation kendall(const T* first, const U* second, std::size_t count, S&& scratch)
{
    using detail::RankPair;
    if (const Error error = detail::check_ranked(first, second, count)) return {error};
    if (count == 0) return {};
    const std::size_t bytes = kendall_scratch_size(count);
    void* block = scratch.reserve(bytes);
    if (block == nullptr) return {detail::check_scratch<S>(bytes)};
    detail::ScratchLayout layout{block};
    auto* const pairs = layout.take<RankPair>(count);
    auto* values = layout.take<std::int64_t>(count);
    auto* spare = layout.take<std::int64_t>(count);

    const std::size_t kept = detail::ranked_pairs(first, second, count, pairs);
    std::sort(pairs, pairs + kept, [](const RankPair& a, const RankPair& b) {
        return a.x != b.x ? a.x < b.x : a.y < b.y;
    });
    std::int64_t tied_first = 0, tied_second = 0, tied_both = 0;
    detail::for_each_tie(
        kept, [&](std::size_t i) { return pairs[i].x; },
        [&](std::size_t begin, std::size_t end) {
            tied_first += detail::pairs_of(end - begin);
            detail::for_each_tie(
                end - begin, [&](std::size_t i) { return pairs[begin + i].y; },
                [&](std::size_t from, std::size_t to) {
                    tied_both += detail::pairs_of(to - from);
                });
        });
    // In the order of the first list, ties by the second: what is out of order is in opposite order.
    for (std::size_t i = 0; i < kept; ++i) values[i] = pairs[i].y;
    const std::int64_t opposite = detail::exchanges(values, spare, kept);
    detail::for_each_tie(
        kept, [&](std::size_t i) { return values[i]; },
        [&](std::size_t begin, std::size_t end) { tied_second += detail::pairs_of(end - begin); });

    const std::int64_t all = detail::pairs_of(kept);
    const std::int64_t same = all - tied_first - tied_second + tied_both - opposite;
    return {{},
            detail::correlation(static_cast<double>(same - opposite),
                                static_cast<double>(all - tied_first),
                                static_cast<double>(all - tied_second)),
            kept,
            count - kept};
}

}  // namespace nook::inline NOOK_TARGET
