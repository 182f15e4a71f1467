// Three units of one program, built for three targets, agree, and each runs its own code.
#include "unit.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

namespace {

bool failed = false;

void check(bool fact, const char* unit, const char* text)
{
    if (fact) return;
    failed = true;
    std::printf("%s: not true that %s\n", unit, text);
}

Answers run(const char* name, void (*unit)(nook::ImageView<float>, Answers*))
{
    constexpr int width = 61, height = 43;
    std::vector<float> depth(width * height);
    Answers answers;
    unit({depth.data(), width, height}, &answers);
    std::printf("%-6s %-24s visibility %.4f, traced %.4f, rmse %.2g, ssim %.6f\n", name,
                answers.target, answers.visibility, answers.reference, answers.rmse, answers.ssim);
    check(bool{answers.outcome}, name, "every call succeeds");
    if (!answers.outcome) std::printf("%s\n", answers.outcome.error.argument);
    check(answers.visibility > 0.5 * width * height && answers.visibility < width * height, name,
          "the scene is partly shaded");
    check(answers.background_is_open, name,
          "NaN, infinity, zero and negative depths are background");
    check(answers.rmse < 1e-6, name, "the fast form agrees with the reference");
    check(answers.ssim > 0.999999, name, "the fast form looks like the reference");
    return answers;
}

void compare(const char* name, const Answers& plain, const Answers& other)
{
    check(std::strcmp(plain.target, other.target) != 0, name, "the target has a name of its own");
    check(std::fabs(plain.visibility - other.visibility) < 1e-3, name,
          "the visibility is that of the plain unit");
    check(std::fabs(plain.reference - other.reference) < 2, name,
          "the traced visibility is that of the plain unit");
}

}  // namespace

int main()
{
    const Answers plain = run("plain", unit_plain);
    compare("fast", plain, run("fast", unit_fast));
#if defined(HAS_AVX2)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        compare("avx2", plain, run("avx2", unit_avx2));
    else std::printf("this processor has no AVX2: that unit did not run\n");
#endif
    return failed ? 1 : 0;
}
