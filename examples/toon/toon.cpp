#include "toon.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/information_ao.hpp>
#include <nook/scene/outline.hpp>
#include <nook/scene/polygon_values.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/vertex_values.hpp>
#include <nook/scene/viewpoints.hpp>
#include <nook/surface/alchemy_ao.hpp>

#include "../support/checked.hpp"

namespace toon {

namespace {

using support::checked;
using support::Rgb;

/// The scene as its camera sees it.
struct View {
    nook::Projection projection;
    nook::ViewFrame frame;
    nook::Image<float> depth, normals;
    nook::Image<std::uint32_t> face;

    View(const scenes::Scene& scene, int width, int height, nook::ThreadExecutor& threads)
        : projection{nook::projection(scene.camera, width, height)},
          frame{nook::view_frame(scene.camera)},
          depth{width, height},
          normals{3 * width, height},
          face{width, height}
    {
        const auto normal = nook::ImageView3<float>::interleaved(normals.data(), width, height,
                                                                 std::ptrdiff_t{3} * width);
        checked(
            nook::rasterise(scene.mesh(), frame, projection, {depth.view(), normal, face.view()},
                            {}, nook::HeapScratch{}, threads),
            "rasterise");
    }
    [[nodiscard]] bool surface(int x, int y) const { return face(x, y) != nook::no_face; }
};

/// Visibility of each vertex, from viewpoints around the scene.
std::vector<float> seen_from_around(const nook::MeshView& mesh, const Options& options,
                                    nook::ThreadExecutor& threads)
{
    std::vector<glm::dvec3> directions(nook::icosphere_size(options.level));
    nook::icosphere(options.level, directions.data());
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh);
    std::vector<nook::Camera> views;
    for (const glm::dvec3& direction : directions)
        views.push_back(nook::viewpoint_camera(sphere, direction));

    std::vector<float> polygons(mesh.triangle_count), vertices(mesh.vertex_count);
    std::vector<nook::PolygonState> states(mesh.triangle_count);
    nook::InformationMaps maps{.state = states.data()};
    (options.shade == Shade::information ? maps.information_visibility : maps.visibility) =
        polygons.data();
    // Bands do not show what finer pictures would tell.
    checked(nook::information_ao(mesh, views.data(), views.size(), maps, {.max_resolution = 512},
                                 nullptr, nook::HeapScratch{}, threads),
            "information_ao");
    checked(nook::polygon_to_vertex_values(mesh, polygons.data(), states.data(), vertices.data()),
            "polygon_to_vertex_values");
    return vertices;
}

nook::Image<float> visibility_of(const scenes::Scene& scene, const View& view,
                                 const Options& options, nook::ThreadExecutor& threads)
{
    nook::Image<float> visibility{view.depth.width(), view.depth.height()};
    if (options.shade == Shade::alchemy) {
        const nook::ImageView<const float> depth = view.depth.view();
        const auto normals = nook::ImageView3<const float>::interleaved(
            view.normals.data(), depth.width, depth.height, std::ptrdiff_t{3} * depth.width);
        nook::AlchemyOptions alchemy{};
        alchemy.radius = scene.radius;
        alchemy.samples = 48;
        checked(nook::alchemy_ao(depth, normals, visibility.view(), alchemy, view.projection, {},
                                 nook::HeapScratch{}, threads),
                "alchemy_ao");
    } else {
        const std::vector<float> vertices = seen_from_around(scene.mesh(), options, threads);
        checked(
            nook::vertex_values(scene.mesh(), view.face.view(), vertices.data(), visibility.view(),
                                {}, view.projection, view.frame, {}, nook::HeapScratch{}, threads),
            "vertex_values");
    }
    return visibility;
}

/// The value that this share of the values lies below.
double quantile(std::vector<float>& values, double share)
{
    const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + place, values.end());
    return double{values[static_cast<std::size_t>(place)]};
}

/// Distances of the far sides of the scene's outline shells. They show beside whatever they enclose,
/// as a line around it, and nowhere else: its own surface lies in front of them.
nook::Image<float> far_sides(const scenes::Scene& scene, const View& view, double extent,
                             nook::ThreadExecutor& threads)
{
    nook::OutlineShell shell;
    checked(shell.build(scene.mesh()), "OutlineShell::build");
    const nook::OutlineView outline = shell.view();
    std::vector<float> positions(3 * outline.vertex_count);
    checked(shell.extrude(extent, positions.data()), "OutlineShell::extrude");
    // Wound the other way, it is the sides towards the viewer that are seen from behind.
    std::vector<std::uint32_t> indices(outline.indices,
                                       outline.indices + 3 * outline.triangle_count);
    for (std::size_t i = 0; i < indices.size(); i += 3) std::swap(indices[i], indices[i + 1]);
    const nook::MeshView turned{positions.data(), outline.vertex_count, indices.data(),
                                outline.triangle_count};
    nook::Image<float> depth{view.depth.width(), view.depth.height()};
    checked(nook::rasterise(turned, view.frame, view.projection, {depth.view()},
                            {.leave_out_back_faces = true}, nook::HeapScratch{}, threads),
            "rasterise");
    return depth;
}

/// A width in pixels as a world length at the median distance of what is drawn.
double world_width(const View& view, double pixels)
{
    std::vector<float> distances;
    for (int y = 0; y < view.depth.height(); ++y)
        for (int x = 0; x < view.depth.width(); ++x)
            if (view.surface(x, y)) distances.push_back(view.depth(x, y));
    if (distances.empty()) return 0;
    const double distance = view.projection.orthographic ? 1 : quantile(distances, 0.5);
    return pixels * distance / view.projection.fy;
}

}  // namespace

support::Picture draw(const scenes::Scene& scene, int width, int height, const Options& options,
                      nook::ThreadExecutor& threads)
{
    // Twice as large, and then halved: smooth lines.
    constexpr int scale = 2;
    const int across = scale * width, down = scale * height;
    const View view{scene, across, down, threads};
    nook::Image<float> visibility = visibility_of(scene, view, options, threads);

    // The bands share out what there is between very dark and very light.
    std::vector<float> values;
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x)
            if (view.surface(x, y)) values.push_back(visibility(x, y));
    const double low = values.empty() ? 0 : quantile(values, 0.02);
    const double high = values.empty() ? 1 : quantile(values, 0.98);
    const auto tone = [&](float value) {
        if (!(high - low > 1e-3) || options.bands < 2) return 1.0;
        const double share = std::clamp((double{value} - low) / (high - low), 0.0, 1.0);
        const double band = (std::min)(std::floor(share * options.bands), options.bands - 1.0);
        return options.darkest + (1 - options.darkest) * band / (options.bands - 1);
    };

    nook::Image<float> far_side;
    const double extent = world_width(view, options.line * scale);
    if (extent > 0) far_side = far_sides(scene, view, extent, threads);
    constexpr Rgb paper{0.96f, 0.95f, 0.91f}, ink{0.09f, 0.08f, 0.10f};
    support::Picture picture{across, down, paper};
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x) {
            if (extent > 0 && far_side(x, y) < view.depth(x, y)) {
                picture.set(x, y, ink);
            } else if (view.surface(x, y)) {
                const Rgb colour =
                    scene.albedo.empty() ? Rgb{0.72f, 0.72f, 0.72f} : scene.albedo[view.face(x, y)];
                picture.set(x, y,
                            support::srgb(colour) * static_cast<float>(tone(visibility(x, y))));
            }
        }
    return support::halved(picture);
}

}  // namespace toon
