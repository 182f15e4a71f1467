#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "common.hpp"

namespace compare {

namespace {

/// What is asked of nook over Embree's best call, by scene, radius and number of directions.
struct Marks {
    Mark near_16{"N = 16, R = 1 %, over Embree's best", true, 1.6, 3};
    Mark near_64{"N = 64, R = 1 %, over Embree's best", true, 2.2, 4};
    Mark middle_16{"N = 16, R = 5 %, over Embree's best", true, 1.1, 1.6};
    Mark middle_64{"N = 64, R = 5 %, over Embree's best", true, 1.35, 2};
    Mark open_16{"N = 16, R >= 20 %, open, over Embree's best", true, 0.9, 1.1};
    Mark open_64{"N = 64, R >= 20 %, open, over Embree's best", true, 0.9, 1.2};
    Mark closed_16{"N = 16, R >= 20 %, closed interior, over Embree's best", true, 0.75, 1.1};
    Mark closed_64{"N = 64, R >= 20 %, closed interior, over Embree's best", true, 0.75, 1.2};

    [[nodiscard]] Mark& of(const Reach& reach, int directions, bool closed)
    {
        const bool few = directions == 16;
        if (reach.share < 0.02) return few ? near_16 : near_64;
        if (reach.share < 0.1) return few ? middle_16 : middle_64;
        if (closed) return few ? closed_16 : closed_64;
        return few ? open_16 : open_64;
    }
    void append_to(std::vector<Mark>& marks) const
    {
        for (const Mark* mark : {&near_16, &near_64, &middle_16, &middle_64, &open_16, &open_64,
                                 &closed_16, &closed_64})
            marks.push_back(*mark);
    }
};

class Contest {
public:
    Contest(const View& view, const Options& options, Results& results, Marks& marks)
        : view_{view},
          options_{options},
          results_{results},
          marks_{marks},
          bvh_{best_, view.scene.mesh()}
    {
        if (has_embree()) {
            embree_.emplace(view.scene.mesh(), EmbreeScene::Mode::plain);
            robust_.emplace(view.scene.mesh(), EmbreeScene::Mode::robust);
        }
    }

    void run()
    {
        std::vector<float> open(view_.points.count());
        const Sampling unlimited = view_.sampling(reaches[3], 16);
        best_.single_rays(bvh_, view_.points, unlimited, open.data());
        // Nearly all rays end somewhere: an interior.
        closed_ = mean(open) < 0.25;
        std::vector<std::vector<std::string>> rows{
            {"", "occluded", "nook, us/point", "nook", "ray by ray", "occluded1", "occluded16",
             "stream", "robust 1", "robust 16", "robust stream", "over Embree's best",
             "over robust's best", "points differ"}};
        for (const int directions : {16, 64})
            for (const Reach& reach : reaches) rows.push_back(measure(reach, directions));
        std::printf("%s, %s: million rays per second, nook %s\n", view_.scene.name.c_str(),
                    closed_ ? "a closed interior" : "open", best_.name);
        print_table(rows);
    }

private:
    static constexpr std::size_t nook_list = 0, nook_rays = 1, plain = 2, robust = 5;

    [[nodiscard]] std::vector<std::string> measure(const Reach& reach, int directions)
    {
        const Sampling sampling = view_.sampling(reach, directions);
        const Points points = view_.points;
        std::vector<Contender> contenders;
        std::vector<std::vector<float>> visibility(8, std::vector<float>(points.count));
        const auto out = [&] { return visibility[contenders.size()].data(); };
        contenders.push_back({"nook", [=, this, to = out()] {
                                  (void)checked(best_.traced_ao(bvh_, points, sampling, to, {}),
                                                "traced_ao");
                              }});
        contenders.push_back({"nook, ray by ray", [=, this, to = out()] {
                                  best_.single_rays(bvh_, points, sampling, to);
                              }});
        // Which column a contender stands in, and which it is there.
        std::vector<std::size_t> columns{nook_list, nook_rays};
        const auto add = [&](std::optional<EmbreeScene>& scene, const char* mode,
                             std::size_t column) {
            if (!scene) return;
            const Loop loops[] = {best_.embree_single, best_.embree_packets, best_.embree_stream};
            const char* const names[] = {"occluded1", "occluded16", "occluded1M"};
            for (std::size_t i = 0; i < 3; ++i) {
                if (loops[i] == nullptr) continue;
                contenders.push_back({std::string{"Embree"} + mode + ' ' + names[i],
                                      [=, loop = loops[i], handle = scene->handle(), to = out()] {
                                          loop(handle, points, sampling, to);
                                      }});
                columns.push_back(column + i);
            }
        };
        add(embree_, "", plain);
        add(robust_, " robust", robust);

        const Times times{contenders, effort(options_)};
        const double rays = double(points.count) * directions;
        const auto fastest = [&](std::size_t column) -> std::optional<std::size_t> {
            std::optional<std::size_t> best;
            for (std::size_t i = 0; i < contenders.size(); ++i)
                if (columns[i] >= column && columns[i] < column + 3 && columns[i] >= plain &&
                    (!best || times.seconds(i).median < times.seconds(*best).median))
                    best = i;
            return best;
        };
        const std::optional<std::size_t> bar = fastest(plain), robust_bar = fastest(robust);

        std::vector<std::string> row(14, "-");
        row[0] = std::string{"R "} + reach.name + ", N " + std::to_string(directions);
        row[1] = digits("%.0f %%", 100 * (1 - mean(visibility[nook_rays])));
        row[2] = digits("%.3f", 1e6 * times.seconds(nook_list).median / double(points.count));
        for (std::size_t i = 0; i < contenders.size(); ++i) {
            row[3 + columns[i]] = digits("%.1f", 1e-6 * rays / times.seconds(i).median);
            results_.measurements.push_back({.part = "ao",
                                             .scene = view_.scene.name,
                                             .contender = contenders[i].name,
                                             .radius = reach.name,
                                             .directions = directions,
                                             .seconds = times.seconds(i),
                                             .rays = rays,
                                             .base = contenders[nook_list].name,
                                             .ratio = times.ratio(i, nook_list)});
        }
        if (bar) {
            const Summary gain = times.ratio(*bar, nook_list);
            row[11] = text_of(gain);
            marks_.of(reach, directions, closed_).take(gain, place(view_, reach, directions));
        }
        if (robust_bar) row[12] = text_of(times.ratio(*robust_bar, nook_list));
        std::size_t differ = 0;
        const auto& other = visibility[robust_bar ? 5 : nook_rays];
        for (std::size_t i = 0; i < points.count; ++i)
            differ += visibility[nook_list][i] != other[i];
        row[13] = std::to_string(differ);
        return row;
    }

    const View& view_;
    const Options& options_;
    Results& results_;
    Marks& marks_;
    const Kernels& best_ = targets().best();
    NookBvh bvh_;
    std::optional<EmbreeScene> embree_{}, robust_{};
    bool closed_ = false;
};

}  // namespace

void compare_ao(const Options& options, const std::vector<View>& views, Results& results)
{
    Marks marks;
    for (const View& view : views) Contest{view, options, results, marks}.run();
    std::printf("Where points differ: nook's kernel against Embree's robust %s.\n\n",
                has_embree() ? "mode" : "mode, or nook ray by ray without Embree");
    marks.append_to(results.marks);
}

}  // namespace compare
