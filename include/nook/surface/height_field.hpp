#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>

/// The depth buffer as a surface: what lies between its pixels, and where it tears.
namespace nook::inline NOOK_TARGET::detail {

/// Holds the height of every pixel: 1 / distance under perspective, −distance under orthography. Over a
/// plane it is linear on the screen, and larger is nearer. 0: no surface.
///
/// Pixels side by side are *joined* where one surface seems to run through both: they lie at most
/// two pixels' widths apart (a slope of 63°, face on) or four depth steps, or the next pixel on one side
/// continues the line through them within half of their difference, or neither side has a next pixel.
class HeightField {
public:
    enum Join : std::uint8_t { right = 1, below = 2 };

    /// A row or a column of pixels, for walks along it.
    struct Axis {
        std::ptrdiff_t along, across;  ///< to the next pixel along the walk, and to its side
        int length, breadth;           ///< of the image
        Join join_along, join_across;
    };
    /// The surface where a walk crosses a row or column of pixels.
    struct Crossing {
        double height;           ///< 0: open
        double gradient;         ///< per pixel across
        std::ptrdiff_t nearest;  ///< the pixel it lies in
        std::ptrdiff_t other;    ///< one of the two that make the gradient
        bool beside;             ///< the other lies beside the nearest, not along the walk
    };

    HeightField(int width, int height, const Projection& projection, const DepthStep& step)
        : width_{width},
          height_{height},
          pixel_x_{1 / projection.fx},
          pixel_y_{1 / projection.fy},
          orthographic_{projection.orthographic},
          step_{step}
    {}

    [[nodiscard]] std::size_t size() const
    {
        return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    }
    void use(double* heights, std::uint8_t* joins)
    {
        heights_ = heights;
        joins_ = joins;
    }
    [[nodiscard]] std::ptrdiff_t index(int x, int y) const
    {
        return static_cast<std::ptrdiff_t>(y) * width_ + x;
    }
    [[nodiscard]] double operator[](std::ptrdiff_t index) const { return heights_[index]; }
    [[nodiscard]] double distance(double height) const
    {
        return orthographic_ ? -height : 1 / height;
    }
    /// The depth step at a pixel, as a step of heights.
    [[nodiscard]] double step(double height) const
    {
        if (orthographic_) return step_(-height);
        return step_.quadratic + height * (step_.linear + height * step_.constant);
    }
    [[nodiscard]] Axis rows() const { return {1, width_, width_, height_, right, below}; }
    [[nodiscard]] Axis columns() const { return {width_, 1, height_, width_, below, right}; }

    /// Fills the rows [first, last); looks at no other rows of the field.
    template <class Stored, class Decode>
    void fill(const DepthSource<Stored, Decode>& source, int first, int last) const;

    /// The surface at `side` (a pixel centre + an offset, in [−1/2, breadth − 1/2)) of the pixels
    /// at `place` of the walk. Between joined pixels the height is linear; beside a tear, the background
    /// or the border it goes on as on the side it comes from.
    [[nodiscard]] Crossing crossing(const Axis& axis, int place, double side) const;

    /// Whether the pixels at two ends of an edge or of a corner are joined.
    [[nodiscard]] bool joined(const Axis& axis, std::ptrdiff_t before, std::ptrdiff_t after,
                              int direction) const;

    /// The next pixel of the walk if it is joined, or the pixel itself.
    [[nodiscard]] std::ptrdiff_t next_along(const Axis& axis, int place, std::ptrdiff_t at,
                                            int direction) const
    {
        if (place + direction < 0 || place + direction >= axis.length) return at;
        const std::ptrdiff_t next = at + direction * axis.along;
        return (joins_[direction > 0 ? at : next] & axis.join_along) != 0 ? next : at;
    }

private:
    /// A joined pixel to the side, or the pixel itself.
    [[nodiscard]] std::ptrdiff_t neighbour_across(const Axis& axis, int row,
                                                  std::ptrdiff_t at) const;
    [[nodiscard]] bool joins(double before, double a, double b, double after, double pixel) const
    {
        if (a == 0 || b == 0) return false;
        // Nothing tells against it.
        if (before == 0 && after == 0) return true;
        const double rise = b - a, half = std::fabs(rise) / 2;
        if (before != 0 && std::fabs(rise - (a - before)) <= half) return true;
        if (after != 0 && std::fabs(rise - (after - b)) <= half) return true;
        const double first = distance(a), second = distance(b);
        const double nearer = first < second ? first : second;
        const double farther = first < second ? second : first;
        const double width = orthographic_ ? pixel : pixel * nearer;
        return farther - nearer <= 2 * width + 4 * step_(farther);
    }

