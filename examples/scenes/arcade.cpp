#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "builder.hpp"
#include "scenes.hpp"

// A gallery of square bays along x. Its pillars stand at z = 0, its wall is behind them, the courtyard
// in front. Lengths in metres; the floor of the gallery lies at y = 0.

namespace scenes {

namespace {

constexpr double pi = std::numbers::pi;

constexpr double pitch = 3, depth = 3.2;            // of a bay: along x, and from pillars to wall
constexpr double springing = 2.7, rise = 1.3;       // where the vaults start, and how far they rise
constexpr double wall_top = 4.75, thickness = 0.5;  // of the wall that the pillars carry
constexpr double arch_radius = 1.12;                // of the openings in it
constexpr double rib = 0.13;                        // half the width of the ribs between the bays
constexpr double court = -0.34;                     // the level of the courtyard

constexpr support::Rgb stone{0.68f, 0.63f, 0.54f}, plaster{0.76f, 0.72f, 0.64f},
    marble{0.74f, 0.72f, 0.68f}, dark_tile{0.40f, 0.27f, 0.22f}, pale_tile{0.66f, 0.60f, 0.50f},
    paving{0.56f, 0.54f, 0.50f}, oak{0.34f, 0.22f, 0.13f}, brass{0.55f, 0.42f, 0.20f};

/// A column on a square plinth: base of two rolls, swelling shaft, bell, abacus.
void add_column(Builder& builder, const glm::dvec3& foot)
{
    constexpr double radius = 0.20, plinth = 0.12, abacus = 0.12;
    constexpr double shaft_foot = 0.34, shaft_top = springing - 0.46;
    std::vector<glm::dvec2> profile;  // from the top down
    const auto roll = [&](double middle, double out, double size) {
        for (int i = 0; i <= 6; ++i) {
            const double angle = pi / 2 - pi * i / 6;
            profile.push_back({out + size * std::cos(angle), middle + size * std::sin(angle)});
        }
    };
    // The bell widens to the abacus.
    for (int i = 0; i <= 8; ++i) {
        const double down = i / 8.0, flare = std::pow(1 - down, 2.2);
        profile.push_back({0.17 + 0.13 * flare, springing - abacus - 0.30 * down});
    }
    roll(shaft_top, 0.17, 0.026);
    for (int i = 0; i <= 6; ++i) {
        const double down = i / 6.0;
        profile.push_back({radius - 0.035 * std::pow(1 - down, 1.6),
                           std::lerp(shaft_top - 0.03, shaft_foot + 0.02, down)});
    }
    roll(shaft_foot - 0.035, radius + 0.005, 0.033);
    roll(plinth + 0.075, radius + 0.035, 0.05);
    profile.push_back({radius + 0.035, plinth});
    std::reverse(profile.begin(), profile.end());
    builder.turned(foot, profile, 48, marble);
    builder.box(foot + glm::dvec3{0, plinth / 2, 0}, {0.31, plinth / 2, 0.31}, marble);
    builder.box(foot + glm::dvec3{0, springing - abacus / 2, 0}, {0.33, abacus / 2, 0.30}, marble);
}

/// A wall of several bays about x = 0 with a round-headed opening in each.
struct ArchedWall {
    int bays;
    double front, back;        ///< z of both faces
    double radius, springing;  ///< of the openings
    double base, top;          ///< base: where the piers start, at the springing or below
};

void add_arched_wall(Builder& builder, const ArchedWall& wall, const support::Rgb& colour)
{
    constexpr int segments = 40;
    const double end = wall.bays * pitch / 2;
    // Along the foot, over each opening, and back along the top.
    std::vector<glm::dvec2> outline{{-end, wall.base}};
    const auto pier = [&](double x) {
        if (wall.base < wall.springing) outline.emplace_back(x, wall.base);
    };
    for (int bay = 0; bay < wall.bays; ++bay) {
        const double centre = (bay + 0.5) * pitch - end;
        pier(centre - wall.radius);
        for (int i = 0; i <= segments; ++i) {
            const double angle = pi * (1 - double(i) / segments);
            outline.emplace_back(centre + wall.radius * std::cos(angle),
                                 wall.springing + wall.radius * std::sin(angle));
        }
        pier(centre + wall.radius);
    }
    outline.insert(outline.end(), {{end, wall.base}, {end, wall.top}, {-end, wall.top}});
    builder.prism(outline, {0, 0, wall.back}, {1, 0, 0}, {0, 1, 0}, {0, 0, wall.front - wall.back},
                  colour);
}

/// A bar of rectangular section bent over half an ellipse from `centre` − `across` to + `across`:
/// `out` beyond the ellipse, `in` within, `half_width` to both sides of it.
struct Moulding {
    glm::dvec3 centre, across;
    double rise, out, in, half_width;
};

void add_moulding(Builder& builder, const Moulding& arch, const support::Rgb& colour)
{
    constexpr double corners[4][2] = {{1, -1}, {1, 1}, {-1, 1}, {-1, -1}};
    constexpr int segments = 40;
    const double span = glm::length(arch.across);
    const glm::dvec3 side = arch.across / span, aside = glm::cross(glm::dvec3{0, 1, 0}, side);
    builder.loft(
        4, segments + 1,
        [&](int i, int j) {
            const auto& corner = corners[i];
            const double more = corner[0] > 0 ? arch.out : -arch.in;
            const double angle = pi * j / segments;
            return arch.centre + side * ((span + more) * std::cos(angle)) +
                   glm::dvec3{0, (arch.rise + more) * std::sin(angle), 0} +
                   aside * (corner[1] * arch.half_width);
        },
        colour);
}

/// A closed block with a sheet for a face: point(i, j), i = 0 … columns, j = 0 … rows, as seen from
/// outside. The other faces are flat: upright from the edges of the sheet to `level`, and level
/// there. colour(i, j) is that of a quad; their diagonals run towards the middle of the sheet.
template <class Point, class Colour>
void add_faced_block(Builder& builder, int columns, int rows, double level, Point&& point,
                     Colour&& colour, const support::Rgb& rest)
{
    std::vector<std::uint32_t> sheet;
    for (int j = 0; j <= rows; ++j)
        for (int i = 0; i <= columns; ++i) sheet.push_back(builder.vertex(point(i, j)));
    const auto at = [&](int i, int j) {
        return sheet[static_cast<std::size_t>(j * (columns + 1) + i)];
    };
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1),
                                d = at(i, j + 1);
            if ((2 * i < columns) == (2 * j < rows)) builder.quad(a, b, c, d, colour(i, j));
            else builder.quad(b, c, d, a, colour(i, j));
        }
    // Once around, along the edges of the sheet.
    std::vector<std::uint32_t> edge, foot;
    glm::dvec3 middle{0, level, 0};
    const int around = 2 * (columns + rows);
    const auto add = [&](int i, int j) {
        glm::dvec3 place = point(i, j);
        place.y = level;
        edge.push_back(at(i, j));
        foot.push_back(builder.vertex(place));
        middle += glm::dvec3{place.x, 0, place.z} / double(around);
    };
    for (int i = 0; i < columns; ++i) add(i, 0);
    for (int j = 0; j < rows; ++j) add(columns, j);
    for (int i = columns; i > 0; --i) add(i, rows);
    for (int j = rows; j > 0; --j) add(0, j);
    const std::uint32_t hub = builder.vertex(middle);
    for (std::size_t i = 0; i < edge.size(); ++i) {
        const std::size_t next = (i + 1) % edge.size();
        builder.quad(edge[next], edge[i], foot[i], foot[next], rest);
        builder.triangle(hub, foot[next], foot[i], rest);
    }
}

