#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <vector>

#include <nook/scene/directions.hpp>

namespace {

constexpr nook::DirectionSet all_sets[] = {nook::DirectionSet::scrambled_sobol,
                                           nook::DirectionSet::spun, nook::DirectionSet::r2};
const char* name_of(nook::DirectionSet set)
{
    return set == nook::DirectionSet::spun ? "spun"
           : set == nook::DirectionSet::r2 ? "r2"
                                           : "scrambled_sobol";
}

struct Batch {
    std::vector<float> x, y, z;
    explicit Batch(int count)
        : x(static_cast<std::size_t>(nook::direction_room(count)), -7.0f),
          y(x),
          z(x)
    {}
};
Batch batch(nook::DirectionSet set, std::uint32_t seed_hash, std::uint32_t first, int count)
{
    Batch result{count};
    nook::cosine_directions(set, seed_hash, first, count, result.x.data(), result.y.data(),
                            result.z.data());
    return result;
}

/// The polar map in double.
std::array<double, 3> direction_of(const nook::SampleBits& bits)
{
    const double angle = 2 * std::numbers::pi * (bits.u + 0.5) * 0x1p-32;
    const double v = (bits.v + 0.5) * 0x1p-32, sine = std::sqrt(v);
    return {sine * std::cos(angle), sine * std::sin(angle), std::sqrt(1 - v)};
}

/// What is seen of a wall that is infinitely long, at a distance of 1: facts in closed form.
bool misses_near_wall(float x, float) { return !(x >= 0.5f); }         // radius 2, any height
bool misses_low_wall(float x, float z) { return !(x > 0 && z <= x); }  // height 1, any radius
constexpr double near_wall = 1 - 0.1955011094779, low_wall = 0.8535533905933;
/// Exponential falloff, sigma 1: a ceiling at height 1, 2 E_3(1), and a wall of any height,
/// (2/pi)(Ki_1(1) - Ki_3(1)).
double through_ceiling(float, float z) { return std::exp(-1.0 / double{z}); }
double through_wall(float x, float) { return x > 0 ? std::exp(-1.0 / double{x}) : 0; }
const double ceiling = 2 * 0.10969196719776,
             far_wall = 2 / std::numbers::pi * (0.32828647817112 - 0.23784508219286);

template <class Integrand>
double estimate(const Batch& directions, int count, const Integrand& integrand)
{
    double sum = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        sum += static_cast<double>(integrand(directions.x[i], directions.z[i]));
    return sum / count;
}

/// Root mean square errors over randomisations, and the slope of their logarithms.
struct Convergence {
    std::vector<double> rms;
    double slope = 0;
};
template <class Integrand>
Convergence convergence(nook::DirectionSet set, const Integrand& integrand, double truth,
                        int randomisations = 200)
{
    Convergence result;
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int count = 64; count <= 4096; count *= 2) {
        double sum = 0;
        for (int i = 0; i < randomisations; ++i) {
            const std::uint32_t seed = nook::hash(77, static_cast<std::uint32_t>(i));
            const double error = estimate(batch(set, seed, 0, count), count, integrand) - truth;
            sum += error * error;
        }
        result.rms.push_back(std::sqrt(sum / randomisations));
        const double x = std::log(count), y = std::log(result.rms.back());
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    const auto n = static_cast<double>(result.rms.size());
    result.slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    return result;
}

}  // namespace

TEST_CASE("directions follow the polar map of their integer points, in the stated order")
{
    for (const nook::DirectionSet set : all_sets) {
        CAPTURE(name_of(set));
        double worst = 0;
        for (const int count : {1, 2, 3, 4, 8, 15, 16, 17, 32, 64, 100, 1024}) {
            for (const std::uint32_t first : {0u, 1024u, 3u, 0xfffffff0u, 0x80000000u}) {
                for (std::uint32_t seed = 0; seed < 20; ++seed) {
                    const std::uint32_t seed_hash = nook::hash(seed, 9);
                    const Batch got = batch(set, seed_hash, first, count);
                    std::vector<nook::SampleBits> bits;
                    for (int i = 0; i < count; ++i)
                        bits.push_back(nook::direction_bits(set, seed_hash,
                                                            first + static_cast<std::uint32_t>(i)));
                    const auto size = static_cast<std::uint32_t>(count);
                    if (set != nook::DirectionSet::r2 && size >= 32 && std::has_single_bit(size) &&
                        first % size == 0) {
                        const std::uint32_t turn = set == nook::DirectionSet::spun
                                                       ? nook::ScrambledSobol{seed_hash}.seeds().u
                                                       : 0;
                        std::sort(bits.begin(), bits.end(), [&](const auto& a, const auto& b) {
                            return a.u - turn < b.u - turn;
                        });
                        // One in each wedge.
                        for (std::uint32_t i = 0; i < size; ++i)
                            CHECK((std::uint64_t{bits[i].u - turn} * size >> 32) == i);
                    }
                    for (std::size_t i = 0; i < size; ++i) {
                        const auto expected = direction_of(bits[i]);
                        worst = std::fmax(worst, std::fabs(double{got.x[i]} - expected[0]));
                        worst = std::fmax(worst, std::fabs(double{got.y[i]} - expected[1]));
                        worst = std::fmax(worst, std::fabs(double{got.z[i]} - expected[2]));
                    }
                }
            }
        }
        // Half a unit of the last place at 1 is 2^-24.
        CHECK(worst < 3 * 0x1p-24);
    }
}

