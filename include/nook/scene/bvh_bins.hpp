#pragma once

#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/bvh_box.hpp>

/// Where to cut a list of triangles in two (Wald 2007, "On fast construction of SAH-based bounding
/// volume hierarchies").
namespace nook::inline NOOK_TARGET::detail {

/// Which bin the centre of a box falls into, on each axis.
class BinGrid {
public:
    static constexpr int most_bins = 64;

    /// Over the centres (twice) of a range; an axis without extent has one bin.
    BinGrid(const BoxRow& centres, std::uint32_t size)
        : bins_{size < 256    ? most_bins / 4
                : size < 4096 ? most_bins / 2
                              : most_bins}
    {
        float box[8];
        centres.store(box);
        for (int k = 0; k < 3; ++k) {
            const float extent = -box[k] - box[k + 4];
            low_[k] = box[k];
            // Below `bins` for the last centre, rounded.
            scale_[k] =
                extent > 0x1p-100f ? static_cast<float>(bins_) * (1 - 0x1p-20f) / extent : 0;
        }
    }
    [[nodiscard]] int bins() const { return bins_; }
    [[nodiscard]] bool splits() const { return scale_[0] > 0 || scale_[1] > 0 || scale_[2] > 0; }

    NOOK_INLINE void bins_of(const BoxRow& box, std::int32_t (&index)[4]) const
    {
        using Index = Lanes<std::int32_t, Quad::width>;
        const Quad centre = centre_box(box).halves().low;
        for (int i = 0; i < Quad::parts; ++i) {
            const int k = i * Quad::width;
            const Quad::Part from_low =
                fenced<Quad::Part>(centre.part[i] - load<Quad::width>(low_ + k));
            const Quad::Part place = from_low * load<Quad::width>(scale_ + k);
            // A power of two less one: an index whatever the arithmetic.
            const Index bin = convert<std::int32_t>(place) & (bins_ - 1);
            store(index + k, bin);
        }
    }

private:
    float low_[4] = {}, scale_[4] = {};
    int bins_;
};

/// Where a range is cut: items of a bin up to `bin` go left.
struct BinCut {
    int axis = -1, bin = 0;
    /// Items that go left.
    std::uint32_t left = 0;
};

/// The bins that an item fell into.
struct BinPlace {
    std::uint8_t bin[4];

    /// 1 where a cut sends the item right, else 0.
    [[nodiscard]] NOOK_INLINE std::uint32_t side(const BinCut& cut) const
    {
        return bin[cut.axis] > cut.bin ? 1 : 0;
    }
};

/// Boxes and counts of the items in each bin of each axis.
class Bins {
public:
    void clear(int bins)
    {
        bins_ = bins;
        for (auto& axis : boxes_)
            for (int i = 0; i < bins; ++i) axis[i] = empty_box();
        for (int i = 0; i < bins; ++i)
            for (std::int32_t& n : counts_[i]) n = 0;
    }
    /// Notes where each item fell.
    void add(const BinGrid& grid, const BvhItem* items, std::uint32_t size, BinPlace* places)
    {
        for (std::uint32_t i = 0; i < size; ++i) {
            const BoxRow box = items[i].box();
            std::int32_t index[4];
            grid.bins_of(box, index);
            places[i] = {static_cast<std::uint8_t>(index[0]), static_cast<std::uint8_t>(index[1]),
                         static_cast<std::uint8_t>(index[2]), 0};
            include(0, index[0], box);
            include(1, index[1], box);
            include(2, index[2], box);
        }
    }
    void add(const Bins& other)
    {
        for (int axis = 0; axis < 3; ++axis)
            for (int i = 0; i < bins_; ++i)
                boxes_[axis][i] = smaller(boxes_[axis][i], other.boxes_[axis][i]);
        for (int i = 0; i < bins_; ++i)
            for (int axis = 0; axis < 3; ++axis) counts_[i][axis] += other.counts_[i][axis];
    }
    /// Items that a cut sends left.
    [[nodiscard]] std::uint32_t left(const BinCut& cut) const
    {
        std::uint32_t sum = 0;
        for (int i = 0; i <= cut.bin; ++i) sum += static_cast<std::uint32_t>(counts_[i][cut.axis]);
        return sum;
    }
    /// The boxes of both sides.
    void boxes(const BinCut& cut, BoxRow (&sides)[2]) const
    {
        for (BoxRow& side : sides) side = empty_box();
        for (int i = 0; i < bins_; ++i) {
            BoxRow& side = sides[i > cut.bin];
            side = smaller(side, boxes_[cut.axis][i]);
        }
    }

