#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::Bvh;
using nook::detail::Bounds;
using nook::detail::BvhNode;
using nook::detail::BvhView;
using nook::detail::TriangleBlock;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

Bvh built(const Mesh& mesh)
{
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    return bvh;
}

/// What a walk over all nodes finds.
struct Shape {
    std::size_t nodes = 0, blocks = 0;
    int depth = 0;
    /// How often each face is held.
    std::vector<int> faces;
    /// Boxes that do not hold what is below them, and nodes that come before their parents.
    int wrong = 0;
};

bool holds(const Bounds& outer, const Bounds& inner)
{
    for (int k = 0; k < 3; ++k)
        if (inner.low[k] < outer.low[k] || inner.high[k] > outer.high[k]) return false;
    return true;
}

Shape shape(const Bvh& bvh, std::size_t faces)
{
    Shape result;
    result.faces.assign(faces, 0);
    const BvhView view = bvh.view();
    if (view.empty()) return result;
    struct Waiting {
        std::uint32_t child;
        Bounds box;
        int level;
    };
    constexpr float most = std::numeric_limits<float>::max();
    std::vector<Waiting> stack{{view.root, {{-most, -most, -most}, {most, most, most}}, 1}};
    while (!stack.empty()) {
        const auto [child, box, level] = stack.back();
        stack.pop_back();
        if ((child & BvhNode::block_bit) != 0) {
            ++result.blocks;
            const TriangleBlock& block = view.blocks[child & ~BvhNode::block_bit];
            for (int lane = 0; lane < TriangleBlock::lanes; ++lane) {
                if (lane == 0 || block.faces[lane] != block.faces[lane - 1])
                    ++result.faces[block.faces[lane]];
                result.wrong += !holds(box, block.triangle(lane).bounds());
            }
            continue;
        }
        ++result.nodes;
        result.depth = std::max(result.depth, level);
        const BvhNode& node = view.nodes[child];
        int used = 0;
        for (int lane = 0; lane < BvhNode::lanes; ++lane) {
            if (node.child[lane] == nook::no_face) continue;
            ++used;
            result.wrong += !holds(box, node.box(lane));
            result.wrong += node.child[lane] <= child;
            stack.push_back({node.child[lane], node.box(lane), level + 1});
        }
        result.wrong += used == 0;
    }
    return result;
}

/// Checks all that every tree must be, and returns how full its blocks are.
double check_shape(const Mesh& mesh, const Bvh& bvh)
{
    const std::size_t count = mesh.view().triangle_count;
    const Shape found = shape(bvh, count);
    CHECK(found.wrong == 0);
    CHECK(found.depth == bvh.depth());
    CHECK(bvh.depth() <= BvhView::most_levels);
    std::size_t dropped = 0, different = 0;
    for (std::size_t t = 0; t < count; ++t) {
        const bool usable = nook::is_usable_triangle(mesh.view(), t);
        dropped += !usable;
        different += found.faces[t] != (usable ? 1 : 0);
    }
    CHECK(different == 0);
    CHECK(bvh.dropped() == dropped);
    CHECK(bvh.triangle_count() == count - dropped);
    const std::size_t bytes = found.nodes * sizeof(BvhNode) + found.blocks * sizeof(TriangleBlock);
    CHECK(bvh.memory_size() >= bytes);
    CHECK(bvh.memory_size() <= bytes + 256);
    return found.blocks == 0 ? 0
                             : static_cast<double>(bvh.triangle_count()) /
                                   static_cast<double>(TriangleBlock::lanes * found.blocks);
}

/// A rough sheet, as long as wanted.
Mesh sheet(int width, int height)
{
    std::mt19937 random{3};
    std::uniform_real_distribution<double> unit{0, 0.7};
    Mesh mesh;
    for (int y = 0; y <= height; ++y)
        for (int x = 0; x <= width; ++x) mesh.vertex({double(x), double(y), unit(random)});
    const auto vertex = [&](int x, int y) {
        return static_cast<std::uint32_t>(y * (width + 1) + x);
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            mesh.face(vertex(x, y), vertex(x + 1, y), vertex(x + 1, y + 1));
            mesh.face(vertex(x, y), vertex(x + 1, y + 1), vertex(x, y + 1));
        }
    return mesh;
}

