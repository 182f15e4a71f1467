#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/target.hpp>

/// A summed area table (Crow 1984) of whole numbers, which makes no rounding error: distances
/// become integers (block fixed point), and sums of them and of their squares are kept modulo 2⁶⁴.
/// The window that four entries give is right however often the entries wrapped, provided that its
/// own sum fits.
namespace nook::inline NOOK_TARGET::detail {

/// How the distances of a region become whole numbers below 2³¹: (x − offset) / step, rounded. A
/// step is a power of two: no smaller than the spacing of floats at the least distance, and then
/// every distance is exact; larger if the region would not fit otherwise.
struct FixedPoint {
    double step = 1, per_step = 1;
    double offset = 0;      ///< in steps; a whole number
    double exact_from = 0;  ///< distances from here on are whole steps
    double least = 0,
           largest = 0;  ///< distances outside are outliers: they enter no sum
    /// Sums of squares may leave 64 bits, distances may be rounded, or there are outliers: the
    /// table keeps more than sums (see `TableRow::marks`).
    bool wide = false;
    bool outliers = false;
    int shift = 0;  ///< squares lose this many bits on their way into the marks
};

/// For distances in [least, largest], > 0, of which no window holds more than `samples` < 2²⁴. With
/// `outliers` there may be others.
template <class Distance>
[[nodiscard]] FixedPoint fixed_point(Distance least, Distance largest, double samples,
                                     bool outliers);

/// One row of a table: entry i sums all samples of columns ≤ i in the rows up to this one.
struct TableRow {
    std::uint64_t* sum;
    std::uint64_t* squares;
    /// Bits 32–63: squares >> shift; bits 0–31: flaws, which are outliers if there may be any, else
    /// samples that were rounded. Kept if wide.
    std::uint64_t* marks;
    std::uint64_t* background;  ///< samples without a surface; kept if masked

