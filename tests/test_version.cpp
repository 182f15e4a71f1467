#include <string>

#include <doctest/doctest.h>

#include <nook/version.hpp>

TEST_CASE("the version is three numbers")
{
    const std::string version = nook::version;
    CHECK(version.find_first_not_of("0123456789.") == std::string::npos);
    CHECK(version.find('.') != version.rfind('.'));
}
