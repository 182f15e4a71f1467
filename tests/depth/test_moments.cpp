#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <nook/depth/moments.hpp>
#include <nook/owned_image.hpp>
#include <nook/thread_executor.hpp>

#include "exact.hpp"

namespace {

using nook::Border;
using nook::Image;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

struct Result {
    Image<std::int32_t> count;
    Image<double> variance, deviation, mean, mean_square;

    Result(int width, int height)
        : count{width, height},
          variance{width, height},
          deviation{width, height},
          mean{width, height},
          mean_square{width, height}
    {}
    nook::BoxMoments<double> views() { return {count, variance, deviation, mean, mean_square}; }
    friend bool operator==(const Result&, const Result&) = default;
};

enum class Form { block, separable, reference };
constexpr std::array forms{Form::block, Form::separable, Form::reference};

template <class Depth>
Result run(Form form, const Depth& depth, int window, Border border = Border::symmetric)
{
    const auto& image = nook::depth_source(depth).image;
    Result result{image.width, image.height};
    const nook::MomentsOptions options{window, border};
    nook::Outcome outcome{};
    switch (form) {
    case Form::block: outcome = nook::box_moments(depth, result.views(), options); break;
    case Form::separable:
        outcome = nook::box_moments_separable(depth, result.views(), options);
        break;
    case Form::reference:
        outcome = nook::box_moments_reference(depth, result.views(), options);
        break;
    }
    REQUIRE(outcome);
    return result;
}
Result run(Form form, const Image<float>& image, int window, Border border = Border::symmetric)
{
    return run(form, image.view(), window, border);
}

Image<float> make(int width, int height, const std::function<float(int, int)>& value)
{
    Image<float> image{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image(x, y) = value(x, y);
    return image;
}

/// The worst relative error of variance and deviation (of σ) over windows chosen at random.
double worst_error(const Image<float>& image, int radius, Border border, Form form, int windows)
{
    const Result result = run(form, image, 2 * radius + 1, border);
    std::mt19937 random{7};
    double worst = 0;
    for (int i = 0; i < windows; ++i) {
        const int x = static_cast<int>(random() % static_cast<unsigned>(image.width()));
        const int y = static_cast<int>(random() % static_cast<unsigned>(image.height()));
        if (!(image(x, y) > 0) || !std::isfinite(image(x, y))) {
            REQUIRE(result.count(x, y) == 0);
            continue;
        }
        const auto expected = exact::moments(image, x, y, radius, border);
        REQUIRE(result.count(x, y) == expected.count);
        worst =
            std::max(worst, exact::relative_error(result.variance(x, y), expected.variance, 298));
        const double sigma = std::sqrt(exact::to_double(expected.variance, 298));
        const double deviation = exact::to_double(expected.deviation, 149);
        if (sigma > 0)
            worst = std::max(worst, std::fabs(result.deviation(x, y) - deviation) / sigma);
        else CHECK(result.deviation(x, y) == 0);
    }
    return worst;
}

struct Data {
    const char* name;
    std::function<float(int, int)> value;
};
std::vector<Data> stiff_data()
{
    auto random = std::make_shared<std::mt19937>(11);
    const auto noise = [random] { return std::normal_distribution<float>{0, 1e-3f}(*random); };
    const auto uniform = [random] { return std::uniform_real_distribution<float>{0, 1}(*random); };
    return {
        {"depth 1, sigma 1e-3", [=](int, int) { return 1 + noise(); }},
        {"depth 1e3, sigma 1e-3", [=](int, int) { return 1000 + noise(); }},
        {"depth 1e5, relief of one ulp",
         [=](int, int) { return 1e5f + (uniform() < 0.5f ? 0 : 0.0078125f); }},
        {"slope 1 to 1e3 with relief 1e-3", [=](int x, int) { return 1 + float(x) * 8 + noise(); }},
        {"1e-5 to 1", [=](int, int) { return std::pow(10.f, -5 * uniform()); }},
        {"uniform", [=](int, int) { return uniform() + 0x1p-20f; }},
        {"one pixel an ulp off at 1000",
         [](int x, int y) { return x == 60 && y == 40 ? std::nextafter(1000.f, 2000.f) : 1000.f; }},
        {"spikes of 1e30 in relief of 1e-6",
         [=](int x, int y) { return (x * 7 + y * 13) % 211 == 0 ? 1e30f : 1 + 1e-3f * noise(); }},
        {"denormals", [=](int, int) { return 1e-42f * (1 + 10 * uniform()); }},
        {"near the largest float", [=](int, int) { return 3e38f * (0.1f + uniform()); }},
        {"a third background", [=](int, int) {
             const float u = uniform();
             return u < 0.1f ? 0.f : u < 0.2f ? infinity : u < 0.3f ? not_a_number : 1000 + noise();
         }}};
}

}  // namespace

TEST_CASE("all three forms agree with exact arithmetic on stiff data")
{
    for (const Data& data : stiff_data()) {
        const Image<float> image = make(127, 83, data.value);
        for (const int radius : {1, 4, 15})
            for (const Border border : {Border::symmetric, Border::clip})
                for (const Form form : forms) {
                    CAPTURE(data.name);
                    CAPTURE(radius);
                    CAPTURE(int(border));
                    CAPTURE(int(form));
                    // A pivot of the window loses at most a factor k per pass.
                    const int k = 2 * radius + 1;
                    CHECK(worst_error(image, radius, border, form, 40) <=
                          (2 * k + 6) * k * 0x1p-53);
                }
    }
}

TEST_CASE("the forms agree on random sizes, windows, borders and masks, counts exactly")
{
    std::mt19937 random{5};
    for (int i = 0; i < 60; ++i) {
        int width = 1 + int(random() % 60), height = 1 + int(random() % 60);
        if (i % 10 == 0) width = 500 + int(random() % 900), height = 1 + int(random() % 4);
        if (i % 10 == 1) width = 1 + int(random() % 4), height = 500 + int(random() % 900);
        const int window = 1 + 2 * int(random() % 25);
        const Border border = i % 2 ? Border::clip : Border::symmetric;
        const auto holes = random() % 3;
        const Image<float> image = make(width, height, [&](int, int) {
            return random() % 3 < holes ? 0.f : 100 + float(random() % 1000) / 1000;
        });
        CAPTURE(width);
        CAPTURE(height);
        CAPTURE(window);
        const Result expected = run(Form::reference, image, window, border);
        for (const Form form : {Form::block, Form::separable}) {
            const Result result = run(form, image, window, border);
            REQUIRE(result.count == expected.count);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    REQUIRE(result.variance(x, y) ==
                            doctest::Approx(expected.variance(x, y)).epsilon(1e-12).scale(1e-9));
                    REQUIRE(result.deviation(x, y) ==
                            doctest::Approx(expected.deviation(x, y)).epsilon(1e-13).scale(1));
                    REQUIRE(result.mean(x, y) ==
                            doctest::Approx(expected.mean(x, y)).epsilon(1e-12));
                    REQUIRE(result.mean_square(x, y) ==
                            doctest::Approx(expected.mean_square(x, y)).epsilon(1e-12));
                }
        }
    }
}

