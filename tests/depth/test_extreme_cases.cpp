#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/depth/moments.hpp>
#include <nook/thread_executor.hpp>

#include "pictures.hpp"

/// Stiff and extreme depths, numbered. Each has one right answer, for float and double distances, for
/// one window and for windows that differ, on images of one pixel and of many strips.
namespace {

using namespace pictures;
using nook::ChebyshevOptions;
using nook::Projection;

constexpr Size tiny{37, 23};
constexpr std::array large{Size{1300, 90}, Size{700, 300}};

template <class Function>
void for_both_distances(const Function& function)
{
    {
        INFO("float distances");
        function(float{});
    }
    {
        INFO("double distances");
        function(double{});
    }
}

/// Relief of 1e-6 at distance 1.
template <class Distance>
Image<Distance> fine_relief(Size size)
{
    Random random{5};
    return make<Distance>(size, [&](int, int) { return 1 + 1e-6 * random.uniform(); });
}

struct Pixel {
    int x, y;
};

/// The corners, the sides, where blocks of the window's size and of powers of two end, and more.
std::vector<Pixel> awkward_pixels(Size size, int window)
{
    const int right = size.width - 1, bottom = size.height - 1;
    std::vector<Pixel> pixels{{0, 0},
                              {right, 0},
                              {0, bottom},
                              {right, bottom},
                              {size.width / 2, size.height / 2},
                              {window - 1, window - 1},
                              {window, window},
                              {2 * window - 1, 2 * window},
                              {63, 64},
                              {64, 63},
                              {512, 31},
                              {right - window / 2, bottom - window / 2},
                              {right - 7, bottom - 16}};
    std::erase_if(pixels, [&](const Pixel& pixel) {
        return pixel.x < 0 || pixel.y < 0 || pixel.x > right || pixel.y > bottom;
    });
    return pixels;
}

/// Everything that a fixed window gives.
template <class Distance>
struct Answer {
    Image<float> narrow;
    Image<double> wide;
    Moments<double> all;

