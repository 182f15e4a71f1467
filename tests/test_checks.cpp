#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include <nook/checks.hpp>

using nook::ErrorCode;
using nook::ImageView;
namespace detail = nook::detail;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// True when the two views have an element in common, by looking at every pair.
bool share(const ImageView<const float>& a, const ImageView<float>& b)
{
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            for (int v = 0; v < b.height; ++v)
                for (int u = 0; u < b.width; ++u)
                    if (&a(x, y) == &b(u, v)) return true;
    return false;
}

}  // namespace

TEST_SUITE("checks")
{
    TEST_CASE("finite and NaN are told by bits")
    {
        for (const double value :
             {0.0, -0.0, 1.0, -1e308, 5e-324, std::numeric_limits<double>::max()}) {
            CHECK(detail::is_finite(value));
            CHECK_FALSE(detail::is_nan(value));
        }
        for (const double value : {infinity, -infinity}) {
            CHECK_FALSE(detail::is_finite(value));
            CHECK_FALSE(detail::is_nan(value));
        }
        for (const double value : {nan, -nan, std::numeric_limits<double>::signaling_NaN()}) {
            CHECK_FALSE(detail::is_finite(value));
            CHECK(detail::is_nan(value));
        }
        CHECK(detail::is_finite(std::numeric_limits<float>::max()));
        CHECK(detail::is_finite(-1e-45f));
        CHECK_FALSE(detail::is_finite(std::numeric_limits<float>::infinity()));
        CHECK_FALSE(detail::is_finite(-std::numeric_limits<float>::quiet_NaN()));
    }

    TEST_CASE("an input needs data where it has pixels, and no negative size")
    {
        float one = 0;
        CHECK_FALSE(detail::check_input(ImageView<float>{&one, 1, 1}, "depth"));
        CHECK_FALSE(detail::check_input(ImageView<float>{}, "depth"));
        CHECK_FALSE(detail::check_input(ImageView<float>{nullptr, 7, 0}, "depth"));
        const auto null = detail::check_input(ImageView<float>{nullptr, 1, 1}, "depth");
        CHECK(null.code == ErrorCode::null_data);
        CHECK(null.argument == std::string{"depth"});
        const auto width = detail::check_input(ImageView<float>{&one, -1, 0}, "depth");
        CHECK(width.code == ErrorCode::bad_size);
        CHECK(width.value == -1);
        const auto height = detail::check_input(ImageView<float>{nullptr, 0, -2}, "depth");
        CHECK(height.code == ErrorCode::bad_size);
        CHECK(height.value == -2);
    }

    TEST_CASE("an output whose pixels would share an element is refused, every other one passes")
    {
        // Every view of up to 4 × 4 pixels with strides in [−9, 9], against counting the elements.
        std::vector<float> data(200);
        int refused = 0, wrong = 0;
        for (int width = 1; width <= 4; ++width)
            for (int height = 1; height <= 4; ++height)
                for (int row = -9; row <= 9; ++row)
                    for (int pixel = -9; pixel <= 9; ++pixel) {
                        const ImageView<float> view{data.data() + 100, width, height, row, pixel};
                        std::vector<int> uses(200);
                        bool twice = false;
                        for (int y = 0; y < height; ++y)
                            for (int x = 0; x < width; ++x)
                                twice |=
                                    uses[static_cast<std::size_t>(&view(x, y) - data.data())]++ > 0;
                        const bool error{detail::check_output(view, "visibility")};
                        refused += error;
                        // Woven rows such as strides 3 and 2 share nothing, and are refused all the
                        // same: only what shares must never pass.
                        wrong += twice && !error;
                        const bool nested = std::abs(row) > std::abs(pixel) * (width - 1) ||
                                            std::abs(pixel) > std::abs(row) * (height - 1);
                        wrong += nested && !twice && error;
                    }
        CHECK(wrong == 0);
        CHECK(refused > 0);
    }

    TEST_CASE("an output names the stride that is wrong")
    {
        float data[16] = {};
        const auto pixel = detail::check_output(ImageView<float>{data, 2, 2, 2, 0}, "visibility");
        CHECK(pixel.code == ErrorCode::bad_stride);
        CHECK(pixel.argument == std::string{"visibility"});
        CHECK(pixel.value == 0);
        const auto row = detail::check_output(ImageView<float>{data, 4, 2, 3}, "visibility");
        CHECK(row.code == ErrorCode::bad_stride);
        CHECK(row.value == 3);
    }

    TEST_CASE("sizes that differ name the image and the extent")
    {
        float data[16] = {};
        const ImageView<float> first{data, 4, 3};
        CHECK_FALSE(detail::check_same_size(first, ImageView<const float>{data, 4, 3}, "normal"));
        const auto width = detail::check_same_size(first, ImageView<float>{data, 3, 3}, "normal");
        CHECK(width.code == ErrorCode::bad_size);
        CHECK(width.argument == std::string{"normal"});
        CHECK(width.value == 3);
        const auto height = detail::check_same_size(first, ImageView<float>{data, 4, 4}, "normal");
        CHECK(height.value == 4);
    }

    TEST_CASE("an output that shares an element with an input is always found")
    {
        std::vector<float> data(80);
        int found = 0, missed = 0;
        for (int in_at = 30; in_at < 40; ++in_at)
            for (int in_row : {-8, -6, 6, 8, 12})
                for (int in_pixel : {-2, 1, 2, 3})
                    for (int out_at = 28; out_at < 44; ++out_at)
                        for (int out_row : {-8, -6, 6, 8, 12})
                            for (int out_pixel : {-3, 1, 2, 3}) {
                                const ImageView<const float> input{data.data() + in_at, 2, 3,
                                                                   in_row, in_pixel};
                                const ImageView<float> output{data.data() + out_at, 2, 3, out_row,
                                                              out_pixel};
                                const bool shared = share(input, output);
                                const bool error{detail::check_apart(input, output, "visibility")};
                                found += shared;
                                missed += shared && !error;
                            }
        CHECK(found > 1000);
        CHECK(missed == 0);
    }

    TEST_CASE("images that lie apart pass: side by side, and as channels of one buffer")
    {
        std::vector<float> data(200);
        const auto apart = [](const auto& input, const auto& output) {
            return !detail::check_apart(input, output, "visibility");
        };
        const ImageView<const float> first{data.data(), 4, 4};
        CHECK(apart(first, ImageView<float>{data.data() + 16, 4, 4}));
        CHECK_FALSE(apart(first, ImageView<float>{data.data() + 15, 4, 4}));
        CHECK_FALSE(apart(first, ImageView<float>{data.data(), 4, 4}));
        // Turned over, the first row comes last in memory.
        CHECK(apart(first, ImageView<float>{data.data() + 28, 4, 4, -4}));
        CHECK_FALSE(apart(first, ImageView<float>{data.data() + 27, 4, 4, -4}));
        // Channels of RGBA, tight and with padded rows, both ways up.
        for (const int row : {16, 20, -16}) {
            float* base = data.data() + (row < 0 ? 48 : 0);
            for (int a = 0; a < 4; ++a)
                for (int b = 0; b < 4; ++b) {
                    const ImageView<const float> input{base + a, 4, 4, row, 4};
                    CHECK(apart(input, ImageView<float>{base + b, 4, 4, row, 4}) == (a != b));
                }
        }
        // The left half of an image and its right half meet in range, not in elements; told apart
        // only for channels, so refusing them is allowed and wanted to stay as it is.
        CHECK_FALSE(apart(ImageView<const float>{data.data(), 2, 4, 4},
                          ImageView<float>{data.data() + 2, 2, 4, 4}));
        CHECK(apart(ImageView<const float>{}, ImageView<float>{data.data(), 4, 4}));
    }

    TEST_CASE("bytes that overlap count, whatever the types are")
    {
        alignas(8) unsigned char bytes[64] = {};
        const ImageView<const double> input{reinterpret_cast<double*>(bytes), 2, 2};
        CHECK(detail::check_apart(
            input, ImageView<float>{reinterpret_cast<float*>(bytes + 28), 2, 2}, "visibility"));
        CHECK_FALSE(detail::check_apart(
            input, ImageView<float>{reinterpret_cast<float*>(bytes + 32), 2, 2}, "visibility"));
    }

    TEST_CASE("a work map has a group for every 16 pixels")
    {
        std::uint8_t groups[4] = {};
        const auto check = [](const ImageView<const std::uint8_t>& active, int width, int height) {
            std::vector<float> data(static_cast<std::size_t>(width * height));
            return detail::check_work_map({active}, ImageView<float>{data.data(), width, height});
        };
        CHECK_FALSE(check({}, 100, 100));
        CHECK_FALSE(check({groups, 2, 2}, 17, 2));
        CHECK(check({groups, 2, 2}, 16, 2).argument == std::string{"work_map.active"});
        CHECK(check({groups, 2, 2}, 33, 2).code == ErrorCode::bad_size);
        CHECK(check({groups, 2, 2}, 32, 1).value == 2);
        CHECK(check({groups, -1, 2}, 32, 2).code == ErrorCode::bad_size);
        // A size without data is a mistake; no size is the empty map.
        for (const auto& [width, height] : {std::pair{2, 2}, {1, 1}}) {
            const auto null = check({nullptr, width, height}, 32, 2);
            CHECK(null.code == ErrorCode::null_data);
            CHECK(null.argument == std::string{"work_map.active"});
        }
        CHECK_FALSE(check({nullptr, 0, 2}, 32, 2));
    }

    TEST_CASE("a work map in the memory of the output is refused")
    {
        std::vector<float> data(64 + 1);
        const ImageView<float> output{data.data(), 32, 2};
        auto* const bytes = reinterpret_cast<std::uint8_t*>(data.data());
        const auto shared = detail::check_work_map({{bytes + 255, 2, 2}}, output);
        CHECK(shared.code == ErrorCode::overlap);
        CHECK(shared.argument == std::string{"work_map.active"});
        CHECK_FALSE(detail::check_work_map({{bytes + 256, 2, 2}}, output));
    }

    TEST_CASE("an option below its least value, infinite or NaN is refused")
    {
        CHECK_FALSE(detail::check_at_least(0, 0, "options.bias", "a number >= 0"));
        CHECK_FALSE(detail::check_at_least(1e300, 0, "options.bias", "a number >= 0"));
        for (const double value : {-1e-300, -1.0, infinity, -infinity, nan}) {
            const auto error = detail::check_at_least(value, 0, "options.bias", "a number >= 0");
            CHECK(error.code == ErrorCode::bad_value);
            CHECK(error.argument == std::string{"options.bias"});
            CHECK(error.allowed == std::string{"a number >= 0"});
        }
    }
}
