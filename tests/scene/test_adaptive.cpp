#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/accumulate.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/thread_executor.hpp>

#include "closed_forms.hpp"
#include "meshes.hpp"

namespace {

using closed_forms::built;
using closed_forms::Points;
using meshes::Mesh;
using nook::AdaptiveDirections;
using nook::Bvh;
using nook::TracedOptions;

using Adaptive =
    TracedOptions<nook::StepFalloff, nook::NoSecondaryRays, nook::NoColour, AdaptiveDirections>;
using Plain = TracedOptions<>;

/// A square about the z axis at height 1 over the origin, and the share of directions that pass it by.
struct Square {
    double half;

    [[nodiscard]] double visibility() const
    {
        // Four times the form factor of a rectangle over whose corner the point lies.
        const double slant = std::sqrt(1 + half * half);
        return 1 - 4 / std::numbers::pi * (half / slant) * std::atan(half / slant);
    }
    [[nodiscard]] Bvh bvh() const
    {
        Mesh mesh;
        mesh.quad({-half, -half, 1}, {half, -half, 1}, {half, half, 1}, {-half, half, 1});
        return built(mesh);
    }
};
Square square_of_visibility(double wanted)
{
    double low = 0, high = 1000;
    for (int i = 0; i < 100; ++i) {
        const double middle = (low + high) / 2;
        (Square{middle}.visibility() > wanted ? low : high) = middle;
    }
    return {low};
}

/// The mean of many numbers, its standard error, and their distance from what they should be.
class Mean {
public:
    void add(double value)
    {
        ++count_;
        sum_ += value;
        squares_ += value * value;
    }
    [[nodiscard]] double mean() const { return sum_ / count_; }
    [[nodiscard]] double variance() const { return squares_ / count_ - mean() * mean(); }
    [[nodiscard]] double error() const { return std::sqrt(variance() / count_); }
    /// In standard errors.
    [[nodiscard]] double off(double expected) const { return (mean() - expected) / error(); }
    [[nodiscard]] double root_mean_square(double expected) const
    {
        return std::sqrt(variance() + (mean() - expected) * (mean() - expected));
    }

private:
    double count_ = 0, sum_ = 0, squares_ = 0;
};

/// `count` points at the origin that look along z: as many independent estimates.
Points origins(int count)
{
    Points points;
    for (int i = 0; i < count; ++i) points.add({0, 0, 0}, {0, 0, 1});
    return points;
}
struct Traced {
    std::vector<double> visibility, weight;
    nook::Work work{};
};
template <class Options, class Executor = nook::Serial>
Traced trace(const Bvh& bvh, const Points& points, const Options& options, Executor&& executor = {})
{
    const int count = points.count();
    Traced result{std::vector<double>(static_cast<std::size_t>(count)),
                  std::vector<double>(static_cast<std::size_t>(count))};
    const nook::TracedImages images{
        nook::ImageView<double>{result.visibility.data(), count, 1, count}, nook::absent,
        nook::absent, nook::ImageView<double>{result.weight.data(), count, 1, count}};
    const nook::Outcome done =
        nook::traced_ao(bvh, points.view(0), images, options, nook::HeapScratch{}, executor);
    REQUIRE(done);
    result.work = done.work;
    return result;
}

/// Points strewn about boxes on the ground: open, half hidden and closed ones.
Mesh boxes()
{
    Mesh mesh;
    mesh.quad({-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0});
    mesh.box({0, 0, 0}, {1, 2, 1.5});
    mesh.box({1.5, -1, 0}, {2, 2, 0.7});
    mesh.box({-2, -1.5, 0.2}, {-0.25, 1, 0.4});
    return mesh;
}
Points floor_points(int across = 24)
{
    Points points;
    for (int y = 0; y < across; ++y)
        for (int x = 0; x < across; ++x)
            points.add({8.0 * (x + 0.5) / across - 4, 8.0 * (y + 0.5) / across - 4, 0}, {0, 0, 1});
    return points;
}

constexpr double visibilities[] = {0.02, 0.1, 0.5, 0.9, 0.98};
constexpr int trials = 4000;
constexpr std::uint32_t seed = 1;
/// Standard errors that chance may bring.
constexpr double chance = 4;

}  // namespace

