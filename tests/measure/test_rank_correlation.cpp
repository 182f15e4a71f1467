#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string_view>
#include <vector>

#include <nook/measure/rank_correlation.hpp>

namespace {

using nook::ErrorCode;
using nook::RankCorrelation;

using Values = std::vector<double>;

double spearman(const Values& first, const Values& second)
{
    const RankCorrelation result = nook::spearman(first.data(), second.data(), first.size());
    REQUIRE(result);
    return result.value;
}
double kendall(const Values& first, const Values& second)
{
    const RankCorrelation result = nook::kendall(first.data(), second.data(), first.size());
    REQUIRE(result);
    return result.value;
}

/// Ranks by counting, their correlation by its definition.
double slow_spearman(const Values& first, const Values& second)
{
    const auto ranks = [](const Values& values) {
        std::vector<long double> result;
        for (const double value : values) {
            long double rank = 0;
            for (const double other : values) rank += other < value ? 2 : other == value ? 1 : 0;
            result.push_back(rank - static_cast<long double>(values.size()));
        }
        return result;
    };
    const auto x = ranks(first), y = ranks(second);
    long double xx = 0, yy = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        xx += x[i] * x[i];
        yy += y[i] * y[i];
        xy += x[i] * y[i];
    }
    return xx > 0 && yy > 0 ? static_cast<double>(xy / std::sqrt(xx * yy)) : 0;
}

/// All pairs, by the definition.
double slow_kendall(const Values& first, const Values& second)
{
    const auto sign = [](double a, double b) { return a < b ? -1 : a > b ? 1 : 0; };
    long long sum = 0, one = 0, other = 0;
    for (std::size_t i = 0; i < first.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const int x = sign(first[i], first[j]), y = sign(second[i], second[j]);
            sum += x * y;
            one += x * x;
            other += y * y;
        }
    return one > 0 && other > 0 ? static_cast<double>(sum) / std::sqrt(static_cast<double>(one) *
                                                                       static_cast<double>(other))
                                : 0;
}

/// Of `levels` different values: few make many ties.
Values random_values(std::size_t count, unsigned levels, unsigned seed)
{
    std::mt19937 random{seed};
    Values values(count);
    for (double& value : values) value = (double(random() % levels) - levels / 3.0) * 0.37;
    return values;
}

}  // namespace

TEST_CASE("rank correlations of lists worked out by hand")
{
    // Ranks 1 2 3 4 and 2 1 4 3: 1 − 6 · 4 / 60; four pairs in order, two not.
    CHECK(spearman({1, 10, 100, 1000}, {0.2, 0.1, 0.4, 0.3}) == 0.6);
    CHECK(kendall({1, 10, 100, 1000}, {0.2, 0.1, 0.4, 0.3}) ==
          doctest::Approx(1 / 3.0).epsilon(1e-15));
    // Ties: ranks 1, 2.5, 2.5, 4 against 1 2 3 4: 4.5 / √(4.5 · 5); τ_b is 5 / √(5 · 6).
    CHECK(std::fabs(spearman({1, 2, 2, 3}, {1, 2, 3, 4}) - std::sqrt(0.9)) < 1e-15);
    CHECK(std::fabs(kendall({1, 2, 2, 3}, {1, 2, 3, 4}) - std::sqrt(5 / 6.0)) < 1e-15);
    // Two values each, all four combinations: no relation.
    CHECK(spearman({0, 0, 1, 1}, {0, 1, 0, 1}) == 0);
    CHECK(kendall({0, 0, 1, 1}, {0, 1, 0, 1}) == 0);
    // The same two values in both, ties and all.
    CHECK(spearman({0, 0, 1, 1}, {5, 5, 7, 7}) == 1);
    CHECK(kendall({0, 0, 1, 1}, {5, 5, 7, 7}) == 1);
}

TEST_CASE("the same order is exactly 1, the opposite exactly -1, whatever the numbers")
{
    for (const std::size_t count : {2u, 3u, 4u, 5u, 100u, 1023u, 10000u}) {
        const Values first = random_values(count, 1u << 30, unsigned(count));
        Values same, opposite;
        for (const double value : first) {
            same.push_back(std::exp(value * 1e-9));
            opposite.push_back(-std::cbrt(value));
        }
        CAPTURE(count);
        CHECK(spearman(first, same) == 1);
        CHECK(kendall(first, same) == 1);
        CHECK(spearman(first, opposite) == -1);
        CHECK(kendall(first, opposite) == -1);
    }
}

TEST_CASE("rank correlations are those of their definitions, with and without ties")
{
    for (const unsigned levels : {2u, 3u, 7u, 40u, 1u << 30})
        for (std::size_t count = 1; count <= 70; ++count) {
            const Values first = random_values(count, levels, unsigned(count));
            Values second = random_values(count, levels / 2 + 1, unsigned(count) + 1000);
            if (count % 2 == 0)
                for (std::size_t i = 0; i < count; ++i) second[i] += first[i];
            CAPTURE(levels);
            CAPTURE(count);
            CHECK(std::fabs(spearman(first, second) - slow_spearman(first, second)) < 1e-14);
            CHECK(std::fabs(kendall(first, second) - slow_kendall(first, second)) < 1e-14);
            CHECK(spearman(first, second) == spearman(second, first));
            CHECK(kendall(first, second) == kendall(second, first));
        }
}

