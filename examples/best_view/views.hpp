#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/scene/best_views.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/channel_measures.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/progress.hpp"

namespace best_view {

/// What makes a view good.
enum class Measure {
    vmi,          ///< little viewpoint mutual information
    evmi,         ///< the same with polygons weighted by their saliency
    saliency,     ///< much mesh saliency
    greedy,       ///< together with the views before it, little information left
    greedy_evmi,  ///< the same with saliency
};
[[nodiscard]] const char* name_of(Measure measure);
[[nodiscard]] constexpr bool is_greedy(Measure measure)
{
    return measure == Measure::greedy || measure == Measure::greedy_evmi;
}

/// What is asked for.
struct Task {
    Measure measure = Measure::greedy;
    int level = 3, resolution = 512, count = 6;
    /// Of the eyes from the centre, in radii of the bounding sphere.
    double distance = std::numeric_limits<double>::infinity();
    double share = 0;
    /// From the horizon up only: things that stand on the ground.
    bool above = false;
    /// Unset: left out of closed meshes.
    std::optional<nook::BackFaces> back_faces;
};

/// A view that has been chosen: its number, and what the measure says of it.
struct Choice {
    std::uint32_t view = 0;
    double value = 0, probability = 0;
};

/// What the viewpoints around a mesh see, and which are best.
struct Views {
    std::vector<glm::dvec3> directions;
    std::vector<nook::Camera> cameras;
    nook::BackFaces back_faces = nook::BackFaces::occluding;
    nook::ViewpointChannel channel;
    nook::ChannelEntropies entropies;
    std::size_t seen = 0;  ///< polygons that some view sees

    /// Per view.
    std::vector<double> vmi, evmi, saliency;
    /// Per polygon; like the two before it empty where the measure does not need it.
    std::vector<double> polygon_saliency;

    /// From best to worst; greedy: in order of choice.
    std::vector<Choice> chosen;
    /// Of the views that see something; none where the choice is greedy.
    std::optional<Choice> worst;
    double channel_seconds = 0, measure_seconds = 0;
};

/// Throws support::Failure when no view sees anything.
[[nodiscard]] Views look(const scenes::Scene& scene, const Task& task,
                         nook::ThreadExecutor& threads, support::Progress& progress);

}  // namespace best_view
