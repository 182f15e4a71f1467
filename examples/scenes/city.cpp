#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "builder.hpp"
#include "scenes.hpp"

// Rows of plots on both sides of a street that runs along z, a wall around them, dunes around that.
// Lengths in metres. Everything is a closed solid; solids reach into each other and share no
// vertex.

namespace scenes {

namespace {

constexpr double pi = std::numbers::pi;

constexpr double plot = 7.4;     // edge of the square that a house stands on
constexpr double lane = 2.4;     // between rows of plots
constexpr double street = 6.5;   // width of the street in the middle
constexpr double recess = 0.22;  // how deep doors and windows lie in their walls
constexpr double desert = 420;   // half the edge of the ground

constexpr support::Rgb sand{0.72f, 0.56f, 0.36f}, mud{0.62f, 0.45f, 0.29f},
    whitewash{0.80f, 0.75f, 0.65f}, brick{0.56f, 0.36f, 0.23f}, timber{0.34f, 0.23f, 0.14f},
    clay{0.60f, 0.32f, 0.19f}, leaf{0.22f, 0.34f, 0.12f}, bark{0.36f, 0.27f, 0.18f},
    blue{0.18f, 0.34f, 0.50f};

support::Rgb mix(const support::Rgb& a, const support::Rgb& b, double t)
{
    return a * static_cast<float>(1 - t) + b * static_cast<float>(t);
}

/// The ground: a gentle rise in the city, dunes outside.
double ground(double x, double z)
{
    const double r = std::hypot(x, z) / 95;
    const double outside = std::clamp((r - 0.75) * 1.6, 0.0, 1.0);
    const double rise = 3.2 * std::exp(-1.5 * r * r) - 0.012 * z;
    const auto ridge = [](double at) {
        // A long slope to windward, a short one to leeward.
        const double t = at / (2 * pi) - std::floor(at / (2 * pi));
        const double s = t < 0.7 ? t / 0.7 : (1 - t) / 0.3;
        return s * s * (3 - 2 * s);
    };
    const double dunes =
        7 * ridge(0.050 * x + 0.021 * z + 1.3 * std::sin(0.017 * z + 0.4) + 0.6) +
        4 * ridge(0.043 * z - 0.072 * x + 0.9 * std::sin(0.033 * x)) * ridge(0.02 * x + 2) +
        9 * std::clamp(r - 2, 0.0, 3.0) * ridge(0.012 * x + 0.007 * z + 1);
    return rise + outside * outside * (3 - 2 * outside) * dunes;
}

class City {
public:
    City(Builder& builder, const CityOptions& options)
        : builder_{builder},
          random_{options.seed},
          columns_{options.columns},
          rows_{options.rows}
    {}

    void build()
    {
        dunes();
        quarters();
        market();
        wall();
    }

    [[nodiscard]] double half_width() const
    {
        return street / 2 + columns_ * plot + columns_ / 2 * lane;
    }
    [[nodiscard]] double half_length() const { return (rows_ * plot + rows_ / 2 * lane) / 2; }

private:
    support::Rgb shade(const support::Rgb& colour, double spread = 0.1)
    {
        return colour * static_cast<float>(random_(1 - spread, 1 + spread));
    }

    void dunes()
    {
        // A slab: its top is the ground, with smaller cells near the middle.
        constexpr int cells = 136;
        const auto at = [](int i) {
            const double s = 2.0 * i / cells - 1;
            return desert * s * (0.22 + 0.78 * s * s);
        };
        std::vector<std::uint32_t> top;
        for (int j = 0; j <= cells; ++j)
            for (int i = 0; i <= cells; ++i)
                top.push_back(builder_.vertex({at(i), ground(at(i), at(j)), at(j)}));
        const auto index = [&](int i, int j) {
            return top[static_cast<std::size_t>(j * (cells + 1) + i)];
        };
        for (int j = 0; j < cells; ++j)
            for (int i = 0; i < cells; ++i)
                builder_.quad(index(i, j + 1), index(i + 1, j + 1), index(i + 1, j), index(i, j),
                              sand * static_cast<float>(0.97 + 0.03 * std::sin(0.7 * i + 0.4 * j)));
        // The rim, anticlockwise from above.
        std::vector<std::pair<std::uint32_t, glm::dvec3>> rim;
        const auto add = [&](int i, int j) {
            rim.push_back({index(i, j), glm::dvec3{at(i), -30, at(j)}});
        };
        for (int i = 0; i < cells; ++i) add(i, cells);
        for (int j = cells; j > 0; --j) add(cells, j);
        for (int i = cells; i > 0; --i) add(i, 0);
        for (int j = 0; j < cells; ++j) add(0, j);
        std::vector<std::uint32_t> foot;
        for (const auto& point : rim) foot.push_back(builder_.vertex(point.second));
        const std::uint32_t hub = builder_.vertex({0, -30, 0});
        for (std::size_t i = 0; i < rim.size(); ++i) {
            const std::size_t next = (i + 1) % rim.size();
            builder_.quad(foot[i], foot[next], rim[next].first, rim[i].first, sand);
            builder_.triangle(hub, foot[next], foot[i], sand);
        }
    }

