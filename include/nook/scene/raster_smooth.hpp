#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/raster_surface.hpp>
#include <nook/scene/raster_vertex.hpp>
#include <nook/scene/vector.hpp>

/// Vertex normals interpolated over triangles.
namespace nook::inline NOOK_TARGET::detail {

/// Normals of triangles as functions of the pixel.
///
/// With the ray r = (slope_x, slope_y, −1) of a pixel, that meets the triangle a b c at the distance d,
/// the weight of a is d · (r · (b × c)) / (a · (b × c)): linear in the slopes but for d. The product with
/// b × c = b × (c − b) is taken from r − b / |b_z|, so that small triangles far away keep their digits.
/// Under orthography weights are linear as they stand.
class RasterSmooth {
public:
    static constexpr int lanes = native_lanes;
    using Reals = Lanes<double, lanes>;
    using Floats = Lanes<float, lanes>;

    struct Triangle {
        /// The weight of a corner, but for the distance: x · slope_x + y · slope_y + z.
        double x[3], y[3], z[3];
        /// Normals of the corners, and the triangle's own, towards the viewer.
        float normals[3][3], own[3];
        /// Some of the corners' normals lie on the other side, and may be turned.
        bool mixed;
    };

    explicit RasterSmooth(const RasterView& view) : view_{view}
    {
        for (std::uint32_t& id : ids_) id = no_face;
    }
    /// Asks for a triangle; there once `finish` has been called, until another takes its place.
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
        compute();
        count_ = 0;
    }
    [[nodiscard]] const Triangle& triangle(std::uint32_t id)
    {
        if (ids_[id % slots] != id) {
            want(id);
            finish();
        }
        return triangles_[id % slots];
    }

    /// The normals of a triangle at the pixels [first, end) of a row; `across` holds the slopes of its
    /// columns, `distances` the bits of floats. Whole vectors are read and written: up to lanes − 1
    /// numbers behind the end.
    NOOK_INLINE void draw(const Triangle& t, const double* across, double down,
                          const std::int32_t* distances, int first, int end, float* x, float* y,
                          float* z) const
    {
        const bool orthographic = view_.projection().orthographic;
        double row[3];
        for (int i = 0; i < 3; ++i) row[i] = rounded(t.y[i] * down) + t.z[i];
        for (int at = first; at < end; at += lanes) {
            const Reals slopes = load<lanes>(across + at);
            const auto there =
                std::bit_cast<Floats>(Lanes<std::int32_t, lanes>{load<lanes>(distances + at)});
            const Reals scale = orthographic ? broadcast<lanes>(1.0) : convert<double>(there);
            // Snapping can put a pixel a little outside.
            const auto weight = [&](int i) NOOK_INLINE_LAMBDA {
                const Reals value = rounded(Reals{slopes * t.x[i]}) + row[i];
                return Floats{convert<float>(Reals{larger(value, Reals{}) * scale})};
            };
            const Floats a = weight(0), b = weight(1), c = weight(2);
            const auto sum = [](const Floats& p, const Floats& q, const Floats& r)
                                 NOOK_INLINE_LAMBDA { return Floats{kept(p) + kept(q) + kept(r)}; };
            const auto blend = [&](int k) NOOK_INLINE_LAMBDA {
                return sum(Floats{a * t.normals[0][k]}, Floats{b * t.normals[1][k]},
                           Floats{c * t.normals[2][k]});
            };
            const Floats n[3] = {blend(0), blend(1), blend(2)};
            const Floats square =
                sum(Floats{n[0] * n[0]}, Floats{n[1] * n[1]}, Floats{n[2] * n[2]});
            Floats scale_to_one = 1.0f / square_root(square);
            if (t.mixed) {
                const Floats side =
                    sum(Floats{n[0] * t.own[0]}, Floats{n[1] * t.own[1]}, Floats{n[2] * t.own[2]});
                scale_to_one = side < 0.0f ? Floats{-scale_to_one} : scale_to_one;
            }
            const auto there_is_one = square > least_square;
            const auto put = [&](float* to, int k) NOOK_INLINE_LAMBDA {
                store(to + at, Floats{there_is_one ? Floats{n[k] * scale_to_one}
                                                   : broadcast<lanes>(t.own[k])});
            };
            put(x, 0);
            put(y, 1);
            put(z, 2);
        }
    }

private:
    static constexpr std::uint32_t slots = 512;
    /// Of a sum of normals: below it only rounding is left.
    static constexpr float least_square = 0x1p-80f;
    using Bits = Lanes<std::int64_t, lanes>;

