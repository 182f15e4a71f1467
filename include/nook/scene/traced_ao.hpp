#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
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
#include <nook/scene/traced_batch.hpp>
#include <nook/scene/traced_images.hpp>
#include <nook/scene/traced_options.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook {

/// Which triangle each pixel shows, as `rasterise` writes it, and the mesh that the ids index: the one
/// that the hierarchy was built from. `no_face` and ids beyond the mesh: as without ids.
struct SourceFaces {
    ImageView<const std::uint32_t> ids{};
    MeshView mesh{};
};

/// Points on surfaces, in world space: vertices or texels to bake.
struct ShadingPoints {
    /// Point i lies at positions[i * position_stride + 0, 1, 2]. Not finite: no surface.
    const float* positions = nullptr;
    /// Its normal, of any length; the side that is lit. Zero or not finite: no surface.
    const float* normals = nullptr;
    /// At most 2³¹ − 1.
    std::size_t count = 0;
    /// Floats from one to the next.
    std::ptrdiff_t position_stride = 3, normal_stride = 3;
    /// How far the points may lie from their surfaces, in world units, ≥ 0; negative: by the rounding of
    /// their own coordinates, 2⁻²³ of the largest.
    double error = -1;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Ray-traced ambient occlusion and obscurance: the share of directions about the normal,
/// cosine-weighted, along which nothing lies within a radius. The reference for every other kernel.
///
/// Shading points come from the G-buffer: `depth` under `projection`, and `normals` in view space (of
/// any length) as `rasterise` writes them. `output` is an `ImageView` of visibility, or `TracedImages`
/// for bent normals, radiance and weights beside it. Each pixel takes its own set of directions.
/// Triangles occlude from both sides. `options` says what is estimated: the falloff, secondary rays,
/// colour.
///
/// Where there is no surface, or the normal is zero or not finite, the visibility is exactly 1. There,
/// and where nothing within the radius can be hit, no ray is traced; the latter are counted as
/// `skipped_rays`, among them secondary rays that nothing can block.
///
/// Without face ids rays start a proven error bound above the surface, see `detail::point_error`; only a
/// shading point closer to another surface than the position error of the rasteriser may lie on the
/// wrong side of it. Normals are then those of the triangles: directions of interpolated ones that
/// point below the triangle hit the surface itself. With ids points are put onto the triangle's plane,
/// the triangle and its coplanar neighbours hide nothing, and directions below its plane are left out of
/// the mean, so that a smooth convex body is exactly 1.
///
/// The same bits for any number of threads, and on every instruction set (not under -ffast-math).
/// Tasks are bands of eight rows.
template <DepthInput Depth, class Output, class Options = TracedOptions<>,
          ScratchSource S = HeapScratch, Executor E = Serial>
Outcome traced_ao(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                  const Output& output, const Options& options, const Projection& projection,
                  const ViewFrame& frame, const WorkMap& work_map = {}, S&& scratch = S{},
                  E&& executor = E{});
template <DepthInput Depth, class Output, class Options = TracedOptions<>,
          ScratchSource S = HeapScratch, Executor E = Serial>
Outcome traced_ao(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                  const SourceFaces& faces, const Output& output, const Options& options,
                  const Projection& projection, const ViewFrame& frame,
                  const WorkMap& work_map = {}, S&& scratch = S{}, E&& executor = E{});

/// The same for any list of points. `output` is `points.count` × 1; bent normals are in world axes.
/// Point i takes the directions of sample i. Points that follow each other should lie together.
/// Tasks are 256 points.
template <class Output, class Options = TracedOptions<>, ScratchSource S = HeapScratch,
          Executor E = Serial>
Outcome traced_ao(const Bvh& bvh, const ShadingPoints& points, const Output& output,
                  const Options& options, S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that `traced_ao` needs for a number of workers.
[[nodiscard]] std::size_t traced_ao_scratch_size(int workers);

/// The same estimate at one world-space point with a normal of any length. `error` bounds the distance
/// of the point from its surface, in world units: negative for a vertex in float, 2⁻²³ of its largest
/// coordinate; 0 for a point known in double. `sample` picks the set of directions, as a pixel does.
/// Options that `check_traced_options` rejects give 1.
template <class Options = TracedOptions<>>
[[nodiscard]] double traced_visibility(const Bvh& bvh, const glm::dvec3& point,
                                       const glm::dvec3& normal, const Options& options,
                                       std::uint32_t sample = 0, double error = 0);

/// The directions that a point with this normal takes: `options.directions` of them, x, y and z side by
/// side, in world axes and of unit length to float rounding. Sample hash(x, y) is that of a pixel.
/// Nothing is written for options that `check_traced_options` rejects or a normal that is none.
template <class Options = TracedOptions<>>
void traced_directions(const Options& options, const glm::dvec3& normal, std::uint32_t sample,
                       float* xyz);

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
    const double across = std::fabs(dot(normal, along)) + rounded(0x1p-22 * (1 + largest(along)));
    const double per_pixel =
        std::fabs(normal.x) / projection.fx + std::fabs(normal.y) / projection.fy;
    return rounded(depth_step * across) + rounded(position_error * scale * per_pixel);
}
inline constexpr double rounding_error = 0x1p-44;

/// A point in world space that has been lifted off its surface by what may be wrong with it.
[[nodiscard]] inline ShadingPoint lifted_point(const Bvh& bvh, const Vector3& world,
                                               const Vector3& normal, double lift,
                                               std::uint32_t sample)
{
    return {bvh.space().to_scene(world + normal * lift), normal, normal, 0, sample};
}
/// A point in world space that lies on a triangle of the mesh, or off it along its normal.
[[nodiscard]] inline ShadingPoint point_on_face(const Bvh& bvh, const Vector3& world,
                                                const Vector3& normal, const Triangle& face,
                                                double lift, std::uint32_t sample)
{
    const Vector3 plane = normalised(cross(face.b - face.a, face.c - face.a));
    const Vector3 surface = dot(plane, normal) < 0 ? -plane : plane;
    const Vector3 foot = world - surface * dot(surface, world - face.a);
    // Vertices of coplanar triangles are rounded to float, each in its own way; across the plane by the
    // share that each axis has in its normal.
    const auto across = [&](double share, double a, double b, double c) {
        return std::fabs(share) * (std::max)({std::fabs(a), std::fabs(b), std::fabs(c)});
    };
    const double size = rounded(across(surface.x, face.a.x, face.b.x, face.c.x)) +
                        rounded(across(surface.y, face.a.y, face.b.y, face.c.y)) +
                        rounded(across(surface.z, face.a.z, face.b.z, face.c.z));
    const double slack = 0x1p-23 * size * bvh.space().scale;
    return {bvh.space().to_scene(foot + surface * lift), normal, surface, slack, sample};
}

/// Writes what a pixel gets. Bent normals are turned by `turn`.
template <class Images, class Turn>
void write_point(const Images& images, int x, int y, const PointSums& sums, const Vector3& normal,
                 const Turn& turn)
{
    using V = std::remove_cvref_t<decltype(images.visibility(0, 0))>;
    images.visibility(x, y) = static_cast<V>(sums.visibility());
    const auto put = [&](const ImageView3<V>& to, const Vector3& value) {
        to.x(x, y) = static_cast<V>(value.x);
        to.y(x, y) = static_cast<V>(value.y);
        to.z(x, y) = static_cast<V>(value.z);
    };
    if constexpr (Images::has_bent) {
        const Vector3 bent = normalised(sums.bent);
        put(images.bent_normals, turn(dot(bent, bent) > 0 ? bent : normal));
    }
    if constexpr (Images::has_radiance) {
        const double share = sums.count > 0 ? 1.0 / sums.count : 0;
        put(images.radiance, Vector3{sums.colour[0], sums.colour[1], sums.colour[2]} * share);
    }
    if constexpr (Images::has_weight) images.weight(x, y) = static_cast<V>(sums.count);
}

template <class Images, class Options>
[[nodiscard]] Error check_traced(const Images& images, const Options& options)
{
    static_assert(Images::has_radiance == Options::has_colour,
                  "radiance needs options.colour, and the colour an image of radiance");
    if (const Error error = check_traced_images(images)) return error;
    return check_traced_options(options);
}

template <class Depth, class Images, class Options, class S, class E>
Outcome trace_g_buffer(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                       const SourceFaces* faces, const Images& images, const Options& options,
                       const Projection& projection, const ViewFrame& frame,
                       const WorkMap& work_map, S&& scratch, E&& executor)
{
    const auto& source = depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    Outcome outcome{};
    Error& error = outcome.error;
    if ((error = check_source(source))) return outcome;
    const auto check_read = [&](const auto& image, const char* name) -> Error {
        if (const Error failed = check_input(image, name)) return failed;
        if (const Error failed = check_same_size(source.image, image, name)) return failed;
        return check_each_image(images, [&](const auto& output, const char* written) {
            return check_apart(image, output, written);
        });
    };
    const ImageView<const float>* const channels[3] = {&normals.x, &normals.y, &normals.z};
    const char* const names[3] = {"normals.x", "normals.y", "normals.z"};
    for (int k = 0; k < 3; ++k)
        if ((error = check_read(*channels[k], names[k]))) return outcome;
    if (faces != nullptr) {
        if ((error = check_read(faces->ids, "faces.ids"))) return outcome;
        if ((error = check_mesh(faces->mesh))) return outcome;
    }
    if ((error = check_output(images.visibility, "visibility"))) return outcome;
    if ((error = check_same_size(source.image, images.visibility, "visibility"))) return outcome;
    if ((error = check_read(source.image, "depth"))) return outcome;
    if ((error = check_traced(images, options))) return outcome;
    if ((error = check_projection(projection))) return outcome;
    if ((error = check_frame(frame))) return outcome;
    if ((error = check_work_map(work_map, images.visibility))) return outcome;
    if ((error = check_each_image(images, [&](const auto& image, const char*) {
             return check_apart(work_map.active, image, "work_map.active");
         })))
        return outcome;
    if (source.image.empty()) return outcome;

    const Frame axes{frame};
    const PointTracer<Options, Images::has_bent> tracer{bvh, options};
    const auto to_view = [&](const Vector3& v) { return axes.direction_to_view(v); };
    const auto shading_point = [&](int x, int y, double distance, const Vector3& normal) {
        const ViewPoint at = view_point(projection, x + 0.5, y + 0.5, distance);
        const Vector3 view{at.x, at.y, at.z};
        const double rounding =
            rounding_error * (largest(axes.origin) + largest(view) + rounded(2 * bvh.size()));
        const Vector3 up = normalised(axes.direction_to_world(normal));
        const Vector3 world = axes.origin + axes.direction_to_world(view);
        const std::uint32_t sample =
            hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
        if (faces != nullptr) {
            const std::uint32_t id = faces->ids(x, y);
            if (id < faces->mesh.triangle_count && is_usable_triangle(faces->mesh, id))
                return point_on_face(bvh, world, up, mesh_triangle(faces->mesh, id), rounding,
                                     sample);
        }
        const double lift =
            rounded(rounding) +
            point_error(projection, view, normal, source.step(distance), options.position_error);
        return lifted_point(bvh, world, up, lift, sample);
    };
    constexpr int tile = 8;
    const auto trace_band = [&](Work& work, int, int task, int) {
        Neighbourhood around{bvh.view()};
        TracedBatch batch;
        const int top = task * tile, bottom = top + (std::min)(tile, height - top);
        for (int column = 0; column < pieces(width, tile); ++column) {
            const int left = column * tile, right = left + (std::min)(tile, width - left);
            for (int y = top; y < bottom; ++y)
                for (int x = left; x < right; ++x) {
                    const auto distance = surface_distance(source, x, y);
                    const Vector3 stored{double{normals.x(x, y)}, double{normals.y(x, y)},
                                         double{normals.z(x, y)}};
                    const Vector3 normal =
                        is_finite(stored) ? normalised(stored) : Vector3{0, 0, 0};
                    const bool surface = distance > 0 && dot(normal, normal) > 0;
                    if (surface && work_map.is_active(x, y)) {
                        batch.add(x, y) = shading_point(x, y, double{distance}, normal);
                        continue;
                    }
                    ++(surface ? work.skipped : work.background);
                    write_point(images, x, y, {}, surface ? normal : Vector3{0, 0, 0},
                                [](const Vector3& v) { return v; });
                }
            batch.trace(tracer, around, work,
                        [&](const PointSums& sums, const ShadingPoint& point, int x, int y) {
                            write_point(images, x, y, sums, point.normal, to_view);
                        });
        }
    };
    outcome = run_tasks(pieces(height, tile), NoMemory{}, trace_band, scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

/// A point of a list in world space, lifted; false where there is no surface.
[[nodiscard]] inline bool listed_point(const Bvh& bvh, const Vector3& position,
                                       const Vector3& normal, double error, std::uint32_t sample,
                                       ShadingPoint& point)
{
    if (!is_finite(position) || !is_finite(normal)) return false;
    const Vector3 up = normalised(normal);
    if (dot(up, up) == 0) return false;
    const double off = error < 0 ? 0x1p-23 * largest(position) : error;
    const double lift =
        off + rounded(rounding_error * (largest(position) + rounded(2 * bvh.size())));
    point = lifted_point(bvh, position, up, lift, sample);
    return true;
}

}  // namespace detail

template <DepthInput Depth, class Output, class Options, ScratchSource S, Executor E>
Outcome traced_ao(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                  const Output& output, const Options& options, const Projection& projection,
                  const ViewFrame& frame, const WorkMap& work_map, S&& scratch, E&& executor)
{
    return detail::trace_g_buffer(bvh, depth, normals, nullptr, detail::traced_images(output),
                                  options, projection, frame, work_map, scratch, executor);
}

template <DepthInput Depth, class Output, class Options, ScratchSource S, Executor E>
Outcome traced_ao(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                  const SourceFaces& faces, const Output& output, const Options& options,
                  const Projection& projection, const ViewFrame& frame, const WorkMap& work_map,
                  S&& scratch, E&& executor)
{
    return detail::trace_g_buffer(bvh, depth, normals, &faces, detail::traced_images(output),
                                  options, projection, frame, work_map, scratch, executor);
}

template <class Output, class Options, ScratchSource S, Executor E>
Outcome traced_ao(const Bvh& bvh, const ShadingPoints& points, const Output& output,
                  const Options& options, S&& scratch, E&& executor)
{
    using detail::Vector3;
    const auto& images = detail::traced_images(output);
    using Images = std::remove_cvref_t<decltype(images)>;
    Outcome outcome{};
    Error& error = outcome.error;
    constexpr std::size_t most = 0x7fffffff;
    if (points.count > most) {
        error = {ErrorCode::bad_size, "points.count", double(points.count), "at most 2^31 - 1"};
        return outcome;
    }
    const int count = static_cast<int>(points.count);
    const auto check_read = [&](const float* data, std::ptrdiff_t stride,
                                const char* name) -> Error {
        const ImageView<const float> values{data, count, count > 0 ? 1 : 0, 0, stride};
        if (const Error failed = detail::check_input(values, name)) return failed;
        return detail::check_each_image(images, [&](const auto& image, const char* written) {
            // Each point is three floats.
            ImageView<const float> coordinate = values;
            for (int k = 0; k < 3 && data != nullptr; ++k, ++coordinate.data)
                if (const Error failed = detail::check_apart(coordinate, image, written))
                    return failed;
            return Error{};
        });
    };
    if ((error = check_read(points.positions, points.position_stride, "points.positions")))
        return outcome;
    if ((error = check_read(points.normals, points.normal_stride, "points.normals")))
        return outcome;
    if (detail::is_nan(points.error) || points.error > (std::numeric_limits<double>::max)()) {
        error = {ErrorCode::bad_value, "points.error", points.error, "a finite distance"};
        return outcome;
    }
    if (images.visibility.width != count || images.visibility.height != (count > 0 ? 1 : 0)) {
        if (!(count == 0 && images.visibility.empty())) {
            error = {ErrorCode::bad_size, "visibility", double(images.visibility.width),
                     "points.count x 1 pixels"};
            return outcome;
        }
    }
    if ((error = detail::check_traced(images, options))) return outcome;
    if (count == 0) return outcome;

    const detail::PointTracer<Options, Images::has_bent> tracer{bvh, options};
    const auto as_it_is = [](const Vector3& v) { return v; };
    constexpr int piece = 256;
    const auto trace_piece = [&](Work& work, int, int task, int) {
        detail::Neighbourhood around{bvh.view()};
        detail::TracedBatch batch;
        const int first = task * piece, last = (std::min)(count - first, piece) + first;
        for (int i = first; i < last; ++i) {
            const auto vector_at = [&](const float* data, std::ptrdiff_t stride) {
                const float* const at = data + i * stride;
                return Vector3{double{at[0]}, double{at[1]}, double{at[2]}};
            };
            const Vector3 position = vector_at(points.positions, points.position_stride);
            const Vector3 normal = vector_at(points.normals, points.normal_stride);
            if (!detail::listed_point(bvh, position, normal, points.error,
                                      static_cast<std::uint32_t>(i), batch.add(i, 0))) {
                batch.drop_last();
                ++work.background;
                detail::write_point(images, i, 0, {}, Vector3{0, 0, 0}, as_it_is);
            }
            if (batch.full() || i + 1 == last)
                batch.trace(
                    tracer, around, work,
                    [&](const detail::PointSums& sums, const detail::ShadingPoint& at, int x,
                        int y) { detail::write_point(images, x, y, sums, at.normal, as_it_is); });
        }
    };
    outcome = detail::run_tasks(detail::pieces(count, piece), detail::NoMemory{}, trace_piece,
                                scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels = points.count;
    outcome.work.passes = 1;
    return outcome;
}

inline std::size_t traced_ao_scratch_size(int workers)
{
    return detail::task_scratch_size(detail::NoMemory{}, workers);
}

template <class Options>
double traced_visibility(const Bvh& bvh, const glm::dvec3& point, const glm::dvec3& normal,
                         const Options& options, std::uint32_t sample, double error)
{
    detail::ShadingPoint at{};
    if (check_traced_options(options) || !detail::is_finite(error) ||
        !detail::listed_point(bvh, detail::vector(point), detail::vector(normal), error, sample,
                              at))
        return 1;
    const detail::Neighbourhood around{bvh.view()};
    const detail::PointTracer<Options, false> tracer{bvh, options};
    return tracer.trace(around, at).visibility();
}

template <class Options>
void traced_directions(const Options& options, const glm::dvec3& normal, std::uint32_t sample,
                       float* xyz)
{
    using detail::RayFan;
    const detail::Vector3 up = normalised(detail::vector(normal));
    if (check_traced_options(options) || !detail::is_finite(up) || dot(up, up) == 0) return;
    RayFan fan;
    detail::for_each_batch(options.directions, [&](std::uint32_t first, int count) {
        detail::fill_fan(options, up, sample, first, count, fan);
        for (int i = 0; i < count; ++i)
            for (int k = 0; k < 3; ++k) *xyz++ = fan.direction[k][i];
    });
}

}  // namespace nook::inline NOOK_TARGET
