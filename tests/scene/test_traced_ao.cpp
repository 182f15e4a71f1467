#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using meshes::Point;
using nook::Bvh;
using nook::Camera;
using nook::Image;
using nook::TracedOptions;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;

/// Directions per closed form, and five times the spread of stratified 0/1 estimates: 0.40 N^(-3/4).
constexpr int directions = 16384;
constexpr double tolerance = 5 * 2.8e-4;
/// Stands for infinity in unbounded cases, where it changes the answer by less than 1e-4.
constexpr double big = 1e5;

double visibility(const Mesh& mesh, double radius, const glm::dvec3& normal = {0, 0, 1},
                  const glm::dvec3& point = {0, 0, 0})
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    return nook::traced_visibility(bvh, point, normal,
                                   {.radius = radius, .directions = directions, .seed = 5}, 17);
}

/// The wall x = distance (to the right) or x = -distance, of a height, endless to the sides.
void wall(Mesh& mesh, double x, double height)
{
    mesh.quad({x, -big, 0}, {x, big, 0}, {x, big, height}, {x, -big, height});
}

struct GBufferImages {
    Image<float> depth, normal;
    nook::Projection projection;
    nook::ViewFrame frame;

    [[nodiscard]] nook::ImageView3<float> normals()
    {
        return nook::ImageView3<float>::interleaved(normal.data(), depth.width(), depth.height(),
                                                    3 * depth.width());
    }
};
GBufferImages draw(const Mesh& mesh, const Camera& camera, int width, int height)
{
    GBufferImages images{{width, height},
                         {3 * width, height},
                         nook::projection(camera, width, height),
                         nook::view_frame(camera)};
    REQUIRE(nook::rasterise(mesh.view(), images.frame, images.projection,
                            {images.depth.view(), images.normals(), {}}));
    return images;
}
Image<float> trace(const Mesh& mesh, GBufferImages& images, const TracedOptions<>& options)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    Image<float> result{images.depth.width(), images.depth.height(), -7};
    REQUIRE(nook::traced_ao(bvh, images.depth.view(), images.normals(), result.view(), options,
                            images.projection, images.frame));
    return result;
}
int count_other_than(const Image<float>& image, float value)
{
    int count = 0;
    for (const float v : image) count += v != value;
    return count;
}

}  // namespace

TEST_CASE("polygons cover what Lambert's formula says")
{
    const auto triangle = [](const Point& a, const Point& b, const Point& c) {
        Mesh mesh;
        mesh.triangle(a, b, c);
        return visibility(mesh, infinity);
    };
    CHECK(std::fabs(triangle({1, 0, 1}, {0, 1, 1}, {-1, -1, 1}) - 0.69965080990313) < tolerance);
    CHECK(std::fabs(triangle({2, 0, 1}, {2, 1, 3}, {1, 2, 0.5}) - 0.95269421090952) < tolerance);
    CHECK(std::fabs(triangle({1, 0, -1}, {1, 1, 1}, {1, -1, 1}) - 0.9019690929571) < tolerance);
}

TEST_CASE("a perpendicular wall")
{
    struct Case {
        double distance, height, radius, occlusion;
    };
    for (const Case& c : {Case{1, 1, infinity, 0.1464466094067},
                          {1, 2, infinity, 0.27639320225},
                          {0.5, 3, infinity, 0.4178005063473},
                          {2, 0.25, infinity, 0.003861061643166},
                          {1, 1000, infinity, 0.49950000025},
                          {1, big, 2, 0.1955011094779},
                          {1, big, 1.25, 0.05204401933091},
                          {0.1, big, 1, 0.4364442857848},
                          {1, big, 100, 0.4936339083812},
                          {1, 1, 2, 0.1312639537009},
                          {1, 0.5, 1.2, 0.03031771015839},
                          {0.5, 1, 1.5, 0.2586483735344},
                          {1, 1, 1.3, 0.06418518404668},
                          {1, 3, 2, 0.1955011094779}}) {
        CAPTURE(c.distance);
        CAPTURE(c.height);
        CAPTURE(c.radius);
        Mesh mesh;
        wall(mesh, c.distance, c.height);
        CHECK(std::fabs(visibility(mesh, c.radius) - (1 - c.occlusion)) < tolerance);
    }
}

TEST_CASE("a wall exactly at the radius hides nothing to speak of")
{
    Mesh mesh;
    wall(mesh, 1, big);
    CHECK(visibility(mesh, std::nextafter(1, 0)) == 1);
    CHECK(visibility(mesh, 1) == 1);
    CHECK(visibility(mesh, std::nextafter(1, 2)) == 1);
    Mesh half;
    wall(half, 0.5, big);
    CHECK(visibility(half, 0.5000001) == 1);
}

