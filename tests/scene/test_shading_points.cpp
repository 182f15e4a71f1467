#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/scene/accumulate.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "closed_forms.hpp"
#include "meshes.hpp"

// Where rays start: lists of points, pixels with and without face ids, normals that are not those of the
// surface. And what holds for all of them: threads, bad arguments, frames that add up.

namespace {

using namespace closed_forms;
using nook::absent;
using nook::Bvh;
using nook::Camera;
using nook::ExponentialFalloff;
using nook::FaceAlbedo;
using nook::Image;
using nook::ImageView;
using nook::ImageView3;
using nook::NoSecondaryRays;
using nook::SecondaryRays;
using nook::StepFalloff;
using nook::TracedImages;
using nook::TracedOptions;

using Secondary = TracedOptions<StepFalloff, SecondaryRays>;
using Everything = TracedOptions<ExponentialFalloff, SecondaryRays, White>;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// A floor with boxes on it; nothing is parallel to an axis.
Mesh yard()
{
    Mesh mesh;
    mesh.box({-8, -8, -1}, {8, 8, 0});
    mesh.box({-2, -2, 0}, {0.5, 1, 3});
    mesh.box({1, -3, 0}, {3, 3, 1.5});
    for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3) {
        const double x = mesh.positions[i], y = mesh.positions[i + 1], z = mesh.positions[i + 2];
        mesh.positions[i] = static_cast<float>(0.8 * x - 0.6 * y);
        mesh.positions[i + 1] = static_cast<float>(0.48 * x + 0.64 * y - 0.6 * z);
        mesh.positions[i + 2] = static_cast<float>(0.36 * x + 0.48 * y + 0.8 * z);
    }
    return mesh;
}
const Camera yard_camera{.eye = {2, -9, 9}, .target = {0, 0, 0.4}, .up = {0, 0, 1}};

/// Points on the triangles of a mesh, some with no surface among them.
Points scattered(const Mesh& mesh, int count)
{
    std::mt19937 random{61};
    std::uniform_real_distribution<double> unit{0, 1};
    Points points;
    for (int i = 0; i < count; ++i) {
        const auto t = static_cast<std::size_t>(i) % mesh.view().triangle_count;
        const auto [a, b, c] = nook::detail::mesh_triangle(mesh.view(), t);
        double u = unit(random), v = unit(random);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const auto n = cross(b - a, c - a) * (i % 3 == 0 ? -1 : 1);
        points.add(glm_vector(a * (1 - u - v) + b * u + c * v),
                   i % 29 == 5 ? glm::dvec3{0, 0, 0} : glm_vector(n));
    }
    return points;
}

/// A mesh drawn with all that a kernel may want to know.
struct Drawn {
    Mesh mesh;
    Bvh bvh = built(mesh);
    int width, height;
    Camera camera;
    nook::Projection projection = nook::projection(camera, width, height);
    nook::ViewFrame frame = nook::view_frame(camera);
    Image<float> depth{width, height}, normal{3 * width, height};
    Image<std::uint32_t> ids{width, height};
    std::vector<float> vertex_normals;

    Drawn(const Mesh& drawn, const Camera& from, int columns, int rows, bool interpolate = false)
        : mesh{drawn},
          width{columns},
          height{rows},
          camera{from}
    {
        nook::MeshView view = mesh.view();
        if (interpolate) {
            // Those of a ball about zero.
            vertex_normals = mesh.positions;
            view.normals = vertex_normals.data();
        }
        REQUIRE(nook::rasterise(view, frame, projection, {depth.view(), normals(), ids.view()},
                                {.interpolate_normals = interpolate}));
    }
    [[nodiscard]] ImageView3<float> normals()
    {
        return ImageView3<float>::interleaved(normal.data(), width, height, 3 * width);
    }
    [[nodiscard]] nook::SourceFaces faces() { return {ids.view(), mesh.view()}; }
    template <class Output, class Options, class Executor = nook::Serial>
    nook::Outcome trace(const Output& output, const Options& options, Executor&& executor = {})
    {
        return nook::traced_ao(bvh, depth.view(), normals(), output, options, projection, frame, {},
                               nook::HeapScratch{}, executor);
    }
    template <class Output, class Options, class Executor = nook::Serial>
    nook::Outcome trace_with_ids(const Output& output, const Options& options,
                                 Executor&& executor = {})
    {
        return nook::traced_ao(bvh, depth.view(), normals(), faces(), output, options, projection,
                               frame, {}, nook::HeapScratch{}, executor);
    }
};
template <class V>
auto all_of(Results<V>& results)
{
    return TracedImages{results.visibility.view(), results.bents(), results.radiances(),
                        results.weight.view()};
}
template <class V>
int count_other_than(const Image<V>& image, V value)
{
    return static_cast<int>(
        std::count_if(image.begin(), image.end(), [&](V v) { return v != value; }));
}
template <class V>
bool within_bounds(const Image<V>& image)
{
    return std::all_of(image.begin(), image.end(), [](V v) { return v >= 0 && v <= 1; });
}

template <class Options>
int different_from_single(const Bvh& bvh, const Points& points, const Options& options,
                          double error)
{
    const int count = points.count();
    Image<double> list{count, 1, -7};
    REQUIRE(nook::traced_ao(bvh, points.view(error), list.view(), options));
    int different = 0;
    for (int i = 0; i < count; ++i) {
        const auto at = static_cast<std::size_t>(3 * i);
        const glm::dvec3 p{points.positions[at], points.positions[at + 1],
                           points.positions[at + 2]};
        const glm::dvec3 n{points.normals[at], points.normals[at + 1], points.normals[at + 2]};
        const double most = std::fmax(std::fabs(p.x), std::fmax(std::fabs(p.y), std::fabs(p.z)));
        different +=
            list(i, 0) != nook::traced_visibility(bvh, p, n, options, static_cast<std::uint32_t>(i),
                                                  error < 0 ? 0x1p-23 * most : error);
    }
    CHECK(within_bounds(list));
    CHECK(count_other_than(list, 1.0) > count / 8);
    return different;
}

}  // namespace

