#include "run.hpp"

#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include <nook/scene/viewpoints.hpp>

#include "../scenes/scenes.hpp"
#include "../support/checked.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/progress.hpp"
#include "results.hpp"

namespace information {

namespace {

Results compute(const CommandLine& command, const scenes::Scene& scene,
                nook::ThreadExecutor& threads, support::Progress& progress)
{
    const nook::MeshView mesh = scene.mesh();
    Results results{scene, mesh, Views{mesh, command.level, command.distance}, {}, {}, {}, {},
                    {},    {}};
    nook::InformationOptions options{};
    options.resolution = command.resolution;
    options.samples_per_polygon = command.samples;
    options.probability = command.probability;
    const std::string count = std::to_string(results.views.cameras.size());
    progress.step(count + " viewpoints");
    results.maps = information_maps(mesh, results.views, options, threads, progress);
    if (command.importance) {
        progress.step(count + " viewpoints, by importance");
        const std::vector<double> importance = importance_about(*command.importance, results.views);
        options.probability = nook::ViewProbability::importance;
        options.importance = importance.data();
        results.important = information_maps(mesh, results.views, options, threads, progress);
        options.probability = command.probability;
        options.importance = nullptr;
    }
    if (command.refine) {
        const Views finer{mesh, command.level + 1, command.distance};
        progress.step(std::to_string(finer.cameras.size()) + " viewpoints");
        results.refined = information_maps(mesh, finer, options, threads, progress);
    }
    progress.step("the channel");
    results.channel = channel_of(mesh, results.views, results.maps, command.probability, threads);
    if (command.light)
        results.relit = relit_map(results.channel->matrix,
                                  command.light->colours(results.views.directions), threads);
    progress.step("the rays of " + std::to_string(mesh.triangle_count) + " polygons");
    results.traced = traced_map(mesh, command.directions, threads);
    return results;
}

}  // namespace

void run(const CommandLine& command)
{
    const scenes::Scene scene =
        scenes::load(command.scene, double(command.size.width) / command.size.height);
    if (command.light && !channel_fits(scene.triangles(), nook::icosphere_size(command.level)))
        throw support::Failure{"--light: the channel of " + std::to_string(scene.triangles()) +
                               " polygons at this --level is too large"};
    const std::filesystem::path json = command.folder / "information.json";
    if (std::error_code ignored; std::filesystem::is_directory(json, ignored))
        throw support::Failure{json.string() + ": is a folder"};
    support::prepare_folder(command.folder);
    nook::ThreadExecutor threads{command.threads};
    support::Progress progress;
    const Results results = compute(command, scene, threads, progress);
    progress.step("pictures");
    for (const NamedPicture& drawn : draw(command, results, threads))
        support::write_png(command.folder / (drawn.file + ".png"), drawn.picture);
    support::write_file(json, json_of(command, results).dump(2) + '\n');
    progress.clear();
    print(command, results);
    std::printf("pictures and information.json: %s\n", command.folder.string().c_str());
    if (std::fflush(stdout) != 0) throw support::Failure{"stdout cannot be written"};
}

}  // namespace information
