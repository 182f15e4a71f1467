#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <nook/scene/memory.hpp>
#include <nook/scene/outline_direction.hpp>
#include <nook/scene/outline_edges.hpp>
#include <nook/scene/outline_options.hpp>

/// The vertices of shells: each fan of triangles around a place becomes one, or several where one would
/// be drawn into a spike.
///
/// A vertex that moves by x covers all within e of its place in the directions u with u · x >= 1. Where
/// that holds for normals, it does for every direction between them. So the directions between the
/// normals of a fan are divided among its vertices, at planes halfway between faces and at a tip.
namespace nook::inline NOOK_TARGET::detail {

/// Faces that hang together, side by side; behind those of an open object come their backs.
struct ShellObject {
    std::uint32_t first_face, front_count;
    bool open, inward;
    Vector3 centre;
    /// The largest distance of a vertex from the centre.
    double reach;
    [[nodiscard]] std::uint32_t face_count() const { return open ? 2 * front_count : front_count; }
};

/// The triangles of all objects, every edge of which is paired.
struct ShellSurface {
    FaceList faces;
    const std::uint32_t* pair;
    /// One per face, of length 1.
    const Vector3* normals;
};

class FanVertices {
public:
    explicit FanVertices(const OutlineOptions& options)
        : options_{options},
          // Two faces at an angle of t lengthen their mitre by 1 / cos(t / 2).
          sharp_cosine_{2 / (options.mitre_limit * options.mitre_limit) - 1},
          sine_tolerance_{std::sin(options.normal_tolerance)}
    {}
    /// Returns how many bytes could not be had: 0 on success.
    [[nodiscard]] std::size_t allocate(const ShellSurface& surface);
    /// Gives the corners of an object their vertices; objects come in the order of their faces.
    void add(const ShellObject& object);

    [[nodiscard]] std::uint32_t count() const { return count_; }
    /// The vertices of a corner, on the side of the edge that ends in it and of the one that begins.
    [[nodiscard]] std::uint32_t ends_in(std::uint32_t corner) const { return ends_in_[corner]; }
    [[nodiscard]] std::uint32_t begins_in(std::uint32_t corner) const { return begins_in_[corner]; }
    /// Corners fan by fan, as many as there are: those of an object lie where its own numbers do.
    [[nodiscard]] std::uint32_t ring_corner(std::uint32_t i) const { return rings_[i] & ~last_bit; }
    [[nodiscard]] bool ends_ring(std::uint32_t i) const { return (rings_[i] & last_bit) != 0; }
    [[nodiscard]] std::uint32_t place(std::uint32_t vertex) const { return place_of_[vertex]; }
    [[nodiscard]] const float* direction(std::uint32_t vertex) const
    {
        return directions_ + std::size_t{3} * vertex;
    }
    /// The least that a vertex moves along a normal that it has to do with, at extent 1.
    [[nodiscard]] double face_offset() const { return face_offset_; }

private:
    static constexpr std::uint32_t last_bit = 0x80000000;

    /// Corners of a fan side by side, and the planes that divide it from what is beside it; those
    /// without a normal are (0, 0, 0).
    struct Run {
        const std::uint32_t* corners;
        std::uint32_t count;
        Vector3 before, after, tip;
    };

    std::uint32_t trace(std::uint32_t corner, std::uint32_t* ring) const;
    void divide(const ShellObject& object, std::uint32_t* ring, std::uint32_t count);
    [[nodiscard]] Vector3 tip_of(const std::uint32_t* ring, std::uint32_t count) const;
    /// Whether one vertex within the limit will do; it gets all corners.
    bool place_together(const Run& run);
    void place_apart(const Run& run);
    void place_face(const Run& run);
    [[nodiscard]] Vector3 direction_of(const Run& run) const;
    [[nodiscard]] Vector3 angle_weighted(const Run& run) const;
    /// False also for 0, which stands for no direction.
    [[nodiscard]] bool within_limit(const Vector3& direction) const
    {
        const double square = dot(direction, direction), limit = options_.mitre_limit * (1 + 1e-6);
        return square > 0 && square <= limit * limit;
    }
    [[nodiscard]] bool sharp(std::uint32_t a, std::uint32_t b) const
    {
        return dot(surface_.normals[a / 3], surface_.normals[b / 3]) < sharp_cosine_;
    }
    /// How the surface bends across the edge before a corner of a ring: > 0 convex, < 0 concave.
    [[nodiscard]] double bend(std::uint32_t corner) const;
    [[nodiscard]] Vector3 cut(std::uint32_t corner) const;
    void leave_concave(const ShellObject& object, const std::uint32_t* ring, std::uint32_t count);
    /// Calls visit(normal) for the normals of a run and its planes.
    template <class Visit>
    void for_each_normal(const Run& run, const Visit& visit) const;
    std::uint32_t add_vertex(const Run& run, const Vector3& direction);
    void set_vertex(std::uint32_t corner, std::uint32_t vertex)
    {
        ends_in_[corner] = begins_in_[corner] = vertex;
    }