/// A groin vault over the bay around (x, z): two barrels of equal rise that cross.
void add_vault(Builder& builder, double x, double z)
{
    constexpr int half = 12;  // quads from the middle to an edge; the groins are their diagonals
    add_faced_block(
        builder, 2 * half, 2 * half, springing + rise + 0.2,
        [&](int i, int j) {
            const double u = pi / 2 * (i - half) / half, v = pi / 2 * (j - half) / half;
            return glm::dvec3{x + pitch / 2 * std::sin(u),
                              springing + rise * (std::max)(std::cos(u), std::cos(v)),
                              z + depth / 2 * std::sin(v)};
        },
        [](int, int) { return plaster; }, plaster);
}

/// A curtain in the plane z = const: it hangs from `top` down to `hem`.
struct Drapery {
    double left, right, top, hem, z;
    int folds;
    double sway = 0;  ///< how far the hem hangs to the right of the top
    support::Rgb colour;
};

void add_drapery(Builder& builder, const Drapery& cloth)
{
    constexpr double half = 0.012;  // of the thickness of the cloth
    constexpr int rows = 8;
    const int across = 10 * cloth.folds;
    // The middle of the cloth. Folds are narrow at the rod and open downwards.
    const auto middle = [&](double s, double down) {
        const double phase = 2 * pi * cloth.folds * s;
        const double deep = (0.035 + 0.045 * down) * (1 + 0.35 * std::sin(3.7 * s + 1.1));
        const double lean = 0.5 * std::sin(0.5 * phase + 2.2 * down);
        return glm::dvec3{
            std::lerp(cloth.left, cloth.right, s) + cloth.sway * down * down +
                0.018 * std::sin(2 * phase + lean),
            std::lerp(cloth.top, cloth.hem, down) + 0.012 * down * std::sin(phase + 0.7),
            cloth.z + deep * std::sin(phase + lean)};
    };
    // Along the front and back again, so that the cloth is closed; the first and last row close its
    // top and hem.
    builder.surface(
        {rows + 2, 2 * across, false, true},
        [&](double u, double v) {
            const auto column = static_cast<int>(std::lround(v * 2 * across));
            const auto row = static_cast<int>(std::lround(u * (rows + 2)));
            const bool front = column <= across;
            const double s = double(front ? column : 2 * across - column) / across;
            const double down = std::clamp((row - 1.0) / rows, 0.0, 1.0);
            const glm::dvec3 point = middle(s, down);
            const bool closed = row == 0 || row == rows + 2 || column == 0 || column == across;
            if (closed) return point;
            const glm::dvec3 along = middle(s + 1e-5, down) - middle(s - 1e-5, down);
            const glm::dvec3 out = glm::normalize(glm::dvec3{along.z, 0, -along.x});
            return point - out * (front ? half : -half);
        },
        [&](double, double) { return cloth.colour; });
}

