// Units of one program, built for several targets, agree pixel by pixel, and each runs its own code.
#include "unit.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

namespace {

constexpr int width = 61, height = 43;
bool failed = false;

void check(bool fact, const char* unit, const char* text)
{
    if (fact) return;
    failed = true;
    std::printf("%s: not true that %s\n", unit, text);
}

struct Pictures {
    std::vector<float> depth, normal, fixed, radius, traced;

    Pictures()
        : depth(width * height),
          normal(3 * width * height),
          fixed(depth),
          radius(depth),
          traced(depth)
    {}
    GBuffer drawn() { return {{depth.data(), width, height}, {normal.data(), 3 * width, height}}; }
};

/// How two images differ.
struct Difference {
    int pixels = 0;
    double worst = 0;

    Difference(const std::vector<float>& a, const std::vector<float>& b, bool relative = false)
    {
        for (std::size_t i = 0; i < a.size(); ++i) {
            if (a[i] == b[i]) continue;
            const double scale = relative ? std::fabs(double{a[i]}) : 1;
            worst = std::fmax(worst, std::fabs(double{a[i]} - double{b[i]}) / scale);
            ++pixels;
        }
    }
};

/// All units shade what the first one drew, so that they differ by their own arithmetic alone.
Answers run(const char* name, void (*draw)(const GBuffer&, nook::Outcome*),
            void (*shade)(const GBuffer&, Answers*), Pictures& pictures, Pictures* first)
{
    nook::Outcome drawn;
    draw(pictures.drawn(), &drawn);
    check(bool{drawn}, name, "drawing succeeds");
    Answers answers;
    answers.fixed = {pictures.fixed.data(), width, height};
    answers.radius = {pictures.radius.data(), width, height};
    answers.traced = {pictures.traced.data(), width, height};
    shade((first != nullptr ? *first : pictures).drawn(), &answers);
    std::printf("%s: %s\n", name, answers.target);
    check(bool{answers.outcome}, name, "every call succeeds");
    if (!answers.outcome) std::printf("%s\n", answers.outcome.error.argument);
    check(answers.background_is_open, name,
          "NaN, infinity, zero and negative depths are background");
    check(answers.nan_is_named, name, "a NaN in an error is printed as one");
    check(answers.rmse < 1e-6, name, "the fast form agrees with the reference");
    check(answers.ssim > 0.999999, name, "the fast form looks like the reference");
    for (const auto* image : {&pictures.fixed, &pictures.radius, &pictures.traced}) {
        int dark = 0;
        for (const float value : *image) dark += value < 0.95f;
        check(dark > 100 && dark < width * height, name, "the scene is partly shaded");
    }
    for (const float bits : answers.information)
        check(bits > 0.01f && bits < 4, name, "the viewpoints tell triangles apart");
    return answers;
}

void compare_information(const char* name, const Answers& plain, const Answers& other)
{
    for (int i = 0; i < 5; ++i)
        check(std::fabs(plain.information[i] - other.information[i]) < 1e-6f, name,
              "information is that of the plain unit");
}

void compare(const char* name, const Pictures& plain, const Pictures& other)
{
    const Difference depth{plain.depth, other.depth, true}, normal{plain.normal, other.normal},
        fixed{plain.fixed, other.fixed}, radius{plain.radius, other.radius},
        traced{plain.traced, other.traced};
    const auto print = [&](const char* what, const Difference& d) {
        std::printf("  %-26s %5d of %d values differ, by %.2g at most\n", what, d.pixels,
                    width * height, d.worst);
    };
    print("depth (relative)", depth);
    print("normals", normal);
    print("Chebyshev AO, fixed window", fixed);
    print("Chebyshev AO, radius", radius);
    print("traced AO", traced);
    // Double precision within, so that little more than the last bit of a float can differ.
    check(depth.worst <= 0x1p-23, name, "depth is that of the plain unit");
    check(normal.worst <= 0x1p-23, name, "normals are those of the plain unit");
    check(fixed.worst <= 0x1p-23, name, "a fixed window shades as in the plain unit");
    check(radius.worst <= 0x1p-23, name, "a radius shades as in the plain unit");
    check(traced.pixels <= width * height / 1000, name, "999 of 1000 traced pixels are equal");
    check(traced.worst <= 1.001 / directions, name, "traced pixels differ by one ray at most");
}

}  // namespace

int main()
{
    Pictures plain, fast;
    const Answers first = run("plain", draw_plain, shade_plain, plain, nullptr);
    const auto named_apart = [&](const char* name, const Answers& answers) {
        check(std::strcmp(first.target, answers.target) != 0, name,
              "the target has a name of its own");
    };
    const Answers second = run("fast", draw_fast, shade_fast, fast, &plain);
    named_apart("fast", second);
    compare_information("fast", first, second);
    compare("fast", plain, fast);
#if defined(HAS_AVX2)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        Pictures avx2;
        const Answers third = run("avx2", draw_avx2, shade_avx2, avx2, &plain);
        named_apart("avx2", third);
        compare_information("avx2", first, third);
        compare("avx2", plain, avx2);
    } else {
        std::printf("this processor has no AVX2: that unit did not run\n");
    }
#endif
    return failed ? 1 : 0;
}