TEST_CASE("integer depths give the exact moments")
{
    // 3 × 3, window 3: the centre sees all nine, a corner only itself (symmetric) or four (clipped).
    const Image<float> image = make(3, 3, [](int x, int y) { return float(1 + x + 3 * y); });
    for (const Form form : forms) {
        Result result = run(form, image, 3);
        CHECK(result.count(1, 1) == 9);
        CHECK(result.mean(1, 1) == 5);
        CHECK(result.deviation(1, 1) == 0);
        CHECK(result.variance(1, 1) == doctest::Approx(60.0 / 9).epsilon(1e-15));
        CHECK(result.mean_square(1, 1) == doctest::Approx(285.0 / 9).epsilon(1e-15));
        CHECK(result.count(0, 0) == 1);
        CHECK(result.variance(0, 0) == 0);
        CHECK(result.mean(0, 0) == 1);
        CHECK(result.count(1, 0) == 3);
        result = run(form, image, 3, Border::clip);
        CHECK(result.count(0, 0) == 4);
        CHECK(result.mean(0, 0) == 3);
        CHECK(result.deviation(0, 0) == -2);
        CHECK(result.variance(0, 0) == 2.5);
    }
}

TEST_CASE("a constant image has no variance and no deviation, at any depth")
{
    for (const float depth : {1e-42f, 1e-38f, 0.1f, 1.f, 1e5f, 1e30f, 3e38f})
        for (const int window : {3, 9, 17, 63})
            for (const Form form : forms) {
                const Result result = run(form, Image<float>{40, 30, depth}, window);
                for (const double variance : result.variance) REQUIRE(variance == 0);
                for (const double deviation : result.deviation) REQUIRE(deviation == 0);
            }
}

