#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string_view>
#include <vector>

#include <nook/measure/error.hpp>
#include <nook/owned_image.hpp>

namespace {

using nook::ErrorCode;
using nook::ErrorMetrics;
using nook::Image;
using nook::ImageView;

Image<float> random_image(int width, int height, unsigned seed)
{
    std::mt19937 random{seed};
    Image<float> image{width, height};
    // Multiples of 1/256: every sum of these is exact.
    for (float& pixel : image) pixel = static_cast<float>(random() % 257) / 256.0f;
    return image;
}

ErrorMetrics measured(const ImageView<const float>& image, const ImageView<const float>& reference,
                      const ImageView<const std::uint8_t>& mask = {})
{
    ErrorMetrics metrics;
    const auto done = nook::error_metrics(image, reference, metrics, mask);
    REQUIRE(done);
    return metrics;
}

}  // namespace

TEST_CASE("the metrics of four pixels are those worked out by hand")
{
    const std::array<float, 4> image{0.5f, 0.25f, 1.0f, 0.0f};
    const std::array<float, 4> reference{0.25f, 0.75f, 1.0f, 0.0f};
    const auto metrics = measured({image.data(), 4, 1}, {reference.data(), 4, 1});
    CHECK(metrics.pixels == 4);
    CHECK(metrics.mae == 0.1875);                  // (1/4 + 1/2) / 4
    CHECK(metrics.bias == -0.0625);                // (1/4 − 1/2) / 4
    CHECK(metrics.rmse == std::sqrt(0.3125 / 4));  // 1/16 + 1/4
    CHECK(metrics.maximum == 0.5);
    CHECK(metrics.p99 == 0.5);
}

TEST_CASE("an image has no error against itself")
{
    const Image<float> image = random_image(37, 23, 1);
    const auto metrics = measured(image, image);
    CHECK(metrics.rmse == 0);
    CHECK(metrics.mae == 0);
    CHECK(metrics.bias == 0);
    CHECK(metrics.p99 == 0);
    CHECK(metrics.maximum == 0);
    CHECK(metrics.pixels == 37 * 23);
}

TEST_CASE("swapping image and reference changes the sign of the bias and nothing else")
{
    const Image<float> image = random_image(31, 17, 2), reference = random_image(31, 17, 3);
    const auto one = measured(image, reference), other = measured(reference, image);
    CHECK(one.bias == -other.bias);
    CHECK(one.bias != 0);
    CHECK(one.rmse == other.rmse);
    CHECK(one.mae == other.mae);
    CHECK(one.p99 == other.p99);
    CHECK(one.maximum == other.maximum);
}

TEST_CASE("the 99th percentile is the element of rank ceil(0.99 n)")
{
    for (int count : {1, 2, 50, 99, 100, 101, 199, 200, 201, 1000, 12345}) {
        // Differences 1 … n in a scrambled order.
        std::vector<double> image(static_cast<std::size_t>(count));
        for (std::size_t i = 0; i < image.size(); ++i) image[i] = double(i + 1);
        std::shuffle(image.begin(), image.end(), std::mt19937{7});
        for (std::size_t i = 0; i < image.size(); i += 2) image[i] = -image[i];
        const std::vector<double> zero(image.size());
        ErrorMetrics metrics;
        REQUIRE(nook::error_metrics(ImageView<const double>{image.data(), count, 1},
                                    ImageView<const double>{zero.data(), count, 1}, metrics));
        CAPTURE(count);
        CHECK(metrics.p99 == (99 * count + 99) / 100);
        CHECK(metrics.maximum == count);
    }
}

