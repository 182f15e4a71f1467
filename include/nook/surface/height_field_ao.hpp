#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/surface/height_field.hpp>
#include <nook/surface/height_field_walk.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/shade_runs.hpp>
#include <nook/surface/slice_slopes.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// Cosine-weighted visibility with the depth buffer as the only geometry, by brute force: what a
/// screen-space kernel could know at best. Its difference to `traced_ao` is what the depth buffer does
/// not know; that of a kernel to it is what the kernel gets wrong.
namespace nook {

struct HeightFieldOptions {
    /// How far occluders reach, in world units, ≥ 0, included; infinite: all of the image.
    double radius = 1;
    /// Planes through the view ray of each pixel, 1 … 4096. The error falls as 1 / slices beside edges
    /// and faster elsewhere: among boxes on a floor 16 left 6e-3 (RMS), 64 left 1.6e-3.
    int slices = 64;
    /// How deep the solid below every pixel is, a world length along the view axis, ≥ 0; infinite:
    /// nothing passes behind anything.
    double thickness = std::numeric_limits<double>::infinity();
    /// How much farther than its depth a surface counts as an occluder, a world length ≥ 0. Unset: 3
    /// depth steps at the surface and 1 at the pixel, so that quantised flat ground stays exactly 1.
    std::optional<double> bias{};
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the visibility of every pixel, in [0, 1]; background and pixels without a normal get 1.
///
/// Each pixel is the top of a solid: the points at distances [d, d + thickness] on the view rays
/// through it. Outside the image and over background there is nothing. Around the view ray v of a pixel
/// the hemisphere is cut into slices, planes through v at equal angles (as in Jimenez et al., "Practical
/// Real-Time Strategies for Accurate Indirect Occlusion", 2016, section 4). In each the view rays
/// that cross the slice's line on the screen are walked pixel by pixel to both sides, as far as
/// they come within the radius. The part of a ray that is solid and within the radius hides
/// an interval of angles t from v, and what their union leaves of ∫ cos(t − γ) |sin t| dt is the
/// visibility; γ is the angle of the normal in the slice. Relative to the whole, so that an open pixel is
/// exactly 1.
///
/// Exact per slice but for what a buffer of pixels leaves open: the surface between joined pixels (see
/// `detail::HeightField`) is taken as linear in 1/distance, and a tear lies half-way between the
/// crossings it falls between. Planes are exactly 1 at every tilt and in every encoding, but in images of
/// one row or column and where a row ends at background: no slope is known there. Normals may
/// be off by 2⁻¹⁷.
///
/// Inactive groups of the work map become exactly 1 and cost next to nothing; they still occlude others.
/// Where all are inactive not even the height field is made.
///
/// All arithmetic in double. Cost: slices × the radius in pixels; the outcome counts `samples`. The
/// same bits for any number of threads. Tasks are bands of eight rows. Scratch: nine bytes per pixel.
template <DepthInput Depth, class Value, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome height_field_ao(const Depth& depth, const NormalSource& normals,
                        const ImageView<Value>& visibility, const HeightFieldOptions& options,
                        const Projection& projection, const WorkMap& work_map = {},
                        S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch for a depth of that size, these options and a number of workers; 0 for options that
/// `height_field_ao` refuses.
template <DepthInput Depth>
[[nodiscard]] std::size_t height_field_ao_scratch_size(const Depth& depth,
                                                       const HeightFieldOptions& options,
                                                       int workers = 1);

namespace detail {

/// The angle of a slice about the view ray.
struct SliceDirection {
    double cosine, sine;
};

struct HeightFieldMemory {
    double* heights;
    std::uint8_t* joins;
    SliceDirection* directions;
    SlopeInterval* intervals;
    std::size_t capacity;  ///< of the intervals of one worker
};

[[nodiscard]] inline Error check_height_field(const HeightFieldOptions& options)
{
    if (is_nan(options.radius) || options.radius < 0)
        return {ErrorCode::bad_value, "options.radius", options.radius,
                "a length >= 0, or infinity"};
    if (options.slices < 1 || options.slices > 4096)
        return {ErrorCode::bad_value, "options.slices", double(options.slices), "1 to 4096"};
    if (is_nan(options.thickness) || options.thickness < 0)
        return {ErrorCode::bad_value, "options.thickness", options.thickness,
                "a length >= 0, or infinity"};
    if (options.bias)
        return check_at_least(*options.bias, 0, "options.bias", "a finite length >= 0");
    return {};
}

/// What a call takes from the scratch.
[[nodiscard]] inline auto height_field_layout(int width, int height, int slices)
{
    return [=](ScratchLayout& block, std::size_t workers) {
        const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        HeightFieldMemory memory{};
        memory.heights = block.take<double>(size);
        memory.joins = block.take<std::uint8_t>(size);
        memory.directions = block.take<SliceDirection>(static_cast<std::size_t>(slices));
        // Four per crossing of a walk at most; rounded so that workers do not share cache lines.
        memory.capacity = (4 * static_cast<std::size_t>((std::max)(width, height)) + 16) / 16 * 16;
        memory.intervals = block.take<SlopeInterval>(memory.capacity * workers);
        return memory;
    };
}

/// Visibility of one pixel; `samples` grows by the crossings looked at.
[[nodiscard]] inline double height_field_visibility(
    const HeightField& field, int x, int y, const Normal& normal, double distance,
    const HeightFieldOptions& options, const Projection& projection,
    const SliceDirection* directions, SlopeInterval* intervals, std::uint64_t& samples)
{
    const bool orthographic = projection.orthographic;
    // The view ray is (sx, sy, −1), and v = −ray / L.
    const double sx = orthographic ? 0 : (x + 0.5 - projection.cx) / projection.fx;
    const double sy = orthographic ? 0 : (projection.cy - y - 0.5) / projection.fy;
    const double ray = std::sqrt(sx * sx + sy * sy + 1);
    const double vx = -sx / ray, vy = -sy / ray, vz = 1 / ray;
    // Axes across the view ray: right × v and so on.
    const double length = std::sqrt(1 + sx * sx);
    const double rx = 1 / length, rz = sx / length;
    const double ux = vy * rz, uy = vz * rx - vx * rz, uz = -vy * rx;
    const double up = normal.x * vx + normal.y * vy + normal.z * vz;

    const double unit = orthographic ? 1 : distance;
    const double radius = options.radius / unit, thickness = options.thickness / unit;
    SliceWalk walk{.field = field,
                   .orthographic = orthographic,
                   .bounded = is_finite(options.radius) && radius < 0x1p200,
                   .solid = is_finite(options.thickness) && thickness < 0x1p200,
                   .height = field[field.index(x, y)],
                   .distance = distance,
                   .ray = ray,
                   .radius = radius,
                   .thickness = thickness,
                   .own_error = field.step(field[field.index(x, y)]),
                   .bias = options.bias ? *options.bias / unit : -1};
    if (!walk.solid) walk.thickness = 0;
    double hidden = 0, full = 0;
    for (int slice = 0; slice < options.slices; ++slice) {
        const auto [cosine, sine] = directions[slice];
        const double dx = cosine * rx + sine * ux, dy = sine * uy, dz = cosine * rz + sine * uz;
        const double out = normal.x * dx + normal.y * dy + normal.z * dz;
        // On the screen, in pixels per unit across the ray.
        const double px = projection.fx * (dx + sx * dz), py = -projection.fy * (dy + sy * dz);
        const bool along_rows = std::fabs(px) >= std::fabs(py);
        const HeightField::Axis axis = along_rows ? field.rows() : field.columns();
        const double major = along_rows ? px : py, minor = along_rows ? py : px;
        const int place = along_rows ? x : y, side = along_rows ? y : x;
        for (const double sign : {1.0, -1.0}) {
            const SliceArc arc{up, sign * out};
            SlopeUnion occluders{intervals};
            walk.b = 1 / std::fabs(major);
            walk.a = orthographic ? 0 : -sign * walk.b * dz * ray;
            walk.arc = &arc;
            walk.hidden = &occluders;
            const SliceWalk::Course course{axis, place, side, major * sign > 0 ? 1 : -1,
                                           sign * minor / std::fabs(major)};
            const int steps = walk.solid ? walk.walk_sheets(course) : walk.walk_endless(course);
            samples += static_cast<std::uint64_t>(steps);
            full += arc.full();
            for (const SlopeInterval& interval : occluders) hidden += arc.of(interval);
        }
    }
    if (!(hidden > 0)) return 1;
    const double open = 1 - hidden / full;
    return open > 0 ? (std::min)(open, 1.0) : 0;
}

}  // namespace detail

template <DepthInput Depth>
std::size_t height_field_ao_scratch_size(const Depth& depth, const HeightFieldOptions& options,
                                         int workers)
{
    const auto& image = depth_source(depth).image;
    if (workers < 1 || image.empty() || detail::check_height_field(options)) return 0;
    return detail::task_scratch_size(
        detail::height_field_layout(image.width, image.height, options.slices), workers);
}

template <DepthInput Depth, class Value, ScratchSource S, Executor E>
Outcome height_field_ao(const Depth& depth, const NormalSource& normals,
                        const ImageView<Value>& visibility, const HeightFieldOptions& options,
                        const Projection& projection, const WorkMap& work_map, S&& scratch,
                        E&& executor)
{
    const auto& source = depth_source(depth);
    if (const Error error = detail::check_source(source)) return {error};
    if (const Error error = detail::check_normals(normals, source.image)) return {error};
    if (const Error error = detail::check_output(visibility, "visibility")) return {error};
    if (const Error error = detail::check_same_size(source.image, visibility, "visibility"))
        return {error};
    if (const Error error = detail::check_apart(source.image, visibility, "visibility"))
        return {error};
    if (const Error error = detail::check_apart(normals, visibility, "visibility")) return {error};
    if (const Error error = detail::check_height_field(options)) return {error};
    if (const Error error = check_projection(projection)) return {error};
    if (const Error error = detail::check_work_map(work_map, visibility)) return {error};
    if (visibility.empty()) return {};

    constexpr int band = 8;
    const int width = visibility.width, height = visibility.height;
    const bool idle = !work_map.any_active();
    const int tasks = detail::pieces(height, band);
    const auto field_in = [&](const detail::HeightFieldMemory& memory) {
        detail::HeightField field{width, height, projection, source.step};
        field.use(memory.heights, memory.joins);
        return field;
    };
    const auto fill = [&](const detail::HeightFieldMemory& memory, int task) {
        field_in(memory).fill(source, task * band, (std::min)(task * band + band, height));
        // In the middle of equal parts of half a turn.
        for (int slice = 0; task == 0 && slice < options.slices; ++slice) {
            const double angle = (slice + 0.5) / options.slices * std::numbers::pi;
            memory.directions[slice] = {std::cos(angle), std::sin(angle)};
        }
    };
    const auto shade = [&](Work& work, const detail::HeightFieldMemory& memory, int task,
                           int worker) {
        const detail::HeightField field = field_in(memory);
        detail::SlopeInterval* const intervals =
            memory.intervals + memory.capacity * static_cast<std::size_t>(worker);
        for (int y = task * band; y < (std::min)(task * band + band, height); ++y) {
            if (idle) {
                detail::write_ones(visibility, {0, width}, y);
                detail::count_spared<1>(work, source, {0, width}, y);
                continue;
            }
            for (int x = 0; x < width; ++x) {
                visibility(x, y) = Value{1};
                if (field[field.index(x, y)] == 0) {
                    ++work.background;
                    continue;
                }
                if (!work_map.is_active(x, y)) {
                    ++work.skipped;
                    continue;
                }
                const detail::Normal normal = detail::unit_normal(normals, x, y);
                if (normal.x == 0 && normal.y == 0 && normal.z == 0) {
                    ++work.background;
                } else {
                    const double distance{surface_distance(source, x, y)};
                    visibility(x, y) = static_cast<Value>(detail::height_field_visibility(
                        field, x, y, normal, distance, options, projection, memory.directions,
                        intervals, work.samples));
                }
            }
        }
    };
    Outcome outcome = detail::run_tasks(detail::height_field_layout(width, height, options.slices),
                                        fill, idle ? 0 : tasks, shade, tasks, scratch, executor);
    if (outcome) {
        outcome.work.pixels =
            static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
        outcome.work.passes = idle ? 0 : 1;
        outcome.work.skipped_passes = idle ? 1 : 0;
    }
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
