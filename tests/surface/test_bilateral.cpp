#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bilateral_reference.hpp>
#include <nook/thread_executor.hpp>

#include "guided.hpp"

namespace {

using namespace guided;
using nook::BlurOptions;
using nook::NormalSource;
using nook::Projection;

Image<float> blur(const Image<float>& visibility, const Image<float>& depth,
                  const BlurOptions& options, const Projection& projection,
                  const nook::WorkMap& map = {})
{
    Image<float> result{depth.width(), depth.height(), -7.0f};
    REQUIRE(nook::bilateral_blur(visibility.view(), depth.view(), result.view(), options,
                                 projection, map));
    return result;
}
Image<float> blur(const Image<float>& visibility, const Image<float>& depth,
                  const NormalSource& normals, const BlurOptions& options,
                  const Projection& projection, const nook::WorkMap& map = {})
{
    Image<float> result{depth.width(), depth.height(), -7.0f};
    REQUIRE(nook::bilateral_blur(visibility.view(), depth.view(), normals, result.view(), options,
                                 projection, map));
    return result;
}

/// Normals of one image, interleaved.
struct Normals {
    int width, height;
    std::vector<float> values;

    template <class Function>
    Normals(int w, int h, const Function& normal)
        : width{w},
          height{h},
          values(static_cast<std::size_t>(3 * w * h))
    {
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                const Vec n = normal(x, y);
                float* const out = values.data() + 3 * (y * w + x);
                out[0] = static_cast<float>(n.x);
                out[1] = static_cast<float>(n.y);
                out[2] = static_cast<float>(n.z);
            }
    }
    operator NormalSource() const
    {
        return nook::ImageView3<const float>::interleaved(values.data(), width, height, 3 * width);
    }
};

std::vector<std::uint8_t> random_groups(Random& random, int width, int height, double share)
{
    std::vector<std::uint8_t> groups(
        static_cast<std::size_t>(nook::WorkMap::groups(width) * height));
    for (auto& group : groups) group = random.chance(share) ? 1 : 0;
    return groups;
}
nook::WorkMap map_of(const std::vector<std::uint8_t>& groups, int width, int height, bool exact)
{
    const int across = nook::WorkMap::groups(width);
    return {{groups.data(), across, height, across}, exact};
}

}  // namespace

TEST_CASE("a constant stays what it is, and background becomes exactly 1")
{
    Random random{1};
    for (const bool orthographic : {false, true}) {
        const int width = 77, height = 41;
        const Projection projection = camera(width, height, orthographic);
        const Image<float> depth = random_scene(random, projection, width, height, 0.2);
        const Normals normals{width, height, [&](int x, int y) { return leaning(x + y, 0.1 * x); }};
        for (const float constant : {1.0f, 0.3f, 0.0f, 1e-30f, 7.7e20f}) {
            const Image<float> even{width, height, constant};
            const Image<float> plain = blur(even, depth, {.radius = 5}, projection);
            const Image<float> guided = blur(even, depth, normals, {.radius = 5}, projection);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const bool surface = nook::is_surface(depth(x, y), 1e30f);
                    REQUIRE(plain(x, y) == (surface ? constant : 1));
                    REQUIRE(guided(x, y) == (surface ? constant : 1));
                }
        }
    }
}

