#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/scratch.hpp>
#include <nook/target.hpp>

/// Quickhull in integers: Barber, Dobkin & Huhdanpaa 1996, "The Quickhull Algorithm for Convex
/// Hulls".
namespace nook::inline NOOK_TARGET::detail {

/// A point on the grid: coordinates from 0 to 2²⁹.
struct HullPoint {
    std::int32_t x, y, z;
};

/// How far a point lies above a plane, times the length of its normal: high · 2³² + low, exactly.
struct HullHeight {
    std::int64_t high, low;

    [[nodiscard]] bool above() const { return high > 0 || (high == 0 && low > 0); }
    [[nodiscard]] bool on() const { return high == 0 && low == 0; }
    [[nodiscard]] double value() const
    {
        return static_cast<double>(high) * 0x1p32 + static_cast<double>(low);
    }
};

/// The plane of three points, anticlockwise as seen from above it. The normal stays below 2⁵⁹.
struct HullPlane {
    HullPoint origin;
    std::int64_t x, y, z;

    HullPlane() = default;
    HullPlane(const HullPoint& a, const HullPoint& b, const HullPoint& c) : origin{a}
    {
        const std::int64_t px = b.x - a.x, py = b.y - a.y, pz = b.z - a.z;
        const std::int64_t qx = c.x - a.x, qy = c.y - a.y, qz = c.z - a.z;
        x = py * qz - pz * qy;
        y = pz * qx - px * qz;
        z = px * qy - py * qx;
    }
    [[nodiscard]] HullHeight height(const HullPoint& p) const
    {
        const std::int64_t dx = p.x - origin.x, dy = p.y - origin.y, dz = p.z - origin.z;
        // Both halves of the normal apart: below 2⁵⁸ and 3 · 2⁶¹.
        constexpr std::int64_t half = 0xffffffff;
        const std::int64_t low = (x & half) * dx + (y & half) * dy + (z & half) * dz;
        return {(x >> 32) * dx + (y >> 32) * dy + (z >> 32) * dz + (low >> 32), low & half};
    }
    [[nodiscard]] double length() const
    {
        const double a = static_cast<double>(x), b = static_cast<double>(y),
                     c = static_cast<double>(z);
        return std::sqrt(a * a + b * b + c * c);
    }
};

/// Builds in four steps: `snap` the points, `start` with a tetrahedron, `expand` it until no point
/// is outside, and `find_faces`. Then `write`.
class HullBuilder {
public:
    HullBuilder(const float* points, std::size_t count, std::ptrdiff_t stride)
        : source_{points},
          count_{static_cast<std::uint32_t>(count)},
          stride_{stride}
    {}

    void take(ScratchLayout& arrays)
    {
        const std::size_t n = count_;
        points_ = arrays.take<HullPoint>(n);
        sources_ = arrays.take<std::uint32_t>(n);
        next_ = arrays.take<std::uint32_t>(n);
        leaving_ = arrays.take<std::uint32_t>(n);
        fresh_ = arrays.take<std::uint32_t>(n);
        horizon_ = arrays.take<Edge>(n);
        facets_ = arrays.take<Facet>(2 * n);
        list_ = arrays.take<std::uint32_t>(2 * n);
    }

    /// Puts the finite points on the grid.
    void snap();
    /// The first tetrahedron; false when the points are flat.
    [[nodiscard]] bool start();
    /// Takes in one point after the other, the one farthest outside a facet first.
    void expand();
    /// Tells the vertices from points inside faces and edges.
    void find_faces();
    /// 3 floats and one index per vertex, 3 indices per triangle, of which there are
    /// 2 · vertices − 4.
    void write(float* positions, std::uint32_t* indices, std::uint32_t* points);

    [[nodiscard]] std::size_t dropped() const { return count_ - size_; }
    [[nodiscard]] std::size_t vertex_count() const { return vertex_count_; }
    /// The edge of a cell in world units.
    [[nodiscard]] double cell() const { return cell_; }

private:
    static constexpr std::uint32_t none = 0xffffffff;

    /// Edge k runs from corner k to the next one; neighbour k lies beyond it.
    struct Facet {
        std::uint32_t corner[3], neighbour[3];
        HullPlane plane;
        /// The points above it that are its own, as a list, and the highest of them.
        std::uint32_t first, highest;
        double height;
        /// Links of the facets that have points, or of the free ones.
        std::uint32_t before, after;
        /// The last point that it was removed for; later its face.
        std::uint32_t mark;
    };
    struct Edge {
        std::uint32_t from, to, beyond;
    };
    static constexpr std::uint32_t turn(std::uint32_t k) { return k == 2 ? 0 : k + 1; }

