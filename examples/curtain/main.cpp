// nook-curtain: the ground under a hanging box, where ambient occlusion with a radius is brightest in
// the wrong place, with and without secondary rays.

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>

#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/program.hpp"
#include "curtain.hpp"

namespace {

constexpr const char* json_name = "curtain.json";
constexpr const char* picture_name = "curtain.png";
constexpr int least_directions = 64, most_directions = 65536, most_threads = 1024;
constexpr double shortest = 1e-6, longest = 1e6;

struct CommandLine {
    curtain::Options options;
    std::string out;  ///< the folder to write to; empty for none
};

/// Throws unless the option is a length between the limits.
void check_length(const char* option, double value, double least)
{
    if (std::isfinite(value) && value >= least && value <= longest) return;
    char range[64];
    std::snprintf(range, sizeof range, ": a length from %g to %g", least, longest);
    throw support::Failure{option + std::string{range}};
}

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    curtain::Options& options = result.options;
    options.threads =
        std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, most_threads);
    CLI::App app{
        "Prints how bright the ground under a hanging box is: in closed form, traced, and\n"
        "traced with secondary rays, which take the false highlight away.",
        "nook-curtain"};
    support::set_up(app);
    const auto length = [&](const char* option, double& value, const char* what) {
        app.add_option(option, value, what)->type_name("LENGTH")->capture_default_str();
    };
    length("--width", options.curtain.width, "Width of the box");
    length("--bottom", options.curtain.bottom, "From the ground to the box");
    length("--height", options.curtain.height, "Height of the box");
    length("--radius", options.curtain.radius, "Radius of the occlusion");
    app.add_option("--directions", options.directions,
                   "Per position, a power of two from " + std::to_string(least_directions) +
                       " to " + std::to_string(most_directions))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--threads", options.threads, "Threads that trace")->type_name("N");
    auto* out = app.add_option("--out", result.out,
                               std::string{"Writes "} + json_name + " and " + picture_name +
                                   " to this folder, too")
                    ->type_name("DIR");
    if (!support::parse(app, argc, argv)) return false;
    if (out->count() > 0 && result.out.empty()) throw support::Failure{"--out: an empty name"};
    check_length("--width", options.curtain.width, shortest);
    check_length("--bottom", options.curtain.bottom, shortest);
    check_length("--height", options.curtain.height, shortest);
    check_length("--radius", options.curtain.radius, shortest);
    if (options.directions < least_directions || options.directions > most_directions ||
        !std::has_single_bit(static_cast<unsigned>(options.directions)))
        throw support::Failure{"--directions: " + std::to_string(options.directions) +
                               " is not a power of two from " + std::to_string(least_directions) +
                               " to " + std::to_string(most_directions)};
    if (options.threads < 1 || options.threads > most_threads)
        throw support::Failure{"--threads: " + std::to_string(options.threads) +
                               " is not a number from 1 to " + std::to_string(most_threads)};
    return true;
}

void answer(const CommandLine& command)
{
    const std::filesystem::path folder{command.out};
    if (!command.out.empty()) support::prepare_folder(folder);
    const curtain::Profile profile = curtain::run(command.options);
    if (!command.out.empty()) {
        support::write_file(folder / json_name, curtain::json_of(profile).dump(2) + '\n');
        curtain::write_plot(folder / picture_name, profile);
    }
    curtain::print_tables(std::cout, profile);
    if (!std::cout.flush()) throw support::Failure{"the tables cannot be written to stdout"};
}

}  // namespace

int main(int argc, char** argv)
{
    return support::run_program("nook-curtain", [&] {
        CommandLine command;
        if (read_command_line(argc, argv, command)) answer(command);
    });
}
