#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nook/measure/error.hpp>

#include "../../examples/report/counted_scratch.hpp"
#include "../../examples/report/runs.hpp"
#include "../../examples/report/structures.hpp"
#include "../../examples/report/view.hpp"
#include "../../examples/scenes/scenes.hpp"
#include "../../examples/support/failure.hpp"

namespace {

using report::Kernel;
using report::Run;
using Visibility = nook::ImageView<float>;

/// Longer than any test.
constexpr double forever = 1e6;

report::View view_of(int width, int height)
{
    report::View view;
    view.depth = {width, height, 1.0f};
    return view;
}

/// What ran, in order: names of kernel and pass, and the number of threads.
struct Entry {
    std::string kernel, pass;
    int threads;

    friend bool operator==(const Entry&, const Entry&) = default;
};
using Log = std::vector<Entry>;

/// A kernel that writes itself into the log, and the number of its pass into the picture.
Kernel fake(Log& log, const std::string& id, const std::vector<std::string>& passes = {"only"})
{
    Kernel kernel;
    kernel.name = kernel.id = id;
    for (std::size_t i = 0; i < passes.size(); ++i)
        kernel.passes.push_back(
            {passes[i], [&log, id, name = passes[i], i](const Visibility& visibility,
                                                        nook::ThreadExecutor& threads) {
                 log.push_back({id, name, threads.concurrency()});
                 for (int y = 0; y < visibility.height; ++y)
                     for (int x = 0; x < visibility.width; ++x)
                         visibility(x, y) = static_cast<float>(i);
                 nook::Outcome outcome;
                 outcome.work.samples = 10 * i + 1;
                 outcome.work.passes = 1;
                 return outcome;
             }});
    return kernel;
}

std::vector<Run> run(std::vector<Kernel> kernels, int workers, double seconds)
{
    nook::ThreadExecutor threads{workers};
    support::Progress progress;
    return report::run_kernels(view_of(5, 3), std::move(kernels), threads, seconds, progress);
}

/// A small picture of a bowl, and the kernels over screens that a report has of it.
struct Screen {
    report::Subject subject;
    nook::ThreadExecutor threads{2};
    report::View view;
    report::Cell cell;
    report::Structures structures{subject.scene, threads};

    Screen()
    {
        subject.scene = scenes::bowl();
        report::Options options;
        options.width = 64;
        options.height = 36;
        view = report::draw(subject.scene, options, threads);
        cell.subject = &subject;
        cell.radius = subject.scene.radius;
    }
    std::vector<Kernel> kernels(bool quick)
    {
        const report::Setup setup{cell, view, structures, quick, threads};
        std::vector<Kernel> result;
        report::add_depth_kernels(setup, result);
        report::add_surface_kernels(setup, result);
        report::add_outline_kernels(setup, result);
        return result;
    }
};

std::set<std::string> ids_of(const std::vector<Kernel>& kernels)
{
    std::set<std::string> ids;
    for (const Kernel& kernel : kernels) ids.insert(kernel.id);
    return ids;
}

}  // namespace

TEST_CASE(
    "kernels take turns, once for the caches and seven times that count, with one thread and "
    "with all")
{
    Log log;
    const std::vector<Run> runs = run({fake(log, "a"), fake(log, "b"), fake(log, "c")}, 2, forever);

    Log expected;
    for (const int threads : {1, 2})
        for (int round = 0; round < 8; ++round)
            for (const char* id : {"a", "b", "c"}) expected.push_back({id, "only", threads});
    CHECK(log == expected);

    REQUIRE(runs.size() == 3);
    for (const Run& result : runs) {
        CAPTURE(result.kernel.id);
        REQUIRE(result.timings.size() == 2);
        CHECK(result.timings[0].threads == 1);
        CHECK(result.timings[1].threads == 2);
        for (const report::Timing& timing : result.timings) {
            CHECK(timing.rounds == report::most_rounds);
            CHECK(timing.fastest >= 0);
            CHECK(timing.fastest <= timing.median);
            CHECK(timing.median <= timing.p90);
        }
    }
    CHECK(runs[0].kernel.id == "a");
    CHECK(runs[2].kernel.id == "c");
}

TEST_CASE("one thread for everything is timed once")
{
    Log log;
    const std::vector<Run> runs = run({fake(log, "a")}, 1, forever);
    CHECK(log.size() == 8);
    REQUIRE(runs.front().timings.size() == 1);
    CHECK(runs.front().timings.front().threads == 1);
}

