#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/target.hpp>

/// What a viewpoint channel stores, and how its measures read it.
namespace nook::inline NOOK_TARGET::detail {

/// The sum of many terms: of 256 at a time, and of these. Rounding grows with hundreds of additions,
/// not with their number, and nothing depends on the order in which a compiler may add.
class LongSum {
public:
    NOOK_INLINE void add(double term)
    {
        part_ += term;
        if ((++terms_ & 255) != 0) return;
        whole_ += part_;
        part_ = 0;
    }
    [[nodiscard]] NOOK_INLINE double total() const { return whole_ + part_; }

private:
    double whole_ = 0, part_ = 0;
    std::uint32_t terms_ = 0;
};

/// Areas and weights below this share of the largest count as 0, so that no product underflows.
inline constexpr double least_channel_share = 0x1p-400;

/// Of the power of two by which areas and weights are divided: exactly, and then sums and quotients of
/// what counts stay far from the ends of the range.
[[nodiscard]] constexpr int channel_exponent(double largest)
{
    const int exponent = static_cast<int>(std::bit_cast<std::uint64_t>(largest) >> 52) - 1023;
    return exponent < -1000 ? -1000 : exponent > 1000 ? 1000 : exponent;
}

/// A row per polygon with an entry for each view that sees it, in increasing order of views.
///
/// A count of pixels takes a word: the view in its upper half, the count in its lower half; for counts
/// of 2¹⁶ and more the next word names the same view again, with the upper half of the count. Areas of
/// the caller are doubles beside 16-bit views, scaled by a power of two.
struct ChannelRows {
    static constexpr std::uint32_t log_table_size = 2048;

    std::size_t view_count = 0, polygon_count = 0, entry_count = 0;
    /// Where the rows begin, in words or areas, and where the last one ends.
    std::uint64_t* first = nullptr;
    /// Words lie on pages of 2^page_shift.
    std::uint32_t** pages = nullptr;
    int page_shift = 0;
    std::uint16_t* views = nullptr;
    double* areas = nullptr;
    /// a_v, p(v), p(v) / a_v, log2 a_v and log2(p(v) / a_v). Where p(v) is 0, so are what it enters, and
    /// all are 0 for views that see nothing.
    double *view_area = nullptr, *p_view = nullptr, *scale = nullptr;
    double *log_area = nullptr, *log_scale = nullptr;
    double* p_polygon = nullptr;
    /// Logarithms of small counts; null beside areas.
    double* log_table = nullptr;
    /// What the stored areas are multiples of.
    double unit = 1;
    /// Of the stored areas.
    double total_area = 0;

    /// Takes the arrays whose sizes the counts of views and polygons tell.
    void take_arrays(ScratchLayout& arrays, bool counts)
    {
        first = arrays.take<std::uint64_t>(polygon_count + 1);
        p_polygon = arrays.take<double>(polygon_count);
        view_area = arrays.take<double>(view_count);
        p_view = arrays.take<double>(view_count);
        scale = arrays.take<double>(view_count);
        log_area = arrays.take<double>(view_count);
        log_scale = arrays.take<double>(view_count);
        log_table = counts ? arrays.take<double>(log_table_size) : nullptr;
    }

    [[nodiscard]] NOOK_INLINE std::uint32_t word(std::uint64_t i) const
    {
        return pages[i >> page_shift][i & ((std::uint64_t{1} << page_shift) - 1)];
    }

    /// Calls f(v, amount) for each view that sees polygon o, whatever its probability: a std::uint32_t
    /// or a double.
    template <class F>
    NOOK_INLINE void visit(std::size_t o, const F& f) const
    {
        const std::uint64_t begin = first[o], end = first[o + 1];
        if (areas != nullptr) {
            for (std::uint64_t i = begin; i < end; ++i) f(std::size_t{views[i]}, areas[i]);
            return;
        }
        for (std::uint64_t i = begin; i < end;) {
            const std::uint32_t first_word = word(i++), v = first_word >> 16;
            std::uint32_t count = first_word & 0xffff;
            if (i < end && word(i) >> 16 == v) count |= word(i++) << 16;
            f(std::size_t{v}, count);
        }
    }

    /// The stored area of one pair. O(log views).
    [[nodiscard]] double amount(std::size_t v, std::size_t o) const
    {
        std::uint64_t low = first[o], high = first[o + 1];
        const std::uint64_t end = high;
        const auto view = [&](std::uint64_t i) {
            return areas != nullptr ? std::size_t{views[i]} : std::size_t{word(i) >> 16};
        };
        while (low < high) {
            const std::uint64_t middle = low + (high - low) / 2;
            if (view(middle) < v) low = middle + 1;
            else high = middle;
        }
        if (low == end || view(low) != v) return 0;
        if (areas != nullptr) return areas[low];
        std::uint32_t count = word(low) & 0xffff;
        if (low + 1 < end && view(low + 1) == v) count |= word(low + 1) << 16;
        return double(count);
    }

