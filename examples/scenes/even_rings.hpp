#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder.hpp"

namespace scenes {

/// The section of a solid of revolution: radius and height from the middle of the underside to the
/// middle of the top, as smooth pieces between corners.
class Section {
public:
    explicit Section(const glm::dvec2& start) : points_{start} {}

    /// Goes on straight; along a cubic Bézier curve; along a circle about `middle` by an angle.
    Section& line(const glm::dvec2& to);
    Section& curve(const glm::dvec2& first, const glm::dvec2& second, const glm::dvec2& to);
    Section& arc(const glm::dvec2& middle, double angle);

    [[nodiscard]] double length() const { return along_.back(); }
    /// The point at a distance along the section.
    [[nodiscard]] glm::dvec2 at(double along) const;
    /// Distances about `step` apart; the corners are among them.
    [[nodiscard]] std::vector<double> steps(double step) const;

private:
    void add(const glm::dvec2& point);

    std::vector<glm::dvec2> points_;
    std::vector<double> along_{0}, corners_{0};
};

/// Rings of vertices one above the other, each of its own number, so that all triangles between
/// them are about the same size.
struct Ring {
    double along = 0;
    int count = 1;
    std::uint32_t first = 0;  ///< its vertices are consecutive

    [[nodiscard]] std::uint32_t at(int i) const
    {
        return first + static_cast<std::uint32_t>(i % count);
    }
};

/// Rings of a section with vertices about `edge` apart. A ring on the axis is one vertex.
[[nodiscard]] std::vector<Ring> even_rings(const Section& section, double edge);

/// Adds the vertices point(ring, i) of all rings and the triangles between them. keep(j, i) tells
/// whether the quad between vertices i and i + 1 of the rings j and j + 1 is wanted, where the two
/// have equally many. colour(along) is that of the triangles there.
template <class Point, class Keep, class Colour>
void add_rings(Builder& builder, std::vector<Ring>& rings, const Point& point, const Keep& keep,
               const Colour& colour)
{
    for (Ring& ring : rings)
        for (int i = 0; i < ring.count; ++i) {
            const std::uint32_t index = builder.vertex(point(ring, i));
            if (i == 0) ring.first = index;
        }
    for (std::size_t j = 0; j + 1 < rings.size(); ++j) {
        const Ring &lower = rings[j], &upper = rings[j + 1];
        const support::Rgb paint = colour((lower.along + upper.along) / 2);
        if (lower.count == upper.count) {
            for (int i = 0; i < lower.count; ++i)
                if (keep(j, i))
                    builder.quad(lower.at(i), lower.at(i + 1), upper.at(i + 1), upper.at(i), paint);
            continue;
        }
        // Round both at once, always from the vertex that lies behind.
        for (int i = 0, k = 0; i < lower.count || k < upper.count;) {
            const bool below = (i + 1) * upper.count <= (k + 1) * lower.count;
            if (below ? lower.count > 1 : upper.count > 1)
                builder.triangle(lower.at(i), below ? lower.at(i + 1) : upper.at(k + 1),
                                 upper.at(k), paint);
            ++(below ? i : k);
        }
    }
}

}  // namespace scenes
