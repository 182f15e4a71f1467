#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "../../examples/report/pictures.hpp"
#include "../../examples/report/plans.hpp"
#include "../../examples/report/structures.hpp"
#include "../../examples/scenes/scenes.hpp"
#include "../../examples/support/failure.hpp"

namespace {

using nook::Image;
using report::Json;
using report::Kernel;
using report::Run;

/// 40 × 4 pixels: groups of 16, 16 and 8. The first 20 columns are background.
report::View half_a_view()
{
    report::View view;
    view.depth = {40, 4, 1.0f};
    view.normals = {120, 4, 0.0f};
    view.face = {40, 4, 0u};
    view.surface = {40, 4, 1};
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 40; ++x) {
            view.normals(3 * x + 2, y) = 1;
            if (x >= 20) continue;
            view.surface(x, y) = 0;
            ++view.background;
        }
    return view;
}

/// A run of a kernel with a plan of that tolerance.
Run run_of(const std::string& id, std::optional<double> tolerance, float value)
{
    Run run;
    run.kernel.name = run.kernel.id = id;
    run.kernel.without = "whole-1";
    run.kernel.plan = report::Plan{"surface", "plan", tolerance, [] { return nook::WorkMap{}; }};
    run.visibility = {40, 4, value};
    return run;
}

Run whole(float value)
{
    Run run;
    run.kernel.name = "whole";
    run.kernel.id = "whole-1";
    run.visibility = {40, 4, value};
    return run;
}

std::string refusal(const Run& run, const Run& without)
{
    try {
        (void)report::added_error_of(half_a_view(), run, without);
        return {};
    } catch (const support::Failure& failure) {
        return failure.what();
    }
}

}  // namespace

TEST_CASE("groups of a plan are counted by what is in them")
{
    const report::View view = half_a_view();
    Image<std::uint8_t> groups{3, 4};
    // Background alone; background and a surface; surface.
    const std::uint8_t bytes[4][3] = {{0, 0, 0}, {1, 0, 0x81}, {0, 0xff, 0}, {0x0f, 0xff, 7}};
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 3; ++x) groups(x, y) = bytes[y][x];
    const report::PlanCounts counts = report::counts_of(view, {.active = groups.view()});
    CHECK(counts.background == 2);
    CHECK(counts.inactive == 4);
    CHECK(counts.active == 6);
    CHECK(report::counts_of(view, {}).active == 12);
}

TEST_CASE("a plan in false colour tells background, what is left out and what is worked on")
{
    const report::View view = half_a_view();
    Image<std::uint8_t> groups{3, 4, 0};
    groups(1, 3) = 1;
    scenes::Scene scene;
    const support::Picture picture = report::plan_picture(scene, view, {.active = groups.view()});
    const support::Rgb nothing = picture.get(3, 0), grey = picture.get(35, 0);
    CHECK(nothing.r + nothing.g + nothing.b < 0.3f);
    CHECK(grey.r == grey.g);
    CHECK(grey.g == grey.b);
    CHECK(grey.r > 0.2f);
    CHECK(picture.get(25, 3).r > 2 * picture.get(25, 3).b);
    CHECK(picture.get(25, 3).r == picture.get(31, 3).r);
    CHECK(picture.get(33, 3).r == grey.r);
}

TEST_CASE("an exact plan adds nothing, and one that changes a bit is a failure that names a pixel")
{
    Run exact = run_of("planned-1", 0, 0.5f);
    const Json same = report::added_error_of(half_a_view(), exact, whole(0.5f));
    CHECK(same["changed"] == 0);
    CHECK(same["rmse"] == 0);
    CHECK(same["pixels"] == 80);
    // On the background, and in the last bit.
    exact.visibility(7, 2) = std::nextafter(0.5f, 0.0f);
    CHECK(refusal(exact, whole(0.5f)) ==
          "planned-1: its plan is exact: pixel (7, 2) is 0.49999997, and 0.5 in whole-1");
    exact.visibility(7, 2) = 0.5f;
    CHECK(refusal(exact, whole(0.5f)).empty());
    // The same number by other bits is another picture.
    exact.visibility = {40, 4, -0.0f};
    CHECK(!refusal(exact, whole(0.0f)).empty());
}

TEST_CASE("a plan with a tolerance may raise a pixel by that, and lower it by anything")
{
    Run tolerant = run_of("tolerant-1", 0.01, 0.5f);
    tolerant.visibility(3, 1) = 0.75f;
    CHECK(refusal(tolerant, whole(0.5f)) ==
          "tolerant-1: its plan raises nothing by more than 0.01: pixel (3, 1) is 0.75, and 0.5 in "
          "whole-1");
    tolerant.visibility(3, 1) = 0.51f;
    tolerant.visibility(20, 0) = 0.51f;
    tolerant.visibility(21, 0) = 0.25f;
    const Json added = report::added_error_of(half_a_view(), tolerant, whole(0.5f));
    CHECK(added["changed"] == 3);
    CHECK(added["max"] == 0.25);
    CHECK(double{added["rmse"]} ==
          doctest::Approx(std::sqrt((0.01 * 0.01 + 0.25 * 0.25) / 80)).epsilon(1e-6));
    // Outlines promise nothing.
    CHECK(refusal(run_of("masked-1", std::nullopt, 1), whole(0)).empty());
    Run unplanned = run_of("half-1", 0, 1);
    unplanned.kernel.plan.reset();
    CHECK(report::added_error_of(half_a_view(), unplanned, whole(0))["changed"] == 160);
}

