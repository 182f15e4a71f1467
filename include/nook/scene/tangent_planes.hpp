#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/ray.hpp>
#include <nook/scene/traversal.hpp>
#include <nook/scene/vector.hpp>

/// What points that lie together have in common: nothing below all of their tangent planes can stop a
/// ray or a segment above them, and one walk tells that for all.
namespace nook::inline NOOK_TARGET::detail {

/// Points with nearly one normal, and how far their rays reach.
///
/// The proofs are about the exact test of a triangle against a ray that starts at a point and rises
/// above its tangent plane. A hit is a point of the triangle within the radius of the start and
/// above that plane. Where the normals are off by at most `spread` from the first one, a hit lies less
/// than spread · reach below the lowest start along that, or above it.
class TangentPlanes {
public:
    /// `reach` in scene space, on the safe side.
    explicit TangentPlanes(float reach) : most_reach_{reach} {}

    /// Starts anew, with no point yet; the first normal is that of the planes.
    void start(const Vector3& point, const Vector3& surface)
    {
        count_ = 0;
        centre_ = point;
        normal_ = surface;
        bounds_ = Bounds::nothing();
        lowest_ = lowest_slack_ = huge;
        squared_spread_ = 0;
        upright_ = true;
        // There is nothing beyond the scene.
        reach_ = static_cast<float>((std::min)(double{most_reach_}, 4 * (1 + largest(point))));
    }
    /// Whether the normal is near enough to the first.
    [[nodiscard]] bool is_alike(const Vector3& surface) const
    {
        return dot(surface, normal_) >= least_cosine;
    }
    /// Whether the box of the points stays within the reach.
    [[nodiscard]] bool is_close(const Vector3& point) const
    {
        const float at[3] = {static_cast<float>(point.x), static_cast<float>(point.y),
                             static_cast<float>(point.z)};
        for (int k = 0; k < 3; ++k)
            if ((std::max)(bounds_.high[k], at[k]) - (std::min)(bounds_.low[k], at[k]) > reach_)
                return false;
        return true;
    }
    /// Takes a point in: where its rays start, their pole, the normal of its surface and its slack, as in
    /// ShadingPoint.
    void add(const Vector3& point, const Vector3& pole, const Vector3& surface, double slack)
    {
        const Vector3 off = surface - normal_;
        const double height = dot(point - centre_, normal_);
        squared_spread_ = (std::max)(squared_spread_, dot(off, off));
        lowest_ = (std::min)(lowest_, height);
        lowest_slack_ = (std::min)(lowest_slack_, height + slack);
        upright_ = upright_ && dot(pole, surface) > 1 - 0x1p-40;
        include(point);
    }
    /// Takes any points of a box of corners in, with the first normal as pole and surface, none lower than
    /// `lowest` along it, as seen from the start.
    void add_flat(const Vector3 (&corners)[8], double lowest, double slack)
    {
        for (const Vector3& corner : corners) include(corner);
        lowest_ = lowest;
        lowest_slack_ = lowest + slack;
    }
    /// To be called when all points are there.
    void close()
    {
        const double most = 1 + largest(centre_) + 4 * double{reach_};
        margin_ = 0x1p-47 * most;
        spread_ = std::sqrt(squared_spread_);
        tilt_ = rounded(spread_ * double{reach_}) + margin_;
        // Sides relative to the centre and the sum of three products are off by a few times 2⁻²⁴.
        box_top_ = static_cast<float>(lowest_ - tilt_ - rounded(0x1p-20 * most));
        const double c[3] = {centre_.x, centre_.y, centre_.z};
        const double n[3] = {normal_.x, normal_.y, normal_.z};
        double squared = 0;
        for (int k = 0; k < 3; ++k) {
            // The boxes' sides, the points' and the differences are floats of about 1.
            const float margin =
                reach_ * 0x1p-20f +
                0x1p-20f * (1 + (std::max)(std::fabs(bounds_.low[k]), std::fabs(bounds_.high[k])));
            low_[k] = bounds_.low[k] - margin;
            high_[k] = bounds_.high[k] + margin;
            from_[k] = low_[k] - reach_;
            to_[k] = high_[k] + reach_;
            about_[k] = static_cast<float>(c[k]);
            up_[k] = static_cast<float>(n[k]);
            const double away =
                (std::max)(double{bounds_.high[k]} - c[k], c[k] - double{bounds_.low[k]});
            squared += rounded(away * away);
        }
        size_ = std::sqrt(squared) + double{reach_} * 0x1p-20;
        squared_reach_ = reach_ * reach_ * (1 + 0x1p-18f) + 0x1p-100f;
    }

    [[nodiscard]] int count() const { return count_; }

