#include "maps.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>

#include <glm/geometric.hpp>

#include <nook/scene/bvh.hpp>
#include <nook/scene/channel_measures.hpp>
#include <nook/scene/information_sampling.hpp>
#include <nook/scene/polygon_values.hpp>
#include <nook/scene/relighting.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/scene/viewpoints.hpp>

#include "../support/checked.hpp"
#include "../support/failure.hpp"

namespace information {

Views::Views(const nook::MeshView& mesh, int level, double distance)
    : directions(nook::icosphere_size(level))
{
    nook::icosphere(level, directions.data());
    const nook::BoundingSphere sphere = nook::bounding_sphere(mesh);
    for (const glm::dvec3& direction : directions)
        cameras.push_back(nook::viewpoint_camera(sphere, direction, {.distance = distance}));
}

std::vector<double> importance_about(const glm::dvec3& direction, const Views& views)
{
    std::vector<double> result;
    for (const glm::dvec3& towards : views.directions)
        result.push_back(std::exp(3 * (glm::dot(towards, direction) - 1)));
    return result;
}

Maps information_maps(const nook::MeshView& mesh, const Views& views,
                      const nook::InformationOptions& options, nook::ThreadExecutor& threads,
                      support::Progress& progress)
{
    nook::InformationOptions watched = options;
    watched.progress = [](std::size_t done, std::size_t count, void* user) {
        static_cast<support::Progress*>(user)->share(static_cast<double>(done) /
                                                     static_cast<double>(count));
    };
    watched.user = &progress;
    const std::size_t polygons = mesh.triangle_count;
    Maps maps;
    maps.pmi.resize(polygons);
    maps.shade.resize(polygons);
    maps.open.resize(polygons);
    maps.states.resize(polygons);
    maps.samples = options.samples_per_polygon;
    using clock = std::chrono::steady_clock;
    const clock::time_point start = clock::now();
    support::checked(nook::information_ao(
                         mesh, views.cameras.data(), views.cameras.size(),
                         {maps.pmi.data(), maps.shade.data(), maps.open.data(), maps.states.data()},
                         watched, &maps.report, nook::HeapScratch{}, threads),
                     "information_ao");
    maps.seconds = std::chrono::duration<double>(clock::now() - start).count();
    return maps;
}

bool channel_fits(std::size_t polygons, std::size_t views)
{
    return polygons <= (std::size_t{1} << 27) / views;
}

std::optional<Channel> channel_of(const nook::MeshView& mesh, const Views& views, const Maps& maps,
                                  nook::ViewProbability probability, nook::ThreadExecutor& threads)
{
    const std::size_t count = views.cameras.size();
    if (!channel_fits(mesh.triangle_count, count)) return std::nullopt;
    using clock = std::chrono::steady_clock;
    const clock::time_point start = clock::now();
    std::vector<std::uint8_t> levels(mesh.triangle_count);
    nook::SamplingPlan plan;
    support::checked(
        nook::Outcome{nook::plan_sampling(
            mesh, views.cameras.data(), count,
            {.resolution = maps.report.sampling.resolution, .samples_per_polygon = maps.samples},
            plan, levels.data())},
        "plan_sampling");
    Channel channel;
    support::checked(channel.matrix.build(mesh, views.cameras.data(), count,
                                          {.resolution = plan.resolution,
                                           .back_faces = maps.report.back_faces,
                                           .probability = probability,
                                           .levels = levels.data()},
                                          {}, threads),
                     "ViewpointChannel::build");
    nook::ChannelEntropies entropies;
    support::checked(
        nook::channel_entropies(channel.matrix, entropies, nook::HeapScratch{}, threads),
        "channel_entropies");
    channel.information = entropies.information_by_polygons;
    channel.seconds = std::chrono::duration<double>(clock::now() - start).count();
    return channel;
}

std::vector<float> relit_map(const nook::ViewpointChannel& channel,
                             const std::vector<float>& colours, nook::ThreadExecutor& threads)
{
    std::vector<double> information(3 * channel.polygon_count());
    std::vector<float> visibility(information.size());
    support::checked(
        nook::relit_information(channel, colours.data(), information.data(), {}, threads),
        "relit_information");
    support::checked(
        nook::Outcome{nook::relit_visibility(channel, information.data(), visibility.data())},
        "relit_visibility");
    return visibility;
}

std::vector<float> traced_map(const nook::MeshView& mesh, int directions,
                              nook::ThreadExecutor& threads)
{
    const std::size_t polygons = mesh.triangle_count;
    if (polygons > static_cast<std::size_t>((std::numeric_limits<int>::max)()))
        throw support::Failure{"the mesh holds too many triangles"};
    std::vector<float> positions, normals, result(polygons);
    for (std::size_t t = 0; t < polygons; ++t) {
        const auto corner = [&](std::size_t k) {
            const float* const at =
                mesh.positions +
                static_cast<std::ptrdiff_t>(mesh.indices[3 * t + k]) * mesh.position_stride;
            return glm::dvec3{double{at[0]}, double{at[1]}, double{at[2]}};
        };
        const glm::dvec3 a = corner(0), b = corner(1), c = corner(2);
        const glm::dvec3 centre = (a + b + c) / 3.0, normal = glm::cross(b - a, c - a);
        const double length = glm::length(normal);
        for (int k = 0; k < 3; ++k) {
            positions.push_back(static_cast<float>(centre[k]));
            normals.push_back(length > 0 ? static_cast<float>(normal[k] / length) : 0);
        }
    }
    nook::Bvh bvh;
    support::checked(bvh.build(mesh), "Bvh::build");
    const nook::ImageView<float> output{result.data(), static_cast<int>(polygons), 1};
    support::checked(
        nook::traced_ao(bvh, nook::ShadingPoints{positions.data(), normals.data(), polygons},
                        output, nook::TracedOptions<>{.directions = directions},
                        nook::HeapScratch{}, threads),
        "traced_ao");
    return result;
}

Range range_of(const std::vector<float>& values, const std::vector<nook::PolygonState>& states)
{
    Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    std::size_t count = 0;
    for (std::size_t o = 0; o < values.size(); ++o) {
        if (states[o] != nook::PolygonState::seen) continue;
        const double value{values[o]};
        range.least = std::min(range.least, value);
        range.most = std::max(range.most, value);
        range.mean += value;
        ++count;
    }
    if (count == 0) return {};
    range.mean /= static_cast<double>(count);
    return range;
}

nook::RankCorrelation ranks_of(std::vector<float> first, const std::vector<float>& second,
                               const std::vector<nook::PolygonState>& states)
{
    for (std::size_t o = 0; o < first.size(); ++o)
        if (states[o] != nook::PolygonState::seen)
            first[o] = std::numeric_limits<float>::quiet_NaN();
    const nook::RankCorrelation result = nook::spearman(first.data(), second.data(), first.size());
    support::checked(nook::Outcome{result.error}, "spearman");
    return result;
}

std::vector<float> clipped_shade(const Maps& maps, double percent)
{
    std::vector<float> seen;
    for (std::size_t o = 0; o < maps.pmi.size(); ++o)
        if (maps.states[o] == nook::PolygonState::seen) seen.push_back(maps.pmi[o]);
    const auto above = static_cast<std::size_t>(percent / 100 * static_cast<double>(seen.size()));
    if (above == 0) return maps.shade;
    const auto at = seen.end() - static_cast<std::ptrdiff_t>(above) - 1;
    std::nth_element(seen.begin(), at, seen.end());
    std::vector<float> clipped = maps.pmi, shade(maps.pmi.size());
    for (float& information : clipped) information = std::min(information, *at);
    support::checked(nook::Outcome{nook::normalise_information(
                         clipped.data(), maps.states.data(), clipped.size(), shade.data(),
                         nook::InformationOptions{}.equal_within)},
                     "normalise_information");
    return shade;
}

double rms_change(const Maps& before, const Maps& after)
{
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t o = 0; o < before.pmi.size(); ++o) {
        if (before.states[o] != nook::PolygonState::seen ||
            after.states[o] != nook::PolygonState::seen)
            continue;
        const double change = double{after.pmi[o]} - double{before.pmi[o]};
        sum += change * change;
        ++count;
    }
    return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

}  // namespace information
