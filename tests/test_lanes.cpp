#include <doctest/doctest.h>

#include <cstdint>
#include <limits>

#include <nook/lanes.hpp>

using namespace nook::detail;

TEST_SUITE_BEGIN("lanes");

namespace {

template <class T, int N>
Lanes<T, N> numbered(T first)
{
    T values[N];
    for (int i = 0; i < N; ++i) values[i] = first + static_cast<T>(i);
    return load<N>(values);
}
template <class L>
auto lane(const L& lanes, int i)
{
    typename LanesTraits<L>::Value values[LanesTraits<L>::count];
    store(values, lanes);
    return values[i];
}

template <class T, int N>
void check_everything()
{
    CAPTURE(N);
    const auto a = numbered<T, N>(1), b = broadcast<N>(T{3});
    static_assert(LanesTraits<Lanes<T, N>>::count == N);
    for (int i = 0; i < N; ++i) {
        const T x = static_cast<T>(1 + i);
        CHECK(lane(b, i) == 3);
        CHECK(lane(larger(a, b), i) == (x > 3 ? x : 3));
        CHECK(lane(smaller(a, b), i) == (x < 3 ? x : 3));
        CHECK(lane(convert<double>(a), i) == double(x));
        CHECK(lane(convert<float>(a), i) == float(x));
        CHECK(lane(convert<std::int32_t>(a), i) == int(x));
        CHECK(lane(fenced(a), i) == x);
        CHECK(lane(a > b ? a : b, i) == (x > 3 ? x : 3));
    }
    CHECK(any(a == broadcast<N>(static_cast<T>(N))));
    CHECK_FALSE(any(a == broadcast<N>(T{0})));
    CHECK(lane(broadcast<N>(-T{0}), 0) == 0);

    Lanes<T, N> rows[N];
    for (int i = 0; i < N; ++i) rows[i] = numbered<T, N>(static_cast<T>(N * i));
    transpose(rows);
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) CHECK(lane(rows[i], j) == static_cast<T>(N * j + i));
}

}  // namespace

TEST_CASE("lanes load, store, compare, convert, move and transpose alike, one or several")
{
    check_everything<double, 1>();
    check_everything<float, 1>();
    check_everything<double, native_lanes>();
    check_everything<float, native_lanes>();
}

TEST_SUITE_END();
