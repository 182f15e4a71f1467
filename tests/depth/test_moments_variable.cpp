#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <nook/depth/cantelli.hpp>
#include <nook/depth/moments_direct.hpp>
#include <nook/depth/moments_variable.hpp>
#include <nook/depth/source.hpp>
#include <nook/execution.hpp>
#include <nook/owned_image.hpp>
#include <nook/thread_executor.hpp>

namespace {

using nook::Border;
using nook::Image;
using nook::detail::direct_moments;
using nook::detail::native_lanes;
using nook::detail::Span;
using nook::detail::WindowRadius;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr int every = native_lanes;

/// Radii inversely proportional to the distance.
struct Inverse {
    double x, y;  ///< radius times distance
    WindowRadius largest;
    double bias = 0;  ///< a variance

    template <class Real>
    struct Radii {
        Real x, y;
    };
    template <class Real>
    [[nodiscard]] static Real whole(const Real& value)
    {
        return nook::detail::convert<double>(nook::detail::convert<std::int32_t>(value));
    }
    template <class Real>
    [[nodiscard]] Radii<Real> radii(const Real& distance) const
    {
        const auto bounded = [&](double reach, int most) {
            return whole<Real>(nook::detail::smaller(Real(reach / distance), Real{} + most));
        };
        return {bounded(x, largest.x), bounded(y, largest.y)};
    }
    template <class Real>
    [[nodiscard]] Real slack(const Real&) const
    {
        return Real{} + bias;
    }
};
Inverse all_alike(int x, int y) { return {1e60, 1e60, {x, y}}; }
Inverse all_alike(int radius) { return all_alike(radius, radius); }

struct Moments {
    Image<double> count, open, variance, deviation;
    nook::Work work{};

    Moments(int width, int height)
        : count{width, height, -1},
          open{width, height, -1},
          variance{width, height, -1},
          deviation{width, height, -1}
    {}
    bool operator==(const Moments& other) const
    {
        return count == other.count && open == other.open && variance == other.variance &&
               deviation == other.deviation;
    }
};

struct Everything {
    bool operator()(int, int) const { return true; }
};

/// Keeps the moments; those of background are 0.
template <class Wanted>
struct Keep {
    using Value = double;
    static constexpr int results = 4;
    Moments& moments;
    const Wanted& wanted_at;

    template <class Real>
    void shade(const Real&, const Real& count, const Real& open, const Real& variance,
               const Real& deviation, Real* result) const
    {
        result[0] = count;
        result[1] = open;
        result[2] = variance;
        result[3] = deviation;
    }
    [[nodiscard]] bool wanted(int x, int y) const { return wanted_at(x, y); }
    template <class Distance>
    void row(nook::Work& work, int y, int x, int width, const double* values, std::ptrdiff_t stride,
             const Distance* distances) const
    {
        work.pixels += static_cast<std::uint64_t>(width);
        for (int i = 0; i < width; ++i) {
            const bool surface = distances == nullptr || distances[i] > 0;
            const bool known = surface && wanted_at(x + i, y);
            moments.count(x + i, y) = known ? values[i] : 0;
            moments.open(x + i, y) = known ? values[stride + i] : 0;
            moments.variance(x + i, y) = known ? values[2 * stride + i] : 0;
            moments.deviation(x + i, y) = known ? values[3 * stride + i] : 0;
        }
    }
};

template <int lanes = every, class Depth, class Wanted = Everything, class E = nook::Serial>
Moments filter(const Depth& depth, const Inverse& window, Border border = Border::symmetric,
               const Wanted& wanted = {}, E&& executor = {})
{
    const auto& source = nook::depth_source(depth);
    const int width = source.image.width, height = source.image.height;
    Moments moments{width, height};
    const nook::detail::VariableMoments<nook::distance_t<Depth>, lanes> engine{
        width, height, window.largest, border};
    const auto outcome =
        engine.run(source, window, Keep<Wanted>{moments, wanted}, nook::HeapScratch{}, executor);
    REQUIRE(outcome);
    CHECK(outcome.work.pixels ==
          static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height));
    moments.work = outcome.work;
    return moments;
}
template <int lanes = every>
Moments filter(const Image<float>& image, const Inverse& window, Border border = Border::symmetric)
{
    return filter<lanes>(image.view(), window, border);
}

