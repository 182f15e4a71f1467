#pragma once

#include <cstddef>
#include <cstdint>

#include <nook/depth/chebyshev_ao.hpp>

#include "compare/targets.hpp"
#include "compare/threads.hpp"

namespace compare {

using Depth = nook::ImageView<const float>;
using Visibility = nook::ImageView<float>;

/// Summed area tables of a (tight) image: (width + 1) × (height + 1) entries each, the first row and
/// column 0.
struct SumTables {
    double* sum = nullptr;
    double* squares = nullptr;
    /// Surface samples; null: every pixel is one.
    std::int32_t* count = nullptr;
};

/// What is compiled once per instruction set: nook, and the baselines in plain loops, so that all
/// contenders are built with the same flags. All baselines take finite images unless noted, have
/// symmetric windows, and add the automatic bias of float distances.
struct Kernels {
    const char* name;

    nook::Outcome (*chebyshev_ao)(const Depth& depth, const Visibility& visibility,
                                  const nook::ChebyshevOptions& options,
                                  const nook::Projection& projection, nook::Scratch scratch,
                                  const Threads& threads);
    std::size_t (*chebyshev_ao_scratch_size)(const Depth& depth,
                                             const nook::ChebyshevOptions& options,
                                             const nook::Projection& projection, int workers);

    /// Cantelli's bound of `count` pixels, from images of their first two moments.
    void (*shade_moments)(const float* depth, const float* mean, const float* mean_square,
                          float* visibility, std::size_t count);
    /// Fills the tables. Without a count table the image must be finite.
    void (*fill_tables)(const Depth& depth, const SumTables& tables);
    /// Cantelli's bound from sum and squares, one window for all.
    void (*shade_tables)(const Depth& depth, const SumTables& tables, int window,
                         const Visibility& visibility);
    /// The same with windows of `radius` world units, at most `max_window` pixels; background is
    /// the open share of its window if there is a count table.
    void (*shade_tables_radius)(const Depth& depth, const SumTables& tables, double radius,
                                int max_window, const nook::Projection& projection,
                                const Visibility& visibility);
    /// Running sums down the columns and along the rows; `work`: 5 × width elements.
    void (*running_sums)(const Depth& depth, int window, double* work,
                         const Visibility& visibility);
};

using Targets = TargetsOf<Kernels>;
[[nodiscard]] Targets targets();

}  // namespace compare
