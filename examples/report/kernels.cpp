#include "kernels.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <nook/measure/ssim.hpp>
#include <nook/work_map.hpp>

#include "../support/checked.hpp"

namespace report {

namespace {

double run_once(const Kernel& kernel, nook::Image<float>& visibility, nook::HeapScratch& scratch,
                nook::ThreadExecutor& threads, nook::Work& work)
{
    const auto start = std::chrono::steady_clock::now();
    work = support::checked(kernel.run(visibility.view(), scratch, threads), kernel.name.c_str());
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

Timing summary(std::vector<double> times, int threads)
{
    std::sort(times.begin(), times.end());
    const std::size_t count = times.size();
    Timing timing;
    timing.threads = threads;
    timing.rounds = static_cast<int>(count);
    timing.fastest = times.front();
    timing.median = (times[(count - 1) / 2] + times[count / 2]) / 2;
    timing.p90 = times[(9 * count + 9) / 10 - 1];
    return timing;
}

void measure_error(const View& view, const Reference& reference, Result& result)
{
    result.counted = view.surface;
    for (int y = 0; y < view.height(); ++y)
        if (!result.kernel.computes(y))
            for (int x = 0; x < view.width(); ++x) result.counted(x, y) = 0;
    support::checked(nook::error_metrics(result.visibility.view(), reference.visibility.view(),
                                         result.error, result.counted.view()),
                     "error_metrics");
    const nook::Measured similarity =
        nook::ssim(result.visibility.view(), reference.visibility.view(), result.counted.view());
    if (!similarity) throw support::Failure{"ssim: " + support::text_of(similarity.error)};
    result.ssim = similarity.value;
    nook::Image<std::uint8_t> both = result.counted;
    for (int y = 0; y < view.height(); ++y)
        if (!reference.computes_height_field(y))
            for (int x = 0; x < view.width(); ++x) both(x, y) = 0;
    support::checked(nook::error_metrics(result.visibility.view(), reference.height_field.view(),
                                         result.height_field, both.view()),
                     "error_metrics");
}

/// How far the kernel is from its own formula.
void measure_exactness(const View& view, nook::ThreadExecutor& threads, Result& result)
{
    const Kernel& kernel = result.kernel;
    if (!kernel.exact) return;
    nook::Image<std::uint8_t> rows{nook::WorkMap::groups(view.width()), view.height()};
    nook::Image<std::uint8_t> counted = result.counted;
    for (int y = 0; y < view.height(); ++y) {
        for (int x = 0; x < rows.width(); ++x) rows(x, y) = kernel.computes_exactly(y) ? 1 : 0;
        if (!kernel.computes_exactly(y))
            for (int x = 0; x < view.width(); ++x) counted(x, y) = 0;
    }
    nook::Image<float> exact{view.width(), view.height()};
    support::checked(kernel.exact(exact.view(), {rows.view(), false}, threads),
                     kernel.name.c_str());
    result.exact.emplace();
    support::checked(
        nook::error_metrics(result.visibility.view(), exact.view(), *result.exact, counted.view()),
        "error_metrics");
}

}  // namespace

std::vector<Kernel> kernels_for(const View& view, double radius)
{
    std::vector<Kernel> kernels;
    add_depth_kernels(view, radius, kernels);
    add_surface_kernels(view, radius, kernels);
    return kernels;
}

std::vector<Result> measure(const View& view, const Reference& reference,
                            const std::vector<Kernel>& kernels, nook::ThreadExecutor& threads,
                            support::Progress& progress)
{
    constexpr int rounds = 7;
    constexpr double time_limit = 6000;  // milliseconds per number of threads, after three rounds
    std::vector<Result> results(kernels.size());
    for (std::size_t i = 0; i < kernels.size(); ++i) {
        results[i].kernel = kernels[i];
        results[i].visibility = {view.width(), view.height()};
    }
    std::vector<nook::HeapScratch> scratch(kernels.size());
    nook::ThreadExecutor alone{1};
    std::vector<nook::ThreadExecutor*> executors{&alone};
    if (threads.concurrency() > 1) executors.push_back(&threads);
    for (nook::ThreadExecutor* executor : executors) {
        const int workers = executor->concurrency();
        progress.step("timing with " + std::to_string(workers) +
                      (workers == 1 ? " thread" : " threads"));
        std::vector<std::vector<double>> times(kernels.size());
        double total = 0;
        for (int round = 0; round <= rounds && (round < 4 || total < time_limit); ++round) {
            for (std::size_t i = 0; i < kernels.size(); ++i) {
                if (kernels[i].slow) continue;
                const double time = run_once(kernels[i], results[i].visibility, scratch[i],
                                             *executor, results[i].work);
                total += time;
                if (round > 0) times[i].push_back(time);
            }
            progress.share(double(round) / rounds);
        }
        for (std::size_t i = 0; i < kernels.size(); ++i)
            if (!times[i].empty()) results[i].timings.push_back(summary(times[i], workers));
    }
    progress.step("running the slow forms");
    for (std::size_t i = 0; i < kernels.size(); ++i)
        if (kernels[i].slow) {
            const double time =
                run_once(kernels[i], results[i].visibility, scratch[i], threads, results[i].work);
            results[i].timings.push_back(summary({time}, threads.concurrency()));
        }
    progress.step("measuring the errors");
    for (Result& result : results) {
        measure_error(view, reference, result);
        measure_exactness(view, threads, result);
    }
    return results;
}

nook::ErrorMetrics difference(const Result& one, const Result& other)
{
    nook::Image<std::uint8_t> both = one.counted;
    for (int y = 0; y < both.height(); ++y)
        for (int x = 0; x < both.width(); ++x)
            if (other.counted(x, y) == 0) both(x, y) = 0;
    nook::ErrorMetrics result;
    support::checked(
        nook::error_metrics(one.visibility.view(), other.visibility.view(), result, both.view()),
        "error_metrics");
    return result;
}

}  // namespace report
