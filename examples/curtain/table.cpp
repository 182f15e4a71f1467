#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include <nook/version.hpp>

#include "curtain.hpp"

namespace curtain {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* measures[] = {"angle", "cosine", "space"};

std::string number(double value, int decimals)
{
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", decimals, value);
    return text;
}
std::string shortest(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value);
    return text;
}

std::string padded(std::string_view text, std::size_t size)
{
    return std::string(size > text.size() ? size - text.size() : 0, ' ') + std::string{text};
}

constexpr std::size_t first_column = 14;

std::string row(std::string_view head, const std::vector<std::string>& cells,
                const std::vector<Curve>& curves)
{
    std::string line = padded(head, first_column);
    for (std::size_t i = 0; i < cells.size(); ++i)
        line += padded(cells[i], 2 + std::max(curves[i].name.size(), std::size_t{6}));
    return line + '\n';
}

template <class Cell>
std::vector<std::string> cells(const std::vector<Curve>& curves, const Cell& cell)
{
    std::vector<std::string> result;
    for (const Curve& curve : curves) result.push_back(cell(curve));
    return result;
}

void print_table(std::ostream& out, const std::vector<double>& positions,
                 const std::vector<Curve>& curves)
{
    out << row("position", cells(curves, [](const Curve& c) { return c.name; }), curves);
    for (std::size_t i = 0; i < positions.size(); i += 4)
        out << row(shortest(positions[i]),
                   cells(curves, [&](const Curve& c) { return number(c.values[i], 4); }), curves);
    out << row("largest fall",
               cells(curves, [](const Curve& c) { return number(largest_fall(c), 4); }), curves);
    const bool spread = std::any_of(curves.begin(), curves.end(),
                                    [](const Curve& curve) { return curve.spread > 0; });
    if (spread)
        out << row("spread",
                   cells(curves,
                         [](const Curve& c) {
                             return c.spread > 0 ? number(c.spread, 4) : std::string{"-"};
                         }),
                   curves);
    out << '\n';
    for (const Curve& curve : curves) {
        std::string name = curve.name;
        name.resize(std::max(name.size(), first_column) + 2, ' ');
        out << "  " << name << curve.what;
        if (curve.directions > 0 && curve.secondary_radius > 0)
            out << " (" << shortest(curve.secondary_radius) << ')';
        out << '\n';
    }
    out << '\n';
}

Json json_of(const std::vector<Curve>& curves)
{
    Json result = Json::array();
    for (const Curve& curve : curves) {
        Json entry{{"name", curve.name},
                   {"what", curve.what},
                   {"secondary_radius", curve.secondary_radius},
                   {"largest_fall", largest_fall(curve)}};
        if (curve.directions > 0) {
            entry["directions"] = curve.directions;
            entry["spread"] = curve.spread;
            entry["rays"] = curve.rays;
            entry["skipped_rays"] = curve.skipped_rays;
        }
        entry["values"] = curve.values;
        result.push_back(entry);
    }
    return result;
}

}  // namespace

Json json_of(const Profile& profile)
{
    const nook::FlatLandCurtain& box = profile.options.curtain;
    Json maxima = Json::object();
    for (std::size_t i = 0; i < 3; ++i) {
        const auto measure = static_cast<nook::FlatLandMeasure>(i);
        maxima[measures[i]] = {{"exists", nook::flat_land_has_false_maximum(box, measure)},
                               {"darkest", nook::flat_land_darkest(box, measure)},
                               {"contrast", nook::flat_land_contrast(box, measure)}};
    }
    return {{"nook", nook::version},
            {"curtain",
             {{"width", box.width},
              {"bottom", box.bottom},
              {"height", box.height},
              {"radius", box.radius}}},
            {"directions", profile.options.directions},
            {"false_maximum", maxima},
            {"positions", profile.positions},
            {"space", json_of(profile.space)},
            {"flat_land", json_of(profile.flat_land)}};
}

void print_tables(std::ostream& out, const Profile& profile)
{
    const nook::FlatLandCurtain& box = profile.options.curtain;
    out << "A box of width " << shortest(box.width) << " and height " << shortest(box.height)
        << " hangs " << shortest(box.bottom) << " above the ground; R = " << shortest(box.radius)
        << ".\n";
    for (std::size_t i = 0; i < 3; ++i) {
        const auto measure = static_cast<nook::FlatLandMeasure>(i);
        out << "False maximum, " << measures[i] << ": ";
        if (nook::flat_land_has_false_maximum(box, measure))
            out << "at " << shortest(box.width / 2) << ", "
                << number(nook::flat_land_contrast(box, measure), 4)
                << " brighter than the darkest ground, at "
                << shortest(nook::flat_land_darkest(box, measure)) << '\n';
        else out << "none\n";
    }
    out << "\nOpenness of the ground in space, cosine-weighted, by the distance from the "
           "middle:\n\n";
    print_table(out, profile.positions, profile.space);
    out << "Visible angle in the plane, radians, in closed form:\n\n";
    print_table(out, profile.positions, profile.flat_land);
    out << "The largest fall is what is left of the false maximum; the spread is that of one "
           "estimate\n"
           "of N directions. R' shrinks as R/2 * min(1, sqrt(4 / N)).\n";
}

}  // namespace curtain
