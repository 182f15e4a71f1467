#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string_view>
#include <vector>

#include <nook/measure/error.hpp>
#include <nook/measure/monotone_fit.hpp>
#include <nook/owned_image.hpp>

namespace {

using nook::ErrorCode;
using nook::Image;
using nook::ImageView;
using nook::MonotoneFit;

using Values = std::vector<double>;

ImageView<const double> row(const Values& values)
{
    return {values.data(), static_cast<int>(values.size()), 1};
}

MonotoneFit fitted(const Values& image, const Values& reference)
{
    MonotoneFit result;
    REQUIRE(nook::monotone_fit(row(image), row(reference), result));
    CHECK(result.pixels == image.size());
    return result;
}

/// Whole numbers in [0, values), as doubles.
Values random_values(std::size_t count, unsigned values, unsigned seed)
{
    std::mt19937 random{seed};
    Values result(count);
    for (double& value : result) value = static_cast<double>(random() % values);
    return result;
}

/// The best monotone function by its definition as a largest of least means (Barlow, Bartholomew,
/// Bremner & Brunk 1972): at each value of the image, over all that begin at or before it and all that
/// end at or after it. For whole references, whose means are compared as fractions.
MonotoneFit slow_fit(const Values& image, const Values& reference)
{
    struct Group {
        std::int64_t sum = 0, count = 0;
    };
    std::map<double, Group> by_value;
    for (std::size_t i = 0; i < image.size(); ++i) {
        by_value[image[i]].sum += static_cast<std::int64_t>(reference[i]);
        ++by_value[image[i]].count;
    }
    std::vector<Group> groups;
    std::vector<double> values;
    for (const auto& [value, group] : by_value) {
        values.push_back(value);
        groups.push_back(group);
    }
    const auto less = [](const Group& a, const Group& b) {
        return a.sum * b.count < b.sum * a.count;
    };
    std::map<double, Group> fit;
    MonotoneFit result;
    for (std::size_t at = 0; at < groups.size(); ++at) {
        Group largest{};
        for (std::size_t first = 0; first <= at; ++first) {
            Group least{}, mean{};
            for (std::size_t last = first; last < groups.size(); ++last) {
                mean = {mean.sum + groups[last].sum, mean.count + groups[last].count};
                if (last == at || (last > at && less(mean, least))) least = mean;
            }
            if (first == 0 || less(largest, least)) largest = least;
        }
        fit[values[at]] = largest;
        if (at == 0 || less(fit[values[at - 1]], largest)) ++result.levels;
    }
    long double squares = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
        const Group mean = fit[image[i]];
        const long double difference =
            static_cast<long double>(reference[i]) -
            static_cast<long double>(mean.sum) / static_cast<long double>(mean.count);
        squares += difference * difference;
    }
    result.pixels = image.size();
    if (!image.empty())
        result.rmse =
            static_cast<double>(std::sqrt(squares / static_cast<long double>(image.size())));
    return result;
}

}  // namespace

TEST_CASE("the monotone fit of a few pixels is that worked out by hand")
{
    // The fit is 1, 3, 3, 5: of the deviations only ±1 of the middle two are left.
    const MonotoneFit one = fitted({1, 2, 3, 4}, {1, 4, 2, 5});
    CHECK(one.rmse == std::sqrt(2.0 / 4));
    CHECK(one.levels == 3);
    // All of the first three go into one block, of mean 4, where the fourth does not want to.
    const MonotoneFit two = fitted({0.25, 0.5, 0.75, 1}, {6, 4, 2, 5});
    CHECK(two.rmse == std::sqrt(8.0 / 4));
    CHECK(two.levels == 2);
    // The last pixel pulls a chain of blocks together: 1 | 2 | 3 | −2 has the mean 1.
    const MonotoneFit three = fitted({1, 2, 3, 4}, {1, 2, 3, -2});
    CHECK(three.rmse == std::sqrt(14.0 / 4));
    CHECK(three.levels == 1);
    // The same pixels in another order.
    CHECK(fitted({3, 1, 4, 2}, {2, 1, 5, 4}).rmse == one.rmse);
}

TEST_CASE("an image that grows with its reference has no error after the fit, whatever its scale")
{
    const Values reference = random_values(5000, 700, 1);
    Values image = reference, thirds = reference;
    for (double& value : image) value = value * value * value - 3;
    CHECK(fitted(reference, reference).rmse == 0);
    CHECK(fitted(image, reference).rmse == 0);
    CHECK(fitted(image, reference).levels == 700);
    // Means of many equal numbers that are no binary fractions come out as that number.
    for (double& value : thirds) value = (value - 350) / 3 * 1e-7;
    CHECK(fitted(image, thirds).rmse == 0);
    CHECK(fitted(thirds, image).rmse == 0);
}

