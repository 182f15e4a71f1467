#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <nook/surface/bitmask_ao.hpp>
#include <nook/surface/horizon_ao.hpp>

#include "../support/checked.hpp"
#include "stability.hpp"
#include "surface_scenes.hpp"

namespace stability {

namespace {

using namespace surface;

enum class Formula : std::uint8_t { horizons, sectors };

nook::HorizonOptions horizon_options(const Scene& scene) { return {.radius = scene.radius}; }
nook::BitmaskOptions bitmask_options(const Scene& scene) { return {.radius = scene.radius}; }

// --- as shaders have it -------------------------------------------------------------------------------

/// By how much shaders pull a pixel towards the viewer.
constexpr double shader_bias = 1e-5;

/// One slice through a pixel: the direction to the viewer, the angle of the normal, and on each side
/// how its samples are summed up.
template <class T>
class TextbookSlice {
public:
    using Vector = glm::vec<3, T>;

    TextbookSlice(const Vector& viewer, const Vector& normal, T cosine, T sine) : viewer_{viewer}
    {
        const Vector direction{cosine, sine, 0};
        const Vector along = direction - viewer * glm::dot(direction, viewer);
        const Vector axis = glm::normalize(glm::cross(along, viewer));
        const Vector projected = normal - axis * glm::dot(normal, axis);
        length_ = glm::length(projected);
        const T lean = std::clamp(glm::dot(projected, viewer) / length_, T{0}, T{1});
        gamma_ = std::acos(lean) * (glm::dot(along, projected) < 0 ? T{-1} : T{1});
        for (const int side : {0, 1}) horizon_[side] = std::cos(gamma_ + sign(side) * right_angle);
    }
    /// A sample at `to` from the pixel; its far end is `thickness` farther from the viewer.
    void add(int side, const Vector& to, T thickness)
    {
        const T front = glm::dot(glm::normalize(to), viewer_);
        horizon_[side] = std::max(horizon_[side], front);
        const T back = glm::dot(glm::normalize(to - viewer_ * thickness), viewer_);
        const auto part = [&](T elevation) {
            const T angle = sign(side) * std::acos(std::clamp(elevation, T{-1}, T{1}));
            return std::clamp((angle - gamma_ + right_angle) / (2 * right_angle), T{0}, T{1});
        };
        const T first = std::min(part(front), part(back)), last = std::max(part(front), part(back));
        // A comparison that NaN fails: the sectors of it stay open.
        const T count = std::ceil((last - first) * 32);
        if (!(count >= 1)) return;
        const auto run = 0xffffffffu >> (32 - static_cast<unsigned>(count));
        closed_ |= std::uint32_t{run} << std::min(static_cast<unsigned>(first * 32), 31u);
    }
    /// Jimenez et al. 2016, equation 7, times the length of the projection.
    [[nodiscard]] T open_between_horizons() const
    {
        T sum = 0;
        for (const int side : {0, 1}) {
            const T h = sign(side) * std::acos(horizon_[side]);
            sum += (std::cos(gamma_) + 2 * h * std::sin(gamma_) - std::cos(2 * h - gamma_)) / 4;
        }
        return length_ * sum;
    }
    /// Therrien et al. 2023: sectors of equal angles.
    [[nodiscard]] T open_sectors() const { return 1 - T(std::popcount(closed_)) / 32; }

private:
    static constexpr T right_angle = std::numbers::pi_v<T> / 2;
    [[nodiscard]] static T sign(int side) { return side == 0 ? T{1} : T{-1}; }

    Vector viewer_;
    T length_ = 0, gamma_ = 0, horizon_[2] = {};
    std::uint32_t closed_ = 0;
};

/// Positions reconstructed and subtracted in T, from the samples that nook takes.
template <class T>
class Textbook {
public:
    using Vector = glm::vec<3, T>;