TEST_CASE("the textbook form M2 - M1² fails where these do not")
{
    // In float, on constant images: some depth gives a variance that is not 0.
    std::mt19937 random{3};
    std::uniform_real_distribution<float> depths{1, 2};
    int wrong = 0;
    for (int i = 0; i < 100; ++i) {
        const float depth = depths(random);
        float sum = 0, squares = 0;
        for (int sample = 0; sample < 81; ++sample) {
            sum += depth;
            squares += depth * depth;
        }
        wrong += squares / 81 - sum / 81 * (sum / 81) != 0;
    }
    CHECK(wrong > 0);
}

TEST_CASE("one bad pixel changes nothing outside the windows that contain it")
{
    std::mt19937 random{9};
    const Image<float> clean =
        make(150, 90, [&](int, int) { return 1 + float(random() % 1000) * 1e-6f; });
    const int bad_x = 71, bad_y = 44, radius = 6;
    for (const float bad : {not_a_number, infinity, -infinity, -1.f, 0.f, 1e30f}) {
        Image<float> image = clean;
        image(bad_x, bad_y) = bad;
        for (const Form form : forms) {
            const Result expected = run(form, clean, 2 * radius + 1);
            const Result result = run(form, image, 2 * radius + 1);
            for (int y = 0; y < 90; ++y)
                for (int x = 0; x < 150; ++x) {
                    REQUIRE(std::isfinite(result.variance(x, y)));
                    REQUIRE(std::isfinite(result.deviation(x, y)));
                    const int rx = std::min({radius, x, 149 - x}),
                              ry = std::min({radius, y, 89 - y});
                    if (std::abs(x - bad_x) <= rx && std::abs(y - bad_y) <= ry) {
                        if (bad != 1e30f && !(x == bad_x && y == bad_y))
                            REQUIRE(result.count(x, y) == expected.count(x, y) - 1);
                        continue;
                    }
                    REQUIRE(result.count(x, y) == expected.count(x, y));
                    REQUIRE(result.variance(x, y) == expected.variance(x, y));
                    REQUIRE(result.deviation(x, y) == expected.deviation(x, y));
                }
        }
    }
}

TEST_CASE("images of nothing but background are all zeros")
{
    for (const float value : {0.f, -3.f, infinity, not_a_number}) {
        const Image<float> image{20, 10, value};
        for (const Form form : forms) CHECK(run(form, image, 5) == Result{20, 10});
    }
}

TEST_CASE("all forms count alike")
{
    const Image<float> image =
        make(20, 10, [](int x, int y) { return x < 3 && y < 2 ? infinity : 1.f; });
    Result result{20, 10};
    for (const nook::Outcome& outcome :
         {nook::box_moments(image.view(), result.views(), {5}),
          nook::box_moments_separable(image.view(), result.views(), {5}),
          nook::box_moments_reference(image.view(), result.views(), {5})}) {
        CHECK(outcome.work.pixels == 200);
        CHECK(outcome.work.background == 6);
        CHECK(outcome.work.passes == 1);
    }
}

TEST_CASE("any number of threads gives the same bits")
{
    std::mt19937 random{13};
    const Image<float> image = make(700, 300, [&](int x, int) {
        return random() % 9 == 0 ? 0.f : 1 + float(x) + float(random() % 1000) * 1e-3f;
    });
    for (const int window : {3, 31, 127}) {
        const Result expected = run(Form::block, image, window);
        for (const int workers : {2, 3, 16}) {
            nook::ThreadExecutor threads{workers};
            Result result{700, 300};
            REQUIRE(nook::box_moments(image.view(), result.views(), {window}, {}, threads));
            CHECK(result == expected);
            Result separable{700, 300};
            REQUIRE(nook::box_moments_separable(image.view(), separable.views(), {window}, {},
                                                threads));
            CHECK(separable == run(Form::separable, image, window));
        }
    }
}

