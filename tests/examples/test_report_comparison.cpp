#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "../../examples/report/comparison.hpp"
#include "../../examples/support/failure.hpp"
#include "../../examples/support/files.hpp"
#include "report_sample.hpp"

namespace {

using report::Json;
using namespace report_sample;

using Names = std::vector<std::string>;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

report::Comparison compare(const Json& before, const Json& now)
{
    return report::compare(before, now, {}, "old.json");
}

std::string refusal(const Json& before, const Json& now)
{
    try {
        (void)compare(before, now);
        return {};
    } catch (const support::Failure& failure) {
        return failure.what();
    }
}

std::string printed(const report::Comparison& comparison)
{
    std::ostringstream out;
    report::print(out, comparison, {});
    return out.str();
}

Json& median(Json& report, std::size_t cell, std::size_t result, std::size_t timing)
{
    return report["cells"][cell]["results"][result]["timings"][timing]["median"];
}

/// Every time of one or two threads.
void scale_times(Json& report, std::size_t timing, double factor)
{
    for (Json& cell : report["cells"])
        for (Json& result : cell["results"]) {
            Json& time = result["timings"][timing]["median"];
            time = time.get<double>() * factor;
        }
}

/// Everything that a report has below its root.
void collect(const Json& json, const Json::json_pointer& place,
             std::vector<Json::json_pointer>& places)
{
    if (!place.empty()) places.push_back(place);
    if (json.is_object())
        for (const auto& [name, value] : json.items()) collect(value, place / name, places);
    if (json.is_array())
        for (std::size_t i = 0; i < json.size(); ++i) collect(json[i], place / i, places);
}

void erase(Json& report, const Json::json_pointer& place)
{
    Json& parent = report.at(place.parent_pointer());
    if (parent.is_array()) parent.erase(std::stoul(place.back()));
    else parent.erase(place.back());
}

/// A folder of its own that goes with the test.
struct Folder {
    std::filesystem::path path = std::filesystem::temp_directory_path() /
                                 ("nook-test-" + std::to_string(std::random_device{}()));
    Folder() { std::filesystem::create_directory(path); }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

}  // namespace

// --- what got worse -------------------------------------------------------------------------------

TEST_CASE("a report compared with itself has not changed")
{
    const report::Comparison comparison = compare(good_report(), good_report());
    CHECK(comparison.worse.empty());
    CHECK(comparison.better.empty());
    CHECK(comparison.missing.empty());
    CHECK(comparison.compared == 7);
    CHECK(comparison.added == 0);
    REQUIRE(comparison.paces.size() == 2);
    CHECK(comparison.paces[1].threads == 2);
    CHECK(comparison.paces[1].ratio == 1);
    CHECK(comparison.paces[1].results == 7);
}

TEST_CASE("an error is worse when it grew by more than the tolerance")
{
    for (const char* metric : {"rmse", "fitted_rmse"}) {
        const Json before = good_report();
        Json now = before;
        Json& error = now["cells"][0]["results"][2]["error"][metric];
        const double was = error;
        error = was + 0.00049;
        CHECK(compare(before, now).worse.empty());
        error = was + 0.00051;
        const auto worse = compare(before, now).worse;
        REQUIRE(worse.size() == 1);
        CHECK(worse[0].cell == "bowl");
        CHECK(worse[0].result == "horizon-4x8");
        CHECK(worse[0].threads == 0);
        CHECK(worse[0].before == was);
        CHECK(worse[0].now == was + 0.00051);
        CHECK(worse[0].change == doctest::Approx(0.00051));
        // The other way round it is better.
        CHECK(compare(now, before).worse.empty());
        CHECK(compare(now, before).better.size() == 1);
        CHECK(report::compare(before, now, {.error = 0.001}, "").worse.empty());
    }
}

TEST_CASE("what leaving out adds to an error is worse when it grew by more than the tolerance")
{
    Json good = good_report();
    Json& results = good["cells"][0]["results"];
    results.push_back(planned(results[0]));
    Json now = good;
    now["cells"][0]["results"].back()["added_error"]["rmse"] = 0.0004;
    CHECK(compare(good, now).worse.empty());
    now["cells"][0]["results"].back()["added_error"]["rmse"] = 0.002;
    const report::Comparison comparison = compare(good, now);
    REQUIRE(comparison.worse.size() == 1);
    CHECK(comparison.worse[0].result == "alchemy-planned-16");
    CHECK(comparison.worse[0].what == "added RMSE");
    CHECK(comparison.worse[0].change == 0.002);
    CHECK(compare(now, good).better.size() == 1);
    // Where only one of the two leaves something out there is nothing to compare.
    now["cells"][0]["results"].back()["added_error"] = nullptr;
    CHECK(compare(good, now).worse.empty());
}

TEST_CASE("one time that grew is found by its number of threads")
{
    const Json before = good_report();
    Json now = before;
    median(now, 0, 3, 1) = 11 * 1.24;
    CHECK(compare(before, now).worse.empty());
    median(now, 0, 3, 1) = 11 * 1.26;
    const auto comparison = compare(before, now);
    REQUIRE(comparison.worse.size() == 1);
    CHECK(comparison.better.empty());
    CHECK(comparison.worse[0].result == "traced-16");
    CHECK(comparison.worse[0].what == "time, 2 threads");
    CHECK(comparison.worse[0].threads == 2);
    CHECK(comparison.worse[0].change == doctest::Approx(1.26));
    CHECK(report::compare(before, now, {.time = 0.3}, "").worse.empty());
    CHECK(compare(now, before).better.size() == 1);
    CHECK(compare(now, before).worse.empty());
}

TEST_CASE("times that are all twice as long, or another machine's, are not worse")
{
    const Json before = good_report();
    Json now = before;
    scale_times(now, 0, 2);
    scale_times(now, 1, 0.37);
    const auto comparison = compare(before, now);
    CHECK(comparison.worse.empty());
    CHECK(comparison.better.empty());
    REQUIRE(comparison.paces.size() == 2);
    CHECK(comparison.paces[0].ratio == doctest::Approx(2));
    CHECK(comparison.paces[1].ratio == doctest::Approx(0.37));
    CHECK(printed(comparison).find("slow-down of everything") != std::string::npos);

    // One kernel that does not keep up is found all the same.
    median(now, 1, 0, 1) = 16 * 0.37 * 1.5;
    REQUIRE(compare(before, now).worse.size() == 1);
    CHECK(compare(before, now).worse[0].change == doctest::Approx(1.5));
}

TEST_CASE("times within what clocks do are let pass, unless that is asked for")
{
    Json before = good_report();
    median(before, 0, 0, 0) = 0.02;
    Json now = before;
    median(now, 0, 0, 0) = 0.06;
    CHECK(compare(before, now).worse.empty());
    CHECK(report::compare(before, now, {.least_time = 0}, "").worse.size() == 1);
    median(now, 0, 0, 0) = 0.08;
    CHECK(compare(before, now).worse.size() == 1);
    median(now, 0, 0, 0) = 0.0;
    CHECK(compare(before, now).paces[0].results == 6);
}

TEST_CASE("changes are sorted: errors first, then times, the largest first")
{
    const Json before = good_report();
    Json now = before;
    median(now, 0, 1, 0) = 1.7 * 2;
    median(now, 0, 2, 0) = 5.1 * 3;
    now["cells"][0]["results"][0]["error"]["rmse"] = 0.1;
    now["cells"][1]["results"][1]["error"]["fitted_rmse"] = 0.1;
    const auto comparison = compare(before, now);
    Names order;
    for (const auto& change : comparison.worse) order.push_back(change.result);
    CHECK(order == Names{"traced-256", "alchemy-16", "horizon-4x8", "horizon-3x3"});
    const std::string text = printed(comparison);
    CHECK(text.find("worse: 4\n") == 0);
    CHECK(text.find("0.09000 -> 0.10000 (+0.01000)") != std::string::npos);
    CHECK(text.find("5.1 -> 15.3 ms (x 3 relative)") != std::string::npos);
    CHECK(text.find(
              "7 results compared: 4 changes for the worse, 0 for the better; 0 missing, 0 new") !=
          std::string::npos);
}

TEST_CASE("results and cells that are gone are named, and new ones are counted")
{
    const Json before = good_report();
    Json now = before;
    now["cells"][0]["results"].erase(2);
    now["cells"][1]["id"] = "cup";
    const auto comparison = compare(before, now);
    CHECK(comparison.missing ==
          Names{"bowl, horizon-4x8", "cup-unlimited, traced-16", "cup-unlimited, traced-256"});
    CHECK(comparison.compared == 4);
    CHECK(comparison.added == 2);
    CHECK(comparison.worse.empty());
    CHECK(printed(comparison).find("bowl, horizon-4x8\n") != std::string::npos);
    // The order of cells and results does not matter.
    Json turned = before;
    std::reverse(turned["cells"].begin(), turned["cells"].end());
    for (Json& cell : turned["cells"]) std::reverse(cell["results"].begin(), cell["results"].end());
    CHECK(compare(before, turned).compared == 7);
    CHECK(compare(before, turned).worse.empty());
}

TEST_CASE("reports with nothing in common have nothing worse")
{
    const Json before = good_report();
    Json now = before;
    now["cells"] = Json::array();
    CHECK(compare(before, now).missing.size() == 7);
    CHECK(compare(now, before).added == 7);
    CHECK(printed(compare(before, now)).find("no times to compare") != std::string::npos);
    // Nor do times of other numbers of threads.
    now = before;
    for (Json& cell : now["cells"])
        for (Json& result : cell["results"]) result["timings"][1]["threads"] = 16;
    const auto comparison = compare(before, now);
    CHECK(comparison.paces.size() == 1);
    CHECK(comparison.worse.empty());
}

// --- what cannot be compared ----------------------------------------------------------------------

TEST_CASE("reports of another format, size or reference are refused by member and value")
{
    const Json good = good_report();
    const auto refused = [&](const char* place, const Json& value, const std::string& text) {
        Json other = good;
        other[Json::json_pointer{place}] = value;
        CHECK(refusal(other, good) == text);
    };
    refused("/format", 2, "old.json: format is 2, and 3 in the new report");
    refused("/run/width", 640, "old.json: run.width is 640, and 320 in the new report");
    refused("/run/height", 360, "old.json: run.height is 360, and 180 in the new report");
    refused("/run/directions", 2048, "old.json: run.directions is 2048, and 512 in the new report");
    refused("/cells/0/radius", 0.6,
            "old.json: cells[bowl].radius is 0.6, and 0.3 in the new report");
    refused("/cells/0/radius", nullptr,
            "old.json: cells[bowl].radius is null, and 0.3 in the new report");
    refused(
        "/cells/0/references/0/directions", 64,
        "old.json: cells[bowl].references[visibility].directions is 64, and 512 in the new report");
    refused(
        "/cells/0/results/1/meaning", "obscurance",
        "old.json: cells[bowl].results[horizon-3x3].meaning is \"obscurance\", and \"visibility\" "
        "in the new report");
    // The last bit of a radius does not count.
    refused("/cells/0/radius", 0.1 + 0.2, "");

    Json other = good;
    other["format"] = 4;
    CHECK(refusal(good, other) == "the new report: format is 4, not 3");
    other.erase("format");
    CHECK(refusal(other, good) == "old.json: format is missing");
    other = good;
    other["cells"][1]["id"] = "bowl";
    CHECK(refusal(other, good) == "old.json: cells[1].id is there twice: \"bowl\"");
    other = good;
    other["cells"][0]["results"][1]["timings"][1]["threads"] = 1;
    CHECK(refusal(good, other) ==
          "the new report: cells[bowl].results[horizon-3x3].timings[1].threads is there twice: 1");
}

TEST_CASE("an old report that will not do is refused before the run")
{
    Json old = good_report();
    Json now = old;
    for (Json& cell : now["cells"]) cell["references"] = cell["results"] = Json::array();
    CHECK_NOTHROW(report::check_old_report(old, now, "old.json"));
    const auto refused = [&](const char* place, const Json& value, const char* why) {
        Json changed = now;
        changed[Json::json_pointer{place}] = value;
        CHECK_THROWS_WITH_AS(report::check_old_report(old, changed, "old.json"), why,
                             support::Failure);
    };
    refused("/run/height", 181, "old.json: run.height is 180, and 181 in the new report");
    refused("/run/quick", false, "old.json: run.quick is true, and false in the new report");
    refused("/cells/0/triangles", 7,
            "old.json: cells[bowl].triangles is 1234, and 7 in the new report");
    refused("/cells/0/camera/9", 1,
            "old.json: cells[bowl].camera is another than in the new report");
    old["cells"][1]["results"][0]["error"].erase("rmse");
    refused("/run/width", 320,
            "old.json: cells[cup-unlimited].results[traced-16].error.rmse is missing");
}

TEST_CASE("what the comparison reads is refused when it is missing or of another kind")
{
    Json good = good_report();
    Json& results = good["cells"][0]["results"];
    results.insert(results.begin() + 1, planned(results[0]));
    struct Bad {
        const char* place;
        const char* name;   ///< as the message has it
        const char* value;  ///< no good there
    };
    const std::vector<Bad> members{
        {"/format", "format", "-1"},
        {"/run", "run", "0"},
        {"/run/width", "run.width", "320.5"},
        {"/run/directions", "run.directions", "18446744073709551615"},
        {"/cells", "cells", "{}"},
        {"/cells/0/id", "cells[0].id", "[]"},
        {"/cells/0/radius", "cells[bowl].radius", "\"0.3\""},
        {"/cells/0/references", "cells[bowl].references", "{}"},
        {"/cells/0/references/0/meaning", "cells[bowl].references[0].meaning", "1"},
        {"/cells/0/references/0/directions", "cells[bowl].references[visibility].directions", "-2"},
        {"/cells/0/results", "cells[bowl].results", "\"\""},
        {"/cells/0/results/0/id", "cells[bowl].results[0].id", "16"},
        {"/cells/0/results/0/meaning", "cells[bowl].results[alchemy-16].meaning", "0"},
        {"/cells/0/results/0/error", "cells[bowl].results[alchemy-16].error", "[]"},
        {"/cells/0/results/0/error/rmse", "cells[bowl].results[alchemy-16].error.rmse", "null"},
        {"/cells/0/results/0/error/rmse", "cells[bowl].results[alchemy-16].error.rmse", "-0.1"},
        {"/cells/0/results/0/error/fitted_rmse",
         "cells[bowl].results[alchemy-16].error.fitted_rmse", "null"},
        {"/cells/0/results/0/added_error", "cells[bowl].results[alchemy-16].added_error", "[]"},
        {"/cells/0/results/1/added_error/rmse",
         "cells[bowl].results[alchemy-planned-16].added_error.rmse", "-0.1"},
        {"/cells/0/results/0/timings", "cells[bowl].results[alchemy-16].timings", "null"},
        {"/cells/0/results/0/timings/1/threads",
         "cells[bowl].results[alchemy-16].timings[1].threads", "0"},
        {"/cells/0/results/0/timings/1/median", "cells[bowl].results[alchemy-16].timings[1].median",
         "true"}};
    for (const Bad& member : members) {
        CAPTURE(member.place);
        Json bad = good;
        bad.at(Json::json_pointer{member.place}) = Json::parse(member.value);
        CHECK(refusal(bad, good).find(std::string{"old.json: "} + member.name + ' ') == 0);
        CHECK(refusal(good, bad).find(std::string{"the new report: "} + member.name + ' ') == 0);
        bad = good;
        erase(bad, Json::json_pointer{member.place});
        CHECK(refusal(bad, good) == std::string{"old.json: "} + member.name + " is missing");
    }
    for (const double value : {not_a_number, infinity, -infinity}) {
        Json bad = good;
        bad["cells"][0]["results"][0]["error"]["rmse"] = value;
        CHECK(refusal(good, bad).find("alchemy-16].error.rmse is not a number from 0") !=
              std::string::npos);
    }
    for (const char* text : {"null", "[]", "2", "\"report\"", "{}"})
        CHECK(!refusal(Json::parse(text), good).empty());
}

TEST_CASE(
    "whatever is taken out of a report or put in its place, the answer is a result or a refusal")
{
    Json good = good_report();
    good["cells"][0]["results"].erase(4);
    good["cells"][0]["results"].erase(1);
    std::vector<Json::json_pointer> places;
    collect(good, Json::json_pointer{}, places);
    const std::vector<Json> replacements{nullptr,
                                         true,
                                         -1,
                                         0,
                                         1e300,
                                         not_a_number,
                                         infinity,
                                         "text",
                                         "\xff\n\x01",
                                         Json::array(),
                                         Json::array({1, {}}),
                                         Json::object(),
                                         std::numeric_limits<std::uint64_t>::max(),
                                         std::numeric_limits<std::int64_t>::min()};
    std::size_t refused = 0, compared = 0;
    const auto check = [&](const Json& bad) {
        for (const bool old : {true, false}) {
            const std::string why = old ? refusal(bad, good) : refusal(good, bad);
            if (why.empty()) {
                const Json& before = old ? bad : good;
                const auto comparison = compare(before, old ? good : bad);
                const std::string text = printed(comparison);
                REQUIRE(!text.empty());
                REQUIRE(std::all_of(text.begin(), text.end(),
                                    [](char c) { return (c >= ' ' && c <= '~') || c == '\n'; }));
                ++compared;
                continue;
            }
            const std::string start = old ? "old.json: " : "the new report: ";
            // A difference is laid to the old report.
            const bool named = why.starts_with(start) || why.starts_with("old.json: ");
            const bool one_line =
                std::all_of(why.begin(), why.end(), [](char c) { return c >= ' ' && c <= '~'; });
            REQUIRE_MESSAGE(named, why);
            REQUIRE_MESSAGE(one_line, why);
            ++refused;
        }
    };
    for (const Json::json_pointer& place : places) {
        CAPTURE(place.to_string());
        Json bad = good;
        erase(bad, place);
        check(bad);
        for (const Json& replacement : replacements) {
            bad = good;
            bad.at(place) = replacement;
            check(bad);
        }
    }
    // Most of a report is not read.
    CHECK(refused > 1000);
    CHECK(compared > 1000);
}

TEST_CASE("a file that is missing, cut off or no JSON is refused by name")
{
    const Folder folder;
    const auto path = folder.path / "old.json";
    const auto why = [&](const std::string& bytes) {
        support::write_file(path, bytes);
        try {
            (void)report::load_report(path);
            return std::string{};
        } catch (const support::Failure& failure) {
            return std::string{failure.what()};
        }
    };
    CHECK_THROWS_AS((void)report::load_report(path), support::Failure);
    CHECK_THROWS_AS((void)report::load_report(folder.path), support::Failure);
    const std::string text = good_report().dump(1);
    CHECK(why(text).empty());
    CHECK(report::load_report(path) == good_report());
    for (std::size_t size = 0; size < text.size(); size += 97)
        CHECK(why(text.substr(0, size)).find(path.string() + ": is no JSON from byte ") == 0);
    CHECK(why("{} {}") == path.string() + ": is no JSON from byte 4 on");
    // Too large for a double: -ffast-math lets it pass as an infinity, which the comparison finds.
    std::string large = text;
    large.replace(large.find("\"rmse\": 0.09") + 8, 4, "1e999");
    if (const std::string refused = why(large); !refused.empty())
        CHECK(refused == path.string() + ": holds a number that is too large");
    else CHECK(!refusal(report::load_report(path), good_report()).empty());
    CHECK(why("{\"a\": NaN}").find("is no JSON") != std::string::npos);
    CHECK(why("\"\xff\"").find("is no JSON") != std::string::npos);
    CHECK(why(std::string(100000, '[')).find("is no JSON") != std::string::npos);
    // As deep as may be: read, and refused by the comparison.
    CHECK(why(std::string(100000, '[') + std::string(100000, ']')).empty());
    CHECK(refusal(report::load_report(path), good_report()) == "old.json: is not an object");
}