    int width_, height_;
    double pixel_x_, pixel_y_;
    bool orthographic_;
    DepthStep step_;
    double* heights_ = nullptr;
    std::uint8_t* joins_ = nullptr;
};

template <class Stored, class Decode>
void HeightField::fill(const DepthSource<Stored, Decode>& source, int first, int last) const
{
    const auto decoded = [&](int x, int y) -> double {
        const double distance{surface_distance(source, x, y)};
        if (!(distance > 0)) return 0;
        // The inverse of a denormal is infinite.
        return orthographic_ ? -distance : 1 / (distance > 0x1p-1000 ? distance : 0x1p-1000);
    };
    for (int y = first; y < last; ++y)
        for (int x = 0; x < width_; ++x) heights_[index(x, y)] = decoded(x, y);
    const auto at = [&](int x, int y) -> double {
        if (x < 0 || y < 0 || x >= width_ || y >= height_) return 0;
        return y >= first && y < last ? heights_[index(x, y)] : decoded(x, y);
    };
    for (int y = first; y < last; ++y)
        for (int x = 0; x < width_; ++x) {
            const double here = at(x, y);
            unsigned bits = 0;
            if (joins(at(x - 1, y), here, at(x + 1, y), at(x + 2, y), pixel_x_)) bits |= right;
            if (joins(at(x, y - 1), here, at(x, y + 1), at(x, y + 2), pixel_y_)) bits |= below;
            joins_[index(x, y)] = static_cast<std::uint8_t>(bits);
        }
}

inline HeightField::Crossing HeightField::crossing(const Axis& axis, int place, double side) const
{
    const int low = static_cast<int>(side + 1) - 1;
    const double part = side - low;
    const std::ptrdiff_t a = place * axis.along + low * axis.across, b = a + axis.across;
    const bool has_a = low >= 0 && heights_[a] != 0;
    const bool has_b = low + 1 < axis.breadth && heights_[b] != 0;
    if (has_a && has_b && (joins_[a] & axis.join_across) != 0) {
        const double gradient = heights_[b] - heights_[a];
        return {heights_[a] + part * gradient, gradient, part < 0.5 ? a : b, part < 0.5 ? b : a,
                true};
    }
    const bool first = part < 0.5;
    const std::ptrdiff_t at = first ? a : b;
    if (!(first ? has_a : has_b)) return {0, 0, at, at, false};
    const int row = first ? low : low + 1;
    // The slope from beyond, or that beside the pixel.
    std::ptrdiff_t other = neighbour_across(axis, row, at), from = at;
    if (other == at && place > 0 && (joins_[at - axis.along] & axis.join_along) != 0) {
        from = at - axis.along;
        other = neighbour_across(axis, row, from);
    }
    if (other == from && (joins_[at] & axis.join_along) != 0) {
        from = at + axis.along;
        other = neighbour_across(axis, row, from);
    }
    const double rise = heights_[other] - heights_[from];
    const double gradient = other < from ? -rise : rise;
    return {heights_[at] + (first ? part : part - 1) * gradient, gradient, at, other,
            from == at && other != at};
}

inline std::ptrdiff_t HeightField::neighbour_across(const Axis& axis, int row,
                                                    std::ptrdiff_t at) const
{
    if (row > 0 && (joins_[at - axis.across] & axis.join_across) != 0) return at - axis.across;
    return (joins_[at] & axis.join_across) != 0 ? at + axis.across : at;
}

inline bool HeightField::joined(const Axis& axis, std::ptrdiff_t before, std::ptrdiff_t after,
                                int direction) const
{
    const auto edge = [&](std::ptrdiff_t from, std::ptrdiff_t step, Join join) {
        return (joins_[step > 0 ? from : from + step] & join) != 0;
    };
    const std::ptrdiff_t along = direction * axis.along, across = after - along - before;
    if (across == 0) return edge(before, along, axis.join_along);
    return (edge(before, along, axis.join_along) &&
            edge(before + along, across, axis.join_across)) ||
           (edge(before, across, axis.join_across) &&
            edge(before + across, along, axis.join_along));
}

}  // namespace nook::inline NOOK_TARGET::detail
