#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

#include <nook/scene/outline_ao.hpp>
#include <nook/scene/outline_mask.hpp>
#include <nook/surface/alchemy_ao.hpp>

#include "counted_scratch.hpp"
#include "kernels.hpp"

namespace report {

namespace {

using Visibility = nook::ImageView<float>;

/// The outlines of a scene, drawn to see where something is near.
struct Outlines {
    const Prepared<nook::OutlineShell>* shell;
    double extent;
    int threshold;

    Outlines(const Setup& setup)
        : shell{&setup.structures.shell()},
          extent{shell->value.needed_extent(setup.cell.radius)},
          // Each room, turned inside out, makes the count one lower everywhere.
          threshold{nook::OutlineMaskOptions{}.threshold -
                    static_cast<int>(shell->value.inward_count())}
    {
        // Where no extent is enough the radius is what everyone takes.
        if (!(extent <= 4 * setup.cell.radius)) extent = setup.cell.radius;
    }
    void describe(Kernel& kernel) const
    {
        kernel.parameters["extent"] = extent;
        kernel.parameters["threshold"] = threshold;
        kernel.preparation = shell->milliseconds;
        kernel.structures = shell->bytes;
    }
};

/// Alchemy AO in the groups of pixels where outlines overlap.
Kernel masked(const View& view, const Outlines& outlines, const nook::AlchemyOptions& options)
{
    struct Buffers {
        nook::Image<std::uint8_t> groups;
        CountedScratch mask, samples;
    };
    const auto buffers = std::make_shared<Buffers>();
    buffers->groups = {nook::WorkMap::groups(view.width()), view.height()};
    const std::string samples = std::to_string(options.samples);
    Kernel kernel;
    kernel.name = "masked";
    kernel.id = "masked-" + samples;
    kernel.setting = samples + " samples, extent " + digits(outlines.extent);
    kernel.parameters["radius"] = options.radius;
    kernel.parameters["samples"] = options.samples;
    outlines.describe(kernel);
    kernel.passes = {
        {"mask",
         [&view, outlines, buffers](const Visibility&, nook::ThreadExecutor& threads) {
             return before_last(nook::outline_mask(outlines.shell->value.view(), outlines.extent,
                                                   view.depth.view(), buffers->groups.view(),
                                                   {.threshold = outlines.threshold}, view.frame,
                                                   view.projection, buffers->mask, threads));
         }},
        {"samples",
         [&view, options, buffers](const Visibility& visibility, nook::ThreadExecutor& threads) {
             return nook::alchemy_ao(
                 view.depth.view(), view.normal(), visibility, options, view.projection,
                 nook::outline_work_map(buffers->groups.view()), buffers->samples, threads);
         }}};
    kernel.memory = [buffers] {
        return bytes_of(buffers->groups) + buffers->mask.bytes() + buffers->samples.bytes();
    };
    kernel.without = "alchemy-" + samples;
    kernel.plan = Plan{"outline", "mask", std::nullopt,
                       [buffers] { return nook::outline_work_map(buffers->groups.view()); }};
    kernel.is_default = options.samples == nook::AlchemyOptions{}.samples;
    return kernel;
}

/// The stencil of the outlines as visibility.
Kernel stand_alone(const View& view, const Outlines& outlines, int limit)
{
    nook::OutlineAoOptions options;
    options.threshold = outlines.threshold;
    options.limit = limit;
    const auto scratch = std::make_shared<CountedScratch>();
    Kernel kernel;
    kernel.name = "stand-alone";
    kernel.id = "stand-alone-" + std::to_string(limit);
    kernel.setting = (limit == 1 ? "1 overlap" : "up to " + std::to_string(limit) + " overlaps") +
                     ", extent " + digits(outlines.extent);
    kernel.parameters["blur_radius"] = options.radius;
    kernel.parameters["strength"] = options.strength;
    kernel.parameters["limit"] = options.limit;
    outlines.describe(kernel);
    kernel.passes = {{"outlines", [&view, outlines, options, scratch](
                                      const Visibility& visibility, nook::ThreadExecutor& threads) {
                          return nook::outline_ao(outlines.shell->value.view(), outlines.extent,
                                                  view.depth.view(), visibility, options,
                                                  view.frame, view.projection, *scratch, threads);
                      }}};
    kernel.memory = [scratch] { return scratch->bytes(); };
    kernel.is_default = limit == nook::OutlineAoOptions{}.limit;
    return kernel;
}

}  // namespace

void add_outline_kernels(const Setup& setup, std::vector<Kernel>& kernels)
{
    if (setup.cell.unlimited()) return;
    const Outlines outlines{setup};
    for (const int samples : {8, 16}) {
        if (setup.quick && samples != 16) continue;
        nook::AlchemyOptions options;
        options.radius = setup.cell.radius;
        options.samples = samples;
        kernels.push_back(masked(setup.view, outlines, options));
    }
    for (const int limit : {1, 4})
        if (!setup.quick || limit == 1) kernels.push_back(stand_alone(setup.view, outlines, limit));
}

}  // namespace report
