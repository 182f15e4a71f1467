#include "options.hpp"

#include <algorithm>
#include <thread>

#include "compare/failure.hpp"

namespace compare {

namespace {

constexpr const char* part_names[] = {"stream", "matrix", "refinement"};

constexpr const char* help =
    "Usage: nook-channel-compare [SUBJECT] [OPTIONS]\n"
    "What the information between viewpoints and polygons costs, in time and memory: streamed\n"
    "view by view (PMI and the occlusion of the same pictures, at the resolution that the mesh\n"
    "asks for), and as a whole channel with its measures. Tells what was left out, how far\n"
    "identities hold, and which of the project's marks are met. The subject is the name of a\n"
    "built-in scene or an OBJ file [a closed sphere with bumps and dents].\n"
    "\n"
    "  --triangles N   of the bumpy sphere, 1000 to 20000000 [1000000; 20000 with --quick]\n"
    "  --views LEVEL   0 to 5: 12, 42, 162, 642, 2562 or 10242 viewpoints [3; 1 with --quick]\n"
    "  --resolution N  pixels across the pictures of the channel, 1 to 8192 [512]\n"
    "  --threads N     1 to 256 [one per hardware thread]\n"
    "  --rounds N      how often each part runs, 1 to 10000 [1]\n"
    "  --only PART     stream, matrix or refinement (the next level of viewpoints, too: how far\n"
    "                  the map changes); may be repeated [stream, matrix]\n"
    "  --quick         a small mesh, few views: shows that everything runs, not how fast\n"
    "  --json FILE     write the results to FILE too\n"
    "  --help          print this and leave\n"
    "  --version       print the version and leave\n";

}  // namespace

bool read_options(int argc, const char* const* argv, Options& options)
{
    options.threads = (std::max)(static_cast<int>(std::thread::hardware_concurrency()), 1);
    bool triangles = false, level = false;
    const bool run =
        read_common(argc, argv, {help, part_names, 1, 1}, options, [&](Arguments& arguments) {
            const std::string& word = arguments.word();
            if (word == "--triangles") {
                options.triangles = arguments.count(1000, 20'000'000);
                triangles = true;
            } else if (word == "--views") {
                options.level = arguments.count(0, 5);
                level = true;
            } else if (word == "--resolution") {
                options.resolution = arguments.count(1, 8192);
            } else if (word == "--threads") {
                options.threads = arguments.count(1, 256);
            } else if (!arguments.is_option() && !word.empty()) {
                if (!options.subject.empty())
                    throw Failure{"'" + word.substr(0, 60) + "': there is a subject already"};
                options.subject = word;
            } else {
                arguments.unknown();
            }
        });
    if (options.quick && !triangles) options.triangles = 20000;
    if (options.quick && !level) options.level = 1;
    if (options.parts.empty()) options.parts = {"stream", "matrix"};
    return run;
}

}  // namespace compare
