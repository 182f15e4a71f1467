#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/neighbourhood.hpp>
#include <nook/scene/ray_fan.hpp>
#include <nook/scene/traversal.hpp>
#include <nook/scene/vector.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// All rays from one point into the hemisphere about a normal, within a radius, as one query.
///
/// What no ray can hit is found once for all: boxes and triangles beyond the radius, below the tangent
/// plane, or flatter over it than the lowest ray. What is left meets the rays in groups as wide as the
/// registers: boxes narrow the groups down, the planes through a triangle's edges are set up once for
/// all rays. Where few rays are left they go on alone. Answers are those of the exact test, as in
/// traversal.hpp.
class Hemisphere {
public:
    /// `start` and `radius` in scene space, `normal` of unit length. `slack` ≥ 0 tells how far above the
    /// tangent plane a triangle may rise and still be taken for the surface under the point.
    Hemisphere(const Neighbourhood& around, const Vector3& start, const Vector3& normal,
               double radius, double slack = 0)
        : around_{around},
          bvh_{around.bvh()},
          start_{start},
          normal_{normal},
          radius_{radius},
          slack_{slack},
          origin_{{start.x, start.y, start.z}}
    {
        reach_ = (std::min)(rounded_up(radius), 4 * origin_.size);
        const float reached = reach_ * (1 + 0x1p-17f) + 0x1p-40f * origin_.size;
        squared_reach_ = reached * reached;
        up_[0] = static_cast<float>(normal.x);
        up_[1] = static_cast<float>(normal.y);
        up_[2] = static_cast<float>(normal.z);
    }

    /// The rays of a fan, as a walk finds them stopped.
    struct Open {
        static constexpr bool nearest = false;
        RayMask rays = 0;
        /// False where all that came near was found unable to stop any ray, before a ray was tested.
        bool tested = false;
    };
    /// The same with the nearest hit of each ray; `rays` remain.
    struct Nearest {
        static constexpr bool nearest = true;
        RayMask rays = 0;
        bool tested = false;
        alignas(64) float t_max[RayFan::most];
        Hit hits[RayFan::most];
    };
    /// Takes the rays that are stopped out of `open.rays`.
    void find_open(const RayFan& fan, Open& open) const { walk(fan, open); }
    /// Finds the hits of `nearest.rays`.
    void find_nearest(const RayFan& fan, Nearest& nearest) const
    {
        for (int i = 0; i < RayFan::most; ++i) {
            nearest.t_max[i] = reach_;
            nearest.hits[i] = {};
        }
        walk(fan, nearest);
    }

    /// Whether no triangle comes within the radius above the tangent plane: any ray or segment there is
    /// open.
    [[nodiscard]] bool nothing_above() const
    {
        std::uint32_t stack[BvhView::most_waiting + Neighbourhood::most];
        int waiting = 0;
        Sides sides;
        const auto push = [&](const BvhNode& node) {
            for (unsigned kept = reached(node, sides); kept != 0; kept &= kept - 1)
                stack[waiting++] = node.child[std::countr_zero(kept)];
        };
        for (int i = 0; i < around_.node_count(); ++i) push(around_.node(i));
        while (waiting > 0) {
            const std::uint32_t next = stack[--waiting];
            if ((next & BvhNode::block_bit) == 0) {
                push(bvh_.nodes[next]);
                continue;
            }
            const TriangleBlock& block = bvh_.blocks[next & ~BvhNode::block_bit];
            for (int lane = 0; lane < TriangleBlock::lanes; ++lane)
                if (comes_near(block.triangle(lane))) return false;
        }
        return true;
    }

private:
    struct Waiting {
        RayMask rays;
        std::uint32_t child;
    };
    /// Rays that go on alone when no more are left; not where the surface has to be told from the rest.
    [[nodiscard]] static bool few_left(RayMask rays)
    {
        // Three of them. Counting bits is a call on the plainest targets.
        rays &= rays - 1;
        rays &= rays - 1;
        return (rays & (rays - 1)) == 0;
    }

