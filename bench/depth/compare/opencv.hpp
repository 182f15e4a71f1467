#pragma once

#include <string>
#include <vector>

#include "compare/rotation.hpp"
#include "kernels.hpp"

namespace compare {

/// OpenCV's version, or empty when the program was built without it.
[[nodiscard]] std::string opencv_version();

/// The moments by OpenCV on one thread, the shading in a plain loop of `kernels`; in this order:
///   - boxFilter and sqrBoxFilter, float in and out (OpenCV sums in double); borders reflected;
///   - integral with tables in double; borders symmetric.
/// None when the program was built without OpenCV. The images must be tight and outlive the result.
[[nodiscard]] std::vector<Contender> opencv_contenders(const Depth& depth,
                                                       const Visibility& visibility, int window,
                                                       const Kernels& kernels);

}  // namespace compare
