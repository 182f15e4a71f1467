#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nook/scene/outline.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using meshes::Point;
using nook::OutlineMethod;
using nook::OutlineOptions;
using nook::OutlineShell;
using nook::OutlineView;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = 3.14159265358979323846;
constexpr OutlineMethod methods[] = {OutlineMethod::scaling, OutlineMethod::vertex_normals,
                                     OutlineMethod::integrated_normals, OutlineMethod::mitre};

OutlineShell built(const Mesh& mesh, const OutlineOptions& options = {})
{
    OutlineShell shell;
    REQUIRE(shell.build(mesh.view(), options));
    return shell;
}

/// Each directed edge is cancelled by its opposite.
bool closed(const OutlineView& view)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (std::size_t i = 0; i < 3 * view.triangle_count; ++i) {
        const std::uint32_t a = view.indices[i], b = view.indices[i % 3 == 2 ? i - 2 : i + 1];
        if (a == b) return false;
        edges[{(std::min)(a, b), (std::max)(a, b)}] += a < b ? 1 : -1;
    }
    return std::all_of(edges.begin(), edges.end(),
                       [](const auto& edge) { return edge.second == 0; });
}

bool finite(const OutlineView& view)
{
    for (std::size_t i = 0; i < 3 * view.vertex_count; ++i)
        if (!nook::detail::is_finite(view.base[i]) || !nook::detail::is_finite(view.direction[i]))
            return false;
    for (std::size_t i = 0; i < 3 * view.triangle_count; ++i)
        if (view.indices[i] >= view.vertex_count) return false;
    return true;
}

double longest(const OutlineView& view)
{
    double most = 0;
    for (std::size_t i = 0; i < view.vertex_count; ++i) {
        const float* d = view.direction + 3 * i;
        most = (std::max)(most, std::hypot(double{d[0]}, double{d[1]}, double{d[2]}));
    }
    return most;
}

/// How often the shell at an extent goes around a point: the sum of the signed solid angles (Van
/// Oosterom & Strackee 1983), an oracle that knows nothing of topology.
double winding(const OutlineShell& shell, double extent, const Point& at)
{
    const OutlineView view = shell.view();
    std::vector<float> positions(3 * view.vertex_count);
    REQUIRE(shell.extrude(extent, positions.data()));
    double sum = 0;
    for (std::size_t t = 0; t < view.triangle_count; ++t) {
        double v[3][3], length[3];
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t k = 0; k < 3; ++k)
                v[i][k] = positions[3 * view.indices[3 * t + i] + k] - at[k];
            length[i] = std::hypot(v[i][0], v[i][1], v[i][2]);
        }
        const auto dot = [&](int a, int b) {
            return v[a][0] * v[b][0] + v[a][1] * v[b][1] + v[a][2] * v[b][2];
        };
        const double volume = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
                              v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
                              v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
        sum += 2 * std::atan2(volume, length[0] * length[1] * length[2] + dot(0, 1) * length[2] +
                                          dot(1, 2) * length[0] + dot(2, 0) * length[1]);
    }
    return sum / (4 * pi);
}

/// Vertices by base, each with its direction: the same for shells that differ in numbering alone.
std::map<std::vector<float>, std::vector<float>> by_place(const OutlineView& view)
{
    std::map<std::vector<float>, std::vector<float>> result;
    for (std::size_t i = 0; i < view.vertex_count; ++i)
        result[{view.base + 3 * i, view.base + 3 * i + 3}] = {view.direction + 3 * i,
                                                              view.direction + 3 * i + 3};
    return result;
}

