#pragma once

#include <string>

/// A context for OpenGL ES 3 with Mesa's rasteriser for the CPU, which compiles shaders to vector code.
namespace compare {

/// Who draws, and the version of Mesa; empty when the program was built without EGL, or when this
/// machine has no such renderer. The first call makes the context current on its thread, for good; all
/// drawing happens on that thread.
[[nodiscard]] const std::string& llvmpipe_version();

/// Compiles and links a program, and returns its number. There must be a version. Throws Failure.
[[nodiscard]] unsigned llvmpipe_program(const std::string& vertex_source,
                                        const std::string& fragment_source);

}  // namespace compare
