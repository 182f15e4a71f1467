#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/ray.hpp>

/// Single rays through a hierarchy. Boxes and triangles are judged in float, with bounds on what
/// rounding may do; what float cannot decide goes to the exact test of SceneRay. So every answer is
/// that of the exact test, whatever the instruction set and the flags.
namespace nook::inline NOOK_TARGET::detail {

/// Whether any triangle stops the ray.
[[nodiscard]] inline bool occluded(const BvhView& bvh, const SceneRay& ray);
/// The nearest triangle on the ray, the lowest face among equals; `t` is in scene space.
[[nodiscard]] inline Hit closest(const BvhView& bvh, const SceneRay& ray);

/// Boxes or triangles of a node or block taken at once.
inline constexpr int child_lanes = float_lanes < BvhNode::lanes ? float_lanes : BvhNode::lanes;
using FloatLanes = Lanes<float, float_lanes>;
using ChildLanes = Lanes<float, child_lanes>;

/// Relative error of a triangle test in float: see `BlockTest`.
inline constexpr float filter_error = 0x1p-18f;

/// Edges are taken for at least this long in bounds on errors, and volumes for uncertain by at least
/// this much: what underflow may do to smaller triangles stays below the bounds.
inline constexpr float least_edge = 0x1p-40f, least_volume = 0x1p-120f;

/// An origin for work in float.
struct FloatOrigin {
    /// high + low is the origin, to 48 bits.
    float high[3], low[3];
    /// What is subtracted from the low and the high sides of boxes. They hold a margin of 2⁻²¹ of the
    /// coordinates: twice what rounding may do to (side − origin) / direction, as a length along the
    /// axis: the origin, the difference, the reciprocal and the product, 2⁻²⁴ each.
    float box_start[2][3];
    /// The coordinates of scene and origin.
    float size;

    explicit FloatOrigin(const double (&origin)[3])
    {
        const double most =
            1 + (std::max)({std::fabs(origin[0]), std::fabs(origin[1]), std::fabs(origin[2])});
        size = static_cast<float>(most);
        const double margin = 0x1p-21 * most;
        for (int k = 0; k < 3; ++k) {
            // GCC 12 would vectorise the pair and take the difference for 0.
            high[k] = rounded(static_cast<float>(origin[k]));
            low[k] = static_cast<float>(origin[k] - double{high[k]});
            box_start[0][k] = static_cast<float>(origin[k] + margin);
            box_start[1][k] = static_cast<float>(origin[k] - margin);
        }
    }
    /// A coordinate relative to the origin, off by 2⁻²³ of itself and 2⁻⁴⁸ of the origin.
    [[nodiscard]] NOOK_INLINE ChildLanes relative(const ChildLanes& coordinate, int k) const
    {
        return fenced(fenced(coordinate - high[k]) - low[k]);
    }
};

/// A reciprocal for the slab test. A component of 0 takes 2⁶⁰ in place of infinity: the margin of the
/// boxes covers what a ray moves along such an axis.
[[nodiscard]] NOOK_INLINE float slab_reciprocal(float component)
{
    return std::fabs(component) > 0x1p-60f ? 1 / component : component < 0 ? -0x1p60f : 0x1p60f;
}
/// A float that is not below a double.
[[nodiscard]] NOOK_INLINE float rounded_up(double t)
{
    return static_cast<float>(t * (1 + 0x1p-22));
}

/// Which lanes an answer holds for: certainly, and possibly.
struct LaneAnswer {
    unsigned certain = 0, possible = 0;
};

/// A ray in float against boxes and triangles.
class FloatRay {
public:
    /// Rounds a ray of the scene.
    FloatRay(const FloatOrigin& origin, const SceneRay& ray)
        : FloatRay{origin, static_cast<float>(ray.direction[0]),
                   static_cast<float>(ray.direction[1]), static_cast<float>(ray.direction[2]),
                   rounded_up(ray.t_max)}
    {}
    FloatRay(const FloatOrigin& origin, float x, float y, float z, float t_max)
        : origin_{origin},
          direction_{x, y, z},
          length_{std::fabs(x) + std::fabs(y) + std::fabs(z)}
    {
        for (int k = 0; k < 3; ++k) {
            inverse_[k] = slab_reciprocal(direction_[k]);
            near_side_[k] = direction_[k] < 0 ? 1 : 0;
        }
        // No hit lies beyond the scene. A bound keeps the errors of infinite rays finite.
        const float longest = (std::max)({std::fabs(x), std::fabs(y), std::fabs(z)});
        t_max_ = (std::min)(t_max, 4 * origin.size / longest);
    }
    [[nodiscard]] float t_max() const { return t_max_; }
    void shorten(double t_max) { t_max_ = (std::min)(t_max_, rounded_up(t_max)); }