TEST_CASE("a canyon, with and without a radius")
{
    struct Case {
        double width, left, right, x, radius, open;
    };
    for (const Case& c : {Case{2, 1, 1, 1, infinity, 0.70710678118655},
                          {2, 1, 1, 0.5, infinity, 0.6396319449189},
                          {2, 3, 0.5, 0.25, infinity, 0.52228471374728},
                          {10, 1, 4, 9, infinity, 0.61820967985498},
                          {2, 1, 1, 1, 1.5, 0.7924072592638},
                          {2, 1, 1, 0.5, 2, 0.67374970841376},
                          {1, 5, 5, 0.3, 0.9, 0.64747192575423}}) {
        CAPTURE(c.x);
        CAPTURE(c.radius);
        Mesh mesh;
        wall(mesh, -c.x, c.left);
        wall(mesh, c.width - c.x, c.right);
        CHECK(std::fabs(visibility(mesh, c.radius) - c.open) < tolerance);
    }
}

TEST_CASE("a parallel ceiling and rectangles of it")
{
    const auto ceiling = [](double h, double a, double b) {
        Mesh mesh;
        mesh.quad({0, 0, h}, {a, 0, h}, {a, b, h}, {0, b, h});
        return mesh;
    };
    const auto endless = [](double h) {
        Mesh mesh;
        mesh.quad({-big, -big, h}, {big, -big, h}, {big, big, h}, {-big, big, h});
        return mesh;
    };
    CHECK(std::fabs(visibility(endless(1), 2) - 0.25) < tolerance);
    CHECK(std::fabs(visibility(endless(1), 1.0001) - (1 - 0.0001999700039995)) < tolerance);
    CHECK(std::fabs(visibility(endless(3), 10) - 0.09) < tolerance);
    CHECK(std::fabs(visibility(ceiling(1, 1, 1), infinity) - (1 - 0.1385316059949)) < tolerance);
    CHECK(std::fabs(visibility(ceiling(1, 2, 1), infinity) - (1 - 0.1673750099144)) < tolerance);
    CHECK(std::fabs(visibility(ceiling(0.25, 0.5, 3), infinity) - (1 - 0.2234863298621)) <
          tolerance);
}

TEST_CASE("a finite rectangle on a perpendicular wall")
{
    // At a distance a, from the foot of the perpendicular to a height and a length along the wall.
    struct Case {
        double distance, height, length, occlusion;
    };
    for (const Case& c : {Case{1, 1, 1, 0.05573419700255},
                          {1, 2, 3, 0.132578388989},
                          {0.5, 1, 2, 0.1354883969649}}) {
        CAPTURE(c.height);
        for (const double side : {-1.0, 1.0}) {
            Mesh mesh;
            mesh.quad({c.distance, 0, 0}, {c.distance, side * c.length, 0},
                      {c.distance, side * c.length, c.height}, {c.distance, 0, c.height});
            CHECK(std::fabs(visibility(mesh, infinity) - (1 - c.occlusion)) < tolerance);
        }
    }
}

TEST_CASE("a sphere, with and without a radius, down to half below the horizon")
{
    // A sphere of radius r at a distance D, at an angle from the normal. The mesh lies within it, and
    // 1.9e-4 r below it at most (the middle of a facet): 2e-4 less occlusion at most.
    struct Case {
        double r, distance, degrees, radius, occlusion;
    };
    for (const Case& c : {Case{1, 2, 0, infinity, 0.25},
                          {1, 2, 45, infinity, 0.1767766952966},
                          {1, 2, 60, infinity, 0.125},
                          {1, 2, 75, infinity, 0.07041042695343},
                          {1, 2, 90, infinity, 0.02883444281122},
                          {1, 2, 105, infinity, 0.0057056656778},
                          {0.5, 1, 80, infinity, 0.05469581644554},
                          {1, 2, 0, 1.5, 0.234375},
                          {1, 2, 30, 1.2, 0.1250324176714},
                          {1, 2, 75, 1.5, 0.06536128065014},
                          {1, 2, 90, 1.25, 0.01532964777908}}) {
        CAPTURE(c.degrees);
        CAPTURE(c.radius);
        const double angle = c.degrees * pi / 180;
        const Mesh mesh = meshes::icosphere(
            5, c.r, {c.distance * std::sin(angle), 0, c.distance * std::cos(angle)});
        CHECK(std::fabs(visibility(mesh, c.radius) - (1 - c.occlusion)) < tolerance);
    }
    // Below the horizon, touching it, and beyond the radius: not a ray is hidden.
    const double angle = 2 * pi / 3;
    CHECK(visibility(meshes::icosphere(5, 1, {2 * std::sin(angle), 0, 2 * std::cos(angle)}),
                     infinity) == 1);
    CHECK(visibility(meshes::icosphere(5, 1, {0, 0, 2}), 0.999) == 1);
}