    Textbook(const Scene& scene, Formula formula, double bias)
        : scene_{scene},
          formula_{formula},
          bias_{bias},
          settings_{nook::detail::slice_settings(bitmask_options(scene))},
          plane_{columns, rows, scene.radius},
          rule_{plane_, scene.radius, scene.projection, settings_.max_pixels}
    {}
    [[nodiscard]] Image<double> run() const
    {
        Image<double> result{columns, rows, 1};
        for (int y = 0; y < rows; ++y) {
            const nook::detail::SlicePattern pattern{settings_.slices, settings_.steps, y,
                                                     settings_.seed};
            for (int x = 0; x < columns; x += nook::WorkMap::group) {
                nook::detail::SurfaceGroup<float> group{};
                float ignored[nook::WorkMap::group] = {};
                double slopes[nook::WorkMap::group + 1] = {};
                int count = 0;
                for (int i = 0; i < nook::WorkMap::group; ++i)
                    group.distance[i] =
                        static_cast<float>(double{scene_.depth(x + i, y)} * plane_.scale());
                // Number the reaches of the group, and let each pixel look up its own.
                nook::detail::for_each_reach(
                    group, rule_, ignored,
                    [&](const nook::detail::Reach& reach, unsigned, float* numbers) {
                        slopes[++count] = reach.slope;
                        std::fill_n(numbers, nook::WorkMap::group, static_cast<float>(count));
                    });
                for (int i = 0; i < nook::WorkMap::group; ++i)
                    if (const double slope = slopes[static_cast<int>(ignored[i])]; slope > 0)
                        result(x + i, y) = static_cast<double>(shaded(x + i, y, slope, pattern));
            }
        }
        return result;
    }

private:
    [[nodiscard]] Vector position(int x, int y) const
    {
        const auto number = [](double value) { return static_cast<T>(value); };
        const nook::Projection& p = scene_.projection;
        const T z = static_cast<T>(scene_.depth(x, y));
        return {(number(x + 0.5) - number(p.cx)) / number(p.fx) * z,
                (number(p.cy) - number(y + 0.5)) / number(p.fy) * z, -z};
    }
    [[nodiscard]] T shaded(int x, int y, double slope,
                           const nook::detail::SlicePattern& pattern) const
    {
        const nook::detail::SlicePlaces places{{slope * rule_.fx, slope * rule_.fy, slope}, rule_};
        const T radius = static_cast<T>(settings_.radius);
        const T thickness = static_cast<T>(settings_.thickness);
        const Vector pixel = position(x, y) * static_cast<T>(1 - bias_);
        const Vector normal{static_cast<T>(scene_.normals(3 * x, y)),
                            static_cast<T>(scene_.normals(3 * x + 1, y)),
                            static_cast<T>(scene_.normals(3 * x + 2, y))};
        T open = 0;
        for (int k = 0; k < pattern.slices; ++k) {
            TextbookSlice<T> slice{glm::normalize(-pixel), normal,
                                   static_cast<T>(pattern.cosine[k]),
                                   static_cast<T>(pattern.sine[k])};
            for (const int side : {0, 1})
                for (int j = 0; j < pattern.steps; ++j) {
                    const int tap = side * pattern.taps + k * pattern.steps + j;
                    const float away = places.pixels(pattern.distance[tap]);
                    const auto pixels = [&](float part, double size) {
                        return nook::detail::whole_pixels(nook::detail::rounded(away * part),
                                                          static_cast<float>(size));
                    };
                    const int to_x = x + pixels(pattern.right[tap], places.pixel.x);
                    const int to_y = y + pixels(pattern.down[tap], places.pixel.y);
                    if (to_x < 0 || to_x >= columns || to_y < 0 || to_y >= rows) continue;
                    const Vector to = position(to_x, to_y) - pixel;
                    if (!(glm::dot(to, to) > radius * radius)) slice.add(side, to, thickness);
                }
            open += formula_ == Formula::horizons ? slice.open_between_horizons()
                                                  : slice.open_sectors();
        }
        // NaN stays, unlike in most shaders.
        open /= static_cast<T>(pattern.slices);
        return open > 1 ? T{1} : open;
    }

