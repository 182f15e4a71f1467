#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include <nook/scene/bvh_box.hpp>
#include <nook/scene/bvh_node.hpp>

/// The binary tree that a builder splits the triangles into, and how it becomes one of eight-way nodes:
/// of all ways to leave nodes of the binary tree out, the one that keeps the least surface (Ylitie,
/// Karras & Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs",
/// section 3.2).
namespace nook::inline NOOK_TARGET::detail {

/// One half of a split: a leaf of up to eight items, or a pair again.
struct BvhSide {
    float low[3];
    /// Of all its triangles, summed up.
    float area;
    float negative_high[3];
    /// Triangles.
    std::uint32_t count;
    /// The first item of a leaf, or the index of a pair.
    std::uint32_t link;

    [[nodiscard]] bool leaf() const { return count <= TriangleBlock::lanes; }
    void set_box(const BoxRow& row)
    {
        float box[8];
        row.store(box);
        for (int k = 0; k < 3; ++k) {
            low[k] = box[k];
            negative_high[k] = box[k + 4];
        }
    }
};

struct BvhPair {
    BvhSide sides[2];
    /// Three bits for each number of lanes from 2 to 8 that the pair may take up in a node: how many
    /// of them its first side gets. 0: one lane less does as well.
    std::uint32_t lanes_of_first = 0;

    [[nodiscard]] int first_of(int lanes) const
    {
        return static_cast<int>(lanes_of_first >> (3 * (lanes - 2)) & 7);
    }
};

/// What a side costs in a node, by the number of lanes it may take up at most.
struct LaneCosts {
    float cost[BvhNode::lanes]{};
    /// Of all its triangles.
    float area = 0;
};

/// Decides about a pair from what its sides cost.
[[nodiscard]] inline LaneCosts merge_costs(BvhPair& pair, const LaneCosts& first,
                                           const LaneCosts& second)
{
    constexpr int lanes = BvhNode::lanes;
    LaneCosts result;
    pair.sides[0].area = first.area;
    pair.sides[1].area = second.area;
    result.area = first.area + second.area;
    pair.lanes_of_first = 0;
    float edges[3];
    for (int k = 0; k < 3; ++k) {
        const BvhSide &a = pair.sides[0], &b = pair.sides[1];
        const float low = a.low[k] < b.low[k] ? a.low[k] : b.low[k];
        const float high =
            a.negative_high[k] < b.negative_high[k] ? a.negative_high[k] : b.negative_high[k];
        edges[k] = low + high;
    }
    const float surface =
        rounded(edges[0] * edges[1]) + rounded(edges[1] * edges[2]) + rounded(edges[2] * edges[0]);
    float spread[lanes + 1] = {};
    for (int n = 2; n <= lanes; ++n) {
        int best = 1;
        float least = first.cost[0] + second.cost[n - 2];
        for (int k = 2; k < n; ++k) {
            const float cost = first.cost[k - 1] + second.cost[n - k - 1];
            if (cost < least) {
                least = cost;
                best = k;
            }
        }
        spread[n] = least;
        pair.lanes_of_first |= static_cast<std::uint32_t>(best) << (3 * (n - 2));
    }
    result.cost[0] = spread[lanes] + surface;
    for (int n = 2; n < lanes; ++n) {
        // A node of its own may be as good as lanes in another.
        const bool fewer = result.cost[n - 2] <= spread[n];
        result.cost[n - 1] = fewer ? result.cost[n - 2] : spread[n];
        if (fewer) pair.lanes_of_first &= ~(7u << (3 * (n - 2)));
    }
    result.cost[lanes - 1] = result.cost[lanes - 2];
    return result;
}

/// The sides that become the lanes of the node of a pair, those last that a ray should try first:
/// large triangles, few of them. Returns how many.
[[nodiscard]] inline int node_sides(const BvhPair* pairs, std::uint32_t root,
                                    const BvhSide* (&sides)[BvhNode::lanes])
{
    struct Waiting {
        const BvhSide* side;
        int lanes;
    };
    Waiting stack[BvhNode::lanes];
    float keys[BvhNode::lanes];
    int waiting = 0, count = 0;
    const auto open = [&](const BvhPair& pair, int lanes) {
        const int first = pair.first_of(lanes);
        stack[waiting++] = {&pair.sides[1], lanes - first};
        stack[waiting++] = {&pair.sides[0], first};
    };
    open(pairs[root], BvhNode::lanes);
    while (waiting > 0) {
        const auto [side, most] = stack[--waiting];
        if (!side->leaf()) {
            const BvhPair& pair = pairs[side->link];
            int lanes = most;
            while (lanes > 1 && pair.first_of(lanes) == 0) --lanes;
            if (lanes > 1) {
                open(pair, lanes);
                continue;
            }
        }
        const float key = side->area / std::sqrt(static_cast<float>(side->count));
        int at = count++;
        for (; at > 0 && keys[at - 1] > key; --at) {
            keys[at] = keys[at - 1];
            sides[at] = sides[at - 1];
        }
        keys[at] = key;
        sides[at] = side;
    }
    return count;
}

/// Where a node goes: the lane of another, or no_face for a root.
struct NodePlace {
    std::uint32_t pair;
    std::uint32_t parent;
    int lane, level;
};

/// Visits a node and those below it, each before those in it, last lanes first.
/// visit(place, sides, count, index) takes the sides of a node, sets its index, which those in it get as
/// their parent, and returns as bits the lanes to go on with.
template <class Visit>
void walk_nodes(const BvhPair* pairs, const NodePlace& root, const Visit& visit)
{
    NodePlace stack[BvhView::most_waiting];
    int waiting = 0;
    stack[waiting++] = root;
    while (waiting > 0) {
        const NodePlace place = stack[--waiting];
        const BvhSide* sides[BvhNode::lanes];
        const int count = node_sides(pairs, place.pair, sides);
        std::uint32_t index = 0;
        for (unsigned lanes = visit(place, sides, count, index); lanes != 0; lanes &= lanes - 1) {
            const int lane = std::countr_zero(lanes);
            stack[waiting++] = {sides[lane]->link, index, lane, place.level + 1};
        }
    }
}

}  // namespace nook::inline NOOK_TARGET::detail
