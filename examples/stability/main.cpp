// nook-stability: how kernels stand stiff, extreme and poisoned inputs, beside the textbook ways to
// compute the same.

#include <charconv>
#include <cstddef>
#include <cstdio>
#include <iostream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>

#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/program.hpp"
#include "stability.hpp"

namespace {

struct CommandLine {
    stability::Options options;
    std::string json;     ///< the file to write; empty for none
    std::string picture;  ///< likewise
};

/// Odd numbers with commas between them.
std::vector<int> read_windows(std::string_view text)
{
    std::vector<int> windows;
    for (std::size_t at = 0; at <= text.size();) {
        const std::string_view item = text.substr(at, text.find(',', at) - at);
        int window = 0;
        const auto [end, error] = std::from_chars(item.data(), item.data() + item.size(), window);
        if (error != std::errc{} || end != item.data() + item.size() || window < 3 ||
            window > stability::largest_window || window % 2 == 0) {
            std::string shown{item.substr(0, 60)};
            for (char& c : shown)
                if (c < ' ' || c > '~') c = '?';
            throw support::Failure{"--window: '" + shown + "' is not an odd number from 3 to " +
                                   std::to_string(stability::largest_window)};
        }
        windows.push_back(window);
        at += item.size() + 1;
    }
    return windows;
}

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Prints how depth filters, rays, kernels over depth and normals, and the channel between\n"
        "viewpoints and polygons stand stiff, extreme and poisoned inputs, beside the textbook "
        "ways\n"
        "to compute the same, all against what is known exactly of the same input. A number of a\n"
        "depth filter is the worst over the windows. Below a table stands the input that is worst "
        "for\n"
        "nook; the JSON has that of every row.",
        "nook-stability"};
    support::set_up(app);
    std::string windows = "3,17,65";
    app.add_option("--window", windows,
                   "Pixels across the windows of depth filters, odd, from 3 to " +
                       std::to_string(stability::largest_window))
        ->type_name("K[,K...]")
        ->capture_default_str();
    auto* json =
        app.add_option("--json", result.json, "Writes the results, one row per window, too")
            ->type_name("FILE");
    auto* picture =
        app.add_option("--picture", result.picture,
                       "Draws the terrain, distances 0.1 to 1e5, by float filters (PNG)")
            ->type_name("FILE");
    if (!support::parse(app, argc, argv)) return false;
    if (json->count() > 0 && result.json.empty()) throw support::Failure{"--json: an empty name"};
    if (picture->count() > 0 && result.picture.empty())
        throw support::Failure{"--picture: an empty name"};
    result.options.windows = read_windows(windows);
    return true;
}

void answer(const CommandLine& command)
{
    const std::vector<stability::Family> families = stability::run(command.options);
    if (!command.json.empty())
        support::write_file(command.json, stability::json_of(families).dump(2) + '\n');
    if (!command.picture.empty()) stability::write_terrain(command.picture);
    stability::print_tables(std::cout, families);
    if (!std::cout.flush()) throw support::Failure{"the tables cannot be written to stdout"};
}

}  // namespace

int main(int argc, char** argv)
{
    return support::run_program("nook-stability", [&] {
        CommandLine command;
        if (read_command_line(argc, argv, command)) answer(command);
    });
}
