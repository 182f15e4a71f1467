#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common.hpp"

namespace compare {

namespace {

constexpr int many = 1024;

double rms_of_difference(const std::vector<float>& values, const std::vector<double>& reference)
{
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double gap = double{values[i]} - reference[i];
        sum += gap * gap;
    }
    return std::sqrt(sum / double(values.size()));
}

}  // namespace

void compare_error(const Options& options, const std::vector<View>& views, Results& results)
{
    const Kernels& best = targets().best();
    // By number of directions and radius.
    Mark marks[2][2] = {{{"over random rays of equal error, N = 16, R = 1 %", true, 10, 20},
                         {"over random rays of equal error, N = 16, R = 5 %", true, 7, 12}},
                        {{"over random rays of equal error, N = 64, R = 1 %", true, 10, 20},
                         {"over random rays of equal error, N = 64, R = 5 %", true, 7, 12}}};
    const auto append = [&] {
        for (const auto& row : marks)
            for (const Mark& mark : row) results.marks.push_back(mark);
    };
    if (!has_embree()) {
        std::printf("equal error: not measured without Embree\n\n");
        append();
        return;
    }
    std::vector<std::vector<std::string>> rows{{"", "error, nook", "random rays of equal error",
                                                "their error", "nook, us/point",
                                                "occluded1, us/point", "speed-up"}};
    for (const View& view : views) {
        const NookBvh bvh{best, view.scene.mesh()};
        EmbreeScene embree{view.scene.mesh(), EmbreeScene::Mode::plain};
        const Points points = view.few;
        std::vector<float> visibility(points.count);
        for (const Reach& reach : {reaches[0], reaches[1]}) {
            // Several sets, none of them one that is measured.
            std::vector<double> reference(points.count);
            constexpr int sets = 4;
            for (int set = 0; set < sets; ++set) {
                Sampling sampling = view.sampling(reach, options.quick ? 64 : many);
                sampling.seed = static_cast<std::uint32_t>(1000 + set);
                (void)checked(best.traced_ao(bvh, points, sampling, visibility.data(), {}),
                              "traced_ao");
                for (std::size_t i = 0; i < points.count; ++i)
                    reference[i] += double{visibility[i]} / sets;
            }
            // The error of random rays falls with the root of their number.
            double scale = 0;
            for (const int directions : {16, 64, 256}) {
                best.embree_random(embree.handle(), points, view.sampling(reach, directions),
                                   visibility.data());
                scale += rms_of_difference(visibility, reference) * std::sqrt(directions) / 3;
            }
            for (const int directions : {16, 64}) {
                const Sampling sampling = view.sampling(reach, directions);
                (void)checked(best.traced_ao(bvh, points, sampling, visibility.data(), {}),
                              "traced_ao");
                const double error = rms_of_difference(visibility, reference);
                const double equal = error > 0 ? std::pow(scale / error, 2) : directions;
                Sampling random = sampling;
                random.directions = static_cast<int>(std::lround(std::clamp(equal, 1.0, 1e5)));
                best.embree_random(embree.handle(), points, random, visibility.data());
                const double random_error = rms_of_difference(visibility, reference);
                const std::vector<Contender> contenders{
                    {"nook",
                     [&] {
                         (void)checked(best.traced_ao(bvh, points, sampling, visibility.data(), {}),
                                       "traced_ao");
                     }},
                    {"Embree occluded1, random", [&] {
                         best.embree_random(embree.handle(), points, random, visibility.data());
                     }}};
                const Times times{contenders, effort(options)};
                const Summary gain = times.ratio(1, 0);
                const std::string label = place(view, reach, directions);
                const auto microseconds = [&](std::size_t i) {
                    return digits("%.2f", 1e6 * times.seconds(i).median / double(points.count));
                };
                rows.push_back({label, digits("%.4f", error), std::to_string(random.directions),
                                digits("%.4f", random_error), microseconds(0), microseconds(1),
                                text_of(gain)});
                for (std::size_t i = 0; i < 2; ++i)
                    results.measurements.push_back(
                        {.part = "error",
                         .scene = view.scene.name,
                         .contender = contenders[i].name,
                         .radius = reach.name,
                         .directions = i == 0 ? directions : random.directions,
                         .seconds = times.seconds(i),
                         .rays = double(points.count) * (i == 0 ? directions : random.directions),
                         .base = contenders[0].name,
                         .ratio = times.ratio(i, 0)});
                results.facts.push_back({"error, " + label, error});
                marks[directions == 16 ? 0 : 1][reach.share < 0.02 ? 0 : 1].take(gain, label);
            }
        }
    }
    std::printf("equal error: nook %s against a loop of occluded1 over random rays\n", best.name);
    print_table(rows);
    std::printf("Errors are root mean squares against 4 sets of %d directions.\n\n",
                options.quick ? 64 : many);
    append();
}

}  // namespace compare
