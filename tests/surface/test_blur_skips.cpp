#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <nook/depth/hardware_depth.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bilateral_reference.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/upsample.hpp>
#include <nook/thread_executor.hpp>

#include "guided.hpp"

/// What the blur and the upsampling leave out changes no bit.
///
/// The proof by scale: products, differences and quotients of values scale with the values, and by a
/// power of two exactly. Halves of ones are not ones, so nothing is left out for them: the result for
/// halved values, doubled, is the result without skips.
namespace {

using namespace guided;
using nook::NormalSource;
using nook::Outcome;
using nook::Projection;
using nook::WorkMap;

/// Ones, and shade in some places.
template <class Value>
Image<Value> mostly_bright(Random& random, int width, int height)
{
    Image<Value> image{width, height, Value{1}};
    for (int spots = random.below(4); spots > 0; --spots) {
        const int x = random.below(width), y = random.below(height);
        const int right = random.chance(0.5) ? 1 : 1 + random.below(20);
        const int down = random.chance(0.5) ? 1 : 1 + random.below(10);
        for (int j = y; j < std::min(y + down, height); ++j)
            for (int i = x; i < std::min(x + right, width); ++i)
                image(i, j) = static_cast<Value>(random.uniform());
    }
    if (random.chance(0.1)) image(random.below(width), random.below(height)) = Value(not_a_number);
    return image;
}
template <class Value>
Image<Value> halved(const Image<Value>& image)
{
    return make<Value>(image.width(), image.height(),
                       [&](int x, int y) { return image(x, y) / 2; });
}
/// Whether `result` is twice what came of the halved values; where no value went in, both are 1.
template <class Value>
bool is_double(const Image<Value>& result, const Image<Value>& of_halves)
{
    for (int y = 0; y < result.height(); ++y)
        for (int x = 0; x < result.width(); ++x) {
            const Value half = of_halves(x, y);
            if (result(x, y) != (half == 1 ? Value{1} : 2 * half)) return false;
        }
    return true;
}

Image<float> random_normals(Random& random, int width, int height)
{
    Image<float> normals{3 * width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vec n = random.chance(0.03) ? Vec{0, 0, 0} : leaning(0.4 * x, 0.05 * y);
            normals(3 * x, y) = static_cast<float>(n.x);
            normals(3 * x + 1, y) = static_cast<float>(n.y);
            normals(3 * x + 2, y) = static_cast<float>(n.z);
        }
    return normals;
}
NormalSource source_of(const Image<float>& normals)
{
    return nook::ImageView3<const float>::interleaved(normals.data(), normals.width() / 3,
                                                      normals.height(), normals.width());
}

/// Which groups have work by definition: active ones from which `looks_at` finds a value but 1.
template <class Looks>
std::vector<bool> worked_on(int width, int height, const WorkMap& map, const Looks& looks_at_shade)
{
    const int groups = WorkMap::groups(width);
    std::vector<bool> work(static_cast<std::size_t>(groups * height));
    for (int y = 0; y < height; ++y)
        for (int g = 0; g < groups; ++g)
            work[static_cast<std::size_t>(y * groups + g)] =
                map.is_active(16 * g, y) && looks_at_shade(16 * g, y);
    return work;
}
/// What the counts should be.
template <class Surface, class Usable>
void check_counts(const nook::Work& work, int width, int height, const std::vector<bool>& worked,
                  const Surface& is_surface, const Usable& is_usable)
{
    std::uint64_t background = 0, skipped = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool spared =
                !worked[static_cast<std::size_t>(y * WorkMap::groups(width) + x / 16)];
            const bool surface = is_surface(x, y);
            background += !surface || (!spared && !is_usable(x, y)) ? 1 : 0;
            skipped += surface && spared ? 1 : 0;
        }
    CHECK(work.pixels == static_cast<std::uint64_t>(width * height));
    CHECK(work.background == background);
    CHECK(work.skipped == skipped);
    const bool idle = background + skipped == work.pixels;
    CHECK(work.passes == (idle ? 0u : 1u));
    CHECK(work.skipped_passes == (idle ? 1u : 0u));
}

struct Groups {
    std::vector<std::uint8_t> bytes;
    WorkMap map{};

