#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <type_traits>
#include <vector>

#include <nook/depth/moments_block.hpp>
#include <nook/depth/moments_direct.hpp>
#include <nook/execution.hpp>
#include <nook/owned_image.hpp>

using namespace nook::detail;
using nook::Border;
using nook::Image;

TEST_SUITE_BEGIN("depth/moments_block");

namespace {

/// Keeps what the filter delivers.
struct Keep {
    using Value = double;
    static constexpr int results = 3;
    Image<double>&variance, &deviation, &count;
    Image<int>& times;

    template <class Real, class Open>
    void shade(const Real&, const Real& samples, const Open&, const Real& v, const Real& d,
               Real* result) const
    {
        result[0] = v;
        result[1] = d;
        result[2] = samples;
    }
    template <class Distance>
    void row(nook::Work& work, int y, int x, int width, const double* values, std::ptrdiff_t pitch,
             const Distance* distances) const
    {
        for (int i = 0; i < width; ++i) {
            const bool surface = distances == nullptr || distances[i] > 0;
            variance(x + i, y) = surface ? values[i] : 0;
            deviation(x + i, y) = surface ? values[pitch + i] : 0;
            count(x + i, y) = surface ? values[2 * pitch + i] : 0;
            ++times(x + i, y);
        }
        work.pixels += static_cast<std::uint64_t>(width);
    }
};

struct Moments {
    Image<double> variance, deviation, count;
    Image<int> times;
};

/// With scratch full of NaN, exactly as large as it must be.
template <int lanes, class Distance>
Moments filter(const Image<Distance>& image, int window, Border border)
{
    const int width = image.width(), height = image.height();
    Moments moments{Image<double>{width, height}, Image<double>{width, height},
                    Image<double>{width, height}, Image<int>{width, height, 0}};
    const BlockMoments<Distance, lanes> block{width, height, window, border};
    std::vector<unsigned char> memory(block.scratch_size(1), 0xff);
    const auto outcome =
        block.run(nook::depth_source(image.view()),
                  Keep{moments.variance, moments.deviation, moments.count, moments.times},
                  nook::Scratch{memory.data(), memory.size()}, nook::Serial{});
    REQUIRE(outcome);
    REQUIRE(outcome.work.pixels == static_cast<std::uint64_t>(width * height));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) REQUIRE(moments.times(x, y) == 1);
    return moments;
}

template <class Distance>
void check_against_direct(const Image<Distance>& image, int window, Border border,
                          const Moments& moments, double tolerance)
{
    const int width = image.width(), height = image.height(), radius = window / 2;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (!(image(x, y) > 0)) continue;
            CAPTURE(x);
            CAPTURE(y);
            const auto expected = direct_moments<double>(
                nook::depth_source(image.view()), image(x, y),
                window_span(x, radius, width, border), window_span(y, radius, height, border));
            REQUIRE(moments.count(x, y) == expected.count);
            REQUIRE(std::fabs(moments.variance(x, y) - expected.variance) <=
                    tolerance * expected.variance);
            REQUIRE(std::fabs(moments.deviation(x, y) - expected.deviation) <=
                    tolerance * std::sqrt(expected.variance));
        }
}

}  // namespace

TEST_CASE("one lane and several give the moments of the direct form, every pixel once")
{
    std::mt19937 random{1};
    const auto below = [&](unsigned end) { return static_cast<int>(random() % end); };
    for (int round = 0; round < 150; ++round) {
        const int width = 1 + below(round % 8 == 0 ? 400 : 60), height = 1 + below(90);
        const int window = 1 + 2 * below(round % 5 == 0 ? 90 : 12);
        const Border border = below(2) == 0 ? Border::symmetric : Border::clip;
        CAPTURE(width);
        CAPTURE(height);
        CAPTURE(window);
        CAPTURE(int(border));
        Image<float> image{width, height};
        const int kind = below(6);
        CAPTURE(kind);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const bool hole = (kind == 1 && below(4) == 0) || (kind == 2 && y < height / 2) ||
                                  (kind == 3 && x > width / 2) ||
                                  (kind == 4 && y % 40 >= 12 && x % 31 >= 5) || kind == 5;
                image(x, y) = hole ? 0 : 1000 + 1e-3f * static_cast<float>(below(1000));
            }
        check_against_direct(image, window, border, filter<1>(image, window, border), 1e-12);
        check_against_direct(image, window, border, filter<native_lanes>(image, window, border),
                             1e-12);
    }
}

