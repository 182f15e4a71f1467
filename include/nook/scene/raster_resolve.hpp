#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <nook/checks.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/raster_bins.hpp>
#include <nook/scene/raster_tile.hpp>
#include <nook/scene/raster_vertex.hpp>
#include <nook/scene/triangle_surface.hpp>
#include <nook/scene/vector.hpp>

/// From a complete tile to the images: each pixel is written once.
namespace nook::inline NOOK_TARGET::detail {

/// Normals of triangles towards the viewer, several found at once. The last ones are kept.
class RasterNormals {
public:
    struct Normal {
        float x, y, z;
    };

    explicit RasterNormals(const RasterView& view) : view_{view}
    {
        for (std::uint32_t& id : ids_) id = no_face;
    }
    /// The normal of a triangle that has been asked for, if it is still there.
    [[nodiscard]] const Normal* find(std::uint32_t id) const
    {
        const std::uint32_t slot = id % slots;
        return ids_[slot] == id ? &normals_[slot] : nullptr;
    }
    /// Asks for the normal of a triangle; there once `finish` has been called.
    void want(std::uint32_t id)
    {
        const std::uint32_t slot = id % slots;
        if (ids_[slot] == id) return;
        ids_[slot] = id;
        wanted_[count_++] = id;
        if (count_ == lanes) finish();
    }
    void finish()
    {
        if (count_ == 0) return;
        double corners[9][lanes];
        const MeshView& mesh = view_.mesh();
        for (int lane = 0; lane < lanes; ++lane) {
            const std::uint32_t id = wanted_[lane < count_ ? lane : 0];
            for (std::size_t i = 0; i < 3; ++i) {
                const Vector3 corner = mesh_position(mesh, mesh.indices[3 * std::size_t{id} + i]);
                corners[3 * i][lane] = corner.x;
                corners[3 * i + 1][lane] = corner.y;
                corners[3 * i + 2][lane] = corner.z;
            }
        }
        Normal found[lanes];
        compute(corners, found);
        for (int lane = 0; lane < count_; ++lane) {
            // Another triangle may have taken its place.
            const std::uint32_t id = wanted_[lane];
            if (ids_[id % slots] == id) normals_[id % slots] = found[lane];
        }
        count_ = 0;
    }
    /// The normal of a triangle, by itself.
    [[nodiscard]] Normal normal(std::uint32_t id)
    {
        finish();
        want(id);
        finish();
        return normals_[id % slots];
    }

private:
    static constexpr std::uint32_t slots = 1024;
    static constexpr int lanes = native_lanes;
    using Reals = Lanes<double, lanes>;

    NOOK_NOINLINE void compute(const double (&corners)[9][lanes], Normal (&found)[lanes]) const
    {
        struct Vectors {
            Reals x, y, z;
        };
        const auto corner = [&](int i) {
            return Vectors{load<lanes>(corners[3 * i]), load<lanes>(corners[3 * i + 1]),
                           load<lanes>(corners[3 * i + 2])};
        };
        const Vectors a = corner(0), b = corner(1), c = corner(2);
        const Vectors ab{b.x - a.x, b.y - a.y, b.z - a.z};
        const Vectors ac{c.x - a.x, c.y - a.y, c.z - a.z};
        const auto product = [](const Reals& p, const Reals& q, const Reals& r, const Reals& s) {
            return Reals{rounded(Reals{p * q}) - rounded(Reals{r * s})};
        };
        const Vectors normal{product(ab.y, ac.z, ab.z, ac.y), product(ab.z, ac.x, ab.x, ac.z),
                             product(ab.x, ac.y, ab.y, ac.x)};
        const auto along = [](const Vectors& v, const Vector3& axis) {
            return Reals{rounded(Reals{v.x * axis.x}) + rounded(Reals{v.y * axis.y}) +
                         rounded(Reals{v.z * axis.z})};
        };
        const Vectors turned{along(normal, view_.normal_axis(0)),
                             along(normal, view_.normal_axis(1)),
                             along(normal, view_.normal_axis(2))};
        const Vector3& origin = view_.frame().origin;
        // Towards the viewer: at the origin, or along +z.
        const Reals offset =
            normal.x * (a.x - origin.x) + normal.y * (a.y - origin.y) + normal.z * (a.z - origin.z);
        const Reals side =
            view_.projection().orthographic ? turned.z : Reals{-offset * view_.volume()};
        const Reals square = rounded(Reals{turned.x * turned.x}) +
                             rounded(Reals{turned.y * turned.y}) +
                             rounded(Reals{turned.z * turned.z});
        const Reals length = 1.0 / square_root(square);
        const Reals scale = side < 0.0 ? Reals{-length} : length;
        double x[lanes], y[lanes], z[lanes], squares[lanes], sides[lanes];
        store(x, Reals{turned.x * scale});
        store(y, Reals{turned.y * scale});
        store(z, Reals{turned.z * scale});
        store(squares, square);
        store(sides, side);
        for (int lane = 0; lane < lanes; ++lane) {
            found[lane] = {static_cast<float>(x[lane]), static_cast<float>(y[lane]),
                           static_cast<float>(z[lane])};
            if (squares[lane] > 0x1p-900 && squares[lane] < 0x1p900) continue;
            double turned_x[lanes], turned_y[lanes], turned_z[lanes];
            store(turned_x, turned.x);
            store(turned_y, turned.y);
            store(turned_z, turned.z);
            Vector3 extreme = normalised(Vector3{turned_x[lane], turned_y[lane], turned_z[lane]});
            if (sides[lane] < 0) extreme = -extreme;
            if (!is_finite(extreme)) extreme = {0, 0, 1};
            found[lane] = {static_cast<float>(extreme.x), static_cast<float>(extreme.y),
                           static_cast<float>(extreme.z)};
        }
    }

