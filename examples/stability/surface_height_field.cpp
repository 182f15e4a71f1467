#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <nook/scene/directions.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/surface/height_field_ao.hpp>

#include "../support/checked.hpp"
#include "stability.hpp"
#include "surface_scenes.hpp"

namespace stability {

namespace {

using namespace surface;

/// As shaders march: cosine-weighted rays in even steps, hidden where the depth of the pixel that a step
/// falls on is nearer. Positions and depths in T.
template <class T>
Image<double> marched(const Scene& scene, const Image<T>& depth)
{
    using Vector = glm::vec<3, T>;
    constexpr int ray_count = 16, steps = 16;
    const nook::TracedOptions<> options{.directions = ray_count};
    const auto number = [](double value) { return static_cast<T>(value); };
    const T fx = number(scene.projection.fx), fy = number(scene.projection.fy);
    const T cx = number(scene.projection.cx), cy = number(scene.projection.cy);
    const T bias = number(0.01 * scene.radius);
    Image<double> result{columns, rows, 1};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const T z = depth(x, y);
            const Vector pixel{(number(x + 0.5) - cx) / fx * z, (cy - number(y + 0.5)) / fy * z,
                               -z};
            const float* const n = &scene.normals(3 * x, y);
            float directions[3 * ray_count];
            nook::traced_directions(
                options, glm::dvec3{double{n[0]}, double{n[1]}, double{n[2]}},
                nook::hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)),
                directions);
            int open = 0;
            for (int ray = 0; ray < ray_count; ++ray) {
                const float* const d = directions + 3 * ray;
                const Vector direction{T{d[0]}, T{d[1]}, T{d[2]}};
                bool hidden = false;
                for (int step = 1; step <= steps && !hidden; ++step) {
                    const Vector at =
                        pixel + direction * (number(scene.radius) * T(step) / T(steps));
                    const T column = std::floor(cx + fx * at.x / -at.z);
                    const T row = std::floor(cy - fy * at.y / -at.z);
                    if (!(column >= 0 && column < columns && row >= 0 && row < rows)) break;
                    hidden = depth(static_cast<int>(column), static_cast<int>(row)) + bias < -at.z;
                }
                open += hidden ? 0 : 1;
            }
            result(x, y) = double(open) / ray_count;
        }
    return result;
}

template <class T>
Image<double> nook_field(const Scene& scene,
                         const nook::DepthSource<T, nook::IdentityDecode>& depth)
{
    Image<double> result{columns, rows};
    support::checked(
        nook::height_field_ao(depth, scene.normal_source(), result.view(),
                              {.radius = scene.radius, .slices = 16}, scene.projection),
        "height_field_ao");
    return result;
}

struct Algorithm {
    Label label;
    /// From the depths as they are stored, and from those of the surface itself in double.
    std::function<Image<double>(const Scene&)> run, exact;
};

}  // namespace

Family surface_height_field()
{
    Family family;
    family.label = {"surface-height-field",
                    "visibility of the depth buffer as a height field; truth is what the same "
                    "algorithm makes of the depths before they were stored, in double"};
    family.metrics = {{"error", "largest error of visibility"},
                      {"mean", "mean error of visibility"},
                      {"darkening", "largest darkening of flat ground"},
                      {"nan", "pixels with a NaN"}};
    const auto marched_exactly = [](const Scene& scene) {
        return marched<double>(scene, scene.true_depth);
    };
    const Algorithm algorithms[] = {
        {{"marched-float", "16 rays of 16 even steps, positions in float, bias 1 % of the radius"},
         [](const Scene& scene) { return marched<float>(scene, scene.depth); },
         marched_exactly},
        {{"marched-double", "the same in double"},
         [](const Scene& scene) {
             Image<double> depth{columns, rows};
             std::copy(scene.depth.begin(), scene.depth.end(), depth.begin());
             return marched<double>(scene, depth);
         },
         marched_exactly},
        {{"nook", "height_field_ao with 16 slices"},
         [](const Scene& scene) { return nook_field(scene, scene.depth_source()); },
         [](const Scene& scene) {
             return nook_field(scene, nook::DepthSource{scene.true_depth.view(),
                                                        nook::IdentityDecode{}, nook::DepthStep{}});
         }},
    };
    for (const Algorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const Case& subject : all_cases()) {
        family.cases.push_back(subject.label);
        const Scene scene = subject.make();
        for (const Algorithm& algorithm : algorithms) {
            const Image<double> found = algorithm.run(scene);
            const Image<double> truth =
                subject.is_flat ? Image<double>{columns, rows, 1} : algorithm.exact(scene);
            const Worst worst = errors(scene, found, truth);
            Row row{subject.label.name, algorithm.label.name, {{"radius", scene.radius}}, {}};
            if (subject.is_flat) row.values = {{}, {}, worst.value(), worst.nans()};
            else row.values = {worst.value(), mean_error(found, truth), {}, worst.nans()};
            set_worst(row, subject.is_flat ? 2 : 0, worst, 3);
            family.rows.push_back(std::move(row));
        }
    }
    return family;
}

}  // namespace stability
