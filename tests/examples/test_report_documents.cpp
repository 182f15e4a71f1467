#include <doctest/doctest.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "../../examples/report/document.hpp"
#include "report_sample.hpp"

namespace {

using report::Json;
using namespace report_sample;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// The results on the front with so many threads, in the order of the cell.
std::vector<std::string> front(const Json& cell, int threads = 1)
{
    std::vector<std::string> ids;
    for (const Json& result : cell.at("results"))
        for (const Json& count : result.at("pareto"))
            if (count == threads) ids.push_back(result.at("id"));
    return ids;
}

using Names = std::vector<std::string>;

// --- a reader of comma-separated values, as strict as RFC 4180 ------------------------------------

using Rows = std::vector<std::vector<std::string>>;

Rows parse_csv(std::string_view text)
{
    Rows rows{{}};
    while (!text.empty()) {
        std::string field;
        if (text.front() == '"') {
            for (text.remove_prefix(1);; text.remove_prefix(1)) {
                REQUIRE(!text.empty());
                if (text.front() == '"') {
                    text.remove_prefix(1);
                    if (text.empty() || text.front() != '"') break;
                }
                field += text.front();
            }
        } else {
            const std::size_t end = text.find_first_of(",\"\r\n");
            field = text.substr(0, end);
            text.remove_prefix(field.size());
        }
        rows.back().push_back(field);
        REQUIRE(!text.empty());
        if (text.front() == ',') {
            text.remove_prefix(1);
            continue;
        }
        REQUIRE(text.substr(0, 2) == "\r\n");
        text.remove_prefix(2);
        rows.emplace_back();
    }
    rows.pop_back();
    return rows;
}

/// The fields of a line by the names of their columns.
std::vector<std::map<std::string, std::string>> lines_of(const Json& report)
{
    const Rows rows = parse_csv(report::csv_of(report));
    std::vector<std::map<std::string, std::string>> lines;
    for (std::size_t i = 1; i < rows.size(); ++i) {
        REQUIRE(rows[i].size() == rows[0].size());
        auto& line = lines.emplace_back();
        for (std::size_t j = 0; j < rows[i].size(); ++j)
            REQUIRE(line.emplace(rows[0][j], rows[i][j]).second);
    }
    return lines;
}

double number(const std::string& text)
{
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    REQUIRE(error == std::errc{});
    REQUIRE(end == text.data() + text.size());
    return value;
}

}  // namespace

// --- the front ------------------------------------------------------------------------------------

TEST_CASE("the front holds what nothing else beats in both time and error")
{
    Json bowl = cell("bowl", 0.3,
                     {result("slow-close", 9, 1, 0.01), result("fast-wrong", 1, 9, 0.2),
                      result("beaten", 5, 5, 0.3), result("between", 4, 4, 0.1)});
    report::mark_pareto(bowl);
    CHECK(front(bowl, 1) == Names{"slow-close", "fast-wrong", "between"});
    // With two threads the closest one is the fastest.
    CHECK(front(bowl, 2) == Names{"slow-close"});
    CHECK(bowl["results"][0]["pareto"] == Json{1, 2});
    CHECK(bowl["results"][2]["pareto"] == Json::array());
}

TEST_CASE("equals stay on the front together, and half a tie loses")
{
    Json bowl = cell("bowl", 0.3,
                     {result("twin-a", 2, 2, 0.1), result("same-time", 2, 2, 0.11),
                      result("twin-b", 2, 2, 0.1), result("same-error", 2.5, 2.5, 0.1)});
    report::mark_pareto(bowl);
    CHECK(front(bowl) == Names{"twin-a", "twin-b"});
}

TEST_CASE("only results of the same meaning are rivals")
{
    Json bowl = cell("bowl", 0.3, {result("a", 1, 1, 0.01), result("b", 2, 2, 0.02)});
    bowl["results"][1]["meaning"] = "obscurance";
    report::mark_pareto(bowl);
    CHECK(front(bowl) == Names{"a", "b"});
}

TEST_CASE(
    "slow results and those with rows left out neither stand on the front nor keep others off")
{
    Json bowl =
        cell("bowl", 0.3,
             {result("slow", 1, 1, 0.01), result("rows", 1, 1, 0.01), result("whole", 2, 2, 0.02)});
    bowl["results"][0]["slow"] = true;
    bowl["results"][1]["row_step"] = 2;
    for (Json& result : bowl["results"]) result["pareto"] = {1, 2, 3};
    report::mark_pareto(bowl);
    CHECK(front(bowl) == Names{"whole"});
    CHECK(front(bowl, 3).empty());
}

