#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include <nook/scene/polygon_saliency.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using List = std::vector<std::uint32_t>;

nook::PolygonNeighbours neighbours_of(const Mesh& mesh, double weld = 0)
{
    nook::PolygonNeighbours neighbours;
    REQUIRE_FALSE(neighbours.build(mesh.view(), {.weld = weld}));
    return neighbours;
}

List list(const nook::PolygonNeighbours& neighbours, std::size_t o)
{
    return {neighbours[o].begin(), neighbours[o].end()};
}

/// The lists from their definition, by places of equal coordinates.
std::vector<List> slow_neighbours(const Mesh& mesh)
{
    using Edge = std::set<std::vector<float>>;
    const auto place = [&](std::uint32_t vertex) {
        std::vector<float> p;
        for (std::size_t k = 0; k < 3; ++k) p.push_back(mesh.positions[3 * vertex + k] + 0.0f);
        return p;
    };
    std::map<Edge, std::set<std::uint32_t>> around;
    const std::size_t count = mesh.indices.size() / 3;
    for (std::uint32_t t = 0; t < count; ++t) {
        if (!nook::is_usable_triangle(mesh.view(), t)) continue;
        for (std::size_t i = 0; i < 3; ++i)
            around[{place(mesh.indices[3 * t + i]), place(mesh.indices[3 * t + (i + 1) % 3])}]
                .insert(t);
    }
    std::vector<std::set<std::uint32_t>> sets(count);
    for (const auto& [edge, polygons] : around)
        for (const std::uint32_t a : polygons)
            for (const std::uint32_t b : polygons)
                if (a != b) sets[a].insert(b);
    std::vector<List> lists;
    for (const auto& set : sets) lists.emplace_back(set.begin(), set.end());
    return lists;
}

nook::ViewpointChannel channel_of(const std::vector<double>& areas, std::size_t views)
{
    nook::ViewpointChannel channel;
    REQUIRE_FALSE(channel.build(areas.data(), views, areas.size() / views));
    return channel;
}

/// Visible areas of a convex body: each triangle's projected area from each direction.
nook::ViewpointChannel convex_channel(const Mesh& mesh, const std::vector<glm::dvec3>& directions)
{
    std::vector<double> areas;
    for (const glm::dvec3& d : directions)
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
            const auto [a, b, c] = nook::detail::mesh_triangle(mesh.view(), t);
            nook::detail::Vector3 n = cross(b - a, c - a);
            if (dot(n, a) < 0) n = -n;
            areas.push_back((std::max)(dot(n, nook::detail::vector(d)), 0.0));
        }
    return channel_of(areas, directions.size());
}

std::vector<double> saliency_of(const nook::ViewpointChannel& channel,
                                const nook::PolygonNeighbours& neighbours)
{
    std::vector<double> saliency(channel.polygon_count(), -1);
    REQUIRE(nook::polygon_saliency(channel, neighbours, saliency.data()));
    return saliency;
}

/// Jensen's difference of entropies, from the definition.
double slow_dissimilarity(const nook::ViewpointChannel& channel, std::size_t a, std::size_t b)
{
    const double p_a = channel.p_polygon(a), p_b = channel.p_polygon(b), p = p_a + p_b;
    const auto term = [](double x) { return x > 0 ? x * std::log2(x) : 0; };
    double sum = 0;
    for (std::size_t v = 0; v < channel.view_count(); ++v) {
        const double in_a = channel.p_view_given_polygon(v, a);
        const double in_b = channel.p_view_given_polygon(v, b);
        sum += p_a / p * term(in_a) + p_b / p * term(in_b);
        sum -= term(p_a / p * in_a + p_b / p * in_b);
    }
    return sum;
}

/// Areas of a channel where about half the pairs see each other.
std::vector<double> random_areas(std::mt19937& random, std::size_t views, std::size_t polygons)
{
    std::uniform_real_distribution<double> unit{-1, 1};
    std::vector<double> areas(views * polygons);
    for (double& a : areas) a = (std::max)(unit(random), 0.0);
    return areas;
}

