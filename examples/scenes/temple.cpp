#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "builder.hpp"
#include "scenes.hpp"

// The temple stands around the origin, its front faces +z, the ground lies at y = 0. Lengths in
// metres. Every stone is a closed solid of its own. Stones overlap a little where one stands on the
// other and leave joints of some millimetres beside each other, so that no two of them share a
// vertex.

namespace scenes {

namespace {

constexpr double pi = std::numbers::pi;

constexpr double pitch = 2.4;                        // from column to column
constexpr double step_rise = 0.36, step_run = 0.40;  // of the base
constexpr int steps = 3;
constexpr double platform = steps * step_rise;                // where the columns stand
constexpr double lower_radius = 0.54, upper_radius = 0.42;    // of the columns
constexpr double shaft = 4.9, echinus = 0.27, abacus = 0.25;  // heights
constexpr double seat = 0.004;                                // how far a stone sinks into another
constexpr double architrave = platform + shaft + echinus + abacus;  // levels: where each begins
constexpr double frieze = architrave + 0.80, cornice = frieze + 0.78, roof = cornice + 0.26;
constexpr double beam = 0.44;   // half the depth of the architrave
constexpr double slope = 0.27;  // of the roof
constexpr double overhang = 0.55;

constexpr support::Rgb marble{0.74f, 0.70f, 0.62f}, pale{0.80f, 0.77f, 0.70f},
    worn{0.62f, 0.57f, 0.49f}, plaster{0.76f, 0.68f, 0.54f}, red{0.52f, 0.20f, 0.15f},
    blue{0.20f, 0.29f, 0.42f}, clay{0.58f, 0.33f, 0.22f}, oak{0.30f, 0.19f, 0.11f},
    bronze{0.34f, 0.30f, 0.20f}, gravel{0.55f, 0.50f, 0.41f};

class Temple {
public:
    Temple(Builder& builder, const TempleOptions& options)
        : builder_{builder},
          random_{options.seed},
          across_{options.across},
          along_{options.along},
          half_x_{(options.across - 1) * pitch / 2},
          half_z_{(options.along - 1) * pitch / 2}
    {}

    void build()
    {
        ground();
        base();
        columns();
        entablature();
        gables();
        cella();
        forecourt();
    }

private:
    /// The colour of one stone among others.
    support::Rgb shade(const support::Rgb& colour)
    {
        return colour * static_cast<float>(random_(0.86, 1.06));
    }
    /// Half the width of a joint: other for each stone, so that no two corners meet.
    double joint() { return random_(0.002, 0.006); }

    /// A stone in the box from `low` to `high`, less its joints.
    void stone(const glm::dvec3& low, const glm::dvec3& high, const support::Rgb& colour)
    {
        const glm::dvec3 lower = low + glm::dvec3{joint(), -joint() / 4, joint()};
        const glm::dvec3 upper = high - glm::dvec3{joint(), joint() / 4, joint()};
        builder_.box((lower + upper) * 0.5, (upper - lower) * 0.5, shade(colour));
    }

    void ground()
    {
        builder_.box({0, -0.5, 0}, {160, 0.5, 160}, gravel);
        // Slabs in front of the steps, in courses that break joint.
        const double width = half_x_ + 5, first = half_z_ + 2.4;
        for (int row = 0; row < 7; ++row) {
            double x = -width - random_(0, 0.5);
            while (x < width) {
                const double next = x + random_(1.3, 2.4), z = first + 1.3 * row;
                stone({x, -0.1, z}, {(std::min)(next, width + 0.4), random_(0.02, 0.06), z + 1.3},
                      worn);
                x = next;
            }
        }
    }

