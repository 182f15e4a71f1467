#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/triangle_surface.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Camera;
using nook::GBuffer;
using nook::Image;
using nook::Projection;
using nook::ViewFrame;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

struct Picture {
    Image<float> depth, normal;
    Image<std::uint32_t> face;

    Picture(int width, int height)
        : depth{width, height, -7},
          normal{3 * width, height, -7},
          face{width, height, 7}
    {}
    GBuffer buffers()
    {
        return {depth.view(),
                nook::ImageView3<float>::interleaved(normal.data(), depth.width(), depth.height(),
                                                     3 * depth.width()),
                face.view()};
    }
    bool operator==(const Picture&) const = default;
};

Picture draw(const Mesh& mesh, const ViewFrame& frame, const Projection& projection, int width,
             int height, const nook::RasteriseOptions& options = {})
{
    Picture picture{width, height};
    REQUIRE(nook::rasterise(mesh.view(), frame, projection, picture.buffers(), options));
    return picture;
}

/// The ray of a pixel position, with t = distance along the view axis.
nook::Ray pixel_ray(const ViewFrame& frame, const Projection& projection, double x, double y)
{
    const nook::ViewPoint p = nook::view_point(projection, x, y, 1);
    if (projection.orthographic)
        return {nook::point_to_world(frame, {p.x, p.y, 0}),
                nook::direction_to_world(frame, {0, 0, -1})};
    return {frame.origin, nook::direction_to_world(frame, {p.x, p.y, p.z})};
}

struct Comparison {
    int pixels = 0, edges = 0, wrong = 0;
};

/// Each pixel shows what its ray hits; only where the hit changes within 2⁻¹² pixels may it show what
/// a ray that close hits.
Comparison compare(const Picture& picture, const Mesh& mesh, const ViewFrame& frame,
                   const Projection& projection)
{
    nook::Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    Comparison result;
    for (int y = 0; y < picture.depth.height(); ++y) {
        for (int x = 0; x < picture.depth.width(); ++x) {
            ++result.pixels;
            const std::uint32_t face = picture.face(x, y);
            const auto agrees = [&](double px, double py, double slack) {
                const nook::Hit hit = bvh.closest(pixel_ray(frame, projection, px, py));
                if (!hit || face == nook::no_face)
                    return !hit && face == nook::no_face && picture.depth(x, y) == infinity;
                const double depth = double{picture.depth(x, y)};
                return std::fabs(depth - hit.t) <= (0x1p-22 + slack) * hit.t &&
                       (hit.face == face || slack == 0);
            };
            if (agrees(x + 0.5, y + 0.5, 0)) continue;
            bool explained = false;
            for (const double dx : {-0x1p-12, 0.0, 0x1p-12})
                for (const double dy : {-0x1p-12, 0.0, 0x1p-12})
                    explained = explained || agrees(x + 0.5 + dx, y + 0.5 + dy, 0.02);
            ++(explained ? result.edges : result.wrong);
        }
    }
    return result;
}

/// How often each pixel is covered when every triangle is drawn by itself.
Image<int> coverage(const Mesh& mesh, const ViewFrame& frame, const Projection& projection,
                    int width, int height)
{
    using namespace nook::detail;
    const PixelGrid grid{projection, width, height, 1e-3};
    const Frame axes{frame};
    Image<int> count{width, height};
    const nook::MeshView view = mesh.view();
    for (std::size_t t = 0; t < view.triangle_count; ++t) {
        Vector3 corners[3];
        for (std::size_t i = 0; i < 3; ++i)
            corners[i] =
                axes.direction_to_view(mesh_position(view, view.indices[3 * t + i]) - axes.origin);
        const ClippedPolygon polygon = clip_triangle(grid, corners[0], corners[1], corners[2]);
        for (int i = 2; i < polygon.count; ++i)
            TriangleCoverage{grid.bits(), polygon.corners[0], polygon.corners[i - 1],
                             polygon.corners[i]}
                .for_each_row(width, 0, height - 1, [&](int y, int first, int last) {
                    for (int x = first; x <= last; ++x) ++count(x, y);
                });
    }
    return count;
}

/// A view in which world (x, y) is pixel (x, y), y down, at distance 1.
ViewFrame screen_frame() { return {.origin = {0, 0, 1}}; }
Projection screen_projection()
{
    return {.fx = 1, .fy = 1, .cx = 0, .cy = 0, .orthographic = true};
}
meshes::Point on_screen(double x, double y, double z = 0) { return {x, -y, z}; }

}  // namespace

TEST_CASE("every pixel shows the triangle that its ray hits")
{
    std::mt19937 random{2};
    std::uniform_real_distribution<double> unit{-1, 1};
    int pixels = 0, edges = 0;
    for (int scene = 0; scene < 60; ++scene) {
        CAPTURE(scene);
        const bool inside = scene % 3 == 0, flat = scene % 4 == 1;
        const Mesh mesh = meshes::soup(random, 150);
        Camera camera{.eye = meshes::random_direction(random) * (inside ? 0.3 : 3.0),
                      .target = {0.2 * unit(random), 0.2 * unit(random), 0.2 * unit(random)},
                      .orthographic = flat,
                      .vertical_fov = inside ? 1.6 : 0.8};
        const ViewFrame frame = nook::view_frame(camera);
        Projection projection = nook::projection(camera, 60, 44);
        if (scene % 5 == 2) {
            projection.fx *= 1.7;
            projection.cx += 13.37;
            projection.cy -= 4.21;
        }
        const Picture picture = draw(mesh, frame, projection, 60, 44);
        const Comparison result = compare(picture, mesh, frame, projection);
        CHECK(result.wrong == 0);
        pixels += result.pixels;
        edges += result.edges;
    }
    // The share of pixels within 2⁻¹² of an edge.
    CHECK(edges < pixels / 1000);
}