    /// A house of one or more floors with a flat roof behind a parapet.
    struct House {
        glm::dvec3 foot;       ///< the middle of its floor
        double x, z;           ///< half of its edges
        double height, angle;  ///< up to the roof; about the vertical axis
        int door;              ///< the wall with the door: 0 +x, 1 −z, 2 −x, 3 +z
        support::Rgb colour;

        [[nodiscard]] glm::dvec3 to_world(const glm::dvec3& local) const
        {
            const double cosine = std::cos(angle), sine = std::sin(angle);
            return foot + glm::dvec3{local.x * cosine + local.z * sine, local.y,
                                     local.z * cosine - local.x * sine};
        }
        /// Outwards, and along the wall, anticlockwise from above.
        [[nodiscard]] static glm::dvec3 out(int wall)
        {
            constexpr double x[] = {1, 0, -1, 0}, z[] = {0, -1, 0, 1};
            return {x[wall], 0, z[wall]};
        }
        [[nodiscard]] static glm::dvec3 along(int wall)
        {
            const glm::dvec3 o = out(wall);
            return {o.z, 0, -o.x};
        }
        [[nodiscard]] double reach(int wall) const { return wall % 2 == 0 ? x : z; }
        [[nodiscard]] double half(int wall) const { return wall % 2 == 0 ? z : x; }
    };