TEST_CASE("a list of points is each of its points: traced_visibility with sample i, bit for bit")
{
    const Mesh mesh = yard();
    const Bvh bvh = built(mesh);
    const Points points = scattered(mesh, 700);
    for (const double error : {-1.0, 0.0, 1e-5})
        for (const int count : {1, 16, 100}) {
            CAPTURE(error);
            CAPTURE(count);
            CHECK(different_from_single(bvh, points, TracedOptions<>{.directions = count}, error) ==
                  0);
            CHECK(different_from_single(
                      bvh, points, TracedOptions<>{.radius = 1.2, .directions = count, .seed = 4},
                      error) == 0);
            CHECK(different_from_single(bvh, points, Secondary{.radius = 2, .directions = count},
                                        error) == 0);
            CHECK(different_from_single(
                      bvh, points,
                      TracedOptions<ExponentialFalloff>{.directions = count, .falloff = {0.7}},
                      error) == 0);
        }
}

TEST_CASE("points interleaved with other data, walked backwards, written at a stride")
{
    const Mesh mesh = yard();
    const Bvh bvh = built(mesh);
    const Points points = scattered(mesh, 300);
    const TracedOptions<> options{.radius = 2, .directions = 32};
    Image<float> plain{300, 1};
    REQUIRE(nook::traced_ao(bvh, points.view(), plain.view(), options));
    // A vertex buffer: position, normal, occlusion, something else.
    std::vector<float> vertices(300 * 8, -7.0f);
    for (std::size_t i = 0; i < 300; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            vertices[8 * i + k] = points.positions[3 * i + k];
            vertices[8 * i + 3 + k] = points.normals[3 * i + k];
        }
    const nook::ShadingPoints there{vertices.data(), vertices.data() + 3, 300, 8, 8};
    REQUIRE(nook::traced_ao(bvh, there, ImageView<float>{vertices.data() + 6, 300, 1, 8 * 300, 8},
                            options));
    int different = 0;
    for (std::size_t i = 0; i < 300; ++i) {
        different += vertices[8 * i + 6] != plain(static_cast<int>(i), 0);
        different += vertices[8 * i + 7] != -7;
    }
    CHECK(different == 0);
    // From the last to the first; a point's sample is its place in the list.
    const nook::ShadingPoints back{points.positions.data() + 3 * 299,
                                   points.normals.data() + 3 * 299, 300, -3, -3};
    Image<double> reversed{300, 1};
    REQUIRE(nook::traced_ao(bvh, back, reversed.view(), options));
    for (int i = 0; i < 300; i += 37) {
        const auto at = static_cast<std::size_t>(3 * (299 - i));
        const glm::dvec3 p{points.positions[at], points.positions[at + 1],
                           points.positions[at + 2]};
        const glm::dvec3 n{points.normals[at], points.normals[at + 1], points.normals[at + 2]};
        const double most = std::fmax(std::fabs(p.x), std::fmax(std::fabs(p.y), std::fabs(p.z)));
        CHECK(reversed(i, 0) == nook::traced_visibility(bvh, p, n, options,
                                                        static_cast<std::uint32_t>(i),
                                                        0x1p-23 * most));
    }
}

TEST_CASE("an output among the coordinates of the points is refused, whatever its row stride")
{
    const Mesh mesh = yard();
    const Bvh bvh = built(mesh);
    Points points = scattered(mesh, 40);
    const Points before = points;
    for (int k = 0; k < 3; ++k)
        for (const std::ptrdiff_t row : {0, 3, 120}) {
            CAPTURE(k);
            CAPTURE(row);
            for (std::vector<float>* values : {&points.positions, &points.normals}) {
                const ImageView<float> inside{values->data() + k, 40, 1, row, 3};
                const nook::Outcome outcome =
                    nook::traced_ao(bvh, points.view(), inside, TracedOptions<>{});
                CHECK(outcome.error.code == nook::ErrorCode::overlap);
                CHECK(points.positions == before.positions);
                CHECK(points.normals == before.normals);
                points = before;
            }
        }
}

TEST_CASE("a pixel is the point it shows, with the sample of its place")
{
    Drawn drawn{yard(), yard_camera, 48, 36};
    const TracedOptions<> options{.radius = 2, .directions = 64};
    Image<double> image{48, 36};
    REQUIRE(drawn.trace(image.view(), options));
    int compared = 0, equal = 0, darker = 0;
    for (int y = 0; y < 36; ++y)
        for (int x = 0; x < 48; ++x) {
            const double distance = double{drawn.depth(x, y)};
            if (!(distance < 1e9)) continue;
            const auto at = nook::view_point(drawn.projection, x + 0.5, y + 0.5, distance);
            const glm::dvec3 view{at.x, at.y, at.z};
            const glm::dvec3 normal{drawn.normal(3 * x, y), drawn.normal(3 * x + 1, y),
                                    drawn.normal(3 * x + 2, y)};
            const double error = 1e-5;
            const double single = nook::traced_visibility(
                drawn.bvh, nook::point_to_world(drawn.frame, view),
                nook::direction_to_world(drawn.frame, normal), options,
                nook::hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)), error);
            ++compared;
            equal += single == image(x, y);
            darker += single < 0.9;
        }
    CHECK(darker > 100);
    // A ray in thousands passes an edge within the error.
    CHECK(equal > compared * 97 / 100);
}