    [[nodiscard]] std::uint32_t edge_from(std::uint32_t facet, std::uint32_t corner) const
    {
        const Facet& f = facets_[facet];
        return f.corner[0] == corner ? 0 : f.corner[1] == corner ? 1 : 2;
    }
    std::uint32_t add_facet(std::uint32_t a, std::uint32_t b, std::uint32_t c);
    void remove_facet(std::uint32_t facet);
    /// Gives a point to the first of the fresh facets that it lies above; to none inside.
    void assign(std::uint32_t point, std::uint32_t fresh_count);
    void add_point(std::uint32_t facet);

    const float* source_;
    std::uint32_t count_;
    std::ptrdiff_t stride_;
    double cell_ = 0;
    double flatness_ = 0;  // cells
    std::uint32_t size_ = 0, used_ = 0, free_ = none, pending_ = none, vertex_count_ = 0;

    HullPoint* points_ = nullptr;
    std::uint32_t* sources_ = nullptr;  // where in the input a point was
    std::uint32_t* next_ = nullptr;     // in the list of its facet
    std::uint32_t* leaving_ = nullptr;  // the fresh facet whose horizon edge starts at a point
    std::uint32_t* fresh_ = nullptr;
    Edge* horizon_ = nullptr;
    Facet* facets_ = nullptr;
    std::uint32_t* list_ = nullptr;  // facets to visit
};

inline void HullBuilder::snap()
{
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, largest = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
        const float* at = source_ + static_cast<std::ptrdiff_t>(i) * stride_;
        if (!is_finite(at[0]) || !is_finite(at[1]) || !is_finite(at[2])) continue;
        for (int k = 0; k < 3; ++k) {
            const double value = at[k], size = value < 0 ? -value : value;
            if (size_ == 0 || value < low[k]) low[k] = value;
            if (size_ == 0 || value > high[k]) high[k] = value;
            if (size > largest) largest = size;
        }
        sources_[size_++] = i;
    }
    double extent = 0;
    for (int k = 0; k < 3; ++k) extent = high[k] - low[k] > extent ? high[k] - low[k] : extent;
    if (!(extent > 0)) return;
    int exponent = 0;
    std::frexp(extent, &exponent);
    const double scale = std::ldexp(1.0, 29 - exponent);
    cell_ = std::ldexp(1.0, exponent - 29);
    flatness_ = 0x1p-21 * largest * scale;
    for (std::uint32_t i = 0; i < size_; ++i) {
        const float* at = source_ + static_cast<std::ptrdiff_t>(sources_[i]) * stride_;
        const auto snapped = [&](int k) {
            return static_cast<std::int32_t>((double{at[k]} - low[k]) * scale + 0.5);
        };
        points_[i] = {snapped(0), snapped(1), snapped(2)};
    }
}