TEST_CASE("without time a kernel runs once, and that run counts")
{
    Log log;
    const std::vector<Run> runs = run({fake(log, "a"), fake(log, "b")}, 2, 0);
    CHECK(log.size() == 4);
    for (const Run& result : runs)
        for (const report::Timing& timing : result.timings) {
            CHECK(timing.rounds == 1);
            CHECK(timing.fastest == timing.median);
            CHECK(timing.median == timing.p90);
        }
}

TEST_CASE("a kernel whose frame takes all its time runs once; the others go on")
{
    using Clock = std::chrono::steady_clock;
    constexpr double seconds = 0.02;
    Log log;
    Kernel longer = fake(log, "longer");
    const auto quick_run = longer.passes.front().run;
    longer.passes.front().run = [quick_run](const Visibility& visibility,
                                            nook::ThreadExecutor& threads) {
        const auto end = Clock::now() + std::chrono::duration<double>(1.05 * seconds);
        while (Clock::now() < end) {
        }
        return quick_run(visibility, threads);
    };
    const std::vector<Run> runs = run({longer, fake(log, "short")}, 1, seconds);
    CHECK(runs[0].timings.front().rounds == 1);
    CHECK(runs[0].timings.front().median >= 1000 * seconds);
    std::size_t of_longer = 0;
    for (const Entry& entry : log) of_longer += entry.kernel == "longer" ? 1 : 0;
    CHECK(of_longer == 1);
    // The machine may take a break.
    const int rounds = runs[1].timings.front().rounds;
    const int of_short = static_cast<int>(log.size() - of_longer);
    CHECK(rounds >= 1);
    CHECK(rounds <= report::most_rounds);
    CHECK(of_short >= rounds);
    CHECK(of_short <= rounds + 1);
}

TEST_CASE("a kernel is held against the one that leaves nothing out, round by round")
{
    using Clock = std::chrono::steady_clock;
    const auto lasting = [](const char* id, int milliseconds) {
        Kernel kernel;
        kernel.name = kernel.id = id;
        kernel.passes = {{"only", [milliseconds](const Visibility&, nook::ThreadExecutor&) {
                              const auto end =
                                  Clock::now() + std::chrono::milliseconds{milliseconds};
                              while (Clock::now() < end) {
                              }
                              return nook::Outcome{};
                          }}};
        return kernel;
    };
    Kernel fast = lasting("fast", 1), lost = lasting("lost", 1);
    fast.without = "whole";
    lost.without = "nobody";
    const std::vector<Run> runs = run({lasting("whole", 4), fast, lost}, 2, forever);
    for (const std::size_t timing : {std::size_t{0}, std::size_t{1}}) {
        CHECK(!runs[0].timings[timing].ratio);
        REQUIRE(runs[1].timings[timing].ratio);
        // The machine may take a break, in half of the rounds.
        CHECK(*runs[1].timings[timing].ratio > 0.01);
        CHECK(*runs[1].timings[timing].ratio < 0.9);
        CHECK(!runs[2].timings[timing].ratio);
    }
}

TEST_CASE("slow forms run once, with all threads, after the others")
{
    Log log;
    Kernel slow = fake(log, "slow", {"first", "second"});
    slow.slow = true;
    const std::vector<Run> runs = run({slow, fake(log, "a")}, 2, forever);
    REQUIRE(log.size() == 18);
    CHECK(log[16] == Entry{"slow", "first", 2});
    CHECK(log[17] == Entry{"slow", "second", 2});
    REQUIRE(runs[0].timings.size() == 1);
    CHECK(runs[0].timings.front().threads == 2);
    CHECK(runs[0].timings.front().rounds == 1);
    REQUIRE(runs[0].timings.front().passes.size() == 2);
    CHECK(runs[0].visibility(4, 2) == 1);
    CHECK(runs[0].work.samples == 12);
}

TEST_CASE("passes run in their order, each with its time, and their work adds up")
{
    Log log;
    const std::vector<Run> runs = run({fake(log, "a", {"mask", "samples", "blur"})}, 1, forever);
    REQUIRE(log.size() == 24);
    for (std::size_t i = 0; i < log.size(); i += 3) {
        CHECK(log[i].pass == "mask");
        CHECK(log[i + 1].pass == "samples");
        CHECK(log[i + 2].pass == "blur");
    }
    const Run& result = runs.front();
    const report::Timing& timing = result.timings.front();
    REQUIRE(timing.passes.size() == 3);
    CHECK(timing.passes[0].name == "mask");
    CHECK(timing.passes[2].name == "blur");
    for (const report::Timing::Pass& pass : timing.passes) {
        CHECK(pass.median >= 0);
        CHECK(pass.median <= timing.p90);
    }
    // Of one frame, not of all.
    CHECK(result.work.samples == 1 + 11 + 21);
    CHECK(result.work.passes == 3);
    CHECK(result.visibility(0, 0) == 2);
}

