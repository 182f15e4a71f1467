#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/closed_mesh.hpp>
#include <nook/scene/information_open_area.hpp>
#include <nook/scene/information_sampling.hpp>
#include <nook/scene/information_sums.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/polygon_values.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scene/viewpoints.hpp>
#include <nook/scene/visible_counts.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// What `information_ao` writes: one entry per triangle each. Any may be null; they share no memory.
struct InformationMaps {
    /// Polygonal mutual information in bits, ≥ 0; 0 for polygons that are not seen.
    float* pmi = nullptr;
    /// PMI normalised and turned as the paper shows it: 1 for the least, 0 for the largest. 0 for
    /// polygons that are not seen, which do not count for the range either.
    float* information_visibility = nullptr;
    /// The ambient occlusion that the same pictures hold: visible over open projected area, in
    /// [0, 1]; 0 for polygons that are not seen.
    float* visibility = nullptr;
    PolygonState* state = nullptr;
};

struct InformationOptions {
    /// Pixels across the picture of each viewpoint: 1 to 8192, or 0: chosen from the mesh, see
    /// `plan_sampling`.
    int resolution = 0;
    /// The most that is chosen, 1 to 8192.
    int max_resolution = 2048;
    /// How many samples should show a polygon that faces the viewer, ≥ 0. Small polygons get up to 16
    /// samples per pixel for it. 0: one sample per pixel everywhere, as the paper has it.
    double samples_per_polygon = 16;
    ViewProbability probability = ViewProbability::projected_area;
    /// One per viewpoint, finite, ≥ 0, not all 0; read for ViewProbability::importance alone. Views
    /// of importance 0 (or below 2⁻⁴⁰⁰ of the largest) are not drawn.
    const double* importance = nullptr;
    BackFaces back_faces = BackFaces::occluding;
    /// Leave back faces out that would occlude where nobody can see them: when the mesh is closed
    /// (`closed_mesh`) and in front of every viewpoint. Nothing changes, but for a sample in a million
    /// where a back lies as near as a front to the precision of a float, and for parts of a picture that
    /// are sampled more finely only because of small backs in them.
    bool leave_out_hidden_backs = true;
    /// If all PMI lie within so many bits of each other, ≥ 0, the mesh is evenly open and
    /// `information_visibility` is 1: counts of samples tell no finer.
    double equal_within = 0.01;
    /// Called with `user` after each viewpoint, on the calling thread, with how many are done and how
    /// many there are. May be null.
    void (*progress)(std::size_t done, std::size_t count, void* user) = nullptr;
    void* user = nullptr;
};

/// What `information_ao` chose and found.
struct InformationReport {
    SamplingPlan sampling{};
    BackFaces back_faces = BackFaces::occluding;
    /// Viewpoints that were drawn, and of these those that see nothing.
    std::size_t views = 0, blind_views = 0;
    PolygonStateCounts polygons{};
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Information-theoretic ambient occlusion (González, Sbert & Feixas 2008) of the triangles of a mesh:
/// how much the viewpoints that see a polygon tell it apart, without the matrix of the channel. The
/// values are those of `polygon_mutual_information` for a ViewpointChannel with the same samples.
///
/// PMI is low for polygons that all viewpoints see as far as they face them, and high for those that
/// few see, *if* what is hidden is hidden from some viewpoints more than from others: a polygon of
/// which nine tenths are hidden from everybody alike has the PMI of an open one. `visibility` tells
/// that apart: Σ_v a(v, o) / Σ_v open(v, o), where open(v, o) is what the polygon would cover in the
/// picture if it were alone, cut by the frame and the planes of the camera. Every view that sees
/// something weighs the same there, importance or not. Both are areas in pixels: cameras whose pixels
/// differ in size count with what they see in pixels.
///
/// A polygon that is not seen is `hidden` when it faces a viewpoint and, alone, would have shown in 16
/// samples or more over all pictures; with fewer it is `too_small` to tell.
///
/// Views of importance 0 are not drawn; viewpoints that see nothing have p(v) = 0; polygons without
/// area, turned away from all viewpoints or unseen take no part in the sums.
///
/// `views`: view_count cameras (`viewpoint_camera`, or your own), whose pictures are square.
/// `report` may be null. Work: pixels and samples of all pictures, one pass per picture. Scratch:
/// `information_ao_scratch_size`. The same bits for any number of threads.
template <ScratchSource S = HeapScratch, Executor E = Serial>
Outcome information_ao(const MeshView& mesh, const Camera* views, std::size_t view_count,
                       const InformationMaps& maps, const InformationOptions& options = {},
                       InformationReport* report = nullptr, S&& scratch = S{}, E&& executor = E{});

/// Bytes of scratch for a number of workers: 16 per triangle, 8 more for a p(v) other than by projected
/// area and 1 if no `state` is wanted; 84 per viewpoint; and what `visible_counts` needs. For a closed
/// mesh seen as the paper has it that is 32 per triangle in all, and no item buffer.
[[nodiscard]] std::size_t information_ao_scratch_size(const MeshView& mesh, std::size_t view_count,
                                                      const InformationMaps& maps,
                                                      const InformationOptions& options,
                                                      int workers);

namespace detail {

struct InformationMemory {
    InformationSums::Arrays sums;
    OpenAreas::Arrays areas;
    std::uint8_t* levels = nullptr;
    Scratch pictures{};

