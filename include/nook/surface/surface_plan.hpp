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
#include <nook/depth/source_row.hpp>
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
/// arithmetic, or it lies beyond the radius. With `tolerance` 0 the kernel gives the same bits with
/// the map as without. Otherwise a sample may also be left out that counts a little: the visibility of
/// a pixel then rises by `tolerance` at most.
///
/// With the automatic bias nothing can be proven for pixels more than 64 degrees off the axis. Where
/// less than a quarter of the surfaces would be left out nothing is: some rows are looked at first, and
/// the plan given up if they promise less. What a plan saves and costs: docs/left_out.md.
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
    return {reach,      rise.step.constant, rise.step.linear, rise.step.quadratic,
            rise.fixed, rise.rounding,      rise.radius,      unit};
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
/// A side of a slice that hides less than half a sector of 32 closes none, and one that hides more may
/// close more than that; 1/70 keeps away from rounding.
[[nodiscard]] inline PlanRule plan_rule(const BitmaskOptions& options, const ReachRule& reach,
                                        double scale, const DepthStep& step, double rounding,
                                        double unit, double tolerance)
{
    return slice_plan_rule(slice_settings(options), reach, scale, step, rounding, unit,
                           (std::min)(tolerance, 2.0 / 70));
}

struct PlanCounts {
    std::uint64_t background = 0, skipped = 0;
    /// Pixels of tiles with surfaces, and of those that are worth work.
    std::uint64_t tiled = 0, worked = 0;
};

/// One plan of an image. Everything has been checked.
template <class Source>
class SurfacePlanner {
public:
    using Real = typename Source::Distance;

    SurfacePlanner(const Source& source, const NormalSource& normals,
                   const ImageView<std::uint8_t>& active, const PlanRule& rule,
                   const Projection& projection, double scale, void* scratch, int workers)
        : source_{source},
          normals_{normals},
          active_{active},
          rule_{rule},
          axes_{projection, scale},
          scale_{scale},
          pyramid_{source.image.width, source.image.height},
          workers_{workers}
    {
        ScratchLayout block{scratch};
        counts_ = block.take<PlanCounts>(static_cast<std::size_t>(workers));
        pyramid_.take(block);
        for (int worker = 0; worker < workers; ++worker) counts_[worker] = {};
    }
    [[nodiscard]] static std::size_t scratch_size(int width, int height, int workers)
    {
        ScratchLayout block;
        static_cast<void>(block.take<PlanCounts>(static_cast<std::size_t>(workers)));
        PlanPyramid{width, height}.take(block);
        return block.size();
    }

    template <class E>
    [[nodiscard]] Outcome plan(E& executor)
    {
        // The middle rows of the tiles cost a part of a plan, and show too much open rather than too
        // little.
        constexpr int rows_apart = PlanGrid::leaf;
        bound(executor, rows_apart);
        search(executor, [](const PlanRect&, bool, PlanCounts&) {});
        const PlanCounts look = total();
        for (int worker = 0; worker < workers_; ++worker) counts_[worker] = {};
        if (look.tiled == 0 || look.tiled - look.worked < look.tiled / least_part) {
            mark_surfaces(executor, true);
            return outcome();
        }
        bound(executor, 1);
        search(executor, [&](const PlanRect& rect, bool is_active, PlanCounts& counts) {
            for (int y = rect.top; y <= rect.bottom; ++y)
                for (int g = rect.left / WorkMap::group; g <= rect.right / WorkMap::group; ++g) {
                    std::uint8_t& byte = active_(g, y);
                    if (!is_active) counts.skipped += byte;
                    byte = is_active && byte > 0 ? 1 : 0;
                }
        });
        return outcome();
    }
    /// Where everything is open by definition.
    template <class E>
    [[nodiscard]] Outcome plan_nothing(E& executor)
    {
        mark_surfaces(executor, false);
        return outcome();
    }

private:
    /// Less than one part in so many is not worth a plan.
    static constexpr int least_part = 4;

