#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>

#include "../../examples/stability/stability.hpp"

/// What the tests of all families of stability rows share.
namespace stability_rows {

/// The number that follows the first `mark` in a text, written as a T.
template <class T = double>
T number_after(std::string_view text, std::string_view mark)
{
    const std::size_t at = text.find(mark);
    CAPTURE(text);
    REQUIRE(at != std::string_view::npos);
    T value = 0;
    const auto result =
        std::from_chars(text.data() + at + mark.size(), text.data() + text.size(), value);
    REQUIRE(result.ec == std::errc{});
    return value;
}

/// A worst input is one line about a metric that is not 0, and there is one where anything is wrong;
/// NaN are counted, and nook has none.
inline void check_worst(const stability::Family& family)
{
    CAPTURE(family.label.name);
    const auto nan = std::find_if(family.metrics.begin(), family.metrics.end(),
                                  [](const auto& metric) { return metric.name == "nan"; });
    REQUIRE(nan != family.metrics.end());
    const auto nan_metric = static_cast<std::size_t>(nan - family.metrics.begin());
    for (const stability::Row& row : family.rows) {
        CAPTURE(row.case_name);
        CAPTURE(row.algorithm);
        CAPTURE(row.worst);
        REQUIRE(row.values.at(nan_metric));
        if (row.algorithm.find("nook") != std::string::npos) CHECK(*row.values[nan_metric] == 0);
        if (*row.values[nan_metric] > 0) CHECK_FALSE(row.worst.empty());
        if (row.worst.empty()) continue;
        CHECK(row.worst.size() <= 140);
        CHECK(std::all_of(row.worst.begin(), row.worst.end(),
                          [](char c) { return c >= ' ' && c <= '~'; }));
        const auto value = row.values.at(row.worst_metric);
        REQUIRE(value);
        CHECK_FALSE(*value <= 0);
    }
}

}  // namespace stability_rows
