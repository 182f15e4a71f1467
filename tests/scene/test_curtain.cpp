#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/scene/flat_land.hpp>
#include <nook/scene/traced_ao.hpp>

#include "meshes.hpp"

// The ground under the curtain of Fridvalszky & Toth 2022 as rays see it, with and without secondary
// rays. The values with secondary rays were computed apart from this library, from 4.2e6 directions
// each: they are good to 1e-4.

namespace {

using meshes::Mesh;
using nook::Bvh;
using nook::FlatLandCurtain;
using nook::SecondaryRays;

using Plain = nook::TracedOptions<>;
using Secondary = nook::TracedOptions<nook::StepFalloff, SecondaryRays>;

constexpr double radius = 25;
constexpr int directions = 1 << 16;
/// Five times the spread of stratified 0/1 estimates: 0.40 N^(-3/4).
constexpr double tolerance = 5 * 1e-4;
/// The table's own error and its rounding.
constexpr double table_error = 1.5e-4;

/// The box as a mesh, z up. Nothing beyond the radius from the ground is ever reached, so a length of
/// 60 along y is endless.
Mesh curtain_mesh(const FlatLandCurtain& curtain, bool floor = false)
{
    Mesh mesh;
    const double half = curtain.width / 2;
    mesh.box({-half, -30, curtain.bottom}, {half, 30, curtain.bottom + curtain.height});
    if (floor) mesh.quad({-100, -100, 0}, {100, -100, 0}, {100, 100, 0}, {-100, 100, 0});
    return mesh;
}

/// The ground below a box.
class Ground {
public:
    explicit Ground(const FlatLandCurtain& curtain, bool floor = false)
        : mesh_{curtain_mesh(curtain, floor)}
    {
        REQUIRE(bvh_.build(mesh_.view()));
    }
    template <class Options>
    [[nodiscard]] double operator()(double position, const Options& options,
                                    std::uint32_t sample = 3) const
    {
        return nook::traced_visibility(bvh_, {position, 0, 0}, {0, 0, 1}, options, sample);
    }

private:
    Mesh mesh_;
    Bvh bvh_;
};

Plain plain(int count = directions) { return {.radius = radius, .directions = count, .seed = 11}; }
Secondary secondary(double reach, bool half_rays = false, int count = directions)
{
    return {.radius = radius,
            .directions = count,
            .seed = 11,
            .secondary = {.radius = reach, .half_rays = half_rays}};
}

constexpr FlatLandCurtain paper{1, 5, 100, radius};

}  // namespace

TEST_CASE("without secondary rays the ground is as bright as the closed form says")
{
    for (const FlatLandCurtain& curtain : {FlatLandCurtain{1, 5, 100, radius},
                                           {10, 5, 100, radius},
                                           {30, 5, 100, radius},
                                           {2, 5, 4, radius},
                                           {1, 20, 100, radius}}) {
        CAPTURE(curtain.width);
        CAPTURE(curtain.bottom);
        CAPTURE(curtain.height);
        const Ground ground{curtain};
        for (const double position : {0.0, 0.5, -4.0, 9.0, 16.0, 24.0, 45.0}) {
            CAPTURE(position);
            const double traced = ground(position, plain());
            CHECK(std::fabs(traced - nook::curtain_openness(curtain, position)) < tolerance);
        }
    }
}

TEST_CASE("with secondary rays it is as bright as the table says")
{
    struct Row {
        double position, segments, half_rays;
    };
    const Ground ground{paper};
    const auto check = [&](double reach, std::initializer_list<Row> rows) {
        for (const Row& row : rows) {
            CAPTURE(reach);
            CAPTURE(row.position);
            CHECK(std::fabs(ground(row.position, secondary(reach)) - row.segments) <
                  tolerance + table_error);
            CHECK(std::fabs(ground(row.position, secondary(reach, true)) - row.half_rays) <
                  tolerance + table_error);
        }
    };
    check(radius / 4, {{0, 0.6407, 0.7708},
                       {0.5, 0.6466, 0.7745},
                       {2, 0.6435, 0.7291},
                       {4, 0.6313, 0.6927},
                       {6, 0.6422, 0.6921},
                       {9, 0.7251, 0.7468},
                       {12, 0.8133, 0.8147},
                       {20, 0.9505, 0.9505}});
    check(radius / 2, {{0, 0.4220, 0.6614},
                       {2, 0.4534, 0.6340},
                       {4, 0.4755, 0.6148},
                       {6, 0.5053, 0.6236},
                       {9, 0.5690, 0.6688},
                       {15, 0.8083, 0.8387},
                       {20, 0.9505, 0.9505}});
}

TEST_CASE("segments of half the radius remove the false maximum: the ground brightens all the way")
{
    CHECK(nook::flat_land_has_false_maximum(paper, nook::FlatLandMeasure::space));
    const auto falls = [](const FlatLandCurtain& curtain, double step, double end, int count) {
        const Ground ground{curtain};
        int found = 0;
        double before = ground(0, secondary(radius / 2, false, count));
        for (double at = step; at <= end; at += step) {
            const double value = ground(at, secondary(radius / 2, false, count));
            found += !(value > before);
            before = value;
        }
        return found;
    };
    CHECK(falls(paper, 0.25, 24.75, directions / 2) == 0);
    CHECK(falls({1, 10, 100, radius}, 0.75, 22.5, directions / 4) == 0);
    CHECK(falls({1, 12.5, 100, radius}, 0.75, 21, directions / 4) == 0);
    CHECK(falls({5, 10, 100, radius}, 0.75, 24, directions / 4) == 0);
    CHECK(falls({10, 5, 100, radius}, 0.75, 27, directions / 4) == 0);
}

