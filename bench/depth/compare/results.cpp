#include "results.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>

#include <nlohmann/json.hpp>

#include <nook/version.hpp>

#include "failure.hpp"
#include "kernels.hpp"
#include "opencv.hpp"
#include "support/machine.hpp"

namespace compare {

namespace {

using Json = nlohmann::ordered_json;

std::string digits(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, value < 1 ? "%.3f" : "%.2f", value);
    return text;
}

/// Characters on screen: all but the later bytes of UTF-8.
std::size_t columns(const std::string& text)
{
    return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
        return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
    }));
}

Json json_of(const Summary& summary)
{
    return {{"median", summary.median},
            {"lower_quartile", summary.lower},
            {"upper_quartile", summary.upper}};
}

Json machine(const Options& options)
{
    Json result;
    result["nook"] = nook::version;
    result["cpu"] = support::cpu_name();
    result["compiler"] = support::compiler_name();
    result["instruction_set"] = targets().best().name;
    const std::string opencv = opencv_version();
    result["opencv"] = opencv.empty() ? "not found" : opencv;
    result["rounds"] = options.rounds;
    result["quick"] = options.quick;
    return result;
}

}  // namespace

const char* text_of(Verdict verdict)
{
    switch (verdict) {
    case Verdict::stretch: return "met, stretch too";
    case Verdict::met: return "met";
    case Verdict::within_slack: return "met within 15 %";
    case Verdict::missed: return "NOT MET";
    case Verdict::not_measured: break;
    }
    return "not measured";
}

Verdict Mark::verdict() const
{
    if (!measured) return Verdict::not_measured;
    // Above 1: better than the goal.
    const auto margin = [&](double goal) {
        return at_least ? value.median / goal : goal / value.median;
    };
    if (stretch > 0 && margin(stretch) >= 1) return Verdict::stretch;
    if (margin(target) >= 1) return Verdict::met;
    return margin(target) * (1 + slack) >= 1 ? Verdict::within_slack : Verdict::missed;
}

void Mark::take(const Summary& candidate, const std::string& place)
{
    const bool worse = at_least ? candidate.median < value.median : candidate.median > value.median;
    if (measured && !worse) return;
    measured = true;
    value = candidate;
    where = place;
}

std::string text_of(const Summary& summary)
{
    return digits(summary.median) + " [" + digits(summary.lower) + ", " + digits(summary.upper) +
           "]";
}

void print_table(const std::vector<std::vector<std::string>>& rows)
{
    std::vector<std::size_t> widths(rows.front().size(), 0);
    for (const auto& row : rows)
        for (std::size_t i = 0; i < row.size(); ++i)
            widths[i] = (std::max)(widths[i], columns(row[i]));
    std::size_t total = 0;
    for (const std::size_t width : widths) total += width + 2;
    bool head = true;
    for (const auto& row : rows) {
        std::string line;
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::string space(widths[i] - columns(row[i]), ' ');
            line += i == 0 ? row[i] + space : "  " + space + row[i];
        }
        while (line.ends_with(' ')) line.pop_back();
        std::printf("%s\n", line.c_str());
        if (head) std::printf("%s\n", std::string(total - 2, '-').c_str());
        head = false;
    }
    std::printf("\n");
    std::fflush(stdout);
}

void print_machine(const Options& options)
{
    const Json described = machine(options);
    for (const auto& [key, value] : described.items()) {
        const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
        std::printf("%s: %s\n", key.c_str(), text.c_str());
    }
    std::printf("times: of the processor; of the wall clock where there are two threads\n\n");
}

void print_marks(const std::vector<Mark>& marks)
{
    std::vector<std::vector<std::string>> rows{
        {"mark", "measured", "worst at", "goal", "stretch", "verdict"}};
    for (const Mark& mark : marks) {
        const std::string sign = mark.at_least ? "≥ " : "≤ ";
        rows.push_back({mark.what, mark.measured ? text_of(mark.value) : "-",
                        mark.where.empty() ? "-" : mark.where, sign + digits(mark.target),
                        mark.stretch > 0 ? sign + digits(mark.stretch) : "-",
                        text_of(mark.verdict())});
    }
    print_table(rows);
}

void write_json(const Results& results, const Options& options)
{
    Json json;
    json["machine"] = machine(options);
    json["marks"] = Json::array();
    for (const Mark& mark : results.marks) {
        Json entry;
        entry["what"] = mark.what;
        entry["value"] = mark.measured ? json_of(mark.value) : Json{};
        entry["worst_at"] = mark.where;
        entry[mark.at_least ? "at_least" : "at_most"] = mark.target;
        if (mark.stretch > 0) entry["stretch"] = mark.stretch;
        entry["slack"] = slack;
        entry["verdict"] = text_of(mark.verdict());
        json["marks"].push_back(entry);
    }
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
    json["facts"] = Json::object();
    for (const Fact& fact : results.facts) json["facts"][fact.what] = fact.value;
    std::ofstream file{options.json};
    file << json.dump(2) << '\n';
    if (!file.flush()) throw Failure{options.json.string() + ": cannot be written"};
}

}  // namespace compare
