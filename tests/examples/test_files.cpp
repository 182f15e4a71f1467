#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <string>

#include <nook/owned_image.hpp>

#include "../../examples/support/colour_map.hpp"
#include "../../examples/support/failure.hpp"
#include "../../examples/support/files.hpp"
#include "../../examples/support/picture.hpp"

namespace {

/// A folder of its own that goes with the test.
struct Folder {
    std::filesystem::path path = std::filesystem::temp_directory_path() /
                                 ("nook-test-" + std::to_string(std::random_device{}()));
    Folder() { std::filesystem::create_directory(path); }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    [[nodiscard]] std::ptrdiff_t entries() const
    {
        return std::distance(std::filesystem::directory_iterator{path}, {});
    }
};

}  // namespace

TEST_CASE("a file is written whole, replaces the old one and leaves nothing beside it")
{
    const Folder folder;
    const auto path = folder.path / "file";
    support::write_file(path, "one");
    support::write_file(path, std::string_view{"two\0three", 9});
    CHECK(support::read_file(path) == std::string{"two\0three", 9});
    CHECK(folder.entries() == 1);
}

TEST_CASE("what is not a regular file of a sane size is not read")
{
    const Folder folder;
    const auto refusal = [](const std::filesystem::path& path, std::uintmax_t largest) {
        try {
            (void)support::read_file(path, largest);
            return std::string{};
        } catch (const support::Failure& failure) {
            return std::string{failure.what()};
        }
    };
    const auto path = folder.path / "file";
    support::write_file(path, "four");
    CHECK(refusal(path, 4).empty());
    CHECK(refusal(path, 3) == path.string() + ": is larger than 3 bytes");
    CHECK(refusal(folder.path, 4) == folder.path.string() + ": is a folder");
    std::filesystem::create_symlink(path, folder.path / "link");
    CHECK(support::read_file(folder.path / "link") == "four");
    if (std::filesystem::exists("/dev/null"))
        CHECK(refusal("/dev/null", 4) == "/dev/null: is not a regular file");
}

TEST_CASE("a file that cannot be written is a failure that names it and leaves nothing")
{
    const Folder folder;
    CHECK_THROWS_AS(support::write_file(folder.path / "missing" / "file", "x"), support::Failure);
    // A folder in the way of the final name.
    std::filesystem::create_directory(folder.path / "taken");
    CHECK_THROWS_AS(support::write_file(folder.path / "taken", "x"), support::Failure);
    CHECK(folder.entries() == 1);
}

TEST_CASE("a folder is made when it is missing, and refused where a file is in its way")
{
    const Folder folder;
    support::prepare_folder(folder.path / "a" / "b");
    CHECK(std::filesystem::is_empty(folder.path / "a" / "b"));
    support::write_file(folder.path / "file", "x");
    CHECK_THROWS_AS(support::prepare_folder(folder.path / "file"), support::Failure);
    CHECK_THROWS_AS(support::prepare_folder(folder.path / "file" / "below"), support::Failure);
}

TEST_CASE("a float map holds the bottom row first, bit for bit")
{
    const Folder folder;
    nook::Image<float> image{2, 2};
    image(0, 0) = 1, image(1, 0) = -2.5f;
    image(0, 1) = std::numeric_limits<float>::infinity(), image(1, 1) = 3e-41f;
    support::write_pfm(folder.path / "image.pfm", image.view());
    const std::string bytes = support::read_file(folder.path / "image.pfm");
    const std::string header = "Pf\n2 2\n-1.0\n";
    REQUIRE(bytes.size() == header.size() + 16);
    CHECK(bytes.substr(0, header.size()) == header);
    const float expected[] = {image(0, 1), image(1, 1), image(0, 0), image(1, 0)};
    for (std::size_t i = 0; i < 4; ++i) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 4; ++k)
            bits |= std::uint32_t{static_cast<unsigned char>(bytes[header.size() + 4 * i + k])}
                    << (8 * k);
        CHECK(bits == std::bit_cast<std::uint32_t>(expected[i]));
    }
}

TEST_CASE("a picture keeps to its edges, rounds, clamps and takes NaN as 0")
{
    support::Picture picture{3, 2, {0, 0, 0}};
    picture.set(-1, 0, {1, 1, 1});
    picture.set(3, 1, {1, 1, 1});
    picture.set(0, 2, {1, 1, 1});
    for (const auto byte : picture.bytes()) CHECK(byte == 0);
    picture.set(1, 1, {2, 0.5f, std::numeric_limits<float>::quiet_NaN()});
    CHECK(picture.bytes()[3 * 4] == 255);
    CHECK(picture.bytes()[3 * 4 + 1] == 128);
    CHECK(picture.bytes()[3 * 4 + 2] == 0);
}

TEST_CASE("a written picture is a PNG of its size")
{
    const Folder folder;
    write_png(folder.path / "picture.png", support::Picture{7, 5});
    const std::string bytes = support::read_file(folder.path / "picture.png");
    REQUIRE(bytes.size() > 24);
    CHECK(bytes.substr(0, 8) == "\x89PNG\r\n\x1a\n");
    CHECK(bytes.substr(16, 8) == std::string{"\0\0\0\7\0\0\0\5", 8});
}

TEST_CASE("the diverging map is white for no error, red above and blue below")
{
    CHECK(support::diverging(0) == support::Rgb{1, 1, 1});
    CHECK(support::diverging(0.5).r > support::diverging(0.5).b);
    CHECK(support::diverging(-0.5).b > support::diverging(-0.5).r);
    CHECK(support::diverging(7) == support::diverging(1));
    CHECK(support::diverging(-7) == support::diverging(-1));
}

TEST_CASE("lightness grows along the sequential map")
{
    const auto lightness = [](const support::Rgb& colour) {
        return 0.3f * colour.r + 0.59f * colour.g + 0.11f * colour.b;
    };
    for (int i = 0; i < 100; ++i)
        CHECK(lightness(support::sequential(i / 100.0)) <
              lightness(support::sequential((i + 1) / 100.0)));
}

TEST_CASE("text leaves ink inside its box and nowhere else")
{
    support::Picture picture{200, 40};
    draw_text(picture, 10, 10, "0.25 bias", 2);
    const int right = 10 + support::text_width("0.25 bias", 2);
    int inside = 0, outside = 0;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 200; ++x) {
            if (picture.get(x, y) == support::Rgb{1, 1, 1}) continue;
            const bool box = x >= 10 && x < right && y >= 10 && y < 10 + 12 * 2;
            ++(box ? inside : outside);
        }
    CHECK(inside > 100);
    CHECK(outside == 0);
    CHECK(right < 200);
}
