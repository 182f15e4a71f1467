#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

#include <glm/vec3.hpp>

#include <nook/target.hpp>

namespace nook {

/// Occluders are not asked for their colour.
struct NoColour {};

/// The colour of occluders from one RGB triple per face of the mesh.
struct FaceAlbedo {
    const float* rgb = nullptr;
    /// Floats from one face to the next.
    std::ptrdiff_t stride = 3;

    [[nodiscard]] NOOK_INLINE glm::vec3 operator()(std::uint32_t face) const
    {
        const float* const at = rgb + static_cast<std::ptrdiff_t>(face) * stride;
        return {at[0], at[1], at[2]};
    }
};

/// NoColour, or any function from a face of the mesh to its colour: what it sends out under ambient
/// light of 1. Not finite: counted as 0.
template <class C>
concept OccluderColour = std::same_as<C, NoColour> || requires(const C& colour, std::uint32_t face)
{
    {
        colour(face)
        } -> std::convertible_to<glm::vec3>;
};

}  // namespace nook
