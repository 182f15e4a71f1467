#pragma once

namespace nook {

/// The version of these headers; CMake and Meson read it from here.
inline constexpr char version[] = "0.1.0";

}  // namespace nook
