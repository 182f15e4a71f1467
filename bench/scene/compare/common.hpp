#pragma once

#include <string>
#include <utility>
#include <vector>

#include "compare/failure.hpp"
#include "compare/rotation.hpp"
#include "compare/table.hpp"
#include "embree_scene.hpp"
#include "kernels.hpp"
#include "options.hpp"
#include "results.hpp"
#include "view.hpp"

/// What the parts share.
namespace compare {

/// A turn is so long that buffers need not be brought into the caches first.
[[nodiscard]] inline Effort effort(const Options& options, Clock clock = Clock::processor)
{
    return {.rounds = options.rounds,
            .turn_seconds = options.quick ? 1e-4 : 2e-2,
            .clock = clock,
            .untimed_call = false};
}

/// A Bvh of one instruction set.
class NookBvh {
public:
    NookBvh(const Kernels& kernels, const nook::MeshView& mesh, const Threads& threads = {})
        : kernels_{kernels},
          bvh_{kernels.make_bvh()}
    {
        if (bvh_ == nullptr) throw std::bad_alloc{};
        const nook::Outcome outcome = kernels.build(bvh_, mesh, threads);
        if (outcome) return;
        kernels_.free_bvh(bvh_);
        (void)checked(outcome, "build");
    }
    ~NookBvh() { kernels_.free_bvh(bvh_); }
    NookBvh(const NookBvh&) = delete;
    NookBvh& operator=(const NookBvh&) = delete;

    operator const void*() const { return bvh_; }

private:
    const Kernels& kernels_;
    void* bvh_;
};

/// A call of one of Embree's loops, or of nook's ray by ray.
using Loop = void (*)(void* scene, const Points& points, const Sampling& sampling,
                      float* visibility);

[[nodiscard]] inline double mean(const std::vector<float>& values)
{
    double sum = 0;
    for (const float value : values) sum += double{value};
    return values.empty() ? 0 : sum / double(values.size());
}

[[nodiscard]] inline bool has_embree() { return targets().best().embree_single != nullptr; }

/// "5 %, N = 16".
[[nodiscard]] inline std::string place(const View& view, const Reach& reach, int directions)
{
    return view.scene.name + ", " + reach.name + ", N = " + std::to_string(directions);
}

}  // namespace compare