TEST_CASE("a picture is that of triangles drawn one by one")
{
    using namespace nook::detail;
    std::mt19937 random{12};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (int scene = 0; scene < 40; ++scene) {
        CAPTURE(scene);
        const bool inside = scene % 3 == 0, orthographic = scene % 4 < 2;
        const Mesh soup = meshes::soup(random, scene == 7 ? 20000 : 300);
        const Mesh mesh = scene % 10 == 3 ? soup.transformed(100, {0, 0, 0}) : soup;
        const Camera camera{.eye = meshes::random_direction(random) * (inside ? 0.4 : 3.0),
                            .orthographic = orthographic,
                            .vertical_fov = inside ? 1.6 : 0.7,
                            .near_plane = scene % 5 == 0 ? 0.5 : 1e-3,
                            .far_plane = scene % 6 == 1 ? 3.0 : 1e9};
        const int width = 1 + static_cast<int>(random() % 400);
        const int height = 1 + static_cast<int>(random() % 200);
        const ViewFrame frame = nook::view_frame(camera);
        Projection projection = nook::projection(camera, width, height);
        projection.cx += 20 * unit(random);
        const Picture picture = draw(mesh, frame, projection, width, height);
        Picture plain{width, height};
        for (float& depth : plain.depth) depth = infinity;
        for (std::uint32_t& face : plain.face) face = nook::no_face;
        const PixelGrid grid{projection, width, height, camera.near_plane};
        const Frame axes{frame};
        const nook::MeshView view = mesh.view();
        for (std::size_t t = 0; t < view.triangle_count; ++t) {
            Vector3 corners[3];
            for (std::size_t i = 0; i < 3; ++i)
                corners[i] = axes.direction_to_view(mesh_position(view, view.indices[3 * t + i]) -
                                                    axes.origin);
            const TriangleSurface surface{projection, camera.near_plane, corners[0], corners[1],
                                          corners[2]};
            const ClippedPolygon polygon = clip_triangle(grid, corners[0], corners[1], corners[2]);
            for (int i = 2; i < polygon.count; ++i)
                TriangleCoverage{grid.bits(), polygon.corners[0], polygon.corners[i - 1],
                                 polygon.corners[i]}
                    .for_each_row(width, 0, height - 1, [&](int y, int first, int last) {
                        for (int x = first; x <= last; ++x) {
                            const double distance =
                                surface.distance(surface.slope_x(x), surface.slope_y(y));
                            const float stored = static_cast<float>(distance);
                            if (distance > camera.far_plane || stored >= plain.depth(x, y))
                                continue;
                            plain.depth(x, y) = stored;
                            plain.face(x, y) = static_cast<std::uint32_t>(t);
                        }
                    });
        }
        CHECK(picture.face == plain.face);
        int wrong = 0, covered = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                // One step of a float at most.
                const float depth = plain.depth(x, y);
                covered += depth < infinity;
                wrong += depth < infinity
                             ? !(std::fabs(picture.depth(x, y) - depth) <= depth * 0x1p-23f)
                             : picture.depth(x, y) != infinity;
            }
        CHECK(wrong == 0);
        CHECK((covered > 0 || width * height < 1000));
        // Nothing else is computed with less.
        Image<float> alone{width, height};
        REQUIRE(nook::rasterise(mesh.view(), frame, projection, {alone.view()}));
        CHECK(alone == picture.depth);
    }
}

TEST_CASE("what is hidden behind many layers changes nothing, whatever the order")
{
    // Layers of triangles of all sizes, some of them at the very same distance, bright and dark holes
    // between them.
    std::mt19937 random{41};
    constexpr int layers = 16, width = 150, height = 90;
    std::uniform_real_distribution<double> at{-20, 170};
    for (int order = 0; order < 4; ++order) {
        CAPTURE(order);
        Mesh mesh;
        for (int layer = 0; layer < layers; ++layer) {
            const int i = order == 0   ? layer
                          : order == 1 ? layers - 1 - layer
                                       : static_cast<int>(random() % layers);
            const double z = -1 - i / 2;
            const double tilt = order == 3 ? 1e-3 * i : 0;
            const double cell = layer % 4 == 0 ? 12 : layer % 4 == 1 ? 30 : 70;
            for (double y = -10; y < height; y += cell)
                for (double x = -10; x < width; x += cell) {
                    if (random() % 16 == 0) continue;
                    const auto corner = [&](double px, double py) {
                        return on_screen(px, py, z + tilt * px);
                    };
                    mesh.triangle(corner(x, y), corner(x + cell, y), corner(x, y + cell));
                    mesh.triangle(corner(x + cell, y), corner(x + cell, y + cell),
                                  corner(x, y + cell));
                }
            const auto any = [&] { return on_screen(at(random), at(random), z); };
            mesh.triangle(any(), any(), any());
        }
        const Picture whole = draw(mesh, screen_frame(), screen_projection(), width, height);
        Image<float> depth{width, height, infinity};
        Image<std::uint32_t> face{width, height, nook::no_face};
        nook::MeshView one = mesh.view();
        Image<float> alone{width, height};
        nook::HeapScratch scratch;
        for (std::uint32_t t = 0; t < mesh.view().triangle_count; ++t) {
            one.indices = mesh.view().indices + 3 * std::size_t{t};
            one.triangle_count = 1;
            REQUIRE(nook::rasterise(one, screen_frame(), screen_projection(), {alone.view()}, {},
                                    scratch));
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    if (alone(x, y) < depth(x, y)) {
                        depth(x, y) = alone(x, y);
                        face(x, y) = t;
                    }
        }
        CHECK(whole.depth == depth);
        CHECK(whole.face == face);
    }
}

