#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

namespace {

/// A link: a round bar along the edge of a stadium of length 2 (straight + bend) in the plane of
/// `along` and `side`.
struct Link {
    double straight, bend, bar;
};

void add_link(Builder& builder, const Link& link, const glm::dvec3& centre, const glm::dvec3& along,
              const glm::dvec3& side, const support::Rgb& colour)
{
    constexpr double pi = std::numbers::pi;
    const glm::dvec3 normal = glm::cross(along, side);
    const double perimeter = 4 * link.straight + 2 * pi * link.bend;
    builder.surface(
        {36, 12, true, true},
        [&](double u, double v) {
            // A position on the stadium and the direction outwards, in the plane of the link.
            double at = u * perimeter, x = 0, y = 0, out_x = 0, out_y = 0;
            const auto bend_at = [&](double middle, double angle) {
                out_x = std::cos(angle);
                out_y = std::sin(angle);
                x = middle + link.bend * out_x;
                y = link.bend * out_y;
            };
            const double half = pi * link.bend;
            if (at < half) {
                bend_at(link.straight, -pi / 2 + at / link.bend);
            } else if ((at -= half) < 2 * link.straight) {
                x = link.straight - at, y = link.bend, out_y = 1;
            } else if ((at -= 2 * link.straight) < half) {
                bend_at(-link.straight, pi / 2 + at / link.bend);
            } else {
                at -= half;
                x = -link.straight + at, y = -link.bend, out_y = -1;
            }
            const double turn = 2 * pi * v;
            const double outwards = link.bar * std::cos(turn);
            return centre + along * (x + out_x * outwards) + side * (y + out_y * outwards) +
                   normal * (link.bar * std::sin(turn));
        },
        [&](double, double) { return colour; });
}

/// A chain from one point to another, hanging as a parabola `sag` deep.
void add_chain(Builder& builder, const glm::dvec3& from, const glm::dvec3& to, double sag,
               int links, const support::Rgb& colour)
{
    const auto at = [&](double t) {
        return from + (to - from) * t - glm::dvec3{0, 4 * sag * t * (1 - t), 0};
    };
    // Equal steps along the curve, from a table of its length.
    constexpr int samples = 512;
    double length[samples + 1] = {};
    for (int i = 1; i <= samples; ++i)
        length[i] = length[i - 1] + glm::length(at(double(i) / samples) - at((i - 1.0) / samples));
    const double step = length[samples] / links;
    // The middles of neighbours lie a pitch apart; their bars touch inside the bends.
    const double bar = 0.11 * step, bend = 0.33 * step;
    const Link link{step / 2 + bar - bend, bend, bar};
    for (int i = 0, sample = 0; i < links; ++i) {
        const double wanted = (i + 0.5) * step;
        while (sample < samples && length[sample + 1] < wanted) ++sample;
        const double t =
            (sample + (wanted - length[sample]) / (length[sample + 1] - length[sample])) / samples;
        const glm::dvec3 along = glm::normalize(at(t + 1e-4) - at(t - 1e-4));
        const glm::dvec3 level = glm::normalize(glm::cross(along, glm::dvec3{0, 1, 0}));
        const glm::dvec3 upright = glm::cross(level, along);
        // Each link is turned by a quarter against the last; none lies quite flat.
        const double turn = (i % 2 == 0 ? 0.25 : 0.75) * std::numbers::pi;
        add_link(builder, link, at(t), along, level * std::cos(turn) + upright * std::sin(turn),
                 colour);
    }
}

}  // namespace

Scene chains(const ChainsOptions& options)
{
    Scene scene;
    scene.name = "chains";
    Builder builder;
    const support::Rgb stone{0.66f, 0.64f, 0.60f}, iron{0.42f, 0.44f, 0.48f},
        post{0.58f, 0.36f, 0.24f};
    constexpr double spacing = 1.25, height = 1.25, radius = 0.05;
    const int pillars = options.pillars;
    const double half = spacing * (pillars - 1) / 2;
    builder.box({0, -0.08, 0}, {half + 1, 0.08, 1.9}, stone);
    for (const double z : {-0.95, 0.0, 0.95}) {
        for (int i = 0; i < pillars; ++i) {
            const double x = i * spacing - half;
            builder.box({x, 0.05, z}, {0.13, 0.05, 0.13}, stone);
            builder.pillar({x, 0.1, z}, radius, height, 24, post);
            builder.box({x, 0.1 + height + 0.03, z}, {0.08, 0.03, 0.08}, post);
            if (i + 1 == pillars) continue;
            const double sag = 0.42 + 0.16 * std::sin(2.1 * i + 1.3 * z);
            add_chain(builder, {x + radius, height, z}, {x + spacing - radius, height, z}, sag,
                      options.links, iron);
        }
    }
    builder.finish(scene);
    scene.camera.eye = {1.75, 1.75, 3.5};
    scene.camera.target = {-0.1, 0.55, 0};
    scene.camera.vertical_fov = 0.70;
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
