#include "output.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <nook/version.hpp>

#include "../support/colour_map.hpp"
#include "../support/files.hpp"
#include "../support/machine.hpp"
#include "../support/picture.hpp"
#include "pictures.hpp"

namespace best_view {

namespace {

using Json = nlohmann::ordered_json;

std::string number(double value, int digits = 4)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.*f", digits, value);
    return text;
}

std::string picture_name(std::size_t place)
{
    char name[32];
    std::snprintf(name, sizeof name, "view-%02zu.png", place + 1);
    return name;
}

const char* name_of(nook::BackFaces back_faces)
{
    switch (back_faces) {
    case nook::BackFaces::counted: return "counted";
    case nook::BackFaces::occluding: return "occluding";
    default: return "left-out";
    }
}

/// The information left after a greedy choice, as a share of all there is.
double share_left(const Views& views, const Choice& choice)
{
    const double all = views.entropies.information_by_views;
    return all > 0 ? choice.value / all : 0;
}

std::vector<std::string> caption(const std::string& rank, const Task& task, const Views& views,
                                 const Choice& choice)
{
    std::string value;
    switch (task.measure) {
    case Measure::vmi: value = "VMI " + number(choice.value); break;
    case Measure::evmi: value = "EVMI " + number(choice.value); break;
    case Measure::saliency: value = "saliency " + number(choice.value); break;
    case Measure::greedy: value = number(100 * share_left(views, choice), 2) + " % left"; break;
    default: value = number(choice.value) + " bits left";
    }
    return {rank + "view " + std::to_string(choice.view), value};
}

/// Each triangle in the colour of its saliency; the largest twentieth share the brightest.
std::vector<support::Rgb> saliency_colours(const Views& views)
{
    std::vector<double> seen;
    for (std::size_t o = 0; o < views.polygon_saliency.size(); ++o)
        if (views.channel.seen(o)) seen.push_back(views.polygon_saliency[o]);
    const auto high = seen.begin() + static_cast<std::ptrdiff_t>((seen.size() - 1) * 19 / 20);
    std::nth_element(seen.begin(), high, seen.end());
    const double scale = *high > 0 ? 1 / *high : 0;
    std::vector<support::Rgb> colours;
    for (const double saliency : views.polygon_saliency) {
        const support::Rgb stored = support::sequential(saliency * scale);
        const auto linear = [](float c) { return std::pow(c, 2.2f); };
        colours.push_back({linear(stored.r), linear(stored.g), linear(stored.b)});
    }
    return colours;
}

/// What is known of one view; null for the measures of a view that sees nothing.
Json json_of(const Views& views, std::uint32_t view)
{
    const glm::dvec3& d = views.directions[view];
    const double probability = views.channel.p_view(view);
    Json entry{{"view", view}, {"direction", {d.x, d.y, d.z}}, {"probability", probability}};
    const auto add = [&](const char* name, const std::vector<double>& values) {
        if (values.empty()) return;
        entry[name] = nullptr;
        if (probability > 0) entry[name] = values[view];
    };
    add("vmi", views.vmi);
    add("evmi", views.evmi);
    add("saliency", views.saliency);
    return entry;
}

Json json_of(const Task& task, const Views& views, const Choice& choice)
{
    Json entry = json_of(views, choice.view);
    if (!is_greedy(task.measure)) return entry;
    entry["merged"] = {{"probability", choice.probability}, {"information", choice.value}};
    if (task.measure == Measure::greedy) entry["merged"]["share"] = share_left(views, choice);
    return entry;
}

Json json_of(const scenes::Scene& scene, const Task& task, const Views& views, int threads)
{
    const nook::ChannelEntropies& entropies = views.entropies;
    Json json;
    json["nook"] = nook::version;
    json["machine"] = {
        {"cpu", support::cpu_name()}, {"compiler", support::compiler_name()}, {"threads", threads}};
    json["scene"] = scene.name;
    json["triangles"] = scene.triangles();
    json["seen_triangles"] = views.seen;
    json["viewpoints"] = views.cameras.size();
    json["resolution"] = task.resolution;
    if (std::isfinite(task.distance)) json["distance"] = task.distance;
    else json["distance"] = nullptr;  // orthographic
    json["back_faces"] = name_of(views.back_faces);
    json["measure"] = best_view::name_of(task.measure);
    json["entries"] = views.channel.entry_count();
    json["bits"] = {{"views", entropies.view},
                    {"polygons", entropies.polygon},
                    {"joint", entropies.joint},
                    {"information", entropies.information_by_views}};
    json["seconds"] = {{"channel", views.channel_seconds}, {"measures", views.measure_seconds}};
    json["best"] = Json::array();
    for (std::size_t i = 0; i < views.chosen.size(); ++i) {
        json["best"].push_back(json_of(task, views, views.chosen[i]));
        json["best"].back()["picture"] = picture_name(i);
    }
    if (views.worst) json["worst"] = json_of(task, views, *views.worst);
    json["views"] = Json::array();
    for (std::uint32_t v = 0; v < views.cameras.size(); ++v)
        json["views"].push_back(json_of(views, v));
    return json;
}

}  // namespace

