#pragma once

#include <cstddef>
#include <limits>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/raster_vertex.hpp>
#include <nook/scene/vector.hpp>

/// The distance of a triangle as a function of the pixel.
namespace nook::inline NOOK_TARGET::detail {

/// The ray of a pixel leads through (x, y, −1) · distance under perspective, through
/// (x, y, −distance) under orthography: x and y are its slopes.
struct RasterSlopes {
    double scale_x, scale_y, centre_x, centre_y;

    explicit RasterSlopes(const Projection& projection)
        : scale_x{projection.fx},
          scale_y{projection.fy},
          centre_x{projection.cx},
          centre_y{projection.cy}
    {}
    /// Of samples that are `sample` pixels apart.
    [[nodiscard]] double across(int column, double sample) const
    {
        return ((column + 0.5) * sample - centre_x) / scale_x;
    }
    [[nodiscard]] double down(int row, double sample) const
    {
        return (centre_y - (row + 0.5) * sample) / scale_y;
    }
};

/// The reciprocal of the distance (perspective) or the distance (orthography) is x · slope_x +
/// y · slope_y + z; it is kept within the range of the triangle.
struct RasterSurface {
    double x, y, z;
    /// Reciprocals below it lie beyond the horizon: snapping can put a pixel of a triangle seen edge on
    /// there. The farthest point of the triangle is meant.
    double least;
    double nearest, farthest;
    /// Distances beyond the far limit may occur.
    bool cut;

    /// The distance where the slopes are x and those of a row; the same bits wherever it is asked.
    template <bool orthographic, class L>
    [[nodiscard]] NOOK_INLINE L distance(const L& slope_x, double row) const
    {
        constexpr int N = LanesTraits<L>::count;
        const L value = rounded(L{slope_x * x}) + row;
        const auto all = [](double number) NOOK_INLINE_LAMBDA { return broadcast<N>(number); };
        if constexpr (orthographic) return smaller(larger(value, all(nearest)), all(farthest));
        else
            return smaller(larger(L{1.0 / larger(value, all(least))}, all(nearest)), all(farthest));
    }
    /// What all pixels of a row share.
    [[nodiscard]] NOOK_INLINE double row(double slope_y) const { return rounded(slope_y * y) + z; }
};

/// Farther than this nothing is drawn.
[[nodiscard]] inline double raster_far_limit(const Projection& projection)
{
    constexpr double largest_float = (std::numeric_limits<float>::max)();
    return is_finite(projection.far_plane) ? smaller(projection.far_plane, largest_float)
           : projection.far_plane > 0      ? largest_float
                                           : 0;
}

/// The surface of a triangle with these corners; false when it is not usable.
[[nodiscard]] NOOK_INLINE bool find_surface(const RasterView& view, std::size_t t,
                                            const RasterVertex& a, const RasterVertex& b,
                                            const RasterVertex& c, RasterSurface& surface)
{
    const MeshView& mesh = view.mesh();
    const Triangle world = mesh_triangle(mesh, t);
    const Vector3 ab = world.b - world.a, ac = world.c - world.a, across = cross(ab, ac);
    // As `is_usable_triangle`; the coordinates are finite, or there would be no corners.
    if (!(dot(across, across) > 0x1p-100 * dot(ab, ab) * dot(ac, ac))) return false;
    const auto [normal, offset] = view.plane(across, world.a);
    surface.nearest = double{smaller(smaller(a.distance, b.distance), c.distance)};
    surface.farthest = double{larger(larger(a.distance, b.distance), c.distance)};
    // Rounded to float, the range does to floats what the exact one does; not so when distances are
    // compared with a limit.
    surface.cut = !(surface.farthest * (1 + 0x1p-22) < raster_far_limit(view.projection()));
    if (surface.cut || (a.outside | b.outside | c.outside) != 0) {
        const double distance[3] = {-view.to_view(world.a).z, -view.to_view(world.b).z,
                                    -view.to_view(world.c).z};
        const double near_plane = view.grid().near_plane();
        surface.nearest =
            larger(smaller(smaller(distance[0], distance[1]), distance[2]), near_plane);
        surface.farthest =
            larger(larger(larger(distance[0], distance[1]), distance[2]), near_plane);
    }
    const bool orthographic = view.projection().orthographic;
    surface.least = orthographic ? 0 : 1 / surface.farthest;
    const double scale = 1 / (orthographic ? normal.z : offset);
    surface.x = normal.x * scale;
    surface.y = normal.y * scale;
    surface.z = -(orthographic ? offset : normal.z) * scale;
    if (!is_finite(scale) || !is_finite(surface.x) || !is_finite(surface.y) ||
        !is_finite(surface.z)) {
        surface.x = surface.y = 0;
        surface.z = orthographic ? surface.nearest : 1 / surface.nearest;
    }
    return true;
}

}  // namespace nook::inline NOOK_TARGET::detail