TEST_CASE("with face ids a flat scene looks as it does without")
{
    Drawn drawn{yard(), yard_camera, 48, 36};
    for (const double radius : {2.0, infinity}) {
        const TracedOptions<> options{.radius = radius, .directions = 64};
        Results<float> with{48, 36}, without{48, 36};
        REQUIRE(drawn.trace(
            TracedImages{without.visibility.view(), without.bents(), absent, without.weight.view()},
            options));
        REQUIRE(drawn.trace_with_ids(
            TracedImages{with.visibility.view(), with.bents(), absent, with.weight.view()},
            options));
        CHECK(with.weight == without.weight);
        CHECK(count_other_than(without.visibility, 1.0f) > 300);
        double sum = 0, worst = 0;
        for (int y = 0; y < 36; ++y)
            for (int x = 0; x < 48; ++x) {
                const double difference =
                    std::fabs(double{with.visibility(x, y)} - double{without.visibility(x, y)});
                sum += difference;
                worst = std::fmax(worst, difference);
            }
        // A ray or two per pixel at most, and few pixels.
        CHECK(worst <= 2.0 / 64);
        CHECK(sum / (48 * 36) < 1e-4);
    }
}

TEST_CASE("ids that name no face are as none")
{
    Drawn drawn{yard(), yard_camera, 48, 36};
    const TracedOptions<> options{.radius = 2, .directions = 16};
    Results<double> without{48, 36}, with{48, 36};
    REQUIRE(drawn.trace(TracedImages{without.visibility.view(), without.bents()}, options));
    for (const std::uint32_t id : {nook::no_face, std::uint32_t{36}, std::uint32_t{1} << 31}) {
        CAPTURE(id);
        REQUIRE(id >= drawn.mesh.view().triangle_count);
        std::fill(drawn.ids.begin(), drawn.ids.end(), id);
        REQUIRE(drawn.trace_with_ids(TracedImages{with.visibility.view(), with.bents()}, options));
        CHECK(with == without);
    }
    // A triangle that is not usable has no plane.
    Mesh bad = drawn.mesh;
    bad.triangle({1, 1, 1}, {1, 1, 1}, {2, 2, 2});
    std::fill(drawn.ids.begin(), drawn.ids.end(),
              static_cast<std::uint32_t>(bad.view().triangle_count - 1));
    REQUIRE(nook::traced_ao(drawn.bvh, drawn.depth.view(), drawn.normals(),
                            {drawn.ids.view(), bad.view()},
                            TracedImages{with.visibility.view(), with.bents()}, options,
                            drawn.projection, drawn.frame));
    CHECK(with == without);
}

TEST_CASE("a smooth convex body is exactly 1 with face ids, at every subdivision, size and side")
{
    for (int levels = 0; levels <= 5; ++levels)
        for (const double radius : {1.0, 1e-4, 3e5})
            for (const bool orthographic : {false, true}) {
                CAPTURE(levels);
                CAPTURE(radius);
                CAPTURE(orthographic);
                const Camera camera{
                    .eye = glm::dvec3{1.3, 2.1, 2.4} * (radius * (levels % 2 == 0 ? 1 : 0.35)),
                    .orthographic = orthographic,
                    .vertical_fov = 0.9,
                    .view_height = 2.3 * radius};
                Drawn drawn{meshes::icosphere(levels, radius), camera, 40, 40, true};
                const TracedOptions<> options{.directions = 64};
                Results<float> with{40, 40}, without{40, 40};
                REQUIRE(drawn.trace_with_ids(
                    TracedImages{with.visibility.view(), with.bents(), absent, with.weight.view()},
                    options));
                REQUIRE(drawn.trace(without.visibility.view(), options));
                CHECK(count_other_than(with.visibility, 1.0f) == 0);
                // Directions below the facets are left out; without ids they are hidden.
                int left_out = 0;
                for (int y = 0; y < 40; ++y)
                    for (int x = 0; x < 40; ++x)
                        left_out += drawn.depth(x, y) < 1e30f && with.weight(x, y) < 64;
                if (levels < 3) {
                    CHECK(left_out > 30);
                    CHECK(count_other_than(without.visibility, 1.0f) > 30);
                }
            }
}

TEST_CASE(
    "a tilted plane of many triangles at depth 1e5 hides nothing of itself, with ids or without")
{
    // z = -1e5 - x / 2 on whole numbers: floats hold the plane exactly, but depths only to 2^-7.
    Mesh mesh;
    constexpr int cells = 64;
    constexpr double cell = 8;
    for (int j = 0; j <= cells; ++j)
        for (int i = 0; i <= cells; ++i) {
            const double x = cell * (i - cells / 2), y = cell * (j - cells / 2);
            mesh.vertex({x, y, -1e5 - x / 2});
        }
    for (unsigned j = 0; j < cells; ++j)
        for (unsigned i = 0; i < cells; ++i) {
            const unsigned a = j * (cells + 1) + i;
            mesh.face(a, a + 1, a + cells + 2);
            mesh.face(a, a + cells + 2, a + cells + 1);
        }
    const Camera camera{
        .eye = {0, 0, 0}, .target = {0, 0, -1}, .vertical_fov = 2 * std::atan(300 / 1e5)};
    Drawn drawn{mesh, camera, 64, 64};
    CHECK(count_other_than(drawn.ids, nook::no_face) > 2000);
    for (const double radius : {infinity, 20.0, 0.001}) {
        CAPTURE(radius);
        Image<float> result{64, 64};
        const TracedOptions<> options{.radius = radius, .directions = 64};
        REQUIRE(drawn.trace(result.view(), options));
        CHECK(count_other_than(result, 1.0f) == 0);
        REQUIRE(drawn.trace_with_ids(result.view(), options));
        CHECK(count_other_than(result, 1.0f) == 0);
    }
    // Ids bring the points back to the surface: a ceiling close above it is not jumped over. What is
    // nearer than the floats of vertices can tell, 2^-23 of 1e5, is the surface itself.
    Mesh covered = mesh;
    const float up = 0x1p-5f;
    const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
    for (const auto& [x, y] :
         {std::pair{-500.0, -500.0}, {500.0, -500.0}, {500.0, 500.0}, {-500.0, 500.0}})
        covered.vertex({x, y, -1e5 - x / 2 + double{up}});
    covered.face(first, first + 1, first + 2);
    covered.face(first, first + 2, first + 3);
    const Bvh ceiling = built(covered);
    Image<float> result{64, 64};
    REQUIRE(nook::traced_ao(ceiling, drawn.depth.view(), drawn.normals(),
                            {drawn.ids.view(), mesh.view()}, result.view(),
                            TracedOptions<>{.directions = 16}, drawn.projection, drawn.frame));
    int under = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) under += drawn.ids(x, y) != nook::no_face && result(x, y) == 0;
    CHECK(under == count_other_than(drawn.ids, nook::no_face));
}

