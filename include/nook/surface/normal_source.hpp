#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/work_map.hpp>

namespace nook {

/// Normals per pixel, and the axes they stand in.
///
/// A view of normals in view axes (x right, y up, z towards the viewer) is a source as it stands.
/// `NormalSource{normals, world_to_view}` takes those of other axes. Of any length; zero, NaN and
/// infinite ones mean: no surface. One that faces away from the viewer is used as it is.
struct NormalSource {
    ImageView3<const float> image{};
    /// The rotation from the stored axes to view axes, row by row.
    float to_view[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    bool rotated = false;

    constexpr NormalSource() = default;
    constexpr NormalSource(const ImageView3<const float>& normals) : image{normals} {}
    constexpr NormalSource(const ImageView3<float>& normals) : image(normals) {}
    /// `rotation`: nine floats, row by row; not null.
    constexpr NormalSource(const ImageView3<const float>& normals, const float* rotation)
        : image{normals},
          rotated{true}
    {
        for (int i = 0; i < 9; ++i) to_view[i] = rotation[i];
    }
};

}  // namespace nook

namespace nook::inline NOOK_TARGET::detail {

/// Three channels of the size of the depth, and a rotation.
template <class T>
[[nodiscard]] Error check_normals(const NormalSource& normals, const ImageView<T>& first)
{
    const auto check = [&](const ImageView<const float>& image, const char* name) -> Error {
        if (const Error error = check_input(image, name)) return error;
        return check_same_size(first, image, name);
    };
    if (const Error error = check(normals.image.x, "normals.x")) return error;
    if (const Error error = check(normals.image.y, "normals.y")) return error;
    if (const Error error = check(normals.image.z, "normals.z")) return error;
    for (const float element : normals.to_view)
        if (!is_finite(element) || element > 2 || element < -2)
            return {ErrorCode::bad_value, "normals.to_view", double(element),
                    "elements of a rotation"};
    return {};
}

/// The output shares no memory with the normals.
template <class U>
[[nodiscard]] Error check_apart(const NormalSource& normals, const ImageView<U>& output,
                                const char* name)
{
    if (const Error error = check_apart(normals.image.x, output, name)) return error;
    if (const Error error = check_apart(normals.image.y, output, name)) return error;
    return check_apart(normals.image.z, output, name);
}

struct Normal {
    double x, y, z;
};

/// The unit normal of a pixel in view axes, or zero when there is none.
[[nodiscard]] inline Normal unit_normal(const NormalSource& normals, int x, int y)
{
    const float nx = normals.image.x(x, y), ny = normals.image.y(x, y), nz = normals.image.z(x, y);
    if (!is_finite(nx) || !is_finite(ny) || !is_finite(nz)) return {0, 0, 0};
    Normal n{nx, ny, nz};
    if (normals.rotated) {
        const float* m = normals.to_view;
        n = {m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
             m[6] * n.x + m[7] * n.y + m[8] * n.z};
    }
    const double square = n.x * n.x + n.y * n.y + n.z * n.z;
    if (!(square > 0)) return {0, 0, 0};
    const double scale = 1 / std::sqrt(square);
    return {n.x * scale, n.y * scale, n.z * scale};
}

/// Unit normals of a group of pixels, zero where there are none: `unit_normal` on lanes.
template <class Real>
struct NormalGroup {
    static constexpr int size = WorkMap::group;
    alignas(64) Real x[size];
    alignas(64) Real y[size];
    alignas(64) Real z[size];
};

/// The first `count` elements from (x, y) on.
NOOK_INLINE void read_channel(const ImageView<const float>& image, int x, int y, int count,
                              float* values)
{
    const float* const in = &image(x, y);
    if (image.pixel_stride == 1 && count == WorkMap::group) {
        for (int i = 0; i < WorkMap::group; i += float_lanes)
            store(values + i, load<float_lanes>(in + i));
        return;
    }
    for (int i = 0; i < count; ++i) values[i] = in[i * image.pixel_stride];
    for (int i = count; i < WorkMap::group; ++i) values[i] = 0;
}

/// The three channels of a group.
NOOK_INLINE void read_channels(const ImageView3<const float>& image, int x, int y, int count,
                               float* nx, float* ny, float* nz)
{
    const float* const in = &image.x(x, y);
    const bool side_by_side = image.x.pixel_stride == 3 && image.y.pixel_stride == 3 &&
                              image.z.pixel_stride == 3 && &image.y(x, y) == in + 1 &&
                              &image.z(x, y) == in + 2;
    if (side_by_side && count == WorkMap::group) {
        for (int i = 0; i < WorkMap::group; i += float_lanes) {
            const auto first = load<float_lanes>(in + 3 * i),
                       second = load<float_lanes>(in + 3 * i + float_lanes),
                       third = load<float_lanes>(in + 3 * i + 2 * float_lanes);
            store(nx + i, every_third<0>(first, second, third));
            store(ny + i, every_third<1>(first, second, third));
            store(nz + i, every_third<2>(first, second, third));
        }
        return;
    }
    read_channel(image.x, x, y, count, nx);
    read_channel(image.y, x, y, count, ny);
    read_channel(image.z, x, y, count, nz);
}

/// False when some pixel has none.
template <class Real>
bool read_normals(const NormalSource& normals, int x, int y, int count, NormalGroup<Real>& group)
{
    constexpr int size = WorkMap::group, lanes = float_lanes;
    bool whole = count == size;
    const auto read_one = [&](int i) {
        const Normal n = i < count ? unit_normal(normals, x + i, y) : Normal{0, 0, 0};
        group.x[i] = static_cast<Real>(n.x);
        group.y[i] = static_cast<Real>(n.y);
        group.z[i] = static_cast<Real>(n.z);
        whole = whole && (n.x != 0 || n.y != 0 || n.z != 0);
    };
    if constexpr (std::is_same_v<Real, float>)
        if (!normals.rotated) {
            using Vector = Lanes<float, lanes>;
            using Bits = Lanes<std::int32_t, lanes>;
            // 1: none, 2: not for float.
            alignas(64) std::int32_t marks[size];
            bool any_mark = false;
            read_channels(normals.image, x, y, count, group.x, group.y, group.z);
            for (int i = 0; i < size; i += lanes) {
                const Vector a = load<lanes>(group.x + i), b = load<lanes>(group.y + i),
                             c = load<lanes>(group.z + i);
                const Vector square = a * a + b * b + c * c;
                const auto none = (a == 0.0f) & (b == 0.0f) & (c == 0.0f);
                // Float will do while the squares are far from its limits. By bits, so that NaN does
                // not pass under -ffast-math either; those of numbers ≥ 0 are ordered like them.
                const Bits bits = std::bit_cast<Bits>(square);
                const auto odd = (bits < std::bit_cast<std::int32_t>(0x1p-60f)) |
                                 (bits > std::bit_cast<std::int32_t>(0x1p60f));
                any_mark = any_mark || any(odd);
                const Bits zero{}, one = zero + 1;
                store(marks + i, Bits(odd ? (none ? one : one + one) : zero));
                // Unit normals stay as they are.
                const auto unit = (square > 1 - 0x1p-20f) & (square < 1 + 0x1p-20f);
                const Vector scale = 1.0f / square_root(Vector(odd ? Vector{} + 1.0f : square));
                store(group.x + i, unit ? a : a * scale);
                store(group.y + i, unit ? b : b * scale);
                store(group.z + i, unit ? c : c * scale);
            }
            for (int i = 0; any_mark && i < size; ++i) {
                whole = whole && marks[i] != 1;
                if (marks[i] == 2) read_one(i);
            }
            return whole;
        }
    for (int i = 0; i < size; ++i) read_one(i);
    return whole;
}

}  // namespace nook::inline NOOK_TARGET::detail
