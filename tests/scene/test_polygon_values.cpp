#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <nook/scene/polygon_values.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::ErrorCode;
using nook::PolygonState;
using nook::VertexWeight;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float no_number = std::numeric_limits<float>::quiet_NaN();

template <class Real>
std::vector<float> normalised(const std::vector<Real>& information,
                              const std::vector<PolygonState>& states = {}, double within = 1e-12)
{
    std::vector<float> result(information.size(), -1.0f);
    REQUIRE(!nook::normalise_information(information.data(),
                                         states.empty() ? nullptr : states.data(),
                                         information.size(), result.data(), within));
    return result;
}

std::vector<float> to_vertices(const Mesh& mesh, const std::vector<float>& values,
                               const std::vector<PolygonState>& states = {},
                               VertexWeight weight = VertexWeight::angle)
{
    std::vector<float> result(mesh.positions.size() / 3, -1.0f);
    REQUIRE(nook::polygon_to_vertex_values(mesh.view(), values.data(),
                                           states.empty() ? nullptr : states.data(), result.data(),
                                           weight));
    return result;
}

}  // namespace

TEST_CASE("The least information becomes 1 and the largest 0")
{
    CHECK(normalised<double>({2, 1, 3, 1.5}) == std::vector<float>{0.5f, 1, 0, 0.75f});
    CHECK(normalised<float>({2, 1, 3, 1.5f}) == std::vector<float>{0.5f, 1, 0, 0.75f});
}

TEST_CASE("Unseen polygons get 0 and do not move the range")
{
    using enum PolygonState;
    const std::vector<double> information{0, 1, 99, 2, -5, 7};
    CHECK(normalised(information, {hidden, seen, too_small, seen, unusable, turned_away}) ==
          std::vector<float>{0, 1, 0, 0, 0, 0});
    CHECK(normalised<double>({1, double{no_number}, 2, double{infinity}}) ==
          std::vector<float>{1, 0, 0, 0});
    CHECK(normalised<float>({no_number, no_number}) == std::vector<float>{0, 0});
    CHECK(normalised(information, std::vector<PolygonState>(6, hidden)) ==
          std::vector<float>(6, 0.0f));
}

TEST_CASE("Information that is equal up to rounding is 1 everywhere, not full-range noise")
{
    const double at = 1.282259541499;
    CHECK(normalised<double>({at, at + 5e-15, at - 5e-15}) == std::vector<float>{1, 1, 1});
    CHECK(normalised<double>({0, 0}) == std::vector<float>{1, 1});
    CHECK(normalised<double>({at}) == std::vector<float>{1});
    // Beyond the tolerance the whole range is used.
    CHECK(normalised<double>({at, at + 4e-12}) == std::vector<float>{1, 0});
    CHECK(normalised<double>({1, 1.25}, {}, 0.25) == std::vector<float>{1, 1});
    CHECK(normalised<double>({1, 1.25}, {}, 0.24) == std::vector<float>{1, 0});
    // Floats cannot be equal to 1e-12.
    const float single = static_cast<float>(at);
    CHECK(normalised<float>({single, std::nextafter(single, 2.0f)}) == std::vector<float>{1, 1});
    CHECK(normalised<float>({1.0f, 1.001f}) == std::vector<float>{1, 0});
}

TEST_CASE("Ranges at both ends of double are normalised")
{
    constexpr double most = std::numeric_limits<double>::max();
    CHECK(normalised<double>({most, -most, 0, most / 2}) == std::vector<float>{0, 1, 0.5f, 0.25f});
    CHECK(normalised<double>({0, most}) == std::vector<float>{1, 0});
    // No tolerance, and a range whose reciprocal is too large.
    CHECK(normalised<double>({0, 5e-324, 1e-310}, {}, 0) == std::vector<float>{1, 1, 1});
    CHECK(normalised<double>({0, 1e-290}, {}, 0) == std::vector<float>{1, 0});
}