TEST_CASE("stopping where the directions are enough leaves the mean where it is")
{
    const Points points = origins(trials);
    for (const double wanted : visibilities) {
        CAPTURE(wanted);
        const Square square = square_of_visibility(wanted);
        const Bvh bvh = square.bvh();
        for (const double tolerance : {0.015, 0.025, 0.07}) {
            CAPTURE(tolerance);
            const Traced traced = trace(
                bvh, points, Adaptive{.directions = 512, .seed = seed, .stopping = {tolerance, 8}});
            Mean mean, weight, light;
            for (std::size_t i = 0; i < trials; ++i) {
                mean.add(traced.visibility[i]);
                weight.add(traced.weight[i]);
                light.add(traced.visibility[i] * traced.weight[i]);
            }
            CHECK(std::fabs(mean.off(square.visibility())) < chance);
            // Nor does the number of directions know anything of the value: weighted means are right too.
            const double weighted = light.mean() / weight.mean();
            CHECK(std::fabs(weighted - square.visibility()) < chance * mean.error());
            CHECK(mean.root_mean_square(square.visibility()) < tolerance);
            // Half hidden is the hardest; elsewhere pilots differ, and save.
            CHECK(weight.mean() <= 256);
            if (wanted != 0.5) CHECK(weight.variance() > 0);
        }
    }
}

TEST_CASE("a rule that stops once the directions agree is caught by the same means")
{
    for (const double wanted : visibilities) {
        if (wanted == 0.5) continue;
        CAPTURE(wanted);
        const Square square = square_of_visibility(wanted);
        const Bvh bvh = square.bvh();
        const Points points = origins(trials);
        const Traced first = trace(bvh, points, Plain{.directions = 16, .seed = seed}),
                     all = trace(bvh, points, Plain{.directions = 256, .seed = seed});
        Mean naive, fixed;
        for (std::size_t i = 0; i < trials; ++i) {
            const bool agreed = first.visibility[i] == 0 || first.visibility[i] == 1;
            naive.add(agreed ? first.visibility[i] : all.visibility[i]);
            fixed.add(all.visibility[i]);
        }
        CHECK(std::fabs(fixed.off(square.visibility())) < chance);
        if (wanted < 0.05 || wanted > 0.95) CHECK(std::fabs(naive.off(square.visibility())) > 10);
    }
}

TEST_CASE("falloffs and secondary rays stop without bias")
{
    const Points points = origins(trials);
    const Bvh bvh = square_of_visibility(0.3).bvh();
    const auto compare = [&](const auto& fixed, const auto& adaptive) {
        const Traced full = trace(bvh, points, fixed), stopped = trace(bvh, points, adaptive);
        Mean expected, mean, weight;
        for (std::size_t i = 0; i < trials; ++i) {
            expected.add(full.visibility[i]);
            mean.add(stopped.visibility[i]);
            weight.add(stopped.weight[i]);
        }
        const double error = std::hypot(expected.error(), mean.error());
        CHECK(std::fabs(mean.mean() - expected.mean()) < chance * error);
        CHECK(weight.mean() < 200);
        return weight.mean();
    };
    using nook::ExponentialFalloff;
    using nook::NoColour;
    using nook::SecondaryRays;
    using Soft = TracedOptions<ExponentialFalloff>;
    using SoftAdaptive =
        TracedOptions<ExponentialFalloff, nook::NoSecondaryRays, NoColour, AdaptiveDirections>;
    const double soft =
        compare(Soft{.directions = 256, .falloff = {0.7}},
                SoftAdaptive{.directions = 256, .falloff = {0.7}, .stopping = {0.025, 16}});
    // What each direction lets through differs little: fewer are enough than for 0 and 1 with that mean.
    CHECK(soft < 100);
    compare(TracedOptions<nook::StepFalloff, SecondaryRays>{.radius = 3, .directions = 256},
            TracedOptions<nook::StepFalloff, SecondaryRays, NoColour, AdaptiveDirections>{
                .radius = 3, .directions = 256, .stopping = {0.05, 16}});
}

TEST_CASE("a wall that only secondary rays reach counts with a tolerance as without")
{
    // Beyond the radius of primary rays, within reach of the segments across them.
    Mesh mesh;
    mesh.quad({1.2, -5, -5}, {1.2, 5, -5}, {1.2, 5, 5}, {1.2, -5, 5});
    const Bvh bvh = built(mesh);
    const nook::SecondaryRays secondary{.radius = 2};
    const double fixed = nook::traced_visibility(
        bvh, {0, 0, 0}, {0, 0, 1},
        TracedOptions<nook::StepFalloff, nook::SecondaryRays>{.radius = 1, .secondary = secondary});
    const double adaptive = nook::traced_visibility(
        bvh, {0, 0, 0}, {0, 0, 1},
        TracedOptions<nook::StepFalloff, nook::SecondaryRays, nook::NoColour, AdaptiveDirections>{
            .radius = 1, .secondary = secondary, .stopping = {.tolerance = 0}});
    CHECK(fixed < 0.9);
    CHECK(adaptive == fixed);
}

