#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compare/marks.hpp"
#include "compare/rotation.hpp"
#include "options.hpp"

/// What the parts of the comparison bring home.
namespace compare {

/// How the picture with a plan differs from the one without, over its surfaces.
struct Change {
    std::uint64_t bits = 0;  ///< pixels whose bits differ, background included
    double rms = 0, largest = 0;
};

/// A kernel with a plan.
struct PlannedTime {
    std::string plan;  ///< "exact", "tolerant", "outline"
    double tolerance = 0;
    Summary plan_alone{};         ///< ns per pixel
    Summary map_alone{};          ///< the kernel under a map that is at hand
    Summary with{};               ///< both
    Summary speed_up{};           ///< over the kernel without
    Summary reused{};             ///< speed-up under a map that is at hand
    Summary over_ones{};          ///< the time of both over that of a pass that writes ones
    double pixels_left_out = 0;   ///< shares of the surface pixels
    double samples_left_out = 0;  ///< of the samples, or rays, of the others
    Change change{};
    double added_error = 0;  ///< against ray tracing: RMSE with the plan less that without
};

/// A kernel on a view.
struct Measurement {
    std::string part, scene, kernel, radius;
    int width = 0, height = 0;
    Summary ones{};            ///< ns per pixel of a pass that reads the inputs and writes ones
    Summary without{};         ///< ns per pixel without a plan
    Summary full{};            ///< for kernels that skip by themselves: where they can skip nothing
    Summary over_ones{};       ///< without a plan
    Summary full_speed_up{};   ///< full over without
    double traced_error = -1;  ///< RMSE against ray tracing without a plan; < 0: not measured
    std::vector<PlannedTime> plans;
};

struct Results {
    std::vector<Measurement> measurements;
    std::vector<Mark> marks;
    std::vector<Fact> facts;
    /// Where exact plans changed bits.
    std::vector<std::string> broken;
};

/// Prints what the numbers hang on: CPU, compiler, instruction set.
void print_machine(const Options& options);
void write_json(const Results& results, const Options& options);

}  // namespace compare