TEST_CASE("coplanar neighbours hide nothing where floats are too coarse for their plane, with ids")
{
    // A tilted sheet of triangles of a few float steps each, 1e6 from zero, one face at a time: its own
    // plane is exact, its neighbours stand off it by their rounding.
    Mesh mesh;
    constexpr int cells = 16;
    for (int j = 0; j <= cells; ++j)
        for (int i = 0; i <= cells; ++i)
            mesh.vertex({1e6 + 4 * i, 1e6 + 4 * j, 1e6 + 1.37 * i + 0.71 * j});
    for (unsigned j = 0; j < cells; ++j)
        for (unsigned i = 0; i < cells; ++i) {
            const unsigned a = j * (cells + 1) + i;
            mesh.face(a, a + 1, a + cells + 2);
            mesh.face(a, a + cells + 2, a + cells + 1);
        }
    const Camera camera{.eye = {1e6 + 32, 1e6 + 32, 1e6 + 120},
                        .target = {1e6 + 32, 1e6 + 32, 1e6},
                        .up = {0, 1, 0}};
    Drawn drawn{mesh, camera, 48, 48};
    Image<float> result{48, 48};
    REQUIRE(drawn.trace_with_ids(result.view(), TracedOptions<>{.directions = 64}));
    double darkest = 1, sum = 0;
    for (const float v : result) {
        darkest = std::fmin(darkest, double{v});
        sum += double{v};
    }
    // Dents of 1/64 of a triangle: rays that leave within a degree may meet them, none else.
    CHECK(sum / (48 * 48) > 0.999);
    CHECK(darkest > 0.9);
}

TEST_CASE("a tilted sheet of rounded vertices hides nothing of itself, with ids")
{
    // Vertices are rounded, each in its own way: neighbours rise by parts of 2^-23.
    Mesh mesh;
    constexpr unsigned cells = 100;
    for (unsigned j = 0; j <= cells; ++j)
        for (unsigned i = 0; i <= cells; ++i) {
            const double u = 0.013 * i - 0.6, v = 0.011 * j - 0.5;
            mesh.vertex({0.8 * u, 0.77 * v - 0.3 * u, 0.5 * v + 0.41 * u});
        }
    for (unsigned j = 0; j < cells; ++j)
        for (unsigned i = 0; i < cells; ++i) {
            const unsigned a = j * (cells + 1) + i;
            mesh.face(a, a + 1, a + cells + 2);
            mesh.face(a, a + cells + 2, a + cells + 1);
        }
    Drawn drawn{mesh, {.eye = {0.4, -2, 3}}, 48, 48};
    Image<float> result{48, 48};
    const nook::Outcome done =
        drawn.trace_with_ids(result.view(), TracedOptions<>{.directions = 64});
    REQUIRE(done);
    CHECK(count_other_than(result, 1.0f) == 0);
    const int pixels = count_other_than(drawn.ids, nook::no_face);
    CHECK(pixels > 200);
    CHECK(done.work.rays + done.work.skipped_rays == 64 * static_cast<std::uint64_t>(pixels));
    // Secondary segments that point down end above the sheet, not in it.
    REQUIRE(drawn.trace_with_ids(result.view(), Secondary{.radius = 1, .directions = 64}));
    CHECK(count_other_than(result, 1.0f) == 0);
}

TEST_CASE("with ids a kerb counts as much a million units from zero as at home")
{
    // Floors at z = 0 are exact wherever they are: nothing of the kerb is taken for rounding.
    double at_home = 0;
    for (const double x : {0.0, 1e6, 4e6}) {
        CAPTURE(x);
        Mesh mesh;
        mesh.quad({x - 8, -8, 0}, {x + 8, -8, 0}, {x + 8, 8, 0}, {x - 8, 8, 0});
        mesh.quad({x + 0.5, -8, 0}, {x + 0.5, 8, 0}, {x + 0.5, 8, 0.125}, {x + 0.5, -8, 0.125});
        Drawn drawn{mesh,
                    {.eye = {x + 0.25, 0, 2},
                     .target = {x + 0.25, 0, 0},
                     .up = {0, 1, 0},
                     .vertical_fov = 1e-3},
                    1,
                    1};
        Image<float> result{1, 1};
        REQUIRE(drawn.trace_with_ids(result.view(), TracedOptions<>{.directions = 1024}));
        if (x == 0) at_home = double{result(0, 0)};
        CHECK(result(0, 0) < 0.98f);
        CHECK(std::fabs(double{result(0, 0)} - at_home) < 5 * 2.2e-3);
    }
}

TEST_CASE("secondary rays of any length see the walls of a closed box")
{
    Mesh mesh;
    for (const double z : {0.0, 2.0}) mesh.quad({-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z});
    for (const double x : {-1.0, 1.0}) {
        mesh.quad({x, -1, 0}, {x, 1, 0}, {x, 1, 2}, {x, -1, 2});
        mesh.quad({-1, x, 0}, {1, x, 0}, {1, x, 2}, {-1, x, 2});
    }
    const Bvh bvh = built(mesh);
    for (const double radius : {10.0, 1e15, 1e18, 1e300}) {
        CAPTURE(radius);
        const Secondary options{.radius = 0.5, .directions = 64, .secondary = {.radius = radius}};
        CHECK(nook::traced_visibility(bvh, {0, 0, 0}, {0, 0, 1}, options) == 0);
    }
}

