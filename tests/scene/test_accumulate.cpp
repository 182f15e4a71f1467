#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include <nook/scene/accumulate.hpp>
#include <nook/scene/directions.hpp>

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

template <class T>
struct Picture {
    int width, height;
    std::vector<T> pixels;
    Picture(int w, int h, T value)
        : width{w},
          height{h},
          pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), value)
    {}
    nook::ImageView<T> view() { return {pixels.data(), width, height}; }
    nook::ImageView<const T> read() const { return {pixels.data(), width, height}; }
};

/// Tasks in reverse, dealt to several workers.
struct Backwards {
    int workers;
    [[nodiscard]] int concurrency() const { return workers; }
    template <class F>
    void for_each(int count, F&& f) const
    {
        for (int task = count - 1; task >= 0; --task) f(task, task % workers);
    }
};

/// A single pixel and its history.
template <class H>
struct Pixel {
    H mean = 0, weight = 0;
    template <class V, class W>
    nook::Outcome add(V value, W frame_weight, const nook::AccumulateOptions& options = {})
    {
        return nook::accumulate(nook::ImageView<const V>{&value, 1, 1}, frame_weight,
                                nook::ImageView<H>{&mean, 1, 1}, nook::ImageView<H>{&weight, 1, 1},
                                options);
    }
};

bool has_same_bits(double a, double b)
{
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

TEST_CASE("frames of rays give the bits of all their rays in one frame, for any numbers of both")
{
    for (const int directions : {1, 3, 10, 16, 37, 64, 1000}) {
        Pixel<double> pixel;
        int open = 0, wrong = 0;
        std::uint32_t seed = 1;
        for (int frame = 1; frame <= 2000; ++frame) {
            seed = nook::hash(seed);
            const int seen = static_cast<int>(seed % static_cast<std::uint32_t>(directions + 1));
            open += seen;
            CHECK(pixel.add(double(seen) / directions, directions));
            wrong += pixel.mean != double(open) / (double(frame) * directions);
            wrong += pixel.weight != double(frame) * directions;
        }
        CHECK(wrong == 0);
    }
}

TEST_CASE("blocks of one sequence converge to the result of all their directions, bit for bit")
{
    // A wall at distance 1 with radius 2; the closed form is 1 - 0.1955011094779.
    const auto seen = [](std::uint32_t first, int count) {
        std::vector<float> x(static_cast<std::size_t>(nook::direction_room(count))), y(x), z(x);
        nook::cosine_directions(nook::DirectionSet::scrambled_sobol, nook::hash(1, 2), first, count,
                                x.data(), y.data(), z.data());
        int open = 0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) open += !(x[i] >= 0.5f);
        return static_cast<float>(open) / static_cast<float>(count);
    };
    Pixel<double> pixel;
    for (std::uint32_t frame = 0; frame < 256; ++frame) {
        CHECK(pixel.add(seen(16 * frame, 16), 16));
        const std::uint32_t frames = frame + 1;
        if (std::has_single_bit(frames))
            CHECK(pixel.mean == double{seen(0, static_cast<int>(16 * frames))});
    }
    CHECK(std::fabs(pixel.mean - (1 - 0.1955011094779)) < 5 * 0.4 * std::pow(4096, -0.75));
}

TEST_CASE("a float history rounds once per frame")
{
    Pixel<float> pixel;
    double sum = 0, weight = 0;
    std::uint32_t seed = 7;
    for (int frame = 1; frame <= 1000; ++frame) {
        seed = nook::hash(seed);
        const float value = static_cast<float>(seed >> 8) * 0x1p-24f;
        const float part = static_cast<float>(1 + seed % 64);
        sum += double{value} * double{part};
        weight += double{part};
        CHECK(pixel.add(value, part));
        CHECK(std::fabs(double{pixel.mean} - sum / weight) < 2e-8 * (2 + std::sqrt(frame)));
        CHECK(double{pixel.weight} == weight);
    }
}

TEST_CASE("a value that stays leaves the mean where it is, and the mean lies between")
{
    for (const double value : {0.1, 1.0, 0.0, 1 - 0x1p-53, 1e-300}) {
        Pixel<double> pixel;
        for (int frame = 0; frame < 100; ++frame) {
            CHECK(pixel.add(value, 0.1 + frame * 0.37));
            CHECK(pixel.mean == value);
        }
    }
    Pixel<double> pixel;
    std::uint32_t seed = 5;
    for (int frame = 0; frame < 1000; ++frame) {
        seed = nook::hash(seed);
        const double value = (seed & 255) / 255.0, before = pixel.mean;
        const bool first = frame == 0;
        CHECK(pixel.add(value, 0.1 + (seed >> 8) * 1e-9));
        CHECK(pixel.mean >= (first ? value : std::fmin(before, value)));
        CHECK(pixel.mean <= (first ? value : std::fmax(before, value)));
    }
}

