// What the channel between viewpoints and polygons promises, checked under whatever flags this is
// compiled with. It needs no exceptions and no RTTI, and NaN comes from bits that no compiler can follow.
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/best_views.hpp>
#include <nook/scene/channel_measures.hpp>
#include <nook/scene/information_ao.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scene/viewpoints.hpp>

#include "../../scene/watertight.hpp"

namespace {

int failures = 0;

void check(bool fact, const char* text)
{
    if (fact) return;
    ++failures;
    std::printf("not true that %s\n", text);
}
/// In [0, 1], judged by bits.
bool in_range(float value) { return std::bit_cast<std::uint32_t>(value) <= 0x3f800000u; }

std::vector<nook::Camera> views_of(const nook::MeshView& mesh)
{
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh);
    std::vector<glm::dvec3> directions(nook::icosphere_size(1));
    nook::icosphere(1, directions.data());
    std::vector<nook::Camera> views;
    for (const glm::dvec3& direction : directions)
        views.push_back(nook::viewpoint_camera(sphere, direction));
    return views;
}

void counts_are_those_of_the_picture(const nook::MeshView& mesh,
                                     const std::vector<nook::Camera>& views)
{
    constexpr int size = 150;
    nook::Image<float> depth{size, size};
    nook::Image<std::uint32_t> face{size, size};
    std::vector<std::uint32_t> counts(mesh.triangle_count), expected(mesh.triangle_count);
    bool same = true;
    for (const nook::Camera& view : views) {
        const nook::ViewFrame frame = nook::view_frame(view);
        const nook::Projection projection = nook::projection(view, size, size);
        nook::GBuffer buffers{};
        buffers.depth = depth.view();
        buffers.face = face.view();
        same = same && nook::rasterise(mesh, frame, projection, buffers);
        same = same && nook::visible_counts(mesh, frame, projection, size, size, counts.data());
        for (std::uint32_t& count : expected) count = 0;
        for (const std::uint32_t id : face)
            if (id != nook::no_face) ++expected[id];
        same = same && counts == expected;
    }
    check(same, "triangles count the pixels that show them");
}

void identities_hold(const nook::MeshView& mesh, const std::vector<nook::Camera>& views)
{
    nook::ViewpointChannel channel;
    check(bool{channel.build(mesh, views.data(), views.size(), {.resolution = 150})},
          "a channel can be built");
    nook::ChannelEntropies e{};
    check(bool{nook::channel_entropies(channel, e)}, "entropies can be computed");
    const double information = e.view + e.polygon - e.joint;
    check(std::fabs(e.information_by_views - information) < 1e-11 &&
              std::fabs(e.information_by_polygons - information) < 1e-11 && information > 0.1,
          "I(V;O) = I(O;V) = H(V) + H(O) - H(V,O)");
    double sum = 0;
    for (std::size_t o = 0; o < channel.polygon_count(); ++o) sum += channel.p_polygon(o);
    check(std::fabs(sum - 1) < 1e-12, "the probabilities of the polygons add up to 1");

    std::vector<nook::BestView> best(views.size());
    std::size_t found = 0;
    check(bool{nook::best_views(channel, best.data(), &found, {.count = views.size()})} &&
              found == views.size() && best[found - 1].information < 1e-11,
          "all views together leave no information");
}

void maps_are_in_range(const nook::MeshView& mesh, const std::vector<nook::Camera>& views)
{
    std::vector<float> information(mesh.triangle_count), visibility(information);
    std::vector<nook::PolygonState> state(mesh.triangle_count);
    nook::InformationMaps maps{};
    maps.information_visibility = information.data();
    maps.visibility = visibility.data();
    maps.state = state.data();
    check(bool{nook::information_ao(mesh, views.data(), views.size(), maps)},
          "maps can be computed");
    bool fine = true, open = true;
    for (std::size_t o = 0; o < mesh.triangle_count; ++o) {
        fine = fine && in_range(information[o]) && in_range(visibility[o]);
        if (state[o] == nook::PolygonState::seen) open = open && visibility[o] > 0.8f;
        else fine = fine && information[o] == 0 && visibility[o] == 0;
    }
    check(fine, "maps lie in [0, 1], and are 0 for what is not seen");
    check(open, "a convex body is open");
}

}  // namespace

int main()
{
    watertight::ClosedMesh ball = watertight::rock(9, 0, 1, {0, 0, 0}, 7);
    const std::vector<nook::Camera> views = views_of(ball.view());
    counts_are_those_of_the_picture(ball.view(), views);
    identities_hold(ball.view(), views);
    maps_are_in_range(ball.view(), views);

    volatile std::uint32_t bits = 0x7fc00000;
    ball.positions[7] = std::bit_cast<float>(std::uint32_t{bits});
    maps_are_in_range(ball.view(), views);
    return failures > 0;
}
