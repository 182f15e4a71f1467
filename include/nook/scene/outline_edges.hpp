#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>

/// How the triangles of a mesh hang together. Corner 3 t + i of triangle t stands also for the edge from
/// it to the next corner.
namespace nook::inline NOOK_TARGET::detail {

inline constexpr std::uint32_t unpaired = 0xffffffff;

[[nodiscard]] constexpr std::uint32_t next_corner(std::uint32_t corner)
{
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}
[[nodiscard]] constexpr std::uint32_t previous_corner(std::uint32_t corner)
{
    return corner % 3 == 0 ? corner + 2 : corner - 1;
}

/// Triangles with three different corners. `corners` are numbers of places.
struct FaceList {
    std::uint32_t* corners;
    std::uint32_t count;
    const float* positions;
    std::uint32_t place_count;

    [[nodiscard]] Vector3 position(std::uint32_t corner) const
    {
        return mesh_vector(positions, 3, corners[corner]);
    }
    [[nodiscard]] Vector3 doubled_area(std::uint32_t face) const
    {
        const Vector3 a = position(3 * face);
        return cross(position(3 * face + 1) - a, position(3 * face + 2) - a);
    }
};

/// Sets of triangles that grow together, each with a sign relative to the others of its set. The sign
/// lives in the top bit of the parent.
class FaceSets {
public:
    struct Member {
        std::uint32_t root, sign;
    };
    FaceSets(std::uint32_t* parents, std::uint32_t count) : parents_{parents}
    {
        for (std::uint32_t i = 0; i < count; ++i) parents_[i] = i;
    }
    [[nodiscard]] Member find(std::uint32_t face)
    {
        Member member{face, 0};
        while ((parents_[member.root] & mask) != member.root) {
            member.sign ^= parents_[member.root] & ~mask;
            member.root = parents_[member.root] & mask;
        }
        for (std::uint32_t at = face, sign = member.sign; at != member.root;) {
            const std::uint32_t parent = parents_[at];
            parents_[at] = member.root | sign;
            sign ^= parent & ~mask;
            at = parent & mask;
        }
        return member;
    }
    /// False when the two were of one set already with another sign.
    bool unite(std::uint32_t a, std::uint32_t b, bool opposite)
    {
        const Member of_a = find(a), of_b = find(b);
        const std::uint32_t sign = of_a.sign ^ of_b.sign ^ (opposite ? ~mask : 0);
        if (of_a.root == of_b.root) return sign == 0;
        // The lower face is the root: sets are numbered by their first face.
        if (of_a.root < of_b.root) parents_[of_b.root] = of_a.root | sign;
        else parents_[of_a.root] = of_b.root | sign;
        return true;
    }

private:
    static constexpr std::uint32_t mask = 0x7fffffff;
    std::uint32_t* parents_;
};

/// Finds for each edge of a triangle the edge in the opposite direction across which its surface goes
/// on. Where more than two triangles meet, those that bound one wedge of solid belong together, so that
/// bodies which touch along an edge stay apart. Turns triangles so that neighbours agree, as most of the
/// area does, wherever a whole component can agree.
class EdgePairing {
public:
    EdgePairing(const FaceList& faces, const Memory& memory) : faces_{faces}, memory_{memory} {}

    /// Writes `pair`, 3 * faces.count entries: an edge or `unpaired`. May exchange corners. Directions
    /// within `tolerance` radians around an edge count as one. Returns how many bytes could not be had.
    [[nodiscard]] std::size_t run(std::uint32_t* pair, double tolerance);

private:
    /// An edge in the list of its lower place.
    struct Entry {
        std::uint32_t higher, edge;
    };
    struct Spoke {
        double turn;
        std::uint32_t edge;
        /// The solid begins here, with the turn growing; otherwise it ends.
        bool opens;
    };

    [[nodiscard]] std::size_t list_edges();
    [[nodiscard]] bool ascending(std::uint32_t edge) const
    {
        return faces_.corners[edge] < faces_.corners[next_corner(edge)];
    }
    template <class Visit>
    void for_each_edge(const Visit& visit);
    [[nodiscard]] std::size_t orient();
    void pair_around(const Entry* entries, std::uint32_t count, std::uint32_t* pair,
                     double tolerance);

    /// Sorts by `before`; no recursion and no memory. The templates of the standard library would be
    /// shared between targets.
    template <class T, class Before>
    static void sort(T* items, std::size_t count, const Before& before);