    Answer(const Image<Distance>& image, int window, Border border)
        : narrow{visibility<float>(image, fixed(window, border))},
          wide{visibility<double>(image, fixed(window, border))},
          all{moments<double>(image, window, border)}
    {}
    bool equals(const Answer& other, int x, int y) const
    {
        return same_bits(narrow(x, y), other.narrow(x, y)) &&
               same_bits(wide(x, y), other.wide(x, y)) &&
               all.count(x, y) == other.all.count(x, y) &&
               same_bits(all.variance(x, y), other.all.variance(x, y)) &&
               same_bits(all.deviation(x, y), other.all.deviation(x, y)) &&
               same_bits(all.mean(x, y), other.all.mean(x, y));
    }
};

/// Puts `bad` on pixels of an image and compares what comes out with the answer without it.
template <class Distance>
void check_contained(const Image<Distance>& clean, const Answer<Distance>& expected,
                     const std::vector<Pixel>& pixels, Distance bad, int window, Border border)
{
    const Size size{clean.width(), clean.height()};
    Image<Distance> image = clean;
    Image<std::uint8_t> touched{size.width, size.height};
    const int reach = window / 2;
    for (const auto& [bad_x, bad_y] : pixels) {
        image(bad_x, bad_y) = bad;
        for (int y = std::max(0, bad_y - reach); y <= std::min(size.height - 1, bad_y + reach); ++y)
            for (int x = std::max(0, bad_x - reach); x <= std::min(size.width - 1, bad_x + reach);
                 ++x)
                touched(x, y) |= Window{size, x, y, window, border}.holds(bad_x, bad_y);
    }
    CAPTURE(bad);
    CAPTURE(window);
    CAPTURE(size.width);
    CAPTURE(int(border));
    CAPTURE(pixels.front().x);
    CAPTURE(pixels.front().y);
    const Answer<Distance> answer{image, window, border};
    const bool surface = is_surface(bad);
    CHECK(worst(size, [&](int x, int y) {
              const double value = answer.wide(x, y);
              const bool valid = value >= 0 && value <= 1 &&
                                 std::isfinite(answer.all.variance(x, y)) &&
                                 std::isfinite(answer.all.deviation(x, y));
              if (!touched(x, y)) return !valid || !answer.equals(expected, x, y);
              // A bad sample that is no surface leaves the count; a surface stays in it.
              const bool counted = surface ? answer.all.count(x, y) == expected.all.count(x, y)
                                           : answer.all.count(x, y) < expected.all.count(x, y);
              return !valid || !counted;
          }) == 0);
}

/// As above for all the pixels that are hard to get right: one by one, and many at a time.
template <class Distance>
void check_contained_everywhere(const std::vector<Distance>& bad_values)
{
    for (const int window : {3, 5, 9}) {
        const Border border = window == 5 ? Border::clip : Border::symmetric;
        const Image<Distance> clean = fine_relief<Distance>(tiny);
        const Answer<Distance> expected{clean, window, border};
        for (int y = 0; y < tiny.height; ++y)
            for (int x = y % 2; x < tiny.width; x += 2)
                check_contained(clean, expected, {{x, y}}, bad_values.front(), window, border);
    }
    for (const Size size : large)
        for (const int window : {3, 31, 127}) {
            const Border border = size.width == 1300 ? Border::symmetric : Border::clip;
            const Image<Distance> clean = fine_relief<Distance>(size);
            const Answer<Distance> expected{clean, window, border};
            const std::vector<Pixel> pixels = awkward_pixels(size, window);
            for (std::size_t i = window == 31 ? 0 : 1; i < pixels.size(); i += window == 31 ? 1 : 4)
                check_contained(clean, expected, {pixels[i]}, bad_values[i % bad_values.size()],
                                window, border);
            for (const Distance bad : bad_values) {
                std::vector<Pixel> many;
                for (int y = window / 3; y < size.height; y += 2 * window + 5)
                    for (int x = y % 7; x < size.width; x += 2 * window + 1) many.push_back({x, y});
                check_contained(clean, expected, many, bad, window, border);
            }
        }
}

/// The same where windows differ: within the tolerance of that filter.
template <class Distance>
void check_contained_in_variable_windows(Distance bad)
{
    const Size size{210, 130};
    const Image<Distance> clean = fine_relief<Distance>(size);
    for (const int window : {5, 25}) {
        const Call call = variable(window);
        const Image<float> expected = visibility<float>(clean, call);
        for (const Pixel& at : awkward_pixels(size, window)) {
            Image<Distance> image = clean;
            image(at.x, at.y) = bad;
            const Image<float> answer = visibility<float>(image, call);
            CAPTURE(window);
            CAPTURE(bad);
            CAPTURE(at.x);
            CAPTURE(at.y);
            CHECK(worst(size, [&](int x, int y) {
                      const auto value = static_cast<double>(answer(x, y));
                      if (Window{size, x, y, window}.holds(at.x, at.y))
                          return value >= 0 && value <= 1 ? 0.0 : 2.0;
                      return std::fabs(value - static_cast<double>(expected(x, y)));
                  }) <= variable_tolerance);
        }
    }
}

/// Compares a call with exact arithmetic at random pixels, in units of the last place of a float.
template <class Distance>
void check_exact(const Image<Distance>& image, int window, Border border, int pixels)
{
    const Size size{image.width(), image.height()};
    const Image<float> ao = visibility<float>(image, fixed(window, border));
    const Image<float> differing = visibility<float>(image, variable(window, border));
    const Moments<float> narrow = moments<float>(image, window, border);
    const Moments<double> wide = moments<double>(image, window, border);
    Random random{77};
    for (int i = 0; i < pixels; ++i) {
        const int x = random.below(size.width), y = random.below(size.height);
        if (!is_surface(image(x, y))) continue;
        const Exact expected{image, x, y, window, border};
        CAPTURE(window);
        CAPTURE(x);
        CAPTURE(y);
        const auto variance = static_cast<double>(expected.variance);
        const auto deviation = static_cast<double>(expected.deviation);
        CHECK(narrow.count(x, y) == expected.count);
        CHECK(ulps<float>(double{narrow.variance(x, y)}, variance) <= 8);
        CHECK(std::fabs(wide.variance(x, y) - variance) <= 1e-13 * variance);
        CHECK(std::fabs(wide.deviation(x, y) - deviation) <= 1e-13 * std::sqrt(variance));
        CHECK(ulps<float>(double{ao(x, y)}, expected.visibility(0)) <= 8);
        CHECK(std::fabs(double{differing(x, y)} - expected.visibility(0)) <= variable_tolerance);
    }
}

}  // namespace

TEST_CASE("case 1: a constant depth is exactly open, borders included, without bias and with one")
{
    for_both_distances([]<class Distance>(Distance) {
        const auto check = [](Size size, int window, double depth) {
            const Image<Distance> image{size.width, size.height, static_cast<Distance>(depth)};
            CAPTURE(size.width);
            CAPTURE(window);
            CAPTURE(depth);
            for (const Border border : {Border::symmetric, Border::clip})
                for (Call call : {fixed(window, border), variable(window, border)}) {
                    CHECK(all_equal(visibility<Distance>(image, call), Distance{1}));
                    call.options.bias.reset();
                    CHECK(all_equal(visibility<float>(image, call), 1.f));
                }
        };
        for (const double depth : {0.0, 1e-38, 0.1, 1.0, 1e5, 1e30}) {
            for (const Size size : {Size{1, 1}, Size{2, 5}, tiny, Size{1, 130}, Size{131, 3}})
                for (const int window : {1, 3, 9, 31, 301}) check(size, window, depth);
            check(large[0], 31, depth);
        }
        for (const Size size : large)
            for (const int window : {3, 127}) check(size, window, 0.1);
    });
}

