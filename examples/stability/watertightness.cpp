#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include <nook/scene/bvh.hpp>

#include "../support/checked.hpp"
#include "random.hpp"
#include "stability.hpp"
#include "textbook_rays.hpp"
#include "worst.hpp"

namespace stability {

namespace {

using textbook::Mesh;

constexpr int ray_count = 100000;

/// A ball of 20 · 4³ triangles about zero, of radius 1, vertices shared.
struct Ball {
    std::vector<glm::dvec3> vertices;
    std::vector<std::uint32_t> indices;
};
Ball ball()
{
    const double g = (1 + std::sqrt(5.0)) / 2;
    Ball result{{{-1, g, 0},
                 {1, g, 0},
                 {-1, -g, 0},
                 {1, -g, 0},
                 {0, -1, g},
                 {0, 1, g},
                 {0, -1, -g},
                 {0, 1, -g},
                 {g, 0, -1},
                 {g, 0, 1},
                 {-g, 0, -1},
                 {-g, 0, 1}},
                {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                 4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                 6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1}};
    for (int level = 0; level < 3; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, is_new] =
                middles.try_emplace(std::minmax(a, b), std::uint32_t(result.vertices.size()));
            if (is_new) result.vertices.push_back(result.vertices[a] + result.vertices[b]);
            return at->second;
        };
        std::vector<std::uint32_t> finer;
        for (std::size_t i = 0; i < result.indices.size(); i += 3) {
            const std::uint32_t a = result.indices[i], b = result.indices[i + 1],
                                c = result.indices[i + 2];
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
        }
        result.indices = finer;
        for (glm::dvec3& vertex : result.vertices) vertex /= glm::length(vertex);
    }
    return result;
}

struct BallCase {
    Label label;
    double radius, offset;
};

/// A ray from inside, and the faces that it can hit: those that share a vertex with what it is aimed
/// at. The ball is convex.
struct AimedRay {
    glm::vec3 origin, target;
    std::vector<std::uint32_t> faces;
};

std::vector<AimedRay> aimed_rays(const Mesh& mesh, const BallCase& subject)
{
    std::vector<std::vector<std::uint32_t>> around(mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.indices.size(); ++i)
        around[mesh.indices[i]].push_back(static_cast<std::uint32_t>(i / 3));
    Random random;
    std::vector<AimedRay> rays;
    for (int i = 0; i < ray_count; ++i) {
        const auto face = static_cast<std::size_t>(random.below(static_cast<int>(mesh.faces())));
        const auto side = static_cast<std::size_t>(random.below(3));
        const std::uint32_t a = mesh.indices[3 * face + side];
        const std::uint32_t b = mesh.indices[3 * face + (side + 1) % 3];
        // Every other ray at a vertex, and half of these along an axis; the rest at edges.
        const double at = i % 2 == 0 ? 0 : random.unit();
        AimedRay ray{};
        ray.target =
            glm::vec3{glm::dvec3{mesh.vertices[a]} * (1 - at) + glm::dvec3{mesh.vertices[b]} * at};
        ray.faces = around[a];
        if (at > 0) ray.faces.insert(ray.faces.end(), around[b].begin(), around[b].end());
        if (i % 4 == 0) {
            // Along the axis that is nearest to it.
            int k = 0;
            const auto away = [&](int axis) {
                return std::fabs(double{ray.target[axis]} - subject.offset);
            };
            for (const int axis : {1, 2})
                if (away(axis) > away(k)) k = axis;
            ray.origin = ray.target;
            ray.origin[k] = static_cast<float>(subject.offset);
        } else {
            glm::dvec3 inside{};
            do
                for (int k = 0; k < 3; ++k) inside[k] = 2 * random.unit() - 1;
            while (glm::dot(inside, inside) > 1);
            ray.origin = glm::vec3{inside * (subject.radius / 2) + subject.offset};
        }
        rays.push_back(ray);
    }
    return rays;
}

template <class T>
textbook::Ray<T> ray_of(const AimedRay& aimed)
{
    const textbook::Vector<T> origin{aimed.origin}, target{aimed.target};
    return {origin, glm::normalize(target - origin)};
}

