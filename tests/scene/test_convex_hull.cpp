#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/scene/convex_hull.hpp>

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

class Points {
public:
    Points& add(double x, double y, double z)
    {
        for (const double value : {x, y, z}) floats.push_back(static_cast<float>(value));
        return *this;
    }
    [[nodiscard]] std::size_t size() const { return floats.size() / 3; }
    [[nodiscard]] glm::dvec3 operator[](std::size_t i) const
    {
        return {floats[3 * i], floats[3 * i + 1], floats[3 * i + 2]};
    }
    [[nodiscard]] double extent() const
    {
        glm::dvec3 low = (*this)[0], high = low;
        for (std::size_t i = 0; i < size(); ++i) {
            low = glm::min(low, (*this)[i]);
            high = glm::max(high, (*this)[i]);
        }
        const glm::dvec3 size = high - low;
        return (std::max)({size.x, size.y, size.z});
    }
    std::vector<float> floats;
};

nook::ConvexHull hull_of(const Points& points)
{
    nook::ConvexHull hull;
    REQUIRE(hull.build(points.floats.data(), points.size()));
    return hull;
}

glm::dvec3 corner(const nook::MeshView& mesh, std::size_t triangle, std::size_t k)
{
    const float* at = mesh.positions + 3 * std::size_t{mesh.indices[3 * triangle + k]};
    return {at[0], at[1], at[2]};
}

double volume(const nook::MeshView& mesh)
{
    double sum = 0;
    if (mesh.triangle_count == 0) return sum;
    const glm::dvec3 origin = corner(mesh, 0, 0);
    for (std::size_t i = 0; i < mesh.triangle_count; ++i)
        sum += glm::dot(corner(mesh, i, 0) - origin,
                        glm::cross(corner(mesh, i, 1) - origin, corner(mesh, i, 2) - origin));
    return sum / 6;
}

/// Each directed edge comes once and its opposite too, every vertex is used, and Euler's formula
/// holds.
bool is_closed(const nook::MeshView& mesh)
{
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    std::set<std::uint32_t> used;
    for (std::size_t i = 0; i < mesh.triangle_count; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            used.insert(mesh.indices[3 * i + k]);
            const bool fresh =
                edges.insert({mesh.indices[3 * i + k], mesh.indices[3 * i + (k + 1) % 3]}).second;
            if (!fresh) return false;
        }
    for (const auto& [a, b] : edges)
        if (!edges.contains({b, a})) return false;
    return used.size() == mesh.vertex_count && mesh.triangle_count == 2 * mesh.vertex_count - 4;
}

/// The farthest that a point lies above the plane of a triangle.
double highest_above(const nook::MeshView& mesh, const Points& points)
{
    double result = -1e300;
    for (std::size_t i = 0; i < mesh.triangle_count; ++i) {
        const glm::dvec3 a = corner(mesh, i, 0);
        const glm::dvec3 normal =
            glm::normalize(glm::cross(corner(mesh, i, 1) - a, corner(mesh, i, 2) - a));
        for (std::size_t p = 0; p < points.size(); ++p)
            result = (std::max)(result, glm::dot(points[p] - a, normal));
    }
    return result;
}

Points cube(double half, double offset = 0)
{
    Points points;
    for (int i = 0; i < 8; ++i)
        points.add(offset + ((i & 1) != 0 ? half : -half), offset + ((i & 2) != 0 ? half : -half),
                   offset + ((i & 4) != 0 ? half : -half));
    return points;
}

}  // namespace

TEST_CASE("the hull of a cube has its eight corners, whatever lies inside")
{
    std::mt19937 random{5};
    std::uniform_real_distribution<double> inside{-1, 1};
    Points points;
    for (int i = 0; i < 500; ++i) points.add(inside(random), inside(random), inside(random));
    const Points corners = cube(1);
    points.floats.insert(points.floats.end(), corners.floats.begin(), corners.floats.end());
    const nook::ConvexHull hull = hull_of(points);
    CHECK(hull.vertex_count() == 8);
    CHECK(hull.triangle_count() == 12);
    CHECK(is_closed(hull.mesh()));
    CHECK(volume(hull.mesh()) == 8);
    std::set<std::uint32_t> sources(hull.points(), hull.points() + 8);
    CHECK(*sources.begin() == 500);
    CHECK(*sources.rbegin() == 507);
    CHECK(sources.size() == 8);
    CHECK(hull.tolerance() < 7e-9 * 2);
    CHECK(hull.tolerance() > 0);
    CHECK(hull.dropped() == 0);
    for (std::uint32_t i = 0; i < 8; ++i)
        for (std::uint32_t k = 0; k < 3; ++k)
            CHECK(hull.mesh().positions[3 * i + k] == points.floats[3 * hull.points()[i] + k]);
}