    /// The lanes whose box the ray may meet, and where it enters them.
    [[nodiscard]] NOOK_INLINE unsigned enter(const BvhNode& node,
                                             float (&entry)[BvhNode::lanes]) const
    {
        unsigned bits = 0;
        for (int lane = 0; lane < BvhNode::lanes; lane += child_lanes) {
            ChildLanes enters{}, leaves = broadcast<child_lanes>(t_max_);
            for (int k = 0; k < 3; ++k) {
                const int side = near_side_[k];
                const ChildLanes first =
                    (load<child_lanes>(node.bounds[k][side] + lane) - origin_.box_start[side][k]) *
                    inverse_[k];
                const ChildLanes last = (load<child_lanes>(node.bounds[k][1 - side] + lane) -
                                         origin_.box_start[1 - side][k]) *
                                        inverse_[k];
                enters = larger(enters, first);
                leaves = smaller(leaves, last);
            }
            store(entry + lane, enters);
            bits |= bits_at_most(enters, leaves) << lane;
        }
        return bits;
    }

    /// The triangles that the ray meets with 0 < t <= t_max. With corners A, B, C relative to the
    /// origin and edges E, the edge functions d · (A × E) are off by less than 16 u |A| |E| |d|
    /// (u = 2⁻²⁴: corner 2 u, edge 1 u, cross product 2 √2 u, dot product 3 √2 u, direction 1 u);
    /// `filter_error` times the largest coordinates covers that with the norms.
    [[nodiscard]] NOOK_INLINE LaneAnswer meets(const TriangleBlock& block) const
    {
        LaneAnswer answer;
        for (int lane = 0; lane < TriangleBlock::lanes; lane += child_lanes) {
            using L = ChildLanes;
            L a[3], b[3], e0[3], e1[3], e2[3];
            L edge{}, reach{};
            for (int k = 0; k < 3; ++k) {
                const L v0 = load<child_lanes>(block.vertices[0][k] + lane);
                const L v1 = load<child_lanes>(block.vertices[1][k] + lane);
                const L v2 = load<child_lanes>(block.vertices[2][k] + lane);
                a[k] = origin_.relative(v0, k);
                b[k] = origin_.relative(v1, k);
                e0[k] = v1 - v0;
                e1[k] = v2 - v1;
                e2[k] = v0 - v2;
                edge = larger(edge, larger(magnitude(e0[k]), magnitude(e1[k])));
                reach = larger(reach, magnitude(a[k]));
            }
            edge = larger(edge + edge, broadcast<child_lanes>(least_edge));
            reach = reach + edge + 0x1p-24f * origin_.size;
            const float x = direction_[0], y = direction_[1], z = direction_[2];
            const L da[3] = {y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]};
            const L db[3] = {y * b[2] - z * b[1], z * b[0] - x * b[2], x * b[1] - y * b[0]};
            const L n[3] = {e0[1] * e1[2] - e0[2] * e1[1], e0[2] * e1[0] - e0[0] * e1[2],
                            e0[0] * e1[1] - e0[1] * e1[0]};
            const L slope = n[0] * x + n[1] * y + n[2] * z;
            const L volume = n[0] * a[0] + n[1] * a[1] + n[2] * a[2];
            const L sign =
                slope < L{} ? broadcast<child_lanes>(-1.0f) : broadcast<child_lanes>(1.0f);
            const L u = (da[0] * e0[0] + da[1] * e0[1] + da[2] * e0[2]) * sign;
            const L v = (db[0] * e1[0] + db[1] * e1[1] + db[2] * e1[2]) * sign;
            const L w = (da[0] * e2[0] + da[1] * e2[1] + da[2] * e2[2]) * sign;
            const L least = smaller(u, smaller(v, w));
            const L error = filter_error * length_ * edge * reach;
            const L t_error =
                filter_error * edge * edge * (reach + t_max_ * length_) + least_volume;
            const L along = volume * sign;
            const L before = t_max_ * slope * sign - along;
            const L t_least = smaller(along, before);
            answer.certain |= (bits_at_most(least, error) | bits_at_most(t_least, t_error)) << lane;
            answer.possible |= (bits_at_most(-error, least) & bits_at_most(-t_error, t_least))
                               << lane;
        }
        answer.certain = answer.possible & ~answer.certain;
        return answer;
    }

private:
    template <class L>
    [[nodiscard]] NOOK_INLINE static L magnitude(const L& value)
    {
        return larger(value, -value);
    }

