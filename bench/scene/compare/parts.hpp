#pragma once

#include <vector>

#include "options.hpp"
#include "results.hpp"
#include "view.hpp"

/// The parts of the comparison. Each prints its tables and adds to the results.
namespace compare {

/// One thread: the same rays by nook and by every call of Embree, by radius and number of directions.
void compare_ao(const Options& options, const std::vector<View>& views, Results& results);

/// Rays on which nook, Embree and a brute force in double differ, and how close each of them was.
void compare_hits(const Options& options, const std::vector<View>& views, Results& results);

/// One thread: the time to build, and the memory that stays.
void compare_build(const Options& options, const std::vector<View>& views, Results& results);

/// Two threads against one.
void compare_threads(const Options& options, const std::vector<View>& views, Results& results);

/// Against a loop of random rays that gives the same error.
void compare_error(const Options& options, const std::vector<View>& views, Results& results);

/// What secondary rays cost in a picture of 1920 × 1080.
void compare_secondary(const Options& options, const std::vector<View>& views, Results& results);

}  // namespace compare
