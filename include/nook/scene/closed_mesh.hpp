#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/vector.hpp>
#include <nook/scratch.hpp>

namespace nook {

/// What the triangles of a mesh enclose.
struct MeshClosure {
    /// Nobody outside can see the back of a triangle: every edge of every usable triangle has its
    /// opposite, and every connected part encloses a volume that its triangles turn their backs to.
    bool closed = false;
    /// Connected parts: usable triangles that share a vertex.
    std::size_t parts = 0;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Tells whether back faces can be left out of pictures taken from outside. Vertices that lie at one
/// place (equal coordinates) are one, whatever their indices; the winding of the triangles decides what
/// is outside. A mesh without usable triangles is closed.
///
/// It takes for granted that no part winds around a point more often backwards than forwards, as is
/// so for parts that do not cross themselves. Parts may cross, touch and contain each other: the first
/// surface on a ray from outside is entered, hence seen from its front. A part that is turned inside
/// out, or thinner on average than 2⁻²⁰ of the size of the mesh, so that a picture could not tell its
/// sides apart, makes the mesh count as open.
///
/// Edges are compared by two 64-bit sums of hashes, which leaves a chance of 2⁻¹²⁸ that an open mesh
/// counts as closed. O(triangles), serial. Scratch: `closed_mesh_scratch_size`.
template <ScratchSource S = HeapScratch>
Outcome closed_mesh(const MeshView& mesh, MeshClosure& closure, S&& scratch = S{});

/// About 12 bytes per vertex.
[[nodiscard]] std::size_t closed_mesh_scratch_size(const MeshView& mesh);

namespace detail {

/// Vertices joined into places, places into parts, and the volume of each part.
class ClosureSearch {
public:
    struct Arrays {
        /// The first vertex at the same place; later a vertex of the same part.
        std::uint32_t* parents;
        /// Vertices by hash, while places are looked for.
        std::uint32_t* table;
        /// By the root of the part, in the memory of the table.
        double* volumes;
    };
    ClosureSearch(const MeshView& mesh, const Arrays& arrays) : mesh_{mesh}, arrays_{arrays} {}

    [[nodiscard]] static Arrays take(ScratchLayout& layout, std::size_t vertices)
    {
        Arrays arrays{};
        arrays.parents = layout.take<std::uint32_t>(vertices);
        // A volume takes more than the 3 / 2 slots of a vertex.
        arrays.volumes = layout.take<double>(vertices + 1);
        arrays.table = reinterpret_cast<std::uint32_t*>(arrays.volumes);
        return arrays;
    }
    [[nodiscard]] MeshClosure run()
    {
        find_places();
        const bool balanced = edges_balance();
        MeshClosure closure{};
        const bool solid = parts_enclose(closure.parts);
        closure.closed = balanced && solid;
        return closure;
    }

private:
    static constexpr std::uint32_t none = 0xffffffff;

    /// Calls visit(indices) for the usable triangles.
    template <class Visit>
    void for_each_triangle(const Visit& visit) const
    {
        for (std::size_t t = 0; t < mesh_.triangle_count; ++t)
            if (is_usable_triangle(mesh_, t)) visit(mesh_.indices + 3 * t);
    }
    /// The end of MurmurHash3 (Appleby), with Stafford's constants: every bit reaches every bit.
    [[nodiscard]] static constexpr std::uint64_t mixed(std::uint64_t h)
    {
        h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
        h = (h ^ h >> 27) * 0x94d049bb133111ebu;
        return h ^ h >> 31;
    }

    void find_places()
    {
        const std::size_t slots = mesh_.vertex_count + mesh_.vertex_count / 2 + 1;
        for (std::size_t i = 0; i < slots; ++i) arrays_.table[i] = none;
        for (std::size_t i = 0; i < mesh_.vertex_count; ++i) arrays_.parents[i] = none;
        for_each_triangle([&](const std::uint32_t* index) {
            for (int k = 0; k < 3; ++k) find_place(index[k], slots);
        });
    }
    void find_place(std::uint32_t vertex, std::size_t slots)
    {
        if (arrays_.parents[vertex] != none) return;
        const Place place = bits(vertex);
        const std::uint64_t hash =
            mixed(mixed(std::uint64_t{place.x} << 32 | place.y) + 0x9e3779b97f4a7c15u + place.z);
        // Scales 31 bits of the hash to the table: slots < 2³³.
        std::size_t at = static_cast<std::size_t>((hash >> 33) * slots >> 31);
        for (;; at = at + 1 < slots ? at + 1 : 0) {
            const std::uint32_t other = arrays_.table[at];
            if (other == none) break;
            const Place there = bits(other);
            if (place.x == there.x && place.y == there.y && place.z == there.z) {
                arrays_.parents[vertex] = other;
                return;
            }
        }
        arrays_.table[at] = vertex;
        arrays_.parents[vertex] = vertex;
    }
    struct Place {
        std::uint32_t x, y, z;
    };
    /// Comparisons of floats may take denormals for 0; −0 is 0.
    [[nodiscard]] Place bits(std::uint32_t vertex) const
    {
        const float* at =
            mesh_.positions + static_cast<std::ptrdiff_t>(vertex) * mesh_.position_stride;
        const auto of = [](float value) {
            const auto b = std::bit_cast<std::uint32_t>(value);
            return b == 0x80000000 ? 0 : b;
        };
        return {of(at[0]), of(at[1]), of(at[2])};
    }

