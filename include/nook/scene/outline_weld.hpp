#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Gives the vertices that lie at one place one number, in the order in which they are asked for. A
/// vertex joins the nearest place within the distance, or founds one: places are farther apart than
/// that, and each has the coordinates of its founder.
class Welder {
public:
    /// `distance` in world units; 0: equal coordinates, where −0 is 0.
    Welder(const MeshView& mesh, double distance)
        // Floats that differ do so by the smallest denormal at least.
        : mesh_{mesh},
          distance_{distance < 0x1p-149 ? 0 : distance}
    {}
    /// Returns how many bytes could not be had: 0 on success.
    [[nodiscard]] std::size_t allocate(const Memory& memory);
    /// The place of a vertex whose coordinates are finite.
    [[nodiscard]] std::uint32_t place(std::uint32_t vertex)
    {
        std::uint32_t& known = place_of_[vertex];
        if (known == no_place) known = distance_ > 0 ? nearest(vertex) : equal(vertex);
        return known;
    }
    [[nodiscard]] std::uint32_t count() const { return count_; }
    /// Three floats a place.
    [[nodiscard]] const float* positions() const { return positions_; }
    [[nodiscard]] Vector3 position(std::uint32_t place) const
    {
        return mesh_vector(positions_, 3, place);
    }

private:
    static constexpr std::uint32_t no_place = 0xffffffff;

    [[nodiscard]] std::uint32_t equal(std::uint32_t vertex);
    [[nodiscard]] std::uint32_t nearest(std::uint32_t vertex);
    [[nodiscard]] std::uint32_t found(std::uint32_t vertex, std::size_t bucket);
    [[nodiscard]] const float* vertex_data(std::uint32_t vertex) const
    {
        return mesh_.positions + static_cast<std::ptrdiff_t>(vertex) * mesh_.position_stride;
    }
    [[nodiscard]] std::size_t bucket(std::uint64_t x, std::uint64_t y, std::uint64_t z) const
    {
        std::uint64_t h = x * 0x9e3779b97f4a7c15u;
        h = (std::rotl(h, 29) ^ y) * 0xbf58476d1ce4e5b9u;
        h = (std::rotl(h, 31) ^ z) * 0x94d049bb133111ebu;
        return static_cast<std::size_t>((h ^ h >> 32) & (bucket_count_ - 1));
    }

    const MeshView& mesh_;
    double distance_;
    Block block_;
    std::uint32_t* place_of_ = nullptr;
    float* positions_ = nullptr;
    /// Places of one bucket form a list.
    std::uint32_t *first_ = nullptr, *next_ = nullptr;
    std::size_t bucket_count_ = 1;
    std::uint32_t count_ = 0;
};

inline std::size_t Welder::allocate(const Memory& memory)
{
    const std::size_t most = (std::min)(mesh_.vertex_count, 3 * mesh_.triangle_count);
    bucket_count_ = std::bit_ceil(most + 1);
    const std::size_t lacking = allocate_arrays(block_, memory, [&](ScratchLayout& arrays) {
        place_of_ = arrays.take<std::uint32_t>(mesh_.vertex_count);
        positions_ = arrays.take<float>(3 * most);
        first_ = arrays.take<std::uint32_t>(bucket_count_);
        next_ = arrays.take<std::uint32_t>(most);
    });
    if (lacking > 0) return lacking;
    for (std::size_t i = 0; i < mesh_.vertex_count; ++i) place_of_[i] = no_place;
    for (std::size_t i = 0; i < bucket_count_; ++i) first_[i] = no_place;
    return 0;
}

inline std::uint32_t Welder::found(std::uint32_t vertex, std::size_t bucket)
{
    const float* const v = vertex_data(vertex);
    for (std::size_t k = 0; k < 3; ++k) positions_[std::size_t{3} * count_ + k] = v[k];
    next_[count_] = first_[bucket];
    first_[bucket] = count_;
    return count_++;
}

/// Compares bits: comparisons of floats may take denormals for 0.
inline std::uint32_t Welder::equal(std::uint32_t vertex)
{
    const auto bits = [](const float* v, std::size_t k) {
        const auto b = std::bit_cast<std::uint32_t>(v[k]);
        return b == 0x80000000 ? 0 : b;
    };
    const float* const v = vertex_data(vertex);
    const std::uint32_t x = bits(v, 0), y = bits(v, 1), z = bits(v, 2);
    const std::size_t at = bucket(x, y, z);
    for (std::uint32_t p = first_[at]; p != no_place; p = next_[p]) {
        const float* const w = positions_ + std::size_t{3} * p;
        if (bits(w, 0) == x && bits(w, 1) == y && bits(w, 2) == z) return p;
    }
    return found(vertex, at);
}

/// Places are kept in cells of twice the distance: whatever is near enough lies in the vertex's own cell
/// or, along each axis, in the one that it is closer to.
inline std::uint32_t Welder::nearest(std::uint32_t vertex)
{
    const float* const v = vertex_data(vertex);
    std::uint64_t cells[3][2];
    for (std::size_t k = 0; k < 3; ++k) {
        const double at = double{v[k]} / (2 * distance_), own = std::floor(at);
        const double other = at - own < 0.5 ? own - 1 : own + 1;
        cells[k][0] = std::bit_cast<std::uint64_t>(own);
        cells[k][1] = std::bit_cast<std::uint64_t>(other);
        // The bits of −0 are not those of 0.
        for (std::uint64_t& cell : cells[k])
            if (cell << 1 == 0) cell = 0;
    }
    const Vector3 position = mesh_position(mesh_, vertex);
    double least = distance_ * distance_;
    std::uint32_t best = no_place;
    for (unsigned i = 0; i < 8; ++i) {
        const std::size_t at = bucket(cells[0][i & 1], cells[1][i >> 1 & 1], cells[2][i >> 2]);
        for (std::uint32_t p = first_[at]; p != no_place; p = next_[p]) {
            const Vector3 apart = mesh_vector(positions_, 3, p) - position;
            const double square = dot(apart, apart);
            if (square > least || (square == least && p >= best)) continue;
            least = square;
            best = p;
        }
    }
    if (best != no_place) return best;
    return found(vertex, bucket(cells[0][0], cells[1][0], cells[2][0]));
}

}  // namespace nook::inline NOOK_TARGET::detail
