#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <nook/surface/height_field.hpp>
#include <nook/surface/slice_slopes.hpp>

/// Walks over a height field that collect what it hides from a pixel.
namespace nook::inline NOOK_TARGET::detail {

/// A walk along one half of a slice: columns of solid become intervals of slopes.
///
/// Lengths are in units of the pixel's distance under perspective, and of the world under
/// orthography. In the plane of the slice, with axes towards the viewer and outwards, step j crosses the
/// view ray
///     (a j − e (L − a j), b j + e b j)  under perspective,    (−e, b j)  under orthography,
/// where e is the depth beyond the pixel's own, L the length of its view ray for a depth of 1 (1 under
/// orthography), and (a, b) a pixel's step at that depth.
struct SliceWalk {
    const HeightField& field;
    bool orthographic, bounded, solid;

    double height, distance;   ///< of the pixel
    double ray;                ///< L
    double radius, thickness;  ///< in the units above
    double own_error;          ///< the step at the pixel's height
    double bias;               ///< in the units above; negative: automatic

    double a = 0, b = 0;
    const SliceArc* arc = nullptr;
    SlopeUnion* hidden = nullptr;

    /// The depth of a surface beyond the pixel, with the bias; false when it leaves the range.
    /// `error`: the depth step at the pixels that the height comes from, as a step of heights.
    [[nodiscard]] bool depth_below(double top, double error, double& e) const
    {
        if (bias >= 0) {
            e = (orthographic ? height - top : (height - top) / top) + bias;
            return true;
        }
        // Heights are off by half a step. Extrapolation to the edge of a pixel multiplies that by 4 at
        // most; the error of the pixel's own depth moves its tangent plane in proportion to distance.
        const double lower =
            top - 3 * error - (orthographic ? own_error : own_error * (top / height));
        e = orthographic ? height - lower : (height - lower) / lower;
        return orthographic || lower > 0;
    }

    /// The slopes that the column at step j (halves occur) below a height hides; false for none.
    [[nodiscard]] bool column(double j, double top, double error, SlopeInterval& slopes) const
    {
        double first = 0;
        if (!depth_below(top, error, first)) return false;
        double last = first + thickness;
        const double back = ray - a * j, side = orthographic ? 0 : b * j;
        bool endless = !solid;
        if (bounded) {
            const double square = back * back + side * side, apart = b * j * ray;
            const double rest = square * radius * radius - apart * apart;
            if (!(rest > 0)) return false;
            const double middle = j * (a * back - b * side), half = std::sqrt(rest);
            const double enter = (middle - half) / square, leave = (middle + half) / square;
            if (first < enter) first = enter;
            if (endless || last > leave) last = leave;
            endless = false;
        }
        if (!endless && !(first < last)) return false;
        const auto slope = [&](double depth) {
            return (a * j - depth * back) / (b * j + depth * side);
        };
        slopes.low = endless ? (orthographic ? -steepest_slope : -back / side) : slope(last);
        slopes.high = slope(first);
        return true;
    }
    void add(double low, double high) const
    {
        low = (std::max)(low, arc->low());
        high = (std::min)(high, arc->high());
        if (low < high) hidden->add(low, high);
    }

    /// The first step that does not come within the radius.
    [[nodiscard]] int reach(int limit) const
    {
        if (!bounded) return limit;
        double steps = limit;
        if (orthographic) {
            steps = radius / b;
        } else if (radius < ray) {
            const double slope = radius / std::sqrt((ray - radius) * (ray + radius));
            const double growth = b + slope * a;
            if (growth * limit > slope * ray) steps = slope * ray / growth;
        }
        // And one more: what lies between them may come within it.
        return steps < limit ? static_cast<int>(steps) + 1 : limit;
    }

