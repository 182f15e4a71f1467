#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

#include <nook/scene/flat_land.hpp>

namespace {

using nook::curtain_openness;
using nook::flat_land_contrast;
using nook::flat_land_darkest;
using nook::flat_land_darkest_thin;
using nook::flat_land_has_false_maximum;
using nook::flat_land_hidden;
using nook::flat_land_openness;
using nook::flat_land_visible_angle;
using nook::FlatLandCurtain;
using nook::FlatLandInterval;
using nook::FlatLandMeasure;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr FlatLandMeasure measures[] = {FlatLandMeasure::angle, FlatLandMeasure::cosine,
                                        FlatLandMeasure::space};

double hidden_angle(const FlatLandCurtain& curtain, double position)
{
    const FlatLandInterval hidden = flat_land_hidden(curtain, position);
    return hidden.right - hidden.left;
}

double measured(const FlatLandCurtain& curtain, double position, FlatLandMeasure measure)
{
    return measure == FlatLandMeasure::angle    ? flat_land_visible_angle(curtain, position)
           : measure == FlatLandMeasure::cosine ? flat_land_openness(curtain, position)
                                                : curtain_openness(curtain, position);
}

/// A value that was given with so many decimals.
bool rounds_to(double value, double given, int decimals)
{
    return std::fabs(value - given) <= 0.5000001 * std::pow(10.0, -decimals);
}

struct Random {
    std::mt19937 bits{7};
    double operator()(double low, double high)
    {
        return low + (high - low) * std::uniform_real_distribution<double>{0, 1}(bits);
    }
    FlatLandCurtain curtain()
    {
        const double radius = (*this)(0.5, 30);
        const double width = std::max(0.0, (*this)(-0.3, 1.5)) * radius;
        const double height = std::max(0.0, (*this)(-0.1, 1.5)) * radius;
        return {width, (*this)(0.02, 1.1) * radius, height, radius};
    }
};

// --- the slow way ---------------------------------------------------------------------------------

/// Where the ray at an angle from the vertical first meets the box; infinity without a hit.
double hit_distance(const FlatLandCurtain& curtain, double position, double angle)
{
    const double sine = std::sin(angle), cosine = std::cos(angle), half = curtain.width / 2;
    const double top = curtain.bottom + curtain.height;
    double nearest = infinity;
    const double x = position + sine / cosine * curtain.bottom;
    if (std::fabs(x) <= half) nearest = curtain.bottom / cosine;
    for (const double side : {-half, half}) {
        const double distance = (side - position) / sine, y = distance * cosine;
        if (distance > 0 && y >= curtain.bottom && y <= top) nearest = std::min(nearest, distance);
    }
    return nearest;
}

/// Whether a segment meets the box: neither an axis of the box nor the normal of the segment parts
/// the two.
bool meets_box(const FlatLandCurtain& curtain, double x0, double y0, double x1, double y1)
{
    const double half = curtain.width / 2, top = curtain.bottom + curtain.height;
    if (std::max(x0, x1) < -half || std::min(x0, x1) > half) return false;
    if (std::max(y0, y1) < curtain.bottom || std::min(y0, y1) > top) return false;
    const auto side = [&](double x, double y) {
        return (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0);
    };
    const double corners[4] = {side(-half, curtain.bottom), side(half, curtain.bottom),
                               side(-half, top), side(half, top)};
    return *std::min_element(corners, corners + 4) <= 0 &&
           *std::max_element(corners, corners + 4) >= 0;
}

struct Counted {
    double angle, cosine, secondary;
};
/// A sum over many directions.
Counted count_directions(const FlatLandCurtain& curtain, double position, double secondary,
                         double kept, int directions)
{
    Counted sum{0, 0, 0};
    for (int i = 0; i < directions; ++i) {
        const double angle = ((i + 0.5) / directions - 0.5) * pi;
        if (hit_distance(curtain, position, angle) <= curtain.radius) continue;
        const double sine = std::sin(angle), cosine = std::cos(angle);
        const double x = position + sine * curtain.radius / 2, y = cosine * curtain.radius / 2;
        const bool closed = meets_box(curtain, x - secondary * cosine, y + secondary * sine,
                                      x + secondary * cosine, y - secondary * sine);
        sum.angle += pi / directions;
        sum.cosine += cosine * pi / 2 / directions;
        sum.secondary += (closed ? kept : 1) * pi / directions;
    }
    return sum;
}

/// The integral of a function over an interval, by the tanh-sinh rule: roots at the ends do no harm.
template <class Function>
double integral(double from, double to, const Function& function)
{
    if (!(to > from)) return 0;
    double sum = 0;
    constexpr double step = 1 / 64.0;
    for (int i = -4 * 64; i <= 4 * 64; ++i) {
        const double t = i * step, s = pi / 2 * std::sinh(t);
        const double at = (from + to) / 2 + (to - from) / 2 * std::tanh(s);
        const double cosh = std::cosh(s);
        sum += function(std::clamp(at, from, to)) * pi / 2 * std::cosh(t) / (cosh * cosh);
    }
    return sum * step * (to - from) / 2;
}

/// The openness in space as an integral over the directions in the plane: at an angle with a hit at a
/// distance d, all directions with the cosine d / radius along the third axis or more are hidden.
double openness_by_quadrature(const FlatLandCurtain& curtain, double position)
{
    const FlatLandInterval hidden = flat_land_hidden(curtain, position);
    const double aside = std::fabs(position) - curtain.width / 2;
    const auto weight = [&](double angle) {
        const double sine = std::fabs(std::sin(angle)), cosine = std::cos(angle);
        double distance = curtain.bottom / cosine;
        if (aside > 0 && sine * curtain.bottom < aside * cosine) distance = aside / sine;
        const double eta = std::acos(std::min(1.0, distance / curtain.radius));
        return cosine * (eta + std::sin(eta) * std::cos(eta));
    };
    double corner = position < 0 ? hidden.right : hidden.left;
    if (aside > 0) corner = std::copysign(std::atan2(aside, curtain.bottom), -position);
    corner = std::clamp(corner, hidden.left, hidden.right);
    return 1 -
           (integral(hidden.left, corner, weight) + integral(corner, hidden.right, weight)) / pi;
}

}  // namespace

