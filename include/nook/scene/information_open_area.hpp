#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>
#include <nook/scene/viewpoints.hpp>
#include <nook/scratch.hpp>

/// How much of the pictures a polygon would cover if it were alone.
namespace nook::inline NOOK_TARGET::detail {

/// What the frame of a picture and the planes of a camera leave of a triangle.
class FramedTriangle {
public:
    /// Pixels that it covers, positive when it is seen from the front.
    [[nodiscard]] static double area(const Projection& projection, double size, const Frame& frame,
                                     const Triangle& world)
    {
        FramedTriangle polygon{frame, world};
        const double half_x = size / 2 / projection.fx, half_y = size / 2 / projection.fy;
        double near_plane = double{(std::numeric_limits<float>::min)()};
        if (is_finite(projection.near_plane))
            near_plane = larger(near_plane, projection.near_plane);
        const double slope = projection.orthographic ? 0 : 1, flat = 1 - slope;
        // Each is ≥ 0 inside.
        polygon.keep([&](const Vector3& p) { return -p.z - near_plane; });
        if (is_finite(projection.far_plane))
            polygon.keep([&](const Vector3& p) { return projection.far_plane + p.z; });
        for (const double side : {-1.0, 1.0}) {
            polygon.keep(
                [&](const Vector3& p) { return half_x * (flat - slope * p.z) + side * p.x; });
            polygon.keep(
                [&](const Vector3& p) { return half_y * (flat - slope * p.z) + side * p.y; });
        }
        const auto on_screen = [&](const Vector3& p) {
            const double scale = projection.orthographic ? 1 : 1 / larger(-p.z, near_plane);
            return Vector3{p.x * scale, p.y * scale, 0};
        };
        double doubled = 0;
        for (int i = 2; i < polygon.count_; ++i) {
            const Vector3 first = on_screen(polygon.corners_[0]);
            const Vector3 a = on_screen(polygon.corners_[i - 1]) - first,
                          b = on_screen(polygon.corners_[i]) - first;
            doubled += cross(a, b).z;
        }
        return doubled / 2 * projection.fx * projection.fy;
    }

private:
    FramedTriangle(const Frame& frame, const Triangle& world)
        : corners_{frame.direction_to_view(world.a - frame.origin),
                   frame.direction_to_view(world.b - frame.origin),
                   frame.direction_to_view(world.c - frame.origin)}
    {}
    /// Cuts off where inside(point), a linear function, is negative (Sutherland & Hodgman 1974).
    template <class Inside>
    void keep(const Inside& inside)
    {
        Vector3 kept[most];
        int count = 0;
        const auto add = [&](const Vector3& p) {
            if (count < most) kept[count++] = p;
        };
        for (int i = 0; i < count_; ++i) {
            const Vector3 a = corners_[i], b = corners_[i + 1 < count_ ? i + 1 : 0];
            const double at_a = inside(a), at_b = inside(b);
            if (!(at_a < 0)) add(a);
            if ((at_a < 0) != (at_b < 0)) add(a + (b - a) * (at_a / (at_a - at_b)));
        }
        for (int i = 0; i < count; ++i) corners_[i] = kept[i];
        count_ = count;
    }

    /// Each of six planes adds a corner, and more where rounding or overflow makes an outline cross it
    /// more than twice.
    static constexpr int most = 16;
    Vector3 corners_[most];
    int count_ = 3;
};

/// The views of a mesh, sorted by how the area of a triangle in them is found: views that hold the
/// whole mesh need no clipping.
class OpenAreas {
public:
    struct Arrays {
        /// Orthographic views: towards the viewer, as long as half the pixels per area.
        double* towards[3];
        /// Perspective views: eye, axis towards the viewer, half of fx fy.
        double *eye[3], *back[3], *half_scale;
        /// Views that hold a part.
        std::uint32_t* parts;
    };
    [[nodiscard]] static Arrays take(ScratchLayout& layout, std::size_t views)
    {
        const std::size_t padded = views + native_lanes;
        Arrays arrays{};
        for (double*& array : arrays.towards) array = layout.take<double>(padded);
        for (double*& array : arrays.eye) array = layout.take<double>(padded);
        for (double*& array : arrays.back) array = layout.take<double>(padded);
        arrays.half_scale = layout.take<double>(padded);
        arrays.parts = layout.take<std::uint32_t>(views);
        return arrays;
    }

    OpenAreas(const MeshView& mesh, const BoundingSphere& sphere, const Camera* views,
              int resolution, const Arrays& arrays)
        : mesh_{mesh},
          sphere_{sphere},
          views_{views},
          size_{double(resolution)},
          arrays_{arrays}
    {}

