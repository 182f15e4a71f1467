#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/sampling.hpp>
#include <nook/scene/tangent_planes.hpp>
#include <nook/scene/traced_point.hpp>
#include <nook/scene/vector.hpp>
#include <nook/work_map.hpp>

namespace nook {

/// Which triangle each pixel shows, as `rasterise` writes it, and the mesh that the ids index: the one
/// that the hierarchy was built from. `no_face` and ids beyond the mesh: as without ids.
struct SourceFaces {
    ImageView<const std::uint32_t> ids{};
    MeshView mesh{};
};

}  // namespace nook

/// Shading points of a G-buffer, one by one or a flat tile at once.
namespace nook::inline NOOK_TARGET::detail {

/// A bound on how far below its surface a shading point in view space may lie.
///
/// The depth is one step off at most, which moves the point along the ray of its pixel: |n · r| steps
/// across the surface. The rasteriser draws the surface up to `position_error` pixels from its place:
/// |n_x| / f_x and |n_y| / f_y per pixel at unit distance. The normal is a rounded float. The rest is
/// rounding in double, of coordinates as large as the viewer's, the point's and the scene's: 2⁻⁵³
/// each, times 2⁹ for the handful of operations and the thin triangles that amplify them.
[[nodiscard]] inline double point_error(const Projection& projection, const Vector3& view,
                                        const Vector3& normal, double depth_step,
                                        double position_error)
{
    const double distance = -view.z;
    const double scale = projection.orthographic ? 1 : distance;
    const Vector3 along = projection.orthographic
                              ? Vector3{0, 0, -1}
                              : Vector3{view.x / distance, view.y / distance, -1};
    const double across = std::fabs(dot(normal, along)) + rounded(0x1p-22 * (1 + largest(along)));
    const double per_pixel =
        std::fabs(normal.x) / projection.fx + std::fabs(normal.y) / projection.fy;
    return rounded(depth_step * across) + rounded(position_error * scale * per_pixel);
}
inline constexpr double rounding_error = 0x1p-44;

/// A point in world space that has been lifted off its surface by what may be wrong with it.
[[nodiscard]] inline ShadingPoint lifted_point(const Bvh& bvh, const Vector3& world,
                                               const Vector3& normal, double lift,
                                               std::uint32_t sample)
{
    return {bvh.space().to_scene(world + normal * lift), normal, normal, 0, sample};
}
/// A point in world space that lies on a triangle of the mesh, or off it along its normal.
[[nodiscard]] inline ShadingPoint point_on_face(const Bvh& bvh, const Vector3& world,
                                                const Vector3& normal, const Triangle& face,
                                                double lift, std::uint32_t sample)
{
    const Vector3 plane = normalised(cross(face.b - face.a, face.c - face.a));
    const Vector3 surface = dot(plane, normal) < 0 ? -plane : plane;
    const Vector3 foot = world - surface * dot(surface, world - face.a);
    // Vertices of coplanar triangles are rounded to float, each in its own way; across the plane by the
    // share that each axis has in its normal.
    const auto across = [&](double share, double a, double b, double c) {
        return std::fabs(share) * (std::max)({std::fabs(a), std::fabs(b), std::fabs(c)});
    };
    const double size = rounded(across(surface.x, face.a.x, face.b.x, face.c.x)) +
                        rounded(across(surface.y, face.a.y, face.b.y, face.c.y)) +
                        rounded(across(surface.z, face.a.z, face.b.z, face.c.z));
    const double slack = 0x1p-23 * size * bvh.space().scale;
    return {bvh.space().to_scene(foot + surface * lift), normal, surface, slack, sample};
}

/// Calls f(image, name) for every image that is read until one returns an error.
template <class Source, class F>
[[nodiscard]] Error check_each_input(const Source& source, const ImageView3<const float>& normals,
                                     const SourceFaces* faces, const F& f)
{
    if (const Error error = f(normals.x, "normals.x")) return error;
    if (const Error error = f(normals.y, "normals.y")) return error;
    if (const Error error = f(normals.z, "normals.z")) return error;
    if (faces != nullptr)
        if (const Error error = f(faces->ids, "faces.ids")) return error;
    return f(source.image, "depth");
}
/// What a traced kernel asks of what it reads.
template <class Source>
[[nodiscard]] Error check_traced_input(const Source& source, const ImageView3<const float>& normals,
                                       const SourceFaces* faces)
{
    if (const Error error = check_source(source)) return error;
    if (const Error error =
            check_each_input(source, normals, faces, [&](const auto& image, const char* name) {
                const Error failed = check_input(image, name);
                return failed ? failed : check_same_size(source.image, image, name);
            }))
        return error;
    return faces != nullptr ? check_mesh(faces->mesh) : Error{};
}

/// Tiles are so many pixels wide and high.
inline constexpr int traced_tile = 8;

/// Pixels from left and top up to, not including, right and bottom.
struct PixelRect {
    int left, top, right, bottom;
};

/// What a tile holds: no surface at all; active pixels of one plane and background; or anything.
enum class TilePixels { background, flat, mixed };

/// The images that a traced kernel reads.
template <class Source>
class TracedInput {
public:
    TracedInput(const Bvh& bvh, const Source& source, const ImageView3<const float>& normals,
                const SourceFaces* faces, const Projection& projection, const ViewFrame& frame,
                double position_error)
        : bvh_{bvh},
          source_{source},
          normals_{normals},
          faces_{faces},
          projection_{projection},
          axes_{frame},
          position_error_{position_error}
    {}
    [[nodiscard]] const Source& source() const { return source_; }
    [[nodiscard]] const Frame& axes() const { return axes_; }

