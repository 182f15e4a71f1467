#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/surface/depth_plane.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// What kernels share that look at the neighbours of a pixel: groups of 16 pixels side by side take the
/// same offsets, so that a neighbour of all 16 is one contiguous load.
namespace nook::inline NOOK_TARGET::detail {

/// Lanes of a native register.
template <class Real>
inline constexpr int lanes_of = std::is_same_v<Real, float> ? float_lanes : native_lanes;

/// 16 pixels of a row and how they look at their neighbours. Lengths are scaled as in the DepthPlane.
///
/// A neighbour at the slopes (gx, gy) from a pixel at distance d, and at distance q itself, stands at
/// v = (sx δ + gx q, sy δ + gy q, −δ) from it, δ = q − d; under orthography sx = sy = 0 and q = 1 in
/// the products. Every term is of the size of v: nothing cancels but what cancels in depth.
template <class Real>
struct SurfaceGroup {
    static constexpr int size = WorkMap::group;

    int x, y;   ///< the first pixel
    int count;  ///< pixels inside the image
    /// All 16 pixels are surfaces with normals; then these are the nearest and the farthest of them.
    bool whole = false;
    Real nearest, farthest;
    /// 0 where there is no surface or no normal.
    alignas(64) Real distance[size];
    NormalGroup<Real> normal;
    /// The ray of a pixel is (slope_x, slope_y, −1).
    alignas(64) Real slope_x[size];
    Real slope_y;
};

/// How far the pixels of one pass over a group look: in pixels along each axis, and as a slope.
struct Reach {
    double x, y, slope;
};

/// What turns distances into reaches.
struct ReachRule {
    /// Pixels per slope; under orthography per scaled length.
    double fx, fy;
    /// Of the scaled radius, in [1, 2).
    double radius;
    /// The largest slope that stays within the largest reach in pixels.
    double largest;
    bool orthographic;

    template <class Real>
    ReachRule(const DepthPlane<Real>& plane, double world_radius, const Projection& projection,
              int max_pixels)
        : fx{projection.fx / (projection.orthographic ? plane.scale() : 1)},
          fy{projection.fy / (projection.orthographic ? plane.scale() : 1)},
          radius{world_radius * plane.scale()},
          largest{max_pixels / (std::max)(fx, fy)},
          orthographic{projection.orthographic}
    {}
};

/// Pixels share a reach when theirs are at least this part of the largest among them; it lies in the
/// middle, so that nobody's changes by more than a ninth.
inline constexpr double shared_reach = 0.8;

/// Calls shade(reach, parts, results) for sets of pixels of the group that share a reach, until all
/// that have a surface and a reach of a pixel or more are served, and keeps the results of the set in
/// `values`. Part p are the pixels [p lanes, (p + 1) lanes); bit p of `parts` tells that some of them
/// belong to the set, and results are wanted for all of that part.
template <class Real, class Shade>
void for_each_reach(const SurfaceGroup<Real>& group, const ReachRule& rule, Real* values,
                    const Shade& shade)
{
    constexpr int lanes = lanes_of<Real>, parts = SurfaceGroup<Real>::size / lanes;
    using Vector = Lanes<Real, lanes>;
    alignas(64) Real results[SurfaceGroup<Real>::size];
    if (group.whole) {
        // All of them in one set, most of the time.
        const auto own = [&](Real distance) {
            const Real radius = static_cast<Real>(rule.radius);
            return smaller(rule.orthographic ? radius : radius / distance,
                           static_cast<Real>(rule.largest));
        };
        const Real largest = own(group.nearest), smallest = own(group.farthest);
        if (smallest >= largest * static_cast<Real>(shared_reach) &&
            smallest >= static_cast<Real>(1 / (std::max)(rule.fx, rule.fy))) {
            const double slope = (double{largest} + double{smallest}) / 2;
            shade(Reach{slope * rule.fx, slope * rule.fy, slope}, (1u << parts) - 1, values);
            return;
        }
    }
    const Vector zero{}, one = zero + Real{1};
    const Vector radius = zero + static_cast<Real>(rule.radius);
    const Vector limit = zero + static_cast<Real>(rule.largest);
    // One pixel.
    const Real least = static_cast<Real>(1 / (std::max)(rule.fx, rule.fy));
    Vector slopes[parts], all = zero;
    for (int part = 0; part < parts; ++part) {
        const Vector distance = load<lanes>(group.distance + part * lanes);
        const auto surface = distance > Real{0};
        const Vector own =
            smaller(rule.orthographic ? radius : radius / (surface ? distance : one), limit);
        slopes[part] = (surface & (own >= least)) ? own : zero;
        all = larger(all, slopes[part]);
    }
    const auto value_max = [](const auto& a, const auto& b) { return larger(a, b); };
    const auto value_min = [](const auto& a, const auto& b) { return smaller(a, b); };
    Real largest = fold(all, value_max);
    while (largest > 0) {
        const Real bound = largest * static_cast<Real>(shared_reach);
        Vector least_lanes = zero + largest, rest = zero;
        unsigned wanted = 0;
        for (int part = 0; part < parts; ++part) {
            const auto member = slopes[part] >= bound;
            wanted |= (any(member) ? 1u : 0u) << part;
            least_lanes = member ? smaller(least_lanes, slopes[part]) : least_lanes;
            rest = member ? rest : larger(rest, slopes[part]);
        }
        const double slope = (double{largest} + double{fold(least_lanes, value_min)}) / 2;
        shade(Reach{slope * rule.fx, slope * rule.fy, slope}, wanted, results);
        for (int part = 0; part < parts; ++part) {
            if ((wanted >> part & 1u) == 0) continue;
            const auto member = slopes[part] >= bound;
            const Vector before = load<lanes>(values + part * lanes);
            store(values + part * lanes, member ? load<lanes>(results + part * lanes) : before);
            slopes[part] = member ? zero : slopes[part];
        }
        largest = fold(rest, value_max);
    }
}

/// The nearest whole number of pixels: of a number or of lanes. The product was rounded before, so that
/// every target takes the same neighbour.
template <class Pixels>
[[nodiscard]] NOOK_INLINE auto whole_pixels(const Pixels& position, const Pixels& reach)
{
    const Pixels zero{}, half = zero + 0.5f, pixels = rounded(Pixels(position * reach));
    return convert<std::int32_t>(Pixels(pixels + (pixels < 0.0f ? Pixels(-half) : half)));
}

/// Neighbours that the pixels of a group share.
template <class Real, int capacity>
struct TapList {
    static constexpr int lanes = float_lanes, room = capacity + 16;

