#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include <nook/scene/clip.hpp>

using nook::detail::ClipVertex;
using nook::detail::PixelGrid;
using nook::detail::Vector3;

namespace {

nook::Projection projection_of(int width, int height, bool orthographic)
{
    return {.fx = 0.8 * width,
            .fy = 0.8 * width,
            .cx = width / 2.0,
            .cy = height / 2.0,
            .orthographic = orthographic};
}

}  // namespace

TEST_CASE("an edge is cut at the same bits from either end")
{
    std::mt19937 random{31};
    std::uniform_real_distribution<double> unit{-1, 1};
    int cuts = 0;
    for (const bool orthographic : {false, true}) {
        const PixelGrid grid{projection_of(640, 480, orthographic), 640, 480, 0.1};
        for (int i = 0; i < 20000; ++i) {
            const double reach = std::exp(12 * unit(random));
            const ClipVertex a =
                grid.project({reach * unit(random), unit(random), 3 * unit(random)});
            const ClipVertex b =
                grid.project({unit(random), reach * unit(random), 3 * unit(random)});
            for (int plane = 0; plane < PixelGrid::planes; ++plane) {
                if ((grid.side(a, plane) >= 0) == (grid.side(b, plane) >= 0)) continue;
                ++cuts;
                const ClipVertex from_a = nook::detail::cut_edge(grid, plane, a, b);
                const ClipVertex from_b = nook::detail::cut_edge(grid, plane, b, a);
                CHECK(from_a.x == from_b.x);
                CHECK(from_a.y == from_b.y);
                CHECK(from_a.w == from_b.w);
                CHECK(from_a.distance == from_b.distance);
            }
        }
    }
    CHECK(cuts > 5000);
}

TEST_CASE("snapped positions are within half a grid unit and never leave the range of the integers")
{
    std::mt19937 random{32};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (const int size : {1, 2, 640, 2048, 2049, 32768}) {
        CAPTURE(size);
        const nook::Projection projection = projection_of(size, size, false);
        const PixelGrid grid{projection, size, size, 1e-4};
        CHECK(grid.bits() >= 12);
        CHECK(grid.bits() <= 16);
        if (size <= 2048) CHECK(grid.bits() == 16);
        const double units = std::ldexp(1.0, grid.bits());
        for (int i = 0; i < 2000; ++i) {
            const double distance = std::exp(8 * unit(random));
            const Vector3 view{distance * unit(random), distance * unit(random), -distance};
            const nook::PixelPoint exact = nook::pixel_point(projection, {view.x, view.y, view.z});
            const ClipVertex v = grid.project(view);
            REQUIRE(grid.inside(v));
            const auto snapped = grid.snap(v);
            CHECK(std::fabs(snapped.x - exact.x * units) < 0.5001);
            CHECK(std::fabs(snapped.y - exact.y * units) < 0.5001);
        }
        // Corners of clipped triangles that reach far out and behind the viewer.
        for (int i = 0; i < 2000; ++i) {
            const double reach = std::exp(60 * unit(random));
            const auto corner = [&]() -> Vector3 {
                const double x = unit(random), y = unit(random), z = unit(random);
                return {reach * x, reach * y, reach * z};
            };
            const Vector3 a = corner(), b = corner(), c = corner();
            const auto polygon = nook::detail::clip_triangle(grid, a, b, c);
            CHECK(polygon.count <= 8);
            for (int k = 0; k < polygon.count; ++k) {
                CHECK(std::abs(polygon.corners[k].x) <= 1 << 28);
                CHECK(std::abs(polygon.corners[k].y) <= 1 << 28);
            }
        }
    }
}
