#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>

#include "compare/failure.hpp"
#include "compare/rotation.hpp"
#include "compare/table.hpp"
#include "kernels.hpp"
#include "options.hpp"
#include "results.hpp"

/// What the parts share.
namespace compare {

inline constexpr int windows[] = {3, 7, 15, 31, 63, 127};

struct Size {
    int width, height;
    const char* name;

    [[nodiscard]] std::size_t pixels() const
    {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
};
/// 1080p and 4K; with --quick stand-ins for both.
[[nodiscard]] inline std::vector<Size> sizes(const Options& options)
{
    if (options.quick) return {{320, 180, "320x180"}, {640, 360, "640x360"}};
    return {{1920, 1080, "1080p"}, {3840, 2160, "4K"}};
}

[[nodiscard]] inline Effort effort(const Options& options, Clock clock = Clock::processor)
{
    return {options.rounds, options.quick ? 1e-4 : 3e-3, clock};
}

/// A call of nook with scratch of its own, made ahead.
[[nodiscard]] inline Contender nook_contender(std::string name, const Kernels& kernels,
                                              const Depth& depth, const Visibility& visibility,
                                              const nook::ChebyshevOptions& options,
                                              const nook::Projection& projection = {},
                                              const Threads& threads = {})
{
    const std::size_t size =
        kernels.chebyshev_ao_scratch_size(depth, options, projection, threads.workers);
    auto scratch = std::make_shared<std::vector<char>>(size);
    return {std::move(name), [=, &kernels] {
                checked(kernels.chebyshev_ao(depth, visibility, options, projection,
                                             {scratch->data(), scratch->size()}, threads),
                        "chebyshev_ao");
            }};
}

[[nodiscard]] inline Contender memcpy_contender(const Depth& depth, const Visibility& visibility)
{
    const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(depth.width) *
                              static_cast<std::size_t>(depth.height);
    return {"memcpy", [=] { std::memcpy(visibility.data, depth.data, bytes); }};
}

/// The difference of two pictures, but for a frame of `margin` pixels.
[[nodiscard]] Agreement difference(const nook::Image<float>& one, const nook::Image<float>& other,
                                   int margin = 0);

[[nodiscard]] inline Summary per_pixel(const Summary& seconds, std::size_t pixels)
{
    const double scale = 1e9 / double(pixels);
    return {seconds.median * scale, seconds.lower * scale, seconds.upper * scale};
}

}  // namespace compare