    const OutlineOptions& options_;
    double sharp_cosine_, sine_tolerance_;
    ShellSurface surface_{};
    Block block_;
    std::uint32_t *rings_ = nullptr, *ends_in_ = nullptr, *begins_in_ = nullptr;
    std::uint32_t ring_size_ = 0;
    std::uint32_t* place_of_ = nullptr;
    float* directions_ = nullptr;
    std::uint32_t count_ = 0;
    double face_offset_ = std::numeric_limits<double>::infinity();
};

inline std::size_t FanVertices::allocate(const ShellSurface& surface)
{
    surface_ = surface;
    const std::size_t corner_count = std::size_t{3} * surface.faces.count;
    const std::size_t lacking =
        allocate_arrays(block_, options_.memory, [&](ScratchLayout& arrays) {
            rings_ = arrays.take<std::uint32_t>(corner_count);
            ends_in_ = arrays.take<std::uint32_t>(corner_count);
            begins_in_ = arrays.take<std::uint32_t>(corner_count);
            place_of_ = arrays.take<std::uint32_t>(2 * corner_count);
            directions_ = arrays.take<float>(6 * corner_count);
        });
    if (lacking > 0) return lacking;
    for (std::size_t i = 0; i < corner_count; ++i) ends_in_[i] = unpaired;
    return 0;
}

inline void FanVertices::add(const ShellObject& object)
{
    const std::uint32_t first = 3 * object.first_face;
    for (std::uint32_t c = first; c < first + 3 * object.face_count(); ++c) {
        if (ends_in_[c] != unpaired) continue;
        std::uint32_t* const ring = rings_ + ring_size_;
        const std::uint32_t count = trace(c, ring);
        divide(object, ring, count);
        ring[count - 1] |= last_bit;
        ring_size_ += count;
    }
}

/// Writes the corners around a vertex, one after the other across paired edges.
inline std::uint32_t FanVertices::trace(std::uint32_t corner, std::uint32_t* ring) const
{
    std::uint32_t count = 0, at = corner;
    do {
        ring[count++] = at;
        at = surface_.pair[previous_corner(at)];
    } while (at != corner);
    return count;
}

/// Gives the corners of a fan their vertices: one for all, or one for each run between sharp edges.
inline void FanVertices::divide(const ShellObject& object, std::uint32_t* ring, std::uint32_t count)
{
    constexpr Vector3 none{0, 0, 0};
    if (options_.method == OutlineMethod::scaling) {
        const Vector3 from_centre = surface_.faces.position(ring[0]) - object.centre;
        const std::uint32_t vertex =
            add_vertex({ring, count, none, none, none}, from_centre * (1 / object.reach));
        for (std::uint32_t i = 0; i < count; ++i) set_vertex(ring[i], vertex);
        return leave_concave(object, ring, count);
    }
    std::uint32_t first = 0, runs = 0;
    for (std::uint32_t i = count; i-- > 0;)
        if (sharp(ring[i == 0 ? count - 1 : i - 1], ring[i])) {
            first = i;
            ++runs;
        }
    if (runs == 0) {
        Run run{ring, count, none, none, none};
        if (!place_together(run)) {
            run.tip = tip_of(ring, count);
            run.before = run.after = cut(ring[count - 1]);
            place_apart(run);
        }
        return leave_concave(object, ring, count);
    }
    trace(ring[first], ring);
    const Vector3 tip = tip_of(ring, count);
    for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
        end = begin + 1;
        while (end < count && !sharp(ring[end - 1], ring[end])) ++end;
        // Two runs meet between their planes; more have a tip in the middle.
        Run run{ring + begin, end - begin, cut(ring[begin == 0 ? count - 1 : begin - 1]),
                cut(ring[end - 1]), runs > 2 ? tip : none};
        if (place_together(run)) continue;
        run.tip = tip;
        place_apart(run);
    }
    leave_concave(object, ring, count);
}

