#include "scenes.hpp"

#include <filesystem>

#include "../support/failure.hpp"
#include "../support/obj_file.hpp"

namespace scenes {

Scene empty()
{
    Scene scene;
    scene.name = "empty";
    scene.camera.eye = {0, 0, 1};
    scene.camera.target = {0, 0, 0};
    return scene;
}

std::span<const Entry> all()
{
    static constexpr Entry entries[] = {
        {"bowl", "a bowl on a table", [] { return bowl(); }, true},
        {"boxes", "boxes, thrown about and stacked", [] { return boxes(); }},
        {"stairs", "two flights of stairs in a corner", [] { return stairs(); }},
        {"chains", "chains between thin pillars", [] { return chains(); }},
        {"terrain", "hills from a distance of 0.1 to 1e5", [] { return terrain(); }},
        {"floor", "a flat floor seen at a slant", [] { return floor(); }},
        {"curtain", "a thin curtain that hangs over flat ground", [] { return curtain(); }, false,
         false, true},
        {"arcade", "a vaulted gallery with columns and curtains", [] { return arcade(); }, false,
         false, true},
        {"temple", "a Doric temple of closed stones", [] { return temple(); }},
        {"city", "a small desert city", [] { return city(); }},
        {"corridor", "a vaulted corridor, one surface that faces inwards",
         [] { return corridor(); }},
        {"cup", "a tea cup with a handle, alone", [] { return cup(); }, false, true},
        {"tree", "a tree with leaves, alone", [] { return tree(); }, false, true},
        {"lathe", "a chess queen turned on a lathe, alone", [] { return lathe(); }, false, true},
        {"empty", "nothing but sky", [] { return empty(); }},
    };
    return entries;
}

Scene load(const std::string& name, double aspect)
{
    std::string known;
    for (const Entry& entry : all()) {
        if (name == entry.name) return entry.make();
        known += entry.name + std::string{", "};
    }
    const std::filesystem::path path = name;
    if (path.extension() != ".obj" && path.extension() != ".OBJ")
        throw support::Failure{"--scene: '" + name.substr(0, 60) + "' is none of " + known +
                               "and no .obj file"};
    support::ObjMesh mesh = support::read_obj(path);
    Scene scene;
    scene.name = path.stem().string();
    scene.positions = std::move(mesh.positions);
    scene.indices = std::move(mesh.indices);
    scene.camera = three_quarter_view(scene, aspect);
    scene.radius = default_radius(scene);
    return scene;
}

}  // namespace scenes
