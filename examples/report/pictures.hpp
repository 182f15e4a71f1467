#pragma once

#include <filesystem>
#include <vector>

#include <nook/image.hpp>

#include "../support/picture.hpp"
#include "kernels.hpp"
#include "plans.hpp"
#include "reference.hpp"
#include "runs.hpp"
#include "view.hpp"

namespace report {

/// Visibility as grey, stored value = visibility: black is closed, white is open.
[[nodiscard]] support::Picture grey(const nook::ImageView<const float>& visibility);

/// Colour × visibility, then diffuse light from above and a share from everywhere. Without a
/// visibility everything is open. Background is white.
[[nodiscard]] support::Picture shaded(const scenes::Scene& scene, const View& view,
                                      const nook::ImageView<const float>& visibility = {});

/// What a cell leaves in its folder. For the page, small: shaded.jpg, height-field.jpg,
/// reference-MEANING.jpg, and ID.jpg of each run. With `all`, as large as they were computed:
/// shaded.png, depth.png, depth.pfm, normals.png, reference-MEANING.png and .pfm, height-field.png and
/// height-field-error.png; of each run ID.png, ID-error.png and, of the library's defaults,
/// ID-composed.png. Rows that a kernel left out repeat the nearest one. What an exact plan leaves out
/// shows in no picture: of those there is ID.jpg alone.
void write_pictures(const std::filesystem::path& folder, const scenes::Scene& scene,
                    const View& view, const std::vector<Traced>& references,
                    const HeightField* height_field, const std::vector<Run>& runs, bool all);

/// Plans in false colour over the scene in dimmed grey: where work is left out the scene alone, where
/// there is no surface either nearly black, else yellow.
[[nodiscard]] support::Picture plan_picture(const scenes::Scene& scene, const View& view,
                                            const nook::WorkMap& map);

/// NAME.jpg of each; with `all` NAME.png too.
void write_plans(const std::filesystem::path& folder, const scenes::Scene& scene, const View& view,
                 const std::vector<PlanPicture>& plans, bool all);

/// The strips of Chan & Im 2021: figure-2.png, the plain bound, with a bias and with the clamp, and
/// figure-4.png, a sweep of the range check.
void write_figures(const std::filesystem::path& folder, const View& view, double radius,
                   nook::ThreadExecutor& threads);

}  // namespace report