// --- values in closed form ------------------------------------------------------------------------

TEST_CASE("the hidden angle to twelve digits")
{
    struct Row {
        double position, width, bottom, height, angle;
    };
    for (const Row& row : {Row{0, 1, 5, 100, 0.199337304982},
                           {3, 1, 5, 100, 0.510558543228},
                           {10, 1, 5, 100, 0.736580820420},
                           {20, 1, 5, 100, 0.436898909597},
                           {24, 1, 5, 100, 0.146808100483},
                           {0, 30, 5, 100, 2.498091544797},
                           {14, 30, 5, 100, 1.566833965854},
                           {20, 30, 5, 100, 1.168080485214},
                           {5, 10, 10, 100, 0.785398163397},
                           {12, 40, 3, 2, 2.662532100924},
                           {0, 2, 5, 4, 0.394791119700},
                           {8, 2, 5, 4, 0.402654653552},
                           {8, 2, 5, 0.5, 0.158870732987},
                           {20, 2, 5, 0.5, 0.048028686404}}) {
        CAPTURE(row.position);
        CAPTURE(row.width);
        CAPTURE(row.height);
        const FlatLandCurtain curtain{row.width, row.bottom, row.height, 25};
        CHECK(rounds_to(hidden_angle(curtain, row.position), row.angle, 12));
    }
    CHECK(hidden_angle({1, 5, 100, 25}, 25.2) == 0);
    CHECK(hidden_angle({0, 5, 100, 25}, 0) == 0);
    CHECK(flat_land_visible_angle({0, 5, 100, 25}, 0) == pi);
    CHECK(std::fabs(hidden_angle({10, 10, 100, 25}, 5) - pi / 4) < 1e-15);
}

TEST_CASE("the visible angle under tall curtains")
{
    struct Row {
        double width, bottom, position, visible;
    };
    for (const Row& row :
         {Row{1, 5, 0, 2.942255},  {1, 5, 0.25, 2.942744},  {1, 5, 0.5, 2.944197},
          {1, 5, 1, 2.870137},     {1, 5, 2, 2.737981},     {1, 5, 4, 2.549239},
          {1, 5, 6, 2.448306},     {1, 5, 8, 2.407213},     {1, 5, 10, 2.405012},
          {1, 5, 12, 2.429298},    {1, 5, 15, 2.501567},    {1, 5, 20, 2.704694},
          {1, 5, 24, 2.994785},    {1, 12.5, 0, 3.061635},  {1, 12.5, 0.5, 3.061763},
          {1, 12.5, 2, 3.004233},  {1, 12.5, 6, 2.883888},  {1, 12.5, 10, 2.832729},
          {1, 12.5, 15, 2.868188}, {1, 12.5, 20, 3.013024}, {1, 20, 0, 3.091603},
          {1, 20, 0.5, 3.091634},  {1, 20, 2, 3.077274},    {1, 20, 6, 3.049175},
          {1, 20, 8, 3.044415},    {1, 20, 12, 3.060989},   {1, 20, 15, 3.116820},
          {30, 5, 0, 0.643501},    {30, 5, 6, 0.740842},    {30, 5, 10, 0.986756},
          {30, 5, 12, 1.231735},   {30, 5, 15, 1.772154},   {30, 5, 20, 1.973512},
          {30, 5, 25, 2.183671},   {30, 5, 30, 2.415655},   {10, 10, 0, 2.214297},
          {10, 10, 2, 2.239410},   {10, 10, 4, 2.309109},   {10, 10, 6, 2.348622},
          {10, 10, 8, 2.346782},   {10, 10, 12, 2.386315},  {10, 10, 20, 2.625814},
          {10, 5, 0, 1.570796},    {10, 5, 2, 1.650626},    {10, 5, 4, 1.880499},
          {10, 5, 6, 2.037434},    {10, 5, 10, 2.093905},   {10, 5, 20, 2.415655}}) {
        CAPTURE(row.width);
        CAPTURE(row.bottom);
        CAPTURE(row.position);
        const FlatLandCurtain curtain{row.width, row.bottom, 100, 25};
        CHECK(rounds_to(flat_land_visible_angle(curtain, row.position), row.visible, 6));
    }
    CHECK(flat_land_visible_angle({1, 5, 100, 25}, 25) == pi);
    CHECK(flat_land_visible_angle({1, 12.5, 100, 25}, 24) == pi);
    CHECK(flat_land_visible_angle({1, 20, 100, 25}, 18) == pi);
    CHECK(flat_land_visible_angle({30, 5, 100, 25}, 40) == pi);
}