TEST_CASE("a negative error means the rounding of floats, for one point as for a list")
{
    Mesh mesh;
    mesh.quad({-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2});
    const Bvh bvh = built(mesh);
    const TracedOptions<> options{.radius = 0.5, .directions = 64};
    CHECK(nook::traced_visibility(bvh, {0, 0, 0}, {0, 0, 1}, options, 0, -1.9) == 1);
}

TEST_CASE("axes of a frame that are no unit vectors are refused")
{
    Mesh mesh;
    mesh.quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
    Drawn drawn{mesh, {.eye = {0, 0, 2}}, 4, 4};
    drawn.frame.up = {0, 1e308, 0};
    Image<float> result{4, 4, -7};
    const nook::Outcome done = drawn.trace(result.view(), TracedOptions<>{.directions = 4});
    CHECK(std::string{done.error.argument} == "frame.up");
    CHECK(count_other_than(result, -7.0f) == 0);
}

TEST_CASE("rays in the planes of triangles end where brute force lets them end")
{
    std::mt19937 random{11};
    std::uniform_real_distribution<double> unit{-1, 1};
    int hits = 0, different = 0;
    for (int scene = 0; scene < 400; ++scene) {
        Mesh mesh;
        for (int i = 0; i < 4; ++i)
            mesh.triangle({unit(random), unit(random), unit(random)},
                          {unit(random), unit(random), unit(random)},
                          {unit(random), unit(random), unit(random)});
        const Bvh bvh = built(mesh);
        for (int i = 0; i < 100; ++i) {
            const auto corner = [&](std::size_t k) {
                const float* const at =
                    mesh.positions.data() + 9 * static_cast<std::size_t>(i % 4) + 3 * k;
                return glm::dvec3{double{at[0]}, double{at[1]}, double{at[2]}};
            };
            const glm::dvec3 b = corner(1) - corner(0), c = corner(2) - corner(0);
            const glm::dvec3 along = b * unit(random) + c * unit(random);
            nook::Ray ray{.origin = corner(0) + b * unit(random) + c * unit(random) - along * 2.0,
                          .direction = along};
            const nook::Hit hit = bvh.closest(ray);
            if (!hit) continue;
            ++hits;
            ray.t_max = hit.t;
            different += bvh.occluded(ray) != nook::occluded_brute_force(mesh.view(), ray);
        }
    }
    CHECK(hits > 1000);
    CHECK(different == 0);
}

TEST_CASE("vertices of a cube are 1, those of a room see their octant")
{
    const double third = 1 / std::sqrt(3.0);
    for (const double size : {1.0, 1e-5, 1e6}) {
        CAPTURE(size);
        Mesh box;
        box.box({0, 0, 0}, {4 * size, 4 * size, 4 * size});
        const Bvh bvh = built(box);
        Points outward, inward, edges;
        for (int i = 0; i < 8; ++i) {
            const glm::dvec3 side{i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1};
            const glm::dvec3 at = (side + 1.0) * (2 * size);
            outward.add(at, side * third);
            inward.add(at, -side);
        }
        for (int i = 0; i < 4; ++i) {
            const glm::dvec3 side{i & 1 ? 1 : -1, i & 2 ? 1 : -1, 0};
            edges.add({2 * size * (side.x + 1), 2 * size * (side.y + 1), 2 * size}, -side);
        }
        const TracedOptions<> options{.radius = size, .directions = 4096};
        Image<double> result{8, 1};
        REQUIRE(nook::traced_ao(bvh, outward.view(), result.view(), options));
        CHECK(count_other_than(result, 1.0) == 0);
        // Lambert: three quarter circles, each at the cosine 1/√3 from the normal: √3 / 4.
        REQUIRE(nook::traced_ao(bvh, inward.view(), result.view(), options));
        for (const double v : result) CHECK(std::fabs(v - std::sqrt(3.0) / 4) < 5 * 8e-4);
        // A right-angled groove about its bisector: √2 / 2.
        Image<double> groove{4, 1};
        REQUIRE(nook::traced_ao(bvh, edges.view(), groove.view(), options));
        for (const double v : groove) CHECK(std::fabs(v - std::sqrt(0.5)) < 5 * 8e-4);
        // With no limit the room is closed.
        REQUIRE(
            nook::traced_ao(bvh, inward.view(), result.view(), TracedOptions<>{.directions = 256}));
        CHECK(count_other_than(result, 0.0) == 0);
    }
}

TEST_CASE("one thread to sixteen write the same bits, all images, pixels and lists")
{
    const Mesh mesh = yard();
    Drawn drawn{mesh, yard_camera, 45, 37};
    const Points points = scattered(mesh, 1500);
    const Everything options{.radius = 2,
                             .directions = 12,
                             .falloff = {0.8},
                             .secondary = {.half_rays = true, .jitter = 0.7}};
    Results<float> pixels{45, 37}, ids{45, 37}, list{1500, 1};
    const auto one = drawn.trace(all_of(pixels), options);
    REQUIRE(one);
    const auto one_ids = drawn.trace_with_ids(all_of(ids), options);
    REQUIRE(one_ids);
    const auto one_list = nook::traced_ao(drawn.bvh, points.view(), all_of(list), options);
    REQUIRE(one_list);
    CHECK(within_bounds(pixels.visibility));
    CHECK(count_other_than(pixels.visibility, 1.0f) > 300);
    for (int workers = 1; workers <= 16; ++workers) {
        CAPTURE(workers);
        nook::ThreadExecutor threads{workers};
        Results<float> a{45, 37}, b{45, 37}, c{1500, 1};
        const auto done = drawn.trace(all_of(a), options, threads);
        const auto done_ids = drawn.trace_with_ids(all_of(b), options, threads);
        const auto done_list = nook::traced_ao(drawn.bvh, points.view(), all_of(c), options,
                                               nook::HeapScratch{}, threads);
        CHECK(a == pixels);
        CHECK(b == ids);
        CHECK(c == list);
        CHECK(done.work.rays == one.work.rays);
        CHECK(done_ids.work.rays == one_ids.work.rays);
        CHECK(done_list.work.rays == one_list.work.rays);
        CHECK(done.work.skipped_rays == one.work.skipped_rays);
        CHECK(done_list.work.background == one_list.work.background);
    }
}

