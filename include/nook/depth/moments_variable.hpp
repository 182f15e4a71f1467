#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/depth/moments_direct.hpp>
#include <nook/depth/moments_table_tile.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Box moments where every pixel has a window of its own size, exact boxes and
/// not two passes of varying length (those do not make a box). Per tile a
/// summed area table of whole numbers (moments_table.hpp), of which a ring of
/// rows is kept: those that the windows of one row of pixels reach. Where
/// neighbours share a radius, their corners are read side by side.
///
/// Sums of whole numbers are exact, so results depend on no order and on no thread. Where the distances
/// of a tile span so many decades that they had to be rounded, each pixel's result is certified by a
/// bound on what that may do to its visibility. Pixels that fail are looked up in a second table, of
/// distances near theirs, once enough of them make it pay; else their windows are read directly. The
/// samples so read are counted in the outcome.
template <class Distance, int lanes = native_lanes>
class VariableMoments {
public:
    /// Largest certified error of the visibility.
    static constexpr double tolerance = 1e-5;

    /// `largest`: the radius that no pixel's window exceeds.
    VariableMoments(int width, int height, WindowRadius largest, Border border)
        : grid_{width, height, largest, border}
    {}

    [[nodiscard]] std::size_t scratch_size(int workers) const
    {
        return task_scratch_size(layout<double>(), workers);
    }

    /// `window.radii(distance)` gives the radii {x, y} of a pixel's window: whole
    /// numbers from 0 to `largest`, no larger at a larger distance.
    /// `window.slack(distance)` gives a variance that the caller will add.
    /// `consume.shade(distance, count, open, variance, deviation, results)` turns
    /// the moments of pixels into `Consume::results` ≤ 4 numbers each: `count`
    /// surface samples, `open` the share of background in the window. These take
    /// lanes, or single doubles.
    ///
    /// `consume.wanted(x, y)` tells whether pixels are worth work, alike for 16
    /// pixels from a multiple of 16 on. Delivers each row of a tile once:
    /// consume.row(work, y, x, width, values, stride, distances) with values of
    /// type `Consume::Value`, result k of pixel x + i at values[k · stride + i].
    /// `distances` are 0 at background, or null where there is none. Results of
    /// background and of unwanted pixels mean nothing.
    template <class Source, class Window, class Consume, class S, class E>
    Outcome run(const Source& source, const Window& window, const Consume& consume, S&& scratch,
                E&& executor) const
    {
        using Value = typename Consume::Value;
        static_assert(Consume::results <= TileMemory<Distance, Value>::most_results);
        const auto run_tile = [&](Work& work, const auto& memory, int task, int worker) {
            TableTile<Distance, lanes, Source, Window, Consume>{grid_,
                                                                source,
                                                                window,
                                                                consume,
                                                                work,
                                                                memory.of(worker, grid_),
                                                                grid_.columns(task),
                                                                grid_.rows(task)}
                .run();
        };
        return run_tasks(grid_.count(), layout<Value>(), run_tile, scratch, executor);
    }

    /// The same for callers that handle one pixel at a time: radius(distance),
    /// slack(distance), wanted(x, y), and consume(work, x, y, distance, moments)
    /// with a distance and a count of 0 at background.
    template <class Source, class Radius, class Slack, class Wanted, class Consume, class S,
              class E>
    Outcome run(const Source& source, const Radius& radius, const Slack& slack,
                const Wanted& wanted, const Consume& consume, S&& scratch, E&& executor) const
    {
        const PixelWindow<Radius, Slack> window{radius, slack};
        return run(source, window, PixelConsume<Wanted, Consume>{wanted, consume}, scratch,
                   executor);
    }

private:
    template <class Radius, class Slack>
    struct PixelWindow {
        const Radius& radius_at;
        const Slack& slack_at;

        template <class Real>
        struct Radii {
            Real x, y;
        };
        template <class Real>
        [[nodiscard]] Radii<Real> radii(const Real& distance) const
        {
            constexpr int count = LanesTraits<Real>::count;
            double at[count], x[count], y[count];
            store(at, distance);
            for (int i = 0; i < count; ++i) {
                const WindowRadius r = radius_at(at[i]);
                x[i] = r.x;
                y[i] = r.y;
            }
            return {load<count>(x), load<count>(y)};
        }
        template <class Real>
        [[nodiscard]] Real slack(const Real& distance) const
        {
            constexpr int count = LanesTraits<Real>::count;
            double at[count];
            store(at, distance);
            for (int i = 0; i < count; ++i) at[i] = slack_at(at[i]);
            return load<count>(at);
        }
    };
    template <class Wanted, class Consume>
    struct PixelConsume {
        using Value = double;
        static constexpr int results = 4;
        const Wanted& wanted_at;
        const Consume& consume;

        template <class Real>
        void shade(const Real& distance, const Real& count, const Real& open, const Real& variance,
                   const Real& deviation, Real* result) const
        {
            result[0] = count + open;  // a whole number and a share below 1
            result[1] = variance;
            result[2] = deviation;
            result[3] = distance;
        }
        [[nodiscard]] bool wanted(int x, int y) const { return wanted_at(x, y); }
        void row(Work& work, int y, int x, int width, const double* values, std::ptrdiff_t stride,
                 const Distance* distances) const
        {
            for (int i = 0; i < width; ++i) {
                WindowMoments<double> moments;
                double distance = 0;
                if (distances == nullptr || distances[i] > 0) {
                    if (wanted_at(x + i, y)) {
                        moments.count = static_cast<std::int32_t>(values[i]);
                        const double open = values[i] - moments.count;
                        moments.background =
                            static_cast<std::int32_t>(moments.count * open / (1 - open) + 0.5);
                        moments.variance = values[stride + i];
                        moments.deviation = values[2 * stride + i];
                        distance = values[3 * stride + i];
                    } else {
                        distance = 1;
                    }
                }
                consume(work, x + i, y, distance, moments);
            }
        }
    };

    template <class Value>
    [[nodiscard]] auto layout() const
    {
        return [this](ScratchLayout& block, std::size_t workers) {
            return TileMemory<Distance, Value>::take(grid_, block, workers);
        };
    }

    TileGrid grid_;
};

}  // namespace nook::inline NOOK_TARGET::detail
