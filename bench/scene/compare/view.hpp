#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/camera.hpp>

#include "kernels.hpp"
#include "options.hpp"
#include "scenes/scene.hpp"

namespace compare {

/// Whether occlusion is traced to a share of the diagonal or without end.
struct Reach {
    double share;  ///< of the diagonal; infinite: no end
    const char* name;
};
inline constexpr Reach reaches[] = {
    {0.01, "1 %"}, {0.05, "5 %"}, {0.2, "20 %"}, {1e300, "unlimited"}};

/// A G-buffer.
struct Picture {
    nook::Projection projection;
    nook::ViewFrame frame;
    nook::Image<float> depth;
    nook::Image<float> normals;  ///< 3 × width: x, y, z side by side
    nook::Image<std::uint32_t> face;

    [[nodiscard]] nook::ImageView3<const float> normal() const
    {
        return nook::ImageView3<const float>::interleaved(
            normals.data(), depth.width(), depth.height(), std::ptrdiff_t{3} * depth.width());
    }
};

/// Points on the surfaces that a camera sees: pixels in tiles of 8 × 8, tile after tile, some tiles left
/// out. Each is lifted off its triangle by 10⁻⁴ of the diagonal, so that the contenders need not agree
/// on how to avoid the triangle itself.
struct PointList {
    std::vector<float> positions, normals;
    std::vector<double> axes;

    [[nodiscard]] std::size_t count() const { return positions.size() / 3; }
    [[nodiscard]] operator Points() const
    {
        return {positions.data(), normals.data(), axes.data(), count()};
    }
};

/// A mesh as its camera sees it.
struct View {
    scenes::Scene scene;
    std::string seen_from;
    double diagonal = 0;
    PointList points;  ///< about 20 000
    PointList few;     ///< about 3000

    [[nodiscard]] Sampling sampling(const Reach& reach, int directions) const;
    void print() const;
};

[[nodiscard]] std::vector<View> views(const Options& options);
[[nodiscard]] Picture draw(const scenes::Scene& scene, int width, int height);

}  // namespace compare
