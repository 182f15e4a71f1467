#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace compare {

struct Options {
    int rounds = 15;
    /// Small images and few rounds: shows that everything runs, and says nothing about speed.
    bool quick = false;
    /// Where results go as JSON; empty: nowhere.
    std::filesystem::path json;
    /// The parts to run, out of `part_names`; empty: all.
    std::vector<std::string> parts;

    [[nodiscard]] bool runs(const std::string& part) const;
};

inline constexpr const char* part_names[] = {"contenders", "windows", "threads", "radius"};

/// Reads the command line; false when it asked for help or the version, which is then printed.
/// Throws Failure with one line that names the argument.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace compare
