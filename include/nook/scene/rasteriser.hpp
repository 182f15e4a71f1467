#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/clip.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/raster_bins.hpp>
#include <nook/scene/raster_picture.hpp>
#include <nook/scene/raster_resolve.hpp>
#include <nook/scene/raster_tile.hpp>
#include <nook/scene/raster_vertex.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// What the rasteriser writes. Images that are there have one size, up to 32768 × 32768, and share
/// no memory; channels of one interleaved buffer are fine.
struct GBuffer {
    /// Distance along the view axis; +infinity where there is no surface.
    ImageView<float> depth{};
    /// Unit normal in view space; (0, 0, 0) where there is no surface. May be empty.
    ImageView3<float> normal{};
    /// Index of the triangle; `no_face` where there is no surface. May be empty.
    ImageView<std::uint32_t> face{};
};

struct RasteriseOptions {
    /// Interpolate the mesh's vertex normals, perspective-correct, instead of the triangle's own.
    /// Where they are missing, zero or not finite, the triangle's own is taken.
    bool interpolate_normals = false;
    /// Leave out what is nearer than this distance along the view axis, ≥ 0, or nearer than the
    /// projection's near plane. With both 0 the smallest normal float is the limit.
    double near_plane = 0;
    /// Leave out triangles seen from behind: their corners run clockwise in the picture, in a mirrored
    /// frame counter-clockwise.
    bool leave_out_back_faces = false;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Draws a mesh: at each pixel centre the nearest triangle, its distance, normal and index. Among
/// triangles at one distance (as floats) the lowest index wins.
///
/// Both sides of a triangle are drawn, whatever its winding, and its normal is turned towards the
/// viewer; an interpolated normal is turned to the side of the triangle's own. Triangles are clipped
/// at the near plane; what lies beyond the projection's far plane is left out. Unusable triangles
/// (see `is_usable_triangle`) are left out.
///
/// Vertices are snapped to 2⁻¹⁶ pixel (2⁻¹² for the largest images) and coverage is exact from there:
/// a pixel centre on an edge belongs to the triangle whose top or left edge it is, so that triangles
/// that share an edge leave no gap and hit no pixel twice. Distances come from the plane of the
/// triangle before snapping, in double, kept within the triangle's own range.
///
/// The projection may be off centre or jittered. Scratch: `rasterise_scratch_size`. Tasks are blocks
/// of the mesh and tiles of 128 × 64 pixels, which take 180 KB of the worker's stack until they are
/// complete; each pixel of the images is written once.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome rasterise(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                  const GBuffer& buffers, const RasteriseOptions& options = {}, S&& scratch = S{},
                  E&& executor = E{});

/// Bytes of scratch that `rasterise` asks for: 16 per vertex, 12 per triangle and a quarter of a
/// megabyte.
[[nodiscard]] std::size_t rasterise_scratch_size(const MeshView& mesh);