TEST_CASE("a spherical bowl hides the same everywhere on it: (1 − cos γ) / 2")
{
    // The part of the unit sphere within γ of its bottom, in 256 × 64 flat pieces; seen from the
    // middles of pieces, where the pieces change less than 6e-5 (by Lambert's formula for the rim).
    // With a radius R and a whole sphere: R² / 4.
    constexpr int columns = 256, rows = 64;
    for (const double degrees : {30.0, 60.0, 90.0, 120.0, 180.0}) {
        CAPTURE(degrees);
        const double gamma = degrees * pi / 180;
        Mesh mesh;
        const auto at = [&](int row, int column) {
            const double polar = gamma * row / rows, azimuth = 2 * pi * column / columns;
            return Point{std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                         -std::cos(polar)};
        };
        for (int row = 0; row <= rows; ++row)
            for (int column = 0; column < columns; ++column) mesh.vertex(at(row, column));
        for (int row = 0; row < rows; ++row)
            for (int column = 0; column < columns; ++column) {
                const auto name = [&](int r, int c) {
                    return static_cast<std::uint32_t>(r * columns + c % columns);
                };
                mesh.face(name(row, column), name(row + 1, column), name(row + 1, column + 1));
                if (row > 0)
                    mesh.face(name(row, column), name(row + 1, column + 1), name(row, column + 1));
            }
        Bvh bvh;
        REQUIRE(bvh.build(mesh.view()));
        for (const int row : {1, 20, 40, 60, 63}) {
            CAPTURE(row);
            // The middle of a piece, where the normals of the piece and of the sphere agree.
            const int column = 7 * row;
            const Point a = at(row, column), b = at(row + 1, column), c = at(row + 1, column + 1);
            const glm::dvec3 p{a[0], a[1], a[2]}, q{b[0], b[1], b[2]}, r{c[0], c[1], c[2]};
            const glm::dvec3 middle = (p + r) / 2.0;
            glm::dvec3 inward = glm::cross(q - p, r - p);
            if (glm::dot(inward, middle) > 0) inward = -inward;
            const auto open = [&](double radius) {
                return nook::traced_visibility(
                    bvh, middle, inward, {.radius = radius, .directions = directions, .seed = 5},
                    17, 0x1p-23);
            };
            CHECK(std::fabs(open(infinity) - (1 + std::cos(gamma)) / 2) < tolerance);
            if (degrees < 180) continue;
            CHECK(open(infinity) == 0);
            for (const double radius : {0.5, 1.0, 1.5})
                CHECK(std::fabs(open(radius) - (1 - radius * radius / 4)) < tolerance);
        }
    }
}

TEST_CASE("a groove of two planes")
{
    struct Case {
        double degrees, distance, radius, open;
    };
    for (const Case& c : {Case{30, 1, infinity, 0.06698729810778},
                          {60, 2, infinity, 0.25},
                          {90, 1, infinity, 0.5},
                          {120, 1, infinity, 0.75},
                          {150, 0.5, infinity, 0.9330127018922},
                          {60, 1, 1.5, 1 - 0.3603801276986},
                          {90, 1, 2, 1 - 0.1955011094779},
                          {120, 1, 1.5, 1 - 0.02704679436524},
                          {45, 1, 1, 1 - 0.3535533905933},
                          {150, 1, 0.9, 1}}) {
        CAPTURE(c.degrees);
        const double angle = c.degrees * pi / 180;
        // The point lies at the origin of one face; the edge is at x = -distance, and the other face
        // leaves it at the opening angle.
        const double edge = -c.distance;
        Mesh mesh;
        mesh.quad({edge, -big, 0}, {big, -big, 0}, {big, big, 0}, {edge, big, 0});
        const Point far_edge{edge + big * std::cos(angle), 0, big * std::sin(angle)};
        mesh.quad({edge, -big, 0}, {far_edge[0], -big, far_edge[2]},
                  {far_edge[0], big, far_edge[2]}, {edge, big, 0});
        CHECK(std::fabs(visibility(mesh, c.radius) - c.open) < tolerance);
    }
}

TEST_CASE("a corner of a floor and two walls")
{
    struct Case {
        double a, b, radius, occlusion;
    };
    for (const Case& c : {Case{1, 1, infinity, 0.75},
                          {0.3, 2, infinity, 0.75},
                          {1, 1, 2, 0.3659236379319},
                          {0.5, 1, 1.5, 0.3799356819867},
                          {1, 1, 1.2, 0.07960498081791},
                          {0.1, 0.2, 1, 0.6486209646949}}) {
        CAPTURE(c.a);
        CAPTURE(c.radius);
        Mesh mesh;
        mesh.quad({c.a, c.b, 0}, {c.a, -big, 0}, {c.a, -big, big}, {c.a, c.b, big});
        mesh.quad({c.a, c.b, 0}, {-big, c.b, 0}, {-big, c.b, big}, {c.a, c.b, big});
        CHECK(std::fabs(visibility(mesh, c.radius) - (1 - c.occlusion)) < tolerance);
    }
}

