#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/marks.hpp"
#include "compare/rotation.hpp"
#include "options.hpp"
#include "subject.hpp"

/// What the parts bring home.
namespace compare {

/// What one part took.
struct Measurement {
    std::string part, subject;
    std::size_t triangles = 0, views = 0;
    int resolution = 0, threads = 1;
    Summary seconds{};
    double processor_seconds = 0;         ///< of all threads
    std::size_t bytes = 0;                ///< asked for at one time, of scratch or of the Memory
    std::size_t picture_bytes = 0;        ///< of these, what a picture needs whatever the mesh
    std::optional<std::size_t> resident;  ///< growth of the memory that the process touches
    std::vector<Fact> facts;              ///< what was left out, and the like
};

struct Results {
    std::vector<Measurement> measurements;
    std::vector<Mark> marks;
};

/// What is common to the measurements of a subject.
[[nodiscard]] Measurement measured(const char* part, const Subject& subject, const Options& options,
                                   int resolution);
/// The bytes beside what a picture needs, for each polygon.
[[nodiscard]] double per_polygon(const Measurement& m, std::size_t bytes);
/// The goals are for a million triangles from 642 viewpoints with two threads; other runs only report.
[[nodiscard]] bool as_agreed(const Subject& subject, const Options& options);
/// A mark of one value, which should be small.
[[nodiscard]] Mark mark_of(std::string what, const Summary& value, double target, double stretch,
                           const std::string& where);

void print_measurement(const Measurement& m);
void print_machine(const Options& options);
void write_json(const Results& results, const Options& options);

}  // namespace compare