    Groups(Random& random, int width, int height)
        : bytes(static_cast<std::size_t>(WorkMap::groups(width) * height))
    {
        if (random.chance(0.4)) return;
        const double share = random.chance(0.2) ? 0 : 0.6;
        for (auto& byte : bytes) byte = random.chance(share) ? 1 : 0;
        const int across = WorkMap::groups(width);
        map = {{bytes.data(), across, height, across}, random.chance(0.5)};
    }
};

/// Blurs and upsamples random pictures over these depths, with and without skips.
template <class Value, class Depth>
void check_skips(Random& random, const Depth& depth, const Projection& projection)
{
    const auto& source = nook::depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    const auto is_surface = [&](int x, int y) { return nook::surface_distance(source, x, y) > 0; };
    const Image<float> normals = random_normals(random, width, height);
    const NormalSource normal_source = source_of(normals);
    const bool with_normals = random.chance(0.5);
    const auto is_usable = [&](int x, int y) {
        return !with_normals || normals(3 * x + 2, y) != 0;
    };
    const Groups groups{random, width, height};
    const Image<Value> bright = mostly_bright<Value>(random, width, height);
    const nook::BlurOptions options{
        .radius = random.chance(0.1) ? random.below(65) : random.below(12), .least_cosine = 0.3};
    const auto blurred = [&](const Image<Value>& image, Image<Value>& result) {
        return with_normals ? nook::bilateral_blur(image.view(), depth, normal_source,
                                                   result.view(), options, projection, groups.map)
                            : nook::bilateral_blur(image.view(), depth, result.view(), options,
                                                   projection, groups.map);
    };
    Image<Value> result{width, height, Value{-7}}, of_halves{width, height, Value{-7}};
    CAPTURE(width);
    CAPTURE(height);
    CAPTURE(options.radius);
    CAPTURE(with_normals);
    const Outcome done = blurred(bright, result);
    REQUIRE(done);
    REQUIRE(blurred(halved(bright), of_halves));
    REQUIRE(is_double(result, of_halves));
    const int rows = std::max(options.radius, 2);
    const auto blur_looks = [&](int x, int y) {
        for (int j = std::max(y - rows, 0); j <= std::min(y + rows, height - 1); ++j)
            for (int i = std::max(x - options.radius, 0);
                 i < std::min(x + 16 + options.radius, width); ++i)
                if (!(nook::detail::is_finite(double{bright(i, j)}) && bright(i, j) == 1))
                    return true;
        return false;
    };
    check_counts(done.work, width, height, worked_on(width, height, groups.map, blur_looks),
                 is_surface, [&](int x, int y) { return is_usable(x, y); });

    const int half_width = (width + 1) / 2, half_height = (height + 1) / 2;
    const Image<Value> half = mostly_bright<Value>(random, half_width, half_height);
    const auto upsampled = [&](const Image<Value>& image, Image<Value>& to) {
        return with_normals
                   ? nook::upsample(image.view(), depth, normal_source, to.view(),
                                    {.least_cosine = 0.3}, projection, groups.map)
                   : nook::upsample(image.view(), depth, to.view(), {}, projection, groups.map);
    };
    const Outcome full = upsampled(half, result);
    REQUIRE(full);
    REQUIRE(upsampled(halved(half), of_halves));
    REQUIRE(is_double(result, of_halves));
    const auto upsampling_looks = [&](int x, int y) {
        for (int j = y / 2; j <= std::min((y + 1) / 2, half_height - 1); ++j)
            for (int i = x / 2; i <= std::min(x / 2 + 8, half_width - 1); ++i)
                if (!(nook::detail::is_finite(double{half(i, j)}) && half(i, j) == 1)) return true;
        return false;
    };
    check_counts(full.work, width, height, worked_on(width, height, groups.map, upsampling_looks),
                 is_surface, [&](int x, int y) { return is_usable(x, y); });
}

}  // namespace

