#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/thread_executor.hpp>
#include <nook/work_map.hpp>

#include "counted_scratch.hpp"
#include "kernels.hpp"
#include "runs.hpp"
#include "view.hpp"

namespace report {

/// The tolerance of kernels whose plan has one.
inline constexpr double plan_tolerance = 0.01;

/// A kernel in two steps: what it leaves out, and the rest.
struct PlannedSteps {
    std::function<nook::Outcome(const nook::ImageView<std::uint8_t>& groups,
                                CountedScratch& scratch, nook::ThreadExecutor& threads)>
        plan;
    std::function<nook::WorkMap(const nook::ImageView<const std::uint8_t>& groups)> map;
    std::function<nook::Outcome(const nook::ImageView<float>& visibility, const nook::WorkMap& map,
                                CountedScratch& scratch, nook::ThreadExecutor& threads)>
        run;
};

/// The same kernel after a plan of that kind. Its slow form stays with the one without.
[[nodiscard]] Kernel planned(const View& view, const Kernel& without, const char* kind,
                             double tolerance, PlannedSteps steps);

/// How a plan divides the groups of a picture.
struct PlanCounts {
    std::uint64_t background = 0;  ///< left out, without a surface
    std::uint64_t inactive = 0;    ///< left out, with one
    std::uint64_t active = 0;
};
[[nodiscard]] PlanCounts counts_of(const View& view, const nook::WorkMap& map);

/// A plan that has a picture: the first of its kind, and of those with a tolerance.
struct PlanPicture {
    std::string name;  ///< of the file
    const Run* run;
};
[[nodiscard]] std::vector<PlanPicture> plan_pictures(const std::vector<Run>& runs);

/// The run that leaves nothing out of what this one does; null for none.
[[nodiscard]] const Run* without_of(const Run& run, const std::vector<Run>& runs);

/// What leaving out did to the picture: {rmse, mae, bias, p99, max, pixels} against the run without,
/// over the surface pixels; `changed`, pixels of which any bit differs, over all. Throws
/// support::Failure, which names the kernel and a pixel, when a plan does not keep what it promises.
[[nodiscard]] Json added_error_of(const View& view, const Run& run, const Run& without);

}  // namespace report