TEST_CASE("back faces are left out on request, in a mirrored frame too")
{
    Mesh mesh;
    mesh.triangle({-9, -9, 0}, {9, -9, 0}, {0, 18, 0});
    mesh.triangle({-9, -9, 1}, {0, 18, 1}, {9, -9, 1});
    const Camera camera{.eye = {0, 0, 3}};
    ViewFrame frame = nook::view_frame(camera);
    const Projection projection = nook::projection(camera, 9, 9);
    for (const bool mirrored : {false, true}) {
        if (mirrored) frame.right.x = -frame.right.x;
        const Picture picture = draw(mesh, frame, projection, 9, 9, {.leave_out_back_faces = true});
        for (const std::uint32_t face : picture.face) CHECK(face == 0);
        for (const std::uint32_t face : draw(mesh, frame, projection, 9, 9).face) CHECK(face == 1);
        for (const float depth : picture.depth) CHECK(depth == 3);
    }
}

TEST_CASE("a triangulation covers each pixel exactly once")
{
    std::mt19937 random{3};
    std::uniform_real_distribution<double> jitter{-0.2, 0.2};
    SUBCASE("1e5 triangles, a third of a pixel each")
    {
        const int cells = 224;
        Mesh mesh;
        for (int y = 0; y <= cells; ++y)
            for (int x = 0; x <= cells; ++x) {
                // Every fourth vertex stays where pixel centres and corners are.
                const bool exact = (x + y) % 4 == 0;
                const double dx = exact ? 0 : jitter(random), dy = exact ? 0 : jitter(random);
                mesh.vertex(on_screen((x + dx) * 0.75 - 4, (y + dy) * 0.75 - 4));
            }
        for (unsigned y = 0; y < cells; ++y)
            for (unsigned x = 0; x < cells; ++x) {
                const unsigned a = y * (cells + 1) + x, b = a + 1, c = a + cells + 1, d = c + 1;
                // Either diagonal, either winding.
                if (random() % 2 == 0) {
                    mesh.face(a, b, d);
                    mesh.face(a, c, d);
                } else {
                    mesh.face(b, a, c);
                    mesh.face(d, b, c);
                }
            }
        CHECK(mesh.view().triangle_count > 100000);
        const Image<int> count = coverage(mesh, screen_frame(), screen_projection(), 160, 160);
        CHECK(std::count(count.begin(), count.end(), 1) == 160 * 160);
        const Picture picture = draw(mesh, screen_frame(), screen_projection(), 160, 160);
        CHECK(std::count(picture.face.begin(), picture.face.end(), nook::no_face) == 0);
    }
    SUBCASE("edges along rows and columns of pixel centres")
    {
        Mesh mesh;
        for (int y = 0; y <= 40; ++y)
            for (int x = 0; x <= 40; ++x) mesh.vertex(on_screen(x * 0.5 - 1.5, y * 0.5 - 1.5));
        for (unsigned y = 0; y < 40; ++y)
            for (unsigned x = 0; x < 40; ++x) {
                const unsigned a = y * 41 + x, b = a + 1, c = a + 41, d = c + 1;
                if (random() % 2 == 0) {
                    mesh.face(a, b, d);
                    mesh.face(a, c, d);
                } else {
                    mesh.face(b, a, c);
                    mesh.face(d, b, c);
                }
            }
        const Image<int> count = coverage(mesh, screen_frame(), screen_projection(), 16, 16);
        CHECK(std::count(count.begin(), count.end(), 1) == 256);
    }
    SUBCASE("fans about pixel centres, corners and elsewhere")
    {
        for (int fan = 0; fan < 200; ++fan) {
            Mesh mesh;
            const double x = fan % 3 == 0 ? 8.5 : fan % 3 == 1 ? 8 : 8 + jitter(random);
            const double y = fan % 2 == 0 ? 8.5 : 8 + jitter(random);
            const std::uint32_t centre = mesh.vertex(on_screen(x, y));
            const int blades = 3 + fan % 61;
            for (int i = 0; i < blades; ++i) {
                const double angle = 2 * std::numbers::pi * (i + jitter(random)) / blades;
                const double reach = fan % 5 == 0 ? 1e7 : 60;
                mesh.vertex(on_screen(x + reach * std::cos(angle), y + reach * std::sin(angle)));
            }
            for (int i = 0; i < blades; ++i) {
                const auto a = static_cast<std::uint32_t>(1 + i);
                const auto b = static_cast<std::uint32_t>(1 + (i + 1) % blades);
                if (i % 2 == 0) mesh.face(centre, a, b);
                else mesh.face(b, a, centre);
            }
            const Image<int> count = coverage(mesh, screen_frame(), screen_projection(), 16, 16);
            CHECK(std::count(count.begin(), count.end(), 1) == 256);
        }
    }
    SUBCASE("seen in perspective, around and behind the viewer")
    {
        // A floor under the camera: most triangles are clipped.
        const int cells = 24;
        Mesh mesh;
        for (int y = 0; y <= cells; ++y)
            for (int x = 0; x <= cells; ++x)
                mesh.vertex({x - 12 + jitter(random), 0, y - 12 + jitter(random)});
        for (unsigned y = 0; y < cells; ++y)
            for (unsigned x = 0; x < cells; ++x) {
                const unsigned a = y * (cells + 1) + x, b = a + 1, c = a + cells + 1, d = c + 1;
                mesh.face(a, b, d);
                mesh.face(a, d, c);
            }
        for (int view = 0; view < 40; ++view) {
            const Camera camera{.eye = {jitter(random) * 10, view % 2 == 0 ? 0.01 : 1.5, 0.3},
                                .target = {jitter(random) * 20, view % 3 * 0.3, -3},
                                .vertical_fov = 1.8};
            const ViewFrame frame = nook::view_frame(camera);
            const Projection projection = nook::projection(camera, 64, 48);
            const Image<int> count = coverage(mesh, frame, projection, 64, 48);
            const Picture picture = draw(mesh, frame, projection, 64, 48);
            int wrong = 0, checked = 0;
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 64; ++x) {
                    const nook::Ray ray = pixel_ray(frame, projection, x + 0.5, y + 0.5);
                    const double t = -ray.origin.y / ray.direction.y;
                    const double px = ray.origin.x + t * ray.direction.x;
                    const double pz = ray.origin.z + t * ray.direction.z;
                    const double reach = (std::max)(std::fabs(px), std::fabs(pz));
                    if (t > 2e-3 && reach < 11.7) {
                        ++checked;
                        wrong += count(x, y) != 1 || picture.face(x, y) == nook::no_face;
                    } else if (t < 0 || reach > 12.3) {
                        wrong += count(x, y) != 0 || picture.face(x, y) != nook::no_face;
                    }
                }
            CHECK(wrong == 0);
            CHECK(checked > 100);
        }
    }
}

