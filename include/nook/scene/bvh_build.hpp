#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include <nook/scene/memory.hpp>
#include <nook/scene/ray.hpp>

/// Builds a hierarchy of four-way nodes from the top down, each split by the surface area heuristic
/// over bins (Wald 2007, "On fast construction of SAH-based bounding volume hierarchies").
namespace nook::inline NOOK_TARGET::detail {

/// Four boxes side by side, lane by lane. A lane is an inner node (count 0, `child` its index), a
/// leaf (count > 0, `child` its first triangle) or nothing (an empty box, which no ray enters).
struct BvhNode {
    static constexpr int lanes = 4;

    /// [axis][0 = low, 1 = high][lane]
    float bounds[3][2][lanes];
    std::uint32_t child[lanes];
    std::uint8_t count[lanes];
};

class BvhBuilder {
public:
    /// Splits by area down to this level, then by count: four quarters per level, so that 2³²
    /// triangles end within 16 more.
    static constexpr int area_levels = 40;
    static constexpr int most_levels = area_levels + 17;

    /// What is sorted: a box and its triangle.
    struct Item {
        Bounds bounds;
        std::uint32_t triangle;
    };

    BvhBuilder(const Memory& memory, int leaf_size, Item* items, std::uint32_t count)
        : memory_{memory},
          items_{items},
          count_{count}
    {
        leaf_size_ = static_cast<std::uint32_t>(leaf_size);
    }

    /// Sorts the items into leaf order and writes the nodes; false without memory.
    [[nodiscard]] bool build()
    {
        // Each level leaves at most three nodes waiting beside the one that is worked on.
        Pending stack[most_levels * (BvhNode::lanes - 1) + BvhNode::lanes];
        int waiting = 0;
        stack[waiting++] = {{0, count_, {}}, no_parent, 0, 1};
        while (waiting > 0) {
            const Pending next = stack[--waiting];
            if (!reserve()) return false;
            const std::uint32_t index = node_count_++;
            depth_ = (std::max)(depth_, next.level);
            if (next.parent != no_parent) nodes()[next.parent].child[next.lane] = index;

            Range children[BvhNode::lanes];
            const int made = make_children(next.range, next.level, children);
            BvhNode& node = nodes()[index];
            const Bounds nothing = Bounds::nothing();
            for (int lane = 0; lane < BvhNode::lanes; ++lane) {
                const bool used = lane < made;
                const Bounds& box = used ? children[lane].bounds : nothing;
                for (int k = 0; k < 3; ++k) {
                    node.bounds[k][0][lane] = box.low[k];
                    node.bounds[k][1][lane] = box.high[k];
                }
                const bool leaf = used && children[lane].size() <= leaf_size_;
                node.child[lane] = leaf ? children[lane].first : 0;
                node.count[lane] = leaf ? static_cast<std::uint8_t>(children[lane].size()) : 0;
                if (used && !leaf) stack[waiting++] = {children[lane], index, lane, next.level + 1};
            }
        }
        return true;
    }

    [[nodiscard]] std::uint32_t node_count() const { return node_count_; }
    [[nodiscard]] int depth() const { return depth_; }
    [[nodiscard]] BvhNode* nodes() const { return static_cast<BvhNode*>(block_.data()); }

private:
    static constexpr std::uint32_t no_parent = 0xffffffff;
    static constexpr int bins = 16;

    struct Range {
        std::uint32_t first = 0, last = 0;
        Bounds bounds = Bounds::nothing();

        [[nodiscard]] std::uint32_t size() const { return last - first; }
    };
    struct Pending {
        Range range;
        std::uint32_t parent = no_parent;
        int lane = 0;
        int level = 0;
    };
    struct Split {
        int axis = -1, bin = 0;
        float low = 0, scale = 0;
        float cost = (std::numeric_limits<float>::max)();
    };

    /// Room for one more node.
    [[nodiscard]] bool reserve()
    {
        if (node_count_ < capacity_) return true;
        const std::uint32_t larger = (std::max)(capacity_ + capacity_ / 2, count_ / 8 + 8);
        Block block{memory_, std::size_t{larger} * sizeof(BvhNode)};
        if (block.data() == nullptr) return false;
        if (node_count_ > 0)
            std::memcpy(block.data(), block_.data(), std::size_t{node_count_} * sizeof(BvhNode));
        block_ = std::move(block);
        capacity_ = larger;
        return true;
    }

