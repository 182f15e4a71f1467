#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string_view>
#include <vector>

#include <nook/measure/ssim.hpp>
#include <nook/owned_image.hpp>

namespace {

using nook::ErrorCode;
using nook::Image;
using nook::ImageView;

Image<float> random_image(int width, int height, unsigned seed)
{
    std::mt19937 random{seed};
    std::uniform_real_distribution<float> uniform{0, 1};
    Image<float> image{width, height};
    for (float& pixel : image) pixel = uniform(random);
    return image;
}

Image<std::uint8_t> random_mask(int width, int height, unsigned seed)
{
    std::mt19937 random{seed};
    Image<std::uint8_t> mask{width, height};
    for (std::uint8_t& pixel : mask) pixel = random() % 3 == 0 ? 0 : 1;
    return mask;
}

/// The textbook formula, window by window: two passes per window, no separation, no moments of
/// differences.
double slow_ssim(const ImageView<const float>& a, const ImageView<const float>& b,
                 const ImageView<const std::uint8_t>& mask)
{
    const auto counts = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < a.width && y < a.height && (mask.empty() || mask(x, y) != 0);
    };
    double total = 0;
    int pixels = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x) {
            if (!counts(x, y)) continue;
            const auto window = [&](auto&& value) {
                double sum = 0, weights = 0;
                for (int j = y - 5; j <= y + 5; ++j)
                    for (int i = x - 5; i <= x + 5; ++i) {
                        if (!counts(i, j)) continue;
                        const double squared = (i - x) * (i - x) + (j - y) * (j - y);
                        const double weight = std::exp(-squared / (2 * 1.5 * 1.5));
                        sum += weight * value(double{a(i, j)}, double{b(i, j)});
                        weights += weight;
                    }
                return sum / weights;
            };
            const double mean_a = window([](double p, double) { return p; });
            const double mean_b = window([](double, double q) { return q; });
            const double variance_a =
                window([&](double p, double) { return (p - mean_a) * (p - mean_a); });
            const double variance_b =
                window([&](double, double q) { return (q - mean_b) * (q - mean_b); });
            const double covariance =
                window([&](double p, double q) { return (p - mean_a) * (q - mean_b); });
            total +=
                (2 * mean_a * mean_b + 1e-4) * (2 * covariance + 9e-4) /
                ((mean_a * mean_a + mean_b * mean_b + 1e-4) * (variance_a + variance_b + 9e-4));
            ++pixels;
        }
    return total / pixels;
}

double measured(const ImageView<const float>& a, const ImageView<const float>& b,
                const ImageView<const std::uint8_t>& mask = {})
{
    const auto result = nook::ssim(a, b, mask);
    REQUIRE(result);
    return result.value;
}

}  // namespace

TEST_CASE("an image is exactly similar to itself")
{
    for (const int size : {1, 2, 5, 11, 40}) {
        const Image<float> image = random_image(size, size + 3, 1);
        CHECK(measured(image, image) == 1);
        CHECK(measured(image, image, random_mask(size, size + 3, 2)) == 1);
    }
}

TEST_CASE("similarity is symmetric")
{
    const Image<float> a = random_image(33, 21, 3), b = random_image(33, 21, 4);
    CHECK(measured(a, b) == measured(b, a));
    CHECK(measured(a, b) < 0.5);
}

TEST_CASE("constant images have the similarity of their means")
{
    // Variances vanish: (2ab + C1) / (a² + b² + C1), at the frame as inside.
    const double a = 0.25, b = 0.75;
    const Image<float> one{17, 12, 0.25f}, other{17, 12, 0.75f};
    const double expected = (2 * a * b + 1e-4) / (a * a + b * b + 1e-4);
    CHECK(std::fabs(measured(one, other) - expected) <= 1e-12);
    const Image<float> black{17, 12, 0.0f}, white{17, 12, 1.0f};
    CHECK(std::fabs(measured(black, white) - 1e-4 / 1.0001) <= 1e-12);
}

TEST_CASE("a single pixel has the similarity of its values")
{
    const Image<float> one{1, 1, 0.5f}, other{1, 1, 1.0f};
    CHECK(std::fabs(measured(one, other) - 1.0001 / 1.2501) <= 1e-12);
}

