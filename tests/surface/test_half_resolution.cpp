#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/half_resolution.hpp>

#include "guided.hpp"

namespace {

using namespace guided;

template <class T>
Image<T> copy(const nook::ImageView<const T>& view)
{
    return make<T>(view.width, view.height, [&](int x, int y) { return view(x, y); });
}

}  // namespace

TEST_CASE("a half view shows every second pixel of every second row, for odd sizes and all strides")
{
    for (int width = 0; width <= 5; ++width)
        for (int height = 0; height <= 5; ++height) {
            Image<int> image = make<int>(width, height, [](int x, int y) { return 10 * x + y; });
            // The top row of a picture that lies in memory bottom up.
            int* const top = height > 0 ? image.data() + (height - 1) * width : nullptr;
            const nook::ImageView<int> flipped{top, width, height, -width, 1};
            const auto half = nook::half_view(image.view());
            const auto half_flipped = nook::half_view(flipped);
            REQUIRE(half.width == (width + 1) / 2);
            REQUIRE(half.height == (height + 1) / 2);
            for (int y = 0; y < half.height; ++y)
                for (int x = 0; x < half.width; ++x) {
                    CHECK(half(x, y) == 20 * x + 2 * y);
                    CHECK(half_flipped(x, y) == 20 * x + height - 1 - 2 * y);
                    // It writes through.
                    half(x, y) = -1;
                    CHECK(image(2 * x, 2 * y) == -1);
                    half(x, y) = 20 * x + 2 * y;
                }
        }
    std::vector<float> values(3 * 7 * 5);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
    const auto normals = nook::ImageView3<const float>::interleaved(values.data(), 7, 5, 21);
    const float rotation[9] = {0, 1, 0, -1, 0, 0, 0, 0, 1};
    const auto half = nook::half_source(nook::NormalSource{normals, rotation});
    CHECK(half.image.z.width == 4);
    CHECK(half.image.z.height == 3);
    CHECK(half.image.z(3, 2) == normals.z(6, 4));
    CHECK(half.rotated);
    CHECK(half.to_view[1] == 1);
    CHECK(nook::half_view(normals).y(2, 1) == normals.y(4, 2));
}

TEST_CASE("the rays of the half projection are those of the pixels it shows")
{
    for (const bool orthographic : {false, true}) {
        const nook::Projection full = camera(31, 17, orthographic);
        const nook::Projection half = nook::half_projection(full);
        for (int x = 0; x < 16; ++x) {
            const auto expected = nook::view_point(full, 2 * x + 0.5, 6.5, 4);
            const auto point = nook::view_point(half, x + 0.5, 3.5, 4);
            CHECK(std::fabs(point.x - expected.x) <= 1e-15);
            CHECK(std::fabs(point.y - expected.y) <= 1e-15);
        }
    }
}

