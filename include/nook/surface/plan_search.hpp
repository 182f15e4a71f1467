#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <nook/surface/plan_cells.hpp>
#include <nook/surface/surface_pass.hpp>

/// How a planner proves that no sample of a tile rises above the tangent planes of its pixels.
///
/// A sample at Q counts for a pixel at X with normal n when n · (Q − X) exceeds what the kernel
/// forgives. With h = 1 / distance under perspective, (Q − centre) h = base + h direction, where base is
/// linear over the screen. So the height, scaled, is linear in place and in h, and largest where h is:
/// on the plane that bounds the cell, in one of its corners.
namespace nook::inline NOOK_TARGET::detail {

/// What a kernel forgives, and how far it looks; lengths are scaled. A sample does not count when its
/// height is at most bias + constant + per_square (v · v), or is less than `slope` times what it is
/// away on the screen, v being the vector to it.
struct PlanRule {
    ReachRule reach;
    double step_constant, step_linear, step_quadratic;  ///< of the depth buffer
    double fixed;                                       ///< β of the caller; negative: automatic
    /// Of the automatic bias: `rounding` of RiseRule. `unit` is half an ulp of 1 of the kernel's type.
    double rounding, radius, unit;
    double per_square = 0, constant = 0;
    double slope = 0;
    /// Samples farther from the pixel than the radius do not count.
    bool cut_off = false;
};

/// The rule for the pixels of one tile.
class TileRule {
public:
    TileRule(const PlanRule& rule, const PlanAxes& axes, const TangentBound& tile,
             const PlanRect& rect)
        : rule_{rule},
          axes_{axes},
          tile_{tile},
          rect_{rect}
    {
        const double x0 = axes.x(rect.left), x1 = axes.x(rect.right);
        const double y0 = axes.y(rect.bottom), y1 = axes.y(rect.top);
        middle_x_ = (x0 + x1) / 2;
        middle_y_ = (y0 + y1) / 2;
        half_x_ = (x1 - x0) / 2;
        half_y_ = (y1 - y0) / 2;
        const double size_x = (std::max)(std::fabs(x0), std::fabs(x1));
        const double size_y = (std::max)(std::fabs(y0), std::fabs(y1));
        // The length of rays at unit distance.
        const double ray = axes.orthographic ? 1 : std::sqrt(1 + size_x * size_x + size_y * size_y);
        const double reach =
            (std::min)(axes.orthographic ? rule.reach.radius : rule.reach.radius / tile.nearest,
                       rule.reach.largest);
        reach_x_ = reach * rule.reach.fx * (1 + 0x1p-16);
        reach_y_ = reach * rule.reach.fy * (1 + 0x1p-16);
        set_bias(ray);
        const double plane = (std::max)(tile.plane, 0.0);
        // The cosine between the normal and the direction to the viewer.
        facing_ = axes.orthographic ? least_facing() : plane / (ray * tile.farthest);
        ray_ = ray;
        slope_ = rule.slope * facing_ / ray;
    }
    /// Whether pixels of the tile look at a cell.
    [[nodiscard]] bool looks_at(const PlanRect& cell, const NearBound& bound) const
    {
        if (bound.empty()) return false;
        // Offsets are rounded to whole pixels, and one long at least along the axis that has more.
        const int across = apart(rect_.left, rect_.right, cell.left, cell.right);
        const int down = apart(rect_.top, rect_.bottom, cell.top, cell.bottom);
        const double dx = (std::max)(across - 1, 0) / reach_x_;
        const double dy = (std::max)(down - 1, 0) / reach_y_;
        if (dx * dx + dy * dy > 1 && (std::max)(across, down) > 2) return false;
        if (!rule_.cut_off) return true;
        const double farthest = axes_.orthographic ? -bound.least : 1 / bound.least;
        return tile_.nearest - farthest <= rule_.reach.radius * (1 + 0x1p-10);
    }
    /// Pixels between two rectangles, along the axis on which there are more; negative: they touch.
    [[nodiscard]] int distance(const PlanRect& cell) const
    {
        return (std::max)(apart(rect_.left, rect_.right, cell.left, cell.right),
                          apart(rect_.top, rect_.bottom, cell.top, cell.bottom));
    }
    /// The pixels to look at, at most.
    [[nodiscard]] PlanRect reached(int width, int height) const
    {
        const auto back = [](int at, double reach) {
            return at > reach ? static_cast<int>(at - reach) : 0;
        };
        const auto on = [](int at, double reach, int size) {
            return size - 1 - at > reach ? static_cast<int>(at + reach) : size - 1;
        };
        const double x = reach_x_ + 2, y = reach_y_ + 2;
        return {back(rect_.left, x), back(rect_.top, y), on(rect_.right, x, width),
                on(rect_.bottom, y, height)};
    }
    /// True when it is proven that no surface of the cell counts for any pixel of the tile.
    [[nodiscard]] bool clears(const PlanRect& cell, const NearBound& bound) const
    {
        // A linear bound from below helps where it holds well, and harms elsewhere.
        if (is_below(cell, bound, {{0, 0, 0}, 0, 0, 0, 0})) return true;
        return (slope_ > 0 || rule_.per_square > 0) &&
               is_below(cell, bound, forgiven_for(cell, bound));
    }

private:
    /// Lower bounds of v · v and of what a sample is away on the screen, as linear functions: of the
    /// scaled vector to it, of the scale, and of the screen.
    struct Forgiven {
        double vector[3], scale, x, y, constant;
    };

