#pragma once

#include <concepts>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>

namespace nook {

/// In place of an image that is not asked for.
struct Absent {};
inline constexpr Absent absent{};

/// What the ray-traced kernels write. What is absent is not computed. All images have the size of the
/// input and share no memory with it or with each other; channels of one buffer are fine.
template <class V, class Bent = Absent, class Radiance = Absent, class Weight = Absent>
struct TracedImages {
    static_assert(std::is_floating_point_v<V>, "visibility is float or double");
    static_assert(std::same_as<Bent, Absent> || std::same_as<Bent, ImageView3<V>>);
    static_assert(std::same_as<Radiance, Absent> || std::same_as<Radiance, ImageView3<V>>);
    static_assert(std::same_as<Weight, Absent> || std::same_as<Weight, ImageView<V>>);
    static constexpr bool has_bent = !std::same_as<Bent, Absent>;
    static constexpr bool has_radiance = !std::same_as<Radiance, Absent>;
    static constexpr bool has_weight = !std::same_as<Weight, Absent>;

    /// The mean over the directions of what each lets through.
    ImageView<V> visibility;
    /// ImageView3: the mean open direction, unit length; the normal where nothing is open, and 0 where
    /// there is no surface.
    Bent bent_normals{};
    /// ImageView3: the mean over the directions of (1 − μ) colour(face), 0 for a miss: what nearby
    /// occluders send under ambient light of 1 (Fridvalszky & Tóth 2022, equations 3 to 5). Needs
    /// `options.colour`. Secondary rays add nothing to it.
    Radiance radiance{};
    /// ImageView: how many directions counted; fewer than asked for where some lay below the surface, 0
    /// where there is none or a work map that is not exact skips it.
    Weight weight{};
};
template <class V>
TracedImages(ImageView<V>) -> TracedImages<V>;
template <class V, class Bent>
TracedImages(ImageView<V>, Bent) -> TracedImages<V, Bent>;
template <class V, class Bent, class Radiance>
TracedImages(ImageView<V>, Bent, Radiance) -> TracedImages<V, Bent, Radiance>;
template <class V, class Bent, class Radiance, class Weight>
TracedImages(ImageView<V>, Bent, Radiance, Weight) -> TracedImages<V, Bent, Radiance, Weight>;

}  // namespace nook

namespace nook::inline NOOK_TARGET::detail {

template <class V>
[[nodiscard]] TracedImages<V> traced_images(const ImageView<V>& visibility)
{
    return {visibility};
}
template <class V, class Bent, class Radiance, class Weight>
[[nodiscard]] const TracedImages<V, Bent, Radiance, Weight>& traced_images(
    const TracedImages<V, Bent, Radiance, Weight>& images)
{
    return images;
}

/// Calls f(image, name) for every image that is there until one returns an error.
template <class Images, class F>
[[nodiscard]] Error check_each_image(const Images& images, const F& f)
{
    if (const Error error = f(images.visibility, "visibility")) return error;
    if constexpr (Images::has_bent) {
        if (const Error error = f(images.bent_normals.x, "bent_normals.x")) return error;
        if (const Error error = f(images.bent_normals.y, "bent_normals.y")) return error;
        if (const Error error = f(images.bent_normals.z, "bent_normals.z")) return error;
    }
    if constexpr (Images::has_radiance) {
        if (const Error error = f(images.radiance.x, "radiance.x")) return error;
        if (const Error error = f(images.radiance.y, "radiance.y")) return error;
        if (const Error error = f(images.radiance.z, "radiance.z")) return error;
    }
    if constexpr (Images::has_weight)
        if (const Error error = f(images.weight, "weight")) return error;
    return {};
}

/// Every image is one that a kernel may write, and is apart from the others.
template <class Images>
[[nodiscard]] Error check_traced_images(const Images& images)
{
    bool passed = false;
    return check_each_image(images, [&](const auto& image, const char* name) -> Error {
        if (const Error error = check_output(image, name)) return error;
        if (const Error error = check_same_size(images.visibility, image, name)) return error;
        // Each against those before it.
        passed = false;
        return check_each_image(images, [&](const auto& other, const char*) -> Error {
            if (&other == &image) passed = true;
            return passed ? Error{} : check_apart(other, image, name);
        });
    });
}

}  // namespace nook::inline NOOK_TARGET::detail