TEST_CASE("the cosine-weighted openness of the plane and of space")
{
    struct Row {
        double position, plane, space;
    };
    for (const Row& row : {Row{0, 0.900496281, 0.900839989718},
                           {0.5, 0.901941932, 0.902285683758},
                           {2, 0.806393202, 0.814655370648},
                           {4, 0.735517634, 0.754097461344},
                           {6, 0.713688005, 0.7420026379},
                           {9, 0.727540889, 0.768598016672},
                           {12, 0.765761655, 0.816187684265},
                           {20, 0.904239831, 0.950540555663},
                           {24, 0.980102051, 0.995312240039}}) {
        CAPTURE(row.position);
        CHECK(rounds_to(flat_land_openness({1, 5, 100, 25}, row.position), row.plane, 9));
        CHECK(rounds_to(curtain_openness({1, 5, 100, 25}, row.position), row.space, 12));
    }
    CHECK(rounds_to(curtain_openness({1, 5, 100, 25}, 15), 0.869088825398, 12));
    CHECK(rounds_to(curtain_openness({10, 5, 100, 25}, 0), 0.296344543859, 12));
    CHECK(rounds_to(curtain_openness({10, 5, 100, 25}, 2), 0.339343864417, 12));
    CHECK(rounds_to(curtain_openness({10, 5, 100, 25}, 6), 0.573621679151, 12));
    CHECK(rounds_to(curtain_openness({10, 5, 100, 25}, 12), 0.698739907769, 12));
    CHECK(rounds_to(curtain_openness({10, 5, 100, 25}, 20), 0.869330367412, 12));
    CHECK(rounds_to(curtain_openness({30, 5, 100, 25}, 0), 0.0620666362735, 13));
    CHECK(rounds_to(curtain_openness({30, 5, 100, 25}, 6), 0.0875967030618, 13));
    CHECK(std::fabs(curtain_openness({30, 5, 100, 25}, 15) - 0.52) < 1e-15);
    CHECK(rounds_to(curtain_openness({30, 5, 100, 25}, 20), 0.643879661611, 12));
    // A thin curtain hides the difference of two walls.
    CHECK(rounds_to(1 - curtain_openness({0, 5, 100, 25}, 2), 0.1351623995328, 13));
    CHECK(rounds_to(1 - curtain_openness({0, 5, 100, 25}, 9), 0.2145494645597, 13));
    CHECK(rounds_to(1 - curtain_openness({0, 5, 100, 25}, 20), 0.04162335632795, 14));
}

TEST_CASE("a wall on the ground hides what a wall hides, in angles, cosines and space")
{
    // (distance, height, radius) and the occlusion by a perpendicular wall.
    struct Row {
        double distance, height, radius, occlusion;
    };
    for (const Row& row : {Row{1, 1e5, 2, 0.1955011094779},
                           {1, 1e5, 1.25, 0.05204401933091},
                           {0.1, 1e5, 1, 0.4364442857848},
                           {1, 1e5, 100, 0.4936339083812},
                           {1, 1, 2, 0.1312639537009},
                           {1, 0.5, 1.2, 0.03031771015839},
                           {0.5, 1, 1.5, 0.2586483735344},
                           {1, 1, 1.3, 0.06418518404668},
                           {1, 1, infinity, 0.1464466094067},
                           {1, 2, infinity, 0.27639320225},
                           {0.5, 3, infinity, 0.4178005063473},
                           {2, 0.25, infinity, 0.003861061643166}}) {
        CAPTURE(row.distance);
        CAPTURE(row.height);
        CAPTURE(row.radius);
        for (const double width : {0.0, 1.0, infinity}) {
            // The wall is the side of a box of any width; only a finite one can be seen from aside.
            if (width == infinity) continue;
            const FlatLandCurtain wall{width, 0, row.height, row.radius};
            const double hidden = 1 - curtain_openness(wall, row.distance + width / 2);
            CHECK(std::fabs(hidden - row.occlusion) < 6e-14);
        }
    }
    // To the last digits where the formula cancels: the radius barely reaches the wall.
    const double barely = 1 - curtain_openness({0, 0, 1e5, 0.5000001}, 0.5);
    CHECK(std::fabs(barely - 5.3684475e-11) < 2e-16);
    CHECK(std::fabs(hidden_angle({0, 0, 1, infinity}, 1) - pi / 4) < 1e-15);
}

