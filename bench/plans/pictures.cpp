#include <algorithm>
#include <string>

#include "common.hpp"
#include "support/colour_map.hpp"
#include "support/files.hpp"
#include "support/picture.hpp"

namespace compare {

void draw_plan(const Options& options, const View& view, const nook::WorkMap& map,
               const std::string& name)
{
    if (options.pictures.empty()) return;
    support::Picture picture{view.width(), view.height()};
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x) {
            if (!view.is_surface(x, y)) {
                picture.set(x, y, {0.05f, 0.07f, 0.12f});
                continue;
            }
            // As if lit from the viewer.
            const float light =
                0.25f + 0.5f * (std::clamp)(view.normals(x, y + 2 * view.height()), 0.0f, 1.0f);
            if (map.is_active(x, y))
                picture.set(x, y, support::sequential(1) * (0.4f + 0.8f * light));
            else picture.set(x, y, support::Rgb{1, 1, 1} * (0.5f * light));
        }
    std::string file;
    for (const char c : name)
        if (c != ' ' && c != '%' && c != ',') file += c;
    support::write_png(options.pictures / (file + ".png"), picture);
}

}  // namespace compare