TEST_CASE("the blur of random scenes agrees with the plain form in double to 1e-4")
{
    Random random{2};
    double worst = 0, moved = 0;
    for (int round = 0; round < 40; ++round) {
        // The last ones are cut into several bands.
        const int width = 20 + random.below(60);
        const int height = round < 37 ? 10 + random.below(30) : 280;
        const bool orthographic = random.chance(0.4), with_normals = random.chance(0.5);
        const Projection projection = camera(width, height, orthographic);
        const Image<float> depth =
            random_scene(random, projection, width, height, random.chance(0.5) ? 0.1 : 0);
        const Normals normals{
            width, height, [&](int x, int y) {
                return random.chance(0.02) ? Vec{0, 0, 0} : leaning(20 + x, 0.05 * y);
            }};
        Image<float> visibility = noise(width, height, static_cast<std::uint64_t>(round));
        visibility(3, 4) = not_a_number;
        visibility(7, 4) = infinity;
        BlurOptions options{.radius = random.below(6),
                            .tolerance = random.chance(0.5) ? 0.01 : 0.03,
                            .length = random.chance(0.5) ? 0.1 : 0.0,
                            .least_cosine = 0.3};
        if (random.chance(0.3)) options.sigma = 1 + 5 * random.uniform();
        const auto groups = random_groups(random, width, height, 0.6);
        const nook::WorkMap map = random.chance(0.5)
                                      ? nook::WorkMap{}
                                      : map_of(groups, width, height, random.chance(0.5));
        Image<float> fast{width, height};
        Image<double> plain{width, height};
        const NormalSource source = normals;
        const auto done = with_normals
                              ? nook::bilateral_blur(visibility.view(), depth.view(), source,
                                                     fast.view(), options, projection, map)
                              : nook::bilateral_blur(visibility.view(), depth.view(), fast.view(),
                                                     options, projection, map);
        const auto expected = nook::bilateral_blur_reference(
            visibility.view(), depth.view(), with_normals ? &source : nullptr, plain.view(),
            options, projection, map);
        REQUIRE(done);
        REQUIRE(expected);
        CHECK(done.work.pixels == expected.work.pixels);
        CHECK(done.work.background == expected.work.background);
        CHECK(done.work.skipped == expected.work.skipped);
        CAPTURE(round);
        worst = std::max(worst, difference(fast, plain));
        REQUIRE(worst <= accuracy);
        moved = std::max(moved, std::fabs(double{fast(width / 2, height / 2)} -
                                          double{visibility(width / 2, height / 2)}));
        // In double the two differ by rounding alone.
        Image<double> fine{width, height};
        if (with_normals)
            REQUIRE(nook::bilateral_blur(visibility.view(), depth.view(), source, fine.view(),
                                         options, projection, map));
        else
            REQUIRE(nook::bilateral_blur(visibility.view(), depth.view(), fine.view(), options,
                                         projection, map));
        REQUIRE(difference(fine, plain) <= 1e-10);
    }
    MESSAGE("largest difference ", worst);
    CHECK(moved > 0.1);
}

TEST_CASE("nothing bleeds over a silhouette")
{
    const int width = 60, height = 30;
    for (const bool orthographic : {false, true})
        for (const double step : {1.05, 10.0, 1e6}) {
            const Projection projection = camera(width, height, orthographic);
            // A disc, and lines one pixel wide.
            const auto in_front = [&](int x, int y) {
                const int dx = x - 20, dy = y - 15;
                return dx * dx + dy * dy < 90 || x == 45 || y == 3 || (x == 52 && y == 20);
            };
            const Image<float> depth =
                make(width, height, [&](int x, int y) { return in_front(x, y) ? 1 : step; });
            const Image<float> visibility =
                make(width, height, [&](int x, int y) { return in_front(x, y) ? 0 : 1; });
            const Image<float> plain = blur(visibility, depth, {.radius = 6}, projection);
            CHECK(same_bits(plain, visibility));
            const Normals facing{width, height, [](int, int) { return Vec{0, 0, 1}; }};
            CHECK(
                same_bits(blur(visibility, depth, facing, {.radius = 6}, projection), visibility));
            // Within the tolerance they are one surface.
            if (step == 1.05) {
                const Image<float> joined =
                    blur(visibility, depth, {.radius = 6, .tolerance = 0.2}, projection);
                CHECK(joined(45, 15) > 0.5f);
            }
        }
}

