#pragma once

#include <cstdint>

#include <nook/scene/traced_ao.hpp>

#include "kernels.hpp"

namespace compare::inline NOOK_TARGET {

[[nodiscard]] inline nook::TracedOptions<> options_of(const Sampling& sampling)
{
    return {.radius = sampling.radius, .directions = sampling.directions, .seed = sampling.seed};
}

/// The rays of a point, by coordinate: those that nook's kernel traces, from the function that it has
/// them from.
class Directions {
public:
    explicit Directions(const Sampling& sampling) : options_{options_of(sampling)} {}

    void fill(const Points& points, std::size_t point)
    {
        const double* const axis = points.axes + 3 * point;
        nook::detail::fill_fan(options_, {axis[0], axis[1], axis[2]},
                               static_cast<std::uint32_t>(point), 0, options_.directions, fan_);
    }
    [[nodiscard]] const float* x() const { return fan_.direction[0]; }
    [[nodiscard]] const float* y() const { return fan_.direction[1]; }
    [[nodiscard]] const float* z() const { return fan_.direction[2]; }

private:
    nook::TracedOptions<> options_;
    nook::detail::RayFan fan_{};
};
static_assert(nook::detail::RayFan::most >= most_directions);

}  // namespace compare::inline NOOK_TARGET