TEST_CASE(
    "a result that was not timed with so many threads has no place there, and no results no front")
{
    Json bowl = cell("bowl", 0.3, {result("a", 1, 1, 0.01), result("b", 2, 2, 0.02)});
    bowl["results"][0]["timings"].erase(0);
    report::mark_pareto(bowl);
    CHECK(front(bowl, 1) == Names{"b"});
    CHECK(front(bowl, 2) == Names{"a"});
    Json none = cell("bowl", 0.3, {});
    none["results"] = Json::array();
    report::mark_pareto(none);
    CHECK(none["results"].empty());
}

TEST_CASE("the front is that of comparing all pairs, with many ties")
{
    std::mt19937 random{7};
    const auto below = [&random](unsigned count) { return static_cast<int>(random() % count); };
    for (int round = 0; round < 30; ++round) {
        std::vector<Json> results;
        for (int i = below(12); i >= 0; --i)
            results.push_back(
                result('r' + std::to_string(i), 1 + below(5), 1 + below(3), below(5) / 8.0));
        Json bowl = cell("bowl", 0.3, results);
        report::mark_pareto(bowl);
        for (std::size_t timing = 0; timing < 2; ++timing) {
            const auto point = [&](const Json& r) {
                return std::pair{r["timings"][timing]["median"].get<double>(),
                                 r["error"]["rmse"].get<double>()};
            };
            Names expected;
            for (const Json& a : results) {
                const auto [time, error] = point(a);
                bool beaten = false;
                for (const Json& b : results)
                    beaten = beaten || (point(b).first <= time && point(b).second <= error &&
                                        point(b) != point(a));
                if (!beaten) expected.push_back(a["id"]);
            }
            CHECK(front(bowl, int(timing) + 1) == expected);
        }
    }
}

// --- comma-separated values -----------------------------------------------------------------------

TEST_CASE("the file of comma-separated values has one line per cell, result and number of threads")
{
    Json good = good_report();
    good["cells"][0]["results"][1]["timings"].erase(1);
    const auto lines = lines_of(good);
    REQUIRE(lines.size() == 13);
    std::size_t i = 0;
    for (const Json& cell : good["cells"])
        for (const Json& result : cell["results"])
            for (const Json& timing : result["timings"]) {
                CHECK(lines[i].at("cell") == cell["id"]);
                CHECK(lines[i].at("result") == result["id"]);
                CHECK(lines[i].at("threads") == timing["threads"].dump());
                ++i;
            }
}

TEST_CASE("numbers of comma-separated values come back to the last bit")
{
    Json good = good_report();
    std::mt19937_64 random{11};
    std::uniform_real_distribution<double> uniform{0, 1};
    for (Json& cell : good["cells"])
        for (Json& result : cell["results"]) {
            for (Json& value : result["error"])
                if (value.is_number_float()) value = uniform(random) * 1e-5;
            for (Json& timing : result["timings"]) timing["median"] = uniform(random) / 3;
        }
    good["cells"][0]["results"][0]["error"]["rmse"] = std::numeric_limits<double>::denorm_min();
    good["cells"][0]["results"][1]["error"]["rmse"] = std::numeric_limits<double>::max();
    const auto lines = lines_of(good);
    std::size_t i = 0;
    for (const Json& cell : good["cells"])
        for (const Json& result : cell["results"])
            for (const Json& timing : result["timings"]) {
                const auto& line = lines[i++];
                CHECK(number(line.at("median_ms")) == timing["median"].get<double>());
                CHECK(number(line.at("min_ms")) == timing["min"].get<double>());
                for (const char* member : {"rmse", "mae", "bias", "p99", "max", "pixels", "ssim",
                                           "fitted_rmse", "rank_correlation"})
                    CHECK(number(line.at(std::string{"error_"} + member)) ==
                          result["error"][member].get<double>());
                for (const char* term : {"height_field_error", "estimator_error"})
                    for (const char* member : {"rmse", "mae", "bias", "p99", "max", "pixels"})
                        CHECK(number(line.at(std::string{term} + '_' + member)) ==
                              result[term][member].get<double>());
                for (const auto& [name, value] : result["work"].items())
                    CHECK(line.at("work_" + name) == value.dump());
                CHECK(number(line.at("background_share")) == 1.0 / 3);
                CHECK(number(line.at("unknown_error_rmse")) == 0.05);
                CHECK(number(line.at("reference_standard_error")) == 0.003);
            }
}

