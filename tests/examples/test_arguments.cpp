#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "../../examples/support/arguments.hpp"
#include "../../examples/support/failure.hpp"

namespace {

/// What a call says when it refuses; empty when it does not.
template <class Call>
std::string refusal(const Call& call)
{
    try {
        (void)call();
    } catch (const support::Failure& failure) {
        return failure.what();
    }
    return {};
}

}  // namespace

TEST_CASE("the size of a picture is two numbers with an x between them")
{
    const support::PictureSize size = support::read_picture_size("--size", "960x1");
    CHECK(size.width == 960);
    CHECK(size.height == 1);
    for (const char* text : {"", "x", "960", "960x", "x540", "0x540", "960x0", "-1x5", "8193x1",
                             "1x8193", "960x540x2", "9e2x5", " 9x5", "99999999999x5"}) {
        CAPTURE(text);
        CHECK(refusal([&] { return support::read_picture_size("--size", text).width; }) ==
              "--size: '" + std::string{text} + "' is not WIDTHxHEIGHT, each from 1 to 8192");
    }
    CHECK(refusal([] {
              return support::read_picture_size("--size", "\n").width;
          }).starts_with("--size: '?'"));
}

TEST_CASE("a positive number is finite and above zero")
{
    CHECK(support::read_positive("--radius", "0.25") == 0.25);
    CHECK(support::read_positive("--radius", "1e-300") == 1e-300);
    for (const char* text : {"", "0", "-1", "nan", "inf", "1e999", "five", "1x", " 1"}) {
        CAPTURE(text);
        CHECK(refusal([&] { return support::read_positive("--radius", text); }) ==
              "--radius: '" + std::string{text} + "' is not a finite number above 0");
    }
}

TEST_CASE("a file that could not be written is refused beforehand")
{
    const auto refused = [](const std::filesystem::path& path) {
        return refusal([&] {
            support::check_output_file("--out", path);
            return 0;
        });
    };
    const std::filesystem::path folder = std::filesystem::temp_directory_path();
    CHECK(refused(folder / "picture.png").empty());
    CHECK(refused("picture.png").empty());
    CHECK(refused("") == "--out: an empty name");
    CHECK(refused(folder).ends_with("is a folder"));
    CHECK(refused(folder / "no such folder" / "picture.png").ends_with("no folder that exists"));
}
