#include <doctest/doctest.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <nook/depth/encode_depths.hpp>
#include <nook/depth/hardware_depth.hpp>
#include <nook/owned_image.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/surface/half_resolution.hpp>

#include "../../examples/scenes/scenes.hpp"
#include "surface/plan_checks.hpp"

// What planners leave out of the built-in scenes: not one bit of the picture.

namespace {

using nook::Image;
using plan_checks::compared;
using plan_checks::Comparison;

struct View {
    std::string name;
    nook::Projection projection;
    Image<float> depth, normals;
    double radius = 1, diagonal = 1;

    View(const scenes::Scene& scene, const nook::Camera& camera, int width, int height)
        : name{scene.name},
          projection{nook::projection(camera, width, height)},
          depth{width, height},
          normals{3 * width, height},
          radius{scene.radius},
          diagonal{scenes::bounds(scene).diagonal()}
    {
        REQUIRE(nook::rasterise(
            scene.mesh(), nook::view_frame(camera), projection,
            {depth.view(),
             nook::ImageView3<float>::interleaved(normals.data(), width, height, 3 * width),
             {}}));
    }
    [[nodiscard]] nook::ImageView3<const float> normal() const
    {
        return nook::ImageView3<const float>::interleaved(normals.data(), depth.width(),
                                                          depth.height(), 3 * depth.width());
    }
};

/// All built-in scenes through their own cameras, and some under orthography; small and of odd sizes.
const std::vector<View>& views()
{
    static const std::vector<View> all = [] {
        std::vector<View> result;
        for (const scenes::Entry& entry : scenes::all()) {
            const int width = result.size() % 2 == 0 ? 320 : 333, height = width * 9 / 16;
            const scenes::Scene scene = scenes::load(entry.name, double(width) / height);
            result.emplace_back(scene, scene.camera, width, height);
            if (scene.triangles() > 0 && scene.triangles() < 20000)
                result.emplace_back(scene,
                                    scenes::three_quarter_view(scene, double(width) / height, true),
                                    width / 2, height / 2);
        }
        return result;
    }();
    return all;
}

/// One encoding of many, chosen at run time: hardware buffers of every storage, and millimetres.
struct AnyDecode {
    enum Kind { floats, fixed, halves, millimetres } kind = floats;
    nook::HardwareDecode<nook::FloatStorage<float>> of_float{};
    nook::HardwareDecode<nook::D24Storage> of_fixed{};
    nook::HardwareDecode<nook::HalfStorage> of_half{};

    float operator()(std::uint32_t stored) const
    {
        switch (kind) {
        case floats: return of_float(std::bit_cast<float>(stored));
        case fixed: return of_fixed(stored);
        case halves: return of_half(static_cast<std::uint16_t>(stored));
        default: return static_cast<float>(stored) * 1e-3f;
        }
    }
};
struct Encoded {
    std::string name;
    Image<std::uint32_t> stored;
    AnyDecode decode;
    nook::DepthStep step;
    float far_limit;

    [[nodiscard]] auto source() const
    {
        return nook::DepthSource<std::uint32_t, AnyDecode>{stored.view(), decode, step, far_limit};
    }
};

template <class Storage>
Encoded encoded(const View& view, nook::Projection projection, AnyDecode::Kind kind,
                std::string name)
{
    Encoded result{std::move(name), {view.depth.width(), view.depth.height()}, {}, {}, 0};
    result.decode.kind = kind;
    if constexpr (std::is_same_v<Storage, nook::D24Storage>)
        result.decode.of_fixed = nook::HardwareDecode<Storage>{projection};
    else if constexpr (std::is_same_v<Storage, nook::HalfStorage>)
        result.decode.of_half = nook::HardwareDecode<Storage>{projection};
    else result.decode.of_float = nook::HardwareDecode<Storage>{projection};
    Image<typename Storage::Stored> own{view.depth.width(), view.depth.height()};
    REQUIRE(nook::encode_depths<Storage>(view.depth.view(), own.view(), projection));
    for (int y = 0; y < own.height(); ++y)
        for (int x = 0; x < own.width(); ++x)
            if constexpr (std::is_same_v<typename Storage::Stored, float>)
                result.stored(x, y) = std::bit_cast<std::uint32_t>(own(x, y));
            else result.stored(x, y) = own(x, y);
    const auto source = nook::hardware_depth<Storage>(own.view(), projection);
    result.step = source.step;
    result.far_limit = source.far_limit;
    return result;
}

/// The view in every encoding.
std::vector<Encoded> encodings(const View& view)
{
    using nook::DepthEncoding;
    nook::Projection projection = view.projection;
    // The empty view has no size.
    const double size = view.diagonal > 0 ? view.diagonal : 1;
    projection.near_plane = size * 1e-3;
    projection.far_plane = size * 4;
    const auto with = [&](DepthEncoding encoding) {
        nook::Projection result = projection;
        result.encoding = encoding;
        return result;
    };
    std::vector<Encoded> result;
    result.push_back(encoded<nook::FloatStorage<float>>(view, with(DepthEncoding::reversed),
                                                        AnyDecode::floats, "reversed float"));
    result.push_back(encoded<nook::FloatStorage<float>>(view, with(DepthEncoding::standard),
                                                        AnyDecode::floats, "standard float"));
    result.push_back(encoded<nook::FloatStorage<float>>(view, with(DepthEncoding::opengl),
                                                        AnyDecode::floats, "OpenGL float"));
    result.push_back(encoded<nook::D24Storage>(view, with(DepthEncoding::standard),
                                               AnyDecode::fixed, "standard D24"));
    result.push_back(encoded<nook::D24Storage>(view, with(DepthEncoding::reversed),
                                               AnyDecode::fixed, "reversed D24"));
    result.push_back(encoded<nook::D24Storage>(view, with(DepthEncoding::logarithmic),
                                               AnyDecode::fixed, "logarithmic D24"));
    result.push_back(
        encoded<nook::HalfStorage>(view, with(DepthEncoding::linear), AnyDecode::halves, "halves"));
    Encoded millimetres{"millimetres",
                        {view.depth.width(), view.depth.height()},
                        {AnyDecode::millimetres},
                        {.constant = 1e-3},
                        65.5f};
    for (int y = 0; y < view.depth.height(); ++y)
        for (int x = 0; x < view.depth.width(); ++x) {
            const float distance = view.depth(x, y);
            millimetres.stored(x, y) =
                distance > 0 && distance < 65 ? static_cast<std::uint32_t>(distance * 1e3f) : 0u;
        }
    result.push_back(millimetres);
    return result;
}

constexpr int kernel_count = 8;
template <class Use>
void with_kernel(int kernel, double radius, const Use& use)
{
    nook::AlchemyOptions alchemy{.radius = radius};
    switch (kernel) {
    case 1: alchemy.falloff = nook::AlchemyFalloff::scalable; break;
    case 3: alchemy.falloff = nook::AlchemyFalloff::scalable; [[fallthrough]];
    case 2: alchemy.pattern = nook::SamplePattern::pixel; break;
    case 4: return use(nook::HorizonOptions{.radius = radius});
    case 5: return use(nook::HorizonOptions{.radius = radius, .thickness = radius / 4});
    case 6: return use(nook::BitmaskOptions{.radius = radius});
    case 7:
        return use(nook::BitmaskOptions{.radius = radius, .thickness = 2 * radius, .bias = 1e-3});
    default: break;
    }
    use(alchemy);
}

void check_exact(const Comparison& result)
{
    CAPTURE(result.where);
    CHECK(result.ran);
    CHECK(result.changed == 0);
    CHECK(result.counts_agree);
}

}  // namespace