    template <class State>
    void walk(const RayFan& fan, State& state) const
    {
        Waiting stack[BvhView::most_waiting + Neighbourhood::most + 1];
        int waiting = 0;
        for (int i = 0; i < around_.node_count(); ++i)
            waiting = enter(around_.node(i), fan, state, state.rays, stack, waiting);
        while (waiting > 0) {
            const Waiting next = stack[--waiting];
            const RayMask rays = next.rays & state.rays;
            if (rays == 0) continue;
            if ((next.child & BvhNode::block_bit) != 0) {
                test(bvh_.blocks[next.child & ~BvhNode::block_bit], fan, rays, state);
                continue;
            }
            if (few_left(rays) && !(slack_ > 0)) {
                for (RayMask left = rays; left != 0; left &= left - 1)
                    single(fan, std::countr_zero(left), next.child, state);
                continue;
            }
            waiting = enter(bvh_.nodes[next.child], fan, state, rays, stack, waiting);
        }
    }

    [[nodiscard]] SceneRay ray(const RayFan& fan, int i) const
    {
        return {
            start_,
            {double{fan.direction[0][i]}, double{fan.direction[1][i]}, double{fan.direction[2][i]}},
            radius_};
    }
    template <class State>
    void single(const RayFan& fan, int i, std::uint32_t root, State& state) const
    {
        state.tested = true;
        float end = reach_;
        if constexpr (State::nearest) end = state.t_max[i];
        FloatRay alone{origin_, fan.direction[0][i], fan.direction[1][i], fan.direction[2][i], end};
        if constexpr (State::nearest) {
            find_closest_below(bvh_, root, alone, ray(fan, i), state.hits[i]);
            state.t_max[i] = (std::min)(end, alone.t_max());
        } else if (occluded_below(bvh_, root, alone, [&] { return ray(fan, i); })) {
            state.rays &= ~(RayMask{1} << i);
        }
    }

    /// The sides of eight boxes relative to the origin, with the margin.
    struct Sides {
        alignas(32) float low[3][BvhNode::lanes], high[3][BvhNode::lanes];
    };
    /// The boxes within the radius that come above the tangent plane.
    [[nodiscard]] NOOK_INLINE unsigned reached(const BvhNode& node, Sides& sides) const
    {
        unsigned kept = 0;
        for (int lane = 0; lane < BvhNode::lanes; lane += child_lanes) {
            using L = ChildLanes;
            L squared{}, height{};
            for (int k = 0; k < 3; ++k) {
                const L low = load<child_lanes>(node.bounds[k][0] + lane) - origin_.box_start[0][k];
                const L high =
                    load<child_lanes>(node.bounds[k][1] + lane) - origin_.box_start[1][k];
                store(sides.low[k] + lane, low);
                store(sides.high[k] + lane, high);
                const L gap = larger(larger(low, -high), L{});
                squared = squared + gap * gap;
                height = height + up_[k] * (up_[k] > 0 ? high : low);
            }
            kept |= (bits_at_most(squared, broadcast<child_lanes>(squared_reach_)) &
                     bits_at_most(L{}, height))
                    << lane;
        }
        return kept;
    }

    /// Pushes the children that any of the rays may meet, the last on top.
    template <class State>
    [[nodiscard]] int enter(const BvhNode& node, const RayFan& fan, const State& state,
                            RayMask rays, Waiting* stack, int waiting) const
    {
        Sides sides;
        for (unsigned kept = reached(node, sides); kept != 0; kept &= kept - 1) {
            const int lane = std::countr_zero(kept);
            FloatLanes low[3], high[3];
            for (int k = 0; k < 3; ++k) {
                low[k] = broadcast<float_lanes>(sides.low[k][lane]);
                high[k] = broadcast<float_lanes>(sides.high[k][lane]);
            }
            RayMask met = 0;
            for (int g = 0; g * float_lanes < fan.count; ++g) {
                const unsigned active = RayFan::group(rays, g);
                if (active == 0) continue;
                FloatLanes enters{}, leaves = end(state, g);
                for (int k = 0; k < 3; ++k) {
                    const FloatLanes inverse = load<float_lanes>(fan.inverse[k] + g * float_lanes);
                    const FloatLanes one = low[k] * inverse;
                    const FloatLanes two = high[k] * inverse;
                    enters = larger(enters, smaller(one, two));
                    leaves = smaller(leaves, larger(one, two));
                }
                met |= RayFan::ungroup(bits_at_most(enters, leaves) & active, g);
            }
            // Without a branch, which would be hard to foretell.
            stack[waiting] = {met, node.child[lane]};
            waiting += met != 0 ? 1 : 0;
        }
        return waiting;
    }

