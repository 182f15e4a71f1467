// Compiled once per target, with UNIT naming the function.
#include "unit.hpp"

#include <bit>

#include <nook/depth/hardware_depth.hpp>
#include <nook/nook.hpp>

#define TEXT2(name) #name
#define TEXT(name) TEXT2(name)

extern "C" void UNIT(nook::ImageView<float> depth, Answers* answers)
{
    answers->target = TEXT(NOOK_TARGET);
    const float positions[] = {-4, -4, 0, 4, -4, 0, 4, 4, 0, -4, 4, 0,
                               -1, -1, 0, 1, -1, 0, 0, 0, 1, 0,  1, 0};
    const std::uint32_t indices[] = {0, 1, 2, 0, 2, 3, 4, 5, 6, 5, 7, 6, 7, 4, 6};
    const nook::MeshView mesh{
        .positions = positions, .vertex_count = 8, .indices = indices, .triangle_count = 5};
    const nook::Camera camera{.eye = {0.5, -1, 5}, .near_plane = 0.1, .far_plane = 100};
    const nook::Projection projection = nook::projection(camera, depth.width, depth.height);
    const nook::ViewFrame frame = nook::view_frame(camera);

    nook::ThreadExecutor executor{2};
    nook::HeapScratch scratch;
    nook::Image<float> normal(3 * depth.width, depth.height);
    const auto normals = nook::ImageView3<float>::interleaved(normal.data(), depth.width,
                                                              depth.height, 3 * depth.width);
    nook::Image<float> visibility(depth.width, depth.height), reference(visibility);
    nook::Outcome& outcome = answers->outcome;
    const auto good = [&](const nook::Outcome& next) {
        outcome.work += next.work;
        if (!outcome.error) outcome.error = next.error;
        return !outcome.error;
    };

    nook::Bvh bvh;
    if (!good(
            nook::rasterise(mesh, frame, projection, {depth, normals, {}}, {}, scratch, executor)))
        return;
    if (!good(bvh.build(mesh))) return;
    if (!good(nook::traced_ao(bvh, depth, normals, reference.view(),
                              {.radius = 1, .directions = 16}, projection, frame, {}, scratch,
                              executor)))
        return;

    // Through a hardware encoding, so that the decoder is part of what is compared.
    nook::Projection reversed = projection;
    reversed.encoding = nook::DepthEncoding::reversed;
    nook::Image<float> stored(depth.width, depth.height);
    for (int y = 0; y < depth.height; ++y)
        for (int x = 0; x < depth.width; ++x)
            stored(x, y) =
                nook::encode_depth<nook::FloatStorage<float>>(double{depth(x, y)}, reversed);
    const auto source = nook::hardware_depth(stored.view(), reversed);
    if (!good(nook::chebyshev_ao(source, visibility.view(), {.window = 15}, reversed, {}, scratch,
                                 executor)))
        return;
    nook::Image<float> slow(visibility);
    if (!good(nook::chebyshev_ao_reference(source, slow.view(), {.window = 15}))) return;

    // Depths that are no surface, where -ffast-math would let a compiler assume that they are.
    const std::uint32_t nothing[] = {0x7fc00000, 0xffc00001, 0x7f800000, 0xff800000, 0xbf800000, 0};
    nook::Image<float> poisoned(depth.width, depth.height, 2.0f);
    std::uint64_t background = 0;
    for (int i = 0; i < depth.width * depth.height; i += 5, ++background)
        poisoned(i % depth.width, i / depth.width) = std::bit_cast<float>(nothing[i % 6]);
    nook::Image<float> open(depth.width, depth.height, -1.0f);
    const nook::Outcome done = nook::chebyshev_ao(poisoned.view(), open.view(), {.window = 7});
    if (!good(done)) return;
    answers->background_is_open = done.work.background == background;
    for (const float value : open) answers->background_is_open &= value == 1.0f;

    nook::ErrorMetrics metrics{};
    if (!good(nook::error_metrics(visibility.view(), slow.view(), metrics))) return;
    const nook::Measured similarity = nook::ssim(visibility.view(), slow.view());
    if (!good({similarity.error})) return;
    answers->rmse = metrics.rmse;
    answers->ssim = similarity.value;
    for (const float value : visibility) answers->visibility += double{value};
    for (const float value : reference) answers->reference += double{value};
}
