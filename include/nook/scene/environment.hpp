#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include <glm/vec3.hpp>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/vector.hpp>

/// Colours for the viewpoints around an object, to relight it with (González, Sbert & Feixas 2008,
/// section 5.4): from a picture of the surroundings, or from a few made up ones.
namespace nook {

/// A picture of the surroundings in all directions: longitude across, latitude down, y up. Row 0 lies
/// at +y, the last row at −y; in the middle of a row is −z, at three quarters +x, at its two ends +z. The
/// centre of pixel (x, y) of W × H has longitude 2π (x + 1/2) / W − π and latitude
/// π/2 − π (y + 1/2) / H; its direction is (cos lat sin lon, sin lat, −cos lat cos lon).
using Environment = ImageView3<const float>;

struct EnvironmentOptions {
    /// Angular radius of the cap of the sky that is averaged, radians, 0 to π. A viewpoint of 642 stands
    /// for 0.08 of them. Caps without the centre of a pixel, as of radius 0, are looked up: linearly
    /// between pixels, and towards a pole to the mean of the row next to it.
    double cap = 0.1;
    /// Multiplies the picture, finite, ≥ 0. Results are cut off at 1.
    double exposure = 1;
};

/// Surroundings to show an object with. They follow the harmonies that the paper takes from Coloroid, a
/// system of equally spaced colours: scales of one hue, of opposite and of neighbouring hues. Hues are
/// those of HSV here, equally spaced in its formula and not to the eye.
enum class Palette : std::uint8_t {
    single_hue,     ///< one hue, dark from below to bright from above
    complementary,  ///< the hue from above, the opposite one from below, grey between
    analogous,  ///< from the hue's left neighbour below to its right one above, 30° to each side
    triad,      ///< three hues 120° apart, from three sides; grey from above and below
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the colour of the surroundings in each direction, in [0, 1]: the mean of the pixels whose
/// centres lie in the cap around it, weighted by solid angle (the cosine of the latitude), exact for a
/// constant image. Pixels that are not finite or negative count as 0; so does an image of size 0.
///
/// `directions`: `count` finite vectors other than 0, of any length, from the object to the viewpoint.
/// `colours`: three floats each, in the unit of the image. Tasks are directions.
template <Executor E = Serial>
Outcome environment_colours(const Environment& image, const glm::dvec3* directions,
                            std::size_t count, float* colours,
                            const EnvironmentOptions& options = {}, E&& executor = E{});

/// The colour of a palette in a direction of any length, three numbers in [0, 1], linear light. `hue`
/// is a share of the circle: 0 red, 1/3 green, 2/3 blue, 1 red again; the harmony begins there. A
/// direction that is 0 or not finite gets the colour of the middle, a hue that is not finite counts as
/// 0. E.g. warm above and cold below: complementary with hue 1/12.
[[nodiscard]] glm::vec3 palette_colour(Palette palette, double hue, const glm::dvec3& direction);

namespace detail {

struct Latitude {
    double latitude, longitude;
};

[[nodiscard]] inline Latitude latitude_of(const Vector3& unit)
{
    const double height = unit.y < -1 ? -1 : unit.y > 1 ? 1 : unit.y;
    const bool pole = unit.x == 0 && unit.z == 0;
    return {std::asin(height), pole ? 0 : std::atan2(unit.x, -unit.z)};
}

[[nodiscard]] constexpr double environment_pixel(float value)
{
    return is_finite(value) && value > 0 ? double{value} : 0;
}

/// A weighted mean that lies between the least and the largest of its values.
class BoundedMean {
public:
    void add(double value, double weight)
    {
        sum_ += rounded(value * weight);
        weight_ += weight;
        least_ = smaller(least_, value);
        most_ = larger(most_, value);
    }
    [[nodiscard]] bool empty() const { return !(weight_ > 0); }
    [[nodiscard]] double mean() const { return larger(least_, smaller(sum_ / weight_, most_)); }

private:
    double sum_ = 0, weight_ = 0;
    double least_ = (std::numeric_limits<double>::max)(), most_ = 0;
};

/// Looks into one channel of the surroundings.
class Surroundings {
public:
    explicit Surroundings(const ImageView<const float>& image)
        : image_{image},
          width_{double(image.width)},
          height_{double(image.height)}
    {}