TEST_CASE("neither the order of the pairs nor the scale of the values changes a bit")
{
    Values first = random_values(5000, 900, 1), second = random_values(5000, 1u << 30, 2);
    for (std::size_t i = 0; i < first.size(); ++i) second[i] += 1e7 * first[i];
    const double rho = spearman(first, second), tau = kendall(first, second);
    CHECK(rho > 0.1);
    CHECK(rho < 0.9999);
    CHECK(tau > 0.1);
    std::vector<std::size_t> order(first.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), std::mt19937{3});
    Values one, other;
    for (const std::size_t i : order) {
        one.push_back(std::ldexp(first[i], -1000));
        other.push_back(second[i] + 1e9);
    }
    CHECK(spearman(one, other) == rho);
    CHECK(kendall(one, other) == tau);
}

TEST_CASE("independent lists of a million have next to no rank correlation")
{
    // Standard deviations: 1e-3 and two thirds of it.
    const std::size_t count = 1000000;
    const Values first = random_values(count, 1u << 30, 4),
                 second = random_values(count, 1u << 30, 5);
    CHECK(std::fabs(spearman(first, second)) < 5e-3);
    CHECK(std::fabs(kendall(first, second)) < 5e-3);
    CHECK(spearman(first, first) == 1);
}

TEST_CASE("a constant list, one pair and none have rank correlation 0")
{
    for (const Values& second : {Values{1, 2, 3}, Values{4, 4, 4}}) {
        CHECK(spearman({7, 7, 7}, second) == 0);
        CHECK(kendall({7, 7, 7}, second) == 0);
        CHECK(spearman(second, {7, 7, 7}) == 0);
        CHECK(kendall(second, {7, 7, 7}) == 0);
    }
    CHECK(spearman({1}, {2}) == 0);
    CHECK(kendall({1}, {2}) == 0);
    const RankCorrelation none = nook::kendall<float, float>(nullptr, nullptr, 0);
    CHECK(none);
    CHECK(none.value == 0);
    CHECK(none.pairs == 0);
    CHECK(nook::spearman<float, double>(nullptr, nullptr, 0));
}

TEST_CASE("pairs with a NaN are left out and counted, infinities are numbers, zeros have no sign")
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    const Values first{1, nan, 2, -infinity, 3, -nan, infinity, 0.0, -0.0};
    const Values second{1, 5, nan, -9, 3, nan, 8, -0.5, -0.5};
    const Values kept_first{1, -infinity, 3, infinity, 0, 0};
    const Values kept_second{1, -9, 3, 8, -0.5, -0.5};
    for (const bool tau : {false, true}) {
        const auto measured = [&](const Values& one, const Values& other) {
            return tau ? nook::kendall(one.data(), other.data(), one.size())
                       : nook::spearman(one.data(), other.data(), one.size());
        };
        const RankCorrelation result = measured(first, second);
        REQUIRE(result);
        CHECK(result.value == 1);
        CHECK(result.pairs == 6);
        CHECK(result.left_out == 3);
        CHECK(measured(kept_first, kept_second).value == 1);
        const RankCorrelation nothing = measured({nan, nan, 1}, {1, 2, nan});
        REQUIRE(nothing);
        CHECK(nothing.value == 0);
        CHECK(nothing.pairs == 0);
        CHECK(nothing.left_out == 3);
    }
}

TEST_CASE("rank correlations compare lists of different types")
{
    const std::array<float, 4> floats{0.1f, 0.2f, 0.3f, 0.4f};
    const std::array<std::uint8_t, 4> bytes{3, 7, 8, 200};
    CHECK(nook::spearman(floats.data(), bytes.data(), 4).value == 1);
    CHECK(nook::kendall(bytes.data(), floats.data(), 4).value == 1);
}

TEST_CASE("exactly the stated scratch is enough for rank correlations, unaligned too")
{
    const Values first = random_values(77, 9, 6), second = random_values(77, 12, 7);
    const std::size_t sizes[] = {nook::spearman_scratch_size(77), nook::kendall_scratch_size(77)};
    std::vector<std::byte> block(std::max(sizes[0], sizes[1]) + 1);
    const auto rho =
        nook::spearman(first.data(), second.data(), 77, nook::Scratch{block.data() + 1, sizes[0]});
    const auto tau =
        nook::kendall(first.data(), second.data(), 77, nook::Scratch{block.data() + 1, sizes[1]});
    REQUIRE(rho);
    REQUIRE(tau);
    CHECK(rho.value == spearman(first, second));
    CHECK(tau.value == kendall(first, second));
    const auto small =
        nook::kendall(first.data(), second.data(), 77, nook::Scratch{block.data(), sizes[1] - 1});
    CHECK(small.error.code == ErrorCode::scratch_too_small);
    CHECK(small.error.value == double(sizes[1]));
    CHECK(nook::spearman(first.data(), second.data(), 77, nook::Scratch{}).error.code ==
          ErrorCode::scratch_too_small);
}

TEST_CASE("bad arguments of rank correlations are named")
{
    const std::array<double, 2> values{1, 2};
    const double* const none = nullptr;
    auto result = nook::spearman(none, values.data(), 2);
    CHECK(result.error.code == ErrorCode::null_data);
    CHECK(std::string_view{result.error.argument} == "first");
    result = nook::kendall(values.data(), none, 2);
    CHECK(result.error.code == ErrorCode::null_data);
    CHECK(std::string_view{result.error.argument} == "second");
    result = nook::kendall(values.data(), values.data(), std::size_t{1} << 31);
    CHECK(result.error.code == ErrorCode::bad_size);
    CHECK(std::string_view{result.error.argument} == "count");
}