TEST_CASE("the dip under the middle of the box is 2 atan(w / 2m) - atan(w / m)")
{
    for (const double width : {0.01, 0.3, 1.0, 4.0}) {
        const FlatLandCurtain curtain{width, 5, 100, 25};
        const double dip =
            flat_land_visible_angle(curtain, width / 2) - flat_land_visible_angle(curtain, 0);
        CHECK(std::fabs(dip - (2 * std::atan(width / 10) - std::atan(width / 5))) < 1e-15);
        CHECK(dip > 0);
    }
    const FlatLandCurtain curtain{1, 5, 100, 25};
    CHECK(rounds_to(flat_land_visible_angle(curtain, 0.5) - flat_land_visible_angle(curtain, 0),
                    1.942e-3, 6));
    // All the way from the middle to the edge, in every measure.
    for (const FlatLandMeasure measure : measures)
        for (int i = 0; i < 50; ++i)
            CHECK(measured(curtain, i * 0.01, measure) <
                  measured(curtain, (i + 1) * 0.01, measure));
}

// --- against the slow way -------------------------------------------------------------------------

TEST_CASE("two hundred thousand directions agree")
{
    struct Place {
        FlatLandCurtain curtain;
        double position, secondary;
    };
    for (const Place& place : {Place{{1, 5, 100, 25}, 0, 6.25},
                               {{1, 5, 100, 25}, 11.96, 6.25},
                               {{1, 5, 100, 25}, -12.1, 6.25},
                               {{1, 5, 100, 25}, 9, 12.5},
                               {{40, 3, 2, 25}, 12, 6.25},
                               {{2, 5, 4, 25}, 0, 12.5},
                               {{2, 5, 4, 25}, -8, 30}}) {
        CAPTURE(place.position);
        const Counted slow =
            count_directions(place.curtain, place.position, place.secondary, 0.5, 200000);
        CHECK(std::fabs(slow.angle - flat_land_visible_angle(place.curtain, place.position)) <
              4e-5);
        CHECK(std::fabs(slow.cosine - flat_land_openness(place.curtain, place.position)) < 2e-5);
        CHECK(std::fabs(slow.secondary - flat_land_visible_angle(place.curtain, place.position,
                                                                 place.secondary)) < 4e-5);
    }
}

TEST_CASE("random curtains: directions, secondary segments and quadrature agree")
{
    Random random;
    for (int i = 0; i < 400; ++i) {
        const FlatLandCurtain curtain = random.curtain();
        const double position = random(-1, 1) * (curtain.width / 2 + 1.2 * curtain.radius);
        const double secondary = random(0.02, 1.3) * curtain.radius, kept = random(0, 1);
        CAPTURE(curtain.width);
        CAPTURE(curtain.bottom);
        CAPTURE(curtain.height);
        CAPTURE(curtain.radius);
        CAPTURE(position);
        CAPTURE(secondary);
        constexpr int directions = 4000;
        const Counted slow = count_directions(curtain, position, secondary, kept, directions);
        // Each end of an interval is off by half a step at most; 8 bounds their number.
        CHECK(std::fabs(slow.angle - flat_land_visible_angle(curtain, position)) <
              1.5 * pi / directions);
        CHECK(std::fabs(slow.cosine - flat_land_openness(curtain, position)) <
              1.5 * pi / 2 / directions);
        CHECK(std::fabs(slow.secondary -
                        flat_land_visible_angle(curtain, position, secondary, kept)) <
              8 * 0.5 * pi / directions);
        CHECK(std::fabs(openness_by_quadrature(curtain, position) -
                        curtain_openness(curtain, position)) < 1e-11);
    }
}

TEST_CASE("both sides see the same, and the hidden interval is mirrored")
{
    Random random;
    for (int i = 0; i < 200; ++i) {
        const FlatLandCurtain curtain = random.curtain();
        const double position = random(0, curtain.width / 2 + curtain.radius);
        const FlatLandInterval right = flat_land_hidden(curtain, position),
                               left = flat_land_hidden(curtain, -position);
        CHECK(left.left == -right.right);
        CHECK(left.right == -right.left);
        CHECK(right.left <= right.right);
        for (const FlatLandMeasure measure : measures)
            CHECK(measured(curtain, position, measure) == measured(curtain, -position, measure));
        CHECK(flat_land_visible_angle(curtain, position, 0.4 * curtain.radius) ==
              flat_land_visible_angle(curtain, -position, 0.4 * curtain.radius));
    }
}

// --- limits ---------------------------------------------------------------------------------------

