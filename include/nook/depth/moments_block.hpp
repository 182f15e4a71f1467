#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/depth/left_out.hpp>
#include <nook/depth/moments_strip.hpp>
#include <nook/depth/moments_sums.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/depth/window.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Box moments in constant time per pixel, in one pass over the image.
///
/// An axis is cut into blocks of less than k samples; the windows that begin in a block are a suffix
/// of it and a prefix of what follows (van Herk 1992, Gil & Werman 1993, with sums for maxima). Both
/// grow by one sample at a time and never shrink: no subtraction, no drift. All sums are taken about
/// the distance of one surface sample of the window itself, the last of its block, so that relief far
/// smaller than the distance keeps its variance and no sample changes a window that it is not in.
/// Every rounding depends on the position alone, so any cut into tasks gives the same bits.
///
/// Columns first: a strip keeps the suffixes of one block of rows, and each new row turns into the
/// moments of the columns of its windows, which never leave the cache. Rows follow at once. For that
/// the columns of a strip are dealt to the lanes in runs, lane l taking columns l·L … l·L + L − 1:
/// then a step along the row is the same instruction for all lanes, and a window that leaves a lane
/// goes on in the next.
///
/// Windows that shrink at the border are prefixes or suffixes of the whole axis. Rows without
/// background need no counts; with background the same sums are formed in the same order, so a window
/// has the same bits whichever way its row was filtered.
template <class Distance, int lanes = native_lanes>
class BlockMoments {
public:
    BlockMoments(int width, int height, int window, Border border)
        : width_{width},
          height_{height},
          window_{window},
          radius_{window / 2},
          border_{border},
          across_{axis(width)},
          down_{axis(height)},
          slots_{(std::min)(window, height)}
    {
        // Short blocks of rows have few suffixes to keep; the whole blocks between suffix and prefix
        // cost one more addition per sample.
        constexpr int longest = 40;
        const int reach = (std::max)(1, window - 1);
        block_ = reach / pieces(reach, longest);
        shared_blocks_ = reach / block_ - 1;
        if (down_.interior == 0) {
            block_ = 1;
            shared_blocks_ = 0;
        }
        // A strip reads k − 1 columns more than it delivers. It is as wide as a core's own cache
        // allows.
        const std::size_t column =
            sizeof(Distance) * static_cast<std::size_t>(slots_) +
            sizeof(double) * static_cast<std::size_t>(2 * block_ + 4 * shared_blocks_) + 150;
        const int fitting = static_cast<int>(cache / column);
        const int wanted = (std::max)({fitting - window + 1, window, 256});
        const int strips =
            window == 1 ? 1 : (std::max)(1, (across_.interior + wanted / 2) / wanted);
        starts_ = pieces(across_.interior, strips);
        strips_ = starts_ > 0 ? pieces(across_.interior, starts_) : 1;
        const int columns = starts_ > 0 ? starts_ + window - 1 : width;
        dealt_ = deal((std::max)(columns, 1));
        steps_ = pieces(dealt_.size * dealt_.blocks, lanes) * lanes;
        constexpr int least_cell = 32;
        cell_ = pieces(least_cell, dealt_.size) * dealt_.size;
        cells_ = (std::max)(1, pieces(starts_, cell_));
        slab_ = pieces(least_cell, block_);
    }

    [[nodiscard]] std::size_t scratch_size(int workers) const
    {
        return task_scratch_size(layout(), workers);
    }

