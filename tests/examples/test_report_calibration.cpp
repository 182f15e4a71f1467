#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <vector>

#include <doctest/doctest.h>

#include <report/calibration_search.hpp>
#include <report/calibration_spaces.hpp>
#include <scenes/scenes.hpp>

namespace {

using report::Axis, report::AxisKind, report::Candidate, report::Setting;

/// Two axes that cost time and three to search.
std::vector<Axis> some_axes()
{
    return {{"samples", AxisKind::quality, 4, {2, 4, 8}},
            {"pattern", AxisKind::costly, 0, {0, 1}, {"row", "pixel"}},
            {"intensity", AxisKind::free, 0, {-3, -2, -1, 0, 1, 2, 3}},
            {"radius", AxisKind::free, 0, {-3, -2, -1, 0, 1, 2, 3}},
            {"epsilon", AxisKind::free, 1, {0, 1, 2}}};
}

}  // namespace

TEST_CASE("searches start from every combination of what costs time")
{
    const auto axes = some_axes();
    CHECK(report::starts(axes, false) ==
          std::vector<Setting>{{2, 0, 0, 0, 1}, {4, 0, 0, 0, 1}, {8, 0, 0, 0, 1}});
    CHECK(report::starts(axes, true) == std::vector<Setting>{{2, 0, 0, 0, 1},
                                                             {2, 1, 0, 0, 1},
                                                             {4, 0, 0, 0, 1},
                                                             {4, 1, 0, 0, 1},
                                                             {8, 0, 0, 0, 1},
                                                             {8, 1, 0, 0, 1}});
    CHECK(report::starts({}, true) == std::vector<Setting>{{}});
}

TEST_CASE("a search finds the least error and leaves alone what costs time")
{
    std::set<Setting> asked;
    const auto error = [&](const Setting& s) {
        CHECK(asked.insert(s).second);  // never twice
        CHECK(s[0] == 8);
        CHECK(s[1] == 1);
        return 0.1 + std::pow(s[2] + 2, 2) + std::pow(s[3] - 1, 2) + std::pow(s[4] - 2, 2);
    };
    const Candidate found = report::tune(some_axes(), {8, 1, 0, 0, 1}, error);
    CHECK(found.setting == Setting{8, 1, -2, 1, 2});
    CHECK(found.error == 0.1);
    CHECK(asked.size() < 3 * 7 * 7);
}

TEST_CASE("a search follows a valley that no axis leads along")
{
    // Along each axis alone (0, 0) is the best.
    const auto error = [](const Setting& s) {
        return 10 + 20 * std::abs(s[2] + s[3]) - (s[2] - s[3]) + s[4];
    };
    const Candidate found = report::tune(some_axes(), {4, 0, 0, 0, 1}, error);
    CHECK(found.setting == Setting{4, 0, 3, -3, 0});
    CHECK(found.error == 4);
}

TEST_CASE("a search stays where it starts when nothing is better, or nothing can be changed")
{
    const auto flat = [](const Setting&) { return 0.25; };
    CHECK(report::tune(some_axes(), {2, 1, 3, -3, 0}, flat).setting == Setting{2, 1, 3, -3, 0});
    int calls = 0;
    const auto count = [&](const Setting&) { return double(++calls); };
    const std::vector<Axis> fixed{{"samples", AxisKind::quality, 4, {2, 4, 8}}};
    CHECK(report::tune(fixed, {8}, count).setting == Setting{8});
    CHECK(calls == 1);
}

TEST_CASE("only candidates that are clearly beaten are not timed")
{
    const std::vector<Candidate> all{
        {{1}, 0.30, 10},  // the quickest
        {{2}, 0.30, 12},  // no better, but about as quick
        {{3}, 0.30, 30},  // beaten
        {{4}, 0.20, 30},  // better than all that are quicker
        {{1}, 0.30, 10},  // the first again
    };
    const auto kept = report::worth_timing(all, 0.6);
    std::vector<Setting> settings;
    for (const Candidate& candidate : kept) settings.push_back(candidate.setting);
    CHECK(settings == std::vector<Setting>{{1}, {2}, {4}});
    CHECK(report::worth_timing({}, 0.6).empty());
}