TEST_CASE("a plane facing the viewer has its exact distance and normal, from either winding")
{
    for (const bool flipped : {false, true}) {
        for (const bool orthographic : {false, true}) {
            Mesh mesh;
            mesh.triangle({-9, -9, 0}, {9, -9, 0}, {0, 18, 0});
            if (flipped) std::swap(mesh.indices[0], mesh.indices[1]);
            const Camera camera{.eye = {0, 0, 3}, .orthographic = orthographic};
            const Picture picture =
                draw(mesh, nook::view_frame(camera), nook::projection(camera, 7, 5), 7, 5);
            for (int y = 0; y < 5; ++y)
                for (int x = 0; x < 7; ++x) {
                    CHECK(picture.depth(x, y) == 3);
                    CHECK(picture.normal(3 * x, y) == 0);
                    CHECK(picture.normal(3 * x + 1, y) == 0);
                    CHECK(picture.normal(3 * x + 2, y) == 1);
                    CHECK(picture.face(x, y) == 0);
                }
        }
    }
}

TEST_CASE("interpolated normals are perspective-correct and keep to the viewer's side")
{
    // A tilted floor whose vertex normals vary linearly over it, drawn as it is and subdivided.
    const Camera camera{.eye = {0, 1, 2}, .target = {0, 0, 0}};
    const ViewFrame frame = nook::view_frame(camera);
    const Projection projection = nook::projection(camera, 40, 30);
    const auto normal_at = [](double x, double z) -> meshes::Point {
        return {0.2 * x, 1, 0.1 * z};
    };
    const auto make = [&](int cells, std::vector<float>& normals) {
        Mesh mesh;
        for (int j = 0; j <= cells; ++j)
            for (int i = 0; i <= cells; ++i) {
                const double x = 3.0 * i / cells - 1.5, z = 3.0 * j / cells - 1.5;
                mesh.vertex({x, 0, z});
                for (const double c : normal_at(x, z)) normals.push_back(static_cast<float>(c));
            }
        for (int j = 0; j < cells; ++j)
            for (int i = 0; i < cells; ++i) {
                const auto a = static_cast<std::uint32_t>(j * (cells + 1) + i);
                const auto c = a + static_cast<std::uint32_t>(cells) + 1;
                mesh.face(a, a + 1, c + 1);
                mesh.face(c + 1, c, a);
            }
        return mesh;
    };
    for (const bool down : {false, true}) {
        std::vector<float> coarse_normals, fine_normals;
        const Mesh coarse = make(2, coarse_normals), fine = make(64, fine_normals);
        if (down)
            for (auto* normals : {&coarse_normals, &fine_normals})
                for (float& c : *normals) c = -c;
        const auto render = [&](const Mesh& mesh, const std::vector<float>& normals) {
            Picture picture{40, 30};
            nook::MeshView view = mesh.view();
            view.normals = normals.data();
            REQUIRE(nook::rasterise(view, frame, projection, picture.buffers(),
                                    {.interpolate_normals = true}));
            return picture;
        };
        const Picture a = render(coarse, coarse_normals), b = render(fine, fine_normals);
        int compared = 0;
        double worst = 0;
        for (int y = 0; y < 30; ++y)
            for (int x = 0; x < 40; ++x) {
                if (a.face(x, y) == nook::no_face || b.face(x, y) == nook::no_face) continue;
                ++compared;
                double length = 0;
                for (int k = 0; k < 3; ++k) {
                    const double n = double{a.normal(3 * x + k, y)};
                    length += n * n;
                    worst = (std::max)(worst, std::fabs(n - double{b.normal(3 * x + k, y)}));
                }
                CHECK(std::fabs(length - 1) < 1e-6);
                CHECK(a.normal(3 * x + 2, y) > 0);
            }
        CHECK(compared > 300);
        // Normalising at the vertices bends the linear field a little.
        CHECK(worst < 0.02);
    }
}

