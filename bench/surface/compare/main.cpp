// nook-surface-compare: ambient occlusion from depth and normals against what else one could do, in
// rotation.

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
    const std::vector<compare::Picture> pictures = compare::pictures(options);
    compare::print_machine(options);
    for (const compare::Picture& picture : pictures)
        std::printf("%s: %d x %d, %.0f %% surface, the radius covers %.0f pixels on average\n",
                    picture.name.c_str(), picture.width(), picture.height(),
                    100 * picture.surface_share(), picture.mean_reach());
    std::printf("\n");
    compare::Results results;
    if (options.runs("aao")) compare_aao(options, pictures, results);
    if (options.runs("llvmpipe")) compare_llvmpipe(options, pictures, results);
    if (options.runs("mask")) compare_masks(options, pictures, results);
    if (options.runs("outline")) compare_outlines(options, results);
    if (options.runs("rivals")) compare_rivals(options, pictures, results);
    if (options.runs("threads")) compare_threads(options, pictures, results);
    compare::print_marks(results.marks, options.quick);
    if (!options.json.empty()) compare::write_json(results, options);
    if (std::fflush(stdout) != 0) throw compare::Failure{"stdout cannot be written"};
}

}  // namespace

// The status tells whether the comparison ran, never how fast.
int main(int argc, char** argv)
{
    return support::run_program("nook-surface-compare", [&] {
        compare::Options options;
        if (compare::read_options(argc, argv, options)) run(options);
    });
}
