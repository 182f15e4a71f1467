#include <cstdio>
#include <memory>
#include <utility>

#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/upsample.hpp>

#include "kernels.hpp"

namespace report {

namespace {

using Visibility = nook::ImageView<float>;

/// Everything but the run, with the run itself as the exact form of the same options.
template <class Options, class Run, class Exact>
Kernel kernel_of(const View& view, const char* name, std::string brief, const Options& options,
                 const Run& run, const Exact& exact)
{
    Kernel kernel;
    kernel.name = name;
    kernel.brief = std::move(brief);
    kernel.parameters["radius"] = options.radius;
    kernel.parameters["bias"] = "automatic";
    kernel.run = [&view, options, run](const Visibility& visibility, nook::HeapScratch& scratch,
                                       nook::ThreadExecutor& threads) {
        return run(view.depth.view(), view.normal(), visibility, options, view.projection,
                   nook::WorkMap{}, scratch, threads);
    };
    kernel.exact = [&view, options, exact](const Visibility& visibility, const nook::WorkMap& rows,
                                           nook::ThreadExecutor& threads) {
        return exact(view.depth.view(), view.normal(), visibility, options, view.projection, rows,
                     threads);
    };
    return kernel;
}

Kernel alchemy(const View& view, const char* name, const nook::AlchemyOptions& options)
{
    Kernel kernel = kernel_of(
        view, name, std::to_string(options.samples) + " samples", options,
        [](auto&&... all) { return nook::alchemy_ao(all...); },
        [](auto&&... all) { return nook::alchemy_ao_reference(all...); });
    kernel.parameters["samples"] = options.samples;
    return kernel;
}

template <class Options>
std::string slices(const Options& options)
{
    return std::to_string(options.slices) + " slices, 2 x " + std::to_string(options.steps) +
           " samples";
}

/// The kernel, and a blur that keeps to surfaces.
Kernel blurred(const View& view, Kernel kernel)
{
    struct Memory {
        nook::Image<float> sharp;
        nook::HeapScratch scratch;
    };
    auto memory = std::make_shared<Memory>();
    memory->sharp = {view.width(), view.height()};
    kernel.name += "-blurred";
    kernel.brief += ", blur";
    kernel.parameters["blur"] = nook::BlurOptions{}.radius;
    kernel.exact = nullptr;
    kernel.run = [&view, memory, run = kernel.run](const Visibility& visibility,
                                                   nook::HeapScratch& scratch,
                                                   nook::ThreadExecutor& threads) {
        nook::Outcome outcome = run(memory->sharp.view(), scratch, threads);
        if (!outcome) return outcome;
        const nook::Outcome after = nook::bilateral_blur(
            memory->sharp.view(), view.depth.view(), view.normal(), visibility, nook::BlurOptions{},
            view.projection, {}, memory->scratch, threads);
        outcome.error = after.error;
        outcome.work.passes += after.work.passes;
        return outcome;
    };
    return kernel;
}

/// At every second pixel of every second row, and brought back.
Kernel half_size(const View& view, const nook::AlchemyOptions& options)
{
    struct Memory {
        nook::Image<float> half;
        nook::HeapScratch scratch;
    };
    auto memory = std::make_shared<Memory>();
    memory->half = {(view.width() + 1) / 2, (view.height() + 1) / 2};
    Kernel kernel = alchemy(view, "alchemy-half", options);
    kernel.brief += ", half size";
    kernel.parameters["half_size"] = true;
    kernel.exact = nullptr;
    kernel.run = [&view, memory, options](const Visibility& visibility, nook::HeapScratch& scratch,
                                          nook::ThreadExecutor& threads) {
        const nook::NormalSource normals = view.normal();
        nook::Outcome outcome = nook::alchemy_ao(
            nook::half_source(view.depth.view()), nook::half_source(normals), memory->half.view(),
            options, nook::half_projection(view.projection), {}, scratch, threads);
        if (!outcome) return outcome;
        return nook::upsample(memory->half.view(), view.depth.view(), normals, visibility,
                              nook::UpsampleOptions{}, view.projection, {}, memory->scratch,
                              threads);
    };
    return kernel;
}

}  // namespace

void add_surface_kernels(const View& view, double radius, std::vector<Kernel>& kernels)
{
    nook::AlchemyOptions aao;
    aao.radius = radius;
    kernels.push_back(alchemy(view, "alchemy", aao));
    kernels.push_back(blurred(view, kernels.back()));
    kernels.push_back(half_size(view, aao));
    nook::AlchemyOptions scalable = aao;
    scalable.falloff = nook::AlchemyFalloff::scalable;
    kernels.push_back(alchemy(view, "scalable", scalable));

    nook::HorizonOptions horizon;
    horizon.radius = radius;
    kernels.push_back(kernel_of(
        view, "horizon", slices(horizon), horizon,
        [](auto&&... all) { return nook::horizon_ao(all...); },
        [](auto&&... all) { return nook::horizon_ao_reference(all...); }));
    kernels.push_back(blurred(view, kernels.back()));
    nook::BitmaskOptions bitmask;
    bitmask.radius = radius;
    kernels.push_back(kernel_of(
        view, "bitmask", slices(bitmask), bitmask,
        [](auto&&... all) { return nook::bitmask_ao(all...); },
        [](auto&&... all) { return nook::bitmask_ao_reference(all...); }));
}

}  // namespace report
