#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include <nook/checks.hpp>
#include <nook/execution.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/viewpoint_channel_areas.hpp>
#include <nook/scene/viewpoint_channel_pages.hpp>
#include <nook/scene/viewpoint_channel_pictures.hpp>
#include <nook/scene/viewpoint_channel_rows.hpp>
#include <nook/scene/visible_counts.hpp>

namespace nook {

/// How probable the viewpoints of a channel are. Those that see nothing have probability 0; the others
/// add up to 1.
enum class ViewProbability : std::uint8_t {
    projected_area,  ///< p(v) = a_v / Σ a_v, by what they see (González et al. 2008, section 3.1)
    uniform,
    importance,  ///< in proportion to numbers of the caller (section 5.2)
};

struct ChannelOptions {
    /// Pixels across the square picture of each viewpoint, 1 to 32768; with levels to 16383.
    int resolution = 512;
    BackFaces back_faces = BackFaces::occluding;
    ViewProbability probability = ViewProbability::projected_area;
    /// One per viewpoint, finite, ≥ 0, not all 0; read for ViewProbability::importance alone. Views of
    /// importance 0 are not drawn: they see nothing until the channel is built again.
    const double* importance = nullptr;
    /// As in VisibleCountOptions, or null.
    const std::uint8_t* levels = nullptr;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// The visibility channel between viewpoints and polygons (González, Sbert & Feixas 2008, section 3):
/// visible projected areas a(v, o), and the probabilities that follow from them,
///     a_v = Σ_o a(v, o),  p(o|v) = a(v, o) / a_v,  p(o) = Σ_v p(v) p(o|v),  p(v|o) = p(v) p(o|v) / p(o).
///
/// Sparse: a row per polygon, an entry for each view that sees it. Built from a mesh, polygons are its
/// triangles, and an area is the number of samples that show the triangle in a picture of the view: to
/// compare, views need pictures of one scale. It errs by the pixels on the outline of what is seen,
/// and a triangle that covers no sample counts as not seen. What no view sees has p(o) = 0, and its
/// p(v|o) are 0 too. Queries may run on any number of threads at once.
class ViewpointChannel {
public:
    ViewpointChannel() = default;
    ViewpointChannel(ViewpointChannel&& other) noexcept { swap(other); }
    ViewpointChannel& operator=(ViewpointChannel&& other) noexcept
    {
        ViewpointChannel taken{std::move(other)};
        swap(taken);
        return *this;
    }

    /// From pictures of a mesh, in place of what was there; on an error it is left as it was. At most
    /// 65535 views; a camera that `check_camera` refuses is an error with the index of the view.
    ///
    /// Memory: 4 bytes per entry (8 for counts of 2¹⁶ and more), 16 per polygon, 40 per view; while it
    /// builds also 4 per polygon, the scratch of `visible_counts`, and about a sixteenth of the entries.
    /// The same bits with any executor. `work` is that of all pictures.
    template <Executor E = Serial>
    Outcome build(const MeshView& mesh, const Camera* views, std::size_t view_count,
                  const ChannelOptions& options = {}, const Memory& memory = {},
                  E&& executor = E{});

    /// From areas[v * polygon_count + o], finite and ≥ 0, in any unit; p(v) is by projected area. What is
    /// below 2⁻⁴⁰⁰ of the largest area counts as 0. On an error the channel is left as it was. 10 bytes
    /// per entry.
    [[nodiscard]] Error build(const double* areas, std::size_t view_count,
                              std::size_t polygon_count, const Memory& memory = {});

    /// Changes p(v) and all that follows from it; on an error nothing changes. `importance` as in
    /// ChannelOptions; what is below 2⁻⁴⁰⁰ of the largest number of a view that sees something counts
    /// as 0.
    [[nodiscard]] Error set_probability(ViewProbability probability,
                                        const double* importance = nullptr);

    [[nodiscard]] std::size_t view_count() const { return rows_.view_count; }
    [[nodiscard]] std::size_t polygon_count() const { return rows_.polygon_count; }
    /// Pairs of a view and a polygon that it sees.
    [[nodiscard]] std::size_t entry_count() const { return rows_.entry_count; }
    /// Bytes kept.
    [[nodiscard]] std::size_t memory_size() const { return memory_.size(); }

    /// a(v, o) in samples (pixels, or 1/16 of them with levels), or in the caller's unit.
    /// O(log views).
    [[nodiscard]] double area(std::size_t v, std::size_t o) const
    {
        return rows_.amount(v, o) * rows_.unit;
    }
    /// a_v, whatever p(v).
    [[nodiscard]] double view_area(std::size_t v) const { return rows_.view_area[v] * rows_.unit; }
    /// Σ_v a(v, o), whatever p(v). O(views that see it).
    [[nodiscard]] double polygon_area(std::size_t o) const;
    /// Σ_v a_v.
    [[nodiscard]] double total_area() const { return rows_.total_area * rows_.unit; }

    [[nodiscard]] double p_view(std::size_t v) const { return rows_.p_view[v]; }
    [[nodiscard]] double p_polygon(std::size_t o) const { return rows_.p_polygon[o]; }
    /// p(o|v), whatever p(v); 0 for views that see nothing.
    [[nodiscard]] double p_polygon_given_view(std::size_t o, std::size_t v) const
    {
        return rows_.view_area[v] > 0 ? rows_.amount(v, o) / rows_.view_area[v] : 0;
    }
    /// p(v|o); 0 for polygons that no view of p(v) > 0 sees.
    [[nodiscard]] double p_view_given_polygon(std::size_t v, std::size_t o) const
    {
        return seen(o) ? detail::rounded(rows_.amount(v, o) * rows_.scale[v]) / rows_.p_polygon[o]
                       : 0;
    }
    /// Some view of p(v) > 0 sees polygon o: p(o) > 0.
    [[nodiscard]] bool seen(std::size_t o) const { return rows_.p_polygon[o] > 0; }

