#pragma once

/// Names the code this translation unit generates.
///
/// Every function of nook is a template or inline, so two translation units built with different
/// flags would each emit it under the same name and the linker would keep one at random: an AVX2
/// body could end up in a program that checks the CPU first. Functions therefore live in
/// `namespace nook::inline NOOK_TARGET`, whose name follows from the compiler's own macros.
/// Plain data types live in `namespace nook` itself and pass freely between such units; their
/// member functions are NOOK_INLINE, so that no out-of-line copy of them exists.
///
/// Define NOOK_TARGET yourself only to tell apart builds that these macros do not.
#if !defined(NOOK_TARGET)
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#define NOOK_TARGET_ISA avx512
#elif defined(__AVX2__)
#define NOOK_TARGET_ISA avx2
#elif defined(__AVX__)
#define NOOK_TARGET_ISA avx
#elif defined(__SSE4_1__)
#define NOOK_TARGET_ISA sse41
#elif defined(__x86_64__) || defined(_M_X64)
#define NOOK_TARGET_ISA x86_64
#elif defined(__ARM_NEON)
#define NOOK_TARGET_ISA neon
#else
#define NOOK_TARGET_ISA generic
#endif
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define NOOK_TARGET_FMA _fma
#else
#define NOOK_TARGET_FMA
#endif
#if defined(__FAST_MATH__) || defined(_M_FP_FAST)
#define NOOK_TARGET_MATH _fast
#elif defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#define NOOK_TARGET_MATH _finite
#else
#define NOOK_TARGET_MATH
#endif
#define NOOK_TARGET_JOIN2(isa, fma, math) target_##isa##fma##math
#define NOOK_TARGET_JOIN(isa, fma, math) NOOK_TARGET_JOIN2(isa, fma, math)
#define NOOK_TARGET NOOK_TARGET_JOIN(NOOK_TARGET_ISA, NOOK_TARGET_FMA, NOOK_TARGET_MATH)
#endif

/// For member functions of types that are shared between targets: inlined at every optimisation
/// level, so that no copy is left for the linker to choose from.
/// NOOK_NOINLINE is for functions whose rounding two callers must share: code that exists once cannot
/// be contracted in two ways.
/// NOOK_INLINE_LAMBDA goes between the parameters and the body of a lambda in an inner loop.
#if defined(__GNUC__) || defined(__clang__)
#define NOOK_INLINE [[gnu::always_inline]] inline
#define NOOK_INLINE_LAMBDA __attribute__((always_inline))
#define NOOK_NOINLINE [[gnu::noinline]]
#elif defined(_MSC_VER)
#define NOOK_INLINE __forceinline
#define NOOK_INLINE_LAMBDA
#define NOOK_NOINLINE __declspec(noinline)
#else
#define NOOK_INLINE inline
#define NOOK_INLINE_LAMBDA
#define NOOK_NOINLINE
#endif
