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
#include <nook/scene/traced_input.hpp>
#include <nook/scene/traced_options.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook {

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
/// `skipped_rays`, among them secondary rays that nothing can block. Flat tiles of 8 × 8 pixels are told at
/// once. An exact work map changes no bit of any image.
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

/// Writes a tile of which every surface is open in all directions, `rays` in number, and the rest
/// background. No bent normals.
template <class Input, class Images>
void write_open(const Input& input, const Images& images, const PixelRect& tile, int directions,
                std::uint64_t rays, Work& work)
{
    PointSums open;
    open.open = open.count = directions;
    for (int y = tile.top; y < tile.bottom; ++y)
        for (int x = tile.left; x < tile.right; ++x) {
            const bool surface = surface_distance(input.source(), x, y) > 0;
            if (surface) work.skipped_rays += rays;
            else ++work.background;
            write_point(images, x, y, surface ? open : PointSums{}, Vector3{0, 0, 0},
                        [](const Vector3& v) { return v; });
        }
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
    if ((error = check_traced_input(source, normals, faces))) return outcome;
    if ((error = check_output(images.visibility, "visibility"))) return outcome;
    if ((error = check_same_size(source.image, images.visibility, "visibility"))) return outcome;
    if ((error = check_each_input(source, normals, faces, [&](const auto& image, const char*) {
             return check_each_image(images, [&](const auto& output, const char* written) {
                 return check_apart(image, output, written);
             });
         })))
        return outcome;
    if ((error = check_traced(images, options))) return outcome;
    if ((error = check_projection(projection))) return outcome;
    if ((error = check_frame(frame))) return outcome;
    if ((error = check_work_map(work_map, images.visibility))) return outcome;
    if ((error = check_each_image(images, [&](const auto& image, const char*) {
             return check_apart(work_map.active, image, "work_map.active");
         })))
        return outcome;
    if (source.image.empty()) return outcome;

    const TracedInput input{bvh, source, normals, faces, projection, frame, options.position_error};
    const PointTracer<Options, Images::has_bent> tracer{bvh, options};
    const auto to_view = [&](const Vector3& v) { return input.axes().direction_to_view(v); };
    const auto as_it_is = [](const Vector3& v) { return v; };
    // What an exact map spares is open, but its directions are still asked for.
    const bool keeps_rest = work_map.exact && (Images::has_bent || Images::has_weight);
    const Neighbourhood nowhere{BvhView{}};
    const std::uint64_t open_rays =
        static_cast<std::uint64_t>(options.directions) * tracer.rays_per_open_direction();
    const auto trace_band = [&](Work& work, int, int task, int) {
        Neighbourhood around{bvh.view()};
        TracedBatch batch;
        TangentPlanes planes{rounded_up(tracer.reach())};
        const int top = task * traced_tile, bottom = top + (std::min)(traced_tile, height - top);
        for (int column = 0; column < pieces(width, traced_tile); ++column) {
            const int left = column * traced_tile,
                      right = left + (std::min)(traced_tile, width - left);
            const PixelRect tile{left, top, right, bottom};
            if constexpr (!Images::has_bent) {
                // Most of what is open is open as a whole.
                const TilePixels found = input.scan(tile, work_map, planes);
                if (found == TilePixels::background ||
                    (found == TilePixels::flat && around.nothing_meets(planes))) {
                    write_open(input, images, tile, options.directions, open_rays, work);
                    continue;
                }
            }
            for (int y = top; y < bottom; ++y)
                for (int x = left; x < right; ++x) {
                    const auto distance = surface_distance(source, x, y);
                    const bool surface = distance > 0 && input.has_normal(x, y);
                    const bool active = work_map.is_active(x, y);
                    if (surface && (active || keeps_rest)) {
                        const ShadingPoint point =
                            input.point(x, y, double{distance}, input.normal(x, y));
                        if (active) batch.add(x, y) = point;
                        else
                            write_point(images, x, y, tracer.trace(nowhere, point), point.normal,
                                        to_view);
                    } else {
                        write_point(
                            images, x, y, {},
                            surface && Images::has_bent ? input.normal(x, y) : Vector3{0, 0, 0},
                            as_it_is);
                    }
                    if (!surface) ++work.background;
                    else if (!active) ++work.skipped;
                }
            batch.trace(tracer, around, work,
                        [&](const PointSums& sums, const ShadingPoint& point, int x, int y) {
                            write_point(images, x, y, sums, point.normal, to_view);
                        });
        }
    };
    outcome = run_tasks(pieces(height, traced_tile), NoMemory{}, trace_band, scratch, executor);
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
