#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "builder.hpp"
#include "scenes.hpp"

namespace scenes {

namespace {

constexpr double golden_angle = 2.399963229728653;

/// Radius of the ends of twigs.
constexpr double thinnest = 0.007;

/// What the branches of one generation look like.
struct Generation {
    int sides, joints;  ///< of the tube
    int children;       ///< branches that grow from it
    double first;       ///< of them, as a share of its length
    double spread;      ///< their angle to it, radians
    double length;      ///< theirs, as a share of its own
    double wander;      ///< how much it turns at each joint
};
constexpr Generation generations[] = {
    {18, 14, 11, 0.36, 1.05, 0.62, 0.05},
    {10, 9, 6, 0.3, 0.8, 0.52, 0.14},
    {7, 6, 5, 0.25, 0.75, 0.55, 0.2},
    {5, 4, 0, 0, 0, 0, 0.2},
};

class Growth {
public:
    Growth(Builder& builder, const TreeOptions& options)
        : builder_{builder},
          random_{options.seed},
          leaves_{options.leaves}
    {}

    /// A branch and all that grows from it.
    void branch(int generation, glm::dvec3 at, glm::dvec3 towards, double length, double radius);

private:
    [[nodiscard]] glm::dvec3 across(const glm::dvec3& along, double turn) const
    {
        const glm::dvec3 axis =
            std::fabs(along.y) < 0.9 ? glm::dvec3{0, 1, 0} : glm::dvec3{1, 0, 0};
        const glm::dvec3 side = glm::normalize(glm::cross(along, axis));
        return side * std::cos(turn) + glm::cross(along, side) * std::sin(turn);
    }
    void leaf(const glm::dvec3& stem, const glm::dvec3& towards);

    Builder& builder_;
    Random random_;
    int leaves_;
};

void Growth::branch(int generation, glm::dvec3 at, glm::dvec3 towards, double length, double radius)
{
    const Generation& kind = generations[generation];
    const support::Rgb bark{0.36f, 0.27f, 0.20f};
    std::vector<glm::dvec3> path{at};
    std::vector<double> radii{(std::max)(radius, thinnest)};
    for (int i = 1; i <= kind.joints; ++i) {
        towards += glm::dvec3{random_(-1, 1), random_(-1, 1), random_(-1, 1)} * kind.wander;
        // Towards the light, and down by its own weight further out.
        towards.y += generation == 0 ? 0.08 : 0.05 - 0.04 * i / kind.joints;
        towards = glm::normalize(towards);
        at += towards * (length / kind.joints);
        path.push_back(at);
        const double t = double(i) / kind.joints;
        radii.push_back((std::max)(radius * (1 - 0.78 * t), thinnest));
    }
    if (generation == 0) {
        // The trunk widens to its roots.
        radii[0] *= 1.7;
        radii[1] *= 1.15;
    }
    builder_.tube(path, radii, kind.sides, bark);

    const auto on_path = [&](double share) {
        const double place = share * kind.joints;
        const auto joint = static_cast<std::size_t>((std::min)(place, kind.joints - 1e-9));
        return path[joint] + (path[joint + 1] - path[joint]) * (place - double(joint));
    };
    const auto along = [&](double share) {
        const auto joint =
            static_cast<std::size_t>((std::min)(share * kind.joints, kind.joints - 1e-9));
        return glm::normalize(path[joint + 1] - path[joint]);
    };
    double turn = random_(0, 2 * std::numbers::pi);
    for (int i = 0; i < kind.children; ++i) {
        turn += golden_angle;
        const double share =
            kind.first + (1 - kind.first) * (i + random_(0.3, 0.7)) / kind.children;
        const glm::dvec3 parent = along(share);
        const double angle = kind.spread * random_(0.75, 1.15) * (1.15 - 0.5 * share);
        const glm::dvec3 direction =
            parent * std::cos(angle) + across(parent, turn) * std::sin(angle);
        // The lower ones are longer.
        branch(generation + 1, on_path(share), direction,
               length * kind.length * random_(0.8, 1.15) * (1.25 - 0.6 * share),
               radius * (1 - 0.78 * share) * random_(0.5, 0.62));
    }
    if (kind.children > 0) return;
    for (int i = 0; i < leaves_; ++i) {
        turn += golden_angle;
        const double share = (i + 0.6) / leaves_;
        const glm::dvec3 stem = along(share);
        leaf(on_path(share), stem * random_(0.3, 0.9) + across(stem, turn));
    }
}

void Growth::leaf(const glm::dvec3& stem, const glm::dvec3& towards)
{
    const glm::dvec3 along = glm::normalize(towards + glm::dvec3{0, random_(-0.4, 0.2), 0});
    // Its upper side faces up, more or less.
    const glm::dvec3 upwards{random_(-0.5, 0.5), 1, random_(-0.5, 0.5)};
    const glm::dvec3 side = glm::normalize(glm::cross(along, upwards));
    const glm::dvec3 up = glm::cross(side, along);
    const double length = random_(0.08, 0.125), width = 0.3 * length;
    const double fold = width * random_(0.1, 0.45);
    const float bright = static_cast<float>(random_(0.75, 1.2));
    const support::Rgb green{0.26f * bright, 0.46f * bright, 0.12f * bright};
    // Off the twig, which it does not touch.
    const glm::dvec3 foot = stem + along * (1.5 * thinnest);
    const glm::dvec3 wide = foot + along * (0.42 * length) + up * fold;
    const std::uint32_t base = builder_.vertex(foot), right = builder_.vertex(wide + side * width),
                        tip = builder_.vertex(foot + along * length),
                        left = builder_.vertex(wide - side * width);
    builder_.triangle(base, right, tip, green);
    builder_.triangle(base, tip, left, green);
}

}  // namespace

Scene tree(const TreeOptions& options)
{
    Scene scene;
    scene.name = "tree";
    Builder builder;
    Growth growth{builder, options};
    growth.branch(0, {0, 0, 0}, {0.05, 1, 0}, 2.1, 0.13);
    builder.finish(scene);
    scene.camera = three_quarter_view(scene, 1);
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
