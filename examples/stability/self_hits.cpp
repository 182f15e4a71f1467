#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>

#include "../support/checked.hpp"
#include "random.hpp"
#include "stability.hpp"
#include "textbook_rays.hpp"
#include "worst.hpp"

// A lone plane, seen by its own rays: whatever is hit is a self-hit. Heights of starts are told by a
// ceiling above the plane, exactly parallel to it, since it is the plane moved along coordinates that
// floats hold.

namespace stability {

namespace {

using textbook::Mesh;

constexpr int direction_count = 64;

struct Way {
    Label label;
    textbook::Offset offset;
};
const Way ways[] = {
    {{"no-offset", "float rays (Woop et al. 2013) from the float point itself"},
     textbook::no_offset},
    {{"fixed-1e-4", "the same from 1e-4 along the normal"}, textbook::epsilon_offset},
    {{"waechter-binder", "the same from up to 256 ulps off (Waechter & Binder 2019)"},
     textbook::ulps_offset},
};

/// A point with the normal of the plane there: what its rays start from.
struct Start {
    glm::vec3 point, normal;
};

/// Self-hits and heights of the starts of one algorithm on one case.
class Tally {
public:
    /// The share of `direction_count` rays that hit.
    void add_hits(const Start& start, double share)
    {
        rays_ += direction_count;
        if (!std::isnan(share)) hits_ += direction_count * share;
        worst_hits_.add(share, [&] {
            return joined(text_of(start), direction_count * share, " of ", direction_count,
                          " rays hit");
        });
    }
    void add_height(const Start& start, double height)
    {
        worst_height_.add(height, [&] { return joined(text_of(start), "starts at ", height); });
    }
    [[nodiscard]] Row row(const Label& subject, const Label& algorithm, double edge) const
    {
        Row row{subject.name,
                algorithm.name,
                {{"rays", rays_}},
                {hits_ / rays_, worst_height_.value() / edge,
                 worst_hits_.nans() + worst_height_.nans()}};
        set_worst(row, 0, worst_hits_, 2);
        set_worst(row, 1, worst_height_, 2);
        return row;
    }

private:
    [[nodiscard]] static std::string text_of(const Start& start)
    {
        const glm::vec3 &p = start.point, &n = start.normal;
        return joined("point (", p.x, ", ", p.y, ", ", p.z, "), normal (", n.x, ", ", n.y, ", ",
                      n.z, "): ");
    }
    double hits_ = 0, rays_ = 0;
    Worst worst_hits_, worst_height_;
};

/// The plane and the ceiling.
struct Plane {
    Mesh mesh;
    /// From the plane to the ceiling, and the unit normal.
    glm::dvec3 shift, normal;
    /// The scene with the ceiling above.
    [[nodiscard]] Mesh with_ceiling() const
    {
        Mesh result = mesh;
        const glm::vec3 a = mesh.corner(0, 0) + glm::vec3{shift};
        const glm::vec3 u = mesh.corner(0, 1) - mesh.corner(0, 0),
                        v = mesh.corner(0, 2) - mesh.corner(0, 0);
        result.add_triangle(a - 16.f * u - 16.f * v, a + 48.f * u - 16.f * v,
                            a - 16.f * u + 48.f * v);
        return result;
    }
    [[nodiscard]] double height_of(const glm::vec3& start) const
    {
        return glm::dot(normal, glm::dvec3{start} - glm::dvec3{mesh.corner(0, 0)});
    }
};

nook::Bvh built(const Mesh& mesh)
{
    nook::Bvh bvh;
    support::checked(bvh.build(mesh.view()), "a plane");
    return bvh;
}

/// A falloff that brings the distance of a hit into the picture; 1 is a miss.
struct DistanceFalloff {
    static constexpr double limit = 0x1p20;
    double operator()(double distance) const { return distance / limit; }
};
using DistanceOptions = nook::TracedOptions<DistanceFalloff>;

/// How high above the plane nook's ray starts, from what `distance` says of its way to the ceiling.
std::optional<double> height(const Plane& plane, const DistanceOptions& options,
                             const glm::dvec3& normal, std::uint32_t sample, double visibility)
{
    if (visibility == 1) return std::nullopt;
    float direction[3];
    nook::traced_directions(options, normal, sample, direction);
    const glm::dvec3 along{direction[0], direction[1], direction[2]};
    return glm::dot(plane.normal, plane.shift) -
           visibility * DistanceFalloff::limit * glm::dot(plane.normal, along);
}

/// One of the usual ways, from a point with a normal in float.
void trace_textbook(const Plane& plane, const Way& way, const Start& start,
                    const float (&directions)[3 * direction_count], Tally& tally)
{
    const glm::vec3 origin = way.offset(start.point, start.normal);
    tally.add_height(start, plane.height_of(origin));
    int hits = 0;
    for (int i = 0; i < direction_count; ++i) {
        const float* const d = directions + 3 * i;
        hits += textbook::nearest({origin, {d[0], d[1], d[2]}}, plane.mesh) < textbook::miss<float>;
    }
    tally.add_hits(start, double(hits) / direction_count);
}

// --- points on triangles --------------------------------------------------------------------------

struct PointCase {
    Label label;
    double offset;
    /// Height of the ceiling: a power of two.
    double ceiling;
};

/// A triangle with vertices on multiples of 1/16, which floats hold around 10⁶ too, and an edge of
/// about 1.
Plane random_triangle(Random& random, const PointCase& subject)
{
    const auto vertex = [&] {
        const auto coordinate = [&] { return random.below(32) / 16.0 + subject.offset; };
        const double x = coordinate(), y = coordinate(), z = coordinate();
        return glm::dvec3{x, y, z};
    };
    for (;;) {
        const glm::dvec3 a = vertex(), b = vertex(), c = vertex(), area = glm::cross(b - a, c - a);
        if (glm::length(area) < 0.5) continue;
        Plane plane{{}, {}, glm::normalize(area)};
        plane.mesh.add_triangle(glm::vec3{a}, glm::vec3{b}, glm::vec3{c});
        for (int k = 0; k < 3; ++k)
            plane.shift[k] = subject.ceiling / 16 * std::round(16 * plane.normal[k]);
        return plane;
    }
}

void add_points(Family& family, const PointCase& subject, const Label& ours)
{
    constexpr int count = 1000;
    Random random;
    Tally tallies[std::size(ways)], nook_tally;
    for (std::uint32_t trial = 0; trial < count; ++trial) {
        const Plane plane = random_triangle(random, subject);
        double u = random.unit(), v = random.unit();
        if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        const glm::dvec3 a{plane.mesh.corner(0, 0)}, b{plane.mesh.corner(0, 1)},
            c{plane.mesh.corner(0, 2)};
        const Start start{glm::vec3{a + (b - a) * u + (c - a) * v}, glm::vec3{plane.normal}};
        const glm::dvec3 normal{start.normal};

        const nook::TracedOptions<> options{.directions = direction_count, .seed = trial};
        float directions[3 * direction_count];
        nook::traced_directions(options, normal, 0, directions);
        for (std::size_t i = 0; i < std::size(ways); ++i)
            trace_textbook(plane, ways[i], start, directions, tallies[i]);

        const nook::ShadingPoints points{&start.point.x, &start.normal.x, 1};
        nook::Image<double> visibility{1, 1};
        support::checked(nook::traced_ao(built(plane.mesh), points, visibility.view(), options),
                         "a point");
        nook_tally.add_hits(start, 1 - visibility(0, 0));
        const DistanceOptions distance{.directions = 1, .seed = trial};
        support::checked(
            nook::traced_ao(built(plane.with_ceiling()), points, visibility.view(), distance),
            "a point");
        if (const auto h = height(plane, distance, normal, 0, visibility(0, 0)))
            nook_tally.add_height(start, *h);
    }
    for (std::size_t i = 0; i < std::size(ways); ++i)
        family.rows.push_back(tallies[i].row(subject.label, ways[i].label, 1));
    family.rows.push_back(nook_tally.row(subject.label, ours, 1));
}

// --- pixels of a float depth buffer ---------------------------------------------------------------

struct PictureCase {
    Label label;
    /// Coordinate of the plane and of the viewer along the view axis, whole numbers.
    double plane, eye;
    /// Height of the ceiling in units of 0.063.
    double ceiling;
};

/// 8 × 8 squares of two triangles each, with edges of 1/8, tilted by 60°. Vertices are multiples of
/// 2⁻⁷, which floats hold around 10⁵ too.
Plane tilted_plane(const PictureCase& subject)
{
    const glm::dvec3 right{0x1p-3, 0, 0}, down{0, 0x1p-4, 14 * 0x1p-7};
    const glm::dvec3 up = glm::dvec3{0, -7, 4} * 0x1p-7;
    Plane plane{{}, up * subject.ceiling, glm::normalize(up)};
    const auto vertex = [&](int i, int j) {
        return glm::vec3{right * double(i) + down * double(j) + glm::dvec3{0, 0, subject.plane}};
    };
    for (int j = -4; j < 4; ++j)
        for (int i = -4; i < 4; ++i) {
            plane.mesh.add_triangle(vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
            plane.mesh.add_triangle(vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
        }
    return plane;
}

void add_pixels(Family& family, const PictureCase& subject, const Label& ours, const Label& faces)
{
    constexpr int columns = 32, rows = 16;
    const Plane plane = tilted_plane(subject);
    const double distance = subject.eye - subject.plane;
    const nook::ViewFrame frame{.origin = {0, 0, subject.eye}};
    // The depths of pixel centres are no multiples of 2⁻⁷.
    const double scale = 27 * distance;
    const nook::Projection projection{.fx = scale, .fy = scale, .cx = columns / 2, .cy = rows / 2};
    nook::Image<float> depth{columns, rows};
    nook::Image<std::uint32_t> ids{columns, rows};
    std::vector<float> normals(std::size_t{3} * columns * rows);
    const auto normal_view =
        nook::ImageView3<float>::interleaved(normals.data(), columns, rows, 3 * columns);
    support::checked(
        nook::rasterise(plane.mesh.view(), frame, projection,
                        {.depth = depth.view(), .normal = normal_view, .face = ids.view()}),
        "the plane");
    const auto slope = [&](int pixel, double centre) {
        return static_cast<float>((pixel + 0.5 - centre) / scale);
    };
    const auto for_each_surface = [&](const auto& f) {
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x) {
                if (ids(x, y) == nook::no_face) continue;
                const float z = depth(x, y);
                f(x, y,
                  Start{{slope(x, projection.cx) * z, -slope(y, projection.cy) * z,
                         static_cast<float>(subject.eye) - z},
                        {normal_view.x(x, y), normal_view.y(x, y), normal_view.z(x, y)}},
                  nook::hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)));
            }
    };

