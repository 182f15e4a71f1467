#pragma once

#include <nook/target.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// What the pixels of some columns, in the rows of some blocks, are to a consumer that may leave them
/// out.
enum class LeftOut : unsigned char {
    wanted,
    spared,  ///< nobody asked for them
    empty,   ///< background, all of them
    open     ///< surfaces, none of them behind the mean of its window
};

/// Consumers that need not be given every pixel have
///     mark_wanted(y, end_y, x, end_x, marks)
/// which marks the groups of a work map that columns x … end_x touch and that are active in any of rows
/// y … end_y, one byte each, or returns false when there is no map;
///     open_in_front()
/// whether pixels that do not lie behind their mean are open (those of a constant window are);
///     leave_out<lanes>(work, source, y, x, width, cell)
/// which takes pixels without results.
template <class Consume>
inline constexpr bool can_leave_out = requires(const Consume& consume)
{
    consume.open_in_front();
};

}  // namespace nook::inline NOOK_TARGET::detail