    /// The hashes of edges and their opposites cancel.
    [[nodiscard]] bool edges_balance() const
    {
        std::uint64_t first = 0, second = 0;
        for_each_triangle([&](const std::uint32_t* index) {
            for (int k = 0; k < 3; ++k) {
                const std::uint64_t from = arrays_.parents[index[k]],
                                    to = arrays_.parents[index[k == 2 ? 0 : k + 1]];
                const bool up = from < to;
                const std::uint64_t edge = up ? from << 32 | to : to << 32 | from;
                const std::uint64_t a = mixed(edge + 0x9e3779b97f4a7c15u),
                                    b = mixed(edge + 0xd1b54a32d192ed03u);
                first += up ? a : 0 - a;
                second += up ? b : 0 - b;
            }
        });
        return first == 0 && second == 0;
    }

    [[nodiscard]] std::uint32_t root(std::uint32_t vertex) const
    {
        std::uint32_t* const parents = arrays_.parents;
        while (parents[vertex] != vertex) {
            parents[vertex] = parents[parents[vertex]];
            vertex = parents[vertex];
        }
        return vertex;
    }
    void unite(std::uint32_t a, std::uint32_t b) const
    {
        a = root(a);
        b = root(b);
        if (a < b) arrays_.parents[b] = a;
        else arrays_.parents[a] = b;
    }

    [[nodiscard]] bool parts_enclose(std::size_t& parts) const
    {
        Vector3 low{most, most, most}, high = -low;
        for_each_triangle([&](const std::uint32_t* index) {
            unite(index[0], index[1]);
            unite(index[0], index[2]);
            for (int k = 0; k < 3; ++k) {
                const Vector3 p = mesh_position(mesh_, index[k]);
                low = {smaller(low.x, p.x), smaller(low.y, p.y), smaller(low.z, p.z)};
                high = {larger(high.x, p.x), larger(high.y, p.y), larger(high.z, p.z)};
            }
        });
        for (std::size_t i = 0; i < mesh_.vertex_count; ++i) arrays_.volumes[i] = 0;
        const double least_thickness = 0x1p-20 * largest(high - low);
        for_each_triangle([&](const std::uint32_t* index) {
            // From a corner of the part itself, so that far from zero nothing cancels.
            const std::uint32_t part = root(index[0]);
            const Vector3 origin = mesh_position(mesh_, part);
            const Vector3 a = mesh_position(mesh_, index[0]), b = mesh_position(mesh_, index[1]),
                          c = mesh_position(mesh_, index[2]);
            const Vector3 normal = cross(b - a, c - a);
            // A plate of thickness h and two sides of area A has the volume h A.
            arrays_.volumes[part] +=
                dot(a - origin, normal) / 3 - least_thickness * std::sqrt(dot(normal, normal)) / 2;
        });
        bool enclose = true;
        parts = 0;
        for (std::uint32_t i = 0; i < mesh_.vertex_count; ++i) {
            if (arrays_.parents[i] != i) continue;
            ++parts;
            enclose = enclose && arrays_.volumes[i] > 0;
        }
        return enclose;
    }

    static constexpr double most = 0x1p200;

    const MeshView& mesh_;
    Arrays arrays_;
};

}  // namespace detail

inline std::size_t closed_mesh_scratch_size(const MeshView& mesh)
{
    detail::ScratchLayout layout;
    static_cast<void>(detail::ClosureSearch::take(layout, mesh.vertex_count));
    return layout.size();
}

template <ScratchSource S>
Outcome closed_mesh(const MeshView& mesh, MeshClosure& closure, S&& scratch)
{
    if (const Error error = check_mesh(mesh)) return {error};
    if (mesh.triangle_count == 0) {
        closure = {true, 0};
        return {};
    }
    const std::size_t size = closed_mesh_scratch_size(mesh);
    void* const block = scratch.reserve(size);
    if (block == nullptr) return {detail::check_scratch<S>(size)};
    detail::ScratchLayout layout{block};
    closure =
        detail::ClosureSearch{mesh, detail::ClosureSearch::take(layout, mesh.vertex_count)}.run();
    return {};
}

}  // namespace nook::inline NOOK_TARGET