    const nook::TracedOptions<> options{.directions = direction_count};
    for (const Way& way : ways) {
        Tally tally;
        for_each_surface([&](int, int, const Start& start, std::uint32_t sample) {
            float directions[3 * direction_count];
            nook::traced_directions(options, glm::dvec3{start.normal}, sample, directions);
            trace_textbook(plane, way, start, directions, tally);
        });
        family.rows.push_back(tally.row(subject.label, way.label, 0x1p-3));
    }
    const Mesh covered = plane.with_ceiling();
    const nook::Bvh bvh = built(plane.mesh), under_ceiling = built(covered);
    const auto trace = [&](const Label& label, const auto& shade) {
        Tally tally;
        nook::Image<double> visibility{columns, rows}, distances{columns, rows};
        const DistanceOptions distance_options{.directions = 1};
        shade(bvh, plane.mesh, visibility, options);
        shade(under_ceiling, covered, distances, distance_options);
        for_each_surface([&](int x, int y, const Start& start, std::uint32_t sample) {
            tally.add_hits(start, 1 - visibility(x, y));
            if (const auto h = height(plane, distance_options, glm::dvec3{start.normal}, sample,
                                      distances(x, y)))
                tally.add_height(start, *h);
        });
        family.rows.push_back(tally.row(subject.label, label, 0x1p-3));
    };
    trace(ours, [&](const nook::Bvh& scene, const Mesh&, nook::Image<double>& output,
                    const auto& traced_options) {
        support::checked(nook::traced_ao(scene, depth.view(), normal_view, output.view(),
                                         traced_options, projection, frame),
                         "the plane");
    });
    trace(faces, [&](const nook::Bvh& scene, const Mesh& mesh, nook::Image<double>& output,
                     const auto& traced_options) {
        support::checked(nook::traced_ao(scene, depth.view(), normal_view,
                                         nook::SourceFaces{ids.view(), mesh.view()}, output.view(),
                                         traced_options, projection, frame),
                         "the plane");
    });
}

}  // namespace