TEST_CASE("boxes, open and closed")
{
    const auto open_box = [](double a, double b, double h) {
        Mesh mesh;
        const double x = a / 2, y = b / 2;
        mesh.quad({-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0});
        mesh.quad({-x, -y, 0}, {x, -y, 0}, {x, -y, h}, {-x, -y, h});
        mesh.quad({-x, y, 0}, {x, y, 0}, {x, y, h}, {-x, y, h});
        mesh.quad({-x, -y, 0}, {-x, y, 0}, {-x, y, h}, {-x, -y, h});
        mesh.quad({x, -y, 0}, {x, y, 0}, {x, y, h}, {x, -y, h});
        return mesh;
    };
    CHECK(std::fabs(visibility(open_box(1, 1, 1), infinity) - 0.23945647046077) < tolerance);
    CHECK(std::fabs(visibility(open_box(2, 1, 0.5), infinity) - 0.66950003965754) < tolerance);
    CHECK(std::fabs(visibility(open_box(1, 1, 3), infinity) - 0.034106794899712) < tolerance);

    Mesh closed;
    closed.box({-1, -1, 0}, {1, 1, 2});
    CHECK(std::fabs(visibility(closed, 1.2) - (1 - 0.1592099616358)) < tolerance);
    CHECK(std::fabs(visibility(closed, 1.5) - (1 - 0.4341157578955)) < tolerance);
    CHECK(std::fabs(visibility(closed, 2.1) - (1 - 0.8042540714886)) < tolerance);
    CHECK(std::fabs(visibility(closed, 2.4) - (1 - 0.9982658381027)) < tolerance);
    CHECK(visibility(closed, 2.45) == 0);
    CHECK(visibility(closed, infinity) == 0);
    CHECK(visibility(closed, 0.999) == 1);
}

TEST_CASE("a curtain above the floor leaves the false highlight under it")
{
    // The known artefact of plain ray-traced AO (Fridvalszky & Toth 2022, figure 2): a box of
    // width w, endless along y, whose underside hangs m above the floor; a radius of 25. Openness at
    // a distance t from its middle, by quadrature.
    struct Case {
        double w, m, t, open;
    };
    for (const Case& c : {Case{1, 5, 0, 0.900839989718},
                          {1, 5, 0.5, 0.902285683758},
                          {1, 5, 2, 0.814655370648},
                          {1, 5, 4, 0.754097461344},
                          {1, 5, 6, 0.7420026379},
                          {1, 5, 9, 0.768598016672},
                          {1, 5, 12, 0.816187684265},
                          {1, 5, 15, 0.869088825398},
                          {1, 5, 20, 0.950540555663},
                          {1, 5, 24, 0.995312240039},
                          {10, 5, 0, 0.296344543859},
                          {10, 5, 6, 0.573621679151},
                          {10, 5, 20, 0.869330367412},
                          {30, 5, 0, 0.0620666362735},
                          {30, 5, 15, 0.52},
                          {30, 5, 20, 0.643879661611}}) {
        CAPTURE(c.w);
        CAPTURE(c.t);
        const double side = c.w / 2, top = c.m + 100;
        Mesh mesh;
        mesh.quad({-side, -big, c.m}, {side, -big, c.m}, {side, big, c.m}, {-side, big, c.m});
        mesh.quad({side, -big, c.m}, {side, big, c.m}, {side, big, top}, {side, -big, top});
        mesh.quad({-side, -big, c.m}, {-side, big, c.m}, {-side, big, top}, {-side, -big, top});
        CHECK(std::fabs(visibility(mesh, 25, {0, 0, 1}, {c.t, 0, 0}) - c.open) < tolerance);
    }
}