bool same_trees(const Bvh& a, const Bvh& b, std::size_t faces)
{
    const Shape one = shape(a, faces), other = shape(b, faces);
    return one.nodes == other.nodes && one.blocks == other.blocks && a.depth() == b.depth() &&
           std::memcmp(a.view().nodes, b.view().nodes, one.nodes * sizeof(BvhNode)) == 0 &&
           std::memcmp(a.view().blocks, b.view().blocks, one.blocks * sizeof(TriangleBlock)) == 0;
}

struct Backwards {
    static int concurrency() { return 3; }
    template <class Function>
    void for_each(int count, Function&& function) const
    {
        for (int task = count - 1; task >= 0; --task) function(task, task % 3);
    }
};

/// Memory that counts, and ends.
struct Account {
    int allowed = 1 << 30, taken = 0, blocks = 0;
    std::size_t bytes = 0, most = 0;

    nook::Memory memory()
    {
        nook::Memory result;
        result.user = this;
        result.allocate = [](std::size_t size, void* user) -> void* {
            auto& a = *static_cast<Account*>(user);
            if (a.taken == a.allowed) return nullptr;
            ++a.taken;
            ++a.blocks;
            a.bytes += size;
            a.most = std::max(a.most, a.bytes);
            return std::malloc(size);
        };
        result.free = [](void* block, std::size_t size, void* user) {
            auto& a = *static_cast<Account*>(user);
            --a.blocks;
            a.bytes -= size;
            std::free(block);
        };
        return result;
    }
};

}  // namespace

TEST_CASE("every usable face is in one block, and every box holds what is below it")
{
    std::mt19937 random{31};
    for (int count = 0; count <= 40; ++count) {
        CAPTURE(count);
        const Mesh mesh = meshes::soup(random, count);
        check_shape(mesh, built(mesh));
    }
    for (const int count : {100, 1000, 4095, 4096, 4097, 20000}) {
        CAPTURE(count);
        Mesh mesh = meshes::soup(random, count);
        for (int i = 0; i < 50; ++i)
            mesh.positions[static_cast<std::size_t>(i * 131) % mesh.positions.size()] =
                i % 2 != 0 ? infinity : not_a_number;
        check_shape(mesh, built(mesh));
    }
}

TEST_CASE("blocks are well filled, and little memory is needed")
{
    std::mt19937 random{32};
    for (const Mesh& mesh : {meshes::icosphere(5), sheet(170, 90), meshes::soup(random, 30000)}) {
        Account account;
        Bvh bvh;
        REQUIRE(bvh.build(mesh.view(), {.memory = account.memory()}));
        CHECK(check_shape(mesh, bvh) > 0.75);
        const double bytes_per_triangle =
            static_cast<double>(bvh.memory_size()) / static_cast<double>(bvh.triangle_count());
        CHECK(bytes_per_triangle < 58);
        CHECK(account.bytes == bvh.memory_size());
        CHECK(account.most < 2.1 * static_cast<double>(bvh.memory_size()));
    }
}

TEST_CASE("a tree has the same bits for any number of threads and any order of tasks")
{
    std::mt19937 random{33};
    Mesh copies = meshes::soup(random, 9000);
    for (int i = 0; i < 9000; ++i) copies.face(0, 1, 2);
    for (const Mesh& mesh : {sheet(160, 90), meshes::soup(random, 30000), copies,
                             meshes::soup(random, 100), meshes::soup(random, 5)}) {
        const Bvh expected = built(mesh);
        const std::size_t faces = mesh.view().triangle_count;
        Bvh bvh;
        for (int threads = 1; threads <= 16; ++threads) {
            nook::ThreadExecutor executor{threads};
            REQUIRE(bvh.build(mesh.view(), {}, executor));
            CHECK(same_trees(bvh, expected, faces));
        }
        REQUIRE(bvh.build(mesh.view(), {}, Backwards{}));
        CHECK(same_trees(bvh, expected, faces));
    }
}

