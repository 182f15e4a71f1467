#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/outcome.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/surface_plan.hpp>
#include <nook/thread_executor.hpp>
#include <nook/work_map.hpp>

/// Kernels over depth and normals, with the map of their planner and without any.
namespace plan_checks {

/// One type of executor for all numbers of threads, and threads that are started once.
struct Executors {
    nook::ThreadExecutor one{1}, two{2}, five{5};

    [[nodiscard]] nook::ThreadExecutor& turn(int i)
    {
        return i % 3 == 0 ? one : i % 3 == 1 ? two : five;
    }
    [[nodiscard]] static Executors& all()
    {
        static Executors executors;
        return executors;
    }
};

template <class Depth, class Value>
nook::Outcome shade(const Depth& depth, const nook::NormalSource& normals,
                    const nook::ImageView<Value>& out, const nook::AlchemyOptions& options,
                    const nook::Projection& projection, const nook::WorkMap& map,
                    nook::ThreadExecutor& threads)
{
    return nook::alchemy_ao(depth, normals, out, options, projection, map, nook::HeapScratch{},
                            threads);
}
template <class Depth, class Value>
nook::Outcome shade(const Depth& depth, const nook::NormalSource& normals,
                    const nook::ImageView<Value>& out, const nook::HorizonOptions& options,
                    const nook::Projection& projection, const nook::WorkMap& map,
                    nook::ThreadExecutor& threads)
{
    return nook::horizon_ao(depth, normals, out, options, projection, map, nook::HeapScratch{},
                            threads);
}
template <class Depth, class Value>
nook::Outcome shade(const Depth& depth, const nook::NormalSource& normals,
                    const nook::ImageView<Value>& out, const nook::BitmaskOptions& options,
                    const nook::Projection& projection, const nook::WorkMap& map,
                    nook::ThreadExecutor& threads)
{
    return nook::bitmask_ao(depth, normals, out, options, projection, map, nook::HeapScratch{},
                            threads);
}

/// What a plan did to a picture.
struct Comparison {
    bool ran = false;
    int groups = 0, active = 0;
    int changed = 0;            ///< pixels whose bits differ
    double rise = 0, fall = 0;  ///< the largest differences
    std::uint64_t skipped = 0;
    std::string where{};        ///< the first pixel that changed
    bool counts_agree = false;  ///< the counts of the plan and of the kernel
    /// The counts of background, too. Kernels count surfaces without a normal among it where they look
    /// at normals, so only where there are none.
    bool background_agrees = false;
    nook::Image<std::uint8_t> map{};

    [[nodiscard]] double active_share() const { return groups > 0 ? double(active) / groups : 0; }
};

/// Runs a kernel with the plan of its options and without; `turn` chooses the numbers of threads.
template <class Depth, class Options>
[[nodiscard]] Comparison compared(const Depth& depth, const nook::NormalSource& normals,
                                  const Options& options, const nook::Projection& projection,
                                  double tolerance = 0, int turn = 0)
{
    using Value = nook::distance_t<Depth>;
    using Bits = std::conditional_t<sizeof(Value) == 4, std::uint32_t, std::uint64_t>;
    Executors& executors = Executors::all();
    const auto& image = nook::depth_source(depth).image;
    const int width = image.width, height = image.height;
    nook::Image<Value> without{width, height, Value{-1}}, with{width, height, Value{-2}};
    Comparison result;
    result.map = nook::Image<std::uint8_t>{nook::WorkMap::groups(width), height, 0x55};
    const nook::Outcome plain =
        shade(depth, normals, without.view(), options, projection, {}, executors.one);
    const nook::Outcome plan =
        nook::plan_surface(depth, normals, result.map.view(), options, projection, tolerance,
                           nook::HeapScratch{}, executors.turn(turn));
    const nook::WorkMap map = nook::surface_work_map(result.map.view(), tolerance);
    const nook::Outcome planned =
        shade(depth, normals, with.view(), options, projection, map, executors.turn(turn + 1));
    if (!plain || !plan || !planned) return result;
    result.ran = map.exact == (tolerance == 0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Value a = without(x, y), b = with(x, y);
            result.rise = (std::max)(result.rise, double(b) - double(a));
            result.fall = (std::max)(result.fall, double(a) - double(b));
            if (std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b)) continue;
            if (result.changed++ == 0)
                result.where = "(" + std::to_string(x) + ", " + std::to_string(y) +
                               "): " + std::to_string(a) + " became " + std::to_string(b);
        }
    for (const std::uint8_t byte : result.map) {
        ++result.groups;
        result.active += byte != 0;
    }
    result.skipped = plan.work.skipped;
    result.counts_agree = plan.work.pixels == planned.work.pixels &&
                          plan.work.skipped == planned.work.skipped &&
                          plan.work.passes == (image.empty() ? 0u : 1u);
    result.background_agrees = plan.work.background == planned.work.background &&
                               planned.work.background == plain.work.background;
    return result;
}

}  // namespace plan_checks