TEST_CASE("points of a grid leave no vertex inside a face or an edge")
{
    Points points;
    for (int x = 0; x <= 12; ++x)
        for (int y = 0; y <= 9; ++y)
            for (int z = 0; z <= 5; ++z) points.add(x, y, z);
    const nook::ConvexHull hull = hull_of(points);
    CHECK(hull.vertex_count() == 8);
    CHECK(is_closed(hull.mesh()));
    CHECK(volume(hull.mesh()) == 12 * 9 * 5);

    // The integer points of an octahedron: faces of many points at a slant.
    Points diamond;
    for (int x = -9; x <= 9; ++x)
        for (int y = -9; y <= 9; ++y)
            for (int z = -9; z <= 9; ++z)
                if (std::abs(x) + std::abs(y) + std::abs(z) <= 9) diamond.add(x, y, z);
    const nook::ConvexHull octahedron = hull_of(diamond);
    CHECK(octahedron.vertex_count() == 6);
    CHECK(octahedron.triangle_count() == 8);
    CHECK(is_closed(octahedron.mesh()));
    CHECK(volume(octahedron.mesh()) == doctest::Approx(4.0 / 3 * 729).epsilon(1e-12));
}

TEST_CASE("integer points in a ball: the hull is exact")
{
    // Many coplanar points at once; every decision can be checked in integers.
    for (const int square : {1, 2, 3, 5, 9, 14, 30, 81, 150}) {
        CAPTURE(square);
        Points points;
        for (int x = -13; x <= 13; ++x)
            for (int y = -13; y <= 13; ++y)
                for (int z = -13; z <= 13; ++z)
                    if (x * x + y * y + z * z <= square) points.add(x, y, z);
        const nook::ConvexHull hull = hull_of(points);
        const nook::MeshView mesh = hull.mesh();
        CHECK(is_closed(mesh));
        std::size_t above = 0, redundant = 0;
        std::vector<std::set<std::array<long long, 4>>> planes(mesh.vertex_count);
        for (std::size_t i = 0; i < mesh.triangle_count; ++i) {
            const glm::dvec3 a = corner(mesh, i, 0);
            const glm::dvec3 normal = glm::cross(corner(mesh, i, 1) - a, corner(mesh, i, 2) - a);
            for (std::size_t p = 0; p < points.size(); ++p)
                above += glm::dot(points[p] - a, normal) > 0 ? 1 : 0;
            // The plane in lowest terms.
            std::array<long long, 4> plane{std::llround(normal.x), std::llround(normal.y),
                                           std::llround(normal.z),
                                           std::llround(glm::dot(normal, a))};
            long long divisor = 0;
            for (const long long value : plane) divisor = std::gcd(divisor, value);
            for (long long& value : plane) value /= divisor;
            for (std::size_t k = 0; k < 3; ++k) planes[mesh.indices[3 * i + k]].insert(plane);
        }
        for (const auto& around : planes) redundant += around.size() < 3 ? 1 : 0;
        CHECK(above == 0);
        CHECK(redundant == 0);
    }
}

TEST_CASE("points on a sphere are all vertices")
{
    Points points;
    constexpr int count = 4000;
    for (int i = 0; i < count; ++i) {
        const double z = 1 - 2 * (i + 0.5) / count, turn = 2.399963 * i;
        const double out = std::sqrt(1 - z * z);
        points.add(3 * out * std::cos(turn), 3 * out * std::sin(turn), 3 * z);
    }
    const nook::ConvexHull hull = hull_of(points);
    CHECK(hull.vertex_count() == count);
    CHECK(is_closed(hull.mesh()));
    const double ball = 4.0 / 3 * 3.14159265358979 * 27;
    CHECK(volume(hull.mesh()) < ball);
    CHECK(volume(hull.mesh()) > 0.998 * ball);
    CHECK(highest_above(hull.mesh(), points) <= 1e-6);
}

