#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/lanes.hpp>
#include <nook/work_map.hpp>

/// The distances of an image in working memory, so that kernels may look at 16 neighbours at once,
/// anywhere.
namespace nook::inline NOOK_TARGET::detail {

/// Distances scaled by a power of two, with a margin of background beside each row and a row of
/// background above the first. The scale brings the radius of a kernel into [1, 2): nothing overflows
/// or underflows, and lengths times a power of two leave the bits of the result as they are.
template <class Real>
class DepthPlane {
public:
    static constexpr int margin = WorkMap::group;
    /// Farther surfaces hold no detail of the size of the radius: they count as background.
    static constexpr Real farthest = Real{0x1p50};

    DepthPlane(int width, int height, double radius)
        : width_{width},
          height_{height},
          // Rows of the same alignment modulo 4 KB would fall into the same sets of the cache.
          stride_{rounded_up(width) + 2 * margin + (rounded_up(width) % 1024 == 992 ? margin : 0)},
          scale_{
              std::ldexp(1.0, -std::clamp(std::ilogb(radius), -largest_exponent, largest_exponent))}
    {}

    /// How many values the memory holds.
    [[nodiscard]] std::size_t size() const
    {
        return static_cast<std::size_t>(stride_) * (static_cast<std::size_t>(height_) + 2);
    }
    /// False for images that cannot be indexed by 32 bits, margins included.
    [[nodiscard]] static constexpr bool fits(int width, int height)
    {
        const std::int64_t stride = std::int64_t{width} + 4 * margin;
        return stride * (std::int64_t{height} + 2) < 0x7fffffff;
    }
    void use(Real* memory) { data_ = memory; }

    /// Values per unit of length.
    [[nodiscard]] double scale() const { return scale_; }
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    /// Where the pixel stands in `data()`, for −margin ≤ x < width + margin and −1 ≤ y < height.
    [[nodiscard]] std::int32_t index(int x, int y) const { return (y + 1) * stride_ + margin + x; }
    /// A row for what changes along rows alone, below the last.
    [[nodiscard]] Real* columns() const { return data_ + index(0, height_); }
    /// Where 16 pixels of background stand.
    [[nodiscard]] static constexpr std::int32_t nowhere() { return margin; }
    [[nodiscard]] std::int32_t stride() const { return stride_; }
    [[nodiscard]] const Real* data() const { return data_; }

    /// The nearest and the farthest distance of a group of 16 pixels; the nearest is 0 when some pixel
    /// has no surface.
    struct Extent {
        Real nearest, farthest;
    };
    [[nodiscard]] Extent extent(int x, int y) const
    {
        const Real* const row = data_ + index(x, y);
        auto least = load<lanes>(row), largest = least;
        for (int i = lanes; i < WorkMap::group; i += lanes) {
            const auto more = load<lanes>(row + i);
            least = smaller(least, more);
            largest = larger(largest, more);
        }
        return {fold(least, [](const auto& a, const auto& b) { return smaller(a, b); }),
                fold(largest, [](const auto& a, const auto& b) { return larger(a, b); })};
    }

    /// Fills row y, −1 ≤ y < height.
    template <class Stored, class Decode>
    void fill(const DepthSource<Stored, Decode>& source, int y) const
    {
        Real* const row = data_ + index(0, y);
        if (y < 0) {
            std::fill(row - margin, row - margin + stride_, Real{0});
            return;
        }
        static_cast<void>(read_row<lanes>(source, 0, width_, y, row));
        scale(row, width_, static_cast<Real>(scale_));
        for (int x = 0; x < margin; ++x) row[x - margin] = 0;
        for (int x = width_; x < stride_ - margin; ++x) row[x] = 0;
    }
    /// Scales distances.
    static void scale(Real* row, int count, Real factor)
    {
        int x = 0;
        for (; x + lanes <= count; x += lanes) {
            const auto distance = load<lanes>(row + x) * factor;
            store(row + x, distance < farthest ? distance : Lanes<Real, lanes>{});
        }
        for (; x < count; ++x) row[x] = row[x] * factor < farthest ? row[x] * factor : Real{0};
    }

private:
    static constexpr int lanes = std::is_same_v<Real, float> ? float_lanes : native_lanes;
    /// The scale and its inverse, of double even their squares, stay within the range of Real.
    static constexpr int largest_exponent = std::is_same_v<Real, float> ? 120 : 500;

    static constexpr int rounded_up(int width)
    {
        return (width + WorkMap::group - 1) / WorkMap::group * WorkMap::group;
    }

    int width_, height_;
    std::int32_t stride_;
    double scale_;
    Real* data_ = nullptr;
};

}  // namespace nook::inline NOOK_TARGET::detail
