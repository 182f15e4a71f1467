#pragma once

#include <filesystem>

#include <nook/image.hpp>

#include "../scenes/scene.hpp"
#include "../support/picture.hpp"
#include "kernels.hpp"
#include "reference.hpp"
#include "view.hpp"

namespace report {

/// Visibility as grey, stored value = visibility: black is closed, white is open.
[[nodiscard]] support::Picture grey(const nook::ImageView<const float>& visibility);

/// Colour × visibility, then diffuse light from above and a share from everywhere. Without a
/// visibility everything is open. Background is white.
[[nodiscard]] support::Picture shaded(const scenes::Scene& scene, const View& view,
                                      const nook::ImageView<const float>& visibility = {});

/// Writes into the folder: shaded.png, depth.png, depth.pfm, normals.png, reference.png,
/// reference.pfm, reference-composed.png, height-field.png, height-field-error.png, and for each kernel NAME.png (visibility),
/// NAME-composed.png and NAME-error.png. Rows that a kernel left out repeat the nearest one.
void write_pictures(const std::filesystem::path& folder, const scenes::Scene& scene,
                    const View& view, const Reference& reference,
                    const std::vector<Result>& results);

/// The strips of Chan & Im 2021: figure-2.png, the plain bound, with a bias and with the clamp, and
/// figure-4.png, a sweep of the range check.
void write_figures(const std::filesystem::path& folder, const View& view, double radius,
                   nook::ThreadExecutor& threads);

}  // namespace report