    /// The cut of the least cost, the sum over both sides of surface times triangles; half of them
    /// are counted in whole blocks, which fills the blocks. Axis −1 where all items share a bin.
    [[nodiscard]] BinCut best_cut() const
    {
        using Counts = Lanes<std::int32_t, Quad::width>;
        Quad right_costs[most];
        Counts right_counts[most][Quad::parts];
        BoxRow boxes[3];
        Counts counts[Quad::parts]{};
        const auto start = [&]() NOOK_INLINE_LAMBDA {
            for (BoxRow& box : boxes) box = empty_box();
            for (Counts& n : counts) n = Counts{};
        };
        const auto include = [&](int bin) NOOK_INLINE_LAMBDA {
            for (int axis = 0; axis < 3; ++axis)
                boxes[axis] = smaller(boxes[axis], boxes_[axis][bin]);
            for (int i = 0; i < Quad::parts; ++i)
                counts[i] += detail::load<Quad::width>(counts_[bin] + i * Quad::width);
        };
        const auto cost = [&]() NOOK_INLINE_LAMBDA {
            Quad edges[4] = {negative_edges(boxes[0]), negative_edges(boxes[1]),
                             negative_edges(boxes[2]), Quad::of(0)};
            Quad triangles;
            for (int i = 0; i < Quad::parts; ++i)
                triangles.part[i] =
                    convert<float>(static_cast<Counts>(counts[i] + ((counts[i] + 7) & -8)));
            return half_areas(edges) * triangles;
        };
        start();
        for (int bin = bins_ - 1; bin > 0; --bin) {
            include(bin);
            right_costs[bin - 1] = cost();
            for (int i = 0; i < Quad::parts; ++i) right_counts[bin - 1][i] = counts[i];
        }
        start();
        constexpr float impossible = 0x1p100f;
        float totals[most - 1][4];
        for (int bin = 0; bin + 1 < bins_; ++bin) {
            include(bin);
            Quad total = cost() + right_costs[bin];
            for (int i = 0; i < Quad::parts; ++i) {
                // Neither side may be empty.
                const Counts fewer =
                    counts[i] < right_counts[bin][i] ? counts[i] : right_counts[bin][i];
                total.part[i] =
                    fewer > Counts{} ? total.part[i] : broadcast<Quad::width>(impossible);
            }
            total.store(totals[bin]);
        }
        BinCut cut;
        float lowest = impossible;
        for (int axis = 0; axis < 3; ++axis)
            for (int bin = 0; bin + 1 < bins_; ++bin)
                if (totals[bin][axis] < lowest) {
                    lowest = totals[bin][axis];
                    cut.axis = axis;
                    cut.bin = bin;
                }
        if (cut.axis >= 0) cut.left = left(cut);
        return cut;
    }

private:
    NOOK_INLINE void include(int axis, int index, const BoxRow& box)
    {
        BoxRow& bin = boxes_[axis][index];
        bin = smaller(bin, box);
        ++counts_[index][axis];
    }

    static constexpr int most = BinGrid::most_bins;
    BoxRow boxes_[3][most];
    std::int32_t counts_[most][4];
    int bins_;
};

/// The centres (twice) of what goes left and right.
struct SideCentres {
    BoxRow box[2] = {empty_box(), empty_box()};

    NOOK_INLINE void include(const BvhItem& item, std::uint32_t side)
    {
        // What is moved beyond the scene lowers no minimum.
        constexpr float moves[3] = {0, 4 * beyond_scene, 0};
        const BoxRow point = centre_box(item.box());
        box[0] = smaller(box[0], point + BoxRow::of(moves[side]));
        box[1] = smaller(box[1], point + BoxRow::of(moves[side + 1]));
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