TEST_CASE("what the blur and the upsampling leave out changes no bit, for any depths and maps")
{
    Random random{1};
    for (int round = 0; round < 150; ++round) {
        // The last ones are cut into several bands.
        const int width = 1 + random.below(round % 10 == 0 ? 500 : 90);
        const int height = 1 + random.below(round < 145 ? 40 : 400);
        Projection projection = camera(width, height, random.chance(0.3));
        const Image<float> depth =
            random_scene(random, projection, width, height, random.chance(0.7) ? 0.15 : 0);
        CAPTURE(round);
        check_skips<float>(random, depth.view(), projection);
        if (round % 3 == 0) {
            const Image<double> fine =
                make<double>(width, height, [&](int x, int y) { return depth(x, y); });
            check_skips<double>(random, fine.view(), projection);
        }
        if (round % 3 == 1 && !projection.orthographic) {
            projection.encoding = nook::DepthEncoding::reversed;
            projection.near_plane = 0.5;
            projection.far_plane = 1000;
            const Image<std::uint16_t> stored = make<std::uint16_t>(
                width, height, [&](int, int) { return 60000 * random.uniform() + 5; });
            check_skips<float>(random, nook::hardware_depth(stored.view(), projection), projection);
        }
    }
}

TEST_CASE("a dark pixel alone shades its window, and every pixel beyond is exactly 1")
{
    const int width = 70, height = 40;
    const Projection projection = camera(width, height);
    const Image<float> depth{width, height, 9.0f};
    for (const int radius : {0, 1, 2, 4, 17})
        for (const int x : {0, 3, 15, 16, 31, 32, 44, 63, 64, 69})
            for (const int y : {0, 1, 20, 39}) {
                CAPTURE(radius);
                CAPTURE(x);
                CAPTURE(y);
                Image<float> dark{width, height, 1.0f}, result{width, height};
                dark(x, y) = 0.25f;
                REQUIRE(nook::bilateral_blur(dark.view(), depth.view(), result.view(),
                                             {.radius = radius, .sigma = 20.0}, projection));
                for (int j = 0; j < height; ++j)
                    for (int i = 0; i < width; ++i) {
                        const bool inside = std::abs(i - x) <= radius && std::abs(j - y) <= radius;
                        REQUIRE((result(i, j) < 1) == inside);
                    }
                // Upwards of an odd row, to the left of an odd column, lie pixels of the full size.
                Image<float> half{width / 2, height / 2, 1.0f};
                half(x / 2, y / 2) = 0.25f;
                REQUIRE(nook::upsample(half.view(), depth.view(), result.view(), {}, projection));
                for (int j = 0; j < height; ++j)
                    for (int i = 0; i < width; ++i) {
                        const bool inside =
                            std::abs(i - x / 2 * 2) <= 1 && std::abs(j - y / 2 * 2) <= 1;
                        REQUIRE((result(i, j) < 1) == inside);
                    }
            }
}

TEST_CASE("the least shade there is counts as shade, and a NaN is none of the ones")
{
    const int width = 64, height = 20;
    const Projection projection = camera(width, height);
    const Image<float> depth{width, height, 9.0f};
    const nook::BlurOptions options{.radius = 3};
    for (const float value : {std::nextafter(1.0f, 0.0f), std::nextafter(1.0f, 2.0f), not_a_number})
        for (const int x : {13, 16, 40}) {
            Image<float> image{width, height, 1.0f}, result{width, height};
            image(x, 7) = value;
            const Outcome done = nook::bilateral_blur(image.view(), depth.view(), result.view(),
                                                      options, projection);
            REQUIRE(done);
            // The group of the pixel, and the one beside it if it is within reach; 7 rows.
            const std::uint64_t groups = x == 40 ? 1 : 2;
            CHECK(done.work.skipped == done.work.pixels - groups * 7 * 16);
        }
}