TEST_CASE("names with commas, quotes and line ends come back, and nested values as JSON")
{
    Json good = good_report();
    report::mark_pareto(good["cells"][0]);
    const auto lines = lines_of(good);
    CHECK(lines[0].at("setting") == "3 x 3, \"wide\",\nblurred");
    CHECK(Json::parse(lines[0].at("parameters")) == good["cells"][0]["results"][0]["parameters"]);
    CHECK(Json::parse(lines[1].at("passes_ms")) ==
          good["cells"][0]["results"][0]["timings"][1]["passes"]);
    CHECK(lines[0].at("family") == "surface");
    CHECK(lines[0].at("comparable") == "false");
    CHECK(lines[0].at("pareto") == "true");
    // traced-16 is slower and farther from the scene than both forms of horizon.
    CHECK(lines[6].at("result") == "traced-16");
    CHECK(lines[6].at("pareto") == "false");
    CHECK(lines[6].at("slope") == "-0.72");
    CHECK(lines[0].at("slope").empty());
}

TEST_CASE("what does not apply is an empty field, and so is what is no number")
{
    Json good = good_report();
    good["cells"][1]["height_field"] = nullptr;
    good["cells"][1]["results"][0]["error"]["rmse"] = not_a_number;
    good["cells"][1]["results"][0]["error"]["bias"] = -infinity;
    const auto line = lines_of(good)[10];
    CHECK(line.at("cell") == "cup-unlimited");
    for (const char* name : {"radius", "radius_factor", "own_error_rmse", "height_field_slices",
                             "unknown_error_rmse", "without", "error_rmse", "error_bias"})
        CHECK_MESSAGE(line.at(name).empty(), name);
    CHECK(!line.at("error_mae").empty());
}

TEST_CASE("what was left out stands in columns, with the time of the result that does the same")
{
    Json good = good_report();
    Json& results = good["cells"][0]["results"];
    results.insert(results.begin() + 1, planned(results[0]));
    const auto lines = lines_of(good);
    for (const std::size_t threads : {std::size_t{1}, std::size_t{2}}) {
        const auto& line = lines[1 + threads];
        CAPTURE(threads);
        CHECK(line.at("result") == "alchemy-planned-16");
        CHECK(line.at("without") == "alchemy-16");
        CHECK(number(line.at("without_ms")) == (threads == 1 ? 0.8 : 0.41));
        CHECK(number(line.at("median_ms")) == number(line.at("without_ms")) / 2);
        CHECK(number(line.at("plan_ms")) == 0.1 * number(line.at("without_ms")));
        CHECK(line.at("time_ratio") == "0.5");
        CHECK(line.at("added_error_changed") == "0");
        CHECK(number(line.at("added_error_rmse")) == 0);
        CHECK(line.at("added_error_pixels") == "41234");
        CHECK(number(line.at("added_error_rmse_change")) == 0);
        CHECK(line.at("plan_kind") == "surface");
        CHECK(number(line.at("plan_tolerance")) == 0);
        CHECK(line.at("plan_background_groups") == "1200");
        CHECK(line.at("plan_inactive_groups") == "800");
        CHECK(line.at("plan_active_groups") == "1600");
        CHECK(line.at("work_skipped_samples") == "6");
        CHECK(line.at("work_skipped_passes") == "1");
    }
    for (const char* name : {"without_ms", "plan_ms", "time_ratio", "added_error_rmse",
                             "added_error_changed", "plan_kind", "plan_tolerance"})
        CHECK_MESSAGE(lines[0].at(name).empty(), name);
    // A result that is not there, or was not timed with so many threads.
    results[1]["without"] = "gone";
    CHECK(lines_of(good)[2].at("without_ms").empty());
    results[1]["without"] = "alchemy-16";
    results[0]["timings"].erase(1);
    CHECK(!lines_of(good)[1].at("without_ms").empty());
    CHECK(lines_of(good)[2].at("without_ms").empty());
}

TEST_CASE("columns are the same whatever a report holds")
{
    Json other = good_report();
    other["cells"].erase(0);
    other["cells"][0]["height_field"] = nullptr;
    CHECK(parse_csv(report::csv_of(good_report()))[0] == parse_csv(report::csv_of(other))[0]);
    other["cells"] = Json::array();
    const Rows rows = parse_csv(report::csv_of(other));
    REQUIRE(rows.size() == 1);
    CHECK(rows[0].front() == "cell");
}

// --- the table ------------------------------------------------------------------------------------