TEST_CASE("a curtain at the radius or above hides nothing")
{
    for (const double bottom : {25.0, 25.000001, 26.0, infinity})
        for (const double position : {-30.0, -1.0, 0.0, 0.5, 20.0}) {
            const FlatLandCurtain curtain{10, bottom, 100, 25};
            CHECK(flat_land_visible_angle(curtain, position) == pi);
            CHECK(flat_land_openness(curtain, position) == 1);
            CHECK(curtain_openness(curtain, position) == 1);
        }
    CHECK(flat_land_visible_angle({10, std::nextafter(25, 0), 100, 25}, 0) < pi);
}

TEST_CASE("a box wider than the disc hides 2 acos(m / R), and 1 - (m / R)^2 in space")
{
    for (const double bottom : {1e-9, 0.5, 5.0, 24.999}) {
        const FlatLandCurtain curtain{1000, bottom, 1, 25};
        const double reach = std::sqrt(625 - bottom * bottom), share = bottom / 25;
        for (const double position : {0.0, -100.0, 500 - reach - 1e-9}) {
            CAPTURE(bottom);
            CHECK(std::fabs(hidden_angle(curtain, position) - 2 * std::acos(share)) < 1e-13);
            CHECK(std::fabs(flat_land_openness(curtain, position) -
                            (1 - std::sqrt(1 - share * share))) < 1e-14);
            CHECK(std::fabs(curtain_openness(curtain, position) - share * share) < 1e-14);
        }
        CHECK(hidden_angle(curtain, 500 - reach + 0.01 * reach) < 2 * std::acos(share));
    }
}

TEST_CASE("everything is open where the disc ends, and not before")
{
    const FlatLandCurtain curtain{4, 7, 100, 25};  // the disc is 24 wide at its bottom
    for (const FlatLandMeasure measure : measures) {
        CHECK(measured(curtain, 26, measure) == measured(curtain, 1000, measure));
        CHECK(measured(curtain, 25.99, measure) < measured(curtain, 1000, measure));
    }
    CHECK(flat_land_visible_angle(curtain, 26) == pi);
    CHECK(curtain_openness(curtain, 26) == 1);
}

TEST_CASE("thin curtains and flat ones are limits of boxes")
{
    for (const double position : {0.0, 0.3, 2.0, 9.5, 20.0}) {
        for (const FlatLandMeasure measure : measures) {
            CHECK(std::fabs(measured({1e-9, 5, 100, 25}, position, measure) -
                            measured({0, 5, 100, 25}, position, measure)) < 1e-9);
            CHECK(std::fabs(measured({3, 5, 1e-9, 25}, position, measure) -
                            measured({3, 5, 0, 25}, position, measure)) < 1e-9);
            CHECK(std::fabs(measured({3, 1e-12, 9, 25}, position, measure) -
                            measured({3, 0, 9, 25}, position, measure)) < 1e-10);
            // As tall as the radius is endless.
            CHECK(measured({3, 5, 20, 25}, position, measure) ==
                  measured({3, 5, infinity, 25}, position, measure));
        }
    }
    // A box on the ground has the observer inside.
    CHECK(flat_land_visible_angle({3, 0, 9, 25}, 1) == 0);
    CHECK(curtain_openness({3, 0, 9, 25}, 1) < 1e-15);
    CHECK(flat_land_visible_angle({3, 0, 9, 25}, 1, 5) == 0);
}

TEST_CASE("nothing changes with the unit of length")
{
    Random random;
    for (int i = 0; i < 50; ++i) {
        const FlatLandCurtain curtain = random.curtain();
        const double position = random(0, curtain.width / 2 + curtain.radius);
        for (const double unit : {0x1p-480, 0x1p-40, 0x1p480}) {
            const FlatLandCurtain scaled{curtain.width * unit, curtain.bottom * unit,
                                         curtain.height * unit, curtain.radius * unit};
            for (const FlatLandMeasure measure : measures) {
                CHECK(measured(scaled, position * unit, measure) ==
                      measured(curtain, position, measure));
                CHECK(flat_land_has_false_maximum(scaled, measure) ==
                      flat_land_has_false_maximum(curtain, measure));
                CHECK(flat_land_darkest(scaled, measure) ==
                      flat_land_darkest(curtain, measure) * unit);
            }
        }
    }
}

// --- the false maximum ----------------------------------------------------------------------------

