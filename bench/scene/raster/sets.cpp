#include "parts.hpp"

#include <cstdio>

#include "compare/pinned.hpp"
#include "compare/table.hpp"
#include "kernels.hpp"

namespace compare {

void compare_sets(const Options& options, const std::vector<View>& views, Results& results)
{
    const Targets all = targets();
    const Pinned pinned;
    for (const View& view : views) {
        Buffers buffers{view};
        Workspace workspace;
        std::vector<std::vector<std::string>> rows{{""}};
        for (int i = all.count - 1; i >= 0; --i) {
            rows[0].push_back(std::string{all.kernels[i]->name} + ", ms");
            if (i + 1 < all.count) rows[0].push_back("over the best");
        }
        for (const Target target :
             {Target::facets, Target::smooth, Target::depth, Target::counts}) {
            std::vector<Contender> contenders;
            for (int i = all.count - 1; i >= 0; --i)
                contenders.push_back(
                    {std::string{all.kernels[i]->name} + ", " + text_of(target),
                     [&, i] { draw(*all.kernels[i], target, view, buffers, workspace); }});
            const Times times{contenders, effort(options)};
            rows.push_back({text_of(target)});
            for (std::size_t i = 0; i < contenders.size(); ++i) {
                results.measurements.push_back(measured("sets", view, contenders, times, i, 0));
                rows.back().push_back(digits("%.2f", 1e3 * times.seconds(i).median));
                if (i > 0) rows.back().push_back(text_of(times.ratio(i, 0)));
            }
        }
        std::printf("%s: instruction sets, one thread\n", view.name().c_str());
        print_table(rows);
    }
}

}  // namespace compare
