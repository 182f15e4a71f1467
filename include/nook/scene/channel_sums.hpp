#pragma once

#include <algorithm>
#include <cstddef>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/viewpoint_channel_rows.hpp>
#include <nook/scratch.hpp>

/// Loops over the rows of a viewpoint channel, whose sums do not depend on the executor.
namespace nook::inline NOOK_TARGET::detail {

/// Calls f(o) for each polygon, blocks of them in parallel.
template <class F, class E>
void for_each_polygon(const ChannelRows& rows, const F& f, E& executor)
{
    const ChannelBlocks blocks{rows.polygon_count};
    executor.for_each(blocks.count, [&](int block, int) {
        for (std::size_t o = blocks.begin(block); o < blocks.end(block); ++o) f(o);
    });
}

/// Σ_o f(o), blocks of polygons in parallel.
template <class F, class E>
[[nodiscard]] double sum_of_polygons(const ChannelRows& rows, const F& f, E& executor)
{
    const ChannelBlocks blocks{rows.polygon_count};
    double parts[ChannelBlocks::most] = {};
    executor.for_each(blocks.count, [&](int block, int) {
        LongSum sum;
        for (std::size_t o = blocks.begin(block); o < blocks.end(block); ++o) sum.add(f(o));
        parts[block] = sum.total();
    });
    double total = 0;
    for (const double part : parts) total += part;
    return total;
}

/// Sums over polygons for each view: of 1024 polygons at a time, of these over a block, and of blocks.
struct ViewSums {
    /// One sum per view for each block of polygons, and for each worker.
    double *blocks = nullptr, *parts = nullptr;
    /// One number per view, for the caller.
    double* result = nullptr;

    ViewSums(const ChannelRows& rows, int workers, ScratchLayout& arrays)
    {
        const std::size_t count = static_cast<std::size_t>(cut(rows).count);
        blocks = arrays.take<double>(count * rows.view_count);
        parts = arrays.take<double>(static_cast<std::size_t>(workers) * rows.view_count);
        result = arrays.take<double>(rows.view_count);
    }
    [[nodiscard]] static ChannelBlocks cut(const ChannelRows& rows)
    {
        // 2²⁰ sums fill 8 MiB.
        const std::size_t views = (std::max)(rows.view_count, std::size_t{1});
        return ChannelBlocks{rows.polygon_count, (std::min)(std::size_t{ChannelBlocks::most},
                                                            (std::size_t{1} << 20) / views)};
    }
    [[nodiscard]] static std::size_t scratch_size(const ChannelRows& rows, int workers)
    {
        ScratchLayout arrays;
        static_cast<void>(ViewSums{rows, workers, arrays});
        return arrays.size();
    }

    /// Writes to totals[v] what `add(o, sums)` adds to sums[v].
    template <class Add, class E>
    void run(const ChannelRows& rows, double* totals, const Add& add, E& executor) const
    {
        const std::size_t views = rows.view_count;
        const ChannelBlocks polygons = cut(rows);
        executor.for_each(polygons.count, [&](int block, int worker) {
            double* const whole = blocks + static_cast<std::size_t>(block) * views;
            double* const part = parts + static_cast<std::size_t>(worker) * views;
            std::fill(whole, whole + views, 0.0);
            std::fill(part, part + views, 0.0);
            const std::size_t end = polygons.end(block);
            for (std::size_t o = polygons.begin(block); o < end;) {
                const std::size_t stop = (std::min)(o + 1024, end);
                for (; o < stop; ++o) add(o, part);
                for (std::size_t v = 0; v < views; ++v) {
                    whole[v] += part[v];
                    part[v] = 0;
                }
            }
        });
        std::fill(totals, totals + views, 0.0);
        for (int block = 0; block < polygons.count; ++block)
            for (std::size_t v = 0; v < views; ++v)
                totals[v] += blocks[static_cast<std::size_t>(block) * views + v];
    }
};

/// Runs body(sums) with scratch for ViewSums.
template <class S, class E, class Body>
[[nodiscard]] Outcome with_view_sums(const ChannelRows& rows, S& scratch, E& executor,
                                     const Body& body)
{
    const int workers = static_cast<int>(executor.concurrency());
    const std::size_t size = ViewSums::scratch_size(rows, workers);
    void* const data = size == 0 ? nullptr : scratch.reserve(size);
    if (data == nullptr && size != 0) return {check_scratch<S>(size)};
    ScratchLayout arrays{data};
    body(ViewSums{rows, workers, arrays});
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
