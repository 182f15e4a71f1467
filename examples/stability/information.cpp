#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <nook/owned_image.hpp>
#include <nook/scene/channel_measures.hpp>
#include <nook/scene/information_ao.hpp>
#include <nook/scene/polygon_values.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scene/viewpoints.hpp>

#include "../support/checked.hpp"
#include "random.hpp"
#include "stability.hpp"
#include "worst.hpp"

namespace stability {

namespace {

/// Visible areas: view after view, polygon after polygon.
struct Areas {
    std::size_t views = 0, polygons = 0;
    std::vector<double> values;

    Areas() = default;
    Areas(std::size_t view_count, std::size_t polygon_count)
        : views{view_count},
          polygons{polygon_count},
          values(view_count * polygon_count)
    {}
    [[nodiscard]] double& operator()(std::size_t v, std::size_t o)
    {
        return values[v * polygons + o];
    }
    [[nodiscard]] double operator()(std::size_t v, std::size_t o) const
    {
        return values[v * polygons + o];
    }
};

constexpr int small_triangle_level = 2;

/// What is made of them.
struct Maps {
    double total = 0;
    std::vector<double> probability, information, visibility;
    std::vector<char> seen;
};

/// A mesh of its own, for what does not begin with areas.
struct Solid {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;

    [[nodiscard]] nook::MeshView mesh() const
    {
        return {positions.data(), positions.size() / 3, indices.data(), indices.size() / 3};
    }
};

struct Case {
    Label label;
    Areas areas;  ///< as an item buffer counts them, or analytic
    /// The areas of which `areas` is an image of finite resolution; empty: they are exact.
    Areas truth{};
    bool pixels = false;  ///< areas are whole numbers
    /// By symmetry every polygon has the same information.
    bool symmetric = false;
    Solid solid{};
    int resolution = 0;  ///< of the item buffers
};

std::vector<glm::dvec3> directions(int level)
{
    std::vector<glm::dvec3> result(nook::icosphere_size(level));
    nook::icosphere(level, result.data());
    return result;
}

// --- as the paper has it --------------------------------------------------------------------------

/// The formulas of González, Sbert & Feixas 2008 as they are written, sums in `Sum`, their grand total in
/// `Count`. Terms that are 0 are left out.
template <class Sum, class Count>
Maps textbook(const Case& subject)
{
    const Areas& areas = subject.areas;
    std::vector<Sum> by_view(areas.views);
    Count total = 0;
    for (std::size_t v = 0; v < areas.views; ++v) {
        for (std::size_t o = 0; o < areas.polygons; ++o)
            by_view[v] += static_cast<Sum>(areas(v, o));
        total = static_cast<Count>(total + static_cast<Count>(by_view[v]));
    }
    const auto p_view = [&](std::size_t v) { return by_view[v] / static_cast<Sum>(total); };
    const auto joint = [&](std::size_t v, std::size_t o) {
        return p_view(v) * (static_cast<Sum>(areas(v, o)) / by_view[v]);
    };
    Maps maps;
    maps.total = static_cast<double>(total);
    Sum lowest = std::numeric_limits<Sum>::max(), highest = 0;
    for (std::size_t o = 0; o < areas.polygons; ++o) {
        Sum probability = 0, information = 0;
        for (std::size_t v = 0; v < areas.views; ++v) probability += joint(v, o);
        for (std::size_t v = 0; v < areas.views; ++v) {
            const Sum given = joint(v, o) / probability;
            if (given != 0) information += given * std::log2(given / p_view(v));
        }
        lowest = std::min(lowest, information);
        highest = std::max(highest, information);
        maps.probability.push_back(static_cast<double>(probability));
        maps.information.push_back(static_cast<double>(information));
        maps.seen.push_back(probability > 0 ? 1 : 0);
    }
    for (const double information : maps.information)
        maps.visibility.push_back(
            static_cast<double>(1 - (static_cast<Sum>(information) - lowest) / (highest - lowest)));
    return maps;
}

// --- nook -----------------------------------------------------------------------------------------

void check(const nook::Error& error, const char* what)
{
    support::checked(nook::Outcome{error}, what);
}

/// From areas, by way of the channel.
Maps by_channel(const Areas& areas)
{
    nook::ViewpointChannel channel;
    check(channel.build(areas.values.data(), areas.views, areas.polygons),
          "ViewpointChannel::build");
    Maps maps;
    maps.total = channel.total_area();
    maps.information.resize(areas.polygons);
    support::checked(nook::polygon_mutual_information(channel, maps.information.data()),
                     "polygon_mutual_information");
    std::vector<nook::PolygonState> states;
    for (std::size_t o = 0; o < areas.polygons; ++o) {
        maps.probability.push_back(channel.p_polygon(o));
        maps.seen.push_back(channel.seen(o) ? 1 : 0);
        states.push_back(channel.seen(o) ? nook::PolygonState::seen : nook::PolygonState::hidden);
    }
    std::vector<float> visibility(areas.polygons);
    check(nook::normalise_information(maps.information.data(), states.data(), areas.polygons,
                                      visibility.data()),
          "normalise_information");
    maps.visibility.assign(visibility.begin(), visibility.end());
    return maps;
}

/// From a mesh, at the resolution that it asks for itself.
Maps by_mesh(const Case& subject)
{
    const nook::MeshView mesh = subject.solid.mesh();
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh);
    std::vector<nook::Camera> views;
    for (const glm::dvec3& direction : directions(small_triangle_level))
        views.push_back(nook::viewpoint_camera(sphere, direction));
    std::vector<float> information(mesh.triangle_count), visibility(mesh.triangle_count);
    std::vector<nook::PolygonState> states(mesh.triangle_count);
    support::checked(nook::information_ao(mesh, views.data(), views.size(),
                                          {.pmi = information.data(),
                                           .information_visibility = visibility.data(),
                                           .state = states.data()}),
                     "information_ao");
    Maps maps;
    for (const nook::PolygonState state : states)
        maps.seen.push_back(state == nook::PolygonState::seen ? 1 : 0);
    maps.information.assign(information.begin(), information.end());
    maps.visibility.assign(visibility.begin(), visibility.end());
    return maps;
}

Maps nook_way(const Case& subject)
{
    return subject.solid.indices.empty() ? by_channel(subject.areas) : by_mesh(subject);
}

// --- what is known exactly ------------------------------------------------------------------------

/// The same formulas in the widest type, with the rules for what they leave undefined: polygons that no
/// view sees get 0, and where all seen ones are equal they get 1.
Maps exact(const Case& subject)
{
    const Areas& areas = subject.truth.values.empty() ? subject.areas : subject.truth;
    using Wide = long double;
    std::vector<Wide> by_view(areas.views);
    Wide total = 0;
    for (std::size_t v = 0; v < areas.views; ++v) {
        for (std::size_t o = 0; o < areas.polygons; ++o) by_view[v] += Wide{areas(v, o)};
        total += by_view[v];
    }
    Maps maps;
    maps.total = static_cast<double>(total);
    std::vector<Wide> information(areas.polygons);
    Wide lowest = std::numeric_limits<Wide>::max(), highest = 0;
    for (std::size_t o = 0; o < areas.polygons; ++o) {
        // With p(v) by area, p(v) p(o|v) is a(v, o) over the total.
        Wide sum = 0;
        for (std::size_t v = 0; v < areas.views; ++v) sum += Wide{areas(v, o)};
        for (std::size_t v = 0; v < areas.views; ++v)
            if (const Wide area{areas(v, o)}; area > 0)
                information[o] += area / sum * std::log2(area * total / (sum * by_view[v]));
        maps.probability.push_back(static_cast<double>(sum / total));
        maps.information.push_back(static_cast<double>(information[o]));
        maps.seen.push_back(sum > 0 ? 1 : 0);
        if (!(sum > 0)) continue;
        lowest = std::min(lowest, information[o]);
        highest = std::max(highest, information[o]);
    }
    for (std::size_t o = 0; o < areas.polygons; ++o)
        maps.visibility.push_back(
            maps.seen[o] == 0 ? 0
            : subject.symmetric || !(highest > lowest)
                ? 1
                : static_cast<double>((highest - information[o]) / (highest - lowest)));
    return maps;
}

// --- cases ----------------------------------------------------------------------------------------

/// Areas of the faces of a convex body, in orthographic views.
Areas of_convex(const std::vector<glm::dvec3>& views, const std::vector<glm::dvec3>& area_normals)
{
    Areas areas{views.size(), area_normals.size()};
    for (std::size_t v = 0; v < views.size(); ++v)
        for (std::size_t o = 0; o < area_normals.size(); ++o)
            areas(v, o) = std::max(glm::dot(views[v], area_normals[o]), 0.0);
    return areas;
}

std::vector<glm::dvec3> cube_normals()
{
    return {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
}

/// A sphere of rings and meridians: large triangles at the equator, tiny ones at the poles.
Solid globe(int rings, int meridians)
{
    Solid solid;
    const auto add = [&](double latitude, double longitude) {
        for (const double x : {std::cos(latitude) * std::cos(longitude), std::sin(latitude),
                               std::cos(latitude) * std::sin(longitude)})
            solid.positions.push_back(static_cast<float>(x));
    };
    const auto index = [&](int ring, int meridian) {
        if (ring == 0) return std::uint32_t{0};
        if (ring == rings) return std::uint32_t{1};
        return static_cast<std::uint32_t>(2 + (ring - 1) * meridians + meridian % meridians);
    };
    constexpr double pi = std::numbers::pi;
    add(-pi / 2, 0);
    add(pi / 2, 0);
    for (int j = 1; j < rings; ++j)
        for (int i = 0; i < meridians; ++i)
            add(pi * (double(j) / rings - 0.5), 2 * pi * i / meridians);
    for (int j = 0; j < rings; ++j)
        for (int i = 0; i < meridians; ++i) {
            const std::uint32_t a = index(j, i), b = index(j, i + 1), c = index(j + 1, i + 1),
                                d = index(j + 1, i);
            if (j > 0) solid.indices.insert(solid.indices.end(), {a, c, b});
            if (j + 1 < rings) solid.indices.insert(solid.indices.end(), {a, d, c});
        }
    return solid;
}

std::vector<glm::dvec3> area_normals(const nook::MeshView& mesh)
{
    std::vector<glm::dvec3> result;
    for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
        const auto corner = [&](std::size_t k) {
            const float* const at = mesh.positions + 3 * std::size_t{mesh.indices[3 * t + k]};
            return glm::dvec3{double{at[0]}, double{at[1]}, double{at[2]}};
        };
        result.push_back(glm::cross(corner(1) - corner(0), corner(2) - corner(0)) * 0.5);
    }
    return result;
}

/// The pixels of each triangle in item buffers of a fixed size.
Areas counted(const nook::MeshView& mesh, const std::vector<glm::dvec3>& views, int resolution)
{
    Areas areas{views.size(), mesh.triangle_count};
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh);
    nook::Image<float> depth{resolution, resolution};
    nook::Image<std::uint32_t> faces{resolution, resolution};
    for (std::size_t v = 0; v < views.size(); ++v) {
        const nook::Camera camera = nook::viewpoint_camera(sphere, views[v]);
        support::checked(nook::rasterise(mesh, nook::view_frame(camera),
                                         nook::projection(camera, resolution, resolution),
                                         {depth.view(), {}, faces.view()}),
                         "rasterise");
        for (const std::uint32_t face : faces)
            if (face != nook::no_face) ++areas(v, face);
    }
    return areas;
}

