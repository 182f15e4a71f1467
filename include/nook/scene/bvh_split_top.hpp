#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include <nook/scene/bvh_bins.hpp>
#include <nook/scene/bvh_split.hpp>
#include <nook/scene/bvh_tree.hpp>
#include <nook/scene/memory.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// The first splits of a long list of triangles, all workers together: level by level, each level in
/// pieces of equal size, whose bins are added up in order and whose items go to places known before.
/// So the order of the items depends on nothing but the items. What is left is subtrees.
class TopSplit {
public:
    /// Splits down to subtrees. Items of subtrees may lie in a second list: see `BvhSubtree::items`.
    /// Returns how many bytes could not be had: 0 on success.
    template <class E>
    [[nodiscard]] std::size_t run(const Memory& memory, BvhItem* items, std::uint32_t count,
                                  const BoxRow& centres, E& executor);
    /// Chooses the lanes of the nodes of its pairs; `pairs` holds them and those of the subtrees,
    /// which are finished.
    void collapse(BvhPair* pairs, const BvhSubtree* subtrees);

    /// Pairs; a pair comes before those in it.
    [[nodiscard]] const BvhPair* pairs() const { return pairs_; }
    [[nodiscard]] std::uint32_t pair_count() const { return pair_count_; }
    [[nodiscard]] const BvhSubtree* subtrees() const { return subtrees_; }
    [[nodiscard]] std::uint32_t subtree_count() const { return subtree_count_; }

private:
    static constexpr std::uint32_t piece_size = BvhSubtree::most_items;

    /// A range that is split in pieces.
    struct Split {
        BvhRange range;
        BinGrid grid;
        bool binned;
        BinCut cut;
        int first_piece;
        BoxRow boxes[2];
    };
    struct Piece {
        std::uint32_t split, first, last;
        /// Where its items go.
        std::uint32_t left, right;
        SideCentres centres;
        Bins bins;

        [[nodiscard]] std::uint32_t size() const { return last - first; }
    };
    /// Where a pair belongs, and what its sides cost.
    struct Costs {
        std::uint32_t parent, parent_side;
        LaneCosts sides[2];
    };

    void add(const BvhRange& range, BvhItem* items, const BvhItem* from);
    void cut_pieces();
    void choose_cut(int split);
    void part(Piece& piece, const BvhItem* from, BvhItem* to) const;
    void add_pair(int split, BvhItem* items, const BvhItem* moved);
    [[nodiscard]] int pieces_end(int split) const
    {
        return split + 1 < split_count_ ? splits_[split + 1].first_piece : piece_count_;
    }

    Block block_;
    Split *splits_ = nullptr, *next_ = nullptr;
    int split_count_ = 0, next_count_ = 0;
    Piece* pieces_ = nullptr;
    int piece_count_ = 0;
    BinPlace* places_ = nullptr;
    BvhPair* pairs_ = nullptr;
    Costs* costs_ = nullptr;
    std::uint32_t pair_count_ = 0;
    BvhSubtree* subtrees_ = nullptr;
    std::uint32_t subtree_count_ = 0;
};

template <class E>
std::size_t TopSplit::run(const Memory& memory, BvhItem* items, std::uint32_t count,
                          const BoxRow& centres, E& executor)
{
    // Splits of one level share no items, and each has more than a piece.
    const std::size_t most_splits = count / piece_size;
    const std::size_t most_pairs = most_splits * BvhRange::most_levels;
    BvhItem* others = nullptr;
    const std::size_t lacking = allocate_arrays(block_, memory, [&](ScratchLayout& arrays) {
        others = arrays.take<BvhItem>(most_splits > 0 ? count : 0);
        places_ = arrays.take<BinPlace>(most_splits > 0 ? count : 0);
        splits_ = arrays.take<Split>(most_splits);
        next_ = arrays.take<Split>(most_splits);
        pieces_ = arrays.take<Piece>(2 * most_splits);
        pairs_ = arrays.take<BvhPair>(most_pairs);
        costs_ = arrays.take<Costs>(most_pairs);
        subtrees_ = arrays.take<BvhSubtree>(most_pairs + 1);
    });
    if (lacking > 0) return lacking;
    BvhItem *from = items, *to = others;
    add({0, count, BvhRange::no_pair, 0, 1, centres}, items, items);
    while (next_count_ > 0) {
        std::swap(splits_, next_);
        split_count_ = std::exchange(next_count_, 0);
        cut_pieces();
        executor.for_each(piece_count_, [&](int task, int) {
            Piece& piece = pieces_[task];
            const Split& split = splits_[piece.split];
            if (!split.binned) return;
            piece.bins.clear(split.grid.bins());
            piece.bins.add(split.grid, from + piece.first, piece.size(), places_ + piece.first);
        });
        for (int i = 0; i < split_count_; ++i) choose_cut(i);
        executor.for_each(piece_count_, [&](int task, int) { part(pieces_[task], from, to); });
        for (int i = 0; i < split_count_; ++i) add_pair(i, items, to);
        std::swap(from, to);
    }
    return 0;
}

