#include "builder.hpp"

#include <cmath>
#include <numbers>

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
    // Down the axis of the top, over its edge, down the side.
    const double profile[3][2] = {{0, height}, {radius, height}, {radius, 0}};
    surface(
        {segments, 2, true, false},
        [&](double u, double v) {
            const auto& at = profile[std::lround(2 * v)];
            const double angle = -2 * std::numbers::pi * u;
            return foot + glm::dvec3{at[0] * std::cos(angle), at[1], at[0] * std::sin(angle)};
        },
        [&](double, double) { return colour; });
}

void Builder::finish(Scene& scene)
{
    scene.positions = std::move(positions_);
    scene.indices = std::move(indices_);
    scene.albedo = std::move(albedo_);
}

}  // namespace scenes
