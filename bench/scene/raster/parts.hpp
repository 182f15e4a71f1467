#pragma once

#include <vector>

#include "compare/rotation.hpp"
#include "options.hpp"
#include "results.hpp"
#include "views.hpp"

/// The parts of the comparison. Each prints its tables and adds to the results.
namespace compare {

/// Every target of the rasteriser against llvmpipe on one core, and how the pictures agree.
void compare_llvmpipe(const Options& options, const std::vector<View>& views, Results& results);

/// One instruction set against another.
void compare_sets(const Options& options, const std::vector<View>& views, Results& results);

/// Two threads against one, beside what plain arithmetic gains.
void compare_threads(const Options& options, const std::vector<View>& views, Results& results);

/// A turn begins with a call that brings its buffers into the caches: what ran before has others.
[[nodiscard]] inline Effort effort(const Options& options, Clock clock = Clock::processor)
{
    return {.rounds = options.rounds,
            .turn_seconds = options.quick ? 1e-4 : 5e-3,
            .clock = clock,
            .untimed_call = true};
}

}  // namespace compare
