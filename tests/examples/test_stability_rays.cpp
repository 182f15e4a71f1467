#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <nook/scene/falloff.hpp>

#include "../../examples/stability/stability.hpp"
#include "../../examples/stability/textbook_rays.hpp"
#include "stability_rows.hpp"

namespace {

namespace textbook = stability::textbook;

/// Computed once for all tests of this file.
const std::vector<stability::Family>& ray_families()
{
    static const std::vector<stability::Family> families{
        stability::watertightness(), stability::self_hits(), stability::falloffs(),
        stability::ray_scales()};
    return families;
}

/// What an algorithm made of a case: the number that the metric of this name says.
double value_of(std::string_view family_name, std::string_view metric, std::string_view subject,
                std::string_view algorithm)
{
    std::optional<double> found;
    for (const stability::Family& family : ray_families())
        for (const stability::Row& row : family.rows)
            for (std::size_t i = 0; i < family.metrics.size(); ++i)
                if (family.label.name == family_name && family.metrics[i].name == metric &&
                    row.case_name == subject && row.algorithm == algorithm)
                    found = row.values.at(i);
    CAPTURE(family_name);
    CAPTURE(subject);
    CAPTURE(algorithm);
    REQUIRE(found);
    return *found;
}

}  // namespace

TEST_CASE("rows of rays: labels for all, each case and algorithm once, a number or NaN in each")
{
    for (const stability::Family& family : ray_families()) {
        CAPTURE(family.label.name);
        const auto has = [](const std::vector<stability::Label>& labels, const std::string& name) {
            return std::count_if(labels.begin(), labels.end(), [&](const stability::Label& label) {
                       return label.name == name && !label.what.empty();
                   }) == 1;
        };
        std::set<std::pair<std::string, std::string>> seen;
        for (const stability::Row& row : family.rows) {
            CHECK(has(family.cases, row.case_name));
            CHECK(has(family.algorithms, row.algorithm));
            CHECK(seen.emplace(row.case_name, row.algorithm).second);
            CHECK_FALSE(row.parameters.empty());
            REQUIRE(row.values.size() == family.metrics.size());
            for (const std::optional<double>& value : row.values) CHECK(value);
        }
        // Only points of a list have no face ids.
        const bool points = family.label.name == "rays-self-hits";
        CHECK(seen.size() == family.cases.size() * family.algorithms.size() - (points ? 3 : 0));
    }
}

TEST_CASE("textbook rays hit what they should on gentle data")
{
    const glm::vec3 a{0, 0, 2}, b{4, 0, 2}, c{0, 4, 2};
    for (const auto& [x, y, hits] : {std::tuple{1.f, 1.f, true},
                                     {0.5f, 3.f, true},
                                     {3.f, 3.f, false},
                                     {-1.f, 1.f, false},
                                     {1.f, -1.f, false}})
        for (const float z : {1.f, -1.f}) {
            const textbook::Ray<float> ray{{0, 0, 0}, {x / 4, y / 4, z / 2}};
            const float expected = hits && z > 0 ? 4 : textbook::miss<float>;
            CHECK(textbook::sheared(ray, a, b, c) == expected);
            CHECK(textbook::moeller_trumbore(ray, a, b, c, 1e-6f) == expected);
        }
    // In the plane of the triangle, and away from it.
    CHECK(textbook::sheared({{0, 0, 2}, {1, 1, 0}}, a, b, c) == textbook::miss<float>);
    CHECK(textbook::moeller_trumbore({{0, 0, 2}, {1, 1, 0}}, a, b, c, 0.f) ==
          textbook::miss<float>);
    const glm::vec3 moved = textbook::ulps_offset({1, -1000, 0.01f}, {0.5f, 1, -1});
    CHECK(moved.x == 1 + 128 * 0x1p-23f);
    CHECK(moved.y == -1000 + 256 * 0x1p-14f);
    CHECK(moved.z == 0.01f - 0x1p-16f);
}

TEST_CASE("no ray of nook leaves a closed mesh, at any scale and far from zero")
{
    for (const stability::Label& subject : ray_families()[0].cases) {
        const auto misses = [&](const char* algorithm) {
            return value_of("rays-watertight", "misses", subject.name, algorithm);
        };
        CHECK(misses("nook") == 0);
        CHECK(misses("mt-float") > 100);
        CHECK(misses("mt-double") > 10);
        CHECK(misses("woop-float") < misses("mt-float"));
    }
    CHECK(value_of("rays-watertight", "misses", "scale-1e-6", "mt-textbook") == 1e5);
}

