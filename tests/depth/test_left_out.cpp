#include <cmath>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>

#include <nook/depth/chebyshev_ao.hpp>
#include <nook/depth/flat_cells.hpp>
#include <nook/owned_image.hpp>

#include "pictures.hpp"

// What chebyshev_ao leaves out must not show in its results. Rows behind a decoder are never searched
// for flat cells, so a decoder that does nothing gives the full computation.

namespace {

using nook::Image;
using pictures::Call;
using pictures::Random;

struct Same {
    template <class Distance>
    Distance operator()(Distance distance) const
    {
        return distance;
    }
};

/// Any task order, any number of workers.
struct Backwards {
    int workers;
    [[nodiscard]] int concurrency() const { return workers; }
    template <class F>
    void for_each(int count, F&& f) const
    {
        for (int task = count - 1; task >= 0; --task) f(task, task % workers);
    }
};

template <class Distance>
struct Shaded {
    Image<Distance> visibility;
    nook::Work work;
};
template <class Distance, class Depth>
Shaded<Distance> shade(const Depth& depth, int width, int height, const Call& call,
                       const nook::WorkMap& map = {}, int workers = 1)
{
    Shaded<Distance> result{{width, height, Distance{-1}}, {}};
    const auto done =
        nook::chebyshev_ao(depth, result.visibility.view(), call.options, call.projection, map,
                           nook::HeapScratch{}, Backwards{workers});
    REQUIRE(done);
    result.work = done.work;
    return result;
}

/// Planes in perspective, whole or in patches, and what may go wrong with a pixel of them.
template <class Distance>
Image<Distance> picture(Random& random, int width, int height)
{
    const double near_by = std::exp(6 * random.uniform() - 3);
    const double across = (random.uniform() - 0.5) * 2e-3, down = random.uniform() * 4e-3;
    const int kind = random.below(4);
    auto image = pictures::make<Distance>({width, height}, [&](int x, int y) {
        const double w = (1 + across * x + down * y) / near_by;
        if (kind == 0) return near_by;
        if (kind == 1 && (x / 90 + y / 70) % 2 == 1) return 1 / (w * 1.2);
        return 1 / w;
    });
    const auto at = [&]() -> Distance& { return image(random.below(width), random.below(height)); };
    for (int i = random.below(5); i > 0; --i) {
        Distance& pixel = at();
        switch (random.below(8)) {
        case 0: pixel = std::nextafter(pixel, Distance(1e30)); break;
        case 1: pixel = std::nextafter(pixel, Distance(0)); break;
        case 2: pixel *= Distance(1 + 1e-4 * random.uniform()); break;
        case 3: pixel = pictures::not_a_number<Distance>; break;
        case 4: pixel = pictures::infinity<Distance>; break;
        case 5: pixel = 0; break;
        case 6: pixel = Distance(1e30); break;
        default: pixel = -pixel; break;
        }
    }
    if (random.chance(0.3))
        for (int y = random.below(height); y >= 0; --y)
            for (int x = 0; x < width; ++x) image(x, y) = pictures::infinity<Distance>;
    return image;
}

Call any_call(Random& random)
{
    static constexpr int windows[] = {1, 3, 5, 15, 31, 31, 63, 127};
    Call call{};
    call.options.window = windows[random.below(8)];
    call.options.clamp = random.chance(0.85);
    if (random.chance(0.3)) call.options.bias = 0;
    if (random.chance(0.2)) call.options.range = 0.1;
    if (random.chance(0.3)) call.options.border = nook::Border::clip;
    if (random.chance(0.5)) {
        call.options.radius = 0.1 * random.uniform();
        call.options.max_window = 63;
        call.projection = {.fx = 400, .fy = 400};
    }
    return call;
}

template <class Distance>
void compare_with_all(std::uint64_t seed)
{
    CAPTURE(seed);
    Random random{seed};
    const int width = 60 + random.below(400), height = 40 + random.below(160);
    const auto depth = picture<Distance>(random, width, height);
    const Call call = any_call(random);
    const nook::ImageView<const Distance> view = depth.view();
    const auto fast = shade<Distance>(view, width, height, call, {}, 1 + random.below(3));
    const auto all = shade<Distance>(nook::DepthSource{view, Same{}}, width, height, call);
    CHECK(pictures::same_bits(fast.visibility, all.visibility));
    CHECK(fast.work.background == all.work.background);
    CHECK(fast.work.samples == all.work.samples);

    // With a map, active pixels keep their bits.
    Image<std::uint8_t> active{nook::WorkMap::groups(width), height, std::uint8_t{0}};
    for (int i = random.below(4); i > 0; --i) {
        const int x = random.below(active.width()), y = random.below(height);
        for (int row = y; row < height && row < y + 30; ++row)
            for (int group = x; group < active.width() && group < x + 3; ++group)
                active(group, row) = 1;
    }
    const nook::WorkMap map{active.view()};
    const auto some = shade<Distance>(view, width, height, call, map, 1 + random.below(3));
    bool same = true;
    std::uint64_t background = 0, skipped = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool on = map.is_active(x, y), surface = pictures::is_surface(depth(x, y));
            const Distance expected = on ? all.visibility(x, y) : Distance{1};
            same = same && pictures::same_bits(some.visibility(x, y), expected);
            background += !surface;
            skipped += surface && !on;
        }
    CHECK(same);
    CHECK(some.work.background == background);
    // And what the kernel proves open by itself.
    CHECK(some.work.skipped >= skipped);
    CHECK(some.work.skipped + background <= some.work.pixels);
}

}  // namespace

TEST_CASE("what is left out does not show: fuzzed planes, windows, borders, radii, maps, workers")
{
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        compare_with_all<float>(seed);
        if (seed % 3 == 0) compare_with_all<double>(seed);
    }
}

