#include "calibration_spaces.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/upsample.hpp>

namespace report {

namespace {

using Axes = std::vector<Axis>;
constexpr auto quality = AxisKind::quality, costly = AxisKind::costly, searched = AxisKind::free;
constexpr double infinite = std::numeric_limits<double>::infinity();

Axes operator+(Axes axes, const Axes& more)
{
    axes.insert(axes.end(), more.begin(), more.end());
    return axes;
}

/// Reads a setting in the order of its axes.
class Reader {
public:
    explicit Reader(const Setting& setting) : setting_{setting} {}
    [[nodiscard]] double number() { return setting_[next_++]; }
    [[nodiscard]] bool done() const { return next_ == setting_.size(); }
    [[nodiscard]] int whole() { return static_cast<int>(number()); }

private:
    const Setting& setting_;
    std::size_t next_ = 0;
};

// Chebyshev: the bias stays automatic.

Axis window_axis(const char* name)
{
    return {name, costly, 1, {0.25, 0.375, 0.5, 0.625, 0.75, 1, 1.25, 1.5, 2, 3}};
}
int window_of(const CalibrationView& view, double factor)
{
    return default_window(view.view, factor * view.radius);
}
nook::Outcome chebyshev(const CalibrationView& view, const nook::ChebyshevOptions& options,
                        CalibrationMemory& memory)
{
    return nook::chebyshev_ao(view.view.depth.view(), memory.visibility.view(), options,
                              view.view.projection, {}, memory.first);
}
nook::Outcome chebyshev_window(const CalibrationView& view, const Setting& setting,
                               CalibrationMemory& memory)
{
    nook::ChebyshevOptions options;
    options.window = window_of(view, setting[0]);
    return chebyshev(view, options, memory);
}
nook::Outcome chebyshev_radius(const CalibrationView& view, const Setting& setting,
                               CalibrationMemory& memory)
{
    nook::ChebyshevOptions options;
    options.radius = setting[0] * view.radius;
    return chebyshev(view, options, memory);
}
nook::Outcome chebyshev_range(const CalibrationView& view, const Setting& setting,
                              CalibrationMemory& memory)
{
    nook::ChebyshevOptions options;
    options.window = window_of(view, setting[0]);
    options.range = setting[1] * view.radius;
    return chebyshev(view, options, memory);
}

/// In pixels.
Axis blur_radius_axis(bool quick)
{
    return {"blur_radius", costly, double(nook::BlurOptions{}.radius),
            quick ? std::vector<double>{1, 4} : std::vector<double>{1, 2, 3, 4, 6}};
}

// Alchemy.

Axes alchemy_costs(bool quick)
{
    const double row{double(nook::SamplePattern::row)}, pixel{double(nook::SamplePattern::pixel)};
    if (quick)
        return {{"samples", quality, 16, {4, 8, 16, 32}},
                {"pattern", costly, row, {row}, {"row"}},
                {"contrast", costly, 1, {1, 1.5}}};
    return {{"samples", quality, 16, {4, 8, 12, 16, 24, 32, 48, 64}},
            {"pattern", costly, row, {row, pixel}, {"row", "pixel"}},
            {"contrast", costly, 1, {1, 1.5, 2}}};
}
/// With another pass to come, a power of the result is a small part of the cost.
Axes first_pass_costs(bool quick)
{
    Axes axes = alchemy_costs(quick);
    axes[1].values = {axes[1].standard};
    axes[2].values = {1, 1.5};
    return axes;
}
/// And a blur makes up for fewer samples.
Axes blurred_costs(bool quick)
{
    Axes axes = first_pass_costs(quick);
    axes[0].values = quick ? std::vector<double>{4, 8, 16} : std::vector<double>{4, 8, 16, 24, 32};
    return Axes{blur_radius_axis(quick)} + axes;
}
Axes alchemy_shape(bool quick)
{
    if (quick)
        return {{"intensity_in_radii", searched, 0.6, {0.4, 0.5, 0.6, 0.75, 1}},
                {"epsilon_in_square_radii", searched, 0.05, {0.025, 0.05, 0.1, 0.2}},
                {"radius_factor", searched, 1, {0.7, 0.85, 1, 1.2}},
                {"turns", searched, 7, {5, 7, 9}}};
    return {{"intensity_in_radii", searched, 0.6, {0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1, 1.2, 1.5}},
            {"epsilon_in_square_radii", searched, 0.05, {0.0125, 0.025, 0.05, 0.1, 0.2, 0.4}},
            {"radius_factor", searched, 1, {0.5, 0.7, 0.85, 1, 1.2, 1.5, 2}},
            {"turns", searched, 7, {3, 5, 7, 9, 11, 13}}};
}
Axes scalable_shape(bool quick)
{
    Axes axes = alchemy_shape(quick);
    axes[0].standard = 0.9;
    axes[0].values = quick ? std::vector<double>{0.6, 0.75, 0.9, 1.1, 1.4}
                           : std::vector<double>{0.3, 0.45, 0.6, 0.75, 0.9, 1.1, 1.4, 1.8, 2.4, 3};
    axes[1].standard = 0.15;
    axes[1].values = quick ? std::vector<double>{0.05, 0.1, 0.15, 0.25}
                           : std::vector<double>{0.01, 0.025, 0.05, 0.1, 0.15, 0.25, 0.4};
    axes[2].values = quick ? std::vector<double>{0.85, 1, 1.2, 1.5}
                           : std::vector<double>{0.7, 0.85, 1, 1.2, 1.5, 2, 2.5};
    return axes;
}
nook::AlchemyOptions alchemy_options(Reader& reader, double radius)
{
    nook::AlchemyOptions options;
    options.samples = reader.whole();
    options.pattern = static_cast<nook::SamplePattern>(reader.whole());
    options.contrast = reader.number();
    const double intensity = reader.number(), epsilon = reader.number();
    options.radius = reader.number() * radius;
    options.turns = reader.whole();
    options.intensity = intensity * options.radius;
    options.epsilon = epsilon * options.radius * options.radius;
    return options;
}
nook::Outcome alchemy(const CalibrationView& view, const nook::AlchemyOptions& options,
                      const nook::ImageView<float>& visibility, CalibrationMemory& memory)
{
    return nook::alchemy_ao(view.view.depth.view(), view.view.normal(), visibility, options,
                            view.view.projection, {}, memory.first);
}
template <nook::AlchemyFalloff falloff>
nook::Outcome alchemy(const CalibrationView& view, const Setting& setting,
                      CalibrationMemory& memory)
{
    Reader reader{setting};
    nook::AlchemyOptions options = alchemy_options(reader, view.radius);
    options.falloff = falloff;
    return alchemy(view, options, memory.visibility.view(), memory);
}

// A blur after another kernel, which wrote `memory.between`; upsampling.

Axes edge_axes(bool quick)
{
    const nook::BlurOptions usual;
    if (quick) return {{"tolerance", searched, usual.tolerance, {0.0025, 0.01, 0.04}}};
    return {{"tolerance", searched, usual.tolerance, {0.0025, 0.005, 0.01, 0.02, 0.04}},
            {"least_cosine", searched, usual.least_cosine, {0.3, 0.5, 0.7, 0.85}}};
}
/// Sets what `edge_axes` has.
template <class Options>
void set_edges(Options& options, Reader& reader)
{
    options.tolerance = reader.number();
    if (!reader.done()) options.least_cosine = reader.number();
}
nook::Outcome blurred(nook::Outcome outcome, const CalibrationView& view, int radius,
                      Reader& reader, CalibrationMemory& memory)
{
    if (!outcome) return outcome;
    nook::BlurOptions options;
    options.radius = radius;
    set_edges(options, reader);
    return nook::bilateral_blur(memory.between.view(), view.view.depth.view(), view.view.normal(),
                                memory.visibility.view(), options, view.view.projection, {},
                                memory.second);
}
/// A picture between two passes, made when it is first needed.
nook::ImageView<float> sized(nook::Image<float>& image, int width, int height)
{
    if (image.width() != width || image.height() != height) image = {width, height};
    return image.view();
}
nook::ImageView<float> between(CalibrationMemory& memory)
{
    return sized(memory.between, memory.visibility.width(), memory.visibility.height());
}
nook::Outcome alchemy_blurred(const CalibrationView& view, const Setting& setting,
                              CalibrationMemory& memory)
{
    Reader reader{setting};
    const int radius = reader.whole();
    const nook::AlchemyOptions options = alchemy_options(reader, view.radius);
    return blurred(alchemy(view, options, between(memory), memory), view, radius, reader, memory);
}

nook::Outcome alchemy_half(const CalibrationView& view, const Setting& setting,
                           CalibrationMemory& memory)
{
    Reader reader{setting};
    const nook::AlchemyOptions options = alchemy_options(reader, view.radius);
    const auto depth = view.view.depth.view();
    const nook::NormalSource normals = view.view.normal();
    const auto half = sized(memory.half, (depth.width + 1) / 2, (depth.height + 1) / 2);
    const nook::Outcome outcome =
        nook::alchemy_ao(nook::half_source(depth), nook::half_source(normals), half, options,
                         nook::half_projection(view.view.projection), {}, memory.first);
    if (!outcome) return outcome;
    nook::UpsampleOptions upsampling;
    set_edges(upsampling, reader);
    return nook::upsample(half, depth, normals, memory.visibility.view(), upsampling,
                          view.view.projection, {}, memory.second);
}

// Horizons and bitmasks.

Axes slice_axes(bool quick)
{
    if (quick) return {{"slices", quality, 3, {1, 2, 3}}, {"steps", quality, 3, {2, 3, 4, 8}}};
    return {{"slices", quality, 3, {1, 2, 3, 4, 6, 8}}, {"steps", quality, 3, {2, 3, 4, 6, 8, 12}}};
}
/// An infinite thickness is quicker than others, so this one costs time.
Axis horizon_thickness(bool quick)
{
    return {"thickness_in_radii", costly, infinite,
            quick ? std::vector<double>{1, infinite} : std::vector<double>{0.5, 1, 2, infinite}};
}
Axis slice_radius()
{
    return {"radius_factor", searched, 1, {0.5, 0.6, 0.7, 0.85, 1, 1.2, 1.5, 2}};
}
template <class Options>
Options slice_options(Reader& reader, double radius)
{
    Options options;
    options.slices = reader.whole();
    options.steps = reader.whole();
    const double thickness = reader.number();
    options.radius = reader.number() * radius;
    options.thickness = thickness * options.radius;
    return options;
}
nook::Outcome horizon(const CalibrationView& view, const nook::HorizonOptions& options,
                      const nook::ImageView<float>& visibility, CalibrationMemory& memory)
{
    return nook::horizon_ao(view.view.depth.view(), view.view.normal(), visibility, options,
                            view.view.projection, {}, memory.first);
}
nook::Outcome horizon(const CalibrationView& view, const Setting& setting,
                      CalibrationMemory& memory)
{
    Reader reader{setting};
    return horizon(view, slice_options<nook::HorizonOptions>(reader, view.radius),
                   memory.visibility.view(), memory);
}
nook::Outcome horizon_blurred(const CalibrationView& view, const Setting& setting,
                              CalibrationMemory& memory)
{
    Reader reader{setting};
    const int radius = reader.whole();
    const auto options = slice_options<nook::HorizonOptions>(reader, view.radius);
    return blurred(horizon(view, options, between(memory), memory), view, radius, reader, memory);
}
nook::Outcome bitmask(const CalibrationView& view, const Setting& setting,
                      CalibrationMemory& memory)
{
    Reader reader{setting};
    return nook::bitmask_ao(view.view.depth.view(), view.view.normal(), memory.visibility.view(),
                            slice_options<nook::BitmaskOptions>(reader, view.radius),
                            view.view.projection, {}, memory.first);
}

}  // namespace

std::vector<CalibrationSpace> calibration_spaces(bool quick)
{
    const Axis thickness = horizon_thickness(quick);
    const Axes slices = slice_axes(quick), shape = alchemy_shape(quick), edges = edge_axes(quick);
    Axis solid = thickness;
    solid.values = {solid.standard};
    return {
        {"chebyshev-window", {window_axis("window_factor")}, chebyshev_window},
        {"chebyshev-radius", {window_axis("radius_factor")}, chebyshev_radius},
        {"chebyshev-range",
         {window_axis("window_factor"),
          {"range_in_radii", searched, 1.5, {0.25, 0.375, 0.5, 0.75, 1, 1.5, 2, 3, 4}}},
         chebyshev_range},
        {"alchemy", alchemy_costs(quick) + shape, alchemy<nook::AlchemyFalloff::alchemy>},
        {"alchemy-blurred", blurred_costs(quick) + shape + edges, alchemy_blurred},
        {"alchemy-half", first_pass_costs(quick) + shape + edges, alchemy_half},
        {"scalable", alchemy_costs(quick) + scalable_shape(quick),
         alchemy<nook::AlchemyFalloff::scalable>},
        {"horizon", slices + Axes{thickness, slice_radius()}, horizon},
        {"horizon-blurred",
         Axes{blur_radius_axis(quick)} + slices + Axes{solid, slice_radius()} + edges,
         horizon_blurred},
        {"bitmask",
         slices + Axes{{"thickness_in_radii",
                        searched,
                        0.5,
                        {0.03125, 0.0625, 0.125, 0.1875, 0.25, 0.375, 0.5, 1, 2, infinite}},
                       slice_radius()},
         bitmask},
    };
}

}  // namespace report
