#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/depth/projection.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

/// What a planner keeps of an image: bounds of the surfaces in cells of pixels, and of their tangent
/// planes, in a pyramid.
namespace nook::inline NOOK_TARGET::detail {

/// A rectangle of pixels, last ones included.
struct PlanRect {
    int left, top, right, bottom;

    [[nodiscard]] std::uint64_t pixels() const
    {
        return static_cast<std::uint64_t>(right - left + 1) *
               static_cast<std::uint64_t>(bottom - top + 1);
    }
};

/// Cells of level 0 have 16 × 16 pixels; each next level doubles both sides.
struct PlanGrid {
    static constexpr int leaf = WorkMap::group, most_levels = 14;

    int width, height, levels;
    std::size_t first[most_levels + 1];

    PlanGrid(int image_width, int image_height) : width{image_width}, height{image_height}
    {
        levels = 0;
        std::size_t cells = 0;
        do {
            first[levels] = cells;
            cells +=
                static_cast<std::size_t>(columns(levels)) * static_cast<std::size_t>(rows(levels));
            ++levels;
        } while (levels < most_levels && (columns(levels - 1) > 1 || rows(levels - 1) > 1));
        for (int level = levels; level <= most_levels; ++level) first[level] = cells;
    }
    [[nodiscard]] static constexpr int side(int level) { return leaf << level; }
    [[nodiscard]] int columns(int level) const { return pieces(width, side(level)); }
    [[nodiscard]] int rows(int level) const { return pieces(height, side(level)); }
    [[nodiscard]] std::size_t size() const { return first[most_levels]; }
    [[nodiscard]] std::size_t index(int level, int column, int row) const
    {
        return first[level] +
               static_cast<std::size_t>(row) * static_cast<std::size_t>(columns(level)) +
               static_cast<std::size_t>(column);
    }
    [[nodiscard]] PlanRect rect(int level, int column, int row) const
    {
        const int left = column * side(level), top = row * side(level);
        return {left, top, (std::min)(width - left, side(level)) + left - 1,
                (std::min)(height - top, side(level)) + top - 1};
    }
    /// Calls f(column, row) for the cells of the level below that make up a cell.
    template <class F>
    void for_each_child(int level, int column, int row, const F& f) const
    {
        for (int j = 2 * row; j < 2 * row + 2 && j < rows(level - 1); ++j)
            for (int i = 2 * column; i < 2 * column + 2 && i < columns(level - 1); ++i) f(i, j);
    }
};

/// Where the centres of pixels lie: slopes of rays under perspective, scaled lengths otherwise.
struct PlanAxes {
    double per_x, per_y, cx, cy;
    bool orthographic;

    PlanAxes(const Projection& projection, double scale)
        : per_x{(projection.orthographic ? scale : 1) / projection.fx},
          per_y{(projection.orthographic ? scale : 1) / projection.fy},
          cx{projection.cx},
          cy{projection.cy},
          orthographic{projection.orthographic}
    {}
    [[nodiscard]] double x(double column) const { return (column + 0.5 - cx) * per_x; }
    [[nodiscard]] double y(double row) const { return (cy - row - 0.5) * per_y; }
};

/// Surfaces by how near they are: 1 / distance under perspective, where planes of space are planes
/// over the screen; −distance otherwise. All surfaces of a cell lie between `least` and
/// a x + b y + c, where x and y are those of PlanAxes.
struct NearBound {
    double a, b, c;
    double least;  ///< 0 when there is no surface

    [[nodiscard]] bool empty() const { return least == 0; }
    [[nodiscard]] double at(double x, double y) const { return a * x + b * y + c; }
};

/// The tangent planes of the pixels of a tile that share one normal. The plane of a pixel at X is
/// n · (Q − X) = 0; for all of them n · (centre − X) <= rise.
struct TangentBound {
    enum class Kind : std::uint8_t {
        nothing,  ///< no surfaces with normals
        flat,
        mixed  ///< several normals, or surfaces without: nothing is known
    };