    const RasterView& view_;
    std::uint32_t ids_[slots];
    Normal normals_[slots];
    std::uint32_t wanted_[lanes];
    int count_ = 0;
};

/// The images that tiles go to.
struct RasterImages {
    ImageView<float> depth;
    ImageView3<float> normal;
    ImageView<std::uint32_t> face;
};

class RasterResolve {
public:
    static constexpr RasterSize tile{128, 64};

    RasterResolve(const RasterView& view, const RasterImages& images, bool interpolate)
        : view_{view},
          images_{images},
          interpolate_{interpolate},
          normals_{view}
    {}

    /// Writes the distances; returns how many pixels hold a surface.
    template <class Tile>
    std::uint64_t depth(const Tile& drawn) const
    {
        const RasterBox& box = drawn.box();
        const int width = box.right - box.left + 1;
        std::uint64_t covered = 0;
        for (int y = box.top; y <= box.bottom; ++y) {
            const std::int32_t* const distances = drawn.distances(y - box.top);
            float* const to = &images_.depth(box.left, y);
            const std::ptrdiff_t step = images_.depth.pixel_stride;
            covered += static_cast<std::uint64_t>(drawn.covered(y - box.top));
            if (step == 1)
                std::memcpy(to, distances, static_cast<std::size_t>(width) * sizeof(float));
            else
                for (int x = 0; x < width; ++x) to[x * step] = std::bit_cast<float>(distances[x]);
        }
        return covered;
    }
    template <class Tile>
    void face(const Tile& drawn) const
    {
        if (images_.face.data == nullptr) return;
        const RasterBox& box = drawn.box();
        for (int y = box.top; y <= box.bottom; ++y) {
            const std::uint32_t* const ids = drawn.ids(y - box.top);
            const int width = box.right - box.left + 1;
            std::uint32_t* const to = &images_.face(box.left, y);
            const std::ptrdiff_t step = images_.face.pixel_stride;
            if (step == 1) std::memcpy(to, ids, static_cast<std::size_t>(width) * sizeof *to);
            else
                for (int x = 0; x < width; ++x) to[x * step] = ids[x];
        }
    }
    template <class Tile>
    void normal(const Tile& drawn)
    {
        if (images_.normal.x.data == nullptr) return;
        const RasterBox& box = drawn.box();
        for (int y = box.top; y <= box.bottom; ++y) {
            const std::uint32_t* const ids = drawn.ids(y - box.top);
            if (interpolate_) interpolated_row(ids, box, y);
            else own_row(ids, box, y);
        }
    }

private:
    /// Pixels of one triangle, side by side in a row.
    struct Run {
        std::uint32_t id;
        int first;
    };

