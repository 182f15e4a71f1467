#pragma once

#include <cstdint>

#include <nook/depth/source.hpp>
#include <nook/depth/window.hpp>

namespace nook::inline NOOK_TARGET::detail {

template <class Accumulator>
struct WindowMoments {
    std::int32_t count = 0;       ///< surface samples
    std::int32_t background = 0;  ///< the window's other samples
    Accumulator variance = 0;
    Accumulator deviation = 0;  ///< centre − mean
};

struct KeepAll {
    template <class Distance>
    constexpr bool operator()(int, int, Distance) const
    {
        return true;
    }
};

/// The moments of one window, all samples read twice: differences from the centre sample give the
/// mean, differences from the mean give the variance. `centre` is a surface; `keep(x, y, distance)`
/// may leave surface samples out.
template <class Accumulator, class Source, class Distance, class Keep = KeepAll>
[[nodiscard]] WindowMoments<Accumulator> direct_moments(const Source& source, Distance centre,
                                                        Span columns, Span rows,
                                                        const Keep& keep = {})
{
    const auto pivot = static_cast<Accumulator>(centre);
    WindowMoments<Accumulator> result;
    const auto for_each_sample = [&](const auto& f) {
        result.count = result.background = 0;
        for (int y = rows.first; y <= rows.last; ++y)
            for (int x = columns.first; x <= columns.last; ++x) {
                const Distance distance = surface_distance(source, x, y);
                if (!(distance > 0)) {
                    ++result.background;
                } else if (keep(x, y, distance)) {
                    ++result.count;
                    f(static_cast<Accumulator>(distance) - pivot);
                }
            }
    };
    Accumulator sum = 0;
    for_each_sample([&](Accumulator difference) { sum += difference; });
    if (result.count == 0) return result;
    const auto count = static_cast<Accumulator>(result.count);
    const Accumulator mean = sum / count;
    Accumulator squares = 0;
    for_each_sample(
        [&](Accumulator difference) { squares += (difference - mean) * (difference - mean); });
    result.variance = squares / count;
    result.deviation = -mean;
    return result;
}

}  // namespace nook::inline NOOK_TARGET::detail
