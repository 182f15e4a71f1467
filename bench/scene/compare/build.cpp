#include "parts.hpp"

#include <cstdio>
#include <optional>

#include "common.hpp"

namespace compare {

void compare_build(const Options& options, const std::vector<View>& views, Results& results)
{
    const Kernels& best = targets().best();
    Mark time{"build time over Embree's", false, 1.2, 1};
    Mark memory{"memory kept over Embree's, its mesh included", false, 0.65, 0.4};
    std::vector<std::vector<std::string>> rows{
        {"", "triangles", "nook, ms", "Embree, ms", "fastest rounds", "nook over Embree",
         "nook, bytes/triangle", "Embree, bytes/triangle", "and its mesh"}};
    for (const View& view : views) {
        const nook::MeshView mesh = view.scene.mesh();
        const double triangles = double(mesh.triangle_count);
        std::optional<NookBvh> bvh;
        std::vector<Contender> contenders{{"nook", [&] { bvh.emplace(best, mesh); }}};
        std::optional<EmbreeScene> embree;
        if (has_embree()) {
            embree.emplace(mesh, EmbreeScene::Mode::plain);
            contenders.push_back({"Embree", [&] { embree->build(); }});
        }
        const Times times{contenders, effort(options)};
        for (std::size_t i = 0; i < contenders.size(); ++i)
            results.measurements.push_back({.part = "build",
                                            .scene = view.scene.name,
                                            .contender = contenders[i].name,
                                            .seconds = times.seconds(i),
                                            .base = contenders.back().name,
                                            .ratio = times.ratio(i, contenders.size() - 1)});
        const double kept = double(best.memory_size(*bvh));
        results.facts.push_back({"bytes per triangle, nook, " + view.scene.name, kept / triangles});
        std::vector<std::string> row{view.scene.name,
                                     std::to_string(mesh.triangle_count),
                                     digits("%.1f", 1e3 * times.seconds(0).median),
                                     "-",
                                     digits("%.1f", 1e3 * times.least_seconds(0)),
                                     "-",
                                     digits("%.1f", kept / triangles),
                                     "-",
                                     "-"};
        if (embree) {
            const double own = double(embree->memory_size());
            // Embree reads the mesh while it traces, so the mesh has to stay; nook copies what it needs.
            const double all = own + 12.0 * double(mesh.vertex_count) + 12.0 * triangles;
            row[3] = digits("%.1f", 1e3 * times.seconds(1).median);
            row[4] += digits(", %.1f", 1e3 * times.least_seconds(1));
            row[5] = text_of(times.ratio(0, 1));
            row[7] = digits("%.1f", own / triangles);
            row[8] = digits("%.1f", all / triangles);
            const double share = kept / all;
            // Whoever builds a few triangles waits for neither time nor memory.
            if (mesh.triangle_count >= 10000) {
                time.take(times.ratio(0, 1), view.scene.name);
                memory.take({share, share, share}, view.scene.name);
            }
            results.facts.push_back(
                {"bytes per triangle, Embree, " + view.scene.name, own / triangles});
            results.facts.push_back(
                {"bytes per triangle, Embree and mesh, " + view.scene.name, all / triangles});
        }
        rows.push_back(row);
    }
    std::printf("build on one thread, nook %s; Embree at medium quality\n", best.name);
    print_table(rows);
    results.marks.push_back(time);
    results.marks.push_back(memory);
}

}  // namespace compare