    void house(const House& house)
    {
        // Columns of cells around, rows of cells up; a door or a window is a cell or two set back.
        const int floors = (std::max)(1, static_cast<int>(house.height / 2.7));
        std::vector<double> levels{-0.9, 0.04};
        for (int f = 0; f < floors; ++f) {
            const double base = f * house.height / floors;
            for (const double level : {1.05, 2.0, 2.5})
                levels.push_back(base + level + random_(-0.06, 0.06));
        }
        levels.push_back(house.height + random_(0.1, 0.2));
        int cells[4], first[5] = {0, 0, 0, 0, 0};
        for (int wall = 0; wall < 4; ++wall) {
            cells[wall] = std::clamp(static_cast<int>(2 * house.half(wall) / 0.8), 5, 8);
            first[wall + 1] = first[wall] + cells[wall];
        }
        const int around = first[4], rows = static_cast<int>(levels.size()) - 1;
        const auto wall_of = [&](int i) {
            return i < first[1] ? 0 : i < first[2] ? 1 : i < first[3] ? 2 : 3;
        };
        std::vector<char> deep(static_cast<std::size_t>(around * rows), 0);
        const auto is_deep = [&](int i, int j) {
            return j >= 0 && j < rows &&
                   deep[static_cast<std::size_t>(j * around + (i + around) % around)] != 0;
        };
        const auto set = [&](int i, int j) { deep[static_cast<std::size_t>(j * around + i)] = 1; };
        std::vector<std::array<int, 2>> openings;
        for (int wall = 0; wall < 4; ++wall)
            for (int f = 0; f < floors; ++f)
                for (int c = 1; c + 1 < cells[wall]; c += 2) {
                    const int i = first[wall] + c, j = 2 + 3 * f;
                    const bool door = f == 0 && wall == house.door && c == 1 + cells[wall] / 4 * 2;
                    if (!door && random_() > 0.38) continue;
                    set(i, j);
                    if (door) set(i, j - 1);
                    openings.push_back({i, j});
                }
        // Rough walls that lean inwards; the outline is the same at all levels up to a little
        // noise.
        const std::size_t stride = static_cast<std::size_t>(around);
        std::vector<glm::dvec3> points;
        const auto ring = [&](double level, double inset, double noise) {
            for (int i = 0; i < around; ++i) {
                const int wall = wall_of(i);
                const double at = (2.0 * (i - first[wall]) / cells[wall] - 1) * house.half(wall);
                glm::dvec3 point = House::out(wall) * house.reach(wall) + House::along(wall) * at;
                const double lean = inset + 0.05 * level;
                point.x *= 1 - lean / house.x;
                point.z *= 1 - lean / house.z;
                point += glm::dvec3{random_(-noise, noise), level + random_(-noise, noise),
                                    random_(-noise, noise)};
                points.push_back(house.to_world(point));
            }
        };
        for (const double level : levels) ring(level, 0, 0.022);
        const double top = levels.back() + random_(0.25, 0.5), thick = 0.16;
        ring(top, 0.01, 0.025);
        ring(top + 0.07, 0.06, 0.02);
        ring(top + 0.05, thick, 0.02);
        ring(house.height, thick + 0.06, 0.01);
        const int rings = rows + 5;

        std::vector<std::uint32_t> outer, inner(stride * static_cast<std::size_t>(rings), 0);
        for (const glm::dvec3& point : points) outer.push_back(builder_.vertex(point));
        const auto at = [&](int i, int j, bool back, int wall) {
            const std::size_t slot = static_cast<std::size_t>(j) * stride +
                                     static_cast<std::size_t>((i + around) % around);
            if (!back) return outer[slot];
            if (inner[slot] == 0) {
                const glm::dvec3 in = house.to_world(House::out(wall) * -recess) - house.foot;
                inner[slot] = builder_.vertex(points[slot] + in);
            }
            return inner[slot];
        };
        for (int j = 0; j + 1 < rings; ++j)
            for (int i = 0; i < around; ++i) {
                const bool here = is_deep(i, j);
                const int wall = wall_of(i);
                const support::Rgb colour = here ? timber : house.colour;
                builder_.quad(at(i, j, here, wall), at(i + 1, j, here, wall),
                              at(i + 1, j + 1, here, wall), at(i, j + 1, here, wall), colour);
                if (!here) continue;
                // The reveals, where the next cell is not set back.
                const auto reveal = [&](int i0, int j0, int i1, int j1) {
                    builder_.quad(at(i0, j0, false, wall), at(i1, j1, false, wall),
                                  at(i1, j1, true, wall), at(i0, j0, true, wall), house.colour);
                };
                if (!is_deep(i, j - 1)) reveal(i, j, i + 1, j);
                if (!is_deep(i, j + 1)) reveal(i + 1, j + 1, i, j + 1);
                if (!is_deep(i - 1, j)) reveal(i, j + 1, i, j);
                if (!is_deep(i + 1, j)) reveal(i + 1, j, i + 1, j + 1);
            }
        for (const int end : {0, rings - 1}) {
            const double level = end == 0 ? levels[0] : house.height - 0.02;
            const std::uint32_t hub = builder_.vertex(house.to_world({0, level, 0}));
            for (int i = 0; i < around; ++i) {
                const std::uint32_t a = at(i, end, false, 0), b = at(i + 1, end, false, 0);
                if (end == 0) builder_.triangle(hub, b, a, house.colour);
                else builder_.triangle(hub, a, b, mix(house.colour, sand, 0.5));
            }
        }
        // Lintels over the openings, sills and bars in some.
        for (const auto& [i, j] : openings) {
            const int wall = wall_of(i);
            const double cell = house.half(wall) / cells[wall];
            const double middle = (2 * (i - first[wall]) + 1) * cell - house.half(wall);
            const auto bar = [&](double level, double out, double width, double half) {
                const glm::dvec3 centre =
                    House::out(wall) * (house.reach(wall) - 0.05 * level + out) +
                    House::along(wall) * (middle * (1 - 0.05 * level / house.half(wall))) +
                    glm::dvec3{0, level, 0};
                builder_.box(
                    house.to_world(centre),
                    wall % 2 == 0 ? glm::dvec3{half, half, width} : glm::dvec3{width, half, half},
                    shade(timber), house.angle);
            };
            const auto level = [&](int k) { return levels[static_cast<std::size_t>(k)]; };
            bar(level(j + 1) + 0.04, -0.03, cell + 0.16, 0.075);
            if (is_deep(i, j - 1)) continue;
            bar(level(j) - 0.02, -0.02, cell + 0.08, 0.06);
            if (random_() < 0.5)
                for (int k = 1; k <= 3; ++k)
                    bar(std::lerp(level(j), level(j + 1), k / 4.0), -0.12, cell + 0.03, 0.02);
        }
        vigas(house, random_() < 0.5 ? 0 : 1);
        if (random_() < 0.55) bare_bricks(house, static_cast<int>(random_(0, 4)));
    }

