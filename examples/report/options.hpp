#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nook/scene/camera.hpp>

namespace report {

/// What the command line asks for.
struct Options {
    std::vector<std::string> meshes;
    std::vector<std::string> scenes;
    int width = 960, height = 540;
    /// Replaces the camera of every scene; its orthographic part is set from `orthographic`.
    std::optional<nook::Camera> camera;
    bool orthographic = false;
    /// World units; unset: each scene's own.
    std::optional<double> radius;
    /// Directions per pixel of the reference, both halves together; even.
    int rays = 256;
    int threads = 1;
    std::filesystem::path folder = "nook-report";
};

/// Reads the command line. Returns false when it has been answered (--help, --list) and there is
/// nothing left to do. Throws support::Failure for bad input.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace report
