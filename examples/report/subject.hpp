#pragma once

#include <cstddef>
#include <limits>
#include <string>

#include "../scenes/scene.hpp"

namespace report {

/// A scene, and what is not part of it.
struct Subject {
    scenes::Scene scene;
    std::string what;         ///< in a line
    std::size_t dropped = 0;  ///< triangles of its file that were no good
    bool figures = false;     ///< figures 2 and 4 of Chan & Im 2021 are drawn too
    bool alone = false;       ///< an object in empty space: kernels without a radius say something
    bool thin = false;        ///< thin things hang in it: secondary rays say something
};

/// A scene at one radius: what is measured in one go, and kept.
struct Cell {
    std::string id;  ///< of its folder
    const Subject* subject = nullptr;
    /// World units; infinite: unlimited.
    double radius = 1;
    /// Relative to the scene's usual radius; infinite with it.
    double factor = 1;
    /// The one of its scene that has all meanings, and pictures in full size.
    bool principal = true;

    [[nodiscard]] bool unlimited() const
    {
        return radius == std::numeric_limits<double>::infinity();
    }
};

}  // namespace report