TEST_CASE("the weight of a pixel is the number of its directions")
{
    Drawn drawn{yard(), yard_camera, 32, 24};
    for (const int count : {1, 7, 64, 65, 200}) {
        Results<float> results{32, 24};
        REQUIRE(drawn.trace(
            TracedImages{results.visibility.view(), absent, absent, results.weight.view()},
            TracedOptions<>{.radius = 2, .directions = count}));
        int wrong = 0, surfaces = 0;
        for (int y = 0; y < 24; ++y)
            for (int x = 0; x < 32; ++x) {
                const bool surface = drawn.depth(x, y) < 1e30f;
                surfaces += surface;
                wrong += results.weight(x, y) != (surface ? static_cast<float>(count) : 0.0f);
                const double open = double{results.visibility(x, y)} * count;
                wrong += std::fabs(open - std::round(open)) > 1e-4;
            }
        CHECK(wrong == 0);
        CHECK(surfaces > 300);
        CHECK(surfaces < 32 * 24);
    }
}

TEST_CASE("secondary rays of radius 0 change no bit, others only darken")
{
    Drawn drawn{yard(), yard_camera, 40, 30};
    const TracedOptions<> plain{.radius = 3, .directions = 32};
    Results<double> unaided{40, 30};
    const TracedImages images{unaided.visibility.view(), unaided.bents(), absent,
                              unaided.weight.view()};
    const auto work = drawn.trace(images, plain).work;
    for (const bool half_rays : {false, true})
        for (const double jitter : {0.0, 1.0}) {
            Results<double> zero{40, 30}, half{40, 30};
            const auto with = [&](Results<double>& results, double radius) {
                return drawn.trace(
                    TracedImages{results.visibility.view(), results.bents(), absent,
                                 results.weight.view()},
                    Secondary{
                        .radius = 3,
                        .directions = 32,
                        .secondary = {.radius = radius, .half_rays = half_rays, .jitter = jitter}});
            };
            const auto none = with(zero, 0);
            REQUIRE(none);
            CHECK(zero == unaided);
            CHECK(none.work.rays == work.rays);
            CHECK(none.work.skipped_rays == work.skipped_rays);
            const auto some = with(half, -1);
            REQUIRE(some);
            CHECK(some.work.rays > work.rays);
            CHECK(some.work.skipped_rays > 0);
            int lighter = 0, darker = 0, off = 0;
            for (int y = 0; y < 30; ++y)
                for (int x = 0; x < 40; ++x) {
                    lighter += half.visibility(x, y) > unaided.visibility(x, y);
                    darker += half.visibility(x, y) < unaided.visibility(x, y);
                    // Whole numbers of quarters or halves of a direction.
                    const double parts = half.visibility(x, y) * 32 * 4;
                    off += parts != std::round(parts);
                }
            CHECK(lighter == 0);
            CHECK(darker > 100);
            CHECK(off == 0);
        }
}

TEST_CASE("jittered secondary rays stay in bounds and close to those that are not")
{
    Drawn drawn{yard(), yard_camera, 40, 30};
    const auto mean = [&](double jitter, bool half_rays) {
        Image<double> result{40, 30};
        REQUIRE(drawn.trace(result.view(),
                            Secondary{.radius = 3,
                                      .directions = 256,
                                      .secondary = {.half_rays = half_rays, .jitter = jitter}}));
        CHECK(within_bounds(result));
        double sum = 0;
        for (const double v : result) sum += v;
        return sum / (40 * 30);
    };
    for (const bool half_rays : {false, true}) {
        const double straight = mean(0, half_rays);
        CHECK(straight < 0.95);
        CHECK(std::fabs(mean(0.25, half_rays) - straight) < 0.006);
        CHECK(std::fabs(mean(1, half_rays) - straight) < 0.02);
    }
}

TEST_CASE("frames that take up the sequence where the last one ended add up to one call")
{
    const Mesh mesh = yard();
    Drawn drawn{mesh, yard_camera, 32, 24};
    constexpr int frames = 8, each = 16;
    for (const auto set :
         {nook::DirectionSet::scrambled_sobol, nook::DirectionSet::spun, nook::DirectionSet::r2}) {
        Image<double> mean{32, 24}, weight{32, 24}, frame{32, 24}, whole{32, 24};
        for (int f = 0; f < frames; ++f) {
            REQUIRE(
                drawn.trace(frame.view(),
                            TracedOptions<>{.radius = 2,
                                            .directions = each,
                                            .first_direction = static_cast<std::uint32_t>(f * each),
                                            .set = set}));
            REQUIRE(nook::accumulate(frame.view(), each, mean.view(), weight.view()));
        }
        REQUIRE(drawn.trace(whole.view(),
                            TracedOptions<>{.radius = 2, .directions = frames * each, .set = set}));
        CHECK(mean == whole);
        CHECK(whole != frame);
        CHECK(count_other_than(weight, 128.0) == 0);
    }
}