    /// Splits the largest part until there are four, or all are small enough for leaves.
    int make_children(const Range& range, int level, Range (&children)[BvhNode::lanes])
    {
        const bool by_area = level <= area_levels;
        children[0] = with_bounds(range.first, range.last);
        int made = 1;
        while (made < BvhNode::lanes) {
            int widest = -1;
            float best = -1;
            for (int i = 0; i < made; ++i) {
                if (children[i].size() <= leaf_size_) continue;
                const float measure = by_area ? half_area(children[i].bounds)
                                              : static_cast<float>(children[i].size());
                if (measure > best) {
                    best = measure;
                    widest = i;
                }
            }
            if (widest < 0) break;
            const Range whole = children[widest];
            const std::uint32_t middle = by_area ? split_by_area(whole) : halve(whole);
            children[widest] = with_bounds(whole.first, middle);
            children[made++] = with_bounds(middle, whole.last);
        }
        return made;
    }

    [[nodiscard]] Range with_bounds(std::uint32_t first, std::uint32_t last) const
    {
        Range range{first, last};
        for (std::uint32_t i = first; i < last; ++i) range.bounds.include(items_[i].bounds);
        return range;
    }
    [[nodiscard]] static std::uint32_t halve(const Range& range)
    {
        return range.first + range.size() / 2;
    }
    [[nodiscard]] static float half_area(const Bounds& box)
    {
        const float x = box.high[0] - box.low[0], y = box.high[1] - box.low[1],
                    z = box.high[2] - box.low[2];
        return x < 0 ? 0 : x * y + y * z + z * x;
    }
    /// Twice the centre.
    [[nodiscard]] static float centre(const Item& item, int axis)
    {
        return item.bounds.low[axis] + item.bounds.high[axis];
    }
    [[nodiscard]] static int bin_of(const Item& item, const Split& split)
    {
        const int bin = static_cast<int>((centre(item, split.axis) - split.low) * split.scale);
        return (std::min)((std::max)(bin, 0), bins - 1);
    }

    /// Partitions the items of a range and returns where the second part starts; neither is empty.
    [[nodiscard]] std::uint32_t split_by_area(const Range& range)
    {
        Split best;
        for (int axis = 0; axis < 3; ++axis) try_axis(range, axis, best);
        // Centres that coincide cannot be told apart: halve the list, so that the tree stays shallow.
        if (best.axis < 0) return halve(range);
        Item* const first = items_ + range.first;
        Item* const middle = std::partition(first, items_ + range.last, [&](const Item& item) {
            return bin_of(item, best) <= best.bin;
        });
        const auto at = static_cast<std::uint32_t>(middle - items_);
        return at == range.first || at == range.last ? halve(range) : at;
    }

    void try_axis(const Range& range, int axis, Split& best) const
    {
        float low = (std::numeric_limits<float>::max)(), high = -low;
        for (std::uint32_t i = range.first; i < range.last; ++i) {
            low = (std::min)(low, centre(items_[i], axis));
            high = (std::max)(high, centre(items_[i], axis));
        }
        if (!(high - low > 0x1p-100f)) return;
        Split split{axis, 0, low, static_cast<float>(bins) / (high - low), best.cost};
        Bounds boxes[bins];
        std::uint32_t counts[bins] = {};
        for (Bounds& box : boxes) box = Bounds::nothing();
        for (std::uint32_t i = range.first; i < range.last; ++i) {
            const int bin = bin_of(items_[i], split);
            boxes[bin].include(items_[i].bounds);
            ++counts[bin];
        }
        // Cost of everything right of each boundary, then sweep from the left.
        float right_cost[bins] = {};
        std::uint32_t right_count[bins] = {};
        Bounds right = Bounds::nothing();
        std::uint32_t count = 0;
        for (int bin = bins - 1; bin > 0; --bin) {
            right.include(boxes[bin]);
            count += counts[bin];
            right_count[bin - 1] = count;
            right_cost[bin - 1] = half_area(right) * static_cast<float>(count);
        }
        Bounds left = Bounds::nothing();
        count = 0;
        for (int bin = 0; bin + 1 < bins; ++bin) {
            left.include(boxes[bin]);
            count += counts[bin];
            if (count == 0 || right_count[bin] == 0) continue;
            const float cost = half_area(left) * static_cast<float>(count) + right_cost[bin];
            if (cost < best.cost) {
                best = split;
                best.bin = bin;
                best.cost = cost;
            }
        }
    }

    Memory memory_;
    std::uint32_t leaf_size_ = 1;
    Item* items_;
    std::uint32_t count_;
    Block block_;
    std::uint32_t node_count_ = 0, capacity_ = 0;
    int depth_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