TEST_CASE("nothing to blur: a pass is left out, sky stays sky, and normals are not asked for")
{
    const int width = 50, height = 130;
    const Projection projection = camera(width, height);
    const Image<float> ones{width, height, 1.0f}, half_ones{25, 65, 1.0f};
    const Image<float> depth =
        make(width, height, [](int x, int y) { return x + y < 60 ? infinity : 9.0f; });
    const Image<float> no_normals{3 * width, height};
    std::uint64_t sky = 0;
    for (const float d : depth) sky += d < 100 ? 0 : 1;
    Image<float> result{width, height};
    nook::ThreadExecutor threads{3};
    const auto check = [&](const Outcome& done) {
        REQUIRE(done);
        CHECK(all_equal(result, 1.0f));
        CHECK(done.work.background == sky);
        CHECK(done.work.skipped == done.work.pixels - sky);
        CHECK(done.work.passes == 0);
        CHECK(done.work.skipped_passes == 1);
        result = Image<float>{width, height, -7.0f};
    };
    const NormalSource normals = source_of(no_normals);
    check(nook::bilateral_blur(ones.view(), depth.view(), result.view(), {}, projection));
    check(nook::bilateral_blur(ones.view(), depth.view(), normals, result.view(), {}, projection,
                               {}, nook::HeapScratch{}, threads));
    check(nook::upsample(half_ones.view(), depth.view(), result.view(), {}, projection));
    check(nook::upsample(half_ones.view(), depth.view(), normals, result.view(), {}, projection, {},
                         nook::HeapScratch{}, threads));
    // Every other value of a constant picture is work.
    const Image<float> grey{width, height, 0.5f};
    const Outcome done =
        nook::bilateral_blur(grey.view(), depth.view(), result.view(), {}, projection);
    CHECK(done.work.passes == 1);
    CHECK(done.work.skipped == 0);
}

TEST_CASE("shade runs on into groups that the kernel before left out, and draws no outlines")
{
    // A box on a floor, before the sky.
    const int width = 160, height = 90;
    const Projection projection{.fx = 120, .fy = 120, .cx = 80, .cy = 45};
    const auto in_box = [](int x, int y) { return x >= 70 && x < 90 && y >= 35 && y < 60; };
    const Image<float> depth = make(width, height, [&](int x, int y) {
        if (in_box(x, y)) return 4.0;
        return plane_distance(projection, {0, 0.8, 0.6}, 5, x, y);
    });
    Image<float> normals{3 * width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            normals(3 * x + 1, y) = in_box(x, y) ? 0.0f : 0.8f;
            normals(3 * x + 2, y) = in_box(x, y) ? 1.0f : 0.6f;
        }
    const NormalSource source = source_of(normals);
    const nook::AlchemyOptions options{.radius = 1};
    Image<float> whole{width, height}, mapped{width, height};
    REQUIRE(nook::alchemy_ao(depth.view(), source, whole.view(), options, projection));
    Image<std::uint8_t> active{WorkMap::groups(width), height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            if (whole(x, y) != 1) active(x / 16, y) = 1;
    const WorkMap map{active};
    const Outcome kernel =
        nook::alchemy_ao(depth.view(), source, mapped.view(), options, projection, map);
    REQUIRE(kernel);
    CHECK(kernel.work.skipped > 1000);
    REQUIRE(same_bits(mapped, whole));

    Image<float> blurred{width, height}, cut{width, height}, of_halves{width, height};
    const auto blur = [&](const Image<float>& image, Image<float>& result,
                          const WorkMap& work_map = {}) {
        return nook::bilateral_blur(image.view(), depth.view(), source, result.view(),
                                    {.radius = 4}, projection, work_map);
    };
    const Outcome done = blur(mapped, blurred);
    REQUIRE(done);
    REQUIRE(blur(halved(mapped), of_halves));
    CHECK(is_double(blurred, of_halves));
    CHECK(done.work.skipped > 1000);
    Image<double> plain{width, height};
    REQUIRE(nook::bilateral_blur_reference(mapped.view(), depth.view(), &source, plain.view(),
                                           {.radius = 4}, projection));
    CHECK(difference(blurred, plain) <= accuracy);
    // With the kernel's map the shade ends at the groups: the very outlines that are to be avoided.
    REQUIRE(blur(mapped, cut, map));
    int beyond = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (active(x / 16, y) != 0) {
                REQUIRE(cut(x, y) == blurred(x, y));
                continue;
            }
            beyond += blurred(x, y) < 1;
            REQUIRE(cut(x, y) == 1);
            // Sky beside it stays white.
            if (!nook::is_surface(depth(x, y), 1e30f)) REQUIRE(blurred(x, y) == 1);
        }
    CHECK(beyond > 50);
}
