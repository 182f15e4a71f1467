#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>

#include <nook/target.hpp>

/// The curtain in flat-land: where ambient occlusion with a radius lights up the ground right under a
/// hanging object, and what secondary rays do about it, in closed form.
///
/// Fridvalszky & Toth 2022 hang a box over the ground and plot the angle that an observer below it
/// sees open. Their equation is taken here with these corrections:
/// - The visible angle is not the openness "apart from 1/π": it has no cosine weight.
///   `flat_land_openness` has it.
/// - The brightest ground is not right under the box. For any width > 0 the curve has a local minimum
///   there, and rises to two equal maxima under the edges, where it is too bright.
/// - In the plane the first secondary ray, perpendicular to the primary and the normal, never hits.
///   With the weight 1 − closed/2 the false highlight is therefore about halved, not removed; in space
///   it does go, where both directions count.
/// - Secondary rays of length R′ around R/2 see nothing of a box that hangs at √(R²/4 + R′²) or above,
///   although the artefact is there up to R.
///
/// Angles are in radians from the vertical, positive towards +x. All functions are even in the
/// position, and scale with their lengths. Lengths from 1e-150 to 1e150 are told apart; infinity counts
/// as 1e150. A curtain with a negative or NaN member, or a radius of 0, hides nothing from anybody, and
/// nothing is hidden from a position that is NaN.

namespace nook {

/// The ground is y = 0, the box fills |x| <= width/2, bottom <= y <= bottom + height, and hides what
/// lies behind it up to `radius` from the observer, that distance included. In space it is endless
/// along the third axis. One unit of length for all, >= 0.
struct FlatLandCurtain {
    double width = 1;
    double bottom = 5;
    double height = 100;
    double radius = 25;
};

/// What `left` to `right` hides; empty where they are equal.
struct FlatLandInterval {
    double left = 0, right = 0;
};

/// Three ways to weigh the open directions.
enum class FlatLandMeasure : std::uint8_t {
    angle,   ///< `flat_land_visible_angle`
    cosine,  ///< `flat_land_openness`
    space    ///< `curtain_openness`
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// True when every member is a number >= 0 and the radius is not 0.
[[nodiscard]] bool is_flat_land_curtain(const FlatLandCurtain& curtain);

/// The directions that the box hides from an observer at (position, 0).
[[nodiscard]] FlatLandInterval flat_land_hidden(const FlatLandCurtain& curtain, double position);

/// V, the angle that is left of π: the paper's curve. In [0, π].
[[nodiscard]] double flat_land_visible_angle(const FlatLandCurtain& curtain, double position);

/// V′: the same with secondary rays, segments of ±secondary_radius across an open primary ray at half
/// the radius. A primary whose segment in the plane meets the box counts `kept` in [0, 1]: 1/2 for
/// the weight 1 − closed/2 of two segments, of which the other never hits; 0 for the one in the plane
/// alone. At least kept · V. V itself when secondary_radius is 0, negative or NaN, when `kept` is NaN,
/// or with an infinite radius, which has no half.
[[nodiscard]] double flat_land_visible_angle(const FlatLandCurtain& curtain, double position,
                                             double secondary_radius, double kept = 0.5);

/// The cosine-weighted openness of flat-land, in [0, 1].
[[nodiscard]] double flat_land_openness(const FlatLandCurtain& curtain, double position);

/// The cosine-weighted openness in space, in [0, 1]: what ray-traced ambient occlusion converges to.
[[nodiscard]] double curtain_openness(const FlatLandCurtain& curtain, double position);

/// True when the ground under the edges of the box is brighter than all around it: the artefact. With
/// T = min(bottom + height, radius): in angles width² < bottom (T − bottom), with cosines
/// width² < (bottom² T)^(2/3) − bottom².
[[nodiscard]] bool flat_land_has_false_maximum(const FlatLandCurtain& curtain,
                                               FlatLandMeasure measure = FlatLandMeasure::angle);

/// The position >= width/2 where least is visible, to the last digits; width/2 itself when there is no
/// false maximum, and 0 for what is no curtain.
[[nodiscard]] double flat_land_darkest(const FlatLandCurtain& curtain,
                                       FlatLandMeasure measure = FlatLandMeasure::angle);

/// The same in angles for a thin curtain that is at least as tall as the radius, in closed form:
/// √((m √(5 m² + 4 R²) − 3 m²) / 2). 0 unless 0 < bottom < radius.
[[nodiscard]] double flat_land_darkest_thin(double bottom, double radius);

/// How much brighter the false maximum is than the darkest place; 0 where there is none. In radians
/// for angles.
[[nodiscard]] double flat_land_contrast(const FlatLandCurtain& curtain,
                                        FlatLandMeasure measure = FlatLandMeasure::angle);

namespace detail::flat_land {

inline constexpr double endless = 1e150;

/// A number from 0 to infinity, judged by its bits: -ffast-math assumes that there are no NaNs.
[[nodiscard]] constexpr bool is_length(double value)
{
    const auto bits = std::bit_cast<std::uint64_t>(value);
    return bits <= std::uint64_t{0x7ff} << 52 || bits == std::uint64_t{1} << 63;
}
[[nodiscard]] constexpr bool is_nan(double value)
{
    return (std::bit_cast<std::uint64_t>(value) & ~(std::uint64_t{1} << 63)) > std::uint64_t{0x7ff}
                                                                                   << 52;
}

[[nodiscard]] constexpr double finite(double length) { return length < endless ? length : endless; }

/// The other leg of a right triangle, 0 where there is none.
[[nodiscard]] inline double other_leg(double hypotenuse, double leg)
{
    // Two roots, since the product may leave the range.
    return hypotenuse > leg ? std::sqrt(hypotenuse - leg) * std::sqrt(hypotenuse + leg) : 0;
}

/// A curtain in units of its radius, seen from a position >= 0; `radius` is 1, or 0 for what hides
/// nothing.
struct UnitCurtain {
    double width, bottom, top, radius, position;