TEST_CASE("case 2: one pixel an ulp farther gets 1/N, or above 0.99 from a bias of 100 ulp²")
{
    for_both_distances([]<class Distance>(Distance) {
        const auto check = [](Size size, int window, Pixel pixel) {
            const Distance depth{1000};
            Image<Distance> image{size.width, size.height, depth};
            image(pixel.x, pixel.y) = std::nextafter(depth, Distance{2000});
            const double step = static_cast<double>(image(pixel.x, pixel.y) - depth);
            const double share = 1.0 / Window{size, pixel.x, pixel.y, window}.samples();
            CAPTURE(size.width);
            CAPTURE(window);
            CAPTURE(pixel.x);
            CAPTURE(pixel.y);
            Image<float> ao = visibility<float>(image, fixed(window));
            CHECK(ulps<float>(double{ao(pixel.x, pixel.y)}, share) <= 4);
            ao(pixel.x, pixel.y) = 1;
            CHECK(all_equal(ao, 1.f));
            Call call = fixed(window);
            call.options.bias = 100 * step * step;
            CHECK(visibility<double>(image, call)(pixel.x, pixel.y) >= 0.99);
            call = variable(window);
            Image<float> differing = visibility<float>(image, call);
            CHECK(std::fabs(double{differing(pixel.x, pixel.y)} - share) <= variable_tolerance);
            differing(pixel.x, pixel.y) = 1;
            CHECK(difference(differing, ao) <= variable_tolerance);
            call.options.bias = 100 * step * step;
            CHECK(visibility<double>(image, call)(pixel.x, pixel.y) >= 0.99);
        };
        for (const int window : {3, 7, 51})
            for (int y = 0; y < tiny.height; y += 2)
                for (int x = 0; x < tiny.width; ++x) check(tiny, window, {x, y});
        for (const Size size : large)
            for (const int window : {5, 63}) {
                check(size, window, {size.width - 1 - window, 40});
                check(size, window, {512, size.height - 1});
            }
    });
}

TEST_CASE("case 3: relief of 1e-3 at 1e5 is what the floats hold, not what was meant")
{
    // An ulp is 1/128 there: the relief survives where the plane passes between two floats.
    Random random{3};
    const Image<double> meant = make<double>({1300, 90}, [&](int x, int) {
        return 1e5 + 1.0 / 256 + 1e-5 * x + 1e-3 * random.normal();
    });
    const Image<float> held = make<float>({1300, 90}, [&](int x, int y) { return meant(x, y); });
    for (const int window : {3, 17, 63})
        for (const Border border : {Border::symmetric, Border::clip}) {
            check_exact(held, window, border, 15);
            check_exact(meant, window, border, 15);
        }
    CHECK(
        difference(visibility<float>(held, fixed(17)), visibility<float>(meant, fixed(17))).value >
        0.1);
}

TEST_CASE("case 4: relief of 1e-3 at 1e3 keeps its variance to 8 ulps, in double to 1e-13")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Size size : {tiny, large[0], large[1]}) {
            Random random{4};
            const Image<Distance> image =
                make<Distance>(size, [&](int, int) { return 1000 + 1e-3 * random.normal(); });
            for (const int window : {3, 9, 65})
                check_exact(image, window, window == 9 ? Border::clip : Border::symmetric, 12);
        }
    });
}

TEST_CASE("case 5: a spike of 1e30 changes no bit outside the windows that contain it")
{
    for_both_distances([]<class Distance>(Distance) {
        check_contained_everywhere<Distance>({Distance(1e30)});
        check_contained_in_variable_windows(Distance(1e30));
    });
}

TEST_CASE("case 6: a NaN changes no bit outside the windows that contain it, and leaves those")
{
    for_both_distances([]<class Distance>(Distance) {
        check_contained_everywhere<Distance>({not_a_number<Distance>, -not_a_number<Distance>});
        check_contained_in_variable_windows(not_a_number<Distance>);
    });
}

TEST_CASE("case 7: an infinity of either sign changes no bit outside the windows that contain it")
{
    for_both_distances([]<class Distance>(Distance) {
        check_contained_everywhere<Distance>({infinity<Distance>, -infinity<Distance>});
        check_contained_in_variable_windows(infinity<Distance>);
        check_contained_in_variable_windows(-infinity<Distance>);
        // All kinds of background give the same bits.
        for (const Call& call : {fixed(9), variable(9)}) {
            Image<Distance> image = fine_relief<Distance>({200, 90});
            for (int i = 0; i < 200 * 90; i += 37) image(i % 200, i / 200) = 0;
            const Image<double> expected = visibility<double>(image, call);
            for (const Distance background :
                 {not_a_number<Distance>, infinity<Distance>, -infinity<Distance>, Distance{-1}}) {
                for (int i = 0; i < 200 * 90; i += 37) image(i % 200, i / 200) = background;
                CHECK(same_bits(visibility<double>(image, call), expected));
            }
        }
    });
}

