#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/clip.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>

/// Vertices of a mesh on the grid of the rasteriser.
namespace nook::inline NOOK_TARGET::detail {

struct alignas(16) RasterVertex {
    /// Bits of `outside`: the plane of PixelGrid that the vertex lies beyond, or no number at all.
    static constexpr std::int32_t no_number = 1 << PixelGrid::planes;

    std::int32_t x, y;
    /// Rounded, so that the nearest of three corners bounds the stored depths of their triangle.
    float distance;
    std::int32_t outside;
};

[[nodiscard]] inline Error check_raster_view(const ViewFrame& frame, const Projection& projection,
                                             double near_plane)
{
    if (const Error error = check_projection(projection)) return error;
    if (is_nan(projection.far_plane))
        return {ErrorCode::bad_value, "projection.far_plane", projection.far_plane, "a distance"};
    if (const Error error = check_frame(frame)) return error;
    return check_at_least(near_plane, 0, "options.near_plane", "a distance >= 0");
}

/// Near plane of a picture: nothing that is drawn has a distance of 0.
[[nodiscard]] inline double raster_near_plane(double option, const Projection& projection)
{
    const double least = larger(option, double{(std::numeric_limits<float>::min)()});
    return is_finite(projection.near_plane) ? larger(least, projection.near_plane) : least;
}

/// A mesh and the view that it is drawn from.
class RasterView {
public:
    RasterView(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
               int width, int height, double near_plane)
        : mesh_{mesh},
          frame_{frame},
          projection_{projection},
          grid_{projection, width, height, near_plane},
          normal_x_{cross(frame_.up, frame_.back)},
          normal_y_{cross(frame_.back, frame_.right)},
          normal_z_{cross(frame_.right, frame_.up)},
          volume_{dot(normal_z_, frame_.back)},
          width_{width},
          height_{height}
    {}
    [[nodiscard]] const MeshView& mesh() const { return mesh_; }
    [[nodiscard]] const Frame& frame() const { return frame_; }
    [[nodiscard]] const Projection& projection() const { return projection_; }
    [[nodiscard]] const PixelGrid& grid() const { return grid_; }
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    /// The axes are those of a mirror image.
    [[nodiscard]] bool mirrored() const { return volume_ < 0; }

    /// Writes vertices[i] for first ≤ i < last.
    void transform(std::size_t first, std::size_t last, RasterVertex* vertices) const;

    /// A point in view space.
    [[nodiscard]] Vector3 to_view(const Vector3& world) const
    {
        return frame_.direction_to_view(world - frame_.origin);
    }
    /// The normal of a plane in view space, and its product with the points of the plane. The frame
    /// may be any linear map: the product of two images is the image under its cofactors.
    struct Plane {
        Vector3 normal;
        double offset;
    };
    [[nodiscard]] Plane plane(const Vector3& normal, const Vector3& point) const
    {
        return {{dot(normal, normal_x_), dot(normal, normal_y_), dot(normal, normal_z_)},
                dot(normal, point - frame_.origin) * volume_};
    }
    [[nodiscard]] const Vector3& normal_axis(int i) const
    {
        return i == 0 ? normal_x_ : i == 1 ? normal_y_ : normal_z_;
    }
    [[nodiscard]] double volume() const { return volume_; }

    /// The part of a triangle inside all planes, with the snapped corners of its vertices there.
    [[nodiscard]] NOOK_NOINLINE ClippedPolygon clipped(std::size_t t,
                                                       const RasterVertex* vertices) const
    {
        ClippedPolygon result;
        ClipVertex ends[3];
        GridPoint snapped[3];
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t index = mesh_.indices[3 * t + i];
            if ((vertices[index].outside & RasterVertex::no_number) != 0) return result;
            ends[i] = grid_.project(to_view(mesh_position(mesh_, index)));
            snapped[i] = {vertices[index].x, vertices[index].y};
        }
        const ClipPolygon polygon = clip_polygon(grid_, ends[0], ends[1], ends[2]);
        for (int i = 0; i < polygon.count; ++i) {
            const ClipVertex& corner = polygon.corners[i];
            GridPoint& to = result.corners[result.count++];
            to = grid_.snap(corner);
            for (int k = 0; k < 3; ++k)
                if (corner.x == ends[k].x && corner.y == ends[k].y && corner.w == ends[k].w &&
                    corner.distance == ends[k].distance)
                    to = snapped[k];
        }
        return result;
    }

private:
    static constexpr int lanes = native_lanes;
    using Reals = Lanes<double, lanes>;

