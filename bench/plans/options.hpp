#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/common_options.hpp"

namespace compare {

struct Options : CommonOptions {
    /// Built-in scenes and OBJ files; empty: those of the marks.
    std::vector<std::string> subjects;
    /// Of the tolerant plans, in visibility.
    double tolerance = 0.01;
    /// The instruction set, as `Kernels::name`; empty: the best that the CPU has.
    std::string target{};
    /// A folder for pictures of the plans; empty: none.
    std::filesystem::path pictures{};

    [[nodiscard]] int width() const { return quick ? 320 : 1920; }
    [[nodiscard]] int height() const { return quick ? 180 : 1080; }
};

/// Reads the command line; false when it asked for help or the version, which is then printed.
/// Throws Failure with one line that names the argument.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace compare