    /// Delivers each pixel once. `consume` has `using Value`, a float or double, and `results`, how
    /// many it wants per pixel; for lanes of pixels
    ///     shade(distance, count, open, variance, deviation, results)
    /// turns the moments (count: surface samples; open: the share of background in the window, or
    /// NoBackground) into results, and
    ///     row(work, y, x, width, results, pitch, distances)
    /// takes them for pixels x … x + width − 1 of row y: result i of a pixel lies i · pitch further on;
    /// distances are 0 for background, whose results mean nothing, and null where there is none.
    /// `work` is the calling worker's own, and their sum is returned.
    ///
    /// A consumer that has `leave_out` need not be given all (left_out.hpp).
    template <class Source, class Consume, class S, class E>
    Outcome run(const Source& source, const Consume& consume, S&& scratch, E&& executor) const
    {
        static_assert(Consume::results <= most_results && sizeof(typename Consume::Value) <= 8);
        // A run of blocks reads k − 1 rows more than it delivers: no more runs than workers need. The
        // bits are the same for any.
        const int workers = static_cast<int>(executor.concurrency());
        const int wanted = workers > 1 ? pieces(4 * (std::min)(workers, 1024), strips_) : 1;
        const int blocks = pieces(down_.interior, block_);
        const int size = (std::max)(pieces(blocks, wanted), pieces(64, block_));
        const auto run_task = [&](Work& work, const Memory& all, int task, int worker) {
            const int strip = window_ == 1 ? 0 : task % strips_, part = task / strips_;
            MomentsStrip<BlockMoments, Source, Consume> mine{
                *this, source, consume, work, all.of(worker, *this), strip};
            if (window_ == 1) mine.single_row(task);
            else if (part == 0) mine.top();
            else if (part == 1) mine.bottom();
            else mine.blocks((part - 2) * size, size);
        };
        const int tasks = window_ == 1 ? height_ : strips_ * (pieces(blocks, size) + 2);
        return run_tasks(tasks, layout(), run_task, scratch, executor);
    }

private:
    template <class, class, class>
    friend class MomentsStrip;
    template <class, class, class>
    friend class MomentsPlan;
    template <class, class, class>
    friend class MomentsRows;

    static constexpr int lane_count = lanes;
    static constexpr int most_results = 4;
    /// Bytes that a strip may keep.
    static constexpr std::size_t cache = 1200 * 1024;

    /// How the windows along an axis of `size` samples fall: `prefixes` that begin at 0, `interior`
    /// ones of k samples, and the rest, which end at the last sample.
    struct Axis {
        int prefixes, interior;
    };
    [[nodiscard]] Axis axis(int size) const
    {
        if (size >= window_) return {radius_, size - window_ + 1};
        return {border_ == Border::symmetric ? (size + 1) / 2 : (std::min)(radius_ + 1, size), 0};
    }
    /// How the columns of every strip are dealt, a narrower last one too: each lane gets `blocks`
    /// blocks of `size`.
    struct Dealt {
        int size, blocks;
    };
    /// Blocks such that what their windows share is soon added up, and few columns are left over.
    [[nodiscard]] Dealt deal(int columns) const
    {
        const int each = pieces(columns, lanes), reach = (std::max)(1, window_ - 1);
        Dealt best{};
        double least = 1e300;
        const int fewest = pieces(each, reach);
        for (int blocks = fewest; blocks <= (std::min)(each, fewest + 16); ++blocks) {
            const int size = pieces(each, blocks), shared = reach - size;
            const double cost = blocks * (8.0 * size + 1.5 * (shared / size + shared % size) + 2);
            if (cost >= least) continue;
            least = cost;
            best = {size, blocks};
        }
        return best;
    }

    /// One worker's memory. Arrays hold `lanes` values a step.
    struct Memory {
        Distance* samples;       ///< a row in the order of its columns
        Distance* ring;          ///< decoded rows; row y lies in slot y % slots_
        Background* background;  ///< of each slot
        Distance* centre;        ///< the pixels that a row of windows is about
        double* suffixes;        ///< per row of a block: sums and sums of squares of the rest of it
        float* suffix_count;     ///< their counts, where there is background
        bool* own_wanted;       ///< per step: its last row has background, so suffixes may be empty
        SumsRow<lanes> prefix;  ///< of the rows after the block, about the block's pivots
        SumsRow<lanes> own;     ///< of the same rows, or of a border's, about the first of them
        SumsRow<lanes> totals;  ///< of the whole blocks that all windows of a block share
        bool* total_holes;
        SumsRow<lanes> columns;  ///< of the columns of a row of windows
        SumsRow<lanes> across;   ///< suffixes of the blocks of a row
        SumsRow<lanes> edge;     ///< windows at the left or right border
        double* edge_area;       ///< samples in them, background and all
        std::byte* results;
        std::byte* natural;   ///< results in the order of their pixels
        ColumnPiece* pieces;  ///< in use, and those that might be
        LeftOut* cells;
        std::uint8_t* marks;  ///< of cells, or of the groups of a work map
        Distance* worst;      ///< of each column, for the search for flat cells