/// The cube [-1, 1]³: faces of two triangles, of two along the other diagonal, or of four.
Mesh cube(int cut, bool welded)
{
    Mesh mesh;
    const Point corners[8] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                              {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
    constexpr std::uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    if (welded)
        for (const Point& p : corners) mesh.vertex(p);
    for (const auto& face : faces) {
        std::uint32_t v[4];
        for (std::size_t i = 0; i < 4; ++i) v[i] = welded ? face[i] : mesh.vertex(corners[face[i]]);
        if (cut == 4) {
            Point middle{};
            for (const std::uint32_t corner : face)
                for (std::size_t k = 0; k < 3; ++k) middle[k] += corners[corner][k] / 4;
            const std::uint32_t m = mesh.vertex(middle);
            for (std::size_t i = 0; i < 4; ++i) mesh.face(v[i], v[(i + 1) % 4], m);
        } else {
            const std::size_t i = cut == 2 ? 0 : 1;
            mesh.face(v[i], v[i + 1], v[i + 2]);
            mesh.face(v[i], v[i + 2], v[(i + 3) % 4]);
        }
    }
    return mesh;
}

void turn_all(Mesh& mesh)
{
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
}

void check_sound(const OutlineShell& shell, double limit = 4)
{
    CHECK(finite(shell.view()));
    CHECK(closed(shell.view()));
    CHECK(longest(shell.view()) <= limit * (1 + 1e-6));
    std::size_t triangles = 0;
    for (std::size_t i = 0; i < shell.object_count(); ++i) {
        CHECK(shell.object(i).first_triangle == triangles);
        triangles += shell.object(i).triangle_count;
    }
    CHECK(triangles == shell.view().triangle_count);
}

}  // namespace

TEST_CASE("a cube corner moves its faces by e, e/3 or e/sqrt 3, however the cube is cut and split")
{
    for (const int cut : {2, 3, 4})
        for (const bool welded : {false, true}) {
            CAPTURE(cut);
            CAPTURE(welded);
            const Mesh mesh = cube(cut, welded);
            const struct {
                OutlineMethod method;
                double offset;
            } rows[] = {{OutlineMethod::scaling, 1 / std::sqrt(3.0)},
                        {OutlineMethod::vertex_normals, 1 / std::sqrt(3.0)},
                        {OutlineMethod::integrated_normals, 1 / 3.0},
                        {OutlineMethod::mitre, 1}};
            for (const auto& row : rows) {
                const OutlineMethod method = row.method;
                const double offset = row.offset;
                CAPTURE(static_cast<int>(method));
                const OutlineShell shell = built(mesh, {.method = method});
                check_sound(shell);
                CHECK(shell.object_count() == 1);
                CHECK_FALSE(shell.object(0).open);
                CHECK_FALSE(shell.object(0).inward);
                CHECK(shell.view().vertex_count == (cut == 4 ? 14 : 8));
                CHECK(shell.view().triangle_count == mesh.view().triangle_count);
                for (const auto& [base, direction] : by_place(shell.view()))
                    if (base[0] * base[1] * base[2] != 0)
                        for (std::size_t k = 0; k < 3; ++k) {
                            const double expected = base[k] * offset;
                            CHECK(std::fabs(direction[k] - expected) <= 1e-7 * offset);
                        }
                if (method == OutlineMethod::mitre) {
                    CHECK(shell.face_offset() == 1);
                    CHECK(shell.needed_extent(0.25) == 0.25);
                }
                CHECK(std::fabs(shell.face_offset() - offset) <= 1e-7);
                CHECK(std::fabs(shell.needed_extent(2) - 2 / offset) <= 1e-6);
            }
        }
}

TEST_CASE("the extruded cube is the larger cube")
{
    const OutlineShell shell = built(cube(2, false));
    std::vector<float> positions(3 * shell.view().vertex_count);
    REQUIRE(shell.extrude(0.5, positions.data()));
    for (const float p : positions) CHECK(std::fabs(p) == 1.5f);
    CHECK(winding(shell, 0.5, {1.25, 1.25, 1.25}) == doctest::Approx(1));
    CHECK(std::fabs(winding(shell, 0.5, {1.75, 0, 0})) < 1e-5);
}