    /// Bounds of tiles, by some of their rows. The bytes of these count surfaces.
    template <class E>
    void bound(E& executor, int rows_apart)
    {
        const PlanGrid& grid = pyramid_.grid;
        executor.for_each(grid.rows(0), [&](int row, int worker) {
            constexpr int most = 8;
            PlanTile<Real> tiles[most];
            const PlanRect band = grid.rect(0, 0, row);
            const int top = (std::min)(band.top + rows_apart / 2, band.bottom);
            PlanCounts& counts = counts_[worker];
            for (int first = 0; first < grid.columns(0); first += most) {
                const int count = (std::min)(most, grid.columns(0) - first);
                for (int i = 0; i < count; ++i)
                    tiles[i].start(source_, normals_, axes_, scale_, grid.rect(0, first + i, row));
                for (int y = top; y <= band.bottom; y += rows_apart)
                    for (int i = 0; i < count; ++i)
                        active_(first + i, y) = static_cast<std::uint8_t>(
                            tiles[i].add(source_, normals_, axes_, static_cast<Real>(scale_), y));
                for (int i = 0; i < count; ++i) {
                    const std::size_t at = grid.index(0, first + i, row);
                    tiles[i].finish(axes_, pyramid_.cells[at], pyramid_.tiles[at]);
                    counts.background += tiles[i].background();
                    if (pyramid_.tiles[at].kind != TangentBound::Kind::nothing)
                        counts.tiled += grid.rect(0, first + i, row).pixels();
                }
            }
        });
        pyramid_.merge_up(axes_);
    }
    /// Calls write(rect, is_active, counts) for rectangles that make up the image.
    template <class E, class Write>
    void search(E& executor, const Write& write)
    {
        const PlanGrid& grid = pyramid_.grid;
        const PlanSearch search{rule_, axes_, pyramid_};
        const int roots = (std::min)(grid.levels - 1, 3);
        executor.for_each(grid.rows(roots), [&](int row, int worker) {
            PlanCounts& counts = counts_[worker];
            for (int column = 0; column < grid.columns(roots); ++column)
                search.plan(roots, column, row, [&](const PlanRect& rect, bool is_active) {
                    if (is_active) counts.worked += rect.pixels();
                    write(rect, is_active, counts);
                });
        });
    }
    /// All groups with surfaces are active, or none.
    template <class E>
    void mark_surfaces(E& executor, bool is_active)
    {
        constexpr int lanes = lanes_of<Real>, size = WorkMap::group;
        const int width = source_.image.width;
        executor.for_each(source_.image.height, [&](int y, int worker) {
            alignas(64) Real row[size];
            PlanCounts& counts = counts_[worker];
            for (int x = 0; x < width; x += size) {
                const int count = (std::min)(size, width - x);
                for (int i = count; i < size; ++i) row[i] = 0;
                static_cast<void>(read_row<lanes>(source_, x, count, y, row));
                DepthPlane<Real>::scale(row, count, static_cast<Real>(scale_));
                const int surfaces = count_surfaces<Real>(row);
                active_(x / size, y) = is_active && surfaces > 0 ? 1 : 0;
                counts.background += static_cast<std::uint64_t>(count - surfaces);
                if (!is_active) counts.skipped += static_cast<std::uint64_t>(surfaces);
            }
        });
    }
    [[nodiscard]] PlanCounts total() const
    {
        PlanCounts sum;
        for (int worker = 0; worker < workers_; ++worker) {
            sum.background += counts_[worker].background;
            sum.skipped += counts_[worker].skipped;
            sum.tiled += counts_[worker].tiled;
            sum.worked += counts_[worker].worked;
        }
        return sum;
    }
    [[nodiscard]] Outcome outcome() const
    {
        const PlanCounts sum = total();
        Outcome result{};
        result.work.pixels = static_cast<std::uint64_t>(source_.image.width) *
                             static_cast<std::uint64_t>(source_.image.height);
        result.work.background = sum.background;
        result.work.skipped = sum.skipped;
        result.work.passes = 1;
        return result;
    }

    const Source& source_;
    const NormalSource& normals_;
    const ImageView<std::uint8_t>& active_;
    const PlanRule& rule_;
    PlanAxes axes_;
    double scale_;
    PlanPyramid pyramid_;
    PlanCounts* counts_ = nullptr;
    int workers_;
};

}  // namespace detail

template <DepthInput Depth>
std::size_t plan_surface_scratch_size(const Depth& depth, int workers)
{
    const auto& image = depth_source(depth).image;
    if (workers < 1 || image.empty()) return 0;
    using Source = std::remove_cvref_t<decltype(depth_source(depth))>;
    return detail::SurfacePlanner<Source>::scratch_size(image.width, image.height, workers);
}

template <DepthInput Depth, class Options, ScratchSource S, Executor E>
Outcome plan_surface(const Depth& depth, const NormalSource& normals,
                     const ImageView<std::uint8_t>& active, const Options& options,
                     const Projection& projection, double tolerance, S&& scratch, E&& executor)
{
    const auto& source = depth_source(depth);
    using Source = std::remove_cvref_t<decltype(source)>;
    using Real = typename Source::Distance;
    const int width = source.image.width, height = source.image.height;
    const detail::PlanSettings settings = detail::plan_settings(options);
    if (const Error error = detail::check_source(source)) return {error};
    if (const Error error = detail::check_normals(normals, source.image)) return {error};
    if (const Error error = detail::check_output(active, "active")) return {error};
    if (const Error error = detail::check_groups(active, width, height, "active")) return {error};
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
    const double radius = settings.work ? settings.radius : 1;
    const detail::DepthPlane<Real> plane{width, height, radius};
    const detail::ReachRule reach{plane, radius, projection, settings.max_pixels};
    const detail::PlanRule rule = detail::plan_rule(
        options, reach, plane.scale(), source.step, detail::surface_rounding<Real>,
        std::numeric_limits<Real>::epsilon() / 2, tolerance);
    detail::SurfacePlanner<Source> planner{source,     normals,       active, rule,
                                           projection, plane.scale(), data,   workers};
    return settings.work ? planner.plan(executor) : planner.plan_nothing(executor);
}

}  // namespace nook::inline NOOK_TARGET
