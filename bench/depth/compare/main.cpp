// nook-compare: Chebyshev ambient occlusion against what else one could do, in rotation.

#include <cstdio>

#include "compare/failure.hpp"
#include "compare/marks.hpp"
#include "options.hpp"
#include "parts.hpp"
#include "results.hpp"
#include "support/program.hpp"

namespace {

void run(const compare::Options& options)
{
    compare::print_machine(options);
    compare::Results results;
    if (options.runs("contenders")) compare_contenders(options, results);
    if (options.runs("windows")) compare_windows(options, results);
    if (options.runs("threads")) compare_threads(options, results);
    if (options.runs("radius")) compare_radius(options, results);
    compare::print_marks(results.marks, options.quick);
    if (!options.json.empty()) compare::write_json(results, options);
    if (std::fflush(stdout) != 0) throw compare::Failure{"stdout cannot be written"};
}

}  // namespace

// The status tells whether the comparison ran, never how fast.
int main(int argc, char** argv)
{
    return support::run_program("nook-compare", [&] {
        compare::Options options;
        if (compare::read_options(argc, argv, options)) run(options);
    });
}
