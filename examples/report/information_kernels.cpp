#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <nook/scene/information_ao.hpp>
#include <nook/scene/polygon_values.hpp>
#include <nook/scene/viewpoints.hpp>

#include "counted_scratch.hpp"
#include "kernels.hpp"

namespace report {

namespace {

/// Percent of the polygons, those of the largest information, that share black: a few odd ones would
/// leave all others white.
constexpr int clip = 1;

/// What the passes of a frame keep: one value per polygon.
struct Maps {
    std::vector<nook::Camera> cameras;
    std::vector<float> values, sorted;
    std::vector<nook::PolygonState> states;
    CountedScratch scratch;

    Maps(const nook::MeshView& mesh, int level)
        : values(mesh.triangle_count),
          states(mesh.triangle_count)
    {
        std::vector<glm::dvec3> directions(nook::icosphere_size(level));
        nook::icosphere(level, directions.data());
        const nook::BoundingSphere sphere = nook::bounding_sphere(mesh);
        for (const glm::dvec3& direction : directions)
            cameras.push_back(nook::viewpoint_camera(sphere, direction));
    }

    [[nodiscard]] std::size_t bytes() const
    {
        return cameras.size() * sizeof cameras[0] + states.size() * sizeof states[0] +
               (values.size() + sorted.capacity()) * sizeof(float) + scratch.bytes();
    }
};

nook::Outcome look(Maps& maps, const nook::MeshView& mesh, const nook::InformationOptions& options,
                   bool pmi, nook::ThreadExecutor& threads)
{
    nook::InformationMaps outputs;
    (pmi ? outputs.pmi : outputs.visibility) = maps.values.data();
    outputs.state = maps.states.data();
    return nook::information_ao(mesh, maps.cameras.data(), maps.cameras.size(), outputs, options,
                                nullptr, maps.scratch, threads);
}

/// Information to visibility, with the largest cut off, as nook-information-ao has it.
nook::Error turn(Maps& maps, const nook::InformationOptions& options)
{
    maps.sorted.clear();
    for (std::size_t o = 0; o < maps.values.size(); ++o)
        if (maps.states[o] == nook::PolygonState::seen) maps.sorted.push_back(maps.values[o]);
    if (const std::size_t above = maps.sorted.size() * clip / 100; above > 0) {
        const auto at = maps.sorted.end() - static_cast<std::ptrdiff_t>(above) - 1;
        std::nth_element(maps.sorted.begin(), at, maps.sorted.end());
        for (float& value : maps.values) value = std::min(value, *at);
    }
    return nook::normalise_information(maps.values.data(), maps.states.data(), maps.values.size(),
                                       maps.values.data(), options.equal_within);
}

/// Each pixel takes the value of its polygon: the normals of the other kernels are flat too.
nook::Work shade(const Maps& maps, const View& view, const nook::ImageView<float>& visibility,
                 nook::ThreadExecutor& threads)
{
    threads.for_each(view.height(), [&](int y, int) {
        for (int x = 0; x < view.width(); ++x) {
            const std::uint32_t face = view.face(x, y);
            visibility(x, y) = face != nook::no_face ? maps.values[face] : 1;
        }
    });
    nook::Work work;
    work.pixels =
        static_cast<std::uint64_t>(view.width()) * static_cast<std::uint64_t>(view.height());
    work.background = view.background;
    work.passes = 1;
    return work;
}

Kernel information(const Setup& setup, bool pmi, int level)
{
    const View& view = setup.view;
    const nook::MeshView mesh = setup.structures.scene().mesh();
    nook::InformationOptions options;
    if (setup.quick) options.samples_per_polygon /= 4;
    const auto maps = std::make_shared<Maps>(mesh, level);
    const std::string count = std::to_string(maps->cameras.size());

    Kernel kernel;
    kernel.name = pmi ? "information-pmi" : "information-visibility";
    kernel.id = kernel.name + '-' + count;
    kernel.setting = count + " viewpoints";
    kernel.parameters["radius"] = nullptr;
    kernel.parameters["viewpoints"] = maps->cameras.size();
    kernel.parameters["samples_per_polygon"] = options.samples_per_polygon;
    if (pmi) kernel.parameters["clip_percent"] = clip;
    kernel.passes.push_back({"pictures", [maps, mesh, options, pmi](const nook::ImageView<float>&,
                                                                    nook::ThreadExecutor& threads) {
                                 return look(*maps, mesh, options, pmi, threads);
                             }});
    kernel.passes.push_back(
        {"shade",
         [maps, options, pmi, &view](const nook::ImageView<float>& visibility,
                                     nook::ThreadExecutor& threads) -> nook::Outcome {
             if (pmi)
                 if (const nook::Error error = turn(*maps, options)) return {error};
             return {{}, shade(*maps, view, visibility, threads)};
         }});
    // The viewpoints are an argument: the paper has 642 of them.
    kernel.is_default = !setup.quick && level == 3;
    kernel.slow = setup.quick || level > 2;
    kernel.memory = [maps] { return maps->bytes(); };
    return kernel;
}

}  // namespace

void add_information_kernels(const Setup& setup, std::vector<Kernel>& kernels)
{
    if (!setup.cell.unlimited() || !setup.cell.subject->alone) return;
    const int finest = setup.quick ? 2 : 4;
    for (int level = 2; level <= finest; ++level)
        for (const bool pmi : {false, true}) kernels.push_back(information(setup, pmi, level));
}

}  // namespace report