TEST_CASE("the time of a single pass is that of the frame")
{
    Log log;
    const std::vector<Run> runs = run({fake(log, "a")}, 2, forever);
    for (const report::Timing& timing : runs.front().timings) {
        REQUIRE(timing.passes.size() == 1);
        CHECK(timing.passes.front().median == timing.median);
    }
}

TEST_CASE("a frame's time is that of its passes together")
{
    Log log;
    const std::vector<Run> runs = run({fake(log, "a", {"one", "two"})}, 1, 0);
    const report::Timing& timing = runs.front().timings.front();
    const double sum = timing.passes[0].median + timing.passes[1].median;
    CHECK(sum == doctest::Approx(timing.median).epsilon(1e-9));
}

TEST_CASE("a kernel that fails is named, with its pass")
{
    Log log;
    Kernel broken = fake(log, "broken-16", {"samples", "blur"});
    broken.passes[1].run = [](const Visibility&, nook::ThreadExecutor&) -> nook::Outcome {
        return {{nook::ErrorCode::bad_value, "options.radius", -1, "0 to 64"}};
    };
    CHECK_THROWS_WITH_AS(run({broken}, 1, forever),
                         "broken-16, blur: options.radius is -1; allowed: 0 to 64",
                         support::Failure);
    broken.slow = true;
    CHECK_THROWS_AS(run({broken}, 1, forever), support::Failure);
}

TEST_CASE("no kernels and no pixels are fine")
{
    CHECK(run({}, 2, 1).empty());
    Log log;
    nook::ThreadExecutor threads{1};
    support::Progress progress;
    const std::vector<Run> runs =
        report::run_kernels(report::View{}, {fake(log, "a")}, threads, 0, progress);
    CHECK(runs.front().visibility.width() == 0);
}

TEST_CASE("counted scratch knows what it holds")
{
    report::CountedScratch scratch;
    CHECK(scratch.bytes() == 0);
    void* const data = scratch.reserve(1000);
    REQUIRE(data != nullptr);
    CHECK(scratch.bytes() == 1000);
    CHECK(scratch.reserve(10) == data);
    CHECK(scratch.bytes() == 1000);
    static_cast<void>(scratch.reserve(2000));
    CHECK(scratch.bytes() == 2000);
    CHECK(report::bytes_of(nook::Image<double>{3, 5}) == 120);
}

TEST_CASE("a pass before the last tells its error and its passes alone")
{
    nook::Outcome outcome;
    outcome.work = {
        .pixels = 1, .background = 2, .skipped = 3, .samples = 4, .passes = 5, .skipped_passes = 6};
    const nook::Outcome result = report::before_last(outcome);
    CHECK(result);
    CHECK(result.work.pixels == 0);
    CHECK(result.work.background == 0);
    CHECK(result.work.skipped == 0);
    CHECK(result.work.samples == 0);
    CHECK(result.work.passes == 5);
    CHECK(result.work.skipped_passes == 6);
    outcome.error = {nook::ErrorCode::out_of_memory, "scratch", 1, "more"};
    CHECK(report::before_last(outcome).error.code == nook::ErrorCode::out_of_memory);
}

TEST_CASE("kernels are described once, shortly, and by families that reports know")
{
    const std::set<std::string> families{"depth", "surface", "outline", "traced", "information"};
    std::set<std::string> names;
    for (const report::KernelInfo& info : report::kernel_infos()) {
        CAPTURE(info.name);
        CHECK(names.insert(info.name).second);
        CHECK(families.count(info.family) == 1);
        for (const char* text : {info.what, info.source, info.needs, info.estimates}) {
            CHECK(std::string{text}.size() > 4);
            CHECK(std::string{text}.size() <= 160);
        }
    }
    CHECK(names.size() == 31);
    std::set<std::string> meanings;
    using report::Meaning;
    for (const Meaning meaning : {Meaning::visibility, Meaning::obscurance,
                                  Meaning::visibility_secondary, Meaning::obscurance_secondary})
        meanings.insert(report::name_of(meaning));
    CHECK(meanings == std::set<std::string>{"visibility", "obscurance", "visibility-secondary",
                                            "obscurance-secondary"});
}