inline bool HullBuilder::start()
{
    if (size_ < 4 || cell_ == 0) return false;
    // Two ends of the longest side of the box, then the farthest from their line and from the
    // plane.
    std::uint32_t ends[3][2] = {};
    const auto coordinate = [&](std::uint32_t i, int k) {
        return k == 0 ? points_[i].x : k == 1 ? points_[i].y : points_[i].z;
    };
    for (std::uint32_t i = 1; i < size_; ++i)
        for (int k = 0; k < 3; ++k) {
            if (coordinate(i, k) < coordinate(ends[k][0], k)) ends[k][0] = i;
            if (coordinate(i, k) > coordinate(ends[k][1], k)) ends[k][1] = i;
        }
    const auto length = [&](int k) {
        return coordinate(ends[k][1], k) - coordinate(ends[k][0], k);
    };
    const int axis = length(0) >= length(1) ? (length(0) >= length(2) ? 0 : 2)
                                            : (length(1) >= length(2) ? 1 : 2);
    const std::uint32_t a = ends[axis][0], b = ends[axis][1];
    std::uint32_t c = a, d = a;
    double widest = 0, highest = 0;
    for (std::uint32_t i = 0; i < size_; ++i) {
        const double area = HullPlane{points_[a], points_[b], points_[i]}.length();
        if (!(area > widest)) continue;
        widest = area;
        c = i;
    }
    if (widest == 0) return false;
    const HullPlane plane{points_[a], points_[b], points_[c]};
    bool above = false;
    for (std::uint32_t i = 0; i < size_; ++i) {
        const double value = plane.height(points_[i]).value(), size = value < 0 ? -value : value;
        if (!(size > highest)) continue;
        highest = size;
        above = value > 0;
        d = i;
    }
    if (highest <= flatness_ * widest) return false;

    // The fourth corner lies below the first facet.
    const std::uint32_t p = a, q = above ? c : b, r = above ? b : c;
    fresh_[0] = add_facet(p, q, r);
    fresh_[1] = add_facet(d, q, p);
    fresh_[2] = add_facet(d, r, q);
    fresh_[3] = add_facet(d, p, r);
    const auto join = [&](int f, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
        std::uint32_t* neighbour = facets_[fresh_[f]].neighbour;
        neighbour[0] = fresh_[x];
        neighbour[1] = fresh_[y];
        neighbour[2] = fresh_[z];
    };
    join(0, 1, 2, 3);
    join(1, 2, 0, 3);
    join(2, 3, 0, 1);
    join(3, 1, 0, 2);
    for (std::uint32_t i = 0; i < size_; ++i)
        if (i != a && i != b && i != c && i != d) assign(i, 4);
    return true;
}

inline std::uint32_t HullBuilder::add_facet(std::uint32_t a, std::uint32_t b, std::uint32_t c)
{
    std::uint32_t facet = free_;
    if (facet != none) free_ = facets_[facet].after;
    else facet = used_++;
    facets_[facet] = {{a, b, c},
                      {none, none, none},
                      {points_[a], points_[b], points_[c]},
                      none,
                      none,
                      0,
                      none,
                      none,
                      none};
    return facet;
}

inline void HullBuilder::remove_facet(std::uint32_t facet)
{
    Facet& f = facets_[facet];
    if (f.first != none) {
        (f.before != none ? facets_[f.before].after : pending_) = f.after;
        if (f.after != none) facets_[f.after].before = f.before;
    }
    f.corner[0] = none;
    f.after = free_;
    free_ = facet;
}

inline void HullBuilder::assign(std::uint32_t point, std::uint32_t fresh_count)
{
    for (std::uint32_t i = 0; i < fresh_count; ++i) {
        Facet& f = facets_[fresh_[i]];
        const HullHeight height = f.plane.height(points_[point]);
        if (!height.above()) continue;
        if (f.first == none) {
            f.before = none;
            f.after = pending_;
            if (pending_ != none) facets_[pending_].before = fresh_[i];
            pending_ = fresh_[i];
        }
        next_[point] = f.first;
        f.first = point;
        const double value = height.value();
        if (f.highest == none || value > f.height) {
            f.highest = point;
            f.height = value;
        }
        return;
    }
}

inline void HullBuilder::expand()
{
    while (pending_ != none) add_point(pending_);
}

inline void HullBuilder::add_point(std::uint32_t facet)
{
    // Every facet below the point is removed. They lie together, since coplanar ones share their
    // side.
    const std::uint32_t apex = facets_[facet].highest;
    std::uint32_t visible = 0, edges = 0;
    facets_[facet].mark = apex;
    list_[visible++] = facet;
    for (std::uint32_t i = 0; i < visible; ++i) {
        const Facet& f = facets_[list_[i]];
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t beyond = f.neighbour[k];
            if (facets_[beyond].mark == apex) continue;
            if (facets_[beyond].plane.height(points_[apex]).above()) {
                facets_[beyond].mark = apex;
                list_[visible++] = beyond;
            } else {
                horizon_[edges++] = {f.corner[k], f.corner[turn(k)], beyond};
            }
        }
    }
    // What lay above them is homeless.
    std::uint32_t orphans = none;
    for (std::uint32_t i = 0; i < visible; ++i) {
        for (std::uint32_t point = facets_[list_[i]].first; point != none;) {
            const std::uint32_t after = next_[point];
            next_[point] = orphans;
            orphans = point;
            point = after;
        }
        remove_facet(list_[i]);
    }
    // A facet from each edge of the horizon to the point.
    for (std::uint32_t i = 0; i < edges; ++i) {
        const auto [from, to, beyond] = horizon_[i];
        fresh_[i] = add_facet(from, to, apex);
        facets_[fresh_[i]].neighbour[0] = beyond;
        facets_[beyond].neighbour[edge_from(beyond, to)] = fresh_[i];
        leaving_[from] = fresh_[i];
    }
    for (std::uint32_t i = 0; i < edges; ++i) {
        const std::uint32_t other = leaving_[horizon_[i].to];
        facets_[fresh_[i]].neighbour[1] = other;
        facets_[other].neighbour[2] = fresh_[i];
    }
    while (orphans != none) {
        const std::uint32_t point = orphans;
        orphans = next_[point];
        if (point != apex) assign(point, edges);
    }
}

