// nook-report: every kernel on every scene, with its error, its run time and its pictures.

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>
#include <vector>

#include "../scenes/scenes.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/obj_file.hpp"
#include "../support/program.hpp"
#include "../support/progress.hpp"
#include "kernels.hpp"
#include "options.hpp"
#include "output.hpp"
#include "pictures.hpp"
#include "reference.hpp"
#include "view.hpp"

namespace report {

namespace {

/// What is written beside the folders of the scenes.
constexpr const char* json_name = "report.json";

/// A scene, and what is not part of it.
struct Subject {
    scenes::Scene scene;
    std::size_t dropped = 0;  ///< triangles of its file that were no good
    bool figures = false;     ///< figures 2 and 4 are drawn too
};

/// A name for a folder out of the name of a file: letters, digits, dots, dashes and underscores.
std::string folder_name(const std::filesystem::path& file)
{
    std::string name = file.stem().string();
    for (char& c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                           (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '_';
        if (!plain) c = '_';
    }
    return name.empty() || name.front() == '.' ? "mesh" + name : name;
}

Subject load(const std::string& file, const Options& options)
{
    support::ObjMesh mesh = support::read_obj(file);
    Subject subject;
    subject.dropped = mesh.dropped;
    scenes::Scene& scene = subject.scene;
    scene.name = folder_name(file);
    scene.positions = std::move(mesh.positions);
    scene.indices = std::move(mesh.indices);
    scene.camera = scenes::three_quarter_view(scene, double(options.width) / options.height,
                                              options.orthographic);
    scene.radius = scenes::default_radius(scene);
    return subject;
}

/// Everything is read, every scene has a name of its own, and every camera has been checked, before
/// the first file is written.
std::vector<Subject> subjects_of(const Options& options)
{
    std::vector<Subject> subjects;
    for (const std::string& mesh : options.meshes) subjects.push_back(load(mesh, options));
    for (const scenes::Entry& entry : scenes::all()) {
        bool wanted = options.meshes.empty() && options.scenes.empty();
        for (const std::string& name : options.scenes) wanted = wanted || name == entry.name;
        if (wanted) subjects.push_back({entry.make(), 0, entry.figures});
    }
    for (std::size_t i = 0; i < subjects.size(); ++i) {
        scenes::Scene& scene = subjects[i].scene;
        const auto taken = [&](const std::string& name) {
            bool found = name == json_name;
            for (std::size_t j = 0; j < i; ++j) found = found || name == subjects[j].scene.name;
            return found;
        };
        const std::string name = scene.name;
        for (int number = 2; taken(scene.name); ++number)
            scene.name = name + '-' + std::to_string(number);
        scene.camera = checked_camera(scene, options);
    }
    return subjects;
}

/// Refuses what stands in the way of folders and files before there are results to lose.
void check_output(const Options& options, const std::vector<Subject>& subjects)
{
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::path json = options.folder / json_name;
    if (fs::is_directory(json, ignored)) throw support::Failure{json.string() + ": is a folder"};
    for (const Subject& subject : subjects) {
        const fs::path folder = options.folder / subject.scene.name;
        const fs::file_status status = fs::status(folder, ignored);
        if (fs::exists(status) && !fs::is_directory(status))
            throw support::Failure{folder.string() + ": is not a folder"};
    }
}

SceneReport run(const Subject& subject, const Options& options, nook::ThreadExecutor& threads,
                support::Progress& progress)
{
    const scenes::Scene& scene = subject.scene;
    const double radius = options.radius.value_or(scene.radius);
    progress.step("drawing");
    const View view = draw(scene, options, threads);
    const Reference reference = trace(scene, view, radius, options.rays, threads, progress);
    const std::vector<Result> results =
        measure(view, reference, kernels_for(view, radius), threads, progress);

    progress.step("writing the pictures");
    const std::filesystem::path folder = options.folder / scene.name;
    support::prepare_folder(folder);
    write_pictures(folder, scene, view, reference, results);
    if (subject.figures) write_figures(folder, view, radius, threads);

    SceneReport summary;
    summary.name = scene.name;
    summary.triangles = scene.triangles();
    summary.dropped = subject.dropped + reference.dropped;
    summary.width = view.width();
    summary.height = view.height();
    summary.background_share =
        double(view.background) / (double(view.width()) * double(view.height()));
    summary.orthographic = view.projection.orthographic;
    summary.rays = reference.rays;
    summary.radius = reference.radius;
    summary.reference_seconds = reference.seconds;
    summary.build_seconds = reference.build_seconds;
    summary.standard_error = reference.standard_error;
    summary.rays_traced = reference.rays_traced;
    summary.rays_skipped = reference.rays_skipped;
    summary.slices = reference.slices;
    summary.height_field_step = reference.height_field_step;
    summary.height_field_seconds = reference.height_field_seconds;
    summary.unknown = reference.unknown;
    const Result *separable = nullptr, *exact = nullptr;
    for (const Result& result : results) {
        summary.rows.push_back({result.kernel.name, result.kernel.brief, result.kernel.parameters,
                                result.timings, result.kernel.row_step, result.error, result.ssim,
                                result.height_field, result.exact, result.work});
        if (result.kernel.name == "chebyshev-range") separable = &result;
        if (result.kernel.name == "chebyshev-range-exact") exact = &result;
    }
    if (separable != nullptr && exact != nullptr)
        summary.range_checks = difference(*separable, *exact);
    return summary;
}

void run_all(const Options& options)
{
    const std::vector<Subject> subjects = subjects_of(options);
    check_output(options, subjects);
    nook::ThreadExecutor threads{options.threads};
    support::prepare_folder(options.folder);
    std::vector<SceneReport> reports;
    std::vector<stability::Family> families;
    {
        support::Progress progress;
        for (std::size_t i = 0; i < subjects.size(); ++i) {
            progress.scene(int(i + 1), int(subjects.size()), subjects[i].scene.name);
            reports.push_back(run(subjects[i], options, threads, progress));
        }
        progress.step("extreme inputs");
        families = stability::run();
    }
    support::write_file(options.folder / json_name,
                        json_of(reports, families, options).dump(2) + '\n');
    print_table(std::cout, reports);
    std::cout << "pictures and report.json: " << options.folder.string() << '\n';
    if (!std::cout.flush()) throw support::Failure{"the table cannot be written to stdout"};
}

}  // namespace

}  // namespace report

int main(int argc, char** argv)
{
    return support::run_program("nook-report", [&] {
        report::Options options;
        if (report::read_options(argc, argv, options)) report::run_all(options);
    });
}
