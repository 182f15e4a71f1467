#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <nook/scene/flat_land.hpp>

namespace curtain {

struct Options {
    nook::FlatLandCurtain curtain{};
    /// Per position and curve, in sets or in one: a power of two from 64 on.
    int directions = 16384;
    int threads = 1;
};

/// The ground from the middle under the box outwards.
struct Curve {
    std::string name;  ///< a key, and the head of a column
    std::string what;
    double secondary_radius = 0;  ///< 0: none
    /// Directions per estimate; 0 for what is computed in closed form.
    int directions = 0;
    std::vector<double> values{};  ///< one per position
    /// Standard deviation of one estimate, averaged over the positions; 0 for a single set.
    double spread = 0;
    std::uint64_t rays = 0, skipped_rays = 0;
};

/// How much darker it gets on the way out: the largest fall from any position to one farther out. 0
/// for a curve that only rises.
[[nodiscard]] double largest_fall(const Curve& curve);

struct Profile {
    Options options;
    std::vector<double> positions;
    std::vector<Curve> space;      ///< openness in [0, 1], cosine-weighted
    std::vector<Curve> flat_land;  ///< visible angle in [0, pi]
};

/// Traces and computes every curve. Throws support::Failure.
[[nodiscard]] Profile run(const Options& options);

/// The contents of a file.
[[nodiscard]] nlohmann::ordered_json json_of(const Profile& profile);

/// Two tables, every few positions.
void print_tables(std::ostream& out, const Profile& profile);

/// Two plots side by side: the plane and space. Throws support::Failure.
void write_plot(const std::filesystem::path& path, const Profile& profile);

}  // namespace curtain
