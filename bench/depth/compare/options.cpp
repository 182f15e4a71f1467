#include "options.hpp"

namespace compare {

namespace {

constexpr const char* part_names[] = {"contenders", "windows", "threads", "radius"};

constexpr const char* help =
    "Usage: nook-compare [OPTIONS]\n"
    "Chebyshev ambient occlusion against memcpy, OpenCV, summed area tables and\n"
    "running sums, all in rotation in one process. Prints times, their ratios within\n"
    "a round, and which of the project's marks are met.\n"
    "\n"
    "  --rounds N    rounds of every rotation, 1 to 10000 [15; 3 with --quick]\n"
    "  --only PART   contenders, windows, threads or radius; may be repeated [all]\n"
    "  --quick       small images: shows that everything runs, not how fast\n"
    "  --json FILE   write the results to FILE too\n"
    "  --help        print this and leave\n"
    "  --version     print the version and leave\n";

}  // namespace

bool read_options(int argc, const char* const* argv, Options& options)
{
    return read_common(argc, argv, {help, part_names, 15, 3}, options);
}

}  // namespace compare
