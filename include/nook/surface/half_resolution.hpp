#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/work_map.hpp>

/// Every second pixel of every second row, by strides alone: any kernel runs at a quarter of the pixels
/// without a copy of its inputs, and `upsample` brings its result back to full size. The depths are
/// those of real pixels, never means of two surfaces, so silhouettes stay sharp and planes stay planes:
/// pixel (x, y) of the half size is pixel (2 x, 2 y) of the full one.
///
///     nook::chebyshev_ao(nook::half_source(depth), half, {.window = 15});
///     nook::alchemy_ao(nook::half_source(depth), nook::half_source(normals), half, options,
///                      nook::half_projection(projection));
///
/// A window in pixels covers twice as much; a radius in world units stays what it is.
namespace nook {

/// (width + 1) / 2 × (height + 1) / 2 pixels.
template <class T>
[[nodiscard]] NOOK_INLINE constexpr ImageView<T> half_view(const ImageView<T>& image)
{
    return {image.data, image.width / 2 + image.width % 2, image.height / 2 + image.height % 2,
            2 * image.row_stride, 2 * image.pixel_stride};
}
template <class T>
[[nodiscard]] NOOK_INLINE constexpr ImageView3<T> half_view(const ImageView3<T>& image)
{
    return {half_view(image.x), half_view(image.y), half_view(image.z)};
}

/// Depths of half size, decoded as before; a view of distances becomes one of half size.
template <class Stored, class Decode>
[[nodiscard]] NOOK_INLINE constexpr DepthSource<Stored, Decode> half_source(
    const DepthSource<Stored, Decode>& source)
{
    return {half_view(source.image), source.decode, source.step, source.far_limit};
}
template <class T>
requires std::is_floating_point_v<T>
[[nodiscard]] NOOK_INLINE constexpr auto half_source(const ImageView<T>& view)
{
    return half_source(depth_source(view));
}
/// Normals of half size, in the same axes.
[[nodiscard]] NOOK_INLINE constexpr NormalSource half_source(const NormalSource& normals)
{
    NormalSource half = normals;
    half.image = half_view(normals.image);
    return half;
}

/// The projection of the half size: the middle of pixel (x, y) belongs to the ray of (2 x, 2 y).
[[nodiscard]] NOOK_INLINE constexpr Projection half_projection(const Projection& projection)
{
    Projection half = projection;
    half.fx = projection.fx / 2;
    half.fy = projection.fy / 2;
    half.cx = projection.cx / 2 + 0.25;
    half.cy = projection.cy / 2 + 0.25;
    return half;
}

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes which groups of the half size are worth work, given those of the full size: every group that
/// holds a pixel which `upsample` takes for an active one, so that under the two maps it gives the bits
/// of the call without maps. A pixel of odd x or y also takes the half pixel after it, so one group more
/// may become active on the right and below.
///
/// `active` has (groups + 1) / 2 × (rows + 1) / 2 bytes, and shares no memory with `full`, which must
/// not be empty. The map is then {active, full.exact}.
inline Outcome half_work_map(const WorkMap& full, const ImageView<std::uint8_t>& active)
{
    const ImageView<const std::uint8_t>& groups = full.active;
    if (const Error error = detail::check_input(groups, "full.active")) return {error};
    if (const Error error = detail::check_output(active, "active")) return {error};
    const auto half = half_view(groups);
    if (active.width != half.width)
        return {{ErrorCode::bad_size, "active", double(active.width),
                 "half the groups of the full map, rounded up"}};
    if (active.height != half.height)
        return {{ErrorCode::bad_size, "active", double(active.height),
                 "half the rows of the full map, rounded up"}};
    if (const Error error = detail::check_apart(groups, active, "active")) return {error};
    for (int y = 0; y < active.height; ++y)
        for (int x = 0; x < active.width; ++x) {
            bool any = false;
            for (int row = 2 * y - 1; row <= 2 * y + 1; ++row)
                for (int column = 2 * x - 1; column <= 2 * x + 1; ++column)
                    if (row >= 0 && row < groups.height && column >= 0 && column < groups.width)
                        any = any || groups(column, row) != 0;
            active(x, y) = any ? 1 : 0;
        }
    Outcome outcome{};
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
