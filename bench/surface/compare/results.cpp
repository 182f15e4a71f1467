#include "results.hpp"

#include "compare/json.hpp"
#include "kernels.hpp"
#include "llvmpipe.hpp"

namespace compare {

namespace {

Json machine(const Options& options)
{
    return json_of_machine(targets().best().name, "llvmpipe", llvmpipe_version(), options);
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
        entry["width"] = m.width;
        entry["height"] = m.height;
        if (m.samples > 0) entry["samples"] = m.samples;
        entry["active"] = m.active;
        entry["threads"] = m.threads;
        entry["nanoseconds_per_pixel"] = json_of(m.nanoseconds);
        entry["base"] = m.base;
        entry["ratio_to_base"] = json_of(m.ratio);
        json["measurements"].push_back(entry);
    }
    json["agreements"] = Json::array();
    for (const Agreement& agreement : results.agreements)
        json["agreements"].push_back({{"part", agreement.part},
                                      {"scene", agreement.scene},
                                      {"contender", agreement.contender},
                                      {"other", agreement.other},
                                      {"samples", agreement.samples},
                                      {"mean_difference", agreement.mean},
                                      {"rms_difference", agreement.rms},
                                      {"largest_difference", agreement.largest},
                                      {"share_beyond_1e-2", agreement.share}});
    json["facts"] = json_of(results.facts);
    write_json(json, options.json);
}

}  // namespace compare
