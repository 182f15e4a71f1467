#pragma once

#include <cstddef>
#include <fstream>
#include <string>

namespace support {

/// What figures were measured with.
[[nodiscard]] inline std::string cpu_name()
{
    std::ifstream file{"/proc/cpuinfo"};
    for (std::string line; std::getline(file, line);) {
        const std::size_t colon = line.find(": ");
        if (line.starts_with("model name") && colon != std::string::npos)
            return line.substr(colon + 2);
    }
    return "unknown";
}

[[nodiscard]] inline std::string compiler_name()
{
#if defined(__clang__)
    return std::string{"clang++ "} + std::to_string(__clang_major__) + '.' +
           std::to_string(__clang_minor__) + '.' + std::to_string(__clang_patchlevel__);
#elif defined(__GNUC__)
    return std::string{"g++ "} + std::to_string(__GNUC__) + '.' + std::to_string(__GNUC_MINOR__) +
           '.' + std::to_string(__GNUC_PATCHLEVEL__);
#else
    return "unknown";
#endif
}

}  // namespace support
