// nook-report: every kernel on every scene, with its error, its run time and its pictures.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include <nook/version.hpp>

#include "../scenes/scenes.hpp"
#include "../stability/stability.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/machine.hpp"
#include "../support/obj_file.hpp"
#include "../support/program.hpp"
#include "../support/progress.hpp"
#include "calibration.hpp"
#include "cell.hpp"
#include "comparison.hpp"
#include "document.hpp"
#include "options.hpp"
#include "schedule.hpp"
#include "store.hpp"
#include "structures.hpp"
#include "subject.hpp"
#include "view.hpp"

namespace report {

namespace {

/// What is written beside the folder of the cells.
constexpr const char *json_name = "report.json", *csv_name = "report.csv",
                     *page_name = "index.html", *cells_name = "cells";
/// Parts of a run that belong to no scene, beside the cells.
constexpr const char *stability_name = "stability", *calibration_name = "calibration";

/// A name for a folder out of the name of a file: letters, digits, dots, dashes and underscores.
std::string folder_name(const std::filesystem::path& file)
{
    std::string name = file.stem().string();
    for (char& c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                           (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '_';
        if (!plain) c = '_';
    }
    // Endings are added to it, and file systems have their limits.
    constexpr std::size_t longest = 100;
    if (name.size() > longest) name.resize(longest);
    return name.empty() || name.front() == '.' ? "mesh" + name : name;
}

Subject load(const std::string& file, const Options& options)
{
    support::ObjMesh mesh = support::read_obj(file);
    Subject subject;
    subject.dropped = mesh.dropped;
    subject.what = "a mesh from a file";
    subject.alone = true;
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
        bool wanted = options.whole();
        for (const std::string& name : options.scenes) wanted = wanted || name == entry.name;
        if (wanted)
            subjects.push_back(
                {entry.make(), entry.what, 0, entry.figures, entry.alone, entry.thin});
    }
    std::set<std::string> taken{stability_name, calibration_name};
    for (Subject& subject : subjects) {
        scenes::Scene& scene = subject.scene;
        const std::string name = scene.name;
        for (int number = 2; !taken.insert(scene.name).second; ++number)
            scene.name = name + '-' + std::to_string(number);
        scene.camera = checked_camera(scene, options);
    }
    return subjects;
}

/// A scene at its radii.
std::vector<Cell> cells_of(const std::vector<Subject>& subjects, const Options& options)
{
    constexpr double unlimited = std::numeric_limits<double>::infinity();
    std::vector<Cell> cells;
    std::set<std::string> taken{stability_name, calibration_name};
    for (const Subject& subject : subjects) taken.insert(subject.scene.name);
    for (const Subject& subject : subjects) {
        const std::string& name = subject.scene.name;
        const double usual = subject.scene.radius;
        const auto add = [&](const char* ending, double factor) {
            std::string id = name + ending;
            for (int number = 2; !taken.insert(id).second; ++number)
                id = name + ending + '-' + std::to_string(number);
            cells.push_back({id, &subject, usual * factor, factor, false});
        };
        const double radius = options.radius.value_or(usual);
        constexpr double most = std::numeric_limits<double>::max();
        cells.push_back({name, &subject, radius, std::min(radius / usual, most), true});
        if (!options.radius && !options.quick && subject.scene.triangles() > 0) {
            add("-half", 0.5);
            add("-double", 2);
        }
        if (!options.radius && subject.alone) add("-unlimited", unlimited);
    }
    return cells;
}

/// Refuses what stands in the way of folders and files before there are results to lose.
void check_output(const Options& options, const std::vector<Cell>& cells)
{
    namespace fs = std::filesystem;
    std::error_code ignored;
    for (const char* name : {json_name, csv_name, page_name})
        if (const fs::path file = options.folder / name; fs::is_directory(file, ignored))
            throw support::Failure{file.string() + ": is a folder"};
    const auto check_folder = [&](const fs::path& folder) {
        const fs::file_status status = fs::status(folder, ignored);
        if (fs::exists(status) && !fs::is_directory(status))
            throw support::Failure{folder.string() + ": is not a folder"};
    };
    check_folder(options.folder / cells_name);
    for (const Cell& cell : cells) check_folder(options.folder / cells_name / cell.id);
}

/// What tells runs apart whose results are not the same.
Json key_of(const Options& options)
{
    Json key;
    key["format"] = format;
    key["quick"] = options.quick;
    key["size"] = {options.width, options.height};
    key["directions"] = options.directions;
    key["threads"] = options.threads;
    key["cpu"] = support::cpu_name();
    return key;
}

Json input_of(const Cell& cell)
{
    const scenes::Scene& scene = cell.subject->scene;
    Json input;
    input["positions"] =
        digest(scene.positions.data(), scene.positions.size() * sizeof(scene.positions[0]));
    input["indices"] =
        digest(scene.indices.data(), scene.indices.size() * sizeof(scene.indices[0]));
    input["radius"] = cell.unlimited() ? Json(nullptr) : Json(cell.radius);
    input["principal"] = cell.principal;
    const Subject& subject = *cell.subject;
    input["subject"] = {subject.what, subject.dropped, subject.figures, subject.alone,
                        subject.thin};
    input["camera"] = camera_of(cell);
    return input;
}

/// What is known of a report before it is measured.
Json outline_of(const std::vector<Cell>& cells, const Options& options)
{
    Json report;
    report["format"] = format;
    report["run"] = {{"quick", options.quick},
                     {"width", options.width},
                     {"height", options.height},
                     {"directions", options.directions}};
    report["cells"] = Json::array();
    for (const Cell& cell : cells)
        report["cells"].push_back({{"id", cell.id},
                                   {"triangles", cell.subject->scene.triangles()},
                                   {"camera", camera_of(cell)},
                                   {"radius", cell.unlimited() ? Json(nullptr) : Json(cell.radius)},
                                   {"references", Json::array()},
                                   {"results", Json::array()}});
    return report;
}

/// Text as JSON; what is not UTF-8 in a name is replaced.
std::string text_of(const Json& json)
{
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

/// The run itself: what was kept, or else measured and kept.
class Experiment {
public:
    Experiment(const Options& options, const std::vector<Subject>& subjects,
               const std::vector<Cell>& cells)
        : options_{options},
          cells_{cells},
          threads_{options.threads},
          store_{options.folder / cells_name, key_of(options)},
          schedule_{options}
    {
        for (const Subject& subject : subjects)
            structures_.push_back(std::make_unique<Structures>(subject.scene, threads_));
    }

    [[nodiscard]] Json run()
    {
        plan();
        Json report;
        report["format"] = format;
        report["nook"] = nook::version;
        report["machine"] = {{"cpu", support::cpu_name()},
                             {"compiler", support::compiler_name()},
                             {"threads", options_.threads}};
        report["run"] = {{"command", options_.command},
                         {"quick", options_.quick},
                         {"width", options_.width},
                         {"height", options_.height},
                         {"directions", options_.directions}};
        report["kernels"] = Json::array();
        for (const KernelInfo& info : kernel_infos())
            report["kernels"].push_back({{"name", info.name},
                                         {"family", info.family},
                                         {"what", info.what},
                                         {"source", info.source},
                                         {"needs", info.needs},
                                         {"estimates", info.estimates},
                                         {"comparable", info.comparable}});
        report["cells"] = Json::array();
        report["stability"] = stability::json_of({});
        report["calibration"] = nullptr;
        double seconds = 0;
        for (Part& part : parts_) {
            if (!part.kept) measure(part);
            seconds += double{part.kept->at("seconds")};
            Json& measured = part.kept->at("measured");
            if (part.name == stability_name) report["stability"] = std::move(measured);
            else if (part.name == calibration_name) report["calibration"] = std::move(measured);
            else report["cells"].push_back(std::move(measured));
        }
        progress_.clear();
        report["run"]["seconds"] = seconds;
        return report;
    }

private:
    using Clock = std::chrono::steady_clock;

    struct Part {
        std::string name;
        Json input;
        const Cell* cell;  ///< null for one that belongs to no scene
        double seconds;    ///< that it should take
        std::optional<Json> kept;
    };

    static double seconds_since(Clock::time_point start)
    {
        return std::chrono::duration<double>(Clock::now() - start).count();
    }
    Structures& structures_of(const Cell& cell)
    {
        for (const auto& structures : structures_)
            if (&structures->scene() == &cell.subject->scene) return *structures;
        throw support::Failure{cell.id + ": a cell of no scene"};
    }

    /// Nothing of it is gone.
    [[nodiscard]] bool is_whole(const Part& part) const
    {
        if (!part.kept->contains("seconds") || !part.kept->contains("measured")) return false;
        if (part.cell == nullptr) return true;
        const Json& cell = part.kept->at("measured");
        if (!cell.is_object() || !cell.contains("results")) return false;
        std::error_code ignored;
        const auto is_there = [&](const Json& name) {
            return std::filesystem::exists(store_.folder(part.name) / (std::string{name} + ".jpg"),
                                           ignored);
        };
        for (const Json& result : cell.at("results")) {
            if (!is_there(result.at("id"))) return false;
            const Json& plan = result.at("plan");
            if (!plan.is_null() && !plan.at("picture").is_null() && !is_there(plan.at("picture")))
                return false;
        }
        return true;
    }

    void plan()
    {
        progress_.step("looking at the scenes");
        for (const Cell& cell : cells_) parts_.push_back({cell.id, input_of(cell), &cell, 0, {}});
        if (options_.whole()) {
            parts_.push_back({stability_name, nullptr, nullptr, 8, {}});
            parts_.push_back(
                {calibration_name, nullptr, nullptr, options_.quick ? 8.0 : 150.0, {}});
        }
        std::size_t kept = 0;
        for (Part& part : parts_) {
            part.kept = store_.find(part.name, part.input);
            if (part.kept && !is_whole(part)) part.kept.reset();
            kept += part.kept ? 1 : 0;
            if (part.kept) continue;
            if (part.cell != nullptr)
                part.seconds =
                    schedule_.seconds_of(*part.cell, structures_of(*part.cell), threads_);
            schedule_.add(part.seconds);
        }
        progress_.clear();
        std::cout << structures_.size() << (structures_.size() == 1 ? " scene, " : " scenes, ")
                  << parts_.size() << (parts_.size() == 1 ? " part" : " parts");
        if (kept > 0) std::cout << ", " << kept << " of them measured before";
        if (kept < parts_.size()) std::cout << ": about " << duration(schedule_.left());
        std::cout << '\n' << std::flush;
    }

    void measure(Part& part)
    {
        const auto start = Clock::now();
        const auto number = &part - parts_.data() + 1;
        progress_.scene(static_cast<int>(number), static_cast<int>(parts_.size()),
                        part.name + " (" + duration(schedule_.left()) + " left)");
        store_.drop(part.name);
        Json measured;
        if (part.cell != nullptr) {
            measured = report::measure(*part.cell, options_, structures_of(*part.cell), threads_,
                                       store_.folder(part.name), progress_);
        } else if (part.name == stability_name) {
            progress_.step("extreme inputs");
            measured = stability::json_of(stability::run());
        } else {
            measured = calibrate(options_.quick, threads_, progress_);
        }
        part.kept = Json{{"seconds", seconds_since(start)}, {"measured", std::move(measured)}};
        store_.keep(part.name, part.input, *part.kept);
        schedule_.done(part.seconds, seconds_since(start));
    }

    const Options& options_;
    const std::vector<Cell>& cells_;
    nook::ThreadExecutor threads_;
    Store store_;
    Schedule schedule_;
    support::Progress progress_;
    std::vector<std::unique_ptr<Structures>> structures_;
    std::vector<Part> parts_;
};

/// Returns the status to exit with.
int run_all(const Options& options)
{
    const std::vector<Subject> subjects = subjects_of(options);
    const std::vector<Cell> cells = cells_of(subjects, options);
    // Read before the long run, and before a run that writes to its folder.
    Json earlier;
    if (options.compare) {
        earlier = load_report(*options.compare);
        check_old_report(earlier, outline_of(cells, options), options.compare->string());
    }
    check_output(options, cells);
    support::prepare_folder(options.folder);
    support::prepare_folder(options.folder / cells_name);

    const Json report = Experiment{options, subjects, cells}.run();
    support::write_file(options.folder / csv_name, csv_of(report));
    support::write_file(options.folder / page_name, page_of(report, options.folder / cells_name));
    support::write_file(options.folder / json_name, text_of(report));
    print_table(std::cout, report);
    std::cout << "page, report.json and report.csv: " << options.folder.string() << '\n';
    int status = 0;
    if (options.compare) {
        const Comparison comparison =
            compare(earlier, report, options.tolerances, options.compare->string());
        print(std::cout, comparison, options.tolerances);
        status = comparison.worse.empty() ? 0 : 1;
    }
    if (!std::cout.flush()) throw support::Failure{"the table cannot be written to stdout"};
    return status;
}

}  // namespace

}  // namespace report

int main(int argc, char** argv)
{
    int status = 0;
    const int failed = support::run_program("nook-report", [&] {
        report::Options options;
        if (report::read_options(argc, argv, options)) status = report::run_all(options);
    });
    return failed != 0 ? failed : status;
}
