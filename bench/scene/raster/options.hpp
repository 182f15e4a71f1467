#pragma once

#include <string>
#include <vector>

#include "compare/common_options.hpp"

namespace compare {

struct Options : CommonOptions {
    /// Numbers of triangles, names of scenes, and OBJ files; empty: 20 000, 300 000 and a million.
    std::vector<std::string> subjects;
};

/// Reads the command line; false when it asked for help or the version, which is then printed.
/// Throws Failure with one line that names the argument.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace compare