/// Where a textbook test hits any of the faces; NaN if it says so of one and hits none.
template <class T, class Test>
double hit(const Mesh& mesh, const AimedRay& aimed, const Test& test)
{
    const textbook::Ray<T> ray = ray_of<T>(aimed);
    using Vector = textbook::Vector<T>;
    T result = textbook::miss<T>;
    for (const std::uint32_t face : aimed.faces) {
        const T t = test(ray, Vector{mesh.corner(face, 0)}, Vector{mesh.corner(face, 1)},
                         Vector{mesh.corner(face, 2)});
        if (t < textbook::miss<T>) return double{t};
        if (std::isnan(t)) result = t;
    }
    return double{result};
}

/// The parameter of a hit, infinite for a miss.
using FindHit = std::function<double(const Mesh&, const nook::Bvh&, const AimedRay&)>;
struct HitAlgorithm {
    Label label;
    FindHit find;
};

template <class T>
HitAlgorithm moeller_trumbore(const char* name, const char* what, T epsilon)
{
    return {{name, what}, [epsilon](const Mesh& mesh, const nook::Bvh&, const AimedRay& aimed) {
                return hit<T>(mesh, aimed, [epsilon](const auto&... arguments) {
                    return textbook::moeller_trumbore<T>(arguments..., epsilon);
                });
            }};
}

std::vector<HitAlgorithm> hit_algorithms()
{
    return {
        moeller_trumbore("mt-textbook", "Moeller & Trumbore 1997, float; determinants < 1e-6 miss",
                         1e-6f),
        moeller_trumbore("mt-float", "the same without the epsilon", 0.0f),
        moeller_trumbore("mt-double", "the same in double", 0.0),
        {{"woop-float", "Woop et al. 2013, float; double where an edge function is zero"},
         [](const Mesh& mesh, const nook::Bvh&, const AimedRay& aimed) {
             return hit<float>(mesh, aimed, textbook::sheared);
         }},
        {{"nook", "Bvh::closest and Bvh::occluded, both"},
         [](const Mesh&, const nook::Bvh& bvh, const AimedRay& aimed) {
             const textbook::Ray<double> ray = ray_of<double>(aimed);
             const nook::Ray query{.origin = ray.origin, .direction = ray.direction};
             return bvh.occluded(query) ? bvh.closest(query).t : textbook::miss<double>;
         }},
    };
}

}  // namespace

Family watertightness()
{
    Family family;
    family.label = {"rays-watertight",
                    "rays from inside a ball of 1280 triangles at its vertices and edges; the ball "
                    "is closed, so that none may get out"};
    family.metrics = {{"misses", "rays that hit nothing, of 1e5"},
                      {"nan", "rays with a NaN for a hit, of 1e5"}};
    const BallCase cases[] = {
        {{"scale-1e-6", "radius 1e-6 about zero"}, 1e-6, 0},
        {{"scale-1", "radius 1 about zero"}, 1, 0},
        {{"scale-1e6", "radius 1e6 about zero"}, 1e6, 0},
        {{"offset-1e6", "radius 1000 about (1e6, 1e6, 1e6), where an ulp is 0.06"}, 1e3, 1e6},
    };
    const std::vector<HitAlgorithm> algorithms = hit_algorithms();
    for (const HitAlgorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    const Ball unit = ball();
    for (const BallCase& subject : cases) {
        family.cases.push_back(subject.label);
        Mesh mesh{{}, unit.indices};
        for (const glm::dvec3& vertex : unit.vertices)
            mesh.vertices.emplace_back(vertex * subject.radius + subject.offset);
        nook::Bvh bvh;
        support::checked(bvh.build(mesh.view()), "the ball");
        const std::vector<AimedRay> rays = aimed_rays(mesh, subject);
        for (const HitAlgorithm& algorithm : algorithms) {
            Worst worst;
            int misses = 0;
            for (const AimedRay& ray : rays) {
                const double t = algorithm.find(mesh, bvh, ray);
                if (t < textbook::miss<double>) continue;
                ++misses;
                worst.add(t, [&] {
                    const glm::vec3 &from = ray.origin, &to = ray.target;
                    return joined("ray from (", from.x, ", ", from.y, ", ", from.z, ") to (", to.x,
                                  ", ", to.y, ", ", to.z, "): t ", t);
                });
            }
            Row row{subject.label.name,
                    algorithm.label.name,
                    {{"rays", rays.size()}},
                    {misses * (1e5 / ray_count), worst.nans() * (1e5 / ray_count)}};
            set_worst(row, 0, worst, 1);
            family.rows.push_back(std::move(row));
        }
    }
    return family;
}

}  // namespace stability