namespace {

std::vector<std::string> table_of(Json report)
{
    for (Json& cell : report["cells"]) report::mark_pareto(cell);
    std::ostringstream out;
    report::print_table(out, report);
    std::vector<std::string> lines;
    std::istringstream in{out.str()};
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

std::size_t count(const std::vector<std::string>& lines, std::string_view text)
{
    return std::size_t(std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
        return line.find(text) != std::string::npos;
    }));
}

}  // namespace

TEST_CASE("the table shows the front and the defaults, and fits into 100 columns")
{
    Json good = good_report();
    good["cells"][0]["results"][3]["default"] = true;
    good["cells"][0]["what"] =
        "a bowl with a name that goes on and on, half a metre × half a metre, "
        "of a material that nobody has seen, looked at from above";
    good["cells"][0]["results"][4]["id"] = "traced-obscurance-secondary-256";
    good["cells"][0]["results"][4]["error"]["ssim"] = -0.123;
    good["cells"][0]["results"][4]["error"]["rank_correlation"] = -0.5;
    good["cells"][0]["results"][4]["own_error"] = differences(1.25e-7);
    const auto lines = table_of(good);
    for (const std::string& line : lines) {
        const auto places = std::count_if(line.begin(), line.end(), [](char c) {
            return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
        });
        CHECK_MESSAGE(places <= 100, line);
    }
    CHECK(count(lines, " * ~alchemy-16 ") == 1);
    CHECK(count(lines, " *  horizon-3x3 ") == 1);
    CHECK(count(lines, "  d traced-16 ") == 1);
    good["cells"][0]["results"][3]["default"] = false;
    CHECK(count(table_of(good), "  d traced-16 ") == 0);
    CHECK(count(lines, "unlimited radius") == 1);
}

TEST_CASE("the table tells what was left out, what that saved and changed, and what planning costs")
{
    Json good = good_report();
    Json& results = good["cells"][0]["results"];
    CHECK(count(table_of(good), "planning") == 0);
    results.insert(results.begin() + 1, planned(results[0]));
    Json& work = results[1]["work"];
    work = {{"pixels", 57600},        {"background", 7600}, {"skipped", 12500},  {"samples", 300},
            {"skipped_samples", 100}, {"rays", 0},          {"skipped_rays", 0}, {"passes", 2},
            {"skipped_passes", 0}};
    auto lines = table_of(good);
    CHECK(count(lines,
                "    alchemy-planned-16   0.400  0.080   0.800  2.00  25.0  25.0 0.00000 0.00000 "
                "      0") == 1);
    CHECK(count(lines, "    planning where nothing is left out costs 10.0 % of alchemy-16") == 1);
    // One that changes the picture, of a long name.
    results[1]["id"] = "traced-secondary-planned-256";
    results[1]["plan"]["tolerance"] = 0.01;
    results[1]["added_error"]["rmse"] = 0.00123;
    results[1]["added_error"]["max"] = 0.01;
    results[1]["added_error"]["changed"] = 9999999;
    lines = table_of(good);
    CHECK(count(lines, " 0.00123 0.01000 9999999") == 1);
    CHECK(count(lines, "planning where") == 0);
    for (const std::string& line : lines) CHECK_MESSAGE(line.size() <= 100, line);
    // A default that leaves something out by itself has nothing to be held against.
    results.erase(1);
    results[0]["default"] = true;
    CHECK(count(table_of(good), "    alchemy-16   0.800      -       -     -   0.0  66.7") == 1);
}

TEST_CASE("the table ends with the fastest kernel of each cell that is close enough to the scene")
{
    const auto lines = table_of(good_report());
    CHECK(count(lines, "bowl           alchemy-16   horizon-4x8   traced-256") == 1);
    CHECK(count(lines, "cup-unlimited  traced-256   traced-256    traced-256") == 1);
    CHECK(count(lines, "  RMSE <= 0.1: alchemy 1, traced 1") == 1);
    CHECK(count(lines, "  RMSE <= 0.02: traced 2") == 1);
    CHECK(count(lines, "  fitted <= 0.05: alchemy 1, traced 1") == 1);
}

TEST_CASE("a cell of sky alone is won by nobody, and one without close results says so")
{
    Json good = good_report();
    for (Json& result : good["cells"][0]["results"]) result["error"]["pixels"] = 0;
    good["cells"][1]["results"].erase(1);
    const auto lines = table_of(good);
    CHECK(count(lines, "  cup-unlimited  -") == 1);
    CHECK(count(lines, "  RMSE <= 0.1: none 1") == 1);
    CHECK(count(lines, "  bowl ") == 0);
}
