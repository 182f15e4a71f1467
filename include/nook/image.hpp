#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <nook/target.hpp>

namespace nook {

/// A view of somebody else's image: it owns nothing and copies nothing.
///
/// Row 0 is the top of the picture. Strides count elements of T and may be negative: a bottom-up
/// read-back is `{data + (height - 1) * width, width, height, -width}`. Unaligned data is fine.
/// Nothing outside the width × height elements is ever touched.
template <class T>
struct ImageView {
    /// The element of the top left pixel; may be null only when the view is empty.
    T* data = nullptr;
    /// Pixels per row, ≥ 0.
    int width = 0;
    /// Rows, ≥ 0.
    int height = 0;
    /// Elements from one row to the next.
    std::ptrdiff_t row_stride = width;
    /// Elements from one pixel to the next: 1 for a plane, 4 for one channel of RGBA.
    std::ptrdiff_t pixel_stride = 1;

    [[nodiscard]] NOOK_INLINE constexpr T& operator()(int x, int y) const
    {
        return data[y * row_stride + x * pixel_stride];
    }
    [[nodiscard]] NOOK_INLINE constexpr bool empty() const { return width == 0 || height == 0; }

    NOOK_INLINE constexpr operator ImageView<const T>() const requires(!std::is_const_v<T>)
    {
        return {data, width, height, row_stride, pixel_stride};
    }
};

/// Three channels of one size, interleaved or planar: normals, colours, positions.
template <class T>
struct ImageView3 {
    ImageView<T> x{};
    ImageView<T> y{};
    ImageView<T> z{};

    /// Views of x, y, z stored side by side; `pixel_stride` is 3 for tight, 4 for padded vectors.
    [[nodiscard]] NOOK_INLINE static constexpr ImageView3 interleaved(
        T* data, int width, int height, std::ptrdiff_t row_stride, std::ptrdiff_t pixel_stride = 3)
    {
        // The three views overlap in range but share no element. Null stays null.
        const std::ptrdiff_t next = data != nullptr ? 1 : 0;
        return {{data, width, height, row_stride, pixel_stride},
                {data + next, width, height, row_stride, pixel_stride},
                {data + 2 * next, width, height, row_stride, pixel_stride}};
    }
    [[nodiscard]] NOOK_INLINE constexpr bool empty() const { return x.empty(); }

    NOOK_INLINE constexpr operator ImageView3<const T>() const requires(!std::is_const_v<T>)
    {
        return {x, y, z};
    }
};

}  // namespace nook