    struct Vectors {
        Reals x, y, z;
    };
    /// As `rounded`. Two floats are no native vector where SSE2 is all there is, and nothing is
    /// contracted there.
    [[nodiscard]] NOOK_INLINE static Floats kept(const Floats& value)
    {
#if defined(__SSE2__)
        if constexpr (lanes == 2) return value;
#endif
        return rounded(value);
    }
    [[nodiscard]] NOOK_INLINE static Vectors minus(const Vectors& a, const Vectors& b)
    {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    [[nodiscard]] NOOK_INLINE static Reals sum(const Reals& a, const Reals& b, const Reals& c)
    {
        return rounded(a) + rounded(b) + rounded(c);
    }
    [[nodiscard]] NOOK_INLINE static Reals product(const Vectors& a, const Vectors& b)
    {
        return sum(Reals{a.x * b.x}, Reals{a.y * b.y}, Reals{a.z * b.z});
    }
    [[nodiscard]] NOOK_INLINE static Vectors across(const Vectors& a, const Vectors& b)
    {
        const auto difference =
            [](const Reals& p, const Reals& q, const Reals& r, const Reals& s)
                NOOK_INLINE_LAMBDA { return Reals{rounded(Reals{p * q}) - rounded(Reals{r * s})}; };
        return {difference(a.y, b.z, a.z, b.y), difference(a.z, b.x, a.x, b.z),
                difference(a.x, b.y, a.y, b.x)};
    }
    [[nodiscard]] NOOK_INLINE Vectors turned(const Vectors& v) const
    {
        const auto along = [&](const Vector3& axis) NOOK_INLINE_LAMBDA {
            return sum(Reals{v.x * axis.x}, Reals{v.y * axis.y}, Reals{v.z * axis.z});
        };
        const Frame& frame = view_.frame();
        return {along(frame.right), along(frame.up), along(frame.back)};
    }
    [[nodiscard]] NOOK_INLINE static auto finite(const Reals& value)
    {
        constexpr std::int64_t exponents = std::int64_t{0x7ff} << 52;
        return (std::bit_cast<Bits>(value) & exponents) != exponents;
    }

    void compute();

    const RasterView& view_;
    std::uint32_t ids_[slots];
    Triangle triangles_[slots];
    std::uint32_t wanted_[lanes];
    int count_ = 0;
};

NOOK_NOINLINE inline void RasterSmooth::compute()
{
    float corners[9][lanes], normals[9][lanes];
    const MeshView& mesh = view_.mesh();
    for (int lane = 0; lane < lanes; ++lane) {
        const std::uint32_t id = wanted_[lane < count_ ? lane : 0];
        for (std::size_t i = 0; i < 3; ++i) {
            const auto index = static_cast<std::ptrdiff_t>(mesh.indices[3 * std::size_t{id} + i]);
            const float* const position = mesh.positions + index * mesh.position_stride;
            const float* const normal = mesh.normals + index * mesh.normal_stride;
            for (std::size_t k = 0; k < 3; ++k) {
                corners[3 * i + k][lane] = position[k];
                normals[3 * i + k][lane] = normal[k];
            }
        }
    }
    const auto get = [](const float(&values)[9][lanes], int i) NOOK_INLINE_LAMBDA {
        const auto real = [&](int k) NOOK_INLINE_LAMBDA {
            return convert<double>(load<lanes>(values[3 * i + k]));
        };
        return Vectors{real(0), real(1), real(2)};
    };
    const bool orthographic = view_.projection().orthographic;
    const Vector3& eye = view_.frame().origin;
    Vectors corner[3], normal[3];
    for (int i = 0; i < 3; ++i) {
        const Vectors world = get(corners, i);
        corner[i] = turned({world.x - eye.x, world.y - eye.y, world.z - eye.z});
        const Vectors given = get(normals, i);
        const Reals square = product(given, given);
        // By bits: neither zero nor infinite, nor no number at all.
        const auto usable = (std::bit_cast<Bits>(square) != 0) & finite(square);
        const auto usable_part = [&](const Reals& value)
                                     NOOK_INLINE_LAMBDA { return usable ? value : Reals{}; };
        const Reals length = 1.0 / square_root(Reals{usable ? square : broadcast<lanes>(1.0)});
        const Vectors whole =
            turned({usable_part(given.x), usable_part(given.y), usable_part(given.z)});
        normal[i] = {whole.x * length, whole.y * length, whole.z * length};
    }

    const Vectors plane = across(minus(corner[1], corner[0]), minus(corner[2], corner[0]));
    const Reals offset = product(plane, corner[0]);
    // Twice the area, or six times the volume of the triangle and the viewer.
    const Reals all = orthographic ? plane.z : offset;
    const Reals per_all = 1.0 / all;
    Reals flat{};
    Reals x[3], y[3], z[3];
    for (int i = 0; i < 3; ++i) {
        const Vectors &from = corner[i == 2 ? 0 : i + 1], &to = corner[i == 0 ? 2 : i - 1];
        const Vectors edge = minus(to, from);
        const Vectors normal_of_edge = across(from, edge);
        Reals at_x = from.x, at_y = from.y, rest{};
        if (orthographic) {
            x[i] = -edge.y * per_all;
            y[i] = edge.x * per_all;
        } else {
            x[i] = normal_of_edge.x * per_all;
            y[i] = normal_of_edge.y * per_all;
            const auto nearer = from.z > to.z;
            const Reals depth = nearer ? Reals{-to.z} : Reals{-from.z};
            const auto behind = depth <= 0.0;
            const Reals scale = 1.0 / (behind ? broadcast<lanes>(1.0) : depth);
            at_x = behind ? Reals{} : Reals{(nearer ? to.x : from.x) * scale};
            at_y = behind ? Reals{} : Reals{(nearer ? to.y : from.y) * scale};
            rest = behind ? Reals{-normal_of_edge.z * per_all} : Reals{};
        }
        z[i] = rest - rounded(Reals{x[i] * at_x}) - rounded(Reals{y[i] * at_y});
        flat = (finite(x[i]) & finite(y[i]) & finite(z[i])) ? flat : broadcast<lanes>(1.0);
    }

    // Towards the viewer: at the origin, or along +z.
    const Reals side = orthographic ? plane.z : Reals{-offset};
    const Reals square = product(plane, plane);
    const Reals length = 1.0 / square_root(square);
    const Reals turn = side < 0.0 ? Reals{-length} : length;
    const Vectors own{plane.x * turn, plane.y * turn, plane.z * turn};
    const Reals sides[3] = {product(normal[0], own), product(normal[1], own),
                            product(normal[2], own)};
    const Reals lowest = smaller(Reals{smaller(sides[0], sides[1])}, sides[2]);
    const Reals highest = larger(Reals{larger(sides[0], sides[1])}, sides[2]);
    const auto one = broadcast<lanes>(1.0);
    const Reals sign = ((lowest < 0.0) & (highest <= 0.0)) ? Reals{-one} : one;
    const Reals both = ((lowest < 0.0) & (highest > 0.0)) ? one : Reals{};

    double weights[9][lanes], flats[lanes], mixed[lanes], squares[lanes], towards[lanes];
    float vectors[12][lanes];
    double planes[3][lanes];
    for (int i = 0; i < 3; ++i) {
        store(weights[i], x[i]);
        store(weights[3 + i], y[i]);
        store(weights[6 + i], z[i]);
        store(vectors[3 * i], convert<float>(Reals{normal[i].x * sign}));
        store(vectors[3 * i + 1], convert<float>(Reals{normal[i].y * sign}));
        store(vectors[3 * i + 2], convert<float>(Reals{normal[i].z * sign}));
    }
    store(vectors[9], convert<float>(own.x));
    store(vectors[10], convert<float>(own.y));
    store(vectors[11], convert<float>(own.z));
    store(flats, flat);
    store(mixed, both);
    store(squares, square);
    store(towards, side);
    store(planes[0], plane.x);
    store(planes[1], plane.y);
    store(planes[2], plane.z);
    for (int lane = 0; lane < count_; ++lane) {
        const std::uint32_t slot = wanted_[lane] % slots;
        // Another triangle may have taken its place.
        if (ids_[slot] != wanted_[lane]) continue;
        Triangle& t = triangles_[slot];
        t.mixed = mixed[lane] > 0;
        for (int i = 0; i < 3; ++i) {
            t.x[i] = weights[i][lane];
            t.y[i] = weights[3 + i][lane];
            t.z[i] = weights[6 + i][lane];
            for (int k = 0; k < 3; ++k) t.normals[i][k] = vectors[3 * i + k][lane];
            t.own[i] = vectors[9 + i][lane];
        }
        if (squares[lane] > 0x1p-900 && squares[lane] < 0x1p900 && flats[lane] == 0) continue;
        // Seen edge on, or not to be told from it: there are no weights.
        Vector3 extreme = normalised(Vector3{planes[0][lane], planes[1][lane], planes[2][lane]});
        if (towards[lane] < 0) extreme = -extreme;
        if (!is_finite(extreme)) extreme = {0, 0, 1};
        t = {{},
             {},
             {},
             {},
             {static_cast<float>(extreme.x), static_cast<float>(extreme.y),
              static_cast<float>(extreme.z)},
             false};
    }
}

}  // namespace nook::inline NOOK_TARGET::detail