TEST_CASE("case 8: an image of NaN, infinity, zero or negative depth is open everywhere")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Distance value : {not_a_number<Distance>, infinity<Distance>,
                                     -infinity<Distance>, Distance{0}, Distance{-5}})
            for (const Size size : {Size{1, 1}, tiny, large[0]})
                for (const int window : {3, 31, 2001})
                    for (const Call& call : {fixed(window), variable(window)}) {
                        const Image<Distance> image{size.width, size.height, value};
                        Image<double> ao{size.width, size.height};
                        const auto outcome = nook::chebyshev_ao(image.view(), ao.view(),
                                                                call.options, call.projection);
                        REQUIRE(outcome);
                        CHECK(all_equal(ao, 1.0));
                        // Infinity lies within no limit, not even an infinite one.
                        const nook::DepthSource unlimited{
                            image.view(), nook::IdentityDecode{}, {}, infinity<Distance>};
                        CHECK(all_equal(visibility<float>(unlimited, call), 1.f));
                        CHECK(outcome.work.background ==
                              std::uint64_t(size.width) * std::uint64_t(size.height));
                    }
    });
}

TEST_CASE("case 9: under a sky, the horizon is made of finite samples alone")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Size size : {Size{60, 50}, large[0], large[1]}) {
            Random random{9};
            const int horizon = size.height * 3 / 10;
            const auto scene = [&](Distance sky) {
                Random relief{9};
                return make<Distance>(size, [&](int, int y) {
                    return y < horizon ? sky : Distance(50 + 0.5 * relief.uniform() - 0.1 * y);
                });
            };
            const Image<Distance> endless = scene(infinity<Distance>), far_away = scene(1e30f);
            const nook::DepthSource limited{far_away.view(),
                                            nook::IdentityDecode{},
                                            {0, std::numeric_limits<Distance>::epsilon(), 0},
                                            Distance{1e20f}};
            for (const int window : {3, 21}) {
                const Moments<double> found = moments<double>(endless, window);
                const Image<float> ao = visibility<float>(endless, fixed(window));
                CHECK(same_bits(visibility<float>(limited, fixed(window)), ao));
                const Image<float> differing = visibility<float>(endless, variable(window));
                CHECK(same_bits(visibility<float>(limited, variable(window)), differing));
                for (int y = 0; y < horizon; ++y)
                    for (int x = 0; x < size.width; ++x) REQUIRE(ao(x, y) == 1);
                for (int i = 0; i < 20; ++i) {
                    const int x = random.below(size.width), y = horizon + i % (window / 2 + 1);
                    const Exact expected{endless, x, y, window, Border::symmetric};
                    CHECK(found.count(x, y) == expected.count);
                    const auto variance = static_cast<double>(expected.variance);
                    CHECK(std::fabs(found.variance(x, y) - variance) <= 1e-13 * variance);
                    CHECK(ulps<float>(double{ao(x, y)}, expected.visibility(0)) <= 8);
                    CHECK(std::fabs(double{differing(x, y)} - expected.visibility(0)) <=
                          variable_tolerance);
                }
            }
        }
    });
}

TEST_CASE("case 10: reversed depth of 1e-7 under a sky of 0 stays in [1/N, 1], without NaN")
{
    const Size size{700, 300};
    Random random{10};
    const Image<float> stored = make<float>(
        size, [&](int x, int y) { return y < 90 + x % 7 ? 0 : 1e-7 * (1 + random.uniform()); });
    const Projection endless{.fx = 600,
                             .fy = 600,
                             .cx = 350,
                             .cy = 150,
                             .encoding = nook::DepthEncoding::reversed,
                             .near_plane = 0.1};
    const auto check = [&](const auto& source, const Call& call, int window) {
        const Image<double> ao = visibility<double>(source, call);
        CHECK(worst(size, [&](int x, int y) {
                  if (stored(x, y) == 0) return !(ao(x, y) == 1);
                  const double least = 1.0 / Window{size, x, y, window}.samples();
                  return !(ao(x, y) >= least * (1 - 1e-12) && ao(x, y) <= 1);
              }) == 0);
        double sum = 0;
        for (const double value : ao) sum += 1 - value;
        CHECK(sum > size.width);  // something is shaded
    };
    for (const int window : {3, 31}) {
        check(nook::hardware_depth(stored.view(), endless), fixed(window), window);
        check(nook::depth_source(stored.view()), fixed(window), window);
        check(nook::hardware_depth(stored.view(), endless), variable(window), window);
        check(nook::depth_source(stored.view()), variable(window), window);
    }
}

