#include "reference.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <string>

#include <nook/scene/traced_ao.hpp>
#include <nook/scene/traced_plan.hpp>
#include <nook/surface/height_field_ao.hpp>

#include "../support/checked.hpp"

namespace report {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Passes tasks on to the threads and says how many are done.
struct Watched {
    nook::ThreadExecutor& threads;
    support::Progress* progress = nullptr;  ///< null: says nothing
    double first = 0, last = 1;             ///< the share of the step that this call makes up

    [[nodiscard]] int concurrency() const { return threads.concurrency(); }

    template <class F>
    void for_each(int count, F&& f)
    {
        std::atomic<int> done{0};
        threads.for_each(count, [&](int task, int worker) {
            f(task, worker);
            const int now = 1 + done.fetch_add(1, std::memory_order_relaxed);
            if (worker == 0 && progress != nullptr)
                progress->share(first + (last - first) * now / count);
        });
    }
};

/// Calls `f` with the options of a meaning.
template <class F>
nook::Outcome with_options(double radius, Meaning meaning, int directions, std::uint32_t seed,
                           const F& f)
{
    const auto run = [&](auto options) {
        options.radius = radius;
        options.directions = directions;
        options.seed = seed;
        return f(options);
    };
    using nook::ExponentialFalloff, nook::SecondaryRays, nook::TracedOptions;
    const ExponentialFalloff falloff{sigma_of(radius)};
    switch (meaning) {
    case Meaning::visibility: break;
    case Meaning::obscurance: return run(TracedOptions<ExponentialFalloff>{.falloff = falloff});
    case Meaning::visibility_secondary:
        return run(TracedOptions<nook::StepFalloff, SecondaryRays>{});
    case Meaning::obscurance_secondary:
        return run(TracedOptions<ExponentialFalloff, SecondaryRays>{.falloff = falloff});
    }
    return run(TracedOptions<>{});
}

nook::Outcome trace_watched(const nook::Bvh& hierarchy, const View& view, double radius,
                            Meaning meaning, int directions, std::uint32_t seed,
                            const nook::ImageView<float>& visibility, const nook::WorkMap& map,
                            CountedScratch& scratch, Watched watched)
{
    return with_options(radius, meaning, directions, seed, [&](const auto& options) {
        return nook::traced_ao(hierarchy, view.depth.view(), view.normal(), visibility, options,
                               view.projection, view.frame, map, scratch, watched);
    });
}

double rms_difference(const nook::Image<float>& image, const nook::Image<float>& other,
                      const nook::Image<std::uint8_t>& counted)
{
    const nook::Measured difference = nook::rmse(image.view(), other.view(), counted.view());
    if (!difference) throw support::Failure{"rmse: " + support::text_of(difference.error)};
    return difference.value;
}

/// Pixels of the view that the height field may walk over on one picture, both forms together: about
/// two seconds on two cores, and a quarter of one in a quick run.
constexpr double walk_budget = 2e8, quick_walk_budget = 2.5e7;

int affordable_row_step(const Setup& setup, int slices)
{
    const View& view = setup.view;
    const double reach = nook::pixels_per_length(view.projection, setup.cell.radius, view.median).y;
    const double walk = 2.0 * slices * std::clamp(reach, 1.0, double(view.width()));
    const double surfaces = double(view.width()) * double(view.height()) - double(view.background);
    const int most = (std::max)(view.height() / 4, 1);
    return static_cast<int>(
        std::clamp(std::ceil(surfaces * walk / (setup.quick ? quick_walk_budget : walk_budget)),
                   1.0, double(most)));
}

}  // namespace

bool is_vast(const View& view) { return view.farthest > 1e5 * view.nearest; }

std::vector<Meaning> meanings_of(const Setup& setup)
{
    const Cell& cell = setup.cell;
    if (cell.unlimited() || !cell.principal || is_vast(setup.view) ||
        (setup.quick && !cell.subject->thin))
        return {Meaning::visibility};
    return {Meaning::visibility, Meaning::obscurance, Meaning::visibility_secondary,
            Meaning::obscurance_secondary};
}

double sigma_of(double radius) { return 2 / radius; }