/// Away from the edges of a fan: at most a right angle from the normals of a convex one. (0, 0, 0) if
/// there is no such direction.
inline Vector3 FanVertices::tip_of(const std::uint32_t* ring, std::uint32_t count) const
{
    Vector3 sum{0, 0, 0};
    for (std::uint32_t i = 0; i < count; ++i)
        sum = sum + normalised(surface_.faces.position(ring[i]) -
                               surface_.faces.position(next_corner(ring[i])));
    return largest(sum) > 1e-6 ? normalised(sum) : Vector3{0, 0, 0};
}

/// The edge between a corner of a ring and the next one ends in the corner.
inline double FanVertices::bend(std::uint32_t corner) const
{
    const std::uint32_t edge = previous_corner(corner);
    const Vector3 along =
        normalised(surface_.faces.position(corner) - surface_.faces.position(edge));
    return dot(cross(surface_.normals[edge / 3], surface_.normals[surface_.pair[edge] / 3]), along);
}

/// The normal of the plane that cuts off the convex edge after a corner of a ring: halfway between the
/// directions in which its faces end, which tells it where the normals cancel too. (0, 0, 0) for a
/// concave one, and a flat one.
inline Vector3 FanVertices::cut(std::uint32_t corner) const
{
    const std::uint32_t edge = previous_corner(corner);
    if (bend(corner) < -1e-6) return {0, 0, 0};
    const Vector3 along =
        normalised(surface_.faces.position(corner) - surface_.faces.position(edge));
    return normalised(
        cross(along, surface_.normals[edge / 3] - surface_.normals[surface_.pair[edge] / 3]));
}

inline bool FanVertices::place_together(const Run& run)
{
    const Vector3 direction = direction_of(run);
    if (!within_limit(direction)) return false;
    const std::uint32_t vertex = add_vertex(run, direction);
    for (std::uint32_t i = 0; i < run.count; ++i) set_vertex(run.corners[i], vertex);
    return true;
}

/// The direction of a run, or 0 where the method has none.
inline Vector3 FanVertices::direction_of(const Run& run) const
{
    if (options_.method == OutlineMethod::vertex_normals) return angle_weighted(run);
    Vector3 planes[3];
    int plane_count = 0;
    for (const Vector3& plane : {run.before, run.after, run.tip})
        if (dot(plane, plane) > 0) planes[plane_count++] = plane;
    const int own = static_cast<int>(run.count), count = own + plane_count;
    const auto normal_at = [&](int i) -> const Vector3& {
        return i < own ? surface_.normals[run.corners[i] / 3] : planes[i - own];
    };
    NormalSet set{options_.normal_tolerance};
    for (int i = 0; i < count; ++i) set.add(normal_at(i));
    const Vector3 average = set.average();
    if (options_.method == OutlineMethod::integrated_normals)
        return largest(average) > 1e-6 ? average : Vector3{0, 0, 0};
    // Planes that are nearly one may meet anywhere. What reaches all with half the way is better then.
    const Vector3 mitre = reaching(set.mitre(), count, normal_at);
    const Vector3 simple = reaching(average, count, normal_at);
    const double square = dot(mitre, mitre), limit = options_.mitre_limit * options_.mitre_limit;
    if (square > 0 && square <= limit && square <= 4 * dot(simple, simple)) return mitre;
    return shortest_reaching(count, normal_at);
}

/// The average weighted by the angle that each triangle has at the vertex (Thurmer & Wuthrich 1998): it
/// does not depend on how faces are cut into triangles.
inline Vector3 FanVertices::angle_weighted(const Run& run) const
{
    Vector3 sum{0, 0, 0};
    double total = 0;
    for (std::uint32_t i = 0; i < run.count; ++i) {
        const std::uint32_t corner = run.corners[i];
        const Vector3 at = surface_.faces.position(corner);
        const Vector3 to_next = normalised(surface_.faces.position(next_corner(corner)) - at);
        const Vector3 to_previous =
            normalised(surface_.faces.position(previous_corner(corner)) - at);
        const Vector3 area = cross(to_next, to_previous);
        const double angle = std::atan2(std::sqrt(dot(area, area)), dot(to_next, to_previous));
        sum = sum + surface_.normals[corner / 3] * angle;
        total += angle;
    }
    if (!(largest(sum) > 1e-6 * total)) return {0, 0, 0};
    sum = normalised(sum);
    sum = sum + run.before + run.after + run.tip;
    return largest(sum) > 1e-6 ? normalised(sum) : Vector3{0, 0, 0};
}