TEST_CASE("shorter segments and half rays leave some of it")
{
    const Ground ground{paper};
    const double unaided = ground(0.5, plain()) - ground(5.7, plain());
    CHECK(std::fabs(unaided - nook::flat_land_contrast(paper, nook::FlatLandMeasure::space)) <
          2 * tolerance);
    const double shorter = ground(0.9, secondary(radius / 4)) - ground(4.2, secondary(radius / 4));
    CHECK(std::fabs(shorter - 0.019) < 0.0015);
    const double halves =
        ground(0.5, secondary(radius / 2, true)) - ground(4.3, secondary(radius / 2, true));
    CHECK(std::fabs(halves - (0.6652 - 0.6146)) < 0.0015);
    CHECK(halves < unaided);
}

TEST_CASE("a curtain above the reach of the segments keeps its false maximum")
{
    // √(R²/4 + R′²) is 17.68 for R′ = R/2 and 13.98 for R′ = R/4.
    struct Case {
        double bottom, reach;
        bool helps;
    };
    for (const Case& c : {Case{20, radius / 2, false},
                          {17.7, radius / 2, false},
                          {17.0, radius / 2, true},
                          {14.0, radius / 4, false},
                          {13.5, radius / 4, true}}) {
        CAPTURE(c.bottom);
        const Ground ground{{1, c.bottom, 100, radius}};
        int changed = 0;
        for (const double at : {0.0, 0.25, 0.5, 2.0, 5.6, 12.0})
            for (const bool half_rays : {false, true})
                changed += ground(at, secondary(c.reach, half_rays)) != ground(at, plain());
        CHECK((changed > 0) == c.helps);
    }
    const Ground ground{{1, 20, 100, radius}};
    CHECK(std::fabs(ground(0.25, secondary(radius / 2)) - 0.98214) < tolerance);
    CHECK(std::fabs(ground(5.6, secondary(radius / 2)) - 0.97452) < tolerance);
}

TEST_CASE("a ground of triangles stops no secondary ray: segments end at the tangent plane")
{
    const Ground with{paper, true}, without{paper};
    for (const double reach : {radius / 4, radius / 2})
        for (const bool half_rays : {false, true})
            for (const double at : {0.0, 0.5, 4.0, 9.0, 15.0, 24.0}) {
                CAPTURE(at);
                CAPTURE(reach);
                const auto options = secondary(reach, half_rays, directions / 4);
                // The same directions; a ray that grazes an edge may fall on its other side.
                CHECK(std::fabs(with(at, options) - without(at, options)) < 20.0 / directions);
            }
}

TEST_CASE("no secondary radius is the plain result, a negative one is half the radius")
{
    const Ground ground{paper};
    for (const double at : {0.0, 0.5, 3.0, 9.0, 20.0, 24.0})
        for (const bool half_rays : {false, true}) {
            CAPTURE(at);
            const double unaided = ground(at, plain(4096));
            CHECK(ground(at, secondary(0, half_rays, 4096)) == unaided);
            CHECK(ground(at, secondary(-1, half_rays, 4096)) ==
                  ground(at, secondary(radius / 2, half_rays, 4096)));
            // They only ever darken.
            for (const double reach : {1.0, 6.25, 12.5, 30.0}) {
                const double darker = ground(at, secondary(reach, half_rays, 4096));
                CHECK(darker <= unaided);
                CHECK(darker >= 0);
            }
        }
}

TEST_CASE(
    "few directions have the secondary rays of many: the mean over sets of any size is the same")
{
    // A few primary rays may all pass by the box: their segments reach it nonetheless.
    const Ground ground{paper};
    for (const double reach : {radius / 4, radius / 2})
        for (const double at : {0.0, 4.0, 9.0}) {
            const double many = ground(at, secondary(reach));
            for (const int few : {1, 2, 3, 4, 8, 16, 64}) {
                CAPTURE(reach);
                CAPTURE(at);
                CAPTURE(few);
                const int sets = 16384 / few;
                double sum = 0;
                for (int i = 0; i < sets; ++i)
                    sum += ground(at, secondary(reach, false, few), static_cast<std::uint32_t>(i));
                // Five times 1/2, the largest spread of one direction, over the root of their number.
                CHECK(std::fabs(sum / sets - many) < 5 * 0.5 / 128);
            }
        }
}

TEST_CASE("ground that no ray can leave towards a triangle is exactly 1")
{
    const Ground ground{{1, 20, 100, radius}};
    for (const double at : {15.6, 17.0, -30.0, 1000.0}) {
        CAPTURE(at);
        CHECK(ground(at, secondary(radius / 2)) == 1);
        CHECK(ground(at, plain()) == 1);
    }
    CHECK(ground(13, plain()) < 1);
}