double information(const nook::ViewpointChannel& channel)
{
    double sum = 0;
    for (std::size_t o = 0; o < channel.polygon_count(); ++o)
        channel.for_each_view(o, [&](std::size_t v, double, double q) {
            sum += q * std::log2(q / (channel.p_view(v) * channel.p_polygon(o)));
        });
    return sum;
}

Mesh unit_box()
{
    Mesh mesh;
    mesh.box({-1, -1, -1}, {1, 1, 1});
    return mesh;
}

Mesh split(const Mesh& mesh)
{
    Mesh result;
    for (const std::uint32_t i : mesh.indices) {
        const glm::dvec3 p = meshes::vertex_position(mesh, i);
        result.indices.push_back(result.vertex({p.x, p.y, p.z}));
    }
    return result;
}

}  // namespace

TEST_CASE("triangles that share an edge are neighbours, whatever their winding")
{
    Mesh mesh;
    for (const meshes::Point& p : {meshes::Point{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}})
        mesh.vertex(p);
    mesh.vertex({2, 2, 1});
    mesh.face(0, 1, 2);
    mesh.face(1, 2, 3);
    mesh.face(4, 3, 0);  // touches the others at corners
    mesh.face(2, 1, 4);  // a third at the edge of the first two
    const auto neighbours = neighbours_of(mesh);
    CHECK(neighbours.polygon_count() == 4);
    CHECK(neighbours.size() == 6);
    CHECK(list(neighbours, 0) == List{1, 3});
    CHECK(list(neighbours, 1) == List{0, 3});
    CHECK(list(neighbours, 2) == List{});
    CHECK(list(neighbours, 3) == List{0, 1});
}

TEST_CASE("on a closed surface every triangle has three neighbours, and they know it")
{
    for (const Mesh& mesh : {unit_box(), meshes::icosphere(2)}) {
        const auto neighbours = neighbours_of(mesh);
        CHECK(neighbours.size() == mesh.indices.size());
        for (std::uint32_t o = 0; o < neighbours.polygon_count(); ++o) {
            CHECK(neighbours[o].count == 3);
            for (const std::uint32_t other : neighbours[o]) {
                const List back = list(neighbours, other);
                CHECK(std::find(back.begin(), back.end(), o) != back.end());
            }
        }
    }
}

TEST_CASE("neighbours are those of the definition, with all that meshes get wrong")
{
    std::mt19937 random{3};
    std::uniform_int_distribution<int> grid{0, 2};
    for (int round = 0; round < 20; ++round) {
        Mesh mesh;
        const float nan = std::numeric_limits<float>::quiet_NaN();
        for (int i = 0; i < 20; ++i)
            mesh.vertex({double(grid(random)), double(grid(random)), -0.0 * grid(random)});
        mesh.positions[5] = nan;
        std::uniform_int_distribution<std::uint32_t> vertex{0, 19};
        for (int i = 0; i < 40; ++i) mesh.face(vertex(random), vertex(random), vertex(random));
        const auto neighbours = neighbours_of(mesh);
        const auto expected = slow_neighbours(mesh);
        std::size_t most = 0;
        for (std::size_t o = 0; o < expected.size(); ++o)
            most = (std::max)(most, expected[o].size());
        REQUIRE(neighbours.polygon_count() == 40);
        for (std::size_t o = 0; o < 40; ++o) CHECK(list(neighbours, o) == expected[o]);
        CHECK(most >= 4);
    }
}

