#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/work_map.hpp>

/// What every kernel asks of its arguments before it writes anything.
namespace nook::inline NOOK_TARGET::detail {

/// Finite, judged by its bits: -ffast-math lets a compiler assume the answer of std::isfinite.
[[nodiscard]] constexpr bool is_finite(double value)
{
    return (std::bit_cast<std::uint64_t>(value) >> 52 & 0x7ff) != 0x7ff;
}
[[nodiscard]] constexpr bool is_finite(float value)
{
    return (std::bit_cast<std::uint32_t>(value) >> 23 & 0xff) != 0xff;
}
/// True for a NaN, judged by its bits.
[[nodiscard]] constexpr bool is_nan(double value)
{
    return (std::bit_cast<std::uint64_t>(value) & ~(std::uint64_t{1} << 63)) > std::uint64_t{0x7ff}
                                                                                   << 52;
}

/// 2^exponent, a normal number.
[[nodiscard]] constexpr double power_of_two(int exponent)
{
    return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52);
}

/// An image that a kernel reads: data where there are pixels, no negative size.
template <class T>
[[nodiscard]] constexpr Error check_input(const ImageView<T>& image, const char* name)
{
    if (image.width < 0) return {ErrorCode::bad_size, name, double(image.width), "a width >= 0"};
    if (image.height < 0) return {ErrorCode::bad_size, name, double(image.height), "a height >= 0"};
    if (image.data == nullptr && !image.empty())
        return {ErrorCode::null_data, name, 0, "data, or a size of 0 x 0"};
    return {};
}

[[nodiscard]] constexpr std::ptrdiff_t magnitude(std::ptrdiff_t value)
{
    return value < 0 ? -value : value;
}

/// An image that a kernel writes: as an input, and no two pixels share an element.
template <class T>
[[nodiscard]] constexpr Error check_output(const ImageView<T>& image, const char* name)
{
    if (const Error error = check_input(image, name)) return error;
    if (image.empty()) return {};
    const std::ptrdiff_t pixel = magnitude(image.pixel_stride), row = magnitude(image.row_stride);
    if (image.width > 1 && pixel == 0)
        return {ErrorCode::bad_stride, name, double(image.pixel_stride),
                "a pixel stride other than 0"};
    const bool rows_apart = image.height == 1 || row > pixel * (image.width - 1);
    const bool columns_apart = image.width == 1 || pixel > row * (image.height - 1);
    if (!(rows_apart || (columns_apart && row > 0)))
        return {ErrorCode::bad_stride, name, double(image.row_stride), "rows that do not overlap"};
    return {};
}

/// `image` has the same size as the first image of the call.
template <class T, class U>
[[nodiscard]] constexpr Error check_same_size(const ImageView<T>& first, const ImageView<U>& image,
                                              const char* name)
{
    if (image.width != first.width)
        return {ErrorCode::bad_size, name, double(image.width), "the width of the input"};
    if (image.height != first.height)
        return {ErrorCode::bad_size, name, double(image.height), "the height of the input"};
    return {};
}

/// The output shares no memory with the input. Channels of one interleaved buffer do not count as
/// sharing: they have equal strides and never meet.
template <class T, class U>
[[nodiscard]] Error check_apart(const ImageView<T>& input, const ImageView<U>& output,
                                const char* name)
{
    if (input.empty() || output.empty()) return {};
    struct Extent {
        std::intptr_t first, last;
    };
    const auto extent = [](const auto& image) {
        using Element = std::remove_reference_t<decltype(*image.data)>;
        constexpr std::ptrdiff_t bytes = sizeof(Element);
        const auto base = reinterpret_cast<std::intptr_t>(image.data);
        const std::ptrdiff_t across = (image.width - 1) * image.pixel_stride * bytes;
        const std::ptrdiff_t down = (image.height - 1) * image.row_stride * bytes;
        return Extent{base + (across < 0 ? across : 0) + (down < 0 ? down : 0),
                      base + (across > 0 ? across : 0) + (down > 0 ? down : 0) + bytes};
    };
    const Extent in = extent(input), out = extent(output);
    if (in.last <= out.first || out.last <= in.first) return {};
    // Channels of one buffer: equal strides, elements side by side within a pixel, rows apart.
    constexpr std::ptrdiff_t in_bytes = sizeof(T), out_bytes = sizeof(U);
    const std::ptrdiff_t pixel = input.pixel_stride * in_bytes, row = input.row_stride * in_bytes;
    // With one row its stride means nothing.
    const bool same_rows =
        row == output.row_stride * out_bytes || (input.height == 1 && output.height == 1);
    if (pixel == output.pixel_stride * out_bytes && same_rows) {
        const std::ptrdiff_t offset = reinterpret_cast<std::intptr_t>(output.data) -
                                      reinterpret_cast<std::intptr_t>(input.data);
        const std::ptrdiff_t step = magnitude(pixel), reach = magnitude(offset);
        const std::ptrdiff_t before = offset > 0 ? in_bytes : out_bytes;
        const std::ptrdiff_t after = offset > 0 ? out_bytes : in_bytes;
        const bool beside = reach >= before && (input.width == 1 || reach + after <= step);
        const bool rows_apart =
            input.height == 1 ||
            magnitude(row) >= step * (input.width - 1) + reach + (before > after ? before : after);
        if (beside && rows_apart) return {};
    }
    return {ErrorCode::overlap, name, 0, "memory apart from every input"};
}

/// One byte for every 16 pixels of an image.
template <class T>
[[nodiscard]] Error check_groups(const ImageView<T>& groups, int width, int height,
                                 const char* name)
{
    if (groups.width != WorkMap::groups(width))
        return {ErrorCode::bad_size, name, double(groups.width),
                "a width of (width + 15) / 16 groups"};
    if (groups.height != height)
        return {ErrorCode::bad_size, name, double(groups.height), "the height of the input"};
    return {};
}

/// A work map is empty or has a group for every 16 pixels of the output, and shares nothing with it.
template <class T>
[[nodiscard]] Error check_work_map(const WorkMap& map, const ImageView<T>& output)
{
    if (const Error error = check_input(map.active, "work_map.active")) return error;
    if (map.everything()) return {};
    if (const Error error =
            check_groups(map.active, output.width, output.height, "work_map.active"))
        return error;
    return check_apart(map.active, output, "work_map.active");
}

/// What a call says that got no scratch of `size` bytes.
template <class S>
[[nodiscard]] constexpr Error check_scratch(std::size_t size)
{
    constexpr bool heap = std::is_same_v<std::remove_cvref_t<S>, HeapScratch>;
    return {heap ? ErrorCode::out_of_memory : ErrorCode::scratch_too_small, "scratch",
            static_cast<double>(size), "at least that many bytes"};
}

/// An option that must be finite and ≥ `least`.
[[nodiscard]] inline Error check_at_least(double value, double least, const char* name,
                                          const char* allowed)
{
    if (!is_finite(value) || value < least) return {ErrorCode::bad_value, name, value, allowed};
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