struct Window {
    Span across, down;
    [[nodiscard]] int samples() const { return nook::detail::samples_in(across, down); }
    [[nodiscard]] bool contains(int x, int y) const
    {
        return x >= across.first && x <= across.last && y >= down.first && y <= down.last;
    }
};
template <class Distance>
Window window_at(const Image<Distance>& image, const Inverse& window, Border border, int x, int y)
{
    const auto radii = window.radii(static_cast<double>(image(x, y)));
    return {nook::detail::window_span(x, int(radii.x), image.width(), border),
            nook::detail::window_span(y, int(radii.y), image.height(), border)};
}
template <class Distance>
bool surface(const Image<Distance>& image, int x, int y)
{
    const auto view = image.view();
    return nook::surface_distance(nook::depth_source(view), x, y) > 0;
}

/// Largest difference of the visibility from that of `direct_moments`; counts
/// must agree.
template <class Distance>
double worst_visibility(const Image<Distance>& image, const Inverse& window,
                        Border border = Border::symmetric, int step_x = 1, int step_y = 1)
{
    const auto view = image.view();
    const Moments moments = filter(view, window, border);
    double worst = 0;
    for (int y = 0; y < image.height(); y += step_y)
        for (int x = 0; x < image.width(); x += step_x) {
            CAPTURE(x);
            CAPTURE(y);
            if (!surface(image, x, y)) {
                REQUIRE(moments.count(x, y) == 0);
                continue;
            }
            const Window w = window_at(image, window, border, x, y);
            const auto expected =
                direct_moments<double>(nook::depth_source(view), image(x, y), w.across, w.down);
            REQUIRE(moments.count(x, y) == expected.count);
            REQUIRE(std::fabs(moments.open(x, y) - expected.background / double(w.samples())) <
                    1e-15);
            REQUIRE(moments.variance(x, y) >= 0);
            const double result = nook::cantelli_upper_bound(moments.variance(x, y),
                                                             moments.deviation(x, y), window.bias);
            const double exact =
                nook::cantelli_upper_bound(expected.variance, expected.deviation, window.bias);
            // Where all samples are alike, a mean may be off by an ulp in the
            // reference only.
            if (expected.variance == 0 && window.bias == 0) {
                CHECK(moments.variance(x, y) == 0);
                continue;
            }
            worst = std::max(worst, std::fabs(result - exact));
        }
    return worst;
}

Image<float> make(int width, int height, const std::function<double(int, int)>& value)
{
    Image<float> image{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(value(x, y));
    return image;
}

/// The same bits; under -ffast-math, whose reassociation differs from loop to
/// loop, nearly.
bool same(double a, double b)
{
#if defined(__FAST_MATH__)
    return std::fabs(a - b) <= 1e-12 * (1 + std::fabs(a));
#else
    return a == b;
#endif
}

class Random {
public:
    explicit Random(unsigned seed) : engine_{seed} {}
    double uniform() { return static_cast<double>(engine_()) * 0x1p-32; }
    int below(int bound) { return static_cast<int>(uniform() * bound); }

private:
    std::mt19937 engine_;
};

struct Picture {
    std::string name;
    Image<float> image;
    Inverse window;
};
/// Depths of every kind, each with windows of many sizes.
std::vector<Picture> pictures()
{
    Random random{5};
    const int width = 301, height = 143;
    const auto noise = [&](double size) { return size * (random.uniform() - 0.5); };
    std::vector<Picture> result;
    const auto add = [&](const char* name, double reach, int largest, double bias,
                         const std::function<double(int, int)>& value) {
        result.push_back(
            {name, make(width, height, value), {reach, reach, {largest, largest}, bias}});
    };
    add("a floor in perspective", 60, 20, 0, [](int, int y) { return 200.0 / (y + 5); });
    add("a slope with relief", 900, 31, 0,
        [&](int x, int y) { return 20 + 0.3 * x + 0.1 * y + noise(1e-3); });
    add("relief of an ulp at 1e5", 1e6, 17, 0,
        [&](int, int) { return random.uniform() < 0.5 ? 1e5 : 1e5 + 0.0078125; });
    add("boxes on a plane", 300, 25, 0, [&](int x, int y) {
        return (x / 23 + y / 17) % 3 == 0 ? 9.0 + 0.01 * x : 20.0 + noise(1e-4);
    });
    add("five decades of noise", 3, 30, 0,
        [&](int, int) { return std::pow(10.0, -5 * random.uniform()); });
    add("six decades of ground", 40, 40, 0,
        [&](int x, int y) { return 1e5 * std::pow(10.0, -y / 24.0) * (1 + 1e-3 * (x % 7)); });
    add("a hand before mountains", 8, 31, 1e-14, [&](int x, int y) {
        return x < 180 && y > 60 ? 0.31 + 1e-3 * noise(1) + 1e-4 * x : 9e4 + 10 * noise(1) + y;
    });
    add("background in a third", 300, 25, 0, [&](int x, int y) {
        return random.uniform() < 0.3 || y < 20 ? infinity : 15 + 0.02 * x + noise(1);
    });
    add("a wall and background beyond", 500, 40, 1e-10,
        [&](int x, int y) { return x + y > 260 ? -1.0 : 30.0 + 0.01 * y + noise(1e-3); });
    add("denormal distances", 1e-39, 20, 0,
        [&](int, int) { return 1e-42 * (1 + random.below(50)); });
    add("the largest floats", 3e39, 20, 0,
        [&](int, int) { return 3.3e38 * (0.5 + 0.5 * random.uniform()); });
    add("radii that jump between none and the largest", 1000, 40, 0,
        [&](int x, int y) { return (x / 3 + y / 2) % 2 == 0 ? 1.0 : 1001 + noise(1); });
    add("flat ground and a flat dome far away", 60, 30, 0,
        [](int, int y) { return y < 70 ? 1e5 : 0.3 + 0.001 * (143 - y); });
    return result;
}

}  // namespace

