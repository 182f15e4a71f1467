#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/outline_raster.hpp>
#include <nook/scene/outline_view.hpp>
#include <nook/scratch.hpp>

namespace nook::inline NOOK_TARGET {

/// Counts at each pixel the shells that contain the visible point (after Park & Baek 2021).
///
/// The shells, pushed out by `extent`, are drawn against the visible depth without changing it, signed:
/// +1 for each back face behind the visible surface, -1 for each front face behind it. The sum is the
/// number of closed shells around the point, wherever the viewer stands: also inside shells, which
/// counting in front of the surface, as in the paper, gets wrong; also where shells reach behind the
/// viewer. No far plane cuts shells. Background counts 0.
///
/// Shells seen from inside, such as the walls of a room, are turned inside out. They contain all
/// that is far away, which cannot be known from what is drawn: each lowers every count by 1. An open
/// shell adds to a pixel the back faces less the front faces that it has behind it. Triangles with a
/// corner that is not finite, or so far off that pixels × distance reach 2¹⁰⁰⁰, are left out, and leave
/// their shell open.
///
/// Coverage is exact after snapping to 2⁻⁸ pixel: shared edges hit each pixel once, and nothing leaks.
/// Distances are compared in float, with a relative error below 2⁻²⁰ (under orthography of the largest
/// distance of the triangle), between 2⁻¹²⁵ and 2¹²⁵. Corners are placed in double: those of a
/// triangle should be less than 10¹³ times as far away as the surfaces near it. A face exactly at the
/// visible distance counts as in front of it: a point on a front face is inside, on a back face
/// outside.
///
/// Where every directed edge is cancelled by an opposite one of the same vertices, the same count is had
/// from the faces in front of the surface and the crossings of one ray, and what is hidden costs
/// little. Shells whose triangles share no vertices are right too, but slower.
///
/// `frame` and `projection` are those of the depth buffer, up to 32768 × 32768. `counts` has the size of
/// the depth and shares no memory with it. Work: pixels and background. Scratch:
/// `outline_scratch_size`. Tasks are blocks of the mesh and bands of rows.
template <DepthInput Depth, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome outline_count(const OutlineView& shells, double extent, const Depth& depth,
                      const ImageView<std::int32_t>& counts, const ViewFrame& frame,
                      const Projection& projection, S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch that `outline_count` and `outline_mask` ask for: 16 per vertex, 12 per triangle,
/// 4 per pixel and two bands of 32 rows per worker.
[[nodiscard]] std::size_t outline_scratch_size(const OutlineView& shells, int width, int height,
                                               int workers = 1);

inline std::size_t outline_scratch_size(const OutlineView& shells, int width, int height,
                                        int workers)
{
    detail::ScratchLayout layout;
    static_cast<void>(detail::OutlineScratch{layout, shells.vertex_count, shells.triangle_count,
                                             width, height, workers});
    return layout.size();
}

template <DepthInput Depth, ScratchSource S, Executor E>
Outcome outline_count(const OutlineView& shells, double extent, const Depth& depth,
                      const ImageView<std::int32_t>& counts, const ViewFrame& frame,
                      const Projection& projection, S&& scratch, E&& executor)
{
    Outcome outcome{};
    const auto& source = depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    if ((outcome.error = detail::check_outline(shells, extent, source, frame, projection)))
        return outcome;
    if ((outcome.error = detail::check_output(counts, "counts"))) return outcome;
    if ((outcome.error = detail::check_same_size(source.image, counts, "counts"))) return outcome;
    if ((outcome.error = detail::check_apart(source.image, counts, "counts"))) return outcome;
    if (source.image.empty()) return outcome;

    const int workers = static_cast<int>(executor.concurrency());
    const std::size_t size = outline_scratch_size(shells, width, height, workers);
    void* const block = scratch.reserve(size);
    if (block == nullptr) return {detail::check_scratch<S>(size)};
    detail::ScratchLayout layout{block};
    const detail::OutlineScratch parts{
        layout, shells.vertex_count, shells.triangle_count, width, height, workers};
    const float none = detail::background_key(projection.orthographic);
    const auto finish = [&](Work& work, const detail::OutlineBand& band) {
        for (int y = band.top; y <= band.bottom; ++y) {
            const std::ptrdiff_t row = (y - band.top) * band.stride;
            for (int x = 0; x < width; ++x) {
                const bool surface = band.keys[row + x] > none;
                counts(x, y) = surface ? band.counts[row + x] : 0;
                work.background += surface ? 0 : 1;
            }
        }
    };
    outcome.work =
        detail::draw_outlines(shells, extent, source, frame, projection, parts, finish, executor);
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