    /// A walk from a pixel in `direction` ±1 along the axis, `tilt` pixels to the side per step.
    struct Course {
        const HeightField::Axis& axis;
        int place, side, direction;
        double tilt;
    };
    /// One crossing of it.
    struct Step {
        HeightField::Crossing crossing;
        int place;
        bool surface;
        double error;  ///< the depth step there, as a step of heights
    };
    [[nodiscard]] Step step_at(const Course& course, int place, double side) const
    {
        Step step{field.crossing(course.axis, place, side), place, false, 0};
        step.surface = orthographic ? step.crossing.height != 0 : step.crossing.height > 0;
        return step;
    }
    [[nodiscard]] double error_at(const HeightField::Crossing& crossing) const
    {
        return (std::max)(field.step(field[crossing.nearest]), field.step(field[crossing.other]));
    }
    /// The height half a step `ahead` of a crossing (±1), as the pixels beyond it or beside these
    /// continue; false where none are joined.
    [[nodiscard]] bool edge_of(const Course& course, const Step& step, int ahead, double& height_at,
                               double& error) const
    {
        const auto& crossing = step.crossing;
        const int beyond = -ahead * course.direction;
        // Per step of the walk, away from the edge.
        double gradient = -ahead * course.tilt * crossing.gradient;
        bool known = false;
        for (const std::ptrdiff_t at : {crossing.nearest, crossing.other})
            for (const int way : {beyond, -beyond}) {
                if (known || (at != crossing.nearest && !crossing.beside)) continue;
                const std::ptrdiff_t next = field.next_along(course.axis, step.place, at, way);
                if (next == at) continue;
                known = true;
                gradient += way == beyond ? field[next] - field[at] : field[at] - field[next];
                error = (std::max)(error, field.step(field[next]));
            }
        height_at = crossing.height - gradient / 2;
        return known;
    }

    /// The slope where the surface leaves the radius between two joined crossings, the ones at j − 1 and
    /// j; false where it does not.
    [[nodiscard]] bool leaving(double j, const Step& before, const Step& step, double& slope) const
    {
        if (!bounded || !before.surface || !step.surface) return false;
        struct Point {
            double out, up;
        };
        const auto point = [&](double at, const Step& of, Point& result) {
            double e = 0;
            if (at == 0) result = {0, 0};
            else if (!depth_below(of.crossing.height, error_at(of.crossing), e)) return false;
            else result = {b * at * (orthographic ? 1 : 1 + e), a * at - e * (ray - a * at)};
            return true;
        };
        Point p{}, q{};
        if (!point(j - 1, before, p) || !point(j, step, q)) return false;
        const double inside = radius * radius - (p.out * p.out + p.up * p.up);
        if (inside <= 0 || q.out * q.out + q.up * q.up <= radius * radius) return false;
        const double du = q.out - p.out, dv = q.up - p.up;
        const double square = du * du + dv * dv, along = p.out * du + p.up * dv;
        const double part = (std::sqrt(along * along + square * inside) - along) / square;
        const double out = p.out + part * du;
        if (!(out > 0)) return false;
        slope = (p.up + part * dv) / out;
        return true;
    }