    void base()
    {
        for (int i = 0; i < steps; ++i) {
            const double out = 0.95 + step_run * (steps - 1 - i);
            const double x = half_x_ + out, z = half_z_ + out, in = step_run + 0.2;
            const double low = i * step_rise - seat, high = (i + 1) * step_rise;
            const auto course = [&](double from, double to, const auto& place) {
                const int count = static_cast<int>(std::lround((to - from) / 2.4));
                double at = from;
                for (int k = 1; k <= count; ++k) {
                    const double next =
                        k == count ? to
                                   : std::lerp(from, to, double(k) / count) + random_(-0.2, 0.2);
                    place(at, next);
                    at = next;
                }
            };
            for (const double side : {-1.0, 1.0}) {
                course(-x, x, [&](double a, double b) {
                    stone({a, low, side > 0 ? z - in : -z}, {b, high, side > 0 ? z : -z + in},
                          marble);
                });
                course(-z + in, z - in, [&](double a, double b) {
                    stone({side > 0 ? x - in : -x, low, a}, {side > 0 ? x : -x + in, high, b},
                          marble);
                });
            }
        }
        const double in = 0.95 - step_run - 0.1;
        builder_.box({0, platform / 2 - 0.03, 0}, {half_x_ + in, platform / 2, half_z_ + in}, pale);
        // Lower treads between the steps, before the door.
        for (int i = 0; i < 2 * steps - 1; i += 2) {
            const double run = 0.95 + step_run * (steps - i / 2.0 - 0.5);
            const double from = half_z_ + 0.6 + (steps - 1 - i / 2) * step_run, to = half_z_ + run;
            for (int k = -1; k <= 1; ++k)
                stone({(k - 0.5) * 1.3, -seat, from},
                      {(k + 0.5) * 1.3, (i + 1) * step_rise / 2, to}, marble);
        }
    }

    void columns()
    {
        for (int i = 0; i < across_; ++i)
            for (int k = 0; k < along_; ++k)
                if (i == 0 || k == 0 || i == across_ - 1 || k == along_ - 1)
                    column({i * pitch - half_x_, platform - seat, k * pitch - half_z_});
    }

    /// The section of a shaft: flutes that meet in edges, three points each.
    static double fluted(int i) { return i % 3 == 0 ? 1 : 0.93; }
    static constexpr int flutes = 15;

    void column(const glm::dvec3& foot)
    {
        const support::Rgb colour = shade(marble);
        const double turn = random_(0, 0.02);
        builder_.loft(
            3 * flutes, 2,
            [&](int i, int j) {
                const double radius = (j == 0 ? lower_radius : upper_radius) * fluted(i);
                const double angle = 2 * pi * i / (3 * flutes) + turn;
                return foot +
                       glm::dvec3{radius * std::cos(angle), shaft * j, -radius * std::sin(angle)};
            },
            colour);
        constexpr double low = shaft - seat, wide = 0.66;
        const glm::dvec2 bell[] = {{upper_radius * 0.98, low},
                                   {0.55, low + 0.13},
                                   {wide - 0.02, low + 0.23},
                                   {wide, low + echinus}};
        builder_.turned(foot, bell, 16, colour);
        const double half = 0.70 - joint();
        builder_.box(foot + glm::dvec3{0, shaft + echinus + abacus / 2 - 2 * seat, 0},
                     {half, abacus / 2, half}, colour);
    }

    /// Calls f(centre, along, out, last) for each stretch of the four sides, from column to column.
    template <class F>
    void round_about(F&& f)
    {
        for (const double side : {-1.0, 1.0}) {
            for (int i = 0; i + 1 < across_; ++i)
                f(glm::dvec3{(i + 0.5) * pitch - half_x_, 0, side * half_z_},
                  glm::dvec3{side, 0, 0}, glm::dvec3{0, 0, side});
            for (int k = 0; k + 1 < along_; ++k)
                f(glm::dvec3{side * half_x_, 0, (k + 0.5) * pitch - half_z_},
                  glm::dvec3{0, 0, -side}, glm::dvec3{side, 0, 0});
        }
    }
    /// Where a stretch lies: its middle on the ground, along it, outwards.
    struct Stretch {
        glm::dvec3 middle, along, out;
    };
    /// From where to where a stone reaches along a stretch, upwards and outwards.
    struct Stone {
        glm::dvec2 x, y, z;
        support::Rgb colour;
    };
    void place(const Stretch& at, const Stone& stone)
    {
        const auto middle = [](const glm::dvec2& range) { return (range.x + range.y) / 2; };
        const auto half = [](const glm::dvec2& range) { return (range.y - range.x) / 2; };
        builder_.block(at.middle + at.along * middle(stone.x) + at.out * middle(stone.z) +
                           glm::dvec3{0, middle(stone.y), 0},
                       at.along * half(stone.x), {0, half(stone.y), 0}, at.out * half(stone.z),
                       stone.colour);
    }

