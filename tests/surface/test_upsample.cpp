#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/surface/bilateral_reference.hpp>
#include <nook/surface/upsample.hpp>
#include <nook/thread_executor.hpp>

#include "guided.hpp"

namespace {

using namespace guided;
using nook::NormalSource;
using nook::Projection;
using nook::UpsampleOptions;

struct Result {
    Image<float> image;
    nook::Work work;
};
template <class Depth>
Result upsample(const Image<float>& half, const Depth& depth, const UpsampleOptions& options,
                const Projection& projection, const nook::WorkMap& map = {})
{
    const auto& image = nook::depth_source(depth).image;
    Image<float> result{image.width, image.height, -7.0f};
    const auto done = nook::upsample(half.view(), depth, result.view(), options, projection, map);
    REQUIRE(done);
    return {result, done.work};
}
Result upsample(const Image<float>& half, const Image<float>& depth, const UpsampleOptions& options,
                const Projection& projection, const nook::WorkMap& map = {})
{
    return upsample(half, depth.view(), options, projection, map);
}
Result upsample(const Image<float>& half, const Image<float>& depth, const NormalSource& normals,
                const UpsampleOptions& options, const Projection& projection)
{
    Image<float> result{depth.width(), depth.height(), -7.0f};
    const auto done =
        nook::upsample(half.view(), depth.view(), normals, result.view(), options, projection);
    REQUIRE(done);
    return {result, done.work};
}
/// The pixels that the half size shows.
Image<float> halved(const Image<float>& image)
{
    const auto half = nook::half_view(image.view());
    return make(half.width, half.height, [&](int x, int y) { return half(x, y); });
}

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

bool is_surface(float distance) { return nook::is_surface(distance, 1e30f); }

/// A pixel from positions in view space, in double: where its half pixels lie, and what it takes.
struct Plain {
    double value = 1;
    bool agreed = true;
    /// The half pixels and how much they disagree, where none agrees.
    struct Candidate {
        double value, deviation;
    };
    std::vector<Candidate> candidates{};

    /// Some values disagree alike: either may be the one that is taken.
    [[nodiscard]] bool allows(float result) const
    {
        double least = HUGE_VAL;
        for (const Candidate& candidate : candidates) least = std::min(least, candidate.deviation);
        return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& candidate) {
            return candidate.value == double{result} && candidate.deviation <= 1.001 * least + 1e-3;
        });
    }

    Plain(const Image<float>& half, const Image<float>& depth, const NormalSource* normals,
          const UpsampleOptions& options, const Projection& projection, int x, int y)
    {
        const auto distance = [&](int i, int j) {
            if (i < 0 || j < 0 || i >= depth.width() || j >= depth.height()) return 0.0;
            return is_surface(depth(i, j)) ? double{depth(i, j)} : 0.0;
        };
        const auto normal = [&](int i, int j) { return nook::detail::unit_normal(*normals, i, j); };
        const auto usable = [&](int i, int j) {
            if (!(distance(i, j) > 0)) return false;
            if (normals == nullptr) return true;
            const auto n = normal(i, j);
            return n.x != 0 || n.y != 0 || n.z != 0;
        };
        if (!usable(x, y)) return;
        const double d = distance(x, y);
        const nook::DepthStep step{0, 0x1p-23, 0};
        const double allowed = d * options.tolerance + options.length + 9 * step(d);
        const auto slope = [&](int right, int down) {
            return nook::detail::straight_slope(
                [&](int i) {
                    const double z = distance(x + i * right, y + i * down);
                    return projection.orthographic || !(z > 0) ? z : 1 / z;
                },
                allowed / 4 / (projection.orthographic ? 1 : d * d));
        };
        double sum = 0, weights = 0;
        for (const int j : {y / 2, (y + 1) / 2})
            for (const int i : {x / 2, (x + 1) / 2}) {
                const int to_x = 2 * i, to_y = 2 * j;
                // In even columns and rows there is one half pixel, not two.
                if ((to_x > x && x % 2 == 0) || (to_y > y && y % 2 == 0)) continue;
                if (!usable(to_x, to_y) || !nook::detail::is_finite(half(i, j))) continue;
                const double q = distance(to_x, to_y);
                double e = 0, facing = 1;
                if (normals != nullptr) {
                    const auto n = normal(x, y), m = normal(to_x, to_y);
                    const auto p = nook::view_point(projection, x + 0.5, y + 0.5, d);
                    const auto t = nook::view_point(projection, to_x + 0.5, to_y + 0.5, q);
                    e = (n.x * (t.x - p.x) + n.y * (t.y - p.y) + n.z * (t.z - p.z)) / allowed;
                    facing = std::clamp((n.x * m.x + n.y * m.y + n.z * m.z - options.least_cosine) /
                                            (1 - options.least_cosine),
                                        0.0, 1.0);
                } else {
                    const double linear = (to_x - x) * slope(1, 0) + (to_y - y) * slope(0, 1);
                    e = projection.orthographic ? (q - (d + linear)) / allowed
                                                : d * (q * (1 / d + linear) - 1) / allowed;
                }
                const double weight = std::max(1 - e * e, 0.0) * facing;
                weights += weight;
                sum += weight * half(i, j);
                candidates.push_back({half(i, j), std::fabs(e)});
            }
        agreed = weights > 0;
        if (agreed) value = sum / weights;
        if (agreed || candidates.empty()) candidates = {{value, 0}};
    }
};

}  // namespace