TEST_CASE("a point's value is that of as many directions as its weight tells")
{
    const Bvh bvh = built(boxes());
    const Points points = floor_points();
    const Traced traced =
        trace(bvh, points, Adaptive{.radius = 2, .directions = 256, .stopping = {0.05, 16}});
    bool seen[257] = {};
    for (const int count : {16, 32, 64, 128, 240, 256}) {
        const Traced fixed = trace(bvh, points, Plain{.radius = 2, .directions = count});
        for (std::size_t i = 0; i < fixed.visibility.size(); ++i) {
            if (traced.weight[i] != count) continue;
            seen[count] = true;
            CHECK(traced.visibility[i] == fixed.visibility[i]);
        }
    }
    int numbers = 0;
    for (const bool some : seen) numbers += some;
    CHECK(numbers >= 4);
    for (const double weight : traced.weight) {
        REQUIRE((weight > 0 && weight <= 256));
        CHECK(seen[static_cast<int>(weight)]);
    }
}

TEST_CASE("pilot and directions are never more than were allowed")
{
    // No point is known to be open.
    const Bvh bvh = square_of_visibility(0.5).bvh();
    const Points points = origins(40);
    const auto count = static_cast<std::uint64_t>(points.count());
    for (const int directions : {1, 2, 15, 31, 32, 33, 60, 64, 100, 256})
        for (const int least : {1, 7, 16, 64, (std::numeric_limits<int>::max)()})
            for (const double tolerance : {1e-3, 0.04, 0.2}) {
                CAPTURE(directions);
                CAPTURE(least);
                CAPTURE(tolerance);
                const Traced traced = trace(
                    bvh, points,
                    Adaptive{
                        .radius = 2, .directions = directions, .stopping = {tolerance, least}});
                const nook::Work& work = traced.work;
                CHECK(work.rays + work.skipped_rays ==
                      count * static_cast<std::uint64_t>(directions));
                CHECK(work.rays <= count * static_cast<std::uint64_t>(directions));
                for (const double weight : traced.weight) {
                    REQUIRE(weight >= (std::min)(directions, least));
                    REQUIRE(weight <= directions);
                }
            }
}

TEST_CASE("no tolerance takes all directions, and a huge one the fewest")
{
    const Bvh bvh = built(boxes());
    const Points points = floor_points();
    const Traced fixed = trace(bvh, points, Plain{.radius = 2, .directions = 64});
    for (const double tolerance : {0.0, 5e-324, 1e-200, 1e-9}) {
        const Traced traced =
            trace(bvh, points, Adaptive{.radius = 2, .directions = 64, .stopping = {tolerance}});
        CHECK(traced.visibility == fixed.visibility);
        CHECK(traced.weight == fixed.weight);
        CHECK(traced.work.rays <= fixed.work.rays);
    }
    const Traced least = trace(bvh, points, Plain{.radius = 2, .directions = 8});
    for (const double tolerance : {0.5, 1.0, 1e300}) {
        const Traced traced =
            trace(bvh, points, Adaptive{.radius = 2, .directions = 64, .stopping = {tolerance, 8}});
        CHECK(traced.visibility == least.visibility);
        // No pilot could change the number, so that there is none.
        CHECK(traced.work.rays <= least.work.rays);
    }
}

TEST_CASE("open points cost no ray, closed ones few")
{
    const Points points = origins(64);
    const Adaptive options{.radius = 5, .directions = 1024, .stopping = {0.04, 16}};
    Mesh ground;
    ground.quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0});
    ground.box({-3, -3, -2}, {3, 3, -1});
    // Few points are judged alone, many together.
    for (const int count : {1, 64}) {
        const Traced open = trace(built(ground), origins(count), options);
        CHECK(open.work.rays == 0);
        for (const double v : open.visibility) CHECK(v == 1);
        for (const double w : open.weight) CHECK(w == 1024);
    }

    Mesh room;
    room.box({-1, -1, -1}, {1, 1, 1});
    const Traced closed = trace(built(room), points, options);
    CHECK(closed.work.rays <= 64 * (16 + 64));
    for (const double v : closed.visibility) CHECK(v == 0);

    const Traced nothing = trace(built(Mesh{}), points, options);
    CHECK(nothing.work.rays == 0);
    for (const double v : nothing.visibility) CHECK(v == 1);
}

