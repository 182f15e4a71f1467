#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <nook/owned_image.hpp>

/// How kernels stand inputs that are stiff, extreme or poisoned, beside the textbook ways to compute
/// the same, all against what is known exactly.
///
/// A family of kernels has its cases, its algorithms and its metrics, and delivers a row for each case
/// and algorithm. Another family is a function like `watertightness` and an entry in `run`.
namespace stability {

// --- results of any family ------------------------------------------------------------------------

/// The name of a case, an algorithm or a metric, and what it is in a line.
struct Label {
    std::string name;  ///< lower case; words joined by dashes or underscores
    std::string what;
};

/// What one algorithm made of one case.
struct Row {
    std::string case_name, algorithm;
    /// What it ran with and was measured on.
    nlohmann::ordered_json parameters;
    /// One for each metric of the family, 0 at best; empty where the metric says nothing. Infinity and
    /// NaN are results.
    std::vector<std::optional<double>> values;
    /// The worst of its inputs: which pixel, point or ray, with its numbers, and what came out. Numbers
    /// come back exactly. Empty where nothing is wrong.
    std::string worst{};
    /// The metric that `worst` is about.
    std::size_t worst_metric = 0;
};

struct Family {
    Label label;
    std::vector<Label> metrics, cases, algorithms;
    std::vector<Row> rows;
};

struct Options {
    /// Pixels across the windows of depth filters: odd, 3 … largest_window. A row for each.
    std::vector<int> windows{3, 17, 65};
};
constexpr int largest_window = 95;

/// Every family.
[[nodiscard]] std::vector<Family> run(const Options& options = {});

/// The contents of a file or of a key in one: `families` with their labels, and `rows`. What does not
/// apply and what is not finite become null; `worst` starts with the name of its metric.
[[nodiscard]] nlohmann::ordered_json json_of(const std::vector<Family>& families);

/// A table per metric: a line per case, a column per algorithm, the worst of their rows. Below it, for
/// each of nook's algorithms, the worst case and its worst input.
void print_tables(std::ostream& out, const std::vector<Family>& families);

// --- the family of depth filters ------------------------------------------------------------------

struct Point {
    int x, y;
};

/// Size of every case: small enough for seconds in all, large enough for sums to drift.
constexpr int width = 192, height = 144;

/// A depth buffer that is hard on a filter. A window is *clean* when it holds no poisoned pixel.
struct DepthInput {
    nook::Image<float> depth;
    /// Where the poison is (1), and the same depths without it. Empty for a case without poison.
    nook::Image<std::uint8_t> poisoned{};
    nook::Image<float> healthy{};
    /// Pixels whose windows are worth a look, beside those looked at anyway.
    std::vector<Point> focus{};
};

struct DepthCase {
    Label label;
    /// For a window of so many pixels.
    std::function<DepthInput(int window)> make;
};
[[nodiscard]] std::vector<DepthCase> depth_cases();

/// What a type of numbers can hold.
enum class Precision : std::uint8_t { binary32, binary64 };

/// Variance and visibility of pixels whose window lies inside the image; what the others hold does not
/// matter. An algorithm without a variance leaves that image empty.
struct DepthOutput {
    nook::Image<double> variance{}, visibility{};
};

struct DepthAlgorithm {
    Label label;
    Precision precision;  ///< of its outputs
    std::function<DepthOutput(const nook::Image<float>& depth, int window)> run;
};
[[nodiscard]] std::vector<DepthAlgorithm> depth_algorithms();

/// The terrain scene, distances from 0.1 to 1e5 in one picture, shaded by the float textbook forms and
/// by nook from the same float depths, without bias. Where windows leave the picture it stays white.
/// Throws Failure when the file cannot be written.
void write_terrain(const std::filesystem::path& path);

/// Every case × algorithm × window.
[[nodiscard]] Family depth_filters(const Options& options);

// --- the families of rays -------------------------------------------------------------------------

/// Rays at the vertices and edges of a closed mesh; at scales, and far from zero.
[[nodiscard]] Family watertightness();
/// Rays that hit the surface they start from, of points far from zero and pixels far away.
[[nodiscard]] Family self_hits();
/// 1 − exp(−σ d) from tiny to large σ d, and of a miss.
[[nodiscard]] Family falloffs();
/// Visibility in a scene that is scaled or moved, against the scene at home.
[[nodiscard]] Family ray_scales();

// --- the families of surfaces -----------------------------------------------------------------------

/// Obscurance from depth and normals: far away, at all radii, on flat ground of all tilts.
[[nodiscard]] Family surface_obscurance();
/// The same of slices of the hemisphere, with horizons and with bitmasks.
[[nodiscard]] Family surface_slices();
/// The same of the depth buffer as a height field.
[[nodiscard]] Family surface_height_field();
/// A blur beside the sky.
[[nodiscard]] Family surface_blur();
/// From half the resolution to the full one beside the sky.
[[nodiscard]] Family surface_upsampling();

// --- the family of the viewpoint channel ----------------------------------------------------------

/// Mutual information of polygons and viewpoints: equal polygons, large counts, many polygons, small
/// triangles.
[[nodiscard]] Family information();

}  // namespace stability
