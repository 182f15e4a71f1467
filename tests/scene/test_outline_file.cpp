#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nook/scene/outline.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Error;
using nook::ErrorCode;
using nook::OutlineMethod;
using nook::OutlineShell;
using nook::OutlineView;

using Bytes = std::vector<unsigned char>;

/// A sphere, an open sheet, a room: all that a file can hold.
OutlineShell some_shell()
{
    Mesh mesh = meshes::icosphere(1);
    mesh.quad({3, 0, 0}, {4, 0, 0}, {4, 1, 0}, {3, 1, 0});
    const Mesh room = meshes::icosphere(0, 10);
    for (std::size_t i = 0; i < room.indices.size(); i += 3) {
        const auto at = [&](std::size_t corner) -> meshes::Point {
            const float* p = room.positions.data() + 3 * room.indices[i + corner];
            return {p[0], p[1], p[2]};
        };
        mesh.triangle(at(0), at(2), at(1));
    }
    OutlineShell shell;
    REQUIRE(shell.build(mesh.view()));
    REQUIRE(shell.object_count() == 3);
    REQUIRE(shell.object(1).open);
    REQUIRE(shell.object(2).inward);
    return shell;
}

Bytes saved(const OutlineShell& shell)
{
    Bytes bytes(shell.saved_size());
    REQUIRE(shell.save(bytes.data(), bytes.size()));
    return bytes;
}

/// Data where a view has none.
template <class T>
bool equal(const T* a, const T* b, std::size_t count)
{
    return count == 0 || std::memcmp(a, b, count * sizeof(T)) == 0;
}

bool equal(const OutlineShell& a, const OutlineShell& b)
{
    const OutlineView v = a.view(), w = b.view();
    bool same = v.vertex_count == w.vertex_count && v.triangle_count == w.triangle_count &&
                a.object_count() == b.object_count() && a.face_offset() == b.face_offset() &&
                equal(v.base, w.base, 3 * v.vertex_count) &&
                equal(v.direction, w.direction, 3 * v.vertex_count) &&
                equal(v.indices, w.indices, 3 * v.triangle_count);
    for (std::size_t i = 0; same && i < a.object_count(); ++i) {
        const auto &x = a.object(i), &y = b.object(i);
        same = x.first_triangle == y.first_triangle && x.triangle_count == y.triangle_count &&
               x.open == y.open && x.inward == y.inward;
    }
    return same;
}

/// Writes the right checksum over bytes that were tampered with: the checks behind it must hold alone.
void sign(Bytes& bytes)
{
    const std::uint64_t sum = nook::detail::shell_checksum(bytes.data(), bytes.size());
    for (unsigned i = 0; i < 8; ++i) bytes[40 + i] = static_cast<unsigned char>(sum >> 8 * i);
}

void put(Bytes& bytes, std::size_t at, std::uint32_t word)
{
    for (unsigned i = 0; i < 4; ++i) bytes[at + i] = static_cast<unsigned char>(word >> 8 * i);
}

/// Memory that runs out after some blocks, and knows what was not given back.
struct Allocator {
    int left = 1 << 30;
    int blocks = 0;
    std::size_t bytes = 0;

    [[nodiscard]] nook::Memory memory()
    {
        return {[](std::size_t size, void* user) -> void* {
                    auto& self = *static_cast<Allocator*>(user);
                    if (self.left-- <= 0) return nullptr;
                    ++self.blocks;
                    self.bytes += size;
                    return std::malloc(size);
                },
                [](void* block, std::size_t size, void* user) {
                    auto& self = *static_cast<Allocator*>(user);
                    --self.blocks;
                    self.bytes -= size;
                    std::free(block);
                },
                this};
    }
};

}  // namespace

