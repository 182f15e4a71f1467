#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <nook/surface/bilateral.hpp>

namespace nook::inline NOOK_TARGET {

/// `bilateral_blur` pixel by pixel in double, from positions in view space: the same windows and
/// weights, (2 radius + 1)² of them per pixel. Needs no scratch. `normals` may be null.
template <class In, DepthInput Depth, class Out, Executor E = Serial>
Outcome bilateral_blur_reference(const ImageView<In>& visibility, const Depth& depth,
                                 const NormalSource* normals, const ImageView<Out>& blurred,
                                 const BlurOptions& options, const Projection& projection,
                                 const WorkMap& work_map = {}, E&& executor = E{});

namespace detail {

/// The slope of f at 0 along stretches of three of −2 … 2 that are straight: as `screen_slope`. f is 0
/// where it is missing; `tolerance` is the second difference from which a stretch does not count.
template <class Function>
[[nodiscard]] double straight_slope(const Function& f, double tolerance)
{
    double weights = 0, slopes = 0;
    for (int first = -2; first <= 0; ++first) {
        const double a = f(first), b = f(first + 1), c = f(first + 2);
        if (!(a > 0 && b > 0 && c > 0)) continue;
        const double bent = (a - 2 * b + c) / tolerance;
        const double weight = (std::max)(1 - bent * bent, 0.0);
        weights += weight;
        slopes += weight * (c - a) / 2;
    }
    return slopes / (std::max)(weights, 0.25);
}

/// The blur as its definition reads.
template <class Real, class Source, class In>
struct PlainBlur {
    const ImageView<In>& visibility;
    const Source& source;
    const NormalSource* normals;
    const BlurOptions& options;
    const Projection& projection;
    const WorkMap& map;
    EdgeRule<double> rule{options.tolerance, options.length, options.least_cosine,
                          source.step,       options.radius, projection};

    /// 0 for background and beyond the image.
    [[nodiscard]] double distance(int x, int y) const
    {
        if (x < 0 || y < 0 || x >= visibility.width || y >= visibility.height) return 0;
        const double d = surface_distance(source, x, y);
        using Range = GuideRange<Real>;
        return d > 0 ? std::clamp(d, double{Range::nearest}, double{Range::farthest}) : 0;
    }
    [[nodiscard]] Normal normal(int x, int y) const { return unit_normal(*normals, x, y); }
    /// May the pixel enter windows?
    [[nodiscard]] bool enters(int x, int y) const
    {
        if (!(distance(x, y) > 0)) return false;
        if (!is_usable(static_cast<Real>(visibility(x, y)))) return false;
        if (!map.exact && !map.is_active(x, y)) return false;
        if (normals == nullptr) return true;
        const Normal n = normal(x, y);
        return n.x != 0 || n.y != 0 || n.z != 0;
    }
    /// How far the pixel `i` steps along (right, down) lies from the tangent plane, over what is allowed.
    [[nodiscard]] double deviation(int x, int y, int right, int down, int i) const
    {
        const double d = distance(x, y), q = distance(x + i * right, y + i * down);
        const double allowed = rule.allowed(d);
        if (normals != nullptr) {
            const Normal n = normal(x, y);
            const ViewPoint p = view_point(projection, x + 0.5, y + 0.5, d);
            const ViewPoint t = view_point(projection, x + i * right + 0.5, y + i * down + 0.5, q);
            return (n.x * (t.x - p.x) + n.y * (t.y - p.y) + n.z * (t.z - p.z)) / allowed;
        }
        const auto along = [&](int j) { return distance(x + j * right, y + j * down); };
        if (projection.orthographic)
            return (q - (d + i * straight_slope(along, allowed / 4))) / allowed;
        const auto inverse = [&](int j) {
            const double z = along(j);
            return z > 0 ? 1 / z : 0;
        };
        const double slope = straight_slope(inverse, allowed / 4 / (d * d));
        return d * (q * (1 / d + i * slope) - 1) / allowed;
    }
    [[nodiscard]] double weight(int x, int y, int right, int down, int i) const
    {
        const int to_x = x + i * right, to_y = y + i * down;
        if (!enters(to_x, to_y)) return 0;
        const double sigma = options.sigma.value_or((options.radius + 1) / 2.0);
        const double e = i == 0 ? 0 : deviation(x, y, right, down, i);
        double result = std::exp(-0.5 * (i / sigma) * (i / sigma)) * (std::max)(1 - e * e, 0.0);
        if (normals != nullptr && i != 0) {
            const Normal a = normal(x, y), b = normal(to_x, to_y);
            const double cosine = a.x * b.x + a.y * b.y + a.z * b.z;
            result *=
                std::clamp((cosine - options.least_cosine) / (1 - options.least_cosine), 0.0, 1.0);
        }
        return result;
    }
    template <class Value>
    [[nodiscard]] double mean(int x, int y, int right, int down, const Value& value) const
    {
        double sum = 0, weights = 0;
        for (int i = -options.radius; i <= options.radius; ++i) {
            const double share = weight(x, y, right, down, i);
            weights += share;
            if (share > 0) sum += share * value(x + i * right, y + i * down);
        }
        return sum / weights;
    }
    [[nodiscard]] double operator()(int x, int y) const
    {
        if (!map.is_active(x, y) || !enters(x, y)) return 1;
        const auto own = [&](int i, int j) { return double{visibility(i, j)}; };
        const auto row = [&](int i, int j) { return mean(i, j, 1, 0, own); };
        return mean(x, y, 0, 1, row);
    }
};

}  // namespace detail

template <class In, DepthInput Depth, class Out, Executor E>
Outcome bilateral_blur_reference(const ImageView<In>& visibility, const Depth& depth,
                                 const NormalSource* normals, const ImageView<Out>& blurred,
                                 const BlurOptions& options, const Projection& projection,
                                 const WorkMap& work_map, E&& executor)
{
    const auto& source = depth_source(depth);
    if (const Error error =
            detail::check_blur(visibility, source, normals, blurred, options, projection, work_map))
        return {error};
    if (blurred.empty()) return {};
    using Source = std::remove_cvref_t<decltype(source)>;
    const detail::PlainBlur<detail::guide_real<In, Depth, Out>, Source, In> plain{
        visibility, source, normals, options, projection, work_map};
    // Counted apart, so that the tasks share nothing.
    Outcome outcome{};
    for (int y = 0; y < blurred.height; ++y)
        for (int x = 0; x < blurred.width; ++x) {
            const bool active = work_map.is_active(x, y), surface = plain.distance(x, y) > 0;
            bool usable = surface;
            if (surface && active && normals != nullptr) {
                const detail::Normal n = plain.normal(x, y);
                usable = n.x != 0 || n.y != 0 || n.z != 0;
            }
            if (!usable) ++outcome.work.background;
            else if (!active) ++outcome.work.skipped;
        }
    executor.for_each(blurred.height, [&](int y, int) {
        for (int x = 0; x < blurred.width; ++x) blurred(x, y) = static_cast<Out>(plain(x, y));
    });
    outcome.work.pixels =
        static_cast<std::uint64_t>(blurred.width) * static_cast<std::uint64_t>(blurred.height);
    outcome.work.passes = 1;
    return outcome;
}

}  // namespace nook::inline NOOK_TARGET
