#include "parts.hpp"

#include <cstdio>

#include "common.hpp"
#include "images.hpp"

namespace compare {

void compare_windows(const Options& options, Results& results)
{
    const Kernels& best = targets().best();
    Mark mark{"time at k = 127 over k = 3", false, 1.6, 1.25};
    for (const Size& size : sizes(options)) {
        const nook::Image<float> depth = finite_image(size.width, size.height);
        nook::Image<float> out{size.width, size.height};
        std::vector<Contender> contenders;
        std::vector<std::vector<std::string>> rows{{""}, {"ns per pixel"}, {"over k = 3"}};
        for (const int window : windows) {
            rows[0].push_back("k = " + std::to_string(window));
            contenders.push_back(
                nook_contender(rows[0].back(), best, depth.view(), out.view(), {.window = window}));
        }
        const Times times{contenders, effort(options)};
        for (std::size_t i = 0; i < contenders.size(); ++i) {
            const Measurement m{
                .part = "windows",
                .image = "finite",
                .contender = std::string{"nook "} + best.name,
                .width = size.width,
                .height = size.height,
                .window = windows[i],
                .nanoseconds = per_pixel(times.seconds(i), size.pixels()),
                .base = contenders.front().name,
                .ratio = times.ratio(i, 0),
            };
            rows[1].push_back(digits("%.3f", m.nanoseconds.median));
            rows[2].push_back(text_of(m.ratio));
            results.measurements.push_back(m);
        }
        mark.take(times.ratio(contenders.size() - 1, 0), size.name);
        std::printf("%s: nook %s over the window\n", size.name, best.name);
        print_table(rows);
    }
    results.marks.push_back(mark);
}

}  // namespace compare
