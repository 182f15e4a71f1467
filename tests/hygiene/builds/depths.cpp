// What the depth kernels promise, checked under whatever flags this is compiled with. It needs no
// exceptions and no RTTI, and tells NaN and infinity by their bits, which -ffast-math cannot fold
// away.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/moments.hpp>
#include <nook/owned_image.hpp>

namespace {

using nook::Image;

int failures = 0;

void check(bool fact, const char* text, double detail = 0)
{
    if (fact) return;
    ++failures;
    std::printf("not true that %s (%g)\n", text, detail);
}

class Random {
public:
    /// SplitMix64.
    std::uint64_t bits()
    {
        std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
        z = (z ^ z >> 27) * 0x94d049bb133111ebu;
        return z ^ z >> 31;
    }
    int below(int bound) { return static_cast<int>(bits() % static_cast<unsigned>(bound)); }

private:
    std::uint64_t state_ = 1;
};

/// Bits that no compiler can follow to their use.
template <class Float>
Float from_bits(std::uint64_t bits)
{
    volatile std::uint64_t hidden = bits;
    const std::uint64_t seen = hidden;
    if constexpr (sizeof(Float) == 8) return std::bit_cast<double>(seen);
    else return std::bit_cast<float>(static_cast<std::uint32_t>(seen));
}
template <class Float>
Float infinity()
{
    return from_bits<Float>(sizeof(Float) == 8 ? 0x7ff0000000000000u : 0x7f800000u);
}
template <class Float>
Float not_a_number()
{
    return from_bits<Float>(sizeof(Float) == 8 ? 0x7ff8000000000000u : 0x7fc00000u);
}

/// In [0, 1], judged by bits.
bool in_range(float value) { return std::bit_cast<std::uint32_t>(value) <= 0x3f800000u; }
bool in_range(double value) { return std::bit_cast<std::uint64_t>(value) <= 0x3ff0000000000000u; }
template <class Float>
bool same(Float a, Float b)
{
    return std::memcmp(&a, &b, sizeof(Float)) == 0;
}
template <class Float>
bool same(const Image<Float>& a, const Image<Float>& b)
{
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x)
            if (!same(a(x, y), b(x, y))) return false;
    return true;
}

struct Backwards {
    static int concurrency() { return 3; }
    template <class Function>
    void for_each(int count, Function&& function) const
    {
        for (int task = count - 1; task >= 0; --task) function(task, task % 3);
    }
};

struct Call {
    nook::ChebyshevOptions options{};
    nook::Projection projection{};
};
Call fixed(int window) { return {{.window = window, .bias = 0.0}, {}}; }
/// Windows of that size from the filter for windows that differ.
Call variable(int window)
{
    return {{.radius = 1e60, .max_window = window, .bias = 0.0}, {.fx = 1, .fy = 1}};
}

template <class Value = float, class Distance, class Executor = nook::Serial>
Image<Value> shade(const Image<Distance>& depth, const Call& call, Executor&& executor = {})
{
    Image<Value> ao{depth.width(), depth.height(), Value(-1)};
    const auto outcome = nook::chebyshev_ao(depth.view(), ao.view(), call.options, call.projection,
                                            {}, nook::HeapScratch{}, executor);
    check(bool{outcome}, "chebyshev_ao succeeds");
    return ao;
}
template <class Value = float, class Distance>
Image<Value> reference(const Image<Distance>& depth, const Call& call)
{
    Image<Value> ao{depth.width(), depth.height(), Value(-1)};
    const auto outcome =
        nook::chebyshev_ao_reference(depth.view(), ao.view(), call.options, {}, call.projection);
    check(bool{outcome}, "chebyshev_ao_reference succeeds");
    return ao;
}
template <class A, class B>
double difference(const Image<A>& a, const Image<B>& b)
{
    double worst = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x) {
            if (!in_range(a(x, y)) || !in_range(b(x, y))) return 2;
            const double d = static_cast<double>(a(x, y)) - static_cast<double>(b(x, y));
            worst = std::max(worst, d < 0 ? -d : d);
        }
    return worst;
}
template <class Float>
bool all_open(const Image<Float>& ao)
{
    for (const Float value : ao)
        if (!same(value, Float{1})) return false;
    return true;
}
/// The window of a pixel along one axis.
int first(int at, int radius, int size) { return at - std::min({radius, at, size - 1 - at}); }
bool holds(int at, int other, int radius, int size)
{
    const int from = first(at, radius, size);
    return other >= from && other <= 2 * at - from;
}

