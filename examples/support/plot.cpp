#include "plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace support {

namespace {

constexpr Rgb ink{0.13f, 0.13f, 0.13f}, frame{0.45f, 0.45f, 0.45f}, grid{0.90f, 0.90f, 0.90f},
    shade{0.93f, 0.93f, 0.96f};

/// Drawn at twice its size and halved, so that slanted lines are smooth.
constexpr int fine = 2;

/// A frame with axes; lengths are those of the picture that comes out.
class Panel {
public:
    static constexpr int width = 540, height = 420, across = 640, down = 550;

    Panel(int left, const Plot& plot) : left_{left}, plot_{plot} {}

    /// On the fine picture: what lies under the curves.
    void draw_ground(Picture& picture) const
    {
        const int end = whole(fine * column(plot_.shaded_until));
        picture.fill(fine * left_, fine * top, end - fine * left_, fine * height, shade);
        for (int i = 0; i <= plot_.x.count(); ++i)
            picture.fill(whole(fine * column(plot_.x.at(i))), fine * top, fine, fine * height,
                         grid);
        for (int i = 0; i <= plot_.y.count(); ++i)
            picture.fill(fine * left_, whole(fine * line(plot_.y.at(i))), fine * width, fine, grid);
        picture.fill(fine * left_, fine * (top + height), fine * width, fine, frame);
        picture.fill(fine * left_, fine * top, fine, fine * height, frame);
    }
    void draw(Picture& picture, const Series& series) const
    {
        for (std::size_t i = 0; i < series.x.size(); ++i) {
            if (series.x[i] > plot_.x.last) break;
            if (std::isnan(series.y[i])) continue;
            const double x = fine * column(series.x[i]), y = fine * line(series.y[i]);
            if (series.stroke == Stroke::dots) {
                if (i % 4 == 0) stamp(picture, x, y, 6, series.colour);
                continue;
            }
            if (i == 0 || std::isnan(series.y[i - 1])) continue;
            const double from_x = fine * column(series.x[i - 1]),
                         from_y = fine * line(series.y[i - 1]);
            const int steps =
                static_cast<int>(std::ceil(std::max(std::fabs(x - from_x), std::fabs(y - from_y))));
            for (int k = 0; k <= steps; ++k) {
                const double share = steps > 0 ? double(k) / steps : 0;
                stamp(picture, std::lerp(from_x, x, share), std::lerp(from_y, y, share), 2.2,
                      series.colour);
            }
        }
    }
    /// On the picture at its own size: letters, and samples of the strokes.
    void write(Picture& picture) const
    {
        constexpr int size = 2, gap = 8;
        const int high = text_height(size);
        draw_text(picture, left_, top - high - 2 * gap, plot_.title, size, ink);
        for (int i = 0; i <= plot_.x.count(); ++i) {
            const std::string text = plot_.x_label(plot_.x.at(i));
            draw_text(picture, static_cast<int>(column(plot_.x.at(i))) - text_width(text) / 2,
                      top + height + gap, text, size, ink);
        }
        for (int i = 0; i <= plot_.y.count(); ++i) {
            const std::string text = plain_label(plot_.y.at(i));
            draw_text(picture, left_ - gap - text_width(text),
                      static_cast<int>(line(plot_.y.at(i))) - high / 2 + 1, text, size, ink);
        }
        draw_text(picture, left_ + (width - text_width(plot_.x_name)) / 2,
                  top + height + 2 * gap + high, plot_.x_name, size, ink);
        int widest = 0;
        for (const Series& s : plot_.series) widest = std::max(widest, text_width(s.label));
        const bool left = plot_.legend == Corner::lower_left;
        const int x = left ? left_ + 40 + 2 * gap : left_ + width - widest - 2 * gap;
        const int lines = static_cast<int>(plot_.series.size()) * (high + gap);
        int y = plot_.legend == Corner::upper_right ? top + gap : top + height - lines - gap;
        for (const Series& s : plot_.series) {
            const bool dots = s.stroke == Stroke::dots;
            for (int at = x - 40; at < x - 10; at += dots ? 12 : 30)
                picture.fill(at, y + high / 2 - (dots ? 4 : 3), dots ? 5 : 30, dots ? 5 : 3,
                             s.colour);
            draw_text(picture, x, y, s.label, size, ink);
            y += high + gap;
        }
    }

private:
    static constexpr int top = 60;

    [[nodiscard]] static int whole(double value) { return static_cast<int>(std::lround(value)); }
    [[nodiscard]] double column(double x) const
    {
        return left_ + width * (x - plot_.x.first) / (plot_.x.last - plot_.x.first);
    }
    [[nodiscard]] double line(double y) const
    {
        return top + height * (plot_.y.last - y) / (plot_.y.last - plot_.y.first);
    }
    static void stamp(Picture& picture, double x, double y, double radius, const Rgb& colour)
    {
        for (int j = static_cast<int>(y - radius); j <= static_cast<int>(y + radius) + 1; ++j)
            for (int i = static_cast<int>(x - radius); i <= static_cast<int>(x + radius) + 1; ++i)
                if (std::hypot(i - x, j - y) <= radius) picture.set(i, j, colour);
    }

    int left_;
    const Plot& plot_;
};

}  // namespace

Ticks::Ticks(double low, double high)
{
    const double rough = std::max(high - low, 1e-9) / 5;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double lead = rough / power;
    step = power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
    first = std::floor(low / step) * step;
    last = std::ceil(high / step) * step;
}

int Ticks::count() const { return static_cast<int>(std::lround((last - first) / step)); }

std::string plain_label(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", std::fabs(value) < 1e-12 ? 0.0 : value);
    return text;
}

std::string power_label(double value)
{
    const double number = std::pow(10.0, value);
    const double unit = number < 999.5 ? 1 : number < 999.5e3 ? 1e3 : 1e6;
    char text[32];
    // Two digits, and no exponent.
    const double shown = number / unit, tens = shown >= 99.5 ? 10 : 1;
    std::snprintf(text, sizeof text, "%.3g%s", tens * std::round(shown / tens * 10) / 10,
                  unit == 1     ? ""
                  : unit == 1e3 ? "k"
                                : "M");
    return text;
}

Picture draw_plots(const std::vector<Plot>& plots)
{
    const int width = 10 + Panel::across * static_cast<int>(plots.size());
    Picture drawn{fine * width, fine * Panel::down};
    std::vector<Panel> panels;
    for (const Plot& plot : plots)
        panels.emplace_back(80 + Panel::across * static_cast<int>(panels.size()), plot);
    for (std::size_t i = 0; i < plots.size(); ++i) {
        panels[i].draw_ground(drawn);
        for (const Series& series : plots[i].series) panels[i].draw(drawn, series);
    }
    Picture picture = halved(drawn);
    for (const Panel& panel : panels) panel.write(picture);
    return picture;
}

}  // namespace support