    /// The boxes of a node of which some part lies within the reach and above the planes. `fine`: those
    /// that are no larger than the reach.
    [[nodiscard]] NOOK_INLINE unsigned reached(const BvhNode& node, unsigned& fine) const
    {
        unsigned kept = 0;
        fine = 0;
        for (int lane = 0; lane < BvhNode::lanes; lane += child_lanes) {
            using L = ChildLanes;
            L squared{}, size{}, height{};
            for (int k = 0; k < 3; ++k) {
                const L low = load<child_lanes>(node.bounds[k][0] + lane);
                const L high = load<child_lanes>(node.bounds[k][1] + lane);
                const L gap = larger(larger(low - high_[k], low_[k] - high), L{});
                squared = squared + gap * gap;
                size = larger(size, high - low);
                const L side = up_[k] > 0 ? smaller(high, broadcast<child_lanes>(to_[k]))
                                          : larger(low, broadcast<child_lanes>(from_[k]));
                height = height + up_[k] * (side - about_[k]);
            }
            kept |= (bits_at_most(squared, broadcast<child_lanes>(squared_reach_)) &
                     bits_at_most(broadcast<child_lanes>(box_top_), height))
                    << lane;
            fine |= bits_at_most(size, broadcast<child_lanes>(reach_)) << lane;
        }
        return kept;
    }
    /// Whether a triangle of a block may stop a ray of one of the points.
    [[nodiscard]] bool may_meet(const TriangleBlock& block) const
    {
        unsigned left = 0;
        for (int lane = 0; lane < TriangleBlock::lanes; lane += child_lanes) {
            ChildLanes squared{};
            for (int k = 0; k < 3; ++k) {
                const ChildLanes a = load<child_lanes>(block.vertices[0][k] + lane);
                const ChildLanes b = load<child_lanes>(block.vertices[1][k] + lane);
                const ChildLanes c = load<child_lanes>(block.vertices[2][k] + lane);
                const ChildLanes gap = larger(
                    larger(smaller(a, smaller(b, c)) - high_[k], low_[k] - larger(a, larger(b, c))),
                    ChildLanes{});
                squared = squared + gap * gap;
            }
            left |= bits_at_most(squared, broadcast<child_lanes>(squared_reach_)) << lane;
        }
        if (left == 0) return false;
        left &= rising(block);
        for (; left != 0; left &= left - 1)
            if (may_meet(block.triangle(std::countr_zero(left)))) return true;
        return false;
    }

private:
    void include(const Vector3& point)
    {
        const float at[3] = {static_cast<float>(point.x), static_cast<float>(point.y),
                             static_cast<float>(point.z)};
        for (int k = 0; k < 3; ++k) {
            bounds_.low[k] = (std::min)(bounds_.low[k], at[k]);
            bounds_.high[k] = (std::max)(bounds_.high[k], at[k]);
        }
        ++count_;
    }
    /// The triangles that are not below all of the planes.
    [[nodiscard]] unsigned rising(const TriangleBlock& block) const
    {
        constexpr int N = native_lanes < TriangleBlock::lanes ? native_lanes : TriangleBlock::lanes;
        using L = Lanes<double, N>;
        const double centre[3] = {centre_.x, centre_.y, centre_.z};
        const double normal[3] = {normal_.x, normal_.y, normal_.z};
        alignas(32) float room[TriangleBlock::lanes];
        for (int lane = 0; lane < TriangleBlock::lanes; lane += N) {
            L top{};
            for (int i = 0; i < 3; ++i) {
                L height{};
                for (int k = 0; k < 3; ++k)
                    height = height +
                             (convert<double>(load<N>(block.vertices[i][k] + lane)) - centre[k]) *
                                 normal[k];
                top = i == 0 ? height : larger(top, height);
            }
            // The margin is more than what a float loses to 0.
            store(room + lane, convert<float>(lowest_ - tilt_ - top));
        }
        unsigned below = 0;
        for (int lane = 0; lane < TriangleBlock::lanes; lane += child_lanes)
            below |= bits_at_most(ChildLanes{}, load<child_lanes>(room + lane)) << lane;
        return ~below;
    }
    /// The same for a triangle within reach that is not below.
    [[nodiscard]] bool may_meet(const SceneTriangle& triangle) const
    {
        // What may be the surface itself, slightly bent by rounding, is told by its corners, however far
        // away they are: see `Hemisphere`.
        double top = -huge, away = 0;
        for (int i = 0; i < 3; ++i) {
            const Vector3 v = triangle.corner(i) - centre_;
            top = (std::max)(top, dot(v, normal_));
            away = (std::max)(away, largest(v));
        }
        if (top + rounded(spread_ * (2 * away + size_)) + margin_ <= lowest_slack_) return false;
        return !(upright_ && lies_under(triangle));
    }
    /// Whether all points lie above the triangle's plane, and no ray is as flat as that.
    [[nodiscard]] bool lies_under(const SceneTriangle& triangle) const
    {
        const Vector3 plane = triangle.normal();
        const Vector3 unit = normalised(dot(plane, normal_) < 0 ? -plane : plane);
        const Vector3 off = unit - normal_;
        const double turned = std::sqrt(dot(off, off));
        // Rays rise by more than 2⁻¹⁸ of their length: see `HemisphereBasis`.
        if (!(turned + spread_ < 0x1p-19)) return false;
        // The normal of a thin triangle is off by more.
        const Vector3 a = triangle.corner(0);
        const double edge =
            (std::max)(largest(triangle.corner(1) - a), largest(triangle.corner(2) - a));
        const double area = rounded(edge * edge);
        if (!(dot(plane, plane) > 0x1p-6 * area * area)) return false;
        // With q from the centre to a point: unit · q = normal · q + off · q.
        const double height = dot(unit, centre_ - a) + lowest_ - rounded(turned * size_);
        return height > 4 * margin_;
    }

    static constexpr double huge = 0x1p100;
    /// Normals of one group: within about 30 degrees.
    static constexpr double least_cosine = 0.875;

    float most_reach_, reach_ = 0;
    int count_ = 0;
    Vector3 centre_{0, 0, 0}, normal_{0, 0, 0};
    Bounds bounds_ = Bounds::nothing();
    /// From the centre along the normal: the lowest point, and the lowest with its slack.
    double lowest_ = 0, lowest_slack_ = 0;
    double squared_spread_ = 0, spread_ = 0, tilt_ = 0, margin_ = 0;
    /// No point is farther from the centre.
    double size_ = 0;
    /// The poles are the normals of the surface.
    bool upright_ = true;
    /// The box of the points, with a margin; with the reach; the centre, the normal.
    float low_[3] = {}, high_[3] = {}, from_[3] = {}, to_[3] = {}, about_[3] = {}, up_[3] = {};
    float box_top_ = 0, squared_reach_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
