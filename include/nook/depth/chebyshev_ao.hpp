#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/cantelli.hpp>
#include <nook/depth/left_out.hpp>
#include <nook/depth/moments_block.hpp>
#include <nook/depth/moments_direct.hpp>
#include <nook/depth/moments_variable.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/depth/window.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/work_map.hpp>

/// Chebyshev ambient occlusion from depth alone: H. Chan & S. Im, "Chebyshev Ambient Occlusion",
/// 2021. A pixel is shaded by the Cantelli bound on the share of its window that lies at or behind it
/// (cantelli.hpp). It is a bound on how much of the window does not hide the pixel, not the
/// cosine-weighted visibility of ray tracing.
///
/// Background lies behind everything: its share of a window is open as it stands, and only the rest
/// is shaded by its moments, which no background enters. Where it takes one side of a window, the
/// moments are one-sided, so a surface that slopes towards an open edge darkens there: a plane that is
/// linear on screen down to 5/8 in its last row, a floor that runs to the horizon down to 1/2.
/// `ExactRefinements::paired` in the reference form removes that.
namespace nook {

struct ChebyshevOptions {
    /// Pixels across the window: odd, 1 … 32767; 1 leaves everything open. Used when `radius` is 0.
    int window = 31;
    /// World length from a pixel to the edge of its window, facing the viewer; ≥ 0. Above 0 each
    /// pixel gets 2 ⌊radius · f / distance⌋ + 1 pixels along each axis (f = fx, fy of the projection,
    /// which must be given; under orthography all windows are alike).
    double radius = 0;
    /// Largest window that `radius` leads to: odd, 1 … 4095. Bounds the cost near the viewer, and the
    /// scratch, which grows with its square.
    int max_window = 127;
    /// ε of equation 2: a variance in depth², 0 … 1e300, which brightens relief below its root. Unset:
    /// 100 steps² of the depth buffer at the pixel's distance, so that quantised flat ground stays
    /// above 0.99. 0: the plain formula; steps of the buffer then shade like canyons.
    std::optional<double> bias{};
    /// Range check: how far the mean of a window may lie in front of its pixel, a distance > 0 at
    /// which half the shade is left (`range_checked`); it dims the halo around near objects. 1 to 2
    /// times the radius of the reference gave the least error against ray tracing. Unset: none.
    std::optional<double> range{};
    /// One-sided clamp of equation 3. Without it (equation 2) pixels in front of their window darken
    /// like those behind it.
    bool clamp = true;
    /// What windows do at the border of the image.
    Border border = Border::symmetric;
};

/// What only the k² form can do, because it looks at single samples.
struct ExactRefinements {
    /// Applies `range` to each sample: those farther than `range` from the pixel's distance, in
    /// front or behind, leave the window. Needs `range`.
    bool sample_range = false;
    /// A sample counts only when its mirror image through the pixel counts too (is a surface, and in
    /// range with `sample_range`), so that planes stay 1 beside background and beside steps.
    bool paired = false;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the visibility of every pixel, in [0, 1]; background gets 1.
///
/// Constant time per pixel for a fixed window; for a radius constant except where the outcome counts
/// `samples`. Never allocates if given a `Scratch` of `chebyshev_ao_scratch_size` bytes; the default
/// HeapScratch does, once per call. The same bits for any number of threads. Different instruction
/// sets agree to 2⁻²³, but for a pixel whose radius rounds to another window. Errors: see the options;
/// sizes that differ, an output that overlaps the depth, a radius without projection.
template <DepthInput Depth, class Value, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome chebyshev_ao(const Depth& depth, const ImageView<Value>& visibility,
                     const ChebyshevOptions& options = {}, const Projection& projection = {},
                     const WorkMap& work_map = {}, S&& scratch = S{}, E&& executor = E{});

/// The same from all samples of each window, k² per pixel: the oracle, and the refinements that
/// need it. Needs no scratch.
template <DepthInput Depth, class Value, Executor E = Serial>
Outcome chebyshev_ao_reference(const Depth& depth, const ImageView<Value>& visibility,
                               const ChebyshevOptions& options = {},
                               const ExactRefinements& refinements = {},
                               const Projection& projection = {}, const WorkMap& work_map = {},
                               E&& executor = E{});

/// Bytes of scratch for an image of that size and type, these options and a number of workers; 0 for
/// options that `chebyshev_ao` refuses.
template <DepthInput Depth>
[[nodiscard]] std::size_t chebyshev_ao_scratch_size(const Depth& depth,
                                                    const ChebyshevOptions& options,
                                                    const Projection& projection = {},
                                                    int workers = 1);

namespace detail {

/// From moments to visibility, with everything that does not change from pixel to pixel.
struct ChebyshevShade {
    DepthStep step;
    double bias = 0, range = 0;
    bool automatic_bias = false, range_check = false, clamp = true;

