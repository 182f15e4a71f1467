#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include <nook/depth/projection.hpp>
#include <nook/depth/source.hpp>
#include <nook/image.hpp>
#include <nook/owned_image.hpp>
#include <nook/surface/normal_source.hpp>

#include "stability.hpp"
#include "worst.hpp"

/// What the families of kernels over depth and normals have in common.
namespace stability::surface {

using nook::Image;

constexpr int columns = 64, rows = 48;

/// What a kernel is given.
struct Scene {
    nook::Projection projection;
    double radius;
    Image<float> depth{columns, rows};
    Image<float> normals{3 * columns, rows};
    /// The depths before they were stored.
    Image<double> true_depth{columns, rows};
    /// How far apart the depths lie that the buffer can hold.
    nook::DepthStep step{.linear = std::numeric_limits<float>::epsilon()};

    [[nodiscard]] auto depth_source() const
    {
        return nook::DepthSource{depth.view(), nook::IdentityDecode{}, step};
    }
    [[nodiscard]] nook::NormalSource normal_source() const
    {
        return nook::ImageView3<const float>::interleaved(normals.data(), columns, rows,
                                                          std::ptrdiff_t{3} * columns);
    }
};

struct Case {
    Label label;
    bool is_flat;
    std::function<Scene()> make;
};
/// Waves far away, of all sizes and beside a silhouette; flat ground of all tilts.
[[nodiscard]] std::vector<Case> all_cases();

/// Differences of all pixels.
[[nodiscard]] Worst errors(const Scene& scene, const Image<double>& found,
                           const Image<double>& truth);
[[nodiscard]] double mean_error(const Image<double>& found, const Image<double>& truth);

/// What is measured of kernels that take a bias, and the row of one: its visibility without bias and
/// with it, and what is true without.
[[nodiscard]] std::vector<Label> metrics_of_bias();
[[nodiscard]] Row row_of_bias(const Case& subject, const Scene& scene, const Label& algorithm,
                              const Image<double>& plain, const Image<double>& biased,
                              const Image<double>& truth);

}  // namespace stability::surface