    /// Unit length, or zero where it is zero or not finite.
    [[nodiscard]] Vector3 normal(int x, int y) const
    {
        const Vector3 stored{double{normals_.x(x, y)}, double{normals_.y(x, y)},
                             double{normals_.z(x, y)}};
        return is_finite(stored) ? normalised(stored) : Vector3{0, 0, 0};
    }
    [[nodiscard]] bool has_normal(int x, int y) const
    {
        const Vector3 stored{double{normals_.x(x, y)}, double{normals_.y(x, y)},
                             double{normals_.z(x, y)}};
        return is_finite(stored) && largest(stored) > 0;
    }
    /// The shading point of a surface pixel.
    [[nodiscard]] ShadingPoint point(int x, int y, double distance, const Vector3& normal) const
    {
        const ViewPoint at = view_point(projection_, x + 0.5, y + 0.5, distance);
        const Vector3 view{at.x, at.y, at.z};
        const double rounding = rounding_of(view);
        const Vector3 up = normalised(axes_.direction_to_world(normal));
        const Vector3 world = axes_.origin + axes_.direction_to_world(view);
        const std::uint32_t sample =
            hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
        if (const std::uint32_t id = face(x, y); id != no_face)
            return point_on_face(bvh_, world, up, mesh_triangle(faces_->mesh, id), rounding,
                                 sample);
        const double lift =
            rounded(rounding) +
            point_error(projection_, view, normal, source_.step(distance), position_error_);
        return lifted_point(bvh_, world, up, lift, sample);
    }
    /// Looks whether a tile shows one plane, and then describes its points by `planes`.
    [[nodiscard]] TilePixels scan(const PixelRect& tile, const WorkMap& work_map,
                                  TangentPlanes& planes) const;

private:
    [[nodiscard]] double rounding_of(const Vector3& view) const
    {
        return rounding_error * (largest(axes_.origin) + largest(view) + rounded(2 * bvh_.size()));
    }
    /// The usable triangle of a pixel, or none.
    [[nodiscard]] std::uint32_t face(int x, int y) const
    {
        if (faces_ == nullptr) return no_face;
        const std::uint32_t id = faces_->ids(x, y);
        return id < faces_->mesh.triangle_count && is_usable_triangle(faces_->mesh, id) ? id
                                                                                        : no_face;
    }

