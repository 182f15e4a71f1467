#pragma once

#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include <nook/scene/environment.hpp>

namespace information {

/// Light from all sides: a palette of nook's, or a picture of the surroundings.
class Light {
public:
    /// `name` is a palette, or a file with a picture of 8 bits or more in latitude and longitude, y up
    /// (PNG, JPEG, HDR). Throws support::Failure.
    explicit Light(const std::string& name);

    /// Three numbers in [0, 1], linear light, per direction.
    [[nodiscard]] std::vector<float> colours(const std::vector<glm::dvec3>& directions) const;

    /// The names of the palettes, for people.
    [[nodiscard]] static std::string palettes();

private:
    nook::Palette palette_ = nook::Palette::single_hue;
    int width_ = 0, height_ = 0;
    std::vector<float> pixels_;  ///< interleaved; empty for a palette
};

}  // namespace information
