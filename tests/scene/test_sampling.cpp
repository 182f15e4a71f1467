#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <vector>

#include <nook/scene/sampling.hpp>

TEST_CASE("the mirror image of bits is its own inverse")
{
    CHECK(nook::reverse_bits(1) == 0x80000000u);
    CHECK(nook::reverse_bits(0x0000f0a1u) == 0x850f0000u);
    for (std::uint32_t x = 0; x < 1000; ++x)
        CHECK(nook::reverse_bits(nook::reverse_bits(x * 4294967u)) == x * 4294967u);
}

TEST_CASE("the second dimension of Sobol is Pascal's triangle modulo 2, and linear over bits")
{
    // Bit j takes index bit k when the binomial of k over j is odd: when k contains the digits of j.
    for (unsigned k = 0; k < 32; ++k) {
        std::uint32_t column = 0;
        for (unsigned j = 0; j < 32; ++j) column |= ((k & j) == j ? 1u : 0u) << j;
        CHECK(nook::detail::sobol_second(std::uint32_t{1} << k) == column);
    }
    for (std::uint32_t x = 0; x < 1000; ++x) {
        const std::uint32_t a = nook::hash(x), b = nook::hash(a);
        CHECK(nook::detail::sobol_second(a ^ b) ==
              (nook::detail::sobol_second(a) ^ nook::detail::sobol_second(b)));
    }
}

TEST_CASE("a permuted bit depends on the bits below it alone")
{
    for (std::uint32_t x = 0; x < 1000; ++x) {
        const std::uint32_t a = nook::hash(x), seed = nook::hash(a);
        for (unsigned bit = 0; bit < 32; ++bit) {
            const std::uint32_t below = (std::uint32_t{1} << bit) - 1;
            const std::uint32_t changed = a ^ (std::uint32_t{1} << bit);
            const std::uint32_t difference =
                nook::detail::owen_permuted(a, seed) ^ nook::detail::owen_permuted(changed, seed);
            CHECK((difference & below) == 0);
            CHECK((difference >> bit & 1) == 1);
        }
    }
}

TEST_CASE("a point is the middle of the interval that its bits name")
{
    const nook::ScrambledSobol points{5};
    for (std::uint32_t i = 0; i < 1000; ++i) {
        const nook::SampleBits bits = points.bits(i);
        CHECK(points(i).u * 0x1p32 - bits.u == 0.5);
        CHECK(points(i).v * 0x1p32 - bits.v == 0.5);
    }
}

TEST_CASE("every block of 2^k points is a (0, 2)-net: one point in each elementary interval")
{
    for (const std::uint32_t seed : {0u, 1u, 77u, 0xffffffffu}) {
        const nook::ScrambledSobol points{seed};
        for (int bits = 0; bits <= 10; ++bits) {
            const std::uint32_t count = 1u << bits;
            for (const std::uint32_t block : {0u, 3u}) {
                for (int columns = 0; columns <= bits; ++columns) {
                    const double wide = std::ldexp(1.0, columns),
                                 high = std::ldexp(1.0, bits - columns);
                    std::vector<int> cells(count, 0);
                    for (std::uint32_t i = 0; i < count; ++i) {
                        const nook::SamplePoint p = points(block * count + i);
                        const auto x = static_cast<std::size_t>(p.u * wide);
                        const auto y = static_cast<std::size_t>(p.v * high);
                        ++cells[x * static_cast<std::size_t>(high) + y];
                    }
                    int wrong = 0;
                    for (const int cell : cells) wrong += cell != 1;
                    CHECK(wrong == 0);
                }
            }
        }
    }
}

TEST_CASE("points lie strictly inside the square and differ between seeds")
{
    std::set<double> first;
    for (std::uint32_t seed = 0; seed < 1000; ++seed) {
        const nook::SamplePoint p = nook::ScrambledSobol{seed}(0);
        CHECK(p.u > 0);
        CHECK(p.u < 1);
        CHECK(p.v > 0);
        CHECK(p.v < 1);
        first.insert(p.u);
        first.insert(p.v);
    }
    CHECK(first.size() > 1990);
}

TEST_CASE("scrambled points are uniform over the seeds")
{
    // Each of 16 x 16 cells gets its share of the third point of 25600 sets: chi-square with 255
    // degrees of freedom has mean 255 and deviation 22.6.
    std::vector<int> cells(256, 0);
    for (std::uint32_t seed = 0; seed < 25600; ++seed) {
        const nook::SamplePoint p = nook::ScrambledSobol{nook::hash(seed, 5)}(3);
        ++cells[static_cast<std::size_t>(p.u * 16) * 16 + static_cast<std::size_t>(p.v * 16)];
    }
    double chi_square = 0;
    for (const int n : cells) chi_square += (n - 100.0) * (n - 100.0) / 100.0;
    CHECK(chi_square < 255 + 5 * 22.6);
}

TEST_CASE("directions are unit, above the surface, and cosine-weighted")
{
    using nook::detail::Vector3;
    for (const Vector3& raw :
         {Vector3{0, 0, 1}, Vector3{0, 0, -1}, Vector3{1, 0, 0}, Vector3{0, -1, 0},
          Vector3{1, 2, -3}, Vector3{1e-9, 0, -1}, Vector3{-0.3, 0.4, 1e-12}}) {
        const Vector3 normal = normalised(raw);
        const nook::detail::HemisphereBasis basis{normal};
        const nook::ScrambledSobol points{9};
        const int count = 4096;
        Vector3 sum{0, 0, 0};
        double squares = 0, lowest = 1;
        for (std::uint32_t i = 0; i < count; ++i) {
            const Vector3 d = basis.cosine_direction(points(i));
            CHECK(std::fabs(dot(d, d) - 1) < 1e-14);
            const double cosine = dot(d, normal);
            lowest = std::fmin(lowest, cosine);
            sum = sum + d;
            squares += cosine * cosine;
        }
        CHECK(lowest > 0x1p-17);
        // E[d] = (2/3) n and E[cos²] = 1/2.
        const Vector3 miss = sum * (1.0 / count) - normal * (2.0 / 3);
        CHECK(std::sqrt(dot(miss, miss)) < 2e-5);
        CHECK(std::fabs(squares / count - 0.5) < 1e-5);
    }
    // The lowest direction that a point of the square can give.
    const nook::detail::HemisphereBasis basis{{0, 0, 1}};
    CHECK(basis.cosine_direction({0.5, 1 - 0x1p-33}).z > 0x1p-17);
}