TEST_CASE("a window does not depend on where the image around it ends")
{
    // Cropping moves the block boundaries: the same values, to rounding.
    std::mt19937 random{17};
    const Image<float> image =
        make(120, 80, [&](int, int) { return 50 + float(random() % 1000) * 1e-3f; });
    const Image<float> crop = make(100, 60, [&](int x, int y) { return image(x + 13, y + 11); });
    const Result whole = run(Form::block, image, 9), part = run(Form::block, crop, 9);
    for (int y = 4; y < 56; ++y)
        for (int x = 4; x < 96; ++x)
            REQUIRE(part.variance(x, y) ==
                    doctest::Approx(whole.variance(x + 13, y + 11)).epsilon(1e-12));
}

TEST_CASE("views of every shape read and write their own pixels only")
{
    std::mt19937 random{19};
    const int width = 37, height = 23;
    const Image<float> plain =
        make(width, height, [&](int, int) { return 2 + float(random() % 100); });
    const Result expected = run(Form::block, plain, 7);

    SUBCASE("input: bottom up, interleaved, off by one element")
    {
        std::vector<float> store(std::size_t(width * height * 4 + 1), not_a_number);
        const nook::ImageView<float> view{store.data() + 1 + (height - 1) * width * 4 + 2, width,
                                          height, -width * 4, 4};
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) view(x, y) = plain(x, y);
        for (const Form form : forms) CHECK(run(form, view, 7).count == expected.count);
        CHECK(run(Form::block, view, 7) == expected);
    }
    SUBCASE("output: bottom up, interleaved, padded rows; gaps stay untouched")
    {
        const std::ptrdiff_t row = width * 2 + 5;
        std::vector<float> store(std::size_t(row * height), -7.f);
        nook::BoxMoments<float> moments;
        moments.variance = {store.data() + (height - 1) * row, width, height, -row, 2};
        moments.deviation = {store.data() + (height - 1) * row + 1, width, height, -row, 2};
        REQUIRE(nook::box_moments(plain.view(), moments, {7}));
        for (int y = 0; y < height; ++y) {
            const float* line = store.data() + (height - 1 - y) * row;
            for (int x = 0; x < width; ++x) {
                REQUIRE(line[2 * x] == float(expected.variance(x, y)));
                REQUIRE(line[2 * x + 1] == float(expected.deviation(x, y)));
            }
            for (int pad = 2 * width; pad < row; ++pad) REQUIRE(line[pad] == -7.f);
        }
    }
}

TEST_CASE("double distances keep relief that float cannot hold")
{
    std::mt19937_64 random{23};
    Image<double> image{60, 40};
    for (double& value : image) value = 1e5 + 1e-9 * double(random() % 1000);
    const auto view = image.view();
    Result block{60, 40}, reference{60, 40};
    REQUIRE(nook::box_moments(view, block.views(), {9}));
    REQUIRE(nook::box_moments_reference(view, reference.views(), {9}));
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 60; ++x) {
            if (reference.count(x, y) > 1) REQUIRE(reference.variance(x, y) > 1e-16);
            REQUIRE(block.variance(x, y) ==
                    doctest::Approx(reference.variance(x, y)).epsilon(1e-12).scale(1e-20));
        }
    SUBCASE("and huge ones neither overflow nor poison")
    {
        for (double& value : image) value *= 1e139;
        image(7, 7) = 1e200;  // beyond 2⁴⁸⁰: background
        REQUIRE(nook::box_moments(view, block.views(), {9}));
        for (const double variance : block.variance) REQUIRE(std::isfinite(variance));
        CHECK(block.count(7, 7) == 0);
        CHECK(block.count(8, 8) == 80);
    }
}