/// Vertices for each face of a run, divided by the planes that cut off its edges and the tip.
inline void FanVertices::place_apart(const Run& run)
{
    const NormalSet tolerance{options_.normal_tolerance};
    Vector3 before = run.before;
    for (std::uint32_t begin = 0, end = 0; begin < run.count; begin = end) {
        const Vector3& normal = surface_.normals[run.corners[begin] / 3];
        for (end = begin + 1; end < run.count; ++end)
            if (!tolerance.same(normal, surface_.normals[run.corners[end] / 3])) break;
        const Vector3 after = end == run.count ? run.after : cut(run.corners[end - 1]);
        place_face({run.corners + begin, end - begin, before, after, run.tip});
        before = after;
    }
}

/// One vertex for the corners of one face; where it had to go too far, one on either side.
inline void FanVertices::place_face(const Run& run)
{
    if (place_together(run)) return;
    constexpr Vector3 none{0, 0, 0};
    const Vector3 sides[2] = {run.before, run.after};
    std::uint32_t vertices[2];
    for (int side = 0; side < 2; ++side) {
        Run taken{run.corners, run.count, none, none, none};
        Vector3 direction = surface_.normals[run.corners[0] / 3];
        for (const Run& tried : {taken, Run{run.corners, run.count, sides[side], none, none},
                                 Run{run.corners, run.count, sides[side], none, run.tip}}) {
            const Vector3 x = direction_of(tried);
            if (!within_limit(x)) continue;
            direction = x;
            taken = tried;
        }
        vertices[side] = add_vertex(taken, direction);
    }
    for (std::uint32_t i = 0; i < run.count; ++i) set_vertex(run.corners[i], vertices[1]);
    begins_in_[run.corners[0]] = vertices[0];
}

/// Takes the movement from the vertices of a fan in which the surface bends inward. The back of an
/// open surface bends the other way and keeps its own.
inline void FanVertices::leave_concave(const ShellObject& object, const std::uint32_t* ring,
                                       std::uint32_t count)
{
    if (!options_.skip_concave) return;
    const std::uint32_t fronts = 3 * (object.first_face + object.front_count);
    bool concave = false;
    for (std::uint32_t i = 0; i < count; ++i)
        concave =
            concave || (ring[i] < fronts && surface_.pair[previous_corner(ring[i])] < fronts &&
                        bend(ring[i]) < -sine_tolerance_);
    if (concave) face_offset_ = (std::min)(face_offset_, 0.0);
    for (std::uint32_t i = 0; i < count && concave; ++i)
        for (std::uint32_t k = 0; k < 3 && ring[i] < fronts; ++k)
            for (const std::uint32_t vertex : {ends_in_[ring[i]], begins_in_[ring[i]]})
                directions_[std::size_t{3} * vertex + k] = 0;
}

template <class Visit>
void FanVertices::for_each_normal(const Run& run, const Visit& visit) const
{
    for (std::uint32_t i = 0; i < run.count; ++i) visit(surface_.normals[run.corners[i] / 3]);
    for (const Vector3& plane : {run.before, run.after, run.tip})
        if (dot(plane, plane) > 0) visit(plane);
}

inline std::uint32_t FanVertices::add_vertex(const Run& run, const Vector3& direction)
{
    float* const at = directions_ + std::size_t{3} * count_;
    at[0] = static_cast<float>(direction.x);
    at[1] = static_cast<float>(direction.y);
    at[2] = static_cast<float>(direction.z);
    const Vector3 kept{double{at[0]}, double{at[1]}, double{at[2]}};
    for_each_normal(run, [&](const Vector3& normal) {
        face_offset_ = (std::min)(face_offset_, dot(kept, normal));
    });
    place_of_[count_] = surface_.faces.corners[run.corners[0]];
    return count_++;
}

}  // namespace nook::inline NOOK_TARGET::detail