    /// Coordinates of vertices on their way, and what becomes of them.
    struct Batch {
        double position[3][lanes] = {};
        std::int32_t x[lanes], y[lanes], outside[lanes];
        float distance[lanes];
    };
    NOOK_INLINE void project(Batch& batch) const;

    MeshView mesh_;
    Frame frame_;
    Projection projection_;
    PixelGrid grid_;
    Vector3 normal_x_, normal_y_, normal_z_;
    double volume_;
    int width_, height_;
};

inline void RasterView::transform(std::size_t first, std::size_t last, RasterVertex* vertices) const
{
    Batch batch;
    for (std::size_t i = first; i < last; i += lanes) {
        const int count = last - i < lanes ? static_cast<int>(last - i) : lanes;
        const float* at = mesh_.positions + static_cast<std::ptrdiff_t>(i) * mesh_.position_stride;
        for (int lane = 0; lane < count; ++lane, at += mesh_.position_stride)
            for (int k = 0; k < 3; ++k) batch.position[k][lane] = double{at[k]};
        project(batch);
        for (int lane = 0; lane < count; ++lane)
            vertices[i + static_cast<std::size_t>(lane)] = {
                batch.x[lane], batch.y[lane], batch.distance[lane], batch.outside[lane]};
    }
}

inline void RasterView::project(Batch& batch) const
{
    using Integers = Lanes<std::int64_t, lanes>;
    using Narrow = Lanes<std::int32_t, lanes>;
    constexpr std::int64_t exponents = std::int64_t{0x7ff} << 52;
    constexpr std::int64_t largest_exponent = std::int64_t{1023 + 1000} << 52;
    const double guard = grid_.guard(), units = grid_.units();

    const Reals world[3] = {load<lanes>(batch.position[0]) - frame_.origin.x,
                            load<lanes>(batch.position[1]) - frame_.origin.y,
                            load<lanes>(batch.position[2]) - frame_.origin.z};
    const auto along = [&](const Vector3& axis) {
        return Reals{rounded(Reals{world[0] * axis.x}) + rounded(Reals{world[1] * axis.y}) +
                     rounded(Reals{world[2] * axis.z})};
    };
    // By bits: infinite, no number at all, or too large to be clipped.
    Integers outside{};
    const auto checked = [&](const Reals& value) {
        const auto endless = (std::bit_cast<Integers>(value) & exponents) >= largest_exponent;
        outside = endless ? broadcast<lanes>(std::int64_t{RasterVertex::no_number}) : outside;
        return endless ? Reals{} : value;
    };
    const bool orthographic = projection_.orthographic;
    const Reals distance = checked(-along(frame_.back));
    const Reals w = orthographic ? broadcast<lanes>(1.0) : distance;
    const Reals x = checked(projection_.cx * w + projection_.fx * along(frame_.right));
    const Reals y = checked(projection_.cy * w - projection_.fy * along(frame_.up));
    const auto beyond = [&](const Reals& side, int plane) {
        outside = side < 0.0 ? Integers{outside | (std::int64_t{1} << plane)} : Integers{outside};
    };
    beyond(distance - grid_.near_plane(), 0);
    beyond(guard * w + x, 1);
    beyond(guard * w - x, 2);
    beyond(guard * w + y, 3);
    beyond(guard * w - y, 4);
    store(batch.outside, convert<std::int32_t>(outside));
    store(batch.distance, convert<float>(Reals{smaller(
                              larger(distance, broadcast<lanes>(-0x1p127)),
                              broadcast<lanes>(double{(std::numeric_limits<float>::max)()}))}));

    const Reals inside_w =
        orthographic ? w : Reals{larger(w, broadcast<lanes>(grid_.near_plane()))};
    const auto snapped = [&](const Reals& value) {
        const Reals pixels = smaller(larger(Reals{value / inside_w}, broadcast<lanes>(-guard)),
                                     broadcast<lanes>(guard));
        const Reals position = pixels * units + 0.5;
        const Narrow whole = convert<std::int32_t>(position);
        // The conversion cuts towards 0.
        const Integers one =
            convert<double>(whole) > position ? broadcast<lanes>(std::int64_t{1}) : Integers{};
        return Narrow{whole - convert<std::int32_t>(one)};
    };
    store(batch.x, snapped(x));
    store(batch.y, snapped(y));
}

}  // namespace nook::inline NOOK_TARGET::detail
