#pragma once

#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/picture.hpp"

namespace toon {

/// Where the visibility comes from that the bands are cut from.
enum class Shade {
    information,  ///< polygonal mutual information, normalised and turned
    views,        ///< ambient occlusion from the same views
    alchemy,      ///< ambient obscurance from depth and normals, which reaches as far as the radius
};

struct Options {
    Shade shade = Shade::information;
    int level = 3;         ///< of the icosphere of viewpoints
    int bands = 4;         ///< ≥ 1
    double line = 1.5;     ///< width of the outlines at the middle distance, pixels, ≥ 0
    double darkest = 0.3;  ///< what the first band leaves of the colour, in [0, 1]
};

/// A drawing of the scene as its camera sees it: colours in bands, and outlines. Throws Failure.
[[nodiscard]] support::Picture draw(const scenes::Scene& scene, int width, int height,
                                    const Options& options, nook::ThreadExecutor& threads);

}  // namespace toon