TEST_CASE("beyond the most weight older frames fade by a constant share")
{
    Pixel<double> pixel;
    for (int frame = 0; frame < 10; ++frame) CHECK(pixel.add(1.0, 16, {.most_weight = 64}));
    CHECK(pixel.weight == 64);
    CHECK(pixel.mean == 1);
    double expected = 1;
    for (int frame = 0; frame < 20; ++frame) {
        CHECK(pixel.add(0.0, 16, {.most_weight = 64}));
        expected *= 0.75;
        CHECK(pixel.mean == expected);
        CHECK(pixel.weight == 64);
    }
    // On the way there every frame counts alike.
    Pixel<double> young;
    CHECK(young.add(1.0, 16, {.most_weight = 64}));
    CHECK(young.add(0.0, 16, {.most_weight = 64}));
    CHECK(young.mean == 0.5);
    CHECK(young.weight == 32);
    // A frame that outweighs all that may be kept is all there is.
    for (const int weight : {64, 100}) {
        CHECK(pixel.add(0.3, weight, {.most_weight = 64}));
        CHECK(pixel.mean == 0.3);
        CHECK(pixel.weight == 64);
    }
}

TEST_CASE("weights by pixel: what was left out does not count, and 0 adds nothing")
{
    Picture<double> mean{3, 1, 0}, total{3, 1, 0};
    Picture<float> value{3, 1, 0}, weight{3, 1, 0};
    value.pixels = {0.5f, 1.0f, 1.0f};
    weight.pixels = {16, 12, 0};
    CHECK(nook::accumulate(value.read(), weight.read(), mean.view(), total.view()));
    CHECK(mean.pixels == std::vector<double>{0.5, 1, 1});
    CHECK(total.pixels == std::vector<double>{16, 12, 0});
    value.pixels = {1.0f, 0.5f, 0.25f};
    weight.pixels = {0, 4, 8};
    const nook::Outcome done =
        nook::accumulate(value.read(), weight.view(), mean.view(), total.view());
    CHECK(done);
    CHECK(done.work.pixels == 3);
    CHECK(done.work.skipped == 0);
    CHECK(done.work.passes == 1);
    CHECK(mean.pixels == std::vector<double>{0.5, 14.0 / 16, 0.25});
    CHECK(total.pixels == std::vector<double>{16, 16, 8});
}

TEST_CASE("a history that is marked, empty or broken starts anew")
{
    const double broken[][2] = {
        {nan_value, 5}, {0.5, nan_value}, {infinity, 5},  {0.5, infinity},
        {0.5, 0},       {0.5, -1},        {-infinity, 0}, {nan_value, nan_value}};
    for (const auto& history : broken) {
        Pixel<double> pixel{history[0], history[1]};
        CHECK(pixel.add(0.25f, 16));
        CHECK(pixel.mean == 0.25);
        CHECK(pixel.weight == 16);
    }
    Picture<double> mean{2, 2, 0.5}, total{2, 2, 16};
    const Picture<float> value{2, 2, 1.0f};
    Picture<std::uint8_t> reset{2, 2, 0};
    reset.pixels = {0, 1, 255, 0};
    CHECK(nook::accumulate(value.read(), 16, mean.view(), total.view(), {.reset = reset.read()}));
    CHECK(mean.pixels == std::vector<double>{0.75, 1, 1, 0.75});
    CHECK(total.pixels == std::vector<double>{32, 16, 16, 32});
}

TEST_CASE("a bad frame leaves the history as it is and is counted")
{
    const double frames[][2] = {{nan_value, 16}, {infinity, 16},  {-infinity, 16}, {0.5, nan_value},
                                {0.5, -1},       {0.5, infinity}, {nan_value, 0}};
    for (const auto& frame : frames) {
        double mean = 0.1, total = 48;
        const nook::ImageView<double> m{&mean, 1, 1}, t{&total, 1, 1};
        const nook::ImageView<const double> v{&frame[0], 1, 1}, w{&frame[1], 1, 1};
        const nook::Outcome done = nook::accumulate(v, w, m, t);
        CHECK(done);
        CHECK(done.work.skipped == 1);
        CHECK(has_same_bits(mean, 0.1));
        CHECK(has_same_bits(total, 48));
        // Neither history nor frame: open, and known by no direction.
        mean = nan_value;
        CHECK(nook::accumulate(v, w, m, t).work.skipped == 1);
        CHECK(mean == 1);
        CHECK(total == 0);
    }
    // Too large for the history.
    Pixel<float> pixel{0.5f, 16};
    CHECK(pixel.add(1e300, 16).work.skipped == 1);
    CHECK(pixel.mean == 0.5f);
    CHECK(pixel.add(0.5, 1e300).work.skipped == 1);
    CHECK(pixel.weight == 16);
}

