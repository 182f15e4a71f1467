#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include <nook/depth/hardware_depth.hpp>
#include <nook/depth/projection.hpp>
#include <nook/owned_image.hpp>

#include "projections.hpp"

using nook::DepthEncoding;
using nook::Projection;
using projections::infinity;
using projections::make;

namespace {

constexpr DepthEncoding encodings[] = {DepthEncoding::linear,   DepthEncoding::negative_z,
                                       DepthEncoding::standard, DepthEncoding::reversed,
                                       DepthEncoding::opengl,   DepthEncoding::logarithmic};

// Every projection that a storage can stand for.
template <class Storage>
std::vector<Projection> all_projections()
{
    std::vector<Projection> all;
    for (const DepthEncoding encoding : encodings)
        for (const bool orthographic : {false, true})
            for (const double near_plane : {0.01, 0.1, 2.0})
                for (const double far_plane : {10.0, 1000.0, 1e5, infinity}) {
                    const Projection projection =
                        make(encoding, orthographic, near_plane, far_plane);
                    if (nook::check_projection(projection, true)) continue;
                    // Fixed point holds numbers from 0 to 1 alone, and a half no more than 65504.
                    const bool affine =
                        encoding == DepthEncoding::linear || encoding == DepthEncoding::negative_z;
                    if (Storage::fixed_point && encoding == DepthEncoding::negative_z) continue;
                    if (Storage::fixed_point && affine && far_plane == infinity) continue;
                    all.push_back(projection);
                }
    return all;
}

template <class Storage>
auto decoder(const Projection& projection)
{
    return nook::HardwareDecode<Storage>{projection};
}

std::string describe(const Projection& projection)
{
    return "encoding " + std::to_string(int(projection.encoding)) +
           (projection.orthographic ? " orthographic " : " perspective ") +
           std::to_string(projection.near_plane) + " to " + std::to_string(projection.far_plane);
}

// The element after `stored` in the order of the numbers, away from or towards zero.
float next(float stored, int direction)
{
    return std::nextafter(stored, float(direction) * std::numeric_limits<float>::infinity());
}
double next(double stored, int direction)
{
    return std::nextafter(stored, double(direction) * infinity);
}
std::uint16_t next_half(std::uint16_t stored, int direction)
{
    const bool negative = (stored & 0x8000) != 0;
    if ((stored & 0x7fff) == 0) return static_cast<std::uint16_t>(direction > 0 ? 1 : 0x8001);
    return static_cast<std::uint16_t>(stored + (negative ? -direction : direction));
}
template <class Storage>
typename Storage::Stored neighbour(typename Storage::Stored stored, int direction)
{
    if constexpr (std::is_same_v<Storage, nook::HalfStorage>) return next_half(stored, direction);
    else if constexpr (Storage::fixed_point) {
        if (direction < 0 && stored == 0) return stored;
        if (direction > 0 && stored == Storage::mask) return stored;
        return static_cast<typename Storage::Stored>(static_cast<std::int64_t>(stored) + direction);
    } else return next(stored, direction);
}

// Distances all over the range of a projection, the planes included.
std::vector<double> distances(const Projection& projection, bool half)
{
    const bool planar = nook::detail::is_planar(projection.encoding);
    const double first = planar ? projection.near_plane : 1e-3;
    double last = std::min(projection.far_plane, 1e6);
    if (half && !planar) last = std::min(last, 6e4);
    std::vector<double> all{first, first * 1.0001, 0.5 * (first + last), last};
    for (int i = 1; i < 400; ++i) all.push_back(first * std::pow(last / first, i / 400.0));
    for (int i = 1; i < 50; ++i) all.push_back(first + (last - first) * i / 50.0);
    return all;
}

}  // namespace