TEST_CASE("no ray of nook hits the plane it starts from, and starts stay as low as is known")
{
    const auto hits = [](const std::string& subject, const char* algorithm) {
        return value_of("rays-self-hits", "hits", subject, algorithm);
    };
    const auto height = [](const std::string& subject, const char* algorithm) {
        return value_of("rays-self-hits", "height", subject, algorithm);
    };
    for (const auto& [subject, offset] :
         {std::pair{"points-at-0", 0.}, {"points-at-1e3", 1e3}, {"points-at-1e6", 1e6}}) {
        CHECK(hits(subject, "nook") == 0);
        // A point lies off by half an ulp in each coordinate, at most, and is lifted by one.
        CHECK(height(subject, "nook") > 0);
        CHECK(height(subject, "nook") <= 0x1p-22 * (offset + 2));
        CHECK(hits(subject, "no-offset") > 0.3);
    }
    for (const auto& [subject, distance] : {std::pair{"depth-1", 1.},
                                            {"depth-1e3", 1e3},
                                            {"depth-1e5", 1e5},
                                            {"depth-1e5-away", 1e5}}) {
        CHECK(hits(subject, "nook") == 0);
        CHECK(hits(subject, "nook-faces") == 0);
        // A step of the depth and 2⁻¹² of a pixel; 8 edges to a unit. With faces what double rounds.
        CHECK(height(subject, "nook") > 0);
        CHECK(height(subject, "nook") <= 8 * (0x1p-23 * distance + 1.5 * 0x1p-12 / 27));
        CHECK(height(subject, "nook-faces") >= 0);
        CHECK(height(subject, "nook-faces") <= 0x1p-39 * (distance + 4));
        CHECK(hits(subject, "no-offset") > 0.3);
    }
    // An offset of a fixed size is lost far away; one in ulps jumps over what is near, and does not
    // know of the depth.
    CHECK(height("points-at-0", "fixed-1e-4") == doctest::Approx(1e-4).epsilon(0.01));
    CHECK(hits("points-at-0", "fixed-1e-4") == 0);
    CHECK(hits("points-at-1e6", "fixed-1e-4") > 0.3);
    CHECK(hits("points-at-1e6", "waechter-binder") == 0);
    CHECK(height("points-at-1e6", "waechter-binder") > 10);
    CHECK(hits("depth-1e5", "waechter-binder") > 0.3);
}

TEST_CASE("what a ray lets through is good to two ulps, and a miss lets all through")
{
    for (const stability::Label& subject : ray_families()[2].cases)
        CHECK(value_of("rays-falloff", "error", subject.name, "nook") <=
              (subject.name == "miss" ? 0 : 0x1p-52));
    CHECK(value_of("rays-falloff", "error", "hit-1e-9", "naive-float") >= 1);
    CHECK(value_of("rays-falloff", "error", "hit-1e-9", "naive-double") > 1e-9);
    CHECK(value_of("rays-falloff", "error", "hit-1", "naive-double") < 1e-15);
    for (const char* naive : {"naive-float", "naive-double"})
        CHECK(std::isnan(value_of("rays-falloff", "error", "miss", naive)));
}

TEST_CASE(
    "nook's visibility does not depend on the scale, nor on the place but for the points' own")
{
    const auto change = [](const char* subject, const char* algorithm) {
        return value_of("rays-scale", "largest", subject, algorithm);
    };
    const auto mean = [](const char* subject, const char* algorithm) {
        return value_of("rays-scale", "mean", subject, algorithm);
    };
    for (const char* subject : {"scale-2^-20", "scale-2^20"}) {
        CHECK(change(subject, "nook") == 0);
        CHECK(mean(subject, "nook") == 0);
    }
    // Edges move by the rounding of vertices: a ray or two of 256 at some points.
    for (const char* subject : {"scale-1e-6", "scale-1e6", "offset-1e3"}) {
        CHECK(change(subject, "nook") <= 2 / 256.);
        CHECK(mean(subject, "nook") <= 1e-4);
    }
    // Starts are lifted by an eighth of the fence.
    CHECK(change("offset-1e6", "nook") <= 0.08);
    CHECK(mean("offset-1e6", "nook") <= 0.015);
    for (const char* textbook : {"fixed-1e-4", "waechter-binder"}) {
        for (const char* subject :
             {"scale-2^-20", "scale-2^20", "scale-1e-6", "scale-1e6", "offset-1e6"})
            CHECK(mean(subject, textbook) > 0.05);
        CHECK(mean("offset-1e3", textbook) < 0.01);
    }
}

TEST_CASE("every worst input of rays belongs to a result that is not 0, and no hit of nook is NaN")
{
    for (const stability::Family& family : ray_families()) stability_rows::check_worst(family);
}

TEST_CASE("a worst distance, read back, gives the error of its row")
{
    const stability::Family& family = ray_families()[2];
    int reproduced = 0;
    for (const stability::Row& row : family.rows) {
        if (row.case_name == "miss" || row.worst.empty()) continue;
        CAPTURE(row.case_name);
        CAPTURE(row.algorithm);
        REQUIRE(row.worst_metric == 0);
        const double distance = stability_rows::number_after(row.worst, "distance ");
        const double value = stability_rows::number_after(row.worst, ": ");
        const auto sigma = row.parameters["sigma"].get<double>();
        const double expected = row.algorithm == "nook" ? nook::ExponentialFalloff{sigma}(distance)
                                : row.algorithm == "naive-float"
                                    ? double{1 - std::exp(-static_cast<float>(sigma * distance))}
                                    : 1 - std::exp(-sigma * distance);
        CHECK(value == expected);
        const long double exact = -std::expm1(-static_cast<long double>(sigma * distance));
        CHECK(static_cast<double>(std::fabs(value - exact) / exact) == *row.values[0]);
        ++reproduced;
    }
    CHECK(reproduced >= 10);
}
