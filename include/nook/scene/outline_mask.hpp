#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/outline_count.hpp>
#include <nook/scene/outline_raster.hpp>
#include <nook/scene/outline_view.hpp>
#include <nook/scratch.hpp>
#include <nook/work_map.hpp>

namespace nook {

struct OutlineMaskOptions {
    /// A pixel is worth work when at least so many shells contain it. 2: its own and another one; 1: any
    /// pixel in a shell. With n shells turned inside out (rooms) subtract n.
    int threshold = 2;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// The stencil of outlines as a work map (Park & Baek 2021): a group of 16 × 1 pixels becomes 1 when a
/// surface in it lies in at least `options.threshold` shells, else 0. Counts as `outline_count`, with
/// its arguments and limits, without an image of counts.
///
/// `groups` has (width + 15) / 16 × height bytes, as WorkMap::active. With shells at least as wide as
/// the reach of a kernel, the pixels that another object shades are all active; folds of one object
/// are not found. A wider extent never clears a group, as long as the shells grow with it.
///
/// Work: samples is the number of surface pixels that reach the threshold, skipped the surface pixels
/// of inactive groups. Scratch: `outline_scratch_size`.
template <DepthInput Depth, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome outline_mask(const OutlineView& shells, double extent, const Depth& depth,
                     const ImageView<std::uint8_t>& groups, const OutlineMaskOptions& options,
                     const ViewFrame& frame, const Projection& projection, S&& scratch = S{},
                     E&& executor = E{});

/// The groups of `outline_mask` as a work map. It is not exact: an object may shade itself.
[[nodiscard]] inline WorkMap outline_work_map(const ImageView<const std::uint8_t>& groups)
{
    return {groups, false};
}

namespace detail {

struct OutlineGroup {
    int surfaces, wanted;
};
/// Surface pixels of a group, and those of them that lie in at least `threshold` shells. Columns
/// beyond the image hold background.
[[nodiscard]] inline OutlineGroup count_group(const std::int32_t* counts, const float* keys,
                                              float background, std::int32_t threshold)
{
    constexpr int lanes = float_lanes;
    using Integers = Lanes<std::int32_t, lanes>;
    Integers surfaces{}, wanted{};
    const Integers one = broadcast<lanes>(std::int32_t{1});
    for (int x = 0; x < WorkMap::group; x += lanes) {
        const auto surface = load<lanes>(keys + x) > background;
        const auto enough = load<lanes>(counts + x) >= threshold;
        surfaces += surface ? one : Integers{};
        wanted += (surface & enough) ? one : Integers{};
    }
    const auto sum = [](const auto& a, const auto& b) { return a + b; };
    return {fold(surfaces, sum), fold(wanted, sum)};
}

}  // namespace detail

template <DepthInput Depth, ScratchSource S, Executor E>
Outcome outline_mask(const OutlineView& shells, double extent, const Depth& depth,
                     const ImageView<std::uint8_t>& groups, const OutlineMaskOptions& options,
                     const ViewFrame& frame, const Projection& projection, S&& scratch,
                     E&& executor)
{
    Outcome outcome{};
    const auto& source = depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    if ((outcome.error = detail::check_outline(shells, extent, source, frame, projection)))
        return outcome;
    if ((outcome.error = detail::check_output(groups, "groups"))) return outcome;
    if ((outcome.error = detail::check_groups(groups, width, height, "groups"))) return outcome;
    if ((outcome.error = detail::check_apart(source.image, groups, "groups"))) return outcome;
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
            std::uint64_t surfaces = 0;
            for (int group = 0; group < groups.width; ++group) {
                const std::ptrdiff_t at = row + group * std::ptrdiff_t{WorkMap::group};
                const detail::OutlineGroup found =
                    detail::count_group(band.counts + at, band.keys + at, none, options.threshold);
                groups(group, y) = found.wanted > 0 ? 1 : 0;
                surfaces += static_cast<std::uint64_t>(found.surfaces);
                work.samples += static_cast<std::uint64_t>(found.wanted);
                work.skipped += static_cast<std::uint64_t>(found.wanted > 0 ? 0 : found.surfaces);
            }
            work.background += static_cast<std::uint64_t>(width) - surfaces;
        }
    };
    outcome.work =
        detail::draw_outlines(shells, extent, source, frame, projection, parts, finish, executor);
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