TEST_CASE("a scene scaled by a power of two has the same tree")
{
    std::mt19937 random{34};
    const Mesh mesh = meshes::soup(random, 6000);
    const Bvh expected = built(mesh);
    for (const double scale : {0x1p20, 0x1p-20, 0x1p60, 0x1p-60})
        CHECK(same_trees(built(mesh.transformed(scale, {0, 0, 0})), expected,
                         mesh.view().triangle_count));
}

TEST_CASE("of two lanes, the one of large triangles is last, where a ray that may stop begins")
{
    Mesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.triangle({i * 0.01, 0, 0}, {i * 0.01 + 0.01, 0, 0}, {i * 0.01, 0.01, 0});
        mesh.triangle({50, 0, i * 0.01}, {60, 0, i * 0.01}, {50, 10, i * 0.01});
    }
    const Bvh bvh = built(mesh);
    const BvhNode& root = bvh.view().nodes[0];
    CHECK(root.child[2] == nook::no_face);
    CHECK(root.box(1).low[0] > root.box(0).high[0]);
}

TEST_CASE(
    "halving ends after as many levels as is said, and bins are left where no more are allowed")
{
    using nook::detail::BvhRange;
    using nook::detail::half_of;
    using nook::detail::halvings;
    for (const std::uint32_t offset : {0u, 99990u, 0x7ffffff0u, 0xffffd000u})
        for (std::uint32_t i = 1; i < 5000; ++i) {
            const std::uint32_t size = offset + i;
            if (size <= TriangleBlock::lanes) {
                CHECK(halvings(size) == 0);
                continue;
            }
            const std::uint32_t left = half_of(size);
            REQUIRE(left < size);
            CHECK(left % TriangleBlock::lanes == 0);
            CHECK(std::max(halvings(left), halvings(size - left)) == halvings(size) - 1);
        }
    float unit_box[8] = {0, 0, 0, 0, -1, -1, -1, 0};
    BvhRange range{0, 1000, 0, 0, 1, nook::detail::BoxRow::load(unit_box)};
    const nook::detail::BinGrid grid{range.centres, range.size()};
    CHECK(range.splits(grid));
    range.level = BvhRange::most_levels - halvings(1000);
    CHECK(range.splits(grid));
    ++range.level;
    CHECK_FALSE(range.splits(grid));
}

TEST_CASE("coincident and nested triangles end in a shallow tree")
{
    SUBCASE("a million of one centre")
    {
        Mesh mesh;
        mesh.triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, 0});
        mesh.indices.reserve(3000000);
        for (int i = 1; i < 1000000; ++i) mesh.face(0, 1, 2);
        const Bvh bvh = built(mesh);
        CHECK(bvh.triangle_count() == 1000000);
        CHECK(bvh.depth() <= 12);
        CHECK(check_shape(mesh, bvh) == 1);
        CHECK(bvh.occluded({{0, 0, 1}, {0, 0, -1}}));
        CHECK_FALSE(bvh.occluded({{3, 0, 1}, {0, 0, -1}}));
        CHECK(bvh.closest({{0, 0, 1}, {0, 0, -1}}).face == 0);
    }
    SUBCASE("many sizes of one centre")
    {
        Mesh mesh;
        for (int i = 0; i < 20000; ++i) {
            const double size = 1 + i % 1000;
            mesh.triangle({-size, -size, 0}, {size, -size, 0}, {0, size, 0});
        }
        check_shape(mesh, built(mesh));
    }
    SUBCASE("sizes that halve, so that every split by area takes one away")
    {
        for (const int count : {120, 5000}) {
            Mesh mesh;
            for (int i = 0; i < count; ++i) {
                const double s = std::ldexp(1.0, -(i % 120));
                mesh.triangle({s, 0, 0}, {s * 1.5, 0, 0}, {s, s, s});
            }
            const Bvh bvh = built(mesh);
            check_shape(mesh, bvh);
            std::mt19937 random{15};
            int different = 0;
            for (int i = 0; i < 20; ++i) {
                const nook::Ray ray{meshes::random_direction(random) * 2.0,
                                    meshes::random_direction(random)};
                const nook::Hit hit = bvh.closest(ray),
                                slow = nook::closest_brute_force(mesh.view(), ray);
                different += hit.face != slow.face || hit.t != slow.t;
            }
            CHECK(different == 0);
        }
    }
    SUBCASE("one large triangle among many small ones")
    {
        Mesh mesh = sheet(100, 50);
        mesh.triangle({-1e6, 0, 0}, {1e6, 0, 1}, {0, 1e6, 0});
        check_shape(mesh, built(mesh));
    }
}

