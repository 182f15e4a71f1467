#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/surface/bilateral_weight.hpp>
#include <nook/surface/normal_source.hpp>
#include <nook/surface/shade_runs.hpp>
#include <nook/work_map.hpp>

/// Rows of an image in working memory, decoded once, with a margin of background: what the weights of
/// the blur and the upsampling are computed from.
namespace nook::inline NOOK_TARGET::detail {

/// The working type: double as soon as something is.
template <class In, class Depth, class Out>
using guide_real =
    std::conditional_t<std::is_same_v<std::remove_const_t<In>, double> ||
                           std::is_same_v<distance_t<Depth>, double> || std::is_same_v<Out, double>,
                       double, float>;

/// x, x + 1, …
template <class L>
[[nodiscard]] NOOK_INLINE L columns_from(int x)
{
    using Real = typename LanesTraits<L>::Value;
    constexpr int lanes = LanesTraits<L>::count;
    Real columns[lanes];
    for (int i = 0; i < lanes; ++i) columns[i] = static_cast<Real>(x + i);
    return load<lanes>(columns);
}

/// One row. Pointers to pixel 0; the margin and what rounds the width up to whole groups hold 0.
template <class Real>
struct GuideRow {
    Real* distance = nullptr;  ///< 0 where a pixel enters nobody's window
    Real* screen = nullptr;    ///< `EdgeRule::on_screen`; without normals
    Real* value = nullptr;
    Real* nx = nullptr;
    Real* ny = nullptr;
    Real* nz = nullptr;

    /// The same from pixel x on.
    template <bool with_normals>
    [[nodiscard]] NOOK_INLINE GuideRow from(int x) const
    {
        if constexpr (with_normals)
            return {distance + x, nullptr, value + x, nx + x, ny + x, nz + x};
        else return {distance + x, screen + x, value + x};
    }
};

/// How the rows of one worker lie in scratch: a ring of rows, a row of background, and one more of
/// values.
template <class Real, class Distance>
class GuideRows {
public:
    static constexpr int lanes = std::is_same_v<Real, float> ? float_lanes : native_lanes;
    static constexpr int group = WorkMap::group;
    using Vector = Lanes<Real, lanes>;

    GuideRows(int width, int slots, int margin, bool with_normals)
        : width_{width},
          slots_{slots},
          margin_{rounded_up(margin)},
          planes_{with_normals ? 5 : 3},
          // Rows of the same alignment modulo 4 KB would fall into the same sets of the cache.
          stride_{rounded_up(width) + 2 * margin_},
          with_normals_{with_normals}
    {
        if (stride_ % 512 == 0) stride_ += group;
    }

    struct Memory {
        Real* rows;
        Distance* distances;
    };
    [[nodiscard]] Memory take(ScratchLayout& block, std::size_t workers) const
    {
        Real* const rows = block.take<Real>(workers * size());
        Distance* distances = nullptr;
        if (!std::is_same_v<Real, Distance>)
            distances = block.take<Distance>(workers * static_cast<std::size_t>(stride_));
        return {rows, distances};
    }
    [[nodiscard]] Memory of(const Memory& memory, int worker) const
    {
        const auto index = static_cast<std::size_t>(worker);
        return {memory.rows + index * size(),
                memory.distances == nullptr
                    ? nullptr
                    : memory.distances + index * static_cast<std::size_t>(stride_)};
    }
    /// All background.
    void clear(const Memory& memory) const { std::fill_n(memory.rows, size(), Real{0}); }

    /// Slot `slots` is the row of background.
    [[nodiscard]] GuideRow<Real> row(const Memory& memory, int slot) const
    {
        const auto plane = [&](int index) {
            return memory.rows + std::ptrdiff_t{slot * planes_ + index} * stride_ + margin_;
        };
        GuideRow<Real> row{plane(0), nullptr, plane(1)};
        if (with_normals_) {
            row.nx = plane(2);
            row.ny = plane(3);
            row.nz = plane(4);
        } else {
            row.screen = plane(2);
        }
        return row;
    }
    [[nodiscard]] Real* values(const Memory& memory) const
    {
        return memory.rows + std::ptrdiff_t{(slots_ + 1) * planes_} * stride_ + margin_;
    }