TEST_CASE("a floor and a wall through the whole chain, from a turned camera")
{
    // Floor y = 2.5 and wall x = 7.25, both endless as far as the radius tells. Each pixel, whose
    // point is found without the library, sees the other plane at a distance a: it hides
    // (acos c − c √(1 − c²)) / π, c = a / radius.
    constexpr double floor_y = 2.5, wall_x = 7.25, radius = 2.5;
    constexpr int width = 56, height = 42, count = 1024;
    Mesh mesh;
    mesh.quad({-200, floor_y, -200}, {wall_x, floor_y, -200}, {wall_x, floor_y, 200},
              {-200, floor_y, 200});
    mesh.quad({wall_x, floor_y, -200}, {wall_x, 200, -200}, {wall_x, 200, 200},
              {wall_x, floor_y, 200});
    const double spread = 0.40 * std::pow(count, -0.75);
    for (const bool orthographic : {false, true}) {
        CAPTURE(orthographic);
        const Camera camera{.eye = {2.2, 6.9, -4.6},
                            .target = {6.1, 2.9, 0.7},
                            .up = {0.4, 1, 0.3},
                            .orthographic = orthographic,
                            .vertical_fov = 0.6,
                            .view_height = 5};
        GBufferImages images = draw(mesh, camera, width, height);
        const Image<float> result =
            trace(mesh, images, {.radius = radius, .directions = count, .seed = 11});
        const auto forward = glm::normalize(camera.target - camera.eye);
        const auto right = glm::normalize(glm::cross(forward, camera.up));
        const auto up = glm::cross(right, forward);
        const double scale =
            (orthographic ? camera.view_height / 2 : std::tan(camera.vertical_fov / 2)) * 2 /
            height;
        int pixels[2] = {0, 0}, open = 0, darker = 0;
        double sum[2] = {0, 0}, worst = 0, moved = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const glm::dvec3 across = right * ((x + 0.5 - width / 2.0) * scale) +
                                          up * ((height / 2.0 - y - 0.5) * scale);
                const glm::dvec3 from = orthographic ? camera.eye + across : camera.eye;
                const glm::dvec3 along = orthographic ? forward : forward + across;
                const double to_floor = (floor_y - from.y) / along.y;
                const double to_wall = (wall_x - from.x) / along.x;
                const bool on_wall = to_floor < 0 || to_wall < to_floor;
                const glm::dvec3 point = from + along * (on_wall ? to_wall : to_floor);
                const nook::ViewPoint at = nook::view_point(images.projection, x + 0.5, y + 0.5,
                                                            double{images.depth(x, y)});
                const glm::dvec3 seen = nook::point_to_world(images.frame, {at.x, at.y, at.z});
                moved = std::fmax(moved, glm::length(seen - point));
                const double a = on_wall ? point.y - floor_y : wall_x - point.x, c = a / radius;
                if (c > 1) {
                    ++open;
                    darker += result(x, y) != 1;
                    continue;
                }
                const double hidden = (std::acos(c) - c * std::sqrt(1 - c * c)) / pi;
                const double error = double{result(x, y)} - (1 - hidden);
                ++pixels[on_wall];
                sum[on_wall] += error;
                worst = std::fmax(worst, std::fabs(error));
            }
        CHECK(open > 100);
        CHECK(darker == 0);
        CHECK(moved < 1e-5);
        CHECK(worst < 5 * spread);
        for (const int plane : {0, 1}) {
            CAPTURE(plane);
            REQUIRE(pixels[plane] > 300);
            CHECK(std::fabs(sum[plane]) < 5 * spread * std::sqrt(pixels[plane]));
        }
    }
}

TEST_CASE("the error falls at the rate of stratified sampling")
{
    // Wall of height 1 at distance 1; RMS over 64 sets of directions, at 16 and 1024 of them. The
    // theory says N^(-3/4) for a 0/1 integrand, random directions would give N^(-1/2).
    Mesh mesh;
    wall(mesh, 1, 1);
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    const auto rms = [&](int count) {
        double squares = 0;
        for (std::uint32_t i = 0; i < 64; ++i) {
            const double v = nook::traced_visibility(bvh, {0, 0, 0}, {0, 0, 1},
                                                     {.directions = count, .seed = 3}, i);
            squares += (v - 0.8535533905933) * (v - 0.8535533905933);
        }
        return std::sqrt(squares / 64);
    };
    const double coarse = rms(16), fine = rms(1024);
    CAPTURE(coarse);
    CAPTURE(fine);
    const double slope = std::log(fine / coarse) / std::log(64.0);
    CHECK(slope < -0.65);
    CHECK(fine < 1.5 * 2.2e-3);
}

TEST_CASE("inside a closed box every pixel is exactly 0")
{
    Mesh mesh;
    mesh.box({-1, -2, -3}, {2, 1, 1.5});
    for (const double scale : {1e-6, 1.0, 1e6}) {
        const Mesh box = mesh.transformed(scale, {0, 0, 0});
        for (int view = 0; view < 6; ++view) {
            const double a = view * 1.1;
            const Camera camera{
                .eye = glm::dvec3{0.3, -0.4, 0.2} * scale,
                .target =
                    glm::dvec3{0.3 + std::cos(a), -0.4 + 0.5 * std::sin(3 * a), 0.2 + std::sin(a)} *
                    scale,
                .vertical_fov = 1.7};
            GBufferImages images = draw(box, camera, 64, 48);
            CHECK(count_other_than(trace(box, images, {.directions = 32}), 0) == 0);
        }
    }
}

