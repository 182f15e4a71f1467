#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <nook/scene/memory.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/outline_edges.hpp>
#include <nook/scene/outline_fans.hpp>
#include <nook/scene/outline_options.hpp>
#include <nook/scene/outline_weld.hpp>

/// Makes the shells of a mesh. Vertices at one place are welded, edges paired, and open surfaces get a
/// back, so that everything is closed; then fans of triangles get their vertices, and where those are
/// several, joints close the gaps between them.
namespace nook::inline NOOK_TARGET::detail {

/// One build. `prepare` makes everything but the arrays of the result, `write` fills those.
class OutlineBuilder {
public:
    OutlineBuilder(const MeshView& mesh, const OutlineOptions& options)
        : mesh_{mesh},
          options_{options},
          welder_{mesh, options.weld},
          vertices_{options}
    {}
    /// Returns how many bytes could not be had: 0 on success.
    [[nodiscard]] std::size_t prepare();
    void write(float* base, float* direction, std::uint32_t* indices, OutlineObject* objects) const;

    [[nodiscard]] std::size_t vertex_count() const { return vertices_.count(); }
    [[nodiscard]] std::size_t triangle_count() const { return triangle_count_; }
    [[nodiscard]] std::size_t object_count() const { return object_count_; }
    [[nodiscard]] double face_offset() const { return vertices_.face_offset(); }
    /// Triangles of the mesh that are in no shell.
    [[nodiscard]] std::size_t dropped() const { return mesh_.triangle_count - front_count_; }

private:
    [[nodiscard]] std::size_t take_faces();
    [[nodiscard]] std::size_t find_objects();
    [[nodiscard]] std::size_t lay_out(const std::uint32_t* labels);
    void measure(ShellObject& object);
    template <class Emit>
    void emit_triangles(const ShellObject& object, const Emit& emit) const;

    const MeshView& mesh_;
    const OutlineOptions& options_;
    Welder welder_;
    FanVertices vertices_;