Case small_triangles()
{
    Case subject{{"small-triangles",
                  "a globe of 20160 triangles, the least far below a pixel: the paper's dark rims"},
                 {}};
    subject.solid = globe(64, 160);
    subject.resolution = 64;
    subject.pixels = true;
    const std::vector<glm::dvec3> views = directions(small_triangle_level);
    const nook::MeshView mesh = subject.solid.mesh();
    subject.areas = counted(mesh, views, subject.resolution);
    subject.truth = of_convex(views, area_normals(mesh));
    return subject;
}

std::vector<Case> all_cases()
{
    std::vector<Case> cases;
    const std::vector<glm::dvec3> around = directions(3);
    cases.push_back({{"cube", "a cube from 642 viewpoints: its faces are all alike"},
                     of_convex(around, cube_normals())});
    cases.back().symmetric = true;
    cases.push_back({{"tetrahedron", "a tetrahedron from 642 viewpoints: its faces are all alike"},
                     of_convex(around, {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}})});
    cases.back().symmetric = true;

    Random random;
    constexpr int full = 4096 * 4096;
    Areas pixels{around.size(), 12};
    for (std::size_t v = 0; v < pixels.views; ++v) {
        int left = full;
        for (std::size_t o = 0; o + 1 < pixels.polygons; ++o) {
            const int taken = random.below(left / 3);
            pixels(v, o) = taken;
            left -= taken;
        }
        pixels(v, pixels.polygons - 1) = left;
    }
    cases.push_back({{"full-pictures", "642 pictures of 4096 x 4096 pixels, all covered"}, pixels});
    cases.back().pixels = true;

    Areas million{3, 1000000};
    for (std::size_t v = 0; v < million.views; ++v)
        for (std::size_t o = 0; o < million.polygons; ++o)
            million(v, o) = 1 + random.below(100) + (o % 3 == v ? 100 : 0);
    cases.push_back({{"million", "a million polygons of 1 to 200 pixels in 3 views"}, million});
    cases.back().pixels = true;

    Areas pixel{2, 1000000};
    pixel(1, 777777) = 1;
    cases.push_back({{"one-pixel", "a million polygons, of which 2 views see one pixel"}, pixel});
    cases.back().pixels = true;

    const Areas cube = of_convex(directions(0), cube_normals());
    Areas blind{cube.views + 1, cube.polygons}, inner{cube.views, 2 * cube.polygons};
    for (std::size_t v = 0; v < cube.views; ++v)
        for (std::size_t o = 0; o < cube.polygons; ++o) blind(v, o) = inner(v, o) = cube(v, o);
    cases.push_back({{"blind-view", "a cube from 12 viewpoints and one that sees nothing"}, blind});
    cases.back().symmetric = true;
    cases.push_back({{"inner-cube", "a cube from 12 viewpoints that hides another"}, inner});
    cases.back().symmetric = true;

    cases.push_back(small_triangles());
    return cases;
}