TEST_CASE("the first plan of each kind is drawn, exact ones apart from those with a tolerance")
{
    std::vector<Run> runs{whole(1),
                          run_of("a", 0, 1),
                          run_of("b", 0.01, 1),
                          run_of("c", 0, 1),
                          run_of("d", std::nullopt, 1),
                          run_of("e", 0, 1)};
    runs[4].kernel.plan->kind = "outline";
    runs[5].kernel.plan->kind = "traced";
    std::vector<std::string> names;
    for (const report::PlanPicture& picture : report::plan_pictures(runs))
        names.push_back(picture.name + ' ' + picture.run->kernel.id);
    CHECK(names == std::vector<std::string>{"plan-surface a", "plan-surface-tolerant b",
                                            "plan-outline d", "plan-traced e"});
    CHECK(report::without_of(runs[1], runs) == &runs[0]);
    CHECK(report::without_of(runs[0], runs) == nullptr);
    runs[1].kernel.without = "gone";
    CHECK(report::without_of(runs[1], runs) == nullptr);
}

TEST_CASE("a planned kernel plans, then does the same with the map of its plan")
{
    const report::View view = half_a_view();
    Kernel plain;
    plain.name = "kernel";
    plain.id = "kernel-3x3";
    plain.setting = "nine samples";
    plain.parameters["samples"] = 9;
    plain.is_default = true;
    plain.passes = {{"samples", {}}};
    plain.exact = [](auto&&...) { return nook::Outcome{}; };
    for (const double tolerance : {0.0, 0.5}) {
        CAPTURE(tolerance);
        const Kernel kernel =
            report::planned(view, plain, "depth", tolerance,
                            {[](const nook::ImageView<std::uint8_t>& groups,
                                report::CountedScratch& scratch, nook::ThreadExecutor&) {
                                 REQUIRE(scratch.reserve(1000) != nullptr);
                                 for (int y = 0; y < groups.height; ++y)
                                     for (int x = 0; x < groups.width; ++x)
                                         groups(x, y) = x == 1 ? 1 : 0;
                                 nook::Outcome outcome;
                                 outcome.work = {.pixels = 160, .skipped = 16, .passes = 1};
                                 return outcome;
                             },
                             [](const nook::ImageView<const std::uint8_t>& groups) {
                                 return nook::WorkMap{groups};
                             },
                             [](const nook::ImageView<float>& visibility, const nook::WorkMap& map,
                                report::CountedScratch&, nook::ThreadExecutor&) {
                                 for (int y = 0; y < visibility.height; ++y)
                                     for (int x = 0; x < visibility.width; ++x)
                                         visibility(x, y) = map.is_active(x, y) ? 0.25f : 1.0f;
                                 nook::Outcome outcome;
                                 outcome.work = {.pixels = 160, .skipped = 48, .passes = 1};
                                 return outcome;
                             }});
        const std::string name = tolerance > 0 ? "kernel-tolerant" : "kernel-planned";
        CHECK(kernel.name == name);
        CHECK(kernel.id == name + "-3x3");
        CHECK(kernel.without == "kernel-3x3");
        CHECK(kernel.setting ==
              (tolerance > 0 ? "nine samples, planned to 0.5" : "nine samples, planned"));
        CHECK(kernel.parameters["samples"] == 9);
        CHECK(kernel.parameters["plan_tolerance"] == tolerance);
        CHECK(!kernel.is_default);
        CHECK(!kernel.exact);
        REQUIRE(kernel.plan);
        CHECK(kernel.plan->is_exact() == (tolerance == 0));

        nook::ThreadExecutor threads{2};
        support::Progress progress;
        const std::vector<Run> runs = report::run_kernels(view, {kernel}, threads, 0, progress);
        CHECK(runs[0].visibility(15, 3) == 1);
        CHECK(runs[0].visibility(16, 3) == 0.25f);
        CHECK(runs[0].work.pixels == 160);
        CHECK(runs[0].work.skipped == 48);
        CHECK(runs[0].work.passes == 2);
        CHECK(runs[0].timings[0].passes[0].name == "plan");
        CHECK(runs[0].timings[0].passes[1].name == "samples");
        CHECK(kernel.memory() == 12 + 1000);
        CHECK(!kernel.plan->map().is_active(0, 0));
        CHECK(kernel.plan->map().is_active(16, 0));
    }
}

TEST_CASE("plans of the kernels of a report keep what they promise, on a floor and a bowl")
{
    for (const bool flat : {true, false}) {
        CAPTURE(flat);
        report::Subject subject;
        subject.scene = flat ? scenes::floor() : scenes::bowl();
        nook::ThreadExecutor threads{2};
        report::Options options;
        options.width = 97;
        options.height = 54;
        const report::View view = report::draw(subject.scene, options, threads);
        report::Cell cell;
        cell.subject = &subject;
        cell.radius = subject.scene.radius;
        report::Structures structures{subject.scene, threads};
        const report::Setup setup{cell, view, structures, true, threads};
        std::vector<Kernel> kernels;
        report::add_surface_kernels(setup, kernels);
        report::add_outline_kernels(setup, kernels);
        report::add_traced_kernels(setup, kernels);
        support::Progress progress;
        const std::vector<Run> runs =
            report::run_kernels(view, std::move(kernels), threads, 0, progress);
        int planned = 0;
        for (const Run& run : runs) {
            if (!run.kernel.plan) continue;
            CAPTURE(run.kernel.id);
            ++planned;
            const Run* const without = report::without_of(run, runs);
            REQUIRE(without != nullptr);
            CHECK_NOTHROW((void)report::added_error_of(view, run, *without));
            const report::PlanCounts counts = report::counts_of(view, run.kernel.plan->map());
            CHECK(counts.background + counts.inactive + counts.active == 7 * 54);
            if (flat) CHECK(counts.inactive > 0);
        }
        CHECK(planned == 10);
    }
}
