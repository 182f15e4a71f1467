#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/outline_build.hpp>
#include <nook/scene/outline_file.hpp>
#include <nook/scene/outline_options.hpp>
#include <nook/scene/outline_view.hpp>

namespace nook::inline NOOK_TARGET {

/// Outlines around the objects of a mesh (Park & Baek 2021): closed shells that grow with an extent.
/// Where a visible surface lies in two shells or more, something else is near, and ambient occlusion is
/// worth computing; `outline_mask` counts them.
///
/// Shells are closed for any mesh: each directed edge is cancelled by one in the opposite direction.
/// - The winding of triangles tells the outside. Triangles of a component that can agree on one are
///   turned to what most of its area says; a component that cannot (a Möbius strip) is cut where it
///   disagrees, and open.
/// - An object with a boundary becomes a slab: the outlines of both of its sides, joined by a rim that
///   moves beyond the boundary by e as well. So does one that is closed but for triangles that are
///   left out.
/// - A sheet with two sides, of triangles in both windings, becomes a slab in the same way.
/// - Where more than two triangles share an edge, those that bound a wedge of solid belong together:
///   boxes that touch remain objects of their own, with outlines that overlap.
/// - Closed objects seen from inside keep their outlines on the inside: see OutlineObject::inward.
///
/// Copies what it needs: the mesh may go after `build`. Without triangles it is empty.
class OutlineShell {
public:
    OutlineShell() = default;
    OutlineShell(OutlineShell&& other) noexcept { swap(other); }
    OutlineShell& operator=(OutlineShell&& other) noexcept
    {
        OutlineShell taken{std::move(other)};
        swap(taken);
        return *this;
    }

    /// Builds from a mesh, in place of what was there; on an error it is left as it was. A simplified
    /// mesh of your own, around the one that is drawn, is built in the same way: what it keeps away
    /// from the drawn surface adds to every extent. Normals of the mesh are not read. Unusable
    /// triangles are left out (`is_usable_triangle`), also those that welding makes so. At most 2²⁶
    /// triangles: their shells have no more than an OutlineView may. About linear in time.
    [[nodiscard]] Outcome build(const MeshView& mesh, const OutlineOptions& options = {});

    /// What the stencil reads: valid until the shell is built or loaded anew, or destroyed. Triangles
    /// of one object lie side by side.
    [[nodiscard]] OutlineView view() const { return view_; }
    /// Writes the vertices at an extent in world units, >= 0: 3 * view().vertex_count floats,
    /// tight. Computed in double and rounded once; what exceeds the floats becomes the largest.
    [[nodiscard]] Outcome extrude(double extent, float* positions) const;

    /// The least distance that a face moves at extent 1, over the corners of all faces and over the
    /// planes that cut off sharp edges: the share of the extent that a mask can count on. All points
    /// within face_offset() * e of a convex object, beyond its edges too, are in its shell at extent e
    /// (for a `mitre_limit` of 2 or more). 0 or negative where a face does not move out at all; infinity
    /// without faces. 1 for the mitre, but for the rounding of directions to float, and less where a wide
    /// `normal_tolerance` takes the faces of a sharp corner for one. Not included is the rounding of
    /// positions.
    [[nodiscard]] double face_offset() const { return face_offset_; }
    /// The least over the corners of one triangle; infinity for a joint, whose base has no area.
    [[nodiscard]] double face_offset(std::size_t triangle) const;
    /// The extent at which every face has moved by `radius` at least, so that the mask misses nothing
    /// within it; infinity where no extent is enough (`face_offset() <= 0`).
    [[nodiscard]] double needed_extent(double radius) const;

    [[nodiscard]] std::size_t object_count() const { return object_count_; }
    /// i < object_count(), in the order of their first triangles in the mesh.
    [[nodiscard]] const OutlineObject& object(std::size_t i) const { return objects_[i]; }
    /// The object of a triangle of the shell. O(log objects).
    [[nodiscard]] std::size_t object_of(std::size_t triangle) const;
    /// Closed objects that are turned inside out. Each makes the signed count one lower everywhere:
    /// with a room around the scene, a threshold of 2 becomes 1.
    [[nodiscard]] std::size_t inward_count() const;
    /// Triangles of the mesh that were left out; 0 for a loaded shell.
    [[nodiscard]] std::size_t dropped() const { return dropped_; }

    /// Bytes that `save` writes. The format is that of outline_file.hpp, the same on every machine.
    [[nodiscard]] std::size_t saved_size() const
    {
        return static_cast<std::size_t>(counts().size());
    }
    /// Writes saved_size() bytes; `size` is what there is room for, any alignment.
    [[nodiscard]] Outcome save(void* data, std::size_t size) const;
    /// Reads exactly what `save` wrote, in place of what was there. Everything is checked; on an error
    /// the shell is left as it was.
    [[nodiscard]] Outcome load(const void* data, std::size_t size, const Memory& memory = {});

private:
    void swap(OutlineShell& other) noexcept
    {
        std::swap(block_, other.block_);
        std::swap(view_, other.view_);
        std::swap(objects_, other.objects_);
        std::swap(object_count_, other.object_count_);
        std::swap(dropped_, other.dropped_);
        std::swap(face_offset_, other.face_offset_);
    }
    [[nodiscard]] detail::ShellCounts counts() const
    {
        return {view_.vertex_count, view_.triangle_count, object_count_, face_offset_};
    }
    /// Gets memory for the arrays and shows them; returns how many bytes could not be had.
    [[nodiscard]] std::size_t allocate(const detail::ShellCounts& counts, const Memory& memory,
                                       detail::ShellArrays& arrays);

