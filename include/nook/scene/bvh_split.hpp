#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include <nook/scene/bvh_bins.hpp>
#include <nook/scene/bvh_node.hpp>
#include <nook/scene/bvh_tree.hpp>

/// Splits a list of triangles down to blocks.
namespace nook::inline NOOK_TARGET::detail {

/// Items [first, last), and the side of a pair that they are.
struct BvhRange {
    static constexpr std::uint32_t no_pair = 0xffffffff;
    /// Splits on the way from the root to a block, at most.
    static constexpr int most_levels = BvhView::most_levels - 1;
    /// Larger ranges are halved as they lie: their counts would not fit.
    static constexpr std::uint32_t most_binned = 1u << 29;

    std::uint32_t first, last;
    std::uint32_t pair, side;
    /// 1 for the root.
    int level;
    /// Of the centres (twice).
    BoxRow centres;

    [[nodiscard]] std::uint32_t size() const { return last - first; }
    /// Whether it may be split by its bins, or must be halved so that the tree stays shallow.
    [[nodiscard]] bool splits(const BinGrid& grid) const;
};

/// A range that one task splits.
struct BvhSubtree {
    /// Larger ranges are split by all workers together.
    static constexpr std::uint32_t most_items = 4096;

    BvhRange range;
    /// Where its items lie.
    const BvhItem* items;
    /// Its pairs begin here, the one of the whole range first.
    std::uint32_t pairs;
    LaneCosts costs;
};

/// Pairs that a subtree may need: it ends with more than five triangles to a block.
[[nodiscard]] constexpr std::uint32_t pair_capacity(std::uint32_t size) { return size / 5 + 2; }

/// Brings the items of a subtree of more than eight into the order of its blocks, at their place in
/// `items`, and writes its pairs.
inline void split_subtree(BvhItem* items, BvhPair* pairs, BvhSubtree& subtree);

[[nodiscard]] constexpr std::uint32_t blocks_for(std::uint32_t size)
{
    return size / TriangleBlock::lanes + (size % TriangleBlock::lanes != 0 ? 1 : 0);
}
/// Half of a range, in whole blocks.
[[nodiscard]] constexpr std::uint32_t half_of(std::uint32_t size)
{
    return (blocks_for(size) + 1) / 2 * TriangleBlock::lanes;
}
/// How many times a range is halved until it is blocks.
[[nodiscard]] constexpr int halvings(std::uint32_t size)
{
    return static_cast<int>(std::bit_width((size - 1) / TriangleBlock::lanes));
}

inline bool BvhRange::splits(const BinGrid& grid) const
{
    return grid.splits() && size() <= most_binned && level + halvings(size()) <= most_levels;
}

/// The boxes of the two halves of a range.
inline void half_boxes(const BvhItem* items, std::uint32_t size, BoxRow (&sides)[2])
{
    for (BoxRow& side : sides) side = empty_box();
    for (std::uint32_t i = 0; i < size; ++i) {
        BoxRow& side = sides[i >= half_of(size)];
        side = smaller(side, items[i].box());
    }
}
[[nodiscard]] inline float area_of(const BvhItem* items, std::uint32_t first, std::uint32_t last)
{
    float sum = 0;
    for (std::uint32_t i = first; i < last; ++i) sum += items[i].area;
    return sum;
}

/// Chooses the lanes of the nodes of a subtree's pairs.
inline void collapse_subtree(BvhPair* pairs, std::uint32_t count, LaneCosts& result)
{
    // A pair comes before those in it, and what its second side holds before what its first does.
    LaneCosts costs[BvhRange::most_levels + 2];
    int done = 0;
    for (std::uint32_t i = count; i-- > 0;) {
        LaneCosts sides[2];
        for (int side = 1; side >= 0; --side) {
            if (pairs[i].sides[side].leaf()) sides[side].area = pairs[i].sides[side].area;
            else sides[side] = costs[--done];
        }
        costs[done++] = merge_costs(pairs[i], sides[0], sides[1]);
    }
    result = costs[0];
}

inline void split_subtree(BvhItem* items, BvhPair* all_pairs, BvhSubtree& subtree)
{
    const BvhRange& whole = subtree.range;
    if (subtree.items != items)
        std::memcpy(items + whole.first, subtree.items + whole.first,
                    whole.size() * sizeof(BvhItem));
    BvhPair* const pairs = all_pairs + subtree.pairs;
    std::uint32_t used = 0;
    /// Blocks that may be added to what halving would need.
    std::uint32_t spare = pair_capacity(whole.size()) + 1 - blocks_for(whole.size());
    BvhRange stack[BvhRange::most_levels + 2];
    int waiting = 0;
    stack[waiting++] = whole;
    stack[0].pair = BvhRange::no_pair;
    Bins bins;
    BinPlace places[BvhSubtree::most_items];
    while (waiting > 0) {
        const BvhRange range = stack[--waiting];
        const std::uint32_t size = range.size(), index = used++;
        if (range.pair != BvhRange::no_pair)
            pairs[range.pair].sides[range.side].link = subtree.pairs + index;
        BvhItem* const part = items + range.first;
        const BinGrid grid{range.centres, size};
        BinCut cut;
        if (range.splits(grid)) {
            bins.clear(grid.bins());
            bins.add(grid, part, size, places);
            cut = bins.best_cut();
            const std::uint32_t more =
                blocks_for(cut.left) + blocks_for(size - cut.left) - blocks_for(size);
            if (more > spare) cut.axis = -1;
            else spare -= more;
        }
        SideCentres centres;
        BoxRow boxes[2];
        std::uint32_t left = 0;
        if (cut.axis >= 0) {
            bins.boxes(cut, boxes);
            // Without a branch to guess: the first item that may have to go right changes places
            // with each.
            for (std::uint32_t i = 0; i < size; ++i) {
                const BvhItem item = part[i];
                const std::uint32_t side = places[i].side(cut);
                centres.include(item, side);
                part[i] = part[left];
                part[left] = item;
                left += 1 - side;
            }
        } else {
            left = half_of(size);
            half_boxes(part, size, boxes);
            for (std::uint32_t i = 0; i < size; ++i) centres.include(part[i], i < left ? 0 : 1);
        }
        const std::uint32_t bounds[3] = {range.first, range.first + left, range.last};
        for (std::uint32_t i = 0; i < 2; ++i) {
            BvhSide& side = pairs[index].sides[i];
            side.set_box(boxes[i]);
            side.count = bounds[i + 1] - bounds[i];
            if (side.leaf()) {
                side.link = bounds[i];
                side.area = area_of(items, bounds[i], bounds[i + 1]);
            } else {
                stack[waiting++] = {bounds[i], bounds[i + 1],   index,
                                    i,         range.level + 1, centres.box[i]};
            }
        }
    }
    collapse_subtree(pairs, used, subtree.costs);
}

}  // namespace nook::inline NOOK_TARGET::detail