TEST_CASE("upsampling random scenes agrees with the plain form in double to 1e-4")
{
    Random random{1};
    for (int round = 0; round < 60; ++round) {
        // The last ones are cut into several bands.
        const int width = 1 + random.below(70), height = 1 + random.below(round < 55 ? 40 : 300);
        const Projection projection = camera(width, height, random.chance(0.4));
        const bool with_normals = random.chance(0.5);
        const Image<float> depth =
            random_scene(random, projection, width, height, random.chance(0.5) ? 0.1 : 0);
        const Normals normals{
            width, height, [&](int x, int y) {
                return random.chance(0.02) ? Vec{0, 0, 0} : leaning(20 + x, 0.05 * y);
            }};
        Image<float> half =
            noise((width + 1) / 2, (height + 1) / 2, static_cast<std::uint64_t>(round));
        half(half.width() / 2, half.height() / 2) = round % 2 == 0 ? not_a_number : -infinity;
        const UpsampleOptions options{.tolerance = 0.01, .length = 0.02, .least_cosine = 0.3};
        const NormalSource source = normals;
        const Result fast = with_normals ? upsample(half, depth, source, options, projection)
                                         : upsample(half, depth, options, projection);
        std::uint64_t lonely = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const Plain plain{
                    half, depth, with_normals ? &source : nullptr, options, projection, x, y};
                CAPTURE(x);
                CAPTURE(y);
                CAPTURE(round);
                lonely += plain.agreed ? 0 : 1;
                if (!plain.agreed) REQUIRE(plain.allows(fast.image(x, y)));
                else REQUIRE(std::fabs(double{fast.image(x, y)} - plain.value) <= accuracy);
            }
        CHECK(fast.work.samples == lonely);
        CHECK(fast.work.pixels == static_cast<std::uint64_t>(width * height));
    }
}

TEST_CASE("pixels that coincide with a half pixel take its value exactly")
{
    for (const bool orthographic : {false, true}) {
        const int width = 75, height = 43;
        const Projection projection = camera(width, height, orthographic);
        Random random{2};
        const Image<float> depth = random_scene(random, projection, width, height, 0.1);
        const Image<float> half = noise((width + 1) / 2, (height + 1) / 2, 3);
        const Normals normals{width, height, [&](int x, int y) { return leaning(3 * x, y); }};
        for (const Image<float>& image :
             {upsample(half, depth, {}, projection).image,
              upsample(half, depth, normals, {.least_cosine = 0.99}, projection).image})
            for (int y = 0; y < height; y += 2)
                for (int x = 0; x < width; x += 2)
                    REQUIRE(image(x, y) == (is_surface(depth(x, y)) ? half(x / 2, y / 2) : 1));
    }
}

TEST_CASE(
    "upsampling keeps constants, sky stays exactly 1, and nothing leaves the range of its values")
{
    const int width = 90, height = 51;
    const Projection projection = camera(width, height);
    Random random{4};
    const Image<float> depth = random_scene(random, projection, width, height, 0.3);
    for (const float constant : {1.0f, 0.3f, 0.0f}) {
        const Image<float> half{(width + 1) / 2, (height + 1) / 2, constant};
        const Image<float> image = upsample(half, depth, {}, projection).image;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                // Surfaces with sky on all half pixels around have nobody to take from.
                bool alone = true;
                for (const int j : {y / 2, (y + 1) / 2})
                    for (const int i : {x / 2, (x + 1) / 2})
                        alone = alone && (2 * i >= width || 2 * j >= height ||
                                          !is_surface(depth(2 * i, 2 * j)));
                const bool taken = is_surface(depth(x, y)) && !alone;
                REQUIRE(image(x, y) == (taken ? constant : 1));
            }
    }
    const float low = 0.3f, high = std::nextafter(low, 1.0f);
    const Image<float> rough = noise((width + 1) / 2, (height + 1) / 2, 5);
    const Image<float> two = make(rough.width(), rough.height(),
                                  [&](int x, int y) { return rough(x, y) < 0.5f ? low : high; });
    for (const float value : upsample(two, depth, {}, projection).image)
        CHECK((value == low || value == high || value == 1));
}