    detail::Block block_;
    OutlineView view_{};
    const OutlineObject* objects_ = nullptr;
    std::size_t object_count_ = 0, dropped_ = 0;
    double face_offset_ = std::numeric_limits<double>::infinity();
};

inline Outcome OutlineShell::build(const MeshView& mesh, const OutlineOptions& options)
{
    if (const Error error = check_mesh(mesh)) return {error};
    // A shell has two faces for each, and joints: 13 triangles a face.
    if (mesh.triangle_count > std::size_t{1} << 26)
        return {{ErrorCode::bad_size, "mesh.triangle_count", double(mesh.triangle_count),
                 "at most 2^26 triangles"}};
    if (const Error error = detail::check_outline_options(options)) return {error};
    const auto out_of_memory = [](std::size_t bytes) -> Outcome {
        return {{ErrorCode::out_of_memory, "options.memory", double(bytes), "that many bytes"}};
    };
    detail::OutlineBuilder builder{mesh, options};
    if (const std::size_t lacking = builder.prepare()) return out_of_memory(lacking);
    OutlineShell result;
    detail::ShellArrays arrays{};
    const detail::ShellCounts counts{builder.vertex_count(), builder.triangle_count(),
                                     builder.object_count(), 0};
    if (const std::size_t lacking = result.allocate(counts, options.memory, arrays))
        return out_of_memory(lacking);
    builder.write(arrays.base, arrays.direction, arrays.indices, arrays.objects);
    result.dropped_ = builder.dropped();
    result.face_offset_ = builder.face_offset();
    *this = std::move(result);
    return {};
}

inline std::size_t OutlineShell::allocate(const detail::ShellCounts& counts, const Memory& memory,
                                          detail::ShellArrays& arrays)
{
    const auto vertices = static_cast<std::size_t>(counts.vertices);
    const auto triangles = static_cast<std::size_t>(counts.triangles);
    object_count_ = static_cast<std::size_t>(counts.objects);
    const std::size_t lacking =
        detail::allocate_arrays(block_, memory, [&](detail::ScratchLayout& layout) {
            arrays.base = layout.take<float>(3 * vertices);
            arrays.direction = layout.take<float>(3 * vertices);
            arrays.indices = layout.take<std::uint32_t>(3 * triangles);
            arrays.objects = layout.take<OutlineObject>(object_count_);
        });
    view_ = {arrays.base, arrays.direction, vertices, arrays.indices, triangles};
    objects_ = arrays.objects;
    return lacking;
}

inline Outcome OutlineShell::extrude(double extent, float* positions) const
{
    if (const Error error = detail::check_at_least(extent, 0, "extent", "finite and >= 0"))
        return {error};
    if (positions == nullptr && view_.vertex_count > 0)
        return {{ErrorCode::null_data, "positions", 0, "three floats per vertex of the shell"}};
    constexpr double most = (std::numeric_limits<float>::max)();
    for (std::size_t i = 0; i < 3 * view_.vertex_count; ++i) {
        const double moved =
            double{view_.base[i]} + detail::rounded(extent * double{view_.direction[i]});
        positions[i] = static_cast<float>((std::min)((std::max)(moved, -most), most));
    }
    return {};
}

inline double OutlineShell::face_offset(std::size_t triangle) const
{
    using detail::mesh_vector, detail::Vector3;
    const MeshView mesh{view_.base, view_.vertex_count, view_.indices, view_.triangle_count};
    double least = std::numeric_limits<double>::infinity();
    if (!is_usable_triangle(mesh, triangle)) return least;
    const auto [a, b, c] = detail::mesh_triangle(mesh, triangle);
    const Vector3 normal = normalised(cross(b - a, c - a));
    for (std::size_t i = 0; i < 3; ++i)
        least = (std::min)(
            least, dot(normal, mesh_vector(view_.direction, 3, view_.indices[3 * triangle + i])));
    return least;
}

inline double OutlineShell::needed_extent(double radius) const
{
    if (!(radius > 0) || detail::is_nan(radius) || view_.triangle_count == 0) return 0;
    if (!(face_offset_ > 0)) return std::numeric_limits<double>::infinity();
    return radius / face_offset_;
}

inline std::size_t OutlineShell::object_of(std::size_t triangle) const
{
    std::size_t first = 0, count = object_count_;
    while (count > 1) {
        const std::size_t half = count / 2;
        if (objects_[first + half].first_triangle <= triangle) {
            first += half;
            count -= half;
        } else {
            count = half;
        }
    }
    return first;
}

inline std::size_t OutlineShell::inward_count() const
{
    std::size_t count = 0;
    for (std::size_t i = 0; i < object_count_; ++i) count += objects_[i].inward ? 1 : 0;
    return count;
}

inline Outcome OutlineShell::save(void* data, std::size_t size) const
{
    if (size < saved_size())
        return {{ErrorCode::bad_size, "size", double(size), "at least saved_size()"}};
    if (data == nullptr) return {{ErrorCode::null_data, "data", 0, "saved_size() bytes"}};
    detail::write_shell(counts(), view_, objects_, data);
    return {};
}

inline Outcome OutlineShell::load(const void* data, std::size_t size, const Memory& memory)
{
    detail::ShellCounts counts{};
    if (const Error error = detail::check_shell(data, size, counts)) return {error};
    OutlineShell result;
    detail::ShellArrays arrays{};
    if (const std::size_t lacking = result.allocate(counts, memory, arrays))
        return {{ErrorCode::out_of_memory, "memory", double(lacking), "that many bytes"}};
    if (const Error error = detail::read_shell(counts, data, arrays)) return {error};
    result.face_offset_ = counts.face_offset;
    *this = std::move(result);
    return {};
}

}  // namespace nook::inline NOOK_TARGET