    /// Ends of the beams of the roof that stick out of two walls.
    void vigas(const House& house, int wall)
    {
        const int count = static_cast<int>(2 * house.half(wall) / 0.62);
        for (const int side : {wall, wall + 2})
            for (int i = 0; i < count; ++i) {
                const double at =
                    ((i + 0.5) / count * 2 - 1) * (house.half(side) - 0.3) + random_(-0.04, 0.04);
                const double level = house.height - 0.22 + random_(-0.02, 0.02);
                const double wall_at = house.reach(side) - 0.05 * level;
                const double radius = random_(0.065, 0.085), tip = wall_at + random_(0.3, 0.5);
                const auto point = [&](double out) {
                    return house.to_world(House::out(side) * out + House::along(side) * at +
                                          glm::dvec3{0, level, 0});
                };
                const glm::dvec3 path[] = {point(wall_at - 0.25), point(tip)};
                const double radii[] = {radius, radius * 0.92};
                builder_.tube(path, radii, 6, shade(timber, 0.2));
            }
    }

    /// A patch where the plaster is off: courses of bricks in slight relief.
    void bare_bricks(const House& house, int wall)
    {
        const int courses = static_cast<int>(random_(4, 10)),
                  length = static_cast<int>(random_(4, 9));
        const double width = 0.34, high = 0.13;
        const double room = house.half(wall) - 0.3 - length * width / 2;
        if (room < 0) return;
        const double middle = random_(-room, room);
        const double foot = random_() < 0.5 ? 0.0 : house.height - 0.5 - courses * high;
        for (int row = 0; row < courses; ++row)
            for (int k = 0; k < length; ++k) {
                // Ragged ends, and a brick gone here and there.
                const double edge = std::abs(k + 0.5 - length / 2.0) / length;
                if (random_() < 0.08 + edge * edge) continue;
                const double level = foot + (row + 0.5) * high;
                const double at = middle + (k + 0.5 + 0.5 * (row % 2) - length / 2.0) * width;
                const double out = house.reach(wall) - 0.05 * level + random_(-0.035, -0.01);
                const glm::dvec3 half{random_(0.055, 0.07), high / 2 - random_(0.008, 0.012),
                                      width / 2 - random_(0.008, 0.014)};
                builder_.box(house.to_world(House::out(wall) * out + House::along(wall) * at +
                                            glm::dvec3{0, level, 0}),
                             wall % 2 == 0 ? half : glm::dvec3{half.z, half.y, half.x},
                             shade(brick, 0.16), house.angle);
            }
    }

    void dome(const glm::dvec3& foot, double radius, double drum)
    {
        std::vector<glm::dvec2> profile{
            {radius + 0.08, -0.05}, {radius + 0.08, 0.12}, {radius, 0.16}, {radius, drum}};
        constexpr int arcs = 9;
        for (int i = 1; i <= arcs; ++i) {
            const double angle = pi / 2 * i / arcs;
            profile.push_back({i == arcs ? 0.04 : radius * std::cos(angle),
                               drum + 1.12 * radius * std::sin(angle)});
        }
        profile.push_back({0.035, profile.back().y + 0.22});
        profile.push_back({0.08, profile.back().y + 0.05});
        profile.push_back({0.0, profile.back().y + 0.14});
        builder_.turned(foot, profile, 24, shade(random_() < 0.3 ? blue : whitewash));
    }

    void pot(const glm::dvec3& foot, double size)
    {
        const double belly = random_(0.30, 0.40), neck = random_(0.13, 0.22);
        const glm::dvec2 profile[] = {
            {0.16, -0.02},        {0.2, 0.02},         {belly * 0.85, 0.2}, {belly, 0.42},
            {belly * 0.93, 0.6},  {neck * 1.2, 0.78},  {neck, 0.86},        {neck + 0.06, 0.94},
            {neck + 0.055, 0.97}, {neck - 0.02, 0.95}, {neck - 0.03, 0.84}};
        std::vector<glm::dvec2> scaled;
        for (const glm::dvec2& at : profile) scaled.push_back(at * size);
        builder_.turned(foot, scaled, 12, shade(clay, 0.2));
    }