TEST_CASE("welding joins what lies within the distance and nothing else")
{
    std::mt19937 random{3};
    std::uniform_real_distribution<float> noise{-0.004f, 0.004f};
    Mesh mesh = cube(2, false);
    for (float& p : mesh.positions) p += noise(random);
    CHECK(built(mesh).object_count() == 6);
    const OutlineShell shell = built(mesh, {.weld = 0.02, .normal_tolerance = 0.05});
    CHECK(shell.object_count() == 1);
    CHECK(shell.view().vertex_count == 8);
    check_sound(shell);
    CHECK(shell.face_offset() > 0.999);
    // Across the borders of the cells, whichever they are.
    for (int i = 0; i < 200; ++i) {
        const float at = static_cast<float>(i) * 0.013f - 1.3f, weld = 0.1f;
        Mesh two;
        two.triangle({at, 0, 0}, {at + 5, 0, 0}, {at, 5, 0});
        two.triangle({at + 0.09, 0.02, 0}, {at + 0.09, 5.02, 0}, {at - 5, 0, 0});
        const OutlineShell joined = built(two, {.weld = weld});
        CHECK(joined.object_count() == 1);
        two.positions[0] -= 0.02f;
        CHECK(built(two, {.weld = weld}).object_count() == 2);
    }
    Mesh zero;
    zero.triangle({0.0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    zero.triangle({-0.0, -0.0, 0}, {0, 1, -0.0}, {-1, 0, 0});
    CHECK(built(zero).object_count() == 1);
    CHECK(built(zero, {.weld = 0.1}).object_count() == 1);
    CHECK(built(zero, {.weld = 0.1}).view().vertex_count == built(zero).view().vertex_count);
    Mesh same = cube(2, true);
    CHECK(built(same, {.weld = 1e-300}).view().vertex_count == 8);
    // Everything in one place: no triangle is left.
    CHECK(built(same, {.weld = 10}).view().triangle_count == 0);
    CHECK(built(same, {.weld = 10}).dropped() == 12);
}

TEST_CASE("a sphere grows by the extent in every direction")
{
    const Mesh mesh = meshes::icosphere(3, 2, {5, -1, 3});
    for (const auto method : methods) {
        CAPTURE(static_cast<int>(method));
        const OutlineShell shell = built(mesh, {.method = method});
        check_sound(shell);
        CHECK(shell.view().vertex_count == 642);
        std::vector<float> positions(3 * shell.view().vertex_count);
        REQUIRE(shell.extrude(1.5, positions.data()));
        for (std::size_t i = 0; i < shell.view().vertex_count; ++i)
            CHECK(std::hypot(positions[3 * i] - 5.0, positions[3 * i + 1] + 1.0,
                             positions[3 * i + 2] - 3.0) == doctest::Approx(3.5).epsilon(0.004));
        if (method == OutlineMethod::mitre) CHECK(std::fabs(shell.face_offset() - 1) < 1e-6);
    }
}

TEST_CASE("the mitre moves every face of random bodies by the extent, within its limit")
{
    std::mt19937 random{17};
    std::uniform_real_distribution<double> unit{0, 1};
    for (int i = 0; i < 60; ++i) {
        // Icospheres with vertices in and out: convex, concave and saddle vertices, sharp ones.
        Mesh mesh = meshes::icosphere(1 + i % 2);
        for (std::size_t v = 0; v < mesh.positions.size(); v += 3) {
            const auto size = static_cast<float>(std::exp(1.5 * (unit(random) - 0.5)));
            for (std::size_t k = 0; k < 3; ++k) mesh.positions[v + k] *= size;
        }
        for (const double limit : {1.0, 1.3, 2.0, 4.0, 1000.0}) {
            const OutlineShell shell = built(mesh, {.mitre_limit = limit});
            check_sound(shell, limit);
            CHECK(shell.face_offset() > 1 - 1e-6 * limit);
        }
        for (const auto method : methods) check_sound(built(mesh, {.method = method}));
    }
}

TEST_CASE("a needle is cut off at the extent")
{
    // A wedge with an edge of 5 degrees, and a spire.
    Mesh wedge;
    const double h = std::tan(2.5 * pi / 180) * 4;
    wedge.quad({0, 0, -1}, {0, 0, 1}, {-4, h, 1}, {-4, h, -1});
    wedge.quad({0, 0, 1}, {0, 0, -1}, {-4, -h, -1}, {-4, -h, 1});
    wedge.quad({-4, h, -1}, {-4, h, 1}, {-4, -h, 1}, {-4, -h, -1});
    wedge.triangle({0, 0, 1}, {-4, h, 1}, {-4, -h, 1});
    wedge.triangle({0, 0, -1}, {-4, -h, -1}, {-4, h, -1});
    turn_all(wedge);
    if (winding(built(wedge), 0, {-3, 0, 0}) < 0) turn_all(wedge);
    const OutlineShell shell = built(wedge);
    check_sound(shell);
    CHECK(shell.face_offset() > 1 - 1e-6);
    CHECK(winding(shell, 0.5, {0.45, 0, 0}) == doctest::Approx(1));
    CHECK(std::fabs(winding(shell, 0.5, {0.55, 0, 0})) < 1e-5);
    CHECK(winding(shell, 0.5, {-3, 0, 1.45}) == doctest::Approx(1));

    Mesh spire;
    const int sides = 64;
    for (int i = 0; i < sides; ++i) {
        const double a = 2 * pi * i / sides, b = 2 * pi * ((i + 1) % sides) / sides;
        spire.triangle({std::cos(a), std::sin(a), 0}, {std::cos(b), std::sin(b), 0}, {0, 0, 50});
        spire.triangle({0, 0, 0}, {std::cos(b), std::sin(b), 0}, {std::cos(a), std::sin(a), 0});
    }
    const OutlineShell pointed = built(spire);
    check_sound(pointed);
    CHECK(pointed.face_offset() > 1 - 1e-6);
    CHECK(winding(pointed, 1, {0, 0, 50.9}) == doctest::Approx(1));
    CHECK(std::fabs(winding(pointed, 1, {0, 0, 51.1})) < 1e-5);
}

TEST_CASE(
    "no point within the radius of a convex body or a triangle is missed at the needed extent")
{
    std::mt19937 random{7};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (int i = 0; i < 160; ++i) {
        // Splinters, plates, spindles and lone triangles with tips of all angles.
        const double thin = std::pow(10.0, -(i / 4 % 3));
        const bool needle = i % 2 == 0;
        const Point scale{needle ? thin : 1, needle ? thin : 1, needle ? 2 : thin};
        Mesh mesh;
        if (i % 4 == 3) {
            mesh = meshes::icosphere(1);
        } else {
            for (int v = 0; v < 4; ++v) mesh.vertex({unit(random), unit(random), unit(random)});
            mesh.face(0, 1, 2);
            if (i % 4 != 2) {
                mesh.face(0, 3, 1);
                mesh.face(1, 3, 2);
                mesh.face(2, 3, 0);
            }
        }
        for (std::size_t p = 0; p < mesh.positions.size(); ++p)
            mesh.positions[p] *= static_cast<float>(scale[p % 3]);
        if (built(mesh).object(0).inward) turn_all(mesh);
        const double radius = 0.3;
        for (const auto method : methods)
            for (const double limit : {2.0, 4.0}) {
                const OutlineShell shell = built(mesh, {.method = method, .mitre_limit = limit});
                if (method == OutlineMethod::mitre) CHECK(shell.face_offset() > 1 - 1e-5);
                const double extent = shell.needed_extent(radius);
                if (extent > 1000) continue;
                for (int j = 0; j < 12; ++j) {
                    // On a face, an edge or a vertex, and then up to the radius.
                    double weights[3], sum = 0;
                    for (double& weight : weights) sum += weight = std::fabs(unit(random));
                    for (int k = 0; k < j % 3; ++k) {
                        sum -= weights[k];
                        weights[k] = 0;
                    }
                    const std::size_t t = random() % (mesh.indices.size() / 3);
                    const glm::dvec3 away = meshes::random_direction(random);
                    Point at{0.99 * radius * away.x, 0.99 * radius * away.y,
                             0.99 * radius * away.z};
                    for (std::size_t c = 0; c < 3; ++c)
                        for (std::size_t k = 0; k < 3; ++k)
                            at[k] +=
                                weights[c] / sum * mesh.positions[3 * mesh.indices[3 * t + c] + k];
                    CAPTURE(i);
                    CAPTURE(limit);
                    CAPTURE(static_cast<int>(method));
                    CHECK(winding(shell, extent, at) > 0.999);
                }
            }
    }
}

TEST_CASE("open and two-sided sheets become slabs")
{
    Mesh sheet, two_sided;
    for (Mesh* mesh : {&sheet, &two_sided})
        for (int x = 0; x < 4; ++x)
            for (int y = 0; y < 4; ++y) {
                const double a = x, b = y;
                mesh->quad({a, b, 0}, {a + 1, b, 0}, {a + 1, b + 1, 0}, {a, b + 1, 0});
                if (mesh == &two_sided)
                    mesh->quad({a, b, 0}, {a, b + 1, 0}, {a + 1, b + 1, 0}, {a + 1, b, 0});
            }
    for (const Mesh* mesh : {&sheet, &two_sided})
        for (const auto method : methods) {
            CAPTURE(static_cast<int>(method));
            const OutlineShell shell = built(*mesh, {.method = method});
            check_sound(shell);
            CHECK(shell.object_count() == 1);
            CHECK(shell.object(0).open == (mesh == &sheet));
            CHECK_FALSE(shell.object(0).inward);
            if (method == OutlineMethod::scaling) {
                CHECK(shell.face_offset() == 0);
                CHECK(shell.needed_extent(1) == infinity);
                continue;
            }
            CHECK(shell.face_offset() > 0.3);
            if (method != OutlineMethod::mitre) continue;
            CHECK(shell.face_offset() == 1);
            // A box that reaches beyond the boundary.
            std::vector<float> positions(3 * shell.view().vertex_count);
            REQUIRE(shell.extrude(0.5, positions.data()));
            for (std::size_t i = 0; i < positions.size(); i += 3) {
                CHECK(std::fabs(positions[i + 2]) == 0.5f);
                CHECK(std::fabs(positions[i] - 2) <= 2.5f);
            }
            for (const double x : {-0.4, 0.1, 2.3, 4.4})
                for (const double y : {-0.4, 1.7, 4.4})
                    for (const double z : {-0.4, 0.0, 0.4})
                        CHECK(winding(shell, 0.5, {x, y, z}) == doctest::Approx(1));
            for (const Point p : {Point{2, 2, 0.6}, {2, 2, -0.6}, {4.6, 2, 0}, {-0.6, -0.6, 0}})
                CHECK(std::fabs(winding(shell, 0.5, p)) < 1e-5);
        }
}

TEST_CASE("a single triangle, a bow tie, a fin and an open box are closed")
{
    Mesh single, bow_tie, fins, box = cube(2, true), moebius;
    single.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    bow_tie.triangle({0, 0, 0}, {1, 0, 0}, {1, 1, 0});
    bow_tie.triangle({0, 0, 0}, {-1, 0, 0}, {-1, -1, 0.3});
    for (int i = 0; i < 5; ++i)
        fins.triangle({0, 0, 0}, {0, 0, 1}, {std::cos(1.1 * i), std::sin(1.1 * i), 0.5});
    box.indices.resize(box.indices.size() - 6);
    const int steps = 12;
    for (int i = 0; i < steps; ++i) {
        const auto point = [](int step, double side) -> Point {
            const double turn = 2 * pi * (step % steps) / steps, twist = turn / 2;
            if (step == steps) side = -side;
            const double r = 3 + side * std::cos(twist);
            return {r * std::cos(turn), r * std::sin(turn), side * std::sin(twist)};
        };
        moebius.quad(point(i, -1), point(i + 1, -1), point(i + 1, 1), point(i, 1));
    }
    const struct {
        const Mesh& mesh;
        std::size_t objects;
    } rows[] = {{single, 1}, {bow_tie, 2}, {fins, 5}, {box, 1}, {moebius, 1}};
    for (const auto& row : rows) {
        const Mesh& mesh = row.mesh;
        const std::size_t objects = row.objects;
        CAPTURE(objects);
        for (const auto method : methods)
            for (const bool skip : {false, true}) {
                const OutlineShell shell = built(mesh, {.method = method, .skip_concave = skip});
                check_sound(shell);
                CHECK(shell.object_count() == objects);
                CHECK(shell.object(0).open);
            }
        const OutlineShell shell = built(mesh);
        CHECK(shell.face_offset() > 1 - 1e-6);
    }
    CHECK(winding(built(single), 0.25, {0.25, 0.25, 0.2}) == doctest::Approx(1));
    CHECK(winding(built(single), 0.25, {-0.2, -0.2, -0.2}) == doctest::Approx(1));
    // The open box has no lid: a slab along its walls, on both sides.
    for (const double y : {0.9, 1.2})
        CHECK(winding(built(box), 0.25, {1.2, y, -0.5}) == doctest::Approx(1));
    CHECK(std::fabs(winding(built(box), 0.25, {0, 0, 0})) < 1e-5);
}

TEST_CASE("boxes that share an edge, a face or a corner stay objects of their own")
{
    for (const Point& shift : {Point{2, 2, 0}, {2, 0, 0}, {2, 2, 2}, {0, 0, 0}}) {
        Mesh mesh = cube(2, true);
        const Mesh other = cube(2, true);
        for (std::size_t i = 0; i < other.positions.size(); i += 3)
            mesh.vertex({other.positions[i] + shift[0], other.positions[i + 1] + shift[1],
                         other.positions[i + 2] + shift[2]});
        for (std::size_t i = 0; i < other.indices.size(); i += 3)
            mesh.face(other.indices[i] + 8, other.indices[i + 1] + 8, other.indices[i + 2] + 8);
        const OutlineShell shell = built(mesh);
        check_sound(shell);
        CHECK(shell.face_offset() == 1);
        CHECK(shell.object_count() == 2);
        // Both outlines hold the place where the boxes meet.
        CHECK(winding(shell, 0.5, {1.1, 1.2, 0.9}) == doctest::Approx(2));
        CHECK(winding(shell, 0.5, {-1.2, -1.2, -1.2}) == doctest::Approx(shift[0] == 0 ? 2 : 1));
    }
}

TEST_CASE("a fin on a box leaves the box closed")
{
    Mesh mesh = cube(2, true);
    mesh.triangle({-1, -1, 1}, {1, -1, 1}, {0, -2, 2});
    mesh.triangle({1, 1, 1}, {-1, 1, 1}, {0, 3, 1});
    const OutlineShell shell = built(mesh);
    check_sound(shell);
    REQUIRE(shell.object_count() == 3);
    CHECK_FALSE(shell.object(0).open);
    CHECK(shell.object(1).open);
    CHECK(shell.object(2).open);
    CHECK(shell.object_of(0) == 0);
    for (std::size_t t = 0; t < shell.view().triangle_count; ++t) {
        const auto& object = shell.object(shell.object_of(t));
        CHECK((object.first_triangle <= t && t < object.first_triangle + object.triangle_count));
    }
    CHECK(winding(shell, 0.25, {0, 0, 0}) == doctest::Approx(1));
    CHECK(winding(shell, 0.25, {0, 0, 1.2}) == doctest::Approx(1));
    CHECK(winding(shell, 0.25, {0, 2.5, 1.2}) == doctest::Approx(1));
}

TEST_CASE("triangles that disagree are turned to what most of the area says")
{
    std::mt19937 random{8};
    for (int i = 0; i < 20; ++i) {
        const Mesh mesh = meshes::icosphere(2, 3);
        Mesh mixed = mesh;
        for (std::size_t t = 0; t < mixed.indices.size(); t += 3)
            if (random() % 10 < 3) std::swap(mixed.indices[t + 1], mixed.indices[t + 2]);
        const OutlineShell shell = built(mixed);
        check_sound(shell);
        CHECK(shell.object_count() == 1);
        CHECK_FALSE(shell.object(0).open);
        CHECK_FALSE(shell.object(0).inward);
        CHECK(winding(shell, 1, {0, 0, 0}) == doctest::Approx(1));
        turn_all(mixed);
        CHECK(winding(built(mixed), 1, {0, 0, 0}) == doctest::Approx(-1));
        CHECK(built(mixed).inward_count() == 1);
    }
}

TEST_CASE("a room keeps its outline inside, and is counted")
{
    Mesh room = cube(2, false);
    turn_all(room);
    const OutlineShell shell = built(room);
    check_sound(shell);
    CHECK(shell.object(0).inward);
    CHECK(shell.inward_count() == 1);
    std::vector<float> positions(3 * shell.view().vertex_count);
    REQUIRE(shell.extrude(0.25, positions.data()));
    for (const float p : positions) CHECK(std::fabs(p) == 0.75f);
    // With the one that the rest of space lacks: 1 at the wall, 0 in the middle.
    CHECK(std::fabs(winding(shell, 0.25, {0.9, 0, 0})) < 1e-5);
    CHECK(winding(shell, 0.25, {0, 0, 0}) == doctest::Approx(-1));
}

TEST_CASE("each object is scaled about its own centre")
{
    Mesh mesh = cube(2, true);
    const Mesh other = cube(2, true);
    for (std::size_t i = 0; i < other.positions.size(); i += 3)
        mesh.vertex({3 * other.positions[i] + 10.0, 3 * other.positions[i + 1] + 20.0,
                     3 * other.positions[i + 2] + 30.0});
    for (std::size_t i = 0; i < other.indices.size(); i += 3)
        mesh.face(other.indices[i] + 8, other.indices[i + 1] + 8, other.indices[i + 2] + 8);
    const OutlineShell shell = built(mesh, {.method = OutlineMethod::scaling});
    REQUIRE(shell.object_count() == 2);
    CHECK(longest(shell.view()) == doctest::Approx(1));
    for (const auto& [base, direction] : by_place(shell.view()))
        for (std::size_t k = 0; k < 3; ++k) {
            const double centre = base[0] > 5 ? 10.0 * double(k + 1) : 0;
            const double expected = (base[k] > centre ? 1 : -1) / std::sqrt(3.0);
            CHECK(direction[k] == doctest::Approx(expected));
        }
}

TEST_CASE("concave vertices are left where they are on request")
{
    // An L in the x-z plane, extruded along y; its inner edge at (1, y, 1).
    Mesh l;
    const double outline[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    for (int i = 0; i < 6; ++i) {
        const auto& a = outline[i];
        const auto& b = outline[(i + 1) % 6];
        l.quad({a[0], 0, a[1]}, {a[0], 1, a[1]}, {b[0], 1, b[1]}, {b[0], 0, b[1]});
    }
    for (const double y : {0.0, 1.0}) {
        const auto at = [&](int i) -> Point { return {outline[i][0], y, outline[i][1]}; };
        for (const auto& t : {std::array{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}) {
            if (y == 0) l.triangle(at(t[0]), at(t[1]), at(t[2]));
            else l.triangle(at(t[0]), at(t[2]), at(t[1]));
        }
    }
    for (const auto method : methods) {
        CAPTURE(static_cast<int>(method));
        const OutlineShell all = built(l, {.method = method});
        const OutlineShell some = built(l, {.method = method, .skip_concave = true});
        check_sound(all);
        check_sound(some);
        CHECK_FALSE(all.object(0).inward);
        const auto all_places = by_place(all.view()), places = by_place(some.view());
        REQUIRE(places.size() == 12);
        for (const auto& [base, direction] : places) {
            const bool inner = base[0] == 1 && base[2] == 1;
            if (inner) CHECK(direction == std::vector<float>{0, 0, 0});
            else CHECK(direction == all_places.at(base));
            if (inner && method == OutlineMethod::mitre)
                CHECK(all_places.at(base) == std::vector<float>{1, base[1] == 0 ? -1.0f : 1.0f, 1});
        }
        CHECK(some.face_offset() == 0);
        CHECK(some.needed_extent(1) == infinity);
        if (method == OutlineMethod::mitre) CHECK(all.face_offset() == 1);
    }
    // A corridor of four walls, seen from inside: nothing moves inward, its back does outward.
    Mesh corridor;
    for (int i = 0; i < 4; ++i) {
        const double a = pi / 2 * i, b = pi / 2 * (i + 1);
        const auto x = [](double t) { return std::round(std::cos(t) - std::sin(t)); };
        const auto y = [](double t) { return std::round(std::cos(t) + std::sin(t)); };
        for (int z = 0; z < 5; ++z)
            corridor.quad({x(b), y(b), double(z)}, {x(a), y(a), double(z)},
                          {x(a), y(a), double(z + 1)}, {x(b), y(b), double(z + 1)});
    }
    const OutlineShell shell = built(corridor, {.skip_concave = true});
    check_sound(shell);
    CHECK(shell.object(0).open);
    CHECK(std::fabs(winding(shell, 0.25, {0.9, 0, 2.5})) < 1e-5);
    CHECK(winding(shell, 0.25, {1.1, 0, 2.5}) == doctest::Approx(1));
    CHECK(winding(built(corridor), 0.25, {0.9, 0, 2.5}) == doctest::Approx(1));
    CHECK(winding(built(corridor), 0.25, {0.9, 0.9, 2.5}) == doctest::Approx(1));
}

TEST_CASE("soups of triangles give finite closed shells")
{
    std::mt19937 random{5};
    for (int i = 0; i < 150; ++i) {
        Mesh mesh = meshes::soup(random, 2 + i, std::ldexp(1.0, i % 2 == 0 ? 0 : i % 200 - 100));
        // A handful of vertices: every edge is shared by many.
        if (i % 3 == 0)
            for (std::uint32_t& index : mesh.indices) index %= 9;
        for (const auto method : methods) {
            const OutlineShell shell = built(mesh, {.method = method, .skip_concave = i % 5 == 0});
            check_sound(shell);
            if (method == OutlineMethod::mitre && i % 5 != 0) CHECK(shell.face_offset() > 1 - 1e-5);
        }
    }
}

TEST_CASE("vertices without a number and triangles without area are left out")
{
    Mesh mesh = cube(2, true);
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                         std::numeric_limits<float>::infinity()};
    for (const float value : bad) {
        const std::uint32_t v = mesh.vertex({0, 0, 0});
        mesh.positions[3 * v + 1] = value;
        mesh.face(0, 1, v);
    }
    mesh.face(0, 0, 1);
    mesh.triangle({0, 0, 0}, {1, 1, 1}, {2, 2, 2});
    for (const double weld : {0.0, 0.1}) {
        const OutlineShell shell = built(mesh, {.weld = weld});
        check_sound(shell);
        CHECK(shell.dropped() == 4);
        CHECK(shell.view().vertex_count == 8);
        CHECK(shell.face_offset() == 1);
    }
    Mesh nothing;
    nothing.triangle({0, 0, 0}, {1, 1, 1}, {2, 2, 2});
    for (const Mesh& empty : {Mesh{}, nothing}) {
        OutlineShell shell = built(empty);
        CHECK(shell.view().vertex_count == 0);
        CHECK(shell.view().triangle_count == 0);
        CHECK(shell.object_count() == 0);
        CHECK(shell.needed_extent(5) == 0);
        CHECK(shell.extrude(1, nullptr));
    }
    // The largest floats.
    Mesh huge = cube(2, false);
    for (float& p : huge.positions) p *= (std::numeric_limits<float>::max)();
    const OutlineShell shell = built(huge);
    check_sound(shell);
    CHECK(shell.face_offset() == 1);
    std::vector<float> positions(3 * shell.view().vertex_count);
    REQUIRE(shell.extrude(1e300, positions.data()));
    for (const float p : positions) CHECK(nook::detail::is_finite(p));
}

TEST_CASE("a scene scaled by a power of two has the directions it has at home")
{
    std::mt19937 random{21};
    const Mesh soup = meshes::soup(random, 300), sphere = meshes::icosphere(2);
    for (const Mesh* mesh : {&soup, &sphere})
        for (const auto method : methods)
            for (const double weld : {0.0, 0.01}) {
                const OutlineShell home = built(*mesh, {.method = method, .weld = weld});
                for (const int power : {-60, 1, 60}) {
                    Mesh scaled = *mesh;
                    for (float& p : scaled.positions) p = std::ldexp(p, power);
                    const OutlineShell shell =
                        built(scaled, {.method = method, .weld = std::ldexp(weld, power)});
                    const OutlineView a = home.view(), b = shell.view();
                    REQUIRE(a.vertex_count == b.vertex_count);
                    REQUIRE(a.triangle_count == b.triangle_count);
                    CHECK(std::equal(a.direction, a.direction + 3 * a.vertex_count, b.direction));
                    CHECK(std::equal(a.indices, a.indices + 3 * a.triangle_count, b.indices));
                }
            }
}

TEST_CASE("a face cut into a great many triangles counts once, and a fan of a great many is fast")
{
    // A cone of 200 000 triangles: the apex has as many corners.
    Mesh cone;
    const int sides = 100000;
    const std::uint32_t apex = cone.vertex({0, 0, 1}), foot = cone.vertex({0, 0, 0});
    for (int i = 0; i < sides; ++i)
        cone.vertex({std::cos(2 * pi * i / sides), std::sin(2 * pi * i / sides), 0});
    for (int i = 0; i < sides; ++i) {
        const auto a = static_cast<std::uint32_t>(2 + i);
        const auto b = static_cast<std::uint32_t>(2 + (i + 1) % sides);
        cone.face(a, b, apex);
        cone.face(b, a, foot);
    }
    const OutlineShell shell = built(cone);
    CHECK(finite(shell.view()));
    CHECK(shell.object_count() == 1);
    CHECK(shell.face_offset() > 0.999);
    const auto places = by_place(shell.view());
    CHECK(places.at({0, 0, 0})[2] == doctest::Approx(-1));
    CHECK(places.at({0, 0, 1})[2] == doctest::Approx(std::sqrt(2.0)).epsilon(1e-3));
}
