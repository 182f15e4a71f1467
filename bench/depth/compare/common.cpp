#include "common.hpp"

#include <algorithm>
#include <cmath>

namespace compare {

Agreement difference(const nook::Image<float>& one, const nook::Image<float>& other, int margin)
{
    Agreement result;
    double count = 0, apart = 0;
    for (int y = margin; y < one.height() - margin; ++y)
        for (int x = margin; x < one.width() - margin; ++x) {
            double gap = std::fabs(double{one(x, y)} - double{other(x, y)});
            if (!(gap <= 1)) gap = 1;  // not a visibility at all
            result.largest = (std::max)(result.largest, gap);
            apart += gap > 1e-3;
            ++count;
        }
    result.share = count > 0 ? apart / count : 0;
    return result;
}

}  // namespace compare
