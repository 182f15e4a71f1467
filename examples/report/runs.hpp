#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nook/outcome.hpp>
#include <nook/owned_image.hpp>

#include "../support/progress.hpp"
#include "kernels.hpp"

namespace report {

/// How long a frame took, in milliseconds, over several rounds.
struct Timing {
    struct Pass {
        std::string name;
        double median = 0;
    };
    int threads = 1, rounds = 0;
    double median = 0, fastest = 0, p90 = 0;  ///< of the whole frame
    std::vector<Pass> passes;                 ///< in their order; medians need not add up
    /// Of a frame over one of the kernel `without`: the median over the rounds that both took part in,
    /// which a change in the machine's speed moves less than medians of their own.
    std::optional<double> ratio;
};

/// What became of one kernel on one view.
struct Run {
    Kernel kernel;
    nook::Image<float> visibility;
    std::vector<Timing> timings;  ///< with one thread, and with all
    nook::Work work;              ///< of all passes of a frame
};

/// Runs that count, at most, per kernel and number of threads.
inline constexpr int most_rounds = 7;

/// Runs every kernel, for its picture and its time. Kernels take turns, so that a change in the machine's
/// speed meets all of them. A kernel takes part in round after round until it has run for `seconds` in
/// all, seven times, or, if a frame is longer than that, once; the first run warms up and does not count
/// unless it is the only one. Slow ones run once, with all threads. So n kernels take 2 n `seconds` at
/// most, and for each the frame with which it goes beyond them. Throws support::Failure, which names the
/// kernel, when one fails.
[[nodiscard]] std::vector<Run> run_kernels(const View& view, std::vector<Kernel> kernels,
                                           nook::ThreadExecutor& threads, double seconds,
                                           support::Progress& progress);

}  // namespace report