    const Scene& scene_;
    Formula formula_;
    double bias_;
    nook::detail::SliceSettings settings_;
    nook::detail::DepthPlane<float> plane_;
    nook::detail::ReachRule rule_;
};

template <class T>
Image<double> textbook(const Scene& scene, Formula formula, bool biased)
{
    return Textbook<T>{scene, formula, biased ? shader_bias : 0}.run();
}

// --- nook ---------------------------------------------------------------------------------------------

/// By horizon_ao or bitmask_ao, or by its reference.
Image<double> by_nook(const Scene& scene, Formula formula, bool biased, bool reference)
{
    Image<float> fast{columns, rows};
    Image<double> result{columns, rows};
    const auto run = [&](auto options, const auto& kernel, const auto& slow) {
        if (!biased) options.bias = 0;
        const auto depth = scene.depth_source();
        const nook::NormalSource normals = scene.normal_source();
        if (reference) {
            support::checked(slow(depth, normals, result.view(), options, scene.projection),
                             "the reference");
            return;
        }
        support::checked(kernel(depth, normals, fast.view(), options, scene.projection),
                         "the kernel");
        std::copy(fast.begin(), fast.end(), result.begin());
    };
    if (formula == Formula::horizons)
        run(
            horizon_options(scene), [](const auto&... a) { return nook::horizon_ao(a...); },
            [](const auto&... a) { return nook::horizon_ao_reference(a...); });
    else
        run(
            bitmask_options(scene), [](const auto&... a) { return nook::bitmask_ao(a...); },
            [](const auto&... a) { return nook::bitmask_ao_reference(a...); });
    return result;
}

using Visibility = std::function<Image<double>(const Scene&, bool biased)>;
struct Algorithm {
    Label label;
    Visibility run;
    /// What it would be without rounding.
    Visibility exact;
};
std::vector<Algorithm> all_algorithms()
{
    std::vector<Algorithm> algorithms;
    const auto add = [&](Formula formula, const std::string& name, const char* in_float,
                         const char* kernel) {
        const auto in = [formula](const auto& way) {
            return [formula, way](const Scene& scene, bool biased) {
                return way(scene, formula, biased);
            };
        };
        algorithms.push_back(
            {{name + "-float", in_float}, in(textbook<float>), in(textbook<long double>)});
        algorithms.push_back({{name + "-double", "the same in double"},
                              in(textbook<double>),
                              in(textbook<long double>)});
        const auto nook_way = [](bool reference) {
            return [reference](const Scene& scene, Formula formula_of, bool biased) {
                return by_nook(scene, formula_of, biased, reference);
            };
        };
        algorithms.push_back({{name + "-nook", kernel}, in(nook_way(false)), in(nook_way(true))});
    };
    add(Formula::horizons, "horizon",
        "GTAO, 2016: positions and their difference in float, arc cosines",
        "horizon_ao in float, its own bias, against its reference in double");
    add(Formula::sectors, "bitmask", "2023: the same with 32 sectors of equal angles",
        "bitmask_ao in float, against its reference in double");
    return algorithms;
}

}  // namespace

Family surface_slices()
{
    Family family;
    family.label = {"surface-slices",
                    "visibility in slices from depth and normals, beside the same formula and "
                    "samples in long double, or nook's reference; a sector is 1/96"};
    family.metrics = metrics_of_bias();
    const std::vector<Algorithm> algorithms = all_algorithms();
    for (const Algorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const Case& subject : all_cases()) {
        family.cases.push_back(subject.label);
        const Scene scene = subject.make();
        for (const Algorithm& algorithm : algorithms) {
            const Image<double> truth =
                subject.is_flat ? Image<double>{columns, rows, 1} : algorithm.exact(scene, false);
            Row row = row_of_bias(subject, scene, algorithm.label, algorithm.run(scene, false),
                                  algorithm.run(scene, true), truth);
            row.parameters["slices"] = nook::BitmaskOptions{}.slices;
            row.parameters["steps"] = nook::BitmaskOptions{}.steps;
            family.rows.push_back(std::move(row));
        }
    }
    return family;
}

}  // namespace stability
