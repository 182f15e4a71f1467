#pragma once

#include <cstdint>

#include <nook/measure/error.hpp>
#include <nook/owned_image.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/progress.hpp"
#include "view.hpp"

namespace report {

/// What kernels are compared with. (a) Ray-traced visibility of the scene: the mean of two halves with
/// directions of their own. (b) That of the depth buffer as the only geometry. So (a) − (b) is what the
/// depth buffer does not know.
struct Reference {
    nook::Image<float> visibility;
    int rays = 0;  ///< directions per pixel, both halves together
    double radius = 0;
    double seconds = 0;        ///< of tracing, with all threads
    double build_seconds = 0;  ///< of building the hierarchy
    /// Of `visibility`: RMS(half − other half) / 2 over the surface pixels.
    double standard_error = 0;
    std::uint64_t rays_traced = 0, rays_skipped = 0;  ///< of both halves
    /// Rows that are computed: one in `height_field_step`; the others repeat the nearest one.
    nook::Image<float> height_field;
    int height_field_step = 1;
    int slices = 32;                  ///< of the height field
    double height_field_seconds = 0;  ///< with all threads
    /// The height field against the traced one.
    nook::ErrorMetrics unknown;
    std::size_t dropped = 0;  ///< triangles without area or with vertices that are not finite

    [[nodiscard]] bool computes_height_field(int y) const
    {
        return y % height_field_step == height_field_step / 2;
    }
};

[[nodiscard]] Reference trace(const scenes::Scene& scene, const View& view, double radius, int rays,
                              nook::ThreadExecutor& threads, support::Progress& progress);

}  // namespace report
