#include <algorithm>
#include <cstddef>

#include <nook/checks.hpp>

#include "document.hpp"

namespace report {

namespace {

/// Whose member a column holds; `twin`: the timing of the result without, with as many threads.
enum class Source { report, cell, reference, kernel, slope, result, timing, twin, sources };

struct Column {
    std::string name;
    Source source;
    Json::json_pointer member;
};

constexpr const char* difference_members[] = {"rmse", "mae", "bias", "p99", "max", "pixels"};
constexpr const char* fit_members[] = {"ssim", "fitted_rmse", "rank_correlation"};
constexpr const char* work_members[] = {
    "pixels",       "background", "skipped",         "samples",       "rays",
    "skipped_rays", "passes",     "skipped_samples", "skipped_passes"};

constexpr const char* plan_members[] = {"kind", "tolerance", "background_groups", "inactive_groups",
                                        "active_groups"};

/// In the order of the file. Programs read columns by name: new ones go to the end of their group.
std::vector<Column> columns()
{
    std::vector<Column> list;
    const auto add = [&list](const std::string& name, Source source, const std::string& member) {
        list.push_back({name, source, Json::json_pointer{member}});
    };
    const auto add_differences = [&add](const std::string& name, Source source,
                                        const std::string& member) {
        for (const char* const part : difference_members)
            add(name + '_' + part, source, member + '/' + part);
    };

    add("cell", Source::cell, "/id");
    add("scene", Source::cell, "/scene");
    add("radius", Source::cell, "/radius");
    add("radius_factor", Source::cell, "/radius_factor");
    add("result", Source::result, "/id");
    add("kernel", Source::result, "/kernel");
    add("family", Source::kernel, "/family");
    add("comparable", Source::kernel, "/comparable");
    add("setting", Source::result, "/setting");
    add("parameters", Source::result, "/parameters");
    add("meaning", Source::result, "/meaning");
    add("default", Source::result, "/default");
    add("slow", Source::result, "/slow");
    add("row_step", Source::result, "/row_step");
    add("without", Source::result, "/without");

    add("threads", Source::timing, "/threads");
    add("rounds", Source::timing, "/rounds");
    add("median_ms", Source::timing, "/median");
    add("min_ms", Source::timing, "/min");
    add("p90_ms", Source::timing, "/p90");
    add("passes_ms", Source::timing, "/passes");
    add("pareto", Source::timing, "/pareto");
    add("plan_ms", Source::timing, "/plan");
    add("without_ms", Source::twin, "/median");
    add("time_ratio", Source::timing, "/ratio");
    add("preparation_ms", Source::result, "/preparation");
    add("memory_bytes", Source::result, "/memory");
    add("structures_bytes", Source::result, "/structures");

    add_differences("error", Source::result, "/error");
    for (const char* const part : fit_members)
        add(std::string{"error_"} + part, Source::result, std::string{"/error/"} + part);
    add_differences("height_field_error", Source::result, "/height_field_error");
    add_differences("estimator_error", Source::result, "/estimator_error");
    add_differences("own_error", Source::result, "/own_error");
    for (const char* const part : work_members)
        add(std::string{"work_"} + part, Source::result, std::string{"/work"} + '/' + part);
    add_differences("added_error", Source::result, "/added_error");
    add("added_error_changed", Source::result, "/added_error/changed");
    add("added_error_rmse_change", Source::result, "/added_error/rmse_change");
    for (const char* const part : plan_members)
        add(std::string{"plan_"} + part, Source::result, std::string{"/plan/"} + part);
    add("slope", Source::slope, "/slope");

    add("reference_directions", Source::reference, "/directions");
    add("reference_seconds", Source::reference, "/seconds");
    add("reference_standard_error", Source::reference, "/standard_error");
    add("reference_rays", Source::reference, "/rays");
    add("reference_skipped_rays", Source::reference, "/skipped_rays");
    add("height_field_slices", Source::cell, "/height_field/slices");
    add("height_field_row_step", Source::cell, "/height_field/row_step");
    add("height_field_seconds", Source::cell, "/height_field/seconds");
    add("height_field_standard_error", Source::cell, "/height_field/standard_error");
    add_differences("unknown_error", Source::cell, "/height_field/error");

    add("width", Source::cell, "/width");
    add("height", Source::cell, "/height");
    add("orthographic", Source::cell, "/orthographic");
    add("background_share", Source::cell, "/background_share");
    add("triangles", Source::cell, "/triangles");
    add("dropped_triangles", Source::cell, "/dropped_triangles");
    add("cell_seconds", Source::cell, "/seconds");
    add("nook", Source::report, "/nook");
    add("cpu", Source::report, "/machine/cpu");
    add("compiler", Source::report, "/machine/compiler");
    add("machine_threads", Source::report, "/machine/threads");
    add("quick", Source::report, "/run/quick");
    return list;
}

std::string quoted(const std::string& text)
{
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"') result += '"';
        result += c;
    }
    return result + '"';
}

std::string field(const Json* object, const Json::json_pointer& member)
{
    if (object == nullptr || !object->contains(member)) return {};
    const Json& value = object->at(member);
    if (value.is_null()) return {};
    if (value.is_number_float() && !nook::detail::is_finite(value.get<double>())) return {};
    if (value.is_string()) return quoted(value.get_ref<const std::string&>());
    // Numbers with as many digits as bring them back as they were; what is nested, as JSON.
    return quoted(value.dump(-1, ' ', false, Json::error_handler_t::replace));
}

/// The first element of an array whose member has that value.
const Json* find(const Json& array, const char* member, const Json& value)
{
    for (const Json& element : array)
        if (element.at(member) == value) return &element;
    return nullptr;
}

}  // namespace

std::string csv_of(const Json& report)
{
    const std::vector<Column> list = columns();
    std::string csv;
    for (const Column& column : list) {
        if (!csv.empty()) csv += ',';
        csv += column.name;
    }
    csv += "\r\n";
    for (const Json& cell : report.at("cells"))
        for (const Json& result : cell.at("results")) {
            const Json* from[std::size_t(Source::sources)] = {
                &report,
                &cell,
                find(cell.at("references"), "meaning", result.at("meaning")),
                find(report.at("kernels"), "name", result.at("kernel")),
                find(cell.at("slopes"), "kernel", result.at("kernel")),
                &result,
                nullptr,
                nullptr};
            const Json* const twin = result.at("without").is_null()
                                         ? nullptr
                                         : find(cell.at("results"), "id", result.at("without"));
            const Json& front = result.at("pareto");
            for (Json timing : result.at("timings")) {
                // Of a line it is whether it is on the front.
                timing["pareto"] =
                    std::find(front.begin(), front.end(), timing.at("threads")) != front.end();
                from[std::size_t(Source::timing)] = &timing;
                from[std::size_t(Source::twin)] =
                    twin == nullptr ? nullptr
                                    : find(twin->at("timings"), "threads", timing.at("threads"));
                for (std::size_t i = 0; i < list.size(); ++i) {
                    if (i > 0) csv += ',';
                    csv += field(from[std::size_t(list[i].source)], list[i].member);
                }
                csv += "\r\n";
            }
        }
    return csv;
}

}  // namespace report