TEST_CASE("vertices at one place are one unless only indices count")
{
    const Mesh mesh = meshes::icosphere(1), apart = split(mesh);
    const auto expected = neighbours_of(mesh), welded = neighbours_of(apart);
    for (std::size_t o = 0; o < 80; ++o) CHECK(list(welded, o) == list(expected, o));
    CHECK(neighbours_of(apart, -1).size() == 0);
    CHECK(neighbours_of(mesh, -1).size() == 240);
    // Moved apart by a little.
    Mesh shaken = apart;
    std::mt19937 random{1};
    std::uniform_real_distribution<float> little{-1e-4f, 1e-4f};
    for (float& c : shaken.positions) c += little(random);
    CHECK(neighbours_of(shaken).size() == 0);
    const auto near_enough = neighbours_of(shaken, 1e-3);
    for (std::size_t o = 0; o < 80; ++o) CHECK(list(near_enough, o) == list(expected, o));
    // Everything becomes one place, and no edge is left.
    CHECK(neighbours_of(mesh, 10).size() == 0);
}

TEST_CASE("a book of many pages keeps its lists short")
{
    Mesh mesh;
    const auto a = mesh.vertex({0, 0, 0}), b = mesh.vertex({0, 0, 1});
    std::uint32_t pages = 0;
    const auto add_page = [&] {
        const double angle = 0.05 * ++pages;
        mesh.face(a, b, mesh.vertex({std::cos(angle), std::sin(angle), 0}));
    };
    while (pages < nook::PolygonNeighbours::most_around) add_page();
    CHECK(neighbours_of(mesh)[5].count == pages - 1);
    while (pages < 100) add_page();
    const auto neighbours = neighbours_of(mesh);
    CHECK(list(neighbours, 0) == List{1, 99});
    CHECK(list(neighbours, 50) == List{49, 51});
    CHECK(list(neighbours, 99) == List{0, 98});
}

TEST_CASE("neighbours of nothing are none, and a bad mesh changes nothing")
{
    nook::PolygonNeighbours neighbours;
    CHECK(neighbours.polygon_count() == 0);
    CHECK(neighbours.size() == 0);
    CHECK_FALSE(neighbours.build({}));
    CHECK(neighbours.polygon_count() == 0);
    const Mesh box = unit_box();
    REQUIRE_FALSE(neighbours.build(box.view()));
    Mesh bad = box;
    bad.indices[4] = 99;
    CHECK(neighbours.build(bad.view()).code == nook::ErrorCode::index_out_of_range);
    const double infinity = std::numeric_limits<double>::infinity();
    CHECK(neighbours.build(box.view(), {.weld = infinity}).code == nook::ErrorCode::bad_value);
    nook::Memory none{[](std::size_t, void*) -> void* { return nullptr; }};
    CHECK(neighbours.build(box.view(), {.memory = none}).code == nook::ErrorCode::out_of_memory);
    CHECK(neighbours.polygon_count() == 12);
    const nook::PolygonNeighbours moved = std::move(neighbours);
    CHECK(moved.size() == 36);
}

TEST_CASE("the dissimilarity of three polygons and two views is what it is by hand")
{
    const std::vector<double> areas{2, 1, 1, 0, 2, 2};
    const auto channel = channel_of(areas, 2);
    CHECK(std::fabs(nook::dissimilarity(channel, 0, 1) - 0.41997309402197) < 1e-13);
    CHECK(nook::dissimilarity(channel, 0, 1) == nook::dissimilarity(channel, 1, 0));
    CHECK(nook::dissimilarity(channel, 1, 2) == 0);
    CHECK(nook::dissimilarity(channel, 0, 0) == 0);
    // Made one polygon, they take (1/4 + 3/8) of it out of the channel.
    const auto merged = channel_of({3, 1, 2, 2}, 2);
    const double lost = information(channel) - information(merged);
    CHECK(std::fabs(lost - 0.262483183764) < 1e-11);
    CHECK(std::fabs(lost - 0.625 * nook::dissimilarity(channel, 0, 1)) < 1e-14);
}