    /// Walks over solids without end: what lies below the highest slope so far needs no look. Returns
    /// the crossings looked at.
    [[nodiscard]] int walk_endless(const Course& course) const
    {
        const HeightField::Axis& axis = course.axis;
        const int place = course.place, side = course.side, direction = course.direction;
        const int steps = reach(direction > 0 ? axis.length - 1 - place : place);
        const double scale = orthographic ? 1 : ray * distance;
        // All directions below this slope are hidden, or under the horizon of the pixel.
        double closed = arc->low(), drop = a - b * closed;
        const auto visible = [&](double j, double top) {
            return (top - height) * scale + j * drop > 0;
        };
        const auto hide = [&](double j, double top, double error) {
            SlopeInterval slopes{};
            if (!visible(j, top) || !column(j, top, error, slopes)) return;
            add(slopes.low, slopes.high);
            closed = hidden->closed_above(arc->low());
            drop = a - b * closed;
        };
        const std::ptrdiff_t own = place * axis.along + side * axis.across;
        Step before{{height, 0, own, own, false}, place, true, 0};
        double climb = 0;  // over the last step
        int j = 1;
        for (; j <= steps; ++j) {
            const double at_side = side + j * course.tilt;
            if (at_side < -0.5 || at_side >= axis.breadth - 0.5) break;
            const Step step = step_at(course, place + j * direction, at_side);
            const double top = step.crossing.height;
            const auto torn = [&] {
                return !before.surface || !step.surface ||
                       !field.joined(axis, before.crossing.nearest, step.crossing.nearest,
                                     direction);
            };
            double edge = 0;
            // Where the last surface ends, if it rises to there.
            if (climb > 0 && (!step.surface || top < before.crossing.height) &&
                visible(j - 0.5, before.crossing.height + climb / 2) && torn()) {
                double error = error_at(before.crossing);
                if (edge_of(course, before, 1, edge, error)) hide(j - 0.5, edge, error);
            }
            if (step.surface && visible(top > height ? j - 0.5 : j, top)) {
                double error = error_at(step.crossing), slope = 0;
                const bool higher = visible(j, top);
                hide(j, top, error);
                if (higher && bounded && !torn() && leaving(j, before, step, slope)) {
                    add(closed, slope);
                    closed = hidden->closed_above(arc->low());
                    drop = a - b * closed;
                }
                // Where this one begins, if the walk does not come from it.
                if ((!before.surface || top > before.crossing.height) && torn() &&
                    edge_of(course, step, -1, edge, error) && (orthographic || edge > 0))
                    hide(j - 0.5, edge, error);
            }
            climb = before.surface && step.surface ? top - before.crossing.height : 0;
            before = step;
        }
        return j - 1;
    }

    /// Walks over solids of finite thickness: between columns of one surface they are solid too.
    [[nodiscard]] int walk_sheets(const Course& course) const
    {
        const HeightField::Axis& axis = course.axis;
        const int place = course.place, side = course.side, direction = course.direction;
        const int steps = reach(direction > 0 ? axis.length - 1 - place : place);
        const double scale = orthographic ? 1 : ray * distance;
        struct Column {
            bool present;
            SlopeInterval slopes;
        };
        const auto column_at = [&](double j, double top, double error) {
            // What is hidden below this slope, or lies under the horizon, stays so.
            const double closed = hidden->closed_above(arc->low());
            if ((top - height) * scale + j * (a - b * closed) <= 0)
                return Column{true, {closed, closed}};
            Column result{};
            result.present = (orthographic || top > 0) && column(j, top, error, result.slopes);
            return result;
        };
        const auto link = [&](const Column& p, const Column& q) {
            if (p.present && q.present)
                add((std::min)(p.slopes.low, q.slopes.low),
                    (std::max)(p.slopes.high, q.slopes.high));
            else if (p.present) add(p.slopes.low, p.slopes.high);
            else if (q.present) add(q.slopes.low, q.slopes.high);
        };
        const auto edge_column = [&](double j, const Step& step, int ahead) {
            double top = 0, error = step.error;
            static_cast<void>(edge_of(course, step, ahead, top, error));
            return column_at(j, top, error);
        };
        const std::ptrdiff_t own = place * axis.along + side * axis.across;
        Step before{{height, 0, own, own, false}, place, true, 0};
        Column last{true, {-steepest_slope, -steepest_slope}};
        int j = 1;
        for (; j <= steps; ++j) {
            const double at_side = side + j * course.tilt;
            if (at_side < -0.5 || at_side >= axis.breadth - 0.5) break;
            Step step = step_at(course, place + j * direction, at_side);
            if (step.surface) step.error = error_at(step.crossing);
            const bool joined =
                before.surface && step.surface &&
                field.joined(axis, before.crossing.nearest, step.crossing.nearest, direction);
            if (before.surface && !joined && j > 1) link(last, edge_column(j - 0.5, before, 1));
            if (step.surface) {
                const Column now = column_at(j, step.crossing.height, step.error);
                double slope = 0;
                if (joined && last.present && leaving(j, before, step, slope))
                    link(last, {true, {slope, slope}});
                link(joined ? last : edge_column(j - 0.5, step, -1), now);
                last = now;
            }
            before = step;
        }
        return j - 1;
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
