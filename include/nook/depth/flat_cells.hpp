#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/target.hpp>

/// Proves of whole cells of pixels, from a look at each sample, that none of their pixels lies behind the
/// mean of its window.
///
/// Seen in perspective a plane has distances q = 1 / w with w = α + β x + γ y, and such a q is convex:
/// q(p + s) + q(p − s) ≥ 2 q(p) (1 + (s · (β, γ) q)²). The mean of a window that is symmetric about p
/// therefore lies behind p by at least κ q, κ = (β² rx (rx + 1) + γ² ry (ry + 1)) / 3 · q². If all samples
/// in reach keep |d w − 1| ≤ τ then no pixel lies behind its mean as long as 2 τ + κ τ < κ: what floats
/// round is far less than what a slanted plane bends.
namespace nook::inline NOOK_TARGET::detail {

/// The least and the largest radii of some windows, before they are cut at the border.
struct ReachOfWindows {
    int least_x, least_y, largest_x, largest_y;
};

template <class Source, int lanes>
class FlatCells {
    using Distance = typename Source::Distance;
    using Bits = std::conditional_t<sizeof(Distance) == 4, std::int32_t, std::int64_t>;
    using Vector = Lanes<Distance, lanes>;

public:
    /// Only rows that can be loaded as they lie are worth a second look.
    template <class Decode>
    static constexpr bool is_plain(const DepthSource<Distance, Decode>*)
    {
        return std::is_same_v<Decode, IdentityDecode>;
    }
    static constexpr bool is_plain(const void*) { return false; }
    static constexpr bool possible = is_plain(static_cast<const Source*>(nullptr));

    /// Cells are pixels of rows `rows`. With `constant_alone` those are looked for that see one distance.
    /// `worst` has an entry for each column that the cells see.
    FlatCells(const Source& source, Span rows, const ReachOfWindows& reach, Border border,
              bool constant_alone, Distance* worst)
        : source_{source},
          rows_{rows},
          seen_{(std::max)(0, rows.first - reach.largest_y),
                (std::min)(source.image.height - 1, rows.last + reach.largest_y)},
          reach_{reach},
          border_{border},
          constant_alone_{constant_alone},
          worst_{worst}
    {}

    /// `cell(i)` tells the columns of cell i, side by side from left to right. open[i] = 0 says that
    /// nothing is to be proved; else it tells afterwards whether it was. Runs of cells shorter than
    /// `least_run` are passed over. Returns how many cells were read.
    template <class Cell>
    int find(const Cell& cell, int count, int least_run, std::uint8_t* open) const
    {
        int tried = 0;
        for (int i = 0; i < count; ++i) {
            Plane plane{};
            open[i] = open[i] != 0 && fit(cell(i), plane) && may_be_open(cell(i), plane);
        }
        for (int i = 0, end = 0; i < count; i = end) {
            for (end = i + 1; end < count && open[end] == open[i];) ++end;
            if (open[i] == 0) continue;
            if (end - i < least_run) {
                std::fill(open + i, open + end, std::uint8_t{0});
                continue;
            }
            tried += end - i;
            prove(cell, i, end, open);
        }
        return tried;
    }

private:
    /// w = `first` + `across` (x − x0) + `down` (y − y0), or a constant distance.
    struct Plane {
        double first, across, down;
        int x, y;
        bool constant;
        Distance distance;

