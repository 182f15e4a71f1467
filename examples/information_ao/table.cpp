#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

#include <nook/scene/viewpoints.hpp>

#include "results.hpp"

namespace information {

namespace {

using nook::PolygonState;
using Json = nlohmann::ordered_json;

struct Agreement {
    const char* name;
    const char* text;
    double value;
};
std::vector<Agreement> agreements(const Results& results)
{
    const Maps& maps = results.maps;
    const auto ranks = [&](const std::vector<float>& first, const std::vector<float>& second) {
        return ranks_of(first, second, maps.states).value;
    };
    return {
        {"pmi_matrix", "PMI as visibility, AO of the pictures", ranks(maps.shade, maps.open)},
        {"pmi_traced", "PMI as visibility, ray-traced AO", ranks(maps.shade, results.traced)},
        {"matrix_traced", "AO of the pictures, ray-traced AO", ranks(maps.open, results.traced)}};
}

struct State {
    PolygonState state;
    const char* name;
    const char* text;
};
constexpr State states[] = {{PolygonState::seen, "seen", "seen"},
                            {PolygonState::hidden, "hidden", "hidden"},
                            {PolygonState::too_small, "too_small", "too small to tell"},
                            {PolygonState::turned_away, "turned_away", "turned away from all"},
                            {PolygonState::unusable, "unusable", "unusable"}};

double share(const Results& results, PolygonState state)
{
    const std::vector<PolygonState>& all = results.maps.states;
    return all.empty() ? 0
                       : static_cast<double>(std::count(all.begin(), all.end(), state)) /
                             static_cast<double>(all.size());
}

/// How far the map moves with four times the viewpoints.
struct Change {
    double rms = 0, of_range = 0, of_mean = 0;
};
Change change(const Results& results)
{
    const Range range = range_of(results.maps.pmi, results.maps.states);
    const double rms = rms_change(results.maps, *results.refined);
    const auto relative = [&](double to) { return to > 0 ? rms / to : 0; };
    return {rms, relative(range.most - range.least), relative(range.mean)};
}

}  // namespace

void print(const CommandLine& command, const Results& results)
{
    const nook::SamplingPlan& plan = results.maps.report.sampling;
    const Range range = range_of(results.maps.pmi, results.maps.states);
    std::printf("%s, %zu polygons; %zu viewpoints, %s, pictures of %d x %d, %d threads\n",
                results.scene.name.c_str(), results.mesh.triangle_count,
                results.views.cameras.size(),
                std::isfinite(command.distance) ? "perspective" : "orthographic", plan.resolution,
                plan.resolution, command.threads);
    std::printf(
        "samples per pixel: 1 for %zu polygons, 4 for %zu, 16 for %zu; %zu get fewer than %d\n",
        plan.polygons[0], plan.polygons[1], plan.polygons[2], plan.below_target, command.samples);
    std::printf("%.2f s without the matrix of the channel", results.maps.seconds);
    if (results.channel)
        std::printf(", %.2f s with it, %.1f MB", results.channel->seconds,
                    static_cast<double>(results.channel->matrix.memory_size()) * 1e-6);
    std::printf("\nback faces %s; %zu viewpoints see nothing\n",
                results.maps.report.back_faces == nook::BackFaces::left_out
                    ? "are left out, since the mesh is closed"
                    : "occlude",
                results.maps.report.blind_views);
    for (const State& state : states)
        std::printf("  %-22s %8.3f %%\n", state.text, 100 * share(results, state.state));
    std::printf("PMI: %.4g to %.4g bits, mean %.4g", range.least, range.most, range.mean);
    if (results.channel) std::printf("; I(V;O) %.6g bits", results.channel->information);
    std::printf("\n");
    std::printf("rank correlation of the seen polygons\n");
    for (const Agreement& agreement : agreements(results))
        std::printf("  %-40s %6.3f\n", agreement.text, agreement.value);
    if (results.refined) {
        const Change moved = change(results);
        std::printf(
            "with %zu viewpoints PMI changes by %.3g bits rms, %.2f %% of its range, %.2f %% of "
            "its mean\n",
            nook::icosphere_size(command.level + 1), moved.rms, 100 * moved.of_range,
            100 * moved.of_mean);
    }
}

Json json_of(const CommandLine& command, const Results& results)
{
    const nook::SamplingPlan& plan = results.maps.report.sampling;
    const Range range = range_of(results.maps.pmi, results.maps.states);
    Json json{
        {"scene", results.scene.name},
        {"polygons", results.mesh.triangle_count},
        {"viewpoints", results.views.cameras.size()},
        {"level", command.level},
        {"distance", std::isfinite(command.distance) ? Json(command.distance) : Json(nullptr)},
        {"probability", command.probability == nook::ViewProbability::uniform ? "uniform" : "area"},
        {"resolution", plan.resolution},
        {"samples_per_polygon", command.samples},
        {"polygons_by_samples_per_pixel",
         {{"1", plan.polygons[0]}, {"4", plan.polygons[1]}, {"16", plan.polygons[2]}}},
        {"below_target", plan.below_target},
        {"threads", command.threads},
        {"seconds", results.maps.seconds},
        {"back_faces",
         results.maps.report.back_faces == nook::BackFaces::left_out ? "left out" : "occluding"},
        {"blind_views", results.maps.report.blind_views}};
    json["channel"] = nullptr;
    if (const std::optional<Channel>& channel = results.channel)
        json["channel"] = {{"seconds", channel->seconds},
                           {"entries", channel->matrix.entry_count()},
                           {"bytes", channel->matrix.memory_size()},
                           {"mutual_information", channel->information}};
    for (const State& state : states) json["shares"][state.name] = share(results, state.state);
    json["pmi"] = {{"least", range.least}, {"most", range.most}, {"mean", range.mean}};
    for (const Agreement& agreement : agreements(results))
        json["rank_correlations"][agreement.name] = agreement.value;
    json["refined"] = nullptr;
    if (results.refined) {
        const Change moved = change(results);
        json["refined"] = {{"viewpoints", nook::icosphere_size(command.level + 1)},
                           {"seconds", results.refined->seconds},
                           {"rms", moved.rms},
                           {"of_range", moved.of_range},
                           {"of_mean", moved.of_mean}};
    }
    return json;
}

}  // namespace information
