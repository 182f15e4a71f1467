#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "../support/picture.hpp"
#include "curtain.hpp"

namespace curtain {

namespace {

using support::Picture;
using support::Rgb;

constexpr Rgb ink{0.13f, 0.13f, 0.13f}, frame{0.45f, 0.45f, 0.45f}, grid{0.90f, 0.90f, 0.90f},
    shade{0.93f, 0.93f, 0.96f};
/// Told apart with any colour vision (Okabe & Ito 2008).
constexpr Rgb black{0.13f, 0.13f, 0.13f}, orange{0.90f, 0.62f, 0.00f}, green{0.00f, 0.62f, 0.45f},
    blue{0.00f, 0.45f, 0.70f}, vermilion{0.84f, 0.37f, 0.00f};

/// Drawn at twice its size and halved, so that slanted lines are smooth.
constexpr int fine = 2;

enum class Stroke { line, dots };

struct Series {
    const Curve* curve;
    Rgb colour;
    std::string label;
    Stroke stroke = Stroke::line;
};

/// Round numbers from a step of 1, 2 or 5 times a power of ten; about five steps in the range.
struct Ticks {
    double first, last, step;

    Ticks(double low, double high)
    {
        const double rough = std::max(high - low, 1e-9) / 5;
        const double power = std::pow(10.0, std::floor(std::log10(rough)));
        const double lead = rough / power;
        step = power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
        first = std::floor(low / step) * step;
        last = std::ceil(high / step) * step;
    }
    [[nodiscard]] int count() const { return static_cast<int>(std::lround((last - first) / step)); }
    [[nodiscard]] double at(int i) const { return first + i * step; }
};

std::string label(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", std::fabs(value) < 1e-12 ? 0.0 : value);
    return text;
}

/// A frame with axes; lengths are those of the picture that comes out.
class Panel {
public:
    Panel(int left, int top, int width, int height, const Ticks& x, const Ticks& y)
        : left_{left},
          top_{top},
          width_{width},
          height_{height},
          x_{x},
          y_{y}
    {}
    [[nodiscard]] double column(double x) const
    {
        return left_ + width_ * (x - x_.first) / (x_.last - x_.first);
    }
    [[nodiscard]] double line(double y) const
    {
        return top_ + height_ * (y_.last - y) / (y_.last - y_.first);
    }
    /// The fine picture: what lies under the curves.
    void draw_ground(Picture& picture, double shaded_until) const
    {
        const int end = static_cast<int>(std::lround(fine * column(shaded_until)));
        picture.fill(fine * left_, fine * top_, end - fine * left_, fine * height_, shade);
        for (int i = 0; i <= x_.count(); ++i)
            picture.fill(static_cast<int>(std::lround(fine * column(x_.at(i)))), fine * top_, fine,
                         fine * height_, grid);
        for (int i = 0; i <= y_.count(); ++i)
            picture.fill(fine * left_, static_cast<int>(std::lround(fine * line(y_.at(i)))),
                         fine * width_, fine, grid);
        picture.fill(fine * left_, fine * (top_ + height_), fine * width_, fine, frame);
        picture.fill(fine * left_, fine * top_, fine, fine * height_, frame);
    }
    void draw(Picture& picture, const Series& series, const std::vector<double>& positions) const
    {
        const std::vector<double>& values = series.curve->values;
        for (std::size_t i = 0; i < positions.size(); ++i) {
            const double x = fine * column(positions[i]), y = fine * line(values[i]);
            if (positions[i] > x_.last) break;
            if (series.stroke == Stroke::dots) {
                if (i % 4 == 0) stamp(picture, x, y, 6, series.colour);
                continue;
            }
            if (i == 0) continue;
            const double from_x = fine * column(positions[i - 1]),
                         from_y = fine * line(values[i - 1]);
            const int steps =
                static_cast<int>(std::ceil(std::max(std::fabs(x - from_x), std::fabs(y - from_y))));
            for (int k = 0; k <= steps; ++k) {
                const double share = steps > 0 ? double(k) / steps : 0;
                stamp(picture, std::lerp(from_x, x, share), std::lerp(from_y, y, share), 2.2,
                      series.colour);
            }
        }
    }
    /// The picture at its own size: letters, and samples of the strokes.
    void draw_text(Picture& picture, std::string_view title, std::string_view x_name,
                   const std::vector<Series>& series) const
    {
        constexpr int size = 2, gap = 8;
        const int high = support::text_height(size);
        support::draw_text(picture, left_, top_ - high - 2 * gap, title, size, ink);
        for (int i = 0; i <= x_.count(); ++i) {
            const std::string text = label(x_.at(i));
            support::draw_text(picture,
                               static_cast<int>(column(x_.at(i))) - support::text_width(text) / 2,
                               top_ + height_ + gap, text, size, ink);
        }
        for (int i = 0; i <= y_.count(); ++i) {
            const std::string text = label(y_.at(i));
            support::draw_text(picture, left_ - gap - support::text_width(text),
                               static_cast<int>(line(y_.at(i))) - high / 2 + 1, text, size, ink);
        }
        support::draw_text(picture, left_ + (width_ - support::text_width(x_name)) / 2,
                           top_ + height_ + 2 * gap + high, x_name, size, ink);
        int widest = 0;
        for (const Series& s : series) widest = std::max(widest, support::text_width(s.label));
        const int x = left_ + width_ - widest - 2 * gap;
        int y = top_ + height_ - static_cast<int>(series.size()) * (high + gap) - gap;
        for (const Series& s : series) {
            const bool dots = s.stroke == Stroke::dots;
            for (int at = x - 40; at < x - 10; at += dots ? 12 : 30)
                picture.fill(at, y + high / 2 - (dots ? 4 : 3), dots ? 5 : 30, dots ? 5 : 3,
                             s.colour);
            support::draw_text(picture, x, y, s.label, size, ink);
            y += high + gap;
        }
    }

private:
    static void stamp(Picture& picture, double x, double y, double radius, const Rgb& colour)
    {
        for (int j = static_cast<int>(y - radius); j <= static_cast<int>(y + radius) + 1; ++j)
            for (int i = static_cast<int>(x - radius); i <= static_cast<int>(x + radius) + 1; ++i)
                if (std::hypot(i - x, j - y) <= radius) picture.set(i, j, colour);
    }