    /// Decodes the distances of row y in the columns of a run, and what is linear on screen.
    template <class Source>
    Background read(const Source& source, const EdgeRule<Real>& rule, const GroupRun& run, int y,
                    const Memory& memory, const GuideRow<Real>& row) const
    {
        Background background{};
        const int count = run.end - run.begin;
        if constexpr (std::is_same_v<Real, Distance>) {
            background = read_row<lanes>(source, run.begin, count, y, row.distance + run.begin);
        } else {
            background = read_row<1>(source, run.begin, count, y, memory.distances);
            for (int i = 0; i < count; ++i) row.distance[run.begin + i] = memory.distances[i];
        }
        const Vector zero{}, nearest = zero + GuideRange<Real>::nearest,
                             farthest = zero + GuideRange<Real>::farthest;
        // What the vectors below reach beyond the width is 0 and stays so.
        for (int x = run.begin; x < run.end; x += lanes) {
            const Vector distance = load<lanes>(row.distance + x);
            const Vector clamped =
                distance > zero ? smaller(larger(distance, nearest), farthest) : zero;
            store(row.distance + x, clamped);
            if (row.screen != nullptr) store(row.screen + x, rule.on_screen(clamped));
        }
        return background;
    }
    /// Unit normals of the 16 pixels from x on; pixels without one become background. Tells how many
    /// surfaces that were.
    int read_normals(const NormalSource& normals, int x, int y, const GuideRow<Real>& row) const
    {
        NormalGroup<Real> unit;
        detail::read_normals(normals, x, y, (std::min)(group, width_ - x), unit);
        int lost = 0;
        for (int i = 0; i < group; ++i) {
            row.nx[x + i] = unit.x[i];
            row.ny[x + i] = unit.y[i];
            row.nz[x + i] = unit.z[i];
            const bool usable = unit.x[i] != 0 || unit.y[i] != 0 || unit.z[i] != 0;
            lost += !usable && row.distance[x + i] > 0;
            row.distance[x + i] = usable ? row.distance[x + i] : Real{0};
        }
        return lost;
    }

private:
    static constexpr int rounded_up(int count) { return (count + group - 1) / group * group; }
    [[nodiscard]] std::size_t size() const
    {
        return static_cast<std::size_t>((slots_ + 1) * planes_ + 1) *
               static_cast<std::size_t>(stride_);
    }

    int width_, slots_, margin_, planes_;
    std::ptrdiff_t stride_;
    bool with_normals_;
};

/// Surfaces among `count` distances.
template <class Real>
[[nodiscard]] int count_surfaces(const Real* distances, int count)
{
    int surfaces = 0;
    for (int i = 0; i < count; ++i) surfaces += distances[i] > 0;
    return surfaces;
}

/// Counts the background of 16 pixels from x on, and their surfaces if they are spared.
template <class Real>
void count_pixels(Work& work, Background background, const GuideRow<Real>& row, int x, int width,
                  bool active)
{
    if (background == Background::none && active) return;
    const int count = (std::min)(WorkMap::group, width - x);
    const int surfaces = count_surfaces(row.distance + x, count);
    work.background += static_cast<std::uint64_t>(count - surfaces);
    if (!active) work.skipped += static_cast<std::uint64_t>(surfaces);
}

/// Writes the values of 16 pixels from x on.
template <class Real, class Out>
void write_group(const Real* values, const ImageView<Out>& image, int x, int y)
{
    const int count = (std::min)(WorkMap::group, image.width - x);
    Out* const out = &image(x, y);
    if (std::is_same_v<Out, Real> && image.pixel_stride == 1) {
        if (count == WorkMap::group) std::copy_n(values, WorkMap::group, out);
        else std::copy_n(values, count, out);
        return;
    }
    for (int i = 0; i < count; ++i) out[i * image.pixel_stride] = static_cast<Out>(values[i]);
}

/// Values that can be weighed: not NaN, not infinite, and not so large that a sum of differences could
/// be.
template <class L>
[[nodiscard]] NOOK_INLINE auto is_usable(const L& values)
{
    using Real = typename LanesTraits<L>::Value;
    using Bits = std::conditional_t<sizeof(Real) == 4, std::int32_t, std::int64_t>;
    constexpr Bits sign = (std::numeric_limits<Bits>::min)();
    constexpr Bits largest =
        sizeof(Real) == 4 ? Bits{0x71800000} : Bits(0x5f30000000000000);  // 2^100, 2^500
    return (std::bit_cast<Lanes<Bits, LanesTraits<L>::count>>(values) & ~sign) <= largest;
}

}  // namespace nook::inline NOOK_TARGET::detail
