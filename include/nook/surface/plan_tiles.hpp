#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/lanes.hpp>
#include <nook/surface/depth_plane.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/plan_cells.hpp>
#include <nook/surface/surface_pass.hpp>
#include <nook/work_map.hpp>

/// How a planner gets the bounds of 16 × 16 pixels.
namespace nook::inline NOOK_TARGET::detail {

/// Tells whether groups of pixels have one normal.
template <class Real>
class SameNormal {
public:
    /// That of the pixel (x, y), in the group that begins at `left`.
    void start(const NormalSource& normals, int left, int x, int y, int count)
    {
        spread_ = 0;
        const float stored[3] = {normals.image.x(x, y), normals.image.y(x, y),
                                 normals.image.z(x, y)};
        double square = 0;
        for (int k = 0; k < 3; ++k) {
            stored_[k] = stored[k];
            square += double{stored[k]} * double{stored[k]};
        }
        // Others are normalised, which is not worth following here.
        unit_ = square > 1 - 0x1p-21 && square < 1 + 0x1p-21;
        if (unit_ && std::is_same_v<Real, float> && !normals.rotated) {
            for (int k = 0; k < 3; ++k) normal_[k] = double{stored[k]};
            exists_ = true;
        } else {
            NormalGroup<Real> group;
            read_normals(normals, left, y, count, group);
            const Real n[3] = {group.x[x - left], group.y[x - left], group.z[x - left]};
            for (int k = 0; k < 3; ++k) normal_[k] = double{n[k]};
            exists_ = n[0] != 0 || n[1] != 0 || n[2] != 0;
        }
        side_by_side_ = normals.image.x.pixel_stride == 3 && normals.image.y.pixel_stride == 3 &&
                        normals.image.z.pixel_stride == 3;
    }
    [[nodiscard]] bool exists() const { return exists_; }
    [[nodiscard]] const double* normal() const { return normal_; }
    /// How far components of the groups that were followed are off.
    [[nodiscard]] double spread() const { return spread_; }

    /// False when a pixel of a group has another normal than by rounding.
    [[nodiscard]] NOOK_INLINE bool follows(const NormalSource& normals, int x, int y, int count,
                                           bool is_last)
    {
        const float* const in = &normals.image.x(x, y);
        using Vector = Lanes<float, lanes>;
        using Bits = Lanes<std::int32_t, lanes>;
        Bits off{};
        const auto compare = [&](const Vector& values, const Vector& expected) {
            const Vector step = values - expected;
            const Bits size = std::bit_cast<Bits>(step) & 0x7fffffff;
            off = size > off ? size : off;
        };
        if (side_by_side_ && count == WorkMap::group && &normals.image.y(x, y) == in + 1 &&
            &normals.image.z(x, y) == in + 2) {
            const float* const next = is_last ? in : in + normals.image.x.row_stride;
            for (int i = 0; i < 3 * WorkMap::group; i += 16) prefetch(next + i);
            if (all_like_first(in)) return true;
            alignas(64) float pattern[3 * lanes];
            for (int i = 0; i < 3 * lanes; ++i) pattern[i] = stored_[i % 3];
            for (int i = 0; i < 3 * WorkMap::group; i += 3 * lanes)
                for (int k = 0; k < 3; ++k)
                    compare(load<lanes>(in + i + k * lanes), load<lanes>(pattern + k * lanes));
        } else {
            alignas(64) float channels[3][WorkMap::group];
            read_channels(normals.image, x, y, count, channels[0], channels[1], channels[2]);
            for (int k = 0; k < 3; ++k) {
                for (int i = count; i < WorkMap::group; ++i) channels[k][i] = stored_[k];
                for (int i = 0; i < WorkMap::group; i += lanes)
                    compare(load<lanes>(channels[k] + i), broadcast<lanes>(stored_[k]));
            }
        }
        // By bits, so that NaN is not equal to anything.
        if (!any(off > std::int32_t{0})) return true;
        if (!unit_ || any(off > std::bit_cast<std::int32_t>(largest_spread))) return false;
        // Normalising and turning add to it.
        spread_ = 4 * double{largest_spread};
        return true;
    }

private:
    static constexpr int lanes = float_lanes;
    /// Whether 16 normals side by side have the bits of the stored one.
    [[nodiscard]] NOOK_INLINE bool all_like_first(const float* in) const
    {
        using Bits = Lanes<std::int32_t, lanes>;
        const auto bits = [&](int i) { return std::bit_cast<Bits>(load<lanes>(in + i)); };
        for (int k = 0; k < 3; ++k)
            if (std::bit_cast<std::int32_t>(in[k]) != std::bit_cast<std::int32_t>(stored_[k]))
                return false;
        constexpr int end = 3 * WorkMap::group - 3;
        Bits differing = bits(end - lanes) ^ bits(end + 3 - lanes);
        for (int i = 0; i < end - lanes; i += lanes) differing |= bits(i) ^ bits(i + 3);
        return !any(differing != std::int32_t{0});
    }