    UnitCurtain(const FlatLandCurtain& curtain, double at)
    {
        width = bottom = top = radius = position = 0;
        if (!is_flat_land_curtain(curtain) || is_nan(at)) return;
        const double unit = finite(curtain.radius);
        // Again after the division: the unit may be tiny.
        const auto scaled = [&](double length) { return finite(finite(length) / unit); };
        width = scaled(curtain.width);
        bottom = scaled(curtain.bottom);
        top = bottom + scaled(curtain.height);
        position = scaled(std::fabs(at));
        radius = 1;
    }
    /// Half the width of the disc of the radius where the box begins; 0 when it hangs above.
    [[nodiscard]] double reach() const { return other_leg(radius, bottom); }
    /// Where the sides of the box lie as seen from the observer.
    [[nodiscard]] double near_side() const { return position - width / 2; }
    [[nodiscard]] double far_side() const { return position + width / 2; }

    /// From the near side, on the right, to the far one.
    [[nodiscard]] FlatLandInterval hidden() const
    {
        const double aside = near_side(), half = reach();
        if (bottom >= radius || aside >= half) return {};
        const double far_end = far_side() < half ? far_side() : half;
        FlatLandInterval result{-std::atan2(far_end, bottom), 0};
        if (aside < 0) {
            result.right = std::atan2(-aside < half ? -aside : half, bottom);
        } else {
            const double highest = other_leg(radius, aside);
            result.right = -std::atan2(aside, top < highest ? top : highest);
        }
        if (result.right < result.left) result.right = result.left;
        return result;
    }
};

/// The area of the unit disc beyond a line at a distance >= 0 from its centre; 0 from 1 on.
[[nodiscard]] inline double disc_segment(double distance)
{
    const double leg = other_leg(1, distance);
    return std::atan2(leg, distance) - distance * leg;
}

/// The slope of what the box hides over the position, up to a positive factor, at `aside` >= 0 from
/// its near side. It changes its sign once at most, from plus to minus.
[[nodiscard]] inline double hidden_slope(const UnitCurtain& curtain, FlatLandMeasure measure,
                                         double aside)
{
    const double m = curtain.bottom, out = aside + curtain.width;
    const double near_edge = std::hypot(aside, m), far_edge = std::hypot(out, m),
                 top_edge = std::hypot(aside, curtain.top);
    const double far_cosine = m / far_edge;
    const bool below_disc = top_edge < 1;
    if (measure == FlatLandMeasure::angle) {
        const double far_end = far_edge < 1 ? far_cosine / far_edge : 0;
        return far_end - (below_disc ? curtain.top / top_edge / top_edge : 1 / other_leg(1, aside));
    }
    if (measure == FlatLandMeasure::cosine) {
        const double far_end = far_edge < 1 ? far_cosine * far_cosine / far_edge : 0;
        const double top_cosine = curtain.top / top_edge;
        return far_end - (below_disc ? top_cosine * top_cosine / top_edge : 1);
    }
    // The derivative of `curtain_openness`, term by term.
    const auto chord = [](double distance) {
        const double leg = other_leg(1, distance);
        return std::atan2(leg, distance) + distance * leg;
    };
    const double far_end = far_edge < 1 ? far_cosine * far_cosine / far_edge * chord(far_edge) : 0;
    const double near_end = 2 * other_leg(1, near_edge);
    double above = 0;
    if (below_disc) {
        const double top_cosine = curtain.top / top_edge, sine = aside / top_edge;
        above = top_cosine * top_cosine / top_edge * disc_segment(top_edge) -
                2 * sine * sine * other_leg(1, top_edge);
    }
    return far_end - near_end - above;
}

/// True when the segment from (x0, y0) to (x1, y1) meets the box.
[[nodiscard]] inline bool meets_box(const UnitCurtain& curtain, double x0, double y0, double x1,
                                    double y1)
{
    double first = 0, last = 1;
    const auto clip = [&](double from, double to, double low, double high) {
        const double step = to - from;
        if (step == 0) return low <= from && from <= high;
        const double a = (low - from) / step, b = (high - from) / step;
        const double in = a < b ? a : b, out = a < b ? b : a;
        if (in > first) first = in;
        if (out < last) last = out;
        return first <= last;
    };
    return clip(x0, x1, -curtain.far_side(), -curtain.near_side()) &&
           clip(y0, y1, curtain.bottom, curtain.top);
}

/// All angles at which the set of secondary segments that meet the box can begin or end, ascending.
class Breaks {
public:
    Breaks(const UnitCurtain& curtain, double secondary, const FlatLandInterval& hidden)
    {
        constexpr double pi = std::numbers::pi;
        for (const double angle : {-pi / 2, pi / 2, hidden.left, hidden.right}) add(angle);
        // An end of the segment passes a side of the box, above the ground.
        const double end = std::hypot(0.5, secondary), turn = std::atan2(secondary, 0.5);
        const double sides[2] = {-curtain.far_side(), -curtain.near_side()};
        const double floors[2] = {curtain.bottom, curtain.top};
        for (const double ahead : {-turn, turn}) {
            for (const double side : sides)
                if (std::fabs(side) <= end) add(std::asin(side / end) - ahead);
            for (const double level : floors) {
                if (level > end) continue;
                const double angle = std::acos(level / end);
                add(angle - ahead);
                add(-angle - ahead);
            }
        }
        // Its line passes a corner.
        for (const double side : sides) {
            for (const double level : floors) {
                const double distance = std::hypot(side, level);
                if (distance < 0.5) continue;
                const double angle = std::atan2(side, level), apart = std::acos(0.5 / distance);
                add(angle - apart);
                add(angle + apart);
            }
        }
    }
    [[nodiscard]] int count() const { return count_; }
    [[nodiscard]] double operator[](int i) const { return angles_[i]; }

private:
    void add(double angle)
    {
        if (std::fabs(angle) > std::numbers::pi / 2) return;
        int at = count_++;
        for (; at > 0 && angles_[at - 1] > angle; --at) angles_[at] = angles_[at - 1];
        angles_[at] = angle;
    }

