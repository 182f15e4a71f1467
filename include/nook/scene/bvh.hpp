#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <nook/outcome.hpp>
#include <nook/scene/bvh_build.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/ray.hpp>

namespace nook {

struct BvhOptions {
    /// Triangles per leaf at most, 1 … 255.
    int leaf_size = 4;
    /// Where the hierarchy and the builder's working memory come from.
    Memory memory{};
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

namespace detail {
class Hemisphere;
}

/// A hierarchy of boxes over the triangles of a mesh, for rays. Copies what it needs: the mesh may go
/// after `build`. Queries may run on any number of threads at once. Without triangles, or before
/// `build`, nothing is ever hit.
///
/// Coordinates are relative to an origin near the scene and scaled by a power of two, both exactly:
/// a scene 10⁶ units from zero, or scaled by a power of two, gives the hits it gives at home. The
/// triangle test is watertight (Woop, Benthin & Wald 2013, with edge functions always in double).
class Bvh {
public:
    Bvh() = default;
    Bvh(Bvh&& other) noexcept { swap(other); }
    Bvh& operator=(Bvh&& other) noexcept
    {
        Bvh taken{std::move(other)};
        swap(taken);
        return *this;
    }

    /// Builds from a mesh, in place of what was there; on an error it is left as it was. Unusable
    /// triangles are left out. O(n log n), no recursion.
    [[nodiscard]] Outcome build(const MeshView& mesh, const BvhOptions& options = {});

    /// Whether any triangle lies on the ray.
    [[nodiscard]] bool occluded(const Ray& ray) const;
    /// The nearest triangle on the ray.
    [[nodiscard]] Hit closest(const Ray& ray) const;

    /// Triangles held.
    [[nodiscard]] std::size_t triangle_count() const { return triangle_count_; }
    /// Triangles of the mesh that were left out because they are not usable.
    [[nodiscard]] std::size_t dropped() const { return dropped_; }
    /// Levels of the tree, at most 64.
    [[nodiscard]] int depth() const { return depth_; }
    /// Bytes kept.
    [[nodiscard]] std::size_t memory_size() const { return block_.size(); }
    /// The scene fits into a cube of twice this edge length, in world units.
    [[nodiscard]] double size() const { return space_.size; }

private:
    friend class detail::Hemisphere;

    void swap(Bvh& other) noexcept
    {
        std::swap(block_, other.block_);
        std::swap(nodes_, other.nodes_);
        std::swap(triangles_, other.triangles_);
        std::swap(triangle_count_, other.triangle_count_);
        std::swap(dropped_, other.dropped_);
        std::swap(space_, other.space_);
        std::swap(depth_, other.depth_);
    }
    [[nodiscard]] bool scene_occluded(const detail::SceneRay& ray) const;
    template <bool nearest_first, class Visit>
    void traverse(const detail::SceneRay& ray, const double& t_max, const Visit& visit) const;

