#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/hemisphere.hpp>
#include <nook/scene/neighbourhood.hpp>
#include <nook/scene/tangent_planes.hpp>
#include <nook/scene/traced_batch.hpp>
#include <nook/scene/traced_input.hpp>
#include <nook/scene/traced_options.hpp>
#include <nook/scene/traced_point.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook::inline NOOK_TARGET {

/// Which pixels `traced_ao` has to trace: a group of 16 × 1 pixels becomes 1, or 0 where it is proven
/// that each of its pixels gets exactly 1, whatever the directions. Then no triangle rises above the
/// tangent planes of its points within the radius, nor, with secondary rays, within the reach of their
/// segments. Tiles of 8 × 8 pixels are asked at once, what is left point by point.
///
/// `active` has (width + 15) / 16 × height bytes, as WorkMap::active; `WorkMap{active}` of it is exact:
/// every image that `traced_ao` writes keeps its bits. The arguments are those of the kernel, `options`
/// with any falloff, secondary rays or colour: the radius, those of secondary rays and the position
/// error matter. Groups without a surface are 0.
///
/// The kernel asks the same of its tiles itself. A plan pays where it serves more than one call: frames
/// that refine each other, other directions, a smaller radius.
///
/// Work: skipped is the number of surface pixels in groups that are 0. The same bytes for any number of
/// threads. Tasks are bands of eight rows. No scratch.
template <DepthInput Depth, class Options = TracedOptions<>, Executor E = Serial>
Outcome plan_traced(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                    const ImageView<std::uint8_t>& active, const Options& options,
                    const Projection& projection, const ViewFrame& frame, E&& executor = E{});
template <DepthInput Depth, class Options = TracedOptions<>, Executor E = Serial>
Outcome plan_traced(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                    const SourceFaces& faces, const ImageView<std::uint8_t>& active,
                    const Options& options, const Projection& projection, const ViewFrame& frame,
                    E&& executor = E{});