constexpr int width = 211, height = 67;

/// Relief of 2^-14 at distance 1000: all differences are whole multiples of that.
template <class Distance>
Image<Distance> relief()
{
    Random random;
    Image<Distance> image{width, height};
    for (Distance& value : image) value = Distance(1000 + 0x1p-14 * random.below(40));
    return image;
}

template <class Distance>
void constant_images_are_open()
{
    for (const double depth : {0.0, 1e-30, 0.1, 1.0, 1e5, 1e30})
        for (const int window : {3, 31, 301}) {
            const Image<Distance> image{width, height, Distance(depth)};
            check(all_open(shade(image, fixed(window))), "constant images are open", depth);
            check(all_open(shade(image, variable(window))), "constant images are open", depth);
            Call call = fixed(window);
            call.options.bias.reset();
            check(all_open(shade<double>(image, call)), "constant images are open", depth);
        }
}

template <class Distance>
void fractions_are_exact()
{
    for (const Call& call : {fixed(9), variable(9)}) {
        Image<Distance> image{width, height, Distance{1000}};
        image(100, 30) = Distance(1000 + 0x1p-14);
        Image<float> ao = shade(image, call);
        const double point = static_cast<double>(ao(100, 30)) * 81 - 1;
        check(point < 1e-4 && point > -1e-4, "a pixel an ulp farther gets 1/N", point);
        ao(100, 30) = 1;
        check(difference(ao, Image<float>{width, height, 1.f}) <= 1e-5, "others stay open");
        // A step.
        for (const double step : {1e-3, 1e6}) {
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) image(x, y) = Distance(x < 99 ? 1000 : 1000 + step);
            ao = shade(image, call);
            double worst = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const int r = std::min({4, x, width - 1 - x}), j = x - 99;
                    const double ramp = j < 0 ? 1 : std::min(1.0, (r + 1.0 + j) / (2 * r + 1));
                    const double error = static_cast<double>(ao(x, y)) - ramp;
                    worst = std::max(worst, error < 0 ? -error : error);
                }
            check(worst <= (call.options.radius > 0 ? 1e-5 : 0x1p-22), "steps have their ramp",
                  worst);
        }
    }
}