    [[nodiscard]] double mean(const Latitude& at, double cap) const
    {
        constexpr double pi = std::numbers::pi;
        BoundedMean result;
        const double sine = std::sin(at.latitude), cosine = std::cos(at.latitude);
        // The latitudes of the cap, and a row more for rounding.
        const int first = row_at(at.latitude + cap) - 1, last = row_at(at.latitude - cap) + 1;
        for (int y = first < 0 ? 0 : first; y <= last && y < image_.height; ++y) {
            const double latitude = pi / 2 - pi * (y + 0.5) / height_;
            // Within the cap: cosine of the difference in longitude × reach ≥ least.
            const double weight = std::cos(latitude), reach = weight * cosine;
            const double least = std::cos(cap) - std::sin(latitude) * sine;
            if (least > reach) continue;
            const bool all = cap >= pi || least <= -reach;
            const double half = all ? pi : std::acos(least / reach);
            const double middle = (at.longitude + pi) / (2 * pi) * width_ - 0.5;
            const double across = half / (2 * pi) * width_;
            const int left = all ? 0 : static_cast<int>(std::ceil(middle - across));
            const int right =
                all ? image_.width - 1 : static_cast<int>(std::floor(middle + across));
            for (int x = left; x <= right && x < left + image_.width; ++x)
                result.add(pixel(x, y), weight);
        }
        return result.empty() ? lookup(at) : result.mean();
    }

    [[nodiscard]] double lookup(const Latitude& at) const
    {
        constexpr double pi = std::numbers::pi;
        const double x = (at.longitude + pi) / (2 * pi) * width_ - 0.5;
        const double y = (pi / 2 - at.latitude) / pi * height_ - 0.5;
        const double left = std::floor(x), top = std::floor(y);
        const auto row = [&](int j) {
            // Beyond the first and the last row lies a pole, half a row away.
            if (j < 0 || j >= image_.height) return row_mean(j < 0 ? 0 : image_.height - 1);
            const int i = static_cast<int>(left);
            return between(pixel(i, j), pixel(i + 1, j), x - left);
        };
        const int j = static_cast<int>(top);
        const double part = y - top;
        if (j < 0) return between(row(-1), row(0), larger(2 * part - 1, 0.0));
        if (j + 1 >= image_.height) return between(row(j), row(j + 1), smaller(2 * part, 1.0));
        return between(row(j), row(j + 1), part);
    }

private:
    [[nodiscard]] static double between(double from, double to, double share)
    {
        const double value = from + rounded((to - from) * share);
        return larger(smaller(from, to), smaller(value, larger(from, to)));
    }
    [[nodiscard]] int row_at(double latitude) const
    {
        const double y = (std::numbers::pi / 2 - latitude) / std::numbers::pi * height_;
        return static_cast<int>(y < -1 ? -1 : y > height_ ? height_ : y);
    }
    [[nodiscard]] double pixel(int x, int y) const
    {
        // At most one turn too far.
        if (x < 0) x += image_.width;
        if (x >= image_.width) x -= image_.width;
        return environment_pixel(image_(x, y));
    }
    [[nodiscard]] double row_mean(int y) const
    {
        BoundedMean result;
        for (int x = 0; x < image_.width; ++x) result.add(pixel(x, y), 1);
        return result.mean();
    }