TEST_CASE(
    "sums of whole distances are exact, so moments are the exact ones "
    "but for a last rounding")
{
    Random random{3};
    for (const int largest : {1, 4, 9, 40}) {
        const auto image = make(130, 71, [&](int, int) { return 1 + random.below(1000); });
        const Inverse window{4000, 3000, {largest, largest}};
        const Moments moments = filter(image, window);
        for (int y = 0; y < image.height(); ++y)
            for (int x = 0; x < image.width(); ++x) {
                const Window w = window_at(image, window, Border::symmetric, x, y);
                std::int64_t n = 0, sum = 0, squares = 0;
                for (int j = w.down.first; j <= w.down.last; ++j)
                    for (int i = w.across.first; i <= w.across.last; ++i) {
                        const auto value = static_cast<std::int64_t>(image(i, j));
                        ++n;
                        sum += value;
                        squares += value * value;
                    }
                const auto own = static_cast<std::int64_t>(image(x, y));
                const double size = static_cast<double>(n);
                REQUIRE(moments.count(x, y) == size);
                REQUIRE(moments.open(x, y) == 0);
                REQUIRE(std::llround(moments.variance(x, y) * size * size) ==
                        n * squares - sum * sum);
                REQUIRE(std::llround(moments.deviation(x, y) * size) == n * own - sum);
            }
        CHECK(moments.work.samples == 0);
    }
}

TEST_CASE("a constant image has no variance and no deviation, wherever it lies")
{
    for (const double value : {1e-45, 1e-38, 0.1, 1.0, 1e5, 1e30, 3e38})
        for (const Border border : {Border::symmetric, Border::clip}) {
            const Image<float> image{97, 61, static_cast<float>(value)};
            const Moments moments = filter(image, all_alike(12, 7), border);
            for (const double variance : moments.variance) REQUIRE(variance == 0);
            for (const double deviation : moments.deviation) REQUIRE(deviation == 0);
        }
}

TEST_CASE("one pixel an ulp behind the others keeps its exact variance")
{
    auto image = make(90, 50, [](int, int) { return 1000; });
    image(41, 22) = std::nextafter(1000.f, 2000.f);
    const double ulp = double{image(41, 22)} - 1000;
    const Moments moments = filter(image, all_alike(10));
    const double n = 21 * 21;
    CHECK(moments.deviation(41, 22) == doctest::Approx(ulp * (n - 1) / n).epsilon(1e-12));
    CHECK(moments.variance(41, 22) ==
          doctest::Approx(ulp * ulp * (n - 1) / (n * n)).epsilon(1e-12));
    CHECK(moments.variance(30, 22) == 0);
}

TEST_CASE(
    "the visibility of any picture differs from that of the samples read "
    "directly by 1e-5 at most")
{
    for (const Picture& picture : pictures())
        for (const Border border : {Border::symmetric, Border::clip}) {
            CAPTURE(picture.name);
            CHECK(worst_visibility(picture.image, picture.window, border, 3, 2) <= 1e-5);
        }
}

