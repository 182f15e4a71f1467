#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/upsample.hpp>

#include "../support/checked.hpp"
#include "stability.hpp"
#include "worst.hpp"

namespace stability {

namespace {

using nook::Image;

constexpr int columns = 64, rows = 48, radius = 4;
const nook::Projection projection{.fx = 60, .fy = 60, .cx = columns / 2.0, .cy = rows / 2.0};

struct Sky {
    Label label;
    float depth;
    double scale = 1;  ///< of all distances
};

bool is_sky(int x, int y) { return y < 20 - x * 7 % 5; }

/// Ground from 1000 at the horizon to the viewer's feet, below the sky.
Image<float> landscape(const Sky& sky)
{
    Image<float> depth{columns, rows};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            depth(x, y) = is_sky(x, y)
                              ? sky.depth
                              : static_cast<float>(sky.scale * 1000 / (1 + (y - 15) * 0.8));
    return depth;
}
std::vector<Sky> skies()
{
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    return {{{"sky-infinity", "a sky at infinity"}, infinity},
            {{"sky-nan", "a sky of NaN"}, nan},
            {{"sky-0", "a sky of zeros"}, 0},
            {{"sky-negative", "a sky of -1"}, -1},
            {{"far-1e6", "a far surface at 1e6 for a sky"}, 1e6f},
            {{"scale-1e-6", "a sky at infinity, all distances times 1e-6"}, infinity, 1e-6},
            {{"scale-1e6", "all distances times 1e6"}, infinity, 1e6}};
}
/// Half open ground below the open sky.
Image<float> shade()
{
    Image<float> visibility{columns, rows};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) visibility(x, y) = is_sky(x, y) ? 1.f : 0.5f;
    return visibility;
}

// --- the blur -------------------------------------------------------------------------------------------

float near_in_depth(float here, float there)
{
    const float difference = (there - here) / (0.05f * here);
    return std::exp(-difference * difference);
}

/// weight(here, there) for two depths, times a Gaussian over the window.
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
    return textbook(visibility, depth, near_in_depth);
}
Image<float> nook_blur(const Image<float>& visibility, const Image<float>& depth)
{
    Image<float> result{columns, rows};
    support::checked(nook::bilateral_blur(visibility.view(), depth.view(), result.view(),
                                          {.radius = radius}, projection),
                     "bilateral_blur");
    return result;
}

// --- from half the resolution ---------------------------------------------------------------------------

/// Calls f with the half pixels beside a pixel, by their places in the full picture.
template <class F>
void for_each_half_pixel(int x, int y, const F& f)
{
    for (int j = y - y % 2; j <= std::min(y + y % 2, rows - 2); j += 2)
        for (int i = x - x % 2; i <= std::min(x + x % 2, columns - 2); i += 2) f(i, j);
}
/// Whether a half pixel shows what the pixel does: nothing is known about the others.
bool is_known(int x, int y)
{
    bool known = false;
    for_each_half_pixel(x, y, [&](int i, int j) { known = known || is_sky(i, j) == is_sky(x, y); });
    return known;
}
/// The mean of the half pixels beside a pixel, with weights.
template <class Weight>
Image<float> upsampled(const Image<float>& visibility, const Image<float>& depth,
                       const Weight& weight)
{
    Image<float> result{columns, rows};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            float sum = 0, weights = 0;
            for_each_half_pixel(x, y, [&](int i, int j) {
                const float w = weight(depth(x, y), depth(i, j));
                sum += w * visibility(i, j);
                weights += w;
            });
            result(x, y) = sum / weights;
        }
    return result;
}
Image<float> nook_upsampling(const Image<float>& visibility, const Image<float>& depth)
{
    Image<float> result{columns, rows};
    support::checked(nook::upsample(nook::half_view(visibility.view()), depth.view(), result.view(),
                                    {}, projection),
                     "upsample");
    return result;
}

// --- rows -----------------------------------------------------------------------------------------------

using Filter = Image<float> (*)(const Image<float>& visibility, const Image<float>& depth);
struct Algorithm {
    Label label;
    Filter run;
};

/// Changes of the pixels of the sky or of the ground that `counts(x, y)`.
template <class Counts>
Worst changes(const Image<float>& filtered, const Image<float>& depth, bool sky,
              const Counts& counts)
{
    Worst worst;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            if (is_sky(x, y) != sky || !counts(x, y)) continue;
            const double before = sky ? 1 : 0.5, after{filtered(x, y)};
            worst.add(std::fabs(after - before), [&] {
                return joined("pixel (", x, ", ", y, "), depth ", depth(x, y), ": ", after, " for ",
                              before);
            });
        }
    return worst;
}

template <class Counts>
void add_rows(Family& family, const std::vector<Algorithm>& algorithms,
              const nlohmann::ordered_json& parameters, const Counts& counts)
{
    family.metrics = {{"ground", "largest change of a pixel of the ground"},
                      {"sky", "largest change of a pixel of the sky"},
                      {"nan", "pixels with a NaN"}};
    for (const Algorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const Sky& sky : skies()) {
        family.cases.push_back(sky.label);
        const Image<float> depth = landscape(sky);
        for (const Algorithm& algorithm : algorithms) {
            const Image<float> filtered = algorithm.run(shade(), depth);
            const Worst below = changes(filtered, depth, false, counts);
            const Worst above = changes(filtered, depth, true, counts);
            Row row{sky.label.name,
                    algorithm.label.name,
                    parameters,
                    {below.value(), above.value(), below.nans() + above.nans()}};
            set_worst(row, 0, below, 2);
            set_worst(row, 1, above, 2);
            family.rows.push_back(std::move(row));
        }
    }
}

}  // namespace

Family surface_blur()
{
    Family family;
    family.label = {
        "surface-blur",
        "the blur of half open ground beside the open sky, which should change nothing"};
    add_rows(
        family,
        {{{"gaussian", "without a look at depth"}, plain},
         {{"gaussian-range", "times a Gaussian of the depth difference, 5 % of the depth wide"},
          gaussian_range},
         {{"nook", "bilateral_blur"}, nook_blur}},
        {{"radius", radius}}, [](int, int) { return true; });
    return family;
}

Family surface_upsampling()
{
    Family family;
    family.label = {"surface-upsampling",
                    "the same from every second pixel of every second row, at pixels that have one "
                    "of their own surface beside them"};
    add_rows(
        family,
        {{{"bilinear", "the mean of the half pixels beside a pixel"},
          [](const Image<float>& visibility, const Image<float>& depth) {
              return upsampled(visibility, depth, [](float, float) { return 1.f; });
          }},
         {{"gaussian-range", "times a Gaussian of the depth difference, 5 % of the depth wide"},
          [](const Image<float>& visibility, const Image<float>& depth) {
              return upsampled(visibility, depth, near_in_depth);
          }},
         {{"nook", "upsample"}, nook_upsampling}},
        {{"half", nook::half_view(shade().view()).width}}, is_known);
    return family;
}

}  // namespace stability
