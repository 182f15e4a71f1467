#include "options.hpp"

namespace compare {

namespace {

constexpr const char* part_names[] = {"aao", "mask", "rivals", "threads", "outline", "llvmpipe"};

constexpr const char* help =
    "Usage: nook-surface-compare [SCENE]... [OPTIONS]\n"
    "Ambient obscurance from depth and normals against a plain loop, vector gathers and\n"
    "Mesa's llvmpipe, with and without work maps, and beside its rivals and the outline\n"
    "stencil; all in rotation in one process. Prints times, their ratios within a round,\n"
    "and which of the project's marks are met. A scene is `rolling`, which is made pixel\n"
    "by pixel, the name of a built-in one, or an OBJ file [rolling arcade temple].\n"
    "\n"
    "  --reach N     pixels of 1080 rows that the radius covers on average, 0 to 1000; 0: the\n"
    "                scenes' own radius [52]\n"
    "  --rounds N    rounds of every rotation, 1 to 10000 [15; 3 with --quick]\n"
    "  --only PART   aao, mask, rivals, threads, outline or llvmpipe; may be repeated [all]\n"
    "  --quick       small images: shows that everything runs, not how fast\n"
    "  --json FILE   write the results to FILE too\n"
    "  --help        print this and leave\n"
    "  --version     print the version and leave\n";

}  // namespace

bool read_options(int argc, const char* const* argv, Options& options)
{
    return read_common(argc, argv, {help, part_names, 15, 3}, options, [&](Arguments& arguments) {
        if (arguments.word() == "--reach") options.reach = arguments.count(0, 1000);
        else if (!arguments.is_option() && !arguments.word().empty())
            options.subjects.push_back(arguments.word());
        else arguments.unknown();
    });
}

}  // namespace compare