TEST_CASE("whatever comes in, no NaN comes out")
{
    const double odd[] = {
        0,      -0.0, 1,         0.5,    -1,       1e308,     -1e308, 5e-324,
        1e-310, 3e38, nan_value, 0x1p53, infinity, -infinity, 1e-45,  0x1.fffffffffffffp1023};
    const auto stays_a_number = [&](auto history) {
        using H = decltype(history);
        int bad = 0;
        for (const double mean : odd)
            for (const double total : odd)
                for (const double value : odd)
                    for (const double weight : odd)
                        for (const double most : {1.0, 1e300, infinity}) {
                            H m = static_cast<H>(mean), t = static_cast<H>(total);
                            const bool done{nook::accumulate(
                                nook::ImageView<const double>{&value, 1, 1},
                                nook::ImageView<const double>{&weight, 1, 1},
                                nook::ImageView<H>{&m, 1, 1}, nook::ImageView<H>{&t, 1, 1},
                                {.most_weight = most})};
                            bad += !done || !nook::detail::is_finite(m) ||
                                   !nook::detail::is_finite(t) || t < 0;
                        }
        CHECK(bad == 0);
    };
    stays_a_number(0.0);
    stays_a_number(0.0f);
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    Picture<double> mean{4, 3, 0.5}, total{4, 3, 16}, other{3, 4, 0};
    Picture<float> value{4, 3, 1}, weight{4, 3, 16};
    Picture<std::uint8_t> reset{4, 2, 1};
    const auto m = mean.view(), t = total.view();
    const auto v = value.read();
    const auto refused = [&](const nook::Outcome& outcome, nook::ErrorCode code, const char* name) {
        CHECK(outcome.error.code == code);
        CHECK(std::string_view{outcome.error.argument} == name);
        CHECK(mean.pixels == std::vector<double>(12, 0.5));
        CHECK(total.pixels == std::vector<double>(12, 16));
    };
    using enum nook::ErrorCode;
    refused(nook::accumulate(v, 0, m, t), bad_value, "weight");
    refused(nook::accumulate(v, -1.0, m, t), bad_value, "weight");
    refused(nook::accumulate(v, nan_value, m, t), bad_value, "weight");
    refused(nook::accumulate(v, infinity, m, t), bad_value, "weight");
    refused(nook::accumulate(v, other.read(), m, t), bad_size, "weight");
    refused(nook::accumulate(v, 1, other.view(), t), bad_size, "history_mean");
    refused(nook::accumulate(v, 1, m, other.view()), bad_size, "history_weight");
    refused(nook::accumulate(v, 1, m, t, {.reset = reset.read()}), bad_size, "options.reset");
    for (const double most : {0.5, 0.0, -1.0, nan_value, -infinity})
        refused(nook::accumulate(v, 1, m, t, {.most_weight = most}), bad_value,
                "options.most_weight");
    refused(nook::accumulate(nook::ImageView<const float>{nullptr, 4, 3}, 1, m, t), null_data,
            "value");
    refused(nook::accumulate(v, nook::ImageView<const float>{nullptr, 4, 3}, m, t), null_data,
            "weight");
    refused(nook::accumulate(v, 1, nook::ImageView<double>{nullptr, 4, 3}, t), null_data,
            "history_mean");
    refused(nook::accumulate(mean.read(), 1, m, t), overlap, "history_mean");
    refused(nook::accumulate(v, total.read(), m, t), overlap, "history_weight");
    refused(nook::accumulate(v, 1, m, m), overlap, "history_weight");
    refused(nook::accumulate(v, 1, m, t, {}, nook::Scratch{}), scratch_too_small, "scratch");

    const nook::ImageView<float> nothing{};
    CHECK(nook::accumulate(nothing, 1, nothing, nothing, {}, nook::Scratch{}));
    CHECK(nook::accumulate(nothing, nothing, nothing, nothing));
}

TEST_CASE("strides, channels and threads change nothing")
{
    const int width = 37, height = 53;
    const auto all = static_cast<std::size_t>(width * height);
    std::vector<float> value(all), weight(all), mean(all, 0), total(all, 0), pairs(2 * all, 0);
    // The second history interleaves mean and weight, bottom row first.
    const std::ptrdiff_t last = 2 * width * (height - 1);
    const nook::ImageView<float> pair_mean{pairs.data() + last, width, height, -2 * width, 2},
        pair_weight{pairs.data() + last + 1, width, height, -2 * width, 2};
    for (std::uint32_t frame = 0; frame < 20; ++frame) {
        for (std::size_t i = 0; i < all; ++i) {
            const std::uint32_t random = nook::hash(static_cast<std::uint32_t>(i), frame);
            value[i] = static_cast<float>(random >> 8) * 0x1p-24f;
            weight[i] = static_cast<float>(random & 15);
        }
        const nook::ImageView<const float> v{value.data(), width, height},
            w{weight.data(), width, height};
        const nook::ImageView<float> m{mean.data(), width, height}, t{total.data(), width, height};
        std::vector<std::byte> lent(nook::accumulate_scratch_size(5));
        CHECK(nook::accumulate(v, w, m, t, {.most_weight = 100}));
        CHECK(nook::accumulate(v, w, pair_mean, pair_weight, {.most_weight = 100},
                               nook::Scratch{lent.data(), lent.size()}, Backwards{5}));
        int different = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                different += m(x, y) != pair_mean(x, y) || t(x, y) != pair_weight(x, y);
        CHECK(different == 0);
    }
}
