#include <clocale>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>

#include <doctest/doctest.h>

#include <nook/outcome.hpp>

namespace {

std::string text_of(const nook::Error& error, std::size_t capacity = 200)
{
    char buffer[200];
    std::memset(buffer, 'x', sizeof buffer);
    const std::size_t length = nook::describe(error, buffer, capacity);
    CHECK(length < capacity);
    CHECK(std::strlen(buffer) == length);
    // Nothing behind the zero has been touched.
    for (std::size_t i = capacity; i < sizeof buffer; ++i) CHECK(buffer[i] == 'x');
    return {buffer, length};
}

constexpr nook::Error even_window{nook::ErrorCode::bad_value, "options.window", 4,
                                  "an odd number >= 1"};

}  // namespace

TEST_SUITE("outcome")
{
    TEST_CASE("an error names the argument, its value and what is allowed")
    {
        CHECK(text_of(even_window) == "options.window is 4; allowed: an odd number >= 1");
        CHECK(text_of({nook::ErrorCode::bad_value, "options.bias", 0.1, "a number >= 0"}) ==
              "options.bias is 0.1; allowed: a number >= 0");
        CHECK(text_of({nook::ErrorCode::bad_size, "visibility", -3, "a width >= 0"}) ==
              "visibility is -3; allowed: a width >= 0");
    }

    TEST_CASE("an error without a number tells what happened instead")
    {
        CHECK(text_of({nook::ErrorCode::null_data, "depth", 0, "data, or a size of 0 x 0"}) ==
              "depth is null; allowed: data, or a size of 0 x 0");
        CHECK(
            text_of({nook::ErrorCode::overlap, "visibility", 0, "memory apart from every input"}) ==
            "visibility shares memory with an input; allowed: memory apart from every input");
    }

    TEST_CASE("no error says so") { CHECK(text_of({}) == "no error"); }

    TEST_CASE("values that are not numbers and the longest numbers have a text")
    {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        const auto value_text = [](double value) {
            const std::string text = text_of({nook::ErrorCode::bad_value, "v", value, "a"});
            return text.substr(5, text.find(';') - 5);
        };
        CHECK(value_text(infinity) == "inf");
        CHECK(value_text(-infinity) == "-inf");
        CHECK(value_text(std::numeric_limits<double>::quiet_NaN()) == "nan");
        for (const double value : {-std::numeric_limits<double>::max(), -2.2250738585072014e-308,
                                   -4.9406564584124654e-324, 1 / 3.0, 1e15, 123456789.0})
            CHECK(std::strtod(value_text(value).c_str(), nullptr) == value);
    }

    TEST_CASE("whole numbers have no exponent below 1e15")
    {
        const auto value_text = [](double value) {
            const std::string text = text_of({nook::ErrorCode::bad_value, "v", value, "a"});
            return text.substr(5, text.find(';') - 5);
        };
        CHECK(value_text(0) == "0");
        CHECK(value_text(32769) == "32769");
        CHECK(value_text(100000) == "100000");
        CHECK(value_text(-100000) == "-100000");
        CHECK(value_text(2147483648.0) == "2147483648");
        CHECK(value_text(1e14) == "100000000000000");
        CHECK(value_text(999999999999999) == "999999999999999");
        // Longer ones and fractions stay short.
        CHECK(value_text(1e15) == "1e+15");
        CHECK(value_text(1e300) == "1e+300");
        CHECK(value_text(1e-7) == "1e-07");
        CHECK(value_text(100000.5) == "100000.5");
    }

    TEST_CASE("the text is cut to any capacity and always ends with a zero")
    {
        const std::string whole = text_of(even_window);
        for (std::size_t capacity = 1; capacity <= whole.size() + 3; ++capacity)
            CHECK(text_of(even_window, capacity) == whole.substr(0, capacity - 1));
    }

    TEST_CASE("no room gives no text and touches nothing")
    {
        char untouched = 'x';
        CHECK(nook::describe(even_window, &untouched, 0) == 0);
        CHECK(untouched == 'x');
        CHECK(nook::describe(even_window, nullptr, 10) == 0);
    }

    TEST_CASE("the text does not depend on the locale")
    {
        const std::string before = std::setlocale(LC_ALL, nullptr);
        // Where neither is installed the locale stays "C", and the check below is the same.
        if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr) std::setlocale(LC_ALL, "fr_FR.UTF-8");
        CHECK(text_of({nook::ErrorCode::bad_value, "v", 0.5, "a"}) == "v is 0.5; allowed: a");
        std::setlocale(LC_ALL, before.c_str());
    }

    TEST_CASE("an outcome is true on success and an error is true on failure")
    {
        CHECK(nook::Outcome{});
        CHECK_FALSE(nook::Error{});
        CHECK_FALSE(nook::Outcome{even_window, {}});
        CHECK(even_window);
        CHECK(std::is_trivially_copyable_v<nook::Error>);
        CHECK(std::is_trivially_copyable_v<nook::Outcome>);
        // `if (outcome == 1)` and arithmetic on it would be mistakes.
        CHECK_FALSE(std::is_convertible_v<nook::Outcome, bool>);
        CHECK_FALSE(std::is_convertible_v<nook::Error, bool>);
    }

    TEST_CASE("work adds up field by field")
    {
        nook::Work work{1, 2, 3, 4, 5, 6, 7, 8, 9};
        work += {10, 20, 30, 40, 50, 60, 70, 80, 90};
        CHECK(work.pixels == 11);
        CHECK(work.background == 22);
        CHECK(work.skipped == 33);
        CHECK(work.samples == 44);
        CHECK(work.skipped_samples == 55);
        CHECK(work.rays == 66);
        CHECK(work.skipped_rays == 77);
        CHECK(work.passes == 88);
        CHECK(work.skipped_passes == 99);
    }
}
