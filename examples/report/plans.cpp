#include "plans.hpp"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <memory>
#include <utility>

#include <nook/measure/error.hpp>

#include "../support/checked.hpp"
#include "errors.hpp"

namespace report {

namespace {

/// Room for the rounding of a float in [0, 1] beside a tolerance.
constexpr double rounding = 0x1p-22;

[[noreturn]] void fail(const Run& run, const Run& without, int x, int y, const std::string& promise)
{
    char text[160];
    std::snprintf(text, sizeof text, ": pixel (%d, %d) is %.9g, and %.9g in %s", x, y,
                  double{run.visibility(x, y)}, double{without.visibility(x, y)},
                  without.kernel.id.c_str());
    throw support::Failure{run.kernel.id + ": its plan " + promise + text};
}

}  // namespace

Kernel planned(const View& view, const Kernel& without, const char* kind, double tolerance,
               PlannedSteps steps)
{
    struct Buffers {
        nook::Image<std::uint8_t> groups;
        CountedScratch plan, rest;
    };
    const auto buffers = std::make_shared<Buffers>();
    buffers->groups = {nook::WorkMap::groups(view.width()), view.height()};

    Kernel kernel = without;
    kernel.name += tolerance > 0 ? "-tolerant" : "-planned";
    kernel.id = kernel.name + without.id.substr(without.name.size());
    kernel.setting += tolerance > 0 ? ", planned to " + digits(tolerance) : ", planned";
    kernel.parameters["plan_tolerance"] = tolerance;
    kernel.without = without.id;
    kernel.exact = nullptr;
    // What is done without a plan is what the library does by default.
    kernel.is_default = false;
    kernel.plan = Plan{kind, "plan", tolerance,
                       [buffers, map = steps.map] { return map(buffers->groups.view()); }};
    kernel.passes = {{"plan",
                      [buffers, plan = std::move(steps.plan)](const nook::ImageView<float>&,
                                                              nook::ThreadExecutor& threads) {
                          return before_last(plan(buffers->groups.view(), buffers->plan, threads));
                      }},
                     {without.passes.back().name,
                      [buffers, map = std::move(steps.map), run = std::move(steps.run)](
                          const nook::ImageView<float>& visibility, nook::ThreadExecutor& threads) {
                          return run(visibility, map(buffers->groups.view()), buffers->rest,
                                     threads);
                      }}};
    kernel.memory = [buffers] {
        return bytes_of(buffers->groups) + buffers->plan.bytes() + buffers->rest.bytes();
    };
    return kernel;
}

PlanCounts counts_of(const View& view, const nook::WorkMap& map)
{
    PlanCounts counts;
    for (int y = 0; y < view.height(); ++y)
        for (int first = 0; first < view.width(); first += nook::WorkMap::group) {
            if (map.is_active(first, y)) {
                ++counts.active;
                continue;
            }
            const int last = (std::min)(first + nook::WorkMap::group, view.width());
            bool surface = false;
            for (int x = first; x < last; ++x) surface = surface || view.surface(x, y) != 0;
            ++(surface ? counts.inactive : counts.background);
        }
    return counts;
}

std::vector<PlanPicture> plan_pictures(const std::vector<Run>& runs)
{
    std::vector<PlanPicture> pictures;
    for (const Run& run : runs) {
        if (!run.kernel.plan) continue;
        const Plan& plan = *run.kernel.plan;
        const std::string name =
            std::string{"plan-"} + plan.kind + (plan.tolerance.value_or(0) > 0 ? "-tolerant" : "");
        const bool taken = std::any_of(pictures.begin(), pictures.end(),
                                       [&](const auto& picture) { return picture.name == name; });
        if (!taken) pictures.push_back({name, &run});
    }
    return pictures;
}

const Run* without_of(const Run& run, const std::vector<Run>& runs)
{
    for (const Run& other : runs)
        if (!run.kernel.without.empty() && other.kernel.id == run.kernel.without) return &other;
    return nullptr;
}

Json added_error_of(const View& view, const Run& run, const Run& without)
{
    const bool exact = run.kernel.plan && run.kernel.plan->is_exact();
    // Visibilities differ by 1 at most.
    const double tolerance = run.kernel.plan ? run.kernel.plan->tolerance.value_or(1) : 1;
    std::uint64_t changed = 0;
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x) {
            const float now = run.visibility(x, y), before = without.visibility(x, y);
            if (std::bit_cast<std::uint32_t>(now) == std::bit_cast<std::uint32_t>(before)) continue;
            ++changed;
            if (exact) fail(run, without, x, y, "is exact");
            if (double{now} - double{before} > tolerance + rounding)
                fail(run, without, x, y, "raises nothing by more than " + digits(tolerance));
        }
    nook::ErrorMetrics error;
    support::checked(nook::error_metrics(run.visibility.view(), without.visibility.view(), error,
                                         view.surface.view()),
                     "error_metrics");
    Json json = json_of(error);
    json["changed"] = changed;
    return json;
}

}  // namespace report
