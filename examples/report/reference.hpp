#pragma once

#include <cstdint>
#include <vector>

#include <nook/measure/error.hpp>
#include <nook/outcome.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/thread_executor.hpp>

#include "../support/progress.hpp"
#include "counted_scratch.hpp"
#include "kernels.hpp"

namespace report {

/// Distances of five orders of magnitude. What is near is then small beside the rounding of the
/// hierarchy's boxes, and rays take 30 times as long.
[[nodiscard]] bool is_vast(const View& view);

/// What is traced in a cell. Visibility always; the other meanings at the scene's usual radius, but not
/// in vast scenes, and in a quick run only in those with hanging curtains, which secondary rays are for.
[[nodiscard]] std::vector<Meaning> meanings_of(const Setup& setup);

/// σ of obscurance, 1 / world units: 2 / radius, so that a hit at the radius lets 1 − e⁻² through, 86 %.
/// Fridvalszky & Tóth 2022 leave it open; nook-obscurance takes the same.
[[nodiscard]] double sigma_of(double radius);

/// One set of rays over the picture, where the map has work; the references have the seeds 1 and 2.
/// Background is 1.
[[nodiscard]] nook::Outcome trace_once(const nook::Bvh& hierarchy, const View& view, double radius,
                                       Meaning meaning, int directions, std::uint32_t seed,
                                       const nook::ImageView<float>& visibility,
                                       const nook::WorkMap& map, CountedScratch& scratch,
                                       nook::ThreadExecutor& threads);

/// Plans what `trace_once` may leave out.
[[nodiscard]] nook::Outcome plan_rays(const nook::Bvh& hierarchy, const View& view, double radius,
                                      Meaning meaning, int directions,
                                      const nook::ImageView<std::uint8_t>& groups,
                                      nook::ThreadExecutor& threads);

/// Reference (a): the scene itself, ray traced; the mean of two halves with directions of their own.
struct Traced {
    Meaning meaning = Meaning::visibility;
    nook::Image<float> visibility;
    int directions = 0;  ///< per pixel, both halves together
    double seconds = 0;  ///< with all threads
    /// Of `visibility`: RMS(half − other half) / 2 over the surface pixels. The formula for independent
    /// samples would be wrong for directions that are spread evenly.
    double standard_error = 0;
    std::uint64_t rays = 0, skipped_rays = 0;  ///< of both halves
};
/// `directions` is even.
[[nodiscard]] Traced trace(const Setup& setup, Meaning meaning, int directions,
                           support::Progress& progress);

/// Reference (b): the depth buffer as the only geometry. So (b) − (a) is what the depth buffer does not
/// know.
struct HeightField {
    /// Rows that are computed: one in `row_step`; the others repeat the nearest one.
    nook::Image<float> visibility;
    int row_step = 1;
    int slices = 0;
    double seconds = 0;  ///< with all threads; both forms
    /// RMS difference to the form with half the slices, over the rows computed: an upper bound, in
    /// practice, as the error falls with the slices.
    double standard_error = 0;
    nook::ErrorMetrics unknown;  ///< against (a), over the rows computed

    [[nodiscard]] bool computes(int y) const { return y % row_step == row_step / 2; }
};
/// For a limited radius. `visibility` is (a) of that meaning.
[[nodiscard]] HeightField height_field(const Setup& setup, const Traced& visibility,
                                       support::Progress& progress);

}  // namespace report