TEST_CASE("Information may be normalised in place")
{
    std::vector<float> values{3, 1, 2};
    REQUIRE(!nook::normalise_information(values.data(), nullptr, 3, values.data()));
    CHECK(values == std::vector<float>{0, 1, 0.5f});
}

TEST_CASE("Arguments that information cannot be normalised with are refused")
{
    float value = 5;
    CHECK(!nook::normalise_information<float>(nullptr, nullptr, 0, nullptr));
    CHECK(nook::normalise_information<float>(nullptr, nullptr, 1, &value).code ==
          ErrorCode::null_data);
    CHECK(nook::normalise_information<float>(&value, nullptr, 1, nullptr).code ==
          ErrorCode::null_data);
    for (const double within : {-1.0, double{no_number}, double{infinity}})
        CHECK(nook::normalise_information(&value, nullptr, 1, &value, within).code ==
              ErrorCode::bad_value);
    CHECK(value == 5);
}

TEST_CASE("A vertex is the mean of its triangles, weighted by their angles or their areas")
{
    // At the origin a right angle and a half of one; areas 1/2 and 2.
    Mesh mesh;
    const auto o = mesh.vertex({0, 0, 0}), x = mesh.vertex({1, 0, 0}), y = mesh.vertex({0, 1, 0}),
               z = mesh.vertex({0, -4, 0});
    const auto d = mesh.vertex({1, -1, 0});
    mesh.face(o, x, y);
    mesh.face(o, z, d);
    const std::vector<float> values{0.9f, 0.3f};
    const auto by_angle = to_vertices(mesh, values);
    CHECK(by_angle[o] == doctest::Approx((2 * 0.9 + 0.3) / 3).epsilon(1e-7));
    CHECK(by_angle[x] == 0.9f);
    CHECK(by_angle[y] == 0.9f);
    CHECK(by_angle[z] == 0.3f);
    const auto by_area = to_vertices(mesh, values, {}, VertexWeight::area);
    CHECK(by_area[o] == doctest::Approx((0.5 * 0.9 + 2 * 0.3) / 2.5).epsilon(1e-7));
}

TEST_CASE("Angles do not notice how a flat face is cut into triangles")
{
    // A fan around the same corner, in one piece and in three.
    const auto corner = [](int pieces) {
        Mesh mesh;
        const auto o = mesh.vertex({0, 0, 0});
        const auto at = [&](double angle) {
            return mesh.vertex({std::cos(angle), std::sin(angle), 0});
        };
        std::vector<float> values;
        auto last = at(0);
        for (int i = 1; i <= pieces; ++i) {
            const auto next = at(i * 1.2 / pieces);
            mesh.face(o, last, next);
            values.push_back(0.8f);
            last = next;
        }
        mesh.face(o, last, mesh.vertex({-1, 0, 2}));
        values.push_back(0.1f);
        return to_vertices(mesh, values)[o];
    };
    CHECK(corner(3) == doctest::Approx(corner(1)).epsilon(1e-6));
    CHECK(corner(7) == doctest::Approx(corner(1)).epsilon(1e-6));
}

TEST_CASE("The sharpest corner of a triangle gets its value, too")
{
    // Seen from the tip, the two other corners lie in one direction to the precision of double.
    Mesh mesh;
    const auto a = mesh.vertex({0, 0, 0}), b = mesh.vertex({1e-20, 0, 0}),
               tip = mesh.vertex({3, 1, 0});
    mesh.face(a, b, tip);
    for (const VertexWeight weight : {VertexWeight::angle, VertexWeight::area}) {
        const auto values = to_vertices(mesh, {0.75f}, {}, weight);
        for (const auto vertex : {a, b, tip}) CHECK(values[vertex] == 0.75f);
    }
}

