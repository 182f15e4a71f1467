#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/clip.hpp>
#include <nook/scene/outline_raster_keys.hpp>
#include <nook/scene/outline_raster_tiles.hpp>
#include <nook/scene/outline_raster_triangle.hpp>
#include <nook/scene/outline_raster_vertex.hpp>
#include <nook/scene/outline_view.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// What counting, mask and stand-alone AO of outlines share: the shells, drawn band by band against
/// the visible surface.
namespace nook::inline NOOK_TARGET::detail {

/// Rows of a task.
inline constexpr int outline_band = 32;

/// Memory of one drawing. Triangles are sorted into the bands they touch; one that touches more than
/// two is kept once, in the last bin, which all bands look through.
struct OutlineScratch {
    static constexpr int block = 4096;
    struct Rows {
        std::uint16_t first = 1, last = 0;
    };

    /// What a block of triangles found.
    struct Found {
        /// Crossings of the ray through pixel (0, 0): back faces less front faces.
        std::int32_t crossings = 0;
        /// A triangle is missing, or cut so close to the viewer that part of the picture may be.
        bool open = false;
        /// Zero when, as far as the indices tell, every edge has two sides.
        std::uint64_t edges = 0;
    };

    int bands, blocks, tiles;
    std::ptrdiff_t stride;
    float* keys;
    float* nearest;
    float* farthest;
    float* strip_nearest;
    float* strip_farthest;
    OutlineVertex* vertices;
    Rows* rows;
    Found* found;
    /// Per block of triangles and bin: first how many, then where they go.
    std::uint32_t* places;
    /// First reference of each bin.
    std::uint32_t* bins;
    std::uint32_t* references;
    /// Per worker.
    std::int32_t* counts;
    std::int32_t* changes;
    double* distances;
    Work* work;

    OutlineScratch(ScratchLayout& layout, std::size_t vertex_count, std::size_t triangle_count,
                   int width, int height, int workers)
        : bands{pieces(height, outline_band)},
          blocks{static_cast<int>((triangle_count + block - 1) / block)},
          tiles{pieces(width, OutlineTiles::size)},
          stride{pieces(width, WorkMap::group) * std::ptrdiff_t{WorkMap::group} +
                 OutlineBand::padding}
    {
        const auto size = [](auto count) { return static_cast<std::size_t>(count); };
        keys = layout.take<float>(size(stride) * size(height));
        nearest = layout.take<float>(size(bands) * size(tiles));
        farthest = layout.take<float>(size(bands) * size(tiles));
        strip_nearest = layout.take<float>(size(bands) * strips_size());
        strip_farthest = layout.take<float>(size(bands) * strips_size());
        vertices = layout.take<OutlineVertex>(vertex_count);
        rows = layout.take<Rows>(triangle_count);
        found = layout.take<Found>(size(blocks));
        places = layout.take<std::uint32_t>(size(blocks) * size(bands + 1));
        bins = layout.take<std::uint32_t>(size(bands + 2));
        references = layout.take<std::uint32_t>(2 * triangle_count);
        counts = layout.take<std::int32_t>(size(workers) * band_size());
        changes = layout.take<std::int32_t>(size(workers) * band_size());
        distances = layout.take<double>(size(workers) * size(stride));
        work = layout.take<Work>(size(workers));
    }
    [[nodiscard]] OutlineTiles tiles_of(int band) const
    {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(band) * tiles;
        const std::size_t strips_at = static_cast<std::size_t>(band) * strips_size();
        return {nearest + at, farthest + at, strip_nearest + strips_at, strip_farthest + strips_at,
                tiles + OutlineTiles::padding};
    }
    /// Tiles of the strips of a band.
    [[nodiscard]] std::size_t strips_size() const
    {
        return static_cast<std::size_t>(tiles + OutlineTiles::padding) *
               (outline_band / OutlineTiles::strip);
    }
    [[nodiscard]] std::size_t band_size() const
    {
        return static_cast<std::size_t>(stride) * outline_band;
    }
};

/// The bins of a triangle: one or two neighbours, or the last one.
struct OutlineBins {
    int first, last;

