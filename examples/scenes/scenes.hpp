#pragma once

#include <cstdint>
#include <span>

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

/// Nothing but sky.
[[nodiscard]] Scene empty();

/// A scene by name.
struct Entry {
    const char* name;
    const char* what;
    Scene (*make)();
    /// It is shown in figures 2 and 4 of Chan & Im 2021.
    bool figures = false;
};
[[nodiscard]] std::span<const Entry> all();

}  // namespace scenes
