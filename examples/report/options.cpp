#include "options.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <iostream>
#include <limits>
#include <numbers>
#include <string_view>
#include <thread>

#include <CLI/CLI.hpp>

#include "../scenes/scenes.hpp"
#include "../support/checked.hpp"
#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "view.hpp"

namespace report {

namespace {

constexpr int largest_side = 32768, largest_directions = 65536, largest_threads = 1024;
constexpr long long largest_picture = 1ll << 26;

std::string in_quotes(std::string_view text)
{
    std::string result = "'";
    for (const char c : text.substr(0, 60)) result += c >= ' ' && c <= '~' ? c : '?';
    return result + (text.size() > 60 ? "...'" : "'");
}

[[noreturn]] void fail(const char* option, const std::string& why)
{
    throw support::Failure{std::string{option} + ": " + why};
}

double number(const char* option, std::string_view text)
{
    double value = 0;
    const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc{} || end != digits.data() + digits.size() || digits.empty())
        fail(option, in_quotes(text) + " is not a number");
    if (!std::isfinite(value)) fail(option, in_quotes(text) + " is not a finite number");
    return value;
}

int count(const char* option, std::string_view text, int least, int largest)
{
    long long value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::invalid_argument || end != text.data() + text.size() || text.empty())
        fail(option, in_quotes(text) + " is not a whole number");
    if (error != std::errc{} || value < least || value > largest)
        fail(option, std::string{text.substr(0, 60)} + " is not a number from " +
                         std::to_string(least) + " to " + std::to_string(largest));
    return static_cast<int>(value);
}

void read_size(const std::string& text, Options& options)
{
    constexpr const char* option = "--size";
    const std::size_t cross = text.find('x');
    if (cross == std::string::npos)
        fail(option, in_quotes(text) + " is not WIDTHxHEIGHT, for example 960x540");
    const std::string_view view{text};
    options.width = count(option, view.substr(0, cross), 1, largest_side);
    options.height = count(option, view.substr(cross + 1), 1, largest_side);
    if (static_cast<long long>(options.width) * options.height > largest_picture)
        fail(option, text + " is more than " + std::to_string(largest_picture) + " pixels");
}

nook::Camera read_camera(const std::string& text)
{
    constexpr const char* option = "--camera";
    std::array<double, 7> values{0, 0, 0, 0, 0, 0, 45};
    std::size_t used = 0;
    for (std::string_view rest = text;;) {
        const std::size_t comma = rest.find(',');
        if (used == values.size()) fail(option, "more than seven numbers");
        values[used++] = number(option, rest.substr(0, comma));
        if (comma == std::string_view::npos) break;
        rest.remove_prefix(comma + 1);
    }
    if (used < 6) fail(option, in_quotes(text) + " is not EX,EY,EZ,TX,TY,TZ[,FOV]");
    if (!(values[6] > 0 && values[6] < 180))
        fail(option, "the angle of view is not between 0 and 180 degrees");
    nook::Camera camera;
    camera.eye = {values[0], values[1], values[2]};
    camera.target = {values[3], values[4], values[5]};
    camera.vertical_fov = values[6] * std::numbers::pi / 180;
    if (const nook::Error error = nook::check_camera(camera)) fail(option, support::text_of(error));
    return camera;
}

void check_scene(const std::string& name)
{
    std::string known;
    for (const scenes::Entry& entry : scenes::all()) {
        if (name == entry.name) return;
        known += (known.empty() ? "" : ", ") + std::string{entry.name};
    }
    fail("--scene", in_quotes(name) + " is none of " + known);
}

void list_scenes()
{
    for (const scenes::Entry& entry : scenes::all())
        std::cout << std::left << std::setw(10) << entry.name << entry.what << '\n';
}

/// As a shell would take it.
std::string command_of(int argc, const char* const* argv)
{
    std::string command = "nook-report";
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const bool plain =
            !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
                return std::isalnum(c) != 0 ||
                       std::string_view{"-_./,:+="}.find(char(c)) != std::string_view::npos;
            });
        command += ' ';
        if (plain) {
            command += word;
            continue;
        }
        command += '\'';
        for (const char c : word) command += c == '\'' ? std::string{"'\\''"} : std::string{c};
        command += '\'';
    }
    return command;
}

std::string plain(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return text;
}

}  // namespace

