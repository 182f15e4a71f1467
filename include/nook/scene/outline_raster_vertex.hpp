#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <nook/depth/projection.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/clip.hpp>
#include <nook/scene/outline_view.hpp>
#include <nook/scene/vector.hpp>

/// Vertices of outlines on the grid of pixels.
///
/// The grid has 2⁻⁸ pixel: positions stay within ± 2²³ units, edge functions below 2⁵⁰, so that double
/// precision holds them exactly and coverage is exact. The *key* of a point falls with its distance and
/// is linear on the screen for a plane: the reciprocal of the distance under perspective, its negative
/// under orthography.
namespace nook::inline NOOK_TARGET::detail {

inline constexpr int outline_bits = 8, outline_range = 23;

/// Distances are told apart from 2⁻¹²⁵ to 2¹²⁵.
inline constexpr double outline_reach = 0x1p125;

struct alignas(16) OutlineVertex {
    /// Bits of `outside`: the plane of PixelGrid that the vertex lies beyond, or no number at all.
    static constexpr std::int32_t no_number = 1 << PixelGrid::planes;

    std::int32_t x, y;
    float key;
    std::int32_t outside;
};

/// Vertices on their way: arrays of lanes.
struct OutlineBatch {
    static constexpr int lanes = native_lanes;

    double base[3][lanes] = {}, direction[3][lanes] = {};
    double x[lanes], y[lanes], w[lanes], distance[lanes];
    std::int32_t grid_x[lanes], grid_y[lanes], outside[lanes];
    float key[lanes];
};

class OutlineTransform {
public:
    OutlineTransform(const OutlineView& shells, double extent, const ViewFrame& frame,
                     const Projection& projection, double near_plane)
        : shells_{shells},
          extent_{extent},
          frame_{frame},
          projection_{projection},
          grid_{projection, near_plane, outline_bits, outline_range}
    {}

    void transform(std::size_t first, std::size_t last, OutlineVertex* vertices) const
    {
        OutlineBatch batch;
        for (std::size_t i = first; i < last; i += OutlineBatch::lanes) {
            const int count =
                static_cast<int>((std::min)(last - i, std::size_t{OutlineBatch::lanes}));
            for (int lane = 0; lane < count; ++lane)
                fill(batch, lane, i + static_cast<std::size_t>(lane));
            project(batch);
            for (int lane = 0; lane < count; ++lane)
                vertices[i + static_cast<std::size_t>(lane)] = vertex(batch, lane);
        }
    }

    /// The part of a triangle inside all planes. Vertices inside keep their place on the grid: one
    /// piece of code projects them all.
    struct Polygon {
        OutlineVertex corners[ClipPolygon::capacity];
        int count = 0;
        /// A cut at the near plane may lie in the picture, or be off by rounding.
        bool close = false;
    };
    [[nodiscard]] NOOK_NOINLINE Polygon clipped(const std::uint32_t* indices) const
    {
        ClipVertex ends[3];
        OutlineVertex snapped[3];
        OutlineBatch batch;
        for (int i = 0; i < 3; ++i) {
            fill(batch, 0, indices[i]);
            project(batch);
            ends[i] = {batch.x[0], batch.y[0], batch.w[0], batch.distance[0]};
            snapped[i] = vertex(batch, 0);
        }
        const ClipPolygon polygon = clip_polygon(grid_, ends[0], ends[1], ends[2]);
        Polygon result;
        // Cuts are off by 2⁻⁵² of the distances of the ends.
        for (const ClipVertex& end : ends)
            if (!projection_.orthographic &&
                !(larger(end.distance, -end.distance) <= 0x1p48 * grid_.near_plane()))
                result.close = true;
        for (int i = 0; i < polygon.count; ++i) {
            const ClipVertex& corner = polygon.corners[i];
            result.close = result.close || corner.distance <= 2 * grid_.near_plane();
            OutlineVertex& to = result.corners[result.count++];
            to = snap(corner);
            for (int k = 0; k < 3; ++k)
                if (corner.x == ends[k].x && corner.y == ends[k].y && corner.w == ends[k].w &&
                    corner.distance == ends[k].distance)
                    to = snapped[k];
        }
        return result;
    }

private:
    void fill(OutlineBatch& batch, int lane, std::size_t index) const
    {
        for (std::size_t k = 0; k < 3; ++k) {
            batch.base[k][lane] = double{shells_.base[3 * index + k]};
            batch.direction[k][lane] = double{shells_.direction[3 * index + k]};
        }
    }
    [[nodiscard]] static OutlineVertex vertex(const OutlineBatch& batch, int lane)
    {
        return {batch.grid_x[lane], batch.grid_y[lane], batch.key[lane], batch.outside[lane]};
    }
    [[nodiscard]] OutlineVertex snap(ClipVertex corner) const
    {
        // A cut at the near plane is off by the rounding of its ends.
        if (!projection_.orthographic) corner.w = (std::max)(corner.w, grid_.near_plane());
        const GridPoint point = grid_.snap(corner);
        const double key =
            projection_.orthographic
                ? (std::min)((std::max)(-corner.distance, -2 * outline_reach), 2 * outline_reach)
                : (std::max)(1 / corner.w, 0.5 / outline_reach);
        return {point.x, point.y, static_cast<float>(key), 0};
    }

