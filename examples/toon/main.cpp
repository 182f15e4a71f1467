// nook-toon: a drawing instead of a photograph. Visibility in a few flat bands, times the colour of the
// surface, with the far sides of outline shells as ink.

#include <cstdio>
#include <filesystem>
#include <map>
#include <string>

#include <CLI/CLI.hpp>

#include <nook/thread_executor.hpp>

#include "../scenes/scenes.hpp"
#include "../support/arguments.hpp"
#include "../support/checked.hpp"
#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/picture.hpp"
#include "../support/program.hpp"
#include "toon.hpp"

namespace {

struct CommandLine {
    std::string scene = "tree";
    std::filesystem::path file = "nook-toon.png";
    support::PictureSize size;
    int threads = 1;
    toon::Options options;
};

constexpr int largest_side = 4096;

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Draws a scene in flat bands of shade, with outlines.\n"
        "The shade is polygonal mutual information or ambient occlusion from viewpoints around\n"
        "the scene, or ambient obscurance from the depth of the picture.",
        "nook-toon"};
    support::set_up(app);
    std::string size = "960x720", file = result.file.string(), shade = "information", views = "642";
    app.add_option("--scene", result.scene, "A built-in scene, or an OBJ file")
        ->type_name("NAME")
        ->capture_default_str();
    app.add_option("--size", size, "Size of the picture in pixels, up to 4096x4096")
        ->type_name("WIDTHxHEIGHT")
        ->capture_default_str();
    const std::map<std::string, toon::Shade> shades{{"information", toon::Shade::information},
                                                    {"views", toon::Shade::views},
                                                    {"alchemy", toon::Shade::alchemy}};
    app.add_option("--shade", shade, "What the bands are cut from: information, views, alchemy")
        ->type_name("NAME")
        ->check(CLI::IsMember(shades))
        ->capture_default_str();
    const std::map<std::string, int> levels{
        {"12", 0}, {"42", 1}, {"162", 2}, {"642", 3}, {"2562", 4}};
    app.add_option("--views", views, "Viewpoints around the scene: 12, 42, 162, 642, 2562")
        ->type_name("N")
        ->check(CLI::IsMember(levels))
        ->capture_default_str();
    app.add_option("--bands", result.options.bands, "Bands of shade")
        ->type_name("N")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    app.add_option("--line", result.options.line,
                   "Width of the outlines at the middle distance, pixels; 0: none")
        ->type_name("W")
        ->capture_default_str();
    support::add_threads(app, result.threads, "Threads; the picture does not depend on them");
    app.add_option("--out", file, "The picture, a name that ends in .png")
        ->type_name("FILE")
        ->capture_default_str();
    if (!support::parse(app, argc, argv)) return false;
    result.size = support::read_picture_size("--size", size);
    if (result.size.width > largest_side || result.size.height > largest_side)
        throw support::Failure{"--size: '" + size + "' is larger than 4096x4096"};
    // Written so that a NaN is refused too.
    if (!(result.options.line >= 0 && result.options.line <= 100))
        throw support::Failure{"--line: 0 to 100 pixels are possible"};
    result.file = file;
    support::check_output_file("--out", result.file);
    if (result.file.extension() != ".png")
        throw support::Failure{"--out: a name that ends in .png is needed"};
    result.options.shade = shades.at(shade);
    result.options.level = levels.at(views);
    return true;
}

}  // namespace

int main(int argc, char** argv)
{
    return support::run_program("nook-toon", [&] {
        CommandLine command;
        if (!read_command_line(argc, argv, command)) return;
        const int width = command.size.width, height = command.size.height;
        const scenes::Scene scene = scenes::load(command.scene, double(width) / height);
        nook::ThreadExecutor threads{command.threads};
        support::write_png(command.file,
                           toon::draw(scene, width, height, command.options, threads));
        std::printf("%s: %zu triangles, %d bands: %s\n", scene.name.c_str(), scene.triangles(),
                    command.options.bands, command.file.string().c_str());
    });
}
