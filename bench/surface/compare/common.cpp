#include "common.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <nook/depth/source.hpp>

namespace compare {

Agreement difference(const Picture& picture, const nook::Image<float>& one,
                     const nook::Image<float>& other)
{
    Agreement result;
    double count = 0, apart = 0, squares = 0;
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x) {
            double gap = double{one(x, y)} - double{other(x, y)};
            if (!(std::fabs(gap) <= 1)) gap = 1;  // not a visibility at all
            result.largest = (std::max)(result.largest, std::fabs(gap));
            if (!nook::is_surface(picture.depth(x, y), (std::numeric_limits<float>::max)()))
                continue;
            result.mean += gap;
            squares += gap * gap;
            apart += std::fabs(gap) > 1e-2;
            ++count;
        }
    if (count > 0) {
        result.mean /= count;
        result.rms = std::sqrt(squares / count);
        result.share = apart / count;
    }
    result.scene = picture.name;
    return result;
}

void print_agreements(const std::vector<Agreement>& agreements)
{
    std::vector<std::vector<std::string>> rows{
        {"", "against", "samples", "mean", "rms", "largest", "beyond 0.01"}};
    for (const Agreement& agreement : agreements)
        rows.push_back({agreement.scene + ", " + agreement.contender, agreement.other,
                        std::to_string(agreement.samples), digits("%+.4f", agreement.mean),
                        digits("%.4f", agreement.rms), digits("%.3f", agreement.largest),
                        digits("%.2f %%", 100 * agreement.share)});
    std::printf("differences of visibility on surfaces\n");
    print_table(rows);
}

}  // namespace compare
