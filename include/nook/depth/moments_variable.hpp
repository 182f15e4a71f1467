#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/depth/moments_direct.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// The radius of a window in pixels, per axis.
struct WindowRadius {
    int x, y;
};

/// Box moments where every pixel has a window of its own size, exact boxes and not two passes of
/// varying length (those do not make a box). Per tile: a summed area table (Crow 1984) in double about
/// one of the tile's distances, four look-ups per pixel. Differences of table entries cancel, so each
/// pixel's result is certified by a bound on the table's rounding; where the bound is too large for
/// the pixel's variance (beside spikes, or relief that is tiny beside the tile's), the window is read
/// directly. The samples so read are counted in the outcome.
template <class Distance>
class VariableMoments {
public:
    static constexpr int tile = 64;
    /// Largest certified error of variance + slack, relative to it. Visibility errs by less.
    static constexpr double tolerance = 1e-5;

    /// `largest`: the radius that no pixel's window exceeds.
    VariableMoments(int width, int height, WindowRadius largest, Border border)
        : width_{width},
          height_{height},
          border_{border},
          largest_{(std::min)(largest.x, width), (std::min)(largest.y, height)},
          tiles_across_{pieces(width, tile)},
          tiles_down_{pieces(height, tile)},
          table_width_{(std::min)(width, tile + 2 * largest_.x) + 1},
          table_height_{(std::min)(height, tile + 2 * largest_.y) + 1}
    {}

    [[nodiscard]] std::size_t scratch_size(int workers) const
    {
        return task_scratch_size(layout(), workers);
    }

    /// radius(distance) gives a pixel's window; slack(distance) a variance that the caller will add;
    /// wanted(x, y) whether the pixel is. Delivers every pixel once, the unwanted and the background
    /// with a count of 0: consume(work, x, y, distance, moments).
    template <class Source, class Radius, class Slack, class Wanted, class Consume, class S,
              class E>
    Outcome run(const Source& source, const Radius& radius, const Slack& slack,
                const Wanted& wanted, const Consume& consume, S&& scratch, E&& executor) const
    {
        const auto run_tile = [&](Work& work, const Memory& all, int task, int worker) {
            const Span columns = tile_span(task % tiles_across_, width_);
            const Span rows = tile_span(task / tiles_across_, height_);
            const Table table = make_table(all, worker, source, columns, rows, radius, wanted);
            for (int y = rows.first; y <= rows.last; ++y)
                for (int x = columns.first; x <= columns.last; ++x) {
                    const Distance distance = surface_distance(source, x, y);
                    WindowMoments<double> moments;
                    if (distance > 0 && wanted(x, y)) {
                        const WindowRadius reach = radius(distance);
                        const Span across = window_span(x, reach.x, width_, border_);
                        const Span down = window_span(y, reach.y, height_, border_);
                        if (!table.look_up(distance, across, down, slack(distance), moments)) {
                            moments = direct_moments<double>(source, distance, across, down);
                            work.samples += static_cast<std::uint64_t>(samples_in(across, down));
                        }
                    }
                    consume(work, x, y, distance, moments);
                }
        };
        return run_tasks(tiles_across_ * tiles_down_, layout(), run_tile, scratch, executor);
    }

private:
    struct Memory {
        std::int32_t* count;
        double* sum;
        double* squares;
    };
    [[nodiscard]] std::ptrdiff_t table_size() const
    {
        return std::ptrdiff_t{table_width_} * table_height_;
    }
    [[nodiscard]] auto layout() const
    {
        return [this](ScratchLayout& block, std::size_t workers) -> Memory {
            const std::size_t size = workers * static_cast<std::size_t>(table_size());
            return {block.take<std::int32_t>(size), block.take<double>(size),
                    block.take<double>(size)};
        };
    }
    [[nodiscard]] static Span tile_span(int index, int size)
    {
        return {index * tile, (std::min)(size, (index + 1) * tile) - 1};
    }

    /// Sums over [x0, x) × [y0, y) of the region, at ((y − y0) · stride + x − x0).
    struct Table {
        std::int32_t* count;
        double* sum;
        double* squares;
        int x0, y0;
        std::ptrdiff_t stride;
        double pivot;
        double error;  ///< bound on the rounding of a window's sum of squares about its mean

