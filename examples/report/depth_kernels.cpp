#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/work_map.hpp>

#include "kernels.hpp"

namespace report {

namespace {

/// Samples that a form of k² per pixel may read on one view: a second or two.
constexpr double sample_budget = 1e9;
/// The same for each comparison with an exact form.
constexpr double exact_budget = 5e7;

/// How many rows apart a form of k² samples per pixel may be computed within a budget.
int row_step(const View& view, int window, double budget)
{
    const double surface = double(view.width()) * view.height() - double(view.background);
    const int most = (std::max)(view.height() / 4, 1);
    return static_cast<int>(
        std::clamp(std::ceil(surface * window * window / budget), 1.0, double(most)));
}

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
    kernel.exact_step =
        row_step(view, options.radius > 0 ? options.max_window / 2 : options.window, exact_budget);
    kernel.exact = [&view, options](const nook::ImageView<float>& visibility,
                                    const nook::WorkMap& rows, nook::ThreadExecutor& threads) {
        return nook::chebyshev_ao_reference(view.depth.view(), visibility, options, {},
                                            view.projection, rows, threads);
    };
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
    kernel.exact = nullptr;
    kernel.row_step = row_step(view, options.window, sample_budget);
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

}  // namespace

void add_depth_kernels(const View& view, double radius, std::vector<Kernel>& kernels)
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
    kernels.push_back(chebyshev(view, "chebyshev-window", window, fixed));
    kernels.push_back(chebyshev(view, "chebyshev-radius", "radius " + digits(radius), scaled));
    kernels.push_back(chebyshev(view, "chebyshev-range", range(ranged), ranged));
    kernels.push_back(exact_range(view, paired, range(paired)));
}

}  // namespace report
