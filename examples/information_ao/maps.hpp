#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/measure/rank_correlation.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/information_ao.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/thread_executor.hpp>

#include "../support/progress.hpp"

namespace information {

/// Viewpoints around a mesh.
struct Views {
    std::vector<glm::dvec3> directions;
    std::vector<nook::Camera> cameras;

    Views(const nook::MeshView& mesh, int level, double distance);
};

/// Weights of viewpoints about a direction: exp(3 (cos − 1)), 400 times more in it than opposite.
[[nodiscard]] std::vector<double> importance_about(const glm::dvec3& direction, const Views& views);

/// One number per polygon each.
struct Maps {
    std::vector<float> pmi;    ///< bits
    std::vector<float> shade;  ///< the same as visibility
    std::vector<float> open;   ///< the ambient occlusion of the same pictures
    std::vector<nook::PolygonState> states;
    nook::InformationReport report;
    double samples = 0;  ///< that a polygon should get
    double seconds = 0;
};
[[nodiscard]] Maps information_maps(const nook::MeshView& mesh, const Views& views,
                                    const nook::InformationOptions& options,
                                    nook::ThreadExecutor& threads, support::Progress& progress);

/// A matrix that is not too large to keep: at most 2²⁷ elements.
[[nodiscard]] bool channel_fits(std::size_t polygons, std::size_t views);

/// The same pictures as a matrix; nothing where it does not fit.
struct Channel {
    nook::ViewpointChannel matrix;
    double information = 0;  ///< I(V; O), bits
    double seconds = 0;
};
[[nodiscard]] std::optional<Channel> channel_of(const nook::MeshView& mesh, const Views& views,
                                                const Maps& maps, nook::ViewProbability probability,
                                                nook::ThreadExecutor& threads);

/// Three colours per polygon, lit by three per viewpoint.
[[nodiscard]] std::vector<float> relit_map(const nook::ViewpointChannel& channel,
                                           const std::vector<float>& colours,
                                           nook::ThreadExecutor& threads);

/// Ray-traced ambient occlusion at the centroids, over all directions of the front.
[[nodiscard]] std::vector<float> traced_map(const nook::MeshView& mesh, int directions,
                                            nook::ThreadExecutor& threads);

/// The least, the largest and the mean of the seen polygons; all 0 without any.
struct Range {
    double least = 0, most = 0, mean = 0;
};
[[nodiscard]] Range range_of(const std::vector<float>& values,
                             const std::vector<nook::PolygonState>& states);

/// Spearman's rank correlation over the seen polygons.
[[nodiscard]] nook::RankCorrelation ranks_of(std::vector<float> first,
                                             const std::vector<float>& second,
                                             const std::vector<nook::PolygonState>& states);

/// PMI as visibility, where the largest of the seen polygons, so many percent of them, share 0.
[[nodiscard]] std::vector<float> clipped_shade(const Maps& maps, double percent);

/// The root mean squared difference of two lists over the polygons that both have seen.
[[nodiscard]] double rms_change(const Maps& before, const Maps& after);

}  // namespace information
