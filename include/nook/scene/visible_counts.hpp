#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/clip.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/raster_bins.hpp>
#include <nook/scene/raster_picture.hpp>
#include <nook/scene/raster_tile.hpp>
#include <nook/scene/raster_vertex.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// What becomes of triangles seen from behind: their corners run clockwise in the picture. A mirrored
/// frame turns it round.
enum class BackFaces : std::uint8_t {
    counted,    ///< as front faces
    occluding,  ///< drawn; they hide what is behind them and count for nobody
    /// Not drawn: without levels the same as `occluding` for closed meshes seen from outside, and faster.
    left_out,
};

/// The largest level of a triangle: 2² × 2² samples to a pixel.
inline constexpr int finest_level = 2;

struct VisibleCountOptions {
    BackFaces back_faces = BackFaces::occluding;
    /// Leave out what is nearer than this distance along the view axis, ≥ 0, as RasteriseOptions.
    double near_plane = 0;
    /// One per triangle, 0 … `finest_level`, or null for 0: how finely it wants to be sampled, with
    /// 2^level × 2^level samples to a pixel. The picture is drawn in tiles, each at the highest level of
    /// the triangles that may show in it: squares of 32 pixels (of 64 beyond 1024 × 1024 pixels in all,
    /// and so on; or where the references of triangles to several tiles run out of room). Larger
    /// values are taken as `finest_level`.
    const std::uint8_t* levels = nullptr;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Counts for each triangle the samples that show it: the histogram of the faces that `rasterise`
/// draws, without a picture. Without levels a sample is a pixel and counts 1. With levels samples are
/// finer where triangles ask for it, and one counts 4^(finest_level − level of its tile): all counts
/// are in units of the finest sample, 16 to a pixel, whatever the levels.
///
/// `counts` has room for mesh.triangle_count numbers, which are overwritten. The picture is width ×
/// height pixels, each 0 … 32768, with levels less than 2²⁸ in all; an empty one counts 0. Scratch:
/// `visible_counts_scratch_size`. Tasks are blocks of the mesh and tiles; the counts do not depend on
/// the executor. work.pixels = width · height, work.samples the samples drawn, work.background what
/// shows no triangle, or one that counts for nobody, in the unit of the counts: with it they add up to
/// all there is.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome visible_counts(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                       int width, int height, std::uint32_t* counts,
                       const VisibleCountOptions& options = {}, S&& scratch = S{},
                       E&& executor = E{});

/// Bytes of scratch that `visible_counts` asks for: 16 per vertex, 8 per triangle, a quarter of a
/// megabyte, and 145 KB per worker.
[[nodiscard]] std::size_t visible_counts_scratch_size(const MeshView& mesh, int width, int height,
                                                      int workers);

namespace detail {

/// Memory of one call: that of the bins, and a tile for each worker.
struct VisibleScratch {
    /// Pixels of a tile with levels and without, and the most samples of one.
    static constexpr RasterSize fine_tile{32, 32}, tile{64, 64};
    static constexpr RasterSize samples{fine_tile.across << finest_level,
                                        fine_tile.down << finest_level};

    RasterScratch sorted;
    RasterTileMemory* tiles;

