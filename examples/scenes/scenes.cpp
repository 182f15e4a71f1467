#include "scenes.hpp"

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
        {"empty", "nothing but sky", [] { return empty(); }},
    };
    return entries;
}

}  // namespace scenes
