#include "results.hpp"

#include "compare/json.hpp"
#include "compare/llvmpipe_context.hpp"
#include "kernels.hpp"

namespace compare {

namespace {

Json machine(const Options& options)
{
    return json_of_machine(targets().best().name, "llvmpipe", llvmpipe_version(), options);
}

}  // namespace

Measurement measured(const char* part, const View& view, const std::vector<Contender>& contenders,
                     const Times& times, std::size_t i, std::size_t base)
{
    Measurement m;
    m.part = part;
    m.mesh = view.mesh->name;
    m.triangles = view.mesh->triangles();
    m.contender = contenders[i].name;
    m.width = view.width;
    m.height = view.height;
    m.seconds = times.seconds(i);
    m.least_seconds = times.least_seconds(i);
    m.base = contenders[base].name;
    m.ratio = times.ratio(i, base);
    return m;
}

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
        entry["mesh"] = m.mesh;
        entry["triangles"] = m.triangles;
        entry["width"] = m.width;
        entry["height"] = m.height;
        entry["contender"] = m.contender;
        entry["threads"] = m.threads;
        entry["seconds"] = json_of(m.seconds);
        entry["least_seconds"] = m.least_seconds;
        entry["base"] = m.base;
        entry["ratio_to_base"] = json_of(m.ratio);
        json["measurements"].push_back(entry);
    }
    json["agreements"] = Json::array();
    for (const Agreement& agreement : results.agreements)
        json["agreements"].push_back({{"view", agreement.view},
                                      {"what", agreement.what},
                                      {"covered", agreement.covered},
                                      {"coverage_differs", agreement.coverage},
                                      {"value_differs", agreement.different}});
    json["facts"] = json_of(results.facts);
    write_json(json, options.json);
}

}  // namespace compare
