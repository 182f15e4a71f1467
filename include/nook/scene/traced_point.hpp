#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/adaptive_directions.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/directions.hpp>
#include <nook/scene/hemisphere.hpp>
#include <nook/scene/traced_options.hpp>
#include <nook/scene/vector.hpp>

/// One shading point: its directions, what they hit, and the sums of what that lets through.
namespace nook::inline NOOK_TARGET::detail {

struct ShadingPoint {
    /// In scene space, above the surface by what may be wrong with it.
    Vector3 start;
    /// The directions' pole, and the normal of the surface itself: unit length. They differ for
    /// interpolated normals; directions below the surface are then left out.
    Vector3 normal, surface;
    /// See `Hemisphere`; in scene space.
    double slack;
    /// Chooses the directions.
    std::uint32_t sample;
};

/// Sums over the directions that count.
struct PointSums {
    double open = 0;
    /// The sum of squares, for adaptive directions.
    double squares = 0;
    int count = 0;
    Vector3 bent{0, 0, 0};
    double colour[3] = {};
    std::uint64_t rays = 0, skipped_rays = 0;

    /// Exactly 1 where nothing counts.
    [[nodiscard]] double visibility() const { return count == 0 ? 1 : open / count; }
};

/// Calls f(first, count) for as many directions as a fan takes at once.
template <class F>
void for_each_batch(int directions, const F& f)
{
    std::uint32_t first = 0;
    for (int left = directions; left > 0;) {
        const int count = (std::min)(left, RayFan::most);
        f(first, count);
        first += static_cast<std::uint32_t>(count);
        left -= count;
    }
}

/// The directions of a point, in world axes: `count` of them from `first` on, ready in a fan.
template <class Options>
inline void fill_fan(const Options& options, const Vector3& normal, std::uint32_t sample,
                     std::uint32_t first, int count, RayFan& fan)
{
    fan.count = count;
    cosine_directions(options.set, hash(options.seed, sample), options.first_direction + first,
                      count, fan.direction[0], fan.direction[1], fan.direction[2]);
    const HemisphereBasis basis{normal};
    const auto floats = [](const Vector3& v, float(&to)[3]) {
        to[0] = static_cast<float>(v.x);
        to[1] = static_cast<float>(v.y);
        to[2] = static_cast<float>(v.z);
    };
    float tangent[3], bitangent[3], pole[3];
    floats(basis.tangent(), tangent);
    floats(basis.bitangent(), bitangent);
    floats(basis.normal(), pole);
    for (int i = 0; i < count; i += float_lanes) {
        const FloatLanes x = load<float_lanes>(fan.direction[0] + i);
        const FloatLanes y = load<float_lanes>(fan.direction[1] + i);
        const FloatLanes z = load<float_lanes>(fan.direction[2] + i);
        for (int k = 0; k < 3; ++k)
            store(fan.direction[k] + i,
                  rounded(x * tangent[k]) + rounded(y * bitangent[k]) + rounded(z * pole[k]));
    }
}
[[nodiscard]] inline Vector3 direction(const RayFan& fan, int i)
{
    return {double{fan.direction[0][i]}, double{fan.direction[1][i]}, double{fan.direction[2][i]}};
}

/// Traces points of one hierarchy. Bent normals are summed up where they are wanted.
template <class Options, bool wants_bent>
class PointTracer {
public:
    static constexpr bool wants_hits = Options::has_falloff || Options::has_colour;

    PointTracer(const Bvh& bvh, const Options& options)
        : options_{options},
          radius_{scene_length(options.radius, bvh.space().scale)},
          scale_{bvh.space().scale}
    {
        reach_ = radius_;
        if constexpr (Options::has_secondary) {
            const SecondaryRays& secondary = options.secondary;
            half_ = secondary.radius < 0 ? radius_ / 2
                                         : scene_length(secondary.radius, bvh.space().scale);
            const double centre = radius_ / 2 * (1 + secondary.jitter);
            reach_ = (std::max)(radius_, std::sqrt(centre * centre + half_ * half_));
        }
    }
    /// How far from a point anything may matter, in scene space.
    [[nodiscard]] double reach() const { return reach_; }
    /// A direction that nothing stops and its secondary rays.
    [[nodiscard]] std::uint64_t rays_per_open_direction() const
    {
        if constexpr (Options::has_secondary)
            return half_ > 0 ? 1 + static_cast<std::uint64_t>(segments()) : 1;
        else return 1;
    }

