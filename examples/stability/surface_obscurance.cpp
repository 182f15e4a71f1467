#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/alchemy_ao.hpp>

#include "../support/checked.hpp"
#include "random.hpp"
#include "stability.hpp"

namespace stability {

namespace {

using nook::AlchemyFalloff;
using nook::Image;

constexpr int columns = 64, rows = 48;
/// Of the disc of samples where the picture is as far as `Scene::distance`.
constexpr double pixels = 12;

/// What a kernel is given.
struct Scene {
    nook::Projection projection;
    double radius;
    Image<float> depth{columns, rows};
    Image<float> normals{3 * columns, rows};
    /// How far apart the depths lie that the buffer can hold.
    nook::DepthStep step{.linear = std::numeric_limits<float>::epsilon()};

    [[nodiscard]] auto depth_source() const
    {
        return nook::DepthSource{depth.view(), nook::IdentityDecode{}, step};
    }
    [[nodiscard]] nook::NormalSource normal_source() const
    {
        return nook::ImageView3<const float>::interleaved(normals.data(), columns, rows,
                                                          std::ptrdiff_t{3} * columns);
    }
};

/// A camera under whose view `radius` at `distance` covers `pixels`; `aside` is how far the middle of
/// the picture lies off the view axis, as a slope.
nook::Projection view_of(double radius, double distance, double aside)
{
    const double focal = pixels * distance / radius;
    return {.fx = focal, .fy = focal, .cx = columns / 2.0 - aside * focal, .cy = rows / 2.0};
}

/// Distances as a function of the position on the screen, with normals from the function itself.
template <class F>
Scene draw_surface(double radius, const nook::Projection& projection, const F& distance)
{
    Scene scene{projection, radius};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const auto point = [&](double u, double v) {
                // Relative to the pixel, so that the differences below are exact enough.
                const double here = distance(x + 0.5, y + 0.5), there = distance(u, v);
                const double sx = (u - projection.cx) / projection.fx;
                const double sy = (projection.cy - v) / projection.fy;
                const double dx = (u - x - 0.5) / projection.fx;
                const double dy = (y + 0.5 - v) / projection.fy;
                return nook::ViewPoint{dx * here + sx * (there - here),
                                       dy * here + sy * (there - here), here - there};
            };
            const auto a = point(x + 0.51, y + 0.5), b = point(x + 0.49, y + 0.5);
            const auto c = point(x + 0.5, y + 0.49), d = point(x + 0.5, y + 0.51);
            const double ax = a.x - b.x, ay = a.y - b.y, az = a.z - b.z;
            const double bx = c.x - d.x, by = c.y - d.y, bz = c.z - d.z;
            const double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
            const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
            scene.depth(x, y) = static_cast<float>(distance(x + 0.5, y + 0.5));
            scene.normals(3 * x, y) = static_cast<float>(nx / length);
            scene.normals(3 * x + 1, y) = static_cast<float>(ny / length);
            scene.normals(3 * x + 2, y) = static_cast<float>(nz / length);
        }
    return scene;
}

/// Waves of a third of the radius.
Scene relief(double radius, double distance, double aside = 0)
{
    return draw_surface(radius, view_of(radius, distance, aside), [=](double x, double y) {
        return distance + radius / 3 * std::sin(x * 0.35) * std::cos(y * 0.3);
    });
}
/// A plane whose normal leans by `degrees` from the view axis.
Scene flat(double degrees, double radius, double distance)
{
    const nook::Projection projection = view_of(radius, distance, 0);
    const double slope = std::tan(degrees * 3.14159265358979323846 / 180);
    return draw_surface(radius, projection, [=](double x, double y) {
        const double across = (x - projection.cx) * 0.8 + (y - projection.cy) * 0.6;
        return distance / (1 + slope * across / projection.fx);
    });
}
/// The same through 16 bits of a standard projection from 1 to 1000.
Scene flat_in_16_bits()
{
    Scene scene = flat(60, 1, 10);
    nook::Projection planes = scene.projection;
    planes.encoding = nook::DepthEncoding::standard;
    planes.near_plane = 1;
    planes.far_plane = 1000;
    const nook::HardwareDecode<nook::D16Storage> decode{planes};
    for (float& distance : scene.depth)
        distance = decode(nook::encode_depth<nook::D16Storage>(double{distance}, planes));
    scene.step = nook::depth_step<nook::D16Storage>(planes);
    return scene;
}
Scene silhouette()
{
    Scene scene = relief(0.1, 1);
    for (int y = 0; y < rows; ++y)
        for (int x = columns / 2; x < columns; ++x) scene.depth(x, y) = 1e6f;
    return scene;
}

struct Case {
    Label label;
    bool is_flat;
    std::function<Scene()> make;
};
std::vector<Case> all_cases()
{
    return {
        {{"relief", "waves of radius / 3 at 10 radii"}, false, [] { return relief(0.1, 1); }},
        {{"depth-1e3", "the same at depth 1e3, radius 1"}, false, [] { return relief(1, 1e3); }},
        {{"depth-1e5", "at depth 1e5, radius 1, where an ulp is 0.008"},
         false,
         [] { return relief(1, 1e5); }},
        {{"aside-1e5", "the same, 45 degrees off the view axis: the tile of a large picture"},
         false,
         [] { return relief(1, 1e5, 1); }},
        {{"radius-1e7", "waves, radius 1e7"}, false, [] { return relief(1e7, 1e8); }},
        {{"radius-1e-7", "waves, radius 1e-7"}, false, [] { return relief(1e-7, 1e-6); }},
        {{"radius-1e-9", "waves, radius 1e-9"}, false, [] { return relief(1e-9, 1e-8); }},
        {{"silhouette", "waves at depth 1 beside depth 1e6"}, false, silhouette},
        {{"flat-0", "flat ground that faces the viewer"}, true, [] { return flat(0, 1, 10); }},
        {{"flat-85", "flat ground, tilted by 85 degrees"}, true, [] { return flat(85, 1, 10); }},
        {{"flat-89.9", "tilted by 89.9 degrees"}, true, [] { return flat(89.9, 0.01, 100); }},
        {{"flat-1e5", "tilted by 60 degrees, at depth 1e5 with radius 1"},
         true,
         [] { return flat(60, 1, 1e5); }},
        {{"flat-d16", "at depth 10 with radius 1, through 16 bits from 1 to 1000"},
         true,
         flat_in_16_bits},
    };
}

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

/// NaN when some are.
double largest_difference(const Image<double>& a, const Image<double>& b)
{
    double worst = 0;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const double difference = std::fabs(a(x, y) - b(x, y));
            if (std::isnan(difference)) return difference;
            worst = std::max(worst, difference);
        }
    return worst;
}

}  // namespace

