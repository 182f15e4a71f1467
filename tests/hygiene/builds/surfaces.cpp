// What the kernels over depth and normals promise, checked under whatever flags this is compiled with. It
// needs no exceptions and no RTTI, and NaN and infinity come from bits that no compiler can follow.
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include <nook/owned_image.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/bilateral.hpp>
#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/half_resolution.hpp>
#include <nook/surface/height_field_ao.hpp>
#include <nook/surface/horizon_ao.hpp>
#include <nook/surface/normals_from_depth.hpp>
#include <nook/surface/upsample.hpp>

namespace {

using nook::Image;

constexpr int width = 83, height = 45;
constexpr nook::Projection projection{.fx = 60, .fy = 55, .cx = 40, .cy = 23};

int failures = 0;

void check(bool fact, const char* what, const char* kernel)
{
    if (fact) return;
    ++failures;
    std::printf("%s: not true that %s\n", kernel, what);
}

float from_bits(std::uint32_t bits)
{
    volatile std::uint32_t hidden = bits;
    const std::uint32_t seen = hidden;
    return std::bit_cast<float>(seen);
}
/// In [0, 1], judged by bits.
bool in_range(float value) { return std::bit_cast<std::uint32_t>(value) <= 0x3f800000u; }
bool is_one(float value) { return std::bit_cast<std::uint32_t>(value) == 0x3f800000u; }

std::uint32_t scattered(int x, int y)
{
    std::uint32_t z = static_cast<std::uint32_t>(y * 1000 + x + 1) * 0x9e3779b9u;
    z = (z ^ z >> 15) * 0x85ebca6bu;
    return z ^ z >> 13;
}

struct Scene {
    Image<float> depth{width, height};
    Image<float> normals{3 * width, height};

    [[nodiscard]] nook::ImageView3<float> normal()
    {
        return nook::ImageView3<float>::interleaved(normals.data(), width, height, 3 * width);
    }
};

/// The plane through (0, 0, −4) with a normal in proportion to (0.3, 0.5, 1).
Scene plane()
{
    Scene scene;
    constexpr double nx = 0.3, ny = 0.5, nz = 1, length = 1.1575836902790225;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double sx = (x + 0.5 - projection.cx) / projection.fx;
            const double sy = (projection.cy - y - 0.5) / projection.fy;
            scene.depth(x, y) = static_cast<float>(4 * nz / (nz - nx * sx - ny * sy));
            scene.normal().x(x, y) = static_cast<float>(nx / length);
            scene.normal().y(x, y) = static_cast<float>(ny / length);
            scene.normal().z(x, y) = static_cast<float>(nz / length);
        }
    return scene;
}

/// Blocks at several distances, with all that a buffer should not hold among them.
Scene poisoned()
{
    Scene scene = plane();
    const float odd[] = {from_bits(0x7fc00000),
                         from_bits(0x7f800000),
                         from_bits(0xff800000),
                         from_bits(0x00000001),
                         from_bits(0x7f7fffff),
                         0.0f,
                         -3.0f,
                         1e-30f,
                         1e30f};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            scene.depth(x, y) += static_cast<float>((x / 9 + y / 7) % 4) * 0.2f;
            const std::uint32_t at = scattered(x, y);
            if (at % 13 == 0) scene.depth(x, y) = odd[at / 13 % 9];
            if (at % 17 == 0) scene.normal().y(x, y) = odd[at / 17 % 9];
            if (at % 29 == 0)
                scene.normal().x(x, y) = scene.normal().y(x, y) = scene.normal().z(x, y) = 0;
        }
    return scene;
}

/// Runs tasks in either order. One type for both: under -ffast-math every instantiation of a kernel may be
/// rounded in its own way.
struct Tasks {
    int workers;
    bool backwards;

    [[nodiscard]] int concurrency() const { return workers; }
    template <class Function>
    void for_each(int count, Function&& function) const
    {
        for (int i = 0; i < count; ++i) {
            const int task = backwards ? count - 1 - i : i;
            function(task, task % workers);
        }
    }
};
constexpr Tasks alone{1, false}, three{3, true};

