// nook-plan-compare: what plans leave out, what that saves and what it costs, in rotation.

#include <cstdio>

#include "common.hpp"
#include "compare/failure.hpp"
#include "compare/marks.hpp"
#include "options.hpp"
#include "parts.hpp"
#include "results.hpp"
#include "support/files.hpp"
#include "support/program.hpp"

namespace {

/// False when an exact plan changed a bit.
bool run(const compare::Options& options)
{
    (void)compare::chosen(options);
    if (!options.pictures.empty()) support::prepare_folder(options.pictures);
    compare::print_machine(options);
    compare::Results results;
    if (options.runs("open")) compare_open(options, results);
    if (options.runs("scenes")) compare_scenes(options, results);
    if (options.runs("whole")) compare_whole(options, results);
    if (options.runs("traced")) compare_traced(options, results);
    if (options.runs("outlines")) compare_outlines(options, results);
    compare::print_marks(results.marks, options.quick);
    for (const std::string& place : results.broken)
        std::printf("AN EXACT PLAN CHANGED THE PICTURE: %s\n", place.c_str());
    if (results.broken.empty()) std::printf("Exact plans changed no bit.\n");
    if (!options.json.empty()) compare::write_json(results, options);
    if (std::fflush(stdout) != 0) throw compare::Failure{"stdout cannot be written"};
    return results.broken.empty();
}

}  // namespace

// The status tells whether the comparison ran and pictures kept their bits, never how fast.
int main(int argc, char** argv)
{
    bool kept = true;
    const int status = support::run_program("nook-plan-compare", [&] {
        compare::Options options;
        if (compare::read_options(argc, argv, options)) kept = run(options);
    });
    return status != 0 ? status : kept ? 0 : 1;
}