TEST_CASE("the similarity of an image and its negative is negative")
{
    // Zero-mean structure around 1/2 with the sign turned: the covariance is −variance.
    Image<float> image{40, 40}, negative{40, 40};
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            image(x, y) = (x + y) % 2 == 0 ? 0.25f : 0.75f;
            negative(x, y) = 1 - image(x, y);
        }
    CHECK(measured(image, negative) < -0.9);
}

TEST_CASE("the separable filter agrees with the textbook formula, window by window")
{
    const std::array<std::array<int, 2>, 5> sizes{{{1, 1}, {3, 30}, {30, 3}, {11, 11}, {37, 26}}};
    for (const auto& size : sizes) {
        const int width = size[0], height = size[1];
        CAPTURE(width);
        CAPTURE(height);
        const Image<float> a = random_image(width, height, 5);
        Image<float> b = a;
        std::mt19937 random{6};
        for (float& pixel : b)
            pixel = 0.7f * pixel + 0.3f * static_cast<float>(random() % 100) / 100;
        CHECK(std::fabs(measured(a, b) - slow_ssim(a, b, {})) <= 1e-12);
        Image<std::uint8_t> mask = random_mask(width, height, 7);
        mask(0, 0) = 1;
        CHECK(std::fabs(measured(a, b, mask) - slow_ssim(a, b, mask)) <= 1e-12);
    }
}

TEST_CASE("masked pixels do not enter the similarity, whatever they hold")
{
    Image<float> a = random_image(30, 20, 8), b = random_image(30, 20, 9);
    const Image<std::uint8_t> mask = random_mask(30, 20, 10);
    const double before = measured(a, b, mask);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 30; ++x)
            if (mask(x, y) == 0) {
                a(x, y) = std::numeric_limits<float>::quiet_NaN();
                b(x, y) = -std::numeric_limits<float>::infinity();
            }
    CHECK(measured(a, b, mask) == before);
}

TEST_CASE("flipped and interleaved views have the similarity of plain ones")
{
    const int width = 14, height = 19;
    const Image<float> a = random_image(width, height, 11), b = random_image(width, height, 12);
    std::vector<float> interleaved(static_cast<std::size_t>(width * height * 3), 1e30f);
    std::vector<float> flipped(static_cast<std::size_t>(width * height));
    const ImageView<float> a_view{interleaved.data() + 1, width, height, width * 3, 3};
    const ImageView<float> b_view{flipped.data() + (height - 1) * width, width, height, -width};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            a_view(x, y) = a(x, y);
            b_view(x, y) = b(x, y);
        }
    CHECK(measured(a_view, b_view) == measured(a, b));
}

TEST_CASE("where no pixel counts nothing differs")
{
    const Image<float> a = random_image(6, 6, 13), b = random_image(6, 6, 14);
    CHECK(measured(a, b, Image<std::uint8_t>{6, 6, 0}) == 1);
    CHECK(measured({}, {}) == 1);
}

TEST_CASE("bad arguments of the similarity are named")
{
    const Image<float> image = random_image(8, 8, 15), wide = random_image(9, 8, 15);
    CHECK(nook::ssim(image.view(), wide.view()).error.code == ErrorCode::bad_size);
    CHECK(nook::ssim(ImageView<const float>{nullptr, 8, 8}, image.view()).error.code ==
          ErrorCode::null_data);
    Image<float> poisoned = image;
    poisoned(7, 7) = std::numeric_limits<float>::quiet_NaN();
    auto result = nook::ssim(poisoned.view(), image.view());
    CHECK_FALSE(result);
    CHECK(std::string_view{result.error.argument} == "image");
    result = nook::ssim(image.view(), poisoned.view());
    CHECK(std::string_view{result.error.argument} == "reference");

    const std::size_t bytes = nook::ssim_scratch_size(8);
    std::vector<std::byte> block(bytes + 1);
    result = nook::ssim(image.view(), image.view(), {}, nook::Scratch{block.data(), bytes - 1});
    CHECK(result.error.code == ErrorCode::scratch_too_small);
    CHECK(nook::ssim(image.view(), image.view(), {}, nook::Scratch{block.data() + 1, bytes}));
}
