// nook-obscurance: what comes out of the rays of ambient occlusion besides: obscurances with colour
// bleeding, bent normals, and pictures without the false highlights under curtains.

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scenes.hpp"
#include "../support/arguments.hpp"
#include "../support/checked.hpp"
#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/picture.hpp"
#include "../support/program.hpp"

namespace {

using support::Picture;
using support::Rgb;

struct CommandLine {
    std::string scene = "arcade";
    std::filesystem::path folder = "nook-obscurance";
    support::PictureSize size;
    int directions = 128, threads = 1;
    double radius = 0, secondary = 0.5, sigma = 2;
};

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Draws ambient occlusion without and with secondary rays, obscurance with colour\n"
        "bleeding and bent normals of a scene, and prints what each costs.",
        "nook-obscurance"};
    support::set_up(app);
    std::string size = "960x540", folder = result.folder.string(), radius, secondary = "0.5",
                sigma = "2";
    app.add_option("--scene", result.scene, "A built-in scene, or an OBJ file")
        ->type_name("NAME")
        ->capture_default_str();
    app.add_option("--size", size, "Size of each picture in pixels")
        ->type_name("WIDTHxHEIGHT")
        ->capture_default_str();
    app.add_option("--directions", result.directions, "Primary rays per pixel")
        ->type_name("N")
        ->check(CLI::Range(1, 65536))
        ->capture_default_str();
    app.add_option("--radius", radius, "How far occlusion reaches, world units [the scene's]")
        ->type_name("R");
    app.add_option("--secondary", secondary, "Radius of the secondary rays, as a share of R")
        ->type_name("SHARE")
        ->capture_default_str();
    app.add_option("--sigma", sigma, "Falloff of obscurance: 1 - exp(-S d / R) at a distance d")
        ->type_name("S")
        ->capture_default_str();
    support::add_threads(app, result.threads, "Threads; the pictures do not depend on them");
    app.add_option("--out", folder, "Folder for the pictures; files of an earlier run are replaced")
        ->type_name("DIR")
        ->capture_default_str();
    if (!support::parse(app, argc, argv)) return false;
    if (folder.empty()) throw support::Failure{"--out: an empty name"};
    result.folder = folder;
    if (app.count("--radius") > 0) result.radius = support::read_positive("--radius", radius);
    result.secondary = support::read_positive("--secondary", secondary);
    result.sigma = support::read_positive("--sigma", sigma);
    result.size = support::read_picture_size("--size", size);
    return true;
}

/// Three channels that own their pixels, side by side.
struct Image3 {
    nook::Image<float> values;

    Image3(int width, int height) : values{3 * width, height} {}
    [[nodiscard]] nook::ImageView3<float> view()
    {
        return nook::ImageView3<float>::interleaved(values.data(), values.width() / 3,
                                                    values.height(), values.width());
    }
    [[nodiscard]] Rgb operator()(int x, int y) const
    {
        return {values(3 * x, y), values(3 * x + 1, y), values(3 * x + 2, y)};
    }
};

/// A scene as its camera sees it, ready for rays.
struct View {
    nook::Projection projection;
    nook::ViewFrame frame;
    nook::Image<float> depth;
    Image3 normals;
    nook::Image<std::uint32_t> faces;
    nook::Bvh bvh;

    View(const scenes::Scene& scene, int width, int height, nook::ThreadExecutor& threads)
        : projection{nook::projection(scene.camera, width, height)},
          frame{nook::view_frame(scene.camera)},
          depth{width, height},
          normals{width, height},
          faces{width, height}
    {
        support::checked(nook::rasterise(scene.mesh(), frame, projection,
                                         {depth.view(), normals.view(), faces.view()}, {},
                                         nook::HeapScratch{}, threads),
                         "rasterise");
        support::checked(bvh.build(scene.mesh()), "Bvh::build");
    }
};

template <class PixelColour>
Picture picture_of(const View& view, PixelColour&& colour)
{
    Picture picture{view.depth.width(), view.depth.height()};
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            if (view.faces(x, y) != nook::no_face) picture.set(x, y, colour(x, y));
    return picture;
}