TEST_CASE("a convex body is exactly 1 at any scale and any distance from zero")
{
    struct Body {
        const char* name;
        Mesh mesh;
    };
    std::vector<Body> bodies(3);
    bodies[0].name = "box";
    bodies[0].mesh.box({-1, -0.5, -0.75}, {1, 0.5, 0.75});
    bodies[1] = {"icosahedron", meshes::icosphere(0)};
    bodies[2] = {"ball", meshes::icosphere(2)};
    struct Place {
        double scale;
        Point shift;
    };
    for (const Body& body : bodies) {
        CAPTURE(body.name);
        for (const Place& place : {Place{1, {0, 0, 0}},
                                   {1e-6, {0, 0, 0}},
                                   {1e-3, {0, 0, 0}},
                                   {1e3, {0, 0, 0}},
                                   {1e6, {0, 0, 0}},
                                   {1024, {1e5, 1e5, -1e5}},
                                   {1024, {1e6, -1e6, 1e6}},
                                   {4, {1e5, 0, 0}},
                                   {1e-30, {0, 0, 0}},
                                   {1e30, {0, 0, 0}}}) {
            // Where floats are too coarse the ball has dents.
            if (body.name[0] == 'b' && body.name[1] == 'a' && place.shift[0] != 0) continue;
            CAPTURE(place.scale);
            CAPTURE(place.shift[0]);
            const Mesh mesh = body.mesh.transformed(place.scale, place.shift);
            for (int view = 0; view < 6; ++view) {
                CAPTURE(view);
                const bool orthographic = view % 3 == 2;
                const double a = 1 + view * 1.3, near_by = view == 4 ? 1.35 : 4;
                const glm::dvec3 centre{place.shift[0], place.shift[1], place.shift[2]};
                const Camera camera{
                    .eye = centre + glm::dvec3{std::cos(a), 0.4 - 0.2 * view, std::sin(a)} *
                                        (near_by * place.scale),
                    .target = centre + glm::dvec3{0.1, 0, 0} * place.scale,
                    .orthographic = orthographic,
                    .vertical_fov = 0.6,
                    .view_height = 2.2 * place.scale};
                GBufferImages images = draw(mesh, camera, 48, 48);
                CHECK(count_other_than(trace(mesh, images, {.directions = 64}), 1) == 0);
            }
        }
    }
}

TEST_CASE("the position error of a coarser rasteriser is covered when it is told")
{
    // A rasteriser that draws everything 1/256 pixel off.
    const Mesh body = meshes::icosphere(1);
    const Camera camera{.eye = {1, 2, 3}, .vertical_fov = 0.7};
    double darkest = 1;
    for (const double dx : {-0x1p-8, 0x1p-8})
        for (const double dy : {-0x1p-8, 0x1p-8}) {
            GBufferImages images = draw(body, camera, 48, 48);
            const nook::Projection told = images.projection;
            nook::Projection drawn = told;
            drawn.cx += dx;
            drawn.cy += dy;
            REQUIRE(nook::rasterise(body.view(), images.frame, drawn,
                                    {images.depth.view(), images.normals(), {}}));
            CHECK(count_other_than(
                      trace(body, images, {.directions = 32, .position_error = 0x1p-8}), 1) == 0);
            for (const float v : trace(body, images, {.directions = 32, .position_error = 0}))
                darkest = std::fmin(darkest, double{v});
        }
    CHECK(darkest < 0.1);
}

TEST_CASE("a floor seen at a slant is exactly 1 up to the horizon, in every encoding")
{
    Mesh floor;
    floor.quad({-1e4, 0, 1e4}, {1e4, 0, 1e4}, {1e4, 0, -1e4}, {-1e4, 0, -1e4});
    using enum nook::DepthEncoding;
    for (const auto encoding : {linear, negative_z, standard, reversed, opengl, logarithmic}) {
        const Camera camera{.eye = {0, 1.7, 0},
                            .target = {0.3, 1.6, -5},
                            .near_plane = 0.1,
                            .far_plane = 2e4,
                            .encoding = encoding};
        GBufferImages images = draw(floor, camera, 64, 48);
        const Mesh& mesh = floor;
        Bvh bvh;
        REQUIRE(bvh.build(mesh.view()));
        Image<std::uint16_t> stored{64, 48};
        Image<float> stored_float{64, 48}, result{64, 48};
        REQUIRE(nook::encode_depths(images.depth.view(), stored.view(), images.projection));
        REQUIRE(nook::encode_depths(images.depth.view(), stored_float.view(), images.projection));
        const TracedOptions<> options{.directions = 32};
        if (encoding != negative_z) {  // 16 fixed bits hold no negative number
            REQUIRE(nook::traced_ao(bvh, nook::hardware_depth(stored.view(), images.projection),
                                    images.normals(), result.view(), options, images.projection,
                                    images.frame));
            CHECK(count_other_than(result, 1) == 0);
        }
        REQUIRE(nook::traced_ao(bvh, nook::hardware_depth(stored_float.view(), images.projection),
                                images.normals(), result.view(), options, images.projection,
                                images.frame));
        CHECK(count_other_than(result, 1) == 0);
    }
}

TEST_CASE("a scene a million units from zero keeps its visibility")
{
    Mesh mesh;
    mesh.box({-8, -1, -8}, {8, 0, 8});
    mesh.box({-2, 0, -2}, {0.5, 3, 1});
    mesh.box({1, 0, -3}, {3, 1.5, 3});
    const glm::dvec3 eye{4, 6, 9};
    const double shift = 1e6;
    GBufferImages here = draw(mesh, {.eye = eye}, 40, 30);
    const Mesh moved = mesh.transformed(1, {shift, shift, shift});
    GBufferImages there =
        draw(moved, {.eye = eye + glm::dvec3{shift, shift, shift}, .target = {shift, shift, shift}},
             40, 30);
    const TracedOptions<> options{.radius = 4, .directions = 256};
    const Image<float> a = trace(mesh, here, options), b = trace(moved, there, options);
    double worst = 0, mean = 0;
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) {
            worst = std::fmax(worst, std::fabs(double{a(x, y)} - double{b(x, y)}));
            mean += double{a(x, y)} / 1200;
        }
    CHECK(mean < 0.99);
    CHECK(mean > 0.5);
    CHECK(worst <= 4.0 / 256);
}

