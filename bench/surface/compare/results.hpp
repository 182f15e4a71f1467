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
    std::string part, scene, contender;
    int width = 0, height = 0;
    int samples = 0;    ///< per pixel; 0: no such number
    double active = 1;  ///< the share of surface pixels that a work map leaves
    int threads = 1;
    Summary nanoseconds{};  ///< per pixel
    std::string base;       ///< whose time `ratio` is relative to
    Summary ratio{};
};

/// How far the picture of a contender lies from another one's.
struct Agreement {
    std::string part, scene, contender, other;
    int samples = 0;
    double mean = 0;  ///< of the signed differences of visibility, surfaces alone
    double rms = 0;
    double largest = 0;
    double share = 0;  ///< of surface pixels that differ by more than 1e-2
};

struct Results {
    std::vector<Measurement> measurements;
    std::vector<Agreement> agreements;
    std::vector<Mark> marks;
    std::vector<Fact> facts;
};

/// Prints what the numbers hang on: CPU, compiler, instruction set, Mesa.
void print_machine(const Options& options);
void write_json(const Results& results, const Options& options);

}  // namespace compare
