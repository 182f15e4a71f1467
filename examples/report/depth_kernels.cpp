#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/work_map.hpp>

#include "counted_scratch.hpp"
#include "kernels.hpp"

namespace report {

namespace {

using Visibility = nook::ImageView<float>;

/// Samples that a form of k² per pixel may read on one view: about a second, or a part of one.
constexpr double sample_budget = 3e8, quick_sample_budget = 5e7;

/// How many rows apart a form of k² samples per pixel may be computed within a budget.
int row_step(const View& view, int window, double budget)
{
    const double surface = double(view.width()) * view.height() - double(view.background);
    const int most = (std::max)(view.height() / 4, 1);
    return static_cast<int>(
        std::clamp(std::ceil(surface * window * window / budget), 1.0, double(most)));
}

/// Pixels in the window of a surface pixel, on average.
double mean_samples(const View& view, const nook::ChebyshevOptions& options)
{
    if (!(options.radius > 0)) return double(options.window) * options.window;
    double sum = 0, count = 0;
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x) {
            if (view.surface(x, y) == 0) continue;
            const auto pixels =
                nook::pixels_per_length(view.projection, options.radius, double{view.depth(x, y)});
            const auto across = [&](double radius) {
                return 2 * std::floor((std::min)(radius, double(options.max_window / 2))) + 1;
            };
            sum += across(pixels.x) * across(pixels.y);
            ++count;
        }
    return count > 0 ? sum / count : 1;
}

Json parameters_of(const nook::ChebyshevOptions& options)
{
    Json parameters = Json::object();
    if (options.radius > 0) {
        parameters["radius"] = options.radius;
        parameters["max_window"] = options.max_window;
    } else {
        parameters["window"] = options.window;
    }
    if (options.range) parameters["range"] = *options.range;
    parameters["bias"] = "automatic";
    parameters["border"] = "symmetric";
    return parameters;
}

Kernel chebyshev(const View& view, const char* name, const std::string& suffix, std::string setting,
                 const nook::ChebyshevOptions& options)
{
    Kernel kernel;
    kernel.name = name;
    kernel.id = kernel.name + '-' + suffix;
    kernel.setting = std::move(setting);
    kernel.parameters = parameters_of(options);
    const auto scratch = std::make_shared<CountedScratch>();
    kernel.passes = {{"windows", [&view, options, scratch](const Visibility& visibility,
                                                           nook::ThreadExecutor& threads) {
                          return nook::chebyshev_ao(view.depth.view(), visibility, options,
                                                    view.projection, {}, *scratch, threads);
                      }}};
    kernel.exact = [&view, options](const Visibility& visibility, const nook::WorkMap& rows,
                                    nook::ThreadExecutor& threads) {
        return nook::chebyshev_ao_reference(view.depth.view(), visibility, options, {},
                                            view.projection, rows, threads);
    };
    kernel.exact_samples = mean_samples(view, options);
    kernel.memory = [scratch] { return scratch->bytes(); };
    return kernel;
}

/// The range check of each sample reads k² of them per pixel: over every n-th row if need be.
Kernel exact_range(const Setup& setup, const std::string& suffix, std::string setting,
                   const nook::ChebyshevOptions& options)
{
    const View& view = setup.view;
    Kernel kernel;
    kernel.name = "chebyshev-range-exact";
    kernel.id = kernel.name + '-' + suffix;
    kernel.setting = std::move(setting);
    kernel.parameters = parameters_of(options);
    kernel.parameters["range_check"] = "per pair of samples";
    kernel.slow = true;
    kernel.row_step =
        row_step(view, options.window, setup.quick ? quick_sample_budget : sample_budget);
    const auto active = std::make_shared<nook::Image<std::uint8_t>>(
        nook::WorkMap::groups(view.width()), view.height());
    for (int y = 0; y < active->height(); ++y)
        for (int x = 0; x < active->width(); ++x) (*active)(x, y) = kernel.computes(y) ? 1 : 0;
    kernel.passes = {{"windows", [&view, options, active](const Visibility& visibility,
                                                          nook::ThreadExecutor& threads) {
                          nook::Outcome outcome = nook::chebyshev_ao_reference(
                              view.depth.view(), visibility, options,
                              {.sample_range = true, .paired = true}, view.projection,
                              {active->view(), false}, threads);
                          // Rows that are left out for time are no saving.
                          outcome.work.skipped = 0;
                          return outcome;
                      }}};
    kernel.memory = [] { return std::size_t{0}; };
    return kernel;
}

}  // namespace

void add_depth_kernels(const Setup& setup, std::vector<Kernel>& kernels)
{
    if (setup.cell.unlimited()) return;
    const View& view = setup.view;
    const double radius = setup.cell.radius;
    constexpr double most = (std::numeric_limits<double>::max)();
    const auto times = [&](double factor) { return (std::min)(factor * radius, most); };

    // A bound of the windows that grows with them; the middle one is the library's default.
    struct Size {
        double factor;
        int max_window;
    };
    constexpr int usual = nook::ChebyshevOptions{}.max_window;
    constexpr std::array<Size, 3> sizes{{{0.5, usual / 2}, {1, usual}, {2, 2 * usual - 1}}};
    static_assert(usual / 2 % 2 == 1);

    nook::ChebyshevOptions fixed;
    fixed.window = default_window(view, radius);
    for (const Size& size : sizes) {
        if (setup.quick && size.factor != 1) continue;
        nook::ChebyshevOptions options;
        options.window = default_window(view, times(size.factor));
        // At the least and the largest window there is nothing to halve or to double.
        if (size.factor != 1 && options.window == fixed.window) continue;
        kernels.push_back(chebyshev(view, "chebyshev-window", digits(size.factor),
                                    "window " + std::to_string(options.window), options));
        kernels.back().is_default = size.factor == 1;
    }
    for (const Size& size : sizes) {
        if (setup.quick && size.factor != 1) continue;
        nook::ChebyshevOptions options;
        options.radius = times(size.factor);
        options.max_window = size.max_window;
        kernels.push_back(chebyshev(view, "chebyshev-radius", digits(size.factor),
                                    "radius " + digits(options.radius) + ", windows up to " +
                                        std::to_string(options.max_window),
                                    options));
        kernels.back().is_default = size.factor == 1;
    }
    const auto ranged = [&](double factor) {
        nook::ChebyshevOptions options = fixed;
        options.range = times(factor);
        return options;
    };
    const auto text_of = [&](const nook::ChebyshevOptions& options) {
        return "window " + std::to_string(options.window) + ", range " + digits(*options.range);
    };
    for (const double factor : {0.75, 1.5, 3.0}) {
        if (setup.quick && factor != 1.5) continue;
        const nook::ChebyshevOptions options = ranged(factor);
        kernels.push_back(
            chebyshev(view, "chebyshev-range", digits(factor), text_of(options), options));
    }
    // The range of the least error over the built-in scenes.
    const nook::ChebyshevOptions paired = ranged(2);
    kernels.push_back(exact_range(setup, "2", text_of(paired), paired));
}

}  // namespace report