    void entablature()
    {
        constexpr double face = beam + 0.06;
        round_about([&](const glm::dvec3& middle, const glm::dvec3& along, const glm::dvec3& out) {
            // Along x the blocks reach the corners, along z they end before them.
            const bool front = out.z != 0;
            const auto is_end = [&](double sign) {
                const glm::dvec3 at = middle + along * (sign * pitch / 2);
                return front ? std::fabs(at.x) > half_x_ - 0.1 : std::fabs(at.z) > half_z_ - 0.1;
            };
            const auto reach = [&](double sign, double corner) {
                const double more = !is_end(sign) ? 0 : front ? corner : -corner;
                return sign * (pitch / 2 + more - joint());
            };
            const glm::dvec2 run{reach(-1, beam), reach(1, beam)};
            // Two beams side by side; a fillet on the outer one.
            place({middle, along, out}, {run,
                                         {architrave - seat - joint() / 4, frieze - 0.11},
                                         {joint(), beam - joint() / 4},
                                         shade(marble)});
            place({middle, along, out}, {{run.x + joint(), run.y - joint()},
                                         {architrave - joint() / 4, frieze - 0.005},
                                         {-beam + joint(), -joint()},
                                         shade(marble)});
            place({middle, along, out}, {{reach(-1, face), reach(1, face)},
                                         {frieze - 0.11 - joint() / 4, frieze + joint() / 4},
                                         {0.02 + joint(), face - joint() / 4},
                                         shade(red)});
            place({middle, along, out}, {{reach(-1, beam - 0.03), reach(1, beam - 0.03)},
                                         {frieze - joint() / 4, cornice + joint() / 4},
                                         {-0.30 + joint(), beam - 0.03 - joint() / 4},
                                         shade(pale)});
            for (const double at : {0.0, 1.0}) {
                if (at > 0 && is_end(1)) continue;
                triglyph(middle + along * (at * pitch / 2), along, out);
            }
            if (is_end(-1))
                triglyph(middle - along * (pitch / 2 + (front ? 0.13 : -0.0)), along, out);
            if (is_end(1))
                triglyph(middle + along * (pitch / 2 + (front ? 0.13 : 0.0)), along, out);
            // The cornice, with a row of flat blocks under it.
            place({middle, along, out}, {{reach(-1, beam + overhang), reach(1, beam + overhang)},
                                         {cornice - joint() / 4, roof - joint() / 4},
                                         {-0.2 + joint(), beam + overhang - joint() / 4},
                                         shade(marble)});
            for (int i = 0; i < 3; ++i) {
                const double x = (i - 1) * pitch / 3;
                place({middle, along, out}, {{x - 0.27, x + 0.27},
                                             {cornice - 0.07 - joint() / 4, cornice + 0.02},
                                             {beam - 0.1, beam + overhang - 0.09 - joint() / 4},
                                             blue});
            }
        });
    }

    /// A tablet with two grooves, and drops under the fillet below it.
    void triglyph(const glm::dvec3& middle, const glm::dvec3& along, const glm::dvec3& out)
    {
        constexpr double half = 0.27, deep = 0.05, out_face = 0.075;
        const double w = half - joint();
        const glm::dvec2 outline[] = {{-w, -0.05},       {w, -0.05},           {w, out_face},
                                      {0.15, out_face},  {0.09, deep - 0.03},  {0.04, out_face},
                                      {-0.04, out_face}, {-0.09, deep - 0.03}, {-0.15, out_face},
                                      {-w, out_face}};
        const glm::dvec3 foot =
            middle + out * (beam - 0.03) + glm::dvec3{0, frieze - joint() / 4, 0};
        // The outline runs along and outwards; its normal points down.
        builder_.prism(outline, foot + glm::dvec3{0, 0.77, 0}, along, out, {0, -0.77, 0}, blue);
        place({middle, along, out}, {{-half + joint(), half - joint()},
                                     {frieze - 0.17 - joint() / 4, frieze - 0.10},
                                     {beam - 0.04, beam + 0.045},
                                     shade(red)});
    }

