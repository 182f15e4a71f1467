#pragma once

#include <cstdint>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/rgb.hpp"

namespace path_tracer {

struct Options {
    int width = 960, height = 540;
    int samples = 64;     ///< paths per pixel, ≥ 1; powers of two converge fastest
    int bounces = 6;      ///< reflections at most, ≥ 0; without any, all light comes from the sky
    float albedo = 0.7f;  ///< of every surface
    bool colours = false;  ///< the scene's own albedo instead, where it has one
};

/// Radiance, linear light, top row first.
struct Light {
    std::vector<support::Rgb> pixels;
    std::uint64_t rays = 0;
};

/// A picture of diffuse surfaces under a sky, by paths from the viewer. The same bits for any number
/// of threads.
[[nodiscard]] Light trace(const nook::Bvh& bvh, const scenes::Scene& scene, const Options& options,
                          nook::ThreadExecutor& threads);

}  // namespace path_tracer
