#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include <glm/geometric.hpp>

#include "../support/checked.hpp"
#include "../support/colour_map.hpp"

namespace report {

namespace {

using support::Picture;
using support::Rgb;

std::string text(const char* format, double value)
{
    char line[64];
    std::snprintf(line, sizeof line, format, value);
    return line;
}

Picture depth_picture(const View& view)
{
    // Over more than a hundredfold range a linear scale shows the farthest decade alone.
    const double first = view.nearest, last = (std::max)(view.farthest, first * (1 + 1e-6));
    const bool logarithmic = last > 100 * first;
    Picture picture{view.width(), view.height()};
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x) {
            if (view.surface(x, y) == 0) continue;
            const double depth = double{view.depth(x, y)};
            const double at = logarithmic ? std::log(depth / first) / std::log(last / first)
                                          : (depth - first) / (last - first);
            picture.set(x, y, support::sequential(1 - at));
        }
    const double middle = logarithmic ? std::sqrt(first * last) : (first + last) / 2;
    return support::with_scale(picture, {support::sequential,
                                         1,
                                         0,
                                         {first, middle, last},
                                         logarithmic ? "depth, logarithmic; background white"
                                                     : "depth; background white"});
}

Picture normal_picture(const View& view)
{
    Picture picture{view.width(), view.height()};
    const auto normal = view.normal();
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x)
            if (view.surface(x, y) != 0)
                picture.set(x, y,
                            {0.5f + 0.5f * normal.x(x, y), 0.5f + 0.5f * normal.y(x, y),
                             0.5f + 0.5f * normal.z(x, y)});
    return picture;
}

/// The row that a kernel computed nearest to `y`.
int computed_row(const Kernel& kernel, int y, int height)
{
    int row = y - y % kernel.row_step + kernel.row_step / 2;
    if (row >= height) row -= kernel.row_step;
    return (std::max)(row, 0);
}

/// The visibility with the rows that were left out repeated from the nearest; background is 1.
nook::Image<float> filled(const Result& result)
{
    nook::Image<float> image{result.visibility.width(), result.visibility.height()};
    for (int y = 0; y < image.height(); ++y) {
        const int row = computed_row(result.kernel, y, image.height());
        for (int x = 0; x < image.width(); ++x) image(x, y) = result.visibility(x, row);
    }
    return image;
}

Picture error_picture(const View& view, const Reference& reference, const Result& result)
{
    constexpr double most = 0.5;
    Picture picture{view.width(), view.height()};
    for (int y = 0; y < view.height(); ++y) {
        const int row = computed_row(result.kernel, y, view.height());
        for (int x = 0; x < view.width(); ++x)
            if (result.counted(x, row) != 0)
                picture.set(x, y,
                            support::diverging((double{result.visibility(x, row)} -
                                                double{reference.visibility(x, row)}) /
                                               most));
    }
    const std::string caption = result.kernel.name +
                                " - reference: blue too dark, red too bright; "
                                "RMSE " +
                                text("%.4f", result.error.rmse);
    return support::with_scale(picture, {support::diverging, -1, 1, {-most, 0, most}, caption});
}

}  // namespace

Picture grey(const nook::ImageView<const float>& visibility)
{
    Picture picture{visibility.width, visibility.height};
    for (int y = 0; y < visibility.height; ++y)
        for (int x = 0; x < visibility.width; ++x) {
            const float value = visibility(x, y);
            picture.set(x, y, {value, value, value});
        }
    return picture;
}

Picture shaded(const scenes::Scene& scene, const View& view,
               const nook::ImageView<const float>& visibility)
{
    Picture picture{view.width(), view.height()};
    const glm::dvec3 light =
        nook::direction_to_view(view.frame, glm::normalize(glm::dvec3{-0.7, 1, 0.5}));
    const auto normal = view.normal();
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x) {
            if (view.surface(x, y) == 0) continue;
            const Rgb colour =
                scene.albedo.empty() ? Rgb{0.75f, 0.75f, 0.75f} : scene.albedo[view.face(x, y)];
            const double cosine =
                glm::dot(glm::dvec3{normal.x(x, y), normal.y(x, y), normal.z(x, y)}, light);
            const double diffuse = 0.40 + 0.60 * (std::max)(cosine, 0.0);
            const float open = visibility.empty() ? 1.0f : visibility(x, y);
            picture.set(x, y, support::srgb(colour * open * static_cast<float>(diffuse)));
        }
    return picture;
}

void write_pictures(const std::filesystem::path& folder, const scenes::Scene& scene,
                    const View& view, const Reference& reference,
                    const std::vector<Result>& results)
{
    support::write_png(folder / "shaded.png", shaded(scene, view));
    support::write_png(folder / "depth.png", depth_picture(view));
    support::write_pfm(folder / "depth.pfm", view.depth.view());
    support::write_png(folder / "normals.png", normal_picture(view));
    support::write_png(folder / "reference.png", grey(reference.visibility.view()));
    support::write_pfm(folder / "reference.pfm", reference.visibility.view());
    support::write_png(folder / "reference-composed.png",
                       shaded(scene, view, reference.visibility.view()));
    Result height_field;
    height_field.kernel.name = "height-field";
    height_field.kernel.row_step = reference.height_field_step;
    height_field.visibility = reference.height_field;
    height_field.counted = view.surface;
    height_field.error = reference.unknown;
    support::write_png(folder / "height-field.png", grey(filled(height_field).view()));
    support::write_png(folder / "height-field-error.png",
                       error_picture(view, reference, height_field));
    for (const Result& result : results) {
        const nook::Image<float> visibility = filled(result);
        const std::string& name = result.kernel.name;
        support::write_png(folder / (name + ".png"), grey(visibility.view()));
        support::write_png(folder / (name + "-composed.png"),
                           shaded(scene, view, visibility.view()));
        support::write_png(folder / (name + "-error.png"), error_picture(view, reference, result));
    }
}

void write_figures(const std::filesystem::path& folder, const View& view, double radius,
                   nook::ThreadExecutor& threads)
{
    nook::Image<float> visibility{view.width(), view.height()};
    nook::HeapScratch scratch;
    const auto run = [&](const nook::ChebyshevOptions& options) {
        support::checked(nook::chebyshev_ao(view.depth.view(), visibility.view(), options,
                                            view.projection, {}, scratch, threads),
                         "chebyshev_ao");
        return support::halved(grey(visibility.view()));
    };
    nook::ChebyshevOptions plain;
    plain.window = default_window(view, radius);
    plain.bias = 0;
    plain.clamp = false;
    nook::ChebyshevOptions biased = plain;
    const double bias = (std::min)(0.01 * radius * radius, 1e300);
    biased.bias = bias;
    nook::ChebyshevOptions clamped = biased;
    clamped.clamp = true;
    support::write_png(folder / "figure-2.png",
                       support::strip({run(plain), run(biased), run(clamped)},
                                      {"equation 2, no bias", text("equation 2, bias %.2g", bias),
                                       "equation 3: with the clamp"}));

    using limits = std::numeric_limits<double>;
    nook::ChebyshevOptions ranged;
    ranged.window = plain.window;
    std::vector<Picture> pictures{run(ranged)};
    std::vector<std::string> captions{"no range check"};
    for (const double factor : {4.0, 1.0, 0.25}) {
        ranged.range = std::clamp(factor * radius, limits::denorm_min(), (limits::max)());
        pictures.push_back(run(ranged));
        captions.push_back(text("range %.3g", *ranged.range));
    }
    support::write_png(folder / "figure-4.png", support::strip(pictures, captions));
}

}  // namespace report
