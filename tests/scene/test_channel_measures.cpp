#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <nook/scene/channel_measures.hpp>
#include <nook/thread_executor.hpp>

#include "channels.hpp"

namespace {

using channels::Areas;
using channels::Directions;
using channels::Facet;
using channels::Values;
using nook::ViewpointChannel;
using nook::ViewProbability;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The rows of the table of exact cases give 13 digits.
constexpr double table_digits = 1e-12;

double log2_sum(const Values& p)
{
    double sum = 0;
    for (const double x : p)
        if (x > 0) sum -= x * std::log2(x);
    return sum;
}

/// The measures from their definitions, over a dense matrix.
struct Definition {
    std::size_t views, polygons;
    Values p_view, p_polygon, joint;

    Definition(const Areas& areas, const Values& weights)
        : views{areas.views},
          polygons{areas.polygons},
          p_view(views),
          p_polygon(polygons),
          joint(views * polygons)
    {
        double sum = 0;
        for (std::size_t v = 0; v < views; ++v) sum += weights[v];
        for (std::size_t v = 0; v < views; ++v) {
            double a_v = 0;
            for (std::size_t o = 0; o < polygons; ++o) a_v += areas.at(v, o);
            p_view[v] = weights[v] / sum;
            for (std::size_t o = 0; o < polygons && a_v > 0; ++o) {
                joint[v * polygons + o] = p_view[v] * areas.at(v, o) / a_v;
                p_polygon[o] += joint[v * polygons + o];
            }
        }
    }
    /// Σ over the pairs of a polygon, or of a view, of p(x|y) f(p(v, o) / (p(v) p(o))).
    template <class F>
    [[nodiscard]] Values of_polygons(const F& f) const
    {
        Values result(polygons);
        for (std::size_t v = 0; v < views; ++v)
            for (std::size_t o = 0; o < polygons; ++o)
                if (const double q = joint[v * polygons + o]; q > 0)
                    result[o] += q / p_polygon[o] * f(q / (p_view[v] * p_polygon[o]));
        return result;
    }
    template <class F>
    [[nodiscard]] Values of_views(const F& f) const
    {
        Values result(views);
        for (std::size_t v = 0; v < views; ++v)
            for (std::size_t o = 0; o < polygons; ++o)
                if (const double q = joint[v * polygons + o]; q > 0)
                    result[v] += q / p_view[v] * f(q / (p_view[v] * p_polygon[o]));
        return result;
    }
};

Values view_areas(const Areas& areas)
{
    Values result(areas.views);
    for (std::size_t v = 0; v < areas.views; ++v)
        for (std::size_t o = 0; o < areas.polygons; ++o) result[v] += areas.at(v, o);
    return result;
}

/// Every polygon has this PMI, which is I then.
void check_all(const ViewpointChannel& channel, double expected, double tolerance)
{
    for (const double value : channels::pmi(channel))
        CHECK(std::fabs(value - expected) <= tolerance);
    const nook::ChannelEntropies entropies = channels::entropies(channel);
    CHECK(std::fabs(entropies.information_by_views - expected) <= tolerance);
    CHECK(std::fabs(entropies.information_by_polygons - expected) <= tolerance);
}

void check_both(const Areas& areas, double by_area, double uniform, double tolerance)
{
    ViewpointChannel channel = areas.channel();
    check_all(channel, by_area, tolerance);
    REQUIRE(!channel.set_probability(ViewProbability::uniform));
    check_all(channel, uniform, tolerance);
}

/// The PMI of one facet of a body whose a_v is the same in every view.
double facet_information(const Directions& views, const glm::dvec3& normal, double most = 1)
{
    Areas areas{views.size(), 2};
    for (std::size_t v = 0; v < views.size(); ++v) {
        areas.at(v, 0) = std::clamp(channels::dot(views[v], normal), 0.0, most);
        areas.at(v, 1) = 2 - areas.at(v, 0);
    }
    return channels::pmi(areas.channel())[0];
}

TEST_CASE("few viewpoints around a cube and a tetrahedron: the information is known in closed form")
{
    using channels::both;
    using channels::signs;
    const auto cube = channels::cube_facets(), tetrahedron = channels::tetrahedron_facets();
    const auto check = [](const std::vector<Facet>& body, const Directions& views, double expected,
                          double uniform, double tolerance) {
        CAPTURE(views.size());
        check_both(channels::open_areas(body, views), expected, uniform, tolerance);
    };
    const double rounding = 1e-14;
    check(cube, signs(1), std::log2(6), std::log2(6), rounding);
    check(cube, signs(3), 1, 1, rounding);
    check(cube, signs(2), std::log2(3), std::log2(3), rounding);
    check(cube, both(signs(1), signs(3)), 1.4789272934768, 1.6792696431662, table_digits);
    check(cube, both(both(signs(1), signs(2)), signs(3)), 1.5277903190458, 1.6357432697300,
          table_digits);
    const Directions normals = channels::tetrahedron_axes(-1),
                     corners = channels::tetrahedron_axes(1);
    check(tetrahedron, normals, 2, 2, rounding);
    check(tetrahedron, corners, std::log2(4.0 / 3), std::log2(4.0 / 3), rounding);
    check(tetrahedron, both(normals, corners), 1.2075187496394, 1.2075187496394, table_digits);
    check(tetrahedron, signs(1), 1, 1, rounding);
}

TEST_CASE("642 viewpoints around a cube and a tetrahedron, and ever more come close to all of them")
{
    check_both(channels::open_areas(channels::cube_facets(), channels::icosphere(3)),
               1.283058048141, 1.310123840882, table_digits);
    check_both(channels::open_areas(channels::tetrahedron_facets(), channels::icosphere(3)),
               1.282259541499, 1.296111573420, table_digits);
    // The continuum, by quadrature. Errors go with the area of a cell, so each level takes at least a
    // half off.
    double error = infinity;
    for (int level = 2; level <= 5; ++level) {
        const Areas areas =
            channels::open_areas(channels::cube_facets(), channels::icosphere(level));
        const double now = std::fabs(channels::pmi(areas.channel())[0] - 1.271011136864);
        CHECK(now < error / 2);
        error = now;
    }
    CHECK(error < 2e-3);
}

TEST_CASE("an open facet has 2 - 1 / (2 ln 2) bits, up to the viewpoints")
{
    const double facing_z[] = {1.625543772498, 1.406901894448, 1.319268059511,
                               1.290996232305, 1.282517083317, 1.280057962658};
    const double facing_vertex[] = {1.088514160165, 1.457807131382, 1.332392222224,
                                    1.291563824430, 1.279227672091, 1.275630768064};
    for (int level = 0; level <= 5; ++level) {
        const Directions views = channels::icosphere(level);
        CHECK(std::fabs(facet_information(views, {0, 0, 1}) - facing_z[level]) < table_digits);
        CHECK(std::fabs(facet_information(views, views[0]) - facing_vertex[level]) < table_digits);
    }
    const double continuum = 2 - 1 / (2 * std::numbers::ln2);
    CHECK(std::fabs(facing_z[5] - continuum) < 2e-3);
}

TEST_CASE("three polygons and two viewpoints by hand")
{
    const ViewpointChannel channel = Areas{2, 3, {2, 1, 1, 0, 2, 2}}.channel();
    CHECK(channel.p_view(0) == 0.5);
    CHECK(channel.p_polygon(0) == 0.25);
    CHECK(channel.p_polygon(1) == 0.375);
    CHECK(channel.p_polygon(2) == 0.375);
    const Values pmi = channels::pmi(channel), vmi = channels::vmi(channel);
    CHECK(pmi[0] == 1);
    CHECK(std::fabs(pmi[1] - 0.08170416594551) < 1e-14);
    CHECK(pmi[2] == pmi[1]);
    CHECK(std::fabs(vmi[0] - 0.20751874963942) < 1e-14);
    CHECK(std::fabs(vmi[1] - 0.41503749927884) < 1e-14);
    const nook::ChannelEntropies entropies = channels::entropies(channel);
    CHECK(std::fabs(entropies.information_by_views - 0.31127812445913) < 1e-14);
    CHECK(std::fabs(entropies.information_by_polygons - 0.31127812445913) < 1e-14);
    CHECK(entropies.view == 1);
    Values entropy(2);
    REQUIRE(nook::viewpoint_entropy(channel, entropy.data()));
    CHECK(std::fabs(entropy[0] - 1.5) < 1e-15);
    CHECK(std::fabs(entropy[1] - 1) < 1e-15);
}

TEST_CASE(
    "the measures are what their definitions say, and the entropies give the same information")
{
    std::mt19937 random{61};
    struct Size {
        std::size_t views, polygons;
    };
    for (const Size size : {Size{1, 1}, {1, 7}, {5, 1}, {3, 40}, {90, 12}, {17, 3000}}) {
        const std::size_t views = size.views, polygons = size.polygons;
        for (const double share : {0.05, 0.5, 1.0}) {
            Areas areas = channels::random_areas(random, views, polygons, share);
            areas.at(0, 0) = 0.5;
            Values importance(views, 0.0);
            for (std::size_t v = 0; v < views; v += 2) importance[v] = areas.at(v, 0) + 0.1;
            for (int kind = 0; kind < 3; ++kind) {
                CAPTURE(views);
                CAPTURE(polygons);
                CAPTURE(kind);
                ViewpointChannel channel = areas.channel();
                const auto probability = static_cast<ViewProbability>(kind);
                REQUIRE(!channel.set_probability(probability, importance.data()));
                Values weights = view_areas(areas);
                for (std::size_t v = 0; v < views; ++v)
                    if (weights[v] > 0 && kind > 0) weights[v] = kind == 1 ? 1 : importance[v];
                const Definition definition{areas, weights};
                const auto logarithm = [](double r) { return std::log2(r); };
                const Values pmi = channels::pmi(channel), vmi = channels::vmi(channel);
                CHECK(channels::largest_difference(pmi, definition.of_polygons(logarithm)) < 1e-12);
                CHECK(channels::largest_difference(vmi, definition.of_views(logarithm)) < 1e-12);

                const nook::ChannelEntropies found = channels::entropies(channel);
                CHECK(std::fabs(found.view - log2_sum(definition.p_view)) < 1e-12);
                CHECK(std::fabs(found.polygon - log2_sum(definition.p_polygon)) < 1e-12);
                CHECK(std::fabs(found.joint - log2_sum(definition.joint)) < 1e-12);
                // Rounding is relative to the entropies.
                const double information = found.information_by_polygons;
                const double least = (std::max)(information, 1e-2 * found.joint);
                CHECK(information >= 0);
                CHECK(std::fabs(found.information_by_views - information) <= 1e-12 * least);
                CHECK(std::fabs(found.view + found.polygon - found.joint - information) <=
                      1e-12 * least);

                double rarest = 1;
                for (std::size_t v = 0; v < views; ++v)
                    if (channel.p_view(v) > 0) rarest = (std::min)(rarest, channel.p_view(v));
                double by_polygons = 0, by_views = 0;
                for (std::size_t o = 0; o < polygons; ++o) {
                    CHECK(pmi[o] >= 0);
                    CHECK(pmi[o] <= -std::log2(rarest) + 1e-13);
                    CHECK((channel.seen(o) || pmi[o] == 0));
                    by_polygons += channel.p_polygon(o) * pmi[o];
                }
                for (std::size_t v = 0; v < views; ++v) by_views += channel.p_view(v) * vmi[v];
                CHECK(std::fabs(by_polygons - information) <= 1e-12 * least);
                CHECK(std::fabs(by_views - information) <= 1e-12 * least);
            }
        }
    }
}

TEST_CASE("what one viewpoint alone sees has the information of this viewpoint, exactly")
{
    Areas areas{642, 643};
    for (std::size_t v = 0; v < 642; ++v) areas.at(v, v) = 1 + double(v) / 7, areas.at(v, 642) = 3;
    ViewpointChannel channel = areas.channel();
    Values pmi = channels::pmi(channel);
    for (std::size_t v = 0; v < 642; ++v) CHECK(pmi[v] == -std::log2(channel.p_view(v)));
    REQUIRE(!channel.set_probability(ViewProbability::uniform));
    pmi = channels::pmi(channel);
    for (std::size_t v = 0; v < 642; ++v) CHECK(std::fabs(pmi[v] - 9.326429487) < 1e-9);
}

TEST_CASE("what is seen as often as anything has no information, and only that")
{
    // Rows in proportion to the a_v.
    Areas areas{5, 4};
    for (std::size_t v = 0; v < 5; ++v)
        for (std::size_t o = 0; o < 4; ++o) areas.at(v, o) = double(1 + v) * double(1 + o * o);
    for (const double value : channels::pmi(areas.channel())) CHECK(value < 1e-14);
    areas.at(2, 1) += 0.5;
    for (const double value : channels::pmi(areas.channel())) CHECK(value > 1e-6);
}

TEST_CASE("one viewpoint tells nothing")
{
    const ViewpointChannel channel = Areas{1, 4, {1, 0, 1.0 / 3, 7}}.channel();
    for (const double value : channels::pmi(channel)) CHECK(value == 0);
    CHECK(channels::vmi(channel)[0] < 1e-14);
    CHECK(!channel.seen(1));
}

TEST_CASE("importance on one viewpoint: what it sees has no information, and the rest is not seen")
{
    std::mt19937 random{62};
    const Areas areas = channels::random_areas(random, 9, 30);
    ViewpointChannel channel = areas.channel();
    Values importance(9, 0.0);
    importance[4] = 1e-300;
    REQUIRE(!channel.set_probability(ViewProbability::importance, importance.data()));
    const Values pmi = channels::pmi(channel), vmi = channels::vmi(channel);
    for (std::size_t o = 0; o < 30; ++o) {
        CHECK(pmi[o] == 0);
        CHECK(channel.seen(o) == (areas.at(4, o) > 0));
    }
    for (const double value : vmi) CHECK(value < 1e-14);
    const nook::ChannelEntropies found = channels::entropies(channel);
    CHECK(found.view == 0);
    CHECK(found.information_by_polygons == 0);
    CHECK(found.information_by_views < 1e-14);
}

TEST_CASE(
    "parts of a polygon that are seen alike have its information, and other cuts do not lose any")
{
    std::mt19937 random{63};
    const Areas whole = channels::random_areas(random, 12, 6);
    for (const bool alike : {true, false}) {
        std::uniform_real_distribution<double> number{0, 1};
        Areas cut{12, 8};
        for (std::size_t v = 0; v < 12; ++v) {
            for (std::size_t o = 0; o < 6; ++o) cut.at(v, o) = whole.at(v, o);
            const double share = alike ? 0.25 : number(random);
            cut.at(v, 6) = share * whole.at(v, 2);
            cut.at(v, 7) = 0.5 * (1 - share) * whole.at(v, 2);
            cut.at(v, 2) -= cut.at(v, 6) + cut.at(v, 7);
        }
        const ViewpointChannel before = whole.channel(), after = cut.channel();
        const double difference = channels::entropies(after).information_by_polygons -
                                  channels::entropies(before).information_by_polygons;
        const Values old_pmi = channels::pmi(before), new_pmi = channels::pmi(after);
        for (const std::size_t o : {0u, 1u, 3u, 4u, 5u})
            CHECK(std::fabs(old_pmi[o] - new_pmi[o]) < 1e-13);
        if (alike) {
            for (const std::size_t o : {2u, 6u, 7u})
                CHECK(std::fabs(old_pmi[2] - new_pmi[o]) < 1e-13);
            CHECK(std::fabs(difference) < 1e-13);
        } else {
            CHECK(difference > 1e-4);
        }
    }
}

TEST_CASE("viewpoints given twice, and viewpoints that see nothing, change no polygon")
{
    std::mt19937 random{64};
    const Areas areas = channels::random_areas(random, 10, 25);
    Areas twice{21, 25};
    for (std::size_t v = 0; v < 10; ++v)
        for (std::size_t o = 0; o < 25; ++o) twice.at(v, o) = twice.at(11 + v, o) = areas.at(v, o);
    ViewpointChannel once_channel = areas.channel(), twice_channel = twice.channel();
    for (const auto probability : {ViewProbability::projected_area, ViewProbability::uniform}) {
        REQUIRE(!once_channel.set_probability(probability));
        REQUIRE(!twice_channel.set_probability(probability));
        CHECK(twice_channel.p_view(10) == 0);
        CHECK(channels::largest_difference(channels::pmi(once_channel),
                                           channels::pmi(twice_channel)) < 1e-13);
    }
}

TEST_CASE("a turned body seen from turned viewpoints gives the same measures")
{
    // A rotation by its axis and angle (Rodrigues).
    const glm::dvec3 axis = channels::unit({1, 2, -3});
    const auto turned = [&](const glm::dvec3& v) {
        const glm::dvec3 side{axis.y * v.z - axis.z * v.y, axis.z * v.x - axis.x * v.z,
                              axis.x * v.y - axis.y * v.x};
        return v * std::cos(0.7) + side * std::sin(0.7) +
               axis * (channels::dot(axis, v) * (1 - std::cos(0.7)));
    };
    std::vector<Facet> body = channels::tetrahedron_facets();
    Directions views = channels::icosphere(2);
    const Values before = channels::pmi(channels::open_areas(body, views).channel());
    for (Facet& facet : body) facet.normal = turned(facet.normal);
    for (glm::dvec3& view : views) view = turned(view);
    const Values after = channels::pmi(channels::open_areas(body, views).channel());
    CHECK(channels::largest_difference(before, after) < 1e-12);
}

TEST_CASE("the unit of the areas does not matter")
{
    std::mt19937 random{65};
    const Areas areas = channels::random_areas(random, 6, 9);
    const ViewpointChannel channel = areas.channel();
    const Values expected = channels::pmi(channel);
    for (const double scale : {0x1p-1000, 0x1p-300, 0x1p17, 0x1p1000}) {
        Areas scaled = areas;
        for (double& a : scaled.values) a *= scale;
        const ViewpointChannel other = scaled.channel();
        CHECK(channels::largest_difference(channels::pmi(other), expected) < 1e-13);
        CHECK(other.area(3, 4) == scaled.at(3, 4));
        CHECK(other.view_area(3) == channel.view_area(3) * scale);
    }
}

TEST_CASE("PMI does not measure occlusion: what is more hidden may have less")
{
    // The paper reads low PMI as open. First: a polygon that loses half of its visible area in every
    // view, to a neighbour, keeps its PMI.
    std::mt19937 random{66};
    Areas areas = channels::random_areas(random, 20, 10, 1);
    const Areas before = areas;
    for (std::size_t v = 0; v < 20; ++v) {
        areas.at(v, 7) += areas.at(v, 3) / 2;
        areas.at(v, 3) /= 2;
    }
    ViewpointChannel open = before.channel(), covered = areas.channel();
    for (const auto probability : {ViewProbability::projected_area, ViewProbability::uniform}) {
        REQUIRE(!open.set_probability(probability));
        REQUIRE(!covered.set_probability(probability));
        CHECK(std::fabs(channels::pmi(open)[3] - channels::pmi(covered)[3]) < 1e-13);
    }
    // Second: a facet of which at most a tenth is seen, though from everywhere, against an open one.
    const Directions views = channels::icosphere(3);
    const double hidden = facet_information(views, {0, 0, 1}, 0.1);
    CHECK(std::fabs(hidden - 1.075) < 5e-4);
    CHECK(hidden < facet_information(views, {0, 0, 1}) - 0.2);
}

TEST_CASE("any number of threads gives the same bits")
{
    std::mt19937 random{67};
    const ViewpointChannel channel = channels::random_areas(random, 40, 5000, 0.2).channel();
    struct Answers {
        Values pmi, vmi, entropy, numbers;
    };
    const auto answers = [&](int threads) {
        nook::ThreadExecutor executor{threads};
        nook::HeapScratch scratch;
        nook::ChannelEntropies found{};
        Answers result{Values(5000), Values(40), Values(40), {}};
        REQUIRE(nook::polygon_mutual_information(channel, result.pmi.data(), executor));
        REQUIRE(nook::viewpoint_mutual_information(channel, result.vmi.data(), scratch, executor));
        REQUIRE(nook::viewpoint_entropy(channel, result.entropy.data(), scratch, executor));
        REQUIRE(nook::channel_entropies(channel, found, scratch, executor));
        result.numbers = {found.view, found.polygon, found.joint, found.information_by_views,
                          found.information_by_polygons};
        return result;
    };
    const Answers one = answers(1);
    for (const int threads : {2, 5}) {
        const Answers many = answers(threads);
        CHECK(one.pmi == many.pmi);
        CHECK(one.vmi == many.vmi);
        CHECK(one.entropy == many.entropy);
        CHECK(one.numbers == many.numbers);
    }
}

TEST_CASE("empty channels are measured, and missing memory is reported")
{
    const ViewpointChannel nothing;
    CHECK(nook::polygon_mutual_information(nothing, nullptr));
    CHECK(nook::viewpoint_mutual_information(nothing, nullptr));
    CHECK(nook::viewpoint_entropy(nothing, nullptr));
    CHECK(channels::entropies(nothing).joint == 0);
    CHECK(channels::entropies(Areas{3, 0}.channel()).view == 0);
    CHECK(channels::entropies(Areas{0, 3}.channel()).view == 0);
    const ViewpointChannel dark = Areas{3, 4}.channel();
    CHECK(channels::pmi(dark) == Values(4, 0.0));
    CHECK(channels::vmi(dark) == Values(3, 0.0));
    CHECK(channels::entropies(dark).joint == 0);

    const ViewpointChannel channel = Areas{1, 2, {1, 2}}.channel();
    CHECK(nook::polygon_mutual_information(channel, nullptr).error.code ==
          nook::ErrorCode::null_data);
    CHECK(nook::viewpoint_mutual_information(channel, nullptr).error.code ==
          nook::ErrorCode::null_data);
    CHECK(nook::viewpoint_entropy(channel, nullptr).error.code == nook::ErrorCode::null_data);
    Values vmi{7};
    const std::size_t size = nook::channel_measures_scratch_size(channel, 1);
    std::vector<std::byte> memory(size);
    const nook::Scratch enough{memory.data(), size}, less{memory.data(), size - 1};
    CHECK(nook::viewpoint_mutual_information(channel, vmi.data(), less).error.code ==
          nook::ErrorCode::scratch_too_small);
    CHECK(vmi[0] == 7);
    CHECK(nook::viewpoint_mutual_information(channel, vmi.data(), enough));
    CHECK(vmi[0] < 1e-14);
}

}  // namespace