/// run(scene, visibility, work map, executor) is one kernel.
template <class Run>
void hold(const char* name, const Run& run)
{
    Scene flat = plane(), bad = poisoned();
    Image<float> out{width, height, -1.0f};
    check(bool{run(flat, out.view(), nook::WorkMap{}, alone)}, "it succeeds", name);
    bool open = true;
    for (const float value : out) open = open && is_one(value);
    check(open, "a tilted plane is exactly 1", name);

    check(bool{run(bad, out.view(), nook::WorkMap{}, alone)}, "it succeeds", name);
    bool fine = true, dark = false;
    for (const float value : out) {
        fine = fine && in_range(value);
        dark = dark || value < 0.9f;
    }
    check(fine, "values lie in [0, 1]", name);
    check(dark, "steps shade", name);

    Image<float> other{width, height, -1.0f};
    check(bool{run(bad, other.view(), nook::WorkMap{}, three)}, "it succeeds", name);
    check(std::memcmp(out.data(), other.data(), sizeof(float) * width * height) == 0,
          "the executor changes no bit", name);

    Image<std::uint8_t> groups{nook::WorkMap::groups(width), height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < groups.width(); ++x) groups(x, y) = scattered(x, y) % 3 == 0 ? 1 : 0;
    const nook::WorkMap map{groups.view(), false};
    check(bool{run(bad, other.view(), map, alone)}, "it succeeds", name);
    bool same = true;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            same = same && (map.is_active(x, y) ? std::bit_cast<std::uint32_t>(other(x, y)) ==
                                                      std::bit_cast<std::uint32_t>(out(x, y))
                                                : is_one(other(x, y)));
    check(same, "a work map changes no active bit", name);
}

void blur_and_upsample_keep_constants()
{
    Scene bad = poisoned();
    const nook::NormalSource normals = bad.normal();
    Image<float> constant{width, height, 0.3f}, out{width, height};
    check(bool{nook::bilateral_blur(constant.view(), bad.depth.view(), normals, out.view(), {},
                                    projection)},
          "it succeeds", "bilateral_blur");
    bool kept = true;
    for (const float value : out) kept = kept && (value == 0.3f || is_one(value));
    check(kept, "a constant stays what it is", "bilateral_blur");
    Image<float> half{(width + 1) / 2, (height + 1) / 2, 0.3f};
    check(bool{nook::upsample(half.view(), bad.depth.view(), normals, out.view(), {}, projection)},
          "it succeeds", "upsample");
    kept = true;
    for (const float value : out) kept = kept && (value == 0.3f || is_one(value));
    check(kept, "a constant stays what it is", "upsample");
    check(bool{nook::normals_from_depth(bad.depth.view(), bad.normal(), projection)}, "it succeeds",
          "normals_from_depth");
    kept = true;
    for (const float value : bad.normals)
        kept = kept && (std::bit_cast<std::uint32_t>(value) & 0x7fffffff) <= 0x3f800001u;
    check(kept, "normals are of unit length or zero", "normals_from_depth");
}

}  // namespace

int main()
{
    hold("alchemy_ao", [](Scene& scene, const auto& out, const nook::WorkMap& map, auto executor) {
        return nook::alchemy_ao(scene.depth.view(), scene.normal(), out, {.radius = 0.6},
                                projection, map, nook::HeapScratch{}, executor);
    });
    hold("alchemy_ao, scalable, by pixel",
         [](Scene& scene, const auto& out, const nook::WorkMap& map, auto executor) {
             return nook::alchemy_ao(scene.depth.view(), scene.normal(), out,
                                     {.radius = 0.6,
                                      .falloff = nook::AlchemyFalloff::scalable,
                                      .pattern = nook::SamplePattern::pixel},
                                     projection, map, nook::HeapScratch{}, executor);
         });
    hold("horizon_ao", [](Scene& scene, const auto& out, const nook::WorkMap& map, auto executor) {
        return nook::horizon_ao(scene.depth.view(), scene.normal(), out, {.radius = 0.6},
                                projection, map, nook::HeapScratch{}, executor);
    });
    hold("bitmask_ao", [](Scene& scene, const auto& out, const nook::WorkMap& map, auto executor) {
        return nook::bitmask_ao(scene.depth.view(), scene.normal(), out, {.radius = 0.6},
                                projection, map, nook::HeapScratch{}, executor);
    });
    hold("height_field_ao",
         [](Scene& scene, const auto& out, const nook::WorkMap& map, auto executor) {
             return nook::height_field_ao(scene.depth.view(), scene.normal(), out,
                                          {.radius = 0.6, .slices = 8}, projection, map,
                                          nook::HeapScratch{}, executor);
         });
    blur_and_upsample_keep_constants();
    return failures;
}
