#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/traversal.hpp>
#include <nook/scene/vector.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Rays, as bits: ray i is bit i.
using RayMask = std::uint64_t;

/// Up to 64 rays from one point: unit directions in float, in scene space, in groups as wide as the
/// target's registers. Rays beyond `count` repeat the last one.
struct RayFan {
    static constexpr int most = 64;
    static constexpr int groups = most / float_lanes;

    alignas(64) float direction[3][most];
    alignas(64) float inverse[3][most];
    int count = 0;
    /// All rays rise above the tangent plane by at least this sine.
    float least_rise = 0;

    [[nodiscard]] RayMask all() const
    {
        return count == most ? ~RayMask{0} : (RayMask{1} << count) - 1;
    }
    /// Completes a fan whose first `count` directions are there.
    void complete(const Vector3& normal)
    {
        const int padded = (count + float_lanes - 1) / float_lanes * float_lanes;
        for (int i = count; i < padded; ++i)
            for (auto& row : direction) row[i] = row[count - 1];
        const float up[3] = {static_cast<float>(normal.x), static_cast<float>(normal.y),
                             static_cast<float>(normal.z)};
        FloatLanes least = broadcast<float_lanes>(1.0f);
        for (int i = 0; i < padded; i += float_lanes) {
            FloatLanes rise{};
            for (int k = 0; k < 3; ++k) {
                const FloatLanes d = load<float_lanes>(direction[k] + i);
                rise = rise + d * up[k];
                // See `slab_reciprocal`.
                const FloatLanes zero{};
                const FloatLanes steep = larger(larger(d, -d), broadcast<float_lanes>(0x1p-60f));
                store(inverse[k] + i, 1 / (d < zero ? -steep : steep));
            }
            least = smaller(least, rise);
        }
        const float rise = fold(least, [](const auto& a, const auto& b) { return smaller(a, b); });
        least_rise = (std::max)(rise - 0x1p-22f, 0.0f);
    }
    [[nodiscard]] static unsigned group(RayMask mask, int index)
    {
        return static_cast<unsigned>(mask >> (index * float_lanes)) & group_bits;
    }
    [[nodiscard]] static RayMask ungroup(unsigned bits, int index)
    {
        return RayMask{bits} << (index * float_lanes);
    }
    static constexpr unsigned group_bits = (1u << float_lanes) - 1;
};

}  // namespace nook::inline NOOK_TARGET::detail
