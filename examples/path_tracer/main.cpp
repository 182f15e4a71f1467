// nook-path-trace: what light does where ambient occlusion guesses: diffuse paths on nook's hierarchy.

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <nook/owned_image.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scenes.hpp"
#include "../support/arguments.hpp"
#include "../support/checked.hpp"
#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/picture.hpp"
#include "../support/program.hpp"
#include "path_tracer.hpp"

namespace {

struct CommandLine {
    std::string scene = "arcade", file;
    path_tracer::Options options;
    double exposure = 0;  ///< 0: by the picture
    bool beside = false;
    int threads = 1;
};

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Draws a scene by diffuse paths under a sky: every surface alike, or in its own\n"
        "colour. A reference for what ambient occlusion stands for.",
        "nook-path-trace"};
    support::set_up(app);
    std::string size = "960x540", exposure;
    app.add_option("--scene", result.scene, "A built-in scene, or an OBJ file")
        ->type_name("NAME")
        ->capture_default_str();
    app.add_option("--size", size, "Size of the picture in pixels")
        ->type_name("WIDTHxHEIGHT")
        ->capture_default_str();
    app.add_option("--samples", result.options.samples, "Paths per pixel")
        ->type_name("N")
        ->check(CLI::Range(1, 65536))
        ->capture_default_str();
    app.add_option("--bounces", result.options.bounces,
                   "Reflections at most; 1: light straight from the sky")
        ->type_name("B")
        ->check(CLI::Range(0, 64))
        ->capture_default_str();
    app.add_flag("--colours", result.options.colours,
                 "The scene's own colours instead of albedo 0.7");
    app.add_option("--exposure", exposure,
                   "What light is multiplied by [so that half of the picture is darker than 0.3]")
        ->type_name("E");
    app.add_flag("--beside", result.beside,
                 "Ambient occlusion of the same view, plain and with secondary rays, at the left");
    support::add_threads(app, result.threads, "Threads; the picture does not depend on them");
    app.add_option("--out", result.file, "The picture (PNG)")->type_name("FILE")->required();
    if (!support::parse(app, argc, argv)) return false;
    support::check_output_file("--out", result.file);
    if (app.count("--exposure") > 0)
        result.exposure = support::read_positive("--exposure", exposure);
    const support::PictureSize pixels = support::read_picture_size("--size", size);
    result.options.width = pixels.width;
    result.options.height = pixels.height;
    return true;
}

/// The exposure that brings the median of the light to 0.3; the sky alone is left as it is.
float exposure_for(const path_tracer::Light& light)
{
    std::vector<float> values;
    for (const support::Rgb& pixel : light.pixels)
        values.push_back(0.2126f * pixel.r + 0.7152f * pixel.g + 0.0722f * pixel.b);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle > 0 ? (std::max)(0.3f / *middle, 1.0f) : 1.0f;
}

support::Picture exposed(const path_tracer::Light& light, int width, int height, float exposure)
{
    support::Picture picture{width, height};
    auto pixel = light.pixels.begin();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) picture.set(x, y, support::srgb(*pixel++ * exposure));
    return picture;
}

/// Ambient occlusion of the view; background is white.
template <class Options>
support::Picture occlusion(const nook::Bvh& bvh, const scenes::Scene& scene,
                           const support::PictureSize& size, const Options& options,
                           nook::ThreadExecutor& threads)
{
    const auto [width, height] = size;
    const nook::Projection projection = nook::projection(scene.camera, width, height);
    const nook::ViewFrame frame = nook::view_frame(scene.camera);
    nook::Image<float> depth{width, height}, normals{3 * width, height}, visibility{width, height};
    nook::Image<std::uint32_t> faces{width, height};
    const auto normal = nook::ImageView3<float>::interleaved(normals.data(), width, height,
                                                             std::ptrdiff_t{3} * width);
    support::checked(
        nook::rasterise(scene.mesh(), frame, projection, {depth.view(), normal, faces.view()}, {},
                        nook::HeapScratch{}, threads),
        "rasterise");
    support::checked(
        nook::traced_ao(bvh, depth.view(), normal, nook::SourceFaces{faces.view(), scene.mesh()},
                        visibility.view(), options, projection, frame, {}, nook::HeapScratch{},
                        threads),
        "traced_ao");
    support::Picture picture{width, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) picture.set(x, y, support::Rgb{1, 1, 1} * visibility(x, y));
    return picture;
}

void answer(const CommandLine& command)
{
    using clock = std::chrono::steady_clock;
    const path_tracer::Options& options = command.options;
    const scenes::Scene scene = scenes::load(command.scene, double(options.width) / options.height);
    nook::ThreadExecutor threads{command.threads};
    nook::Bvh bvh;
    support::checked(bvh.build(scene.mesh()), "build");
    const clock::time_point start = clock::now();
    const path_tracer::Light light = path_tracer::trace(bvh, scene, options, threads);
    const double seconds = std::chrono::duration<double>(clock::now() - start).count();
    const float exposure =
        command.exposure > 0 ? static_cast<float>(command.exposure) : exposure_for(light);
    support::Picture picture = exposed(light, options.width, options.height, exposure);
    if (command.beside) {
        const support::PictureSize size{options.width, options.height};
        constexpr int directions = 256;
        const auto plain = occlusion(
            bvh, scene, size,
            nook::TracedOptions<>{.radius = scene.radius, .directions = directions}, threads);
        const auto secondary =
            occlusion(bvh, scene, size,
                      nook::TracedOptions<nook::StepFalloff, nook::SecondaryRays>{
                          .radius = scene.radius, .directions = directions},
                      threads);
        picture = support::strip({plain, secondary, picture},
                                 {"ambient occlusion", "with secondary rays", "light paths"});
    }
    support::write_png(command.file, picture);
    std::printf(
        "%s: %d x %d, %d paths per pixel, %.1f million rays in %.2f s, "
        "exposure %.3g\n",
        command.file.c_str(), options.width, options.height, options.samples,
        static_cast<double>(light.rays) * 1e-6, seconds, double{exposure});
}

}  // namespace

int main(int argc, char** argv)
{
    return support::run_program("nook-path-trace", [&] {
        CommandLine command;
        if (read_command_line(argc, argv, command)) answer(command);
    });
}
