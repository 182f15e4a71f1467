#include "reference.hpp"

#include <atomic>
#include <chrono>

#include <nook/measure/error.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/traced_ao.hpp>

#include "checked.hpp"

namespace report {

namespace {

/// Passes tasks on to the threads and says how many are done.
struct Watched {
    nook::ThreadExecutor& threads;
    Progress& progress;
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

}  // namespace

Reference trace(const scenes::Scene& scene, const View& view, double radius, int rays,
                nook::ThreadExecutor& threads, Progress& progress)
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
    checked(bvh.build(scene.mesh()), "Bvh::build");
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
        const nook::Work work =
            checked(nook::traced_ao(bvh, view.depth.view(), view.normal(), halves[half].view(),
                                    options, view.projection, view.frame, {}, {},
                                    Watched{threads, progress, 0.5 * half, 0.5 * half + 0.5}),
                    "traced_ao");
        reference.rays_traced += work.rays;
        reference.rays_skipped += work.skipped_rays;
    }
    reference.seconds = seconds_since(start);

    const nook::Measured difference =
        nook::rmse(halves[0].view(), halves[1].view(), view.surface.view());
    if (!difference) throw support::Failure{"rmse: " + text_of(difference.error)};
    reference.standard_error = difference.value / 2;
    reference.visibility = std::move(halves[0]);
    const auto& other = halves[1];
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x)
            reference.visibility(x, y) = (reference.visibility(x, y) + other(x, y)) / 2;
    return reference;
}

}  // namespace report
