#include "pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <nook/scene/rasteriser.hpp>
#include <nook/scene/vertex_values.hpp>

#include "../support/checked.hpp"

namespace information {

namespace {

using support::Picture;
using support::Rgb;

/// Neither white nor grey, so that what is open shows where it ends.
constexpr Rgb background{0.72f, 0.79f, 0.87f};

/// Where the corners of a triangle lie in the picture, in pixels.
class ProjectedTriangle {
public:
    ProjectedTriangle(const scenes::Scene& scene, std::uint32_t face, const nook::ViewFrame& frame,
                      const nook::Projection& projection)
    {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t at = 3 * std::size_t{scene.indices[3 * std::size_t{face} + k]};
            const glm::dvec3 view = nook::point_to_view(
                frame, {double{scene.positions[at]}, double{scene.positions[at + 1]},
                        double{scene.positions[at + 2]}});
            const double scale = projection.orthographic ? 1 : -1 / view.z;
            corner_[k] = {projection.cx + projection.fx * view.x * scale,
                          projection.cy - projection.fy * view.y * scale};
            visible_ = visible_ && scale > 0;
        }
    }
    /// Pixels from a point to the nearest edge; none is near where a corner lies behind the viewer.
    [[nodiscard]] double edge_distance(const glm::dvec2& point) const
    {
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; visible_ && k < 3; ++k) {
            const glm::dvec2 from = corner_[k], along = corner_[(k + 1) % 3] - from;
            const double square = glm::dot(along, along);
            const double share =
                square > 0 ? std::clamp(glm::dot(point - from, along) / square, 0.0, 1.0) : 0;
            nearest = std::min(nearest, glm::length(point - from - along * share));
        }
        return nearest;
    }
    /// The lowest of its heights, in pixels.
    [[nodiscard]] double height() const
    {
        double longest = 0;
        for (std::size_t k = 0; k < 3; ++k)
            longest = std::max(longest, glm::length(corner_[(k + 1) % 3] - corner_[k]));
        const glm::dvec2 one = corner_[1] - corner_[0], other = corner_[2] - corner_[0];
        return longest > 0 ? std::fabs(one.x * other.y - one.y * other.x) / longest : 0;
    }

private:
    std::array<glm::dvec2, 3> corner_{};
    bool visible_ = true;
};

}  // namespace

Painter::Painter(const scenes::Scene& scene, int width, int height, nook::ThreadExecutor& threads)
    : scene_{scene},
      threads_{threads},
      projection_{nook::projection(scene.camera, 2 * width, 2 * height)},
      frame_{nook::view_frame(scene.camera)},
      faces_{2 * width, 2 * height}
{
    nook::Image<float> depth{faces_.width(), faces_.height()};
    support::checked(
        nook::rasterise(scene.mesh(), frame_, projection_, {depth.view(), {}, faces_.view()}, {},
                        nook::HeapScratch{}, threads),
        "rasterise");
}

template <class PixelColour>
Picture Painter::picture_of(const PixelColour& colour) const
{
    Picture picture{faces_.width(), faces_.height(), background};
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            if (const std::uint32_t face = faces_(x, y); face != nook::no_face)
                picture.set(x, y, colour(x, y, std::size_t{face}));
    return support::halved(picture);
}

nook::Image<float> Painter::interpolated(const std::vector<float>& per_vertex) const
{
    nook::Image<float> values{faces_.width(), faces_.height()};
    support::checked(
        nook::vertex_values(scene_.mesh(), faces_.view(), per_vertex.data(), values.view(), {},
                            projection_, frame_, {}, nook::HeapScratch{}, threads_),
        "vertex_values");
    return values;
}

Picture Painter::wireframe() const
{
    constexpr Rgb paper{0.94f, 0.94f, 0.94f}, ink{0.1f, 0.12f, 0.16f};
    return picture_of([&](int x, int y, std::size_t face) {
        const ProjectedTriangle triangle{scene_, static_cast<std::uint32_t>(face), frame_,
                                         projection_};
        // Lines fade where they would cover all of a triangle.
        const double strength = std::clamp(triangle.height() / 8, 0.2, 1.0);
        const double cover = std::clamp(1.5 - triangle.edge_distance({x + 0.5, y + 0.5}), 0.0, 1.0);
        const auto share = static_cast<float>(strength * cover);
        return paper * (1 - share) + ink * share;
    });
}

Picture Painter::flat(const std::vector<float>& per_polygon) const
{
    return picture_of([&](int, int, std::size_t face) { return Rgb{1, 1, 1} * per_polygon[face]; });
}

Picture Painter::smooth(const std::vector<float>& per_vertex) const
{
    const nook::Image<float> values = interpolated(per_vertex);
    return picture_of([&](int x, int y, std::size_t) { return Rgb{1, 1, 1} * values(x, y); });
}

Picture Painter::coloured(const std::vector<float>& per_vertex) const
{
    const nook::Image<float> values = per_vertex.empty()
                                          ? nook::Image<float>{faces_.width(), faces_.height(), 1}
                                          : interpolated(per_vertex);
    return picture_of([&](int x, int y, std::size_t face) {
        const Rgb own = scene_.albedo.empty() ? Rgb{0.7f, 0.7f, 0.7f} : scene_.albedo[face];
        return support::srgb(own * values(x, y));
    });
}

Picture Painter::lit(const std::vector<float>& red, const std::vector<float>& green,
                     const std::vector<float>& blue) const
{
    const nook::Image<float> r = interpolated(red), g = interpolated(green), b = interpolated(blue);
    return picture_of([&](int x, int y, std::size_t) { return Rgb{r(x, y), g(x, y), b(x, y)}; });
}

}  // namespace information
