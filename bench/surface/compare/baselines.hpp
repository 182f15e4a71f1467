#pragma once

#if defined(__AVX512F__) || defined(__AVX2__)

#define NOOK_COMPARE_GATHERS

#include <immintrin.h>

#include <cmath>
#include <cstdint>

#include <nook/target.hpp>

#include "kernels.hpp"
#include "outlines/textbook_ao.hpp"

/// What a careful user would write without nook who wants each pixel to have a rotation of its own: the
/// loop of outlines::textbook_ao, with the pixels of a register side by side.
namespace compare::inline NOOK_TARGET {

#if defined(__AVX512F__)

struct Wide {
    static constexpr int lanes = 16;
    using Floats = __m512;
    using Integers = __m512i;
    using Mask = __mmask16;

    static Floats load(const float* from) { return _mm512_loadu_ps(from); }
    static Floats all(float value) { return _mm512_set1_ps(value); }
    static Integers all(int value) { return _mm512_set1_epi32(value); }
    static Mask first(int count) { return static_cast<Mask>((1u << count) - 1); }
    static Floats load(Mask mask, const float* from) { return _mm512_maskz_loadu_ps(mask, from); }
    static void store(float* to, Mask mask, Floats a) { _mm512_mask_storeu_ps(to, mask, a); }
    static Floats add(Floats a, Floats b) { return _mm512_add_ps(a, b); }
    static Floats minus(Floats a, Floats b) { return _mm512_sub_ps(a, b); }
    static Floats times(Floats a, Floats b) { return _mm512_mul_ps(a, b); }
    static Floats over(Floats a, Floats b) { return _mm512_div_ps(a, b); }
    static Floats fused(Floats a, Floats b, Floats c) { return _mm512_fmadd_ps(a, b, c); }
    static Floats larger(Floats a, Floats b) { return _mm512_maskz_max_ps(0xffff, a, b); }
    static Floats smaller(Floats a, Floats b) { return _mm512_maskz_min_ps(0xffff, a, b); }
    static Mask less(Floats a, Floats b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
    static Mask at_least(Floats a, Floats b) { return _mm512_cmp_ps_mask(a, b, _CMP_GE_OQ); }
    static Mask both(Mask a, Mask b) { return static_cast<Mask>(a & b); }
    static bool any(Mask mask) { return mask != 0; }
    static Floats where(Mask mask, Floats yes, Floats no)
    {
        return _mm512_mask_blend_ps(mask, no, yes);
    }
    static Integers truncated(Floats a) { return _mm512_maskz_cvttps_epi32(0xffff, a); }
    static Floats floats(Integers a) { return _mm512_maskz_cvtepi32_ps(0xffff, a); }
    static Integers index(Integers row, Integers stride, Integers column)
    {
        return _mm512_add_epi32(_mm512_mullo_epi32(row, stride), column);
    }
    static Floats gather(Mask mask, const float* from, Integers at)
    {
        return _mm512_mask_i32gather_ps(_mm512_setzero_ps(), mask, at, from, 4);
    }
};

#else

struct Wide {
    static constexpr int lanes = 8;
    using Floats = __m256;
    using Integers = __m256i;
    using Mask = __m256;

