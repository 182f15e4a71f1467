#include <cstdint>
#include <limits>
#include <vector>

#include <doctest/doctest.h>

#include <nook/work_map.hpp>

TEST_SUITE("work_map")
{
    TEST_CASE("an empty map makes every pixel active")
    {
        const nook::WorkMap map;
        CHECK(map.everything());
        CHECK(map.is_active(0, 0));
        CHECK(map.is_active(100000, 100000));
        CHECK(map.exact);
    }

    TEST_CASE("a map without groups is empty, one without data is not")
    {
        const std::uint8_t group = 0;
        CHECK(nook::WorkMap{.active = {&group, 0, 5}}.everything());
        CHECK(nook::WorkMap{.active = {&group, 5, 0}}.everything());
        CHECK_FALSE(nook::WorkMap{.active = {&group, 1, 1}}.everything());
        // Which kernels refuse, see checks.hpp.
        CHECK_FALSE(nook::WorkMap{.active = {nullptr, 1, 1}}.everything());
    }

    TEST_CASE("a row has one group per 16 pixels, the last one cut")
    {
        CHECK(nook::WorkMap::groups(0) == 0);
        CHECK(nook::WorkMap::groups(1) == 1);
        CHECK(nook::WorkMap::groups(16) == 1);
        CHECK(nook::WorkMap::groups(17) == 2);
        // Where width + 15 would overflow.
        CHECK(nook::WorkMap::groups(std::numeric_limits<int>::max()) == 0x8000000);
    }

    TEST_CASE("a pixel is active when its group is")
    {
        const std::vector<std::uint8_t> active{0, 1, 255, 0};
        const nook::WorkMap map{{active.data(), 2, 2}, false};
        CHECK_FALSE(map.everything());
        for (int x = 0; x < 32; ++x) {
            CAPTURE(x);
            CHECK(map.is_active(x, 0) == (x >= 16));
            CHECK(map.is_active(x, 1) == (x < 16));
        }
    }
}
