#include "results.hpp"

#include "common.hpp"
#include "compare/json.hpp"

namespace compare {

namespace {

Json machine(const Options& options)
{
    Json result = json_of_machine(chosen(options).name, "plans", "nook", options);
    result.erase("plans");
    return result;
}

Json json_of(const PlannedTime& plan)
{
    Json entry;
    entry["plan"] = plan.plan;
    entry["tolerance"] = plan.tolerance;
    entry["plan_alone_nanoseconds_per_pixel"] = json_of(plan.plan_alone);
    entry["map_alone_nanoseconds_per_pixel"] = json_of(plan.map_alone);
    entry["with_nanoseconds_per_pixel"] = json_of(plan.with);
    entry["speed_up"] = json_of(plan.speed_up);
    entry["speed_up_of_map_alone"] = json_of(plan.reused);
    entry["over_ones"] = json_of(plan.over_ones);
    entry["pixels_left_out"] = plan.pixels_left_out;
    entry["samples_left_out"] = plan.samples_left_out;
    entry["pixels_changed"] = plan.change.bits;
    entry["rms_change"] = plan.change.rms;
    entry["largest_change"] = plan.change.largest;
    entry["added_rmse"] = plan.added_error;
    return entry;
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
        entry["kernel"] = m.kernel;
        entry["radius"] = m.radius;
        entry["width"] = m.width;
        entry["height"] = m.height;
        entry["ones_nanoseconds_per_pixel"] = json_of(m.ones);
        entry["without_nanoseconds_per_pixel"] = json_of(m.without);
        entry["without_over_ones"] = json_of(m.over_ones);
        if (m.full.median > 0) {
            entry["full_nanoseconds_per_pixel"] = json_of(m.full);
            entry["full_over_without"] = json_of(m.full_speed_up);
        }
        if (m.traced_error >= 0) entry["rmse_without"] = m.traced_error;
        entry["plans"] = Json::array();
        for (const PlannedTime& plan : m.plans) entry["plans"].push_back(json_of(plan));
        json["measurements"].push_back(entry);
    }
    json["facts"] = json_of(results.facts);
    json["broken"] = results.broken;
    write_json(json, options.json);
}

}  // namespace compare