    OutlineBins(const OutlineScratch::Rows& rows, int bands)
        : first{rows.first / outline_band},
          last{rows.last / outline_band}
    {
        if (rows.last < rows.first) last = first - 1;
        else if (last > first + 1) first = last = bands;
    }
};

/// Adds to a sum that is 0 when each directed edge is cancelled by one of the opposite direction: a
/// cubic form of scrambled indices, odd under exchange.
[[nodiscard]] constexpr std::uint64_t edge_sum(const std::uint32_t* indices)
{
    const auto scrambled = [](std::uint32_t index) {
        std::uint64_t x = (std::uint64_t{index} + 1) * 0x9e3779b97f4a7c15u;
        x = (x ^ (x >> 32)) * 0xd6e8feb86659fd93u;
        return x ^ (x >> 32);
    };
    const std::uint64_t a = scrambled(indices[0]), b = scrambled(indices[1]),
                        c = scrambled(indices[2]);
    const auto cube = [](std::uint64_t x) { return x * x * x; };
    return cube(a - b) + cube(b - c) + cube(c - a);
}

class OutlineRasteriser {
public:
    OutlineRasteriser(const OutlineView& shells, double extent, const ViewFrame& frame,
                      const Projection& projection, double near_plane, bool in_front, int width,
                      int height, const OutlineScratch& scratch)
        : shells_{shells},
          transform_{shells, extent, frame, projection, near_plane},
          width_{width},
          height_{height},
          scratch_{scratch},
          in_front_{in_front}
    {
        const Frame axes{frame};
        mirrored_ = dot(cross(axes.right, axes.up), axes.back) < 0;
    }

    void transform(std::size_t first, std::size_t last) const
    {
        transform_.transform(first, last, scratch_.vertices);
    }

    /// Finds the rows of the triangles of a block and counts those of each bin.
    void find_rows(int block, std::size_t first, std::size_t last) const
    {
        std::uint32_t* const places = block_places(block);
        for (int bin = 0; bin <= scratch_.bands; ++bin) places[bin] = 0;
        OutlineScratch::Found found = {};
        for (std::size_t t = first; t < last; ++t) {
            const OutlineScratch::Rows rows = rows_of(t, found);
            scratch_.rows[t] = rows;
            const OutlineBins bins{rows, scratch_.bands};
            for (int bin = bins.first; bin <= bins.last; ++bin) ++places[bin];
        }
        scratch_.found[block] = found;
    }
    /// Where each block puts its references to each bin.
    void find_places() const
    {
        std::uint32_t place = 0;
        for (int bin = 0; bin <= scratch_.bands; ++bin) {
            scratch_.bins[bin] = place;
            for (int block = 0; block < scratch_.blocks; ++block) {
                std::uint32_t& at = block_places(block)[bin];
                const std::uint32_t count = at;
                at = place;
                place += count;
            }
        }
        scratch_.bins[scratch_.bands + 1] = place;
    }
    void fill_bins(int block, std::size_t first, std::size_t last) const
    {
        std::uint32_t* const places = block_places(block);
        for (std::size_t t = first; t < last; ++t) {
            const OutlineBins bins{scratch_.rows[t], scratch_.bands};
            for (int bin = bins.first; bin <= bins.last; ++bin)
                scratch_.references[places[bin]++] = static_cast<std::uint32_t>(t);
        }
    }

