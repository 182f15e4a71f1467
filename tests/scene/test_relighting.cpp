#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include <nook/scene/relighting.hpp>
#include <nook/scene/viewpoints.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using Values = std::vector<double>;
using Colours = std::vector<float>;
using nook::NegativeTerms;

nook::ViewpointChannel channel_of(const Values& areas, std::size_t views)
{
    nook::ViewpointChannel channel;
    REQUIRE_FALSE(channel.build(areas.data(), views, areas.size() / views));
    return channel;
}

/// Areas of which a third is 0, and a polygon that nothing sees.
nook::ViewpointChannel any_channel(std::size_t views = 40, std::size_t polygons = 90)
{
    std::mt19937 random{5};
    std::uniform_real_distribution<double> uniform;
    Values areas(views * polygons);
    for (std::size_t i = 0; i < areas.size(); ++i) {
        const double roll = uniform(random), area = std::exp(4 * uniform(random));
        areas[i] = roll < 0.35 || i % polygons == 17 ? 0 : area;
    }
    return channel_of(areas, views);
}

Colours constant(const nook::ViewpointChannel& channel, float value)
{
    return Colours(3 * channel.view_count(), value);
}

Colours any_colours(const nook::ViewpointChannel& channel, unsigned seed = 1)
{
    std::mt19937 random{seed};
    std::uniform_real_distribution<float> uniform;
    Colours colours = constant(channel, 0);
    for (float& c : colours) c = uniform(random);
    return colours;
}

Values relit(const nook::ViewpointChannel& channel, const Colours& colours,
             NegativeTerms terms = NegativeTerms::balanced)
{
    Values result(3 * channel.polygon_count(), -1);
    REQUIRE(
        nook::relit_information(channel, colours.data(), result.data(), {.negative_terms = terms}));
    return result;
}

/// Equation 11 from its terms, with the whole matrix in view.
double slow(const nook::ViewpointChannel& channel, const Colours& colours, std::size_t o,
            std::size_t k, bool balanced)
{
    double sum = 0;
    for (std::size_t v = 0; v < channel.view_count(); ++v) {
        const double given = channel.p_view_given_polygon(v, o), p = channel.p_view(v);
        double term = given > 0 ? given * std::log2(given / p) : 0;
        if (balanced) term += (p - given) / std::log(2.0);
        sum += (1 - double{colours[3 * v + k]}) * term;
    }
    return sum;
}

double information(const nook::ViewpointChannel& channel, std::size_t o)
{
    return slow(channel, constant(channel, 0), o, 0, false);
}

}  // namespace

TEST_CASE("light of two views on three polygons is what it is by hand")
{
    // p(v) = 1/2 each; p(v|o) = (1, 0), (1/3, 2/3), (1/3, 2/3).
    const auto channel = channel_of({2, 1, 1, 0, 2, 2}, 2);
    const Colours colours{0, 1, 0.5f, 0, 0, 1};
    const double bit = 1 / std::log(2.0), third = std::log2(2.0 / 3) / 3,
                 two_thirds = std::log2(4.0 / 3) * 2 / 3;
    const Values plain = relit(channel, colours, NegativeTerms::plain),
                 balanced = relit(channel, colours);
    const Values by_hand{1, 0, 0.5, third + two_thirds, two_thirds, third / 2};
    const Values by_hand_balanced{1,
                                  0.5 * bit,
                                  0.5 * (1 - 0.5 * bit),
                                  third + two_thirds,
                                  two_thirds - bit / 6,
                                  (third + bit / 6) / 2};
    for (std::size_t i = 0; i < 9; ++i) {
        CAPTURE(i);
        CHECK(plain[i] == doctest::Approx(by_hand[i < 6 ? i : i - 3]).epsilon(1e-14));
        CHECK(balanced[i] == doctest::Approx(by_hand_balanced[i < 6 ? i : i - 3]).epsilon(1e-14));
    }
    CHECK(plain[5] < 0);
    CHECK(balanced[5] > 0);
}

TEST_CASE("white surroundings leave no information, and everything open")
{
    const auto channel = any_channel();
    for (const auto terms : {NegativeTerms::balanced, NegativeTerms::plain}) {
        const Values result = relit(channel, constant(channel, 1), terms);
        CHECK(std::all_of(result.begin(), result.end(), [](double i) { return i == 0; }));
        std::vector<float> visibility(result.size(), -1);
        REQUIRE_FALSE(nook::relit_visibility(channel, result.data(), visibility.data()));
        for (std::size_t i = 0; i < visibility.size(); ++i)
            CHECK(visibility[i] == (i / 3 == 17 ? 0.0f : 1.0f));
    }
}

