#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>
#include <nook/scratch.hpp>

/// From a measure per polygon to a map: normalised, and interpolated to vertices (González, Sbert &
/// Feixas 2008, section 4).
namespace nook {

/// What the viewpoints know of a polygon.
enum class PolygonState : std::uint8_t {
    seen,
    hidden,       ///< never seen: others lie in front, as far as the samples tell
    too_small,    ///< never seen, but the pictures are too coarse to tell
    unusable,     ///< without area, or not finite: see `is_usable_triangle`
    turned_away,  ///< no viewpoint looks at its front
};

/// How many polygons are in each state.
struct PolygonStateCounts {
    std::size_t seen = 0, hidden = 0, too_small = 0, unusable = 0, turned_away = 0;
};

/// How much of a vertex each of its polygons counts for.
enum class VertexWeight : std::uint8_t { angle, area };

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Counts states; null counts as none.
[[nodiscard]] PolygonStateCounts count_states(const PolygonState* states, std::size_t count);

/// Mutual information to a map: the least of the seen polygons becomes 1, the largest 0, linearly
/// between. Polygons that are not `seen` get 0 and say nothing about the range. Where all are within
/// `equal_within` bits of each other, there is nothing to tell apart and all become 1: by default
/// within 1e-12, the rounding of sums that ought to be equal (for float values 2⁻²¹ of the largest, if
/// that is more). NaN and infinities count as unseen.
///
/// `information`: float or double, `count` of them, in bits. `states` as many, or null: all seen.
/// `visibility`: as many; it may be `information` itself.
template <class Real>
[[nodiscard]] Error normalise_information(const Real* information, const PolygonState* states,
                                          std::size_t count, float* visibility,
                                          double equal_within = 1e-12);

/// The mean of the values around each vertex, weighted by the angle or the area of the triangles. Only
/// seen, usable triangles with finite values take part; a vertex without any gets 0.
///
/// `values`: one per triangle. `states`: as many, or null: all seen. `vertex_values`:
/// mesh.vertex_count, apart from `values`. Vertices at one place that the mesh keeps apart are apart.
/// Scratch: `polygon_to_vertex_scratch_size`.
template <ScratchSource S = HeapScratch>
Outcome polygon_to_vertex_values(const MeshView& mesh, const float* values,
                                 const PolygonState* states, float* vertex_values,
                                 VertexWeight weight = VertexWeight::angle, S&& scratch = S{});

/// 16 bytes per vertex.
[[nodiscard]] std::size_t polygon_to_vertex_scratch_size(const MeshView& mesh);

namespace detail {

struct VertexSum {
    double value, weight;
};

/// The angle between two edges of a triangle, in radians; never 0, however sharp, as the area is that of
/// the whole triangle and not found from these two.
[[nodiscard]] inline double corner_angle(const Vector3& to_next, const Vector3& to_previous,
                                         double doubled_area)
{
    return std::atan2(doubled_area, dot(to_next, to_previous));
}

/// How near to the upper end of a range a value lies: 1 at its lower end, 0 at the upper.
class TurnedRange {
public:
    TurnedRange(double least, double most)
        // Where the range, or its reciprocal, might be beyond that of double.
        : unit_{most - least < 0x1p1000 ? 1 : 0x1p-30},
          most_{rounded(most * unit_)},
          range_{most_ - rounded(least * unit_)}
    {}
    [[nodiscard]] double operator()(double value) const
    {
        return (most_ - rounded(value * unit_)) / range_;
    }

private:
    double unit_, most_, range_;
};

/// The least range: with one that is smaller yet, a reciprocal would overflow.
inline constexpr double least_range = 0x1p-1000;

[[nodiscard]] inline bool is_seen(const PolygonState* states, std::size_t polygon)
{
    return states == nullptr || states[polygon] == PolygonState::seen;
}

}  // namespace detail

inline PolygonStateCounts count_states(const PolygonState* states, std::size_t count)
{
    PolygonStateCounts result{};
    for (std::size_t o = 0; states != nullptr && o < count; ++o) {
        switch (states[o]) {
        case PolygonState::seen: ++result.seen; break;
        case PolygonState::hidden: ++result.hidden; break;
        case PolygonState::too_small: ++result.too_small; break;
        case PolygonState::unusable: ++result.unusable; break;
        case PolygonState::turned_away: ++result.turned_away; break;
        }
    }
    return result;
}

template <class Real>
Error normalise_information(const Real* information, const PolygonState* states, std::size_t count,
                            float* visibility, double equal_within)
{
    static_assert(std::is_floating_point_v<Real>, "information is float or double");
    if (count == 0) return {};
    if (information == nullptr)
        return {ErrorCode::null_data, "information", 0, "one number per polygon"};
    if (visibility == nullptr)
        return {ErrorCode::null_data, "visibility", 0, "one number per polygon"};
    if (const Error error = detail::check_at_least(equal_within, 0, "equal_within", "bits, >= 0"))
        return error;
    double least = (std::numeric_limits<double>::max)(), most = -least;
    const auto counts = [&](std::size_t o) {
        return detail::is_seen(states, o) && detail::is_finite(information[o]);
    };
    for (std::size_t o = 0; o < count; ++o) {
        if (!counts(o)) continue;
        least = detail::smaller(least, double{information[o]});
        most = detail::larger(most, double{information[o]});
    }
    double tolerance = detail::larger(equal_within, detail::least_range);
    if constexpr (std::is_same_v<Real, float>)
        tolerance =
            detail::larger(tolerance, 0x1p-21 * detail::larger(std::fabs(least), std::fabs(most)));
    const detail::TurnedRange turned{least, most};
    for (std::size_t o = 0; o < count; ++o) {
        if (!counts(o)) visibility[o] = 0;
        else if (most - least <= tolerance) visibility[o] = 1;
        else visibility[o] = static_cast<float>(turned(double{information[o]}));
    }
    return {};
}

inline std::size_t polygon_to_vertex_scratch_size(const MeshView& mesh)
{
    detail::ScratchLayout layout;
    static_cast<void>(layout.take<detail::VertexSum>(mesh.vertex_count));
    return layout.size();
}

template <ScratchSource S>
Outcome polygon_to_vertex_values(const MeshView& mesh, const float* values,
                                 const PolygonState* states, float* vertex_values,
                                 VertexWeight weight, S&& scratch)
{
    if (const Error error = check_mesh(mesh)) return {error};
    if (values == nullptr && mesh.triangle_count > 0)
        return {{ErrorCode::null_data, "values", 0, "one number per triangle"}};
    if (vertex_values == nullptr && mesh.vertex_count > 0)
        return {{ErrorCode::null_data, "vertex_values", 0, "one number per vertex"}};
    if (mesh.vertex_count == 0) return {};
    if (values != nullptr && vertex_values < values + mesh.triangle_count &&
        values < vertex_values + mesh.vertex_count)
        return {{ErrorCode::overlap, "vertex_values", 0, "memory apart from every input"}};
    const std::size_t size = polygon_to_vertex_scratch_size(mesh);
    void* const block = scratch.reserve(size);
    if (block == nullptr) return {detail::check_scratch<S>(size)};
    detail::ScratchLayout layout{block};
    detail::VertexSum* const sums = layout.take<detail::VertexSum>(mesh.vertex_count);
    for (std::size_t i = 0; i < mesh.vertex_count; ++i) sums[i] = {0, 0};

    for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
        if (!detail::is_seen(states, t) || !detail::is_finite(values[t]) ||
            !is_usable_triangle(mesh, t))
            continue;
        const detail::Triangle corners = detail::mesh_triangle(mesh, t);
        const detail::Vector3 ab = corners.b - corners.a, bc = corners.c - corners.b,
                              ca = corners.a - corners.c;
        // From the edges that `is_usable_triangle` tells from parallel ones.
        const detail::Vector3 normal = cross(ab, ca);
        const double doubled_area = std::sqrt(dot(normal, normal));
        double weights[3] = {doubled_area, doubled_area, doubled_area};
        if (weight == VertexWeight::angle) {
            weights[0] = detail::corner_angle(ab, -ca, doubled_area);
            weights[1] = detail::corner_angle(bc, -ab, doubled_area);
            weights[2] = detail::corner_angle(ca, -bc, doubled_area);
        }
        for (std::size_t k = 0; k < 3; ++k) {
            detail::VertexSum& sum = sums[mesh.indices[3 * t + k]];
            sum.value += weights[k] * double{values[t]};
            sum.weight += weights[k];
        }
    }
    for (std::size_t i = 0; i < mesh.vertex_count; ++i)
        vertex_values[i] =
            sums[i].weight > 0 ? static_cast<float>(sums[i].value / sums[i].weight) : 0;
    return {};
}

}  // namespace nook::inline NOOK_TARGET