TEST_CASE(
    "kernels over screens have names that are described, ids of their own, and the results that "
    "they are compared with, in full and in quick runs")
{
    Screen screen;
    std::set<std::string> described;
    for (const report::KernelInfo& info : report::kernel_infos()) described.insert(info.name);
    const std::vector<Kernel> full = screen.kernels(false);
    const std::set<std::string> all = ids_of(full);
    for (const bool quick : {false, true}) {
        CAPTURE(quick);
        const std::vector<Kernel> kernels = screen.kernels(quick);
        const std::set<std::string> ids = ids_of(kernels);
        CHECK(ids.size() == kernels.size());
        CHECK(std::includes(all.begin(), all.end(), ids.begin(), ids.end()));
        std::set<std::string> names;
        std::multiset<std::string> defaults;
        int planned = 0;
        for (const Kernel& kernel : kernels) {
            CAPTURE(kernel.id);
            names.insert(kernel.name);
            if (kernel.is_default) defaults.insert(kernel.name);
            CHECK(described.count(kernel.name) == 1);
            CHECK(kernel.id.rfind(kernel.name + '-', 0) == 0);
            CHECK(kernel.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789.-") ==
                  std::string::npos);
            CHECK(!kernel.setting.empty());
            CHECK(!kernel.parameters.empty());
            const auto is_without = [&](const Kernel& other) { return other.id == kernel.without; };
            const auto before = std::find_if(kernels.begin(), kernels.end(), is_without);
            CHECK(
                (kernel.without.empty() || before < kernels.begin() + (&kernel - kernels.data())));
            if (!kernel.plan) continue;
            CHECK(!kernel.without.empty());
            CHECK(kernel.passes.size() == 2);
            CHECK(kernel.passes.front().name == kernel.plan->pass);
            CHECK(kernel.plan->is_exact() == kernel.name.ends_with("-planned"));
            ++planned;
        }
        // In a quick run the defaults of four kernels, each twice, and the outlines.
        CHECK(planned == (quick ? 9 : 42));
        CHECK(names.size() == 23);
        // All but the two whose range the library leaves unset.
        CHECK(defaults.size() == 13);
        CHECK(std::set<std::string>(defaults.begin(), defaults.end()).size() == 13);
    }
    CHECK(all.count("alchemy-16") == 1);
    CHECK(all.count("horizon-blurred-3x3") == 1);
    CHECK(all.count("chebyshev-range-1.5") == 1);

    screen.cell.radius = screen.cell.factor = std::numeric_limits<double>::infinity();
    CHECK(screen.kernels(false).empty());
}

TEST_CASE("kernels over screens give visibility, background open, close to their own slow forms")
{
    Screen screen;
    support::Progress progress;
    const report::View& view = screen.view;
    const std::vector<Run> runs =
        report::run_kernels(view, screen.kernels(false), screen.threads, 0, progress);
    const nook::Image<std::uint8_t> rows{nook::WorkMap::groups(view.width()), view.height(), 1};
    for (const Run& result : runs) {
        CAPTURE(result.kernel.id);
        double darkest = 1;
        for (int y = 0; y < view.height(); ++y)
            for (int x = 0; x < view.width(); ++x) {
                const float value = result.visibility(x, y);
                REQUIRE((value >= 0 && value <= 1));
                if (view.surface(x, y) == 0) REQUIRE(value == 1);
                darkest = (std::min)(darkest, double{value});
            }
        CHECK(darkest < 0.97);
        CHECK(result.work.pixels == 64 * 36);
        CHECK(result.work.background == view.background);
        CHECK(result.timings.size() == (result.kernel.slow ? 1 : 2));
        CHECK((result.kernel.memory() > 0) != result.kernel.slow);
        CHECK((result.kernel.structures > 0) ==
              (result.kernel.name == "masked" || result.kernel.name == "stand-alone"));
        if (!result.kernel.exact) continue;
        nook::Image<float> exact{view.width(), view.height()};
        REQUIRE(result.kernel.exact(exact.view(), {rows.view(), false}, screen.threads));
        nook::ErrorMetrics error;
        REQUIRE(nook::error_metrics(result.visibility.view(), exact.view(), error,
                                    view.surface.view()));
        // A sample on the end of a sector of the bitmask may fall to either side.
        CHECK(error.rmse < (result.kernel.name == "bitmask" ? 1e-3 : 1e-5));
        CHECK(result.kernel.exact_samples >= 4);
    }
}