    InformationMemory(ScratchLayout& layout, const MeshView& mesh, std::size_t view_count,
                      const InformationMaps& maps, const InformationOptions& options, int workers)
    {
        const int largest = options.resolution > 0 ? options.resolution : options.max_resolution;
        const std::uint64_t samples = (std::uint64_t{view_count} << 2 * finest_level) *
                                      static_cast<std::uint64_t>(largest) *
                                      static_cast<std::uint64_t>(largest);
        sums =
            InformationSums::take(layout, mesh.triangle_count,
                                  options.probability != ViewProbability::projected_area, samples);
        areas = OpenAreas::take(layout, view_count);
        // States are written when levels are not needed any more.
        if (options.samples_per_polygon > 0)
            levels = maps.state != nullptr ? reinterpret_cast<std::uint8_t*>(maps.state)
                                           : layout.take<std::uint8_t>(mesh.triangle_count);
        pictures.size = visible_counts_scratch_size(mesh, largest, largest, workers);
        pictures.data = layout.take<std::byte>(pictures.size);
    }
};

[[nodiscard]] inline Error check_information(const MeshView& mesh, const Camera* views,
                                             std::size_t view_count,
                                             const InformationOptions& options)
{
    if (const Error error = check_mesh(mesh)) return error;
    if (const Error error = check_channel_size(view_count, mesh.triangle_count)) return error;
    if (const Error error = check_views(views, view_count)) return error;
    if (const Error error = check_sampling(
            {options.resolution, options.max_resolution, options.samples_per_polygon, nullptr}))
        return error;
    if (const Error error = check_probability(options.probability, "options.probability"))
        return error;
    if (options.probability == ViewProbability::importance)
        if (const Error error =
                check_importance(options.importance, view_count, "options.importance"))
            return error;
    return check_at_least(options.equal_within, 0, "options.equal_within", "bits, >= 0");
}

/// What is known of a polygon once all views are drawn.
class InformationResult {
public:
    InformationResult(const MeshView& mesh, const InformationSums& sums, const OpenAreas& areas,
                      const std::uint8_t* levels, BackFaces back_faces)
        : mesh_{mesh},
          sums_{sums},
          areas_{areas},
          levels_{levels},
          both_sides_{back_faces == BackFaces::counted}
    {}

    [[nodiscard]] PolygonState state(std::size_t o) const
    {
        if (sums_.seen(o)) return PolygonState::seen;
        if (!is_usable_triangle(mesh_, o)) return PolygonState::unusable;
        const double pixels = areas_.pixels(o, both_sides_);
        if (!(pixels > 0)) return PolygonState::turned_away;
        const int level = levels_ != nullptr ? levels_[o] : 0;
        return pixels * (1 << 2 * level) < enough ? PolygonState::too_small : PolygonState::hidden;
    }
    [[nodiscard]] double visibility(std::size_t o) const
    {
        const double unit = levels_ != nullptr ? 1 << 2 * finest_level : 1;
        const double visible = sums_.samples(o) / unit, open = areas_.pixels(o, both_sides_);
        // Samples may hit what is too flat for its area to be told from 0.
        return visible < open ? visible / open : 1;
    }

private:
    static constexpr double enough = 16;

