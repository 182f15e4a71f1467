#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "arguments.hpp"

namespace compare {

/// What every comparison can be told.
struct CommonOptions {
    int rounds = 1;  ///< of every rotation
    /// Small inputs and few rounds: shows that everything runs, and says nothing about speed.
    bool quick = false;
    /// Where results go as JSON; empty: nowhere.
    std::filesystem::path json{};
    /// The parts to run; empty: all.
    std::vector<std::string> parts{};

    [[nodiscard]] bool runs(const std::string& part) const;
};

/// How a program differs in what it can be told.
struct CommandLine {
    const char* help;
    std::span<const char* const> parts;  ///< what --only takes
    int rounds, quick_rounds;            ///< unless --rounds says otherwise
};

/// Reads --help, --version, --quick, --rounds, --only and --json; `other` takes any other word. False
/// when the command line asked for help or the version, which is then printed. Throws Failure with
/// one line that names the argument.
[[nodiscard]] bool read_common(int argc, const char* const* argv, const CommandLine& line,
                               CommonOptions& options,
                               const std::function<void(Arguments&)>& other = &Arguments::unknown);

}  // namespace compare
