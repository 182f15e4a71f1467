#include <string>
#include <vector>

#include <nook/depth/source.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/rasteriser.hpp>

#include "../scenes/scenes.hpp"
#include "../support/failure.hpp"
#include "../support/picture.hpp"
#include "stability.hpp"

namespace stability {

void write_terrain(const std::filesystem::path& path)
{
    constexpr int columns = 640, rows = 480, window = 31;
    const scenes::Scene scene = scenes::terrain();
    nook::Image<float> depth{columns, rows};
    const nook::Outcome drawn =
        nook::rasterise(scene.mesh(), nook::view_frame(scene.camera),
                        nook::projection(scene.camera, columns, rows), {.depth = depth.view()});
    if (!drawn) throw support::Failure{"the terrain cannot be drawn"};
    // What a buffer holds that was cleared to its far plane, alike for all.
    for (float& distance : depth)
        if (!nook::is_surface(distance, 2e5f)) distance = 2e5f;

    std::vector<support::Picture> pictures;
    std::vector<std::string> captions;
    for (const DepthAlgorithm& algorithm : depth_algorithms()) {
        const std::string& name = algorithm.label.name;
        if (name != "naive-float" && name != "running-float" && name != "nook-float") continue;
        const DepthOutput output = algorithm.run(depth, window);
        support::Picture picture{columns, rows};
        for (int y = window / 2; y < rows - window / 2; ++y)
            for (int x = window / 2; x < columns - window / 2; ++x) {
                const float grey = support::srgb(static_cast<float>(output.visibility(x, y)));
                picture.set(x, y, {grey, grey, grey});
            }
        pictures.push_back(picture);
        captions.push_back(name);
    }
    support::write_png(path, support::strip(pictures, captions));
}

}  // namespace stability
