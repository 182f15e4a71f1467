#pragma once

#include <algorithm>
#include <cmath>

#include <nook/target.hpp>

/// Directions in half a slice of the hemisphere, and what they weigh.
namespace nook::inline NOOK_TARGET::detail {

/// Directions t in a half slice, 0 … π from the viewer, by their slope cot t: monotone, and without
/// trigonometry. This stands for the infinite ones.
inline constexpr double steepest_slope = 1e100;

struct SlopeInterval {
    double low, high;
};

/// A union of intervals: disjoint, from the highest down. Most grow the lowest.
class SlopeUnion {
public:
    explicit SlopeUnion(SlopeInterval* memory) : intervals_{memory} {}

    void clear() { count_ = 0; }
    void add(double low, double high)
    {
        int last = count_;
        while (last > 0 && intervals_[last - 1].high < low) --last;
        int first = last;
        while (first > 0 && intervals_[first - 1].low <= high) {
            --first;
            low = (std::min)(low, intervals_[first].low);
            high = (std::max)(high, intervals_[first].high);
        }
        // [first, last) becomes one.
        const int shift = 1 - (last - first);
        if (shift > 0)
            for (int i = count_; i > last; --i) intervals_[i] = intervals_[i - 1];
        if (shift < 0)
            for (int i = last; i < count_; ++i) intervals_[i + shift] = intervals_[i];
        count_ += shift;
        intervals_[first] = {low, high};
    }
    /// The upper end of the interval that starts at `low`, or `low`.
    [[nodiscard]] double closed_above(double low) const
    {
        return count_ > 0 && intervals_[count_ - 1].low <= low ? intervals_[count_ - 1].high : low;
    }
    [[nodiscard]] const SlopeInterval* begin() const { return intervals_; }
    [[nodiscard]] const SlopeInterval* end() const { return intervals_ + count_; }

private:
    SlopeInterval* intervals_;
    int count_ = 0;
};

/// The hemisphere about the normal in a half slice. `up` and `out` are the components of the normal
/// towards the viewer and sideways.
class SliceArc {
public:
    SliceArc(double up, double out) : up_{up}, out_{out}
    {
        // The edge of the hemisphere, and a little within: what rounding raises over the horizon of a
        // plane does not count. It would weigh 2⁻³⁵ at most.
        constexpr double margin = 0x1p-17;
        low_ = -steepest_slope;
        high_ = steepest_slope;
        if (up > 0) {
            const double sine = up + margin * out;
            low_ = sine > 0 ? (margin * up - out) / sine : steepest_slope;
        } else if (out > 0) {
            const double sine = margin * out - up;
            high_ = sine > 0 ? (margin * up + out) / sine : -steepest_slope;
        } else {
            low_ = steepest_slope;
            return;
        }
        const double size = std::fabs(up);
        full_ = (size + out * std::atan2(size, -out)) / 2;
    }
    [[nodiscard]] double low() const { return low_; }
    [[nodiscard]] double high() const { return high_; }
    /// Of the whole arc.
    [[nodiscard]] double full() const { return full_; }
    [[nodiscard]] double of(const SlopeInterval& interval) const
    {
        return integral(angle(interval.low)) - integral(angle(interval.high));
    }

private:
    [[nodiscard]] static double angle(double slope) { return std::atan2(1.0, slope); }
    /// ∫ (up cos t + out sin t) sin t dt from 0 on.
    [[nodiscard]] double integral(double t) const
    {
        const double sine = std::sin(t);
        return (up_ * sine * sine + out_ * (t - sine * std::cos(t))) / 2;
    }
    double up_, out_, full_ = 0, low_ = 0, high_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
