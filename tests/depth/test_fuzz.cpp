#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/moments.hpp>

#include "pictures.hpp"

/// Any bit pattern as depth, in views of any shape, under any options. Seeds are fixed: a failure
/// names its round and repeats.
namespace {

using namespace pictures;
using nook::ChebyshevOptions;
using nook::Projection;

template <class T>
T from_bits(std::uint64_t bits)
{
    if constexpr (sizeof(T) == 8) return std::bit_cast<T>(bits);
    else if constexpr (sizeof(T) == 4) return std::bit_cast<T>(static_cast<std::uint32_t>(bits));
    else return std::bit_cast<T>(static_cast<std::uint8_t>(bits));
}

/// An image in a larger block of elements: rows or columns first, either way up and round, with gaps.
/// The gaps hold random bits.
template <class T>
class Canvas {
public:
    Canvas(Random& random, Size size)
    {
        const bool columns_first = random.chance(0.25);
        std::ptrdiff_t inner = 1 + random.below(3);
        std::ptrdiff_t outer =
            inner * (columns_first ? size.height : size.width) + 1 + random.below(9);
        if (random.chance(0.5)) {  // the plain case
            inner = 1;
            outer = columns_first ? size.height : size.width;
        }
        if (random.chance(0.3)) inner = -inner;
        if (random.chance(0.3)) outer = -outer;
        const std::ptrdiff_t pixel = columns_first ? outer : inner;
        const std::ptrdiff_t row = columns_first ? inner : outer;
        const std::ptrdiff_t across = pixel * std::max(size.width - 1, 0);
        const std::ptrdiff_t down = row * std::max(size.height - 1, 0);
        const std::ptrdiff_t before =
            guard - std::min<std::ptrdiff_t>(across, 0) - std::min<std::ptrdiff_t>(down, 0);
        const std::ptrdiff_t after =
            guard + std::max<std::ptrdiff_t>(across, 0) + std::max<std::ptrdiff_t>(down, 0);
        elements_.resize(static_cast<std::size_t>(before + 1 + after));
        for (T& element : elements_) element = from_bits<T>(random.bits());
        view = {elements_.data() + before, size.width, size.height, row, pixel};
        remember();
    }
    void remember() { remembered_ = elements_; }
    [[nodiscard]] bool unchanged() const
    {
        return std::memcmp(elements_.data(), remembered_.data(), elements_.size() * sizeof(T)) == 0;
    }
    /// Whether nothing but the pixels of the view has changed.
    [[nodiscard]] bool unchanged_outside() const
    {
        std::vector<T> expected = remembered_;
        for (int y = 0; y < view.height; ++y)
            for (int x = 0; x < view.width; ++x)
                expected[static_cast<std::size_t>(&view(x, y) - elements_.data())] = view(x, y);
        return std::memcmp(elements_.data(), expected.data(), elements_.size() * sizeof(T)) == 0;
    }

