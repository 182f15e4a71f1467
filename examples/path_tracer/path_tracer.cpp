#include "path_tracer.hpp"

#include <atomic>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <glm/geometric.hpp>

#include <nook/scene/camera.hpp>
#include <nook/scene/sampling.hpp>

namespace path_tracer {

namespace {

using support::Rgb;

/// Radiance from a direction: pale at the horizon, blue above, dim from below.
Rgb sky(const glm::dvec3& direction)
{
    const auto up = static_cast<float>(direction.y);
    const Rgb horizon{1.0f, 0.98f, 0.95f}, zenith{0.80f, 0.92f, 1.10f}, below{0.25f, 0.24f, 0.22f};
    return up >= 0 ? horizon * (1 - up) + zenith * up : below;
}

/// Each bounce has a sequence of its own, in an order of its own: sequences that are scrambled alone
/// stay in step, and a path would bounce where its azimuth before sends it. The order is scrambled as
/// a coordinate is, so that blocks of 2^k samples stay whole (Burley 2020).
nook::SamplePoint sample_point(std::uint32_t pixel, int bounce, int sample)
{
    const std::uint32_t seed = nook::hash(pixel, static_cast<std::uint32_t>(bounce) + 1);
    const nook::ScrambledSobol order{~seed}, points{seed};
    const double place = order(nook::reverse_bits(static_cast<std::uint32_t>(sample))).u;
    return points(static_cast<std::uint32_t>(place * 0x1p32));
}

class PathTracer {
public:
    PathTracer(const nook::Bvh& bvh, const scenes::Scene& scene, const Options& options)
        : bvh_{bvh},
          scene_{scene},
          options_{options},
          projection_{nook::projection(scene.camera, options.width, options.height)},
          frame_{nook::view_frame(scene.camera)}
    {}

    /// The mean of all paths through a pixel.
    [[nodiscard]] Rgb pixel(int x, int y, std::uint64_t& rays) const
    {
        const std::uint32_t id =
            nook::hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
        const nook::ScrambledSobol lens{id};
        Rgb sum;
        for (int i = 0; i < options_.samples; ++i) {
            const nook::SamplePoint at = lens(static_cast<std::uint32_t>(i));
            sum = sum + path(camera_ray(x + at.u, y + at.v), id, i, rays);
        }
        return sum * (1 / static_cast<float>(options_.samples));
    }

private:
    [[nodiscard]] nook::Ray camera_ray(double x, double y) const
    {
        const double across = (x - projection_.cx) / projection_.fx;
        const double up = (projection_.cy - y) / projection_.fy;
        nook::Ray ray;
        if (projection_.orthographic) {
            ray.origin = nook::point_to_world(frame_, {across, up, 0});
            ray.direction = -frame_.back;
        } else {
            ray.origin = frame_.origin;
            ray.direction = glm::normalize(nook::direction_to_world(frame_, {across, up, -1}));
        }
        return ray;
    }

    [[nodiscard]] Rgb path(nook::Ray ray, std::uint32_t id, int sample, std::uint64_t& rays) const
    {
        Rgb throughput{1, 1, 1};
        for (int bounce = 0;; ++bounce) {
            const nook::Hit hit = bvh_.closest(ray);
            ++rays;
            if (!hit) return throughput * sky(ray.direction);
            if (bounce == options_.bounces) return {};
            throughput = throughput * albedo(hit.face);

            // Up from the side that the ray came from, by more than the point can be off.
            glm::dvec3 normal = normal_of(hit.face);
            if (glm::dot(normal, ray.direction) > 0) normal = -normal;
            const glm::dvec3 point = ray.origin + ray.direction * hit.t;
            const double lift = 0x1p-40 * (bvh_.size() + glm::length(point) + hit.t);
            const nook::SamplePoint at = sample_point(id, bounce, sample);
            const double angle = 2 * std::numbers::pi * at.u;
            const double sine = std::sqrt(at.v), cosine = std::sqrt(1 - at.v);
            const glm::dvec3 side =
                std::fabs(normal.x) < 0.6 ? glm::dvec3{1, 0, 0} : glm::dvec3{0, 1, 0};
            const glm::dvec3 tangent = glm::normalize(glm::cross(normal, side));
            ray.origin = point + normal * lift;
            ray.direction = tangent * (sine * std::cos(angle)) +
                            glm::cross(normal, tangent) * (sine * std::sin(angle)) +
                            normal * cosine;
            ray.exclude = hit.face;
        }
    }

    [[nodiscard]] Rgb albedo(std::uint32_t face) const
    {
        if (options_.colours && !scene_.albedo.empty()) return scene_.albedo[face];
        return Rgb{1, 1, 1} * options_.albedo;
    }
    [[nodiscard]] glm::dvec3 normal_of(std::uint32_t face) const
    {
        glm::dvec3 corner[3];
        for (std::size_t i = 0; i < 3; ++i) {
            const float* at = scene_.positions.data() +
                              3 * std::size_t{scene_.indices[3 * std::size_t{face} + i]};
            corner[i] = {at[0], at[1], at[2]};
        }
        return glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
    }

    const nook::Bvh& bvh_;
    const scenes::Scene& scene_;
    Options options_;
    nook::Projection projection_;
    nook::ViewFrame frame_;
};

}  // namespace

Light trace(const nook::Bvh& bvh, const scenes::Scene& scene, const Options& options,
            nook::ThreadExecutor& threads)
{
    const auto width = static_cast<std::size_t>(options.width);
    Light light;
    light.pixels.resize(width * static_cast<std::size_t>(options.height));
    const PathTracer tracer{bvh, scene, options};
    std::atomic<std::uint64_t> rays{0};
    threads.for_each(options.height, [&](int y, int) {
        std::uint64_t row_rays = 0;
        for (int x = 0; x < options.width; ++x)
            light.pixels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
                tracer.pixel(x, y, row_rays);
        rays += row_rays;
    });
    light.rays = rays;
    return light;
}

}  // namespace path_tracer
