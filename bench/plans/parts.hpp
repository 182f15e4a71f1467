#pragma once

#include "results.hpp"

/// The parts of the comparison. Each prints its table and adds to the results. Throw Failure.
namespace compare {

/// The slanted floor and the empty view, where everything can be left out.
void compare_open(const Options& options, Results& results);

/// Scenes where a part can be left out, at three radii.
void compare_scenes(const Options& options, Results& results);

/// Scenes where nothing can: what planning costs there.
void compare_whole(const Options& options, Results& results);

/// Rays, at small radii.
void compare_traced(const Options& options, Results& results);

/// Plans against the stencil of outlines, on its scenes.
void compare_outlines(const Options& options, Results& results);

}  // namespace compare