bool read_options(int argc, const char* const* argv, Options& options)
{
    options.threads =
        std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, largest_threads);
    options.command = command_of(argc, argv);

    CLI::App app{
        "Measures every kernel of nook on meshes or the built-in scenes: error against\n"
        "references, run time, memory. y is up. Writes a page with plots, pictures and tables,\n"
        "report.json and report.csv to a folder, and prints a table. An interrupted run is taken\n"
        "up by the same command.",
        "nook-report"};
    support::set_up(app);
    const Options full;
    std::string size = "640x360", camera, radius, rays = std::to_string(full.directions),
                threads = std::to_string(options.threads), folder = options.folder.string(),
                compare, error_tolerance = plain(full.tolerances.error),
                time_tolerance = plain(full.tolerances.time);
    bool list = false;
    app.add_option("mesh", options.meshes, "OBJ files; without any, all built-in scenes")
        ->type_name("FILE")
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--scene", options.scenes,
                   "Built-in scenes by name. Without meshes and scenes the report has the\n"
                   "extreme inputs and the calibration besides")
        ->type_name("NAME")
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_flag("--quick", options.quick,
                 "Fewer settings, the usual radius alone, and by default --size 320x180\n"
                 "--rays 512: two minutes on two cores");
    app.add_option("--size", size, "Size of the picture in pixels")
        ->type_name("WIDTHxHEIGHT")
        ->capture_default_str();
    app.add_option("--camera", camera,
                   "Eye, target and vertical angle of view in degrees\n"
                   "[scene's own, or a view of the whole mesh; FOV 45]")
        ->type_name("EX,EY,EZ,TX,TY,TZ[,FOV]");
    app.add_flag("--ortho", options.orthographic,
                 "Orthographic view that shows as much at the target");
    app.add_option("--radius", radius,
                   "How far occlusion reaches, in world units\n"
                   "[half the scene's usual radius, that and twice that; and for objects alone\n"
                   "without a limit. The usual radius is 5 % of the scene's diagonal; terrain 60,\n"
                   "curtain 25, arcade 2; temple, city and corridor 0.3. The default window is\n"
                   "its projection to both sides at the scene's median depth: odd, at most " +
                       std::to_string(largest_window) + " pixels]")
        ->type_name("R");
    app.add_option("--rays", rays,
                   "Directions per pixel of the reference, from 2; rounded up to an even number")
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--threads", threads, "Threads; kernels are timed with 1 and with this many")
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--out", folder,
                   "Folder for index.html, report.json, report.csv and pictures; files of an\n"
                   "earlier run are replaced, never deleted, and what it measured with this very\n"
                   "program and these options is not measured again")
        ->type_name("DIR")
        ->capture_default_str();
    app.add_option("--compare", compare,
                   "An earlier report.json: prints what got worse, and exits with 1 if\n"
                   "anything did beyond the tolerances")
        ->type_name("FILE");
    app.add_option("--error-tolerance", error_tolerance,
                   "How much larger an RMSE may be, with --compare")
        ->type_name("E")
        ->capture_default_str();
    app.add_option("--time-tolerance", time_tolerance,
                   "How much longer a frame may take relative to the others, as a share,\n"
                   "with --compare")
        ->type_name("S")
        ->capture_default_str();
    app.add_flag("--list", list, "List the built-in scenes");
    if (!support::parse(app, argc, argv)) return false;
    if (list) {
        list_scenes();
        return false;
    }

    if (options.quick && app.count("--size") == 0) size = "320x180";
    if (options.quick && app.count("--rays") == 0) rays = "512";
    read_size(size, options);
    if (!camera.empty() || app.count("--camera") > 0) options.camera = read_camera(camera);
    if (app.count("--radius") > 0) {
        options.radius = number("--radius", radius);
        if (!(*options.radius > 0)) fail("--radius", radius + " is not above 0");
    }
    options.directions = count("--rays", rays, 2, largest_directions);
    options.directions += options.directions % 2;
    options.threads = count("--threads", threads, 1, largest_threads);
    for (const std::string& name : options.scenes) check_scene(name);
    if (folder.empty()) fail("--out", "an empty name");
    options.folder = folder;
    if (app.count("--compare") > 0) {
        if (compare.empty()) fail("--compare", "an empty name");
        options.compare = compare;
    }
    const auto tolerance = [&](const char* option, const std::string& text, double& value) {
        if (app.count(option) > 0 && !options.compare) fail(option, "goes with --compare");
        value = number(option, text);
        if (!(value >= 0)) fail(option, text + " is below 0");
    };
    tolerance("--error-tolerance", error_tolerance, options.tolerances.error);
    tolerance("--time-tolerance", time_tolerance, options.tolerances.time);
    return true;
}

}  // namespace report
