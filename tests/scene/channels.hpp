#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <random>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/scene/channel_measures.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scene/viewpoints.hpp>

#include "meshes.hpp"

/// Viewpoint channels for the tests of this folder.
namespace channels {

using Directions = std::vector<glm::dvec3>;
using Values = std::vector<double>;

/// areas[v * polygons + o].
struct Areas {
    std::size_t views = 0, polygons = 0;
    Values values{};

    Areas(std::size_t view_count, std::size_t polygon_count)
        : views{view_count},
          polygons{polygon_count},
          values(view_count * polygon_count)
    {}
    Areas(std::size_t view_count, std::size_t polygon_count, Values areas)
        : views{view_count},
          polygons{polygon_count},
          values{std::move(areas)}
    {}
    [[nodiscard]] double& at(std::size_t v, std::size_t o) { return values[v * polygons + o]; }
    [[nodiscard]] double at(std::size_t v, std::size_t o) const { return values[v * polygons + o]; }

    [[nodiscard]] nook::ViewpointChannel channel() const
    {
        nook::ViewpointChannel result;
        REQUIRE(!result.build(values.data(), views, polygons));
        return result;
    }
};

/// A flat part of a convex body.
struct Facet {
    glm::dvec3 normal;
    double area;
};

inline double dot(const glm::dvec3& a, const glm::dvec3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline glm::dvec3 unit(const glm::dvec3& v) { return v / std::sqrt(dot(v, v)); }

/// All vectors with coordinates −1, 0 and 1 of which `count` are not 0, normalised: the 6 face axes, 12
/// edge directions and 8 corners of the cube.
inline Directions signs(int count)
{
    Directions result;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if (x * x + y * y + z * z == count) result.push_back(unit({x, y, z}));
    return result;
}
inline Directions both(Directions first, const Directions& second)
{
    first.insert(first.end(), second.begin(), second.end());
    return first;
}
inline Directions icosphere(int level)
{
    Directions result(nook::icosphere_size(level));
    nook::icosphere(level, result.data());
    return result;
}
/// The corners of the tetrahedron (sign 1), or the normals of its faces (−1): face i is opposite corner i.
inline Directions tetrahedron_axes(double sign)
{
    Directions result;
    for (const glm::dvec3& v : {glm::dvec3{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}})
        result.push_back(unit(v * sign));
    return result;
}

inline std::vector<Facet> cube_facets()
{
    std::vector<Facet> result;
    for (const glm::dvec3& axis : signs(1)) result.push_back({axis, 4});
    return result;
}
inline std::vector<Facet> tetrahedron_facets()
{
    std::vector<Facet> result;
    for (const glm::dvec3& normal : tetrahedron_axes(-1))
        result.push_back({normal, 2 * std::sqrt(3.0)});
    return result;
}

/// The cube from −1 to 1, anticlockwise from outside.
inline meshes::Mesh cube(double half = 1)
{
    meshes::Mesh mesh;
    mesh.box({-half, -half, -half}, {half, half, half});
    return mesh;
}
/// The tetrahedron in that cube.
inline meshes::Mesh tetrahedron()
{
    meshes::Mesh mesh;
    const std::uint32_t a = mesh.vertex({1, 1, 1}), b = mesh.vertex({1, -1, -1}),
                        c = mesh.vertex({-1, 1, -1}), d = mesh.vertex({-1, -1, 1});
    mesh.face(b, d, c);
    mesh.face(a, c, d);
    mesh.face(a, d, b);
    mesh.face(a, b, c);
    return mesh;
}

/// What each direction sees of the facets of a convex body, from far away.
inline Areas open_areas(const std::vector<Facet>& facets, const Directions& views)
{
    Areas areas{views.size(), facets.size()};
    for (std::size_t v = 0; v < views.size(); ++v)
        for (std::size_t o = 0; o < facets.size(); ++o) {
            const double cosine = dot(facets[o].normal, views[v]);
            // A facet seen edge on, up to rounding.
            areas.at(v, o) = cosine > 1e-15 ? cosine * facets[o].area : 0;
        }
    return areas;
}

/// Random areas of which about `share` are not 0.
inline Areas random_areas(std::mt19937& random, std::size_t views, std::size_t polygons,
                          double share = 0.5)
{
    std::uniform_real_distribution<double> number{0, 1};
    Areas areas{views, polygons};
    for (double& a : areas.values) a = number(random) < share ? number(random) : 0;
    return areas;
}

inline std::vector<nook::Camera> cameras(const meshes::Mesh& mesh, const Directions& views,
                                         const nook::ViewpointOptions& options = {})
{
    std::vector<nook::Camera> result;
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh.view());
    for (const glm::dvec3& view : views)
        result.push_back(nook::viewpoint_camera(sphere, view, options));
    return result;
}
inline nook::ViewpointChannel channel(const meshes::Mesh& mesh,
                                      const std::vector<nook::Camera>& views,
                                      const nook::ChannelOptions& options = {})
{
    nook::ViewpointChannel result;
    REQUIRE(result.build(mesh.view(), views.data(), views.size(), options));
    return result;
}

inline Values pmi(const nook::ViewpointChannel& channel)
{
    Values result(channel.polygon_count());
    REQUIRE(nook::polygon_mutual_information(channel, result.data()));
    return result;
}
inline Values vmi(const nook::ViewpointChannel& channel)
{
    Values result(channel.view_count());
    REQUIRE(nook::viewpoint_mutual_information(channel, result.data()));
    return result;
}
inline nook::ChannelEntropies entropies(const nook::ViewpointChannel& channel)
{
    nook::ChannelEntropies result{};
    REQUIRE(nook::channel_entropies(channel, result));
    return result;
}

inline double largest_difference(const Values& a, const Values& b)
{
    REQUIRE(a.size() == b.size());
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::fmax(largest, std::fabs(a[i] - b[i]));
    return largest;
}

}  // namespace channels