TEST_CASE("an image that falls where its reference grows leaves the reference's standard deviation")
{
    const Values reference{0, 1, 3, 8};  // mean 3, squared deviations 9 + 4 + 0 + 25
    CHECK(fitted({0, -1, -3, -8}, reference).rmse == std::sqrt(38.0 / 4));
    CHECK(fitted({0, -1, -3, -8}, reference).levels == 1);
    // So does one that holds a single value.
    CHECK(fitted({5, 5, 5, 5}, reference).rmse == std::sqrt(38.0 / 4));
    CHECK(fitted({5, 5, 5, 5}, reference).levels == 1);
}

TEST_CASE("equal values of the image get one value of the fit, and the two zeros are equal")
{
    // The means are 2 and 7.
    CHECK(fitted({1, 1, 2, 2}, {1, 3, 6, 8}).rmse == 1);
    CHECK(fitted({1, 1, 2, 2}, {1, 3, 6, 8}).levels == 2);
    CHECK(fitted({0.0, -0.0}, {1, 3}).rmse == 1);
    CHECK(fitted({-0.0, 0.0}, {1, 3}).rmse == 1);
    // Without the tie each would be its own.
    CHECK(fitted({-1e-300, 0.0}, {1, 3}).rmse == 0);
}

TEST_CASE("the monotone fit is that of the largest of least means")
{
    // From a few values, with many ties, to hardly any; and from no order to a rough one.
    for (unsigned seed = 0; seed < 60; ++seed) {
        const std::size_t count = 1 + seed * seed % 97;
        const unsigned values = 2 + seed * 7 % 90;
        const Values image = random_values(count, values, 2 * seed + 1);
        Values reference = random_values(count, 50, 2 * seed + 2);
        if (seed % 3 != 0)
            for (std::size_t i = 0; i < count; ++i) reference[i] += image[i];
        const MonotoneFit expected = slow_fit(image, reference), result = fitted(image, reference);
        CAPTURE(count);
        CAPTURE(values);
        CHECK(std::fabs(result.rmse - expected.rmse) <= 1e-14 * (1 + expected.rmse));
    }
}

TEST_CASE(
    "a growing function of the image, and another order of its pixels, change no bit of the fit")
{
    std::mt19937 random{3};
    std::uniform_real_distribution<double> uniform{0, 1};
    Values image(4000), reference(4000);
    for (std::size_t i = 0; i < image.size(); ++i) {
        image[i] = std::floor(500 * uniform(random)) / 500;
        reference[i] = image[i] * image[i] + uniform(random) / 3;
    }
    const MonotoneFit expected = fitted(image, reference);
    CHECK(expected.rmse > 0.05);
    CHECK(expected.levels > 10);
    for (const auto function :
         {+[](double v) { return std::exp(3 * v); }, +[](double v) { return -1 / (1 + v); },
          +[](double v) { return v < 0.5 ? v - 1e9 : v * 1e9; }}) {
        Values changed = image;
        for (double& value : changed) value = function(value);
        CHECK(fitted(changed, reference).rmse == expected.rmse);
        CHECK(fitted(changed, reference).levels == expected.levels);
    }
    std::vector<std::size_t> order(image.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    Values other_image(image.size()), other_reference(image.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        other_image[i] = image[order[i]];
        other_reference[i] = reference[order[i]];
    }
    CHECK(fitted(other_image, other_reference).rmse == expected.rmse);
}

TEST_CASE(
    "the fit is no farther from the reference than the image or any other growing function of it")
{
    const Values image = random_values(3000, 257, 4), noise = random_values(3000, 200, 5);
    Values reference = image;
    for (std::size_t i = 0; i < image.size(); ++i) reference[i] += noise[i];
    const double fit = fitted(image, reference).rmse;
    for (const double scale : {0.25, 0.5, 0.75, 1.0, 1.25})
        for (const double offset : {0.0, 50.0, 100.0, 150.0}) {
            Values other = image;
            for (double& value : other) value = scale * value + offset;
            CHECK(fit < nook::rmse(row(other), row(reference)).value);
        }
}

TEST_CASE("a large offset of the reference costs the fit no digits")
{
    const Values image = random_values(2000, 100, 6);
    Values reference = random_values(2000, 256, 7);
    const double expected = fitted(image, reference).rmse;
    for (double& value : reference) value += 0x1p40;  // exact
    // Squares of such numbers would leave nothing of the difference.
    CHECK(std::fabs(fitted(image, reference).rmse - expected) <= 1e-3);
}

TEST_CASE("one pixel is fitted without error, and where none counts everything is 0")
{
    const MonotoneFit one = fitted({0.3}, {0.7});
    CHECK(one.rmse == 0);
    CHECK(one.levels == 1);

    const Image<float> image{5, 4, 0.5f};
    const Image<std::uint8_t> mask{5, 4, 0};
    MonotoneFit result{7, 7, 7};
    const auto done = nook::monotone_fit(image.view(), image.view(), result, mask.view());
    REQUIRE(done);
    CHECK(done.work.pixels == 0);
    CHECK(done.work.background == 20);
    CHECK(result.rmse == 0);
    CHECK(result.levels == 0);
    CHECK(result.pixels == 0);

    result = {7, 7, 7};
    REQUIRE(nook::monotone_fit(ImageView<const float>{}, ImageView<const float>{}, result));
    CHECK(result.rmse == 0);
    CHECK(result.pixels == 0);
}

TEST_CASE("pixels that the mask takes out do not touch the fit, whatever they and the strides hold")
{
    const int width = 20, height = 9;
    const Values plain = random_values(180, 40, 8), reference = random_values(180, 60, 9);
    std::vector<float> interleaved(std::size_t{4} * 180, 1e30f);
    std::vector<std::uint8_t> flipped(180);
    const ImageView<float> image{interleaved.data() + 1, width, height, 4 * width, 4};
    const ImageView<std::uint8_t> upside_down{flipped.data() + (height - 1) * width, width, height,
                                              -width};
    Image<std::uint8_t> mask{width, height};
    Values kept, kept_reference;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(y * width + x);
            image(x, y) = static_cast<float>(plain[i]);
            upside_down(x, y) = static_cast<std::uint8_t>(reference[i]);
            mask(x, y) = (x + 2 * y) % 3 == 0 ? 0 : static_cast<std::uint8_t>(1 + x);
            if (mask(x, y) == 0) {
                image(x, y) = std::numeric_limits<float>::quiet_NaN();
                upside_down(x, y) = 255;
            } else {
                kept.push_back(plain[i]);
                kept_reference.push_back(reference[i]);
            }
        }
    MonotoneFit result;
    const auto done = nook::monotone_fit(image, upside_down, result, mask.view());
    REQUIRE(done);
    const MonotoneFit expected = fitted(kept, kept_reference);
    CHECK(result.rmse == expected.rmse);
    CHECK(result.levels == expected.levels);
    CHECK(result.pixels == kept.size());
    CHECK(done.work.pixels == kept.size());
    CHECK(done.work.background == 180 - kept.size());
}

