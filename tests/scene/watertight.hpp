#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/scene/bvh.hpp>

/// Rays at the vertices and edges of closed meshes, from inside. Needs no test framework, so that the
/// same check runs under other flags.
namespace watertight {

struct ClosedMesh {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;

    [[nodiscard]] nook::MeshView view() const
    {
        return {.positions = positions.data(),
                .vertex_count = positions.size() / 3,
                .indices = indices.data(),
                .triangle_count = indices.size() / 3};
    }
    [[nodiscard]] glm::dvec3 position(std::uint32_t vertex) const
    {
        const float* const p = positions.data() + std::size_t{3} * vertex;
        return {double{p[0]}, double{p[1]}, double{p[2]}};
    }
};

/// SplitMix64.
inline std::uint64_t next_bits(std::uint64_t& state)
{
    std::uint64_t z = state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}
/// In [0, 1).
inline double next_unit(std::uint64_t& state)
{
    return static_cast<double>(next_bits(state) >> 11) * 0x1p-53;
}

/// A rock: rings of vertices whose distance from the centre lies between (1 − roughness) and 1 times
/// `scale`, closed by two poles. Neighbours share their vertices.
inline ClosedMesh rock(int rings, double roughness, double scale, const glm::dvec3& centre,
                       std::uint64_t seed)
{
    constexpr double pi = 3.14159265358979323846;
    ClosedMesh mesh;
    const auto add = [&](double polar, double azimuth) {
        const double radius = scale * (1 - roughness * next_unit(seed));
        mesh.positions.push_back(
            static_cast<float>(centre.x + radius * std::sin(polar) * std::cos(azimuth)));
        mesh.positions.push_back(
            static_cast<float>(centre.y + radius * std::sin(polar) * std::sin(azimuth)));
        mesh.positions.push_back(static_cast<float>(centre.z + radius * std::cos(polar)));
    };
    const int around = 2 * rings;
    add(0, 0);
    for (int ring = 1; ring < rings; ++ring)
        for (int i = 0; i < around; ++i) add(pi * ring / rings, 2 * pi * i / around);
    add(pi, 0);
    const auto vertex = [&](int ring, int i) {
        if (ring == 0) return 0u;
        if (ring == rings) return static_cast<std::uint32_t>(mesh.positions.size() / 3 - 1);
        return static_cast<std::uint32_t>(1 + (ring - 1) * around + i % around);
    };
    for (int ring = 0; ring < rings; ++ring)
        for (int i = 0; i < around; ++i) {
            const std::uint32_t a = vertex(ring, i), b = vertex(ring + 1, i),
                                c = vertex(ring + 1, i + 1), d = vertex(ring, i + 1);
            if (ring + 1 < rings) mesh.indices.insert(mesh.indices.end(), {a, b, c});
            if (ring > 0) mesh.indices.insert(mesh.indices.end(), {a, c, d});
        }
    return mesh;
}

/// Rays that leave a closed mesh, of about `rays` from points inside it: through vertices, along the
/// edges, and a little beside both.
inline long leaks(const ClosedMesh& mesh, const nook::Bvh& bvh, const glm::dvec3& centre,
                  double inside, long rays, std::uint64_t seed)
{
    long misses = 0;
    const auto triangles = static_cast<std::uint64_t>(mesh.indices.size() / 3);
    for (long i = 0; i < rays; ++i) {
        const std::size_t t = 3 * static_cast<std::size_t>(next_bits(seed) % triangles);
        const glm::dvec3 a = mesh.position(mesh.indices[t]), b = mesh.position(mesh.indices[t + 1]);
        // A part of the edge in few bits often gives directions exactly along it.
        double part = 0;
        if (i % 4 == 1) part = next_unit(seed);
        if (i % 4 == 2) part = static_cast<double>(next_bits(seed) % 17) / 16;
        glm::dvec3 from = centre;
        if (i % 8 != 0)
            from = {centre.x + inside * (2 * next_unit(seed) - 1),
                    centre.y + inside * (2 * next_unit(seed) - 1),
                    centre.z + inside * (2 * next_unit(seed) - 1)};
        glm::dvec3 to{a.x + part * (b.x - a.x), a.y + part * (b.y - a.y), a.z + part * (b.z - a.z)};
        if (i % 16 == 3) to.x += 1e-9 * inside;
        const nook::Ray ray{from, {to.x - from.x, to.y - from.y, to.z - from.z}};
        if (!bvh.occluded(ray)) ++misses;
        if (i % 16 == 5 && !bvh.closest(ray)) ++misses;
    }
    return misses;
}

/// Leaks of rocks of several shapes, sizes and places; −1 where one could not be built.
inline long leaks(long rays)
{
    struct Case {
        int rings;
        double roughness, scale;
        glm::dvec3 centre;
    };
    const std::array<Case, 8> cases{{{24, 0.3, 1, {0, 0, 0}},
                                     {96, 0.1, 1, {0, 0, 0}},
                                     {3, 0, 1, {0, 0, 0}},
                                     {40, 0.02, 1e-6, {0, 0, 0}},
                                     {40, 0.4, 1e6, {0, 0, 0}},
                                     {40, 0.3, 100, {1e6, -1e6, 1e6}},
                                     {32, 0.3, 1e30, {0, 0, 0}},
                                     {64, 0.2, 1e-20, {0, 0, 0}}}};
    long misses = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const auto& [rings, roughness, scale, centre] = cases[i];
        const ClosedMesh mesh = rock(rings, roughness, scale, centre, i + 1);
        nook::Bvh bvh;
        if (!bvh.build(mesh.view())) return -1;
        misses +=
            leaks(mesh, bvh, centre, 0.2 * scale, rays / static_cast<long>(cases.size()), 7 * i);
    }
    return misses;
}

}  // namespace watertight