TEST_CASE("a spike on the pivots costs a factor below the samples in the window, not the variance")
{
    // Pivots lie at the ends of blocks, wherever those are: every place of a 40 × 40 lattice is tried
    // in both axes by spikes one row and one column further each time.
    const int width = 200, height = 100, window = 17;
    for (int shift = 0; shift < 40; ++shift) {
        CAPTURE(shift);
        Image<float> image{width, height};
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const bool spike = (x + shift) % 40 == 0 || (y + shift) % 40 == 0;
                image(x, y) = spike ? 1e6f : 1 + 1e-6f * static_cast<float>((x * 7 + y * 3) % 5);
            }
        // (2 k + 6) k roundings of double, to first order.
        const double bound = (2 * window + 6) * window * 0x1p-53;
        check_against_direct(image, window, Border::symmetric,
                             filter<native_lanes>(image, window, Border::symmetric), 2 * bound);
    }
}

TEST_CASE("double images keep the relief of their last bits")
{
    Image<double> image{90, 70};
    for (int y = 0; y < 70; ++y)
        for (int x = 0; x < 90; ++x) image(x, y) = 1 + 0x1p-52 * ((x * 5 + y * 3) % 7);
    check_against_direct(image, 9, Border::symmetric, filter<1>(image, 9, Border::symmetric),
                         1e-13);
    check_against_direct(image, 9, Border::symmetric,
                         filter<native_lanes>(image, 9, Border::symmetric), 1e-13);
}

TEST_CASE("the last strip keeps to the memory that the widest was given")
{
    // It has a few columns less. Dealt to the lanes by itself it took more steps than the widest, and
    // wrote into its neighbour's memory.
    const auto check = [](auto lanes, int window, int width) {
        const int height = window + 2, radius = window / 2;
        CAPTURE(window);
        Image<float> image{width, height};
        std::mt19937 random{2};
        for (float& distance : image) distance = 1 + 1e-3f * static_cast<float>(random() % 1000);
        const Moments moments = filter<decltype(lanes)::value>(image, window, Border::symmetric);
        for (int i = 0; i < 40; ++i) {
            const int x =
                i < 20 ? width - 1 - i * radius / 16 : static_cast<int>(random() % 4) * (width / 4);
            const int y = height / 2 - 1 + i % 3;
            const auto expected =
                direct_moments<double>(nook::depth_source(image.view()), image(x, y),
                                       window_span(x, radius, width, Border::symmetric),
                                       window_span(y, radius, height, Border::symmetric));
            REQUIRE(moments.count(x, y) == expected.count);
            REQUIRE(std::fabs(moments.variance(x, y) - expected.variance) <=
                    1e-11 * expected.variance);
        }
    };
    check(std::integral_constant<int, 1>{}, 393, 1617);
    constexpr int window = native_lanes == 8 ? 815 : native_lanes == 4 ? 303 : 295;
    constexpr int width = native_lanes == 8 ? 4987 : native_lanes == 4 ? 1575 : 1551;
    check(std::integral_constant<int, native_lanes>{}, window, width);
}

TEST_CASE("windows of one pixel reach the last column of a wide image")
{
    // They were filtered in the first strip alone.
    const Image<float> image{12000, 2, 3.0f};
    const Moments moments = filter<native_lanes>(image, 1, Border::symmetric);
    for (const double count : moments.count) REQUIRE(count == 1);
}

TEST_SUITE_END();