TEST_CASE("kernels give the bits of a half-size copy, and planes stay 1, in every encoding")
{
    const int width = 121, height = 67;
    std::vector<float> values(static_cast<std::size_t>(3 * width * height));
    const Vec n = leaning(60, 0.7);
    for (std::size_t i = 0; i < values.size(); i += 3) {
        values[i] = static_cast<float>(n.x);
        values[i + 1] = static_cast<float>(n.y);
        values[i + 2] = static_cast<float>(n.z);
    }
    const nook::NormalSource normals =
        nook::ImageView3<const float>::interleaved(values.data(), width, height, 3 * width);
    for (const bool orthographic : {false, true})
        for (const auto encoding : {nook::DepthEncoding::linear, nook::DepthEncoding::negative_z,
                                    nook::DepthEncoding::standard, nook::DepthEncoding::reversed,
                                    nook::DepthEncoding::opengl}) {
            nook::Projection projection = camera(width, height, orthographic);
            projection.encoding = encoding;
            projection.near_plane = 1;
            projection.far_plane = 1000;
            const nook::Projection half = nook::half_projection(projection);
            // A plane with sky in its corner.
            const Image<float> distances = make(width, height, [&](int x, int y) {
                return x + y < 30 ? HUGE_VAL : plane_distance(projection, n, 50, x, y);
            });
            Image<float> stored{width, height};
            REQUIRE(nook::encode_depths(distances.view(), stored.view(), projection));
            const auto source = nook::hardware_depth(std::as_const(stored).view(), projection);
            const auto half_source = nook::half_source(source);
            const Image<float> small = copy(half_source.image);
            const auto small_source = nook::hardware_depth(std::as_const(small).view(), projection);
            CAPTURE(int(encoding));
            CAPTURE(orthographic);

            Image<float> ao{small.width(), small.height()}, expected = ao;
            REQUIRE(nook::chebyshev_ao(half_source, ao.view(), {.window = 9}));
            REQUIRE(nook::chebyshev_ao(small_source, expected.view(), {.window = 9}));
            CHECK(same_bits(ao, expected));
            REQUIRE(nook::alchemy_ao(half_source, nook::half_source(normals), ao.view(),
                                     {.radius = 3}, half));
            for (const float value : ao) REQUIRE(value == 1);
        }
    // Orthographic planes are linear on screen: exactly 1 for the windows too.
    const Image<float> ramp =
        make(width, height, [](int x, int y) { return 8 + 0.25 * x + 0.125 * y; });
    Image<float> open{(width + 1) / 2, (height + 1) / 2};
    REQUIRE(nook::chebyshev_ao(nook::half_source(ramp.view()), open.view(), {.window = 9}));
    CHECK(all_equal(open, 1.0f));
}

TEST_CASE("the half work map names every half pixel that an active pixel takes from")
{
    Random random{4};
    for (const int width : {1, 15, 16, 17, 32, 33, 47, 48, 49, 100})
        for (const int height : {1, 2, 3, 8, 9}) {
            const int across = nook::WorkMap::groups(width);
            std::vector<std::uint8_t> full(static_cast<std::size_t>(across * height));
            for (auto& group : full) group = random.chance(0.15) ? 7 : 0;
            const nook::WorkMap map{{full.data(), across, height, across}};
            const int half_width = (width + 1) / 2, half_height = (height + 1) / 2;
            const int half_across = nook::WorkMap::groups(half_width);
            REQUIRE(half_across == (across + 1) / 2);
            std::vector<std::uint8_t> half(static_cast<std::size_t>(half_across * half_height), 9);
            const nook::ImageView<std::uint8_t> out{half.data(), half_across, half_height,
                                                    half_across};
            REQUIRE(nook::half_work_map(map, out));
            std::vector<std::uint8_t> least(half.size(), 0);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    if (!map.is_active(x, y)) continue;
                    for (const int j : {y / 2, (y + 1) / 2})
                        for (const int i : {x / 2, (x + 1) / 2})
                            if (i < half_width && j < half_height) {
                                REQUIRE(out(i / 16, j) == 1);
                                least[static_cast<std::size_t>(j * half_across + i / 16)] = 1;
                            }
                }
            // And none besides.
            for (int y = 0; y < half_height; ++y)
                for (int x = 0; x < half_across; ++x)
                    if (least[static_cast<std::size_t>(y * half_across + x)] == 0)
                        CHECK(out(x, y) == 0);
        }
    std::vector<std::uint8_t> groups(6, 1), other(4, 5);
    const nook::WorkMap map{{groups.data(), 3, 2, 3}};
    const auto wrong = nook::half_work_map(map, {other.data(), 1, 1, 1});
    CHECK(std::string{wrong.error.argument} == "active");
    CHECK(other[0] == 5);
    CHECK(nook::half_work_map(map, {other.data(), 2, 2, 2}).error.code ==
          nook::ErrorCode::bad_size);
    CHECK(nook::half_work_map(map, {groups.data(), 2, 1, 2}).error.code ==
          nook::ErrorCode::overlap);
}