void draw(const CommandLine& command)
{
    const auto [width, height] = command.size;
    const scenes::Scene scene = scenes::load(command.scene, double(width) / height);
    const double radius = command.radius > 0 ? command.radius : scene.radius;
    const double reach =
        (std::min)(command.secondary * radius, (std::numeric_limits<double>::max)());
    std::vector<float> albedo;
    for (std::size_t face = 0; face < scene.triangles(); ++face) {
        const Rgb colour = scene.albedo.empty() ? Rgb{0.7f, 0.7f, 0.7f} : scene.albedo[face];
        albedo.insert(albedo.end(), {colour.r, colour.g, colour.b});
    }
    if (albedo.empty()) albedo.resize(3);  // there must be something to point at
    support::prepare_folder(command.folder);
    nook::ThreadExecutor threads{command.threads};
    View view{scene, width, height, threads};
    const nook::ImageView3<const float> normals = view.normals.view();
    const nook::SourceFaces faces{view.faces.view(), scene.mesh()};

    std::printf("%s, %d x %d, %d directions, radius %g, %d threads\n", scene.name.c_str(), width,
                height, command.directions, radius, command.threads);
    std::printf("%-34s %10s %14s %14s\n", "", "ms", "rays", "rays skipped");
    const auto run = [&](const char* name, const auto& output, const auto& options) {
        using clock = std::chrono::steady_clock;
        const clock::time_point start = clock::now();
        const nook::Work work = support::checked(
            nook::traced_ao(view.bvh, view.depth.view(), normals, faces, output, options,
                            view.projection, view.frame, {}, nook::HeapScratch{}, threads),
            "traced_ao");
        const std::chrono::duration<double, std::milli> time = clock::now() - start;
        std::printf("%-34s %10.1f %14llu %14llu\n", name, time.count(),
                    static_cast<unsigned long long>(work.rays),
                    static_cast<unsigned long long>(work.skipped_rays));
        std::fflush(stdout);
    };

    // Without and with secondary rays.
    const auto grey = [&](const nook::Image<float>& visibility) {
        return picture_of(view, [&](int x, int y) { return Rgb{1, 1, 1} * visibility(x, y); });
    };
    nook::Image<float> plain{width, height}, secondary{width, height}, obscurance{width, height};
    run("ambient occlusion", plain.view(),
        nook::TracedOptions<>{.radius = radius, .directions = command.directions});
    run("... with secondary rays", secondary.view(),
        nook::TracedOptions<nook::StepFalloff, nook::SecondaryRays>{
            .radius = radius, .directions = command.directions, .secondary = {.radius = reach}});
    support::write_png(command.folder / "secondary.png",
                       support::strip({grey(plain), grey(secondary)},
                                      {"ambient occlusion", "with secondary rays"}));

    // Obscurance: openness grows with the distance of a hit, and what is hit gives its colour.
    const nook::ExponentialFalloff falloff{command.sigma / radius};
    Image3 bent{width, height}, bleeding{width, height};
    run("obscurance, exponential falloff", obscurance.view(),
        nook::TracedOptions<nook::ExponentialFalloff>{
            .radius = radius, .directions = command.directions, .falloff = falloff});
    const nook::TracedOptions<nook::ExponentialFalloff, nook::SecondaryRays, nook::FaceAlbedo>
        coloured{.radius = radius,
                 .directions = command.directions,
                 .falloff = falloff,
                 .secondary = {.radius = reach},
                 .colour = {albedo.data()}};
    run("... secondary, bleeding, bent",
        nook::TracedImages{obscurance.view(), bent.view(), bleeding.view()}, coloured);

    // Under a white sky a surface reflects its albedo times what is open, and times what the
    // occluders near it send.
    const auto lit = [&](bool coloured_light) {
        return picture_of(view, [&](int x, int y) {
            const float* const at = albedo.data() + 3 * std::size_t{view.faces(x, y)};
            const Rgb own{at[0], at[1], at[2]};
            const Rgb sky = Rgb{1, 1, 1} * obscurance(x, y);
            return support::srgb(own * (coloured_light ? sky + bleeding(x, y) : sky));
        });
    };
    support::write_png(
        command.folder / "bleeding.png",
        support::strip({lit(false), lit(true)}, {"obscurance, light of the sky alone",
                                                 "with the light of nearby occluders"}));
    support::write_png(command.folder / "obscurance.png", grey(obscurance));
    support::write_png(command.folder / "bent_normals.png", picture_of(view, [&](int x, int y) {
                           return Rgb{0.5f, 0.5f, 0.5f} + bent(x, y) * 0.5f;
                       }));
    std::printf("pictures: %s\n", command.folder.string().c_str());
}

}  // namespace

int main(int argc, char** argv)
{
    return support::run_program("nook-obscurance", [&] {
        CommandLine command;
        if (read_command_line(argc, argv, command)) draw(command);
    });
}