TEST_SUITE("plans of built-in scenes")
{
    TEST_CASE("an exact plan changes no bit, whatever the scene, the kernel and the radius")
    {
        constexpr double other_radii[] = {0.01, 0.05, 1e-4, 3e-3, 20};
        int turn = 0;
        for (const View& view : views())
            for (int kernel = 0; kernel < kernel_count; ++kernel)
                // The scene's own radius with every kernel, another one in turn.
                for (const double radius :
                     {view.radius,
                      view.diagonal *
                          other_radii[static_cast<std::size_t>(turn) % std::size(other_radii)]}) {
                    with_kernel(kernel, radius, [&](const auto& options) {
                        CAPTURE(view.name);
                        CAPTURE(view.projection.orthographic);
                        CAPTURE(kernel);
                        CAPTURE(radius);
                        check_exact(compared(view.depth.view(), view.normal(), options,
                                             view.projection, 0, turn++));
                    });
                }
    }

    TEST_CASE("an exact plan changes no bit, whatever the encoding of the depths")
    {
        int turn = 0;
        for (const View& view : views())
            for (const Encoded& encoded : encodings(view)) {
                const int kernel = turn++ % kernel_count;
                with_kernel(kernel, view.radius, [&](const auto& options) {
                    CAPTURE(view.name);
                    CAPTURE(encoded.name);
                    CAPTURE(kernel);
                    check_exact(compared(encoded.source(), view.normal(), options, view.projection,
                                         0, turn));
                });
            }
    }

    TEST_CASE("an exact plan changes no bit of double depths and at half size")
    {
        int turn = 0;
        for (const View& view : views()) {
            Image<double> distances{view.depth.width(), view.depth.height()};
            for (int y = 0; y < distances.height(); ++y)
                for (int x = 0; x < distances.width(); ++x)
                    distances(x, y) = double{view.depth(x, y)};
            CAPTURE(view.name);
            with_kernel(turn++ % kernel_count, view.radius, [&](const auto& options) {
                check_exact(compared(distances.view(), view.normal(), options, view.projection));
                check_exact(compared(nook::half_view(view.depth.view()),
                                     nook::half_view(view.normal()), options,
                                     nook::half_projection(view.projection)));
            });
        }
    }

    TEST_CASE("a tolerant plan lets no pixel rise by more than its tolerance")
    {
        for (const View& view : views())
            for (const int kernel : {0, 1, 2, 4, 5, 6})
                for (const double tolerance : {1e-3, 0.02}) {
                    with_kernel(kernel, view.radius, [&](const auto& options) {
                        const Comparison result = compared(view.depth.view(), view.normal(),
                                                           options, view.projection, tolerance);
                        CAPTURE(view.name);
                        CAPTURE(kernel);
                        CAPTURE(tolerance);
                        CAPTURE(result.where);
                        CHECK(result.ran);
                        CHECK(result.counts_agree);
                        CHECK(result.rise <= tolerance);
                        CHECK(result.fall == 0);
                    });
                }
    }

    TEST_CASE("the floor and the empty view need no work, other scenes less than all of it")
    {
        for (const View& view : views())
            for (const int kernel : {0, 4, 6})
                with_kernel(kernel, view.diagonal * 0.01, [&](const auto& options) {
                    const Comparison result =
                        compared(view.depth.view(), view.normal(), options, view.projection);
                    CAPTURE(view.name);
                    CAPTURE(kernel);
                    if (view.name == "empty") CHECK(result.active == 0);
                    if (view.name == "floor" && !view.projection.orthographic)
                        CHECK(result.active == 0);
                    if (view.name == "boxes" || view.name == "stairs") {
                        CHECK(result.active_share() > 0.05);
                        CHECK(result.active_share() < 0.9);
                    }
                });
    }
}