    ImageView<const float> image_;
    double width_, height_;
};

/// The HSV colour with this value and saturation.
[[nodiscard]] inline Vector3 hue_colour(double hue, double saturation, double value)
{
    const auto channel = [&](double start) {
        const double place = start + 6 * (hue - std::floor(hue));
        const double k = place < 6 ? place : place - 6;
        const double share = larger(smaller(smaller(k, 4 - k), 1.0), 0.0);
        return value - value * saturation * share;
    };
    return {channel(5), channel(3), channel(1)};
}

}  // namespace detail

template <Executor E>
Outcome environment_colours(const Environment& image, const glm::dvec3* directions,
                            std::size_t count, float* colours, const EnvironmentOptions& options,
                            E&& executor)
{
    const ImageView<const float>* const planes[] = {&image.x, &image.y, &image.z};
    for (const auto* plane : planes) {
        if (const Error error = detail::check_input(*plane, "image")) return {error};
        if (const Error error = detail::check_same_size(image.x, *plane, "image")) return {error};
    }
    if (count > 0x7fffffff)
        return {{ErrorCode::bad_size, "count", double(count), "at most 2^31 - 1 directions"}};
    if (count == 0) return {};
    if (directions == nullptr)
        return {{ErrorCode::null_data, "directions", 0, "one vector per viewpoint"}};
    if (colours == nullptr)
        return {{ErrorCode::null_data, "colours", 0, "three floats per viewpoint"}};
    if (!detail::is_finite(options.cap) || options.cap < 0 || options.cap > std::numbers::pi)
        return {{ErrorCode::bad_value, "options.cap", options.cap, "radians, 0 to pi"}};
    if (const Error error =
            detail::check_at_least(options.exposure, 0, "options.exposure", "a number >= 0"))
        return {error};
    for (std::size_t v = 0; v < count; ++v) {
        const glm::dvec3& d = directions[v];
        const bool finite =
            detail::is_finite(d.x) && detail::is_finite(d.y) && detail::is_finite(d.z);
        if (!finite || !(detail::largest(detail::vector(d)) > 0))
            return {{ErrorCode::bad_value, "index of a direction", double(v),
                     "finite vectors other than 0"}};
    }
    executor.for_each(static_cast<int>(count), [&](int task, int) {
        const auto v = static_cast<std::size_t>(task);
        const detail::Latitude at = detail::latitude_of(normalised(detail::vector(directions[v])));
        for (std::size_t k = 0; k < 3; ++k) {
            const double mean =
                image.empty() ? 0 : detail::Surroundings{*planes[k]}.mean(at, options.cap);
            colours[3 * v + k] = static_cast<float>(detail::smaller(mean * options.exposure, 1.0));
        }
    });
    Outcome outcome{};
    outcome.work.passes = 1;
    return outcome;
}

inline glm::vec3 palette_colour(Palette palette, double hue, const glm::dvec3& direction)
{
    using detail::hue_colour, detail::Vector3;
    if (!detail::is_finite(hue)) hue = 0;
    Vector3 d{0, 0, 0};
    if (detail::is_finite(direction.x) && detail::is_finite(direction.y) &&
        detail::is_finite(direction.z))
        d = normalised(detail::vector(direction));
    const double up = (d.y + 1) / 2;
    Vector3 colour{0, 0, 0};
    switch (palette) {
    case Palette::single_hue: colour = hue_colour(hue, 0.9 - 0.6 * up, 0.15 + 0.85 * up); break;
    case Palette::complementary:
        colour = hue_colour(hue, 0.9, 1) * up + hue_colour(hue + 0.5, 0.9, 1) * (1 - up);
        break;
    case Palette::analogous: colour = hue_colour(hue + (up - 0.5) / 6, 0.8, 1); break;
    case Palette::triad: {
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            const double angle = 2 * std::numbers::pi * k / 3;
            const double facing = d.x * std::sin(angle) - d.z * std::cos(angle);
            const double weight = std::exp(3 * facing);
            colour = colour + hue_colour(hue + k / 3.0, 0.9, 1) * weight;
            sum += weight;
        }
        colour = colour * (1 / sum);
        break;
    }
    }
    const auto stored = [](double value) {
        return static_cast<float>(detail::larger(detail::smaller(value, 1.0), 0.0));
    };
    return {stored(colour.x), stored(colour.y), stored(colour.z)};
}

}  // namespace nook::inline NOOK_TARGET