    template <class State>
    [[nodiscard]] NOOK_INLINE FloatLanes end(const State& state, int g) const
    {
        if constexpr (State::nearest) return load<float_lanes>(state.t_max + g * float_lanes);
        else return broadcast<float_lanes>(reach_);
    }

    /// The planes of eight triangles: a ray meets one if edge · d ≥ 0 for each edge, and t_max slope · d ≥
    /// start.
    struct Planes {
        alignas(32) float edge[3][3][TriangleBlock::lanes];
        alignas(32) float slope[3][TriangleBlock::lanes];
        alignas(32) float start[TriangleBlock::lanes];
        alignas(32) float error[TriangleBlock::lanes];
        /// The triangles that a ray may hit; and those seen edge on as far as float can tell.
        unsigned kept = 0, edge_on = 0;
    };

    /// Errors as in `FloatRay::meets`; the plane that ends the rays is scaled to the same error.
    NOOK_INLINE void set_up(const TriangleBlock& block, const RayFan& fan, Planes& planes) const
    {
        using L = ChildLanes;
        for (int lane = 0; lane < TriangleBlock::lanes; lane += child_lanes) {
            L a[3], b[3], e0[3], e1[3], e2[3];
            L squared{}, reach{}, edge{}, height_a{}, height_b{}, height_c{};
            for (int k = 0; k < 3; ++k) {
                const L v0 = load<child_lanes>(block.vertices[0][k] + lane);
                const L v1 = load<child_lanes>(block.vertices[1][k] + lane);
                const L v2 = load<child_lanes>(block.vertices[2][k] + lane);
                a[k] = origin_.relative(v0, k);
                b[k] = origin_.relative(v1, k);
                const L c = origin_.relative(v2, k);
                e0[k] = v1 - v0;
                e1[k] = v2 - v1;
                e2[k] = v0 - v2;
                const L low = smaller(a[k], smaller(b[k], c)), high = larger(a[k], larger(b[k], c));
                const L gap = larger(larger(low, -high), L{});
                squared = squared + gap * gap;
                reach = larger(reach, larger(high, -low));
                edge = larger(edge, larger(larger(e0[k], -e0[k]), larger(e1[k], -e1[k])));
                height_a = height_a + up_[k] * a[k];
                height_b = height_b + up_[k] * b[k];
                height_c = height_c + up_[k] * c;
            }
            edge = larger(edge + edge, broadcast<child_lanes>(least_edge));
            reach = reach + 0x1p-24f * origin_.size;
            const L height = larger(height_a, larger(height_b, height_c)) + 0x1p-20f * reach;
            // Rays at the distance of the triangle are higher than its top.
            const L rise = height * larger(height, -height);
            const float flat = fan.least_rise * fan.least_rise * (1 - 0x1p-20f);
            const unsigned kept = bits_at_most(squared, broadcast<child_lanes>(squared_reach_)) &
                                  bits_at_most(flat * squared, rise);
            if (child_lanes == TriangleBlock::lanes && kept == 0) return;
            const L n[3] = {e0[1] * e1[2] - e0[2] * e1[1], e0[2] * e1[0] - e0[0] * e1[2],
                            e0[0] * e1[1] - e0[1] * e1[0]};
            const L volume = n[0] * a[0] + n[1] * a[1] + n[2] * a[2];
            const L one = broadcast<child_lanes>(1.0f);
            const L sign = volume < L{} ? -one : one;
            const L distance = volume * sign;
            const L volume_error = filter_error * edge * edge * reach + least_volume;
            unsigned edge_on = bits_at_most(distance, volume_error);
            // What may be the surface itself, slightly bent by rounding.
            if (slack_ > 0) edge_on |= bits_at_most(height, rounded_up(slack_) + 0x1p-20f * reach);
            edge_on &= kept;
            const L error = filter_error * edge * reach;
            const L scale = reach / (edge * (reach_ + reach)) * sign;
            for (int k = 0; k < 3; ++k) {
                const int p = (k + 1) % 3, q = (k + 2) % 3;
                store(planes.edge[0][k] + lane, (a[p] * e0[q] - a[q] * e0[p]) * sign);
                store(planes.edge[1][k] + lane, (b[p] * e1[q] - b[q] * e1[p]) * sign);
                store(planes.edge[2][k] + lane, (a[p] * e2[q] - a[q] * e2[p]) * sign);
                store(planes.slope[k] + lane, n[k] * scale);
            }
            store(planes.start + lane, volume * scale);
            store(planes.error + lane, error);
            planes.kept |= kept << lane;
            planes.edge_on |= edge_on << lane;
        }
    }

