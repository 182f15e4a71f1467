#pragma once

#include <nook/target.hpp>

/// The formulas of Alchemy ambient obscurance: M. McGuire, B. Osman, M. Bukowski & P. Hennessy, "The
/// Alchemy Screen-Space Ambient Obscurance Algorithm", 2011, equation 10; and of its successor:
/// M. McGuire, M. Mara & D. Luebke, "Scalable Ambient Obscurance", 2012, section 2.3 and its reference
/// code. Templates over any ordered field.
///
/// v is the vector from the shaded point to what it samples, n its normal. Terms are in 1 / length.
namespace nook::inline NOOK_TARGET {

/// One term of the sum of 2011: max(0, v·n − bias) / (v·v + epsilon); 0 where v = 0. The bias is a
/// length, β times the distance of the point in the paper.
template <class Number>
[[nodiscard]] constexpr Number alchemy_term(const Number& along_normal, const Number& square,
                                            const Number& bias, const Number& epsilon)
{
    const Number height = along_normal - bias, bottom = square + epsilon;
    return height > Number(0) && bottom > Number(0) ? height / bottom : Number(0);
}

/// One term of the sum of 2012, already divided by r⁶: (1 − v·v / r²)³ max(0, v·n − bias) /
/// (v·v + epsilon), 0 beyond the radius. With the powers of r taken together nothing leaves the range
/// of float; r⁶ does for r > 2.6e6.
template <class Number>
[[nodiscard]] constexpr Number scalable_term(const Number& along_normal, const Number& square,
                                             const Number& bias, const Number& epsilon,
                                             const Number& square_radius)
{
    if (!(square < square_radius)) return Number(0);
    const Number left = Number(1) - square / square_radius;
    return left * left * left * alchemy_term(along_normal, square, bias, epsilon);
}

/// Visibility before the contrast: max(0, 1 − scale sum / samples), where `scale` is 2 σ for the sum of
/// 2011 and 5 σ for that of 2012, and σ the intensity, a length. 1 for no samples.
template <class Number>
[[nodiscard]] constexpr Number alchemy_visibility(const Number& sum, const Number& scale,
                                                  int samples)
{
    if (samples < 1) return Number(1);
    const Number open = Number(1) - scale * sum / Number(samples);
    return open > Number(0) ? open : Number(0);
}

}  // namespace nook::inline NOOK_TARGET