TEST_CASE("a saved shell loads bit for bit")
{
    const OutlineShell shell = some_shell();
    const Bytes bytes = saved(shell);
    CHECK(bytes.size() == 56 + 12 * (2 * shell.view().vertex_count + shell.view().triangle_count +
                                     shell.object_count()));
    OutlineShell loaded;
    REQUIRE(loaded.load(bytes.data(), bytes.size()));
    CHECK(equal(shell, loaded));
    CHECK(saved(loaded) == bytes);
    // At any alignment.
    Bytes shifted(bytes.size() + 1);
    std::copy(bytes.begin(), bytes.end(), shifted.begin() + 1);
    OutlineShell again;
    REQUIRE(again.load(shifted.data() + 1, bytes.size()));
    CHECK(equal(shell, again));
    REQUIRE(again.save(shifted.data() + 1, bytes.size()));
    CHECK(std::equal(bytes.begin(), bytes.end(), shifted.begin() + 1));
    // Nothing at all, in place of something.
    REQUIRE(again.load(saved(OutlineShell{}).data(), 56));
    CHECK(equal(again, OutlineShell{}));
}

TEST_CASE("the bytes of a saved triangle are those of the format")
{
    OutlineShell shell;
    Mesh mesh;
    mesh.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    REQUIRE(shell.build(mesh.view(), {.method = OutlineMethod::scaling}));
    const Bytes bytes = saved(shell);
    const Bytes head{'n', 'o', 'o', 'k', 's', 'h', 'e', 'l', 1, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0,
                     0,   0,   0,   0,   2,   0,   0,   0,   0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0};
    REQUIRE(bytes.size() == 56 + 12 * (2 * 3 + 2 + 1));
    CHECK(std::equal(head.begin(), head.end(), bytes.begin()));
    // The first 1.0f of the base is that of the second vertex; it is 0x3f800000.
    const Bytes one{0, 0, 0x80, 0x3f};
    CHECK(std::find_end(bytes.begin() + 56, bytes.begin() + 92, one.begin(), one.end()) !=
          bytes.begin() + 92);
    const Bytes object{0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0};
    CHECK(std::equal(object.begin(), object.end(), bytes.end() - 12));
}

TEST_CASE("damaged bytes are an error, and the shell stays as it was")
{
    const OutlineShell shell = some_shell();
    const Bytes bytes = saved(shell);
    OutlineShell loaded;
    REQUIRE(loaded.load(bytes.data(), bytes.size()));
    // Each bit of the header and many others; each length.
    std::mt19937 random{1};
    int accepted = 0;
    for (std::size_t i = 0; i < 8 * 56 + 3000; ++i) {
        const std::size_t bit = i < 8 * 56 ? i : random() % (8 * bytes.size());
        Bytes damaged = bytes;
        damaged[bit / 8] = static_cast<unsigned char>(damaged[bit / 8] ^ 1u << bit % 8);
        if (loaded.load(damaged.data(), damaged.size())) ++accepted;
    }
    CHECK(accepted == 0);
    for (std::size_t size = 0; size < bytes.size(); size += size < 100 ? 1 : 37) {
        const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        if (loaded.load(cut.data(), size)) ++accepted;
    }
    Bytes longer = bytes;
    longer.push_back(0);
    if (loaded.load(longer.data(), longer.size())) ++accepted;
    CHECK(accepted == 0);
    CHECK(equal(shell, loaded));
}

