#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>

#include <nook/scene/generalised_information.hpp>
#include <nook/thread_executor.hpp>

#include "channels.hpp"

namespace {

using channels::Areas;
using channels::Values;
using nook::ViewpointChannel;

Values of_polygons(const ViewpointChannel& channel, double alpha)
{
    Values result(channel.polygon_count());
    REQUIRE(nook::generalised_polygon_information(channel, alpha, result.data()));
    return result;
}
Values of_views(const ViewpointChannel& channel, double alpha)
{
    Values result(channel.view_count());
    REQUIRE(nook::generalised_viewpoint_information(channel, alpha, result.data()));
    return result;
}
double of_both(const ViewpointChannel& channel, double alpha)
{
    double result = -1;
    REQUIRE(nook::generalised_mutual_information(channel, alpha, result));
    return result;
}

TEST_CASE("order 2 of three polygons and two viewpoints by hand")
{
    const ViewpointChannel channel = Areas{2, 3, {2, 1, 1, 0, 2, 2}}.channel();
    const double unit = 1 / std::numbers::ln2;
    const Values pmi = of_polygons(channel, 2), vmi = of_views(channel, 2);
    CHECK(std::fabs(pmi[0] - unit) < 1e-14);
    CHECK(std::fabs(pmi[1] - unit / 9) < 1e-14);
    CHECK(std::fabs(pmi[2] - unit / 9) < 1e-14);
    CHECK(std::fabs(vmi[0] - unit / 3) < 1e-14);
    CHECK(std::fabs(vmi[1] - unit / 3) < 1e-14);
    CHECK(std::fabs(of_both(channel, 2) - unit / 3) < 1e-14);
}

TEST_CASE("every order is what its definition says, from both sides")
{
    std::mt19937 random{71};
    const ViewpointChannel channel = channels::random_areas(random, 14, 60, 0.4).channel();
    for (const double alpha : {0.1, 0.5, 0.999, 1.5, 3.0, 12.0}) {
        double sum = 0, most = 0;
        for (std::size_t o = 0; o < 60; ++o)
            channel.for_each_view(o, [&](std::size_t v, double, double q) {
                const double independent = channel.p_view(v) * channel.p_polygon(o);
                const double term = std::pow(q, alpha) * std::pow(independent, 1 - alpha);
                sum += term;
                most += term;
            });
        const double expected = (sum - 1) / ((alpha - 1) * std::numbers::ln2);
        const double rounding = 1e-14 * (most + 1) / std::fabs(alpha - 1) * (1 + alpha);
        CAPTURE(alpha);
        CHECK(std::fabs(of_both(channel, alpha) - expected) < rounding);
        double by_polygons = 0, by_views = 0;
        const Values pmi = of_polygons(channel, alpha), vmi = of_views(channel, alpha);
        for (std::size_t o = 0; o < 60; ++o) by_polygons += channel.p_polygon(o) * pmi[o];
        for (std::size_t v = 0; v < 14; ++v) by_views += channel.p_view(v) * vmi[v];
        CHECK(std::fabs(by_polygons - expected) < rounding);
        CHECK(std::fabs(by_views - expected) < rounding);
    }
}

TEST_CASE("order 1 is Shannon's, and orders close to 1 come close to it")
{
    std::mt19937 random{72};
    const ViewpointChannel channel = channels::random_areas(random, 30, 80, 0.3).channel();
    const Values pmi = channels::pmi(channel), vmi = channels::vmi(channel);
    CHECK(of_polygons(channel, 1) == pmi);
    CHECK(of_views(channel, 1) == vmi);
    const double information = channels::entropies(channel).information_by_polygons;
    CHECK(std::fabs(of_both(channel, 1) - information) < 1e-14);
    // The derivative in the order is the mean of ln 2 log2(r)² / 2: a few units.
    for (const double alpha : {1 - 1e-9, 1 + 1e-9}) {
        CHECK(channels::largest_difference(of_polygons(channel, alpha), pmi) < 1e-7);
        CHECK(channels::largest_difference(of_views(channel, alpha), vmi) < 1e-7);
        CHECK(std::fabs(of_both(channel, alpha) - information) < 1e-7);
    }
    // No cancellation, at the last orders before 1 either.
    for (const double alpha : {1 - 0x1p-53, 1 + 0x1p-52})
        CHECK(channels::largest_difference(of_polygons(channel, alpha), pmi) < 1e-13);
}

TEST_CASE("information grows with the order, is never negative, and never NaN")
{
    std::mt19937 random{73};
    const ViewpointChannel channel = channels::random_areas(random, 25, 40, 0.1).channel();
    Values before(40, 0.0);
    for (const double alpha : {1e-300, 1e-3, 0.3, 0.9, 1.0, 1.1, 2.0, 5.0, 50.0}) {
        const Values now = of_polygons(channel, alpha);
        for (std::size_t o = 0; o < 40; ++o) CHECK(now[o] >= before[o] - 1e-12 * (1 + before[o]));
        before = now;
    }
    // Out of range: nothing below 0.
    for (const double value : of_polygons(channel, 1e6)) CHECK(value >= 0);
    for (const double value : of_views(channel, 1e6)) CHECK(value >= 0);
}

TEST_CASE("a viewpoint that alone sees a polygon: (p(v)^(1 - alpha) - 1) / ((alpha - 1) ln 2)")
{
    const ViewpointChannel channel = Areas{
        4,
        4,
        {1, 0, 0, 0, 0, 1, 0, 0,  //
         0, 0, 1, 0, 0, 0, 0, 1}}.channel();
    for (const double alpha : {0.5, 2.0, 3.0})
        for (const double value : of_polygons(channel, alpha))
            CHECK(std::fabs(value - (std::pow(4, alpha - 1) - 1) /
                                        ((alpha - 1) * std::numbers::ln2)) < 1e-13);
}

TEST_CASE("orders that are not finite and positive are errors, and threads change no bit")
{
    const ViewpointChannel channel = Areas{1, 2, {1, 2}}.channel();
    Values values{7, 7};
    double information = 7;
    for (const double alpha : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN()}) {
        for (const nook::Error& error :
             {nook::generalised_polygon_information(channel, alpha, values.data()).error,
              nook::generalised_viewpoint_information(channel, alpha, values.data()).error,
              nook::generalised_mutual_information(channel, alpha, information).error}) {
            CHECK(error.code == nook::ErrorCode::bad_value);
            CHECK(doctest::String{error.argument} == "alpha");
        }
        CHECK(values == Values{7, 7});
        CHECK(information == 7);
    }
    CHECK(nook::generalised_polygon_information(channel, 2, nullptr).error.code ==
          nook::ErrorCode::null_data);
    CHECK(of_both(ViewpointChannel{}, 2) == 0);

    std::mt19937 random{74};
    const ViewpointChannel many = channels::random_areas(random, 20, 3000, 0.2).channel();
    const auto answers = [&](int threads) {
        nook::ThreadExecutor executor{threads};
        Values result(3020);
        REQUIRE(nook::generalised_polygon_information(many, 1.7, result.data(), executor));
        REQUIRE(nook::generalised_viewpoint_information(many, 1.7, result.data() + 3000,
                                                        nook::HeapScratch{}, executor));
        double all = 0;
        REQUIRE(nook::generalised_mutual_information(many, 1.7, all, executor));
        result.push_back(all);
        return result;
    };
    CHECK(answers(1) == answers(3));
}

}  // namespace