TEST_CASE("no point of a random cloud lies outside, at any scale and place")
{
    std::mt19937 random{9};
    std::normal_distribution<double> cloud;
    for (const double scale : {1e-6, 1e-3, 1.0, 1e3, 1e6})
        for (const double offset : {0.0, 1e4}) {
            CAPTURE(scale);
            CAPTURE(offset);
            Points points;
            for (int i = 0; i < 600; ++i)
                points.add(scale * cloud(random) + offset, 0.3 * scale * cloud(random) + offset,
                           2 * scale * cloud(random) - offset);
            nook::ConvexHull hull;
            REQUIRE(hull.build(points.floats.data(), points.size()));
            // Floats near 10⁴ are 0.001 apart: what is left of the smallest clouds is flat.
            if (offset > 0 && scale < 0.01) {
                CHECK(hull.triangle_count() == 0);
                continue;
            }
            CHECK(hull.triangle_count() > 0);
            CHECK(is_closed(hull.mesh()));
            CHECK(volume(hull.mesh()) > 0);
            CHECK(hull.tolerance() < 7e-9 * points.extent());
            CHECK(highest_above(hull.mesh(), points) < 1e-7 * points.extent());
        }
}

TEST_CASE("a hull that moves and is scaled by powers of two has the same triangles")
{
    std::mt19937 random{2};
    std::uniform_int_distribution<int> step{-(1 << 16), 1 << 16};
    Points points;
    for (int i = 0; i < 900; ++i)
        points.add(step(random) * 0x1p-16, step(random) * 0x1p-16, step(random) * 0x1p-16);
    const nook::ConvexHull home = hull_of(points);
    for (const double scale : {0x1p-120, 0x1p-30, 1.0, 0x1p100}) {
        Points moved;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const glm::dvec3 at = scale * (points[i] + glm::dvec3{32, -64, 16});
            moved.add(at.x, at.y, at.z);
        }
        const nook::ConvexHull away = hull_of(moved);
        REQUIRE(away.triangle_count() == home.triangle_count());
        CHECK(std::equal(away.mesh().indices, away.mesh().indices + 3 * away.triangle_count(),
                         home.mesh().indices));
        CHECK(std::equal(away.points(), away.points() + away.vertex_count(), home.points()));
        CHECK(away.tolerance() == scale * home.tolerance());
    }
}

TEST_CASE("duplicates and points that are almost the same add nothing")
{
    std::mt19937 random{3};
    std::uniform_int_distribution<int> which{0, 7};
    std::uniform_real_distribution<double> noise{-1e-7, 1e-7};
    Points same, close;
    const Points corners = cube(1);
    for (int i = 0; i < 400; ++i) {
        const glm::dvec3 at = corners[static_cast<std::size_t>(i < 8 ? i : which(random))];
        same.add(at.x, at.y, at.z);
        close.add(at.x + noise(random), at.y + noise(random), at.z + noise(random));
    }
    const nook::ConvexHull exact = hull_of(same);
    CHECK(exact.vertex_count() == 8);
    CHECK(volume(exact.mesh()) == 8);
    const nook::ConvexHull rough = hull_of(close);
    CHECK(is_closed(rough.mesh()));
    CHECK(volume(rough.mesh()) == doctest::Approx(8).epsilon(1e-6));
}

TEST_CASE("long and thin clouds give closed hulls")
{
    std::mt19937 random{8};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (const double thin : {1e-2, 1e-4, 1e-5, 3e-6}) {
        CAPTURE(thin);
        Points needle, plate;
        for (int i = 0; i < 700; ++i) {
            const glm::dvec3 at{unit(random), unit(random), unit(random)};
            needle.add(at.x, thin * at.y, thin * at.z);
            plate.add(at.x + 0.7 * at.y, at.y - 0.7 * at.x, thin * at.z);
        }
        for (const Points& points : {needle, plate}) {
            const nook::ConvexHull hull = hull_of(points);
            CHECK(hull.triangle_count() > 0);
            CHECK(is_closed(hull.mesh()));
            CHECK(volume(hull.mesh()) > 0);
        }
    }
}

