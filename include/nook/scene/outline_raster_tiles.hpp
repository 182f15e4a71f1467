#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/lanes.hpp>

/// The depths of a picture by tiles, and in which of them a triangle can count.
namespace nook::inline NOOK_TARGET::detail {

/// The keys of the nearest and the farthest surface of a part of the image; without any, nearest <
/// farthest.
struct OutlineRange {
    float nearest, farthest;
};

/// The ranges of the tiles of a band: 16 columns of it, and of each strip of 8 rows.
struct OutlineTiles {
    static constexpr int size = 16, strip = 8;
    /// Room after the tiles of a strip for a whole vector from any of them on.
    static constexpr int padding = float_lanes;

    float* nearest;
    float* farthest;
    float* strip_nearest;
    float* strip_farthest;
    /// From the tiles of one strip to those of the next.
    std::ptrdiff_t stride;

    /// Takes in the keys of a tile in the rows of a strip, strips from the top on.
    void add(int tile, int index, const float* keys, std::ptrdiff_t key_stride, int rows,
             float background) const
    {
        constexpr int lanes = float_lanes;
        const auto none = broadcast<lanes>((std::numeric_limits<float>::max)());
        auto least = none, largest = broadcast<lanes>(background);
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < size; x += lanes) {
                const auto key = load<lanes>(keys + y * key_stride + x);
                least = smaller(least, key > background ? key : none);
                largest = larger(largest, key);
            }
        const auto fold_larger = [](const auto& a, const auto& b) { return larger(a, b); };
        const auto fold_smaller = [](const auto& a, const auto& b) { return smaller(a, b); };
        const OutlineRange range{fold(largest, fold_larger), fold(least, fold_smaller)};
        strip_nearest[index * stride + tile] = range.nearest;
        strip_farthest[index * stride + tile] = range.farthest;
        nearest[tile] = index == 0 ? range.nearest : larger(nearest[tile], range.nearest);
        farthest[tile] = index == 0 ? range.farthest : smaller(farthest[tile], range.farthest);
    }
    /// Of the columns [left, right] of the band.
    [[nodiscard]] OutlineRange range(int left, int right) const
    {
        int tile = left / size;
        OutlineRange result{nearest[tile], farthest[tile]};
        while (++tile <= right / size) {
            result.nearest = larger(result.nearest, nearest[tile]);
            result.farthest = smaller(result.farthest, farthest[tile]);
        }
        return result;
    }
};

/// The keys of a triangle per pixel: start + across * x + down * y, between `least` and `largest`.
struct OutlinePlane {
    double start, across, down;
    float least, largest;
};

/// Compares a plane with the tiles of strips.
template <bool in_front>
class OutlineTileTest {
public:
    /// For pixels in the columns [left, right] and `height` rows.
    NOOK_INLINE OutlineTileTest(const OutlinePlane& plane, int left, int right, int height)
    {
        const auto magnitude = [](double x) { return x < 0 ? -x : x; };
        const double spread =
            magnitude(plane.across) * (right - left + 2 * OutlineTiles::size) +
            magnitude(plane.down) * (height + OutlineTiles::strip) +
            larger(magnitude(double{plane.least}), magnitude(double{plane.largest}));
        // Others leave the range of floats.
        usable_ = spread < 0x1p120;
        if (!usable_) return;
        // More than rounding takes, here and where pixels are compared.
        const double margin = 0x1p-19 * spread;
        const double across = plane.across * (OutlineTiles::size - 1);
        const double down = plane.down * (OutlineTiles::strip - 1);
        const auto all = [](double value) { return broadcast<lanes>(static_cast<float>(value)); };
        below_ = all(smaller(across, 0.0) + smaller(down, 0.0) - margin);
        above_ = all(larger(across, 0.0) + larger(down, 0.0) + margin);
        slope_ = all(plane.across);
        least_ = broadcast<lanes>(plane.least);
        largest_ = broadcast<lanes>(plane.largest);
        float numbers[lanes];
        for (int i = 0; i < lanes; ++i)
            numbers[i] = static_cast<float>(i * OutlineTiles::size - left);
        columns_ = load<lanes>(numbers);
        start_ = plane.start + plane.across * left;
        down_ = plane.down;
    }

    /// One bit for each of at most 64 tiles from `first` on.
    struct Found {
        /// The triangle may count there; it counts wherever it covers a pixel with a surface.
        std::uint64_t some, whole;
    };
    /// `top` is the first row of the strip.
    [[nodiscard]] NOOK_INLINE Found compare(const OutlineTiles& tiles, int strip, int top,
                                            int first, int count) const
    {
        const std::uint64_t all = ~std::uint64_t{0} >> (64 - count);
        if (!usable_) return {all, 0};
        const float* const nearest = tiles.strip_nearest + strip * tiles.stride + first;
        const float* const farthest = tiles.strip_farthest + strip * tiles.stride + first;
        const auto start = static_cast<float>(start_ + down_ * top);
        std::uint64_t reaching = 0, before = 0;
        for (int i = 0; i < count; i += lanes) {
            const auto column = static_cast<float>((first + i) * OutlineTiles::size);
            const Reals key = (columns_ + column) * slope_ + start;
            const Reals low = larger(Reals{key + below_}, least_);
            const Reals high = smaller(Reals{key + above_}, largest_);
            reaching |= std::uint64_t{bits_at_most(load<lanes>(farthest + i), high)} << i;
            before |= std::uint64_t{bits_at_most(load<lanes>(nearest + i), low)} << i;
        }
        if (in_front) return {reaching & all, before & all};
        return {~before & all, ~reaching & all};
    }

private:
    static constexpr int lanes = float_lanes;
    using Reals = Lanes<float, lanes>;

    bool usable_ = false;
    /// The left sides of the tiles from column 0 on, and how far keys reach below and above those there.
    Reals columns_{}, slope_{}, below_{}, above_{}, least_{}, largest_{};
    double start_ = 0, down_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
