#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/depth/moments_table_tile.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Box moments where every pixel has a window of its own size: exact boxes, not two passes of varying
/// length (those do not make a box). Per tile a summed area table of whole numbers
/// (moments_table.hpp), of which a ring of rows is kept: those that the windows of one row of pixels
/// reach. Where neighbours share a radius, their corners are read side by side.
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

    /// `window.radii(distance)` gives the radii {x, y} of a pixel's window: whole numbers from 0 to
    /// `largest`, no larger at a larger distance. `window.slack(distance)` gives a variance that the
    /// caller will add. These take lanes, or single doubles.
    ///
    /// `consume` is what BlockMoments::run takes, with `consume.wanted(x, y)` besides: whether pixels
    /// are worth work, alike for 16 pixels from a multiple of 16 on. Results of background and of
    /// unwanted pixels mean nothing.
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

private:
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
