#pragma once

#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/outline_raster_vertex.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// The key of pixels without a surface: nothing is farther.
[[nodiscard]] constexpr float background_key(bool orthographic)
{
    return orthographic ? -4 * static_cast<float>(outline_reach) : 0.0f;
}

/// Writes the keys of row y, `distances` being room for a row.
template <class Stored, class Decode, class Distance>
void find_keys(const DepthSource<Stored, Decode>& source, bool orthographic, int y,
               Distance* distances, float* keys)
{
    constexpr int lanes = sizeof(Distance) == 4 ? float_lanes : native_lanes;
    const int width = source.image.width;
    static_cast<void>(read_row<lanes>(source, 0, width, y, distances));
    const auto key = [&](const auto& distance) {
        using Reals = std::remove_cvref_t<decltype(distance)>;
        constexpr int count = LanesTraits<Reals>::count;
        const auto kept =
            smaller(larger(distance, broadcast<count>(static_cast<Distance>(1 / outline_reach))),
                    broadcast<count>(static_cast<Distance>(outline_reach)));
        const Reals value = orthographic ? Reals{-kept} : Reals{Distance{1} / kept};
        const auto none = broadcast<count>(Distance{background_key(orthographic)});
        return convert<float>(Reals{distance > Distance{0} ? value : none});
    };
    int x = 0;
    for (; x + lanes <= width; x += lanes) store(keys + x, key(load<lanes>(distances + x)));
    for (; x < width; ++x) keys[x] = key(distances[x]);
}

}  // namespace nook::inline NOOK_TARGET::detail
