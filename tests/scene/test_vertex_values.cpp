#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string_view>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/vertex_values.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Image;

struct View {
    nook::Projection projection;
    nook::ViewFrame frame;
    Image<float> depth;
    Image<std::uint32_t> ids;

    View(const Mesh& mesh, const nook::Camera& camera, int width, int height)
        : projection{nook::projection(camera, width, height)},
          frame{nook::view_frame(camera)},
          depth{width, height},
          ids{width, height}
    {
        REQUIRE(nook::rasterise(mesh.view(), frame, projection,
                                {.depth = depth.view(), .face = ids.view()}));
    }
    /// What the pixel shows, in world space.
    [[nodiscard]] glm::dvec3 point(int x, int y) const
    {
        const auto at = nook::view_point(projection, x + 0.5, y + 0.5, double{depth(x, y)});
        return nook::point_to_world(frame, {at.x, at.y, at.z});
    }
    [[nodiscard]] bool surface(int x, int y) const { return ids(x, y) != nook::no_face; }
};

template <class Value = double>
Image<Value> draw(const Mesh& mesh, const View& view, const std::vector<float>& values,
                  const nook::WorkMap& map = {})
{
    Image<Value> output{view.ids.width(), view.ids.height(), Value{-5}};
    REQUIRE(nook::vertex_values(mesh.view(), view.ids.view(), values.data(), output.view(), {},
                                view.projection, view.frame, map));
    return output;
}

nook::Camera camera(const glm::dvec3& eye, const glm::dvec3& target, bool orthographic = false)
{
    nook::Camera result;
    result.eye = eye;
    result.target = target;
    result.orthographic = orthographic;
    result.vertical_fov = 1.1;
    result.view_height = 6;
    return result;
}

/// Large triangles at all angles, some behind the viewer of `camera`.
Mesh clutter(int count, unsigned seed)
{
    std::mt19937 random{seed};
    std::uniform_real_distribution<double> unit{-4, 4};
    const auto point = [&] { return meshes::Point{unit(random), unit(random), unit(random)}; };
    Mesh mesh;
    for (int i = 0; i < count; ++i) mesh.triangle(point(), point(), point());
    return mesh;
}

std::vector<float> noise(std::size_t count, unsigned seed)
{
    std::mt19937 random{seed};
    std::uniform_real_distribution<float> unit{0, 1};
    std::vector<float> values(count);
    for (float& value : values) value = unit(random);
    return values;
}

}  // namespace

TEST_CASE("a linear function of space at the vertices is the same function at the pixels")
{
    // Also on triangles that the near plane cuts: the eye stands among them.
    const Mesh mesh = clutter(60, 3);
    const auto linear = [](double x, double y, double z) {
        return 0.25 * x - 0.5 * y + 0.125 * z + 2;
    };
    std::vector<float> values;
    for (std::size_t i = 0; i < mesh.positions.size(); i += 3)
        values.push_back(static_cast<float>(
            linear(mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2])));
    for (const bool orthographic : {false, true})
        for (const glm::dvec3 eye : {glm::dvec3{0.3, 0.2, 9}, glm::dvec3{0.2, 0.5, 1}}) {
            CAPTURE(orthographic);
            CAPTURE(eye.z);
            const View view{mesh, camera(eye, {0, 0, -2}, orthographic), 150, 110};
            const Image<double> output = draw(mesh, view, values);
            int seen = 0, cut = 0;
            double worst = 0;
            for (int y = 0; y < 110; ++y)
                for (int x = 0; x < 150; ++x) {
                    if (!view.surface(x, y)) {
                        CHECK(output(x, y) == 1);
                        continue;
                    }
                    ++seen;
                    for (std::size_t k = 0; k < 3; ++k) {
                        const float* at = mesh.positions.data() +
                                          3 * std::size_t{mesh.indices[3 * view.ids(x, y) + k]};
                        if (nook::point_to_view(view.frame, {at[0], at[1], at[2]}).z < 0) continue;
                        ++cut;
                        break;
                    }
                    // What rounds: depth and values to floats, positions to 1/65536 pixel.
                    const glm::dvec3 at = view.point(x, y);
                    worst = (std::max)(worst, std::fabs(output(x, y) - linear(at.x, at.y, at.z)));
                }
            CHECK(seen > 4000);
            CHECK(worst < 2e-4);
            if (eye.z < 4 && !orthographic) CHECK(cut > 1000);
        }
}

