#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/clip.hpp>
#include <nook/scene/coverage.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/triangle_surface.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// What the rasteriser writes. Images that are there have one size, up to 32768 × 32768, and share
/// no memory; channels of one interleaved buffer are fine.
struct GBuffer {
    /// Distance along the view axis; +infinity where there is no surface.
    ImageView<float> depth{};
    /// Unit normal in view space; (0, 0, 0) where there is no surface. May be empty.
    ImageView3<float> normal{};
    /// Index of the triangle; `no_face` where there is no surface. May be empty.
    ImageView<std::uint32_t> face{};
};

struct RasteriseOptions {
    /// Interpolate the mesh's vertex normals, perspective-correct, instead of the triangle's own.
    /// Where they are missing, zero or not finite, the triangle's own is taken.
    bool interpolate_normals = false;
    /// Leave out what is nearer than this distance along the view axis, ≥ 0, or nearer than the
    /// projection's near plane. With both 0 the smallest normal float is the limit.
    double near_plane = 0;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Draws a mesh: at each pixel centre the nearest triangle, its distance, normal and index. Among
/// triangles at one distance (as floats) the lowest index wins.
///
/// Both sides of a triangle are drawn, whatever its winding, and its normal is turned towards the
/// viewer; an interpolated normal is turned to the side of the triangle's own. Triangles are clipped
/// at the near plane; what lies beyond the projection's far plane is left out. Unusable triangles
/// (see `is_usable_triangle`) are left out.
///
/// Vertices are snapped to 2⁻¹⁶ pixel (2⁻¹² for the largest images) and coverage is exact from there:
/// a pixel centre on an edge belongs to the triangle whose top or left edge it is, so that triangles
/// that share an edge leave no gap and hit no pixel twice. Distances come from the plane of the
/// triangle before snapping, in double, kept within the triangle's own range.
///
/// The projection may be off centre or jittered. Scratch: `rasterise_scratch_size`. Tasks are blocks
/// of the mesh and bands of rows.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome rasterise(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                  const GBuffer& buffers, const RasteriseOptions& options = {}, S&& scratch = S{},
                  E&& executor = E{});

/// Bytes of scratch that `rasterise` asks for: 32 per vertex and 4 per triangle.
[[nodiscard]] std::size_t rasterise_scratch_size(const MeshView& mesh);

namespace detail {

/// A vertex in view space and on the grid; `clipped` stands in x when it is outside a plane.
struct RasterVertex {
    static constexpr std::int32_t clipped = (std::numeric_limits<std::int32_t>::min)();
    Vector3 view;
    GridPoint grid;
};

/// The rows that a triangle may cover; empty when last < first.
struct RasterRows {
    std::uint16_t first = 1, last = 0;
};

struct RasterScratch {
    static constexpr int block = 4096;

    RasterVertex* vertices;
    RasterRows* rows;
    std::size_t size;

    explicit RasterScratch(const MeshView& mesh, void* memory = nullptr)
    {
        ScratchLayout layout{memory};
        vertices = layout.take<RasterVertex>(mesh.vertex_count);
        rows = layout.take<RasterRows>(mesh.triangle_count);
        size = layout.size();
    }
};

class Rasteriser {
public:
    static constexpr int band = 32;

    Rasteriser(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
               const GBuffer& buffers, const RasteriseOptions& options, double near_plane,
               const RasterScratch& scratch)
        : mesh_{mesh},
          frame_{frame},
          projection_{projection},
          buffers_{buffers},
          grid_{projection, buffers.depth.width, buffers.depth.height, near_plane},
          scratch_{scratch},
          interpolate_{options.interpolate_normals && mesh.normals != nullptr}
    {}

    void transform(std::size_t first, std::size_t last) const
    {
        for (std::size_t i = first; i < last; ++i) {
            const Vector3 world = mesh_position(mesh_, static_cast<std::uint32_t>(i));
            RasterVertex vertex{{0, 0, 0}, {RasterVertex::clipped, 0}};
            if (is_finite(world)) {
                vertex.view = frame_.direction_to_view(world - frame_.origin);
                const ClipVertex clip = grid_.project(vertex.view);
                if (grid_.inside(clip)) vertex.grid = grid_.snap(clip);
            }
            scratch_.vertices[i] = vertex;
        }
    }