inline void HullBuilder::find_faces()
{
    // Facets that lie in one plane are one face.
    for (std::uint32_t i = 0; i < used_; ++i) facets_[i].mark = none;
    for (std::uint32_t seed = 0; seed < used_; ++seed) {
        if (facets_[seed].corner[0] == none || facets_[seed].mark != none) continue;
        std::uint32_t found = 0;
        facets_[seed].mark = seed;
        list_[found++] = seed;
        for (std::uint32_t i = 0; i < found; ++i)
            for (const std::uint32_t beyond : facets_[list_[i]].neighbour) {
                Facet& other = facets_[beyond];
                bool coplanar = other.mark == none;
                for (const std::uint32_t corner : other.corner)
                    coplanar = coplanar && facets_[seed].plane.height(points_[corner]).on();
                if (!coplanar) continue;
                other.mark = seed;
                list_[found++] = beyond;
            }
    }
    for (std::uint32_t i = 0; i < used_; ++i) list_[i] = i;  // faces that are still to be written
    // A point where three faces meet is a vertex; others lie inside a face or an edge.
    std::uint32_t *const one = next_, *const two = leaving_, *const number = fresh_;
    for (std::uint32_t i = 0; i < size_; ++i) one[i] = two[i] = number[i] = none;
    for (std::uint32_t i = 0; i < used_; ++i) {
        if (facets_[i].corner[0] == none) continue;
        const std::uint32_t face = facets_[i].mark;
        for (const std::uint32_t corner : facets_[i].corner) {
            if (one[corner] == none || one[corner] == face) one[corner] = face;
            else if (two[corner] == none || two[corner] == face) two[corner] = face;
            else if (number[corner] == none) number[corner] = vertex_count_++;
        }
    }
}

inline void HullBuilder::write(float* positions, std::uint32_t* indices, std::uint32_t* points)
{
    const std::uint32_t* const number = fresh_;
    for (std::uint32_t i = 0; i < size_; ++i) {
        if (number[i] == none) continue;
        const float* at = source_ + static_cast<std::ptrdiff_t>(sources_[i]) * stride_;
        for (std::size_t k = 0; k < 3; ++k) positions[3 * std::size_t{number[i]} + k] = at[k];
        points[number[i]] = sources_[i];
    }
    // Around each face along its rim, in a fan from its first vertex.
    for (std::uint32_t i = 0; i < used_; ++i) {
        if (facets_[i].corner[0] == none || facets_[i].mark == none) continue;
        const std::uint32_t face = facets_[i].mark;
        const auto inside = [&](std::uint32_t f, std::uint32_t k) {
            return facets_[facets_[f].neighbour[k]].mark == face;
        };
        std::uint32_t edge = 0;
        while (edge < 3 && inside(i, edge)) ++edge;
        // A facet within its face, or of a face that is done.
        if (edge == 3 || list_[face] == none) continue;
        list_[face] = none;
        std::uint32_t at = i, k = edge, first = none, last = none;
        do {
            const std::uint32_t vertex = number[facets_[at].corner[k]];
            if (vertex != none) {
                if (first == none) first = vertex;
                else if (last == none) last = vertex;
                else {
                    *indices++ = first;
                    *indices++ = last;
                    *indices++ = vertex;
                    last = vertex;
                }
            }
            // The next edge of the rim leaves from the end of this one.
            const std::uint32_t end = facets_[at].corner[turn(k)];
            k = turn(k);
            while (inside(at, k)) {
                at = facets_[at].neighbour[k];
                k = edge_from(at, end);
            }
        } while (at != i || k != edge);
    }
}

}  // namespace nook::inline NOOK_TARGET::detail