TEST_CASE("planes of every tilt and encoding blur like one that faces the viewer")
{
    const int width = 96, height = 40;
    const Image<float> visibility = noise(width, height, 5);
    for (const bool orthographic : {false, true}) {
        // Narrow enough for planes to stay in front of the viewer; 85 degrees recede by 0.4 % a pixel.
        Projection projection = camera(width, height, orthographic);
        if (!orthographic) projection.fx = projection.fy = 3000;
        const BlurOptions options{.radius = 5};
        const Image<float> flat{width, height, 9.0f};
        const Image<float> expected = blur(visibility, flat, options, projection);
        for (const double tilt : {30.0, 60.0, 80.0, 85.0})
            for (const double heading : {0.0, 1.0, 2.5, 4.0}) {
                const Vec n = leaning(tilt, heading);
                const Image<float> depth = make(width, height, [&](int x, int y) {
                    return plane_distance(projection, n, orthographic ? 400 : 20, x, y);
                });
                REQUIRE(std::all_of(depth.begin(), depth.end(),
                                    [](float d) { return nook::is_surface(d, 1e30f); }));
                CAPTURE(tilt);
                CAPTURE(heading);
                CAPTURE(orthographic);
                CHECK(difference(blur(visibility, depth, options, projection), expected) <= 2e-5);
                const Normals normals{width, height, [&](int, int) { return n; }};
                CHECK(difference(blur(visibility, depth, normals, options, projection), expected) <=
                      2e-5);
            }
    }
    // Quantised distances: neighbours lose some of their weight, but stay.
    for (const auto encoding : {nook::DepthEncoding::standard, nook::DepthEncoding::reversed,
                                nook::DepthEncoding::logarithmic}) {
        Projection projection = camera(width, height);
        projection.encoding = encoding;
        projection.near_plane = 0.5;
        projection.far_plane = 1000;
        const Image<float> depth = make(width, height, [&](int x, int y) {
            return plane_distance(projection, leaning(80, 1.0), 20, x, y);
        });
        Image<std::uint16_t> stored{width, height};
        REQUIRE(nook::encode_depths(depth.view(), stored.view(), projection));
        Image<float> result{width, height};
        REQUIRE(nook::bilateral_blur(visibility.view(),
                                     nook::hardware_depth(std::as_const(stored).view(), projection),
                                     result.view(), {.radius = 5}, projection));
        const Image<float> expected = blur(visibility, depth, {.radius = 5}, projection);
        const auto spread = [&](const Image<float>& image) {
            double sum = 0;
            for (const float value : image) sum += (double{value} - 0.5) * (double{value} - 0.5);
            return sum;
        };
        CAPTURE(int(encoding));
        CHECK(difference(result, expected) <= 0.12);
        CHECK(spread(result) <= 1.2 * spread(expected));
        CHECK(spread(expected) <= 0.06 * spread(visibility));
    }
}

TEST_CASE(
    "skipped groups neither bleed nor draw outlines, and an exact map changes no computed bit")
{
    const int width = 83, height = 37;
    const Projection projection = camera(width, height);
    Random random{9};
    const Image<float> depth = random_scene(random, projection, width, height, 0.05);
    const Normals normals{width, height, [&](int x, int y) { return leaning(0.5 * x, 0.1 * y); }};
    const auto groups = random_groups(random, width, height, 0.5);
    const nook::WorkMap exact = map_of(groups, width, height, true),
                        other = map_of(groups, width, height, false);
    // Dark where it was computed, 1 elsewhere: nothing may lighten it.
    const Image<float> dark =
        make(width, height, [&](int x, int y) { return exact.is_active(x, y) ? 0.25 : 1.0; });
    const Image<float> kept = blur(dark, depth, {.radius = 4}, projection, other);
    const Image<float> guided = blur(dark, depth, normals, {.radius = 4}, projection, other);
    const Image<float> rough = noise(width, height, 10);
    const Image<float> whole = blur(rough, depth, {.radius = 4}, projection);
    const Image<float> masked = blur(rough, depth, {.radius = 4}, projection, exact);
    const Image<float> whole_guided = blur(rough, depth, normals, {.radius = 4}, projection);
    const Image<float> masked_guided =
        blur(rough, depth, normals, {.radius = 4}, projection, exact);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool active = exact.is_active(x, y);
            const bool surface = nook::is_surface(depth(x, y), 1e30f);
            REQUIRE(kept(x, y) == (active && surface ? 0.25f : 1.0f));
            REQUIRE(guided(x, y) == (active && surface ? 0.25f : 1.0f));
            REQUIRE(masked(x, y) == (active ? whole(x, y) : 1.0f));
            REQUIRE(masked_guided(x, y) == (active ? whole_guided(x, y) : 1.0f));
        }
    // True values of skipped pixels do enter windows.
    const Image<float> lightened = blur(dark, depth, {.radius = 4}, projection, exact);
    CHECK(*std::max_element(lightened.begin(), lightened.end()) == 1);
    CHECK(difference(lightened, kept) > 0.1);
}

