#include "subject.hpp"

#include <cmath>

#include <nook/scene/rasteriser.hpp>

#include "../support/checked.hpp"

namespace outlines {

nook::Camera Subject::camera(double angle) const
{
    nook::Camera camera = scene.camera;
    const glm::dvec3 middle = room ? camera.eye : camera.target;
    const auto turned = [&](const glm::dvec3& point) {
        const glm::dvec3 from = point - middle;
        return middle + glm::dvec3{std::cos(angle) * from.x + std::sin(angle) * from.z, from.y,
                                   std::cos(angle) * from.z - std::sin(angle) * from.x};
    };
    camera.eye = turned(camera.eye);
    camera.target = turned(camera.target);
    return camera;
}

Frame::Frame(const scenes::Scene& scene, const nook::Camera& camera, int width, int height,
             nook::ThreadExecutor& threads)
    : projection{nook::projection(camera, width, height)},
      axes{nook::view_frame(camera)},
      depth{width, height},
      normals{width, 3 * height},
      faces{width, height}
{
    const std::ptrdiff_t plane = std::ptrdiff_t{width} * height;
    float* const data = normals.data();
    const nook::Work work = support::checked(nook::rasterise(scene.mesh(), axes, projection,
                                                             {depth.view(),
                                                              {{data, width, height},
                                                               {data + plane, width, height},
                                                               {data + 2 * plane, width, height}},
                                                              faces.view()},
                                                             {}, nook::HeapScratch{}, threads),
                                             "rasterise");
    surfaces = work.pixels - work.background;
}

nook::ImageView3<const float> Frame::normal() const
{
    const std::ptrdiff_t plane = std::ptrdiff_t{width()} * height();
    const float* const data = normals.data();
    return {{data, width(), height()},
            {data + plane, width(), height()},
            {data + 2 * plane, width(), height()}};
}

}  // namespace outlines