    double angles_[4 + 2 * (2 + 2 * 2) + 4 * 2] = {};
    int count_ = 0;
};

[[nodiscard]] inline double measured(const FlatLandCurtain& curtain, double position,
                                     FlatLandMeasure measure)
{
    switch (measure) {
    case FlatLandMeasure::cosine: return flat_land_openness(curtain, position);
    case FlatLandMeasure::space: return curtain_openness(curtain, position);
    default: return flat_land_visible_angle(curtain, position);
    }
}

}  // namespace detail::flat_land

inline bool is_flat_land_curtain(const FlatLandCurtain& curtain)
{
    return detail::flat_land::is_length(curtain.width) &&
           detail::flat_land::is_length(curtain.bottom) &&
           detail::flat_land::is_length(curtain.height) &&
           detail::flat_land::is_length(curtain.radius) && curtain.radius > 0;
}

inline FlatLandInterval flat_land_hidden(const FlatLandCurtain& curtain, double position)
{
    const FlatLandInterval seen = detail::flat_land::UnitCurtain{curtain, position}.hidden();
    if (position < 0) return {-seen.right, -seen.left};
    return seen;
}

inline double flat_land_visible_angle(const FlatLandCurtain& curtain, double position)
{
    const FlatLandInterval hidden = detail::flat_land::UnitCurtain{curtain, position}.hidden();
    const double visible = std::numbers::pi - (hidden.right - hidden.left);
    return visible > 0 ? (visible < std::numbers::pi ? visible : std::numbers::pi) : 0;
}

inline double flat_land_visible_angle(const FlatLandCurtain& curtain, double position,
                                      double secondary_radius, double kept)
{
    const double plain = flat_land_visible_angle(curtain, position);
    const detail::flat_land::UnitCurtain unit{curtain, position};
    const bool used = unit.radius > 0 && curtain.radius < detail::flat_land::endless &&
                      detail::flat_land::is_length(secondary_radius) && secondary_radius > 0 &&
                      !detail::flat_land::is_nan(kept);
    if (!used) return plain;
    const double secondary =
        detail::flat_land::finite(detail::flat_land::finite(secondary_radius) / curtain.radius);
    const FlatLandInterval hidden = unit.hidden();
    const detail::flat_land::Breaks breaks{unit, secondary, hidden};
    // Between two breaks all primary rays share one fate.
    double closed = 0;
    for (int i = 0; i + 1 < breaks.count(); ++i) {
        const double middle = (breaks[i] + breaks[i + 1]) / 2;
        if (hidden.left <= middle && middle <= hidden.right) continue;
        const double sine = std::sin(middle), cosine = std::cos(middle);
        if (detail::flat_land::meets_box(
                unit, sine / 2 - secondary * cosine, cosine / 2 + secondary * sine,
                sine / 2 + secondary * cosine, cosine / 2 - secondary * sine))
            closed += breaks[i + 1] - breaks[i];
    }
    const double share = kept > 0 ? (kept < 1 ? kept : 1) : 0;
    const double visible = plain - (1 - share) * closed;
    return visible > 0 ? (visible < plain ? visible : plain) : 0;
}

inline double flat_land_openness(const FlatLandCurtain& curtain, double position)
{
    const FlatLandInterval hidden = detail::flat_land::UnitCurtain{curtain, position}.hidden();
    // Half the difference of the sines of the ends.
    const double open =
        1 - std::cos((hidden.right + hidden.left) / 2) * std::sin((hidden.right - hidden.left) / 2);
    return open > 0 ? open : 0;
}

inline double curtain_openness(const FlatLandCurtain& curtain, double position)
{
    const detail::flat_land::UnitCurtain unit{curtain, position};
    const double m = unit.bottom, reach = unit.reach(), aside = unit.near_side();
    if (m >= unit.radius || aside >= reach) return 1;
    // Areas in the unit disc that the directions project to (Nusselt), times 1 and divided by π at
    // last. Under a level plane at m, a strip from 0 to x shows as far as the disc of the radius
    // reaches, and then to the ellipse of its edge.
    const auto within_disc = [&](double x) {
        const double leg = detail::flat_land::other_leg(1, std::hypot(x, m));
        return x * leg + reach * reach * std::atan2(x, leg);
    };
    const auto beyond_disc = [](double x, double level) {
        const double edge = std::hypot(x, level);
        return edge > 0 && edge < 1 ? x / edge * detail::flat_land::disc_segment(edge) : 0;
    };
    const auto strip = [&](double x) {
        return x < reach ? within_disc(x) + beyond_disc(x, m)
                         : std::numbers::pi / 2 * reach * reach;
    };
    double hidden = strip(unit.far_side());
    // Beside the box its side adds the strip of the wall from m up to the top, whose lower ellipse is
    // the one that ends the strip of the bottom: they cancel.
    if (aside < 0) hidden += strip(-aside);
    else hidden -= within_disc(aside) + beyond_disc(aside, unit.top);
    const double open = 1 - hidden / std::numbers::pi;
    return open > 0 ? (open < 1 ? open : 1) : 0;
}

inline bool flat_land_has_false_maximum(const FlatLandCurtain& curtain, FlatLandMeasure measure)
{
    const detail::flat_land::UnitCurtain unit{curtain, 0};
    const double m = unit.bottom, top = unit.top < 1 ? unit.top : 1;
    if (unit.radius == 0 || m == 0 || m >= top) return false;
    if (measure == FlatLandMeasure::space)
        return detail::flat_land::hidden_slope(unit, measure, 0) > 0;
    const double width_squared = unit.width * unit.width;
    if (measure == FlatLandMeasure::cosine)
        return width_squared < std::pow(m * m * top, 2 / 3.0) - m * m;
    return width_squared < m * (top - m);
}

inline double flat_land_darkest(const FlatLandCurtain& curtain, FlatLandMeasure measure)
{
    if (!is_flat_land_curtain(curtain)) return 0;
    if (!flat_land_has_false_maximum(curtain, measure)) return curtain.width / 2;
    const detail::flat_land::UnitCurtain unit{curtain, 0};
    // More is hidden as one leaves the edge, and less at last: halve to the last bit.
    double rising = 0, falling = unit.reach();
    for (int i = 0; i < 1100; ++i) {
        const double middle = (rising + falling) / 2;
        if (middle <= rising || middle >= falling) break;
        (detail::flat_land::hidden_slope(unit, measure, middle) > 0 ? rising : falling) = middle;
    }
    return (unit.width / 2 + rising) * detail::flat_land::finite(curtain.radius);
}

inline double flat_land_darkest_thin(double bottom, double radius)
{
    const detail::flat_land::UnitCurtain unit{{0, bottom, radius, radius}, 0};
    const double m = unit.bottom;
    if (unit.radius == 0 || m == 0 || m >= 1) return 0;
    return std::sqrt((m * std::sqrt(5 * m * m + 4) - 3 * m * m) / 2) *
           detail::flat_land::finite(radius);
}

inline double flat_land_contrast(const FlatLandCurtain& curtain, FlatLandMeasure measure)
{
    if (!flat_land_has_false_maximum(curtain, measure)) return 0;
    const double bright = detail::flat_land::measured(curtain, curtain.width / 2, measure);
    const double dark =
        detail::flat_land::measured(curtain, flat_land_darkest(curtain, measure), measure);
    return bright > dark ? bright - dark : 0;
}

}  // namespace nook::inline NOOK_TARGET
