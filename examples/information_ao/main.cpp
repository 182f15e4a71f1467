// nook-information-ao: ambient occlusion from the information that polygons and viewpoints share
// (González, Sbert & Feixas 2008), beside the true one of the same pictures and a ray-traced one.

#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>

#include <nook/scene/information_sampling.hpp>
#include <nook/scene/viewpoints.hpp>

#include "../scenes/scenes.hpp"
#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/program.hpp"
#include "run.hpp"

namespace information {

namespace {

/// Reads X,Y,Z: finite numbers, not all 0.
glm::dvec3 read_direction(const char* option, std::string_view text)
{
    double xyz[3] = {};
    const char* at = text.data();
    const char* const end = at + text.size();
    bool good = true;
    for (int k = 0; k < 3 && good; ++k) {
        if (k > 0) good = at != end && *at++ == ',';
        const auto [stop, error] = std::from_chars(at, end, xyz[k]);
        good = good && error == std::errc{} && std::isfinite(xyz[k]);
        at = stop;
    }
    const double length = std::hypot(xyz[0], xyz[1], xyz[2]);
    if (!good || at != end || !(length > 0) || !std::isfinite(length)) {
        std::string shown{text.substr(0, 60)};
        for (char& c : shown)
            if (c < ' ' || c > '~') c = '?';
        throw support::Failure{std::string{option} + ": '" + shown + "' is not a direction X,Y,Z"};
    }
    return glm::dvec3{xyz[0], xyz[1], xyz[2]} / length;
}

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Computes what the polygons of a mesh and viewpoints around it tell about each other, as\n"
        "ambient occlusion: draws the maps, and prints how far they agree with the true ambient\n"
        "occlusion of the same pictures and with ray-traced ambient occlusion.",
        "nook-information-ao"};
    support::set_up(app);
    std::string size = "480x480", folder = result.folder.string(), distance, probability = "area",
                importance, light;
    app.add_option("--scene", result.scene, "A built-in scene, or an OBJ file")
        ->type_name("NAME")
        ->capture_default_str();
    app.add_option("--level", result.level, "Viewpoints: 12, 42, 162, 642, 2562, 10242 or 40962")
        ->type_name("0..6")
        ->check(CLI::Range(0, nook::finest_icosphere))
        ->capture_default_str();
    app.add_option("--resolution", result.resolution,
                   "Pixels across the picture of each viewpoint; 0: chosen from the mesh")
        ->type_name("N")
        ->check(CLI::Range(0, nook::largest_information_resolution))
        ->capture_default_str();
    app.add_option(
           "--samples", result.samples,
           "Samples that a polygon which faces the viewer should get; small ones get up to\n"
           "16 per pixel for it")
        ->type_name("N")
        ->check(CLI::Range(1, 65536))
        ->capture_default_str();
    app.add_option("--perspective", distance,
                   "Distance of the viewpoints from the centre, in radii, above 1 [orthographic]")
        ->type_name("DISTANCE");
    app.add_option("--probability", probability,
                   "Of the viewpoints: by the area that they see, or uniform")
        ->type_name("area|uniform")
        ->check(CLI::IsMember({"area", "uniform"}))
        ->capture_default_str();
    app.add_option("--importance", importance,
                   "Draws a map in which viewpoints around this direction weigh more, too")
        ->type_name("X,Y,Z");
    app.add_option("--light", light,
                   "Draws the object lit by colours around it, too: " + Light::palettes() +
                       ",\nor a picture in latitude and longitude (PNG, JPEG, HDR)")
        ->type_name("PALETTE|IMAGE");
    app.add_flag("--refine", result.refine,
                 "Prints how far the map changes with four times the viewpoints");
    app.add_option(
           "--clip", result.clip,
           "Percent of the seen polygons, those of the largest PMI, that share black: a few\n"
           "in deep corners would take the range from all others; 0: as the paper has it")
        ->type_name("PERCENT=0 - 50")
        ->capture_default_str();
    app.add_option("--directions", result.directions, "Rays per polygon of the traced map")
        ->type_name("N")
        ->check(CLI::Range(1, 65536))
        ->capture_default_str();
    app.add_option("--size", size, "Size of each picture in pixels")
        ->type_name("WIDTHxHEIGHT")
        ->capture_default_str();
    support::add_threads(app, result.threads, "Threads; the results do not depend on them");
    app.add_option("--out", folder, "Folder for the pictures and information.json")
        ->type_name("DIR")
        ->capture_default_str();
    if (!support::parse(app, argc, argv)) return false;
    if (folder.empty()) throw support::Failure{"--out: an empty name"};
    result.folder = folder;
    result.size = support::read_picture_size("--size", size);
    if (app.count("--perspective") > 0) {
        result.distance = support::read_positive("--perspective", distance);
        if (!(result.distance > 1 && result.distance <= 1e6))
            throw support::Failure{"--perspective: '" + distance +
                                   "' is not a distance above 1, up to 1e6"};
    }
    // CLI::Range lets NaN pass.
    if (!(result.clip >= 0 && result.clip <= 50))
        throw support::Failure{"--clip: 0 to 50 percent are possible"};
    if (probability == "uniform") result.probability = nook::ViewProbability::uniform;
    if (app.count("--importance") > 0)
        result.importance = read_direction("--importance", importance);
    if (result.refine && result.level == nook::finest_icosphere)
        throw support::Failure{"--refine: there is no level beyond " +
                               std::to_string(result.level)};
    if (app.count("--light") > 0) result.light.emplace(light);
    return true;
}

}  // namespace

}  // namespace information

int main(int argc, char** argv)
{
    return support::run_program("nook-information-ao", [&] {
        information::CommandLine command;
        if (information::read_command_line(argc, argv, command)) information::run(command);
    });
}
