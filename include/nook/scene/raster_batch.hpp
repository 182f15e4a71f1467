#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/raster_bins.hpp>
#include <nook/scene/raster_surface.hpp>
#include <nook/scene/raster_vertex.hpp>

/// Triangles prepared several at once.
namespace nook::inline NOOK_TARGET::detail {

/// The edge functions of triangles, one triangle to a lane: positive inside, per sample centre.
///
/// They are exact in double, in halves, as long as triangles are less than 2²⁵ units wide and high.
/// The inside of a left edge (upwards) and of a top edge (to the right) includes the edge itself: half
/// a unit keeps the sign from 0.
struct RasterBatch {
    static constexpr int lanes = native_lanes;
    static constexpr std::int32_t widest = 1 << 25;

    /// Bits: what becomes of the triangle in a lane.
    static constexpr std::int32_t live = 1, special = 2, clockwise = 4;

    std::uint32_t triangles[lanes];
    int count = 0;
    std::int32_t state[lanes];
    std::int32_t left[lanes], right[lanes], top[lanes], bottom[lanes];
    float nearest[lanes], farthest[lanes];
    /// At the first sample of the box, and per column and row.
    double value[3][lanes], across[3][lanes], down[3][lanes];

    /// Prepares the triangles for the samples of `box`, 2^bits units apart. A special one is clipped or
    /// too large: it gets no edges.
    void find(const MeshView& mesh, const RasterVertex* vertices, const RasterBox& box, int bits)
    {
        using Integers = Lanes<std::int32_t, lanes>;
        using Reals = Lanes<double, lanes>;
        using Floats = Lanes<float, lanes>;
        std::int32_t x[3][lanes], y[3][lanes], outside[lanes];
        float distance[3][lanes];
        for (int lane = 0; lane < lanes; ++lane) {
            const std::uint32_t t = triangles[lane < count ? lane : 0];
            const std::uint32_t* const index = mesh.indices + 3 * std::size_t{t};
            const auto take = [&](int i) NOOK_INLINE_LAMBDA {
                const RasterVertex& vertex = vertices[index[i]];
                x[i][lane] = vertex.x;
                y[i][lane] = vertex.y;
                distance[i][lane] = vertex.distance;
                return vertex.outside;
            };
            outside[lane] = take(0) | take(1) | take(2);
        }
        const auto get = [](const std::int32_t(&values)[lanes])
                             NOOK_INLINE_LAMBDA { return load<lanes>(values); };
        const Integers xs[3] = {get(x[0]), get(x[1]), get(x[2])};
        const Integers ys[3] = {get(y[0]), get(y[1]), get(y[2])};
        const auto least = [](const auto& a, const auto& b, const auto& c)
                               NOOK_INLINE_LAMBDA { return smaller(smaller(a, b), c); };
        const auto most = [](const auto& a, const auto& b, const auto& c)
                              NOOK_INLINE_LAMBDA { return larger(larger(a, b), c); };
        const Integers low_x = least(xs[0], xs[1], xs[2]), high_x = most(xs[0], xs[1], xs[2]);
        const Integers low_y = least(ys[0], ys[1], ys[2]), high_y = most(ys[0], ys[1], ys[2]);
        const std::int32_t half = 1 << (bits - 1);
        const auto all = [](std::int32_t number)
                             NOOK_INLINE_LAMBDA { return broadcast<lanes>(number); };
        const Integers first_x = larger(Integers{(low_x + (half - 1)) >> bits}, all(box.left));
        const Integers last_x = smaller(Integers{(high_x - (half + 1)) >> bits}, all(box.right));
        const Integers first_y = larger(Integers{(low_y + (half - 1)) >> bits}, all(box.top));
        const Integers last_y = smaller(Integers{(high_y - (half + 1)) >> bits}, all(box.bottom));
        const Integers huge =
            ((high_x - low_x) | (high_y - low_y)) >= widest ? all(special) : Integers{};
        const Integers beyond = load<lanes>(outside) != 0 ? all(special) : Integers{};
        const Integers empty =
            ((last_x - first_x) | (last_y - first_y)) < 0 ? Integers{} : all(live);
        store(left, first_x);
        store(right, last_x);
        store(top, first_y);
        store(bottom, last_y);
        const auto float_of = [&](int i) NOOK_INLINE_LAMBDA { return load<lanes>(distance[i]); };
        store(nearest, Floats{least(float_of(0), float_of(1), float_of(2))});
        store(farthest, Floats{most(float_of(0), float_of(1), float_of(2))});

        const auto real = [](const Integers& whole)
                              NOOK_INLINE_LAMBDA { return Reals{convert<double>(whole)}; };
        const Reals right_b = real(xs[1] - xs[0]), right_c = real(xs[2] - xs[0]);
        const Reals below_b = real(ys[1] - ys[0]), below_c = real(ys[2] - ys[0]);
        const Reals area = right_b * below_c - below_b * right_c;
        const auto one = broadcast<lanes>(1.0);
        // Turned round, the edges of a counter-clockwise triangle are those of a clockwise one.
        const Reals sign = area > 0.0 ? one : Reals{-one};
        const Integers turn = convert<float>(area) > 0.0f ? all(clockwise) : Integers{};
        const Integers flat = convert<float>(area) == 0.0f ? Integers{} : all(live);
        store(state, Integers{(empty & flat) | turn});
        for (int lane = 0; lane < lanes; ++lane) outside[lane] = 0;
        store(outside, Integers{huge | beyond});
        for (int lane = 0; lane < lanes; ++lane)
            if (outside[lane] != 0) state[lane] = special;

        const double unit = static_cast<double>(1 << bits);
        const Integers centre_x = (first_x << bits) + half, centre_y = (first_y << bits) + half;
        for (int i = 0; i < 3; ++i) {
            const int next = i == 2 ? 0 : i + 1;
            const Reals dx = real(xs[next] - xs[i]) * sign, dy = real(ys[next] - ys[i]) * sign;
            const Reals at_x = real(centre_x - xs[i]), at_y = real(centre_y - ys[i]);
            const auto included = (dy < 0.0) | ((dy == 0.0) & (dx > 0.0));
            store(value[i],
                  Reals{dx * at_y - dy * at_x + (included ? Reals{one * 0.5} : Reals{one * -0.5})});
            store(across[i], Reals{dy * -unit});
            store(down[i], Reals{dx * unit});
        }
    }
};

/// Surfaces of triangles, one to a lane.
struct RasterSurfaces {
    static constexpr int lanes = native_lanes;