namespace {

/// A scaled image gives the same bits.
template <class Distance>
void check_scale(const Image<Distance>& image, Distance factor)
{
    const auto scaled = make<Distance>({image.width(), image.height()},
                                       [&](int x, int y) { return image(x, y) * factor; });
    CAPTURE(factor);
    for (const int window : {3, 9, 31})
        for (const bool automatic : {false, true})
            for (Call call : {fixed(window), variable(window)}) {
                if (automatic) call.options.bias.reset();
                const auto expected = visibility<double>(image, call);
                CHECK(same_bits(visibility<double>(scaled, call), expected));
                double shade = 0;
                for (const double value : expected) shade = std::max(shade, 1 - value);
                CHECK(shade > 0.1);
            }
}

template <class Distance>
Image<Distance> denormal_relief()
{
    Random random{11};
    // Whole multiples of the smallest float.
    return make<Distance>({150, 70},
                          [&](int, int) { return 0x1p-149 * (700 + random.below(300)); });
}

}  // namespace

TEST_CASE("case 11: denormal distances shade like the same image 2^100 times larger")
{
    check_scale(denormal_relief<float>(), 0x1p100f);
    check_scale(denormal_relief<double>(), 0x1p100);
}

TEST_CASE("case 12: distances of 3e38, in double of 1e144, do not overflow")
{
    Random random{12};
    const Size size{150, 70};
    const auto relief = [&](double largest) {
        return [&random, largest](int x, int y) {
            return (x + y) % 29 == 0 ? largest : largest * (0.5 + 0.5 * random.uniform());
        };
    };
    check_scale(make<float>(size, relief(3e38)), 0x1p-100f);
    check_scale(make<double>(size, relief(3e38)), 0x1p-100);
    check_scale(make<double>(size, relief(1e144)), 0x1p-400);
    for (const double value :
         moments<double>(make<double>(size, relief(1e144)), 301, Border::clip).variance)
        REQUIRE(std::isfinite(value));
}

TEST_CASE("case 13: negative view-space z through a negating source gives the bits of distances")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Size size : {Size{1, 1}, tiny, large[0]}) {
            const Image<Distance> image = fine_relief<Distance>(size);
            const Image<Distance> view_z =
                make<Distance>(size, [&](int x, int y) { return -image(x, y); });
            const nook::DepthSource source{view_z.view(), [](Distance z) { return -z; }};
            for (const int window : {3, 31, 127})
                for (const Call& call : {fixed(window), variable(window)}) {
                    CHECK(same_bits(visibility<double>(source, call),
                                    visibility<double>(image, call)));
                    CHECK(all_equal(visibility<float>(view_z, call), 1.f));
                }
            CHECK(
                same_bits(moments<double>(source, 9).variance, moments<double>(image, 9).variance));
        }
    });
}

TEST_CASE(
    "case 14: images smaller than a window, as large, and a pixel larger, get the exact result")
{
    for_both_distances([]<class Distance>(Distance) {
        Random random{14};
        const auto check = [&](Size size, int window) {
            const Image<Distance> image =
                make<Distance>(size, [&](int, int) { return 1 + random.uniform(); });
            CAPTURE(size.width);
            CAPTURE(size.height);
            CAPTURE(window);
            for (const Border border : {Border::symmetric, Border::clip}) {
                const Image<float> ao = visibility<float>(image, fixed(window, border));
                CHECK(difference(visibility<float>(image, variable(window, border)), ao) <=
                      variable_tolerance);
                const int last_x = size.width - 1, last_y = size.height - 1;
                for (const auto& [x, y] :
                     {Pixel{0, 0}, Pixel{last_x, last_y}, Pixel{last_x / 2, last_y / 2},
                      Pixel{last_x / 3, last_y}, Pixel{last_x, last_y / 3}})
                    CHECK(ulps<float>(double{ao(x, y)},
                                      Exact{image, x, y, window, border}.visibility(0)) <= 8);
            }
        };
        for (const int window : {3, 7, 17, 33})
            for (const int across : {1, 2, window - 1, window, window + 1})
                for (const int down : {1, window - 1, window + 1, 2 * window}) {
                    check({across, down}, window);
                    check({down, across}, window);
                }
        check({1300, 2}, 4001);
        check({2, 1300}, 4001);
        check({300, 1}, 127);
        for (const int extent : {0, 1, 700})
            for (const Call& call : {fixed(31), variable(31)}) {
                CHECK(visibility<Distance>(Image<Distance>{0, extent}, call).begin() ==
                      Image<Distance>{0, extent}.end());
                for (const auto& [width, height] : {Size{extent, 0}, Size{0, extent}})
                    CHECK(
                        nook::chebyshev_ao(nook::ImageView<const Distance>{nullptr, width, height},
                                           nook::ImageView<float>{nullptr, width, height},
                                           call.options, call.projection));
            }
    });
}

