#include "options.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>
#include <system_error>

#include "compare/failure.hpp"

namespace compare {

namespace {

constexpr const char* part_names[] = {"ao", "hits", "build", "threads", "error", "secondary"};

constexpr const char* help =
    "Usage: nook-trace-compare [SCENE [--camera EX,EY,EZ,TX,TY,TZ[,FOV]]]... [OPTIONS]\n"
    "Ray-traced ambient occlusion against Embree's any-hit calls: the same points, the\n"
    "same directions, all contenders in rotation in one process. Prints times, their\n"
    "ratios within a round, and which of the project's marks are met. A scene is an OBJ\n"
    "file or the name of a built-in one [boxes arcade].\n"
    "\n"
    "  --camera ...  eye, target and vertical angle of view in degrees [45] for the\n"
    "                scene before it [its own; a file from the front, right and above]\n"
    "  --rounds N    rounds of every rotation, 1 to 10000 [7; 1 with --quick]\n"
    "  --only PART   ao, hits, build, threads, error or secondary; may be repeated [all]\n"
    "  --quick       few points: shows that everything runs, not how fast\n"
    "  --json FILE   write the results to FILE too\n"
    "  --help        print this and leave\n"
    "  --version     print the version and leave\n";

nook::Camera camera_of(const std::string& text)
{
    const auto refuse = [&] {
        throw Failure{"--camera: '" + text.substr(0, 60) +
                      "' is not EX,EY,EZ,TX,TY,TZ[,FOV] in finite numbers"};
    };
    std::array<double, 7> values{0, 0, 0, 0, 0, 0, 45};
    std::size_t count = 0;
    for (const char* at = text.c_str();; ++at) {
        if (count == values.size()) refuse();
        const auto [end, error] = std::from_chars(at, text.c_str() + text.size(), values[count++]);
        if (error != std::errc{} || !std::isfinite(values[count - 1])) refuse();
        at = end;
        if (*at == '\0') break;
        if (*at != ',') refuse();
    }
    if (count < 6) refuse();
    nook::Camera camera;
    camera.eye = {values[0], values[1], values[2]};
    camera.target = {values[3], values[4], values[5]};
    camera.vertical_fov = values[6] * std::numbers::pi / 180;
    if (const nook::Error error = nook::check_camera(camera)) {
        char why[256];
        nook::describe(error, why, sizeof why);
        throw Failure{"--camera: " + std::string{why}};
    }
    return camera;
}

}  // namespace

bool read_options(int argc, const char* const* argv, Options& options)
{
    return read_common(argc, argv, {help, part_names, 7, 1}, options, [&](Arguments& arguments) {
        const std::string& word = arguments.word();
        if (word == "--camera") {
            if (options.subjects.empty()) throw Failure{"--camera: comes after its scene"};
            options.subjects.back().camera = camera_of(arguments.value());
        } else if (!arguments.is_option() && !word.empty()) {
            options.subjects.push_back({word, {}});
        } else {
            arguments.unknown();
        }
    });
}

}  // namespace compare
