#include "cell.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "../support/files.hpp"
#include "document.hpp"
#include "errors.hpp"
#include "pictures.hpp"
#include "reference.hpp"
#include "runs.hpp"
#include "view.hpp"

namespace report {

namespace {

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_of(const Timing& timing)
{
    Json passes = Json::array();
    for (const Timing::Pass& pass : timing.passes)
        passes.push_back({{"name", pass.name}, {"median", pass.median}});
    return {{"threads", timing.threads}, {"rounds", timing.rounds}, {"median", timing.median},
            {"min", timing.fastest},     {"p90", timing.p90},       {"passes", passes}};
}

Json json_of(const nook::Work& work)
{
    return {{"pixels", work.pixels},   {"background", work.background},
            {"skipped", work.skipped}, {"samples", work.samples},
            {"rays", work.rays},       {"skipped_rays", work.skipped_rays},
            {"passes", work.passes}};
}

Json json_of(const Traced& traced)
{
    return {{"meaning", name_of(traced.meaning)},
            {"directions", traced.directions},
            {"seconds", traced.seconds},
            {"standard_error", traced.standard_error},
            {"rays", traced.rays},
            {"skipped_rays", traced.skipped_rays},
            {"picture", std::string{"reference-"} + name_of(traced.meaning)}};
}

Json json_of(const HeightField& field)
{
    return {{"slices", field.slices},
            {"row_step", field.row_step},
            {"seconds", field.seconds},
            {"standard_error", field.standard_error},
            {"error", report::json_of(field.unknown)},
            {"picture", "height-field"}};
}

Json json_of(const Run& run)
{
    const Kernel& kernel = run.kernel;
    Json result;
    result["id"] = kernel.id;
    result["kernel"] = kernel.name;
    result["setting"] = kernel.setting;
    result["parameters"] = kernel.parameters;
    result["meaning"] = name_of(kernel.meaning);
    result["row_step"] = kernel.row_step;
    result["slow"] = kernel.slow;
    result["default"] = kernel.is_default;
    result["timings"] = Json::array();
    for (const Timing& timing : run.timings) result["timings"].push_back(json_of(timing));
    result["preparation"] = kernel.preparation;
    result["memory"] = kernel.memory ? kernel.memory() : 0;
    result["structures"] = kernel.structures;
    result["work"] = json_of(run.work);
    result["without"] = kernel.without.empty() ? Json(nullptr) : Json(kernel.without);
    result["pareto"] = Json::array();
    return result;
}

/// How fast the error of rays falls with their number: the slope of a line through the logarithms.
Json slopes(const Json& results)
{
    std::vector<std::string> kernels;
    for (const Json& result : results)
        if (result["parameters"].contains("directions") &&
            std::find(kernels.begin(), kernels.end(), result["kernel"]) == kernels.end())
            kernels.push_back(result["kernel"]);
    Json slopes = Json::array();
    for (const std::string& kernel : kernels) {
        std::vector<double> x, y;
        for (const Json& result : results) {
            const double error = result["error"]["rmse"];
            if (result["kernel"] != kernel || !(error > 0)) continue;
            x.push_back(std::log(double{result["parameters"]["directions"]}));
            y.push_back(std::log(error));
        }
        double mean_x = 0, mean_y = 0, above = 0, below = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            mean_x += x[i] / double(x.size());
            mean_y += y[i] / double(x.size());
        }
        for (std::size_t i = 0; i < x.size(); ++i) {
            above += (x[i] - mean_x) * (y[i] - mean_y);
            below += (x[i] - mean_x) * (x[i] - mean_x);
        }
        if (below > 0) slopes.push_back({{"kernel", kernel}, {"slope", above / below}});
    }
    return slopes;
}

}  // namespace

Json camera_of(const Cell& cell)
{
    const nook::Camera& camera = cell.subject->scene.camera;
    Json numbers = Json::array();
    for (const glm::dvec3& vector : {camera.eye, camera.target, camera.up})
        for (int axis = 0; axis < 3; ++axis) numbers.push_back(vector[axis]);
    numbers.push_back(camera.orthographic ? 1 : 0);
    numbers.push_back(camera.orthographic ? camera.view_height : camera.vertical_fov);
    return numbers;
}

Json measure(const Cell& cell, const Options& options, Structures& structures,
             nook::ThreadExecutor& threads, const std::filesystem::path& folder,
             support::Progress& progress)
{
    const auto start = std::chrono::steady_clock::now();
    const scenes::Scene& scene = cell.subject->scene;
    progress.step("drawing");
    const View view = draw(scene, options, threads);
    progress.step("building the hierarchy");
    const std::size_t dropped = structures.hierarchy().value.dropped();
    const Setup setup{cell, view, structures, options.quick, threads};
    std::vector<Kernel> kernels;
    add_depth_kernels(setup, kernels);
    add_surface_kernels(setup, kernels);
    add_outline_kernels(setup, kernels);
    add_traced_kernels(setup, kernels);
    add_information_kernels(setup, kernels);

    // Visibility always: the height field and the pictures go by it.
    std::vector<Traced> references;
    references.push_back(trace(setup, Meaning::visibility, options.directions, progress));
    const auto reference_of = [&](Meaning meaning) {
        return std::find_if(references.begin(), references.end(),
                            [&](const Traced& traced) { return traced.meaning == meaning; });
    };
    for (const Kernel& kernel : kernels)
        if (reference_of(kernel.meaning) == references.end())
            references.push_back(trace(setup, kernel.meaning, options.directions, progress));
    std::vector<HeightField> fields;
    if (!cell.unlimited()) fields.push_back(height_field(setup, references.front(), progress));
    const HeightField* const field = fields.empty() ? nullptr : &fields.front();

    const std::vector<Run> runs =
        run_kernels(view, std::move(kernels), threads, options.quick ? 0.1 : 0.3, progress);

    Json results = Json::array();
    for (std::size_t i = 0; i < runs.size(); ++i) {
        progress.step("measuring the errors");
        Json result = json_of(runs[i]);
        add_errors(view, runs[i], *reference_of(runs[i].kernel.meaning), field, threads, result);
        results.push_back(std::move(result));
    }

    progress.step("writing the pictures");
    support::prepare_folder(folder);
    write_pictures(folder, scene, view, references, field, runs, cell.principal);
    if (cell.subject->figures && cell.principal) write_figures(folder, view, cell.radius, threads);

    Json json;
    json["id"] = cell.id;
    json["scene"] = scene.name;
    json["what"] = cell.subject->what;
    json["triangles"] = scene.triangles();
    json["dropped_triangles"] = cell.subject->dropped + dropped;
    json["camera"] = camera_of(cell);
    json["width"] = view.width();
    json["height"] = view.height();
    json["orthographic"] = view.projection.orthographic;
    json["background_share"] =
        double(view.background) / (double(view.width()) * double(view.height()));
    json["radius"] = number_or_null(cell.radius);
    json["radius_factor"] = number_or_null(cell.factor);
    json["seconds"] = 0;
    json["references"] = Json::array();
    for (const Traced& traced : references) json["references"].push_back(json_of(traced));
    json["height_field"] = field != nullptr ? json_of(*field) : Json(nullptr);
    json["shaded"] = "shaded";
    json["slopes"] = slopes(results);
    json["results"] = std::move(results);
    mark_pareto(json);
    json["seconds"] =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return json;
}

}  // namespace report