    /// A flight of steps up to a roof along the wall of a house.
    void steps(const House& house, int wall)
    {
        const double rise = 0.21;
        const int count = static_cast<int>(house.height / rise);
        const double run = (std::min)(0.27, (2 * house.half(wall) - 0.3) / count);
        const double out = house.reach(wall) + 0.3;
        for (int i = 0; i < count; ++i) {
            const double at = -house.half(wall) + 0.2 + (i + 0.5) * run;
            const double high = (i + 1) * rise;
            const glm::dvec3 half{0.42 + random_(0, 0.02), (high + 0.9) / 2,
                                  run / 2 - random_(0.002, 0.006)};
            builder_.box(house.to_world(House::out(wall) * out + House::along(wall) * at +
                                        glm::dvec3{0, (high - 0.9) / 2, 0}),
                         wall % 2 == 0 ? half : glm::dvec3{half.z, half.y, half.x},
                         house.colour * static_cast<float>(random_(0.9, 1.0)), house.angle);
        }
    }

    void ladder(const House& house, int wall)
    {
        const double at = random_(-0.5, 0.5) * house.half(wall), high = house.height + 1.1;
        const auto point = [&](double side, double t) {
            return house.to_world(House::out(wall) * (house.reach(wall) + 0.75 - 0.78 * t) +
                                  House::along(wall) * (at + side * (0.24 - 0.05 * t)) +
                                  glm::dvec3{0, t * high - 0.1, 0});
        };
        for (const double side : {-1.0, 1.0}) {
            const glm::dvec3 path[] = {point(side, 0), point(side, 1)};
            constexpr double radii[] = {0.035, 0.03};
            builder_.tube(path, radii, 6, shade(timber));
        }
        for (double t = 0.08; t < 0.97; t += 0.3 / high) {
            const glm::dvec3 path[] = {point(-1.2, t), point(1.2, t)};
            constexpr double radii[] = {0.022, 0.022};
            builder_.tube(path, radii, 5, shade(timber));
        }
    }

    void palm(const glm::dvec3& foot, double height)
    {
        const double bend = random_(0, 2 * pi), sway = random_(0.2, 1.1);
        const glm::dvec3 lean{std::cos(bend) * sway, 0, std::sin(bend) * sway};
        std::vector<glm::dvec3> path;
        std::vector<double> radii;
        constexpr int rings = 22;
        for (int i = 0; i <= rings; ++i) {
            const double t = double(i) / rings;
            path.push_back(foot + lean * (t * t) + glm::dvec3{0, t * (height + 0.4) - 0.4, 0});
            radii.push_back((0.20 - 0.07 * t) * (i % 2 == 0 ? 1.12 : 0.95));
        }
        builder_.tube(path, radii, 9, shade(bark));
        const glm::dvec3 crown = path.back();
        const int fronds = 13;
        for (int f = 0; f < fronds; ++f) {
            const double turn = 2 * pi * f / fronds * 1.618 * 2, droop = random_(0.35, 1.25);
            const glm::dvec3 out{std::cos(turn), 0, std::sin(turn)}, side{-out.z, 0, out.x};
            const double length = random_(1.9, 2.7);
            const auto spine = [&](double t) {
                return crown + out * (0.03 + 0.002 * f + length * t * (1 - 0.25 * droop * t)) +
                       glm::dvec3{0, 0.05 + length * t * (0.75 - droop * (0.3 + 0.95 * t)), 0};
            };
            std::vector<glm::dvec3> rib;
            std::vector<double> sizes;
            for (int i = 0; i <= 7; ++i) {
                rib.push_back(spine(i / 7.0));
                sizes.push_back(0.035 - 0.004 * i);
            }
            const support::Rgb colour = shade(leaf, 0.2);
            builder_.tube(rib, sizes, 4, colour);
            // Leaflets: flat pyramids.
            constexpr int pairs = 11;
            for (int i = 0; i < pairs; ++i)
                for (const double hand : {-1.0, 1.0}) {
                    const double t = 0.12 + 0.86 * i / pairs;
                    const glm::dvec3 root = spine(t), next = spine(t + 0.055);
                    const glm::dvec3 along = glm::normalize(next - root);
                    const double size = length * (0.30 - 0.20 * t);
                    const glm::dvec3 tip = root + side * (hand * size * 0.8) +
                                           along * (0.55 * size) +
                                           glm::dvec3{0, -0.35 * size - random_(0, 0.05), 0};
                    const glm::dvec3 wide = along * 0.045;
                    const glm::dvec3 edge = side * (hand * 0.006);
                    const glm::dvec3 up{0, 0.014, 0};
                    const std::uint32_t a = builder_.vertex(root + edge - wide),
                                        b = builder_.vertex(root + edge + wide),
                                        c = builder_.vertex(root + up - side * (hand * 0.004)),
                                        d = builder_.vertex(tip);
                    const auto face = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
                        if (hand < 0) builder_.triangle(p, q, r, colour);
                        else builder_.triangle(r, q, p, colour);
                    };
                    face(a, b, c);
                    face(b, a, d);
                    face(c, b, d);
                    face(a, c, d);
                }
        }
    }