    void gables()
    {
        const double x = half_x_ + beam + overhang, z = half_z_ + beam + overhang;
        const double rise = slope * x, inner = half_x_ + beam - 0.1;
        // Walls that fill the gables, then slabs that lean against each other at the ridge.
        for (const double side : {-1.0, 1.0}) {
            const double from = side > 0 ? half_z_ - 0.25 : -half_z_ - 0.05;
            const glm::dvec2 wall[] = {{-inner, 0}, {inner, 0}, {0, slope * inner}};
            builder_.prism(wall, {0, roof - 0.01, from}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.3},
                           shade(plaster));
            // Shields in relief.
            for (int i = -1; i <= 1; ++i) {
                const double radius = 0.62 - 0.17 * std::abs(i);
                const glm::dvec3 centre{1.9 * i, roof + 0.15 + radius,
                                        side > 0 ? from + 0.28 : from + 0.02};
                builder_.loft(
                    14, 3,
                    [&](int k, int j) {
                        constexpr double sizes[] = {1, 0.86, 0.25}, heights[] = {0, 0.11, 0.17};
                        const double angle = 2 * pi * k / 14;
                        return centre + glm::dvec3{side * radius * sizes[j] * std::cos(angle),
                                                   radius * sizes[j] * std::sin(angle),
                                                   side * heights[j]};
                    },
                    bronze);
            }
        }
        const double length = std::hypot(x, rise), thick = 0.11;
        for (const double side : {-1.0, 1.0}) {
            const glm::dvec3 down{side * x / length, -rise / length, 0};
            const glm::dvec3 up = glm::normalize(glm::dvec3{side * slope, 1, 0});
            struct Slab {
                double from, to, low, high, front, back;
                support::Rgb colour;
            };
            const auto slab = [&](const Slab& at) {
                const glm::dvec3 ridge{0, roof + rise, (at.front + at.back) / 2};
                const glm::dvec3 axis{0, 0, side * (at.front - at.back) / 2};
                builder_.block(
                    ridge + down * ((at.from + at.to) / 2) + up * ((at.low + at.high) / 2),
                    down * ((at.to - at.from) / 2), up * ((at.high - at.low) / 2), axis, at.colour);
            };
            const double apex = -0.03 + side * 0.011;
            slab({apex, length - joint(), 0.02, 0.02 + 2 * thick, z + joint(), -z - joint(),
                  shade(marble)});
            // A raised rim over both gables, tiles between.
            for (const double end : {-1.0, 1.0})
                slab({apex, length + 0.06 + joint(), 2 * thick, 2 * thick + 0.22,
                      end > 0 ? z + 0.08 + joint() : -z + 0.25,
                      end > 0 ? z - 0.25 : -z - 0.08 - joint(), shade(pale)});
            const int tiles = static_cast<int>(2 * z / 0.7);
            for (int i = 0; i < tiles; ++i) {
                const double at = std::lerp(-z + 0.3, z - 0.3, (i + 0.5) / tiles);
                const glm::dvec2 section[] = {{-0.09, 0}, {0.09, 0}, {0, 0.13}};
                const glm::dvec3 axis{0, 0, -side};
                const double set = 0.1 + joint();
                builder_.prism(section,
                               glm::dvec3{0, roof + rise, at} + down * set + up * (2 * thick), axis,
                               up, down * (length - 0.08), shade(clay));
            }
        }
        const double wide = z / (2 * along_);
        for (int i = 0; i < 2 * along_; ++i) {
            const double at = (2 * i + 1) * wide - z;
            stone({-0.17, roof + rise + 0.06, at - wide}, {0.17, roof + rise + 0.42, at + wide},
                  clay);
        }
        // Vases on the corners and the ridge.
        const glm::dvec2 vase[] = {{0.16, 0},    {0.19, 0.08}, {0.08, 0.2}, {0.24, 0.5},
                                   {0.26, 0.68}, {0.13, 0.86}, {0.2, 0.98}};
        for (const double end : {-1.0, 1.0})
            for (const double at : {-1.0, 0.0, 1.0})
                builder_.turned(
                    {at * (x - 0.05), roof + (at == 0 ? rise + 0.4 : 0.28), end * (z - 0.1)}, vase,
                    10, shade(bronze));
    }