TEST_CASE("bytes with a made-up checksum never crash, and what loads is sound")
{
    const Bytes bytes = saved(some_shell());
    std::mt19937 random{2};
    int loads = 0;
    for (int i = 0; i < 5000; ++i) {
        Bytes damaged = bytes;
        const int changes = 1 + i % 3;
        for (int c = 0; c < changes; ++c) {
            const std::size_t at = (i % 4 == 0 ? random() % 56 : random() % bytes.size()) & ~3u;
            const std::uint32_t words[] = {
                0, 1, 0xffffffff, 0x7f800000, 0x7fc00000, static_cast<std::uint32_t>(random())};
            put(damaged, at, words[random() % 6]);
        }
        sign(damaged);
        OutlineShell shell;
        if (!shell.load(damaged.data(), damaged.size())) {
            CHECK(shell.view().triangle_count == 0);
            continue;
        }
        ++loads;
        const OutlineView view = shell.view();
        for (std::size_t k = 0; k < 3 * view.triangle_count; ++k)
            REQUIRE(view.indices[k] < view.vertex_count);
        std::vector<float> positions(3 * view.vertex_count);
        REQUIRE(shell.extrude(1, positions.data()));
        for (const float p : positions) REQUIRE(nook::detail::is_finite(p));
        for (std::size_t t = 0; t < view.triangle_count; ++t)
            REQUIRE(shell.object_of(t) < shell.object_count());
    }
    CHECK(loads > 100);
}

TEST_CASE("a bad file says what is wrong with it")
{
    const OutlineShell shell = some_shell();
    const Bytes bytes = saved(shell);
    const std::size_t v = shell.view().vertex_count, t = shell.view().triangle_count;
    const std::size_t base = 56, direction = base + 12 * v, indices = direction + 12 * v;
    const std::size_t objects = indices + 12 * t;
    const struct {
        std::size_t at;
        std::uint32_t word;
        ErrorCode code;
        const char* argument;
    } rows[] = {
        {0, 0x6b6f6f4e, ErrorCode::bad_value, "data.magic"},
        {8, 2, ErrorCode::bad_value, "data.version"},
        {12, 1, ErrorCode::bad_value, "data.version"},
        {20, 1, ErrorCode::bad_size, "data.vertex_count"},
        {28, 1, ErrorCode::bad_size, "data.triangle_count"},
        {36, 1, ErrorCode::bad_size, "data.object_count"},
        {24, 0x80000000, ErrorCode::bad_size, "data.triangle_count"},
        {16, 0x7ffffffe, ErrorCode::bad_size, "size"},
        {52, 0x7ff80000, ErrorCode::bad_value, "data.face_offset"},
        {base + 8, 0x7f800000, ErrorCode::bad_value, "data.base"},
        {direction + 4, 0xffc00000, ErrorCode::bad_value, "data.direction"},
        {indices + 20, static_cast<std::uint32_t>(v), ErrorCode::index_out_of_range,
         "data.indices"},
        {objects, 1, ErrorCode::bad_value, "data.objects"},
        {objects + 4, 0xffffffff, ErrorCode::bad_value, "data.objects"},
        {objects + 28, 1, ErrorCode::bad_value, "data.objects"},
        {objects + 8, 4, ErrorCode::bad_value, "data.objects"},
    };
    for (const auto& [at, word, code, argument] : rows) {
        Bytes bad = bytes;
        put(bad, at, word);
        sign(bad);
        OutlineShell target;
        const Error error = target.load(bad.data(), bad.size()).error;
        CHECK(error.code == code);
        CHECK(std::string{error.argument} == argument);
    }
    Bytes bad = bytes;
    bad[base] ^= 1;
    OutlineShell target;
    CHECK(std::string{target.load(bad.data(), bad.size()).error.argument} == "data.checksum");
    CHECK(target.load(nullptr, 100).error.code == ErrorCode::null_data);
    CHECK(target.load(nullptr, 0).error.code == ErrorCode::bad_size);
    CHECK(target.load(bytes.data(), 55).error.code == ErrorCode::bad_size);
    Bytes room(shell.saved_size());
    CHECK(shell.save(room.data(), room.size() - 1).error.code == ErrorCode::bad_size);
    CHECK(shell.save(nullptr, room.size()).error.code == ErrorCode::null_data);
    CHECK(std::all_of(room.begin(), room.end(), [](unsigned char b) { return b == 0; }));
}

