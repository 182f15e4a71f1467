#include "options.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <iterator>
#include <string_view>
#include <system_error>

#include <nook/version.hpp>

#include "failure.hpp"

namespace compare {

namespace {

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

int count(const std::string& option, std::string_view text, int least, int largest)
{
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || value < least ||
        value > largest)
        throw Failure{option + ": '" + std::string{text.substr(0, 60)} +
                      "' is not a whole number from " + std::to_string(least) + " to " +
                      std::to_string(largest)};
    return value;
}

/// Refuses what stands in the way of a file before there are results to lose.
void check_writable(const std::string& option, const std::filesystem::path& file)
{
    if (file.empty()) throw Failure{option + ": an empty name"};
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored))
        throw Failure{option + ": '" + file.string() + "' is a folder"};
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (!std::filesystem::is_directory(folder, ignored))
        throw Failure{option + ": '" + folder.string() + "' is not a folder"};
}

}  // namespace

bool Options::runs(const std::string& part) const
{
    return parts.empty() || std::find(parts.begin(), parts.end(), part) != parts.end();
}

bool read_options(int argc, const char* const* argv, Options& options)
{
    bool rounds_given = false;
    for (int i = 1; i < argc; ++i) {
        std::string option = argv[i];
        std::string attached;
        const std::size_t equals = option.starts_with("--") ? option.find('=') : std::string::npos;
        const bool has_attached = equals != std::string::npos;
        if (has_attached) {
            attached = option.substr(equals + 1);
            option.resize(equals);
        }
        const auto value = [&]() -> std::string {
            if (has_attached) return attached;
            if (i + 1 == argc) throw Failure{option + ": needs a value"};
            return argv[++i];
        };
        const auto flag = [&] {
            if (has_attached) throw Failure{option + ": takes no value"};
        };
        if (option == "--help" || option == "-h") {
            flag();
            std::fputs(help, stdout);
            return false;
        } else if (option == "--version") {
            flag();
            std::printf("nook %s\n", nook::version);
            return false;
        } else if (option == "--quick") {
            flag();
            options.quick = true;
        } else if (option == "--rounds") {
            options.rounds = count(option, value(), 1, 10000);
            rounds_given = true;
        } else if (option == "--only") {
            const std::string part = value();
            if (std::find(std::begin(part_names), std::end(part_names), part) ==
                std::end(part_names))
                throw Failure{option + ": '" + part.substr(0, 60) +
                              "' is none of contenders, windows, threads, radius"};
            options.parts.push_back(part);
        } else if (option == "--json") {
            options.json = value();
            check_writable(option, options.json);
        } else {
            throw Failure{"unknown argument '" + option.substr(0, 60) + "'; see --help"};
        }
    }
    if (options.quick && !rounds_given) options.rounds = 3;
    return true;
}

}  // namespace compare