        [[nodiscard]] double at(int to_x, int to_y) const
        {
            return first + across * (to_x - x) + down * (to_y - y);
        }
    };
    [[nodiscard]] const Distance* row(int y) const
    {
        return source_.image.data + y * source_.image.row_stride;
    }
    [[nodiscard]] Span seen(Span columns) const
    {
        return {(std::max)(0, columns.first - reach_.largest_x),
                (std::min)(source_.image.width - 1, columns.last + reach_.largest_x)};
    }
    [[nodiscard]] bool read(int x, int y, double& per_distance) const
    {
        const Distance distance = row(y)[x];
        if (!is_surface(distance, source_.far_limit)) return false;
        per_distance = 1 / static_cast<double>(distance);
        return true;
    }
    /// The plane through three corners of what pixels of these columns see, if the fourth lies on it.
    [[nodiscard]] bool fit(Span columns, Plane& plane) const
    {
        const Span across = seen(columns);
        const int wide = across.last - across.first, tall = seen_.last - seen_.first;
        const int middle_x = across.first + wide / 2, middle_y = seen_.first + tall / 2;
        double corner[2][2]{}, middle = 0;
        if (!read(across.first, seen_.first, corner[0][0]) ||
            !read(across.last, seen_.last, corner[1][1]) || !read(middle_x, middle_y, middle) ||
            !read(across.last, seen_.first, corner[0][1]) ||
            !read(across.first, seen_.last, corner[1][0]))
            return false;
        const double slack = middle * 0x1p-18;
        const auto away = [&](double difference) {
            return difference > slack || difference < -slack;
        };
        if (away(corner[0][0] + corner[1][1] - corner[0][1] - corner[1][0])) return false;
        plane.first = corner[0][0];
        plane.across = wide > 0 ? (corner[0][1] - corner[0][0]) / wide : 0;
        plane.down = tall > 0 ? (corner[1][0] - corner[0][0]) / tall : 0;
        plane.x = across.first;
        plane.y = seen_.first;
        plane.distance = row(seen_.first)[across.first];
        plane.constant = corner[0][0] == corner[0][1] && corner[0][0] == corner[1][0] &&
                         corner[0][0] == corner[1][1] && corner[0][0] == middle;
        return !away(plane.at(middle_x, middle_y) - middle);
    }
    /// The largest w of a plane over what these columns see; 0 where it varies by more than a factor of
    /// 2, on which the rounding of w counts, or might leave the limit of distances.
    [[nodiscard]] double largest_of(Span across, const Plane& plane) const
    {
        double least = plane.at(across.first, seen_.first), largest = least;
        for (const int x : {across.first, across.last})
            for (const int y : {seen_.first, seen_.last}) {
                least = smaller(least, plane.at(x, y));
                largest = larger(largest, plane.at(x, y));
            }
        const bool near_enough = 1.01 / least < static_cast<double>(source_.far_limit);
        return least > 0 && largest <= 2 * least && near_enough ? largest : 0;
    }
    /// The distance from a plane, relative to that of the plane, that pixels of these columns forgive
    /// their windows; ≤ 0: nothing can be proved.
    [[nodiscard]] double tolerance(Span columns, const Plane& plane) const
    {
        const Span across = seen(columns);
        const int width = source_.image.width, height = source_.image.height;
        const int room_x = (std::min)(columns.first, width - 1 - columns.last);
        const int room_y = (std::min)(rows_.first, height - 1 - rows_.last);
        // Clipped windows are symmetric where nothing is clipped.
        if (border_ == Border::clip && (room_x < reach_.largest_x || room_y < reach_.largest_y))
            return 0;
        const double largest = largest_of(across, plane);
        if (!(largest > 0)) return 0;
        const double r_x = (std::min)(reach_.least_x, room_x),
                     r_y = (std::min)(reach_.least_y, room_y);
        const double bend = (plane.across * plane.across * (r_x * (r_x + 1)) +
                             plane.down * plane.down * (r_y * (r_y + 1))) /
                            (3 * largest * largest);
        constexpr double epsilon = std::numeric_limits<Distance>::epsilon();
        // d w − 1 as it is computed: w is rounded three times, its product with d once.
        return (std::min)(bend, 0x1p-8) * (0.5 - 0x1p-7) - 4 * epsilon;
    }
    [[nodiscard]] bool may_be_open(Span columns, const Plane& plane) const
    {
        if (plane.constant) return true;
        return !constant_alone_ &&
               tolerance(columns, plane) > double{std::numeric_limits<Distance>::epsilon()} / 2;
    }