    void cella()
    {
        const double x = half_x_ - 2.4, front = half_z_ - 3.2, back = -half_z_ + 2.9, wall = 0.55;
        const double top = frieze + 0.5;
        constexpr int courses = 9;
        const double high = (top - platform) / courses;
        constexpr double door = 1.15, lintel = 6;  // half its width; the course above it
        for (int i = 0; i < courses; ++i) {
            const double low = platform + i * high - seat, up = platform + (i + 1) * high;
            const double set = i == 0 ? 0.09 : 0;  // a plinth
            for (const double side : {-1.0, 1.0}) {
                const double near_x = side * (x + set), far_x = side * (x - wall);
                const int count = 2 + i % 2;
                for (int k = 0; k < count; ++k) {
                    const double from = std::lerp(back + wall, front - wall, double(k) / count);
                    const double to = std::lerp(back + wall, front - wall, double(k + 1) / count);
                    stone({(std::min)(near_x, far_x), low, from},
                          {(std::max)(near_x, far_x), up, to}, plaster);
                }
                const double inner = i < lintel ? door : 0;
                stone({side > 0 ? inner : -x - set, low, front - wall},
                      {side > 0 ? x + set : -inner, up, front + set}, plaster);
            }
            stone({-x - set, low, back - set}, {x + set, up, back + wall}, plaster);
        }
        const double door_top = platform + lintel * high;
        for (const double side : {-1.0, 1.0})
            stone({side * (door + 0.05) - 0.16, platform - seat, front - 0.2},
                  {side * (door + 0.05) + 0.16, door_top, front + 0.14}, pale);
        stone({-door - 0.32, door_top - 0.06, front - 0.2},
              {door + 0.32, door_top + 0.3, front + 0.2}, pale);
        stone({-door - 0.42, door_top + 0.28, front - 0.2},
              {door + 0.42, door_top + 0.40, front + 0.30}, pale);
        // One leaf ajar, one closed, both with panels.
        for (const double side : {-1.0, 1.0}) {
            const double angle = side < 0 ? 0.0 : 1.05;
            const glm::dvec3 hinge{side * (door - 0.12), 0, front - 0.3};
            const glm::dvec3 along{-side * std::cos(angle), 0, -std::sin(angle)};
            const glm::dvec3 out{-along.z * -side, 0, along.x * -side};
            const double height = door_top - platform - 0.08, width = door - 0.14;
            const auto leaf = [&](double x0, double x1, double y0, double y1, double half) {
                const glm::dvec3 centre =
                    hinge + along * ((x0 + x1) / 2) + glm::dvec3{0, platform + (y0 + y1) / 2, 0};
                builder_.block(centre, along * ((x1 - x0) / 2) * -side, {0, (y1 - y0) / 2, 0},
                               out * half, oak);
            };
            leaf(0, width, 0.01, height, 0.05);
            for (int row = 0; row < 4; ++row)
                leaf(0.14, width - 0.14, 0.15 + row * height / 4, (row + 1) * height / 4 - 0.06,
                     0.075 + 0.001 * row);
        }
        // The ceiling of the colonnade.
        builder_.box({0, frieze + 0.56, 0}, {half_x_ - 0.1, 0.1, half_z_ - 0.1}, pale);
        for (int k = 0; k < along_; ++k) {
            const double half = half_x_ - 0.2 - joint();
            builder_.box({0, frieze + 0.37, k * pitch - half_z_}, {half, 0.12, 0.16},
                         shade(marble));
        }
    }

