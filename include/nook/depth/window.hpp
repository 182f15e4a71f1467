#pragma once

#include <cstdint>

#include <nook/outcome.hpp>
#include <nook/target.hpp>

namespace nook {

/// What a window does where the image ends.
enum class Border : std::uint8_t {
    /// Shrinks per axis so that it stays centred: rx = min(r, x, W − 1 − x). A plane that is linear
    /// on screen keeps its mean at the centre, so a tilted floor stays exactly 1 up to the frame.
    symmetric,
    /// Loses the part outside. One-sided at the frame, where tilted planes darken: those linear on
    /// screen down to 1/4 at a side and 1/7 in a corner, floors in perspective further.
    clip
};

}  // namespace nook

namespace nook::inline NOOK_TARGET::detail {

[[nodiscard]] constexpr Error check_window(int window, int largest, const char* name,
                                           const char* allowed)
{
    if (window < 1 || window > largest || window % 2 == 0)
        return {ErrorCode::bad_value, name, double(window), allowed};
    return {};
}

/// The samples [first, last] of a window of radius r around `at` on an axis of `size` samples.
struct Span {
    int first, last;
};
[[nodiscard]] constexpr Span window_span(int at, int radius, int size, Border border)
{
    const int before = at, after = size - 1 - at;
    if (border == Border::symmetric) {
        const int room = before < after ? before : after;
        const int reach = radius < room ? radius : room;
        return {at - reach, at + reach};
    }
    return {radius < before ? at - radius : 0, radius < after ? at + radius : size - 1};
}

/// How many pixels a window covers.
[[nodiscard]] constexpr std::int32_t samples_in(Span columns, Span rows)
{
    return (columns.last - columns.first + 1) * (rows.last - rows.first + 1);
}

}  // namespace nook::inline NOOK_TARGET::detail
