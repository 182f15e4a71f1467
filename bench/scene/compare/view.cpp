#include "view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <glm/geometric.hpp>

#include <nook/depth/projection.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/vector.hpp>

#include "compare/failure.hpp"
#include "compare/table.hpp"
#include "scenes/scenes.hpp"
#include "support/obj_file.hpp"

namespace compare {

namespace {

constexpr int width = 960, height = 540;
constexpr int tile_side = 8;
constexpr double lift = 1e-4;  // of the diagonal

/// Every tile that may stay, so that about `wanted` points do.
PointList points_of(const Picture& picture, double diagonal, std::size_t wanted)
{
    std::size_t surface = 0;
    for (const std::uint32_t face : picture.face) surface += face != nook::no_face;
    const std::size_t step = (std::max)(surface / wanted, std::size_t{1});

    PointList list;
    const auto add = [&](int x, int y) {
        const nook::ViewPoint at =
            nook::view_point(picture.projection, x + 0.5, y + 0.5, double{picture.depth(x, y)});
        const nook::ImageView3<const float> normals = picture.normal();
        const glm::dvec3 normal = glm::normalize(nook::direction_to_world(
            picture.frame, {normals.x(x, y), normals.y(x, y), normals.z(x, y)}));
        const glm::dvec3 point =
            nook::point_to_world(picture.frame, {at.x, at.y, at.z}) + normal * (lift * diagonal);
        for (int k = 0; k < 3; ++k) {
            list.positions.push_back(static_cast<float>(point[k]));
            list.normals.push_back(static_cast<float>(normal[k]));
        }
        const float* const n = list.normals.data() + list.normals.size() - 3;
        const nook::detail::Vector3 axis =
            normalised(nook::detail::Vector3{double{n[0]}, double{n[1]}, double{n[2]}});
        list.axes.insert(list.axes.end(), {axis.x, axis.y, axis.z});
    };
    std::size_t tile = 0;
    for (int top = 0; top < height; top += tile_side)
        for (int left = 0; left < width; left += tile_side) {
            bool any = false;
            const auto pixels = [&](const auto& visit) {
                for (int y = top; y < (std::min)(top + tile_side, height); ++y)
                    for (int x = left; x < (std::min)(left + tile_side, width); ++x)
                        if (picture.face(x, y) != nook::no_face) visit(x, y);
            };
            pixels([&](int, int) { any = true; });
            if (any && tile++ % step == 0) pixels(add);
        }
    return list;
}

/// A built-in scene, or a mesh from the front, the right and above.
scenes::Scene scene_of(const std::string& name)
{
    for (const scenes::Entry& entry : scenes::all())
        if (name == entry.name) return entry.make();
    support::ObjMesh mesh = support::read_obj(name);
    scenes::Scene scene;
    scene.name = std::filesystem::path{name}.stem().string();
    scene.positions = std::move(mesh.positions);
    scene.indices = std::move(mesh.indices);
    scene.camera = scenes::three_quarter_view(scene, static_cast<double>(width) / height);
    return scene;
}

View view_of(scenes::Scene scene, std::string seen_from, const Options& options)
{
    View view;
    view.scene = std::move(scene);
    view.seen_from = std::move(seen_from);
    view.diagonal = scenes::bounds(view.scene).diagonal();
    const Picture picture = draw(view.scene, width, height);
    view.points = points_of(picture, view.diagonal, options.quick ? 500 : 20000);
    view.few = points_of(picture, view.diagonal, options.quick ? 200 : 3000);
    if (view.points.count() == 0)
        throw Failure{view.scene.name + ": the camera sees nothing of it"};
    return view;
}

}  // namespace

Picture draw(const scenes::Scene& scene, int columns, int rows)
{
    Picture picture;
    picture.projection = nook::projection(scene.camera, columns, rows);
    picture.frame = nook::view_frame(scene.camera);
    picture.depth = {columns, rows};
    picture.normals = {3 * columns, rows};
    picture.face = {columns, rows};
    checked(
        nook::rasterise(scene.mesh(), picture.frame, picture.projection,
                        {picture.depth.view(),
                         nook::ImageView3<float>::interleaved(picture.normals.data(), columns, rows,
                                                              std::ptrdiff_t{3} * columns),
                         picture.face.view()}),
        "rasterise");
    return picture;
}

Sampling View::sampling(const Reach& reach, int directions) const
{
    const double radius = reach.share * diagonal;
    return {reach.share > 1 ? std::numeric_limits<double>::infinity()
                            : double{static_cast<float>(radius)},
            directions, 0};
}

void View::print() const
{
    std::printf("%s: %zu triangles, %zu points, seen %s\n", scene.name.c_str(), scene.triangles(),
                points.count(), seen_from.c_str());
}

std::vector<View> views(const Options& options)
{
    std::vector<Subject> subjects = options.subjects;
    if (subjects.empty()) subjects = {{"boxes", {}}, {"arcade", {}}};
    std::vector<View> result;
    for (const Subject& subject : subjects) {
        scenes::Scene scene = scene_of(subject.name);
        std::string seen_from = "as its own camera does";
        if (subject.camera) {
            const glm::dvec3 eye = subject.camera->eye, target = subject.camera->target;
            seen_from = "from (" + digits("%g", eye.x) + ", " + digits("%g", eye.y) + ", " +
                        digits("%g", eye.z) + ") towards (" + digits("%g", target.x) + ", " +
                        digits("%g", target.y) + ", " + digits("%g", target.z) + ")";
            scene.camera = *subject.camera;
        }
        result.push_back(view_of(std::move(scene), seen_from, options));
    }
    return result;
}

}  // namespace compare