    [[nodiscard]] static int apart(int first, int last, int other_first, int other_last)
    {
        return (std::max)(other_first - last, first - other_last);
    }
    [[nodiscard]] double least_facing() const
    {
        return (std::max)(std::fabs(tile_.normal[2]) - tile_.spread, 0.0);
    }
    void set_bias(double ray)
    {
        // Float arithmetic of the kernels, step by step: 15 half ulps of |ray| |v|.
        const double error = 15 * ray * rule_.unit;
        // So that rounding of the bias itself does not matter.
        constexpr double share = 1 - 0x1p-18;
        const double nearest = tile_.nearest, plane = (std::max)(tile_.plane, 0.0);
        const double c = rule_.step_constant, l = rule_.step_linear, k = rule_.step_quadratic;
        if (rule_.fixed >= 0) {
            bias_ = share * rule_.fixed * nearest;
            error_ = error;
        } else {
            const double across = axes_.orthographic ? least_facing() : plane / tile_.farthest;
            if (axes_.orthographic) {
                bias_ = share * across * (2 * c + nearest * (l + nearest * k));
                per_distance_ = share * across * (l + nearest * k);
            } else {
                bias_ = share * (2 * c * across + plane * (2 * l + nearest * k));
                per_distance_ = share * plane * k;
            }
            // rounding (L + v·v / L) / 2 − error |v| is least at |v| = L error / rounding.
            const double length =
                axes_.orthographic ? rule_.radius : (std::min)(rule_.radius, nearest);
            bias_ += length * (rule_.rounding / 2 - error * error / (2 * rule_.rounding));
        }
        bias_ += rule_.per_square * rule_.constant;
        error_ += tile_.spread;
    }
    [[nodiscard]] Forgiven forgiven_for(const PlanRect& cell, const NearBound& bound) const
    {
        Forgiven result{{0, 0, 0}, 0, 0, 0, 0};
        const double x = (axes_.x(cell.left) + axes_.x(cell.right)) / 2;
        const double y = (axes_.y(cell.top) + axes_.y(cell.bottom)) / 2;
        const double dx = x - middle_x_, dy = y - middle_y_;
        if (slope_ > 0) {
            const double away = std::sqrt(dx * dx + dy * dy);
            const double ux = away > 0 ? dx / away : 0, uy = away > 0 ? dy / away : 0;
            const double half_x = (axes_.x(cell.right) - axes_.x(cell.left)) / 2;
            const double half_y = (axes_.y(cell.top) - axes_.y(cell.bottom)) / 2;
            const double both =
                std::fabs(ux) * (half_x_ + half_x) + std::fabs(uy) * (half_y_ + half_y);
            const double share = away > both ? slope_share(away - both) : 0;
            if (share > 0) {
                const double slope = slope_ * share;
                result.x = slope * ux;
                result.y = slope * uy;
                result.constant = -slope * (ux * middle_x_ + uy * middle_y_ +
                                            std::fabs(ux) * half_x_ + std::fabs(uy) * half_y_);
            }
        }
        if (rule_.per_square > 0 && distance(cell) > 0) {
            // v · v ≥ 2 m · v − m · m for any m: that of the middle of the cell.
            const double h = (std::max)(bound.at(x, y), bound.least);
            const double scale = axes_.orthographic ? 1 : h;
            double middle[3], square = 0, spread = 0;
            for (int k = 0; k < 3; ++k) {
                const double base = k == 0 ? base_x(x) : k == 1 ? base_y(y) : base_z();
                middle[k] = (base + h * direction(k)) / scale;
                square += middle[k] * middle[k];
                spread += std::fabs(middle[k]) * extent(k);
            }
            for (int k = 0; k < 3; ++k) result.vector[k] = 2 * rule_.per_square * middle[k];
            result.scale = -rule_.per_square * (square + 2 * spread);
        }
        return result;
    }
    /// What is left of a slope at least where samples lie half a pixel beside their slice, as seen from
    /// `away` on the screen: at grazing angles that moves them far along the tangent.
    [[nodiscard]] double slope_share(double away) const
    {
        const double off = std::sqrt(axes_.per_x * axes_.per_x + axes_.per_y * axes_.per_y) / 2;
        if (!(away > off)) return 0;
        const double sine = off / away, cosine = std::sqrt(1 - sine * sine);
        const double tilt = (1 - facing_ * facing_) * ray_ * ray_ / (facing_ * facing_);
        return 1 - sine * sine * tilt / (4 * cosine);
    }
    /// How far pixels of the tile lie from its centre along an axis.
    [[nodiscard]] double extent(int k) const
    {
        const double depth = tile_.farthest - tile_.nearest;
        if (k == 2) return depth;
        const double half = k == 0 ? half_x_ : half_y_, middle = k == 0 ? middle_x_ : middle_y_;
        if (axes_.orthographic) return 2 * half;
        return 2 * half * tile_.farthest + (std::fabs(middle) + half) * depth;
    }
    [[nodiscard]] double direction(int k) const
    {
        if (!axes_.orthographic) return -tile_.centre[k];
        return k == 2 ? 1 : 0;
    }
    [[nodiscard]] double base_z() const { return axes_.orthographic ? -tile_.centre[2] : -1; }
    [[nodiscard]] double base_x(double x) const
    {
        return axes_.orthographic ? x - tile_.centre[0] : x;
    }
    [[nodiscard]] double base_y(double y) const
    {
        return axes_.orthographic ? y - tile_.centre[1] : y;
    }
    /// Whether all that a cell may hold stays below what is forgiven.
    [[nodiscard]] bool is_below(const PlanRect& cell, const NearBound& bound,
                                const Forgiven& forgiven) const
    {
        const double x0 = axes_.x(cell.left), x1 = axes_.x(cell.right);
        const double y0 = axes_.y(cell.bottom), y1 = axes_.y(cell.top);
        const double x = (x0 + x1) / 2, half_x = (x1 - x0) / 2;
        const double y = (y0 + y1) / 2, half_y = (y1 - y0) / 2;
        const double h = bound.at(x, y);
        // How high above what is forgiven, scaled: in the middle of the cell, and by h, x and y.
        const double still = tile_.rise - bias_ - forgiven.scale;
        double by_h = axes_.orthographic ? per_distance_ : still;
        double over = by_h * h + (axes_.orthographic ? still : -per_distance_) -
                      (x * forgiven.x + y * forgiven.y + forgiven.constant);
        double by_x = -forgiven.x, by_y = -forgiven.y, error = 0, size = 0;
        for (int k = 0; k < 3; ++k) {
            const double own = direction(k), weight = tile_.normal[k] - forgiven.vector[k];
            const double v = (k == 0 ? base_x(x) : k == 1 ? base_y(y) : base_z()) + h * own;
            const double v_by_x = (k == 0 ? 1 : 0) + bound.a * own;
            const double v_by_y = (k == 1 ? 1 : 0) + bound.b * own;
            over += weight * v;
            size += std::fabs(own);
            by_h += weight * own;
            by_x += k == 0 ? weight : 0;
            by_y += k == 1 ? weight : 0;
            error += std::fabs(v) + std::fabs(v_by_x) * half_x + std::fabs(v_by_y) * half_y;
        }
        // What is nearer must stand higher, or the bound says nothing.
        if (!(by_h >= error_ * size)) return false;
        by_x += by_h * bound.a;
        by_y += by_h * bound.b;
        return over + std::fabs(by_x) * half_x + std::fabs(by_y) * half_y + error_ * error <= 0;
    }