void add_rod(Builder& builder, double left, double right, double height)
{
    builder.bar({left, height, 0}, {right, height, 0}, 0.02, brass);
}

}  // namespace

Scene arcade(const ArcadeOptions& options)
{
    Scene scene;
    scene.name = "arcade";
    Builder builder;
    const int bays = options.bays;
    const double half = bays * pitch / 2, wall_z = -depth - thickness / 2;
    const double vault_z = -thickness / 2 - depth / 2, end = half + 0.4;

    // The ground: courtyard, two steps, tiles.
    builder.box({0, court - 0.1, 3.6}, {end + 1, 0.1, 4.4}, paving);
    builder.box({0, court / 2 - 0.03, -depth / 2 - 0.1}, {end, -court / 2, depth / 2 + 0.85},
                stone);
    builder.box({0, court * 0.75, 0.85}, {end, -court / 4, 0.35}, stone);
    builder.box({0, -0.03, 0.65}, {end, 0.03, 0.15}, stone);
    const int tiles = 6 * bays;
    add_faced_block(
        builder, tiles, 8, -0.05,
        [&](int i, int j) {
            return glm::dvec3{std::lerp(-end, end, double(i) / tiles), 0,
                              std::lerp(0.5, wall_z, j / 8.0)};
        },
        [](int i, int j) { return (i + j) % 2 == 0 ? pale_tile : dark_tile; }, stone);

    // Column, rib and pilaster between the bays.
    for (int i = 0; i <= bays; ++i) {
        const double x = i * pitch - half;
        add_column(builder, {x, 0, 0});
        add_moulding(builder, {{x, springing, vault_z}, {0, 0, depth / 2}, rise, 0.02, 0.14, rib},
                     stone);
        builder.box({x, springing / 2, wall_z + 0.06}, {0.24, springing / 2, 0.10}, stone);
        builder.box({x, 0.1, wall_z + 0.08}, {0.30, 0.1, 0.14}, stone);
        builder.box({x, springing - 0.07, wall_z + 0.08}, {0.30, 0.07, 0.14}, stone);
    }
    // Arches to the courtyard, a wall with niches, vaults between.
    add_arched_wall(
        builder, {bays, thickness / 2, -thickness / 2, arch_radius, springing, springing, wall_top},
        plaster);
    add_arched_wall(builder, {bays, wall_z, wall_z - 0.4, 0.62, 1.75, 0, wall_top}, plaster);
    for (int i = 0; i < bays; ++i) {
        const double x = (i + 0.5) * pitch - half;
        for (const double face : {thickness / 2, -thickness / 2})
            add_moulding(builder,
                         {{x, springing, face}, {arch_radius, 0, 0}, arch_radius, 0.2, 0.0, 0.035},
                         stone);
        add_vault(builder, x, vault_z);
        add_moulding(builder, {{x, 1.75, wall_z}, {0.62, 0, 0}, 0.62, 0.14, 0.0, 0.04}, stone);
        builder.box({x, 1.2, wall_z - 0.4}, {0.7, 1.2, 0.05}, i % 2 == 0 ? oak : plaster);
        if (i % 2 == 0) continue;
        builder.box({x, 0.42, wall_z + 0.26}, {0.95, 0.05, 0.24}, stone);
        for (const double leg : {-0.7, 0.7})
            builder.box({x + leg, 0.185, wall_z + 0.26}, {0.09, 0.185, 0.2}, stone);
    }
    // The ends, the roof, the cornice.
    for (const double side : {-1.0, 1.0})
        builder.box({side * (half + 0.3), wall_top / 2, vault_z},
                    {0.12, wall_top / 2, depth / 2 + thickness}, plaster);
    builder.box({0, wall_top + 0.05, vault_z}, {end, 0.05, depth / 2 + thickness}, stone);
    builder.box({0, wall_top - 0.03, thickness / 2}, {end, 0.05, 0.12}, stone);
    builder.box({0, wall_top + 0.09, thickness / 2}, {end, 0.07, 0.22}, stone);

    // Curtains: drawn, half drawn, short; the hems hang above the floor.
    constexpr support::Rgb crimson{0.60f, 0.10f, 0.08f}, ochre{0.70f, 0.46f, 0.12f},
        blue{0.12f, 0.24f, 0.46f};
    constexpr double rod = 2.5, clear = 0.30;
    for (int i = 0; i < bays; ++i) {
        const double left = i * pitch - half + clear, right = left + pitch - 2 * clear;
        if (i % 5 != 3) add_rod(builder, left - 0.15, right + 0.15, rod);
        switch (i % 5) {
        case 0: add_drapery(builder, {left, right, rod, 0.35, 0, 13, 0, blue}); break;
        case 1: add_drapery(builder, {left, right, rod, 0.30, 0, 13, 0, crimson}); break;
        case 2:
            add_drapery(builder, {left, left + 0.95, rod, 0.10, 0, 8, -0.1, ochre});
            add_drapery(builder, {right - 0.75, right, rod, 0.10, 0, 7, 0.1, ochre});
            break;
        case 4: add_drapery(builder, {left, right, rod, 1.10, 0, 13, 0, crimson}); break;
        default: break;
        }
    }
    builder.finish(scene);
    scene.camera.eye = {-6.3, 1.95, -2.8};
    scene.camera.target = {-1.7, 1.1, -0.65};
    scene.camera.vertical_fov = 0.95;
    scene.radius = 2;
    return scene;
}

}  // namespace scenes
