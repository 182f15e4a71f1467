#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/outline_raster.hpp>
#include <nook/scene/outline_view.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>

namespace nook {

struct OutlineAoOptions {
    /// Reach of the blur in pixels, 0 to 1000: the window has 2 radius + 1 of them a side. 0: none.
    int radius = 8;
    /// How dark a pixel gets whose whole window lies in overlapping shells, 0 to 1.
    double strength = 0.5;
    /// Overlaps that darken no further, 1 to 254. 1: the plain stencil; more: the more shells contain a
    /// point, the darker it gets.
    int limit = 1;
    /// As OutlineMaskOptions::threshold: so many shells make the first overlap.
    int threshold = 2;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// The stand-alone form of the outline stencil (Park & Baek 2021): its blur as visibility,
///     visibility = 1 - strength * mean(min(max(count - threshold + 1, 0), limit)) / limit,
/// with the counts of `outline_count` and the mean over the surface pixels of the window, cut at the
/// border of the image. Background gets exactly 1 and enters no window.
///
/// The window is one of the screen: it knows neither distance nor normals. A depth-aware blur
/// may follow. `visibility` has the size of the depth and shares no memory with it; other arguments and
/// limits are those of `outline_count`. Work: samples is the number of surface pixels in overlapping
/// shells. Scratch: `outline_ao_scratch_size`. Sums are integers: the same bits for any threads.
template <DepthInput Depth, std::floating_point Value, ScratchSource S = HeapScratch,
          Executor E = Serial>
Outcome outline_ao(const OutlineView& shells, double extent, const Depth& depth,
                   const ImageView<Value>& visibility, const OutlineAoOptions& options,
                   const ViewFrame& frame, const Projection& projection, S&& scratch = S{},
                   E&& executor = E{});

/// Bytes of scratch that `outline_ao` asks for: `outline_scratch_size`, 4 per pixel, and rows per
/// worker.
[[nodiscard]] std::size_t outline_ao_scratch_size(const OutlineView& shells,
                                                  const OutlineAoOptions& options, int width,
                                                  int height, int workers = 1);

namespace detail {

/// Levels of overlap and the surfaces they lie on, packed into one integer per pixel, so that one sum
/// adds up both.
struct OutlineLevels {
    static constexpr int shift = 20;
    static constexpr std::int32_t surface = 1 << shift, mask = surface - 1;
    static constexpr int largest_radius = 1000, largest_limit = 254;
    static_assert((2 * largest_radius + 1) * largest_limit < surface);
    static_assert((2 * largest_radius + 1) < (1 << (31 - shift)));
    static constexpr int rows = 64;
};

struct OutlineAoScratch {
    OutlineScratch drawing;
    std::int32_t* levels;
    /// Per worker: sums down the window, and running sums along the row of the levels and the surfaces.
    std::int32_t* columns;
    std::uint32_t* level_sums;
    std::uint32_t* surface_sums;
    std::size_t sums_size;

