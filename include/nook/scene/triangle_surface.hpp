#pragma once

#include <algorithm>

#include <nook/depth/projection.hpp>
#include <nook/scene/vector.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Distance and normal of one triangle as functions of the pixel.
class TriangleSurface {
public:
    TriangleSurface(const Projection& projection, double near_plane, const Vector3& a,
                    const Vector3& b, const Vector3& c)
        : projection_{projection},
          corners_{a, b, c},
          plane_{cross(b - a, c - a)},
          offset_{dot(plane_, a)}
    {
        nearest_ = (std::max)((std::min)({-a.z, -b.z, -c.z}), near_plane);
        farthest_ = (std::max)((std::max)({-a.z, -b.z, -c.z}), near_plane);
        facing_ = normalised(plane_);
        // Towards the viewer: at the origin, or along +z.
        if (projection.orthographic ? plane_.z < 0 : offset_ > 0) facing_ = -facing_;
    }
    /// The ray of a pixel centre meets the plane at (x, y, -1) · distance under perspective, at
    /// (x, y, -distance) under orthography.
    [[nodiscard]] double slope_x(int x) const
    {
        return (x + 0.5 - projection_.cx) / projection_.fx;
    }
    [[nodiscard]] double slope_y(int y) const
    {
        return (projection_.cy - (y + 0.5)) / projection_.fy;
    }

    [[nodiscard]] double distance(double x, double y) const
    {
        const double across = plane_.x * x + plane_.y * y;
        double result = nearest_;
        if (projection_.orthographic) {
            if (plane_.z != 0) result = (across - offset_) / plane_.z;
        } else if (offset_ != 0) {
            // Snapping can put a pixel of a triangle seen edge on beyond its horizon, where the
            // reciprocal has passed 0: the farthest point of the triangle is meant.
            const double reciprocal = (across - plane_.z) / offset_;
            result = reciprocal * farthest_ > 1 ? 1 / reciprocal : farthest_;
        }
        return (std::min)((std::max)(result, nearest_), farthest_);
    }
    /// The triangle's own normal, towards the viewer.
    [[nodiscard]] const Vector3& facing() const { return facing_; }

    /// The vertex normals weighted by the areas that the point cuts from the triangle.
    [[nodiscard]] Vector3 interpolate(const Vector3 (&normals)[3], double x, double y,
                                      double distance) const
    {
        const double scale = projection_.orthographic ? 1 : distance;
        const Vector3 point{x * scale, y * scale, -distance};
        Vector3 sum{0, 0, 0};
        for (int i = 0; i < 3; ++i) {
            const Vector3 from = corners_[i == 2 ? 0 : i + 1] - point;
            const Vector3 to = corners_[i == 0 ? 2 : i - 1] - point;
            sum = sum + normals[i] * (std::max)(dot(cross(from, to), plane_), 0.0);
        }
        const Vector3 result = normalised(sum);
        if (dot(result, result) == 0) return facing_;
        return dot(result, facing_) < 0 ? -result : result;
    }

private:
    Projection projection_;
    Vector3 corners_[3];
    Vector3 plane_, facing_{};
    double offset_;
    double nearest_ = 0, farthest_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