    const PlanRule& rule_;
    const PlanAxes& axes_;
    const TangentBound& tile_;
    PlanRect rect_;
    double middle_x_, middle_y_, half_x_, half_y_;
    double reach_x_, reach_y_;
    double bias_ = 0, per_distance_ = 0, error_ = 0, slope_ = 0, facing_ = 0, ray_ = 1;
};

/// Cells that a tile has to look at.
struct PlanCandidates {
    struct Cell {
        int level, column, row;
    };
    static constexpr int most = 128;

    int count = 0;
    Cell cells[most];

    void add(const Cell& cell) { cells[count++] = cell; }
    [[nodiscard]] bool has_room(int more) const { return count + more <= most; }
};

/// Decides which tiles of a pyramid are worth work.
class PlanSearch {
public:
    PlanSearch(const PlanRule& rule, const PlanAxes& axes, const PlanPyramid& pyramid)
        : rule_{rule},
          axes_{axes},
          pyramid_{pyramid}
    {}
    /// Calls write(rect, active) for rectangles that make up a tile.
    template <class Write>
    void plan(int level, int column, int row, const Write& write) const
    {
        const PlanGrid& grid = pyramid_.grid;
        const TangentBound& tile = pyramid_.tiles[grid.index(level, column, row)];
        const PlanRect rect = grid.rect(level, column, row);
        if (tile.kind == TangentBound::Kind::nothing) {
            write(rect, false);
            return;
        }
        const bool open = tile.kind == TangentBound::Kind::flat &&
                          clears_all(level, column, row, TileRule{rule_, axes_, tile, rect});
        if (open || level == 0) {
            write(rect, !open);
            return;
        }
        grid.for_each_child(level, column, row,
                            [&](int i, int j) { plan(level - 1, i, j, write); });
    }

private:
    /// Whether nothing within reach counts for any pixel of the tile.
    [[nodiscard]] bool clears_all(int level, int column, int row, const TileRule& rule) const
    {
        const PlanGrid& grid = pyramid_.grid;
        // What a tile does to itself decides most cases.
        if (!clears({level, column, row}, rule)) return false;
        const PlanRect reached = rule.reached(grid.width, grid.height);
        // Cells so large that few of them matter.
        int cells = level;
        const auto cell_range = [&](int at) {
            return PlanRect{reached.left / PlanGrid::side(at), reached.top / PlanGrid::side(at),
                            reached.right / PlanGrid::side(at),
                            reached.bottom / PlanGrid::side(at)};
        };
        PlanRect range = cell_range(cells);
        while ((range.right - range.left > 4 || range.bottom - range.top > 4) &&
               cells + 1 < grid.levels)
            range = cell_range(++cells);
        PlanCandidates waiting;
        for (int j = range.top; j <= range.bottom; ++j)
            for (int i = range.left; i <= range.right; ++i) waiting.add({cells, i, j});
        while (waiting.count > 0) {
            const PlanCandidates::Cell cell = waiting.cells[--waiting.count];
            if (clears(cell, rule)) continue;
            // Cells smaller than the tile tell little more.
            if (cell.level <= level || !waiting.has_room(4)) return false;
            grid.for_each_child(cell.level, cell.column, cell.row, [&](int i, int j) {
                waiting.add({cell.level - 1, i, j});
            });
        }
        return true;
    }
    [[nodiscard]] bool clears(const PlanCandidates::Cell& cell, const TileRule& rule) const
    {
        const PlanGrid& grid = pyramid_.grid;
        const NearBound& bound = pyramid_.cells[grid.index(cell.level, cell.column, cell.row)];
        const PlanRect rect = grid.rect(cell.level, cell.column, cell.row);
        return !rule.looks_at(rect, bound) || rule.clears(rect, bound);
    }

    const PlanRule& rule_;
    const PlanAxes& axes_;
    const PlanPyramid& pyramid_;
};

}  // namespace nook::inline NOOK_TARGET::detail