TEST_SUITE("depth/hardware_depth")
{
    TEST_CASE("a half is decoded as IEEE 754 says, all 65536 of them")
    {
        int wrong = 0;
        for (int bits = 0; bits < 65536; ++bits) {
            const auto stored = static_cast<std::uint16_t>(bits);
            const int exponent = bits >> 10 & 31, fraction = bits & 1023;
            const double sign = bits & 0x8000 ? -1 : 1;
            const double expected = exponent == 0
                                        ? sign * std::ldexp(fraction, -24)
                                        : sign * std::ldexp(1024 + fraction, exponent - 25);
            double value = 0;
            const bool finite = nook::detail::stored_value(nook::HalfStorage{}, stored, value);
            if (exponent == 31) wrong += finite;
            else
                wrong += !finite || std::bit_cast<std::uint64_t>(value) !=
                                        std::bit_cast<std::uint64_t>(expected);
        }
        CHECK(wrong == 0);
    }

    TEST_CASE(
        "each half is stored as itself, and what lies between goes to the nearest, ties to even")
    {
        const auto store = [](double value) {
            return nook::detail::store_value(nook::HalfStorage{}, value);
        };
        int wrong = 0;
        for (int bits = 0; bits < 0x7c00; ++bits) {
            const auto stored = static_cast<std::uint16_t>(bits);
            const auto above = static_cast<std::uint16_t>(bits + 1);
            double value = 0, next_value = 65536;
            (void)nook::detail::stored_value(nook::HalfStorage{}, stored, value);
            (void)nook::detail::stored_value(nook::HalfStorage{}, above, next_value);
            const double middle = (value + next_value) / 2;
            wrong += store(value) != stored;
            wrong += store(-value) != (stored | 0x8000);
            wrong += store(middle) != (bits % 2 == 0 ? stored : above);
            wrong += store(std::nextafter(middle, 0.0)) != stored;
            wrong += store(std::nextafter(middle, infinity)) != above;
        }
        CHECK(wrong == 0);
        CHECK(store(1e300) == 0x7c00);
        CHECK(store(infinity) == 0x7c00);
        CHECK(store(-infinity) == 0xfc00);
    }

    TEST_CASE("every D16 element and the ends of D24 decode to themselves")
    {
        const auto check = [](auto storage, std::uint32_t element) {
            using Storage = decltype(storage);
            double value = -1;
            CHECK(nook::detail::stored_value(
                storage, static_cast<typename Storage::Stored>(element), value));
            CHECK(value >= 0);
            CHECK(value <= 1);
            CHECK(nook::detail::store_value(storage, value) == element);
            CHECK((value == 1) == (element == Storage::mask));
        };
        for (std::uint32_t element = 0; element < 65536; ++element)
            check(nook::D16Storage{}, element);
        for (std::uint32_t element = 0; element < 1 << 24; element += 4099)
            check(nook::D24Storage{}, element);
        for (const std::uint32_t element : {0u, 1u, 0x7fffffu, 0x800000u, 0xfffffeu, 0xffffffu})
            check(nook::D24Storage{}, element);
    }

    TEST_CASE("all ones are exactly 1 for any number of bits")
    {
        const auto check = [](auto storage) {
            using Storage = decltype(storage);
            double value = 0;
            CHECK(nook::detail::stored_value(storage, Storage::mask, value));
            CHECK(value == 1);
            CHECK(nook::detail::store_value(storage, 1.0) == Storage::mask);
        };
        check(nook::FixedStorage<std::uint8_t, 8>{});
        check(nook::FixedStorage<std::uint16_t, 12>{});
        check(nook::FixedStorage<std::uint32_t, 32>{});
    }

    TEST_CASE("the stencil beside 24 bits of depth is ignored")
    {
        const Projection projection = make(DepthEncoding::standard, false, 0.1, 100);
        const auto decode = decoder<nook::D24Storage>(projection);
        for (const std::uint32_t depth : {0u, 12345u, 0xfffffeu, 0xffffffu})
            CHECK(decode(depth | 0xab000000u) == decode(depth));
    }

    TEST_CASE_TEMPLATE("a distance nearer than the near plane becomes the near end of fixed point",
                       Storage, nook::D16Storage, nook::D24Storage)
    {
        for (const DepthEncoding encoding :
             {DepthEncoding::standard, DepthEncoding::reversed, DepthEncoding::opengl})
            for (const bool orthographic : {false, true})
                for (const double near_plane : {0.1, 2.0}) {
                    const Projection projection = make(encoding, orthographic, near_plane, 100);
                    CAPTURE(describe(projection));
                    const auto near_end = encoding == DepthEncoding::reversed ? Storage::mask : 0;
                    for (const double distance :
                         {near_plane, 0.999 * near_plane, 0.05, 1e-9, 1e-300,
                          std::numeric_limits<double>::denorm_min()})
                        CHECK(nook::encode_depth<Storage>(distance, projection) == near_end);
                    // Background, at the far end.
                    CHECK(nook::encode_depth<Storage>(1e9, projection) == Storage::mask - near_end);
                    CHECK(nook::encode_depth<Storage>(-1, projection) == Storage::mask - near_end);
                }
    }

    TEST_CASE_TEMPLATE("encoding and decoding a distance returns it within the stated step",
                       Storage, nook::FloatStorage<float>, nook::FloatStorage<double>,
                       nook::HalfStorage, nook::D16Storage, nook::D24Storage)
    {
        constexpr bool half = std::is_same_v<Storage, nook::HalfStorage>;
        int tested = 0;
        for (const Projection& projection : all_projections<Storage>()) {
            const auto decode = decoder<Storage>(projection);
            const nook::DepthStep step = nook::depth_step<Storage>(projection);
            const auto far_end = nook::encode_depth<Storage>(0, projection);
            const bool falling = projection.encoding == DepthEncoding::reversed;
            const bool from_zero = projection.encoding == DepthEncoding::linear ||
                                   projection.encoding == DepthEncoding::negative_z;
            const double first = from_zero ? double{decode(neighbour<Storage>(0, 1))} : 0;
            const double last = from_zero
                                    ? infinity
                                    : double{decode(neighbour<Storage>(far_end, falling ? 1 : -1))};
            for (const double distance : distances(projection, half)) {
                const double back =
                    double{decode(nook::encode_depth<Storage>(distance, projection))};
                // Background: nearer than the first element or farther than the last.
                if (back == 0) {
                    CHECK_MESSAGE(
                        (distance < first || distance > last || distance >= projection.far_plane),
                        describe(projection), ", distance ", distance);
                    continue;
                }
                ++tested;
                // In double the encoder rounds as much as the buffer does.
                const double roundings =
                    std::is_same_v<Storage, nook::FloatStorage<double>> ? 4 : 1;
                const double allowed = roundings * std::max(step(distance), step(back));
                CHECK_MESSAGE(std::fabs(back - distance) <= allowed, describe(projection),
                              ", distance ", distance, " came back as ", back, ", step ", allowed);
            }
        }
        CHECK(tested > 5000);
    }

    TEST_CASE_TEMPLATE("the step bounds the spacing of neighbouring elements, by less than 5 times",
                       Storage, nook::FloatStorage<float>, nook::FloatStorage<double>,
                       nook::HalfStorage, nook::D16Storage, nook::D24Storage)
    {
        constexpr bool half = std::is_same_v<Storage, nook::HalfStorage>;
        for (const Projection& projection : all_projections<Storage>()) {
            CAPTURE(describe(projection));
            const auto decode = decoder<Storage>(projection);
            const nook::DepthStep step = nook::depth_step<Storage>(projection);
            // How much of its bound the spacing takes, at the place where it takes most.
            double most = 0;
            for (const double distance : distances(projection, half)) {
                const auto stored = nook::encode_depth<Storage>(distance, projection);
                const double here = double{decode(stored)};
                if (here == 0) continue;
                for (const int direction : {-1, 1}) {
                    const double there = double{decode(neighbour<Storage>(stored, direction))};
                    // Beyond a plane no element means anything.
                    if (there <= 0 || there > 1.001 * projection.far_plane || there == infinity)
                        continue;
                    if (nook::detail::is_planar(projection.encoding) &&
                        there < projection.near_plane * (1 - 1e-7))
                        continue;
                    const double bound = std::max(step(here), step(there));
                    CHECK_MESSAGE(std::fabs(there - here) <= bound, "distance ", here,
                                  ", neighbour ", there, ", bound ", bound);
                    most = std::max(most, std::fabs(there - here) / bound);
                }
            }
            CHECK(most > 0.2);
        }
    }

    TEST_CASE_TEMPLATE("decoding keeps the order of distances", Storage, nook::FloatStorage<float>,
                       nook::HalfStorage, nook::D16Storage, nook::D24Storage)
    {
        std::mt19937 random{1};
        for (const Projection& projection : all_projections<Storage>()) {
            const auto decode = decoder<Storage>(projection);
            const double first =
                nook::detail::is_planar(projection.encoding) ? projection.near_plane : 1e-3;
            const double last = std::min(projection.far_plane, 1e4);
            for (int i = 0; i < 300; ++i) {
                std::uniform_real_distribution<double> log(std::log(first), std::log(last));
                double a = std::exp(log(random)), b = std::exp(log(random));
                if (a > b) std::swap(a, b);
                const double decoded_a = double{decode(nook::encode_depth<Storage>(a, projection))};
                const double decoded_b = double{decode(nook::encode_depth<Storage>(b, projection))};
                if (decoded_a == 0 || decoded_b == 0) continue;
                CHECK_MESSAGE(decoded_a <= decoded_b, describe(projection), ": ", a, ", ", b);
            }
        }
    }

    TEST_CASE_TEMPLATE("the planes decode to their distances, and the far end to background",
                       Storage, nook::FloatStorage<float>, nook::FloatStorage<double>,
                       nook::HalfStorage, nook::D16Storage, nook::D24Storage)
    {
        using Stored = typename Storage::Stored;
        using Distance = typename nook::HardwareDecode<Storage>::Distance;
        for (const Projection& projection : all_projections<Storage>()) {
            if (!nook::detail::is_planar(projection.encoding)) continue;
            CAPTURE(describe(projection));
            const bool reversed = projection.encoding == DepthEncoding::reversed;
            const bool signed_depth =
                projection.encoding == DepthEncoding::opengl && !Storage::fixed_point;
            const auto store = [](double value) {
                return nook::detail::store_value(Storage{}, value);
            };
            const Stored at_near = store(reversed ? 1 : signed_depth ? -1 : 0);
            const Stored at_far = store(reversed ? 0 : 1);
            const auto decode = decoder<Storage>(projection);
            // One rounding of the result.
            CHECK(std::fabs(double{decode(at_near)} - projection.near_plane) <=
                  projection.near_plane * double{std::numeric_limits<Distance>::epsilon()});
            CHECK(decode(at_far) == Distance(0));
            // Just inside the far plane.
            const double inside = double{decode(neighbour<Storage>(at_far, reversed ? 1 : -1))};
            CHECK(inside > 0);
            if (projection.far_plane < infinity) {
                const double step = nook::depth_step<Storage>(projection)(projection.far_plane);
                CHECK(inside <= projection.far_plane * (1 + 1e-6));
                CHECK(inside >= projection.far_plane - step);
            }
            // No element before the far end is lost to the far limit by rounding.
            Stored element = at_far;
            int lost = 0;
            for (int i = 0; i < 50; ++i) {
                element = neighbour<Storage>(element, reversed ? 1 : -1);
                const auto source = nook::hardware_depth<Storage>(
                    nook::ImageView<const Stored>{&element, 1, 1}, projection);
                lost += nook::surface_distance(source, 0, 0) == Distance(0);
            }
            // An infinite far plane has distances beyond the range of float before it.
            if (projection.far_plane < infinity) CHECK(lost == 0);
            // Background is stored at the far end, whatever it was.
            for (const double nothing :
                 {0.0, -1.0, infinity, -infinity, std::numeric_limits<double>::quiet_NaN()})
                CHECK(nook::encode_depth<Storage>(nothing, projection) == at_far);
        }
    }

    TEST_CASE_TEMPLATE(
        "elements that are not numbers, and distances beyond the far plane, are background", Float,
        float, double)
    {
        using Storage = nook::FloatStorage<Float>;
        for (const Projection& projection : all_projections<Storage>()) {
            CAPTURE(describe(projection));
            std::vector<Float> stored{
                std::numeric_limits<Float>::quiet_NaN(), -std::numeric_limits<Float>::quiet_NaN(),
                std::numeric_limits<Float>::infinity(), -std::numeric_limits<Float>::infinity()};
            if (projection.far_plane < infinity) {
                if (projection.encoding == DepthEncoding::linear)
                    stored.push_back(Float(1.001 * projection.far_plane));
                if (projection.encoding == DepthEncoding::negative_z)
                    stored.push_back(Float(-1.001 * projection.far_plane));
            }
            if (projection.encoding == DepthEncoding::negative_z) stored.push_back(Float(1));
            else if (projection.encoding == DepthEncoding::linear) stored.push_back(Float(-1));
            else if (projection.encoding == DepthEncoding::reversed) stored.push_back(Float(-0.01));
            else stored.push_back(Float(1.01));
            for (const Float element : stored) {
                CAPTURE(element);
                const auto source =
                    nook::hardware_depth(nook::ImageView<const Float>{&element, 1, 1}, projection);
                CHECK(nook::surface_distance(source, 0, 0) == Float(0));
            }
        }
    }

    TEST_CASE_TEMPLATE("a point on the far plane of a linear buffer is a surface", Float, float,
                       double)
    {
        for (const double far_plane : {0.1, 1 / 3.0, 10.0, 1e5})
            for (const DepthEncoding encoding :
                 {DepthEncoding::linear, DepthEncoding::negative_z}) {
                const Projection projection = make(encoding, false, 0, far_plane);
                const Float element =
                    nook::encode_depth<nook::FloatStorage<Float>>(far_plane, projection);
                const auto source =
                    nook::hardware_depth(nook::ImageView<const Float>{&element, 1, 1}, projection);
                CHECK(nook::surface_distance(source, 0, 0) == static_cast<Float>(far_plane));
            }
    }

    TEST_CASE("a distance that rounds to just beyond the far plane is a surface")
    {
        int beyond = 0;
        for (int far_plane = 2; far_plane < 200; ++far_plane) {
            // The inverse of the inverse of the far plane, which is not always the far plane.
            const Projection projection = make(DepthEncoding::reversed, false, 1, far_plane);
            const double element = 1e-30;
            const auto source =
                nook::hardware_depth(nook::ImageView<const double>{&element, 1, 1}, projection);
            beyond += source.decode(element) > far_plane;
            CHECK(nook::surface_distance(source, 0, 0) == source.decode(element));
        }
        CHECK(beyond > 0);
    }

    TEST_CASE("the type of the element chooses the storage, and a name overrides it")
    {
        const Projection projection = make(DepthEncoding::standard, false, 0.1, 100);
        const std::uint16_t element = 0x3800;  // 0.5 as a half, 0.21876 of 65535
        const nook::ImageView<const std::uint16_t> view{&element, 1, 1};
        const float fixed = nook::surface_distance(nook::hardware_depth(view, projection), 0, 0);
        const float half =
            nook::surface_distance(nook::hardware_depth<nook::HalfStorage>(view, projection), 0, 0);
        CHECK(fixed == static_cast<float>(1 / (10 + 0x3800 / 65535.0 * (0.01 - 10))));
        CHECK(half == static_cast<float>(1 / (10 + 0.5 * (0.01 - 10))));
    }

    TEST_CASE("decoding agrees with the textbook formula in quadruple precision")
    {
        // z = n f / (f − d (f − n)) loses digits beside the far plane; the decoder must not.
        using Wide = long double;
        for (const double far_plane : {1e2, 1e5, 1e7}) {
            const Projection projection = make(DepthEncoding::standard, false, 0.01, far_plane);
            const auto decode = decoder<nook::FloatStorage<float>>(projection);
            for (float d = 0.5f; d < 1;
                 d = std::max(std::nextafter(d, 2.0f), 1 - (1 - d) * 0.97f)) {
                const Wide n = 0.01, f = far_plane;
                const Wide expected = n * f / (f - Wide(d) * (f - n));
                CHECK(std::fabs(Wide(decode(d)) - expected) <= expected * 0x1.01p-24L);
            }
        }
    }
}
