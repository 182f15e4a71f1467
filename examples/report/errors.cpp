#include "errors.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nook/measure/monotone_fit.hpp>
#include <nook/measure/rank_correlation.hpp>
#include <nook/measure/ssim.hpp>
#include <nook/owned_image.hpp>
#include <nook/work_map.hpp>

#include "../support/checked.hpp"

namespace report {

namespace {

using Mask = nook::Image<std::uint8_t>;

/// Samples that a slow form may read on one view, of a usual size and of a small one: a fraction of a
/// second.
constexpr double exact_budget = 5e7, small_exact_budget = 5e6;
constexpr double small_picture = 200'000;  // pixels

void throw_if(const nook::Error& error, const char* what)
{
    if (error) throw support::Failure{std::string{what} + ": " + support::text_of(error)};
}

nook::ErrorMetrics metrics_of(const nook::ImageView<const float>& image,
                              const nook::ImageView<const float>& reference,
                              const nook::ImageView<const std::uint8_t>& counted)
{
    nook::ErrorMetrics error;
    support::checked(nook::error_metrics(image, reference, error, counted), "error_metrics");
    return error;
}

/// A term of the split, null when there is nothing to compare.
Json term_of(const nook::Image<float>& image, const nook::Image<float>& reference,
             const Mask& counted)
{
    const nook::ErrorMetrics error = metrics_of(image.view(), reference.view(), counted.view());
    return error.pixels > 0 ? json_of(error) : Json();
}

/// The values of the pixels that count, row by row.
std::vector<float> counted_values(const nook::ImageView<const float>& image,
                                  const nook::ImageView<const std::uint8_t>& counted)
{
    std::vector<float> values;
    values.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            if (counted.empty() || counted(x, y) != 0) values.push_back(image(x, y));
    return values;
}

/// Takes the rows out of a mask for which `keep(y)` is false.
template <class F>
Mask with_rows(Mask mask, const F& keep)
{
    for (int y = 0; y < mask.height(); ++y)
        if (!keep(y))
            for (int x = 0; x < mask.width(); ++x) mask(x, y) = 0;
    return mask;
}

/// Of the rows with pixels that count, as many as the slow form may compute, spread evenly.
Mask within_budget(Mask counted, double samples_per_pixel)
{
    std::vector<int> rows;
    double pixels = 0;
    for (int y = 0; y < counted.height(); ++y) {
        int in_row = 0;
        for (int x = 0; x < counted.width(); ++x) in_row += counted(x, y) != 0 ? 1 : 0;
        if (in_row > 0) rows.push_back(y);
        pixels += in_row;
    }
    const double all = double(counted.width()) * counted.height();
    const double budget = all < small_picture ? small_exact_budget : exact_budget;
    // Four rows at the least, lest they show one corner of the scene.
    const double most = (std::max)(double(rows.size() / 4), 1.0);
    const auto step = static_cast<std::size_t>(
        std::clamp(std::ceil(pixels * samples_per_pixel / budget), 1.0, most));
    std::vector<bool> keep(static_cast<std::size_t>(counted.height()));
    for (std::size_t i = step / 2; i < rows.size(); i += step)
        keep[static_cast<std::size_t>(rows[i])] = true;
    return with_rows(std::move(counted), [&](int y) { return keep[static_cast<std::size_t>(y)]; });
}

/// The kernel's slow form in the rows that hold pixels that count; 1 elsewhere.
nook::Image<float> exact_form(const Kernel& kernel, const Mask& counted,
                              nook::ThreadExecutor& threads)
{
    Mask active{nook::WorkMap::groups(counted.width()), counted.height()};
    for (int y = 0; y < counted.height(); ++y) {
        const std::uint8_t* const row = counted.data() + std::ptrdiff_t{y} * counted.width();
        const bool any =
            std::any_of(row, row + counted.width(), [](std::uint8_t pixel) { return pixel != 0; });
        for (int group = 0; group < active.width(); ++group) active(group, y) = any ? 1 : 0;
    }
    nook::Image<float> visibility{counted.width(), counted.height(), 1.0f};
    support::checked(kernel.exact(visibility.view(), {active.view(), false}, threads),
                     (kernel.id + ", its slow form").c_str());
    return visibility;
}

/// It looks at depths and normals: what a height field knows is all that it can.
bool sees_a_screen(const Kernel& kernel)
{
    if (kernel.meaning != Meaning::visibility) return false;
    for (const KernelInfo& info : kernel_infos())
        if (info.name == kernel.name) {
            const std::string_view family = info.family;
            return family == "depth" || family == "surface";
        }
    return false;
}

}  // namespace

Json json_of(const nook::ErrorMetrics& error)
{
    return {{"rmse", error.rmse}, {"mae", error.mae},     {"bias", error.bias},
            {"p99", error.p99},   {"max", error.maximum}, {"pixels", error.pixels}};
}

Json error_of(const nook::ImageView<const float>& image,
              const nook::ImageView<const float>& reference,
              const nook::ImageView<const std::uint8_t>& counted, nook::ThreadExecutor& threads)
{
    // Before anything that goes by their sizes.
    const nook::ErrorMetrics metrics = metrics_of(image, reference, counted);
    const std::vector<float> first = counted_values(image, counted);
    const std::vector<float> second = counted_values(reference, counted);
    nook::Measured similarity;
    nook::MonotoneFit fit;
    nook::Outcome fitted;
    nook::RankCorrelation ranks;
    // The two that sort take the most time.
    threads.for_each(3, [&](int task, int) {
        if (task == 0) ranks = nook::spearman(first.data(), second.data(), first.size());
        if (task == 1) fitted = nook::monotone_fit(image, reference, fit, counted);
        if (task == 2) similarity = nook::ssim(image, reference, counted);
    });
    throw_if(ranks.error, "spearman");
    throw_if(fitted.error, "monotone_fit");
    throw_if(similarity.error, "ssim");
    Json error = json_of(metrics);
    error["ssim"] = similarity.value;
    error["fitted_rmse"] = fit.rmse;
    error["rank_correlation"] = ranks.value;
    return error;
}

void add_errors(const View& view, const Run& run, const Traced& reference,
                const HeightField* height_field, nook::ThreadExecutor& threads, Json& result)
{
    const Kernel& kernel = run.kernel;
    const Mask counted = with_rows(view.surface, [&](int y) { return kernel.computes(y); });
    result["error"] =
        error_of(run.visibility.view(), reference.visibility.view(), counted.view(), threads);

    const HeightField* const known = sees_a_screen(kernel) ? height_field : nullptr;
    Mask common = counted;
    if (known != nullptr)
        common = with_rows(std::move(common), [&](int y) { return known->computes(y); });
    result["height_field_error"] =
        known != nullptr ? term_of(run.visibility, known->visibility, common) : Json();

    result["estimator_error"] = Json();
    result["own_error"] = Json();
    if (!kernel.exact) return;
    common = within_budget(std::move(common), kernel.exact_samples);
    const nook::Image<float> exact = exact_form(kernel, common, threads);
    if (known != nullptr) result["estimator_error"] = term_of(exact, known->visibility, common);
    result["own_error"] = term_of(run.visibility, exact, common);
}

}  // namespace report
