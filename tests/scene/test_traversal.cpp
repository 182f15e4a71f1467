#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <nook/scene/bvh.hpp>
#include <nook/scene/neighbourhood.hpp>

#include "hard_rays.hpp"
#include "meshes.hpp"

namespace {

using hard_rays::Random;
using meshes::Mesh;
using nook::Bvh;
using nook::Hit;
using nook::detail::Bounds;
using nook::detail::BvhNode;
using nook::detail::FloatOrigin;
using nook::detail::FloatRay;
using nook::detail::LaneAnswer;
using nook::detail::Neighbourhood;
using nook::detail::SceneRay;
using nook::detail::SceneTriangle;
using nook::detail::TriangleBlock;
using nook::detail::Vector3;

struct Tally {
    int cases = 0, hits = 0, certain = 0, false_certain = 0, missed = 0;
};

/// Triangles of eight kinds and one ray at one of them: the answers in float against the exact test.
void judge(Random& random, hard_rays::Kind kind, Tally& tally)
{
    TriangleBlock block;
    SceneTriangle triangles[TriangleBlock::lanes];
    for (int lane = 0; lane < TriangleBlock::lanes; ++lane) {
        triangles[lane] = hard_rays::triangle(random, kind, static_cast<std::uint32_t>(lane));
        block.set(lane, triangles[lane]);
    }
    for (const SceneTriangle& aim : triangles) {
        const SceneRay ray = hard_rays::ray_at(random, aim);
        if (!ray.valid()) continue;
        const FloatOrigin origin{ray.origin};
        const FloatRay rounded{origin, ray};
        const LaneAnswer answer = rounded.meets(block);
        for (int lane = 0; lane < TriangleBlock::lanes; ++lane) {
            const bool hit = ray.is_occluded_by(triangles[lane]);
            const bool certain = (answer.certain >> lane & 1) != 0;
            const bool possible = ((answer.certain | answer.possible) >> lane & 1) != 0;
            ++tally.cases;
            tally.hits += hit;
            tally.certain += certain && hit;
            tally.false_certain += certain && !hit;
            tally.missed += hit && !possible;
        }
    }
}

}  // namespace

TEST_CASE("what float is certain of is so, and no hit is found impossible: two million hard cases")
{
    Random random{31};
    for (int k = 0; k < hard_rays::kinds; ++k) {
        const auto kind = static_cast<hard_rays::Kind>(k);
        CAPTURE(hard_rays::name(kind));
        Tally tally;
        for (int i = 0; i < 5000; ++i) judge(random, kind, tally);
        CHECK(tally.false_certain == 0);
        CHECK(tally.missed == 0);
        CHECK(tally.cases > 200000);
        CHECK(tally.hits > tally.cases / 100);
        // A filter that is never certain would pass: many hits of plain triangles are decided by it.
        if (kind == hard_rays::Kind::plain) CHECK(tally.certain > tally.hits / 8);
    }
}

TEST_CASE("a box is entered, not after the hit, wherever the ray hits the triangle within")
{
    Random random{32};
    int missed = 0, late = 0, hits = 0, entered = 0, lanes = 0;
    for (int k = 0; k < hard_rays::kinds; ++k)
        for (int i = 0; i < 4000; ++i) {
            BvhNode node{};
            SceneTriangle triangles[BvhNode::lanes];
            for (int lane = 0; lane < BvhNode::lanes; ++lane) {
                triangles[lane] = hard_rays::triangle(random, static_cast<hard_rays::Kind>(k), 0);
                const Bounds box = triangles[lane].bounds();
                for (int axis = 0; axis < 3; ++axis) {
                    node.bounds[axis][0][lane] = box.low[axis];
                    node.bounds[axis][1][lane] = box.high[axis];
                }
            }
            const SceneRay ray = hard_rays::ray_at(random, triangles[i % 8]);
            if (!ray.valid()) continue;
            const FloatOrigin origin{ray.origin};
            const FloatRay rounded{origin, ray};
            float entry[BvhNode::lanes];
            const unsigned bits = rounded.enter(node, entry);
            entered += std::popcount(bits);
            lanes += BvhNode::lanes;
            for (int lane = 0; lane < BvhNode::lanes; ++lane) {
                double t = 0;
                if (!ray.meets(triangles[lane], t) || !(t <= ray.t_max)) continue;
                ++hits;
                missed += (bits >> lane & 1) == 0;
                late += double{entry[lane]} > t * (1 + 0x1p-22);
            }
        }
    CHECK(hits > 5000);
    CHECK(missed == 0);
    CHECK(late == 0);
    CHECK(entered < lanes * 3 / 4);
}