/// Files a range that lies in `from`.
inline void TopSplit::add(const BvhRange& range, BvhItem* items, const BvhItem* from)
{
    if (range.size() > piece_size) {
        next_[next_count_++] = {range, BinGrid{range.centres, range.size()}, false, {}, 0, {}};
    } else if (range.size() > TriangleBlock::lanes) {
        subtrees_[subtree_count_++] = {range, from, 0, {}};
    } else {
        if (from != items)
            std::memcpy(items + range.first, from + range.first, range.size() * sizeof(BvhItem));
        if (range.pair == BvhRange::no_pair) return;
        pairs_[range.pair].sides[range.side].link = range.first;
        costs_[range.pair].sides[range.side].area = area_of(items, range.first, range.last);
    }
}

inline void TopSplit::cut_pieces()
{
    piece_count_ = 0;
    for (int i = 0; i < split_count_; ++i) {
        Split& split = splits_[i];
        split.first_piece = piece_count_;
        split.binned = split.range.splits(split.grid);
        for (std::uint32_t at = split.range.first; at < split.range.last;) {
            Piece& piece = pieces_[piece_count_++];
            piece.split = static_cast<std::uint32_t>(i);
            piece.first = at;
            at += (std::min)(piece_size, split.range.last - at);
            piece.last = at;
        }
    }
}

/// Decides where a range is cut, and where the items of each piece go.
inline void TopSplit::choose_cut(int index)
{
    Split& split = splits_[index];
    const int end = pieces_end(index);
    if (split.binned) {
        Bins sum = pieces_[split.first_piece].bins;
        for (int i = split.first_piece + 1; i < end; ++i) sum.add(pieces_[i].bins);
        split.cut = sum.best_cut();
        if (split.cut.axis >= 0) sum.boxes(split.cut, split.boxes);
    }
    if (split.cut.axis < 0) split.cut.left = half_of(split.range.size());
    const std::uint32_t middle = split.range.first + split.cut.left;
    std::uint32_t left = split.range.first, right = middle;
    for (int i = split.first_piece; i < end; ++i) {
        Piece& piece = pieces_[i];
        piece.left = left;
        piece.right = right;
        std::uint32_t moved = 0;
        if (split.cut.axis >= 0) moved = piece.bins.left(split.cut);
        else if (piece.first < middle) moved = (std::min)(piece.last, middle) - piece.first;
        left += moved;
        right += piece.size() - moved;
    }
}

inline void TopSplit::part(Piece& piece, const BvhItem* from, BvhItem* to) const
{
    const Split& split = splits_[piece.split];
    const std::uint32_t middle = split.range.first + split.cut.left;
    SideCentres centres;
    std::uint32_t at[2] = {piece.left, piece.right};
    for (std::uint32_t i = piece.first; i < piece.last; ++i) {
        const BvhItem item = from[i];
        const std::uint32_t halved = i < middle ? 0 : 1;
        const std::uint32_t side = split.cut.axis < 0 ? halved : places_[i].side(split.cut);
        centres.include(item, side);
        to[at[side]++] = item;
    }
    piece.centres = centres;
}

inline void TopSplit::add_pair(int index, BvhItem* items, const BvhItem* moved)
{
    Split& split = splits_[index];
    const BvhRange& range = split.range;
    SideCentres centres;
    for (int i = split.first_piece; i < pieces_end(index); ++i)
        for (int side = 0; side < 2; ++side)
            centres.box[side] = smaller(centres.box[side], pieces_[i].centres.box[side]);
    if (split.cut.axis < 0) half_boxes(moved + range.first, range.size(), split.boxes);

    const std::uint32_t pair = pair_count_++;
    if (range.pair != BvhRange::no_pair) pairs_[range.pair].sides[range.side].link = pair;
    costs_[pair] = {range.pair, range.side, {}};
    const std::uint32_t bounds[3] = {range.first, range.first + split.cut.left, range.last};
    for (std::uint32_t i = 0; i < 2; ++i) {
        BvhSide& side = pairs_[pair].sides[i];
        side.set_box(split.boxes[i]);
        side.count = bounds[i + 1] - bounds[i];
        add({bounds[i], bounds[i + 1], pair, i, range.level + 1, centres.box[i]}, items, moved);
    }
}

inline void TopSplit::collapse(BvhPair* pairs, const BvhSubtree* subtrees)
{
    for (std::uint32_t i = 0; i < subtree_count_; ++i) {
        const BvhRange& range = subtrees[i].range;
        if (range.pair != BvhRange::no_pair)
            costs_[range.pair].sides[range.side] = subtrees[i].costs;
    }
    for (std::uint32_t i = pair_count_; i-- > 0;) {
        const LaneCosts costs = merge_costs(pairs[i], costs_[i].sides[0], costs_[i].sides[1]);
        const auto [parent, side, unused] = costs_[i];
        static_cast<void>(unused);
        if (parent != BvhRange::no_pair) costs_[parent].sides[side] = costs;
    }
}

}  // namespace nook::inline NOOK_TARGET::detail