    void find_rows(std::size_t first, std::size_t last) const
    {
        const std::int64_t half = std::int64_t{1} << (grid_.bits() - 1);
        for (std::size_t t = first; t < last; ++t) {
            scratch_.rows[t] = {};
            if (!is_usable_triangle(mesh_, t)) continue;
            std::int64_t left = INT64_MAX, right = INT64_MIN, top = INT64_MAX, bottom = INT64_MIN;
            const ClippedPolygon polygon = clipped(t);
            for (int i = 0; i < polygon.count; ++i) {
                left = (std::min)(left, std::int64_t{polygon.corners[i].x});
                right = (std::max)(right, std::int64_t{polygon.corners[i].x});
                top = (std::min)(top, std::int64_t{polygon.corners[i].y});
                bottom = (std::max)(bottom, std::int64_t{polygon.corners[i].y});
            }
            if (polygon.count == 0) continue;
            const auto ceil_pixel = [&](std::int64_t v) { return -((half - v) >> grid_.bits()); };
            const auto floor_pixel = [&](std::int64_t v) { return (v - half) >> grid_.bits(); };
            const std::int64_t first_row = (std::max)(ceil_pixel(top), std::int64_t{0});
            const std::int64_t last_row =
                (std::min)(floor_pixel(bottom), std::int64_t{buffers_.depth.height - 1});
            const bool columns =
                (std::max)(ceil_pixel(left), std::int64_t{0}) <=
                (std::min)(floor_pixel(right), std::int64_t{buffers_.depth.width - 1});
            if (columns && first_row <= last_row)
                scratch_.rows[t] = {static_cast<std::uint16_t>(first_row),
                                    static_cast<std::uint16_t>(last_row)};
        }
    }

    /// Clears and draws the rows [top, bottom]; returns the number of pixels that hold a surface.
    std::uint64_t draw(int top, int bottom) const
    {
        for (int y = top; y <= bottom; ++y)
            for (int x = 0; x < buffers_.depth.width; ++x)
                write(x, y, std::numeric_limits<float>::infinity(), {0, 0, 0}, no_face);
        std::uint64_t covered = 0;
        for (std::size_t t = 0; t < mesh_.triangle_count; ++t)
            if (scratch_.rows[t].first <= bottom && scratch_.rows[t].last >= top)
                covered += draw_triangle(t, top, bottom);
        return covered;
    }

private:
    [[nodiscard]] const RasterVertex& corner(std::size_t triangle, int i) const
    {
        return scratch_.vertices[mesh_.indices[3 * triangle + static_cast<std::size_t>(i)]];
    }
    [[nodiscard]] ClippedPolygon clipped(std::size_t triangle) const
    {
        const RasterVertex &a = corner(triangle, 0), &b = corner(triangle, 1),
                           &c = corner(triangle, 2);
        constexpr std::int32_t outside = RasterVertex::clipped;
        if (a.grid.x == outside || b.grid.x == outside || c.grid.x == outside)
            return clip_triangle(grid_, a.view, b.view, c.view);
        return {{a.grid, b.grid, c.grid}, 3};
    }

    std::uint64_t draw_triangle(std::size_t t, int top, int bottom) const
    {
        const TriangleSurface surface{projection_, grid_.near_plane(), corner(t, 0).view,
                                      corner(t, 1).view, corner(t, 2).view};
        Vector3 normals[3] = {};
        if (interpolate_) load_normals(t, normals);
        std::uint64_t covered = 0;
        const auto draw_row = [&](int y, int first, int last) {
            const double slope_y = surface.slope_y(y);
            for (int x = first; x <= last; ++x) {
                const double slope_x = surface.slope_x(x);
                const double distance = surface.distance(slope_x, slope_y);
                if (distance > projection_.far_plane || distance > largest_float) continue;
                const float stored = static_cast<float>(distance), there = buffers_.depth(x, y);
                if (!(stored < there)) continue;
                covered += is_finite(there) ? 0 : 1;
                write(x, y, stored,
                      interpolate_ ? surface.interpolate(normals, slope_x, slope_y, distance)
                                   : surface.facing(),
                      static_cast<std::uint32_t>(t));
            }
        };
        const ClippedPolygon polygon = clipped(t);
        for (int i = 2; i < polygon.count; ++i)
            TriangleCoverage{grid_.bits(), polygon.corners[0], polygon.corners[i - 1],
                             polygon.corners[i]}
                .for_each_row(buffers_.depth.width, top, bottom, draw_row);
        return covered;
    }

    void load_normals(std::size_t t, Vector3 (&normals)[3]) const
    {
        for (int i = 0; i < 3; ++i) {
            const Vector3 normal = mesh_vector(mesh_.normals, mesh_.normal_stride,
                                               mesh_.indices[3 * t + static_cast<std::size_t>(i)]);
            if (is_finite(normal)) normals[i] = frame_.direction_to_view(normalised(normal));
        }
    }

    void write(int x, int y, float distance, const Vector3& normal, std::uint32_t face) const
    {
        buffers_.depth(x, y) = distance;
        if (buffers_.normal.x.data != nullptr) {
            buffers_.normal.x(x, y) = static_cast<float>(normal.x);
            buffers_.normal.y(x, y) = static_cast<float>(normal.y);
            buffers_.normal.z(x, y) = static_cast<float>(normal.z);
        }
        if (buffers_.face.data != nullptr) buffers_.face(x, y) = face;
    }