    int count = 0;
    /// Where the neighbour of the first pixel stands in the plane; the background beyond the image.
    std::int32_t index[room];
    /// From a pixel to its neighbour: slopes to the right and up, scaled lengths under orthography.
    Real slope_x[room], slope_y[room];

    /// Adds neighbours at places (right, down) of a disc of that reach, in parts of it. The places are
    /// readable up to a multiple of 16.
    void add(const DepthPlane<Real>& plane, const ReachRule& rule, const Reach& reach, int x, int y,
             const float* right, const float* down, int places)
    {
        using Floats = Lanes<float, lanes>;
        using Integers = Lanes<std::int32_t, lanes>;
        const Floats reach_x = broadcast<lanes>(static_cast<float>(reach.x));
        const Floats reach_y = broadcast<lanes>(static_cast<float>(reach.y));
        const Real per_x = static_cast<Real>(1 / rule.fx), per_y = static_cast<Real>(-1 / rule.fy);
        for (int i = 0; i < places; i += lanes) {
            const Integers dx = whole_pixels(load<lanes>(right + i), reach_x);
            const Integers dy = whole_pixels(load<lanes>(down + i), reach_y);
            const Integers to_x = dx + x, to_y = dy + y;
            const auto inside = (to_x > -DepthPlane<Real>::margin) & (to_x < plane.width()) &
                                (to_y >= 0) & (to_y < plane.height());
            const Integers zero{}, at = (to_y + 1) * plane.stride() + (to_x + plane.margin);
            store(index + count + i, inside ? at : Integers(zero + plane.nowhere()));
            if constexpr (std::is_same_v<Real, float>) {
                store(slope_x + count + i, Floats(convert<float>(dx) * per_x));
                store(slope_y + count + i, Floats(convert<float>(dy) * per_y));
            } else {
                std::int32_t across[lanes], below[lanes];
                store(across, dx);
                store(below, dy);
                for (int k = 0; k < lanes; ++k) {
                    slope_x[count + i + k] = across[k] * per_x;
                    slope_y[count + i + k] = below[k] * per_y;
                }
            }
        }
        count += places;
    }
};

/// In [0, 1]; 1 for what is not a number, which only projections beyond all measure lead to.
template <class Vector>
[[nodiscard]] NOOK_INLINE Vector settled(const Vector& open)
{
    using Value = typename LanesTraits<Vector>::Value;
    using Bits = std::conditional_t<sizeof(Value) == 4, std::int32_t, std::int64_t>;
    constexpr Bits infinite = sizeof(Value) == 4 ? Bits{0x7f800000} : Bits(0x7ff0000000000000);
    const auto bits = std::bit_cast<Lanes<Bits, LanesTraits<Vector>::count>>(open);
    const Vector zero{}, one = zero + Value{1};
    const Vector kept = (bits & infinite) == infinite ? one : open;
    return smaller(larger(kept, zero), one);
}

/// What every kernel over depth and normals asks of its arguments.
template <class Stored, class Decode, class Value>
[[nodiscard]] Error check_surface(const DepthSource<Stored, Decode>& source,
                                  const NormalSource& normals, const ImageView<Value>& visibility,
                                  const Projection& projection, const WorkMap& work_map)
{
    if (const Error error = check_source(source)) return error;
    if (const Error error = check_normals(normals, source.image)) return error;
    if (const Error error = check_output(visibility, "visibility")) return error;
    if (const Error error = check_same_size(source.image, visibility, "visibility")) return error;
    if (const Error error = check_apart(source.image, visibility, "visibility")) return error;
    if (const Error error = check_apart(normals, visibility, "visibility")) return error;
    if (const Error error = check_projection(projection)) return error;
    if (const Error error = check_work_map(work_map, visibility)) return error;
    using Distance = typename DepthSource<Stored, Decode>::Distance;
    if (!visibility.empty() && !DepthPlane<Distance>::fits(visibility.width, visibility.height))
        return {ErrorCode::bad_size, "depth", double(visibility.height),
                "fewer than 2^31 pixels, margins included"};
    return {};
}

/// What a pass over depth and normals runs on.
template <class Source>
struct SurfaceInput {
    using Real = typename Source::Distance;

