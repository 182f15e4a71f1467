#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "../../examples/stability/stability.hpp"
#include "stability_rows.hpp"

namespace {

/// Computed once for all tests of this file.
const stability::Family& information()
{
    static const stability::Family family = stability::information();
    return family;
}

std::optional<double> value_of(std::string_view metric, std::string_view subject,
                               std::string_view algorithm)
{
    CAPTURE(metric);
    CAPTURE(subject);
    CAPTURE(algorithm);
    const stability::Family& family = information();
    for (std::size_t i = 0; i < family.metrics.size(); ++i)
        for (const stability::Row& row : family.rows)
            if (family.metrics[i].name == metric && row.case_name == subject &&
                row.algorithm == algorithm)
                return row.values.at(i);
    FAIL("no such row");
    return {};
}
double number(std::string_view metric, std::string_view subject, std::string_view algorithm)
{
    const auto value = value_of(metric, subject, algorithm);
    REQUIRE(value);
    return *value;
}

constexpr std::string_view exact_areas[] = {"cube",      "tetrahedron", "full-pictures", "million",
                                            "one-pixel", "blind-view",  "inner-cube"};

}  // namespace

TEST_CASE("rows of information: labels for all, each case and algorithm once")
{
    const stability::Family& family = information();
    const auto has = [](const std::vector<stability::Label>& labels, const std::string& label) {
        return std::count_if(labels.begin(), labels.end(), [&](const stability::Label& other) {
                   return other.name == label && !other.what.empty();
               }) == 1;
    };
    std::set<std::pair<std::string, std::string>> seen;
    for (const stability::Row& row : family.rows) {
        CHECK(has(family.cases, row.case_name));
        CHECK(has(family.algorithms, row.algorithm));
        CHECK(seen.emplace(row.case_name, row.algorithm).second);
        CHECK_FALSE(row.parameters.empty());
        REQUIRE(row.values.size() == family.metrics.size());
        CHECK(std::any_of(row.values.begin(), row.values.end(),
                          [](const auto& value) { return value.has_value(); }));
    }
    for (const stability::Label& subject : family.cases)
        for (const char* const algorithm : {"textbook-float", "textbook-double", "nook"})
            CHECK(seen.contains({subject.name, algorithm}));
}

TEST_CASE("nook's channel is right to rounding and adds up to 1 within 1e-12, without a NaN")
{
    for (const std::string_view subject : exact_areas) {
        CAPTURE(subject);
        CHECK(number("total", subject, "nook") < 1e-14);
        CHECK(number("sum", subject, "nook") < 1e-12);
        CHECK(number("information", subject, "nook") < 1e-12);
        CHECK(number("map", subject, "nook") < 1e-6);
        CHECK(number("lost", subject, "nook") == 0);
        CHECK(number("nan", subject, "nook") == 0);
    }
    // Where all polygons are alike they are white, exactly.
    for (const char* const subject : {"cube", "tetrahedron", "blind-view", "inner-cube"})
        CHECK(number("map", subject, "nook") == 0);
}

TEST_CASE("a plain minimum and maximum make a full range of rounding noise")
{
    for (const char* const subject : {"cube", "tetrahedron"})
        for (const char* const algorithm : {"textbook-float", "textbook-double"})
            CHECK(!(number("map", subject, algorithm) < 0.99));
}

TEST_CASE("32-bit sums of pixels overflow, float sums of a million lose digits")
{
    CHECK(number("total", "full-pictures", "textbook-32-bit") > 0.7);
    CHECK(number("sum", "full-pictures", "textbook-32-bit") > 3);
    CHECK(number("information", "full-pictures", "textbook-32-bit") > 2);
    CHECK(number("sum", "million", "textbook-float") > 1e-6);
    CHECK(number("sum", "million", "textbook-double") < 1e-12);
}

TEST_CASE("the formulas as printed make NaN of views that see nothing and polygons that none sees")
{
    for (const char* const algorithm : {"textbook-float", "textbook-double"}) {
        CHECK(number("nan", "blind-view", algorithm) == 6);
        CHECK(number("nan", "inner-cube", algorithm) >= 6);
        CHECK(number("nan", "one-pixel", algorithm) >= 999999);
        CHECK(value_of("information", "blind-view", algorithm) == std::nullopt);
    }
}

TEST_CASE("triangles below a pixel look too dark, unless the resolution follows the mesh")
{
    CHECK(number("bias", "small-triangles", "textbook-double") > 0.2);
    CHECK(number("information", "small-triangles", "textbook-double") > 1);
    CHECK(number("bias", "small-triangles", "nook") < 0.02);
    CHECK(number("information", "small-triangles", "nook") < 0.3);
    CHECK(number("lost", "small-triangles", "textbook-double") > 0);
    CHECK(number("lost", "small-triangles", "nook") == 0);
    CHECK(number("nan", "small-triangles", "nook") == 0);
}

TEST_CASE("worst polygons are told where they differ, the first NaN where there is one")
{
    for (const stability::Row& row : information().rows) {
        CAPTURE(row.case_name);
        CAPTURE(row.algorithm);
        CAPTURE(row.worst);
        const bool has_nan = *row.values.back() > 0;
        if (has_nan) CHECK(information().metrics[row.worst_metric].name == "nan");
        if (row.algorithm == "nook") CHECK_FALSE(has_nan);
        if (!row.worst.empty()) CHECK(row.worst.starts_with("polygon "));
        if (!row.worst.empty() && !has_nan) {
            const double error = std::fabs(stability_rows::number_after(row.worst, ": ") -
                                           stability_rows::number_after(row.worst, " for "));
            CHECK(error == *row.values[row.worst_metric]);
        }
    }
}