TEST_CASE("radius 0 changes nothing")
{
    const int width = 50, height = 20;
    const Projection projection = camera(width, height);
    Random random{3};
    const Image<float> depth = random_scene(random, projection, width, height, 0);
    const Image<float> visibility = noise(width, height, 4);
    CHECK(same_bits(blur(visibility, depth, {.radius = 0}, projection), visibility));
    const Normals normals{width, height, [](int, int) { return Vec{0, 0.5, 2}; }};
    CHECK(same_bits(blur(visibility, depth, normals, {.radius = 0}, projection), visibility));
}

TEST_CASE("the blur of an impulse on a wall is the product of two Gaussians")
{
    const int size = 41, radius = 7;
    Image<double> visibility{size, size};
    visibility(20, 20) = 1;
    const Image<double> wall{size, size, 3.0};
    Image<double> result{size, size};
    REQUIRE(nook::bilateral_blur(visibility.view(), wall.view(), result.view(),
                                 {.radius = radius, .sigma = 2.5}, camera(size, size)));
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += std::exp(-i * i / 12.5);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const int dx = x - 20, dy = y - 20;
            const bool inside = std::abs(dx) <= radius && std::abs(dy) <= radius;
            const double expected =
                inside ? std::exp(-(dx * dx + dy * dy) / 12.5) / (sum * sum) : 0;
            REQUIRE(std::fabs(result(x, y) - expected) <= 1e-15);
        }
}

TEST_CASE("the blur is linear in the visibility, and bounded by it")
{
    const int width = 64, height = 33;
    const Projection projection = camera(width, height);
    Random random{6};
    const Image<float> depth = random_scene(random, projection, width, height, 0);
    const Image<float> v = noise(width, height, 7), u = noise(width, height, 8);
    const Image<float> sum =
        make(width, height, [&](int x, int y) { return 3 * v(x, y) - 2 * u(x, y) + 0.5f; });
    const BlurOptions options{.radius = 4};
    const Image<float> of_v = blur(v, depth, options, projection),
                       of_u = blur(u, depth, options, projection),
                       of_sum = blur(sum, depth, options, projection);
    const Image<float> expected =
        make(width, height, [&](int x, int y) { return 3 * of_v(x, y) - 2 * of_u(x, y) + 0.5f; });
    CHECK(difference(of_sum, expected) <= 4e-6);
    for (const float low : {0.0f, 0.3f, -5.0f}) {
        // Two values alone: their window holds both or one.
        const float high = std::nextafter(low, 2.0f);
        const Image<float> edge =
            make(width, height, [&](int x, int y) { return v(x, y) < 0.5f ? low : high; });
        const Image<float> result = blur(edge, depth, options, projection);
        CHECK(*std::min_element(result.begin(), result.end()) >= low);
        CHECK(*std::max_element(result.begin(), result.end()) <= high);
    }
}

TEST_CASE("mirrored and rescaled images give mirrored and equal blurs")
{
    const int width = 61, height = 27;
    const Projection projection = camera(width, height);
    Random random{11};
    const Image<float> depth = random_scene(random, projection, width, height, 0.03);
    const Image<float> visibility = noise(width, height, 12);
    const BlurOptions options{.radius = 5, .length = 0.02};
    const Image<float> result = blur(visibility, depth, options, projection);
    const auto mirrored = [&](const Image<float>& image) {
        return make(width, height, [&](int x, int y) { return image(width - 1 - x, y); });
    };
    Projection mirror = projection;
    mirror.cx = width - projection.cx;
    CHECK(difference(mirrored(blur(mirrored(visibility), mirrored(depth), options, mirror)),
                     result) <= 2e-5);
    for (const float scale : {0x1p-20f, 0x1p20f}) {
        const Image<float> scaled =
            make(width, height, [&](int x, int y) { return depth(x, y) * scale; });
        BlurOptions longer = options;
        longer.length *= double{scale};
        CHECK(same_bits(blur(visibility, scaled, longer, projection), result));
    }
}