    const MeshView& mesh_;
    const InformationSums& sums_;
    const OpenAreas& areas_;
    const std::uint8_t* levels_;
    bool both_sides_;
};

}  // namespace detail

inline std::size_t information_ao_scratch_size(const MeshView& mesh, std::size_t view_count,
                                               const InformationMaps& maps,
                                               const InformationOptions& options, int workers)
{
    detail::ScratchLayout layout;
    const detail::InformationMemory memory{layout, mesh, view_count, maps, options, workers};
    // The search for open edges is over before anything else begins.
    const std::size_t search = options.leave_out_hidden_backs ? closed_mesh_scratch_size(mesh) : 0;
    return search > layout.size() ? search : layout.size();
}

template <ScratchSource S, Executor E>
Outcome information_ao(const MeshView& mesh, const Camera* views, std::size_t view_count,
                       const InformationMaps& maps, const InformationOptions& options,
                       InformationReport* report, S&& scratch, E&& executor)
{
    if (const Error error = detail::check_information(mesh, views, view_count, options))
        return {error};
    const int workers = static_cast<int>(executor.concurrency());
    const std::size_t size = information_ao_scratch_size(mesh, view_count, maps, options, workers);
    void* const block = scratch.reserve(size);
    if (block == nullptr) return {detail::check_scratch<S>(size)};

    double largest = 0;
    const bool important = options.probability == ViewProbability::importance;
    for (std::size_t v = 0; important && v < view_count; ++v)
        largest = detail::larger(largest, options.importance[v]);
    // A power of two: only the ratios matter.
    const double shrink = detail::power_of_two(-detail::channel_exponent(largest));
    const auto weight = [&](std::size_t v) {
        return important ? options.importance[v] * shrink : 1;
    };
    const auto wanted = [&](std::size_t v) {
        return !important ||
               weight(v) > detail::rounded(largest * shrink) * detail::least_channel_share;
    };

    InformationReport found{};
    const BoundingSphere sphere = bounding_sphere(mesh);
    found.back_faces = options.back_faces;
    if (options.leave_out_hidden_backs && options.back_faces == BackFaces::occluding) {
        MeshClosure closure{};
        const Outcome closed = closed_mesh(mesh, closure, Scratch{block, size});
        if (!closed) return closed;
        bool outside = closure.closed;
        for (std::size_t v = 0; outside && v < view_count; ++v)
            outside = !wanted(v) || detail::OpenAreas::is_outside(views[v], sphere);
        if (outside) found.back_faces = BackFaces::left_out;
    }

    detail::ScratchLayout layout{block};
    const detail::InformationMemory memory{layout, mesh, view_count, maps, options, workers};
    detail::plan_samples(mesh, sphere, views, view_count,
                         {options.resolution, options.max_resolution, options.samples_per_polygon,
                          important ? options.importance : nullptr},
                         found.sampling, memory.levels);
    const int resolution = found.sampling.resolution;
    const bool even = found.sampling.polygons[1] + found.sampling.polygons[2] == 0;
    const std::uint8_t* const levels = even ? nullptr : memory.levels;

    Outcome outcome{};
    detail::InformationSums sums{mesh.triangle_count, memory.sums};
    detail::OpenAreas areas{mesh, sphere, views, resolution, memory.areas};
    for (std::size_t v = 0; v < view_count; ++v) {
        if (wanted(v) && mesh.triangle_count > 0) {
            const Outcome drawn = detail::count_visible(
                mesh, view_frame(views[v]), projection(views[v], resolution, resolution),
                resolution, resolution, sums.counts(),
                {.back_faces = found.back_faces, .levels = levels}, memory.pictures, executor);
            if (!drawn) return {drawn.error};
            outcome.work += drawn.work;
            ++found.views;
            if (sums.add(weight(v), executor)) areas.add(v);
            else ++found.blind_views;
        }
        if (options.progress != nullptr) options.progress(v + 1, view_count, options.user);
    }
    sums.finish();
    areas.finish();

    const detail::InformationResult result{mesh, sums, areas, levels, found.back_faces};
    std::atomic<std::size_t> states[5] = {};
    sums.for_each_block(executor, [&](std::size_t begin, std::size_t end) {
        std::size_t counts[5] = {};
        for (std::size_t o = begin; o < end; ++o) {
            const bool seen = sums.seen(o);
            if (maps.visibility != nullptr)
                maps.visibility[o] = seen ? static_cast<float>(result.visibility(o)) : 0;
            if (maps.state != nullptr || report != nullptr) {
                const PolygonState state = result.state(o);
                ++counts[static_cast<std::size_t>(state)];
                if (maps.state != nullptr) maps.state[o] = state;
            }
            const double information = seen ? sums.information(o) : 0;
            if (maps.pmi != nullptr) maps.pmi[o] = static_cast<float>(information);
            sums.results()[o] = seen ? information : std::numeric_limits<double>::infinity();
        }
        for (int i = 0; i < 5; ++i) states[i].fetch_add(counts[i], std::memory_order_relaxed);
    });
    if (maps.information_visibility != nullptr)
        static_cast<void>(normalise_information(sums.results(), nullptr, mesh.triangle_count,
                                                maps.information_visibility,
                                                detail::larger(options.equal_within, 1e-12)));
    if (report != nullptr) {
        found.polygons = {states[0], states[1], states[2], states[3], states[4]};
        *report = found;
    }
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
