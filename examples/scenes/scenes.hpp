#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "scene.hpp"

/// The built-in scenes: made by code, the same on every run.
namespace scenes {

/// A thick round bowl with a foot, on a table (Chan & Im 2021, figures 2 to 4).
struct BowlOptions {
    double radius = 1;        ///< of the rim, in (0, 3)
    double thickness = 0.06;  ///< of the wall, relative to the radius, in (0, 0.5)
    int segments = 160;       ///< around the axis, ≥ 3
};
[[nodiscard]] Scene bowl(const BowlOptions& options = {});

/// Boxes of all sizes, thrown about on the ground and stacked (Chan & Im 2021, figure 3).
struct BoxesOptions {
    int count = 46;  ///< boxes on the ground; about a third of them carry another
    std::uint64_t seed = 7;
};
[[nodiscard]] Scene boxes(const BoxesOptions& options = {});

/// Two flights of stairs in the corner of a building, with a landing, posts and a rail.
struct StairsOptions {
    int steps = 9;  ///< per flight, ≥ 1
};
[[nodiscard]] Scene stairs(const StairsOptions& options = {});

/// Chains of interlocking links that hang between thin pillars.
struct ChainsOptions {
    int pillars = 6;  ///< per row, ≥ 2
    int links = 25;   ///< per chain, ≥ 2
};
[[nodiscard]] Scene chains(const ChainsOptions& options = {});

/// Fractal hills from the viewer's feet to the mountains: distances from 0.1 to 1e5, each decade over
/// about as many rows of the picture as the next.
struct TerrainOptions {
    int columns = 400, rows = 380;  ///< of the grid: directions and distances
    std::uint64_t seed = 3;
};
[[nodiscard]] Scene terrain(const TerrainOptions& options = {});

/// A flat chequered floor seen at a slant. It fills the picture, and nothing occludes anything.
struct FloorOptions {
    double pitch = 0.75;  ///< of the view below the horizon, radians, in (0.5, π/2]
    int tiles = 48;       ///< along each side, ≥ 1
};
[[nodiscard]] Scene floor(const FloorOptions& options = {});

/// A thin curtain that hangs over flat ground (Fridvalszky & Tóth 2022, figure 2): with plain
/// ambient occlusion the ground is brightest right below it.
struct CurtainOptions {
    double width = 1;    ///< its thickness, > 0
    double gap = 5;      ///< between its lower edge and the ground, > 0
    double height = 30;  ///< from its lower edge up, > 0
    double radius = 25;  ///< the radius of the occlusion, > 0; the ground reaches farther
};
[[nodiscard]] Scene curtain(const CurtainOptions& options = {});

/// A vaulted gallery behind round arches on columns, open to a courtyard, with curtains between the
/// columns that end above the floor.
struct ArcadeOptions {
    int bays = 5;  ///< ≥ 1
};
[[nodiscard]] Scene arcade(const ArcadeOptions& options = {});

/// A Doric temple with its altar and a statue, of about 18 000 triangles. Every stone is a closed
/// solid that shares no vertex with another.
struct TempleOptions {
    int across = 6, along = 7;  ///< columns of the front and of the sides, ≥ 5
    std::uint64_t seed = 5;
};
[[nodiscard]] Scene temple(const TempleOptions& options = {});

/// A small desert city of about 500 000 triangles: mud-brick houses along a market street, a wall
/// with towers around them, palms, dunes. All are closed solids that share no vertex.
struct CityOptions {
    int columns = 5, rows = 12;  ///< of houses, on each side of the street; ≥ 1
    std::uint64_t seed = 11;
};
[[nodiscard]] Scene city(const CityOptions& options = {});

/// A vaulted corridor seen from inside, of about 290 000 triangles: floor, walls, vault and ends
/// are one closed surface wound towards the room, full of ribs, niches, coffers and pipes.
struct CorridorOptions {
    int bays = 10;           ///< of 3 m, ≥ 1
    double spacing = 0.092;  ///< of grid lines between the edges of the relief, metres, > 0
};
[[nodiscard]] Scene corridor(const CorridorOptions& options = {});

/// A tea cup with a handle and a foot, alone: one closed surface of about 19 000 triangles of even
/// size (González, Sbert & Feixas 2008, figure 3, shows such an object).
struct CupOptions {
    double edge = 0.046;  ///< of a triangle, relative to the radius of the rim, in [0.03, 0.1]
};
[[nodiscard]] Scene cup(const CupOptions& options = {});

/// A tree, alone: trunk, branches and twigs are closed tubes that begin inside each other; each leaf
/// is a sheet of two triangles, slightly folded.
struct TreeOptions {
    int leaves = 20;  ///< per twig, ≥ 0
    std::uint64_t seed = 2;
};
[[nodiscard]] Scene tree(const TreeOptions& options = {});

/// A chess queen, turned on a lathe, alone: one closed surface of about 30 000 triangles of even size.
struct LatheOptions {
    double edge = 0.036;  ///< of a triangle; the queen is 3.7 high; in [0.025, 0.06]
};
[[nodiscard]] Scene lathe(const LatheOptions& options = {});

/// Nothing but sky.
[[nodiscard]] Scene empty();

/// A scene by name.
struct Entry {
    const char* name;
    const char* what;
    Scene (*make)();
    /// It is shown in figures 2 and 4 of Chan & Im 2021.
    bool figures = false;
    /// An object in empty space.
    bool alone = false;
    /// Thin things hang in it, whose other side plain rays light.
    bool thin = false;
};
[[nodiscard]] std::span<const Entry> all();

/// The built-in scene of that name, or, for a name that ends in .obj, the triangles of that file, all
/// in the picture of width / height = `aspect`. Throws support::Failure.
[[nodiscard]] Scene load(const std::string& name, double aspect);

}  // namespace scenes
