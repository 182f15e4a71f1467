#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "../../examples/stability/stability.hpp"
#include "stability_rows.hpp"

namespace {

/// Computed once for all tests of this file.
const stability::Family& obscurance()
{
    static const stability::Family family = stability::surface_obscurance();
    return family;
}
const stability::Family& slices()
{
    static const stability::Family family = stability::surface_slices();
    return family;
}
const stability::Family& height_field()
{
    static const stability::Family family = stability::surface_height_field();
    return family;
}
const stability::Family& blur()
{
    static const stability::Family family = stability::surface_blur();
    return family;
}
const stability::Family& upsampling()
{
    static const stability::Family family = stability::surface_upsampling();
    return family;
}

std::optional<double> value_of(const stability::Family& family, std::string_view metric,
                               std::string_view subject, std::string_view algorithm)
{
    CAPTURE(subject);
    CAPTURE(algorithm);
    for (std::size_t i = 0; i < family.metrics.size(); ++i)
        for (const stability::Row& row : family.rows)
            if (family.metrics[i].name == metric && row.case_name == subject &&
                row.algorithm == algorithm)
                return row.values.at(i);
    FAIL("no such row");
    return {};
}
double number(const stability::Family& family, std::string_view metric, std::string_view subject,
              std::string_view algorithm)
{
    const auto value = value_of(family, metric, subject, algorithm);
    REQUIRE(value);
    return *value;
}

constexpr std::string_view formulas[] = {"alchemy", "scalable"};
std::string name(std::string_view formula, const char* way) { return std::string{formula} + way; }

}  // namespace

TEST_CASE("rows of surfaces: labels for all, each case and algorithm once")
{
    for (const stability::Family* family :
         {&obscurance(), &slices(), &height_field(), &blur(), &upsampling()}) {
        stability_rows::check_worst(*family);
        const auto has = [](const std::vector<stability::Label>& labels, const std::string& label) {
            return std::count_if(labels.begin(), labels.end(), [&](const stability::Label& other) {
                       return other.name == label && !other.what.empty();
                   }) == 1;
        };
        std::set<std::pair<std::string, std::string>> seen;
        for (const stability::Row& row : family->rows) {
            CHECK(has(family->cases, row.case_name));
            CHECK(has(family->algorithms, row.algorithm));
            CHECK(seen.emplace(row.case_name, row.algorithm).second);
            CHECK_FALSE(row.parameters.empty());
            REQUIRE(row.values.size() == family->metrics.size());
            CHECK(std::any_of(row.values.begin(), row.values.end(),
                              [](const auto& value) { return value.has_value(); }));
        }
        CHECK(seen.size() == family->cases.size() * family->algorithms.size());
    }
}

TEST_CASE("obscurance of nook is good to 1e-6 at every depth and radius, and on flat ground exact")
{
    for (const std::string_view formula : formulas)
        for (const stability::Label& subject : obscurance().cases) {
            CAPTURE(subject.name);
            const bool flat = subject.name.starts_with("flat");
            const std::string nook = name(formula, "-nook");
            if (flat) CHECK(number(obscurance(), "biased-darkening", subject.name, nook) == 0);
            else CHECK(number(obscurance(), "error", subject.name, nook) < 1e-6);
            CHECK(value_of(obscurance(), flat ? "error" : "darkening", subject.name, nook) ==
                  std::nullopt);
        }
}

TEST_CASE("the bias of nook costs no more than the depth buffer holds, a fixed one all relief")
{
    for (const std::string_view formula : formulas) {
        for (const char* const subject : {"relief", "radius-1e7", "radius-1e-7", "silhouette"}) {
            CHECK(number(obscurance(), "biased", subject, name(formula, "-nook")) < 3e-4);
            CHECK(number(obscurance(), "biased", subject, name(formula, "-double")) > 0.01);
        }
        CHECK(number(obscurance(), "biased", "depth-1e3", name(formula, "-nook")) < 0.01);
        CHECK(number(obscurance(), "biased", "depth-1e5", name(formula, "-nook")) < 0.7);
        CHECK(number(obscurance(), "biased", "depth-1e5", name(formula, "-double")) > 0.9);
        for (const char* const subject : {"flat-1e5", "flat-d16"})
            CHECK(number(obscurance(), "darkening", subject, name(formula, "-nook")) > 1e-3);
    }
}

