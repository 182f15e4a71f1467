#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include <glm/geometric.hpp>

#include <nook/depth/chebyshev_ao.hpp>

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

/// An image of which one row in `row_step` was computed, with the others repeated from the nearest.
nook::Image<float> filled(const nook::Image<float>& image, int row_step)
{
    nook::Image<float> result{image.width(), image.height()};
    for (int y = 0; y < image.height(); ++y) {
        int row = y - y % row_step + row_step / 2;
        if (row >= image.height()) row -= row_step;
        for (int x = 0; x < image.width(); ++x) result(x, y) = image(x, (std::max)(row, 0));
    }
    return result;
}

/// Image − reference.
Picture error_picture(const View& view, const nook::Image<float>& image,
                      const nook::Image<float>& reference)
{
    constexpr double most = 0.5;
    Picture picture{view.width(), view.height()};
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x)
            if (view.surface(x, y) != 0)
                picture.set(
                    x, y,
                    support::diverging((double{image(x, y)} - double{reference(x, y)}) / most));
    return support::with_scale(picture,
                               {support::diverging, -1, 1, {-most, 0, most}, "less the reference"});
}

/// Small enough for hundreds of them on a page.
Picture small(Picture picture)
{
    while (picture.width() > 480) picture = support::halved(picture);
    return picture;
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
                    const View& view, const std::vector<Traced>& references,
                    const HeightField* height_field, const std::vector<Run>& runs, bool all)
{
    const auto write = [&](const std::string& name, const Picture& picture) {
        support::write_jpeg(folder / (name + ".jpg"), small(picture));
        if (all) support::write_png(folder / (name + ".png"), picture);
    };
    write("shaded", shaded(scene, view));
    if (all) {
        support::write_png(folder / "depth.png", depth_picture(view));
        support::write_pfm(folder / "depth.pfm", view.depth.view());
        support::write_png(folder / "normals.png", normal_picture(view));
    }
    for (const Traced& reference : references) {
        const std::string name = std::string{"reference-"} + name_of(reference.meaning);
        write(name, grey(reference.visibility.view()));
        if (all) support::write_pfm(folder / (name + ".pfm"), reference.visibility.view());
    }
    const auto reference_of = [&](Meaning meaning) -> const nook::Image<float>& {
        return std::find_if(references.begin(), references.end(),
                            [&](const Traced& traced) { return traced.meaning == meaning; })
            ->visibility;
    };
    if (height_field != nullptr) {
        const nook::Image<float> image = filled(height_field->visibility, height_field->row_step);
        write("height-field", grey(image.view()));
        if (all)
            support::write_png(folder / "height-field-error.png",
                               error_picture(view, image, reference_of(Meaning::visibility)));
    }
    for (const Run& run : runs) {
        const nook::Image<float> image = filled(run.visibility, run.kernel.row_step);
        support::write_jpeg(folder / (run.kernel.id + ".jpg"), small(grey(image.view())));
        if (!all || (run.kernel.plan && run.kernel.plan->is_exact())) continue;
        support::write_png(folder / (run.kernel.id + ".png"), grey(image.view()));
        support::write_png(folder / (run.kernel.id + "-error.png"),
                           error_picture(view, image, reference_of(run.kernel.meaning)));
        if (run.kernel.is_default)
            support::write_png(folder / (run.kernel.id + "-composed.png"),
                               shaded(scene, view, image.view()));
    }
}

Picture plan_picture(const scenes::Scene& scene, const View& view, const nook::WorkMap& map)
{
    constexpr Rgb nothing{0.06f, 0.07f, 0.09f};
    const Picture colours = shaded(scene, view);
    Picture picture{view.width(), view.height()};
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x) {
            const bool surface = view.surface(x, y) != 0;
            const Rgb colour = colours.get(x, y);
            const float light =
                surface ? 0.21f * colour.r + 0.72f * colour.g + 0.07f * colour.b : 0.0f;
            if (map.is_active(x, y))
                picture.set(x, y, support::sequential(1) * (0.35f + 0.65f * light));
            else picture.set(x, y, surface ? Rgb{1, 1, 1} * (0.15f + 0.35f * light) : nothing);
        }
    return picture;
}

void write_plans(const std::filesystem::path& folder, const scenes::Scene& scene, const View& view,
                 const std::vector<PlanPicture>& plans, bool all)
{
    for (const PlanPicture& plan : plans) {
        const Picture picture = plan_picture(scene, view, plan.run->kernel.plan->map());
        support::write_jpeg(folder / (plan.name + ".jpg"), small(picture));
        if (all) support::write_png(folder / (plan.name + ".png"), picture);
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