    /// Counts the rows of a band.
    void draw(int index, const OutlineBand& band) const
    {
        const std::size_t size = static_cast<std::size_t>(band.stride) *
                                 static_cast<std::size_t>(band.bottom - band.top + 1);
        std::fill_n(band.counts, size, 0);
        std::fill_n(band.changes, size, 0);
        for (const int bin : {index, scratch_.bands}) {
            for (std::uint32_t i = scratch_.bins[bin]; i < scratch_.bins[bin + 1]; ++i) {
                const std::uint32_t t = scratch_.references[i];
                const OutlineScratch::Rows& rows = scratch_.rows[t];
                if (rows.first <= band.bottom && rows.last >= band.top) draw_triangle(t, band);
            }
        }
    }

private:
    [[nodiscard]] std::uint32_t* block_places(int block) const
    {
        return scratch_.places + static_cast<std::ptrdiff_t>(block) * (scratch_.bands + 1);
    }
    [[nodiscard]] const OutlineVertex& corner(std::size_t t, int i) const
    {
        return scratch_.vertices[shells_.indices[3 * t + static_cast<std::size_t>(i)]];
    }
    [[nodiscard]] bool is_front(const OutlineTriangle& triangle) const
    {
        return (triangle.facing() > 0) != mirrored_;
    }

    /// The rows of the pixel centres inside the box of a triangle; none when it counts nowhere.
    [[nodiscard]] OutlineScratch::Rows rows_of(std::size_t t, OutlineScratch::Found& found) const
    {
        const OutlineVertex &a = corner(t, 0), &b = corner(t, 1), &c = corner(t, 2);
        const std::int32_t some = a.outside | b.outside | c.outside;
        if (some == 0) return rows_of(a, b, c, found);
        if ((some & OutlineVertex::no_number) != 0) {
            found.open = true;
            return {};
        }
        if ((a.outside & b.outside & c.outside) != 0) return {};
        const OutlineTransform::Polygon polygon = transform_.clipped(shells_.indices + 3 * t);
        found.open = found.open || polygon.close;
        OutlineScratch::Rows rows{};
        for (int i = 2; i < polygon.count; ++i) {
            const OutlineScratch::Rows more =
                rows_of(polygon.corners[0], polygon.corners[i - 1], polygon.corners[i], found);
            if (more.first > more.last) continue;
            if (rows.first > rows.last) rows = more;
            rows.first = smaller(rows.first, more.first);
            rows.last = larger(rows.last, more.last);
        }
        return rows;
    }
    [[nodiscard]] OutlineScratch::Rows rows_of(const OutlineVertex& a, const OutlineVertex& b,
                                               const OutlineVertex& c,
                                               OutlineScratch::Found& found) const
    {
        OutlineBox box{a, b, c};
        box.cut(width_, 0, height_ - 1);
        if (box.empty()) return {};
        if (box.left == 0 && box.top == 0) {
            const OutlineTriangle triangle{a, b, c};
            if (triangle.covers(0, 0)) found.crossings += is_front(triangle) ? -1 : 1;
        }
        const int first = box.top / outline_band, last = box.bottom / outline_band;
        if (last <= first + 1 && box.right - box.left < 4 * OutlineTiles::size) {
            OutlineRange visible = scratch_.tiles_of(first).range(box.left, box.right);
            if (last > first) {
                const OutlineRange more = scratch_.tiles_of(last).range(box.left, box.right);
                visible.nearest = larger(visible.nearest, more.nearest);
                visible.farthest = smaller(visible.farthest, more.farthest);
            }
            if (visible.nearest < visible.farthest) return {};
            if (in_front_ ? larger(larger(a.key, b.key), c.key) < visible.farthest
                          : smaller(smaller(a.key, b.key), c.key) >= visible.nearest)
                return {};
        }
        return {static_cast<std::uint16_t>(box.top), static_cast<std::uint16_t>(box.bottom)};
    }

    void draw_triangle(std::size_t t, const OutlineBand& band) const
    {
        const OutlineVertex &a = corner(t, 0), &b = corner(t, 1), &c = corner(t, 2);
        if ((a.outside | b.outside | c.outside) == 0) {
            draw_triangle(a, b, c, band);
            return;
        }
        const OutlineTransform::Polygon polygon = transform_.clipped(shells_.indices + 3 * t);
        for (int i = 2; i < polygon.count; ++i)
            draw_triangle(polygon.corners[0], polygon.corners[i - 1], polygon.corners[i], band);
    }
    void draw_triangle(const OutlineVertex& a, const OutlineVertex& b, const OutlineVertex& c,
                       const OutlineBand& band) const
    {
        OutlineBox box{a, b, c};
        box.cut(width_, band.top, band.bottom);
        const OutlineTriangle triangle{a, b, c};
        if (box.empty() || triangle.empty()) return;
        const int step = is_front(triangle) == in_front_ ? 1 : -1;
        if (in_front_) triangle.count<true>(band, box, step);
        else triangle.count<false>(band, box, step);
    }

