#include "reference.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include <nook/measure/error.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/surface/height_field_ao.hpp>

#include "../support/checked.hpp"

namespace report {

namespace {

/// Passes tasks on to the threads and says how many are done.
struct Watched {
    nook::ThreadExecutor& threads;
    support::Progress& progress;
    double first, last;  ///< the share of the step that this call makes up

    [[nodiscard]] int concurrency() const { return threads.concurrency(); }

    template <class F>
    void for_each(int count, F&& f)
    {
        std::atomic<int> done{0};
        threads.for_each(count, [&](int task, int worker) {
            f(task, worker);
            const int now = 1 + done.fetch_add(1, std::memory_order_relaxed);
            if (worker == 0) progress.share(first + (last - first) * now / count);
        });
    }
};

/// Rays of the view that the height field may walk on one view: a second or two.
constexpr double walk_budget = 1.5e8;

void trace_height_field(const View& view, nook::ThreadExecutor& threads,
                        support::Progress& progress, Reference& reference)
{
    const int width = view.width(), height = view.height();
    const double pixels = nook::pixels_per_length(view.projection, reference.radius, view.median).y;
    const double walk = 2.0 * reference.slices * std::clamp(pixels, 1.0, double(width));
    const double surfaces = double(width) * height - double(view.background);
    const int most = (std::max)(height / 4, 1);
    reference.height_field_step =
        static_cast<int>(std::clamp(std::ceil(surfaces * walk / walk_budget), 1.0, double(most)));
    nook::Image<std::uint8_t> rows{nook::WorkMap::groups(width), height};
    nook::Image<std::uint8_t> counted = view.surface;
    for (int y = 0; y < height; ++y) {
        const bool computed = reference.computes_height_field(y);
        for (int x = 0; x < rows.width(); ++x) rows(x, y) = computed ? 1 : 0;
        if (!computed)
            for (int x = 0; x < width; ++x) counted(x, y) = 0;
    }
    reference.height_field = {width, height};
    nook::HeightFieldOptions options;
    options.radius = reference.radius;
    options.slices = reference.slices;
    support::checked(
        nook::height_field_ao(view.depth.view(), view.normal(), reference.height_field.view(),
                              options, view.projection, {rows.view(), false}, nook::HeapScratch{},
                              Watched{threads, progress, 0, 1}),
        "height_field_ao");
    support::checked(nook::error_metrics(reference.height_field.view(), reference.visibility.view(),
                                         reference.unknown, counted.view()),
                     "error_metrics");
}

}  // namespace

Reference trace(const scenes::Scene& scene, const View& view, double radius, int rays,
                nook::ThreadExecutor& threads, support::Progress& progress)
{
    using Clock = std::chrono::steady_clock;
    const auto seconds_since = [](Clock::time_point start) {
        return std::chrono::duration<double>(Clock::now() - start).count();
    };
    Reference reference;
    reference.rays = rays;
    reference.radius = radius;

    progress.step("building the hierarchy");
    auto start = Clock::now();
    nook::Bvh bvh;
    support::checked(bvh.build(scene.mesh()), "Bvh::build");
    reference.build_seconds = seconds_since(start);
    reference.dropped = bvh.dropped();

    progress.step("tracing the reference");
    start = Clock::now();
    nook::Image<float> halves[2];
    for (int half = 0; half < 2; ++half) {
        halves[half] = {view.width(), view.height()};
        nook::TracedOptions<> options;
        options.radius = radius;
        options.directions = rays / 2;
        options.seed = static_cast<std::uint32_t>(half + 1);
        const nook::Work work = support::checked(
            nook::traced_ao(bvh, view.depth.view(), view.normal(), halves[half].view(), options,
                            view.projection, view.frame, {}, {},
                            Watched{threads, progress, 0.5 * half, 0.5 * half + 0.5}),
            "traced_ao");
        reference.rays_traced += work.rays;
        reference.rays_skipped += work.skipped_rays;
    }
    reference.seconds = seconds_since(start);

    const nook::Measured difference =
        nook::rmse(halves[0].view(), halves[1].view(), view.surface.view());
    if (!difference) throw support::Failure{"rmse: " + support::text_of(difference.error)};
    reference.standard_error = difference.value / 2;
    reference.visibility = std::move(halves[0]);
    const auto& other = halves[1];
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x)
            reference.visibility(x, y) = (reference.visibility(x, y) + other(x, y)) / 2;

    progress.step("the depth buffer as the only geometry");
    start = Clock::now();
    trace_height_field(view, threads, progress, reference);
    reference.height_field_seconds = seconds_since(start);
    return reference;
}

}  // namespace report