TEST_CASE("coordinates keep their relative precision: 4 units in the last place")
{
    for (const nook::DirectionSet set : all_sets) {
        double worst = 0;
        for (std::uint32_t seed = 0; seed < 200; ++seed) {
            const Batch got = batch(set, nook::hash(seed), 7, 500);
            for (std::uint32_t i = 0; i < 500; ++i) {
                const auto expected =
                    direction_of(nook::direction_bits(set, nook::hash(seed), 7 + i));
                const float found[3] = {got.x[i], got.y[i], got.z[i]};
                for (std::size_t k = 0; k < 3; ++k) {
                    const float size = static_cast<float>(std::fabs(expected[k]));
                    const double unit = double{std::nextafter(size, 2.0f)} - double{size};
                    worst = std::fmax(worst, std::fabs(double{found[k]} - expected[k]) / unit);
                }
            }
        }
#if defined(__FAST_MATH__)
        CHECK(worst < 8);
#else
        CHECK(worst < 4);
#endif
    }
}

TEST_CASE("Sobol directions are those of the sequence in double")
{
    const std::uint32_t seed_hash = nook::hash(3, 4);
    const nook::ScrambledSobol points{seed_hash};
    const nook::detail::HemisphereBasis basis{{0, 0, 1}};
    const Batch got = batch(nook::DirectionSet::scrambled_sobol, seed_hash, 5, 200);
    for (std::uint32_t i = 0; i < 200; ++i) {
        const nook::SampleBits bits =
            nook::direction_bits(nook::DirectionSet::scrambled_sobol, seed_hash, 5 + i);
        CHECK(bits.u == points.bits(5 + i).u);
        CHECK(bits.v == points.bits(5 + i).v);
        const nook::detail::Vector3 expected = basis.cosine_direction(points(5 + i));
        CHECK(std::fabs(double{got.x[i]} - expected.x) < 3 * 0x1p-24);
        CHECK(std::fabs(double{got.y[i]} - expected.y) < 3 * 0x1p-24);
        CHECK(std::fabs(double{got.z[i]} - expected.z) < 3 * 0x1p-24);
    }
}

TEST_CASE("directions are unit and above the surface; the room beyond the count holds such, too")
{
    for (const nook::DirectionSet set : all_sets) {
        for (int count = 0; count < 70; ++count) {
            const Batch got =
                batch(set, nook::hash(11, 2), static_cast<std::uint32_t>(count), count);
            for (std::size_t i = 0; i < got.x.size(); ++i) {
                const double x = double{got.x[i]}, y = double{got.y[i]}, z = double{got.z[i]};
                CHECK(std::fabs(x * x + y * y + z * z - 1) < 8 * 0x1p-24);
                CHECK(z > 0x1p-17);
            }
            for (auto i = static_cast<std::size_t>(count); i < got.x.size(); ++i)
                CHECK(got.z[i] > 0.9999f);
        }
    }
}

TEST_CASE("the corners of the square give unit directions above the surface")
{
    constexpr std::uint32_t corners[] = {0,          1,          0x1fffffff, 0x20000000, 0x3fffffff,
                                         0x40000000, 0x7fffffff, 0x80000000, 0xbfffffff, 0xdfffffff,
                                         0xe0000000, 0xffffff00, 0xffffffff};
    for (const std::uint32_t u : corners) {
        for (const std::uint32_t v : corners) {
            float x = 0, y = 0, z = 0;
            nook::detail::write_directions<1>({u, v}, &x, &y, &z);
            const auto expected = direction_of({u, v});
            CHECK(std::fabs(double{x} - expected[0]) < 3 * 0x1p-24);
            CHECK(std::fabs(double{y} - expected[1]) < 3 * 0x1p-24);
            CHECK(std::fabs(double{z} - expected[2]) < 3 * 0x1p-24);
            CHECK(z > 0x1p-17f);
        }
    }
}