        [[nodiscard]] Memory of(int worker, const BlockMoments& filter) const
        {
            const std::ptrdiff_t row = filter.row_size(), steps = filter.steps_ + 1, at = worker;
            Memory mine = *this;
            mine.samples += at * row;
            mine.ring += at * filter.slots_ * row;
            mine.background += at * filter.slots_;
            mine.centre += at * row;
            mine.suffixes += at * filter.block_ * 2 * row;
            mine.suffix_count += at * filter.block_ * row;
            mine.own_wanted += at * (filter.steps_ + 1);
            for (SumsRow<lanes>* sums : {&mine.prefix, &mine.own, &mine.columns, &mine.across})
                *sums = sums->from(at * steps);
            mine.totals = totals.from(at * steps * filter.shared_blocks_);
            mine.total_holes += at * filter.shared_blocks_;
            mine.edge = edge.from(at * filter.edge_steps());
            mine.edge_area += at * filter.edge_steps() * lanes;
            mine.results += at * filter.result_size();
            mine.natural += at * filter.result_size();
            mine.pieces += at * 2 * filter.cells_;
            mine.cells += at * filter.cells_;
            mine.marks += at * filter.mark_size();
            mine.worst += at * filter.width_;
            return mine;
        }
    };
    /// Values in a row of a strip. A place in the last lane reads up to one step further.
    [[nodiscard]] std::ptrdiff_t row_size() const { return std::ptrdiff_t{steps_ + 1} * lanes; }
    [[nodiscard]] int edge_steps() const
    {
        return pieces(width_ < window_ ? width_ : radius_, lanes) + 1;
    }
    [[nodiscard]] std::ptrdiff_t result_size() const
    {
        return (std::max)(row_size(), std::ptrdiff_t{edge_steps()} * lanes) *
               std::ptrdiff_t{sizeof(double) * most_results};
    }
    [[nodiscard]] std::ptrdiff_t mark_size() const
    {
        return cells_ + std::ptrdiff_t{WorkMap::groups(width_)};
    }
    [[nodiscard]] auto layout() const
    {
        return [this](ScratchLayout& block, std::size_t workers) -> Memory {
            const auto size = [&](std::ptrdiff_t each) {
                return workers * static_cast<std::size_t>(each);
            };
            const auto sums = [&](std::ptrdiff_t steps) {
                return SumsRow<lanes>::take(block, size(steps));
            };
            const std::ptrdiff_t row = row_size(), steps = steps_ + 1;
            return {block.take<Distance>(size(row)),
                    block.take<Distance>(size(row * slots_)),
                    block.take<Background>(size(slots_)),
                    block.take<Distance>(size(row)),
                    block.take<double>(size(row * block_ * 2)),
                    block.take<float>(size(row * block_)),
                    block.take<bool>(size(steps_ + 1)),
                    sums(steps),
                    sums(steps),
                    sums(steps * shared_blocks_),
                    block.take<bool>(size(shared_blocks_)),
                    sums(steps),
                    sums(steps),
                    sums(edge_steps()),
                    block.take<double>(size(std::ptrdiff_t{edge_steps()} * lanes)),
                    block.take<std::byte>(size(result_size())),
                    block.take<std::byte>(size(result_size())),
                    block.take<ColumnPiece>(size(2 * cells_)),
                    block.take<LeftOut>(size(cells_)),
                    block.take<std::uint8_t>(size(mark_size())),
                    block.take<Distance>(size(width_))};
        };
    }

    int width_, height_, window_, radius_;
    Border border_;
    Axis across_, down_;
    int slots_;          ///< rows that a strip keeps: those of a window, or all there are
    int block_;          ///< rows in a block
    int shared_blocks_;  ///< whole blocks after a block that are in all of its windows
    int starts_;         ///< full windows along a row of a strip
    int strips_;
    Dealt dealt_;
    int steps_;  ///< columns of a lane, rounded up to a multiple of the lanes
    int cell_;   ///< windows that are left out together, a number of whole blocks
    int cells_;  ///< in a strip
    int slab_;   ///< blocks of rows that are looked at together
};

}  // namespace nook::inline NOOK_TARGET::detail
