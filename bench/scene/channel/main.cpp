// nook-channel-compare: what the information between viewpoints and polygons costs.

#include <cstdio>

#include "compare/failure.hpp"
#include "compare/marks.hpp"
#include "options.hpp"
#include "parts.hpp"
#include "results.hpp"
#include "subject.hpp"
#include "support/program.hpp"

namespace {

void run(const compare::Options& options)
{
    compare::Subject subject{options};
    compare::print_machine(options);
    compare::Results results;
    if (options.runs("stream")) compare::measure_stream(options, subject, results);
    if (options.runs("matrix")) compare::measure_matrix(options, subject, results);
    if (options.runs("refinement")) compare::measure_refinement(options, subject, results);
    compare::print_marks(results.marks, options.quick);
    if (!options.json.empty()) compare::write_json(results, options);
    if (std::fflush(stdout) != 0) throw compare::Failure{"stdout cannot be written"};
}

}  // namespace

// The status tells whether the measurement ran, never how fast.
int main(int argc, char** argv)
{
    return support::run_program("nook-channel-compare", [&] {
        compare::Options options;
        if (compare::read_options(argc, argv, options)) run(options);
    });
}