    nook::ImageView<T> view;

private:
    static constexpr std::ptrdiff_t guard = 16;
    std::vector<T> elements_, remembered_;
};

/// Ways to fill a depth buffer.
enum class Style { any_bits, any_size, bad_samples, ordinary };

template <class Distance>
Distance depth_value(Random& random, Style style)
{
    constexpr std::array bad{infinity<Distance>,
                             -infinity<Distance>,
                             not_a_number<Distance>,
                             -not_a_number<Distance>,
                             Distance{0},
                             -Distance{0},
                             Distance{-1},
                             std::numeric_limits<Distance>::lowest(),
                             std::numeric_limits<Distance>::max(),
                             std::numeric_limits<Distance>::min(),
                             std::numeric_limits<Distance>::denorm_min(),
                             Distance(1e30f),
                             Distance(3e38f)};
    switch (style) {
    case Style::any_bits: return from_bits<Distance>(random.bits());
    case Style::any_size: {
        // In double, differences whose squares do not leave its range.
        const auto value = from_bits<Distance>(random.bits());
        return sizeof(Distance) == 8 && std::fabs(double{value}) < 1e-90 ? Distance{0} : value;
    }
    case Style::bad_samples:
        if (random.chance(0.1))
            return bad[static_cast<std::size_t>(random.below(static_cast<int>(bad.size())))];
        return static_cast<Distance>(1 + 1e-4 * random.uniform());
    case Style::ordinary: return static_cast<Distance>(20 + 3 * random.uniform());
    }
    return 0;
}
constexpr Style style_of(int round) { return static_cast<Style>(round % 4); }

/// Squares of tiny differences leave the range of double: no two forms need agree there.
template <class Distance>
bool comparable(Style style)
{
    return sizeof(Distance) == 4 || style == Style::any_size || style == Style::ordinary;
}

double power(Random& random, int lowest, int highest)
{
    return std::ldexp(1 + random.uniform(), lowest + random.below(highest - lowest));
}

Call any_call(Random& random)
{
    Call call;
    ChebyshevOptions& options = call.options;
    options.window = random.chance(0.05) ? 32767 : 1 + 2 * random.below(45);
    options.max_window = random.chance(0.05) ? 4095 : 1 + 2 * random.below(45);
    if (random.chance(0.5)) options.radius = power(random, -20, 20);
    if (random.chance(0.1)) options.radius = power(random, -1000, 1000);
    if (random.chance(0.4)) options.bias = 0;
    if (random.chance(0.3)) options.bias = power(random, -100, 20);
    if (random.chance(0.05)) options.bias = power(random, -1000, 990);
    if (random.chance(0.3)) options.range = power(random, -30, 30);
    if (random.chance(0.05)) options.range = power(random, -1000, 1000);
    options.clamp = random.chance(0.7);
    options.border = random.chance(0.5) ? Border::clip : Border::symmetric;
    call.projection = {.fx = power(random, -5, 10),
                       .fy = power(random, -5, 10),
                       .cx = 20 * random.uniform(),
                       .cy = -5,
                       .orthographic = random.chance(0.2)};
    return call;
}

Size any_size(Random& random)
{
    const int largest = random.chance(0.2) ? 5 : 71;
    return {random.below(largest), random.below(largest)};
}

/// Runs one call on random images and checks everything that holds for all of them.
template <class Distance, class Value>
void fuzz_visibility(Random& random, Style style)
{
    const Size size = any_size(random);
    const Call call = any_call(random);
    const bool fixed_window = call.options.radius == 0;
    CAPTURE(size.width);
    CAPTURE(size.height);
    CAPTURE(call.options.window);
    CAPTURE(call.options.radius);
    CAPTURE(call.options.max_window);
    CAPTURE(int(style));

    Canvas<Distance> depth{random, size};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            depth.view(x, y) = depth_value<Distance>(random, style);
    depth.remember();
    Canvas<Value> ao{random, size}, slow{random, size};
    const bool mapped = random.chance(0.3);
    Canvas<std::uint8_t> groups{random, {nook::WorkMap::groups(size.width), size.height}};
    for (int y = 0; y < groups.view.height; ++y)
        for (int x = 0; x < groups.view.width; ++x)
            groups.view(x, y) = static_cast<std::uint8_t>(random.below(2) * random.below(256));
    groups.remember();
    const nook::WorkMap map = mapped ? nook::WorkMap{groups.view} : nook::WorkMap{};

    // Scratch at any address, with a guard on both sides.
    const std::size_t need =
        nook::chebyshev_ao_scratch_size(depth.view, call.options, call.projection);
    const auto offset = static_cast<std::size_t>(random.below(130));
    std::vector<std::uint8_t> block(offset + need + 64);
    for (std::size_t i = 0; i < block.size(); ++i)
        block[i] = static_cast<std::uint8_t>(i * 7 + offset);
    const auto outcome = nook::chebyshev_ao(depth.view, ao.view, call.options, call.projection, map,
                                            nook::Scratch{block.data() + offset, need});
    REQUIRE(outcome);
    const auto slow_outcome =
        nook::chebyshev_ao_reference(depth.view, slow.view, call.options, {}, call.projection, map);
    REQUIRE(slow_outcome);
    bool guarded = true;
    for (std::size_t i = 0; i < block.size(); ++i)
        if (i < offset || i >= offset + need)
            guarded = guarded && block[i] == static_cast<std::uint8_t>(i * 7 + offset);
    CHECK(guarded);
    CHECK(depth.unchanged());
    CHECK(groups.unchanged());
    CHECK(ao.unchanged_outside());
    CHECK(slow.unchanged_outside());

    CHECK(outcome.work.pixels == std::uint64_t(size.width) * std::uint64_t(size.height));
    CHECK(outcome.work.background == slow_outcome.work.background);
    // The reference proves nothing open by itself.
    CHECK(outcome.work.skipped >= slow_outcome.work.skipped);
    CHECK(outcome.work.skipped + outcome.work.background <= outcome.work.pixels);
    CHECK(worst(size, [&](int x, int y) {
              const Value value = ao.view(x, y);
              const bool open = !is_surface(depth.view(x, y)) || !map.is_active(x, y);
              return open ? !same_bits(value, Value{1}) : !(value >= 0 && value <= 1);
          }) == 0);
    if (!comparable<Distance>(style)) return;
    const double tolerance = !fixed_window        ? variable_tolerance
                             : sizeof(Value) == 4 ? 0x1p-23
                                                  : 1e-10;
    CHECK(worst(size, [&](int x, int y) {
              return std::fabs(static_cast<double>(ao.view(x, y)) -
                               static_cast<double>(slow.view(x, y)));
          }) <= tolerance);
}

/// The same for the moments of a fixed window.
template <class Distance, class Value>
void fuzz_moments(Random& random, Style style)
{
    const Size size = any_size(random);
    const nook::MomentsOptions options{random.chance(0.05) ? 32767 : 1 + 2 * random.below(40),
                                       random.chance(0.5) ? Border::clip : Border::symmetric};
    CAPTURE(size.width);
    CAPTURE(size.height);
    CAPTURE(options.window);
    CAPTURE(int(style));
    Canvas<Distance> depth{random, size};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            depth.view(x, y) = depth_value<Distance>(random, style);
    depth.remember();
    struct Outputs {
        Canvas<std::int32_t> count;
        Canvas<Value> variance, deviation, mean, mean_square;

        Outputs(Random& seed, Size extent)
            : count{seed, extent},
              variance{seed, extent},
              deviation{seed, extent},
              mean{seed, extent},
              mean_square{seed, extent}
        {}
        [[nodiscard]] nook::BoxMoments<Value> views() const
        {
            return {count.view, variance.view, deviation.view, mean.view, mean_square.view};
        }
        [[nodiscard]] bool unchanged_outside() const
        {
            return count.unchanged_outside() && variance.unchanged_outside() &&
                   deviation.unchanged_outside() && mean.unchanged_outside() &&
                   mean_square.unchanged_outside();
        }
    };
    const Outputs found{random, size}, slow{random, size};
    // Some of the outputs are not asked for, and must not be written.
    nook::BoxMoments<Value> asked = found.views();
    const bool without_mean = random.chance(0.3), without_count = random.chance(0.3);
    if (without_mean) asked.mean = asked.mean_square = {};
    if (without_count) asked.count = {};
    const auto outcome = nook::box_moments(depth.view, asked, options);
    REQUIRE(outcome);
    REQUIRE(nook::box_moments_reference(depth.view, slow.views(), options));
    CHECK(depth.unchanged());
    CHECK(found.unchanged_outside());
    if (without_mean) CHECK(found.mean.unchanged());
    if (without_mean) CHECK(found.mean_square.unchanged());
    if (without_count) CHECK(found.count.unchanged());
    const double k = std::min(options.window, 2 * std::max(size.width, size.height) + 1);
    // A pivot of the window loses at most a factor k per pass.
    const double error = (2 * k + 6) * k * 0x1p-53 + double{std::numeric_limits<Value>::epsilon()};
    CHECK(worst(size, [&](int x, int y) {
              const auto variance = static_cast<double>(found.variance.view(x, y));
              const auto deviation = static_cast<double>(found.deviation.view(x, y));
              if (!(variance >= 0) || std::isnan(deviation)) return 1.0;
              if (!without_count && found.count.view(x, y) != slow.count.view(x, y)) return 2.0;
              if (!is_surface(depth.view(x, y))) return variance == 0 && deviation == 0 ? 0.0 : 3.0;
              const auto expected = static_cast<double>(slow.variance.view(x, y));
              const double sigma = std::sqrt(expected);
              if (!comparable<Distance>(style) || !std::isfinite(expected)) return 0.0;
              // What float cannot hold any more is rounded to its smallest number.
              const auto least = static_cast<double>(std::numeric_limits<Value>::denorm_min()) * 2;
              if (std::fabs(variance - expected) > error * expected + least) return 4.0;
              const auto expected_deviation = static_cast<double>(slow.deviation.view(x, y));
              const double reach = std::max(sigma, std::fabs(expected_deviation));
              if (std::fabs(deviation - expected_deviation) > error * reach + least) return 5.0;
              return 0.0;
          }) == 0);
}

}  // namespace

