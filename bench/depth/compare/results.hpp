#pragma once

#include <string>
#include <vector>

#include "compare/marks.hpp"
#include "compare/rotation.hpp"
#include "options.hpp"

/// What the parts of the comparison bring home.
namespace compare {

/// The time of one contender, and against another one of the same rotation.
struct Measurement {
    std::string part, image, contender;
    int width = 0, height = 0, window = 0, threads = 1;
    Summary nanoseconds;  ///< per pixel
    std::string base;     ///< whose time `ratio` is relative to
    Summary ratio;
};

/// How far the pictures of a contender lie from nook's.
struct Agreement {
    std::string image, contender;
    int width = 0, height = 0, window = 0;
    double largest = 0;  ///< difference of visibility
    double share = 0;    ///< of pixels that differ by more than 1e-3
};

struct Results {
    std::vector<Measurement> measurements;
    std::vector<Agreement> agreements;
    std::vector<Mark> marks;
    std::vector<Fact> facts;
};

/// Prints what the numbers hang on: CPU, compiler, instruction set.
void print_machine(const Options& options);
void write_json(const Results& results, const Options& options);

}  // namespace compare
