#include "parts.hpp"

#include <cstdio>

#include "common.hpp"
#include "work_list.hpp"

namespace compare {

void compare_rivals(const Options& options, const std::vector<Picture>& pictures, Results& results)
{
    Mark gtao{"GTAO, 3 slices x 6 samples, time over AAO 16", false, 0, 2};
    for (const Picture& picture : pictures) {
        WorkList list{picture};
        std::vector<Contender> contenders;
        for (const Task& task : list.tasks())
            contenders.push_back(nook_contender(task.name, list.job(), task.run));
        const Times times{contenders, effort(options)};
        std::vector<std::vector<std::string>> rows{{"", "ns per pixel", "over AAO 16"}};
        for (std::size_t i = 0; i < contenders.size(); ++i) {
            Measurement m = measured("rivals", picture, contenders, times, i, WorkList::obscurance);
            m.samples = list.tasks()[i].samples;
            rows.push_back({m.contender, text_of(m.nanoseconds), text_of(m.ratio)});
            results.measurements.push_back(m);
        }
        gtao.take(times.ratio(WorkList::horizons, WorkList::obscurance), picture.name);
        std::printf("%s: one thread, nook %s\n", picture.name.c_str(), targets().best().name);
        print_table(rows);
    }
    results.marks.push_back(gtao);
}

}  // namespace compare
