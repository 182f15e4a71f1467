#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/scene/mesh.hpp>
#include <nook/scene/ray.hpp>

/// How a hierarchy lies in memory: nodes of eight boxes, leaves of up to eight triangles, both side by
/// side so that eight lanes read them at once.
namespace nook::inline NOOK_TARGET::detail {

/// Eight boxes. A lane holds an inner node, a block of triangles, or nothing (an empty box, which no
/// ray enters). A ray that may stop anywhere should try the last lanes first.
struct BvhNode {
    static constexpr int lanes = 8;
    /// Set in `child` for a block.
    static constexpr std::uint32_t block_bit = 0x80000000u;

    /// [axis][0 = low, 1 = high][lane]
    float bounds[3][2][lanes];
    /// An index of a node, or of a block with `block_bit`.
    std::uint32_t child[lanes];

    [[nodiscard]] Bounds box(int lane) const
    {
        Bounds result;
        for (int k = 0; k < 3; ++k) {
            result.low[k] = bounds[k][0][lane];
            result.high[k] = bounds[k][1][lane];
        }
        return result;
    }
};

/// Up to eight triangles in scene space. Lanes beyond the last one repeat a triangle of the block, face
/// and all, so that no lane needs to be masked.
struct TriangleBlock {
    static constexpr int lanes = 8;

    /// [corner][axis][lane]
    float vertices[3][3][lanes];
    std::uint32_t faces[lanes];

    [[nodiscard]] SceneTriangle triangle(int lane) const
    {
        SceneTriangle result;
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) result.vertices[i][k] = vertices[i][k][lane];
        result.face = faces[lane];
        return result;
    }
    void set(int lane, const SceneTriangle& triangle)
    {
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) vertices[i][k][lane] = triangle.vertices[i][k];
        faces[lane] = triangle.face;
    }
};

/// What a traversal reads. `root` is a node, never a block; `no_face` without triangles.
struct BvhView {
    /// A bound on the levels of nodes from the root to a block.
    static constexpr int most_levels = 64;
    /// Entries that a depth-first walk may have waiting.
    static constexpr int most_waiting = most_levels * (BvhNode::lanes - 1) + BvhNode::lanes;

    const BvhNode* nodes = nullptr;
    const TriangleBlock* blocks = nullptr;
    std::uint32_t root = no_face;

    [[nodiscard]] bool empty() const { return root == no_face; }
};

}  // namespace nook::inline NOOK_TARGET::detail
