#include "views.hpp"

#include <cstdint>
#include <limits>

#include <nook/depth/source.hpp>
#include <nook/scene/rasteriser.hpp>

#include "compare/failure.hpp"
#include "scenes/scenes.hpp"

namespace compare {

View::View(const std::string& name, const Options& options)
    : View{name, options.width(), options.height()}
{}

View::View(const std::string& name, int width, int height)
    : scene{scenes::load(name, double(width) / height)},
      depth{width, height},
      normals{width, 3 * height},
      projection{nook::projection(scene.camera, width, height)},
      frame{nook::view_frame(scene.camera)},
      diagonal{scenes::bounds(scene).diagonal()}
{
    const auto plane = [&](int i) {
        return nook::ImageView<float>{&normals(0, i * height), width, height, width, 1};
    };
    (void)checked(nook::rasterise(scene.mesh(), frame, projection,
                                  {depth.view(), {plane(0), plane(1), plane(2)}, {}}),
                  "rasterise");
}

Normals View::normal() const
{
    const auto plane = [&](int i) {
        return Depth{&normals(0, i * height()), width(), height(), width(), 1};
    };
    return {plane(0), plane(1), plane(2)};
}

bool View::is_surface(int x, int y) const
{
    return nook::is_surface(depth(x, y), (std::numeric_limits<float>::max)());
}

std::size_t View::surfaces() const
{
    std::size_t count = 0;
    for (int y = 0; y < height(); ++y)
        for (int x = 0; x < width(); ++x) count += is_surface(x, y);
    return count;
}

void View::roughen()
{
    // Where the radius covers 20 pixels.
    const auto wall = static_cast<float>(scene.radius * projection.fx / 20);
    for (int y = 0; y < height(); ++y)
        for (int x = 0; x < width(); ++x) {
            std::uint32_t bits = static_cast<std::uint32_t>(x) * 0x9e3779b1u +
                                 static_cast<std::uint32_t>(y) * 0x85ebca77u;
            bits = (bits ^ bits >> 16) * 0x85ebca6bu;
            if (!is_surface(x, y)) {
                depth(x, y) = wall;
                normals(x, y) = normals(x, y + height()) = 0;
                normals(x, y + 2 * height()) = 1;
            }
            depth(x, y) *= 1 + 0.01f * static_cast<float>(bits >> 8) * 0x1p-24f;
        }
}

Job View::job() const
{
    return {.depth = depth.view(), .normals = normal(), .projection = projection, .frame = frame};
}

}  // namespace compare
