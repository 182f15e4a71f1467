#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nook/scene/camera.hpp>

#include "compare/common_options.hpp"

namespace compare {

/// What to look at, and from where.
struct Subject {
    std::string name;  ///< of a built-in scene or an OBJ file
    std::optional<nook::Camera> camera;
};

struct Options : CommonOptions {
    /// Empty: built-in scenes.
    std::vector<Subject> subjects;
};

/// Reads the command line; false when it asked for help or the version, which is then printed.
/// Throws Failure with one line that names the argument.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace compare