    const Bvh& bvh_;
    const Source& source_;
    const ImageView3<const float>& normals_;
    const SourceFaces* faces_;
    const Projection& projection_;
    Frame axes_;
    double position_error_;
};

template <class Source>
TilePixels TracedInput<Source>::scan(const PixelRect& tile, const WorkMap& work_map,
                                     TangentPlanes& planes) const
{
    // The first surface pixel says what the others must show.
    int first_x = 0, first_y = 0;
    bool any = false;
    for (int y = tile.top; y < tile.bottom && !any; ++y)
        for (int x = tile.left; x < tile.right && !any; ++x)
            if (surface_distance(source_, x, y) > 0) {
                any = true;
                first_x = x;
                first_y = y;
            }
    if (!any) return TilePixels::background;
    if (!work_map.is_active(first_x, first_y)) return TilePixels::mixed;
    const float stored[3] = {normals_.x(first_x, first_y), normals_.y(first_x, first_y),
                             normals_.z(first_x, first_y)};
    const Vector3 view_normal = normal(first_x, first_y);
    if (dot(view_normal, view_normal) == 0) return TilePixels::mixed;
    const std::uint32_t id = face(first_x, first_y);
    const std::uint32_t stored_id = faces_ != nullptr ? faces_->ids(first_x, first_y) : no_face;
    const Vector3 up = normalised(axes_.direction_to_world(view_normal));

    // Distances, and how high the points lie: with a ray (x, y, -1) per unit of distance, or from the
    // viewer's plane, height and ray are linear in the pixel.
    const auto linear = [&](const Vector3& along) {
        struct Linear {
            double x, y, start;
        };
        return Linear{along.x / projection_.fx, -along.y / projection_.fy,
                      rounded(-along.x * projection_.cx / projection_.fx) +
                          rounded(along.y * projection_.cy / projection_.fy)};
    };
    const bool flat_rays = projection_.orthographic;
    const Vector3 climbs{dot(up, axes_.right), dot(up, axes_.up), dot(up, axes_.back)};
    const auto climb = linear(climbs), lean = linear(view_normal);
    const double per_pixel = rounded(std::fabs(view_normal.x) / projection_.fx) +
                             rounded(std::fabs(view_normal.y) / projection_.fy);
    double closest = 0x1p600, farthest = 0, lowest = 0x1p700;
    for (int y = tile.top; y < tile.bottom; ++y) {
        const double climb_row = climb.start + climb.y * (y + 0.5);
        const double lean_row = lean.start + lean.y * (y + 0.5) - view_normal.z;
        for (int x = tile.left; x < tile.right; ++x) {
            const double distance = double{surface_distance(source_, x, y)};
            if (!(distance > 0)) continue;
            // By bits: under -ffast-math NaN is equal to anything.
            const auto is_stored = [&](float value, int k) {
                return std::bit_cast<std::uint32_t>(value) ==
                       std::bit_cast<std::uint32_t>(stored[k]);
            };
            if (!(is_stored(normals_.x(x, y), 0) && is_stored(normals_.y(x, y), 1) &&
                  is_stored(normals_.z(x, y), 2) && work_map.is_active(x, y)))
                return TilePixels::mixed;
            if (faces_ != nullptr && faces_->ids(x, y) != stored_id) return TilePixels::mixed;
            closest = (std::min)(closest, distance);
            farthest = (std::max)(farthest, distance);
            if (id != no_face) continue;
            const double scale = flat_rays ? 1 : distance;
            const double across = climb_row + climb.x * (x + 0.5);
            const double leaning = flat_rays ? view_normal.z : lean_row + lean.x * (x + 0.5);
            // `point_error` from below.
            const double lift = source_.step(distance) * (std::fabs(leaning) + 0x1p-23) +
                                position_error_ * scale * per_pixel;
            lowest = (std::min)(lowest, across * scale - climbs.z * distance + lift);
        }
    }

    // The corners of the part of the view that the points lie in.
    Vector3 corners[8];
    Vector3 surface = up;
    double slack = 0, safe = 0x1p700, unsafe = 0;
    for (int i = 0; i < 8; ++i) {
        const ViewPoint at = view_point(
            projection_, (i & 1) != 0 ? tile.right - 0.5 : tile.left + 0.5,
            (i & 2) != 0 ? tile.bottom - 0.5 : tile.top + 0.5, (i & 4) != 0 ? farthest : closest);
        const Vector3 view{at.x, at.y, at.z};
        const double rounding = rounding_of(view);
        safe = (std::min)(safe, rounding);
        unsafe = (std::max)(unsafe, rounding);
        const Vector3 world = axes_.origin + axes_.direction_to_world(view);
        if (id != no_face) {
            const ShadingPoint point =
                point_on_face(bvh_, world, up, mesh_triangle(faces_->mesh, id), rounding, 0);
            corners[i] = point.start;
            surface = point.surface;
            slack = point.slack;
        } else {
            const double lift = rounding + point_error(projection_, view, view_normal,
                                                       source_.step(farthest), position_error_);
            corners[i] = bvh_.space().to_scene(world + up * lift);
        }
        if (!(largest(corners[i]) < SceneRay::farthest_origin)) return TilePixels::mixed;
    }
    // Directions that would lie below the surface are a matter of each pixel.
    if (!(dot(up, surface) > 1 - 0x1p-40)) return TilePixels::mixed;
    planes.start(corners[0], surface);
    const double scale = bvh_.space().scale;
    double height = 0;
    if (id != no_face) {
        height = dot(corners[0] - corners[0], surface);
        for (const Vector3& corner : corners)
            height = (std::min)(height, dot(corner - corners[0], surface));
    } else {
        const Vector3 eye = bvh_.space().to_scene(axes_.origin) - corners[0];
        height = dot(eye, surface) + rounded((lowest + safe) * scale);
    }
    // The sums above are rounded in another order than those of `point`.
    planes.add_flat(corners, height - rounded(0x1p-4 * unsafe * scale), slack);
    planes.close();
    return TilePixels::flat;
}

}  // namespace nook::inline NOOK_TARGET::detail