/// Whole numbers give the exact answer.
template <class Distance>
void relief_is_exact()
{
    const Image<Distance> image = relief<Distance>();
    for (const int window : {3, 21}) {
        const Image<float> ao = shade(image, fixed(window)),
                           differing = shade(image, variable(window));
        Image<float> variance{width, height};
        Image<std::int32_t> count{width, height};
        nook::BoxMoments<float> moments;
        moments.count = count;
        moments.variance = variance;
        check(bool{nook::box_moments(image.view(), moments, {window})}, "box_moments succeeds");
        double worst = 0, worst_variance = 0, worst_differing = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const int left = first(x, window / 2, width), top = first(y, window / 2, height);
                const auto whole = [&](int i, int j) {
                    const auto distance = static_cast<double>(image(i, j));
                    return static_cast<std::int64_t>((distance - 1000) * 0x1p14);
                };
                std::int64_t n = 0, sum = 0, squares = 0;
                for (int j = top; j <= 2 * y - top; ++j)
                    for (int i = left; i <= 2 * x - left; ++i) {
                        ++n;
                        sum += whole(i, j);
                        squares += whole(i, j) * whole(i, j);
                    }
                const auto spread = static_cast<double>(n * squares - sum * sum);
                const auto behind = static_cast<double>(n * whole(x, y) - sum);
                const double expected = behind > 0 ? spread / (spread + behind * behind) : 1;
                const auto relative = [](double value, double exact) {
                    if (!(exact > 0)) return value;
                    return value > exact ? value / exact - 1 : 1 - value / exact;
                };
                worst = std::max(worst, relative(static_cast<double>(ao(x, y)), expected));
                worst_differing = std::max(
                    worst_differing, relative(static_cast<double>(differing(x, y)), expected));
                const double scale = static_cast<double>(n * n) * 0x1p28;
                worst_variance = std::max(
                    worst_variance, relative(static_cast<double>(variance(x, y)), spread / scale));
                if (count(x, y) != n) check(false, "all samples are counted", double(n));
            }
        check(worst <= 8 * 0x1p-23, "visibility is exact to 8 ulps", worst * 0x1p23);
        check(worst_variance <= 8 * 0x1p-23, "the variance is exact to 8 ulps",
              worst_variance * 0x1p23);
        check(worst_differing <= 1e-5, "windows that differ are exact to 1e-5", worst_differing);
    }
}

template <class Distance>
void bad_samples_are_contained()
{
    const Image<Distance> clean = relief<Distance>();
    for (const int window : {3, 15, 45})
        for (int round = 0; round < 12; ++round) {
            const Distance bad[] = {not_a_number<Distance>(), infinity<Distance>(),
                                    -infinity<Distance>(), Distance(1e30f), Distance{-1}};
            const int bad_x =
                std::array{0, width - 1, window, 64, 127, 100}[std::size_t(round) % 6];
            const int bad_y =
                std::array{height - 1, 33, window % height, 0}[std::size_t(round) % 4];
            Image<Distance> image = clean;
            image(bad_x, bad_y) = bad[round % 5];
            const Image<double> before = shade<double>(clean, fixed(window)),
                                after = shade<double>(image, fixed(window));
            const Image<float> differing = shade(image, variable(window)),
                               untouched = shade(clean, variable(window));
            bool kept = true, valid = true, close = true;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    valid = valid && in_range(after(x, y)) && in_range(differing(x, y));
                    if (holds(x, bad_x, window / 2, width) && holds(y, bad_y, window / 2, height))
                        continue;
                    kept = kept && same(before(x, y), after(x, y));
                    const float change = differing(x, y) - untouched(x, y);
                    close = close && change < 1e-5f && change > -1e-5f;
                }
            check(kept, "a bad sample changes nothing outside its windows", window);
            check(close, "nor much where windows differ", window);
            check(valid, "a bad sample leaves visibility in [0, 1]", window);
        }
}

template <class Distance>
void background_is_open()
{
    const Distance nothing[] = {not_a_number<Distance>(),
                                -not_a_number<Distance>(),
                                infinity<Distance>(),
                                -infinity<Distance>(),
                                Distance{0},
                                Distance{-3}};
    Image<Distance> image = relief<Distance>();
    for (int i = 0; i < width * height; i += 5)
        image(i % width, i / width) = nothing[std::size_t(i / 5) % 6];
    for (const Call& call : {fixed(7), variable(7)}) {
        Image<double> ao{width, height};
        const auto outcome =
            nook::chebyshev_ao(image.view(), ao.view(), call.options, call.projection);
        check(outcome.work.background == (width * height + 4) / 5, "background is counted",
              static_cast<double>(outcome.work.background));
        bool open = true;
        for (int i = 0; i < width * height; i += 5)
            open = open && same(ao(i % width, i / width), 1.0);
        check(open, "background is exactly 1");
        check(difference(ao, reference<double>(image, call)) <= 1e-5,
              "windows with background agree with the reference");
    }
    for (const Distance value : nothing)
        for (const Call& call : {fixed(7), variable(7)}) {
            const Image<Distance> empty{width, height, value};
            check(all_open(shade(empty, call)), "images of background are open");
            // A limit that leaves the bits alone to tell what is no distance.
            const nook::DepthSource unlimited{
                empty.view(), nook::IdentityDecode{}, {0, 0x1p-23, 0}, infinity<Distance>()};
            Image<float> ao{width, height};
            const auto outcome =
                nook::chebyshev_ao(unlimited, ao.view(), call.options, call.projection);
            check(outcome.work.background == width * height && all_open(ao),
                  "images of background are open under any limit");
        }
}