    ChebyshevShade(const ChebyshevOptions& options, const DepthStep& depth_step)
        : step{depth_step},
          bias{options.bias.value_or(0)},
          range{options.range.value_or(0)},
          automatic_bias{!options.bias},
          range_check{options.range.has_value()},
          clamp{options.clamp}
    {}
    /// As the formulas stand.
    [[nodiscard]] double of(const WindowMoments<double>& window, double distance) const
    {
        const double spread = bias_at(distance), deviation = window.deviation;
        double open = clamp ? cantelli_upper_bound(window.variance, deviation, spread)
                            : cantelli_unclamped(window.variance, deviation, spread);
        if (range_check) open = range_checked(open, deviation, range);
        const double background = window.background;
        return open + (1 - open) * (background / (background + window.count));
    }
    /// Distances may be lanes, here and below.
    template <class Real>
    [[nodiscard]] Real bias_at(const Real& distance) const
    {
        if (!automatic_bias) return Real{} + bias;
        const Real spacing = step.at(distance);
        return smaller(100.0 * spacing * spacing, Real{} + 1e300);
    }
    /// From the moments of a window, and the share of background in it.
    template <class Real, class Open>
    [[nodiscard]] Real operator()(const Real& distance, const Open& background,
                                  const Real& variance, const Real& deviation) const
    {
        const Real zero{}, one = zero + 1.0;
        Real behind = larger(deviation, zero);
        if (!clamp) behind = larger(deviation, -deviation);
        const Real square = behind * behind;
        const Real spread = variance + bias_at(distance);
        // cantelli_upper_bound in all lanes, without 0/0 in any.
        const auto shaded = square > zero;
        Real open = shaded ? spread / (shaded ? spread + square : one) : one;
        if (range_check) {
            const Real ranges = deviation / range;
            open = 1.0 - (1.0 - open) / (1.0 + ranges * ranges);
        }
        if constexpr (std::is_same_v<Open, NoBackground>) return open;
        else return open + (1.0 - open) * background;
    }
};

/// Writes visibility, and counts the pixels that have none of their own.
template <class T>
struct ChebyshevOutput {
    using Value = std::remove_cv_t<T>;
    static constexpr int results = 1;

    ChebyshevShade to_visibility;
    const ImageView<T>& visibility;
    const WorkMap& work_map;

    template <class Real, class Open>
    void shade(const Real& distance, const Real&, const Open& background, const Real& variance,
               const Real& deviation, Real* result) const
    {
        *result = to_visibility(distance, background, variance, deviation);
    }
    [[nodiscard]] bool wanted(int x, int y) const { return work_map.is_active(x, y); }
    /// `distances` is null where there is no background.
    template <class Distance>
    void row(Work& work, int y, int x, int width, const Value* values, std::ptrdiff_t,
             const Distance* distances) const
    {
        for_runs(y, x, width, [&](int first, int count, bool active) {
            const int at = first - x;
            const Distance* const mine = distances == nullptr ? nullptr : distances + at;
            if (active) {
                write(work, y, first, count, values + at, mine);
                return;
            }
            open(y, first, count);
            int background = 0;
            if (mine != nullptr)
                for (int i = 0; i < count; ++i) background += !(mine[i] > 0);
            work.background += static_cast<std::uint64_t>(background);
            work.skipped += static_cast<std::uint64_t>(count - background);
        });
    }