TEST_CASE("pixels that the mask takes out may hold anything")
{
    Image<float> image = random_image(20, 9, 4), reference = random_image(20, 9, 5);
    Image<std::uint8_t> mask{20, 9, 1};
    const float nothing = std::numeric_limits<float>::quiet_NaN();
    std::vector<float> kept, kept_reference;
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 20; ++x) {
            if ((x + 2 * y) % 3 == 0) {
                mask(x, y) = 0;
                image(x, y) = nothing;
                reference(x, y) = std::numeric_limits<float>::infinity();
            } else {
                mask(x, y) = static_cast<std::uint8_t>(1 + x);
                kept.push_back(image(x, y));
                kept_reference.push_back(reference(x, y));
            }
        }
    ErrorMetrics metrics;
    const auto done = nook::error_metrics(image.view(), reference.view(), metrics, mask.view());
    REQUIRE(done);
    const int count = static_cast<int>(kept.size());
    const auto expected = measured({kept.data(), count, 1}, {kept_reference.data(), count, 1});
    CHECK(metrics.pixels == kept.size());
    CHECK(done.work.pixels == kept.size());
    CHECK(done.work.background == 20 * 9 - kept.size());
    CHECK(metrics.rmse == expected.rmse);
    CHECK(metrics.mae == expected.mae);
    CHECK(metrics.bias == expected.bias);
    CHECK(metrics.p99 == expected.p99);
    CHECK(metrics.maximum == expected.maximum);
    const auto root = nook::rmse(image.view(), reference.view(), mask.view());
    REQUIRE(root);
    CHECK(root.value == expected.rmse);
}

TEST_CASE("where no pixel counts every metric is 0")
{
    const Image<float> image = random_image(5, 4, 6), reference = random_image(5, 4, 7);
    const Image<std::uint8_t> mask{5, 4, 0};
    ErrorMetrics metrics{1, 1, 1, 1, 1, 1};
    const auto done = nook::error_metrics(image.view(), reference.view(), metrics, mask.view());
    REQUIRE(done);
    CHECK(metrics.pixels == 0);
    CHECK(metrics.rmse == 0);
    CHECK(metrics.mae == 0);
    CHECK(metrics.bias == 0);
    CHECK(metrics.p99 == 0);
    CHECK(metrics.maximum == 0);
    CHECK(done.work.background == 20);
    const auto root = nook::rmse(image.view(), reference.view(), mask.view());
    REQUIRE(root);
    CHECK(root.value == 0);
}

TEST_CASE("flipped, interleaved and double views give the metrics of plain ones")
{
    const int width = 13, height = 11;
    const Image<float> image = random_image(width, height, 8);
    const Image<float> reference = random_image(width, height, 9);
    const auto expected = measured(image, reference);

    std::vector<float> interleaved(static_cast<std::size_t>(width * height * 4), 1e30f);
    std::vector<double> flipped(static_cast<std::size_t>(width * height));
    const ImageView<float> image_view{interleaved.data() + 2, width, height, width * 4, 4};
    const ImageView<double> reference_view{flipped.data() + (height - 1) * width, width, height,
                                           -width};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            image_view(x, y) = image(x, y);
            reference_view(x, y) = static_cast<double>(reference(x, y));
        }
    ErrorMetrics metrics;
    REQUIRE(nook::error_metrics(image_view, reference_view, metrics));
    CHECK(metrics.rmse == expected.rmse);
    CHECK(metrics.mae == expected.mae);
    CHECK(metrics.bias == expected.bias);
    CHECK(metrics.p99 == expected.p99);
    CHECK(metrics.maximum == expected.maximum);
}

TEST_CASE("the order of the pixels shows only in the last digits of the sums")
{
    const int width = 512, height = 256;
    std::mt19937 random{10};
    std::uniform_real_distribution<float> uniform{0, 1};
    std::vector<float> image(width * height), reference(width * height);
    for (std::size_t i = 0; i < image.size(); ++i) {
        image[i] = uniform(random);
        reference[i] = uniform(random);
    }
    const auto one = measured({image.data(), width, height}, {reference.data(), width, height});
    std::vector<std::size_t> order(image.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    std::vector<float> other_image(image.size()), other_reference(image.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        other_image[i] = image[order[i]];
        other_reference[i] = reference[order[i]];
    }
    const auto other =
        measured({other_image.data(), width, height}, {other_reference.data(), width, height});
    CHECK(std::fabs(one.rmse - other.rmse) <= 1e-14);
    CHECK(std::fabs(one.mae - other.mae) <= 1e-14);
    CHECK(std::fabs(one.bias - other.bias) <= 1e-14);
    CHECK(one.p99 == other.p99);
    CHECK(one.maximum == other.maximum);
}

TEST_CASE("a NaN or an infinity that counts is an error that names its image")
{
    for (const float poison :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
          -std::numeric_limits<float>::infinity()}) {
        Image<float> good = random_image(6, 5, 11), bad = good;
        bad(3, 4) = poison;
        ErrorMetrics metrics{7, 7, 7, 7, 7, 7};
        auto done = nook::error_metrics(bad.view(), good.view(), metrics);
        CHECK(done.error.code == ErrorCode::bad_value);
        CHECK(std::string_view{done.error.argument} == "image");
        done = nook::error_metrics(good.view(), bad.view(), metrics);
        CHECK(done.error.code == ErrorCode::bad_value);
        CHECK(std::string_view{done.error.argument} == "reference");
        CHECK(metrics.rmse == 7);
        CHECK(metrics.pixels == 7);
        const auto root = nook::rmse(good.view(), bad.view());
        CHECK_FALSE(root);
        CHECK(std::string_view{root.error.argument} == "reference");
    }
}