    const Source& source;
    const NormalSource& normals;
    const Projection& projection;
    const WorkMap& work_map;
    DepthPlane<Real> plane;

    /// The pixels from x on; distances from the plane.
    void read(int x, int y, SurfaceGroup<Real>& group) const
    {
        constexpr int size = SurfaceGroup<Real>::size, lanes = lanes_of<Real>;
        using Vector = Lanes<Real, lanes>;
        group.x = x;
        group.y = y;
        group.count = (std::min)(size, plane.width() - x);
        const bool normal = read_normals(normals, x, y, group.count, group.normal);
        const Real* const row = plane.data() + plane.index(x, y);
        const auto extent = plane.extent(x, y);
        group.nearest = extent.nearest;
        group.farthest = extent.farthest;
        group.whole = normal && extent.nearest > 0;
        for (int i = 0; i < size; i += lanes) {
            const Vector nx = load<lanes>(group.normal.x + i), ny = load<lanes>(group.normal.y + i),
                         nz = load<lanes>(group.normal.z + i);
            if (group.whole) {
                store(group.distance + i, load<lanes>(row + i));
                continue;
            }
            const auto usable = (nx != Real{0}) | (ny != Real{0}) | (nz != Real{0});
            store(group.distance + i, usable ? load<lanes>(row + i) : Vector{});
        }
        for (int i = 0; i < size; i += lanes)
            store(group.slope_x + i, load<lanes>(plane.columns() + x + i));
        group.slope_y = projection.orthographic
                            ? Real{0}
                            : static_cast<Real>((projection.cy - y - 0.5) / projection.fy);
    }
    /// The slopes of the rays of all columns.
    void fill_columns() const
    {
        Real* const slopes = plane.columns();
        for (int x = 0; x < plane.width() + plane.margin; ++x)
            slopes[x] = projection.orthographic
                            ? Real{0}
                            : static_cast<Real>((x + 0.5 - projection.cx) / projection.fx);
    }
};

/// Pixels of a group that are surfaces; beyond the image there are none.
template <class Real>
[[nodiscard]] int count_surfaces(const Real* distances)
{
    constexpr int lanes = lanes_of<Real>;
    using Vector = Lanes<Real, lanes>;
    const Vector zero{}, one = zero + Real{1};
    Vector count = zero;
    for (int i = 0; i < WorkMap::group; i += lanes)
        count += load<lanes>(distances + i) > zero ? one : zero;
    return static_cast<int>(fold(count, [](const auto& a, const auto& b) { return a + b; }));
}

/// What is left to do where no group is active: 1 everywhere, and counting.
template <class Source, class Value, class S, class E>
Outcome skip_surface_pass(const SurfaceInput<Source>& input, const ImageView<Value>& visibility,
                          S&& scratch, E&& executor)
{
    using Real = typename Source::Distance;
    constexpr int band = 8, run_length = 256, size = WorkMap::group, lanes = lanes_of<Real>;
    const int width = visibility.width, height = visibility.height;
    const auto run = [&](Work& work, int, int task, int) {
        // What is a surface to the kernel: some are not, once they are scaled.
        alignas(64) Real row[run_length];
        const Real scale = static_cast<Real>(input.plane.scale());
        const int last = (std::min)(task * band + band, height);
        for (int y = task * band; y < last; ++y) {
            std::uint64_t surfaces = 0;
            for (int first = 0; first < width; first += run_length) {
                const int count = (std::min)(run_length, width - first);
                const int whole = pieces(count, size) * size;
                static_cast<void>(read_row<lanes>(input.source, first, count, y, row));
                for (int i = count; i < whole; ++i) row[i] = 0;
                DepthPlane<Real>::scale(row, count, scale);
                for (int i = 0; i < whole; i += size)
                    surfaces += static_cast<std::uint64_t>(count_surfaces<Real>(row + i));
            }
            work.background += static_cast<std::uint64_t>(width) - surfaces;
            work.skipped += surfaces;
            if (visibility.pixel_stride == 1) {
                Value* const out = &visibility(0, y);
                for (int x = 0; x < width; ++x) out[x] = Value{1};
            } else {
                for (int x = 0; x < width; ++x) visibility(x, y) = Value{1};
            }
        }
    };
    Outcome outcome = run_tasks(pieces(height, band), NoMemory{}, run, scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.skipped_passes = 1;
    return outcome;
}

/// What a row of groups remembers from one to the next.
struct RowMemory {
    bool quiet = true;  ///< nothing counted for the pixels before
    Work work{};

    /// Adds the samples of `lanes` pixels: of all, those that more was asked of than their height.
    NOOK_INLINE void count(int all, int hits, int lanes)
    {
        work.samples += static_cast<std::uint64_t>(hits * lanes);
        work.skipped_samples += static_cast<std::uint64_t>((all - hits) * lanes);
    }
};

/// Runs group(values, pixels, row_state) for every active group that holds a surface, where
/// `row_state = row(y)` is made once per row and may change from group to group; values start at 1. Writes them, 1 elsewhere.
/// Everything has been checked.
template <class Source, class Value, class Row, class Shade, class S, class E>
Outcome run_surface_pass(SurfaceInput<Source> input, const ImageView<Value>& visibility,
                         const Row& row, const Shade& shade, S&& scratch, E&& executor)
{
    using Real = typename Source::Distance;
    constexpr int band = 8, size = WorkMap::group, lanes = lanes_of<Real>;
    const int width = visibility.width, height = visibility.height;
    if (!input.work_map.any_active())
        return skip_surface_pass(input, visibility, scratch, executor);
    const auto layout = [&](ScratchLayout& block, std::size_t) {
        return block.take<Real>(input.plane.size());
    };
    const auto fill = [&](Real* plane, int task) {
        DepthPlane<Real> rows = input.plane;
        rows.use(plane);
        const int last = (std::min)(task * band + band, height);
        if (task == 0) {
            rows.fill(input.source, -1);
            SurfaceInput<Source> in = input;
            in.plane.use(plane);
            in.fill_columns();
        }
        for (int y = task * band; y < last; ++y) rows.fill(input.source, y);
    };
    const auto run = [&](Work& work, Real* plane, int task, int) {
        SurfaceInput<Source> in = input;
        in.plane.use(plane);
        SurfaceGroup<Real> group;
        alignas(64) Real values[size];
        const int last = (std::min)(task * band + band, height);
        for (int y = task * band; y < last; ++y) {
            auto state = row(y);
            for (int x = 0; x < width; x += size) {
                const int count = (std::min)(size, width - x);
                const bool active = in.work_map.is_active(x, y);
                if (active) in.read(x, y, group);
                const Real* const distances =
                    active ? group.distance : in.plane.data() + in.plane.index(x, y);
                const int surfaces = active && group.whole ? count : count_surfaces(distances);
                for (int i = 0; i < size; i += lanes) store(values + i, broadcast<lanes>(Real{1}));
                if (active && surfaces > 0) shade(values, group, state, in.plane);
                work.background += static_cast<std::uint64_t>(count - surfaces);
                if (!active) work.skipped += static_cast<std::uint64_t>(surfaces);
                if constexpr (std::is_same_v<Value, Real>)
                    if (visibility.pixel_stride == 1 && count == size) {
                        for (int i = 0; i < size; i += lanes)
                            store(&visibility(x + i, y), load<lanes>(values + i));
                        continue;
                    }
                for (int i = 0; i < count; ++i)
                    visibility(x + i, y) = static_cast<Value>(values[i]);
            }
            if constexpr (requires { state.memory; }) work += state.memory.work;
        }
    };
    const int tasks = pieces(height, band);
    Outcome outcome = run_tasks(layout, fill, tasks, run, tasks, scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

/// Bytes of scratch for `run_surface_pass`.
template <class Real>
[[nodiscard]] std::size_t surface_scratch_size(int width, int height, int workers)
{
    if (workers < 1 || width < 1 || height < 1 || !DepthPlane<Real>::fits(width, height)) return 0;
    const DepthPlane<Real> plane{width, height, 1};
    return task_scratch_size(
        [&](ScratchLayout& block, std::size_t) { return block.take<Real>(plane.size()); }, workers);
}

}  // namespace nook::inline NOOK_TARGET::detail
