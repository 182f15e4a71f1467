#include "options.hpp"

namespace compare {

namespace {

constexpr const char* part_names[] = {"llvmpipe", "sets", "threads"};

constexpr const char* help =
    "Usage: nook-raster-compare [SUBJECT]... [OPTIONS]\n"
    "The rasteriser against Mesa's llvmpipe on one core, both drawing the same mesh with the\n"
    "same camera, in rotation in one process; every instruction set; two threads. Prints\n"
    "times, their ratios within a round, how far the pictures agree, and which of the\n"
    "project's marks are met. A subject is a number of triangles, of which forty tori and\n"
    "spheres are made, the name of a built-in scene, or an OBJ file\n"
    "[20000 300000 1000000]. Without EGL or llvmpipe, nook's own figures.\n"
    "\n"
    "  --rounds N    rounds of every rotation, 1 to 10000 [15; 3 with --quick]\n"
    "  --only PART   llvmpipe, sets or threads; may be repeated [all]\n"
    "  --quick       small meshes and pictures: shows that everything runs, not how fast\n"
    "  --json FILE   write the results to FILE too\n"
    "  --help        print this and leave\n"
    "  --version     print the version and leave\n";

}  // namespace

bool read_options(int argc, const char* const* argv, Options& options)
{
    return read_common(argc, argv, {help, part_names, 15, 3}, options, [&](Arguments& arguments) {
        if (!arguments.is_option() && !arguments.word().empty())
            options.subjects.push_back(arguments.word());
        else arguments.unknown();
    });
}

}  // namespace compare
