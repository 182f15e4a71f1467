#include "parts.hpp"

#include <cstdio>
#include <thread>

#include <nook/thread_executor.hpp>

#include "compare/table.hpp"
#include "kernels.hpp"

namespace compare {

void compare_threads(const Options& options, const std::vector<View>& views, Results& results)
{
    Mark mark{"two threads, speed-up of depth + normal", true, 0, 0};
    if (std::thread::hardware_concurrency() < 2) {
        std::printf("two threads: not measured, this machine runs one\n\n");
        results.marks.push_back(mark);
        return;
    }
    nook::ThreadExecutor executor{2};
    const Threads two = lend(executor);
    const Kernels& best = targets().best();
    // Two threads of a busy machine may get no more than one does.
    const auto arithmetic = [](int task, int) {
        volatile unsigned state = static_cast<unsigned>(task);
        for (int i = 0; i < 20000; ++i) state = state * 1664525u + 1013904223u;
    };
    for (const View& view : views) {
        Buffers buffers{view};
        Workspace one_workspace, two_workspace;
        std::vector<std::vector<std::string>> rows{
            {"", "one, ms", "two, ms", "speed-up", "of plain arithmetic"}};
        for (const Target target :
             {Target::facets, Target::smooth, Target::depth, Target::counts}) {
            const std::string name = text_of(target);
            const std::vector<Contender> contenders{
                {name, [&] { draw(best, target, view, buffers, one_workspace); }},
                {name + ", two threads",
                 [&] { draw(best, target, view, buffers, two_workspace, two); }},
                {"arithmetic, one",
                 [&] {
                     for (int task = 0; task < 200; ++task) arithmetic(task, 0);
                 }},
                {"arithmetic, two", [&] { executor.for_each(200, arithmetic); }}};
            const Times times{contenders, effort(options, Clock::wall)};
            for (const std::size_t i : {0u, 1u}) {
                Measurement m = measured("threads", view, contenders, times, i, 1);
                m.threads = static_cast<int>(i) + 1;
                results.measurements.push_back(m);
            }
            if (target == Target::facets || target == Target::smooth)
                mark.take(times.ratio(0, 1), view.name() + ", " + name);
            rows.push_back({name, digits("%.2f", 1e3 * times.seconds(0).median),
                            digits("%.2f", 1e3 * times.seconds(1).median),
                            text_of(times.ratio(0, 1)), text_of(times.ratio(2, 3))});
        }
        std::printf("%s: two threads against one, nook %s\n", view.name().c_str(), best.name);
        print_table(rows);
    }
    results.marks.push_back(mark);
}

}  // namespace compare
