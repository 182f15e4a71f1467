#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <glm/ext/vector_int2.hpp>
#include <glm/geometric.hpp>

#include "builder.hpp"
#include "even_rings.hpp"
#include "scenes.hpp"

namespace scenes {

namespace {

/// A cup with a rim of radius 1, from the hollow of its foot up the wall, over the rim and down inside.
Section cup_section()
{
    Section section{{0, 0.11}};
    section.curve({0.2, 0.11}, {0.34, 0.1}, {0.42, 0.06})
        .curve({0.45, 0.02}, {0.47, 0}, {0.51, 0})
        .curve({0.56, 0}, {0.58, 0.03}, {0.57, 0.1})
        .curve({0.56, 0.17}, {0.62, 0.18}, {0.68, 0.22})
        .curve({0.98, 0.4}, {0.86, 1}, {1, 1.36})
        .arc({0.946, 1.381}, std::numbers::pi)
        .curve({0.76, 1.05}, {0.84, 0.56}, {0.62, 0.36})
        .curve({0.5, 0.25}, {0.25, 0.22}, {0, 0.22});
    return section;
}

/// Where an end of the handle grows out of the wall: the quads up to `half` columns and rows away are
/// left out. They are counted from column 0 and from the ring `row`.
struct Opening {
    std::size_t row;
    int half;