TEST_CASE(
    "a still camera with secondary rays converges to the result of many rays, weights and all")
{
    // Smooth normals and ids, so that pixels weigh differently.
    Mesh mesh = meshes::icosphere(1);
    Drawn drawn{mesh, {.eye = {1, 2, 3}, .vertical_fov = 0.8}, 24, 24, true};
    Mesh around = mesh;
    around.quad({-4, -1.2, -4}, {4, -1.2, -4}, {4, -1.2, 4}, {-4, -1.2, 4});
    around.quad({1.6, -4, -4}, {1.6, 4, -4}, {1.6, 4, 4}, {1.6, -4, 4});
    drawn.bvh = built(around);
    const auto trace = [&](int count, int first, Results<double>& results) {
        REQUIRE(drawn.trace_with_ids(
            TracedImages{results.visibility.view(), absent, absent, results.weight.view()},
            Secondary{.radius = 2,
                      .directions = count,
                      .first_direction = static_cast<std::uint32_t>(first),
                      .secondary = {.radius = 0.5}}));
    };
    Image<double> mean{24, 24}, weight{24, 24};
    for (int f = 0; f < 64; ++f) {
        Results<double> frame{24, 24};
        trace(16, 16 * f, frame);
        REQUIRE(nook::accumulate(frame.visibility.view(), frame.weight.view(), mean.view(),
                                 weight.view()));
    }
    Results<double> whole{24, 24}, many{24, 24};
    trace(1024, 0, whole);
    trace(1 << 14, 0, many);
    double apart = 0, off = 0, darkest = 1;
    int lighter = 0, uneven = 0;
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 24; ++x) {
            apart = std::fmax(apart, std::fabs(mean(x, y) - whole.visibility(x, y)));
            off = std::fmax(off, std::fabs(mean(x, y) - many.visibility(x, y)));
            darkest = std::fmin(darkest, mean(x, y));
            lighter += weight(x, y) != whole.weight(x, y);
            uneven += drawn.depth(x, y) < 1e30f && weight(x, y) < 1024;
        }
    // The same rays: rounding. Sixteen times as many: five times 0.40 N^(-3/4), N = 1024.
    CHECK(apart < 1e-12);
    CHECK(off < 5 * 2.2e-3);
    CHECK(lighter == 0);
    CHECK(uneven > 50);
    CHECK(darkest < 0.8);
}

TEST_CASE("any number of directions from 1 on will do")
{
    const Mesh mesh = yard();
    const Bvh bvh = built(mesh);
    const Points points = scattered(mesh, 60);
    for (const int count : {1, 2, 3, 17, 31, 63, 64, 65, 127, 129, 1000}) {
        Results<double> results{60, 1};
        REQUIRE(nook::traced_ao(bvh, points.view(), all_of(results),
                                Everything{.radius = 2, .directions = count}));
        CHECK(within_bounds(results.visibility));
        CHECK(within_bounds(results.radiance));
    }
}

TEST_CASE("points far beyond the scene, at its ends and at none see what is there")
{
    Mesh mesh;
    mesh.box({-1, -1, -1}, {1, 1, 1});
    for (const double scale : {1.0, 1e-30, 1e30}) {
        CAPTURE(scale);
        const Bvh bvh = built(mesh.transformed(scale, {0, 0, 0}));
        Points points;
        for (const double at : {1e4, 1e12, 1e20, 1e30, 3e38, -3e38})
            points.add({0, 0, at}, {0, 0, at > 0 ? -1 : 1});
        points.add({3e38, 3e38, 3e38}, {-1, -1, -1});
        points.add({infinity, 0, 0}, {-1, 0, 0});
        const int count = points.count();
        Results<double> results{count, 1};
        REQUIRE(nook::traced_ao(bvh, points.view(), all_of(results),
                                Everything{.radius = 1e9, .directions = 32}));
        CHECK(within_bounds(results.visibility));
        CHECK(within_bounds(results.radiance));
        REQUIRE(nook::traced_ao(
            bvh, points.view(), all_of(results),
            TracedOptions<ExponentialFalloff, NoSecondaryRays, White>{.directions = 32}));
        CHECK(within_bounds(results.visibility));
        CHECK(results.visibility(count - 1, 0) == 1);
        for (const double v : results.bent) CHECK(std::fabs(v) <= 1 + 1e-6);
    }
    for (const double at : {1e100, 1e300, -1e308})
        CHECK(nook::traced_visibility(built(mesh), {0, at, 0}, {0, -1, 0}, {.directions = 32}) ==
              1);
}

