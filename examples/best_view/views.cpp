#include "views.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include <nook/scene/closed_mesh.hpp>
#include <nook/scene/polygon_saliency.hpp>
#include <nook/scene/viewpoints.hpp>

#include "../support/checked.hpp"
#include "../support/failure.hpp"

namespace best_view {

namespace {

using support::checked;

double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Threads that tell how far a build has come: every view reaches them about as often.
class CountedThreads {
public:
    CountedThreads(nook::ThreadExecutor& threads, support::Progress& progress)
        : threads_{threads},
          progress_{progress}
    {}
    /// What has run so far is a part of this many.
    void expect(std::size_t parts)
    {
        expected_ = static_cast<double>(calls_) * static_cast<double>(parts);
        calls_ = 0;
    }
    [[nodiscard]] int concurrency() const { return threads_.concurrency(); }
    template <class F>
    void for_each(int count, F&& f)
    {
        threads_.for_each(count, f);
        ++calls_;
        if (expected_ > 0)
            progress_.share((std::min)(static_cast<double>(calls_) / expected_, 1.0));
    }

private:
    nook::ThreadExecutor& threads_;
    support::Progress& progress_;
    std::size_t calls_ = 0;
    double expected_ = 0;
};

void build_channel(const scenes::Scene& scene, const Task& task, nook::ThreadExecutor& threads,
                   support::Progress& progress, Views& views)
{
    const nook::MeshView mesh = scene.mesh();
    nook::MeshClosure closure{};
    if (!task.back_faces) checked(nook::closed_mesh(mesh, closure), "closed_mesh");
    views.back_faces = task.back_faces.value_or(closure.closed ? nook::BackFaces::left_out
                                                               : nook::BackFaces::occluding);
    const nook::ChannelOptions options{.resolution = task.resolution,
                                       .back_faces = views.back_faces};
    CountedThreads counted{threads, progress};
    nook::ViewpointChannel one;
    checked(one.build(mesh, views.cameras.data(), 1, options, {}, counted),
            "ViewpointChannel::build");
    counted.expect(views.cameras.size());
    checked(
        views.channel.build(mesh, views.cameras.data(), views.cameras.size(), options, {}, counted),
        "ViewpointChannel::build");
}

/// The views as rank_views puts them; fills values[v] of those.
std::vector<Choice> rank(const Views& views, const std::vector<double>& saliency,
                         std::vector<double>& values, nook::ThreadExecutor& threads)
{
    const std::size_t count = views.cameras.size();
    std::vector<nook::BestView> ranking(count);
    std::size_t found = 0;
    checked(nook::rank_views(views.channel, ranking.data(), &found,
                             saliency.empty() ? nullptr : saliency.data(), nook::HeapScratch{},
                             threads),
            "rank_views");
    values.assign(count, 0);
    std::vector<Choice> choices;
    for (std::size_t i = 0; i < found; ++i) {
        values[ranking[i].view] = ranking[i].information;
        choices.push_back({ranking[i].view, ranking[i].information, ranking[i].probability});
    }
    return choices;
}

std::vector<Choice> merge(const Views& views, const Task& task, nook::ThreadExecutor& threads)
{
    std::vector<nook::BestView> best(static_cast<std::size_t>(task.count));
    std::size_t found = 0;
    const std::vector<double>& saliency = views.polygon_saliency;
    checked(nook::best_views(views.channel, best.data(), &found,
                             {.count = best.size(),
                              .share = task.share,
                              .saliency = saliency.empty() ? nullptr : saliency.data()},
                             nook::HeapScratch{}, threads),
            "best_views");
    std::vector<Choice> choices;
    for (std::size_t i = 0; i < found; ++i)
        choices.push_back({best[i].view, best[i].information, best[i].probability});
    return choices;
}

void find_saliency(const scenes::Scene& scene, nook::ThreadExecutor& threads, Views& views)
{
    nook::PolygonNeighbours neighbours;
    checked({neighbours.build(scene.mesh())}, "PolygonNeighbours::build");
    views.polygon_saliency.resize(scene.triangles());
    checked(nook::polygon_saliency(views.channel, neighbours, views.polygon_saliency.data(),
                                   nook::HeapScratch{}, threads),
            "polygon_saliency");
    views.saliency.resize(views.cameras.size());
    checked(nook::viewpoint_saliency(views.channel, views.polygon_saliency.data(),
                                     views.saliency.data(), nook::HeapScratch{}, threads),
            "viewpoint_saliency");
}

}  // namespace

const char* name_of(Measure measure)
{
    switch (measure) {
    case Measure::vmi: return "vmi";
    case Measure::evmi: return "evmi";
    case Measure::saliency: return "saliency";
    case Measure::greedy: return "greedy";
    default: return "greedy-evmi";
    }
}

Views look(const scenes::Scene& scene, const Task& task, nook::ThreadExecutor& threads,
           support::Progress& progress)
{
    Views views;
    views.directions.resize(nook::icosphere_size(task.level));
    nook::icosphere(task.level, views.directions.data());
    if (task.above)
        std::erase_if(views.directions,
                      [](const glm::dvec3& direction) { return direction.y < 0; });
    const nook::BoundingSphere sphere = nook::bounding_sphere(scene.mesh());
    for (const glm::dvec3& direction : views.directions)
        views.cameras.push_back(
            nook::viewpoint_camera(sphere, direction, {.distance = task.distance}));

    progress.step("drawing " + std::to_string(views.cameras.size()) + " views");
    auto start = std::chrono::steady_clock::now();
    build_channel(scene, task, threads, progress, views);
    views.channel_seconds = seconds_since(start);
    for (std::size_t o = 0; o < views.channel.polygon_count(); ++o)
        views.seen += views.channel.seen(o) ? 1 : 0;
    if (views.seen == 0)
        throw support::Failure{
            scene.name +
            ": no viewpoint sees a front face (--back-faces counted takes both sides)"};

    start = std::chrono::steady_clock::now();
    progress.step("measuring");
    checked(nook::channel_entropies(views.channel, views.entropies, nook::HeapScratch{}, threads),
            "channel_entropies");
    std::vector<Choice> ranked = rank(views, {}, views.vmi, threads);
    const Measure measure = task.measure;
    if (measure == Measure::evmi || measure == Measure::saliency ||
        measure == Measure::greedy_evmi) {
        progress.step("comparing neighbours");
        find_saliency(scene, threads, views);
        std::vector<Choice> extended = rank(views, views.polygon_saliency, views.evmi, threads);
        if (measure == Measure::evmi) ranked = std::move(extended);
    }
    if (measure == Measure::saliency) {
        for (Choice& choice : ranked) choice.value = views.saliency[choice.view];
        std::sort(ranked.begin(), ranked.end(), [](const Choice& a, const Choice& b) {
            return a.value > b.value || (a.value == b.value && a.view < b.view);
        });
    }
    if (is_greedy(measure)) {
        progress.step("choosing views");
        views.chosen = merge(views, task, threads);
    } else if (!ranked.empty()) {
        views.worst = ranked.back();
        ranked.resize((std::min)(ranked.size(), static_cast<std::size_t>(task.count)));
        views.chosen = std::move(ranked);
    }
    views.measure_seconds = seconds_since(start);
    return views;
}

}  // namespace best_view
