#pragma once

#include <cmath>
#include <cstdint>

#include <nook/scene/bvh.hpp>
#include <nook/scene/vector.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// All rays from one point into the hemisphere about a normal, within a radius.
///
/// What none of them can hit is found once for all: triangles beyond the radius, below the tangent
/// plane, or in a plane that the rays leave (the surface under the point, however large). Where
/// nothing is left no ray need be traced; where a few triangles are left, rays test those alone.
class Hemisphere {
public:
    /// Directions rise above the tangent plane by at least this sine: see `cosine_direction`.
    static constexpr double least_rise = 0x1p-17;

    Hemisphere(const Bvh& bvh, const Vector3& start, const Vector3& normal, double radius)
        : bvh_{bvh},
          start_{bvh.space_.to_scene(start)},
          normal_{normal}
    {
        radius_ = scene_length(radius, bvh.space_.scale);
        if (bvh.triangle_count() > 0) collect();
    }
    /// True when every ray is open.
    [[nodiscard]] bool empty() const { return count_ == 0; }

    /// `direction` is a unit vector.
    [[nodiscard]] bool occluded(const Vector3& direction) const
    {
        const SceneRay ray{start_, direction, radius_};
        if (!ray.valid()) return false;
        if (count_ > capacity) return bvh_.scene_occluded(ray);
        for (int i = 0; i < count_; ++i)
            if (ray.is_occluded_by(bvh_.triangles_[found_[i]])) return true;
        return false;
    }

private:
    static constexpr int capacity = 12;

    /// Walks down until too many triangles are left to be worth a list.
    void collect()
    {
        std::uint32_t stack[BvhBuilder::most_levels * (BvhNode::lanes - 1) + BvhNode::lanes];
        int waiting = 0;
        stack[waiting++] = 0;
        while (waiting > 0) {
            const BvhNode& node = bvh_.nodes_[stack[--waiting]];
            for (int lane = 0; lane < BvhNode::lanes; ++lane) {
                Bounds box;
                for (int k = 0; k < 3; ++k) {
                    box.low[k] = node.bounds[k][0][lane];
                    box.high[k] = node.bounds[k][1][lane];
                }
                if (box.low[0] > box.high[0] || !within_reach(box)) continue;
                if (node.count[lane] == 0) {
                    stack[waiting++] = node.child[lane];
                    continue;
                }
                for (std::uint32_t i = 0; i < node.count[lane]; ++i) {
                    const std::uint32_t index = node.child[lane] + i;
                    if (!can_hit(bvh_.triangles_[index])) continue;
                    if (count_ == capacity) {
                        ++count_;
                        return;
                    }
                    found_[count_++] = index;
                }
            }
        }
    }

    /// False for a box beyond the radius or below the tangent plane, whose content no ray meets.
    [[nodiscard]] bool within_reach(const Bounds& box) const
    {
        const double from[3] = {start_.x, start_.y, start_.z};
        const double up[3] = {normal_.x, normal_.y, normal_.z};
        double squared = 0, height = 0;
        for (int k = 0; k < 3; ++k) {
            const double low = double{box.low[k]} - from[k], high = double{box.high[k]} - from[k];
            const double gap = low > 0 ? low : high < 0 ? -high : 0;
            squared += gap * gap;
            height += up[k] * (up[k] > 0 ? high : low);
        }
        // A triangle test may reach 2⁻²² of the distance too far.
        return height > 0 && squared <= radius_ * radius_ * (1 + 0x1p-16);
    }
    [[nodiscard]] bool can_hit(const SceneTriangle& triangle) const
    {
        if (!within_reach(triangle.bounds())) return false;
        const Vector3 a = triangle.corner(0) - start_, b = triangle.corner(1) - start_,
                      c = triangle.corner(2) - start_;
        if (dot(a, normal_) <= 0 && dot(b, normal_) <= 0 && dot(c, normal_) <= 0) return false;
        // A plane that the point lies above and whose normal is so close to the point's that every
        // ray moves away from it.
        const Vector3 plane = triangle.normal();
        const double below = dot(plane, a), along = dot(plane, normal_);
        if ((below < 0) != (along > 0) || below == 0) return true;
        const Vector3 across = cross(plane, normal_);
        constexpr double half = least_rise / 2;
        return dot(across, across) > half * half * dot(plane, plane);
    }

    const Bvh& bvh_;
    Vector3 start_, normal_;
    double radius_ = 0;
    std::uint32_t found_[capacity] = {};
    int count_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
