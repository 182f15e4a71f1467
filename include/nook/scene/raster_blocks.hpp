#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/raster_bins.hpp>

/// What is hidden, told block by block.
namespace nook::inline NOOK_TARGET::detail {

/// The farthest distance in each block of a tile, as far as is known. Distances only ever come nearer,
/// so one that is out of date is still a bound; it is brought up to date when as many samples have been
/// asked for as a block has.
template <int lanes>
class RasterBlocks {
public:
    /// Samples across and down.
    static constexpr int size = 8;
    /// Of a tile of 128 × 128 samples.
    static constexpr int most = 256;

    /// A tile of width × height samples at `distances`, rows `stride` apart, all of them `nothing`.
    RasterBlocks(const std::int32_t* distances, std::ptrdiff_t stride, int width, int height,
                 std::int32_t nothing)
        : distances_{distances},
          stride_{stride},
          height_{height},
          across_{(width + size - 1) / size}
    {
        const int count = across_ * ((height + size - 1) / size);
        for (int i = 0; i < count; ++i) {
            farthest_[i] = nothing;
            asked_[i] = 0;
        }
    }
    /// True when no sample of a box, counted from those of the tile, is farther than `nearest`: what
    /// comes later and is not nearer is hidden.
    [[nodiscard]] NOOK_INLINE bool hidden(const RasterBox& box, std::int32_t nearest)
    {
        const int samples = (box.right - box.left + 1) * (box.bottom - box.top + 1);
        for (int y = box.top / size; y <= box.bottom / size; ++y)
            for (int x = box.left / size; x <= box.right / size; ++x) {
                const int block = y * across_ + x;
                if (nearest >= farthest_[block]) continue;
                asked_[block] += samples;
                if (asked_[block] < size * size) return false;
                asked_[block] = 0;
                farthest_[block] = find_farthest(x * size, y * size);
                if (nearest < farthest_[block]) return false;
            }
        return true;
    }

private:
    [[nodiscard]] std::int32_t find_farthest(int left, int top) const
    {
        using Integers = Lanes<std::int32_t, lanes>;
        static_assert(size % lanes == 0);
        const int bottom = smaller(top + size, height_);
        Integers farthest{};
        for (int y = top; y < bottom; ++y)
            for (int x = left; x < left + size; x += lanes)
                farthest = larger(farthest, Integers{load<lanes>(distances_ + y * stride_ + x)});
        return fold(farthest, [](const auto& a, const auto& b) { return larger(a, b); });
    }

    const std::int32_t* distances_;
    std::ptrdiff_t stride_;
    int height_, across_;
    std::int32_t farthest_[most], asked_[most];
};

}  // namespace nook::inline NOOK_TARGET::detail
