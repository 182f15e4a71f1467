#pragma once

#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/thread_executor.hpp>

#include "../support/progress.hpp"
#include "view.hpp"

namespace report {

/// A picture that parameters are tuned on or judged by.
struct CalibrationView {
    std::string name;  ///< of the scene, and whether its camera was turned
    View view;
    double radius = 1;              ///< the scene's usual one, world units
    nook::Image<float> visibility;  ///< ray traced
};

/// Tuning sees `train` alone.
struct CalibrationViews {
    int width = 0, height = 0, directions = 0;
    std::vector<CalibrationView> train, held_out;
};

/// Draws and traces them. The held-out ones are other scenes, and those of `train` from elsewhere.
[[nodiscard]] CalibrationViews calibration_views(bool quick, nook::ThreadExecutor& threads,
                                                 support::Progress& progress);

}  // namespace report