    void own_row(const std::uint32_t* ids, const RasterBox& box, int y)
    {
        const int width = box.right - box.left + 1;
        Run runs[tile.across + 1];
        int count = 0;
        using Names = Lanes<std::uint32_t, native_lanes>;
        for (int x = 0; x < width; x += native_lanes) {
            // A vector without an end of a run says nothing.
            const int end = smaller(x + native_lanes, width);
            if (end < width &&
                !any(Names{load<native_lanes>(ids + x)} != Names{load<native_lanes>(ids + x + 1)}))
                continue;
            for (int i = x; i < end; ++i) {
                runs[count] = {ids[i], i};
                count += i + 1 == width || ids[i + 1] != ids[i] ? 1 : 0;
            }
        }
        // Each run holds its last pixel so far: those before it end there.
        for (int i = 0, first = 0; i < count; ++i) {
            const int next = runs[i].first + 1;
            runs[i].first = first;
            first = next;
            if (runs[i].id != no_face) normals_.want(runs[i].id);
        }
        runs[count].first = width;
        normals_.finish();
        const ImageView3<float>& image = images_.normal;
        float* const to[3] = {&image.x(box.left, y), &image.y(box.left, y), &image.z(box.left, y)};
        const std::ptrdiff_t step[3] = {image.x.pixel_stride, image.y.pixel_stride,
                                        image.z.pixel_stride};
        const bool tight = step[0] == 3 && step[1] == 3 && step[2] == 3 && to[1] == to[0] + 1 &&
                           to[2] == to[0] + 2;
        for (int i = 0; i < count; ++i) {
            const std::uint32_t id = runs[i].id;
            RasterNormals::Normal normal{0, 0, 0};
            if (id != no_face) {
                const RasterNormals::Normal* const found = normals_.find(id);
                normal = found != nullptr ? *found : normals_.normal(id);
            }
            int x = runs[i].first;
            const int end = runs[i + 1].first;
            if (tight) x = four_at_a_time<(native_lanes > 1 ? 4 : 1)>(to[0], normal, x, end);
            for (; x < end; ++x) {
                to[0][x * step[0]] = normal.x;
                to[1][x * step[1]] = normal.y;
                to[2][x * step[2]] = normal.z;
            }
        }
    }
    /// Writes as many whole fours of interleaved normals as there are in [x, end); returns the rest's
    /// beginning. By way of registers: stores to a pattern in memory would have to be waited for.
    template <int lanes>
    [[nodiscard]] NOOK_INLINE static int four_at_a_time([[maybe_unused]] float* to,
                                                        [[maybe_unused]] RasterNormals::Normal n,
                                                        int x, [[maybe_unused]] int end)
    {
        if constexpr (lanes > 1) {
            using Floats = Lanes<float, lanes>;
            const Floats first{n.x, n.y, n.z, n.x}, second{n.y, n.z, n.x, n.y},
                third{n.z, n.x, n.y, n.z};
            for (; x + 4 <= end; x += 4) {
                store(to + 3 * x, first);
                store(to + 3 * x + 4, second);
                store(to + 3 * x + 8, third);
            }
        }
        return x;
    }
    void interpolated_row(const std::uint32_t* ids, const RasterBox& box, int y)
    {
        const MeshView& mesh = view_.mesh();
        const ImageView3<float>& image = images_.normal;
        for (int x = box.left; x <= box.right;) {
            const std::uint32_t id = ids[x - box.left];
            int end = x;
            while (end <= box.right && ids[end - box.left] == id) ++end;
            if (id == no_face) {
                for (; x < end; ++x) image.x(x, y) = image.y(x, y) = image.z(x, y) = 0;
                continue;
            }
            const Triangle world = mesh_triangle(mesh, id);
            const TriangleSurface surface{view_.projection(), view_.grid().near_plane(),
                                          view_.to_view(world.a), view_.to_view(world.b),
                                          view_.to_view(world.c)};
            Vector3 corners[3] = {};
            for (std::size_t i = 0; i < 3; ++i) {
                const Vector3 normal = mesh_vector(mesh.normals, mesh.normal_stride,
                                                   mesh.indices[3 * std::size_t{id} + i]);
                if (is_finite(normal))
                    corners[i] = view_.frame().direction_to_view(normalised(normal));
            }
            const double slope_y = surface.slope_y(y);
            for (; x < end; ++x) {
                const double slope_x = surface.slope_x(x);
                const Vector3 normal = surface.interpolate(corners, slope_x, slope_y,
                                                           surface.distance(slope_x, slope_y));
                image.x(x, y) = static_cast<float>(normal.x);
                image.y(x, y) = static_cast<float>(normal.y);
                image.z(x, y) = static_cast<float>(normal.z);
            }
        }
    }

    const RasterView& view_;
    RasterImages images_;
    bool interpolate_;
    RasterNormals normals_;
};

}  // namespace nook::inline NOOK_TARGET::detail