namespace detail {

/// The pixels of a tile that are surfaces, and those of them that are not known to be open; bit
/// 8 y + x.
struct TilePlan {
    std::uint64_t surfaces = 0, active = 0;
};

template <class Input, class Tracer>
[[nodiscard]] TilePlan plan_tile(const Input& input, const Tracer& tracer, const PixelRect& tile,
                                 Neighbourhood& around, TangentPlanes& planes, TracedBatch& batch)
{
    TilePlan plan;
    const auto bit = [&](int x, int y) {
        return std::uint64_t{1} << ((y - tile.top) * traced_tile + x - tile.left);
    };
    const TilePixels found = input.scan(tile, {}, planes);
    if (found == TilePixels::background) return plan;
    around.whole();
    for (int y = tile.top; y < tile.bottom; ++y)
        for (int x = tile.left; x < tile.right; ++x)
            if (surface_distance(input.source(), x, y) > 0 &&
                (found == TilePixels::flat || input.has_normal(x, y)))
                plan.surfaces |= bit(x, y);
    if (plan.surfaces == 0 || (found == TilePixels::flat && around.nothing_meets(planes)))
        return plan;
    const auto point_at = [&](int place) {
        const int x = tile.left + place % traced_tile, y = tile.top + place / traced_tile;
        return input.point(x, y, double{surface_distance(input.source(), x, y)},
                           input.normal(x, y));
    };
    const auto is_open = [&](const ShadingPoint& point) {
        return around.empty() || !(largest(point.start) < SceneRay::farthest_origin) ||
               Hemisphere{around, point.start, point.surface, tracer.reach(), point.slack}
                   .nothing_above();
    };
    // Where neither end is open there is little to find.
    if (!is_open(point_at(std::countr_zero(plan.surfaces))) &&
        !is_open(point_at(63 - std::countl_zero(plan.surfaces)))) {
        plan.active = plan.surfaces;
        return plan;
    }
    for (std::uint64_t left = plan.surfaces; left != 0; left &= left - 1) {
        const int place = std::countr_zero(left);
        batch.add(tile.left + place % traced_tile, tile.top + place / traced_tile) =
            point_at(place);
    }
    batch.for_each_point(tracer, around, [&](const ShadingPoint& point, int x, int y) {
        // One pixel makes the row of the group active.
        const std::uint64_t row = std::uint64_t{0xff} << (y - tile.top) * traced_tile;
        if ((plan.active & row) == 0 && !is_open(point)) plan.active |= bit(x, y);
    });
    return plan;
}

template <class Depth, class Options, class E>
Outcome plan_g_buffer(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                      const SourceFaces* faces, const ImageView<std::uint8_t>& active,
                      const Options& options, const Projection& projection, const ViewFrame& frame,
                      E&& executor)
{
    const auto& source = depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    Outcome outcome{};
    Error& error = outcome.error;
    if ((error = check_traced_input(source, normals, faces))) return outcome;
    if ((error = check_output(active, "active"))) return outcome;
    if ((error = check_groups(active, width, height, "active"))) return outcome;
    if ((error = check_each_input(source, normals, faces, [&](const auto& image, const char*) {
             return check_apart(image, active, "active");
         })))
        return outcome;
    if ((error = check_traced_options(options))) return outcome;
    if ((error = check_projection(projection))) return outcome;
    if ((error = check_frame(frame))) return outcome;
    if (source.image.empty()) return outcome;

    const TracedInput input{bvh, source, normals, faces, projection, frame, options.position_error};
    const PointTracer<Options, false> tracer{bvh, options};
    std::atomic<std::uint64_t> surfaces{0}, skipped{0};
    const auto plan_band = [&](int task, int) {
        Neighbourhood around{bvh.view()};
        TangentPlanes planes{rounded_up(tracer.reach())};
        TracedBatch batch;
        const int top = task * traced_tile, bottom = top + (std::min)(traced_tile, height - top);
        std::uint64_t band_surfaces = 0, band_skipped = 0;
        for (int group = 0; group < active.width; ++group) {
            TilePlan plans[WorkMap::group / traced_tile];
            for (int i = 0; i < WorkMap::group / traced_tile; ++i) {
                const int left = group * WorkMap::group + i * traced_tile;
                if (left < width)
                    plans[i] =
                        plan_tile(input, tracer,
                                  {left, top, left + (std::min)(traced_tile, width - left), bottom},
                                  around, planes, batch);
            }
            for (int y = top; y < bottom; ++y) {
                std::uint64_t row_surfaces = 0, row_active = 0;
                for (const TilePlan& plan : plans) {
                    const int shift = (y - top) * traced_tile;
                    row_surfaces +=
                        static_cast<std::uint64_t>(std::popcount(plan.surfaces >> shift & 0xff));
                    row_active |= plan.active >> shift & 0xff;
                }
                active(group, y) = row_active != 0 ? 1 : 0;
                band_surfaces += row_surfaces;
                band_skipped += row_active != 0 ? 0 : row_surfaces;
            }
        }
        surfaces.fetch_add(band_surfaces, std::memory_order_relaxed);
        skipped.fetch_add(band_skipped, std::memory_order_relaxed);
    };
    executor.for_each(pieces(height, traced_tile), plan_band);
    Work& work = outcome.work;
    work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    work.background = work.pixels - surfaces.load();
    work.skipped = skipped.load();
    work.passes = 1;
    return outcome;
}

}  // namespace detail

template <DepthInput Depth, class Options, Executor E>
Outcome plan_traced(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                    const ImageView<std::uint8_t>& active, const Options& options,
                    const Projection& projection, const ViewFrame& frame, E&& executor)
{
    return detail::plan_g_buffer(bvh, depth, normals, nullptr, active, options, projection, frame,
                                 executor);
}

template <DepthInput Depth, class Options, Executor E>
Outcome plan_traced(const Bvh& bvh, const Depth& depth, const ImageView3<const float>& normals,
                    const SourceFaces& faces, const ImageView<std::uint8_t>& active,
                    const Options& options, const Projection& projection, const ViewFrame& frame,
                    E&& executor)
{
    return detail::plan_g_buffer(bvh, depth, normals, &faces, active, options, projection, frame,
                                 executor);
}

}  // namespace nook::inline NOOK_TARGET
