#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <ostream>
#include <string>
#include <string_view>

#include "stability.hpp"

namespace stability {

namespace {

using Json = nlohmann::ordered_json;

Json labels(const std::vector<Label>& labels)
{
    Json array = Json::array();
    for (const Label& label : labels) array.push_back({{"name", label.name}, {"what", label.what}});
    return array;
}

std::string cell(const std::optional<double>& value)
{
    if (!value) return "-";
    if (std::isnan(*value)) return "NaN";
    char text[32];
    const bool short_number = *value == 0 || (*value >= 0.01 && *value <= 1e5);
    const bool whole = *value == std::floor(*value);
    std::snprintf(text, sizeof text, !short_number ? "%.1e" : whole ? "%.0f" : "%.3g", *value);
    return text;
}

/// The worse of two results: NaN over infinity over numbers over nothing.
std::optional<double> worse(const std::optional<double>& a, const std::optional<double>& b)
{
    if (!a || !b) return a ? a : b;
    if (std::isnan(*a) || std::isnan(*b)) return std::isnan(*a) ? a : b;
    return std::max(*a, *b);
}

std::string padded(std::string_view text, std::size_t size)
{
    return std::string(size > text.size() ? size - text.size() : 0, ' ') + std::string{text};
}

/// `naive-float` heads its column in two lines, split at the first dash.
struct Heading {
    std::string first, second;
};
Heading heading(const std::string& name)
{
    const std::size_t dash = name.find('-');
    if (dash == std::string::npos) return {"", name};
    return {name.substr(0, dash), name.substr(dash + 1)};
}

/// Below the table of a metric: where nook's algorithms are at their worst, if anything is wrong there.
void print_worst(std::ostream& out, const Family& family, std::size_t metric)
{
    for (const Label& algorithm : family.algorithms) {
        if (algorithm.name.find("nook") == std::string::npos) continue;
        const auto badness = [&](const Row& row) {
            const double value = row.values[metric].value_or(-1);
            return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
        };
        const Row* worst = nullptr;
        for (const Row& row : family.rows)
            if (row.algorithm == algorithm.name &&
                (worst == nullptr || badness(row) > badness(*worst)))
                worst = &row;
        if (worst != nullptr && !worst->worst.empty() && worst->worst_metric == metric)
            out << "  " << algorithm.name << " at its worst, " << worst->case_name << ": "
                << worst->worst << '\n';
    }
}

void print_metric(std::ostream& out, const Family& family, std::size_t metric)
{
    std::size_t first_column = 0;
    for (const Label& label : family.cases)
        first_column = std::max(first_column, label.name.size());
    const auto column = [](const Heading& head) {
        return 2 + std::max({head.first.size(), head.second.size(), std::size_t{7}});
    };
    std::string above(2 + first_column, ' '), below = above;
    for (const Label& algorithm : family.algorithms) {
        const Heading head = heading(algorithm.name);
        above += padded(head.first, column(head));
        below += padded(head.second, column(head));
    }
    above.erase(above.find_last_not_of(' ') + 1);
    const Label& label = family.metrics[metric];
    out << label.name << ": " << label.what << '\n' << above << '\n' << below << '\n';
    for (const Label& subject : family.cases) {
        std::string line = "  " + subject.name;
        line.resize(2 + first_column, ' ');
        bool any = false;
        for (const Label& algorithm : family.algorithms) {
            std::optional<double> value;
            for (const Row& row : family.rows)
                if (row.case_name == subject.name && row.algorithm == algorithm.name)
                    value = worse(value, row.values[metric]);
            any = any || value;
            line += padded(cell(value), column(heading(algorithm.name)));
        }
        if (any) out << line << '\n';
    }
    print_worst(out, family, metric);
    out << '\n';
}

bool lacks_value(const Row& row)
{
    return std::any_of(row.values.begin(), row.values.end(),
                       [](const auto& value) { return !value; });
}

void print_labels(std::ostream& out, const char* title, const std::vector<Label>& labels)
{
    out << title << '\n';
    std::size_t column = 0;
    for (const Label& label : labels) column = std::max(column, label.name.size());
    for (const Label& label : labels) {
        std::string name = label.name;
        name.resize(column + 2, ' ');
        out << "  " << name << label.what << '\n';
    }
    out << '\n';
}

}  // namespace

Json json_of(const std::vector<Family>& families)
{
    Json result;
    result["families"] = Json::array();
    result["rows"] = Json::array();
    for (const Family& family : families) {
        result["families"].push_back({{"name", family.label.name},
                                      {"what", family.label.what},
                                      {"metrics", labels(family.metrics)},
                                      {"cases", labels(family.cases)},
                                      {"algorithms", labels(family.algorithms)}});
        for (const Row& row : family.rows) {
            Json values;
            for (std::size_t i = 0; i < family.metrics.size(); ++i) {
                const std::optional<double>& value = row.values[i];
                values[family.metrics[i].name] =
                    value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
            }
            const std::string worst =
                row.worst.empty() ? "" : family.metrics[row.worst_metric].name + ": " + row.worst;
            result["rows"].push_back({{"family", family.label.name},
                                      {"case", row.case_name},
                                      {"algorithm", row.algorithm},
                                      {"parameters", row.parameters},
                                      {"metrics", values},
                                      {"worst", worst}});
        }
    }
    return result;
}

void print_tables(std::ostream& out, const std::vector<Family>& families)
{
    for (const Family& family : families) {
        out << family.label.name << ": " << family.label.what << "\n\n";
        print_labels(out, "cases", family.cases);
        print_labels(out, "algorithms", family.algorithms);
        if (std::any_of(family.rows.begin(), family.rows.end(), lacks_value))
            out << "A dash stands where there is no such output, or its type cannot hold the exact "
                   "value.\n\n";
        for (std::size_t metric = 0; metric < family.metrics.size(); ++metric)
            print_metric(out, family, metric);
    }
}

std::vector<Family> run(const Options& options)
{
    return {depth_filters(options), watertightness(),     self_hits(),      falloffs(),
            ray_scales(),           surface_obscurance(), surface_slices(), surface_height_field(),
            surface_blur(),         surface_upsampling(), information()};
}

}  // namespace stability