TEST_CASE("a NaN or an infinity that counts is an error of the fit that names its image")
{
    for (const double poison :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
          -std::numeric_limits<double>::infinity(), 0x1p401}) {
        const Values good{1, 2, 3}, bad{1, poison, 3};
        MonotoneFit result{7, 7, 7};
        auto done = nook::monotone_fit(row(bad), row(good), result);
        CHECK(done.error.code == ErrorCode::bad_value);
        CHECK(std::string_view{done.error.argument} == "image");
        done = nook::monotone_fit(row(good), row(bad), result);
        CHECK(done.error.code == ErrorCode::bad_value);
        CHECK(std::string_view{done.error.argument} == "reference");
        CHECK(result.rmse == 7);
        CHECK(result.levels == 7);
        CHECK(result.pixels == 7);
    }
}

TEST_CASE("the largest doubles that are allowed do not overflow the fit")
{
    CHECK(fitted({1, 2}, {0x1p400, -0x1p400}).rmse == 0x1p400);
    CHECK(fitted({-0x1p400, 0x1p400}, {0x1p400, -0x1p400}).levels == 1);
}

TEST_CASE("bad arguments of the monotone fit are named and write nothing")
{
    const Image<float> image{8, 8, 0.5f}, narrow{7, 8, 0.5f};
    const Image<std::uint8_t> small_mask{8, 7, 1};
    MonotoneFit result{7, 7, 7};

    auto done = nook::monotone_fit(image.view(), narrow.view(), result);
    CHECK(done.error.code == ErrorCode::bad_size);
    CHECK(std::string_view{done.error.argument} == "reference");
    CHECK(done.error.value == 7);

    done = nook::monotone_fit(image.view(), image.view(), result, small_mask.view());
    CHECK(done.error.code == ErrorCode::bad_size);
    CHECK(std::string_view{done.error.argument} == "mask");

    done = nook::monotone_fit(ImageView<const float>{nullptr, 8, 8}, image.view(), result);
    CHECK(done.error.code == ErrorCode::null_data);
    CHECK(std::string_view{done.error.argument} == "image");

    std::array<std::byte, 64> block{};
    done = nook::monotone_fit(image.view(), image.view(), result, {},
                              nook::Scratch{block.data(), block.size()});
    CHECK(done.error.code == ErrorCode::scratch_too_small);
    CHECK(done.error.value == static_cast<double>(nook::monotone_fit_scratch_size(8, 8)));
    CHECK(result.rmse == 7);
    CHECK(result.levels == 7);
    CHECK(result.pixels == 7);
}

TEST_CASE("exactly the stated scratch is enough for the monotone fit, unaligned too")
{
    const Values image = random_values(45, 20, 10), reference = random_values(45, 20, 11);
    const std::size_t bytes = nook::monotone_fit_scratch_size(45, 1);
    CHECK(bytes >= std::size_t{16} * 45);
    CHECK(nook::monotone_fit_scratch_size(0, 5) == 0);
    std::vector<std::byte> block(bytes + 1);
    MonotoneFit result;
    REQUIRE(nook::monotone_fit(row(image), row(reference), result, {},
                               nook::Scratch{block.data() + 1, bytes}));
    CHECK(result.rmse == fitted(image, reference).rmse);
}