TEST_CASE("perspective bends a ramp as it should")
{
    // A floor that leads away: 0 at the near edge, 1 at the far one.
    Mesh mesh;
    mesh.quad({-50, 0, 0}, {50, 0, 0}, {50, 0, -8}, {-50, 0, -8});
    const View view{mesh, camera({0, 1, 1}, {0, 1, 0}), 20, 400};
    const Image<double> output = draw(mesh, view, {0, 0, 1, 1});
    // Where the ray of the row meets the floor.
    int seen = 0;
    for (int y = 0; y < 400; ++y) {
        if (!view.surface(10, y)) continue;
        const double distance = view.projection.fy / (y + 0.5 - view.projection.cy);
        CHECK(output(10, y) == doctest::Approx((distance - 1) / 8).epsilon(1e-9));
        ++seen;
    }
    CHECK(seen > 50);
}

TEST_CASE("equal values at the vertices are exact, whatever the triangles")
{
    const Mesh mesh = clutter(80, 5);
    const View view{mesh, camera({0, 1, 0.5}, {0, 0, -2}), 120, 90};
    for (const float value : {0.0f, 1.0f, 0.1f, 1.0f / 3, 1e-30f, -7.3f}) {
        const std::vector<float> values(mesh.positions.size() / 3, value);
        const Image<double> wide = draw<double>(mesh, view, values);
        const Image<float> narrow = draw<float>(mesh, view, values);
        int wrong = 0;
        for (int y = 0; y < 90; ++y)
            for (int x = 0; x < 120; ++x) {
                const double expected = view.surface(x, y) ? double{value} : 1;
                wrong += wide(x, y) != expected || double{narrow(x, y)} != expected ? 1 : 0;
            }
        CHECK(wrong == 0);
    }
}

TEST_CASE("a pixel lies between the values of its triangle")
{
    const Mesh mesh = clutter(300, 6);
    const std::vector<float> values = noise(mesh.positions.size() / 3, 1);
    const View view{mesh, camera({0, 0, 3}, {0, 0, 0}), 160, 120};
    const Image<float> output = draw<float>(mesh, view, values);
    int outside = 0;
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x) {
            if (!view.surface(x, y)) continue;
            const std::uint32_t* index = mesh.indices.data() + 3 * std::size_t{view.ids(x, y)};
            const auto [least, most] =
                std::minmax({values[index[0]], values[index[1]], values[index[2]]});
            outside += output(x, y) < least || output(x, y) > most ? 1 : 0;
        }
    CHECK(outside == 0);
}

TEST_CASE("multiplying is writing, times what was there")
{
    const Mesh mesh = clutter(40, 8);
    const std::vector<float> values = noise(mesh.positions.size() / 3, 2);
    const View view{mesh, camera({0, 0, 6}, {0, 0, 0}), 60, 50};
    const Image<double> written = draw(mesh, view, values);
    Image<double> output{60, 50};
    for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 60; ++x) output(x, y) = 0.01 * x + 0.3;
    output(3, 4) = std::numeric_limits<double>::quiet_NaN();
    output(30, 25) = -std::numeric_limits<double>::infinity();
    REQUIRE(nook::vertex_values(mesh.view(), view.ids.view(), values.data(), output.view(),
                                {.multiply = true}, view.projection, view.frame));
    int wrong = 0;
    for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 60; ++x) {
            const bool poisoned = (x == 3 && y == 4) || (x == 30 && y == 25);
            const double before = poisoned ? 1 : 0.01 * x + 0.3;
            wrong += output(x, y) != before * written(x, y) ? 1 : 0;
        }
    CHECK(wrong == 0);
}

TEST_CASE("ids that name no usable triangle and values that are no numbers count as 1")
{
    Mesh mesh;
    mesh.quad({-5, -5, -3}, {5, -5, -3}, {5, 5, -3}, {-5, 5, -3});
    mesh.triangle({0, 0, 0}, {0, 0, 0}, {1, 1, 1});
    mesh.triangle({0, 0, std::numeric_limits<double>::infinity()}, {0, 1, 0}, {1, 1, 1});
    View view{mesh, camera({0, 0, 1}, {0, 0, 0}), 33, 20};
    std::vector<float> values(10, 0.5f);
    view.ids(1, 1) = nook::no_face;
    view.ids(2, 1) = 4;
    view.ids(3, 1) = 2;
    view.ids(4, 1) = 3;
    view.ids(5, 1) = 0xfffffffe;
    Image<float> output{33, 20, -1};
    const nook::Outcome outcome =
        nook::vertex_values(mesh.view(), view.ids.view(), values.data(), output.view(), {},
                            view.projection, view.frame);
    REQUIRE(outcome);
    CHECK(outcome.work.pixels == 33 * 20);
    CHECK(outcome.work.background == 5);
    CHECK(outcome.work.skipped == 0);
    for (int x = 0; x < 33; ++x) CHECK(output(x, 1) == (x >= 1 && x <= 5 ? 1.0f : 0.5f));

    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        const std::vector<float> poisoned(10, bad);
        const Image<float> ones = draw<float>(mesh, view, poisoned);
        CHECK(std::all_of(ones.begin(), ones.end(), [](float value) { return value == 1; }));
    }
}