TEST_CASE("a mesh of nothing usable builds to nothing")
{
    Mesh mesh;
    for (int i = 0; i < 10000; ++i) mesh.triangle({1, 1, 1}, {1, 1, 1}, {2, 2, 2});
    for (int i = 0; i < 10; ++i) mesh.triangle({1, 1, not_a_number}, {0, 1, 1}, {2, 2, 2});
    const Bvh bvh = built(mesh);
    CHECK(bvh.dropped() == 10010);
    CHECK(bvh.triangle_count() == 0);
    CHECK(bvh.view().empty());
    CHECK(bvh.memory_size() == 0);
    CHECK(built({}).view().empty());
}

TEST_CASE("memory comes from the caller, goes back to the caller, and its end is an error")
{
    for (const Mesh& mesh : {meshes::icosphere(3), meshes::icosphere(5), meshes::icosphere(0)}) {
        Account account;
        {
            Bvh bvh;
            REQUIRE(bvh.build(mesh.view(), {.memory = account.memory()}));
            CHECK(account.blocks == 1);
            CHECK(account.bytes == bvh.memory_size());
            const Bvh moved = std::move(bvh);
            CHECK(account.blocks == 1);
            CHECK(moved.occluded({{0, 0, 0}, {0, 0, 1}}));
        }
        CHECK(account.blocks == 0);
        CHECK(account.bytes == 0);

        const int needed = account.taken;
        CHECK(needed >= 3);
        Bvh bvh = built(meshes::icosphere(0));
        for (int allowed = 0; allowed < needed; ++allowed) {
            account = {.allowed = allowed};
            const nook::Outcome outcome = bvh.build(mesh.view(), {.memory = account.memory()});
            CHECK(outcome.error.code == nook::ErrorCode::out_of_memory);
            CHECK(outcome.error.value > 0);
            CHECK(account.blocks == 0);
            CHECK(bvh.triangle_count() == 20);
            CHECK(bvh.occluded({{0, 0, 0}, {0, 0, 1}}));
        }
    }
}

TEST_CASE("a hierarchy that was moved from is empty")
{
    Bvh a = built(meshes::icosphere(1));
    const Bvh b = std::move(a);
    CHECK(b.occluded({{0, 0, 0}, {0, 0, 1}}));
    CHECK_FALSE(a.occluded({{0, 0, 0}, {0, 0, 1}}));
    CHECK(a.triangle_count() == 0);
}

TEST_CASE("bad arguments are named, and the hierarchy stays as it was")
{
    Mesh mesh = meshes::icosphere(0);
    Bvh bvh = built(mesh);
    const auto rejected = [&](const nook::Outcome& outcome) {
        CHECK(bvh.triangle_count() == 20);
        return std::string{outcome.error.argument};
    };
    mesh.indices[4] = 12;
    CHECK(rejected(bvh.build(mesh.view())) == "mesh.indices");
    nook::MeshView view = mesh.view();
    view.indices = nullptr;
    CHECK(rejected(bvh.build(view)) == "mesh.indices");
    view = mesh.view();
    view.positions = nullptr;
    CHECK(rejected(bvh.build(view)) == "mesh.positions");
}