TEST_CASE("flat points have no hull")
{
    std::mt19937 random{4};
    std::uniform_real_distribution<double> unit{-1, 1};
    Points none, one, three, line, coordinate_plane, slanted, same;
    one.add(1, 2, 3);
    three.add(0, 0, 0).add(1, 0, 0).add(0, 1, 0);
    const glm::dvec3 u{0.3, 0.8, -0.2}, v{-0.5, 0.1, 0.7}, origin{3, -2, 5};
    for (int i = 0; i < 300; ++i) {
        const double s = unit(random), t = unit(random);
        const glm::dvec3 at = origin + u * s + v * t, on = origin + u * s;
        slanted.add(at.x, at.y, at.z);
        line.add(on.x, on.y, on.z);
        coordinate_plane.add(s, 4, t);
        same.add(1, 1, 1);
    }
    for (const Points& points : {none, one, three, line, coordinate_plane, slanted, same}) {
        const nook::ConvexHull hull = hull_of(points);
        CHECK(hull.triangle_count() == 0);
        CHECK(hull.vertex_count() == 0);
        CHECK(hull.mesh().triangle_count == 0);
        CHECK(hull.tolerance() == 0);
    }
    nook::ConvexHull hull;
    CHECK(hull.build(nullptr, 0));
}

TEST_CASE("points that are not finite are left out")
{
    Points points = cube(1);
    points.add(not_a_number, 0, 0).add(0, infinity, 0).add(0, 9, -infinity);
    const nook::ConvexHull hull = hull_of(points);
    CHECK(hull.dropped() == 3);
    CHECK(hull.vertex_count() == 8);
    CHECK(volume(hull.mesh()) == 8);
    Points lost;
    lost.add(not_a_number, not_a_number, not_a_number).add(0, 0, infinity);
    CHECK(hull_of(lost).dropped() == 2);
    // The largest floats there are.
    const double most = std::numeric_limits<float>::max();
    const nook::ConvexHull largest = hull_of(cube(most));
    CHECK(largest.triangle_count() == 12);
    CHECK(hull_of(cube(0x1p-120)).triangle_count() == 12);
}

TEST_CASE("strides of any kind are followed")
{
    const Points points = cube(2, 1);
    std::vector<float> wide(8 * 5, not_a_number);
    for (std::size_t i = 0; i < 8; ++i)
        for (std::size_t k = 0; k < 3; ++k) wide[5 * (7 - i) + k] = points.floats[3 * i + k];
    nook::ConvexHull tight, padded, backwards;
    REQUIRE(tight.build(points.floats.data(), 8));
    REQUIRE(padded.build(wide.data(), 8, 5));
    REQUIRE(backwards.build(wide.data() + 35, 8, -5));
    CHECK(padded.triangle_count() == 12);
    CHECK(std::equal(tight.points(), tight.points() + 8, backwards.points()));
    CHECK(std::equal(tight.mesh().indices, tight.mesh().indices + 36, backwards.mesh().indices));
}

TEST_CASE("wrong arguments and lack of memory are told and leave the hull as it was")
{
    nook::ConvexHull hull = hull_of(cube(1));
    const auto unchanged = [&] { return hull.triangle_count() == 12 && volume(hull.mesh()) == 8; };
    const nook::Outcome null = hull.build(nullptr, 4);
    CHECK(null.error.code == nook::ErrorCode::null_data);
    CHECK(std::string_view{null.error.argument} == "points");
    const float some[3] = {};
    const nook::Outcome many = hull.build(some, std::size_t{1} << 31);
    CHECK(many.error.code == nook::ErrorCode::bad_size);
    CHECK(unchanged());

    // The first, then the second block fails; whatever was taken comes back.
    struct Heap {
        int left;
        std::ptrdiff_t held = 0;
    };
    const Points points = cube(3);
    for (const int blocks : {0, 1}) {
        Heap heap{blocks};
        const nook::Memory memory{[](std::size_t size, void* user) -> void* {
                                      auto& own = *static_cast<Heap*>(user);
                                      if (own.left-- <= 0) return nullptr;
                                      own.held += static_cast<std::ptrdiff_t>(size);
                                      return ::operator new(size);
                                  },
                                  [](void* block, std::size_t size, void* user) {
                                      static_cast<Heap*>(user)->held -=
                                          static_cast<std::ptrdiff_t>(size);
                                      ::operator delete(block);
                                  },
                                  &heap};
        const nook::Outcome outcome = hull.build(points.floats.data(), 8, 3, {memory});
        CHECK(outcome.error.code == nook::ErrorCode::out_of_memory);
        CHECK(std::string_view{outcome.error.argument} == "options.memory");
        CHECK(outcome.error.value > 0);
        CHECK(heap.held == 0);
        CHECK(unchanged());
    }
    nook::ConvexHull moved = std::move(hull);
    CHECK(moved.triangle_count() == 12);
    CHECK(moved.memory_size() > 0);
    CHECK(hull.triangle_count() == 0);  // NOLINT: moved from, and empty
}
