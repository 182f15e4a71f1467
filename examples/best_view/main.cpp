// nook-best-view: from where a mesh shows most (Feixas, Sbert & González 2009).

#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <CLI/CLI.hpp>

#include <nook/scene/viewpoints.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scenes.hpp"
#include "../support/arguments.hpp"
#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/program.hpp"
#include "../support/progress.hpp"
#include "output.hpp"
#include "views.hpp"

namespace best_view {

namespace {

struct CommandLine {
    std::string scene = "tree";
    std::filesystem::path folder = "nook-best-view";
    Task task;
    int size = 320, threads = 1;
};

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Looks at a mesh from all around and finds the views that show most of it: prints them,\n"
        "draws each and all of them on one sheet, and writes views.json.",
        "nook-best-view"};
    support::set_up(app);
    Task& task = result.task;
    std::string folder = result.folder.string(), measure = name_of(task.measure), distance, share,
                back_faces;
    app.add_option("--scene", result.scene, "A built-in scene, or an OBJ file")
        ->type_name("NAME")
        ->capture_default_str();
    app.add_option("--level", task.level, "Viewpoints: 12, 42, 162, 642, 2562, 10242 or 40962")
        ->type_name("0..6")
        ->check(CLI::Range(0, nook::finest_icosphere))
        ->capture_default_str();
    app.add_option("--resolution", task.resolution, "Pixels across the picture of each viewpoint")
        ->type_name("N")
        ->check(CLI::Range(1, 8192))
        ->capture_default_str();
    app.add_option(
           "--measure", measure,
           "greedy: each view beside those before it leaves the least mutual information;\n"
           "vmi: the least viewpoint mutual information; saliency: the most mesh saliency;\n"
           "evmi, greedy-evmi: as vmi and greedy, salient polygons count more")
        ->type_name("NAME")
        ->check(CLI::IsMember({"vmi", "evmi", "saliency", "greedy", "greedy-evmi"}))
        ->capture_default_str();
    app.add_option("--count", task.count, "Views to show at most")
        ->type_name("N")
        ->check(CLI::Range(1, 99))
        ->capture_default_str();
    app.add_option("--share", share,
                   "greedy: stop when this share of the information is left, below 1 [never]")
        ->type_name("SHARE");
    app.add_flag("--above", task.above,
                 "Leave out viewpoints below the horizon: things that stand on the ground");
    app.add_option("--distance", distance,
                   "Of the eyes from the centre, in radii, above 1 [orthographic]")
        ->type_name("RADII");
    app.add_option("--back-faces", back_faces,
                   "counted: as front faces; occluding: only hide; left-out: not drawn\n"
                   "[left-out for closed meshes, otherwise occluding]")
        ->type_name("RULE")
        ->check(CLI::IsMember({"counted", "occluding", "left-out"}));
    app.add_option("--size", result.size, "Pixels across each picture that is shown")
        ->type_name("N")
        ->check(CLI::Range(16, 2048))
        ->capture_default_str();
    support::add_threads(app, result.threads, "Threads; the results do not depend on them");
    app.add_option("--out", folder, "Folder for the pictures and views.json")
        ->type_name("DIR")
        ->capture_default_str();
    if (!support::parse(app, argc, argv)) return false;
    if (folder.empty()) throw support::Failure{"--out: an empty name"};
    result.folder = folder;
    for (const Measure known :
         {Measure::vmi, Measure::evmi, Measure::saliency, Measure::greedy, Measure::greedy_evmi})
        if (measure == name_of(known)) task.measure = known;
    if (app.count("--share") > 0) {
        task.share = support::read_positive("--share", share);
        if (!(task.share < 1)) throw support::Failure{"--share: '" + share + "' is not below 1"};
        if (!is_greedy(task.measure))
            throw support::Failure{"--share: the measure " + measure + " ranks all views"};
    }
    if (app.count("--distance") > 0) {
        task.distance = support::read_positive("--distance", distance);
        if (!(task.distance > 1 && task.distance <= 1e6))
            throw support::Failure{"--distance: '" + distance + "' is not above 1, up to 1e6"};
    }
    if (back_faces == "counted") task.back_faces = nook::BackFaces::counted;
    if (back_faces == "occluding") task.back_faces = nook::BackFaces::occluding;
    if (back_faces == "left-out") task.back_faces = nook::BackFaces::left_out;
    return true;
}

void run(const CommandLine& command)
{
    const scenes::Scene scene = scenes::load(command.scene, 1);
    if (scene.triangles() == 0) throw support::Failure{scene.name + ": has no triangles"};
    for (const char* name : {json_name, sheet_name})
        if (std::error_code ignored; std::filesystem::is_directory(command.folder / name, ignored))
            throw support::Failure{(command.folder / name).string() + ": is a folder"};
    support::prepare_folder(command.folder);
    nook::ThreadExecutor threads{command.threads};
    Views views;
    {
        support::Progress progress;
        views = look(scene, command.task, threads, progress);
        write(command.folder, scene, command.task, views, command.size, threads, progress);
    }
    print(scene, command.task, views);
    std::printf("pictures and views.json: %s\n", command.folder.string().c_str());
    if (std::fflush(stdout) != 0) throw support::Failure{"stdout cannot be written"};
}

}  // namespace

}  // namespace best_view

int main(int argc, char** argv)
{
    return support::run_program("nook-best-view", [&] {
        best_view::CommandLine command;
        if (best_view::read_command_line(argc, argv, command)) best_view::run(command);
    });
}
