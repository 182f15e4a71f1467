#include "views.hpp"

#include <algorithm>
#include <charconv>

#include "compare/failure.hpp"
#include "scenes/scenes.hpp"

namespace compare {

namespace {

/// A number of triangles, a scene or a file.
meshes::Mesh mesh_of(const std::string& subject, double aspect)
{
    std::size_t triangles = 0;
    const char* const end = subject.data() + subject.size();
    const auto [stop, error] = std::from_chars(subject.data(), end, triangles);
    if (stop == end && error == std::errc{}) {
        if (triangles < 1000 || triangles > 20'000'000)
            throw Failure{subject + ": made are meshes of 1000 to 20000000 triangles"};
        return meshes::solids(triangles);
    }
    scenes::Scene scene = scenes::load(subject, aspect);
    meshes::Mesh mesh;
    mesh.name = scene.name;
    mesh.positions = std::move(scene.positions);
    mesh.indices = std::move(scene.indices);
    mesh.camera = scene.camera;
    meshes::add_normals(mesh);
    return mesh;
}

}  // namespace

std::string View::name() const
{
    return mesh->name + ", " + std::to_string(width) + " x " + std::to_string(height);
}

Job View::job() const
{
    Job job;
    job.mesh = mesh->view();
    job.frame = frame;
    job.projection = projection;
    job.width = width;
    job.height = height;
    return job;
}

std::vector<View> views(const Options& options)
{
    struct Size {
        int width, height;
    };
    std::vector<std::string> subjects = options.subjects;
    if (subjects.empty() && options.quick) subjects = {"2000", "20000"};
    if (subjects.empty()) subjects = {"20000", "300000", "1000000"};
    const std::vector<Size> sizes = options.quick ? std::vector<Size>{{240, 135}}
                                                  : std::vector<Size>{{1920, 1080}, {1080, 720}};
    std::vector<View> result;
    for (const std::string& subject : subjects) {
        const auto mesh = std::make_shared<const meshes::Mesh>(mesh_of(subject, 1.5));
        for (const Size& size : sizes)
            result.push_back({mesh, size.width, size.height,
                              nook::projection(mesh->camera, size.width, size.height),
                              nook::view_frame(mesh->camera)});
    }
    return result;
}

Buffers::Buffers(const View& view)
    : depth{view.width, view.height},
      planes{view.width, 3 * view.height},
      interleaved{3 * view.width, view.height},
      face{view.width, view.height},
      counts(view.mesh->triangles())
{}

nook::ImageView3<float> Buffers::planar()
{
    const auto plane = [&](int i) -> nook::ImageView<float> {
        return {&planes(0, i * depth.height()), depth.width(), depth.height(), depth.width(), 1};
    };
    return {plane(0), plane(1), plane(2)};
}

nook::ImageView3<float> Buffers::pixels()
{
    return nook::ImageView3<float>::interleaved(interleaved.data(), depth.width(), depth.height(),
                                                std::ptrdiff_t{3} * depth.width());
}

const char* text_of(Target target)
{
    switch (target) {
    case Target::facets: return "depth, facet normals";
    case Target::facets_interleaved: return "depth, facet normals, interleaved";
    case Target::smooth: return "depth, smooth normals";
    case Target::depth: return "depth";
    case Target::faces: return "depth, face ids";
    default: return "visible counts";
    }
}

void draw(const Kernels& kernels, Target target, const View& view, Buffers& buffers,
          Workspace& workspace, const Threads& threads)
{
    Job job = view.job();
    job.workspace = &workspace;
    job.threads = threads;
    if (target == Target::counts) {
        job.counts = buffers.counts.data();
        (void)checked(kernels.visible_counts(job, {}), "visible_counts");
        return;
    }
    job.buffers.depth = buffers.depth.view();
    if (target == Target::facets || target == Target::smooth) job.buffers.normal = buffers.planar();
    if (target == Target::facets_interleaved) job.buffers.normal = buffers.pixels();
    if (target == Target::faces) job.buffers.face = buffers.face.view();
    (void)checked(kernels.rasterise(job, {.interpolate_normals = target == Target::smooth}),
                  "rasterise");
}

}  // namespace compare