namespace detail {

[[nodiscard]] inline Error check_gbuffer(const GBuffer& buffers)
{
    if (const Error error = check_output(buffers.depth, "buffers.depth")) return error;
    if (buffers.depth.width > largest_raster_size)
        return {ErrorCode::bad_size, "buffers.depth", double(buffers.depth.width),
                "a width of at most 32768"};
    if (buffers.depth.height > largest_raster_size)
        return {ErrorCode::bad_size, "buffers.depth", double(buffers.depth.height),
                "a height of at most 32768"};
    Error first{};
    const auto check = [&](const auto& image, const char* name, const auto&... others) {
        if (first) return;
        first = check_output(image, name);
        if (!first) first = check_same_size(buffers.depth, image, name);
        if (!first) first = check_apart(buffers.depth, image, name);
        (..., (first ? void() : void(first = check_apart(others, image, name))));
    };
    const auto& normal = buffers.normal;
    const bool normals = normal.x.data || normal.y.data || normal.z.data;
    if (normals) {
        check(normal.x, "buffers.normal.x");
        check(normal.y, "buffers.normal.y", normal.x);
        check(normal.z, "buffers.normal.z", normal.x, normal.y);
    }
    if (buffers.face.data != nullptr) {
        if (normals) check(buffers.face, "buffers.face", normal.x, normal.y, normal.z);
        else check(buffers.face, "buffers.face");
    }
    return first;
}

template <bool orthographic, bool with_ids, class E>
std::uint64_t draw_picture(const RasterView& view, const RasterPicture& picture,
                           const GBuffer& buffers, bool interpolate, E&& executor)
{
    constexpr RasterSize size = RasterResolve::tile;
    std::atomic<std::uint64_t> covered{0};
    executor.for_each(picture.bins(), [&](int bin, int) {
        std::int32_t distances[RasterTileMemory::samples(size)];
        std::uint32_t ids[with_ids ? RasterTileMemory::samples(size) : 1];
        double across[size.across + RasterTileMemory::padding], down[size.down];
        RasterResolve resolve{view, {buffers.depth, buffers.normal, buffers.face}, interpolate};
        std::uint64_t found = 0;
        picture.for_tiles(bin, [&](const RasterBox& box) {
            const auto tile = picture.draw<RasterTile<orthographic, with_ids>>(
                bin, {size, distances, ids, across, down}, box, 0);
            found += resolve.depth(tile);
            if constexpr (with_ids) {
                resolve.face(tile);
                resolve.normal(tile);
            }
        });
        covered.fetch_add(found, std::memory_order_relaxed);
    });
    return covered.load(std::memory_order_relaxed);
}

}  // namespace detail

inline std::size_t rasterise_scratch_size(const MeshView& mesh)
{
    detail::ScratchLayout layout;
    static_cast<void>(detail::RasterScratch{layout, mesh, 2});
    return layout.size();
}

template <ScratchSource S, Executor E>
Outcome rasterise(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                  const GBuffer& buffers, const RasteriseOptions& options, S&& scratch,
                  E&& executor)
{
    Outcome outcome{};
    const int width = buffers.depth.width, height = buffers.depth.height;
    if ((outcome.error = detail::check_gbuffer(buffers))) return outcome;
    if ((outcome.error = detail::check_raster_view(frame, projection, options.near_plane)))
        return outcome;
    if ((outcome.error = check_mesh(mesh))) return outcome;
    if (buffers.depth.empty()) return outcome;

    const std::size_t size = rasterise_scratch_size(mesh);
    void* const block = scratch.reserve(size);
    if (block == nullptr) return {detail::check_scratch<S>(size)};
    detail::ScratchLayout layout{block};
    const detail::RasterScratch parts{layout, mesh, 2};
    const detail::RasterView view{
        mesh,  frame,  projection,
        width, height, detail::raster_near_plane(options.near_plane, projection)};
    detail::RasterSides sides{};
    if (options.leave_out_back_faces)
        (view.mirrored() ? sides.counter_clockwise : sides.clockwise) = false;
    detail::RasterPicture picture{view, parts, sides, detail::RasterResolve::tile};
    picture.sort(0, executor);
    const bool ids = buffers.normal.x.data != nullptr || buffers.face.data != nullptr;
    const bool interpolate = options.interpolate_normals && mesh.normals != nullptr;
    const auto draw = [&](auto orthographic, auto with_ids) {
        return detail::draw_picture<decltype(orthographic)::value, decltype(with_ids)::value>(
            view, picture, buffers, interpolate, executor);
    };
    using Yes = std::true_type;
    using No = std::false_type;
    const std::uint64_t covered = projection.orthographic
                                      ? (ids ? draw(Yes{}, Yes{}) : draw(Yes{}, No{}))
                                      : (ids ? draw(No{}, Yes{}) : draw(No{}, No{}));
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.background = outcome.work.pixels - covered;
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
