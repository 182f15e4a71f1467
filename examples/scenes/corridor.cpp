#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "builder.hpp"
#include "scenes.hpp"

// A vaulted corridor that starts at the origin, leads along −z and turns to the right. Its floor,
// walls, vault and both ends are one closed surface with the air inside: relief is a displacement
// of a smooth tunnel into the room (positive) or into the rock (negative). Lengths in metres.

namespace scenes {

namespace {

constexpr double pi = std::numbers::pi;

constexpr double half_width = 1.6, wall_height = 1.9;  // the vault is half a circle on the walls
constexpr double bay = 3;
// Around the section: from the middle of the floor to the right, up, over the vault, down, back.
constexpr double wall_foot = half_width, springing = wall_foot + wall_height,
                 crown = springing + pi * half_width / 2;
constexpr double straight = 13, bend = 34;  // length of the first stretch; radius of the rest

constexpr support::Rgb stone{0.58f, 0.55f, 0.50f}, dressed{0.70f, 0.67f, 0.60f},
    paving{0.42f, 0.41f, 0.40f}, plaster{0.72f, 0.66f, 0.55f}, copper{0.58f, 0.33f, 0.20f},
    slate{0.30f, 0.33f, 0.36f};

/// What there is at a place of the tunnel: `side` runs from the middle of the floor up to the
/// crown, `along` down the corridor.
struct Relief {
    double height = 0;
    support::Rgb colour{};
};

struct Band {
    double from, to;
    [[nodiscard]] bool holds(double x) const { return x > from && x < to; }
    [[nodiscard]] double middle() const { return (from + to) / 2; }
};

// Along a bay, from one rib to the next.
constexpr double rib = 0.24, rib_core = 0.15;
constexpr Band niche{0.75, 2.25}, coffers[] = {{0.42, 1.36}, {1.64, 2.58}};
constexpr double joints[] = {0.75, 1.5, 2.25}, flange = 1.5, flange_half = 0.05;
constexpr double joint = 0.014;
// Across: on the floor, on the wall, on the vault.
constexpr Band channel{-0.24, 0.24}, kerb{0.78, 0.95};
constexpr Band plinth{wall_foot, wall_foot + 0.28}, recess{wall_foot + 0.52, wall_foot + 1.5},
    cornice{springing - 0.10, springing + 0.04};
constexpr double pipes[] = {springing + 0.22, springing + 0.50}, pipe_radius[] = {0.11, 0.075};
constexpr Band lacunae[] = {{springing + 0.72, springing + 1.28},
                            {springing + 1.44, springing + 2.0},
                            {springing + 2.16, crown - 0.14}};

/// How many points of a grid line lie from 0 to `length`: two at both sides of each edge, the rest
/// spread out evenly.
std::vector<double> grid_lines(std::vector<double> edges, double length, double spacing)
{
    constexpr double half = 0.003;
    std::sort(edges.begin(), edges.end());
    std::vector<double> lines{0};
    const auto fill = [&](double to) {
        const double from = lines.back();
        const int count = (std::max)(1, static_cast<int>(std::ceil((to - from) / spacing - 0.3)));
        for (int i = 1; i <= count; ++i) lines.push_back(std::lerp(from, to, double(i) / count));
    };
    for (const double edge : edges) {
        if (edge - half > lines.back() + half) fill(edge - half);
        if (edge + half > lines.back() + half) lines.push_back(edge + half);
    }
    fill(length);
    return lines;
}

/// The half of the section from the middle of the floor to the crown.
std::vector<double> lines_across(double spacing)
{
    std::vector<double> edges{channel.to,  kerb.from, kerb.to,      plinth.to,
                              recess.from, recess.to, cornice.from, cornice.to};
    for (const Band& lacuna : lacunae) edges.insert(edges.end(), {lacuna.from, lacuna.to});
    for (int i = 0; i < 2; ++i)
        for (int k = -6; k <= 6; ++k)
            edges.push_back(pipes[i] + pipe_radius[i] * std::sin(pi / 12 * k));
    return grid_lines(std::move(edges), crown, spacing);
}

std::vector<double> lines_along(int bays, double spacing)
{
    std::vector<double> edges;
    for (int i = 0; i < bays; ++i) {
        const double start = i * bay;
        for (const double at : {rib_core, rib, bay - rib, bay - rib_core})
            edges.push_back(start + at);
        for (const Band& band : {niche, coffers[0], coffers[1]})
            edges.insert(edges.end(), {start + band.from, start + band.to});
        for (const double at : joints)
            edges.insert(edges.end(), {start + at - joint, start + at + joint});
        edges.insert(edges.end(), {start + flange - flange_half, start + flange + flange_half});
    }
    return grid_lines(std::move(edges), bays * bay, spacing);
}

/// The relief at a place; right: on the right side.
Relief relief(double side, double along, bool right)
{
    const int number = static_cast<int>(along / bay);
    const double in_bay = along - number * bay;
    const double to_rib = (std::min)(in_bay, bay - in_bay);
    if (side < wall_foot) {
        if (side < channel.to) return {-0.16, slate};
        const bool groove = std::any_of(std::begin(joints), std::end(joints),
                                        [&](double at) { return std::fabs(in_bay - at) < joint; });
        if (kerb.holds(side)) return {groove ? 0.03 : 0.05, stone};
        return {groove ? -0.025 : 0, paving};
    }
    for (int i = 0; i < 2; ++i) {
        const double from = std::fabs(side - pipes[i]);
        const bool wide = std::fabs(in_bay - flange) < flange_half && i == 0;
        const double radius = pipe_radius[i];
        if (from < radius && to_rib > rib + 0.001)
            return {(wide ? 0.16 : 0.06) + std::sqrt(radius * radius - from * from), copper};
    }
    if (to_rib < rib_core) return {0.30, dressed};
    if (to_rib < rib) return {0.20, dressed};
    if (plinth.holds(side)) return {0.12, stone};
    if (cornice.holds(side)) return {0.15, dressed};
    if (recess.holds(side) && niche.holds(in_bay)) {
        // In turn: an apse, a plain niche, one with bosses.
        switch ((number + (right ? 1 : 0)) % 3) {
        case 0: {
            const double aside = (in_bay - niche.middle()) / (niche.to - niche.middle());
            return {-0.10 - 0.42 * std::sqrt((std::max)(0.0, 1 - aside * aside)), plaster};
        }
        case 1: return {-0.34, slate};
        default: {
            const double u = std::sin(pi * (in_bay - niche.from) / 0.5),
                         v = std::sin(pi * (side - recess.from) / 0.49);
            return {-0.26 + 0.24 * u * u * v * v, stone};
        }
        }
    }
    for (const Band& lacuna : lacunae)
        for (const Band& coffer : coffers) {
            if (!lacuna.holds(side) || !coffer.holds(in_bay)) continue;
            const double u = std::sin(pi * (side - lacuna.from) / (lacuna.to - lacuna.from)),
                         v = std::sin(pi * (in_bay - coffer.from) / (coffer.to - coffer.from));
            return {-0.12 - 0.12 * u * v, plaster};
        }
    if (side > springing) return {0, plaster};
    // Rubble: rows of stones with rounded faces.
    const double row = (side - wall_foot) / 0.3, shift = 0.5 * (static_cast<int>(row) % 2);
    const double stones = in_bay / 0.5 + shift;
    const double u = std::sin(pi * (stones - std::floor(stones))),
                 v = std::sin(pi * (row - std::floor(row)));
    return {0.035 * std::sqrt(std::sqrt((std::max)(0.0, u * v))), stone};
}

/// A point of the section, x to the right; the height of the relief at the foot of the wall draws
/// the edge of the floor in, so that it ends at the wall.
glm::dvec3 section(double side, double height, double foot)
{
    if (side < kerb.to) return {side, height, 0};
    if (side < wall_foot)
        return {kerb.to + (side - kerb.to) * (1 - foot / (half_width - kerb.to)), height, 0};
    if (side < springing) return {half_width - height, side - wall_foot, 0};
    const double angle = (side - springing) / half_width, radius = half_width - height;
    return {radius * std::cos(angle), wall_height + radius * std::sin(angle), 0};
}

/// From the section at a distance down the corridor to the world.
glm::dvec3 place(const glm::dvec3& across, double along)
{
    if (along < straight) return {across.x, across.y, -along};
    const double angle = (along - straight) / bend, radius = bend - across.x;
    return {bend - radius * std::cos(angle), across.y, -straight - radius * std::sin(angle)};
}

}  // namespace

Scene corridor(const CorridorOptions& options)
{
    Scene scene;
    scene.name = "corridor";
    Builder builder;
    const std::vector<double> half = lines_across(options.spacing),
                              rows = lines_along(options.bays, options.spacing);
    // Both halves share the middle of the floor and the crown.
    const int side_count = static_cast<int>(half.size()), columns = 2 * (side_count - 1);
    struct Place {
        double side;
        bool right;
    };
    const auto column = [&](int i) -> Place {
        const bool right = i < side_count;
        return {half[static_cast<std::size_t>(right ? i : columns - i)], right};
    };
    // The ends: rings that close in upon the middle of a door.
    constexpr double shrink[] = {0, 0.05, 0.052, 0.30, 0.302, 0.60, 0.8};
    constexpr double depth[] = {0, 0, 0.25, 0.25, 0.15, 0.10, 0.10};
    constexpr int rings = 7;
    const int down = static_cast<int>(rows.size());
    const double length = rows.back();
    const glm::dvec3 door{0, 1.5, 0};
    const auto point = [&](int i, int j) {
        const Place from = column(i % columns);
        const auto at = [&](double along) {
            const double height = relief(from.side, along, from.right).height;
            const double foot = relief(wall_foot + 1e-6, along, from.right).height;
            glm::dvec3 result = section(from.side, height, foot);
            if (!from.right) result.x = -result.x;
            return result;
        };
        const int ring = j < 0 ? -j : j - (down - 1);
        if (j >= 0 && ring <= 0) {
            const double along = rows[static_cast<std::size_t>(j)];
            return place(at(along), along);
        }
        const double along = j < 0 ? 0 : length, in = ring < rings ? shrink[ring] : 1;
        const double into = depth[(std::min)(ring, rings - 1)];
        return place(at(along) * (1 - in) + door * in, j < 0 ? along - into : along + into);
    };
    const int total = down + 2 * rings;
    builder.surface(
        {columns, total - 1, true, false},
        [&](double u, double v) {
            return point(static_cast<int>(std::lround(u * columns)),
                         static_cast<int>(std::lround(v * (total - 1))) - rings);
        },
        [&](double u, double v) {
            const int i = static_cast<int>(u * columns),
                      j = static_cast<int>(v * (total - 1)) - rings;
            if (j < 0 || j + 1 >= down) return slate;
            const auto [side, right] = column(i);
            const double next = column((i + 1) % columns).side;
            const double along =
                (rows[static_cast<std::size_t>(j)] + rows[static_cast<std::size_t>(j) + 1]) / 2;
            return relief((side + next) / 2, along, i < side_count - 1).colour;
        });
    builder.finish(scene);
    scene.camera.eye = {-0.55, 1.62, -0.6};
    scene.camera.target = {0.35, 1.45, -8};
    scene.camera.vertical_fov = 1.1;
    scene.radius = 0.3;
    return scene;
}

}  // namespace scenes
