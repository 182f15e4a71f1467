#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "../../examples/support/failure.hpp"
#include "../../examples/support/files.hpp"
#include "../../examples/support/obj_file.hpp"

namespace {

const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// What parse_obj complains about; empty when it does not.
std::string complaint(const std::string& text)
{
    try {
        (void)support::parse_obj(text, "mesh.obj");
        return {};
    } catch (const support::Failure& failure) {
        return failure.what();
    }
}

bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a triangle is read as it stands")
{
    const auto mesh = support::parse_obj(triangle, "mesh.obj");
    CHECK(mesh.positions == std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2});
    CHECK(mesh.dropped == 0);
}

TEST_CASE("the forms that exporters write are understood")
{
    const auto reads = [](const std::string& text, std::size_t triangles) {
        CAPTURE(text);
        const auto mesh = support::parse_obj(text, "mesh.obj");
        CHECK(mesh.indices.size() == 3 * triangles);
        CHECK(mesh.dropped == 0);
    };
    const std::string quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    reads(quad + "f 1 2 3 4\n", 2);
    reads(quad + "f -4 -3 -2 -1\n", 2);
    reads(quad + "f 1 2 3 4", 2);  // no newline at the end
    reads(quad + "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4//1\nf 1/1 2/1 3/1\n", 3);
    reads("# comment\nmtllib a.mtl\no thing\ng group\ns off\nusemtl stone\n\n" + triangle, 1);
    reads("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", 1);  // vertices after the face
    reads("v 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\nv\t0  1   +0\r\nf 1 2 3\r\n", 1);
    reads("v 0 0 0\nv 1 0 \\\n0\nv 0 1 0\nf 1 2 \\\n3\n", 1);
    reads("v 1e-3 .5 -1.5E+2\nv 1. 0 0\nv 0 1 0\nf 1 2 3 # a face\n", 1);
    reads("\xef\xbb\xbf" + triangle, 1);
    reads("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 .5 0\nv 0 2 0\nf 1 2 3 4 5\n", 3);  // not convex
}

TEST_CASE("a file that is no mesh is refused with its name and the reason")
{
    CHECK(complaint("") == "mesh.obj: is empty");
    CHECK(complaint("\n# nothing\n") == "mesh.obj: holds no face");
    CHECK(complaint("v 0 0 0\nv 1 0 0\nv 0 1 0\n") == "mesh.obj: holds no face");
    CHECK(complaint("Dear reader,\n") == "mesh.obj: line 1: 'Dear' is not an OBJ statement");
    CHECK(contains(complaint(std::string{"\x7f"
                                         "ELF\0\1\2\n",
                                         8}),
                   "is not an OBJ statement"));
}

TEST_CASE("a statement that is cut short is refused with its line")
{
    CHECK(complaint("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2") ==
          "mesh.obj: line 4: a face with fewer than three vertices");
    CHECK(complaint(triangle + "f") == "mesh.obj: line 5: a face with fewer than three vertices");
    CHECK(complaint(triangle + "v 0 1") ==
          "mesh.obj: line 5: a vertex with fewer than three coordinates");
    CHECK(complaint(triangle + "f 1 2 3/") == "");
    CHECK(contains(complaint(triangle + "f 1 2 /3\n"), "'/3' is not a vertex of a face"));
    CHECK(contains(complaint(triangle + "v 0 1 -"), "'-' is not a number"));
}

TEST_CASE("words where numbers belong are refused, not read as 0")
{
    CHECK(contains(complaint("v 0 zero 0\n"), "line 1: 'zero' is not a number"));
    CHECK(contains(complaint("v 0 0x 0\n"), "'0x' is not a number"));
    CHECK(contains(complaint("v 0 1,5 0\n"), "'1,5' is not a number"));
    CHECK(contains(complaint(triangle + "f 1 2 c\n"), "'c' is not a vertex of a face"));
    CHECK(contains(complaint(triangle + "f 1 2 3.0\n"), "'3.0' is not a vertex of a face"));
    CHECK(contains(complaint(triangle + "f 1/1/1/1 2 3\n"), "is not a vertex of a face"));
}

TEST_CASE("indices out of range are refused with their line")
{
    CHECK(complaint(triangle + "f 1 2 4\n") ==
          "mesh.obj: line 5: vertex index 4 is out of range: there are 3");
    for (const char* index : {"0", "-4", "2147483648", "-99999999999999999999", "4294967297"}) {
        CAPTURE(index);
        CHECK(contains(complaint(triangle + "f 1 2 " + index + "\n"), "is out of range"));
    }
    CHECK(contains(complaint(triangle + "f 1/1 2/1 3/1\n"), "texture index 1 is out of range"));
    CHECK(contains(complaint(triangle + "f 1//1 2//1 3//1\n"), "normal index 1 is out of range"));
    CHECK(complaint(triangle + "f -3 -2 -1\n").empty());
}

TEST_CASE("single bad triangles are dropped and counted")
{
    for (const char* bad : {"nan 0 0", "0 inf 0", "0 0 -inf", "1e39 0 0", "1e999 0 0",
                            "1.#QNAN 0 0", "NaN 0 0", "-1.#IND 0 0"}) {
        CAPTURE(bad);
        const auto mesh =
            support::parse_obj(triangle + "v " + bad + "\nf 1 2 4\nf 2 3 4\n", "mesh.obj");
        CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2});
        CHECK(mesh.dropped == 2);
    }
    const auto flat = support::parse_obj(triangle + "v 2 0 0\nf 1 2 4\nf 1 1 2\nf 3 3 3\n", "m");
    CHECK(flat.indices.size() == 3);
    CHECK(flat.dropped == 3);
    const auto tiny =
        support::parse_obj("v 0 0 0\nv 1e-999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 2 3 4\n", "m");
    CHECK(tiny.indices == std::vector<std::uint32_t>{1, 2, 3});
    CHECK(tiny.dropped == 1);
}

TEST_CASE("a mesh without a good triangle is refused")
{
    CHECK(contains(complaint("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"), "no triangle is left"));
    CHECK(contains(complaint("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), "no triangle is left"));
}

TEST_CASE("a missing file and a folder are refused by name")
{
    CHECK_THROWS_WITH_AS((void)support::read_obj("no/such/file.obj"),
                         "no/such/file.obj: cannot be opened: No such file or directory",
                         support::Failure);
    const std::string folder = std::filesystem::temp_directory_path().string();
    CHECK_THROWS_WITH_AS((void)support::read_obj(folder), (folder + ": is a folder").c_str(),
                         support::Failure);
}