TEST_CASE("interpolated normals are those of triangles shaded one by one")
{
    using namespace nook::detail;
    std::mt19937 random{29};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (int scene = 0; scene < 24; ++scene) {
        CAPTURE(scene);
        const bool inside = scene % 3 == 0, orthographic = scene % 4 < 2, far_away = scene % 6 == 5;
        const Mesh mesh = meshes::soup(random, 200);
        std::vector<float> normals;
        for (std::size_t i = 0; i < mesh.view().vertex_count; ++i) {
            const auto n = meshes::random_direction(random);
            const float size = random() % 9 == 0   ? 0.0f
                               : random() % 9 == 0 ? not_a_number
                               : random() % 2 == 0 ? 1e-30f
                                                   : 1e30f;
            for (const double c : {n.x, n.y, n.z}) normals.push_back(size * static_cast<float>(c));
        }
        nook::MeshView view = mesh.view();
        view.normals = normals.data();
        const Camera camera{.eye = meshes::random_direction(random) * (inside     ? 0.4
                                                                       : far_away ? 3e4
                                                                                  : 3.0),
                            .orthographic = orthographic,
                            .vertical_fov = inside     ? 1.6
                                            : far_away ? 7e-5
                                                       : 0.7,
                            .near_plane = 1e-3};
        const int width = 133 + scene, height = 71;
        const ViewFrame frame = nook::view_frame(camera);
        Projection projection = nook::projection(camera, width, height);
        projection.cx += 20 * unit(random);
        Picture picture{width, height};
        REQUIRE(nook::rasterise(view, frame, projection, picture.buffers(),
                                {.interpolate_normals = true}));
        // In planes, the same bits.
        Image<float> x_plane{width, height}, y_plane{width, height}, z_plane{width, height};
        REQUIRE(nook::rasterise(
            view, frame, projection,
            {picture.depth.view(), {x_plane.view(), y_plane.view(), z_plane.view()}},
            {.interpolate_normals = true}));
        const Frame axes{frame};
        int covered = 0, wrong = 0, different = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const float drawn[3] = {picture.normal(3 * x, y), picture.normal(3 * x + 1, y),
                                        picture.normal(3 * x + 2, y)};
                different += drawn[0] != x_plane(x, y) || drawn[1] != y_plane(x, y) ||
                             drawn[2] != z_plane(x, y);
                const std::uint32_t face = picture.face(x, y);
                if (face == nook::no_face) {
                    wrong += drawn[0] != 0 || drawn[1] != 0 || drawn[2] != 0;
                    continue;
                }
                ++covered;
                Vector3 corners[3], at_corners[3] = {};
                for (std::size_t i = 0; i < 3; ++i) {
                    const std::uint32_t index = view.indices[3 * std::size_t{face} + i];
                    corners[i] = axes.direction_to_view(mesh_position(view, index) - axes.origin);
                    const Vector3 n = mesh_vector(view.normals, view.normal_stride, index);
                    if (is_finite(n)) at_corners[i] = axes.direction_to_view(normalised(n));
                }
                const TriangleSurface surface{projection, camera.near_plane, corners[0], corners[1],
                                              corners[2]};
                const double slope_x = surface.slope_x(x), slope_y = surface.slope_y(y);
                const Vector3 expected = surface.interpolate(at_corners, slope_x, slope_y,
                                                             surface.distance(slope_x, slope_y));
                const Vector3 error =
                    expected - Vector3{double{drawn[0]}, double{drawn[1]}, double{drawn[2]}};
                // Nearly edge on there are two sides to turn to.
                const Vector3 turned =
                    expected + Vector3{double{drawn[0]}, double{drawn[1]}, double{drawn[2]}};
                const bool edge_on = std::fabs(dot(expected, surface.facing())) < 1e-5;
                wrong += !(largest(error) < 2e-6 || (edge_on && largest(turned) < 2e-6));
            }
        CHECK(wrong == 0);
        CHECK(different == 0);
        CHECK(covered > 1000);
    }
}

TEST_CASE("a pixel that snapping puts outside a sliver has no share of the corner across")
{
    Mesh mesh;
    // Its upper edge lies a quarter of a unit of the grid below the centres of the row.
    mesh.triangle(on_screen(2, 5 + 0.5 + 0x1p-18), on_screen(60, 5 + 0.5 + 0x1p-18),
                  on_screen(30, 5 + 0.5 + 3 * 0x1p-18));
    const std::vector<float> normals{0, 0, 1, 0, 0, 1, 0, 0.8f, 0.6f};
    nook::MeshView view = mesh.view();
    view.normals = normals.data();
    Picture picture{64, 8};
    REQUIRE(nook::rasterise(view, screen_frame(), screen_projection(), picture.buffers(),
                            {.interpolate_normals = true}));
    int covered = 0;
    for (int x = 0; x < 64; ++x) {
        if (picture.face(x, 5) == nook::no_face) continue;
        ++covered;
        CHECK(picture.normal(3 * x + 1, 5) == 0);
        CHECK(picture.normal(3 * x + 2, 5) == 1);
    }
    CHECK(covered > 50);
}

