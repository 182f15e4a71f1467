#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#if defined(NOOK_COMPARE_EMBREE) && NOOK_COMPARE_EMBREE >= 4
#include <embree4/rtcore.h>
#elif defined(NOOK_COMPARE_EMBREE)
#include <embree3/rtcore.h>
#endif

#include "directions.hpp"
#include "kernels.hpp"

#if defined(NOOK_COMPARE_EMBREE)

/// Embree's any-hit calls over a list of points.
namespace compare::inline NOOK_TARGET {

/// The arguments of a query that says that its rays are incoherent.
class Query {
public:
    explicit Query(void* scene) : scene_{static_cast<RTCScene>(scene)}
    {
#if NOOK_COMPARE_EMBREE >= 4
        rtcInitOccludedArguments(&arguments_);
        arguments_.flags = RTC_RAY_QUERY_FLAG_INCOHERENT;
#else
        rtcInitIntersectContext(&context_);
        context_.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
#endif
    }
    void one(RTCRay& ray)
    {
#if NOOK_COMPARE_EMBREE >= 4
        rtcOccluded1(scene_, &ray, &arguments_);
#else
        rtcOccluded1(scene_, &context_, &ray);
#endif
    }
    void packet(const int* valid, RTCRay16& rays)
    {
#if NOOK_COMPARE_EMBREE >= 4
        rtcOccluded16(valid, scene_, &rays, &arguments_);
#else
        rtcOccluded16(valid, scene_, &context_, &rays);
#endif
    }
#if NOOK_COMPARE_EMBREE < 4
    void stream(RTCRay* rays, unsigned count)
    {
        rtcOccluded1M(scene_, &context_, rays, count, sizeof(RTCRay));
    }
#endif

private:
    RTCScene scene_;
#if NOOK_COMPARE_EMBREE >= 4
    RTCOccludedArguments arguments_{};
#else
    RTCIntersectContext context_{};
#endif
};

inline void set_origin(RTCRay& ray, const float* position)
{
    ray.org_x = position[0];
    ray.org_y = position[1];
    ray.org_z = position[2];
    ray.tnear = 0;
    ray.time = 0;
    ray.mask = 0xffffffffu;
    ray.id = 0;
    ray.flags = 0;
}

/// A share of the rays of a point.
[[nodiscard]] inline float share(int open, int directions)
{
    return static_cast<float>(open) / static_cast<float>(directions);
}

inline void embree_single(void* scene, const Points& points, const Sampling& sampling,
                          float* visibility)
{
    Query query{scene};
    Directions directions{sampling};
    const float end = static_cast<float>(sampling.radius);
    for (std::size_t point = 0; point < points.count; ++point) {
        directions.fill(points, point);
        RTCRay ray;
        set_origin(ray, points.positions + 3 * point);
        int open = 0;
        for (int i = 0; i < sampling.directions; ++i) {
            ray.dir_x = directions.x()[i];
            ray.dir_y = directions.y()[i];
            ray.dir_z = directions.z()[i];
            ray.tfar = end;
            query.one(ray);
            open += ray.tfar >= 0;
        }
        visibility[point] = share(open, sampling.directions);
    }
}

inline void embree_packets(void* scene, const Points& points, const Sampling& sampling,
                           float* visibility)
{
    constexpr int lanes = 16;
    Query query{scene};
    Directions directions{sampling};
    const float end = static_cast<float>(sampling.radius);
    RTCRay16 rays;
    for (int lane = 0; lane < lanes; ++lane) {
        rays.tnear[lane] = 0;
        rays.time[lane] = 0;
        rays.mask[lane] = 0xffffffffu;
        rays.id[lane] = static_cast<unsigned>(lane);
        rays.flags[lane] = 0;
    }
    alignas(64) int valid[lanes];
    for (std::size_t point = 0; point < points.count; ++point) {
        directions.fill(points, point);
        const float* const position = points.positions + 3 * point;
        for (int lane = 0; lane < lanes; ++lane) {
            rays.org_x[lane] = position[0];
            rays.org_y[lane] = position[1];
            rays.org_z[lane] = position[2];
        }
        int open = 0;
        for (int first = 0; first < sampling.directions; first += lanes) {
            const int left = sampling.directions - first;
            for (int lane = 0; lane < lanes; ++lane) {
                rays.dir_x[lane] = directions.x()[first + lane];
                rays.dir_y[lane] = directions.y()[first + lane];
                rays.dir_z[lane] = directions.z()[first + lane];
                rays.tfar[lane] = end;
                valid[lane] = lane < left ? -1 : 0;
            }
            query.packet(valid, rays);
            for (int lane = 0; lane < lanes; ++lane)
                open += valid[lane] & (rays.tfar[lane] >= 0 ? 1 : 0);
        }
        visibility[point] = share(open, sampling.directions);
    }
}

#if NOOK_COMPARE_EMBREE < 4
inline void embree_stream(void* scene, const Points& points, const Sampling& sampling,
                          float* visibility)
{
    // Streams of 256 to 4096 rays are equally fast.
    constexpr int most = 1024;
    Query query{scene};
    Directions directions{sampling};
    RTCRay rays[most];
    const float end = static_cast<float>(sampling.radius);
    const int count = sampling.directions;
    const auto batch = static_cast<std::size_t>(most / count);
    for (std::size_t first = 0; first < points.count; first += batch) {
        const std::size_t here = (std::min)(points.count - first, batch);
        RTCRay* ray = rays;
        for (std::size_t point = first; point < first + here; ++point) {
            directions.fill(points, point);
            for (int i = 0; i < count; ++i, ++ray) {
                set_origin(*ray, points.positions + 3 * point);
                ray->dir_x = directions.x()[i];
                ray->dir_y = directions.y()[i];
                ray->dir_z = directions.z()[i];
                ray->tfar = end;
            }
        }
        query.stream(rays, static_cast<unsigned>(ray - rays));
        const RTCRay* traced = rays;
        for (std::size_t point = first; point < first + here; ++point) {
            int open = 0;
            for (int i = 0; i < count; ++i) open += traced++->tfar >= 0;
            visibility[point] = share(open, count);
        }
    }
}
#endif

inline void embree_random(void* scene, const Points& points, const Sampling& sampling,
                          float* visibility)
{
    Query query{scene};
    const float end = static_cast<float>(sampling.radius);
    for (std::size_t point = 0; point < points.count; ++point) {
        const double* const axis = points.axes + 3 * point;
        const nook::detail::HemisphereBasis basis{{axis[0], axis[1], axis[2]}};
        const auto floats = [](const nook::detail::Vector3& v) {
            return std::array{static_cast<float>(v.x), static_cast<float>(v.y),
                              static_cast<float>(v.z)};
        };
        const auto t = floats(basis.tangent()), s = floats(basis.bitangent()),
                   n = floats(basis.normal());
        RTCRay ray;
        set_origin(ray, points.positions + 3 * point);
        // Marsaglia 2003: xorshift.
        std::uint32_t state = nook::hash(sampling.seed, static_cast<std::uint32_t>(point)) | 1;
        const auto random = [&] {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            return static_cast<float>(state >> 8) * 0x1p-24f;
        };
        int open = 0;
        for (int i = 0; i < sampling.directions; ++i) {
            const float angle = 2 * std::numbers::pi_v<float> * random(), v = random();
            const float sine = std::sqrt(v), cosine = std::sqrt(1 - v);
            const float p = sine * std::cos(angle), q = sine * std::sin(angle);
            ray.dir_x = p * t[0] + q * s[0] + cosine * n[0];
            ray.dir_y = p * t[1] + q * s[1] + cosine * n[1];
            ray.dir_z = p * t[2] + q * s[2] + cosine * n[2];
            ray.tfar = end;
            query.one(ray);
            open += ray.tfar >= 0;
        }
        visibility[point] = share(open, sampling.directions);
    }
}

inline bool embree_occluded(void* scene, const float* origin, const float* direction, double radius)
{
    Query query{scene};
    RTCRay ray;
    set_origin(ray, origin);
    ray.dir_x = direction[0];
    ray.dir_y = direction[1];
    ray.dir_z = direction[2];
    ray.tfar = static_cast<float>(radius);
    query.one(ray);
    return ray.tfar < 0;
}

}  // namespace compare::inline NOOK_TARGET

#endif
