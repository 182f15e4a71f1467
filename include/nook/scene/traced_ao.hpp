#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <glm/vec3.hpp>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/hemisphere.hpp>
#include <nook/scene/sampling.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook {

struct TracedOptions {
    /// World units: a surface at a distance d <= radius occludes, one beyond does not. Infinity is
    /// allowed; 0 gives 1 everywhere.
    double radius = std::numeric_limits<double>::infinity();
    /// Rays per pixel, ≥ 1. Powers of two are stratified best.
    int directions = 256;
    /// Another seed gives another, independent set of directions.
    std::uint32_t seed = 0;
    /// How far the rasteriser may have moved a surface on the image, in pixels, ≥ 0: 2⁻¹² covers
    /// `nook::rasterise`; a GPU with 8 sub-pixel bits needs 2⁻⁸.
    double position_error = 0x1p-12;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Ambient occlusion by ray tracing: the share of cosine-weighted directions in which nothing lies
/// within the radius. The reference for every other kernel.
///
/// Shading points come from the G-buffer: `depth` under `projection`, and `normals` in view space
/// (of any length) as `rasterise` writes them. Each pixel takes its own Owen-scrambled Sobol set over
/// the hemisphere about its normal. Triangles occlude from both sides.
///
/// Normals are those of the triangles (flat). With interpolated ones, directions may point below the
/// geometric surface: they count as occluded, by the surface itself, and so a smooth convex body is
/// darker than 1 near its silhouettes.
///
/// Where there is no surface, or the normal is zero or not finite, the visibility is exactly 1. There,
/// and where nothing within the radius can be hit, no ray is traced; the latter are counted as
/// `skipped_rays`. Rays start a proven error bound above the surface, see `detail::point_error`; only a
/// shading point closer to another surface than the position error of the rasteriser may lie on the
/// wrong side of it. The same bits for any number of threads; on different instruction sets a ray that
/// grazes an edge may fall on its other side, which changes less than one pixel in a thousand, by one
/// ray. Tasks are bands of four rows.
template <DepthInput Depth, class V, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome traced_ao(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                  const ImageView<V>& visibility, const TracedOptions& options,
                  const Projection& projection, const ViewFrame& frame,
                  const WorkMap& work_map = {}, S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that `traced_ao` needs for a number of workers.
[[nodiscard]] std::size_t traced_ao_scratch_size(int workers);

/// The same estimate at one world-space point with a normal of any length, for baking and tests.
/// `error` bounds the distance of the point from its surface, in world units: for a vertex in float
/// 2⁻²³ of its largest coordinate; 0 for a point known in double. `sample` picks the set of
/// directions, as a pixel does. Options that `check_traced_options` rejects give 1.
[[nodiscard]] double traced_visibility(const Bvh& bvh, const glm::dvec3& point,
                                       const glm::dvec3& normal, const TracedOptions& options,
                                       std::uint32_t sample = 0, double error = 0);

/// Checks the ranges of the options.
[[nodiscard]] inline Error check_traced_options(const TracedOptions& options)
{
    if (detail::is_nan(options.radius) || options.radius < 0)
        return {ErrorCode::bad_value, "options.radius", options.radius,
                "a distance >= 0, or infinity"};
    if (options.directions < 1)
        return {ErrorCode::bad_value, "options.directions", double(options.directions),
                "a number >= 1"};
    return detail::check_at_least(options.position_error, 0, "options.position_error",
                                  "pixels, >= 0");
}

namespace detail {

/// A bound on how far below its surface a shading point in view space may lie.
///
/// The depth is one step off at most, which moves the point along the ray of its pixel: |n · r| steps
/// across the surface. The rasteriser draws the surface up to `position_error` pixels from its place:
/// |n_x| / f_x and |n_y| / f_y per pixel at unit distance. The normal is a rounded float. The rest is
/// rounding in double, of coordinates as large as the viewer's, the point's and the scene's: 2⁻⁵³
/// each, times 2⁹ for the handful of operations and the thin triangles that amplify them.
[[nodiscard]] inline double point_error(const Projection& projection, const Vector3& view,
                                        const Vector3& normal, double depth_step,
                                        double position_error)
{
    const double distance = -view.z;
    const double scale = projection.orthographic ? 1 : distance;
    const Vector3 along = projection.orthographic
                              ? Vector3{0, 0, -1}
                              : Vector3{view.x / distance, view.y / distance, -1};
    const double across = std::fabs(dot(normal, along)) + 0x1p-22 * (1 + largest(along));
    const double per_pixel =
        std::fabs(normal.x) / projection.fx + std::fabs(normal.y) / projection.fy;
    return depth_step * across + position_error * scale * per_pixel;
}
inline constexpr double rounding_error = 0x1p-44;

/// Rays that were traced, and how many of them were open.
struct RayCount {
    std::uint64_t rays = 0, open = 0;
};

/// Traces the hemisphere over a point that has been lifted off its surface.
[[nodiscard]] inline RayCount trace_hemisphere(const Bvh& bvh, const Vector3& start,
                                               const Vector3& normal, const TracedOptions& options,
                                               std::uint32_t sample)
{
    RayCount count;
    const Hemisphere hemisphere{bvh, start, normal, options.radius};
    if (hemisphere.empty()) return count;
    const ScrambledSobol points{hash(options.seed, sample)};
    const HemisphereBasis basis{normal};
    for (int i = 0; i < options.directions; ++i) {
        const Vector3 direction = basis.cosine_direction(points(static_cast<std::uint32_t>(i)));
        if (!hemisphere.occluded(direction)) ++count.open;
        ++count.rays;
    }
    return count;
}

/// The share of open directions; exactly 1 without a ray.
[[nodiscard]] inline double visibility_of(const RayCount& count)
{
    return count.rays == 0 ? 1 : static_cast<double>(count.open) / static_cast<double>(count.rays);
}

}  // namespace detail

inline double traced_visibility(const Bvh& bvh, const glm::dvec3& point, const glm::dvec3& normal,
                                const TracedOptions& options, std::uint32_t sample, double error)
{
    if (check_traced_options(options) || bvh.triangle_count() == 0 || options.radius == 0) return 1;
    if (!detail::is_finite(point) || !detail::is_finite(normal) || !detail::is_finite(error))
        return 1;
    const detail::Vector3 from = detail::vector(point);
    const detail::Vector3 up = normalised(detail::vector(normal));
    if (dot(up, up) == 0) return 1;
    const double lift =
        std::fabs(error) + detail::rounding_error * (detail::largest(from) + 2 * bvh.size());
    return detail::visibility_of(
        detail::trace_hemisphere(bvh, from + up * lift, up, options, sample));
}

inline std::size_t traced_ao_scratch_size(int workers)
{
    return detail::task_scratch_size(detail::NoMemory{}, workers);
}

template <DepthInput Depth, class V, ScratchSource S, Executor E>
Outcome traced_ao(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                  const ImageView<V>& visibility, const TracedOptions& options,
                  const Projection& projection, const ViewFrame& frame, const WorkMap& work_map,
                  S&& scratch, E&& executor)
{
    static_assert(std::is_floating_point_v<V>, "visibility is float or double");
    using detail::Vector3;
    const auto& source = depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    Outcome outcome{};
    Error& error = outcome.error;
    if ((error = detail::check_source(source))) return outcome;
    const ImageView<const float>* const channels[3] = {&normals.x, &normals.y, &normals.z};
    const char* const names[3] = {"normals.x", "normals.y", "normals.z"};
    for (int k = 0; k < 3; ++k) {
        if ((error = detail::check_input(*channels[k], names[k]))) return outcome;
        if ((error = detail::check_same_size(source.image, *channels[k], names[k]))) return outcome;
        if ((error = detail::check_apart(*channels[k], visibility, "visibility"))) return outcome;
    }
    if ((error = detail::check_output(visibility, "visibility"))) return outcome;
    if ((error = detail::check_same_size(source.image, visibility, "visibility"))) return outcome;
    if ((error = detail::check_apart(source.image, visibility, "visibility"))) return outcome;
    if ((error = check_traced_options(options))) return outcome;
    if ((error = check_projection(projection))) return outcome;
    if ((error = detail::check_frame(frame))) return outcome;
    if ((error = detail::check_work_map(work_map, visibility))) return outcome;
    if (source.image.empty()) return outcome;

    const detail::Frame axes{frame};
    const bool nothing = bvh.triangle_count() == 0 || options.radius == 0;
    const auto trace_pixel = [&](int x, int y, const auto distance, const Vector3& normal) {
        const ViewPoint at = view_point(projection, x + 0.5, y + 0.5, double{distance});
        const Vector3 view{at.x, at.y, at.z};
        const double lift =
            detail::point_error(projection, view, normal, source.step(double{distance}),
                                options.position_error) +
            detail::rounding_error *
                (detail::largest(axes.origin) + detail::largest(view) + 2 * bvh.size());
        const Vector3 up = normalised(axes.direction_to_world(normal));
        const Vector3 start = axes.origin + axes.direction_to_world(view + normal * lift);
        return detail::trace_hemisphere(
            bvh, start, up, options,
            hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)));
    };
    constexpr int band = 4;
    const auto trace_band = [&](Work& work, int, int task, int) {
        for (int y = task * band; y < (std::min)(task * band + band, height); ++y) {
            for (int x = 0; x < width; ++x) {
                visibility(x, y) = 1;
                const auto distance = surface_distance(source, x, y);
                const Vector3 stored{double{normals.x(x, y)}, double{normals.y(x, y)},
                                     double{normals.z(x, y)}};
                const Vector3 normal =
                    detail::is_finite(stored) ? normalised(stored) : Vector3{0, 0, 0};
                if (!(distance > 0) || dot(normal, normal) == 0) {
                    ++work.background;
                } else if (!work_map.is_active(x, y)) {
                    ++work.skipped;
                } else {
                    const detail::RayCount count =
                        nothing ? detail::RayCount{} : trace_pixel(x, y, distance, normal);
                    visibility(x, y) = static_cast<V>(detail::visibility_of(count));
                    work.rays += count.rays;
                    work.skipped_rays +=
                        static_cast<std::uint64_t>(options.directions) - count.rays;
                }
            }
        }
    };
    outcome = detail::run_tasks(detail::pieces(height, band), detail::NoMemory{}, trace_band,
                                scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