TEST_CASE("the choice is the least error that the budget allows")
{
    const std::vector<Candidate> all{
        {{1}, 0.10, 81}, {{2}, 0.12, 80}, {{3}, 0.12, 60}, {{4}, 0.30, 5}};
    CHECK(report::best_within(all, 4.9) == std::nullopt);
    CHECK(report::best_within(all, 5) == 3u);
    CHECK(report::best_within(all, 59) == 3u);
    CHECK(report::best_within(all, 80) == 2u);  // of equals the quicker
    CHECK(report::best_within(all, 1000) == 0u);
    CHECK(report::best_within({}, 1000) == std::nullopt);
}

TEST_CASE("held-out views judge what was chosen, once, and choose nothing")
{
    const std::vector<Candidate> tuned{{{1}, 0.20, 4}, {{2}, 0.10, 18}, {{3}, 0.30, 18}};
    const std::vector<Candidate> standard{{{4}, 0.25, 6}, {{5}, 0.15, 21}};
    std::vector<Setting> asked;
    const auto held_out = [&](const Setting& setting) {
        asked.push_back(setting);
        return 1 / setting[0];  // the least where the search saw the most
    };
    const std::vector<double> budgets{1, 5, 10, 20, 40};
    const auto rows = report::choices(tuned, standard, budgets, held_out);
    // Nothing of the defaults within 1 and 5.
    REQUIRE(rows.size() == 3);
    for (const report::Choice& row : rows) {
        CHECK(row.tuned.time <= row.budget);
        CHECK(row.standard.time <= row.budget);
        CHECK(row.tuned.error <= row.standard.error);
    }
    CHECK(rows[0].budget == 10);
    CHECK(rows[0].tuned.setting == Setting{1});
    CHECK(rows[0].standard.setting == Setting{4});
    CHECK(rows[0].held_out_error == 1);
    CHECK(rows[0].standard_held_out_error == 0.25);
    CHECK(rows[1].tuned.setting == Setting{2});
    CHECK(rows[1].standard.setting == Setting{4});
    CHECK(rows[2].tuned.setting == Setting{2});
    CHECK(rows[2].standard.setting == Setting{5});
    CHECK(asked == std::vector<Setting>{{1}, {4}, {2}, {5}});
}

TEST_CASE("settings of the defaults stand for tuned ones that are worse or too slow")
{
    const std::vector<Candidate> tuned{{{1}, 0.30, 4}, {{2}, 0.10, 18}};
    const std::vector<Candidate> standard{{{3}, 0.25, 6}};
    const std::vector<double> budgets{10};
    const auto rows = report::choices(tuned, standard, budgets, [](const Setting&) { return 0.5; });
    REQUIRE(rows.size() == 1);
    CHECK(rows[0].tuned.setting == Setting{3});
    CHECK(rows[0].tuned.error == 0.25);
    CHECK(rows[0].held_out_error == rows[0].standard_held_out_error);
}

TEST_CASE("kernels accept every extreme of their axes, which hold the defaults")
{
    nook::ThreadExecutor threads{1};
    const scenes::Scene scene = scenes::bowl({.segments = 24});
    report::Options options;
    options.width = 40;
    options.height = 24;
    report::CalibrationView view;
    view.view = report::draw(scene, options, threads);
    view.radius = scene.radius;
    report::CalibrationMemory memory;
    memory.visibility = {options.width, options.height};
    for (const bool quick : {true, false})
        for (const report::CalibrationSpace& space : report::calibration_spaces(quick)) {
            CAPTURE(space.kernel);
            Setting least, usual, most;
            for (const Axis& axis : space.axes) {
                CAPTURE(axis.name);
                CHECK(std::count(axis.values.begin(), axis.values.end(), axis.standard) == 1);
                CHECK((axis.labels.empty() || axis.labels.size() >= axis.values.size()));
                least.push_back(axis.values.front());
                usual.push_back(axis.standard);
                most.push_back(axis.values.back());
            }
            for (const Setting& setting : {least, usual, most}) {
                CHECK(space.run(view, setting, memory));
                CHECK(std::all_of(memory.visibility.begin(), memory.visibility.end(),
                                  [](float value) { return value >= 0 && value <= 1; }));
                CHECK(std::any_of(memory.visibility.begin(), memory.visibility.end(),
                                  [](float value) { return value < 1; }));
            }
        }
}
