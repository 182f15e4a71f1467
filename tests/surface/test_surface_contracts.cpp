#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/horizon_ao.hpp>

// What the kernels that share surface_pass.hpp promise alike.

namespace {

using nook::Image;

struct Buffers {
    Image<float> depth, normals;

    Buffers(int width, int height) : depth{width, height}, normals{width, 3 * height} {}
    [[nodiscard]] nook::ImageView3<float> normal()
    {
        const int width = depth.width(), height = depth.height();
        const std::ptrdiff_t plane = std::ptrdiff_t{width} * height;
        return {{normals.data(), width, height},
                {normals.data() + plane, width, height},
                {normals.data() + 2 * plane, width, height}};
    }
};

/// f(name, run, scratch size), where run(depth, normals, out, projection, scratch) is the kernel.
template <class F>
void for_each_kernel(const F& f)
{
    f(
        "alchemy_ao",
        [](const auto& depth, const auto& normals, const auto& out,
           const nook::Projection& projection, auto&& scratch) {
            return nook::alchemy_ao(depth, normals, out, {.radius = 0.7}, projection, {}, scratch);
        },
        [](const auto& depth, int workers) {
            return nook::alchemy_ao_scratch_size(depth, workers);
        });
    f(
        "horizon_ao",
        [](const auto& depth, const auto& normals, const auto& out,
           const nook::Projection& projection, auto&& scratch) {
            return nook::horizon_ao(depth, normals, out, {.radius = 0.7}, projection, {}, scratch);
        },
        [](const auto& depth, int workers) {
            return nook::horizon_ao_scratch_size(depth, workers);
        });
    f(
        "bitmask_ao",
        [](const auto& depth, const auto& normals, const auto& out,
           const nook::Projection& projection, auto&& scratch) {
            return nook::bitmask_ao(depth, normals, out, {.radius = 0.7}, projection, {}, scratch);
        },
        [](const auto& depth, int workers) {
            return nook::bitmask_ao_scratch_size(depth, workers);
        });
}

std::uint32_t scattered(int x, int y)
{
    std::uint32_t z = static_cast<std::uint32_t>(y * 1000 + x + 1) * 0x9e3779b9u;
    z = (z ^ z >> 15) * 0x85ebca6bu;
    return z ^ z >> 13;
}

Buffers relief(int width, int height)
{
    Buffers buffers{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            buffers.depth(x, y) = 4 + static_cast<float>(scattered(x / 5, y / 5) % 100) * 0.01f;
            const float nx = static_cast<float>(scattered(x, y) % 100) * 0.004f - 0.2f;
            buffers.normal().x(x, y) = nx;
            buffers.normal().y(x, y) = 0.1f;
            buffers.normal().z(x, y) = std::sqrt(1 - nx * nx - 0.01f);
        }
    return buffers;
}

}  // namespace

TEST_CASE("A bad normal changes no other pixel, not even of its group")
{
    // It sent its group through double, whose normals differ in the last bit.
    constexpr int width = 48, height = 20;
    constexpr nook::Projection projection{.fx = 40, .fy = 40, .cx = 24, .cy = 10};
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity(), 0.0f, 1e30f}) {
        CAPTURE(bad);
        for_each_kernel([&](const char* name, const auto& run, const auto&) {
            CAPTURE(name);
            Buffers buffers = relief(width, height);
            Image<float> clean{width, height}, out{width, height};
            REQUIRE(run(buffers.depth.view(), buffers.normal(), clean.view(), projection,
                        nook::HeapScratch{}));
            buffers.normal().x(21, 9) = bad;
            if (bad == 0) buffers.normal().y(21, 9) = buffers.normal().z(21, 9) = 0;
            REQUIRE(run(buffers.depth.view(), buffers.normal(), out.view(), projection,
                        nook::HeapScratch{}));
            int changed = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    if (x != 21 || y != 9)
                        changed += std::bit_cast<std::uint32_t>(out(x, y)) !=
                                   std::bit_cast<std::uint32_t>(clean(x, y));
            CHECK(changed == 0);
        });
    }
}

TEST_CASE("Under orthography planes that recede far stay open in coarse depths")
{
    // The steps of the neighbours are those of their own distance, however far they are.
    constexpr int width = 64, height = 48;
    for (const double tilt : {0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 9.0})
        for (const nook::DepthEncoding encoding :
             {nook::DepthEncoding::linear, nook::DepthEncoding::logarithmic}) {
            CAPTURE(tilt);
            nook::Projection projection{
                .fx = 20, .fy = 20, .cx = 32, .cy = 24, .orthographic = true};
            projection.encoding = encoding;
            projection.far_plane = 500;
            Buffers buffers{width, height};
            Image<float> distances{width, height};
            const double length = std::sqrt(1 + tilt * tilt);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    distances(x, y) = static_cast<float>(0.1 + tilt * x / 20.0);
                    buffers.normal().x(x, y) = static_cast<float>(tilt / length);
                    buffers.normal().y(x, y) = 0;
                    buffers.normal().z(x, y) = static_cast<float>(1 / length);
                }
            Image<std::uint16_t> stored{width, height};
            REQUIRE(nook::encode_depths<nook::HalfStorage>(distances.view(), stored.view(),
                                                           projection));
            const auto depth = nook::hardware_depth<nook::HalfStorage>(stored.view(), projection);
            for_each_kernel([&](const char* name, const auto& run, const auto&) {
                CAPTURE(name);
                Image<float> out{width, height};
                REQUIRE(run(depth, buffers.normal(), out.view(), projection, nook::HeapScratch{}));
                int dark = 0;
                for (const float value : out) dark += value != 1;
                CHECK(dark == 0);
            });
        }
}

TEST_CASE("Without scratch nothing is claimed to be done")
{
    Buffers buffers = relief(40, 24);
    constexpr nook::Projection projection{.fx = 40, .fy = 40, .cx = 20, .cy = 12};
    for_each_kernel([&](const char* name, const auto& run, const auto& scratch_size) {
        CAPTURE(name);
        const nook::ImageView<const float> depth = buffers.depth.view();
        Image<float> out{40, 24, -1.0f};
        std::vector<std::byte> memory(scratch_size(depth, 1));
        nook::Scratch little{memory.data(), memory.size() - 1};
        const nook::Outcome failed = run(depth, buffers.normal(), out.view(), projection, little);
        CHECK(failed.error.code == nook::ErrorCode::scratch_too_small);
        CHECK(failed.work.pixels == 0);
        CHECK(failed.work.passes == 0);
        for (const float value : out) REQUIRE(value == -1);
        nook::Scratch enough{memory.data(), memory.size()};
        CHECK(run(depth, buffers.normal(), out.view(), projection, enough));
        CHECK(scratch_size(depth, 0) == 0);
        CHECK(scratch_size(depth, -1) == 0);
        CHECK(scratch_size(nook::ImageView<const float>{}, 1) == 0);
    });
}