    template <class State>
    void test(const TriangleBlock& block, const RayFan& fan, RayMask rays, State& state) const
    {
        Planes planes;
        set_up(block, fan, planes);
        for (unsigned bits = planes.edge_on; bits != 0; bits &= bits - 1) {
            // A plane through the point, or nearly: mostly the surface under it.
            const int lane = std::countr_zero(bits);
            planes.kept ^= 1u << lane;
            const SceneTriangle triangle = block.triangle(lane);
            if (!can_hit(triangle, double{fan.least_rise})) continue;
            state.tested = true;
            for (RayMask left = rays & state.rays; left != 0; left &= left - 1)
                test_exactly(triangle, fan, std::countr_zero(left), state);
        }
        if (planes.kept == 0) return;
        state.tested = true;
        // Either all triangles of the block against a ray, or all rays of a group against a triangle.
        const RayMask asked = rays & state.rays;
        if (std::popcount(asked) <= 2 * std::popcount(planes.kept)) {
            test_ray_by_ray(block, planes, fan, asked, state);
            return;
        }
        for (int g = 0; g * float_lanes < fan.count; ++g) {
            const unsigned active = RayFan::group(rays & state.rays, g);
            if (active == 0) continue;
            FloatLanes d[3];
            for (int k = 0; k < 3; ++k)
                d[k] = load<float_lanes>(fan.direction[k] + g * float_lanes);
            unsigned stopped = 0;
            for (unsigned bits = planes.kept; bits != 0; bits &= bits - 1) {
                const int lane = std::countr_zero(bits);
                const float error = planes.error[lane];
                const auto along = [&](const float(&plane)[3][TriangleBlock::lanes])
                                       NOOK_INLINE_LAMBDA {
                                           return plane[0][lane] * d[0] + plane[1][lane] * d[1] +
                                                  plane[2][lane] * d[2];
                                       };
                const FloatLanes inside =
                    smaller(smaller(along(planes.edge[0]), along(planes.edge[1])),
                            smaller(along(planes.edge[2]),
                                    along(planes.slope) * end(state, g) - planes.start[lane]));
                unsigned left = bits_at_most(broadcast<float_lanes>(-error), inside) & active;
                if constexpr (!State::nearest) {
                    const unsigned doubtful = bits_at_most(inside, broadcast<float_lanes>(error));
                    stopped |= ~doubtful & active;
                    left &= doubtful & ~stopped;
                }
                for (; left != 0; left &= left - 1)
                    test_exactly(block.triangle(lane), fan,
                                 g * float_lanes + std::countr_zero(left), state);
            }
            state.rays &= ~RayFan::ungroup(stopped, g);
        }
    }

