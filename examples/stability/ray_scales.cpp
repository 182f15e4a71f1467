#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/traced_ao.hpp>

#include "../support/checked.hpp"
#include "stability.hpp"
#include "textbook_rays.hpp"
#include "worst.hpp"

namespace stability {

namespace {

using textbook::Mesh;

/// Points along each side of the floor, and directions of each.
constexpr int points = 16, direction_count = 256;

struct Place {
    Label label;
    double scale, offset;
};

/// The corner of a box with edges of 8, points on its floor, and a fence of height 1 among them. All
/// vertices are whole, all points multiples of 1/4: floats hold both around 10⁶ too.
struct Corner {
    Mesh mesh;
    std::vector<glm::vec3> positions, normals;
    double radius;
};
Corner corner(const Place& place)
{
    const auto at = [&](double x, double y, double z) {
        return glm::vec3{glm::dvec3{x, y, z} * place.scale + place.offset};
    };
    Corner result{{}, {}, {}, 4 * place.scale};
    for (int k = 0; k < 3; ++k) {
        const auto vertex = [&](double u, double v) {
            return k == 0 ? at(0, u, v) : k == 1 ? at(u, 0, v) : at(u, v, 0);
        };
        result.mesh.add_triangle(vertex(0, 0), vertex(8, 0), vertex(8, 8));
        result.mesh.add_triangle(vertex(0, 0), vertex(8, 8), vertex(0, 8));
    }
    result.mesh.add_triangle(at(6, 0, 0), at(6, 1, 0), at(6, 1, 8));
    result.mesh.add_triangle(at(6, 0, 0), at(6, 1, 8), at(6, 0, 8));
    for (int j = 0; j < points; ++j)
        for (int i = 0; i < points; ++i) {
            result.positions.push_back(at(i / 2. + 0.25, 0, j / 2. + 0.25));
            result.normals.emplace_back(0, 1, 0);
        }
    return result;
}

using Visibility = std::function<std::vector<double>(const Corner&)>;
struct VisibilityAlgorithm {
    Label label;
    Visibility visibility;
};

Visibility textbook_visibility(textbook::Offset offset)
{
    return [offset](const Corner& scene) {
        const nook::TracedOptions<> options{.directions = direction_count};
        std::vector<double> result;
        for (std::size_t i = 0; i < scene.positions.size(); ++i) {
            float directions[3 * direction_count];
            nook::traced_directions(options, glm::dvec3{scene.normals[i]},
                                    static_cast<std::uint32_t>(i), directions);
            const glm::vec3 start = offset(scene.positions[i], scene.normals[i]);
            int open = 0;
            for (int n = 0; n < direction_count; ++n) {
                const float* const d = directions + std::ptrdiff_t{3} * n;
                open += textbook::nearest({start, {d[0], d[1], d[2]}}, scene.mesh) >
                        static_cast<float>(scene.radius);
            }
            result.push_back(double(open) / direction_count);
        }
        return result;
    };
}

std::vector<double> nook_visibility(const Corner& scene)
{
    nook::Bvh bvh;
    support::checked(bvh.build(scene.mesh.view()), "the corner");
    nook::Image<double> visibility{static_cast<int>(scene.positions.size()), 1};
    support::checked(
        nook::traced_ao(bvh,
                        nook::ShadingPoints{&scene.positions.front().x, &scene.normals.front().x,
                                            scene.positions.size()},
                        visibility.view(), {.radius = scene.radius, .directions = direction_count}),
        "the corner");
    return {visibility.begin(), visibility.end()};
}

}  // namespace

Family ray_scales()
{
    Family family;
    family.label = {
        "rays-scale",
        "points on the floor of the corner of a box, 8 wide with a fence of height 1, radius 4; "
        "truth is the visibility at home, neither scaled nor moved, by the same algorithm"};
    family.metrics = {{"largest", "largest change of the visibility of a point"},
                      {"mean", "change of the mean over all points"},
                      {"nan", "points with a NaN"}};
    const VisibilityAlgorithm algorithms[] = {
        {{"fixed-1e-4", "float rays (Woop et al. 2013) from 1e-4 along the normal"},
         textbook_visibility(textbook::epsilon_offset)},
        {{"waechter-binder", "the same from up to 256 ulps off (Waechter & Binder 2019)"},
         textbook_visibility(textbook::ulps_offset)},
        {{"nook", "traced_ao of the same points"}, nook_visibility},
    };
    const Place places[] = {
        {{"scale-2^-20", "scaled by 2^-20"}, 0x1p-20, 0},
        {{"scale-2^20", "scaled by 2^20"}, 0x1p20, 0},
        {{"scale-1e-6", "scaled by 1e-6"}, 1e-6, 0},
        {{"scale-1e6", "scaled by 1e6"}, 1e6, 0},
        {{"offset-1e3", "moved by (1e3, 1e3, 1e3)"}, 1, 1e3},
        {{"offset-1e6", "moved by (1e6, 1e6, 1e6)"}, 1, 1e6},
    };
    const Corner home = corner({{}, 1, 0});
    for (const VisibilityAlgorithm& algorithm : algorithms)
        family.algorithms.push_back(algorithm.label);
    for (const Place& place : places) {
        family.cases.push_back(place.label);
        const Corner there = corner(place);
        for (const VisibilityAlgorithm& algorithm : algorithms) {
            const std::vector<double> truth = algorithm.visibility(home),
                                      found = algorithm.visibility(there);
            Worst worst;
            double sum = 0;
            for (std::size_t i = 0; i < truth.size(); ++i) {
                worst.add(std::fabs(found[i] - truth[i]), [&] {
                    const glm::vec3& at = there.positions[i];
                    return joined("point (", at.x, ", ", at.y, ", ", at.z, "): ", found[i], " for ",
                                  truth[i]);
                });
                sum += found[i] - truth[i];
            }
            Row row{
                place.label.name,
                algorithm.label.name,
                {{"points", truth.size()}, {"directions", direction_count}},
                {worst.value(), std::fabs(sum) / static_cast<double>(truth.size()), worst.nans()}};
            set_worst(row, 0, worst, 2);
            family.rows.push_back(std::move(row));
        }
    }
    return family;
}

}  // namespace stability
