#pragma once

#include <cstdint>

#include <nook/image.hpp>
#include <nook/measure/error.hpp>
#include <nook/thread_executor.hpp>

#include "kernels.hpp"
#include "reference.hpp"
#include "runs.hpp"

namespace report {

/// {rmse, mae, bias, p99, max, pixels}
[[nodiscard]] Json json_of(const nook::ErrorMetrics& error);

/// The same of an image against a reference over the pixels that count, and ssim, fitted_rmse and
/// rank_correlation (Spearman's).
[[nodiscard]] Json error_of(const nook::ImageView<const float>& image,
                            const nook::ImageView<const float>& reference,
                            const nook::ImageView<const std::uint8_t>& counted,
                            nook::ThreadExecutor& threads);

/// Adds to a result: error, against the reference of its meaning; height_field_error, estimator_error
/// (the kernel's own slow form against the height field) and own_error (against its own slow form),
/// each null where it says nothing: without a height field, for kernels that see triangles,
/// where they have no slow form, or when no pixel counts. The slow form is computed in a part of the
/// rows of the height field, so that the terms are of like pixels. Throws support::Failure.
void add_errors(const View& view, const Run& run, const Traced& reference,
                const HeightField* height_field, nook::ThreadExecutor& threads, Json& result);

}  // namespace report
