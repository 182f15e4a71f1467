// nook-raster-compare: the rasteriser against Mesa's llvmpipe, in rotation.

#include <cstdio>

#include "compare/failure.hpp"
#include "compare/marks.hpp"
#include "options.hpp"
#include "parts.hpp"
#include "results.hpp"
#include "support/program.hpp"
#include "views.hpp"

namespace {

void run(const compare::Options& options)
{
    const std::vector<compare::View> views = compare::views(options);
    compare::print_machine(options);
    compare::Results results;
    if (options.runs("llvmpipe")) compare_llvmpipe(options, views, results);
    if (options.runs("sets")) compare_sets(options, views, results);
    if (options.runs("threads")) compare_threads(options, views, results);
    compare::print_marks(results.marks, options.quick);
    if (!options.json.empty()) compare::write_json(results, options);
    if (std::fflush(stdout) != 0) throw compare::Failure{"stdout cannot be written"};
}

}  // namespace

// The status tells whether the comparison ran, never how fast.
int main(int argc, char** argv)
{
    return support::run_program("nook-raster-compare", [&] {
        compare::Options options;
        if (compare::read_options(argc, argv, options)) run(options);
    });
}
