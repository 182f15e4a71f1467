#include "calibration.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <iterator>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <nook/measure/error.hpp>

#include "../support/checked.hpp"
#include "../support/failure.hpp"
#include "calibration_search.hpp"
#include "calibration_spaces.hpp"
#include "calibration_views.hpp"

namespace report {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double budgets[] = {5, 10, 20, 40, 80};  // nanoseconds per pixel

/// Runs settings of kernels on views. Errors of kernels are kept until somebody may throw.
class Bench {
public:
    Bench(int width, int height, int workers) : memories_(static_cast<std::size_t>(workers))
    {
        for (CalibrationMemory& memory : memories_) memory.visibility = {width, height};
    }

    /// The mean over the views of the RMSE against the rays.
    [[nodiscard]] double error(const CalibrationSpace& space, const Setting& setting,
                               const std::vector<CalibrationView>& views, int worker)
    {
        CalibrationMemory& memory = memories_[static_cast<std::size_t>(worker)];
        double sum = 0;
        for (const CalibrationView& view : views) {
            run(space, setting, view, memory);
            const nook::Measured difference = nook::rmse(
                memory.visibility.view(), view.visibility.view(), view.view.surface.view());
            keep(difference.error, "rmse");
            sum += difference.value;
        }
        return sum / double(views.size());
    }
    /// Nanoseconds per pixel that shows a surface, over all views, on the calling thread alone. Time of
    /// the processor, not of the clock on the wall: what else runs on the machine hardly shows.
    [[nodiscard]] double time(const CalibrationSpace& space, const Setting& setting,
                              const std::vector<CalibrationView>& views)
    {
        double pixels = 0;
        const std::clock_t start = std::clock();
        for (const CalibrationView& view : views) {
            run(space, setting, view, memories_[0]);
            pixels += double(view.view.width()) * view.view.height() - double(view.view.background);
        }
        return 1e9 * double(std::clock() - start) / CLOCKS_PER_SEC / pixels;
    }
    void check() const
    {
        if (!failure_.empty()) throw support::Failure{failure_};
    }

private:
    void run(const CalibrationSpace& space, const Setting& setting, const CalibrationView& view,
             CalibrationMemory& memory)
    {
        keep(space.run(view, setting, memory).error, space.kernel.c_str());
    }
    void keep(const nook::Error& error, const char* what)
    {
        if (!error) return;
        const std::lock_guard lock{mutex_};
        failure_ = std::string{what} + ": " + support::text_of(error);
    }

    std::vector<CalibrationMemory> memories_;
    std::mutex mutex_;
    std::string failure_;
};

/// What is known of a kernel so far.
struct Study {
    CalibrationSpace space;
    std::vector<Candidate> tuned, standard;
    std::vector<Choice> chosen;
};

/// Everything that a calibration goes through, step by step.
class Calibration {
public:
    Calibration(bool quick, const CalibrationViews& views, nook::ThreadExecutor& threads,
                support::Progress& progress)
        : quick_{quick},
          views_{views},
          threads_{threads},
          progress_{progress},
          bench_{views.width, views.height, threads.concurrency()}
    {
        for (CalibrationSpace& space : calibration_spaces(quick))
            studies_.push_back({std::move(space), {}, {}, {}});
    }

    void run()
    {
        start();
        search();
        time();
        judge();
    }
    [[nodiscard]] const std::vector<Study>& studies() const { return studies_; }

private:
    /// What may meet the largest budget, by one look at each setting.
    void start()
    {
        progress_.step("calibration: looking at what costs time");
        for (Study& study : studies_) {
            const auto add = [&](const Setting& setting, std::vector<Candidate>& candidates) {
                const double time = rough_time(study.space, setting);
                if (time < 1.25 * *std::prev(std::end(budgets)))
                    candidates.push_back({setting, 0, time});
            };
            for (const Setting& setting : starts(study.space.axes, true)) add(setting, study.tuned);
            for (const Setting& setting : starts(study.space.axes, false))
                add(setting, study.standard);
        }
        bench_.check();
    }
    [[nodiscard]] double rough_time(const CalibrationSpace& space, const Setting& setting)
    {
        const double first = bench_.time(space, setting, views_.train);
        return (std::min)(first, bench_.time(space, setting, views_.train));
    }

    /// One search per setting that costs time, side by side.
    void search()
    {
        progress_.step("calibration: searching");
        struct Task {
            const CalibrationSpace* space;
            Candidate* candidate;
            bool free;
        };
        std::vector<Task> tasks;
        for (Study& study : studies_) {
            for (Candidate& candidate : study.tuned)
                tasks.push_back({&study.space, &candidate, true});
            for (Candidate& candidate : study.standard)
                tasks.push_back({&study.space, &candidate, false});
        }
        // The longest first, so that none is left alone at the end.
        const auto weight = [](const Task& task) {
            return task.free ? task.candidate->time * double(task.space->axes.size()) : 0;
        };
        std::stable_sort(tasks.begin(), tasks.end(),
                         [&](const Task& a, const Task& b) { return weight(a) > weight(b); });
        std::atomic<std::size_t> done{0};
        threads_.for_each(static_cast<int>(tasks.size()), [&](int index, int worker) {
            const Task& task = tasks[static_cast<std::size_t>(index)];
            const auto error = [&](const Setting& setting) {
                return bench_.error(*task.space, setting, views_.train, worker);
            };
            Candidate& candidate = *task.candidate;
            if (task.free) {
                const double time = candidate.time;
                candidate = tune(task.space->axes, candidate.setting, error);
                candidate.time = time;
            } else {
                candidate.error = error(candidate.setting);
            }
            const std::size_t now = ++done;
            if (worker == 0) progress_.share(double(now) / double(tasks.size()));
        });
        bench_.check();
    }