    /// Of triangles in one plane.
    static constexpr float largest_spread = 0x1p-23f;

    float stored_[3];
    double normal_[3];
    double spread_;
    bool exists_, unit_, side_by_side_;
};

/// The bounds of a tile, and how many surfaces its groups have, row by row: tiles side by side take
/// turns, so that memory is read in long runs.
template <class Real>
class PlanTile {
public:
    static constexpr int side = PlanGrid::leaf;

    template <class Source>
    void start(const Source& source, const NormalSource& normals, const PlanAxes& axes,
               double scale, const PlanRect& rect)
    {
        rect_ = rect;
        columns_ = rect.right - rect.left + 1;
        // The tile counts for what its middle is.
        const int x = rect.left + columns_ / 2, y = (rect.top + rect.bottom + 1) / 2;
        same_.start(normals, rect.left, x, y, columns_);
        distance_ = surface_distance(source, x, y);
        DepthPlane<Real>::scale(&distance_, 1, static_cast<Real>(scale));
        x_ = axes.x(x);
        y_ = axes.y(y);
        all_.start(same_, axes, rect.left);
        flat_ = same_.exists();
        sum_ = 0;
    }
    /// Adds the groups' row y. Returns its number of surfaces.
    template <class Source>
    NOOK_INLINE int add(const Source& source, const NormalSource& normals, const PlanAxes& axes,
                        Real scale, int y)
    {
        alignas(64) Real row[side];
        read(source, y, row);
        const Vector zero{};
        bool whole = true, any_surface = false;
        for (int i = 0; i < side; i += lanes) {
            Vector distance = load<lanes>(row + i) * scale;
            distance = distance < DepthPlane<Real>::farthest ? distance : zero;
            const auto surface = distance > zero;
            whole = whole && !any(distance == zero);
            any_surface = any_surface || any(surface);
            store(row + i, distance);
        }
        if (whole) {
            sum_ += side;
            flat_ = flat_ && same_.follows(normals, rect_.left, y, columns_, y == rect_.bottom);
            all_.template add<true>(row, axes.y(y), axes.orthographic);
            return side;
        }
        if (!any_surface) {
            flat_ = false;
            return 0;
        }
        const int surfaces = count_surfaces<Real>(row);
        sum_ += surfaces;
        flat_ = flat_ && surfaces == columns_ &&
                same_.follows(normals, rect_.left, y, columns_, y == rect_.bottom);
        all_.template add<false>(row, axes.y(y), axes.orthographic);
        return surfaces;
    }
    [[nodiscard]] std::uint64_t background() const
    {
        return static_cast<std::uint64_t>(columns_ * (rect_.bottom - rect_.top + 1) - sum_);
    }
    void finish(const PlanAxes& axes, NearBound& near_bound, TangentBound& tangent)
    {
        near_bound = {0, 0, 0, 0};
        tangent = {};
        if (sum_ == 0) return;
        all_.finish();
        bound_near(axes, near_bound);
        tangent.kind = flat_ ? TangentBound::Kind::flat : TangentBound::Kind::mixed;
        if (!flat_) return;
        const double q = double{distance_}, wide = axes.orthographic ? 1 : q;
        const double x = x_ * wide, y = y_ * wide;
        const double* const n = same_.normal();
        tangent.centre[0] = x;
        tangent.centre[1] = y;
        tangent.centre[2] = -q;
        for (int k = 0; k < 3; ++k) tangent.normal[k] = n[k];
        tangent.spread = same_.spread();
        tangent.nearest = all_.nearest;
        tangent.farthest = all_.farthest;
        // What the spread adds across the tile.
        const double far_x = largest_size(axes.x(rect_.left), axes.x(rect_.right));
        const double far_y = largest_size(axes.y(rect_.top), axes.y(rect_.bottom));
        const double beside = (far_x + far_y) * (axes.orthographic ? 1 : all_.farthest);
        const double off = 2 * tangent.spread * (beside + all_.farthest);
        tangent.rise = all_.high_plane + (n[0] * x + n[1] * y - n[2] * q) + off;
        tangent.plane = all_.low_plane - off;
    }

private:
    static constexpr int lanes = std::is_same_v<Real, float> ? float_lanes : native_lanes;
    using Vector = Lanes<Real, lanes>;
    using Doubles = Lanes<double, native_lanes>;