    VisibleScratch(ScratchLayout& layout, const MeshView& mesh, int workers)
        : sorted{layout, mesh, 1},
          tiles{layout.take<RasterTileMemory>(static_cast<std::size_t>(workers))}
    {
        constexpr std::size_t slopes = samples.across + RasterTileMemory::padding;
        for (int worker = 0; worker < workers; ++worker) {
            const RasterTileMemory memory{
                samples,
                layout.take<std::int32_t>(RasterTileMemory::samples(samples)),
                layout.take<std::uint32_t>(RasterTileMemory::samples(samples)),
                layout.take<double>(slopes),
                layout.take<double>(slopes),
            };
            if (tiles != nullptr) tiles[worker] = memory;
        }
    }
};

/// `visible_counts` for callers who have checked mesh, projection, frame and options.
template <ScratchSource S, Executor E>
Outcome count_visible(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                      int width, int height, std::uint32_t* counts,
                      const VisibleCountOptions& options, S&& scratch, E&& executor);

template <bool orthographic, class E>
Work draw_counts(const RasterPicture& picture, const VisibleScratch& parts, std::uint32_t* counts,
                 const VisibleCountOptions& options, E&& executor)
{
    using Tile = RasterTile<orthographic, true>;
    const bool alone = static_cast<int>(executor.concurrency()) == 1;
    std::atomic<std::uint64_t> samples{0}, background{0};
    executor.for_each(picture.bins(), [&](int bin, int worker) {
        int level = 0;
        if (options.levels != nullptr)
            picture.for_triangles(bin, [&](std::uint32_t t) {
                level = larger(level, smaller(int{options.levels[t]}, finest_level));
            });
        const std::uint32_t weight =
            options.levels != nullptr ? 1u << (2 * (finest_level - level)) : 1;
        std::uint64_t drawn = 0, shown = 0;
        picture.for_tiles(bin, [&](const RasterBox& box) {
            const RasterBox fine{box.left << level, ((box.right + 1) << level) - 1,
                                 box.top << level, ((box.bottom + 1) << level) - 1};
            const Tile tile = picture.draw<Tile>(bin, parts.tiles[worker], fine, level);
            const int across = fine.right - fine.left + 1, down = fine.bottom - fine.top + 1;
            drawn += static_cast<std::uint64_t>(across) * static_cast<std::uint64_t>(down);
            for (int y = 0; y < down; ++y) {
                const std::uint32_t* const ids = tile.ids(y);
                for (int x = 0; x < across; ++x) {
                    if (ids[x] == no_face) continue;
                    ++shown;
                    if (alone) {
                        counts[ids[x]] += weight;
                    } else {
                        std::uint32_t times = weight;
                        for (; x + 1 < across && ids[x + 1] == ids[x]; ++x, ++shown)
                            times += weight;
                        std::atomic_ref{counts[ids[x]]}.fetch_add(times, std::memory_order_relaxed);
                    }
                }
            }
        });
        samples.fetch_add(drawn, std::memory_order_relaxed);
        background.fetch_add((drawn - shown) * weight, std::memory_order_relaxed);
    });
    Work work{};
    work.samples = samples.load(std::memory_order_relaxed);
    work.background = background.load(std::memory_order_relaxed);
    return work;
}

template <ScratchSource S, Executor E>
Outcome count_visible(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                      int width, int height, std::uint32_t* counts,
                      const VisibleCountOptions& options, S&& scratch, E&& executor)
{
    const int workers = static_cast<int>(executor.concurrency());
    const std::size_t size = visible_counts_scratch_size(mesh, width, height, workers);
    void* const block = scratch.reserve(size);
    if (block == nullptr) return {check_scratch<S>(size)};
    ScratchLayout layout{block};
    const VisibleScratch parts{layout, mesh, workers};
    constexpr std::size_t step = std::size_t{1} << 16;
    executor.for_each(static_cast<int>((mesh.triangle_count + step - 1) / step), [&](int task,
                                                                                     int) {
        const std::size_t first = static_cast<std::size_t>(task) * step;
        std::fill_n(counts + first, smaller(step, mesh.triangle_count - first), std::uint32_t{0});
    });
    Outcome outcome{};
    if (width == 0 || height == 0) return outcome;
    const RasterView view{mesh,  frame,  projection,
                          width, height, raster_near_plane(options.near_plane, projection)};
    RasterSides sides{};
    sides.nameless = options.back_faces == BackFaces::occluding;
    if (options.back_faces == BackFaces::left_out)
        (view.mirrored() ? sides.counter_clockwise : sides.clockwise) = false;
    RasterPicture picture{
        view, parts.sorted, sides,
        options.levels != nullptr ? VisibleScratch::fine_tile : VisibleScratch::tile};
    picture.sort(options.levels != nullptr ? finest_level : 0, executor);
    outcome.work = projection.orthographic
                       ? draw_counts<true>(picture, parts, counts, options, executor)
                       : draw_counts<false>(picture, parts, counts, options, executor);
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

[[nodiscard]] inline Error check_picture_size(int width, int height)
{
    if (width < 0 || width > largest_raster_size)
        return {ErrorCode::bad_size, "width", double(width), "a width of 0 to 32768"};
    if (height < 0 || height > largest_raster_size)
        return {ErrorCode::bad_size, "height", double(height), "a height of 0 to 32768"};
    return {};
}

}  // namespace detail

inline std::size_t visible_counts_scratch_size(const MeshView& mesh, [[maybe_unused]] int width,
                                               [[maybe_unused]] int height, int workers)
{
    detail::ScratchLayout layout;
    static_cast<void>(detail::VisibleScratch{layout, mesh, workers});
    return layout.size();
}

template <ScratchSource S, Executor E>
Outcome visible_counts(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                       int width, int height, std::uint32_t* counts,
                       const VisibleCountOptions& options, S&& scratch, E&& executor)
{
    Outcome outcome{};
    if ((outcome.error = detail::check_picture_size(width, height))) return outcome;
    if ((outcome.error = detail::check_raster_view(frame, projection, options.near_plane)))
        return outcome;
    if ((outcome.error = check_mesh(mesh))) return outcome;
    constexpr double most_samples = 0x1p32;
    if (options.levels != nullptr && 16.0 * width * height >= most_samples)
        return {{ErrorCode::bad_size, "width", double(width),
                 "a picture of less than 2^28 pixels with levels"}};
    if (counts == nullptr && mesh.triangle_count > 0)
        return {{ErrorCode::null_data, "counts", 0, "one number per triangle"}};
    return detail::count_visible(mesh, frame, projection, width, height, counts, options, scratch,
                                 executor);
}

}  // namespace nook::inline NOOK_TARGET
