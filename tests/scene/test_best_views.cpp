#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string_view>
#include <vector>

#include <nook/scene/best_views.hpp>
#include <nook/thread_executor.hpp>

namespace {

using nook::BestView;

nook::ViewpointChannel channel_of(const std::vector<double>& areas, std::size_t views)
{
    nook::ViewpointChannel channel;
    REQUIRE_FALSE(channel.build(areas.data(), views, areas.size() / views));
    return channel;
}

/// Areas of a channel where a part of the pairs see each other.
std::vector<double> random_areas(std::mt19937& random, std::size_t views, std::size_t polygons)
{
    std::uniform_real_distribution<double> unit{-1, 1};
    std::vector<double> areas(views * polygons);
    for (double& a : areas) a = (std::max)(unit(random), 0.0);
    return areas;
}

/// The sides of a cube of edge 1 as seen from its face axes (0 to 5: ±x, ±y, ±z) and corners (6 to 13;
/// 6 + i and 13 − i are opposite).
nook::ViewpointChannel cube()
{
    std::vector<double> areas;
    for (int view = 0; view < 14; ++view)
        for (int side = 0; side < 6; ++side) {
            const int axis = side / 2, sign = side % 2;
            const bool front = view < 6 ? view == side : ((view - 6) >> axis & 1) == sign;
            areas.push_back(front ? (view < 6 ? 1 : 1 / std::sqrt(3.0)) : 0);
        }
    return channel_of(areas, 14);
}

std::vector<BestView> best(const nook::ViewpointChannel& channel,
                           const nook::BestViewsOptions& options)
{
    std::vector<BestView> chosen((std::min)(options.count, channel.view_count()));
    std::size_t found = 99;
    REQUIRE(nook::best_views(channel, chosen.data(), &found, options));
    REQUIRE(found <= chosen.size());
    chosen.resize(found);
    return chosen;
}

std::vector<BestView> ranking(const nook::ViewpointChannel& channel,
                              const double* saliency = nullptr)
{
    std::vector<BestView> ranked(channel.view_count());
    std::size_t found = 99;
    REQUIRE(nook::rank_views(channel, ranked.data(), &found, saliency));
    REQUIRE(found <= ranked.size());
    ranked.resize(found);
    return ranked;
}

/// KL(p(O|v) ‖ target), from the definition; infinite where a polygon without target is seen.
double divergence(const nook::ViewpointChannel& channel, std::size_t v,
                  const std::vector<double>& target)
{
    double sum = 0;
    for (std::size_t o = 0; o < target.size(); ++o)
        if (const double p = channel.p_polygon_given_view(o, v); p > 0)
            sum += p * std::log2(p / target[o]);
    return sum;
}

bool less_or_same(double a, double b) { return a <= b + 1e-12; }

}  // namespace

TEST_CASE("a cube is best seen from a corner and then from the opposite one")
{
    const auto channel = cube();
    for (const auto probability :
         {nook::ViewProbability::projected_area, nook::ViewProbability::uniform}) {
        auto other = cube();
        REQUIRE_FALSE(other.set_probability(probability));
        const auto ranked = ranking(other);
        REQUIRE(ranked.size() == 14);
        for (std::size_t i = 0; i < 14; ++i) {
            // Corners in order, then face axes in order.
            CHECK(ranked[i].view == (i < 8 ? 6 + i : i - 8));
            CHECK(std::fabs(ranked[i].information - (i < 8 ? 1 : 2.584962500721156)) < 1e-13);
            CHECK(std::fabs(ranked[i].probability - other.p_view(ranked[i].view)) < 1e-15);
        }
        const auto two = best(other, {.count = 2});
        REQUIRE(two.size() == 2);
        CHECK(two[0].view == 6);
        CHECK(std::fabs(two[0].information - 1) < 1e-13);
        CHECK(two[1].view == 13);
        CHECK(two[1].information < 1e-13);
        CHECK(std::fabs(two[1].probability - 2 * other.p_view(6)) < 1e-15);
    }
    // Two views tell it all: any share is enough then.
    CHECK(best(channel, {.count = 14, .share = 1e-9}).size() == 2);
    CHECK(best(channel, {.count = 14, .share = 1}).size() == 1);
    CHECK(best(channel, {.count = 14}).size() == 14);
}

TEST_CASE("three polygons and two views are as by hand")
{
    const auto channel = channel_of({2, 1, 1, 0, 2, 2}, 2);
    const auto ranked = ranking(channel);
    REQUIRE(ranked.size() == 2);
    CHECK(ranked[0].view == 0);
    CHECK(ranked[1].view == 1);
    CHECK(std::fabs(ranked[0].information - 0.20751874963942) < 1e-14);
    CHECK(std::fabs(ranked[1].information - 0.41503749927884) < 1e-14);
    CHECK(ranked[1].probability == 0.5);
    const auto all = best(channel, {});
    REQUIRE(all.size() == 2);
    CHECK(all[0].view == 0);
    CHECK(all[1].information < 1e-15);
    CHECK(all[1].probability == 1);
}