    detail::Block block_;
    const detail::BvhNode* nodes_ = nullptr;
    const detail::SceneTriangle* triangles_ = nullptr;
    std::size_t triangle_count_ = 0, dropped_ = 0;
    detail::SceneSpace space_;
    int depth_ = 0;
};

inline Outcome Bvh::build(const MeshView& mesh, const BvhOptions& options)
{
    if (const Error error = check_mesh(mesh)) return {error};
    if (options.leaf_size < 1 || options.leaf_size > 255)
        return {{ErrorCode::bad_value, "options.leaf_size", double(options.leaf_size),
                 "1 to 255 triangles"}};
    std::size_t usable = 0;
    for (std::size_t t = 0; t < mesh.triangle_count; ++t) usable += is_usable_triangle(mesh, t);

    Bvh result;
    result.dropped_ = mesh.triangle_count - usable;
    if (usable == 0) {
        *this = std::move(result);
        return {};
    }
    const auto out_of_memory = [](std::size_t bytes) -> Outcome {
        return {{ErrorCode::out_of_memory, "options.memory", double(bytes), "that many bytes"}};
    };
    using Item = detail::BvhBuilder::Item;
    using detail::BvhNode;
    using detail::SceneTriangle;
    result.space_ = detail::scene_space(mesh);
    const detail::Block items_block{options.memory, usable * sizeof(Item)};
    if (items_block.data() == nullptr) return out_of_memory(items_block.size());
    Item* const items = static_cast<Item*>(items_block.data());
    std::size_t count = 0;
    for (std::size_t t = 0; t < mesh.triangle_count; ++t)
        if (is_usable_triangle(mesh, t))
            items[count++] = {detail::scene_triangle(mesh, result.space_, t).bounds(),
                              static_cast<std::uint32_t>(t)};

    detail::BvhBuilder builder{options.memory, options.leaf_size, items,
                               static_cast<std::uint32_t>(usable)};
    if (!builder.build()) return out_of_memory(usable * sizeof(BvhNode));

    // One block of the exact size: nodes, then triangles in leaf order.
    const std::size_t node_bytes = std::size_t{builder.node_count()} * sizeof(BvhNode);
    const std::size_t bytes = node_bytes + usable * sizeof(SceneTriangle);
    result.block_ = detail::Block{options.memory, bytes};
    if (result.block_.data() == nullptr) return out_of_memory(bytes);
    std::memcpy(result.block_.data(), builder.nodes(), node_bytes);
    result.nodes_ = static_cast<const BvhNode*>(result.block_.data());
    auto* const triangles = reinterpret_cast<SceneTriangle*>(
        static_cast<std::byte*>(result.block_.data()) + node_bytes);
    for (std::size_t i = 0; i < usable; ++i)
        triangles[i] = detail::scene_triangle(mesh, result.space_, items[i].triangle);
    result.triangles_ = triangles;
    result.triangle_count_ = usable;
    result.depth_ = builder.depth();
    *this = std::move(result);
    return {};
}

namespace detail {

/// The ray against four boxes, in float and on the safe side.
///
/// With b a bound and o the origin, (b − o) / d is computed as b · i − o · i. The reciprocal, the two
/// products and the difference are each off by 2⁻²⁴ of themselves: together by less than 2⁻²² of
/// |t| + |o · i|, where no |t| beyond t_max matters, and |b| ≤ 1 in scene space. The triangle test
/// rounds the ray's own offset from a vertex to float, by 2⁻²⁴ of its distance, which is at most the
/// length of the ray (its direction is no longer than 4) and the size of the triangle; for the latter
/// the boxes are padded. Each interval grows by all that, so no box is missed whose triangle the ray
/// meets: not a flat one, not one whose face holds the origin. A ray that is short beside the scene
/// gets a margin that is, too. A direction component of 0 takes a reciprocal of 2⁶⁰ in place of
/// infinity, which the same margin covers.
class SlabTest {
public:
    explicit SlabTest(const SceneRay& ray)
    {
        for (int k = 0; k < 3; ++k) {
            const double d = ray.direction[k];
            const double inverse = std::fabs(d) > 0x1p-60 ? 1 / d : d < 0 ? -0x1p60 : 0x1p60;
            const double start = ray.origin[k] * inverse;
            const double reach = (std::min)(1.0, 16 * ray.t_max);
            const double margin = 0x1p-22 * (reach + std::fabs(ray.origin[k])) * std::fabs(inverse);
            inverse_[k] = static_cast<float>(inverse);
            near_side_[k] = d < 0 ? 1 : 0;
            near_start_[k] = static_cast<float>(start + margin);
            far_start_[k] = static_cast<float>(start - margin);
        }
    }
    /// A float not below a double.
    [[nodiscard]] static float rounded_up(double t)
    {
        return static_cast<float>(t * (1 + 0x1p-22));
    }

