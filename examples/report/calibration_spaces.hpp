#pragma once

#include <string>
#include <vector>

#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/owned_image.hpp>
#include <nook/scratch.hpp>

#include "calibration_search.hpp"
#include "calibration_views.hpp"

namespace report {

/// What a worker keeps from run to run.
struct CalibrationMemory {
    nook::HeapScratch first, second;
    nook::Image<float> visibility, between, half;
};

/// A kernel and all that may be set about it.
///
/// Lengths are relative, so that a setting says the same in every scene: `radius_factor` to the radius
/// of the reference, `..._in_radii` to the kernel's own radius, `window_factor` to the window that the
/// radius of the reference projects to at the median distance. The radius of a blur is in pixels of the
/// picture, as the noise that it removes is. Largest numbers of pixels on the screen stay those of the
/// library: in pictures as small as these they bound next to nothing, so tuning says nothing of them.
struct CalibrationSpace {
    std::string kernel;
    std::vector<Axis> axes;
    /// Writes `memory.visibility`, which has the size of the view, on the calling thread.
    nook::Outcome (*run)(const CalibrationView& view, const Setting& setting,
                         CalibrationMemory& memory);
};
[[nodiscard]] std::vector<CalibrationSpace> calibration_spaces(bool quick);

}  // namespace report