TEST_CASE("successive blocks make up the directions of one large block, bit for bit")
{
    using Direction = std::tuple<float, float, float>;
    for (const nook::DirectionSet set : all_sets) {
        for (const int count : {1, 4, 16, 64}) {
            std::vector<Direction> blocks, whole;
            const int all = 1024;
            for (int first = 0; first < all; first += count) {
                const Batch part = batch(set, 99, static_cast<std::uint32_t>(first), count);
                for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
                    blocks.emplace_back(part.x[i], part.y[i], part.z[i]);
            }
            const Batch one = batch(set, 99, 0, all);
            for (std::size_t i = 0; i < static_cast<std::size_t>(all); ++i)
                whole.emplace_back(one.x[i], one.y[i], one.z[i]);
            std::sort(blocks.begin(), blocks.end());
            std::sort(whole.begin(), whole.end());
            CHECK(blocks == whole);
        }
    }
}

TEST_CASE("any number of lanes gives the same directions")
{
    for (const nook::DirectionSet set : all_sets) {
        for (const int count : {1, 2, 8, 16, 21, 64, 128}) {
            for (const std::uint32_t first : {0u, 5u, 128u, 0xffffff80u}) {
                const Batch wide = batch(set, 1234, first, count);
                Batch scalar{count};
                nook::detail::cosine_directions<1>(set, 1234, first, count, scalar.x.data(),
                                                   scalar.y.data(), scalar.z.data());
#if defined(__FAST_MATH__)
                for (std::size_t i = 0; i < scalar.x.size(); ++i) {
                    CHECK(std::fabs(wide.x[i] - scalar.x[i]) < 4 * 0x1p-24f);
                    CHECK(std::fabs(wide.y[i] - scalar.y[i]) < 4 * 0x1p-24f);
                    CHECK(std::fabs(wide.z[i] - scalar.z[i]) < 4 * 0x1p-24f);
                }
#else
                CHECK(wide.x == scalar.x);
                CHECK(wide.y == scalar.y);
                CHECK(wide.z == scalar.z);
#endif
            }
        }
    }
}

#if !defined(__FAST_MATH__)
TEST_CASE("directions have the same bits on every target")
{
    std::uint64_t sum = 1469598103934665603u;
    const auto add = [&](const std::vector<float>& values) {
        for (const float value : values)
            sum = (sum ^ std::uint64_t{std::bit_cast<std::uint32_t>(value)}) * 1099511628211u;
    };
    for (const nook::DirectionSet set : all_sets) {
        for (std::uint32_t seed = 0; seed < 200; ++seed) {
            for (const int count : {16, 17, 64, 256}) {
                const Batch got = batch(set, nook::hash(seed, 3), seed * 16, count);
                add(got.x);
                add(got.y);
                add(got.z);
            }
        }
    }
    CHECK(sum == 0x852bc220257d8118u);
}
#endif

TEST_CASE("the R2 sequence is exact up to its last index")
{
    constexpr long double steps[2] = {0.754877666246692760049508896358528692L,
                                      0.569840290998053265911399958119568649L};
    const nook::SampleBits shift = nook::ScrambledSobol{6}.seeds();
    for (const std::uint32_t index : {0u, 1u, 2u, 1000u, 123456789u, 0x80000000u, 0xffffffffu}) {
        const nook::SampleBits bits = nook::direction_bits(nook::DirectionSet::r2, 6, index);
        const std::uint32_t found[2] = {bits.u - shift.u, bits.v - shift.v};
        for (int k = 0; k < 2; ++k) {
            if (LDBL_MANT_DIG < 64 && index > 1000) continue;
            const long double product = steps[k] * static_cast<long double>(index);
            const double fraction = static_cast<double>(product - std::floor(product));
            CHECK(std::fabs(found[k] * 0x1p-32 - fraction) < 1.5 * 0x1p-32);
        }
    }
    CHECK((nook::detail::r2_steps[0] >> 11) ==
          static_cast<std::uint64_t>(0.754877666246692760049508896358528692L * 0x1p53L));
    CHECK((nook::detail::r2_steps[1] >> 11) ==
          static_cast<std::uint64_t>(0.569840290998053265911399958119568649L * 0x1p53L));
}

