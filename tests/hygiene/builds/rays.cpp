// What the ray-traced kernels promise, checked under whatever flags this is compiled with.
#include <cstdint>
#include <cstdio>

#include <nook/owned_image.hpp>
#include <nook/scene/traced_ao.hpp>

#include "../../scene/watertight.hpp"

namespace {

int failures = 0;

void check(bool fact, const char* text)
{
    if (fact) return;
    ++failures;
    std::printf("not true that %s\n", text);
}

/// A closed body with rays from its inside, outside and surface.
void hits_are_those_of_brute_force()
{
    const watertight::ClosedMesh rock = watertight::rock(8, 0.5, 3, {1, 2, 3}, 7);
    nook::Bvh bvh;
    check(static_cast<bool>(bvh.build(rock.view())), "a rock can be built");
    std::uint64_t state = 1;
    const auto unit = [&] { return 2 * watertight::next_unit(state) - 1; };
    bool same = true;
    for (int i = 0; i < 2000; ++i) {
        const nook::Ray ray{.origin = {1 + 4 * unit(), 2 + 4 * unit(), 3 + 4 * unit()},
                            .direction = {unit(), unit(), unit()},
                            .t_max = 8};
        const nook::Hit hit = bvh.closest(ray), truth = closest_brute_force(rock.view(), ray);
        same = same && hit.face == truth.face && bvh.occluded(ray) == static_cast<bool>(truth);
    }
    check(same, "the hierarchy hits what brute force hits");
}

void a_closed_room_is_dark_and_a_convex_body_is_white()
{
    const watertight::ClosedMesh ball = watertight::rock(12, 0, 1, {0, 0, 0}, 7);
    nook::Bvh bvh;
    check(static_cast<bool>(bvh.build(ball.view())), "a ball can be built");
    check(traced_visibility(bvh, {0.1, 0.2, 0.3}, {0, 0, 1}, {.directions = 1000}) == 0,
          "a closed room is dark");
    nook::Image<float> visibility{static_cast<int>(ball.positions.size() / 3), 1};
    // Straight out from every vertex.
    const nook::ShadingPoints points{ball.positions.data(), ball.positions.data(),
                                     ball.positions.size() / 3};
    check(static_cast<bool>(traced_ao(bvh, points, visibility.view(), {.directions = 16})),
          "points can be traced");
    bool bright = true;
    for (const float v : visibility) bright = bright && v >= 0.5f && v <= 1;
    check(bright, "the corners of a ball are bright");
}

}  // namespace

int main()
{
    check(watertight::leaks(10000000) == 0, "no ray leaks through a vertex or an edge");
    hits_are_those_of_brute_force();
    a_closed_room_is_dark_and_a_convex_body_is_white();
    return failures > 0;
}