    [[nodiscard]] NOOK_INLINE TableRow operator+(std::ptrdiff_t entries) const
    {
        return {sum + entries, squares + entries, marks + entries, background + entries};
    }
};

/// The sums over windows, lane by lane.
template <int N>
struct TableSums {
    Lanes<std::uint64_t, N> sum, squares, marks, background;
};

/// Adds a row of `count` distances, 0 = background, to the row above. Reads and writes up to a
/// multiple of N; the distances there are 0.
template <int N, bool masked, bool wide, class Distance>
void add_table_row(const FixedPoint& fixed, const Distance* distances, int count,
                   const TableRow& above, const TableRow& row);

/// A corner of the windows of N neighbouring pixels: that of the first lies at entry `first` of a
/// row, each other `stride` entries on.
struct Corners {
    std::ptrdiff_t first;
    int stride;  ///< 0, 1 or 2
};

/// The windows of N neighbouring pixels. Their corners are entries of their last row and of the row
/// above their first, at their last column and at the column before their first.
template <int N, bool masked, bool wide>
[[nodiscard]] TableSums<N> window_sums(const TableRow& top, const TableRow& bottom, Corners left,
                                       Corners right);

/// Moments of windows.
template <int N>
struct TableMoments {
    Lanes<double, N> count, background, variance, deviation;
    /// Above 0, the number of flaws, where they keep the table from vouching for the moments.
    Lanes<double, N> doubt;
};

/// `area`: samples in each window, background included; `per_area` = 1 / area. `slack`: what the
/// caller will add to the variance.
template <int N, bool masked, bool wide, class Slack>
[[nodiscard]] TableMoments<N> table_moments(const FixedPoint& fixed, const TableSums<N>& sums,
                                            const Lanes<double, N>& distance,
                                            const Lanes<double, N>& area,
                                            const Lanes<double, N>& per_area, const Slack& slack);

// --- bodies

template <class Distance>
FixedPoint fixed_point(Distance least, Distance largest, double samples, bool outliers)
{
    constexpr int digits = std::numeric_limits<Distance>::digits;
    // Keeps squares of steps in the range of double. Denormal floats get the steps that normal ones
    // would: images that differ by a power of two give the same whole numbers.
    constexpr int finest = -480;
    FixedPoint fixed;
    fixed.least = static_cast<double>(least);
    fixed.largest = static_cast<double>(largest);
    fixed.outliers = outliers;
    int window_bits = 0, exponent = 0;
    static_cast<void>(std::frexp(samples, &window_bits));  // samples < 2^window_bits
    const int bits = (std::min)(31, 48 - window_bits);
    const auto fits = [bits](double extent, int step) {
        return extent * power_of_two(-step) + 4 <= power_of_two(bits);
    };
    const double range = static_cast<double>(largest) - static_cast<double>(least);
    static_cast<void>(std::frexp(static_cast<double>(least), &exponent));
    exponent = (std::max)(exponent - digits, finest);
    bool exact = exponent > finest;
    if (!fits(range, exponent)) {
        static_cast<void>(std::frexp(range, &exponent));
        exponent -= bits;
        if (!fits(range, exponent)) ++exponent;
        exact = false;
    }
    fixed.step = power_of_two(exponent);
    fixed.per_step = power_of_two(-exponent);
    fixed.offset = std::floor(static_cast<double>(least) * fixed.per_step);
    fixed.exact_from = exact ? 0 : fixed.step * power_of_two(digits - 1);
    fixed.shift = 63 - window_bits;
    // By Popoviciu's inequality the squares about the mean sum up to at most samples · range² / 4.
    const double steps = range * fixed.per_step + 4;
    fixed.wide = outliers || !exact || samples * steps * steps > 0x1.fp65;
    return fixed;
}

template <int N, int by, class L, int... I>
[[nodiscard]] NOOK_INLINE L earlier_lanes(L lanes, std::integer_sequence<int, I...>)
{
    L zero{};
#if defined(__clang__)
    return __builtin_shufflevector(zero, lanes, (I < by ? I : N + I - by)...);
#elif defined(__GNUC__)
    return __builtin_shuffle(zero, lanes, Lanes<std::int64_t, N>{(I < by ? I : N + I - by)...});
#else
    return lanes;
#endif
}
/// Lane i becomes the sum of lanes 0 … i.
template <int N>
[[nodiscard]] NOOK_INLINE Lanes<std::uint64_t, N> running_sum(Lanes<std::uint64_t, N> lanes)
{
    constexpr auto indices = std::make_integer_sequence<int, N>{};
    if constexpr (N > 1) lanes += earlier_lanes<N, 1>(lanes, indices);
    if constexpr (N > 2) lanes += earlier_lanes<N, 2>(lanes, indices);
    if constexpr (N > 4) lanes += earlier_lanes<N, 4>(lanes, indices);
    return lanes;
}
template <int N>
[[nodiscard]] NOOK_INLINE std::uint64_t last_lane(const Lanes<std::uint64_t, N>& lanes)
{
    if constexpr (N == 1) return lanes;
    else return lanes[N - 1];
}

template <int N, bool masked, bool wide, class Distance>
void add_table_row(const FixedPoint& fixed, const Distance* distances, int count,
                   const TableRow& above, const TableRow& row)
{
    using Whole = Lanes<std::uint64_t, N>;
    // 2⁵² more than the whole number: it then stands in the low bits of the double. The product is
    // exact, so that the one addition rounds, contracted or not.
    const double bias = 0x1p52 - fixed.offset;
    Whole sum{}, squares{}, marks{}, background{};
    for (int i = 0; i < count; i += N) {
        const auto distance = convert<double>(load<N>(distances + i));
        const Lanes<double, N> biased = distance * fixed.per_step + bias;
        Whole steps = std::bit_cast<Whole>(biased) & 0x7fffffffu;
        const Whole one = Whole{} + 1u;
        if constexpr (masked) steps = distance > 0.0 ? steps : Whole{};
        if constexpr (wide) {
            const auto outlier = (distance < fixed.least) | (distance > fixed.largest);
            steps = outlier ? Whole{} : steps;
            const auto flawed =
                (fixed.outliers ? outlier : distance < fixed.exact_from) & (distance > 0.0);
            const Whole square = (steps * steps) >> fixed.shift;
            const Whole mark = square << 32 | (flawed ? one : Whole{});
            const Whole run = running_sum<N>(mark) + marks;
            marks = Whole{} + last_lane<N>(run);
            store(row.marks + i, load<N>(above.marks + i) + run);
        }
        const Whole sum_run = running_sum<N>(steps) + sum;
        sum = Whole{} + last_lane<N>(sum_run);
        store(row.sum + i, load<N>(above.sum + i) + sum_run);
        const Whole square_run = running_sum<N>(steps * steps) + squares;
        squares = Whole{} + last_lane<N>(square_run);
        store(row.squares + i, load<N>(above.squares + i) + square_run);
        if constexpr (masked) {
            const Whole run = running_sum<N>(distance > 0.0 ? Whole{} : one) + background;
            background = Whole{} + last_lane<N>(run);
            store(row.background + i, load<N>(above.background + i) + run);
        }
    }
}

template <int N, class L, int... I>
[[nodiscard]] NOOK_INLINE L even_lanes(L low, L high, std::integer_sequence<int, I...>)
{
#if defined(__clang__)
    return __builtin_shufflevector(low, high, (2 * I)...);
#elif defined(__GNUC__)
    return __builtin_shuffle(low, high, Lanes<std::int64_t, N>{(2 * I)...});
#else
    return low;
#endif
}

template <int N, class T>
[[nodiscard]] NOOK_INLINE Lanes<T, N> load_corners(const T* row, Corners corners)
{
    const T* const at = row + corners.first;
    if constexpr (N == 1) return *at;
    else if (corners.stride == 1) [[likely]] return load<N>(at);
    else if (corners.stride == 0) return Lanes<T, N>{} + *at;
    else return even_lanes<N>(load<N>(at), load<N>(at + N), std::make_integer_sequence<int, N>{});
}

template <int N, bool masked, bool wide>
NOOK_INLINE TableSums<N> window_sums(const TableRow& top, const TableRow& bottom, Corners left,
                                     Corners right)
{
    const auto window = [&](const auto* above, const auto* below) NOOK_INLINE_LAMBDA {
        return (load_corners<N>(below, right) - load_corners<N>(above, right)) -
               (load_corners<N>(below, left) - load_corners<N>(above, left));
    };
    TableSums<N> sums{};
    sums.sum = window(top.sum, bottom.sum);
    sums.squares = window(top.squares, bottom.squares);
    if constexpr (wide) sums.marks = window(top.marks, bottom.marks);
    if constexpr (masked) sums.background = window(top.background, bottom.background);
    return sums;
}

/// Whole numbers below 2^bits as doubles; rounded from 2⁵³ on. Without the usual constant 2⁵²,
/// whose subtraction -ffast-math may move.
template <int N, int bits>
[[nodiscard]] NOOK_INLINE Lanes<double, N> to_double(const Lanes<std::uint64_t, N>& whole)
{
#if !defined(__AVX512DQ__)
    if constexpr (N > 1) {
        const auto part = [](const Lanes<std::uint64_t, N>& few_bits) NOOK_INLINE_LAMBDA {
            return convert<double>(convert<std::int32_t>(few_bits));
        };
        if constexpr (bits <= 31) return part(whole);
        else if constexpr (bits <= 55) return part(whole >> 24) * 0x1p24 + part(whole & 0xffffffu);
        else
            return part(whole >> 40) * 0x1p40 +
                   (part(whole >> 16 & 0xffffffu) * 0x1p16 + part(whole & 0xffffu));
    }
#endif
    return convert<double>(whole);
}
/// Doubles in (−2⁵¹, 2⁵¹), rounded to whole numbers modulo 2⁶⁴.
template <int N>
[[nodiscard]] NOOK_INLINE Lanes<std::uint64_t, N> to_whole(const Lanes<double, N>& value)
{
    constexpr double shift = 0x1.8p52;  // the number then stands in the low bits
    return std::bit_cast<Lanes<std::uint64_t, N>>(value + shift) -
           std::bit_cast<std::uint64_t>(shift);
}

template <int N, bool masked, bool wide, class Slack>
NOOK_INLINE TableMoments<N> table_moments(const FixedPoint& fixed, const TableSums<N>& sums,
                                          const Lanes<double, N>& distance,
                                          const Lanes<double, N>& area,
                                          const Lanes<double, N>& per_area, const Slack& slack)
{
    using Real = Lanes<double, N>;
    using Whole = Lanes<std::uint64_t, N>;
    TableMoments<N> moments;
    Real count = area, per_count = per_area;
    if constexpr (masked) {
        moments.background = to_double<N, 31>(sums.background);
        count = larger(area - moments.background, Real{} + 1.0);
        per_count = 1.0 / count;
    }
    moments.count = count;

    // Squares about p, the whole number next to the mean: S2 − p (2 S1 − n p) modulo 2⁶⁴.
    const Real sum = to_double<N, 48>(sums.sum);
    const Whole whole_pivot = to_whole<N>(sum * per_count);
    const Real pivot = to_double<N, 31>(whole_pivot);
    const Real left_over = sum - count * pivot;  // exact: both are whole and below 2⁵³
    const Whole whole_squares = sums.squares - whole_pivot * (sums.sum + to_whole<N>(left_over));
    Real squares;
    if constexpr (wide) {
        // S2 >> shift, short of it by less than n, tells which multiple of 2⁶⁴ is missing. The
        // squares about p are known modulo 2^(32 + shift), which is twice their largest value.
        const double unit = power_of_two(fixed.shift), per_unit = power_of_two(-fixed.shift);
        const Real taken = pivot * (sum + left_over) * per_unit;
        const Whole coarse = (sums.marks >> 32) + 0x40000000u - to_whole<N>(taken);
        const Real about = (to_double<N, 32>(coarse & 0xffffffffu) - 0x1p30 + 0.5 * count) * unit;
        const Real low = to_double<N, 64>(whole_squares);
        const Whole wraps = to_whole<N>(larger((about - low) * 0x1p-64, Real{}));
        squares = low + to_double<N, 31>(wraps) * 0x1p64;
    } else {
        squares = to_double<N, 64>(whole_squares);
    }
    const double square_step = fixed.step * fixed.step;
    const Real m2 = larger(squares - left_over * left_over * per_count, Real{});
    moments.variance = m2 * per_count * square_step;
    const Real steps = fenced(distance * fixed.per_step - fixed.offset);
    moments.deviation = (fenced(steps - pivot) - left_over * per_count) * fixed.step;
    if constexpr (wide) {
        // A rounded sample is wrong by half a step at most: the mean by half a step, the variance
        // σ² by σ steps and a quarter. With v = variance + slack the visibility v / (v + d²)
        // changes by at most |dv| / (4 v) + 0.65 |dd| / √v, below 10⁻⁵ from √v = 57600 steps on.
        const auto certain = moments.variance + slack(distance) >= 57600.0 * 57600.0 * square_step;
        const Real flaws = to_double<N, 31>(sums.marks & 0xffffffffu);
        const bool rounded = fixed.exact_from > 0;
        if (fixed.outliers) moments.doubt = flaws + (certain ? Real{} : Real{} + double(rounded));
        else moments.doubt = certain ? Real{} : flaws;
    }
    return moments;
}

}  // namespace nook::inline NOOK_TARGET::detail
