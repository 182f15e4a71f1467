#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/builder.hpp"
#include "../support/checked.hpp"
#include "curtain.hpp"

namespace curtain {

namespace {

constexpr std::uint32_t seed = 11;

scenes::Scene box(const nook::FlatLandCurtain& curtain)
{
    // No ray of a position on the middle line gets farther than the radius along the box.
    const double half_length = 1.25 * curtain.radius;
    const double middle = curtain.bottom + curtain.height / 2;
    scenes::Builder builder;
    builder.box({0, middle, 0}, {curtain.width / 2, curtain.height / 2, half_length}, {1, 1, 1});
    scenes::Scene scene;
    builder.finish(scene);
    return scene;
}

/// Every position as many times as there are sets, with the normal up.
class Ground {
public:
    Ground(const std::vector<double>& positions, int sets)
    {
        for (const double x : positions)
            for (int i = 0; i < sets; ++i)
                points_.insert(points_.end(), {static_cast<float>(x), 0, 0});
        for (std::size_t i = 0; i < points_.size() / 3; ++i)
            normals_.insert(normals_.end(), {0, 1, 0});
    }
    [[nodiscard]] nook::ShadingPoints points() const
    {
        return {points_.data(), normals_.data(), points_.size() / 3};
    }

private:
    std::vector<float> points_, normals_;
};

class Tracer {
public:
    explicit Tracer(const Options& options)
        : options_{options},
          scene_{box(options.curtain)},
          threads_{options.threads}
    {
        support::checked(bvh_.build(scene_.mesh()), "building the hierarchy");
    }
    /// All directions in one set per position without secondary rays, or in sets of so many.
    template <class Traced>
    Curve trace(Curve curve, const std::vector<double>& positions, const Traced& traced)
    {
        const int sets = options_.directions / traced.directions;
        const Ground ground{positions, sets};
        nook::Image<double> open{static_cast<int>(ground.points().count), 1};
        const nook::Work work =
            support::checked(nook::traced_ao(bvh_, ground.points(), open.view(), traced,
                                             nook::HeapScratch{}, threads_),
                             "tracing");
        double variance = 0;
        for (std::size_t i = 0; i < positions.size(); ++i) {
            double sum = 0, squares = 0;
            for (int k = 0; k < sets; ++k) {
                const double value = open(static_cast<int>(i) * sets + k, 0);
                sum += value;
                squares += value * value;
            }
            const double mean = sum / sets;
            curve.values.push_back(mean);
            variance += std::max(0.0, squares / sets - mean * mean);
        }
        curve.spread = std::sqrt(variance / static_cast<double>(positions.size()));
        curve.directions = traced.directions;
        curve.rays = work.rays;
        curve.skipped_rays = work.skipped_rays;
        return curve;
    }
    Curve plain(Curve curve, const std::vector<double>& positions)
    {
        return trace(std::move(curve), positions,
                     nook::TracedOptions<>{.radius = options_.curtain.radius,
                                           .directions = options_.directions,
                                           .seed = seed});
    }
    Curve secondary(Curve curve, const std::vector<double>& positions, int directions)
    {
        return trace(std::move(curve), positions,
                     nook::TracedOptions<nook::StepFalloff, nook::SecondaryRays>{
                         .radius = options_.curtain.radius,
                         .directions = directions,
                         .seed = seed,
                         .secondary = {.radius = curve.secondary_radius}});
    }

private:
    const Options& options_;
    scenes::Scene scene_;
    nook::ThreadExecutor threads_;
    nook::Bvh bvh_;
};

std::vector<double> positions_of(const nook::FlatLandCurtain& curtain)
{
    const double outside = curtain.width / 2 + curtain.radius;
    const double step = std::max(curtain.radius / 100, outside / 125);
    std::vector<double> positions;
    // Floats hold them: the rays start where the formulas look.
    for (int i = 0; i * step <= 1.1 * outside; ++i)
        positions.push_back(double{static_cast<float>(i * step)});
    return positions;
}

}  // namespace

double largest_fall(const Curve& curve)
{
    double highest = 0, fall = 0;
    for (const double value : curve.values) {
        highest = std::max(highest, value);
        fall = std::max(fall, highest - value);
    }
    return fall;
}

Profile run(const Options& options)
{
    Profile profile{options, positions_of(options.curtain), {}, {}};
    const nook::FlatLandCurtain& curtain = options.curtain;
    const std::vector<double>& positions = profile.positions;
    const double radius = curtain.radius;

    const auto computed = [&](Curve curve, const auto& formula) {
        for (const double at : positions) curve.values.push_back(formula(at));
        return curve;
    };
    profile.space.push_back(computed({"exact", "closed form, no secondary rays"}, [&](double at) {
        return nook::curtain_openness(curtain, at);
    }));
    Tracer tracer{options};
    profile.space.push_back(tracer.plain({"traced", "traced, no secondary rays"}, positions));
    profile.space.push_back(tracer.secondary({"R/4", "secondary rays, R' = R/4", radius / 4},
                                             positions, options.directions));
    profile.space.push_back(tracer.secondary({"R/2", "secondary rays, R' = R/2", radius / 2},
                                             positions, options.directions));
    for (const int directions : {4, 16, 64}) {
        const double shrunk = nook::shrunk_secondary_radius(radius, directions);
        const std::string count = std::to_string(directions);
        profile.space.push_back(tracer.secondary(
            {"N=" + count, "means of " + count + " directions, R' by the rule", shrunk}, positions,
            directions));
    }

    const auto angle = [&](double reach, double kept) {
        return [&curtain, reach, kept](double at) {
            return nook::flat_land_visible_angle(curtain, at, reach, kept);
        };
    };
    profile.flat_land.push_back(computed({"V", "visible angle"}, angle(0, 1)));
    profile.flat_land.push_back(
        computed({"R/4", "secondary rays, R' = R/4", radius / 4}, angle(radius / 4, 0.5)));
    profile.flat_land.push_back(
        computed({"R/2", "secondary rays, R' = R/2", radius / 2}, angle(radius / 2, 0.5)));
    profile.flat_land.push_back(computed(
        {"R/2 in plane", "R' = R/2, in the plane only", radius / 2}, angle(radius / 2, 0)));
    return profile;
}

}  // namespace curtain
