#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/slice.hpp>
#include <nook/surface/slice_taps.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/work_map.hpp>

/// Kernels over slices pixel by pixel, in double and with angles: the samples of the fast forms,
/// seen through none of their shortcuts.
namespace nook::inline NOOK_TARGET::detail {

/// One side of a slice: the elevations ε above the tangent at which its samples begin and end, from
/// the nearest sample outwards.
struct SliceSide {
    int count = 0;
    double gamma;  ///< of the normal, positive towards this side
    double front[largest_slice_taps], back[largest_slice_taps];

    [[nodiscard]] double hidden(double elevation) const { return slice_hidden(elevation, gamma); }
};

/// `slice(right, left, open)` tells how much of a slice is hidden.
template <class Stored, class Decode, class Value, class Slice, class E>
Outcome run_slice_reference(const DepthSource<Stored, Decode>& source, const NormalSource& normals,
                            const ImageView<Value>& visibility, const SliceSettings& settings,
                            const Projection& projection, const WorkMap& work_map,
                            const Slice& slice, E&& executor)
{
    using Real = typename DepthSource<Stored, Decode>::Distance;
    constexpr int size = WorkMap::group;
    if (const Error error = check_surface(source, normals, visibility, projection, work_map))
        return {error};
    if (const Error error = check_slices(settings)) return {error};
    if (visibility.empty()) return {};
    const int width = visibility.width, height = visibility.height;
    const bool work = settings.ask_for_work(), flat = projection.orthographic;
    const DepthPlane<Real> plane{width, height, settings.bounded_radius()};
    const ReachRule rule{plane, settings.bounded_radius(), projection, settings.max_pixels};
    const SliceShade shade{settings, plane.scale(), source.step, surface_rounding<Real>,
                           projection.orthographic};
    const auto distance_at = [&](int x, int y) {
        const double distance = surface_distance(source, x, y) * plane.scale();
        return distance < double{DepthPlane<Real>::farthest} ? distance : 0.0;
    };
    const auto usable = [&](int x, int y) {
        const Normal n = unit_normal(normals, x, y);
        return n.x != 0 || n.y != 0 || n.z != 0;
    };

    const auto shaded = [&](int x, int y, const Reach& reach, const SlicePattern& pattern) {
        const double distance = distance_at(x, y);
        const Normal n = unit_normal(normals, x, y);
        const double sx = flat ? 0 : (x + 0.5 - projection.cx) / projection.fx;
        const double sy = flat ? 0 : (projection.cy - y - 0.5) / projection.fy;
        const double ray = std::sqrt(sx * sx + sy * sy + 1);
        const double view[] = {-sx / ray, -sy / ray, 1 / ray};
        const double across = std::fabs(n.x * sx + n.y * sy - n.z);
        const auto rise = shade.rise.at(distance, across, reach.slope);
        const SlicePlaces places{reach, rule};
        const float pixel_x = static_cast<float>(places.pixel.x);
        const float pixel_y = static_cast<float>(places.pixel.y);
        double all = 0, open = 0;
        for (int k = 0; k < pattern.slices; ++k) {
            const double cosine{pattern.cosine[k]}, sine{pattern.sine[k]};
            const double lean = cosine * view[0] + sine * view[1];
            const double left_over = std::sqrt(1 - lean * lean), weight = 1 / (1 - lean * lean);
            const double tangent[] = {(cosine - lean * view[0]) / left_over,
                                      (sine - lean * view[1]) / left_over,
                                      -lean * view[2] / left_over};
            const auto dot = [](const double* a, double bx, double by, double bz) {
                return a[0] * bx + a[1] * by + a[2] * bz;
            };
            const double to_view = dot(view, n.x, n.y, n.z);
            const double to_side = dot(tangent, n.x, n.y, n.z);
            const double length = std::hypot(to_view, to_side);
            // Normals that face away take the measure of those that face the viewer.
            const double gamma = std::atan2(to_side, to_view);
            const double whole =
                slice_open(std::atan2(std::fabs(to_side), std::fabs(to_view))) * length * weight;
            SliceSide sides[2];
            for (int side = 0; side < 2; ++side) {
                const double sign = side == 0 ? 1 : -1;
                sides[side].gamma = sign * gamma;
                for (int j = 0; j < pattern.steps; ++j) {
                    const int tap = side * pattern.taps + k * pattern.steps + j;
                    const float far_off = places.pixels(pattern.distance[tap]);
                    const int right = whole_pixels(rounded(far_off * pattern.right[tap]), pixel_x);
                    const int down = whole_pixels(rounded(far_off * pattern.down[tap]), pixel_y);
                    const int to_x = x + right, to_y = y + down;
                    if (to_x < 0 || to_x >= width || to_y < 0 || to_y >= height) continue;
                    const double there = distance_at(to_x, to_y);
                    if (!(there > 0)) continue;
                    const double scale = flat ? 1 : there, step = there - distance;
                    const double v[] = {sx * step + right / rule.fx * scale,
                                        sy * step - down / rule.fy * scale, -step};
                    const double square = dot(v, v[0], v[1], v[2]);
                    const double above = dot(v, n.x, n.y, n.z);
                    const double least =
                        rise.constant + rise.per_distance * there + rise.per_square * square;
                    if (square > shade.square_radius || !(above > least) || !(above > 0)) continue;
                    const double offset = std::hypot(right / rule.fx, down / rule.fy);
                    // As if met in the slice, but for its height above the tangent plane.
                    const auto elevation = [&](double back) {
                        const double toward = dot(v, view[0], view[1], view[2]) - back;
                        const double beside = offset * scale * left_over;
                        const double up = (above - back * to_view) / length;
                        const double along = (to_view * beside - sign * to_side * toward) / length;
                        // The direction to the viewer ends this side of the slice.
                        const double end =
                            to_view > 0 ? std::numbers::pi / 2 + sides[side].gamma : 4;
                        return up > 0 ? (std::min)(std::atan2(up, along), end) : 0.0;
                    };
                    SliceSide& s = sides[side];
                    s.front[s.count] = elevation(0);
                    s.back[s.count] = shade.solid ? 0 : elevation(shade.thickness);
                    ++s.count;
                }
            }
            if (!(length > 0)) continue;
            all += slice(sides[0], sides[1], whole / (length * weight)) * length * weight;
            open += whole;
        }
        return open > 0 ? (std::min)((std::max)(1 - all / open, 0.0), 1.0) : 1.0;
    };

    Outcome outcome{};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool surface = distance_at(x, y) > 0, active = work_map.is_active(x, y);
            outcome.work.background += !surface || (active && !usable(x, y));
            outcome.work.skipped += surface && !active;
        }
    executor.for_each(height, [&](int y, int) {
        const SlicePattern pattern{work ? settings.slices : 0, work ? settings.steps : 0, y,
                                   settings.seed};
        for (int x = 0; x < width; x += size) {
            SurfaceGroup<Real> group{};
            Real values[size];
            const int count = (std::min)(size, width - x);
            for (Real& value : values) value = 1;
            for (int i = 0; i < count; ++i)
                if (usable(x + i, y)) group.distance[i] = static_cast<Real>(distance_at(x + i, y));
            if (work && work_map.is_active(x, y))
                for_each_reach(
                    group, rule, values, [&](const Reach& reach, unsigned, Real* results) {
                        for (int i = 0; i < size; ++i)
                            results[i] = group.distance[i] > 0
                                             ? static_cast<Real>(shaded(x + i, y, reach, pattern))
                                             : Real{1};
                    });
            for (int i = 0; i < count; ++i) visibility(x + i, y) = static_cast<Value>(values[i]);
        }
    });
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET::detail