TEST_CASE("a work map spares its groups and changes no other pixel")
{
    const Mesh mesh = clutter(40, 9);
    const std::vector<float> values = noise(mesh.positions.size() / 3, 4);
    const View view{mesh, camera({0, 0, 5}, {0, 0, 0}), 70, 30};
    const Image<float> full = draw<float>(mesh, view, values);
    Image<std::uint8_t> active{nook::WorkMap::groups(70), 30};
    std::mt19937 random{1};
    for (std::uint8_t& group : active) group = static_cast<std::uint8_t>(random() % 2);
    Image<float> output{70, 30, -1};
    const nook::Outcome outcome =
        nook::vertex_values(mesh.view(), view.ids.view(), values.data(), output.view(), {},
                            view.projection, view.frame, {.active = active.view()});
    REQUIRE(outcome);
    std::uint64_t skipped = 0, background = 0;
    int wrong = 0;
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 70; ++x) {
            const bool spared = active(x / 16, y) == 0;
            background += view.surface(x, y) ? 0 : 1;
            skipped += view.surface(x, y) && spared ? 1 : 0;
            wrong += output(x, y) != (spared ? 1 : full(x, y)) ? 1 : 0;
        }
    CHECK(wrong == 0);
    CHECK(skipped > 100);
    CHECK(outcome.work.skipped == skipped);
    CHECK(outcome.work.background == background);
}

TEST_CASE("the bits do not depend on threads")
{
    const Mesh mesh = clutter(50, 10);
    const std::vector<float> values = noise(mesh.positions.size() / 3, 5);
    const View view{mesh, camera({0, 0, 5}, {0, 0, 0}), 90, 70};
    const Image<float> serial = draw<float>(mesh, view, values);
    nook::ThreadExecutor executor{3};
    Image<float> output{90, 70};
    nook::HeapScratch scratch;
    REQUIRE(nook::vertex_values(mesh.view(), view.ids.view(), values.data(), output.view(), {},
                                view.projection, view.frame, {}, scratch, executor));
    CHECK(output == serial);
}

TEST_CASE("wrong arguments are named and nothing is written")
{
    const Mesh mesh = clutter(3, 1);
    const std::vector<float> values(9, 0.5f);
    const View view{mesh, camera({0, 0, 5}, {0, 0, 0}), 20, 10};
    Image<float> output{20, 10, -1};
    const auto refusal = [&](const nook::MeshView& of, nook::ImageView<const std::uint32_t> ids,
                             const float* list, nook::ImageView<float> to,
                             const nook::Projection& projection, const nook::ViewFrame& frame,
                             const nook::WorkMap& map = {}) {
        const nook::Outcome outcome =
            nook::vertex_values(of, ids, list, to, {}, projection, frame, map);
        CHECK_FALSE(outcome);
        CHECK(std::all_of(output.begin(), output.end(), [](float v) { return v == -1; }));
        return std::string_view{outcome.error.argument};
    };
    const auto good = [&](const char* what) {
        nook::MeshView of = mesh.view();
        nook::ImageView<const std::uint32_t> ids = view.ids.view();
        nook::ImageView<float> to = output.view();
        nook::Projection projection = view.projection;
        nook::ViewFrame frame = view.frame;
        nook::WorkMap map;
        const float* list = values.data();
        const std::uint8_t group = 1;
        const std::string_view name = what;
        if (name == "ids") ids.data = nullptr;
        if (name == "mesh.indices") of.vertex_count = 2;
        if (name == "values") list = nullptr;
        if (name == "output") to.width = 19;
        if (name == "projection.fx") projection.fx = 0;
        if (name == "frame.origin") frame.origin.x = std::numeric_limits<double>::infinity();
        if (name == "work_map.active") map.active = {&group, 1, 1};
        return refusal(of, ids, list, to, projection, frame, map);
    };
    for (const char* name : {"ids", "mesh.indices", "values", "output", "projection.fx",
                             "frame.origin", "work_map.active"})
        CHECK(good(name) == name);
    // The output on top of the values, and on top of the ids.
    std::vector<float> shared(200, -1);
    CHECK(refusal(mesh.view(), view.ids.view(), shared.data(), {shared.data(), 20, 10},
                  view.projection, view.frame) == "output");
    const nook::Outcome small =
        nook::vertex_values(mesh.view(), view.ids.view(), values.data(), output.view(), {},
                            view.projection, view.frame, {}, nook::Scratch{});
    CHECK(small.error.code == nook::ErrorCode::scratch_too_small);
    CHECK(small.error.value == double(nook::vertex_values_scratch_size(1)));
    CHECK(nook::vertex_values({}, {}, nullptr, nook::ImageView<float>{}, {}, view.projection,
                              view.frame));
}