TEST_CASE("the false maximum is there exactly where the criterion says")
{
    // The widths at which it goes, R = 25, tall boxes.
    struct Row {
        double bottom, width;
        int decimals;
        FlatLandMeasure measure;
    };
    for (const Row& row : {Row{5, 10, 9, FlatLandMeasure::angle},
                           {12.5, 12.5, 9, FlatLandMeasure::angle},
                           {20, 10, 9, FlatLandMeasure::angle},
                           {10, 12.247, 3, FlatLandMeasure::angle},
                           {5, 6.935, 3, FlatLandMeasure::cosine},
                           {10, 9.176, 3, FlatLandMeasure::cosine},
                           {12.5, 9.580, 3, FlatLandMeasure::cosine},
                           {20, 8.010, 3, FlatLandMeasure::cosine}}) {
        CAPTURE(row.bottom);
        const double slack = 0.5 * std::pow(10.0, -row.decimals);
        CHECK(flat_land_has_false_maximum({row.width - slack, row.bottom, 100, 25}, row.measure));
        CHECK_FALSE(
            flat_land_has_false_maximum({row.width + slack, row.bottom, 100, 25}, row.measure));
    }
    CHECK_FALSE(flat_land_has_false_maximum({10, 5, 100, 25}));
    CHECK(flat_land_has_false_maximum({10, 10, 100, 25}));
    CHECK_FALSE(flat_land_has_false_maximum({0, 25, 100, 25}));
    CHECK_FALSE(flat_land_has_false_maximum({0, 0, 100, 25}));
    CHECK_FALSE(flat_land_has_false_maximum({0, 5, 0, 25}));
}

TEST_CASE("the criterion tells whether it gets darker beside the edge, in every measure")
{
    Random random;
    int count[3][2] = {};
    for (int i = 0; i < 2000; ++i) {
        FlatLandCurtain curtain = random.curtain();
        curtain.width *= 0.4;
        const double edge = curtain.width / 2;
        for (const FlatLandMeasure measure : measures) {
            const bool there = flat_land_has_false_maximum(curtain, measure);
            // So close to the edge that the slope tells, so far that rounding does not.
            const double step = 1e-5 * curtain.radius;
            const double change =
                measured(curtain, edge + step, measure) - measured(curtain, edge, measure);
            // Near the bound itself the curve is too flat for the step.
            if (std::fabs(change) < 2e-9) continue;
            CAPTURE(curtain.width);
            CAPTURE(curtain.bottom);
            CAPTURE(curtain.height);
            CAPTURE(curtain.radius);
            CHECK(there == (change < 0));
            ++count[static_cast<int>(measure)][there];
        }
    }
    for (const auto& both : count) {
        CHECK(both[0] > 200);
        CHECK(both[1] > 200);
    }
}

TEST_CASE("the darkest place is darker than every other beyond the edge, and unique")
{
    Random random;
    int found = 0;
    for (int i = 0; i < 150; ++i) {
        FlatLandCurtain curtain = random.curtain();
        curtain.width *= 0.3;
        for (const FlatLandMeasure measure : measures) {
            if (!flat_land_has_false_maximum(curtain, measure)) {
                CHECK(flat_land_darkest(curtain, measure) == curtain.width / 2);
                CHECK(flat_land_contrast(curtain, measure) == 0);
                continue;
            }
            ++found;
            CAPTURE(curtain.width);
            CAPTURE(curtain.bottom);
            CAPTURE(curtain.height);
            CAPTURE(curtain.radius);
            const double place = flat_land_darkest(curtain, measure), edge = curtain.width / 2;
            const double dark = measured(curtain, place, measure);
            CHECK(place > edge);
            // Down to it, and up from it.
            double before = measured(curtain, edge, measure);
            CHECK(std::fabs(before - dark - flat_land_contrast(curtain, measure)) < 1e-14);
            int rises_before = 0, falls_after = 0;
            for (int k = 1; k <= 200; ++k) {
                const double at = edge + (place - edge) * k / 200;
                const double value = measured(curtain, at, measure);
                rises_before += value > before + 1e-14;
                before = value;
            }
            const double end = edge + curtain.radius;
            for (int k = 1; k <= 200; ++k) {
                const double at = place + (end - place) * k / 200;
                const double value = measured(curtain, at, measure);
                falls_after += value < before - 1e-14;
                before = value;
            }
            CHECK(rises_before == 0);
            CHECK(falls_after == 0);
        }
    }
    CHECK(found > 100);
}

TEST_CASE("the darkest place and the contrast of tall curtains")
{
    CHECK(rounds_to(flat_land_darkest_thin(5, 25), 9.517714251568, 12));
    CHECK(rounds_to(flat_land_darkest_thin(12.5, 25), 11.119295219052, 12));
    CHECK(rounds_to(flat_land_darkest_thin(20, 25), 8.415485324682, 12));
    for (const double bottom : {0.1, 5.0, 12.5, 20.0, 24.9})
        CHECK(
            std::fabs(flat_land_darkest({0, bottom, 100, 25}) / flat_land_darkest_thin(bottom, 25) -
                      1) < 1e-13);
    CHECK(rounds_to(flat_land_darkest({1, 5, 100, 25}), 9.110037, 6));
    CHECK(rounds_to(flat_land_contrast({1, 5, 100, 25}), 0.542053, 6));
    CHECK(rounds_to(flat_land_contrast({1, 12.5, 100, 25}), 0.230545, 6));
    CHECK(rounds_to(flat_land_contrast({1, 20, 100, 25}), 0.047262, 6));
    CHECK(rounds_to(flat_land_contrast({5, 10, 100, 25}), 0.128668, 6));
    CHECK(rounds_to(flat_land_contrast({10, 10, 100, 25}), 0.0107, 4));
    CHECK(flat_land_darkest_thin(25, 25) == 0);
    CHECK(flat_land_darkest_thin(0, 25) == 0);
}