TEST_CASE("dissimilarity lies between 0 and 1 bit and follows its definition")
{
    std::mt19937 random{7};
    auto channel = channel_of(random_areas(random, 30, 20), 30);
    REQUIRE_FALSE(channel.set_probability(nook::ViewProbability::uniform));
    for (std::size_t a = 0; a < 20; ++a)
        for (std::size_t b = 0; b < 20; ++b) {
            const double d = nook::dissimilarity(channel, a, b);
            CHECK(d >= 0);
            CHECK(d <= 1);
            CHECK(std::fabs(d - slow_dissimilarity(channel, a, b)) < 1e-13);
        }
    // Seen alike, to whatever extent: no rounding is left.
    std::vector<double> areas = random_areas(random, 30, 20);
    for (std::size_t i = 0; i < areas.size(); i += 20)
        for (std::size_t o = 1; o < 20; ++o) areas[i + o] = areas[i] * (0.1 + double(o) / 7);
    const auto alike = channel_of(areas, 30);
    for (std::size_t o = 1; o < 20; ++o) CHECK(nook::dissimilarity(alike, 0, o) == 0);
    // Never seen together and equally probable: a whole bit. Never seen: nothing to compare.
    const auto apart = channel_of({1, 0, 0, 0, 1, 0}, 2);
    CHECK(nook::dissimilarity(apart, 0, 1) == 1);
    CHECK(nook::dissimilarity(apart, 0, 2) == 0);
}

TEST_CASE("the faces of bodies that look the same from everywhere are equally salient")
{
    const Mesh mesh = meshes::icosphere(0);
    std::vector<glm::dvec3> directions;
    for (std::size_t i = 0; i < 12; ++i) directions.push_back(meshes::vertex_position(mesh, i));
    const auto channel = convex_channel(mesh, directions);
    const std::vector<double> saliency = saliency_of(channel, neighbours_of(mesh));
    for (const double s : saliency) {
        CHECK(s > 0.01);
        CHECK(std::fabs(s - saliency[0]) < 1e-6);  // the vertices are floats
    }
    // By symmetry each view shows as much.
    std::vector<double> shown(12, -1);
    REQUIRE(nook::viewpoint_saliency(channel, saliency.data(), shown.data()));
    for (const double s : shown) CHECK(std::fabs(s - shown[0]) < 1e-5);
}

