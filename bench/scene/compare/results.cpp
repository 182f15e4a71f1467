#include "results.hpp"

#include "compare/json.hpp"
#include "embree_scene.hpp"
#include "kernels.hpp"

namespace compare {

namespace {

Json machine(const Options& options)
{
    return json_of_machine(targets().best().name, "embree", embree_version(), options);
}

}  // namespace

void print_machine(const Options& options) { print_machine(machine(options)); }

void write_json(const Results& results, const Options& options)
{
    Json json;
    json["machine"] = machine(options);
    json["marks"] = json_of(results.marks);
    json["measurements"] = Json::array();
    for (const Measurement& m : results.measurements) {
        Json entry;
        entry["part"] = m.part;
        entry["scene"] = m.scene;
        entry["contender"] = m.contender;
        if (!m.radius.empty()) entry["radius"] = m.radius;
        if (m.directions > 0) entry["directions"] = m.directions;
        entry["threads"] = m.threads;
        entry["seconds"] = json_of(m.seconds);
        if (m.rays > 0) entry["million_rays_per_second"] = 1e-6 * m.rays / m.seconds.median;
        entry["base"] = m.base;
        entry["ratio_to_base"] = json_of(m.ratio);
        json["measurements"].push_back(entry);
    }
    json["disagreements"] = Json::array();
    for (const Disagreement& d : results.disagreements)
        json["disagreements"].push_back({{"scene", d.scene},
                                         {"radius", d.radius},
                                         {"directions", d.directions},
                                         {"one", d.one},
                                         {"other", d.other},
                                         {"rays", d.rays},
                                         {"differ", d.differ},
                                         {"one_is_wrong", d.wrong_one},
                                         {"other_is_wrong", d.wrong_other},
                                         {"largest_margin", d.margin}});
    json["facts"] = json_of(results.facts);
    write_json(json, options.json);
}

}  // namespace compare