TEST_CASE("each direction of a set is cosine-weighted over the seeds")
{
    // E[z] = 2/3 and E[z^2] = 1/2 with deviations 0.236 and 0.289; E[x] = E[y] = 0 with 0.5.
    const int seeds = 20000;
    for (const nook::DirectionSet set : all_sets) {
        double x = 0, y = 0, z = 0, square = 0;
        for (int seed = 0; seed < seeds; ++seed) {
            const Batch got = batch(set, nook::hash(static_cast<std::uint32_t>(seed), 5), 3, 1);
            x += double{got.x[0]};
            y += double{got.y[0]};
            z += double{got.z[0]};
            square += double{got.z[0]} * double{got.z[0]};
        }
        const double deviation = 4 / std::sqrt(double{seeds});
        CHECK(std::fabs(x / seeds) < 0.5 * deviation);
        CHECK(std::fabs(y / seeds) < 0.5 * deviation);
        CHECK(std::fabs(z / seeds - 2.0 / 3) < 0.236 * deviation);
        CHECK(std::fabs(square / seeds - 0.5) < 0.289 * deviation);
    }
}

TEST_CASE("what is seen or hidden converges as N^-3/4 with every set")
{
    // He & Owen 2014; independent directions reach -1/2. The slope of 200 randomisations is known to
    // about 0.03, and single N of a fixed lattice stray.
    for (const nook::DirectionSet set : all_sets) {
        CAPTURE(name_of(set));
        const Convergence step = convergence(set, misses_near_wall, near_wall),
                          low = convergence(set, misses_low_wall, low_wall);
        CHECK(step.slope < -0.67);
        CHECK(step.slope > -0.83);
        CHECK(low.slope < -0.67);
        CHECK(low.slope > -0.83);
        for (std::size_t i = 0; i < step.rms.size(); ++i) {
            const double expected = 0.4 * std::pow(64 << i, -0.75);
            CHECK(step.rms[i] < 1.7 * expected);
            CHECK(low.rms[i] < 1.7 * expected);
        }
    }
}

TEST_CASE("an exponential falloff converges as N^-3/2 with nets and as N^-1 with R2")
{
    for (const nook::DirectionSet set : all_sets) {
        CAPTURE(name_of(set));
        const Convergence above = convergence(set, through_ceiling, ceiling),
                          beside = convergence(set, through_wall, far_wall);
        if (set == nook::DirectionSet::r2) {
            for (const double slope : {above.slope, beside.slope}) {
                CHECK(slope < -0.8);
                CHECK(slope > -1.1);
            }
            continue;
        }
        CHECK(above.slope < -1.4);
        CHECK(beside.slope < -1.25);
        CHECK(above.slope > -1.65);
        // The ceiling depends on the height alone, a stratified sum of which has 0.116 N^-3/2.
        for (std::size_t i = 0; i < above.rms.size(); ++i)
            CHECK(above.rms[i] < 1.25 * 0.116 * std::pow(64 << i, -1.5));
    }
}

TEST_CASE("single precision does not show in the ceiling with 16384 directions")
{
    const int count = 16384, randomisations = 60;
    double sum = 0;
    for (int i = 0; i < randomisations; ++i) {
        const Batch got = batch(nook::DirectionSet::scrambled_sobol,
                                nook::hash(4, static_cast<std::uint32_t>(i)), 0, count);
        const double error = estimate(got, count, through_ceiling) - ceiling;
        sum += error * error;
    }
    CHECK(std::sqrt(sum / randomisations) < 1.3 * 5.5e-8);
}

TEST_CASE("estimates of neighbouring pixels are not correlated")
{
    const int side = 64, count = 16;
    for (const nook::DirectionSet set : all_sets) {
        CAPTURE(name_of(set));
        std::vector<double> image;
        double mean = 0, square = 0;
        for (std::uint32_t y = 0; y < side; ++y) {
            for (std::uint32_t x = 0; x < side; ++x) {
                const Batch got = batch(set, nook::hash(0, nook::hash(x, y)), 0, count);
                image.push_back(estimate(got, count, misses_near_wall));
                mean += image.back();
                square += image.back() * image.back();
            }
        }
        mean /= side * side;
        const double variance = square / (side * side) - mean * mean;
        CHECK(variance > 1e-4);
        for (const int step : {1, side, side + 1, side - 1, 2}) {
            double product = 0;
            int pairs = 0;
            for (std::size_t i = 0; i + static_cast<std::size_t>(step) < image.size(); ++i) {
                product += (image[i] - mean) * (image[i + static_cast<std::size_t>(step)] - mean);
                ++pairs;
            }
            // Four deviations of independent estimates.
            CHECK(std::fabs(product / pairs / variance) < 4 / std::sqrt(double{side * side}));
        }
    }
}
