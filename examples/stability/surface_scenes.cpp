#include "surface_scenes.hpp"

#include <cmath>

#include <nook/depth/hardware_depth.hpp>

namespace stability::surface {

namespace {

/// Of the disc of samples where the picture is as far as the distance of the view.
constexpr double pixels = 12;

/// A camera under whose view `radius` at `distance` covers `pixels`; `aside` is how far the middle of
/// the picture lies off the view axis, as a slope.
nook::Projection view_of(double radius, double distance, double aside)
{
    const double focal = pixels * distance / radius;
    return {.fx = focal, .fy = focal, .cx = columns / 2.0 - aside * focal, .cy = rows / 2.0};
}

/// Distances as a function of the position on the screen, with normals from the function itself.
template <class F>
Scene draw_surface(double radius, const nook::Projection& projection, const F& distance)
{
    Scene scene{projection, radius};
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const auto point = [&](double u, double v) {
                // Relative to the pixel, so that the differences below are exact enough.
                const double here = distance(x + 0.5, y + 0.5), there = distance(u, v);
                const double sx = (u - projection.cx) / projection.fx;
                const double sy = (projection.cy - v) / projection.fy;
                const double dx = (u - x - 0.5) / projection.fx;
                const double dy = (y + 0.5 - v) / projection.fy;
                return nook::ViewPoint{dx * here + sx * (there - here),
                                       dy * here + sy * (there - here), here - there};
            };
            const auto a = point(x + 0.51, y + 0.5), b = point(x + 0.49, y + 0.5);
            const auto c = point(x + 0.5, y + 0.49), d = point(x + 0.5, y + 0.51);
            const double ax = a.x - b.x, ay = a.y - b.y, az = a.z - b.z;
            const double bx = c.x - d.x, by = c.y - d.y, bz = c.z - d.z;
            const double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
            const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
            scene.true_depth(x, y) = distance(x + 0.5, y + 0.5);
            scene.depth(x, y) = static_cast<float>(scene.true_depth(x, y));
            scene.normals(3 * x, y) = static_cast<float>(nx / length);
            scene.normals(3 * x + 1, y) = static_cast<float>(ny / length);
            scene.normals(3 * x + 2, y) = static_cast<float>(nz / length);
        }
    return scene;
}

/// Waves of a third of the radius.
Scene relief(double radius, double distance, double aside = 0)
{
    return draw_surface(radius, view_of(radius, distance, aside), [=](double x, double y) {
        return distance + radius / 3 * std::sin(x * 0.35) * std::cos(y * 0.3);
    });
}
/// A plane whose normal leans by `degrees` from the view axis.
Scene flat(double degrees, double radius, double distance)
{
    const nook::Projection projection = view_of(radius, distance, 0);
    const double slope = std::tan(degrees * 3.14159265358979323846 / 180);
    return draw_surface(radius, projection, [=](double x, double y) {
        const double across = (x - projection.cx) * 0.8 + (y - projection.cy) * 0.6;
        return distance / (1 + slope * across / projection.fx);
    });
}
/// The same through 16 bits of a standard projection from 1 to 1000.
Scene flat_in_16_bits()
{
    Scene scene = flat(60, 1, 10);
    nook::Projection planes = scene.projection;
    planes.encoding = nook::DepthEncoding::standard;
    planes.near_plane = 1;
    planes.far_plane = 1000;
    const nook::HardwareDecode<nook::D16Storage> decode{planes};
    for (float& distance : scene.depth)
        distance = decode(nook::encode_depth<nook::D16Storage>(double{distance}, planes));
    scene.step = nook::depth_step<nook::D16Storage>(planes);
    return scene;
}
Scene silhouette()
{
    Scene scene = relief(0.1, 1);
    for (int y = 0; y < rows; ++y)
        for (int x = columns / 2; x < columns; ++x) {
            scene.depth(x, y) = 1e6f;
            scene.true_depth(x, y) = 1e6;
        }
    return scene;
}

}  // namespace

std::vector<Case> all_cases()
{
    return {
        {{"relief", "waves of radius / 3 at 10 radii"}, false, [] { return relief(0.1, 1); }},
        {{"depth-1e3", "the same at depth 1e3, radius 1"}, false, [] { return relief(1, 1e3); }},
        {{"depth-1e5", "at depth 1e5, radius 1, where an ulp is 0.008"},
         false,
         [] { return relief(1, 1e5); }},
        {{"aside-1e5", "the same, 45 degrees off the view axis: the tile of a large picture"},
         false,
         [] { return relief(1, 1e5, 1); }},
        {{"radius-1e7", "waves, radius 1e7"}, false, [] { return relief(1e7, 1e8); }},
        {{"radius-1e-7", "waves, radius 1e-7"}, false, [] { return relief(1e-7, 1e-6); }},
        {{"radius-1e-9", "waves, radius 1e-9"}, false, [] { return relief(1e-9, 1e-8); }},
        {{"silhouette", "waves at depth 1 beside depth 1e6"}, false, silhouette},
        {{"flat-0", "flat ground that faces the viewer"}, true, [] { return flat(0, 1, 10); }},
        {{"flat-85", "flat ground, tilted by 85 degrees"}, true, [] { return flat(85, 1, 10); }},
        {{"flat-89.9", "tilted by 89.9 degrees"}, true, [] { return flat(89.9, 0.01, 100); }},
        {{"flat-1e5", "tilted by 60 degrees, at depth 1e5 with radius 1"},
         true,
         [] { return flat(60, 1, 1e5); }},
        {{"flat-d16", "at depth 10 with radius 1, through 16 bits from 1 to 1000"},
         true,
         flat_in_16_bits},
    };
}

Worst errors(const Scene& scene, const Image<double>& found, const Image<double>& truth)
{
    Worst worst;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            worst.add(std::fabs(found(x, y) - truth(x, y)), [&] {
                const float* const n = &scene.normals(3 * x, y);
                return joined("pixel (", x, ", ", y, "), depth ", scene.depth(x, y), ", normal (",
                              n[0], ", ", n[1], ", ", n[2], "): ", found(x, y), " for ",
                              truth(x, y));
            });
    return worst;
}

double mean_error(const Image<double>& found, const Image<double>& truth)
{
    double sum = 0;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) sum += std::fabs(found(x, y) - truth(x, y));
    return sum / (columns * rows);
}

std::vector<Label> metrics_of_bias()
{
    return {{"error", "largest error of visibility without bias, of the same float inputs"},
            {"mean", "mean of the same"},
            {"biased", "largest error of visibility with bias"},
            {"darkening", "largest darkening of flat ground without bias"},
            {"biased-darkening", "largest darkening of flat ground with bias"},
            {"nan", "pixels with a NaN, with and without bias"}};
}

Row row_of_bias(const Case& subject, const Scene& scene, const Label& algorithm,
                const Image<double>& plain, const Image<double>& biased, const Image<double>& truth)
{
    const Worst without = errors(scene, plain, truth), with = errors(scene, biased, truth);
    const double nans = without.nans() + with.nans();
    Row row{subject.label.name, algorithm.name, {{"radius", scene.radius}}, {}};
    if (subject.is_flat) row.values = {{}, {}, {}, without.value(), with.value(), nans};
    else row.values = {without.value(), mean_error(plain, truth), with.value(), {}, {}, nans};
    set_worst(row, subject.is_flat ? 3 : 0, without, 5);
    set_worst(row, subject.is_flat ? 4 : 2, with, 5);
    return row;
}

}  // namespace stability::surface
