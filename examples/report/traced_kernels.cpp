#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <nook/scene/traced_options.hpp>

#include "counted_scratch.hpp"
#include "kernels.hpp"
#include "plans.hpp"
#include "reference.hpp"

namespace report {

namespace {

const char* kernel_name(Meaning meaning)
{
    switch (meaning) {
    case Meaning::visibility: break;
    case Meaning::obscurance: return "traced-obscurance";
    case Meaning::visibility_secondary: return "traced-secondary";
    case Meaning::obscurance_secondary: return "traced-obscurance-secondary";
    }
    return "traced";
}

Kernel traced(const Setup& setup, Meaning meaning, int directions)
{
    const nook::TracedOptions<> defaults;
    const View& view = setup.view;
    const double radius = setup.cell.radius;
    const Prepared<nook::Bvh>& hierarchy = setup.structures.hierarchy();
    const bool obscurance =
        meaning == Meaning::obscurance || meaning == Meaning::obscurance_secondary;
    const bool secondary =
        meaning == Meaning::visibility_secondary || meaning == Meaning::obscurance_secondary;

    Kernel kernel;
    kernel.name = kernel_name(meaning);
    kernel.id = kernel.name + '-' + std::to_string(directions);
    kernel.setting = std::to_string(directions) + " directions";
    kernel.meaning = meaning;
    kernel.parameters["radius"] = setup.cell.unlimited() ? Json(nullptr) : Json(radius);
    kernel.parameters["directions"] = directions;
    kernel.parameters["seed"] = defaults.seed;
    if (obscurance) kernel.parameters["sigma"] = sigma_of(radius);
    if (secondary) kernel.parameters["secondary_radius"] = radius / 2;
    const auto scratch = std::make_shared<CountedScratch>();
    kernel.passes.push_back(
        {"rays", [&view, &hierarchy, radius, meaning, directions, scratch, seed = defaults.seed](
                     const nook::ImageView<float>& visibility, nook::ThreadExecutor& threads) {
             return trace_once(hierarchy.value, view, radius, meaning, directions, seed, visibility,
                               {}, *scratch, threads);
         }});
    kernel.is_default = directions == defaults.directions;
    kernel.preparation = hierarchy.milliseconds;
    kernel.structures = hierarchy.bytes;
    kernel.memory = [scratch] { return scratch->bytes(); };
    return kernel;
}

/// The rays of a kernel, after a plan of what no triangle rises above.
Kernel planned_rays(const Setup& setup, const Kernel& without, int directions)
{
    const View& view = setup.view;
    const nook::Bvh& hierarchy = setup.structures.hierarchy().value;
    const double radius = setup.cell.radius;
    const Meaning meaning = without.meaning;
    constexpr std::uint32_t seed = nook::TracedOptions<>{}.seed;
    return planned(
        view, without, "traced", 0,
        {[&view, &hierarchy, radius, meaning, directions](
             const nook::ImageView<std::uint8_t>& groups, CountedScratch&,
             nook::ThreadExecutor& threads) {
             return plan_rays(hierarchy, view, radius, meaning, directions, groups, threads);
         },
         [](const nook::ImageView<const std::uint8_t>& groups) { return nook::WorkMap{groups}; },
         [&view, &hierarchy, radius, meaning, directions](
             const nook::ImageView<float>& visibility, const nook::WorkMap& map,
             CountedScratch& scratch, nook::ThreadExecutor& threads) {
             return trace_once(hierarchy, view, radius, meaning, directions, seed, visibility, map,
                               scratch, threads);
         }});
}

/// How many directions a meaning is traced with.
std::span<const int> direction_counts(const Setup& setup, Meaning meaning)
{
    static constexpr int all[] = {4, 8, 16, 32, 64, 128, 256}, some[] = {4, 16, 64, 256};
    const bool plain = meaning == Meaning::visibility;
    if (!setup.quick) return plain ? std::span<const int>{all} : some;
    return std::span<const int>{some}.first(plain && !is_vast(setup.view) ? 4 : 2);
}

/// Few rays and many; few alone in a quick run, where planning has the least to gain.
bool is_planned(int directions, bool quick)
{
    return directions == 16 || (!quick && (directions == 64 || directions == 256));
}

}  // namespace

void add_traced_kernels(const Setup& setup, std::vector<Kernel>& kernels)
{
    for (const Meaning meaning : meanings_of(setup)) {
        const std::span<const int> counts = direction_counts(setup, meaning);
        const std::size_t first = kernels.size();
        for (const int directions : counts) kernels.push_back(traced(setup, meaning, directions));
        // A falloff changes nothing about what is in reach.
        if (setup.cell.unlimited() || meaning == Meaning::obscurance ||
            meaning == Meaning::obscurance_secondary)
            continue;
        for (std::size_t i = 0; i < counts.size(); ++i)
            if (is_planned(counts[i], setup.quick))
                kernels.push_back(planned_rays(setup, Kernel{kernels[first + i]}, counts[i]));
    }
}

}  // namespace report
