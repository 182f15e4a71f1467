#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

/// A small report with made-up numbers, in the shape of docs/report.schema.json.
namespace report_sample {

using Json = nlohmann::ordered_json;

inline Json differences(double rmse)
{
    Json json =
        Json::parse(R"({"rmse": 0, "mae": 0, "bias": 0, "p99": 0, "max": 1.0, "pixels": 41234})");
    json["rmse"] = rmse;
    json["mae"] = rmse / 2;
    json["bias"] = -rmse / 3;
    json["p99"] = 3 * rmse;
    return json;
}

inline Json timing(int threads, double median)
{
    Json json =
        Json::parse(R"({"threads": 1, "rounds": 7, "median": 0, "min": 0, "p90": 0, "passes":
        [{"name": "samples", "median": 0}, {"name": "blur", "median": 0}], "plan": null,
        "ratio": null})");
    json["threads"] = threads;
    json["median"] = median;
    json["min"] = 0.9 * median;
    json["p90"] = 1.1 * median;
    json["passes"][0]["median"] = 0.7 * median;
    json["passes"][1]["median"] = 0.3 * median;
    return json;
}

/// With times for one thread and for two.
inline Json result(const std::string& id, double one, double two, double rmse)
{
    Json json = Json::parse(R"({"id": "", "kernel": "", "setting": "3 x 3, \"wide\",\nblurred",
        "parameters": {"radius": 0.1, "samples": 9, "bias": "automatic"}, "meaning": "visibility",
        "row_step": 1, "slow": false, "default": false, "timings": [], "preparation": 0.0,
        "memory": 123456789, "structures": 0, "error": null, "height_field_error": null,
        "estimator_error": null, "own_error": null, "added_error": null,
        "work": {"pixels": 57600, "background": 1, "skipped": 2, "samples": 3,
                 "skipped_samples": 6, "rays": 4, "skipped_rays": 5, "passes": 2,
                 "skipped_passes": 1},
        "without": null, "plan": null, "pareto": []})");
    json["id"] = id;
    json["kernel"] = id.substr(0, id.find('-'));
    json["timings"].push_back(timing(1, one));
    json["timings"].push_back(timing(2, two));
    json["error"] = differences(rmse);
    json["error"]["ssim"] = 0.9;
    json["error"]["fitted_rmse"] = rmse / 2;
    json["error"]["rank_correlation"] = 0.8;
    json["height_field_error"] = differences(rmse / 7);
    json["estimator_error"] = differences(rmse / 9);
    return json;
}

/// The same as another result after an exact plan, which takes a tenth of the time that it has without.
inline Json planned(const Json& without)
{
    Json json = without;
    const std::string id = without["id"];
    const std::string kernel = without["kernel"];
    json["kernel"] = kernel + "-planned";
    json["id"] = kernel + "-planned" + id.substr(kernel.size());
    json["without"] = id;
    json["plan"] = Json::parse(R"({"kind": "surface", "tolerance": 0, "background_groups": 1200,
        "inactive_groups": 800, "active_groups": 1600,
        "picture": "plan-surface"})");
    for (Json& timing : json["timings"]) {
        timing["plan"] = 0.1 * timing["median"].get<double>();
        timing["median"] = 0.5 * timing["median"].get<double>();
        timing["passes"][0] = {{"name", "plan"}, {"median", timing["plan"]}};
        timing["ratio"] = 0.5;
    }
    json["added_error"] = differences(0);
    json["added_error"]["max"] = 0;
    json["added_error"]["changed"] = 0;
    json["added_error"]["rmse_change"] = 0;
    return json;
}

inline Json cell(const std::string& id, const Json& radius, const std::vector<Json>& results)
{
    Json json = Json::parse(R"({"id": "", "scene": "bowl", "what": "a bowl", "triangles": 1234,
        "dropped_triangles": 1, "camera": [1, 2, 3, 0, 0, 0, 0, 1, 0, 0, 0.8], "width": 320, "height": 180, "orthographic": false,
        "background_share": 0, "radius": null, "radius_factor": null, "seconds": 7.5,
        "references": [{"meaning": "visibility", "directions": 512, "seconds": 2.1,
                        "standard_error": 0.003, "rays": 30, "skipped_rays": 10,
                        "picture": "reference-visibility"}],
        "height_field": {"slices": 32, "row_step": 1, "seconds": 1.0, "standard_error": 0.002,
                         "error": null, "picture": "height-field"},
        "shaded": "shaded", "results": [], "slopes": [{"kernel": "traced", "slope": -0.72}]})");
    json["id"] = id;
    json["background_share"] = 1.0 / 3;
    json["radius"] = radius;
    if (!radius.is_null()) json["radius_factor"] = 1.0;
    json["height_field"]["error"] = differences(0.05);
    for (const Json& result : results) json["results"].push_back(result);
    return json;
}

/// Two cells, seven results.
inline Json good_report()
{
    Json json = Json::parse(R"({"format": 3, "nook": "0.1.0",
        "machine": {"cpu": "Some CPU", "compiler": "g++", "threads": 2},
        "run": {"command": "nook-report", "quick": true, "width": 320, "height": 180,
                "directions": 512, "seconds": 95.0},
        "kernels": [], "cells": [], "stability": {"families": [], "rows": []}, "calibration": null})");
    for (const char* name : {"horizon", "alchemy", "traced"}) {
        Json kernel = Json::parse(R"({"name": "", "family": "surface", "what": "what",
            "source": "a paper", "needs": "depth", "estimates": "visibility", "comparable": true})");
        kernel["name"] = name;
        kernel["comparable"] = name != std::string_view{"alchemy"};
        json["kernels"].push_back(kernel);
    }
    json["cells"].push_back(
        cell("bowl", 0.3,
             {result("alchemy-16", 0.8, 0.41, 0.09), result("horizon-3x3", 1.7, 0.9, 0.06),
              result("horizon-4x8", 5.1, 2.6, 0.04), result("traced-16", 20, 11, 0.1),
              result("traced-256", 300, 160, 0.01)}));
    json["cells"].push_back(
        cell("cup-unlimited", nullptr,
             {result("traced-16", 31, 16, 0.12), result("traced-256", 420, 220, 0.012)}));
    return json;
}

}  // namespace report_sample
