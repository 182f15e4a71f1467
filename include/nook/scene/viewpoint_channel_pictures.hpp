#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/viewpoint_channel_pages.hpp>
#include <nook/scene/viewpoint_channel_rows.hpp>
#include <nook/scene/visible_counts.hpp>
#include <nook/scratch.hpp>

/// The rows of a viewpoint channel from pictures of a mesh.
namespace nook::inline NOOK_TARGET::detail {

/// Draws the views one after another and turns what they see into rows.
///
/// Polygons are cut into blocks. Each view appends to the log of every block how many words it adds, and
/// for each polygon that it sees a word with the polygon's index in the block above the count: as many
/// words as the rows need. When all views are drawn, block after block is sorted into rows elsewhere and
/// written back to the pages that its log and those before it leave.
class ChannelPictures {
public:
    ChannelPictures(const MeshView& mesh, const Camera* views, std::size_t view_count,
                    int resolution, const VisibleCountOptions& options, const double* importance)
        : mesh_{mesh},
          views_{views},
          view_count_{view_count},
          resolution_{resolution},
          options_{options},
          importance_{importance},
          blocks_{mesh.triangle_count, (std::max)(std::size_t{ChannelBlocks::most},
                                                  (mesh.triangle_count + 0xffff) >> 16)}
    {}

    /// `rows` comes with its counts of views and polygons and leaves complete up to probabilities.
    template <class E>
    [[nodiscard]] Outcome fill(ChannelRows& rows, ChannelMemory& kept, const Memory& memory,
                               E& executor)
    {
        Outcome outcome{};
        Block logs;
        std::size_t lacking = allocate_arrays(
            kept.arrays, memory, [&](ScratchLayout& arrays) { rows.take_arrays(arrays, true); });
        if (lacking == 0)
            lacking = allocate_arrays(logs, memory, [&](ScratchLayout& arrays) {
                logs_ = arrays.take<Log>(static_cast<std::size_t>(blocks_.count));
            });
        if (lacking == 0) {
            page_words_ = page_words();
            kept.pages = ChannelPages{memory, page_words_ * sizeof(std::uint32_t)};
            lacking = draw(rows, kept.pages, memory, outcome, executor);
        }
        if (lacking == 0 && outcome) lacking = sort(rows, kept, memory);
        if (lacking != 0) outcome.error = channel_out_of_memory(lacking);
        if (!outcome) return {outcome.error};
        rows.log_table[0] = 0;
        for (std::uint32_t i = 1; i < ChannelRows::log_table_size; ++i)
            rows.log_table[i] = std::log2(double(i));
        return outcome;
    }

private:
    /// What the views have said about one block of polygons.
    struct Log {
        /// The first page, the one that is being written, and the last one.
        std::uint32_t first = ChannelPage::none, page = ChannelPage::none, last = ChannelPage::none;
        /// Words on the page that is being written, and room from there on.
        std::size_t at = 0, room = 0;
        /// What the last view adds.
        std::size_t words = 0, entries = 0;
        std::uint64_t area = 0;
    };
    /// Goes through the words of a list of pages.
    struct Cursor {
        const ChannelPages& pages;
        std::size_t page_words;
        std::uint32_t page;
        std::size_t at;

        [[nodiscard]] std::uint32_t& next()
        {
            if (at == page_words) {
                page = pages[page].next;
                at = 0;
            }
            return pages[page].words()[at++];
        }
    };

    [[nodiscard]] bool wanted(std::size_t v) const
    {
        return importance_ == nullptr || importance_[v] > 0;
    }
    /// A power of two: some sixteen pages to a log, if all pixels show something else.
    [[nodiscard]] std::size_t page_words() const
    {
        const std::size_t pixels = static_cast<std::size_t>(resolution_) *
                                   static_cast<std::size_t>(resolution_) *
                                   (options_.levels != nullptr ? 16 : 1);
        const std::size_t entries = view_count_ * (std::min)(pixels, mesh_.triangle_count);
        const std::size_t logs = static_cast<std::size_t>((std::max)(blocks_.count, 1));
        return std::clamp(std::bit_floor(entries / (16 * logs)), std::size_t{256},
                          std::size_t{1} << 16);
    }