TEST_CASE("Unseen and unusable triangles and values that are not finite take no part")
{
    using enum PolygonState;
    Mesh mesh;
    const auto a = mesh.vertex({0, 0, 0}), b = mesh.vertex({1, 0, 0}), c = mesh.vertex({0, 1, 0}),
               d = mesh.vertex({1, 1, 0}), lone = mesh.vertex({5, 5, 5}),
               bad = mesh.vertex({double{no_number}, 0, 0});
    mesh.face(a, b, c);
    mesh.face(b, d, c);
    mesh.face(a, a, lone);
    mesh.face(a, b, bad);
    const std::vector<float> values{0.25f, 0.75f, 0.5f, 0.5f};
    const auto all = to_vertices(mesh, values);
    CHECK(all[a] == 0.25f);
    CHECK(all[b] == doctest::Approx(0.5).epsilon(1e-7));
    CHECK(all[lone] == 0);
    CHECK(all[bad] == 0);
    const auto half = to_vertices(mesh, values, {hidden, seen, seen, seen});
    CHECK(half[a] == 0);
    CHECK(half[b] == 0.75f);
    CHECK(half[d] == 0.75f);
    const auto poisoned = to_vertices(mesh, {no_number, 0.75f, infinity, no_number});
    CHECK(poisoned[a] == 0);
    CHECK(poisoned[b] == 0.75f);
}

TEST_CASE("Equal values stay what they are, and means lie between")
{
    std::mt19937 random{7};
    const Mesh mesh = meshes::soup(random, 200);
    const std::size_t count = mesh.indices.size() / 3;
    for (const auto weight : {VertexWeight::angle, VertexWeight::area}) {
        for (const float value : to_vertices(mesh, std::vector<float>(count, 0.3f), {}, weight))
            CHECK((value == 0.3f || value == 0));
        std::vector<float> values;
        std::uniform_real_distribution<float> unit{0.2f, 0.7f};
        for (std::size_t t = 0; t < count; ++t) values.push_back(unit(random));
        for (const float value : to_vertices(mesh, values, {}, weight))
            CHECK((value == 0 || (value >= 0.2f && value <= 0.7f)));
    }
}

TEST_CASE("Arguments that values cannot be interpolated with are refused")
{
    Mesh mesh;
    mesh.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    float values[8] = {1}, out[3] = {7, 7, 7};
    const auto code = [&](const float* in, float* to) {
        return nook::polygon_to_vertex_values(mesh.view(), in, nullptr, to).error.code;
    };
    CHECK(code(nullptr, out) == ErrorCode::null_data);
    CHECK(code(values, nullptr) == ErrorCode::null_data);
    CHECK(code(values, values) == ErrorCode::overlap);
    CHECK(code(values + 2, values) == ErrorCode::overlap);
    CHECK(code(values, values + 1) == ErrorCode::none);
    std::vector<std::byte> memory(nook::polygon_to_vertex_scratch_size(mesh.view()));
    const auto with = [&](std::size_t size) {
        return nook::polygon_to_vertex_values(mesh.view(), values, nullptr, out,
                                              VertexWeight::angle,
                                              nook::Scratch{memory.data(), size})
            .error.code;
    };
    CHECK(with(memory.size() - 1) == ErrorCode::scratch_too_small);
    CHECK(out[0] == 7);
    CHECK(with(memory.size()) == ErrorCode::none);
    CHECK(out[0] == 1);
    mesh.indices[1] = 3;
    CHECK(code(values, out) == ErrorCode::index_out_of_range);
    CHECK(nook::polygon_to_vertex_values({}, nullptr, nullptr, nullptr));
}

TEST_CASE("States are counted")
{
    using enum PolygonState;
    const PolygonState states[] = {seen, hidden, seen, too_small, unusable, turned_away, seen};
    const auto counts = nook::count_states(states, 7);
    CHECK(counts.seen == 3);
    CHECK(counts.hidden == 1);
    CHECK(counts.too_small == 1);
    CHECK(counts.unusable == 1);
    CHECK(counts.turned_away == 1);
    CHECK(nook::count_states(nullptr, 7).seen == 0);
}