    template <class State>
    void test_ray_by_ray(const TriangleBlock& block, const Planes& planes, const RayFan& fan,
                         RayMask rays, State& state) const
    {
        for (; rays != 0; rays &= rays - 1) {
            const int i = std::countr_zero(rays);
            const float d[3] = {fan.direction[0][i], fan.direction[1][i], fan.direction[2][i]};
            float end = reach_;
            if constexpr (State::nearest) end = state.t_max[i];
            unsigned possible = 0, doubtful = 0;
            for (int lane = 0; lane < TriangleBlock::lanes; lane += child_lanes) {
                const auto along = [&](const float(&plane)[3][TriangleBlock::lanes])
                                       NOOK_INLINE_LAMBDA {
                                           return load<child_lanes>(plane[0] + lane) * d[0] +
                                                  load<child_lanes>(plane[1] + lane) * d[1] +
                                                  load<child_lanes>(plane[2] + lane) * d[2];
                                       };
                const ChildLanes inside = smaller(
                    smaller(along(planes.edge[0]), along(planes.edge[1])),
                    smaller(along(planes.edge[2]),
                            along(planes.slope) * end - load<child_lanes>(planes.start + lane)));
                const ChildLanes error = load<child_lanes>(planes.error + lane);
                possible |= bits_at_most(-error, inside) << lane;
                doubtful |= bits_at_most(inside, error) << lane;
            }
            possible &= planes.kept;
            if constexpr (!State::nearest) {
                if ((possible & ~doubtful) != 0) {
                    state.rays &= ~(RayMask{1} << i);
                    continue;
                }
            }
            for (; possible != 0; possible &= possible - 1)
                test_exactly(block.triangle(std::countr_zero(possible)), fan, i, state);
        }
    }

    template <class State>
    void test_exactly(const SceneTriangle& triangle, const RayFan& fan, int i, State& state) const
    {
        if constexpr (State::nearest) {
            Hit& hit = state.hits[i];
            ray(fan, i).keep_nearest(triangle, hit);
            if (hit) state.t_max[i] = (std::min)(state.t_max[i], rounded_up(hit.t));
        } else if (ray(fan, i).is_occluded_by(triangle)) {
            state.rays &= ~(RayMask{1} << i);
        }
    }
    /// False for a triangle below the tangent plane or with a box beyond the radius.
    [[nodiscard]] bool comes_near(const SceneTriangle& triangle) const
    {
        bool above = false;
        Vector3 low = triangle.corner(0) - start_, high = low;
        for (int i = 0; i < 3; ++i) {
            const Vector3 v = triangle.corner(i) - start_;
            above = above || dot(v, normal_) > slack_;
            low = {(std::min)(low.x, v.x), (std::min)(low.y, v.y), (std::min)(low.z, v.z)};
            high = {(std::max)(high.x, v.x), (std::max)(high.y, v.y), (std::max)(high.z, v.z)};
        }
        const auto gap = [](double from, double to) { return (std::max)({from, -to, 0.0}); };
        const Vector3 off{gap(low.x, high.x), gap(low.y, high.y), gap(low.z, high.z)};
        return above && dot(off, off) <= double{squared_reach_};
    }
    /// False where all corners lie below the tangent plane, or all rays leave the triangle's plane.
    [[nodiscard]] bool can_hit(const SceneTriangle& triangle, double least_rise) const
    {
        const Vector3 a = triangle.corner(0) - start_, b = triangle.corner(1) - start_,
                      c = triangle.corner(2) - start_;
        if (dot(a, normal_) <= slack_ && dot(b, normal_) <= slack_ && dot(c, normal_) <= slack_)
            return false;
        const Vector3 plane = triangle.normal();
        const double below = dot(plane, a), along = dot(plane, normal_);
        if ((below < 0) != (along > 0) || below == 0) return true;
        const Vector3 across = cross(plane, normal_);
        const double half = least_rise / 2;
        return dot(across, across) > half * half * dot(plane, plane);
    }

    const Neighbourhood& around_;
    BvhView bvh_;
    Vector3 start_, normal_;
    double radius_, slack_;
    FloatOrigin origin_;
    /// The radius, or all of the scene; its square, on the safe side; the normal.
    float reach_ = 0, squared_reach_ = 0, up_[3] = {};
};

}  // namespace nook::inline NOOK_TARGET::detail
