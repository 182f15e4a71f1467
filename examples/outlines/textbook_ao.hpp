#pragma once

#include <cmath>
#include <numbers>

#include <nook/depth/projection.hpp>
#include <nook/image.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/work_map.hpp>

/// Alchemy ambient obscurance as a renderer's source has it: pixel by pixel in float, with a table of
/// sixteen rotations, each pixel with a disc of its own (McGuire et al. 2011).
namespace outlines {

/// Places of samples on a spiral over the unit disc, in sixteen rotations; x to the right, y down.
struct RotationTable {
    static constexpr int rotations = 16, most_samples = 64;
    float right[rotations][most_samples], down[rotations][most_samples];
};

/// What the loop needs of the options, in float.
struct TextbookNumbers {
    float fx, fy, cx, cy, per_x, per_y;
    float radius, largest_slope, least_slope;
    float bias, epsilon, scale, contrast;
};

}  // namespace outlines

namespace outlines::inline NOOK_TARGET {

/// Everything at least as far is background.
inline constexpr float textbook_far = 1e30f;

/// Which rotation a pixel takes: its row's, or that of its place in a tile of 4 × 4.
[[nodiscard]] inline int rotation_of(int x, int y, nook::SamplePattern pattern)
{
    return pattern == nook::SamplePattern::row ? y * 7 % RotationTable::rotations
                                               : x % 4 + 4 * (y % 4);
}

/// The first `options.samples` places of each rotation.
inline void fill_table(RotationTable& table, const nook::AlchemyOptions& options)
{
    for (int k = 0; k < RotationTable::rotations; ++k)
        for (int i = 0; i < options.samples; ++i) {
            const double radius = (i + 0.5) / options.samples;
            const double angle = 2 * std::numbers::pi *
                                 (radius * options.turns + double(k) / RotationTable::rotations);
            table.right[k][i] = static_cast<float>(radius * std::cos(angle));
            table.down[k][i] = static_cast<float>(radius * std::sin(angle));
        }
}

[[nodiscard]] inline TextbookNumbers textbook_numbers(const nook::AlchemyOptions& options,
                                                      const nook::Projection& projection)
{
    const double square = options.radius * options.radius;
    const double pixels = projection.fx > projection.fy ? projection.fx : projection.fy;
    const double intensity = options.intensity ? *options.intensity : 0.6 * options.radius;
    return {.fx = static_cast<float>(projection.fx),
            .fy = static_cast<float>(projection.fy),
            .cx = static_cast<float>(projection.cx),
            .cy = static_cast<float>(projection.cy),
            .per_x = static_cast<float>(1 / projection.fx),
            .per_y = static_cast<float>(1 / projection.fy),
            .radius = static_cast<float>(options.radius),
            .largest_slope = static_cast<float>(options.max_pixels / pixels),
            .least_slope = static_cast<float>(1 / pixels),
            .bias = static_cast<float>(options.bias ? *options.bias : 1e-3),
            .epsilon = static_cast<float>(options.epsilon ? *options.epsilon : 0.05 * square),
            .scale = static_cast<float>(2 * intensity / options.samples),
            .contrast = static_cast<float>(options.contrast)};
}

/// Writes the visibility of every pixel; background and inactive groups of the work map get 1.
///
/// `depth` holds distances of a perspective projection, `normals` unit vectors in view axes. Of the
/// options, falloff and seed are not used; unset, the bias is 1e-3, the intensity 0.4 radii and
/// epsilon 1e-4 radii². 1 to 64 samples.
inline void textbook_ao(const nook::ImageView<const float>& depth,
                        const nook::ImageView3<const float>& normals,
                        const nook::ImageView<float>& visibility,
                        const nook::AlchemyOptions& options, const nook::Projection& projection,
                        const nook::WorkMap& work_map = {})
{
    RotationTable table;
    fill_table(table, options);
    const TextbookNumbers n = textbook_numbers(options, projection);
    const float width = static_cast<float>(depth.width), height = static_cast<float>(depth.height);
    for (int y = 0; y < depth.height; ++y)
        for (int x = 0; x < depth.width; ++x) {
            const float distance = depth(x, y);
            visibility(x, y) = 1;
            if (!(distance > 0 && distance < textbook_far) || !work_map.is_active(x, y)) continue;
            float slope = n.radius / distance;
            if (slope > n.largest_slope) slope = n.largest_slope;
            if (slope < n.least_slope) continue;

            const float middle_x = static_cast<float>(x) + 0.5f;
            const float middle_y = static_cast<float>(y) + 0.5f;
            const float px = (middle_x - n.cx) * n.per_x * distance;
            const float py = (n.cy - middle_y) * n.per_y * distance;
            const float nx = normals.x(x, y), ny = normals.y(x, y), nz = normals.z(x, y);
            const float reach_x = slope * n.fx, reach_y = slope * n.fy;
            const float bias = n.bias * distance;
            const int rotation = rotation_of(x, y, options.pattern);
            const float* const right = table.right[rotation];
            const float* const down = table.down[rotation];

            float sum = 0;
            for (int i = 0; i < options.samples; ++i) {
                const float to_x = middle_x + right[i] * reach_x;
                const float to_y = middle_y + down[i] * reach_y;
                if (!(to_x >= 0 && to_x < width && to_y >= 0 && to_y < height)) continue;
                const int at_x = static_cast<int>(to_x), at_y = static_cast<int>(to_y);
                const float there = depth(at_x, at_y);
                if (!(there > 0 && there < textbook_far)) continue;
                const float vx = (static_cast<float>(at_x) + 0.5f - n.cx) * n.per_x * there - px;
                const float vy = (n.cy - static_cast<float>(at_y) - 0.5f) * n.per_y * there - py;
                const float vz = distance - there;
                const float above = vx * nx + vy * ny + vz * nz - bias;
                sum += (above > 0 ? above : 0) / (vx * vx + vy * vy + vz * vz + n.epsilon);
            }
            const float open = 1 - n.scale * sum;
            visibility(x, y) = open > 0 ? open : 0;
            if (n.contrast != 1) visibility(x, y) = std::pow(visibility(x, y), n.contrast);
        }
}

}  // namespace outlines::inline NOOK_TARGET