TEST_CASE("no bleeding over silhouettes: two surfaces keep their own visibility, without edges")
{
    const int width = 80, height = 60;
    for (const bool orthographic : {false, true})
        for (const double step : {1.05, 10.0}) {
            const Projection projection = camera(width, height, orthographic);
            // Every boundary runs past half pixels of both sides: blobs of three pixels and more.
            const auto in_front = [](int x, int y) {
                const int dx = x - 37, dy = y - 29;
                return dx * dx + dy * dy < 400 || (x > 69 && y % 16 < 7);
            };
            const Image<float> depth =
                make(width, height, [&](int x, int y) { return in_front(x, y) ? 1 : step; });
            const Image<float> expected =
                make(width, height, [&](int x, int y) { return in_front(x, y) ? 0.2f : 0.7f; });
            const Result result = upsample(halved(expected), depth, {}, projection);
            CHECK(result.work.samples == 0);
            CHECK(same_bits(result.image, expected));
            const Normals facing{width, height, [](int, int) { return Vec{0, 0, 1}; }};
            CHECK(same_bits(upsample(halved(expected), depth, facing, {}, projection).image,
                            expected));
        }
}

TEST_CASE(
    "a line that falls between the half pixels takes the visibility beside it, and is counted")
{
    const int width = 64, height = 32;
    const Projection projection = camera(width, height);
    const auto missed = [](int x, int y) { return x == 21 || y == 13; };
    const auto seen = [](int x, int) { return x == 40; };
    const Image<float> depth = make(width, height, [&](int x, int y) {
        return missed(x, y) ? 1 : seen(x, y) ? 1.5 : x < 32 ? 10 : 12;
    });
    // The wall to the left is dark, the one to the right is bright; so are the lines before them.
    const Image<float> half = make(width / 2, height / 2, [&](int x, int y) {
        return seen(2 * x, 2 * y) ? 0.5 : 2 * x < 32 ? 0.125 : 0.875;
    });
    const Result result = upsample(half, depth, {}, projection);
    std::uint64_t lonely = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const float value = result.image(x, y);
            if (missed(x, y)) {
                ++lonely;
                // The least disagreeing half pixel is the nearest in depth: the seen line, where that is
                // beside it, or else the wall behind. Nothing between, nothing brighter or darker.
                const float expected = std::abs(x - 40) < 2 ? 0.5f : x < 32 ? 0.125f : 0.875f;
                REQUIRE(value == expected);
            } else {
                REQUIRE(value == (seen(x, y) ? 0.5f : x < 32 ? 0.125f : 0.875f));
            }
        }
    // Pixels of the seen line in odd rows agree with it; those of the wall agree with the wall.
    CHECK(result.work.samples == lonely);
}

TEST_CASE("a visibility that is linear on screen comes back on planes of every tilt and encoding")
{
    const int width = 97, height = 61;
    for (const bool orthographic : {false, true}) {
        Projection projection = camera(width, height, orthographic);
        if (!orthographic) projection.fx = projection.fy = 3000;
        const Image<float> expected =
            make(width, height, [](int x, int y) { return 0.1 + 0.005 * x + 0.004 * y; });
        for (const double tilt : {0.0, 60.0, 85.0}) {
            const Vec n = leaning(tilt, 2.0);
            const Image<float> depth = make(width, height, [&](int x, int y) {
                return plane_distance(projection, n, orthographic ? 400 : 20, x, y);
            });
            const Normals normals{width, height, [&](int, int) { return n; }};
            CHECK(difference(upsample(halved(expected), depth, {}, projection).image, expected) <=
                  1e-6);
            CHECK(difference(upsample(halved(expected), depth, normals, {}, projection).image,
                             expected) <= 1e-6);
            Projection encoded = projection;
            encoded.encoding = nook::DepthEncoding::reversed;
            encoded.near_plane = 0.5;
            encoded.far_plane = orthographic ? 1000 : HUGE_VAL;
            Image<std::uint16_t> stored{width, height};
            REQUIRE(nook::encode_depths<nook::HalfStorage>(depth.view(), stored.view(), encoded));
            const auto source =
                nook::hardware_depth<nook::HalfStorage>(std::as_const(stored).view(), encoded);
            const Result coarse = upsample(halved(expected), source, {}, projection);
            CHECK(coarse.work.samples == 0);
            CHECK(difference(coarse.image, expected) <= 2e-3);
        }
    }
}

