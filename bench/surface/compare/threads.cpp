#include "parts.hpp"

#include <cstdio>
#include <thread>

#include <nook/thread_executor.hpp>

#include "common.hpp"
#include "work_list.hpp"

namespace compare {

void compare_threads(const Options& options, const std::vector<Picture>& pictures, Results& results)
{
    Mark mark{"two threads, speed-up of the kernels of occlusion", true, 1.8, 1.95};
    if (std::thread::hardware_concurrency() < 2) {
        std::printf("two threads: not measured, this machine runs one\n\n");
        results.marks.push_back(mark);
        return;
    }
    nook::ThreadExecutor executor{2};
    const Threads two = lend(executor);
    // Two threads of a busy machine may get no more than one does.
    const auto arithmetic = [](int task, int) {
        volatile unsigned state = static_cast<unsigned>(task);
        for (int i = 0; i < 20000; ++i) state = state * 1664525u + 1013904223u;
    };
    const Contender plain{"arithmetic, one", [&] {
                              for (int task = 0; task < 200; ++task) arithmetic(task, 0);
                          }};
    const Contender shared{"arithmetic, two", [&] { executor.for_each(200, arithmetic); }};
    for (const Picture& picture : pictures) {
        WorkList list{picture};
        std::vector<std::vector<std::string>> rows{
            {"", "one, ns/px", "two, ns/px", "speed-up", "of plain arithmetic"}};
        for (const Task& task : list.tasks()) {
            Job job = list.job();
            const Contender one = nook_contender(task.name, job, task.run);
            job.threads = two;
            const Contender both = nook_contender(task.name, job, task.run);
            const std::vector<Contender> contenders{one, both, plain, shared};
            const Times times{contenders, effort(options, Clock::wall)};
            for (const std::size_t i : {0u, 1u}) {
                Measurement m = measured("threads", picture, contenders, times, i, 1);
                m.samples = task.samples;
                m.threads = static_cast<int>(i) + 1;
                m.base = task.name + ", two threads";
                results.measurements.push_back(m);
            }
            const Summary speed_up = times.ratio(0, 1);
            if (task.occlusion) mark.take(speed_up, picture.name + ", " + task.name);
            rows.push_back({task.name,
                            digits("%.2f", per_pixel(times.seconds(0), picture.pixels()).median),
                            digits("%.2f", per_pixel(times.seconds(1), picture.pixels()).median),
                            text_of(speed_up), text_of(times.ratio(2, 3))});
        }
        std::printf("%s: two threads against one, nook %s\n", picture.name.c_str(),
                    targets().best().name);
        print_table(rows);
    }
    results.marks.push_back(mark);
}

}  // namespace compare