TEST_CASE("bad arguments of a list of points are named, and nothing is written")
{
    const Mesh mesh = yard();
    const Bvh bvh = built(mesh);
    const Points points = scattered(mesh, 12);
    const std::vector<float> albedo(mesh.view().triangle_count * 3, 0.5f);
    using Options = TracedOptions<ExponentialFalloff, SecondaryRays, FaceAlbedo>;
    const Options good{
        .radius = 2, .directions = 8, .falloff = {1}, .secondary = {}, .colour = {albedo.data()}};
    Results<float> results{12, 1};
    const auto rejected = [&](auto change) {
        nook::ShadingPoints list = points.view();
        auto images = all_of(results);
        Options options = good;
        change(list, images, options);
        const nook::Outcome outcome = nook::traced_ao(bvh, list, images, options);
        CHECK(results.untouched());
        CHECK(outcome.work.pixels == 0);
        CHECK(bool(outcome.error));
        return std::string{outcome.error.argument};
    };
    using P = nook::ShadingPoints;
    using I = decltype(all_of(results));
    using O = Options;
    CHECK(rejected([](P& p, I&, O&) { p.positions = nullptr; }) == "points.positions");
    CHECK(rejected([](P& p, I&, O&) { p.normals = nullptr; }) == "points.normals");
    CHECK(rejected([](P& p, I&, O&) { p.error = not_a_number; }) == "points.error");
    CHECK(rejected([](P& p, I&, O&) { p.error = infinity; }) == "points.error");
    CHECK(rejected([](P& p, I&, O&) { p.count = std::size_t{1} << 31; }) == "points.count");
    CHECK(rejected([](P& p, I&, O&) { p.count = 11; }) == "visibility");
    CHECK(rejected([](P&, I& i, O&) { i.visibility.data = nullptr; }) == "visibility");
    CHECK(rejected([](P&, I& i, O&) { i.visibility.height = 2; }) == "visibility");
    CHECK(rejected([](P&, I& i, O&) { i.visibility.pixel_stride = 0; }) == "visibility");
    CHECK(rejected([](P&, I& i, O&) { i.bent_normals.x.width = 11; }) == "bent_normals.x");
    CHECK(rejected([](P&, I& i, O&) { i.bent_normals.y.data = nullptr; }) == "bent_normals.y");
    CHECK(rejected([](P&, I& i, O&) { i.bent_normals.z = i.bent_normals.y; }) == "bent_normals.z");
    CHECK(rejected([](P&, I& i, O&) { i.radiance.x.height = 0; }) == "radiance.x");
    CHECK(rejected([](P&, I& i, O&) { i.radiance.y = i.visibility; }) == "radiance.y");
    CHECK(rejected([](P&, I& i, O&) { i.radiance.z.data = nullptr; }) == "radiance.z");
    CHECK(rejected([](P&, I& i, O&) { i.weight = i.visibility; }) == "weight");
    CHECK(rejected([](P& p, I& i, O&) { i.weight.data = const_cast<float*>(p.positions); }) ==
          "weight");
    CHECK(rejected([](P& p, I& i, O&) { i.radiance.x.data = const_cast<float*>(p.normals); }) ==
          "radiance.x");
    CHECK(rejected([](P&, I&, O& o) { o.radius = -1; }) == "options.radius");
    CHECK(rejected([](P&, I&, O& o) { o.radius = not_a_number; }) == "options.radius");
    CHECK(rejected([](P&, I&, O& o) { o.radius = infinity; }) == "options.radius");
    CHECK(rejected([](P&, I&, O& o) { o.directions = 0; }) == "options.directions");
    CHECK(rejected([](P&, I&, O& o) { o.directions = -5; }) == "options.directions");
    CHECK(rejected([](P&, I&, O& o) { o.set = static_cast<nook::DirectionSet>(3); }) ==
          "options.set");
    CHECK(rejected([](P&, I&, O& o) { o.position_error = -1; }) == "options.position_error");
    CHECK(rejected([](P&, I&, O& o) { o.falloff.sigma = -1; }) == "options.falloff.sigma");
    CHECK(rejected([](P&, I&, O& o) { o.falloff.sigma = not_a_number; }) ==
          "options.falloff.sigma");
    CHECK(rejected([](P&, I&, O& o) { o.secondary.radius = not_a_number; }) ==
          "options.secondary.radius");
    CHECK(rejected([](P&, I&, O& o) { o.secondary.radius = infinity; }) ==
          "options.secondary.radius");
    CHECK(rejected([](P&, I&, O& o) { o.secondary.jitter = 1.5; }) == "options.secondary.jitter");
    CHECK(rejected([](P&, I&, O& o) { o.secondary.jitter = not_a_number; }) ==
          "options.secondary.jitter");
    CHECK(rejected([](P&, I&, O& o) { o.colour.rgb = nullptr; }) == "options.colour.rgb");
    REQUIRE(nook::traced_ao(bvh, points.view(), all_of(results), good));
    CHECK_FALSE(results.untouched());
    // Nothing to do.
    CHECK(nook::traced_ao(bvh, nook::ShadingPoints{}, ImageView<float>{}, TracedOptions<>{}));
}

TEST_CASE("bad arguments of an image with everything asked for are named, and nothing is written")
{
    Drawn drawn{yard(), yard_camera, 20, 14};
    Results<float> results{20, 14};
    Image<std::uint8_t> map{2, 14, 1};
    struct Arguments {
        ImageView<const float> depth;
        ImageView3<const float> normals;
        nook::SourceFaces faces;
        decltype(all_of(results)) images;
        Everything options{.radius = 2, .directions = 4};
        nook::Projection projection;
        nook::ViewFrame frame;
        nook::WorkMap work_map;
    };
    const auto rejected = [&](auto change) {
        Arguments a{.depth = drawn.depth.view(),
                    .normals = drawn.normals(),
                    .faces = drawn.faces(),
                    .images = all_of(results),
                    .projection = drawn.projection,
                    .frame = drawn.frame,
                    .work_map = {}};
        change(a);
        const nook::Outcome outcome =
            nook::traced_ao(drawn.bvh, a.depth, a.normals, a.faces, a.images, a.options,
                            a.projection, a.frame, a.work_map);
        CHECK(results.untouched());
        CHECK(bool(outcome.error));
        return std::string{outcome.error.argument};
    };
    using A = Arguments;
    CHECK(rejected([](A& a) { a.depth.data = nullptr; }) == "depth");
    CHECK(rejected([](A& a) { a.normals.x.data = nullptr; }) == "normals.x");
    CHECK(rejected([](A& a) { a.normals.y.width = 19; }) == "normals.y");
    CHECK(rejected([](A& a) { a.faces.ids.height = 13; }) == "faces.ids");
    CHECK(rejected([](A& a) { a.faces.ids.data = nullptr; }) == "faces.ids");
    CHECK(rejected([](A& a) { a.faces.mesh.indices = nullptr; }) == "mesh.indices");
    CHECK(rejected([](A& a) { a.faces.mesh.vertex_count = 3; }) == "mesh.indices");
    CHECK(rejected([](A& a) { a.images.visibility.width = 19; }) == "visibility");
    CHECK(rejected([&](A& a) { a.depth = a.images.weight; }) == "weight");
    CHECK(rejected([&](A& a) { a.normals.z = a.images.radiance.z; }) == "radiance.z");
    CHECK(rejected([&](A& a) {
              a.faces.ids.data = reinterpret_cast<const std::uint32_t*>(a.images.visibility.data);
          }) == "visibility");
    CHECK(rejected([](A& a) { a.images.bent_normals.x = a.images.radiance.y; }) == "radiance.y");
    CHECK(rejected([](A& a) { a.options.secondary.jitter = -0.1; }) == "options.secondary.jitter");
    CHECK(rejected([](A& a) { a.projection.fx = 0; }) == "projection.fx");
    CHECK(rejected([](A& a) { a.frame.up.y = infinity; }) == "frame.up");
    CHECK(rejected([&](A& a) { a.work_map.active = {map.data(), 3, 14}; }) == "work_map.active");
}
