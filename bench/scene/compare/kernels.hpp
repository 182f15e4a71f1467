#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/ray.hpp>

#include "compare/targets.hpp"
#include "compare/threads.hpp"

namespace compare {

/// Points off surfaces, with their normals; x, y, z side by side.
struct Points {
    const float* positions = nullptr;
    const float* normals = nullptr;
    /// The normals brought to unit length in double, so that nobody else has to.
    const double* axes = nullptr;
    std::size_t count = 0;
};

/// Which rays leave a point, the same for every contender.
struct Sampling {
    double radius = 0;  ///< the value of a float, or infinity
    int directions = 16;
    std::uint32_t seed = 0;
};
/// The loops below, nook's kernels and random rays apart, take no more directions than this.
inline constexpr int most_directions = 64;

/// The corners of triangles, by coordinate: a x, a y, a z, b x, …; `count` a multiple of eight.
struct Soup {
    const double* corners[9] = {};
    std::size_t count = 0;
};
struct SoupRay {
    double origin[3], direction[3], radius;
};

/// A G-buffer, and what to trace from it.
struct PictureJob {
    nook::ImageView<const float> depth;
    nook::ImageView3<const float> normals;
    nook::Projection projection;
    nook::ViewFrame frame;
    nook::ImageView<float> visibility;
    bool secondary_rays = false;
};

/// What is compiled once per instruction set: nook, and the loops around Embree's calls, so that
/// whoever fills packets does it in registers as wide as those that nook has.
///
/// A Bvh belongs to the instruction set that made it and so is a `void*` here; so is Embree's scene.
/// Kernels over points write the share of open rays of each. But for `embree_random` all of them
/// get the rays of a point, within the call, from one and the same function.
struct Kernels {
    const char* name;

    void* (*make_bvh)();
    void (*free_bvh)(void* bvh);
    nook::Outcome (*build)(void* bvh, const nook::MeshView& mesh, const Threads& threads);
    std::size_t (*memory_size)(const void* bvh);
    bool (*occluded)(const void* bvh, const nook::Ray& ray);

    /// The kernel for lists of points.
    nook::Outcome (*traced_ao)(const void* bvh, const Points& points, const Sampling& sampling,
                               float* visibility, const Threads& threads);
    /// The kernel for G-buffers; null before it has secondary rays.
    nook::Outcome (*traced_picture)(const void* bvh, const PictureJob& job,
                                    const Sampling& sampling, const Threads& threads);
    /// Bvh::occluded, ray by ray.
    void (*single_rays)(const void* bvh, const Points& points, const Sampling& sampling,
                        float* visibility);
    /// The rays of one point: x, y, z side by side.
    void (*directions)(const Points& points, std::size_t point, const Sampling& sampling,
                       float* xyz);

    /// rtcOccluded1, ray by ray. These are null when the program was built without Embree.
    void (*embree_single)(void* scene, const Points& points, const Sampling& sampling,
                          float* visibility);
    /// rtcOccluded16: packets of rays of one point, written from registers.
    void (*embree_packets)(void* scene, const Points& points, const Sampling& sampling,
                           float* visibility);
    /// rtcOccluded1M, incoherent; null with Embree 4, too, which has no streams.
    void (*embree_stream)(void* scene, const Points& points, const Sampling& sampling,
                          float* visibility);
    /// rtcOccluded1 as most programs call it: independent random directions, any number.
    void (*embree_random)(void* scene, const Points& points, const Sampling& sampling,
                          float* visibility);
    /// rtcOccluded1 for one ray.
    bool (*embree_occluded)(void* scene, const float* origin, const float* direction,
                            double radius);

    /// Whether each ray meets a triangle within its radius: every triangle is tried, in double.
    void (*brute_force)(const Soup& soup, const SoupRay* rays, std::size_t count, bool* hits);
};

using Targets = TargetsOf<Kernels>;
[[nodiscard]] Targets targets();

}  // namespace compare
