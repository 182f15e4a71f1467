#pragma once

#include <cstdint>

#include <nook/owned_image.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "progress.hpp"
#include "view.hpp"

namespace report {

/// Ray-traced visibility: the mean of two halves with directions of their own.
struct Reference {
    nook::Image<float> visibility;
    int rays = 0;  ///< directions per pixel, both halves together
    double radius = 0;
    double seconds = 0;        ///< of tracing, with all threads
    double build_seconds = 0;  ///< of building the hierarchy
    /// Of `visibility`: RMS(half − other half) / 2 over the surface pixels.
    double standard_error = 0;
    std::uint64_t rays_traced = 0, rays_skipped = 0;  ///< of both halves
    std::size_t dropped = 0;  ///< triangles without area or with vertices that are not finite
};

[[nodiscard]] Reference trace(const scenes::Scene& scene, const View& view, double radius, int rays,
                              nook::ThreadExecutor& threads, Progress& progress);

}  // namespace report