    /// Exists once, so that a vertex has one place however it is reached.
    NOOK_NOINLINE void project(OutlineBatch& batch) const
    {
        constexpr int N = OutlineBatch::lanes;
        using Reals = Lanes<double, N>;
        using Integers = Lanes<std::int64_t, N>;
        constexpr double guard = 1 << (outline_range - outline_bits);
        constexpr double units = 1 << outline_bits;
        constexpr std::int64_t exponents = std::int64_t{0x7ff} << 52;
        constexpr std::int64_t largest_exponent = std::int64_t{1023 + 1000} << 52;

        Reals world[3];
        const double origin[3] = {frame_.origin.x, frame_.origin.y, frame_.origin.z};
        for (int k = 0; k < 3; ++k)
            world[k] = load<N>(batch.base[k]) + load<N>(batch.direction[k]) * extent_ - origin[k];
        const auto along = [&](const Vector3& axis) {
            return Reals{world[0] * axis.x + world[1] * axis.y + world[2] * axis.z};
        };
        // By bits: infinite, no number at all, or too large to be clipped.
        Integers outside{};
        const auto checked = [&](const Reals& value) {
            const auto endless = (std::bit_cast<Integers>(value) & exponents) >= largest_exponent;
            outside = endless ? broadcast<N>(std::int64_t{OutlineVertex::no_number}) : outside;
            return endless ? Reals{} : value;
        };
        const Reals right = along(frame_.right), up = along(frame_.up);
        const Reals distance = checked(-along(frame_.back));
        const bool orthographic = projection_.orthographic;
        const Reals w = orthographic ? broadcast<N>(1.0) : distance;
        const Reals x = checked(projection_.cx * w + projection_.fx * right);
        const Reals y = checked(projection_.cy * w - projection_.fy * up);
        store(batch.x, x);
        store(batch.y, y);
        store(batch.w, w);
        store(batch.distance, distance);

        const auto beyond = [&](const Reals& side, int plane) {
            outside =
                side < 0.0 ? Integers{outside | (std::int64_t{1} << plane)} : Integers{outside};
        };
        beyond(distance - grid_.near_plane(), 0);
        beyond(guard * w + x, 1);
        beyond(guard * w - x, 2);
        beyond(guard * w + y, 3);
        beyond(guard * w - y, 4);
        store(batch.outside, convert<std::int32_t>(outside));

        const Reals inside_w =
            orthographic ? w : Reals{larger(w, broadcast<N>(grid_.near_plane()))};
        const Reals reciprocal = 1.0 / inside_w;
        const auto snapped = [&](const Reals& value) {
            const Reals pixels = smaller(larger(Reals{value * reciprocal}, broadcast<N>(-guard)),
                                         broadcast<N>(guard));
            // Not negative, so that truncation rounds to the nearest unit.
            return Lanes<std::int32_t, N>{
                convert<std::int32_t>(Reals{(pixels + guard) * units + 0.5}) -
                static_cast<std::int32_t>(guard * units)};
        };
        store(batch.grid_x, snapped(x));
        store(batch.grid_y, snapped(y));
        const Reals key = orthographic ? Reals{-distance} : reciprocal;
        const double least = orthographic ? -2 * outline_reach : 0.5 / outline_reach;
        store(batch.key, convert<float>(Reals{smaller(larger(key, broadcast<N>(least)),
                                                      broadcast<N>(2 * outline_reach))}));
    }

    OutlineView shells_;
    double extent_;
    Frame frame_;
    Projection projection_;
    PixelGrid grid_;
};

}  // namespace nook::inline NOOK_TARGET::detail
