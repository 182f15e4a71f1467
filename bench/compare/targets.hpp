#pragma once

namespace compare {

/// The tables of kernels that a program was built with, best last; only those that this CPU can run.
template <class Kernels>
struct TargetsOf {
    static constexpr int most = 3;
    const Kernels* kernels[most] = {};
    int count = 0;

    [[nodiscard]] const Kernels& best() const { return *kernels[count - 1]; }
};

#if defined(NOOK_COMPARE_X86)

template <class Kernels>
[[nodiscard]] TargetsOf<Kernels> targets_of(const Kernels& sse2, const Kernels& avx2,
                                            const Kernels& avx512)
{
    TargetsOf<Kernels> result;
    result.kernels[result.count++] = &sse2;
    __builtin_cpu_init();
    const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                          __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    if (has_avx2) result.kernels[result.count++] = &avx2;
    if (has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        result.kernels[result.count++] = &avx512;
    return result;
}

#endif

}  // namespace compare