    /// Times on one thread: settings take turns, so that a change in the machine's speed meets all.
    void time()
    {
        progress_.step("calibration: timing with 1 thread");
        struct Timed {
            Study* study;
            std::vector<Candidate*> candidates;
            std::vector<double> times{};
        };
        std::vector<Timed> all;
        for (Study& study : studies_) {
            study.tuned = worth_timing(std::move(study.tuned), 0.6);
            study.standard = worth_timing(std::move(study.standard), 0.6);
            std::map<Setting, std::vector<Candidate*>> same;
            for (Candidate& candidate : study.tuned) same[candidate.setting].push_back(&candidate);
            for (Candidate& candidate : study.standard)
                same[candidate.setting].push_back(&candidate);
            for (auto& [setting, candidates] : same) all.push_back({&study, std::move(candidates)});
        }
        const int rounds = quick_ ? 5 : 7;
        for (int round = 0; round < rounds; ++round) {
            for (Timed& timed : all)
                timed.times.push_back(bench_.time(timed.study->space,
                                                  timed.candidates.front()->setting, views_.train));
            progress_.share((round + 1.0) / rounds);
        }
        for (Timed& timed : all) {
            const auto middle = timed.times.begin() + rounds / 2;
            std::nth_element(timed.times.begin(), middle, timed.times.end());
            for (Candidate* candidate : timed.candidates) candidate->time = *middle;
        }
        bench_.check();
    }

    /// The only step that looks at what was held out.
    void judge()
    {
        progress_.step("calibration: measuring what was held out");
        threads_.for_each(static_cast<int>(studies_.size()), [&](int index, int worker) {
            Study& study = studies_[static_cast<std::size_t>(index)];
            study.chosen =
                choices(study.tuned, study.standard, budgets, [&](const Setting& setting) {
                    return bench_.error(study.space, setting, views_.held_out, worker);
                });
        });
        bench_.check();
    }

    bool quick_;
    const CalibrationViews& views_;
    nook::ThreadExecutor& threads_;
    support::Progress& progress_;
    Bench bench_;
    std::vector<Study> studies_;
};

Json names_of(const std::vector<CalibrationView>& views)
{
    Json names = Json::array();
    for (const CalibrationView& view : views) names.push_back(view.name);
    return names;
}

Json parameters_of(const std::vector<Axis>& axes, const Setting& setting)
{
    Json parameters = Json::object();
    for (std::size_t i = 0; i < axes.size(); ++i) {
        const Axis& axis = axes[i];
        const double value = setting[i];
        if (!axis.labels.empty()) {
            const auto at = std::find(axis.values.begin(), axis.values.end(), value);
            parameters[axis.name] = axis.labels[static_cast<std::size_t>(at - axis.values.begin())];
        } else if (value > 1e300) {
            parameters[axis.name] = "infinite";
        } else if (value == std::floor(value)) {
            parameters[axis.name] = static_cast<int>(value);
        } else {
            parameters[axis.name] = value;
        }
    }
    return parameters;
}

}  // namespace

Json calibrate(bool quick, nook::ThreadExecutor& threads, support::Progress& progress)
{
    const auto start = Clock::now();
    const CalibrationViews views = calibration_views(quick, threads, progress);
    Calibration calibration{quick, views, threads, progress};
    calibration.run();

    Json rows = Json::array();
    for (const Study& study : calibration.studies())
        for (const Choice& choice : study.chosen)
            rows.push_back(
                {{"kernel", study.space.kernel},
                 {"budget", choice.budget},
                 {"parameters", parameters_of(study.space.axes, choice.tuned.setting)},
                 {"default_parameters", parameters_of(study.space.axes, choice.standard.setting)},
                 {"time", choice.tuned.time},
                 {"default_time", choice.standard.time},
                 {"train_error", choice.tuned.error},
                 {"default_train_error", choice.standard.error},
                 {"held_out_error", choice.held_out_error},
                 {"default_held_out_error", choice.standard_held_out_error}});
    Json result;
    result["size"] = {views.width, views.height};
    result["directions"] = views.directions;
    result["seconds"] = std::chrono::duration<double>(Clock::now() - start).count();
    result["train"] = names_of(views.train);
    result["held_out"] = names_of(views.held_out);
    result["rows"] = std::move(rows);
    return result;
}

}  // namespace report
