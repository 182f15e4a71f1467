#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>
#include <nook/scene/viewpoints.hpp>
#include <nook/scene/visible_counts.hpp>

/// How finely viewpoints have to look at a mesh.
///
/// A polygon that covers about a sample or less per picture is hit in some pictures and missed in
/// others at random. Its p(v|o) then looks more concentrated than it is, and its mutual information
/// comes out too high: the dark rims of González, Sbert & Feixas 2008, section 4. Hits at random would
/// raise it by
///     (views that could see it) / (2 ln 2 · samples of it in all pictures) bits;
/// the grid of a picture does better the more samples there are. On a ball of 5120 triangles seen from
/// 162 viewpoints 2.5, 10 and 40 samples per triangle that faces the viewer leave 0.26, 0.035 and 0.006
/// bits, where the formula says 0.57, 0.14 and 0.04. The plan gives every polygon enough samples, and
/// small ones more samples per pixel than large ones.
namespace nook {

struct SamplingOptions {
    /// Pixels across each picture: 0 chooses, else 1 to 8192.
    int resolution = 0;
    /// The most that is chosen, 1 to 8192.
    int max_resolution = 2048;
    /// How many samples should show a polygon that faces the viewer, ≥ 0. 0: one sample per pixel
    /// everywhere; the resolution is then the most that may be chosen.
    double samples_per_polygon = 16;
    /// One per viewpoint, or null: all 1. Those of importance 0 do not matter.
    const double* importance = nullptr;
};

struct SamplingPlan {
    /// Pixels across each picture.
    int resolution = 0;
    /// How many usable polygons there are at each level: 1, 4 or 16 samples per pixel.
    std::size_t polygons[finest_level + 1] = {};
    /// How many of them get fewer samples than asked for even so.
    std::size_t below_target = 0;

    [[nodiscard]] NOOK_INLINE constexpr std::size_t usable() const
    {
        return polygons[0] + polygons[1] + polygons[2];
    }
};

/// A resolution that is chosen is at least this, so that the pictures show where large polygons hide
/// each other, and a multiple of `resolution_step`.
inline constexpr int least_resolution = 256, resolution_step = 64;
/// Counts of samples fit into 32 bits up to here.
inline constexpr int largest_information_resolution = 8192;

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Chooses the least resolution at which 99.9 % of the usable polygons get the samples asked for, and
/// for each polygon the least level that does it: 2^level × 2^level samples per pixel, as
/// `visible_counts` takes them. Since a level only costs where it is drawn, few pixels with fine levels
/// are cheaper than many pixels for all.
///
/// Levels do not depend on the viewpoint: they belong to a polygon that faces the viewer from the
/// centre of the mesh, in a picture whose pixels there have the mean area over the viewpoints.
///
/// `views`: view_count cameras; their pictures are square. `levels`: mesh.triangle_count, or null if
/// they are not wanted; unusable triangles get 0. O(triangles), serial.
[[nodiscard]] Error plan_sampling(const MeshView& mesh, const Camera* views, std::size_t view_count,
                                  const SamplingOptions& options, SamplingPlan& plan,
                                  std::uint8_t* levels);

namespace detail {

[[nodiscard]] inline Error check_sampling(const SamplingOptions& options)
{
    if (options.resolution < 0 || options.resolution > largest_information_resolution)
        return {ErrorCode::bad_value, "options.resolution", double(options.resolution),
                "1 to 8192 pixels, or 0 to choose"};
    if (options.max_resolution < 1 || options.max_resolution > largest_information_resolution)
        return {ErrorCode::bad_value, "options.max_resolution", double(options.max_resolution),
                "1 to 8192 pixels"};
    return check_at_least(options.samples_per_polygon, 0, "options.samples_per_polygon",
                          "a number of samples >= 0");
}

[[nodiscard]] inline Error check_views(const Camera* views, std::size_t view_count)
{
    if (view_count > 0 && views == nullptr)
        return {ErrorCode::null_data, "views", 0, "one camera per view"};
    for (std::size_t v = 0; v < view_count; ++v)
        if (const Error error = check_camera(views[v]))
            return {error.code, "index of a view", double(v), "cameras that pass check_camera"};
    return {};
}

/// Pixels per area at the centre of the mesh, in a picture of one pixel: the mean over the viewpoints.
/// An eye within the sphere counts as one on it.
[[nodiscard]] inline double pixels_per_area(const BoundingSphere& sphere, const Camera* views,
                                            std::size_t view_count, const double* importance)
{
    double sum = 0, drawn = 0;
    for (std::size_t v = 0; v < view_count; ++v) {
        if (importance != nullptr && !(importance[v] > 0)) continue;
        const Projection pixel = projection(views[v], 1, 1);
        const Vector3 apart = vector(sphere.centre) - vector(views[v].eye);
        const double square = larger(dot(apart, apart), sphere.radius * sphere.radius);
        sum += pixel.orthographic ? pixel.fx * pixel.fy : pixel.fx * pixel.fy / square;
        drawn += 1;
    }
    return drawn > 0 ? sum / drawn : 0;
}

/// `plan_sampling` with arguments that have been checked, and the sphere of the mesh.
inline void plan_samples(const MeshView& mesh, const BoundingSphere& sphere, const Camera* views,
                         std::size_t view_count, const SamplingOptions& options, SamplingPlan& plan,
                         std::uint8_t* levels)
{
    const double scale = pixels_per_area(sphere, views, view_count, options.importance);
    const double target = options.samples_per_polygon;
    const auto for_each_area = [&](const auto& f) {
        for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
            const bool usable = is_usable_triangle(mesh, t);
            double area = 0;
            if (usable) {
                const Triangle corners = mesh_triangle(mesh, t);
                const Vector3 normal = cross(corners.b - corners.a, corners.c - corners.a);
                area = std::sqrt(dot(normal, normal)) / 2 * scale;
            }
            f(t, usable, area);
        }
    };