Family surface_obscurance()
{
    Family family;
    family.label = {
        "surface-obscurance",
        "obscurance from depth and normals, beside the same formula and samples in long "
        "double"};
    family.metrics = {
        {"error", "largest error of visibility without bias, of the same float inputs"},
        {"biased", "largest error of visibility with bias"},
        {"darkening", "largest darkening of flat ground without bias"},
        {"biased-darkening", "largest darkening of flat ground with bias"}};
    const std::vector<Algorithm> algorithms = all_algorithms();
    for (const Algorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const Case& subject : all_cases()) {
        family.cases.push_back(subject.label);
        const Scene scene = subject.make();
        for (const Algorithm& algorithm : algorithms) {
            const Image<double> truth = subject.is_flat
                                            ? Image<double>{columns, rows, 1}
                                            : textbook<long double>(scene, algorithm.falloff, 0);
            Row row{subject.label.name,
                    algorithm.label.name,
                    {{"radius", scene.radius}, {"samples", nook::AlchemyOptions{}.samples}},
                    {{}, {}, {}, {}}};
            for (const bool biased : {false, true})
                row.values[(subject.is_flat ? 2u : 0u) + (biased ? 1u : 0u)] =
                    largest_difference(algorithm.run(scene, algorithm.falloff, biased), truth);
            family.rows.push_back(std::move(row));
        }
    }
    return family;
}

}  // namespace stability