template <class Distance>
void powers_of_two_and_tasks_change_no_bit()
{
    Image<Distance> image = relief<Distance>();
    for (int i = 0; i < width * height; i += 41) image(i % width, i / width) = Distance{0};
    for (Call call : {fixed(3), fixed(31), variable(9)}) {
        const Image<double> expected = shade<double>(image, call);
        check(same(shade<double>(image, call, Backwards{}), expected),
              "the order of tasks changes no bit");
        for (const double scale : {0x1p-60, 0x1p70}) {
            Image<Distance> scaled = image;
            for (Distance& value : scaled) value = Distance(static_cast<double>(value) * scale);
            check(same(shade<double>(scaled, call), expected), "a power of two changes no bit",
                  scale);
        }
    }
}

template <class Distance>
void any_bits_give_visibility()
{
    Random random;
    for (int round = 0; round < 60; ++round) {
        Image<Distance> image{1 + random.below(70), 1 + random.below(40)};
        for (Distance& value : image) value = from_bits<Distance>(random.bits());
        Call call = round % 2 ? fixed(1 + 2 * random.below(20)) : variable(1 + 2 * random.below(9));
        if (round % 3 == 0) call.options.bias.reset();
        if (round % 5 == 0) call.options.range = 1e-3 * (1 + random.below(1'000'000));
        if (round % 7 == 0) call.options.border = nook::Border::clip;
        call.options.clamp = round % 4 != 0;
        bool valid = true;
        for (const float value : shade(image, call)) valid = valid && in_range(value);
        for (const double value : shade<double>(image, call)) valid = valid && in_range(value);
        check(valid, "any bits give a visibility in [0, 1]", round);
        if (sizeof(Distance) == 4)
            check(difference(shade(image, call), reference(image, call)) <= 1e-5,
                  "any bits give the visibility of the reference", round);
    }
}

void bad_options_are_refused()
{
    const Image<float> image{20, 10, 1.f};
    Image<float> ao{20, 10, -1.f};
    const auto refused = [&](const Call& call, const char* argument) {
        const auto outcome =
            nook::chebyshev_ao(image.view(), ao.view(), call.options, call.projection);
        check(!outcome && std::strcmp(outcome.error.argument, argument) == 0, argument);
    };
    for (const double bad : {not_a_number<double>(), infinity<double>(), -1.0}) {
        Call call = fixed(3);
        call.options.bias = bad;
        refused(call, "options.bias");
        call = fixed(3);
        call.options.range = bad;
        refused(call, "options.range");
        call = fixed(3);
        call.options.radius = bad;
        refused(call, "options.radius");
    }
    refused(fixed(4), "options.window");
    for (const float value : ao) check(same(value, -1.f), "nothing is written after an error");
}

template <class Distance>
void check_all()
{
    constant_images_are_open<Distance>();
    fractions_are_exact<Distance>();
    relief_is_exact<Distance>();
    bad_samples_are_contained<Distance>();
    background_is_open<Distance>();
    powers_of_two_and_tasks_change_no_bit<Distance>();
    any_bits_give_visibility<Distance>();
}

}  // namespace

int main()
{
    check_all<float>();
    check_all<double>();
    bad_options_are_refused();
    if (failures > 0) std::printf("%d checks failed\n", failures);
    return failures > 0;
}
