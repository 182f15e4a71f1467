#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/surface/alchemy.hpp>
#include <nook/surface/alchemy_options.hpp>
#include <nook/surface/alchemy_shade.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/work_map.hpp>

namespace nook::inline NOOK_TARGET {

/// Alchemy ambient obscurance pixel by pixel, in double, as the formulas stand: what `alchemy_ao` is
/// tested against. The arguments are those of `alchemy_ao`; needs no scratch.
template <DepthInput Depth, class Value, Executor E = Serial>
Outcome alchemy_ao_reference(const Depth& depth, const NormalSource& normals,
                             const ImageView<Value>& visibility, const AlchemyOptions& options,
                             const Projection& projection, const WorkMap& work_map = {},
                             E&& executor = E{});

namespace detail {

template <class Source>
class AlchemyReference {
public:
    using Real = typename Source::Distance;

    AlchemyReference(const Source& source, const NormalSource& normals,
                     const AlchemyOptions& options, const Projection& projection)
        : source_{source},
          normals_{normals},
          options_{options},
          projection_{projection},
          plane_{source.image.width, source.image.height, options.radius},
          rule_{plane_, options.radius, projection, options.max_pixels},
          shade_{options, plane_.scale(), source.step, surface_rounding<Real>,
                 projection.orthographic}
    {}
    /// Scaled; 0 on the background.
    [[nodiscard]] double distance(int x, int y) const
    {
        const double distance = surface_distance(source_, x, y) * plane_.scale();
        return distance < double{DepthPlane<Real>::farthest} ? distance : 0.0;
    }
    /// Of pixels with a surface and a normal; others have 0.
    [[nodiscard]] double shaded_distance(int x, int y) const
    {
        const Normal n = unit_normal(normals_, x, y);
        return n.x != 0 || n.y != 0 || n.z != 0 ? distance(x, y) : 0.0;
    }
    /// How far each pixel of the group from x on looks, as a slope; 0 for less than a pixel.
    void read_slopes(int x, int y, double* slopes) const
    {
        SurfaceGroup<Real> group{};
        for (int i = 0; i < WorkMap::group && x + i < source_.image.width; ++i)
            group.distance[i] = static_cast<Real>(shaded_distance(x + i, y));
        for (int i = 0; i < WorkMap::group; ++i)
            slopes[i] = group.distance[i] > 0 ? pixel_slope(group.distance[i], rule_) : 0;
        if (options_.pattern == SamplePattern::pixel) return;
        // Number the reaches of the group, and let each pixel look up its own.
        double reaches[WorkMap::group + 1] = {};
        Real numbers[WorkMap::group] = {};
        int count = 0;
        for_each_reach(group, rule_, numbers, [&](const Reach& reach, unsigned, Real* results) {
            reaches[++count] = reach.slope;
            for (int i = 0; i < WorkMap::group; ++i) results[i] = static_cast<Real>(count);
        });
        for (int i = 0; i < WorkMap::group; ++i) slopes[i] = reaches[static_cast<int>(numbers[i])];
    }
    /// The samples of row y.
    [[nodiscard]] AlchemySpiral spiral(int y) const
    {
        const bool by_row = options_.pattern == SamplePattern::row;
        return {options_.samples, options_.turns, by_row ? row_turn(y, options_.seed) : 0};
    }
    /// Where a sample at (u, v) of the disc lies, from the pixel on.
    [[nodiscard]] PixelOffset<std::int32_t> offset(int x, int y, double slope, float u,
                                                   float v) const
    {
        const auto reach_x = static_cast<float>(slope * rule_.fx);
        const auto reach_y = static_cast<float>(slope * rule_.fy);
        if (options_.pattern == SamplePattern::row)
            return {whole_pixels(u, reach_x), whole_pixels(v, reach_y)};
        const int turned = Rotations::of(x, y, options_.seed);
        return pixel_offset(u, v, rotations_.cosine[turned], rotations_.sine[turned], reach_x,
                            reach_y);
    }
    /// The visibility of a pixel that has a surface, a normal and a slope > 0.
    [[nodiscard]] double shade(int x, int y, double slope, const AlchemySpiral& spiral) const
    {
        const Normal n = unit_normal(normals_, x, y);
        const bool flat = projection_.orthographic;
        const double here = distance(x, y);
        const double sx = flat ? 0 : (x + 0.5 - projection_.cx) / projection_.fx;
        const double sy = flat ? 0 : (projection_.cy - y - 0.5) / projection_.fy;
        const auto rise = shade_.rise.at(here, std::fabs(n.x * sx + n.y * sy - n.z), slope);
        double sum = 0;
        for (int i = 0; i < options_.samples; ++i) {
            const PixelOffset to = offset(x, y, slope, spiral.x[i], spiral.y[i]);
            const int to_x = x + to.right, to_y = y + to.down;
            if (to_x < 0 || to_x >= source_.image.width || to_y < 0 || to_y >= source_.image.height)
                continue;
            const double there = distance(to_x, to_y);
            if (!(there > 0)) continue;
            const double scale = flat ? 1 : there, step = there - here;
            const double vx = sx * step + to.right / rule_.fx * scale;
            const double vy = sy * step - to.down / rule_.fy * scale;
            const double square = vx * vx + vy * vy + step * step;
            const double bias =
                rise.constant + rise.per_distance * there + rise.per_square * square;
            const double above = n.x * vx + n.y * vy - n.z * step;
            sum += shade_.scalable
                       ? scalable_term(above, square, bias, shade_.epsilon, shade_.square_radius)
                       : alchemy_term(above, square, bias, shade_.epsilon);
        }
        return shade_.visibility(sum, options_.samples);
    }

private:
    const Source& source_;
    const NormalSource& normals_;
    const AlchemyOptions& options_;
    const Projection& projection_;
    DepthPlane<Real> plane_;
    ReachRule rule_;
    AlchemyShade shade_;
    Rotations rotations_;
};

}  // namespace detail

template <DepthInput Depth, class Value, Executor E>
Outcome alchemy_ao_reference(const Depth& depth, const NormalSource& normals,
                             const ImageView<Value>& visibility, const AlchemyOptions& options,
                             const Projection& projection, const WorkMap& work_map, E&& executor)
{
    const auto& source = depth_source(depth);
    using Source = std::remove_cvref_t<decltype(source)>;
    if (const Error error =
            detail::check_surface(source, normals, visibility, projection, work_map))
        return {error};
    if (const Error error = detail::check_alchemy(options)) return {error};
    if (visibility.empty()) return {};
    const AlchemyOptions used = detail::asks_for_work(options) ? options : detail::no_alchemy();
    const detail::AlchemyReference<Source> reference{source, normals, used, projection};
    const int width = visibility.width, height = visibility.height;
    executor.for_each(height, [&](int y, int) {
        const detail::AlchemySpiral spiral = reference.spiral(y);
        double slopes[WorkMap::group];
        for (int x = 0; x < width; ++x) {
            if (x % WorkMap::group == 0) reference.read_slopes(x, y, slopes);
            const double slope = slopes[x % WorkMap::group];
            const bool shaded = slope > 0 && work_map.is_active(x, y);
            visibility(x, y) =
                static_cast<Value>(shaded ? reference.shade(x, y, slope, spiral) : 1.0);
        }
    });
    Outcome outcome{};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool active = work_map.is_active(x, y), surface = reference.distance(x, y) > 0;
            const bool shaded = active ? reference.shaded_distance(x, y) > 0 : surface;
            outcome.work.background += !shaded;
            outcome.work.skipped += !active && surface;
        }
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
