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
#include <nook/scene/raster_smooth.hpp>
#include <nook/scene/raster_tile.hpp>
#include <nook/scene/raster_vertex.hpp>
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
        : images_{images},
          interpolate_{interpolate},
          normals_{view},
          smooth_{view}
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
        for (int y = 0; y <= box.bottom - box.top; ++y) {
            if (interpolate_) interpolated_row(drawn, y);
            else own_row(drawn, y);
        }
    }

private:
    /// Pixels of one triangle, side by side in a row.
    struct Run {
        std::uint32_t id;
        int first;
    };

    /// A row of a tile in the three images of the normal.
    struct Row {
        float* to[3];
        std::ptrdiff_t step[3];
        int width;
        /// x, y and z side by side, or in planes.
        bool tight, planes;

        Row(const ImageView3<float>& image, const RasterBox& box, int y)
            : to{&image.x(box.left, box.top + y), &image.y(box.left, box.top + y),
                 &image.z(box.left, box.top + y)},
              step{image.x.pixel_stride, image.y.pixel_stride, image.z.pixel_stride},
              width{box.right - box.left + 1},
              tight{step[0] == 3 && step[1] == 3 && step[2] == 3 && to[1] == to[0] + 1 &&
                    to[2] == to[0] + 2},
              planes{step[0] == 1 && step[1] == 1 && step[2] == 1}
        {}
        /// Fills [x, end), from left to right.
        NOOK_INLINE void fill(const RasterNormals::Normal& n, int x, int end) const
        {
            if (tight) {
                x = four_at_a_time<(native_lanes > 1 ? 4 : 1)>(to[0], n, x, end);
            } else if (planes) {
                // What is written beyond the end is the next run's, which comes after.
                const int last = smaller(end - 1, width - native_lanes);
                const auto n_x = broadcast<native_lanes>(n.x), n_y = broadcast<native_lanes>(n.y),
                           n_z = broadcast<native_lanes>(n.z);
                for (; x <= last; x += native_lanes) {
                    store(to[0] + x, n_x);
                    store(to[1] + x, n_y);
                    store(to[2] + x, n_z);
                }
            }
            for (; x < end; ++x) {
                to[0][x * step[0]] = n.x;
                to[1][x * step[1]] = n.y;
                to[2][x * step[2]] = n.z;
            }
        }
        /// Writes as many whole fours of interleaved normals as there are in [x, end); returns the
        /// rest's beginning. By way of registers: stores to a pattern in memory would have to be
        /// waited for.
        template <int lanes>
        [[nodiscard]] NOOK_INLINE static int four_at_a_time(
            [[maybe_unused]] float* to, [[maybe_unused]] RasterNormals::Normal n, int x,
            [[maybe_unused]] int end)
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
    };

    /// The runs of a row, and where the last one ends.
    [[nodiscard]] static int find_runs(const std::uint32_t* ids, int width,
                                       Run (&runs)[tile.across + 1])
    {
        using Names = Lanes<std::uint32_t, float_lanes>;
        using Floats = Lanes<float, float_lanes>;
        int count = 0, first = 0;
        for (int x = 0; x < width; x += float_lanes) {
            const Floats side =
                Names{load<float_lanes>(ids + x)} != Names{load<float_lanes>(ids + x + 1)}
                    ? broadcast<float_lanes>(0.0f)
                    : broadcast<float_lanes>(1.0f);
            unsigned ends = bits_at_most(side, Floats{});
            if (const int left = width - x; left <= float_lanes)
                ends = (ends | 1u << (left - 1)) & ((2u << (left - 1)) - 1);
            for (; ends != 0; ends &= ends - 1) {
                const int end = x + std::countr_zero(ends) + 1;
                runs[count++] = {ids[first], first};
                first = end;
            }
        }
        runs[count].first = width;
        return count;
    }
    template <class Tile>
    void own_row(const Tile& drawn, int y)
    {
        const Row row{images_.normal, drawn.box(), y};
        Run runs[tile.across + 1];
        const int count = find_runs(drawn.ids(y), row.width, runs);
        for (int i = 0; i < count; ++i)
            if (runs[i].id != no_face) normals_.want(runs[i].id);
        normals_.finish();
        for (int i = 0; i < count; ++i) {
            const std::uint32_t id = runs[i].id;
            RasterNormals::Normal normal{0, 0, 0};
            if (id != no_face) {
                const RasterNormals::Normal* const found = normals_.find(id);
                normal = found != nullptr ? *found : normals_.normal(id);
            }
            row.fill(normal, runs[i].first, runs[i + 1].first);
        }
    }
    template <class Tile>
    void interpolated_row(const Tile& drawn, int y)
    {
        const Row row{images_.normal, drawn.box(), y};
        Run runs[tile.across + 1];
        const int count = find_runs(drawn.ids(y), row.width, runs);
        for (int i = 0; i < count; ++i)
            if (runs[i].id != no_face) smooth_.want(runs[i].id);
        smooth_.finish();
        for (int i = 0; i < count; ++i) {
            const int first = runs[i].first, end = runs[i + 1].first;
            if (runs[i].id == no_face) {
                row.fill({0, 0, 0}, first, end);
                continue;
            }
            const auto draw = [&](float* n_x, float* n_y, float* n_z) NOOK_INLINE_LAMBDA {
                smooth_.draw(smooth_.triangle(runs[i].id), drawn.across(), drawn.down(y),
                             drawn.distances(y), first, end, n_x, n_y, n_z);
            };
            // What is written beyond the end is the next run's, which comes after.
            if (row.planes && end - 1 + native_lanes <= row.width) {
                draw(row.to[0], row.to[1], row.to[2]);
            } else {
                draw(row_[0], row_[1], row_[2]);
                for (int k = 0; k < 3; ++k)
                    for (int x = first; x < end; ++x) row.to[k][x * row.step[k]] = row_[k][x];
            }
        }
    }

    RasterImages images_;
    bool interpolate_;
    RasterNormals normals_;
    RasterSmooth smooth_;
    /// Normals of a row, with room for a whole vector from any pixel on.
    float row_[3][tile.across + native_lanes];
};

}  // namespace nook::inline NOOK_TARGET::detail