    double normal[3];
    /// How far each component of a pixel's normal may be off.
    double spread;
    double centre[3];
    double rise;
    double nearest, farthest;  ///< distances
    double plane;              ///< the least distance of the viewer from a tangent plane
    Kind kind;
};

/// The bound of a cell from those of its children.
class NearMerger {
public:
    void add(const NearBound& child, const PlanRect& rect, const PlanAxes& axes)
    {
        if (child.empty()) return;
        Part& part = parts_[count_++];
        part.bound = child;
        part.x[0] = axes.x(rect.left);
        part.x[1] = axes.x(rect.right);
        part.y[0] = axes.y(rect.top);
        part.y[1] = axes.y(rect.bottom);
    }
    [[nodiscard]] NearBound bound() const
    {
        if (count_ == 0) return {0, 0, 0, 0};
        NearBound all{0, 0, 0, parts_[0].bound.least};
        for (int i = 0; i < count_; ++i) {
            all.a += parts_[i].bound.a / count_;
            all.b += parts_[i].bound.b / count_;
            all.least = (std::min)(all.least, parts_[i].bound.least);
        }
        bool first = true;
        for (int i = 0; i < count_; ++i)
            for (const double x : parts_[i].x)
                for (const double y : parts_[i].y) {
                    const double above = parts_[i].bound.at(x, y) - (all.a * x + all.b * y);
                    all.c = first ? above : (std::max)(all.c, above);
                    first = false;
                }
        return all;
    }

private:
    struct Part {
        NearBound bound;
        double x[2], y[2];
    };
    Part parts_[4];
    int count_ = 0;
};

/// Makes a bound hold for another tile too.
inline void merge(TangentBound& all, const TangentBound& more)
{
    using Kind = TangentBound::Kind;
    if (more.kind == Kind::nothing || all.kind == Kind::mixed) return;
    if (all.kind == Kind::nothing || more.kind == Kind::mixed) {
        all = more;
        return;
    }
    double apart = 0, off = 0;
    for (int k = 0; k < 3; ++k) {
        const double step = all.centre[k] - more.centre[k];
        apart += all.normal[k] * step + more.spread * std::fabs(step);
        off += std::fabs(all.normal[k] - more.normal[k]);
    }
    if (off != 0) {
        all.kind = Kind::mixed;
        return;
    }
    all.spread = (std::max)(all.spread, more.spread);
    all.rise = (std::max)(all.rise, more.rise + apart);
    all.nearest = (std::min)(all.nearest, more.nearest);
    all.farthest = (std::max)(all.farthest, more.farthest);
    all.plane = (std::min)(all.plane, more.plane);
}

/// The pyramids of an image, in memory of the caller.
struct PlanPyramid {
    PlanGrid grid;
    NearBound* cells = nullptr;
    TangentBound* tiles = nullptr;

    PlanPyramid(int width, int height) : grid{width, height} {}
    void take(ScratchLayout& block)
    {
        cells = block.take<NearBound>(grid.size());
        tiles = block.take<TangentBound>(grid.size());
    }
    /// Fills the levels above the lowest.
    void merge_up(const PlanAxes& axes) const
    {
        for (int level = 1; level < grid.levels; ++level)
            for (int row = 0; row < grid.rows(level); ++row)
                for (int column = 0; column < grid.columns(level); ++column) {
                    NearMerger merger;
                    TangentBound tile{};
                    grid.for_each_child(level, column, row, [&](int i, int j) {
                        const std::size_t child = grid.index(level - 1, i, j);
                        merger.add(cells[child], grid.rect(level - 1, i, j), axes);
                        merge(tile, tiles[child]);
                    });
                    cells[grid.index(level, column, row)] = merger.bound();
                    tiles[grid.index(level, column, row)] = tile;
                }
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
