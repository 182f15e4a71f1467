#include "parts.hpp"

#include <cstdio>
#include <optional>
#include <thread>

#include <nook/thread_executor.hpp>

#include "common.hpp"

namespace compare {

void compare_threads(const Options& options, const std::vector<View>& views, Results& results)
{
    Mark mark{"two threads, speed-up", true, 1.9, 1.97};
    if (std::thread::hardware_concurrency() < 2) {
        std::printf("two threads: not measured, this machine runs one\n\n");
        results.marks.push_back(mark);
        return;
    }
    const Kernels& best = targets().best();
    nook::ThreadExecutor executor{2};
    const Threads two = lend(executor);
    std::vector<std::vector<std::string>> rows{
        {"", "one, ms", "two, ms", "speed-up", "of plain arithmetic"}};
    for (const View& view : views) {
        const NookBvh bvh{best, view.scene.mesh()};
        std::vector<float> visibility(view.points.count());
        const auto compare = [&](const std::string& what, const char* radius, int directions,
                                 const auto& run) {
            // Two threads of a busy machine may get no more than one does.
            const auto arithmetic = [](int task, int) {
                volatile unsigned state = static_cast<unsigned>(task);
                for (int i = 0; i < 20000; ++i) state = state * 1664525u + 1013904223u;
            };
            const Times times{{{"one", [&] { run(Threads{}); }},
                               {"two", [&] { run(two); }},
                               {"arithmetic, one",
                                [&] {
                                    for (int task = 0; task < 200; ++task) arithmetic(task, 0);
                                }},
                               {"arithmetic, two", [&] { executor.for_each(200, arithmetic); }}},
                              effort(options, Clock::wall)};
            for (const std::size_t i : {0u, 1u})
                results.measurements.push_back(
                    {.part = "threads",
                     .scene = view.scene.name,
                     .contender = directions > 0 ? "nook" : "nook, build",
                     .radius = radius,
                     .directions = directions,
                     .threads = static_cast<int>(i) + 1,
                     .seconds = times.seconds(i),
                     .base = "two threads",
                     .ratio = times.ratio(i, 1)});
            rows.push_back({what, digits("%.1f", 1e3 * times.seconds(0).median),
                            digits("%.1f", 1e3 * times.seconds(1).median),
                            text_of(times.ratio(0, 1)), text_of(times.ratio(2, 3))});
            return times.ratio(0, 1);
        };
        for (const Reach& reach : {reaches[0], reaches[1], reaches[3]})
            for (const int directions : {16, 64}) {
                const std::string label = place(view, reach, directions);
                const Sampling sampling = view.sampling(reach, directions);
                mark.take(compare(label, reach.name, directions,
                                  [&](const Threads& threads) {
                                      (void)checked(best.traced_ao(bvh, view.points, sampling,
                                                                   visibility.data(), threads),
                                                    "traced_ao");
                                  }),
                          label);
            }
        (void)compare(view.scene.name + ", build", "", 0, [&](const Threads& threads) {
            const NookBvh again{best, view.scene.mesh(), threads};
        });
    }
    std::printf("two threads against one, nook %s\n", best.name);
    print_table(rows);
    results.marks.push_back(mark);
}

}  // namespace compare
