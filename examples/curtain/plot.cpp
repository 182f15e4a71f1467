#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "../support/plot.hpp"
#include "curtain.hpp"

namespace curtain {

namespace {

using namespace support::plot_colours;
using support::Series;
using support::Stroke;

support::Plot plot_of(std::string title, std::vector<Series> series, const Profile& profile)
{
    double low = series.front().y.front(), high = low;
    for (const Series& s : series)
        for (const double value : s.y) {
            low = std::min(low, value);
            high = std::max(high, value);
        }
    return {std::move(title),  "distance from the middle of the box",
            std::move(series), {0, profile.positions.back()},
            {low, high},       profile.options.curtain.width / 2};
}

}  // namespace

void write_plot(const std::filesystem::path& path, const Profile& profile)
{
    const auto series = [&](const std::vector<Curve>& curves, std::string_view name,
                            const support::Rgb& colour, std::string label,
                            Stroke stroke = Stroke::line) {
        const auto at = std::find_if(curves.begin(), curves.end(),
                                     [&](const Curve& c) { return c.name == name; });
        return Series{profile.positions, at->values, colour, std::move(label), stroke};
    };
    const std::vector<Curve>&plane = profile.flat_land, &space = profile.space;
    support::write_png(
        path, support::draw_plots(
                  {plot_of("Plane: visible angle",
                           {series(plane, "V", black, "no secondary rays"),
                            series(plane, "R/4", green, "R' = R/4"),
                            series(plane, "R/2", blue, "R' = R/2"),
                            series(plane, "R/2 in plane", vermilion, "R' = R/2, in-plane only")},
                           profile),
                   plot_of("Space: cosine-weighted openness",
                           {series(space, "exact", black, "closed form"),
                            series(space, "traced", black, "traced", Stroke::dots),
                            series(space, "N=64", orange, "R' = R/8 (rule at N = 64)"),
                            series(space, "R/4", green, "R' = R/4 (N = 16)"),
                            series(space, "R/2", blue, "R' = R/2 (N = 4)")},
                           profile)}));
}

}  // namespace curtain