TEST_CASE("the blur has the same bits for any number of threads, strides and with lent scratch")
{
    const int width = 70, height = 300;
    const Projection projection = camera(width, height);
    Random random{13};
    const Image<float> depth = random_scene(random, projection, width, height, 0.05);
    const Image<float> visibility = noise(width, height, 14);
    const Normals normals{width, height, [&](int x, int y) { return leaning(0.5 * x, 0.1 * y); }};
    const BlurOptions options{.radius = 3};
    const Image<float> result = blur(visibility, depth, options, projection);
    const Image<float> guided = blur(visibility, depth, normals, options, projection);
    nook::ThreadExecutor threads{3};
    Image<float> other{width, height};
    REQUIRE(nook::bilateral_blur(visibility.view(), depth.view(), other.view(), options, projection,
                                 {}, nook::HeapScratch{}, threads));
    CHECK(same_bits(other, result));
    REQUIRE(nook::bilateral_blur(visibility.view(), depth.view(), normals, other.view(), options,
                                 projection, {}, nook::HeapScratch{}, threads));
    CHECK(same_bits(other, guided));

    // Everything interleaved in one buffer of rows bottom up: depth, visibility, a gap, the result.
    const int stride = 4 * width + 3;
    std::vector<float> buffer(static_cast<std::size_t>(stride * height), not_a_number);
    const auto channel = [&](int index) {
        return nook::ImageView<float>{buffer.data() + (height - 1) * stride + index, width, height,
                                      -stride, 4};
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            channel(0)(x, y) = depth(x, y);
            channel(1)(x, y) = visibility(x, y);
        }
    const std::size_t size =
        nook::bilateral_blur_scratch_size(channel(1), channel(0), channel(3), options, false);
    std::vector<std::byte> lent(size + 1, std::byte{0xff});
    REQUIRE(nook::bilateral_blur(channel(1), channel(0), channel(3), options, projection, {},
                                 nook::Scratch{lent.data(), size}));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            REQUIRE(channel(3)(x, y) == result(x, y));
            REQUIRE(nook::detail::is_nan(double{channel(2)(x, y)}));
        }
    CHECK(lent.back() == std::byte{0xff});
    const auto short_of =
        nook::bilateral_blur(channel(1), channel(0), channel(3), options, projection, {},
                             nook::Scratch{lent.data(), size - 1});
    CHECK(short_of.error.code == nook::ErrorCode::scratch_too_small);
}

TEST_CASE("whatever comes in, no NaN comes out, and poison stays in its pixel")
{
    const int width = 48, height = 24;
    const Projection projection = camera(width, height);
    Random random{15};
    const Image<float> depth = random_scene(random, projection, width, height, 0);
    const Image<float> visibility = noise(width, height, 16);
    const Image<float> result = blur(visibility, depth, {.radius = 2}, projection);
    for (const float poison : {not_a_number, infinity, -infinity, 3e38f}) {
        Image<float> spoilt = visibility;
        spoilt(20, 10) = poison;
        const Image<float> blurred = blur(spoilt, depth, {.radius = 2}, projection);
        CHECK(blurred(20, 10) == 1);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                REQUIRE(blurred(x, y) <= 1);
                REQUIRE(blurred(x, y) >= 0);
                if (std::abs(x - 20) > 2 || std::abs(y - 10) > 2)
                    REQUIRE(blurred(x, y) == result(x, y));
            }
    }
    // Depths and normals of every kind beside each other.
    const std::array odd{1e-42f, 1e-38f, 1e-20f, 1.0f,     1e20f,        3e38f,
                         0.0f,   -1.0f,  2.0f,   infinity, not_a_number, 1.00001f};
    for (const bool orthographic : {false, true}) {
        const Projection view = camera(width, height, orthographic);
        const Image<float> wild = make(width, height, [&](int, int) {
            return odd[static_cast<std::size_t>(random.below(int(odd.size())))];
        });
        const Normals normals{
            width, height, [&](int, int) {
                const auto any = [&] {
                    return double{odd[static_cast<std::size_t>(random.below(int(odd.size())))]};
                };
                return Vec{any(), any(), any()};
            }};
        for (const double length : {0.0, 1e-30, 1e300})
            for (const double tolerance : {0.0, 1e-12, 1e12}) {
                const BlurOptions options{
                    .radius = 4, .tolerance = tolerance, .length = length, .least_cosine = -1};
                for (const Image<float>& image : {blur(visibility, wild, options, view),
                                                  blur(visibility, wild, normals, options, view)})
                    for (const float value : image) REQUIRE((value >= 0 && value <= 1));
            }
    }
}

