#pragma once

#include <limits>

#include <nook/depth/projection.hpp>

/// Projections as the tests of this room take them.
namespace projections {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// Off centre, with pixels that are not square.
inline nook::Projection make(nook::DepthEncoding encoding, bool orthographic, double near_plane,
                             double far_plane)
{
    return {.fx = 500,
            .fy = 400,
            .cx = 321,
            .cy = 200,
            .orthographic = orthographic,
            .encoding = encoding,
            .near_plane = near_plane,
            .far_plane = far_plane};
}

}  // namespace projections