    /// The corner of the plot (column, row) nearest to the origin, on one side of the street.
    [[nodiscard]] glm::dvec2 plot_centre(int side, int column, int row) const
    {
        const double x = street / 2 + (column + 0.5) * plot + (column + 1) / 2 * lane;
        const double z = -half_length() + (row + 0.5) * plot + row / 2 * lane;
        return {side * x, z};
    }

    void quarters()
    {
        for (const int side : {-1, 1})
            for (int column = 0; column < columns_; ++column)
                for (int row = 0; row < rows_; ++row) {
                    const glm::dvec2 at = plot_centre(side, column, row);
                    const double empty = random_();
                    if (column > 0 && empty < 0.08) {
                        garden(at);
                        continue;
                    }
                    block(at, side, column);
                }
    }

    void garden(const glm::dvec2& at)
    {
        for (int i = 0; i < 2; ++i) {
            const double x = at.x + random_(-2.4, 2.4), z = at.y + random_(-2.4, 2.4);
            palm({x, ground(x, z), z}, random_(4.5, 7.5));
        }
        for (int i = 0; i < 5; ++i) {
            const double x = at.x + random_(-3, 3), z = at.y + random_(-3, 3);
            pot({x, ground(x, z), z}, random_(0.6, 1.1));
        }
        // A low wall around, with a gap.
        const double edge = plot / 2 - 0.3;
        const glm::dvec2 corners[] = {
            {-edge, edge}, {-edge, -edge}, {edge, -edge}, {edge, edge}, {0.9, edge}};
        for (int i = 0; i < 4; ++i) {
            const glm::dvec2 middle = (corners[i] + corners[i + 1]) * 0.5 + at;
            const glm::dvec2 size = glm::abs(corners[i + 1] - corners[i]) * 0.5;
            const glm::dvec3 half{size.x + 0.15 + random_(0, 0.02), 0.9 + random_(-0.1, 0.1),
                                  size.y + 0.15 + random_(0, 0.02)};
            builder_.chamfered_box({middle.x, ground(middle.x, middle.y) + 0.2, middle.y}, half,
                                   0.05, shade(mud));
        }
    }

    void block(const glm::dvec2& at, int side, int column)
    {
        House main{};
        main.x = random_(2.3, 3.3);
        main.z = random_(2.3, 3.3);
        // Houses at the street stand in one line, more or less.
        const double shift =
            column == 0 ? -side * (plot / 2 - main.x - random_(0.1, 0.5)) : random_(-0.2, 0.2);
        const double x = at.x + shift, z = at.y + random_(-0.2, 0.2);
        main.foot = {x, ground(x, z), z};
        const double tall = random_();
        main.height = tall < 0.6 ? random_(2.75, 3.3) : random_(5.5, 6.1);
        main.angle = random_(-0.05, 0.05);
        main.door = column == 0 ? (side > 0 ? 2 : 0) : static_cast<int>(random_(0, 4));
        const support::Rgb plaster = random_() < 0.35 ? whitewash : sand;
        main.colour = shade(mix(mud, plaster, random_(0.2, 0.8)));
        house(main);
        if (main.height < 4 && random_() < 0.35) steps(main, (main.door + 1) % 4);
        else if (random_() < 0.3) ladder(main, (main.door + 3) % 4);

        const double roof = random_();
        if (roof < 0.42) {
            House upper = main;
            upper.x = main.x * random_(0.45, 0.62);
            upper.z = main.z * random_(0.5, 0.75);
            upper.foot = main.to_world({(random_() < 0.5 ? 1 : -1) * (main.x - upper.x - 0.45),
                                        main.height + 0.03,
                                        (random_() < 0.5 ? 1 : -1) * (main.z - upper.z - 0.45)});
            upper.height = random_(2.6, 2.9);
            upper.door = static_cast<int>(random_(0, 4));
            house(upper);
        } else if (roof < 0.60) {
            const glm::dvec3 foot =
                main.to_world({random_(-0.3, 0.3), main.height - 0.03, random_(-0.3, 0.3)});
            const double radius = (std::min)(main.x, main.z) * random_(0.5, 0.66);
            dome(foot, radius, random_(0.3, 0.7));
        } else {
            for (int i = 0; i < 2; ++i) {
                const glm::dvec3 foot = main.to_world(
                    {random_(-0.6, 0.6) * main.x, main.height - 0.01, random_(-0.6, 0.6) * main.z});
                pot(foot, random_(0.5, 0.9));
            }
        }
        // Pots beside the door, in some lanes a palm.
        const int wall = main.door;
        for (int i = 0; i < 2; ++i) {
            const double out = main.reach(wall) + random_(0.3, 0.6);
            const double along = random_(0.35, 0.95) * main.half(wall);
            const glm::dvec3 place =
                main.to_world(House::out(wall) * out + House::along(wall) * along);
            pot({place.x, ground(place.x, place.z), place.z}, random_(0.5, 1.0));
        }
    }