// --- secondary rays -------------------------------------------------------------------------------

TEST_CASE("secondary rays under a thin curtain, in closed form")
{
    const auto expected = [](double bottom, double radius, double secondary, double kept) {
        const double closed =
            std::atan(2 * secondary / radius) - std::acos(std::min(1.0, radius / (2 * bottom)));
        return pi - 2 * (1 - kept) * std::max(0.0, closed);
    };
    struct Row {
        double bottom, secondary, visible;
    };
    for (const Row& row : {Row{5, 6.25, 2.677945},
                           {12.5, 6.25, 2.677945},
                           {5, 12.5, 2.356194},
                           {12.5, 12.5, 2.356194},
                           {15, 12.5, 2.941880}}) {
        const FlatLandCurtain curtain{0, row.bottom, 100, 25};
        CHECK(rounds_to(flat_land_visible_angle(curtain, 0, row.secondary), row.visible, 6));
    }
    CHECK(flat_land_visible_angle({0, 15, 100, 25}, 0, 6.25) == pi);
    CHECK(flat_land_visible_angle({0, 20, 100, 25}, 0, 6.25) == pi);
    CHECK(flat_land_visible_angle({0, 20, 100, 25}, 0, 12.5) == pi);
    Random random;
    for (int i = 0; i < 200; ++i) {
        const double radius = random(1, 30), bottom = random(0.01, 1.2) * radius,
                     secondary = random(0, 1) * radius, kept = random(0, 1);
        CHECK(std::fabs(
                  flat_land_visible_angle({0, bottom, 10 * radius, radius}, 0, secondary, kept) -
                  expected(bottom, radius, secondary, kept)) < 1e-13);
    }
}

TEST_CASE("in the plane secondary rays halve the artefact; the one in the plane alone removes it")
{
    const FlatLandCurtain curtain{1, 5, 100, 25};
    struct Row {
        double position, halved, removed;
    };
    for (const Row& row : {Row{0, 2.542, 2.143},
                           {0.5, 2.543, 2.143},
                           {2, 2.440, 2.142},
                           {4, 2.344, 2.140},
                           {9, 2.261, 2.121},
                           {12, 2.264, 2.099},
                           {20, 2.705, 2.705}}) {
        CAPTURE(row.position);
        CHECK(rounds_to(flat_land_visible_angle(curtain, row.position, 6.25), row.halved, 3));
        CHECK(rounds_to(flat_land_visible_angle(curtain, row.position, 6.25, 0), row.removed, 3));
    }
    CHECK(rounds_to(flat_land_visible_angle(curtain, 12.1, 6.25), 2.300, 3));
    CHECK(rounds_to(flat_land_visible_angle(curtain, 12.5, 6.25), 2.380, 3));
    for (const Row& row : {Row{0, 2.228, 1.514},
                           {0.5, 2.229, 1.514},
                           {2, 2.126, 1.514},
                           {4, 2.031, 1.513},
                           {9, 1.954, 1.505}}) {
        CAPTURE(row.position);
        CHECK(rounds_to(flat_land_visible_angle(curtain, row.position, 12.5), row.halved, 3));
        CHECK(rounds_to(flat_land_visible_angle(curtain, row.position, 12.5, 0), row.removed, 3));
    }
    const auto darkest = [&](double secondary, double kept) {
        double least = infinity, place = 0;
        for (double at = 0.5; at < 25; at += 0.005)
            if (const double v = flat_land_visible_angle(curtain, at, secondary, kept); v < least) {
                least = v;
                place = at;
            }
        return FlatLandInterval{place, least};
    };
    // From the edge to the darkest place: 0.542 without them.
    const auto contrast = [&](double secondary, double kept) {
        return flat_land_visible_angle(curtain, 0.5, secondary, kept) -
               darkest(secondary, kept).right;
    };
    CHECK(std::fabs(darkest(6.25, 0.5).left - 11.96) < 0.01);
    CHECK(rounds_to(darkest(6.25, 0.5).right, 2.241, 3));
    CHECK(rounds_to(contrast(6.25, 0.5), 0.302, 3));
    CHECK(std::fabs(darkest(6.25, 0).left - 11.96) < 0.01);
    CHECK(rounds_to(darkest(6.25, 0).right, 2.053, 3));
    CHECK(rounds_to(contrast(6.25, 0), 0.089, 3));
    CHECK(std::fabs(darkest(12.5, 0.5).left - 9.5) < 0.1);
    CHECK(rounds_to(darkest(12.5, 0.5).right, 1.953, 3));
    CHECK(rounds_to(contrast(12.5, 0.5), 0.276, 3));
    CHECK(std::fabs(darkest(12.5, 0).left - 11.96) < 0.01);
    CHECK(rounds_to(darkest(12.5, 0).right, 1.494, 3));
    CHECK(rounds_to(contrast(12.5, 0), 0.020, 3));
}

