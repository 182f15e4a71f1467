#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/depth_plane.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/plan_cells.hpp>
#include <nook/surface/plan_search.hpp>
#include <nook/surface/plan_tiles.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// A work map from depth and normals: what `alchemy_ao`, `horizon_ao` and `bitmask_ao` need not look
/// at, since nothing there rises above the tangent planes of the pixels.
namespace nook::inline NOOK_TARGET {

/// Writes the work map of a kernel with these options (of `alchemy_ao`, `horizon_ao` or `bitmask_ao`)
/// on the same depth, normals and projection; `active` has `WorkMap::groups(width)` × height bytes.
/// `surface_work_map` makes a WorkMap of it.
///
/// Groups are inactive in tiles of 16 × 16 pixels for which it is proven that no sample counts: none
/// rises above the tangent plane of a pixel by more than the bias forgives, in the kernel's own
/// arithmetic, or it lies beyond the radius. With `tolerance` 0 the kernel gives the
/// same bits with the map as without. Otherwise a sample may also be left out that counts a little:
/// the visibility of a pixel then rises by `tolerance` at most. `bitmask_ao` rounds to whole sectors
/// of its slices; what it rounds away is left out without a tolerance.
///
/// For pixels more than 64 degrees off the axis nothing can be proven. Pays where large parts of the
/// picture are flat or open; what it costs elsewhere, see docs/screen_space.md.
///
/// Work: `background`, and as `skipped` the surface pixels of inactive groups. The same bits for any
/// number of threads.
template <DepthInput Depth, class Options, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome plan_surface(const Depth& depth, const NormalSource& normals,
                     const ImageView<std::uint8_t>& active, const Options& options,
                     const Projection& projection, double tolerance = 0, S&& scratch = S{},
                     E&& executor = E{});

/// Bytes of scratch that `plan_surface` needs for a depth of that size.
template <DepthInput Depth>
[[nodiscard]] std::size_t plan_surface_scratch_size(const Depth& depth, int workers = 1);

/// The groups of `plan_surface` as a work map.
[[nodiscard]] inline WorkMap surface_work_map(const ImageView<const std::uint8_t>& active,
                                              double tolerance = 0)
{
    return {active, tolerance == 0};
}

namespace detail {

/// What the planner knows of a kernel.
struct PlanSettings {
    Error error;
    bool work;      ///< false: everything is open by definition
    double radius;  ///< that of the depth plane
    int max_pixels;
};
[[nodiscard]] inline PlanSettings plan_settings(const AlchemyOptions& options)
{
    return {check_alchemy(options), asks_for_work(options), options.radius, options.max_pixels};
}
[[nodiscard]] inline PlanSettings plan_settings(const SliceSettings& settings)
{
    return {check_slices(settings), settings.ask_for_work(), settings.bounded_radius(),
            settings.max_pixels};
}
[[nodiscard]] inline PlanSettings plan_settings(const HorizonOptions& options)
{
    return plan_settings(slice_settings(options));
}
[[nodiscard]] inline PlanSettings plan_settings(const BitmaskOptions& options)
{
    return plan_settings(slice_settings(options));
}

[[nodiscard]] inline PlanRule plan_rule(const ReachRule& reach, const RiseRule& rise, double unit)
{
    return {
        reach, rise.step.constant, rise.step.linear, rise.step.quadratic, rise.fixed, rise.rounding,
        unit};
}
/// Alchemy: each of the n terms of 1 − scale / n Σ may be tolerance / scale.
[[nodiscard]] inline PlanRule plan_rule(const AlchemyOptions& options, const ReachRule& reach,
                                        double scale, const DepthStep& step, double rounding,
                                        double unit, double tolerance)
{
    const AlchemyShade shade{options, scale, step, rounding, reach.orthographic};
    PlanRule rule = plan_rule(reach, shade.rise, unit);
    rule.cut_off = shade.scalable;
    if (tolerance > 0 && shade.scale > 0) {
        // Of the sum, from which the contrast makes a visibility.
        const double part = shade.contrast > 1 ? tolerance / shade.contrast
                                               : std::pow(tolerance, 1 / shade.contrast);
        rule.per_square = part * (1 - 0x1p-10) / shade.scale;
        rule.constant = shade.epsilon;
    }
    return rule;
}
/// Slices: below an elevation ε both sides of a slice hide 2 (1 − cos ε) of it at most. In a slice sin ε
/// is the height over the distance and the length of the projected normal, which is at least the
/// cosine towards the viewer.
[[nodiscard]] inline PlanRule slice_plan_rule(const SliceSettings& settings, const ReachRule& reach,
                                              double scale, const DepthStep& step, double rounding,
                                              double unit, double share)
{
    const SliceShade shade{settings, scale, step, rounding, reach.orthographic};
    PlanRule rule = plan_rule(reach, shade.rise, unit);
    rule.cut_off = true;
    const double cosine = 1 - (std::min)(share, 0.25) / 2;
    rule.slope = std::sqrt(1 - cosine * cosine) * (1 - 0x1p-10);
    return rule;
}
[[nodiscard]] inline PlanRule plan_rule(const HorizonOptions& options, const ReachRule& reach,
                                        double scale, const DepthStep& step, double rounding,
                                        double unit, double tolerance)
{
    return slice_plan_rule(slice_settings(options), reach, scale, step, rounding, unit, tolerance);
}
/// A side of a slice that hides less than half a sector of 32 closes none; 1/70 keeps away from
/// rounding.
[[nodiscard]] inline PlanRule plan_rule(const BitmaskOptions& options, const ReachRule& reach,
                                        double scale, const DepthStep& step, double rounding,
                                        double unit, double)
{
    return slice_plan_rule(slice_settings(options), reach, scale, step, rounding, unit, 2.0 / 70);
}

}  // namespace detail

template <DepthInput Depth>
std::size_t plan_surface_scratch_size(const Depth& depth, int workers)
{
    const auto& image = depth_source(depth).image;
    if (workers < 1 || image.empty()) return 0;
    detail::ScratchLayout block;
    static_cast<void>(block.take<Work>(static_cast<std::size_t>(workers)));
    detail::PlanPyramid{image.width, image.height}.take(block);
    return block.size();
}

template <DepthInput Depth, class Options, ScratchSource S, Executor E>
Outcome plan_surface(const Depth& depth, const NormalSource& normals,
                     const ImageView<std::uint8_t>& active, const Options& options,
                     const Projection& projection, double tolerance, S&& scratch, E&& executor)
{
    using detail::PlanGrid;
    const auto& source = depth_source(depth);
    using Source = std::remove_cvref_t<decltype(source)>;
    using Real = typename Source::Distance;
    const int width = source.image.width, height = source.image.height;
    const detail::PlanSettings settings = detail::plan_settings(options);
    if (const Error error = detail::check_source(source)) return {error};
    if (const Error error = detail::check_normals(normals, source.image)) return {error};
    if (const Error error = detail::check_output(active, "active")) return {error};
    if (active.width != WorkMap::groups(width))
        return {{ErrorCode::bad_size, "active", double(active.width),
                 "a width of (width + 15) / 16 groups"}};
    if (active.height != height)
        return {{ErrorCode::bad_size, "active", double(active.height), "the height of the input"}};
    if (const Error error = detail::check_apart(source.image, active, "active")) return {error};
    if (const Error error = detail::check_apart(normals, active, "active")) return {error};
    if (const Error error = check_projection(projection)) return {error};
    if (settings.error) return {settings.error};
    if (const Error error =
            detail::check_at_least(tolerance, 0, "tolerance", "a number from 0 to 1"))
        return {error};
    if (tolerance > 1)
        return {{ErrorCode::bad_value, "tolerance", tolerance, "a number from 0 to 1"}};
    if (source.image.empty()) return {};
    if (!detail::DepthPlane<Real>::fits(width, height))
        return {{ErrorCode::bad_size, "depth", double(height),
                 "fewer than 2^31 pixels, margins included"}};

    const int workers = static_cast<int>(executor.concurrency());
    const std::size_t size = plan_surface_scratch_size(depth, workers);
    void* const data = scratch.reserve(size);
    if (data == nullptr) return {detail::check_scratch<S>(size)};
    detail::ScratchLayout block{data};
    Work* const work = block.take<Work>(static_cast<std::size_t>(workers));
    for (int worker = 0; worker < workers; ++worker) work[worker] = {};
    detail::PlanPyramid pyramid{width, height};
    pyramid.take(block);

    const double radius = settings.work ? settings.radius : 1;
    const detail::DepthPlane<Real> plane{width, height, radius};
    const double scale = plane.scale();
    const detail::PlanAxes axes{projection, scale};
    const detail::ReachRule reach{plane, radius, projection, settings.max_pixels};
    const detail::PlanRule rule =
        detail::plan_rule(options, reach, scale, source.step, detail::surface_rounding<Real>,
                          std::numeric_limits<Real>::epsilon() / 2, tolerance);

    // Until the search, the bytes count surfaces.
    const PlanGrid& grid = pyramid.grid;
    executor.for_each(grid.rows(0), [&](int row, int worker) {
        constexpr int most = 8;
        detail::PlanTile<Real> tiles[most];
        const detail::PlanRect band = grid.rect(0, 0, row);
        for (int first = 0; first < grid.columns(0); first += most) {
            const int count = (std::min)(most, grid.columns(0) - first);
            for (int i = 0; i < count; ++i)
                tiles[i].start(source, normals, axes, scale, grid.rect(0, first + i, row));
            for (int y = band.top; y <= band.bottom; ++y)
                for (int i = 0; i < count; ++i)
                    active(first + i, y) = static_cast<std::uint8_t>(
                        tiles[i].add(source, normals, axes, static_cast<Real>(scale), y));
            for (int i = 0; i < count; ++i) {
                const std::size_t at = grid.index(0, first + i, row);
                tiles[i].finish(axes, pyramid.cells[at], pyramid.tiles[at]);
                work[worker].background += tiles[i].background();
            }
        }
    });
    pyramid.merge_up(axes);
    const detail::PlanSearch search{rule, axes, pyramid};
    const int roots = (std::min)(grid.levels - 1, 3);
    executor.for_each(grid.rows(roots), [&](int row, int worker) {
        for (int column = 0; column < grid.columns(roots); ++column) {
            const auto write = [&](const detail::PlanRect& rect, bool is_active) {
                for (int y = rect.top; y <= rect.bottom; ++y)
                    for (int g = rect.left / WorkMap::group; g <= rect.right / WorkMap::group;
                         ++g) {
                        std::uint8_t& byte = active(g, y);
                        if (!is_active) work[worker].skipped += byte;
                        byte = is_active && byte > 0 ? 1 : 0;
                    }
            };
            if (settings.work) search.plan(roots, column, row, write);
            else write(grid.rect(roots, column, row), false);
        }
    });
    Outcome outcome{};
    for (int worker = 0; worker < workers; ++worker) outcome.work += work[worker];
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