    // --- what need not be computed (left_out.hpp)

    [[nodiscard]] bool open_in_front() const { return to_visibility.clamp; }
    bool mark_wanted(int y, int end_y, int x, int end_x, std::uint8_t* marks) const
    {
        if (work_map.everything()) return false;
        const int group = x / WorkMap::group, groups = end_x / WorkMap::group - group + 1;
        std::fill_n(marks, groups, std::uint8_t{0});
        for (int row = y; row <= end_y; ++row)
            for (int i = 0; i < groups; ++i)
                marks[i] = static_cast<std::uint8_t>(marks[i] | work_map.active(group + i, row));
        return true;
    }
    template <int lanes, class Source>
    void leave_out(Work& work, const Source& source, int y, int x, int width, LeftOut cell) const
    {
        if (work_map.everything() && cell != LeftOut::spared) {
            open(y, x, width);
            (cell == LeftOut::empty ? work.background : work.skipped) +=
                static_cast<std::uint64_t>(width);
            return;
        }
        for_runs(y, x, width, [&](int first, int count, bool active) {
            // In steps, so that reading and writing overlap.
            constexpr int step = 256;
            std::uint64_t surfaces_found = 0;
            for (int i = 0; i < count; i += step) {
                const int now = (std::min)(step, count - i);
                surfaces_found += count_surfaces<lanes>(source, first + i, now, y);
                open(y, first + i, now);
            }
            work.background += static_cast<std::uint64_t>(count) - surfaces_found;
            if (!active || cell == LeftOut::open) work.skipped += surfaces_found;
        });
    }

private:
    /// Calls f(first, count, active) for runs of pixels that are all active, or all not.
    template <class F>
    void for_runs(int y, int x, int width, const F& f) const
    {
        if (work_map.everything()) {
            f(x, width, true);
            return;
        }
        const int end = x + width;
        while (x < end) {
            const bool active = work_map.is_active(x, y);
            int next = x;
            do next = (next / WorkMap::group + 1) * WorkMap::group;
            while (next < end && work_map.is_active(next, y) == active);
            const int stop = (std::min)(next, end);
            f(x, stop - x, active);
            x = stop;
        }
    }
    void open(int y, int x, int width) const
    {
        if (visibility.pixel_stride == 1) {
            std::fill_n(&visibility(x, y), width, Value{1});
            return;
        }
        for (int i = 0; i < width; ++i) visibility(x + i, y) = Value{1};
    }
    template <class Distance>
    void write(Work& work, int y, int x, int width, const Value* values,
               const Distance* distances) const
    {
        if (visibility.pixel_stride == 1) {
            T* const out = &visibility(x, y);
            if (distances == nullptr) {
                std::copy_n(values, width, out);
                return;
            }
            int background = 0;
            for (int i = 0; i < width; ++i) {
                out[i] = distances[i] > 0 ? values[i] : Value{1};
                background += !(distances[i] > 0);
            }
            work.background += static_cast<std::uint64_t>(background);
            return;
        }
        int background = 0;
        for (int i = 0; i < width; ++i) {
            const bool surface = distances == nullptr || distances[i] > 0;
            visibility(x + i, y) = surface ? values[i] : Value{1};
            background += !surface;
        }
        work.background += static_cast<std::uint64_t>(background);
    }
};

/// The window of a pixel at a distance.
struct ChebyshevWindow {
    Projection projection;
    double length;
    int largest;