    /// Takes back what cannot be proved of cells [i, end).
    template <class Cell>
    void prove(const Cell& cell, int i, int end, std::uint8_t* open) const
    {
        Plane plane{};
        const Span all{cell(i).first, cell(end - 1).last};
        bool good = fit(all, plane) && (plane.constant || !constant_alone_);
        // One sample of each cell, before all of them.
        const int y = (rows_.first + rows_.last) / 2;
        for (int at = i; good && at < end; ++at) {
            const Span columns = cell(at);
            const int x = (columns.first + columns.last) / 2;
            double per_distance = 0;
            const double expected = plane.at(x, y);
            good = read(x, y, per_distance) && per_distance < expected * (1 + 0x1p-18) &&
                   per_distance > expected * (1 - 0x1p-18) &&
                   (plane.constant || tolerance(columns, plane) > 0);
        }
        if (!good || !(plane.constant || largest_of(seen(all), plane) > 0)) {
            if (end - i == 1) {
                open[i] = 0;
                return;
            }
            const int middle = (i + end) / 2;
            prove(cell, i, middle, open);
            prove(cell, middle, end, open);
            return;
        }
        const Span across = seen(all);
        const int count = across.last - across.first + 1;
        std::fill_n(worst_, count, Distance{0});
        for (int at = seen_.first; at <= seen_.last; ++at)
            if (plane.constant) compare<true>(plane, across.first, count, at);
            else compare<false>(plane, across.first, count, at);
        for (int at = i; at < end; ++at) {
            const Span near_by = seen(cell(at));
            const auto limit =
                plane.constant ? Distance{0} : static_cast<Distance>(tolerance(cell(at), plane));
            const Bits allowed = std::bit_cast<Bits>(limit);
            Bits largest = 0;
            for (int x = near_by.first; x <= near_by.last; ++x)
                largest = larger(largest, std::bit_cast<Bits>(worst_[x - across.first]));
            if (!(plane.constant || limit > 0) || largest > allowed) open[at] = 0;
        }
    }
    /// Notes for each column how far row y lies from the plane. Magnitudes are ordered like their bits,
    /// NaN and infinity above all.
    template <bool constant>
    void compare(const Plane& plane, int x, int count, int y) const
    {
        constexpr Bits magnitude = (std::numeric_limits<Bits>::max)();
        const Distance* const in = row(y) + x;
        const Distance* const next = row((std::min)(y + 1, source_.image.height - 1)) + x;
        const auto slope = static_cast<Distance>(plane.across);
        const auto start = static_cast<Distance>(plane.at(plane.x, y));
        Distance* const worst = worst_;
        Vector at{};
        for (int lane = 0; lane < lanes; ++lane) {
            if constexpr (lanes == 1) at = 0;
            else at[lane] = static_cast<Distance>(lane);
        }
        const auto difference = [&](const auto& distance, const auto& column) NOOK_INLINE_LAMBDA {
            if constexpr (constant) return distance - plane.distance;
            else return distance * (start + slope * column) - Distance{1};
        };
        int i = 0;
        for (; i + lanes <= count; i += lanes) {
            prefetch(next + i);
            const Vector away = difference(load<lanes>(in + i), at);
            at += static_cast<Distance>(lanes);
            const auto bits = std::bit_cast<Lanes<Bits, lanes>>(away) & magnitude;
            const auto before = std::bit_cast<Lanes<Bits, lanes>>(load<lanes>(worst + i));
            store(worst + i, std::bit_cast<Vector>(larger(before, bits)));
        }
        for (; i < count; ++i) {
            const Bits bits =
                std::bit_cast<Bits>(difference(in[i], static_cast<Distance>(i))) & magnitude;
            worst[i] = std::bit_cast<Distance>(larger(std::bit_cast<Bits>(worst[i]), bits));
        }
    }

    const Source& source_;
    Span rows_;  ///< of the cells
    Span seen_;  ///< of their windows
    ReachOfWindows reach_;
    Border border_;
    bool constant_alone_;
    Distance* worst_;
};

}  // namespace nook::inline NOOK_TARGET::detail