TEST_CASE("one lane and all lanes give the same bits")
{
    for (const Picture& picture : pictures())
        for (const Border border : {Border::symmetric, Border::clip}) {
            CAPTURE(picture.name);
            const auto all = filter<every>(picture.image, picture.window, border);
            const auto one = filter<1>(picture.image, picture.window, border);
            CHECK(all.count == one.count);
#if !defined(__FAST_MATH__)
            CHECK(all.open == one.open);
            CHECK(all.variance == one.variance);
            CHECK(all.deviation == one.deviation);
#endif
            CHECK(all.work.samples == one.work.samples);
        }
}

TEST_CASE("any number of threads gives the same bits")
{
    Random random{8};
    const auto image = make(700, 600, [&](int x, int y) {
        return random.uniform() < 0.1 ? infinity : 1 + 0.01 * x + 1e4 / (y + 1) + random.uniform();
    });
    const Inverse window{60, 60, {30, 30}};
    const Moments serial = filter(image, window);
    for (const int workers : {2, 3, 7}) {
        nook::ThreadExecutor threads{workers};
        CHECK(filter(image.view(), window, Border::symmetric, Everything{}, threads) == serial);
    }
}

TEST_CASE(
    "windows that are larger than the image, and images of one pixel, "
    "row or column, are right")
{
    Random random{12};
    struct Size {
        int width, height;
    };
    for (const Size size : {Size{1, 1}, {1, 40}, {40, 1}, {7, 5}, {15, 16}, {17, 33}, {64, 9}})
        for (const int radius : {0, 1, 7, 8, 9, 2047})
            for (const Border border : {Border::symmetric, Border::clip}) {
                CAPTURE(size.width);
                CAPTURE(size.height);
                CAPTURE(radius);
                const auto image =
                    make(size.width, size.height, [&](int, int) { return 1 + random.uniform(); });
                CHECK(worst_visibility(image, all_alike(radius), border) <= 1e-12);
            }
}

TEST_CASE("windows of thousands of pixels are right")
{
    Random random{4};
    const auto image = make(900, 700, [&](int x, int) {
        return random.uniform() < 0.2 ? not_a_number : 10 + 0.01 * x + random.uniform();
    });
    CHECK(worst_visibility(image, all_alike(2047), Border::clip, 211, 173) <= 1e-5);
    CHECK(worst_visibility(image, all_alike(300, 349), Border::symmetric, 89, 71) <= 1e-5);
}

TEST_CASE("radii differ along the axes")
{
    for (const Picture& picture : pictures()) {
        CAPTURE(picture.name);
        Inverse window = picture.window;
        window.x *= 0.5;
        window.largest.x = 9;
        CHECK(worst_visibility(picture.image, window, Border::symmetric, 5, 3) <= 1e-5);
    }
}

TEST_CASE("what is no surface changes no bit of windows that do not contain it")
{
    Random random{21};
    auto image = make(260, 120, [&](int x, int) { return 5 + 0.1 * x + random.uniform(); });
    const Inverse window{400, 400, {30, 30}};
    const Moments clean = filter(image, window);
    const float poison[] = {not_a_number, infinity, -infinity, 0, -3};
    struct Place {
        int x, y;
    };
    const Place places[] = {{100, 60}, {0, 0}, {259, 119}, {200, 5}, {57, 119}};
    auto poisoned = image;
    for (int i = 0; i < 5; ++i) poisoned(places[i].x, places[i].y) = poison[i];
    const Moments other = filter(poisoned, window);
    int touched = 0;
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) {
            const Window w = window_at(image, window, Border::symmetric, x, y);
            const bool reached = std::any_of(std::begin(places), std::end(places),
                                             [&](Place at) { return w.contains(at.x, at.y); });
            touched += reached;
            if (reached) continue;
            REQUIRE(other.count(x, y) == clean.count(x, y));
            REQUIRE(same(other.variance(x, y), clean.variance(x, y)));
            REQUIRE(same(other.deviation(x, y), clean.deviation(x, y)));
        }
    CHECK(touched > 1000);
    CHECK(worst_visibility(poisoned, window) <= 1e-12);
}

TEST_CASE("a spike changes nothing where it is not seen, and costs little")
{
    Random random{2};
    auto image = make(400, 300, [&](int, int) { return 1 + 1e-6 * random.uniform(); });
    const Inverse window = all_alike(6);
    const Moments clean = filter(image, window);
    CHECK(clean.work.samples == 0);
    for (const float spike : {1e30f, 1e-30f, 3e5f}) {
        auto spiked = image;
        spiked(130, 170) = spike;
        const Moments other = filter(spiked, window);
        CHECK(worst_visibility(spiked, window) <= 1e-5);
        for (int y = 0; y < image.height(); ++y)
            for (int x = 0; x < image.width(); ++x) {
                if (std::abs(x - 130) <= 6 && std::abs(y - 170) <= 6) continue;
                REQUIRE(other.variance(x, y) ==
                        doctest::Approx(clean.variance(x, y)).epsilon(1e-12));
            }
        // Its own windows, and what was read before a finer table paid.
        CHECK(other.work.samples <= 13 * 13 * 13 * 13 + 400 * 20);
    }
}

