#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/slice.hpp>
#include <nook/surface/slice_reference.hpp>
#include <nook/surface/slice_taps.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/work_map.hpp>

/// Ground-truth ambient occlusion from depth and normals: cosine-weighted visibility between the
/// horizons of a height field. J. Jimenez, X. Wu, A. Pesce & A. Jarabo, "Practical Real-Time
/// Strategies for Accurate Indirect Occlusion", 2016 (GTAO).
///
/// Three departures from the paper. Slices are weighted by the angle that they take about the
/// direction to the viewer, and the sum is divided by that of open slices, so that open ground of
/// any tilt is exactly 1 with any number of them. Samples count in full up to the radius. And
/// samples with a thickness hide their own extent.
namespace nook {

struct HorizonOptions {
    /// World length, ≥ 0: samples farther than that do not occlude.
    double radius = 1;
    /// Slices of the hemisphere per pixel, 0 … 64, with at most 512 / steps; 0 leaves everything
    /// open.
    int slices = 3;
    /// Samples per side of a slice, 0 … 512, at most 512 / slices.
    int steps = 3;
    /// World length, ≥ 0, that each sample reaches away from the viewer. What lies farther behind
    /// stays open, unless a nearer sample of the same side hides it. Infinite: a height field,
    /// which is also the fastest.
    double thickness = std::numeric_limits<double>::infinity();
    /// β ≥ 0: samples less than β times the pixel's distance above its tangent plane do not count.
    /// Unset: what the spacing of the depth buffer and float rounding may raise a sample above it,
    /// so that flat ground stays exactly 1 at any tilt. 0: none; flat ground then shows rounding.
    std::optional<double> bias{};
    /// The largest radius on the screen, in pixels, 1 … 4096. Bounds the distance of samples near
    /// the viewer, which then span less than `radius`.
    int max_pixels = 256;
    /// Turns all slices, for instance by the number of the frame.
    std::uint32_t seed = 0;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the visibility of every pixel, in [0, 1]; background and pixels without a normal get 1.
///
/// Comparable to cosine-weighted ray tracing of the height field. Samples outside the image and on
/// the background are open, and so is everything where the radius is smaller than a pixel. Slices,
/// and distances along them, differ from row to row; 16 pixels side by side take their samples at
/// the same offsets, which are whole pixels (see `detail::shared_reach`). Samples lie on the screen
/// within the radius at the pixel's distance: far off the axis of a perspective view, and for radii
/// that are not small beside the distance, occluders near the end of the radius are missed.
///
/// The same bits for any number of threads. Arc cosines are polynomials: within 1e-5 of the
/// reference; so are instruction sets among each other, unless a sample lies on the radius or on
/// the bias. Lengths times a power of two give the same bits. Float depth is computed in float,
/// double in double.
template <DepthInput Depth, class Value, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome horizon_ao(const Depth& depth, const NormalSource& normals,
                   const ImageView<Value>& visibility, const HorizonOptions& options,
                   const Projection& projection, const WorkMap& work_map = {}, S&& scratch = S{},
                   E&& executor = E{});

/// The same from the same samples, pixel by pixel in double as the formulas stand. Needs no
/// scratch.
template <DepthInput Depth, class Value, Executor E = Serial>
Outcome horizon_ao_reference(const Depth& depth, const NormalSource& normals,
                             const ImageView<Value>& visibility, const HorizonOptions& options,
                             const Projection& projection, const WorkMap& work_map = {},
                             E&& executor = E{});

/// Bytes of scratch that `horizon_ao` needs for a depth of that size and type.
template <DepthInput Depth>
[[nodiscard]] std::size_t horizon_ao_scratch_size(const Depth& depth, int workers = 1);

namespace detail {

[[nodiscard]] inline SliceSettings slice_settings(const HorizonOptions& options)
{
    return {options.radius, options.slices,     options.steps, options.thickness,
            options.bias,   options.max_pixels, options.seed};
}

/// The highest samples of both sides of a slice.
template <class Vector>
struct Horizons {
    Elevation<Vector> right, left;
};
template <class Pixels, class Frame, class Taps, class Real>
[[nodiscard]] NOOK_INLINE auto find_horizons(const Pixels& pixels, const Frame& slice,
                                             const Taps& taps, int first, int last, int opposite,
                                             const Real* data, const TapBits& hits)
{
    using Vector = typename Pixels::Vector;
    const Vector zero{}, one = zero + Real{1};
    Horizons<Vector> found{{zero, one}, {zero, one}};
    const Vector facing = pixels.facing(slice);
    for (int i = first; i < last; ++i) {
        if (!Pixels::wide && !hits[i] && !hits[i + opposite]) continue;
        const auto offset = pixels.offset(facing, taps.slope_x[i], taps.slope_y[i], taps.length[i]);
        const auto raise = [&](Elevation<Vector>& horizon) {
            return [&](const auto& counts, const Elevation<Vector>& at) NOOK_INLINE_LAMBDA {
                // By the cotangent, which falls as the elevation rises.
                const auto higher =
                    counts & (at.beside * horizon.above < horizon.beside * at.above);
                horizon.above = higher ? at.above : horizon.above;
                horizon.beside = higher ? at.beside : horizon.beside;
            };
        };
        if (Pixels::wide || hits[i])
            pixels.template look<1>(load<Pixels::lanes>(data + taps.index[i]), slice, offset,
                                    raise(found.right));
        if (Pixels::wide || hits[i + opposite])
            pixels.template look<-1>(load<Pixels::lanes>(data + taps.index[i + opposite]), slice,
                                     offset, raise(found.left));
    }
    return found;
}

/// Outwards, each sample that rises above the horizon hides what lies between the horizon, or its
/// own far end, and itself.
template <class Pixels, class Frame, class Taps, class Real>
[[nodiscard]] NOOK_INLINE auto hidden_by_extents(const Pixels& pixels, const Frame& slice,
                                                 const Taps& taps, int first, int last,
                                                 int opposite, const Real* data,
                                                 const TapBits& hits, Real thickness)
{
    using Vector = typename Pixels::Vector;
    const Vector zero{};
    Vector hidden = zero, right = zero, left = zero;
    const auto add = [&]<int side>(std::integral_constant<int, side>, const Vector& there,
                                   const auto& offset, Vector& horizon) {
        pixels.template look<side>(
            there, slice, offset,
            [&](const auto& counts, const Elevation<Vector>& at) NOOK_INLINE_LAMBDA {
                if (!any(counts)) return;
                const auto [top, end] = hidden_below_ends<side>(at, slice, thickness);
                const auto higher = counts & (top > horizon);
                hidden = higher ? hidden + (top - larger(horizon, smaller(end, top))) : hidden;
                horizon = higher ? top : horizon;
            });
    };
    const Vector facing = pixels.facing(slice);
    for (int i = first; i < last; ++i) {
        if (!Pixels::wide && !hits[i] && !hits[i + opposite]) continue;
        const auto offset = pixels.offset(facing, taps.slope_x[i], taps.slope_y[i], taps.length[i]);
        if (Pixels::wide || hits[i])
            add(std::integral_constant<int, 1>{}, load<Pixels::lanes>(data + taps.index[i]), offset,
                right);
        if (Pixels::wide || hits[i + opposite])
            add(std::integral_constant<int, -1>{},
                load<Pixels::lanes>(data + taps.index[i + opposite]), offset, left);
    }
    return hidden;
}

template <bool orthographic, bool solid, class Source, class Value, class S, class E>
Outcome run_horizons(const SurfaceInput<Source>& input, const ImageView<Value>& visibility,
                     const SliceSettings& settings, const SliceShade& shade, S&& scratch,
                     E&& executor)
{
    using Real = typename Source::Distance;
    using Pixels = SlicePixels<Real, orthographic>;
    using Vector = typename Pixels::Vector;
    const Real thickness = static_cast<Real>(shade.thickness);
    const auto part = [&](const Pixels& pixels, const SliceTaps<Real>& taps,
                          const SlicePattern& pattern, const Real* data, const TapBits& hits) {
        // Some slices at a time, step by step: each step then waits for none of the others.
        constexpr int batch = 4;
        SliceFrame<Vector> frames[batch];
        Horizons<Vector> horizons[batch];
        bool seen[batch];
        Vector hidden{}, open{};
        for (int begin = 0; begin < pattern.slices; begin += batch) {
            const int count = (std::min)(batch, pattern.slices - begin);
            for (int k = 0; k < count; ++k) {
                frames[k] = pixels.frame(pattern, begin + k);
                open = open + frames[k].weight * frames[k].open;
            }
            for (int k = 0; k < count; ++k) {
                const int first = (begin + k) * pattern.steps, last = first + pattern.steps;
                seen[k] =
                    hits.any(first, last) || hits.any(first + pattern.taps, last + pattern.taps);
                if (!seen[k]) continue;
                if constexpr (solid)
                    horizons[k] = find_horizons(pixels, frames[k], taps, first, last, pattern.taps,
                                                data, hits);
                else
                    hidden = hidden + frames[k].weight *
                                          hidden_by_extents(pixels, frames[k], taps, first, last,
                                                            pattern.taps, data, hits, thickness);
            }
            if constexpr (solid)
                for (int k = 0; k < count; ++k)
                    if (seen[k])
                        hidden =
                            hidden + frames[k].weight * hidden_below(horizons[k].right,
                                                                     horizons[k].left, frames[k]);
        }
        return Vector(Real{1} - hidden / larger(open, Vector(Vector{} + Real{0x1p-60})));
    };
    return run_slices<orthographic>(input, visibility, settings, shade, part, scratch, executor);
}

}  // namespace detail

template <DepthInput Depth>
std::size_t horizon_ao_scratch_size(const Depth& depth, int workers)
{
    const auto& image = depth_source(depth).image;
    return detail::surface_scratch_size<distance_t<Depth>>(image.width, image.height, workers);
}

template <DepthInput Depth, class Value, ScratchSource S, Executor E>
Outcome horizon_ao(const Depth& depth, const NormalSource& normals,
                   const ImageView<Value>& visibility, const HorizonOptions& options,
                   const Projection& projection, const WorkMap& work_map, S&& scratch, E&& executor)
{
    const auto& source = depth_source(depth);
    using Source = std::remove_cvref_t<decltype(source)>;
    using Real = typename Source::Distance;
    const detail::SliceSettings settings = detail::slice_settings(options);
    if (const Error error =
            detail::check_surface(source, normals, visibility, projection, work_map))
        return {error};
    if (const Error error = detail::check_slices(settings)) return {error};
    if (visibility.empty()) return {};
    const detail::SurfaceInput<Source> input{
        source, normals, projection, work_map,
        detail::DepthPlane<Real>{visibility.width, visibility.height, settings.bounded_radius()}};
    const detail::SliceShade shade{settings, input.plane.scale(), source.step,
                                   detail::surface_rounding<Real>, projection.orthographic};
    const auto run = [&]<bool orthographic>(std::bool_constant<orthographic>) {
        if (shade.solid)
            return detail::run_horizons<orthographic, true>(input, visibility, settings, shade,
                                                            scratch, executor);
        return detail::run_horizons<orthographic, false>(input, visibility, settings, shade,
                                                         scratch, executor);
    };
    return projection.orthographic ? run(std::true_type{}) : run(std::false_type{});
}

template <DepthInput Depth, class Value, Executor E>
Outcome horizon_ao_reference(const Depth& depth, const NormalSource& normals,
                             const ImageView<Value>& visibility, const HorizonOptions& options,
                             const Projection& projection, const WorkMap& work_map, E&& executor)
{
    const detail::SliceSettings settings = detail::slice_settings(options);
    // What a side of a slice hides, from its samples outwards.
    const auto hidden = [](const detail::SliceSide& side) {
        double sum = 0, horizon = 0;
        for (int i = 0; i < side.count; ++i) {
            const double top = side.hidden(side.front[i]);
            if (!(top > horizon)) continue;
            sum += top - (std::max)(horizon, side.hidden(side.back[i]));
            horizon = top;
        }
        return sum;
    };
    return detail::run_slice_reference(
        depth_source(depth), normals, visibility, settings, projection, work_map,
        [&](const detail::SliceSide& right, const detail::SliceSide& left, double) {
            return hidden(right) + hidden(left);
        },
        executor);
}

}  // namespace nook::inline NOOK_TARGET
