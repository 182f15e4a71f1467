#include "kernels.hpp"

namespace compare {

#if defined(NOOK_COMPARE_X86)

extern const Kernels kernels_sse2, kernels_avx2, kernels_avx512;

Targets targets() { return targets_of(kernels_sse2, kernels_avx2, kernels_avx512); }

#else

extern const Kernels kernels_own;

Targets targets() { return {{&kernels_own}, 1}; }

#endif

}  // namespace compare
