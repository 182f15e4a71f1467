#include <cstddef>
#include <cstdint>
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
#include <nook/surface/surface_plan.hpp>
#include <nook/surface/upsample.hpp>

#include "counted_scratch.hpp"
#include "kernels.hpp"
#include "plans.hpp"

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

// The kernels by their options, and their slow forms.
constexpr auto run_of(const nook::AlchemyOptions&)
{
    return [](auto&&... all) { return nook::alchemy_ao(all...); };
}
constexpr auto run_of(const nook::HorizonOptions&)
{
    return [](auto&&... all) { return nook::horizon_ao(all...); };
}
constexpr auto run_of(const nook::BitmaskOptions&)
{
    return [](auto&&... all) { return nook::bitmask_ao(all...); };
}
constexpr auto exact_of(const nook::AlchemyOptions&)
{
    return [](auto&&... all) { return nook::alchemy_ao_reference(all...); };
}
constexpr auto exact_of(const nook::HorizonOptions&)
{
    return [](auto&&... all) { return nook::horizon_ao_reference(all...); };
}
constexpr auto exact_of(const nook::BitmaskOptions&)
{
    return [](auto&&... all) { return nook::bitmask_ao_reference(all...); };
}

/// A kernel of one pass, and its exact form of the same options.
template <class Options>
Kernel kernel_of(const View& view, const char* name, const std::string& suffix, std::string setting,
                 const Options& options)
{
    Kernel kernel;
    kernel.name = name;
    kernel.id = kernel.name + '-' + suffix;
    kernel.setting = std::move(setting);
    kernel.parameters["radius"] = options.radius;
    const auto scratch = std::make_shared<CountedScratch>();
    kernel.passes = {{"samples", [&view, options, scratch](const Visibility& visibility,
                                                           nook::ThreadExecutor& threads) {
                          return run_of(options)(view.depth.view(), view.normal(), visibility,
                                                 options, view.projection, nook::WorkMap{},
                                                 *scratch, threads);
                      }}};
    kernel.exact = [&view, options](const Visibility& visibility, const nook::WorkMap& rows,
                                    nook::ThreadExecutor& threads) {
        return exact_of(options)(view.depth.view(), view.normal(), visibility, options,
                                 view.projection, rows, threads);
    };
    kernel.memory = [scratch] { return scratch->bytes(); };
    return kernel;
}

Kernel alchemy(const View& view, const char* name, const nook::AlchemyOptions& options)
{
    const std::string samples = std::to_string(options.samples);
    Kernel kernel = kernel_of(view, name, samples, samples + " samples", options);
    kernel.parameters["samples"] = options.samples;
    kernel.parameters["intensity"] = "automatic";
    kernel.parameters["epsilon"] = "automatic";
    kernel.parameters["bias"] = "automatic";
    kernel.exact_samples = options.samples;
    kernel.is_default = options.samples == nook::AlchemyOptions{}.samples;
    return kernel;
}

/// GTAO or the bitmask.
template <class Options>
Kernel sliced(const View& view, const char* name, const Options& options, const char* thickness)
{
    const std::string slices = std::to_string(options.slices);
    const std::string steps = std::to_string(options.steps);
    Kernel kernel = kernel_of(
        view, name, slices + 'x' + steps,
        slices + (options.slices == 1 ? " slice, 2 x " : " slices, 2 x ") + steps + " samples",
        options);
    kernel.parameters["slices"] = options.slices;
    kernel.parameters["steps"] = options.steps;
    kernel.parameters["thickness"] = thickness;
    kernel.parameters["bias"] = "automatic";
    kernel.exact_samples = 2.0 * options.slices * options.steps;
    kernel.is_default = options.slices == Options{}.slices && options.steps == Options{}.steps;
    return kernel;
}

/// The kernel after a plan that keeps to a tolerance; 0: to the bit.
template <class Options>
Kernel planned_kernel(const View& view, const Kernel& without, const Options& options,
                      double tolerance)
{
    return planned(
        view, without, "surface", tolerance,
        {[&view, options, tolerance](const nook::ImageView<std::uint8_t>& groups,
                                     CountedScratch& scratch, nook::ThreadExecutor& threads) {
             return nook::plan_surface(view.depth.view(), view.normal(), groups, options,
                                       view.projection, tolerance, scratch, threads);
         },
         [tolerance](const nook::ImageView<const std::uint8_t>& groups) {
             return nook::surface_work_map(groups, tolerance);
         },
         [&view, options](const Visibility& visibility, const nook::WorkMap& map,
                          CountedScratch& scratch, nook::ThreadExecutor& threads) {
             return run_of(options)(view.depth.view(), view.normal(), visibility, options,
                                    view.projection, map, scratch, threads);
         }});
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
    // A quick run plans the library's defaults alone.
    const auto add_planned = [&](const std::vector<Kernel>& without, const auto& options_of) {
        for (const double tolerance : {0.0, plan_tolerance})
            for (std::size_t i = 0; i < without.size(); ++i)
                if (!setup.quick || without[i].is_default)
                    kernels.push_back(planned_kernel(view, without[i], options_of(i), tolerance));
    };
    const std::vector<int> samples = chosen(setup, {4, 16, 64}, {4, 8, 16, 32, 64});
    const auto add_alchemy = [&](const char* name, const auto& options_of) {
        std::vector<Kernel> made;
        for (const int n : samples) made.push_back(alchemy(view, name, options_of(n)));
        kernels.insert(kernels.end(), made.begin(), made.end());
        add_planned(made, [&](std::size_t i) { return options_of(samples[i]); });
    };
    add_alchemy("alchemy", plain);
    for (const int n : chosen(setup, {8, 16}, {4, 8, 16}))
        kernels.push_back(blurred(view, alchemy(view, "alchemy", plain(n))));
    for (const int n : chosen(setup, {16}, {8, 16, 32}))
        kernels.push_back(half_size(view, plain(n)));
    add_alchemy("scalable", scalable);
    for (const int n : chosen(setup, {16}, {8, 16}))
        kernels.push_back(blurred(view, alchemy(view, "scalable", scalable(n))));

    const std::vector<Slices> slices =
        chosen<Slices>(setup, {{1, 4}, {3, 3}, {4, 8}}, {{1, 4}, {2, 4}, {3, 3}, {4, 8}, {8, 16}});
    const std::vector<Slices> few_slices =
        chosen<Slices>(setup, {{1, 4}, {3, 3}}, {{1, 4}, {2, 4}, {3, 3}});
    const auto add_sliced = [&](const char* name, auto options, const char* thickness) {
        options.radius = radius;
        const auto options_of = [&](const Slices& s) {
            auto result = options;
            result.slices = s.slices;
            result.steps = s.steps;
            return result;
        };
        std::vector<Kernel> made;
        for (const Slices& s : slices) made.push_back(sliced(view, name, options_of(s), thickness));
        kernels.insert(kernels.end(), made.begin(), made.end());
        add_planned(made, [&](std::size_t i) { return options_of(slices[i]); });
        for (const Slices& s : few_slices)
            kernels.push_back(blurred(view, sliced(view, name, options_of(s), thickness)));
    };
    add_sliced("horizon", nook::HorizonOptions{}, "infinite");
    add_sliced("bitmask", nook::BitmaskOptions{}, "automatic");
}

}  // namespace report