TEST_CASE("a pixel pushed behind its plane by any amount keeps its shade")
{
    const int width = 260, height = 150;
    auto depth = pictures::make<float>({width, height},
                                       [](int x, int y) { return 1 / (1 + 2e-4 * x + 1e-3 * y); });
    const nook::ImageView<const float> view = depth.view();
    Call radius = pictures::fixed(1);
    radius.options.radius = 0.02;
    radius.projection = {.fx = 600, .fy = 600};
    float& pixel = depth(130, 75);
    const float before = pixel;
    int shaded = 0;
    for (const Call& call : {pictures::fixed(31), pictures::fixed(63), radius})
        for (int step = 0; step <= 40; ++step) {
            CAPTURE(step);
            pixel = before * (1 + 0x1p-17f * std::exp2(0.2f * static_cast<float>(step)));
            const auto fast = shade<float>(view, width, height, call);
            const auto all = shade<float>(nook::DepthSource{view, Same{}}, width, height, call);
            CHECK(pictures::same_bits(fast.visibility, all.visibility));
            shaded += all.visibility(130, 75) < 1;
        }
    pixel = before;
    CHECK(shaded > 30);
    CHECK(shaded < 110);
}

TEST_CASE("an image without anything to do takes no pass")
{
    const int width = 200, height = 90;
    const auto depth =
        pictures::make<float>({width, height}, [](int x, int y) { return 1 + x % 7 + y % 5; });
    const auto sky =
        pictures::make<float>({width, height}, [](int, int) { return pictures::infinity<float>; });
    const Image<std::uint8_t> none{nook::WorkMap::groups(width), height, std::uint8_t{0}};
    for (const Call& call : {pictures::fixed(31), pictures::fixed(1), pictures::variable(15)}) {
        const auto spared = shade<float>(depth.view(), width, height, call, {none.view()});
        CHECK(pictures::all_equal(spared.visibility, 1.0f));
        CHECK(spared.work.skipped == 200 * 90);
        CHECK(spared.work.background == 0);
        CHECK(spared.work.passes == 0);
        CHECK(spared.work.skipped_passes == 1);

        const auto empty = shade<float>(sky.view(), width, height, call);
        CHECK(pictures::all_equal(empty.visibility, 1.0f));
        CHECK(empty.work.background == 200 * 90);
        CHECK(empty.work.skipped == 0);
        CHECK(empty.work.passes == 0);
        CHECK(empty.work.skipped_passes == 1);

        const auto all = shade<float>(depth.view(), width, height, call);
        CHECK(all.work.passes == 1);
        CHECK(all.work.skipped_passes == 0);
    }
    const auto wall = pictures::make<float>({width, height}, [](int, int) { return 2; });
    CHECK(shade<float>(wall.view(), width, height, pictures::fixed(31)).work.skipped > 100 * 90);
}

TEST_CASE("a plane in perspective is proved open; one bent pixel takes back the cells that see it")
{
    constexpr int lanes = nook::detail::float_lanes, width = 320, height = 100, radius = 15;
    auto depth = pictures::make<float>({width, height},
                                       [](int x, int y) { return 1 / (1 + 1e-4 * x + 1e-3 * y); });
    using Source = decltype(nook::depth_source(depth.view()));
    REQUIRE(nook::detail::FlatCells<Source, lanes>::possible);
    const auto cell = [](int i) { return nook::detail::Span{i * 32, i * 32 + 31}; };
    const auto search = [&](bool constant_alone) {
        std::vector<float> worst(width);
        std::vector<std::uint8_t> open(10, 1);
        const Source source = nook::depth_source(depth.view());
        const nook::detail::FlatCells<Source, lanes> flat{
            source,         {30, 61},    {radius, radius, radius, radius}, nook::Border::symmetric,
            constant_alone, worst.data()};
        static_cast<void>(flat.find(cell, 10, 1, open.data()));
        return open;
    };
    CHECK(search(false) == std::vector<std::uint8_t>(10, 1));
    CHECK(search(true) == std::vector<std::uint8_t>(10, 0));
    // A window is symmetric about its pixel: what bends it lies within 15 pixels of the cell.
    const auto with = [&](int x, int y, float value) {
        const float before = depth(x, y);
        depth(x, y) = value;
        const auto open = search(false);
        depth(x, y) = before;
        return open;
    };
    for (const float value : {depth(143, 76) * 1.001f, depth(143, 76) * 0.999f,
                              pictures::infinity<float>, pictures::not_a_number<float>, 0.0f}) {
        CHECK(with(143, 76, value) == std::vector<std::uint8_t>{1, 1, 1, 1, 0, 1, 1, 1, 1, 1});
        CHECK(with(145, 15, value) == std::vector<std::uint8_t>{1, 1, 1, 1, 0, 0, 1, 1, 1, 1});
        CHECK(with(143, 77, value) == std::vector<std::uint8_t>(10, 1));
        CHECK(with(143, 14, value) == std::vector<std::uint8_t>(10, 1));
    }
    CHECK(with(143, 50, std::nextafter(depth(143, 50), 2.0f)) == std::vector<std::uint8_t>(10, 1));

    // Linear distances bend nothing; one distance alone needs no bend.
    for (float& distance : depth) distance = 3;
    CHECK(search(true) == std::vector<std::uint8_t>(10, 1));
    CHECK(with(143, 50, std::nextafter(3.0f, 4.0f))[4] == 0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) depth(x, y) = 1 + 1e-3f * static_cast<float>(x + y);
    CHECK(search(false) == std::vector<std::uint8_t>(10, 0));
}