TEST_CASE("any bit pattern, view, option and work map: visibility in [0, 1], background exactly 1")
{
    for (int round = 0; round < 1500; ++round) {
        CAPTURE(round);
        Random random{std::uint64_t(round) + 1};
        const Style style = style_of(round / 4);
        switch (round % 4) {
        case 0: fuzz_visibility<float, float>(random, style); break;
        case 1: fuzz_visibility<double, double>(random, style); break;
        case 2: fuzz_visibility<float, double>(random, style); break;
        case 3: fuzz_visibility<double, float>(random, style); break;
        }
    }
}

TEST_CASE(
    "any bit pattern and view: moments without NaN, no negative variance, all samples counted")
{
    for (int round = 0; round < 1000; ++round) {
        CAPTURE(round);
        Random random{std::uint64_t(round) + 100'001};
        const Style style = style_of(round / 4);
        switch (round % 4) {
        case 0: fuzz_moments<float, float>(random, style); break;
        case 1: fuzz_moments<double, double>(random, style); break;
        case 2: fuzz_moments<float, double>(random, style); break;
        case 3: fuzz_moments<double, float>(random, style); break;
        }
    }
}

TEST_CASE("any bit pattern as option: both forms take it or refuse it alike, and write accordingly")
{
    int refused = 0, taken = 0;
    for (int round = 0; round < 2000; ++round) {
        CAPTURE(round);
        Random random{std::uint64_t(round) + 200'001};
        const Size size{1 + random.below(12), 1 + random.below(12)};
        const Image<float> depth =
            make<float>(size, [&](int, int) { return 1 + random.uniform(); });
        Call call = any_call(random);
        const auto any = [&] { return from_bits<double>(random.bits()); };
        switch (random.below(9)) {
        case 0: call.options.bias = any(); break;
        case 1: call.options.range = any(); break;
        case 2: call.options.radius = any(); break;
        case 3: call.options.window = static_cast<int>(random.bits() >> random.below(64)); break;
        case 4:
            call.options.max_window = static_cast<int>(random.bits() >> random.below(64));
            break;
        case 5: call.projection.fx = any(); break;
        case 6: call.projection.fy = any(); break;
        case 7: call.projection.cx = any(); break;
        case 8: call.projection.cy = any(); break;
        }
        Image<float> ao{size.width, size.height, -1.f}, slow = ao;
        const auto outcome =
            nook::chebyshev_ao(depth.view(), ao.view(), call.options, call.projection);
        const auto slow_outcome = nook::chebyshev_ao_reference(depth.view(), slow.view(),
                                                               call.options, {}, call.projection);
        REQUIRE(outcome.error.code == slow_outcome.error.code);
        REQUIRE(std::string{outcome.error.argument} == slow_outcome.error.argument);
        const std::size_t need =
            nook::chebyshev_ao_scratch_size(depth.view(), call.options, call.projection);
        if (!outcome) {
            ++refused;
            REQUIRE(outcome.error.code == nook::ErrorCode::bad_value);
            REQUIRE(all_equal(ao, -1.f));
            REQUIRE(need == 0);
            continue;
        }
        ++taken;
        REQUIRE(worst(size, [&](int x, int y) { return !(ao(x, y) >= 0 && ao(x, y) <= 1); }) == 0);
        REQUIRE(difference(ao, slow) <= variable_tolerance);
    }
    CHECK(refused > 500);
    CHECK(taken > 500);
}
