#include "calibration_views.hpp"

#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <nook/scene/bvh.hpp>
#include <nook/scene/traced_ao.hpp>

#include "../scenes/scenes.hpp"
#include "../support/checked.hpp"
#include "../support/failure.hpp"

namespace report {

namespace {

/// A scene, and how its camera moves around its target for a second look; radians.
struct Plan {
    scenes::Scene (*make)();
    bool train;
    double turn, rise;  ///< about the vertical, and above the horizon; train scenes alone
    double zoom = 1;    ///< so that the radius spans more than a few pixels
};

constexpr Plan plans[] = {
    {[] { return scenes::bowl(); }, true, 0.5, -0.45},
    {[] { return scenes::stairs(); }, true, 0.35, 0.15},
    {[] { return scenes::chains(); }, true, -0.7, 0.1},
    {[] { return scenes::arcade(); }, true, 0.45, 0},
    {[] { return scenes::city(); }, true, 0.6, 0.1, 4},
    {[] { return scenes::boxes(); }, false, 0, 0},
    {[] { return scenes::terrain(); }, false, 0, 0},
    {[] { return scenes::temple(); }, false, 0, 0, 3},
    {[] { return scenes::corridor(); }, false, 0, 0},
    {[] { return scenes::tree(); }, false, 0, 0},
};

/// The camera from elsewhere on the sphere about its target.
nook::Camera moved(nook::Camera camera, double turn, double rise)
{
    const glm::dvec3 out = camera.eye - camera.target;
    const double length = glm::length(out);
    const double azimuth = std::atan2(out.x, out.z) + turn;
    const double elevation = std::asin(out.y / length) + rise;
    camera.eye = camera.target + length * glm::dvec3{std::cos(elevation) * std::sin(azimuth),
                                                     std::sin(elevation),
                                                     std::cos(elevation) * std::cos(azimuth)};
    return camera;
}

CalibrationView look(const scenes::Scene& scene, const nook::Bvh& hierarchy, std::string name,
                     const CalibrationViews& size, nook::ThreadExecutor& threads)
{
    Options options;
    options.width = size.width;
    options.height = size.height;
    CalibrationView result;
    result.name = std::move(name);
    result.radius = scene.radius;
    result.view = draw(scene, options, threads);
    result.visibility = {size.width, size.height};
    nook::TracedOptions<> rays;
    rays.radius = scene.radius;
    rays.directions = size.directions;
    support::checked(nook::traced_ao(hierarchy, result.view.depth.view(), result.view.normal(),
                                     result.visibility.view(), rays, result.view.projection,
                                     result.view.frame, {}, nook::HeapScratch{}, threads),
                     "traced_ao");
    return result;
}

}  // namespace

CalibrationViews calibration_views(bool quick, nook::ThreadExecutor& threads,
                                   support::Progress& progress)
{
    CalibrationViews views;
    views.width = quick ? 160 : 320;
    views.height = quick ? 90 : 180;
    views.directions = quick ? 64 : 256;
    progress.step("calibration: drawing and tracing the views");
    double done = 0;
    for (const Plan& plan : plans) {
        scenes::Scene scene = plan.make();
        double& fov = scene.camera.vertical_fov;
        fov = 2 * std::atan(std::tan(fov / 2) / plan.zoom);
        nook::Bvh hierarchy;
        support::checked(hierarchy.build(scene.mesh(), {}, threads), "Bvh::build");
        (plan.train ? views.train : views.held_out)
            .push_back(look(scene, hierarchy, scene.name, views, threads));
        if (plan.train) {
            scene.camera = moved(scene.camera, plan.turn, plan.rise);
            views.held_out.push_back(
                look(scene, hierarchy, scene.name + ", camera moved", views, threads));
        }
        progress.share(++done / double(std::size(plans)));
    }
    return views;
}

}  // namespace report