nook::Outcome trace_once(const nook::Bvh& hierarchy, const View& view, double radius,
                         Meaning meaning, int directions, std::uint32_t seed,
                         const nook::ImageView<float>& visibility, const nook::WorkMap& map,
                         CountedScratch& scratch, nook::ThreadExecutor& threads)
{
    return trace_watched(hierarchy, view, radius, meaning, directions, seed, visibility, map,
                         scratch, {threads});
}

nook::Outcome plan_rays(const nook::Bvh& hierarchy, const View& view, double radius,
                        Meaning meaning, int directions,
                        const nook::ImageView<std::uint8_t>& groups, nook::ThreadExecutor& threads)
{
    return with_options(radius, meaning, directions, 0, [&](const auto& options) {
        return nook::plan_traced(hierarchy, view.depth.view(), view.normal(), groups, options,
                                 view.projection, view.frame, threads);
    });
}

Traced trace(const Setup& setup, Meaning meaning, int directions, support::Progress& progress)
{
    const View& view = setup.view;
    Traced traced;
    traced.meaning = meaning;
    traced.directions = directions;
    progress.step("building the hierarchy");
    const nook::Bvh& hierarchy = setup.structures.hierarchy().value;

    progress.step(std::string{"tracing "} + name_of(meaning));
    const Clock::time_point start = Clock::now();
    CountedScratch scratch;
    nook::Image<float> halves[2];
    for (int half = 0; half < 2; ++half) {
        halves[half] = {view.width(), view.height()};
        const nook::Work work = support::checked(
            trace_watched(hierarchy, view, setup.cell.radius, meaning, directions / 2,
                          static_cast<std::uint32_t>(half + 1), halves[half].view(), {}, scratch,
                          {setup.threads, &progress, 0.5 * half, 0.5 * half + 0.5}),
            "traced_ao");
        traced.rays += work.rays;
        traced.skipped_rays += work.skipped_rays;
    }
    traced.seconds = seconds_since(start);
    traced.standard_error = rms_difference(halves[0], halves[1], view.surface) / 2;
    traced.visibility = std::move(halves[0]);
    const nook::Image<float>& other = halves[1];
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x)
            traced.visibility(x, y) = (traced.visibility(x, y) + other(x, y)) / 2;
    return traced;
}

HeightField height_field(const Setup& setup, const Traced& visibility, support::Progress& progress)
{
    const View& view = setup.view;
    const int width = view.width(), height = view.height();
    HeightField field;
    nook::HeightFieldOptions options;
    options.radius = setup.cell.radius;
    if (setup.quick) options.slices /= 2;
    field.slices = options.slices;
    field.row_step = affordable_row_step(setup, options.slices + options.slices / 2);

    nook::Image<std::uint8_t> rows{nook::WorkMap::groups(width), height};
    nook::Image<std::uint8_t> counted = view.surface;
    for (int y = 0; y < height; ++y) {
        const bool computed = field.computes(y);
        for (int x = 0; x < rows.width(); ++x) rows(x, y) = computed ? 1 : 0;
        if (!computed)
            for (int x = 0; x < width; ++x) counted(x, y) = 0;
    }

    progress.step("the depth buffer as the only geometry");
    const Clock::time_point start = Clock::now();
    nook::HeapScratch scratch;
    const auto run = [&](int slices, double first, double last) {
        options.slices = slices;
        nook::Image<float> result{width, height};
        support::checked(
            nook::height_field_ao(view.depth.view(), view.normal(), result.view(), options,
                                  view.projection, {rows.view(), false}, scratch,
                                  Watched{setup.threads, &progress, first, last}),
            "height_field_ao");
        return result;
    };
    const nook::Image<float> half = run(field.slices / 2, 0, 1.0 / 3);
    field.visibility = run(field.slices, 1.0 / 3, 1);
    field.seconds = seconds_since(start);
    field.standard_error = rms_difference(field.visibility, half, counted);
    support::checked(nook::error_metrics(field.visibility.view(), visibility.visibility.view(),
                                         field.unknown, counted.view()),
                     "error_metrics");

    for (int y = 0; y < height; ++y) {
        const int computed = y / field.row_step * field.row_step + field.row_step / 2;
        const int from = computed < height ? computed : computed - field.row_step;
        if (from < 0) continue;
        for (int x = 0; x < width; ++x) field.visibility(x, y) = field.visibility(x, from);
    }
    return field;
}

}  // namespace report