// --- rows -----------------------------------------------------------------------------------------

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

/// Distances where `counts(o)`; NaN for what is not finite.
template <class Counts>
Worst errors(const std::vector<double>& values, const std::vector<double>& expected,
             const Counts& counts)
{
    Worst worst;
    for (std::size_t o = 0; o < values.size(); ++o) {
        if (!counts(o)) continue;
        const double error = std::fabs(values[o] - expected[o]);
        worst.add(std::isfinite(error) ? error : nothing,
                  [&] { return joined("polygon ", o, ": ", values[o], " for ", expected[o]); });
    }
    return worst;
}

void measure(const Maps& maps, const Maps& truth, bool same_unit, Row& row)
{
    std::optional<double> total, sum, largest, mean, map;
    if (!maps.probability.empty()) {
        if (same_unit) total = std::fabs(maps.total / truth.total - 1);
        long double added = 0;
        for (const double probability : maps.probability) added += probability;
        sum = static_cast<double>(std::fabs(added - 1));
    }
    std::size_t in_sight = 0, lost = 0;
    Worst poisoned;
    double bias = 0;
    for (std::size_t o = 0; o < truth.information.size(); ++o) {
        const double bits = maps.information[o], value = maps.visibility[o];
        if (!std::isfinite(bits) || !std::isfinite(value))
            poisoned.add(nothing,
                         [&] { return joined("polygon ", o, ": ", bits, " bits, map ", value); });
        if (truth.seen[o] == 0) continue;
        ++in_sight;
        if (maps.seen[o] != 0) bias += maps.information[o] - truth.information[o];
        else ++lost;
    }
    // Of a body that is evenly open, the little that its parts differ by says nothing.
    Worst worst_map, worst;
    if (same_unit) {
        worst_map = errors(maps.visibility, truth.visibility, [](std::size_t) { return true; });
        map = worst_map.value();
    }
    const auto in_both = [&](std::size_t o) { return truth.seen[o] != 0 && maps.seen[o] != 0; };
    if (lost < in_sight) {
        worst = errors(maps.information, truth.information, in_both);
        largest = worst.value();
        mean = std::fabs(bias) / static_cast<double>(in_sight - lost);
    }
    row.values = {total,          sum, largest,
                  mean,           map, static_cast<double>(lost) / static_cast<double>(in_sight),
                  poisoned.nans()};
    set_worst(row, 6, poisoned, 6);
    set_worst(row, 2, worst, 6);
    set_worst(row, 4, worst_map, 6);
}

}  // namespace