    /// Calls f(v, a, q) for each view with p(v) > 0 that sees polygon o, in increasing order: the area
    /// and the joint probability q = p(v) p(o|v) > 0.
    template <class F>
    void for_each_view(std::size_t o, const F& f) const
    {
        rows_.visit(o, [&](std::size_t v, auto amount) {
            const double a = double(amount), scale = rows_.scale[v];
            if (scale > 0) f(v, a * rows_.unit, a * scale);
        });
    }

    /// What the measures read.
    [[nodiscard]] const detail::ChannelRows& rows() const { return rows_; }

private:
    void swap(ViewpointChannel& other) noexcept
    {
        std::swap(memory_, other.memory_);
        std::swap(rows_, other.rows_);
    }
    void find_view_probabilities(ViewProbability probability, const double* importance);

    detail::ChannelMemory memory_{};
    detail::ChannelRows rows_{};
};

namespace detail {

/// Counts of the finest samples, 16 to a pixel, fit into 32 bits up to here.
inline constexpr int largest_levelled_resolution = 16383;

[[nodiscard]] inline Error check_probability(ViewProbability probability, const char* name)
{
    if (probability <= ViewProbability::importance) return {};
    return {ErrorCode::bad_value, name, double(probability), "a value of ViewProbability"};
}

}  // namespace detail

template <Executor E>
Outcome ViewpointChannel::build(const MeshView& mesh, const Camera* views, std::size_t view_count,
                                const ChannelOptions& options, const Memory& memory, E&& executor)
{
    if (const Error error = check_mesh(mesh)) return {error};
    if (const Error error = detail::check_channel_size(view_count, mesh.triangle_count))
        return {error};
    if (views == nullptr && view_count > 0)
        return {{ErrorCode::null_data, "views", 0, "one camera per view"}};
    for (std::size_t v = 0; v < view_count; ++v)
        if (const Error error = check_camera(views[v]))
            return {{error.code, "index of a view", double(v), "cameras that pass check_camera"}};
    if (options.resolution < 1 || options.resolution > detail::largest_raster_size)
        return {{ErrorCode::bad_value, "options.resolution", double(options.resolution),
                 "1 to 32768 pixels"}};
    if (options.levels != nullptr && options.resolution > detail::largest_levelled_resolution)
        return {{ErrorCode::bad_value, "options.resolution", double(options.resolution),
                 "1 to 16383 pixels with levels"}};
    if (const Error error = detail::check_probability(options.probability, "options.probability"))
        return {error};
    const bool important = options.probability == ViewProbability::importance;
    if (important)
        if (const Error error =
                detail::check_importance(options.importance, view_count, "options.importance"))
            return {error};

    ViewpointChannel built;
    built.rows_.view_count = view_count;
    built.rows_.polygon_count = mesh.triangle_count;
    detail::ChannelPictures pictures{mesh,
                                     views,
                                     view_count,
                                     options.resolution,
                                     {.back_faces = options.back_faces, .levels = options.levels},
                                     important ? options.importance : nullptr};
    const Outcome outcome = pictures.fill(built.rows_, built.memory_, memory, executor);
    if (!outcome) return {outcome.error};
    detail::find_totals(built.rows_);
    built.find_view_probabilities(options.probability, options.importance);
    detail::find_polygon_probabilities(built.rows_, executor);
    swap(built);
    return outcome;
}

inline Error ViewpointChannel::build(const double* areas, std::size_t view_count,
                                     std::size_t polygon_count, const Memory& memory)
{
    if (const Error error = detail::check_channel_size(view_count, polygon_count)) return error;
    if (areas == nullptr && view_count > 0 && polygon_count > 0)
        return {ErrorCode::null_data, "areas", 0, "one area per view and polygon"};
    ViewpointChannel built;
    built.rows_.view_count = view_count;
    built.rows_.polygon_count = polygon_count;
    if (const Error error = detail::fill_rows(areas, built.rows_, built.memory_, memory))
        return error;
    detail::find_totals(built.rows_);
    built.find_view_probabilities(ViewProbability::projected_area, nullptr);
    Serial serial;
    detail::find_polygon_probabilities(built.rows_, serial);
    swap(built);
    return {};
}

inline Error ViewpointChannel::set_probability(ViewProbability probability,
                                               const double* importance)
{
    if (const Error error = detail::check_probability(probability, "probability")) return error;
    if (probability == ViewProbability::importance)
        if (const Error error = detail::check_importance(importance, view_count(), "importance"))
            return error;
    find_view_probabilities(probability, importance);
    Serial serial;
    detail::find_polygon_probabilities(rows_, serial);
    return {};
}

inline void ViewpointChannel::find_view_probabilities(ViewProbability probability,
                                                      const double* importance)
{
    switch (probability) {
    case ViewProbability::projected_area:
        return detail::find_view_probabilities(rows_,
                                               [&](std::size_t v) { return rows_.view_area[v]; });
    case ViewProbability::uniform:
        return detail::find_view_probabilities(rows_, [](std::size_t) { return 1; });
    case ViewProbability::importance:
        return detail::find_view_probabilities(rows_, [&](std::size_t v) { return importance[v]; });
    }
}

inline double ViewpointChannel::polygon_area(std::size_t o) const
{
    detail::LongSum sum;
    rows_.visit(o, [&](std::size_t, auto amount) { sum.add(double(amount)); });
    return sum.total() * rows_.unit;
}

}  // namespace nook::inline NOOK_TARGET
