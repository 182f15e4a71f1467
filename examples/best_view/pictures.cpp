#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>

#include "../support/checked.hpp"

namespace best_view {

using support::Picture;
using support::Rgb;

Picture draw(const scenes::Scene& scene, const nook::Camera& camera, int size,
             const std::vector<Rgb>& colours, nook::ThreadExecutor& threads)
{
    // Drawn at twice the size: smooth edges.
    const int fine = 2 * size;
    nook::Image<float> depth{fine, fine}, normals{3 * fine, fine};
    nook::Image<std::uint32_t> faces{fine, fine};
    support::checked(
        nook::rasterise(scene.mesh(), nook::view_frame(camera),
                        nook::projection(camera, fine, fine),
                        {depth.view(),
                         nook::ImageView3<float>::interleaved(normals.data(), fine, fine, 3 * fine),
                         faces.view()},
                        {}, nook::HeapScratch{}, threads),
        "rasterise");
    const std::vector<Rgb>& albedo = colours.empty() ? scene.albedo : colours;
    Picture picture{fine, fine};
    for (int y = 0; y < fine; ++y)
        for (int x = 0; x < fine; ++x) {
            const std::uint32_t face = faces(x, y);
            if (face == nook::no_face) continue;
            const float nx = normals(3 * x, y), ny = normals(3 * x + 1, y),
                        nz = normals(3 * x + 2, y);
            const float sun = (std::max)(-0.36f * nx + 0.48f * ny + 0.8f * nz, 0.0f);
            const float sky = 0.65f + 0.35f * ny;
            const Rgb own = albedo.empty() ? Rgb{0.6f, 0.6f, 0.6f} : albedo[face];
            picture.set(x, y, support::srgb(own * (0.8f * sun + 0.35f * sky)));
        }
    return support::halved(picture);
}

Picture contact_sheet(const std::vector<Tile>& tiles, const std::string& title)
{
    constexpr int gap = 10, scale = 2;
    constexpr int line = support::text_height(scale) + 4, top = line + 2 * gap;
    int width = support::text_width(title, scale) - gap, height = 0, lines = 0;
    int tile_width = 1;
    for (const Tile& tile : tiles) {
        tile_width = (std::max)(tile_width, tile.picture.width());
        height = (std::max)(height, tile.picture.height());
        lines = (std::max)(lines, static_cast<int>(tile.caption.size()));
        for (const std::string& text : tile.caption)
            tile_width = (std::max)(tile_width, support::text_width(text, scale));
    }
    const int count = static_cast<int>(tiles.size());
    // About square; and full rows where that is as square.
    int columns = (std::max)(static_cast<int>(std::ceil(std::sqrt(1.4 * count))), 1);
    if (const int rows = (count + columns - 1) / columns; rows > 0)
        columns = (count + rows - 1) / rows;
    const int rows = (count + columns - 1) / columns;
    const int cell = height + lines * line + gap;
    width = (std::max)(width, columns * (tile_width + gap) - gap);
    // Grey, so that white pictures show where they end.
    Picture sheet{width + 2 * gap, top + rows * cell, {0.85f, 0.85f, 0.85f}};
    support::draw_text(sheet, gap, gap, title, scale);
    for (int i = 0; i < count; ++i) {
        const Tile& tile = tiles[static_cast<std::size_t>(i)];
        const int x = gap + i % columns * (tile_width + gap), y = top + i / columns * cell;
        sheet.paste(tile.picture, x, y);
        int text = y + height + 4;
        for (const std::string& words : tile.caption) {
            support::draw_text(sheet, x, text, words, scale);
            text += line;
        }
    }
    return sheet;
}

}  // namespace best_view
