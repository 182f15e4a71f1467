#pragma once

#include <nook/image.hpp>
#include <nook/outcome.hpp>

/// What a unit draws: linear depth, and view-space normals in rows of 3 × width.
struct GBuffer {
    nook::ImageView<float> depth{}, normal{};
};

/// What a unit makes of a G-buffer by every kernel. The caller provides the images.
/// Plain data types pass between units built for different targets.
struct Answers {
    nook::Outcome outcome{};
    nook::ImageView<float> fixed{};   ///< Chebyshev AO in a window of pixels
    nook::ImageView<float> radius{};  ///< Chebyshev AO in a window of a world length
    nook::ImageView<float> traced{};
    float information[5] = {};  ///< of the triangles, bits
    double rmse = 0;
    double ssim = 0;
    bool background_is_open = false;
    bool nan_is_named = false;
    const char* target = "";
};

/// Rays per pixel of the traced image.
inline constexpr int directions = 64;

extern "C" {
void draw_plain(const GBuffer& images, nook::Outcome* outcome);
void draw_avx2(const GBuffer& images, nook::Outcome* outcome);
void draw_fast(const GBuffer& images, nook::Outcome* outcome);
void shade_plain(const GBuffer& images, Answers* answers);
void shade_avx2(const GBuffer& images, Answers* answers);
void shade_fast(const GBuffer& images, Answers* answers);
}
