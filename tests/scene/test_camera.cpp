#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <nook/scene/camera.hpp>

#include "meshes.hpp"

namespace {

double distance(const glm::dvec3& a, const glm::dvec3& b)
{
    return std::sqrt((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) +
                     (a.z - b.z) * (a.z - b.z));
}
double dot(const glm::dvec3& a, const glm::dvec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

void check_frame(const nook::ViewFrame& frame)
{
    CHECK(std::fabs(dot(frame.right, frame.right) - 1) < 1e-15 * 4);
    CHECK(std::fabs(dot(frame.up, frame.up) - 1) < 1e-15 * 4);
    CHECK(std::fabs(dot(frame.back, frame.back) - 1) < 1e-15 * 4);
    CHECK(std::fabs(dot(frame.right, frame.up)) < 1e-15 * 4);
    CHECK(std::fabs(dot(frame.right, frame.back)) < 1e-15 * 4);
    CHECK(std::fabs(dot(frame.up, frame.back)) < 1e-15 * 4);
    const auto& r = frame.right;
    const auto& u = frame.up;
    const glm::dvec3 cross{r.y * u.z - r.z * u.y, r.z * u.x - r.x * u.z, r.x * u.y - r.y * u.x};
    CHECK(dot(cross, frame.back) > 0.999);
}

}  // namespace

TEST_CASE("a camera on the z axis looks along -z, with x to the right and y up")
{
    const nook::ViewFrame frame = nook::view_frame({.eye = {0, 0, 5}});
    CHECK(distance(frame.right, {1, 0, 0}) == 0);
    CHECK(distance(frame.up, {0, 1, 0}) == 0);
    CHECK(distance(frame.back, {0, 0, 1}) == 0);
    const glm::dvec3 view = nook::point_to_view(frame, {1, 2, 3});
    CHECK(distance(view, {1, 2, -2}) == 0);
}

TEST_CASE("axes are orthonormal and right-handed, and view to world inverts world to view")
{
    std::mt19937 random{1};
    std::uniform_real_distribution<double> coordinate{-10, 10};
    for (int i = 0; i < 200; ++i) {
        const double shift = i % 2 == 0 ? 0 : 1e6;
        const nook::Camera camera{
            .eye = {coordinate(random) + shift, coordinate(random), coordinate(random)},
            .target = {coordinate(random) + shift, coordinate(random), coordinate(random)}};
        const nook::ViewFrame frame = nook::view_frame(camera);
        check_frame(frame);
        const glm::dvec3 p{coordinate(random) + shift, coordinate(random), coordinate(random)};
        CHECK(distance(nook::point_to_world(frame, nook::point_to_view(frame, p)), p) <
              1e-15 * (40 + 4 * shift));
        const glm::dvec3 target = nook::point_to_view(frame, camera.target);
        CHECK(std::fabs(target.x) + std::fabs(target.y) < 1e-13);
        CHECK(target.z < 0);
        const glm::dvec3 up = nook::direction_to_view(frame, {0, 1, 0});
        CHECK(std::fabs(up.x) < 1e-15);
        CHECK(up.y > 0);
    }
}

TEST_CASE("an up vector along the view axis, or zero, gives way to a fixed one")
{
    const nook::ViewFrame down = nook::view_frame({.eye = {3, 9, 2}, .target = {3, 0, 2}});
    check_frame(down);
    CHECK(distance(down.up, {0, 0, -1}) == 0);
    CHECK(distance(down.right, {1, 0, 0}) == 0);
    const nook::ViewFrame up = nook::view_frame({.eye = {0, 0, 0}, .target = {0, 7, 0}});
    check_frame(up);
    CHECK(distance(up.up, {0, 0, 1}) == 0);
    const nook::ViewFrame along =
        nook::view_frame({.eye = {0, 0, 4}, .target = {0, 0, 0}, .up = {0, 0, 1}});
    check_frame(along);
    CHECK(distance(along.up, {0, 1, 0}) == 0);
    check_frame(nook::view_frame({.eye = {1, 2, 4}, .up = {0, 0, 0}}));
    check_frame(nook::view_frame({.eye = {1e-30, 1e30, 0}, .up = {0, 1e-300, 0}}));
}

TEST_CASE("the field of view spans the height of the picture")
{
    const nook::Camera camera{.vertical_fov = 1};
    const nook::Projection p = nook::projection(camera, 640, 360);
    const double half = std::tan(0.5) * 7;
    CHECK(std::fabs(nook::pixel_point(p, {0, half, -7}).y) < 1e-12);
    CHECK(std::fabs(nook::pixel_point(p, {0, -half, -7}).y - 360) < 1e-12);
    CHECK(std::fabs(nook::pixel_point(p, {half, 0, -7}).x - (320 + 180)) < 1e-12);

    const nook::Projection flat =
        nook::projection({.orthographic = true, .view_height = 3}, 640, 360);
    CHECK(flat.orthographic);
    CHECK(std::fabs(nook::pixel_point(flat, {0, 1.5, -2}).y) < 1e-12);
    CHECK(std::fabs(nook::pixel_point(flat, {0, 1.5, -200}).y) < 1e-12);
}

TEST_CASE("a camera that cannot see is an error that names the field")
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    const auto rejected = [](const nook::Camera& camera) {
        return std::string{nook::check_camera(camera).argument};
    };
    CHECK(rejected({}) == "");
    CHECK(rejected({.eye = {0, nan, 0}}) == "camera.eye");
    CHECK(rejected({.target = {infinity, 0, 0}}) == "camera.target");
    CHECK(rejected({.eye = {1, 2, 3}, .target = {1, 2, 3}}) == "camera.target");
    CHECK(rejected({.up = {nan, 0, 0}}) == "camera.up");
    CHECK(rejected({.up = {0, 0, 0}}) == "");
    CHECK(rejected({.vertical_fov = 0}) == "camera.vertical_fov");
    CHECK(rejected({.vertical_fov = std::numbers::pi}) == "camera.vertical_fov");
    CHECK(rejected({.vertical_fov = nan}) == "camera.vertical_fov");
    CHECK(rejected({.orthographic = true, .view_height = 0}) == "camera.view_height");
    // So small that the scale of the picture overflows.
    CHECK(rejected({.vertical_fov = 1e-320}) == "camera.vertical_fov");
    CHECK(rejected({.orthographic = true, .view_height = 1e-320}) == "camera.view_height");
    CHECK(rejected({.near_plane = -1}) == "camera.near_plane");
    CHECK(rejected({.near_plane = 2, .far_plane = 1}) == "camera.far_plane");
    CHECK(rejected({.far_plane = nan}) == "camera.far_plane");
    using enum nook::DepthEncoding;
    CHECK(rejected({.near_plane = 0, .encoding = standard}) == "camera.near_plane");
    CHECK(rejected({.near_plane = 1, .encoding = reversed}) == "");
    CHECK(rejected({.encoding = logarithmic}) == "camera.far_plane");
    CHECK(rejected({.far_plane = 9, .encoding = logarithmic, .logarithmic_scale = 0}) ==
          "camera.logarithmic_scale");
    CHECK(rejected({.orthographic = true, .encoding = standard}) == "camera.far_plane");
}
