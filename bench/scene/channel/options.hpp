#pragma once

#include <string>

#include "compare/common_options.hpp"

namespace compare {

struct Options : CommonOptions {
    /// A scene or an OBJ file; empty: a bumpy sphere.
    std::string subject;
    int triangles = 1'000'000;  ///< of the bumpy sphere
    int level = 3;              ///< of the icosphere of viewpoints
    int resolution = 512;       ///< of the channel
    int threads = 1;
};

/// Reads the command line; false when it asked for help or the version, which is then printed.
/// Throws Failure with one line that names the argument.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace compare
