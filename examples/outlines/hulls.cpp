#include "hulls.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <map>
#include <numeric>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/scene/convex_hull.hpp>
#include <nook/scene/traced_ao.hpp>

#include "../support/checked.hpp"

namespace outlines {

namespace {

using support::checked;

/// Triangles that hang together over vertices at equal positions: the triangles of each object.
std::vector<std::vector<std::uint32_t>> objects_of(const scenes::Scene& scene)
{
    std::map<std::array<float, 3>, std::uint32_t> places;
    std::vector<std::uint32_t> parent;
    const auto place = [&](std::uint32_t vertex) {
        const float* const at = scene.positions.data() + std::size_t{3} * vertex;
        const auto [found, added] =
            places.try_emplace({at[0], at[1], at[2]}, static_cast<std::uint32_t>(parent.size()));
        if (added) parent.push_back(found->second);
        return found->second;
    };
    const auto root = [&](std::uint32_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    std::vector<std::uint32_t> corners(scene.indices.size());
    for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = place(scene.indices[i]);
    for (std::size_t i = 0; i < corners.size(); i += 3)
        for (std::size_t k = 1; k < 3; ++k) parent[root(corners[i + k])] = root(corners[i]);
    std::map<std::uint32_t, std::vector<std::uint32_t>> triangles;
    for (std::size_t t = 0; t < scene.triangles(); ++t)
        triangles[root(corners[3 * t])].push_back(static_cast<std::uint32_t>(t));
    std::vector<std::vector<std::uint32_t>> result;
    for (auto& [first, list] : triangles) result.push_back(std::move(list));
    return result;
}

void add_hull(const std::vector<float>& points, scenes::Scene& hulls)
{
    nook::ConvexHull hull;
    checked(hull.build(points.data(), points.size() / 3), "ConvexHull::build");
    const nook::MeshView mesh = hull.mesh();
    const auto first = static_cast<std::uint32_t>(hulls.positions.size() / 3);
    hulls.positions.insert(hulls.positions.end(), mesh.positions,
                           mesh.positions + 3 * mesh.vertex_count);
    for (std::size_t i = 0; i < 3 * mesh.triangle_count; ++i)
        hulls.indices.push_back(first + mesh.indices[i]);
}

/// What an object hides of itself, at the corners of each of its triangles.
void bake_object(const std::vector<std::uint32_t>& triangles, double radius,
                 nook::ThreadExecutor& threads, Baked& baked)
{
    std::vector<float> points, normals;
    std::vector<std::uint32_t> indices(3 * triangles.size());
    std::iota(indices.begin(), indices.end(), std::uint32_t{0});
    for (const std::uint32_t t : triangles) {
        const float* const at = baked.positions.data() + std::size_t{9} * t;
        points.insert(points.end(), at, at + 9);
        const glm::dvec3 a{at[0], at[1], at[2]}, b{at[3], at[4], at[5]}, c{at[6], at[7], at[8]};
        const glm::dvec3 ab = b - a, ac = c - a;
        const glm::dvec3 n{ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z,
                           ab.x * ac.y - ab.y * ac.x};
        for (int corner = 0; corner < 3; ++corner)
            for (const double part : {n.x, n.y, n.z}) normals.push_back(static_cast<float>(part));
    }
    nook::Bvh bvh;
    checked(bvh.build({points.data(), points.size() / 3, indices.data(), triangles.size()}),
            "Bvh::build");
    std::vector<float> values(points.size() / 3);
    checked(
        nook::traced_ao(bvh, nook::ShadingPoints{points.data(), normals.data(), values.size()},
                        nook::ImageView<float>{values.data(), static_cast<int>(values.size()), 1},
                        nook::TracedOptions<>{.radius = radius, .directions = 64},
                        nook::HeapScratch{}, threads),
        "traced_ao");
    for (std::size_t i = 0; i < triangles.size(); ++i)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                    baked.values.begin() + static_cast<std::ptrdiff_t>(3) * triangles[i]);
}

}  // namespace

void add_hulls(const Subject& subject, const Protocol& protocol,
               const std::filesystem::path& folder, nook::ThreadExecutor& threads,
               nlohmann::ordered_json& tables)
{
    if (subject.room || subject.scene.triangles() == 0) return;
    const scenes::Scene& scene = subject.scene;
    Baked baked;
    baked.positions.resize(3 * scene.indices.size());
    baked.indices.resize(scene.indices.size());
    std::iota(baked.indices.begin(), baked.indices.end(), std::uint32_t{0});
    baked.values.assign(scene.indices.size(), 1.0f);
    for (std::size_t i = 0; i < scene.indices.size(); ++i)
        std::copy_n(scene.positions.begin() + std::ptrdiff_t{3} * scene.indices[i], 3,
                    baked.positions.begin() + static_cast<std::ptrdiff_t>(3 * i));

    scenes::Scene hulls;
    for (const std::vector<std::uint32_t>& triangles : objects_of(scene)) {
        std::vector<float> points;
        for (const std::uint32_t t : triangles)
            points.insert(points.end(), baked.positions.begin() + std::ptrdiff_t{9} * t,
                          baked.positions.begin() + std::ptrdiff_t{9} * t + 9);
        add_hull(points, hulls);
        bake_object(triangles, subject.radius, threads, baked);
    }
    nook::OutlineShell shell;
    checked(shell.build(hulls.mesh()), "OutlineShell::build");
    const double extent = (std::min)(shell.needed_extent(subject.radius), 4 * subject.radius);
    const Table table = measure(subject, "hulls-baked", shell, extent, protocol, folder,
                                scene.name + "-hulls-baked", threads, &baked);
    print(table);
    tables.push_back(json_of(table));
}

}  // namespace outlines