    const FloatOrigin& origin_;
    float direction_[3], inverse_[3] = {};
    /// At least the length of the direction.
    float length_, t_max_ = 0;
    int near_side_[3] = {};
};

/// Whether any triangle below a child stops the ray. `exact()` gives the SceneRay, where it is needed.
template <class Exact>
[[nodiscard]] inline bool occluded_below(const BvhView& bvh, std::uint32_t root,
                                         const FloatRay& ray, const Exact& exact)
{
    std::uint32_t stack[BvhView::most_waiting];
    int waiting = 0;
    stack[waiting++] = root;
    while (waiting > 0) {
        const std::uint32_t next = stack[--waiting];
        if ((next & BvhNode::block_bit) != 0) {
            const TriangleBlock& block = bvh.blocks[next & ~BvhNode::block_bit];
            LaneAnswer answer = ray.meets(block);
            if (answer.certain != 0) return true;
            for (; answer.possible != 0; answer.possible &= answer.possible - 1)
                if (exact().is_occluded_by(block.triangle(std::countr_zero(answer.possible))))
                    return true;
            continue;
        }
        const BvhNode& node = bvh.nodes[next];
        float entry[BvhNode::lanes];
        for (unsigned bits = ray.enter(node, entry); bits != 0; bits &= bits - 1)
            stack[waiting++] = node.child[std::countr_zero(bits)];
    }
    return false;
}

/// Takes the nearest triangle below a child that the ray meets before `hit`.
inline void find_closest_below(const BvhView& bvh, std::uint32_t root, FloatRay& ray,
                               const SceneRay& exact, Hit& hit)
{
    struct Waiting {
        std::uint32_t node;
        float entry;
    };
    Waiting stack[BvhView::most_waiting];
    int waiting = 0;
    stack[waiting++] = {root, 0};
    while (waiting > 0) {
        const Waiting next = stack[--waiting];
        if (next.entry > ray.t_max()) continue;
        if ((next.node & BvhNode::block_bit) != 0) {
            const TriangleBlock& block = bvh.blocks[next.node & ~BvhNode::block_bit];
            for (unsigned bits = ray.meets(block).possible; bits != 0; bits &= bits - 1)
                exact.keep_nearest(block.triangle(std::countr_zero(bits)), hit);
            if (hit) ray.shorten(hit.t);
            continue;
        }
        const BvhNode& node = bvh.nodes[next.node];
        float entry[BvhNode::lanes];
        const int bottom = waiting;
        for (unsigned bits = ray.enter(node, entry); bits != 0; bits &= bits - 1) {
            const int lane = std::countr_zero(bits);
            int at = waiting++;
            for (; at > bottom && stack[at - 1].entry < entry[lane]; --at)
                stack[at] = stack[at - 1];
            stack[at] = {node.child[lane], entry[lane]};
        }
    }
}

inline bool occluded(const BvhView& bvh, const SceneRay& ray)
{
    if (bvh.empty() || !ray.valid()) return false;
    const FloatOrigin origin{ray.origin};
    const FloatRay rounded_ray{origin, ray};
    if (!ray.excludes())
        return occluded_below(bvh, bvh.root, rounded_ray, [&]() -> const SceneRay& { return ray; });
    // With a face to pass through no answer in float is certain.
    return static_cast<bool>(closest(bvh, ray));
}

inline Hit closest(const BvhView& bvh, const SceneRay& ray)
{
    Hit hit{};
    if (bvh.empty() || !ray.valid()) return hit;
    const FloatOrigin origin{ray.origin};
    FloatRay rounded_ray{origin, ray};
    find_closest_below(bvh, bvh.root, rounded_ray, ray, hit);
    return hit;
}

}  // namespace nook::inline NOOK_TARGET::detail
