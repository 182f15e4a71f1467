#pragma once

#include <cstddef>
#include <cstdint>

namespace nook {

/// A view of outlines: closed shells around objects that grow with an extent e, the distance by which
/// they are pushed out. Vertex i lies at base[3 i + k] + e * direction[3 i + k], k = 0, 1, 2, in world
/// space, so that one preprocessing serves every extent. Nothing is owned, copied or changed.
///
/// Triangle t has the vertices indices[3 t], indices[3 t + 1], indices[3 t + 2], in counter-clockwise
/// order seen from outside. Counts are meaningful when the shells are closed: each directed edge is
/// cancelled by as many of the opposite direction. `OutlineShell` makes such shells of any mesh; any
/// other source will do.
struct OutlineView {
    /// 3 * vertex_count floats: x, y, z of each vertex, tight. Null without vertices.
    const float* base = nullptr;
    /// 3 * vertex_count floats: how far a vertex moves per unit of extent.
    const float* direction = nullptr;
    std::size_t vertex_count = 0;
    /// 3 * triangle_count, each below vertex_count.
    const std::uint32_t* indices = nullptr;
    /// At most 2³¹ − 1.
    std::size_t triangle_count = 0;
};

}  // namespace nook
