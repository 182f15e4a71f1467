// nook-trace-compare: ray-traced ambient occlusion against Embree, in rotation.

#include <cstdio>

#include "compare/failure.hpp"
#include "compare/marks.hpp"
#include "embree_scene.hpp"
#include "options.hpp"
#include "parts.hpp"
#include "results.hpp"
#include "support/program.hpp"
#include "view.hpp"

namespace {

void run(const compare::Options& options)
{
    const std::vector<compare::View> views = compare::views(options);
    compare::print_machine(options);
    compare::flush_denormals();
    compare::Results results;
    for (const compare::View& view : views) view.print();
    std::printf("\n");
    if (options.runs("ao")) compare_ao(options, views, results);
    if (options.runs("hits")) compare_hits(options, views, results);
    if (options.runs("build")) compare_build(options, views, results);
    if (options.runs("threads")) compare_threads(options, views, results);
    if (options.runs("error")) compare_error(options, views, results);
    if (options.runs("secondary")) compare_secondary(options, views, results);
    compare::print_marks(results.marks, options.quick);
    if (!options.json.empty()) compare::write_json(results, options);
    if (std::fflush(stdout) != 0) throw compare::Failure{"stdout cannot be written"};
}

}  // namespace

// The status tells whether the comparison ran, never how fast.
int main(int argc, char** argv)
{
    return support::run_program("nook-trace-compare", [&] {
        compare::Options options;
        if (compare::read_options(argc, argv, options)) run(options);
    });
}