    /// Draws all views into the logs; rows.first[o + 1] becomes the end of row o.
    template <class E>
    [[nodiscard]] std::size_t draw(ChannelRows& rows, ChannelPages& pages, const Memory& memory,
                                   Outcome& outcome, E& executor)
    {
        Block block;
        std::byte* space = nullptr;
        const std::size_t scratch_size = visible_counts_scratch_size(
            mesh_, resolution_, resolution_, static_cast<int>(executor.concurrency()));
        if (const std::size_t lacking = allocate_arrays(block, memory, [&](ScratchLayout& arrays) {
                counts_ = arrays.take<std::uint32_t>(rows.polygon_count);
                space = arrays.take<std::byte>(scratch_size);
            }))
            return lacking;
        const Scratch scratch{space, scratch_size};
        std::fill(rows.first, rows.first + rows.polygon_count + 1, std::uint64_t{0});
        std::fill(logs_, logs_ + blocks_.count, Log{});
        for (std::size_t v = 0; v < view_count_; ++v) {
            rows.view_area[v] = 0;
            if (!wanted(v)) continue;
            const Outcome drawn = count_visible(
                mesh_, view_frame(views_[v]), projection(views_[v], resolution_, resolution_),
                resolution_, resolution_, counts_, options_, scratch, executor);
            outcome.work += drawn.work;
            if ((outcome.error = drawn.error)) return 0;
            executor.for_each(blocks_.count, [&](int task, int) { measure(rows, task); });
            std::uint64_t area = 0;
            for (int task = 0; task < blocks_.count; ++task) {
                area += logs_[task].area;
                rows.entry_count += logs_[task].entries;
                if (!make_room(logs_[task], pages)) return page_words_ * sizeof(std::uint32_t);
            }
            rows.view_area[v] = static_cast<double>(area);
            executor.for_each(blocks_.count, [&](int task, int) { append(pages, task); });
        }
        for (std::size_t o = 0; o < rows.polygon_count; ++o) rows.first[o + 1] += rows.first[o];
        return 0;
    }
    void measure(ChannelRows& rows, int task) const
    {
        std::uint64_t area = 0;
        std::size_t entries = 0, longer = 0;
        for (std::size_t o = blocks_.begin(task); o < blocks_.end(task); ++o) {
            const std::uint32_t count = counts_[o];
            const std::uint32_t seen = count != 0 ? 1 : 0, twice = count > 0xffff ? 1 : 0;
            area += count;
            entries += seen;
            longer += twice;
            rows.first[o + 1] += seen + twice;
        }
        logs_[task].words = entries + longer;
        logs_[task].entries = entries;
        logs_[task].area = area;
    }
    [[nodiscard]] bool make_room(Log& log, ChannelPages& pages) const
    {
        while (log.room < log.words + 1) {
            const std::uint32_t page = pages.add();
            if (page == ChannelPage::none) return false;
            if (log.first == ChannelPage::none) log.first = log.page = page;
            else pages[log.last].next = page;
            log.last = page;
            log.room += page_words_;
        }
        return true;
    }
    void append(const ChannelPages& pages, int task) const
    {
        Log& log = logs_[task];
        Cursor to{pages, page_words_, log.page, log.at};
        to.next() = static_cast<std::uint32_t>(log.words);
        const std::size_t begin = blocks_.begin(task), end = blocks_.end(task);
        for (std::size_t o = begin; o < end; ++o) {
            const std::uint32_t count = counts_[o];
            if (count == 0) continue;
            const std::uint32_t polygon = static_cast<std::uint32_t>(o - begin) << 16;
            to.next() = polygon | (count & 0xffff);
            if (count > 0xffff) to.next() = polygon | count >> 16;
        }
        log.page = to.page;
        log.at = to.at;
        log.room -= log.words + 1;
    }

    /// Turns the logs into rows, on the same pages.
    [[nodiscard]] std::size_t sort(ChannelRows& rows, ChannelMemory& kept,
                                   const Memory& memory) const
    {
        ChannelPages& pages = kept.pages;
        std::size_t most = 0;
        for (int task = 0; task < blocks_.count; ++task)
            most =
                (std::max)(most, rows.first[blocks_.end(task)] - rows.first[blocks_.begin(task)]);
        std::uint32_t* sorted = nullptr;
        Block block;
        std::size_t lacking = allocate_arrays(block, memory, [&](ScratchLayout& arrays) {
            sorted = arrays.take<std::uint32_t>(most);
        });
        if (lacking == 0)
            lacking = allocate_arrays(kept.entries, memory, [&](ScratchLayout& arrays) {
                rows.pages = arrays.take<std::uint32_t*>(pages.count());
            });
        if (lacking != 0) return lacking;
        const std::uint64_t words = rows.first[rows.polygon_count];
        const std::size_t used = (words + page_words_ - 1) / page_words_;
        rows.page_shift = std::countr_zero(page_words_);
        std::size_t page = 0;
        for (int task = 0; task < blocks_.count; ++task) {
            const std::uint64_t begin = rows.first[blocks_.begin(task)];
            const std::uint64_t size = rows.first[blocks_.end(task)] - begin;
            sort_log(rows, pages, task, sorted);
            for (std::uint32_t i = logs_[task].first; i != ChannelPage::none; i = pages[i].next) {
                if (page < used) rows.pages[page++] = pages[i].words();
                else pages.release(i);
            }
            for (std::uint64_t i = 0; i < size;) {
                const std::uint64_t at = begin + i, room = page_words_ - at % page_words_;
                const std::uint64_t part = (std::min)(room, size - i);
                std::copy(sorted + i, sorted + i + part,
                          rows.pages[at >> rows.page_shift] + at % page_words_);
                i += part;
            }
        }
        // Rows have moved on to their ends.
        for (std::size_t o = rows.polygon_count; o > 0; --o) rows.first[o] = rows.first[o - 1];
        rows.first[0] = 0;
        return 0;
    }
    void sort_log(const ChannelRows& rows, const ChannelPages& pages, int task,
                  std::uint32_t* sorted) const
    {
        std::uint64_t* const first = rows.first + blocks_.begin(task);
        const std::uint64_t begin = first[0];
        Cursor from{pages, page_words_, logs_[task].first, 0};
        for (std::size_t v = 0; v < view_count_; ++v) {
            if (!wanted(v)) continue;
            const std::uint32_t view = static_cast<std::uint32_t>(v) << 16;
            for (std::uint32_t left = from.next(); left > 0; --left) {
                const std::uint32_t word = from.next();
                sorted[first[word >> 16]++ - begin] = view | (word & 0xffff);
            }
        }
    }

    const MeshView& mesh_;
    const Camera* views_;
    std::size_t view_count_;
    int resolution_;
    VisibleCountOptions options_;
    const double* importance_;
    ChannelBlocks blocks_;
    std::size_t page_words_ = 0;
    Log* logs_ = nullptr;
    std::uint32_t* counts_ = nullptr;
};

}  // namespace nook::inline NOOK_TARGET::detail