    FaceList faces_;
    const Memory& memory_;
    Block lists_block_, spokes_block_;
    std::uint32_t* first_ = nullptr;
    Entry* entries_ = nullptr;
    Spoke* spokes_ = nullptr;
    std::uint32_t* open_ = nullptr;
};

template <class T, class Before>
void EdgePairing::sort(T* items, std::size_t count, const Before& before)
{
    if (count <= 24) {
        for (std::size_t i = 1; i < count; ++i) {
            const T item = items[i];
            std::size_t at = i;
            for (; at > 0 && before(item, items[at - 1]); --at) items[at] = items[at - 1];
            items[at] = item;
        }
        return;
    }
    const auto sift = [&](std::size_t at, std::size_t size) {
        const T item = items[at];
        for (std::size_t child = 2 * at + 1; child < size; child = 2 * at + 1) {
            if (child + 1 < size && before(items[child], items[child + 1])) ++child;
            if (!before(item, items[child])) break;
            items[at] = items[child];
            at = child;
        }
        items[at] = item;
    };
    for (std::size_t i = count / 2; i-- > 0;) sift(i, count);
    for (std::size_t size = count - 1; size > 0; --size) {
        const T last = items[size];
        items[size] = items[0];
        items[0] = last;
        sift(0, size);
    }
}

inline std::size_t EdgePairing::list_edges()
{
    const std::uint32_t edge_count = 3 * faces_.count;
    const std::size_t lacking = allocate_arrays(lists_block_, memory_, [&](ScratchLayout& arrays) {
        first_ = arrays.take<std::uint32_t>(std::size_t{faces_.place_count} + 1);
        entries_ = arrays.take<Entry>(edge_count);
    });
    if (lacking > 0) return lacking;
    const auto lower = [&](std::uint32_t edge) {
        return (std::min)(faces_.corners[edge], faces_.corners[next_corner(edge)]);
    };
    for (std::uint32_t i = 0; i <= faces_.place_count; ++i) first_[i] = 0;
    for (std::uint32_t edge = 0; edge < edge_count; ++edge) ++first_[lower(edge)];
    // Counts become ends, and filling from the back makes them beginnings.
    for (std::uint32_t i = 1; i <= faces_.place_count; ++i) first_[i] += first_[i - 1];
    for (std::uint32_t edge = edge_count; edge-- > 0;)
        entries_[--first_[lower(edge)]] = {
            (std::max)(faces_.corners[edge], faces_.corners[next_corner(edge)]), edge};
    for (std::uint32_t i = 0; i < faces_.place_count; ++i)
        sort(entries_ + first_[i], first_[i + 1] - first_[i], [](const Entry& a, const Entry& b) {
            return a.higher != b.higher ? a.higher < b.higher : a.edge < b.edge;
        });
    return 0;
}

/// Calls visit(entries, count) for the edges between each two places.
template <class Visit>
void EdgePairing::for_each_edge(const Visit& visit)
{
    for (std::uint32_t i = 0; i < faces_.place_count; ++i)
        for (std::uint32_t begin = first_[i], end = begin; begin < first_[i + 1]; begin = end) {
            while (end < first_[i + 1] && entries_[end].higher == entries_[begin].higher) ++end;
            visit(entries_ + begin, end - begin);
        }
}

inline std::size_t EdgePairing::orient()
{
    struct Vote {
        double area;
        bool torn, voted;
        std::uint32_t first_sign;
    };
    Block block;
    std::uint32_t* parents = nullptr;
    Vote* votes = nullptr;
    const std::size_t lacking = allocate_arrays(block, memory_, [&](ScratchLayout& arrays) {
        parents = arrays.take<std::uint32_t>(faces_.count);
        votes = arrays.take<Vote>(faces_.count);
    });
    if (lacking > 0) return lacking;
    FaceSets sets{parents, faces_.count};
    for (std::uint32_t f = 0; f < faces_.count; ++f) votes[f] = {0, false, false, 0};
    for (const bool voting : {false, true})
        for_each_edge([&](const Entry* entries, std::uint32_t count) {
            if (count != 2) return;
            const std::uint32_t a = entries[0].edge, b = entries[1].edge;
            const bool opposite = ascending(a) == ascending(b);
            // The second time everything is united: what disagrees cannot be made to agree.
            if (!sets.unite(a / 3, b / 3, opposite) && voting)
                votes[sets.find(a / 3).root].torn = true;
        });
    for (std::uint32_t f = 0; f < faces_.count; ++f) {
        const auto [root, sign] = sets.find(f);
        const Vector3 normal = faces_.doubled_area(f);
        const double area = std::sqrt(dot(normal, normal));
        Vote& vote = votes[root];
        if (!vote.voted) vote.first_sign = sign;
        vote.voted = true;
        vote.area += sign == vote.first_sign ? area : -area;
    }
    for (std::uint32_t f = 0; f < faces_.count; ++f) {
        const auto [root, sign] = sets.find(f);
        const Vote& vote = votes[root];
        if (vote.torn || (sign == vote.first_sign) == (vote.area >= 0)) continue;
        const std::uint32_t second = faces_.corners[3 * f + 1];
        faces_.corners[3 * f + 1] = faces_.corners[3 * f + 2];
        faces_.corners[3 * f + 2] = second;
    }
    return list_edges();
}

inline std::size_t EdgePairing::run(std::uint32_t* pair, double tolerance)
{
    if (const std::size_t lacking = list_edges()) return lacking;
    std::uint32_t most = 0;
    bool agree = true;
    for_each_edge([&](const Entry* entries, std::uint32_t count) {
        most = (std::max)(most, count);
        agree = agree && (count != 2 || ascending(entries[0].edge) != ascending(entries[1].edge));
    });
    if (!agree)
        if (const std::size_t lacking = orient()) return lacking;
    const std::size_t lacking = allocate_arrays(spokes_block_, memory_, [&](ScratchLayout& arrays) {
        spokes_ = arrays.take<Spoke>(most > 2 ? most : 0);
        open_ = arrays.take<std::uint32_t>(most > 2 ? most : 0);
    });
    if (lacking > 0) return lacking;
    for (std::uint32_t i = 0; i < 3 * faces_.count; ++i) pair[i] = unpaired;
    for_each_edge([&](const Entry* entries, std::uint32_t count) {
        if (count > 2) return pair_around(entries, count, pair, tolerance);
        if (count < 2 || ascending(entries[0].edge) == ascending(entries[1].edge)) return;
        pair[entries[0].edge] = entries[1].edge;
        pair[entries[1].edge] = entries[0].edge;
    });
    return 0;
}

/// Goes around the edge and matches beginnings and ends of solid like brackets.
inline void EdgePairing::pair_around(const Entry* entries, std::uint32_t count, std::uint32_t* pair,
                                     double tolerance)
{
    const std::uint32_t first = entries[0].edge;
    const bool up = ascending(first);
    const Vector3 from = faces_.position(up ? first : next_corner(first));
    const Vector3 axis = normalised(faces_.position(up ? next_corner(first) : first) - from);
    const Vector3 toward = faces_.position(previous_corner(first)) - from;
    const Vector3 right = normalised(toward - axis * dot(axis, toward)), above = cross(axis, right);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t edge = entries[i].edge;
        const Vector3 spoke = faces_.position(previous_corner(edge)) - from;
        const double x = dot(spoke, right), y = dot(spoke, above);
        const double size = std::fabs(x) + std::fabs(y);
        // Grows with the angle from 0 to 4, by 1 at a right angle.
        const double turn = size > 0 ? (y < 0 ? 3 + x / size : 1 - x / size) : 0;
        spokes_[i] = {turn, edge, !ascending(edge)};
    }
    sort(spokes_, count, [](const Spoke& a, const Spoke& b) {
        return a.turn < b.turn || (!(b.turn < a.turn) && a.edge < b.edge);
    });
    // Directions that count as one: what ends there comes first, then what begins. Starting at a gap,
    // so that none is cut.
    std::uint32_t start = 0;
    for (std::uint32_t i = 1; i < count && start == 0; ++i)
        if (spokes_[i].turn - spokes_[i - 1].turn > tolerance) start = i;
    const auto spoke_at = [&](std::uint32_t i) -> const Spoke& {
        return spokes_[(start + i) % count];
    };
    std::uint32_t opened = 0;
    for (int round = 0; round < 2; ++round)
        for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
            for (end = begin + 1; end < count; ++end) {
                const double gap = spoke_at(end).turn - spoke_at(end - 1).turn;
                if ((gap < 0 ? gap + 4 : gap) > tolerance) break;
            }
            for (std::uint32_t i = begin; i < end; ++i) {
                const Spoke& spoke = spoke_at(i);
                if (spoke.opens || opened == 0 || pair[spoke.edge] != unpaired) continue;
                const std::uint32_t other = open_[--opened];
                pair[spoke.edge] = other;
                pair[other] = spoke.edge;
            }
            for (std::uint32_t i = begin; i < end && round == 0; ++i)
                if (spoke_at(i).opens) open_[opened++] = spoke_at(i).edge;
        }
}

}  // namespace nook::inline NOOK_TARGET::detail
