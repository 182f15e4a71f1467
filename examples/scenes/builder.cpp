#include "builder.hpp"

#include <cmath>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>

namespace scenes {

double Random::operator()(double low, double high)
{
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * (static_cast<double>(z >> 11) * 0x1p-53);
}

std::uint32_t Builder::vertex(const glm::dvec3& point)
{
    const auto index = static_cast<std::uint32_t>(positions_.size() / 3);
    for (const double coordinate : {point.x, point.y, point.z})
        positions_.push_back(static_cast<float>(coordinate));
    return index;
}

void Builder::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                       const support::Rgb& colour)
{
    const auto same = [&](std::uint32_t i, std::uint32_t j) {
        const float *p = positions_.data() + 3 * i, *q = positions_.data() + 3 * j;
        return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
    };
    if (same(a, b) || same(b, c) || same(c, a)) return;
    indices_.insert(indices_.end(), {a, b, c});
    albedo_.push_back(colour);
}

void Builder::quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                   const support::Rgb& colour)
{
    triangle(a, b, c, colour);
    triangle(a, c, d, colour);
}

void Builder::block(const glm::dvec3& centre, const glm::dvec3& x, const glm::dvec3& y,
                    const glm::dvec3& z, const support::Rgb& colour)
{
    std::uint32_t corner[8];
    for (int i = 0; i < 8; ++i)
        corner[i] = vertex(centre + x * ((i & 1) != 0 ? 1.0 : -1.0) +
                           y * ((i & 2) != 0 ? 1.0 : -1.0) + z * ((i & 4) != 0 ? 1.0 : -1.0));
    constexpr int faces[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7},
                                 {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
    for (const auto& face : faces)
        quad(corner[face[0]], corner[face[1]], corner[face[2]], corner[face[3]], colour);
}

void Builder::box(const glm::dvec3& centre, const glm::dvec3& half_size, const support::Rgb& colour,
                  double angle)
{
    const double cosine = std::cos(angle), sine = std::sin(angle);
    block(centre, glm::dvec3{cosine, 0, -sine} * half_size.x, {0, half_size.y, 0},
          glm::dvec3{sine, 0, cosine} * half_size.z, colour);
}

void Builder::bar(const glm::dvec3& from, const glm::dvec3& to, double half_width,
                  const support::Rgb& colour)
{
    const glm::dvec3 along = (to - from) * 0.5;
    const glm::dvec3 side = glm::normalize(glm::cross(along, glm::dvec3{0, 1, 0}));
    const glm::dvec3 up = glm::normalize(glm::cross(side, along));
    block((from + to) * 0.5, along, up * half_width, side * half_width, colour);
}

void Builder::pillar(const glm::dvec3& foot, double radius, double height, int segments,
                     const support::Rgb& colour)
{
    const glm::dvec2 profile[] = {{radius, 0}, {radius, height}};
    turned(foot, profile, segments, colour);
}

void Builder::turned(const glm::dvec3& foot, std::span<const glm::dvec2> profile, int segments,
                     const support::Rgb& colour)
{
    loft(
        segments, static_cast<int>(profile.size()),
        [&](int i, int j) {
            const glm::dvec2& at = profile[static_cast<std::size_t>(j)];
            const double angle = 2 * std::numbers::pi * i / segments;
            return foot + glm::dvec3{at.x * std::cos(angle), at.y, -at.x * std::sin(angle)};
        },
        colour);
}

void Builder::prism(std::span<const glm::dvec2> outline, const glm::dvec3& origin,
                    const glm::dvec3& x, const glm::dvec3& y, const glm::dvec3& z,
                    const support::Rgb& colour)
{
    const auto count = static_cast<std::uint32_t>(outline.size());
    const auto first = static_cast<std::uint32_t>(positions_.size() / 3);
    for (const double end : {0.0, 1.0})
        for (const glm::dvec2& at : outline) (void)vertex(origin + x * at.x + y * at.y + z * end);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t next = first + (i + 1) % count;
        quad(first + i, next, next + count, first + i + count, colour);
    }
    // Both ends: cut off one ear after the other.
    const auto area = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        const glm::dvec2 ab = outline[b] - outline[a], ac = outline[c] - outline[a];
        return ab.x * ac.y - ab.y * ac.x;
    };
    std::vector<std::uint32_t> left(count);
    std::iota(left.begin(), left.end(), 0u);
    while (left.size() > 2) {
        std::size_t ear = 0;
        for (; ear + 1 < left.size(); ++ear) {
            const std::uint32_t a = left[(ear + left.size() - 1) % left.size()], b = left[ear],
                                c = left[ear + 1];
            bool free = area(a, b, c) > 0;
            for (const std::uint32_t p : left)
                free = free && (p == a || p == b || p == c || area(a, b, p) < 0 ||
                                area(b, c, p) < 0 || area(c, a, p) < 0);
            if (free) break;
        }
        const std::uint32_t a = first + left[(ear + left.size() - 1) % left.size()],
                            b = first + left[ear], c = first + left[(ear + 1) % left.size()];
        triangle(c, b, a, colour);
        triangle(a + count, b + count, c + count, colour);
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    }
}

void Builder::tube(std::span<const glm::dvec3> path, std::span<const double> radii, int sides,
                   const support::Rgb& colour)
{
    const std::size_t count = path.size();
    // The axes across the path, turned along with it as little as possible.
    std::vector<glm::dvec3> across(count), beside(count);
    for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 along =
            glm::normalize(path[i + 1 < count ? i + 1 : i] - path[i > 0 ? i - 1 : i]);
        const glm::dvec3 axis = i > 0                      ? across[i - 1]
                                : std::fabs(along.y) > 0.9 ? glm::dvec3{1, 0, 0}
                                                           : glm::dvec3{0, 1, 0};
        across[i] = glm::normalize(axis - along * glm::dot(axis, along));
        beside[i] = glm::cross(along, across[i]);
    }
    loft(
        sides, static_cast<int>(count),
        [&](int i, int j) {
            const auto at = static_cast<std::size_t>(j);
            const double angle = 2 * std::numbers::pi * i / sides;
            return path[at] +
                   (across[at] * std::cos(angle) + beside[at] * std::sin(angle)) * radii[at];
        },
        colour);
}

void Builder::chamfered_box(const glm::dvec3& centre, const glm::dvec3& half_size, double bevel,
                            const support::Rgb& colour, double angle)
{
    const double cosine = std::cos(angle), sine = std::sin(angle);
    // Octagons; the outer two shrink to rectangles.
    loft(
        8, 4,
        [&](int i, int j) {
            const bool outer = j == 0 || j == 3;
            // Two points per corner: one on the face across x, one on the face across z.
            const int corner = i / 2;
            const bool face_x = i % 4 == 0 || i % 4 == 3;
            const double side_x = corner == 0 || corner == 3 ? 1 : -1;
            const double side_z = corner < 2 ? -1 : 1;
            const double cut_x = outer || !face_x ? bevel : 0, cut_z = outer || face_x ? bevel : 0;
            const double x = side_x * (half_size.x - cut_x), z = side_z * (half_size.z - cut_z);
            const double y = (j < 2 ? -1 : 1) * (half_size.y - (outer ? 0 : bevel));
            return centre + glm::dvec3{x * cosine + z * sine, y, z * cosine - x * sine};
        },
        colour);
}

void Builder::finish(Scene& scene)
{
    scene.positions = std::move(positions_);
    scene.indices = std::move(indices_);
    scene.albedo = std::move(albedo_);
}

}  // namespace scenes