TEST_CASE("frames of adaptive directions add up to the mean, by their weights")
{
    const Square square = square_of_visibility(0.9);
    const Bvh bvh = square.bvh();
    const Points points = origins(256);
    std::vector<double> mean(256), weight(256), total(256);
    const auto image = [](std::vector<double>& v) {
        return nook::ImageView<double>{v.data(), 256, 1, 256};
    };
    for (int frame = 0; frame < 16; ++frame) {
        Traced traced = trace(bvh, points,
                              Adaptive{.directions = 128,
                                       .first_direction = static_cast<std::uint32_t>(frame) * 128,
                                       .stopping = {0.07, 8}});
        for (std::size_t i = 0; i < 256; ++i) total[i] += traced.weight[i];
        REQUIRE(
            nook::accumulate(nook::ImageView<const double>{traced.visibility.data(), 256, 1, 256},
                             nook::ImageView<const double>{traced.weight.data(), 256, 1, 256},
                             image(mean), image(weight)));
    }
    CHECK(weight == total);
    Mean all;
    for (const double m : mean) all.add(m);
    CHECK(std::fabs(all.off(square.visibility())) < chance);
    // A pixel's numbers change from frame to frame, since its pilots do.
    Mean numbers;
    for (const double w : total) numbers.add(w);
    CHECK(numbers.variance() > 0);
}

TEST_CASE("adaptive directions are the same for any number of threads")
{
    const Bvh bvh = built(boxes());
    const Points points = floor_points(40);
    const Adaptive options{.radius = 2, .directions = 128, .stopping = {0.05, 8}};
    nook::ThreadExecutor one{1}, three{3};
    const Traced alone = trace(bvh, points, options, one),
                 together = trace(bvh, points, options, three);
    CHECK(alone.visibility == together.visibility);
    CHECK(alone.weight == together.weight);
    CHECK(alone.work.rays == together.work.rays);
}

TEST_CASE("bent normals and radiance come from the directions that count")
{
    const Bvh bvh = built(boxes());
    const Points points = floor_points(12);
    using Everything = TracedOptions<nook::ExponentialFalloff, nook::SecondaryRays,
                                     closed_forms::White, AdaptiveDirections>;
    using Fixed = TracedOptions<nook::ExponentialFalloff, nook::SecondaryRays, closed_forms::White>;
    const int count = points.count();
    const auto run = [&](const auto& options) {
        closed_forms::Results<double> results{count, 1};
        REQUIRE(nook::traced_ao(bvh, points.view(),
                                nook::TracedImages{results.visibility.view(), results.bents(),
                                                   results.radiances(), results.weight.view()},
                                options));
        return results;
    };
    const auto fixed = run(Fixed{.radius = 2, .directions = 64, .falloff = {0.7}});
    CHECK(run(Everything{.radius = 2, .directions = 64, .falloff = {0.7}, .stopping = {0}}) ==
          fixed);
    const auto stopped =
        run(Everything{.radius = 2, .directions = 64, .falloff = {0.7}, .stopping = {0.1, 4}});
    int fewer = 0;
    for (int i = 0; i < count; ++i) {
        const double v = stopped.visibility.view()(i, 0);
        CHECK((v >= 0 && v <= 1));
        fewer += stopped.weight.view()(i, 0) < 64;
        // What is white sends what it hides; secondary rays hide without sending.
        CHECK(stopped.radiance.view()(3 * i, 0) <= 1 - v + 1e-12);
    }
    CHECK(fewer > count / 4);
}

TEST_CASE("tolerances and numbers of directions out of range are refused")
{
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity();
    const Bvh bvh = built(boxes());
    const Points points = origins(3);
    const auto refused = [&](const AdaptiveDirections& stopping) {
        std::vector<double> out(3, -7);
        const nook::Outcome done =
            nook::traced_ao(bvh, points.view(), nook::ImageView<double>{out.data(), 3, 1, 3},
                            Adaptive{.radius = 2, .stopping = stopping});
        if (!done) {
            CHECK(out == std::vector<double>(3, -7));
            CHECK(done.error.code == nook::ErrorCode::bad_value);
        }
        return std::string{done.error.argument};
    };
    for (const double tolerance : {nan, -nan, -1e-300, -1.0, infinity, -infinity})
        CHECK(refused({tolerance, 16}) == "options.stopping.tolerance");
    for (const int least : {0, -1, std::numeric_limits<int>::min()})
        CHECK(refused({0.03, least}) == "options.stopping.least");
    CHECK(refused({0, 1}).empty());
}

TEST_CASE("what is left out of the options takes no room")
{
    CHECK(sizeof(Plain) == sizeof(TracedOptions<nook::StepFalloff, nook::NoSecondaryRays,
                                                nook::NoColour, nook::FixedDirections>));
    CHECK(sizeof(Plain) < sizeof(Adaptive));
    CHECK(!Plain::is_adaptive);
}