    plan = {};
    plan.resolution = options.resolution;
    if (plan.resolution == 0) {
        plan.resolution = options.max_resolution;
        if (target > 0) {
            constexpr int finest_samples = 1 << 2 * finest_level;
            constexpr int steps = largest_information_resolution / resolution_step;
            // How many polygons need how many steps.
            std::size_t need[steps + 1] = {}, usable_count = 0;
            for_each_area([&](std::size_t, bool usable, double area) {
                if (!usable) return;
                ++usable_count;
                const double pixels = std::sqrt(target / (finest_samples * area));
                const double count = std::ceil(pixels / resolution_step);
                // An area of 0 pixels needs more than there is.
                ++need[count < steps ? static_cast<int>(count) : steps];
            });
            std::size_t lacking = usable_count;
            int step = 0;
            for (; step < steps; ++step) {
                lacking -= need[step];
                if (lacking <= usable_count / 1000) break;
            }
            const int chosen = step * resolution_step;
            plan.resolution = smaller(options.max_resolution, larger(chosen, least_resolution));
        }
    }
    const double pixels = double(plan.resolution) * plan.resolution;
    for_each_area([&](std::size_t t, bool usable, double area) {
        int level = 0;
        double samples = area * pixels;
        for (; usable && level < finest_level && samples < target; ++level) samples *= 4;
        if (levels != nullptr) levels[t] = static_cast<std::uint8_t>(level);
        if (!usable) return;
        ++plan.polygons[level];
        if (samples < target) ++plan.below_target;
    });
}

}  // namespace detail

inline Error plan_sampling(const MeshView& mesh, const Camera* views, std::size_t view_count,
                           const SamplingOptions& options, SamplingPlan& plan, std::uint8_t* levels)
{
    if (const Error error = check_mesh(mesh)) return error;
    if (const Error error = detail::check_views(views, view_count)) return error;
    if (const Error error = detail::check_sampling(options)) return error;
    detail::plan_samples(mesh, bounding_sphere(mesh), views, view_count, options, plan, levels);
    return {};
}

}  // namespace nook::inline NOOK_TARGET