TEST_CASE("the largest doubles that are allowed do not overflow, larger ones are an error")
{
    const std::array<double, 3> large{0x1p400, -0x1p400, 0x1p400};
    const std::array<double, 3> opposite{-0x1p400, 0x1p400, -0x1p400};
    ErrorMetrics metrics;
    REQUIRE(nook::error_metrics(ImageView<const double>{large.data(), 3, 1},
                                ImageView<const double>{opposite.data(), 3, 1}, metrics));
    CHECK(metrics.rmse == 0x1p401);
    CHECK(metrics.maximum == 0x1p401);
    const std::array<double, 3> larger{0, 0x1p401, 0};
    CHECK_FALSE(nook::error_metrics(ImageView<const double>{larger.data(), 3, 1},
                                    ImageView<const double>{opposite.data(), 3, 1}, metrics));
}

TEST_CASE("bad arguments of the error metrics are named and write nothing")
{
    const Image<float> image = random_image(8, 8, 12), narrow = random_image(7, 8, 12);
    const Image<std::uint8_t> small_mask{8, 7, 1};
    ErrorMetrics metrics{7, 7, 7, 7, 7, 7};

    auto done = nook::error_metrics(image.view(), narrow.view(), metrics);
    CHECK(done.error.code == ErrorCode::bad_size);
    CHECK(std::string_view{done.error.argument} == "reference");
    CHECK(done.error.value == 7);

    done = nook::error_metrics(image.view(), image.view(), metrics, small_mask.view());
    CHECK(done.error.code == ErrorCode::bad_size);
    CHECK(std::string_view{done.error.argument} == "mask");

    done = nook::error_metrics(ImageView<const float>{nullptr, 8, 8}, image.view(), metrics);
    CHECK(done.error.code == ErrorCode::null_data);
    CHECK(std::string_view{done.error.argument} == "image");

    done = nook::error_metrics(ImageView<const float>{image.data(), -8, 8}, image.view(), metrics);
    CHECK(done.error.code == ErrorCode::bad_size);

    std::array<std::byte, 64> block{};
    done = nook::error_metrics(image.view(), image.view(), metrics, {},
                               nook::Scratch{block.data(), block.size()});
    CHECK(done.error.code == ErrorCode::scratch_too_small);
    CHECK(done.error.value == static_cast<double>(nook::error_metrics_scratch_size(8, 8)));

    CHECK(metrics.rmse == 7);
    CHECK(metrics.pixels == 7);
}

TEST_CASE("exactly the stated scratch is enough, unaligned too")
{
    const Image<float> image = random_image(9, 5, 13), reference = random_image(9, 5, 14);
    const std::size_t bytes = nook::error_metrics_scratch_size(9, 5);
    std::vector<std::byte> block(bytes + 1);
    ErrorMetrics metrics;
    CHECK(nook::error_metrics(image.view(), reference.view(), metrics, {},
                              nook::Scratch{block.data() + 1, bytes}));
    CHECK(metrics.rmse == measured(image, reference).rmse);
}

TEST_CASE("an image of 0 x 0 with null data has no error")
{
    ErrorMetrics metrics{7, 7, 7, 7, 7, 7};
    CHECK(nook::error_metrics(ImageView<const float>{}, ImageView<const float>{}, metrics));
    CHECK(metrics.pixels == 0);
    CHECK(metrics.rmse == 0);
    const auto root = nook::rmse(ImageView<const float>{}, ImageView<const float>{});
    REQUIRE(root);
    CHECK(root.value == 0);
}