TEST_CASE("hard rays through hierarchies, and segments in a neighbourhood, equal brute force")
{
    Random random{33};
    int different = 0, hits = 0, rays = 0, collected = 0;
    for (int scene = 0; scene < 400; ++scene) {
        const auto [mesh, extent] = hard_rays::scene(random, scene);
        Bvh bvh;
        REQUIRE(bvh.build(mesh.view()));
        const auto triangles = hard_rays::scene_triangles(mesh, bvh.space());
        if (triangles.empty()) continue;
        Neighbourhood around{bvh.view()};
        for (int i = 0; i < 60; ++i) {
            const SceneTriangle& aim = triangles[static_cast<std::size_t>(i) % triangles.size()];
            const SceneRay ray = hard_rays::ray_at(random, aim);
            if (!ray.valid()) continue;
            Hit slow{};
            for (const SceneTriangle& triangle : triangles) ray.keep_nearest(triangle, slow);
            const Hit hit = nook::detail::closest(bvh.view(), ray);
            ++rays;
            hits += bool(slow);
            different += hit.face != slow.face || hit.t != slow.t;
            different += nook::detail::occluded(bvh.view(), ray) != bool(slow);
            around.whole();
            different += around.occluded(ray) != bool(slow);
            // A segment lies in the neighbourhood of its start that its length spans.
            const double along = std::sqrt(ray.direction[0] * ray.direction[0] +
                                           ray.direction[1] * ray.direction[1] +
                                           ray.direction[2] * ray.direction[2]);
            const double reach = ray.t_max * along;
            if (reach < 4 && std::fabs(ray.origin[0]) < 1e6 && std::fabs(ray.origin[1]) < 1e6 &&
                std::fabs(ray.origin[2]) < 1e6) {
                Bounds at;
                for (int k = 0; k < 3; ++k)
                    at.low[k] = at.high[k] = static_cast<float>(ray.origin[k]);
                around.collect(at, nook::detail::rounded_up(reach));
                ++collected;
                different += around.occluded(ray) != bool(slow);
            }
        }
        different += extent <= 0;
    }
    CHECK(different == 0);
    CHECK(collected > rays / 5);
    CHECK(hits > rays / 10);
    CHECK(hits < rays * 9 / 10);
}

TEST_CASE("a neighbourhood without anything in reach is empty, and the root is its own")
{
    Mesh mesh;
    for (int x = 0; x < 40; ++x) mesh.box({x * 2.0, 0, 0}, {x * 2.0 + 1, 1, 1});
    Bvh bvh;
    REQUIRE(bvh.build(mesh.view()));
    Neighbourhood around{bvh.view()};
    CHECK_FALSE(around.empty());
    const auto at = [&](double x, double y, double z) {
        const Vector3 p = bvh.space().to_scene({x, y, z});
        Bounds bounds;
        const double c[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k) bounds.low[k] = bounds.high[k] = static_cast<float>(c[k]);
        return bounds;
    };
    const auto reach = [&](double r) { return static_cast<float>(r * bvh.space().scale); };
    around.collect(at(10, 9, 0), reach(3));
    CHECK(around.empty());
    around.collect(at(10, 9, 0), reach(8.001));
    CHECK_FALSE(around.empty());
    around.collect(at(10.5, 0.5, 0.5), reach(0));
    CHECK_FALSE(around.empty());
    around.collect(at(10.5, 0.5, 0.5), reach(1e9));
    CHECK_FALSE(around.empty());
    const Bvh nothing;
    Neighbourhood none{nothing.view()};
    CHECK(none.empty());
    none.collect(at(0, 0, 0), 1);
    CHECK(none.empty());
    none.whole();
    CHECK(none.empty());
    CHECK_FALSE(none.occluded(SceneRay{{0, 0, 0}, {0, 0, 1}, 1}));
}