TEST_CASE("in black surroundings there is the mutual information of each polygon")
{
    const auto channel = any_channel();
    CHECK_FALSE(channel.seen(17));
    for (const auto terms : {NegativeTerms::balanced, NegativeTerms::plain}) {
        const Values result = relit(channel, constant(channel, 0), terms);
        for (std::size_t i = 0; i < result.size(); ++i)
            CHECK(std::fabs(result[i] - information(channel, i / 3)) < 1e-12);
    }
    // A colour that is the same from everywhere takes its share.
    const Values balanced = relit(channel, constant(channel, 0.375f)),
                 plain = relit(channel, constant(channel, 0.375f), NegativeTerms::plain);
    for (std::size_t i = 0; i < balanced.size(); ++i) {
        CHECK(std::fabs(balanced[i] - plain[i]) < 1e-12);
        CHECK(std::fabs(balanced[i] - 0.625 * information(channel, i / 3)) < 1e-12);
    }
}

TEST_CASE("the sums are those of equation 11, with any p(v)")
{
    auto channel = any_channel();
    const Colours colours = any_colours(channel);
    Values importance(channel.view_count(), 1);
    importance[3] = 0;
    importance[8] = 20;
    for (const auto probability :
         {nook::ViewProbability::projected_area, nook::ViewProbability::uniform,
          nook::ViewProbability::importance}) {
        REQUIRE_FALSE(channel.set_probability(probability, importance.data()));
        for (const auto terms : {NegativeTerms::balanced, NegativeTerms::plain}) {
            const Values result = relit(channel, colours, terms);
            for (std::size_t o = 0; o < channel.polygon_count(); ++o)
                for (std::size_t k = 0; k < 3; ++k) {
                    const bool balanced = terms == NegativeTerms::balanced;
                    const double wanted =
                        channel.seen(o) ? slow(channel, colours, o, k, balanced) : 0;
                    CHECK(std::fabs(result[3 * o + k] - wanted) < 1e-12);
                }
        }
    }
}

TEST_CASE("balanced information is never negative and never rises with the light")
{
    const auto channel = any_channel();
    std::mt19937 random{3};
    bool plain_is_negative = false, plain_rises = false;
    for (unsigned turn = 0; turn < 40; ++turn) {
        Colours dim = any_colours(channel, turn);
        // Light from where polygon 4 looks.
        for (std::size_t v = 0; turn == 0 && v < channel.view_count(); ++v)
            if (channel.p_view_given_polygon(v, 4) > channel.p_view(v)) dim[3 * v + 2] = 1;
        Colours bright = dim;
        // One view, by as little as there is, or much.
        float& c = bright[3 * (random() % channel.view_count()) + 1];
        c = turn % 2 == 0 ? std::nextafter(c, 1.0f) : 1.0f;
        const Values before = relit(channel, dim), after = relit(channel, bright);
        const Values plain_before = relit(channel, dim, NegativeTerms::plain),
                     plain_after = relit(channel, bright, NegativeTerms::plain);
        std::size_t rises = 0, negative = 0;
        for (std::size_t i = 0; i < before.size(); ++i) {
            negative += before[i] < 0 ? 1 : 0;
            rises += after[i] > before[i] ? 1 : 0;
            plain_is_negative = plain_is_negative || plain_before[i] < 0;
            plain_rises = plain_rises || plain_after[i] > plain_before[i] + 1e-9;
        }
        CHECK(negative == 0);
        CHECK(rises == 0);
    }
    CHECK(plain_is_negative);
    CHECK(plain_rises);
}

TEST_CASE("tints survive the normalisation")
{
    const auto channel = channel_of({2, 1, 0, 1, 0, 2, 0, 1}, 2);
    // Polygons 1 and 3 are seen as the whole is seen from both; polygon 2 by nobody.
    const Values information{0.5, 0.25, 0.75, 1, 1, 1, 0, 0, -7, 0.875, 0.5, 0.25};
    float visibility[12];
    REQUIRE_FALSE(nook::relit_visibility(channel, information.data(), visibility));
    // One range for the three channels: from 1/4 to 1.
    const float wanted[12] = {2.f / 3, 1, 1.f / 3, 0, 0, 0, 0, 0, 0, 1.f / 6, 2.f / 3, 1};
    for (std::size_t i = 0; i < 12; ++i) CHECK(visibility[i] == doctest::Approx(wanted[i]));
    // Rounding is no range, a millionth is one.
    Values even(12, 0.5);
    even[4] += 5e-13;
    REQUIRE_FALSE(nook::relit_visibility(channel, even.data(), visibility));
    for (std::size_t i = 0; i < 12; ++i) CHECK(visibility[i] == (i / 3 == 2 ? 0.0f : 1.0f));
    even[4] += 1e-6;
    REQUIRE_FALSE(nook::relit_visibility(channel, even.data(), visibility));
    CHECK(visibility[4] == 0);
    CHECK(visibility[5] == 1);
    // What is not finite says nothing about the others.
    Values poisoned = information;
    poisoned[1] = std::numeric_limits<double>::quiet_NaN();
    poisoned[10] = std::numeric_limits<double>::infinity();
    poisoned[11] = 0.25;
    REQUIRE_FALSE(nook::relit_visibility(channel, poisoned.data(), visibility));
    CHECK(visibility[1] == 0);
    CHECK(visibility[10] == 0);
    CHECK(visibility[11] == 1);
    CHECK(visibility[0] == doctest::Approx(2.0 / 3));
    // A range beyond that of double.
    constexpr double most = std::numeric_limits<double>::max();
    poisoned.assign(12, 0);
    poisoned[0] = most;
    poisoned[1] = -most;
    REQUIRE_FALSE(nook::relit_visibility(channel, poisoned.data(), visibility));
    CHECK(visibility[0] == 0);
    CHECK(visibility[1] == 1);
    CHECK(visibility[2] == 0.5f);
}

