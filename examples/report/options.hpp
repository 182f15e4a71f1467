#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nook/scene/camera.hpp>

#include "comparison.hpp"

namespace report {

/// What the command line asks for.
struct Options {
    std::vector<std::string> meshes;
    std::vector<std::string> scenes;
    /// Fewer settings, one radius, small pictures: two minutes on two cores.
    bool quick = false;
    int width = 640, height = 360;
    /// Replaces the camera of every scene; its orthographic part is set from `orthographic`.
    std::optional<nook::Camera> camera;
    bool orthographic = false;
    /// World units; unset: multiples of each scene's own.
    std::optional<double> radius;
    /// Directions per pixel of the traced references, both halves together; even.
    int directions = 2048;
    int threads = 1;
    std::filesystem::path folder = "nook-report";
    /// An earlier report.json to hold this one against.
    std::optional<std::filesystem::path> compare;
    Tolerances tolerances;
    /// As it was given, for the record.
    std::string command;

    /// All built-in scenes, and with them what belongs to no scene.
    [[nodiscard]] bool whole() const { return meshes.empty() && scenes.empty(); }
};

/// Reads the command line. Returns false when it has been answered (--help, --list) and there is
/// nothing left to do. Throws support::Failure for bad input.
[[nodiscard]] bool read_options(int argc, const char* const* argv, Options& options);

}  // namespace report