void print(const scenes::Scene& scene, const Task& task, const Views& views)
{
    const nook::ChannelEntropies& bits = views.entropies;
    std::printf("%s, %zu triangles, %zu of them seen from %zu viewpoints at %d x %d\n",
                scene.name.c_str(), scene.triangles(), views.seen, views.cameras.size(),
                task.resolution, task.resolution);
    std::printf("H(V) %.4f, H(O) %.4f, I(V;O) %.4f bits; channel %.2f s, measures %.2f s\n",
                bits.view, bits.polygon, bits.information_by_views, views.channel_seconds,
                views.measure_seconds);
    std::printf("%5s %6s   %-24s %9s %9s", task.measure == Measure::saliency ? "most" : "best",
                "view", "direction", "p(v)", "VMI");
    if (!views.evmi.empty()) std::printf(" %9s %9s", "EVMI", "S(v)");
    if (is_greedy(task.measure)) std::printf(" %9s", "left");
    if (task.measure == Measure::greedy) std::printf(" %9s", "%");
    std::printf("\n");
    const auto row = [&](const char* rank, const Choice& choice) {
        const std::uint32_t v = choice.view;
        const glm::dvec3& d = views.directions[v];
        std::printf("%5s %6u   %7.4f %7.4f %7.4f  %9.6f %9.4f", rank, v, d.x, d.y, d.z,
                    views.channel.p_view(v), views.vmi[v]);
        if (!views.evmi.empty()) std::printf(" %9.4f %9.4g", views.evmi[v], views.saliency[v]);
        if (is_greedy(task.measure)) std::printf(" %9.4f", choice.value);
        if (task.measure == Measure::greedy) std::printf(" %9.3f", 100 * share_left(views, choice));
        std::printf("\n");
    };
    for (std::size_t i = 0; i < views.chosen.size(); ++i)
        row(std::to_string(i + 1).c_str(), views.chosen[i]);
    if (views.worst) row("last", *views.worst);
}

void write(const std::filesystem::path& folder, const scenes::Scene& scene, const Task& task,
           const Views& views, int size, nook::ThreadExecutor& threads, support::Progress& progress)
{
    progress.step("drawing the pictures");
    std::vector<Tile> tiles;
    const auto draw_view = [&](const Choice& choice, const std::vector<support::Rgb>& colours) {
        return draw(scene, views.cameras[choice.view], size, colours, threads);
    };
    for (std::size_t i = 0; i < views.chosen.size(); ++i) {
        const Choice& choice = views.chosen[i];
        tiles.push_back(
            {draw_view(choice, {}), caption(std::to_string(i + 1) + ": ", task, views, choice)});
        support::write_png(folder / picture_name(i), tiles.back().picture);
        progress.share(double(i + 1) / double(views.chosen.size()));
    }
    if (views.worst)
        tiles.push_back(
            {draw_view(*views.worst, {}), caption("last: ", task, views, *views.worst)});
    if (!views.polygon_saliency.empty() && !views.chosen.empty())
        tiles.push_back({draw_view(views.chosen.front(), saliency_colours(views)),
                         {"1, by the saliency", "of its polygons"}});
    support::write_png(
        folder / sheet_name,
        contact_sheet(tiles, scene.name + ", " + best_view::name_of(task.measure) + ", of " +
                                 std::to_string(views.cameras.size()) + " views"));
    support::write_file(folder / json_name,
                        json_of(scene, task, views, threads.concurrency()).dump(2) + '\n');
}

}  // namespace best_view