TEST_CASE("a shell that gets no memory says so, gives back what it had and stays as it was")
{
    std::mt19937 random{4};
    Mesh mesh = meshes::soup(random, 60);
    for (std::uint32_t& index : mesh.indices) index %= 12;
    mesh.face(0, 1, 2);
    mesh.face(1, 2, 3);
    OutlineShell shell = some_shell();
    const OutlineShell before = some_shell();
    Allocator allocator;
    const nook::Memory memory = allocator.memory();
    for (int blocks = 0;; ++blocks) {
        REQUIRE(blocks < 100);
        allocator.left = blocks;
        const nook::Outcome outcome = shell.build(mesh.view(), {.memory = memory});
        if (outcome) {
            CHECK(blocks >= 8);
            CHECK(allocator.blocks == 1);
            break;
        }
        CHECK(outcome.error.code == ErrorCode::out_of_memory);
        CHECK(std::string{outcome.error.argument} == "options.memory");
        CHECK(outcome.error.value > 0);
        CHECK(allocator.blocks == 0);
        CHECK(allocator.bytes == 0);
        CHECK(equal(shell, before));
    }
    const Bytes bytes = saved(shell);
    allocator.left = 0;
    CHECK(shell.load(bytes.data(), bytes.size(), memory).error.code == ErrorCode::out_of_memory);
    CHECK(saved(shell) == bytes);
    allocator.left = 1;
    REQUIRE(shell.load(bytes.data(), bytes.size(), memory));
    CHECK(saved(shell) == bytes);
    OutlineShell moved = std::move(shell);
    CHECK(shell.view().base == nullptr);
    CHECK(saved(moved) == bytes);
    moved = OutlineShell{};
    CHECK(allocator.blocks == 0);
    CHECK(allocator.bytes == 0);
}

TEST_CASE("bad arguments of an outline are named")
{
    constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Mesh mesh = meshes::icosphere(0);
    OutlineShell shell;
    REQUIRE(shell.build(mesh.view()));
    const auto argument = [&](const nook::OutlineOptions& options) -> std::string {
        const nook::Outcome outcome = shell.build(mesh.view(), options);
        CHECK((outcome || outcome.error.code == ErrorCode::bad_value));
        CHECK((outcome || shell.view().triangle_count == 20));
        return outcome.error.argument;
    };
    for (const double bad : {not_a_number, infinity, -infinity, -1e-9}) {
        CHECK(argument({.weld = bad}) == "options.weld");
        CHECK(argument({.normal_tolerance = bad}) == "options.normal_tolerance");
        CHECK(argument({.mitre_limit = bad}) == "options.mitre_limit");
        float one = 7;
        const Error error = shell.extrude(bad, &one).error;
        CHECK(std::string{error.argument} == "extent");
        CHECK(one == 7);
    }
    CHECK(argument({.normal_tolerance = 1.6}) == "options.normal_tolerance");
    CHECK(argument({.mitre_limit = 0.9}) == "options.mitre_limit");
    CHECK(argument({.mitre_limit = 1001}) == "options.mitre_limit");
    CHECK(argument({.method = static_cast<OutlineMethod>(4)}) == "options.method");
    CHECK(argument({.weld = 0, .normal_tolerance = 0, .mitre_limit = 1}).empty());
    CHECK(shell.extrude(1, nullptr).error.code == ErrorCode::null_data);
    Mesh bad = mesh;
    bad.indices[5] = 12;
    CHECK(shell.build(bad.view()).error.code == ErrorCode::index_out_of_range);
    nook::MeshView many = mesh.view();
    many.triangle_count = (std::size_t{1} << 26) + 1;
    many.indices = nullptr;
    CHECK(shell.build(many).error.code == ErrorCode::null_data);
    CHECK(shell.needed_extent(0) == 0);
    CHECK(shell.needed_extent(-1) == 0);
    CHECK(shell.needed_extent(not_a_number) == 0);
    CHECK(shell.needed_extent(infinity) == infinity);
}
