#pragma once

#include <cstdint>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/depth/projection.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>

namespace nook::inline NOOK_TARGET {

/// Distances, as `rasterise` writes them, in the encoding of the projection: what a hardware depth
/// buffer would hold. The inverse of `hardware_depth`, within a depth step. Storage follows from the
/// element as it does there: `encode_depths(depth, encoded, projection)` for float and uint16,
/// `encode_depths<nook::HalfStorage>(…)` for others. Background becomes the far end of the encoding.
template <class Storage = void, class T>
Outcome encode_depths(const ImageView<const float>& depth, const ImageView<T>& encoded,
                      const Projection& projection)
{
    using Actual = typename std::conditional_t<std::is_void_v<Storage>, detail::DefaultStorage<T>,
                                               std::type_identity<Storage>>::type;
    if (const Error error = detail::check_input(depth, "depth")) return {error};
    if (const Error error = detail::check_output(encoded, "encoded")) return {error};
    if (const Error error = detail::check_same_size(depth, encoded, "encoded")) return {error};
    if (const Error error = detail::check_apart(depth, encoded, "encoded")) return {error};
    if (const Error error = check_projection(projection, true)) return {error};
    if (Actual::fixed_point && !detail::is_finite(projection.far_plane) &&
        projection.encoding == DepthEncoding::linear)
        return {{ErrorCode::bad_value, "projection.far_plane", projection.far_plane,
                 "a finite distance for linear fixed point"}};
    Outcome outcome{};
    for (int y = 0; y < depth.height; ++y) {
        for (int x = 0; x < depth.width; ++x) {
            encoded(x, y) = encode_depth<Actual>(double{depth(x, y)}, projection);
            ++outcome.work.pixels;
            if (!is_surface(double{depth(x, y)}, projection.far_plane)) ++outcome.work.background;
        }
    }
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
