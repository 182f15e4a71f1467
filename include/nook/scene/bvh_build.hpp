#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/lanes.hpp>
#include <nook/scene/bvh_box.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/bvh_split.hpp>
#include <nook/scene/bvh_split_top.hpp>
#include <nook/scene/bvh_tree.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/ray.hpp>

/// Builds a hierarchy of eight-way nodes over blocks of eight triangles: a binary tree split from the
/// top down by the surface area heuristic, then the best eight-way tree in it.
namespace nook::inline NOOK_TARGET::detail {

/// Puts the triangles that a block names into scene space, as `scene_triangle` does.
inline void fill_block(const MeshView& mesh, const SceneSpace& space, TriangleBlock& block)
{
    for (int lane = 0; lane < TriangleBlock::lanes; ++lane) {
        const std::uint32_t* const index = mesh.indices + std::size_t{3} * block.faces[lane];
        for (int i = 0; i < 3; ++i) {
            const float* const v =
                mesh.positions + static_cast<std::ptrdiff_t>(index[i]) * mesh.position_stride;
            for (int k = 0; k < 3; ++k) block.vertices[i][k][lane] = v[k];
        }
    }
    const double origin[3] = {space.origin.x, space.origin.y, space.origin.z};
    constexpr int lanes = native_lanes;
    for (auto& corner : block.vertices)
        for (int k = 0; k < 3; ++k)
            for (int lane = 0; lane < TriangleBlock::lanes; lane += lanes) {
                float* const at = corner[k] + lane;
                store(at, convert<float>(static_cast<Lanes<double, lanes>>(
                              (convert<double>(load<lanes>(at)) - origin[k]) * space.scale)));
            }
}

/// One build. `sort` makes the tree, `write` puts it into memory that the caller gets in between. All
/// work is cut by the mesh alone, so the result does not depend on the executor; no recursion.
class BvhBuilder {
public:
    BvhBuilder(const MeshView& mesh, const Memory& memory) : mesh_{mesh}, memory_{memory} {}

    /// Returns how many bytes could not be had: 0 on success.
    template <class E>
    [[nodiscard]] std::size_t sort(E& executor);
    /// Writes nodes and blocks; the root is node 0, and a node comes before those in it.
    template <class E>
    void write(BvhNode* nodes, TriangleBlock* blocks, E& executor) const;

    [[nodiscard]] const SceneSpace& space() const { return space_; }
    [[nodiscard]] std::uint32_t triangle_count() const { return item_count_; }
    [[nodiscard]] std::size_t node_count() const { return total_.nodes; }
    [[nodiscard]] std::size_t block_count() const { return total_.blocks; }
    [[nodiscard]] int depth() const { return total_.depth; }

private:
    /// Triangles read as one task.
    static constexpr std::size_t portion_size = 4096;
    static constexpr std::uint32_t no_parent = no_face;

    struct Portion {
        std::uint32_t usable, first;
        BoxRow centres;
    };
    struct Totals {
        std::size_t nodes = 0, blocks = 0;
        int depth = 0;
    };
    /// A node that one task writes, with all below it.
    struct Branch {
        NodePlace place;
        Totals totals;
        std::size_t first_node, first_block;
    };

    [[nodiscard]] std::size_t portion_last(int portion) const
    {
        return (std::min)((static_cast<std::size_t>(portion) + 1) * portion_size,
                          mesh_.triangle_count);
    }
    template <class E>
    [[nodiscard]] std::size_t survey(E& executor);
    [[nodiscard]] std::uint32_t usable_in(int portion) const;
    template <class E>
    [[nodiscard]] std::size_t fill(E& executor);
    void fill_portion(int portion);
    template <class E>
    [[nodiscard]] std::size_t split(E& executor);
    template <class E>
    [[nodiscard]] std::size_t plan(E& executor);
    /// Counts a node; the lanes to go on with, as bits. `branch(side, lane)` takes those that are not.
    template <class Other>
    [[nodiscard]] unsigned count_node(const NodePlace& place, const BvhSide* const* sides,
                                      int count, Totals& totals, const Other& branch) const;
    void write_below(const NodePlace& root, std::size_t node, std::size_t block,
                     std::uint32_t pairs_end, BvhNode* nodes, TriangleBlock* blocks) const;
    void write_only_block(BvhNode& node, TriangleBlock& block) const;
    void write_block(const BvhSide& leaf, TriangleBlock& block) const;

    const MeshView& mesh_;
    const Memory& memory_;
    SceneSpace space_;