TEST_CASE("each step takes the view that leaves least, by the definition")
{
    std::mt19937 random{4};
    const std::size_t views = 12, polygons = 700;
    std::vector<double> areas = random_areas(random, views, polygons);
    // Views of a different reach, one of them blind.
    for (std::size_t v = 0; v < views; ++v)
        for (std::size_t o = 0; o < polygons; ++o)
            areas[v * polygons + o] *= v == 3 || (o / 50) % views < v / 2 ? 0 : 1.0 + double(v);
    auto channel = channel_of(areas, views);
    std::vector<double> importance(views, 1), saliency(polygons);
    importance[7] = 0;
    REQUIRE_FALSE(channel.set_probability(nook::ViewProbability::importance, importance.data()));
    std::uniform_real_distribution<double> unit;
    for (double& s : saliency) s = unit(random);

    for (const bool with : {false, true}) {
        const double* const s = with ? saliency.data() : nullptr;
        const auto chosen = best(channel, {.count = 20, .saliency = s});
        REQUIRE(chosen.size() == 10);
        std::vector<std::uint32_t> set;
        double probability = 0;
        for (const BestView& view : chosen) {
            CHECK(view.view != 3);
            CHECK(view.view != 7);
            CHECK(std::find(set.begin(), set.end(), view.view) == set.end());
            for (std::uint32_t v = 0; v < views; ++v) {
                if (v == 3 || v == 7 || std::find(set.begin(), set.end(), v) != set.end()) continue;
                set.push_back(v);
                const double left = nook::merged_information(channel, set.data(), set.size(), s);
                CHECK(less_or_same(view.information, left));
                if (v == view.view) CHECK(std::fabs(view.information - left) < 1e-12);
                set.pop_back();
            }
            set.push_back(view.view);
            probability += channel.p_view(view.view);
            CHECK(std::fabs(view.probability - probability) < 1e-14);
        }
        if (s == nullptr) CHECK(chosen.back().information < 1e-13);
        // The first is the best of the ranking.
        const auto ranked = ranking(channel, s);
        CHECK(ranked.size() == 10);
        CHECK(ranked[0].view == chosen[0].view);
        CHECK(ranked[0].information == chosen[0].information);
    }
}

TEST_CASE("the ranking is by viewpoint mutual information, and with saliency by the extended one")
{
    std::mt19937 random{9};
    const auto channel = channel_of(random_areas(random, 15, 60), 15);
    std::vector<double> saliency(60), plain, extended;
    double sum = 0;
    for (std::size_t o = 0; o < 60; ++o) {
        saliency[o] = 0.1 + double(o % 7);
        sum += channel.p_polygon(o) * saliency[o];
    }
    for (std::size_t o = 0; o < 60; ++o) {
        plain.push_back(channel.p_polygon(o));
        extended.push_back(channel.p_polygon(o) * saliency[o] / sum);
    }
    for (const bool with : {false, true}) {
        const auto ranked = ranking(channel, with ? saliency.data() : nullptr);
        REQUIRE(ranked.size() == 15);
        double information = 0;
        for (std::size_t i = 0; i < 15; ++i) {
            const double expected = divergence(channel, ranked[i].view, with ? extended : plain);
            CHECK(std::fabs(ranked[i].information - expected) < 1e-12);
            if (i > 0) CHECK(less_or_same(ranked[i - 1].information, ranked[i].information));
            information += ranked[i].probability * ranked[i].information;
        }
        // Σ p(v) VMI(v) is I(V;O).
        double mutual = 0;
        for (std::size_t o = 0; o < 60 && !with; ++o)
            channel.for_each_view(o, [&](std::size_t v, double, double q) {
                mutual += q * std::log2(q / channel.p_view(v) / channel.p_polygon(o));
            });
        if (!with) CHECK(std::fabs(information - mutual) < 1e-12);
    }
    // Where all matter the same nothing changes, however much that is.
    for (const double same : {0.0, 1e-318, 0.7, 1e300}) {
        const std::vector<double> all(60, same);
        const auto ranked = ranking(channel, all.data()), expected = ranking(channel);
        for (std::size_t i = 0; i < 15; ++i) {
            CHECK(ranked[i].view == expected[i].view);
            CHECK(std::fabs(ranked[i].information - expected[i].information) < 1e-12);
        }
    }
}