TEST_CASE("background, missing normals and an empty scene are exactly 1 without a ray")
{
    const Mesh ball = meshes::icosphere(1);
    GBufferImages images = draw(ball, {.eye = {0, 0, 3}}, 16, 16);
    Bvh bvh;
    REQUIRE(bvh.build(ball.view()));
    Image<float> result{16, 16, -7};
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float far_away = std::numeric_limits<float>::infinity();
    // Four pixels on the ball lose their depth, three their normal.
    images.depth(7, 7) = nan;
    images.depth(8, 7) = far_away;
    images.depth(7, 8) = -1;
    images.depth(8, 8) = 0;
    images.normal(3 * 9, 8) = nan;
    images.normal(3 * 9 + 1, 9) = far_away;
    for (int k = 0; k < 3; ++k) images.normal(3 * 8 + k, 9) = 0;
    const auto trace_with = [&](const Bvh& scene, const TracedOptions<>& options) {
        return nook::traced_ao(scene, images.depth.view(), images.normals(), result.view(), options,
                               images.projection, images.frame);
    };
    int surfaces = 0;
    for (const float d : images.depth) surfaces += d > 0 && d < 1e9f;
    surfaces -= 3;
    const nook::Outcome done = trace_with(bvh, {.directions = 8});
    REQUIRE(done);
    CHECK(done.work.pixels == 256);
    CHECK(done.work.background == static_cast<std::uint64_t>(256 - surfaces));
    CHECK(done.work.rays + done.work.skipped_rays == static_cast<std::uint64_t>(8 * surfaces));
    CHECK(done.work.skipped_rays > 0);
    CHECK(count_other_than(result, 1) == 0);
    const nook::Outcome none = trace_with(Bvh{}, {});
    REQUIRE(none);
    CHECK(none.work.rays == 0);
    CHECK(none.work.skipped_rays == static_cast<std::uint64_t>(256 * surfaces));
    const nook::Outcome short_sighted = trace_with(bvh, {.radius = 0});
    REQUIRE(short_sighted);
    CHECK(short_sighted.work.rays == 0);
    CHECK(count_other_than(result, 1) == 0);
    CHECK(trace_with(bvh, {.radius = 1e-320}));
    CHECK(count_other_than(result, 1) == 0);
}

TEST_CASE("one direction, odd numbers of them and other seeds stay within [0, 1]")
{
    Mesh mesh;
    mesh.box({-8, -1, -8}, {8, 0, 8});
    mesh.box({-2, 0, -2}, {0.5, 3, 1});
    GBufferImages images = draw(mesh, {.eye = {3, 4, 6}}, 24, 18);
    for (const int count : {1, 3, 100}) {
        const Image<float> a = trace(mesh, images, {.radius = 4, .directions = count});
        const Image<float> b = trace(mesh, images, {.radius = 4, .directions = count, .seed = 1});
        CHECK(a == trace(mesh, images, {.radius = 4, .directions = count}));
        CHECK(a != b);
        for (const float v : a) {
            CHECK(v >= 0);
            CHECK(v <= 1);
            CHECK(std::fabs(double{v} * count - std::round(double{v} * count)) < 1e-5);
        }
    }
}

TEST_CASE("threads, strides and the length of normals do not change a bit")
{
    Mesh mesh;
    mesh.box({-8, -1, -8}, {8, 0, 8});
    mesh.box({-2, 0, -2}, {0.5, 3, 1});
    GBufferImages images = draw(mesh, {.eye = {3, 4, 6}}, 37, 23);
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    const TracedOptions<> options{.radius = 4, .directions = 16};
    const Image<float> plain = trace(mesh, images, options);
    CHECK(count_other_than(plain, 1) > 100);
    nook::ThreadExecutor threads{5};
    // Planar normals scaled by a power of two, everything bottom-up in double.
    std::vector<float> planes[3];
    for (int k = 0; k < 3; ++k)
        for (int y = 22; y >= 0; --y)
            for (int x = 0; x < 37; ++x) planes[k].push_back(images.normal(3 * x + k, y) * 8);
    const auto flipped = [](std::vector<float>& v) {
        return nook::ImageView<const float>{v.data() + 22 * 37, 37, 23, -37};
    };
    std::vector<double> result(37 * 23 * 2, -7.0);
    const nook::ImageView<double> view{result.data() + 22 * 74, 37, 23, -74, 2};
    REQUIRE(nook::traced_ao(bvh, images.depth.view(),
                            {flipped(planes[0]), flipped(planes[1]), flipped(planes[2])}, view,
                            options, images.projection, images.frame, {}, {}, threads));
    int different = 0;
    for (int y = 0; y < 23; ++y)
        for (int x = 0; x < 37; ++x) different += float(view(x, y)) != plain(x, y);
    CHECK(different == 0);
    for (std::size_t i = 1; i < result.size(); i += 2) CHECK(result[i] == -7);
}

