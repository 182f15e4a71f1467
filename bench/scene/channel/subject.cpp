#include "subject.hpp"

#include <glm/vec3.hpp>

#include <nook/scene/viewpoints.hpp>

#include "scenes/scenes.hpp"

namespace compare {

namespace {

meshes::Mesh mesh_of(const Options& options)
{
    if (options.subject.empty())
        return meshes::bumpy_sphere(static_cast<std::size_t>(options.triangles));
    scenes::Scene scene = scenes::load(options.subject, 1);
    meshes::Mesh mesh;
    mesh.name = scene.name;
    mesh.positions = std::move(scene.positions);
    mesh.indices = std::move(scene.indices);
    return mesh;
}

}  // namespace

Subject::Subject(const Options& options) : mesh{mesh_of(options)}, executor{options.threads}
{
    look_from(options.level);
}

Job Subject::job()
{
    Job job;
    job.mesh = mesh.view();
    job.views = views.data();
    job.view_count = views.size();
    job.threads = lend(executor);
    return job;
}

std::string Subject::name() const
{
    return mesh.name + ", " + std::to_string(mesh.triangles()) + " triangles, " +
           std::to_string(views.size()) + " views";
}

void Subject::look_from(int level)
{
    std::vector<glm::dvec3> directions(nook::icosphere_size(level));
    nook::icosphere(level, directions.data());
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh.view());
    views.clear();
    for (const glm::dvec3& direction : directions)
        views.push_back(nook::viewpoint_camera(sphere, direction));
}

}  // namespace compare
