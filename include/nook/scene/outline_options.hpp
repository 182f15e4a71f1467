#pragma once

#include <cstdint>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/memory.hpp>

namespace nook {

/// Which way the vertices of a shell move. Extent e is what a vertex, or a face, is moved by.
enum class OutlineMethod : std::uint8_t {
    /// Away from the centre of the object's box; its farthest vertex moves by e, others by less in
    /// proportion. Cube: faces move by e/√3. Flat objects stay flat.
    scaling,
    /// By e along the unit average of the face normals, weighted by angle. Cube: faces move by e/√3.
    vertex_normals,
    /// By the plain average of the different face normals at a position. Cube: faces move by e/3.
    integrated_normals,
    /// By the vector x with n · x = 1 for each different face normal n at a position (least squares,
    /// then lengthened until none falls short): every face moves by e. Where the faces do not agree on
    /// an x, the shortest that moves all of them by e or more is nearly taken.
    mitre,
};

struct OutlineOptions {
    OutlineMethod method = OutlineMethod::mitre;
    /// Vertices no farther apart than this become one: world units, >= 0. 0: those with equal
    /// coordinates, which joins faces that were split for their normals or texture.
    double weld = 0;
    /// Face normals that differ by less are one: radians, 0 to π/2. Large enough for the rounding of
    /// the coordinates within a face that is cut into several triangles.
    double normal_tolerance = 1e-3;
    /// Leaves concave vertices where they are: those with an edge across which the surface bends inward
    /// by more than `normal_tolerance`. Where they would pierce a wall nearby they do not then; the
    /// shell runs out to nothing towards them, so no extent covers a radius there.
    bool skip_concave = false;
    /// A vertex moves by at most this times e: 1 to 1000. Where the mitre would be longer (an edge
    /// sharper than 29° for 4), edge or vertex is cut off at a distance of e instead, and the vertex
    /// becomes several. Faces still move by e. Boundaries of open surfaces are such edges. `scaling`
    /// does not need it; the averages use it to tell which edges to cut.
    double mitre_limit = 4;
    /// Where the shell and the builder's working memory come from.
    Memory memory{};
};

/// What hangs together across edges after welding. Bodies that only touch at a vertex or along an edge
/// are several objects.
struct OutlineObject {
    /// Its triangles in the shell.
    std::uint32_t first_triangle = 0, triangle_count = 0;
    /// It had a boundary, and became a slab: outlines of both of its sides.
    bool open = false;
    /// It is closed and turned inside out, as a room that is seen from inside. Its solid is all the
    /// rest of space, and the signed count is one lower everywhere than if that were counted.
    bool inward = false;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET::detail {

[[nodiscard]] inline Error check_outline_options(const OutlineOptions& options)
{
    if (static_cast<int>(options.method) > static_cast<int>(OutlineMethod::mitre))
        return {ErrorCode::bad_value, "options.method", double(static_cast<int>(options.method)),
                "a method of the enumeration"};
    if (const Error error = check_at_least(options.weld, 0, "options.weld", "finite and >= 0"))
        return error;
    if (!is_finite(options.normal_tolerance) || options.normal_tolerance < 0 ||
        options.normal_tolerance > 1.5707963267948966)
        return {ErrorCode::bad_value, "options.normal_tolerance", options.normal_tolerance,
                "0 to pi / 2"};
    if (!is_finite(options.mitre_limit) || options.mitre_limit < 1 || options.mitre_limit > 1000)
        return {ErrorCode::bad_value, "options.mitre_limit", options.mitre_limit, "1 to 1000"};
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
