#pragma once

#include <string>
#include <vector>

#include <nook/scene/camera.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/picture.hpp"
#include "../support/rgb.hpp"

namespace best_view {

/// The scene as a camera sees it, size × size pixels, with a light at the viewer's shoulder. `colours`:
/// linear light, one per triangle, or empty: those of the scene.
[[nodiscard]] support::Picture draw(const scenes::Scene& scene, const nook::Camera& camera,
                                    int size, const std::vector<support::Rgb>& colours,
                                    nook::ThreadExecutor& threads);

/// A picture with what stands below it.
struct Tile {
    support::Picture picture;
    std::vector<std::string> caption;
};

/// All tiles in rows, below a title.
[[nodiscard]] support::Picture contact_sheet(const std::vector<Tile>& tiles,
                                             const std::string& title);

}  // namespace best_view
