#include "parts.hpp"

#include <cstdio>
#include <thread>

#include <nook/thread_executor.hpp>

#include "common.hpp"
#include "images.hpp"

namespace compare {

void compare_threads(const Options& options, Results& results)
{
    const std::vector<Size> all = sizes(options);
    Mark mark{std::string{"two threads, speed-up, "} + all.front().name, true, 1.7, 1.95};
    Mark large{std::string{"two threads, speed-up over memcpy's own, "} + all.back().name, true, 1};
    if (std::thread::hardware_concurrency() < 2) {
        std::printf("two threads: not measured, this machine runs one\n\n");
    } else {
        const Kernels& best = targets().best();
        nook::ThreadExecutor executor{2};
        const Threads two = lend(executor);
        std::vector<std::vector<std::string>> rows{
            {"", "one, ns/px", "two, ns/px", "speed-up", "memcpy's speed-up"}};
        for (const Size& size : all) {
            const nook::Image<float> depth = finite_image(size.width, size.height);
            nook::Image<float> out{size.width, size.height};
            const int half = size.height / 2;
            const auto copy_half = [&](int index, int) {
                const int first = index == 0 ? 0 : half, last = index == 0 ? half : size.height;
                const std::size_t count =
                    static_cast<std::size_t>(last - first) * static_cast<std::size_t>(size.width);
                std::memcpy(&out(0, first), &depth(0, first), sizeof(float) * count);
            };
            for (const int window : {7, 31, 127}) {
                const nook::ChebyshevOptions filter{.window = window};
                const Times times{
                    {nook_contender("one", best, depth.view(), out.view(), filter),
                     nook_contender("two", best, depth.view(), out.view(), filter, {}, two),
                     memcpy_contender(depth.view(), out.view()),
                     {"memcpy, two", [&] { executor.for_each(2, copy_half); }}},
                    effort(options, Clock::wall)};
                const Summary speed_up = times.ratio(0, 1), copying = times.ratio(2, 3);
                const std::string place =
                    std::string{size.name} + ", k = " + std::to_string(window);
                rows.push_back({place,
                                digits("%.3f", per_pixel(times.seconds(0), size.pixels()).median),
                                digits("%.3f", per_pixel(times.seconds(1), size.pixels()).median),
                                text_of(speed_up), text_of(copying)});
                const auto add = [&](const char* name, std::size_t i, int threads,
                                     std::size_t base) {
                    results.measurements.push_back(
                        {.part = "threads",
                         .image = "finite",
                         .contender = name,
                         .width = size.width,
                         .height = size.height,
                         .window = window,
                         .threads = threads,
                         .nanoseconds = per_pixel(times.seconds(i), size.pixels()),
                         .base = std::string{name} + ", two threads",
                         .ratio = times.ratio(i, base)});
                };
                add("nook", 0, 1, 1);
                add("nook", 1, 2, 1);
                add("memcpy", 2, 1, 3);
                add("memcpy", 3, 2, 3);
                if (size.width == all.front().width) mark.take(speed_up, place);
                else
                    large.take({speed_up.median / copying.median, speed_up.lower / copying.median,
                                speed_up.upper / copying.median},
                               place);
            }
        }
        std::printf("two threads against one, nook %s\n", best.name);
        print_table(rows);
    }
    results.marks.push_back(mark);
    results.marks.push_back(large);
}

}  // namespace compare
