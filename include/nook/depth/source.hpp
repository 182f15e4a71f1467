#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

#include <nook/checks.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>

namespace nook {

/// How far apart the neighbouring depths of a buffer lie, as a polynomial of the distance z: an
/// upper bound, without branches. A float buffer of distances has {0, 2⁻²³, 0}; 24 fixed bits of a
/// standard projection have a quadratic term. The automatic bias follows from it.
struct DepthStep {
    double constant = 0;
    double linear = 0;
    double quadratic = 0;

    [[nodiscard]] NOOK_INLINE constexpr double operator()(double distance) const
    {
        return at(distance);
    }
    /// Of doubles, or of vectors of them.
    template <class Real>
    [[nodiscard]] NOOK_INLINE constexpr Real at(const Real& distance) const
    {
        return constant + distance * (linear + distance * quadratic);
    }
};

/// A depth buffer and how to read it: `decode` turns one stored value into a distance along the
/// view axis, and is inlined into the load of every kernel, so no decoded copy exists.
///
///     nook::DepthSource{view, [](float z) { return -z; }}                        negative view z
///     nook::DepthSource{view, [](std::uint16_t mm) { return mm * 1e-3f; }, {.constant = 1e-3}}
///
/// Hardware depth buffers: `hardware_depth` in hardware_depth.hpp. A plain view of float or double
/// distances is a source as it stands.
///
/// A decoded value that is zero, negative, NaN, infinite or beyond `far_limit` is *background*: no
/// surface. It enters no moments, its share of a window is open, and its own visibility is exactly 1.
template <class Stored, class Decode>
struct DepthSource {
    using Distance = std::remove_cvref_t<std::invoke_result_t<const Decode&, const Stored&>>;
    static_assert(std::is_same_v<Distance, float> || std::is_same_v<Distance, double>,
                  "decode returns a float or a double");

    ImageView<const Stored> image{};
    Decode decode{};
    /// Spacing of the depths the buffer can hold; by default that of the decoded type.
    DepthStep step{0, std::numeric_limits<Distance>::epsilon(), 0};
    /// Distances beyond it are background.
    Distance far_limit = (std::numeric_limits<Distance>::max)();
};
template <class T, class Decode>
DepthSource(ImageView<T>, Decode) -> DepthSource<std::remove_const_t<T>, Decode>;
template <class T, class Decode>
DepthSource(ImageView<T>, Decode, DepthStep) -> DepthSource<std::remove_const_t<T>, Decode>;
template <class T, class Decode, class Limit>
DepthSource(ImageView<T>, Decode, DepthStep, Limit) -> DepthSource<std::remove_const_t<T>, Decode>;

/// Reads stored distances as they are.
struct IdentityDecode {
    template <class T>
    NOOK_INLINE constexpr T operator()(T value) const
    {
        return value;
    }
};

namespace detail {
template <class T>
inline constexpr bool is_depth_source = false;
template <class Stored, class Decode>
inline constexpr bool is_depth_source<DepthSource<Stored, Decode>> = true;
template <class T>
inline constexpr bool is_distance_view = false;
template <class T>
inline constexpr bool is_distance_view<ImageView<T>> = std::is_floating_point_v<T>;
}  // namespace detail

/// What kernels accept as depth: a DepthSource, or a view of float or double distances.
template <class T>
concept DepthInput = detail::is_depth_source<std::remove_cvref_t<T>> ||
    detail::is_distance_view<std::remove_cvref_t<T>>;

/// The source behind a depth input.
template <class T>
requires std::is_floating_point_v<T>
[[nodiscard]] NOOK_INLINE constexpr auto depth_source(const ImageView<T>& view)
{
    return DepthSource<std::remove_const_t<T>, IdentityDecode>{view};
}
template <class Stored, class Decode>
[[nodiscard]] NOOK_INLINE constexpr const DepthSource<Stored, Decode>& depth_source(
    const DepthSource<Stored, Decode>& source)
{
    return source;
}

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// The type of the distances that an input decodes to.
template <DepthInput Depth>
using distance_t =
    typename std::remove_cvref_t<decltype(depth_source(std::declval<const Depth&>()))>::Distance;

/// A distance that is a surface: positive, finite, not beyond the limit. Judged by bits, so that
/// -ffast-math cannot fold the test for NaN and infinity away.
[[nodiscard]] constexpr bool is_surface(float distance, float far_limit)
{
    return std::bit_cast<std::uint32_t>(distance) - 1u < 0x7f7fffffu && distance <= far_limit;
}
/// Distances beyond 2⁴⁸⁰ are background too: a large window of their squares leaves the range of
/// double.
[[nodiscard]] constexpr bool is_surface(double distance, double far_limit)
{
    return std::bit_cast<std::uint64_t>(distance) - 1u < 0x5df0000000000000u &&
           distance <= far_limit;
}

/// The distance at a pixel, or 0 where there is no surface.
template <class Stored, class Decode>
[[nodiscard]] constexpr auto surface_distance(const DepthSource<Stored, Decode>& source, int x,
                                              int y)
{
    const auto distance = source.decode(source.image(x, y));
    return is_surface(distance, source.far_limit) ? distance : decltype(distance){0};
}

namespace detail {

/// What every kernel asks of its depth.
template <class Stored, class Decode>
[[nodiscard]] Error check_source(const DepthSource<Stored, Decode>& source)
{
    if (const Error error = check_input(source.image, "depth")) return error;
    if (is_nan(source.far_limit))
        return {ErrorCode::bad_value, "depth.far_limit", source.far_limit, "a distance"};
    for (const double part : {source.step.constant, source.step.linear, source.step.quadratic})
        if (const Error error = check_at_least(part, 0, "depth.step", "finite coefficients >= 0"))
            return error;
    return {};
}

}  // namespace detail
}  // namespace nook::inline NOOK_TARGET
