#pragma once

#include <nook/owned_image.hpp>

/// The depth buffers that the contenders filter; the same on every run.
namespace compare {

/// Ground that recedes, blocks on it, and relief of a few per cent everywhere, so that sums in float
/// still have a variance to speak of: what a fair comparison needs.
[[nodiscard]] nook::Image<float> finite_image(int width, int height);

/// The same below a sky with a ragged horizon.
[[nodiscard]] nook::Image<float> sky_image(int width, int height);

/// The same with holes of all sizes in every part of the image: zero, NaN and infinity.
[[nodiscard]] nook::Image<float> holed_image(int width, int height);

}  // namespace compare
