#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/viewpoint_channel_pages.hpp>
#include <nook/scene/viewpoint_channel_rows.hpp>
#include <nook/scratch.hpp>

/// The rows of a viewpoint channel from areas of the caller.
namespace nook::inline NOOK_TARGET::detail {

/// Rows from areas[v * polygon_count + o]. `rows` comes with its counts of views and polygons.
[[nodiscard]] inline Error fill_rows(const double* areas, ChannelRows& rows, ChannelMemory& kept,
                                     const Memory& memory)
{
    double largest = 0;
    for (std::size_t i = 0; i < rows.view_count * rows.polygon_count; ++i) {
        if (!is_finite(areas[i]) || areas[i] < 0)
            return {ErrorCode::bad_value, "areas", areas[i], "finite areas >= 0"};
        largest = larger(largest, areas[i]);
    }
    const int exponent = channel_exponent(largest);
    rows.unit = power_of_two(exponent);
    const double scale = power_of_two(-exponent),
                 least = rounded(largest * scale) * least_channel_share;
    const auto amount = [&](std::size_t v, std::size_t o) {
        const double a = areas[v * rows.polygon_count + o] * scale;
        return a < least ? 0 : a;
    };
    if (const std::size_t lacking = allocate_arrays(
            kept.arrays, memory, [&](ScratchLayout& arrays) { rows.take_arrays(arrays, false); }))
        return channel_out_of_memory(lacking);
    std::fill(rows.first, rows.first + rows.polygon_count + 1, std::uint64_t{0});
    for (std::size_t v = 0; v < rows.view_count; ++v) {
        LongSum sum;
        for (std::size_t o = 0; o < rows.polygon_count; ++o) {
            const double a = amount(v, o);
            sum.add(a);
            rows.first[o + 1] += a > 0 ? 1 : 0;
        }
        rows.view_area[v] = sum.total();
    }
    for (std::size_t o = 0; o < rows.polygon_count; ++o) rows.first[o + 1] += rows.first[o];
    rows.entry_count = rows.first[rows.polygon_count];
    if (const std::size_t lacking =
            allocate_arrays(kept.entries, memory, [&](ScratchLayout& arrays) {
                rows.areas = arrays.take<double>(rows.entry_count);
                rows.views = arrays.take<std::uint16_t>(rows.entry_count);
            }))
        return channel_out_of_memory(lacking);
    for (std::size_t o = 0; o < rows.polygon_count; ++o) {
        std::uint64_t at = rows.first[o];
        for (std::size_t v = 0; v < rows.view_count; ++v) {
            const double a = amount(v, o);
            if (!(a > 0)) continue;
            rows.areas[at] = a;
            rows.views[at++] = static_cast<std::uint16_t>(v);
        }
    }
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
