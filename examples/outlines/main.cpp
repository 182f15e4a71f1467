// nook-outlines: what it costs and saves to compute ambient occlusion only where outlines overlap
// (Park & Baek 2021, table 1).

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>

#include <nook/scene/outline.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scenes.hpp"
#include "../support/arguments.hpp"
#include "../support/checked.hpp"
#include "../support/command_line.hpp"
#include "../support/files.hpp"
#include "../support/program.hpp"
#include "chart.hpp"
#include "hulls.hpp"
#include "subject.hpp"
#include "table.hpp"

namespace outlines {

namespace {

struct CommandLine {
    std::vector<std::string> scenes;
    std::filesystem::path folder = "nook-outlines";
    Protocol protocol;
    double radius = 0;
    int threads = 1;
};

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Times ambient occlusion with and without the mask of overlapping outlines on scenes "
        "whose\n"
        "camera turns, and the outlines' stand-alone form, with the errors of each; draws the "
        "masks\n"
        "and a chart of where a mask pays.",
        "nook-outlines"};
    support::set_up(app);
    Protocol& protocol = result.protocol;
    std::string size = std::to_string(protocol.width) + "x" + std::to_string(protocol.height);
    std::string folder = result.folder.string(), radius;
    app.add_option("--scene", result.scenes,
                   "A built-in scene, or an OBJ file [temple, city and corridor]")
        ->type_name("NAME")
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--size", size, "Size of each picture in pixels")
        ->type_name("WIDTHxHEIGHT")
        ->capture_default_str();
    app.add_option("--frames", protocol.frames, "Frames of a full turn of the camera")
        ->type_name("N")
        ->check(CLI::Range(1, 3600))
        ->capture_default_str();
    app.add_option("--rays", protocol.rays, "Rays per pixel of the traced reference")
        ->type_name("N")
        ->check(CLI::Range(1, 65536))
        ->capture_default_str();
    app.add_option("--radius", radius, "How far occlusion reaches, world units [the scene's]")
        ->type_name("R");
    support::add_threads(app, result.threads, "Threads of the references; the rest takes one");
    app.add_option("--out", folder, "Folder for the pictures and outlines.json")
        ->type_name("DIR")
        ->capture_default_str();
    if (!support::parse(app, argc, argv)) return false;
    if (folder.empty()) throw support::Failure{"--out: an empty name"};
    result.folder = folder;
    if (app.count("--radius") > 0) result.radius = support::read_positive("--radius", radius);
    const support::PictureSize picture = support::read_picture_size("--size", size);
    protocol.width = picture.width;
    protocol.height = picture.height;
    if (result.scenes.empty()) result.scenes = {"temple", "city", "corridor"};
    return true;
}

nook::OutlineShell built(const scenes::Scene& scene, const nook::OutlineOptions& options)
{
    nook::OutlineShell shell;
    support::checked(shell.build(scene.mesh(), options), "OutlineShell::build");
    return shell;
}

void run(const CommandLine& command)
{
    const Protocol& protocol = command.protocol;
    std::vector<Subject> subjects;
    for (const std::string& name : command.scenes) {
        Subject subject;
        subject.scene = scenes::load(name, double(protocol.width) / protocol.height);
        subject.radius = command.radius > 0 ? command.radius : subject.scene.radius;
        subjects.push_back(std::move(subject));
    }
    const std::filesystem::path json = command.folder / "outlines.json";
    if (std::error_code ignored; std::filesystem::is_directory(json, ignored))
        throw support::Failure{json.string() + ": is a folder"};
    support::prepare_folder(command.folder);
    nook::ThreadExecutor threads{command.threads};
    nlohmann::ordered_json tables = nlohmann::ordered_json::array(), chart;
    std::size_t largest = 0;
    for (Subject& subject : subjects) {
        const auto add = [&](const char* name, const nook::OutlineShell& shell, double extent) {
            const Table table = measure(subject, name, shell, extent, protocol, command.folder,
                                        subject.scene.name + "-" + name, threads);
            print(table);
            tables.push_back(json_of(table));
        };
        const nook::OutlineShell mitre = built(subject.scene, {});
        subject.room = mitre.inward_count() > 0;
        // Where no extent is enough the radius is what everyone takes.
        const auto wide_enough = [&](const nook::OutlineShell& shell) {
            const double extent = shell.needed_extent(subject.radius);
            return extent <= 4 * subject.radius ? extent : subject.radius;
        };
        const double extent = wide_enough(mitre);
        add("mitre", mitre, extent);
        add("mitre-half", mitre, extent / 2);
        add("mitre-quarter", mitre, extent / 4);
        using Method = nook::OutlineMethod;
        add("integrated", built(subject.scene, {.method = Method::integrated_normals}), extent);
        add("concave-left-out", built(subject.scene, {.skip_concave = true}), extent);
        add_hulls(subject, protocol, command.folder, threads, tables);
        largest = (std::max)(largest, mitre.view().triangle_count);
    }
    // The chart takes the scene with the most triangles; a few are no chart.
    if (largest <= 1000) subjects.clear();
    for (const Subject& subject : subjects) {
        const nook::OutlineShell mitre = built(subject.scene, {});
        if (mitre.view().triangle_count != largest) continue;
        chart = break_even(subject, mitre, subject.radius, protocol, command.folder, threads);
        break;
    }
    support::write_file(
        command.folder / "outlines.json",
        nlohmann::ordered_json{{"tables", tables}, {"break_even", chart}}.dump(2) + '\n');
    std::printf("pictures and outlines.json: %s\n", command.folder.string().c_str());
    if (std::fflush(stdout) != 0) throw support::Failure{"stdout cannot be written"};
}

}  // namespace

}  // namespace outlines

int main(int argc, char** argv)
{
    return support::run_program("nook-outlines", [&] {
        outlines::CommandLine command;
        if (outlines::read_command_line(argc, argv, command)) outlines::run(command);
    });
}
