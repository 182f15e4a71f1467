#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include <nook/surface/alchemy_ao.hpp>

#include "../support/checked.hpp"
#include "stability.hpp"
#include "surface_scenes.hpp"

namespace stability {

namespace {

using namespace surface;
using nook::AlchemyFalloff;

/// ε, σ and β as the paper of 2011 has them, for a radius of 1.
constexpr double epsilon = 1e-4, intensity = 0.5, beta = 1e-4;

nook::AlchemyOptions options_of(const Scene& scene, AlchemyFalloff falloff)
{
    return {.radius = scene.radius,
            .intensity = intensity * scene.radius,
            .epsilon = epsilon * scene.radius * scene.radius,
            .falloff = falloff};
}

/// As shaders have it: reconstruct both positions, subtract them, take powers of the radius; in T, from
/// the samples that nook takes.
template <class T>
Image<double> textbook(const Scene& scene, AlchemyFalloff falloff, double bias)
{
    const auto source = scene.depth_source();
    const nook::NormalSource normals = scene.normal_source();
    const nook::AlchemyOptions options = options_of(scene, falloff);
    const nook::detail::AlchemyReference places{source, normals, options, scene.projection};
    struct Point {
        T x, y, z;
    };
    const auto position = [&](int x, int y) {
        const T z = static_cast<T>(scene.depth(x, y));
        const auto number = [](double value) { return static_cast<T>(value); };
        return Point{
            (number(x + 0.5) - number(scene.projection.cx)) / number(scene.projection.fx) * z,
            (number(scene.projection.cy) - number(y + 0.5)) / number(scene.projection.fy) * z, -z};
    };
    const T radius = static_cast<T>(scene.radius), square_radius = radius * radius;
    const T muted = static_cast<T>(epsilon) * square_radius;
    const T strength = static_cast<T>(intensity) * radius;
    Image<double> result{columns, rows, 1};
    for (int y = 0; y < rows; ++y) {
        const auto spiral = places.spiral(y);
        double slopes[nook::WorkMap::group];
        for (int x = 0; x < columns; ++x) {
            if (x % nook::WorkMap::group == 0) places.read_slopes(x, y, slopes);
            const double slope = slopes[x % nook::WorkMap::group];
            if (!(slope > 0)) continue;
            const Point c = position(x, y);
            const T nx = static_cast<T>(scene.normals(3 * x, y)),
                    ny = static_cast<T>(scene.normals(3 * x + 1, y)),
                    nz = static_cast<T>(scene.normals(3 * x + 2, y));
            T sum = 0;
            for (int i = 0; i < options.samples; ++i) {
                const auto to = places.offset(x, y, slope, spiral.x[i], spiral.y[i]);
                const int to_x = x + to.right, to_y = y + to.down;
                if (to_x < 0 || to_x >= columns || to_y < 0 || to_y >= rows) continue;
                const Point q = position(to_x, to_y);
                const T vx = q.x - c.x, vy = q.y - c.y, vz = q.z - c.z;
                const T square = vx * vx + vy * vy + vz * vz;
                const T above = vx * nx + vy * ny + vz * nz + c.z * static_cast<T>(bias);
                const T term = (above > 0 ? above : T{0}) / (square + muted);
                if (falloff == AlchemyFalloff::alchemy) {
                    sum += term;
                    continue;
                }
                const T left = square_radius - square;
                if (left > 0) sum += left * left * left * term;
            }
            const T samples = static_cast<T>(options.samples);
            const T open = falloff == AlchemyFalloff::alchemy
                               ? 1 - 2 * strength / samples * sum
                               : 1 - 5 * strength /
                                         (samples * square_radius * square_radius * square_radius) *
                                         sum;
            // NaN stays, unlike in most shaders.
            result(x, y) = static_cast<double>(open < 0 ? T{0} : open);
        }
    }
    return result;
}

Image<double> nook_alchemy(const Scene& scene, AlchemyFalloff falloff, bool biased)
{
    nook::AlchemyOptions options = options_of(scene, falloff);
    if (!biased) options.bias = 0;
    Image<float> visibility{columns, rows};
    support::checked(nook::alchemy_ao(scene.depth_source(), scene.normal_source(),
                                      visibility.view(), options, scene.projection),
                     "alchemy_ao");
    Image<double> result{columns, rows};
    std::copy(visibility.begin(), visibility.end(), result.begin());
    return result;
}

struct Algorithm {
    Label label;
    AlchemyFalloff falloff;
    std::function<Image<double>(const Scene&, AlchemyFalloff, bool biased)> run;
};
std::vector<Algorithm> all_algorithms()
{
    const auto in_float = [](const Scene& scene, AlchemyFalloff falloff, bool biased) {
        return textbook<float>(scene, falloff, biased ? beta : 0);
    };
    const auto in_double = [](const Scene& scene, AlchemyFalloff falloff, bool biased) {
        return textbook<double>(scene, falloff, biased ? beta : 0);
    };
    return {
        {{"alchemy-float", "2011: positions and their difference in float, beta = 1e-4"},
         AlchemyFalloff::alchemy,
         in_float},
        {{"alchemy-double", "the same in double"}, AlchemyFalloff::alchemy, in_double},
        {{"alchemy-nook", "alchemy_ao in float, its own bias"},
         AlchemyFalloff::alchemy,
         nook_alchemy},
        {{"scalable-float", "2012: with r^6 in float"}, AlchemyFalloff::scalable, in_float},
        {{"scalable-double", "the same in double"}, AlchemyFalloff::scalable, in_double},
        {{"scalable-nook", "alchemy_ao with that falloff"}, AlchemyFalloff::scalable, nook_alchemy},
    };
}

}  // namespace

Family surface_obscurance()
{
    Family family;
    family.label = {
        "surface-obscurance",
        "obscurance from depth and normals, beside the same formula and samples in long "
        "double"};
    family.metrics = metrics_of_bias();
    const std::vector<Algorithm> algorithms = all_algorithms();
    for (const Algorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const Case& subject : all_cases()) {
        family.cases.push_back(subject.label);
        const Scene scene = subject.make();
        for (const Algorithm& algorithm : algorithms) {
            const Image<double> truth = subject.is_flat
                                            ? Image<double>{columns, rows, 1}
                                            : textbook<long double>(scene, algorithm.falloff, 0);
            const auto visibility = [&](bool biased) {
                return algorithm.run(scene, algorithm.falloff, biased);
            };
            Row row = row_of_bias(subject, scene, algorithm.label, visibility(false),
                                  visibility(true), truth);
            row.parameters["samples"] = nook::AlchemyOptions{}.samples;
            family.rows.push_back(std::move(row));
        }
    }
    return family;
}

}  // namespace stability