TEST_CASE("a work map spares what it says, and no more")
{
    Mesh mesh;
    mesh.box({-8, -1, -8}, {8, 0, 8});
    mesh.box({-2, 0, -2}, {0.5, 3, 1});
    GBufferImages images = draw(mesh, {.eye = {0, 9, 0.1}}, 40, 20);
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    const TracedOptions<> options{.radius = 4, .directions = 16};
    const Image<float> plain = trace(mesh, images, options);
    std::vector<std::uint8_t> active(3 * 20);
    for (std::size_t i = 0; i < active.size(); ++i) active[i] = i % 2;
    const nook::WorkMap map{.active = {active.data(), 3, 20}};
    Image<float> result{40, 20, -7};
    const nook::Outcome done =
        nook::traced_ao(bvh, images.depth.view(), images.normals(), result.view(), options,
                        images.projection, images.frame, map);
    REQUIRE(done);
    std::uint64_t skipped = 0;
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 40; ++x) {
            const bool there = images.depth(x, y) < 1e9f;
            skipped += there && !map.is_active(x, y);
            CHECK(result(x, y) == (map.is_active(x, y) ? plain(x, y) : 1));
        }
    CHECK(skipped > 100);
    CHECK(done.work.skipped == skipped);
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    const Mesh ball = meshes::icosphere(1);
    GBufferImages images = draw(ball, {.eye = {0, 0, 3}}, 8, 6);
    Bvh bvh;
    REQUIRE(bvh.build(ball.view()));
    Image<float> result{8, 6, -7};
    const auto rejected = [&](const TracedOptions<>& options, auto change) {
        auto normals = nook::ImageView3<const float>(images.normals());
        auto view = result.view();
        auto projection = images.projection;
        auto frame = images.frame;
        change(normals, view, projection, frame);
        const nook::Outcome outcome =
            nook::traced_ao(bvh, images.depth.view(), normals, view, options, projection, frame);
        CHECK(count_other_than(result, -7) == 0);
        return std::string{outcome.error.argument};
    };
    const auto nothing = [](auto&...) {};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(rejected({.radius = -1}, nothing) == "options.radius");
    CHECK(rejected({.radius = nan}, nothing) == "options.radius");
    CHECK(rejected({.directions = 0}, nothing) == "options.directions");
    CHECK(rejected({.position_error = nan}, nothing) == "options.position_error");
    CHECK(rejected({}, [](auto& n, auto&...) { n.y.data = nullptr; }) == "normals.y");
    CHECK(rejected({}, [](auto& n, auto&...) { n.z.width = 7; }) == "normals.z");
    CHECK(rejected({}, [](auto&, auto& v, auto&...) { v.height = 5; }) == "visibility");
    CHECK(rejected({}, [&](auto&, auto& v, auto&...) { v.data = images.depth.data(); }) ==
          "visibility");
    CHECK(rejected({}, [](auto&, auto&, auto& p, auto&) { p.fy = -1; }) == "projection.fy");
    CHECK(rejected({}, [&](auto&, auto&, auto&, auto& f) { f.origin.z = nan; }) == "frame.origin");
    CHECK(nook::traced_ao(bvh, nook::ImageView<const float>{}, {}, nook::ImageView<float>{}, {},
                          images.projection, images.frame));
}

TEST_CASE("points for baking: poor input is 1, a vertex of a convex body is 1")
{
    const Mesh ball = meshes::icosphere(2, 3);
    Bvh bvh;
    REQUIRE(bvh.build(ball.view()));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(nook::traced_visibility(bvh, {0, 0, 0}, {0, 0, 0}, {}) == 1);
    CHECK(nook::traced_visibility(bvh, {nan, 0, 0}, {0, 0, 1}, {}) == 1);
    CHECK(nook::traced_visibility(bvh, {0, 0, 0}, {0, nan, 1}, {}) == 1);
    CHECK(nook::traced_visibility(bvh, {0, 0, 0}, {0, 0, 1}, {.directions = -1}) == 1);
    CHECK(nook::traced_visibility(bvh, {0, 0, 0}, {0, 0, 9}, {}) == 0);
    // Centres of faces with the normals of the faces.
    for (std::size_t t = 0; t < ball.indices.size(); t += 3) {
        const auto corner = [&](std::size_t i) {
            return meshes::vertex_position(ball, ball.indices[t + i]);
        };
        const glm::dvec3 a = corner(0), b = corner(1), c = corner(2), ab = b - a, ac = c - a;
        const glm::dvec3 normal{ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z,
                                ab.x * ac.y - ab.y * ac.x};
        const glm::dvec3 centre = (a + b + c) / 3.0;
        const double outward =
            normal.x * centre.x + normal.y * centre.y + normal.z * centre.z > 0 ? 1 : -1;
        CHECK(nook::traced_visibility(bvh, centre, normal * outward, {.directions = 64}) == 1);
    }
}