    Block portions_block_, items_block_, pairs_block_, branches_block_;
    Portion* portions_ = nullptr;
    int portion_count_ = 0;
    BvhItem* items_ = nullptr;
    std::uint32_t item_count_ = 0;
    /// Those of the top, then those of the subtrees.
    BvhPair* pairs_ = nullptr;
    std::uint32_t top_pair_count_ = 0;
    Branch* branches_ = nullptr;
    int branch_count_ = 0;
    Totals total_;
};

template <class E>
std::size_t BvhBuilder::sort(E& executor)
{
    if (const std::size_t lacking = survey(executor)) return lacking;
    if (item_count_ == 0) return 0;
    if (const std::size_t lacking = fill(executor)) return lacking;
    if (const std::size_t lacking = split(executor)) return lacking;
    return plan(executor);
}

/// Counts what is usable, and finds the space.
template <class E>
std::size_t BvhBuilder::survey(E& executor)
{
    const std::size_t count = mesh_.triangle_count;
    portion_count_ = static_cast<int>(count / portion_size + (count % portion_size != 0 ? 1 : 0));
    const std::size_t lacking =
        allocate_arrays(portions_block_, memory_, [&](ScratchLayout& arrays) {
            portions_ = arrays.take<Portion>(static_cast<std::size_t>(portion_count_));
        });
    if (lacking > 0) return lacking;
    executor.for_each(portion_count_,
                      [&](int task, int) { portions_[task].usable = usable_in(task); });
    for (int i = 0; i < portion_count_; ++i) {
        portions_[i].first = item_count_;
        item_count_ += portions_[i].usable;
    }
    space_ = scene_space(mesh_);
    return 0;
}

inline std::uint32_t BvhBuilder::usable_in(int portion) const
{
    std::uint32_t usable = 0;
    for (std::size_t t = static_cast<std::size_t>(portion) * portion_size;
         t < portion_last(portion); ++t)
        usable += is_usable_triangle(mesh_, t) ? 1 : 0;
    return usable;
}

template <class E>
std::size_t BvhBuilder::fill(E& executor)
{
    const std::size_t lacking = allocate_arrays(items_block_, memory_, [&](ScratchLayout& arrays) {
        items_ = arrays.take<BvhItem>(item_count_);
    });
    if (lacking > 0) return lacking;
    executor.for_each(portion_count_, [&](int task, int) { fill_portion(task); });
    return 0;
}

inline void BvhBuilder::fill_portion(int index)
{
    Portion& portion = portions_[index];
    const std::size_t first = static_cast<std::size_t>(index) * portion_size;
    const std::size_t last = portion_last(index);
    const bool all = portion.usable == last - first;
    BoxRow centres = empty_box();
    BvhItem* next = items_ + portion.first;
    for (std::size_t t = first; t < last; ++t) {
        if (!all && !is_usable_triangle(mesh_, t)) continue;
        BvhItem& item = *next++;
        item = bvh_item(scene_triangle(mesh_, space_, t));
        centres = smaller(centres, centre_box(item.box()));
    }
    portion.centres = centres;
}

template <class E>
std::size_t BvhBuilder::split(E& executor)
{
    BoxRow centres = empty_box();
    for (int i = 0; i < portion_count_; ++i) centres = smaller(centres, portions_[i].centres);
    portions_block_.reset();

    TopSplit top;
    if (const std::size_t lacking = top.run(memory_, items_, item_count_, centres, executor))
        return lacking;
    top_pair_count_ = top.pair_count();
    const std::uint32_t count = top.subtree_count();
    std::size_t pair_count = top_pair_count_;
    for (std::uint32_t i = 0; i < count; ++i)
        pair_count += pair_capacity(top.subtrees()[i].range.size());
    Block subtrees_block;
    BvhSubtree* subtrees = nullptr;
    if (const std::size_t lacking = allocate_arrays(
            subtrees_block, memory_,
            [&](ScratchLayout& arrays) { subtrees = arrays.take<BvhSubtree>(count); }))
        return lacking;
    if (const std::size_t lacking = allocate_arrays(
            pairs_block_, memory_,
            [&](ScratchLayout& arrays) { pairs_ = arrays.take<BvhPair>(pair_count); }))
        return lacking;
    for (std::uint32_t i = 0; i < top_pair_count_; ++i) pairs_[i] = top.pairs()[i];
    std::uint32_t pairs = top_pair_count_;
    for (std::uint32_t i = 0; i < count; ++i) {
        subtrees[i] = top.subtrees()[i];
        subtrees[i].pairs = pairs;
        const BvhRange& range = subtrees[i].range;
        if (range.pair != BvhRange::no_pair) pairs_[range.pair].sides[range.side].link = pairs;
        pairs += pair_capacity(range.size());
    }
    executor.for_each(static_cast<int>(count),
                      [&](int task, int) { split_subtree(items_, pairs_, subtrees[task]); });
    top.collapse(pairs_, subtrees);
    return 0;
}

template <class Other>
unsigned BvhBuilder::count_node(const NodePlace& place, const BvhSide* const* sides, int count,
                                Totals& totals, const Other& branch) const
{
    ++totals.nodes;
    totals.depth = (std::max)(totals.depth, place.level);
    unsigned lanes = 0;
    for (int lane = 0; lane < count; ++lane) {
        if (sides[lane]->leaf()) ++totals.blocks;
        else if (!branch(*sides[lane], lane)) lanes |= 1u << lane;
    }
    return lanes;
}

/// Cuts the tree into branches that are counted, and later written, side by side.
template <class E>
std::size_t BvhBuilder::plan(E& executor)
{
    if (item_count_ <= TriangleBlock::lanes) {
        total_ = {1, 1, 1};
        return 0;
    }
    const std::size_t lacking =
        allocate_arrays(branches_block_, memory_, [&](ScratchLayout& arrays) {
            branches_ = arrays.take<Branch>(std::size_t{BvhNode::lanes} * top_pair_count_ + 1);
        });
    if (lacking > 0) return lacking;
    const NodePlace root{0, no_parent, 0, 1};
    if (top_pair_count_ == 0) {
        branches_[branch_count_++] = {root, {}, 0, 0};
    } else {
        walk_nodes(pairs_, root,
                   [&](const NodePlace& place, const BvhSide* const* sides, int count,
                       std::uint32_t& index) {
                       index = static_cast<std::uint32_t>(total_.nodes);
                       return count_node(
                           place, sides, count, total_, [&](const BvhSide& side, int lane) {
                               if (side.link < top_pair_count_) return false;
                               branches_[branch_count_++] = {
                                   {side.link, index, lane, place.level + 1}, {}, 0, 0};
                               return true;
                           });
                   });
    }
    executor.for_each(branch_count_, [&](int task, int) {
        Branch& branch = branches_[task];
        walk_nodes(
            pairs_, branch.place,
            [&](const NodePlace& place, const BvhSide* const* sides, int count, std::uint32_t&) {
                return count_node(place, sides, count, branch.totals,
                                  [](const BvhSide&, int) { return false; });
            });
    });
    for (int i = 0; i < branch_count_; ++i) {
        Branch& branch = branches_[i];
        branch.first_node = total_.nodes;
        branch.first_block = total_.blocks;
        total_.nodes += branch.totals.nodes;
        total_.blocks += branch.totals.blocks;
        total_.depth = (std::max)(total_.depth, branch.totals.depth);
    }
    return 0;
}

template <class E>
void BvhBuilder::write(BvhNode* nodes, TriangleBlock* blocks, E& executor) const
{
    if (item_count_ <= TriangleBlock::lanes) {
        write_only_block(nodes[0], blocks[0]);
        return;
    }
    if (top_pair_count_ > 0)
        write_below({0, no_parent, 0, 1}, 0, 0, top_pair_count_, nodes, blocks);
    executor.for_each(branch_count_, [&](int task, int) {
        const Branch& branch = branches_[task];
        write_below(branch.place, branch.first_node, branch.first_block, no_face, nodes, blocks);
    });
}

/// Boxes without children.
inline void write_boxes(const BvhSide* const* sides, int count, BvhNode& node)
{
    const Bounds nothing = Bounds::nothing();
    for (int lane = 0; lane < BvhNode::lanes; ++lane) {
        for (int k = 0; k < 3; ++k) {
            node.bounds[k][0][lane] = lane < count ? sides[lane]->low[k] : nothing.low[k];
            node.bounds[k][1][lane] =
                lane < count ? -sides[lane]->negative_high[k] : nothing.high[k];
        }
        node.child[lane] = no_face;
    }
}

/// Writes the nodes below a pair whose own pair lies before `pairs_end`, and their blocks.
inline void BvhBuilder::write_below(const NodePlace& root, std::size_t next_node,
                                    std::size_t next_block, std::uint32_t pairs_end, BvhNode* nodes,
                                    TriangleBlock* blocks) const
{
    walk_nodes(
        pairs_, root,
        [&](const NodePlace& place, const BvhSide* const* sides, int count, std::uint32_t& index) {
            index = static_cast<std::uint32_t>(next_node++);
            if (place.parent != no_parent) nodes[place.parent].child[place.lane] = index;
            BvhNode& node = nodes[index];
            write_boxes(sides, count, node);
            unsigned lanes = 0;
            for (int lane = 0; lane < count; ++lane) {
                if (sides[lane]->leaf()) {
                    node.child[lane] = BvhNode::block_bit | static_cast<std::uint32_t>(next_block);
                    write_block(*sides[lane], blocks[next_block++]);
                } else if (sides[lane]->link < pairs_end) {
                    lanes |= 1u << lane;
                }
            }
            return lanes;
        });
}

inline void BvhBuilder::write_only_block(BvhNode& node, TriangleBlock& block) const
{
    BvhSide only{};
    BoxRow box = empty_box();
    for (std::uint32_t i = 0; i < item_count_; ++i) box = smaller(box, items_[i].box());
    only.set_box(box);
    only.count = item_count_;
    const BvhSide* const sides[1] = {&only};
    write_boxes(sides, 1, node);
    node.child[0] = BvhNode::block_bit;
    write_block(only, block);
}

inline void BvhBuilder::write_block(const BvhSide& leaf, TriangleBlock& block) const
{
    for (std::uint32_t lane = 0; lane < TriangleBlock::lanes; ++lane)
        block.faces[lane] = items_[leaf.link + (std::min)(lane, leaf.count - 1)].face;
    fill_block(mesh_, space_, block);
}

}  // namespace nook::inline NOOK_TARGET::detail