TEST_CASE("a kernel at half size and its upsampling: sky is 1, and flat ground stays white")
{
    const int width = 128, height = 96;
    const Projection projection = camera(width, height);
    // A floor under the sky, with a box on it.
    const Image<float> depth = make(width, height, [&](int x, int y) {
        if (y < 30) return HUGE_VAL;
        if (x > 50 && x < 80 && y < 60) return 8.0;
        return 400.0 / (y - 20);
    });
    const auto half = nook::half_source(depth.view());
    Image<float> small{half.image.width, half.image.height};
    REQUIRE(nook::chebyshev_ao(half, small.view(), {.window = 9}));
    CHECK(*std::min_element(small.begin(), small.end()) < 0.7f);
    const Image<float> image = upsample(small, depth, {}, projection).image;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (y < 30) REQUIRE(image(x, y) == 1);
            REQUIRE((image(x, y) >= 0 && image(x, y) <= 1));
        }
}

TEST_CASE("under the half work map computed pixels have the bits of the call without one")
{
    const int width = 115, height = 46;
    const Projection projection = camera(width, height);
    Random random{6};
    const Image<float> depth = random_scene(random, projection, width, height, 0.05);
    const int across = nook::WorkMap::groups(width);
    std::vector<std::uint8_t> full(static_cast<std::size_t>(across * height));
    for (auto& group : full) group = random.chance(0.2) ? 1 : 0;
    const nook::WorkMap map{{full.data(), across, height, across}, false};
    const Image<float> half = noise((width + 1) / 2, (height + 1) / 2, 7);
    const int half_across = (across + 1) / 2;
    std::vector<std::uint8_t> groups(static_cast<std::size_t>(half_across * half.height()));
    REQUIRE(nook::half_work_map(map, {groups.data(), half_across, half.height(), half_across}));
    const nook::WorkMap half_map{{groups.data(), half_across, half.height(), half_across}, false};
    // What a kernel leaves in skipped pixels must not matter.
    const Image<float> masked = make(half.width(), half.height(), [&](int x, int y) {
        return half_map.is_active(x, y) ? half(x, y) : 1;
    });
    const Normals normals{width, height, [&](int x, int y) { return leaning(0.4 * x, y); }};
    const Result whole = upsample(half, depth, {}, projection);
    const Result part = upsample(masked, depth, {}, projection, map);
    const Image<float> whole_guided = upsample(half, depth, normals, {}, projection).image;
    Image<float> part_guided{width, height};
    REQUIRE(nook::upsample(masked.view(), depth.view(), normals, part_guided.view(), {}, projection,
                           map));
    std::uint64_t skipped = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool active = map.is_active(x, y);
            skipped += !active && is_surface(depth(x, y)) ? 1 : 0;
            REQUIRE(part.image(x, y) == (active ? whole.image(x, y) : 1));
            REQUIRE(part_guided(x, y) == (active ? whole_guided(x, y) : 1));
        }
    CHECK(part.work.skipped == skipped);
    CHECK(part.work.background == whole.work.background);
}