    OutlineView shells_;
    OutlineTransform transform_;
    int width_, height_;
    OutlineScratch scratch_;
    bool in_front_, mirrored_ = false;
};

/// Checks pointers, counts, indices and the extent.
[[nodiscard]] inline Error check_shells(const OutlineView& shells, double extent)
{
    if (const Error error =
            check_at_least(extent, 0, "extent", "a finite distance >= 0 in world units"))
        return error;
    if (shells.triangle_count == 0) return {};
    // In 32 bits a triangle may be referred to twice.
    if (shells.triangle_count > 0x7fffffff)
        return {ErrorCode::bad_size, "shells.triangle_count", double(shells.triangle_count),
                "at most 2^31 - 1 triangles"};
    if (shells.indices == nullptr)
        return {ErrorCode::null_data, "shells.indices", 0, "three indices per triangle"};
    if (shells.base == nullptr && shells.vertex_count > 0)
        return {ErrorCode::null_data, "shells.base", 0, "three floats per vertex"};
    if (shells.direction == nullptr && shells.vertex_count > 0)
        return {ErrorCode::null_data, "shells.direction", 0, "three floats per vertex"};
    std::uint32_t largest_index = 0;
    for (std::size_t i = 0; i < 3 * shells.triangle_count; ++i)
        largest_index = larger(largest_index, shells.indices[i]);
    if (largest_index >= shells.vertex_count)
        return {ErrorCode::index_out_of_range, "shells.indices", double(largest_index),
                "indices below shells.vertex_count"};
    return {};
}

template <class Stored, class Decode>
[[nodiscard]] Error check_outline(const OutlineView& shells, double extent,
                                  const DepthSource<Stored, Decode>& source, const ViewFrame& frame,
                                  const Projection& projection)
{
    if (const Error error = check_source(source)) return error;
    if (source.image.width > largest_raster_size)
        return {ErrorCode::bad_size, "depth", double(source.image.width),
                "a width of at most 32768"};
    if (source.image.height > largest_raster_size)
        return {ErrorCode::bad_size, "depth", double(source.image.height),
                "a height of at most 32768"};
    if (const Error error = check_projection(projection)) return error;
    if (const Error error = check_frame(frame)) return error;
    return check_shells(shells, extent);
}

/// Draws the shells and calls finish(work, band) for each band once its counts are complete. `scratch`
/// is laid out for them.
template <class Stored, class Decode, class Finish, class E>
Work draw_outlines(const OutlineView& shells, double extent,
                   const DepthSource<Stored, Decode>& source, const ViewFrame& frame,
                   const Projection& projection, const OutlineScratch& scratch,
                   const Finish& finish, E&& executor)
{
    using Distance = typename DepthSource<Stored, Decode>::Distance;
    const int width = source.image.width, height = source.image.height;
    const int workers = static_cast<int>(executor.concurrency());
    for (int worker = 0; worker < workers; ++worker) scratch.work[worker] = {};
    const float none = background_key(projection.orthographic);
    const auto band_of = [&](int task, int worker) {
        const int top = task * outline_band;
        const std::size_t at = static_cast<std::size_t>(worker) * scratch.band_size();
        return OutlineBand{width,
                           top,
                           smaller(top + outline_band, height) - 1,
                           scratch.stride,
                           scratch.counts + at,
                           scratch.changes + at,
                           scratch.keys + top * scratch.stride,
                           scratch.tiles_of(task)};
    };

    executor.for_each(scratch.bands, [&](int task, int worker) {
        const OutlineBand band = band_of(task, worker);
        auto* const distances =
            reinterpret_cast<Distance*>(scratch.distances + worker * scratch.stride);
        for (int y = band.top; y <= band.bottom; ++y) {
            float* const keys = scratch.keys + y * scratch.stride;
            find_keys(source, projection.orthographic, y, distances, keys);
            for (std::ptrdiff_t x = width; x < scratch.stride; ++x) keys[x] = none;
        }
        constexpr int size = OutlineTiles::size, strip = OutlineTiles::strip;
        for (int y = band.top; y <= band.bottom; y += strip)
            for (int tile = 0; tile < scratch.tiles; ++tile)
                band.tiles.add(tile, (y - band.top) / strip,
                               scratch.keys + y * scratch.stride + tile * size, scratch.stride,
                               smaller(strip, band.bottom - y + 1), none);
    });
    float nearest = none;
    for (int tile = 0; tile < scratch.bands * scratch.tiles; ++tile)
        nearest = larger(nearest, scratch.nearest[tile]);

    const auto in_blocks = [&](std::size_t count, const auto& f) {
        constexpr std::size_t step = OutlineScratch::block;
        executor.for_each(static_cast<int>((count + step - 1) / step), [&](int task, int) {
            const std::size_t first = static_cast<std::size_t>(task) * step;
            f(task, first, (std::min)(first + step, count));
        });
    };
    const std::size_t triangles = nearest > none ? shells.triangle_count : 0;
    // Every ray crosses closed shells equally often in all, wherever it leads, as long as none of them
    // is cut away: counting in front gives what counting behind does, less the crossings of any one
    // ray, and leaves out what is hidden.
    in_blocks(triangles, [&](int block, auto first, auto last) {
        std::uint64_t edges = 0;
        for (std::size_t t = first; t < last; ++t) edges += edge_sum(shells.indices + 3 * t);
        scratch.found[block].edges = edges;
    });
    std::uint64_t edges = 0;
    for (int block = 0; triangles > 0 && block < scratch.blocks; ++block)
        edges += scratch.found[block].edges;
    bool in_front = edges == 0;
    std::int32_t start = 0;
    const auto rasteriser_of = [&] {
        // Nothing before the nearest surface counts behind it. Rays of an orthographic view have no
        // beginning.
        const double near_plane = projection.orthographic ? -0x1p1000
                                  : nearest > none ? (in_front ? 0x1p-20 : 0.5) / double{nearest}
                                                   : outline_reach;
        return OutlineRasteriser{shells,   extent, frame,  projection, near_plane,
                                 in_front, width,  height, scratch};
    };
    OutlineRasteriser rasteriser = rasteriser_of();
    const auto prepare = [&] {
        in_blocks(shells.vertex_count,
                  [&](int, auto first, auto last) { rasteriser.transform(first, last); });
        in_blocks(triangles, [&](int block, auto first, auto last) {
            rasteriser.find_rows(block, first, last);
        });
        bool open = false;
        start = 0;
        for (int block = 0; block < scratch.blocks; ++block) {
            open = open || scratch.found[block].open;
            start += scratch.found[block].crossings;
        }
        return !open;
    };
    if (triangles == 0) {
        std::fill_n(scratch.bins, scratch.bands + 2, 0u);
    } else {
        if (!prepare() && in_front) {
            in_front = false;
            rasteriser = rasteriser_of();
            static_cast<void>(prepare());
        }
        if (!in_front) start = 0;
        rasteriser.find_places();
        in_blocks(triangles, [&](int block, auto first, auto last) {
            rasteriser.fill_bins(block, first, last);
        });
    }
    executor.for_each(scratch.bands, [&](int task, int worker) {
        const OutlineBand band = band_of(task, worker);
        rasteriser.draw(task, band);
        band.settle(start);
        finish(scratch.work[worker], band);
    });
    Work work{};
    for (int worker = 0; worker < workers; ++worker) work += scratch.work[worker];
    work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    work.passes = 1;
    return work;
}

}  // namespace nook::inline NOOK_TARGET::detail
