#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>

#include <glm/vec3.hpp>

#include <nook/scene/viewpoint_channel.hpp>

#include "../support/arguments.hpp"
#include "light.hpp"

namespace information {

/// What the command line says.
struct CommandLine {
    std::string scene = "cup";
    std::filesystem::path folder = "nook-information-ao";
    support::PictureSize size;
    int level = 3;
    int resolution = 0;  ///< 0: chosen from the mesh
    int samples = 16;    ///< per polygon
    double clip = 1;     ///< percent of the polygons that share black
    int directions = 256;
    int threads = 1;
    /// Of the eyes, in radii; infinite: orthographic.
    double distance = std::numeric_limits<double>::infinity();
    nook::ViewProbability probability = nook::ViewProbability::projected_area;
    /// Of unit length.
    std::optional<glm::dvec3> importance;
    std::optional<Light> light;
    bool refine = false;
};

/// Computes, draws, prints. Throws support::Failure.
void run(const CommandLine& command);

}  // namespace information
