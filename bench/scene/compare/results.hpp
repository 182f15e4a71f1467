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
    std::string radius{};  ///< of the diagonal; empty where there is none
    int directions = 0, threads = 1;
    Summary seconds;   ///< per call
    double rays = 0;   ///< per call; 0 where there are none
    std::string base;  ///< whose time `ratio` is relative to
    Summary ratio;
};

/// Rays on which two answers differ.
struct Disagreement {
    std::string scene, radius;
    int directions = 0;
    std::string one, other;
    double rays = 0, differ = 0;
    double wrong_one = 0, wrong_other = 0;  ///< by brute force in double
    double margin = 0;                      ///< the largest of them, of 1
};

struct Results {
    std::vector<Measurement> measurements;
    std::vector<Disagreement> disagreements;
    std::vector<Mark> marks;
    std::vector<Fact> facts;
};

/// Prints what the numbers hang on: CPU, compiler, instruction set, Embree.
void print_machine(const Options& options);
void write_json(const Results& results, const Options& options);

}  // namespace compare