TEST_CASE("case 15: steps of 1e-6 and of 1e6 have the same ramp, (r + 1 + j) / (2r + 1)")
{
    const auto check = [](Size size, int radius, auto base, double height, bool upright) {
        using Distance = decltype(base);
        const int edge = (upright ? size.width : size.height) / 2 + 1;
        const Image<Distance> image = make<Distance>(size, [&](int x, int y) {
            return (upright ? x : y) < edge ? base : static_cast<Distance>(base + height);
        });
        const int window = 2 * radius + 1;
        CAPTURE(size.width);
        CAPTURE(radius);
        CAPTURE(height);
        CAPTURE(upright);
        const auto error = [&](const auto& ao, const auto& distance) {
            return worst(size, [&](int x, int y) {
                const int along = upright ? x : y, extent = upright ? size.width : size.height;
                const int j = along - edge, r = std::min({radius, along, extent - 1 - along});
                const double ramp = std::min(1.0, (r + 1.0 + j) / (2 * r + 1));
                return distance(static_cast<double>(ao(x, y)), j < 0 ? 1 : ramp);
            });
        };
        CHECK(error(visibility<float>(image, fixed(window)), ulps<float>) <= 1);
        CHECK(error(visibility<double>(image, fixed(window)),
                    [](double a, double b) { return std::fabs(a - b); }) <= 1e-14);
        // Level ground beside a step is read directly there, at a cost of k².
        if (radius > 7 && size.width > 41) return;
        CHECK(error(visibility<float>(image, variable(window)),
                    [](double a, double b) { return std::fabs(a - b); }) <= variable_tolerance);
    };
    for (const Size size : {Size{41, 41}, large[0], large[1]})
        for (const int radius : {1, 7, 63})
            for (const bool upright : {true, false}) {
                check(size, radius, 1.f, 1e-6, upright);
                check(size, radius, 1.f, 1e6, upright);
                check(size, radius, 1.0, 1e-6, upright);
                check(size, radius, 1.0, 1e6, upright);
                check(size, radius, 1.0, 1e-14, upright);
                check(size, radius, 1.0, 1e140, upright);
            }
}

TEST_CASE("case 16: on a checkerboard deep pixels get (N + 1) / 2N, shallow ones 1")
{
    const auto check = [](Size size, int window, auto shallow, auto deep) {
        using Distance = decltype(shallow);
        const Image<Distance> image =
            make<Distance>(size, [&](int x, int y) { return (x + y) % 2 ? deep : shallow; });
        CAPTURE(size.width);
        CAPTURE(window);
        const auto expected = [&](int x, int y) {
            // Windows that shrink at the border have the odd one in their centre or beside it.
            const Window span{size, x, y, window};
            const bool centre = (span.columns.first + span.rows.first + x + y) % 2 == 0;
            const double samples = span.samples();
            return (x + y) % 2 ? (samples + (centre ? 1 : -1)) / (2 * samples) : 1.0;
        };
        const auto ao = visibility<float>(image, fixed(window));
        CHECK(worst(size, [&](int x, int y) {
                  return ulps<float>(double{ao(x, y)}, expected(x, y));
              }) <= 1);
        const auto differing = visibility<double>(image, variable(window));
        CHECK(worst(size, [&](int x, int y) {
                  return std::fabs(differing(x, y) - expected(x, y));
              }) <= variable_tolerance);
    };
    for (const Size size : {tiny, Size{130, 7}, large[0], large[1]})
        for (const int window : {3, 15, 127}) {
            check(size, window, 1.f, 2.f);
            check(size, window, 0.1f, 1e20f);
            check(size, window, 1.0, 1.0 + 0x1p-52);
        }
}