    /// One bit per lane that the ray enters before `end`, and where it enters.
    [[nodiscard]] unsigned enter(const BvhNode& node, float end,
                                 float (&entry)[BvhNode::lanes]) const
    {
#if defined(__SSE2__)
        // The same four lanes at once.
        __m128 enters = _mm_setzero_ps(), leaves = _mm_set1_ps(end);
        for (int k = 0; k < 3; ++k) {
            const __m128 inverse = _mm_set1_ps(inverse_[k]);
            const float* const from = node.bounds[k][near_side_[k]];
            const float* const to = node.bounds[k][1 - near_side_[k]];
            enters = _mm_max_ps(
                _mm_sub_ps(_mm_mul_ps(_mm_loadu_ps(from), inverse), _mm_set1_ps(near_start_[k])),
                enters);
            leaves = _mm_min_ps(
                _mm_sub_ps(_mm_mul_ps(_mm_loadu_ps(to), inverse), _mm_set1_ps(far_start_[k])),
                leaves);
        }
        _mm_storeu_ps(entry, enters);
        return static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(enters, leaves)));
#else
        float exit[BvhNode::lanes];
        for (int lane = 0; lane < BvhNode::lanes; ++lane) {
            entry[lane] = 0;
            exit[lane] = end;
        }
        for (int k = 0; k < 3; ++k) {
            const float* const from = node.bounds[k][near_side_[k]];
            const float* const to = node.bounds[k][1 - near_side_[k]];
            const float inverse = inverse_[k], near_start = near_start_[k],
                        far_start = far_start_[k];
            for (int lane = 0; lane < BvhNode::lanes; ++lane) {
                const float first = from[lane] * inverse - near_start;
                const float last = to[lane] * inverse - far_start;
                entry[lane] = first > entry[lane] ? first : entry[lane];
                exit[lane] = last < exit[lane] ? last : exit[lane];
            }
        }
        unsigned mask = 0;
        for (int lane = 0; lane < BvhNode::lanes; ++lane)
            mask |= (entry[lane] <= exit[lane] ? 1u : 0u) << lane;
        return mask;
#endif
    }

private:
    float inverse_[3], near_start_[3], far_start_[3];
    int near_side_[3];
};

}  // namespace detail

/// Visits the leaves along a ray: visit(first, count) returns true to stop. `t_max` may shrink.
template <bool nearest_first, class Visit>
void Bvh::traverse(const detail::SceneRay& ray, const double& t_max, const Visit& visit) const
{
    using detail::BvhNode;
    using detail::SlabTest;
    struct Waiting {
        std::uint32_t node;
        float entry;
    };
    const SlabTest slabs{ray};
    Waiting stack[detail::BvhBuilder::most_levels * (BvhNode::lanes - 1) + BvhNode::lanes];
    int waiting = 0;
    stack[waiting++] = {0, 0};
    while (waiting > 0) {
        const Waiting next = stack[--waiting];
        const float end = SlabTest::rounded_up(t_max);
        if (next.entry > end) continue;
        const BvhNode& node = nodes_[next.node];
        float entry[BvhNode::lanes];
        unsigned mask = slabs.enter(node, end, entry);
        // Leaves at once, the others onto the stack.
        [[maybe_unused]] const int bottom = waiting;
        for (; mask != 0; mask &= mask - 1) {
            const int lane = std::countr_zero(mask);
            if (node.count[lane] > 0) {
                if (visit(node.child[lane], node.count[lane])) return;
                continue;
            }
            int at = waiting++;
            if constexpr (nearest_first)
                for (; at > bottom && stack[at - 1].entry < entry[lane]; --at)
                    stack[at] = stack[at - 1];
            stack[at] = {node.child[lane], entry[lane]};
        }
    }
}

inline bool Bvh::scene_occluded(const detail::SceneRay& ray) const
{
    if (triangle_count_ == 0 || !ray.valid()) return false;
    bool found = false;
    traverse<false>(ray, ray.t_max, [&](std::uint32_t first, std::uint32_t count) {
        for (std::uint32_t i = first; i < first + count && !found; ++i)
            found = ray.is_occluded_by(triangles_[i]);
        return found;
    });
    return found;
}

inline bool Bvh::occluded(const Ray& ray) const { return scene_occluded({space_, ray}); }

inline Hit Bvh::closest(const Ray& ray) const
{
    Hit hit{};
    if (triangle_count_ == 0) return hit;
    const detail::SceneRay local{space_, ray};
    if (!local.valid()) return hit;
    double t_max = local.t_max;
    traverse<true>(local, t_max, [&](std::uint32_t first, std::uint32_t count) {
        for (std::uint32_t i = first; i < first + count; ++i)
            local.keep_nearest(triangles_[i], hit);
        if (hit) t_max = hit.t;
        return false;
    });
    if (hit) hit.t = local.world_t(hit.t);
    return hit;
}

}  // namespace nook::inline NOOK_TARGET