    int left_, top_, width_, height_;
    Ticks x_, y_;
};

Panel panel_of(int left, int top, const std::vector<Series>& series,
               const std::vector<double>& positions)
{
    double low = series.front().curve->values.front(), high = low;
    for (const Series& s : series)
        for (const double value : s.curve->values) {
            low = std::min(low, value);
            high = std::max(high, value);
        }
    return {left, top, 540, 420, Ticks{0, positions.back()}, Ticks{low, high}};
}

}  // namespace

void write_plot(const std::filesystem::path& path, const Profile& profile)
{
    const auto curve = [](const std::vector<Curve>& curves, std::string_view name) {
        return &*std::find_if(curves.begin(), curves.end(),
                              [&](const Curve& c) { return c.name == name; });
    };
    const std::vector<Series> plane{
        {curve(profile.flat_land, "V"), black, "no secondary rays"},
        {curve(profile.flat_land, "R/4"), green, "R' = R/4"},
        {curve(profile.flat_land, "R/2"), blue, "R' = R/2"},
        {curve(profile.flat_land, "R/2 in plane"), vermilion, "R' = R/2, in-plane only"}};
    const std::vector<Series> space{
        {curve(profile.space, "exact"), black, "closed form"},
        {curve(profile.space, "traced"), black, "traced", Stroke::dots},
        {curve(profile.space, "N=64"), orange, "R' = R/8 (rule at N = 64)"},
        {curve(profile.space, "R/4"), green, "R' = R/4 (N = 16)"},
        {curve(profile.space, "R/2"), blue, "R' = R/2 (N = 4)"}};
    const Panel left = panel_of(80, 60, plane, profile.positions);
    const Panel right = panel_of(720, 60, space, profile.positions);
    constexpr int width = 1290, height = 550;
    Picture drawn{fine * width, fine * height};
    for (const Panel* panel : {&left, &right}) {
        panel->draw_ground(drawn, profile.options.curtain.width / 2);
        for (const Series& series : panel == &left ? plane : space)
            panel->draw(drawn, series, profile.positions);
    }
    Picture picture = support::halved(drawn);
    constexpr std::string_view x_name = "distance from the middle of the box";
    left.draw_text(picture, "Plane: visible angle", x_name, plane);
    right.draw_text(picture, "Space: cosine-weighted openness", x_name, space);
    support::write_png(path, picture);
}

}  // namespace curtain