TEST_CASE("case 17: windows from distances: clamped, odd, and as large as the pixel asks")
{
    for_both_distances([]<class Distance>(Distance) {
        const Size size{131, 77};
        Random random{17};
        const Projection projection{.fx = 100, .fy = 100, .cx = 65, .cy = 38};
        // Tiny distances: the largest window allowed. The image is scaled, so its shade is not.
        const Image<Distance> unit =
            make<Distance>(size, [&](int, int) { return 1 + random.uniform(); });
        const Image<Distance> nearest =
            make<Distance>(size, [&](int x, int y) { return unit(x, y) * Distance(0x1p-126); });
        const Image<float> ao =
            visibility<float>(nearest, {{.radius = 1, .max_window = 25, .bias = 0}, projection});
        CHECK(difference(ao, visibility<float>(unit, fixed(25))) <= variable_tolerance);
        // Without a distance, or too far for a neighbour: the pixel alone.
        Image<Distance> holes = unit;
        const std::array open{not_a_number<Distance>, infinity<Distance>, Distance{0}, Distance{-1},
                              Distance(1e30)};
        for (int i = 0; i < size.width * size.height; i += 7)
            holes(i % size.width, i / size.width) = open[std::size_t(i / 7) % open.size()];
        const Call call{{.radius = 0.2, .max_window = 31, .bias = 0}, projection};
        const Image<float> open_ao = visibility<float>(holes, call);
        for (int i = 0; i < size.width * size.height; i += 7)
            REQUIRE(open_ao(i % size.width, i / size.width) == 1);
        CHECK(difference(open_ao, reference<float>(holes, call)) <= variable_tolerance);
        // 100 · radius pixels, whatever the fraction: 2 ⌊…⌋ + 1, never even.
        const Image<Distance> flat = make<Distance>(
            size, [&](int, int) { return 0x1p10 * (1 + 0x1p-20 * random.uniform()); });
        for (const double pixels : {0.25, 0.999, 1.01, 1.5, 1.99, 2.5, 7.25, 7.75}) {
            CAPTURE(pixels);
            const Call odd{{.radius = pixels * 0x1p10 / 100 * (1 + 1e-5), .bias = 0}, projection};
            CHECK(difference(visibility<float>(flat, odd),
                             visibility<float>(flat, fixed(2 * int(pixels) + 1))) <=
                  variable_tolerance);
        }
        // Neighbours with the largest window and with none.
        const Image<Distance> jumping = make<Distance>(size, [&](int x, int y) {
            return (x * 5 + y * 3) % 4 < 2 ? 1e-3 * (1 + random.uniform()) : 1e3 + random.uniform();
        });
        const Call jump{{.radius = 1, .max_window = 63, .bias = 0}, projection};
        const Image<float> mixed = visibility<float>(jumping, jump);
        CHECK(difference(mixed, reference<float>(jumping, jump)) <= variable_tolerance);
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x)
                if (jumping(x, y) > 1) REQUIRE(mixed(x, y) == 1);
    });
    // A fixed window must be odd.
    const Image<float> image{4, 4, 1.f};
    Image<float> ao{4, 4, -1.f};
    CHECK(std::string{nook::chebyshev_ao(image.view(), ao.view(), {.window = 4}).error.argument} ==
          "options.window");
    CHECK(all_equal(ao, -1.f));
}

TEST_CASE("case 18: turned and mirrored images give turned and mirrored results, to 8 ulps")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Size size : {tiny, Size{333, 90}, large[0]}) {
            Random random{18};
            const Image<Distance> image = make<Distance>(size, [&](int x, int y) {
                if (random.chance(0.02)) return 0.0;
                return 3 + std::sin(x * 0.1) * std::cos(y * 0.2) + 1e-3 * random.uniform();
            });
            const int last_x = size.width - 1, last_y = size.height - 1;
            for (const int window : {3, 31})
                for (const Border border : {Border::symmetric, Border::clip}) {
                    const Image<float> ao = visibility<float>(image, fixed(window, border));
                    const Image<float> differing =
                        visibility<float>(image, variable(window, border));
                    for (int turn = 1; turn < 8; ++turn) {
                        const bool transpose = turn & 4;
                        const Size turned = transpose ? Size{size.height, size.width} : size;
                        const auto from = [&](int x, int y) {
                            if (transpose) std::swap(x, y);
                            return Pixel{turn & 1 ? last_x - x : x, turn & 2 ? last_y - y : y};
                        };
                        const Image<Distance> other = make<Distance>(turned, [&](int x, int y) {
                            const auto [at_x, at_y] = from(x, y);
                            return image(at_x, at_y);
                        });
                        CAPTURE(size.width);
                        CAPTURE(window);
                        CAPTURE(turn);
                        const Image<float> result = visibility<float>(other, fixed(window, border));
                        CHECK(worst(turned, [&](int x, int y) {
                                  const auto [at_x, at_y] = from(x, y);
                                  return ulps<float>(double{result(x, y)}, double{ao(at_x, at_y)});
                              }) <= 8);
                        const Image<float> moved =
                            visibility<float>(other, variable(window, border));
                        CHECK(worst(turned, [&](int x, int y) {
                                  const auto [at_x, at_y] = from(x, y);
                                  return std::fabs(moved(x, y) - differing(at_x, at_y));
                              }) <= variable_tolerance);
                    }
                }
        }
    });
}

TEST_CASE("case 19: an image times 2^n gives the same bits, with its lengths and bias scaled too")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Size size : {tiny, Size{333, 90}}) {
            Random random{19};
            const Image<Distance> image = make<Distance>(size, [&](int x, int y) {
                if (random.chance(0.02)) return -1.0;
                return 3 + std::sin(x * 0.1) * std::cos(y * 0.2) + 1e-3 * random.uniform();
            });
            const Projection projection{.fx = 300, .fy = 200, .cx = 160, .cy = 45};
            for (const double bias : {-1.0, 0.0, 1e-4})
                for (const double range : {0.0, 0.3})
                    for (const double radius : {0.0, 0.1}) {
                        const auto call = [&](double scale) {
                            ChebyshevOptions options{.window = 15, .radius = radius * scale};
                            if (bias >= 0) options.bias = bias * scale * scale;
                            if (range > 0) options.range = range * scale;
                            return Call{options, projection};
                        };
                        const Image<double> expected = visibility<double>(image, call(1));
                        for (const int power : {-100, -31, -1, 1, 40, 120}) {
                            const double scale = std::ldexp(1.0, power);
                            const Image<Distance> scaled = make<Distance>(size, [&](int x, int y) {
                                return static_cast<double>(image(x, y)) * scale;
                            });
                            CAPTURE(size.width);
                            CAPTURE(bias);
                            CAPTURE(radius);
                            CAPTURE(power);
                            CHECK(same_bits(visibility<double>(scaled, call(scale)), expected));
                        }
                    }
        }
    });
}