    /// Cloth on poles in front of the houses, with goods below.
    void market()
    {
        constexpr support::Rgb cloths[] = {{0.62f, 0.16f, 0.10f},
                                           {0.70f, 0.50f, 0.16f},
                                           {0.20f, 0.36f, 0.48f},
                                           {0.76f, 0.70f, 0.58f}};
        for (int row = 0; row < rows_; ++row)
            for (const int side : {-1, 1}) {
                if (random_() < 0.25) continue;
                const glm::dvec2 at = plot_centre(side, 0, row);
                const double z = at.y + random_(-0.6, 0.6);
                stall(side, z, shade(cloths[static_cast<int>(random_(0, 4))]));
            }
        for (const double z : {-0.7, -0.25, 0.4}) {
            const double x = random_(-0.6, 0.6), place = z * half_length();
            palm({x, ground(x, place), place}, random_(5.5, 7.5));
        }
    }

    void stall(int side, double z, const support::Rgb& colour)
    {
        const double back = side * (street / 2 + 0.25), front = side * (street / 2 - 1.9);
        const double half = random_(1.3, 1.9), high = random_(2.3, 2.6), drop = random_(0.35, 0.6);
        const double base = ground(front, z);
        const auto cloth = [&](double s, double t, double lift) {
            const double sag = 0.22 * std::sin(pi * s) * std::sin(pi * t) + 0.03 * std::sin(9 * s);
            return glm::dvec3{std::lerp(back, front, t), base + high - drop * t - sag + lift,
                              z + (2 * s - 1) * half};
        };
        // Along the lower side and back along the upper one.
        constexpr int across = 12, along = 8;
        builder_.loft(
            2 * along, across + 1,
            [&](int i, int j) {
                const int k = side < 0 ? i : 2 * along - 1 - i;
                const bool upper = k >= along;
                const int step = upper ? 2 * along - 1 - k : k;
                return cloth(double(j) / across, step / (along - 1.0), upper ? 0.02 : 0.0);
            },
            colour);
        for (const double end : {-1.0, 1.0})
            for (const double t : {0.04, 0.96}) {
                const glm::dvec3 top = cloth((end + 1) / 2, t, 0.06);
                const double x = top.x, foot = base - 0.4;
                const glm::dvec3 path[] = {{x, foot, top.z - end * 0.06},
                                           {x, top.y, top.z - end * 0.06}};
                constexpr double radii[] = {0.045, 0.035};
                builder_.tube(path, radii, 8, shade(timber));
            }
        // A table of planks, baskets and sacks.
        const double table = base + 0.78, middle = std::lerp(back, front, 0.6);
        for (int i = 0; i < 4; ++i) {
            const glm::dvec3 plank{middle + (i - 1.5) * 0.21, table + random_(0, 0.01), z};
            const glm::dvec3 size{0.10 - random_(0, 0.004), 0.025, half - 0.25 + random_(0, 0.04)};
            builder_.box(plank, size, shade(timber));
        }
        for (const double end : {-1.0, 1.0})
            builder_.box({middle, table - 0.46, z + end * (half - 0.45)}, {0.36, 0.45, 0.05},
                         timber);
        const double room = half - 0.4;
        for (int i = 0; i < 7; ++i) {
            const double radius = random_(0.1, 0.2);
            const glm::dvec2 basket[] = {
                {radius * 0.8, -0.01},        {radius * 1.1, radius * 0.7},
                {radius * 1.15, radius},      {radius * 0.8, radius * 1.05},
                {radius * 0.5, radius * 1.3}, {0, radius * 1.4}};
            const glm::dvec3 foot{middle + random_(-0.3, 0.3), table + 0.03 + random_(0, 0.01),
                                  z + random_(-room, room)};
            builder_.turned(foot, basket, 14, shade(mix(clay, sand, random_()), 0.2));
        }
        for (int i = 0; i < 4; ++i) {
            const double x = front + side * random_(0.1, 0.5), at = z + random_(-half, half);
            pot({x, ground(x, at), at}, random_(0.5, 0.9));
        }
    }