TEST_CASE("on a cube a triangle is as salient as two of its three neighbours lie around the edge")
{
    const Mesh mesh = unit_box();
    const std::vector<glm::dvec3> axes{{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                       {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    // Each view shows one side: a neighbour on another side has nothing in common, the other half of
    // the side has everything.
    for (const double s : saliency_of(convex_channel(mesh, axes), neighbours_of(mesh)))
        CHECK(s == 2.0 / 3);
}

TEST_CASE("polygons that are not seen have no saliency and count for nobody")
{
    // A strip of four triangles; the second is not seen.
    Mesh mesh;
    for (int i = 0; i < 6; ++i) mesh.vertex({double(i / 2), double(i % 2), 0});
    for (std::uint32_t i = 0; i < 4; ++i) mesh.face(i, i + 1, i + 2);
    const auto channel = channel_of({1, 0, 1, 0, 0, 0, 1, 1}, 2);
    const std::vector<double> saliency = saliency_of(channel, neighbours_of(mesh));
    CHECK(saliency[0] == 0);
    CHECK(saliency[1] == 0);
    CHECK(saliency[2] == nook::dissimilarity(channel, 2, 3));
    CHECK(saliency[3] == saliency[2]);
    CHECK(saliency[2] > 0.2);
}

TEST_CASE("viewpoint saliency hands out the saliency of what is seen")
{
    std::mt19937 random{11};
    const auto channel = channel_of(random_areas(random, 17, 900), 17);
    std::vector<double> saliency(900), shown(17, -1), expected(17, 0);
    std::uniform_real_distribution<double> unit;
    for (double& s : saliency) s = unit(random);
    REQUIRE(nook::viewpoint_saliency(channel, saliency.data(), shown.data()));
    double sum = 0, whole = 0;
    for (std::size_t o = 0; o < 900; ++o) {
        for (std::size_t v = 0; v < 17; ++v)
            expected[v] += saliency[o] * channel.p_view_given_polygon(v, o);
        whole += saliency[o];
    }
    for (std::size_t v = 0; v < 17; ++v) {
        CHECK(std::fabs(shown[v] - expected[v]) < 1e-12 * expected[v]);
        sum += shown[v];
    }
    CHECK(std::fabs(sum - whole) < 1e-12 * whole);
    // Up to the end of the range.
    for (double& s : saliency) s *= 3e305;
    REQUIRE(nook::viewpoint_saliency(channel, saliency.data(), shown.data()));
    for (std::size_t v = 0; v < 17; ++v)
        CHECK(std::fabs(shown[v] / 3e305 - expected[v]) < 1e-12 * expected[v]);
}

TEST_CASE("saliency does not depend on threads or on what scratch held")
{
    const Mesh mesh = meshes::icosphere(3);
    std::mt19937 random{5};
    const auto channel = channel_of(random_areas(random, 9, 1280), 9);
    const auto neighbours = neighbours_of(mesh);
    std::vector<double> first, first_shown;
    for (const int threads : {1, 2, 5}) {
        nook::ThreadExecutor executor{threads};
        std::vector<double> saliency(1280), shown(9);
        std::vector<unsigned char> memory(
            (std::max)(nook::polygon_saliency_scratch_size(channel, threads),
                       nook::viewpoint_saliency_scratch_size(channel, threads)) +
                1,
            0xff);
        const nook::Scratch scratch{memory.data() + 1, memory.size() - 1};
        REQUIRE(nook::polygon_saliency(channel, neighbours, saliency.data(), scratch, executor));
        REQUIRE(
            nook::viewpoint_saliency(channel, saliency.data(), shown.data(), scratch, executor));
        if (threads == 1) {
            first = saliency;
            first_shown = shown;
            // What the kernel computes is what the function of two polygons says.
            for (const std::size_t o : {0u, 700u, 1279u}) {
                double sum = 0;
                for (const std::uint32_t other : neighbours[o])
                    sum += slow_dissimilarity(channel, o, other);
                CHECK(std::fabs(saliency[o] - sum / 3) < 1e-13);
            }
        }
        CHECK(saliency == first);
        CHECK(shown == first_shown);
    }
}

TEST_CASE("bad arguments of saliency are named and nothing is written")
{
    const Mesh mesh = unit_box();
    std::mt19937 random{2};
    const auto channel = channel_of(random_areas(random, 3, 12), 3);
    const auto neighbours = neighbours_of(mesh);
    std::vector<double> out(12, -7), saliency(12, 0.5);
    const auto fails = [&](const nook::Outcome& outcome, nook::ErrorCode code, const char* name) {
        CHECK(outcome.error.code == code);
        CHECK(std::string_view{outcome.error.argument} == name);
        for (const double value : out) CHECK(value == -7);
    };
    using enum nook::ErrorCode;
    fails(nook::polygon_saliency(channel, {}, out.data()), bad_size, "neighbours");
    fails(nook::polygon_saliency(channel, neighbours, nullptr), null_data, "saliency");
    fails(nook::polygon_saliency(channel, neighbours, out.data(), nook::Scratch{}),
          scratch_too_small, "scratch");
    fails(nook::viewpoint_saliency(channel, nullptr, out.data()), null_data, "saliency");
    fails(nook::viewpoint_saliency(channel, saliency.data(), nullptr), null_data, "result");
    fails(nook::viewpoint_saliency(channel, saliency.data(), out.data(), nook::Scratch{}),
          scratch_too_small, "scratch");
    for (const double bad : {-0.1, std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity()}) {
        saliency[11] = bad;
        fails(nook::viewpoint_saliency(channel, saliency.data(), out.data()), bad_value,
              "saliency");
    }
    // Nothing at all is fine.
    const nook::ViewpointChannel nothing;
    CHECK(nook::polygon_saliency(nothing, {}, nullptr));
    CHECK(nook::viewpoint_saliency(nothing, nullptr, nullptr));
}
