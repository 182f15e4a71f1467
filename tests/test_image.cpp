#include <cstdint>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <vector>

#include <doctest/doctest.h>

#include <nook/image.hpp>
#include <nook/owned_image.hpp>

TEST_SUITE("image")
{
    TEST_CASE("a view of a plain buffer is tight by default")
    {
        std::vector<int> data(12);
        std::iota(data.begin(), data.end(), 0);
        const nook::ImageView<int> view{data.data(), 4, 3};
        CHECK(view.row_stride == 4);
        CHECK(view.pixel_stride == 1);
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 4; ++x) CHECK(view(x, y) == 4 * y + x);
    }

    TEST_CASE("a negative row stride turns a bottom-up buffer over")
    {
        std::vector<int> data(12);
        std::iota(data.begin(), data.end(), 0);
        const nook::ImageView<int> view{data.data() + 8, 4, 3, -4};
        CHECK(view(0, 0) == 8);
        CHECK(view(3, 0) == 11);
        CHECK(view(0, 2) == 0);
        CHECK(view(3, 2) == 3);
    }

    TEST_CASE("a negative pixel stride mirrors")
    {
        int data[] = {0, 1, 2, 3, 4, 5};
        const nook::ImageView<int> view{data + 2, 3, 2, 3, -1};
        CHECK(view(0, 0) == 2);
        CHECK(view(2, 0) == 0);
        CHECK(view(0, 1) == 5);
    }

    TEST_CASE("rows and columns swap by their strides")
    {
        int data[] = {0, 1, 2, 3, 4, 5};
        const nook::ImageView<int> transposed{data, 2, 3, 1, 3};
        CHECK(transposed(1, 0) == 3);
        CHECK(transposed(0, 2) == 2);
        CHECK(transposed(1, 2) == 5);
    }

    TEST_CASE("a channel of an interleaved buffer is a view, and padding stays out of it")
    {
        std::vector<float> rgba(4 * 5 * 3, -1.0f);
        const nook::ImageView<float> green{rgba.data() + 1, 4, 3, 4 * 5, 4};
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 4; ++x) green(x, y) = 1;
        int ones = 0;
        for (std::size_t i = 0; i < rgba.size(); ++i) {
            if (rgba[i] != 1.0f) continue;
            ++ones;
            CHECK(i % 4 == 1);
            CHECK(i / 4 % 5 < 4);
        }
        CHECK(ones == 12);
    }

    TEST_CASE("a view of mutable pixels becomes one of constant pixels, and never back")
    {
        int data[6] = {1, 2, 3, 4, 5, 6};
        const nook::ImageView<int> view{data + 3, 3, 2, -3};
        const nook::ImageView<const int> constant = view;
        CHECK(&constant(1, 1) == &data[1]);
        CHECK(constant.row_stride == -3);
        CHECK_FALSE(std::is_convertible_v<nook::ImageView<const int>, nook::ImageView<int>>);
    }

    TEST_CASE("a view is empty when it has no width or no height")
    {
        CHECK(nook::ImageView<float>{}.empty());
        CHECK(nook::ImageView<float>{nullptr, 0, 5}.empty());
        CHECK(nook::ImageView<float>{nullptr, 5, 0}.empty());
        float one = 0;
        CHECK_FALSE(nook::ImageView<float>{&one, 1, 1}.empty());
    }

    TEST_CASE("three channels lie side by side or in planes")
    {
        float data[] = {0, 1, 2, 99, 10, 11, 12, 99, 20, 21, 22, 99, 30, 31, 32, 99};
        const auto view = nook::ImageView3<float>::interleaved(data, 2, 2, 8, 4);
        CHECK(view.x(1, 1) == 30);
        CHECK(view.y(1, 0) == 11);
        CHECK(view.z(0, 1) == 22);
        const nook::ImageView3<const float> constant = view;
        CHECK(&constant.z(1, 1) == &data[14]);
        CHECK_FALSE(view.empty());
        const auto none = nook::ImageView3<float>::interleaved(nullptr, 0, 0, 0);
        CHECK(none.empty());
        CHECK(none.z.data == nullptr);
    }

    TEST_CASE("an owning image copies its pixels, and its views do not")
    {
        nook::Image<float> image(3, 2, 0.5f);
        CHECK(image(2, 1) == 0.5f);
        const nook::ImageView<float> view = image;
        view(2, 1) = 7;
        CHECK(image(2, 1) == 7);
        nook::Image<float> copy = image;
        CHECK(copy == image);
        copy(0, 0) = 1;
        CHECK_FALSE(copy == image);
        CHECK(image(0, 0) == 0.5f);
        CHECK(nook::Image<float>(0, 0).view().empty());
        // Rows of different shape are different images even where the pixels agree.
        CHECK_FALSE(nook::Image<float>(3, 2) == nook::Image<float>(2, 3));
    }
}