namespace {

/// Runs tasks from the last to the first, as seven workers that take turns.
struct Backwards {
    static int concurrency() { return 7; }
    template <class Function>
    void for_each(int count, Function&& function) const
    {
        for (int task = count - 1; task >= 0; --task) function(task, task % 7);
    }
};

/// Scratch that holds NaN, so that what is read before it is written shows.
struct Poisoned {
    std::vector<std::uint8_t> bytes;
    std::uint8_t fill;

    void* reserve(std::size_t size)
    {
        bytes.assign(size, fill);
        return bytes.data();
    }
};

}  // namespace

TEST_CASE("case 20: any number of threads, order of tasks and content of scratch: the same bits")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Size size : {Size{1, 1}, tiny, large[0], large[1]}) {
            Random random{20};
            const Image<Distance> image = make<Distance>(size, [&](int x, int y) {
                if (random.chance(y > 40 && x < 200 ? 0.3 : 0.001)) return 0.0;
                return 1 + x * 0.01 + 1e-3 * random.uniform();
            });
            const Projection projection{.fx = 80, .fy = 80, .cx = 160, .cy = 45};
            const Call radius{{.radius = 0.1, .bias = 0}, projection};
            for (const Call& call : {fixed(3), fixed(31), fixed(127), variable(9), radius}) {
                CAPTURE(size.width);
                CAPTURE(call.options.window);
                CAPTURE(call.options.radius);
                const Image<double> wide = visibility<double>(image, call);
                const Image<float> narrow = visibility<float>(image, call);
                for (const int workers : {2, 3, 8}) {
                    nook::ThreadExecutor threads{workers};
                    CHECK(same_bits(visibility<double>(image, call, threads), wide));
                    CHECK(same_bits(visibility<float>(image, call, threads), narrow));
                }
                CHECK(same_bits(visibility<double>(image, call, Backwards{}), wide));
                for (const std::uint8_t fill : std::array<std::uint8_t, 3>{0xff, 0x7f, 0x01}) {
                    Image<double> result{size.width, size.height, -1.0};
                    REQUIRE(nook::chebyshev_ao(image.view(), result.view(), call.options,
                                               call.projection, {}, Poisoned{{}, fill},
                                               Backwards{}));
                    CHECK(same_bits(result, wide));
                }
            }
            const Moments<double> expected = moments<double>(image, 31);
            nook::ThreadExecutor threads{3};
            const Moments<double> parallel = moments<double>(image, 31, Border::symmetric, threads);
            const Moments<double> backwards =
                moments<double>(image, 31, Border::symmetric, Backwards{});
            for (const auto* other : {&parallel, &backwards}) {
                CHECK(same_bits(other->count, expected.count));
                CHECK(same_bits(other->variance, expected.variance));
                CHECK(same_bits(other->deviation, expected.deviation));
            }
        }
    });
}

TEST_CASE("case 21: a bias of 1e30 opens everything, 1e-30 next to nothing, a bad one is refused")
{
    for_both_distances([]<class Distance>(Distance) {
        for (const Size size : {tiny, large[0]})
            for (const int window : {3, 31})
                for (Call call : {fixed(window), variable(window)}) {
                    const Image<Distance> image = fine_relief<Distance>(size);
                    const Image<double> none = visibility<double>(image, call);
                    call.options.bias = 1e-30;
                    CHECK(difference(visibility<double>(image, call), none) <= variable_tolerance);
                    call.options.bias = 1e30;
                    const Image<float> all = visibility<float>(image, call);
                    CHECK(worst(size, [&](int x, int y) {
                              return ulps<float>(double{all(x, y)}, 1);
                          }) <= 1);
                    Image<double> ao{size.width, size.height, -1.0};
                    for (const double bad : {-1e-30, -1.0, -infinity<double>, infinity<double>,
                                             not_a_number<double>}) {
                        call.options.bias = bad;
                        const auto outcome = nook::chebyshev_ao(image.view(), ao.view(),
                                                                call.options, call.projection);
                        CHECK(outcome.error.code == nook::ErrorCode::bad_value);
                        CHECK(std::string{outcome.error.argument} == "options.bias");
                        CHECK(!nook::chebyshev_ao_reference(image.view(), ao.view(), call.options,
                                                            {}, call.projection));
                    }
                    CHECK(all_equal(ao, -1.0));
                }
    });
}
