#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <doctest/doctest.h>

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <nook/depth/hardware_depth.hpp>
#include <nook/depth/projection.hpp>

#include "projections.hpp"

using nook::DepthEncoding;
using nook::ErrorCode;
using nook::Projection;
using projections::infinity;
using projections::make;

TEST_SUITE("depth/projection")
{
    TEST_CASE("pixel and view space are inverse to each other")
    {
        std::mt19937 random{2};
        std::uniform_real_distribution<double> anywhere(-1000, 1000);
        for (const bool orthographic : {false, true}) {
            const Projection projection = make(DepthEncoding::linear, orthographic, 0, infinity);
            for (int i = 0; i < 1000; ++i) {
                const double x = anywhere(random), y = anywhere(random);
                const double distance = std::exp(anywhere(random) / 100);
                const nook::ViewPoint point = nook::view_point(projection, x, y, distance);
                CHECK(point.z == -distance);
                const nook::PixelPoint pixel = nook::pixel_point(projection, point);
                CHECK(std::fabs(pixel.x - x) < 1e-11 * 2000);
                CHECK(std::fabs(pixel.y - y) < 1e-11 * 2000);
                CHECK(pixel.distance == distance);
            }
        }
    }

    TEST_CASE("right in view space is right in the picture, and up is up")
    {
        for (const bool orthographic : {false, true}) {
            const Projection projection = make(DepthEncoding::linear, orthographic, 0, infinity);
            CHECK(nook::pixel_point(projection, {0, 0, -5}).x == projection.cx);
            CHECK(nook::pixel_point(projection, {0, 0, -5}).y == projection.cy);
            CHECK(nook::pixel_point(projection, {1, 0, -5}).x > projection.cx);
            CHECK(nook::pixel_point(projection, {0, 1, -5}).y < projection.cy);
        }
    }

    TEST_CASE("a length covers pixels by its slope, under orthography at any distance")
    {
        const Projection perspective = make(DepthEncoding::linear, false, 0, infinity);
        CHECK(nook::pixels_per_length(perspective, 2, 10).x == 100);
        CHECK(nook::pixels_per_length(perspective, 2, 10).y == 80);
        const Projection orthographic = make(DepthEncoding::linear, true, 0, infinity);
        CHECK(nook::pixels_per_length(orthographic, 2, 10).x == 1000);
        CHECK(nook::pixels_per_length(orthographic, 2, 1e9).x == 1000);
    }

    TEST_CASE("a projection with a bad field is refused by its name")
    {
        const Projection good = make(DepthEncoding::standard, false, 0.1, 100);
        CHECK_FALSE(nook::check_projection(good, true));
        const auto refused = [&](auto change) {
            Projection bad = good;
            change(bad);
            const nook::Error error = nook::check_projection(bad, true);
            CHECK(error.code == ErrorCode::bad_value);
            return std::string{error.argument};
        };
        const double nan = std::numeric_limits<double>::quiet_NaN();
        for (const double value : {0.0, -1.0, infinity, nan}) {
            CHECK(refused([&](Projection& p) { p.fx = value; }) == "projection.fx");
            CHECK(refused([&](Projection& p) { p.fy = value; }) == "projection.fy");
            CHECK(refused([&](Projection& p) { p.near_plane = value; }) == "projection.near_plane");
        }
        for (const double value : {infinity, nan}) {
            CHECK(refused([&](Projection& p) { p.cx = value; }) == "projection.cx");
            CHECK(refused([&](Projection& p) { p.cy = value; }) == "projection.cy");
        }
        for (const double value : {0.1, 0.0, -infinity, nan})
            CHECK(refused([&](Projection& p) { p.far_plane = value; }) == "projection.far_plane");
        CHECK(refused([](Projection& p) {
                  p.orthographic = true;
                  p.far_plane = infinity;
              }) == "projection.far_plane");
        CHECK(refused([](Projection& p) {
                  p.encoding = DepthEncoding::logarithmic;
                  p.far_plane = infinity;
              }) == "projection.far_plane");
        CHECK(refused([](Projection& p) {
                  p.encoding = DepthEncoding::logarithmic;
                  p.logarithmic_scale = 0;
              }) == "projection.logarithmic_scale");
        // The planes do not matter to who only converts pixels.
        Projection pixels = good;
        pixels.near_plane = -1;
        CHECK_FALSE(nook::check_projection(pixels));
    }

    TEST_CASE("a near plane at or behind the viewer is fine under orthography")
    {
        for (const double near_plane : {0.0, -5.0}) {
            const Projection projection = make(DepthEncoding::reversed, true, near_plane, 10);
            CHECK_FALSE(nook::check_projection(projection, true));
            const auto decode = nook::HardwareDecode<nook::FloatStorage<float>>(projection);
            CHECK(double{decode(0.5f)} == (near_plane + 10) / 2);
        }
    }
}

