#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include <doctest/doctest.h>

#include <nook/depth/source.hpp>
#include <nook/owned_image.hpp>

namespace {

template <class T>
constexpr T largest = std::numeric_limits<T>::max();
template <class T>
constexpr T infinity = std::numeric_limits<T>::infinity();
template <class T>
constexpr T not_a_number = std::numeric_limits<T>::quiet_NaN();

}  // namespace

TEST_SUITE("depth/source")
{
    TEST_CASE_TEMPLATE("a surface is positive, finite and within the limit", T, float, double)
    {
        const T limit = std::is_same_v<T, float> ? largest<T> : T(1e140);
        for (const T value : {T(1), std::numeric_limits<T>::denorm_min(),
                              std::numeric_limits<T>::min(), T(1e30), limit})
            CHECK(nook::is_surface(value, limit));
        for (const T value :
             {T(0), -T(0), -T(1), -std::numeric_limits<T>::denorm_min(), -largest<T>, infinity<T>,
              -infinity<T>, not_a_number<T>, -not_a_number<T>})
            CHECK_FALSE(nook::is_surface(value, limit));
        // Whatever the limit says.
        for (const T value : {infinity<T>, -infinity<T>, not_a_number<T>})
            CHECK_FALSE(nook::is_surface(value, infinity<T>));
        CHECK(nook::is_surface(T(10), T(10)));
        CHECK_FALSE(nook::is_surface(std::nextafter(T(10), T(11)), T(10)));
    }

    TEST_CASE("distances whose squares leave the range of double are background")
    {
        CHECK(nook::is_surface(0x1p479, largest<double>));
        CHECK_FALSE(nook::is_surface(0x1.1p480, largest<double>));
        CHECK_FALSE(nook::is_surface(largest<double>, largest<double>));
        CHECK(nook::is_surface(largest<float>, largest<float>));
    }

    TEST_CASE("a view of distances is a source as it stands")
    {
        nook::Image<float> image(2, 1);
        image(0, 0) = 3;
        image(1, 0) = -3;
        const auto source = nook::depth_source(image.view());
        CHECK(std::is_same_v<decltype(source)::Distance, float>);
        CHECK(nook::surface_distance(source, 0, 0) == 3);
        CHECK(nook::surface_distance(source, 1, 0) == 0);
        CHECK(source.step(1) == 0x1p-23);
        CHECK(source.step(1000) == 1000 * 0x1p-23);
        const std::vector<double> doubles{4};
        const auto wide = nook::depth_source(nook::ImageView<const double>{doubles.data(), 1, 1});
        CHECK(nook::surface_distance(wide, 0, 0) == 4);
        CHECK(wide.step(1) == 0x1p-52);
    }

    TEST_CASE("a decoder of one's own is inlined into the load")
    {
        const float view_z[] = {-2, 2, -not_a_number<float>, -infinity<float>};
        const nook::DepthSource source{nook::ImageView<const float>{view_z, 4, 1},
                                       [](float z) { return -z; }};
        CHECK(nook::surface_distance(source, 0, 0) == 2);
        for (const int x : {1, 2, 3}) CHECK(nook::surface_distance(source, x, 0) == 0);

        const std::uint16_t millimetres[] = {1500, 0, 65535, 4001};
        const nook::DepthSource sensor{nook::ImageView<const std::uint16_t>{millimetres, 4, 1},
                                       [](std::uint16_t mm) { return float(mm) * 1e-3f; },
                                       nook::DepthStep{.constant = 1e-3}, 4.0f};
        CHECK(nook::surface_distance(sensor, 0, 0) == 1500 * 1e-3f);
        CHECK(nook::surface_distance(sensor, 1, 0) == 0);
        CHECK(nook::surface_distance(sensor, 2, 0) == 0);
        CHECK(nook::surface_distance(sensor, 3, 0) == 0);
        CHECK(sensor.step(3) == 1e-3);
        CHECK(&nook::depth_source(sensor) == &sensor);
    }

    TEST_CASE("sources and views of distances are depth inputs, other things are not")
    {
        CHECK(nook::DepthInput<nook::ImageView<float>>);
        CHECK(nook::DepthInput<nook::ImageView<const double>>);
        CHECK(nook::DepthInput<nook::DepthSource<float, nook::IdentityDecode>>);
        CHECK_FALSE(nook::DepthInput<nook::ImageView<std::uint16_t>>);
        CHECK_FALSE(nook::DepthInput<float*>);
        CHECK(std::is_same_v<nook::distance_t<nook::ImageView<const double>>, double>);
        CHECK(std::is_same_v<nook::distance_t<nook::ImageView<float>>, float>);
    }

    TEST_CASE("a step is a polynomial of the distance")
    {
        const nook::DepthStep step{1, 2, 3};
        CHECK(step(0) == 1);
        CHECK(step(2) == 1 + 2 * 2 + 3 * 4);
        CHECK(nook::DepthStep{}(5) == 0);
    }
}