    static constexpr float largest_float = (std::numeric_limits<float>::max)();

    const MeshView& mesh_;
    Frame frame_;
    Projection projection_;
    const GBuffer& buffers_;
    PixelGrid grid_;
    RasterScratch scratch_;
    bool interpolate_;
};

[[nodiscard]] inline Error check_gbuffer(const GBuffer& buffers)
{
    if (const Error error = check_output(buffers.depth, "buffers.depth")) return error;
    if (buffers.depth.width > largest_raster_size)
        return {ErrorCode::bad_size, "buffers.depth", double(buffers.depth.width),
                "a width of at most 32768"};
    if (buffers.depth.height > largest_raster_size)
        return {ErrorCode::bad_size, "buffers.depth", double(buffers.depth.height),
                "a height of at most 32768"};
    Error first{};
    const auto check = [&](const auto& image, const char* name, const auto&... others) {
        if (first) return;
        first = check_output(image, name);
        if (!first) first = check_same_size(buffers.depth, image, name);
        if (!first) first = check_apart(buffers.depth, image, name);
        (..., (first ? void() : void(first = check_apart(others, image, name))));
    };
    const auto& normal = buffers.normal;
    const bool normals = normal.x.data || normal.y.data || normal.z.data;
    if (normals) {
        check(normal.x, "buffers.normal.x");
        check(normal.y, "buffers.normal.y", normal.x);
        check(normal.z, "buffers.normal.z", normal.x, normal.y);
    }
    if (buffers.face.data != nullptr) {
        if (normals) check(buffers.face, "buffers.face", normal.x, normal.y, normal.z);
        else check(buffers.face, "buffers.face");
    }
    return first;
}

}  // namespace detail

inline std::size_t rasterise_scratch_size(const MeshView& mesh)
{
    return detail::RasterScratch{mesh}.size;
}

template <ScratchSource S, Executor E>
Outcome rasterise(const MeshView& mesh, const ViewFrame& frame, const Projection& projection,
                  const GBuffer& buffers, const RasteriseOptions& options, S&& scratch,
                  E&& executor)
{
    Outcome outcome{};
    const int width = buffers.depth.width, height = buffers.depth.height;
    if ((outcome.error = detail::check_gbuffer(buffers))) return outcome;
    if ((outcome.error = check_projection(projection))) return outcome;
    if (detail::is_nan(projection.far_plane))
        return {{ErrorCode::bad_value, "projection.far_plane", projection.far_plane, "a distance"}};
    if ((outcome.error = detail::check_frame(frame))) return outcome;
    if ((outcome.error = detail::check_at_least(options.near_plane, 0, "options.near_plane",
                                                "a distance >= 0")))
        return outcome;
    if ((outcome.error = check_mesh(mesh))) return outcome;
    if (buffers.depth.empty()) return outcome;

    const std::size_t size = detail::RasterScratch{mesh}.size;
    void* const block = size == 0 ? nullptr : scratch.reserve(size);
    if (block == nullptr && size != 0) return {detail::check_scratch<S>(size)};
    double near_plane = (std::max)(options.near_plane, double{(std::numeric_limits<float>::min)()});
    if (detail::is_finite(projection.near_plane))
        near_plane = (std::max)(near_plane, projection.near_plane);
    const detail::RasterScratch parts{mesh, block};
    const detail::Rasteriser rasteriser{mesh,    frame,      projection, buffers,
                                        options, near_plane, parts};

    const auto in_blocks = [&](std::size_t count, const auto& f) {
        constexpr std::size_t step = detail::RasterScratch::block;
        executor.for_each(static_cast<int>((count + step - 1) / step), [&](int task, int) {
            const std::size_t first = static_cast<std::size_t>(task) * step;
            f(first, (std::min)(first + step, count));
        });
    };
    if (mesh.triangle_count > 0) {
        in_blocks(mesh.vertex_count,
                  [&](auto first, auto last) { rasteriser.transform(first, last); });
        in_blocks(mesh.triangle_count,
                  [&](auto first, auto last) { rasteriser.find_rows(first, last); });
    }
    std::atomic<std::uint64_t> covered{0};
    constexpr int band = detail::Rasteriser::band;
    executor.for_each((height - 1) / band + 1, [&](int task, int) {
        const int top = task * band;
        covered.fetch_add(rasteriser.draw(top, (std::min)(top + band, height) - 1),
                          std::memory_order_relaxed);
    });
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.background = outcome.work.pixels - covered.load(std::memory_order_relaxed);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
