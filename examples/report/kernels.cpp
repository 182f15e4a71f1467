#include "kernels.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include <nook/measure/ssim.hpp>
#include <nook/work_map.hpp>

#include "checked.hpp"

namespace report {

namespace {

/// Samples that a form of k² per pixel may read on one view: a second or two.
constexpr double sample_budget = 1e9;

std::string digits(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
}

Kernel chebyshev(const View& view, const char* name, const std::string& brief,
                 const nook::ChebyshevOptions& options)
{
    Kernel kernel;
    kernel.name = name;
    kernel.brief = brief;
    if (options.radius > 0) {
        kernel.parameters["radius"] = options.radius;
        kernel.parameters["max_window"] = options.max_window;
    } else {
        kernel.parameters["window"] = options.window;
    }
    if (options.range) kernel.parameters["range"] = *options.range;
    kernel.parameters["bias"] = "automatic";
    kernel.parameters["border"] = "symmetric";
    kernel.run = [&view, options](const nook::ImageView<float>& visibility,
                                  nook::HeapScratch& scratch, nook::ThreadExecutor& threads) {
        return nook::chebyshev_ao(view.depth.view(), visibility, options, view.projection, {},
                                  scratch, threads);
    };
    return kernel;
}

/// The exact range check reads k² samples per pixel: over every n-th row if need be.
Kernel exact_range(const View& view, const nook::ChebyshevOptions& options,
                   const std::string& brief)
{
    Kernel kernel = chebyshev(view, "chebyshev-range-exact", brief, options);
    kernel.slow = true;
    const double surface = double(view.width()) * view.height() - double(view.background);
    const double samples = surface * options.window * options.window;
    const int most = (std::max)(view.height() / 4, 1);
    kernel.row_step =
        static_cast<int>(std::clamp(std::ceil(samples / sample_budget), 1.0, double(most)));
    kernel.parameters["range_check"] = "per pair of samples";
    if (kernel.row_step > 1) {
        kernel.parameters["rows"] = "1 in " + std::to_string(kernel.row_step);
        kernel.brief += ", 1 row in " + std::to_string(kernel.row_step);
    }
    auto active = std::make_shared<nook::Image<std::uint8_t>>(nook::WorkMap::groups(view.width()),
                                                              view.height());
    for (int y = 0; y < active->height(); ++y)
        for (int x = 0; x < active->width(); ++x) (*active)(x, y) = kernel.computes(y) ? 1 : 0;
    kernel.run = [&view, options, active](const nook::ImageView<float>& visibility,
                                          nook::HeapScratch&, nook::ThreadExecutor& threads) {
        return nook::chebyshev_ao_reference(view.depth.view(), visibility, options,
                                            {.sample_range = true, .paired = true}, view.projection,
                                            {active->view(), false}, threads);
    };
    return kernel;
}

double run_once(const Kernel& kernel, nook::Image<float>& visibility, nook::HeapScratch& scratch,
                nook::ThreadExecutor& threads, nook::Work& work)
{
    const auto start = std::chrono::steady_clock::now();
    work = checked(kernel.run(visibility.view(), scratch, threads), kernel.name.c_str());
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
    checked(nook::error_metrics(result.visibility.view(), reference.visibility.view(), result.error,
                                result.counted.view()),
            "error_metrics");
    const nook::Measured similarity =
        nook::ssim(result.visibility.view(), reference.visibility.view(), result.counted.view());
    if (!similarity) throw support::Failure{"ssim: " + text_of(similarity.error)};
    result.ssim = similarity.value;
}

}  // namespace

std::vector<Kernel> kernels_for(const View& view, double radius)
{
    nook::ChebyshevOptions fixed;
    fixed.window = default_window(view, radius);
    nook::ChebyshevOptions scaled;
    scaled.radius = radius;
    scaled.max_window = largest_window;
    // The ranges of the least error over the built-in scenes.
    nook::ChebyshevOptions ranged = fixed, paired = fixed;
    constexpr double most = (std::numeric_limits<double>::max)();
    ranged.range = (std::min)(1.5 * radius, most);
    paired.range = (std::min)(2 * radius, most);

    const std::string window = "window " + std::to_string(fixed.window);
    const auto range = [&](const nook::ChebyshevOptions& options) {
        return window + ", range " + digits(*options.range);
    };
    return {chebyshev(view, "chebyshev-window", window, fixed),
            chebyshev(view, "chebyshev-radius", "radius " + digits(radius), scaled),
            chebyshev(view, "chebyshev-range", range(ranged), ranged),
            exact_range(view, paired, range(paired))};
}

std::vector<Result> measure(const View& view, const Reference& reference,
                            const std::vector<Kernel>& kernels, nook::ThreadExecutor& threads,
                            Progress& progress)
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
    for (Result& result : results) measure_error(view, reference, result);
    return results;
}

nook::ErrorMetrics difference(const Result& one, const Result& other)
{
    nook::Image<std::uint8_t> both = one.counted;
    for (int y = 0; y < both.height(); ++y)
        for (int x = 0; x < both.width(); ++x)
            if (other.counted(x, y) == 0) both(x, y) = 0;
    nook::ErrorMetrics result;
    checked(
        nook::error_metrics(one.visibility.view(), other.visibility.view(), result, both.view()),
        "error_metrics");
    return result;
}

}  // namespace report