TEST_CASE("missing, zero and infinite vertex normals leave the triangle's own")
{
    Mesh mesh;
    mesh.triangle({-9, -9, 0}, {9, -9, 0}, {0, 18, 0});
    const Camera camera{.eye = {0, 0, 3}};
    for (const float bad : {0.0f, infinity, not_a_number}) {
        const std::vector<float> normals(9, bad);
        nook::MeshView view = mesh.view();
        view.normals = normals.data();
        Picture picture{4, 4};
        REQUIRE(nook::rasterise(view, nook::view_frame(camera), nook::projection(camera, 4, 4),
                                picture.buffers(), {.interpolate_normals = true}));
        CHECK(picture.normal(2, 1) == 1);
    }
}

TEST_CASE("the near and far plane cut exactly")
{
    // A floor from the viewer's feet to far away, and the wall at its end.
    Mesh mesh;
    mesh.quad({-50, -1, 10}, {50, -1, 10}, {50, -1, -100}, {-50, -1, -100});
    Camera camera{.eye = {0, 0, 0}, .target = {0, 0, -1}, .near_plane = 3, .far_plane = 20};
    const ViewFrame frame = nook::view_frame(camera);
    const Projection projection = nook::projection(camera, 32, 256);
    const Picture picture = draw(mesh, frame, projection, 32, 256);
    int in_range = 0;
    for (int y = 0; y < 256; ++y) {
        const double slope = (y + 0.5 - projection.cy) / projection.fy;
        const double distance = 1 / slope;
        const bool visible = slope > 0 && distance > 3 && distance < 20;
        in_range += visible;
        CHECK((picture.face(16, y) != nook::no_face) == visible);
        if (visible) CHECK(std::fabs(double{picture.depth(16, y)} / distance - 1) < 0x1p-23);
    }
    CHECK(in_range > 50);
    // The option cuts as the projection does; the farther of both holds.
    camera.near_plane = 0;
    Picture other{32, 256};
    REQUIRE(nook::rasterise(mesh.view(), frame, nook::projection(camera, 32, 256), other.buffers(),
                            {.near_plane = 3}));
    CHECK(other == picture);
}

TEST_CASE("the viewer may stand in a triangle's plane or on its vertex")
{
    Mesh mesh;
    mesh.triangle({0, 0, 0}, {1, 0, -5}, {-1, 0, -5});
    mesh.triangle({0, 0, 0}, {1, 1, -5}, {-1, 1, -5});
    mesh.box({-10, -10, -10}, {10, 10, 10});
    const Camera camera{.eye = {0, 0, 0}, .target = {0, 0, -1}, .vertical_fov = 2};
    const Picture picture =
        draw(mesh, nook::view_frame(camera), nook::projection(camera, 33, 33), 33, 33);
    for (const float d : picture.depth) {
        CHECK(d > 0);
        CHECK(d <= 10);
    }
    CHECK(std::count(picture.face.begin(), picture.face.end(), nook::no_face) == 0);
}

TEST_CASE("triangles seen almost edge on keep to their own range of distances")
{
    std::mt19937 random{9};
    std::uniform_real_distribution<double> unit{-1, 1};
    int drawn = 0, outside = 0;
    for (int i = 0; i < 500; ++i) {
        const bool orthographic = i % 2 == 0;
        // A plane through the viewer's line of sight, but for a little.
        const double tilt = std::pow(10.0, -4 + 3 * unit(random));
        Mesh mesh;
        const auto corner = [&]() -> meshes::Point {
            const double along = 4 * unit(random), across = unit(random);
            return {across, tilt * along + 0.1 * across, -5 + along};
        };
        const meshes::Point a = corner(), b = corner(), c = corner();
        mesh.triangle(a, b, c);
        const double low = -(std::max)({a[2], b[2], c[2]}), high = -(std::min)({a[2], b[2], c[2]});
        const Camera camera{.eye = {0, 0, 0}, .target = {0, 0, -1}, .orthographic = orthographic};
        Projection projection = nook::projection(camera, 32, 32);
        // The widest picture has the coarsest grid.
        projection.cx += unit(random);
        Image<float> wide{32768, 1};
        projection.fx *= 1024;
        projection.cx *= 1024;
        projection.cy = 0.5 + 0.01 * unit(random);
        REQUIRE(nook::rasterise(mesh.view(), nook::view_frame(camera), projection, {wide.view()}));
        for (const float d : wide) {
            if (d == infinity) continue;
            ++drawn;
            outside += double{d} < low * (1 - 1e-6) || double{d} > high * (1 + 1e-6);
        }
    }
    CHECK(outside == 0);
    CHECK(drawn > 1000);
}

TEST_CASE("the nearest triangle wins, and the lowest face among equals")
{
    Mesh mesh;
    for (const double z : {0.0, 1.0, 1.0, -1.0})
        mesh.triangle({-90, -90, z}, {90, -90, z}, {0, 180, z});
    const Camera camera{.eye = {0, 0, 3}};
    const Picture picture =
        draw(mesh, nook::view_frame(camera), nook::projection(camera, 9, 9), 9, 9);
    for (const std::uint32_t face : picture.face) CHECK(face == 1);
    for (const float d : picture.depth) CHECK(d == 2);
}