TEST_CASE("textbook obscurance fails where positions are large and where powers leave float")
{
    for (const std::string_view formula : formulas)
        CHECK(number(obscurance(), "error", "aside-1e5", name(formula, "-float")) > 0.01);
    for (const char* const subject : {"radius-1e7", "radius-1e-9"})
        CHECK(std::isnan(number(obscurance(), "error", subject, "scalable-float")));
    CHECK(number(obscurance(), "error", "radius-1e-7", "scalable-float") > 1e-4);
    // On gentle data they are fine. Where a compiler contracts the textbook's products to FMA, those of one
    // point are rounded and those of the other are not: 2e-4.
    for (const stability::Label& algorithm : obscurance().algorithms) {
        CAPTURE(algorithm.name);
        const bool textbook = algorithm.name.ends_with("-float");
        CHECK(number(obscurance(), "error", "relief", algorithm.name) < (textbook ? 1e-3 : 1e-5));
    }
}

TEST_CASE("slices of nook keep to their reference at every depth and radius; flat ground is exact")
{
    for (const char* const nook : {"horizon-nook", "bitmask-nook"})
        for (const stability::Label& subject : slices().cases) {
            CAPTURE(subject.name);
            CAPTURE(nook);
            if (subject.name.starts_with("flat")) {
                CHECK(number(slices(), "biased-darkening", subject.name, nook) == 0);
                continue;
            }
            // A sample that ends on the middle of a sector may close one more, of 96.
            const bool sectors = nook == std::string_view{"bitmask-nook"};
            CHECK(number(slices(), "error", subject.name, nook) < (sectors ? 2.1 / 96 : 1e-5));
            CHECK(number(slices(), "mean", subject.name, nook) < 1e-5);
        }
}

TEST_CASE("the bias of nook's slices costs little; shaders' costs all where the depth is large")
{
    for (const std::string name : {"horizon", "bitmask"}) {
        CHECK(number(slices(), "biased", "depth-1e5", name + "-nook") < 0.02);
        CHECK(number(slices(), "biased", "depth-1e5", name + "-double") > 0.3);
        // And does not keep flat ground open.
        CHECK(number(slices(), "biased-darkening", "flat-85", name + "-double") > 0.05);
        CHECK(number(slices(), "error", "aside-1e5", name + "-float") > 0.02);
        // On gentle data they are sound.
        CHECK(number(slices(), "mean", "relief", name + "-float") < 1e-3);
        CHECK(number(slices(), "mean", "relief", name + "-double") < 1e-5);
    }
}

TEST_CASE("the height field is the same at all radii and exactly open on flat ground of all tilts")
{
    for (const stability::Label& subject : height_field().cases) {
        CAPTURE(subject.name);
        if (subject.name.starts_with("flat"))
            CHECK(number(height_field(), "darkening", subject.name, "nook") == 0);
    }
    for (const char* const subject : {"relief", "radius-1e7", "radius-1e-7", "radius-1e-9"})
        CHECK(number(height_field(), "error", subject, "nook") < 1e-4);
    CHECK(number(height_field(), "error", "silhouette", "nook") < 1e-3);
    // What the depth buffer no longer holds.
    CHECK(number(height_field(), "error", "depth-1e5", "nook") < 0.15);
    CHECK(number(height_field(), "error", "depth-1e5", "nook") > 1e-3);
    CHECK(number(height_field(), "darkening", "flat-85", "marched-double") > 0.5);
}

TEST_CASE("a blur beside the sky changes neither it nor the ground, unless it is a textbook's")
{
    for (const stability::Label& sky : blur().cases)
        for (const char* const metric : {"ground", "sky"}) {
            CAPTURE(sky.name);
            CHECK(number(blur(), metric, sky.name, "nook") == 0);
            CHECK(number(blur(), metric, sky.name, "gaussian") > 0.1);
        }
    CHECK(std::isnan(number(blur(), "sky", "sky-infinity", "gaussian-range")));
    CHECK(std::isnan(number(blur(), "ground", "sky-nan", "gaussian-range")));
}

TEST_CASE("half the resolution beside the sky changes neither it nor the ground, unless averaged")
{
    for (const stability::Label& sky : upsampling().cases)
        for (const char* const metric : {"ground", "sky"}) {
            CAPTURE(sky.name);
            CHECK(number(upsampling(), metric, sky.name, "nook") == 0);
            CHECK(number(upsampling(), metric, sky.name, "bilinear") > 0.1);
        }
    CHECK(std::isnan(number(upsampling(), "sky", "sky-infinity", "gaussian-range")));
    CHECK(number(upsampling(), "nan", "sky-nan", "gaussian-range") > 1000);
}

TEST_CASE("the worst pixel of a surface is told with what came out there and what is true")
{
    for (const stability::Family* family : {&obscurance(), &slices(), &height_field(), &blur()})
        for (const stability::Row& row : family->rows) {
            if (row.worst.empty() || family->metrics[row.worst_metric].name == "nan") continue;
            CAPTURE(row.worst);
            const double found = stability_rows::number_after(row.worst, ": ");
            const double truth = stability_rows::number_after(row.worst, " for ");
            CHECK(std::fabs(found - truth) == *row.values[row.worst_metric]);
        }
}
