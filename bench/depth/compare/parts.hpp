#pragma once

#include "kernels.hpp"
#include "options.hpp"
#include "results.hpp"

/// The parts of the comparison. Each prints its tables and adds to the results.
namespace compare {

/// One thread, fixed windows of 3 … 127 pixels: every contender, every instruction set, images with
/// and without background; and whether all compute the same.
void compare_contenders(const Options& options, Results& results);

/// nook alone: time over window size.
void compare_windows(const Options& options, Results& results);

/// Two threads against one, beside memcpy's own scaling.
void compare_threads(const Options& options, Results& results);

/// Windows that follow 1/distance, on the built-in scenes.
void compare_radius(const Options& options, Results& results);

}  // namespace compare