    static Floats load(const float* from) { return _mm256_loadu_ps(from); }
    static Floats all(float value) { return _mm256_set1_ps(value); }
    static Integers all(int value) { return _mm256_set1_epi32(value); }
    static Mask first(int count)
    {
        const Integers lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        return _mm256_castsi256_ps(_mm256_cmpgt_epi32(all(count), lane));
    }
    static Floats load(Mask mask, const float* from)
    {
        return _mm256_maskload_ps(from, _mm256_castps_si256(mask));
    }
    static void store(float* to, Mask mask, Floats a)
    {
        _mm256_maskstore_ps(to, _mm256_castps_si256(mask), a);
    }
    static Floats add(Floats a, Floats b) { return _mm256_add_ps(a, b); }
    static Floats minus(Floats a, Floats b) { return _mm256_sub_ps(a, b); }
    static Floats times(Floats a, Floats b) { return _mm256_mul_ps(a, b); }
    static Floats over(Floats a, Floats b) { return _mm256_div_ps(a, b); }
    static Floats fused(Floats a, Floats b, Floats c) { return _mm256_fmadd_ps(a, b, c); }
    static Floats larger(Floats a, Floats b) { return _mm256_max_ps(a, b); }
    static Floats smaller(Floats a, Floats b) { return _mm256_min_ps(a, b); }
    static Mask less(Floats a, Floats b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
    static Mask at_least(Floats a, Floats b) { return _mm256_cmp_ps(a, b, _CMP_GE_OQ); }
    static Mask both(Mask a, Mask b) { return _mm256_and_ps(a, b); }
    static bool any(Mask mask) { return _mm256_movemask_ps(mask) != 0; }
    static Floats where(Mask mask, Floats yes, Floats no)
    {
        return _mm256_blendv_ps(no, yes, mask);
    }
    static Integers truncated(Floats a) { return _mm256_cvttps_epi32(a); }
    static Floats floats(Integers a) { return _mm256_cvtepi32_ps(a); }
    static Integers index(Integers row, Integers stride, Integers column)
    {
        return _mm256_add_epi32(_mm256_mullo_epi32(row, stride), column);
    }
    static Floats gather(Mask mask, const float* from, Integers at)
    {
        return _mm256_mask_i32gather_ps(_mm256_setzero_ps(), from, at, mask, 4);
    }
};

#endif

inline void gather_ao(const Job& job, const nook::AlchemyOptions& options)
{
    using W = Wide;
    using Floats = W::Floats;
    using Mask = W::Mask;
    constexpr int lanes = W::lanes;

    outlines::RotationTable table;
    outlines::fill_table(table, options);
    const outlines::TextbookNumbers n = outlines::textbook_numbers(options, job.projection);
    const Depth& depth = job.depth;
    const int width = depth.width, height = depth.height;
    const Floats zero = W::all(0.0f), one = W::all(1.0f), farthest = W::all(outlines::textbook_far);
    const Floats half = W::all(0.5f);
    const Floats right_end = W::all(static_cast<float>(width));
    const Floats bottom_end = W::all(static_cast<float>(height));
    const W::Integers stride = W::all(static_cast<int>(depth.row_stride));
    const Floats per_x = W::all(n.per_x), per_y = W::all(n.per_y);
    const Floats cx = W::all(n.cx), cy = W::all(n.cy), epsilon = W::all(n.epsilon);
    float lane[lanes];
    for (int i = 0; i < lanes; ++i) lane[i] = static_cast<float>(i) + 0.5f;

    for (int y = 0; y < height; ++y) {
        // The places of a row of pixels repeat every four.
        float right[outlines::RotationTable::most_samples][lanes];
        float down[outlines::RotationTable::most_samples][lanes];
        for (int i = 0; i < options.samples; ++i)
            for (int x = 0; x < lanes; ++x) {
                const int rotation = outlines::rotation_of(x, y, options.pattern);
                right[i][x] = table.right[rotation][i];
                down[i][x] = table.down[rotation][i];
            }
        const Floats middle_y = W::all(static_cast<float>(y) + 0.5f);
        for (int x = 0; x < width; x += lanes) {
            const Mask inside = W::first(width - x < lanes ? width - x : lanes);
            const Floats distance = W::load(inside, &depth(x, y));
            const Floats slope =
                W::smaller(W::over(W::all(n.radius), distance), W::all(n.largest_slope));
            const Mask surface =
                W::both(W::both(W::less(zero, distance), W::less(distance, farthest)),
                        W::at_least(slope, W::all(n.least_slope)));
            float* const out = &job.visibility(x, y);
            if (!W::any(surface)) {
                W::store(out, inside, one);
                continue;
            }
            const Floats middle_x = W::add(W::load(lane), W::all(static_cast<float>(x)));
            const Floats px = W::times(W::times(W::minus(middle_x, cx), per_x), distance);
            const Floats py = W::times(W::times(W::minus(cy, middle_y), per_y), distance);
            const Floats nx = W::load(inside, &job.normals.x(x, y));
            const Floats ny = W::load(inside, &job.normals.y(x, y));
            const Floats nz = W::load(inside, &job.normals.z(x, y));
            const Floats reach_x = W::times(slope, W::all(n.fx));
            const Floats reach_y = W::times(slope, W::all(n.fy));
            const Floats bias = W::times(W::all(n.bias), distance);
            Floats sum = zero;
            for (int i = 0; i < options.samples; ++i) {
                const Floats to_x = W::fused(W::load(right[i]), reach_x, middle_x);
                const Floats to_y = W::fused(W::load(down[i]), reach_y, middle_y);
                const Mask hit =
                    W::both(W::both(W::both(W::at_least(to_x, zero), W::less(to_x, right_end)),
                                    W::both(W::at_least(to_y, zero), W::less(to_y, bottom_end))),
                            surface);
                const W::Integers at_x = W::truncated(to_x), at_y = W::truncated(to_y);
                const Floats there = W::gather(hit, depth.data, W::index(at_y, stride, at_x));
                const Mask counts = W::both(W::less(zero, there), W::less(there, farthest));
                const Floats rx = W::times(W::minus(W::add(W::floats(at_x), half), cx), per_x);
                const Floats ry = W::times(W::minus(W::minus(cy, W::floats(at_y)), half), per_y);
                const Floats vx = W::minus(W::times(rx, there), px);
                const Floats vy = W::minus(W::times(ry, there), py);
                const Floats vz = W::minus(distance, there);
                const Floats above =
                    W::minus(W::fused(vx, nx, W::fused(vy, ny, W::times(vz, nz))), bias);
                const Floats square = W::fused(vx, vx, W::fused(vy, vy, W::fused(vz, vz, epsilon)));
                const Floats term = W::over(W::larger(above, zero), square);
                sum = W::add(sum, W::where(counts, term, zero));
            }
            const Floats open = W::larger(W::minus(one, W::times(W::all(n.scale), sum)), zero);
            W::store(out, inside, W::where(surface, open, one));
        }
    }
}

}  // namespace compare::inline NOOK_TARGET

#endif