    [[nodiscard]] PointSums trace(const Neighbourhood& around, const ShadingPoint& point) const
    {
        // Rays from so far away hit nothing.
        if (around.empty() || !(largest(point.start) < SceneRay::farthest_origin))
            return open(point);
        PointSums sums;
        const Hemisphere hemisphere{around, point.start, point.surface, radius_, point.slack};
        int directions = options_.directions;
        if constexpr (Options::is_adaptive) {
            if (nothing_in_reach(around, hemisphere, point)) return open(point);
            directions = chosen_directions(around, hemisphere, point, sums);
        }
        trace(around, hemisphere, point, directions, sums);
        return sums;
    }

private:
    /// Whether neither a primary ray nor a segment can meet anything: segments may reach farther.
    [[nodiscard]] bool nothing_in_reach(const Neighbourhood& around, const Hemisphere& hemisphere,
                                        const ShadingPoint& point) const
    {
        if constexpr (Options::has_secondary)
            if (half_ > 0 && reach_ > radius_)
                return Hemisphere{around, point.start, point.surface, reach_, point.slack}
                    .nothing_above();
        return hemisphere.nothing_above();
    }
    /// What a point has of which nothing comes near.
    [[nodiscard]] PointSums open(const ShadingPoint& point) const
    {
        PointSums sums;
        if constexpr (!wants_bent) {
            if (dot(point.normal, point.surface) > 1 - 0x1p-40) {
                sums.open = sums.count = options_.directions;
                sums.skipped_rays =
                    static_cast<std::uint64_t>(options_.directions) * rays_per_open_direction();
                return sums;
            }
        }
        RayFan fan;
        for_each_batch(options_.directions, [&](std::uint32_t first, int count) {
            fill_fan(options_, point.normal, point.sample, first, count, fan);
            fan.complete(point.surface);
            const RayMask counted = above_surface(fan, point);
            sums.count += std::popcount(counted);
            sums.skipped_rays +=
                static_cast<std::uint64_t>(std::popcount(counted)) * rays_per_open_direction();
            for (RayMask left = counted; left != 0; left &= left - 1)
                let_through(fan, std::countr_zero(left), 1, sums);
        });
        return sums;
    }
    /// Directions that leave the surface. They rise by more than rounding of the floats.
    [[nodiscard]] static RayMask above_surface(const RayFan& fan, const ShadingPoint& point)
    {
        if (dot(point.normal, point.surface) > 1 - 0x1p-40) return fan.all();
        RayMask above = 0;
        for (int i = 0; i < fan.count; ++i)
            above |= RayMask{dot(direction(fan, i), point.surface) > 0x1p-20} << i;
        return above;
    }

    /// How many directions a point takes. Counts the pilot, and what is spared.
    [[nodiscard]] int chosen_directions(const Neighbourhood& around, const Hemisphere& hemisphere,
                                        const ShadingPoint& point, PointSums& sums) const
    {
        const AdaptiveDirections& stopping = options_.stopping;
        const int all = options_.directions, least = stopping.least;
        const double calmest = pilot_variance(least, least, least);
        const int fewest = enough_directions(stopping, calmest, all);
        int count = enough_directions(stopping, largest_variance, all), spent = 0;
        // A pilot is asked where it may save more than it costs, and leaves room for what it may ask for.
        if (least < count - fewest && count <= all - least) {
            ShadingPoint elsewhere = point;
            elsewhere.sample = hash(~point.sample);
            PointSums pilot;
            trace(around, hemisphere, elsewhere, least, pilot);
            double variance = pilot_variance(pilot.open, pilot.squares, pilot.count);
            // Directions below the surface tell nothing.
            variance *= static_cast<double>(least) / (std::max)(pilot.count, 1);
            count = enough_directions(stopping, variance, all - least);
            sums.rays = pilot.rays;
            sums.skipped_rays = pilot.skipped_rays;
            spent = least;
        }
        sums.skipped_rays += static_cast<std::uint64_t>(all - spent - count);
        return count;
    }
    void trace(const Neighbourhood& around, const Hemisphere& hemisphere, const ShadingPoint& point,
               int directions, PointSums& sums) const
    {
        RayFan fan;
        for_each_batch(directions, [&](std::uint32_t first, int count) {
            fill_fan(options_, point.normal, point.sample, first, count, fan);
            fan.complete(point.surface);
            trace(around, hemisphere, point, fan, first, sums);
        });
    }
    void trace(const Neighbourhood& around, const Hemisphere& hemisphere, const ShadingPoint& point,
               const RayFan& fan, std::uint32_t first, PointSums& sums) const
    {
        const RayMask counted = above_surface(fan, point);
        const auto count = static_cast<std::uint64_t>(std::popcount(counted));
        sums.count += static_cast<int>(count);
        RayMask open = counted;
        bool tested = false;
        if constexpr (wants_hits) {
            typename Hemisphere::Nearest nearest;
            nearest.rays = counted;
            hemisphere.find_nearest(fan, nearest);
            tested = nearest.tested;
            for (RayMask left = counted; left != 0; left &= left - 1) {
                const int i = std::countr_zero(left);
                if (!nearest.hits[i]) continue;
                open &= ~(RayMask{1} << i);
                stop(fan, i, nearest.hits[i], sums);
            }
        } else {
            typename Hemisphere::Open any;
            any.rays = counted;
            hemisphere.find_open(fan, any);
            tested = any.tested;
            open = any.rays;
        }
        (tested ? sums.rays : sums.skipped_rays) += count;
        if constexpr (Options::has_secondary) {
            // Segments go where no primary does: what is near decides, not what primaries met.
            const bool spared =
                open == 0 || !(half_ > 0) ||
                (!tested && Hemisphere{around, point.start, point.surface, reach_, point.slack}
                                .nothing_above());
            for (RayMask left = open; left != 0; left &= left - 1) {
                const int i = std::countr_zero(left);
                const double share = spared ? spare_secondary(sums)
                                            : trace_secondary(around, point, fan, i, first, sums);
                let_through(fan, i, share, sums);
            }
        } else if constexpr (wants_bent) {
            for (RayMask left = open; left != 0; left &= left - 1)
                let_through(fan, std::countr_zero(left), 1, sums);
        } else {
            sums.open += std::popcount(open);
            if constexpr (Options::is_adaptive) sums.squares += std::popcount(open);
        }
    }

