#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/tangent_planes.hpp>
#include <nook/scene/traversal.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Where the rays of some points begin their walk: the parts of a hierarchy within their reach, as
/// nodes like those of the hierarchy. Points that lie close together share one.
class Neighbourhood {
public:
    /// Parts at most.
    static constexpr int most = 64;

    /// The whole hierarchy.
    explicit Neighbourhood(const BvhView& bvh) : bvh_{bvh} { whole(); }

    /// Starts at the root again.
    void whole()
    {
        count_ = 0;
        if (bvh_.empty()) return;
        BvhNode all{};
        for (int k = 0; k < 3; ++k) {
            all.bounds[k][0][0] = -2;
            all.bounds[k][1][0] = 2;
        }
        all.child[0] = bvh_.root;
        add(all, 0);
        close();
    }

    /// The parts that come within `reach` of a box in scene space, down to parts no larger than
    /// `reach`, or fewer parts that are larger.
    void collect(const Bounds& points, float reach)
    {
        count_ = 0;
        if (bvh_.empty()) return;
        float from[3], to[3];
        for (int k = 0; k < 3; ++k) {
            // The boxes' sides, the points' and the differences are floats of about 1.
            const float margin =
                reach * 0x1p-20f +
                0x1p-20f * (1 + (std::max)(std::fabs(points.low[k]), std::fabs(points.high[k])));
            from[k] = points.low[k] - reach - margin;
            to[k] = points.high[k] + reach + margin;
        }
        gather([&](const BvhNode& node, unsigned& fine) {
            unsigned kept = 0;
            for (int lane = 0; lane < BvhNode::lanes; lane += child_lanes) {
                using L = ChildLanes;
                L outside = broadcast<child_lanes>(-1.0f), size{};
                for (int k = 0; k < 3; ++k) {
                    const L low = load<child_lanes>(node.bounds[k][0] + lane);
                    const L high = load<child_lanes>(node.bounds[k][1] + lane);
                    outside = larger(outside, larger(low - to[k], from[k] - high));
                    size = larger(size, high - low);
                }
                kept |= bits_at_most(outside, L{}) << lane;
                fine |= bits_at_most(size, broadcast<child_lanes>(reach)) << lane;
            }
            return kept;
        });
    }
    /// The same for points with their tangent planes: the parts that come above them; none when no
    /// triangle there can stop a ray of the points.
    void collect(const TangentPlanes& points)
    {
        count_ = 0;
        if (bvh_.empty()) return;
        gather([&](const BvhNode& node, unsigned& fine) { return points.reached(node, fine); });
        for (int i = 0; i < count_; ++i)
            if (may_meet(points, nodes_[i / BvhNode::lanes].child[i % BvhNode::lanes])) return;
        count_ = 0;
    }
    /// Whether no triangle of the hierarchy can stop a ray of the points; false when that takes long to
    /// find out.
    [[nodiscard]] bool nothing_meets(const TangentPlanes& points) const
    {
        return bvh_.empty() || !may_meet(points, bvh_.root);
    }

    /// Whether anything within these parts stops a ray; all of the hierarchy that it can meet must lie
    /// in them.
    [[nodiscard]] bool occluded(const SceneRay& ray) const
    {
        if (empty() || !ray.valid()) return false;
        const FloatOrigin origin{ray.origin};
        const FloatRay rounded_ray{origin, ray};
        for (int i = 0; i < node_count(); ++i) {
            float entry[BvhNode::lanes];
            for (unsigned bits = rounded_ray.enter(nodes_[i], entry); bits != 0; bits &= bits - 1)
                if (occluded_below(bvh_, nodes_[i].child[std::countr_zero(bits)], rounded_ray,
                                   [&]() -> const SceneRay& { return ray; }))
                    return true;
        }
        return false;
    }

    [[nodiscard]] const BvhView& bvh() const { return bvh_; }
    [[nodiscard]] bool empty() const { return count_ == 0; }
    [[nodiscard]] int node_count() const { return (count_ + BvhNode::lanes - 1) / BvhNode::lanes; }
    [[nodiscard]] const BvhNode& node(int i) const { return nodes_[i]; }

private:
    /// Adds parts from the root down. choose(node, fine) tells the lanes that matter, and which are small
    /// enough.
    template <class Choose>
    void gather(const Choose& choose)
    {
        // Lanes of nodes: parts already, or to be replaced by what they hold while there is room.
        struct Waiting {
            const BvhNode* node;
            int lane;
            bool fine;
        };
        Waiting stack[most];
        int waiting = 0;
        const auto expand = [&](const BvhNode& node) {
            unsigned fine = 0;
            unsigned kept = choose(node, fine);
            while (kept != 0) {
                const int lane = static_cast<int>(std::bit_width(kept)) - 1;
                kept ^= 1u << lane;
                stack[waiting++] = {&node, lane, (fine >> lane & 1) != 0};
            }
        };
        expand(bvh_.nodes[bvh_.root]);
        while (waiting > 0) {
            const Waiting next = stack[--waiting];
            const std::uint32_t child = next.node->child[next.lane];
            if (next.fine || (child & BvhNode::block_bit) != 0 ||
                count_ + waiting + BvhNode::lanes > most)
                add(*next.node, next.lane);
            else expand(bvh_.nodes[child]);
        }
        close();
    }
    /// Whether a triangle below a child may stop a ray of the points; true when that takes long.
    [[nodiscard]] bool may_meet(const TangentPlanes& points, std::uint32_t root) const
    {
        std::uint32_t stack[BvhView::most_waiting];
        int waiting = 0;
        stack[waiting++] = root;
        for (int visits = 0; waiting > 0; ++visits) {
            if (visits == most_visits) return true;
            const std::uint32_t next = stack[--waiting];
            if ((next & BvhNode::block_bit) != 0) {
                if (points.may_meet(bvh_.blocks[next & ~BvhNode::block_bit])) return true;
                continue;
            }
            const BvhNode& node = bvh_.nodes[next];
            unsigned fine = 0;
            for (unsigned kept = points.reached(node, fine); kept != 0; kept &= kept - 1)
                stack[waiting++] = node.child[std::countr_zero(kept)];
        }
        return false;
    }
    /// Nodes and blocks that a proof may look at.
    static constexpr int most_visits = 256;
    void add(const BvhNode& from, int lane)
    {
        BvhNode& node = nodes_[count_ / BvhNode::lanes];
        const int to = count_++ % BvhNode::lanes;
        for (int k = 0; k < 3; ++k)
            for (int side = 0; side < 2; ++side)
                node.bounds[k][side][to] = from.bounds[k][side][lane];
        node.child[to] = from.child[lane];
    }
    /// Empty boxes in the lanes left over.
    void close()
    {
        const Bounds nothing = Bounds::nothing();
        for (int i = count_; i % BvhNode::lanes != 0; ++i)
            for (int k = 0; k < 3; ++k) {
                nodes_[i / BvhNode::lanes].bounds[k][0][i % BvhNode::lanes] = nothing.low[k];
                nodes_[i / BvhNode::lanes].bounds[k][1][i % BvhNode::lanes] = nothing.high[k];
            }
    }
    BvhView bvh_;
    int count_ = 0;
    BvhNode nodes_[most / BvhNode::lanes];
};

}  // namespace nook::inline NOOK_TARGET::detail