TEST_CASE("images of every small size agree with the plain form")
{
    for (int width = 0; width <= 5; ++width)
        for (int height = 0; height <= 5; ++height) {
            const Projection projection = camera(width, height);
            const Image<float> depth =
                make(width, height, [](int x, int y) { return 5 + 0.01 * x + 0.3 * y; });
            const Image<float> visibility = noise(width, height, 17);
            Image<float> result{width, height};
            Image<double> expected{width, height};
            REQUIRE(nook::bilateral_blur(visibility.view(), depth.view(), result.view(),
                                         {.radius = 9}, projection));
            REQUIRE(nook::bilateral_blur_reference(visibility.view(), depth.view(), nullptr,
                                                   expected.view(), {.radius = 9}, projection));
            CHECK(difference(result, expected) <= 1e-5);
        }
    // Null data is fine where there are no pixels.
    CHECK(nook::bilateral_blur(nook::ImageView<const float>{}, nook::ImageView<const float>{},
                               nook::ImageView<float>{}, {}, camera(1, 1)));
}

TEST_CASE("a bad argument is named, and nothing is written")
{
    const int width = 20, height = 10;
    const Projection projection = camera(width, height);
    const Image<float> depth{width, height, 2.0f}, visibility = noise(width, height, 18);
    const Image<float> untouched{width, height, -7.0f};
    Image<float> out = untouched;
    const Normals facing{width, height, [](int, int) { return Vec{0, 0, 1}; }};
    const auto options_error = [&](const BlurOptions& options) {
        const auto outcome =
            nook::bilateral_blur(visibility.view(), depth.view(), out.view(), options, projection);
        CHECK(same_bits(out, untouched));
        return std::string{outcome.error.argument};
    };
    CHECK(options_error({.radius = -1}) == "options.radius");
    CHECK(options_error({.radius = 65}) == "options.radius");
    CHECK(options_error({.sigma = 0.0}) == "options.sigma");
    CHECK(options_error({.sigma = double{not_a_number}}) == "options.sigma");
    CHECK(options_error({.tolerance = -1}) == "options.tolerance");
    CHECK(options_error({.tolerance = double{infinity}}) == "options.tolerance");
    CHECK(options_error({.length = -0.1}) == "options.length");
    CHECK(options_error({.least_cosine = 1}) == "options.least_cosine");
    CHECK(options_error({.least_cosine = double{not_a_number}}) == "options.least_cosine");

    const auto argument = [&](const nook::Outcome& outcome) {
        CHECK(same_bits(out, untouched));
        return std::string{outcome.error.argument};
    };
    const Image<float> narrow{width - 1, height, 1.0f};
    CHECK(argument(nook::bilateral_blur(visibility.view(), narrow.view(), out.view(), {},
                                        projection)) == "depth");
    CHECK(argument(nook::bilateral_blur(narrow.view(), depth.view(), out.view(), {}, projection)) ==
          "depth");
    const Normals few{width, height - 1, [](int, int) { return Vec{0, 0, 1}; }};
    CHECK(argument(nook::bilateral_blur(visibility.view(), depth.view(), NormalSource{few},
                                        out.view(), {}, projection)) == "normals.x");
    CHECK(argument(nook::bilateral_blur(std::as_const(out).view(), depth.view(), out.view(), {},
                                        projection)) == "blurred");
    CHECK(argument(nook::bilateral_blur(visibility.view(), std::as_const(out).view(), out.view(),
                                        {}, projection)) == "blurred");
    CHECK(argument(nook::bilateral_blur(visibility.view(), depth.view(), out.view(), {},
                                        Projection{})) == "projection.fx");
    const std::vector<std::uint8_t> groups(30, 1);
    CHECK(argument(nook::bilateral_blur(visibility.view(), depth.view(), out.view(), {}, projection,
                                        {{groups.data(), 3, height, 3}})) == "work_map.active");
    CHECK(argument(nook::bilateral_blur(nook::ImageView<const float>{nullptr, width, height},
                                        depth.view(), out.view(), {}, projection)) == "visibility");
}
