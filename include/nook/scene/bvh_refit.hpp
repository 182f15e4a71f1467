#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/scene/bvh_build.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/ray.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Reads the triangles of a block again. Those that are not usable shrink to a point.
[[nodiscard]] inline Bounds refit_block(const MeshView& mesh, const SceneSpace& space,
                                        TriangleBlock& block)
{
    fill_block(mesh, space, block);
    Bounds box = Bounds::nothing();
    for (int lane = 0; lane < TriangleBlock::lanes; ++lane) {
        if (is_usable_triangle(mesh, block.faces[lane])) {
            box.include(block.triangle(lane).bounds());
        } else {
            for (auto& corner : block.vertices)
                for (auto& axis : corner) axis[lane] = 0;
        }
    }
    return box;
}

/// All boxes of a node together.
[[nodiscard]] inline Bounds node_box(const BvhNode& node)
{
    Bounds box = Bounds::nothing();
    for (int lane = 0; lane < BvhNode::lanes; ++lane) box.include(node.box(lane));
    return box;
}

/// Brings the triangles of a moved mesh, and the boxes around them, into a hierarchy of its topology.
template <class E>
void refit_nodes(const MeshView& mesh, const SceneSpace& space, BvhNode* nodes,
                 std::uint32_t node_count, TriangleBlock* blocks, E& executor)
{
    constexpr std::uint32_t nodes_per_task = 128;
    const auto set_box = [](BvhNode& node, int lane, const Bounds& box) {
        for (int k = 0; k < 3; ++k) {
            node.bounds[k][0][lane] = box.low[k];
            node.bounds[k][1][lane] = box.high[k];
        }
    };
    const auto tasks = static_cast<int>((node_count + nodes_per_task - 1) / nodes_per_task);
    executor.for_each(tasks, [&](int task, int) {
        const std::uint32_t first = static_cast<std::uint32_t>(task) * nodes_per_task;
        for (std::uint32_t i = first; i < (std::min)(first + nodes_per_task, node_count); ++i)
            for (int lane = 0; lane < BvhNode::lanes; ++lane) {
                const std::uint32_t child = nodes[i].child[lane];
                if (child == no_face || (child & BvhNode::block_bit) == 0) continue;
                set_box(nodes[i], lane,
                        refit_block(mesh, space, blocks[child & ~BvhNode::block_bit]));
            }
    });
    // A node comes before those in it.
    for (std::uint32_t i = node_count; i-- > 0;)
        for (int lane = 0; lane < BvhNode::lanes; ++lane) {
            const std::uint32_t child = nodes[i].child[lane];
            if ((child & BvhNode::block_bit) == 0) set_box(nodes[i], lane, node_box(nodes[child]));
        }
}

}  // namespace nook::inline NOOK_TARGET::detail
