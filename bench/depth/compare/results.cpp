#include "results.hpp"

#include "compare/json.hpp"
#include "kernels.hpp"
#include "opencv.hpp"

namespace compare {

namespace {

Json machine(const Options& options)
{
    return json_of_machine(targets().best().name, "opencv", opencv_version(), options);
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
        entry["image"] = m.image;
        entry["contender"] = m.contender;
        entry["width"] = m.width;
        entry["height"] = m.height;
        entry["window"] = m.window;
        entry["threads"] = m.threads;
        entry["nanoseconds_per_pixel"] = json_of(m.nanoseconds);
        entry["base"] = m.base;
        entry["ratio_to_base"] = json_of(m.ratio);
        json["measurements"].push_back(entry);
    }
    json["agreements"] = Json::array();
    for (const Agreement& agreement : results.agreements)
        json["agreements"].push_back({{"image", agreement.image},
                                      {"contender", agreement.contender},
                                      {"width", agreement.width},
                                      {"height", agreement.height},
                                      {"window", agreement.window},
                                      {"largest_difference", agreement.largest},
                                      {"share_beyond_1e-3", agreement.share}});
    json["facts"] = json_of(results.facts);
    write_json(json, options.json);
}

}  // namespace compare