TEST_CASE("the mean square overflows to the largest number, not to infinity")
{
    const Image<float> image{8, 8, 1e30f};
    Image<float> mean_square{8, 8};
    nook::BoxMoments<float> moments;
    moments.mean_square = mean_square;
    REQUIRE(nook::box_moments(image.view(), moments, {3}));
    CHECK(mean_square(3, 3) == std::numeric_limits<float>::max());
}

TEST_CASE("scratch: the stated size suffices at any alignment, less is an error")
{
    const Image<float> image{50, 40, 1.f};
    const auto view = image.view();
    Result result{50, 40};
    const std::size_t size = nook::box_moments_scratch_size(view, {9}, 1);
    std::vector<std::byte> block(size + 64);
    for (const std::size_t offset : {0u, 1u, 37u}) {
        const nook::Scratch scratch{block.data() + offset, size};
        CHECK(nook::box_moments(view, result.views(), {9}, scratch));
    }
    result = Result{50, 40};
    const auto outcome =
        nook::box_moments(view, result.views(), {9}, nook::Scratch{block.data(), size - 1});
    CHECK(outcome.error.code == nook::ErrorCode::scratch_too_small);
    CHECK(outcome.error.value == double(size));
    CHECK(result == Result{50, 40});
    const nook::Scratch separable{block.data(), 10};
    CHECK(!nook::box_moments_separable(view, result.views(), {9}, separable));
}

TEST_CASE("windows beyond the image cost no more memory than the image")
{
    const Image<float> image{100, 80, 1.f};
    const auto view = image.view();
    CHECK(nook::box_moments_scratch_size(view, {32767}, 1) ==
          nook::box_moments_scratch_size(view, {201}, 1));
    CHECK(nook::box_moments_scratch_size(view, {32767}, 1) < 64 * 100 * 80);
    CHECK(nook::box_moments_separable_scratch_size(view, {32767}, 1) < 64 * 100 * 80);
}

TEST_CASE("bad arguments are named, and nothing is written")
{
    const Image<float> image{20, 10, 1.f};
    Result result{20, 10};
    const auto check = [&](const auto& outcome, const char* argument, nook::ErrorCode code) {
        CHECK(std::string{outcome.error.argument} == argument);
        CHECK(outcome.error.code == code);
        CHECK(result == Result{20, 10});
    };
    for (const int window : {0, -3, 4, 32769})
        check(nook::box_moments(image.view(), result.views(), {window}), "options.window",
              nook::ErrorCode::bad_value);
    check(nook::box_moments(nook::ImageView<const float>{nullptr, 20, 10}, result.views(), {3}),
          "depth", nook::ErrorCode::null_data);
    check(
        nook::box_moments(nook::ImageView<const float>{image.data(), -20, 10}, result.views(), {3}),
        "depth", nook::ErrorCode::bad_size);
    check(nook::box_moments(image.view(),
                            nook::BoxMoments<double>{.variance = {result.variance.data(), 10, 10}},
                            {3}),
          "moments.variance", nook::ErrorCode::bad_size);
    check(nook::box_moments(image.view(),
                            nook::BoxMoments<double>{.mean = {result.mean.data(), 20, 10, 3}}, {3}),
          "moments.mean", nook::ErrorCode::bad_stride);
    check(nook::box_moments(
              image.view(),
              nook::BoxMoments<double>{.variance = result.variance, .deviation = result.variance},
              {3}),
          "moments.deviation", nook::ErrorCode::overlap);
    check(nook::box_moments(image.view(), nook::BoxMoments<double>{.mean = {nullptr, 20, 10}}, {3}),
          "moments.mean", nook::ErrorCode::null_data);
    Image<float> both{20, 10, 2.f};
    check(nook::box_moments(both.view(), nook::BoxMoments<float>{.deviation = both}, {3}),
          "moments.deviation", nook::ErrorCode::overlap);
    CHECK(nook::box_moments(nook::ImageView<const float>{}, nook::BoxMoments<float>{}, {3}));
    for (const int window : {0, -3, 4}) {
        CHECK(nook::box_moments_scratch_size(image.view(), {window}, 1) == 0);
        CHECK(nook::box_moments_separable_scratch_size(image.view(), {window}, 1) == 0);
    }
    CHECK(nook::box_moments_scratch_size(image.view(), {3}, 0) == 0);
}
