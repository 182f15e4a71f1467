#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <nook/outcome.hpp>
#include <nook/scene/convex_hull_build.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>

namespace nook {

struct ConvexHullOptions {
    /// Where the hull and the builder's working memory come from: about 250 bytes per point, of
    /// which the hull keeps 16 per vertex and 12 per triangle.
    Memory memory{};
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// The convex hull of points, as a closed mesh wound anticlockwise as seen from outside: each
/// directed edge has its opposite. Copies what it needs: the points may go after `build`.
///
/// Points are put on a grid of 2²⁹ cells along the longest side of their box, or half as many,
/// finer than floats of the size of the box, and every decision is exact from there (quickhull,
/// Barber, Dobkin & Huhdanpaa 1996, without the tolerances). Faces of more than three corners are
/// cut into fans, and points inside a face or an edge are no vertices of the mesh: it has as few as
/// there can be. Vertices lie where their points do, unrounded.
class ConvexHull {
public:
    ConvexHull() = default;
    ConvexHull(ConvexHull&& other) noexcept { swap(other); }
    ConvexHull& operator=(ConvexHull&& other) noexcept
    {
        ConvexHull taken{std::move(other)};
        swap(taken);
        return *this;
    }

    /// Builds from `count` points, at most 2³¹ − 1, point i at points[i * stride + 0, 1, 2], in
    /// place of what was there; on an error it is left as it was. Points with a coordinate that is
    /// not finite are left out. No triangles come from fewer than four points or from flat ones:
    /// all within 2⁻²¹ of their largest coordinate from one plane, which is what rounding to floats
    /// leaves of a plane. O(n log n) on common inputs, no recursion.
    [[nodiscard]] Outcome build(const float* points, std::size_t count, std::ptrdiff_t stride = 3,
                                const ConvexHullOptions& options = {});

    /// The hull; valid until the next build. Empty for flat points.
    [[nodiscard]] MeshView mesh() const
    {
        return {positions_, vertex_count_, indices_, triangle_count_};
    }
    [[nodiscard]] std::size_t vertex_count() const { return vertex_count_; }
    [[nodiscard]] std::size_t triangle_count() const { return triangle_count_; }
    /// For each vertex the index of its point, one of them where several lie in one cell of the
    /// grid.
    [[nodiscard]] const std::uint32_t* points() const { return points_; }
    /// No finite point lies farther than this outside the hull: √3 cells of the grid, world units;
    /// below 7e-9 of the longest side of the box. 0 for an empty hull.
    [[nodiscard]] double tolerance() const { return tolerance_; }
    /// Points that were left out because they are not finite.
    [[nodiscard]] std::size_t dropped() const { return dropped_; }
    /// Bytes kept.
    [[nodiscard]] std::size_t memory_size() const { return block_.size(); }

private:
    void swap(ConvexHull& other) noexcept
    {
        std::swap(block_, other.block_);
        std::swap(positions_, other.positions_);
        std::swap(indices_, other.indices_);
        std::swap(points_, other.points_);
        std::swap(vertex_count_, other.vertex_count_);
        std::swap(triangle_count_, other.triangle_count_);
        std::swap(dropped_, other.dropped_);
        std::swap(tolerance_, other.tolerance_);
    }
    detail::Block block_;
    float* positions_ = nullptr;
    std::uint32_t *indices_ = nullptr, *points_ = nullptr;
    std::size_t vertex_count_ = 0, triangle_count_ = 0, dropped_ = 0;
    double tolerance_ = 0;
};

inline Outcome ConvexHull::build(const float* points, std::size_t count, std::ptrdiff_t stride,
                                 const ConvexHullOptions& options)
{
    if (count >= std::size_t{1} << 31)
        return {{ErrorCode::bad_size, "count", double(count), "at most 2^31 - 1 points"}};
    if (points == nullptr && count > 0)
        return {{ErrorCode::null_data, "points", 0, "three floats per point"}};
    const auto out_of_memory = [](std::size_t bytes) -> Outcome {
        return {{ErrorCode::out_of_memory, "options.memory", double(bytes), "that many bytes"}};
    };
    detail::HullBuilder builder{points, count, stride};
    detail::Block work;
    if (const std::size_t lacking = detail::allocate_arrays(
            work, options.memory, [&](detail::ScratchLayout& arrays) { builder.take(arrays); }))
        return out_of_memory(lacking);
    builder.snap();
    ConvexHull result;
    result.dropped_ = builder.dropped();
    if (builder.start()) {
        builder.expand();
        builder.find_faces();
        result.vertex_count_ = builder.vertex_count();
        result.triangle_count_ = 2 * builder.vertex_count() - 4;
        if (const std::size_t lacking = detail::allocate_arrays(
                result.block_, options.memory, [&](detail::ScratchLayout& arrays) {
                    result.positions_ = arrays.take<float>(3 * result.vertex_count_);
                    result.indices_ = arrays.take<std::uint32_t>(3 * result.triangle_count_);
                    result.points_ = arrays.take<std::uint32_t>(result.vertex_count_);
                }))
            return out_of_memory(lacking);
        builder.write(result.positions_, result.indices_, result.points_);
        result.tolerance_ = std::sqrt(3.0) * builder.cell();
    }
    *this = std::move(result);
    return {};
}

}  // namespace nook::inline NOOK_TARGET
