#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/raster_vertex.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

/// The triangles of a picture sorted into the bins that they may show in.
namespace nook::inline NOOK_TARGET::detail {

/// Which sides of triangles are drawn, as seen in the picture.
struct RasterSides {
    bool clockwise = true, counter_clockwise = true;
    /// Back faces hide what is behind them, under no name.
    bool nameless = false;

    [[nodiscard]] bool both() const { return clockwise && counter_clockwise; }
};

/// Pixels across and down; powers of two.
struct RasterSize {
    int across, down;
};

/// Rectangles of tiles, as many tiles wide as it takes for the bins to be few.
struct RasterBins {
    static constexpr int most = 1024;

    RasterSize size;
    int across, down;

    RasterBins(int width, int height, RasterSize least) : size{least}
    {
        for (;; size = {2 * size.across, 2 * size.down}) {
            across = pieces(width, size.across);
            down = pieces(height, size.down);
            if (static_cast<std::int64_t>(across) * down <= most) return;
        }
    }
    [[nodiscard]] int count() const { return across * down; }
};

/// What a triangle touches, in pixels or in bins; empty when right < left or bottom < top.
struct RasterBox {
    int left, right, top, bottom;

    [[nodiscard]] bool empty() const { return left > right || top > bottom; }
    /// The box of three points, without its right and lower side, which the top-left rule leaves
    /// out: the samples whose centres lie in it, with 2^bits units from sample to sample.
    [[nodiscard]] static RasterBox samples(const GridPoint& a, const GridPoint& b,
                                           const GridPoint& c, int bits)
    {
        const std::int32_t half = 1 << (bits - 1);
        return {(smaller(smaller(a.x, b.x), c.x) + half - 1) >> bits,
                (larger(larger(a.x, b.x), c.x) - 1 - half) >> bits,
                (smaller(smaller(a.y, b.y), c.y) + half - 1) >> bits,
                (larger(larger(a.y, b.y), c.y) - 1 - half) >> bits};
    }
    /// As many, but of the points at multiples of 2^bits units.
    [[nodiscard]] static RasterBox multiples(const GridPoint& a, const GridPoint& b,
                                             const GridPoint& c, int bits)
    {
        return {(smaller(smaller(a.x, b.x), c.x) + (1 << bits) - 1) >> bits,
                (larger(larger(a.x, b.x), c.x) - 1) >> bits,
                (smaller(smaller(a.y, b.y), c.y) + (1 << bits) - 1) >> bits,
                (larger(larger(a.y, b.y), c.y) - 1) >> bits};
    }
    [[nodiscard]] RasterBox cut(const RasterBox& other) const
    {
        return {larger(left, other.left), smaller(right, other.right), larger(top, other.top),
                smaller(bottom, other.bottom)};
    }
    [[nodiscard]] RasterBox joined(const RasterBox& other) const
    {
        if (other.empty()) return *this;
        if (empty()) return other;
        return {smaller(left, other.left), larger(right, other.right), smaller(top, other.top),
                larger(bottom, other.bottom)};
    }
};

/// Twice the area on the grid: negative when the corners run counter-clockwise in the picture.
[[nodiscard]] constexpr std::int64_t twice_area(const GridPoint& a, const GridPoint& b,
                                                const GridPoint& c)
{
    return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
           (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
}

/// Memory of the bins. A triangle in few bins has a reference in each, in order; one in many is kept
/// once, in a list that all bins look through. "Few" is as much as there is room for.
struct RasterScratch {
    static constexpr int vertex_block = 4096;
    static constexpr std::size_t spare_references = std::size_t{1} << 15;
    static constexpr std::uint32_t none = 0xffffffff;
    /// Of the number of bins of a triangle: 1, 2, 3–4, 5–8, …
    static constexpr int classes = 12;

    /// What a block of triangles found: of each class, how many references and triangles.
    struct Found {
        std::uint32_t references[classes], triangles[classes];
    };

    int blocks;
    std::size_t block_size, capacity;
    RasterVertex* vertices;
    /// Per triangle its bins: the first one, and how many more across and down; or none.
    std::uint32_t* codes;
    std::uint32_t* references;
    /// Per block and list: first how many, then where they go. The last list is that of the triangles
    /// in many bins.
    std::uint32_t* places;
    std::uint32_t* bins;
    Found* found;

    /// With room for `references` of each triangle, and some to spare.
    RasterScratch(ScratchLayout& layout, const MeshView& mesh, std::size_t room)
    {
        const std::size_t count = mesh.triangle_count;
        block_size = larger((count + 23) / 24, std::size_t{4096});
        blocks = static_cast<int>((count + block_size - 1) / block_size);
        capacity = room * count + spare_references;
        const auto lists = static_cast<std::size_t>(RasterBins::most + 1);
        vertices = layout.take<RasterVertex>(mesh.vertex_count);
        codes = layout.take<std::uint32_t>(count);
        references = layout.take<std::uint32_t>(capacity);
        places = layout.take<std::uint32_t>(static_cast<std::size_t>(blocks) * lists);
        bins = layout.take<std::uint32_t>(lists + 1);
        found = layout.take<Found>(static_cast<std::size_t>(blocks));
    }
};

/// Sorts the triangles of a view. `finest` tells how finely they may be sampled: 2^finest to a pixel.
class RasterSorter {
public:
    RasterSorter(const RasterView& view, const RasterBins& bins, const RasterScratch& scratch,
                 RasterSides sides, int finest)
        : view_{view},
          bins_{bins},
          scratch_{scratch},
          sides_{sides},
          finer_{finest == 0 ? 0 : finest + 1},
          shift_across_{std::countr_zero(static_cast<unsigned>(bins.size.across)) + finer_},
          shift_down_{std::countr_zero(static_cast<unsigned>(bins.size.down)) + finer_}
    {}

    /// Finds the bins of the triangles of a block.
    void find(int block, std::size_t first, std::size_t last) const
    {
        RasterScratch::Found found = {};
        std::size_t t = first;
        // Two at once take longer than one after the other.
        if constexpr (lanes > 2)
            for (; t + lanes <= last; t += lanes) find_several(t, found);
        for (; t < last; ++t) find_one(t, found);
        scratch_.found[block] = found;
    }

    /// Decides which triangles are in many bins; false when those in four already are.
    [[nodiscard]] bool find_limit()
    {
        std::uint64_t references[RasterScratch::classes] = {};
        std::uint64_t needed = 0;
        for (int block = 0; block < scratch_.blocks; ++block)
            for (int kind = 0; kind < RasterScratch::classes; ++kind) {
                const std::uint32_t triangles = scratch_.found[block].triangles[kind];
                // What a class takes beyond one reference each.
                references[kind] += scratch_.found[block].references[kind] - triangles;
                needed += triangles;
            }
        int kind = 0;
        for (; kind < RasterScratch::classes; ++kind) {
            needed += references[kind];
            if (needed > scratch_.capacity) break;
        }
        most_bins_ = 1u << (kind > 0 ? kind - 1 : 0);
        return most_bins_ >= 4;
    }
    void count(int block, std::size_t first, std::size_t last) const
    {
        std::uint32_t* const places = block_places(block);
        for (int list = 0; list <= bins_.count(); ++list) places[list] = 0;
        for (std::size_t t = first; t < last; ++t)
            for_lists(scratch_.codes[t], [&](int list) { ++places[list]; });
    }
    /// Where each block puts its references to each list.
    void find_places() const
    {
        std::uint32_t place = 0;
        for (int list = 0; list <= bins_.count(); ++list) {
            scratch_.bins[list] = place;
            for (int block = 0; block < scratch_.blocks; ++block) {
                std::uint32_t& at = block_places(block)[list];
                const std::uint32_t count = at;
                at = place;
                place += count;
            }
        }
        scratch_.bins[bins_.count() + 1] = place;
    }
    void fill(int block, std::size_t first, std::size_t last) const
    {
        std::uint32_t* const places = block_places(block);
        for (std::size_t t = first; t < last; ++t)
            for_lists(scratch_.codes[t], [&](int list) {
                scratch_.references[places[list]++] = static_cast<std::uint32_t>(t);
            });
    }

private:
    static constexpr RasterBox nowhere{1, 0, 1, 0};
    /// Areas of triangles narrower than so many units are exact in double.
    static constexpr std::int32_t exact = 1 << 25;
    static constexpr int lanes = native_lanes;
    using Integers = Lanes<std::int32_t, lanes>;

    /// The code of a triangle that may show in this box.
    void put(std::size_t t, const RasterBox& box, RasterScratch::Found& found) const
    {
        const int left = box.left >> shift_across_, top = box.top >> shift_down_;
        const int more_across = (box.right >> shift_across_) - left;
        const int more_down = (box.bottom >> shift_down_) - top;
        scratch_.codes[t] = static_cast<std::uint32_t>(top * bins_.across + left) |
                            static_cast<std::uint32_t>(more_across) << 10 |
                            static_cast<std::uint32_t>(more_down) << 21;
        const auto count = static_cast<std::uint32_t>((more_across + 1) * (more_down + 1));
        const auto kind = static_cast<int>(std::bit_width(count - 1));
        found.references[kind] += count;
        ++found.triangles[kind];
    }
    void find_one(std::size_t t, RasterScratch::Found& found) const
    {
        const std::uint32_t* const index = view_.mesh().indices + 3 * t;
        const RasterVertex &a = scratch_.vertices[index[0]], &b = scratch_.vertices[index[1]],
                           &c = scratch_.vertices[index[2]];
        const RasterBox box = (a.outside | b.outside | c.outside) == 0
                                  ? samples({a.x, a.y}, {b.x, b.y}, {c.x, c.y})
                              : (a.outside & b.outside & c.outside) != 0 ? nowhere
                                                                         : clipped_samples(t);
        if (box.empty()) scratch_.codes[t] = RasterScratch::none;
        else put(t, box, found);
    }
    /// `lanes` triangles from t on. Those that are clipped or very large go by themselves.
    NOOK_INLINE void find_several(std::size_t t, RasterScratch::Found& found) const
    {
        std::int32_t x[3][lanes], y[3][lanes], outside[lanes];
        const std::uint32_t* index = view_.mesh().indices + 3 * t;
        for (int lane = 0; lane < lanes; ++lane, index += 3) {
            const auto take = [&](int i) NOOK_INLINE_LAMBDA {
                const RasterVertex& vertex = scratch_.vertices[index[i]];
                x[i][lane] = vertex.x;
                y[i][lane] = vertex.y;
                return vertex.outside;
            };
            outside[lane] = take(0) | take(1) | take(2);
        }
        const auto get = [](const std::int32_t(&values)[lanes])
                             NOOK_INLINE_LAMBDA { return load<lanes>(values); };
        const auto all = [](std::int32_t number)
                             NOOK_INLINE_LAMBDA { return broadcast<lanes>(number); };
        const Integers xs[3] = {get(x[0]), get(x[1]), get(x[2])};
        const Integers ys[3] = {get(y[0]), get(y[1]), get(y[2])};
        const auto least = [](const Integers(&v)[3]) NOOK_INLINE_LAMBDA {
            return Integers{smaller(Integers{smaller(v[0], v[1])}, v[2])};
        };
        const auto most = [](const Integers(&v)[3]) NOOK_INLINE_LAMBDA {
            return Integers{larger(Integers{larger(v[0], v[1])}, v[2])};
        };
        const Integers low_x = least(xs), high_x = most(xs), low_y = least(ys), high_y = most(ys);
        // As RasterBox::samples and RasterBox::multiples.
        const int bits = view_.grid().bits() - finer_;
        const std::int32_t half = finer_ == 0 ? 1 << (bits - 1) : 0;
        const std::int32_t up = finer_ == 0 ? half - 1 : (1 << bits) - 1;
        const Integers left = larger(Integers{(low_x + up) >> bits}, Integers{});
        const Integers top = larger(Integers{(low_y + up) >> bits}, Integers{});
        const Integers right =
            smaller(Integers{(high_x - (half + 1)) >> bits}, all((view_.width() << finer_) - 1));
        const Integers bottom =
            smaller(Integers{(high_y - (half + 1)) >> bits}, all((view_.height() << finer_) - 1));
        const auto alone =
            (load<lanes>(outside) | Integers{((high_x - low_x) | (high_y - low_y)) & -exact}) != 0;
        Integers shown = ((right - left) | (bottom - top)) >= 0 ? all(1) : Integers{};
        shown = alone ? Integers{} : shown;
        if (!sides_.both()) {
            using Reals = Lanes<double, lanes>;
            const auto real = [](const Integers& whole)
                                  NOOK_INLINE_LAMBDA { return Reals{convert<double>(whole)}; };
            const Reals area = real(xs[1] - xs[0]) * real(ys[2] - ys[0]) -
                               real(ys[1] - ys[0]) * real(xs[2] - xs[0]);
            const auto turned = convert<float>(sides_.clockwise           ? area
                                               : sides_.counter_clockwise ? Reals{-area}
                                                                          : Reals{});
            shown = turned > 0.0f ? shown : Integers{};
        }
        const Integers first_x = left >> shift_across_, first_y = top >> shift_down_;
        const Integers more =
            ((right >> shift_across_) - first_x) << 10 | ((bottom >> shift_down_) - first_y) << 21;
        const Integers code = (first_y * bins_.across + first_x) | more;
        store(scratch_.codes + t, Integers{shown != 0 ? code : all(-1)});
        // Triangles in one bin, all at once; the others one by one.
        const Integers single = more == 0 ? shown : Integers{};
        const auto count = static_cast<std::uint32_t>(
            fold(single, [](const auto& a, const auto& b) { return a + b; }));
        found.references[0] += count;
        found.triangles[0] += count;
        if (!any(Integers{(shown - single) | (alone ? all(1) : Integers{})} != 0)) return;
        std::int32_t several[lanes], apart[lanes], boxes[4][lanes];
        store(several, Integers{shown - single});
        store(apart, alone ? all(1) : Integers{});
        store(boxes[0], left);
        store(boxes[1], right);
        store(boxes[2], top);
        store(boxes[3], bottom);
        for (int lane = 0; lane < lanes; ++lane) {
            const std::size_t which = t + static_cast<std::size_t>(lane);
            if (several[lane] != 0)
                put(which, {boxes[0][lane], boxes[1][lane], boxes[2][lane], boxes[3][lane]}, found);
            if (apart[lane] != 0) find_one(which, found);
        }
    }

    [[nodiscard]] std::uint32_t* block_places(int block) const
    {
        return scratch_.places + static_cast<std::ptrdiff_t>(block) * (bins_.count() + 1);
    }
    template <class F>
    NOOK_INLINE void for_lists(std::uint32_t code, const F& f) const
    {
        if (code == RasterScratch::none) return;
        const std::uint32_t across = (code >> 10 & 0x7ff) + 1, down = (code >> 21) + 1;
        const int first = static_cast<int>(code & 0x3ff);
        if (across * down == 1) {
            f(first);
        } else if (across * down > most_bins_) {
            f(bins_.count());
        } else {
            for (int y = 0; y < static_cast<int>(down); ++y)
                for (int x = 0; x < static_cast<int>(across); ++x) f(first + y * bins_.across + x);
        }
    }
    /// The samples, or their multiples, that a triangle may cover; nowhere when it surely covers none.
    [[nodiscard]] NOOK_INLINE RasterBox samples(const GridPoint& a, const GridPoint& b,
                                                const GridPoint& c) const
    {
        const RasterBox whole{0, (view_.width() << finer_) - 1, 0, (view_.height() << finer_) - 1};
        const RasterBox box =
            (finer_ == 0 ? RasterBox::samples(a, b, c, view_.grid().bits())
                         : RasterBox::multiples(a, b, c, view_.grid().bits() - finer_))
                .cut(whole);
        if (box.empty() || sides_.both()) return box;
        const std::int64_t area = twice_area(a, b, c);
        return (area > 0 && sides_.clockwise) || (area < 0 && sides_.counter_clockwise) ? box
                                                                                        : nowhere;
    }
    [[nodiscard]] NOOK_NOINLINE RasterBox clipped_samples(std::size_t t) const
    {
        const ClippedPolygon polygon = view_.clipped(t, scratch_.vertices);
        RasterBox box = nowhere;
        for (int i = 2; i < polygon.count; ++i)
            box =
                box.joined(samples(polygon.corners[0], polygon.corners[i - 1], polygon.corners[i]));
        return box;
    }

    const RasterView& view_;
    RasterBins bins_;
    RasterScratch scratch_;
    RasterSides sides_;
    /// Samples of all levels lie at multiples of 2^-finer_ pixel; 0 when there is one level.
    int finer_, shift_across_, shift_down_;
    std::uint32_t most_bins_ = 1;
};

}  // namespace nook::inline NOOK_TARGET::detail