TEST_CASE("unusable triangles leave the others as they are")
{
    std::mt19937 random{4};
    Mesh good = meshes::soup(random, 40);
    Mesh bad = good;
    bad.triangle({0, 0, not_a_number}, {1, 0, 0}, {0, 1, 0});
    bad.triangle({0, 0, infinity}, {1, 0, 0}, {0, 1, 0});
    bad.triangle({0, 0, 0.5}, {0, 0, 0.5}, {0, 1, 0});
    bad.triangle({0, 0, 0.5}, {0, 0, 0.5}, {0, 0, 0.5});
    bad.triangle({-1, -1, -1}, {0, 0, 0}, {1, 1, 1});
    const Camera camera{.eye = {0, 0, 3}};
    const ViewFrame frame = nook::view_frame(camera);
    const Projection projection = nook::projection(camera, 64, 64);
    CHECK(draw(bad, frame, projection, 64, 64) == draw(good, frame, projection, 64, 64));
}

TEST_CASE("huge and tiny triangles are drawn as they are")
{
    for (const double scale : {1e-30, 1e-6, 1.0, 1e6, 1e18, 1e30}) {
        CAPTURE(scale);
        Mesh mesh;
        mesh.triangle({-1e3 * scale, -1 * scale, -1e3 * scale},
                      {1e3 * scale, -1 * scale, -1e3 * scale}, {0, -1 * scale, 1e3 * scale});
        const Camera camera{.eye = {0, 0, 0}, .target = {0, -scale, -scale}};
        const ViewFrame frame = nook::view_frame(camera);
        const Projection projection = nook::projection(camera, 31, 31);
        const Picture picture = draw(mesh, frame, projection, 31, 31);
        CHECK(std::fabs(double{picture.depth(15, 15)} / (scale * std::sqrt(2.0)) - 1) < 2e-7);
        CHECK(std::count(picture.face.begin(), picture.face.end(), 0u) == 31 * 31);
    }
}

TEST_CASE("pictures of one pixel, one row and the largest width")
{
    const Mesh ball = meshes::icosphere(2);
    const Camera camera{.eye = {0, 0, 3}};
    for (const auto& size : {std::pair{1, 1}, {1, 40}, {40, 1}, {32768, 1}, {1, 32768}}) {
        const int width = size.first, height = size.second;
        CAPTURE(width);
        CAPTURE(height);
        const ViewFrame frame = nook::view_frame(camera);
        Projection projection = nook::projection(camera, width, height);
        projection.cx = width / 2 + 0.5;
        projection.cy = height / 2 + 0.5;
        const Picture picture = draw(ball, frame, projection, width, height);
        const Comparison result = compare(picture, ball, frame, projection);
        CHECK(result.wrong == 0);
        CHECK(picture.face(width / 2, height / 2) != nook::no_face);
    }
}

TEST_CASE("tiles cut from one view by its principal point fit together")
{
    std::mt19937 random{5};
    const Mesh mesh = meshes::soup(random, 100);
    const Camera camera{.eye = {0, 0.4, 3}};
    const ViewFrame frame = nook::view_frame(camera);
    const Projection whole = nook::projection(camera, 64, 64);
    const Picture all = draw(mesh, frame, whole, 64, 64);
    for (const int left : {0, 32})
        for (const int top : {0, 32}) {
            Projection part = whole;
            part.cx -= left;
            part.cy -= top;
            const Picture tile = draw(mesh, frame, part, 32, 32);
            for (int y = 0; y < 32; ++y)
                for (int x = 0; x < 32; ++x) {
                    REQUIRE(tile.face(x, y) == all.face(left + x, top + y));
                    if (tile.face(x, y) == nook::no_face) continue;
                    // One step of a float at most.
                    const float depth = all.depth(left + x, top + y);
                    CHECK(std::fabs(tile.depth(x, y) - depth) <= depth * 0x1p-23f);
                }
        }
}

TEST_CASE("outputs may be flipped, interleaved, unaligned, or not there")
{
    std::mt19937 random{6};
    const Mesh mesh = meshes::soup(random, 60);
    const Camera camera{.eye = {0, 0, 3}};
    const int width = 21, height = 17;
    const ViewFrame frame = nook::view_frame(camera);
    const Projection projection = nook::projection(camera, width, height);
    const Picture plain = draw(mesh, frame, projection, width, height);

    SUBCASE("bottom-up, all in one interleaved buffer of x, y, z, depth")
    {
        std::vector<float> buffer(4 * width * height + 8, -7.0f);
        float* const last = buffer.data() + 4 + 4 * width * (height - 1);
        const std::ptrdiff_t up = -4 * width;
        const GBuffer buffers{{last + 3, width, height, up, 4},
                              nook::ImageView3<float>::interleaved(last, width, height, up, 4),
                              {}};
        REQUIRE(nook::rasterise(mesh.view(), frame, projection, buffers));
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                CHECK(buffers.depth(x, y) == plain.depth(x, y));
                CHECK(buffers.normal.y(x, y) == plain.normal(3 * x + 1, y));
            }
        for (std::size_t i = 0; i < 4; ++i) {
            CHECK(buffer[i] == -7);
            CHECK(buffer[buffer.size() - 1 - i] == -7);
        }
    }
    SUBCASE("depth alone")
    {
        Image<float> depth{width, height};
        REQUIRE(nook::rasterise(mesh.view(), frame, projection, {depth.view()}));
        CHECK(depth == plain.depth);
    }
}