    ChebyshevWindow(const ChebyshevOptions& options, const Projection& given)
        : projection{given},
          length{options.radius},
          largest{options.max_window / 2}
    {
        if (length > 0) return;
        // A window in pixels is a length under a projection that has one pixel per unit everywhere.
        projection = {.fx = 1, .fy = 1, .orthographic = true};
        length = largest = options.window / 2;
    }
    [[nodiscard]] WindowRadius operator()(double distance) const
    {
        const auto [x, y] = radii(distance);
        return {static_cast<int>(x), static_cast<int>(y)};
    }
    /// The same, not yet as integers, for lanes of distances.
    template <class Real>
    struct Radii {
        Real x, y;
    };
    template <class Real>
    [[nodiscard]] Radii<Real> radii(const Real& distance) const
    {
        const Real scale = projection.orthographic ? Real{} + length : length / distance;
        const auto whole = [&](const Real& pixels) {
            const Real clamped = smaller(pixels, Real{} + static_cast<double>(largest));
            return convert<double>(convert<std::int32_t>(clamped));
        };
        return {whole(projection.fx * scale), whole(projection.fy * scale)};
    }
    /// One square window for all pixels?
    [[nodiscard]] bool fixed() const
    {
        const WindowRadius radius = (*this)(1);
        return projection.orthographic && radius.x == radius.y;
    }
    template <class Distance>
    [[nodiscard]] auto fixed_filter(int width, int height, Border border) const
    {
        return BlockMoments<Distance>{width, height, 2 * (*this)(1).x + 1, border};
    }
    template <class Distance>
    [[nodiscard]] auto variable_filter(int width, int height, Border border) const
    {
        return VariableMoments<Distance>{width, height, {largest, largest}, border};
    }
};

/// What the variable filter asks about a pixel: its window, and what will be added to its variance.
struct ShadedWindow {
    const ChebyshevWindow& window;
    const ChebyshevShade& shade;

