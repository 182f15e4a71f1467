#include "kernels.hpp"

namespace compare {

#if defined(NOOK_COMPARE_X86)

extern const Kernels kernels_sse2, kernels_avx2, kernels_avx512;

Targets targets()
{
    Targets result;
    result.kernels[result.count++] = &kernels_sse2;
    __builtin_cpu_init();
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                      __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    if (avx2) result.kernels[result.count++] = &kernels_avx2;
    if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        result.kernels[result.count++] = &kernels_avx512;
    return result;
}

#else

extern const Kernels kernels_own;

Targets targets() { return {{&kernels_own}, 1}; }

#endif

}  // namespace compare