TEST_CASE("polygons that do not matter are as if they were not there")
{
    std::mt19937 random{6};
    const std::size_t views = 8, polygons = 40;
    std::vector<double> areas = random_areas(random, views, polygons), saliency(polygons, 2), kept;
    for (std::size_t o = 0; o < polygons; ++o)
        if (o % 3 == 0) saliency[o] = 0;
    // View 5 sees nothing else.
    for (std::size_t o = 0; o < polygons; ++o) areas[5 * polygons + o] = o % 3 != 0 ? 0 : 1;
    for (std::size_t v = 0; v < views; ++v)
        for (std::size_t o = 0; o < polygons; ++o)
            if (o % 3 != 0) kept.push_back(areas[v * polygons + o]);
    const auto channel = channel_of(areas, views), without = channel_of(kept, views);
    const auto chosen = best(channel, {.count = 8, .saliency = saliency.data()});
    const auto expected = best(without, {.count = 8});
    REQUIRE(chosen.size() == 7);
    REQUIRE(expected.size() == 7);
    for (std::size_t i = 0; i < 7; ++i) {
        CHECK(chosen[i].view == expected[i].view);
        CHECK(std::fabs(chosen[i].information - expected[i].information) < 1e-12);
        CHECK(std::fabs(chosen[i].probability - expected[i].probability) < 1e-13);
    }
    for (const BestView& view : ranking(channel, saliency.data())) CHECK(view.view != 5);
    // Next to nothing is nothing: its logarithm would outweigh all others.
    saliency[0] = 1e-310;
    for (const BestView& view : ranking(channel, saliency.data())) CHECK(view.view != 5);
    saliency[0] = 1e-200;
    const auto ranked = ranking(channel, saliency.data());
    CHECK(ranked.size() == 8);
    for (const BestView& view : ranked) CHECK(view.information < 1000);
}

TEST_CASE("a share of the information ends the choice at the first view that reaches it")
{
    std::mt19937 random{12};
    const auto channel = channel_of(random_areas(random, 25, 300), 25);
    const auto all = best(channel, {.count = 25});
    double whole = 0;
    for (const BestView& view : ranking(channel)) whole += view.probability * view.information;
    for (const double share : {0.9, 0.5, 0.2, 0.05}) {
        const auto some = best(channel, {.count = 25, .share = share});
        std::size_t expected = 0;
        while (all[expected].information > share * whole) ++expected;
        CHECK(some.size() == expected + 1);
        CHECK(best(channel, {.count = 2, .share = share}).size() ==
              (std::min)(expected + 1, std::size_t{2}));
    }
}

TEST_CASE("equal views come in the order of their numbers though their sums are rounded")
{
    // The same picture in another order of polygons.
    const std::size_t polygons = 24;
    std::vector<double> areas;
    for (std::size_t v = 0; v < polygons; ++v)
        for (std::size_t o = 0; o < polygons; ++o)
            areas.push_back(1 / (0.3 + double((o + polygons - v) % polygons)));
    const auto channel = channel_of(areas, polygons);
    const auto ranked = ranking(channel);
    bool rounded = false;
    for (std::size_t i = 0; i < polygons; ++i) {
        CHECK(ranked[i].view == i);
        rounded = rounded || ranked[i].information != ranked[0].information;
    }
    CHECK(rounded);
    CHECK(best(channel, {.count = 1})[0].view == 0);
}

TEST_CASE("views that are equal in pairs, but not all, are told apart alike by choice and ranking")
{
    // Each of three views is a little better than the one before it.
    for (int step = 1; step <= 60; ++step) {
        const double better = step * 1e-13;
        const auto channel = channel_of({2, 1, 2, 1 + better, 2, 1 + 2 * better, 1, 5}, 4);
        CHECK(best(channel, {.count = 1})[0].view == ranking(channel)[0].view);
    }
}

TEST_CASE("saliency of any size says the same")
{
    const auto channel = channel_of({2, 1, 1, 0, 2, 2}, 2);
    const double saliency[] = {1, 0.5, 2};
    const auto expected = ranking(channel, saliency);
    REQUIRE(expected.size() == 2);
    for (const double scale : {1e-300, 1e300, 8e307}) {
        const double scaled[] = {scale, 0.5 * scale, 2 * scale};
        const auto ranked = ranking(channel, scaled);
        REQUIRE(ranked.size() == 2);
        for (std::size_t i = 0; i < 2; ++i) {
            CHECK(ranked[i].view == expected[i].view);
            CHECK(std::fabs(ranked[i].information - expected[i].information) < 1e-14);
        }
        const auto chosen = best(channel, {.saliency = scaled});
        REQUIRE(chosen.size() == 2);
        CHECK(chosen[0].information == ranked[0].information);
    }
}

