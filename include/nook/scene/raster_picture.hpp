#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/raster_bins.hpp>
#include <nook/scene/raster_tile.hpp>
#include <nook/scene/raster_vertex.hpp>

/// Draws a picture tile by tile.
namespace nook::inline NOOK_TARGET::detail {

class RasterPicture {
public:
    RasterPicture(const RasterView& view, const RasterScratch& scratch, RasterSides sides,
                  RasterSize tile)
        : view_{view},
          bins_{view.width(), view.height(), tile},
          scratch_{scratch},
          sides_{sides},
          tile_{tile}
    {}

    /// Sorts the triangles into bins. `finest` tells how finely they may be sampled: 2^finest samples
    /// to a pixel and side.
    template <class E>
    void sort(int finest, E&& executor)
    {
        const MeshView& mesh = view_.mesh();
        const auto in_blocks = [&](std::size_t count, std::size_t size, const auto& f) {
            executor.for_each(static_cast<int>((count + size - 1) / size), [&](int block, int) {
                const std::size_t first = static_cast<std::size_t>(block) * size;
                f(block, first, smaller(first + size, count));
            });
        };
        const auto in_triangles = [&](const auto& f) {
            in_blocks(mesh.triangle_count, scratch_.block_size, f);
        };
        in_blocks(mesh.triangle_count > 0 ? mesh.vertex_count : 0, RasterScratch::vertex_block,
                  [&](int, std::size_t first, std::size_t last) {
                      view_.transform(first, last, scratch_.vertices);
                  });
        for (;;) {
            RasterSorter sorter{view_, bins_, scratch_, sides_, finest};
            in_triangles([&](int block, std::size_t first, std::size_t last) {
                sorter.find(block, first, last);
            });
            const RasterSize larger_size{2 * bins_.size.across, 2 * bins_.size.down};
            if (!sorter.find_limit() && larger_size.across <= 8 * tile_.across) {
                // No room for the triangles at the borders of bins: larger bins have fewer of them.
                bins_ = {view_.width(), view_.height(), larger_size};
                continue;
            }
            in_triangles([&](int block, std::size_t first, std::size_t last) {
                sorter.count(block, first, last);
            });
            sorter.find_places();
            in_triangles([&](int block, std::size_t first, std::size_t last) {
                sorter.fill(block, first, last);
            });
            return;
        }
    }

    [[nodiscard]] int bins() const { return bins_.count(); }
    /// Calls f(t) for the triangles of a bin, in order.
    template <class F>
    void for_triangles(int bin, const F& f) const
    {
        const std::uint32_t* at = scratch_.references + scratch_.bins[bin];
        const std::uint32_t* const end = scratch_.references + scratch_.bins[bin + 1];
        const int many = bins_.count();
        const std::uint32_t* wide = scratch_.references + scratch_.bins[many];
        const std::uint32_t* const wide_end = scratch_.references + scratch_.bins[many + 1];
        for (; wide != wide_end; ++wide) {
            if (!touches(*wide, bin)) continue;
            for (; at != end && *at < *wide; ++at) f(*at);
            f(*wide);
        }
        for (; at != end; ++at) f(*at);
    }
    /// Calls f(box) for the tiles of a bin, in pixels.
    template <class F>
    void for_tiles(int bin, const F& f) const
    {
        const int left = bin % bins_.across * bins_.size.across;
        const int top = bin / bins_.across * bins_.size.down;
        const int right = smaller(left + bins_.size.across, view_.width());
        const int bottom = smaller(top + bins_.size.down, view_.height());
        for (int y = top; y < bottom; y += tile_.down)
            for (int x = left; x < right; x += tile_.across)
                f(RasterBox{x, smaller(x + tile_.across, right) - 1, y,
                            smaller(y + tile_.down, bottom) - 1});
    }
    /// Draws the triangles of a bin into a tile of samples: those of `box`, 2^level to a pixel.
    template <class Tile>
    [[nodiscard]] Tile draw(int bin, const RasterTileMemory& memory, const RasterBox& box,
                            int level) const
    {
        Tile tile{view_, scratch_.vertices, memory, box, sides_, level};
        const std::uint32_t* const indices = view_.mesh().indices;
        const std::uint32_t* const end = scratch_.references + scratch_.bins[bin + 1];
        for_triangles(bin, [&](const std::uint32_t& t) {
            constexpr int ahead = 24;
            if (end - &t > ahead) prefetch(indices + 3 * std::size_t{(&t)[ahead]});
            tile.draw(t);
        });
        tile.finish();
        return tile;
    }

private:
    [[nodiscard]] bool touches(std::uint32_t t, int bin) const
    {
        const std::uint32_t code = scratch_.codes[t];
        const int first = static_cast<int>(code & 0x3ff);
        const int right = bin % bins_.across - first % bins_.across;
        const int below = bin / bins_.across - first / bins_.across;
        return right >= 0 && right <= static_cast<int>(code >> 10 & 0x7ff) && below >= 0 &&
               below <= static_cast<int>(code >> 21);
    }

    const RasterView& view_;
    RasterBins bins_;
    RasterScratch scratch_;
    RasterSides sides_;
    RasterSize tile_;
};

}  // namespace nook::inline NOOK_TARGET::detail
