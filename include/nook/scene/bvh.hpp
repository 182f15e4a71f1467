#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <nook/execution.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/bvh_build.hpp>
#include <nook/scene/bvh_refit.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/ray.hpp>
#include <nook/scene/sphere.hpp>
#include <nook/scene/traversal.hpp>
#include <nook/scratch.hpp>

namespace nook {

struct BvhOptions {
    /// Where the hierarchy and the builder's working memory come from.
    Memory memory{};
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// A hierarchy of boxes over the triangles of a mesh, for rays. Copies what it needs: the mesh may go
/// after `build`. Queries may run on any number of threads at once. Without triangles, or before
/// `build`, nothing is ever hit.
///
/// Coordinates are relative to an origin near the scene and scaled by a power of two, both exactly:
/// a scene 10⁶ units from zero, or scaled by a power of two, gives the hits it gives at home. The
/// triangle test is watertight (Woop, Benthin & Wald 2013, with exact signs of the edge functions).
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
    /// triangles are left out. O(n log n), no recursion. The same bits with any executor.
    template <class E = Serial>
    [[nodiscard]] Outcome build(const MeshView& mesh, const BvhOptions& options = {},
                                E&& executor = {});

    /// Takes over the vertices of a mesh whose triangles have moved, and keeps the tree: faster than a
    /// build, with slower rays the more has changed. The answers are those for the moved mesh. A
    /// triangle that is not usable any more is not hit and leaves its neighbours as they are; it
    /// comes back when it is usable again. One that was left out of the build stays out.
    /// `triangle_count()` and `dropped()` stay. A mesh of another `triangle_count` than was built is
    /// an error, and nothing changes. Needs no memory. The same bits with any executor.
    template <class E = Serial>
    [[nodiscard]] Outcome refit(const MeshView& mesh, E&& executor = {});

    /// Whether any triangle lies on the ray.
    [[nodiscard]] bool occluded(const Ray& ray) const;
    /// The nearest triangle on the ray.
    [[nodiscard]] Hit closest(const Ray& ray) const;

    /// Calls visit(face) once for each triangle at most `radius` from `centre`, in world units: the
    /// ball is closed, and infinity reaches everything. Faces come in the order of the tree, which is
    /// the same for the same mesh. A visit that returns false ends it; one may return nothing.
    /// Nothing is visited where the centre is not finite or farther from the scene than 2⁶⁰ times
    /// its size, or the radius is negative or NaN. Returns false when a visit ended it.
    template <class Visit>
    bool in_sphere(const glm::dvec3& centre, double radius, Visit&& visit) const
    {
        return detail::visit_in_sphere(view(), detail::SceneSphere{space_, centre, radius}, visit);
    }

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

    /// What traversals read.
    [[nodiscard]] detail::BvhView view() const { return {nodes_, blocks_, root_}; }
    [[nodiscard]] const detail::SceneSpace& space() const { return space_; }

private:
    void swap(Bvh& other) noexcept
    {
        std::swap(block_, other.block_);
        std::swap(nodes_, other.nodes_);
        std::swap(blocks_, other.blocks_);
        std::swap(root_, other.root_);
        std::swap(node_count_, other.node_count_);
        std::swap(triangle_count_, other.triangle_count_);
        std::swap(dropped_, other.dropped_);
        std::swap(space_, other.space_);
        std::swap(depth_, other.depth_);
    }
    detail::Block block_;
    detail::BvhNode* nodes_ = nullptr;
    detail::TriangleBlock* blocks_ = nullptr;
    std::uint32_t root_ = no_face, node_count_ = 0;
    std::size_t triangle_count_ = 0, dropped_ = 0;
    detail::SceneSpace space_;
    int depth_ = 0;
};

template <class E>
Outcome Bvh::build(const MeshView& mesh, const BvhOptions& options, E&& executor)
{
    using detail::BvhNode;
    using detail::TriangleBlock;
    if (const Error error = check_mesh(mesh)) return {error};
    const auto out_of_memory = [](std::size_t bytes) -> Outcome {
        return {{ErrorCode::out_of_memory, "options.memory", double(bytes), "that many bytes"}};
    };
    detail::BvhBuilder builder{mesh, options.memory};
    if (const std::size_t lacking = builder.sort(executor)) return out_of_memory(lacking);
    Bvh result;
    result.triangle_count_ = builder.triangle_count();
    result.dropped_ = mesh.triangle_count - result.triangle_count_;
    if (result.triangle_count_ > 0) {
        TriangleBlock* blocks = nullptr;
        BvhNode* nodes = nullptr;
        const auto layout = [&](detail::ScratchLayout arrays) {
            blocks = arrays.take<TriangleBlock>(builder.block_count());
            nodes = arrays.take<BvhNode>(builder.node_count());
            return arrays.size();
        };
        const std::size_t bytes = layout(detail::ScratchLayout{});
        result.block_ = detail::Block{options.memory, bytes};
        if (result.block_.data() == nullptr) return out_of_memory(bytes);
        layout(detail::ScratchLayout{result.block_.data()});
        builder.write(nodes, blocks, executor);
        result.nodes_ = nodes;
        result.blocks_ = blocks;
        result.root_ = 0;
        result.node_count_ = static_cast<std::uint32_t>(builder.node_count());
        result.space_ = builder.space();
        result.depth_ = builder.depth();
    }
    *this = std::move(result);
    return {};
}

template <class E>
Outcome Bvh::refit(const MeshView& mesh, E&& executor)
{
    if (const Error error = check_mesh(mesh)) return {error};
    if (mesh.triangle_count != triangle_count_ + dropped_)
        return {{ErrorCode::bad_size, "mesh.triangle_count", double(mesh.triangle_count),
                 "as many triangles as were built"}};
    if (triangle_count_ == 0) return {};
    space_ = detail::scene_space(mesh);
    detail::refit_nodes(mesh, space_, nodes_, node_count_, blocks_, executor);
    return {};
}

inline bool Bvh::occluded(const Ray& ray) const
{
    return detail::occluded(view(), detail::SceneRay{space_, ray});
}

inline Hit Bvh::closest(const Ray& ray) const
{
    const detail::SceneRay local{space_, ray};
    Hit hit = detail::closest(view(), local);
    if (hit) hit.t = local.world_t(hit.t);
    return hit;
}

}  // namespace nook::inline NOOK_TARGET
