// nook-bake: ambient occlusion at the vertices of a mesh, for engines and viewers that draw vertex
// colours.

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <nook/scene/bvh.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/arguments.hpp"
#include "../support/checked.hpp"
#include "../support/command_line.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"
#include "../support/program.hpp"
#include "vertex_mesh.hpp"

namespace {

struct CommandLine {
    std::string mesh;
    std::filesystem::path file;
    int directions = 256, threads = 1;
    double radius = 0;
    bool flip = false;
};

/// Returns false when the command line has been answered and there is nothing left to do.
bool read_command_line(int argc, const char* const* argv, CommandLine& result)
{
    CLI::App app{
        "Bakes ambient occlusion into the vertices of an OBJ file.\n"
        "1 is open, 0 is closed. Normals are those of the file; a vertex without one takes\n"
        "the mean of the triangles around it, by area.",
        "nook-bake"};
    support::set_up(app);
    std::string file, radius;
    app.add_option("mesh", result.mesh, "The OBJ file")->type_name("FILE")->required();
    app.add_option("--out", file,
                   "What to write: .ply, a mesh with grey vertices, or .csv, a line per vertex")
        ->type_name("FILE")
        ->required();
    app.add_option("--directions", result.directions, "Rays per vertex")
        ->type_name("N")
        ->check(CLI::Range(1, 65536))
        ->capture_default_str();
    app.add_option("--radius", radius,
                   "How far occlusion reaches, world units [5 % of the diagonal]")
        ->type_name("R");
    app.add_flag("--flip", result.flip, "Normals the other way round");
    support::add_threads(app, result.threads, "Threads; the result does not depend on them");
    if (!support::parse(app, argc, argv)) return false;
    result.file = file;
    support::check_output_file("--out", result.file);
    if (app.count("--radius") > 0) result.radius = support::read_positive("--radius", radius);
    if (result.file.extension() != ".ply" && result.file.extension() != ".csv")
        throw support::Failure{"--out: a name that ends in .ply or .csv is needed"};
    return true;
}

void bake_mesh(const CommandLine& command)
{
    bake::VertexMesh mesh = bake::read_vertex_mesh(command.mesh);
    if (mesh.vertices() > static_cast<std::size_t>((std::numeric_limits<int>::max)()))
        throw support::Failure{command.mesh + ": holds too many vertices"};
    if (command.flip)
        for (float& coordinate : mesh.normals) coordinate = -coordinate;

    scenes::Scene scene;
    scene.positions = mesh.positions;
    scene.indices = mesh.indices;
    const double radius = command.radius > 0 ? command.radius : scenes::default_radius(scene);
    nook::Bvh bvh;
    support::checked(bvh.build(scene.mesh()), "Bvh::build");

    using clock = std::chrono::steady_clock;
    nook::ThreadExecutor threads{command.threads};
    std::vector<float> visibility(mesh.vertices());
    const nook::ImageView<float> output{visibility.data(), static_cast<int>(mesh.vertices()), 1};
    const nook::ShadingPoints points{mesh.positions.data(), mesh.normals.data(), mesh.vertices()};
    const clock::time_point start = clock::now();
    const nook::Work work = support::checked(
        nook::traced_ao(bvh, points, output,
                        nook::TracedOptions<>{.radius = radius, .directions = command.directions},
                        nook::HeapScratch{}, threads),
        "traced_ao");
    const std::chrono::duration<double, std::milli> time = clock::now() - start;
    support::write_file(command.file, command.file.extension() == ".ply"
                                          ? bake::ply_of(mesh, visibility)
                                          : bake::csv_of(mesh, visibility));
    std::printf(
        "%zu vertices, %zu of them without a normal in the file; %zu triangles, %zu bad "
        "ones dropped\n%d directions, radius %g: %.1f ms, %llu rays, %llu skipped\n%s\n",
        mesh.vertices(), mesh.derived, mesh.indices.size() / 3, mesh.dropped, command.directions,
        radius, time.count(), static_cast<unsigned long long>(work.rays),
        static_cast<unsigned long long>(work.skipped_rays), command.file.string().c_str());
}

}  // namespace

int main(int argc, char** argv)
{
    return support::run_program("nook-bake", [&] {
        CommandLine command;
        if (read_command_line(argc, argv, command)) bake_mesh(command);
    });
}