Family information()
{
    Family family;
    family.label = {"information",
                    "mutual information of polygons and viewpoints, and the map made of it"};
    family.metrics = {{"total", "relative error of the sum of all visible areas"},
                      {"sum", "how far the probabilities of the polygons are from adding up to 1"},
                      {"information", "largest error of the information of a polygon, bits"},
                      {"bias", "mean error of the same"},
                      {"map", "largest error of a value of the map, in [0, 1]"},
                      {"lost", "share of the visible polygons that count as unseen"},
                      {"nan", "polygons with a NaN or an infinity"}};
    struct Algorithm {
        Label label;
        Maps (*run)(const Case&);
    };
    const Algorithm algorithms[] = {
        {{"textbook-float", "the paper's formulas as printed, in float"}, textbook<float, float>},
        {{"textbook-double", "the same in double"}, textbook<double, double>},
        {{"textbook-32-bit", "the same, with a 32-bit integer as the sum of all areas"},
         textbook<double, std::uint32_t>},
        {{"nook", "ViewpointChannel and its measures; information_ao for what is a mesh"},
         nook_way},
    };
    for (const Algorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const Case& subject : all_cases()) {
        family.cases.push_back(subject.label);
        const Maps truth = exact(subject);
        for (const Algorithm& algorithm : algorithms) {
            if (algorithm.run == &textbook<double, std::uint32_t> && !subject.pixels) continue;
            nlohmann::ordered_json parameters{{"views", subject.areas.views},
                                              {"polygons", subject.areas.polygons}};
            if (subject.resolution > 0) parameters["resolution"] = subject.resolution;
            Row row{subject.label.name, algorithm.label.name, parameters, {}};
            measure(algorithm.run(subject), truth, subject.truth.values.empty(), row);
            family.rows.push_back(std::move(row));
        }
    }
    return family;
}

}  // namespace stability
