#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/upsample.hpp>

#include "counted_scratch.hpp"
#include "kernels.hpp"

namespace report {

namespace {

using Visibility = nook::ImageView<float>;

/// What a kernel of two passes keeps beside the scratch of the first one.
struct Between {
    nook::Image<float> image;
    CountedScratch scratch;

    Between(int width, int height) : image{width, height} {}
    [[nodiscard]] std::size_t bytes() const { return bytes_of(image) + scratch.bytes(); }
};

/// A kernel of one pass, and its exact form of the same options.
template <class Options, class Run, class Exact>
Kernel kernel_of(const View& view, const char* name, const std::string& suffix, std::string setting,
                 const Options& options, const Run& run, const Exact& exact)
{
    Kernel kernel;
    kernel.name = name;
    kernel.id = kernel.name + '-' + suffix;
    kernel.setting = std::move(setting);
    kernel.parameters["radius"] = options.radius;
    const auto scratch = std::make_shared<CountedScratch>();
    kernel.passes = {{"samples", [&view, options, run, scratch](const Visibility& visibility,
                                                                nook::ThreadExecutor& threads) {
                          return run(view.depth.view(), view.normal(), visibility, options,
                                     view.projection, nook::WorkMap{}, *scratch, threads);
                      }}};
    kernel.exact = [&view, options, exact](const Visibility& visibility, const nook::WorkMap& rows,
                                           nook::ThreadExecutor& threads) {
        return exact(view.depth.view(), view.normal(), visibility, options, view.projection, rows,
                     threads);
    };
    kernel.memory = [scratch] { return scratch->bytes(); };
    return kernel;
}

Kernel alchemy(const View& view, const char* name, const nook::AlchemyOptions& options)
{
    const std::string samples = std::to_string(options.samples);
    Kernel kernel = kernel_of(
        view, name, samples, samples + " samples", options,
        [](auto&&... all) { return nook::alchemy_ao(all...); },
        [](auto&&... all) { return nook::alchemy_ao_reference(all...); });
    kernel.parameters["samples"] = options.samples;
    kernel.parameters["intensity"] = "automatic";
    kernel.parameters["epsilon"] = "automatic";
    kernel.parameters["bias"] = "automatic";
    kernel.exact_samples = options.samples;
    kernel.is_default = options.samples == nook::AlchemyOptions{}.samples;
    return kernel;
}

/// GTAO or the bitmask.
template <class Options, class Run, class Exact>
Kernel sliced(const View& view, const char* name, const Options& options, const Json& thickness,
              const Run& run, const Exact& exact)
{
    const std::string slices = std::to_string(options.slices);
    const std::string steps = std::to_string(options.steps);
    Kernel kernel = kernel_of(
        view, name, slices + 'x' + steps,
        slices + (options.slices == 1 ? " slice, 2 x " : " slices, 2 x ") + steps + " samples",
        options, run, exact);
    kernel.parameters["slices"] = options.slices;
    kernel.parameters["steps"] = options.steps;
    kernel.parameters["thickness"] = thickness;
    kernel.parameters["bias"] = "automatic";
    kernel.exact_samples = 2.0 * options.slices * options.steps;
    kernel.is_default = options.slices == Options{}.slices && options.steps == Options{}.steps;
    return kernel;
}

/// The kernel, and a blur that keeps to surfaces.
Kernel blurred(const View& view, Kernel kernel)
{
    const auto between = std::make_shared<Between>(view.width(), view.height());
    const nook::BlurOptions options;
    const std::string suffix = kernel.id.substr(kernel.name.size());
    kernel.name += "-blurred";
    kernel.id = kernel.name + suffix;
    kernel.setting += ", blur";
    kernel.parameters["blur_radius"] = options.radius;
    kernel.parameters["blur_tolerance"] = options.tolerance;
    kernel.exact = nullptr;
    kernel.passes.front().run = [between, run = kernel.passes.front().run](
                                    const Visibility&, nook::ThreadExecutor& threads) {
        return before_last(run(between->image.view(), threads));
    };
    kernel.passes.push_back({"blur", [&view, between, options](const Visibility& visibility,
                                                               nook::ThreadExecutor& threads) {
                                 return nook::bilateral_blur(between->image.view(),
                                                             view.depth.view(), view.normal(),
                                                             visibility, options, view.projection,
                                                             {}, between->scratch, threads);
                             }});
    kernel.memory = [between, memory = kernel.memory] { return memory() + between->bytes(); };
    return kernel;
}

/// At every second pixel of every second row, and brought back.
Kernel half_size(const View& view, const nook::AlchemyOptions& options)
{
    Kernel kernel = alchemy(view, "alchemy-half", options);
    const auto between = std::make_shared<Between>((view.width() + 1) / 2, (view.height() + 1) / 2);
    const auto scratch = std::make_shared<CountedScratch>();
    kernel.setting += ", half size";
    kernel.parameters["half_size"] = true;
    kernel.without = "alchemy-" + std::to_string(options.samples);
    kernel.exact = nullptr;
    kernel.passes = {
        {"half size",
         [&view, between, options, scratch](const Visibility&, nook::ThreadExecutor& threads) {
             const nook::NormalSource normals = view.normal();
             return before_last(nook::alchemy_ao(nook::half_source(view.depth.view()),
                                                 nook::half_source(normals), between->image.view(),
                                                 options, nook::half_projection(view.projection),
                                                 {}, *scratch, threads));
         }},
        {"upsample", [&view, between](const Visibility& visibility, nook::ThreadExecutor& threads) {
             return nook::upsample(between->image.view(), view.depth.view(), view.normal(),
                                   visibility, nook::UpsampleOptions{}, view.projection, {},
                                   between->scratch, threads);
         }}};
    kernel.memory = [between, scratch] { return scratch->bytes() + between->bytes(); };
    return kernel;
}

struct Slices {
    int slices, steps;
};

/// The settings of a quick run, or of a full one.
template <class T>
std::vector<T> chosen(const Setup& setup, std::initializer_list<T> few,
                      std::initializer_list<T> all)
{
    return setup.quick ? few : all;
}

}  // namespace

void add_surface_kernels(const Setup& setup, std::vector<Kernel>& kernels)
{
    if (setup.cell.unlimited()) return;
    const View& view = setup.view;
    const double radius = setup.cell.radius;

    const auto alchemy_options = [&](int samples, nook::AlchemyFalloff falloff) {
        nook::AlchemyOptions options;
        options.radius = radius;
        options.samples = samples;
        options.falloff = falloff;
        return options;
    };
    const auto plain = [&](int samples) {
        return alchemy_options(samples, nook::AlchemyFalloff::alchemy);
    };
    const auto scalable = [&](int samples) {
        return alchemy_options(samples, nook::AlchemyFalloff::scalable);
    };
    const std::vector<int> samples = chosen(setup, {4, 16, 64}, {4, 8, 16, 32, 64});
    for (const int n : samples) kernels.push_back(alchemy(view, "alchemy", plain(n)));
    for (const int n : chosen(setup, {8, 16}, {4, 8, 16}))
        kernels.push_back(blurred(view, alchemy(view, "alchemy", plain(n))));
    for (const int n : chosen(setup, {16}, {8, 16, 32}))
        kernels.push_back(half_size(view, plain(n)));
    for (const int n : samples) kernels.push_back(alchemy(view, "scalable", scalable(n)));
    for (const int n : chosen(setup, {16}, {8, 16}))
        kernels.push_back(blurred(view, alchemy(view, "scalable", scalable(n))));

    const auto horizon = [&](const Slices& slices) {
        nook::HorizonOptions options;
        options.radius = radius;
        options.slices = slices.slices;
        options.steps = slices.steps;
        return sliced(
            view, "horizon", options, "infinite",
            [](auto&&... all) { return nook::horizon_ao(all...); },
            [](auto&&... all) { return nook::horizon_ao_reference(all...); });
    };
    const auto bitmask = [&](const Slices& slices) {
        nook::BitmaskOptions options;
        options.radius = radius;
        options.slices = slices.slices;
        options.steps = slices.steps;
        return sliced(
            view, "bitmask", options, "automatic",
            [](auto&&... all) { return nook::bitmask_ao(all...); },
            [](auto&&... all) { return nook::bitmask_ao_reference(all...); });
    };
    const std::vector<Slices> slices =
        chosen<Slices>(setup, {{1, 4}, {3, 3}, {4, 8}}, {{1, 4}, {2, 4}, {3, 3}, {4, 8}, {8, 16}});
    const std::vector<Slices> few_slices =
        chosen<Slices>(setup, {{1, 4}, {3, 3}}, {{1, 4}, {2, 4}, {3, 3}});
    for (const Slices& s : slices) kernels.push_back(horizon(s));
    for (const Slices& s : few_slices) kernels.push_back(blurred(view, horizon(s)));
    for (const Slices& s : slices) kernels.push_back(bitmask(s));
    for (const Slices& s : few_slices) kernels.push_back(blurred(view, bitmask(s)));
}

}  // namespace report
