#include "view.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/scene/rasteriser.hpp>

#include "../support/checked.hpp"

namespace report {

namespace {

nook::Camera chosen_camera(const scenes::Scene& scene, const Options& options)
{
    nook::Camera camera = options.camera.value_or(scene.camera);
    if (!options.orthographic || camera.orthographic) return camera;
    camera.orthographic = true;
    const double distance = glm::length(camera.target - camera.eye);
    camera.view_height = 2 * distance * std::tan(camera.vertical_fov / 2);
    // What was beside a viewer under perspective is in the picture now: step back.
    if (!options.camera) {
        const double back = (std::max)(distance, scenes::bounds(scene).diagonal());
        camera.eye = camera.target + (camera.eye - camera.target) * (back / distance);
    }
    return camera;
}

}  // namespace

nook::Camera checked_camera(const scenes::Scene& scene, const Options& options)
{
    const nook::Camera camera = chosen_camera(scene, options);
    nook::Error error = nook::check_camera(camera);
    // Sound numbers may still overflow in pixels: the rasteriser knows, and has nothing to draw here.
    if (!error)
        error = nook::rasterise({}, nook::view_frame(camera),
                                nook::projection(camera, options.width, options.height),
                                nook::GBuffer{})
                    .error;
    if (error) throw support::Failure{scene.name + ": " + support::text_of(error)};
    return camera;
}

View draw(const scenes::Scene& scene, const Options& options, nook::ThreadExecutor& threads)
{
    const int width = options.width, height = options.height;
    View view;
    view.camera = scene.camera;
    view.projection = nook::projection(view.camera, width, height);
    view.frame = nook::view_frame(view.camera);
    view.depth = {width, height};
    view.normals = {3 * width, height};
    view.face = {width, height};
    view.surface = {width, height};
    support::checked(
        nook::rasterise(scene.mesh(), view.frame, view.projection,
                        {view.depth.view(),
                         nook::ImageView3<float>::interleaved(view.normals.data(), width, height,
                                                              std::ptrdiff_t{3} * width),
                         view.face.view()},
                        {}, nook::HeapScratch{}, threads),
        "rasterise");

    std::vector<float> distances;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            view.surface(x, y) = view.face(x, y) != nook::no_face ? 1 : 0;
            if (view.surface(x, y) != 0) distances.push_back(view.depth(x, y));
        }
    view.background =
        static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) - distances.size();
    if (!distances.empty()) {
        const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
        std::nth_element(distances.begin(), middle, distances.end());
        view.median = double{*middle};
        view.nearest = double{*std::min_element(distances.begin(), distances.end())};
        view.farthest = double{*std::max_element(distances.begin(), distances.end())};
    }
    return view;
}

int default_window(const View& view, double radius)
{
    const double pixels = nook::pixels_per_length(view.projection, radius, view.median).y;
    return 2 * static_cast<int>(std::lround(std::clamp(pixels, 1.0, double(largest_window / 2)))) +
           1;
}

}  // namespace report