TEST_CASE("light from one side tints the side of a body that faces it")
{
    // A cube seen along its six axes, red light from +x: a face seen from one view alone.
    meshes::Mesh cube;
    cube.box({-1, -1, -1}, {1, 1, 1});
    std::vector<nook::Camera> views;
    Colours colours;
    const nook::BoundingSphere sphere = nook::bounding_sphere(cube.view());
    for (int axis = 0; axis < 6; ++axis) {
        glm::dvec3 direction{0, 0, 0};
        direction[axis / 2] = axis % 2 == 0 ? 1 : -1;
        views.push_back(nook::viewpoint_camera(sphere, direction));
        for (int k = 0; k < 3; ++k) colours.push_back(axis == 0 && k == 0 ? 1.0f : 0.0f);
    }
    nook::ViewpointChannel channel;
    REQUIRE(channel.build(cube.view(), views.data(), views.size(), {.resolution = 64}));
    const Values result = relit(channel, colours);
    std::vector<float> visibility(result.size());
    REQUIRE_FALSE(nook::relit_visibility(channel, result.data(), visibility.data()));
    std::size_t lit = 0;
    for (std::size_t o = 0; o < channel.polygon_count(); ++o) {
        REQUIRE(channel.seen(o));
        const bool facing = channel.area(0, o) > 0;
        lit += facing ? 1 : 0;
        // log2 6 = 2.58 bits; the view of the light holds all of them but what the others' balance
        // adds, 5/6 / ln 2.
        const double share = 5 / (6 * std::log(2.0));
        CHECK(result[3 * o] ==
              doctest::Approx(facing ? share : std::log2(6.0) - 1 / (6 * std::log(2.0))));
        CHECK(result[3 * o + 1] == doctest::Approx(std::log2(6.0)));
        CHECK(visibility[3 * o] == (facing ? 1.0f : doctest::Approx(0.174).epsilon(0.01)));
        CHECK(visibility[3 * o + 1] < 1e-6f);
    }
    CHECK(lit == 2);
}

TEST_CASE("relighting gives the same bits on any number of threads")
{
    const auto channel = any_channel(12, 5000);
    const Colours colours = any_colours(channel);
    Values one(3 * channel.polygon_count()), other = one;
    REQUIRE(
        nook::relit_information(channel, colours.data(), one.data(), {}, nook::ThreadExecutor{1}));
    REQUIRE(nook::relit_information(channel, colours.data(), other.data(), {},
                                    nook::ThreadExecutor{3}));
    CHECK(one == other);
}

TEST_CASE("relighting refuses bad arguments and writes nothing")
{
    const auto channel = channel_of({2, 1, 1, 0, 2, 2}, 2);
    Values result(9, -3);
    const auto fails = [&](const float* colours, double* out, nook::ErrorCode code,
                           const nook::RelightingOptions& options = {}) {
        const nook::Error error = nook::relit_information(channel, colours, out, options).error;
        CHECK(error.code == code);
        CHECK(result == Values(9, -3));
    };
    const Colours fine(6, 0.5f);
    fails(nullptr, result.data(), nook::ErrorCode::null_data);
    fails(fine.data(), nullptr, nook::ErrorCode::null_data);
    for (const float bad : {-0.001f, 1.001f, std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity()}) {
        Colours colours = fine;
        colours[5] = bad;
        fails(colours.data(), result.data(), nook::ErrorCode::bad_value);
    }
    fails(fine.data(), result.data(), nook::ErrorCode::bad_value,
          {.negative_terms = static_cast<NegativeTerms>(7)});
    float visibility[9];
    CHECK(nook::relit_visibility(channel, nullptr, visibility).code == nook::ErrorCode::null_data);
    CHECK(nook::relit_visibility(channel, result.data(), nullptr).code ==
          nook::ErrorCode::null_data);
    // Nothing to do.
    const nook::ViewpointChannel empty;
    CHECK(nook::relit_information(empty, nullptr, nullptr));
    CHECK_FALSE(nook::relit_visibility(empty, nullptr, nullptr));
}
