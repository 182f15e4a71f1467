#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/outline_weld.hpp>

namespace nook {

struct NeighbourOptions {
    /// Which vertices are the same: negative, those with one index; 0, also those with equal
    /// coordinates, which joins faces that were split for their normals or texture; more, also those no
    /// farther apart than this, in world units.
    double weld = 0;
    /// Where the neighbours and the builder's working memory come from.
    Memory memory{};
};

/// The neighbours of one polygon, in increasing order.
struct NeighbourList {
    const std::uint32_t* first = nullptr;
    std::size_t count = 0;

    [[nodiscard]] NOOK_INLINE const std::uint32_t* begin() const { return first; }
    [[nodiscard]] NOOK_INLINE const std::uint32_t* end() const { return first + count; }
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Which triangles of a mesh share an edge: two vertices, in either order.
///
/// Where more than two triangles meet at an edge, each is a neighbour of all others; where more than
/// `most_around` do, only of the one before and the one after it, by index and in a circle, so that the
/// lists stay short. A neighbour across two edges counts once. Unusable triangles have none.
class PolygonNeighbours {
public:
    static constexpr std::size_t most_around = 16;

    PolygonNeighbours() = default;
    PolygonNeighbours(PolygonNeighbours&& other) noexcept { swap(other); }
    PolygonNeighbours& operator=(PolygonNeighbours&& other) noexcept
    {
        PolygonNeighbours taken{std::move(other)};
        swap(taken);
        return *this;
    }

    /// Builds from a mesh of at most 2³⁰ triangles, in place of what was there; on an error it is left
    /// as it was. The mesh may go afterwards. Linear in triangles and vertices.
    [[nodiscard]] Error build(const MeshView& mesh, const NeighbourOptions& options = {});

    /// Triangles of the mesh.
    [[nodiscard]] std::size_t polygon_count() const { return polygon_count_; }
    /// The neighbours of polygon o < polygon_count().
    [[nodiscard]] NeighbourList operator[](std::size_t o) const
    {
        return {neighbours_ + first_[o], static_cast<std::size_t>(first_[o + 1] - first_[o])};
    }
    /// Pairs of neighbours, each counted from both sides.
    [[nodiscard]] std::size_t size() const
    {
        return polygon_count_ == 0 ? 0 : static_cast<std::size_t>(first_[polygon_count_]);
    }

private:
    void swap(PolygonNeighbours& other) noexcept
    {
        std::swap(block_, other.block_);
        std::swap(polygon_count_, other.polygon_count_);
        std::swap(first_, other.first_);
        std::swap(neighbours_, other.neighbours_);
    }

    detail::Block block_;
    std::size_t polygon_count_ = 0;
    /// One more than polygons: where their lists begin.
    std::uint64_t* first_ = nullptr;
    std::uint32_t* neighbours_ = nullptr;
};

namespace detail {

/// The edges of the usable triangles, so that those between the same two places lie side by side, by
/// triangle. An edge is the number of the corner that it starts at.
class SortedEdges {
public:
    SortedEdges(const MeshView& mesh, const NeighbourOptions& options)
        : mesh_{mesh},
          options_{options},
          welder_{mesh, options.weld}
    {}
    /// Returns how many bytes could not be had: 0 on success.
    [[nodiscard]] std::size_t sort();

    /// Calls visit(edges, count) for the edges between each two places.
    template <class Visit>
    void for_each_group(const Visit& visit) const
    {
        for (std::size_t begin = 0, end = 0; begin < count_; begin = end) {
            while (end < count_ && ends(edges_[end]) == ends(edges_[begin])) ++end;
            visit(edges_ + begin, end - begin);
        }
    }

private:
    struct Ends {
        std::uint32_t low, high;
        friend constexpr bool operator==(const Ends&, const Ends&) = default;
    };
    [[nodiscard]] Ends ends(std::uint32_t edge) const
    {
        const std::uint32_t a = corners_[edge];
        const std::uint32_t b = corners_[edge % 3 == 2 ? edge - 2 : edge + 1];
        return a < b ? Ends{a, b} : Ends{b, a};
    }
    /// Sorts by a key below `keys`; edges of one key stay in order.
    template <class Key>
    void pass(const std::uint32_t* from, std::uint32_t* to, std::size_t keys, const Key& key)
    {
        for (std::size_t i = 0; i <= keys; ++i) starts_[i] = 0;
        for (std::size_t i = 0; i < count_; ++i) ++starts_[std::size_t{key(from[i])} + 1];
        for (std::size_t i = 1; i <= keys; ++i) starts_[i] += starts_[i - 1];
        for (std::size_t i = 0; i < count_; ++i) to[starts_[key(from[i])]++] = from[i];
    }