    [[nodiscard]] NOOK_INLINE double log2_of(std::uint32_t count) const
    {
        return count < log_table_size ? log_table[count] : std::log2(double(count));
    }
    [[nodiscard]] NOOK_INLINE static double log2_of(double area) { return std::log2(area); }
};

/// Polygons cut into blocks by their number alone, so that sums over blocks, added in their order, do
/// not depend on the executor.
struct ChannelBlocks {
    static constexpr std::size_t smallest = 1024;
    static constexpr int most = 64;

    std::size_t polygons, size;
    int count;

    explicit ChannelBlocks(std::size_t polygon_count, std::size_t limit = most)
        : polygons{polygon_count},
          size{(std::max)(smallest, (polygon_count + limit - 1) / limit)},
          count{static_cast<int>((polygon_count + size - 1) / size)}
    {}
    [[nodiscard]] std::size_t begin(int block) const
    {
        return static_cast<std::size_t>(block) * size;
    }
    [[nodiscard]] std::size_t end(int block) const
    {
        return (std::min)(begin(block) + size, polygons);
    }
};

/// p(o). One function, so that the same areas and weights always round alike.
[[nodiscard]] NOOK_NOINLINE inline double row_probability(const ChannelRows& rows, std::size_t o)
{
    LongSum sum;
    rows.visit(o, [&](std::size_t v, auto amount) { sum.add(double(amount) * rows.scale[v]); });
    return sum.total();
}

template <class E>
void find_polygon_probabilities(const ChannelRows& rows, E& executor)
{
    const ChannelBlocks blocks{rows.polygon_count};
    executor.for_each(blocks.count, [&](int block, int) {
        for (std::size_t o = blocks.begin(block); o < blocks.end(block); ++o)
            rows.p_polygon[o] = row_probability(rows, o);
    });
}

/// Total and logarithms of the areas of the views.
inline void find_totals(ChannelRows& rows)
{
    LongSum total;
    for (std::size_t v = 0; v < rows.view_count; ++v) {
        total.add(rows.view_area[v]);
        rows.log_area[v] = rows.view_area[v] > 0 ? std::log2(rows.view_area[v]) : 0;
    }
    rows.total_area = total.total();
}

/// p(v) in proportion to weight(v) ≥ 0 among the views that see something.
template <class Weight>
void find_view_probabilities(ChannelRows& rows, const Weight& weight)
{
    double largest = 0;
    for (std::size_t v = 0; v < rows.view_count; ++v)
        if (rows.view_area[v] > 0) largest = larger(largest, static_cast<double>(weight(v)));
    const double scale = power_of_two(-channel_exponent(largest));
    const double least = rounded(largest * scale) * least_channel_share;
    LongSum sum;
    for (std::size_t v = 0; v < rows.view_count; ++v) {
        const double share = rows.view_area[v] > 0 ? static_cast<double>(weight(v)) * scale : 0;
        rows.p_view[v] = share < least ? 0 : share;
        sum.add(rows.p_view[v]);
    }
    for (std::size_t v = 0; v < rows.view_count; ++v) {
        // One view alone has exactly 1, also where a reciprocal takes the place of the division.
        if (rows.p_view[v] > 0)
            rows.p_view[v] = rows.p_view[v] < sum.total() ? rows.p_view[v] / sum.total() : 1;
        rows.scale[v] = rows.p_view[v] > 0 ? rows.p_view[v] / rows.view_area[v] : 0;
        rows.log_scale[v] = rows.scale[v] > 0 ? std::log2(rows.scale[v]) : 0;
    }
}

/// Numbers of the caller, one per view: finite, ≥ 0, and not all 0.
[[nodiscard]] inline Error check_importance(const double* importance, std::size_t view_count,
                                            const char* name)
{
    if (view_count == 0) return {};
    if (importance == nullptr) return {ErrorCode::null_data, name, 0, "one number per view"};
    bool any_positive = false;
    for (std::size_t v = 0; v < view_count; ++v) {
        if (!is_finite(importance[v]) || importance[v] < 0)
            return {ErrorCode::bad_value, name, importance[v], "finite numbers >= 0"};
        any_positive = any_positive || importance[v] > 0;
    }
    if (!any_positive) return {ErrorCode::bad_value, name, 0, "at least one number > 0"};
    return {};
}

[[nodiscard]] inline Error check_channel_size(std::size_t view_count, std::size_t polygon_count)
{
    if (view_count > 0xffff)
        return {ErrorCode::bad_size, "view_count", double(view_count), "at most 65535 views"};
    if (polygon_count >= 0xffffffff)
        return {ErrorCode::bad_size, "polygon_count", double(polygon_count),
                "at most 2^32 - 2 polygons"};
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
