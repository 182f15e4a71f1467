#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/measure/error.hpp>
#include <nook/owned_image.hpp>
#include <nook/scratch.hpp>
#include <nook/thread_executor.hpp>

#include "reference.hpp"
#include "view.hpp"

namespace report {

/// A kernel with its parameters, ready to run on one view.
struct Kernel {
    std::string name;   ///< also the name of its pictures
    std::string brief;  ///< its parameters in a few words
    nlohmann::ordered_json parameters;
    std::function<nook::Outcome(const nook::ImageView<float>& visibility,
                                nook::HeapScratch& scratch, nook::ThreadExecutor& threads)>
        run;
    /// The kernel's own formula, pixel by pixel in double; empty when there is none, or when the kernel
    /// is that. Computes one row in `exact_step`, those of `computes_exactly`.
    std::function<nook::Outcome(const nook::ImageView<float>& visibility, const nook::WorkMap& rows,
                                nook::ThreadExecutor& threads)>
        exact;
    int exact_step = 1;
    /// Rows that it computes: one in `row_step`; the others come out as 1 and do not count.
    int row_step = 1;
    /// A slow reference form: timed once, with all threads.
    bool slow = false;

    [[nodiscard]] bool computes(int y) const { return y % row_step == row_step / 2; }
    [[nodiscard]] bool computes_exactly(int y) const { return y % exact_step == exact_step / 2; }
};

/// Kernels from depth alone, and from depth and normals.
void add_depth_kernels(const View& view, double radius, std::vector<Kernel>& kernels);
void add_surface_kernels(const View& view, double radius, std::vector<Kernel>& kernels);

/// Everything that is compared on this view. They refer to it and to nothing else.
[[nodiscard]] std::vector<Kernel> kernels_for(const View& view, double radius);

/// How long one kernel took, in milliseconds, over several rounds.
struct Timing {
    int threads = 1, rounds = 0;
    double median = 0, fastest = 0, p90 = 0;
};

/// What became of one kernel on one view.
struct Result {
    Kernel kernel;
    nook::Image<float> visibility;
    nook::Image<std::uint8_t> counted;  ///< pixels that are measured
    std::vector<Timing> timings;
    nook::ErrorMetrics error;  ///< against the traced reference
    double ssim = 1;
    nook::ErrorMetrics height_field;  ///< against the height field
    /// Against the kernel's own exact form, where it has one.
    std::optional<nook::ErrorMetrics> exact;
    nook::Work work;
};

/// Runs every kernel, for its picture, its error and its time. Kernels take turns, so that a change in
/// the machine's speed meets all of them; the first round warms up and does not count.
[[nodiscard]] std::vector<Result> measure(const View& view, const Reference& reference,
                                          const std::vector<Kernel>& kernels,
                                          nook::ThreadExecutor& threads,
                                          support::Progress& progress);

/// How far the results of two kernels lie apart, over the pixels that both count.
[[nodiscard]] nook::ErrorMetrics difference(const Result& one, const Result& other);

}  // namespace report
