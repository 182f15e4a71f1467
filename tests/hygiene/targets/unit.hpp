#pragma once

#include <nook/image.hpp>
#include <nook/outcome.hpp>

/// One translation unit of the program: what it computes, by every kernel, on one small scene.
/// Plain data types pass between units built for different targets.
struct Answers {
    nook::Outcome outcome{};
    double visibility = 0;
    double reference = 0;
    double rmse = 0;
    double ssim = 0;
    bool background_is_open = false;
    const char* target = "";
};

extern "C" {
void unit_plain(nook::ImageView<float> depth, Answers* answers);
void unit_avx2(nook::ImageView<float> depth, Answers* answers);
void unit_fast(nook::ImageView<float> depth, Answers* answers);
}
