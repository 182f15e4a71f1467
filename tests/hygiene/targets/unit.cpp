// Compiled once per target, with UNIT naming it.
#include "unit.hpp"

#include <bit>
#include <string_view>

#include <nook/depth/hardware_depth.hpp>
#include <nook/nook.hpp>

#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define TEXT2(name) #name
#define TEXT(name) TEXT2(name)

namespace {

constexpr float positions[] = {-4, -4, 0, 4, -4, 0, 4, 4, 0, -4, 4, 0,
                               -1, -1, 0, 1, -1, 0, 0, 0, 1, 0,  1, 0};
constexpr std::uint32_t indices[] = {0, 1, 2, 0, 2, 3, 4, 5, 6, 5, 7, 6, 7, 4, 6};
constexpr nook::MeshView mesh{
    .positions = positions, .vertex_count = 8, .indices = indices, .triangle_count = 5};
constexpr nook::Camera camera{
    .eye = {0.5, -1, 5}, .up = {0.2, 1, 0}, .near_plane = 0.1, .far_plane = 100};

nook::ImageView3<float> normals_of(const GBuffer& images)
{
    const nook::ImageView<float>& depth = images.depth;
    return nook::ImageView3<float>::interleaved(images.normal.data, depth.width, depth.height,
                                                3 * depth.width);
}

}  // namespace

extern "C" void JOIN(draw_, UNIT)(const GBuffer& images, nook::Outcome* outcome)
{
    nook::ThreadExecutor executor{2};
    *outcome =
        nook::rasterise(mesh, nook::view_frame(camera),
                        nook::projection(camera, images.depth.width, images.depth.height),
                        {images.depth, normals_of(images), {}}, {}, nook::HeapScratch{}, executor);
}

extern "C" void JOIN(shade_, UNIT)(const GBuffer& images, Answers* answers)
{
    answers->target = TEXT(NOOK_TARGET);
    const nook::ImageView<float>& depth = images.depth;
    const nook::Projection projection = nook::projection(camera, depth.width, depth.height);
    nook::ThreadExecutor executor{2};
    nook::HeapScratch scratch;
    nook::Outcome& outcome = answers->outcome;
    const auto good = [&](const nook::Outcome& next) {
        outcome.work += next.work;
        if (!outcome.error) outcome.error = next.error;
        return !outcome.error;
    };

    nook::Bvh bvh;
    if (!good(bvh.build(mesh))) return;
    if (!good(nook::traced_ao(bvh, depth, normals_of(images), answers->traced,
                              {.radius = 1, .directions = directions}, projection,
                              nook::view_frame(camera), {}, scratch, executor)))
        return;

    glm::dvec3 directions_around[nook::icosphere_size(0)];
    nook::icosphere(0, directions_around);
    nook::Camera views[nook::icosphere_size(0)]{};
    for (std::size_t v = 0; v < nook::icosphere_size(0); ++v)
        views[v] = nook::viewpoint_camera(nook::bounding_sphere(mesh), directions_around[v]);
    nook::InformationMaps maps{};
    maps.pmi = answers->information;
    if (!good(nook::information_ao(mesh, views, nook::icosphere_size(0), maps, {}, nullptr, scratch,
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
    const nook::ChebyshevOptions options{.window = 15};
    if (!good(nook::chebyshev_ao(source, answers->fixed, options, reversed, {}, scratch, executor)))
        return;
    if (!good(nook::chebyshev_ao(source, answers->radius, {.radius = 0.5, .bias = 0.0}, reversed,
                                 {}, scratch, executor)))
        return;
    nook::Image<float> slow(depth.width, depth.height);
    if (!good(nook::chebyshev_ao_reference(source, slow.view(), options))) return;

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

    // A NaN in a message, read from memory so that no compiler knows it.
    volatile std::uint64_t bits = 0x7ff8000000000000;
    const double nan = std::bit_cast<double>(std::uint64_t{bits});
    const nook::Outcome refused =
        nook::chebyshev_ao(poisoned.view(), open.view(), {.radius = nan}, projection);
    char text[120];
    nook::describe(refused.error, text, sizeof text);
    answers->nan_is_named = std::string_view{text}.starts_with("options.radius is nan;");

    nook::ErrorMetrics metrics{};
    const nook::ImageView<const float> fixed = answers->fixed;
    if (!good(nook::error_metrics(fixed, slow.view(), metrics))) return;
    const nook::Measured similarity = nook::ssim(fixed, slow.view());
    if (!good({similarity.error})) return;
    answers->rmse = metrics.rmse;
    answers->ssim = similarity.value;
}