    [[nodiscard]] bool holds(std::size_t j, int column) const
    {
        const int up = static_cast<int>(j) - static_cast<int>(row);
        return up >= -half && up < half && column >= -half && column < half;
    }
    /// Moves a vertex, in columns and rows, so that the edge of the opening becomes a circle, and what
    /// lies around it makes room.
    [[nodiscard]] glm::dvec2 rounded(const glm::dvec2& at) const
    {
        const double square = (std::max)(std::fabs(at.x), std::fabs(at.y));
        if (square == 0) return at;
        const double fade = std::clamp((3.0 * half - square) / (2 * half), 0.0, 1.0);
        return at * (1 + fade * (square / std::hypot(at.x, at.y) - 1));
    }
    /// The vertices on its edge, by columns and rows, anticlockwise as seen from outside.
    [[nodiscard]] std::vector<glm::ivec2> edge() const
    {
        std::vector<glm::ivec2> result;
        for (int i = -half; i < half; ++i) result.push_back({i, -half});
        for (int i = -half; i < half; ++i) result.push_back({half, i});
        for (int i = half; i > -half; --i) result.push_back({i, half});
        for (int i = half; i > -half; --i) result.push_back({-half, i});
        return result;
    }
};

}  // namespace

Scene cup(const CupOptions& options)
{
    Scene scene;
    scene.name = "cup";
    Builder builder;
    const support::Rgb glaze{0.70f, 0.73f, 0.76f}, inside{0.80f, 0.78f, 0.72f};
    const Section section = cup_section();
    std::vector<Ring> rings = even_rings(section, options.edge);

    // The rings of the outer wall, where the handle meets it, have equally many vertices.
    const auto ring_at = [&](double height) {
        std::size_t j = 0;
        while (section.at(rings[j].along).y < height || section.at(rings[j].along).x < 0.68) ++j;
        return j;
    };
    constexpr double handle_radius = 0.07;
    const int half =
        (std::max)(1, static_cast<int>(std::lround(1.3 * handle_radius / options.edge)));
    const Opening upper{ring_at(1.12), half}, lower{ring_at(0.52), half};
    const auto margin = static_cast<std::size_t>(3 * half);
    for (std::size_t j = lower.row - margin; j <= upper.row + margin; ++j)
        rings[j].count = rings[(lower.row + upper.row) / 2].count;
    const int around = rings[upper.row].count;
    const double step = rings[upper.row + 1].along - rings[upper.row].along;

    const auto column = [](const Ring& ring, int i) {
        return 2 * i <= ring.count ? i : i - ring.count;
    };
    const auto wall_point = [&](double turn, double along) {
        const glm::dvec2 at = section.at(along);
        const double angle = 2 * std::numbers::pi * turn;
        return glm::dvec3{at.x * std::cos(angle), at.y, -at.x * std::sin(angle)};
    };
    const auto point = [&](const Ring& ring, int i) {
        glm::dvec2 shift{0, 0};
        for (const Opening& opening : {upper, lower}) {
            const double rows = (ring.along - rings[opening.row].along) / step;
            if (std::fabs(rows) > 3 * half || ring.count != around) continue;
            const glm::dvec2 at{column(ring, i), rows};
            shift += opening.rounded(at) - at;
        }
        return wall_point((column(ring, i) + shift.x) / ring.count, ring.along + shift.y * step);
    };
    double rim = 0;
    for (const Ring& ring : rings)
        if (section.at(ring.along).y > section.at(rim).y) rim = ring.along;
    add_rings(
        builder, rings, point,
        [&](std::size_t j, int i) {
            const int at = i < rings[j].count / 2 ? i : i - rings[j].count;
            return !upper.holds(j, at) && !lower.holds(j, at);
        },
        [&](double along) { return along < rim ? glaze : inside; });

    // The handle: rings along a curve from the upper opening to the lower one.
    const glm::dvec3 from = wall_point(0, rings[upper.row].along),
                     to = wall_point(0, rings[lower.row].along);
    const glm::dvec3 first = from + glm::dvec3{0.66, 0.1, 0},
                     last = to + glm::dvec3{0.56, -0.14, 0};
    const auto middle = [&](double t) {
        const double s = 1 - t;
        return from * (s * s * s) + first * (3 * s * s * t) + last * (3 * s * t * t) +
               to * (t * t * t);
    };
    double length = 0;
    constexpr int pieces = 64;
    for (int i = 0; i < pieces; ++i)
        length += glm::length(middle((i + 1.0) / pieces) - middle(double(i) / pieces));
    const int rows = static_cast<int>(std::lround(length / step));
    // The edges of both openings. The handle comes back upside down.
    const auto edge = [&](const Opening& opening, int upwards) {
        std::vector<std::pair<const Ring*, int>> result;
        for (const glm::ivec2& at : opening.edge()) {
            const int row = static_cast<int>(opening.row) + upwards * at.y;
            const Ring& ring = rings[static_cast<std::size_t>(row)];
            result.push_back({&ring, (at.x + ring.count) % ring.count});
        }
        return result;
    };
    const auto first_edge = edge(upper, 1), last_edge = edge(lower, -1);
    std::vector<std::uint32_t> before, next(first_edge.size());
    for (int j = 0; j <= rows; ++j) {
        const double t = double(j) / rows, away = length * (std::min)(t, 1 - t);
        const glm::dvec3 along = glm::normalize(middle(t + 1e-4) - middle(t - 1e-4));
        const glm::dvec3 up{-along.y, along.x, 0}, beside{0, 0, -1};
        // From the edge of the opening to a circle across the handle.
        const double share = std::exp(-away * away / (0.09 * 0.09));
        for (std::size_t i = 0; i < next.size(); ++i) {
            const auto& [ring, k] = (2 * j < rows ? first_edge : last_edge)[i];
            const double angle =
                2 * std::numbers::pi * double(i) / double(next.size()) - 0.75 * std::numbers::pi;
            const glm::dvec3 circle =
                (beside * std::cos(angle) + up * std::sin(angle)) * handle_radius;
            const glm::dvec3 opening = point(*ring, k) - (2 * j < rows ? from : to);
            next[i] = j == 0 || j == rows
                          ? ring->at(k)
                          : builder.vertex(middle(t) + circle + (opening - circle) * share);
        }
        for (std::size_t i = 0; j > 0 && i < next.size(); ++i) {
            const std::size_t after = (i + 1) % next.size();
            builder.quad(before[i], before[after], next[after], next[i], glaze);
        }
        before = next;
    }

    builder.finish(scene);
    scene.camera.eye = {1.6, 3.3, 3.8};
    scene.camera.target = {0.25, 0.72, 0};
    scene.camera.vertical_fov = 0.56;
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