Family self_hits()
{
    Family family;
    family.label = {"rays-self-hits",
                    "cosine-weighted rays from points on a lone plane, which none may hit"};
    family.metrics = {
        {"hits", "rays that hit the plane they start from, share of all"},
        {"height",
         "the highest start above the plane, in edges of its triangles: what lies lower is "
         "jumped over"},
        {"nan", "points with a NaN for hits or height"},
    };
    for (const Way& way : ways) family.algorithms.push_back(way.label);
    const Label ours{"nook", "traced_ao of the same points or depths"};
    const Label faces{"nook-faces", "traced_ao of the same depths with the ids of the faces"};
    family.algorithms.push_back(ours);
    family.algorithms.push_back(faces);

    const PointCase point_cases[] = {
        {{"points-at-0", "float points on triangles of size 1 about zero"}, 0, 0x1p-8},
        {{"points-at-1e3", "the same about (1e3, 1e3, 1e3), where an ulp is 6e-5"}, 1e3, 0x1p-4},
        {{"points-at-1e6", "the same about (1e6, 1e6, 1e6), where an ulp is 0.06"}, 1e6, 2},
    };
    for (const PointCase& subject : point_cases) {
        family.cases.push_back(subject.label);
        add_points(family, subject, ours);
    }
    const PictureCase picture_cases[] = {
        {{"depth-1", "float depths of triangles of size 1/8 about zero, seen from 1 away"},
         0,
         1,
         0x1p-6},
        {{"depth-1e3", "the same plane seen from 1e3 away through a longer lens"}, 0, 1e3, 0x1p-4},
        {{"depth-1e5", "from 1e5 away, where an ulp is 0.008"}, 0, 1e5, 4},
        {{"depth-1e5-away", "from 1e5 away, with the viewer at zero"}, -1e5, 0, 4},
    };
    for (const PictureCase& subject : picture_cases) {
        family.cases.push_back(subject.label);
        add_pixels(family, subject, ours, faces);
    }
    return family;
}

}  // namespace stability