    const MeshView& mesh_;
    const NeighbourOptions& options_;
    Welder welder_;
    Block block_;
    std::uint32_t *corners_ = nullptr, *edges_ = nullptr, *other_ = nullptr, *starts_ = nullptr;
    std::size_t count_ = 0;
};

inline std::size_t SortedEdges::sort()
{
    const bool welded = options_.weld >= 0;
    std::size_t lacking = welded ? welder_.allocate(options_.memory) : 0;
    if (lacking > 0) return lacking;
    const std::size_t most = 3 * mesh_.triangle_count;
    lacking = allocate_arrays(block_, options_.memory, [&](ScratchLayout& arrays) {
        corners_ = arrays.take<std::uint32_t>(most);
        edges_ = arrays.take<std::uint32_t>(most);
        other_ = arrays.take<std::uint32_t>(most);
        starts_ = arrays.take<std::uint32_t>(mesh_.vertex_count + 1);
    });
    if (lacking > 0) return lacking;
    for (std::size_t t = 0; t < mesh_.triangle_count; ++t) {
        if (!is_usable_triangle(mesh_, t)) continue;
        const auto first = static_cast<std::uint32_t>(3 * t);
        for (std::uint32_t edge = first; edge < first + 3; ++edge)
            corners_[edge] = welded ? welder_.place(mesh_.indices[edge]) : mesh_.indices[edge];
        // Welding may close an edge.
        for (std::uint32_t edge = first; edge < first + 3; ++edge)
            if (const Ends e = ends(edge); e.low != e.high) edges_[count_++] = edge;
    }
    const std::size_t places = welded ? welder_.count() : mesh_.vertex_count;
    pass(edges_, other_, places, [&](std::uint32_t edge) { return ends(edge).high; });
    pass(other_, edges_, places, [&](std::uint32_t edge) { return ends(edge).low; });
    return 0;
}

/// Calls pair(a, b) for neighbours across the edges of one group, once from each side.
template <class Pair>
void for_each_pair(const std::uint32_t* edges, std::size_t count, const Pair& pair)
{
    const auto add = [&](std::size_t i, std::size_t j) {
        const std::uint32_t a = edges[i] / 3, b = edges[j] / 3;
        if (a != b) pair(a, b);
    };
    if (count <= PolygonNeighbours::most_around) {
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t j = 0; j < count; ++j) add(i, j);
    } else {
        for (std::size_t i = 0; i < count; ++i) {
            add(i, i == 0 ? count - 1 : i - 1);
            add(i, i + 1 == count ? 0 : i + 1);
        }
    }
}

/// Sorts the short list and drops what comes twice; returns how many are left.
[[nodiscard]] inline std::size_t sort_unique(std::uint32_t* items, std::size_t count)
{
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t item = items[i];
        std::size_t at = kept;
        while (at > 0 && items[at - 1] > item) --at;
        if (at > 0 && items[at - 1] == item) continue;
        for (std::size_t k = kept; k > at; --k) items[k] = items[k - 1];
        items[at] = item;
        ++kept;
    }
    return kept;
}

}  // namespace detail

inline Error PolygonNeighbours::build(const MeshView& mesh, const NeighbourOptions& options)
{
    if (const Error error = check_mesh(mesh)) return error;
    if (mesh.triangle_count > std::size_t{1} << 30)
        return {ErrorCode::bad_size, "mesh.triangle_count", double(mesh.triangle_count),
                "at most 2^30 triangles"};
    if (!detail::is_finite(options.weld))
        return {ErrorCode::bad_value, "options.weld", options.weld, "a finite distance"};
    const auto out_of_memory = [](std::size_t bytes) -> Error {
        return {ErrorCode::out_of_memory, "options.memory", double(bytes), "that many bytes"};
    };
    PolygonNeighbours built;
    const std::size_t count = mesh.triangle_count;
    if (count > 0) {
        detail::SortedEdges edges{mesh, options};
        if (const std::size_t lacking = edges.sort()) return out_of_memory(lacking);
        std::size_t pairs = 0;
        edges.for_each_group([&](const std::uint32_t* group, std::size_t size) {
            detail::for_each_pair(group, size, [&](std::uint32_t, std::uint32_t) { ++pairs; });
        });
        if (const std::size_t lacking = detail::allocate_arrays(
                built.block_, options.memory, [&](detail::ScratchLayout& arrays) {
                    built.first_ = arrays.take<std::uint64_t>(count + 1);
                    built.neighbours_ = arrays.take<std::uint32_t>(pairs);
                }))
            return out_of_memory(lacking);
        std::uint64_t* const first = built.first_;
        for (std::size_t o = 0; o <= count; ++o) first[o] = 0;
        // Sizes become ends, and filling makes them beginnings.
        edges.for_each_group([&](const std::uint32_t* group, std::size_t size) {
            detail::for_each_pair(group, size, [&](std::uint32_t a, std::uint32_t) { ++first[a]; });
        });
        for (std::size_t o = 1; o <= count; ++o) first[o] += first[o - 1];
        edges.for_each_group([&](const std::uint32_t* group, std::size_t size) {
            detail::for_each_pair(group, size, [&](std::uint32_t a, std::uint32_t b) {
                built.neighbours_[--first[a]] = b;
            });
        });
        std::uint64_t at = 0;
        for (std::size_t o = 0; o < count; ++o) {
            std::uint32_t* const list = built.neighbours_ + first[o];
            const std::size_t size =
                detail::sort_unique(list, static_cast<std::size_t>(first[o + 1] - first[o]));
            for (std::size_t i = 0; i < size; ++i) built.neighbours_[at + i] = list[i];
            first[o] = at;
            at += size;
        }
        first[count] = at;
        built.polygon_count_ = count;
    }
    swap(built);
    return {};
}

}  // namespace nook::inline NOOK_TARGET
