#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/image.hpp>

namespace nook {

/// How a depth buffer stores its numbers: the type of an element, its value, and the spacing of
/// neighbouring values (relative to the value, below one, and absolute for fixed point and denormals).
template <class Float>
struct FloatStorage {
    using Stored = Float;
    static constexpr bool fixed_point = false;
    static constexpr double relative_step = std::numeric_limits<Float>::epsilon();
    static constexpr double step_below_one = relative_step / 2;
    static constexpr double absolute_step = std::numeric_limits<Float>::denorm_min();
};
/// IEEE half floats, held as 16 bits.
struct HalfStorage {
    using Stored = std::uint16_t;
    static constexpr bool fixed_point = false;
    static constexpr double relative_step = 0x1p-10;
    static constexpr double step_below_one = 0x1p-11;
    static constexpr double absolute_step = 0x1p-24;
};
/// Fixed point in the low `bits` bits of an unsigned integer: 0 is 0, all ones are 1. What else the
/// element holds (the stencil of D24S8) is ignored.
template <class Unsigned, int bits>
struct FixedStorage {
    using Stored = Unsigned;
    static constexpr bool fixed_point = true;
    static constexpr Unsigned mask = static_cast<Unsigned>((std::uint64_t{1} << bits) - 1);
    static constexpr double absolute_step = 1.0 / mask;
};
using D16Storage = FixedStorage<std::uint16_t, 16>;
using D24Storage = FixedStorage<std::uint32_t, 24>;

namespace detail {
template <class Stored>
struct DefaultStorage;
template <>
struct DefaultStorage<float> : std::type_identity<FloatStorage<float>> {};
template <>
struct DefaultStorage<double> : std::type_identity<FloatStorage<double>> {};
template <>
struct DefaultStorage<std::uint16_t> : std::type_identity<D16Storage> {};
template <>
struct DefaultStorage<std::uint32_t> : std::type_identity<D24Storage> {};
}  // namespace detail

}  // namespace nook

namespace nook::inline NOOK_TARGET {

namespace detail {

/// 1 / f, 0 for an infinite far plane: judged by bits, since -ffast-math assumes that there is none.
[[nodiscard]] constexpr double inverse_far(const Projection& projection)
{
    return is_finite(projection.far_plane) ? 1 / projection.far_plane : 0;
}

/// The number that an element stands for; false when it is NaN or infinite. By bits, for -ffast-math.
template <class Float>
[[nodiscard]] constexpr bool stored_value(FloatStorage<Float>, Float stored, double& value)
{
    if (!is_finite(stored)) return false;
    value = static_cast<double>(stored);
    return true;
}
[[nodiscard]] constexpr bool stored_value(HalfStorage, std::uint16_t stored, double& value)
{
    const int exponent = stored >> 10 & 31, fraction = stored & 1023;
    if (exponent == 31) return false;
    const double unit = std::bit_cast<double>(
        static_cast<std::uint64_t>(exponent == 0 ? 1023 - 24 : 1023 - 25 + exponent) << 52);
    const double magnitude = (exponent == 0 ? fraction : 1024 + fraction) * unit;
    value = (stored & 0x8000) != 0 ? -magnitude : magnitude;
    return true;
}
template <class Unsigned, int bits>
[[nodiscard]] constexpr bool stored_value(FixedStorage<Unsigned, bits> storage, Unsigned stored,
                                          double& value)
{
    value = static_cast<double>(stored & storage.mask) * storage.absolute_step;
    // The last value is exactly 1, whatever the product rounds to: it marks the far or near end.
    if ((stored & storage.mask) == storage.mask) value = 1;
    return true;
}

/// The element nearest to a number in the storage's range.
template <class Float>
[[nodiscard]] constexpr Float store_value(FloatStorage<Float>, double value)
{
    return static_cast<Float>(value);
}
[[nodiscard]] inline std::uint16_t store_value(HalfStorage, double value)
{
    const double magnitude = std::fabs(value);
    const auto sign = static_cast<std::uint16_t>(std::signbit(value) ? 0x8000 : 0);
    if (!(magnitude < 65520)) return static_cast<std::uint16_t>(sign | 0x7c00);
    if (magnitude < 0x1p-14)
        return static_cast<std::uint16_t>(sign + std::lrint(magnitude * 0x1p24));
    int exponent = 0;
    const double mantissa = std::frexp(magnitude, &exponent);  // in [1/2, 1)
    // A mantissa that rounds up to 2048 carries into the exponent by itself.
    return static_cast<std::uint16_t>(sign + ((exponent + 14) << 10) + std::lrint(mantissa * 2048) -
                                      1024);
}
template <class Unsigned, int bits>
[[nodiscard]] inline Unsigned store_value(FixedStorage<Unsigned, bits> storage, double value)
{
    return static_cast<Unsigned>(
        std::llrint((std::min)((std::max)(value, 0.0), 1.0) * storage.mask));
}

}  // namespace detail

/// The encoding of a depth buffer element, ready to be inlined into a load.
///
/// A planar encoding stores how near a point is, t (1 at the near plane, 0 at the far plane), as
/// t = scale · value + offset with exact constants. Both t and 1 − t are then free of cancellation
/// where they are small, so 1/z = t/n + (1 − t)/f (and z = t n + (1 − t) f under orthography) keeps
/// its accuracy up to the far plane, unlike n f/(f − d (f − n)). Arithmetic in double, one rounding
/// to the result.
template <class Storage>
class HardwareDecode {
public:
    using Stored = typename Storage::Stored;
    using Distance = std::conditional_t<std::is_same_v<Stored, double>, double, float>;