    Block taken_block_, objects_block_, faces_block_;
    /// The triangles taken from the mesh; later with backs, object by object.
    FaceList faces_{};
    std::uint32_t front_count_ = 0;
    std::uint32_t* pair_ = nullptr;
    ShellObject* objects_ = nullptr;
    std::uint32_t object_count_ = 0;
    Vector3* normals_ = nullptr;
    std::size_t triangle_count_ = 0;
};

inline std::size_t OutlineBuilder::prepare()
{
    if (const std::size_t lacking = take_faces()) return lacking;
    if (front_count_ == 0) return 0;
    if (const std::size_t lacking = find_objects()) return lacking;
    if (const std::size_t lacking = vertices_.allocate({faces_, pair_, normals_})) return lacking;
    for (std::uint32_t i = 0; i < object_count_; ++i) {
        vertices_.add(objects_[i]);
        emit_triangles(objects_[i],
                       [&](std::uint32_t, std::uint32_t, std::uint32_t) { ++triangle_count_; });
    }
    return 0;
}

/// Takes triangles that are usable in the mesh and after welding, and pairs their edges.
inline std::size_t OutlineBuilder::take_faces()
{
    if (const std::size_t lacking = welder_.allocate(options_.memory)) return lacking;
    std::size_t lacking =
        allocate_arrays(taken_block_, options_.memory, [&](ScratchLayout& arrays) {
            faces_.corners = arrays.take<std::uint32_t>(3 * mesh_.triangle_count);
            pair_ = arrays.take<std::uint32_t>(3 * mesh_.triangle_count);
        });
    if (lacking > 0) return lacking;
    for (std::size_t t = 0; t < mesh_.triangle_count; ++t) {
        if (!is_usable_triangle(mesh_, t)) continue;
        std::uint32_t* const corners = faces_.corners + std::size_t{3} * front_count_;
        for (std::size_t i = 0; i < 3; ++i) corners[i] = welder_.place(mesh_.indices[3 * t + i]);
        const MeshView welded{welder_.positions(), welder_.count(), corners, 1};
        if (options_.weld > 0 && !is_usable_triangle(welded, 0)) continue;
        ++front_count_;
    }
    faces_.count = front_count_;
    faces_.positions = welder_.positions();
    faces_.place_count = welder_.count();
    EdgePairing pairing{faces_, options_.memory};
    return pairing.run(pair_, options_.normal_tolerance);
}

/// Objects are what hangs together across paired edges, numbered by their first triangles.
inline std::size_t OutlineBuilder::find_objects()
{
    Block block;
    std::uint32_t *parents = nullptr, *labels = nullptr;
    std::size_t lacking = allocate_arrays(block, options_.memory, [&](ScratchLayout& arrays) {
        parents = arrays.take<std::uint32_t>(front_count_);
        labels = arrays.take<std::uint32_t>(front_count_);
    });
    if (lacking > 0) return lacking;
    FaceSets sets{parents, front_count_};
    for (std::uint32_t edge = 0; edge < 3 * front_count_; ++edge)
        if (pair_[edge] != unpaired && edge < pair_[edge])
            sets.unite(edge / 3, pair_[edge] / 3, false);
    for (std::uint32_t f = 0; f < front_count_; ++f) {
        const std::uint32_t root = sets.find(f).root;
        labels[f] = root == f ? object_count_++ : labels[root];
    }
    lacking = allocate_arrays(objects_block_, options_.memory, [&](ScratchLayout& arrays) {
        objects_ = arrays.take<ShellObject>(object_count_);
    });
    if (lacking > 0) return lacking;
    return lay_out(labels);
}

/// Puts the faces of each object side by side, and behind those of an open one their backs: the same
/// triangles seen from the other side, joined to the fronts along the boundary.
inline std::size_t OutlineBuilder::lay_out(const std::uint32_t* labels)
{
    for (std::uint32_t i = 0; i < object_count_; ++i) objects_[i] = {};
    for (std::uint32_t f = 0; f < front_count_; ++f) {
        ShellObject& object = objects_[labels[f]];
        ++object.front_count;
        for (std::uint32_t edge = 3 * f; edge < 3 * f + 3; ++edge)
            object.open = object.open || pair_[edge] == unpaired;
    }
    std::uint32_t face_count = 0;
    for (std::uint32_t i = 0; i < object_count_; ++i) {
        objects_[i].first_face = face_count;
        face_count += objects_[i].face_count();
    }
    FaceList laid = faces_;
    laid.count = face_count;
    Block block, moved_block;
    std::uint32_t *pair = nullptr, *moved = nullptr, *filled = nullptr;
    std::size_t lacking = allocate_arrays(block, options_.memory, [&](ScratchLayout& arrays) {
        laid.corners = arrays.take<std::uint32_t>(std::size_t{3} * face_count);
        pair = arrays.take<std::uint32_t>(std::size_t{3} * face_count);
        normals_ = arrays.take<Vector3>(face_count);
    });
    if (lacking > 0) return lacking;
    lacking = allocate_arrays(moved_block, options_.memory, [&](ScratchLayout& arrays) {
        moved = arrays.take<std::uint32_t>(front_count_);
        filled = arrays.take<std::uint32_t>(object_count_);
    });
    if (lacking > 0) return lacking;
    for (std::uint32_t i = 0; i < object_count_; ++i) filled[i] = objects_[i].first_face;
    for (std::uint32_t f = 0; f < front_count_; ++f) moved[f] = filled[labels[f]]++;
    for (std::uint32_t f = 0; f < front_count_; ++f) {
        const ShellObject& object = objects_[labels[f]];
        const std::uint32_t front = 3 * moved[f];
        // Corners 0, 2, 1: the back of edge i is edge 2 - i.
        const std::uint32_t to_back = 3 * object.front_count;
        for (std::uint32_t i = 0; i < 3; ++i) {
            const std::uint32_t other = pair_[3 * f + i], back = front + to_back + 2 - i;
            laid.corners[front + i] = faces_.corners[3 * f + i];
            if (other == unpaired) {
                pair[front + i] = back;
                pair[back] = front + i;
                continue;
            }
            const std::uint32_t across = 3 * moved[other / 3];
            pair[front + i] = across + other % 3;
            if (object.open) pair[back] = across + to_back + 2 - other % 3;
        }
        for (std::uint32_t i = 0; i < 3 && object.open; ++i)
            laid.corners[front + to_back + (3 - i) % 3] = faces_.corners[3 * f + i];
    }
    taken_block_ = std::move(block);
    faces_ = laid;
    pair_ = pair;
    for (std::uint32_t i = 0; i < object_count_; ++i) measure(objects_[i]);
    return 0;
}

/// Normals of an object, its centre, its size, and on which side it is solid.
inline void OutlineBuilder::measure(ShellObject& object)
{
    const std::uint32_t first = object.first_face, corner = 3 * first;
    Vector3 low = faces_.position(corner), high = low;
    const Vector3 origin = low;
    double volume = 0, terms = 0;
    for (std::uint32_t i = 0; i < object.front_count; ++i) {
        const std::uint32_t f = first + i;
        const Vector3 area = faces_.doubled_area(f);
        normals_[f] = normalised(area);
        if (object.open) normals_[f + object.front_count] = -normals_[f];
        const double term = dot(faces_.position(3 * f) - origin, area);
        volume += term;
        terms += std::fabs(term);
        for (std::uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
            const Vector3 p = faces_.position(c);
            low = {(std::min)(low.x, p.x), (std::min)(low.y, p.y), (std::min)(low.z, p.z)};
            high = {(std::max)(high.x, p.x), (std::max)(high.y, p.y), (std::max)(high.z, p.z)};
        }
    }
    // Sheets with two sides hold no volume but that of rounding.
    object.inward = !object.open && volume < -1e-9 * terms;
    object.centre = (low + high) * 0.5;
    double square = 0;
    for (std::uint32_t c = corner; c < corner + 3 * object.front_count; ++c) {
        const Vector3 from_centre = faces_.position(c) - object.centre;
        square = (std::max)(square, dot(from_centre, from_centre));
    }
    object.reach = std::sqrt(square);
}

/// The triangles of an object: its faces, then the joints along edges and around vertices whose corners
/// went apart. Each directed edge is cancelled by one in the opposite direction.
template <class Emit>
void OutlineBuilder::emit_triangles(const ShellObject& object, const Emit& emit) const
{
    const std::uint32_t first = 3 * object.first_face, last = first + 3 * object.face_count();
    const auto joint = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && c != a) emit(a, b, c);
    };
    for (std::uint32_t c = first; c < last; c += 3) {
        const std::uint32_t around[6] = {vertices_.ends_in(c),     vertices_.begins_in(c),
                                         vertices_.ends_in(c + 1), vertices_.begins_in(c + 1),
                                         vertices_.ends_in(c + 2), vertices_.begins_in(c + 2)};
        for (int i = 2; i < 6; ++i) joint(around[0], around[i - 1], around[i]);
    }
    for (std::uint32_t edge = first; edge < last; ++edge) {
        const std::uint32_t other = pair_[edge];
        if (other < edge) continue;
        const std::uint32_t a = vertices_.begins_in(edge), b = vertices_.ends_in(next_corner(edge));
        const std::uint32_t c = vertices_.ends_in(next_corner(other)),
                            d = vertices_.begins_in(other);
        joint(b, a, c);
        joint(b, c, d);
    }
    // The edge that ends in a corner is the one across which the ring goes on.
    for (std::uint32_t i = first, begin = first; i < last; ++i) {
        if (!vertices_.ends_ring(i)) continue;
        const auto at = [&](std::uint32_t k) {
            const std::uint32_t corner = vertices_.ring_corner(begin + k / 2);
            return k % 2 == 0 ? vertices_.begins_in(corner) : vertices_.ends_in(corner);
        };
        for (std::uint32_t k = 2; k < 2 * (i + 1 - begin); ++k) joint(at(0), at(k - 1), at(k));
        begin = i + 1;
    }
}

inline void OutlineBuilder::write(float* base, float* direction, std::uint32_t* indices,
                                  OutlineObject* objects) const
{
    for (std::uint32_t v = 0; v < vertices_.count(); ++v) {
        const float* const place = faces_.positions + std::size_t{3} * vertices_.place(v);
        for (std::size_t k = 0; k < 3; ++k) {
            base[std::size_t{3} * v + k] = place[k];
            direction[std::size_t{3} * v + k] = vertices_.direction(v)[k];
        }
    }
    std::size_t written = 0;
    for (std::uint32_t i = 0; i < object_count_; ++i) {
        const std::size_t begin = written;
        emit_triangles(objects_[i], [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            indices[3 * written] = a;
            indices[3 * written + 1] = b;
            indices[3 * written + 2] = c;
            ++written;
        });
        objects[i] = {static_cast<std::uint32_t>(begin),
                      static_cast<std::uint32_t>(written - begin), objects_[i].open,
                      objects_[i].inward};
    }
}

}  // namespace nook::inline NOOK_TARGET::detail