    OutlineAoScratch(ScratchLayout& layout, const OutlineView& shells, int radius, int width,
                     int height, int workers)
        : drawing{layout, shells.vertex_count, shells.triangle_count, width, height, workers},
          sums_size{static_cast<std::size_t>(drawing.stride) +
                    2 * static_cast<std::size_t>((std::max)(radius, 0)) + 1}
    {
        const auto stride = static_cast<std::size_t>(drawing.stride);
        const auto count = static_cast<std::size_t>(workers);
        levels = layout.take<std::int32_t>(stride * static_cast<std::size_t>(height));
        columns = layout.take<std::int32_t>(stride * count);
        level_sums = layout.take<std::uint32_t>(sums_size * count);
        surface_sums = layout.take<std::uint32_t>(sums_size * count);
    }
};

/// Writes the levels of a band from its counts.
inline void find_levels(const OutlineBand& band, const OutlineAoOptions& options, float none,
                        std::int32_t* levels, Work& work)
{
    constexpr int lanes = float_lanes;
    using Integers = Lanes<std::int32_t, lanes>;
    const Integers one = broadcast<lanes>(std::int32_t{1});
    // Counts stay far from the ends of the range; a threshold may be anything.
    const std::int32_t free = (std::min)((std::max)(options.threshold, -(1 << 30)), 1 << 30) - 1;
    const auto limit = broadcast<lanes>(std::int32_t{options.limit});
    Integers surfaces{}, overlapping{};
    for (int y = band.top; y <= band.bottom; ++y) {
        const std::ptrdiff_t from = (y - band.top) * band.stride, to = y * band.stride;
        for (int x = 0; x < band.width; x += lanes) {
            const auto surface = load<lanes>(band.keys + from + x) > none;
            const Integers above = load<lanes>(band.counts + from + x) - free;
            const Integers level = smaller(larger(above, Integers{}), limit);
            surfaces += surface ? one : Integers{};
            overlapping += (surface & (level > 0)) ? one : Integers{};
            store(levels + to + x,
                  Integers{surface ? Integers{level + OutlineLevels::surface} : Integers{}});
        }
    }
    const auto sum = [](const auto& a, const auto& b) { return a + b; };
    const int pixels = band.width * (band.bottom - band.top + 1);
    work.background += static_cast<std::uint64_t>(pixels - fold(surfaces, sum));
    work.samples += static_cast<std::uint64_t>(fold(overlapping, sum));
}

/// Blurs the rows [top, bottom] of the levels into visibility.
template <class Value>
void blur_levels(const OutlineAoScratch& scratch, const OutlineAoOptions& options, int worker,
                 int top, int bottom, const ImageView<Value>& visibility)
{
    constexpr int lanes = float_lanes;
    using Integers = Lanes<std::int32_t, lanes>;
    using Reals = Lanes<float, lanes>;
    const int width = visibility.width, height = visibility.height, radius = options.radius;
    const std::ptrdiff_t stride = scratch.drawing.stride;
    std::int32_t* const columns = scratch.columns + worker * stride;
    const std::size_t sums_at = scratch.sums_size * static_cast<std::size_t>(worker);
    std::uint32_t* const level_sums = scratch.level_sums + sums_at;
    std::uint32_t* const surface_sums = scratch.surface_sums + sums_at;
    const auto add_row = [&](int y, bool away) {
        if (y < 0 || y >= height) return;
        const std::int32_t* const row = scratch.levels + y * stride;
        for (int x = 0; x < width; x += lanes) {
            const Integers sum = load<lanes>(columns + x), values = load<lanes>(row + x);
            store(columns + x, Integers{away ? Integers{sum - values} : Integers{sum + values}});
        }
    };
    std::fill_n(columns, stride, 0);
    std::fill_n(level_sums, radius + 1, 0u);
    std::fill_n(surface_sums, radius + 1, 0u);
    for (int y = top - radius; y < top + radius; ++y) add_row(y, false);
    for (int y = top; y <= bottom; ++y) {
        add_row(y + radius, false);
        // Running sums wrap around; differences are right.
        std::uint32_t level = 0, surface = 0;
        std::size_t at = static_cast<std::size_t>(radius) + 1;
        for (int x = 0; x < width; ++x, ++at) {
            level += static_cast<std::uint32_t>(columns[x] & OutlineLevels::mask);
            surface += static_cast<std::uint32_t>(columns[x] >> OutlineLevels::shift);
            level_sums[at] = level;
            surface_sums[at] = surface;
        }
        for (; at < scratch.sums_size; ++at) {
            level_sums[at] = level;
            surface_sums[at] = surface;
        }
        const std::int32_t* const row = scratch.levels + y * stride;
        const auto strength = static_cast<float>(options.strength);
        for (int x = 0; x < width; x += lanes) {
            const auto window = [&](const std::uint32_t* sums) {
                const auto end = load<lanes>(sums + x + 2 * radius + 1),
                           begin = load<lanes>(sums + x);
                return convert<float>(std::bit_cast<Integers>(end - begin));
            };
            // Level 0 gives exactly 1.
            const Reals most = window(surface_sums) * static_cast<float>(options.limit);
            const Reals share = window(level_sums) / larger(most, broadcast<lanes>(1.0f));
            const Reals open = larger(Reals{1.0f - strength * share}, Reals{});
            const Reals one = broadcast<lanes>(1.0f);
            const Reals shade = load<lanes>(row + x) != 0 ? open : one;
            if constexpr (std::is_same_v<Value, float>) {
                if (visibility.pixel_stride == 1 && x + lanes <= width) {
                    store(&visibility(x, y), shade);
                    continue;
                }
            }
            float values[lanes];
            store(values, shade);
            for (int i = 0; i < lanes && x + i < width; ++i)
                visibility(x + i, y) = static_cast<Value>(values[i]);
        }
        add_row(y - radius, true);
    }
}

}  // namespace detail

inline std::size_t outline_ao_scratch_size(const OutlineView& shells,
                                           const OutlineAoOptions& options, int width, int height,
                                           int workers)
{
    detail::ScratchLayout layout;
    static_cast<void>(
        detail::OutlineAoScratch{layout, shells, options.radius, width, height, workers});
    return layout.size();
}

template <DepthInput Depth, std::floating_point Value, ScratchSource S, Executor E>
Outcome outline_ao(const OutlineView& shells, double extent, const Depth& depth,
                   const ImageView<Value>& visibility, const OutlineAoOptions& options,
                   const ViewFrame& frame, const Projection& projection, S&& scratch, E&& executor)
{
    using detail::OutlineLevels;
    Outcome outcome{};
    const auto& source = depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    if ((outcome.error = detail::check_outline(shells, extent, source, frame, projection)))
        return outcome;
    if ((outcome.error = detail::check_output(visibility, "visibility"))) return outcome;
    if ((outcome.error = detail::check_same_size(source.image, visibility, "visibility")))
        return outcome;
    if ((outcome.error = detail::check_apart(source.image, visibility, "visibility")))
        return outcome;
    if (options.radius < 0 || options.radius > OutlineLevels::largest_radius)
        return {
            {ErrorCode::bad_value, "options.radius", double(options.radius), "0 to 1000 pixels"}};
    if (options.limit < 1 || options.limit > OutlineLevels::largest_limit)
        return {
            {ErrorCode::bad_value, "options.limit", double(options.limit), "1 to 254 overlaps"}};
    if (!detail::is_finite(options.strength) || options.strength < 0 || options.strength > 1)
        return {{ErrorCode::bad_value, "options.strength", options.strength, "0 to 1"}};
    if (source.image.empty()) return outcome;

    const int workers = static_cast<int>(executor.concurrency());
    const std::size_t size = outline_ao_scratch_size(shells, options, width, height, workers);
    void* const block = scratch.reserve(size);
    if (block == nullptr) return {detail::check_scratch<S>(size)};
    detail::ScratchLayout layout{block};
    const detail::OutlineAoScratch parts{layout, shells, options.radius, width, height, workers};
    const float none = detail::background_key(projection.orthographic);
    outcome.work = detail::draw_outlines(
        shells, extent, source, frame, projection, parts.drawing,
        [&](Work& work, const detail::OutlineBand& band) {
            detail::find_levels(band, options, none, parts.levels, work);
        },
        executor);
    executor.for_each(detail::pieces(height, OutlineLevels::rows), [&](int task, int worker) {
        const int top = task * OutlineLevels::rows;
        detail::blur_levels(parts, options, worker, top,
                            (std::min)(top + OutlineLevels::rows, height) - 1, visibility);
    });
    outcome.work.passes = 2;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