    HardwareDecode() = default;
    explicit HardwareDecode(const Projection& projection)
    {
        const bool fixed = Storage::fixed_point;
        switch (projection.encoding) {
        case DepthEncoding::linear:
            kind_ = Kind::affine;
            a_ = fixed ? projection.far_plane : 1;
            break;
        case DepthEncoding::negative_z:
            kind_ = Kind::affine;
            a_ = -1;
            break;
        case DepthEncoding::logarithmic:
            kind_ = Kind::logarithmic;
            a_ = std::log1p(projection.logarithmic_scale * projection.far_plane);
            b_ = 1 / projection.logarithmic_scale;
            break;
        case DepthEncoding::opengl:
            kind_ = projection.orthographic ? Kind::planar : Kind::reciprocal;
            scale_ = fixed ? -1 : -0.5;
            offset_ = fixed ? 1 : 0.5;
            break;
        case DepthEncoding::standard:
            kind_ = projection.orthographic ? Kind::planar : Kind::reciprocal;
            scale_ = -1;
            offset_ = 1;
            break;
        case DepthEncoding::reversed:
            kind_ = projection.orthographic ? Kind::planar : Kind::reciprocal;
            scale_ = 1;
            offset_ = 0;
            break;
        }
        if (kind_ == Kind::planar) {
            a_ = projection.near_plane;
            b_ = projection.far_plane;
        } else if (kind_ == Kind::reciprocal) {
            a_ = 1 / projection.near_plane;
            b_ = detail::inverse_far(projection);
        }
    }

