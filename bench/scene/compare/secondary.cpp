#include "parts.hpp"

#include <algorithm>
#include <cstdio>

#include "common.hpp"

namespace compare {

void compare_secondary(const Options& options, const std::vector<View>& views, Results& results)
{
    const Kernels& best = targets().best();
    const int width = options.quick ? 160 : 1920, height = options.quick ? 90 : 1080;
    std::vector<std::vector<std::string>> rows{{"", "plain, ms", "with secondary rays, ms",
                                                "more, ms", "over plain", "rays",
                                                "with secondary"}};
    for (const View& view : views) {
        const NookBvh bvh{best, view.scene.mesh()};
        const Picture picture = draw(view.scene, width, height);
        nook::Image<float> visibility{width, height};
        const Reach& reach = reaches[1];
        for (const int directions : {4, 32}) {
            const Sampling sampling = view.sampling(reach, directions);
            nook::Work work[2]{};
            const auto contender = [&](const char* name, bool secondary) -> Contender {
                return {name, [&, secondary] {
                            const PictureJob job{.depth = picture.depth.view(),
                                                 .normals = picture.normal(),
                                                 .projection = picture.projection,
                                                 .frame = picture.frame,
                                                 .visibility = visibility.view(),
                                                 .secondary_rays = secondary};
                            work[secondary] =
                                checked(best.traced_picture(bvh, job, sampling, {}), "traced_ao");
                        }};
            };
            const std::vector<Contender> contenders{contender("plain", false),
                                                    contender("with secondary rays", true)};
            Effort few = effort(options);
            few.rounds = (std::min)(few.rounds, 3);
            const Times times{contenders, few};
            for (std::size_t i = 0; i < 2; ++i)
                results.measurements.push_back({.part = "secondary",
                                                .scene = view.scene.name,
                                                .contender = contenders[i].name,
                                                .radius = reach.name,
                                                .directions = directions,
                                                .seconds = times.seconds(i),
                                                .rays = double(work[i].rays),
                                                .base = contenders[0].name,
                                                .ratio = times.ratio(i, 0)});
            const double plain = 1e3 * times.seconds(0).median, all = 1e3 * times.seconds(1).median;
            rows.push_back({place(view, reach, directions), digits("%.0f", plain),
                            digits("%.0f", all), digits("%.0f", all - plain),
                            text_of(times.ratio(1, 0)), digits("%.3g", double(work[0].rays)),
                            digits("%.3g", double(work[1].rays))});
        }
    }
    std::printf("secondary rays, a picture of %d x %d, one thread, nook %s\n", width, height,
                best.name);
    print_table(rows);
    std::printf(
        "On a GPU they add 2 ms at 4 directions and 15 ms at 32 (Fridvalszky & Toth 2022).\n\n");
}

}  // namespace compare