namespace {

struct Known {
    const char* name;
    glm::mat4 matrix;
    nook::ClipSpace clip;
    Projection projection;
};

// What a point becomes through the matrix as a renderer applies it: window position and depth.
struct Window {
    double x, y, depth;
};
Window through(const Known& known, double x, double y, double z, int width, int height)
{
    glm::dvec4 clip{0};
    const double point[] = {x, y, z, 1};
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            clip[row] += double{known.matrix[column][row]} * point[column];
    const double up = known.clip.y_down ? -1 : 1;
    const double depth = clip.z / clip.w;
    return {(clip.x / clip.w + 1) / 2 * width, (1 - up * clip.y / clip.w) / 2 * height,
            known.clip.depth_from_minus_one ? (depth + 1) / 2 : depth};
}

glm::mat4 reverse_depth(glm::mat4 matrix)
{
    for (int column = 0; column < 4; ++column)
        matrix[column][2] = matrix[column][3] - matrix[column][2];
    return matrix;
}

}  // namespace

TEST_SUITE("depth/projection from a matrix")
{
    TEST_CASE("a matrix of GLM gives the projection that it applies")
    {
        constexpr int width = 640, height = 360;
        constexpr float fov = 1.1f, aspect = 16.0f / 9;
        const nook::ClipSpace zo{}, no{.depth_from_minus_one = true}, down{.y_down = true};
        glm::mat4 flipped = glm::perspectiveRH_ZO(fov, aspect, 0.1f, 100.0f);
        flipped[1][1] = -flipped[1][1];
        glm::mat4 infinite_reversed{0};
        infinite_reversed[0][0] = 1.2f;
        infinite_reversed[1][1] = 2.1f;
        infinite_reversed[2][3] = -1;
        infinite_reversed[3][2] = 0.1f;
        glm::mat4 infinite_zo = glm::infinitePerspectiveRH(fov, aspect, 0.1f);
        const auto planes = [](DepthEncoding encoding, double n, double f, bool ortho = false) {
            return make(encoding, ortho, n, f);
        };
        const auto standard = planes(DepthEncoding::standard, 0.1, 100);
        const auto reversed = planes(DepthEncoding::reversed, 0.1, 100);
        const Known all[] = {
            {"perspectiveRH_ZO", glm::perspectiveRH_ZO(fov, aspect, 0.1f, 100.0f), zo, standard},
            {"perspectiveLH_ZO", glm::perspectiveLH_ZO(fov, aspect, 0.1f, 100.0f), zo, standard},
            {"perspectiveRH_NO", glm::perspectiveRH_NO(fov, aspect, 0.1f, 100.0f), no, standard},
            {"perspectiveLH_NO", glm::perspectiveLH_NO(fov, aspect, 0.1f, 100.0f), no, standard},
            {"planes exchanged", glm::perspectiveRH_ZO(fov, aspect, 100.0f, 0.1f), zo, reversed},
            {"planes exchanged LH", glm::perspectiveLH_ZO(fov, aspect, 100.0f, 0.1f), zo, reversed},
            {"reversed", reverse_depth(glm::perspectiveRH_ZO(fov, aspect, 0.1f, 100.0f)), zo,
             reversed},
            {"infinite, OpenGL", infinite_zo, no, planes(DepthEncoding::standard, 0.1, infinity)},
            {"infinite LH", glm::infinitePerspectiveLH(fov, aspect, 0.1f), no,
             planes(DepthEncoding::standard, 0.1, infinity)},
            {"infinite reversed", infinite_reversed, zo,
             planes(DepthEncoding::reversed, 0.1, infinity)},
            {"Vulkan", flipped, down, standard},
            {"frustumRH_ZO", glm::frustumRH_ZO(-0.05f, 0.1f, -0.02f, 0.08f, 0.1f, 100.0f), zo,
             standard},
            {"frustumLH_ZO", glm::frustumLH_ZO(-0.05f, 0.1f, -0.02f, 0.08f, 0.1f, 100.0f), zo,
             standard},
            {"frustumRH_NO", glm::frustumRH_NO(-0.05f, 0.1f, -0.02f, 0.08f, 0.1f, 100.0f), no,
             standard},
            {"orthoRH_ZO", glm::orthoRH_ZO(-3.0f, 5.0f, -2.0f, 4.0f, 0.5f, 40.0f), zo,
             planes(DepthEncoding::standard, 0.5, 40, true)},
            {"orthoLH_ZO", glm::orthoLH_ZO(-3.0f, 5.0f, -2.0f, 4.0f, 0.5f, 40.0f), zo,
             planes(DepthEncoding::standard, 0.5, 40, true)},
            {"orthoRH_NO", glm::orthoRH_NO(-3.0f, 5.0f, -2.0f, 4.0f, 0.5f, 40.0f), no,
             planes(DepthEncoding::standard, 0.5, 40, true)},
            {"ortho from the viewer on", glm::orthoRH_ZO(-3.0f, 5.0f, -2.0f, 4.0f, 0.0f, 40.0f), zo,
             planes(DepthEncoding::standard, 0, 40, true)},
            {"ortho reversed",
             reverse_depth(glm::orthoRH_ZO(-3.0f, 5.0f, -2.0f, 4.0f, 0.5f, 40.0f)), zo,
             planes(DepthEncoding::reversed, 0.5, 40, true)},
            {"ortho LH reversed",
             reverse_depth(glm::orthoLH_ZO(-3.0f, 5.0f, -2.0f, 4.0f, 0.5f, 40.0f)), zo,
             planes(DepthEncoding::reversed, 0.5, 40, true)},
        };
        for (const Known& known : all) {
            CAPTURE(std::string{known.name});
            Projection found;
            const nook::Error error = nook::projection_from_matrix(
                glm::value_ptr(known.matrix), width, height, known.clip, found);
            REQUIRE_FALSE(error);
            CHECK(found.orthographic == known.projection.orthographic);
            CHECK(found.encoding == known.projection.encoding);
            const double near_plane = known.projection.near_plane;
            const double far_plane = known.projection.far_plane;
            CHECK(std::fabs(found.near_plane - near_plane) <= 2e-6);
            if (far_plane == infinity) CHECK(found.far_plane == infinity);
            else if (found.orthographic) CHECK(std::fabs(found.far_plane / far_plane - 1) <= 1e-6);
            else {
                // A float matrix tells the far plane to f/n ulps.
                CHECK(std::fabs(1 / found.far_plane - 1 / far_plane) <= 2 * 0x1p-23 / near_plane);
            }

            const double hand = double{known.matrix[2][3]};
            const bool left = found.orthographic ? (known.matrix[2][2] > 0) !=
                                                       (found.encoding == DepthEncoding::reversed)
                                                 : hand > 0;
            for (const double distance : {1.0, 3.0, 30.0})
                for (const double x : {-0.7, 0.0, 1.3})
                    for (const double y : {-0.4, 0.0, 0.9}) {
                        CAPTURE(distance);
                        const Window window =
                            through(known, x, y, left ? distance : -distance, width, height);
                        const nook::PixelPoint pixel = nook::pixel_point(found, {x, y, -distance});
                        CHECK(std::fabs(pixel.x - window.x) < 1e-11);
                        CHECK(std::fabs(pixel.y - window.y) < 1e-11);
                        // Depth as a 64-bit buffer would hold it.
                        const auto decode = nook::HardwareDecode<nook::FloatStorage<double>>{found};
                        CHECK(std::fabs(decode(window.depth) / distance - 1) < 1e-12);
                    }
        }
    }

    TEST_CASE("far planes of every size are told from an infinite one")
    {
        for (const float far_plane : {1.0f, 10.0f, 1e3f, 1e4f, 1e5f}) {
            Projection found;
            const glm::mat4 matrix = glm::perspectiveRH_ZO(1.0f, 1.0f, 0.1f, far_plane);
            REQUIRE_FALSE(nook::projection_from_matrix(glm::value_ptr(matrix), 64, 64, {}, found));
            CAPTURE(far_plane);
            // −f/(f − n) is a float near −1: its spacing leaves f uncertain by f/n half-ulps.
            CHECK(std::fabs(1 / found.far_plane - 1 / double{far_plane}) <= 2 * 0x1p-23 / 0.1);
        }
    }

    TEST_CASE("what is not a projection is refused, and nothing is written")
    {
        Projection found = make(DepthEncoding::linear, false, 1, 2);
        const glm::mat4 good = glm::perspectiveRH_ZO(1.0f, 1.0f, 0.1f, 100.0f);
        const auto refused = [&](const float* matrix, int width, int height) {
            const nook::Error error =
                nook::projection_from_matrix(matrix, width, height, {}, found);
            CHECK(error);
            CHECK(found.fx == 500);
            CHECK(found.near_plane == 1);
            return error;
        };
        CHECK(refused(nullptr, 10, 10).code == ErrorCode::null_data);
        CHECK(refused(glm::value_ptr(good), 0, 10).argument == std::string{"width"});
        CHECK(refused(glm::value_ptr(good), 10, -1).argument == std::string{"height"});
        glm::mat4 bad = good;
        bad[2][2] = std::numeric_limits<float>::quiet_NaN();
        CHECK(refused(glm::value_ptr(bad), 10, 10).argument == std::string{"matrix"});
        bad = good;
        bad[2][3] = 2;
        (void)refused(glm::value_ptr(bad), 10, 10);
        bad = glm::mat4{0};
        (void)refused(glm::value_ptr(bad), 10, 10);
    }
}