    /// The distance, or 0 for background: not a number, or at the far end of the encoding.
    [[nodiscard]] Distance operator()(Stored stored) const
    {
        double value = 0;
        if (!detail::stored_value(Storage{}, stored, value)) return 0;
        double distance = 0;
        switch (kind_) {
        case Kind::affine: distance = a_ * value; break;
        case Kind::logarithmic:
            if (value >= 1) return 0;
            distance = std::expm1(value * a_) * b_;
            break;
        case Kind::planar:
        case Kind::reciprocal: {
            const double t = scale_ * value + offset_;
            if (t <= 0) return 0;
            const double blend = t * a_ + (1 - t) * b_;
            distance = kind_ == Kind::planar ? blend : 1 / blend;
        }
        }
        return static_cast<Distance>(distance);
    }

private:
    enum class Kind : std::uint8_t { affine, planar, reciprocal, logarithmic };
    Kind kind_ = Kind::affine;
    double scale_ = 1, offset_ = 0, a_ = 1, b_ = 0;
};

/// An upper bound on the spacing of the distances that a storage can hold under an encoding, the
/// rounding of the decoded distance included.
template <class Storage>
[[nodiscard]] DepthStep depth_step(const Projection& projection)
{
    using Distance = typename HardwareDecode<Storage>::Distance;
    // Spacing of the stored values: of those below 1, and relative for those near 0.
    double below_one = Storage::absolute_step, relative = 0;
    if constexpr (!Storage::fixed_point) {
        below_one = Storage::step_below_one;
        relative = Storage::relative_step;
    }
    DepthStep step{0, std::numeric_limits<Distance>::epsilon(), 0};
    const bool affine = projection.encoding == DepthEncoding::linear ||
                        projection.encoding == DepthEncoding::negative_z;
    if (std::is_same_v<Distance, double> && !affine) {
        // The decoder works in double, so here its own rounding is as large as the steps.
        below_one += 0x1p-53;
        step.linear += 4 * 0x1p-52;
    }
    const double near_plane = projection.near_plane, far_plane = projection.far_plane;
    switch (projection.encoding) {
    case DepthEncoding::linear:
    case DepthEncoding::negative_z:
        if (Storage::fixed_point) {
            step.constant += far_plane * Storage::absolute_step;
        } else {
            step.linear = (std::max)(step.linear, relative);
            step.constant += Storage::absolute_step;
        }
        break;
    case DepthEncoding::logarithmic: {
        // dz/dd = (1/c + z) log(1 + c f)
        const double slope = std::log1p(projection.logarithmic_scale * far_plane) * below_one;
        step.constant += slope / projection.logarithmic_scale;
        step.linear += slope;
        break;
    }
    case DepthEncoding::standard:
    case DepthEncoding::opengl:
    case DepthEncoding::reversed: {
        // opengl spreads [0, 1] over [−1, 1], which halves the step of a float beside ±1.
        const double spread =
            projection.encoding == DepthEncoding::opengl && !Storage::fixed_point ? 0.5 : 1;
        const bool from_zero = projection.encoding == DepthEncoding::reversed && relative > 0;
        if (projection.orthographic) {
            step.constant += (far_plane - near_plane) * below_one * spread;
        } else if (from_zero) {
            // The stored value is about n/z, its spacing relative to it: z² · (n/z) · relative / n.
            step.linear += relative;
            step.quadratic +=
                Storage::absolute_step * (1 / near_plane - detail::inverse_far(projection));
        } else {
            step.quadratic +=
                below_one * spread * (1 / near_plane - detail::inverse_far(projection));
        }
    }
    }
    return step;
}

/// A hardware depth buffer as a source. Storage follows from the element: float, double,
/// uint16 (D16), uint32 (D24 in the low bits); name it for others:
/// `hardware_depth<nook::HalfStorage>(view, projection)`. The projection must pass
/// `check_projection(projection, true)`.
template <class Storage = void, class T>
[[nodiscard]] auto hardware_depth(const ImageView<T>& image, const Projection& projection)
{
    using Stored = std::remove_const_t<T>;
    using Actual =
        typename std::conditional_t<std::is_void_v<Storage>, detail::DefaultStorage<Stored>,
                                    std::type_identity<Storage>>::type;
    using Source = DepthSource<Stored, HardwareDecode<Actual>>;
    using Distance = typename Source::Distance;
    constexpr double largest = (std::numeric_limits<Distance>::max)();
    const bool finite = detail::is_finite(projection.far_plane);
    const double limit = finite ? (std::min)(projection.far_plane, largest) : largest;
    // A point on the far plane may round to just beyond it.
    const double slack = 1 + 2 * double{std::numeric_limits<Distance>::epsilon()};
    return Source{image, HardwareDecode<Actual>{projection}, depth_step<Actual>(projection),
                  static_cast<Distance>(limit < largest / slack ? limit * slack : limit)};
}

/// The element that stores a distance: the inverse of the decoder, rounded to nearest. Background
/// (not a surface, or at or beyond the far plane) becomes the value at the far end of the encoding;
/// in fixed point, what is nearer than the near plane becomes the value at the near end.
template <class Storage>
[[nodiscard]] typename Storage::Stored encode_depth(double distance, const Projection& projection)
{
    const double near_plane = projection.near_plane, far_plane = projection.far_plane;
    const bool background =
        !is_surface(distance, detail::is_finite(far_plane) ? far_plane : distance);
    double value = 0;
    switch (projection.encoding) {
    case DepthEncoding::linear:
        if (!background) value = Storage::fixed_point ? distance / far_plane : distance;
        break;
    case DepthEncoding::negative_z:
        if (!background) value = -distance;
        break;
    case DepthEncoding::logarithmic:
        value = background ? 1
                           : std::log1p(projection.logarithmic_scale * distance) /
                                 std::log1p(projection.logarithmic_scale * far_plane);
        break;
    default: {
        // Both ends of the interval without cancellation, as in the decoder.
        double nearness = 0, farness = 1;
        if (!background) {
            if (projection.orthographic) {
                nearness = (far_plane - distance) / (far_plane - near_plane);
                farness = (distance - near_plane) / (far_plane - near_plane);
            } else {
                const double inverse_far = detail::inverse_far(projection);
                const double span = 1 / near_plane - inverse_far;
                nearness = (1 / distance - inverse_far) / span;
                farness = (1 / near_plane - 1 / distance) / span;
            }
        }
        if (projection.encoding == DepthEncoding::reversed) value = nearness;
        else if (projection.encoding == DepthEncoding::opengl && !Storage::fixed_point)
            value = farness - nearness;
        else value = farness;
    }
    }
    return detail::store_value(Storage{}, value);
}

}  // namespace nook::inline NOOK_TARGET