    void add(std::size_t view)
    {
        const Projection picture =
            projection(views_[view], static_cast<int>(size_), static_cast<int>(size_));
        const Frame frame{view_frame(views_[view])};
        if (!holds_mesh(picture, frame)) {
            arrays_.parts[part_count_++] = static_cast<std::uint32_t>(view);
            return;
        }
        const double half = picture.fx * picture.fy / 2;
        if (picture.orthographic) {
            set(arrays_.towards, flat_count_++, frame.back * half);
        } else {
            set(arrays_.eye, deep_count_, frame.origin);
            set(arrays_.back, deep_count_, frame.back);
            arrays_.half_scale[deep_count_++] = half;
        }
    }
    /// Fills the last vectors up.
    void finish()
    {
        for (; flat_count_ % native_lanes != 0; ++flat_count_)
            set(arrays_.towards, flat_count_, {0, 0, 0});
        for (; deep_count_ % native_lanes != 0; ++deep_count_) {
            for (int k = 0; k < 3; ++k) {
                arrays_.eye[k][deep_count_] = arrays_.eye[k][deep_count_ - 1];
                arrays_.back[k][deep_count_] = arrays_.back[k][deep_count_ - 1];
            }
            arrays_.half_scale[deep_count_] = 0;
        }
    }

    /// Pixels that a usable triangle covers from its front, or from either side, in all views
    /// together.
    [[nodiscard]] double pixels(std::size_t triangle, bool both_sides) const
    {
        const Triangle world = mesh_triangle(mesh_, triangle);
        const Vector3 normal = cross(world.b - world.a, world.c - world.a);
        const auto shown = [&](const auto& area) {
            return larger(area, both_sides ? -area : std::remove_cvref_t<decltype(area)>{});
        };
        using Real = Lanes<double, native_lanes>;
        Real sum{};
        for (std::size_t v = 0; v < flat_count_; v += native_lanes)
            sum += shown(component(arrays_.towards[0], v) * normal.x +
                         component(arrays_.towards[1], v) * normal.y +
                         component(arrays_.towards[2], v) * normal.z);
        // The determinant of the corners seen from the eye, over the product of their distances.
        for (std::size_t v = 0; v < deep_count_; v += native_lanes) {
            Real area = component(arrays_.half_scale, v), height{};
            Real distance[3] = {Real{}, Real{}, Real{}};
            for (int k = 0; k < 3; ++k) {
                const Real eye = component(arrays_.eye[k], v), back = component(arrays_.back[k], v);
                height += (eye - coordinate(world.a, k)) * coordinate(normal, k);
                distance[0] += (eye - coordinate(world.a, k)) * back;
                distance[1] += (eye - coordinate(world.b, k)) * back;
                distance[2] += (eye - coordinate(world.c, k)) * back;
            }
            area *= height / (distance[0] * distance[1] * distance[2]);
            sum += shown(area);
        }
        double total = fold(sum, [](const auto& a, const auto& b) { return a + b; });
        for (std::size_t i = 0; i < part_count_; ++i) {
            const Camera& view = views_[arrays_.parts[i]];
            const Projection picture =
                projection(view, static_cast<int>(size_), static_cast<int>(size_));
            total += shown(FramedTriangle::area(picture, size_, Frame{view_frame(view)}, world));
        }
        return total;
    }

    /// The mesh lies in front of the near plane of a camera: nothing of it is cut open.
    [[nodiscard]] static bool is_outside(const Camera& camera, const BoundingSphere& sphere)
    {
        const Frame frame{view_frame(camera)};
        const Vector3 apart = frame.origin - vector(sphere.centre);
        return dot(apart, frame.back) - sphere.radius > camera.near_plane;
    }

private:
    [[nodiscard]] bool holds_mesh(const Projection& picture, const Frame& frame) const
    {
        const Vector3 centre = frame.direction_to_view(vector(sphere_.centre) - frame.origin);
        // `viewpoint_camera` leaves no room around the sphere but for rounding.
        const double radius = sphere_.radius * (1 - 0x1p-30), depth = -centre.z;
        const double near_plane = is_finite(picture.near_plane) ? picture.near_plane : 0;
        if (!(depth - sphere_.radius > near_plane)) return false;
        if (is_finite(picture.far_plane) && depth + sphere_.radius > picture.far_plane)
            return false;
        const auto between = [&](double across, double pixels_per_unit) {
            const double half = size_ / 2 / pixels_per_unit, off = std::fabs(across);
            if (picture.orthographic) return off + radius <= half;
            return depth * half - off >= radius * std::sqrt(1 + half * half);
        };
        return between(centre.x, picture.fx) && between(centre.y, picture.fy);
    }
    static void set(double* const (&arrays)[3], std::size_t at, const Vector3& v)
    {
        arrays[0][at] = v.x;
        arrays[1][at] = v.y;
        arrays[2][at] = v.z;
    }
    [[nodiscard]] static double coordinate(const Vector3& v, int k)
    {
        return k == 0 ? v.x : k == 1 ? v.y : v.z;
    }
    [[nodiscard]] static Lanes<double, native_lanes> component(const double* array, std::size_t at)
    {
        return load<native_lanes>(array + at);
    }

    const MeshView& mesh_;
    BoundingSphere sphere_;
    const Camera* views_;
    double size_;
    Arrays arrays_;
    std::size_t flat_count_ = 0, deep_count_ = 0, part_count_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
