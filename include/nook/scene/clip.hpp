#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include <nook/depth/projection.hpp>
#include <nook/scene/vector.hpp>

/// From view space to the fixed-point grid of the rasteriser, and clipping on the way.
///
/// Coverage is decided in integers on snapped positions, so it does not depend on the rounding,
/// contraction or reordering of any floating-point expression. Two triangles that share an edge must
/// therefore agree on two snapped points and nothing else.
namespace nook::inline NOOK_TARGET::detail {

inline constexpr int largest_raster_size = 32768;

/// A vertex before the division: it falls on pixel (x / w, y / w), with w its distance under
/// perspective and 1 under orthography.
struct ClipVertex {
    double x, y, w, distance;
};

struct GridPoint {
    std::int32_t x, y;
};

/// Pixels in fixed point. Positions stay within ± 2²⁸ units, so that edge functions, products of two
/// differences, stay below 2⁶⁰. Small images spend the range on precision: 16 sub-pixel bits up to
/// 2048 pixels, 12 at 32768.
class PixelGrid {
public:
    PixelGrid(const Projection& projection, int width, int height, double near_plane)
        : PixelGrid{projection, near_plane,
                    (std::min)(16, 27 - static_cast<int>(std::bit_width(
                                            static_cast<unsigned>((std::max)(width, height)) - 1))),
                    28}
    {}
    /// 2^bits units to a pixel, positions within ± 2^range units.
    PixelGrid(const Projection& projection, double near_plane, int bits, int range)
        : projection_{projection},
          near_plane_{near_plane},
          units_{static_cast<double>(std::int32_t{1} << bits)},
          guard_{static_cast<double>(std::int32_t{1} << (range - bits))},
          bits_{bits}
    {}
    [[nodiscard]] int bits() const { return bits_; }
    [[nodiscard]] double near_plane() const { return near_plane_; }
    /// Units to a pixel, and the largest position in pixels.
    [[nodiscard]] double units() const { return units_; }
    [[nodiscard]] double guard() const { return guard_; }

    [[nodiscard]] NOOK_NOINLINE ClipVertex project(const Vector3& view) const
    {
        const double w = projection_.orthographic ? 1 : -view.z;
        return {projection_.cx * w + projection_.fx * view.x,
                projection_.cy * w - projection_.fy * view.y, w, -view.z};
    }
    /// Signed distance from a clip plane, ≥ 0 inside: the near plane and the four sides of the guard
    /// band.
    static constexpr int planes = 5;
    [[nodiscard]] double side(const ClipVertex& v, int plane) const
    {
        switch (plane) {
        case 0: return v.distance - near_plane_;
        case 1: return guard_ * v.w + v.x;
        case 2: return guard_ * v.w - v.x;
        case 3: return guard_ * v.w + v.y;
        default: return guard_ * v.w - v.y;
        }
    }
    [[nodiscard]] bool inside(const ClipVertex& v) const
    {
        for (int plane = 0; plane < planes; ++plane)
            if (!(side(v, plane) >= 0)) return false;
        return true;
    }
    /// The nearest point of the grid; `v` is inside every plane, up to rounding.
    [[nodiscard]] NOOK_NOINLINE GridPoint snap(const ClipVertex& v) const
    {
        const auto coordinate = [&](double value) {
            const double clamped = (std::min)((std::max)(value / v.w, -guard_), guard_);
            return static_cast<std::int32_t>(std::floor(clamped * units_ + 0.5));
        };
        return {coordinate(v.x), coordinate(v.y)};
    }

private:
    Projection projection_;
    double near_plane_;
    double units_ = 1, guard_ = 1;
    int bits_ = 0;
};

/// Where the edge between two vertices crosses a plane. The ends are put in order first and the code
/// exists once, so both triangles at an edge get the same bits.
NOOK_NOINLINE inline ClipVertex cut_edge(const PixelGrid& grid, int plane, ClipVertex a,
                                         ClipVertex b)
{
    const bool ordered = a.distance != b.distance ? a.distance < b.distance
                         : a.x != b.x             ? a.x < b.x
                                                  : a.y <= b.y;
    if (!ordered) std::swap(a, b);
    const double from = grid.side(a, plane), to = grid.side(b, plane);
    const double t = from / (from - to);
    return {a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t, a.w + (b.w - a.w) * t,
            a.distance + (b.distance - a.distance) * t};
}

/// The part of a triangle inside all planes: a convex polygon.
struct ClipPolygon {
    static constexpr int capacity = 3 + PixelGrid::planes;
    ClipVertex corners[capacity];
    int count = 0;
};
[[nodiscard]] inline ClipPolygon clip_polygon(const PixelGrid& grid, const ClipVertex& a,
                                              const ClipVertex& b, const ClipVertex& c)
{
    ClipPolygon polygon{{a, b, c}, 3};
    for (int plane = 0; plane < PixelGrid::planes && polygon.count > 0; ++plane) {
        const ClipPolygon whole = polygon;
        int kept = 0;
        for (int i = 0; i < whole.count; ++i) {
            const ClipVertex& from = whole.corners[i];
            const ClipVertex& to = whole.corners[i + 1 == whole.count ? 0 : i + 1];
            const bool from_inside = grid.side(from, plane) >= 0;
            const bool to_inside = grid.side(to, plane) >= 0;
            // Rounding can make a polygon that is no longer convex; never more corners than fit.
            if (from_inside && kept < ClipPolygon::capacity) polygon.corners[kept++] = from;
            if (from_inside != to_inside && kept < ClipPolygon::capacity)
                polygon.corners[kept++] = cut_edge(grid, plane, from, to);
        }
        polygon.count = kept;
    }
    return polygon;
}

/// A triangle inside all planes: a convex polygon of snapped corners. An edge between two vertices
/// inside all planes keeps exactly their snapped points, clipped or not.
struct ClippedPolygon {
    GridPoint corners[ClipPolygon::capacity];
    int count = 0;
};
[[nodiscard]] inline ClippedPolygon clip_triangle(const PixelGrid& grid, const Vector3& a,
                                                  const Vector3& b, const Vector3& c)
{
    const ClipPolygon polygon =
        clip_polygon(grid, grid.project(a), grid.project(b), grid.project(c));
    ClippedPolygon result;
    for (int i = 0; i < polygon.count; ++i)
        result.corners[result.count++] = grid.snap(polygon.corners[i]);
    return result;
}

}  // namespace nook::inline NOOK_TARGET::detail
