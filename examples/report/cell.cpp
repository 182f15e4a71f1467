#include "cell.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "document.hpp"
#include "errors.hpp"
#include "pictures.hpp"
#include "plans.hpp"
#include "reference.hpp"
#include "runs.hpp"
#include "view.hpp"

namespace report {

namespace {

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_of(const Timing& timing, const std::optional<Plan>& plan)
{
    Json passes = Json::array(), planning;
    for (const Timing::Pass& pass : timing.passes) {
        passes.push_back({{"name", pass.name}, {"median", pass.median}});
        if (plan && pass.name == plan->pass) planning = pass.median;
    }
    return {
        {"threads", timing.threads}, {"rounds", timing.rounds},
        {"median", timing.median},   {"min", timing.fastest},
        {"p90", timing.p90},         {"passes", passes},
        {"plan", planning},          {"ratio", timing.ratio ? Json(*timing.ratio) : Json(nullptr)}};
}

Json json_of(const nook::Work& work)
{
    return {{"pixels", work.pixels},
            {"background", work.background},
            {"skipped", work.skipped},
            {"samples", work.samples},
            {"skipped_samples", work.skipped_samples},
            {"rays", work.rays},
            {"skipped_rays", work.skipped_rays},
            {"passes", work.passes},
            {"skipped_passes", work.skipped_passes}};
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
    for (const Timing& timing : run.timings)
        result["timings"].push_back(json_of(timing, kernel.plan));
    result["preparation"] = kernel.preparation;
    result["memory"] = kernel.memory ? kernel.memory() : 0;
    result["structures"] = kernel.structures;
    result["work"] = json_of(run.work);
    result["without"] = kernel.without.empty() ? Json(nullptr) : Json(kernel.without);
    result["pareto"] = Json::array();
    return result;
}

/// What a plan is and what it said; null without one. `pictures` have the names of those that are drawn.
Json plan_of(const View& view, const Run& run, const std::vector<PlanPicture>& pictures)
{
    if (!run.kernel.plan) return nullptr;
    const Plan& plan = *run.kernel.plan;
    const PlanCounts counts = counts_of(view, plan.map());
    Json picture;
    for (const PlanPicture& drawn : pictures)
        if (drawn.run == &run) picture = drawn.name;
    return {{"kind", plan.kind},
            {"tolerance", plan.tolerance ? Json(*plan.tolerance) : Json(nullptr)},
            {"background_groups", counts.background},
            {"inactive_groups", counts.inactive},
            {"active_groups", counts.active},
            {"picture", picture}};
}

/// Adds the errors of a run, and what leaving out did to its picture. A plan that changed nothing has
/// the errors of the kernel without it; `before` are the results of the runs before this one.
void add_errors(const View& view, const std::vector<Run>& runs, const Run& run,
                const Traced& reference, const HeightField* field, nook::ThreadExecutor& threads,
                const Json& before, Json& result)
{
    const Run* const without = without_of(run, runs);
    Json added;
    if (without != nullptr) added = added_error_of(view, run, *without);
    const auto twin = without == nullptr
                          ? before.end()
                          : std::find_if(before.begin(), before.end(), [&](const Json& other) {
                                return other["id"] == run.kernel.without;
                            });
    if (run.kernel.plan && twin != before.end() && added["changed"] == 0) {
        for (const char* term : {"error", "height_field_error"}) result[term] = (*twin)[term];
        // Those of the slow form, which is that of an exact plan too.
        for (const char* term : {"estimator_error", "own_error"})
            result[term] = run.kernel.plan->is_exact() ? (*twin)[term] : Json();
    } else {
        report::add_errors(view, run, reference, field, threads, result);
    }
    if (twin != before.end())
        added["rmse_change"] = double{result["error"]["rmse"]} - double{(*twin)["error"]["rmse"]};
    result["added_error"] = std::move(added);
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
    const std::vector<PlanPicture> plans = plan_pictures(runs);
    for (const Run& run : runs) {
        progress.step("measuring the errors");
        Json result = json_of(run);
        result["plan"] = plan_of(view, run, plans);
        try {
            add_errors(view, runs, run, *reference_of(run.kernel.meaning), field, threads, results,
                       result);
        } catch (const support::Failure& failure) {
            throw support::Failure{cell.id + ": " + failure.what()};
        }
        results.push_back(std::move(result));
    }

    progress.step("writing the pictures");
    support::prepare_folder(folder);
    write_pictures(folder, scene, view, references, field, runs, cell.principal);
    write_plans(folder, scene, view, plans, cell.principal);
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