    double x[lanes], y[lanes], z[lanes], least[lanes];
    bool usable[lanes], cut[lanes];

    /// Of `count` triangles; `nearest` and `farthest` are the ranges of their corners, which are
    /// brought up to date.
    void find(const RasterView& view, const RasterVertex* vertices, const std::uint32_t* triangles,
              int count, double* nearest, double* farthest)
    {
        using Reals = Lanes<double, lanes>;
        double corners[9][lanes];
        const MeshView& mesh = view.mesh();
        for (int lane = 0; lane < lanes; ++lane) {
            const std::size_t t = triangles[lane < count ? lane : 0];
            for (std::size_t i = 0; i < 3; ++i) {
                const Vector3 corner = mesh_position(mesh, mesh.indices[3 * t + i]);
                corners[3 * i][lane] = corner.x;
                corners[3 * i + 1][lane] = corner.y;
                corners[3 * i + 2][lane] = corner.z;
            }
        }
        const auto get = [&](int i) NOOK_INLINE_LAMBDA { return load<lanes>(corners[i]); };
        const auto sum = [](const Reals& a, const Reals& b, const Reals& c) NOOK_INLINE_LAMBDA {
            return Reals{rounded(a) + rounded(b) + rounded(c)};
        };
        const Reals ab[3] = {get(3) - get(0), get(4) - get(1), get(5) - get(2)};
        const Reals ac[3] = {get(6) - get(0), get(7) - get(1), get(8) - get(2)};
        const auto product =
            [](const Reals& p, const Reals& q, const Reals& r, const Reals& s)
                NOOK_INLINE_LAMBDA { return Reals{rounded(Reals{p * q}) - rounded(Reals{r * s})}; };
        const Reals world[3] = {product(ab[1], ac[2], ab[2], ac[1]),
                                product(ab[2], ac[0], ab[0], ac[2]),
                                product(ab[0], ac[1], ab[1], ac[0])};
        const auto dots = [&](const Reals(&a)[3], const Reals(&b)[3]) NOOK_INLINE_LAMBDA {
            return Reals{sum(Reals{a[0] * b[0]}, Reals{a[1] * b[1]}, Reals{a[2] * b[2]})};
        };
        const auto along = [&](const Vector3& axis) NOOK_INLINE_LAMBDA {
            return Reals{
                sum(Reals{world[0] * axis.x}, Reals{world[1] * axis.y}, Reals{world[2] * axis.z})};
        };
        // As `is_usable_triangle`; the coordinates are finite, or there would be no corners.
        double spread[lanes];
        store(spread,
              Reals{dots(world, world) - rounded(Reals{0x1p-100 * dots(ab, ab) * dots(ac, ac)})});
        const Vector3& origin = view.frame().origin;
        const Reals offset =
            sum(Reals{world[0] * (get(0) - origin.x)}, Reals{world[1] * (get(1) - origin.y)},
                Reals{world[2] * (get(2) - origin.z)}) *
            view.volume();
        const Reals normal[3] = {along(view.normal_axis(0)), along(view.normal_axis(1)),
                                 along(view.normal_axis(2))};
        const bool orthographic = view.projection().orthographic;
        const Reals scale = 1.0 / (orthographic ? normal[2] : offset);
        store(x, Reals{normal[0] * scale});
        store(y, Reals{normal[1] * scale});
        store(z, Reals{-(orthographic ? offset : normal[2]) * scale});
        store(least, Reals{1.0 / load<lanes>(farthest)});
        const double far_limit = raster_far_limit(view.projection());
        for (int lane = 0; lane < count; ++lane) {
            usable[lane] = spread[lane] > 0;
            cut[lane] = false;
            if (farthest[lane] * (1 + 0x1p-22) < far_limit && is_finite(x[lane]) &&
                is_finite(y[lane]) && is_finite(z[lane]))
                continue;
            const std::uint32_t* const index = mesh.indices + 3 * std::size_t{triangles[lane]};
            RasterSurface surface{};
            usable[lane] = find_surface(view, triangles[lane], vertices[index[0]],
                                        vertices[index[1]], vertices[index[2]], surface);
            x[lane] = surface.x;
            y[lane] = surface.y;
            z[lane] = surface.z;
            least[lane] = surface.least;
            nearest[lane] = surface.nearest;
            farthest[lane] = surface.farthest;
            cut[lane] = surface.cut;
        }
    }
    [[nodiscard]] RasterSurface at(int lane, double nearest, double farthest) const
    {
        return {x[lane], y[lane], z[lane], least[lane], nearest, farthest, cut[lane]};
    }
};

}  // namespace nook::inline NOOK_TARGET::detail