    [[nodiscard]] static double largest_size(double a, double b)
    {
        return (std::max)(std::fabs(a), std::fabs(b));
    }
    /// Over the surfaces of rows: distances, and how far the viewer lies from planes through them.
    struct Extremes {
        double nearest, farthest, low_plane, high_plane;

        void start(const SameNormal<Real>& same, const PlanAxes& axes, int left)
        {
            const Doubles zero{}, beyond = zero + 0x1p300;
            near_lanes = Vector{} + Real{0x1p60};
            far_lanes = Vector{};
            low = beyond;
            high = zero - beyond;
            const double* const n = same.normal();
            nx = n[0];
            ny = n[1];
            nz = n[2];
            first = nx * axes.x(left);
            step = nx * axes.per_x;
        }
        template <bool whole>
        void add(const Real* row, double y, bool orthographic)
        {
            const Vector beyond_lanes = Vector{} + Real{0x1p60};
            for (int i = 0; i < side; i += lanes) {
                const Vector q = load<lanes>(row + i);
                near_lanes =
                    smaller(near_lanes, whole ? q : Vector(q > Real{0} ? q : beyond_lanes));
                far_lanes = larger(far_lanes, q);
            }
            const Doubles zero{}, beyond = zero + 0x1p300, below = zero - 0x1p300;
            const double up = first + ny * y;
            alignas(64) static constexpr double counting[] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                              8, 9, 10, 11, 12, 13, 14, 15};
            Doubles least = low, most = high;
            for (int i = 0; i < side; i += native_lanes) {
                const Doubles q = convert<double>(load<native_lanes>(row + i));
                const Doubles level = load<native_lanes>(counting + i) * step + up;
                const Doubles plane =
                    orthographic ? Doubles(q * nz - level) : Doubles(q * (nz - level));
                const auto surface = q > zero;
                least = smaller(least, whole ? plane : Doubles(surface ? plane : beyond));
                most = larger(most, whole ? plane : Doubles(surface ? plane : below));
            }
            low = least;
            high = most;
        }
        void finish()
        {
            const auto less = [](const auto& a, const auto& b) { return smaller(a, b); };
            const auto more = [](const auto& a, const auto& b) { return larger(a, b); };
            nearest = double{fold(near_lanes, less)};
            farthest = double{fold(far_lanes, more)};
            low_plane = fold(low, less);
            high_plane = fold(high, more);
        }

        double nx, ny, nz;
        /// What the columns add to the height: of the first, and from one to the next.
        double first, step;
        Vector near_lanes, far_lanes;
        Doubles low, high;
    };

    /// The distances of a row; 0 for background and beyond the image.
    template <class Source>
    NOOK_INLINE void read(const Source& source, int y, Real* row) const
    {
        if constexpr (std::is_same_v<decltype(source.decode), IdentityDecode>)
            if (source.image.pixel_stride == 1 && columns_ == side) {
                const Real* const in = &source.image(rect_.left, y);
                prefetch(y < rect_.bottom ? in + source.image.row_stride : in);
                for (int i = 0; i < side; i += lanes)
                    store(row + i, surfaces(load<lanes>(in + i), source.far_limit));
                return;
            }
        for (int i = columns_; i < side; ++i) row[i] = 0;
        static_cast<void>(read_row<lanes>(source, rect_.left, columns_, y, row));
    }
    /// The plane of the normal in front of all surfaces, or the nearest of them, whichever tells more.
    void bound_near(const PlanAxes& axes, NearBound& bound) const
    {
        bound.least = axes.orthographic ? -all_.farthest : 1 / all_.farthest;
        // Nothing is known of what sits in the viewer's eye.
        bound.c = axes.orthographic         ? -all_.nearest
                  : all_.nearest > 0x1p-100 ? 1 / all_.nearest
                                            : 0x1p200;
        if (!same_.exists()) return;
        const double* const n = same_.normal();
        const double over = axes.orthographic ? n[2] : all_.low_plane;
        if (!(over > 0x1p-100)) return;
        NearBound tilted = bound;
        tilted.a = -n[0] / over;
        tilted.b = -n[1] / over;
        tilted.c = (axes.orthographic ? -all_.low_plane : n[2]) / over;
        if (tilted.at(x_, y_) <= bound.c + std::fabs(bound.c) * 0x1p-16) bound = tilted;
    }

    PlanRect rect_;
    int columns_, sum_;
    bool flat_;
    Real distance_;
    double x_, y_;
    SameNormal<Real> same_;
    Extremes all_;
};

}  // namespace nook::inline NOOK_TARGET::detail
