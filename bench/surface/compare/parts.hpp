#pragma once

#include <vector>

#include "options.hpp"
#include "pictures.hpp"
#include "results.hpp"

/// The parts of the comparison. Each prints its tables and adds to the results.
namespace compare {

/// Alchemy obscurance against the plain loop and vector gathers, every instruction set; and how their
/// pictures agree.
void compare_aao(const Options& options, const std::vector<Picture>& pictures, Results& results);

/// What work maps save of what they could.
void compare_masks(const Options& options, const std::vector<Picture>& pictures, Results& results);

/// The other kernels over depth and normals beside obscurance with 16 samples.
void compare_rivals(const Options& options, const std::vector<Picture>& pictures, Results& results);

/// Two threads against one, beside what plain arithmetic gains.
void compare_threads(const Options& options, const std::vector<Picture>& pictures,
                     Results& results);

/// The outline stencil on the temple: as a work map, and as obscurance of its own.
void compare_outlines(const Options& options, Results& results);

/// The same obscurance as a fragment shader on one core.
void compare_llvmpipe(const Options& options, const std::vector<Picture>& pictures,
                      Results& results);

}  // namespace compare