TEST_CASE("the choice does not depend on threads or on what scratch held")
{
    std::mt19937 random{8};
    const auto channel = channel_of(random_areas(random, 13, 3000), 13);
    std::vector<BestView> first, first_ranked;
    for (const int threads : {1, 2, 5}) {
        nook::ThreadExecutor executor{threads};
        std::vector<BestView> chosen(5), ranked(13);
        std::vector<unsigned char> memory(nook::best_views_scratch_size(channel, threads) + 1,
                                          0xff);
        const nook::Scratch scratch{memory.data() + 1, memory.size() - 1};
        std::size_t found = 0;
        const nook::Outcome outcome =
            nook::best_views(channel, chosen.data(), &found, {.count = 5}, scratch, executor);
        REQUIRE(outcome);
        CHECK(found == 5);
        CHECK(outcome.work.passes == 6);
        REQUIRE(nook::rank_views(channel, ranked.data(), &found, nullptr, scratch, executor));
        CHECK(found == 13);
        if (threads == 1) {
            first = chosen;
            first_ranked = ranked;
        }
        const auto same = [](const BestView& a, const BestView& b) {
            return a.view == b.view && a.information == b.information &&
                   a.probability == b.probability;
        };
        CHECK(std::equal(chosen.begin(), chosen.end(), first.begin(), same));
        CHECK(std::equal(ranked.begin(), ranked.end(), first_ranked.begin(), same));
    }
}

TEST_CASE("a channel in which nothing is seen has no best view")
{
    const nook::ViewpointChannel nothing;
    std::size_t found = 5;
    CHECK(nook::best_views(nothing, nullptr, &found));
    CHECK(found == 0);
    found = 5;
    CHECK(nook::rank_views(nothing, nullptr, &found));
    CHECK(found == 0);
    const auto blind = channel_of({0, 0, 0, 0}, 2);
    CHECK(best(blind, {}).empty());
    CHECK(ranking(blind).empty());
    const std::uint32_t views[] = {0, 1};
    CHECK(nook::merged_information(blind, views, 2) == 0);
    // One view, one polygon.
    const auto one = channel_of({3}, 1);
    CHECK(ranking(one)[0].information == 0);
    CHECK(best(one, {.count = 9}).size() == 1);
    CHECK(best(one, {.count = 0}).empty());
    // When all views have been chosen the channel is not read again.
    BestView only;
    CHECK(nook::best_views(one, &only, &found, {.count = 9}).work.passes == 2);
}

TEST_CASE("areas of any size make no difference")
{
    const auto channel = channel_of({2, 1, 1, 0, 2, 2}, 2);
    for (const double scale : {1e-290, 1e290}) {
        const auto scaled = channel_of({2 * scale, scale, scale, 0, 2 * scale, 2 * scale}, 2);
        const auto a = best(scaled, {}), b = best(channel, {});
        REQUIRE(a.size() == 2);
        for (std::size_t i = 0; i < 2; ++i) {
            CHECK(a[i].view == b[i].view);
            CHECK(std::fabs(a[i].information - b[i].information) < 1e-14);
        }
    }
    // One polygon next to nothing.
    for (const BestView& view : best(channel_of({1, 1e-300, 1, 0}, 2), {})) {
        CHECK(view.information >= 0);
        CHECK(view.information < 1e-12);
    }
}

TEST_CASE("bad arguments of the choice are named and nothing is written")
{
    const auto channel = cube();
    BestView out{77, 7, 7};
    std::size_t found = 55;
    const auto fails = [&](const nook::Outcome& outcome, nook::ErrorCode code, const char* name) {
        CHECK(outcome.error.code == code);
        CHECK(std::string_view{outcome.error.argument} == name);
        CHECK(out.view == 77);
        CHECK(found == 55);
    };
    using enum nook::ErrorCode;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    fails(nook::best_views(channel, nullptr, &found), null_data, "best");
    fails(nook::best_views(channel, &out, nullptr, {.count = 1}), null_data, "found");
    fails(nook::rank_views(channel, nullptr, &found), null_data, "ranking");
    for (const double share : {-0.1, 1.1, nan})
        fails(nook::best_views(channel, &out, &found, {.count = 1, .share = share}), bad_value,
              "options.share");
    for (const double bad : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
        const std::vector<double> saliency{1, 1, bad, 1, 1, 1};
        fails(nook::best_views(channel, &out, &found, {.count = 1, .saliency = saliency.data()}),
              bad_value, "saliency");
        fails(nook::rank_views(channel, &out, &found, saliency.data()), bad_value, "saliency");
    }
    fails(nook::best_views(channel, &out, &found, {.count = 1}, nook::Scratch{}), scratch_too_small,
          "scratch");
}