    template <class Real>
    [[nodiscard]] auto radii(const Real& distance) const
    {
        return window.radii(distance);
    }
    template <class Real>
    [[nodiscard]] Real slack(const Real& distance) const
    {
        return shade.bias_at(distance);
    }
};

[[nodiscard]] inline Error check_options(const ChebyshevOptions& options,
                                         const Projection& projection)
{
    if (const Error error =
            check_window(options.window, 32767, "options.window", "an odd number from 1 to 32767"))
        return error;
    if (const Error error = check_window(options.max_window, 4095, "options.max_window",
                                         "an odd number from 1 to 4095"))
        return error;
    if (const Error error =
            check_at_least(options.radius, 0, "options.radius", "a finite length >= 0"))
        return error;
    if (options.radius > 0)
        if (const Error error = check_projection(projection)) return error;
    if (options.bias && (!is_finite(*options.bias) || *options.bias < 0 || *options.bias > 1e300))
        return {ErrorCode::bad_value, "options.bias", *options.bias, "a number from 0 to 1e300"};
    if (options.range && (!is_finite(*options.range) || *options.range <= 0))
        return {ErrorCode::bad_value, "options.range", *options.range, "a finite length > 0"};
    return {};
}

template <class Source, class Value>
[[nodiscard]] Error check_chebyshev(const Source& source, const ImageView<Value>& visibility,
                                    const ChebyshevOptions& options, const Projection& projection,
                                    const WorkMap& work_map)
{
    if (const Error error = check_source(source)) return error;
    if (const Error error = check_output(visibility, "visibility")) return error;
    if (const Error error = check_same_size(source.image, visibility, "visibility")) return error;
    if (const Error error = check_apart(source.image, visibility, "visibility")) return error;
    if (const Error error = check_options(options, projection)) return error;
    return check_work_map(work_map, visibility);
}

}  // namespace detail

template <DepthInput Depth>
std::size_t chebyshev_ao_scratch_size(const Depth& depth, const ChebyshevOptions& options,
                                      const Projection& projection, int workers)
{
    const auto& image = depth_source(depth).image;
    if (workers < 1 || detail::check_options(options, projection)) return 0;
    const detail::ChebyshevWindow window{options, projection};
    if (window.fixed())
        return window
            .template fixed_filter<distance_t<Depth>>(image.width, image.height, options.border)
            .scratch_size(workers);
    return window
        .template variable_filter<distance_t<Depth>>(image.width, image.height, options.border)
        .scratch_size(workers);
}

template <DepthInput Depth, class Value, ScratchSource S, Executor E>
Outcome chebyshev_ao(const Depth& depth, const ImageView<Value>& visibility,
                     const ChebyshevOptions& options, const Projection& projection,
                     const WorkMap& work_map, S&& scratch, E&& executor)
{
    const auto& source = depth_source(depth);
    if (const Error error =
            detail::check_chebyshev(source, visibility, options, projection, work_map))
        return {error};
    if (visibility.empty()) return {};
    const int width = visibility.width, height = visibility.height;
    const detail::ChebyshevShade shade{options, source.step};
    const detail::ChebyshevWindow window{options, projection};

    const detail::ChebyshevOutput<Value> output{shade, visibility, work_map};
    Outcome outcome{};
    if (window.fixed()) {
        outcome = window.template fixed_filter<distance_t<Depth>>(width, height, options.border)
                      .run(source, output, scratch, executor);
    } else {
        const detail::ShadedWindow window_and_bias{window, shade};
        outcome = window.template variable_filter<distance_t<Depth>>(width, height, options.border)
                      .run(source, window_and_bias, output, scratch, executor);
    }
    if (outcome) {
        outcome.work.pixels =
            static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
        const bool nothing = outcome.work.background + outcome.work.skipped == outcome.work.pixels;
        outcome.work.passes = nothing ? 0 : 1;
        outcome.work.skipped_passes = nothing ? 1 : 0;
    }
    return outcome;
}

template <DepthInput Depth, class Value, Executor E>
Outcome chebyshev_ao_reference(const Depth& depth, const ImageView<Value>& visibility,
                               const ChebyshevOptions& options, const ExactRefinements& refinements,
                               const Projection& projection, const WorkMap& work_map, E&& executor)
{
    const auto& source = depth_source(depth);
    if (const Error error =
            detail::check_chebyshev(source, visibility, options, projection, work_map))
        return {error};
    if (refinements.sample_range && !options.range)
        return {
            {ErrorCode::bad_value, "refinements.sample_range", 1, "true only with options.range"}};
    if (visibility.empty()) return {};
    const int width = visibility.width, height = visibility.height;
    detail::ChebyshevShade shade{options, source.step};
    if (refinements.sample_range) shade.range_check = false;
    const detail::ChebyshevWindow window{options, projection};

    // Counted apart, so that the tasks share nothing.
    Outcome outcome{};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (!(surface_distance(source, x, y) > 0)) ++outcome.work.background;
            else if (!work_map.is_active(x, y)) ++outcome.work.skipped;
        }
    executor.for_each(height, [&](int y, int) {
        for (int x = 0; x < width; ++x) {
            const auto centre = surface_distance(source, x, y);
            double value = 1;
            if (centre > 0 && work_map.is_active(x, y)) {
                const detail::WindowRadius radius = window(centre);
                const detail::Span columns =
                    detail::window_span(x, radius.x, width, options.border);
                const detail::Span rows = detail::window_span(y, radius.y, height, options.border);
                const auto in_range = [&](double distance) {
                    return distance > 0 && (!refinements.sample_range ||
                                            std::fabs(distance - double{centre}) <= *options.range);
                };
                const auto keep = [&](int at_x, int at_y, double distance) {
                    if (!in_range(distance)) return false;
                    if (!refinements.paired) return true;
                    const int mirror_x = 2 * x - at_x, mirror_y = 2 * y - at_y;
                    return mirror_x >= columns.first && mirror_x <= columns.last &&
                           mirror_y >= rows.first && mirror_y <= rows.last &&
                           in_range(surface_distance(source, mirror_x, mirror_y));
                };
                const auto moments =
                    detail::direct_moments<double>(source, centre, columns, rows, keep);
                value = shade.of(moments, double{centre});
            }
            visibility(x, y) = static_cast<Value>(value);
        }
    });
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
