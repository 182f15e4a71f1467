#include <nook/version.hpp>

#include "../support/machine.hpp"
#include "output.hpp"

namespace report {

namespace {

using Json = nlohmann::ordered_json;

Json metrics(const nook::ErrorMetrics& error)
{
    return {{"rmse", error.rmse}, {"mae", error.mae},     {"bias", error.bias},
            {"p99", error.p99},   {"max", error.maximum}, {"pixels", error.pixels}};
}

/// One entry per kernel and number of threads.
void append_results(Json& results, const SceneReport::Row& row)
{
    for (const Timing& timing : row.timings) {
        Json error = metrics(row.error);
        error["ssim"] = row.ssim;
        Json entry;
        entry["kernel"] = row.kernel;
        entry["parameters"] = row.parameters;
        entry["threads"] = timing.threads;
        entry["milliseconds"] = {{"median", timing.median},
                                 {"min", timing.fastest},
                                 {"p90", timing.p90},
                                 {"rounds", timing.rounds}};
        entry["error"] = error;
        entry["height_field_error"] = metrics(row.height_field);
        if (row.exact) entry["own_formula_error"] = metrics(*row.exact);
        entry["skipped"] = {{"pixels", row.work.skipped}, {"rays", row.work.skipped_rays}};
        entry["samples"] = row.work.samples;
        results.push_back(entry);
    }
}

}  // namespace

Json json_of(const std::vector<SceneReport>& scenes, const std::vector<stability::Family>& families,
             const Options& options)
{
    Json report;
    report["nook"] = nook::version;
    report["machine"] = {{"cpu", support::cpu_name()},
                         {"compiler", support::compiler_name()},
                         {"threads", options.threads}};
    report["scenes"] = Json::array();
    for (const SceneReport& scene : scenes) {
        Json entry;
        entry["name"] = scene.name;
        entry["triangles"] = scene.triangles;
        entry["dropped_triangles"] = scene.dropped;
        entry["width"] = scene.width;
        entry["height"] = scene.height;
        entry["orthographic"] = scene.orthographic;
        entry["background_share"] = scene.background_share;
        entry["reference"] = {{"kind", "traced"},
                              {"rays", scene.rays},
                              {"radius", scene.radius},
                              {"seconds", scene.reference_seconds},
                              {"standard_error", scene.standard_error},
                              {"build_seconds", scene.build_seconds},
                              {"rays_traced", scene.rays_traced},
                              {"rays_skipped", scene.rays_skipped}};
        entry["height_field"] = {{"slices", scene.slices},
                                 {"row_step", scene.height_field_step},
                                 {"seconds", scene.height_field_seconds},
                                 {"error", metrics(scene.unknown)}};
        entry["results"] = Json::array();
        for (const SceneReport::Row& row : scene.rows) append_results(entry["results"], row);
        entry["range_checks"] = metrics(scene.range_checks);
        report["scenes"].push_back(entry);
    }
    report["stability"] = stability::json_of(families);
    return report;
}

}  // namespace report