    void let_through(const RayFan& fan, int i, double share, PointSums& sums) const
    {
        sums.open += share;
        if constexpr (Options::is_adaptive) sums.squares += rounded(share * share);
        if constexpr (wants_bent) sums.bent = sums.bent + direction(fan, i) * share;
    }
    void stop(const RayFan& fan, int i, const Hit& hit, PointSums& sums) const
    {
        double through = 0;
        if constexpr (Options::has_falloff) {
            through = static_cast<double>(options_.falloff(hit.t / scale_));
            through = through > 0 && !is_nan(through) ? (std::min)(through, 1.0) : 0;
            if (through > 0) let_through(fan, i, through, sums);
        }
        if constexpr (Options::has_colour) {
            const glm::vec3 colour = options_.colour(hit.face);
            for (int k = 0; k < 3; ++k) {
                const float value = k == 0 ? colour.x : k == 1 ? colour.y : colour.z;
                if (is_finite(value)) sums.colour[k] += rounded((1 - through) * double{value});
            }
        }
    }

    [[nodiscard]] int segments() const { return options_.secondary.half_rays ? 4 : 2; }
    [[nodiscard]] double spare_secondary(PointSums& sums) const
    {
        if (half_ > 0) sums.skipped_rays += static_cast<std::uint64_t>(segments());
        return 1;
    }
    /// The share that the secondary rays of an open primary leave of it.
    [[nodiscard]] double trace_secondary(const Neighbourhood& around, const ShadingPoint& point,
                                         const RayFan& fan, int i, std::uint32_t first,
                                         PointSums& sums) const
    {
        const SecondaryRays& secondary = options_.secondary;
        const Vector3 along = direction(fan, i);
        double way = radius_ / 2;
        if (secondary.jitter > 0) {
            const std::uint32_t random =
                hash(hash(~options_.seed, point.sample),
                     options_.first_direction + first + static_cast<std::uint32_t>(i));
            way *= 1 + rounded(secondary.jitter * ((random + 0.5) * 0x1p-31 - 1));
        }
        const Vector3 centre = point.start + along * way;
        const Vector3 across = cross(along, point.normal);
        // Along the normal every tangent is as good.
        const Vector3 one = dot(across, across) > 0x1p-40 ? normalised(across)
                                                          : HemisphereBasis{point.normal}.tangent();
        const Vector3 two = normalised(cross(along, one));
        // No farther than the scene reaches, and not down to the surface under the point, which may rise
        // a little where its vertices are rounded.
        const double half = (std::min)(half_, 4 * (1 + largest(centre)));
        const double height =
            way * dot(along, point.surface) - (point.slack + rounded(clearance * (way + half)));
        int closed = 0;
        const auto blocked = [&](const Vector3& u, double from, double to) {
            return to > from && around.occluded({centre + u * from, u, to - from}) ? 1 : 0;
        };
        for (const Vector3& u : {one, two}) {
            const double rise = dot(u, point.surface);
            double from = -half, to = half;
            if (rise > 0) from = (std::max)(from, -height / rise);
            if (rise < 0) to = (std::min)(to, height / -rise);
            if (rise == 0 && height < 0) continue;
            if (secondary.half_rays) {
                closed += blocked(u, (std::max)(from, 0.0), to);
                closed += blocked(u, from, (std::min)(to, 0.0));
            } else {
                closed += blocked(u, from, to);
            }
        }
        sums.rays += static_cast<std::uint64_t>(segments());
        return 1 - static_cast<double>(closed) / segments();
    }

    /// How high segments stay above the tangent plane, as a share of their distance.
    static constexpr double clearance = 0x1p-10;

    const Options& options_;
    double radius_, scale_, reach_ = 0, half_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
