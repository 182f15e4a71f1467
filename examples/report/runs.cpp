#include "runs.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <utility>

#include "../support/checked.hpp"

namespace report {

namespace {

/// Milliseconds.
using Times = std::vector<double>;

double median(Times times)
{
    std::sort(times.begin(), times.end());
    const std::size_t count = times.size();
    return (times[(count - 1) / 2] + times[count / 2]) / 2;
}

/// One kernel's turns with one number of threads.
class Turns {
public:
    Turns(Run& run, nook::ThreadExecutor& threads) : run_{&run}, threads_{&threads}
    {
        passes_.resize(run.kernel.passes.size());
    }

    /// A frame. One clock runs through it, with a mark after each pass.
    void take()
    {
        using Clock = std::chrono::steady_clock;
        const Kernel& kernel = run_->kernel;
        // A first frame that is no longer the only one has been warming up.
        if (frames_.size() == 1 && !warm_) {
            warm_ = true;
            frames_.clear();
            for (Times& times : passes_) times.clear();
        }
        nook::Work work;
        const auto milliseconds = [](Clock::duration time) {
            return std::chrono::duration<double, std::milli>(time).count();
        };
        const Clock::time_point start = Clock::now();
        Clock::time_point mark = start;
        for (std::size_t i = 0; i < kernel.passes.size(); ++i) {
            const Pass& pass = kernel.passes[i];
            const nook::Outcome outcome = pass.run(run_->visibility.view(), *threads_);
            const Clock::time_point now = Clock::now();
            passes_[i].push_back(milliseconds(now - mark));
            mark = now;
            if (!outcome) support::checked(outcome, (kernel.id + ", " + pass.name).c_str());
            work += outcome.work;
        }
        frames_.push_back(milliseconds(mark - start));
        spent_ += frames_.back();
        run_->work = work;
    }
    [[nodiscard]] bool done(double limit) const
    {
        if (frames_.empty()) return false;
        return spent_ >= limit || (warm_ && frames_.size() >= std::size_t{most_rounds});
    }
    /// Of the runs so far; there is one at least.
    [[nodiscard]] Timing timing() const
    {
        Times frames = frames_;
        std::sort(frames.begin(), frames.end());
        Timing timing;
        timing.threads = threads_->concurrency();
        timing.rounds = static_cast<int>(frames.size());
        timing.median = median(frames);
        timing.fastest = frames.front();
        timing.p90 = frames[(9 * frames.size() + 9) / 10 - 1];
        for (std::size_t i = 0; i < passes_.size(); ++i)
            timing.passes.push_back({run_->kernel.passes[i].name, median(passes_[i])});
        return timing;
    }
    [[nodiscard]] const Run& run() const { return *run_; }
    /// The median of this one's frames over the other's, round by round.
    [[nodiscard]] std::optional<double> ratio_to(const Turns& other) const
    {
        Times ratios;
        for (std::size_t i = 0; i < (std::min)(frames_.size(), other.frames_.size()); ++i)
            if (other.frames_[i] > 0) ratios.push_back(frames_[i] / other.frames_[i]);
        if (ratios.empty()) return {};
        return median(ratios);
    }

private:
    Run* run_;
    nook::ThreadExecutor* threads_;
    bool warm_ = false;
    Times frames_;
    std::vector<Times> passes_;
    double spent_ = 0;
};

void time_in_rounds(std::vector<Run>& runs, nook::ThreadExecutor& threads, double seconds,
                    support::Progress& progress)
{
    const int workers = threads.concurrency();
    progress.step("timing with " + std::to_string(workers) +
                  (workers == 1 ? " thread" : " threads"));
    std::vector<Turns> turns;
    for (Run& run : runs)
        if (!run.kernel.slow) turns.emplace_back(run, threads);
    for (int round = 0; round <= most_rounds; ++round)
        for (std::size_t i = 0; i < turns.size(); ++i) {
            if (!turns[i].done(1e3 * seconds)) turns[i].take();
            progress.share((round + double(i + 1) / double(turns.size())) / (most_rounds + 1));
        }
    std::size_t next = 0;
    for (Run& run : runs) {
        if (run.kernel.slow) continue;
        const Turns& own = turns[next++];
        Timing timing = own.timing();
        for (const Turns& other : turns)
            if (!run.kernel.without.empty() && other.run().kernel.id == run.kernel.without)
                timing.ratio = own.ratio_to(other);
        run.timings.push_back(timing);
    }
}

}  // namespace

std::vector<Run> run_kernels(const View& view, std::vector<Kernel> kernels,
                             nook::ThreadExecutor& threads, double seconds,
                             support::Progress& progress)
{
    std::vector<Run> runs(kernels.size());
    for (std::size_t i = 0; i < kernels.size(); ++i) {
        runs[i].kernel = std::move(kernels[i]);
        runs[i].visibility = {view.width(), view.height()};
    }
    if (threads.concurrency() > 1) {
        nook::ThreadExecutor alone{1};
        time_in_rounds(runs, alone, seconds, progress);
    }
    time_in_rounds(runs, threads, seconds, progress);
    const auto slow = static_cast<std::size_t>(
        std::count_if(runs.begin(), runs.end(), [](const Run& run) { return run.kernel.slow; }));
    if (slow == 0) return runs;
    progress.step("running the slow forms");
    std::size_t ready = 0;
    for (Run& run : runs) {
        if (!run.kernel.slow) continue;
        Turns once{run, threads};
        once.take();
        run.timings.push_back(once.timing());
        progress.share(double(++ready) / double(slow));
    }
    return runs;
}

}  // namespace report
