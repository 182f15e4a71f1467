#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/surface/bilateral.hpp>

#include "../support/checked.hpp"
#include "stability.hpp"

namespace stability {

namespace {

using nook::Image;

constexpr int columns = 64, rows = 48, radius = 4;
const nook::Projection projection{.fx = 60, .fy = 60, .cx = columns / 2.0, .cy = rows / 2.0};

struct Sky {
    Label label;
    float depth;
};

bool is_sky(int x, int y) { return y < 20 - x * 7 % 5; }

/// Ground from 1000 at the horizon to the viewer's feet, below a sky of that depth.
Image<float> landscape(float sky)
{
    Image<float> depth{columns, rows};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            depth(x, y) = is_sky(x, y) ? sky : static_cast<float>(1000 / (1 + (y - 15) * 0.8));
    return depth;
}
/// Half open ground below the open sky.
Image<float> shade()
{
    Image<float> visibility{columns, rows};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) visibility(x, y) = is_sky(x, y) ? 1.f : 0.5f;
    return visibility;
}

using Blur = Image<float> (*)(const Image<float>& visibility, const Image<float>& depth);

/// weight(δ) for neighbours of depth difference δ, times a Gaussian over the window.
template <class Weight>
Image<float> textbook(const Image<float>& visibility, const Image<float>& depth,
                      const Weight& weight)
{
    Image<float> result{columns, rows};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            float sum = 0, weights = 0;
            for (int j = std::max(y - radius, 0); j <= std::min(y + radius, rows - 1); ++j)
                for (int i = std::max(x - radius, 0); i <= std::min(x + radius, columns - 1); ++i) {
                    const auto square = static_cast<float>((i - x) * (i - x) + (j - y) * (j - y));
                    const float w = std::exp(-square / 12.5f) * weight(depth(x, y), depth(i, j));
                    sum += w * visibility(i, j);
                    weights += w;
                }
            result(x, y) = sum / weights;
        }
    return result;
}
Image<float> plain(const Image<float>& visibility, const Image<float>& depth)
{
    return textbook(visibility, depth, [](float, float) { return 1.f; });
}
Image<float> gaussian_range(const Image<float>& visibility, const Image<float>& depth)
{
    return textbook(visibility, depth, [](float here, float there) {
        const float difference = (there - here) / (0.05f * here);
        return std::exp(-difference * difference);
    });
}
Image<float> nook_blur(const Image<float>& visibility, const Image<float>& depth)
{
    Image<float> result{columns, rows};
    support::checked(nook::bilateral_blur(visibility.view(), depth.view(), result.view(),
                                          {.radius = radius}, projection),
                     "bilateral_blur");
    return result;
}

/// The largest change of the pixels of the sky or of the ground; NaN when one is.
double change(const Image<float>& blurred, bool sky)
{
    double worst = 0;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            if (is_sky(x, y) != sky) continue;
            const double difference = std::fabs(double{blurred(x, y)} - (sky ? 1 : 0.5));
            if (std::isnan(difference)) return difference;
            worst = std::max(worst, difference);
        }
    return worst;
}

}  // namespace

Family surface_blur()
{
    Family family;
    family.label = {
        "surface-blur",
        "the blur of half open ground beside the open sky, which should change nothing"};
    family.metrics = {{"ground", "largest change of a pixel of the ground"},
                      {"sky", "largest change of a pixel of the sky"}};
    struct Algorithm {
        Label label;
        Blur blur;
    };
    const Algorithm algorithms[] = {
        {{"gaussian", "without a look at depth"}, plain},
        {{"gaussian-range", "times a Gaussian of the depth difference, 5 % of the depth wide"},
         gaussian_range},
        {{"nook", "bilateral_blur"}, nook_blur},
    };
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    for (const Algorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const Sky& sky :
         {Sky{{"sky-infinity", "a sky at infinity"}, infinity},
          Sky{{"sky-nan", "a sky of NaN"}, nan}, Sky{{"sky-0", "a sky of zeros"}, 0},
          Sky{{"sky-negative", "a sky of -1"}, -1}}) {
        family.cases.push_back(sky.label);
        const Image<float> depth = landscape(sky.depth);
        for (const Algorithm& algorithm : algorithms) {
            const Image<float> blurred = algorithm.blur(shade(), depth);
            family.rows.push_back({sky.label.name,
                                   algorithm.label.name,
                                   {{"radius", radius}},
                                   {change(blurred, false), change(blurred, true)}});
        }
    }
    return family;
}

}  // namespace stability