TEST_CASE("threads and borrowed scratch do not change a bit")
{
    std::mt19937 random{7};
    const Mesh mesh = meshes::soup(random, 9000);
    const Camera camera{.eye = {0, 0, 2}};
    const ViewFrame frame = nook::view_frame(camera);
    const Projection projection = nook::projection(camera, 150, 130);
    const Picture plain = draw(mesh, frame, projection, 150, 130);
    nook::ThreadExecutor threads{4};
    std::vector<std::byte> block(nook::rasterise_scratch_size(mesh.view()));
    Picture picture{150, 130};
    const nook::Outcome done =
        nook::rasterise(mesh.view(), frame, projection, picture.buffers(), {},
                        nook::Scratch{block.data(), block.size()}, threads);
    REQUIRE(done);
    CHECK(picture == plain);
    CHECK(done.work.pixels == 150 * 130);
    CHECK(done.work.background == static_cast<std::uint64_t>(std::count(
                                      plain.face.begin(), plain.face.end(), nook::no_face)));
    const nook::Outcome cramped =
        nook::rasterise(mesh.view(), frame, projection, picture.buffers(), {},
                        nook::Scratch{block.data(), block.size() - 1});
    CHECK(cramped.error.code == nook::ErrorCode::scratch_too_small);
    CHECK(picture == plain);
}

TEST_CASE("no mesh gives background, no pixel gives success")
{
    const ViewFrame frame = nook::view_frame({});
    const Projection projection = nook::projection({}, 5, 4);
    Picture picture{5, 4};
    const nook::Outcome done = nook::rasterise({}, frame, projection, picture.buffers());
    REQUIRE(done);
    CHECK(done.work.background == 20);
    for (const float d : picture.depth) CHECK(d == infinity);
    for (const float n : picture.normal) CHECK(n == 0);
    for (const std::uint32_t f : picture.face) CHECK(f == nook::no_face);
    CHECK(nook::rasterise(meshes::icosphere(0).view(), frame, projection, GBuffer{}));
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    Mesh mesh = meshes::icosphere(0);
    const ViewFrame frame = nook::view_frame({});
    const Projection projection = nook::projection({}, 5, 4);
    Picture picture{5, 4};
    const Picture untouched = picture;
    const auto rejected = [&](const nook::Outcome& outcome) {
        CHECK(picture == untouched);
        return std::string{outcome.error.argument};
    };
    const GBuffer buffers = picture.buffers();
    GBuffer changed = buffers;
    changed.depth.data = nullptr;
    CHECK(rejected(nook::rasterise(mesh.view(), frame, projection, changed)) == "buffers.depth");
    changed = buffers;
    changed.face.width = 4;
    CHECK(rejected(nook::rasterise(mesh.view(), frame, projection, changed)) == "buffers.face");
    changed = buffers;
    changed.normal.z = changed.normal.y;
    CHECK(rejected(nook::rasterise(mesh.view(), frame, projection, changed)) == "buffers.normal.z");
    changed = buffers;
    changed.normal.x = buffers.depth;
    CHECK(rejected(nook::rasterise(mesh.view(), frame, projection, changed)) == "buffers.normal.x");
    changed = {{picture.depth.data(), 32769, 0}, {}, {}};
    CHECK(rejected(nook::rasterise(mesh.view(), frame, projection, changed)) == "buffers.depth");
    Projection bad = projection;
    bad.fx = 0;
    CHECK(rejected(nook::rasterise(mesh.view(), frame, bad, buffers)) == "projection.fx");
    ViewFrame bent = frame;
    bent.up.x = std::numeric_limits<double>::quiet_NaN();
    CHECK(rejected(nook::rasterise(mesh.view(), bent, projection, buffers)) == "frame.up");
    CHECK(rejected(nook::rasterise(mesh.view(), frame, projection, buffers, {.near_plane = -1})) ==
          "options.near_plane");
    mesh.indices[7] = 99;
    const nook::Outcome index = nook::rasterise(mesh.view(), frame, projection, buffers);
    CHECK(rejected(index) == "mesh.indices");
    CHECK(index.error.code == nook::ErrorCode::index_out_of_range);
    CHECK(index.error.value == 99);
}

TEST_CASE("drawn depths survive each encoding within its step")
{
    std::mt19937 random{8};
    const Mesh mesh = meshes::soup(random, 60);
    for (const bool orthographic : {false, true}) {
        Camera camera{
            .eye = {0, 0, 3}, .orthographic = orthographic, .near_plane = 0.5, .far_plane = 50};
        const Picture picture =
            draw(mesh, nook::view_frame(camera), nook::projection(camera, 24, 24), 24, 24);
        using enum nook::DepthEncoding;
        for (const auto encoding : {linear, negative_z, standard, reversed, opengl, logarithmic}) {
            camera.encoding = encoding;
            const Projection projection = nook::projection(camera, 24, 24);
            Image<float> stored{24, 24};
            const nook::Outcome done =
                nook::encode_depths(picture.depth.view(), stored.view(), projection);
            REQUIRE(done);
            const auto source = nook::hardware_depth(stored.view(), projection);
            for (int y = 0; y < 24; ++y)
                for (int x = 0; x < 24; ++x) {
                    const float decoded = nook::surface_distance(source, x, y);
                    const double depth = double{picture.depth(x, y)};
                    if (picture.face(x, y) == nook::no_face) CHECK(decoded == 0);
                    else CHECK(std::fabs(double{decoded} - depth) <= source.step(depth));
                }
        }
    }
}