    void wall()
    {
        const double x = half_width() + 2.2, z = half_length() + 2.2;
        const auto stretch = [&](const glm::dvec2& from, const glm::dvec2& to) {
            const double length = glm::length(to - from);
            const int count = static_cast<int>(std::lround(length / 4.2));
            const glm::dvec2 along = (to - from) / length;
            const double angle = std::atan2(-along.y, along.x);
            for (int i = 0; i < count; ++i) {
                const glm::dvec2 at = from + along * (length * (i + 0.5) / count);
                const double base = ground(at.x, at.y), half = length / count / 2;
                const support::Rgb colour = shade(mix(mud, sand, 0.5), 0.05);
                const glm::dvec3 middle{at.x, base + 1.0, at.y};
                builder_.chamfered_box(
                    middle, {half + 0.05 + random_(0, 0.02), 2.4, 0.55 + random_(0, 0.02)}, 0.05,
                    colour, angle);
                for (const double k : {-0.5, 0.5})
                    builder_.chamfered_box(middle + glm::dvec3{along.x * k * half * 1.02, 2.6,
                                                               along.y * k * half * 1.02},
                                           {half * 0.3, 0.42, 0.30 + random_(0, 0.02)}, 0.07,
                                           colour, angle);
            }
        };
        const double gate = 3.4;
        stretch({-x, -z}, {-gate, -z});
        stretch({gate, -z}, {x, -z});
        stretch({-x, z}, {-gate, z});
        stretch({gate, z}, {x, z});
        stretch({-x, -z}, {-x, z});
        stretch({x, -z}, {x, z});
        const auto tower = [&](double at_x, double at_z, double radius, double height) {
            const glm::dvec3 foot{at_x, ground(at_x, at_z) - 1, at_z};
            const glm::dvec2 profile[] = {{radius * 1.18, 0},
                                          {radius * 1.1, height * 0.3},
                                          {radius, height},
                                          {radius * 1.12, height + 0.3},
                                          {radius * 1.12, height + 0.9},
                                          {radius * 0.9, height + 0.9},
                                          {radius * 0.9, height + 0.2}};
            const support::Rgb colour = shade(mix(mud, sand, 0.6), 0.06);
            builder_.turned(foot, profile, 28, colour);
            for (int i = 0; i < 9; ++i) {
                const double angle = 2 * pi * i / 9 + 0.1;
                const glm::dvec3 out{std::cos(angle), 0, -std::sin(angle)};
                builder_.chamfered_box(
                    foot + out * (radius * 1.01) + glm::dvec3{0, height + 1.2, 0},
                    {radius * 0.14, 0.4, 0.22 * radius}, 0.05, colour, angle);
            }
        };
        for (const double side_x : {-1.0, 1.0})
            for (const double side_z : {-1.0, 1.0}) {
                tower(side_x * x, side_z * z, 2.3, 6.5);
                tower(side_x * (gate + 1.2), side_z * z, 1.9, 7.2);
                for (int i = 0; i < 4; ++i) {
                    const double px = side_x * (x + random_(4, 30)),
                                 pz = side_z * random_(0, z + 20);
                    palm({px, ground(px, pz), pz}, random_(4.5, 8));
                }
            }
    }

    Builder& builder_;
    Random random_;
    int columns_, rows_;
};

}  // namespace

Scene city(const CityOptions& options)
{
    Scene scene;
    scene.name = "city";
    Builder builder;
    City city{builder, options};
    city.build();
    builder.finish(scene);
    const double z = city.half_length();
    scene.camera.eye = {1.3, ground(0, z) + 11.5, z + 7};
    scene.camera.target = {-0.6, ground(0, z) + 1.5, z - 26};
    scene.camera.vertical_fov = 0.85;
    scene.radius = 0.3;
    return scene;
}

}  // namespace scenes