        /// False when the table cannot vouch for the result.
        [[nodiscard]] bool look_up(Distance distance, Span across, Span down, double slack,
                                   WindowMoments<double>& moments) const
        {
            const std::ptrdiff_t top = (down.first - y0) * stride,
                                 bottom = (down.last + 1 - y0) * stride;
            const std::ptrdiff_t left = across.first - x0, right = across.last + 1 - x0;
            const auto window = [&](const auto* table) {
                return (table[bottom + right] - table[top + right]) -
                       (table[bottom + left] - table[top + left]);
            };
            moments.count = window(count);
            moments.background = samples_in(across, down) - moments.count;
            const double samples = moments.count;
            const double total = window(sum);
            const double mean = total / samples;
            const double m2 = (std::max)(window(squares) - total * mean, 0.0);
            moments.variance = m2 / samples;
            moments.deviation = (static_cast<double>(distance) - pivot) - mean;
            return error <= tolerance * (m2 + samples * slack);
        }
    };

    template <class Source, class Radius, class Wanted>
    [[nodiscard]] Table make_table(const Memory& all, int worker, const Source& source,
                                   Span columns, Span rows, const Radius& radius,
                                   const Wanted& wanted) const
    {
        // From all surface pixels, wanted or not, so that the bits of one do not depend on another's
        // being wanted.
        WindowRadius reach{0, 0};
        Distance pivot = 0;
        bool any = false;
        for (int y = rows.first; y <= rows.last; ++y)
            for (int x = columns.first; x <= columns.last; ++x) {
                const Distance distance = surface_distance(source, x, y);
                if (!(distance > 0)) continue;
                any = any || wanted(x, y);
                if (!(pivot > 0)) pivot = distance;
                const WindowRadius own = radius(distance);
                reach = {(std::max)(reach.x, own.x), (std::max)(reach.y, own.y)};
            }
        const std::ptrdiff_t at = worker * table_size();
        const int x0 = (std::max)(0, columns.first - reach.x);
        const int x1 = (std::min)(width_, columns.last + reach.x + 1);
        const int y0 = (std::max)(0, rows.first - reach.y);
        const int y1 = (std::min)(height_, rows.last + reach.y + 1);
        Table table{all.count + at,
                    all.sum + at,
                    all.squares + at,
                    x0,
                    y0,
                    x1 - x0 + 1,
                    static_cast<double>(pivot),
                    0};
        if (!any) return table;

        std::fill_n(table.count, table.stride, 0);
        std::fill_n(table.sum, table.stride, 0.0);
        std::fill_n(table.squares, table.stride, 0.0);
        double largest = 0;
        for (int y = y0; y < y1; ++y) {
            const std::ptrdiff_t above = (y - y0) * table.stride, row = above + table.stride;
            table.count[row] = 0;
            table.sum[row] = table.squares[row] = 0;
            std::int32_t count = 0;
            double sum = 0, squares = 0;
            for (int x = x0; x < x1; ++x) {
                const Distance distance = surface_distance(source, x, y);
                if (distance > 0) {
                    const double difference = static_cast<double>(distance) - table.pivot;
                    ++count;
                    sum += difference;
                    squares += difference * difference;
                    largest = (std::max)(largest, difference < 0 ? -difference : difference);
                }
                const std::ptrdiff_t i = x - x0 + 1;
                table.count[row + i] = table.count[above + i] + count;
                table.sum[row + i] = table.sum[above + i] + sum;
                table.squares[row + i] = table.squares[above + i] + squares;
            }
        }
        // An entry adds at most width + height rounded sums, each below area × largest². A window
        // takes four entries of squares, and the mean's part doubles four entries of sums.
        const double across = x1 - x0, down = y1 - y0;
        table.error = 12 * (across + down) * 0x1p-53 * across * down * largest * largest;
        return table;
    }

    int width_, height_;
    Border border_;
    WindowRadius largest_;
    int tiles_across_, tiles_down_;
    int table_width_, table_height_;
};

}  // namespace nook::inline NOOK_TARGET::detail