TEST_CASE(
    "secondary rays only darken, by no more than 1 - kept, and see no farther than they reach")
{
    Random random;
    for (int i = 0; i < 500; ++i) {
        const FlatLandCurtain curtain = random.curtain();
        const double position = random(-1, 1) * (curtain.width / 2 + curtain.radius);
        const double secondary = random(0, 1) * curtain.radius, kept = random(0, 1);
        const double plain = flat_land_visible_angle(curtain, position);
        const double with = flat_land_visible_angle(curtain, position, secondary, kept);
        CHECK(with <= plain);
        CHECK(with >= kept * plain - 1e-14);
        CHECK(flat_land_visible_angle(curtain, position, 0) == plain);
        CHECK(flat_land_visible_angle(curtain, position, secondary, 1) == plain);
        FlatLandCurtain above = curtain;
        above.bottom = std::hypot(curtain.radius / 2, secondary) * (1 + 1e-12);
        CHECK(flat_land_visible_angle(above, position, secondary, kept) ==
              flat_land_visible_angle(above, position));
    }
}

// --- arguments that mean nothing ------------------------------------------------------------------

TEST_CASE("what is no curtain hides nothing, and nothing is ever NaN")
{
    const double odd[] = {not_a_number, -not_a_number, -1, -infinity, -1e-320};
    for (const double value : odd)
        for (int member = 0; member < 4; ++member) {
            FlatLandCurtain curtain{};
            (member == 0   ? curtain.width
             : member == 1 ? curtain.bottom
             : member == 2 ? curtain.height
                           : curtain.radius) = value;
            CAPTURE(member);
            CHECK_FALSE(nook::is_flat_land_curtain(curtain));
            CHECK(hidden_angle(curtain, 3) == 0);
            CHECK(flat_land_visible_angle(curtain, 3) == pi);
            CHECK(flat_land_visible_angle(curtain, 3, 6.25) == pi);
            for (const FlatLandMeasure measure : measures) {
                CHECK_FALSE(flat_land_has_false_maximum(curtain, measure));
                CHECK(flat_land_darkest(curtain, measure) == 0);
                CHECK(flat_land_contrast(curtain, measure) == 0);
            }
            CHECK(flat_land_openness(curtain, 3) == 1);
            CHECK(curtain_openness(curtain, 3) == 1);
        }
    CHECK_FALSE(nook::is_flat_land_curtain({1, 5, 100, 0}));
    CHECK(nook::is_flat_land_curtain({-0.0, -0.0, -0.0, 1}));
    const FlatLandCurtain curtain{};
    for (const double position : {not_a_number, infinity, -infinity}) {
        CHECK(flat_land_visible_angle(curtain, position) == pi);
        CHECK(flat_land_visible_angle(curtain, position, 6.25) == pi);
        CHECK(curtain_openness(curtain, position) == 1);
    }
    const double plain = flat_land_visible_angle(curtain, 3);
    for (const double secondary : odd)
        CHECK(flat_land_visible_angle(curtain, 3, secondary) == plain);
    CHECK(flat_land_visible_angle(curtain, 3, 6.25, not_a_number) == plain);
    CHECK(flat_land_visible_angle(curtain, 3, 6.25, 2) == plain);
    CHECK(flat_land_visible_angle(curtain, 3, 6.25, -2) ==
          flat_land_visible_angle(curtain, 3, 6.25, 0));
    for (const double value : odd) {
        CHECK(flat_land_darkest_thin(value, 25) == 0);
        CHECK(flat_land_darkest_thin(5, value) == 0);
    }
}

TEST_CASE("zeros, tiny, huge and infinite lengths in every combination give numbers in range")
{
    const double lengths[] = {0, 1e-320, 1e-160, 1e-20, 1, 25, 1e20, 1e160, 1.7e308, infinity};
    int wrong = 0;
    const auto in_range = [&](double value, double most) {
        wrong += !(value >= 0 && value <= most);
    };
    for (const double width : lengths)
        for (const double bottom : lengths)
            for (const double height : lengths)
                for (const double radius : lengths) {
                    const FlatLandCurtain curtain{width, bottom, height, radius};
                    for (const double position : lengths) {
                        in_range(flat_land_visible_angle(curtain, position), pi);
                        in_range(flat_land_openness(curtain, position), 1);
                        in_range(curtain_openness(curtain, position), 1);
                    }
                    for (const double secondary : {1e-320, 1.0, infinity})
                        in_range(flat_land_visible_angle(curtain, 1, secondary), pi);
                    for (const FlatLandMeasure measure : measures) {
                        in_range(flat_land_contrast(curtain, measure), pi);
                        in_range(flat_land_darkest(curtain, measure), infinity);
                    }
                }
    CHECK(wrong == 0);
}
