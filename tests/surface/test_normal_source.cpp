#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

#include <doctest/doctest.h>

#include <nook/owned_image.hpp>
#include <nook/surface/normal_source.hpp>

namespace {

using nook::Image;
using nook::ImageView3;
using nook::NormalSource;
using nook::detail::NormalGroup;
using nook::detail::unit_normal;

constexpr int width = 37, height = 5;

/// Whole numbers that are the same with every standard library.
class Dice {
public:
    explicit Dice(std::uint32_t seed) : engine_{seed} {}
    /// In [0, bound).
    int operator()(int bound) { return static_cast<int>(engine_() % static_cast<unsigned>(bound)); }

private:
    std::mt19937 engine_;
};

struct Normals {
    std::vector<float> values = std::vector<float>(std::size_t{3} * width * height);

    float* at(int x, int y) { return &values[static_cast<std::size_t>((y * width + x) * 3)]; }
    [[nodiscard]] NormalSource source() const
    {
        return ImageView3<const float>::interleaved(values.data(), width, height,
                                                    std::ptrdiff_t{3} * width);
    }
};

/// All lengths, with zeros and what is no number among them when asked for.
Normals random_normals(std::uint32_t seed, bool odd, int least = -30, int range = 61)
{
    Dice roll{seed};
    Normals normals;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double length = std::pow(10, least + roll(range));
            for (int i = 0; i < 3; ++i)
                normals.at(x, y)[i] = static_cast<float>((roll(2000001) / 1e6 - 1) * length);
            if (!odd) continue;
            const float poison[] = {
                0, std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::quiet_NaN()};
            const int kind = roll(20);
            if (kind == 0)
                for (int i = 0; i < 3; ++i) normals.at(x, y)[i] = 0;
            else if (kind < 5) normals.at(x, y)[roll(3)] = poison[kind];
        }
    return normals;
}

template <class Real>
void check_groups(const NormalSource& source, double tolerance)
{
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; x += 16) {
            const int count = width - x < 16 ? width - x : 16;
            NormalGroup<Real> group;
            const bool whole = nook::detail::read_normals(source, x, y, count, group);
            bool all = count == 16;
            for (int i = 0; i < 16; ++i) {
                const nook::detail::Normal n =
                    i < count ? unit_normal(source, x + i, y) : nook::detail::Normal{0, 0, 0};
                const bool none = n.x == 0 && n.y == 0 && n.z == 0;
                all = all && !none;
                INFO("pixel ", x + i, ", ", y);
                CHECK(std::fabs(double{group.x[i]} - n.x) <= tolerance);
                CHECK(std::fabs(double{group.y[i]} - n.y) <= tolerance);
                CHECK(std::fabs(double{group.z[i]} - n.z) <= tolerance);
                CHECK(none == (group.x[i] == 0 && group.y[i] == 0 && group.z[i] == 0));
            }
            CHECK(whole == all);
        }
}

}  // namespace

TEST_SUITE("surface/normal_source")
{
    TEST_CASE("a view of normals is a source as it stands")
    {
        static_assert(std::is_convertible_v<ImageView3<float>, NormalSource>);
        static_assert(std::is_convertible_v<ImageView3<const float>, NormalSource>);
        const Normals normals = random_normals(1, false);
        const NormalSource source = normals.source();
        CHECK(source.image.x.data == normals.values.data());
        CHECK(!source.rotated);
        CHECK(NormalSource{}.image.empty());
    }

    TEST_CASE("normals of any length become unit, and what is none becomes zero")
    {
        for (const bool odd : {false, true}) {
            Normals normals = random_normals(odd ? 2 : 3, odd);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const nook::detail::Normal n = unit_normal(normals.source(), x, y);
                    const float* const v = normals.at(x, y);
                    const bool finite = nook::detail::is_finite(v[0]) &&
                                        nook::detail::is_finite(v[1]) &&
                                        nook::detail::is_finite(v[2]);
                    const bool zero = v[0] == 0 && v[1] == 0 && v[2] == 0;
                    const double length = std::hypot(n.x, n.y, n.z);
                    if (!finite || zero) {
                        CHECK(length == 0);
                        continue;
                    }
                    CHECK(std::fabs(length - 1) < 1e-14);
                    const double scale = std::hypot(double{v[0]}, double{v[1]}, double{v[2]});
                    CHECK(std::fabs(n.x * scale - double{v[0]}) <= 1e-14 * scale);
                    CHECK(std::fabs(n.z * scale - double{v[2]}) <= 1e-14 * scale);
                }
        }
    }

    TEST_CASE("groups of 16 agree with single pixels, in float and double, of all lengths")
    {
        for (const std::uint32_t seed : {4u, 5u, 6u})
            for (const bool odd : {false, true}) {
                // Lengths far from the limits of float take another way than those that are not.
                check_groups<float>(random_normals(seed, odd).source(), 2.5e-7);
                check_groups<double>(random_normals(seed, odd).source(), 0);
                check_groups<float>(random_normals(seed, odd, -3, 7).source(), 2.5e-7);
                check_groups<double>(random_normals(seed, odd, -3, 7).source(), 0);
            }
    }

    TEST_CASE("unit normals keep their bits")
    {
        Normals normals = random_normals(7, false, -1, 3);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const nook::detail::Normal n = unit_normal(normals.source(), x, y);
                normals.at(x, y)[0] = static_cast<float>(n.x);
                normals.at(x, y)[1] = static_cast<float>(n.y);
                normals.at(x, y)[2] = static_cast<float>(n.z);
            }
        NormalGroup<float> group;
        CHECK(nook::detail::read_normals(normals.source(), 16, 2, 16, group));
        for (int i = 0; i < 16; ++i) {
            CHECK(group.x[i] == normals.at(16 + i, 2)[0]);
            CHECK(group.y[i] == normals.at(16 + i, 2)[1]);
            CHECK(group.z[i] == normals.at(16 + i, 2)[2]);
        }
    }

    TEST_CASE("a rotation turns the stored axes into view axes")
    {
        // World y becomes view x, z becomes y, x becomes z.
        const float rotation[9] = {0, 1, 0, 0, 0, 1, 1, 0, 0};
        Normals normals = random_normals(8, true, -3, 7);
        normals.at(0, 0)[0] = 1;
        normals.at(0, 0)[1] = 2;
        normals.at(0, 0)[2] = 2;
        const NormalSource turned{normals.source().image, rotation};
        CHECK(turned.rotated);
        const nook::detail::Normal n = unit_normal(turned, 0, 0);
        CHECK(n.x == doctest::Approx(2 / 3.0));
        CHECK(n.y == doctest::Approx(2 / 3.0));
        CHECK(n.z == doctest::Approx(1 / 3.0));
        check_groups<float>(turned, 2.5e-7);
        check_groups<double>(turned, 0);
    }

    TEST_CASE("nothing beside the pixels asked for is read")
    {
        // One pixel of memory at each end of what may be read; sanitizers look at the rest.
        for (int count = 1; count <= 16; ++count) {
            std::vector<float> x(static_cast<std::size_t>(count), 1.f), y(x), z(x);
            const NormalSource source{ImageView3<const float>{
                {x.data(), count, 1}, {y.data(), count, 1}, {z.data(), count, 1}}};
            NormalGroup<float> group;
            CHECK(nook::detail::read_normals(source, 0, 0, count, group) == (count == 16));
            for (int i = 0; i < 16; ++i)
                CHECK(group.x[i] == doctest::Approx(i < count ? 1 / std::sqrt(3.0) : 0));
        }
    }
}
