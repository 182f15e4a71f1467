#pragma once

#include <string>
#include <vector>

#include "compare/marks.hpp"
#include "compare/rotation.hpp"
#include "options.hpp"
#include "views.hpp"

/// What the parts of the comparison bring home.
namespace compare {

/// The time of one contender, and against another one of the same rotation.
struct Measurement {
    std::string part, mesh, contender;
    std::size_t triangles = 0;
    int width = 0, height = 0;
    int threads = 1;
    Summary seconds{};
    double least_seconds = 0;
    std::string base;  ///< whose time `ratio` is relative to
    Summary ratio{};
};

/// How far two pictures of a view are the same. Shares of the pixels of the picture.
struct Agreement {
    std::string view, what;
    double covered = 0;    ///< by nook
    double coverage = 0;   ///< that one of the two covers and the other does not
    double different = 0;  ///< that both cover, with another normal or face
};

struct Results {
    std::vector<Measurement> measurements;
    std::vector<Agreement> agreements;
    std::vector<Mark> marks;
    std::vector<Fact> facts;
};

/// What is common to the measurements of a rotation.
[[nodiscard]] Measurement measured(const char* part, const View& view,
                                   const std::vector<Contender>& contenders, const Times& times,
                                   std::size_t i, std::size_t base);

/// Prints what the numbers hang on: CPU, compiler, instruction set, Mesa.
void print_machine(const Options& options);
void write_json(const Results& results, const Options& options);

}  // namespace compare