    void forecourt()
    {
        // The altar.
        const double z = half_z_ + 6.6;
        const glm::dvec3 altar{2.4, 0, z};
        const auto slab = [&](const glm::dvec3& at, double low, double high, double half_x,
                              double half_z) {
            builder_.chamfered_box(at + glm::dvec3{0, (low + high) / 2, 0},
                                   {half_x, (high - low) / 2, half_z}, 0.025, shade(marble), 0.12);
        };
        slab(altar, -0.05, 0.26, 1.5, 1.1);
        slab(altar, 0.25, 0.48, 1.2, 0.82);
        slab(altar, 0.47, 1.14, 0.95, 0.60);
        slab(altar, 1.13, 1.30, 1.1, 0.74);
        const glm::dvec2 bowl[] = {{0.16, 0},    {0.2, 0.05}, {0.36, 0.2}, {0.42, 0.34},
                                   {0.38, 0.34}, {0.3, 0.2},  {0.05, 0.1}};
        builder_.turned(altar + glm::dvec3{0, 1.297, 0}, bowl, 20, bronze);

        // A draped figure on a plinth.
        const glm::dvec3 plinth{-4.3, 0, half_z_ + 5.4};
        slab(plinth, -0.05, 0.22, 0.95, 0.95);
        slab(plinth, 0.21, 1.35, 0.70, 0.70);
        slab(plinth, 1.34, 1.52, 0.84, 0.84);
        const glm::dvec3 feet = plinth + glm::dvec3{0, 1.515, 0};
        constexpr std::array<glm::dvec3, 9> body{{{0.42, 0.02, 0.34},
                                                  {0.44, 0.1, 0.36},
                                                  {0.33, 0.75, 0.27},
                                                  {0.30, 1.05, 0.25},
                                                  {0.24, 1.30, 0.2},
                                                  {0.30, 1.55, 0.22},
                                                  {0.33, 1.68, 0.2},
                                                  {0.14, 1.78, 0.12},
                                                  {0.075, 1.9, 0.075}}};
        builder_.loft(
            28, 9,
            [&](int i, int j) {
                const glm::dvec3& at = body[static_cast<std::size_t>(j)];
                const double angle = 2 * pi * i / 28;
                const double fold = 1 + 0.09 * (1 - at.y / 1.9) * std::cos(7 * angle + 0.8 * at.y);
                return feet + glm::dvec3{at.x * fold * std::cos(angle), at.y,
                                         -at.z * fold * std::sin(angle)};
            },
            pale);
        const glm::dvec2 head[] = {
            {0.03, 1.84}, {0.10, 1.90}, {0.135, 2.02}, {0.12, 2.12}, {0.05, 2.19}};
        builder_.turned(feet, head, 14, pale);
        for (const double side : {-1.0, 1.0}) {
            const glm::dvec3 arm[] = {feet + glm::dvec3{side * 0.27, 1.62, 0},
                                      feet + glm::dvec3{side * 0.42, 1.32, 0.06},
                                      feet + glm::dvec3{side * 0.25, 1.24, 0.36}};
            constexpr double radii[] = {0.085, 0.075, 0.05};
            builder_.tube(arm, radii, 8, pale);
        }

        // Drums of a fallen column, and what broke off.
        for (int n = 0; n < 2; ++n) {
            const double angle = 0.5 + 1.2 * n;
            const glm::dvec3 axis{std::cos(angle), 0, std::sin(angle)};
            const glm::dvec3 side{-axis.z, 0, axis.x};
            const glm::dvec3 start{half_x_ - 0.4 + 1.7 * n, 0.50, z - 0.2 - 1.9 * n};
            builder_.loft(
                3 * flutes, 2,
                [&](int i, int j) {
                    const double turn = -2 * pi * (i + 0.4) / (3 * flutes);
                    return start + axis * (1.15 * j) +
                           (side * std::cos(turn) + glm::dvec3{0, std::sin(turn), 0}) *
                               (0.5 * fluted(i));
                },
                shade(worn));
        }
        for (int i = 0; i < 7; ++i) {
            const double x = half_x_ + random_(-1.5, 3.5), aside = random_(-1.6, 1.4);
            const glm::dvec3 half{random_(0.1, 0.3), random_(0.14, 0.22), random_(0.1, 0.25)};
            const double angle = random_(0, 3);
            builder_.chamfered_box({x, 0.12, z + aside}, half, 0.03, shade(worn), angle);
        }
    }

    Builder& builder_;
    Random random_;
    int across_, along_;
    double half_x_, half_z_;  // from the origin to the axes of the outer columns
};

}  // namespace

Scene temple(const TempleOptions& options)
{
    Scene scene;
    scene.name = "temple";
    Builder builder;
    Temple{builder, options}.build();
    builder.finish(scene);
    const double x = (options.across - 1) * pitch / 2, z = (options.along - 1) * pitch / 2;
    scene.camera.eye = {x + 6.0, 1.75, z + 13.6};
    scene.camera.target = {x - 6.4, 4.35, z - 3.4};
    scene.camera.vertical_fov = 0.80;
    scene.radius = 0.3;
    return scene;
}

}  // namespace scenes