TEST_CASE("near and far surfaces in one tile are not read directly")
{
    const auto image = make(500, 400, [](int x, int y) {
        return x > 200 && y > 150 ? 0.4 + 1e-5 * ((x * 7 + y * 3) % 11) : 8e4 + x;
    });
    const Moments moments = filter(image, all_alike(25));
    CHECK(moments.work.samples < 500 * 400);
    CHECK(worst_visibility(image, all_alike(25), Border::symmetric, 7, 5) <= 1e-5);
}

TEST_CASE("unwanted pixels are not read directly and change no others")
{
    Random random{31};
    auto image = make(320, 200, [&](int, int) { return 1 + 1e-6 * random.uniform(); });
    image(100, 100) = 1e20f;
    const Inverse window = all_alike(5);
    const Moments all = filter(image, window);
    CHECK(all.work.samples > 0);
    const auto nobody = [](int, int) { return false; };
    CHECK(filter(image.view(), window, Border::symmetric, nobody).work.samples == 0);
    const auto wanted = [](int x, int y) { return x / 16 % 3 == 0 && (y < 80 || y > 120); };
    const Moments some = filter(image.view(), window, Border::symmetric, wanted);
    CHECK(some.work.samples < all.work.samples);
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) {
            if (!wanted(x, y)) continue;
            REQUIRE(some.variance(x, y) == doctest::Approx(all.variance(x, y)).epsilon(1e-12));
        }
}

TEST_CASE("double distances keep relief that floats cannot hold")
{
    Random random{17};
    Image<double> image{150, 90};
    for (double& value : image) value = 1e5 + 1e-3 * random.uniform();
    CHECK(worst_visibility(image, all_alike(8)) <= 1e-5);
    for (double& value : image) value = std::pow(10.0, 300 * random.uniform() - 150);
    CHECK(worst_visibility(image, all_alike(4), Border::clip, 3, 3) <= 1e-5);
}

TEST_CASE("decoded, strided and flipped sources give what their distances give")
{
    Random random{6};
    Image<std::uint16_t> stored{2 * 133, 75};
    Image<float> distances{133, 75};
    for (int y = 0; y < 75; ++y)
        for (int x = 0; x < 133; ++x) {
            const auto value = static_cast<std::uint16_t>(random.below(3000));
            stored(2 * x, 74 - y) = value;
            distances(x, y) = static_cast<float>(value) * 0.25f;
        }
    const nook::ImageView<const std::uint16_t> view{&stored(0, 74), 133, 75, -2 * 133, 2};
    const nook::DepthSource source{view, [](std::uint16_t z) { return float(z) * 0.25f; }};
    const Inverse window{2000, 2000, {11, 11}};
    CHECK(filter(source, window) == filter(distances, window));

    const nook::ImageView<const float> plain = distances.view();
    nook::DepthSource limited{plain, nook::IdentityDecode{}};
    limited.far_limit = 500;
    Image<float> cut = distances;
    for (float& value : cut) value = value > 500 ? infinity : value;
    CHECK(filter(limited, window) == filter(cut, window));
}

TEST_CASE("scratch of the stated size is enough, and less is an error")
{
    const auto image = make(200, 100, [](int x, int y) { return 1 + x + y; });
    const auto view = image.view();
    const Inverse window = all_alike(20);
    const nook::detail::VariableMoments<float> engine{200, 100, {20, 20}, Border::symmetric};
    const std::size_t size = engine.scratch_size(1);
    Moments moments{200, 100};
    const Everything wanted;
    const Keep<Everything> keep{moments, wanted};
    std::vector<unsigned char> memory(size);
    const auto source = nook::depth_source(view);
    CHECK(engine.run(source, window, keep, nook::Scratch{memory.data(), size}, nook::Serial{}));
    CHECK(moments == filter(image, window));
    const auto refused =
        engine.run(source, window, keep, nook::Scratch{memory.data(), size - 1}, nook::Serial{});
    CHECK(refused.error.code == nook::ErrorCode::scratch_too_small);
}
