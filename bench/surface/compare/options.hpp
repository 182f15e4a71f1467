#pragma once

#include <string>
#include <vector>

#include "compare/common_options.hpp"

namespace compare {

struct Options : CommonOptions {
    /// Names of scenes, `rolling` among them, and OBJ files; empty: some of them.
    std::vector<std::string> subjects;
    /// How many pixels of a picture of 1080 rows the radius covers on average; 0: what the scenes say.
    int reach = 52;
};

/// Reads the command line; false when it asked for help or the version, which is then printed.
/// Throws Failure with one line that names the argument.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace compare