TEST_CASE("upsampling has the same bits for any number of threads, strides and with lent scratch")
{
    const int width = 71, height = 150;
    const Projection projection = camera(width, height);
    Random random{8};
    const Image<float> depth = random_scene(random, projection, width, height, 0.05);
    const Image<float> half = noise((width + 1) / 2, (height + 1) / 2, 9);
    const Image<float> expected = upsample(half, depth, {}, projection).image;
    nook::ThreadExecutor threads{3};
    Image<float> other{width, height};
    REQUIRE(nook::upsample(half.view(), depth.view(), other.view(), {}, projection, {},
                           nook::HeapScratch{}, threads));
    CHECK(same_bits(other, expected));

    // The half size inside a buffer of full size, bottom up, with the depth and the result.
    const int stride = 3 * width + 5;
    std::vector<float> buffer(static_cast<std::size_t>(stride * height), not_a_number);
    const auto channel = [&](int index) {
        return nook::ImageView<float>{buffer.data() + (height - 1) * stride + index, width, height,
                                      -stride, 3};
    };
    const auto small = nook::half_view(channel(2));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) channel(0)(x, y) = depth(x, y);
    for (int y = 0; y < small.height; ++y)
        for (int x = 0; x < small.width; ++x) small(x, y) = half(x, y);
    const std::size_t size =
        nook::upsample_scratch_size(half.view(), channel(0), channel(1), false);
    std::vector<std::byte> lent(size + 1, std::byte{0xff});
    REQUIRE(nook::upsample(half.view(), channel(0), channel(1), {}, projection, {},
                           nook::Scratch{lent.data(), size}));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) REQUIRE(channel(1)(x, y) == expected(x, y));
    CHECK(lent.back() == std::byte{0xff});
    CHECK(nook::upsample(half.view(), channel(0), channel(1), {}, projection, {},
                         nook::Scratch{lent.data(), size - 1})
              .error.code == nook::ErrorCode::scratch_too_small);

    // Double throughout: within rounding of the floats.
    const Image<double> fine_depth =
        make<double>(width, height, [&](int x, int y) { return depth(x, y); });
    const Image<double> fine_half =
        make<double>(half.width(), half.height(), [&](int x, int y) { return half(x, y); });
    Image<double> fine{width, height};
    const nook::DepthSource source{fine_depth.view(), nook::IdentityDecode{}, {0, 0x1p-23, 0}};
    REQUIRE(nook::upsample(fine_half.view(), source, fine.view(), {}, projection));
    CHECK(difference(fine, expected) <= accuracy);
}

TEST_CASE("wild depths, normals and values give no NaN")
{
    const int width = 53, height = 29;
    Random random{10};
    const std::array odd{1e-42f, 1e-38f, 1e-20f, 1.0f,     1e20f,        3e38f,
                         0.0f,   -1.0f,  2.0f,   infinity, not_a_number, 1.00001f};
    const auto any = [&] { return odd[static_cast<std::size_t>(random.below(int(odd.size())))]; };
    for (const bool orthographic : {false, true}) {
        const Projection projection = camera(width, height, orthographic);
        const Image<float> depth = make(width, height, [&](int, int) { return any(); });
        const Image<float> half = make((width + 1) / 2, (height + 1) / 2, [&](int, int) {
            return random.chance(0.2) ? double{not_a_number} : random.uniform();
        });
        const Normals normals{width, height, [&](int, int) { return Vec{any(), any(), any()}; }};
        for (const UpsampleOptions& options :
             {UpsampleOptions{}, UpsampleOptions{.tolerance = 0, .least_cosine = -1},
              UpsampleOptions{.tolerance = 1e12, .length = 1e300}})
            for (const Image<float>& image :
                 {upsample(half, depth, options, projection).image,
                  upsample(half, depth, normals, options, projection).image})
                for (const float value : image) REQUIRE((value >= 0 && value <= 1));
    }
}

TEST_CASE("a bad argument of upsample is named, and nothing is written")
{
    const int width = 21, height = 10;
    const Projection projection = camera(width, height);
    const Image<float> depth{width, height, 2.0f}, half = noise(11, 5, 11);
    const Image<float> untouched{width, height, -7.0f};
    Image<float> out = untouched;
    const auto argument = [&](const nook::Outcome& outcome) {
        CHECK(same_bits(out, untouched));
        return std::string{outcome.error.argument};
    };
    const Image<float> narrow = noise(10, 5, 12), low = noise(11, 4, 13);
    CHECK(argument(nook::upsample(narrow.view(), depth.view(), out.view(), {}, projection)) ==
          "half");
    CHECK(argument(nook::upsample(low.view(), depth.view(), out.view(), {}, projection)) == "half");
    CHECK(argument(nook::upsample(half.view(), depth.view(), out.view(), {.tolerance = -1},
                                  projection)) == "options.tolerance");
    CHECK(argument(nook::upsample(half.view(), depth.view(), out.view(), {.length = -1},
                                  projection)) == "options.length");
    CHECK(argument(nook::upsample(half.view(), depth.view(), out.view(), {.least_cosine = 2},
                                  projection)) == "options.least_cosine");
    CHECK(argument(nook::upsample(half.view(), depth.view(), out.view(), {}, Projection{})) ==
          "projection.fx");
    CHECK(argument(nook::upsample(nook::half_view(std::as_const(out).view()), depth.view(),
                                  out.view(), {}, projection)) == "visibility");
    const Normals few{width - 1, height, [](int, int) { return Vec{0, 0, 1}; }};
    CHECK(argument(nook::upsample(half.view(), depth.view(), NormalSource{few}, out.view(), {},
                                  projection)) == "normals.x");
    CHECK(nook::upsample(nook::ImageView<const float>{}, nook::ImageView<const float>{},
                         nook::ImageView<float>{}, {}, projection));
}
